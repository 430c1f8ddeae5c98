"""Surfaces of triangles as rigid bodies, by the exact distance to them (docs/decisions/surfaces.md).

Their triangles are made one body: vertices joined, triangles and parts turned, walls between parts left out.
What is done is told in sentences; what cannot be done is refused.
"""

from __future__ import annotations

from dataclasses import fields, replace
from functools import cached_property, partial
from typing import Annotated

import numpy as np
from scipy.spatial import cKDTree

from fingerpad.core.checked import value_class
from fingerpad.core.errors import InputError
from fingerpad.core.logger import LOGGER
from fingerpad.core.values import (
    Check,
    Finite,
    FiniteMatrix,
    FloatArray,
    IntArray,
    NotNegative,
    PointsMm,
    int_array,
    limits,
)
from fingerpad.geometry.indenters import Indenter
from fingerpad.geometry.probing import traced_front
from fingerpad.geometry.relief import check_edge_radius, with_rounded_edges
from fingerpad.geometry.triangles import Sides, Triangles, groups

SMALLEST_MM, LARGEST_MM = 0.1, 1000.0
"""Extents beyond which a surface is refused: its unit must be wrong. [mm]"""

REACH_MM, PIXELS = 6.0, 479
"""Distance from the axis within which a surface is looked at [mm], and how often along each side."""

SKIRT_MM = 20.0  # An open surface goes on downwards from its border as far as this. [mm]

SMOOTH_BELOW_DEG = 30.0
"""Angle of creases that are rounded where they are hollow, unless another is given. [degrees]"""

LARGEST_SMOOTH_DEG = 90.0

HOLLOW_MM = 0.1
"""Distance from hollow creases over which they are rounded; less where triangles are small. [mm]"""


JOIN_MM = 0.01
"""Vertices and walls that are as near as this become one; the skin does not get between them. [mm]"""

_STEEP = 0.7
"""Component towards the skin below which a wall is steep, so that a crack along it opens to the skin."""


