"""End organs in a mesh without rows and columns, at a depth below its skin.

Values of the elements around the end organs are interpolated along the skin, never across the layers: by the
smooth surface through the nearest elements that bends least, a sum of |r|³ and a plane (polyharmonic spline,
Duchon 1977). Values that are linear along the skin are interpolated exactly.
"""

from __future__ import annotations

from dataclasses import dataclass
from functools import cached_property

import numpy as np
from scipy.spatial import cKDTree

from fingerpad.core.errors import InputError
from fingerpad.core.values import FloatArray, IntArray
from fingerpad.geometry.free_mesh import FreeMesh

_NEIGHBOURS = 25
_OFF_THE_SKIN = 0.25  # How far beside the skin a site may lie, over the size of the element there.

_MOST_STEPS = 20
_EXACT_MM = 1e-7
_LEAST_SLOPE = 0.1
_LEAST_PIVOT = 1e-10
_LARGEST_WEIGHT = 1e3
"""Weight above which the places of elements do not determine a plane: they lie on a line."""


@dataclass(frozen=True)
class Interpolation:
    """Elements near each site and their weights."""

    elements: IntArray  # Rows of the elements around the end organs, (n_sites, n_neighbours).
    weights: FloatArray  # Their sum is 1, (n_sites, n_neighbours).


@dataclass(frozen=True)
class FreeReceptors:
    """End organs of a mesh of one's own."""

    mesh: FreeMesh

    def below(self, sites_mm: FloatArray) -> Interpolation:
        """Find end organs below points of the skin, on any side; InputError if one is not on the skin."""
        inside = self._in_mesh(sites_mm)
        feet, normals, sizes = self.mesh.on_skin(inside)
        away = np.linalg.norm(feet - inside, axis=1)
        missed = away > _OFF_THE_SKIN * sizes
        if missed.any():
            x, y, z = sites_mm[np.argmax(missed)]
            raise InputError(
                "sites",
                "must lie on the skin of the mesh",
                remedy=f"(x, y, z) = ({x:g}, {y:g}, {z:g}) mm is {away[np.argmax(missed)]:.2g} mm beside it",
            )
        return self._around(feet - self.mesh.receptor_depth_mm * normals, normals)

    def under(self, organs_mm: FloatArray) -> Interpolation:
        """Find end organs by their own x and z on the volar side; InputError if there is none."""
        target = self._in_mesh(organs_mm)
        feet = self._volar_mm[self._volar_tree.query(target)[1]]
        organs, normals = np.empty_like(feet), np.empty_like(feet)
        unsolved = np.arange(len(feet))
        for _ in range(_MOST_STEPS):
            feet[unsolved], normals[unsolved], _ = self.mesh.on_skin(feet[unsolved])
            organs[unsolved] = feet[unsolved] - self.mesh.receptor_depth_mm * normals[unsolved]
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
        missed |= normals[:, 1] >= 0.0
        if missed.any():
            x, z = organs_mm[np.argmax(missed)]
            raise InputError(
                "sites",
                "must lie on the volar skin of the mesh",
                remedy=f"(x, z) = ({x:g}, {z:g}) mm does not",
            )
        return self._around(organs, normals)

    def read(self, places: Interpolation, values: FloatArray) -> FloatArray:
        """Interpolate values (n_times, n_sheet) of `mesh.living_epidermis`: (n_times, n_sites)."""
        known = np.asarray(values, dtype=np.float64)[:, places.elements]
        return np.einsum("tsk,sk->ts", known, places.weights)

    def _in_mesh(self, sites: FloatArray) -> FloatArray:
        inside = sites.copy()
        if not self.mesh.full:
            inside[:, -1] = np.abs(inside[:, -1])
        return inside

    @cached_property
    def _volar_mm(self) -> FloatArray:
        """Nodes of the skin that face down."""
        nodes = self.mesh.skin_nodes
        return self.mesh.nodes_mm[nodes[self.mesh.skin_normals[nodes, 1] < 0.0]]

    @cached_property
    def _volar_tree(self) -> cKDTree:
        return cKDTree(self._volar_mm[:, [0, 2]])

    @cached_property
    def _size_mm(self) -> float:
        """Tolerance of a place along the skin."""
        corners = self.mesh.nodes_mm[self.mesh.skin_triangles]
        return 0.02 * float(np.median(np.linalg.norm(corners - np.roll(corners, 1, axis=1), axis=2)))

    @cached_property
    def _middles(self) -> tuple[FloatArray, IntArray]:
        """Middles of the elements around the end organs, mirrored ones too, and their rows."""
        mesh = self.mesh
        middles = mesh.nodes_mm[mesh.elements[mesh.living_epidermis]].mean(axis=1)
        rows = np.arange(len(middles))
        if mesh.full:
            return middles, rows
        return np.concatenate([middles, middles * [1.0, 1.0, -1.0]]), np.concatenate([rows, rows])

    def _around(self, organs: FloatArray, normals: FloatArray) -> Interpolation:
        middles, rows = self._middles
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
        return Interpolation(rows[near], _solved(system, wanted)[:, :count])


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
