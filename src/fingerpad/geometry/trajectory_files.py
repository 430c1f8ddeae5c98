"""Trajectories from functions of time, and from CSV files with units in the names of the columns."""

from __future__ import annotations

from collections.abc import Callable, Sequence
from dataclasses import replace
from pathlib import Path
from typing import Any

import numpy as np
from scipy.optimize import minimize_scalar

from fingerpad.core.checked import checked
from fingerpad.core.errors import InputError, shown
from fingerpad.core.files import path_of
from fingerpad.core.phases import Phase
from fingerpad.core.tables import TableRow, column_of, read_csv
from fingerpad.core.units import MN_PER_N, MS_PER_S
from fingerpad.core.values import Count, Finite, FloatArray, Positive, finite
from fingerpad.geometry.trajectory import POSE_COLUMNS, SAME_VALUE, Trajectory, check_speed, samples_of_line

MM_PER_UM = 1e-3

TOLERANCE = 0.005  # Largest error of a trajectory with fewer samples, over the extent of each of its columns.

COLUMNS = {
    "time_ms": ("times_ms", 1.0),
    "time_s": ("times_ms", MS_PER_S),
    "depth_mm": ("depth_mm", 1.0),
    "depth_um": ("depth_mm", MM_PER_UM),
    "force_mn": ("force_mn", 1.0),
    "force_n": ("force_mn", MN_PER_N),
    "x_mm": ("x_mm", 1.0),
    "z_mm": ("z_mm", 1.0),
    "tilt_deg": ("tilt_deg", 1.0),
    "spin_deg": ("spin_deg", 1.0),
}
"""Columns of a file, what of a `Trajectory` each is, and the factor to its unit."""

GAP, SAME_STEP, REGULAR_SHARE = 5.0, 0.01, 0.9
"""A step in time longer than this many times the median is a gap, if at least this share of the steps equals
the median within 1 %: the file is a recording at a fixed rate. A line replaces a few lost samples."""


