"""Exact signed distance to triangles and its gradient, by a tree of boxes; hollow creases are filled.

The triangles are sorted along a Morton curve; the boxes form a complete binary tree over groups of them, node
i having the children 2 i and 2 i + 1. The sign is that of the angle-weighted normal at the closest point
(Bærentzen & Aanæs 2005, DOI 10.1109/TVCG.2005.49), so that open surfaces have sides as well.

In front of a hollow crease the normal of the exact distance d jumps, by an angle θ. The gap is

    f(p) = d(p) - sum over hollow edges of 2 tan(θ/2) ∫ G(|c - x|) dx,   c the closest point,
    G(ρ) = (ln(1/ρ) - 3/4 + ρ² - ρ⁴/4) / 2π for ρ < 1, lengths over `radius_mm`.

G solves ΔG = w - δ, w = 2 (1 - ρ²)/π. The Laplacian of a height function of flat pieces lies on its edges,
so to first order in θ the sum is what a moving average with the weight w changes there: f has no crease.
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from numba import njit
from scipy.sparse import coo_array
from scipy.sparse.csgraph import connected_components

from fingerpad.core.threads import run_kernel
from fingerpad.core.values import FloatArray, IntArray, PointsMm

_LEAF = 4  # Triangles in a box without children.

FAR_MM, ENOUGH_BOXES = 2.0, 200
"""Farther above a surface the nearest triangle of so many boxes is near enough: in a hollow all are as far.
[mm], [1]"""

_ON_SURFACE_MM = 1e-9

_LEAST_RAD, _LEAST_MM, _LEAST_SHARE = 2e-4, 1e-6, 0.5
"""Least angle of a hollow crease, least height of the far corner of each triangle above the other, and least
share of the sharpest ridge beside it: files round their numbers, and on a round top of triangles diagonals
are hollow by a little. [rad], [mm], [1]"""


@dataclass(frozen=True)
class Triangles:
    """Triangles in a tree, ready for distances."""

    corners_mm: FloatArray
    """Corners, sorted; the last triangle fills the slots that are left, (n_slots, 3, 3). [mm]"""
    normals: FloatArray
    """Outward normals at the three corners, on the three edges (opposite to each corner) and on the face,
    (n_slots, 7, 3)."""
    low_mm: FloatArray
    high_mm: FloatArray  #: Boxes; the first is not used, (n_boxes, 3). [mm]
    turns: FloatArray
    """tan(θ/2) of the edges, opposite to each corner, that are hollow creases; 0 of others, (n_slots, 3)."""
    radius_mm: float  #: Distance over which hollow creases are filled; 0 if there are none. [mm]
    rows: IntArray  #: Row of each among the triangles that were given, (n_slots,).

    @classmethod
    def of(
        cls, vertices_mm: FloatArray, faces: IntArray, smooth_below_deg: float = 0.0, radius_mm: float = 0.0
    ) -> Triangles:
        """Sort triangles into a tree, without those that are lines or points.

        Hollow creases below an angle are filled over `radius_mm`, or three of their usual lengths if that is
        less: the work grows with the number of triangles within.
        """
        first, second, third = vertices_mm[faces].transpose(1, 0, 2)
        rows = np.flatnonzero((np.cross(second - first, third - first) != 0.0).any(axis=1))
        faces = faces[rows]
        corners = vertices_mm[faces]
        order = np.argsort(_morton(corners.mean(axis=1)), kind="stable")
        slots = _LEAF << max(0, int(np.ceil(np.log2(max(1.0, len(faces) / _LEAF)))))
        order = np.concatenate([order, np.full(slots - len(order), order[-1])])
        sides = Sides.of(faces)
        normals = _normals(corners, faces, _opposite(sides.edge), len(vertices_mm))
        turns = _hollow_turns(corners, normals[:, 6], sides.pairs(), smooth_below_deg)
        lengths = np.linalg.norm(np.roll(corners, -1, axis=1) - np.roll(corners, -2, axis=1), axis=2)
        radius_mm = min(radius_mm, 3.0 * float(np.median(lengths[turns > 0.0]))) if turns.any() else 0.0
        turns = turns[order]
        turns[len(faces) :] = 0.0  # copies of the last triangle
        corners, normals = corners[order], normals[order]
        n_leaves = slots // _LEAF
        low, high = np.empty((2, 2 * n_leaves, 3))
        grouped = corners.reshape(n_leaves, 3 * _LEAF, 3)
        low[n_leaves:], high[n_leaves:] = grouped.min(axis=1), grouped.max(axis=1)
        level = n_leaves // 2
        while level:
            children = slice(2 * level, 4 * level)
            low[level : 2 * level] = low[children].reshape(level, 2, 3).min(axis=1)
            high[level : 2 * level] = high[children].reshape(level, 2, 3).max(axis=1)
            level //= 2
        return cls(corners, normals, low, high, turns, radius_mm, rows[order])

    def top(self, points_mm: PointsMm) -> tuple[FloatArray, np.ndarray]:
        """Height y of the highest triangle above or below each point (n, 3), -inf beside all; slot. [mm]"""
        points_mm = np.ascontiguousarray(points_mm, dtype=np.float64)
        height, slot = np.empty(len(points_mm)), np.empty(len(points_mm), dtype=np.int64)
        run_kernel(_top, len(points_mm), points_mm, self.corners_mm, self.low_mm, self.high_mm, height, slot)
        return height, slot

    def gap(self, points_mm: PointsMm) -> tuple[FloatArray, FloatArray]:
        """Signed distance (n,) and its gradient (n, 3) at points (n, 3). [mm]

        On the surface the gradient is the normal of a face, or the mean normal of an edge or a corner.
        """
        return self._gaps(points_mm)[:2]

    def closest(self, points_mm: PointsMm) -> tuple[IntArray, FloatArray]:
        """Row of the triangle closest to each point, and its closest point, (n,) and (n, 3), unfilled."""
        gap, normal, slot = self._gaps(points_mm)
        return self.rows[slot], points_mm - gap[:, None] * normal

    def _gaps(self, points_mm: PointsMm) -> tuple[FloatArray, FloatArray, IntArray]:
        points_mm = np.ascontiguousarray(points_mm, dtype=np.float64)
        gap, normal = np.empty(len(points_mm)), np.empty((len(points_mm), 3))
        slot = np.empty(len(points_mm), dtype=np.int64)
        run_kernel(
            _gaps, len(points_mm), points_mm, self.corners_mm, self.normals, self.low_mm, self.high_mm,
            self.turns, self.radius_mm, gap, normal, slot,
        )  # fmt: skip
        return gap, normal, slot


def _morton(points: FloatArray) -> IntArray:
    """Place of each point along a curve that fills the box of all, 10 bits per axis."""
    low, extent = points.min(axis=0), np.ptp(points, axis=0)
    cells = ((points - low) / np.where(extent > 0.0, extent, 1.0) * 1023.0).astype(np.int64)
    code = np.zeros(len(points), dtype=np.int64)
    for bit in range(10):
        for axis in range(3):
            code |= ((cells[:, axis] >> bit) & 1) << (3 * bit + axis)
    return code


def groups(pairs: IntArray, count: int) -> IntArray:
    """Group of each of `count` things that pairs (2, n) join."""
    links = coo_array((np.ones(pairs.shape[1], dtype=np.int8), tuple(pairs)), shape=(count, count))
    return connected_components(links, directed=False)[1].astype(np.int64)


@dataclass(frozen=True)
class Sides:
    """Sides of triangles: first those from the first corners to the second ones, then the others in turn."""

    begin: IntArray
    end: IntArray
    edge: IntArray  #: Number of the edge, which neighbours share.
    count: IntArray  #: How many sides this edge has.

    @classmethod
    def of(cls, faces: IntArray) -> Sides:
        a, b = faces.T.ravel(), faces[:, [1, 2, 0]].T.ravel()
        keys = np.minimum(a, b) * (int(faces.max(initial=0)) + 1) + np.maximum(a, b)
        _, edge, count = np.unique(keys, return_inverse=True, return_counts=True)
        return cls(a, b, edge, count[edge])

    def pairs(self) -> IntArray:
        """Both sides of each edge that has two, (2, n)."""
        order = np.argsort(self.edge, kind="stable")
        return order[self.count[order] == 2].reshape(-1, 2).T


def _opposite(sides: np.ndarray) -> np.ndarray:
    """Values of sides by the corners opposite to them, (n_triangles, 3)."""
    return sides.reshape(3, -1).T[:, [1, 2, 0]]


def _normals(corners: FloatArray, faces: IntArray, edge: IntArray, n_vertices: int) -> FloatArray:
    """Return normals at corners, edges and face of each triangle, (n, 7, 3), the face's of length 1."""
    first, second, third = corners.transpose(1, 0, 2)
    face = np.cross(second - first, third - first)
    face /= np.linalg.norm(face, axis=1)[:, None]
    at_vertex = np.zeros((n_vertices, 3))
    for corner in range(3):
        here, ahead, behind = (corners[:, (corner + step) % 3] for step in range(3))
        one, other = ahead - here, behind - here
        lengths = np.linalg.norm(one, axis=1) * np.linalg.norm(other, axis=1)
        angle = np.arccos(np.clip((one * other).sum(axis=1) / lengths, -1.0, 1.0))
        for axis in range(3):
            at_vertex[:, axis] += np.bincount(faces[:, corner], angle * face[:, axis], n_vertices)
    at_edge = np.stack([np.bincount(edge.ravel(), np.repeat(face[:, axis], 3)) for axis in range(3)], axis=1)
    return np.concatenate([at_vertex[faces], at_edge[edge], face[:, None]], axis=1)


