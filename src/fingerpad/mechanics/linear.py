"""The linear system behind a Newton step: conjugate gradients around a preconditioner that is kept.

A tangent changes little from one Newton step to the next, so one sparse factor, or the coarse levels of one
multigrid hierarchy, serve for many of them; conjugate gradients (SciPy) do the rest. What is kept is renewed
when the iterations grow.

Meshes without rows and columns of nodes have algebraic multigrid by smoothed aggregation. PyAMG groups
neighbouring nodes by the matrix alone. A group keeps the motions of a rigid body, which cost little energy,
and Jacobi's method smooths them over the borders of the groups (Vanek, Mandel & Brezina 1996).
"""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass, field
from typing import Any, Protocol, runtime_checkable

import numpy as np
from scipy import sparse
from scipy.sparse.linalg import LinearOperator, cg

from fingerpad.core.errors import ConvergenceError, InputError
from fingerpad.core.values import FloatArray
from fingerpad.geometry.mesh import Mesh
from fingerpad.mechanics.assembly import Sparsity
from fingerpad.mechanics.columns import MOST_LANES
from fingerpad.mechanics.factors import NotPositiveDefiniteError, SuperLuFactor
from fingerpad.mechanics.multigrid import Multigrid

MOST_ITERATIONS = 400
DIRECT_POISSON, MULTIGRID_POISSON = 0.4999, 0.499
"""Largest Poisson's ratio with a factor, and with multigrid, whose iterations grow above it (see
docs/decisions.md#linear-solver)."""

MULTIGRID_NODES = 4_000
"""Smallest mesh for multigrid; for a smaller mesh a factor takes a fraction of a second."""

DIRECT_NODES = 20_000  # Largest mesh for a factor, which then takes about 1 GB and 15 s.

NO_NODES = np.empty(0, dtype=np.int64)


@runtime_checkable
class Preconditioner(Protocol):
    """The tangent on the free degrees of freedom, and an approximate inverse of it."""

    @property
    def patience(self) -> int:
        """Iterations beyond those of a renewed one after which it is worth renewing."""
        ...

    @property
    def number_type(self) -> type[np.floating]:
        """Type of the numbers that a tangent should have."""
        ...

    def follow(self, blocks: np.ndarray) -> None:
        """Take a new tangent, blocks (n_blocks, 3, 3), where that takes little time."""
        ...

    def renew(self, blocks: np.ndarray) -> None:
        """Take a new tangent altogether."""
        ...

    def enter(self, values: FloatArray) -> np.ndarray:
        """Vector, in the layout of this preconditioner, of values of the free degrees of freedom."""
        ...

    def leave(self, vector: np.ndarray) -> FloatArray:
        """Values of the free degrees of freedom of such a vector."""
        ...

    def multiply(self, direction: np.ndarray) -> np.ndarray: ...

    def apply(self, residual: np.ndarray) -> np.ndarray:
        """Approximate solution for a vector."""
        ...


class KeptFactor:
    """A factor of an earlier tangent, for products with the present one."""

    patience = 14
    number_type = np.float64

    def __init__(
        self,
        sparsity: Sparsity,
        free: np.ndarray,
        factor: Callable[[np.ndarray, np.ndarray], Any] = SuperLuFactor,
    ):
        self._sparsity, self._free = sparsity, free
        self._factor = factor(*sparsity.entries(free))

    def follow(self, blocks: np.ndarray) -> None:
        """Multiply with this tangent from now on."""
        self._matrix = self._sparsity.matrix(blocks)

    def renew(self, blocks: np.ndarray) -> None:
        """Factor this tangent; ConvergenceError if that fails."""
        self.follow(blocks)
        self._factor.renew(blocks)

    def enter(self, values: FloatArray) -> FloatArray:
        """Return the values: a vector has the free degrees of freedom."""
        return values

    leave = enter

    def multiply(self, direction: FloatArray) -> FloatArray:
        """Product of the tangent and a vector (n_free,)."""
        full = np.zeros(self._matrix.shape[0])
        full[self._free] = direction
        return (self._matrix @ full)[self._free]

    def apply(self, residual: FloatArray) -> FloatArray:
        """Solve with the factor for a residual (n_free,)."""
        return self._factor.solve(residual)


