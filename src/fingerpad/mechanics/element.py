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

Tensors are stored as xx, yy, zz, xy, yz, xz. All functions are compiled and single-threaded,
so the answer does not depend on the number of threads.

Products and sums keep their roundings (no contraction, no other order): else their last digits would depend
on which copy of a function, compiled into several others, is loaded first.
"""

from __future__ import annotations

import numpy as np
from numba import njit

from fingerpad.core.checks import FloatArray
from fingerpad.core.numba_internals import small_array
from fingerpad.mechanics.energy import CARRIED, SECOND, differentiate
from fingerpad.mechanics.materials import COUPLED, N_COEFFICIENTS, POLYNOMIAL
from fingerpad.mechanics.tensors import (
    COLUMN,
    INDEX,
    ROW,
    add_in_axes,
    invert,
    left_cauchy_green,
    principal_axes,
    push_forward,
)

N_NODES = 8
N_POINTS = 8
N_COLUMNS = 6 * N_NODES
"""Numbers of a row of the packed tangent, six pairs of directions times eight nodes."""
ONE = np.array([1.0, 1.0, 1.0, 0.0, 0.0, 0.0])
WITH_VOLUME = SECOND[:3, 3].copy()
_0, _1, _2, _3, _4, _5 = (np.int64(number) for number in range(6))
"""Typed numbers: Numba would compile a called function once more for each literal number."""


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


@njit(cache=True, inline="always")
def _energy(law, first, second):  # type: ignore[no-untyped-def]
    """Isochoric energy W and its first derivatives W1, W2 at the invariants."""
    x, y = first - 3.0, second - 3.0
    energy = law[0] * x + law[1] * y + law[2] * x * x + law[3] * x * y + law[4] * y * y
    return energy, law[0] + 2.0 * law[2] * x + law[3] * y, law[1] + law[3] * x + 2.0 * law[4] * y


@njit(cache=True, inline="always")
def _elasticity(stress, deviator, pressure, moduli):  # type: ignore[no-untyped-def]
    """Write the part of a point's spatial (Kirchhoff) elasticity that needs no second derivatives.

    `stress` is the stress before the deviator is taken, T = s (g1 b + g2 b²) - h; `pressure` is p J.
    c = P : c~ : P + 2/3 tr(T) (I_s - 1/3 1x1) - 2/3 (dev T x 1 + 1 x dev T) + p J (1x1 - 2 I_s),
    of which c~ is left out.
    """
    trace = stress[0] + stress[1] + stress[2]
    identity, both = 2.0 / 3.0 * trace - 2.0 * pressure, pressure - 2.0 / 9.0 * trace
    for m in range(6):
        one_m = ONE[m]
        for n in range(6):
            moduli[m, n] = (both * one_m - 2.0 / 3.0 * deviator[m]) * ONE[n] - 2.0 / 3.0 * one_m * deviator[n]
        moduli[m, m] += identity * (0.5 + 0.5 * one_m)


@njit(cache=True, inline="always")
def _add_polynomial(law, s, first, b, b2, moduli):  # type: ignore[no-untyped-def]
    """Add P : c~ : P of the polynomial, see `_add_second_derivatives`."""
    trace_b2 = b2[0] + b2[1] + b2[2]
    second = 0.5 * (first * first - trace_b2)
    w2 = law[1] + law[3] * (first - 3.0) + 2.0 * law[4] * (second - 3.0)
    w11, w12, w22 = 2.0 * law[2], law[3], 2.0 * law[4]
    d1 = 4.0 * s * (w2 + w11 + 2.0 * first * w12 + first * first * w22)
    d2 = -4.0 * s * (w12 + first * w22)
    d3 = 4.0 * s * w22
    d4 = -4.0 * s * w2
    if d1 != 0.0 or d2 != 0.0 or d3 != 0.0 or d4 != 0.0:  # all are zero for neo-Hooke
        _add_second_derivatives(d1, d2, d3, d4, first, b, b2, moduli)


@njit(cache=True, inline="always")
def _add_second_derivatives(d1, d2, d3, d4, first, b, b2, moduli):  # type: ignore[no-untyped-def]
    """Add P : (d1 b x b + d2 (b x b² + b² x b) + d3 b² x b² + d4 b . b) : P."""
    third, third_b2 = first / 3.0, (b2[0] + b2[1] + b2[2]) / 3.0
    db, db2, product = small_array((6,)), small_array((6,)), small_array((6, 6))
    for k in range(6):
        db[k], db2[k] = b[k] - third * ONE[k], b2[k] - third_b2 * ONE[k]
    _product_row(_0, _0, _0, b, product)
    _product_row(_1, _1, _1, b, product)
    _product_row(_2, _2, _2, b, product)
    _product_row(_3, _0, _1, b, product)
    _product_row(_4, _1, _2, b, product)
    _product_row(_5, _0, _2, b, product)
    for m in range(6):
        with_db, with_db2 = d1 * db[m] + d2 * db2[m], d2 * db[m] + d3 * db2[m]
        with_one, with_b2 = d4 * (third_b2 * ONE[m] - b2[m]) / 3.0, -d4 * ONE[m] / 3.0
        for n in range(6):
            moduli[m, n] += with_db * db[n] + with_db2 * db2[n] + d4 * product[m, n]
            moduli[m, n] += with_one * ONE[n] + with_b2 * b2[n]


@njit(cache=True, forceinline=True)
def _product_row(m, i, j, b, product):  # type: ignore[no-untyped-def]
    """Write row m = ij of b . b, (b . b)_ij,kl = (b_ik b_jl + b_il b_jk) / 2."""
    for k in range(3):
        product[m, k] = b[INDEX[i, k]] * b[INDEX[j, k]]
        l = (k + 1) % 3  # noqa: E741 - the index letters of the formula
        product[m, INDEX[k, l]] = 0.5 * (b[INDEX[i, k]] * b[INDEX[j, l]] + b[INDEX[i, l]] * b[INDEX[j, k]])


@njit(cache=True, inline="always")
def _tangent_at_point(weight, moduli, tau, slopes, products):  # type: ignore[no-untyped-def]
    """Write V_ij = w A_ij G of one point, with A_ij,pr = c_ip,jr + delta_ij tau_pr, for i <= j.

    `slopes` is G (3, 8), the present gradients of the shape functions; `products` (3, 48) is V_ij, with the
    pairs ij in the order of a tensor's components and the eight nodes of a pair side by side. Every pair is
    spelt out: in a loop over pairs the compiler would look up its indices and scatter what it writes.
    """
    _pair_at_point(_0, _0, _0, weight, moduli, tau, slopes, products)
    _pair_at_point(_1, _1, _1, weight, moduli, tau, slopes, products)
    _pair_at_point(_2, _2, _2, weight, moduli, tau, slopes, products)
    _pair_at_point(_3, _0, _1, weight, moduli, tau, slopes, products)
    _pair_at_point(_4, _1, _2, weight, moduli, tau, slopes, products)
    _pair_at_point(_5, _0, _2, weight, moduli, tau, slopes, products)


@njit(cache=True, forceinline=True)
def _pair_at_point(pair, i, j, weight, moduli, tau, slopes, products):  # type: ignore[no-untyped-def]
    """Write V_ij of one pair, see `_tangent_at_point`."""
    for p in range(3):
        m = INDEX[i, p]
        x, y, z = moduli[m, INDEX[j, 0]], moduli[m, INDEX[j, 1]], moduli[m, INDEX[j, 2]]
        if i == j:
            x, y, z = x + tau[INDEX[p, 0]], y + tau[INDEX[p, 1]], z + tau[INDEX[p, 2]]
        x, y, z = weight * x, weight * y, weight * z
        for node in range(N_NODES):
            products[p, N_NODES * pair + node] = (
                x * slopes[0, node] + y * slopes[1, node] + z * slopes[2, node]
            )


@njit(cache=True, inline="always")
def _add_points(slopes, products, packed):  # type: ignore[no-untyped-def]
    """Write K_ij = sum_q G_q' V_ij,q of all pairs ij as one product of matrices.

    `slopes` is G_q (8 points, 3, 8), `products` V_ij,q (8 points, 3, 48) and `packed` K_ij (8, 48). The
    innermost loop runs over 48 neighbours in memory, which is what vector registers want.
    """
    packed[:] = 0.0
    for node in range(N_NODES):
        for q in range(N_POINTS):
            x, y, z = slopes[q, 0, node], slopes[q, 1, node], slopes[q, 2, node]
            for k in range(N_COLUMNS):
                packed[node, k] += x * products[q, 0, k] + y * products[q, 1, k] + z * products[q, 2, k]


@njit(cache=True)
def _formula_points(law, gradients, jacobians, dilatation, logs, axes, derivatives):  # type: ignore[no-untyped-def]
    """Evaluate a formula at the points of one element, in the instantaneous state.

    Writes `logs` (8, 4), `axes` (8, 3, 3) and `derivatives` (8, 15) of W; returns the volumetric energy.
    Unless shape and volume are coupled, that is no part of W, but its derivatives are kept.
    """
    count, factor = int(law[10]), law[9]
    results, b, b2 = np.empty((count + 1, CARRIED)), small_array((6,)), small_array((6,))
    volumetric = 0.0
    if law[8] != COUPLED:
        logs[0, :3], logs[0, 3] = 0.0, np.log(dilatation)
        differentiate(law[N_COEFFICIENTS:], count, logs[0], results)
        volumetric = results[count - 1, 0]
    for q in range(N_POINTS):
        left_cauchy_green(gradients[q], jacobians[q] ** (-2.0 / 3.0), b, b2)
        principal_axes(b, logs[q], axes[q])
        logs[q, 3] = np.log(dilatation)
        differentiate(law[N_COEFFICIENTS:], count, logs[q], results)
        for k in range(CARRIED):
            derivatives[q, k] = factor * results[count - 1, k]
        if law[8] != COUPLED:
            derivatives[q, 0] -= factor * volumetric
            derivatives[q, 4], derivatives[q, 14] = results[count - 1, 4], results[count - 1, 14]
    return volumetric


@njit(cache=True)
def _add_principal(s, derivatives, logs, axes, moduli):  # type: ignore[no-untyped-def]
    """Add P : c~ : P of a formula to the upper triangle, from h_ab = d²W/dx_a dx_b and beta_a = dW/dx_a.

    Along the axes c~_aabb = h_ab - 2 beta_a delta_ab; between them, with l the squares of the stretches,
    c~_abab = (beta_a l_b - beta_b l_a) / (l_a - l_b), or (h_aa - h_ab) / 2 - beta_a for equal stretches.
    """
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
                for n in range(m, 6):
                    moduli[m, n] += left * axes[c, ROW[n]] * axes[c, COLUMN[n]]
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
                for n in range(m, 6):
                    moduli[m, n] += s * shear * mixed[m] * mixed[n]


EQUAL_STRETCHES = 1e-5
"""Difference of logarithms below which two stretches count as equal; both formulas then err by 1e-10."""


@njit(cache=True, inline="always")
def frame_scale(law, jacobian, dilatation):  # type: ignore[no-untyped-def]
    """Factor c of the frame that carries the relaxing stress, tau = c F S F' (without the pressure of U).

    J^(-2/3), the isochoric frame; (Jbar/J)^(2/3) for laws whose whole stress relaxes.
    """
    if law[8] == COUPLED:
        return (dilatation / jacobian) ** (2.0 / 3.0)
    return jacobian ** (-2.0 / 3.0)


@njit(cache=True, inline="always")
def take_nodes(values, corners, taken):  # type: ignore[no-untyped-def]
    """Write the values (n_nodes, 3) of the nodes of one element, (8, 3)."""
    for a in range(N_NODES):
        for i in range(3):
            taken[a, i] = values[corners[a], i]


@njit(cache=True)
def gradients_at_points(reference, displacement, weights, slopes, gradient):  # type: ignore[no-untyped-def]
    """Write gradients of the shape functions and of the deformation at all points of one element.

    Writes `weights` (8,), `slopes` dN/dX (8, 8, 3) and `gradient` F (8, 3, 3); returns the reference volume.
    """
    jacobian, inverse = small_array((3, 3)), small_array((3, 3))
    volume = 0.0
    for q in range(N_POINTS):
        jacobian[:] = 0.0
        for a in range(N_NODES):
            for i in range(3):
                for j in range(3):
                    jacobian[i, j] += reference[a, i] * SHAPE_DERIVATIVES[q, a, j]
        weights[q] = invert(jacobian, inverse)
        volume += weights[q]
        for i in range(3):
            for j in range(3):
                gradient[q, i, j] = 1.0 if i == j else 0.0
        for a in range(N_NODES):
            for j in range(3):
                slope = 0.0
                for k in range(3):
                    slope += SHAPE_DERIVATIVES[q, a, k] * inverse[k, j]
                slopes[q, a, j] = slope
                for i in range(3):
                    gradient[q, i, j] += displacement[a, i] * slope
    return volume


@njit(cache=True)
def element_system(  # type: ignore[no-untyped-def]
    reference, displacement, law, s, history, with_tangent, force, tangent, formulas=True
):
    """Energy, internal force and tangent of one element.

    Parameters
    ----------
    reference, displacement : array (8, 3)
        Nodes and their displacements. [mm]
    law : array
        One row of `MaterialTable.law`.
    s : float
        Factor on the instantaneous energy in this step.
    history : array (8, 6)
        H of the step at each point. [kPa]
    with_tangent : bool
        Whether `tangent` is written.
    force : array (8, 3)
        Overwritten with the internal force. [mN]
    tangent : array (8, 8, 3, 3)
        Overwritten with the tangent if wanted. [mN/mm]
    formulas : bool or None
        None if the law is a polynomial, see `has_formulas`.

    Returns
    -------
    float
        Incremental potential, or NaN if a point of the element is turned inside out. [µJ]
    """
    weights, slopes = small_array((N_POINTS,)), small_array((N_POINTS, N_NODES, 3))
    gradients, jacobians = small_array((N_POINTS, 3, 3)), small_array((N_POINTS,))
    present, inverse = small_array((N_POINTS, 3, N_NODES)), small_array((3, 3))
    b, b2, relaxed = small_array((6,)), small_array((6,)), small_array((6,))
    stress, deviator, tau = small_array((6,)), small_array((6,)), small_array((6,))
    moduli, products = small_array((6, 6)), small_array((N_POINTS, 3, N_COLUMNS))
    packed, dilatation = small_array((N_NODES, N_COLUMNS)), small_array((3, N_NODES))
    dilatation[:] = 0.0

    volume = gradients_at_points(reference, displacement, weights, slopes, gradients)
    present_volume = 0.0
    for q in range(N_POINTS):
        jacobians[q] = invert(gradients[q], inverse)
        if not jacobians[q] > 0.0:
            return np.nan
        present_volume += weights[q] * jacobians[q]
        for a in range(N_NODES):
            for i in range(3):
                slope = 0.0
                for k in range(3):
                    slope += slopes[q, a, k] * inverse[k, i]
                present[q, i, a] = slope
                dilatation[i, a] += weights[q] * jacobians[q] * slope
    mean_jacobian = present_volume / volume
    is_formula, is_coupled = law[8] != POLYNOMIAL, law[8] == COUPLED
    if formulas is not None and is_formula:
        logs, axes = small_array((N_POINTS, 4)), small_array((N_POINTS, 3, 3))
        derivatives = small_array((N_POINTS, CARRIED))
        coupling, mixed, with_volume = small_array((3, N_NODES)), small_array((6,)), small_array((3,))
        coupling[:] = 0.0
        volumetric = _formula_points(law, gradients, jacobians, mean_jacobian, logs, axes, derivatives)
        pressure, stiffness = 0.0, 0.0  # first the sums of dW/d(ln Jbar) and of its own slope
        for q in range(N_POINTS):
            share = s if is_coupled else 1.0
            slope, curvature = share * derivatives[q, 4], share * derivatives[q, 14]
            if is_coupled:
                push_forward(gradients[q], frame_scale(law, jacobians[q], mean_jacobian), history[q], relaxed)
                trace = relaxed[0] + relaxed[1] + relaxed[2]
                slope, curvature = slope - trace / 3.0, curvature - 2.0 / 9.0 * trace
            pressure += weights[q] * slope / present_volume
            stiffness += weights[q] * (curvature - slope) / present_volume**2
        potential = volume * volumetric
    else:
        change = mean_jacobian - 1.0
        pressure = 2.0 * law[5] * change + 4.0 * law[6] * change**3
        stiffness = (2.0 * law[5] + 12.0 * law[6] * change**2) / volume
        potential = volume * (law[5] * change**2 + law[6] * change**4)

    force[:] = 0.0
    for q in range(N_POINTS):
        w = weights[q]
        frame = frame_scale(law, jacobians[q], mean_jacobian)
        push_forward(gradients[q], frame, history[q], relaxed)
        if formulas is not None and is_formula:
            energy = derivatives[q, 0]
            for k in range(6):
                stress[k] = -relaxed[k]
            add_in_axes(s, derivatives[q, 1:4], axes[q], stress)
        else:
            first, second = left_cauchy_green(gradients[q], frame, b, b2)
            energy, w1, w2 = _energy(law, first, second)
            for k in range(6):
                stress[k] = 2.0 * s * ((w1 + first * w2) * b[k] - w2 * b2[k]) - relaxed[k]
        # -1/2 H : C is half the trace of the pushed-forward history.
        potential += w * (s * energy - 0.5 * (relaxed[0] + relaxed[1] + relaxed[2]))
        mean = (stress[0] + stress[1] + stress[2]) / 3.0
        for k in range(6):
            deviator[k] = stress[k] - (mean if k < 3 else 0.0)
        spherical = pressure * jacobians[q]
        for k in range(6):
            tau[k] = deviator[k] + spherical * ONE[k]
        for node in range(N_NODES):
            x, y, z = w * present[q, 0, node], w * present[q, 1, node], w * present[q, 2, node]
            force[node, 0] += tau[0] * x + tau[3] * y + tau[5] * z
            force[node, 1] += tau[3] * x + tau[1] * y + tau[4] * z
            force[node, 2] += tau[5] * x + tau[4] * y + tau[2] * z
        if with_tangent:
            _elasticity(stress, deviator, spherical, moduli)
            if formulas is not None and is_formula:
                _add_principal(s, derivatives[q], logs[q], axes[q], moduli)
                for m in range(6):
                    for n in range(m):
                        moduli[m, n] = moduli[n, m]
            else:
                _add_polynomial(law, s, first, b, b2, moduli)
            _tangent_at_point(w, moduli, tau, present[q], products[q])
            if (
                formulas is not None and is_coupled
            ):  # d²W / dx d(ln Jbar) acts like a stress, whose forces are the coupling
                for k in range(6):
                    mixed[k] = -2.0 / 3.0 * relaxed[k]
                for a in range(3):
                    with_volume[a] = derivatives[q, WITH_VOLUME[a]]
                add_in_axes(s, with_volume, axes[q], mixed)
                mean = (mixed[0] + mixed[1] + mixed[2]) / 3.0
                for i in range(3):
                    for node in range(N_NODES):
                        for j in range(3):
                            component = mixed[INDEX[i, j]] - (mean if i == j else 0.0)
                            coupling[i, node] += w / present_volume * component * present[q, j, node]
    if with_tangent:
        _add_points(present, products, packed)
        for m in range(6):
            i, j = ROW[m], COLUMN[m]
            for node in range(N_NODES):
                for other in range(N_NODES):
                    value = (
                        packed[node, N_NODES * m + other]
                        + stiffness * dilatation[i, node] * dilatation[j, other]
                    )
                    if formulas is not None and is_coupled:
                        value += coupling[i, node] * dilatation[j, other]
                        value += dilatation[i, node] * coupling[j, other]
                    tangent[node, other, i, j] = value
                    tangent[other, node, j, i] = value
    return potential


@njit(cache=True)
def element_state(reference, displacement, law, instantaneous, energies, formulas=True):  # type: ignore[no-untyped-def]
    """Instantaneous relaxing stress and energies at the points of one element.

    Parameters
    ----------
    reference, displacement : array (8, 3)
        Nodes and their displacements. [mm]
    law : array
        One row of `MaterialTable.law`.
    instantaneous : array (8, 6)
        Overwritten with S0 = F~^-1 dev(tau0) F~^-T at each point (see `frame_scale`). [kPa]
    energies : array (8, 2)
        Overwritten with the integration weight and the instantaneous energy W0 that may relax. [mm³, kPa]
    formulas : bool or None
        None if the law is a polynomial, see `has_formulas`.

    Returns
    -------
    (float, float, float)
        Volumetric energy density U(Jbar) and pressure U'(Jbar) [kPa], both 0 if the law couples shape and
        volume and all stress is in S0; and Jbar.
    """
    weights, slopes = small_array((N_POINTS,)), small_array((N_POINTS, N_NODES, 3))
    gradients, jacobians, inverse = (
        small_array((N_POINTS, 3, 3)),
        small_array((N_POINTS,)),
        small_array((3, 3)),
    )
    b, b2, deviator = small_array((6,)), small_array((6,)), small_array((6,))
    is_formula, is_coupled = law[8] != POLYNOMIAL, law[8] == COUPLED
    volume = gradients_at_points(reference, displacement, weights, slopes, gradients)
    present_volume = 0.0
    for q in range(N_POINTS):
        jacobians[q] = invert(gradients[q], inverse)
        present_volume += weights[q] * jacobians[q]
    mean_jacobian = present_volume / volume
    change = mean_jacobian - 1.0
    volumetric = law[5] * change**2 + law[6] * change**4
    pressure = 2.0 * law[5] * change + 4.0 * law[6] * change**3
    if formulas is not None and is_formula:
        logs, axes = small_array((N_POINTS, 4)), small_array((N_POINTS, 3, 3))
        derivatives = small_array((N_POINTS, CARRIED))
        volumetric = _formula_points(law, gradients, jacobians, mean_jacobian, logs, axes, derivatives)
        pressure = 0.0 if is_coupled else derivatives[0, 4] / mean_jacobian
    for q in range(N_POINTS):
        invert(gradients[q], inverse)
        if formulas is not None and is_formula:
            energy = derivatives[q, 0]
            deviator[:] = 0.0
            add_in_axes(1.0, derivatives[q, 1:4], axes[q], deviator)
        else:
            first, second = left_cauchy_green(gradients[q], jacobians[q] ** (-2.0 / 3.0), b, b2)
            energy, w1, w2 = _energy(law, first, second)
            for k in range(6):
                deviator[k] = 2.0 * ((w1 + first * w2) * b[k] - w2 * b2[k])
        mean = (deviator[0] + deviator[1] + deviator[2]) / 3.0
        for k in range(3):
            deviator[k] -= mean
            if formulas is not None and is_coupled:  # not a deviator then
                deviator[k] += derivatives[q, 4]
        scale = 1.0 / frame_scale(law, jacobians[q], mean_jacobian)
        push_forward(inverse, scale, deviator, instantaneous[q])
        energies[q, 0], energies[q, 1] = weights[q], energy
    return volumetric, pressure, mean_jacobian


@njit(cache=True)
def relaxing_norms(reference, displacement, law, tensors, norms):  # type: ignore[no-untyped-def]
    """Squared norm of the spatial stress c F T F' of reference tensors, of its deviator if only that relaxes.

    Parameters
    ----------
    reference, displacement : array (8, 3)
        Nodes and their displacements. [mm]
    law : array
        One row of `MaterialTable.law`.
    tensors : array (n, 8, 6)
        Reference tensors at each point. [kPa]
    norms : array (n, 8)
        Overwritten with the squared norms. [kPa²]
    """
    weights, slopes = small_array((N_POINTS,)), small_array((N_POINTS, N_NODES, 3))
    gradients = small_array((N_POINTS, 3, 3))
    inverse, spatial = small_array((3, 3)), small_array((6,))
    volume = gradients_at_points(reference, displacement, weights, slopes, gradients)
    present_volume = 0.0
    for q in range(N_POINTS):
        present_volume += weights[q] * invert(gradients[q], inverse)
    for q in range(N_POINTS):
        scale = frame_scale(law, invert(gradients[q], inverse), present_volume / volume)
        for n in range(tensors.shape[0]):
            push_forward(gradients[q], scale, tensors[n, q], spatial)
            mean = 0.0 if law[8] == COUPLED else (spatial[0] + spatial[1] + spatial[2]) / 3.0
            total = 0.0
            for k in range(6):
                component = spatial[k] - (mean if k < 3 else 0.0)
                total += component * component * (1.0 if k < 3 else 2.0)
            norms[n, q] = total
