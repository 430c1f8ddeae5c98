"""Triangles made one body: edges joined, parts turned outwards, walls between parts that touch left out.

What is done is told in sentences; what cannot be done is refused.
"""

from __future__ import annotations

import numpy as np
from scipy.sparse import coo_matrix
from scipy.sparse.csgraph import connected_components
from scipy.spatial import cKDTree

from fingerpad.core.errors import InputError
from fingerpad.core.values import FloatArray, IntArray
from fingerpad.geometry.closest_point import Triangles

JOIN_MM = 0.01
"""Edges and walls that are as near as this become one; the skin does not get between them. [mm]"""

_STEEP = 0.7
"""Component towards the skin below which a wall is steep, so that a crack along it opens to the skin."""


def repaired(vertices_mm: FloatArray, faces: IntArray) -> tuple[FloatArray, IntArray, tuple[str, ...]]:
    """Vertices and faces of one body, and what was done to make it one."""
    told: list[str] = []
    border = border_of(faces)
    if len(border):
        vertices_mm, faces, joined, moved_mm = _joined(vertices_mm, faces, border)
        border = border_of(faces)
        if moved_mm > 0.0:
            told.append(
                f"vertices joined within {JOIN_MM:g} mm: {joined:,}, moved by up to {moved_mm:.2g} mm"
            )
    _check_sides(faces, vertices_mm)
    part, closed = parts_of(faces, border)
    volume = np.bincount(part, _volumes(vertices_mm, faces), len(closed))
    nested = _nested(vertices_mm, faces, part, closed, np.sign(volume)) if len(closed) > 1 else closed & False
    if nested.any():
        told.append(f"closed parts within others, left out: {nested.sum():,}")
    inwards = closed & ~nested & (volume < 0.0)
    if inwards.any():
        told.append(f"closed parts whose normals pointed inwards, turned: {inwards.sum():,}")
        faces = np.where(inwards[part][:, None], faces[:, ::-1], faces)
    faces = faces[~nested[part]]
    walls = _facing_walls(vertices_mm, faces) if len(closed) - nested.sum() > 1 else None
    if walls is not None:
        inner, place, apart_mm = walls
        kept = faces[~inner]
        vertices_mm, kept, *_ = _joined(vertices_mm, kept, border_of(kept))
        if not inner.any() or len(border_of(kept)) > len(border):
            raise InputError(
                f"Parts of a surface must overlap or stand apart by more than {JOIN_MM:g} mm: walls of two "
                f"are {apart_mm:.2g} mm apart at ({', '.join(f'{at:.4g}' for at in place)}) mm; unite them, "
                "for example by the Boolean union of a CAD program."
            )
        told.append(f"triangles of walls between parts {apart_mm:.2g} mm apart, left out: {inner.sum():,}")
        vertices_mm, faces, further = repaired(vertices_mm, kept)
        told.extend(further)
    return vertices_mm, faces, tuple(told)


def border_of(faces: IntArray) -> IntArray:
    """Edges of one triangle alone: the triangle and its two corners in their order, (n, 3)."""
    a, b = faces.T.ravel(), faces[:, [1, 2, 0]].T.ravel()
    keys = np.minimum(a, b) * (int(faces.max(initial=0)) + 1) + np.maximum(a, b)
    _, first, count = np.unique(keys, return_index=True, return_counts=True)
    alone = first[count == 1]
    return np.column_stack([alone % len(faces), a[alone], b[alone]])


def parts_of(faces: IntArray, border: IntArray) -> tuple[IntArray, np.ndarray]:
    """Part of each triangle, and whether each part is closed."""
    a, b = faces[:, [0, 1]].ravel(), faces[:, [1, 2]].ravel()
    label = _labels(a, b, int(faces.max(initial=0)) + 1)
    _, part = np.unique(label[faces[:, 0]], return_inverse=True)
    closed = np.ones(int(part.max(initial=-1)) + 1, dtype=bool)
    closed[part[border[:, 0]]] = False
    return part, closed


def layers_of(vertices_mm: FloatArray, faces: IntArray, border: IntArray) -> IntArray:
    """Layer of each triangle: closed parts whose boxes overlap are in different ones, others in the first."""
    part, closed = parts_of(faces, border)
    if len(closed) == 1 or not closed.any():
        return np.zeros(len(faces), dtype=np.int64)
    low, high = _boxes(vertices_mm, faces, part)
    low[~closed, 1] = -np.inf  # walls go down from a border
    layer = np.where(closed, -1, 0)
    for number in np.flatnonzero(closed):
        meets = ((low <= high[number] + JOIN_MM) & (high >= low[number] - JOIN_MM)).all(axis=1)
        taken = set(layer[meets].tolist())
        layer[number] = next(free for free in range(len(taken) + 1) if free not in taken)
    return layer[part]


def is_crack(vertices_mm: FloatArray, faces: IntArray, border: IntArray) -> np.ndarray:
    """Whether another triangle goes on beyond an edge of a border, without corners in common, (n,)."""
    own, a, b = border.T
    if not len(own):
        return np.zeros(0, dtype=bool)
    first, second, third = vertices_mm[faces[own]].transpose(1, 0, 2)
    normal = np.cross(second - first, third - first)
    area = np.linalg.norm(normal, axis=1)
    sides = np.stack([second - first, third - second, first - third])
    height = area / np.linalg.norm(sides, axis=2).max(axis=0)
    normal /= np.where(area > 0.0, area, 1.0)[:, None]
    along = vertices_mm[b] - vertices_mm[a]
    beyond = np.cross(along / np.linalg.norm(along, axis=1)[:, None], normal)
    step = np.minimum(2 * JOIN_MM, 0.2 * height)
    others = Triangles.of(vertices_mm, faces[np.unique(own[area > 0.0])])
    found = area == 0.0
    for way in (beyond, normal, -normal):
        points = 0.5 * (vertices_mm[a] + vertices_mm[b]) + step[:, None] * way
        # This triangle is a step away; another one at up to 45 degrees is nearer.
        found |= np.abs(others.gap(points)[0]) < 0.72 * step
    return found


