"""Pressure of the indenter on the skin and the area that it touches."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from fingerpad.core.checks import FloatArray
from fingerpad.geometry.mesh import Mesh


@dataclass(frozen=True)
class SkinContact:
    """Where and how hard the indenter presses, over time.

    Parameters
    ----------
    pressure_kpa : array (n_times, n_skin_nodes)
        Normal force on each node of `mesh.skin_nodes` over the present area that belongs to it. [kPa]
    area_mm2, present_area_mm2 : array (n_times,)
        Skin that belongs to pressed nodes, undeformed and as it is then; of the whole body also when half
        of it is solved. [mm²]
    """

    pressure_kpa: FloatArray
    area_mm2: FloatArray
    present_area_mm2: FloatArray


def skin_contact(mesh: Mesh, displacement_mm: FloatArray, pressed_mn: FloatArray) -> SkinContact:
    """Pressure and area from the force on each node of the skin.

    Parameters
    ----------
    mesh : Mesh
        The undeformed body.
    displacement_mm : array (n_times, n_nodes, 3)
        Displacements. [mm]
    pressed_mn : array (n_times, n_skin_nodes)
        Normal forces on `mesh.skin_nodes`. [mN]

    Returns
    -------
    SkinContact
    """
    present = np.array([mesh.skin_area_of(mesh.nodes_mm + moved) for moved in displacement_mm])
    whole_body = 2.0 if mesh.symmetry_nodes.size else 1.0
    touching = pressed_mn > 0.0
    return SkinContact(
        pressed_mn / present,
        whole_body * (touching * mesh.skin_area_mm2).sum(axis=1),
        whole_body * (touching * present).sum(axis=1),
    )
