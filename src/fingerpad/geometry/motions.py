"""Ready-made motions: touches, vibrations, strokes, rotations; motions from functions and CSV files."""

from __future__ import annotations

from collections.abc import Callable, Sequence
from dataclasses import replace
from itertools import pairwise
from pathlib import Path
from typing import Annotated, Any

import numpy as np
from numpy.typing import ArrayLike
from scipy.optimize import minimize_scalar

from fingerpad.core.checked import checked
from fingerpad.core.errors import InputError
from fingerpad.core.files import path_of
from fingerpad.core.phases import HOLD, RAMP, Phase
from fingerpad.core.tables import TableRow, column_of, read_csv
from fingerpad.core.units import MN_PER_N, MS_PER_S
from fingerpad.core.values import (
    Check,
    Count,
    Finite,
    FloatArray,
    NotNegative,
    Positive,
    finite,
    numbers,
    positive,
)
from fingerpad.data import protocol
from fingerpad.geometry.courses import SAME_VALUE, check_speed, extent_of
from fingerpad.geometry.motion import POSE_COLUMNS, TOLERANCE, Cycles, Trajectory

SAMPLES_PER_CYCLE = 20  # Of a sine; a line between two of them misses it by up to 1.2 % of the amplitude.


def _corners(name: str, value: Any) -> tuple[float, ...]:
    """Return one number or several as a tuple."""
    return numbers(name, value) if np.ndim(value) else (finite(name, value),)


Corners = Annotated[
    float | Sequence[float], Check(_corners, {"type": ["number", "array"], "items": {"type": "number"}})
]


@checked
def sine(
    depth_mm: Positive | None = None,
    amplitude_mm: Positive | None = None,
    frequency_hz: Positive | None = None,
    cycles: Count | None = None,
    ramp_ms: Positive = protocol.RAMP.value,
    hold_ms: NotNegative = protocol.HOLD.value,
    *,
    force_mn: Positive | None = None,
    amplitude_mn: Positive | None = None,
) -> Trajectory:
    """Press to a depth or a force, hold it, then vibrate about it: phases "ramp", "hold" and "vibration".

    A cycle has 20 samples. A press solves some of more than 10 cycles and interpolates the others within a
    tolerance (`PressSettings.cycle_tolerance`).

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

    Examples
    --------
    >>> motion = sine(0.8, 0.1, 20.0, cycles=2, hold_ms=100.0)
    >>> round(motion.largest, 6), motion.end_ms
    (0.9, 250.0)
    >>> sine(force_mn=100.0, amplitude_mn=20.0, frequency_hz=20.0, cycles=2).by_force
    True
    """
    frequency, count = _given("sine", frequency_hz=frequency_hz, cycles=cycles)
    amplitude = _amplitude(
        depth_mm=depth_mm, amplitude_mm=amplitude_mm, force_mn=force_mn, amplitude_mn=amplitude_mn
    )
    period_ms = MS_PER_S / frequency
    turns = np.arange(1, SAMPLES_PER_CYCLE * count + 1) / SAMPLES_PER_CYCLE
    wave = amplitude * np.sin(2.0 * np.pi * turns)
    motion = _on_a_hold(depth_mm, force_mn, ramp_ms, hold_ms, period_ms * turns, ("vibration", 1), wave)
    return replace(motion, cycles=Cycles(ramp_ms + hold_ms, period_ms, count))


