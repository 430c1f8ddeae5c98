"""One 8-node brick with constant pressure at finite strain: energy, internal force, tangent.

Mean dilatation (Simo, Taylor & Pister 1985), the displacement form of a hybrid brick with one pressure:

    Pi_e = sum_q w_q [ s W(I1, I2)_q - 1/2 H_q : C~_q ] + V U(Jbar),       Jbar = v / V,

with reference volume V, present volume v, C~ = J^(-2/3) F'F the isochoric right Cauchy-Green tensor,
s and H from the Prony series of the step (see `viscoelastic`; s = 1, H = 0 without relaxation), and the
pressure p = U'(Jbar) one number per element. A wedge is a brick with one edge collapsed (two pairs of equal
nodes): its eight shape functions then add up to the six of the linear wedge.

A law given by a formula (see `energy`) is evaluated in principal axes. If its energy mixes shape and volume,
W(Jbar^(1/3) F~) takes the place of W and U, the whole stress relaxes, and C = Jbar^(2/3) C~ that of C~:

    Pi_e = sum_q w_q [ s W(x, ln Jbar)_q - 1/2 H_q : C_q ],        x_a = ln lambdabar_a.

Tensors are stored as xx, yy, zz, xy, yz, xz. All functions are compiled and single-threaded, so the answer
does not depend on the number of threads. Arrays over the points or the nodes of an element have them last,
and a function works on all of them in one loop (see `tensors`).

Products and sums keep their roundings (no contraction, no other order): else their last digits would depend
on which copy of a function, compiled into several others, is loaded first.
"""

from __future__ import annotations

import numpy as np
from numba import njit

from fingerpad.core.numba_internals import small_array
from fingerpad.core.values import FloatArray
from fingerpad.mechanics.energy import CARRIED, SECOND, differentiate
from fingerpad.mechanics.materials import COUPLED, N_COEFFICIENTS, POLYNOMIAL
from fingerpad.mechanics.tensors import (
    COLUMN,
    INDEX,
    ROW,
    add_in_axes,
    find_determinants,
    invert,
    left_cauchy_green,
    multiply_matrices,
    power_minus_two_thirds,
    principal_axes,
    push_forward,
)

N_NODES = 8
N_POINTS = 8
N_ROWS = 9  # Rows of the product that gives the tangent: the points, and the pressure of the element.
N_COLUMNS = 48  # Numbers of a row of the packed tangent, six pairs of directions times eight nodes.
WITH_VOLUME = SECOND[:3, 3].copy()


def _shape_derivatives() -> FloatArray:
    """dN/dxi of the trilinear brick at the 2x2x2 Gauss points, (8 points, 8 nodes, 3); weights are 1."""
    corners = np.array(
        [[-1, -1, -1], [1, -1, -1], [1, 1, -1], [-1, 1, -1], [-1, -1, 1], [1, -1, 1], [1, 1, 1], [-1, 1, 1]],
        dtype=float,
    )
    points = corners / np.sqrt(3.0)
    factor = 1.0 + points[:, None, :] * corners[None, :, :]
    derivatives = np.empty((N_POINTS, N_NODES, 3))
    for axis in range(3):
        others = [other for other in range(3) if other != axis]
        derivatives[:, :, axis] = corners[:, axis] * factor[:, :, others[0]] * factor[:, :, others[1]] / 8.0
    return derivatives


SHAPE_DERIVATIVES = _shape_derivatives()
BY_POINT = np.ascontiguousarray(SHAPE_DERIVATIVES.transpose(1, 2, 0))
BY_NODE = np.ascontiguousarray(SHAPE_DERIVATIVES.transpose(0, 2, 1))
"""The same with the points last, (node, axis, point), and with the nodes last, (point, axis, node)."""


@njit(cache=True, forceinline=True)
def _derivative(values, i, j, q):  # type: ignore[no-untyped-def]
    """Return d/dxi_j at point q of component i of nodal values (8, 3)."""
    return (
        values[0, i] * BY_POINT[0, j, q] + values[1, i] * BY_POINT[1, j, q]
        + values[2, i] * BY_POINT[2, j, q] + values[3, i] * BY_POINT[3, j, q]
        + values[4, i] * BY_POINT[4, j, q] + values[5, i] * BY_POINT[5, j, q]
        + values[6, i] * BY_POINT[6, j, q] + values[7, i] * BY_POINT[7, j, q]
    )  # fmt: skip