def _hollow_turns(
    corners: FloatArray, face_normals: FloatArray, pairs: IntArray, smooth_below_deg: float
) -> FloatArray:
    """tan(θ/2) of each edge of each triangle (opposite to its corner) that is filled, 0 of others, (n, 3)."""
    (at, one), (beyond, other) = (divmod(sides, len(corners)) for sides in pairs)
    beside = corners[one, at]
    cross = np.linalg.norm(np.cross(face_normals[one], face_normals[other]), axis=1)
    angle = np.arctan2(cross, (face_normals[one] * face_normals[other]).sum(axis=1))
    rise = (face_normals[one] * (corners[other, beyond - 1] - beside)).sum(axis=1)
    back = (face_normals[other] * (corners[one, at - 1] - beside)).sum(axis=1)
    hollow = np.minimum(rise, back) > _LEAST_MM
    soft = angle < np.deg2rad(smooth_below_deg)
    ridge = np.zeros(len(corners))
    for side in (one, other):
        np.maximum.at(ridge, side, np.where(soft & ~hollow, angle, 0.0))
    least = np.maximum(_LEAST_RAD, _LEAST_SHARE * np.maximum(ridge[one], ridge[other]))
    turns = np.zeros(3 * len(corners))
    turns[pairs] = np.where(soft & hollow & (angle > least), np.tan(angle / 2), 0.0)
    return _opposite(turns)


