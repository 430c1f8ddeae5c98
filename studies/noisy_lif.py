"""Membrane current -> spike times of a noisy leaky integrate-and-fire neuron.

Three sources of noise can be combined:

- noise of the membrane current, white or correlated (Ornstein-Uhlenbeck process),
- noise of the threshold, drawn anew for each interval between spikes,
- noise of the gain of the end organ, drawn anew for each presentation or for each receptor.

The current noise is sampled at time steps with the exact distribution and interpolated within a step. The
total current is then piecewise linear, and spikes are computed to round-off as without noise
(`fingerpad.neuron.exact_spikes`). Without noise the spikes are those of `fingerpad.neuron.lif`. All random
numbers have keys: docs/decisions.md#random-numbers.
"""

from __future__ import annotations

import math

import numpy as np
from numba import njit

from fingerpad.core.checks import FloatArray, finite, instance
from fingerpad.core.philox import four_normals
from fingerpad.core.random_streams import Presentations, Purpose, checked_sites
from fingerpad.core.signals import CurrentTraces, SpikeTrains
from fingerpad.core.threads import in_blocks
from fingerpad.neuron.exact_spikes import initial_potentials, potential_at, refine
from fingerpad.neuron.lif import LeakyIntegrateAndFire
from studies.membrane_noise import (
    CorrelatedCurrentNoise,
    MembraneNoise,
    WhiteCurrentNoise,
    log_spread,
)

_TRAINS_PER_BLOCK = 32
"""Trains that one thread simulates at a time; each takes about a millisecond."""

_CURRENT, _THRESHOLD = int(Purpose.CURRENT), int(Purpose.THRESHOLD)


def noisy_spikes(
    membrane: LeakyIntegrateAndFire,
    current: CurrentTraces,
    noise: MembraneNoise,
    seed: int,
    presentations: Presentations | None = None,
    intercept_ma: float = 0.0,
) -> SpikeTrains:
    """Spike times of a noisy membrane.

    Parameters
    ----------
    membrane : LeakyIntegrateAndFire
        The membrane without noise.
    current : CurrentTraces
        Current without noise, one column per site. [mA]
    noise : MembraneNoise
        The sources of noise.
    seed : int
        Seed of the run; the same seed gives the same spikes on any number of threads.
    presentations : Presentations, optional
        Site, trial and receptor of each train. Default: one presentation per site.
    intercept_ma : float, optional
        Current without a stimulus, beta; noise of the gain does not change it. [mA]

    Returns
    -------
    SpikeTrains
        One per presentation.

    Raises
    ------
    InputError
        If a presentation names a site that does not exist.

    Examples
    --------
    >>> from studies.membrane_noise import ThresholdNoise
    >>> neuron = LeakyIntegrateAndFire(68.0, 1e-6, 50.0, 1.0)
    >>> steady = CurrentTraces([0.0, 100.0], [[2e-6], [2e-6]])
    >>> noise = MembraneNoise(threshold=ThresholdNoise(0.1))
    >>> noisy_spikes(neuron, steady, noise, seed=1)[0].round(1).tolist()
    [29.0, 63.7, 96.7]
    """
    instance("noise", noise, MembraneNoise)
    everyone = presentations or Presentations.of_population(current.n_sites)
    checked_sites(everyone.sites, current.n_sites)
    resting = finite("intercept_ma", intercept_ma, "mA")
    gains = noise.gain.factors(seed, everyone) if noise.gain else np.ones(len(everyone))
    # The kernel reads one train after the other: a row per site is contiguous in memory.
    rows = np.ascontiguousarray(current.current_ma.T)
    numbers = membrane.constants()
    disturbed = _current_numbers(noise.current, membrane.time_constant_ms)
    spread = log_spread(noise.threshold.relative_standard_deviation) if noise.threshold else 0.0

    def trains(some: slice) -> SpikeTrains:
        part = everyone.part(some)
        keys = part.sites, part.trials, part.receptors
        return SpikeTrains(
            *_noisy_trains(
                current.times_ms, rows, *keys, gains[some], resting, seed, *numbers, *disturbed, spread
            )
        )

    return SpikeTrains.joined(in_blocks(trains, len(everyone), _TRAINS_PER_BLOCK))


def _current_numbers(
    noise: WhiteCurrentNoise | CorrelatedCurrentNoise | None, time_constant_ms: float
) -> tuple[float, float, float]:
    """Step (0: no noise), standard deviation of a level, and correlation of successive levels."""
    if noise is None:
        return 0.0, 0.0, 0.0
    if isinstance(noise, WhiteCurrentNoise):
        return float(noise.step_ms), noise.level_ma(time_constant_ms), 0.0
    return float(noise.step_ms), float(noise.standard_deviation_ma), noise.memory


