"""Cubic spline between the points of a regular grid.

With whole numbers u and v at the grid's points,

    f(u, v) = sum over i and j of b(u - i) b(v - j) c_ij,

where b is the cubic B-spline: for t within 0 ... 1 past a point, the coefficients at -1, 0, 1 and 2 have the
weights

    ((1 - t)^3,  4 - 6 t^2 + 3 t^3,  1 + 3 t + 3 t^2 - 3 t^3,  t^3)/6.

The coefficients c follow from the values f_ij (`coefficients`): the spline passes through all of them. It has
continuous slopes and curvatures, is exact for cubics and of fourth order.

Notes
-----
De Boor 1978; Unser 1999.
"""

from __future__ import annotations

import math

import numpy as np
from numba import njit

from fingerpad.core.checks import FloatArray

Four = tuple[float, float, float, float]


def coefficients(values: FloatArray) -> FloatArray:
    """Coefficients of the spline through values on a grid.

    The influence of a value falls to 27 % from one point to the next. At the ends the slope is 0, so a grid
    is continued by some 20 points beyond the range of interest first.
    """
    n_rows, n_columns, n_quantities = values.shape
    found = np.array(values, dtype=np.float64, order="C")
    _solve_along(found.reshape(1, n_rows, n_columns * n_quantities))
    _solve_along(found)
    return found


@njit(cache=True, error_model="numpy", nogil=True)
def _solve_along(lines: FloatArray) -> None:
    """Solve (c_(i-1) + 4 c_i + c_(i+1))/6 = f_i along lines (n_sets, n_points, n_lines), in place."""
    # The slope is 0 at the ends. Gaussian elimination, point after point for all lines of a set.
    n_sets, n_points, n_lines = lines.shape
    upper = np.empty(n_points)
    upper[0] = 0.5
    for i in range(1, n_points):
        upper[i] = 1.0 / (4.0 - upper[i - 1])
    last = 1.0 / (4.0 - 2.0 * upper[n_points - 2])
    for k in range(n_sets):
        line = lines[k]
        for j in range(n_lines):
            line[0, j] *= 1.5
        for i in range(1, n_points - 1):
            for j in range(n_lines):
                line[i, j] = (6.0 * line[i, j] - line[i - 1, j]) * upper[i]
        for j in range(n_lines):
            line[-1, j] = (6.0 * line[-1, j] - 2.0 * line[-2, j]) * last
        for i in range(n_points - 2, -1, -1):
            for j in range(n_lines):
                line[i, j] -= upper[i] * line[i + 1, j]


@njit(cache=True, nogil=True)
def _weights(t: float) -> Four:
    square, cube, rest = t * t, t * t * t, (1.0 - t) ** 3
    return (
        rest / 6.0,
        (4.0 - 6.0 * square + 3.0 * cube) / 6.0,
        (1.0 + 3.0 * (t + square - cube)) / 6.0,
        cube / 6.0,
    )


@njit(cache=True, nogil=True)
def _slopes(t: float) -> Four:
    square = t * t
    return (-0.5 * (1.0 - t) ** 2, 1.5 * square - 2.0 * t, 0.5 + t - 1.5 * square, 0.5 * square)


@njit(cache=True, nogil=True)
def _interpolated(known: FloatArray, uv: FloatArray, padding: int) -> FloatArray:
    """Values (n_places, n_quantities)."""
    found = np.zeros((len(uv), known.shape[2]))
    for n in range(len(uv)):
        row, column = math.floor(uv[n, 0]), math.floor(uv[n, 1])
        _add_near(
            known, row + padding - 1, column + padding - 1, _weights(uv[n, 0] - row),
            _weights(uv[n, 1] - column), found[n],
        )  # fmt: skip
    return found


@njit(cache=True, nogil=True)
def _with_slopes(known: FloatArray, uv: FloatArray, padding: int) -> FloatArray:
    """Values and their derivatives by u and by v, (3, n_places, n_quantities)."""
    found = np.zeros((3, len(uv), known.shape[2]))
    for n in range(len(uv)):
        row, column = math.floor(uv[n, 0]), math.floor(uv[n, 1])
        u, v = uv[n, 0] - row, uv[n, 1] - column
        along, around = _weights(u), _weights(v)
        first, at = row + padding - 1, column + padding - 1
        _add_near(known, first, at, along, around, found[0, n])
        _add_near(known, first, at, _slopes(u), around, found[1, n])
        _add_near(known, first, at, along, _slopes(v), found[2, n])
    return found


@njit(cache=True, nogil=True)
def _add_near(known: FloatArray, first: int, at: int, along: Four, around: Four, total: FloatArray) -> None:
    """Add up the 16 coefficients about a place, by their weights."""
    for i in range(4):
        near = known[first + i]
        a, b, c, d = near[at], near[at + 1], near[at + 2], near[at + 3]
        wa, wb, wc, wd = (
            along[i] * around[0], along[i] * around[1], along[i] * around[2], along[i] * around[3],
        )  # fmt: skip
        for k in range(total.size):
            total[k] = total[k] + wa * a[k] + wb * b[k] + wc * c[k] + wd * d[k]


def values_at(known: FloatArray, uv: FloatArray, padding: int) -> FloatArray:
    return _interpolated(known, uv, padding)


def values_and_slopes_at(known: FloatArray, uv: FloatArray, padding: int) -> FloatArray:
    """Interpolate, and differentiate by u and by v."""
    return _with_slopes(known, uv, padding)
