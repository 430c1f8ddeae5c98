"""Blunt hollow creases between triangles, so that gap and normal are continuous in a hollow.

In front of a hollow crease the exact distance is the smaller of the distances to two planes, and its normal
jumps. Within `radius` of such a crease the gap is instead measured from the mean surface in a ball about the
point (an implicit moving average, after Adamson & Alexa 2003, DOI 10.2312/SGP/SGP03/230-239; with integrals
over the triangles as in Shen, O'Brien & Shewchuk 2004, DOI 10.1145/1015706.1015816):

    f(p) = n . (p - c),   n = <n_i> / |<n_i>|,   c = <x>,   < > weighted with w = 1 - |x - p|² / radius²

over the area of the triangles i in the ball. The integrals are exact, so f has a continuous gradient. The gap
g = d + share (f - d) returns to the exact distance d at `radius` from the last hollow crease, and near sharp
edges, which stay sharp.
"""

from __future__ import annotations

import numpy as np
from numba import njit

from fingerpad.core.values import FloatArray, IntArray

PLAIN, HOLLOW, SHARP = 0, 1, 2  # Kinds of edges: nothing is done, blunted, kept sharp.

LEAST_RAD = 2e-4
"""Angle between two triangles that counts as a crease; below it the rounding of files decides. [rad]"""

LEAST_MM = 1e-6
"""Least height of the far corner of each triangle above the other: files round their numbers. [mm]"""

LEAST_SHARE = 0.5
"""Angle of a hollow crease over that of the sharpest ridge beside it, below which the hollow counts as none.

On a round top of triangles the diagonals of squares are hollow by a little: there is nothing to blunt.
"""

_GAUSS = (0.21132486540518713, 0.7886751345948129)
"""Points of Gauss's rule on an edge, (1 ± 1/sqrt 3) / 2, exact for polynomials of degree 3."""


def kinds_of_edges(
    corners: FloatArray, face_normals: FloatArray, edge: IntArray, smooth_below_deg: float
) -> np.ndarray:
    """Kind of each edge of each triangle (opposite to its corner), int8 (n, 3)."""
    order = np.argsort(edge.ravel(), kind="stable")
    sorted_edges = edge.ravel()[order]
    pair = np.flatnonzero(sorted_edges[1:] == sorted_edges[:-1])
    one, other = order[pair] // 3, order[pair + 1] // 3
    far = corners[other, order[pair + 1] % 3]
    beside = corners[one, (order[pair] % 3 + 1) % 3]
    cross = np.linalg.norm(np.cross(face_normals[one], face_normals[other]), axis=1)
    angle = np.arctan2(cross, (face_normals[one] * face_normals[other]).sum(axis=1))
    rise = (face_normals[one] * (far - beside)).sum(axis=1)
    own = corners[one, order[pair] % 3]
    back = (face_normals[other] * (own - beside)).sum(axis=1)
    hollow = np.minimum(rise, back) > LEAST_MM
    is_sharp = angle >= np.deg2rad(smooth_below_deg)
    ridge = np.zeros(len(corners))
    for side in (one, other):
        np.maximum.at(ridge, side, np.where(hollow | is_sharp, 0.0, angle))
    least = np.maximum(LEAST_RAD, LEAST_SHARE * np.maximum(ridge[one], ridge[other]))
    kind = np.where(is_sharp, SHARP, np.where(hollow & (angle > least), HOLLOW, PLAIN))
    found = np.full(edge.size, SHARP, dtype=np.int8)
    found[order[pair]] = found[order[pair + 1]] = kind
    return found.reshape(edge.shape)


@njit(cache=True, nogil=True, inline="always")
def _smooth_step(x: float) -> tuple[float, float]:
    """0 below 0, 1 above 1, with a continuous slope, and that slope."""
    x = min(1.0, max(0.0, x))
    return x * x * (3.0 - 2.0 * x), 6.0 * x * (1.0 - x)


@njit(cache=True, nogil=True)
def share_of_edges(
    p: FloatArray,
    corners: FloatArray,
    kinds: np.ndarray,
    kind: int,
    low: float,
    high: float,
    slope: FloatArray,
) -> float:
    """Product over edges of one kind of a step from 0 at the distance `low` to 1 at `high`.

    The gradient of its logarithm is added to `slope`.
    """
    product = 1.0
    for edge in range(3):
        if kinds[edge] != kind:
            continue
        a, b = corners[(edge + 1) % 3], corners[(edge + 2) % 3]
        along, length = 0.0, 0.0
        for axis in range(3):
            along += (p[axis] - a[axis]) * (b[axis] - a[axis])
            length += (b[axis] - a[axis]) ** 2
        along = min(1.0, max(0.0, along / length))
        x, y, z = (
            p[0] - a[0] - along * (b[0] - a[0]),
            p[1] - a[1] - along * (b[1] - a[1]),
            p[2] - a[2] - along * (b[2] - a[2]),
        )
        distance = np.sqrt(x * x + y * y + z * z)
        if distance >= high:
            continue
        value, rise = _smooth_step((distance - low) / (high - low))
        product *= value
        if value > 0.0:
            rise /= value * (high - low) * max(distance, 1e-300)
            slope[0] += rise * x
            slope[1] += rise * y
            slope[2] += rise * z
    return product


