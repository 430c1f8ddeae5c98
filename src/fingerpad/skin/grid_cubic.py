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
from scipy.ndimage import spline_filter1d

from fingerpad.core.checks import FloatArray

Four = tuple[float, float, float, float]


def coefficients(values: FloatArray) -> FloatArray:
    """Coefficients of the spline through values on a grid.

    The influence of a value falls to 27 % from one point to the next. At the ends the slope is 0, so a grid
    is continued by some 20 points beyond the range of interest first.

    Parameters
    ----------
    values : array (n_rows, n_columns, n_quantities)
        On the grid.

    Returns
    -------
    array (n_rows, n_columns, n_quantities)
    """
    return spline_filter1d(spline_filter1d(values, axis=0, mode="mirror"), axis=1, mode="mirror")


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
def _interpolated(known: FloatArray, uv: FloatArray, padding: int, with_slopes: bool) -> FloatArray:
    """Values (1, n_places, n_quantities), or values and slopes (3, n_places, n_quantities)."""
    found = np.zeros((3 if with_slopes else 1, len(uv), known.shape[2]))
    for n in range(len(uv)):
        row, column = math.floor(uv[n, 0]), math.floor(uv[n, 1])
        along, around = _weights(uv[n, 0] - row), _weights(uv[n, 1] - column)
        by_u, by_v = _slopes(uv[n, 0] - row), _slopes(uv[n, 1] - column)
        for i in range(4):
            for j in range(4):
                near = known[row + padding - 1 + i, column + padding - 1 + j]
                for k in range(near.size):
                    found[0, n, k] += along[i] * around[j] * near[k]
                    if with_slopes:
                        found[1, n, k] += by_u[i] * around[j] * near[k]
                        found[2, n, k] += along[i] * by_v[j] * near[k]
    return found


def values_at(known: FloatArray, uv: FloatArray, padding: int) -> FloatArray:
    """Interpolate.

    Parameters
    ----------
    known : array (n_rows, n_columns, n_quantities)
        `coefficients` on the grid, which begins `padding` rows and columns before u = 0 and v = 0.
    uv : array (n_places, 2)
        Where; at least one row and column from the first, and two from the last.
    padding : int
        Rows and columns before 0.

    Returns
    -------
    array (n_places, n_quantities)

    Examples
    --------
    >>> u, v = np.indices((41, 41)) - 20.0
    >>> known = coefficients((u * u * v)[:, :, None])
    >>> values_at(known, np.array([[1.5, 2.0]]), 20).round(6).tolist()
    [[4.5]]
    """
    return _interpolated(known, uv, padding, False)[0]


def values_and_slopes_at(known: FloatArray, uv: FloatArray, padding: int) -> FloatArray:
    """Interpolate, and differentiate by u and by v.

    Parameters
    ----------
    known, uv, padding
        As in `values_at`.

    Returns
    -------
    array (3, n_places, n_quantities)
        Values, their derivatives by u, those by v.

    Examples
    --------
    >>> u, v = np.indices((41, 41)) - 20.0
    >>> known = coefficients((u * u * v)[:, :, None])
    >>> values_and_slopes_at(known, np.array([[1.5, 2.0]]), 20).ravel().round(6).tolist()
    [4.5, 6.0, 2.25]
    """
    return _interpolated(known, uv, padding, True)