@njit(cache=True, inline="always")
def take_nodes(values, corners, taken):  # type: ignore[no-untyped-def]
    """Write the values (n_nodes, 3) of the nodes of one element, (8, 3)."""
    for a in range(N_NODES):
        for i in range(3):
            taken[a, i] = values[corners[a], i]


@njit(cache=True, forceinline=True, error_model="numpy")
def deformation_at_points(reference, displacement, weights, local, gradients):  # type: ignore[no-untyped-def]
    """Write gradients of the local coordinates and of the deformation at all points of one element.

    Writes `weights` (8,), `local` dxi/dX (3, 3, 8) and `gradients` F (3, 3, 8); returns the reference volume.
    """
    jacobian = small_array((3, 3, N_POINTS))
    for q in range(N_POINTS):
        for i in range(3):
            for j in range(3):
                jacobian[i, j, q] = _derivative(reference, i, j, q)
    invert(jacobian, local, weights)
    for q in range(N_POINTS):
        for i in range(3):
            x, y, z = (
                _derivative(displacement, i, 0, q),
                _derivative(displacement, i, 1, q),
                _derivative(displacement, i, 2, q),
            )
            for j in range(3):
                slope = x * local[0, j, q] + y * local[1, j, q] + z * local[2, j, q]
                gradients[i, j, q] = 1.0 + slope if i == j else slope
    volume = 0.0
    for q in range(N_POINTS):
        volume += weights[q]
    return volume


@njit(cache=True, forceinline=True)
def summed(weights, values):  # type: ignore[no-untyped-def]
    """Return the sum over the points of weights (8,) times values (8,)."""
    total = 0.0
    for q in range(N_POINTS):
        total += weights[q] * values[q]
    return total


@njit(cache=True, forceinline=True, error_model="numpy")
def frame_scales(law, jacobians, dilatation, scales):  # type: ignore[no-untyped-def]
    """Write factors c of the frame that carries the relaxing stress, tau = c F S F' (without U's).

    J^(-2/3), the isochoric frame; (Jbar/J)^(2/3) for laws whose whole stress relaxes.
    """
    ratios, whole = small_array((N_POINTS,)), dilatation if law[8] == COUPLED else 1.0
    for q in range(N_POINTS):
        ratios[q] = jacobians[q] / whole
    power_minus_two_thirds(ratios, scales)


@njit(cache=True, forceinline=True)
def _polynomial_points(law, first, second, b, b2, energies, stresses):  # type: ignore[no-untyped-def]
    """Write W (8,) and 2 dW/db b (6, 8) of a polynomial, from the isochoric b~ and its invariants."""
    c10, c01, c20, c11, c02 = law[0], law[1], law[2], law[3], law[4]
    for q in range(N_POINTS):
        x, y = first[q] - 3.0, second[q] - 3.0
        energies[q] = c10 * x + c01 * y + c20 * x * x + c11 * x * y + c02 * y * y
        w1, w2 = c10 + 2.0 * c20 * x + c11 * y, c01 + c11 * x + 2.0 * c02 * y
        for k in range(6):
            stresses[k, q] = 2.0 * ((w1 + first[q] * w2) * b[k, q] - w2 * b2[k, q])


@njit(cache=True)
def _formula_points(law, b, dilatation, logs, axes, derivatives):  # type: ignore[no-untyped-def]
    # From the isochoric b~ (6, 8) it writes `logs` (8, 4), `axes` (8, 3, 3) and `derivatives` (8, 15) of W,
    # and returns the volumetric energy. Unless shape and volume are coupled, that is no part of W, but its
    # derivatives are kept.
    count, factor = int(law[10]), law[9]
    results = np.empty((count + 1, CARRIED))
    volumetric = 0.0
    if law[8] != COUPLED:
        logs[0, :3], logs[0, 3] = 0.0, np.log(dilatation)
        differentiate(law[N_COEFFICIENTS:], count, logs[0], results)
        volumetric = results[count - 1, 0]
    for q in range(N_POINTS):
        principal_axes(b, q, logs[q], axes[q])
        logs[q, 3] = np.log(dilatation)
        differentiate(law[N_COEFFICIENTS:], count, logs[q], results)
        for k in range(CARRIED):
            derivatives[q, k] = factor * results[count - 1, k]
        if law[8] != COUPLED:
            derivatives[q, 0] -= factor * volumetric
            derivatives[q, 4], derivatives[q, 14] = results[count - 1, 4], results[count - 1, 14]
    return volumetric


