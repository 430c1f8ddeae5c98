"""Rigid indenters for other solvers: an exact outline of lines and arcs, and facets along it.

An outline lies in the indenter's own frame (see `fingerpad.geometry.indenters`): u is the distance from the
axis of pressing, y the direction of pressing, and the tip is at (0, 0). Rotated about y it gives a sphere or
a punch, swept along z a cylinder, a bar or a plate. The skin is on the left of its direction.
"""

from __future__ import annotations

from dataclasses import dataclass, replace
from itertools import pairwise

import numpy as np

from fingerpad.core.checked import checked
from fingerpad.core.errors import InputError
from fingerpad.core.values import FloatArray, IntArray, Positive
from fingerpad.geometry.bodies import Bar, Cylinder, Edge, FlatPunch, Gap, Grating, Line, Plate, Sphere
from fingerpad.geometry.indenters import Indenter
from fingerpad.geometry.size_field import details_of

Point = tuple[float, float]

SHELL_SHARE = 0.1
"""Thickness of the facets' solid elements, as a share of their distance from the middle of the body."""

LARGEST_TURN_RAD = np.deg2rad(3.0)
"""Largest angle of one facet along an arc: its middle is then 0.03 % of the radius too deep."""

FACETS_AROUND = 96
FACETS_ACROSS = 8

FACETS_ACROSS_RELIEF = 24
"""Facets across the narrowest part of a body without an outline. With 16, 24 and 32 of them CalculiX finds
143.2, 141.7 and 142.0 mN under a square with a hole."""

SMALLEST_FACET_MM, LARGEST_FACET_MM, MOST_FACETS = 0.025, 0.1, 250_000
"""Bounds of their size, and of their number. [mm]"""

SHELL_MM = 0.1  # Thickness of their solid elements. [mm]


@dataclass(frozen=True)
class Outline:
    """Section of a rigid indenter."""

    revolved: bool  #: Whether it turns about the axis of pressing; else it is swept along z.
    corners: tuple[Point, ...]  #: u and y where segments meet. [mm]
    centres: tuple[Point | None, ...]
    """For each segment the centre of its arc, or None for a straight line. [mm]"""
    middles: tuple[float, ...] = (0.0,)
    """u of the middle of each ridge: 0, unless a groove parts the body or it ends there. [mm]"""

    def points(self, lowest_mm: float) -> FloatArray:
        """Points along the outline, arcs divided finely, to just below y = `lowest_mm`, (n, 2). [mm]"""
        points = [np.array([self.corners[0]])]
        for (start, end), centre in zip(pairwise(self.corners), self.centres, strict=True):
            points.append(_line(start, end) if centre is None else _arc(start, end, centre))
        line = np.concatenate(points)
        kept = np.flatnonzero(line[:, 1] >= lowest_mm)
        return line[max(kept[0] - 1, 0) : kept[-1] + 2]


def _line(start: Point, end: Point) -> FloatArray:
    share = np.linspace(0.0, 1.0, 5)[1:, None]
    return (1.0 - share) * np.array(start) + share * np.array(end)


def _arc(start: Point, end: Point, centre: Point) -> FloatArray:
    middle = np.array(centre)
    first, last = (np.arctan2(*(np.array(point) - middle)[::-1]) for point in (start, end))
    count = int(np.ceil(abs(last - first) / LARGEST_TURN_RAD))
    angles = np.linspace(first, last, count + 1)[1:]
    radius = np.linalg.norm(np.array(start) - middle)
    return middle + radius * np.column_stack([np.cos(angles), np.sin(angles)])


