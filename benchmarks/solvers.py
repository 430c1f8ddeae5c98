"""The linear solvers behind a press: the same press with each, whatever the machine would choose."""

from __future__ import annotations

from collections.abc import Sequence
from time import perf_counter
from typing import Any

import numpy as np

from benchmarks.measuring import run_job
from benchmarks.pressing import PRESSED, summary, touch_of_sphere
from benchmarks.results import Report, Table

THREADS = 2

RUNS = (
    ("quick", "PardisoFactor"),
    ("quick", "SuperLuFactor"),
    ("quick", "AggregationHierarchy"),
    ("standard", "PardisoFactor"),
)
"""Resolutions, and classes of `fingerpad.mechanics.linear`. SuperLU and pyamg take too long for more."""

WORDS = {
    "PardisoFactor": "PARDISO (MKL), a kept factor",
    "SuperLuFactor": "SuperLU (SciPy), a kept factor",
    "AggregationHierarchy": "smoothed aggregation (pyamg)",
}


def press_with(resolution: str, solver: str) -> dict[str, Any]:
    """Press the sphere with a given preconditioner.

    Parameters
    ----------
    resolution : str
        Mesh and steps.
    solver : str
        Key of `WORDS`.

    Returns
    -------
    dict
        As of `pressing.press`, with the seconds within linear solves and the iterations of all of them.
    """
    from fingerpad.mechanics import linear
    from fingerpad.mechanics import press as module

    spent_s = []
    solvers = []

    class Timed(linear.LinearSolver):
        """The product's solver under a clock."""

        def solve(self, *arguments: Any, **named: Any) -> np.ndarray:
            if self not in solvers:
                solvers.append(self)
            started = perf_counter()
            found = super().solve(*arguments, **named)
            spent_s.append(perf_counter() - started)
            return found

    def choose(sparsity: Any, free: np.ndarray, nodes_mm: np.ndarray, poisson: float) -> tuple[Any, str]:
        with_nodes = (nodes_mm,) if solver == "AggregationHierarchy" else ()
        return getattr(linear, solver)(sparsity, free, *with_nodes), WORDS[solver]

    vars(module).update(choose_preconditioner=choose, LinearSolver=Timed)
    touch = touch_of_sphere(resolution)
    started = perf_counter()
    skin = touch.solve()
    return {
        "solve_s": perf_counter() - started,
        "linear_s": sum(spent_s),
        "solves": len(spent_s),
        "iterations": sum(one.iterations for one in solvers),
        **summary(skin),
    }


def measure(runs: Sequence[tuple[str, str]] = RUNS) -> Report:
    """Press with every solver in a process of its own."""
    run_job("pressing", "press", THREADS, resolution="quick")  # compiles kernels, if that is still to be done
    rows = []
    for resolution, solver in runs:
        done = run_job("solvers", "press_with", THREADS, resolution=resolution, solver=solver)
        found = done.answer
        rows.append(
            [
                resolution, found["nodes"], WORDS[solver], found["factorisations"], found["solves"],
                found["iterations"], found["linear_s"], found["solve_s"], done.peak_mb, found["force_mn"],
            ]
        )  # fmt: skip
    return Report(
        name="solvers",
        title="Linear solvers",
        about=f"{PRESSED}; half a finger, {THREADS} threads, one run with every linear solver there is.",
        tables=[
            Table(
                "Conjugate gradients around each:",
                [
                    "resolution", "nodes", "preconditioner", "set up", "solves", "iterations",
                    "linear solves, s", "press, s", "memory, MB", "force, mN",
                ],
                rows,
            )
        ],
        notes=["Where MKL is missing, SuperLU serves up to 20,000 nodes, and pyamg larger meshes."],
    )  # fmt: skip
