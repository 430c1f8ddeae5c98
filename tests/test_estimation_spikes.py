"""Likelihood of spike trains: against a slow reference, its derivatives, and spikes of known parameters."""

import math
from functools import cache
from itertools import pairwise

import numpy as np
import pytest
from numpy.testing import assert_allclose, assert_array_equal
from scipy.integrate import solve_ivp
from scipy.special import ndtri
from scipy.stats import binom

from fingerpad import ConvergenceError, SpikeTrains, Traces
from fingerpad.core import threads
from fingerpad.core.random_streams import Presentations
from fingerpad.inference.identifiable import canonical, six_parameters
from fingerpad.inference.spike_likelihood import SpikeLikelihood, fit_spikes, time_rescaling
from fingerpad.neuron.escape_rate import EscapeRate
from fingerpad.neuron.transduction import Drive, drive
from refusals import refusals
from sections import SED_DRIVEN, sed_driven

TRUTH = np.array([0.0127, 5.6, 0.031, 40.0, 0.25])
"""Like our fit to the recordings, but for a shorter memory, which fewer spikes determine."""

START = [0.0, 4.0, 0.014, 68.0, 0.5]
REFRACTORY = 1.0


@cache
def touched():
    """A ramp and a relaxing hold at six strengths, from nearly silent to strong."""
    strengths = np.linspace(0.3, 2.0, 6)
    times = np.concatenate([np.linspace(0.0, 50.0, 5), [60.0, 80.0, 150.0, 300.0]])
    hold = 0.8 + 0.2 * np.exp(-(times - 50.0) / 100.0)
    shape = np.where(times <= 50.0, (times / 50.0) ** 1.5, hold)
    return drive(Traces(times, shape[:, np.newaxis] * strengths, [50.0]), pieces=8)


def simulated(seed, n_repeats=12, parameters=TRUTH):
    """Spikes of an afferent with these parameters under all six touches."""
    afferent = sed_driven(six_parameters(parameters[:4]), REFRACTORY)
    presentations = Presentations.of_one_afferent(6, n_repeats)
    current = afferent.transduction.current(touched())
    spikes = EscapeRate(afferent.membrane, parameters[4]).spikes(current, seed, presentations)
    return SpikeLikelihood(touched(), spikes, presentations.sites)


@cache
def recorded():
    return simulated(seed=0)


def slow_log_likelihood(driven, train, end, parameters, escape_ms):
    """A general integrator for potential and integral of the hazard together, from knot to knot."""
    a, b, c, tau, width = parameters
    times = driven.times_ms
    value, ready = 0.0, times[0]
    u = tau * (a + b * driven.rate_per_ms[0, 0] + c * driven.values[0, 0])
    spikes = [*train, math.inf]
    events = np.unique([*times, *train, *(train + REFRACTORY), end])
    for left, right in pairwise(events[events <= end]):
        if left < ready:
            continue
        knot = int(np.flatnonzero((times[:-1] <= left) & (times[1:] >= right) & (np.diff(times) > 0))[0])

        def line(values, t, knot=knot):
            share = (t - times[knot]) / (times[knot + 1] - times[knot])
            return values[knot, 0] + share * (values[knot + 1, 0] - values[knot, 0])

        def growth(t, state, line=line):
            drive_now = a + b * line(driven.rate_per_ms, t) + c * line(driven.values, t)
            return [-state[0] / tau + drive_now, math.exp((state[0] - 1.0) / width) / escape_ms]

        solved = solve_ivp(growth, (left, right), [u, 0.0], rtol=1e-10, atol=1e-12)
        u = solved.y[0, -1]
        value -= solved.y[1, -1]
        if right == spikes[0]:
            value += (u - 1.0) / width - math.log(escape_ms)
            u, ready = 0.0, right + REFRACTORY
            spikes.pop(0)
    return value


