"""Regularity of spike trains: mean, coefficient of variation and local variation of interspike intervals."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from fingerpad.core.checks import FloatArray
from fingerpad.core.signals import SpikeTrains, window_bounds


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


def _intervals(
    spikes: SpikeTrains, window_ms: tuple[float, ...]
) -> tuple[FloatArray, np.ndarray, np.ndarray]:
    """Intervals that close in a window, the train of each, and the index of its closing spike."""
    start, end = window_bounds(window_ms)
    times, n_afferents = spikes.times_ms, len(spikes)
    opens_train = np.zeros(times.size, dtype=bool)
    opens_train[spikes.offsets[:-1][np.diff(spikes.offsets) > 0]] = True
    closes = (times > start) & (times <= end) & ~opens_train
    closing = np.flatnonzero(closes)
    intervals_ms = times[closing] - times[closing - 1]
    owners = np.repeat(np.arange(n_afferents), np.diff(spikes.offsets))[closing]
    return intervals_ms, owners, closing


def _ratio(numerator: np.ndarray, denominator: np.ndarray) -> FloatArray:
    """Quotient, NaN where the denominator is not positive."""
    return np.divide(numerator, denominator, out=np.full(numerator.shape, np.nan), where=denominator > 0)
