"""Exact signed distance to triangles and its gradient, by a tree of boxes.

The triangles are sorted along a Morton curve; the boxes form a complete binary tree over groups of them, node
i having the children 2 i and 2 i + 1. The sign is that of the angle-weighted normal at the closest point
(Bærentzen & Aanæs 2005, DOI 10.1109/TVCG.2005.49), so that open surfaces have sides as well.
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from numba import njit

from fingerpad.core.checks import FloatArray, IntArray
from fingerpad.core.threads import run_kernel

_LEAF = 4
"""Triangles in a box without children."""

_ON_SURFACE_MM = 1e-9
"""Distance from which on its direction is known. [mm]"""


@dataclass(frozen=True)
class Triangles:
    """Triangles in a tree, ready for distances.

    Parameters
    ----------
    corners_mm : array (n_slots, 3, 3)
        Corners, sorted; the last triangle fills the slots that are left. [mm]
    normals : array (n_slots, 7, 3)
        Outward normals at the three corners, on the three edges (opposite to each corner) and on the face.
    low_mm, high_mm : array (n_boxes, 3)
        Boxes; the first is not used. [mm]
    """

    corners_mm: FloatArray
    normals: FloatArray
    low_mm: FloatArray
    high_mm: FloatArray

    @classmethod
    def of(cls, vertices_mm: FloatArray, faces: IntArray) -> Triangles:
        """Sort triangles with area into a tree."""
        corners = vertices_mm[faces]
        order = np.argsort(_morton(corners.mean(axis=1)), kind="stable")
        slots = _LEAF << max(0, int(np.ceil(np.log2(max(1.0, len(faces) / _LEAF)))))
        order = np.concatenate([order, np.full(slots - len(order), order[-1])])
        corners, normals = corners[order], _normals(corners, faces, len(vertices_mm))[order]
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
        return cls(corners, normals, low, high)

    def gap(self, points_mm: FloatArray) -> tuple[FloatArray, FloatArray]:
        """Signed distance (n,) and its gradient (n, 3) at points (n, 3). [mm]

        On the surface the gradient is the normal of a face, or the mean normal of an edge or a corner.

        Examples
        --------
        >>> square = np.array([[0.0, 0.0, 0.0], [0.0, 0.0, 1.0], [1.0, 0.0, 1.0], [1.0, 0.0, 0.0]])
        >>> triangles = Triangles.of(square, np.array([[0, 1, 2], [0, 2, 3]]))
        >>> gap, normal = triangles.gap(np.array([[0.5, 2.0, 0.5], [0.5, -1.0, 0.2], [4.0, 4.0, 0.5]]))
        >>> gap.tolist(), normal[2].tolist()
        ([2.0, -1.0, 5.0], [0.6, 0.8, 0.0])
        """
        points_mm = np.ascontiguousarray(points_mm, dtype=np.float64)
        gap, normal = np.empty(len(points_mm)), np.empty((len(points_mm), 3))
        run_kernel(
            _closest, len(points_mm), points_mm, self.corners_mm, self.normals, self.low_mm, self.high_mm,
            gap, normal,
        )  # fmt: skip
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


def _normals(corners: FloatArray, faces: IntArray, n_vertices: int) -> FloatArray:
    """Return normals at corners, edges and face of each triangle, (n, 7, 3), not all of length 1."""
    first, second, third = corners.transpose(1, 0, 2)
    face = np.cross(second - first, third - first)
    face /= np.linalg.norm(face, axis=1)[:, None]
    at_vertex = np.zeros((n_vertices, 3))
    along_edge = np.empty((len(faces), 3, 2), dtype=np.int64)
    for corner in range(3):
        here, ahead, behind = (corners[:, (corner + step) % 3] for step in range(3))
        one, other = ahead - here, behind - here
        lengths = np.linalg.norm(one, axis=1) * np.linalg.norm(other, axis=1)
        angle = np.arccos(np.clip((one * other).sum(axis=1) / lengths, -1.0, 1.0))
        for axis in range(3):
            at_vertex[:, axis] += np.bincount(faces[:, corner], angle * face[:, axis], n_vertices)
        along_edge[:, corner] = np.sort(faces[:, [(corner + 1) % 3, (corner + 2) % 3]], axis=1)
    keys = along_edge[..., 0] * n_vertices + along_edge[..., 1]
    _, edge = np.unique(keys.ravel(), return_inverse=True)
    edge = edge.reshape(keys.shape)
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
    """Squared distance of a point to a box."""
    total = 0.0
    for axis in range(3):
        beyond = max(low[axis] - p[axis], p[axis] - high[axis], 0.0)
        total += beyond * beyond
    return total


@njit(cache=True, nogil=True)
def _closest(
    points: FloatArray,
    corners: FloatArray,
    normals: FloatArray,
    low: FloatArray,
    high: FloatArray,
    gap: FloatArray,
    normal: FloatArray,
    begin: int,
    end: int,
) -> None:
    """Signed distances of some of the points, and their gradients."""
    n_leaves = len(low) // 2
    stack = np.empty(64, dtype=np.int64)
    last = 0.0
    for number in range(begin, end):
        p = points[number]
        nearest = np.inf
        if number > begin:  # a neighbour's distance bounds this one
            apart = np.sqrt(((p - points[number - 1]) ** 2).sum())
            nearest = (last + apart) ** 2 * (1.0 + 1e-9) + 1e-18
        side, slot_found, feature_found = 1.0, 0, 6
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
        if last > _ON_SURFACE_MM:
            normal[number] /= last
        else:
            normal[number] = normals[slot_found, feature_found]
            normal[number] /= np.sqrt((normal[number] ** 2).sum())
