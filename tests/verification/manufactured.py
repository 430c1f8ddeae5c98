"""A solution made up at finite strain: how fast displacement and stress converge to it.

Displacements u(X) are chosen and the body force that they need is b = -Div P(F(X)), with P written out here
and differentiated by complex steps (exact to round-off), so nothing of it comes from the kernel. The
consistent nodal forces of b are integrated with 3 x 3 x 3 points.
"""

from __future__ import annotations

from dataclasses import replace
from functools import lru_cache

import numpy as np

from fingerpad.geometry.mesh import block_mesh
from fingerpad.mechanics.fields import cauchy_stress
from fingerpad.mechanics.materials import Material
from fingerpad.mechanics.tensors import INDEX
from fingerpad.mechanics.viscoelastic import StressHistory, instantaneous_state

from .case import Row, at_least, at_most, case, equal
from .laws import bulk_modulus
from .solid import Solid, at_points, gauss, shape_functions

THEME = "Manufactured solution"
C10, C01, C20, C11, C02 = 4.0, 1.5, 2.5, 0.7, 0.9
AMPLITUDE_MM = 0.08
COMPLEX_STEP = 1e-30


def exact_displacement(points):
    """u(X) on the unit cube, points (..., 3), complex allowed. [mm]"""
    x, y, z = np.moveaxis(points, -1, 0)
    pi = np.pi
    return AMPLITUDE_MM * np.stack(
        [
            np.sin(pi * y) * np.cos(pi * z) + x * y,
            np.sin(pi * z) * np.cos(pi * x) - 0.5 * y**2 + 0.3 * np.sin(pi * x),
            np.sin(pi * x) * np.cos(pi * y) + 0.2 * x * z,
        ],
        axis=-1,
    )


def along(function, points, axis):
    """Derivative of a function of points (..., 3) along one axis, by a complex step."""
    step = np.zeros(3, dtype=complex)
    step[axis] = 1j * COMPLEX_STEP
    return function(points + step).imag / COMPLEX_STEP


def exact_gradient(points):
    """F = 1 + du/dX, analytic, (..., 3, 3); complex points allowed."""
    x, y, z = np.moveaxis(points, -1, 0)
    pi, zero = np.pi, 0 * x
    rows = [
        [y, pi * np.cos(pi * y) * np.cos(pi * z) + x, -pi * np.sin(pi * y) * np.sin(pi * z)],
        [
            -pi * np.sin(pi * z) * np.sin(pi * x) + 0.3 * pi * np.cos(pi * x),
            -y,
            pi * np.cos(pi * z) * np.cos(pi * x),
        ],
        [
            pi * np.cos(pi * x) * np.cos(pi * y) + 0.2 * z,
            -pi * np.sin(pi * x) * np.sin(pi * y),
            zero + 0.2 * x,
        ],
    ]
    gradient = np.stack([np.stack([entry + zero for entry in row], axis=-1) for row in rows], axis=-2)
    return np.eye(3) + AMPLITUDE_MM * gradient


def piola(gradient, bulk, jacobian=None):
    """P = W1 dI1/dF + W2 dI2/dF + K (J - 1) cof F of the polynomial law; J of the pressure may be given."""
    j = np.linalg.det(gradient)[..., None, None]
    cofactor = j * np.linalg.inv(gradient).swapaxes(-1, -2)
    inverse = cofactor / j
    right = gradient.swapaxes(-1, -2) @ gradient
    trace = np.trace(right, axis1=-2, axis2=-1)[..., None, None]
    square = np.trace(right @ right, axis1=-2, axis2=-1)[..., None, None]
    first, second = j ** (-2 / 3) * trace, j ** (-4 / 3) * 0.5 * (trace**2 - square)
    w1 = C10 + 2 * C20 * (first - 3) + C11 * (second - 3)
    w2 = C01 + C11 * (first - 3) + 2 * C02 * (second - 3)
    d_first = 2 * j ** (-2 / 3) * gradient - 2 / 3 * first * inverse
    d_second = 2 * j ** (-4 / 3) * (trace * gradient - gradient @ right) - 4 / 3 * second * inverse
    dilatation = j if jacobian is None else jacobian
    return w1 * d_first + w2 * d_second + bulk * (dilatation - 1) * cofactor


def body_force(points, bulk):
    """b = -Div P, (..., 3). [mN/mm³]"""
    return -sum(along(lambda x: piola(exact_gradient(x), bulk), points, axis)[..., axis] for axis in range(3))


def cube(n):
    """n³ bricks of a unit cube, smoothly distorted."""
    edges = np.linspace(0.0, 1.0, n + 1)
    mesh = block_mesh(edges, edges, edges, layers=[0] * n)
    x, y, z = mesh.nodes_mm.T
    bump = 0.05 * np.sin(np.pi * x) * np.sin(np.pi * y) * np.sin(np.pi * z)
    return replace(mesh, nodes_mm=mesh.nodes_mm + np.stack([bump, -bump, 0.7 * bump], axis=1))


