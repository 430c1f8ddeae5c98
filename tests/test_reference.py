"""Observations: the tables are complete, read-only, and have the properties known of them."""

import numpy as np
import pytest

from fingerpad.data import bar_firing_rates, cylinder_deflection, protocol


def fss(observed: np.ndarray, predicted: np.ndarray) -> float:
    return 1 - ((observed - predicted) ** 2).sum() / (observed**2).sum()


def test_bar_was_observed_at_the_shifts_of_the_protocol_and_predictions_reach_the_known_scores():
    np.testing.assert_array_equal(bar_firing_rates().shift_mm, protocol.BAR_SHIFTS.value)
    observed = bar_firing_rates()
    for rates, symmetric, constant in (
        (observed.dynamic_rate_hz, 0.957, 0.559),
        (observed.static_rate_hz, 0.986, 0.445),
    ):
        assert fss(rates, (rates + rates[::-1]) / 2) == pytest.approx(symmetric, abs=5e-4)
        assert fss(rates, np.full(36, rates.mean())) == pytest.approx(constant, abs=5e-4)


def test_cylinder_deflection_is_known_at_45_points_and_one_is_an_artefact() -> None:
    observed = cylinder_deflection()
    kept = ~observed.is_artefact
    assert observed.distance_mm.size == 45
    assert (np.diff(observed.distance_mm) > 0).all()
    assert observed.deflection_mm.max() == protocol.DEPTH.value
    ends = kept & (np.abs(observed.distance_mm) > 7)
    assert (observed.deflection_mm[ends] == 0).all()
    assert observed.deflection_mm[~kept].tolist() == [0.1]


@pytest.mark.parametrize("load", [bar_firing_rates, cylinder_deflection])
def test_observations_carry_their_story_and_cannot_be_changed(load) -> None:
    observed = load()
    assert observed.source
    assert observed.status in {"paper", "read"}
    for array in vars(observed).values():
        if isinstance(array, np.ndarray):
            with pytest.raises(ValueError, match="read-only"):
                array[0] = 1
