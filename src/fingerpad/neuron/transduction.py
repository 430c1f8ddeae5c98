"""Strain energy density at the end organ -> membrane current (paper, Eqs. 1-2).

The current needs the rate of change of strain energy density (SED), but mechanics computes SED only at some
times. Between them SED is interpolated by monotone cubics (PCHIP), with one interpolant per phase of the
motion, so that the rate may jump between ramp and hold. The derivative of the interpolant does not change
sign between two given times, so the absolute value in Eq. 2 adds no kink there.

A `Drive` holds what does not depend on the gains: SED and its rate on fine knots. It is computed once; the
current for any gains is then a linear combination.

In the paper both terms use SED. As an extension, another quantity may take its place in either term:
I = beta + k_d |Q'| + k_s P (docs/decisions.md#dynamic-term-quantity), and the sum of both terms may saturate.
"""

from __future__ import annotations

from dataclasses import replace
from itertools import pairwise

import numpy as np
from numba import njit

from fingerpad.core.checked import checked, value_class
from fingerpad.core.errors import InputError
from fingerpad.core.phases import Phase
from fingerpad.core.signals import CURRENT, STORED_ENERGY, Traces
from fingerpad.core.values import (
    Count,
    Finite,
    FiniteMatrix,
    FiniteVector,
    FloatArray,
    Many,
    NotNegative,
    Positive,
)

PIECES_PER_INTERVAL = 32  # Largest number of linear pieces that replace the cubic between two given times.
SHORTEST_PIECE_MS = 0.25  # Shortest linear piece: shorter intervals are divided into fewer pieces. [ms]
SAME_COUNT = 1e-6  # Share of a piece by which an interval may be too short for one more.


@value_class
class Drive:
    """A quantity, and the rate of change of it or of another one, piecewise linear between the same knots."""

    times_ms: FiniteVector  #: Knots; a repeated knot is a jump of the rate, (n_knots,). [ms]
    values: FiniteMatrix
    """Quantity of the static term, (n_knots, n_sites). [its unit in `fingerpad.core.units.QUANTITY_UNITS`]"""
    rate_per_ms: FiniteMatrix
    """Absolute rate of change of the quantity of the dynamic term, U' of Eq. 2; 0 at the onset, (n_knots,
    n_sites). [its unit/ms]"""
    dynamic_quantity: str = STORED_ENERGY
    static_quantity: str = STORED_ENERGY
    """What the two terms follow, by the names of `SkinResponse.sample`; "stored" is SED."""
    phases: Many[Phase] = ()  #: As of `Traces`.

    def __post_init__(self) -> None:
        if self.times_ms.size != len(self.values) or self.values.shape != self.rate_per_ms.shape:
            got = f"{self.values.shape} and {self.rate_per_ms.shape} for {self.times_ms.size} knots"
            raise InputError(f"Drive needs one row of values and of rate_per_ms per knot: got {got}.")

    @property
    def n_sites(self) -> int:
        """Number of receptor sites."""
        return self.values.shape[1]

    def part(self, sites: slice) -> Drive:
        """Drive of some of the sites."""
        if sites == slice(0, self.n_sites):
            return self
        return replace(self, values=self.values[:, sites], rate_per_ms=self.rate_per_ms[:, sites])


