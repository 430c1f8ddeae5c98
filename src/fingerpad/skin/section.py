"""The deformed middle plane of the finger: the faces of its elements at z = 0, and their outlines."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from fingerpad.core.checks import FloatArray, IntArray
from fingerpad.core.errors import InputError
from fingerpad.geometry.mesh import Mesh

_FACES = ((0, 1, 5, 4), (3, 2, 6, 7))
"""Corners of the two faces of an element of a grid that look across the finger."""

_OTHER_FACES = ((0, 3, 2, 1), (4, 5, 6, 7), (1, 2, 6, 5), (3, 0, 4, 7))

_ON_PLANE_MM = 1e-9


@dataclass(frozen=True)
class Section:
    """Faces of elements on the plane z = 0, as they lie after the deformation."""

    corners_mm: FloatArray  # x and y of the corners, in order around each face, (n_faces, 4, 2). [mm]
    elements: IntArray  # The element of each face, (n_faces,).
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