@pytest.mark.parametrize("escape_ms", [1.0, 2.5])
def test_the_likelihood_is_that_of_a_slow_integrator(escape_ms):
    times = np.array([0.0, 0.0, 20.0, 45.0, 45.0, 80.0])
    rates = np.array([0.0, 0.04, 0.06, 0.02, 0.0, 0.0])[:, np.newaxis]
    seds = np.array([0.0, 0.0, 1.0, 2.0, 2.0, 1.8])[:, np.newaxis]
    driven = Drive(times, seds, rates)
    train = np.array([9.0, 20.0, 24.5, 44.3, 60.0])  # on a knot, and at rest over one
    for parameters in (TRUTH, [-0.01, 2.0, 0.06, 8.0, 0.6]):
        trains = SpikeTrains.from_lists([train, []])
        found = SpikeLikelihood(driven, trains, [0, 0], [70.0, 33.0], REFRACTORY, escape_ms)
        expected = slow_log_likelihood(driven, train, 70.0, parameters, escape_ms)
        expected += slow_log_likelihood(driven, np.empty(0), 33.0, parameters, escape_ms)
        assert_allclose(found.log_likelihood(parameters), expected, rtol=1e-8)


def test_gradient_is_the_slope_of_the_likelihood():
    value, gradient, _ = recorded().derivatives(TRUTH * 1.05)
    assert value == recorded().log_likelihood(TRUTH * 1.05)
    for number in range(5):
        step = np.zeros(5)
        step[number] = 1e-4 * TRUTH[number]
        above, below = (recorded().log_likelihood(TRUTH * 1.05 + sign * step) for sign in (1, -1))
        assert_allclose(gradient[number], (above - below) / (2.0 * step[number]), rtol=1e-4)


def test_information_is_the_curvature_where_the_hazard_is_log_linear():
    """In A, B, C and G it is exact, spikes or not."""
    here = canonical(TRUTH)
    _, _, information = recorded().canonical_derivatives(here)
    assert_array_equal(information, information.T)
    for number in range(4):
        step = np.zeros(5)
        step[number] = 1e-4 * here[number]
        above, below = (recorded().canonical_derivatives(here + sign * step)[1] for sign in (1, -1))
        curvature = -(above - below) / (2.0 * step[number])
        assert_allclose(curvature[:4], information[number, :4], rtol=1e-4)


def test_the_likelihood_has_the_same_bits_on_any_number_of_threads(monkeypatch):
    values = []
    for number in (1, 3):
        monkeypatch.setattr(threads, "available_threads", lambda number=number: number)
        values.append(recorded().derivatives(TRUTH))
    for one, three in zip(*values, strict=True):
        assert_array_equal(one, three)


def test_rescaled_intervals_are_exponential_under_the_truth_and_not_beside_it():
    assert time_rescaling(recorded(), TRUTH).p_value > 0.01
    for number in (1, 2, 4):
        wrong = TRUTH.copy()
        wrong[number] *= 1.2
        assert time_rescaling(recorded(), wrong).p_value < 1e-4


def test_operational_times_add_up_to_the_integral_of_the_hazard():
    """Silent recordings count too: the last time is that of the last spike, trains end to end."""
    parts = [[40.0, 90.0], [], [33.0]]
    whole = SpikeLikelihood(touched(), SpikeTrains.from_lists(parts), [2, 4, 3])
    none = SpikeTrains.from_lists([[]])
    first, silent, third = (
        -SpikeLikelihood(touched(), none, [site], end_ms).log_likelihood(TRUTH)
        for site, end_ms in ((2, 40.0), (4, 300.0), (3, 33.0))
    )
    alone = SpikeLikelihood(touched(), SpikeTrains.from_lists([parts[0]]), [2])
    spikes_only = alone.operational_times(TRUTH)
    # log L = sum ln h - integral, and d log L/dG tells the integral: by its difference at two G.
    found = whole.operational_times(TRUTH)
    assert_allclose(found[:2], spikes_only, rtol=1e-12)
    assert_allclose(found[0], first, rtol=1e-10)
    _, gradient, _ = alone.canonical_derivatives(canonical(TRUTH))
    assert_allclose(found[2], gradient[3] + 2 + silent + third, rtol=1e-10)


def test_a_fit_ends_on_top_from_near_and_far():
    near, far, wide = (fit_spikes(recorded(), start) for start in (TRUTH, START, [0.05, 1.0, 0.1, 10.0, 2.0]))
    for other in (far, wide):
        assert np.all(np.abs(other.parameters - near.parameters) < 1e-2 * near.standard_errors)
    _, gradient, _ = recorded().derivatives(near.parameters)
    assert np.all(np.abs(gradient) * near.standard_errors < 1e-2)
    assert np.all(np.diff(far.history) > 0.0)
    assert far.log_likelihood == recorded().log_likelihood(far.parameters)
    assert far.log_likelihood > recorded().log_likelihood(TRUTH)


