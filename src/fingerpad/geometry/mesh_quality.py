"""Quality of the elements of a mesh (Jacobians, volumes, shape), and rigid motions of its nodes."""

from __future__ import annotations

from dataclasses import replace

import numpy as np

from fingerpad.core.checks import FloatArray, IntArray
from fingerpad.geometry.mesh import CORNERS, LAYERS, Mesh


def _jacobians(mesh: Mesh, elements: IntArray, points: FloatArray) -> FloatArray:
    """Jacobian matrices (n_elements, n_points, 3, 3), columns along the local axes, at local `points`."""
    factors = 1.0 + points[:, None, :] * CORNERS
    gradients = np.stack(
        [CORNERS[:, axis] * np.delete(factors, axis, axis=2).prod(axis=2) / 8.0 for axis in range(3)], axis=-1
    )
    return np.einsum("mad,qac->mqdc", mesh.nodes_mm[elements], gradients, optimize=True)


def jacobian_at_gauss(mesh: Mesh) -> FloatArray:
    """Compute the Jacobian determinant at the 2 x 2 x 2 Gauss points, (n_elements, 8) [mm³].

    An element's volume is the sum of its row.
    """
    return np.linalg.det(_jacobians(mesh, mesh.elements, CORNERS / np.sqrt(3.0)))


def scaled_jacobian(mesh: Mesh) -> FloatArray:
    """Smallest Jacobian of each element over the product of its edges' lengths, (n_elements,); 1 is a box.

    Bricks are evaluated at their corners. Wedges have no Jacobian at the collapsed side and are evaluated at
    the Gauss points.
    """
    wedge = (np.diff(np.sort(mesh.elements, axis=1), axis=1) == 0).any(axis=1)
    quality = np.empty(len(mesh.elements))
    for chosen, points in ((~wedge, CORNERS), (wedge, CORNERS / np.sqrt(3.0))):
        jacobian = _jacobians(mesh, mesh.elements[chosen], points)
        scaled = np.linalg.det(jacobian) / np.linalg.norm(jacobian, axis=2).prod(axis=2)
        quality[chosen] = scaled.min(axis=1, initial=1.0)
    return quality


def element_place(mesh: Mesh, element: int) -> str:
    layer = int(mesh.layer[element])
    name = LAYERS[layer] if 0 <= layer < len(LAYERS) else f"layer {layer}"
    x, y, z = mesh.nodes_mm[mesh.elements[element]].mean(axis=0)
    return f"element {element} ({name}, about x = {x:.3g}, y = {y:.3g}, z = {z:.3g} mm)"


def squeezed_most(mesh: Mesh, displacement_mm: FloatArray) -> tuple[int, float]:
    """Find the element with the smallest ratio of present to undeformed volume."""
    deformed = replace(mesh, nodes_mm=mesh.nodes_mm + displacement_mm)
    ratio = (jacobian_at_gauss(deformed) / jacobian_at_gauss(mesh)).min(axis=1)
    element = int(ratio.argmin())
    return element, float(ratio[element])


def rigid_motions(nodes_mm: FloatArray) -> FloatArray:
    """Three translations and three rotations of the nodes about their middle."""
    centred = nodes_mm - nodes_mm.mean(axis=0)
    x, y, z = (centred / (np.ptp(nodes_mm, axis=0).max() or 1.0)).T
    zero, one = np.zeros_like(x), np.ones_like(x)
    translations = [(one, zero, zero), (zero, one, zero), (zero, zero, one)]
    rotations = [(-y, x, zero), (zero, -z, y), (z, zero, -x)]
    return np.stack([np.stack(motion, axis=1) for motion in translations + rotations], axis=2)