@njit(cache=True, inline="always")
def _principal_points(derivatives, axes, energies, stresses):  # type: ignore[no-untyped-def]
    """Write W (8,) and sum_a dW/dx_a n_a x n_a (6, 8) of a formula."""
    for q in range(N_POINTS):
        energies[q] = derivatives[q, 0]
        for k in range(6):
            stresses[k, q] = 0.0
        add_in_axes(1.0, derivatives[q, 1:4], axes[q], stresses, q)


@njit(cache=True, forceinline=True)
def _kirchhoff(s, relaxed, pressure, jacobians, stresses, tau):  # type: ignore[no-untyped-def]
    """Replace `stresses` by T = s T - relaxed, and write Kirchhoff's tau = dev T + p J 1, all (6, 8)."""
    for q in range(N_POINTS):
        xx, yy, zz = (
            s * stresses[0, q] - relaxed[0, q], s * stresses[1, q] - relaxed[1, q],
            s * stresses[2, q] - relaxed[2, q],
        )  # fmt: skip
        shift = pressure * jacobians[q] - (xx + yy + zz) / 3.0
        stresses[0, q], stresses[1, q], stresses[2, q] = xx, yy, zz
        tau[0, q], tau[1, q], tau[2, q] = xx + shift, yy + shift, zz + shift
        for k in range(3, 6):
            stresses[k, q] = tau[k, q] = s * stresses[k, q] - relaxed[k, q]


@njit(cache=True, forceinline=True)
def _elasticity(stresses, pressure, jacobians, moduli):  # type: ignore[no-untyped-def]
    """Write the part of the spatial (Kirchhoff) elasticity (6, 6, 8) that needs no second derivatives."""
    # `stresses` T (6, 8) are those before the deviator is taken; with p' = p J
    #
    # c = P : c~ : P + 2/3 tr(T) (I_s - 1/3 1x1) - 2/3 (dev T x 1 + 1 x dev T) + p' (1x1 - 2 I_s),
    #
    # of which c~ is left out.
    for q in range(N_POINTS):
        trace, spherical = stresses[0, q] + stresses[1, q] + stresses[2, q], pressure * jacobians[q]
        identity, both = 2.0 / 3.0 * trace - 2.0 * spherical, spherical - 2.0 / 9.0 * trace
        xx, yy, zz = (
            -2.0 / 3.0 * (stresses[0, q] - trace / 3.0), -2.0 / 3.0 * (stresses[1, q] - trace / 3.0),
            -2.0 / 3.0 * (stresses[2, q] - trace / 3.0),
        )  # fmt: skip
        moduli[0, 0, q] = both + identity + 2.0 * xx
        moduli[1, 1, q] = both + identity + 2.0 * yy
        moduli[2, 2, q] = both + identity + 2.0 * zz
        moduli[0, 1, q] = moduli[1, 0, q] = both + xx + yy
        moduli[0, 2, q] = moduli[2, 0, q] = both + xx + zz
        moduli[1, 2, q] = moduli[2, 1, q] = both + yy + zz
        for k in range(3, 6):
            shear = -2.0 / 3.0 * stresses[k, q]
            for m in range(3):
                moduli[m, k, q] = moduli[k, m, q] = shear
                moduli[m + 3, k, q] = 0.5 * identity if m + 3 == k else 0.0


