"""A finger that is a mesh of one's own: bricks and wedges in any order, and what its skin needs."""

from __future__ import annotations

from dataclasses import dataclass, fields
from functools import cached_property

import numpy as np
from numpy.typing import ArrayLike
from scipy.spatial import cKDTree

from fingerpad.core.checked import value_class
from fingerpad.core.errors import InputError
from fingerpad.core.values import Finite, FloatArray, IntArray
from fingerpad.geometry.fingertip import Finger
from fingerpad.geometry.grading import Grading
from fingerpad.geometry.mesh import Mesh

FACES = np.array([[0, 3, 2, 1], [4, 5, 6, 7], [0, 1, 5, 4], [1, 2, 6, 5], [2, 3, 7, 6], [3, 0, 4, 7]])
"""Corners of the faces of a brick, counter-clockwise seen from outside."""

_NEAR_TRIANGLES = 32  # Triangles nearest to a place that give the size of elements there.


@dataclass(frozen=True)
class FreeMesh(Mesh):
    """Bricks and wedges in any order.

    `skin_grid` holds the corners of the faces of the skin, and `living_epidermis` the elements around the end
    organs.
    """

    outer_elements: IntArray
    """Element of each face of the skin; its last four nodes lie on the skin where possible, (n_faces,)."""
    receptor_depth_mm: float  # Depth of the end organs below the skin, along its normal. [mm]

    @property
    def is_grid(self) -> bool:
        return False

    @cached_property
    def skin_faces(self) -> IntArray:
        return self.skin_grid

    @property
    def skin_elements(self) -> IntArray:
        return self.outer_elements

    @cached_property
    def skin_triangles(self) -> IntArray:
        """Each face of the skin cut in two, without empty halves, (n_triangles, 3)."""
        a, b, c, d = self.skin_faces.T
        cut = np.concatenate([np.stack([a, b, c], axis=1), np.stack([a, c, d], axis=1)])
        return cut[(cut != np.roll(cut, 1, axis=1)).all(axis=1)]

    @cached_property
    def skin_normals(self) -> FloatArray:
        """Outward unit normal at every node, (n_nodes, 3), weighted by area; 0 off the skin."""
        a, b, c = (self.nodes_mm[self.skin_triangles[:, n]] for n in range(3))
        normals = np.zeros_like(self.nodes_mm)
        for corner in range(3):
            np.add.at(normals, self.skin_triangles[:, corner], np.cross(b - a, c - a))
        if self.symmetry_nodes.size:
            normals[self.symmetry_nodes, 2] = 0.0
        length = np.linalg.norm(normals, axis=1, keepdims=True)
        return normals / np.where(length > 0.0, length, 1.0)

    @cached_property
    def node_depth_mm(self) -> FloatArray:
        """Distance of each node from the skin, (n_nodes,). [mm]"""
        return np.linalg.norm(self.nodes_mm - self.on_skin(self.nodes_mm)[0], axis=1)

    def on_skin(self, points_mm: FloatArray) -> tuple[FloatArray, FloatArray, FloatArray]:
        """Find the closest points of the skin."""
        triangle, weights = closest_on_triangles(points_mm, self.nodes_mm[self.skin_triangles])
        nodes = self.skin_triangles[triangle]
        feet = (weights[..., None] * self.nodes_mm[nodes]).sum(axis=1)
        normals = (weights[..., None] * self.skin_normals[nodes]).sum(axis=1)
        corners = self.nodes_mm[nodes]
        sides = np.linalg.norm(corners - np.roll(corners, 1, axis=1), axis=2)
        return feet, normals / np.linalg.norm(normals, axis=1, keepdims=True), sides.max(axis=1)


