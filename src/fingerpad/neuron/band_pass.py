"""A quantity of the skin -> its part within a band of frequencies: what is left of it after adaptation.

A capsule around an ending transmits fast deformation and relaxes under slow one; skin and capsule are too
sluggish for the fastest. Both are one filter with a single corner frequency, 1/(2 pi tau),

    H(s) = (tau s)^rise / (1 + tau s)^(rise + fall),

which increases as the frequency to the power `rise` below the corner and decreases as that to the power
`fall` above it. It consists of first-order stages. Each is exact for an input that is linear between knots.
"""

from __future__ import annotations

import math
from functools import lru_cache

import numpy as np
from numba import njit

from fingerpad.core.checked import value_class
from fingerpad.core.signals import Traces
from fingerpad.core.threads import in_blocks
from fingerpad.core.units import MS_PER_S
from fingerpad.core.values import Count, FloatArray, Positive
from fingerpad.neuron.transduction import Drive, drive, knots_of

_KNOTS_PER_TIME_CONSTANT = 4.0
"""Knots in the time constant of a stage; the output is linear between them, within 0.3 % of its peak."""

_MOST_PIECES = 2**20


@value_class
class BandPass:
    """A filter that transmits a band of frequencies."""

    corner_hz: Positive  #: Corner frequency. [Hz]
    rise: Count
    fall: Count
    """Powers of the frequency by which it increases below the corner and decreases above it. A constant input
    gives no output, because the rise is at least 1."""

    @property
    def time_constant_ms(self) -> float:
        """Time constant of every stage, tau. [ms]"""
        return MS_PER_S / (2.0 * math.pi * self.corner_hz)

    @property
    def largest_share(self) -> float:
        """Bound of the output over the range of the input: half of the integral of |impulse response|. [1]"""
        return _largest_share(self.rise, self.fall)

    def of(self, traces: Traces | Drive) -> tuple[FloatArray, FloatArray]:
        """Filter the quantity of the static term at every site; before the first time it is constant."""
        driven = traces if isinstance(traces, Drive) else resampled(traces, self.time_constant_ms)
        return driven.times_ms, _filtered(driven, self.time_constant_ms, self.rise, self.fall)


@lru_cache
def _largest_share(rise: int, fall: int) -> float:
    """Half of the variation of the step response, by its values at short steps."""
    times = np.append(0.0, np.linspace(0.0, 10.0 * (rise + fall), 4001))
    response = np.ones((times.size, 1))
    response[0] = 0.0
    for stage in range(rise + fall):
        continued_stage(times, response, 1.0, stage < rise, response[0].copy())
    return 0.5 * float(np.abs(np.diff(response[:, 0])).sum())


def knots_between(start_ms: float, end_ms: float, time_constant_ms: float) -> FloatArray:
    """Knots of `resampled` between two times, both included. [ms]"""
    return knots_of(np.array([start_ms, end_ms]), _MOST_PIECES, time_constant_ms / _KNOTS_PER_TIME_CONSTANT)


def resampled(traces: Traces, time_constant_ms: float) -> Drive:
    """Resample traces so finely that a first-order stage with this time constant follows them. [ms]"""
    step_ms = time_constant_ms / _KNOTS_PER_TIME_CONSTANT
    return drive(traces, pieces=_MOST_PIECES, shortest_piece_ms=step_ms)


def smoothed_rate(traces: Traces, time_constant_ms: float) -> tuple[FloatArray, FloatArray]:
    """Rate of change of a quantity behind a first-order low pass: what this holds back, over its constant."""
    driven = resampled(traces, time_constant_ms)
    return driven.times_ms, _filtered(driven, time_constant_ms, rise=1, fall=0) / time_constant_ms


def _filtered(driven: Drive, time_constant_ms: float, rise: int, fall: int) -> FloatArray:
    """Values behind stages of which the first ones hold back what the low pass transmits."""

    def filtered(sites: slice) -> FloatArray:
        values = np.array(driven.values[:, sites])
        for stage in range(rise + fall):
            continued_stage(driven.times_ms, values, time_constant_ms, stage < rise, values[0].copy())
        return values

    return np.hstack(in_blocks(filtered, driven.n_sites))


@njit(cache=True, error_model="numpy", nogil=True)
def continued_stage(times: FloatArray, values: FloatArray, tau: float, high: bool, state: FloatArray) -> None:
    """Replace values by those behind one stage, 1/(1 + tau s), or what it holds back if `high`."""
    # The state (n_sites,) of the low pass is overwritten with the last one.
    n_sites = values.shape[1]
    before = values[0].copy()
    for site in range(n_sites):
        values[0, site] = values[0, site] - state[site] if high else state[site]
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
