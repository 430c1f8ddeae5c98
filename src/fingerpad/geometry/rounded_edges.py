"""Rounded edges of any body: its part that a ball of the edges' radius can fill (a morphological opening).

The body is offset inwards by the radius and outwards again. The gap is then the distance to the inner body
less the radius, where the inner body is all points at least a radius deep. Its closest point is found with
cutting planes: each says that a point must be a radius deep below one place of the surface.
"""

from __future__ import annotations

from collections.abc import Callable

import numpy as np
from numba import njit

from fingerpad.core.checks import FloatArray
from fingerpad.core.errors import InputError

Gap = Callable[[FloatArray], tuple[FloatArray, FloatArray]]

MOST_PLANES = 10
"""Most planes below which one point must lie: an edge has two, a corner three, rounded ones a few more."""

NEAR_MM = 1.5
"""Farther points keep the distance to the sharp body, which is less. [mm]"""

_DEEP_ENOUGH = 1e-6
"""Depth that may be missing to the radius, over the radius."""


def check_edge_radius(radius_mm: float, narrowest_mm: float) -> None:
    """Raise `InputError` if edges of this radius do not fit the narrowest part [mm]."""
    if radius_mm > narrowest_mm / 2 * (1.0 + 1e-9):
        raise InputError(
            f"edge_radius_mm must not exceed half of the narrowest part, {narrowest_mm / 2:.3g} mm: got "
            f"{radius_mm:g} mm."
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
    """Closest point below all planes; one, two or three of them touch it."""
    count = depths.shape[1]
    chosen, weights = np.empty(3, dtype=np.int64), np.zeros(3)
    for row in range(len(points)):
        p, n, d = points[row], planes[row], depths[row]
        scale = 1e-9 * (1.0 + np.abs(p).max())
        best = np.inf
        for i in range(count):
            for j in range(i, count):
                for k in range(j, count):
                    if i == j and j != k:
                        continue  # (i, i, i) is one plane, (i, j, j) are two, (i, j, k) three
                    chosen[0], chosen[1], chosen[2] = i, j, k
                    size = 1 if i == k else 2 if j == k else 3
                    if not _weights(p, n, d, chosen, size, weights):
                        continue
                    x, y, z = p[0], p[1], p[2]
                    for m in range(size):
                        x -= weights[m] * n[chosen[m], 0]
                        y -= weights[m] * n[chosen[m], 1]
                        z -= weights[m] * n[chosen[m], 2]
                    apart = (x - p[0]) ** 2 + (y - p[1]) ** 2 + (z - p[2]) ** 2
                    if apart >= best:
                        continue
                    above = False
                    for m in range(count):
                        above = above or n[m, 0] * x + n[m, 1] * y + n[m, 2] * z > d[m] + scale
                    if not above:
                        best, fits[row] = apart, True
                        nearest[row, 0], nearest[row, 1], nearest[row, 2] = x, y, z


@njit(cache=True, nogil=True)
def _weights(
    p: FloatArray, n: FloatArray, d: FloatArray, chosen: np.ndarray, size: int, weights: FloatArray
) -> bool:  # pragma: no cover (compiled)
    """Find the steps along normals to a point on all planes; return whether all lead inwards."""
    gram, above = np.zeros((3, 3)), np.zeros(3)
    for a in range(size):
        above[a] = -d[chosen[a]]
        for axis in range(3):
            above[a] += n[chosen[a], axis] * p[axis]
        for b in range(size):
            for axis in range(3):
                gram[a, b] += n[chosen[a], axis] * n[chosen[b], axis]
    for a in range(size, 3):
        gram[a, a] = 1.0
    c0 = gram[1, 1] * gram[2, 2] - gram[1, 2] * gram[2, 1]
    c1 = gram[1, 2] * gram[2, 0] - gram[1, 0] * gram[2, 2]
    c2 = gram[1, 0] * gram[2, 1] - gram[1, 1] * gram[2, 0]
    det = gram[0, 0] * c0 + gram[0, 1] * c1 + gram[0, 2] * c2
    if det < 1e-12:
        return False
    weights[0] = (
        above[0] * c0
        + gram[0, 1] * (gram[1, 2] * above[2] - above[1] * gram[2, 2])
        + gram[0, 2] * (above[1] * gram[2, 1] - gram[1, 1] * above[2])
    ) / det
    weights[1] = (
        gram[0, 0] * (above[1] * gram[2, 2] - gram[1, 2] * above[2])
        + above[0] * c1
        + gram[0, 2] * (gram[1, 0] * above[2] - above[1] * gram[2, 0])
    ) / det
    weights[2] = (
        gram[0, 0] * (gram[1, 1] * above[2] - above[1] * gram[2, 1])
        + gram[0, 1] * (above[1] * gram[2, 0] - gram[1, 0] * above[2])
        + above[0] * c2
    ) / det
    return min(weights[0], weights[1], weights[2]) >= -1e-12
