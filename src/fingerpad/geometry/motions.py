"""Ready-made motions: repeated touches, staircase, stroke along the skin, vibration and sweep on a hold."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import replace
from itertools import pairwise

import numpy as np

from fingerpad.core.checked import checked
from fingerpad.core.errors import InputError
from fingerpad.core.phases import HOLD, RAMP, Phase
from fingerpad.core.units import MS_PER_S
from fingerpad.core.values import (
    Finite,
    FloatArray,
    Positive,
    Whole,
    finite,
    float_array,
    not_negative,
    positive,
    whole,
)
from fingerpad.data import protocol
from fingerpad.geometry.motion import Cycles
from fingerpad.geometry.trajectory import Trajectory

SAMPLES_PER_CYCLE = 20
"""Samples of a sine per cycle; a line between two of them misses it by up to 1.2 % of the amplitude."""


@checked
def sine(
    depth_mm: Finite | None = None,
    amplitude_mm: Finite | None = None,
    frequency_hz: Finite | None = None,
    cycles: Whole | None = None,
    ramp_ms: Finite = protocol.RAMP.value,
    hold_ms: Finite = protocol.HOLD.value,
    *,
    force_mn: Finite | None = None,
    amplitude_mn: Finite | None = None,
) -> Trajectory:
    """Press to a depth or a force, hold it, then vibrate about it.

    Parameters
    ----------
    depth_mm, amplitude_mm : float, optional
        Depth of the hold, and half of the way from peak to peak. [mm]
    frequency_hz : float
        Frequency. [Hz]
    cycles : int
        Number of whole cycles.
    ramp_ms, hold_ms : float, optional
        Durations of the ramp and of the hold before the vibration. [ms]
    force_mn, amplitude_mn : float, optional
        Instead, force of the hold on the whole finger, and half of its change from peak to peak. [mN]

    Returns
    -------
    Trajectory
        With 20 samples per cycle and the phases "ramp", "hold" and "vibration". A press solves some of more
        than 10 cycles and interpolates the others within a tolerance (`PressSettings.cycle_tolerance`).

    Examples
    --------
    >>> motion = sine(0.8, 0.1, 20.0, cycles=2, hold_ms=100.0)
    >>> round(motion.largest, 6), motion.end_ms
    (0.9, 250.0)
    >>> sine(force_mn=100.0, amplitude_mn=20.0, frequency_hz=20.0, cycles=2).by_force
    True
    """
    _check_given("sine", frequency_hz=frequency_hz, cycles=cycles)
    hold = _hold(depth_mm, amplitude_mm, force_mn, amplitude_mn)
    period_ms = MS_PER_S / positive("frequency_hz", frequency_hz, "Hz")
    count = whole("cycles", cycles, at_least=1)
    turns = np.arange(1, SAMPLES_PER_CYCLE * count + 1) / SAMPLES_PER_CYCLE
    motion = _on_a_hold(hold, period_ms * turns, turns, ramp_ms, hold_ms, "vibration")
    return replace(motion, cycles=Cycles(ramp_ms + hold_ms, period_ms, count))


@checked
def chirp(
    depth_mm: Finite | None = None,
    amplitude_mm: Finite | None = None,
    frequencies_hz: Sequence[float] | None = None,
    sweep_ms: Finite | None = None,
    ramp_ms: Finite = protocol.RAMP.value,
    hold_ms: Finite = protocol.HOLD.value,
    *,
    force_mn: Finite | None = None,
    amplitude_mn: Finite | None = None,
) -> Trajectory:
    """Press to a depth or a force, hold it, then vibrate with a frequency that changes at a constant rate.

    Parameters
    ----------
    depth_mm, amplitude_mm, ramp_ms, hold_ms, force_mn, amplitude_mn : float, optional
        As of `sine`. [mm], [ms], [mN]
    frequencies_hz : (float, float)
        First and last frequency, upwards or downwards. [Hz]
    sweep_ms : float
        Duration of the sweep; it ends at the last whole cycle. [ms]

    Returns
    -------
    Trajectory
        With 20 samples per cycle and the phases "ramp", "hold" and "sweep".

    Examples
    --------
    >>> motion = chirp(0.8, 0.05, (5.0, 50.0), sweep_ms=1000.0, ramp_ms=50.0, hold_ms=450.0)
    >>> len(motion.times_ms), round(motion.end_ms, 1)
    (543, 1490.0)
    """
    _check_given("chirp", frequencies_hz=frequencies_hz, sweep_ms=sweep_ms)
    hold = _hold(depth_mm, amplitude_mm, force_mn, amplitude_mn)
    pair = float_array("frequencies_hz", frequencies_hz, 1)  # type: ignore[arg-type]
    if pair.size != 2:
        raise InputError("frequencies_hz", "must be a pair, first and last", str(pair.size))
    first, last = (positive("frequencies_hz", each, "Hz") for each in pair.tolist())
    duration_ms = positive("sweep_ms", sweep_ms, "ms")
    seconds = duration_ms / MS_PER_S
    cycles = int((first + last) / 2.0 * seconds)
    if cycles < 1:
        raise InputError(
            "sweep_ms", f"must leave time for a cycle of {first:g} to {last:g} Hz", f"{duration_ms:g} ms"
        )
    turns = np.arange(1, SAMPLES_PER_CYCLE * cycles + 1) / SAMPLES_PER_CYCLE
    # turns = first t + rate t^2 / 2, solved for t in the form that also holds for a rate of 0.
    rate = (last - first) / seconds
    now_hz = np.sqrt(np.maximum(first**2 + 2.0 * rate * turns, 0.0))
    times_ms = np.minimum(MS_PER_S * 2.0 * turns / (first + now_hz), duration_ms)
    return _on_a_hold(hold, times_ms, turns, ramp_ms, hold_ms, "sweep")


@checked
def repeated(
    depth_mm: Positive, touches: Whole, ramp_ms: Finite, hold_ms: Finite, pause_ms: Finite
) -> Trajectory:
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
        With the phases "ramp", "hold", "release", "pause", "ramp 2" and so on.

    Examples
    --------
    >>> repeated(1.0, 2, ramp_ms=50.0, hold_ms=200.0, pause_ms=300.0).end_ms
    1200.0
    """
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


