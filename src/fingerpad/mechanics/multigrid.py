"""Geometric multigrid on the structured grid of a finger or a block.

The grid is coarsened along and around, never through: a column of nodes keeps its depth. Smoothing must
remove the errors that a coarse grid cannot represent. Gauss-Seidel sweeps over whole columns (see `columns`)
remove those that vary with depth, where elements are thin. Lines are merged only where they are close
together, up to the distance of the finest lines of the coarse grid: a graded mesh becomes more even with
every level.

Coarse matrices are Galerkin products, A_C = P' A P, with P linear along the grid lines. P acts on whole
columns, so A_C is a weighted sum of the column pairs of A. One cycle sweeps forward before the correction
from the next coarser level, which on the coarsest comes from a factor, and backward after it: a symmetric
operator, as conjugate gradients need.
"""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass
from itertools import pairwise
from typing import Any

import numpy as np
from numba import njit

from fingerpad.core.threads import Chunk, current_threads, in_chunks
from fingerpad.core.values import FloatArray
from fingerpad.mechanics.assembly import Sparsity
from fingerpad.mechanics.columns import (
    ColumnGraph,
    SingleArray,
    colours,
    factor_columns,
    find_blocks,
    find_scales,
    lanes,
    multiply,
    residual_after_forward,
    round_matrix,
    sweep,
    take_blocks,
    to_columns,
    to_nodes,
)
from fingerpad.mechanics.factors import SuperLuFactor

MERGED_OVER_FINEST = 4.0
"""Largest distance of two lines that become one step, over the smallest distance on the grid."""

COARSEST_COLUMNS = 60  # A grid with fewer columns is not coarsened: its factor costs less than a level.

FEWEST_COLUMNS = 200
"""Fewest columns of one colour for a thread: starting it takes as long as the work on some tens of
columns."""

PIECES_PER_THREAD = 2  # Pieces that columns are shared out in, for each thread, if there are enough columns.

ROUNDED_ASPECT = 50.0
"""Largest ratio of the widest step along or around to the smallest step through up to which sweeps round; it
is smaller on fingers. The coupling across wide and thin elements is a small part of the diagonal and would be
lost in rounding: at 80 a nearly incompressible block took twice the iterations, at 300 it did not
converge."""

WORTHWHILE = 0.8  # Largest ratio of columns, coarse over fine, for which a level is added.


@dataclass(frozen=True)
class Transfer:
    """Interpolation from the columns of a coarse grid to those of a fine one, and the product P' A P."""

    parent: np.ndarray
    weight: SingleArray
    """Coarse columns around each fine one, and their weights, which add up to 1, (n_fine, 4)."""
    child_start: np.ndarray
    child: np.ndarray
    child_weight: SingleArray  # The same seen from the coarse columns: their fine columns and weights.
    graph: ColumnGraph  # Neighbours on the coarse grid.
    part_start: np.ndarray
    part: np.ndarray
    part_weight: SingleArray  # For each coarse pair of columns the fine pairs whose weighted sum it is.

    @classmethod
    def of(cls, graph: ColumnGraph, parent: np.ndarray, weight: FloatArray) -> Transfer:
        n_coarse = int(parent.max()) + 1
        fine, corner = np.nonzero(weight)
        child_start, child, child_weight = _grouped(
            parent[fine, corner], fine, weight[fine, corner], n_coarse
        )
        first, second = parent[graph.column], parent[graph.neighbour]
        share = weight[graph.column][:, :, None] * weight[graph.neighbour][:, None, :]
        pair, i, j = np.nonzero(share)
        keys = first[pair, i] * n_coarse + second[pair, j]
        coarse_pairs, target = np.unique(keys, return_inverse=True)
        part_start, part, part_weight = _grouped(target, pair, share[pair, i, j], coarse_pairs.size)
        return cls(
            parent=parent.astype(np.int32),
            weight=weight.astype(np.float32),
            child_start=child_start,
            child=child,
            child_weight=child_weight,
            graph=ColumnGraph.of(coarse_pairs, n_coarse),
            part_start=part_start,
            part=part,
            part_weight=part_weight,
        )


