"""Bodies made of others: union, intersection, difference, offset, section, pattern, and moved ones."""

from __future__ import annotations

from abc import abstractmethod
from collections.abc import Callable
from dataclasses import replace
from functools import cached_property, partial, reduce
from typing import Annotated

import numpy as np
from pydantic import Field
from scipy.spatial import cKDTree

from fingerpad.core.checked import checked, checked_class, value_class
from fingerpad.core.errors import InputError
from fingerpad.core.units import cosine_and_sine
from fingerpad.core.values import (
    Check,
    Count,
    Flag,
    FloatArray,
    Many,
    NotNegative,
    Pairs,
    PointsMm,
    Positive,
    SizeMm,
    choice,
    entries,
    finite,
    tuple_of,
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
    nearer,
    turned_out,
)
from fingerpad.geometry.relief import check_edge_radius, with_rounded_edges

LEAST_SLOPE = 0.2
"""Least length of the gradient in a seam by which a gap is divided: parts that face each other have none."""

GapOf = Callable[[Indenter, FloatArray], Gapped]  # `Indenter.gap` or `Indenter.closed_gap` of a part.
_THREE = Check(partial(tuple_of, each=finite, length=3), {})
Three = Annotated[tuple[float, float, float], _THREE]


@checked_class
class Composed(Indenter):
    """Base of bodies whose gap follows from those of others."""

    @abstractmethod
    def _gap(self, points: FloatArray, of: GapOf) -> Gapped:
        """Gap and normal, from those `of` the parts."""

    def gap(self, points_mm: PointsMm) -> tuple[FloatArray, FloatArray]:
        return self._gap(points_mm, lambda part, points: part.gap(points))

    def closed_gap(self, points_mm: PointsMm) -> tuple[FloatArray, FloatArray]:
        return self._gap(points_mm, lambda part, points: part.closed_gap(points))


def _steepened(gap: FloatArray, slope: FloatArray) -> Gapped:
    """Gap divided by the length of its slope, so that it is a distance at the face, and unit normal."""
    length, unit = ball(slope, 0.0)
    return gap / np.maximum(length, LEAST_SLOPE), unit


@value_class
class Union(Composed):
    """Several bodies as one, each moved, with rounded seams and edges.

    Outside of sharp seams the gap is exact if those of the parts are; in filled seams it is a distance at
    the face only. Of a single part, it is this part with rounded edges.

    Examples
    --------
    >>> from fingerpad.geometry.bodies import Sphere
    >>> ball = Sphere(radius_mm=1.0)
    >>> pair = Union([ball, ball], [(-1.5, 0.0, 0.0), (1.5, 0.0, 0.0)])
    >>> pair.front(np.array([[1.5, 0.0, 0.0], [0.7, 0.0, 0.0]])).round(3).tolist()
    [0.0, -0.4]
    """

    parts: Many[Indenter]  #: The bodies.
    at_mm: Annotated[tuple[tuple[float, float, float], ...], entries(_THREE)] = ()
    """How far each is moved: along the finger, towards the skin, across; not at all by default. [mm]"""
    seam_mm: NotNegative = 0.0  #: Width over which concave seams are filled; 0 for sharp ones. [mm]
    edge_radius_mm: NotNegative = 0.0
    """Radius to which edges are rounded, at most half of the narrowest part; 0 keeps them. [mm]"""

    def __post_init__(self) -> None:
        object.__setattr__(self, "at_mm", self.at_mm or ((0.0, 0.0, 0.0),) * len(self.parts))
        if not self.parts or len(self.at_mm) != len(self.parts):
            raise InputError(
                f"A union needs one (x, y, z) of at_mm for each of its parts: got {len(self.at_mm)} for "
                f"{len(self.parts)} parts."
            )
        if self.edge_radius_mm:
            check_edge_radius(replace(self, edge_radius_mm=0.0), self.edge_radius_mm)

    def _gap(self, points: FloatArray, of: GapOf) -> Gapped:
        def sharp(at: FloatArray) -> Gapped:
            each = (of(part, at - np.array(by)) for part, by in zip(self.parts, self.at_mm, strict=True))
            return reduce(self._joined, each)

        return (
            with_rounded_edges(sharp, points, self.edge_radius_mm) if self.edge_radius_mm else sharp(points)
        )

    def _joined(self, first: Gapped, second: Gapped) -> Gapped:
        """Join two gaps by their minimum, or by a quadratic minimum over `seam_mm`, and its gradient."""
        if self.seam_mm == 0.0:
            return nearer(first, second)
        (gap, normal), (other, other_normal) = first, second
        share = np.clip(0.5 + 0.5 * (other - gap) / self.seam_mm, 0.0, 1.0)
        both = other + share * (gap - other) - self.seam_mm * share * (1.0 - share)
        return _steepened(both, share[:, None] * normal + (1.0 - share[:, None]) * other_normal)