@checked
def chirp(
    depth_mm: Positive | None = None,
    amplitude_mm: Positive | None = None,
    frequencies_hz: Sequence[float] | None = None,
    sweep_ms: Positive | None = None,
    ramp_ms: Positive = protocol.RAMP.value,
    hold_ms: NotNegative = protocol.HOLD.value,
    *,
    force_mn: Positive | None = None,
    amplitude_mn: Positive | None = None,
) -> Trajectory:
    """Press to a depth or a force, hold it, then vibrate with a frequency that changes at a constant rate.

    A cycle has 20 samples; the phases are "ramp", "hold" and "sweep".

    Parameters
    ----------
    depth_mm, amplitude_mm, ramp_ms, hold_ms, force_mn, amplitude_mn : float, optional
        As of `sine`. [mm], [ms], [mN]
    frequencies_hz : (float, float)
        First and last frequency, upwards or downwards. [Hz]
    sweep_ms : float
        Duration of the sweep; it ends at the last whole cycle. [ms]

    Examples
    --------
    >>> motion = chirp(0.8, 0.05, (5.0, 50.0), sweep_ms=1000.0, ramp_ms=50.0, hold_ms=450.0)
    >>> len(motion.times_ms), round(motion.end_ms, 1)
    (543, 1490.0)
    """
    pair, duration_ms = _given("chirp", frequencies_hz=frequencies_hz, sweep_ms=sweep_ms)
    amplitude = _amplitude(
        depth_mm=depth_mm, amplitude_mm=amplitude_mm, force_mn=force_mn, amplitude_mn=amplitude_mn
    )
    if len(pair) != 2:
        raise InputError("frequencies_hz", "must be a pair, first and last", str(len(pair)))
    first, last = (positive("frequencies_hz", each, "Hz") for each in pair)
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
    wave = amplitude * np.sin(2.0 * np.pi * turns)
    return _on_a_hold(depth_mm, force_mn, ramp_ms, hold_ms, times_ms, ("sweep", 1), wave)


@checked
def repeated(
    depth_mm: Positive | None = None,
    touches: Count = 2,
    ramp_ms: Positive = protocol.RAMP.value,
    hold_ms: Positive = protocol.HOLD.value,
    pause_ms: Positive = protocol.HOLD.value,
    *,
    force_mn: Positive | None = None,
) -> Trajectory:
    """Press several times to the same depth or force, with pauses at first touch or without force.

    The phases are "ramp", "hold", "release", "pause", "ramp 2" and so on.

    Parameters
    ----------
    depth_mm : float, optional
        Depth of each hold. [mm]
    touches : int, optional
        How often.
    ramp_ms, hold_ms, pause_ms : float, optional
        Durations of a ramp (in and out), of a hold and of a pause. [ms]
    force_mn : float, optional
        Instead of a depth, force of each hold on the whole finger. [mN]

    Examples
    --------
    >>> repeated(1.0, 2, ramp_ms=50.0, hold_ms=200.0, pause_ms=300.0).end_ms
    1200.0
    """
    times_ms = (0.0, *np.cumsum(touches * [ramp_ms, hold_ms, ramp_ms, pause_ms]).tolist())
    return Trajectory(
        times_ms, **_column(depth_mm, force_mn, lambda level: (0.0, *touches * (level, level, 0.0, 0.0)))
    )


@checked
def staircase(
    depths_mm: Sequence[float] | None = None,
    forces_mn: Sequence[float] | None = None,
    *,
    ramp_ms: Positive = protocol.RAMP.value,
    hold_ms: Positive = protocol.HOLD.value,
) -> Trajectory:
    """Press to several depths or forces, one after the other, and hold each.

    The phases are "ramp", "hold", "ramp 2", "hold 2" and so on, or "release" for a step down.

    Parameters
    ----------
    depths_mm : sequence of float, optional
        Depths of the steps, upwards or downwards; 0 is first touch. [mm]
    forces_mn : sequence of float, optional
        Instead of depths, forces on the whole finger. [mN]
    ramp_ms, hold_ms : float, optional
        Durations of each ramp and of each hold. [ms]

    Examples
    --------
    >>> steps = staircase(depths_mm=[0.5, 1.0, 0.2], ramp_ms=50.0, hold_ms=300.0)
    >>> [phase.name for phase in steps.phases]
    ['ramp', 'hold', 'ramp 2', 'hold 2', 'release', 'hold 3']
    """
    count = len(depths_mm or forces_mn or ())
    times_ms = (0.0, *np.cumsum(count * [ramp_ms, hold_ms]).tolist())
    return Trajectory(
        times_ms, **_column(depths_mm, forces_mn, lambda levels: (0.0, *np.repeat(levels, 2).tolist()))
    )