@lru_cache(maxsize=16)
def errors(n, poisson):
    """Relative errors in L2 on n³ bricks: displacement, Cauchy stress at points, and its element means."""
    bulk = bulk_modulus(2 * (C10 + C01), poisson)
    mesh = cube(n)
    solid = Solid(mesh, (Material.polynomial(C10, C01, C20, C11, C02, poisson=poisson),) * 4)
    points, weights = gauss(3)
    values, _ = shape_functions(points)
    position, volume, _, _ = at_points(mesh, np.zeros_like(mesh.nodes_mm), points, weights)
    load = np.zeros_like(mesh.nodes_mm)
    np.add.at(load, mesh.elements, np.einsum("eq,eqi,qa->eai", volume, body_force(position, bulk), values))
    given = ((mesh.nodes_mm == 0.0) | (mesh.nodes_mm == 1.0)).any(axis=1)
    given = np.repeat(given[:, None], 3, axis=1)
    found = solid.solve(given, exact_displacement(mesh.nodes_mm), load, steps=2, tolerance=1e-8)

    _, _, moved, _ = at_points(mesh, found, points, weights)
    exact = exact_displacement(position)
    displacement = norm(moved - exact, volume) / norm(exact, volume)
    position, volume, _, gradient = at_points(mesh, found)
    j = np.linalg.det(gradient)
    mean = (volume * j).sum(axis=1, keepdims=True) / volume.sum(axis=1, keepdims=True)
    stress = cauchy(piola(gradient, bulk, mean[..., None, None]), gradient)
    exact_f = exact_gradient(position)
    exact_stress = cauchy(piola(exact_f, bulk), exact_f)
    at_points_error = norm(stress - exact_stress, volume) / norm(exact_stress, volume)

    mean_stress = cauchy_stress(mesh, found, solid.table, at_rest_from(solid, found))[:, INDEX]
    weight = volume * j
    exact_mean = np.einsum("eq,eqij->eij", weight, exact_stress) / weight.sum(axis=1)[:, None, None]
    size = weight.sum(axis=1)[:, None]
    mean_error = norm((mean_stress - exact_mean)[:, None], size) / norm(exact_mean[:, None], size)
    return displacement, at_points_error, mean_error


def at_rest_from(solid, displacement):
    """History of a body that was brought to its place at once and has not relaxed."""
    mesh = solid.mesh
    now = instantaneous_state(mesh, displacement, solid.table)
    return replace(
        StressHistory.unloaded(len(mesh.elements), solid.table.shares.shape[1]), instantaneous=now.stress_kpa
    )


def cauchy(stress, gradient):
    """t = P F' / J."""
    return stress @ gradient.swapaxes(-1, -2) / np.linalg.det(gradient)[..., None, None]


def norm(field, volume):
    """L2 norm of a field (e, q, ...)."""
    return np.sqrt((volume * (field**2).reshape(*volume.shape, -1).sum(axis=-1)).sum())


def order(coarse, fine, errors_of, index):
    """Measured order between two meshes."""
    return np.log(errors_of(coarse)[index] / errors_of(fine)[index]) / np.log(fine / coarse)


QUANTITIES = (("displacement", 1.9), ("stress at points", 0.95), ("stress, element means", 1.3))
TARGETS = (("displacement", 2.0), ("stress at points", 1.0))

SOURCE = "Manufactured solutions (Roache 2002)"


@case(THEME, "Orders of convergence, nu = 0.3 and 0.49", SOURCE)
def manufactured_orders() -> list[Row]:
    """Polynomial law N = 2, stretches from 0.76 to 1.28, on 4³ and 8³ distorted bricks. Errors in L2. Stress
    is the Cauchy stress at the Gauss points and the mean that is reported for each element; the expected
    orders are 2 and 1.
    """
    return [
        at_least(f"nu = {poisson}: order of {what}", bound, order(4, 8, errors_at(poisson), index))
        for poisson in (0.3, 0.49)
        for index, (what, bound) in enumerate(QUANTITIES)
    ]


@case(THEME, "Orders of convergence on finer meshes", SOURCE, slow=True)
def manufactured_orders_fine() -> list[Row]:
    """The same from 8³ to 12³ bricks, with the size of the errors."""
    rows = []
    for poisson in (0.3, 0.49):
        for index, (what, target) in enumerate(TARGETS):
            found = order(8, 12, errors_at(poisson), index)
            rows.append(equal(f"nu = {poisson}: order of {what}", target, found, 0.03))
        displacement, _, _ = errors(12, poisson)
        rows.append(at_most(f"nu = {poisson}: error of displacement on 12³, relative", 0.02, displacement))
    return rows


def errors_at(poisson):
    """Errors as a function of the mesh alone."""
    return lambda n: errors(n, poisson)
