"""All elements together: sparsity of 3x3 blocks, energy, residual and tangent."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from numba import njit
from scipy import sparse

from fingerpad.checks import FloatArray
from fingerpad.mechanics.element import N_NODES, element_system


@dataclass(frozen=True)
class Sparsity:
    """Block pattern of the tangent and where each element adds to it.

    Parameters
    ----------
    row_start : int array (n_nodes + 1,)
        First block of every block row.
    column : int array (n_blocks,)
        Block column, increasing within a row.
    position : int array (n_elements, 8, 8)
        Block to which a pair of element nodes adds.
    diagonal : int array (n_nodes,)
        Block of each node with itself.
    """

    row_start: np.ndarray
    column: np.ndarray
    position: np.ndarray
    diagonal: np.ndarray

    @classmethod
    def of(cls, elements: np.ndarray, n_nodes: int) -> Sparsity:
        """Pattern of a mesh of `elements` (n_elements, 8)."""
        keys = (elements[:, :, None] * n_nodes + elements[:, None, :]).ravel()
        blocks, position = np.unique(keys, return_inverse=True)
        row, column = np.divmod(blocks, n_nodes)
        row_start = np.searchsorted(row, np.arange(n_nodes + 1))
        return cls(
            row_start.astype(np.int32),
            column.astype(np.int32),
            position.reshape(-1, N_NODES, N_NODES).astype(np.int64),
            np.flatnonzero(row == column),
        )

    def matrix(self, blocks: FloatArray) -> sparse.bsr_matrix:
        """Tangent as a block matrix that shares `blocks` (n_blocks, 3, 3)."""
        size = 3 * (len(self.row_start) - 1)
        return sparse.bsr_matrix((blocks, self.column, self.row_start), shape=(size, size), copy=False)


@njit(cache=True)
def assemble(nodes, elements, displacement, layer, law, s, history, position, with_tangent, force, blocks):  # type: ignore[no-untyped-def]
    """Add up all elements.

    Parameters
    ----------
    nodes, displacement : array (n_nodes, 3)
        Reference nodes and displacements. [mm]
    elements, layer : int array (n_elements, 8), (n_elements,)
        Connectivity and row of the material table.
    law : array (n_layers, 8)
        `MaterialTable.law`.
    s : array (n_layers,)
        `StepCoefficients.s`.
    history : array (n_elements, 8, 6)
        H of the step. [kPa]
    position : int array (n_elements, 8, 8)
        `Sparsity.position`.
    with_tangent : bool
        Whether `blocks` is written.
    force : array (n_nodes, 3)
        Overwritten with the internal force. [mN]
    blocks : array (n_blocks, 3, 3)
        Overwritten with the tangent if wanted. [mN/mm]

    Returns
    -------
    float
        Incremental potential; NaN if an element is turned inside out. [µJ]
    """
    force[:] = 0.0
    if with_tangent:
        blocks[:] = 0.0
    element_force, element_tangent = np.empty((8, 3)), np.empty((8, 8, 3, 3))
    reference, moved = np.empty((8, 3)), np.empty((8, 3))
    potential = 0.0
    for e in range(elements.shape[0]):
        for a in range(8):
            for i in range(3):
                reference[a, i] = nodes[elements[e, a], i]
                moved[a, i] = displacement[elements[e, a], i]
        material = layer[e]
        potential += element_system(
            reference, moved, law[material], s[material], history[e], with_tangent,
            element_force, element_tangent,
        )  # fmt: skip
        if np.isnan(potential):
            return potential
        for a in range(8):
            for i in range(3):
                force[elements[e, a], i] += element_force[a, i]
            if with_tangent:
                for b in range(8):
                    target = position[e, a, b]
                    for i in range(3):
                        for j in range(3):
                            blocks[target, i, j] += element_tangent[a, b, i, j]
    return potential