def choose_preconditioner(
    sparsity: Sparsity, free: np.ndarray, mesh: Mesh, poisson: float
) -> tuple[Preconditioner, str]:
    """Choose the preconditioner for a body, and say why."""
    # Materials are distinguished by moduli; the ratio computed from them differs in the last digits.
    if poisson > DIRECT_POISSON + 1e-9:
        raise InputError(
            f"Poisson's ratio must not exceed {DIRECT_POISSON}: got {poisson:.7g}; use {DIRECT_POISSON}, "
            "where a force is within 0.05 % of that of tissue that keeps its volume."
        )
    n_nodes = len(mesh.nodes_mm)
    shallow = mesh.is_grid and mesh.grid.shape[2] <= MOST_LANES
    if n_nodes >= MULTIGRID_NODES and shallow and poisson <= MULTIGRID_POISSON + 1e-9:
        multigrid = Multigrid(sparsity, free, mesh.nodes_mm, mesh.grid)
        reason = (
            f"geometric multigrid, levels: {len(multigrid.columns_of_levels)}, the coarsest by SuperLU: "
            f"{n_nodes} nodes are at least {MULTIGRID_NODES}, and Poisson's ratio {poisson:.4g} is within "
            f"{MULTIGRID_POISSON}."
        )
        return multigrid, reason
    if n_nodes <= DIRECT_NODES:
        reason = (
            f"SuperLU's factor of the whole tangent: {n_nodes} nodes are within {DIRECT_NODES}, and "
            f"Poisson's ratio {poisson:.4g} is within {DIRECT_POISSON}."
        )
        return KeptFactor(sparsity, free), reason
    if not mesh.is_grid and poisson <= MULTIGRID_POISSON + 1e-9:
        reason = (
            f"algebraic multigrid by smoothed aggregation (PyAMG): {n_nodes} nodes without rows and columns "
            f"are more than {DIRECT_NODES}, and Poisson's ratio {poisson:.4g} is within {MULTIGRID_POISSON}."
        )
        return SmoothedAggregation(sparsity, free, mesh.nodes_mm), reason
    raise InputError(
        f"Poisson's ratio must not exceed {MULTIGRID_POISSON} for a mesh of more than {DIRECT_NODES} nodes: "
        f"got {poisson:.6g} and {n_nodes} nodes; use a smaller ratio or a coarser mesh."
    )


@dataclass
class LinearSolver:
    """Solve with a tangent on the free degrees of freedom, keeping the preconditioner while it serves."""

    approximate: Preconditioner  # The tangent's product and approximate inverse.
    renewals: int = field(default=0, init=False)
    iterations: int = field(default=0, init=False)
    _stale: bool = field(default=True, init=False)
    _renewed_rate: float = field(default=0.0, init=False)

    @property
    def number_type(self) -> type[np.floating]:
        return self.approximate.number_type

    def multiply(self, direction: FloatArray) -> FloatArray:
        """Product of the tangent of the last solution and a direction (n_free,)."""
        vector = self.approximate.enter(direction)
        return self.approximate.leave(self.approximate.multiply(vector))

    def solve(
        self,
        blocks: np.ndarray,
        residual: FloatArray,
        relative_tolerance: float,
        guess: FloatArray | None = None,
    ) -> FloatArray:
        """Solve K x = r for the free degrees of freedom, beginning with a guess of x."""
        digits = -np.log10(relative_tolerance)
        for attempt in range(2):
            # How a new preconditioner serves shows when a whole solution is sought, not the rest of one.
            fresh = self._stale and (guess is None or attempt > 0)
            try:
                if fresh:
                    self.approximate.renew(blocks)
                    self.renewals += 1
                    self._stale = False
                else:
                    self.approximate.follow(blocks)
                solution, count, failed = _conjugate_gradients(
                    self.approximate, residual, relative_tolerance, guess
                )
            except (NotPositiveDefiniteError, ZeroDivisionError):  # the latter of a node's own block
                self._stale = True
                raise NotPositiveDefiniteError from None
            self.iterations += count
            if fresh and guess is None:
                self._renewed_rate = count / digits
            self._stale |= count > self._renewed_rate * digits + self.approximate.patience
            if not failed and np.isfinite(solution).all():
                return solution
            self._stale = True
            if fresh:
                break
        raise ConvergenceError(f"The linear solver stopped after {count} iterations without converging.")


def _conjugate_gradients(
    approximate: Preconditioner,
    residual: FloatArray,
    relative_tolerance: float,
    guess: FloatArray | None = None,
) -> tuple[FloatArray, int, bool]:
    """Solution, iterations, and whether the tolerance was missed."""
    count = 0

    def counted(_: FloatArray) -> None:
        nonlocal count
        count += 1

    def multiply(direction: FloatArray) -> FloatArray:
        product = approximate.multiply(direction)
        curvature = direction @ product
        # Conjugate gradients may run through an indefinite tangent unnoticed, to no minimum.
        if curvature < 0.0:
            raise NotPositiveDefiniteError
        if np.isnan(curvature):
            raise FloatingPointError
        return product

    right = approximate.enter(residual)
    first = None if guess is None else approximate.enter(guess)
    shape = (right.size, right.size)
    try:
        with np.errstate(over="raise", divide="raise", invalid="raise"):
            solution, failed = cg(
                LinearOperator(shape, matvec=multiply, dtype=right.dtype), right, first,
                rtol=relative_tolerance, maxiter=MOST_ITERATIONS,
                M=LinearOperator(shape, matvec=approximate.apply, dtype=right.dtype), callback=counted,
            )  # fmt: skip
    except FloatingPointError:  # with the preconditioner of another tangent they may diverge
        return residual, count, True
    return approximate.leave(solution), count, bool(failed)


