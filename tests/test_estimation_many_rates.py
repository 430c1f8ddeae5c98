"""Rates of many sets of parameters are, to the bit, those of one after the other."""

import numpy as np
import pytest

from fingerpad.core.errors import InputError
from fingerpad.core.signals import SedTraces
from fingerpad.inference.afferent_posterior import four_number_model
from fingerpad.inference.identifiable import identifiable
from fingerpad.inference.many_rates import rates_of_each
from fingerpad.inference.quick_rates import rates_under
from fingerpad.inference.rate_problem import AfferentModel
from fingerpad.neuron.afferent import Afferent
from fingerpad.neuron.transduction import drive

PEAKS = np.array([0.0, 0.3, 0.8, 1.4, 1.9, 2.5])
TIMES = np.array([0.0, 10.0, 20.0, 30.0, 40.0, 50.0, 60.0, 100.0, 200.0, 500.0, 1000.0])
COURSE = np.where(TIMES <= 50.0, (TIMES / 50.0) ** 2, 0.75 + 0.25 * np.exp(-(TIMES - 50.0) / 150.0))
MODEL = AfferentModel(drive(SedTraces(TIMES, COURSE[:, None] * PEAKS, [50.0])))


def scattered(parameters: np.ndarray, n_points: int = 37) -> np.ndarray:
    random = np.random.default_rng(4)
    return parameters * np.exp(random.normal(0.0, 0.4, size=(n_points, parameters.size)))


@pytest.mark.parametrize(
    ("model", "points"),
    [
        (MODEL, scattered(Afferent().parameters)),
        (four_number_model(MODEL), scattered(identifiable(Afferent().parameters))),
    ],
    ids=["six", "four"],
)
def test_rows_equal_single_runs_to_the_bit(model, points: np.ndarray) -> None:
    dynamic, static = rates_of_each(model, points)
    expected = np.array([model.rates(point) for point in points])
    np.testing.assert_array_equal(dynamic, expected[:, 0])
    np.testing.assert_array_equal(static, expected[:, 1])
    assert (dynamic > 0.0).any(axis=1).sum() > 20
    assert (dynamic == 0.0).any(axis=1).sum() > 5


def test_single_runs_equal_the_afferent_to_the_bit() -> None:
    windows = ((20.0, 50.0), (500.0, 900.0))
    quick, chosen = rates_under(MODEL.drive), rates_under(MODEL.drive, 2.0, windows)
    for point in scattered(Afferent().parameters, 9):
        np.testing.assert_array_equal(quick(point), Afferent.from_parameters(point).rates(MODEL.drive))
        rested = Afferent.from_parameters(point, 2.0).rates(MODEL.drive, *windows)
        np.testing.assert_array_equal(chosen(point), rested)
        np.testing.assert_array_equal(MODEL.rates(point), quick(point))


def test_any_other_model_is_asked_row_by_row() -> None:
    class Plain:
        names = ("a",)
        n_stimuli = 2

        def rates(self, parameters):
            return parameters[0] * np.array([1.0, 2.0]), parameters[0] * np.array([3.0, 4.0])

    dynamic, static = rates_of_each(Plain(), np.arange(9.0)[:, None])
    np.testing.assert_array_equal(dynamic, np.outer(np.arange(9.0), [1.0, 2.0]))
    np.testing.assert_array_equal(static, np.outer(np.arange(9.0), [3.0, 4.0]))


def test_a_row_that_is_no_afferent_is_refused() -> None:
    points = scattered(Afferent().parameters, 3)
    points[1, 3] = -1.0
    with pytest.raises(InputError, match="time_constant_ms must be greater than 0"):
        rates_of_each(MODEL, points)
    with pytest.raises(InputError, match="got 4 numbers"):
        MODEL.rates(points[0, :4])
    with pytest.raises(InputError, match="refractory_ms must not be negative"):
        AfferentModel(MODEL.drive, -1.0)
    with pytest.raises(InputError, match=r"points must have 6 columns: got shape \(3, 4\)"):
        rates_of_each(MODEL, points[:, :4])
