"""Everyday presses: one sphere into half a finger at standard resolution, and others at quick."""

from __future__ import annotations

from benchmarks.measuring import Spread, run_job
from benchmarks.pressing import CASES, PRESSED
from benchmarks.results import Report, Table

THREADS, REPEATS = 2, 3

FEBIO_S = {"sphere": 28.6, "cylinder": 18.6, "bar": 32.6}
"""Times of FEBio by case; the last note of the section says where they come from. [s]"""


def measure() -> Report:
    """Repeat the press in fresh processes and report it."""
    run_job("pressing", "press", THREADS, resolution="quick")  # compiles kernels, if that is still to be done
    runs = [run_job("pressing", "press", THREADS, resolution="standard") for _ in range(REPEATS)]
    first = runs[0].answer
    time_s = Spread.of([run.answer["solve_s"] for run in runs])
    memory_mb = Spread.of([run.peak_mb for run in runs])
    cores = Spread.of([run.cores for run in runs])
    quick_s = Spread.of(
        [run_job("pressing", "press", THREADS, resolution="quick").answer["solve_s"] for _ in range(REPEATS)]
    )
    others = {
        case: [run_job("pressing", "press_case", threads, case=case).answer for threads in (1, THREADS)]
        for case in CASES
    }
    return Report(
        name="sphere",
        title="One sphere at standard resolution",
        about=(
            f"{PRESSED}; half a finger, {THREADS} threads, {REPEATS} runs in fresh processes: median "
            "(smallest to largest)."
        ),
        tables=[
            Table(
                "`touch_of(Fingertip(), Sphere(curvature_per_m=287), resolution='standard').solve()`:",
                [
                    "nodes",
                    "elements",
                    "Newton steps",
                    "factors",
                    "solve, s",
                    "cores used",
                    "memory, MB",
                    "mN",
                ],
                [
                    [
                        first["nodes"],
                        first["elements"],
                        first["newton_steps"],
                        first["factorisations"],
                        str(time_s),
                        str(cores),
                        str(memory_mb),
                        first["force_mn"],
                    ]
                ],
            ),
            Table(
                "Presses at `quick`, once on each number of threads:",
                ["press", "nodes", "Newton steps", "1 thread, s", f"{THREADS} threads, s", "FEBio, s"],
                [
                    [
                        CASES[case],
                        one["nodes"],
                        one["newton_steps"],
                        one["solve_s"],
                        two["solve_s"],
                        FEBIO_S.get(case, "–"),
                    ]
                    for case, (one, two) in others.items()
                ],
            ),
        ],
        measured={
            "sphere_s": time_s.median,
            "sphere_gb": memory_mb.median / 1000.0,
            "sphere_quick_s": quick_s.median,
            **{f"{case}_s": others[case][1]["solve_s"] for case in ("force", "slide", "punch")},
        },
        notes=[
            "The time is that of `solve`; it includes meshing and loading of compiled kernels and "
            "excludes imports.",
            f"The same at `quick`: {quick_s} s.",
            "FEBio 4.11, one thread, with contact of nodes on facets: measured once, outside of this project "
            "and on another machine of this class, with meshes of 6,090 to 8,370 nodes.",
        ],
    )