@value_class
class Transduction:
    """Gains that transform strain energy density (SED) to membrane current.

    Examples
    --------
    SED rises by 2 kPa in 50 ms and stays: the current jumps, grows, drops and stays.

    >>> traces = Traces([0.0, 50.0, 1000.0], [[0.0], [2.0], [2.0]], kinks_ms=[50.0])
    >>> current = Transduction(0.0, dynamic_gain=1e-4, static_gain=1e-6).current(traces)
    >>> [f"{current.values[knot, 0]:.1e}" for knot in (0, 1, 33, 34, -1)]
    ['0.0e+00', '4.0e-06', '6.0e-06', '2.0e-06', '2.0e-06']
    """

    intercept_ma: Finite  #: Current without any load, beta. [mA]
    dynamic_gain: Finite
    """Gain on the rate of change of SED, or of another quantity, k_d. [mA ms/kPa, or per its unit]"""
    static_gain: Finite  #: Gain on SED itself, or on another quantity, k_s. [mA/kPa, or per its unit]
    saturation_per_ma: NotNegative = 0.0
    """Inverse of the sum of both terms of which half is transmitted; 0, as in the paper, for all. [1/mA]"""

    def current(self, traces: Traces | Drive) -> Traces:
        """Compute the current through the membrane at every site, Eq. 1: I = beta + k_d U' + k_s U. [mA]

        Traces are resampled with the defaults of `drive`. The current jumps where the rate jumps.
        """
        driven = traces if isinstance(traces, Drive) else drive(traces)
        return Traces(driven.times_ms, current_of(self, driven.rate_per_ms, driven.values), quantity=CURRENT)


def current_of(gains: Transduction, rate_per_ms: FloatArray, values: FloatArray) -> FloatArray:
    """Compute Eq. 1 from the rate of change and the value that the two terms follow, with saturation. [mA]"""
    both_ma = gains.dynamic_gain * rate_per_ms + gains.static_gain * values
    return gains.intercept_ma + saturated(both_ma, gains.saturation_per_ma)


def saturated(values: FloatArray, per_value: float) -> FloatArray:
    """Let values x saturate, x / (1 + s |x|): at 1/s a half is left, and none exceeds 1/s."""
    return values / (1.0 + per_value * np.abs(values))


@checked
def drive(
    traces: Traces, *, pieces: Count = PIECES_PER_INTERVAL, shortest_piece_ms: Positive = SHORTEST_PIECE_MS
) -> Drive:
    """Resample what drives the current and compute the rate of change of its dynamic term, Eq. 2.

    The rate is the limit of the printed difference, the derivative of the interpolant; it is 0 at the onset
    and jumps there and at each kink. Each interval between two given times is divided into `pieces` equal
    pieces (fewer if they would be shorter than `shortest_piece_ms`), on which the cubic and its derivative
    are replaced by linear functions. The error decreases with the square of the number of pieces and is
    proportional to the change in the interval. Twice the default number moves half of the spikes of a ramp
    and hold of 8 + 12 steps by less than 0.005 ms, and none by more than 0.1 ms (a spike whose potential
    hardly exceeds the threshold).

    Parameters
    ----------
    traces : Traces
        Its `kinks_ms` and its onset separate the phases, each with its own interpolant. The rate is
        that of the quantity of the dynamic term.
    pieces : int, optional
        Largest number of linear pieces per interval.
    shortest_piece_ms : float, optional
        Lower limit of the length of a piece. [ms]

    Examples
    --------
    >>> ramp = Traces([0.0, 50.0], [[0.0], [2.0]])
    >>> resampled = drive(ramp, pieces=2)
    >>> resampled.times_ms.tolist()
    [0.0, 0.0, 25.0, 50.0]
    >>> resampled.rate_per_ms[:, 0].round(6).tolist()
    [0.0, 0.04, 0.04, 0.04]
    """
    if traces.dynamic is not None:
        static, dynamic = (
            drive(each, pieces=pieces, shortest_piece_ms=shortest_piece_ms)
            for each in (replace(traces, dynamic=None), traces.dynamic)
        )
        return replace(static, rate_per_ms=dynamic.rate_per_ms, dynamic_quantity=dynamic.dynamic_quantity)
    spans = _between_kinks(traces)
    knots = [knots_of(traces.times_ms[first : last + 1], pieces, shortest_piece_ms) for first, last in spans]
    times = np.concatenate([traces.times_ms[:1], *knots])
    values, rates = np.empty((2, times.size, traces.n_sites))
    values[0], rates[0] = traces.values[0], 0.0
    start = 1
    for (first, last), some in zip(spans, knots, strict=True):
        given, rows = slice(first, last + 1), slice(start, start + some.size)
        _interpolate(traces.times_ms[given], traces.values[given], some, values[rows], rates[rows])
        start = rows.stop
    for array in (times, values, rates):
        array.setflags(write=False)
    return Drive(times, values, rates, traces.quantity, traces.quantity, traces.phases)


