"""Surfaces of triangles and height maps as rigid bodies, by the exact distance to their triangles.

The width of the narrowest ridge, groove or dot of a surface is measured, and a mesh must resolve it. Why the
distance is exact and not interpolated: docs/decisions/surfaces.md.
"""

from __future__ import annotations

from dataclasses import dataclass, fields
from functools import cached_property

import numpy as np
from numba import njit
from scipy.ndimage import grey_closing, grey_dilation, grey_erosion, grey_opening

from fingerpad.core.checks import FloatArray, IntArray, finite, float_array, positive
from fingerpad.core.errors import InputError
from fingerpad.geometry.closest_point import Triangles
from fingerpad.geometry.indenters import Indenter
from fingerpad.geometry.probing import traced_front

SMALLEST_MM, LARGEST_MM = 0.1, 1000.0
"""Extents beyond which a surface is refused: its unit must be wrong. [mm]"""

SKIRT_MM = 20.0
"""An open surface goes on downwards from its border as far as this. [mm]"""

SMOOTH_BELOW_DEG = 30.0
"""Angle of creases that are rounded where they are hollow, unless another is given. [degrees]"""

LARGEST_SMOOTH_DEG = 90.0
"""Largest such angle. [degrees]"""

HOLLOW_MM = 0.1
"""Distance from hollow creases over which they are rounded; less where triangles are small. [mm]"""

FAR_MM = 2.0
"""Beyond this distance above a surface its gap is this number: in a hollow all triangles are as far. [mm]"""

REACH_MM = 6.0
"""Ridges, grooves and dots are looked for within this distance of the axis, along and across. [mm]"""

PIXELS = 480
"""Heights of the face along each side of that square, or of the body where it is smaller."""

PIXELS_PER_FEATURE = 4
"""Heights across the narrowest ridge, groove or dot that can be found; wider ones are sought with up to four
times as many."""

WIDTHS_MM = (0.1, 0.15, 0.2, 0.3, 0.4, 0.5, 0.6, 0.8, 1.0, 1.25, 1.5, 1.75, 2.0)
"""Widths of ridges, grooves and dots that are looked for. [mm]"""

RELIEF_MM = 2.0
"""Depth below the highest point within which they are looked for. [mm]"""

RELIEF_SHARE = 0.2
"""A ridge or dot is as high, over its width, or more; a ball's cap of the same width is lower."""