@njit(cache=True, nogil=True)
def _to_triangle(p: FloatArray, corners: FloatArray) -> tuple[float, float, float, float, int]:
    """Closest point of a triangle and its feature: 0-2 a corner, 3-5 the edge opposite to it, 6 the face."""
    a, b, c = corners[0], corners[1], corners[2]
    ab0, ab1, ab2 = b[0] - a[0], b[1] - a[1], b[2] - a[2]
    ac0, ac1, ac2 = c[0] - a[0], c[1] - a[1], c[2] - a[2]
    ap0, ap1, ap2 = p[0] - a[0], p[1] - a[1], p[2] - a[2]
    d1, d2 = ab0 * ap0 + ab1 * ap1 + ab2 * ap2, ac0 * ap0 + ac1 * ap1 + ac2 * ap2
    abab, abac = ab0 * ab0 + ab1 * ab1 + ab2 * ab2, ab0 * ac0 + ab1 * ac1 + ab2 * ac2
    acac = ac0 * ac0 + ac1 * ac1 + ac2 * ac2
    d3, d4, d5, d6 = d1 - abab, d2 - abac, d1 - abac, d2 - acac
    va, vb, vc = d3 * d6 - d5 * d4, d5 * d2 - d1 * d6, d1 * d4 - d3 * d2
    if d1 <= 0.0 and d2 <= 0.0:
        v, w, feature = 0.0, 0.0, 0
    elif d3 >= 0.0 and d4 <= d3:
        v, w, feature = 1.0, 0.0, 1
    elif d6 >= 0.0 and d5 <= d6:
        v, w, feature = 0.0, 1.0, 2
    elif vc <= 0.0 and d1 >= 0.0 and d3 <= 0.0:
        v, w, feature = d1 / (d1 - d3), 0.0, 5
    elif vb <= 0.0 and d2 >= 0.0 and d6 <= 0.0:
        v, w, feature = 0.0, d2 / (d2 - d6), 4
    elif va <= 0.0 and d4 - d3 >= 0.0 and d5 - d6 >= 0.0:
        w = (d4 - d3) / ((d4 - d3) + (d5 - d6))
        v, feature = 1.0 - w, 3
    else:
        scale = 1.0 / (va + vb + vc)
        v, w, feature = vb * scale, vc * scale, 6
    x = ap0 - v * ab0 - w * ac0
    y = ap1 - v * ab1 - w * ac1
    z = ap2 - v * ab2 - w * ac2
    return x * x + y * y + z * z, x, y, z, feature


