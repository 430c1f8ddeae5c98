"""Second-order tensors in three dimensions, as the compiled kernels use them.

A symmetric tensor is stored as xx, yy, zz, xy, yz, xz. Functions work on all integration points of an element
at once: arrays have the points last, and one loop over the points holds all arithmetic, so that one machine
instruction serves several of them. A call or a division that may raise an error would keep the compiler from
that, and short loops it would unroll instead.
"""

from __future__ import annotations

import numpy as np
from numba import njit

from fingerpad.core.numba_internals import small_array

ROW = np.array([0, 1, 2, 0, 1, 0])
COLUMN = np.array([0, 1, 2, 1, 2, 2])
INDEX = np.array([[0, 3, 5], [3, 1, 4], [5, 4, 2]])
"""Rows and columns of the six stored components, and where the nine of a 3x3 tensor stand among them."""

SWEEPS = 12  # Sweeps of Jacobi's method; four or five reach round-off.

WIDEST_ROOT = 5.0
"""Three steps of `power_minus_two_thirds` reach round-off from 1/5 to this; at 8 they err by 6e-11."""


@njit(cache=True, forceinline=True, error_model="numpy")
def invert(matrices, inverses, determinants):  # type: ignore[no-untyped-def]
    for q in range(determinants.size):
        a, b, c = matrices[0, 0, q], matrices[0, 1, q], matrices[0, 2, q]
        d, e, f = matrices[1, 0, q], matrices[1, 1, q], matrices[1, 2, q]
        g, h, i = matrices[2, 0, q], matrices[2, 1, q], matrices[2, 2, q]
        minor_a, minor_b, minor_c = e * i - f * h, f * g - d * i, d * h - e * g
        determinant = a * minor_a + b * minor_b + c * minor_c
        scale = 1.0 / determinant
        inverses[0, 0, q], inverses[1, 0, q], inverses[2, 0, q] = (
            scale * minor_a, scale * minor_b, scale * minor_c,
        )  # fmt: skip
        inverses[0, 1, q], inverses[0, 2, q] = scale * (c * h - b * i), scale * (b * f - c * e)
        inverses[1, 1, q], inverses[1, 2, q] = scale * (a * i - c * g), scale * (c * d - a * f)
        inverses[2, 1, q], inverses[2, 2, q] = scale * (b * g - a * h), scale * (a * e - b * d)
        determinants[q] = determinant


@njit(cache=True, forceinline=True)
def find_determinants(matrices, determinants):  # type: ignore[no-untyped-def]
    for q in range(determinants.size):
        a, b, c = matrices[0, 0, q], matrices[0, 1, q], matrices[0, 2, q]
        d, e, f = matrices[1, 0, q], matrices[1, 1, q], matrices[1, 2, q]
        g, h, i = matrices[2, 0, q], matrices[2, 1, q], matrices[2, 2, q]
        determinants[q] = a * (e * i - f * h) + b * (f * g - d * i) + c * (d * h - e * g)


@njit(cache=True, forceinline=True)
def multiply_matrices(left, right, products):  # type: ignore[no-untyped-def]
    for q in range(left.shape[2]):
        for i in range(3):
            x, y, z = left[i, 0, q], left[i, 1, q], left[i, 2, q]
            products[i, 0, q] = x * right[0, 0, q] + y * right[1, 0, q] + z * right[2, 0, q]
            products[i, 1, q] = x * right[0, 1, q] + y * right[1, 1, q] + z * right[2, 1, q]
            products[i, 2, q] = x * right[0, 2, q] + y * right[1, 2, q] + z * right[2, 2, q]


@njit(cache=True, forceinline=True, error_model="numpy")
def power_minus_two_thirds(values, powers):  # type: ignore[no-untyped-def]
    """Write x^(-2/3) of positive values (n,).

    y = x^(-1/3) is found from (x + 2) / (2x + 1) by y <- y (1 + e/3 + 2e²/9) with e = 1 - x y³, of third
    order. The power of the library, one call per number, takes the place of this far from 1.
    """
    for q in range(values.size):
        x = values[q]
        y = (x + 2.0) / (2.0 * x + 1.0)
        e = 1.0 - x * y * y * y
        y *= 1.0 + e * (1.0 / 3.0 + 2.0 / 9.0 * e)
        e = 1.0 - x * y * y * y
        y *= 1.0 + e * (1.0 / 3.0 + 2.0 / 9.0 * e)
        e = 1.0 - x * y * y * y
        y *= 1.0 + e * (1.0 / 3.0 + 2.0 / 9.0 * e)
        powers[q] = y * y
    for q in range(values.size):
        if not 1.0 / WIDEST_ROOT < values[q] < WIDEST_ROOT:
            powers[q] = values[q] ** (-2.0 / 3.0)


