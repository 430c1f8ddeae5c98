"""Figure 1: the mesh that the standard sphere presses, in two planes, with its layers."""

from __future__ import annotations

import numpy as np

from fingerpad.core.checks import FloatArray, IntArray
from fingerpad.core.results import Matrix, TruthMatrix, TruthVector, WholeVector, result_class
from fingerpad.data import fingertip
from fingerpad.geometry.mesh import LAYERS, Mesh

DECIMALS = 4
"""Decimals of coordinates in files: 0.1 µm. [mm]"""


@result_class
class MeshPlane:
    """Nodes of a mesh in one plane, in grid order."""

    right_mm: Matrix
    up_mm: Matrix
    """Coordinates in the plane, through from the skin to the bone, (n_outline, n_through + 1). [mm]"""
    under_nail: TruthVector
    """Whether the node on the skin lies under the nail, (n_outline,)."""


@result_class
class MeshPicture:
    """The mesh without load (Figure 1)."""

    x_mm: Matrix
    y_mm: Matrix
    z_mm: Matrix
    """Nodes of the skin, (n_along + 1, n_around + 1). [mm]"""
    under_nail: TruthMatrix
    """Whether they lie under the nail, (n_along + 1, n_around + 1)."""
    along: MeshPlane
    """Plane z = 0; right is x, up is y. The outline runs from the volar side over the tip to the back."""
    across: MeshPlane
    """Proximal end, beside the middle phalanx; right is z, up is y."""
    half: bool
    """Whether `across` is one half, whose other half is its mirror image."""
    contact_mm: tuple[float, float]
    """x and y of the skin at the contact. [mm]"""
    layers: tuple[str, ...]
    """From the skin inwards."""
    layer: WholeVector
    """Index into `layers` of each element through the skin, (n_through,)."""
    receptor_depth_mm: float
    """Of the end organs below the skin. [mm]"""
    nodes: int
    elements: int
    """Of the whole mesh."""


def mesh_picture(mesh: Mesh, contact_x_mm: float) -> MeshPicture:
    """Cut a mesh along the finger, and across it at its proximal end."""
    midline = mesh.nodes_mm[mesh.midline_nodes]
    nearest = int(np.abs(midline[:, 0] - contact_x_mm).argmin())
    x, y, _ = midline[nearest].round(DECIMALS).tolist()
    skin = mesh.nodes_mm[mesh.skin_grid].round(DECIMALS)
    return MeshPicture(
        x_mm=skin[..., 0],
        y_mm=skin[..., 1],
        z_mm=skin[..., 2],
        under_nail=np.isin(mesh.skin_grid, mesh.nail_nodes),
        along=_plane(mesh, outline_nodes(mesh), 0),
        across=_plane(mesh, mesh.grid[0], 2),
        half=not mesh.full,
        contact_mm=(x, y),
        layers=LAYERS,
        layer=mesh.layer[: mesh.shape[2]],
        receptor_depth_mm=fingertip.RECEPTOR_DEPTH.value,
        nodes=len(mesh.nodes_mm),
        elements=len(mesh.elements),
    )


def outline_nodes(mesh: Mesh) -> IntArray:
    """Nodes on the plane z = 0, (2 n_along + 1, n_through + 1), from the pad over the tip to the back."""
    volar = mesh.shape[1] // 2 if mesh.full else 0
    return np.concatenate([mesh.grid[:, volar], mesh.grid[-2::-1, -1]])


def outline_elements(mesh: Mesh) -> IntArray:
    """Elements beside the plane z = 0, (2 n_along, n_through), in the order of `outline_nodes`."""
    numbers = np.arange(len(mesh.elements)).reshape(mesh.shape)
    volar = mesh.shape[1] // 2 if mesh.full else 0
    return np.concatenate([numbers[:, volar], numbers[::-1, -1]])


def _plane(mesh: Mesh, nodes: IntArray, right: int) -> MeshPlane:
    points: FloatArray = mesh.nodes_mm[nodes].round(DECIMALS)
    return MeshPlane(
        right_mm=points[..., right], up_mm=points[..., 1], under_nail=np.isin(nodes[:, 0], mesh.nail_nodes)
    )
