"""Triangles made one body: vertices joined, triangles and parts turned, walls between parts left out.

What is done is told in sentences; what cannot be done is refused.
"""

from __future__ import annotations

import numpy as np
from scipy.sparse import coo_matrix
from scipy.sparse.csgraph import connected_components
from scipy.spatial import cKDTree

from fingerpad.core.errors import InputError
from fingerpad.core.values import FloatArray, IntArray
from fingerpad.geometry.triangles import Triangles

JOIN_MM = 0.01
"""Vertices and walls that are as near as this become one; the skin does not get between them. [mm]"""

_STEEP = 0.7
"""Component towards the skin below which a wall is steep, so that a crack along it opens to the skin."""


def repaired(vertices_mm: FloatArray, faces: IntArray) -> tuple[FloatArray, IntArray, tuple[str, ...]]:
    """Vertices and faces of one body, and what was done to make it one."""
    told: list[str] = []

    def tell(what: str, count: int) -> None:
        if count:
            told.append(f"{what}: {count:,}")

    vertices_mm, faces, joined, moved_mm = _joined(vertices_mm, faces)
    tell(
        f"vertices joined within {JOIN_MM:g} mm, moved by up to {moved_mm:.2g} mm", joined * (moved_mm > 0.0)
    )
    twice, wall = _on_equal_ones(faces)
    tell("triangles that lay on equal ones, left out", int((twice & ~wall).sum()))
    tell("triangles of walls between parts, left out", int(wall.sum()))
    faces = faces[~twice & ~wall]
    if not len(faces):
        raise InputError(
            "A surface must have one side out: each of its triangles lies on one that is reversed."
        )
    vertices_mm, faces = _parted(vertices_mm, faces)
    faces, turned = _turned_alike(faces)
    tell("triangles turned as their neighbours", turned)
    part, closed = parts_of(faces)
    first, second, third = (vertices_mm - vertices_mm.mean(axis=0))[faces].transpose(1, 0, 2)
    volume = np.bincount(part, (np.cross(first, second) * third).sum(axis=1), len(closed))
    inwards = closed & (volume < 0.0)
    tell("closed parts whose normals pointed inwards, turned", int(inwards.sum()))
    faces = np.where(inwards[part][:, None], faces[:, ::-1], faces)
    _check_walls(vertices_mm, faces)
    return vertices_mm, faces, tuple(told)


def border_of(faces: IntArray) -> IntArray:
    """Edges of one triangle alone: the triangle and its two corners in their order, (n, 3)."""
    a, b, edge, count = _half_edges(faces)
    alone = np.flatnonzero(count[edge] == 1)
    return np.column_stack([alone % len(faces), a[alone], b[alone]])


def parts_of(faces: IntArray) -> tuple[IntArray, np.ndarray]:
    """Part of each triangle, joined along edges, and whether each part is closed."""
    _, _, edge, count = _half_edges(faces)
    order = np.argsort(edge, kind="stable")
    same = np.flatnonzero(np.diff(edge[order]) == 0)
    part = _labels(order[same] % len(faces), order[same + 1] % len(faces), len(faces))
    closed = np.ones(int(part.max(initial=-1)) + 1, dtype=bool)
    closed[part[np.flatnonzero(count[edge] == 1) % len(faces)]] = False
    return part, closed


def layers_of(vertices_mm: FloatArray, faces: IntArray) -> IntArray:
    """Layer of each triangle: closed parts whose boxes overlap are in different ones, others in the first."""
    part, closed = parts_of(faces)
    order = np.argsort(part, kind="stable")
    begin = np.flatnonzero(np.diff(part[order], prepend=-1))
    corners = vertices_mm[faces[order]]
    low = np.minimum.reduceat(corners.min(axis=1), begin)
    high = np.maximum.reduceat(corners.max(axis=1), begin)
    low[~closed, 1] = -np.inf  # walls go down from a border
    layer = np.where(closed & (len(closed) > 1), -1, 0)
    for number in np.flatnonzero(layer < 0):
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
    height = area / np.linalg.norm([second - first, third - second, first - third], axis=2).max(axis=0)
    normal /= area[:, None]
    along = vertices_mm[b] - vertices_mm[a]
    beyond = np.cross(along / np.linalg.norm(along, axis=1)[:, None], normal)
    step = np.minimum(2 * JOIN_MM, 0.2 * height)
    others = Triangles.of(vertices_mm, faces[np.unique(own)])
    middle = 0.5 * (vertices_mm[a] + vertices_mm[b])
    gaps = [np.abs(others.gap(middle + step[:, None] * way)[0]) for way in (beyond, normal, -normal)]
    # This triangle is a step away; another one at up to 45 degrees is nearer.
    return (np.array(gaps) < 0.72 * step).any(axis=0)


