"""The skin beside and in front of the nail, unrolled from the nail's edge.

The edge runs from the proximal end of one side around the front to that of the other. A geodesic of the skin
starts at right angles from each of its points; a fan of geodesics starts at a corner. In the plane

    along    = arc of the line at the same distance from the edge, from the midline in front of the nail,
    distance = length of the geodesic.

Lines of equal distance are perpendicular to the geodesics (Gauss), so areas in the plane equal areas of skin.
Rows of receptors along the edge are rows of the plane.
"""

from __future__ import annotations

import math
from dataclasses import field
from functools import cached_property

import numpy as np
from numpy.typing import ArrayLike

from fingerpad.core.checked import value_class
from fingerpad.core.errors import InputError
from fingerpad.core.layouts import Layout, mean_spacing_mm
from fingerpad.core.regions import Polygon
from fingerpad.core.values import Count, Finite, FloatArray, Positive, float_array, positive
from fingerpad.geometry.fingertip import Fingertip

REACH_MM = 4.0  # Largest distance from the nail of the unrolled skin. [mm]

_STEP_MM = 0.05
_FAN_LINES = 48
_ROUND_OFF_MM = 1e-6


@value_class
class NailEdge:
    """The plane of the skin around a finger's nail.

    Parameters
    ----------
    finger : Fingertip
        The finger.
    reach_mm : float
        Largest distance from the nail's edge. [mm]

    Examples
    --------
    >>> nail = NailEdge()
    >>> nail.points([[0.0, 0.0]]).round(2).tolist()
    [[29.25, 2.8, 0.0]]
    >>> rows = nail.rows(2, density_per_cm2=100.0)
    >>> len(rows), bool(nail.finger.is_under_nail(nail.points(rows.places_mm)).any())
    (83, False)
    """

    finger: Fingertip = field(default_factory=Fingertip)
    reach_mm: Positive = REACH_MM

    def __post_init__(self) -> None:
        narrowest = float(np.min(self.finger.section(np.array(self.finger.nail_x_mm))[2]))
        if self.finger.nail_half_width_mm >= narrowest:
            raise InputError(
                f"The nail, {self.finger.nail_half_width_mm:g} mm to either side, must leave skin beside it: "
                f"the finger's half-width is {narrowest:.2f} mm."
            )

    def half_length_mm(self, distance_mm: ArrayLike) -> FloatArray:
        """Largest `along` at each distance from the edge, half the length of that line. [mm]"""
        _, arcs = self._lines
        distances = np.asarray(distance_mm, dtype=np.float64)
        return np.interp(distances, _STEP_MM * np.arange(arcs.shape[1]), arcs[-1])

    def points(self, places_mm: ArrayLike) -> FloatArray:
        """Points (n, 3) of the skin. [mm]

        Parameters
        ----------
        places_mm : array_like (n, 2)
            `along`, whose sign z has, and `distance`. [mm]
        """
        places = float_array("places_mm", places_mm, 2)
        if places.shape[1] != 2:
            raise InputError("places_mm", "needs two columns, along and distance", f"shape {places.shape}")
        along, distance = np.abs(places[:, 0]), places[:, 1]
        outside = (distance < -_ROUND_OFF_MM) | (distance > self.reach_mm + _ROUND_OFF_MM)
        outside |= along > self.half_length_mm(distance) + _ROUND_OFF_MM
        if outside.any():
            wrong = places[np.argmax(outside)]
            raise InputError(
                "places_mm",
                f"must lie within {self.reach_mm:g} mm of the edge of the nail and between its ends",
                f"along = {wrong[0]:g}, distance = {wrong[1]:g} mm",
            )
        lines, arcs = self._lines
        step = np.clip(distance / _STEP_MM, 0.0, arcs.shape[1] - 1 - 1e-9)
        before = step.astype(np.int64)
        share = step - before
        arc = (1.0 - share) * arcs[:, before] + share * arcs[:, before + 1]
        line = np.clip((arc <= along).sum(axis=0) - 1, 0, len(arc) - 2)
        which = np.arange(len(places))
        span = arc[line + 1, which] - arc[line, which]
        part = np.clip((along - arc[line, which]) / np.maximum(span, 1e-300), 0.0, 1.0)[:, None]
        here, there = (
            (1.0 - share)[:, None] * lines[each, before] + share[:, None] * lines[each, before + 1]
            for each in (line, line + 1)
        )
        found = self._on_skin((1.0 - part) * here + part * there)
        found[:, 2] = np.copysign(found[:, 2], places[:, 0])
        return found

    def region(self, width_mm: Finite) -> Polygon:
        """Return a strip along the whole edge as a region of the plane.

        Parameters
        ----------
        width_mm : float
            Its width from the edge, at most the reach. [mm]
        """
        distances = np.linspace(0.0, self._within_reach("width_mm", width_mm), 33)
        side = np.stack([self.half_length_mm(distances), distances], axis=1)
        return Polygon(tuple(map(tuple, np.concatenate([side, side[::-1] * [-1.0, 1.0]]))))

    def rows(self, count: Count, density_per_cm2: Positive) -> Layout:
        """Place receptors in rows along the edge, the first at half a pitch from it.

        Parameters
        ----------
        count : int
            Number of rows.
        density_per_cm2 : float
            Receptors per area; the distance of rows is 1/sqrt(density), that of receptors in a row as close
            to it as whole numbers allow. [1/cm²]

        Examples
        --------
        >>> len(NailEdge().rows(1, density_per_cm2=25.0))
        21
        """
        pitch = mean_spacing_mm(density_per_cm2)
        distances = pitch * (np.arange(count) + 0.5)
        self._within_reach("The distance of the last row", distances[-1])
        rows = []
        for distance, half_length in zip(distances, self.half_length_mm(distances), strict=True):
            number = max(1, round(2.0 * half_length / pitch))
            along = half_length * ((2.0 * np.arange(number) + 1.0) / number - 1.0)
            rows.append(np.stack([along, np.full(number, distance)], axis=1))
        return Layout(np.concatenate(rows), pitch, "rectangular")

    def _within_reach(self, name: str, distance_mm: float) -> float:
        if positive(name, distance_mm, "mm") > self.reach_mm:
            raise InputError(
                name,
                f"must not exceed the reach of {self.reach_mm:g} mm from the nail's edge",
                f"{distance_mm:.3g} mm",
                "raise reach_mm",
            )
        return float(distance_mm)

    @cached_property
    def _lines(self) -> tuple[FloatArray, FloatArray]:
        """Points of geodesics (n_lines, n_steps + 1, 3) from the half edge z >= 0, and arcs across them."""
        points, directions = self._edge
        lines = [points]
        for _ in range(math.ceil(self.reach_mm / _STEP_MM - 1e-9) + 1):
            points = self._on_skin(points + _STEP_MM * directions)
            normals = self.finger.skin_normal(points)
            directions = directions - (directions * normals).sum(axis=1, keepdims=True) * normals
            directions /= np.linalg.norm(directions, axis=1, keepdims=True)
            lines.append(points)
        stacked = np.stack(lines, axis=1)
        chords = np.linalg.norm(np.diff(stacked, axis=0), axis=2)
        return stacked, np.concatenate([np.zeros((1, stacked.shape[1])), np.cumsum(chords, axis=0)])

    @property
    def _edge(self) -> tuple[FloatArray, FloatArray]:
        """Points of the half edge, from the midline around the corner, and directions away from the nail."""
        (proximal, distal), half_width = self.finger.nail_x_mm, self.finger.nail_half_width_mm
        across = np.linspace(0.0, half_width, math.ceil(half_width / _STEP_MM) + 1)
        backwards = np.linspace(distal, proximal, math.ceil((distal - proximal) / _STEP_MM) + 1)
        front = self._dorsal(np.full_like(across, distal), across)
        side = self._dorsal(backwards, np.full_like(backwards, half_width))
        # The edge runs from the middle to +z and then in the proximal direction.
        leaving, going = self._leaving(front), self._leaving(side)
        leaving[0, 2] = 0.0  # the line from the middle lies on the plane of symmetry
        turn = math.acos(float(np.clip(leaving[-1] @ going[0], -1.0, 1.0)))
        angles = np.linspace(0.0, turn, _FAN_LINES)[1:-1, None]
        fan = (np.sin(turn - angles) * leaving[-1] + np.sin(angles) * going[0]) / math.sin(turn)
        points = np.concatenate([front, np.repeat(front[-1:], len(fan), axis=0), side])
        return points, np.concatenate([leaving, fan, going])

    def _leaving(self, edge: FloatArray) -> FloatArray:
        """Find unit directions in the skin, away from the nail, of a part of the edge."""
        tangent = np.gradient(edge, axis=0, edge_order=2)
        away = np.cross(self.finger.skin_normal(edge), tangent)
        return away / np.linalg.norm(away, axis=1, keepdims=True)

    def _dorsal(self, x: FloatArray, z: FloatArray) -> FloatArray:
        _, dorsal, half_width = self.finger.section(x)
        return np.stack([x, dorsal * np.sqrt(1.0 - (z / half_width) ** 2), z], axis=1)

    def _on_skin(self, points: FloatArray) -> FloatArray:
        """Points moved onto the skin along its normal, by Newton's method."""
        for _ in range(4):
            gradient = self.finger.level_gradient(points)
            square = (gradient**2).sum(axis=1, keepdims=True)
            points = points - self.finger.level(points)[:, None] * gradient / square
        return points
