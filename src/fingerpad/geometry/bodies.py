"""Bodies that are pressed in: round ones, flat ones with walls, cones, and those that `composed` makes.

This module is `fp.bodies`. Files, tables and the command line know the classes that have a name there,
such as `in_files = "sphere"`.
"""

from __future__ import annotations

from abc import abstractmethod
from collections.abc import Sequence
from dataclasses import field, fields, replace
from typing import Annotated, Any

import numpy as np

from fingerpad.core.checked import checked, checked_class, other_name, other_names, value_class
from fingerpad.core.errors import InputError
from fingerpad.core.units import curvature_per_m, radius_mm
from fingerpad.core.values import (
    Finite,
    FloatArray,
    NotNegative,
    PointsMm,
    Positive,
    SizeMm,
    float_array,
    limits,
    positive,
)
from fingerpad.data import protocol
from fingerpad.geometry.composed import (
    Difference,
    Dots,
    Extruded,
    Intersection,
    Offset,
    Pattern,
    Revolved,
    Transformed,
    Union,
    braille,
)
from fingerpad.geometry.indenters import (
    ACROSS,
    ALONG,
    UP,
    Gapped,
    Indenter,
    ball,
    check_most,
    corner,
    deeper,
    from_axis,
    round_front,
    rounded,
)

__all__ = [
    "Bar", "Box", "Capsule", "Cone", "Cylinder", "Difference", "Dots", "Edge", "Extruded", "FlatPunch", "Gap",
    "Grating", "Indenter", "Intersection", "Line", "Offset", "Pattern", "Plate", "Revolved", "Sphere",
    "Torus", "Transformed", "Union", "braille", "ridges",
]  # fmt: skip

SIZES_MM = (0.01, 400.0)
"""Smallest and largest width or diameter of a body that is pressed into a fingertip. [mm]"""


def _of_diameter(radius_mm: float) -> dict[str, float]:
    return {"diameter_mm": 2 * positive("radius_mm", radius_mm, "mm")}


def _half_diameter(body: Any) -> float:
    return float(body.diameter_mm / 2)


def _of_radius(radius_mm: float) -> dict[str, float]:
    return {"curvature_per_m": curvature_per_m(positive("radius_mm", radius_mm, "mm"))}


def _of_two_radii(diameter_mm: float) -> dict[str, float]:
    return {"curvature_per_m": curvature_per_m(positive("diameter_mm", diameter_mm, "mm") / 2)}


def _of_period(period_mm: float = 2 * protocol.RIDGE_WIDTH.value, duty: float = 0.5) -> dict[str, float]:
    if positive("duty", duty) >= 1.0:
        raise InputError("duty", "must be below 1, the share of a ridge in the period", repr(duty))
    ridge = positive("period_mm", period_mm, "mm") * duty
    return {"ridge_mm": ridge, "groove_mm": period_mm - ridge}


def _beside(distance: FloatArray, width: float, axis: FloatArray = ALONG) -> Gapped:
    """Distance beyond the walls of a ridge, from that to its middle plane, and the direction out of it."""
    return np.abs(distance) - width / 2, np.where(distance < 0.0, -1.0, 1.0)[:, None] * axis


@checked_class
class Round(Indenter):
    """All points within a radius of a point, line or ring that lies below the face.

    Below its widest section such a body goes on with straight sides: skin that has passed the widest section
    is then held beside it, and the normal is the gradient of the gap everywhere.
    """

    radius_mm: float

    @abstractmethod
    def _from_middle(self, points: FloatArray) -> FloatArray:
        """Offsets (n, 3) from the point, line or ring, if that is at y = 0."""

    def front(self, points_mm: PointsMm) -> FloatArray:
        beside = self._from_middle(points_mm)
        return round_front(np.hypot(beside[:, 0], beside[:, 2]), self.radius_mm)

    def gap(self, points_mm: PointsMm) -> tuple[FloatArray, FloatArray]:
        return self.closed_gap(np.maximum(points_mm, [-np.inf, -self.radius_mm, -np.inf]))

    def closed_gap(self, points_mm: PointsMm) -> tuple[FloatArray, FloatArray]:
        return ball(self._from_middle(points_mm + self.radius_mm * UP), self.radius_mm)


