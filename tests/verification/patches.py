"""Patch tests: a homogeneous deformation of the boundary must be found inside, whatever the mesh."""

from __future__ import annotations

from dataclasses import replace

import numpy as np

from fingerpad.geometry.mesh import Mesh, block_mesh
from fingerpad.geometry.mesh_checks import jacobian_at_gauss
from fingerpad.mechanics.materials import Material

from .case import Row, at_least, at_most, case
from .solid import Solid, at_points

THEME = "Patch tests"
POLYNOMIAL = Material.polynomial(4.0, 1.5, 2.5, 0.7, 0.9, poisson=0.48)
LINEAR = Material.linear_elastic(100.0, 0.3)
STRAIN = np.array([[1.0, 0.5, -0.2], [0.3, -0.7, 0.4], [-0.6, 0.2, 0.9]])


def shaken(mesh: Mesh, nodes, size):
    """The mesh with some nodes moved at random by up to `size`."""
    moved = mesh.nodes_mm.copy()
    moved[nodes] += np.random.default_rng(7).uniform(-size, size, (nodes.size, 3))
    return replace(mesh, nodes_mm=moved)


def bricks():
    """3 x 3 x 3 distorted bricks and their interior nodes."""
    mesh = block_mesh(np.arange(4.0), np.arange(4.0), np.arange(4.0), layers=[2, 2, 2])
    interior = np.flatnonzero(((mesh.nodes_mm > 0) & (mesh.nodes_mm < 3)).all(axis=1))
    return shaken(mesh, interior, 0.2), interior


def disc(rings, slices=5):
    """A disc of `rings` rings, the inner one of wedges that meet in the axis, and its interior nodes."""
    mesh = block_mesh(np.arange(rings + 1.0), np.arange(4.0), np.arange(slices + 1.0), layers=[2, 2, 2])
    x, y, z = mesh.nodes_mm.T
    radius, angle = rings - x, 2 * np.pi * z / slices
    same = np.arange(len(x))
    for node in range(len(x)):  # the seam closes, and the axis is one node per height
        if x[node] == rings or z[node] == slices:
            same[node] = np.flatnonzero((x == x[node]) & (y == y[node]) & (z == 0.0))[0]
    mesh = replace(
        mesh,
        nodes_mm=np.stack([radius * np.cos(angle), y, -radius * np.sin(angle)], axis=1),
        elements=same[mesh.elements],
    )
    used = np.unique(mesh.elements)
    interior = used[(radius[used] < rings) & (y[used] > 0) & (y[used] < 3)]
    return shaken(mesh, interior, 0.15), interior


PATCHES = {
    "distorted bricks": bricks,
    "wedges about an axis": lambda: disc(1),
    "wedges inside a ring of bricks": lambda: disc(2),
}


def errors(patch, material, gradient, tolerance):
    """Largest errors of interior displacement [mm] and of F at the Gauss points, from a zero start."""
    mesh, interior = PATCHES[patch]()
    given = np.ones(mesh.nodes_mm.shape, dtype=bool)
    given[interior] = False
    exact = mesh.nodes_mm @ gradient.T
    found = Solid(mesh, (material,) * 4).solve(given, exact, steps=2, tolerance=tolerance)
    used = np.unique(mesh.elements)
    moved = at_points(mesh, found)[3] - (np.eye(3) + gradient)
    return np.abs(found - exact)[used].max(), np.abs(moved).max()


def both_errors(material, gradient, bound, tolerance):
    """Rows for every patch."""
    rows = []
    for patch in PATCHES:
        displacement, deformation = errors(patch, material, gradient, tolerance)
        rows.append(at_most(f"{patch}: displacement", bound, displacement, "mm"))
        rows.append(at_most(f"{patch}: deformation gradient", 10 * bound, deformation))
    return rows


@case(THEME, "Small strain, nu = 0.3", "Irons & Razzaque 1972")
def patch_small_strain() -> list[Row]:
    """Boundary nodes follow a strain of 1e-4; largest errors inside. Zero to round-off."""
    return both_errors(LINEAR, 1e-4 * STRAIN, 1e-14, tolerance=1e-11)


@case(THEME, "Finite strain, polynomial law, nu = 0.48", "Irons & Razzaque 1972")
def patch_finite_strain() -> list[Row]:
    """The same with strains of up to 0.3."""
    return both_errors(POLYNOMIAL, 0.3 * STRAIN, 1e-12, tolerance=1e-13)


@case(THEME, "Distortion of the patches", "Shape of the meshes above")
def patch_distortion() -> list[Row]:
    """Smallest over largest Jacobian of any element: away from 1, so that the patch tests are sensitive, and
    above 0.
    """
    rows = []
    for patch, make in PATCHES.items():
        mesh, _ = make()
        jacobian = jacobian_at_gauss(mesh)
        rows.append(at_least(f"{patch}: smallest Jacobian", 1e-3, jacobian.min(), "mm³"))
        ratio = (jacobian.min(axis=1) / jacobian.max(axis=1)).min()
        rows.append(at_most(f"{patch}: smallest over largest in an element", 0.7, ratio))
    return rows