@value_class(eq=False)
class Surface(Indenter):
    """A rigid body bounded by triangles, watertight or open, in the frame of indenters.

    Parameters
    ----------
    vertices_mm : array (n, 3)
        Corners of the triangles: x along the finger, y towards the skin, z across. The body is moved along y
        until its highest point is at y = 0. [mm]
    faces : int array (m, 3)
        Three corners each, counter-clockwise seen from outside. From the border of an open surface walls go
        down. Vertices within 0.01 mm of each other are joined, triangles turned as their neighbours, closed
        parts that are inside out turned, and walls between parts left out; parts that overlap count as one
        body. `repairs` says what was done.
    smooth_below_deg : float
        Hollow creases at which the normals of two triangles differ by less are rounded over 0.1 mm to either
        side at most; 0 keeps all. Edges of a larger angle, and all ridges, stay as they are. [degrees]
    edge_radius_mm : float
        Radius to which ridges and corners are rounded, at most half of the narrowest part; 0 keeps them. [mm]

    Raises
    ------
    InputError
        If vertices are not finite, faces name no vertex, no triangle has an area, the surface is larger than
        1000 mm or smaller than 0.1 mm (a wrong unit), more than two triangles of a part share an edge, it
        shows the skin its inner side, parts touch along walls that do not match, the angle is not from 0 to
        90 degrees, or the radius does not fit.

    Examples
    --------
    >>> square = np.array([[-5.0, 2.0, -5.0], [-5.0, 2.0, 5.0], [5.0, 2.0, 5.0], [5.0, 2.0, -5.0]])
    >>> plate = Surface(square, np.array([[0, 1, 2], [0, 2, 3]]))
    >>> plate
    Surface(2 triangles, 10 x 0 x 10 mm)
    >>> plate.gap(np.array([[1.0, 0.25, 2.0], [5.5, -1.0, 2.0]]))[0].tolist()
    [0.25, 0.5]
    """

    vertices_mm: FiniteMatrix
    faces: Annotated[IntArray, Check(partial(int_array, ndim=2), {})]
    smooth_below_deg: Annotated[float, limits(0.0, LARGEST_SMOOTH_DEG)] = SMOOTH_BELOW_DEG
    edge_radius_mm: NotNegative = 0.0

    def __post_init__(self) -> None:
        vertices, faces = self.vertices_mm, self.faces
        if vertices.shape[1] != 3 or faces.shape[1] != 3 or not len(faces):
            raise InputError(
                f"A surface needs vertices (n, 3) and at least one triangle (m, 3): got {vertices.shape} and "
                f"{faces.shape}."
            )
        if faces.min() < 0 or faces.max() >= len(vertices):
            raise InputError(
                "faces",
                f"must hold numbers of vertices, 0 to {len(vertices) - 1}",
                f"{faces.min()} to {faces.max()}",
            )
        corners = vertices[faces]
        first, second, third = corners.transpose(1, 0, 2)
        normal = np.cross(second - first, third - first)
        area = np.linalg.norm(normal, axis=1)
        extent = float(np.ptp(corners, axis=(0, 1)).max())
        if not area.max() > 0.0:
            raise InputError(f"A surface needs triangles with an area: all {len(faces)} have none.")
        if not SMALLEST_MM <= extent <= LARGEST_MM:
            raise InputError(
                f"A surface must be {SMALLEST_MM:g} to {LARGEST_MM:g} mm large: got {extent:.4g} mm; check "
                "the unit of its file."
            )
        vertices, faces, told = _repaired(vertices, faces[area > 1e-12 * extent**2])
        vertices = vertices - [0.0, vertices[faces, 1].max(), 0.0]
        self.__dict__["repairs"] = told
        for name, value in (("vertices_mm", vertices), ("faces", faces)):
            value.setflags(write=False)
            object.__setattr__(self, name, value)
        if not (np.ptp(np.clip(vertices[faces], -REACH_MM, REACH_MM), axis=(0, 1))[[0, 2]] > 0.0).all():
            raise InputError(
                f"A surface must lie within {REACH_MM:g} mm of the indenter's axis: it does not."
            )
        if len(self._border) and self._shows_inner_side():
            raise InputError(
                "A surface must show its outer side to the skin, towards +y: it is open there or its sides "
                "are reversed; close it, turn it over, or reverse the order of the corners."
            )
        if told:
            LOGGER.warning("%r was repaired: %s.", self, "; ".join(told))
        if self.edge_radius_mm:
            check_edge_radius(replace(self, edge_radius_mm=0.0), self.edge_radius_mm)

    def __repr__(self) -> str:
        extents = " x ".join(f"{extent:.4g}" for extent in np.ptp(self.vertices_mm[self.faces], axis=(0, 1)))
        told = "".join(f"; {each}" for each in self.repairs)
        return f"Surface({len(self.faces)} triangles, {extents} mm{told})"

    def __getstate__(self) -> dict[str, np.ndarray]:
        # The tree is large and is made anew where it is needed.
        return {name: getattr(self, name) for name in (*(part.name for part in fields(self)), "repairs")}

    @cached_property
    def repairs(self) -> tuple[str, ...]:
        """What was done to the triangles to make them one body."""
        return ()

    def mirrors(self, spin_deg: Finite) -> bool:
        found: dict[float, bool] = self.__dict__.setdefault("_mirrors", {})
        if spin_deg not in found:
            found[spin_deg] = super().mirrors(spin_deg)
        return found[spin_deg]

    @cached_property
    def _border(self) -> IntArray:
        """Edges where the surface ends: the triangle and its two corners, (n, 3)."""
        border = _border_of(self.faces)
        return border[~_is_crack(self.vertices_mm, self.faces, border)]

    @cached_property
    def _layers(self) -> tuple[Triangles, ...]:
        """Triangles and the walls below the border; parts that overlap are in different ones."""
        layers, n_vertices = _layers_of(self.vertices_mm, self.faces), len(self.vertices_mm)
        _, a, b = self._border.T
        walls = np.column_stack([b, a, a + n_vertices, b, a + n_vertices, b + n_vertices]).reshape(-1, 3)
        vertices = np.concatenate([self.vertices_mm, self.vertices_mm - [0.0, SKIRT_MM, 0.0]])
        found = []
        for layer in range(int(layers.max()) + 1):
            faces = self.faces[layers == layer]
            faces = faces if layer else np.concatenate([faces, walls])
            found.append(Triangles.of(vertices, faces, self.smooth_below_deg, HOLLOW_MM))
        return tuple(found)

    def _shows_inner_side(self) -> bool:
        """Whether the skin sees an inner side over more than a line's width, or the rim of a thin wall."""
        corners = self.vertices_mm[self.faces]
        normals = np.cross(corners[:, 1] - corners[:, 0], corners[:, 2] - corners[:, 0])
        own, a, b = self._border.T
        lowest = corners[own, :, 1].min(axis=1)
        hangs = lowest < np.minimum(self.vertices_mm[a, 1], self.vertices_mm[b, 1])
        upright = np.abs(normals[own, 1]) <= 1e-6 * np.linalg.norm(normals[own], axis=1)
        if (hangs & upright).any():
            return True  # walls below the border would be its other side
        low, high = corners.min(axis=(0, 1)), corners.max(axis=(0, 1))
        (x0, _, z0), (x1, _, z1) = np.maximum(low, -REACH_MM), np.minimum(high, REACH_MM)
        spacing = max(x1 - x0, z1 - z0) / PIXELS
        x, z = np.arange(x0, x1 + 1e-9, spacing), np.arange(z0, z1 + 1e-9, spacing)
        points = np.stack(np.broadcast_arrays(x[:, None], 0.0, z), axis=-1).reshape(-1, 3)
        seen = (self._top(points)[1] < 0.0).reshape(x.size, z.size)
        return bool((seen[1:, 1:] & seen[1:, :-1] & seen[:-1, 1:] & seen[:-1, :-1]).any())

    def _top(self, points_mm: FloatArray) -> tuple[FloatArray, FloatArray]:
        """Height of the highest triangle above or below each point, -inf beside all, and its normal's y."""
        heights, slots = zip(*(layer.top(points_mm) for layer in self._layers), strict=True)
        highest, point = np.argmax(heights, axis=0), np.arange(len(points_mm))
        slot = np.array(slots)[highest, point]
        normals = [layer.normals[np.maximum(slot, 0) % len(layer.normals), 6, 1] for layer in self._layers]
        normal_y = np.where(slot < 0, 1.0, np.array(normals)[highest, point])
        return np.array(heights)[highest, point], normal_y

    def front(self, points_mm: PointsMm) -> FloatArray:
        height = self._top(points_mm)[0]
        return traced_front(self.gap, points_mm, np.where(np.isfinite(height), height + HOLLOW_MM, -np.inf))

    def gap(self, points_mm: PointsMm) -> tuple[FloatArray, FloatArray]:
        if self.edge_radius_mm == 0.0:
            return self._sharp_gap(points_mm)
        return with_rounded_edges(self._sharp_gap, points_mm, self.edge_radius_mm)

    def _sharp_gap(self, points_mm: FloatArray) -> tuple[FloatArray, FloatArray]:
        """Gap and normal before edges are rounded: of the nearest layer, or the one that reaches deepest."""
        gap, normal = self._layers[0].gap(points_mm)
        for layer in self._layers[1:]:
            other, direction = layer.gap(points_mm)
            normal = np.where((other < gap)[:, None], direction, normal)
            gap = np.minimum(gap, other)
        return gap, normal


