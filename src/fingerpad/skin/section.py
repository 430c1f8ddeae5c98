"""The deformed middle plane of the finger: the faces of its elements at z = 0, and their outlines."""

from __future__ import annotations

from dataclasses import dataclass
from functools import cached_property

import numpy as np
from scipy.sparse import csr_matrix
from scipy.spatial import cKDTree

from fingerpad.core.errors import InputError
from fingerpad.core.values import FloatArray, IntArray
from fingerpad.data.afferents import PC_REACH
from fingerpad.geometry.mesh import Mesh

SURFACE_QUANTITIES = ("skin_displacement", "deep_displacement", "skin_stretch")
"""Quantities of the surface by the names under which receptors sample them."""


@dataclass(frozen=True)
class SurfaceMotion:
    """How the faces of the skin move and deform: arrays (n_times, n_faces), never negative."""

    mesh: Mesh
    displacement_mm: FloatArray  #: Displacement of `mesh.skin_nodes`, (n_times, n_skin_nodes, 3). [mm]

    @cached_property
    def skin_displacement(self) -> FloatArray:
        """How far each face has moved, the length of its mean displacement. [mm]"""
        return np.linalg.norm(self._corners(self.displacement_mm).mean(axis=0), axis=-1)

    @cached_property
    def deep_displacement(self) -> FloatArray:
        """Mean of `skin_displacement` over the skin within `PC_REACH`. [mm]

        A corpuscle deep in the tissue moves with the skin above it, about as far around as it lies deep.
        """
        return np.asarray(self.skin_displacement @ self._shares_within_reach())

    @cached_property
    def skin_stretch(self) -> FloatArray:
        """Largest tensile strain within the surface at the middle of each face, logarithmic. [1]

        With the edges A, B of the undeformed face and a, b of the deformed one, the metrics are
        G = (A·A, A·B, B·B) and g = (a·a, a·b, b·b). The squares of the principal stretches are the
        eigenvalues of G⁻¹ g, and the strain is ln of the largest stretch, or 0 where nothing is stretched.
        """
        undeformed = self.mesh.nodes_mm[self.mesh.skin_nodes]
        before = _metric(self._corners(undeformed))
        after = _metric(self._corners(undeformed + self.displacement_mm))
        determinant = _determinant(before)
        trace = (before[2] * after[0] - 2.0 * before[1] * after[1] + before[0] * after[2]) / determinant
        product = _determinant(after) / determinant
        largest = 0.5 * trace + np.sqrt(np.maximum(0.25 * trace**2 - product, 0.0))
        return np.maximum(0.5 * np.log(largest), 0.0)

    def below(self, quantity: str) -> FloatArray:
        """One of `SURFACE_QUANTITIES` above each of `mesh.living_epidermis`, (n_times, n_elements).

        In a grid every such element has a face above it; in a mesh of one's own the nearest one is taken.
        """
        values: FloatArray = getattr(self, quantity)
        if self.mesh.is_grid:
            return values
        elements = self.mesh.nodes_mm[self.mesh.elements[self.mesh.living_epidermis.ravel()]].mean(axis=1)
        faces = self._corners(self.mesh.nodes_mm[self.mesh.skin_nodes]).mean(axis=0)
        return values[:, cKDTree(faces).query(elements)[1]]

    def _corners(self, values: FloatArray) -> FloatArray:
        """Values (..., n_skin_nodes, 3) at the four corners of every face, (4, ..., n_faces, 3)."""
        rows = np.searchsorted(self.mesh.skin_nodes, self.mesh.skin_faces)
        return np.stack([values[..., corner, :] for corner in rows.T])

    def _shares_within_reach(self) -> csr_matrix:
        """Share of each face in the mean about each face, (n_faces, n_faces), a column per mean."""
        # Half of a finger is completed by its mirror image.
        corners = self._corners(self.mesh.nodes_mm[self.mesh.skin_nodes])
        middles, areas = corners.mean(axis=0), np.sqrt(_determinant(_metric(corners)))
        weights = csr_matrix((len(middles), len(middles)))
        for side in (1.0,) if self.mesh.full else (1.0, -1.0):
            near = cKDTree(middles).query_ball_point(middles * [1.0, 1.0, side], PC_REACH.value)
            rows = np.concatenate([np.array(each, dtype=np.int64) for each in near])
            columns = np.repeat(np.arange(len(near)), [len(each) for each in near])
            weights += csr_matrix((areas[rows], (rows, columns)), shape=weights.shape)
        return csr_matrix(weights.multiply(1.0 / weights.sum(axis=0)))