@checked
def outline_of(indenter: Indenter, reach_mm: Positive) -> Outline | None:
    if isinstance(indenter, Sphere):
        radius = indenter.radius_mm
        return Outline(True, ((0.0, 0.0), (radius, -radius)), ((0.0, -radius),))
    if isinstance(indenter, Cylinder):
        radius = indenter.diameter_mm / 2
        return Outline(False, ((-radius, -radius), (0.0, 0.0), (radius, -radius)), ((0.0, -radius),) * 2)
    if isinstance(indenter, FlatPunch):
        corners, centres = _rounded_side(indenter.diameter_mm / 2, indenter.fillet_mm, reach_mm)
        return _without_empty_segments(True, ((0.0, 0.0), *corners), (None, *centres))
    if isinstance(indenter, Bar):
        half, fillet = indenter.width_mm / 2, indenter.fillet_mm
        return _ridges(((-half, half, fillet, fillet),), reach_mm + fillet)
    if isinstance(indenter, Plate | Line):
        return Outline(False, ((-reach_mm, 0.0), (reach_mm, 0.0)), (None,))
    if isinstance(indenter, Edge):
        corners, centres = _rounded_side(0.0, indenter.fillet_mm, reach_mm)
        outline = _without_empty_segments(False, ((-reach_mm, 0.0), *corners), (None, *centres))
        return replace(outline, middles=(-reach_mm / 2,))
    if isinstance(indenter, Gap) and indenter.gap_mm == 0.0:
        return outline_of(Bar(indenter.width_mm, indenter.fillet_mm), reach_mm)
    if isinstance(indenter, Gap):
        inner, outer, lip = indenter.gap_mm / 2, indenter.width_mm / 2, indenter.lip_radius_mm
        left, right = (-outer, -inner, indenter.fillet_mm, lip), (inner, outer, lip, indenter.fillet_mm)
        return _ridges((left, right), reach_mm)
    if isinstance(indenter, Grating):
        count, half = int(np.ceil(reach_mm / indenter.period_mm)), indenter.ridge_mm / 2
        middles, lip = indenter.period_mm * np.arange(-count, count + 1), indenter.lip_mm
        return _ridges(tuple((u - half, u + half, lip, lip) for u in middles.tolist()), reach_mm)
    return None


Ridge = tuple[float, float, float, float]  # Flat between two walls: their u, the radii of its edges. [mm]


def _ridges(ridges: tuple[Ridge, ...], depth: float) -> Outline:
    """Ridges side by side; floors as deep as `depth` join them to one line."""
    corners: list[Point] = []
    centres: list[Point | None] = []
    for left, right, left_radius, right_radius in ridges:
        if corners:
            centres.append(None)
        left_side, left_centres = _rounded_side(-left, left_radius, depth - left_radius)
        right_side, right_centres = _rounded_side(right, right_radius, depth - right_radius)
        corners += [*((-u, y) for u, y in reversed(left_side)), *right_side]
        turned = [None if centre is None else (-centre[0], centre[1]) for centre in reversed(left_centres)]
        centres += [*turned, None, *right_centres]
    joined = _without_empty_segments(False, tuple(corners), tuple(centres))
    return replace(joined, middles=tuple(0.5 * (left + right) for left, right, *_ in ridges))


def _rounded_side(
    half_width: float, fillet: float, height: float
) -> tuple[tuple[Point, ...], tuple[Point | None, ...]]:
    """Corners and arcs of one side of a flat body: end of the flat, foot of the fillet, end of the side."""
    corners = ((half_width - fillet, 0.0), (half_width, -fillet), (half_width, -fillet - height))
    return corners, ((half_width - fillet, -fillet), None)


def _without_empty_segments(
    revolved: bool, corners: tuple[Point, ...], centres: tuple[Point | None, ...]
) -> Outline:
    """Outline without segments of zero length, which arise for a fillet of 0 or of the full half-width."""
    kept = [n for n, (start, end) in enumerate(pairwise(corners)) if start != end]
    return Outline(revolved, (corners[0], *(corners[n + 1] for n in kept)), tuple(centres[n] for n in kept))