@checked_class
class Walled(Indenter):
    """A flat face that ends in walls, the edge between them rounded."""

    fillet_mm: float

    @abstractmethod
    def _wall(self, points: FloatArray) -> Gapped:
        """Distance beyond the nearest wall, seen along y, and the unit vector (n, 3) out of it."""

    def front(self, points_mm: PointsMm) -> FloatArray:
        return round_front(self._wall(points_mm)[0] + self.fillet_mm, self.fillet_mm)

    def gap(self, points_mm: PointsMm) -> tuple[FloatArray, FloatArray]:
        beyond, outward = self._wall(points_mm)
        return rounded(beyond + self.fillet_mm, points_mm[:, 1] + self.fillet_mm, outward, self.fillet_mm)


@value_class
class Sphere(Round):
    """Sphere given by its curvature, as in the psychophysics literature, or by its radius; by name only.

    Examples
    --------
    >>> round(Sphere(curvature_per_m=287).radius_mm, 3), Sphere(radius_mm=2.0)
    (3.484, Sphere(radius_mm=2.0))
    """

    in_files = "sphere"
    symmetry_deg = None
    # A bare number could be either: 3.5 mm of radius is 286 1/m.
    curvature_per_m: Finite = field(default=protocol.STANDARD_CURVATURE.value, kw_only=True)
    """1/radius; the paper writes "RC ... 1/m" and means this. [1/m]"""
    radius_mm: float = other_name(
        _of_radius, lambda body: radius_mm(body.curvature_per_m), default=None, kw_only=True
    )
    """Instead of the curvature. [mm]"""
    diameter_mm: float = other_name(
        _of_two_radii, lambda body: 2 * body.radius_mm, default=None, kw_only=True
    )
    """Instead of the curvature. [mm]"""

    def __post_init__(self) -> None:
        radius = radius_mm(positive("curvature_per_m", self.curvature_per_m, "1/m"))
        if not SIZES_MM[0] <= 2.0 * radius <= SIZES_MM[1]:
            raise InputError(
                f"A sphere of {self.curvature_per_m:g} 1/m has a radius of {radius:.3g} mm, outside "
                f"{SIZES_MM[0] / 2:g} to {SIZES_MM[1] / 2:g} mm: write radius_mm if you meant a radius."
            )

    def __repr__(self) -> str:
        # By curvature or by radius: one of the two is usually a short number.
        sizes = (f"curvature_per_m={self.curvature_per_m!r}", f"radius_mm={self.radius_mm!r}")
        return f"{type(self).__name__}({min(sizes, key=len)})"

    def _from_middle(self, points: FloatArray) -> FloatArray:
        return points


@value_class
class Cylinder(Round):
    """Cylinder that lies across the finger, its axis along z.

    Examples
    --------
    >>> gap, normal = Cylinder(diameter_mm=2.0).gap(np.array([[0.0, 0.5, 7.0]]))
    >>> gap.tolist(), normal.tolist()
    ([0.5], [[0.0, 1.0, 0.0]])
    """

    in_files = "cylinder"
    symmetry_deg = 90.0
    diameter_mm: SizeMm = protocol.CYLINDER_DIAMETER.value  #: Diameter; the paper's is 3.17 mm. [mm]
    radius_mm: float = other_name(_of_diameter, _half_diameter, default=None, kw_only=True)
    """Half of the diameter, instead. [mm]"""

    def _from_middle(self, points: FloatArray) -> FloatArray:
        return points * (ALONG + UP)