def _metric(corners: FloatArray) -> FloatArray:
    """A·A, A·B and B·B of the edges through the middle of every face, (3, ..., n_faces)."""
    along = corners[1] + corners[2] - corners[0] - corners[3]
    around = corners[2] + corners[3] - corners[0] - corners[1]
    return np.stack([(along**2).sum(-1), (along * around).sum(-1), (around**2).sum(-1)])


def _determinant(metric: FloatArray) -> FloatArray:
    return metric[0] * metric[2] - metric[1] ** 2


_FACES = ((0, 1, 5, 4), (3, 2, 6, 7))
"""Corners of the two faces of an element of a grid that look across the finger."""

_OTHER_FACES = ((0, 3, 2, 1), (4, 5, 6, 7), (1, 2, 6, 5), (3, 0, 4, 7))

_ON_PLANE_MM = 1e-9


@dataclass(frozen=True)
class Section:
    """Faces of elements on the plane z = 0, as they lie after the deformation."""

    corners_mm: FloatArray  #: x and y of the corners, in order around each face, (n_faces, 4, 2). [mm]
    elements: IntArray  #: The element of each face, (n_faces,).
    skin_mm: FloatArray
    nail_mm: FloatArray
    bone_mm: FloatArray
    """Ends of each edge of the outline on free skin, under the nail and on the bone, (n_edges, 2, 2). [mm]"""


def middle_section(mesh: Mesh, displacement_mm: FloatArray) -> Section:
    """Cut a finger along its plane of symmetry."""
    on_plane = np.abs(mesh.nodes_mm[:, 2]) < _ON_PLANE_MM
    moved = (mesh.nodes_mm + displacement_mm)[:, :2]
    faces, elements = [], []
    for corners in _FACES if mesh.is_grid else _FACES + _OTHER_FACES:
        nodes = mesh.elements[:, corners]
        # Elements at the pole are wedges: there a face may shrink to an edge.
        chosen = np.flatnonzero(on_plane[nodes].all(axis=1) & (np.ptp(nodes, axis=1) > 0))
        faces.append(nodes[chosen])
        elements.append(chosen)
    nodes = np.concatenate(faces)
    if not (len(nodes) or mesh.is_grid):
        nodes, cut = _next_to_plane(mesh)
        elements = [cut]
    if not len(nodes):
        raise InputError("mesh", "must have elements with a face on the plane z = 0", remedy="it has none")
    edges = np.unique(np.sort(np.stack([nodes, np.roll(nodes, -1, axis=1)], axis=-1).reshape(-1, 2)), axis=0)
    on_nail, on_bone = (np.isin(edges, fixed).all(axis=1) for fixed in (mesh.nail_nodes, mesh.bone_nodes))
    on_skin = np.isin(edges, mesh.skin_nodes).all(axis=1) & ~on_nail
    return Section(
        moved[nodes],
        np.concatenate(elements),
        *(moved[edges[chosen]] for chosen in (on_skin, on_nail, on_bone)),
    )


def _next_to_plane(mesh: Mesh) -> tuple[IntArray, IntArray]:
    """Faces next to the plane of the elements that it cuts, and these elements."""
    z = mesh.nodes_mm[mesh.elements, 2]
    cut = np.flatnonzero((z.min(axis=1) < 0.0) & (z.max(axis=1) > 0.0))
    faces = mesh.elements[cut][:, np.array(_FACES + _OTHER_FACES)]
    # The face that the plane nearly holds: its corners lie nearest to it.
    nearest = np.abs(mesh.nodes_mm[faces, 2]).max(axis=2).argmin(axis=1)
    return faces[np.arange(cut.size), nearest], cut
