"""Rigid indenters as signed gaps: distance of a point of the skin from the body, and the normal there.

Every indenter has its own frame: its face touches y = 0, y is the direction of pressing (into the skin), x
runs along the finger and z across it, unless the indentation turns the body. The body fills y < 0 below its
face. `gap` is positive outside the body and negative inside; the normal points out of the body and is the
direction of the contact force without friction. Edge, bar with a gap and grating are in
`fingerpad.geometry.edged_indenters`.
"""

from __future__ import annotations

from abc import ABC, abstractmethod
from dataclasses import field, fields, is_dataclass, replace
from typing import TYPE_CHECKING, ClassVar

import numpy as np

from fingerpad.core.checked import OtherName, checked_class, value_class
from fingerpad.core.errors import InputError
from fingerpad.core.units import curvature_per_m, radius_mm
from fingerpad.core.values import Finite, FloatArray, NotNegative, PointsMm, SizeMm, positive
from fingerpad.data import protocol
from fingerpad.geometry.probing import mirrored, traced_front

SIZES_MM = (0.01, 400.0)
"""Smallest and largest width or diameter of a body that is pressed into a fingertip. [mm]"""

BESIDE_EDGE_MM = 0.4  # Distance from the wall of an edge within which the skin bends sharply. [mm]


@checked_class
class Indenter(ABC):
    """A rigid body with a signed gap; derive from it to define a body of your own.

    Only `gap` has to be written. Make the class a frozen dataclass, so that its sizes are fields: they are
    compared and part of the key of a stored press. Fields may be arrays; write
    `@dataclass(frozen=True, eq=False)` then, and bodies are compared by their content. Give the class
    `store_key = "wedge 1"`, and another text whenever its code changes: without one, every run computes its
    presses again.

    Whether half a finger is enough is found from `gap`. A class that declares `symmetry_deg` is trusted.

    Examples
    --------
    A wedge with an angle of 90 degrees, its ridge along z, rounded with a radius of 0.5 mm:

    >>> from dataclasses import dataclass
    >>> @dataclass(frozen=True)
    ... class Wedge(Indenter):
    ...     radius_mm: float = 0.5
    ...
    ...     def gap(self, points_mm):
    ...         beside, below = points_mm[:, 0], points_mm[:, 1] + self.radius_mm
    ...         angle = np.clip(np.arctan2(beside, below), -np.pi / 4, np.pi / 4)
    ...         normal = np.column_stack([np.sin(angle), np.cos(angle), np.zeros(len(angle))])
    ...         length = beside * normal[:, 0] + below * normal[:, 1]
    ...         return length - self.radius_mm, normal
    >>> wedge = Wedge()
    >>> wedge.front(np.array([[0.0, 0.0, 0.0], [1.0, 0.0, 2.0]])).round(3).tolist()
    [0.0, -0.793]
    >>> wedge.mirrors(0.0), wedge.mirrors(30.0)
    (True, False)
    """

    symmetry_deg: ClassVar[float | None] = 180.0
    """Turn about y after which the body is again symmetric across z = 0; None if it always is. [degrees]"""

    def __eq__(self, other: object) -> bool:
        """Whether both are of one class with equal fields, arrays too."""
        return type(self) is type(other) and _content(self) == _content(other)

    def __hash__(self) -> int:
        return hash((type(self), _content(self)))

    @abstractmethod
    def gap(self, points_mm: PointsMm) -> tuple[FloatArray, FloatArray]:
        """Signed gap (n,) and outward unit normal (n, 3) at points (n, 3) of the indenter's frame. [mm]

        The gap is positive outside the body and negative inside. Near the face it is the distance; the
        normal is its gradient. Far away it may be less than the distance, with the same sign.
        """

    def front(self, points_mm: PointsMm) -> FloatArray:
        """Y of the body's face towards the skin above the x and z of points (n, 3), -inf beside it. [mm]

        By default it is found from `gap`.
        """
        return traced_front(self.gap, points_mm)

    @property
    def half_width_mm(self) -> float:
        """Half of the body's extent along x where it can touch; infinite by default. [mm]

        The mesh is fine over this width and 1 mm beyond, at most over 5 mm to either side.
        """
        return np.inf

    def may_touch(self, undeformed_mm: PointsMm) -> np.ndarray:
        """Whether each undeformed point (n, 3) can come into contact; bool (n,)."""
        return np.ones(len(undeformed_mm), dtype=bool)

    @property
    def grips(self) -> bool:
        """Whether skin in contact cannot slide along the finger; False for most bodies."""
        return False

    def mirrors(self, spin_deg: Finite) -> bool:
        """Whether the body, turned by `spin_deg` about y, is its own mirror image across z = 0.

        Half a finger can be solved only then. It follows from `symmetry_deg` where the class that defines
        `gap`, or one derived from it, declares that; from `gap` itself otherwise.
        """
        kinds = type(self).__mro__
        definer = next(number for number, kind in enumerate(kinds) if "gap" in vars(kind))
        if any("symmetry_deg" in vars(kind) for kind in kinds[: definer + 1]):
            return self.symmetry_deg is None or spin_deg % self.symmetry_deg == 0.0
        return mirrored(self.gap, spin_deg)

    @property
    def edge_reach_mm(self) -> float:
        """Half-width about x = 0 of the finer mesh for edges there; 0 without edges. [mm]"""
        return 0.0

    @property
    def narrowest_mm(self) -> float:
        """Width of the narrowest groove or ridge, which a mesh must resolve; infinite without one. [mm]"""
        return np.inf

    @property
    def relief_mm(self) -> float:
        """Width of the narrowest dot, ridge or groove of any direction; infinite without one. [mm]"""
        return np.inf

    @property
    def tip_radius_mm(self) -> float:
        """Radius of a round tip, which a mesh must resolve; infinite without one. [mm]"""
        return np.inf

    def edges_mm(self, reach_mm: Finite) -> tuple[tuple[float, float], ...]:
        """Place along x and radius of each edge across the finger within reach of the axis. [mm]"""
        return ()

    @property
    def rim_mm(self) -> tuple[float, float] | None:
        """Radius of a round face and of its rounded rim; None without one. [mm]"""
        return None

    @property
    def sharpest_mm(self) -> float:
        """Radius of the sharpest edge or of the rim; infinite without one. [mm]"""
        rim = () if self.rim_mm is None else (self.rim_mm[1],)
        return min([*rim, *(radius for _, radius in self.edges_mm(0.0))], default=np.inf)

    def rounded_to(self, radius_mm: Finite) -> Indenter:
        """Return the body with edges or a rim of at least this radius [mm], where it has any."""
        return self


