"""Width of the narrowest part of a face, which a mesh must resolve, and rounded edges of any body.

Rounded, a body is its part that a ball of the edges' radius can fill (a morphological opening). The body is
offset inwards by the radius and outwards again. The gap is then the distance to the inner body less the
radius, where the inner body is all points at least a radius deep. Its closest point is found with cutting
planes: each says that a point must be a radius deep below one place of the surface.
"""

from __future__ import annotations

from collections.abc import Callable, Iterator

import numpy as np
from numba import njit
from scipy.ndimage import grey_closing, grey_dilation, grey_erosion, grey_opening, label, map_coordinates

from fingerpad.core.errors import InputError
from fingerpad.core.values import FloatArray

REACH_MM = 6.0
"""Ridges, grooves and dots are looked for within this distance of the axis, along and across. [mm]"""

PIXELS = 480  # Heights of the face along each side of that square, or of the body where it is smaller.

PIXELS_PER_FEATURE = 4
"""Heights across the narrowest ridge, groove or dot that can be found; wider ones are sought with up to four
times as many."""

WIDTHS_MM = (0.1, 0.15, 0.2, 0.3, 0.4, 0.5, 0.6, 0.8, 1.0, 1.25, 1.5, 1.75, 2.0)
"""Widths of ridges, grooves and dots that are looked for. [mm]"""

RELIEF_MM = 2.0  # Depth below the highest point within which they are looked for. [mm]

RELIEF_SHARE = 0.2
"""A ridge or dot is as high, over its width, or more; a ball's cap of the same width is lower."""

TOUCHED_MM = 1.0
"""Depth below the highest point down to which tops of ridges and dots, and rims of grooves, count. [mm]"""

LEAST_MM = 0.05
"""Height of a ridge or dot, and depth of a groove, at least: what is lower is the noise of a scan. [mm]"""

REACHED_SHARE = 0.4
"""How deep skin goes into a groove at most, over its width: what is narrower below that is not touched."""

TIP_MM, TIP_SHARE = 0.5, 0.25
"""A ridge with slanted flanks is as wide as this far below its top [mm], or this share of its height; a
groove so far above its bottom."""

CORNER_SHARE = 0.4
"""A ridge, groove or dot covers this share of the disc; the tip of a corner between walls does not."""

CRACK_MM = 0.05  # Width of a crack, which skin does not enter. [mm]


