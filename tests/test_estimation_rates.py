"""Rates to be fitted: residuals make the score, a rate in closed form has slopes, a receptor may be moved."""

from dataclasses import replace
from types import SimpleNamespace

import numpy as np
import pytest

from fingerpad import InputError, RateRecordings, Traces
from fingerpad.inference import afferent_fit
from fingerpad.inference.afferent_fit import ReceptorOffset, fitted_four, fitted_six
from fingerpad.inference.fitting.methods import Bounds, LeastSquares, fractional_sum_of_squares
from fingerpad.inference.identifiable import identifiable, six_parameters
from fingerpad.inference.rate_model import (
    AfferentModel,
    RateProblem,
    closed_form_rates,
    constant_drive_rate,
    four_number_model,
)
from fingerpad.neuron.lif import LeakyIntegrateAndFire
from fingerpad.neuron.spikes import PAPER_WINDOWS_MS, firing_rate_hz
from fingerpad.neuron.transduction import drive
from refusals import refused
from sections import SED_DRIVEN, sed_driven

SHIFT_MM = np.linspace(-2.0, 2.0, 21)
FOUR = np.array([0.012, 3.2, 0.03, 45.0])
TIMES_MS = np.array([0.0, 10.0, 20.0, 30.0, 40.0, 50.0, 100.0, 300.0, 1000.0])
COURSE = np.array([0.0, 0.06, 0.2, 0.42, 0.7, 1.0, 0.92, 0.85, 0.8])
EVERYTHING = np.arange(SHIFT_MM.size)


def traces(offset_mm=0.0):
    """SED of a ramp and a relaxing hold; over the shifts a bump that is steeper on one side."""
    place = SHIFT_MM + offset_mm
    peak_kpa = 0.2 + 1.8 * np.exp(-np.square(place / np.where(place < 0.0, 0.6, 0.9)))
    return Traces(TIMES_MS, np.outer(COURSE, peak_kpa), kinks_ms=[50.0])


def problem(model, truth):
    """What an afferent with these parameters would have been recorded to answer."""
    dynamic, static = model.evaluate(truth)
    return RateProblem(model, RateRecordings(tuple(f"{shift:g}" for shift in SHIFT_MM), dynamic, static))


@pytest.fixture(scope="module")
def four_numbers():
    model = four_number_model(AfferentModel.of_traces(traces()))
    return problem(model, FOUR)


def test_residuals_make_the_score_and_the_score_is_the_papers(four_numbers):
    chosen = np.array([3, 8, 10, 11, 15])
    other = FOUR * [1.0, 1.2, 0.8, 1.1]
    residuals = four_numbers.residuals(other, chosen)
    assert residuals.shape == (10,)
    observed, (dynamic, static) = four_numbers.recordings, four_numbers.model.evaluate(other)
    in_ramp = fractional_sum_of_squares(observed.dynamic_rate_hz[chosen], dynamic[chosen])
    in_hold = fractional_sum_of_squares(observed.static_rate_hz[chosen], static[chosen])
    papers = 0.25 * in_ramp + 0.75 * in_hold
    assert four_numbers.score(other, chosen) == papers < 0.99
    assert 1.0 - residuals @ residuals == pytest.approx(papers, abs=1e-14)
    weighed = replace(four_numbers, dynamic_weight=0.4, static_weight=0.6).score(other, chosen)
    assert weighed == pytest.approx(0.4 * in_ramp + 0.6 * in_hold, abs=1e-14)
    by_phase = four_numbers.score_by_phase(other, chosen)
    assert 0.25 * by_phase["dynamic"] + 0.75 * by_phase["static"] == pytest.approx(papers, abs=1e-14)
    assert four_numbers.score(FOUR, chosen) == 1.0
    # A phase that was not recorded has no part in the score.
    alone = replace(four_numbers, recordings=replace(observed, dynamic_rate_hz=None))
    assert alone.residuals(other, EVERYTHING).shape == (21,)
    assert alone.score(other, EVERYTHING) == four_numbers.score_by_phase(other, EVERYTHING)["static"] < 0.99
    assert list(alone.score_by_phase(other, EVERYTHING)) == ["static"]
    six = six_parameters(FOUR, capacitance_mf=3e-7, threshold_mv=20.0)
    rates = AfferentModel.of_traces(traces()).evaluate(six)
    np.testing.assert_allclose(rates, four_numbers.model.evaluate(identifiable(six)), rtol=1e-9)
    with pytest.raises(InputError, match="one stimulus per column of the model's drive: got 2 for 21"):
        replace(four_numbers, recordings=observed.chosen([0, 1]))
    with refused("static_weight"):
        replace(four_numbers, static_weight=-1.0)


@pytest.mark.parametrize("drive_per_ms", [0.0, 0.0199, 0.0201, 0.03, 0.1, 1.0])
def test_a_constant_current_fires_at_the_rate_of_the_formula(drive_per_ms):
    membrane = LeakyIntegrateAndFire(50.0, 1e-6, 40.0, 1.0)
    current = np.full((2, 1), drive_per_ms * 1e-6 * 40.0)
    spikes = membrane.spikes(Traces([0.0, 5000.0], current, quantity="current"))
    rate, _, _ = constant_drive_rate([drive_per_ms], 50.0, 1.0)
    np.testing.assert_allclose(rate, firing_rate_hz(spikes, (0.0, 5000.0)), rtol=1e-9)
    assert (rate[0] > 0.0) == (drive_per_ms > 1.0 / 50.0)


