"""Structured mesh of bricks along, around and through a finger or a block.

Every element is an 8-node brick with its lower face on the bone's side and its upper face on the skin's side.
At the tip of the finger all rays of a grid line meet in one pole. The bricks there have one side collapsed
(two pairs of repeated nodes), so one kernel computes bricks and wedges.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass, fields
from functools import cached_property

import numpy as np
from numpy.typing import ArrayLike
from scipy.optimize import brentq

from fingerpad.core.errors import InputError
from fingerpad.core.values import FloatArray, IntArray, float_array, increasing, whole
from fingerpad.geometry.fingertip import Fingertip
from fingerpad.geometry.grading import Grading, Strip, lines_from_middle

LAYERS = ("stratum corneum", "living epidermis", "dermis", "subcutis")
_LIVING_EPIDERMIS = 1
_ARC_POINTS = 4001  # arc lengths along the skin: chords of 0.01 mm are short by less than 1e-6
_LARGEST_TURN = np.radians(30.0)  # Of the skin from one line to the next: a tip of fewer lines is a polygon.
_TURN_TO_RAYS = 0.5  # half way raises the smallest scaled Jacobian from 0.18 to 0.56
CORNERS = np.array(  # local coordinates of a brick's nodes, in their order
    [[-1, -1, -1], [1, -1, -1], [1, 1, -1], [-1, 1, -1], [-1, -1, 1], [1, -1, 1], [1, 1, 1], [-1, 1, 1]],
    dtype=np.float64,
)


@dataclass(frozen=True)
class Mesh:
    """Hexahedra in a structured grid, with the sets of nodes that mechanics needs."""

    nodes_mm: FloatArray  # x, y and z of the nodes, (n_nodes, 3). [mm]
    elements: IntArray
    """Nodes of each brick: lower face (towards the bone) counter-clockwise seen from the skin, then upper.
    Elements are numbered along, around, through (skin to bone), the last running fastest, (n_elements, 8)."""
    layer: IntArray  # Index into `LAYERS`, (n_elements,).
    shape: tuple[int, int, int]  # Number of elements along, around and through.
    full: bool
    """Whether both halves are meshed; otherwise only z >= 0, with `symmetry_nodes` on the plane z = 0."""
    skin_grid: IntArray
    """Nodes of the skin in grid order; the pole, and the seam of a full finger, appear more than once,
    (n_along + 1, n_around + 1)."""
    bone_nodes: IntArray
    nail_nodes: IntArray
    symmetry_nodes: IntArray
    """Nodes on the bone (or bottom of a block), under the nail, and on the plane of symmetry."""
    midline_nodes: IntArray  # Nodes of the volar skin at z = 0, x increasing, (n_along + 1,).
    living_epidermis: IntArray
    """The sheet of elements above the epidermal-dermal border; empty without one, (n_along, n_around)."""

    def __post_init__(self) -> None:
        for field in fields(self):
            value = getattr(self, field.name)
            if isinstance(value, np.ndarray):
                value.setflags(write=False)

    @property
    def numbers(self) -> IntArray | None:
        """Numbers of the elements in a file, where it counts them otherwise."""
        return None

    @cached_property
    def grid(self) -> IntArray:
        """Nodes in grid order, (n_along + 1, n_around + 1, n_through + 1), through from the skin downwards.

        Nodes below one point of the skin are numbered consecutively; pole and seam appear more than once.
        """
        through = np.arange(self.shape[2] + 1)
        return self.skin_grid[:, :, None] + through

    @property
    def is_grid(self) -> bool:
        """Whether the elements lie in rows along, around and through; a `FreeMesh` has none."""
        return True

    @cached_property
    def skin_faces(self) -> IntArray:
        """Corners of the faces on the skin, (n_faces, 4), counter-clockwise seen from outside.

        A triangle repeats a corner.
        """
        grid = self.skin_grid
        return np.stack([grid[:-1, :-1], grid[1:, :-1], grid[1:, 1:], grid[:-1, 1:]], axis=-1).reshape(-1, 4)

    @property
    def skin_elements(self) -> IntArray:
        return np.arange(len(self.elements)).reshape(self.shape)[:, :, 0].ravel()

    @cached_property
    def node_depth_mm(self) -> FloatArray:
        """Distance of each node from the node of the skin above it, (n_nodes,). [mm]"""
        depth = np.zeros(len(self.nodes_mm))
        column = self.nodes_mm[self.grid]
        depth[self.grid] = np.linalg.norm(column - column[:, :, :1], axis=-1)
        return depth

    def elements_at(self, depth_mm: float) -> IntArray:
        """Elements that hold a depth; a depth on a border belongs to the elements above it."""
        corners = self._last_depth_mm[self.elements]
        return np.flatnonzero((corners.min(axis=1) < depth_mm) & (corners.max(axis=1) >= depth_mm))

    @cached_property
    def _last_depth_mm(self) -> FloatArray:
        """Depth up to which the elements above each node reach: a little below it, (n_nodes,). [mm]"""
        depth = self.node_depth_mm
        thickness = np.full(len(depth), np.inf)
        np.minimum.at(thickness, self.elements, np.ptp(depth[self.elements], axis=1)[:, None])
        return depth + np.where(depth > 0.0, 0.05 * thickness, 0.0)

    @cached_property
    def skin_nodes(self) -> IntArray:
        """Nodes of the skin, each once, increasing."""
        return np.unique(self.skin_grid)

    @cached_property
    def fixed_nodes(self) -> IntArray:
        """Nodes that do not move: bone and nail."""
        return np.union1d(self.bone_nodes, self.nail_nodes)

    @cached_property
    def skin_area_mm2(self) -> FloatArray:
        """Undeformed area of the skin that belongs to each of `skin_nodes`. [mm²]"""
        return self.skin_area_of(self.nodes_mm)

    def skin_area_of(self, nodes_mm: FloatArray) -> FloatArray:
        """Area of the skin that belongs to each of `skin_nodes` when the nodes are at `nodes_mm`. [mm²]

        The integral of each node's bilinear shape function over the faces of the mesh.
        """
        faces = self.skin_faces
        area = np.zeros(len(nodes_mm))
        for point in CORNERS[:4, :2] / np.sqrt(3.0):
            signs = CORNERS[:4, :2]
            shape = 0.25 * (1.0 + signs[:, 0] * point[0]) * (1.0 + signs[:, 1] * point[1])
            along = 0.25 * signs[:, 0] * (1.0 + signs[:, 1] * point[1])
            around = 0.25 * signs[:, 1] * (1.0 + signs[:, 0] * point[0])
            corners = nodes_mm[faces]
            tangents = (np.einsum("a,fad->fd", weights, corners) for weights in (along, around))
            patch = np.linalg.norm(np.cross(*tangents), axis=1)
            np.add.at(area, faces, patch[:, None] * shape)
        return area[self.skin_nodes]


def _bricks(grid: IntArray) -> IntArray:
    """Bricks of a grid of node ids (along, around, through), through counted from the skin downwards."""
    below, above = grid[:, :, 1:], grid[:, :, :-1]
    faces = [(face[:-1, :-1], face[1:, :-1], face[1:, 1:], face[:-1, 1:]) for face in (below, above)]
    return np.stack([corner for face in faces for corner in face], axis=-1).reshape(-1, 8)


def _mesh(
    nodes_mm: FloatArray,
    grid: IntArray,
    layers: IntArray,
    full: bool,
    midline: int,
    nail: IntArray,
    symmetry: IntArray,
) -> Mesh:
    along, around, through = (size - 1 for size in grid.shape)
    layer = np.tile(layers, along * around)
    numbers = np.arange(layer.size).reshape(along, around, through)
    epidermis = np.flatnonzero(layers == _LIVING_EPIDERMIS)
    return Mesh(
        nodes_mm=nodes_mm,
        elements=_bricks(grid),
        layer=layer,
        shape=(along, around, through),
        full=full,
        skin_grid=grid[:, :, 0].copy(),
        bone_nodes=np.unique(grid[:, :, -1]),
        nail_nodes=nail,
        symmetry_nodes=symmetry,
        midline_nodes=grid[:, midline, 0].copy(),
        living_epidermis=numbers[:, :, epidermis[-1]] if epidermis.size else np.empty((0, 0), dtype=np.int64),
    )


def block_mesh(
    x_edges: ArrayLike, y_edges: ArrayLike, z_edges: ArrayLike, layers: Sequence[int], symmetric: bool = False
) -> Mesh:
    """Build a block of layers: skin at y = 0 facing -y, depth along +y, its bottom the set `bone_nodes`."""
    x, y, z = (
        increasing(name, float_array(name, edges, 1))
        for name, edges in (("x_edges", x_edges), ("y_edges", y_edges), ("z_edges", z_edges))
    )
    if min(x.size, y.size, z.size) < 2 or y[0] != 0.0:
        raise InputError("A block needs two edges or more each way, y_edges starting at the skin, 0 mm.")
    layer = np.array([whole("layers", index, 0) for index in layers], dtype=np.int64)
    if layer.size != y.size - 1 or (layer >= len(LAYERS)).any():
        raise InputError(
            "layers", f"needs an index below {len(LAYERS)} for each interval of y_edges", str(layers)
        )
    if symmetric and z[0] != 0.0:
        raise InputError(f"z_edges of a symmetric block must start at 0 mm: got {z[0]}.")
    corners = np.stack(np.meshgrid(x, z, y, indexing="ij"), axis=-1)[..., [0, 2, 1]]
    grid = np.arange(x.size * z.size * y.size).reshape(x.size, z.size, y.size)
    none = np.empty(0, dtype=np.int64)
    symmetry = np.unique(grid[:, 0]) if symmetric else none
    return _mesh(corners.reshape(-1, 3), grid, layer, not symmetric, int(np.abs(z).argmin()), none, symmetry)


@dataclass(frozen=True)
class GridLines:
    """Grid lines of a finger's mesh in coordinates along, around and through."""

    along_mm: FloatArray
    """Arc length on the volar midline from the cut to the pole at the tip, (n_along + 1,). [mm]"""
    around_rad: FloatArray
    """Angle about the bone's axis: 0 volar, pi dorsal; from -pi for both halves, (n_around + 1,). [rad]"""
    through: FloatArray
    """0 at the skin, 1, 2 and 3 at the lower borders of stratum corneum, living epidermis and dermis, 4 at
    the bone, (n_through + 1,)."""

    @property
    def full(self) -> bool:
        """Whether the lines go all around the finger."""
        return bool(self.around_rad[0] < 0.0)