@njit(cache=True)
def _add_polynomial(law, s, first, b, b2, q, moduli):  # type: ignore[no-untyped-def]
    """Add P : c~ : P of the polynomial at point q, with"""
    # c~ = d1 b x b + d2 (b x b² + b² x b) + d3 b² x b² + d4 b . b.
    third, third_b2 = first / 3.0, (b2[0, q] + b2[1, q] + b2[2, q]) / 3.0
    second = 0.5 * (first * first - 3.0 * third_b2)
    w2 = law[1] + law[3] * (first - 3.0) + 2.0 * law[4] * (second - 3.0)
    w11, w12, w22 = 2.0 * law[2], law[3], 2.0 * law[4]
    d1 = 4.0 * s * (w2 + w11 + 2.0 * first * w12 + first * first * w22)
    d2 = -4.0 * s * (w12 + first * w22)
    d3 = 4.0 * s * w22
    d4 = -4.0 * s * w2
    for m in range(6):
        i, j = ROW[m], COLUMN[m]
        one_m = 1.0 if m < 3 else 0.0
        db_m, db2_m = b[m, q] - third * one_m, b2[m, q] - third_b2 * one_m
        with_db, with_db2 = d1 * db_m + d2 * db2_m, d2 * db_m + d3 * db2_m
        with_one, with_b2 = d4 * (third_b2 * one_m - b2[m, q]) / 3.0, -d4 * one_m / 3.0
        for n in range(6):
            k, l = ROW[n], COLUMN[n]  # noqa: E741 - the index letters of the formula
            one_n = 1.0 if n < 3 else 0.0
            # (b . b)_ij,kl = (b_ik b_jl + b_il b_jk) / 2
            product = 0.5 * (b[INDEX[i, k], q] * b[INDEX[j, l], q] + b[INDEX[i, l], q] * b[INDEX[j, k], q])
            db_n, db2_n = b[n, q] - third * one_n, b2[n, q] - third_b2 * one_n
            moduli[m, n, q] += with_db * db_n + with_db2 * db2_n + d4 * product
            moduli[m, n, q] += with_one * one_n + with_b2 * b2[n, q]


@njit(cache=True)
def _add_principal(s, derivatives, logs, axes, q, moduli):  # type: ignore[no-untyped-def]
    """Add P : c~ : P of a formula at point q, from h_ab = d²W/dx_a dx_b and beta_a = dW/dx_a."""
    # Along the axes c~_aabb = h_ab - 2 beta_a delta_ab; between them, with l the squares of the stretches,
    # c~_abab = (beta_a l_b - beta_b l_a) / (l_a - l_b), or (h_aa - h_ab) / 2 - beta_a for equal stretches.
    block, mean = small_array((3, 3)), small_array((3,))
    mean[:] = 0.0
    for a in range(3):
        for c in range(3):
            block[a, c] = derivatives[SECOND[a, c]] - (2.0 * derivatives[1 + a] if a == c else 0.0)
            mean[c] += block[a, c] / 3.0
    total = (mean[0] + mean[1] + mean[2]) / 3.0
    mixed = small_array((6,))
    for a in range(3):
        for c in range(3):
            value = s * (block[a, c] - mean[a] - mean[c] + total)
            for m in range(6):
                left = value * axes[a, ROW[m]] * axes[a, COLUMN[m]]
                for n in range(6):
                    moduli[m, n, q] += left * axes[c, ROW[n]] * axes[c, COLUMN[n]]
    for a in range(2):
        for c in range(a + 1, 3):
            beta_a, beta_c = derivatives[1 + a], derivatives[1 + c]
            difference = logs[a] - logs[c]
            if abs(difference) < EQUAL_STRETCHES:
                mean_square = 0.25 * (derivatives[SECOND[a, a]] + derivatives[SECOND[c, c]])
                shear = mean_square - 0.5 * derivatives[SECOND[a, c]] - 0.5 * (beta_a + beta_c)
            else:
                square_a, square_c = np.exp(2.0 * logs[a]), np.exp(2.0 * logs[c])
                shear = (beta_a * square_c - beta_c * square_a) / (square_a - square_c)
            for k in range(6):
                i, j = ROW[k], COLUMN[k]
                mixed[k] = axes[a, i] * axes[c, j] + axes[a, j] * axes[c, i]
            for m in range(6):
                for n in range(6):
                    moduli[m, n, q] += s * shear * mixed[m] * mixed[n]


EQUAL_STRETCHES = 1e-5
"""Difference of logarithms below which two stretches count as equal; both formulas then err by 1e-10."""


@njit(cache=True, forceinline=True)
def _point_forces(q, weight, jacobian, local, tau, present, forces, dilatation):  # type: ignore[no-untyped-def]
    # Writes G = dN/dx (3, 8), and adds w tau G to `forces` and w J G to `dilatation`, both (3, 8).
    for node in range(N_NODES):
        u, v, w = BY_NODE[q, 0, node], BY_NODE[q, 1, node], BY_NODE[q, 2, node]
        x = u * local[0, 0, q] + v * local[1, 0, q] + w * local[2, 0, q]
        y = u * local[0, 1, q] + v * local[1, 1, q] + w * local[2, 1, q]
        z = u * local[0, 2, q] + v * local[1, 2, q] + w * local[2, 2, q]
        present[0, node], present[1, node], present[2, node] = x, y, z
        x, y, z = weight * x, weight * y, weight * z
        forces[0, node] += tau[0, q] * x + tau[3, q] * y + tau[5, q] * z
        forces[1, node] += tau[3, q] * x + tau[1, q] * y + tau[4, q] * z
        forces[2, node] += tau[5, q] * x + tau[4, q] * y + tau[2, q] * z
        dilatation[0, node] += jacobian * x
        dilatation[1, node] += jacobian * y
        dilatation[2, node] += jacobian * z