@njit(cache=True, nogil=True)
def moments_in_ball(
    p: FloatArray, corners: FloatArray, normal: FloatArray, radius: float, out: FloatArray
) -> bool:
    """Integrals over the part of a triangle in the ball about p, y being the offset from p.

    `out` (16,): 0 the integral of the weight w, 1-3 of w y, 4-6 of y, 7-15 of y y'. Whether there is a part.
    """
    height = 0.0
    for axis in range(3):
        height += (corners[0, axis] - p[axis]) * normal[axis]
    flat = radius * radius - height * height
    if flat <= 0.0:
        return False
    # Axes u, v in the plane; its origin is the foot of p.
    u, v = np.empty(3), np.empty(3)
    length = 0.0
    for axis in range(3):
        u[axis] = corners[1, axis] - corners[0, axis]
        length += u[axis] * u[axis]
    u /= np.sqrt(length)
    v[0] = normal[1] * u[2] - normal[2] * u[1]
    v[1] = normal[2] * u[0] - normal[0] * u[2]
    v[2] = normal[0] * u[1] - normal[1] * u[0]
    at = np.zeros((3, 2))
    for corner in range(3):
        for axis in range(3):
            offset = corners[corner, axis] - p[axis]
            at[corner, 0] += offset * u[axis]
            at[corner, 1] += offset * v[axis]
    # Area, first, second and third moments (r² x) of the triangle cut by the circle, from the origin.
    area, mx, my, xx, xy, yy, rx, ry = 0.0, 0.0, 0.0, 0.0, 0.0, 0.0, 0.0, 0.0
    disc = np.sqrt(flat)
    for corner in range(3):
        ax, ay = at[corner, 0], at[corner, 1]
        bx, by = at[(corner + 1) % 3, 0], at[(corner + 1) % 3, 1]
        dx, dy = bx - ax, by - ay
        a, b, c = dx * dx + dy * dy, ax * dx + ay * dy, ax * ax + ay * ay - flat
        root = b * b - a * c
        first, last = 1.0, 1.0
        if root > 0.0:
            root = np.sqrt(root)
            first, last = min(1.0, max(0.0, (-b - root) / a)), min(1.0, max(0.0, (-b + root) / a))
        for begin, end in ((0.0, first), (first, last), (last, 1.0)):
            if end <= begin:
                continue
            x0, y0, x1, y1 = ax + begin * dx, ay + begin * dy, ax + end * dx, ay + end * dy
            cross = x0 * y1 - y0 * x1
            if begin == first and end == last and last > first:  # within the circle: a triangle to the origin
                area += cross / 2
                for gauss in _GAUSS:
                    x, y = x0 + gauss * (x1 - x0), y0 + gauss * (y1 - y0)
                    mx += cross / 6 * x
                    my += cross / 6 * y
                    xx += cross / 8 * x * x
                    xy += cross / 8 * x * y
                    yy += cross / 8 * y * y
                    rx += cross / 10 * (x * x + y * y) * x
                    ry += cross / 10 * (x * x + y * y) * y
            else:  # outside of it: a sector
                turn = np.arctan2(cross, x0 * x1 + y0 * y1)
                scale0, scale1 = 1.0 / np.sqrt(x0 * x0 + y0 * y0), 1.0 / np.sqrt(x1 * x1 + y1 * y1)
                c0, s0, c1, s1 = x0 * scale0, y0 * scale0, x1 * scale1, y1 * scale1
                area += flat / 2 * turn
                third = flat * disc / 3
                mx += third * (s1 - s0)
                my += third * (c0 - c1)
                fourth = flat * flat / 8
                xx += fourth * (turn + s1 * c1 - s0 * c0)
                yy += fourth * (turn - s1 * c1 + s0 * c0)
                xy += fourth * (s1 * s1 - s0 * s0)
                fifth = flat * flat * disc / 5
                rx += fifth * (s1 - s0)
                ry += fifth * (c0 - c1)
    if area <= 0.0:
        return False
    # y = x u + y v + height n, |y|² = r² + height².
    inverse = 1.0 / (radius * radius)
    weight = area * flat * inverse - (xx + yy) * inverse
    wx, wy = mx * flat * inverse - rx * inverse, my * flat * inverse - ry * inverse
    out[0] = weight
    for i in range(3):
        h = height * normal[i]
        out[1 + i] = wx * u[i] + wy * v[i] + weight * h
        out[4 + i] = mx * u[i] + my * v[i] + area * h
        for k in range(3):
            g = height * normal[k]
            out[7 + 3 * i + k] = (
                xx * u[i] * u[k] + xy * (u[i] * v[k] + v[i] * u[k]) + yy * v[i] * v[k]
                + (mx * u[i] + my * v[i]) * g + h * (mx * u[k] + my * v[k]) + area * h * g
            )  # fmt: skip
    return True