def with_area(vertices_mm: FloatArray, faces: IntArray) -> IntArray:
    """Triangles that are no lines or points."""
    first, second, third = vertices_mm[faces].transpose(1, 0, 2)
    return faces[(np.cross(second - first, third - first) != 0.0).any(axis=1)]


def _half_edges(faces: IntArray) -> tuple[IntArray, IntArray, IntArray, IntArray]:
    """Begin and end of all sides of all triangles, the number of their edge, and the sides of each edge."""
    a, b = faces.T.ravel(), faces[:, [1, 2, 0]].T.ravel()
    keys = np.minimum(a, b) * (int(faces.max(initial=0)) + 1) + np.maximum(a, b)
    _, edge, count = np.unique(keys, return_inverse=True, return_counts=True)
    return a, b, edge, count


def _labels(a: IntArray, b: IntArray, count: int) -> IntArray:
    """Group of each of `count` things, where pairs a, b are in one."""
    links = coo_matrix((np.ones(len(a), dtype=np.int8), (a, b)), shape=(count, count))
    return connected_components(links, directed=False)[1].astype(np.int64)


def _joined(vertices: FloatArray, faces: IntArray) -> tuple[FloatArray, IntArray, int, float]:
    """Join near vertices of borders, and of walls that face each other; how many are gone, largest move."""
    loose = np.zeros(len(vertices), dtype=bool)
    loose[border_of(faces)[:, 1:]] = True
    part = _labels(faces[:, [0, 1]].ravel(), faces[:, [1, 2]].ravel(), len(vertices))
    if not loose.any() and (part[faces[:, 0]] == part[faces[0, 0]]).all():
        return vertices, faces, 0, 0.0
    shortest = np.full(len(vertices), np.inf)
    for ahead in (1, 2):
        to = np.roll(faces, ahead, axis=1)
        np.minimum.at(shortest, faces, np.linalg.norm(vertices[faces] - vertices[to], axis=2))
    used = np.unique(faces)
    i, j = used[cKDTree(vertices[used]).query_pairs(JOIN_MM, output_type="ndarray")].T
    # A short side must not shrink to a point.
    apart = np.linalg.norm(vertices[i] - vertices[j], axis=1)
    near = (part[i] != part[j]) | (loose[i] & loose[j])
    near &= apart <= 0.1 * np.minimum(shortest[i], shortest[j])
    i, j = i[near], j[near]
    walls = _on_equal_ones(_labels(i, j, len(vertices))[faces])[1]
    loose[faces[walls]] = True
    label = _labels(i[loose[i] & loose[j]], j[loose[i] & loose[j]], len(vertices))
    count = np.bincount(label)
    # Sums about one of them, so that equal ones stay where they are.
    about = np.empty((len(count), 3))
    about[label] = vertices
    away = vertices - about[label]
    mean = about + np.column_stack([np.bincount(label, away[:, axis]) / count for axis in range(3)])
    moved = float(np.linalg.norm(mean[label] - vertices, axis=1).max())
    faces = label[faces]
    return mean, faces[(faces != np.roll(faces, 1, axis=1)).all(axis=1)], len(vertices) - len(count), moved


def _on_equal_ones(faces: IntArray) -> tuple[np.ndarray, np.ndarray]:
    """Whether each triangle has the corners of an earlier one, and whether of one with the other side out."""
    # From the lowest corner on, two triangles of one side have the same order of corners.
    turned = np.take_along_axis(faces, (faces.argmin(axis=1)[:, None] + np.arange(3)) % 3, axis=1)
    left = turned[:, 1] < turned[:, 2]
    corners = np.column_stack([turned[:, 0], np.sort(turned[:, 1:], axis=1)])
    order = np.lexsort(corners.T)
    again = np.r_[False, (np.diff(corners[order], axis=0) == 0).all(axis=1)]
    group = np.cumsum(~again) - 1
    both = (np.bincount(group, left[order]) > 0) & (np.bincount(group, ~left[order]) > 0)
    twice, wall = np.empty((2, len(faces)), dtype=bool)
    twice[order], wall[order] = again, both[group]
    return twice, wall