@njit(cache=True, forceinline=True)
def _point_products(q, weight, moduli, tau, present, products):  # type: ignore[no-untyped-def]
    """Write V_ij = w A_ij G of point q for i <= j, with A_ij,pr = c_ip,jr + delta_ij tau_pr."""
    # `products` (3, 48) has the pairs ij in the order of a tensor's components, and the eight nodes of a pair
    # side by side. Every pair is spelt out: loops over pairs would keep the compiler from vector
    # instructions.
    c = moduli
    for node in range(N_NODES):
        x, y, z = weight * present[0, node], weight * present[1, node], weight * present[2, node]
        tau_x = tau[0, q] * x + tau[3, q] * y + tau[5, q] * z
        tau_y = tau[3, q] * x + tau[1, q] * y + tau[4, q] * z
        tau_z = tau[5, q] * x + tau[4, q] * y + tau[2, q] * z
        products[0, node] = c[0, 0, q] * x + c[0, 3, q] * y + c[0, 5, q] * z + tau_x
        products[1, node] = c[3, 0, q] * x + c[3, 3, q] * y + c[3, 5, q] * z + tau_y
        products[2, node] = c[5, 0, q] * x + c[5, 3, q] * y + c[5, 5, q] * z + tau_z
        column = N_NODES + node
        products[0, column] = c[3, 3, q] * x + c[3, 1, q] * y + c[3, 4, q] * z + tau_x
        products[1, column] = c[1, 3, q] * x + c[1, 1, q] * y + c[1, 4, q] * z + tau_y
        products[2, column] = c[4, 3, q] * x + c[4, 1, q] * y + c[4, 4, q] * z + tau_z
        column = 2 * N_NODES + node
        products[0, column] = c[5, 5, q] * x + c[5, 4, q] * y + c[5, 2, q] * z + tau_x
        products[1, column] = c[4, 5, q] * x + c[4, 4, q] * y + c[4, 2, q] * z + tau_y
        products[2, column] = c[2, 5, q] * x + c[2, 4, q] * y + c[2, 2, q] * z + tau_z
        column = 3 * N_NODES + node
        products[0, column] = c[0, 3, q] * x + c[0, 1, q] * y + c[0, 4, q] * z
        products[1, column] = c[3, 3, q] * x + c[3, 1, q] * y + c[3, 4, q] * z
        products[2, column] = c[5, 3, q] * x + c[5, 1, q] * y + c[5, 4, q] * z
        column = 4 * N_NODES + node
        products[0, column] = c[3, 5, q] * x + c[3, 4, q] * y + c[3, 2, q] * z
        products[1, column] = c[1, 5, q] * x + c[1, 4, q] * y + c[1, 2, q] * z
        products[2, column] = c[4, 5, q] * x + c[4, 4, q] * y + c[4, 2, q] * z
        column = 5 * N_NODES + node
        products[0, column] = c[0, 5, q] * x + c[0, 4, q] * y + c[0, 2, q] * z
        products[1, column] = c[3, 5, q] * x + c[3, 4, q] * y + c[3, 2, q] * z
        products[2, column] = c[5, 5, q] * x + c[5, 4, q] * y + c[5, 2, q] * z


@njit(cache=True, forceinline=True)
def _add_rows(slopes, products, packed):  # type: ignore[no-untyped-def]
    """Write K_ij = sum_q G_q' V_ij,q of all pairs ij as one product of matrices."""
    # `slopes` is G_q (rows q, 3, 8), `products` V_ij,q (rows q, 3, 48) and `packed` K_ij (8, 48). The
    # innermost loop runs over 48 neighbours in memory, which is what vector registers want.
    for node in range(N_NODES):
        for k in range(N_COLUMNS):
            packed[node, k] = 0.0
        for q in range(N_ROWS):
            x, y, z = slopes[q, 0, node], slopes[q, 1, node], slopes[q, 2, node]
            for k in range(N_COLUMNS):
                packed[node, k] += x * products[q, 0, k] + y * products[q, 1, k] + z * products[q, 2, k]


