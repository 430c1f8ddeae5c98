"""Figure 1: the mesh of the finger in two planes, its layers, bone, nail and the depth of the receptors."""

from __future__ import annotations

import numpy as np
from matplotlib.axes import Axes
from matplotlib.collections import LineCollection, PolyCollection
from matplotlib.figure import Figure
from matplotlib.patches import Patch, Rectangle

from fingerpad.core.checks import FloatArray
from fingerpad.experiments.gerling2014.mesh_picture import MeshPicture, MeshPlane
from fingerpad.report.formatting import joined, number
from fingerpad.report.style import BLACK, new_figure

LAYER_COLOURS = ("#2b1a3d", "#d9650a", "#f2b183", "#fbeee2")
"""From the skin inwards; the lightness increases, so that the layers differ in greyscale."""

BONE, NAIL = "#a9b4bd", "#0a5c99"
NAIL_WIDTH = 4.0

ENLARGED_MM = (1.3, 2.2)
"""Half the width and the height of the enlarged part. [mm]"""


def faces_of(right_mm: FloatArray, up_mm: FloatArray) -> FloatArray:
    """Corners of the faces between the nodes of a grid, (n_faces, 4, 2). [mm]"""
    points = np.stack([right_mm, up_mm], axis=-1)
    return np.stack([points[:-1, :-1], points[1:, :-1], points[1:, 1:], points[:-1, 1:]], axis=2).reshape(
        -1, 4, 2
    )


def draw_mesh(section: MeshPicture) -> Figure:
    """Draw Figure 1: the section along the finger, the one across it, and the layers below the contact."""
    figure = new_figure(13.0, 4.6)
    grid = figure.add_gridspec(1, 3, width_ratios=(2.0, 1.25, 1.0))
    along, across, near = (figure.add_subplot(grid[0, column]) for column in range(3))
    x, y = section.contact_mm
    _draw_plane(along, section.along, section, lines=0.15)
    _draw_plane(across, section.across, section, lines=0.15)
    if section.half:
        _draw_plane(across, section.across, section, lines=0.15, sign=-1.0)
    _draw_plane(near, section.along, section, lines=0.4)
    _name_fixed_parts(along, section.along, mirrored=False)
    _name_fixed_parts(across, section.across, mirrored=section.half)
    width, height = ENLARGED_MM
    corner = (x - width, y - 0.15)
    along.add_patch(
        Rectangle(corner, 2.0 * width, height, fill=False, edgecolor=BLACK, linewidth=1.2, zorder=5)
    )
    near.set(xlim=(corner[0], corner[0] + 2.0 * width), ylim=(corner[1], corner[1] + height))
    epidermis = int((section.layer < section.layers.index("dermis")).sum())
    receptor = _below_contact(section)[epidermis]
    near.plot(*receptor, "o", markersize=8.0, color="white", markeredgecolor=BLACK, zorder=6)
    near.annotate(
        f"receptor, {number(section.receptor_depth_mm)} mm deep",
        receptor,
        xytext=(x, y + 1.0),
        arrowprops={"arrowstyle": "-", "color": BLACK},
        ha="center",
        fontsize=9.0,
        bbox={"facecolor": "white", "edgecolor": "none", "alpha": 0.9, "pad": 1.5},
        zorder=6,
    )
    for axes, title, label in (
        (along, "(a) along the finger, z = 0", "x, distal [mm]"),
        (across, f"(b) across, x = {number(x)} mm", "z, lateral [mm]"),
        (near, "(c) frame of (a)", "x, distal [mm]"),
    ):
        axes.set(title=title, xlabel=label, ylabel="y, dorsal [mm]", aspect="equal")
        axes.grid(visible=False)
    patches = [
        Patch(facecolor=colour, edgecolor=BLACK, linewidth=0.5, label=name)
        for name, colour in zip(section.layers, LAYER_COLOURS, strict=True)
    ]
    figure.legend(handles=patches, loc="outside lower center", ncols=len(patches))
    return figure


def _draw_plane(axes: Axes, plane: MeshPlane, section: MeshPicture, lines: float, sign: float = 1.0) -> None:
    """Draw the elements of a plane by layers, the bone inside of them and the nail upon them."""
    right, up = sign * plane.right_mm, plane.up_mm
    colours = np.tile(np.array(LAYER_COLOURS)[section.layer], right.shape[0] - 1)
    axes.fill(right[:, -1], up[:, -1], facecolor=BONE, edgecolor="none", zorder=0)
    axes.add_collection(
        PolyCollection(
            list(faces_of(right, up)), facecolors=colours.tolist(), edgecolors="#00000080", linewidths=lines
        )
    )
    skin = np.stack([right[:, 0], up[:, 0]], axis=-1)
    covered = plane.under_nail[1:] & plane.under_nail[:-1]
    edges = np.stack([skin[:-1], skin[1:]], axis=1)[covered]
    axes.add_collection(LineCollection(list(edges), colors=NAIL, linewidths=NAIL_WIDTH, capstyle="round"))
    axes.autoscale_view()


def _name_fixed_parts(axes: Axes, plane: MeshPlane, mirrored: bool) -> None:
    """Write bone and nail beside them: in grey they resemble the layers."""
    bone = plane.right_mm[:, -1], plane.up_mm[:, -1]
    right, up = (0.5 * float(values.min() + values.max()) for values in bone)
    axes.text(0.0 if mirrored else right, up, "bone", ha="center", va="center")
    nail = plane.right_mm[plane.under_nail, 0], plane.up_mm[plane.under_nail, 0]
    if nail[0].size:
        axes.annotate(
            "nail",
            (0.0 if mirrored else float(nail[0].mean()), float(nail[1].max())),
            xytext=(0.0, 6.0),
            textcoords="offset points",
            ha="center",
            color=NAIL,
        )
        axes.set_ylim(top=axes.get_ylim()[1] + 1.5)


def caption_mesh(section: MeshPicture) -> str:
    """Describe Figure 1."""
    depths = _thicknesses(section)
    named = [f"{name} {number(depth)} mm" for name, depth in zip(section.layers, depths, strict=True)]
    return (
        "Finite-element mesh of the fingertip that the standard sphere presses, without load: "
        f"{number(section.nodes)} nodes and {number(section.elements)} elements"
        f"{' in one half of the finger; the other half in (b) is its mirror image' if section.half else ''}. "
        "(a) Plane of symmetry, (b) section through the point of contact, (c) the layers below this point. "
        f"Thickness there: {joined(named)}. Circle: an end organ, on the border of epidermis and dermis. "
        "Bone and nail are rigid and have no elements. The outline is that of the model which the authors' "
        "laboratory published later; the thicknesses of epidermis and dermis are the paper's."
    )


def _below_contact(section: MeshPicture) -> FloatArray:
    """Nodes from the contact to the bone, (n_through + 1, 2). [mm]"""
    x, y = section.contact_mm
    plane = section.along
    column = int(np.hypot(plane.right_mm[:, 0] - x, plane.up_mm[:, 0] - y).argmin())
    return np.stack([plane.right_mm[column], plane.up_mm[column]], axis=-1)


def _thicknesses(section: MeshPicture) -> list[float]:
    """Thickness of each layer below the contact. [mm]"""
    steps = np.linalg.norm(np.diff(_below_contact(section), axis=0), axis=1)
    return [float(steps[section.layer == layer].sum().round(3)) for layer in range(len(section.layers))]