def _repaired(vertices_mm: FloatArray, faces: IntArray) -> tuple[FloatArray, IntArray, tuple[str, ...]]:
    """Vertices and faces of one body, and what was done to make it one."""
    told: list[str] = []

    def tell(what: str, count: int) -> None:
        if count:
            told.append(f"{what}: {count:,}")

    vertices_mm, faces, joined, moved_mm = _joined(vertices_mm, faces)
    tell(
        f"vertices joined within {JOIN_MM:g} mm, moved by up to {moved_mm:.2g} mm", joined * (moved_mm > 0.0)
    )
    twice, wall = _on_equal_ones(faces)
    tell("triangles that lay on equal ones, left out", int((twice & ~wall).sum()))
    tell("triangles of walls between parts, left out", int(wall.sum()))
    faces = faces[~twice & ~wall]
    if not len(faces):
        raise InputError(
            "A surface must have one side out: each of its triangles lies on one that is reversed."
        )
    vertices_mm, faces = _parted(vertices_mm, faces)
    faces, turned = _turned_alike(faces)
    tell("triangles turned as their neighbours", turned)
    part, closed = _parts_of(faces)
    first, second, third = (vertices_mm - vertices_mm.mean(axis=0))[faces].transpose(1, 0, 2)
    volume = np.bincount(part, (np.cross(first, second) * third).sum(axis=1), len(closed))
    inwards = closed & (volume < 0.0)
    tell("closed parts whose normals pointed inwards, turned", int(inwards.sum()))
    faces = np.where(inwards[part][:, None], faces[:, ::-1], faces)
    _check_walls(vertices_mm, faces)
    return vertices_mm, faces, tuple(told)


def _border_of(faces: IntArray) -> IntArray:
    """Edges of one triangle alone: the triangle and its two corners in their order, (n, 3)."""
    sides = Sides.of(faces)
    alone = np.flatnonzero(sides.count == 1)
    return np.column_stack([alone % len(faces), sides.begin[alone], sides.end[alone]])


