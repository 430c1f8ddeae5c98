"""Ready-made motions: repeated touches and vibration on a hold."""

from __future__ import annotations

from collections.abc import Sequence
from itertools import pairwise

import numpy as np

from fingerpad.core.checks import not_negative, positive, whole
from fingerpad.core.phases import Phase
from fingerpad.core.units import MS_PER_S
from fingerpad.data import protocol
from fingerpad.geometry.trajectory import Trajectory

SAMPLES_PER_CYCLE = 20
"""Samples of a sine per cycle; a line between two of them misses it by up to 1.2 % of the amplitude."""


def sine(
    depth_mm: float,
    amplitude_mm: float,
    frequency_hz: float,
    cycles: int,
    ramp_ms: float = protocol.RAMP.value,
    hold_ms: float = protocol.HOLD.value,
) -> Trajectory:
    """Indent to a depth, hold it, then vibrate about it.

    Parameters
    ----------
    depth_mm : float
        Depth of the hold. [mm]
    amplitude_mm : float
        Half of the way from peak to peak. [mm]
    frequency_hz : float
        Frequency. [Hz]
    cycles : int
        Number of whole cycles.
    ramp_ms, hold_ms : float, optional
        Durations of the ramp and of the hold before the vibration. [ms]

    Returns
    -------
    Trajectory
        With 20 samples per cycle.

    Examples
    --------
    >>> motion = sine(0.8, 0.1, 20.0, cycles=2, hold_ms=100.0)
    >>> round(motion.largest, 6), motion.end_ms
    (0.9, 250.0)
    """
    positive("depth_mm", depth_mm, "mm")
    positive("amplitude_mm", amplitude_mm, "mm")
    positive("ramp_ms", ramp_ms, "ms")
    not_negative("hold_ms", hold_ms, "ms")
    period_ms = MS_PER_S / positive("frequency_hz", frequency_hz, "Hz")
    phase = np.arange(1, SAMPLES_PER_CYCLE * whole("cycles", cycles, at_least=1) + 1) / SAMPLES_PER_CYCLE
    before_ms = [0.0, ramp_ms, ramp_ms + hold_ms][: 3 if hold_ms > 0.0 else 2]
    times_ms = (*before_ms, *(before_ms[-1] + period_ms * phase))
    return Trajectory(
        times_ms,
        (0.0, *[depth_mm] * (len(before_ms) - 1), *(depth_mm + amplitude_mm * np.sin(2.0 * np.pi * phase))),
        phases=_named(("ramp", "hold", "vibration"), (0.0, ramp_ms, before_ms[-1], times_ms[-1])),
    )


def repeated(depth_mm: float, touches: int, ramp_ms: float, hold_ms: float, pause_ms: float) -> Trajectory:
    """Press several times to the same depth, with pauses at first touch of the undeformed skin.

    Parameters
    ----------
    depth_mm : float
        Depth of each hold. [mm]
    touches : int
        How often.
    ramp_ms, hold_ms, pause_ms : float
        Durations of a ramp (in and out), of a hold and of a pause. [ms]

    Returns
    -------
    Trajectory

    Examples
    --------
    >>> repeated(1.0, 2, ramp_ms=50.0, hold_ms=200.0, pause_ms=300.0).end_ms
    1200.0
    """
    positive("depth_mm", depth_mm, "mm")
    lengths_ms = [
        positive(name, value, "ms")
        for name, value in (
            ("ramp_ms", ramp_ms),
            ("hold_ms", hold_ms),
            ("ramp_ms", ramp_ms),
            ("pause_ms", pause_ms),
        )
    ]
    n = whole("touches", touches, at_least=1)
    return Trajectory((0.0, *np.cumsum(n * lengths_ms)), (0.0, *n * (depth_mm, depth_mm, 0.0, 0.0)))


def _named(names: Sequence[str], ends_ms: Sequence[float]) -> tuple[Phase, ...]:
    """Return phases that follow each other, without those of no length; (n + 1,) ends for n names."""
    return tuple(
        Phase(name, start, end)
        for name, (start, end) in zip(names, pairwise(ends_ms), strict=True)
        if end > start
    )
