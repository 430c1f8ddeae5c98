"""Points between the nodes of the skin at which contact is found as well.

Skin is stretched under a small ball and at a rim, where its nodes end up further apart than the body is wide.
If contact acted at nodes alone, a facet between them could cut through the body, and each node that leaves
it would release energy: skin would seem to slide off. So the middles of facets and of their edges are pushed
out of the body too. A middle may lie within the body by the sag of a chord that is as long as the radius,
which facets that follow a round body have by themselves.
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from fingerpad.core.checks import FloatArray, IntArray
from fingerpad.geometry.mesh import Mesh
from fingerpad.mechanics.assembly import Sparsity

N_CORNERS = 4


@dataclass(frozen=True)
class Middles:
    """Middles of facets of the skin and of the edges of facets."""

    corners: IntArray
    """Nodes whose mean a middle is: those of a facet, or both ends of an edge twice, (n, 4)."""
    blocks: IntArray
    """Block of the tangent of each pair of these nodes, (n, 4, 4)."""
    area_mm2: FloatArray
    """Undeformed area that belongs to each middle, (n,). [mm²]"""
    sag_mm: float
    """How deep a middle lies within the indenter before it is pushed out. [mm]"""

    @classmethod
    def none(cls) -> Middles:
        shape = (0, N_CORNERS)
        return cls(np.empty(shape, np.int64), np.empty((*shape, N_CORNERS), np.int64), np.empty(0), 0.0)

    @classmethod
    def of(cls, mesh: Mesh, sparsity: Sparsity, nodes: IntArray, sag_mm: float) -> Middles:
        """Middles of all facets, and of their edges, whose corners are among `nodes`."""
        facets = mesh.skin_faces[np.isin(mesh.skin_faces, nodes).all(axis=1)]
        first, second, third, fourth = np.moveaxis(mesh.nodes_mm[facets], 1, 0)
        area_mm2 = 0.5 * np.linalg.norm(np.cross(third - first, fourth - second), axis=1)
        ends = np.stack([facets, np.roll(facets, -1, axis=1)], axis=-1).reshape(-1, 2)
        edges, edge = np.unique(np.sort(ends, axis=1), axis=0, return_inverse=True)
        edge_mm2 = 0.5 * np.bincount(edge.ravel(), np.repeat(area_mm2, N_CORNERS), len(edges))
        is_edge = edges[:, 0] != edges[:, 1]  # a triangle repeats a corner
        corners = np.concatenate([facets, np.tile(edges[is_edge], 2)])
        blocks = sparsity.blocks_of(corners[:, :, None], corners[:, None, :])
        return cls(corners, blocks, np.concatenate([area_mm2, edge_mm2[is_edge]]), sag_mm)

    def add_to_nodes(self, at_nodes: FloatArray, at_middles: FloatArray) -> None:
        """Add a quarter of each value (n, ...) to each corner's value (n_nodes, ...)."""
        np.add.at(at_nodes, self.corners, at_middles[:, None] / N_CORNERS)

    def add_to_tangent(self, tangent: np.ndarray, stiffness: FloatArray) -> None:
        """Add stiffnesses (n, 3, 3) to the blocks (n_blocks, 3, 3) of all pairs of corners."""
        stiff = np.flatnonzero(stiffness.any(axis=(1, 2)))
        share = (stiffness[stiff] / N_CORNERS**2).astype(tangent.dtype)
        np.add.at(tangent, self.blocks[stiff], share[:, None, None])