def _content(body: Indenter) -> tuple[object, ...]:
    values: list[object] = [getattr(body, part.name) for part in fields(body)] if is_dataclass(body) else []
    return tuple(
        (value.shape, value.dtype.str, (value + 0).tobytes()) if isinstance(value, np.ndarray) else value
        for value in values
    )


def _norm_and_direction(offsets: FloatArray) -> tuple[FloatArray, FloatArray]:
    """Length and unit direction of each row; a zero row points along y, the direction of pressing."""
    length = np.linalg.norm(offsets, axis=1)
    unit = offsets / np.where(length, length, 1.0)[:, None]
    return length, np.where(length[:, None] > 0.0, unit, [0.0, 1.0, 0.0])


def round_front(beside: FloatArray, radius: float) -> FloatArray:
    """Height y of a rounded edge or ball beside its centre line: 0 on it, -inf beyond `radius`."""
    height = np.sqrt(np.maximum(radius**2 - np.maximum(beside, 0.0) ** 2, 0.0)) - radius
    return np.where(beside <= radius, height, -np.inf)


def _rod_end(centred: FloatArray, beside: FloatArray, radius: float) -> tuple[FloatArray, FloatArray]:
    """Gap and normal of a ball or cylinder from offsets (n, 3) to its centre or axis."""
    # Behind its widest section the body goes on with straight sides: `beside` (n, 3) are the offsets along
    # the finger and across only. Skin that has passed the widest section is then held beside the body, and
    # the normal is the gradient of the gap everywhere (docs/decisions/small-bodies.md).
    distance, normal = _norm_and_direction(np.where(centred[:, 1:2] < 0.0, beside, centred))
    return distance - radius, normal


