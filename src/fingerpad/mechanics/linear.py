"""The linear system behind a Newton step: conjugate gradients around a factor that is kept.

A tangent changes little from one Newton step to the next, so one sparse factor serves as preconditioner for
many of them; conjugate gradients (SciPy) restore double precision. The factor is renewed when the iterations
grow. MKL's PARDISO does the factoring, in single precision, where pypardiso has it; elsewhere SuperLU (SciPy)
does, or smoothed aggregation (pyamg) takes its place in meshes that are too large for SuperLU.
"""

from __future__ import annotations

import ctypes
import weakref
from dataclasses import dataclass, field
from typing import Protocol

import numpy as np
from scipy.sparse.linalg import LinearOperator, cg, splu

from fingerpad.checks import FloatArray
from fingerpad.errors import ConvergenceError, InputError
from fingerpad.mechanics.assembly import Sparsity
from fingerpad.mesh_quality import rigid_motions

try:
    import pypardiso
except ImportError:  # no MKL wheel for this processor
    pypardiso = None

RENEW_AFTER_ITERATIONS = 16
MOST_ITERATIONS = 400
DIRECT_POISSON, MULTIGRID_POISSON = 0.4999, 0.485
"""Largest Poisson's ratio with a factor, and with multigrid, whose iterations grow beyond (see
docs/decisions/linear-solver.md)."""

SUPERLU_NODES = 20_000
"""Largest mesh for SuperLU: one of its factors then takes about 1 GB and a quarter of a minute."""

NO_NODES = np.empty(0, dtype=np.int64)


class _NotPositiveDefiniteError(Exception):
    """Conjugate gradients met a direction along which the tangent has no stiffness."""


class Preconditioner(Protocol):
    """An approximate inverse of the tangent on the free degrees of freedom."""

    def renew(self, blocks: FloatArray) -> None:
        """Take a new tangent, blocks (n_blocks, 3, 3)."""
        ...

    def apply(self, residual: FloatArray) -> FloatArray:
        """Approximate solution for a residual (n_free,)."""
        ...


