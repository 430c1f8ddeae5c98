"""Pressures and the tangent of the mixed method against differences, and presses near incompressibility."""

from dataclasses import replace

import numpy as np
import pytest

from fingerpad import ForceRampAndHold, Material, PressSettings, RampAndHold, Sphere
from fingerpad.geometry.mesh import block_mesh
from fingerpad.geometry.mesh_checks import jacobian_at_gauss
from fingerpad.mechanics import press as press_module
from fingerpad.mechanics.assembly import Sparsity
from fingerpad.mechanics.materials import Hencky, MaterialTable, Polynomial
from fingerpad.mechanics.mixed import Pressures, exchange_pressure
from fingerpad.mechanics.newton import NewtonSettings
from presses import block, press_into

SHEAR, BULK = 3.0, 700.0
BLOCK = block_mesh([0.0, 1.0, 2.2], [0.0, 0.7, 1.9], [0.0, 1.3], layers=[0, 1])


def pressures(displacement, materials, mesh=BLOCK):
    law = MaterialTable.of(materials).law
    return Pressures.of(mesh, displacement, law)


def crumpled(seed=3):
    return 0.08 * np.random.default_rng(seed).uniform(-1.0, 1.0, BLOCK.nodes_mm.shape)


def volumes(displacement):
    return jacobian_at_gauss(replace(BLOCK, nodes_mm=BLOCK.nodes_mm + displacement)).sum(axis=1)


POLYNOMIAL = Polynomial(c10=SHEAR / 2, bulk_linear=BULK / 2, bulk_cubic=90.0)
MATERIALS = (Material(POLYNOMIAL), Material(Hencky(SHEAR, BULK)))
FOAM = Material.hyperfoam([5.0], [4.0], 0.4)


def test_pressure_and_its_slope_are_those_of_the_volumetric_energy():
    """U = K/2 (J-1)² + (J-1)⁴/D2 in the upper layer, K/2 ln² J in the lower."""
    displacement = crumpled()
    jacobian = volumes(displacement) / volumes(0.0)
    found = pressures(displacement, MATERIALS).pressure_kpa
    upper = BULK * (jacobian - 1.0) + 4 * 90.0 * (jacobian - 1.0) ** 3
    lower = BULK * np.log(jacobian) / jacobian
    np.testing.assert_allclose(found, np.where(BLOCK.layer == 0, upper, lower), rtol=1e-10)
    displacement, step = crumpled(), 1e-6 * crumpled(seed=4)
    state = pressures(displacement, MATERIALS)
    ahead, behind = (pressures(displacement + sign * step, MATERIALS) for sign in (1.0, -1.0))
    difference = (ahead.pressure_kpa - behind.pressure_kpa) / 2
    change = state.after(BLOCK.elements, step) - state.pressure_kpa
    np.testing.assert_allclose(change, difference, rtol=1e-5)
    assert np.abs(change).max() > 1e-6
    state = pressures(crumpled(), (FOAM, FOAM))
    assert not state.pressure_kpa.any()
    assert not state.slope_kpa_per_mm.any()


def test_exchanged_pressure_acts_on_the_second_derivative_of_volume():
    """sum_e p_e (dv_e(u + h) - dv_e(u - h)) / 2, with dv from the slope of a linear U."""
    linear = (Material(Polynomial(c10=0.01, bulk_linear=0.5)),) * 2
    displacement, step, change = crumpled(), 1e-5 * crumpled(seed=4), np.array([2.0, -3.0, 5.0, 0.0])
    sparsity = Sparsity.of(BLOCK.elements, len(BLOCK.nodes_mm))
    blocks = np.zeros((sparsity.column.size, 3, 3))
    exchange_pressure(BLOCK, displacement, change, sparsity, blocks)
    force = np.zeros_like(displacement)
    for sign in (1.0, -1.0):
        slope = pressures(displacement + sign * step, linear).slope_kpa_per_mm
        volume_slope = slope * volumes(0.0)[:, None, None]
        np.add.at(force, BLOCK.elements, sign / 2 * change[:, None, None] * volume_slope)
    found = sparsity.matrix(blocks) @ step.ravel()
    np.testing.assert_allclose(found, force.ravel(), rtol=0, atol=1e-7 * np.abs(force).max())
    assert np.abs(force).max() > 0.0


def pressed(poisson, motion):
    tissue, tight = (Material.neo_hooke(20.0, poisson),) * 4, NewtonSettings(1e-6, 1e-4)
    ball = Sphere(curvature_per_m=500.0)
    return press_into(block(layers=[2] * 5), tissue, ball, motion, PressSettings(4, 1, tight))


@pytest.mark.parametrize(
    "motion", [RampAndHold(0.4, 50.0, 100.0), ForceRampAndHold(40.0, 50.0, 100.0)], ids=["depth", "force"]
)
def test_newton_steps_hardly_grow_towards_incompressibility_and_the_answer_stays(monkeypatch, motion):
    mixed = pressed(0.4999, motion)
    assert mixed.newton_steps < 1.3 * pressed(0.48, motion).newton_steps
    monkeypatch.setattr(press_module, "MIXED_POISSON", 0.5)
    plain = pressed(0.4999, motion)
    assert mixed.newton_steps < plain.newton_steps / 2
    # What is left of penetration, 1e-4 of the depth, depends on the way; force grows as its square or slower.
    np.testing.assert_allclose(mixed.force_mn, plain.force_mn, rtol=5e-4)
    np.testing.assert_allclose(mixed.depth_mm, plain.depth_mm, rtol=5e-4)
    scale = 2e-3 * plain.sed_kpa.max()
    np.testing.assert_allclose(mixed.sed_kpa, plain.sed_kpa, rtol=0, atol=scale)