def _parts_of(faces: IntArray) -> tuple[IntArray, np.ndarray]:
    """Part of each triangle, joined along edges, and whether each part is closed."""
    sides = Sides.of(faces)
    part = groups(sides.pairs() % len(faces), len(faces))
    closed = np.ones(int(part.max(initial=-1)) + 1, dtype=bool)
    closed[np.tile(part, 3)[sides.count == 1]] = False
    return part, closed


def _layers_of(vertices_mm: FloatArray, faces: IntArray) -> IntArray:
    """Layer of each triangle: closed parts whose boxes overlap are in different ones, others in the first."""
    part, closed = _parts_of(faces)
    order = np.argsort(part, kind="stable")
    begin = np.flatnonzero(np.diff(part[order], prepend=-1))
    corners = vertices_mm[faces[order]]
    low = np.minimum.reduceat(corners.min(axis=1), begin)
    high = np.maximum.reduceat(corners.max(axis=1), begin)
    low[~closed, 1] = -np.inf  # walls go down from a border
    layer = np.where(closed & (len(closed) > 1), -1, 0)
    for number in np.flatnonzero(layer < 0):
        meets = ((low <= high[number] + JOIN_MM) & (high >= low[number] - JOIN_MM)).all(axis=1)
        taken = set(layer[meets].tolist())
        layer[number] = next(free for free in range(len(taken) + 1) if free not in taken)
    return layer[part]


def _is_crack(vertices_mm: FloatArray, faces: IntArray, border: IntArray) -> np.ndarray:
    """Whether another triangle goes on beyond an edge of a border, without corners in common, (n,)."""
    own, a, b = border.T
    if not len(own):
        return np.zeros(0, dtype=bool)
    first, second, third = vertices_mm[faces[own]].transpose(1, 0, 2)
    normal = np.cross(second - first, third - first)
    area = np.linalg.norm(normal, axis=1)
    height = area / np.linalg.norm([second - first, third - second, first - third], axis=2).max(axis=0)
    normal /= area[:, None]
    along = vertices_mm[b] - vertices_mm[a]
    beyond = np.cross(along / np.linalg.norm(along, axis=1)[:, None], normal)
    step = np.minimum(2 * JOIN_MM, 0.2 * height)
    others = Triangles.of(vertices_mm, faces[np.unique(own)])
    middle = 0.5 * (vertices_mm[a] + vertices_mm[b])
    gaps = [np.abs(others.gap(middle + step[:, None] * way)[0]) for way in (beyond, normal, -normal)]
    # This triangle is a step away; another one at up to 45 degrees is nearer.
    return (np.array(gaps) < 0.72 * step).any(axis=0)


def _joined(vertices: FloatArray, faces: IntArray) -> tuple[FloatArray, IntArray, int, float]:
    """Join near vertices of borders, and of walls that face each other; how many are gone, largest move."""
    loose = np.zeros(len(vertices), dtype=bool)
    loose[_border_of(faces)[:, 1:]] = True
    part = groups(np.concatenate([faces[:, :2], faces[:, 1:]]).T, len(vertices))
    # Vertices within one part are far from each other, and may be many.
    used = np.flatnonzero(loose) if (part[faces] == part[faces[0, 0]]).all() else np.unique(faces)
    if not used.size:
        return vertices, faces, 0, 0.0
    shortest = np.full(len(vertices), np.inf)
    for ahead in (1, 2):
        to = np.roll(faces, ahead, axis=1)
        np.minimum.at(shortest, faces, np.linalg.norm(vertices[faces] - vertices[to], axis=2))
    within = min(JOIN_MM, 0.1 * float(shortest[used].max()))
    pairs = used[cKDTree(vertices[used]).query_pairs(within, output_type="ndarray")].T
    i, j = pairs
    # A short side must not shrink to a point.
    apart = np.linalg.norm(vertices[i] - vertices[j], axis=1)
    near = (part[i] != part[j]) | (loose[i] & loose[j])
    near &= apart <= 0.1 * np.minimum(shortest[i], shortest[j])
    pairs = pairs[:, near]
    walls = _on_equal_ones(groups(pairs, len(vertices))[faces])[1]
    loose[faces[walls]] = True
    label = groups(pairs[:, loose[pairs].all(axis=0)], len(vertices))
    count = np.bincount(label)
    # Sums about one of them, so that equal ones stay where they are.
    about = np.empty((len(count), 3))
    about[label] = vertices
    away = vertices - about[label]
    mean = about + np.column_stack([np.bincount(label, away[:, axis]) / count for axis in range(3)])
    moved = float(np.linalg.norm(mean[label] - vertices, axis=1).max())
    faces = label[faces]
    return mean, faces[(faces != np.roll(faces, 1, axis=1)).all(axis=1)], len(vertices) - len(count), moved