@checked
def stroke(
    depth_mm: Finite | None = None,
    force_mn: Finite | None = None,
    *,
    speed_mm_per_s: Positive | None = None,
    speed_deg_per_s: Positive | None = None,
    x_mm: Corners = 0.0,
    z_mm: Corners = 0.0,
    tilt_deg: Corners = 0.0,
    spin_deg: Corners = 0.0,
    strokes: Count = 1,
    ramp_ms: Positive = protocol.RAMP.value,
    hold_ms: NotNegative = protocol.HOLD.value,
) -> Trajectory:
    """Press, hold, then slide or turn at a constant speed, straight or along corners, to and fro.

    The phases are "ramp", "hold", "stroke", "stroke 2" and so on.

    Parameters
    ----------
    depth_mm : float, optional
        Depth of the hold and of the strokes. [mm]
    force_mn : float, optional
        Instead of a depth, force on the whole finger. [mN]
    speed_mm_per_s : float, optional
        Speed along the skin. [mm/s]
    speed_deg_per_s : float, optional
        Instead, speed of the rotation. [degrees/s]
    x_mm, z_mm : float or sequence of float, optional
        Where a stroke goes along the finger, distal positive, and across it: its end, or the corners of its
        path after the start at 0. [mm]
    tilt_deg, spin_deg : float or sequence of float, optional
        How far the object tilts along the finger and turns about the normal of the skin, as of `Touch`, there
        or at the same corners. What has the speed is not 0 throughout. [degrees]
    strokes : int, optional
        How often it goes there or back.
    ramp_ms, hold_ms : float, optional
        Durations of the ramp and of the hold before the first stroke; the hold may be 0. [ms]

    Examples
    --------
    >>> there_and_back = stroke(0.5, speed_mm_per_s=20.0, x_mm=5.0, strokes=2, hold_ms=200.0)
    >>> there_and_back.times_ms, there_and_back.x_mm
    ((0.0, 50.0, 250.0, 500.0, 750.0), (0.0, 0.0, 0.0, 5.0, 0.0))
    >>> square = stroke(force_mn=200, speed_mm_per_s=20.0, x_mm=[1, 1, 0, 0], z_mm=[0, 1, 1, 0])
    >>> square.end_ms, square.z_mm
    (1200.0, (0.0, 0.0, 0.0, 0.0, 1.0, 1.0, 0.0))
    >>> stroke(force_mn=200.0, speed_deg_per_s=60.0, spin_deg=30.0, hold_ms=150.0).times_ms
    (0.0, 50.0, 200.0, 700.0)
    """
    if (speed_mm_per_s is None) == (speed_deg_per_s is None):
        raise InputError("A stroke needs either speed_mm_per_s or speed_deg_per_s: give one of them.")
    corners = [np.atleast_1d(each) for each in (x_mm, z_mm, tilt_deg, spin_deg)]
    number = max(each.size for each in corners)
    corners = [each if each.any() else np.zeros(number) for each in corners]
    if any(each.size != number for each in corners):
        raise InputError(f"{', '.join(POSE_COLUMNS)} of a stroke must have as many corners, or be 0.")
    path = np.array([(0.0, *each) for each in corners])
    names, way = ("x_mm or z_mm", path[:2]) if speed_mm_per_s else ("tilt_deg or spin_deg", path[2:])
    lengths = np.cumsum(np.hypot(*np.diff(way)))
    if not (np.diff(lengths, prepend=0.0) > 0.0).all():
        raise InputError(f"A stroke needs a way: {names} must not be 0, and change from corner to corner.")
    shares = np.append(0.0, lengths / lengths[-1])
    both = (shares[1:], path[:, 1:]), (1.0 - shares[-2::-1], path[:, -2::-1])
    since_ms = np.concatenate([turn + both[turn % 2][0] for turn in range(strokes)])
    since_ms *= MS_PER_S * lengths[-1] / (speed_mm_per_s or speed_deg_per_s)
    columns = np.hstack([both[turn % 2][1] for turn in range(strokes)])
    ways = {
        name: tuple(column.tolist())
        for name, column in zip(POSE_COLUMNS, columns, strict=True)
        if column.any()
    }
    return _on_a_hold(depth_mm, force_mn, ramp_ms, hold_ms, since_ms, ("stroke", strokes), **ways)


