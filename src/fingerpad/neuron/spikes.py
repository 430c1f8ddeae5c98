"""Spike times -> firing rate, first-spike latency, modulation (paper, Eqs. 6-11)."""

from __future__ import annotations

from collections.abc import Callable, Mapping, Sequence
from types import MappingProxyType

import numpy as np
from numba import njit
from numpy.typing import ArrayLike

from fingerpad.core.errors import InputError
from fingerpad.core.phases import HOLD, RAMP, Phase, phase_named, ramp_and_hold_phases
from fingerpad.core.signals import COUNT, INTERVAL, SpikeTrains, window_bounds
from fingerpad.core.units import MS_PER_S
from fingerpad.core.values import FloatArray, float_array
from fingerpad.data import protocol

Window = tuple[float, ...]  # Start and end. [ms]
Windows = tuple[Window, Window]  # Windows of the dynamic and of the static rate. [ms]

PAPER_WINDOWS_MS: Windows = (protocol.DYNAMIC_WINDOW.value, protocol.STATIC_WINDOW.value)
"""The paper's windows, which belong to its own ramp and hold. [ms]"""

_NAMES = "dynamic_window_ms", "static_window_ms"
_PAPER_PHASES = ramp_and_hold_phases(protocol.RAMP.value, protocol.RAMP.value + protocol.HOLD.value)


def rate_windows_ms(
    phases: Sequence[Phase],
    dynamic_ms: Window | None = None,
    static_ms: Window | None = None,
    end_ms: float | None = None,
    measure: str = INTERVAL,
) -> Windows:
    """Return the windows of the dynamic and of the static rate of a touch.

    A window that is not given has the place of the paper's window in its phase: the last 40 % of the ramp,
    and 550 to 900 ms from the start of the hold, or 58 to 95 % of a hold shorter than the paper's 950 ms
    (docs/decisions/rate-windows.md). Afferents that fire once or twice in a ramp are counted in all of it.
    """
    dynamic, static = (
        given if given is not None else _within(phase_named(phases, paper.name, asks), paper, window)
        for given, paper, window, asks in zip(
            (dynamic_ms, static_ms), _PAPER_PHASES, PAPER_WINDOWS_MS, _NAMES, strict=True
        )
    )
    if measure == COUNT and dynamic_ms is None:
        dynamic = phase_named(phases, RAMP, _NAMES[0]).window_ms
    if end_ms is not None:
        return check_windows((dynamic, static), float(end_ms))
    return dynamic, static


def check_windows(windows_ms: Windows, end_ms: float) -> Windows:
    """Return two windows if both lie in what was recorded, else raise `InputError`."""
    checked = []
    for name, window in zip(_NAMES, windows_ms, strict=True):
        bounds = float_array(name, window, 1)
        if bounds.size != 2 or not 0.0 <= bounds[0] < bounds[1] <= end_ms:
            until = f", at most {end_ms:g} ms, where the touch ends" if np.isfinite(end_ms) else ""
            came = ", ".join(f"{bound:g}" for bound in bounds[:4])
            raise InputError(name, f"must be a start from 0 on and a later end{until}", str(came))
        checked.append((float(bounds[0]), float(bounds[1])))
    return checked[0], checked[1]


def common_rate_windows_ms(
    touches: Sequence[Sequence[Phase]],
    dynamic_ms: Window | None = None,
    static_ms: Window | None = None,
    measure: str = INTERVAL,
) -> Windows:
    """Return the windows that several touches share, each given by its phases, as `rate_windows_ms`."""
    asked = (rate_windows_ms(phases, dynamic_ms, static_ms, measure=measure) for phases in touches)
    found = list(dict.fromkeys(asked))
    if len(found) != 1:
        shown = " or ".join(", ".join(f"{start:g}-{end:g} ms" for start, end in windows) for windows in found)
        raise InputError(f"Windows of the rates must be given where the phases differ: got {shown}.")
    return found[0]


def _within(phase: Phase, paper: Phase, window_ms: Window) -> tuple[float, float]:
    """Window of `phase` at the place of `window_ms` in `paper`; its bits where the phases are equal."""
    length, whole = phase.end_ms - phase.start_ms, paper.end_ms - paper.start_ms
    # A response adapts with the time since the ramp, so a longer hold is read at the same time.
    length = min(length, whole) if phase.name == HOLD else length
    start, end = (phase.start_ms + (bound - paper.start_ms) * length / whole for bound in window_ms)
    return start, end


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
