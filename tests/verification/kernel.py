"""What holds for any motion of any element: objectivity, balance of its forces, and an exact tangent."""

from __future__ import annotations

import numpy as np

from fingerpad.mechanics.materials import Material, Prony
from fingerpad.mechanics.viscoelastic import StepCoefficients, StressHistory, instantaneous_state

from .case import Row, at_least, at_most, case
from .laws import LAWS
from .patches import PATCHES
from .solid import Solid, rotation

THEME = "Rigid motion, objectivity, tangent"
PRONY = Prony(shares=(0.25, 0.35), times_ms=(40.0, 900.0))
SHIFT_MM = np.array([0.3, -2.0, 1.0])


def solids():
    """Every patch with every law."""
    meshes = [make()[0] for make in PATCHES.values()]
    for name, reference in LAWS.items():
        for mesh in meshes:
            yield name, Solid(mesh, (reference.material,) * 4)


def shake(solid, seed=0, size=0.08):
    """Displacements at random that turn no element inside out. [mm]"""
    return np.random.default_rng(seed).uniform(-size, size, solid.mesh.nodes_mm.shape)


def moved_rigidly(solid, displacement):
    """The displaced body turned and shifted, as displacements. [mm]"""
    nodes = solid.mesh.nodes_mm
    return (nodes + displacement) @ rotation().T + SHIFT_MM - nodes


def worst(measure):
    """Largest value over the patches for every law."""
    found = {name: [] for name in LAWS}
    for name, solid in solids():
        found[name].append(measure(solid))
    return {name: np.max(values) for name, values in found.items()}


@case(THEME, "No stress after a rigid rotation", "Objectivity of a hyperelastic law")
def rigid_rotation() -> list[Row]:
    """Patch, rotated by a large angle and displaced: largest nodal force over bulk modulus times 1 mm²."""

    def force(solid):
        _, forces, _ = solid.evaluate(moved_rigidly(solid, np.zeros_like(solid.mesh.nodes_mm)))
        return np.abs(forces).max() / solid.materials[0].bulk_modulus_kpa

    return [at_most(name, 1e-12, value) for name, value in worst(force).items()]


@case(THEME, "Energy, forces and tangent of a rotated body", "Objectivity of a hyperelastic law")
def objectivity() -> list[Row]:
    """A patch is deformed at random, then rotated as well: largest relative change of the energy, of the
    rotated forces and of the rotated tangent times a direction.
    """

    def change(solid):
        displacement, direction = shake(solid), shake(solid, seed=1, size=1.0)
        turn, turned_place = rotation(), moved_rigidly(solid, displacement)
        energy, force, _ = solid.evaluate(displacement)
        turned_energy, turned, _ = solid.evaluate(turned_place)
        forces = np.abs(turned - force @ turn.T).max() / np.abs(force).max()
        slope = (tangent_at(solid, displacement) @ direction.ravel()).reshape(-1, 3) @ turn.T
        turned_slope = tangent_at(solid, turned_place) @ (direction @ turn.T).ravel()
        slopes = np.abs(turned_slope - slope.ravel()).max() / np.abs(slope).max()
        return np.max([abs(turned_energy - energy) / abs(energy), forces, slopes])

    return [at_most(name, 1e-12, value) for name, value in worst(change).items()]


@case(THEME, "Rotation after loading, with Prony history", "Objectivity of the convected history")
def rotation_of_a_relaxing_body() -> list[Row]:
    """Patches of a relaxing tissue are deformed and held for 30 ms, either fixed or while they rotate. The
    forces of the rotated body must be the rotated forces. The body in its first shape, but rotated, must have
    the same stress history, rotated.
    """
    material = Material.polynomial(4.0, 1.5, 2.5, 0.7, 0.9, poisson=0.48, prony=PRONY)
    rows = []
    for patch, make in PATCHES.items():
        solid = Solid(make()[0], (material,) * 4)
        loaded = shake(solid)
        for last, what in ((loaded, "held"), (np.zeros_like(loaded), "unloaded")):
            still = two_steps(solid, loaded, last)
            turned = two_steps(solid, loaded, moved_rigidly(solid, last))
            error = np.abs(turned - still @ rotation().T).max() / np.abs(still).max()
            rows.append(at_most(f"{patch}, {what}: forces, relative", 1e-11, error))
        share = np.abs(still).max() / np.abs(two_steps(solid, loaded, loaded)).max()
        rows.append(at_least(f"{patch}: force that history leaves after unloading, over loaded", 0.01, share))
    return rows


