"""Pressure of the indenter on the skin and the area that it touches.

Contact is found at nodes, so the edge of the contact lies somewhere between a node that is pressed and one
that is not. Between the two it is placed by the law of a smooth edge on an elastic half-space (Johnson 1985,
ch. 5.1): at a distance d from the edge the pressure inside and the gap outside are

    p = C sqrt(d),     g = 4 C / (3 E*) d^(3/2),     E* = E / (1 - nu²).

A node with pressure p and another with gap g at a distance l from it then leave the share t of that distance
to the contact for which (1 - t)^3 = s² t, s = 3 E* g / (4 p l). It is 0 as long as p is 0 and 1 as soon as g
is, so that the area grows without steps.
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from fingerpad.core.checks import FloatArray
from fingerpad.geometry.mesh import Mesh

LARGEST_RATIO = 1e6
"""Largest s; the contact ends within 1e-12 of the distance there."""

SHARE_BESIDE = 0.5
"""Share of the distance to a node that the indenter cannot touch: half, as in a node's tributary area."""


@dataclass(frozen=True)
class SkinContact:
    """Where and how hard the indenter presses, over time."""

    pressure_kpa: FloatArray
    """Normal force on each node of `mesh.skin_nodes` over the present area that belongs to it, (n_times,
    n_skin_nodes). [kPa]
    """
    shear_kpa: FloatArray
    """Friction on each node over that area, (n_times, n_skin_nodes, 3). [kPa]"""
    slip_mm: FloatArray
    """How far each node in contact has slid over the indenter since it came to touch, with friction,
    (n_times, n_skin_nodes). [mm]
    """
    area_mm2: FloatArray
    present_area_mm2: FloatArray
    """Skin in contact, undeformed and as it is then; of the whole body also when half of it is solved,
    (n_times,). [mm²]
    """


def skin_contact(
    mesh: Mesh,
    displacement_mm: FloatArray,
    pressed_mn: FloatArray,
    friction_mn: FloatArray,
    slip_mm: FloatArray,
    gap_mm: FloatArray,
    modulus_kpa: float,
) -> SkinContact:
    """Pressure, shear, slip and area from the forces on each node of the skin and its gap."""
    whole_body = 2.0 if mesh.symmetry_nodes.size else 1.0
    triangles = _triangles(mesh)
    undeformed_mm2 = _areas(mesh.nodes_mm[mesh.skin_nodes], triangles)
    pressure, areas = np.empty_like(pressed_mn), np.empty((2, len(pressed_mn)))
    shear = np.empty_like(friction_mn)
    for n, moved in enumerate(displacement_mm):
        present = mesh.nodes_mm + moved
        node_mm2 = mesh.skin_area_of(present)
        pressure[n], shear[n] = pressed_mn[n] / node_mm2, friction_mn[n] / node_mm2[:, None]
        skin = present[mesh.skin_nodes]
        touching = covered(skin, triangles, pressure[n], gap_mm[n], modulus_kpa)
        areas[:, n] = undeformed_mm2 @ touching, _areas(skin, triangles) @ touching
    return SkinContact(pressure, shear, slip_mm, *(whole_body * areas))


def covered(
    skin_mm: FloatArray,
    triangles: np.ndarray,
    pressure_kpa: FloatArray,
    gap_mm: FloatArray,
    modulus_kpa: float,
) -> FloatArray:
    """Share of each triangle of skin that is in contact."""
    share = np.zeros(len(triangles))
    is_pressed = pressure_kpa > 0.0
    pressed_corners = is_pressed[triangles].sum(axis=1)
    share[pressed_corners == 3] = 1.0
    for count in (1, 2):
        chosen = np.flatnonzero(pressed_corners == count)
        # The corner that differs from the two others, then these.
        odd = (is_pressed[triangles[chosen]] == (count == 1)).argmax(axis=1)
        corner, *others = (triangles[chosen, (odd + turn) % 3] for turn in range(3))
        pairs = [(corner, other) if count == 1 else (other, corner) for other in others]
        one, two = (_share_of_way(skin_mm, *pair, pressure_kpa, gap_mm, modulus_kpa) for pair in pairs)
        share[chosen] = one * two if count == 1 else 1.0 - (1.0 - one) * (1.0 - two)
    return share


def _share_of_way(
    skin_mm: FloatArray,
    pressed: np.ndarray,
    free: np.ndarray,
    pressure_kpa: FloatArray,
    gap_mm: FloatArray,
    modulus_kpa: float,
) -> FloatArray:
    """Share t of the way from pressed to free nodes that is in contact: root of (1 - t)³ = s² t."""
    length_mm = np.linalg.norm(skin_mm[free] - skin_mm[pressed], axis=1)
    s = np.minimum(0.75 * modulus_kpa * gap_mm[free] / (pressure_kpa[pressed] * length_mm), LARGEST_RATIO)
    s = np.maximum(s, 1.0 / LARGEST_RATIO)
    left = 2.0 / np.sqrt(3.0) * s * np.sinh(np.arcsinh(1.5 * np.sqrt(3.0) / s) / 3.0)
    return np.where(np.isfinite(gap_mm[free]), 1.0 - left, SHARE_BESIDE)


def _triangles(mesh: Mesh) -> np.ndarray:
    """Each face of the skin cut along one diagonal and along the other, as rows of `mesh.skin_nodes`."""
    a, b, c, d = np.searchsorted(mesh.skin_nodes, mesh.skin_faces).T
    return np.concatenate([np.stack(cut, axis=1) for cut in ((a, b, c), (a, c, d), (a, b, d), (b, c, d))])


def _areas(skin_mm: FloatArray, triangles: np.ndarray) -> FloatArray:
    """Area of each triangle, half of it, since every face is cut twice. [mm²]"""
    a, b, c = (skin_mm[triangles[:, corner]] for corner in range(3))
    return 0.25 * np.linalg.norm(np.cross(b - a, c - a), axis=1)
