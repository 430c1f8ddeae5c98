"""Spike times -> firing rate, regularity, first-spike latency, modulation (paper, Eqs. 6-11)."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from numba import njit
from numpy.typing import ArrayLike

from fingerpad.core.checks import FloatArray, finite
from fingerpad.core.errors import InputError
from fingerpad.core.signals import SpikeTrains
from fingerpad.core.units import MS_PER_S


def firing_rate_hz(spikes: SpikeTrains, window_ms: tuple[float, ...]) -> FloatArray:
    """Rate of every afferent in a window, one over its mean interspike interval, Eqs. 6-10.

    An interval belongs to the window that contains its closing spike. The window excludes its start and
    includes its end, so adjacent windows share no interval.

    Parameters
    ----------
    spikes : SpikeTrains
        One train per afferent.
    window_ms : (float, float)
        Start and end of the window. [ms]

    Returns
    -------
    array (n_afferents,)
        Rate; 0 for an afferent without an interval that closes in the window. [spikes/s]

    Raises
    ------
    InputError
        If the window is not two numbers, the second above the first.

    Examples
    --------
    >>> trains = SpikeTrains.from_lists([[10.0, 35.0, 40.0, 60.0], [45.0], []])
    >>> firing_rate_hz(trains, (30.0, 50.0)).round(3).tolist()
    [66.667, 0.0, 0.0]
    """
    return window_rates_hz(spikes.times_ms, spikes.offsets, *_bounds(window_ms))


@njit(cache=True, error_model="numpy", nogil=True)
def window_rates_hz(times_ms: FloatArray, offsets: np.ndarray, start: float, end: float) -> FloatArray:
    """Compute `firing_rate_hz` of unchecked arrays, for evaluations that are repeated often.

    Parameters
    ----------
    times_ms : array (n_spikes,)
        Spike times, train after train. [ms]
    offsets : int array (n_trains + 1,)
        Index of the first spike of each train.
    start, end : float
        The window. [ms]

    Returns
    -------
    array (n_trains,)
        [spikes/s]
    """
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


def _bounds(window_ms: tuple[float, ...]) -> tuple[float, float]:
    bounds = [finite("window_ms", bound, "ms") for bound in window_ms]
    if len(bounds) != 2 or bounds[1] <= bounds[0]:
        raise InputError(f"window_ms must be a start and a later end: got {window_ms!r}.")
    return bounds[0], bounds[1]


def _intervals(
    spikes: SpikeTrains, window_ms: tuple[float, ...]
) -> tuple[FloatArray, np.ndarray, np.ndarray]:
    """Intervals that close in a window, the train of each, and the index of its closing spike."""
    start, end = _bounds(window_ms)
    times, n_afferents = spikes.times_ms, len(spikes)
    opens_train = np.zeros(times.size, dtype=bool)
    opens_train[spikes.offsets[:-1][np.diff(spikes.offsets) > 0]] = True
    closes = (times > start) & (times <= end) & ~opens_train
    closing = np.flatnonzero(closes)
    intervals_ms = times[closing] - times[closing - 1]
    owners = np.repeat(np.arange(n_afferents), np.diff(spikes.offsets))[closing]
    return intervals_ms, owners, closing


@dataclass(frozen=True)
class IntervalStatistics:
    """Mean and regularity of interspike intervals; NaN where there are too few.

    Parameters
    ----------
    count : int array (n_afferents,)
        Intervals that close in the window.
    mean_ms : array (n_afferents,)
        Mean interval; NaN without an interval. [ms]
    coefficient_of_variation : array (n_afferents,)
        Standard deviation over mean: 0 for equal intervals, 1 for a Poisson process; NaN for fewer than two.
        [1]
    local_variation : array (n_afferents,)
        Variation of adjacent intervals, with the same values 0 and 1, hardly affected by slow changes of the
        rate; NaN for fewer than two. [1]
    """

    count: np.ndarray
    mean_ms: FloatArray
    coefficient_of_variation: FloatArray
    local_variation: FloatArray


def interval_statistics(spikes: SpikeTrains, window_ms: tuple[float, ...]) -> IntervalStatistics:
    """Compute the statistics of the intervals of every afferent in a window.

    An interval belongs to the window that contains its closing spike, as in `firing_rate_hz`.

        CV = s/m,    s² = sum (I_i - m)² / (n - 1)
        LV = 3/(n - 1) sum ((I_i - I_i+1)/(I_i + I_i+1))²

    Parameters
    ----------
    spikes : SpikeTrains
        One train per afferent.
    window_ms : (float, float)
        Start and end of the window. [ms]

    Returns
    -------
    IntervalStatistics

    Raises
    ------
    InputError
        If the window is not two numbers, the second above the first.

    Notes
    -----
    Local variation: Shinomoto, Shima & Tanji 2003.

    Examples
    --------
    >>> trains = SpikeTrains.from_lists([[0.0, 10.0, 20.0, 50.0], [5.0]])
    >>> found = interval_statistics(trains, (0.0, 60.0))
    >>> found.count.tolist(), found.mean_ms.round(3).tolist()
    ([3, 0], [16.667, nan])
    >>> found.coefficient_of_variation.round(3).tolist(), found.local_variation.round(3).tolist()
    ([0.693, nan], [0.375, nan])
    """
    intervals_ms, owners, closing = _intervals(spikes, window_ms)
    n = len(spikes)
    count = np.bincount(owners, minlength=n)
    mean_ms = _ratio(np.bincount(owners, weights=intervals_ms, minlength=n), count)
    squares = np.bincount(owners, weights=(intervals_ms - mean_ms[owners]) ** 2, minlength=n)
    variation = np.sqrt(_ratio(squares, count - 1)) / mean_ms
    # Two intervals are adjacent if their closing spikes are; both are then of one train.
    beside = np.diff(closing) == 1
    earlier, later = intervals_ms[:-1][beside], intervals_ms[1:][beside]
    contrasts = ((earlier - later) / (earlier + later)) ** 2
    local = _ratio(np.bincount(owners[1:][beside], weights=contrasts, minlength=n), count - 1)
    return IntervalStatistics(count, mean_ms, variation, 3.0 * local)


def _ratio(numerator: np.ndarray, denominator: np.ndarray) -> FloatArray:
    """Quotient, NaN where the denominator is not positive."""
    return np.divide(numerator, denominator, out=np.full(numerator.shape, np.nan), where=denominator > 0)


def first_spike_latency_ms(spikes: SpikeTrains) -> FloatArray:
    """Time from the onset of the indentation to the first spike of every afferent.

    Parameters
    ----------
    spikes : SpikeTrains
        One train per afferent; times count from the onset.

    Returns
    -------
    array (n_afferents,)
        Latency; NaN for a silent afferent. [ms]

    Examples
    --------
    >>> first_spike_latency_ms(SpikeTrains.from_lists([[10.0, 35.0], []])).tolist()
    [10.0, nan]
    """
    latency_ms = np.full(len(spikes), np.nan)
    fires = np.diff(spikes.offsets) > 0
    latency_ms[fires] = spikes.times_ms[spikes.offsets[:-1][fires]]
    return latency_ms


def modulation_index(largest_hz: ArrayLike, smallest_hz: ArrayLike) -> FloatArray:
    """Modulation index, Eq. 11: (R_max - R_min) / (R_max + R_min).

    Parameters
    ----------
    largest_hz, smallest_hz : array_like
        Rates with the edge and with the flat part of the stimulus above the receptor; shapes that
        broadcast. [spikes/s]

    Returns
    -------
    array
        Index within 0 ... 1 for rates in order; NaN where both rates are 0. [1]

    Examples
    --------
    >>> float(modulation_index(60.0, 20.0))
    0.5
    """
    largest, smallest = np.asarray(largest_hz, np.float64), np.asarray(smallest_hz, np.float64)
    difference, total = largest - smallest, largest + smallest
    return np.divide(difference, total, out=np.full(np.shape(total), np.nan), where=total != 0.0)


def modulation_difference(largest_hz: ArrayLike, smallest_hz: ArrayLike) -> FloatArray:
    """Difference R_max - R_min, which the text of the paper calls modulation index.

    Parameters
    ----------
    largest_hz, smallest_hz : array_like
        As in `modulation_index`. [spikes/s]

    Returns
    -------
    array
        Difference of the rates. [spikes/s]

    Examples
    --------
    >>> float(modulation_difference(212.0, 54.0))
    158.0
    """
    return np.asarray(largest_hz, np.float64) - np.asarray(smallest_hz, np.float64)
