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
    """Nodes of a mesh in one plane, in grid order.

    Parameters
    ----------
    right_mm, up_mm : array (n_outline, n_through + 1)
        Coordinates in the plane, through from the skin to the bone. [mm]
    under_nail : bool array (n_outline,)
        Whether the node on the skin lies under the nail.
    """

    right_mm: Matrix
    up_mm: Matrix
    under_nail: TruthVector


@result_class
class MeshPicture:
    """The mesh without load (Figure 1).

    Parameters
    ----------
    x_mm, y_mm, z_mm : array (n_along + 1, n_around + 1)
        Nodes of the skin. [mm]
    under_nail : bool array (n_along + 1, n_around + 1)
        Whether they lie under the nail.
    along : MeshPlane
        Plane z = 0; right is x, up is y. The outline runs from the volar side over the tip to the back.
    across : MeshPlane
        Proximal end, beside the middle phalanx; right is z, up is y.
    half : bool
        Whether `across` is one half, whose other half is its mirror image.
    contact_mm : (float, float)
        x and y of the skin at the contact. [mm]
    layers : tuple of str
        From the skin inwards.
    layer : int array (n_through,)
        Index into `layers` of each element through the skin.
    receptor_depth_mm : float
        Of the end organs below the skin. [mm]
    nodes, elements : int
        Of the whole mesh.
    """

    x_mm: Matrix
    y_mm: Matrix
    z_mm: Matrix
    under_nail: TruthMatrix
    along: MeshPlane
    across: MeshPlane
    half: bool
    contact_mm: tuple[float, float]
    layers: tuple[str, ...]
    layer: WholeVector
    receptor_depth_mm: float
    nodes: int
    elements: int


def mesh_picture(mesh: Mesh, contact_x_mm: float) -> MeshPicture:
    """Cut a mesh along the finger, and across it at its proximal end.

    Parameters
    ----------
    mesh : Mesh
        A finger.
    contact_x_mm : float
        x of the contact on the midline. [mm]

    Returns
    -------
    MeshPicture

    Examples
    --------
    >>> from fingerpad.geometry.fingertip import Fingertip
    >>> from fingerpad.geometry.grading import resolution_grading
    >>> from fingerpad.geometry.mesh import finger_mesh
    >>> picture = mesh_picture(finger_mesh(Fingertip(), resolution_grading("quick", 17.37)), 17.37)
    >>> picture.along.right_mm.shape, picture.across.right_mm.shape, round(picture.contact_mm[1], 2)
    ((81, 10), (17, 10), -9.85)
    """
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
