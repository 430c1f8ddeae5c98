"""Is the step from one sphere to the next the skin's, or the mesh's?

The nearest comparison is only 3 % more curved than the standard. Two more meshes of the same resolution,
their lines elsewhere, press both spheres again: what changes between meshes is no part of the percept.
"""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import replace
from typing import Any

import numpy as np

from fingerpad.core.checks import FloatArray
from fingerpad.experiments.conditions import RECEPTOR_X_MM, Conditions, Touch
from fingerpad.experiments.gerling2014 import sphere_discrimination
from fingerpad.geometry.grading import Grading
from fingerpad.neuron.afferent import Afferent
from fingerpad.neuron.population import Population
from fingerpad.psychophysics.encoding import gradient_sum, neighbour_pairs
from fingerpad.skin.sampling import SkinResponse

CURVATURES = sphere_discrimination.CURVATURES[:2]
POSITION_MM = sphere_discrimination.POSITIONS_MM[0]
USUAL = "as in the study"
LIMIT = 0.10
"""Share by which the step may differ between meshes."""

WIDER = 2
"""Elements by which the fine zone of the last mesh reaches farther on every side."""


def gradings(conditions: Conditions) -> dict[str, Grading]:
    """Return the other meshes: lines half an element along the finger, then across it and a wider fine zone.

    Parameters
    ----------
    conditions : Conditions
        Whose mesh of the spheres they resemble.

    Returns
    -------
    dict of Grading
    """
    usual = conditions.sphere_grading()
    elements = np.ceil(usual.half_width_mm / usual.size_z_mm)
    return {
        "half an element along": replace(usual, centre_mm=usual.centre_mm + 0.5 * usual.size_x_mm),
        # The plane of symmetry keeps its line: half an element more fits into the width, all a bit smaller.
        "half an element across, wider": replace(
            usual,
            size_z_mm=usual.size_z_mm * elements / (elements + 0.5),
            half_length_mm=usual.half_length_mm + WIDER * usual.size_x_mm,
            half_width_mm=usual.half_width_mm + WIDER * usual.size_z_mm,
        ),
    }


def touches(conditions: Conditions) -> dict[tuple[str, float], Touch]:
    """Press the standard and the nearest comparison on the other meshes; keys are mesh and curvature."""
    return {
        (mesh, curvature): conditions.sphere_touch(curvature, POSITION_MM, grading)
        for mesh, grading in gradings(conditions).items()
        for curvature in CURVATURES
    }


def result(
    responses: Mapping[tuple[str, float], SkinResponse],
    spheres: Mapping[tuple[float, float], SkinResponse],
    afferent: Afferent,
) -> dict[str, Any]:
    """Compare the step of the static Gradient Sum between meshes.

    Parameters
    ----------
    responses : mapping of SkinResponse
        By mesh and curvature, from `touches`.
    spheres : mapping of SkinResponse
        Those of the study, by position and curvature.
    afferent : Afferent
        What every receptor is.

    Returns
    -------
    dict
        `meshes`, and of each `static_sum` (n_meshes, 2) [spikes/s], its `step`, the `difference` of that from
        the study's as a share of it, and `sed_kpa` (n_meshes, 2), the largest strain energy density at a
        receptor at the end of the hold; `largest_difference` of all, and its `limit`.
    """
    population = Population.grid(afferent=afferent, centre_mm=(RECEPTOR_X_MM, 0.0))
    neighbours = neighbour_pairs(population.positions_mm, population.pitch_mm)
    pressed = {(USUAL, curvature): spheres[POSITION_MM, curvature] for curvature in CURVATURES} | dict(
        responses
    )
    meshes = list(dict.fromkeys(mesh for mesh, _ in pressed))

    def table(read: Any) -> FloatArray:
        return np.array([[read(pressed[mesh, curvature]) for curvature in CURVATURES] for mesh in meshes])

    static = table(lambda skin: gradient_sum(population.respond(skin).static_rate_hz, neighbours))
    step = static[:, 1] - static[:, 0]
    difference = step / step[0] - 1.0
    return {
        "curvature_per_m": CURVATURES,
        "meshes": meshes,
        "static_sum": static,
        "sed_kpa": table(lambda skin: skin.sed(population.positions_mm).sed_kpa[-1].max()),
        "step": step,
        "difference": difference,
        "largest_difference": float(np.abs(difference).max()),
        "limit": LIMIT,
    }