def rounded(
    inside: FloatArray, depth: FloatArray, outward: FloatArray, fillet: float
) -> tuple[FloatArray, FloatArray]:
    """Gap of a body with a flat top and rounded edges, from coordinates relative to its un-rounded core.

    The body is all points within `fillet` of the core {inside <= 0, depth <= 0}: `inside` runs outwards
    along the unit vector `outward` (n, 3), `depth` along y.
    """
    up = np.array([0.0, 1.0, 0.0])
    beyond_side, beyond_top = np.maximum(inside, 0.0), np.maximum(depth, 0.0)
    distance, direction = _norm_and_direction(beyond_side[:, None] * outward + beyond_top[:, None] * up)
    within = (inside <= 0.0) & (depth <= 0.0)
    nearest_face_is_top = depth >= inside
    gap = np.where(within, np.maximum(inside, depth), distance) - fillet
    normal = np.where(
        within[:, None], np.where(nearest_face_is_top[:, None], up[None, :], outward), direction
    )
    return gap, normal


def _of_diameter(radius_mm: float) -> dict[str, float]:
    return {"diameter_mm": 2 * positive("radius_mm", radius_mm, "mm")}


@value_class
class Cylinder(Indenter):
    """Cylinder that lies across the finger, its axis along z.

    Parameters
    ----------
    diameter_mm : float
        Diameter; the paper's is 3.17 mm. [mm]
    radius_mm : float, keyword
        Half of it, instead. [mm]

    Examples
    --------
    >>> gap, normal = Cylinder(diameter_mm=2.0).gap(np.array([[0.0, 0.5, 7.0]]))
    >>> gap.tolist(), normal.tolist()
    ([0.5], [[0.0, 1.0, 0.0]])
    """

    symmetry_deg = 90.0
    diameter_mm: SizeMm = protocol.CYLINDER_DIAMETER.value
    radius_mm = OtherName(_of_diameter, lambda body: body.diameter_mm / 2)

    if TYPE_CHECKING:

        def __init__(self, diameter_mm: float = ..., *, radius_mm: float = ...) -> None: ...

    @property
    def half_width_mm(self) -> float:
        return self.diameter_mm / 2

    @property
    def tip_radius_mm(self) -> float:
        return self.diameter_mm / 2

    def front(self, points_mm: PointsMm) -> FloatArray:
        return round_front(np.abs(points_mm[:, 0]), self.diameter_mm / 2)

    def gap(self, points_mm: PointsMm) -> tuple[FloatArray, FloatArray]:
        radius = self.diameter_mm / 2
        centred = (points_mm + np.array([0.0, radius, 0.0])) * [1.0, 1.0, 0.0]
        return _rod_end(centred, centred * [1.0, 0.0, 0.0], radius)


@value_class
class Line(Indenter):
    """Line load across the finger: a wire thinner than the elements of the skin, modelled as a blade.

    Nodes cannot resolve the roundness of a body as thin as their spacing: one node would balance on its top
    and slide off. The strip of skin that lies under the undeformed wire is therefore pushed along the
    direction of pressing and does not slide along the finger (docs/decisions.md#line-load).

    Parameters
    ----------
    diameter_mm : float
        Diameter of the wire; the paper's is 50 µm. [mm]

    Examples
    --------
    >>> Line().may_touch(np.array([[0.0, 0.3, 1.0], [0.05, 0.0, 1.0]])).tolist()
    [True, False]
    """

    symmetry_deg = 180.0
    diameter_mm: SizeMm = protocol.LINE_DIAMETER.value

    @property
    def grips(self) -> bool:
        return True

    @property
    def half_width_mm(self) -> float:
        return self.diameter_mm / 2

    def front(self, points_mm: PointsMm) -> FloatArray:
        return np.where(np.abs(points_mm[:, 0]) <= self.diameter_mm / 2, 0.0, -np.inf)

    def may_touch(self, undeformed_mm: PointsMm) -> np.ndarray:
        """Only the points below the undeformed wire; bool (n,)."""
        return np.abs(undeformed_mm[:, 0]) <= self.diameter_mm / 2 * (1 + 1e-6)

    def gap(self, points_mm: PointsMm) -> tuple[FloatArray, FloatArray]:
        """Gap along y (n,) and that direction (n, 3) at points (n, 3) of the indenter's frame. [mm]"""
        return Plate().gap(points_mm)


