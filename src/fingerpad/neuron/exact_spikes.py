"""Kernels of `fingerpad.neuron.lif` that compute when many membranes cross their threshold.

With R = tau/C, w = R I (the steady potential of the present current) and the time x = s/tau, Eq. 5 reads
du/dx = w - u. Between two knots the current is linear, w = w0 + c x, and the potential has the closed form

    u(x) = u0 + (w0 - u0) g + c (x - g),    g = 1 - e^-x,

whose slope is monotone: u has at most one extremum between two knots. A crossing of the threshold can
therefore be bracketed, and is then refined to round-off.
"""

from __future__ import annotations

import math

import numpy as np
from numba import njit

from fingerpad.core.values import FloatArray

Constants = tuple[float, float, float, float, float]
"""tau [ms], C [mF], threshold [mV], refractory period [ms], and initial potential [mV], NaN if at rest."""

_MOST_REFINEMENTS = 200
_ROUND_OFF = 4.0 * float(np.finfo(np.float64).eps)


@njit(cache=True, error_model="numpy", nogil=True)
def _potential(x: float, gone: float, start: float, steady: float, drift: float) -> float:
    """Solve Eq. 5 in closed form: u at x, from u = `start` and w = `steady` at 0; `gone` is g."""
    return start + (steady - start) * gone + drift * (x - gone)


@njit(cache=True, error_model="numpy", nogil=True)
def potential_at(x: float, start: float, steady: float, drift: float) -> float:
    """Potential u at x = s/tau, from u = `start` and w = `steady` at 0; w grows by `drift` per unit of x."""
    return _potential(x, -math.expm1(-x), start, steady, drift)


@njit(cache=True, error_model="numpy", nogil=True)
def _first_guess(missing: float, rise: float, drift: float) -> float:
    """Estimate the time in which the potential rises by `missing`, from r = `rise` and c = `drift`."""
    # Halley's formula gives a first time, h = 2 missing r/q. For a constant current, equal to its mean until
    # h, x = -ln(1 - s) with s = missing/(r + c h/2), here by its Padé approximant s (6 - 3 s)/(6 - 6 s +
    # s^2). Both are combined in one fraction, because divisions are the expensive operations.
    q = 2.0 * rise * rise + (drift - rise) * missing
    a = missing * q
    b = rise * (q + drift * missing)  # s = a/b
    return 3.0 * a * (2.0 * b - a) / (6.0 * b * (b - a) + a * a)


@njit(cache=True, error_model="numpy", nogil=True)
def _next_guess(guess: float, missing: float, rise: float, drift: float, high: float) -> tuple[float, bool]:
    """Improve an estimate of the crossing; also return whether it is exact to the round-off of `high`."""
    # From the time of the estimate on, the potential rises by
    #
    # r y + b (y^2/2 - y^3/6 + y^4/24 - ...)    in the time y,    r = w - u,    b = c - r.
    #
    # Halley's formula estimates the y of the rise `missing`, and one Newton step on the series up to y^5
    # improves it. The remainder of the series and the error of the Newton step are known.
    bend = drift - rise
    y = 2.0 * missing * rise / (2.0 * rise * rise + bend * missing)
    gained = y * (rise + bend * y * (1 / 2 - y * (1 / 6 - y * (1 / 24 - y * (1 / 120)))))
    rise_there = rise + bend * y * (1 - y * (1 / 2 - y * (1 / 6 - y * (1 / 24))))
    correction = (missing - gained) / rise_there
    y2 = y * y
    error = abs(bend) * (y2 * y2 * y2 * (1 / 720) + 0.5 * correction * correction)
    return guess + (y + correction), error <= _ROUND_OFF * high * abs(rise_there)


