"""Algebraic multigrid by smoothed aggregation, for meshes without rows and columns of nodes.

PyAMG groups neighbouring nodes by the matrix alone. A group keeps the motions of a rigid body, which cost
little energy, and Jacobi's method smooths them over the borders of the groups (Vanek, Mandel & Brezina 1996).
"""

from __future__ import annotations

from collections.abc import Callable

import numpy as np
from scipy import sparse

from fingerpad.core.checks import FloatArray
from fingerpad.core.errors import InputError
from fingerpad.mechanics.assembly import Sparsity

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