@njit(cache=True, forceinline=True)
def add_tangent(packed, position, blocks):  # type: ignore[no-untyped-def]
    for a in range(N_NODES):
        for b in range(N_NODES):
            target, low, high = position[a, b], min(a, b), max(a, b)  # K_ii is symmetric but for round-off
            blocks[target, 0, 0] += packed[low, high]
            blocks[target, 1, 1] += packed[low, N_NODES + high]
            blocks[target, 2, 2] += packed[low, 2 * N_NODES + high]
            blocks[target, 0, 1] += packed[a, 3 * N_NODES + b]
            blocks[target, 1, 0] += packed[b, 3 * N_NODES + a]
            blocks[target, 1, 2] += packed[a, 4 * N_NODES + b]
            blocks[target, 2, 1] += packed[b, 4 * N_NODES + a]
            blocks[target, 0, 2] += packed[a, 5 * N_NODES + b]
            blocks[target, 2, 0] += packed[b, 5 * N_NODES + a]


@njit(cache=True, error_model="numpy")
def element_system(  # type: ignore[no-untyped-def]
    reference, displacement, law, s, history, with_tangent, force, tangent, formulas=True
):
    weights, jacobians, scales = small_array((N_POINTS,)), small_array((N_POINTS,)), small_array((N_POINTS,))
    local, onto = small_array((3, 3, N_POINTS)), small_array((3, 3, N_POINTS))  # dxi/dX and dxi/dx
    gradients, inverse = small_array((3, 3, N_POINTS)), small_array((3, 3, N_POINTS))
    b, b2, relaxed = small_array((6, N_POINTS)), small_array((6, N_POINTS)), small_array((6, N_POINTS))
    first, second, energies = small_array((N_POINTS,)), small_array((N_POINTS,)), small_array((N_POINTS,))
    stresses, tau = small_array((6, N_POINTS)), small_array((6, N_POINTS))
    moduli, forces = small_array((6, 6, N_POINTS)), small_array((3, N_NODES))
    slopes, products = small_array((N_ROWS, 3, N_NODES)), small_array((N_ROWS, 3, N_COLUMNS))

    volume = deformation_at_points(reference, displacement, weights, local, gradients)
    invert(gradients, inverse, jacobians)
    for q in range(N_POINTS):
        if not jacobians[q] > 0.0:
            return np.nan
    multiply_matrices(local, inverse, onto)
    present_volume = summed(weights, jacobians)
    mean_jacobian = present_volume / volume
    is_formula, is_coupled = law[8] != POLYNOMIAL, law[8] == COUPLED
    frame_scales(law, jacobians, mean_jacobian, scales)
    push_forward(gradients, scales, history, relaxed)
    if formulas is not None and is_coupled:
        power_minus_two_thirds(jacobians, scales)
    left_cauchy_green(gradients, scales, b, b2, first, second)
    if formulas is not None and is_formula:
        logs, axes = small_array((N_POINTS, 4)), small_array((N_POINTS, 3, 3))
        derivatives = small_array((N_POINTS, CARRIED))
        potential = volume * _formula_points(law, b, mean_jacobian, logs, axes, derivatives)
        _principal_points(derivatives, axes, energies, stresses)
        pressure, stiffness = 0.0, 0.0  # first the sums of dW/d(ln Jbar) and of its own slope
        for q in range(N_POINTS):
            share = s if is_coupled else 1.0
            slope, curvature = share * derivatives[q, 4], share * derivatives[q, 14]
            if is_coupled:
                trace = relaxed[0, q] + relaxed[1, q] + relaxed[2, q]
                slope, curvature = slope - trace / 3.0, curvature - 2.0 / 9.0 * trace
            pressure += weights[q] * slope / present_volume
            stiffness += weights[q] * (curvature - slope) / present_volume**2
    else:
        _polynomial_points(law, first, second, b, b2, energies, stresses)
        change = mean_jacobian - 1.0
        pressure = 2.0 * law[5] * change + 4.0 * law[6] * change**3
        stiffness = (2.0 * law[5] + 12.0 * law[6] * change**2) / volume
        potential = volume * (law[5] * change**2 + law[6] * change**4)
    for q in range(N_POINTS):
        # -1/2 H : C is half the trace of the pushed-forward history.
        trace = relaxed[0, q] + relaxed[1, q] + relaxed[2, q]
        potential += weights[q] * (s * energies[q] - 0.5 * trace)
    _kirchhoff(s, relaxed, pressure, jacobians, stresses, tau)

    dilatation = slopes[N_POINTS]
    for i in range(3):
        for node in range(N_NODES):
            forces[i, node] = dilatation[i, node] = 0.0
    for q in range(N_POINTS):
        _point_forces(q, weights[q], jacobians[q], onto, tau, slopes[q], forces, dilatation)
    for node in range(N_NODES):
        for i in range(3):
            force[node, i] = forces[i, node]
    if not with_tangent:
        return potential

    _elasticity(stresses, pressure, jacobians, moduli)
    if formulas is not None and is_formula:
        for q in range(N_POINTS):
            _add_principal(s, derivatives[q], logs[q], axes[q], q, moduli)
    elif law[1] != 0.0 or law[2] != 0.0 or law[3] != 0.0 or law[4] != 0.0:  # all are zero for neo-Hooke
        for q in range(N_POINTS):
            _add_polynomial(law, s, first[q], b, b2, q, moduli)
    for q in range(N_POINTS):
        _point_products(q, weights[q], moduli, tau, slopes[q], products[q])
    # Pressure adds stiffness dv dv' with dv the slopes of the present volume, a row like those of the points.
    for i in range(3):
        for k in range(N_COLUMNS):
            products[N_POINTS, i, k] = 0.0
    for pair in range(6):
        for node in range(N_NODES):
            slope = stiffness * dilatation[COLUMN[pair], node]
            products[N_POINTS, ROW[pair], N_NODES * pair + node] = slope
    _add_rows(slopes, products, tangent)
    if formulas is not None and is_coupled:
        coupling = small_array((3, N_NODES))
        _couple(s, weights, present_volume, derivatives, axes, relaxed, slopes, coupling)
        for pair in range(6):
            i, j = ROW[pair], COLUMN[pair]
            for node in range(N_NODES):
                for other in range(N_NODES):
                    both = coupling[i, node] * dilatation[j, other] + dilatation[i, node] * coupling[j, other]
                    tangent[node, N_NODES * pair + other] += both
    return potential