def _rays(finger: Fingertip, station: FloatArray, around_rad: FloatArray) -> tuple[FloatArray, FloatArray]:
    """Origins and directions (..., 3) of rays from the bone's axis."""
    # `station` is x along the axis and, beyond its end, 1 mm per radian of the rays that fan out to the tip.
    turn = np.clip(station - finger.spine_end_x_mm, 0.0, 0.5 * np.pi)
    # Exact zeros on the plane of symmetry and at the pole, where sin(pi) and cos(pi / 2) leave rounding.
    side = np.where(np.abs(around_rad) == np.pi, 0.0, np.sin(around_rad))
    radial = np.where(turn == 0.5 * np.pi, 0.0, np.cos(turn))
    x = np.minimum(station, finger.spine_end_x_mm)
    origins = np.stack(np.broadcast_arrays(x, finger.spine_y_mm, 0.0 * around_rad), axis=-1)
    directions = np.stack(
        np.broadcast_arrays(np.sin(turn), -radial * np.cos(around_rad), radial * side), axis=-1
    )
    return origins, directions


def _skin(finger: Fingertip, station: FloatArray, around_rad: FloatArray) -> FloatArray:
    origins, directions = _rays(finger, station, around_rad)
    return origins + finger.skin_distance_mm(origins, directions)[..., None] * directions


