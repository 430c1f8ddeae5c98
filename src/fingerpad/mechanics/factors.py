"""Factors of sparse symmetric matrices: MKL's PARDISO in single precision, or SuperLU from SciPy.

A matrix comes as an array of numbers of any shape, together with the row and column of each of them. Both are
given once, when the factor is made; entries of unknowns that do not move have the number -1 and are left out.
"""

from __future__ import annotations

import ctypes
import weakref
from collections.abc import Callable
from typing import Protocol

import numpy as np
from scipy import sparse
from scipy.sparse.linalg import splu

from fingerpad.checks import FloatArray
from fingerpad.errors import ConvergenceError

try:
    import pypardiso
except ImportError:  # no MKL wheel for this processor
    pypardiso = None

SETTINGS = {1: 1, 2: 2, 8: 0, 10: 8, 11: 0, 13: 0, 18: -1, 24: 0, 28: 1, 35: 1}
"""Numbers of MKL's manual: own settings, METIS order, no refinement, single precision, 0-based."""


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
        self._mkl = pypardiso.PyPardisoSolver(mtype=2)
        # Else sums hang on where in memory the numbers happen to lie; only the first such call counts.
        self._mkl.libmkl.MKL_CBWR_Set(SAME_BITS_AVX2)
        for index, value in SETTINGS.items():
            self._mkl.iparm[index - 1] = value
        self._analysed = False
        weakref.finalize(self, self._mkl.free_memory, everything=True)

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
            self._call(11, empty, empty.copy())
            self._analysed = True
        self._call(22, empty, empty.copy())

    def solve(self, right: np.ndarray) -> FloatArray:
        """Solve for a right-hand side (n,)."""
        single = right.astype(np.float32)
        solution = np.empty_like(single)
        self._call(33, single, solution)
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
