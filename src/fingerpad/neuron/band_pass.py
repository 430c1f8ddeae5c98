"""A quantity of the skin -> its part within a band of frequencies: what is left of it after adaptation.

A capsule around an ending transmits fast deformation and relaxes under slow one; skin and capsule are too
sluggish for the fastest. Both are one filter with a single corner frequency, 1/(2 pi tau),

    H(s) = (tau s)^rise / (1 + tau s)^(rise + fall),

which increases as the frequency to the power `rise` below the corner and decreases as that to the power
`fall` above it. It consists of first-order stages. Each is exact for an input that is linear between knots.
"""

from __future__ import annotations

import math
from dataclasses import dataclass

import numpy as np
from numba import njit

from fingerpad.core.checks import FloatArray, positive, whole
from fingerpad.core.signals import SedTraces
from fingerpad.core.threads import in_blocks
from fingerpad.core.units import MS_PER_S
from fingerpad.neuron.transduction import Drive, drive

_KNOTS_PER_TIME_CONSTANT = 4.0
"""Knots in the time constant of a stage; the output is linear between them, within 0.3 % of its peak."""


_MOST_PIECES = 2**20


@dataclass(frozen=True)
class BandPass:
    """A filter that transmits a band of frequencies.

    Parameters
    ----------
    corner_hz : float
        Corner frequency. [Hz]
    rise, fall : int
        Powers of the frequency by which it increases below the corner and decreases above it. A constant
        input gives no output, because the rise is at least 1.

    Raises
    ------
    InputError
        If the corner is not positive, or a power is below 1.

    Examples
    --------
    A ramp of 1 kPa in 10 ms and a hold: the output follows the speed of the ramp, and is gone in the hold.

    >>> ramp = SedTraces([0.0, 10.0, 100.0], [[0.0], [1.0], [1.0]], kinks_ms=[10.0])
    >>> times_ms, values = BandPass(corner_hz=100.0, rise=1, fall=1).of(ramp)
    >>> [round(float(values[np.searchsorted(times_ms, at), 0]), 3) for at in (5.0, 10.0, 30.0)]
    [0.133, 0.157, 0.0]
    """

    corner_hz: float
    rise: int
    fall: int

    def __post_init__(self) -> None:
        positive("corner_hz", self.corner_hz, "Hz")
        whole("rise", self.rise, 1)
        whole("fall", self.fall, 1)

    @property
    def time_constant_ms(self) -> float:
        """Time constant of every stage, tau. [ms]"""
        return MS_PER_S / (2.0 * math.pi * self.corner_hz)

    def gain(self, frequency_hz: FloatArray) -> FloatArray:
        """Amplitude of the output over that of a sinusoidal input.

        Examples
        --------
        >>> BandPass(corner_hz=100.0, rise=1, fall=1).gain(np.array([10.0, 100.0, 1000.0])).round(3).tolist()
        [0.099, 0.5, 0.099]
        """
        relative = np.asarray(frequency_hz, np.float64) / self.corner_hz
        return relative**self.rise / np.sqrt(1.0 + relative**2) ** (self.rise + self.fall)

    def of(self, traces: SedTraces | Drive) -> tuple[FloatArray, FloatArray]:
        """Filter the quantity of the static term at every site; before the first time it is constant.

        Parameters
        ----------
        traces : SedTraces or Drive
            Traces are resampled, so that four knots lie within the time constant.

        Returns
        -------
        times_ms : array (n_knots,)
            Knots. [ms]
        values : array (n_knots, n_sites)
            Output, with the unit of the input, linear between the knots.
        """
        step_ms = self.time_constant_ms / _KNOTS_PER_TIME_CONSTANT
        driven = (
            traces if isinstance(traces, Drive) else drive(traces, pieces=2**20, shortest_piece_ms=step_ms)
        )

        def filtered(sites: slice) -> FloatArray:
            values = np.array(driven.sed_kpa[:, sites])
            for stage in range(self.rise + self.fall):
                _stage(driven.times_ms, values, self.time_constant_ms, stage < self.rise)
            return values

        return driven.times_ms, np.hstack(in_blocks(filtered, driven.n_sites))


@njit(cache=True, error_model="numpy", nogil=True)
def _stage(times: FloatArray, values: FloatArray, tau: float, high: bool) -> None:
    """Replace values by those behind one stage, 1/(1 + tau s), or what it holds back if `high`."""
    n_sites = values.shape[1]
    state, before = values[0].copy(), values[0].copy()
    for site in range(n_sites):
        values[0, site] = 0.0 if high else values[0, site]
    for knot in range(1, times.size):
        x = (times[knot] - times[knot - 1]) / tau
        left = math.exp(-x)
        of_before = -math.expm1(-x) / x - left if x > 0.0 else 0.0
        of_now = 1.0 - left - of_before if x > 0.0 else 0.0
        for site in range(n_sites):
            now = values[knot, site]
            state[site] = left * state[site] + of_before * before[site] + of_now * now
            before[site] = now
            values[knot, site] = now - state[site] if high else state[site]
