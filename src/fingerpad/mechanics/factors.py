"""Factor of a sparse symmetric matrix, by SciPy's SuperLU.

A matrix is given as an array of numbers of any shape, together with the row and the column of each of them.
Rows and columns are given once, when the factor is made. Entries of unknowns that do not move have the number
-1 and are left out.
"""

from __future__ import annotations

import numpy as np
from scipy import sparse
from scipy.sparse.linalg import splu

from fingerpad.core.errors import ConvergenceError
from fingerpad.core.values import FloatArray


class NotPositiveDefiniteError(ConvergenceError):
    """A tangent with a direction along which it has no stiffness."""

    def __init__(self) -> None:
        super().__init__("The tangent is not positive definite.")


class SuperLuFactor:
    """Double-precision factor from SciPy's SuperLU, renewed for other numbers in the same places."""

    def __init__(self, row: np.ndarray, column: np.ndarray):
        row, column = row.ravel(), column.ravel()
        size = int(row.max()) + 1
        wanted = np.flatnonzero((row >= 0) & (column >= 0))
        order = np.argsort(column[wanted] * np.int64(size) + row[wanted], kind="stable")
        self._entries = wanted[order]
        self._row = row[self._entries]
        self._column_start = np.searchsorted(column[self._entries], np.arange(size + 1))
        self._size = size

    def renew(self, values: np.ndarray) -> None:
        chosen = values.ravel()[self._entries].astype(np.float64)
        shape = (self._size, self._size)
        matrix = sparse.csc_matrix((chosen, self._row, self._column_start), shape=shape)
        try:
            # A symmetric ordering and pivots on the diagonal: other settings fill the factor ten times over.
            self._factor = splu(
                matrix, permc_spec="MMD_AT_PLUS_A", diag_pivot_thresh=0.0, options={"SymmetricMode": True}
            )
        except RuntimeError as error:
            raise ConvergenceError(f"SuperLU could not factor the tangent: {error}.") from error
        # Pivots on the diagonal: the factor is L D L^T, and the signs of D are those of the eigenvalues.
        pivoted = (self._factor.perm_r != self._factor.perm_c).any()
        if pivoted or self._factor.U.diagonal().min() <= 0.0:
            raise NotPositiveDefiniteError

    def solve(self, right: np.ndarray) -> FloatArray:
        return self._factor.solve(right)
