"""The skin of the finger, unrolled into a plane by a map that preserves areas: two maps.

`UnrolledSkin` unrolls all of it. A point of the skin is P(s, phi), with s = sqrt(1 - x / L) and phi around
the section, 0 volar and pi dorsal:

    P = (L (1 - s^2), -a cos(phi), c sin(phi)),

a(s) being the volar depth or, for phi beyond pi/2, the dorsal height, and c(s) the half-width. In the plane

    along  = arc of the volar midline, u(s)
    around = integral of |dP/ds x dP/dphi| / |du/ds| from 0 to phi.

A density in the plane is therefore a density on the skin. On a body of revolution `around` is the arc around
the section; on this finger it differs by some per cent. Lengths change by at most 3 % within 3 mm of the
contact point, by 12 % on the pad, and by more at the tip.

`NailEdge` unrolls the skin beside and in front of the nail, from the nail's edge, which runs from the
proximal end of one side around the front to that of the other. A geodesic of the skin starts at right angles
from each of its points; a fan of geodesics starts at a corner. In the plane

    along    = arc of the line at the same distance from the edge, from the midline in front of the nail,
    distance = length of the geodesic.

Lines of equal distance are perpendicular to the geodesics (Gauss), so areas in the plane equal areas of skin.
Rows of receptors along the edge are rows of the plane.
"""

from __future__ import annotations

import math
from dataclasses import dataclass, field
from functools import cached_property

import numpy as np
from numpy.typing import ArrayLike
from scipy.interpolate import CubicSpline

from fingerpad.core.checked import value_class
from fingerpad.core.errors import InputError
from fingerpad.core.regions import Layout, Polygon, mean_spacing_mm, rows_of
from fingerpad.core.values import (
    Count,
    Finite,
    FloatArray,
    Pair,
    Positive,
    finite,
    float_array,
    increasing,
    positive,
)
from fingerpad.data import fingertip as published
from fingerpad.geometry.fingertip import Fingertip

PAD_X_MM = (8.0, 26.0)  # Proximal and distal end of the paper's pad: where the subcutis is thick. [mm]
PAD_FACES_DEG = 45.0  # Largest angle between the skin's normal and the volar direction on the pad. [degrees]

_ARC_POINTS = 2001
_NODES, _WEIGHTS = np.polynomial.legendre.leggauss(20)  # exact to 1e-9 mm on a quarter of a section
_MOST_STEPS = 60
_EXACT_RAD = 1e-13
_ROUND_OFF_MM = 1e-6
_HALF = 0.5 * np.pi


@dataclass(frozen=True)
class _Quarter:
    """A quarter of each of some sections, volar or dorsal, and its element of area."""

    a: FloatArray
    a_slope: FloatArray  #: Volar depth or dorsal height and its derivative by s. [mm]
    c: FloatArray
    c_slope: FloatArray  #: Half-width and its derivative by s. [mm]
    x_slope: FloatArray  #: |dx/ds|. [mm]

    def area_element(self, phi: FloatArray) -> FloatArray:
        """|dP/ds x dP/dphi|. [mm²]"""
        cosine, sine = np.cos(phi), np.sin(phi)
        x = self.a_slope * self.c * cosine**2 + self.c_slope * self.a * sine**2
        return np.sqrt(x**2 + (self.x_slope * self.c * cosine) ** 2 + (self.x_slope * self.a * sine) ** 2)

    def area(self, start: FloatArray, end: FloatArray) -> FloatArray:
        """Integral of the element of area over phi. [mm²]"""
        middle, reach = 0.5 * (start + end), 0.5 * (end - start)
        total = np.zeros_like(middle)
        for node, weight in zip(_NODES, _WEIGHTS, strict=True):
            total += reach * weight * self.area_element(middle + reach * node)
        return total

    def reached(self, start: FloatArray, area: FloatArray) -> FloatArray:
        """Find phi up to which the integral from `start` takes a value, by Newton's method in a bracket."""
        low, high = start, start + _HALF
        phi = start + _HALF * area / self.area(low, high)
        for _ in range(_MOST_STEPS):
            excess = self.area(start, phi) - area
            low, high = np.where(excess < 0.0, phi, low), np.where(excess < 0.0, high, phi)
            newton = phi - excess / self.area_element(phi)
            following = np.where((newton >= low) & (newton <= high), newton, 0.5 * (low + high))
            step, phi = np.abs(following - phi).max(initial=0.0), following
            if step < _EXACT_RAD:
                break
        return phi