@njit(cache=True, error_model="numpy", nogil=True)
def _interpolate(given, known, times, values, rates):  # type: ignore[no-untyped-def]
    """Evaluate the monotone cubic through known values, and the absolute value of its derivative."""
    # It is the interpolant of Fritsch and Butland (1984), as in SciPy's `PchipInterpolator`: the slope at a
    # time is a weighted harmonic mean of the slopes of the two intervals beside it, or 0 if they differ in
    # sign. Sites are computed side by side, interval by interval.
    n_given, n_sites = known.shape
    begin, end, ahead = np.empty(n_sites), np.empty(n_sites), np.empty(n_sites)
    row = 0
    for piece in range(n_given - 1):
        length = given[piece + 1] - given[piece]
        after = given[min(piece + 2, n_given - 1)] - given[piece + 1]
        before = given[piece] - given[max(piece - 1, 0)]
        for site in range(n_sites):
            slope = (known[piece + 1, site] - known[piece, site]) / length
            # The slope at the start of an interval is that at the end of the one before.
            begin[site] = end[site]
            if piece == 0:
                begin[site] = slope
                if n_given > 2:
                    follows = (known[2, site] - known[1, site]) / after
                    begin[site] = _end_slope(length, after, slope, follows)
            if piece < n_given - 2:
                follows = (known[piece + 2, site] - known[piece + 1, site]) / after
                w1, w2 = 2.0 * after + length, after + 2.0 * length
                same = slope * follows > 0.0
                end[site] = (w1 + w2) / (w1 / slope + w2 / follows) if same else 0.0
            else:
                end[site] = slope if n_given == 2 else _end_slope(length, before, slope, ahead[site])
            ahead[site] = slope
        while row < times.size and (times[row] < given[piece + 1] or piece == n_given - 2):
            s = times[row] - given[piece]
            for site in range(n_sites):
                c0, c1 = known[piece, site], begin[site]
                c3 = (begin[site] + end[site] - 2.0 * ahead[site]) / length
                c2 = (ahead[site] - begin[site]) / length - c3
                c3 = c3 / length
                values[row, site] = c0 + c1 * s + c2 * (s * s) + c3 * (s * s * s)
                rates[row, site] = abs(c1 + c2 * s * 2.0 + c3 * (s * s) * 3.0)
            row += 1


@njit(cache=True, error_model="numpy", nogil=True)
def _end_slope(length: float, other: float, slope: float, beside: float) -> float:
    """Slope at an end, from those of its interval and of the one beside: three points, and no overshoot."""
    found = ((2.0 * length + other) * slope - length * beside) / (length + other)
    if not found * slope > 0.0:
        return 0.0
    return 3.0 * slope if slope * beside <= 0.0 and abs(found) > 3.0 * abs(slope) else found


def _between_kinks(traces: Traces) -> list[tuple[int, int]]:
    """First and last index of the times of each part between kinks; the onset is one of them."""
    borders = np.flatnonzero(np.isin(traces.times_ms, np.append(traces.kinks_ms, traces.onset_ms)))
    inner = borders[(borders > 0) & (borders < traces.times_ms.size - 1)]
    return list(pairwise([0, *inner.tolist(), traces.times_ms.size - 1]))


def knots_of(times_ms: FloatArray, pieces: int, shortest_piece_ms: float) -> FloatArray:
    """Divide every interval of `times_ms` into equal pieces; the given times stay knots, bit-equal."""
    lengths = np.diff(times_ms)
    # The same touch later has lengths that differ by rounding, and must have as many pieces.
    counts = np.clip(np.floor(lengths / shortest_piece_ms + SAME_COUNT).astype(np.int64), 1, pieces)
    within = np.arange(counts.sum()) - np.repeat(np.cumsum(counts) - counts, counts)
    knots = np.repeat(times_ms[:-1], counts) + within * np.repeat(lengths / counts, counts)
    return np.append(knots, times_ms[-1])
