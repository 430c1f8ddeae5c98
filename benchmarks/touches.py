"""Growth of a sweep with the number of touches that are pressed: time, memory and disk.

Touches that are done are kept in `benchmarks/.touches` with the time they took: a run that was interrupted
goes on. `FINGERPAD_TOUCHES="10 100"` presses fewer.
"""

from __future__ import annotations

import json
import os
import time
from collections.abc import Callable, Iterator
from contextlib import contextmanager
from pathlib import Path

import numpy as np
import psutil

import fingerpad as fp
from benchmarks.results import Report, Table
from fingerpad.core.threads import available_threads

FOLDER = Path(__file__).parent / ".touches"
SIZES = (10, 100, 500)
TOUCH = {"object": "cylinder", "motion": {"ramp_ms": 50, "hold_ms": 60}}
DEPTHS_MM = (0.2, 0.6)


def measure() -> Report:
    """Press sweeps of growing size, each into a store of its own."""
    asked = os.environ.get("FINGERPAD_TOUCHES", "").split()
    sizes = [int(size) for size in asked] or list(SIZES)
    rows = [_pressed(FOLDER / str(size), size) for size in sizes]
    return Report(
        name="touches",
        title="Touches of a sweep",
        about="A cylinder at quick resolution, 110 ms, at depths of 0.2 to 0.6 mm, one process per core with "
        "one thread each. Memory is that of all processes.",
        tables=[
            Table(
                "Touches that are pressed, by their number.",
                [
                    "touches",
                    "time, s",
                    "s per touch",
                    "memory after a tenth, MB",
                    "memory at the end, MB",
                    "store, MB per touch",
                    "data set, kB per touch",
                ],
                rows,
            )
        ],
        measured={"touches_memory_growth": rows[-1][4] / rows[-1][3]},
        notes=["Processes start and load their kernels once per row."],
    )


def _pressed(folder: Path, count: int) -> list[float]:
    """Press so many touches, or those that are left; a row of the table."""
    folder.mkdir(parents=True, exist_ok=True)
    depths = np.linspace(*DEPTHS_MM, count).tolist()
    clock = Clock(folder / "clock.json", count)
    sweep = {"touch": TOUCH, "grid": {"motion.depth_mm": depths}}
    run = fp.sweep(sweep, out=folder / "study.zarr", jobs=available_threads(), progress=clock)
    assert run.done == count
    after = {int(done): memory_mb for done, memory_mb in clock.memory_mb.items()}
    early = min(after, key=lambda done: abs(done - 0.1 * count))
    return [
        count, clock.wall_s, clock.wall_s / count, after[early], after[max(after)],
        _size(folder / "indentations") / 1e6 / count, _size(folder / "study.zarr") / 1e3 / count,
    ]  # fmt: skip


class Clock:
    """Progress that adds up the time of all runs, and notes the memory, in a file."""

    def __init__(self, path: Path, count: int):
        self._path, self._count = path, count
        known = json.loads(path.read_text()) if path.exists() else {}
        self.wall_s: float = known.get("wall_s", 0.0)
        self.memory_mb: dict[str, float] = known.get("memory_mb", {})

    @contextmanager
    def stage(self, name: str, total: int) -> Iterator[Callable[[], None]]:
        """Time a stage."""
        before, began, done = self.wall_s, time.perf_counter(), self._count - total

        def advance() -> None:
            nonlocal done
            done += 1
            self.wall_s = before + time.perf_counter() - began
            if done % max(1, self._count // 20) == 0:
                self.memory_mb[str(done)] = _memory_mb()
                self._path.write_text(json.dumps({"wall_s": self.wall_s, "memory_mb": self.memory_mb}))

        yield advance


def _memory_mb() -> float:
    this = psutil.Process()
    return sum(process.memory_info().rss for process in (this, *this.children(recursive=True))) / 1e6


def _size(folder: Path) -> int:
    return sum(path.stat().st_size for path in folder.rglob("*") if path.is_file())