@value_class
class Bar(Walled):
    """Flat bar across the finger, long in z, its two edges rounded.

    Examples
    --------
    >>> gap, _ = Bar(width_mm=3.0, fillet_mm=0.3).gap(np.array([[0.0, -0.1, 0.0], [1.5, -0.3, 2.0]]))
    >>> gap.round(3).tolist()
    [-0.1, 0.0]
    """

    in_files = "bar"
    symmetry_deg = 90.0
    width_mm: SizeMm = protocol.BAR_WIDTH.value  #: Full width along x, fillets included. [mm]
    fillet_mm: NotNegative = protocol.BAR_FILLET.value  #: Radius of the two edges. [mm]
    edge_radius_mm: float = other_name("fillet_mm", default=None, kw_only=True)

    def __post_init__(self) -> None:
        check_most(self, "fillet_mm", "width_mm")

    def _wall(self, points: FloatArray) -> Gapped:
        return _beside(points[:, 0], self.width_mm)

    def rounded_to(self, radius_mm: Finite) -> Bar:
        return replace(self, fillet_mm=max(self.fillet_mm, min(radius_mm, self.width_mm / 2)))


@value_class
class Line(Indenter):
    """Line load across the finger: a wire thinner than the elements of the skin, modelled as a blade.

    Nodes cannot resolve the roundness of a body as thin as their spacing: one node would balance on its top
    and slide off. The strip of skin that lies under the undeformed wire is therefore pushed along the
    direction of pressing and does not slide along the finger (docs/decisions.md#line-load).

    Examples
    --------
    >>> Line().may_touch(np.array([[0.0, 0.3, 1.0], [0.05, 0.0, 1.0]])).tolist()
    [True, False]
    """

    in_files = "line"
    symmetry_deg = 180.0
    diameter_mm: SizeMm = protocol.LINE_DIAMETER.value  #: Diameter of the wire; the paper's is 50 µm. [mm]

    @property
    def grips(self) -> bool:
        return True

    def front(self, points_mm: PointsMm) -> FloatArray:
        return np.where(np.abs(points_mm[:, 0]) <= self.diameter_mm / 2, 0.0, -np.inf)

    def may_touch(self, undeformed_mm: PointsMm) -> np.ndarray:
        """Only the points below the undeformed wire; bool (n,)."""
        return np.abs(undeformed_mm[:, 0]) <= self.diameter_mm / 2 * (1 + 1e-6)

    def gap(self, points_mm: PointsMm) -> tuple[FloatArray, FloatArray]:
        return Plate().gap(points_mm)


@value_class
class FlatPunch(Walled):
    """Flat-ended round probe with a rounded rim.

    Examples
    --------
    >>> FlatPunch(radius_mm=1.0, edge_radius_mm=0.2)
    FlatPunch(diameter_mm=2.0, fillet_mm=0.2)
    """

    in_files = "punch"
    symmetry_deg = None
    diameter_mm: SizeMm = protocol.PUNCH_DIAMETER.value  #: Full diameter, rim included. [mm]
    fillet_mm: NotNegative = protocol.BAR_FILLET.value  #: Radius of the rim. [mm]
    edge_radius_mm: float = other_name("fillet_mm", default=None, kw_only=True)
    radius_mm: float = other_name(_of_diameter, _half_diameter, default=None, kw_only=True)
    """Half of the diameter, instead. [mm]"""

    def __post_init__(self) -> None:
        check_most(self, "fillet_mm", "diameter_mm")

    def _wall(self, points: FloatArray) -> Gapped:
        radial, outward = from_axis(points)
        return radial - self.diameter_mm / 2, outward

    def rounded_to(self, radius_mm: Finite) -> FlatPunch:
        return replace(self, fillet_mm=max(self.fillet_mm, min(radius_mm, self.diameter_mm / 2)))


@value_class
class Plate(Indenter):
    """Flat plate without edges, larger than the finger."""

    in_files = "plate"
    symmetry_deg = None

    def front(self, points_mm: PointsMm) -> FloatArray:
        return np.zeros(len(points_mm))

    def gap(self, points_mm: PointsMm) -> tuple[FloatArray, FloatArray]:
        return points_mm[:, 1].copy(), np.broadcast_to(UP, points_mm.shape).copy()


