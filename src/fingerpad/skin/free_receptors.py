"""End organs in a mesh without rows and columns, at depths below its skin.

Values of the elements around the end organs are interpolated along the skin, never across the layers: by the
smooth surface through the nearest elements that bends least, a sum of |r|³ and a plane (polyharmonic spline,
Duchon 1977). Values that are linear along the skin are interpolated exactly. At a depth of its own, an end
organ reads the elements that hold this depth and, of the same layer, those next to them whose middles enclose
it.
"""

from __future__ import annotations

from collections.abc import Iterator
from dataclasses import dataclass
from functools import cached_property

import numpy as np
from scipy.spatial import cKDTree

from fingerpad.core.values import FloatArray, IntArray
from fingerpad.geometry.free_mesh import FreeMesh
from fingerpad.geometry.mesh_checks import faces_of
from fingerpad.skin.receptor_sheet import (
    Part,
    in_half,
    refuse_beside_skin,
    refuse_beside_tissue,
    refuse_beside_volar_skin,
)

_NEIGHBOURS = 25
_OFF_THE_SKIN = 0.25  # How far beside the skin a site may lie, over the size of the element there.

_MOST_STEPS = 20
_EXACT_MM = 1e-7
_LEAST_SLOPE = 0.1
_UPRIGHT = 0.7  # Least cosine between the depth and the way to an element above or below.
_LEAST_PIVOT = 1e-10
_LARGEST_WEIGHT = 1e3
"""Weight above which the places of elements do not determine a plane: they lie on a line."""


@dataclass(frozen=True)
class Interpolation:
    """Elements near each site and their weights."""

    elements: IntArray  #: Elements near the end organs, nearest first, by rows of a sheet, (n_sites, n_near).
    weights: FloatArray  #: Their sum is 1, (n_sites, n_near).
    points_mm: FloatArray  #: Where values that are linear in space are read, (n_sites, 3). [mm]

    def of(self, organs: IntArray) -> Interpolation:
        return Interpolation(self.elements[organs], self.weights[organs], self.points_mm[organs])