def narrowest_relief(height_mm: FloatArray, spacing_mm: float, beside_mm: float) -> float:
    """Width of the narrowest ridge, groove or dot that skin touches, 2 mm if all are wider. [mm]

    It is the smallest width of a disc whose opening or closing of the face changes a height by more than
    0.2 of that width, apart from the outermost heights along walls and from slopes above 45 degrees,
    where triangles are ragged. What is sharp is measured a little beside its tip, and a groove as far down
    as skin reaches.
    """
    lowest = max(beside_mm, height_mm.max() - RELIEF_MM)
    crack = max(1, round(CRACK_MM / spacing_mm))
    height = np.pad(np.maximum(height_mm, lowest), crack, constant_values=lowest)
    height = grey_closing(height, crack, mode="nearest")[crack:-crack, crack:-crack]
    scales = list(_scales(spacing_mm))
    closings = []
    reached = np.full(height.shape, lowest)
    for width, thin, disc in scales:
        pad = 3 * (len(disc) // 2)
        part = np.pad(height[::thin, ::thin], pad, constant_values=lowest)
        closings.append((part, grey_closing(part, footprint=disc, mode="nearest")))
        filled = closings[-1][1][pad:-pad, pad:-pad]
        reached = np.maximum(reached, _refined(filled, thin, height.shape) - REACHED_SHARE * width)
    found = WIDTHS_MM[-1]
    ridge_mm, groove_mm = np.zeros((2, *height.shape))
    for (width, thin, disc), (part, closed) in zip(scales, closings, strict=True):
        radius = len(disc) // 2
        pad = 3 * radius
        # The opening of a square is rounder at its corners by 0.41 of the disc's radius.
        around = 2 * int(np.ceil(0.5 * radius)) + 1
        opened = grey_opening(part, footprint=disc, mode="nearest")
        floor = np.maximum(part, np.pad(reached[::thin, ::thin], pad, constant_values=lowest))
        ridges = part - grey_dilation(opened, around, mode="nearest")
        grooves = grey_erosion(closed, around, mode="nearest") - floor
        ridges[_is_steep(opened, thin * spacing_mm)] = 0.0
        grooves[_is_steep(closed, thin * spacing_mm)] = 0.0
        # On a slope that ends at the border the disc lies lower by the slope over its width.
        ridges -= 2 * radius * _slope_at_border(part, pad, 2 * radius)
        inner = slice(pad, -pad), slice(pad, -pad)
        for size, top, whole, tallest in (
            (ridges, part, part - opened, ridge_mm),
            (grooves, closed, closed - floor, groove_mm),
        ):
            np.maximum(tallest, _refined(whole[inner], thin, height.shape), out=tallest)
            tip = np.minimum(TIP_MM, TIP_SHARE * tallest[::thin, ::thin])
            counts = (size > max(RELIEF_SHARE * width, LEAST_MM)) & (top >= height.max() - TOUCHED_MM)
            large = label(counts[inner] & (size[inner] > tip))[0]
            if np.bincount(large.ravel())[1:].max(initial=0) >= CORNER_SHARE * disc.sum():
                found = width
    return found


def _scales(spacing_mm: float) -> Iterator[tuple[float, int, np.ndarray]]:
    """Widths that a grid resolves, the widest first, each with a step through the grid and a disc so wide."""
    for width in reversed(WIDTHS_MM):
        thin = max(1, round(width / spacing_mm) // PIXELS_PER_FEATURE**2)
        radius = round(width / spacing_mm / thin) // 2
        if 2 * radius >= PIXELS_PER_FEATURE:
            yield width, thin, np.hypot(*np.indices((2 * radius + 1,) * 2) - radius) <= radius + 0.5


def _refined(values: FloatArray, thin: int, shape: tuple[int, ...]) -> FloatArray:
    """Interpolate every `thin`-th value to a whole grid."""
    return np.asarray(map_coordinates(values, np.indices(shape) / thin, order=1, mode="nearest"))


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


Gap = Callable[[FloatArray], tuple[FloatArray, FloatArray]]

MOST_PLANES = 10
"""Most planes below which one point must lie: an edge has two, a corner three, rounded ones a few more."""

NEAR_MM = 1.5  # Farther points keep the distance to the sharp body, which is less. [mm]
_DEEP_ENOUGH = 1e-6  # Depth that may be missing to the radius, over the radius.


def check_edge_radius(radius_mm: float, narrowest_mm: float) -> None:
    """Raise `InputError` if edges of this radius do not fit the narrowest part [mm]."""
    if radius_mm > narrowest_mm / 2 * (1.0 + 1e-9):
        raise InputError(
            "edge_radius_mm",
            f"must not exceed half of the narrowest part, {narrowest_mm / 2:.3g} mm",
            f"{radius_mm:g} mm",
        )


def with_rounded_edges(sharp: Gap, points_mm: FloatArray, radius_mm: float) -> tuple[FloatArray, FloatArray]:
    """Gap and normal of a body whose convex edges and corners are rounded; hollows stay as they are."""
    gap, normal = sharp(points_mm)
    rows = np.flatnonzero((gap > -radius_mm) & (gap < NEAR_MM))
    points = np.ascontiguousarray(points_mm[rows], dtype=np.float64)
    straight = points - (gap[rows] + radius_mm)[:, None] * normal[rows]
    below = straight.copy()
    planes, depths = np.empty((len(rows), MOST_PLANES, 3)), np.empty((len(rows), MOST_PLANES))
    planes[:, 0] = normal[rows]
    depths[:, 0] = (normal[rows] * below).sum(axis=1)
    left = np.arange(len(rows))
    for count in range(1, MOST_PLANES):
        depth, outward = sharp(below[left])
        shallow = depth + radius_mm > _DEEP_ENOUGH * radius_mm
        left, depth, outward = left[shallow], depth[shallow], outward[shallow]
        if not left.size:
            break
        planes[left, count] = outward
        depths[left, count] = (outward * below[left]).sum(axis=1) - depth - radius_mm
        nearest, fits = below[left], np.zeros(left.size, dtype=bool)
        _nearest_below(points[left], planes[left, : count + 1], depths[left, : count + 1], nearest, fits)
        below[left] = nearest
        left = left[fits]
    offset = points - below
    length = np.linalg.norm(offset, axis=1)
    moved = np.flatnonzero((below != straight).any(axis=1) & (length > 0.0))
    gap, normal = gap.copy(), normal.copy()
    gap[rows[moved]], normal[rows[moved]] = length[moved] - radius_mm, offset[moved] / length[moved][:, None]
    return gap, normal


@njit(cache=True, nogil=True)
def _nearest_below(
    points: FloatArray, planes: FloatArray, depths: FloatArray, nearest: FloatArray, fits: np.ndarray
) -> None:  # pragma: no cover (compiled)
    """Closest point below all planes: the nearest foot on one, two or three that is below all."""
    count = depths.shape[1]
    for row in range(len(points)):
        p, n, d = points[row], planes[row], depths[row]
        most = d + 1e-9 * (1.0 + np.abs(p).max())
        best = np.inf
        for i in range(count):
            for j in range(i, count):
                for k in range(j, count):
                    if i == j and j != k:
                        continue  # (i, i, i) is one plane, (i, j, j) are two, (i, j, k) three
                    if i == k:
                        foot = p - ((n[i] * p).sum() - d[i]) * n[i]
                    else:
                        third, at = n[k], d[k]
                        if j == k:  # the plane through p at right angles to both
                            third = np.cross(n[i], n[j])
                            third /= max(1e-300, np.sqrt((third**2).sum()))
                            at = (third * p).sum()
                        line = np.cross(n[j], third)
                        det = (n[i] * line).sum()
                        if det * det < 1e-12:
                            continue
                        foot = d[i] * line + d[j] * np.cross(third, n[i]) + at * np.cross(n[i], n[j])
                        foot /= det
                    apart = ((foot - p) ** 2).sum()
                    if apart < best and (np.dot(n, foot) <= most).all():
                        best, fits[row] = apart, True
                        nearest[row] = foot