def two_steps(solid, first, last):
    """Forces after 20 ms towards `first` and 30 ms towards `last`. [mN]"""
    mesh = solid.mesh
    history = StressHistory.unloaded(len(mesh.elements), solid.table.shares.shape[1])
    for step_ms, displacement in ((20.0, first), (30.0, last)):
        step = StepCoefficients.of(solid.table, step_ms)
        _, force, _ = solid.evaluate(displacement, step=step, history=history)
        stress = instantaneous_state(mesh, displacement, solid.table)[0]
        history = history.advanced(step, mesh.layer, stress)
    return force


@case(THEME, "Resultant and moment of internal forces", "Newton's third law")
def self_equilibrium() -> list[Row]:
    """Resultant and moment of the internal forces of a patch deformed at random, over the sum of their
    magnitudes (and 1 mm).
    """

    def resultant(solid):
        displacement = shake(solid)
        _, force, _ = solid.evaluate(displacement)
        moment = np.cross(solid.mesh.nodes_mm + displacement, force).sum(axis=0)
        return np.max(np.abs([force.sum(axis=0), moment])) / np.abs(force).sum()

    return [at_most(name, 1e-13, value) for name, value in worst(resultant).items()]


@case(THEME, "Force as derivative of the potential", "Central differences of fourth order")
def force_against_differences() -> list[Row]:
    """Slope of the potential along a random direction against internal forces, relative."""

    def error(solid):
        displacement, direction = shake(solid), shake(solid, seed=1, size=1.0)
        slope = fourth_order(lambda shift: solid.evaluate(displacement + shift * direction)[0])
        exact = (solid.evaluate(displacement)[1] * direction).sum()
        return abs(slope - exact) / np.abs(solid.evaluate(displacement)[1] * direction).sum()

    return [at_most(name, 1e-9, value) for name, value in worst(error).items()]


def tangent_at(solid, displacement):
    """Tangent as a sparse matrix. [mN/mm]"""
    return solid.sparsity.matrix(solid.evaluate(displacement, True)[2]).tocsr()


@case(THEME, "Tangent as derivative of the force", "Central differences of fourth order")
def tangent_against_differences() -> list[Row]:
    """Slope of the forces along a random direction against tangent times direction, relative to the
    largest."""

    def error(solid):
        displacement, direction = shake(solid), shake(solid, seed=1, size=1.0)
        slope = fourth_order(lambda shift: solid.evaluate(displacement + shift * direction)[1])
        exact = (tangent_at(solid, displacement) @ direction.ravel()).reshape(-1, 3)
        return np.abs(slope - exact).max() / np.abs(exact).max()

    return [at_most(name, 1e-8, value) for name, value in worst(error).items()]


@case(THEME, "Symmetry of the tangent", "Second derivatives of a potential")
def tangent_is_symmetric() -> list[Row]:
    """Largest entry of tangent minus its transpose, over the largest entry."""

    def asymmetry(solid):
        tangent = tangent_at(solid, shake(solid))
        return np.abs((tangent - tangent.T).data).max(initial=0.0) / np.abs(tangent.data).max()

    return [at_most(name, 1e-13, value) for name, value in worst(asymmetry).items()]


def fourth_order(function, step=1e-3):
    """Derivative at 0 by central differences of fourth order."""
    near, far = (function(k * step) - function(-k * step) for k in (1, 2))
    return (8 * near - far) / (12 * step)