def _parted(vertices: FloatArray, faces: IntArray) -> tuple[FloatArray, IntArray]:
    """Give closed parts that meet along an edge vertices of their own; raise an error if others meet."""
    a, b, edge, count = _half_edges(faces)
    if count.max() <= 2:
        return vertices, faces
    order = np.argsort(edge, kind="stable")
    pair = order[count[edge[order]] == 2] % len(faces)
    part = _labels(pair[::2], pair[1::2], len(faces))
    _, sides = np.unique(np.tile(part, 3) * len(count) + edge, return_inverse=True)
    wrong = np.flatnonzero((count[edge] > 2) & (np.bincount(sides)[sides] != 2))
    if wrong.size:
        x, y, z = 0.5 * (vertices[a[wrong[0]]] + vertices[b[wrong[0]]])
        raise InputError(
            "A surface must have two triangles at most along each edge: "
            f"{len(np.unique(edge[wrong])):,} edges have more, one at ({x:.4g}, {y:.4g}, {z:.4g}) mm; leave "
            "out inner walls, for example by the Boolean union of a CAD program."
        )
    corner, number = np.unique(part[:, None] * len(vertices) + faces, return_inverse=True)
    return vertices[corner % len(vertices)], number.reshape(faces.shape)


def _turned_alike(faces: IntArray) -> tuple[IntArray, int]:
    """Triangles turned so that neighbours have the same side out, as most of their part, and how many."""
    a, _, edge, count = _half_edges(faces)
    order = np.argsort(edge, kind="stable")
    one, other = order[count[edge[order]] == 2].reshape(-1, 2).T
    against = (a[one] == a[other]).astype(np.int64)
    if not against.any():
        return faces, 0
    # Each triangle is there twice, as it is and turned; links join those of one side.
    n = len(faces)
    one, other = one % n, other % n
    label = _labels(np.r_[one, one + n], np.r_[other + n * against, other + n * (1 - against)], 2 * n)
    if (label[:n] == label[n:]).any():
        raise InputError(
            "A surface must have two sides: a strip of its triangles has one, as a Möbius strip."
        )
    turned = label[:n] > label[n:]
    part = np.unique(np.minimum(label[:n], label[n:]), return_inverse=True)[1]
    turned ^= (np.bincount(part, turned) > 0.5 * np.bincount(part))[part]
    return np.where(turned[:, None], faces[:, ::-1], faces), int(turned.sum())


def _check_walls(vertices: FloatArray, faces: IntArray) -> None:
    """Raise an error if steep walls of two parts face each other within `JOIN_MM`."""
    layer = layers_of(vertices, faces)
    if not layer.any():
        return
    corners = vertices[faces]
    middle = corners.mean(axis=1)
    normal = np.cross(corners[:, 1] - corners[:, 0], corners[:, 2] - corners[:, 0])
    length = np.linalg.norm(normal, axis=1)
    normal /= np.where(length > 0.0, length, 1.0)[:, None]
    steep = np.abs(normal[:, 1]) < _STEEP
    for number in range(int(layer.max()) + 1):
        tree = Triangles.of(vertices, with_area(vertices, faces[layer == number]))
        others = np.flatnonzero((layer != number) & (length > 0.0) & steep)
        gap, facing = tree.gap(middle[others])
        meets = np.flatnonzero((np.abs(gap) <= JOIN_MM) & ((facing * normal[others]).sum(axis=1) < -0.9))
        if meets.size:
            place = ", ".join(f"{at:.4g}" for at in middle[others[meets[0]]])
            raise InputError(
                f"Parts of a surface must overlap or stand apart by more than {JOIN_MM:g} mm: walls of two "
                f"are {np.abs(gap[meets]).max():.2g} mm apart at ({place}) mm; unite them, for example by "
                "the Boolean union of a CAD program."
            )
