"""Strain energy density at the end organ -> membrane current (paper, Eqs. 1-2).

The current needs the rate of change of strain energy density (SED), but mechanics knows SED only at some
times. Between them SED is taken as monotone cubic (PCHIP), one interpolant per phase of the motion, so
that the rate may jump where ramp meets hold. Its derivative is exact and never changes sign between two
given times, which makes the absolute value in Eq. 2 harmless.

What does not depend on the gains, SED and its rate on fine knots, is a `Drive`. Resample once, then try
many gains: each costs a linear combination.

In the paper both terms follow SED. As an extension, traces may bring another quantity for the dynamic term:
I = beta + k_d |Q'| + k_s U (docs/decisions/dynamic-term-quantity.md).
"""

from __future__ import annotations

from dataclasses import dataclass, replace
from itertools import pairwise

import numpy as np
from numba import njit
from scipy.interpolate import PchipInterpolator, PPoly

from fingerpad.core.checks import FloatArray, finite, float_array, positive, whole
from fingerpad.core.errors import InputError
from fingerpad.core.signals import STORED_ENERGY, CurrentTraces, SedTraces

PIECES_PER_INTERVAL = 32
"""Linear pieces that stand for the cubic between two given times, at most."""

SHORTEST_PIECE_MS = 0.25
"""Times given closer than a few of these are cut into fewer pieces. [ms]"""


@dataclass(frozen=True)
class Drive:
    """Strain energy density and its rate of change, both piecewise linear between the same knots.

    Parameters
    ----------
    times_ms : array (n_knots,)
        Knots; a repeated one is a discontinuity of the rate. [ms]
    sed_kpa : array (n_knots, n_sites)
        Strain energy density. [kPa]
    rate_kpa_per_ms : array (n_knots, n_sites)
        Absolute rate of change of SED, U' of Eq. 2, or of what the dynamic term follows instead; 0 at the
        onset. [kPa/ms, of a strain 1/ms]
    dynamic_quantity : str, optional
        Whose rate that is, by the names of `SkinResponse.sample`; "stored" is SED itself.
    """

    times_ms: FloatArray
    sed_kpa: FloatArray
    rate_kpa_per_ms: FloatArray
    dynamic_quantity: str = STORED_ENERGY

    def __post_init__(self) -> None:
        object.__setattr__(self, "times_ms", float_array("times_ms", self.times_ms, 1))
        for name in ("sed_kpa", "rate_kpa_per_ms"):
            object.__setattr__(self, name, float_array(name, getattr(self, name), 2))
        if not self.times_ms.size == len(self.sed_kpa) or self.sed_kpa.shape != self.rate_kpa_per_ms.shape:
            raise InputError(
                "Drive needs one row of sed_kpa and of rate_kpa_per_ms per knot: "
                f"got {self.sed_kpa.shape} and {self.rate_kpa_per_ms.shape} for {self.times_ms.size} knots."
            )

    @property
    def n_sites(self) -> int:
        """Number of receptor sites."""
        return self.sed_kpa.shape[1]

    def part(self, sites: slice) -> Drive:
        """Drive of some of the sites."""
        if sites == slice(0, self.n_sites):
            return self
        return Drive(
            self.times_ms, self.sed_kpa[:, sites], self.rate_kpa_per_ms[:, sites], self.dynamic_quantity
        )


