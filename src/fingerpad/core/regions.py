"""Regions of a plane for receptors: rectangles, ellipses and polygons, each with its area.

The plane is the skin seen from its volar side (x and z), or the unrolled skin of
`fingerpad.skin.unrolled_skin`, where an area in the plane is the same area of skin.
"""

from __future__ import annotations

import math
from typing import Protocol, runtime_checkable

import numpy as np
from numpy.typing import ArrayLike

from fingerpad.core.checked import value_class
from fingerpad.core.errors import InputError
from fingerpad.core.values import FloatArray, Pairs, Positive, float_array

Point = tuple[float, float]

_ROUND_OFF = 1e-9  # Tolerance for points on the border of a region, over its size, because of round-off.


@runtime_checkable
class Region(Protocol):
    """A part of the plane with an area and a test for points."""

    @property
    def area_mm2(self) -> float: ...

    @property
    def bounds_mm(self) -> tuple[Point, Point]:
        """Corners of the smallest upright rectangle around it, the lower one first. [mm]"""
        ...

    def contains(self, points_mm: ArrayLike) -> np.ndarray:
        """Whether each of the points (n, 2) lies inside or on the border, bool (n,)."""
        ...


@value_class
class Rectangle:
    """Rectangle with sides parallel to the axes.

    Parameters
    ----------
    length_mm, width_mm : float
        Extent along the first and the second axis. [mm]
    centre_mm : (float, float), optional
        Its middle. [mm]

    Examples
    --------
    >>> patch = Rectangle(length_mm=3.0, width_mm=6.0)
    >>> patch.area_mm2, patch.contains([[1.5, 0.0], [0.0, 3.1]]).tolist()
    (18.0, [True, False])
    """

    length_mm: Positive
    width_mm: Positive
    centre_mm: Point = (0.0, 0.0)

    @property
    def area_mm2(self) -> float:
        """Area. [mm²]"""
        return self.length_mm * self.width_mm

    @property
    def bounds_mm(self) -> tuple[Point, Point]:
        """The rectangle's own lower and upper corner. [mm]"""
        return _bounds(self.centre_mm, 0.5 * self.length_mm, 0.5 * self.width_mm)

    def contains(self, points_mm: ArrayLike) -> np.ndarray:
        """Whether each of the points (n, 2) lies inside or on the border, bool (n,)."""
        away = np.abs(_points(points_mm) - self.centre_mm) / (0.5 * self.length_mm, 0.5 * self.width_mm)
        return away.max(axis=1) <= 1.0 + _ROUND_OFF


@value_class
class Ellipse:
    """Ellipse with axes parallel to the coordinate axes; a disc if both semi-axes are equal.

    Parameters
    ----------
    semi_length_mm, semi_width_mm : float
        Semi-axes along the first and the second axis. [mm]
    centre_mm : (float, float), optional
        Its middle. [mm]

    Examples
    --------
    >>> disc = Ellipse(2.0, 2.0)
    >>> round(disc.area_mm2, 3), disc.contains([[2.0, 0.0], [1.5, 1.5]]).tolist()
    (12.566, [True, False])
    """

    semi_length_mm: Positive
    semi_width_mm: Positive
    centre_mm: Point = (0.0, 0.0)

    @property
    def area_mm2(self) -> float:
        """Area, pi a b. [mm²]"""
        return math.pi * self.semi_length_mm * self.semi_width_mm

    @property
    def bounds_mm(self) -> tuple[Point, Point]:
        """Lower and upper corner of the rectangle around it. [mm]"""
        return _bounds(self.centre_mm, self.semi_length_mm, self.semi_width_mm)

    def contains(self, points_mm: ArrayLike) -> np.ndarray:
        """Whether each of the points (n, 2) lies inside or on the border, bool (n,)."""
        away = (_points(points_mm) - self.centre_mm) / (self.semi_length_mm, self.semi_width_mm)
        return np.square(away).sum(axis=1) <= 1.0 + _ROUND_OFF