@checked
def read_trajectory(
    path: Path | str, *, first_touch_mm: Finite = 0.0, phases: Sequence[Phase] = ()
) -> Trajectory:
    r"""Read a motion from a CSV file.

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

    Returns
    -------
    Trajectory
        All samples; `reduced` leaves out those that are not needed. Before contact a recording has noise: a
        first depth or force of up to 2 % of the largest is taken as 0, and so is a force as far below 0.

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
    rows = read_csv(path_of("path", path), tuple(COLUMNS))
    columns = _columns(rows, str(path))
    times_ms = columns.pop("times_ms")
    _check_times(times_ms, rows)
    for name, values in columns.items():
        if name.endswith("_mm"):
            check_speed(name, times_ms, values, lambda row: f"{rows[row].place}: ")
        if name == "depth_mm":
            columns[name] = _without_noise(values - finite("first_touch_mm", first_touch_mm, "mm"), False)
        else:
            columns[name] = _without_noise(values, True) if name == "force_mn" else values - values[0]
    samples: dict[str, Any] = {name: tuple(values.tolist()) for name, values in columns.items()}
    try:
        return Trajectory(**samples, times_ms=tuple((times_ms - times_ms[0]).tolist()), phases=tuple(phases))
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
    return reduced(motion, tolerance) if tolerance else motion


def _columns(rows: Sequence[TableRow], path: str) -> dict[str, FloatArray]:
    """Columns by their names in a trajectory and in its units."""
    columns: dict[str, FloatArray] = {}
    for column in rows[0].entries:
        name, factor = COLUMNS[column]
        if name in columns:
            raise InputError(
                path, f"must have one column for {name}", remedy=f"{column} is another one, leave it out"
            )
        columns[name] = factor * column_of(rows, column)
    if "times_ms" not in columns:
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
    regular = np.mean(np.abs(steps - usual) <= SAME_STEP * usual) >= REGULAR_SHARE
    if regular and steps.max() > GAP * usual:
        last = int(steps.argmax())
        raise InputError(
            f"{rows[last + 1].place}: the recording must not have a gap, here of {steps[last]:.4g} ms with "
            f"{usual:.4g} ms between other rows: fill it, or read its parts one by one."
        )


def _without_noise(values: FloatArray, never_negative: bool) -> FloatArray:
    """Take noise before contact as 0: of the first value, and below 0 of values that are never negative."""
    noise = SAME_VALUE * values.max()
    values = np.where(never_negative & (values < 0.0) & (values >= -noise), 0.0, values)
    if 0.0 < values[0] <= noise:
        values[0] = 0.0
    return values


Course = Callable[[float], float]  # From the time [ms] to a depth, a force, a way or a rotation.

LOOKS, LOOKS_PER_PIECE = 512, 32
"""Into how many equal parts a function and each of its linear pieces are divided to look at it."""

SHORTEST_SHARE = 1e-9  # Duration of a piece over that of the whole motion, below which the function jumps.


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
    looks: Count = LOOKS,
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
    given = (("depth_mm", depth_mm), ("force_mn", force_mn), ("x_mm", x_mm), ("z_mm", z_mm),
             ("tilt_deg", tilt_deg), ("spin_deg", spin_deg))  # fmt: skip
    courses = {name: course for name, course in given if course is not None}
    for name, course in courses.items():
        if not callable(course):
            raise InputError(name, "must be a function of the time [ms]", shown(course))
    if not courses:
        raise InputError("A trajectory needs either depth_mm or force_mn: give one of them.")

    def values_at(times: FloatArray) -> FloatArray:
        return np.array(
            [
                [finite(f"{name} at {time:g} ms", course(float(time))) for name, course in courses.items()]
                for time in times
            ]
        )

    scale = _extent(values_at(np.linspace(0.0, end_ms, looks + 1)), tuple(courses))

    def deviation(times: FloatArray, start: float, stop: float) -> FloatArray:
        """Largest deviation of any column from its chord between two times, over its extent."""
        first, last = values_at(np.array([start, stop]))
        share = ((times - start) / (stop - start))[:, None]
        return (np.abs(values_at(times) - first - share * (last - first)) / scale).max(axis=1)

    kept, waiting = [0.0, end_ms], [(0.0, end_ms)]
    while waiting:
        start, stop = waiting.pop()
        parts = max(LOOKS_PER_PIECE, int(np.ceil(looks * (stop - start) / end_ms)))
        times = np.linspace(start, stop, parts + 1)
        found = deviation(times, start, stop)
        worst = int(found.argmax())
        if found[worst] <= tolerance:
            continue
        if stop - start < SHORTEST_SHARE * end_ms:
            raise InputError(f"A motion must not jump: it does at {start:g} ms; give the jump a duration.")
        nearby = float(times[max(worst - 1, 0)]), float(times[min(worst + 1, parts)])
        refined = minimize_scalar(
            lambda time, a, b: -deviation(np.array([time]), a, b)[0],
            bounds=nearby,
            args=(start, stop),
            method="bounded",
            options={"xatol": 1e-9 * (stop - start)},
        )
        middle = float(refined.x) if -refined.fun >= found[worst] else float(times[worst])
        kept.append(middle)
        waiting += [(start, middle), (middle, stop)]
    times = np.array(sorted(kept))
    columns = dict(zip(courses, values_at(times).T, strict=True))
    return Trajectory(tuple(times), **columns, phases=tuple(phases))


@checked
def reduced(motion: Trajectory, tolerance: Positive = TOLERANCE) -> Trajectory:
    """Leave out samples of a recording that lie close to a line between others; each is a step to solve at.

    Samples are kept where the course deviates most from a line (`samples_of_line`), so that corners stay
    samples. Choose a tolerance above the noise of the recording.

    Parameters
    ----------
    motion : Trajectory
        Such as a recording at 1 kHz.
    tolerance : float, optional
        Largest error over the largest depth or force, and over the extent of each way and rotation. [1]

    Returns
    -------
    Trajectory
        With some of the samples. Phases that were given stay; others are named again.

    Examples
    --------
    >>> times_ms = np.arange(1001.0)
    >>> recorded = Trajectory(times_ms, np.clip(times_ms / 50.0, 0.0, 1.0) + 0.001 * np.sin(times_ms))
    >>> reduced(recorded).times_ms
    (0.0, 50.0, 1000.0)
    """
    names = ["force_mn" if motion.by_force else "depth_mm"]
    names += [name for name in POSE_COLUMNS if getattr(motion, name) is not None]
    times, table = np.array(motion.times_ms), np.array([getattr(motion, name) for name in names]).T
    keep = samples_of_line(times, table / _extent(table, names), tolerance)
    columns: dict[str, Any] = {name: tuple(np.array(getattr(motion, name))[keep]) for name in names}
    phases = motion.phases if motion.named_phases else ()
    return replace(motion, times_ms=tuple(times[keep]), **columns, phases=phases, cycles=None)


def _extent(table: FloatArray, names: Sequence[str]) -> FloatArray:
    """Largest absolute value of each column, 1 for one that is 0 throughout; of a depth the deepest."""
    largest = np.abs(table).max(axis=0)
    deepest = table.max(axis=0)
    largest = np.where((np.array(names) == "depth_mm") & (deepest > 0.0), deepest, largest)
    return np.where(largest > 0.0, largest, 1.0)
