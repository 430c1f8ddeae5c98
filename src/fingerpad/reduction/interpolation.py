"""Interpolation of smooth functions from their values at Chebyshev's points.

Along one axis a function f of s in [0, 1] is replaced by the polynomial through its values at the points
s_j = (1 - cos(pi j / n)) / 2 (Trefethen, Approximation Theory and Approximation Practice, 2013):

    f(s) = sum_j L_j(s) f(s_j),    L_j(s) = prod_{i != j} (s - s_i) / (s_j - s_i).
"""

from __future__ import annotations

from functools import cache, cached_property

import numpy as np
from numba import njit
from numpy.typing import ArrayLike

from fingerpad.core.checked import value_class
from fingerpad.core.errors import InputError
from fingerpad.core.values import Count, Finite, FloatArray


@cache
def chebyshev_points(count: int) -> FloatArray:
    """Chebyshev's points of [0, 1] with both ends, (count,); the middle for one point."""
    points = np.array([0.5])
    if count > 1:
        points = 0.5 - 0.5 * np.cos(np.pi * np.arange(count) / (count - 1))
    points.setflags(write=False)
    return points


def lagrange(points: FloatArray, values: ArrayLike) -> FloatArray:
    """Lagrange's polynomials of `points` (n,) at `values` (...,), (..., n)."""
    at = np.asarray(values, dtype=float)
    return np.asarray(_lagrange(points, at.ravel()).reshape(*at.shape, points.size))


@njit(cache=True, nogil=True)
def _lagrange(points, at):  # type: ignore[no-untyped-def]
    found = np.ones((at.size, points.size))
    for k in range(at.size):
        for j in range(points.size):
            for i in range(points.size):
                if i != j:
                    found[k, j] *= (at[k] - points[i]) / (points[j] - points[i])
    return found


def weighted(weights: FloatArray, values: FloatArray) -> FloatArray:
    return np.asarray((weights @ values.reshape(weights.size, -1)).reshape(values.shape[1:]))


@value_class
class Axis:
    """One quantity that varies over the range of a reduced touch."""

    name: str  # "x_mm", "z_mm", "tilt_deg", or a parameter of the indenter.
    low: Finite
    high: Finite  # Its range; equal if it does not vary.
    count: Count  # Number of Chebyshev's points, 1 if it does not vary.

    def __post_init__(self) -> None:
        if self.high < self.low:
            raise InputError(f"{self.name} must range from low to high: got {self.low:g} to {self.high:g}.")
        if (self.count == 1) != (self.low == self.high):
            raise InputError(
                f"{self.name} needs two points or more if it varies, and one if it does not: got "
                f"{self.count} for {self.low:g} to {self.high:g}."
            )

    @cached_property
    def points(self) -> FloatArray:
        """Chebyshev's points as shares of the range."""
        return chebyshev_points(self.count)

    @property
    def values(self) -> FloatArray:
        """Values at Chebyshev's points."""
        return self.low + (self.high - self.low) * self.points

    def weights(self, value: Finite) -> FloatArray:
        """Weights of the points at a value, (count,)."""
        # Sums of positions differ in the last digits.
        slack = 1e-9 * max(1.0, abs(self.low), abs(self.high))
        if not self.low - slack <= value <= self.high + slack:
            raise InputError(
                f"{self.name} must lie within {self.low:g} to {self.high:g}, the range of this reduced "
                f"touch: got {value:g}; solve the touch in full, or reduce it over a wider range."
            )
        if self.count == 1:
            return np.ones(1)
        return lagrange(self.points, (value - self.low) / (self.high - self.low))