@dataclass(frozen=True)
class FreeReceptors:
    """End organs of a mesh of one's own."""

    mesh: FreeMesh

    def below(self, sites_mm: FloatArray) -> Interpolation:
        """Find end organs below points of the skin (n, 3), or by their x and z on the volar side (n, 2)."""
        return self._around(*self._organs(sites_mm, self.mesh.receptor_depth_mm), self.mesh.living_epidermis)

    def at(self, sites_mm: FloatArray, depth_mm: FloatArray) -> list[Part]:
        """Find end organs at a depth each, as of `below`."""
        mesh = self.mesh
        parts: list[Part] = []
        for depth in np.unique(depth_mm):
            sites, held = np.flatnonzero(depth_mm == depth), mesh.elements_at(depth)
            organs, normals = self._organs(sites_mm[sites], depth)
            corners = mesh.nodes_mm[mesh.elements[held]]
            away, near = cKDTree(corners.mean(axis=1)).query(organs)
            beside = away > np.linalg.norm(np.ptp(corners, axis=1), axis=1)[near] if held.size else away > 0.0
            refuse_beside_tissue(sites_mm[sites], depth_mm[sites], beside)
            for layer in np.unique(mesh.layer[held[near]]):
                some = np.flatnonzero(mesh.layer[held[near]] == layer)
                sheet = held[mesh.layer[held] == layer]
                parts += self._through(sheet, sites[some], organs[some], normals[some])
        return parts

    def _through(
        self, sheet: IntArray, sites: IntArray, organs: FloatArray, normals: FloatArray
    ) -> Iterator[Part]:
        """End organs between the middles of a sheet of elements and of those next to it in the same layer."""
        here = self._around(organs, normals, sheet)
        # How much deeper than the middles the end organs lie.
        short = ((here.points_mm - organs) * normals).sum(axis=1)
        for way, chosen in ((0, short < 0.0), (1, short >= 0.0)):
            beside = self._neighbours[sheet, way]
            following = np.unique(beside[beside >= 0])
            share = np.zeros(len(organs))
            some = np.flatnonzero(chosen & (beside[here.elements[:, 0]] >= 0))
            if some.size:
                there = self._around(organs[some], normals[some], following)
                gap = ((here.points_mm[some] - there.points_mm) * normals[some]).sum(axis=1)
                share[some] = np.clip(short[some] / np.where(gap == 0.0, np.inf, gap), 0.0, 1.0)
                yield Part(following, sites[some], there, share[some])
            here_too = np.flatnonzero(chosen)
            yield Part(sheet, sites[here_too], here.of(here_too), 1.0 - share[here_too])

    @cached_property
    def _neighbours(self) -> IntArray:
        """Element of the same layer above and below each element, -1 without one, (n_elements, 2)."""
        mesh = self.mesh
        _, owner, face = faces_of(mesh.elements)
        order = np.argsort(face, kind="stable")
        shared = np.flatnonzero(np.diff(face[order]) == 0)
        first, second = (owner[order[shared + n]] for n in (0, 1))
        middles, depth = (
            values[mesh.elements].mean(axis=1) for values in (mesh.nodes_mm, mesh.node_depth_mm)
        )
        rise = depth[second] - depth[first]
        upright = np.abs(rise) > _UPRIGHT * np.linalg.norm(middles[second] - middles[first], axis=1)
        upright &= mesh.layer[first] == mesh.layer[second]
        above, below = (np.where(rise > 0.0, *pair)[upright] for pair in ((first, second), (second, first)))
        found = np.full((len(mesh.elements), 2), -1)
        found[below, 0], found[above, 1] = above, below
        return found

    def _organs(self, sites_mm: FloatArray, depth_mm: float) -> tuple[FloatArray, FloatArray]:
        """End organs at a depth, and the normals of the skin above them."""
        found = self._below if sites_mm.shape[1] == 3 else self._under
        return found(sites_mm, depth_mm)

    def _below(self, sites_mm: FloatArray, depth_mm: float) -> tuple[FloatArray, FloatArray]:
        inside = in_half(self.mesh, sites_mm)
        feet, normals, sizes = self.mesh.on_skin(inside)
        away = np.linalg.norm(feet - inside, axis=1)
        refuse_beside_skin(sites_mm, away > _OFF_THE_SKIN * sizes, away)
        return feet - depth_mm * normals, normals

    def _under(self, organs_mm: FloatArray, depth_mm: float) -> tuple[FloatArray, FloatArray]:
        target = in_half(self.mesh, organs_mm)
        volar_mm, by_place = self._volar
        feet = volar_mm[by_place.query(target)[1]]
        organs, normals = np.empty_like(feet), np.empty_like(feet)
        unsolved = np.arange(len(feet))
        for _ in range(_MOST_STEPS):
            feet[unsolved], normals[unsolved], _ = self.mesh.on_skin(feet[unsolved])
            organs[unsolved] = feet[unsolved] - depth_mm * normals[unsolved]
            step = target[unsolved] - organs[unsolved][:, [0, 2]]
            far = np.abs(step).max(axis=1) > _EXACT_MM
            unsolved, step = unsolved[far], step[far]
            if not unsolved.size:
                break
            # Along the skin, so that a step in x and z is made.
            normal = normals[unsolved]
            upright = np.where(np.abs(normal[:, 1]) > _LEAST_SLOPE, normal[:, 1], -_LEAST_SLOPE)
            rise = -(step[:, 0] * normal[:, 0] + step[:, 1] * normal[:, 2]) / upright
            feet[unsolved] += np.column_stack([step[:, 0], rise, step[:, 1]])
        missed = np.linalg.norm(organs[:, [0, 2]] - target, axis=1) > self._size_mm
        refuse_beside_volar_skin(organs_mm, missed | (normals[:, 1] >= 0.0))
        return organs, normals

    def read(self, places: Interpolation, values: FloatArray) -> FloatArray:
        """Interpolate values (n_times, n_sheet) of a sheet of elements: (n_times, n_sites)."""
        known = np.asarray(values, dtype=np.float64)[:, places.elements]
        return np.einsum("tsk,sk->ts", known, places.weights)

    @cached_property
    def _volar(self) -> tuple[FloatArray, cKDTree]:
        """Nodes of the skin that face down, and how to find them by x and z."""
        nodes = self.mesh.skin_nodes
        volar_mm = self.mesh.nodes_mm[nodes[self.mesh.skin_normals[nodes, 1] < 0.0]]
        return volar_mm, cKDTree(volar_mm[:, [0, 2]])

    @cached_property
    def _size_mm(self) -> float:
        """Tolerance of a place along the skin."""
        corners = self.mesh.nodes_mm[self.mesh.skin_triangles]
        return 0.02 * float(np.median(np.linalg.norm(corners - np.roll(corners, 1, axis=1), axis=2)))

    def _middles(self, sheet: IntArray) -> tuple[FloatArray, IntArray]:
        """Middles of elements, mirrored ones too, and their rows."""
        middles = self.mesh.nodes_mm[self.mesh.elements[sheet]].mean(axis=1)
        rows = np.arange(len(middles))
        if self.mesh.full:
            return middles, rows
        return np.concatenate([middles, middles * [1.0, 1.0, -1.0]]), np.concatenate([rows, rows])

    def _around(self, organs: FloatArray, normals: FloatArray, sheet: IntArray) -> Interpolation:
        middles, rows = self._middles(sheet)
        count = min(_NEIGHBOURS, len(middles))
        away, near = cKDTree(middles).query(organs, k=count)
        away, near = away.reshape(len(organs), count), near.reshape(len(organs), count)
        # Two directions along the skin.
        first = np.cross(normals, [0.0, 0.0, 1.0])
        flank = np.linalg.norm(first, axis=1) < 0.1
        first[flank] = np.cross(normals[flank], [1.0, 0.0, 0.0])
        first /= np.linalg.norm(first, axis=1, keepdims=True)
        second = np.cross(normals, first)
        offset = middles[near] - organs[:, None]
        reach = away[:, -1:]
        u, v = ((offset * way[:, None]).sum(axis=2) / reach for way in (first, second))
        apart = np.hypot(u[:, :, None] - u[:, None], v[:, :, None] - v[:, None])
        plane = np.stack([np.ones_like(u), u, v], axis=2)
        system = np.zeros((len(organs), count + 3, count + 3))
        system[:, :count, :count] = apart**3
        system[:, :count, count:], system[:, count:, :count] = plane, np.swapaxes(plane, 1, 2)
        # At the end organ u and v are 0; the system is symmetric, so its solution is the row of weights.
        wanted = np.concatenate([np.hypot(u, v) ** 3, np.tile([1.0, 0.0, 0.0], (len(organs), 1))], axis=1)
        weights = _solved(system, wanted)[:, :count]
        return Interpolation(rows[near], weights, np.einsum("nk,nki->ni", weights, middles[near]))


def _solved(systems: FloatArray, wanted: FloatArray) -> FloatArray:
    """Solve symmetric systems (n, m, m); those without a unique solution, for the shortest one."""
    try:
        found = np.asarray(np.linalg.solve(systems, wanted[..., None])[..., 0], dtype=np.float64)
    except np.linalg.LinAlgError:
        found = np.full_like(wanted, np.inf)
    wild = ~(np.abs(found).max(axis=1, initial=0.0) < _LARGEST_WEIGHT)
    if wild.any():
        inverse = np.linalg.pinv(systems[wild], rcond=_LEAST_PIVOT, hermitian=True)
        found[wild] = (inverse @ wanted[wild][..., None])[..., 0]
    return found