@dataclass(frozen=True, eq=False, repr=False)
class Surface(Indenter):
    """A rigid body bounded by triangles, watertight or open, in the frame of indenters.

    Parameters
    ----------
    vertices_mm : array (n, 3)
        Corners of the triangles: x along the finger, y towards the skin, z across. The body is moved along y
        until its highest point is at y = 0. [mm]
    faces : int array (m, 3)
        Three corners each, counter-clockwise seen from outside. From the border of an open surface walls go
        down.
    smooth_below_deg : float
        Hollow creases at which the normals of two triangles differ by less are rounded over 0.1 mm to either
        side at most; 0 keeps all. Edges of a larger angle, and all ridges, stay as they are. [degrees]

    Raises
    ------
    InputError
        If vertices are not finite, faces name no vertex, no triangle has an area, the surface is larger than
        1000 mm or smaller than 0.1 mm (a wrong unit), neighbouring triangles turn different sides out, more
        than two share an edge, it shows the skin its inner side, or the angle is not from 0 to 90 degrees.

    Examples
    --------
    >>> square = np.array([[-5.0, 2.0, -5.0], [-5.0, 2.0, 5.0], [5.0, 2.0, 5.0], [5.0, 2.0, -5.0]])
    >>> plate = Surface(square, np.array([[0, 1, 2], [0, 2, 3]]))
    >>> plate
    Surface(2 triangles, 10 x 0 x 10 mm)
    >>> plate.gap(np.array([[1.0, 0.25, 2.0], [5.5, -1.0, 2.0]]))[0].tolist()
    [0.25, 0.5]
    """

    vertices_mm: FloatArray
    faces: IntArray
    smooth_below_deg: float = SMOOTH_BELOW_DEG

    def __post_init__(self) -> None:
        vertices = float_array("vertices_mm", self.vertices_mm, 2)
        faces = np.array(self.faces, dtype=np.int64)
        if vertices.shape[1] != 3 or faces.ndim != 2 or faces.shape[1] != 3 or not len(faces):
            raise InputError(
                f"A surface needs vertices (n, 3) and at least one triangle (m, 3): got {vertices.shape} and "
                f"{faces.shape}."
            )
        if faces.min() < 0 or faces.max() >= len(vertices):
            raise InputError(
                f"faces must hold numbers of vertices, 0 to {len(vertices) - 1}: got {faces.min()} to "
                f"{faces.max()}."
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
        kept = area > 1e-12 * extent**2
        if normal[kept, 1].max() <= 0.0:
            raise InputError(
                "A surface must show its outer side to the skin, towards +y: no triangle does; turn it over "
                "or reverse the order of the corners."
            )
        faces = faces[kept]
        _check_sides(faces, vertices)
        vertices = vertices - [0.0, corners[kept, :, 1].max(), 0.0]
        if not 0.0 <= finite("smooth_below_deg", self.smooth_below_deg, "degrees") <= LARGEST_SMOOTH_DEG:
            raise InputError(
                f"smooth_below_deg must be from 0 to {LARGEST_SMOOTH_DEG:g} degrees: got "
                f"{self.smooth_below_deg:g}."
            )
        for name, value in (("vertices_mm", vertices), ("faces", faces)):
            value.setflags(write=False)
            object.__setattr__(self, name, value)

    def __repr__(self) -> str:
        extents = " x ".join(f"{extent:.4g}" for extent in np.ptp(self.vertices_mm[self.faces], axis=(0, 1)))
        return f"Surface({len(self.faces)} triangles, {extents} mm)"

    def __getstate__(self) -> dict[str, np.ndarray]:
        # The tree is large and is made anew where it is needed.
        return {part.name: getattr(self, part.name) for part in fields(self)}

    @property
    def half_width_mm(self) -> float:
        """Half of the extent along x about the axis; infinite if it exceeds the finger. [mm]"""
        reach = float(np.abs(self.vertices_mm[self.faces, 0]).max())
        return reach if reach < 2 * REACH_MM else np.inf

    def mirrors(self, spin_deg: float) -> bool:
        """Whether the surface, turned by `spin_deg` about y, is its own mirror image across z = 0."""
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
        """Width of the narrowest ridge, groove or dot, 2 mm if all are wider. [mm]

        It is the smallest width of a disc whose opening or closing of the face changes a height by more than
        0.2 of that width, apart from the outermost heights along walls and from slopes above 45 degrees,
        where triangles are ragged.
        """
        height, spacing = self._face
        height = np.maximum(height, height.max() - RELIEF_MM)
        for width in WIDTHS_MM:
            thin = max(1, round(width / spacing) // PIXELS_PER_FEATURE**2)
            radius = round(width / spacing / thin) // 2
            if 2 * radius < PIXELS_PER_FEATURE:
                continue
            disc = np.hypot(*np.indices((2 * radius + 1,) * 2) - radius) <= radius + 0.5
            # The opening of a square is rounder at its corners by 0.41 of the disc's radius.
            around = 2 * int(np.ceil(0.5 * radius)) + 1
            part = np.pad(height[::thin, ::thin], 3 * radius, constant_values=height.min())
            opened = grey_opening(part, footprint=disc, mode="nearest")
            closed = grey_closing(part, footprint=disc, mode="nearest")
            ridges = part - grey_dilation(opened, around, mode="nearest")
            grooves = grey_erosion(closed, around, mode="nearest") - part
            ridges[_is_steep(opened, thin * spacing)] = 0.0
            grooves[_is_steep(closed, thin * spacing)] = 0.0
            # On a slope that ends at the border the disc lies lower by the slope over its width.
            ridges -= 2 * radius * _slope_at_border(part, 3 * radius, 2 * radius)
            if max(ridges.max(), grooves.max()) > RELIEF_SHARE * width:
                return width
        return WIDTHS_MM[-1]

    @cached_property
    def _triangles(self) -> Triangles:
        """Triangles and the walls below the border."""
        faces, n_vertices = self.faces, len(self.vertices_mm)
        sides = faces[:, [[0, 1], [1, 2], [2, 0]]].reshape(-1, 2)
        keys = sides.min(axis=1) * n_vertices + sides.max(axis=1)
        _, first, count = np.unique(keys, return_index=True, return_counts=True)
        a, b = sides[first[count == 1]].T
        walls = np.concatenate([
            np.stack([b, a, a + n_vertices], axis=1),
            np.stack([b, a + n_vertices, b + n_vertices], axis=1),
        ])  # fmt: skip
        below = self.vertices_mm - [0.0, SKIRT_MM, 0.0]
        vertices, faces = np.concatenate([self.vertices_mm, below]), np.concatenate([faces, walls])
        return Triangles.of(vertices, faces, self.smooth_below_deg, HOLLOW_MM, FAR_MM)

    @property
    def _face(self) -> tuple[FloatArray, float]:
        """Heights of the face over a grid of x and z, the lowest beside it, and their spacing. [mm]"""
        corners = self.vertices_mm[self.faces]
        low = np.maximum(corners.min(axis=(0, 1))[[0, 2]], -REACH_MM)
        high = np.minimum(corners.max(axis=(0, 1))[[0, 2]], REACH_MM)
        if (high <= low).any():
            raise InputError(
                f"A surface must lie within {REACH_MM:g} mm of the indenter's axis: it does not."
            )
        spacing = float((high - low).max()) / (PIXELS - 1)
        counts = np.floor((high - low) / spacing).astype(int) + 1
        height = np.full(tuple(counts), corners[..., 1].min())
        _raise_to_triangles(corners, low, spacing, height)
        return height, spacing

    def front(self, points_mm: FloatArray) -> FloatArray:
        """Height y of the face above the x and z of points (n, 3), -inf beside it. [mm]"""
        height = self._triangles.heights(points_mm)
        return traced_front(self.gap, points_mm, np.where(np.isfinite(height), height + HOLLOW_MM, -np.inf))

    def gap(self, points_mm: FloatArray) -> tuple[FloatArray, FloatArray]:
        """Signed gap (n,) and outward normal (n, 3) at points (n, 3) of the indenter's frame. [mm]"""
        return self._triangles.gap(points_mm)


def _check_sides(faces: IntArray, vertices_mm: FloatArray) -> None:
    """Raise an error unless neighbours turn the same side out and at most two triangles share an edge."""
    begin, end = faces.T, faces[:, [1, 2, 0]].T
    ways, count = np.unique(begin * len(vertices_mm) + end, return_counts=True)
    twice = ways[count > 1]
    if twice.size:
        x, y, z = 0.5 * (vertices_mm[twice[0] // len(vertices_mm)] + vertices_mm[twice[0] % len(vertices_mm)])
        raise InputError(
            "A surface must have two triangles at most along each edge, with their outer sides on one side: "
            f"{twice.size:,} edges do not, one at ({x:.4g}, {y:.4g}, {z:.4g}) mm; repair it, for example "
            "with trimesh.repair."
        )


def _is_steep(height: FloatArray, spacing: float) -> np.ndarray:
    """Whether the slope exceeds 45 degrees, (nx, nz)."""
    return np.hypot(*np.gradient(height, spacing)) > 1.0


def _slope_at_border(height: FloatArray, pad: int, zone: int) -> FloatArray:
    """Change of height per cell within a zone along the border inside of a pad, 0 elsewhere, (nx, nz)."""
    slope = np.zeros_like(height)
    for axis in (0, 1):
        before = np.abs(np.diff(height, axis=axis, prepend=np.inf))
        after = np.abs(np.diff(height, axis=axis, append=np.inf))
        slope = np.hypot(slope, np.minimum(before, after))
    slope[pad + zone : -pad - zone, pad + zone : -pad - zone] = 0.0
    return slope


@njit(cache=True, nogil=True)
def _raise_to_triangles(
    corners: FloatArray, low: FloatArray, spacing: float, height: FloatArray
) -> None:  # pragma: no cover (compiled)
    """Raise heights over a grid of x and z to the triangles above them."""
    for a, b, c in corners:
        abx, abz, acx, acz = b[0] - a[0], b[2] - a[2], c[0] - a[0], c[2] - a[2]
        area = abx * acz - abz * acx
        if area == 0.0:
            continue
        first_x = max(0, int(np.ceil((min(a[0], b[0], c[0]) - low[0]) / spacing - 1e-9)))
        last_x = min(height.shape[0] - 1, int(np.floor((max(a[0], b[0], c[0]) - low[0]) / spacing + 1e-9)))
        first_z = max(0, int(np.ceil((min(a[2], b[2], c[2]) - low[1]) / spacing - 1e-9)))
        last_z = min(height.shape[1] - 1, int(np.floor((max(a[2], b[2], c[2]) - low[1]) / spacing + 1e-9)))
        for i in range(first_x, last_x + 1):
            for k in range(first_z, last_z + 1):
                x, z = low[0] + i * spacing - a[0], low[1] + k * spacing - a[2]
                v, w = (x * acz - z * acx) / area, (abx * z - abz * x) / area
                if v >= -1e-9 and w >= -1e-9 and v + w <= 1.0 + 1e-9:
                    y = a[1] + v * (b[1] - a[1]) + w * (c[1] - a[1])
                    height[i, k] = max(height[i, k], y)


def height_surface(
    heights_mm: FloatArray, pitch_mm: float, smooth_below_deg: float = SMOOTH_BELOW_DEG
) -> Surface:
    """Surface through heights on a regular grid, centred on the indenter's axis.

    Parameters
    ----------
    heights_mm : array (n_rows, n_columns)
        Heights towards the skin; rows run across the finger (z), columns along it (x). [mm]
    pitch_mm : float
        Distance between neighbouring heights. [mm]
    smooth_below_deg : float
        As of `Surface`. [degrees]

    Returns
    -------
    Surface
        Two triangles per cell, and walls below the border.

    Raises
    ------
    InputError
        If there are fewer than 2 by 2 heights, or one is not finite.

    Examples
    --------
    >>> ripples = 0.2 * np.cos(np.arange(-5, 5.01, 0.1) * 2 * np.pi / 2.5) * np.ones((101, 1))
    >>> rippled = height_surface(ripples, pitch_mm=0.1)
    >>> rippled.front(np.array([[0.0, 0.0, 0.0], [1.25, 0.0, 3.0]])).round(2).tolist()
    [0.0, -0.4]
    """
    heights = float_array("heights_mm", heights_mm, 2)
    positive("pitch_mm", pitch_mm, "mm")
    rows, columns = heights.shape
    if min(rows, columns) < 2:
        raise InputError(f"heights_mm must have at least 2 rows and 2 columns: got {rows} and {columns}.")
    z, x = ((np.arange(count) - (count - 1) / 2) * pitch_mm for count in (rows, columns))
    vertices = np.stack([*np.broadcast_arrays(x[None, :], heights, z[:, None])], axis=-1).reshape(-1, 3)
    corner = np.arange(rows * columns).reshape(rows, columns)
    # Diagonals alternate, so that a symmetric map has symmetric triangles.
    a, b, c, d = corner[:-1, :-1], corner[1:, :-1], corner[1:, 1:], corner[:-1, 1:]
    even = np.add.outer(np.arange(rows - 1), np.arange(columns - 1)) % 2 == 0
    one, other = np.where(even, [a, b, c], [a, b, d]), np.where(even, [a, c, d], [b, c, d])
    faces = np.concatenate([each.reshape(3, -1).T for each in (one, other)])
    return Surface(vertices, faces, smooth_below_deg)
