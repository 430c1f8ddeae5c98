"""Stress, strain and energy of elements against the work of their nodal forces, and algebra."""

import numpy as np
import pytest
from scipy.linalg import logm, polar
from scipy.spatial.transform import Rotation

from fingerpad.geometry.mesh import Mesh, block_mesh
from fingerpad.mechanics.assembly import Sparsity, assemble
from fingerpad.mechanics.element import SHAPE_DERIVATIVES
from fingerpad.mechanics.fields import ElementFields, FieldState, Watched, cauchy_stress, fields_over_time
from fingerpad.mechanics.materials import Hencky, Hyperfoam, Material, MaterialTable, Prony
from fingerpad.mechanics.viscoelastic import (
    StepCoefficients,
    StressHistory,
    instantaneous_state,
    stored_energy_density,
)

PRONY = Prony(shares=(0.25, 0.35), times_ms=(40.0, 900.0))
LAWS = {
    "neo-hooke": Material.neo_hooke(11.0, 0.48),
    "polynomial": Material.polynomial(4.0, 1.5, 2.5, 0.7, 0.9, poisson=0.48),
    "hencky": Material(Hencky(11.0, 110.0)),
    "hyperfoam": Material(Hyperfoam((2.0, 3.0), (-3.0, 7.0), poisson=0.3)),
}
EACH_LAW = pytest.mark.parametrize("law", LAWS.values(), ids=LAWS)
FULL = np.array([[0, 3, 5], [3, 1, 4], [5, 4, 2]])


def bricks():
    """Two bricks, distorted, of two layers, the second with one edge collapsed to make it a wedge."""
    plain = block_mesh([0.0, 1.0, 2.1], [0.0, 0.9], [0.0, 1.2], layers=[0])
    nodes = plain.nodes_mm + 0.1 * np.random.default_rng(2).uniform(-1.0, 1.0, plain.nodes_mm.shape)
    elements = plain.elements.copy()
    elements[1, [2, 6]] = elements[1, [1, 5]]
    parts = {name: getattr(plain, name) for name in Mesh.__dataclass_fields__}
    return Mesh(**(parts | {"nodes_mm": nodes, "elements": elements, "layer": np.array([0, 1])}))


MESH = bricks()


def marched(material, displacements, times_ms, mesh=MESH):
    """What all elements feel over a prescribed motion; nodal forces at its end and the final state."""
    table = MaterialTable.of([material] * 2)
    sparsity = Sparsity.of(mesh.elements, len(mesh.nodes_mm))
    everything = np.arange(len(mesh.elements))
    watched = Watched(everything, mesh.nodes_mm, mesh.elements, mesh.layer, table)
    history = StressHistory.unloaded(len(mesh.elements), table.shares.shape[1])
    moment = FieldState.unloaded(len(mesh.nodes_mm), len(mesh.elements))
    fields, force = [moment.values], np.empty_like(mesh.nodes_mm)
    blocks = np.empty((sparsity.column.size, 3, 3))
    for displacement, step_ms in zip(displacements, np.diff(times_ms, prepend=0.0), strict=True):
        step = StepCoefficients.of(table, step_ms)
        assemble(
            mesh, displacement, table.law, step.s,
            history.carried(step, mesh.layer), sparsity, False, force, blocks,
        )  # fmt: skip
        state = mesh, displacement, table
        now = instantaneous_state(*state)
        history = history.advanced(step, mesh.layer, now.stress_kpa)
        stored = stored_energy_density(*state, history, now)
        moment = watched.after(moment, displacement, history, now, stored)
        fields.append(moment.values)
    return fields_over_time(everything, fields), force, cauchy_stress(mesh, displacement, table, history)


def shaken(size, seed=0):
    return size * np.random.default_rng(seed).uniform(-1.0, 1.0, MESH.nodes_mm.shape)