@njit(cache=True)
def _couple(s, weights, present_volume, derivatives, axes, relaxed, slopes, coupling):  # type: ignore[no-untyped-def]
    """Write the coupling of shape and volume (3, 8): d²W / dx d(ln Jbar) acts like a stress."""
    # `relaxed` (6, 8) is overwritten.
    with_volume = small_array((3,))
    coupling[:] = 0.0
    for q in range(N_POINTS):
        for k in range(6):
            relaxed[k, q] *= -2.0 / 3.0
        for a in range(3):
            with_volume[a] = derivatives[q, WITH_VOLUME[a]]
        add_in_axes(s, with_volume, axes[q], relaxed, q)
        mean = (relaxed[0, q] + relaxed[1, q] + relaxed[2, q]) / 3.0
        for i in range(3):
            for node in range(N_NODES):
                for j in range(3):
                    component = relaxed[INDEX[i, j], q] - (mean if i == j else 0.0)
                    coupling[i, node] += weights[q] / present_volume * component * slopes[q, j, node]


@njit(cache=True, error_model="numpy")
def element_state(reference, displacement, law, instantaneous, energies, formulas=True):  # type: ignore[no-untyped-def]
    """Instantaneous relaxing stress and energies at the points of one element."""
    weights, jacobians, scales = small_array((N_POINTS,)), small_array((N_POINTS,)), small_array((N_POINTS,))
    local, gradients = small_array((3, 3, N_POINTS)), small_array((3, 3, N_POINTS))
    inverse, b, b2 = small_array((3, 3, N_POINTS)), small_array((6, N_POINTS)), small_array((6, N_POINTS))
    first, second, densities = small_array((N_POINTS,)), small_array((N_POINTS,)), small_array((N_POINTS,))
    stresses, deviators = small_array((6, N_POINTS)), small_array((N_POINTS, 6))
    is_formula, is_coupled = law[8] != POLYNOMIAL, law[8] == COUPLED
    volume = deformation_at_points(reference, displacement, weights, local, gradients)
    invert(gradients, inverse, jacobians)
    mean_jacobian = summed(weights, jacobians) / volume
    change = mean_jacobian - 1.0
    volumetric = law[5] * change**2 + law[6] * change**4
    pressure = 2.0 * law[5] * change + 4.0 * law[6] * change**3
    power_minus_two_thirds(jacobians, scales)
    left_cauchy_green(gradients, scales, b, b2, first, second)
    if formulas is not None and is_formula:
        logs, axes = small_array((N_POINTS, 4)), small_array((N_POINTS, 3, 3))
        derivatives = small_array((N_POINTS, CARRIED))
        volumetric = _formula_points(law, b, mean_jacobian, logs, axes, derivatives)
        pressure = 0.0 if is_coupled else derivatives[0, 4] / mean_jacobian
        _principal_points(derivatives, axes, densities, stresses)
    else:
        _polynomial_points(law, first, second, b, b2, densities, stresses)
    frame_scales(law, jacobians, mean_jacobian, scales)
    for q in range(N_POINTS):
        scales[q] = 1.0 / scales[q]
        mean = (stresses[0, q] + stresses[1, q] + stresses[2, q]) / 3.0
        if formulas is not None and is_coupled:  # not a deviator then
            mean -= derivatives[q, 4]
        for k in range(6):
            deviators[q, k] = stresses[k, q] - (mean if k < 3 else 0.0)
        energies[q, 0], energies[q, 1] = weights[q], densities[q]
    push_forward(inverse, scales, deviators, stresses)
    for q in range(N_POINTS):
        for k in range(6):
            instantaneous[q, k] = stresses[k, q]
    return volumetric, pressure, mean_jacobian


