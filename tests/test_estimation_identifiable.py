"""Four identifiable parameters determine the spikes and can be converted to six and back."""

import numpy as np
import pytest

from fingerpad import Traces
from fingerpad.inference.identifiable import (
    LARGEST_RESTING_SHARE,
    identifiable,
    silent_at_rest,
    six_parameters,
)
from refusals import refusals
from sections import sed_driven

SIX = np.array([2.3e-7, 1.0e-4, 5.6e-7, 72.0, 6.0e-7, 30.0])
SED = Traces([0.0, 25.0, 50.0, 1000.0], [[0.0, 0.0], [0.4, 0.9], [1.0, 2.0], [0.8, 1.7]], [50.0])


@pytest.mark.parametrize(("capacitance", "threshold"), [(6.0e-7, 30.0), (1.0e-6, 50.0), (3.0e-7, 90.0)])
def test_spikes_depend_on_the_four_numbers_alone(capacitance, threshold):
    scale = 6.0e-7 * 30.0
    by_hand = [2.3e-7 / scale, 1e-4 / scale, 5.6e-7 / scale, 72.0]
    np.testing.assert_allclose(identifiable(SIX), by_hand, rtol=1e-14)
    np.testing.assert_array_equal(identifiable([SIX, 2.0 * SIX])[0], identifiable(SIX))
    others = six_parameters(identifiable(SIX), capacitance, threshold)
    np.testing.assert_array_equal(six_parameters(identifiable([SIX]), capacitance, threshold)[0], others)
    assert others[4:].tolist() == [capacitance, threshold]
    np.testing.assert_allclose(identifiable(others), identifiable(SIX), rtol=1e-14)
    expected, found = (sed_driven(six).spikes(SED) for six in (SIX, others))
    np.testing.assert_array_equal(found.offsets, expected.offsets)
    np.testing.assert_allclose(found.times_ms, expected.times_ms, rtol=1e-11)
    # Each of the four does move spikes.
    for index in range(4):
        moved = identifiable(SIX)
        moved[index] *= 1.05
        other = sed_driven(six_parameters(moved)).spikes(SED)
        assert abs(other[1][3] - expected[1][3]) > 0.005


test_what_are_not_such_numbers_is_refused = refusals(
    (lambda: identifiable(SIX[:5]), "parameters must hold intercept_ma, .*got shape \\(5,\\)"),
    (lambda: identifiable([*SIX[:5], np.nan]), "parameters must hold finite numbers only: 1"),
    (lambda: identifiable([*SIX[:4], 0.0, 30.0]), "must be greater than 0"),
    (lambda: six_parameters(SIX), "four must hold intercept_per_ms, .*got shape \\(6,\\)"),
    (lambda: six_parameters(SIX[:4], threshold_mv=0.0), ("threshold_mv",)),
    (lambda: six_parameters(["a"] * 4), "four must be an array of numbers"),
)  # fmt: skip


def test_an_afferent_at_rest_is_lowered_to_the_bound_and_another_one_is_kept():
    firing, quiet = [1.2e-6, 2e-4, 7e-7, 50.0, 1e-6, 50.0], [4e-7, 2e-4, 7e-7, 50.0, 1e-6, 50.0]
    lowered = silent_at_rest([firing, quiet])
    np.testing.assert_array_equal(lowered[1], quiet)
    np.testing.assert_array_equal(lowered[0, 1:], firing[1:])
    assert identifiable(lowered[0])[0] * 50.0 == pytest.approx(LARGEST_RESTING_SHARE)
    untouched = Traces([0.0, 2000.0], [[0.0], [0.0]])
    assert sed_driven(lowered[0]).spikes(untouched).times_ms.size == 0
    assert sed_driven(firing).spikes(untouched).times_ms.size > 0