def _arc_length(points: FloatArray) -> FloatArray:
    return np.concatenate([[0.0], np.cumsum(np.linalg.norm(np.diff(points, axis=0), axis=1))])


def _midline(finger: Fingertip) -> tuple[FloatArray, FloatArray, FloatArray]:
    """Stations of rays, and x and arc length of the volar midline there."""
    station = np.linspace(0.0, finger.spine_end_x_mm + 0.5 * np.pi, _ARC_POINTS)
    points = _skin(finger, station, np.zeros(1))
    return station, points[:, 0], _arc_length(points)


def finger_lines(finger: Fingertip, grading: Grading) -> GridLines:
    """Grid lines of a finger, an even number of steps to either side of the centre."""
    station, x, arc = _midline(finger)
    centre = grading.centre_mm
    if not 0.0 < centre < x[-1]:
        raise InputError("centre_mm", f"must lie between 0 and {x[-1]:.2f} mm", str(centre))
    middle = np.interp(centre, x, arc)
    proximal, distal = (
        lines_from_middle(
            grading,
            grading.half_length_mm,
            grading.size_x_mm,
            length,
            _strips(grading.finer_along, x, way * (arc - middle)),
        )
        for way, length in ((-1.0, middle), (1.0, arc[-1] - middle))
    )
    turned = _turned(finger, _skin(finger, station[:, None], np.array([0.0, 0.5, 1.0]) * np.pi))
    distal = _turning(distal, arc - middle, turned)
    along = np.concatenate([middle - proximal[::-1], middle + distal[1:]])
    along[0] = 0.0
    angle = np.linspace(0.0, np.pi, _ARC_POINTS)
    section = _skin(finger, np.interp([centre], x, station), angle)
    girth, z = _arc_length(section), section[:, 2]
    turned = _turned(finger, section[:, None])
    volar = slice(int(z.argmax()) + 1)
    right, left = (
        lines_from_middle(
            grading,
            grading.half_width_mm,
            grading.size_z_mm,
            girth[-1],
            _strips(strips, z[volar], girth[volar]),
        )
        for strips in (
            grading.finer_across,
            [(-end, -begin, size) for begin, end, size in grading.finer_across],
        )
    )
    right, left = (np.interp(_turning(lines, girth, turned), girth, angle) for lines in (right, left))
    around = np.concatenate([-left[:0:-1], right]) if grading.full else right
    through = [np.zeros(1)]
    through += [layer + np.linspace(0.0, 1.0, n + 1)[1:] for layer, n in enumerate(grading.counts[:3])]
    through.append(3.0 + _subcutis_fractions(finger, grading))
    return GridLines(along, around, np.concatenate(through))


