"""Spike times by the paper's scheme, Runge-Kutta with a fixed step, to compare with the exact ones."""

from __future__ import annotations

import numpy as np
from numba import njit

from fingerpad.core.signals import SpikeTrains, Traces
from fingerpad.core.values import FloatArray, positive
from fingerpad.neuron.lif import LeakyIntegrateAndFire


def runge_kutta_spikes(neuron: LeakyIntegrateAndFire, current: Traces, step_ms: float = 0.001) -> SpikeTrains:
    """Spike times by the paper's scheme: fourth-order Runge-Kutta with a fixed step.

    A spike is placed at the end of the step in which the threshold is reached. Each spike is therefore
    late by less than a step, and the delays add up along a train.

    Parameters
    ----------
    neuron : LeakyIntegrateAndFire
        The membrane.
    current : Traces
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
        # The kernel reads one neuron after the other: a row per neuron is contiguous in memory.
        *_runge_kutta_trains(
            current.times_ms,
            np.ascontiguousarray(current.values.T),
            neuron.initial_potentials_mv(current.values[0]),
            *neuron.constants()[:-1],
            step,
        )
    )


@njit(cache=True, error_model="numpy", nogil=True)
def _growth(potential: float, current: float, tau: float, capacitance: float) -> float:
    """Right side of Eq. 5."""
    return -potential / tau + current / capacitance


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
    potentials: FloatArray,
    tau: float,
    capacitance: float,
    threshold: float,
    refractory: float,
    step: float,
) -> tuple[FloatArray, np.ndarray]:
    """Integrate Eq. 5 with the classical Runge-Kutta scheme; same outputs as `exact_trains`."""
    n_neurons = currents.shape[0]
    n_steps = int((times[-1] - times[0]) / step + 1e-9)
    found = np.empty(64 * (n_neurons + 1))
    offsets = np.zeros(n_neurons + 1, dtype=np.int64)
    count = 0
    for neuron in range(n_neurons):
        potential = potentials[neuron]
        ready = times[0]
        now, knot = _current_at(times[0], 0, times, currents[neuron])
        for index in range(n_steps):
            time = times[0] + index * step
            middle, knot = _current_at(time + 0.5 * step, knot, times, currents[neuron])
            following, knot = _current_at(time + step, knot, times, currents[neuron])
            # Half a step of tolerance: up to round-off, the refractory period ends with a step.
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