@njit(cache=True, nogil=True)
def _to_box(p: FloatArray, low: FloatArray, high: FloatArray) -> float:
    total = 0.0
    for axis in range(3):
        beyond = max(low[axis] - p[axis], p[axis] - high[axis], 0.0)
        total += beyond * beyond
    return total


@njit(cache=True, nogil=True)
def _top(
    points: FloatArray, corners: FloatArray, low: FloatArray, high: FloatArray, height: FloatArray,
    slot: np.ndarray, begin: int, end: int,
) -> None:  # fmt: skip  # pragma: no cover (compiled)
    stack = np.empty(64, dtype=np.int64)
    for number in range(begin, end):
        height[number], slot[number] = _highest(points[number], corners, low, high, stack)


@njit(cache=True, nogil=True)
def _highest(
    p: FloatArray, corners: FloatArray, low: FloatArray, high: FloatArray, stack: np.ndarray
) -> tuple[float, int]:  # pragma: no cover (compiled)
    """Height and slot of the highest triangle above or below a point, -inf and -1 beside all."""
    n_leaves = len(low) // 2
    height, found = -np.inf, -1
    stack[0], top = 1, 1
    while top:
        top -= 1
        box = stack[top]
        beside = p[0] < low[box, 0] or p[0] > high[box, 0] or p[2] < low[box, 2] or p[2] > high[box, 2]
        if beside or high[box, 1] <= height:
            continue
        if box < n_leaves:
            stack[top], stack[top + 1] = 2 * box, 2 * box + 1
            top += 2
            continue
        for slot in range((box - n_leaves) * _LEAF, (box - n_leaves + 1) * _LEAF):
            a, b, c = corners[slot, 0], corners[slot, 1], corners[slot, 2]
            abx, abz, acx, acz = b[0] - a[0], b[2] - a[2], c[0] - a[0], c[2] - a[2]
            area = abx * acz - abz * acx
            if area == 0.0:
                continue
            x, z = p[0] - a[0], p[2] - a[2]
            v, w = (x * acz - z * acx) / area, (abx * z - abz * x) / area
            y = a[1] + v * (b[1] - a[1]) + w * (c[1] - a[1])
            if v >= -1e-9 and w >= -1e-9 and v + w <= 1.0 + 1e-9 and y > height:
                height, found = y, slot
    return height, found


@njit(cache=True, nogil=True)
def _gaps(
    points: FloatArray, corners: FloatArray, normals: FloatArray, low: FloatArray, high: FloatArray,
    turns: FloatArray, radius: float, gap: FloatArray, normal: FloatArray, slots: np.ndarray,
    begin: int, end: int,
) -> None:  # fmt: skip  # pragma: no cover (compiled)
    n_leaves = len(low) // 2
    stack, path = np.empty((2, 64), dtype=np.int64)
    closest, slope = np.empty(3), np.empty(3)
    last = 0.0
    for number in range(begin, end):
        p, n = points[number], normal[number]
        nearest = np.inf
        if number > begin:  # a neighbour's distance bounds this one
            apart = np.sqrt(((p - points[number - 1]) ** 2).sum())
            bound = (last + apart) ** 2 * (1.0 + 1e-9) + 1e-18
            if bound < nearest:  # not if one of them is no number
                nearest = bound
        found, feature, looked, above = 0, 6, 0, False
        n[0], n[1], n[2] = 0.0, 1.0, 0.0
        stack[0], top = 1, 1
        while top:
            top -= 1
            box = stack[top]
            if _to_box(p, low[box], high[box]) > nearest:
                continue
            if box < n_leaves:
                one = _to_box(p, low[2 * box], high[2 * box])
                other = _to_box(p, low[2 * box + 1], high[2 * box + 1])
                nearer = 2 * box if one <= other else 2 * box + 1
                stack[top], stack[top + 1] = 4 * box + 1 - nearer, nearer
                top += 2
                continue
            for slot in range((box - n_leaves) * _LEAF, (box - n_leaves + 1) * _LEAF):
                squared, x, y, z, at = _to_triangle(p, corners[slot])
                if squared <= nearest:
                    nearest, found, feature = squared, slot, at
                    n[0], n[1], n[2] = x, y, z
            looked += 1
            if looked == ENOUGH_BOXES and nearest > FAR_MM**2:
                above = p[1] > _highest(p, corners, low, high, path)[0]
                if above:
                    break
        last, slots[number] = np.sqrt(nearest), found
        for axis in range(3):
            closest[axis] = p[axis] - n[axis]
        mean = normals[found, feature]
        side = 1.0 if above or (n * mean).sum() >= 0.0 else -1.0
        gap[number] = side * last
        filled = last < radius
        in_crease = filled and 3 <= feature < 6 and turns[found, feature - 3] > 0.0
        if in_crease or last <= _ON_SURFACE_MM:
            n[:] = mean / np.sqrt((mean**2).sum())
        else:
            n *= side / last
        if not filled:
            continue
        fill = _fill(closest, corners, low, high, turns, radius, stack, slope)
        if fill == 0.0:
            continue
        fade = 1.0 - (last / radius) ** 4
        if feature == 6:
            slope -= (slope * normals[found, 6]).sum() * normals[found, 6]
        elif feature < 3:
            slope[:] = 0.0
        else:
            way = corners[found, (feature - 1) % 3] - corners[found, (feature - 2) % 3]
            slope[:] = (slope * way).sum() / (way * way).sum() * way
        # f = d - fade² fill
        steep = 1.0 + 8.0 * fade * gap[number] ** 3 / radius**4 * fill
        n *= steep
        n -= fade * fade * slope
        n /= np.sqrt((n * n).sum())
        gap[number] -= fade * fade * fill