def _turned(finger: Fingertip, skin: FloatArray) -> FloatArray:
    """Angle by which the skin has turned along rows of points (n, m, 3), in the row that turns most. [rad]"""
    steps = np.linalg.norm(np.diff(finger.skin_normal(skin), axis=0), axis=2)
    return np.concatenate([[0.0], np.cumsum(steps.max(axis=1))])


def _turning(lines: FloatArray, arc: FloatArray, turned: FloatArray) -> FloatArray:
    """Lines, closer together where the skin turns by more than the limit from one to the next."""
    far = np.flatnonzero(np.diff(np.interp(lines, arc, turned)) > _LARGEST_TURN)
    if not far.size:
        return lines
    first = int(far[0])
    places = np.linspace(lines[first], lines[-1], _ARC_POINTS)
    steps = np.diff(np.interp(places, lines, np.arange(lines.size, dtype=np.float64)))
    turns = np.diff(np.interp(places, arc, turned)) / _LARGEST_TURN
    number = np.concatenate([[0.0], np.cumsum(np.maximum(steps, turns))])
    count = int(np.ceil(number[-1]))
    count += (first + count) % 2
    closer = np.interp(np.linspace(0.0, number[-1], count + 1), number, places)
    return np.concatenate([lines[:first], closer])


def _strips(strips: Sequence[Strip], place_mm: FloatArray, arc_mm: FloatArray) -> list[Strip]:
    """Return strips given by x or z as distances on the skin from the centre, without those beyond it."""
    on_skin = []
    for begin, end, size in strips:
        near, far = sorted(np.interp([begin, end], place_mm, arc_mm).tolist())
        if far > 0.0:
            on_skin.append((near, far, size))
    return on_skin


