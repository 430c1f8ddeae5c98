"""Strain energy density at the end organ -> membrane current (paper, Eqs. 1-2).

The current needs the rate of change of strain energy density (SED), but mechanics computes SED only at some
times. Between them SED is interpolated by monotone cubics (PCHIP), with one interpolant per phase of the
motion, so that the rate may jump between ramp and hold. The derivative of the interpolant does not change
sign between two given times, so the absolute value in Eq. 2 adds no kink there.

A `Drive` holds what does not depend on the gains: SED and its rate on fine knots. It is computed once; the
current for any gains is then a linear combination.

In the paper both terms use SED. As an extension, another quantity may take its place in either term:
I = beta + k_d |Q'| + k_s P (docs/decisions/dynamic-term-quantity.md).
"""

from __future__ import annotations

from dataclasses import dataclass, replace
from itertools import pairwise

import numpy as np
from numba import njit
from scipy.interpolate import PchipInterpolator, PPoly

from fingerpad.core.checks import FloatArray, finite, float_array, positive, whole
from fingerpad.core.errors import InputError
from fingerpad.core.phases import Phase
from fingerpad.core.signals import STORED_ENERGY, CurrentTraces, SedTraces

PIECES_PER_INTERVAL = 32
"""Largest number of linear pieces that replace the cubic between two given times."""

SHORTEST_PIECE_MS = 0.25
"""Shortest linear piece: shorter intervals are divided into fewer pieces. [ms]"""


@dataclass(frozen=True)
class Drive:
    """Strain energy density and its rate of change, both piecewise linear between the same knots.

    Parameters
    ----------
    times_ms : array (n_knots,)
        Knots; a repeated knot is a jump of the rate. [ms]
    sed_kpa : array (n_knots, n_sites)
        Strain energy density, or the quantity of the static term in its place. [kPa]
    rate_kpa_per_ms : array (n_knots, n_sites)
        Absolute rate of change of SED, U' of Eq. 2, or of another quantity of the dynamic term; 0 at the
        onset. [kPa/ms, for a strain 1/ms]
    dynamic_quantity, static_quantity : str, optional
        What the two terms follow, by the names of `SkinResponse.sample`; "stored" is SED.
    phases : tuple of Phase, optional
        As of `SedTraces`.
    """

    times_ms: FloatArray
    sed_kpa: FloatArray
    rate_kpa_per_ms: FloatArray
    dynamic_quantity: str = STORED_ENERGY
    static_quantity: str = STORED_ENERGY
    phases: tuple[Phase, ...] = ()

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
        return replace(self, sed_kpa=self.sed_kpa[:, sites], rate_kpa_per_ms=self.rate_kpa_per_ms[:, sites])