@value_class
class Intersection(Composed):
    """What all of several bodies have in common.

    Inside, the gap is exact if those of the parts are; outside it is the distance or less.

    Examples
    --------
    >>> from fingerpad.geometry.bodies import Bar, Plate
    >>> post = Intersection([Bar(2.0, 0.1), Transformed(Bar(4.0, 0.1), turn_deg=(0.0, 90.0, 0.0))])
    >>> post.gap(np.array([[0.0, 0.3, 0.0], [3.0, -1.0, 0.0], [0.0, -1.0, 3.0]]))[0].round(3).tolist()
    [0.3, 2.0, 1.0]
    """

    parts: Annotated[Many[Indenter], Field(min_length=1)]  #: The bodies.

    def _gap(self, points: FloatArray, of: GapOf) -> Gapped:
        return reduce(deeper, (of(part, points) for part in self.parts))


@value_class
class Difference(Composed):
    """A body without what another one cuts off.

    Inside, the gap is exact if those of both are; outside it is the distance or less.

    Examples
    --------
    >>> from fingerpad.geometry.bodies import Plate, Sphere
    >>> dimple = Difference(Plate(), Transformed(Sphere(radius_mm=5.0), shift_mm=(0.0, 9.0, 0.0)))
    >>> dimple.front(np.array([[0.0, 0.0, 0.0], [2.0, 0.0, 0.0], [4.0, 0.0, 0.0]])).round(3).tolist()
    [-1.0, -0.583, 0.0]
    """

    body: Indenter
    cut: Indenter  #: What is cut off: a closed body, which a sphere is here.

    def _gap(self, points: FloatArray, of: GapOf) -> Gapped:
        return deeper(of(self.body, points), turned_out(self.cut.closed_gap(points)))


@value_class
class Offset(Composed):
    """A body grown to all sides, which rounds its convex edges; its face stays where it is.

    The gap is exact if that of the body is: that of an intersection or a difference keeps sharp edges.

    Examples
    --------
    >>> from fingerpad.geometry.bodies import Box
    >>> cushion = Offset(Box(2.0, 4.0, 0.0), 0.5)
    >>> cushion.gap(np.array([[1.5, -0.5, 0.0], [1.5, 0.0, 0.0]]))[0].round(3).tolist()
    [0.0, 0.207]
    """

    body: Indenter
    radius_mm: NotNegative  #: By how much. [mm]

    def _gap(self, points: FloatArray, of: GapOf) -> Gapped:
        gap, normal = of(self.body, points + self.radius_mm * UP)
        return gap - self.radius_mm, normal


class _OfSection(Composed):
    """Base of bodies that are made of the section of another one at z = 0."""

    profile: Indenter

    def __post_init__(self) -> None:
        if not self.profile.mirrors(0.0):
            raise InputError("profile", "must be its own mirror image across z = 0, where it is cut")

    def _section(self, u: FloatArray, y: FloatArray, outward: FloatArray, of: GapOf) -> Gapped:
        """Gap and normal in the plane, from coordinates along unit vectors `outward` (n, 3) and y."""
        gap, normal = of(self.profile, np.column_stack([u, y, np.zeros(len(u))]))
        return _steepened(gap, normal[:, :1] * outward + normal[:, 1:2] * UP)


@value_class
class Extruded(_OfSection):
    """The section of a body at z = 0, drawn out across or along the finger.

    The gap is exact outside if that of the section is.

    Examples
    --------
    >>> from fingerpad.geometry.bodies import Cone
    >>> ridge = Extruded(Cone(angle_deg=90.0, radius_mm=0.2), along_finger=True)
    >>> ridge.gap(np.array([[0.0, 0.1, 0.0], [7.0, 0.1, 0.0]]))[0].round(3).tolist()
    [0.1, 0.1]
    """

    profile: Indenter  #: The body; as a rule one of the same section everywhere, or a round one.
    length_mm: SizeMm | None = None  #: How long it is, about the axis of pressing; endless by default. [mm]
    along_finger: Flag = False  #: Whether it is drawn out along the finger, its section turned by 90 degrees.

    def _gap(self, points: FloatArray, of: GapOf) -> Gapped:
        beside, out = (ACROSS, ALONG) if self.along_finger else (ALONG, ACROSS)
        shape = np.broadcast_to(beside, points.shape)
        section = self._section(points @ beside, points[:, 1], shape, of)
        if self.length_mm is None:
            return section
        along = points @ out
        end = np.abs(along) - self.length_mm / 2, np.where(along < 0.0, -1.0, 1.0)[:, None] * out
        return corner(section, end)