@value_class
class Edge(Walled):
    """Flat body over the proximal half of the finger that ends in one rounded edge at x = 0, long in z.

    Examples
    --------
    >>> gap, _ = Edge(fillet_mm=0.3).gap(np.array([[-5.0, 0.2, 0.0], [0.5, -1.0, 2.0]]))
    >>> gap.round(3).tolist()
    [0.2, 0.5]
    """

    in_files = "edge"
    symmetry_deg = 180.0
    fillet_mm: NotNegative = protocol.BAR_FILLET.value  #: Radius of the edge. [mm]
    edge_radius_mm: float = other_name("fillet_mm", default=None, kw_only=True)

    def _wall(self, points: FloatArray) -> Gapped:
        return points[:, 0], np.broadcast_to(ALONG, points.shape)

    def rounded_to(self, radius_mm: Finite) -> Edge:
        return replace(self, fillet_mm=max(self.fillet_mm, radius_mm))


@value_class
class Gap(Walled):
    """Flat bar across the finger with a gap along its middle: two ridges of one rigid body.

    The gap is deeper than skin can bulge. The radius of its lips is at most half of its width, so a gap of
    width 0 gives the plain bar.

    References
    ----------
    Johnson & Phillips 1981: discrimination of stimuli with and without a gap, of one overall size that is
    much larger than the gap.

    Examples
    --------
    >>> gap, _ = Gap(gap_mm=1.0).gap(np.array([[0.0, -0.5, 0.0], [2.0, -0.1, 0.0]]))
    >>> gap.round(3).tolist()
    [0.5, -0.1]
    """

    in_files = "gap"
    symmetry_deg = 90.0
    gap_mm: NotNegative = protocol.GAP_WIDTH.value  #: Width between its two walls; 0 for a plain bar. [mm]
    width_mm: SizeMm = protocol.GAPPED_BAR_WIDTH.value  #: Full width along x, gap and fillets included. [mm]
    fillet_mm: NotNegative = protocol.BAR_FILLET.value  #: Radius of the two outer edges. [mm]
    lip_mm: NotNegative = protocol.LIP_RADIUS.value
    """Radius of the two lips, if the gap is at least twice as wide; `lip_radius_mm` is another name. [mm]"""
    edge_radius_mm: float = other_name("fillet_mm", default=None, kw_only=True)
    lip_radius_mm: float = other_name(
        "lip_mm", lambda body: min(body.lip_mm, body.gap_mm / 2), default=None, kw_only=True
    )

    def __post_init__(self) -> None:
        check_most(self, "fillet_mm", "width_mm")
        most = self.width_mm - 2 * self.fillet_mm - 2 * self.lip_radius_mm
        if self.gap_mm > 0.0 and self.gap_mm >= most:
            must = f"must leave two flat ridges of the bar, so be below {most:g} mm"
            raise InputError("gap_mm", must, f"{self.gap_mm:g} mm")

    def _wall(self, points: FloatArray) -> Gapped:
        return _beside(points[:, 0], self.width_mm)

    def front(self, points_mm: PointsMm) -> FloatArray:
        face, lip = super().front(points_mm), self.lip_radius_mm
        within = lip - _beside(points_mm[:, 0], self.gap_mm)[0]
        return np.minimum(face, round_front(within, lip)) if self.gap_mm else face

    def gap(self, points_mm: PointsMm) -> tuple[FloatArray, FloatArray]:
        bar, lip = super().gap(points_mm), self.lip_radius_mm
        beyond, outward = _beside(points_mm[:, 0], self.gap_mm)
        return (
            deeper(bar, rounded(lip - beyond, points_mm[:, 1] + lip, -outward, lip)) if self.gap_mm else bar
        )