def slow_gradients(mesh, displacement, element):
    """Weights and deformation gradients at the points of one element."""
    corners = mesh.elements[element]
    weights, gradients = [], []
    for slopes in SHAPE_DERIVATIVES:
        jacobian = mesh.nodes_mm[corners].T @ slopes
        weights.append(np.linalg.det(jacobian))
        gradients.append(np.eye(3) + displacement[corners].T @ slopes @ np.linalg.inv(jacobian))
    return np.array(weights), np.array(gradients)


@EACH_LAW
def test_mean_stress_is_the_moment_of_the_nodal_forces(law):
    """sum f x' over the nodes of a body is the integral of its Cauchy stress: any law, any history."""
    motion = [shaken(0.06, 1), shaken(0.1, 2), shaken(0.12, 3)]
    fields, force, final = marched(law.with_prony(PRONY), motion, [10.0, 60.0, 400.0])
    volume = []
    for element in range(2):
        weights, gradients = slow_gradients(MESH, motion[-1], element)
        volume.append(weights @ np.linalg.det(gradients))
    total = np.einsum("e,ek->k", volume, fields.stress_kpa[-1])[FULL]
    np.testing.assert_allclose(total, force.T @ (MESH.nodes_mm + motion[-1]), rtol=1e-9, atol=1e-9)
    np.testing.assert_array_equal(fields.stress_kpa[-1], final)
    assert not fields.stress_kpa[0].any()


def test_mean_deformation_is_the_slow_mean_scaled_to_the_volume():
    moved = shaken(0.12)
    fields, _, _ = marched(LAWS["neo-hooke"], [moved], [1.0])
    for element in range(2):
        weights, gradients = slow_gradients(MESH, moved, element)
        mean = np.einsum("q,qij->ij", weights, gradients) / weights.sum()
        dilatation = weights @ np.linalg.det(gradients) / weights.sum()
        mean *= (dilatation / np.linalg.det(mean)) ** (1 / 3)
        np.testing.assert_allclose(fields.gradient[-1, element], mean, rtol=1e-12, atol=1e-14)
        np.testing.assert_allclose(fields.strain[-1, element, :3].sum(), np.log(dilatation), rtol=1e-9)


def test_strains_are_those_of_matrix_functions():
    gradient = np.array([[1.2, 0.3, -0.1], [0.05, 0.8, 0.2], [0.1, -0.2, 1.1]])
    fields, _, _ = marched(LAWS["neo-hooke"], [MESH.nodes_mm @ (gradient - np.eye(3)).T], [1.0])
    np.testing.assert_allclose(fields.gradient[-1], [gradient] * 2, rtol=1e-12, atol=1e-13)
    left_stretch = polar(gradient, side="left")[1]
    logarithm = logm(left_stretch)
    for element in range(2):
        np.testing.assert_allclose(fields.strain[-1, element][FULL], logarithm, rtol=1e-9, atol=1e-12)
        green = 0.5 * (gradient.T @ gradient - np.eye(3))
        np.testing.assert_allclose(fields.green_lagrange_strain[-1, element][FULL], green, atol=1e-12)
    principal = np.linalg.eigvalsh(logarithm)
    np.testing.assert_allclose(fields.principal_strain[-1], [principal] * 2, rtol=1e-9)
    np.testing.assert_allclose(fields.compressive_strain[-1], -principal[0], rtol=1e-9)


def test_rigid_rotation_turns_stress_and_leaves_invariants():
    """The stretched bodies are the same, one of them turned."""
    turn = Rotation.from_rotvec([0.4, -0.7, 0.3]).as_matrix()
    moved = shaken(0.1)
    turned = (MESH.nodes_mm + moved) @ turn.T - MESH.nodes_mm
    material = LAWS["polynomial"].with_prony(PRONY)
    plain, _, _ = marched(material, [moved], [30.0])
    other, _, _ = marched(material, [turned], [30.0])
    stress, turned_stress = (each.stress_kpa[-1][:, FULL] for each in (plain, other))
    np.testing.assert_allclose(turned_stress, turn @ stress @ turn.T, rtol=1e-9, atol=1e-10)
    energies = ("stored_kpa", "instantaneous_kpa", "work_kpa")
    invariants = (*energies, "von_mises_kpa", "compressive_strain", "compressive_stress_kpa")
    for name in invariants:
        np.testing.assert_allclose(getattr(other, name), getattr(plain, name), rtol=1e-9, atol=1e-12)
    rigid, _, _ = marched(material, [MESH.nodes_mm @ (turn - np.eye(3)).T], [30.0])
    for name in invariants:
        assert np.abs(getattr(rigid, name)).max() < 1e-8


