"""Mesh noise: the step between the nearest spheres on meshes with shifted element boundaries."""

import math
from dataclasses import replace

import numpy as np
import pytest
from numpy.testing import assert_allclose

from fingerpad.core.signals import SedTraces
from fingerpad.experiments.conditions import RECEPTOR_X_MM, Conditions
from fingerpad.geometry.grading import lines_along
from fingerpad.neuron.population import Population
from fingerpad.psychophysics.encoding import gradient_sum, neighbour_pairs
from sections import SED_DRIVEN
from studies import mesh_noise
from studies.pages import mesh_noise as page

GRID = Population.grid(afferent=SED_DRIVEN)
PAIRS = neighbour_pairs(GRID.positions_mm, 1.0)


@pytest.mark.parametrize("resolution", ["quick", "standard"])
def test_other_meshes_have_their_lines_half_an_element_away(resolution):
    conditions = Conditions(resolution)
    usual = conditions.sphere_grading()
    along, across = mesh_noise.gradings(conditions).values()
    assert along.centre_mm - usual.centre_mm == pytest.approx(0.5 * usual.size_x_mm)
    assert across.size_z_mm == pytest.approx(usual.size_z_mm, rel=0.1)
    lines = [np.arange(0.0, 3.2, grading.size_z_mm) for grading in (usual, across)]
    last = int(np.ceil(usual.half_width_mm / usual.size_z_mm))
    assert lines[0][last] - lines[1][last] == pytest.approx(0.5 * across.size_z_mm)
    reach = [lines_along(grading, 12.0) for grading in (usual, across)]
    fine = [int(np.isclose(np.diff(line), usual.size_x_mm).sum()) for line in reach]
    assert fine[1] == fine[0] + mesh_noise.WIDER
    assert len(mesh_noise.touches(conditions)) == 4


class Skin:
    """SED below a ball, scaled as another mesh might."""

    def __init__(self, curvature_per_m, scale=1.0):
        self.peak_kpa = 2.5 * scale * (curvature_per_m / 287.0) ** 1.5

    def sed(self, sites):
        squared = np.square(np.asarray(sites) - [RECEPTOR_X_MM, 0.0]).sum(axis=1)
        peaks = self.peak_kpa * np.exp(-squared / 4.0)
        return SedTraces([0.0, 50.0, 1000.0], np.outer([0.0, 1.0, 0.85], peaks), kinks_ms=[50.0])


def test_mesh_noise_is_the_largest_difference_of_a_step():
    conditions = Conditions("quick")
    spheres = {(0.0, curvature): Skin(curvature) for curvature in mesh_noise.CURVATURES}
    first, second = mesh_noise.gradings(conditions)
    scales = {(first, 287.0): 1.0, (first, 296.0): 1.0, (second, 287.0): 1.0, (second, 296.0): 1.004}
    responses = {key: Skin(key[1], scale) for key, scale in scales.items()}
    found = mesh_noise.result(responses, spheres, GRID.afferent)
    assert found.meshes == (mesh_noise.USUAL, first, second)
    steps = found.step
    assert_allclose(steps, np.diff(found.static_sum).ravel())
    assert steps[0] == steps[1] < steps[2]
    assert found.largest_difference == pytest.approx(steps[2] / steps[0] - 1.0)
    assert_allclose(found.sed_kpa[0, 0], 0.85 * 2.5 * math.exp(-0.25 / 4.0), rtol=1e-9)
    population = Population.grid(centre_mm=(RECEPTOR_X_MM, 0.0), afferent=GRID.afferent)
    rates = population.respond(spheres[0.0, 287.0]).static_rate_hz
    assert found.static_sum[0, 0] == gradient_sum(rates, PAIRS)


def five_percent_apart() -> mesh_noise.MeshNoise:
    return mesh_noise.MeshNoise(
        curvature_per_m=[287.0, 296.0],
        meshes=("as in the study", "another"),
        static_sum=[[1400.0, 1460.0], [1410.0, 1467.0]],
        sed_kpa=[[1.4, 1.5], [1.4, 1.5]],
        step=[60.0, 57.0],
        difference=[0.0, -0.05],
        largest_difference=0.05,
        limit=0.1,
    )


def test_steps_on_other_meshes_are_shares_of_the_first():
    (table,) = page.tables(five_percent_apart())
    assert [row.cells[-1] for row in table.rows] == ["0.000", "−0.050"]


@pytest.mark.parametrize(("difference", "verdict"), [(0.099, "10 % is met"), (0.101, "10 % is exceeded")])
def test_the_page_reports_whether_the_steps_agree(difference, verdict):
    assert verdict in page.verdict(replace(five_percent_apart(), largest_difference=difference))
