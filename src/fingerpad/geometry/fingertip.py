"""Geometry of the fingertip: outline, layer depths, bone and nail.

Axes: x from the cut at the middle phalanx to the tip, y towards the nail, z to the side. Every cross-section
of the skin is two half-ellipses joined at y = 0, so three profiles of x are the whole outline: volar depth a,
dorsal height b and half-width c. With s = sqrt(1 - x / L), as on an ellipsoid, each is s times a smooth
function of s; the level function below is written without the factor s, so it stays smooth at the tip.
"""

from __future__ import annotations

from abc import ABC, abstractmethod
from collections.abc import Callable, Mapping
from dataclasses import replace
from functools import cache, cached_property
from types import MappingProxyType
from typing import TYPE_CHECKING, Annotated

import numpy as np
from numpy.typing import ArrayLike
from scipy.interpolate import BSpline, make_smoothing_spline

from fingerpad.core.checked import checked, checked_class, value_class
from fingerpad.core.displayed import Displayed
from fingerpad.core.errors import InputError
from fingerpad.core.values import (
    Finite,
    FloatArray,
    NotNegative,
    Numbers,
    Pairs,
    Positive,
    choice,
    float_array,
    increasing,
    limits,
)
from fingerpad.data import Published, fingers
from fingerpad.data import fingertip as published

if TYPE_CHECKING:
    from fingerpad.geometry.grading import Grading
    from fingerpad.geometry.mesh import Mesh

SIZES_MM = 2.0, 100.0
"""Smallest and largest length, width or height of a fingertip: other values are in another unit. [mm]"""

ExtentMm = Annotated[float, limits(*SIZES_MM)]  # Of a whole fingertip.


def _readings(stations: Published[tuple[float, ...]], values: Published[tuple[float, ...]]) -> Pairs:
    return tuple(zip(stations.value, (abs(value) for value in values.value), strict=True))


@value_class
class Profile:
    """One dimension of the finger's sections, a smooth function of x that closes at the tip.

    The function is s g(s) with s = sqrt(1 - x / L); g is a smoothing spline through the readings, continued
    linearly beyond them.
    """

    readings_mm: Pairs
    """At least five readings, x increasing from 0 or more to less than `length_mm`, values above 0. [mm]"""
    length_mm: Positive  # x of the tip, L. [mm]

    def __post_init__(self) -> None:
        table = np.array(self.readings_mm)
        if len(table) < 5:
            raise InputError("readings_mm", "needs at least five pairs (x, value)", str(len(table)))
        stations = increasing("x of readings_mm", table[:, 0])
        if stations[0] < 0.0 or stations[-1] >= self.length_mm:
            raise InputError(
                f"x of readings_mm must lie from 0 to below the length {self.length_mm} mm: "
                f"got {stations[0]} to {stations[-1]} mm."
            )
        if (table[:, 1] <= 0.0).any():
            raise InputError(
                "readings_mm", "must be greater than 0", remedy=f"the smallest is {table[:, 1].min()} mm"
            )

    @cached_property
    def _spline(self) -> tuple[BSpline, BSpline, float, float]:
        x, value = np.array(self.readings_mm)[::-1].T
        s = np.sqrt(1.0 - x / self.length_mm)
        # Readings have two decimals. Interpolation of this rounding would tilt the skin's normals by degrees.
        # This smoothing moves the profiles by about 0.01 mm; on the pad slopes are accurate to 0.25 degrees.
        spline = make_smoothing_spline(s, value / s, w=s**2, lam=5e-7)
        return spline, spline.derivative(), s[0], s[-1]

    def over_s(self, s: ArrayLike) -> tuple[FloatArray, FloatArray]:
        """g(s) and its derivative; the profile itself is s g(s) [mm]."""
        spline, slope, first, last = self._spline
        s = np.asarray(s, dtype=np.float64)
        inside = np.clip(s, first, last)
        return spline(inside) + slope(inside) * (s - inside), slope(inside)

    def at(self, x_mm: ArrayLike) -> FloatArray:
        s = np.sqrt(np.maximum(1.0 - float_array("x_mm", x_mm, None) / self.length_mm, 0.0))
        return s * self.over_s(s)[0]