@value_class
class Polygon:
    """Region inside a closed line of straight edges that does not cross itself.

    Parameters
    ----------
    corners_mm : sequence of (float, float)
        Three corners or more, in either direction; the last is joined to the first. [mm]

    Examples
    --------
    >>> triangle = Polygon(((0.0, 0.0), (4.0, 0.0), (0.0, 2.0)))
    >>> triangle.area_mm2, triangle.contains([[1.0, 0.5], [3.0, 1.5]]).tolist()
    (4.0, [True, False])
    """

    corners_mm: Pairs

    def __post_init__(self) -> None:
        corners = np.array(self.corners_mm)
        if len(corners) < 3:
            raise InputError("corners_mm", "needs three pairs or more", str(len(corners)))
        extent = float(np.prod(np.ptp(corners, axis=0)))
        if self.area_mm2 <= _ROUND_OFF * extent:
            raise InputError("corners_mm", "must enclose an area", "corners on one line")
        crossing = _first_crossing(corners)
        if crossing:
            raise InputError(
                f"Edges of a polygon must not cross: those from corners {crossing[0]} and {crossing[1]} do; "
                "list the corners in order around it."
            )

    @property
    def area_mm2(self) -> float:
        """Area, from the cross products of adjacent corners. [mm²]"""
        corners = np.array(self.corners_mm) - self.corners_mm[0]
        return 0.5 * abs(float(_cross(corners, np.roll(corners, -1, axis=0)).sum()))

    @property
    def bounds_mm(self) -> tuple[Point, Point]:
        """Lower and upper corner of the rectangle around it. [mm]"""
        x, z = zip(*self.corners_mm, strict=True)
        return (min(x), min(z)), (max(x), max(z))

    def contains(self, points_mm: ArrayLike) -> np.ndarray:
        """Whether each of the points (n, 2) lies inside, bool (n,).

        A half-line from an inner point crosses an odd number of edges.
        """
        points = _points(points_mm)
        inside = np.zeros(len(points), dtype=bool)
        corners = np.array(self.corners_mm)
        for start, end in zip(corners, np.roll(corners, -1, axis=0), strict=True):
            spans = (start[1] > points[:, 1]) != (end[1] > points[:, 1])
            if spans.any():
                share = (points[spans, 1] - start[1]) / (end[1] - start[1])
                inside[spans] ^= points[spans, 0] < start[0] + share * (end[0] - start[0])
        return inside


def _first_crossing(corners: FloatArray) -> tuple[int, int] | None:
    """Numbers of the first two edges, not adjacent, that cross or touch."""
    count, ends = len(corners), np.roll(corners, -1, axis=0)
    for first in range(count):
        others = np.arange(first + 2, count - (first == 0))
        if not others.size:
            continue
        a, b, c, d = corners[first], ends[first], corners[others], ends[others]
        apart = _cross(b - a, c - a) * _cross(b - a, d - a) > 0.0
        apart |= _cross(d - c, a - c) * _cross(d - c, b - c) > 0.0
        # Edges on one line meet if their extents overlap.
        apart |= (np.maximum(c, d) < np.minimum(a, b)).any(axis=1)
        apart |= (np.minimum(c, d) > np.maximum(a, b)).any(axis=1)
        if not apart.all():
            return first, int(others[np.argmin(apart)])
    return None


def _cross(a: FloatArray, b: FloatArray) -> FloatArray:
    """Cross products of vectors of the plane, (..., 2) -> (...)."""
    return a[..., 0] * b[..., 1] - a[..., 1] * b[..., 0]


def _bounds(centre: Point, half_length: float, half_width: float) -> tuple[Point, Point]:
    x, z = centre
    return (x - half_length, z - half_width), (x + half_length, z + half_width)


def _points(points_mm: ArrayLike) -> FloatArray:
    points = float_array("points_mm", points_mm, 2)
    if points.shape[1] != 2:
        raise InputError("points_mm", "needs two columns", f"shape {points.shape}")
    return points