@njit(cache=True, error_model="numpy", nogil=True)
def _first_crossing(
    length: float, start: float, steady: float, later: float, threshold: float
) -> tuple[bool, float, float]:
    """Integrate one potential between two knots.

    Parameters
    ----------
    length : float
        Time between the knots over tau, above 0. [1]
    start : float
        Potential at the first knot, below the threshold. [mV]
    steady, later : float
        w at the two knots. [mV]
    threshold : float
        Potential to reach. [mV]

    Returns
    -------
    crosses : bool
        Whether the potential reaches the threshold by the second knot.
    x : float
        Time of the first crossing; the length without one. [1]
    reached : float
        Potential at the second knot without a threshold. [mV]
    """
    drift = (later - steady) / length
    at_knot = reached = potential_at(length, start, steady, drift)
    high = length
    if reached < threshold and steady >= threshold > later:
        # The potential peaks between the knots.
        high = min(high, math.log1p(-(steady - start) / drift))
        reached = potential_at(high, start, steady, drift)
    if reached < threshold:
        return False, length, at_knot
    return True, refine(high, reached, start, steady, drift, threshold), at_knot


@njit(cache=True, error_model="numpy", nogil=True)
def _noisy_trains(
    times: FloatArray,
    currents: FloatArray,
    sites: np.ndarray,
    trials: np.ndarray,
    receptors: np.ndarray,
    gains: FloatArray,
    resting: float,
    seed: int,
    tau: float,
    capacitance: float,
    threshold: float,
    refractory: float,
    initial: float,
    step: float,
    deviation: float,
    memory: float,
    spread: float,
) -> tuple[FloatArray, np.ndarray]:
    """Spike times of all trains, train after train, and the index of the first spike of each.

    The potential is integrated from event to event: knots of the current, ends of noise steps and spikes.
    For `memory` > 0 the noise is linear within a step; otherwise it is constant.
    """
    resistance = tau / capacitance
    fresh = math.sqrt(1.0 - memory * memory)  # independent share of a new level
    found = np.empty(64 * (sites.size + 1))
    offsets = np.zeros(sites.size + 1, dtype=np.int64)
    count = 0
    for train in range(sites.size):
        current = resting + gains[train] * (currents[sites[train]] - resting)
        trial, receptor = trials[train], receptors[train]
        knot, n_steps, n_intervals = 0, 0, 0
        time = ready = step_start = times[0]
        step_end = times[0] + step if step > 0.0 else math.inf
        four = four_normals(seed, trial, receptor, _CURRENT, 1)
        level = following = deviation * four[0]
        if memory > 0.0:
            following = memory * level + fresh * deviation * four[1]
        limits = four_normals(seed, trial, receptor, _THRESHOLD, 1)
        limit = threshold * math.exp(spread * limits[0] - 0.5 * spread * spread)
        potential = initial_potentials(current[:1], tau, capacitance, threshold, initial)[0]
        if potential >= limit:  # it fired before the recording began
            potential = 0.0
        while True:
            while knot < times.size - 1 and times[knot + 1] <= time:
                knot += 1
            if knot == times.size - 1:
                break
            end = min(times[knot + 1], step_end)
            begin = max(time, ready)
            crosses = False
            if begin < end:
                slope = (current[knot + 1] - current[knot]) / (times[knot + 1] - times[knot])
                noise_slope = (following - level) / step if step > 0.0 else 0.0
                at_begin = current[knot] + slope * (begin - times[knot])
                at_begin += level + noise_slope * (begin - step_start)
                at_end = at_begin + (slope + noise_slope) * (end - begin)
                length = (end - begin) / tau
                crosses, x, potential = _first_crossing(
                    length, potential, resistance * at_begin, resistance * at_end, limit
                )
                if crosses:
                    if count == found.size:
                        found = np.concatenate((found, np.empty(found.size)))
                    time = found[count] = min(begin + tau * x, end)
                    ready = time + refractory
                    count += 1
                    potential = 0.0
                    n_intervals += 1
                    if n_intervals % 4 == 0:
                        limits = four_normals(seed, trial, receptor, _THRESHOLD, n_intervals // 4 + 1)
                    limit = threshold * math.exp(spread * limits[n_intervals % 4] - 0.5 * spread * spread)
            if not crosses:
                time = end
            if time == step_end:
                n_steps += 1
                step_start, step_end = step_end, times[0] + (n_steps + 1) * step
                newest = n_steps + 1 if memory > 0.0 else n_steps
                if newest % 4 == 0:
                    four = four_normals(seed, trial, receptor, _CURRENT, newest // 4 + 1)
                new = memory * following + fresh * deviation * four[newest % 4]
                level, following = (following, new) if memory > 0.0 else (new, new)
        offsets[train + 1] = count
    return found[:count], offsets