@njit(cache=True, error_model="numpy")
def relaxing_norms(reference, displacement, law, tensors, norms):  # type: ignore[no-untyped-def]
    """Squared norm of the spatial stress c F T F' of reference tensors, or of its deviator."""
    weights, jacobians, scales = small_array((N_POINTS,)), small_array((N_POINTS,)), small_array((N_POINTS,))
    local, gradients = small_array((3, 3, N_POINTS)), small_array((3, 3, N_POINTS))
    spatial, whole = small_array((6, N_POINTS)), 1.0 if law[8] == COUPLED else 0.0
    volume = deformation_at_points(reference, displacement, weights, local, gradients)
    find_determinants(gradients, jacobians)
    frame_scales(law, jacobians, summed(weights, jacobians) / volume, scales)
    for n in range(tensors.shape[0]):
        push_forward(gradients, scales, tensors[n], spatial)
        for q in range(N_POINTS):
            xx, yy, zz = spatial[0, q], spatial[1, q], spatial[2, q]
            mean = (1.0 - whole) * (xx + yy + zz) / 3.0
            xx, yy, zz = xx - mean, yy - mean, zz - mean
            xy, yz, xz = spatial[3, q], spatial[4, q], spatial[5, q]
            norms[n, q] = xx * xx + yy * yy + zz * zz + 2.0 * (xy * xy + yz * yz + xz * xz)


@njit(cache=True, error_model="numpy")
def strain_changes(reference, before, now, law, weights, changes):  # type: ignore[no-untyped-def]
    """Change of strain between two states, 1/2 (C_n+1 - C_n) with C = c F'F of `frame_scales`."""
    start, end, local = (
        small_array((3, 3, N_POINTS)), small_array((3, 3, N_POINTS)), small_array((3, 3, N_POINTS)),
    )  # fmt: skip
    jacobians, first, last = small_array((N_POINTS,)), small_array((N_POINTS,)), small_array((N_POINTS,))
    volume = deformation_at_points(reference, before, weights, local, start)
    find_determinants(start, jacobians)
    frame_scales(law, jacobians, summed(weights, jacobians) / volume, first)
    deformation_at_points(reference, now, weights, local, end)
    find_determinants(end, jacobians)
    frame_scales(law, jacobians, summed(weights, jacobians) / volume, last)
    for q in range(N_POINTS):
        for k in range(6):
            i, j = ROW[k], COLUMN[k]
            c_first = start[0, i, q] * start[0, j, q] + start[1, i, q] * start[1, j, q]
            c_last = end[0, i, q] * end[0, j, q] + end[1, i, q] * end[1, j, q]
            c_first = first[q] * (c_first + start[2, i, q] * start[2, j, q])
            c_last = last[q] * (c_last + end[2, i, q] * end[2, j, q])
            changes[k, q] = 0.5 * (c_last - c_first)
    return volume