def free_degrees_of_freedom(
    n_nodes: int, fixed_nodes: np.ndarray, symmetry_nodes: np.ndarray, gripped_nodes: np.ndarray = NO_NODES
) -> np.ndarray:
    """Degrees of freedom left when nodes are fixed, stay in the plane of symmetry, or do not move along x."""
    moves = np.ones((n_nodes, 3), dtype=bool)
    moves[fixed_nodes] = False
    moves[symmetry_nodes, 2] = False
    moves[gripped_nodes, 0] = False
    return np.flatnonzero(moves.ravel())


_SWEEPS = ("block_gauss_seidel", {"sweep": "symmetric"})
# Local weights need no estimate of an eigenvalue, for which PyAMG draws numbers at random.
_SMOOTHING = ("jacobi", {"omega": 4.0 / 3.0, "weighting": "local"})
_COARSEST = 500


class SmoothedAggregation:
    """A hierarchy of an earlier tangent, for products with the present one."""

    patience = 20
    number_type = np.float64

    def __init__(self, sparsity: Sparsity, free: np.ndarray, nodes_mm: FloatArray):
        try:
            from pyamg import smoothed_aggregation_solver
        except ImportError as error:
            raise InputError(
                f"A mesh of one's own of {len(nodes_mm):,} nodes needs PyAMG: pip install "
                "'fingerpad[meshes]', or use a coarser mesh."
            ) from error
        self._solver = smoothed_aggregation_solver
        self._sparsity, self._free = sparsity, free
        moves = np.zeros((len(nodes_mm), 3))
        moves.ravel()[free] = 1.0
        first = sparsity.row
        # Unknowns that are held keep their place in the blocks: their rows and columns have a diagonal only.
        self._kept = moves[first][:, :, None] * moves[sparsity.column][:, None]
        self._held = (1.0 - moves)[:, :, None] * np.eye(3)
        x, y, z = (nodes_mm - nodes_mm.mean(axis=0)).T
        motions = np.zeros((len(nodes_mm), 3, 6))
        motions[:, :, :3] = np.eye(3)
        motions[:, 0, 3], motions[:, 1, 3] = -y, x
        motions[:, 1, 4], motions[:, 2, 4] = -z, y
        motions[:, 2, 5], motions[:, 0, 5] = -x, z
        self._motions = (moves[:, :, None] * motions).reshape(-1, 6)

    def follow(self, blocks: np.ndarray) -> None:
        """Multiply with this tangent from now on."""
        self._matrix = self._of_free(blocks)

    def renew(self, blocks: np.ndarray) -> None:
        """Make a hierarchy of this tangent."""
        self.follow(blocks)
        hierarchy = self._solver(
            self._matrix,
            B=self._motions,
            symmetry="symmetric",
            strength=("symmetric", {"theta": 0.0}),
            smooth=_SMOOTHING,
            improve_candidates=None,
            presmoother=_SWEEPS,
            postsmoother=_SWEEPS,
            max_coarse=_COARSEST,
        )
        self._cycle: Callable[[FloatArray], FloatArray] = hierarchy.aspreconditioner().matvec

    def enter(self, values: FloatArray) -> FloatArray:
        """Vector of all degrees of freedom, 0 where they are held."""
        vector = np.zeros(self._held.shape[0] * 3)
        vector[self._free] = values
        return vector

    def leave(self, vector: FloatArray) -> FloatArray:
        """Values of the free degrees of freedom."""
        return vector[self._free]

    def multiply(self, direction: FloatArray) -> FloatArray:
        return np.asarray(self._matrix @ direction)

    def apply(self, residual: FloatArray) -> FloatArray:
        """Approximate solution by one V-cycle."""
        return self._cycle(residual)

    def _of_free(self, blocks: np.ndarray) -> sparse.bsr_matrix:
        """Tangent of the free degrees of freedom; the diagonal of the others is that of their block."""
        kept = blocks * self._kept
        diagonal = self._sparsity.diagonal
        scale = np.trace(blocks[diagonal], axis1=1, axis2=2) / 3.0
        kept[diagonal] += scale[:, None, None] * self._held
        return self._sparsity.matrix(kept)
