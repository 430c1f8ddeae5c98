"""Figure 1: the mesh of the finger in three dimensions and in two planes, its layers, bone and nail."""

from __future__ import annotations

from typing import Any

import numpy as np
from matplotlib.axes import Axes
from matplotlib.collections import LineCollection, PolyCollection
from matplotlib.colors import to_rgb
from matplotlib.figure import Figure
from matplotlib.patches import Patch
from mpl_toolkits.mplot3d.art3d import Poly3DCollection

from fingerpad.core.values import FloatArray
from fingerpad.experiments.gerling2014.skin import MeshPicture, MeshPlane
from fingerpad.report.page import figure
from fingerpad.report.style import BLACK, name_panel, new_figure
from fingerpad.report.tables import number

LAYER_COLOURS = ("#2b1a3d", "#d9650a", "#f2b183", "#fbeee2")
"""From the skin inwards; the lightness increases, so that the layers differ in greyscale."""

BONE, NAIL, SKIN = "#a9b4bd", "#0a5c99", "#f0d9c4"
NAIL_WIDTH = 4.0

LIGHT = np.array([0.35, -0.75, 0.56])  # Where the light comes from, in the order x, z, y.
ENLARGED_MM, THIN_MM = (1.3, 2.0), 0.2  # Half width, height; thinner is named beside it. [mm]


def corners(points: np.ndarray) -> np.ndarray:
    """Return the four corners of each face of a grid of points, (n_faces, 4, ...)."""
    around = (points[:-1, :-1], points[1:, :-1], points[1:, 1:], points[:-1, 1:])
    return np.stack(around, axis=2).reshape(-1, 4, *points.shape[2:])


def caption_mesh(section: MeshPicture) -> str:
    return (
        "Finite-element mesh of the fingertip that the standard sphere presses, without load: "
        f"{number(section.nodes)} nodes and {number(section.elements)} elements"
        f"{' in one half of the finger; the other half is its mirror image' if section.half else ''}. "
        "Letters as in the paper. Bone and nail are rigid and have no elements. The outline is that of the "
        "model which the authors' laboratory published later; the thicknesses of epidermis and dermis are "
        "the paper's."
    )


@figure(
    "reproduction", "The finger", 1, "figure_1_mesh", "Mesh of the finger", caption_mesh, of=("paper.mesh",)
)
def draw_mesh(section: MeshPicture) -> Figure:
    figure = new_figure(11.0, 6.4)
    grid = figure.add_gridspec(2, 6)
    whole = figure.add_subplot(grid[0, :3], projection="3d")
    cut = figure.add_subplot(grid[0, 3:], projection="3d")
    across, along, near = (figure.add_subplot(grid[1, first : first + 2]) for first in (0, 2, 4))
    halves = (1.0, -1.0) if section.half else (1.0,)
    _draw_solid(whole, section, halves)
    _draw_solid(cut, section, (1.0,), section.along)
    for sign in halves:
        _draw_plane(across, section.across, section, lines=0.15, sign=sign)
    _draw_plane(along, section.along, section, lines=0.15)
    _draw_plane(near, section.along, section, lines=0.4)
    _name_fixed_parts(across, section.across, mirrored=section.half)
    _name_fixed_parts(along, section.along, mirrored=False)
    _enlarge(near, section)
    whole.set_title("(a) overall mesh", fontsize=10.0)
    cut.set_title("(c) cut along the middle: surface and inside", fontsize=10.0)
    for axes, title, label in (
        (across, "(b) proximal end, x = 0", "z, lateral [mm]"),
        (along, "(d) inner mesh, z = 0", "x, distal [mm]"),
        (near, "(e) four layers below the contact", "x, distal [mm]"),
    ):
        name_panel(axes, title, label, "y, dorsal [mm]", aspect="equal")
        axes.grid(visible=False)
    named = [*zip(section.layers, LAYER_COLOURS, strict=True), ("bone", BONE), ("nail", NAIL)]
    patches = [Patch(facecolor=colour, edgecolor=BLACK, linewidth=0.5, label=name) for name, colour in named]
    figure.legend(handles=patches, loc="outside lower center", ncols=len(patches))
    return figure


def _draw_solid(
    axes: Any, section: MeshPicture, halves: tuple[float, ...], plane: MeshPlane | None = None
) -> None:
    """Draw the skin and the nail in light, and a cut through the layers where one is given."""
    skin = np.stack([section.x_mm, section.z_mm, section.y_mm], axis=-1)
    nailed = np.all(corners(section.under_nail), axis=1, keepdims=True)
    colours = np.where(nailed, to_rgb(NAIL), to_rgb(SKIN))
    solid = [corners(skin * [1.0, sign, 1.0]) for sign in halves]
    paint = [colours * _brightness(faces, sign)[:, None] for faces, sign in zip(solid, halves, strict=True)]
    faces = list(np.concatenate(solid))
    if plane is not None:
        # A hair before the middle, so that it covers what lies behind.
        def upright(flat: FloatArray) -> FloatArray:
            return np.stack([flat[..., 0], np.full(flat.shape[:-1], -0.01), flat[..., 1]], axis=-1)

        points = np.stack([plane.right_mm, plane.up_mm], axis=-1)
        faces += [*upright(corners(points)), upright(points[:, -1])]
        layers = np.array([to_rgb(colour) for colour in LAYER_COLOURS])[section.layer]
        paint += [np.tile(layers, (len(points) - 1, 1)), np.array([to_rgb(BONE)])]
    drawn: Any = {"edgecolors": "#00000060", "linewidths": 0.2}
    # Polygons of unequal lengths are padded with what lies in memory, which must not set the limits.
    axes.add_collection3d(Poly3DCollection(faces, facecolors=np.concatenate(paint), **drawn), autolim=False)
    low, high = skin.min(axis=(0, 1)), skin.max(axis=(0, 1))
    across = (-high[1], high[1])
    axes.set(xlim=(low[0], high[0]), ylim=across, zlim=(low[2], high[2]))
    axes.set_box_aspect((high[0] - low[0], 2.0 * high[1], high[2] - low[2]), zoom=1.3)
    axes.view_init(elev=18.0, azim=-62.0)
    axes.set_xlabel("x, distal [mm]", labelpad=8.0)
    axes.set_ylabel("z, lateral [mm]", labelpad=2.0)
    axes.set_zlabel("y, dorsal [mm]", labelpad=0.0)
    axes.locator_params(nbins=4)


