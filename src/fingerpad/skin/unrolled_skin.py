"""The skin of the finger, unrolled into a plane by a map that preserves areas.

A point of the skin is P(s, phi), with s = sqrt(1 - x / L) and phi around the section, 0 volar and pi dorsal:

    P = (L (1 - s^2), -a cos(phi), c sin(phi)),

a(s) being the volar depth or, for phi beyond pi/2, the dorsal height, and c(s) the half-width. In the plane

    along  = arc of the volar midline, u(s)
    around = integral of |dP/ds x dP/dphi| / |du/ds| from 0 to phi.

A density in the plane is therefore a density on the skin. On a body of revolution `around` is the arc around
the section; on this finger it differs by some per cent. Lengths change by at most 3 % within 3 mm of the
contact point, by 12 % on the pad, and by more at the tip.
"""

from __future__ import annotations

from dataclasses import dataclass, field
from functools import cached_property

import numpy as np
from numpy.typing import ArrayLike
from scipy.interpolate import CubicSpline

from fingerpad.core.checked import value_class
from fingerpad.core.errors import InputError
from fingerpad.core.regions import Polygon
from fingerpad.core.values import Finite, FloatArray, Pair, finite, float_array, increasing
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
    a_slope: FloatArray  # Volar depth or dorsal height and its derivative by s. [mm]
    c: FloatArray
    c_slope: FloatArray  # Half-width and its derivative by s. [mm]
    x_slope: FloatArray  # |dx/ds|. [mm]

    def area_element(self, phi: FloatArray) -> FloatArray:
        """|dP/ds x dP/dphi|. [mm²]"""
        cosine, sine = np.cos(phi), np.sin(phi)
        x = self.a_slope * self.c * cosine**2 + self.c_slope * self.a * sine**2
        return np.sqrt(x**2 + (self.x_slope * self.c * cosine) ** 2 + (self.x_slope * self.a * sine) ** 2)

    def area(self, start: FloatArray, end: FloatArray) -> FloatArray:
        """Integral of the element of area over phi. [mm²]"""
        middle, reach = 0.5 * (start + end), 0.5 * (end - start)
        return sum(
            (
                reach * weight * self.area_element(middle + reach * node)
                for node, weight in zip(_NODES, _WEIGHTS, strict=True)
            ),
            np.zeros_like(middle),
        )

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

    Parameters
    ----------
    finger : Fingertip
        The finger.
    origin_x_mm : float, optional
        x of the point of the volar midline at which `along` is 0, distal positive; by default the middle of
        the pad, `Fingertip.contact_mm`. [mm]

    Examples
    --------
    >>> skin = UnrolledSkin()
    >>> skin.points([[0.0, 0.0]]).round(2).tolist()
    [[17.37, -9.85, 0.0]]
    >>> round(float(skin.points([[0.0, 5.0]])[0, 2]), 1)
    4.8
    """

    finger: Fingertip = field(default_factory=Fingertip)
    origin_x_mm: Finite = None  # type: ignore[assignment]  # a number after initialisation

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
        """Points (n, 3) of the skin. [mm]

        Parameters
        ----------
        places_mm : array_like (n, 2)
            `along` and `around`; z has the sign of `around`. [mm]
        """
        places = float_array("places_mm", places_mm, 2)
        if places.shape[1] != 2:
            raise InputError("places_mm", "needs two columns, along and around", f"shape {places.shape}")
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
        """Convert points of the skin to the plane: `along` and `around`, (n, 2). [mm]

        Parameters
        ----------
        points_mm : array_like (n, 3)
            x, y and z of points on the skin. Another point is projected onto the skin along its ray from the
            middle of the section. [mm]
        """
        points = float_array("points_mm", points_mm, 2)
        if points.shape[1] != 3:
            raise InputError("points_mm", "needs three columns, x, y and z", f"shape {points.shape}")
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
        area = volar.area(np.zeros_like(phi), np.minimum(phi, side)) + dorsal.area(
            side, np.maximum(phi, side)
        )
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
