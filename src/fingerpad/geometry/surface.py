"""Surfaces of triangles and height maps as rigid bodies, by the exact distance to their triangles.

Why the distance is exact and not interpolated: docs/decisions/surfaces.md.
"""

from __future__ import annotations

from dataclasses import fields
from functools import cached_property, partial
from typing import Annotated

import numpy as np

from fingerpad.core.checked import checked, value_class
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
    Positive,
    float_array,
    int_array,
    limits,
)
from fingerpad.geometry.indenters import Indenter
from fingerpad.geometry.probing import traced_front
from fingerpad.geometry.relief import (
    PIXELS,
    REACH_MM,
    check_edge_radius,
    narrowest_relief,
    with_rounded_edges,
)
from fingerpad.geometry.surface_repair import border_of, is_crack, layers_of, repaired, with_area
from fingerpad.geometry.triangles import Triangles

MOST_HEIGHTS = 2_000_000  # Heights of a map that become a body within about 20 s.

SMALLEST_MM, LARGEST_MM = 0.1, 1000.0
"""Extents beyond which a surface is refused: its unit must be wrong. [mm]"""

SKIRT_MM = 20.0  # An open surface goes on downwards from its border as far as this. [mm]

SMOOTH_BELOW_DEG = 30.0
"""Angle of creases that are rounded where they are hollow, unless another is given. [degrees]"""

LARGEST_SMOOTH_DEG = 90.0

HOLLOW_MM = 0.1
"""Distance from hollow creases over which they are rounded; less where triangles are small. [mm]"""


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
        vertices, faces, told = repaired(vertices, faces[area > 1e-12 * extent**2])
        vertices = vertices - [0.0, vertices[faces, 1].max(), 0.0]
        self.__dict__["repairs"] = told
        for name, value in (("vertices_mm", vertices), ("faces", faces)):
            value.setflags(write=False)
            object.__setattr__(self, name, value)
        if len(self._border) and self._shows_inner_side():
            raise InputError(
                "A surface must show its outer side to the skin, towards +y: it is open there or its sides "
                "are reversed; close it, turn it over, or reverse the order of the corners."
            )
        if told:
            LOGGER.warning("%r was repaired: %s.", self, "; ".join(told))
        if self.edge_radius_mm:
            check_edge_radius(self.edge_radius_mm, self.relief_mm)

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

    @property
    def half_width_mm(self) -> float:
        reach = float(np.abs(self.vertices_mm[self.faces, 0]).max())
        return reach if reach < 2 * REACH_MM else np.inf

    def mirrors(self, spin_deg: Finite) -> bool:
        found: dict[float, bool] = self.__dict__.setdefault("_mirrors", {})
        if spin_deg not in found:
            found[spin_deg] = super().mirrors(spin_deg)
        return found[spin_deg]

    @property
    def narrowest_mm(self) -> float:
        """Width of the narrowest ridge, groove or dot, 2 mm if all are wider. [mm]"""
        return self.relief_mm

    @cached_property
    def relief_mm(self) -> float:
        """Width of the narrowest ridge, groove or dot of its face, 2 mm if all are wider. [mm]"""
        # Beside a closed body is nothing; an open one is thought to go on at its lowest height.
        height, _, spacing = self._face
        return narrowest_relief(height, spacing, beside_mm=float(self.vertices_mm[self.faces, 1].min()))

    @cached_property
    def _border(self) -> IntArray:
        """Edges of one triangle alone: the triangle and its two corners, (n, 3)."""
        return border_of(self.faces)

    @cached_property
    def _layers(self) -> tuple[Triangles, ...]:
        """Triangles and the walls below the border; parts that overlap are in different ones."""
        layers, border, n_vertices = (
            layers_of(self.vertices_mm, self.faces),
            self._border,
            len(self.vertices_mm),
        )
        _, a, b = border[~is_crack(self.vertices_mm, self.faces, border)].T
        walls = np.column_stack([b, a, a + n_vertices, b, a + n_vertices, b + n_vertices]).reshape(-1, 3)
        vertices = np.concatenate([self.vertices_mm, self.vertices_mm - [0.0, SKIRT_MM, 0.0]])
        found = []
        for layer in range(int(layers.max()) + 1):
            faces = np.concatenate([self.faces[layers == layer], walls[: len(walls) * (layer == 0)]])
            faces = with_area(vertices, faces)
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
        if (hangs & upright & ~is_crack(self.vertices_mm, self.faces, self._border)).any():
            return True  # walls below the border would be its other side
        seen = self._face[1] < 0.0
        return bool((seen[1:, 1:] & seen[1:, :-1] & seen[:-1, 1:] & seen[:-1, :-1]).any())

    @cached_property
    def _face(self) -> tuple[FloatArray, FloatArray, float]:
        """Heights of the face over a grid of x and z, the lowest beside it; y of normals; spacing. [mm]"""
        corners = self.vertices_mm[self.faces]
        low, high = corners.min(axis=(0, 1)), corners.max(axis=(0, 1))
        (x0, _, z0), (x1, _, z1) = np.maximum(low, -REACH_MM), np.minimum(high, REACH_MM)
        if x1 <= x0 or z1 <= z0:
            raise InputError(
                f"A surface must lie within {REACH_MM:g} mm of the indenter's axis: it does not."
            )
        spacing = max(x1 - x0, z1 - z0) / (PIXELS - 1)
        x, z = np.arange(x0, x1 + 1e-9, spacing), np.arange(z0, z1 + 1e-9, spacing)
        points = np.stack(np.broadcast_arrays(x[:, None], 0.0, z), axis=-1)
        height, normal_y = self._top(points.reshape(-1, 3))
        shape = x.size, z.size
        return np.maximum(height, low[1]).reshape(shape), normal_y.reshape(shape), float(spacing)

    def _top(self, points_mm: FloatArray) -> tuple[FloatArray, FloatArray]:
        """Height of the highest triangle above or below each point, -inf beside all, and its normal's y."""
        heights, slots = zip(*(layer.top(points_mm) for layer in self._layers), strict=True)
        normals = [
            np.where(slot < 0, 1.0, layer.normals[slot, 6, 1])
            for layer, slot in zip(self._layers, slots, strict=True)
        ]
        highest = np.argmax(heights, axis=0)[None]
        return tuple(np.take_along_axis(np.array(each), highest, axis=0)[0] for each in (heights, normals))

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