class PardisoFactor:
    """Single-precision Cholesky factor from MKL's PARDISO on one thread.

    Parameters
    ----------
    sparsity : Sparsity
        Block pattern of the tangent.
    free : int array (n_free,)
        Degrees of freedom that move.
    """

    def __init__(self, sparsity: Sparsity, free: np.ndarray):
        n = 3 * (len(sparsity.row_start) - 1)
        number = np.full(n, -1, dtype=np.int64)
        number[free] = np.arange(free.size)
        rows = np.repeat(np.arange(n // 3), np.diff(sparsity.row_start))
        row = number[3 * rows[:, None, None] + np.arange(3)[None, :, None]]
        column = number[3 * sparsity.column[:, None, None] + np.arange(3)[None, None, :]]
        row, column = np.broadcast_arrays(row, column)
        wanted = np.flatnonzero((row.ravel() >= 0) & (column.ravel() >= row.ravel()))
        order = np.argsort(row.ravel()[wanted] * free.size + column.ravel()[wanted], kind="stable")
        self._entries = wanted[order]
        self._column = (column.ravel()[self._entries]).astype(np.int32)
        row_start = np.searchsorted(row.ravel()[self._entries], np.arange(free.size + 1))
        self._row_start = row_start.astype(np.int32)
        self._values = np.empty(self._entries.size, dtype=np.float32)
        self._size = free.size
        self._mkl = pypardiso.PyPardisoSolver(mtype=2)
        self._mkl.libmkl.MKL_Set_Num_Threads_Local(1)
        for index, value in {1: 1, 2: 2, 8: 0, 10: 8, 11: 0, 13: 0, 18: -1, 24: 0, 28: 1, 35: 1}.items():
            # Numbers of MKL's manual: own settings, METIS order, no refinement, single precision, 0-based.
            self._mkl.iparm[index - 1] = value
        self._analysed = False
        weakref.finalize(self, self._mkl.free_memory, everything=True)

    def renew(self, blocks: FloatArray) -> None:
        """Factor the tangent given by its blocks (n_blocks, 3, 3).

        Raises
        ------
        ConvergenceError
            If the matrix is not positive definite.
        """
        self._values[:] = blocks.ravel()[self._entries]
        empty = np.zeros(self._size, dtype=np.float32)
        if not self._analysed:
            self._call(11, empty, empty.copy())
            self._analysed = True
        self._call(22, empty, empty.copy())

    def apply(self, residual: FloatArray) -> FloatArray:
        """Solve with the factor for a residual (n_free,)."""
        right = residual.astype(np.float32)
        solution = np.empty_like(right)
        self._call(33, right, solution)
        return solution.astype(np.float64)

    def _call(self, phase: int, right: np.ndarray, solution: np.ndarray) -> None:
        """One phase of PARDISO; pypardiso's own call handles double precision only."""
        integers = ctypes.POINTER(ctypes.c_int32)

        def number(value: int) -> ctypes._CArgObject:
            return ctypes.byref(ctypes.c_int32(value))

        error = ctypes.c_int32(0)
        self._mkl.libmkl.MKL_Set_Num_Threads_Local(1)
        self._mkl._mkl_pardiso(
            self._mkl.pt.ctypes.data_as(ctypes.POINTER(self._mkl._pt_type[0])),
            number(1), number(1), number(2), number(phase), number(self._size),
            self._values.ctypes.data_as(ctypes.c_void_p),
            self._row_start.ctypes.data_as(integers), self._column.ctypes.data_as(integers),
            self._mkl.perm.ctypes.data_as(integers), number(1),
            self._mkl.iparm.ctypes.data_as(integers), number(0),
            right.ctypes.data_as(ctypes.c_void_p), solution.ctypes.data_as(ctypes.c_void_p),
            ctypes.byref(error),
        )  # fmt: skip
        if error.value:
            raise ConvergenceError(f"PARDISO could not finish phase {phase}: error {error.value}.")


class SuperLuFactor:
    """Double-precision factor from SciPy's SuperLU.

    Parameters
    ----------
    sparsity : Sparsity
        Block pattern of the tangent.
    free : int array (n_free,)
        Degrees of freedom that move.
    """

    def __init__(self, sparsity: Sparsity, free: np.ndarray):
        self._sparsity, self._free = sparsity, free

    def renew(self, blocks: FloatArray) -> None:
        """Factor the tangent given by its blocks (n_blocks, 3, 3).

        Raises
        ------
        ConvergenceError
            If the matrix is singular.
        """
        matrix = self._sparsity.matrix(blocks).tocsr()[self._free][:, self._free].tocsc()
        try:
            # A symmetric ordering and pivots on the diagonal: other settings fill the factor ten times over.
            self._factor = splu(
                matrix, permc_spec="MMD_AT_PLUS_A", diag_pivot_thresh=0.0, options={"SymmetricMode": True}
            )
        except RuntimeError as error:
            raise ConvergenceError(f"SuperLU could not factor the tangent: {error}.") from error

    def apply(self, residual: FloatArray) -> FloatArray:
        """Solve with the factor for a residual (n_free,)."""
        return self._factor.solve(residual)


class AggregationHierarchy:
    """Smoothed aggregation multigrid from pyamg, with the rigid motions as near null space.

    Parameters
    ----------
    sparsity : Sparsity
        Block pattern of the tangent.
    free : int array (n_free,)
        Degrees of freedom that move.
    nodes_mm : array (n_nodes, 3)
        Reference nodes. [mm]
    """

    def __init__(self, sparsity: Sparsity, free: np.ndarray, nodes_mm: FloatArray):
        self._sparsity, self._free = sparsity, free
        self._rigid = rigid_motions(nodes_mm).reshape(-1, 6)[free]

    def renew(self, blocks: FloatArray) -> None:
        """Build the hierarchy for the tangent given by its blocks (n_blocks, 3, 3)."""
        import pyamg

        matrix = self._sparsity.matrix(blocks).tocsr()[self._free][:, self._free].tocsr()
        self._cycle = pyamg.smoothed_aggregation_solver(
            matrix, B=self._rigid, symmetry="symmetric", max_coarse=500
        ).aspreconditioner()

    def apply(self, residual: FloatArray) -> FloatArray:
        """One V-cycle for a residual (n_free,)."""
        return self._cycle @ residual


def choose_preconditioner(
    sparsity: Sparsity, free: np.ndarray, nodes_mm: FloatArray, poisson: float
) -> tuple[Preconditioner, str]:
    """Choose the preconditioner for a body, and say why.

    Parameters
    ----------
    sparsity : Sparsity
        Block pattern of the tangent.
    free : int array (n_free,)
        Degrees of freedom that move.
    nodes_mm : array (n_nodes, 3)
        Reference nodes. [mm]
    poisson : float
        Poisson's ratio of the least compressible material.

    Returns
    -------
    (Preconditioner, str)
        The preconditioner and the reason for it in a sentence.

    Raises
    ------
    InputError
        If the material is beyond the reach of every solver that this machine has for this mesh.
    """
    # Materials are told apart by their moduli, from which the ratio comes back with the last digits changed.
    if poisson > DIRECT_POISSON + 1e-9:
        raise InputError(
            f"Poisson's ratio must not exceed {DIRECT_POISSON}: got {poisson:.7g}; use {DIRECT_POISSON}, "
            "where a force is within 0.05 % of that of tissue that keeps its volume."
        )
    n_nodes = len(nodes_mm)
    if pypardiso is not None:
        reason = f"PARDISO's factor: MKL is here, and it serves any Poisson's ratio up to {DIRECT_POISSON}."
        return PardisoFactor(sparsity, free), reason
    if n_nodes <= SUPERLU_NODES:
        reason = f"SuperLU's factor: no MKL here, and {n_nodes} nodes are within its {SUPERLU_NODES}."
        return SuperLuFactor(sparsity, free), reason
    too_large = f"{n_nodes} nodes are above SuperLU's {SUPERLU_NODES}"
    if poisson > MULTIGRID_POISSON + 1e-9:
        raise InputError(
            f"Poisson's ratio must not exceed {MULTIGRID_POISSON} here: got {poisson:.6g}, {too_large}, and "
            "this machine has no MKL (pypardiso); use a smaller ratio, a coarser mesh or an x86-64 one."
        )
    reason = (
        f"pyamg's multigrid: no MKL here, {too_large}, and Poisson's ratio {poisson:.4g} is within "
        f"{MULTIGRID_POISSON}."
    )
    return AggregationHierarchy(sparsity, free, nodes_mm), reason


@dataclass
class LinearSolver:
    """Solve with a tangent on the free degrees of freedom, keeping the preconditioner while it serves.

    Parameters
    ----------
    sparsity : Sparsity
        Block pattern of the tangent.
    free : int array (n_free,)
        Degrees of freedom that move.
    approximate : Preconditioner
        Its approximate inverse.
    """

    sparsity: Sparsity
    free: np.ndarray
    approximate: Preconditioner
    renewals: int = field(default=0, init=False)
    iterations: int = field(default=0, init=False)
    _stale: bool = field(default=True, init=False)

    def solve(self, blocks: FloatArray, residual: FloatArray, relative_tolerance: float) -> FloatArray:
        """Solve K x = r for the free degrees of freedom.

        Parameters
        ----------
        blocks : array (n_blocks, 3, 3)
            The tangent.
        residual : array (n_free,)
            Right-hand side.
        relative_tolerance : float
            Residual norm to reach, relative to the right-hand side's.

        Returns
        -------
        array (n_free,)
            The solution.

        Raises
        ------
        ConvergenceError
            If the tangent is not positive definite, or conjugate gradients do not converge even with a new
            preconditioner.
        """
        matrix = self.sparsity.matrix(blocks)
        full = np.zeros(matrix.shape[0])

        def multiply(direction: FloatArray) -> FloatArray:
            full[self.free] = direction
            product = (matrix @ full)[self.free]
            # Conjugate gradients may run through an indefinite tangent unnoticed, to no minimum.
            if direction @ product < 0.0:
                raise _NotPositiveDefiniteError
            return product

        size = self.free.size
        operator = LinearOperator((size, size), matvec=multiply, dtype=np.float64)
        inverse = LinearOperator((size, size), matvec=self.approximate.apply, dtype=np.float64)
        for _ in range(2):
            fresh = self._stale
            if self._stale:
                self.approximate.renew(blocks)
                self.renewals += 1
                self._stale = False
            count = 0

            def counted(_: FloatArray) -> None:
                nonlocal count
                count += 1

            try:
                solution, failed = cg(
                    operator, residual, rtol=relative_tolerance, maxiter=MOST_ITERATIONS,
                    M=inverse, callback=counted,
                )  # fmt: skip
            except _NotPositiveDefiniteError:
                self._stale = True
                raise ConvergenceError("The tangent is not positive definite.") from None
            self.iterations += count
            self._stale = count > RENEW_AFTER_ITERATIONS
            if not failed and np.isfinite(solution).all():
                return solution
            self._stale = True
            if fresh:
                break
        raise ConvergenceError(f"The linear solver stopped after {count} iterations without converging.")


def free_degrees_of_freedom(
    n_nodes: int, fixed_nodes: np.ndarray, symmetry_nodes: np.ndarray, gripped_nodes: np.ndarray = NO_NODES
) -> np.ndarray:
    """Degrees of freedom left when nodes are fixed, stay in the plane of symmetry, or do not move along x."""
    moves = np.ones((n_nodes, 3), dtype=bool)
    moves[fixed_nodes] = False
    moves[symmetry_nodes, 2] = False
    moves[gripped_nodes, 0] = False
    return np.flatnonzero(moves.ravel())
