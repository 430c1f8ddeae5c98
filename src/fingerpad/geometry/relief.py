"""Rounded edges of any body: its part that a ball of the edges' radius can fill (a morphological opening).

The body is offset inwards by the radius and outwards again. The gap is then the distance to the inner body
less the radius, where the inner body is all points at least a radius deep. Its closest point is found with
cutting planes: each says that a point must be a radius deep below one place of the surface.
"""

from __future__ import annotations

from collections.abc import Callable

import numpy as np
from numba import njit
from scipy.ndimage import distance_transform_edt, maximum_filter

from fingerpad.core.errors import InputError
from fingerpad.core.values import FloatArray
from fingerpad.geometry.indenters import Indenter
from fingerpad.geometry.size_field import BELOW_TOP_MM, NEAR_AXIS_MM, STEP_MM, face_of

Gap = Callable[[FloatArray], tuple[FloatArray, FloatArray]]

MOST_PLANES = 10
"""Most planes below which one point must lie: an edge has two, a corner three, rounded ones a few more."""

NEAR_MM = 1.5  # Farther points keep the distance to the sharp body, which is less. [mm]
_DEEP_ENOUGH = 1e-6  # Depth that may be missing to the radius, over the radius.


def check_edge_radius(sharp: Indenter, radius_mm: float) -> None:
    """Raise `InputError` if a part of the face is narrower than two radii: it would be lost."""
    face = face_of(sharp, 0.0, (NEAR_AXIS_MM, NEAR_AXIS_MM), STEP_MM)
    inside = distance_transform_edt(
        np.pad(face.front_mm >= face.front_mm.max() - BELOW_TOP_MM, 1, mode="edge")
    )
    middles = ((inside > 0.0) & (inside == maximum_filter(inside, 3)))[1:-1, 1:-1]
    i, k = np.nonzero(middles)
    depth_mm = -sharp.gap(np.column_stack([face.x_mm[i], face.front_mm[i, k] - radius_mm, face.z_mm[k]]))[0]
    if (depth_mm < radius_mm - 0.75 * STEP_MM).any():
        raise InputError(
            "edge_radius_mm",
            f"must not exceed half of the narrowest part, {depth_mm.min():.3g} mm",
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
