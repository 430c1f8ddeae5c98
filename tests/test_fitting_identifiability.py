"""Directions in parameter space that no observation determines are found."""

import numpy as np

from fingerpad import Traces
from fingerpad.inference.fitting.sensitivity import identifiability
from fingerpad.inference.identifiable import IDENTIFIABLE_NAMES, identifiable, six_parameters
from fingerpad.inference.rate_model import AfferentModel
from fingerpad.neuron.afferent import PARAMETER_NAMES
from refusals import refusals
from sections import SED_DRIVEN

PEAKS = np.array([0.3, 0.8, 1.4, 1.9, 2.5])
TIMES = np.array([0.0, 10.0, 20.0, 30.0, 40.0, 50.0, 60.0, 100.0, 200.0, 500.0, 1000.0])
COURSE = np.where(TIMES <= 50.0, (TIMES / 50.0) ** 2, 0.75 + 0.25 * np.exp(-(TIMES - 50.0) / 150.0))
MODEL = AfferentModel.of_traces(Traces(TIMES, COURSE[:, None] * PEAKS, [50.0]))


def rates(six):
    return np.concatenate(MODEL.evaluate(six))


def test_rates_determine_four_of_six_parameters_and_not_two_scalings():
    found = identifiability(rates, SED_DRIVEN.parameters, PARAMETER_NAMES)
    assert found.rank == 4
    assert found.singular_values[4] < 1e-6 * found.singular_values[0]
    assert found.singular_values[3] > 1e-4 * found.singular_values[0]
    # C or v by a factor, and the three gains with it: both lie in the silent plane.
    for scaling in ([1, 1, 1, 0, 1, 0], [1, 1, 1, 0, 0, 1]):
        unit = np.array(scaling) / np.linalg.norm(scaling)
        in_plane = found.silent_directions.T @ (found.silent_directions @ unit)
        np.testing.assert_allclose(in_plane, unit, atol=1e-3)
    four = identifiable(SED_DRIVEN.parameters)
    found = identifiability(lambda numbers: rates(six_parameters(numbers)), four, IDENTIFIABLE_NAMES)
    assert found.rank == 4
    assert found.silent_directions.shape == (0, 4)


def test_steps_are_so_small_that_a_staircase_is_level():
    assert identifiability(lambda p: np.floor(10.0 * p) / 10.0, [0.55], ("a",)).singular_values[0] == 0.0


test_what_has_no_jacobian_is_refused = refusals(
    (lambda: identifiability(np.exp, [1.0, 0.0], ("a", "b")), ("parameters",)),
    (lambda: identifiability(lambda p: p * np.nan, [1.0], ("a",)), "answer must hold finite numbers only"),
)  # fmt: skip
