"""Stress, strain and energies of elements over time.

Every value is a mean over the element, the resolution of a brick with one pressure:

- deformation: the mean gradient Fbar = 1/V sum_q w_q F_q, scaled so that its determinant is the element's
  dilatation Jbar = v/V. All strain measures follow from this one gradient and are compatible. Its logarithm
  has the trace ln Jbar. In a smooth field it differs from the mean of the strains at the points by the square
  of the element's size.
- stress: Cauchy, mean over the present volume, 1/v sum_q w_q tau_q with
  tau_q = dev(F~ (S0 - sum S_i) F~')_q + p J_q 1, and p the element's one pressure.
- energy density by three definitions: *stored* (energy in the springs now), *instantaneous* (W0 + U, the
  energy without any relaxation) and *work* (the integral of S : dE, which includes dissipation).

Tensors are stored as xx, yy, zz, xy, yz, xz; shear strains are tensor components, not engineering strains.

Contact with the indenter is found at nodes, so the edge of the contact lies somewhere between a node that is
pressed and one that is not. Between the two it is placed by the law of a smooth edge on an elastic half-space
(Johnson 1985, ch. 5.1): at a distance d from the edge the pressure inside and the gap outside are

    p = C sqrt(d),     g = 4 C / (3 E*) d^(3/2),     E* = E / (1 - nu²).

A node with pressure p and another with gap g at a distance l from it then leave the share t of that distance
to the contact for which (1 - t)^3 = s² t, s = 3 E* g / (4 p l). It is 0 as long as p is 0 and 1 as soon as g
is, so that the area grows without steps.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from typing import NamedTuple

import numpy as np
from numba import njit

from fingerpad.core.numba_internals import small_array
from fingerpad.core.threads import run_kernel
from fingerpad.core.values import FloatArray
from fingerpad.geometry.mesh import Mesh
from fingerpad.mechanics.element import (
    N_NODES,
    N_POINTS,
    deformation_at_points,
    frame_scales,
    strain_changes,
    summed,
    take_nodes,
)
from fingerpad.mechanics.materials import COUPLED, MaterialTable
from fingerpad.mechanics.tensors import COLUMN, INDEX, ROW, find_determinants, push_forward
from fingerpad.mechanics.viscoelastic import InstantaneousState, StressHistory, instantaneous_state


@dataclass(frozen=True)
class ElementFields:
    """Stress, strain and energies of some elements over time."""

    elements: np.ndarray
    gradient: FloatArray
    """Mean deformation gradient, its determinant the dilatation, (n_times, n_elements, 3, 3)."""
    stress_kpa: FloatArray  # Cauchy stress, mean over the present volume, (n_times, n_elements, 6). [kPa]
    stored_kpa: FloatArray
    instantaneous_kpa: FloatArray
    work_kpa: FloatArray
    """Energy density per reference volume by its three definitions, (n_times, n_elements). [kPa = µJ/mm³]"""

    def of(self, elements: np.ndarray) -> ElementFields:
        order = np.argsort(self.elements)
        rows = order[np.searchsorted(self.elements, elements, sorter=order)]
        return ElementFields(
            self.elements[rows], self.gradient[:, rows], self.stress_kpa[:, rows], self.stored_kpa[:, rows],
            self.instantaneous_kpa[:, rows], self.work_kpa[:, rows],
        )  # fmt: skip

    @property
    def strain(self) -> FloatArray:
        """Logarithmic (Hencky) strain 1/2 ln(F F') in the present frame, (n_times, n_elements, 6)."""
        squares, axes = np.linalg.eigh(self.gradient @ self.gradient.swapaxes(-1, -2))
        logarithm = (axes * 0.5 * np.log(squares)[..., None, :]) @ axes.swapaxes(-1, -2)
        return logarithm[..., ROW, COLUMN]

    @property
    def green_lagrange_strain(self) -> FloatArray:
        """Green-Lagrange strain 1/2 (F' F - 1) in the reference frame, (n_times, n_elements, 6)."""
        strain = 0.5 * (self.gradient.swapaxes(-1, -2) @ self.gradient - np.eye(3))
        return strain[..., ROW, COLUMN]

    @property
    def principal_strain(self) -> FloatArray:
        """Principal logarithmic strains, smallest first, (n_times, n_elements, 3)."""
        stretches = np.linalg.svd(self.gradient, compute_uv=False)[..., ::-1]
        return np.log(stretches).astype(np.float64)

    @property
    def principal_stress_kpa(self) -> FloatArray:
        """Principal Cauchy stresses, tension positive, smallest first, (n_times, n_elements, 3). [kPa]"""
        return np.linalg.eigvalsh(self.stress_kpa[..., INDEX]).astype(np.float64)

    @property
    def von_mises_kpa(self) -> FloatArray:
        """Equivalent stress after von Mises, sqrt(3/2 s : s), (n_times, n_elements). [kPa]"""
        return von_mises(self.stress_kpa)

    @property
    def pressure_kpa(self) -> FloatArray:
        """Mean compressive stress, -tr(sigma)/3, (n_times, n_elements). [kPa]"""
        return -self.stress_kpa[..., :3].mean(axis=-1)

    @property
    def compressive_strain(self) -> FloatArray:
        """Largest compressive logarithmic strain; 0 where nothing is compressed, (n_times, n_elements)."""
        return np.maximum(-self.principal_strain[..., 0], 0.0)

    @property
    def compressive_stress_kpa(self) -> FloatArray:
        """Largest compressive stress; 0 where there is none, (n_times, n_elements). [kPa]"""
        return largest_compression(self.stress_kpa)


def largest_compression(stress_kpa: FloatArray) -> FloatArray:
    """Largest compressive stress of tensors (..., 6); 0 where there is none. [kPa]"""
    return np.maximum(-np.linalg.eigvalsh(stress_kpa[..., INDEX])[..., 0].astype(np.float64), 0.0)


def von_mises(stress_kpa: FloatArray) -> FloatArray:
    """Equivalent stress of tensors (..., 6), sqrt(3/2 s : s) with the deviator s. [kPa]"""
    mean = stress_kpa[..., :3].mean(axis=-1, keepdims=True)
    normal = ((stress_kpa[..., :3] - mean) ** 2).sum(axis=-1)
    return np.sqrt(1.5 * (normal + 2.0 * (stress_kpa[..., 3:] ** 2).sum(axis=-1)))


class FieldValues(NamedTuple):
    """Fields of the watched elements at one time: `ElementFields` without the axis of time."""

    gradient: FloatArray
    stress_kpa: FloatArray
    stored_kpa: FloatArray
    instantaneous_kpa: FloatArray
    work_kpa: FloatArray


@dataclass(frozen=True)
class FieldState:
    """State of the watched elements at one time, from which the work of the next step is computed."""

    values: FieldValues
    displacement_mm: FloatArray
    convected_kpa: FloatArray
    """S0 - sum S_i, the relaxing stress in the convected frame, (n_elements, 8, 6). [kPa]"""
    pressure_kpa: FloatArray
    dilatation: FloatArray  # U'(Jbar) and Jbar, (n_elements,). [kPa, -]

    @classmethod
    def unloaded(cls, n_nodes: int, n_elements: int) -> FieldState:
        """State of a body at rest."""
        zeros = np.zeros(n_elements)
        rest = FieldValues(
            np.tile(np.eye(3), (n_elements, 1, 1)), np.zeros((n_elements, 6)), zeros, zeros, zeros
        )
        convected = np.zeros((n_elements, N_POINTS, 6))
        return cls(rest, np.zeros((n_nodes, 3)), convected, zeros, np.ones(n_elements))


def fields_over_time(elements: np.ndarray, moments: Sequence[FieldValues]) -> ElementFields:
    """Stack the fields of the watched elements at each time."""
    return ElementFields(elements, *(np.stack(values) for values in zip(*moments, strict=True)))


@dataclass(frozen=True)
class Watched:
    """Elements whose fields are computed during an indentation."""

    elements: np.ndarray
    nodes_mm: FloatArray  # Reference nodes of the whole mesh, (n_nodes, 3). [mm]
    corners: np.ndarray
    layer: np.ndarray  # Their row of the material table, (n_elements,).
    table: MaterialTable

    @classmethod
    def of(cls, mesh: Mesh, table: MaterialTable, elements: np.ndarray) -> Watched:
        return cls(elements, mesh.nodes_mm, mesh.elements[elements], mesh.layer[elements], table)

    def after(
        self,
        before: FieldState,
        displacement_mm: FloatArray,
        history: StressHistory,
        now: InstantaneousState,
        stored_kpa: FloatArray,
    ) -> FieldState:
        """State at the end of a step."""
        chosen, n = self.elements, len(self.elements)
        convected = history.instantaneous[chosen] - history.relaxed[:, chosen].sum(axis=0)
        gradient, stress = np.empty((n, 3, 3)), np.empty((n, 6))
        pressure, dilatation, work = now.pressure_kpa[chosen], now.dilatation[chosen], np.empty(n)
        run_kernel(
            _mean_fields, n, self.nodes_mm, self.corners, displacement_mm, self.layer, self.table.law,
            convected, pressure, dilatation, gradient, stress,
        )  # fmt: skip
        run_kernel(
            _isochoric_work, n, self.nodes_mm, self.corners, self.layer, self.table.law,
            before.displacement_mm, displacement_mm, before.convected_kpa, convected, work,
        )  # fmt: skip
        work += 0.5 * (before.pressure_kpa + pressure) * (dilatation - before.dilatation)
        weights, isochoric = now.energies[chosen, :, 0], now.energies[chosen, :, 1]
        instantaneous = (weights * isochoric).sum(axis=1) / weights.sum(axis=1) + now.volumetric_kpa[chosen]
        values = FieldValues(
            gradient, stress, stored_kpa[chosen], instantaneous, before.values.work_kpa + work
        )
        return FieldState(values, displacement_mm, convected, pressure, dilatation)


def cauchy_stress(
    mesh: Mesh, displacement_mm: FloatArray, table: MaterialTable, history: StressHistory
) -> FloatArray:
    n = len(mesh.elements)
    stress, gradient = np.empty((n, 6)), np.empty((n, 3, 3))
    # Writable copies, as those of `Watched`: Numba then compiles one signature for both.
    corners, layer = mesh.elements.copy(), mesh.layer.copy()
    convected = history.instantaneous - history.relaxed.sum(axis=0)
    now = instantaneous_state(mesh, displacement_mm, table)
    run_kernel(
        _mean_fields, n, mesh.nodes_mm, corners, displacement_mm, layer, table.law, convected,
        now.pressure_kpa, now.dilatation, gradient, stress,
    )  # fmt: skip
    return stress


@njit(cache=True, nogil=True)
def _mean_fields(  # type: ignore[no-untyped-def]
    nodes, corners, displacement, layer, law, convected, pressure, dilatation, mean_gradient, stress,
    first, last,
):  # fmt: skip
    """Write the scaled mean gradient and the mean Cauchy stress of elements, given U'(Jbar) and Jbar."""
    weights, jacobians, scales = small_array((N_POINTS,)), small_array((N_POINTS,)), small_array((N_POINTS,))
    local, gradients = small_array((3, 3, N_POINTS)), small_array((3, 3, N_POINTS))
    spatial, mean = small_array((6, N_POINTS)), small_array((3, 3, 1))
    reference, moved = small_array((N_NODES, 3)), small_array((N_NODES, 3))
    for e in range(first, last):
        material = law[layer[e]]
        take_nodes(nodes, corners[e], reference)
        take_nodes(displacement, corners[e], moved)
        volume = deformation_at_points(reference, moved, weights, local, gradients)
        find_determinants(gradients, jacobians)
        frame_scales(material, jacobians, dilatation[e], scales)
        push_forward(gradients, scales, convected[e], spatial)
        for k in range(6):
            stress[e, k] = summed(weights, spatial[k])
        spherical = (stress[e, 0] + stress[e, 1] + stress[e, 2]) / 3.0
        present_volume = dilatation[e] * volume
        # Laws that couple shape and volume have their pressure in the convected stress, others in U.
        hydrostatic = pressure[e] + (spherical / present_volume if material[8] == COUPLED else 0.0)
        for k in range(3):
            stress[e, k] = (stress[e, k] - spherical) / present_volume + hydrostatic
            stress[e, k + 3] /= present_volume
        for i in range(3):
            for j in range(3):
                mean[i, j, 0] = summed(weights, gradients[i, j]) / volume
        find_determinants(mean, scales[:1])
        scale = (dilatation[e] / scales[0]) ** (1.0 / 3.0)
        for i in range(3):
            for j in range(3):
                mean_gradient[e, i, j] = scale * mean[i, j, 0]


@njit(cache=True, nogil=True)
def _isochoric_work(  # type: ignore[no-untyped-def]
    nodes, corners, layer, law, before, now, convected_before, convected_now, work, first, last,
):  # fmt: skip
    """Write the element means of 1/2 (S_n + S_n+1) : 1/2 (C_n+1 - C_n), with C as in `strain_changes`."""
    # The trapezoidal rule is over strain, not over time: it is exact if stress is linear in strain.
    weights, changes = small_array((N_POINTS,)), small_array((6, N_POINTS))
    reference, start, end = (
        small_array((N_NODES, 3)), small_array((N_NODES, 3)), small_array((N_NODES, 3)),
    )  # fmt: skip
    for e in range(first, last):
        take_nodes(nodes, corners[e], reference)
        take_nodes(before, corners[e], start)
        take_nodes(now, corners[e], end)
        volume = strain_changes(reference, start, end, law[layer[e]], weights, changes)
        total = 0.0
        for q in range(N_POINTS):
            for k in range(6):
                mean = 0.5 * (convected_before[e, q, k] + convected_now[e, q, k])
                total += weights[q] * mean * changes[k, q] * (1.0 if k < 3 else 2.0)
        work[e] = total / volume


LARGEST_RATIO = 1e6  # Largest s; the contact ends within 1e-12 of the distance there.

SHARE_BESIDE = 0.5
"""Share of the distance to a node that the indenter cannot touch: half, as in a node's tributary area."""


@dataclass(frozen=True)
class SkinContact:
    """Where and how hard the indenter presses, over time."""

    pressure_kpa: FloatArray
    """Normal force on each of `mesh.skin_nodes` over its present area, (n_times, n_skin_nodes). [kPa]"""
    shear_kpa: FloatArray  # Friction on each node over that area, (n_times, n_skin_nodes, 3). [kPa]
    slip_mm: FloatArray
    """How far each node in contact has slid over the indenter since it came to touch, with friction,
    (n_times, n_skin_nodes). [mm]"""
    area_mm2: FloatArray
    present_area_mm2: FloatArray
    """Skin in contact, undeformed and as it is then; always of the whole body, (n_times,). [mm²]"""


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
