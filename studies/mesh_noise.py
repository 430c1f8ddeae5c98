"""Mesh error of the step between the standard sphere and the nearest comparison.

The nearest comparison is only 3 % more curved than the standard. Both spheres are pressed again on two more
meshes of the same resolution with shifted element boundaries. Differences between the meshes are an error.
"""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import replace
from typing import Any

import numpy as np

from fingerpad.core.checks import FloatArray
from fingerpad.core.results import Matrix, Number, Vector, result_class
from fingerpad.experiments.conditions import RECEPTOR_X_MM, Conditions, Touch
from fingerpad.experiments.gerling2014 import sphere_discrimination
from fingerpad.experiments.manifest import Manifest
from fingerpad.experiments.runner import Runner
from fingerpad.geometry.grading import Grading
from fingerpad.neuron.afferent import Afferent
from fingerpad.neuron.population import Population
from fingerpad.psychophysics.encoding import gradient_sum, neighbour_pairs
from fingerpad.skin.sampling import SkinResponse
from studies.fitted_bars import fit_bars

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


@result_class
class MeshNoise:
    """The step of the static Gradient Sum between the nearest spheres, on several meshes.

    Parameters
    ----------
    curvature_per_m : array (2,)
        Of the standard and the nearest comparison. [1/m]
    meshes : tuple of str
        Names; the first is the mesh of the reproduction.
    static_sum : array (n_meshes, 2)
        Gradient Sum of static rates. [spikes/s]
    sed_kpa : array (n_meshes, 2)
        Largest strain energy density at a receptor at the end of the hold. [kPa]
    step : array (n_meshes,)
        Second sum less the first. [spikes/s]
    difference : array (n_meshes,)
        Of the step from that of the first mesh, as a share of it. [1]
    largest_difference : float
        Of all meshes, without sign. [1]
    limit : float
        What it must not exceed. [1]
    """

    curvature_per_m: Vector
    meshes: tuple[str, ...]
    static_sum: Matrix
    sed_kpa: Matrix
    step: Vector
    difference: Vector
    largest_difference: Number
    limit: float

    @property
    def within_limit(self) -> bool:
        """Whether the step is the skin's and not the mesh's."""
        return self.largest_difference <= self.limit


@result_class
class MeshNoiseStudy:
    """Result of `python -m studies mesh-noise`.

    Parameters
    ----------
    mesh_noise : MeshNoise
        The steps.
    manifest : Manifest
        What ran.
    """

    mesh_noise: MeshNoise
    manifest: Manifest


def run(runner: Runner, conditions: Conditions) -> MeshNoiseStudy:
    """Press both spheres on all meshes, and compare their steps in a population of the fitted afferent.

    Parameters
    ----------
    runner : Runner
        Where indentations are stored.
    conditions : Conditions
        Finger, tissues, accuracy and seed.

    Returns
    -------
    MeshNoiseStudy
    """
    usual = {(POSITION_MM, curvature): conditions.sphere_touch(curvature) for curvature in CURVATURES}
    fitted = fit_bars(runner, conditions, {"spheres": usual, "spheres, other meshes": touches(conditions)})
    found = result(fitted.others["spheres, other meshes"], fitted.others["spheres"], fitted.afferent)
    return MeshNoiseStudy(mesh_noise=found, manifest=runner.manifest(conditions))


def result(
    responses: Mapping[tuple[str, float], SkinResponse],
    spheres: Mapping[tuple[float, float], SkinResponse],
    afferent: Afferent,
) -> MeshNoise:
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
    MeshNoise
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
    return MeshNoise(
        curvature_per_m=np.array(CURVATURES),
        meshes=tuple(meshes),
        static_sum=static,
        sed_kpa=table(lambda skin: skin.sed(population.positions_mm).sed_kpa[-1].max()),
        step=step,
        difference=difference,
        largest_difference=np.abs(difference).max(),
        limit=LIMIT,
    )
