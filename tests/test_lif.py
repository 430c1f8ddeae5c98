import math
from dataclasses import replace
from decimal import Decimal, localcontext

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st
from numpy.testing import assert_allclose, assert_array_equal
from scipy.optimize import brentq

from benchmarks.runge_kutta import runge_kutta_spikes
from fingerpad import InputError, Traces
from fingerpad.core import threads
from fingerpad.core.threads import BLOCK
from fingerpad.neuron.exact_spikes import _next_guess
from fingerpad.neuron.lif import LeakyIntegrateAndFire
from refusals import refused

TAU, CAPACITANCE, THRESHOLD, REFRACTORY = 68.0, 1e-6, 50.0, 1.0
NEURON = LeakyIntegrateAndFire(TAU, CAPACITANCE, THRESHOLD, REFRACTORY)
RHEOBASE = THRESHOLD * CAPACITANCE / TAU  # the steady current whose potential only just approaches v


def constant(current_ma, end_ms=1000.0):
    return Traces([0.0, end_ms], [[current_ma], [current_ma]], quantity="current")


@pytest.mark.parametrize("current_ma", [1.001 * RHEOBASE, 2.0 * RHEOBASE, 1e-5, 1e-3])
def test_constant_current_fires_at_the_closed_form_interval(current_ma):
    charging = -TAU * math.log1p(-THRESHOLD * CAPACITANCE / (current_ma * TAU))
    spikes = NEURON.spikes(constant(current_ma, 3000.0))[0]
    expected = charging + (charging + REFRACTORY) * np.arange(spikes.size)
    assert spikes.size == math.floor((3000.0 - charging) / (charging + REFRACTORY)) + 1
    assert_allclose(spikes, expected, rtol=1e-11)


def test_too_little_current_is_silent_and_too_much_fires_once_per_refractory_period():
    for current_ma in (0.0, 0.5 * RHEOBASE, RHEOBASE * (1.0 - 1e-9), -1e-5):
        assert NEURON.spikes(constant(current_ma, 1e4)).times_ms.size == 0
    assert_allclose(NEURON.spikes(constant(1e300, 10.5))[0], np.arange(11.0), atol=1e-9)


def peak_of_falling_current(first, slope):
    """Time and height of the maximum of the potential under I = first + slope t, slope < 0, from 0."""
    offset = TAU / CAPACITANCE * (first - slope * TAU)
    top = TAU * math.log(offset / (-slope * TAU**2 / CAPACITANCE))
    return top, offset + TAU * slope / CAPACITANCE * top - offset * math.exp(-top / TAU)


def test_a_threshold_reached_only_between_two_knots_is_found():
    first, slope = 2e-6, -1.5e-8
    top, height = peak_of_falling_current(first, slope)
    end = 400.0
    current = Traces([0.0, end], [[first], [first + slope * end]], quantity="current")
    assert 0.0 < top < end
    touching = LeakyIntegrateAndFire(TAU, CAPACITANCE, height * (1.0 - 1e-9), REFRACTORY).spikes(current)[0]
    missing = LeakyIntegrateAndFire(TAU, CAPACITANCE, height * (1.0 + 1e-9), REFRACTORY).spikes(current)[0]
    assert touching.size == 1
    assert missing.size == 0
    # Height is quadratic about the top: a part in 1e9 of it is sqrt(2 h 1e-9 / |u''|) earlier.
    bend = abs(slope / CAPACITANCE)
    assert_allclose(top - touching[0], math.sqrt(2.0 * height * 1e-9 / bend), rtol=1e-3)


def test_time_may_be_shifted_and_capacitance_and_threshold_only_scale_the_current():
    times = np.array([0.0, 20.0, 60.0, 60.0, 300.0])
    current = np.array([[0.0], [6e-6], [4e-6], [1.5e-6], [1e-6]])
    here = NEURON.spikes(Traces(times, current, quantity="current")).times_ms
    there = NEURON.spikes(Traces(times + 128.0, current, quantity="current")).times_ms
    assert here.size > 5
    assert_allclose(there - 128.0, here, rtol=0.0, atol=1e-9)
    scaled = LeakyIntegrateAndFire(TAU, 2.0 * CAPACITANCE, 3.0 * THRESHOLD, REFRACTORY)
    assert_allclose(
        scaled.spikes(Traces(times, 6.0 * current, quantity="current")).times_ms, here, rtol=1e-11
    )
    jump = NEURON.spikes(Traces([0.0, 40.0, 40.0, 100.0], [[0.0], [0.0], [5e-6], [5e-6]], quantity="current"))
    assert_allclose(jump.times_ms, 40.0 + NEURON.spikes(constant(5e-6, 60.0)).times_ms, rtol=1e-13)


