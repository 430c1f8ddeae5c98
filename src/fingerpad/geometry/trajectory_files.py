"""Trajectories from CSV files: recorded or written motions, with units in the names of the columns."""

from __future__ import annotations

from collections.abc import Sequence
from pathlib import Path
from typing import Any

import numpy as np

from fingerpad.core.checks import FloatArray, finite
from fingerpad.core.errors import InputError
from fingerpad.core.files import path_of
from fingerpad.core.keywords import known_keywords
from fingerpad.core.phases import Phase
from fingerpad.core.tables import TableRow, column_of, read_csv
from fingerpad.core.units import MN_PER_N, MS_PER_S
from fingerpad.geometry.sampled_motions import TOLERANCE, reduced
from fingerpad.geometry.trajectory import SAME_VALUE, Trajectory, check_speed

MM_PER_UM = 1e-3

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


@known_keywords
def read_trajectory(
    path: Path | str, *, first_touch_mm: float = 0.0, phases: Sequence[Phase] = ()
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
        return Trajectory(
            **samples,
            times_ms=tuple((times_ms - times_ms[0]).tolist()),
            phases=tuple(phases),
        )
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
                f"{path} must have one column for {name}: {column} is another one, leave it out."
            )
        columns[name] = factor * column_of(rows, column)
    if "times_ms" not in columns:
        raise InputError(
            f"{path} must have the column time_ms or time_s: it has {', '.join(rows[0].entries)}."
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
