"""Membrane current -> spike times: the leaky integrate-and-fire neuron (paper, Eqs. 3-5).

Between two knots the current is a straight line, I + m s, and Eq. 5, du/ds = -u/tau + (I + m s)/C, has
the closed form

    u(s) = u e^(-s/tau) + tau/C [ I g + m (s - tau g) ],    g = 1 - e^(-s/tau),

whose slope is monotone: u has at most one extremum between two knots. A crossing of the threshold can
therefore be bracketed with certainty, and is then refined to round-off. No time step is involved.
The paper's own scheme, Runge-Kutta with a fixed step, is there for comparison.
"""

from __future__ import annotations

import math
from dataclasses import dataclass

import numpy as np
from numba import njit

from fingerpad.blocks import in_blocks
from fingerpad.checks import FloatArray, positive
from fingerpad.signals import CurrentTraces, SpikeTrains

_NEVER = -1.0
_MOST_REFINEMENTS = 200
_ROUND_OFF = 4.0 * float(np.finfo(np.float64).eps)


@dataclass(frozen=True)
class LeakyIntegrateAndFire:
    """A membrane that charges, leaks, fires at a threshold and rests.

    The potential starts at 0. When it reaches the threshold a spike is noted, the potential returns to 0
    and stays there for the refractory period.

    Parameters
    ----------
    time_constant_ms : float
        Time constant of the leak, tau = R C, Eq. 3. [ms]
    capacitance_mf : float
        Capacitance of the membrane, C. [mF]
    threshold_mv : float
        Potential that elicits a spike, v. [mV]
    refractory_ms : float
        Rest after each spike. [ms]

    Raises
    ------
    InputError
        If a value is not positive.

    Examples
    --------
    A steady current of 2 µA charges at 2 mV/ms less the leak: 50 mV are reached every 32 ms.

    >>> neuron = LeakyIntegrateAndFire(68.0, 1e-6, 50.0, 1.0)
    >>> spikes = neuron.spikes(CurrentTraces([0.0, 100.0], [[2e-6], [2e-6]]))
    >>> spikes[0].round(3).tolist()
    [31.165, 63.33, 95.495]
    """

    time_constant_ms: float
    capacitance_mf: float
    threshold_mv: float
    refractory_ms: float

    def __post_init__(self) -> None:
        positive("time_constant_ms", self.time_constant_ms, "ms")
        positive("capacitance_mf", self.capacitance_mf, "mF")
        positive("threshold_mv", self.threshold_mv, "mV")
        positive("refractory_ms", self.refractory_ms, "ms")

    def spikes(self, current: CurrentTraces) -> SpikeTrains:
        """Spike times of one neuron per site, exact for a piecewise linear current.

        Parameters
        ----------
        current : CurrentTraces
            One column per neuron.

        Returns
        -------
        SpikeTrains
            One train per site; nothing is added after the last knot.
        """

        def trains(neurons: slice) -> SpikeTrains:
            by_neuron = _by_neuron(current.current_ma[:, neurons])
            return SpikeTrains(*_exact_trains(current.times_ms, by_neuron, *self._constants()))

        return SpikeTrains.joined(in_blocks(trains, current.n_sites))

    def spikes_runge_kutta(self, current: CurrentTraces, step_ms: float = 0.001) -> SpikeTrains:
        """Spike times by the paper's scheme: fourth-order Runge-Kutta with a fixed step.

        A spike is noted at the end of the step that reaches the threshold, so each is late by less than a
        step and hands its delay on to the next.

        Parameters
        ----------
        current : CurrentTraces
            One column per neuron.
        step_ms : float, optional
            Time step; the paper's is 0.001 ms. [ms]

        Returns
        -------
        SpikeTrains
            One train per site.

        Raises
        ------
        InputError
            If the step is not positive.
        """
        step = positive("step_ms", step_ms, "ms")
        return SpikeTrains(
            *_runge_kutta_trains(current.times_ms, _by_neuron(current.current_ma), *self._constants(), step)
        )

    def _constants(self) -> tuple[float, float, float, float]:
        return (
            float(self.time_constant_ms),
            float(self.capacitance_mf),
            float(self.threshold_mv),
            float(self.refractory_ms),
        )