@dataclass(frozen=True)
class Transduction:
    """Gains that turn strain energy density (SED) into membrane current.

    Parameters
    ----------
    intercept_ma : float
        Current without any load, beta. [mA]
    dynamic_gain : float
        Gain on the rate of change of SED, k_d. [mA ms/kPa]
    static_gain : float
        Gain on SED itself, k_s. [mA/kPa]

    Examples
    --------
    SED rises by 2 kPa in 50 ms and stays: the current steps up, grows, drops and stays.

    >>> sed = SedTraces([0.0, 50.0, 1000.0], [[0.0], [2.0], [2.0]], kinks_ms=[50.0])
    >>> current = Transduction(0.0, dynamic_gain=1e-4, static_gain=1e-6).current(sed)
    >>> [f"{current.current_ma[knot, 0]:.1e}" for knot in (0, 1, 33, 34, -1)]
    ['0.0e+00', '4.0e-06', '6.0e-06', '2.0e-06', '2.0e-06']
    """

    intercept_ma: float
    dynamic_gain: float
    static_gain: float

    def __post_init__(self) -> None:
        finite("intercept_ma", self.intercept_ma, "mA")
        finite("dynamic_gain", self.dynamic_gain, "mA ms/kPa")
        finite("static_gain", self.static_gain, "mA/kPa")

    def current(self, sed: SedTraces | Drive) -> CurrentTraces:
        """Turn SED into the current through the membrane at every site, Eq. 1: I = beta + k_d U' + k_s U.

        Parameters
        ----------
        sed : SedTraces or Drive
            Traces are resampled with the defaults of `drive`; a drive is used as it is.

        Returns
        -------
        CurrentTraces
            With a jump wherever the rate jumps.
        """
        driven = sed if isinstance(sed, Drive) else drive(sed)
        current_ma = (
            self.intercept_ma + self.dynamic_gain * driven.rate_kpa_per_ms + self.static_gain * driven.sed_kpa
        )
        return CurrentTraces(driven.times_ms, current_ma)


def drive(
    sed: SedTraces,
    *,
    difference_step_ms: float | None = None,
    pieces: int = PIECES_PER_INTERVAL,
    shortest_piece_ms: float = SHORTEST_PIECE_MS,
) -> Drive:
    """Resample strain energy density and find its rate of change, Eq. 2.

    Each interval between two given times is cut into `pieces` equal pieces (fewer where they would be
    shorter than `shortest_piece_ms`), on which the cubic and its derivative are replaced by straight
    lines. The error falls with the square of the number of pieces and scales with the change of SED in
    the interval, so that long smooth intervals need no more knots than short steep ones. Twice the
    default number moves no spike of a ramp and hold given at 8 + 12 steps by more than 0.1 ms, which
    is a spike that only grazes the threshold, and half of the spikes by less than 0.005 ms.

    Parameters
    ----------
    sed : SedTraces
        Its `kinks_ms` part the phases that are interpolated on their own. Where it brings `dynamic_kpa`, the
        rate is that of this quantity.
    difference_step_ms : float, optional
        Step h of the backward difference printed as Eq. 2 (the paper: 0.001 ms). Before the onset SED is
        that of the onset. Default: the limit h -> 0, the derivative of the interpolant. [ms]
    pieces : int, optional
        Linear pieces per interval, at most.
    shortest_piece_ms : float, optional
        No piece is made shorter than this. [ms]

    Returns
    -------
    Drive
        The rate is 0 at the onset and jumps there and at each kink; a difference takes `difference_step_ms`
        to make the jump.

    Raises
    ------
    InputError
        If a step or the number of pieces is not positive.

    Examples
    --------
    >>> ramp = SedTraces([0.0, 50.0], [[0.0], [2.0]])
    >>> resampled = drive(ramp, pieces=2)
    >>> resampled.times_ms.tolist()
    [0.0, 0.0, 25.0, 50.0]
    >>> resampled.rate_kpa_per_ms[:, 0].round(6).tolist()
    [0.0, 0.04, 0.04, 0.04]
    """
    whole("pieces", pieces, 1)
    positive("shortest_piece_ms", shortest_piece_ms, "ms")
    if sed.dynamic_kpa is not None:
        energy, followed = (
            drive(
                SedTraces(sed.times_ms, values, sed.kinks_ms),
                difference_step_ms=difference_step_ms,
                pieces=pieces,
                shortest_piece_ms=shortest_piece_ms,
            )
            for values in (sed.sed_kpa, sed.dynamic_kpa)
        )
        return replace(
            energy, rate_kpa_per_ms=followed.rate_kpa_per_ms, dynamic_quantity=sed.dynamic_quantity
        )
    phases = _phases(sed)
    knots = [_knots(phase.x, pieces, shortest_piece_ms) for phase in phases]
    if difference_step_ms is not None:
        return _difference(phases, knots, positive("difference_step_ms", difference_step_ms, "ms"))
    times = np.concatenate([sed.times_ms[:1], *knots])
    values, rates = np.empty((2, times.size, sed.n_sites))
    values[0], rates[0] = sed.sed_kpa[0], 0.0
    first = 1
    for phase, phase_knots in zip(phases, knots, strict=True):
        rows = slice(first, first + phase_knots.size)
        _evaluate(phase.c, phase.x, phase_knots, values[rows], rates[rows])
        first = rows.stop
    return Drive(times, values, rates)