def bumpy_current(n_sites=4):
    rng = np.random.default_rng(7)
    times = np.sort(np.concatenate([[0.0, 50.0, 50.0, 300.0], rng.uniform(0.0, 300.0, 40)]))
    return Traces(times, rng.uniform(-1e-6, 6e-6, (times.size, n_sites)), quantity="current")


def test_runge_kutta_approaches_the_exact_spikes_as_its_step_shrinks():
    current = bumpy_current()
    exact = NEURON.spikes(current)
    errors = []
    for step_ms in (0.01, 0.001):
        stepped = runge_kutta_spikes(NEURON, current, step_ms)
        assert_array_equal(stepped.offsets, exact.offsets)
        errors.append(np.abs(stepped.times_ms - exact.times_ms).max())
    assert exact.times_ms.size > 20
    assert errors[0] < 0.01 * 20
    assert errors[1] < 0.3 * errors[0]
    # A delay is handed on: spike k is late by at most k + 1 steps under a steady current.
    steady = constant(3e-6, 300.0)
    late = runge_kutta_spikes(NEURON, steady, 0.001)[0] - NEURON.spikes(steady)[0]
    assert late.size > 10
    assert (late > -1e-9).all()
    assert (late < 0.001 * np.arange(1, late.size + 1) + 1e-9).all()
    with refused("step_ms"):
        runge_kutta_spikes(NEURON, steady, 0.0)


def slow_reference(times, current, neuron, samples=4000):
    """Sample the closed form densely, bisect the first sample at or above the threshold."""
    tau, capacitance = neuron.time_constant_ms, neuron.capacitance_mf
    spikes, ready = [], times[0]
    potential = current[0] * tau / capacitance
    potential = potential if potential < neuron.threshold_mv else 0.0
    for knot in range(len(times) - 1):
        start, end = times[knot], times[knot + 1]
        begin = max(start, ready)
        while begin < end:
            slope = (current[knot + 1] - current[knot]) / (end - start)
            first = current[knot] + slope * (begin - start)

            def after(s, first=first, slope=slope, potential=potential):
                gone = -np.expm1(-s / tau)
                return potential * (1 - gone) + tau / capacitance * (first * gone + slope * (s - tau * gone))

            s = np.linspace(0.0, end - begin, samples)
            above = np.flatnonzero(after(s) >= neuron.threshold_mv)
            if above.size == 0:
                potential = after(end - begin)
                break
            low, high = s[above[0] - 1], s[above[0]]
            for _ in range(60):
                middle = 0.5 * (low + high)
                low, high = (low, middle) if after(middle) >= neuron.threshold_mv else (middle, high)
            spikes.append(begin + high)
            potential, ready = 0.0, begin + high + neuron.refractory_ms
            begin = ready
    return spikes


@settings(max_examples=25, deadline=None)
@given(st.lists(st.floats(-3e-6, 9e-6), min_size=3, max_size=7), st.floats(3.0, 200.0), st.floats(5.0, 60.0))
def test_random_currents_match_the_slow_reference(current, tau, spacing):
    neuron = LeakyIntegrateAndFire(tau, 1e-6, 50.0, 1.0)
    times = spacing * np.arange(len(current))
    fast = neuron.spikes(Traces(times, np.array(current)[:, np.newaxis], quantity="current"))[0]
    slow = slow_reference(times, current, neuron)
    # A maximum that only grazes the threshold may be missed by the samples; everything before must agree.
    shared = min(len(slow), fast.size)
    assert abs(len(slow) - fast.size) <= 1
    assert_allclose(fast[:shared], slow[:shared], rtol=1e-7)


def test_many_neurons_fire_as_each_does_alone_on_any_number_of_threads(monkeypatch):
    current = bumpy_current(2 * BLOCK + 3)
    answers = []
    for number in (1, 3):
        monkeypatch.setattr(threads, "available_threads", lambda number=number: number)
        answers.append(NEURON.spikes(current))
    one, several = answers
    assert_array_equal(one.times_ms, several.times_ms)
    assert_array_equal(one.offsets, several.offsets)
    for neuron in (0, BLOCK - 1, BLOCK, 2 * BLOCK + 2):
        alone = NEURON.spikes(Traces(current.times_ms, current.values[:, [neuron]], quantity="current"))
        assert_array_equal(alone.times_ms, one[neuron])


