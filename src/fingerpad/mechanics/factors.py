"""Factors of sparse symmetric matrices: MKL's PARDISO in single precision, or SuperLU from SciPy.

A matrix comes as an array of numbers of any shape, together with the row and column of each of them. Both are
given once, when the factor is made; entries of unknowns that do not move have the number -1 and are left out.
"""

from __future__ import annotations

import ctypes
import weakref
from collections.abc import Callable
from functools import cache
from typing import Any, Protocol

import numpy as np
from scipy import sparse
from scipy.sparse.linalg import splu

from fingerpad.core.checks import FloatArray
from fingerpad.core.errors import ConvergenceError

try:
    import pypardiso
except ImportError:  # no MKL wheel for this processor
    pypardiso = None

SETTINGS = {1: 1, 2: 2, 8: 0, 10: 8, 11: 0, 13: 0, 18: -1, 24: 0, 28: 1, 35: 1}
"""Numbers of MKL's manual: own settings, METIS order, no refinement, single precision, 0-based."""

POSITIVE_DEFINITE = 2
"""Type of matrix, by MKL's number for it."""

ANALYSE, FACTOR, SOLVE, RELEASE = 11, 22, 33, -1
"""Phases of PARDISO, by MKL's numbers for them."""

SAME_BITS_AVX2 = 10
"""Mode of MKL's conditional reproducibility, by MKL's number for it."""


class Factor(Protocol):
    """A factor that is renewed for other numbers in the same places."""

    def renew(self, values: np.ndarray) -> None:
        """Factor the matrix of these values; ConvergenceError if that fails."""
        ...

    def solve(self, right: np.ndarray) -> FloatArray:
        """Solve for a right-hand side (n,)."""
        ...


MakeFactor = Callable[[np.ndarray, np.ndarray], Factor]
"""Makes a factor from the row and the column of every value."""


class PardisoFactor:
    """Single-precision Cholesky factor from MKL's PARDISO on one thread.

    Parameters
    ----------
    row, column : int array
        Place of every value; -1 where an unknown is held.
    """

    def __init__(self, row: np.ndarray, column: np.ndarray):
        row, column = row.ravel(), column.ravel()
        self._size = int(row.max()) + 1
        upper = np.flatnonzero((row >= 0) & (column >= row))
        order = np.argsort(row[upper] * np.int64(self._size) + column[upper], kind="stable")
        self._entries = upper[order]
        self._column = column[self._entries].astype(np.int32)
        self._row_start = np.searchsorted(row[self._entries], np.arange(self._size + 1)).astype(np.int32)
        self._values = np.empty(self._entries.size, dtype=np.float32)
        self._settings = np.zeros(64, dtype=np.int32)
        for index, value in SETTINGS.items():
            self._settings[index - 1] = value
        # Where MKL keeps the addresses of what it holds for this factor.
        self._held = np.zeros(64, dtype=np.int64)
        self._analysed = False
        weakref.finalize(self, _release, self._size, self._settings, self._held)

    def renew(self, values: np.ndarray) -> None:
        """Factor the matrix of these values.

        Raises
        ------
        ConvergenceError
            If the matrix is not positive definite.
        """
        self._values[:] = values.ravel()[self._entries]
        empty = np.zeros(self._size, dtype=np.float32)
        if not self._analysed:
            self._call(ANALYSE, empty, empty.copy())
            self._analysed = True
        self._call(FACTOR, empty, empty.copy())

    def solve(self, right: np.ndarray) -> FloatArray:
        """Solve for a right-hand side (n,)."""
        single = right.astype(np.float32)
        solution = np.empty_like(single)
        self._call(SOLVE, single, solution)
        return solution.astype(np.float64)

    def _call(self, phase: int, right: np.ndarray, solution: np.ndarray) -> None:
        error = _pardiso(
            phase, self._size, self._settings, self._held,
            self._values, self._row_start, self._column, right, solution,
        )  # fmt: skip
        if error:
            raise ConvergenceError(f"PARDISO could not finish phase {phase}: error {error}.")


@cache
def _mkl() -> Any:
    """MKL's library. pypardiso finds it, for which it walks through all installed files: do so once."""
    library = pypardiso.PyPardisoSolver(mtype=POSITIVE_DEFINITE).libmkl
    # Else sums hang on where in memory the numbers happen to lie; only the first such call counts.
    library.MKL_CBWR_Set(SAME_BITS_AVX2)
    library.pardiso.argtypes = [ctypes.c_void_p] * 16
    return library


def _pardiso(phase: int, size: int, settings: np.ndarray, held: np.ndarray, *arrays: np.ndarray) -> int:
    """One phase of PARDISO on one thread, and its error; pypardiso's own call takes double precision only."""

    def number(value: int) -> Any:
        return ctypes.byref(ctypes.c_int32(value))

    def address(array: np.ndarray) -> int:
        return array.ctypes.data

    values, row_start, column, right, solution = arrays
    permutation, error = np.zeros(0, dtype=np.int32), ctypes.c_int32(0)
    _mkl().MKL_Set_Num_Threads_Local(1)
    _mkl().pardiso(
        address(held), number(1), number(1), number(POSITIVE_DEFINITE), number(phase), number(size),
        address(values), address(row_start), address(column), address(permutation), number(1),
        address(settings), number(0), address(right), address(solution), ctypes.byref(error),
    )  # fmt: skip
    return error.value


def _release(size: int, settings: np.ndarray, held: np.ndarray) -> None:
    """Give back what MKL holds for a factor."""
    nothing = np.zeros(0, dtype=np.float32)
    _pardiso(RELEASE, size, settings, held, *(nothing for _ in range(5)))


class SuperLuFactor:
    """Double-precision factor from SciPy's SuperLU.

    Parameters
    ----------
    row, column : int array
        Place of every value; -1 where an unknown is held.
    """

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
        """Factor the matrix of these values.

        Raises
        ------
        ConvergenceError
            If the matrix is singular.
        """
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

    def solve(self, right: np.ndarray) -> FloatArray:
        """Solve for a right-hand side (n,)."""
        return self._factor.solve(right)
