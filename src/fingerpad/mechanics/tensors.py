"""Second-order tensors in three dimensions, as the compiled kernels use them.

A symmetric tensor is stored as xx, yy, zz, xy, yz, xz.
"""

from __future__ import annotations

import numpy as np
from numba import njit

from fingerpad.core.numba_internals import small_array

ROW = np.array([0, 1, 2, 0, 1, 0])
COLUMN = np.array([0, 1, 2, 1, 2, 2])
INDEX = np.array([[0, 3, 5], [3, 1, 4], [5, 4, 2]])
"""Rows and columns of the six stored components, and where the nine of a 3x3 tensor stand among them."""

SWEEPS = 12
"""Sweeps of Jacobi's method; four or five reach round-off."""


@njit(cache=True)
def invert(matrix, inverse):  # type: ignore[no-untyped-def]
    """Write the inverse of a 3x3 matrix and return its determinant."""
    a, b, c = matrix[0, 0], matrix[0, 1], matrix[0, 2]
    d, e, f = matrix[1, 0], matrix[1, 1], matrix[1, 2]
    g, h, i = matrix[2, 0], matrix[2, 1], matrix[2, 2]
    minor_a, minor_b, minor_c = e * i - f * h, f * g - d * i, d * h - e * g
    determinant = a * minor_a + b * minor_b + c * minor_c
    scale = 1.0 / determinant
    inverse[0, 0], inverse[0, 1], inverse[0, 2] = minor_a, c * h - b * i, b * f - c * e
    inverse[1, 0], inverse[1, 1], inverse[1, 2] = minor_b, a * i - c * g, c * d - a * f
    inverse[2, 0], inverse[2, 1], inverse[2, 2] = minor_c, b * g - a * h, a * e - b * d
    for row in range(3):
        for column in range(3):
            inverse[row, column] *= scale
    return determinant


@njit(cache=True, inline="always")
def left_cauchy_green(gradient, scale, b, b2):  # type: ignore[no-untyped-def]
    """Write b = scale F F' and its square; return its invariants. The isochoric b~ has scale J^(-2/3)."""
    for k in range(6):
        f, g = gradient[ROW[k]], gradient[COLUMN[k]]
        b[k] = scale * (f[0] * g[0] + f[1] * g[1] + f[2] * g[2])
    b2[0] = b[0] * b[0] + b[3] * b[3] + b[5] * b[5]
    b2[1] = b[3] * b[3] + b[1] * b[1] + b[4] * b[4]
    b2[2] = b[5] * b[5] + b[4] * b[4] + b[2] * b[2]
    b2[3] = b[0] * b[3] + b[3] * b[1] + b[5] * b[4]
    b2[4] = b[3] * b[5] + b[1] * b[4] + b[4] * b[2]
    b2[5] = b[0] * b[5] + b[3] * b[4] + b[5] * b[2]
    first = b[0] + b[1] + b[2]
    second = 0.5 * (first * first - b2[0] - b2[1] - b2[2])
    return first, second


@njit(cache=True)
def push_forward(gradient, scale, reference, spatial):  # type: ignore[no-untyped-def]
    """Write scale F T F' of a symmetric reference tensor T."""
    product = small_array((3, 3))  # F T
    xx, yy, zz = reference[0], reference[1], reference[2]
    xy, yz, zx = reference[3], reference[4], reference[5]
    for i in range(3):
        x, y, z = gradient[i, 0], gradient[i, 1], gradient[i, 2]
        product[i, 0] = x * xx + y * xy + z * zx
        product[i, 1] = x * xy + y * yy + z * yz
        product[i, 2] = x * zx + y * yz + z * zz
    for k in range(6):
        i, j = ROW[k], COLUMN[k]
        spatial[k] = scale * (
            product[i, 0] * gradient[j, 0] + product[i, 1] * gradient[j, 1] + product[i, 2] * gradient[j, 2]
        )


@njit(cache=True)
def principal_axes(b, logs, axes):  # type: ignore[no-untyped-def]
    """Write ln lambdabar_a and the axes n_a (rows) of the isochoric b~, by Jacobi's method."""
    a = np.empty((3, 3))
    for i in range(3):
        for j in range(3):
            a[i, j] = b[INDEX[i, j]]
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
def add_in_axes(factor, values, axes, tensor):  # type: ignore[no-untyped-def]
    """Add sum_a factor values_a n_a x n_a."""
    for a in range(3):
        value = factor * values[a]
        for k in range(6):
            tensor[k] += value * axes[a, ROW[k]] * axes[a, COLUMN[k]]
