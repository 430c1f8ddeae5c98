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
    ("quick", "multigrid"),
    ("quick", "multigrid without MKL"),
    ("quick", "PARDISO"),
    ("quick", "SuperLU"),
    ("quick", "pyamg"),
    ("standard", "multigrid"),
    ("standard", "multigrid without MKL"),
    ("standard", "PARDISO"),
)
"""Resolutions and solvers. SuperLU and pyamg take too long for more."""

WORDS = {
    "multigrid": "multigrid by columns, coarsest level by PARDISO",
    "multigrid without MKL": "multigrid by columns, coarsest level by SuperLU",
    "PARDISO": "PARDISO (MKL), a kept factor",
    "SuperLU": "SuperLU (SciPy), a kept factor",
    "pyamg": "smoothed aggregation (pyamg)",
}


def preconditioner(name: str, sparsity: Any, free: np.ndarray, mesh: Any) -> Any:
    """Make one of `WORDS` for a tangent."""
    from fingerpad.mechanics.factors import PardisoFactor, SuperLuFactor
    from fingerpad.mechanics.linear import KeptFactor
    from fingerpad.mechanics.multigrid import Multigrid

    if name.startswith("multigrid"):
        factor = SuperLuFactor if "without" in name else PardisoFactor
        return Multigrid(sparsity, free, mesh.nodes_mm, mesh.grid, factor)
    if name != "pyamg":
        return KeptFactor(sparsity, free, PardisoFactor if name == "PARDISO" else SuperLuFactor)

    import pyamg

    from fingerpad.mesh_quality import rigid_motions

    class Aggregation(KeptFactor):
        """Smoothed aggregation with the rigid motions as near null space."""

        def renew(self, blocks: np.ndarray) -> None:
            self.follow(blocks)
            matrix = self._matrix.tocsr()[free][:, free].tocsr()
            rigid = rigid_motions(mesh.nodes_mm).reshape(-1, 6)[free]
            hierarchy = pyamg.smoothed_aggregation_solver(
                matrix, B=rigid, symmetry="symmetric", max_coarse=500
            )
            self._cycle = hierarchy.aspreconditioner()

        def apply(self, residual: np.ndarray) -> np.ndarray:
            return self._cycle @ residual

    # The factor of its base is made for the pattern, and never renewed.
    return Aggregation(sparsity, free, SuperLuFactor)


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

    def choose(sparsity: Any, free: np.ndarray, mesh: Any, poisson: float) -> tuple[Any, str]:
        return preconditioner(solver, sparsity, free, mesh), WORDS[solver]

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
        notes=[
            "Where MKL is missing, SuperLU factors the coarsest level; pyamg was the choice for large meshes "
            "before there was multigrid by columns, and is here for comparison only."
        ],
    )  # fmt: skip