@checked
def staircase(
    depths_mm: Sequence[float] | None = None,
    forces_mn: Sequence[float] | None = None,
    *,
    ramp_ms: Finite = protocol.RAMP.value,
    hold_ms: Finite = protocol.HOLD.value,
) -> Trajectory:
    """Press to several depths or forces, one after the other, and hold each.

    Parameters
    ----------
    depths_mm : sequence of float, optional
        Depths of the steps, upwards or downwards; 0 is first touch. [mm]
    forces_mn : sequence of float, optional
        Instead of depths, forces on the whole finger. [mN]
    ramp_ms, hold_ms : float, optional
        Durations of each ramp and of each hold. [ms]

    Returns
    -------
    Trajectory
        With the phases "ramp", "hold", "ramp 2", "hold 2" and so on, or "release" for a step down.

    Examples
    --------
    >>> steps = staircase(depths_mm=[0.5, 1.0, 0.2], ramp_ms=50.0, hold_ms=300.0)
    >>> [phase.name for phase in steps.phases]
    ['ramp', 'hold', 'ramp 2', 'hold 2', 'release', 'hold 3']
    """

    def doubled(name: str, values: Sequence[float] | None) -> tuple[float, ...] | None:
        """Each level at the end of its ramp and of its hold, after 0."""
        return None if values is None else (0.0, *np.repeat(float_array(name, values, 1), 2).tolist())

    depths, forces = doubled("depths_mm", depths_mm), doubled("forces_mn", forces_mn)
    count = len(depths or forces or ()) // 2
    lengths_ms = count * [positive("ramp_ms", ramp_ms, "ms"), positive("hold_ms", hold_ms, "ms")]
    return Trajectory((0.0, *np.cumsum(lengths_ms).tolist()), depths, forces)