def _by_neuron(current_ma: FloatArray) -> FloatArray:
    # A neuron runs through its own row: neighbours in time must be neighbours in memory.
    return np.ascontiguousarray(current_ma.T)


@njit(cache=True, error_model="numpy", nogil=True)
def _gone(elapsed: float, tau: float) -> float:
    """Share of the potential that has leaked after `elapsed`: g."""
    return -math.expm1(-elapsed / tau)


@njit(cache=True, error_model="numpy", nogil=True)
def _potential(
    elapsed: float, gone: float, start: float, current: float, slope: float, tau: float, capacitance: float
) -> float:
    """Solve Eq. 5 in closed form, `elapsed` after the potential was `start` and the current `current`."""
    return start * (1.0 - gone) + tau / capacitance * (current * gone + slope * (elapsed - tau * gone))


@njit(cache=True, error_model="numpy", nogil=True)
def _growth(potential: float, current: float, tau: float, capacitance: float) -> float:
    """Right side of Eq. 5."""
    return -potential / tau + current / capacitance


@njit(cache=True, error_model="numpy", nogil=True)
def _refine(
    high: float,
    reached: float,
    start: float,
    current: float,
    slope: float,
    tau: float,
    capacitance: float,
    threshold: float,
) -> float:
    """Time of the only crossing within (0, high], where the potential has `reached` the threshold.

    Newton, or bisection where Newton leaves the bracket. After a step ds Newton's error is |u''/2u'| ds^2:
    once that is round-off, another step would only follow the round-off of the potential.
    """
    low = 0.0
    guess = high * min(1.0, (threshold - start) / (reached - start))
    for _ in range(_MOST_REFINEMENTS):
        potential = _potential(guess, _gone(guess, tau), start, current, slope, tau, capacitance)
        if potential < threshold:
            low = guess
        else:
            high = guess
        growth = _growth(potential, current + slope * guess, tau, capacitance)
        bend = slope / capacitance - growth / tau
        step = (threshold - potential) / growth
        if low < guess + step < high and abs(bend * step) * abs(step) <= 2.0 * _ROUND_OFF * high * abs(
            growth
        ):
            return guess + step
        following = guess + step if low < guess + step < high else 0.5 * (low + high)
        if abs(following - guess) <= _ROUND_OFF * high:
            return following
        guess = following
    return guess


@njit(cache=True, error_model="numpy", nogil=True)
def _advance(
    length: float,
    gone: float,
    start: float,
    current: float,
    slope: float,
    tau: float,
    capacitance: float,
    threshold: float,
) -> tuple[float, float]:
    """Time of the first crossing within (0, length], or never, and the potential at `length`.

    `gone` is that of `length`, which most neurons share: its exponential is dearer than all the rest.
    """
    potential = _potential(length, gone, start, current, slope, tau, capacitance)
    if potential >= threshold:
        return _refine(length, potential, start, current, slope, tau, capacitance, threshold), potential
    # Eq. 5 times C tau, whose sign is all that matters here: rises at the start and falls at the end.
    if tau * current > capacitance * start and tau * (current + slope * length) < capacitance * potential:
        # du/ds = b + (rises - b) e^(-s/tau) with b = tau m/C < 0: the potential peaks where that is 0.
        rises = _growth(start, current, tau, capacitance)
        top = min(length, tau * math.log1p(-rises * capacitance / (tau * slope)))
        highest = _potential(top, _gone(top, tau), start, current, slope, tau, capacitance)
        if highest >= threshold:
            return _refine(top, highest, start, current, slope, tau, capacitance, threshold), potential
    return _NEVER, potential