@value_class
class Sphere(Indenter):
    """Sphere given by its curvature, as in the psychophysics literature, or by its radius; by name only.

    Parameters
    ----------
    curvature_per_m : float, keyword
        1/radius; the paper writes "RC ... 1/m" and means this. [1/m]
    radius_mm, diameter_mm : float, keywords
        Instead of the curvature. [mm]

    Examples
    --------
    >>> round(Sphere(curvature_per_m=287).radius_mm, 3), Sphere(radius_mm=2.0)
    (3.484, Sphere(radius_mm=2.0))
    """

    symmetry_deg = None
    # A bare number could be either: 3.5 mm of radius is 286 1/m.
    curvature_per_m: Finite = field(default=protocol.STANDARD_CURVATURE.value, kw_only=True)
    radius_mm = OtherName(
        lambda radius_mm: {"curvature_per_m": curvature_per_m(positive("radius_mm", radius_mm, "mm"))},
        lambda body: radius_mm(body.curvature_per_m),
    )
    diameter_mm = OtherName(
        lambda diameter_mm: {
            "curvature_per_m": curvature_per_m(positive("diameter_mm", diameter_mm, "mm") / 2)
        },
        lambda body: 2 * radius_mm(body.curvature_per_m),
    )

    if TYPE_CHECKING:

        def __init__(
            self, *, curvature_per_m: float = ..., radius_mm: float = ..., diameter_mm: float = ...
        ) -> None: ...

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

    @property
    def half_width_mm(self) -> float:
        return self.radius_mm

    @property
    def tip_radius_mm(self) -> float:
        return self.radius_mm

    def front(self, points_mm: PointsMm) -> FloatArray:
        return round_front(np.hypot(points_mm[:, 0], points_mm[:, 2]), self.radius_mm)

    def gap(self, points_mm: PointsMm) -> tuple[FloatArray, FloatArray]:
        centred = points_mm + np.array([0.0, self.radius_mm, 0.0])
        return _rod_end(centred, centred * [1.0, 0.0, 1.0], self.radius_mm)


@value_class
class Bar(Indenter):
    """Flat bar across the finger, long in z, its two edges rounded.

    Parameters
    ----------
    width_mm : float
        Full width along x, fillets included. [mm]
    fillet_mm : float
        Radius of the two edges; `edge_radius_mm` is another name of it. [mm]

    Examples
    --------
    >>> gap, _ = Bar(width_mm=3.0, fillet_mm=0.3).gap(np.array([[0.0, -0.1, 0.0], [1.5, -0.3, 2.0]]))
    >>> gap.round(3).tolist()
    [-0.1, 0.0]
    """

    symmetry_deg = 90.0
    width_mm: SizeMm = protocol.BAR_WIDTH.value
    fillet_mm: NotNegative = protocol.BAR_FILLET.value
    edge_radius_mm = OtherName("fillet_mm")

    if TYPE_CHECKING:

        def __init__(
            self, width_mm: float = ..., fillet_mm: float = ..., *, edge_radius_mm: float = ...
        ) -> None: ...

    def __post_init__(self) -> None:
        fillet_within(self.fillet_mm, self.width_mm, "width_mm")

    @property
    def half_width_mm(self) -> float:
        return self.width_mm / 2

    @property
    def edge_reach_mm(self) -> float:
        return self.width_mm / 2 + BESIDE_EDGE_MM

    def edges_mm(self, reach_mm: Finite) -> tuple[tuple[float, float], ...]:
        return ((-self.width_mm / 2, self.fillet_mm), (self.width_mm / 2, self.fillet_mm))

    def rounded_to(self, radius_mm: Finite) -> Bar:
        return replace(self, fillet_mm=max(self.fillet_mm, min(radius_mm, self.width_mm / 2)))

    def front(self, points_mm: PointsMm) -> FloatArray:
        return round_front(np.abs(points_mm[:, 0]) - self.width_mm / 2 + self.fillet_mm, self.fillet_mm)

    def gap(self, points_mm: PointsMm) -> tuple[FloatArray, FloatArray]:
        x, y = points_mm[:, 0], points_mm[:, 1]
        outward = np.zeros_like(points_mm)
        outward[:, 0] = np.where(x < 0.0, -1.0, 1.0)
        inside = np.abs(x) - (self.width_mm / 2 - self.fillet_mm)
        return rounded(inside, y + self.fillet_mm, outward, self.fillet_mm)


