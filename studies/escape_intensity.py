"""Hazard of an afferent with a soft threshold at given times, conditional on its earlier spikes."""

from __future__ import annotations

import numpy as np
from numba import njit
from numpy.typing import ArrayLike

from fingerpad.core.checks import FloatArray, float_array
from fingerpad.core.errors import InputError
from fingerpad.core.random_streams import checked_sites
from fingerpad.core.signals import CurrentTraces, SpikeTrains
from fingerpad.neuron.escape_rate import EscapeRate
from fingerpad.neuron.exact_spikes import potential_at


def intensity_per_ms(
    neuron: EscapeRate, current: CurrentTraces, spikes: SpikeTrains, sites: ArrayLike, times_ms: ArrayLike
) -> FloatArray:
    """Hazard at given times, conditional on the earlier spikes; 0 during the refractory period.

    Parameters
    ----------
    neuron : EscapeRate
        Membrane with a soft threshold.
    current : CurrentTraces
        One column per site. [mA]
    spikes : SpikeTrains
        One train per presentation.
    sites : int array_like (n_trains,)
        Column of `current` of each train.
    times_ms : array_like (n_times,)
        Increasing, within the times of the current. [ms]

    Returns
    -------
    array (n_times, n_trains)
        At the time of a spike: the hazard immediately before it. [1/ms]

    Raises
    ------
    InputError
        If shapes disagree or a time lies outside.
    """
    chosen = checked_sites(np.asarray(sites, np.int64), current.n_sites)
    wanted = float_array("times_ms", times_ms, 1)
    first, last = current.times_ms[0], current.times_ms[-1]
    if chosen.size != len(spikes):
        raise InputError(f"sites needs one entry per train: got {chosen.size} for {len(spikes)}.")
    if wanted.size and (np.any(np.diff(wanted) < 0) or wanted[0] < first or wanted[-1] > last):
        raise InputError(f"times_ms must increase within {first:g} ... {last:g} ms: got {wanted[:4]} ...")
    potentials = _potentials_at(
        current.times_ms,
        neuron.relative_drive(current),
        neuron.initial_potentials(current),
        chosen,
        spikes.times_ms,
        spikes.offsets,
        wanted,
        float(neuron.membrane.time_constant_ms),
        float(neuron.membrane.refractory_ms),
    )
    # During the refractory period the potential is -inf and the hazard 0.
    return np.exp((potentials - 1.0) / neuron.width) / neuron.escape_ms


@njit(cache=True, error_model="numpy", nogil=True)
def _potentials_at(
    times: FloatArray,
    drives: FloatArray,
    initial: FloatArray,
    sites: np.ndarray,
    spikes: FloatArray,
    offsets: np.ndarray,
    wanted: FloatArray,
    tau: float,
    refractory: float,
) -> FloatArray:
    """Potential over threshold at given times (n_times, n_trains); -inf during the refractory period."""
    found = np.full((wanted.size, sites.size), -np.inf)
    for train in range(sites.size):
        drive = drives[sites[train]]
        spike, place = offsets[train], 0
        u, ready, time = initial[sites[train]], times[0], times[0]
        knot = 0
        while place < wanted.size:
            while knot < times.size - 2 and times[knot + 1] <= time:
                knot += 1
            first, last = times[knot], times[knot + 1]
            target = min(last, wanted[place])
            fires = spike < offsets[train + 1] and spikes[spike] <= target
            if fires:
                target = min(target, spikes[spike])
            begin = max(time, ready)
            if begin < target:
                drift = tau * (drive[knot + 1] - drive[knot]) / ((last - first) / tau)
                steady = tau * drive[knot] + drift * ((begin - first) / tau)
                u = potential_at((target - begin) / tau, u, steady, drift)
            if wanted[place] == target:
                found[place, train] = u if target >= ready else -np.inf
                place += 1
            elif fires:
                spike += 1
                u, ready = 0.0, target + refractory
            time = target
    return found