@njit(cache=True, error_model="numpy", nogil=True)
def _exact_trains(
    times: FloatArray,
    currents: FloatArray,
    tau: float,
    capacitance: float,
    threshold: float,
    refractory: float,
) -> tuple[FloatArray, np.ndarray]:
    """Spike times of all neurons, one after the other, and where each one's begin."""
    n_neurons = currents.shape[0]
    gone = np.empty(times.size - 1)
    for knot in range(times.size - 1):
        gone[knot] = _gone(times[knot + 1] - times[knot], tau)
    found = np.empty(64 * (n_neurons + 1))
    offsets = np.zeros(n_neurons + 1, dtype=np.int64)
    count = 0
    for neuron in range(n_neurons):
        current = currents[neuron]
        potential = 0.0
        ready = times[0]
        for knot in range(times.size - 1):
            end = times[knot + 1]
            begin = max(times[knot], ready)
            if begin >= end:
                continue
            slope = (current[knot + 1] - current[knot]) / (end - times[knot])
            while begin < end:
                present = current[knot] + slope * (begin - times[knot])
                length = end - begin
                left = gone[knot] if begin == times[knot] else _gone(length, tau)
                crossing, later = _advance(
                    length, left, potential, present, slope, tau, capacitance, threshold
                )
                if crossing == _NEVER:
                    potential = later
                    break
                if count == found.size:
                    found = np.concatenate((found, np.empty(found.size)))
                found[count] = begin + crossing
                ready = found[count] + refractory
                count += 1
                potential = 0.0
                begin = ready
        offsets[neuron + 1] = count
    return found[:count], offsets


@njit(cache=True, error_model="numpy", nogil=True)
def _current_at(time: float, knot: int, times: FloatArray, current: FloatArray) -> tuple[float, int]:
    """Return the current at `time` and the knot before it, searched onward from `knot`."""
    while knot < times.size - 2 and times[knot + 1] <= time:
        knot += 1
    share = (time - times[knot]) / (times[knot + 1] - times[knot])
    return current[knot] + share * (current[knot + 1] - current[knot]), knot


@njit(cache=True, error_model="numpy", nogil=True)
def _runge_kutta_trains(
    times: FloatArray,
    currents: FloatArray,
    tau: float,
    capacitance: float,
    threshold: float,
    refractory: float,
    step: float,
) -> tuple[FloatArray, np.ndarray]:
    """Integrate Eq. 5 with the classical Runge-Kutta scheme; same answer as `_exact_trains`."""
    n_neurons = currents.shape[0]
    n_steps = int((times[-1] - times[0]) / step + 1e-9)
    found = np.empty(64 * (n_neurons + 1))
    offsets = np.zeros(n_neurons + 1, dtype=np.int64)
    count = 0
    for neuron in range(n_neurons):
        potential = 0.0
        ready = times[0]
        now, knot = _current_at(times[0], 0, times, currents[neuron])
        for index in range(n_steps):
            time = times[0] + index * step
            middle, knot = _current_at(time + 0.5 * step, knot, times, currents[neuron])
            following, knot = _current_at(time + step, knot, times, currents[neuron])
            # Half a step of slack: the end of the rest falls on a step, give or take round-off.
            if time > ready - 0.5 * step:
                first = _growth(potential, now, tau, capacitance)
                second = _growth(potential + 0.5 * step * first, middle, tau, capacitance)
                third = _growth(potential + 0.5 * step * second, middle, tau, capacitance)
                fourth = _growth(potential + step * third, following, tau, capacitance)
                potential += step / 6.0 * (first + 2.0 * second + 2.0 * third + fourth)
                if potential >= threshold:
                    if count == found.size:
                        found = np.concatenate((found, np.empty(found.size)))
                    found[count] = time + step
                    ready = found[count] + refractory
                    count += 1
                    potential = 0.0
            now = following
        offsets[neuron + 1] = count
    return found[:count], offsets
