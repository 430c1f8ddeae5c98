"""Motion of the skin's surface as a quantity that receptors sample: displacement and stretch.

Both follow from the stored displacement of the skin, face by face of its grid. The faces are those above the
elements of the living epidermis, so that receptors read them like any other quantity.
"""

from __future__ import annotations

from collections.abc import Callable

import numpy as np

from fingerpad.core.checks import FloatArray
from fingerpad.geometry.mesh import Mesh


def skin_displacement_mm(mesh: Mesh, displacement_mm: FloatArray) -> FloatArray:
    """Distance by which each face of the skin has moved, the length of its mean displacement.

    Parameters
    ----------
    mesh : Mesh
        The undeformed body.
    displacement_mm : array (n_times, n_skin_nodes, 3)
        Displacement of `mesh.skin_nodes`. [mm]

    Returns
    -------
    array (n_times, n_faces)
        Never negative. [mm]
    """
    return np.linalg.norm(_corners(mesh, displacement_mm).mean(axis=0), axis=-1)


def skin_stretch(mesh: Mesh, displacement_mm: FloatArray) -> FloatArray:
    """Largest tensile strain within the surface at the middle of each face.

    With the edges A, B of the undeformed face and a, b of the deformed one, the metrics are
    G = (A·A, A·B, B·B) and g = (a·a, a·b, b·b). The squares of the principal stretches are the eigenvalues of
    G⁻¹ g, and the strain is ln of the largest stretch, or 0 where nothing is stretched.

    Parameters
    ----------
    mesh, displacement_mm
        As in `skin_displacement_mm`.

    Returns
    -------
    array (n_times, n_faces)
        Logarithmic strain, never negative. [1]
    """
    before = _metric(_corners(mesh, mesh.nodes_mm[mesh.skin_nodes]))
    after = _metric(_corners(mesh, mesh.nodes_mm[mesh.skin_nodes] + displacement_mm))
    determinant = _determinant(before)
    trace = (before[2] * after[0] - 2.0 * before[1] * after[1] + before[0] * after[2]) / determinant
    product = _determinant(after) / determinant
    largest = 0.5 * trace + np.sqrt(np.maximum(0.25 * trace**2 - product, 0.0))
    return np.maximum(0.5 * np.log(largest), 0.0)


SURFACE_QUANTITIES: dict[str, Callable[[Mesh, FloatArray], FloatArray]] = {
    "skin_displacement": skin_displacement_mm,
    "skin_stretch": skin_stretch,
}
"""Quantities of the surface by the names under which receptors sample them."""


def _corners(mesh: Mesh, values: FloatArray) -> FloatArray:
    """Values (..., n_skin_nodes, 3) at the four corners of every face, (4, ..., n_faces, 3)."""
    rows = np.searchsorted(mesh.skin_nodes, mesh.skin_grid)
    corners = rows[:-1, :-1], rows[1:, :-1], rows[1:, 1:], rows[:-1, 1:]
    return np.stack([values[..., corner.ravel(), :] for corner in corners])


def _metric(corners: FloatArray) -> FloatArray:
    """A·A, A·B and B·B of the edges through the middle of every face, (3, ..., n_faces)."""
    along = corners[1] + corners[2] - corners[0] - corners[3]
    around = corners[2] + corners[3] - corners[0] - corners[1]
    return np.stack([(along**2).sum(-1), (along * around).sum(-1), (around**2).sum(-1)])


def _determinant(metric: FloatArray) -> FloatArray:
    return metric[0] * metric[2] - metric[1] ** 2
