"""Trajectories from functions of time, and from recordings with fewer samples."""

from __future__ import annotations

from collections.abc import Callable, Sequence
from dataclasses import replace
from typing import Any

import numpy as np
from scipy.optimize import minimize_scalar

from fingerpad.core.checks import FloatArray, finite, instance, positive, whole
from fingerpad.core.errors import InputError, shown
from fingerpad.core.keywords import known_keywords
from fingerpad.core.phases import Phase
from fingerpad.geometry.trajectory import POSE_COLUMNS, Trajectory, samples_of_line

Course = Callable[[float], float]
"""From the time [ms] to a depth, a force, a way or a rotation."""

TOLERANCE = 0.005
"""Largest error of a trajectory with fewer samples, over the extent of each of its columns."""

LOOKS, LOOKS_PER_PIECE = 512, 32
"""Into how many equal parts a function and each of its linear pieces are divided to look at it."""

SHORTEST_SHARE = 1e-9
"""Duration of a piece over that of the whole motion, below which the function jumps."""


@known_keywords
def sampled(
    end_ms: float,
    depth_mm: Course | None = None,
    force_mn: Course | None = None,
    *,
    x_mm: Course | None = None,
    z_mm: Course | None = None,
    tilt_deg: Course | None = None,
    spin_deg: Course | None = None,
    tolerance: float = TOLERANCE,
    looks: int = LOOKS,
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
        Number of equal parts of the whole into which it is looked first: what lasts less than such a part
        may be missed.
    phases : sequence of Phase, optional
        As of `Trajectory`.

    Examples
    --------
    >>> motion = sampled(1000.0, lambda t: min(t / 80.0, 1.0))
    >>> [round(time, 3) for time in motion.times_ms]
    [0.0, 80.0, 1000.0]
    """
    end = positive("end_ms", end_ms, "ms")
    positive("tolerance", tolerance)
    whole("looks", looks, at_least=1)
    given = (("depth_mm", depth_mm), ("force_mn", force_mn), ("x_mm", x_mm), ("z_mm", z_mm),
             ("tilt_deg", tilt_deg), ("spin_deg", spin_deg))  # fmt: skip
    courses = {name: course for name, course in given if course is not None}
    for name, course in courses.items():
        if not callable(course):
            raise InputError(f"{name} must be a function of the time [ms]: got {shown(course)}.")
    if not courses:
        raise InputError("A trajectory needs either depth_mm or force_mn: give one of them.")

    def values_at(times: FloatArray) -> FloatArray:
        return np.array(
            [
                [finite(f"{name} at {time:g} ms", course(float(time))) for name, course in courses.items()]
                for time in times
            ]
        )

    scale = _extent(values_at(np.linspace(0.0, end, looks + 1)), tuple(courses))

    def deviation(times: FloatArray, start: float, stop: float) -> FloatArray:
        """Largest deviation of any column from its chord between two times, over its extent."""
        first, last = values_at(np.array([start, stop]))
        share = ((times - start) / (stop - start))[:, None]
        return (np.abs(values_at(times) - first - share * (last - first)) / scale).max(axis=1)

    kept, waiting = [0.0, end], [(0.0, end)]
    while waiting:
        start, stop = waiting.pop()
        parts = max(LOOKS_PER_PIECE, int(np.ceil(looks * (stop - start) / end)))
        times = np.linspace(start, stop, parts + 1)
        found = deviation(times, start, stop)
        worst = int(found.argmax())
        if found[worst] <= tolerance:
            continue
        if stop - start < SHORTEST_SHARE * end:
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


@known_keywords
def reduced(motion: Trajectory, tolerance: float = TOLERANCE) -> Trajectory:
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
    positive("tolerance", tolerance)
    instance("motion", motion, Trajectory)
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