@value_class
class Revolved(_OfSection):
    """The section of a body at z = 0, turned about the direction of pressing.

    The gap is exact outside if that of the section is, and the section lies on one side of the axis or is
    symmetric about it; else it is the distance or less.

    Examples
    --------
    >>> from fingerpad.geometry.bodies import Bar
    >>> ring = Revolved(Bar(1.0, 0.2), radius_mm=3.0)
    >>> ring.front(np.array([[3.0, 0.0, 0.0], [0.0, 0.0, -3.0], [0.0, 0.0, 0.0]])).tolist()
    [0.0, 0.0, -inf]
    """

    profile: Indenter  #: The body.
    radius_mm: NotNegative = 0.0  #: Distance of its middle from the axis. [mm]

    def _gap(self, points: FloatArray, of: GapOf) -> Gapped:
        radial, outward = from_axis(points)
        return self._section(radial - self.radius_mm, points[:, 1], outward, of)


@value_class
class Pattern(Composed):
    """Copies of a body in rows along and across the finger, their middle on the axis of pressing.

    The gap is exact outside if that of the body is, and the body reaches half a distance of copies to either
    side at most.

    Examples
    --------
    >>> from fingerpad.geometry.bodies import Capsule
    >>> rods = Pattern(Capsule(1.0, 8.0), pitch_x_mm=2.0, count_x=2)
    >>> rods.front(np.array([[1.0, 0.0, 0.0], [0.0, 0.0, 0.0], [3.0, 0.0, 0.0]])).tolist()
    [0.0, -inf, -inf]
    """

    body: Indenter
    pitch_x_mm: SizeMm | None = None
    pitch_z_mm: SizeMm | None = None
    """Distance of copies along and across the finger; one row without it. [mm]"""
    count_x: Count | None = None
    count_z: Count | None = None  #: How many copies there are; endless by default.

    def __post_init__(self) -> None:
        for axis in "xz":
            if getattr(self, f"count_{axis}") and not getattr(self, f"pitch_{axis}_mm"):
                raise InputError(f"pitch_{axis}_mm", f"must be given with count_{axis}")

    def _gap(self, points: FloatArray, of: GapOf) -> Gapped:
        near = _beside(points, 0, self.pitch_x_mm, self.count_x)
        near = [at for each in near for at in _beside(each, 2, self.pitch_z_mm, self.count_z)]
        return reduce(nearer, (of(self.body, at) for at in near))


def _beside(points: FloatArray, axis: int, pitch: float | None, count: int | None) -> list[FloatArray]:
    """Points as seen from the copies next to them on either side."""
    if pitch is None:
        return [points]
    last = np.inf if count is None else (count - 1) / 2
    half = 0.0 if count is None else last % 1.0  # an even number has no copy in the middle
    before = np.floor(points[:, axis] / pitch - half) + half
    way = pitch * np.eye(3)[axis]
    return [points - np.clip(at, -last, last)[:, None] * way for at in (before, before + 1.0)]


@value_class
class Transformed(Composed):
    """A body that is scaled, mirrored, turned and then moved. The gap is exact where that of the body is.

    The straight sides below a round body stay if it is turned about y only; else the body is closed.

    Examples
    --------
    >>> from fingerpad.geometry.bodies import Bar
    >>> leaning = Transformed(Bar(2.0, 0.2), turn_deg=(0.0, 0.0, 30.0))
    >>> leaning.front(np.array([[-0.5, 0.0, 0.0], [0.5, 0.0, 0.0]])).round(3).tolist()
    [-0.289, 0.289]
    """

    body: Indenter
    shift_mm: Three = (0.0, 0.0, 0.0)  #: Along the finger, towards the skin, across. [mm]
    turn_deg: Three = (0.0, 0.0, 0.0)
    """About x from y to z, then about y from x to z as `spin_deg`, then about z from x to y. [degrees]"""
    mirror: Annotated[str, choice(("x", "y", "z"))] | None = None  #: Axis along which it is mirrored.
    scale: Positive = 1.0  #: How many times as large it becomes.

    @cached_property
    def _turn(self) -> FloatArray:
        """Matrix of mirror image and turns."""
        turn = np.diag([-1.0 if axis == self.mirror else 1.0 for axis in "xyz"])
        for (start, end), angle in zip(((1, 2), (0, 2), (0, 1)), self.turn_deg, strict=True):
            cosine, sine = cosine_and_sine(angle)
            step = np.eye(3)
            step[[start, end], [start, end]], step[end, start], step[start, end] = cosine, sine, -sine
            turn = step @ turn
        return turn

    def _gap(self, points: FloatArray, of: GapOf) -> Gapped:
        local = (points - np.array(self.shift_mm)) / self.scale @ self._turn
        gap, normal = of(self.body, local) if self._turn[1, 1] == 1.0 else self.body.closed_gap(local)
        return gap * self.scale, normal @ self._turn.T