@njit(cache=True, nogil=True)
def _fill(
    c: FloatArray, corners: FloatArray, low: FloatArray, high: FloatArray, turns: FloatArray, radius: float,
    stack: np.ndarray, slope: FloatArray,
) -> float:  # fmt: skip  # pragma: no cover (compiled)
    """Height by which hollow creases are filled at a point c of the surface, and its gradient in `slope`."""
    n_leaves = len(low) // 2
    total = 0.0
    slope[:] = 0.0
    stack[0], top = 1, 1
    while top:
        top -= 1
        box = stack[top]
        if _to_box(c, low[box], high[box]) >= radius * radius:
            continue
        if box < n_leaves:
            stack[top], stack[top + 1] = 2 * box, 2 * box + 1
            top += 2
            continue
        for slot in range((box - n_leaves) * _LEAF, (box - n_leaves + 1) * _LEAF):
            for edge in range(3):
                turn = turns[slot, edge]
                if turn == 0.0:
                    continue
                a, b = corners[slot, (edge + 1) % 3], corners[slot, (edge + 2) % 3]
                length, along, apart = 0.0, 0.0, 0.0
                for axis in range(3):
                    length += (b[axis] - a[axis]) ** 2
                    along += (c[axis] - a[axis]) * (b[axis] - a[axis])
                    apart += (c[axis] - a[axis]) ** 2
                length = np.sqrt(length)
                along /= length
                s2 = max(apart - along * along, 0.0) / radius**2
                if s2 >= 1.0:
                    continue
                # ∫ G dt and its slopes, t from -along to length - along within the ball, all over radius.
                s, reach = max(np.sqrt(s2), 1e-9), np.sqrt(1.0 - s2)
                value, across, ahead = 0.0, 0.0, 0.0
                for sign, end in ((-1.0, -along), (1.0, length - along)):
                    t = min(reach, max(-reach, end / radius))
                    r2, turned = s2 + t * t + 1e-18, np.arctan2(t, s)
                    value += sign * (
                        t * (0.25 - 0.5 * np.log(r2) + s2 - 0.25 * s2 * s2)
                        - s * turned + t**3 / 3.0 * (1.0 - 0.5 * s2) - t**5 / 20.0
                    )  # fmt: skip
                    across += sign * (-turned + 2.0 * s * t - s * (s2 * t + t**3 / 3.0))
                    ahead -= sign * (-0.5 * np.log(r2) - 0.75 + r2 - 0.25 * r2 * r2)
                # Each of the two triangles at the edge adds tan(θ/2).
                total += turn * radius * value / (2.0 * np.pi)
                for axis in range(3):
                    way = (b[axis] - a[axis]) / length
                    off = (c[axis] - a[axis] - along * way) / (s * radius)
                    slope[axis] += turn / (2.0 * np.pi) * (across * off + ahead * way)
    return total