def _column(depth: Any, force: Any, course: Callable[[Any], tuple[float, ...]]) -> dict[str, Any]:
    """Return the column of depth or of force, made from what is given of the two."""
    given = {"depth_mm": depth, "force_mn": force}
    return {name: course(level) for name, level in given.items() if level is not None}


def _given(name: str, **needed: Any) -> list[Any]:
    """Return parameters that have a default only for the order of the others, if all of them are given."""
    missing = [parameter for parameter, value in needed.items() if value is None]
    if missing:
        those = "they are" if len(missing) > 1 else "it is"
        raise InputError(name, f"needs {', '.join(missing)}", remedy=f"{those} not given")
    return list(needed.values())


def _amplitude(**levels: float | None) -> float:
    """Return the amplitude of a vibration in depth or in force, which has a level, too."""
    given = {name: value for name, value in levels.items() if value is not None}
    if tuple(given) not in (("depth_mm", "amplitude_mm"), ("force_mn", "amplitude_mn")):
        raise InputError(
            "A vibration needs either depth_mm and amplitude_mm or force_mn and amplitude_mn: got "
            f"{', '.join(given) or 'none of them'}."
        )
    level, (name, amplitude) = given.get("force_mn", np.inf), list(given.items())[1]
    if amplitude > level:
        raise InputError(name, f"must be at most force_mn, {level:g} mN", f"{amplitude:g}")
    return amplitude