@checked_class
class Finger(ABC):
    """What can be pressed: a `Fingertip` by its outline, or a `FingerMesh` by its mesh."""

    @property
    @abstractmethod
    def contact_mm(self) -> tuple[float, float]:
        """X and z of the middle of the pad, where an indenter presses by default [mm]."""

    @property
    @abstractmethod
    def relative_size(self) -> float:
        """Size over that of the paper's finger, for the size of elements that are made."""

    @property
    @abstractmethod
    def layer_depths_mm(self) -> tuple[float, float, float]:
        """Depth of the lower border of stratum corneum, living epidermis and dermis [mm]."""

    @abstractmethod
    def skin_point(self, x_mm: ArrayLike, z_mm: ArrayLike) -> FloatArray:
        """Point of the volar skin at each (x, z), (..., 3); InputError beside the finger [mm]."""

    @abstractmethod
    def skin_normal(self, points_mm: ArrayLike) -> FloatArray:
        """Outward unit normal of the skin at its points, (..., 3)."""

    @abstractmethod
    def depth_available_mm(self, x_mm: ArrayLike, z_mm: ArrayLike) -> FloatArray:
        """Distance along y from the volar skin at (x, z) to the bone or, beside it, the dorsal skin [mm]."""

    @property
    def own_mesh(self) -> Mesh | None:
        """Mesh that a finger has already; None for a finger that is meshed."""
        return None

    def own_grading(self, x_mm: Finite, z_mm: Finite) -> Grading | None:
        """Sizes of the elements that a finger has already, about a place of its skin."""
        return None