@value_class
class Grating(Walled):
    """Grating larger than the finger: flat ridges across it with grooves between them, one ridge at x = 0.

    Examples
    --------
    >>> Grating(period_mm=2.0, duty=0.25, edge_radius_mm=0.1)
    Grating(ridge_mm=0.5, groove_mm=1.5, lip_mm=0.1)
    >>> gap, _ = Grating(ridge_mm=1.0, groove_mm=1.0).gap(np.array([[2.0, 0.3, 0.0], [1.0, -0.5, 0.0]]))
    >>> gap.round(3).tolist()
    [0.3, 0.5]
    """

    in_files = "grating"
    symmetry_deg = 90.0
    ridge_mm: SizeMm = protocol.RIDGE_WIDTH.value  #: Width of a ridge, lips included. [mm]
    groove_mm: SizeMm = protocol.RIDGE_WIDTH.value
    """Width of a groove between its walls; grooves are deeper than skin can bulge. [mm]"""
    lip_mm: NotNegative = protocol.LIP_RADIUS.value  #: Radius of the lips, at most half of a ridge. [mm]
    edge_radius_mm: float = other_name("lip_mm", default=None, kw_only=True)
    period_mm: float = other_name(
        _of_period, lambda body: body.ridge_mm + body.groove_mm, default=None, kw_only=True
    )
    """Instead of both widths: from one ridge to the next. [mm]"""
    duty: float = other_name(
        _of_period, lambda body: body.ridge_mm / body.period_mm, default=None, kw_only=True
    )
    """With the period: the share of the ridge in it, by default a half."""
    fillet_mm = property(lambda self: self.lip_mm)

    def __post_init__(self) -> None:
        check_most(self, "lip_mm", "ridge_mm")

    def _wall(self, points: FloatArray) -> Gapped:
        ridge = self.period_mm * np.round(points[:, 0] / self.period_mm)
        return _beside(points[:, 0] - ridge, self.ridge_mm)

    def rounded_to(self, radius_mm: Finite) -> Grating:
        return replace(self, lip_mm=max(self.lip_mm, min(radius_mm, self.ridge_mm / 2)))


@value_class
class Box(Walled):
    """Block with rounded edges and corners. Its walls go on below its lower end where it is not closed.

    Examples
    --------
    >>> block = Box(width_mm=2.0, length_mm=4.0, fillet_mm=0.0)
    >>> block.gap(np.array([[0.0, 0.3, 0.0], [4.0, -1.0, 6.0], [0.0, -13.0, 0.0]]))[0].tolist()
    [0.3, 5.0, -1.0]
    >>> block.closed_gap(np.array([[0.0, -13.0, 0.0]]))[0].tolist()
    [3.0]
    """

    in_files = "box"
    symmetry_deg = 90.0
    width_mm: SizeMm = protocol.BAR_WIDTH.value  #: Full width along the finger, fillets included. [mm]
    length_mm: SizeMm = 6.0  #: Full length across the finger. [mm]
    fillet_mm: NotNegative = protocol.BAR_FILLET.value  #: Radius of edges and corners. [mm]
    height_mm: SizeMm = 10.0  #: Height of the closed block. [mm]
    edge_radius_mm: float = other_name("fillet_mm", default=None, kw_only=True)

    def __post_init__(self) -> None:
        for size in ("width_mm", "length_mm", "height_mm"):
            check_most(self, "fillet_mm", size)

    def _wall(self, points: FloatArray) -> Gapped:
        core = np.array([self.width_mm, self.length_mm]) - 2 * self.fillet_mm
        beyond, outward = corner(_beside(points[:, 0], core[0]), _beside(points[:, 2], core[1], ACROSS))
        return beyond - self.fillet_mm, outward

    def closed_gap(self, points_mm: PointsMm) -> tuple[FloatArray, FloatArray]:
        # Its lower half is the mirror image of the upper one.
        up = points_mm[:, 1:2] + self.height_mm / 2
        gap, normal = self.gap(points_mm + (np.abs(up) - up) * UP)
        return gap, np.where((up < 0.0) & (UP > 0.0), -normal, normal)


