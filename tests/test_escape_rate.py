"""Soft threshold: rescaled intervals are Poisson, and a narrow threshold gives the exact spikes."""

import math
from itertools import pairwise

import numpy as np
import pytest
from numpy.testing import assert_allclose, assert_array_equal
from scipy.integrate import quad, solve_ivp
from scipy.stats import kstest

from fingerpad import Traces
from fingerpad.core import threads
from fingerpad.core.random_streams import Presentations, Purpose, uniforms
from fingerpad.neuron.escape_rate import EscapeRate, _integral, panels
from fingerpad.neuron.exact_spikes import potential_at
from fingerpad.neuron.lif import LeakyIntegrateAndFire
from refusals import refusals

TAU, CAPACITANCE, THRESHOLD, REFRACTORY = 30.0, 1e-6, 50.0, 3.0
NEURON = LeakyIntegrateAndFire(TAU, CAPACITANCE, THRESHOLD, REFRACTORY)
SOFT = EscapeRate(NEURON, width=0.2)
SEED = 5


def touched(n_sites=1):
    """A ramp, a jump down and a decay."""
    times = [0.0, 20.0, 60.0, 60.0, 250.0]
    shape = np.array([[0.0], [8e-6], [6e-6], [3e-6], [2e-6]])
    return Traces(times, shape * np.linspace(1.0, 0.5, n_sites), quantity="current")


def free_potential(current, site, begin, end):
    """Potential over threshold from 0 at `begin`, by a general integrator that stops at every knot."""
    times, values = current.times_ms, current.values[:, site]
    edges = [begin, *np.unique(times[(times > begin) & (times < end)]), end]
    pieces, u = [], 0.0
    for left, right in pairwise(edges):
        knot = int(np.flatnonzero((times[:-1] <= left) & (times[1:] >= right) & (np.diff(times) > 0))[0])
        slope = (values[knot + 1] - values[knot]) / (times[knot + 1] - times[knot])

        def growth(t, u, knot=knot, slope=slope):
            return -u / TAU + (values[knot] + slope * (t - times[knot])) / (CAPACITANCE * THRESHOLD)

        solved = solve_ivp(growth, (left, right), [u], rtol=1e-11, atol=1e-13, dense_output=True)
        pieces.append((left, right, solved.sol))
        u = solved.y[0, -1]
    return pieces


def integral_of_hazard(neuron, pieces):
    def hazard(t, solution):
        return math.exp((solution(t)[0] - 1.0) / neuron.width)

    return sum(quad(hazard, left, right, (solution,), epsabs=1e-11)[0] for left, right, solution in pieces)


def test_each_interval_holds_the_exponential_number_of_its_key():
    """The integral of the hazard from the end of the rest to the next spike, by other means."""
    current = touched()
    train = SOFT.spikes(current, SEED)[0]
    wanted = -np.log1p(-uniforms(SEED, 1, 1, Purpose.ESCAPE, train.size)[0, 0])
    assert train.size > 8
    begin = 0.0
    for spike, expected in zip(train, wanted, strict=True):
        found = integral_of_hazard(SOFT, free_potential(current, 0, begin, spike))
        assert_allclose(found, expected, rtol=1e-8)
        begin = spike + REFRACTORY


def test_a_narrow_threshold_is_the_hard_one():
    exact = NEURON.spikes(touched(3))
    errors = []
    for width in (1e-3, 1e-4):
        soft = EscapeRate(NEURON, width).spikes(touched(3), SEED)
        assert_array_equal(soft.offsets, exact.offsets)
        errors.append(np.abs(soft.times_ms - exact.times_ms).max())
    # A spike is early or late by the width over the slope of the potential, times a logarithm.
    assert 0.01 < errors[0] < 5.0
    assert errors[1] < 0.25 * errors[0]


@pytest.mark.parametrize("width", [0.05, 1.0, 50.0])
def test_a_potential_at_its_limit_fires_like_a_poisson_process(width):
    """A time constant far below the refractory period: after each rest the hazard is the same."""
    neuron = LeakyIntegrateAndFire(0.02, CAPACITANCE, THRESHOLD, 1.0)
    current_ma = CAPACITANCE * THRESHOLD / 0.02 * (1.0 - width)  # holds u at 1 - width: hazard exp(-1)
    current = Traces([0.0, 1e4], [[current_ma], [current_ma]], quantity="current")
    train = EscapeRate(neuron, width).spikes(current, SEED)[0]
    intervals = np.diff(train) - 1.0
    late = intervals[intervals > 0.4] - 0.4  # the potential has arrived
    assert late.size > 1000
    assert kstest(late, "expon", args=(0.0, math.e)).pvalue > 0.001


def test_tau_e_only_moves_the_threshold():
    """exp((u - 1)/w)/t is exp((u - s)/w) with s = 1 + w ln t: threshold and width, both divided by s."""
    shift = 1.0 + 0.2 * math.log(2.0)
    moved = EscapeRate(LeakyIntegrateAndFire(TAU, CAPACITANCE, THRESHOLD * shift, REFRACTORY), 0.2 / shift)
    slow = EscapeRate(NEURON, 0.2, escape_ms=2.0)
    assert_allclose(slow.spikes(touched(), SEED)[0], moved.spikes(touched(), SEED)[0], rtol=1e-11)


def test_gauss_on_panels_errs_by_a_billionth_at_most():
    rng = np.random.default_rng(0)
    for _ in range(40):
        length, start, steady, drift = rng.uniform([0.01, -1.0, -1.0, -3.0], [2.0, 1.0, 4.0, 3.0])
        width = 10.0 ** rng.uniform(-2.0, 0.0)
        n = panels(length, start, steady, drift, width)
        coarse, fine = (np.linspace(0.0, length, pieces + 1) for pieces in (n, 4 * n))
        found, expected = (
            sum(_integral(*ends, start, steady, drift, width) for ends in pairwise(edges))
            for edges in (coarse, fine)
        )
        assert_allclose(found, expected, rtol=1e-9)
        assert potential_at(0.0, start, steady, drift) == start


def test_the_same_seed_gives_the_same_spikes_on_any_number_of_threads(monkeypatch):
    presentations = Presentations.of_one_afferent(4, n_repeats=25)
    trains = {}
    for number in (1, 3):
        monkeypatch.setattr(threads, "available_threads", lambda number=number: number)
        trains[number] = SOFT.spikes(touched(4), SEED, presentations)
    assert_array_equal(trains[1].times_ms, trains[3].times_ms)
    alone = SOFT.spikes(touched(4), SEED, Presentations([2], [70], [0]))
    assert_array_equal(alone[0], trains[1][70])


test_what_makes_no_sense_is_refused = refusals(
    (lambda: EscapeRate(NEURON, 0.0), ("width",)),
    (lambda: EscapeRate(NEURON, 0.1, escape_ms=-1.0), ("escape_ms",)),
    (lambda: SOFT.spikes(touched(), 0, Presentations([1], [0], [0])), ("sites",)),
)  # fmt: skip