@value_class
class Fingertip(Displayed, Finger):
    """Outline, layers, bone and nail of a fingertip.

    Parameters
    ----------
    length_mm : float
        x of the tip, L. [mm]
    volar_readings_mm, dorsal_readings_mm, half_width_readings_mm : tuple of (x, value)
        Volar depth, dorsal height and half-width of the skin, all positive. [mm]
    stratum_corneum_mm, living_epidermis_mm, dermis_mm : float
        Layer thicknesses along the skin's normal; the subcutis fills the rest down to the bone. [mm]
    spine_y_mm, spine_end_x_mm : float
        Height and distal end of the bone's straight axis. [mm]
    bone_height_mm, bone_width_mm, bone_tip_x_mm : float
        Semi-axes of the bone along y and z, and x of its tip: a tube closed by half an ellipsoid. [mm]
    nail_x_mm : (float, float)
        Proximal and distal end of the nail. [mm]
    nail_half_width_mm : float
        Extent of the nail to either side. [mm]

    Examples
    --------
    >>> finger = Fingertip()
    >>> volar, dorsal, half_width = finger.section(17.37)
    >>> print(f"{volar:.2f} {half_width:.2f}")
    9.85 9.75
    """

    length_mm: ExtentMm = published.LENGTH.value
    volar_readings_mm: Pairs = _readings(published.STATIONS_X, published.VOLAR_Y)
    dorsal_readings_mm: Pairs = _readings(published.STATIONS_X, published.DORSAL_Y)
    half_width_readings_mm: Pairs = _readings(published.HALF_WIDTH_X, published.HALF_WIDTH_Z)
    stratum_corneum_mm: Positive = published.STRATUM_CORNEUM.value
    living_epidermis_mm: Positive = published.LIVING_EPIDERMIS.value
    dermis_mm: Positive = published.DERMIS.value
    spine_y_mm: Finite = published.SPINE_Y.value
    spine_end_x_mm: Positive = published.SPINE_END_X.value
    bone_height_mm: Positive = published.BONE_HEIGHT.value
    bone_width_mm: Positive = published.BONE_WIDTH.value
    bone_tip_x_mm: Finite = published.BONE_TIP_X.value
    nail_x_mm: Numbers = published.NAIL_X.value
    nail_half_width_mm: Positive = published.NAIL_HALF_WIDTH.value

    def __new__(cls, *given: object, **_: object) -> Fingertip:
        """Refuse the name of a preset, which is that of `of`."""
        if given and isinstance(given[0], str):
            raise InputError(f"Fingertip takes measures: got {given[0]!r}, write Fingertip.of({given[0]!r}).")
        return super().__new__(cls)

    def __post_init__(self) -> None:
        if self.spine_y_mm >= 0.0:
            raise InputError("spine_y_mm", "must lie below 0, the widest height", repr(self.spine_y_mm))
        if len(self.nail_x_mm) != 2 or not self.nail_x_mm[0] < self.nail_x_mm[1]:
            raise InputError("nail_x_mm", "must be two increasing numbers", str(self.nail_x_mm))
        if not self.spine_end_x_mm < self.bone_tip_x_mm < self.length_mm:
            raise InputError(
                "spine_end_x_mm, bone_tip_x_mm and length_mm must increase: "
                f"got {self.spine_end_x_mm}, {self.bone_tip_x_mm} and {self.length_mm}."
            )
        self._check_that_the_bone_fits()

    def __repr__(self) -> str:
        volar, dorsal, half_width = (float(size) for size in self.section(self.contact_mm[0]))
        return (
            f"Fingertip({self.length_mm:.3g} mm long, {2.0 * half_width:.3g} mm wide and "
            f"{volar + dorsal:.3g} mm high where it is pressed, skin {self.layer_depths_mm[-1]:.3g} mm thick)"
        )

    def _check_that_the_bone_fits(self) -> None:
        x = np.linspace(0.0, self.spine_end_x_mm, 41)
        volar, dorsal, _ = self.section(x)
        layers = self.layer_depths_mm[-1]
        room = np.minimum(
            volar + self.spine_y_mm - self.bone_height_mm, dorsal - self.spine_y_mm - self.bone_height_mm
        )
        if room.min() <= layers:
            raise InputError(
                f"Bone and skin layers of {layers:.3f} mm must fit into the outline: "
                f"only {room.min():.3f} mm are left at x = {x[room.argmin()]:.1f} mm."
            )
        angle = np.linspace(0.0, 2.0 * np.pi, 73)
        y = self.spine_y_mm + (self.bone_height_mm + layers) * np.sin(angle)
        z = (self.bone_width_mm + layers) * np.cos(angle)
        around = np.stack(np.broadcast_arrays(x[:, None], y, z), axis=-1)
        if (self.level(around) >= 0.0).any():
            raise InputError(
                f"Bone and skin layers of {layers:.3f} mm must fit into the outline: a bone with half axes "
                f"of {self.bone_width_mm:g} mm across and {self.bone_height_mm:g} mm in height does not."
            )

    @classmethod
    @checked
    def of(
        cls,
        like: Annotated[str, choice(FINGERS)] = "adult",
        length_mm: ExtentMm | None = None,
        width_mm: ExtentMm | None = None,
        height_mm: ExtentMm | None = None,
        stratum_corneum_mm: Finite | None = None,
        living_epidermis_mm: Finite | None = None,
        dermis_mm: Finite | None = None,
    ) -> Fingertip:
        """Fingertip by what a ruler and a calliper measure.

        Outline, bone and nail are stretched along, across and in height. A measure that is not given is
        stretched by the geometric mean of those that are. Thicknesses of the layers do not follow the
        outline.

        Parameters
        ----------
        like : {"adult", "small", "large", "child", "macaque", "aged"}, optional
            Preset from which everything comes that is not given, see `FINGERS`.
        length_mm : float, optional
            From the crease of the last joint to the tip. [mm]
        width_mm, height_mm : float, optional
            Largest width from side to side and largest height from pad to back, from that crease on. [mm]
        stratum_corneum_mm, living_epidermis_mm, dermis_mm : float, optional
            Thicknesses of the layers. [mm]

        Examples
        --------
        >>> narrow = Fingertip.of(length_mm=22.0, width_mm=16.0)
        >>> [round(size, 1) for size in narrow.measures_mm]
        [22.0, 16.0, 13.7]
        >>> Fingertip.of() == Fingertip()
        True
        """
        preset = FINGERS[like]()
        sizes = zip((length_mm, width_mm, height_mm), preset.measures_mm, strict=True)
        factors = [None if size is None else size / own for size, own in sizes]
        known = [factor for factor in factors if factor is not None]
        mean = float(np.prod(known) ** (1.0 / len(known))) if known else 1.0
        layers = {
            "stratum_corneum_mm": stratum_corneum_mm,
            "living_epidermis_mm": living_epidermis_mm,
            "dermis_mm": dermis_mm,
        }
        return preset._stretched(
            *(mean if factor is None else factor for factor in factors),
            **{name: size for name, size in layers.items() if size is not None},
        )

    def scaled(self, factor: Positive) -> Fingertip:
        """Return the same finger in another size: outline, layers, bone and nail times a factor.

        Examples
        --------
        >>> Fingertip().scaled(0.5).dermis_mm
        0.5765
        """
        k = factor
        layers = ("stratum_corneum_mm", "living_epidermis_mm", "dermis_mm")
        return self._stretched(k, k, k, **{name: k * getattr(self, name) for name in layers})

    def _stretched(self, along: float, across: float, up: float, **layers: float) -> Fingertip:
        """Return the finger with outline, bone and nail stretched each way, and other layers."""

        def readings(table: Pairs, by: float) -> Pairs:
            return tuple((along * x, by * value) for x, value in table)

        return replace(
            self,
            length_mm=along * self.length_mm,
            volar_readings_mm=readings(self.volar_readings_mm, up),
            dorsal_readings_mm=readings(self.dorsal_readings_mm, up),
            half_width_readings_mm=readings(self.half_width_readings_mm, across),
            spine_y_mm=up * self.spine_y_mm,
            spine_end_x_mm=along * self.spine_end_x_mm,
            bone_height_mm=up * self.bone_height_mm,
            bone_width_mm=across * self.bone_width_mm,
            bone_tip_x_mm=along * self.bone_tip_x_mm,
            nail_x_mm=tuple(along * x for x in self.nail_x_mm),
            nail_half_width_mm=across * self.nail_half_width_mm,
            **layers,
        )

    @cached_property
    def measures_mm(self) -> tuple[float, float, float]:
        """Length, width and height as of `Fingertip.of` [mm]."""
        share = fingers.CREASE_TO_TIP.value / published.LENGTH.value
        x_mm = np.linspace((1.0 - share) * self.length_mm, self.length_mm, 401)
        volar, dorsal, half_width = self.section(x_mm)
        return (
            fingers.CREASE_TO_TIP.value * (self.length_mm / published.LENGTH.value),
            2.0 * float(half_width.max()),
            float((volar + dorsal).max()),
        )

    @cached_property
    def relative_size(self) -> float:
        """Geometric mean of length, width and height over those of the paper's finger."""
        own, of_paper = self.measures_mm, _paper().measures_mm
        return float(np.prod([size / other for size, other in zip(own, of_paper, strict=True)])) ** (1 / 3)

    @property
    def contact_mm(self) -> tuple[float, float]:
        # On the paper's finger it is the point that the laboratory indented.
        return published.CONTACT_POINT.value[0] * (self.length_mm / published.LENGTH.value), 0.0

    @cached_property
    def profiles(self) -> tuple[Profile, Profile, Profile]:
        """Volar depth, dorsal height and half-width as functions of x."""
        readings = self.volar_readings_mm, self.dorsal_readings_mm, self.half_width_readings_mm
        volar, dorsal, half_width = (Profile(table, self.length_mm) for table in readings)
        return volar, dorsal, half_width

    @property
    def layer_depths_mm(self) -> tuple[float, float, float]:
        epidermis = self.stratum_corneum_mm + self.living_epidermis_mm
        return self.stratum_corneum_mm, epidermis, epidermis + self.dermis_mm

    def section(self, x_mm: ArrayLike) -> tuple[FloatArray, FloatArray, FloatArray]:
        """Volar depth, dorsal height and half-width of the cross-section at `x_mm` [mm]."""
        volar, dorsal, half_width = self.profiles
        return volar.at(x_mm), dorsal.at(x_mm), half_width.at(x_mm)

    def level(self, points_mm: ArrayLike) -> FloatArray:
        """Below 0 inside the skin, 0 on it, above 0 outside: (y / g_y)² + (z / g_z)² - s².

        Here s² = 1 - x / L; g is a / s (volar) or b / s (dorsal) for y and c / s for z, the profiles
        without their factor s.
        """
        return self._level_and_gradient(_points(points_mm))[0]

    def level_gradient(self, points_mm: ArrayLike) -> FloatArray:
        """Analytic gradient of `level`, (..., 3), pointing out of the finger [1/mm]."""
        return self._level_and_gradient(_points(points_mm))[1]

    def _level_and_gradient(self, points: FloatArray) -> tuple[FloatArray, FloatArray]:
        x, y, z = points[..., 0], points[..., 1], points[..., 2]
        s_squared = 1.0 - x / self.length_mm
        s = np.sqrt(np.maximum(s_squared, 0.0))
        volar, dorsal, half_width = (profile.over_s(s) for profile in self.profiles)
        g_y = np.where(y < 0.0, volar[0], dorsal[0])
        slope_y = np.where(y < 0.0, volar[1], dorsal[1])
        g_z, slope_z = half_width
        level = (y / g_y) ** 2 + (z / g_z) ** 2 - s_squared
        by_s = -2.0 * (y**2 * slope_y / g_y**3 + z**2 * slope_z / g_z**3)
        # ds/dx = -1 / (2 L s) is infinite at the tip, where y and z vanish like s and so does by_s ds/dx.
        s_by_x = np.where(s > 0.0, -0.5 / (self.length_mm * np.maximum(s, 1e-9)), 0.0)
        gradient = np.stack(
            [by_s * s_by_x + 1.0 / self.length_mm, 2.0 * y / g_y**2, 2.0 * z / g_z**2], axis=-1
        )
        return level, gradient

    def skin_normal(self, points_mm: ArrayLike) -> FloatArray:
        gradient = self.level_gradient(points_mm)
        return gradient / np.linalg.norm(gradient, axis=-1, keepdims=True)

    def skin_point(self, x_mm: ArrayLike, z_mm: ArrayLike) -> FloatArray:
        """Points (..., 3) of the volar skin at each (x, z). [mm]

        Examples
        --------
        >>> Fingertip().skin_point(17.37, 0.0).round(1).tolist()
        [17.4, -9.8, 0.0]
        """
        x, z = np.broadcast_arrays(float_array("x_mm", x_mm, None), float_array("z_mm", z_mm, None))
        volar, _, half_width = self.section(x)
        outside = ~((x >= 0.0) & (x <= self.length_mm) & (np.abs(z) <= half_width))
        if outside.any():
            raise InputError(
                "position",
                f"must lie on the finger, x within 0 ... {self.length_mm} mm and |z| within its half-width",
                f"x = {x[outside].flat[0]:.6g}, z = {z[outside].flat[0]:.6g} mm",
            )
        # At the very tip width and depth are 0 together; the quotient is then taken as 0.
        share = z / np.where(half_width > 0.0, half_width, 1.0)
        return np.stack([x, -volar * np.sqrt(1.0 - share**2), z], axis=-1)

    def subsurface(self, skin_points_mm: ArrayLike, depth_mm: NotNegative) -> FloatArray:
        """Points `depth_mm` below points of the skin, along the inward normal, (..., 3) [mm]."""
        points = _points(skin_points_mm)
        return points - depth_mm * self.skin_normal(points)

    def depth_available_mm(self, x_mm: ArrayLike, z_mm: ArrayLike) -> FloatArray:
        """Distance along y from the volar skin at (x, z) to the bone or, beside it, the dorsal skin [mm].

        Examples
        --------
        >>> float(Fingertip().depth_available_mm(17.37, 0.0).round(1))
        5.5
        """
        x, y, z = np.moveaxis(self.skin_point(x_mm, z_mm), -1, 0)
        volar, dorsal, _ = self.section(x)
        past = np.maximum(x - self.spine_end_x_mm, 0.0) / (self.bone_tip_x_mm - self.spine_end_x_mm)
        square = 1.0 - past**2 - (z / self.bone_width_mm) ** 2
        bone_y = self.spine_y_mm - self.bone_height_mm * np.sqrt(np.maximum(square, 0.0))
        through = -y * dorsal / np.where(volar > 0.0, volar, 1.0) - y
        return np.where(square > 0.0, bone_y - y, through)

    def skin_distance_mm(self, origins_mm: FloatArray, directions: FloatArray) -> FloatArray:
        """Distance (...) from points inside to the skin along unit directions, by Newton's method. [mm]"""
        if (self.level(origins_mm) >= 0.0).any():
            raise InputError("Every origin of a ray must lie inside the skin: at least one does not.")
        near = np.zeros(directions.shape[:-1])
        far = np.full_like(near, 2.0 * self.length_mm)
        distance = np.full_like(near, 0.25 * self.length_mm)
        for _ in range(60):
            level, gradient = self._level_and_gradient(origins_mm + distance[..., None] * directions)
            near = np.where(level < 0.0, distance, near)
            far = np.where(level < 0.0, far, distance)
            slope = (gradient * directions).sum(axis=-1)
            newton = distance - level / np.where(slope > 0.0, slope, 1.0)
            safe = (slope > 0.0) & (newton >= near) & (newton <= far)
            step = np.where(safe, newton, 0.5 * (near + far)) - distance
            distance = distance + step
            if np.abs(step).max(initial=0.0) < 1e-13 * self.length_mm:
                break
        return distance

    def bone_distance_mm(self, origins_mm: FloatArray, directions: FloatArray) -> FloatArray:
        """Distance (...) from the bone's axis to its surface along unit directions, closed form. [mm]

        Rays are at right angles to the axis, or leave its end in any distal direction.
        """
        cap_mm = self.bone_tip_x_mm - self.spine_end_x_mm
        length = np.where(origins_mm[..., 0] < self.spine_end_x_mm, np.inf, cap_mm)
        along, up, across = np.moveaxis(directions, -1, 0)
        height, width = self.bone_height_mm, self.bone_width_mm
        return 1.0 / np.sqrt((along / length) ** 2 + (up / height) ** 2 + (across / width) ** 2)

    def is_under_nail(self, skin_points_mm: ArrayLike) -> np.ndarray:
        """Whether points of the skin lie in the footprint of the nail, bool (...)."""
        x, y, z = np.moveaxis(_points(skin_points_mm), -1, 0)
        proximal, distal = self.nail_x_mm
        return (y > 0.0) & (x >= proximal) & (x <= distal) & (np.abs(z) <= self.nail_half_width_mm)