@value_class(eq=False)
class FingerMesh(Finger):
    """A finger that is a mesh of one's own, from `read_finger` or `finger_from`.

    It takes the place of a `Fingertip` in `indent`, `touch_of` and `Touch`. Resolutions choose the steps in
    time only.

    Parameters
    ----------
    mesh : FreeMesh
        The body, x towards the tip, y towards the nail. [mm]
    pad_mm : (float, float)
        x and z of the middle of the pad, `contact_mm`. [mm]
    borders_mm : (float, float, float)
        Depth of the lower borders of the outer three layers below the middle of the pad. [mm]
    """

    mesh: FreeMesh
    pad_mm: tuple[float, float]
    borders_mm: tuple[float, float, float]

    def __repr__(self) -> str:
        counts = f"{len(self.mesh.nodes_mm)} nodes, {len(self.mesh.elements)} elements"
        return f"FingerMesh({counts}, pad_mm={self.pad_mm})"

    def __eq__(self, other: object) -> bool:
        return isinstance(other, FingerMesh) and self._content == other._content

    def __hash__(self) -> int:
        return hash(self._content)

    @cached_property
    def _content(self) -> tuple[object, ...]:
        values = [getattr(self.mesh, item.name) for item in fields(self.mesh)]
        plain = tuple(value.tobytes() if isinstance(value, np.ndarray) else value for value in values)
        return (*plain, self.pad_mm, self.borders_mm)

    @property
    def contact_mm(self) -> tuple[float, float]:
        return self.pad_mm

    @property
    def layer_depths_mm(self) -> tuple[float, float, float]:
        return self.borders_mm

    @property
    def relative_size(self) -> float:
        """1: no elements are made."""
        return 1.0

    @property
    def own_mesh(self) -> Mesh:
        return self.mesh

    @cached_property
    def _upright(self) -> tuple[FloatArray, FloatArray]:
        """Triangles of the skin, (n, 3, 3), and of the bone where its faces are known. [mm]"""
        mesh = self.mesh
        faces = mesh.elements[:, FACES].reshape(-1, 4)
        held = faces[np.isin(faces, mesh.bone_nodes).all(axis=1)]
        cut = np.concatenate([held[:, [0, 1, 2]], held[:, [0, 2, 3]]])
        return mesh.nodes_mm[mesh.skin_triangles], mesh.nodes_mm[cut]

    def _heights(self, triangles: FloatArray, x: FloatArray, z: FloatArray) -> list[FloatArray]:
        """Heights y at which the upright line through each (x, z) meets triangles; mirrored if halved."""
        z = np.where(z < 0.0, -z, z) if not self.mesh.full else z
        low, high = triangles.min(axis=1), triangles.max(axis=1)
        found = []
        for here_x, here_z in zip(x.tolist(), z.tolist(), strict=True):
            near = np.flatnonzero(
                (low[:, 0] <= here_x)
                & (high[:, 0] >= here_x)
                & (low[:, 2] <= here_z)
                & (high[:, 2] >= here_z)
            )
            a, b, c = np.moveaxis(triangles[near], 1, 0)
            (bx, _, bz), (cx, _, cz) = (b - a).T, (c - a).T
            px, pz = here_x - a[:, 0], here_z - a[:, 2]
            area = bx * cz - bz * cx
            safe = np.where(area == 0.0, 1.0, area)
            u, v = (px * cz - pz * cx) / safe, (bx * pz - bz * px) / safe
            inside = (area != 0.0) & (u >= -1e-9) & (v >= -1e-9) & (u + v <= 1.0 + 1e-9)
            height = a[:, 1] + u * (b - a)[:, 1] + v * (c - a)[:, 1]
            found.append(height[inside])
        return found

    def skin_point(self, x_mm: ArrayLike, z_mm: ArrayLike) -> FloatArray:
        x, z = np.broadcast_arrays(np.asarray(x_mm, dtype=np.float64), np.asarray(z_mm, dtype=np.float64))
        heights = self._heights(self._upright[0], x.ravel(), z.ravel())
        for here_x, here_z, height in zip(x.ravel(), z.ravel(), heights, strict=True):
            if not height.size:
                raise InputError(
                    "position",
                    "must lie on the finger, on the skin of its mesh",
                    f"x = {here_x:g}, z = {here_z:g} mm",
                )
        y = np.array([height.min() for height in heights]).reshape(x.shape)
        return np.stack([x, y, z], axis=-1)

    def skin_normal(self, points_mm: ArrayLike) -> FloatArray:
        points = np.asarray(points_mm, dtype=np.float64)
        return self.mesh.on_skin(points.reshape(-1, 3))[1].reshape(points.shape)

    def depth_available_mm(self, x_mm: ArrayLike, z_mm: ArrayLike) -> FloatArray:
        below = self.skin_point(x_mm, z_mm)
        x, y, z = below.reshape(-1, 3).T
        bone, skin = (self._heights(triangles, x, z) for triangles in self._upright[::-1])
        ends = [
            min(hit[hit > start], default=max(back, default=start))
            for start, hit, back in zip(y, bone, skin, strict=True)
        ]
        depth = np.array(ends) - y
        # A mesh may end at the bone without a face there, or have no back.
        reach = float(np.ptp(self.mesh.nodes_mm[:, 1]))
        return np.where(depth > 0.0, depth, reach).reshape(below.shape[:-1])

    def own_grading(self, x_mm: Finite, z_mm: Finite) -> Grading:
        sides = self.mesh.nodes_mm[self.mesh.skin_triangles]
        away = np.linalg.norm(sides.mean(axis=1) - self.skin_point(x_mm, z_mm), axis=1)
        near = sides[np.argsort(away)[:_NEAR_TRIANGLES]]
        # The longest side of half a square face is its diagonal.
        size = float(
            np.median(np.linalg.norm(near - np.roll(near, 1, axis=1), axis=2).max(axis=1)) / np.sqrt(2)
        )
        extent = np.ptp(self.mesh.nodes_mm, axis=0)
        return Grading(x_mm, extent[0], extent[2], size, size, float(extent.max()), full=self.mesh.full)


_NEAREST = 24  # Triangles that are looked at: those whose corners or middles are nearest to a point.


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