def _grouped(
    group: np.ndarray, member: np.ndarray, weight: FloatArray, n_groups: int
) -> tuple[np.ndarray, np.ndarray, SingleArray]:
    """Members and weights of every group, one after the other, and where each group starts."""
    order = np.argsort(group, kind="stable")
    start = np.searchsorted(group[order], np.arange(n_groups + 1))
    return start.astype(np.int32), member[order].astype(np.int32), weight[order].astype(np.float32)


def kept_lines(steps_mm: FloatArray, finest_mm: float) -> np.ndarray:
    """Lines of a coarse grid: two steps become one where together they are short."""
    kept = [0]
    while kept[-1] < steps_mm.size:
        line = kept[-1]
        short = (
            line + 1 < steps_mm.size and steps_mm[line] + steps_mm[line + 1] <= MERGED_OVER_FINEST * finest_mm
        )
        kept.append(line + 2 if short else line + 1)
    return np.array(kept)


def _between(steps_mm: FloatArray, kept: np.ndarray) -> tuple[np.ndarray, FloatArray]:
    """For every line the two kept lines around it, (n, 2), and their weights."""
    place = np.concatenate([[0.0], np.cumsum(steps_mm)])
    before = np.clip(np.searchsorted(kept, np.arange(place.size), side="right") - 1, 0, kept.size - 2)
    low, high = place[kept[before]], place[kept[before + 1]]
    share = (place - low) / (high - low)
    return np.stack([before, before + 1], axis=1), np.stack([1.0 - share, share], axis=1)


@dataclass(frozen=True)
class ColumnGrid:
    """The columns of one level at the crossings of its lines."""

    columns: np.ndarray
    """Column at each crossing; pole and seam of a finger appear repeatedly, (n_along, n_around)."""
    along_mm: FloatArray
    around_mm: FloatArray  # Distances of successive lines, (n_along - 1,). [mm]

    @property
    def n_columns(self) -> int:
        return int(self.columns.max()) + 1

    def renumbered(self, order: np.ndarray) -> ColumnGrid:
        """Return the same with columns sorted by `order` (n_columns,)."""
        place = np.empty_like(order)
        place[order] = np.arange(order.size)
        return ColumnGrid(place[self.columns], self.along_mm, self.around_mm)

    def coarser(self) -> tuple[ColumnGrid, np.ndarray, np.ndarray, FloatArray] | None:
        """Coarse grid, the fine column that each of its columns is, and parents and weights for `Transfer`.

        None if the grid is small already, or not much smaller when coarsened.
        """
        if self.n_columns < COARSEST_COLUMNS:
            return None
        finest_mm = float(min(self.along_mm.min(), self.around_mm.min()))
        largest_mm = float(max(self.along_mm.max(), self.around_mm.max()))
        while True:
            along, around = kept_lines(self.along_mm, finest_mm), kept_lines(self.around_mm, finest_mm)
            chosen, number = np.unique(self.columns[np.ix_(along, around)], return_inverse=True)
            if chosen.size <= WORTHWHILE * self.n_columns:
                break
            # A few lines much closer than all others, as below a wire, do not justify a level.
            finest_mm *= 2.0
            if finest_mm > largest_mm:
                return None
        number = number.reshape(along.size, around.size)
        (i, weight_i), (j, weight_j) = _between(self.along_mm, along), _between(self.around_mm, around)
        parent = number[i[:, None, :, None], j[None, :, None, :]].reshape(-1, 4)
        weight = (weight_i[:, None, :, None] * weight_j[None, :, None, :]).reshape(-1, 4)
        # A column at the pole or the seam comes from the same place under each of its lines.
        _, first = np.unique(self.columns, return_index=True)
        distances = (
            np.add.reduceat(h, k[:-1]) for h, k in ((self.along_mm, along), (self.around_mm, around))
        )
        return ColumnGrid(number, *distances), chosen, parent[first], weight[first]