def _points(points_mm: ArrayLike) -> FloatArray:
    """Points (..., 3). [mm]"""
    points = float_array("points_mm", points_mm, None)
    if points.shape[-1:] != (3,):
        raise InputError("points_mm", "must have x, y and z", f"shape {points.shape}")
    return points


@cache
def _paper() -> Fingertip:
    return Fingertip()


def _aged() -> Fingertip:
    finger, decades = _paper(), fingers.AGED_DECADES.value
    return replace(
        finger,
        living_epidermis_mm=finger.living_epidermis_mm * (1.0 - decades * fingers.EPIDERMIS_LOSS.value),
        dermis_mm=finger.dermis_mm * (1.0 - decades * fingers.DERMIS_LOSS.value),
    )


FINGERS: Mapping[str, Callable[[], Fingertip]] = MappingProxyType(
    {
        "adult": _paper,
        "small": lambda: Fingertip.of(width_mm=fingers.SMALL_WIDTH.value),
        "large": lambda: Fingertip.of(width_mm=fingers.LARGE_WIDTH.value),
        "child": lambda: Fingertip.of(width_mm=fingers.CHILD_WIDTH.value),
        "macaque": lambda: _paper().scaled(fingers.MACAQUE_WIDTH.value / _paper().measures_mm[1]),
        "aged": _aged,
    }
)
"""Fingertips by name (docs/finger.md): the paper's adult; people's with its layers, stretched to a width; a
macaque's, scaled with its layers; and the adult's with the thinner skin of old age."""