@dataclass(frozen=True)
class RigidMesh:
    """Facets of a rigid indenter, each the outer face of a thin solid element."""

    nodes_mm: FloatArray
    """The outer nodes, then as many inner ones, in the indenter's frame, (n_nodes, 3). [mm]"""
    quads: IntArray  #: Outer nodes, counter-clockwise seen from the skin, (n_quads, 4).
    triangles: IntArray  #: The same about the axis of a body of revolution, (n_triangles, 3).

    @property
    def outer_mm(self) -> FloatArray:
        return self.nodes_mm[: len(self.nodes_mm) // 2]

    def solids(self, faces: IntArray) -> IntArray:
        """Bricks or wedges behind `faces`, their first nodes those of the outer face.

        The order is reversed, because a solid's first face is counter-clockwise seen from its inside.
        """
        outer = np.concatenate([faces[:, :1], faces[:, :0:-1]], axis=1)
        return np.concatenate([outer, outer + len(self.nodes_mm) // 2], axis=1)


def rigid_mesh(outline: Outline, lowest_mm: float, z_mm: tuple[float, float]) -> RigidMesh:
    """Divide an indenter into facets."""
    line = outline.points(lowest_mm)
    if outline.revolved:
        outer, quads, triangles = _revolved(line)
    else:
        outer, quads = _swept(line, np.linspace(*z_mm, FACETS_ACROSS + 1))
        triangles = np.empty((0, 3), dtype=np.int64)
    middles = np.array(outline.middles)
    towards = np.array([0.0, line[:, 1].min() - 1.0, 0.0]) - outer
    if not outline.revolved:
        towards[:, 0] += middles[np.abs(outer[:, :1] - middles).argmin(axis=1)]
        towards[:, 2] = 0.0
    return RigidMesh(np.concatenate([outer, outer + SHELL_SHARE * towards]), quads, triangles)


def face_mesh(
    indenter: Indenter, lowest_mm: float, x_mm: tuple[float, float], z_mm: tuple[float, float]
) -> RigidMesh:
    """Divide the face of any body into facets over a grid; walls are as steep as one of its cells is wide."""
    narrowest_mm = details_of(indenter).narrowest_mm
    pitch = np.clip(narrowest_mm / FACETS_ACROSS_RELIEF, SMALLEST_FACET_MM, LARGEST_FACET_MM)
    # The middle of the body is on a line: a symmetric body has symmetric facets.
    lines = (
        pitch * np.arange(np.floor(low / pitch), np.ceil(high / pitch) + 1) for low, high in (x_mm, z_mm)
    )
    x, z = np.meshgrid(*lines, indexing="ij")
    if x.size > MOST_FACETS:
        raise InputError(
            f"{type(indenter).__name__} would need {x.size:,} facets, more than {MOST_FACETS:,}: press it "
            "less deep, or export vtu, csv or npz."
        )
    height = indenter.front(np.column_stack([x.ravel(), np.zeros(x.size), z.ravel()])).reshape(x.shape)
    height = np.maximum(height, lowest_mm)
    ids = np.arange(x.size).reshape(x.shape)
    corners = [ids[:-1, :-1], ids[:-1, 1:], ids[1:, 1:], ids[1:, :-1]]
    quads = np.stack(corners, axis=-1).reshape(-1, 4)
    quads = quads[(height.ravel()[quads] > lowest_mm).any(axis=1)]
    used, numbers = np.unique(quads, return_inverse=True)
    outer = np.column_stack([x.ravel(), height.ravel(), z.ravel()])[used]
    nodes = np.concatenate([outer, outer - [0.0, SHELL_MM, 0.0]])
    return RigidMesh(nodes, numbers.reshape(quads.shape), np.empty((0, 3), dtype=np.int64))


def _swept(line: FloatArray, z: FloatArray) -> tuple[FloatArray, IntArray]:
    outer = np.concatenate([np.column_stack([line, np.full(len(line), depth)]) for depth in z])
    ids = np.arange(outer.shape[0]).reshape(z.size, len(line))
    # u points right and z away from the viewer: seen from the skin (+y) this order is counter-clockwise.
    quads = np.stack([ids[:-1, :-1], ids[1:, :-1], ids[1:, 1:], ids[:-1, 1:]], axis=-1).reshape(-1, 4)
    return outer, quads


def _revolved(line: FloatArray) -> tuple[FloatArray, IntArray, IntArray]:
    around = 2.0 * np.pi * np.arange(FACETS_AROUND) / FACETS_AROUND
    u, y = line[1:, :1], line[1:, 1:]
    rings = np.stack([u * np.sin(around), np.broadcast_to(y, (len(u), around.size)), u * np.cos(around)], -1)
    outer = np.concatenate([[[0.0, line[0, 1], 0.0]], rings.reshape(-1, 3)])
    ids = 1 + np.arange(len(u) * around.size).reshape(len(u), around.size)
    after = np.roll(ids, -1, axis=1)
    quads = np.stack([ids[:-1], ids[1:], after[1:], after[:-1]], axis=-1).reshape(-1, 4)
    triangles = np.stack([np.zeros_like(ids[0]), ids[0], after[0]], axis=-1)
    return outer, quads, triangles
