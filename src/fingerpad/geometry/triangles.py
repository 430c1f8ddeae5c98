"""Closest points on triangles of a skin, with their barycentric weights."""

from __future__ import annotations

import numpy as np
from scipy.spatial import cKDTree

from fingerpad.core.checks import FloatArray, IntArray

_NEAREST = 24
"""Triangles that are looked at: those whose corners or middles are nearest to a point."""


def closest_on_triangles(points_mm: FloatArray, corners_mm: FloatArray) -> tuple[IntArray, FloatArray]:
    """Closest point on a surface of triangles of similar size."""
    count = min(_NEAREST, len(corners_mm))
    _, near = cKDTree(corners_mm.mean(axis=1)).query(points_mm, k=count)
    near = near.reshape(len(points_mm), count)
    weights = _weights(points_mm[:, None], corners_mm[near])
    found = (weights[..., None] * corners_mm[near]).sum(axis=2)
    best = np.linalg.norm(found - points_mm[:, None], axis=2).argmin(axis=1)
    rows = np.arange(len(points_mm))
    return near[rows, best], weights[rows, best]


def _weights(points: FloatArray, corners: FloatArray) -> FloatArray:
    """Weights (..., 3) of the closest point of each triangle (..., 3, 3): on its face or an edge."""
    a, b, c = corners[..., 0, :], corners[..., 1, :], corners[..., 2, :]
    ab, ac, ap = b - a, c - a, points - a
    d00, d01, d11 = (ab * ab).sum(-1), (ab * ac).sum(-1), (ac * ac).sum(-1)
    d20, d21 = (ap * ab).sum(-1), (ap * ac).sum(-1)
    area = d00 * d11 - d01 * d01
    safe = np.where(area > 0.0, area, 1.0)
    v, w = (d11 * d20 - d01 * d21) / safe, (d00 * d21 - d01 * d20) / safe
    inside = np.stack([1.0 - v - w, v, w], axis=-1)
    on_face = (area > 0.0) & (inside >= 0.0).all(axis=-1)
    nearest = np.full(on_face.shape, np.inf)
    chosen = inside
    for first, second in ((0, 1), (1, 2), (2, 0)):
        start, end = corners[..., first, :], corners[..., second, :]
        way = end - start
        square = (way * way).sum(-1)
        t = np.clip(((points - start) * way).sum(-1) / np.where(square > 0.0, square, 1.0), 0.0, 1.0)
        away = np.linalg.norm(points - start - t[..., None] * way, axis=-1)
        edge = np.zeros_like(inside)
        edge[..., first], edge[..., second] = 1.0 - t, t
        closer = ~on_face & (away < nearest)
        chosen = np.where(closer[..., None], edge, chosen)
        nearest = np.where(closer, away, nearest)
    return chosen
