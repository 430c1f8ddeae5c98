"""A batch of evaluations of a rate model is bit-equal to single ones, and these to the afferent's rates."""

from dataclasses import replace

import numpy as np
import pytest

from fingerpad import Traces
from fingerpad.inference.afferent_fit import ReceptorOffset
from fingerpad.inference.identifiable import identifiable
from fingerpad.inference.rate_model import AfferentModel, evaluate_rows, four_number_model
from refusals import refusals
from sections import SED_DRIVEN, sed_driven

PEAKS = np.array([0.0, 0.3, 0.8, 1.4, 1.9, 2.5])
TIMES = np.array([0.0, 10.0, 20.0, 30.0, 40.0, 50.0, 60.0, 100.0, 200.0, 500.0, 1000.0])
COURSE = np.where(TIMES <= 50.0, (TIMES / 50.0) ** 2, 0.75 + 0.25 * np.exp(-(TIMES - 50.0) / 150.0))
SED = Traces(TIMES, COURSE[:, None] * PEAKS, [50.0])
LONGER = Traces(np.append(TIMES, 1500.0), np.append(COURSE, COURSE[-1])[:, None] * PEAKS[2:4], [50.0])
MODEL = AfferentModel.of_traces(SED)
SIX = SED_DRIVEN.parameters


def scattered(parameters, n_points=37):
    random = np.random.default_rng(4)
    return parameters * np.exp(random.normal(0.0, 0.4, size=(n_points, parameters.size)))


@pytest.mark.parametrize(
    ("model", "points"),
    [
        (MODEL, scattered(SIX)),
        (AfferentModel.of_traces([SED, LONGER]), scattered(SIX)),
        (four_number_model(MODEL), scattered(identifiable(SIX))),
        (ReceptorOffset.of_traces({-0.1: SED, 0.1: SED.scaled(np.full(6, 0.5))}),
         np.column_stack([scattered(SIX), np.linspace(-0.1, 0.1, 37)])),
    ],
    ids=["six", "two motions", "four", "offset"],
)  # fmt: skip
def test_rows_equal_single_runs_to_the_bit(model, points):
    dynamic, static = evaluate_rows(model, points)
    expected = np.array([model.evaluate(point) for point in points])
    assert dynamic.shape == (37, model.n_stimuli)
    np.testing.assert_array_equal(dynamic, expected[:, 0])
    np.testing.assert_array_equal(static, expected[:, 1])
    assert (dynamic > 0.0).any(axis=1).sum() > 20
    assert (dynamic == 0.0).any(axis=1).sum() > 5


def test_single_runs_equal_the_afferent_to_the_bit():
    windows = ((20.0, 50.0), (500.0, 900.0))
    (driven,) = MODEL.drives
    chosen = AfferentModel.of_traces(SED, windows, 2.0)
    assert evaluate_rows(four_number_model(MODEL), np.empty((0, 4)))[0].shape == (0, 6)
    for point in scattered(SIX, 9):
        np.testing.assert_array_equal(MODEL.evaluate(point), sed_driven(point).rates(driven))
        rested = sed_driven(point, 2.0).rates(driven, *windows)
        np.testing.assert_array_equal(chosen.evaluate(point), rested)


def test_a_model_like_an_afferent_adapts_and_saturates_as_it_does():
    like = replace(SED_DRIVEN, adapting_share=0.3, saturation_per_ma=2e5)
    model = AfferentModel.of_traces(SED, initial_mv=like.initial_mv, like=like)
    rates = model.evaluate(like.parameters)
    np.testing.assert_array_equal(rates, like.rates(MODEL.drives[0]))
    assert rates[0].max() < 0.9 * MODEL.evaluate(like.parameters)[0].max()


test_a_row_that_is_no_afferent_is_refused = refusals(
    (lambda: evaluate_rows(MODEL, [SIX, [*SIX[:3], -1.0, *SIX[4:]]]), ("time_constant_ms",)),
    (lambda: MODEL.evaluate(SIX[:4]), "got 4 numbers"),
    (lambda: AfferentModel.of_traces(SED, refractory_ms=-1.0), ("refractory_ms",)),
    (lambda: evaluate_rows(MODEL, [SIX[:4]]), "parameters must hold .*: got 4 numbers"),
    (lambda: evaluate_rows(four_number_model(MODEL), [SIX]), r"four must hold .*: got shape \(6,\)"),
)  # fmt: skip