def test_neurons_side_by_side_match_the_slow_reference_each():
    """Silent, hardly firing and fast ones, resting across knots, jumps and falls between two knots."""
    times = np.array([0.0, 0.3, 0.9, 3.0, 20.0, 20.0, 20.001, 60.0, 100.0, 400.0])
    shapes = np.random.default_rng(3).uniform(-0.2, 1.0, (times.size, 24))
    current = shapes * np.geomspace(0.8 * RHEOBASE, 60.0 * RHEOBASE, 24)
    neuron = LeakyIntegrateAndFire(TAU, CAPACITANCE, THRESHOLD, 2.0)
    trains = neuron.spikes(Traces(times, current, quantity="current"))
    counts = np.diff(trains.offsets)
    assert (counts == 0).any()
    assert counts.max() >= 100
    for train, course in zip(trains, current.T, strict=True):
        slow = slow_reference(times, course, neuron)
        assert train.size == len(slow)
        assert_allclose(train, slow, rtol=0.0, atol=1e-10)


def test_a_guess_called_exact_is_exact_and_one_step_makes_most_guesses_so():
    """From guesses within 1 % of the crossing; the crossing is bisected to round-off."""
    rng = np.random.default_rng(11)
    called_exact = 0
    trials = 400
    for trial in range(trials):
        steady, drift = THRESHOLD * rng.uniform(1.5, 30.0), THRESHOLD * rng.uniform(-0.5, 20.0)
        if trial % 4 == 0:
            # Rise = 3 drift at the crossing: Halley's own error vanishes, and that of the series stays.
            x = rng.uniform(0.1, 0.5)
            gone = -math.expm1(-x)
            rise = THRESHOLD * (1.0 - gone) / ((1.0 - x / 3.0) * gone + (x - gone) / 3.0)
            steady, drift = THRESHOLD + rise * (1.0 - x / 3.0), rise / 3.0

        def missing(x, steady=steady, drift=drift):
            gone = -math.expm1(-x)
            return THRESHOLD - (steady * gone + drift * (x - gone))

        crossing = brentq(missing, 0.0, 2.0, xtol=1e-300, rtol=1e-15)
        guess = crossing * (1.0 + 10.0 ** rng.uniform(-6.0, -1.0) * rng.choice([-1.0, 1.0]))
        rise = steady + drift * guess - (THRESHOLD - missing(guess))
        better, exact = _next_guess(guess, missing(guess), rise, drift, 2.0 * crossing)
        called_exact += exact
        if exact:
            assert_allclose(better, crossing, rtol=4e-15)
        else:
            assert abs(better - crossing) < 0.1 * abs(guess - crossing)
    assert 0.7 * trials < called_exact < trials


def test_spike_times_are_exact_to_the_round_off_of_the_potential():
    """Against the crossing of the closed form itself, bisected with fifty digits."""
    first, slope = 2e-6, 3e-9
    spike = NEURON.spikes(Traces([0.0, 200.0], [[first], [first + 200.0 * slope]], quantity="current"))[0][0]
    with localcontext(prec=50):
        tau, capacitance, threshold = Decimal(TAU), Decimal(CAPACITANCE), Decimal(THRESHOLD)
        m = (Decimal(first + 200.0 * slope) - Decimal(first)) / 200

        def above(s):
            gone = 1 - (-s / tau).exp()
            return tau / capacitance * (Decimal(first) * gone + m * (s - tau * gone)) - threshold

        low, high = Decimal(0), Decimal(200)
        while high - low > Decimal("1e-25"):
            middle = (low + high) / 2
            low, high = (low, middle) if above(middle) >= 0 else (middle, high)
    assert_allclose(spike, float(high), rtol=1e-14)


@pytest.mark.parametrize("name", ["time_constant_ms", "capacitance_mf", "threshold_mv", "refractory_ms"])
def test_a_membrane_needs_positive_numbers(name):
    for value in (0.0, -1.0, math.inf):
        with pytest.raises(InputError, match=name):
            replace(NEURON, **{name: value})