def check_heights(name: str, heights: int) -> None:
    """Raise `InputError` if a map has more heights than become a body in reasonable time."""
    if heights > MOST_HEIGHTS:
        raise InputError(
            name,
            f"must have at most {MOST_HEIGHTS:,} heights",
            f"{heights:,}",
            "crop it or take every second row and column with twice the pitch",
        )


@checked
def height_surface(
    heights_mm: FloatArray,
    pitch_mm: Positive,
    smooth_below_deg: Finite = SMOOTH_BELOW_DEG,
    edge_radius_mm: Finite = 0.0,
) -> Surface:
    """Surface through heights on a regular grid, centred on the indenter's axis.

    Parameters
    ----------
    heights_mm : array (n_rows, n_columns)
        Heights towards the skin; rows run across the finger (z), columns along it (x). [mm]
    pitch_mm : float
        Distance between neighbouring heights. [mm]
    smooth_below_deg, edge_radius_mm : float
        As of `Surface`. [degrees], [mm]

    Examples
    --------
    >>> ripples = 0.2 * np.cos(np.arange(-5, 5.01, 0.1) * 2 * np.pi / 2.5) * np.ones((101, 1))
    >>> rippled = height_surface(ripples, pitch_mm=0.1)
    >>> rippled.front(np.array([[0.0, 0.0, 0.0], [1.25, 0.0, 3.0]])).round(2).tolist()
    [0.0, -0.4]
    """
    heights = float_array("heights_mm", heights_mm, 2)
    rows, columns = heights.shape
    if min(rows, columns) < 2:
        raise InputError("heights_mm", "must have at least 2 rows and 2 columns", f"{rows} and {columns}")
    check_heights("heights_mm", heights.size)
    z, x = ((np.arange(count) - (count - 1) / 2) * pitch_mm for count in (rows, columns))
    vertices = np.stack([*np.broadcast_arrays(x[None, :], heights, z[:, None])], axis=-1).reshape(-1, 3)
    corner = np.arange(rows * columns).reshape(rows, columns)
    # Diagonals alternate, so that a symmetric map has symmetric triangles.
    a, b, c, d = corner[:-1, :-1], corner[1:, :-1], corner[1:, 1:], corner[:-1, 1:]
    even = np.add.outer(np.arange(rows - 1), np.arange(columns - 1)) % 2 == 0
    one, other = np.where(even, [a, b, c], [a, b, d]), np.where(even, [a, c, d], [b, c, d])
    faces = np.concatenate([each.reshape(3, -1).T for each in (one, other)])
    return Surface(vertices, faces, smooth_below_deg, edge_radius_mm)
