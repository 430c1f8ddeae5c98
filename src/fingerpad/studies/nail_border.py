"""Figure 9: strain energy concentrates at the border of the nail when a sphere presses the pad."""

from __future__ import annotations

from typing import Any

import numpy as np

from fingerpad.mesh import Mesh
from fingerpad.sampling import SkinResponse

FAR_FROM_NAIL_MM = 2.0


def result(skin: SkinResponse) -> dict[str, Any]:
    """SED over the skin and in the mid-plane at the end of the hold, and how it concentrates at the nail."""
    mesh = skin.mesh
    sheet = mesh.living_epidermis
    sed = skin.sed_kpa[-1]
    centre = mesh.nodes_mm[mesh.elements[sheet]].mean(axis=2)
    border, far, ratio = _nail_concentration(mesh, centre, sed[sheet])
    return {
        "x_mm": centre[..., 0],
        "y_mm": centre[..., 1],
        "z_mm": centre[..., 2],
        "sed_kpa": sed[sheet],
        "border_kpa": border,
        "far_kpa": far,
        "ratio": ratio,
        "text": (
            f"At the border of the nail the strain energy density reaches {border:.3g} kPa, "
            f"{ratio:.3g} times the median of the dorsal skin more than {FAR_FROM_NAIL_MM:g} mm away from it."
        ),
        "section": _section(mesh, skin),
    }


def _nail_concentration(mesh: Mesh, centre: np.ndarray, sed: np.ndarray) -> tuple[float, float, float]:
    """Largest SED beside the nail, median SED of the dorsal skin far from it, and their ratio."""
    under_nail = np.isin(mesh.skin_grid, mesh.nail_nodes)
    corners = (
        under_nail[:-1, :-1].astype(int) + under_nail[1:, :-1] + under_nail[1:, 1:] + under_nail[:-1, 1:]
    )
    at_border = (corners > 0) & (corners < 4)
    nail = mesh.nodes_mm[mesh.nail_nodes]
    offset = centre.reshape(-1, 1, 3) - nail[None]
    distance = np.linalg.norm(offset, axis=2).min(axis=1).reshape(sed.shape)
    dorsal_and_far = (centre[..., 1] > 0.0) & (distance > FAR_FROM_NAIL_MM)
    border, far = float(sed[at_border].max()), float(np.median(sed[dorsal_and_far]))
    return border, far, border / far


def _section(mesh: Mesh, skin: SkinResponse) -> dict[str, Any]:
    """Deformed quadrilaterals of the elements' faces on the plane z = 0, and their SED."""
    on_plane = np.abs(mesh.nodes_mm[:, 2]) < 1e-9
    faces = np.array([[0, 1, 5, 4], [3, 2, 6, 7]])
    moved = mesh.nodes_mm + skin.displacement_mm
    corners, sed = [], []
    for face in faces:
        nodes = mesh.elements[:, face]
        chosen = on_plane[nodes].all(axis=1) & (np.ptp(nodes, axis=1) > 0)
        corners.append(moved[nodes[chosen]])
        sed.append(skin.sed_kpa[-1, chosen])
    quads = np.concatenate(corners)
    return {"x_mm": quads[..., 0], "y_mm": quads[..., 1], "sed_kpa": np.concatenate(sed), "displaced": True}
