"""The cubic that carries what is known on a regular grid to any place between.

With whole numbers u and v at the grid's points,

    f(u, v) = sum over i and j of w_i(u) w_j(v) f_ij,

where on a row, from the points -1, 0, 1 and 2 about t within 0 ... 1,

    w = (-t + 2 t^2 - t^3,  2 - 5 t^2 + 3 t^3,  t + 4 t^2 - 3 t^3,  -t^2 + t^3)/2.

It passes through all values, has continuous slopes and follows parabolas exactly.

Notes
-----
Catmull & Rom 1974.
"""

from __future__ import annotations

import math

import numpy as np
from numba import njit

from fingerpad.core.checks import FloatArray

Four = tuple[float, float, float, float]


@njit(cache=True, nogil=True)
def _weights(t: float) -> Four:
    square, cube = t * t, t * t * t
    return (
        0.5 * (-t + 2.0 * square - cube),
        0.5 * (2.0 - 5.0 * square + 3.0 * cube),
        0.5 * (t + 4.0 * square - 3.0 * cube),
        0.5 * (cube - square),
    )


@njit(cache=True, nogil=True)
def _slopes(t: float) -> Four:
    square = t * t
    return (
        0.5 * (-1.0 + 4.0 * t - 3.0 * square),
        0.5 * (-10.0 * t + 9.0 * square),
        0.5 * (1.0 + 8.0 * t - 9.0 * square),
        0.5 * (-2.0 * t + 3.0 * square),
    )


@njit(cache=True, nogil=True)
def values_at(known: FloatArray, uv: FloatArray, padding: int) -> FloatArray:
    """Interpolate.

    Parameters
    ----------
    known : array (n_rows, n_columns, n_quantities)
        On the grid, which begins `padding` rows and columns before u = 0 and v = 0.
    uv : array (n_places, 2)
        Where; at least one row and column from the first, and two from the last.
    padding : int
        Rows and columns before 0.

    Returns
    -------
    array (n_places, n_quantities)

    Examples
    --------
    >>> u, v = np.indices((5, 5), dtype=float)
    >>> values_at((u * u * v)[:, :, None], np.array([[1.5, 2.0]]), 0).tolist()
    [[4.5]]
    """
    found = np.zeros((len(uv), known.shape[2]))
    for n in range(len(uv)):
        row, column = math.floor(uv[n, 0]), math.floor(uv[n, 1])
        along, around = _weights(uv[n, 0] - row), _weights(uv[n, 1] - column)
        for i in range(4):
            for j in range(4):
                weight = along[i] * around[j]
                near = known[row + padding - 1 + i, column + padding - 1 + j]
                for k in range(near.size):
                    found[n, k] += weight * near[k]
    return found


@njit(cache=True, nogil=True)
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
    >>> u, v = np.indices((5, 5), dtype=float)
    >>> values_and_slopes_at((u * u * v)[:, :, None], np.array([[1.5, 2.0]]), 0).ravel().tolist()
    [4.5, 6.0, 2.25]
    """
    found = np.zeros((3, len(uv), known.shape[2]))
    for n in range(len(uv)):
        row, column = math.floor(uv[n, 0]), math.floor(uv[n, 1])
        along, around = _weights(uv[n, 0] - row), _weights(uv[n, 1] - column)
        by_u, by_v = _slopes(uv[n, 0] - row), _slopes(uv[n, 1] - column)
        for i in range(4):
            for j in range(4):
                near = known[row + padding - 1 + i, column + padding - 1 + j]
                for k in range(near.size):
                    found[0, n, k] += along[i] * around[j] * near[k]
                    found[1, n, k] += by_u[i] * around[j] * near[k]
                    found[2, n, k] += along[i] * by_v[j] * near[k]
    return found
