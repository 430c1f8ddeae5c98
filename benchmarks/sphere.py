"""The everyday job: one sphere into half a finger at standard resolution, ramp and hold."""

from __future__ import annotations

from time import perf_counter
from typing import Any

from benchmarks.measuring import Run, Spread, run_job
from benchmarks.results import Report, Table

CURVATURE_PER_M = 287.0
THREADS, REPEATS = 2, 3


def press(resolution: str) -> dict[str, Any]:
    """Press the sphere as the paper does, and tell the seconds of `Touch.solve`, meshing included.

    Parameters
    ----------
    resolution : str
        "quick", "standard" or "paper".

    Returns
    -------
    dict
        Time, size, work and largest force of the press.
    """
    from fingerpad import Fingertip, Sphere, touch_of

    touch = touch_of(Fingertip(), Sphere(curvature_per_m=CURVATURE_PER_M), resolution=resolution)
    started = perf_counter()
    skin = touch.solve()
    return {"solve_s": perf_counter() - started, **summary(skin)}


def summary(skin: Any) -> dict[str, Any]:
    """Size and work of a press, and two of its results, by which runs can be told to agree."""
    return {
        "nodes": len(skin.mesh.nodes_mm),
        "elements": len(skin.mesh.elements),
        "full": skin.mesh.full,
        "steps": skin.times_ms.size - 1,
        "newton_steps": skin.newton_steps,
        "factorisations": skin.factorisations,
        "linear_solver": skin.linear_solver,
        "force_mn": float(skin.force_mn[-1]),
        "sed_kpa": float(skin.sed_kpa.max()),
    }


def measure() -> Report:
    """Repeat the press in fresh processes and report it."""
    run_job("sphere", "press", THREADS, resolution="quick")  # compiles kernels, if that is still to be done
    runs = [run_job("sphere", "press", THREADS, resolution="standard") for _ in range(REPEATS)]
    first = runs[0].answer
    time_s = Spread.of([run.answer["solve_s"] for run in runs])
    memory_mb = Spread.of([run.peak_mb for run in runs])
    row = [first["nodes"], first["elements"], first["newton_steps"], first["factorisations"]]
    row += [str(time_s), str(Spread.of([cpu_share(run) for run in runs])), str(memory_mb), first["force_mn"]]
    columns = [
        "nodes",
        "elements",
        "Newton steps",
        "factors",
        "solve, s",
        "cores used",
        "memory, MB",
        "force, mN",
    ]
    return Report(
        name="sphere",
        title="One sphere at standard resolution",
        about=(
            f"A sphere of {CURVATURE_PER_M:g} per m pressed 1.0 mm deep into half a finger, ramp of 50 ms "
            f"and hold of 950 ms, {THREADS} threads, {REPEATS} runs in fresh processes: median (smallest to "
            "largest)."
        ),
        tables=[
            Table("`touch_of(Fingertip(), Sphere(287), resolution='standard').solve()`:", columns, [row])
        ],
        measured={"sphere_s": time_s.median, "sphere_gb": memory_mb.median / 1000.0},
        notes=["The time is that of `solve`, with meshing and loading of compiled kernels, without imports."],
    )


def cpu_share(run: Run) -> float:
    """Cores that a run kept busy, on average over its whole life."""
    return run.cpu_s / run.wall_s