def _on_a_hold(
    depth_mm: float | None,
    force_mn: float | None,
    ramp_ms: float,
    hold_ms: float,
    since_ms: FloatArray,
    parts: tuple[str, int],
    change: ArrayLike = 0.0,
    **columns: tuple[float, ...],
) -> Trajectory:
    """Make a ramp and hold, then so many equal parts with samples at `since_ms`, a change and columns."""
    # A hold of 0 ms is left out. Depth or force changes from the hold; places and rotations are 0 before.
    before_ms = (0.0, ramp_ms, ramp_ms + hold_ms)[: 3 if hold_ms > 0.0 else 2]
    still = len(before_ms)
    times_ms = (*before_ms, *(before_ms[-1] + since_ms).tolist())
    then = np.broadcast_to(change, since_ms.shape)
    ways: dict[str, Any] = {name: (0.0,) * still + way for name, way in columns.items()}
    name, count = parts
    names = (*(RAMP, HOLD)[: still - 1], name, *(f"{name} {number}" for number in range(2, count + 1)))
    ends_ms = (*before_ms, *times_ms[still - 1 + since_ms.size // count :: since_ms.size // count])
    return Trajectory(
        times_ms,
        **_column(depth_mm, force_mn, lambda level: (0.0, *[level] * (still - 1), *(level + then).tolist())),
        **ways,
        phases=tuple(Phase(name, *ends) for name, ends in zip(names, pairwise(ends_ms), strict=True)),
    )


OTHER_UNITS = {
    "time_s": ("time_ms", MS_PER_S),
    "depth_um": ("depth_mm", 1e-3),
    "force_n": ("force_mn", MN_PER_N),
}  # Columns of a file in another unit than a motion has, and the factor to its unit.

COLUMNS = ("time_ms", "depth_mm", "force_mn", *POSE_COLUMNS, *OTHER_UNITS)

GAP = 5.0  # Longest step in time of a recording at a fixed rate, over the median: a few samples may be lost.


@checked
def read_trajectory(
    path: Path | str, *, first_touch_mm: Finite = 0.0, phases: Sequence[Phase] = ()
) -> Trajectory:
    r"""Read a motion from a CSV file, with all samples; `Trajectory.reduced` leaves some out.

    Before contact a recording has noise: a first depth or force of up to 2 % of the largest is taken as 0,
    and so is a force as far below 0.

    Parameters
    ----------
    path : Path or str
        Comments begin with #, then a header with columns among `COLUMNS`: a time, a depth or a force, and the
        place and the rotation of the indenter if it moves aside or turns. One row per sample. Times, places
        and rotations are counted from the first row.
    first_touch_mm : float, optional
        Reading of the depth at first touch, which is subtracted. [mm]
    phases : sequence of Phase, optional
        As of `Trajectory`.

    Examples
    --------
    >>> from tempfile import TemporaryDirectory
    >>> with TemporaryDirectory() as folder:
    ...     path = Path(folder) / "press.csv"
    ...     _ = path.write_text("time_s,depth_um\n12.0,0\n12.05,800\n12.5,800\n", encoding="utf-8")
    ...     motion = read_trajectory(path)
    >>> [round(time, 6) for time in motion.times_ms], motion.depth_mm
    ([0.0, 50.0, 500.0], (0.0, 0.8, 0.8))
    """
    rows = read_csv(path_of("path", path), COLUMNS)
    columns = _columns(rows, str(path))
    times_ms = columns.pop("time_ms")
    _check_times(times_ms, rows)
    for name, values in columns.items():
        if name.endswith("_mm"):
            check_speed(name, times_ms, values, lambda row: f"{rows[row].place}: ")
        since = {"depth_mm": first_touch_mm, "force_mn": 0.0}.get(name, values[0])
        columns[name] = _without_noise(values - since, name) if name not in POSE_COLUMNS else values - since
    samples: dict[str, Any] = {name: tuple(values.tolist()) for name, values in columns.items()}
    try:
        return Trajectory(tuple((times_ms - times_ms[0]).tolist()), **samples, phases=tuple(phases))
    except InputError as error:
        raise InputError(f"{path}: {error}") from error


def recorded(file: Path, first_touch_mm: float = 0.0, tolerance: float = TOLERANCE) -> Trajectory:
    """Read a motion from a CSV file (docs/motions.md), with as many samples as it needs.

    Parameters
    ----------
    file : Path
        The file; columns name what they hold and its unit.
    first_touch_mm : float, optional
        Reading of the depth at first touch. [mm]
    tolerance : float, optional
        Samples this close to a line, relative to the extent of the motion, are left out; 0 keeps all.
    """
    motion = read_trajectory(file, first_touch_mm=first_touch_mm)
    return motion.reduced(tolerance) if tolerance else motion


def _columns(rows: Sequence[TableRow], path: str) -> dict[str, FloatArray]:
    """Columns by their names in the units of a motion."""
    columns: dict[str, FloatArray] = {}
    for given in rows[0].entries:
        name, factor = OTHER_UNITS.get(given, (given, 1.0))
        if name in columns:
            raise InputError(
                path, f"must have one column for {name}", remedy=f"{given} is another one, leave it out"
            )
        columns[name] = factor * column_of(rows, given)
    if "time_ms" not in columns:
        raise InputError(
            path, "must have the column time_ms or time_s", remedy=f"it has {', '.join(rows[0].entries)}"
        )
    return columns


def _check_times(times_ms: FloatArray, rows: Sequence[TableRow]) -> None:
    """Check that times increase, and that a recording at a fixed rate has no gap."""
    if len(rows) < 2:
        raise InputError(f"{rows[0].place}: a motion must have at least two rows: got one.")
    steps = np.diff(times_ms)
    if not (steps > 0.0).all():
        last = int((steps <= 0.0).argmax())
        raise InputError(
            f"{rows[last + 1].place}: the time must increase: got {times_ms[last + 1]:.10g} ms after "
            f"{times_ms[last]:.10g} ms."
        )
    usual = float(np.median(steps))
    regular = np.isclose(steps, usual, rtol=0.01, atol=0.0).mean() >= 0.9  # recorded, not written by hand
    if regular and steps.max() > GAP * usual:
        last = int(steps.argmax())
        raise InputError(
            f"{rows[last + 1].place}: the recording must not have a gap, here of {steps[last]:.4g} ms with "
            f"{usual:.4g} ms between other rows: fill it, or read its parts one by one."
        )


def _without_noise(values: FloatArray, name: str) -> FloatArray:
    """Take noise before contact as 0: of the first value, and below 0 of a force, which is never negative."""
    noise = SAME_VALUE * values.max()
    values = np.where((name == "force_mn") & (values < 0.0) & (values >= -noise), 0.0, values)
    if 0.0 < values[0] <= noise:
        values[0] = 0.0
    return values


Course = Callable[[float], float]  # From the time [ms] to a depth, a force, a way or a rotation.


@checked
def sampled(
    end_ms: Positive,
    depth_mm: Course | None = None,
    force_mn: Course | None = None,
    *,
    x_mm: Course | None = None,
    z_mm: Course | None = None,
    tilt_deg: Course | None = None,
    spin_deg: Course | None = None,
    tolerance: Positive = TOLERANCE,
    looks: Count = 512,
    phases: Sequence[Phase] = (),
) -> Trajectory:
    """Make a trajectory from functions of time, linear between as few times as an error bound allows.

    The function is divided where it deviates most from a line: a corner becomes a sample.

    Parameters
    ----------
    end_ms : float
        Duration. [ms]
    depth_mm, force_mn, x_mm, z_mm, tilt_deg, spin_deg : callable, optional
        From the time [ms] to what `Trajectory` calls so; continuous.
    tolerance : float, optional
        Largest error over the largest depth or force and over the extent of each way and rotation, at 33
        times in each linear piece. [1]
    looks : int, optional
        Number of equal parts into which it is looked first: what lasts less than one may be missed.
    phases : sequence of Phase, optional
        As of `Trajectory`.

    Examples
    --------
    >>> motion = sampled(1000.0, lambda t: min(t / 80.0, 1.0))
    >>> [round(time, 3) for time in motion.times_ms]
    [0.0, 80.0, 1000.0]
    """
    functions = (depth_mm, force_mn, x_mm, z_mm, tilt_deg, spin_deg)
    given = zip(("depth_mm", "force_mn", *POSE_COLUMNS), functions, strict=True)
    courses = {name: course for name, course in given if course is not None}
    if not courses:
        raise InputError("A trajectory needs either depth_mm or force_mn: give one of them.")

    def at(time: float) -> list[float]:
        return [finite(f"{name} at {time:g} ms", course(time)) for name, course in courses.items()]

    def values_at(times: FloatArray) -> FloatArray:
        return np.array([at(time) for time in times.tolist()])

    scale = extent_of(values_at(np.linspace(0.0, end_ms, looks + 1)), tuple(courses))

    def deviation(times: FloatArray, start: float, stop: float) -> FloatArray:
        """Largest deviation of any column from its chord between two times, over its extent."""
        first, last = values_at(np.array([start, stop]))
        share = ((times - start) / (stop - start))[:, None]
        return (np.abs(values_at(times) - first - share * (last - first)) / scale).max(axis=1)

    kept, waiting = [0.0, end_ms], [(0.0, end_ms)]
    while waiting:
        start, stop = waiting.pop()
        parts = max(32, int(np.ceil(looks * (stop - start) / end_ms)))
        times = np.linspace(start, stop, parts + 1)
        found = deviation(times, start, stop)
        worst = int(found.argmax())
        if found[worst] <= tolerance:
            continue
        if stop - start < SHORTEST_SHARE * end_ms:
            raise InputError(f"A motion must not jump: it does at {start:g} ms; give the jump a duration.")
        refined = minimize_scalar(
            lambda time, a, b: -deviation(np.array([time]), a, b)[0],
            bounds=(float(times[max(worst - 1, 0)]), float(times[min(worst + 1, parts)])),
            args=(start, stop),
            method="bounded",
            options={"xatol": SHORTEST_SHARE * (stop - start)},
        )
        middle = float(refined.x) if -refined.fun >= found[worst] else float(times[worst])
        kept.append(middle)
        waiting += [(start, middle), (middle, stop)]
    times = np.array(sorted(kept))
    columns = dict(zip(courses, values_at(times).T, strict=True))
    return Trajectory(tuple(times), **columns, phases=tuple(phases))


SHORTEST_SHARE = 1e-9  # Duration of a piece over that of all, below which a function jumps.