def _on_equal_ones(faces: IntArray) -> tuple[np.ndarray, np.ndarray]:
    """Whether each triangle has the corners of an earlier one, and whether of one with the other side out."""
    # From the lowest corner on, two triangles of one side have the same order of corners.
    turned = np.take_along_axis(faces, (faces.argmin(axis=1)[:, None] + np.arange(3)) % 3, axis=1)
    left = turned[:, 1] < turned[:, 2]
    corners = np.column_stack([turned[:, 0], np.sort(turned[:, 1:], axis=1)])
    order = np.lexsort(corners.T)
    again = np.r_[False, (np.diff(corners[order], axis=0) == 0).all(axis=1)]
    group = np.cumsum(~again) - 1
    both = (np.bincount(group, left[order]) > 0) & (np.bincount(group, ~left[order]) > 0)
    twice, wall = np.empty((2, len(faces)), dtype=bool)
    twice[order], wall[order] = again, both[group]
    return twice, wall


def _parted(vertices: FloatArray, faces: IntArray) -> tuple[FloatArray, IntArray]:
    """Give closed parts that meet along an edge vertices of their own; raise an error if others meet."""
    sides = Sides.of(faces)
    if sides.count.max() <= 2:
        return vertices, faces
    part = groups(sides.pairs() % len(faces), len(faces))
    own = np.unique(np.tile(part, 3) * len(sides.edge) + sides.edge, return_inverse=True)[1]
    wrong = np.flatnonzero((sides.count > 2) & (np.bincount(own)[own] != 2))
    if wrong.size:
        x, y, z = 0.5 * (vertices[sides.begin[wrong[0]]] + vertices[sides.end[wrong[0]]])
        raise InputError(
            "A surface must have two triangles at most along each edge: "
            f"{len(np.unique(sides.edge[wrong])):,} edges have more, one at ({x:.4g}, {y:.4g}, {z:.4g}) mm; "
            "leave out inner walls, for example by the Boolean union of a CAD program."
        )
    corner, number = np.unique(part[:, None] * len(vertices) + faces, return_inverse=True)
    return vertices[corner % len(vertices)], number.reshape(faces.shape)


def _turned_alike(faces: IntArray) -> tuple[IntArray, int]:
    """Triangles turned so that neighbours have the same side out, as most of their part, and how many."""
    sides = Sides.of(faces)
    one, other = sides.pairs()
    against = (sides.begin[one] == sides.begin[other]).astype(np.int64)
    if not against.any():
        return faces, 0
    # Each triangle is there twice, as it is and turned; links join those of one side.
    n = len(faces)
    one, other = one % n, other % n
    links = np.array([[one, one + n], [other + n * against, other + n * (1 - against)]])
    label = groups(links.reshape(2, -1), 2 * n)
    if (label[:n] == label[n:]).any():
        raise InputError(
            "A surface must have two sides: a strip of its triangles has one, as a Möbius strip."
        )
    turned = label[:n] > label[n:]
    part = np.unique(np.minimum(label[:n], label[n:]), return_inverse=True)[1]
    turned ^= (np.bincount(part, turned) > 0.5 * np.bincount(part))[part]
    return np.where(turned[:, None], faces[:, ::-1], faces), int(turned.sum())


def _check_walls(vertices: FloatArray, faces: IntArray) -> None:
    """Raise an error if steep walls of two parts face each other within `JOIN_MM`."""
    layer = _layers_of(vertices, faces)
    if not layer.any():
        return
    corners = vertices[faces]
    middle = corners.mean(axis=1)
    normal = np.cross(corners[:, 1] - corners[:, 0], corners[:, 2] - corners[:, 0])
    length = np.linalg.norm(normal, axis=1)
    normal /= np.where(length > 0.0, length, 1.0)[:, None]
    steep = np.abs(normal[:, 1]) < _STEEP
    for number in range(int(layer.max()) + 1):
        tree = Triangles.of(vertices, faces[layer == number])
        others = np.flatnonzero((layer != number) & (length > 0.0) & steep)
        gap, facing = tree.gap(middle[others])
        meets = np.flatnonzero((np.abs(gap) <= JOIN_MM) & ((facing * normal[others]).sum(axis=1) < -0.9))
        if meets.size:
            place = ", ".join(f"{at:.4g}" for at in middle[others[meets[0]]])
            raise InputError(
                f"Parts of a surface must overlap or stand apart by more than {JOIN_MM:g} mm: walls of two "
                f"are {np.abs(gap[meets]).max():.2g} mm apart at ({place}) mm; unite them, for example by "
                "the Boolean union of a CAD program."
            )