@pytest.mark.parametrize("bend", [0.0, 0.05])
def test_slopes_of_the_formula_are_those_of_its_differences(bend):
    drives, tau, step = np.array([0.021, 0.03, 0.2, 1.5]), 50.0, 1e-6

    def rate(g, tau):
        return constant_drive_rate(g, tau, 1.0, bend)[0]

    _, per_drive, per_tau = constant_drive_rate(drives, tau, 1.0, bend)
    shift = step * drives
    slope = (rate(drives + shift, tau) - rate(drives - shift, tau)) / (2.0 * shift)
    np.testing.assert_allclose(per_drive, slope, rtol=1e-5)
    shift = step * tau
    slope = (rate(drives, tau + shift) - rate(drives, tau - shift)) / (2.0 * shift)
    np.testing.assert_allclose(per_tau, slope, rtol=1e-5)
    exact, gentle = (constant_drive_rate([0.015, 0.03], tau, bend=width)[0] for width in (0.0, 0.05))
    assert exact[0] == 0.0 < gentle[0]
    bent = [constant_drive_rate([0.03], tau, bend=width)[0][0] for width in (0.2, 0.1, 0.01)]
    errors = np.abs(np.array(bent) - exact[1])
    assert errors[0] > errors[1] > errors[2] < 1e-6


@pytest.mark.parametrize("by_formula", [False, True])
def test_the_truth_is_recovered_from_simulated_rates(four_numbers, by_formula):
    starts = FOUR * np.array([[0.3, 0.5, 1.6, 1.7], [1.5, 2.0, 0.5, 0.5]])
    stimuli = AfferentModel.of_traces(traces())
    slopes = four_numbers.jacobian_of(lambda four: closed_form_rates(stimuli, four)[1])
    jacobian = slopes if by_formula else None
    method = LeastSquares(starts, Bounds(0.3 * FOUR, 0.0 * FOUR, 10.0 * FOUR), jacobian=jacobian)
    fit = method.fit(four_numbers, EVERYTHING)
    assert fit.score > 0.995
    np.testing.assert_allclose(fit.parameters[1:3], FOUR[1:3], rtol=0.1)


OFFSETS_MM = (-0.4, -0.2, 0.0, 0.2, 0.4)


def offset_model():
    return ReceptorOffset.of_traces({offset: traces(offset) for offset in OFFSETS_MM})


def test_the_drive_is_the_sampled_one_and_interpolated_in_between():
    model = offset_model()
    six = SED_DRIVEN.parameters
    for offset in OFFSETS_MM:
        rates = model.evaluate(np.append(six, offset))
        np.testing.assert_array_equal(rates, AfferentModel.of_traces(traces(offset)).evaluate(six))
    middle = model.at(0.1).drives[0]
    for name in ("values", "rate_per_ms"):
        ends = [getattr(drive(traces(offset)), name) for offset in (0.0, 0.2)]
        np.testing.assert_allclose(getattr(middle, name), np.mean(ends, axis=0), rtol=1e-12, atol=1e-15)


def test_places_that_were_not_sampled_are_refused():
    with pytest.raises(InputError, match=r"offset_mm must lie within -0\.4 \.\.\. 0\.4 mm.*got 0\.5"):
        offset_model().at(0.5)
    with pytest.raises(InputError, match="got 1 offsets and 1 models"):
        ReceptorOffset.of_traces({0.0: traces()})
    with pytest.raises(InputError, match="got 2 offsets and 2 models of 2 kinds"):
        ReceptorOffset.of_traces({0.0: traces(), 0.1: Traces([0, 1000], [[0], [1]])}, PAPER_WINDOWS_MS)
    with refused("offsets_mm"):
        ReceptorOffset.of_traces({0.1: traces(), 0.0: traces()})


def test_slopes_along_the_numbers_of_a_fit_are_the_limits_of_differences(four_numbers):
    stimuli = AfferentModel.of_traces(traces())
    model = SimpleNamespace(
        n_stimuli=stimuli.n_stimuli, evaluate=lambda four: closed_form_rates(stimuli, four)[0]
    )
    search = afferent_fit.four_numbers(stimuli, four_numbers.recordings)
    fitted, bounds = search.problem, search.bounds
    numbers = np.array([FOUR[0] * FOUR[3], *FOUR[1:]])
    residuals = fitted.residuals(numbers, EVERYTHING)
    np.testing.assert_allclose(residuals, four_numbers.residuals(FOUR, EVERYTHING))
    method = search.along_slopes()
    smooth = RateProblem(model, four_numbers.recordings)
    found = method.jacobian(numbers, EVERYTHING)
    for slope, step in zip(found.T, np.diag(1e-4 * numbers), strict=True):
        above, below = (smooth.residuals(fitted_four(numbers + sign * step), EVERYTHING) for sign in (1, -1))
        difference = (above - below) / (2.0 * step.sum())
        np.testing.assert_allclose(slope, difference, rtol=1e-3, atol=1e-5 * abs(found).max())
    # No fit within the bounds fires at rest.
    highest = np.array([bounds.high[0], 0.0, 0.0, 40.0])
    untouched = Traces([0.0, 3000.0], [[0.0], [0.0]])
    assert sed_driven(fitted_six(highest)).spikes(untouched).times_ms.size == 0