@EACH_LAW
def test_elastic_work_is_stored_and_the_error_of_steps_is_of_second_order(law):
    end = shaken(0.12)
    errors = []
    for n in (4, 8):
        motion = [share * end for share in np.linspace(0.0, 1.0, n + 1)[1:]]
        fields, _, _ = marched(law, motion, np.arange(1.0, n + 1))
        np.testing.assert_allclose(fields.instantaneous_kpa, fields.stored_kpa, rtol=1e-12)
        errors.append(np.abs(fields.work_kpa[-1] / fields.stored_kpa[-1] - 1).max())
    assert errors[1] < 0.002
    assert errors[0] > 3.5 * errors[1]


def test_work_turns_with_the_body():
    """Shear and turn a body at once: no step of the turn may count as work."""
    end = shaken(0.1)
    straight, turned = [], []
    for share in np.linspace(0.0, 1.0, 9)[1:]:
        turn = Rotation.from_rotvec(share * np.array([0.0, 1.5, 0.0])).as_matrix()
        straight.append(share * end)
        turned.append((MESH.nodes_mm + share * end) @ turn.T - MESH.nodes_mm)
    times = np.arange(1.0, 9.0)
    plain, _, _ = marched(LAWS["neo-hooke"], straight, times)
    other, _, _ = marched(LAWS["neo-hooke"], turned, times)
    np.testing.assert_allclose(other.work_kpa, plain.work_kpa, rtol=1e-9)


def test_three_definitions_of_energy_part_when_tissue_relaxes():
    """Held after a fast shear: the instantaneous energy and the work stay, the stored energy falls."""
    end = MESH.nodes_mm[:, [1]] * [0.02, 0.0, 0.0]
    motion = [share * end for share in (0.25, 0.5, 0.75, 1.0, 1.0, 1.0)]
    relaxing = LAWS["neo-hooke"].with_prony(PRONY)
    fields, _, _ = marched(relaxing, motion, [0.025, 0.05, 0.075, 0.1, 100.0, 1e6])
    # gamma = 0.02 of a neo-Hookean body: W0 = G0 gamma²/2, with G0 = G / (1 - 0.6)
    instantaneous = 0.5 * 11.0 / 0.4 * 0.02**2
    np.testing.assert_allclose(fields.instantaneous_kpa[4:], instantaneous, rtol=1e-9)
    np.testing.assert_allclose(fields.work_kpa[4:], instantaneous, rtol=2e-3)
    np.testing.assert_allclose(fields.stored_kpa[4], instantaneous, rtol=3e-3)
    np.testing.assert_allclose(fields.stored_kpa[6], 0.4 * instantaneous, rtol=1e-9)


def test_invariants_of_a_known_stress():
    stress = np.array([[[3.0, -1.0, -8.0, 0.0, 0.0, 0.0], [0.0, 0.0, 0.0, 2.0, 0.0, 0.0]]])
    one = np.ones((1, 2))
    fields = ElementFields(np.arange(2), np.tile(np.eye(3), (1, 2, 1, 1)), stress, one, one, one)
    np.testing.assert_allclose(
        fields.principal_stress_kpa, [[[-8.0, -1.0, 3.0], [-2.0, 0.0, 2.0]]], atol=1e-14
    )
    np.testing.assert_allclose(fields.von_mises_kpa, [[np.sqrt(0.5 * (16 + 49 + 121)), 2 * np.sqrt(3)]])
    np.testing.assert_allclose(fields.compressive_stress_kpa, [[8.0, 2.0]])
    np.testing.assert_allclose(fields.pressure_kpa, [[2.0, 0.0]], atol=1e-15)
    assert not fields.compressive_strain.any()
