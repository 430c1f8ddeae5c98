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

MULTIGRID = "multigrid, coarsest by SuperLU"
SUPERLU, PYAMG = "SuperLU (SciPy)", "smoothed aggregation (pyamg)"

RUNS = (("quick", MULTIGRID), ("quick", SUPERLU), ("quick", PYAMG), ("standard", MULTIGRID))
"""Resolutions and preconditioners; SuperLU and pyamg take too long for more than `quick`."""


class Aggregation:
    """One V-cycle of pyamg's hierarchy in place of a factor, the rigid motions as its near null space.

    Parameters
    ----------
    row, column : int array
        Place of every value; -1 where an unknown is held.
    rigid : array (n, 6)
        Rigid motions of the unknowns.
    """

    def __init__(self, row: np.ndarray, column: np.ndarray, rigid: np.ndarray):
        self._row, self._column, self._rigid = row.ravel(), column.ravel(), rigid
        self._kept = (self._row >= 0) & (self._column >= 0)

    def renew(self, values: np.ndarray) -> None:
        """Build the hierarchy for the matrix of these values."""
        import pyamg
        from scipy import sparse

        places = self._row[self._kept], self._column[self._kept]
        matrix = sparse.csr_matrix((values.ravel()[self._kept], places), shape=(len(self._rigid),) * 2)
        hierarchy = pyamg.smoothed_aggregation_solver(
            matrix, B=self._rigid, symmetry="symmetric", max_coarse=500
        )
        self._cycle = hierarchy.aspreconditioner()

    def solve(self, right: np.ndarray) -> np.ndarray:
        """One V-cycle for a right-hand side (n,)."""
        return self._cycle @ right


def preconditioner(name: str, sparsity: Any, free: np.ndarray, mesh: Any) -> Any:
    """Make the preconditioner of a name of `RUNS` for a mesh."""
    from fingerpad.geometry.mesh_checks import rigid_motions
    from fingerpad.mechanics.linear import KeptFactor
    from fingerpad.mechanics.multigrid import Multigrid

    if name == MULTIGRID:
        return Multigrid(sparsity, free, mesh.nodes_mm, mesh.grid)
    if name == SUPERLU:
        return KeptFactor(sparsity, free)
    rigid = rigid_motions(mesh.nodes_mm).reshape(-1, 6)[free]

    def aggregation(row: np.ndarray, column: np.ndarray) -> Aggregation:
        return Aggregation(row, column, rigid)

    return KeptFactor(sparsity, free, aggregation)


def press_with(resolution: str, solver: str) -> dict[str, Any]:
    """Press the sphere with a given preconditioner.

    Parameters
    ----------
    resolution : str
        Mesh and steps.
    solver : str
        Name of a preconditioner in `RUNS`.

    Returns
    -------
    dict
        As of `pressing.press`, with the seconds within linear solves and the iterations of all of them.
    """
    from fingerpad.mechanics import linear
    from fingerpad.mechanics import press as module

    spent_s: list[float] = []
    solvers: list[linear.LinearSolver] = []

    class Timed(linear.LinearSolver):
        """The product's solver under a clock."""

        def __init__(self, *arguments: Any):
            super().__init__(*arguments)
            solvers.append(self)

        def solve(self, *arguments: Any, **named: Any) -> np.ndarray:
            started = perf_counter()
            found = super().solve(*arguments, **named)
            spent_s.append(perf_counter() - started)
            return found

    def choose(sparsity: Any, free: np.ndarray, mesh: Any, poisson: float) -> tuple[Any, str]:
        return preconditioner(solver, sparsity, free, mesh), solver

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
        work = [found["nodes"], solver, found["factorisations"], found["solves"], found["iterations"]]
        spent = [found["linear_s"], found["solve_s"], done.peak_mb]
        rows.append([resolution, *work, *spent, found["force_mn"]])
    return Report(
        name="solvers",
        title="Linear solvers",
        about=f"{PRESSED}; half a finger, {THREADS} threads, one run with each linear solver.",
        tables=[
            Table(
                "Conjugate gradients with each preconditioner:",
                [
                    "resolution", "nodes", "preconditioner", "set up", "solves", "iterations",
                    "linear solves, s", "indentation, s", "memory, MB", "force, mN",
                ],
                rows,
            )
        ],
        notes=["pyamg is measured for comparison only."],
    )  # fmt: skip