@dataclass(frozen=True)
class Transduction:
    """Gains that transform strain energy density (SED) to membrane current.

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
    SED rises by 2 kPa in 50 ms and stays: the current jumps, grows, drops and stays.

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
        """Compute the current through the membrane at every site, Eq. 1: I = beta + k_d U' + k_s U.

        Parameters
        ----------
        sed : SedTraces or Drive
            Traces are resampled with the defaults of `drive`.

        Returns
        -------
        CurrentTraces
            It jumps where the rate jumps.
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
    """Resample strain energy density and compute its rate of change, Eq. 2.

    Each interval between two given times is divided into `pieces` equal pieces (fewer if they would be
    shorter than `shortest_piece_ms`), on which the cubic and its derivative are replaced by linear
    functions. The error decreases with the square of the number of pieces and is proportional to the change
    of SED in the interval, so long smooth intervals need no more knots than short steep ones. Twice the
    default number moves half of the spikes of a ramp and hold of 8 + 12 steps by less than 0.005 ms, and
    none by more than 0.1 ms (a spike whose potential hardly exceeds the threshold).

    Parameters
    ----------
    sed : SedTraces
        Its `kinks_ms` separate the phases, each with its own interpolant. If it has `dynamic_kpa`, the rate
        is that of this quantity.
    difference_step_ms : float, optional
        Step h of the backward difference printed as Eq. 2 (the paper: 0.001 ms). Before the onset SED is
        that of the onset. Default: the limit h -> 0, the derivative of the interpolant. [ms]
    pieces : int, optional
        Largest number of linear pieces per interval.
    shortest_piece_ms : float, optional
        Lower limit of the length of a piece. [ms]

    Returns
    -------
    Drive
        The rate is 0 at the onset and jumps there and at each kink; with `difference_step_ms`, a jump takes
        one step.

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
            energy,
            rate_kpa_per_ms=followed.rate_kpa_per_ms,
            dynamic_quantity=sed.dynamic_quantity,
            static_quantity=sed.static_quantity,
            phases=sed.phases,
        )
    parts = _between_kinks(sed)
    knots = [_knots(part.x, pieces, shortest_piece_ms) for part in parts]
    if difference_step_ms is not None:
        driven = _difference(parts, knots, positive("difference_step_ms", difference_step_ms, "ms"))
        return replace(
            driven,
            dynamic_quantity=sed.dynamic_quantity,
            static_quantity=sed.static_quantity,
            phases=sed.phases,
        )
    times = np.concatenate([sed.times_ms[:1], *knots])
    values, rates = np.empty((2, times.size, sed.n_sites))
    values[0], rates[0] = sed.sed_kpa[0], 0.0
    first = 1
    for part, part_knots in zip(parts, knots, strict=True):
        rows = slice(first, first + part_knots.size)
        _evaluate(part.c, part.x, part_knots, values[rows], rates[rows])
        first = rows.stop
    return Drive(times, values, rates, sed.dynamic_quantity, sed.static_quantity, sed.phases)


@njit(cache=True, nogil=True)
def _evaluate(coefficients, breaks, times, values, rates):  # type: ignore[no-untyped-def]
    """Evaluate a piecewise cubic and the absolute value of its derivative at increasing times.

    The results are bit-equal to SciPy's; both are computed in one pass over all sites.

    Parameters
    ----------
    coefficients : array (4, n_breaks - 1, n_sites)
        Coefficients of the third to the zeroth power of the time since the previous break.
    breaks, times : array (n_breaks,), (n_times,)
        Ends of the pieces, and times of the values, within the breaks. [ms]
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


def _between_kinks(sed: SedTraces) -> list[PPoly]:
    """Return one monotone interpolant of SED for each part between kinks."""
    borders = np.searchsorted(sed.times_ms, sed.kinks_ms)
    inner = borders[(borders > 0) & (borders < sed.times_ms.size - 1)]
    ends = [0, *inner.tolist(), sed.times_ms.size - 1]
    return [
        PchipInterpolator(sed.times_ms[first : last + 1], sed.sed_kpa[first : last + 1], axis=0)
        for first, last in pairwise(ends)
    ]


def _knots(times_ms: FloatArray, pieces: int, shortest_piece_ms: float) -> FloatArray:
    """Divide every interval of `times_ms` into equal pieces; the given times stay knots, bit-equal."""
    lengths = np.diff(times_ms)
    counts = np.clip(np.floor(lengths / shortest_piece_ms).astype(np.int64), 1, pieces)
    within = np.arange(counts.sum()) - np.repeat(np.cumsum(counts) - counts, counts)
    knots = np.repeat(times_ms[:-1], counts) + within * np.repeat(lengths / counts, counts)
    return np.append(knots, times_ms[-1])


def _difference(parts: list[PPoly], knots: list[FloatArray], step_ms: float) -> Drive:
    """Compute the backward difference of Eq. 2 as printed: U' = |U(t) - U(t - h)| / h."""
    given = np.concatenate([parts[0].x[:1], *(part.x[1:] for part in parts)])
    sed = PPoly(np.concatenate([part.c for part in parts], axis=1), given)
    onset, end = given[0], given[-1]
    # From one step after a kink on, the difference lies within one part: a knot there limits the jump.
    settled = np.array([part.x[0] + step_ms for part in parts])
    times = np.unique(np.concatenate([*knots, settled[settled < end]]))
    before = np.maximum(times - step_ms, onset)
    return Drive(times, sed(times), np.abs(sed(times) - sed(before)) / step_ms)