@njit(cache=True, error_model="numpy", nogil=True)
def refine(high: float, reached: float, start: float, steady: float, drift: float, threshold: float) -> float:
    """Time of the only crossing within (0, high]; at `high` the potential `reached` is above the threshold.

    Iterates `_next_guess`, with bisection where it leaves the bracket.
    """
    low = 0.0
    guess = high * min(1.0, (threshold - start) / (reached - start))
    for _ in range(_MOST_REFINEMENTS):
        potential = potential_at(guess, start, steady, drift)
        if potential < threshold:
            low = guess
        else:
            high = guess
        rise = steady + drift * guess - potential
        following, exact = _next_guess(guess, threshold - potential, rise, drift, high)
        if not low < following < high:
            following, exact = 0.5 * (low + high), False
        if exact or abs(following - guess) <= _ROUND_OFF * high:
            return following
        guess = following
    return guess


def initial_potentials(current: FloatArray, constants: Constants) -> FloatArray:
    """Potentials (n_neurons,) before the first current changes: the given one, or those at rest.

    At rest a membrane has the steady potential of its current. One whose current would make it fire has just
    been reset.
    """
    tau, capacitance, threshold, _, initial = constants
    if not math.isnan(initial):
        return np.full(current.size, initial)
    steady = tau / capacitance * current
    return np.where(steady < threshold, steady, 0.0)


def exact_trains(
    times: FloatArray, currents: FloatArray, constants: Constants
) -> tuple[FloatArray, np.ndarray]:
    """Compute the spike times of all neurons, neuron after neuron."""
    ready = np.full(currents.shape[1], times[0])
    return continued_trains(times, currents, constants, initial_potentials(currents[0], constants), ready)


@njit(cache=True, error_model="numpy", nogil=True)
def continued_trains(
    times: FloatArray, currents: FloatArray, constants: Constants, potentials: FloatArray, ready: FloatArray
) -> tuple[FloatArray, np.ndarray]:
    """Compute spike times as `exact_trains`, from a state that is carried on."""
    # All neurons are advanced over an interval before the next one begins: they share its exponential, rows
    # of `currents` are contiguous in memory, and the loops over neurons vectorise. For the same reason,
    # spikes within an interval are found in rounds of one spike per neuron, stage by stage in short loops.
    tau, capacitance, threshold, refractory, _ = constants
    n_neurons = currents.shape[1]
    resistance = tau / capacitance
    busy = np.empty(n_neurons, dtype=np.int64)
    searches = np.empty((6, n_neurons))
    crossings = np.empty(n_neurons)
    found = np.empty(64 * (n_neurons + 1))
    finder = np.empty(found.size, dtype=np.int64)
    count = 0
    steady = resistance * currents[0]
    for knot in range(times.size - 1):
        start, end = times[knot], times[knot + 1]
        now, steady = steady, resistance * currents[knot + 1]
        if start == end:
            continue
        n_busy = _pass(start, (end - start) / tau, now, steady, threshold, potentials, ready, busy)
        while n_busy > 0:
            n_busy = _bracket(
                start, end, tau, now, steady, threshold, potentials, ready, busy[:n_busy], searches
            )
            _cross(searches[:, :n_busy], threshold, crossings)
            if count + n_busy > found.size:
                found = np.concatenate((found, np.empty(found.size)))
                finder = np.concatenate((finder, np.empty(finder.size, dtype=np.int64)))
            for n in range(n_busy):
                found[count], finder[count] = searches[0, n] + tau * crossings[n], busy[n]
                potentials[busy[n]] = 0.0
                ready[busy[n]] = found[count] + refractory
                count += 1
    return _by_neuron(found[:count], finder[:count], n_neurons)


@njit(cache=True, error_model="numpy", nogil=True)
def _pass(
    start: float,
    length: float,
    now: FloatArray,
    later: FloatArray,
    threshold: float,
    potentials: FloatArray,
    ready: FloatArray,
    busy: np.ndarray,
) -> int:
    """Advance to the next knot all neurons that are not refractory and cannot fire; list the others."""
    # A potential equals w at its maximum. If it is below the threshold at both knots, it can cross the
    # threshold in between only if w falls from above the threshold to below it. Returns the number of others.
    gone = -math.expm1(-length)
    # The closed form sorted by u, w now and w later.
    of_later = 1.0 - gone / length
    of_now = gone - of_later
    n_busy = 0
    for neuron in range(potentials.size):
        w0, w1 = now[neuron], later[neuron]
        reached = (1.0 - gone) * potentials[neuron] + (of_now * w0 + of_later * w1)
        if ready[neuron] > start or reached >= threshold or w0 >= threshold > w1:
            busy[n_busy] = neuron
            n_busy += 1
        else:
            potentials[neuron] = reached
    return n_busy