@checked
def stroke(
    depth_mm: Finite | None = None,
    force_mn: Finite | None = None,
    *,
    speed_mm_per_s: Finite,
    x_mm: Finite = 0.0,
    z_mm: Finite = 0.0,
    strokes: Whole = 1,
    ramp_ms: Finite = protocol.RAMP.value,
    hold_ms: Finite = protocol.HOLD.value,
) -> Trajectory:
    """Press, hold, then slide along the skin at a constant speed, once or to and fro.

    Parameters
    ----------
    depth_mm : float, optional
        Depth of the hold and of the strokes. [mm]
    force_mn : float, optional
        Instead of a depth, force on the whole finger. [mN]
    speed_mm_per_s : float
        Speed along the skin. [mm/s]
    x_mm, z_mm : float, optional
        Way of a stroke along the finger, distal positive, and across it; one of them at least. [mm]
    strokes : int, optional
        How often it goes there or back.
    ramp_ms, hold_ms : float, optional
        Durations of the ramp and of the hold before the first stroke; the hold may be 0. [ms]

    Returns
    -------
    Trajectory
        With the phases "ramp", "hold", "stroke", "stroke 2" and so on.

    Examples
    --------
    >>> there_and_back = stroke(0.5, speed_mm_per_s=20.0, x_mm=5.0, strokes=2, hold_ms=200.0)
    >>> there_and_back.times_ms, there_and_back.x_mm
    ((0.0, 50.0, 250.0, 500.0, 750.0), (0.0, 0.0, 0.0, 5.0, 0.0))
    """
    way_mm = float(np.hypot(finite("x_mm", x_mm, "mm"), finite("z_mm", z_mm, "mm")))
    if way_mm == 0.0:
        raise InputError("x_mm or z_mm must not be 0: a stroke needs a way.")
    one_ms = MS_PER_S * way_mm / positive("speed_mm_per_s", speed_mm_per_s, "mm/s")
    before_ms = _before(ramp_ms, hold_ms)
    n = whole("strokes", strokes, at_least=1)
    times_ms = (*before_ms, *(before_ms[-1] + one_ms * np.arange(1, n + 1)).tolist())
    there = np.array([0.0] * len(before_ms) + [float(number % 2) for number in range(1, n + 1)])

    def pressed(level: float | None) -> tuple[float, ...] | None:
        return None if level is None else (0.0, *[level] * (len(times_ms) - 1))

    return Trajectory(
        times_ms,
        pressed(depth_mm),
        pressed(force_mn),
        x_mm=tuple((x_mm * there).tolist()),
        z_mm=tuple((z_mm * there).tolist()),
        phases=_named(("stroke", *(f"stroke {number}" for number in range(2, n + 1))), before_ms, times_ms),
    )


def _check_given(name: str, **needed: object) -> None:
    """Raise `InputError` if a parameter is missing that has a default only for the order of the others."""
    missing = [parameter for parameter, value in needed.items() if value is None]
    if missing:
        those = "they are" if len(missing) > 1 else "it is"
        raise InputError(name, f"needs {', '.join(missing)}", remedy=f"{those} not given")


def _hold(
    depth_mm: float | None, amplitude_mm: float | None, force_mn: float | None, amplitude_mn: float | None
) -> tuple[str, float, float]:
    """Return the column of a trajectory that vibrates, its value in the hold and the amplitude."""
    given = {
        name: value
        for name, value in (
            ("depth_mm", depth_mm), ("amplitude_mm", amplitude_mm),
            ("force_mn", force_mn), ("amplitude_mn", amplitude_mn),
        )
        if value is not None
    }  # fmt: skip
    if tuple(given) not in (("depth_mm", "amplitude_mm"), ("force_mn", "amplitude_mn")):
        raise InputError(
            "A vibration needs either depth_mm and amplitude_mm or force_mn and amplitude_mn: got "
            f"{', '.join(given) or 'none of them'}."
        )
    (column, level), (name, amplitude) = (
        (name, positive(name, value, "mN" if force_mn is not None else "mm")) for name, value in given.items()
    )
    if column == "force_mn" and amplitude > level:
        raise InputError(name, f"must be at most force_mn, {level:g} mN", f"{amplitude:g}")
    return column, level, amplitude


def _on_a_hold(
    hold: tuple[str, float, float],
    since_ms: FloatArray,
    turns: FloatArray,
    ramp_ms: float,
    hold_ms: float,
    name: str,
) -> Trajectory:
    """Make a ramp and hold, then a vibration that has made `turns` at times `since_ms` after the hold."""
    (column, level, amplitude), before_ms = hold, _before(ramp_ms, hold_ms)
    times_ms = (*before_ms, *(before_ms[-1] + since_ms).tolist())
    vibrated = level + amplitude * np.sin(2.0 * np.pi * turns)
    values = 0.0, *[level] * (len(before_ms) - 1), *vibrated.tolist()
    return Trajectory(
        times_ms,
        values if column == "depth_mm" else None,
        values if column == "force_mn" else None,
        phases=_named((name,), before_ms, (before_ms[-1], times_ms[-1])),
    )


def _before(ramp_ms: float, hold_ms: float) -> tuple[float, ...]:
    """Return the samples of a ramp, and of a hold unless it takes no time. [ms]"""
    positive("ramp_ms", ramp_ms, "ms")
    held = (ramp_ms + hold_ms,) if not_negative("hold_ms", hold_ms, "ms") > 0.0 else ()
    return 0.0, ramp_ms, *held


def _named(names: Sequence[str], before_ms: Sequence[float], times_ms: Sequence[float]) -> tuple[Phase, ...]:
    """Return the phases of `_before`, then named ones that end at the last times."""
    ends_ms = (*before_ms, *times_ms[-len(names) :])
    all_names = (*(RAMP, HOLD)[: len(before_ms) - 1], *names)
    return tuple(Phase(name, *ends) for name, ends in zip(all_names, pairwise(ends_ms), strict=True))
