"""A sparse matrix on a structured grid, stored by columns of nodes: the layout in which products are fast.

A mesh is a grid along x around x through, and its nodes are numbered column by column: node k of column c,
counted from the skin, has number c m + k, with m nodes in a column. Neighbouring nodes lie in neighbouring
columns, at the same depth or one above or below. So the matrix is a list of pairs of neighbouring columns
(c, d), each with three diagonals of 3 x 3 blocks, and

    y_c[a, k] = sum over d, s, b of  A_cd[s, a, b, k]  x_d[b, k + s - 1],      s = 0, 1, 2.

The depth k varies fastest in memory, so that one machine instruction works on several of them. Single
precision is enough: the matrix is used in an iteration whose residual is computed in double precision
elsewhere.

Sweeps are approximations, and most of their time is spent reading the matrix. They use 16-bit integers,
Q = D^-1 A D^-1 rounded, with D² the diagonal of A over 32767: in a positive definite matrix no entry of Q is
larger than those on its diagonal. Vectors are scaled in the same way, y = D x and D^-1 r for r. The error is
at most 1/65534 of the diagonal. The error of 16-bit floating-point numbers is proportional to every entry,
and with them conjugate gradients did not converge on thin elements.

Columns are coloured so that neighbours differ, and sorted by colour. Within a colour a Gauss-Seidel sweep may
take columns in any order, on any number of threads, and gives the same bits. The sorting makes it read memory
from one end to the other, which halves its time. Kernels work on columns `first` to `last`.
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from numba import njit
from numpy.typing import NDArray

from fingerpad.core.numba_internals import small_single_array
from fingerpad.core.values import FloatArray

SingleArray = NDArray[np.float32]

LARGEST = 32767  # The diagonal of Q: the largest number of 16 bits.
LANES = 8  # Depths are padded to a multiple of this: the single-precision numbers of one 256-bit register.

MOST_LANES = 512
"""Padded nodes of the deepest column that kernels take: they keep numbers of one on the stack."""


@dataclass(frozen=True)
class ColumnGraph:
    """Which columns are neighbours."""

    start: np.ndarray  # First pair of every column, (n_columns + 1,).
    neighbour: np.ndarray
    """The other column, increasing within a column; a column is its own neighbour, (n_pairs,)."""

    @classmethod
    def of(cls, pairs: np.ndarray, n_columns: int) -> ColumnGraph:
        """Graph of pairs given as sorted, unique numbers c n_columns + d."""
        column, neighbour = np.divmod(pairs, n_columns)
        start = np.searchsorted(column, np.arange(n_columns + 1))
        return cls(start.astype(np.int32), neighbour.astype(np.int32))

    @property
    def n_columns(self) -> int:
        return self.start.size - 1

    @property
    def column(self) -> np.ndarray:
        """First column of every pair, (n_pairs,)."""
        return np.repeat(np.arange(self.n_columns), np.diff(self.start))

    @property
    def own(self) -> np.ndarray:
        """Pair of every column with itself, (n_columns,)."""
        return np.flatnonzero(self.column == self.neighbour)

    def sorted(self, order: np.ndarray) -> ColumnGraph:
        place = np.argsort(order)
        pairs = place[self.column] * self.n_columns + place[self.neighbour]
        return ColumnGraph.of(np.sort(pairs), self.n_columns)

    def zeros(self, depth: int) -> SingleArray:
        """Matrix (n_pairs, 3, 3, 3, lanes) of zeros for columns of `depth` nodes."""
        return np.zeros((self.neighbour.size, 3, 3, 3, lanes(depth)), dtype=np.float32)

    def entries(self, number: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
        """Row and column of every entry of a matrix in a numbering of its unknowns."""
        width = lanes(number.shape[2])
        padded = np.full((*number.shape[:2], width + 2), -1, dtype=np.int32)
        padded[:, :, 1 : 1 + number.shape[2]] = number
        shape = (self.neighbour.size, 3, 3, 3, width)
        row = np.broadcast_to(padded[self.column][:, None, :, None, 1:-1], shape)
        shifted = np.stack([padded[:, :, s : s + width] for s in range(3)], axis=1)
        column = np.broadcast_to(shifted[self.neighbour][:, :, None, :, :], shape)
        return row, column


@njit(cache=True)
def colours(start, neighbour):  # type: ignore[no-untyped-def]
    """Give every column the smallest colour that no neighbour before it has, (n_columns,)."""
    colour = np.empty(start.size - 1, dtype=np.int32)
    for c in range(colour.size):
        taken = np.uint64(0)
        for pair in range(start[c], start[c + 1]):
            if neighbour[pair] < c:
                taken |= np.uint64(1) << np.uint64(colour[neighbour[pair]])
        colour[c] = 0
        while (taken >> np.uint64(colour[c])) & np.uint64(1):
            colour[c] += 1
    return colour


def lanes(depth: int) -> int:
    """Return the padded number of nodes in a column."""
    return -(-depth // LANES) * LANES


def to_columns(values: FloatArray, order: np.ndarray, depth: int) -> SingleArray:
    """Vector (n_columns, 3, lanes + 2) of nodal values (n_nodes, 3): a zero, the nodes, zeros.

    `order` (n_columns,) has the place of each column among the nodes.
    """
    columns = np.zeros((order.size, 3, lanes(depth) + 2), dtype=np.float32)
    columns[:, :, 1 : depth + 1] = values.reshape(-1, depth, 3)[order].swapaxes(1, 2)
    return columns


def to_nodes(columns: SingleArray, order: np.ndarray, depth: int) -> FloatArray:
    """Nodal values (n_nodes, 3) of a vector (n_columns, 3, lanes + 2)."""
    values = np.empty((order.size, depth, 3))
    values[order] = columns[:, :, 1 : depth + 1].swapaxes(1, 2)
    return values.reshape(-1, 3)


@njit(cache=True)
def find_blocks(row_start, column, order, place, start, neighbour, depth, source):  # type: ignore[no-untyped-def]
    """Find the block of a tangent (see `assembly.Sparsity`) that each entry of a matrix is copied from."""
    source[:] = -1
    for c in range(order.size):
        for k in range(depth):
            node = order[c] * depth + k
            pair, before = start[c], -1
            for block in range(row_start[node], row_start[node + 1]):
                among_nodes = column[block] // depth
                if among_nodes != before:
                    pair, before = start[c], among_nodes
                    while neighbour[pair] != place[among_nodes]:
                        pair += 1
                source[pair, column[block] - among_nodes * depth - k + 1, k] = block


@njit(cache=True, nogil=True)
def take_blocks(first, last, source, blocks, start, neighbour, free, matrix):  # type: ignore[no-untyped-def]
    """Copy a tangent of 3 x 3 blocks into a matrix, zero where unknowns are held."""
    for c in range(first, last):
        for pair in range(start[c], start[c + 1]):
            d = neighbour[pair]
            for s in range(3):
                for k in range(source.shape[2]):
                    block = source[pair, s, k]
                    if block < 0:
                        continue
                    x, y, z = free[d, 0, k + s], free[d, 1, k + s], free[d, 2, k + s]
                    for a in range(3):
                        moves = free[c, a, k + 1]
                        matrix[pair, s, a, 0, k] = moves * x * blocks[block, a, 0]
                        matrix[pair, s, a, 1, k] = moves * y * blocks[block, a, 1]
                        matrix[pair, s, a, 2, k] = moves * z * blocks[block, a, 2]


@njit(cache=True, inline="always")
def _subtract_product(first, last, neighbour, matrix, x, r):  # type: ignore[no-untyped-def]
    """Subtract the products of some pairs of one column from r (3, at least lanes)."""
    single = np.float32
    for pair in range(first, last):
        d = neighbour[pair]
        for s in range(3):
            # Three rows at a time, which read x once, and no loop over them, which would be unrolled along k.
            xx, xy, xz = matrix[pair, s, 0, 0], matrix[pair, s, 0, 1], matrix[pair, s, 0, 2]
            yx, yy, yz = matrix[pair, s, 1, 0], matrix[pair, s, 1, 1], matrix[pair, s, 1, 2]
            zx, zy, zz = matrix[pair, s, 2, 0], matrix[pair, s, 2, 1], matrix[pair, s, 2, 2]
            for k in range(matrix.shape[4]):
                u, v, w = x[d, 0, k + s], x[d, 1, k + s], x[d, 2, k + s]
                r[0, k] -= single(xx[k]) * u + single(xy[k]) * v + single(xz[k]) * w
                r[1, k] -= single(yx[k]) * u + single(yy[k]) * v + single(yz[k]) * w
                r[2, k] -= single(zx[k]) * u + single(zy[k]) * v + single(zz[k]) * w


@njit(cache=True, inline="always")
def _solve_column(depth, lower, inverse, c, r):  # type: ignore[no-untyped-def]
    x, y, z = r[0, 0], r[1, 0], r[2, 0]
    for k in range(1, depth):
        x, y, z = (
            r[0, k] - (lower[c, k, 0] * x + lower[c, k, 1] * y + lower[c, k, 2] * z),
            r[1, k] - (lower[c, k, 3] * x + lower[c, k, 4] * y + lower[c, k, 5] * z),
            r[2, k] - (lower[c, k, 6] * x + lower[c, k, 7] * y + lower[c, k, 8] * z),
        )
        r[0, k], r[1, k], r[2, k] = x, y, z
    for k in range(depth - 1, -1, -1):
        u, v, w = r[0, k], r[1, k], r[2, k]
        u, v, w = (
            inverse[c, k, 0] * u + inverse[c, k, 1] * v + inverse[c, k, 2] * w,
            inverse[c, k, 3] * u + inverse[c, k, 4] * v + inverse[c, k, 5] * w,
            inverse[c, k, 6] * u + inverse[c, k, 7] * v + inverse[c, k, 8] * w,
        )
        if k < depth - 1:
            u -= lower[c, k + 1, 0] * x + lower[c, k + 1, 3] * y + lower[c, k + 1, 6] * z
            v -= lower[c, k + 1, 1] * x + lower[c, k + 1, 4] * y + lower[c, k + 1, 7] * z
            w -= lower[c, k + 1, 2] * x + lower[c, k + 1, 5] * y + lower[c, k + 1, 8] * z
        x, y, z = u, v, w
        r[0, k], r[1, k], r[2, k] = x, y, z


@njit(cache=True, inline="always")
def _invert(d, inverse):  # type: ignore[no-untyped-def]
    """Inverse of a symmetric 3 x 3 matrix; a held unknown, whose row is zero, gets an inverse of 1."""
    for a in range(3):
        if d[a, a] == 0.0:
            d[a, a] = 1.0
    xx = d[1, 1] * d[2, 2] - d[1, 2] * d[1, 2]
    xy = d[0, 2] * d[1, 2] - d[0, 1] * d[2, 2]
    xz = d[0, 1] * d[1, 2] - d[0, 2] * d[1, 1]
    determinant = d[0, 0] * xx + d[0, 1] * xy + d[0, 2] * xz
    inverse[0, 0], inverse[0, 1], inverse[0, 2] = xx, xy, xz
    inverse[1, 0], inverse[1, 1] = xy, d[0, 0] * d[2, 2] - d[0, 2] * d[0, 2]
    inverse[1, 2] = d[0, 1] * d[0, 2] - d[0, 0] * d[1, 2]
    inverse[2, 0], inverse[2, 1], inverse[2, 2] = xz, inverse[1, 2], d[0, 0] * d[1, 1] - d[0, 1] * d[0, 1]
    for a in range(3):
        for b in range(3):
            inverse[a, b] /= determinant


@njit(cache=True, nogil=True)
def find_scales(first, last, own, matrix, free, scale, shrink):  # type: ignore[no-untyped-def]
    """Write D and its inverse, both zero where an unknown is held."""
    for c in range(first, last):
        for a in range(3):
            for k in range(matrix.shape[4]):
                diagonal = free[c, a, k + 1] * matrix[own[c], 1, a, a, k]
                moves = diagonal > 0.0
                root = np.sqrt(diagonal / LARGEST) if moves else np.float32(1.0)
                scale[c, a, k + 1] = root if moves else 0.0
                shrink[c, a, k + 1] = 1.0 / root if moves else 0.0


@njit(cache=True, nogil=True)
def round_matrix(first, last, start, neighbour, matrix, shrink, rounded):  # type: ignore[no-untyped-def]
    """Write Q; columns `first` to `last`, other parameters as in `ColumnGraph` and `find_scales`.

    A tangent that is not positive definite may have larger entries than Q can hold. They are clipped:
    conjugate gradients detect such a tangent from the product with A itself.
    """
    for c in range(first, last):
        for pair in range(start[c], start[c + 1]):
            d = neighbour[pair]
            for s in range(matrix.shape[1]):  # not range(3): the compiler would unroll these loops
                for a in range(matrix.shape[2]):
                    for b in range(matrix.shape[3]):
                        for k in range(matrix.shape[4]):
                            both = shrink[c, a, k + 1] * shrink[d, b, k + s]
                            entry = np.floor(matrix[pair, s, a, b, k] * both + np.float32(0.5))
                            entry = min(max(entry, np.float32(-LARGEST)), np.float32(LARGEST))
                            rounded[pair, s, a, b, k] = np.int16(entry)


@njit(cache=True, nogil=True)
def factor_columns(first, last, own, matrix, depth, lower, inverse):  # type: ignore[no-untyped-def]
    """Factor the part T of a matrix that stays within a column, block tridiagonal.

    T = (1 + M) D (1 + M)' with D_0 = T_00, M_k = T_k,k-1 D_k-1^-1, D_k = T_kk - M_k T_k,k-1'.
    """
    for c in range(first, last):
        d, m, before = np.empty((3, 3)), np.empty((3, 3)), np.empty((3, 3))
        for k in range(depth):
            for a in range(3):
                for b in range(3):
                    d[a, b] = matrix[own[c], 1, a, b, k]
            if k > 0:
                for a in range(3):
                    for b in range(3):
                        m[a, b] = 0.0
                        for e in range(3):
                            m[a, b] += matrix[own[c], 0, a, e, k] * before[e, b]
                        lower[c, k, 3 * a + b] = m[a, b]
                for a in range(3):
                    for b in range(3):
                        for e in range(3):
                            d[a, b] -= m[a, e] * matrix[own[c], 0, b, e, k]
            _invert(d, before)
            for a in range(3):
                for b in range(3):
                    inverse[c, k, 3 * a + b] = before[a, b]


@njit(cache=True, nogil=True, fastmath={"contract"})
def multiply(first, last, start, neighbour, matrix, x, product):  # type: ignore[no-untyped-def]
    """Write the product A x; vectors (n_columns, 3, lanes + 2)."""
    r = small_single_array((3, MOST_LANES))
    for c in range(first, last):
        for a in range(3):
            for k in range(matrix.shape[4]):
                r[a, k] = 0.0
        _subtract_product(start[c], start[c + 1], neighbour, matrix, x, r)
        for a in range(3):
            for k in range(matrix.shape[4]):
                product[c, a, k + 1] = -r[a, k]


@njit(cache=True, nogil=True, fastmath={"contract"})
def sweep(first, last, begin, end, neighbour, matrix, depth, lower, inverse, right, x, keeps):  # type: ignore[no-untyped-def]
    """Gauss-Seidel on the columns of one colour; columns of one colour may be done in any order.

    A forward sweep takes the colours in order, takes the pairs with columns before its own into account, and
    overwrites x: over all colours, with A = L + T + L' by the order of the columns, (T + L) x = right. A
    backward sweep takes the last colour first and all pairs into account, and adds to x.
    """
    r = small_single_array((3, MOST_LANES))
    for c in range(first, last):
        for a in range(3):
            for k in range(matrix.shape[4]):
                r[a, k] = right[c, a, k + 1]
        _subtract_product(begin[c], end[c], neighbour, matrix, x, r)
        _solve_column(depth, lower, inverse, c, r)
        for a in range(3):
            for k in range(depth):
                x[c, a, k + 1] = x[c, a, k + 1] + r[a, k] if keeps else r[a, k]


@njit(cache=True, nogil=True, fastmath={"contract"})
def residual_after_forward(first, last, start, own, neighbour, matrix, x, scale, residual):  # type: ignore[no-untyped-def]
    """Write right - A x after a forward sweep, which is -L' x, times `scale`; else as in `sweep`."""
    r = small_single_array((3, MOST_LANES))
    for c in range(first, last):
        for a in range(3):
            for k in range(matrix.shape[4]):
                r[a, k] = 0.0
        _subtract_product(own[c] + 1, start[c + 1], neighbour, matrix, x, r)
        for a in range(3):
            for k in range(matrix.shape[4]):
                residual[c, a, k + 1] = scale[c, a, k + 1] * r[a, k]