@njit(cache=True, nogil=True, fastmath={"contract"})
def _restrict(first, last, start, member, weights, fine, coarse):  # type: ignore[no-untyped-def]
    """Write every coarse row as the weighted sum of its fine rows; vectors, or matrices pair by pair."""
    for row in range(first, last):
        coarse[row] = 0.0
        for n in range(start[row], start[row + 1]):
            weight, source = weights[n], member[n]
            for k in range(fine.shape[1]):
                coarse[row, k] += weight * fine[source, k]


@njit(cache=True, nogil=True)
def _hold(first, last, start, neighbour, free, matrix):  # type: ignore[no-untyped-def]
    """Set rows and columns of held unknowns to zero."""
    for c in range(first, last):
        for pair in range(start[c], start[c + 1]):
            for s in range(matrix.shape[1]):  # not range(3): the compiler would unroll these loops
                for a in range(matrix.shape[2]):
                    for b in range(matrix.shape[3]):
                        for k in range(matrix.shape[4]):
                            matrix[pair, s, a, b, k] *= free[c, a, k + 1] * free[neighbour[pair], b, k + s]


@njit(cache=True, nogil=True, fastmath={"contract"})
def _add_prolonged(first, last, parent, weight, coarse, scale, fine):  # type: ignore[no-untyped-def]
    """Add P coarse, scaled, to fine; vectors (n_columns, numbers of a column)."""
    for c in range(first, last):
        i, j, m, n = parent[c, 0], parent[c, 1], parent[c, 2], parent[c, 3]
        p, q, r, s = weight[c, 0], weight[c, 1], weight[c, 2], weight[c, 3]
        for k in range(fine.shape[1]):
            value = p * coarse[i, k] + q * coarse[j, k] + r * coarse[m, k] + s * coarse[n, k]
            fine[c, k] += scale[c, k] * value


