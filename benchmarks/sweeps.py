"""What a sweep costs beside its presses: engine and data set, growth with settings, receptors, observers."""

from __future__ import annotations

import time
from pathlib import Path
from tempfile import TemporaryDirectory

import numpy as np

import fingerpad as fp
from benchmarks.results import Report, Table
from fingerpad.experiments.runner import peak_memory_mb
from fingerpad.export.sweep_results import observe_sweep
from fingerpad.skin.store import Store

TOUCH = {"object": "cylinder", "motion": {"depth_mm": 0.5, "ramp_ms": 50, "hold_ms": 300}}
PRESSES = 6
SIZES = (10, 100, 1000)
RECEPTORS = (400, 250)
STORED = 100
NOISES, CRITERIA = 250, 4


def measure() -> Report:
    """Press a few touches, then vary afferents and observers over the stored ones."""
    with TemporaryDirectory() as name:
        folder = Path(name)
        depths = np.linspace(0.3, 0.6, PRESSES).tolist()
        fp.sweep(touch=TOUCH, grid={"motion.depth_mm": depths[:1]}, out=folder / "first.zarr")  # compiles
        run = fp.sweep(touch=TOUCH, grid={"motion.depth_mm": depths}, out=folder / "presses.zarr")
        overhead = (run.wall_s - run.press_s) / run.press_s
        growth = [_growth(folder, count) for count in SIZES]
        receptors_s = _receptors(folder, depths)
        per_minute = _observers(folder)
        stored_mb = np.mean([path.stat().st_size for path in (folder / "indentations").iterdir()]) / 1e6
    return Report(
        name="sweeps",
        title="Sweeps",
        about="A cylinder at quick resolution, one process with all threads.",
        tables=[
            Table(
                f"{run.pressed} presses: {run.press_s:.1f} s of solving and storing in {run.wall_s:.1f} s: "
                f"engine and data set add {100 * overhead:.1f} %. A press has {stored_mb:.2f} MB. Then "
                "18 afferents vary over one stored press.",
                ["settings", "time, s", "ms per setting", "memory, MB", "kB per setting"],
                growth,
            ),
            Table(
                "Responses to stored presses.",
                ["what", "value"],
                [
                    [f"{np.prod(RECEPTORS)} receptors, {STORED} stored presses, s", receptors_s],
                    ["settings of an observer per minute, 6 touches", per_minute],
                ],
            ),
        ],
        measured={
            "sweep_overhead": overhead,
            "sweep_receptors_s": receptors_s,
            "sweep_observers": per_minute,
        },
        notes=["The 100 stored presses are six, each loaded again and again."],
    )


def _growth(folder: Path, count: int) -> list[float]:
    """Vary the seed of the afferents: time, memory and disk of so many settings of one stored press."""
    touch = TOUCH | {"motion": TOUCH["motion"] | {"depth_mm": 0.3}}  # type: ignore[operator]
    path = folder / f"{count}.zarr"
    run = fp.sweep(touch=touch, grid={"afferents.seed": list(range(count))}, out=path)
    size = sum(file.stat().st_size for file in path.rglob("*") if file.is_file())
    return [count, run.wall_s, 1e3 * run.wall_s / count, peak_memory_mb(), size / 1e3 / count]


def _receptors(folder: Path, depths: list[float]) -> float:
    """Let many receptors respond to every stored press; time for `STORED` of them. [s]"""
    store = Store(folder / "indentations")
    sweep = fp.SweepRequest.read({"touch": TOUCH, "grid": {"motion.depth_mm": depths}})
    population = fp.Population.grid(40_000.0, *RECEPTORS)
    began = time.perf_counter()
    for number in range(STORED):
        population.respond(store.load(sweep.described(number % sweep.size).touch))
    return time.perf_counter() - began


def _observers(folder: Path) -> float:
    """Hit rates of a Gradient Sum observer for many noises and criteria: settings per minute."""
    data = fp.open_sweep(folder / "presses.zarr").load()
    depths = data.motion_depth_mm.values.tolist()
    observer = {"along": "motion.depth_mm", "standard": depths[0], "measure": "dynamic"}
    grid = {
        "noise": np.linspace(0.01, 0.2, NOISES).tolist(),
        "experiment.criterion": np.linspace(0.3, 0.7, CRITERIA).tolist(),
    }
    observe_sweep(data, observer | {"noise": 0.1})  # loads kernels
    began = time.perf_counter()
    observe_sweep(data, observer, grid)
    return 60.0 * NOISES * CRITERIA / (time.perf_counter() - began)
