"""Sums over all elements: sparsity in 3x3 blocks, energy, residual and tangent.

Two elements that share a node add to the same numbers. So elements are added up in chunks of consecutive
numbers, and the chunks are coloured: no two chunks of one colour share a node. Colours are done one after the
other, the chunks of one colour at the same time on several threads. The order in which elements add to a node
depends on chunks and colours, and these on the mesh alone.
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from numba import njit
from scipy import sparse

from fingerpad.core.numba_internals import small_array
from fingerpad.core.threads import Chunk, even_chunks, in_chunks
from fingerpad.core.values import FloatArray
from fingerpad.geometry.mesh import Mesh
from fingerpad.mechanics.element import N_COLUMNS, N_NODES, add_tangent, element_system, take_nodes
from fingerpad.mechanics.materials import has_formulas


@dataclass(frozen=True)
class Sparsity:
    """Block pattern of the tangent, where each element adds to it, and which may add at the same time."""

    row_start: np.ndarray  # First block of every block row, (n_nodes + 1,).
    column: np.ndarray  # Block column, increasing within a row, (n_blocks,).
    position: np.ndarray  # Block to which a pair of element nodes adds, (n_elements, 8, 8).
    diagonal: np.ndarray  # Block of each node with itself, (n_nodes,).
    colours: list[list[Chunk]]
    """Chunks of elements that threads may add up at the same time, see `coloured_chunks`."""

    @classmethod
    def of(cls, elements: np.ndarray, n_nodes: int) -> Sparsity:
        shape, corners = (len(elements), n_nodes), elements.ravel()
        has = sparse.csr_matrix(
            (np.ones(corners.size, dtype=bool), corners, np.arange(0, corners.size + 1, N_NODES)), shape=shape
        )
        shared = has.T.tocsr() @ has  # pairs of nodes that have an element in common
        shared.sort_indices()
        row_start, column = shared.indptr.astype(np.int32), shared.indices.astype(np.int32)
        position = np.empty((len(elements), N_NODES, N_NODES), dtype=np.int32)
        _find_positions(elements, row_start, column, position)
        diagonal = np.flatnonzero(np.repeat(np.arange(n_nodes), np.diff(row_start)) == column)
        return cls(row_start, column, position, diagonal, coloured_chunks(elements, n_nodes))

    @property
    def n_nodes(self) -> int:
        """Number of nodes, which is that of block rows."""
        return len(self.row_start) - 1

    @property
    def row(self) -> np.ndarray:
        return np.repeat(np.arange(self.n_nodes), np.diff(self.row_start))

    def blocks_of(self, rows: np.ndarray, columns: np.ndarray) -> np.ndarray:
        """Block of each pair of nodes that share an element; both broadcast against each other."""
        return np.searchsorted(self.row * self.n_nodes + self.column, rows * self.n_nodes + columns)

    def entries(self, free: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
        """Row and column of every entry (n_blocks, 3, 3) among the free degrees of freedom, -1 if held."""
        number = np.full((self.n_nodes, 3), -1, dtype=np.int32)
        number.ravel()[free] = np.arange(free.size)
        rows, columns = number[self.row][:, :, None], number[self.column][:, None]
        shape = (self.column.size, 3, 3)
        return np.broadcast_to(rows, shape), np.broadcast_to(columns, shape)

    def matrix(self, blocks: FloatArray) -> sparse.bsr_matrix:
        """Tangent as a block matrix that shares `blocks` (n_blocks, 3, 3)."""
        size = 3 * self.n_nodes
        return sparse.bsr_matrix((blocks, self.column, self.row_start), shape=(size, size), copy=False)


def coloured_chunks(elements: np.ndarray, n_nodes: int) -> list[list[Chunk]]:
    """Chunks of a mesh by colour, each in the first colour that is free."""
    colours: list[list[Chunk]] = []
    taken: list[np.ndarray] = []  # for each colour, whether one of its chunks has a node
    for first, last in even_chunks(len(elements)):
        nodes = elements[first:last]
        free = (colour for colour, has in enumerate(taken) if not has[nodes].any())
        colour = next(free, len(colours))
        if colour == len(colours):
            colours.append([])
            taken.append(np.zeros(n_nodes, dtype=bool))
        colours[colour].append((first, last))
        taken[colour][nodes] = True
    return colours


@njit(cache=True)
def _find_positions(elements, row_start, column, position):  # type: ignore[no-untyped-def]
    """Write the block to which every pair of nodes of every element adds."""
    for e in range(elements.shape[0]):
        for a in range(N_NODES):
            for b in range(N_NODES):
                block = row_start[elements[e, a]]
                while column[block] != elements[e, b]:
                    block += 1
                position[e, a, b] = block


def assemble(
    mesh: Mesh,
    displacement: FloatArray,
    law: FloatArray,
    s: FloatArray,
    history: FloatArray,
    sparsity: Sparsity,
    with_tangent: bool,
    force: FloatArray,
    blocks: np.ndarray,
) -> float:
    """Add up all elements, on as many threads as Numba is set to; the result does not depend on it."""

    def clear(first: int, last: int) -> None:
        blocks[first:last] = 0.0

    def add(first: int, last: int) -> float:
        return _add_chunk(
            mesh.nodes_mm, mesh.elements, displacement, mesh.layer, law, s, history, sparsity.position,
            with_tangent, force, blocks, formulas, first, last,
        )  # fmt: skip

    formulas = has_formulas(law)
    force[:] = 0.0
    if with_tangent:
        in_chunks(clear, even_chunks(len(blocks)))
    return sum(potential for chunks in sparsity.colours for potential in in_chunks(add, chunks))


@njit(cache=True, nogil=True)
def _add_chunk(  # type: ignore[no-untyped-def]
    nodes, elements, displacement, layer, law, s, history, position, with_tangent,
    force, blocks, formulas, first, last,
):  # fmt: skip
    """Add elements from `first` up to `last` and return their potential; stop at one that is inside out."""
    element_force, element_tangent = small_array((N_NODES, 3)), small_array((N_NODES, N_COLUMNS))
    reference, moved = small_array((N_NODES, 3)), small_array((N_NODES, 3))
    potential = 0.0
    for e in range(first, last):
        take_nodes(nodes, elements[e], reference)
        take_nodes(displacement, elements[e], moved)
        material = layer[e]
        potential += element_system(
            reference, moved, law[material], s[material], history[e], with_tangent,
            element_force, element_tangent, formulas,
        )  # fmt: skip
        if np.isnan(potential):
            return potential
        for a in range(N_NODES):
            for i in range(3):
                force[elements[e, a], i] += element_force[a, i]
        if with_tangent:
            add_tangent(element_tangent, position[e], blocks)
    return potential