def _parts(count: int) -> int:
    """How many threads so many columns, or pairs of columns, are worth."""
    return max(1, min(current_threads(), count // FEWEST_COLUMNS))


def _share(kernel: Callable[..., None], first: int, last: int, *arguments: Any) -> None:
    """Run a kernel on consecutive columns, or pairs of columns, with all threads."""
    parts = _parts(last - first)
    if parts == 1:
        kernel(first, last, *arguments)
        return
    # More pieces than threads: columns differ in work, and a thread that is done takes the next piece.
    pieces = min(PIECES_PER_THREAD * parts, (last - first) // FEWEST_COLUMNS)
    ends = [first + (last - first) * n // pieces for n in range(pieces + 1)]
    in_chunks(lambda start, stop: kernel(start, stop, *arguments), list(pairwise(ends)))


class _Level:
    """One grid: its matrix A, what sweeps need of it (see `columns`), and the vectors of a cycle."""

    # Where sweeps round, they sweep Q instead of A, and vectors are scaled. The coarsest grid is not swept.

    def __init__(self, graph: ColumnGraph, colour_start: np.ndarray, free: SingleArray, depth: int):
        self.graph, self.free, self.depth = graph, free, depth
        self.colours: list[Chunk] = list(pairwise(colour_start.tolist()))
        self.own = graph.own.astype(np.int32)
        self.matrix = self.swept = graph.zeros(depth)
        self.scale = self.shrink = free
        self.right, self.x, self.residual = (np.zeros_like(free) for _ in range(3))

    @property
    def n_columns(self) -> int:
        return int(self.own.size)

    def make_sweepable(self, rounds: bool) -> None:
        """Make room for what sweeps need, which on the coarsest grid is nothing."""
        shape = (self.n_columns, self.depth, 9)
        self.lower, self.inverse = (np.zeros(shape, dtype=np.float32) for _ in range(2))
        if rounds:
            self.scale, self.shrink = np.zeros_like(self.free), np.zeros_like(self.free)
            self.swept = np.zeros(self.matrix.shape, dtype=np.int16)

    def prepare_sweeps(self) -> None:
        """Round the present matrix, if at all, and factor its columns."""
        if self.swept is not self.matrix:
            pairs, scales = (self.graph.start, self.graph.neighbour), (self.scale, self.shrink)
            _share(find_scales, 0, self.n_columns, self.own, self.matrix, self.free, *scales)
            _share(round_matrix, 0, self.n_columns, *pairs, self.matrix, self.shrink, self.swept)
        _share(factor_columns, 0, self.n_columns, self.own, self.swept, self.depth, self.lower, self.inverse)

    def sweep_forward(self) -> None:
        """Write `x` for `right`, and the `residual`, not scaled."""
        self._sweep(self.colours, self.graph.start[:-1], self.own, keeps=False)
        _share(
            residual_after_forward, 0, self.n_columns, self.graph.start, self.own, self.graph.neighbour,
            self.swept, self.x, self.scale, self.residual,
        )  # fmt: skip

    def sweep_backward(self) -> None:
        self._sweep(self.colours[::-1], self.graph.start[:-1], self.graph.start[1:], keeps=True)

    def _sweep(self, colours: list[Chunk], begin: np.ndarray, end: np.ndarray, keeps: bool) -> None:
        for colour in colours:
            _share(
                sweep, *colour, begin, end, self.graph.neighbour, self.swept, self.depth, self.lower,
                self.inverse, self.right, self.x, keeps,
            )  # fmt: skip


def _by_colour(graph: ColumnGraph) -> tuple[np.ndarray, np.ndarray]:
    """Order of the columns by colour, and the first column of every colour in that order."""
    colour = colours(graph.start, graph.neighbour)
    order = np.argsort(colour, kind="stable")
    return order, np.searchsorted(colour[order], np.arange(colour.max() + 2))


class Multigrid:
    """Product of the tangent, and its approximate inverse by one V-cycle."""

    patience = 3
    number_type = np.float32

    def __init__(self, sparsity: Sparsity, free: np.ndarray, nodes_mm: FloatArray, grid: np.ndarray):
        self._sparsity, self._free, self._depth = sparsity, free, grid.shape[2]
        depth, skin = self._depth, nodes_mm[grid[:, :, 0]]
        columns = ColumnGrid(
            grid[:, :, 0] // depth,
            np.linalg.norm(np.diff(skin, axis=0), axis=2).mean(axis=1),
            np.linalg.norm(np.diff(skin, axis=1), axis=2).mean(axis=0),
        )
        row = sparsity.row // depth
        graph = ColumnGraph.of(
            np.unique(row * columns.n_columns + sparsity.column // depth), columns.n_columns
        )
        self._order, colour_start = _by_colour(graph)
        graph, columns = graph.sorted(self._order), columns.renumbered(self._order)
        self._source = np.empty((graph.neighbour.size, 3, lanes(depth)), dtype=np.int32)
        find_blocks(
            sparsity.row_start, sparsity.column, self._order, np.argsort(self._order), graph.start,
            graph.neighbour, depth, self._source,
        )  # fmt: skip
        thinnest = np.linalg.norm(np.diff(nodes_mm[grid], axis=2), axis=3).min()
        widest = max(np.linalg.norm(np.diff(skin, axis=axis), axis=2).max() for axis in (0, 1))
        moves = np.zeros((len(nodes_mm), 3))
        moves.ravel()[free] = 1.0
        moving = to_columns(moves, self._order, depth)
        self._levels = [_Level(graph, colour_start, moving, depth)]
        self._transfers: list[Transfer] = []
        while (coarse := columns.coarser()) is not None:
            columns, chosen, parent, weight = coarse
            order, colour_start = _by_colour(Transfer.of(graph, parent, weight).graph)
            columns, parent = columns.renumbered(order), np.argsort(order)[parent]
            self._transfers.append(Transfer.of(graph, parent, weight))
            graph, moving = self._transfers[-1].graph, moving[chosen[order]]
            self._levels.append(_Level(graph, colour_start, moving, depth))
        for level in self._levels[:-1]:
            level.make_sweepable(rounds=bool(widest <= ROUNDED_ASPECT * thinnest))
        self._coarsest = moving[:, :, 1 : depth + 1] > 0.0
        number = np.full(self._coarsest.shape, -1, dtype=np.int64)
        number[self._coarsest] = np.arange(self._coarsest.sum())
        self._factor = SuperLuFactor(*graph.entries(number))

    @property
    def columns_of_levels(self) -> tuple[int, ...]:
        """Number of columns of each level, finest first."""
        return tuple(level.n_columns for level in self._levels)

    def follow(self, blocks: np.ndarray) -> None:
        """Take a new tangent, blocks (n_blocks, 3, 3), on the finest level; others stay as they are."""
        finest = self._levels[0]
        pairs = finest.graph.start, finest.graph.neighbour
        where = 0, finest.n_columns, self._source
        _share(take_blocks, *where, blocks, *pairs, finest.free, finest.matrix)
        if self._transfers:
            finest.prepare_sweeps()

    def renew(self, blocks: np.ndarray) -> None:
        """Take a new tangent on all levels."""
        self.follow(blocks)
        for n, transfer in enumerate(self._transfers):
            fine, coarse = self._levels[n], self._levels[n + 1]
            _share(
                _restrict, 0, len(coarse.matrix), transfer.part_start, transfer.part, transfer.part_weight,
                _rows(fine.matrix), _rows(coarse.matrix),
            )  # fmt: skip
            pairs = coarse.graph.start, coarse.graph.neighbour
            _share(_hold, 0, coarse.n_columns, *pairs, coarse.free, coarse.matrix)
            if coarse is not self._levels[-1]:
                coarse.prepare_sweeps()
        self._factor.renew(self._levels[-1].matrix)

    def enter(self, values: FloatArray) -> SingleArray:
        """Vector of this module, flat, of values of the free degrees of freedom (n_free,)."""
        nodal = np.zeros(3 * self._sparsity.n_nodes)
        nodal[self._free] = values
        return to_columns(nodal.reshape(-1, 3), self._order, self._depth).ravel()

    def leave(self, vector: SingleArray) -> FloatArray:
        """Values of the free degrees of freedom (n_free,) of a flat vector."""
        columns = vector.reshape(self._levels[0].x.shape)
        return to_nodes(columns, self._order, self._depth).ravel()[self._free]

    def multiply(self, direction: SingleArray) -> SingleArray:
        """Product of the tangent last taken and a flat vector."""
        finest = self._levels[0]
        product, x = np.zeros_like(finest.x), direction.reshape(finest.x.shape)
        pairs = finest.graph.start, finest.graph.neighbour
        _share(multiply, 0, finest.n_columns, *pairs, finest.matrix, x, product)
        return product.ravel()

    def apply(self, residual: SingleArray) -> SingleArray:
        """Approximate solution for a residual, both flat."""
        finest = self._levels[0]
        np.multiply(finest.shrink, residual.reshape(finest.x.shape), out=finest.right)
        self._cycle(0)
        return (finest.shrink * finest.x).ravel()

    def _cycle(self, n: int) -> None:
        """Solve approximately for `right` of level n, into its `x`."""
        level = self._levels[n]
        if n == len(self._transfers):
            inner = level.x[:, :, 1 : self._depth + 1]
            right = level.right[:, :, 1 : self._depth + 1][self._coarsest]
            inner[self._coarsest] = self._factor.solve(right)
            return
        coarse, transfer = self._levels[n + 1], self._transfers[n]
        level.sweep_forward()
        _share(
            _restrict, 0, coarse.n_columns, transfer.child_start, transfer.child, transfer.child_weight,
            _rows(level.residual), _rows(coarse.right),
        )  # fmt: skip
        coarse.right *= coarse.shrink
        self._cycle(n + 1)
        coarse.x *= coarse.shrink
        _share(
            _add_prolonged, 0, level.n_columns, transfer.parent, transfer.weight, _rows(coarse.x),
            _rows(level.scale), _rows(level.x),
        )  # fmt: skip
        level.sweep_backward()


def _rows(values: SingleArray) -> SingleArray:
    """Return the same numbers with one axis for all that belongs to a column or a pair."""
    return values.reshape(len(values), -1)