@value_class
class UnrolledSkin:
    """The plane of a finger's skin.

    Examples
    --------
    >>> skin = UnrolledSkin()
    >>> skin.points([[0.0, 0.0]]).round(2).tolist()
    [[17.37, -9.85, 0.0]]
    >>> round(float(skin.points([[0.0, 5.0]])[0, 2]), 1)
    4.8
    """

    finger: Fingertip = field(default_factory=Fingertip)
    origin_x_mm: Finite = None  # type: ignore[assignment]  #: a number after initialisation
    """x of the point of the volar midline at which `along` is 0, distal positive; by default the middle of
    the pad. [mm]"""

    def __post_init__(self) -> None:
        if self.origin_x_mm is None:
            object.__setattr__(self, "origin_x_mm", self.finger.contact_mm[0])
        if not 0.0 < finite("origin_x_mm", self.origin_x_mm, "mm") < self.finger.length_mm:
            raise InputError(
                "origin_x_mm", f"must lie between 0 and {self.finger.length_mm} mm", str(self.origin_x_mm)
            )

    @property
    def ends_mm(self) -> tuple[float, float]:
        """`along` at the cut and at the tip. [mm]"""
        return float(self._along(np.array(1.0))), float(self._along(np.array(0.0)))

    def half_girth_mm(self, along_mm: ArrayLike) -> FloatArray:
        """`around` on the dorsal midline, its largest value, at each place along. [mm]"""
        s = self._s(np.asarray(along_mm, dtype=np.float64))
        return self._around(s, np.full(s.shape, np.pi))

    def points(self, places_mm: ArrayLike) -> FloatArray:
        """Points (n, 3) of the skin at `along` and `around`, whose sign z has, (n, 2). [mm]"""
        places = rows_of("places_mm", places_mm, "two columns, along and around", 2)
        first, last = self.ends_mm
        along, around = places[:, 0], np.abs(places[:, 1])
        outside = (along < first - _ROUND_OFF_MM) | (along > last + _ROUND_OFF_MM)
        s = self._s(np.clip(along, first, last))
        half_girth = self._around(s, np.full(s.shape, np.pi))
        outside |= around > half_girth + _ROUND_OFF_MM
        if outside.any():
            wrong = places[np.argmax(outside)]
            raise InputError(
                "places_mm",
                f"must lie on the finger, along within {first:.2f} ... {last:.2f} mm and around up to the "
                "dorsal midline",
                f"along = {wrong[0]:g}, around = {wrong[1]:g} mm",
            )
        return self._point(s, np.copysign(self._phi(s, np.minimum(around, half_girth)), places[:, 1]))

    def places(self, points_mm: ArrayLike) -> FloatArray:
        """Convert points of the skin (n, 3) to the plane: `along` and `around`, (n, 2). [mm]

        Another point is projected onto the skin along its ray from the middle of the section.
        """
        points = rows_of("points_mm", points_mm, "three columns, x, y and z", 3)
        x, y, z = points.T
        if (x < -_ROUND_OFF_MM).any() or (x > self.finger.length_mm + _ROUND_OFF_MM).any():
            raise InputError(f"x of points_mm must lie within 0 ... {self.finger.length_mm} mm.")
        s = np.sqrt(np.clip(1.0 - x / self.finger.length_mm, 0.0, 1.0))
        volar, dorsal, half_width = (profile.over_s(s)[0] for profile in self.finger.profiles)
        phi = np.arctan2(z / half_width, -y / np.where(y < 0.0, volar, dorsal))
        return np.stack([self._along(s), np.copysign(self._around(s, np.abs(phi)), phi)], axis=1)

    def pad(self, x_mm: Pair | None = None, faces_deg: Finite = PAD_FACES_DEG) -> Polygon:
        """Return the pad as a region of the plane.

        Parameters
        ----------
        x_mm : (float, float), optional
            Its proximal and distal end on the midline; by default in proportion to the finger's length. [mm]
        faces_deg : float, optional
            Largest angle between its normals and the volar direction, above 0 and at most 90. [degrees]

        Examples
        --------
        >>> round(UnrolledSkin().pad().area_mm2)
        272
        """
        if x_mm is None:
            first, last = (x * (self.finger.length_mm / published.LENGTH.value) for x in PAD_X_MM)
            x_mm = first, last
        ends = increasing("x_mm", float_array("x_mm", x_mm, 1))
        if ends.size != 2 or ends[0] < 0.0 or ends[1] > self.finger.length_mm:
            raise InputError("x_mm", f"must be two ends within 0 ... {self.finger.length_mm} mm", str(x_mm))
        if not 0.0 < faces_deg <= 90.0:
            raise InputError("faces_deg", "must be above 0 and at most 90 degrees", repr(faces_deg))
        s = np.sqrt(1.0 - np.linspace(ends[0], ends[1], 61) / self.finger.length_mm)
        low, high = np.zeros_like(s), np.full_like(s, _HALF)
        for _ in range(_MOST_STEPS):
            middle = 0.5 * (low + high)
            volar = -self.finger.skin_normal(self._point(s, middle))[:, 1]
            inside = volar > np.cos(np.deg2rad(faces_deg))
            low, high = np.where(inside, middle, low), np.where(inside, high, middle)
        along, around = self._along(s), self._around(s, low)
        if not around.max() > 0.0:
            raise InputError(
                f"No skin between x = {ends[0]:g} and {ends[1]:g} mm is within {faces_deg:g} degrees of "
                "the volar direction: raise faces_deg or move x_mm."
            )
        border = np.stack([along, around], axis=1)
        return Polygon(tuple(map(tuple, np.concatenate([border, border[::-1] * [1.0, -1.0]]))))

    def _point(self, s: FloatArray, phi: FloatArray) -> FloatArray:
        volar, dorsal = self._quarters(s)
        a = np.where(np.abs(phi) <= _HALF, volar.a, dorsal.a)
        x = self.finger.length_mm * (1.0 - s**2)
        return np.stack([x, -a * np.cos(phi), volar.c * np.sin(phi)], axis=-1)

    def _quarters(self, s: FloatArray) -> tuple[_Quarter, _Quarter]:
        """Volar and dorsal quarters of sections; each profile is s g(s), its slope g + s dg/ds."""
        (a, a_slope), (b, b_slope), (c, c_slope) = (
            (s * g, g + s * slope) for g, slope in (profile.over_s(s) for profile in self.finger.profiles)
        )
        x_slope = 2.0 * self.finger.length_mm * s
        return _Quarter(a, a_slope, c, c_slope, x_slope), _Quarter(b, b_slope, c, c_slope, x_slope)

    def _midline_slope(self, s: FloatArray) -> FloatArray:
        volar, _ = self._quarters(s)
        return np.hypot(volar.x_slope, volar.a_slope)

    def _around(self, s: FloatArray, phi: FloatArray) -> FloatArray:
        """`around` at phi >= 0: the integral over the volar and, beyond it, the dorsal quarter."""
        volar, dorsal = self._quarters(s)
        side = np.full_like(phi, _HALF)
        area = volar.area(np.zeros_like(phi), np.minimum(phi, side))
        area = area + dorsal.area(side, np.maximum(phi, side))
        return area / self._midline_slope(s)

    def _phi(self, s: FloatArray, around: FloatArray) -> FloatArray:
        """Angle at which `around` takes its value."""
        volar, _ = self._quarters(s)
        start = np.zeros_like(around)
        area, on_volar = around * self._midline_slope(s), volar.area(start, start + _HALF)
        phi = np.empty_like(around)
        for part, before, first in ((area <= on_volar, start, 0), (area > on_volar, on_volar, 1)):
            quarter = self._quarters(s[part])[first]
            phi[part] = quarter.reached(start[part] + first * _HALF, (area - before)[part])
        return phi

    @cached_property
    def _midline(self) -> tuple[CubicSpline, CubicSpline, float]:
        """Arc from the tip as a function of s, s as one of the arc, and the arc at the origin."""
        s = np.linspace(0.0, 1.0, _ARC_POINTS)
        step = 0.5 * np.diff(s)
        nodes = s[:-1, None] + step[:, None] * (1.0 + _NODES)
        arc = np.concatenate([[0.0], np.cumsum(step * (self._midline_slope(nodes) @ _WEIGHTS))])
        forth = CubicSpline(s, arc)
        at_origin = np.sqrt(1.0 - self.origin_x_mm / self.finger.length_mm)
        return forth, CubicSpline(arc, s), float(forth(at_origin))

    def _along(self, s: FloatArray) -> FloatArray:
        arc, _, at_origin = self._midline
        return at_origin - arc(s)

    def _s(self, along_mm: FloatArray) -> FloatArray:
        _, s, at_origin = self._midline
        return np.clip(s(at_origin - along_mm), 0.0, 1.0)


