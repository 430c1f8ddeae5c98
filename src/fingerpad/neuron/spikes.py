"""Spike times -> firing rate, first-spike latency, modulation (paper, Eqs. 6-11)."""

from __future__ import annotations

from collections.abc import Callable, Mapping
from types import MappingProxyType

import numpy as np
from numba import njit
from numpy.typing import ArrayLike

from fingerpad.core.checks import FloatArray
from fingerpad.core.signals import COUNT, INTERVAL, SpikeTrains, window_bounds
from fingerpad.core.units import MS_PER_S


def firing_rate_hz(spikes: SpikeTrains, window_ms: tuple[float, ...]) -> FloatArray:
    """Rate of every afferent in a window, one over its mean interspike interval, Eqs. 6-10.

    An interval belongs to the window that contains its closing spike. The window excludes its start and
    includes its end, so adjacent windows share no interval.
    """
    return window_rates_hz(spikes.times_ms, spikes.offsets, *window_bounds(window_ms))


@njit(cache=True, error_model="numpy", nogil=True)
def window_rates_hz(times_ms: FloatArray, offsets: np.ndarray, start: float, end: float) -> FloatArray:
    """Compute `firing_rate_hz` of unchecked arrays, for evaluations that are repeated often."""
    rates = np.zeros(offsets.size - 1)
    for train in range(rates.size):
        count = 0
        total = 0.0
        for spike in range(offsets[train] + 1, offsets[train + 1]):
            if start < times_ms[spike] <= end:
                count += 1
                total += times_ms[spike] - times_ms[spike - 1]
        if count > 0:
            rates[train] = MS_PER_S * (count / total)
    return rates


RATE_OF: Mapping[str, Callable[[SpikeTrains, tuple[float, ...]], FloatArray]] = MappingProxyType(
    {INTERVAL: firing_rate_hz, COUNT: SpikeTrains.counted_hz}
)
"""Rate of every afferent in a window, by the `rate_measure` of its type."""


def first_spike_latency_ms(spikes: SpikeTrains, onset_ms: float = 0.0) -> FloatArray:
    """Time from first touch to the first spike of every afferent after it."""
    after = (train[train > onset_ms] for train in spikes)
    return np.array([float(train[0]) - onset_ms if train.size else np.nan for train in after])


def modulation_index(largest_hz: ArrayLike, smallest_hz: ArrayLike) -> FloatArray:
    """Modulation index, Eq. 11: (R_max - R_min) / (R_max + R_min)."""
    largest, smallest = np.asarray(largest_hz, np.float64), np.asarray(smallest_hz, np.float64)
    difference, total = largest - smallest, largest + smallest
    return np.divide(difference, total, out=np.full(np.shape(total), np.nan), where=total != 0.0)


def modulation_difference(largest_hz: ArrayLike, smallest_hz: ArrayLike) -> FloatArray:
    """Difference R_max - R_min, which the text of the paper calls modulation index."""
    return np.asarray(largest_hz, np.float64) - np.asarray(smallest_hz, np.float64)