@value_class
class Capsule(Round):
    """Rod that lies across the finger, its ends round.

    Examples
    --------
    >>> rod = Capsule(diameter_mm=2.0, length_mm=6.0)
    >>> rod.gap(np.array([[0.0, -1.0, 4.0], [2.0, -1.0, 1.0]]))[0].tolist()
    [1.0, 1.0]
    """

    in_files = "capsule"
    symmetry_deg = 90.0
    diameter_mm: SizeMm = protocol.CYLINDER_DIAMETER.value  #: Diameter of the rod and of its ends. [mm]
    length_mm: SizeMm = 10.0  #: Full length, ends included. [mm]
    radius_mm: float = other_name(_of_diameter, _half_diameter, default=None, kw_only=True)
    """Half of the diameter, instead. [mm]"""

    def __post_init__(self) -> None:
        check_most(self, "diameter_mm", "length_mm", share=1.0)

    def _from_middle(self, points: FloatArray) -> FloatArray:
        half = (self.length_mm - self.diameter_mm) / 2
        return points - np.clip(points[:, 2:], -half, half) * ACROSS


@value_class
class Torus(Round):
    """Ring of a round wire that lies on the skin.

    Examples
    --------
    >>> ring = Torus(ring_mm=6.0, diameter_mm=1.0)
    >>> ring.front(np.array([[3.0, 0.0, 0.0], [0.0, 0.0, 0.0]])).tolist()
    [0.0, -inf]
    """

    in_files = "torus"
    symmetry_deg = None
    ring_mm: SizeMm = 6.0  #: Diameter of the circle along the middle of the wire. [mm]
    diameter_mm: SizeMm = 1.0  #: Diameter of the wire. [mm]
    radius_mm: float = other_name(_of_diameter, _half_diameter, default=None, kw_only=True)
    """Half of the diameter, instead. [mm]"""

    def __post_init__(self) -> None:
        check_most(self, "diameter_mm", "ring_mm", share=1.0)

    def _from_middle(self, points: FloatArray) -> FloatArray:
        return points - self.ring_mm / 2 * from_axis(points)[1]


@value_class
class Cone(Indenter):
    """Cone with its tip towards the skin, the tip rounded; endless below.

    Examples
    --------
    >>> needle = Cone(angle_deg=60.0, radius_mm=0.0)
    >>> needle.gap(np.array([[0.0, 1.0, 0.0], [1.0, 0.0, 0.0], [0.0, -1.0, 0.0]]))[0].round(3).tolist()
    [1.0, 0.866, -0.5]
    """

    in_files = "cone"
    symmetry_deg = None
    angle_deg: Annotated[float, limits(1.0, 179.0)] = 90.0  #: Angle between opposite flanks. [degrees]
    radius_mm: NotNegative = 0.5  #: Radius of the ball at the tip; 0 for a sharp one. [mm]

    def gap(self, points_mm: PointsMm) -> tuple[FloatArray, FloatArray]:
        radial, outward = from_axis(points_mm)
        y = points_mm[:, 1] + self.radius_mm
        from_y = np.minimum(np.arctan2(radial, y), np.radians(90.0 - self.angle_deg / 2))
        beside, up = np.sin(from_y), np.cos(from_y)
        return radial * beside + y * up - self.radius_mm, beside[:, None] * outward + up[:, None] * UP


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


INDENTERS: dict[str, type[Indenter]] = {
    vars(kind)["in_files"]: kind
    for kind in (*vars().values(),)
    if isinstance(kind, type) and "in_files" in vars(kind)
}
"""Bodies by their names in files."""


def sizes_of(indenter: str) -> tuple[str, ...]:
    """Sizes that an indenter has: fields of its class, then other names."""
    kind: Any = INDENTERS[indenter]
    return tuple(dict.fromkeys([*(size.name for size in fields(kind)), *other_names(kind)]))


SIZES = tuple(dict.fromkeys(size for name in INDENTERS for size in sizes_of(name)))
"""Sizes of all indenters, other names of sizes included."""