def _subcutis_fractions(finger: Fingertip, grading: Grading) -> FloatArray:
    """Fractions of the subcutis: steps grow inwards from the size of the dermis' elements."""
    thickness = float(finger.depth_available_mm(grading.centre_mm, 0.0)) - finger.layer_depths_mm[-1]
    count = grading.subcutis
    first = finger.dermis_mm / grading.dermis

    def excess(ratio: float) -> float:
        return first * (ratio ** np.arange(1, count + 1)).sum() - thickness

    ratio = 1.0 if excess(1.0) >= 0.0 else brentq(excess, 1.0, thickness / first)
    steps = np.cumsum(ratio ** np.arange(1, count + 1))
    return steps / steps[-1]


def finger_mesh(finger: Fingertip, grading: Grading | GridLines) -> Mesh:
    """Mesh of a finger.

    Rays leave the bone's straight axis at right angles and fan out from its end to the tip. On each ray lie a
    point of the bone and one of the skin. Layers are offset from the skin along its normal, on the lateral
    ridge and the dorsal side, where normals would meet, partly along the ray; the subcutis runs straight from
    there to the bone.
    """
    lines = grading if isinstance(grading, GridLines) else finger_lines(finger, grading)
    around = lines.around_rad[:-1] if lines.full else lines.around_rad
    points = _finger_points(finger, lines, around)
    n_along, n_around, n_through = (
        size - 1 for size in (lines.along_mm.size, around.size, lines.through.size)
    )
    ids = np.arange(n_along * (n_around + 1) * (n_through + 1)).reshape(n_along, n_around + 1, n_through + 1)
    pole = np.broadcast_to(ids.size + np.arange(n_through + 1), (1, n_around + 1, n_through + 1))
    grid = np.concatenate([ids, pole])
    if lines.full:
        grid = np.concatenate([grid, grid[:, :1]], axis=1)
    nodes = np.concatenate([points[:-1].reshape(-1, 3), points[-1, 0]])
    layers = (0.5 * (lines.through[1:] + lines.through[:-1])).astype(np.int64)
    skin = np.unique(grid[:, :, 0])
    nail = skin[finger.is_under_nail(nodes[skin])]
    symmetry = np.empty(0, dtype=np.int64) if lines.full else np.unique(grid[:, [0, -1]])
    return _mesh(nodes, grid, layers, lines.full, int(np.abs(lines.around_rad).argmin()), nail, symmetry)


def _finger_points(finger: Fingertip, lines: GridLines, around_rad: FloatArray) -> FloatArray:
    station, _, arc = _midline(finger)
    origins, directions = _rays(finger, np.interp(lines.along_mm, arc, station)[:, None], around_rad)
    skin = origins + finger.skin_distance_mm(origins, directions)[..., None] * directions
    bone = origins + finger.bone_distance_mm(origins, directions)[..., None] * directions
    inward = _inward(finger, skin, directions)
    borders = (0.0, *finger.layer_depths_mm)
    depth = np.interp(lines.through, np.arange(4.0), borders)[:, None]
    share = np.maximum(lines.through - 3.0, 0.0)[:, None]
    offset = skin[:, :, None] + depth * inward[:, :, None]
    return (1.0 - share) * offset + share * bone[:, :, None]


def _inward(finger: Fingertip, skin: FloatArray, rays: FloatArray) -> FloatArray:
    """Directions (..., 3) in which layers are offset; their component along the inward normal is 1."""
    # On the volar side that is the inward normal. At the lateral ridge, y = 0, the skin turns within a radius
    # smaller than its layers are thick, so normals would meet: from the height of the bone's axis up to y = 0
    # they turn towards the rays.
    normal = finger.skin_normal(skin)
    height = np.clip(1.0 - skin[..., 1:2] / finger.spine_y_mm, 0.0, 1.0)
    share = _TURN_TO_RAYS * height**2 * (3.0 - 2.0 * height)
    outward = (1.0 - share) * normal + share * rays
    return -outward / (outward * normal).sum(axis=-1, keepdims=True)