BRAILLE_DOT_MM, BRAILLE_HEIGHT_MM, BRAILLE_PITCH_MM, BRAILLE_CELL_MM = 1.44, 0.48, 2.34, 6.2
"""Base diameter and height of a dot, distance of dots in a cell, distance of cells: US Library of Congress,
National Library Service specification 800 (2008), section 3.2; status recalled. [mm]"""

_CELLS = (
    "a1 b12 c14 d145 e15 f124 g1245 h125 i24 j245 k13 l123 m134 n1345 o135 p1234 q12345 r1235 s234 t2345 "
    "u136 v1236 w2456 x1346 y13456 z1356"
)
_LETTERS = {cell[0]: cell[1:] for cell in _CELLS.split()}
"""Numbers of the raised dots: 1 to 3 down the left column of a cell, 4 to 6 down the right one."""


@value_class
class Dots(Indenter):
    """Raised dots on a flat plate: caps of balls with their tops in one plane.

    Examples
    --------
    >>> pair = Dots([(0.0, 0.0), (2.34, 0.0)])
    >>> pair.front(np.array([[2.34, 0.0, 0.0], [1.17, 0.0, 0.0]])).round(3).tolist()
    [0.0, -0.48]
    """

    at_mm: Pairs  #: Middle x, z of each dot, along and across the finger from the indenter's axis. [mm]
    diameter_mm: SizeMm = BRAILLE_DOT_MM  #: Diameter of a dot at its base. [mm]
    height_mm: Positive = BRAILLE_HEIGHT_MM
    """Height of a dot above the plate, at most half of its diameter. [mm]"""

    def __post_init__(self) -> None:
        if not self.at_mm:
            raise InputError("at_mm", "must hold a pair x, z for each dot", "none")
        check_most(self, "height_mm", "diameter_mm")

    @property
    def radius_mm(self) -> float:
        """Radius of the balls. [mm]"""
        return (self.diameter_mm**2 / 4 + self.height_mm**2) / (2 * self.height_mm)

    @cached_property
    def _tree(self) -> cKDTree:
        return cKDTree(np.array(self.at_mm))

    def gap(self, points_mm: PointsMm) -> tuple[FloatArray, FloatArray]:
        nearest = self._tree.data[self._tree.query(points_mm[:, [0, 2]])[1]]
        centre = np.column_stack([nearest[:, 0], np.full(len(points_mm), -self.radius_mm), nearest[:, 1]])
        # Behind the plate the ball goes on, and the plate is nearer.
        plate = points_mm[:, 1] + self.height_mm, np.broadcast_to(UP, points_mm.shape)
        return nearer(plate, ball(points_mm - centre, self.radius_mm))


@checked
def braille(text: str, along_finger: Flag = True) -> Dots:
    """Braille of some lower-case letters, dots 0.48 mm high, its middle on the indenter's axis.

    Parameters
    ----------
    text : str
        Letters a to z and spaces, uncontracted.
    along_finger : bool
        Whether the columns of a cell run along the finger, as it lies on a line of text that runs across;
        otherwise the line of text runs along the finger.

    Examples
    --------
    >>> braille("l").at_mm
    ((2.34, 0.0), (0.0, 0.0), (-2.34, 0.0))
    """
    unknown = sorted(set(text) - set(_LETTERS) - {" "})
    if unknown or not text.strip():
        low = text.lower()
        instead = f"; write {low!r}" if low != text and not set(low) - set(_LETTERS) - {" "} else ""
        raise InputError("text", "must have letters a to z and spaces", f"{text!r}{instead}")
    places = [
        (cell * BRAILLE_CELL_MM + (int(dot) > 3) * BRAILLE_PITCH_MM, (int(dot) - 1) % 3 * BRAILLE_PITCH_MM)
        for cell, letter in enumerate(text)
        for dot in _LETTERS.get(letter, "")
    ]
    line, down = np.array(places).T
    line, down = (each - 0.5 * (each.min() + each.max()) for each in (line, down))
    # Seen from the skin, z runs to the right where x, to the tip, runs up; a mirror image is another letter.
    at = np.column_stack([-down, line] if along_finger else [line, down]).round(9) + 0.0
    return Dots(tuple(map(tuple, at.tolist())))