REACH_MM = 4.0  # Largest distance from the nail of the unrolled skin. [mm]
_STEP_MM = 0.05  # Length of a step along a geodesic.
_FAN_LINES = 48


@value_class
class NailEdge:
    """The plane of the skin around a finger's nail.

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
    reach_mm: Positive = REACH_MM  #: Largest distance from the nail's edge. [mm]

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
        """Points (n, 3) of the skin at `along`, whose sign z has, and `distance`, (n, 2). [mm]"""
        places = rows_of("places_mm", places_mm, "two columns, along and distance", 2)
        along, distance = np.abs(places[:, 0]), places[:, 1]
        outside = (distance < -_ROUND_OFF_MM) | (distance > self.reach_mm + _ROUND_OFF_MM)
        outside |= along > self.half_length_mm(distance) + _ROUND_OFF_MM
        if outside.any():
            wrong = places[np.argmax(outside)]
            wanted = f"must lie within {self.reach_mm:g} mm of the edge of the nail and between its ends"
            raise InputError("places_mm", wanted, f"along = {wrong[0]:g}, distance = {wrong[1]:g} mm")
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
        """Return a strip along the whole edge, of at most the reach, as a region of the plane."""
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
            wanted = f"must not exceed the reach of {self.reach_mm:g} mm from the nail's edge"
            raise InputError(name, wanted, f"{distance_mm:.3g} mm", "raise reach_mm")
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