def _joined(
    vertices: FloatArray, faces: IntArray, border: IntArray
) -> tuple[FloatArray, IntArray, int, float]:
    """Join the ends of edges that run back to back; also how many vertices are gone, and the largest move."""
    if not len(border):
        return vertices, faces, 0, 0.0
    _, a, b = border.T
    way = vertices[b] - vertices[a]
    within = min(JOIN_MM, 0.1 * float(np.median(np.linalg.norm(way, axis=1))))
    pairs = cKDTree(0.5 * (vertices[a] + vertices[b])).query_pairs(within, output_type="ndarray")
    i, j = pairs.T
    near = (way[i] * way[j]).sum(axis=1) < 0.0
    for one, other in ((a[i], b[j]), (b[i], a[j])):
        near &= np.linalg.norm(vertices[one] - vertices[other], axis=1) <= within
    i, j = i[near], j[near]
    label = _labels(np.r_[a[i], b[i]], np.r_[b[j], a[j]], len(vertices))
    count = np.bincount(label)
    if len(count) == len(vertices):
        return vertices, faces, 0, 0.0
    # Sums about one of them, so that equal ones stay where they are.
    about = np.empty((len(count), 3))
    about[label] = vertices
    away = vertices - about[label]
    mean = about + np.column_stack([np.bincount(label, away[:, axis]) / count for axis in range(3)])
    moved = float(np.linalg.norm(mean[label] - vertices, axis=1).max())
    faces = label[faces]
    faces = faces[(faces != np.roll(faces, 1, axis=1)).all(axis=1)]
    return mean, faces, len(vertices) - len(count), moved


def _labels(a: IntArray, b: IntArray, count: int) -> IntArray:
    """Group of each of `count` vertices, where pairs a, b are in one."""
    links = coo_matrix((np.ones(len(a), dtype=np.int8), (a, b)), shape=(count, count))
    return connected_components(links, directed=False)[1].astype(np.int64)


def _volumes(vertices: FloatArray, faces: IntArray) -> FloatArray:
    first, second, third = (vertices - vertices.mean(axis=0))[faces].transpose(1, 0, 2)
    return (np.cross(first, second) * third).sum(axis=1) / 6.0


def _boxes(vertices: FloatArray, faces: IntArray, part: IntArray) -> tuple[FloatArray, FloatArray]:
    """Lowest and highest coordinates of each part, (n_parts, 3)."""
    order = np.argsort(part, kind="stable")
    begin = np.flatnonzero(np.diff(part[order], prepend=-1))
    corners = vertices[faces[order]]
    low, high = corners.min(axis=1), corners.max(axis=1)
    return np.minimum.reduceat(low, begin), np.maximum.reduceat(high, begin)


def _with_area(vertices: FloatArray, faces: IntArray) -> IntArray:
    first, second, third = vertices[faces].transpose(1, 0, 2)
    return faces[(np.cross(second - first, third - first) != 0.0).any(axis=1)]


def _nested(
    vertices: FloatArray, faces: IntArray, part: IntArray, closed: np.ndarray, side: FloatArray
) -> np.ndarray:
    low, high = _boxes(vertices, faces, part)
    found = np.zeros(len(closed), dtype=bool)
    for outer in np.flatnonzero(closed):
        inner = closed & (low > low[outer]).all(axis=1) & (high < high[outer]).all(axis=1) & ~found
        if inner.any():
            tree = Triangles.of(vertices, _with_area(vertices, faces[part == outer]))
            for number in np.flatnonzero(inner):
                corners = vertices[np.unique(faces[part == number])]
                found[number] = (side[outer] * tree.gap(corners)[0] < 0.0).all()
    return found


def _facing_walls(vertices: FloatArray, faces: IntArray) -> tuple[np.ndarray, FloatArray, float] | None:
    """Triangles along which another part faces them within `JOIN_MM`, a place, and how far apart they are."""
    # None if no crack opens to the skin.
    layer = layers_of(vertices, faces, border_of(faces))
    if not layer.any():
        return None
    corners = vertices[faces]
    middle = corners.mean(axis=1)
    normal = np.cross(corners[:, 1] - corners[:, 0], corners[:, 2] - corners[:, 0])
    length = np.linalg.norm(normal, axis=1)
    normal /= np.where(length > 0.0, length, 1.0)[:, None]
    near, away = np.zeros(len(faces), dtype=bool), np.full(len(faces), np.inf)
    covered = near.copy()
    for number in range(int(layer.max()) + 1):
        tree = Triangles.of(vertices, _with_area(vertices, faces[layer == number]))
        others = np.flatnonzero((layer != number) & (length > 0.0))
        gap, facing = tree.gap(middle[others])
        meets = (np.abs(gap) <= JOIN_MM) & ((facing * normal[others]).sum(axis=1) < -0.9)
        others = others[meets]
        near[others], away[others] = True, np.minimum(away[others], np.abs(gap[meets]))
        points = middle[others, None] + 0.9 * (corners[others] - middle[others, None])
        beside = np.abs(tree.gap(points.reshape(-1, 3))[0]).reshape(-1, 3) <= JOIN_MM
        covered[others] |= beside.all(axis=1)
    steep = np.flatnonzero(near & (np.abs(normal[:, 1]) < _STEEP))
    return (covered, middle[steep[0]], float(away[steep].max())) if steep.size else None


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
