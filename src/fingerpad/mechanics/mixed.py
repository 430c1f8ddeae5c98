"""Pressure as an unknown of its own in Newton's method, for bodies that hardly change their volume.

The pressure of a brick follows from its volume, p = U'(Jbar). Near nu = 0.5 this slows Newton's method down:
a Newton step of size d leaves an error of d² in the volumes, the bulk modulus turns it into a pressure far
above the true one, and with this pressure the tangent

    K = K_dev + U''/V dv dv' + p d²v

is not positive definite any more (v is the volume of an element, dv and d²v its derivatives). With pressure
and displacements as unknowns of a mixed method, Newton's method reads the same, but p in the tangent is the
pressure that its last step u -> u + du has found,

    p = U'(Jbar(u)) + U''/V dv(u)·du,

whose error is that of a linear step, whatever the bulk modulus.
The equations are the same: only the tangent changes, and at the solution it is the same too. Laws that couple
shape and volume, which are those of foams, are not changed.
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from numba import njit

from fingerpad.core.numba_internals import small_array
from fingerpad.core.threads import in_chunks, run_kernel
from fingerpad.core.values import FloatArray
from fingerpad.geometry.mesh import Mesh
from fingerpad.mechanics.assembly import Sparsity
from fingerpad.mechanics.element import BY_NODE, N_NODES, N_POINTS, deformation_at_points, summed, take_nodes
from fingerpad.mechanics.energy import CARRIED, differentiate
from fingerpad.mechanics.materials import COUPLED, N_COEFFICIENTS, POLYNOMIAL
from fingerpad.mechanics.tensors import invert, multiply_matrices

MIXED_POISSON = 0.49
"""Poisson's ratio above which the method is used. A Newton step takes a quarter more time; a block takes 15
steps instead of 17 at this ratio, and 21 instead of 116 at 0.4999."""


@dataclass(frozen=True)
class Pressures:
    """Pressure of every element and how it changes with the displacements."""

    pressure_kpa: FloatArray  # U'(Jbar); 0 where shape and volume are coupled, (n_elements,). [kPa]
    slope_kpa_per_mm: FloatArray
    """Its derivative by the displacement of each node, (n_elements, 8, 3). [kPa/mm]"""

    @classmethod
    def of(cls, mesh: Mesh, displacement: FloatArray, law: FloatArray) -> Pressures:
        """Pressures of a mesh at its displacements; `law` is that of `MaterialTable`."""
        n = len(mesh.elements)
        pressure, slope = np.empty(n), np.empty((n, N_NODES, 3))
        where = mesh.nodes_mm, mesh.elements, displacement, mesh.layer
        run_kernel(_pressures, n, *where, law, pressure, slope)
        return cls(pressure, slope)

    def after(self, elements: np.ndarray, step_mm: FloatArray) -> FloatArray:
        """Pressures (n_elements,) that a step (n_nodes, 3) leads to, to first order. [kPa]"""
        return self.pressure_kpa + np.einsum("eai,eai->e", self.slope_kpa_per_mm, step_mm[elements])


@njit(cache=True)
def _volumetric_slopes(law, jacobian):  # type: ignore[no-untyped-def]
    """First and second derivative of U; zeros if shape and volume are coupled."""
    if law[8] == POLYNOMIAL:
        change = jacobian - 1.0
        return 2.0 * law[5] * change + 4.0 * law[6] * change**3, 2.0 * law[5] + 12.0 * law[6] * change**2
    if law[8] == COUPLED:
        return 0.0, 0.0
    count = int(law[10])
    results, logs = np.empty((count + 1, CARRIED)), np.zeros(4)
    logs[3] = np.log(jacobian)
    differentiate(law[N_COEFFICIENTS:], count, logs, results)
    first, second = results[count - 1, 4], results[count - 1, 14]  # by ln J
    return first / jacobian, (second - first) / jacobian**2


@njit(cache=True)
def _present_slopes(reference, displacement, weights, jacobians, slopes):  # type: ignore[no-untyped-def]
    """Write weights and J (8,) and dN/dx (points, 3, nodes) of one element; return its reference volume."""
    local, gradients = small_array((3, 3, N_POINTS)), small_array((3, 3, N_POINTS))
    inverse, onto = small_array((3, 3, N_POINTS)), small_array((3, 3, N_POINTS))
    volume = deformation_at_points(reference, displacement, weights, local, gradients)
    invert(gradients, inverse, jacobians)
    multiply_matrices(local, inverse, onto)
    for q in range(N_POINTS):
        for i in range(3):
            for a in range(N_NODES):
                slopes[q, i, a] = 0.0
                for k in range(3):
                    slopes[q, i, a] += BY_NODE[q, k, a] * onto[k, i, q]
    return volume


@njit(cache=True, nogil=True)
def _pressures(nodes, elements, displacement, layer, law, pressure, slope, first, last):  # type: ignore[no-untyped-def]
    weights, jacobians = small_array((N_POINTS,)), small_array((N_POINTS,))
    slopes = small_array((N_POINTS, 3, N_NODES))
    reference, moved = small_array((N_NODES, 3)), small_array((N_NODES, 3))
    for e in range(first, last):
        take_nodes(nodes, elements[e], reference)
        take_nodes(displacement, elements[e], moved)
        volume = _present_slopes(reference, moved, weights, jacobians, slopes)
        dilatation = summed(weights, jacobians) / volume
        pressure[e], stiffness = _volumetric_slopes(law[layer[e]], dilatation)
        for a in range(N_NODES):
            for i in range(3):
                change = 0.0  # dv
                for q in range(N_POINTS):
                    change += weights[q] * jacobians[q] * slopes[q, i, a]
                slope[e, a, i] = change * stiffness / volume


def exchange_pressure(
    mesh: Mesh, displacement: FloatArray, change: FloatArray, sparsity: Sparsity, blocks: np.ndarray
) -> None:
    """Add (change of p) d²v of every element to a tangent.

    With g the present gradients of the shape functions, d²v_ai,bj = sum_q w_q J_q (g_ai g_bj - g_aj g_bi).
    """

    def exchange(first: int, last: int) -> None:
        where = mesh.nodes_mm, mesh.elements, displacement
        _exchange_chunk(*where, change, sparsity.position, blocks, first, last)

    for chunks in sparsity.colours:
        in_chunks(exchange, chunks)


@njit(cache=True, nogil=True)
def _exchange_chunk(nodes, elements, displacement, change, position, blocks, first, last):  # type: ignore[no-untyped-def]
    """Add the elements from `first` up to `last`; each block is written once per element."""
    weights, jacobians = small_array((N_POINTS,)), small_array((N_POINTS,))
    slopes, sums = small_array((N_POINTS, 3, N_NODES)), small_array((N_NODES, N_NODES, 3))
    reference, moved = small_array((N_NODES, 3)), small_array((N_NODES, 3))
    for e in range(first, last):
        if change[e] == 0.0:
            continue
        take_nodes(nodes, elements[e], reference)
        take_nodes(displacement, elements[e], moved)
        _present_slopes(reference, moved, weights, jacobians, slopes)
        sums[:] = 0.0
        for q in range(N_POINTS):
            factor, g = change[e] * weights[q] * jacobians[q], slopes[q]
            for a in range(N_NODES):
                for b in range(N_NODES):
                    for k in range(3):
                        i, j = (k + 1) % 3, (k + 2) % 3
                        sums[a, b, k] += factor * (g[i, a] * g[j, b] - g[j, a] * g[i, b])
        for a in range(N_NODES):
            for b in range(N_NODES):
                for k in range(3):  # antisymmetric in i and j
                    i, j = (k + 1) % 3, (k + 2) % 3
                    blocks[position[e, a, b], i, j] += sums[a, b, k]
                    blocks[position[e, a, b], j, i] -= sums[a, b, k]
