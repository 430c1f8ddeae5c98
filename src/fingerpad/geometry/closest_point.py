"""Exact signed distance to triangles and its gradient, by a tree of boxes.

The triangles are sorted along a Morton curve; the boxes form a complete binary tree over groups of them, node
i having the children 2 i and 2 i + 1. The sign is that of the angle-weighted normal at the closest point
(Bærentzen & Aanæs 2005, DOI 10.1109/TVCG.2005.49), so that open surfaces have sides as well.
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from numba import njit

from fingerpad.core.threads import run_kernel
from fingerpad.core.values import FloatArray, IntArray, PointsMm
from fingerpad.geometry.creases import HOLLOW, SHARP, kinds_of_edges, moments_in_ball, share_of_edges

_LEAF = 4  # Triangles in a box without children.
_COPY = -1  # Kind of the edges of a triangle that fills a slot a second time.
SHARP_SHARE = 1.5  # Distance from sharp edges from which on creases are blunted, over the radius.

_ON_SURFACE_MM = 1e-9


@dataclass(frozen=True)
class Triangles:
    """Triangles in a tree, ready for distances."""

    corners_mm: FloatArray
    """Corners, sorted; the last triangle fills the slots that are left, (n_slots, 3, 3). [mm]"""
    normals: FloatArray
    """Outward normals at the three corners, on the three edges (opposite to each corner) and on the face,
    (n_slots, 7, 3)."""
    low_mm: FloatArray
    high_mm: FloatArray  # Boxes; the first is not used, (n_boxes, 3). [mm]
    kinds: np.ndarray  # Kinds of edges (`fingerpad.geometry.creases`), opposite to each corner, (n_slots, 3).
    hollow: np.ndarray  # Whether a box has triangles with hollow creases, (n_boxes,).
    radius_mm: float  # Distance over which hollow creases are blunted. [mm]
    far_mm: float
    """Distance beyond which points above the triangles have this one, along y; it need not be sought. [mm]"""

    @classmethod
    def of(
        cls,
        vertices_mm: FloatArray,
        faces: IntArray,
        smooth_below_deg: float = 0.0,
        radius_mm: float = 0.0,
        far_mm: float = np.inf,
    ) -> Triangles:
        """Sort triangles with area into a tree.

        Hollow creases below an angle are blunted over `radius_mm`, or three of their usual lengths if that is
        less: the work grows with the number of triangles within.
        """
        corners = vertices_mm[faces]
        order = np.argsort(_morton(corners.mean(axis=1)), kind="stable")
        slots = _LEAF << max(0, int(np.ceil(np.log2(max(1.0, len(faces) / _LEAF)))))
        order = np.concatenate([order, np.full(slots - len(order), order[-1])])
        edge = _edges(faces, len(vertices_mm))
        normals = _normals(corners, faces, edge, len(vertices_mm))
        kinds = kinds_of_edges(corners, normals[:, 6], edge, smooth_below_deg)[order]
        if (kinds == HOLLOW).any():
            sides = np.linalg.norm(np.roll(corners, -1, axis=1) - np.roll(corners, -2, axis=1), axis=2)[order]
            radius_mm = min(radius_mm, 3.0 * float(np.median(sides[kinds == HOLLOW])))
        kinds[len(faces) :] = _COPY
        corners, normals = corners[order], normals[order]
        n_leaves = slots // _LEAF
        low, high = np.empty((2, 2 * n_leaves, 3))
        grouped = corners.reshape(n_leaves, 3 * _LEAF, 3)
        low[n_leaves:], high[n_leaves:] = grouped.min(axis=1), grouped.max(axis=1)
        hollow = np.empty(2 * n_leaves, dtype=bool)
        hollow[n_leaves:] = (kinds.reshape(n_leaves, 3 * _LEAF) == HOLLOW).any(axis=1)
        level = n_leaves // 2
        while level:
            children = slice(2 * level, 4 * level)
            low[level : 2 * level] = low[children].reshape(level, 2, 3).min(axis=1)
            high[level : 2 * level] = high[children].reshape(level, 2, 3).max(axis=1)
            hollow[level : 2 * level] = hollow[children].reshape(level, 2).any(axis=1)
            level //= 2
        return cls(corners, normals, low, high, kinds, hollow, radius_mm, far_mm)

    def heights(self, points_mm: FloatArray) -> FloatArray:
        """Height y of the highest triangle above or below each point (n, 3), -inf beside all. [mm]"""
        points_mm = np.ascontiguousarray(points_mm, dtype=np.float64)
        height = np.empty(len(points_mm))
        run_kernel(_heights, len(points_mm), points_mm, self.corners_mm, self.low_mm, self.high_mm, height)
        return height

    def gap(self, points_mm: PointsMm) -> tuple[FloatArray, FloatArray]:
        """Signed distance (n,) and its gradient (n, 3) at points (n, 3). [mm]

        On the surface the gradient is the normal of a face, or the mean normal of an edge or a corner.
        """
        points_mm = np.ascontiguousarray(points_mm, dtype=np.float64)
        gap, normal = np.empty(len(points_mm)), np.empty((len(points_mm), 3))
        run_kernel(
            _closest, len(points_mm), points_mm, self.corners_mm, self.normals, self.low_mm, self.high_mm,
            self.far_mm, gap, normal,
        )  # fmt: skip
        if self.hollow[1]:
            near = np.flatnonzero(np.abs(gap) < self.radius_mm)
            there = points_mm[near], gap[near], normal[near]
            run_kernel(
                _blunt, len(near), there[0], self.corners_mm, self.normals, self.low_mm, self.high_mm,
                self.kinds, self.hollow, self.radius_mm, there[1], there[2],
            )  # fmt: skip
            gap[near], normal[near] = there[1:]
        return gap, normal


def _morton(points: FloatArray) -> IntArray:
    """Place of each point along a curve that fills the box of all, 10 bits per axis."""
    low, extent = points.min(axis=0), np.ptp(points, axis=0)
    cells = ((points - low) / np.where(extent > 0.0, extent, 1.0) * 1023.0).astype(np.int64)
    code = np.zeros(len(points), dtype=np.int64)
    for bit in range(10):
        for axis in range(3):
            code |= ((cells[:, axis] >> bit) & 1) << (3 * bit + axis)
    return code


def _edges(faces: IntArray, n_vertices: int) -> IntArray:
    """Return the number of the edge opposite to each corner, which neighbours share, (n, 3)."""
    sides = np.sort(faces[:, [[1, 2], [2, 0], [0, 1]]], axis=2)
    _, edge = np.unique((sides[..., 0] * n_vertices + sides[..., 1]).ravel(), return_inverse=True)
    return edge.reshape(faces.shape)


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
def _height(p: FloatArray, corners: FloatArray, low: FloatArray, high: FloatArray) -> float:
    """Height y of the highest triangle along y through a point, -inf if there is none."""
    n_leaves = len(low) // 2
    stack = np.empty(64, dtype=np.int64)
    highest = -np.inf
    stack[0], top = 1, 1
    while top:
        top -= 1
        box = stack[top]
        beside = p[0] < low[box, 0] or p[0] > high[box, 0] or p[2] < low[box, 2] or p[2] > high[box, 2]
        if beside or high[box, 1] <= highest:
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
            if v >= -1e-9 and w >= -1e-9 and v + w <= 1.0 + 1e-9:
                highest = max(highest, a[1] + v * (b[1] - a[1]) + w * (c[1] - a[1]))
    return highest


@njit(cache=True, nogil=True)
def _heights(
    points: FloatArray,
    corners: FloatArray,
    low: FloatArray,
    high: FloatArray,
    height: FloatArray,
    begin: int,
    end: int,
) -> None:  # pragma: no cover (compiled)
    for number in range(begin, end):
        height[number] = _height(points[number], corners, low, high)


@njit(cache=True, nogil=True)
def _closest(
    points: FloatArray,
    corners: FloatArray,
    normals: FloatArray,
    low: FloatArray,
    high: FloatArray,
    far: float,
    gap: FloatArray,
    normal: FloatArray,
    begin: int,
    end: int,
) -> None:
    n_leaves = len(low) // 2
    stack = np.empty(64, dtype=np.int64)
    last = 0.0
    for number in range(begin, end):
        p = points[number]
        nearest = np.inf
        if far < np.inf and p[1] > _height(p, corners, low, high):
            nearest = far * far
        if number > begin:  # a neighbour's distance bounds this one
            apart = np.sqrt(((p - points[number - 1]) ** 2).sum())
            nearest = min(nearest, (last + apart) ** 2 * (1.0 + 1e-9) + 1e-18)
        side, slot_found, feature_found = 1.0, -1, 6
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
            first = (box - n_leaves) * _LEAF
            for slot in range(first, first + _LEAF):
                squared, x, y, z, feature = _to_triangle(p, corners[slot])
                if squared <= nearest:
                    nearest = squared
                    n = normals[slot, feature]
                    side = 1.0 if x * n[0] + y * n[1] + z * n[2] >= 0.0 else -1.0
                    normal[number, 0], normal[number, 1], normal[number, 2] = side * x, side * y, side * z
                    slot_found, feature_found = slot, feature
        last = np.sqrt(nearest)
        gap[number] = side * last
        if slot_found < 0:
            last = np.inf
            normal[number, 0], normal[number, 1], normal[number, 2] = 0.0, 1.0, 0.0
            continue
        if last > _ON_SURFACE_MM:
            normal[number] /= last
        else:
            normal[number] = normals[slot_found, feature_found]
            normal[number] /= np.sqrt((normal[number] ** 2).sum())


@njit(cache=True, nogil=True)
def _blunt(
    points: FloatArray,
    corners: FloatArray,
    normals: FloatArray,
    low: FloatArray,
    high: FloatArray,
    kinds: np.ndarray,
    hollow: np.ndarray,
    radius: float,
    gap: FloatArray,
    normal: FloatArray,
    begin: int,
    end: int,
) -> None:  # pragma: no cover (compiled)
    """Replace exact gaps and normals near hollow creases by those of the blunted surface."""
    n_leaves = len(low) // 2
    stack = np.empty(64, dtype=np.int64)
    found, turns = np.empty(16), np.empty((256, 6))
    for number in range(begin, end):
        p = points[number]
        away, away_slope = 1.0, np.zeros(3)
        sharp, sharp_slope = 1.0, np.zeros(3)
        total, mean_normal = np.zeros(16), np.zeros(3)
        n_turns = 0
        # Hollow creases, then sharp ones, then the surface: it costs most, and is not needed near sharp ones.
        for search in range(3):
            reach = SHARP_SHARE * radius if search == 1 else radius
            stack[0], top = 1, 1
            while top:
                top -= 1
                box = stack[top]
                if (search == 0 and not hollow[box]) or _to_box(p, low[box], high[box]) > reach * reach:
                    continue
                if box < n_leaves:
                    stack[top], stack[top + 1] = 2 * box, 2 * box + 1
                    top += 2
                    continue
                first = (box - n_leaves) * _LEAF
                for slot in range(first, first + _LEAF):
                    if search == 0:
                        away *= share_of_edges(
                            p, corners[slot], kinds[slot], HOLLOW, 0.5 * radius, radius, away_slope
                        )
                        continue
                    if kinds[slot, 0] == _COPY:
                        continue
                    if search == 1:
                        sharp *= share_of_edges(
                            p, corners[slot], kinds[slot], SHARP, radius, SHARP_SHARE * radius, sharp_slope
                        )
                        if sharp == 0.0:
                            top = 0
                            break
                        continue
                    face = normals[slot, 6]
                    facing = (
                        face[0] * normal[number, 0]
                        + face[1] * normal[number, 1]
                        + face[2] * normal[number, 2]
                    )
                    if facing <= 0.0 or _to_triangle(p, corners[slot])[0] >= radius * radius:
                        continue
                    if not moments_in_ball(p, corners[slot], face, radius, found):
                        continue
                    total += found
                    mean_normal += found[0] * face
                    if n_turns == len(turns):
                        longer = np.empty((2 * n_turns, 6))
                        longer[:n_turns] = turns
                        turns = longer
                    turns[n_turns, :3], turns[n_turns, 3:] = face, found[4:7]
                    n_turns += 1
            if away == 1.0 or (search == 1 and sharp == 0.0) or (search == 2 and total[0] <= 0.0):
                break
        else:
            length = np.sqrt((mean_normal**2).sum())
            n, centre = mean_normal / length, total[1:4] / total[0]
            mean_gap = -(n * centre).sum()
            slope = n.copy()
            square = 2.0 / (radius * radius)
            for i in range(3):
                row = 0.0
                for k in range(3):
                    row += total[7 + 3 * i + k] * n[k]
                slope[i] -= square / total[0] * (row + mean_gap * total[4 + i])
            for turn in range(n_turns):
                tilt = 0.0
                for k in range(3):
                    tilt += turns[turn, k] * (centre[k] + mean_gap * n[k])
                for i in range(3):
                    slope[i] -= square / length * tilt * turns[turn, 3 + i]
            # share = (1 - away) sharp
            share = (1.0 - away) * sharp
            for i in range(3):
                share_slope = share * sharp_slope[i] - away * sharp * away_slope[i]
                slope[i] = (
                    normal[number, i]
                    + share * (slope[i] - normal[number, i])
                    + (mean_gap - gap[number]) * share_slope
                )
            gap[number] += share * (mean_gap - gap[number])
            normal[number] = slope / np.sqrt((slope**2).sum())