def interval(fit, level):
    """Confidence interval of each parameter (5, 2), in the logarithm for tau and the width."""
    reach = ndtri(0.5 + 0.5 * level) * fit.standard_errors
    low, high = fit.parameters - reach, fit.parameters + reach
    factor = np.exp(reach[3:] / fit.parameters[3:])
    low[3:], high[3:] = fit.parameters[3:] / factor, fit.parameters[3:] * factor
    return np.stack([low, high], axis=1)


def test_intervals_have_their_nominal_coverage_and_estimates_scatter_by_their_errors():
    """Recovery: how many of forty data sets hold each true parameter is a binomial number."""
    fits = [fit_spikes(simulated(seed), START) for seed in range(100, 140)]
    for level in (0.5, 0.8, 0.95):
        intervals = np.array([interval(fit, level) for fit in fits])
        holds = ((intervals[:, :, 0] < TRUTH) & (intervals[:, :, 1] > TRUTH)).sum(axis=0)
        fewest, most = binom.ppf([0.001, 0.999], 40, level)
        assert np.all((fewest <= holds) & (holds <= most)), (level, holds)
    scores = np.array([(fit.parameters - TRUTH) / fit.standard_errors for fit in fits])
    assert np.all(np.abs(scores.mean(axis=0)) < 3.5 / math.sqrt(40))
    assert np.all(np.abs(scores.std(axis=0) - 1.0) < 3.5 / math.sqrt(80))


def test_one_strength_without_a_ramp_does_not_determine_both_gains():
    held = Drive([0.0, 1e4], [[1.0], [1.0]], [[0.0], [0.0]])
    spikes = EscapeRate(SED_DRIVEN.membrane, 0.2).spikes(SED_DRIVEN.transduction.current(held), 1)
    with pytest.raises(ConvergenceError, match="determine all parameters: these do not"):
        fit_spikes(SpikeLikelihood(held, spikes), START)
    afferent = sed_driven(six_parameters(TRUTH[:4]), REFRACTORY)
    with pytest.raises(ConvergenceError, match="too regular"):  # a clock has no width
        fit_spikes(SpikeLikelihood(touched(), afferent.spikes(touched())), START)


def changed(change):
    sound = {"drive": touched(), "trains": SpikeTrains.from_lists([[10.0, 20.0], [60.0]]), "sites": [0, 1]}
    assert SpikeLikelihood(**sound).n_spikes == 3
    return SpikeLikelihood(**(sound | change))


test_recordings_that_make_no_sense_are_refused = refusals(
    ({"sites": [0]}, "sites must name one of 6 columns"),
    ({"sites": [0, 6]}, "sites must name one of 6 columns"),
    ({"duration_ms": 400.0}, "duration_ms must lie within the drive, 0 ... 300 ms"),
    ({"duration_ms": [0.0, 300.0]}, "duration_ms must lie within"),
    ({"duration_ms": 50.0}, "train 1 has one at 60 ms"),
    ({"refractory_ms": 0.0}, ("refractory_ms",)),
    ({"refractory_ms": 10.0}, "train 0 has two at 10 and 20 ms"),
    ({"escape_ms": -1.0}, ("escape_ms",)),
    ({"trains": SpikeTrains.from_lists([[0.0], []])}, "train 0 has one at 0 ms"),
    ({"drive": 3.0}, ("drive",)),
    call=changed,
)

test_uncomputable_likelihoods_are_an_error = refusals(
    (lambda data: data.log_likelihood(TRUTH[:4]), ("parameters",)),
    (lambda data: data.log_likelihood([*TRUTH[:4], 0.0]), ("escape_width",)),
    (lambda data: data.log_likelihood([*TRUTH[:3], -1.0, 0.1]), ("time_constant_ms",)),
    (lambda data: fit_spikes(data, TRUTH), "at least as many spikes: got 0"),
    (lambda data: time_rescaling(data, TRUTH), "at least one spike"),
    (lambda data: fit_spikes(recorded(), [10.0, 0.0, 0.0, 40.0, 1e-3]), "take a wider threshold"),
    call=lambda wrong: wrong(SpikeLikelihood(touched(), SpikeTrains.from_lists([[]]))),
)
