"""Where the time of a press goes: the functions that take most of it, at the everyday and paper's size."""

from __future__ import annotations

import cProfile
import pstats
from pathlib import PurePath
from typing import Any

from benchmarks.measuring import run_job
from benchmarks.pressing import touch_of_sphere
from benchmarks.results import Report, Table

THREADS = 2
SHOWN = 15
RESOLUTIONS = ("standard", "paper")


def profile(resolution: str) -> dict[str, Any]:
    """Profile `Touch.solve`, and list the functions with most time of their own.

    Compiled kernels are no functions to the profiler: their time is that of the Python function that calls
    them. So a short press comes first, lest loading them counts.
    """
    touch_of_sphere("quick").solve()
    touch = touch_of_sphere(resolution)
    recorded = cProfile.Profile()
    recorded.runcall(touch.solve)
    entries = pstats.Stats(recorded).stats  # type: ignore[attr-defined]
    whole = sum(own for _, _, own, _, _ in entries.values())
    rows = [
        [place(*where), calls, own, 100.0 * own / whole, inclusive]
        for where, (_, calls, own, inclusive, _) in entries.items()
    ]
    return {"whole_s": whole, "rows": sorted(rows, key=lambda row: -row[2])[:SHOWN]}


def place(file: str, line: int, function: str) -> str:
    """Name a function by its file without folders.

    Examples
    --------
    >>> place("/some/where/mechanics/press.py", 12, "step"), place("~", 0, "<built-in method numpy.zeros>")
    ('`press.py: step`', '`numpy.zeros`')
    """
    if file == "~":
        return f"`{function.removeprefix('<built-in method ').removeprefix('<method ').removesuffix('>')}`"
    return f"`{PurePath(file).name}: {function}`"


def measure(resolutions: tuple[str, ...] = RESOLUTIONS) -> Report:
    """Profile a press of each resolution in a process of its own."""
    tables = []
    for resolution in resolutions:
        found = run_job("profiles", "profile", THREADS, resolution=resolution).answer
        tables.append(
            Table(
                f"One sphere at `{resolution}` resolution, {found['whole_s']:.0f} s with the profiler:",
                ["function", "calls", "own, s", "own, %", "with callees, s"],
                found["rows"],
            )
        )
    return Report(
        name="profiles",
        title="Profile",
        about=(
            f"The {SHOWN} functions with the largest own time in an indentation, by cProfile, {THREADS} "
            "threads; kernels compiled and loaded."
        ),
        tables=tables,
        notes=["The time of compiled kernels is included in the function that calls them."],
    )