@value_class
class FlatPunch(Indenter):
    """Flat-ended round probe with a rounded rim.

    Parameters
    ----------
    diameter_mm : float
        Full diameter, rim included. [mm]
    fillet_mm : float
        Radius of the rim; `edge_radius_mm` is another name of it. [mm]
    radius_mm : float, keyword
        Half of the diameter, instead. [mm]

    Examples
    --------
    >>> FlatPunch(radius_mm=1.0, edge_radius_mm=0.2)
    FlatPunch(diameter_mm=2.0, fillet_mm=0.2)
    """

    symmetry_deg = None
    diameter_mm: SizeMm = protocol.PUNCH_DIAMETER.value
    fillet_mm: NotNegative = protocol.BAR_FILLET.value
    edge_radius_mm = OtherName("fillet_mm")
    radius_mm = OtherName(_of_diameter, lambda body: body.diameter_mm / 2)

    if TYPE_CHECKING:

        def __init__(
            self,
            diameter_mm: float = ...,
            fillet_mm: float = ...,
            *,
            edge_radius_mm: float = ...,
            radius_mm: float = ...,
        ) -> None: ...

    def __post_init__(self) -> None:
        fillet_within(self.fillet_mm, self.diameter_mm, "diameter_mm")

    @property
    def half_width_mm(self) -> float:
        return self.diameter_mm / 2

    @property
    def rim_mm(self) -> tuple[float, float]:
        return self.diameter_mm / 2, self.fillet_mm

    def rounded_to(self, radius_mm: Finite) -> FlatPunch:
        return replace(self, fillet_mm=max(self.fillet_mm, min(radius_mm, self.diameter_mm / 2)))

    def front(self, points_mm: PointsMm) -> FloatArray:
        return round_front(
            np.hypot(points_mm[:, 0], points_mm[:, 2]) - self.diameter_mm / 2 + self.fillet_mm, self.fillet_mm
        )

    def gap(self, points_mm: PointsMm) -> tuple[FloatArray, FloatArray]:
        radial, outward = _norm_and_direction(points_mm * [1.0, 0.0, 1.0])
        # On the axis any radial direction serves; x is taken, since y would not be radial.
        outward = np.where(radial[:, None] > 0.0, outward, [1.0, 0.0, 0.0])
        inside = radial - (self.diameter_mm / 2 - self.fillet_mm)
        return rounded(inside, points_mm[:, 1] + self.fillet_mm, outward, self.fillet_mm)


@value_class
class Plate(Indenter):
    """Flat plate without edges, larger than the finger."""

    symmetry_deg = None

    def front(self, points_mm: PointsMm) -> FloatArray:
        return np.zeros(len(points_mm))

    def gap(self, points_mm: PointsMm) -> tuple[FloatArray, FloatArray]:
        return points_mm[:, 1].copy(), np.broadcast_to([0.0, 1.0, 0.0], points_mm.shape).copy()


def fillet_within(fillet_mm: float, width_mm: float, width_name: str) -> None:
    """Raise an error if a fillet is larger than half of a width. [mm]"""
    if fillet_mm > width_mm / 2:
        raise InputError(
            "fillet_mm", f"must not exceed half of {width_name}, {width_mm / 2:g} mm", f"{fillet_mm:g} mm"
        )