@njit(cache=True, nogil=True)
def _evaluate(coefficients, breaks, times, values, rates):  # type: ignore[no-untyped-def]
    """Write a piecewise cubic and the absolute value of its derivative at increasing times within `breaks`.

    As SciPy does it, to the last bit, but both at once and on all sites side by side.

    Parameters
    ----------
    coefficients : array (4, n_breaks - 1, n_sites)
        Of the third to the zeroth power of the time since the break before.
    breaks, times : array (n_breaks,), (n_times,)
        Where the pieces meet, and where values are wanted. [ms]
    values, rates : array (n_times, n_sites)
        Overwritten.
    """
    piece = 0
    for row in range(times.size):
        while piece < breaks.size - 2 and breaks[piece + 1] <= times[row]:
            piece += 1
        s = times[row] - breaks[piece]
        for site in range(coefficients.shape[2]):
            c3, c2 = coefficients[0, piece, site], coefficients[1, piece, site]
            c1, c0 = coefficients[2, piece, site], coefficients[3, piece, site]
            values[row, site] = c0 + c1 * s + c2 * (s * s) + c3 * (s * s * s)
            rates[row, site] = abs(c1 + c2 * s * 2.0 + c3 * (s * s) * 3.0)


def _phases(sed: SedTraces) -> list[PPoly]:
    """Return one monotone interpolant of SED for each stretch between kinks."""
    parts = np.searchsorted(sed.times_ms, sed.kinks_ms)
    inner = parts[(parts > 0) & (parts < sed.times_ms.size - 1)]
    ends = [0, *inner.tolist(), sed.times_ms.size - 1]
    return [
        PchipInterpolator(sed.times_ms[first : last + 1], sed.sed_kpa[first : last + 1], axis=0)
        for first, last in pairwise(ends)
    ]


def _knots(times_ms: FloatArray, pieces: int, shortest_piece_ms: float) -> FloatArray:
    """Cut every interval of `times_ms` into equal pieces; the given times stay knots, to the last bit."""
    lengths = np.diff(times_ms)
    counts = np.clip(np.floor(lengths / shortest_piece_ms).astype(np.int64), 1, pieces)
    within = np.arange(counts.sum()) - np.repeat(np.cumsum(counts) - counts, counts)
    knots = np.repeat(times_ms[:-1], counts) + within * np.repeat(lengths / counts, counts)
    return np.append(knots, times_ms[-1])


def _difference(phases: list[PPoly], knots: list[FloatArray], step_ms: float) -> Drive:
    """Return the backward difference of Eq. 2, as printed: U' = |U(t) - U(t - h)| / h."""
    given = np.concatenate([phases[0].x[:1], *(phase.x[1:] for phase in phases)])
    sed = PPoly(np.concatenate([phase.c for phase in phases], axis=1), given)
    onset, end = given[0], given[-1]
    # One step after a kink the difference has left the old phase behind: a knot there keeps the jump short.
    settled = np.array([phase.x[0] + step_ms for phase in phases])
    times = np.unique(np.concatenate([*knots, settled[settled < end]]))
    before = np.maximum(times - step_ms, onset)
    return Drive(times, sed(times), np.abs(sed(times) - sed(before)) / step_ms)