def _brightness(faces: FloatArray, sign: float) -> FloatArray:
    """How light a face is, from 0.6 to 1, by the angle of its outward normal to the light."""
    normal = np.cross(faces[:, 2] - faces[:, 0], faces[:, 3] - faces[:, 1])
    normal /= np.maximum(np.linalg.norm(normal, axis=1, keepdims=True), 1e-12)
    outward = faces.mean(axis=1) * [0.0, 1.0, 1.0]
    normal *= np.sign((normal * outward).sum(axis=1, keepdims=True) + 1e-12 * sign)
    return np.asarray(0.6 + 0.4 * np.clip(normal @ LIGHT, 0.0, 1.0))


def _enlarge(axes: Axes, section: MeshPicture) -> None:
    """Show the layers below the contact with their thicknesses, and an end organ."""
    x, y = section.contact_mm
    width, height = ENLARGED_MM
    axes.set(xlim=(x - width, x + width), ylim=(y - 0.15, y - 0.15 + height))
    edges = np.concatenate([[0.0], np.cumsum(_thicknesses(section))])
    text: Any = {"ha": "center", "va": "center", "fontsize": 8.5, "zorder": 6}
    box = {"facecolor": "white", "edgecolor": "none", "alpha": 0.9, "pad": 1.5}
    for name, low, high in zip(section.layers[:-1], edges, edges[1:], strict=False):
        label, middle = f"{name} {number(high - low, 4)} mm", y + 0.5 * (low + high)
        thin = high - low < THIN_MM
        arrow = {"arrowstyle": "-", "color": BLACK, "shrinkB": 0.0} if thin else None
        place = (x, middle + 2.0 * THIN_MM) if thin else (x, middle + THIN_MM * (low > 0.0))
        axes.annotate(label, (x, middle), xytext=place, arrowprops=arrow, bbox=box, **text)
    organ = _below_contact(section)[int((section.layer < section.layers.index("dermis")).sum())]
    depth = f"end organ, {number(section.receptor_depth_mm)} mm deep"
    axes.plot(*organ, "o", markersize=7.0, color="white", markeredgecolor=BLACK, zorder=7, label=depth)
    axes.legend(loc="lower right", fontsize=8.5, frameon=True, edgecolor="none", framealpha=1.0)


def _draw_plane(axes: Axes, plane: MeshPlane, section: MeshPicture, lines: float, sign: float = 1.0) -> None:
    """Draw the elements of a plane by layers, the bone inside of them and the nail upon them."""
    right, up = sign * plane.right_mm, plane.up_mm
    colours = np.tile(np.array(LAYER_COLOURS)[section.layer], right.shape[0] - 1)
    axes.fill(right[:, -1], up[:, -1], facecolor=BONE, edgecolor="none", zorder=0)
    faces, edges = list(corners(np.stack([right, up], axis=-1))), "#00000080"
    drawn = PolyCollection(faces, facecolors=colours.tolist(), edgecolors=edges, linewidths=lines)
    axes.add_collection(drawn)
    skin = np.stack([right[:, 0], up[:, 0]], axis=-1)
    covered = plane.under_nail[1:] & plane.under_nail[:-1]
    nail = np.stack([skin[:-1], skin[1:]], axis=1)[covered]
    axes.add_collection(LineCollection(list(nail), colors=NAIL, linewidths=NAIL_WIDTH, capstyle="round"))
    axes.autoscale_view()


def _name_fixed_parts(axes: Axes, plane: MeshPlane, mirrored: bool) -> None:
    """Write bone and nail beside them: in grey they resemble the layers."""
    bone = plane.right_mm[:, -1], plane.up_mm[:, -1]
    right, up = (0.5 * float(values.min() + values.max()) for values in bone)
    axes.text(0.0 if mirrored else right, up, "bone", ha="center", va="center")
    nail = plane.right_mm[plane.under_nail, 0], plane.up_mm[plane.under_nail, 0]
    if nail[0].size:
        place = (0.0 if mirrored else float(nail[0].mean()), float(nail[1].max()))
        beside: Any = {"xytext": (0.0, 6.0), "textcoords": "offset points", "ha": "center"}
        axes.annotate("nail", place, color=NAIL, **beside)
        axes.set_ylim(top=axes.get_ylim()[1] + 1.5)


def _below_contact(section: MeshPicture) -> FloatArray:
    """Nodes from the contact to the bone, (n_through + 1, 2). [mm]"""
    x, y = section.contact_mm
    plane = section.along
    column = int(np.hypot(plane.right_mm[:, 0] - x, plane.up_mm[:, 0] - y).argmin())
    return np.stack([plane.right_mm[column], plane.up_mm[column]], axis=-1)


def _thicknesses(section: MeshPicture) -> list[float]:
    steps = np.linalg.norm(np.diff(_below_contact(section), axis=0), axis=1)
    return [float(steps[section.layer == layer].sum().round(3)) for layer in range(len(section.layers))]