@njit(cache=True, error_model="numpy", nogil=True)
def _bracket(
    start: float,
    end: float,
    tau: float,
    now: FloatArray,
    later: FloatArray,
    threshold: float,
    potentials: FloatArray,
    ready: FloatArray,
    busy: np.ndarray,
    searches: FloatArray,
) -> int:
    """Select those of the `busy` neurons that fire before the next knot, and return their number."""
    # Each of them gets a column of `searches`: start of its bracket [ms] and length of it, the potential at
    # both ends, steady potential and drift. The others are advanced to the next knot.
    n_firing = 0
    for neuron in busy:
        begin = max(start, ready[neuron])
        if begin >= end:
            continue
        drift = (later[neuron] - now[neuron]) / ((end - start) / tau)
        steady = now[neuron] + drift * ((begin - start) / tau)
        high = (end - begin) / tau
        potential = potentials[neuron]
        at_knot = reached = potential_at(high, potential, steady, drift)
        if reached < threshold and steady >= threshold > later[neuron]:
            # du/dx = c + (r - c) e^-x with r = w0 - u0 > 0 and c < 0: the maximum is where this is 0.
            high = min(high, math.log1p(-(steady - potential) / drift))
            reached = potential_at(high, potential, steady, drift)
        if reached < threshold:
            potentials[neuron] = at_knot
            continue
        busy[n_firing] = neuron
        searches[0, n_firing], searches[1, n_firing] = begin, high
        searches[2, n_firing], searches[3, n_firing] = potential, reached
        searches[4, n_firing], searches[5, n_firing] = steady, drift
        n_firing += 1
    return n_firing


@njit(cache=True, error_model="numpy", nogil=True)
def _cross(searches: FloatArray, threshold: float, crossings: FloatArray) -> None:
    """Find the crossing of every search; one estimate and one improvement nearly always suffice."""
    _, highs, starts, reached, steady, drift = searches
    guesses, gone = np.empty((2, highs.size))
    for n in range(highs.size):
        guess = _first_guess(threshold - starts[n], steady[n] - starts[n], drift[n])
        guesses[n] = guess if 0.0 < guess < highs[n] else highs[n]
    for n in range(highs.size):
        gone[n] = -math.expm1(-guesses[n])
    for n in range(highs.size):
        potential = _potential(guesses[n], gone[n], starts[n], steady[n], drift[n])
        rise = steady[n] + drift[n] * guesses[n] - potential
        crossings[n], exact = _next_guess(guesses[n], threshold - potential, rise, drift[n], highs[n])
        if not (exact and 0.0 < crossings[n] <= highs[n]):
            crossings[n] = refine(highs[n], reached[n], starts[n], steady[n], drift[n], threshold)


@njit(cache=True, error_model="numpy", nogil=True)
def _by_neuron(found: FloatArray, finder: np.ndarray, n_neurons: int) -> tuple[FloatArray, np.ndarray]:
    """Sort spikes by neuron; those of a neuron stay in order of time."""
    offsets = np.zeros(n_neurons + 1, dtype=np.int64)
    for neuron in finder:
        offsets[neuron + 1] += 1
    for neuron in range(n_neurons):
        offsets[neuron + 1] += offsets[neuron]
    place = offsets[:-1].copy()
    trains = np.empty(found.size)
    for spike in range(found.size):
        trains[place[finder[spike]]] = found[spike]
        place[finder[spike]] += 1
    return trains, offsets
