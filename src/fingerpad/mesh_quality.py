"""How good the bricks of a mesh are: Jacobians, volumes and shape."""

from __future__ import annotations

import numpy as np

from fingerpad.checks import FloatArray
from fingerpad.mesh import CORNERS, IntArray, Mesh


def _jacobians(mesh: Mesh, elements: IntArray, points: FloatArray) -> FloatArray:
    """Jacobian matrices (n_elements, n_points, 3, 3), columns along the local axes, at local `points`."""
    factors = 1.0 + points[:, None, :] * CORNERS
    gradients = np.stack(
        [CORNERS[:, axis] * np.delete(factors, axis, axis=2).prod(axis=2) / 8.0 for axis in range(3)],
        axis=-1,
    )
    return np.einsum("mad,qac->mqdc", mesh.nodes_mm[elements], gradients, optimize=True)


def jacobian_at_gauss(mesh: Mesh) -> FloatArray:
    """Compute the Jacobian determinant at the 2 x 2 x 2 Gauss points, (n_elements, 8) [mm³].

    An element's volume is the sum of its row.
    """
    return np.linalg.det(_jacobians(mesh, mesh.elements, CORNERS / np.sqrt(3.0)))


def scaled_jacobian(mesh: Mesh) -> FloatArray:
    """Smallest Jacobian of each element over the product of its edges' lengths, (n_elements,); 1 is a box.

    Bricks are judged at their corners; wedges, whose collapsed side has none, at the Gauss points.
    """
    wedge = (np.diff(np.sort(mesh.elements, axis=1), axis=1) == 0).any(axis=1)
    quality = np.empty(len(mesh.elements))
    for chosen, points in ((~wedge, CORNERS), (wedge, CORNERS / np.sqrt(3.0))):
        jacobian = _jacobians(mesh, mesh.elements[chosen], points)
        scaled = np.linalg.det(jacobian) / np.linalg.norm(jacobian, axis=2).prod(axis=2)
        quality[chosen] = scaled.min(axis=1, initial=1.0)
    return quality
