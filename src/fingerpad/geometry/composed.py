"""Bodies made of others: unions with rounded seams, and gratings of any ridges."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import replace
from functools import cached_property, partial
from typing import Annotated

import numpy as np

from fingerpad.core.checked import checked, value_class
from fingerpad.core.errors import InputError
from fingerpad.core.values import (
    Check,
    Finite,
    FloatArray,
    Many,
    NotNegative,
    PointsMm,
    Positive,
    entries,
    finite,
    float_array,
    tuple_of,
)
from fingerpad.geometry.indenters import Bar, Indenter, Plate
from fingerpad.geometry.relief import (
    PIXELS,
    REACH_MM,
    RELIEF_MM,
    WIDTHS_MM,
    check_edge_radius,
    narrowest_relief,
    with_rounded_edges,
)

SAME_MM = 1e-6  # Heights that differ by less are equal. [mm]

LEAST_SLOPE = 0.2
"""Least length of the gradient in a seam by which a gap is divided: parts that face each other have none."""


@value_class
class Union(Indenter):
    """Several bodies as one, each moved, with rounded seams and edges.

    Parameters
    ----------
    parts : sequence of Indenter
        The bodies.
    at_mm : sequence of (x, y, z)
        How far each is moved: along the finger, towards the skin, across. [mm]
    seam_mm : float
        Width over which concave seams are filled; 0 for sharp ones. [mm]
    edge_radius_mm : float
        Radius to which edges of the parts are rounded, at most half of the narrowest part; 0 keeps them. [mm]

    Examples
    --------
    >>> from fingerpad.geometry.indenters import Sphere
    >>> ball = Sphere(radius_mm=1.0)
    >>> pair = Union([ball, ball], [(-1.5, 0.0, 0.0), (1.5, 0.0, 0.0)])
    >>> pair.front(np.array([[1.5, 0.0, 0.0], [0.7, 0.0, 0.0]])).round(3).tolist()
    [0.0, -0.4]
    """

    parts: Many[Indenter]
    at_mm: Annotated[
        tuple[tuple[float, float, float], ...], entries(Check(partial(tuple_of, each=finite, length=3), {}))
    ]
    seam_mm: NotNegative = 0.0
    edge_radius_mm: NotNegative = 0.0

    def __post_init__(self) -> None:
        if not self.parts or len(self.at_mm) != len(self.parts):
            raise InputError(
                f"A union needs one (x, y, z) of at_mm for each of its parts: got {len(self.at_mm)} for "
                f"{len(self.parts)} parts."
            )
        if self.edge_radius_mm:
            check_edge_radius(self.edge_radius_mm, replace(self, edge_radius_mm=0.0).narrowest_mm)

    @property
    def half_width_mm(self) -> float:
        return max(
            part.half_width_mm + abs(x) for part, (x, _, _) in zip(self.parts, self.at_mm, strict=True)
        )

    @property
    def relief_mm(self) -> float:
        found = min(part.relief_mm for part in self.parts)
        return found if self._swept else min(found, self._measured_mm)

    @property
    def narrowest_mm(self) -> float:
        return min(self._measured_mm, *(min(part.relief_mm, part.narrowest_mm) for part in self.parts))

    @property
    def edge_reach_mm(self) -> float:
        if not (self._swept and np.isfinite(self.narrowest_mm)):
            return 0.0
        reaches = (
            part.half_width_mm + abs(x) for part, (x, _, _) in zip(self.parts, self.at_mm, strict=True)
        )
        return min(max((reach for reach in reaches if np.isfinite(reach)), default=REACH_MM), REACH_MM)

    @cached_property
    def _swept(self) -> bool:
        """Whether its face is the same all along z."""
        return bool(np.ptp(self._heights(np.linspace(-REACH_MM, REACH_MM, 7)), axis=1).max() < SAME_MM)

    @cached_property
    def _measured_mm(self) -> float:
        """Width of the narrowest dot, ridge or groove of the face; infinite if all are wide. [mm]"""
        z_mm = np.zeros(1) if self._swept else np.linspace(-REACH_MM, REACH_MM, PIXELS)
        height = self._heights(z_mm) * np.ones(PIXELS)
        found = narrowest_relief(height, 2 * REACH_MM / (PIXELS - 1), float(height.min()))
        return found if found < WIDTHS_MM[-1] else np.inf

    def _heights(self, z_mm: FloatArray) -> FloatArray:
        """Heights of the face over a grid of x and these z, the lowest that matters beside it. [mm]"""
        x, z = np.meshgrid(np.linspace(-REACH_MM, REACH_MM, PIXELS), z_mm, indexing="ij")
        height = self.front(np.column_stack([x.ravel(), np.zeros(x.size), z.ravel()])).reshape(x.shape)
        return np.maximum(height, height.max() - RELIEF_MM)

    def gap(self, points_mm: PointsMm) -> tuple[FloatArray, FloatArray]:
        if self.edge_radius_mm == 0.0:
            return self._sharp(points_mm)
        return with_rounded_edges(self._sharp, points_mm, self.edge_radius_mm)

    def _sharp(self, points_mm: FloatArray) -> tuple[FloatArray, FloatArray]:
        gap, normal = self.parts[0].gap(points_mm - np.array(self.at_mm[0]))
        for part, at in zip(self.parts[1:], self.at_mm[1:], strict=True):
            gap, normal = self._joined(gap, normal, *part.gap(points_mm - np.array(at)))
        return gap, normal

    def _joined(
        self, gap: FloatArray, normal: FloatArray, other: FloatArray, other_normal: FloatArray
    ) -> tuple[FloatArray, FloatArray]:
        """Join two gaps by their minimum, or by a quadratic minimum over `seam_mm`, and its gradient."""
        if self.seam_mm == 0.0:
            return np.minimum(gap, other), np.where((gap <= other)[:, None], normal, other_normal)
        share = np.clip(0.5 + 0.5 * (other - gap) / self.seam_mm, 0.0, 1.0)
        both = other + share * (gap - other) - self.seam_mm * share * (1.0 - share)
        slope = share[:, None] * normal + (1.0 - share[:, None]) * other_normal
        # The gradient is shorter than 1 in a seam. Divided by its length, the gap is a distance at the face.
        length = np.maximum(np.linalg.norm(slope, axis=1), LEAST_SLOPE)
        return both / length, slope / np.linalg.norm(slope, axis=1)[:, None]


@checked
def ridges(
    centres_mm: Sequence[float],
    widths_mm: Sequence[float],
    fillet_mm: Finite = 0.1,
    height_mm: Positive = 1.0,
) -> Union:
    """Grating of any ridges across the finger on a flat plate, periodic or not.

    Parameters
    ----------
    centres_mm, widths_mm : sequence of float
        Middle of each ridge along the finger, from the indenter's axis, and its width. [mm]
    fillet_mm : float
        Radius of the edges. [mm]
    height_mm : float
        Height of the ridges above the plate. [mm]

    Examples
    --------
    >>> uneven = ridges([-2.0, 0.0, 1.5], [1.0, 0.6, 0.8])
    >>> uneven.front(np.array([[-2.0, 0.0, 3.0], [-1.0, 0.0, 3.0]])).round(3).tolist()
    [0.0, -1.0]
    """
    centres, widths = float_array("centres_mm", centres_mm, 1), float_array("widths_mm", widths_mm, 1)
    if centres.shape != widths.shape or not centres.size:
        raise InputError(
            "ridges", "needs one of widths_mm for each of centres_mm", f"{widths.size} and {centres.size}"
        )
    bars = [Bar(width, fillet_mm) for width in widths.tolist()]
    at = [(centre, 0.0, 0.0) for centre in centres.tolist()]
    return Union((*bars, Plate()), (*at, (0.0, -height_mm, 0.0)))