@njit(cache=True, forceinline=True)
def left_cauchy_green(gradients, scales, b, b2, first, second):  # type: ignore[no-untyped-def]
    """Write b = scale F F' (6, n), its square and its invariants (n,). That of b~ is J^(-2/3)."""
    for q in range(scales.size):
        a, k, c = gradients[0, 0, q], gradients[0, 1, q], gradients[0, 2, q]
        d, e, f = gradients[1, 0, q], gradients[1, 1, q], gradients[1, 2, q]
        g, h, i = gradients[2, 0, q], gradients[2, 1, q], gradients[2, 2, q]
        scale = scales[q]
        xx, yy, zz = (
            scale * (a * a + k * k + c * c), scale * (d * d + e * e + f * f), scale * (g * g + h * h + i * i),
        )  # fmt: skip
        xy, yz, xz = (
            scale * (a * d + k * e + c * f), scale * (d * g + e * h + f * i), scale * (a * g + k * h + c * i),
        )  # fmt: skip
        b[0, q], b[1, q], b[2, q], b[3, q], b[4, q], b[5, q] = xx, yy, zz, xy, yz, xz
        b2[0, q] = xx * xx + xy * xy + xz * xz
        b2[1, q] = xy * xy + yy * yy + yz * yz
        b2[2, q] = xz * xz + yz * yz + zz * zz
        b2[3, q] = xx * xy + xy * yy + xz * yz
        b2[4, q] = xy * xz + yy * yz + yz * zz
        b2[5, q] = xx * xz + xy * yz + xz * zz
        first[q] = xx + yy + zz
        second[q] = 0.5 * (first[q] * first[q] - b2[0, q] - b2[1, q] - b2[2, q])


@njit(cache=True, forceinline=True)
def push_forward(gradients, scales, reference, spatial):  # type: ignore[no-untyped-def]
    """Write scale F T F' (6, n) of symmetric reference tensors T (n, 6)."""
    for q in range(scales.size):
        xx, yy, zz = reference[q, 0], reference[q, 1], reference[q, 2]
        xy, yz, xz = reference[q, 3], reference[q, 4], reference[q, 5]
        a, b, c = gradients[0, 0, q], gradients[0, 1, q], gradients[0, 2, q]
        d, e, f = gradients[1, 0, q], gradients[1, 1, q], gradients[1, 2, q]
        g, h, i = gradients[2, 0, q], gradients[2, 1, q], gradients[2, 2, q]
        # Rows of F T.
        ux, uy, uz = a * xx + b * xy + c * xz, a * xy + b * yy + c * yz, a * xz + b * yz + c * zz
        vx, vy, vz = d * xx + e * xy + f * xz, d * xy + e * yy + f * yz, d * xz + e * yz + f * zz
        wx, wy, wz = g * xx + h * xy + i * xz, g * xy + h * yy + i * yz, g * xz + h * yz + i * zz
        scale = scales[q]
        spatial[0, q] = scale * (ux * a + uy * b + uz * c)
        spatial[1, q] = scale * (vx * d + vy * e + vz * f)
        spatial[2, q] = scale * (wx * g + wy * h + wz * i)
        spatial[3, q] = scale * (ux * d + uy * e + uz * f)
        spatial[4, q] = scale * (vx * g + vy * h + vz * i)
        spatial[5, q] = scale * (ux * g + uy * h + uz * i)


@njit(cache=True)
def principal_axes(b, q, logs, axes):  # type: ignore[no-untyped-def]
    """Write ln lambdabar_a and axes n_a (rows) of the isochoric b~ (6, n) of point q, by Jacobi's method."""
    a = small_array((3, 3))
    for i in range(3):
        for j in range(3):
            a[i, j] = b[INDEX[i, j], q]
            axes[i, j] = 1.0 if i == j else 0.0
    for _ in range(SWEEPS):
        off = a[0, 1] ** 2 + a[0, 2] ** 2 + a[1, 2] ** 2
        if off <= 1e-32 * (a[0, 0] ** 2 + a[1, 1] ** 2 + a[2, 2] ** 2):
            break
        for i in range(2):
            for j in range(i + 1, 3):
                if a[i, j] == 0.0:
                    continue
                ratio = (a[j, j] - a[i, i]) / (2.0 * a[i, j])
                tangent = 1.0 / (abs(ratio) + np.sqrt(1.0 + ratio * ratio))
                if ratio < 0.0:
                    tangent = -tangent
                cosine = 1.0 / np.sqrt(1.0 + tangent * tangent)
                sine = tangent * cosine
                for k in range(3):
                    first, second = a[k, i], a[k, j]
                    a[k, i], a[k, j] = cosine * first - sine * second, sine * first + cosine * second
                for k in range(3):
                    first, second = a[i, k], a[j, k]
                    a[i, k], a[j, k] = cosine * first - sine * second, sine * first + cosine * second
                    first, second = axes[i, k], axes[j, k]
                    axes[i, k], axes[j, k] = cosine * first - sine * second, sine * first + cosine * second
    for i in range(3):
        logs[i] = 0.5 * np.log(a[i, i])


@njit(cache=True, inline="always")
def add_in_axes(factor, values, axes, tensors, q):  # type: ignore[no-untyped-def]
    """Add sum_a factor values_a n_a x n_a to the tensor of point q, of tensors (6, n)."""
    for a in range(3):
        value = factor * values[a]
        for k in range(6):
            tensors[k, q] += value * axes[a, ROW[k]] * axes[a, COLUMN[k]]
