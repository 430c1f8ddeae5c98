"""Figures of the skin: one touch, the mesh, the deflection under two bodies, stress at the nail."""

from __future__ import annotations

from pathlib import Path
from textwrap import fill
from typing import Any

import numpy as np
from matplotlib.axes import Axes
from matplotlib.collections import LineCollection, PolyCollection
from matplotlib.colors import LightSource, LinearSegmentedColormap, LogNorm, Normalize, to_rgb
from matplotlib.figure import Figure
from matplotlib.patches import Patch
from mpl_toolkits.mplot3d.art3d import Poly3DCollection

from fingerpad.core.checked import checked
from fingerpad.core.errors import InputError
from fingerpad.core.files import path_of
from fingerpad.core.signals import STORED_ENERGY, ResponseMap
from fingerpad.core.units import cosine_and_sine
from fingerpad.core.values import FloatArray
from fingerpad.data import protocol
from fingerpad.experiments.gerling2014.skin import MeshPicture, MeshPlane, NailBorder, SkinDeflectionResult
from fingerpad.experiments.requests.touch import TouchResult
from fingerpad.geometry.fingertip import Fingertip
from fingerpad.geometry.indenters import Indenter
from fingerpad.reduction.streaming import ReducedSample
from fingerpad.report.nerve import draw_raster_by_type, draw_trains
from fingerpad.report.page import DRAW, DRAWINGS, enter
from fingerpad.report.style import (
    BLACK,
    BLUE,
    COLUMN_IN,
    GREY,
    MAP_AXES,
    NO_MARKER,
    ORANGE,
    PALE,
    SERIES,
    fill_band,
    name_panel,
    new_figure,
    quantity_label,
    write_png,
)  # fmt: skip
from fingerpad.report.tables import fixed, number
from fingerpad.skin.sampling import SkinResponse, SurfaceProfile
from fingerpad.skin.section import Section

SKIN = LinearSegmentedColormap.from_list(
    "skin", ["#f7ece1", "#f3c9a5", "#e58a5e", "#b8405e", "#5c1a63", "#1d0b33"]
)
"""From pale skin to dark violet; the lightness falls all the way, so that the order survives greyscale."""

DECADES = 2.5  # Values that are further below the largest share the palest colour.
OUTLINE_POINTS = 200

REACH_MM, ROOM_BELOW_MM, MARGIN_MM = 16.0, 2.0, 0.5
"""Skin to either side of the indenter's axis, room below and beside the finger that is shown. [mm]"""

BODY_MM, BODY = 40.0, "#c9d1d8"  # Farther than this from its face no body is drawn [mm]; its colour.

BONE, BONE_INSIDE = "#9a9488", "#d9dde0"
"""Colours of the outline of bone and nail, and of the bone itself, unlike any of `SKIN` and the paper."""


@checked
def save_figure(
    path: str | Path, skin: SkinResponse, response: ResponseMap, indenter: Indenter | None = None
) -> Path:
    """Draw a touch and save the picture: the finger, coloured by what the afferents follow, and the spikes.

    Parameters
    ----------
    path : str or Path
        The PNG file; folders are made as needed.
    skin : SkinResponse
        From `indent`.
    response : ResponseMap
        Response of a population to it.
    indenter : Indenter, optional
        The body that pressed, to be drawn as well; as it stands when it is not spun.

    Raises
    ------
    StoreError
        If the file cannot be written.

    Examples
    --------
    >>> from pathlib import Path
    >>> from tempfile import mkdtemp
    >>> import fingerpad as fp
    >>> sphere = fp.Sphere(curvature_per_m=287)
    >>> skin = fp.indent(fp.Fingertip(), sphere, fp.RampAndHold(depth_mm=0.5))
    >>> response = fp.Population.grid(density_per_cm2=100).respond(skin)
    >>> fp.save_figure(Path(mkdtemp()) / "touch.png", skin, response, sphere).name
    'touch.png'
    """
    file = path_of("path", path)
    if file.suffix.lower() != ".png":
        raise InputError(f"A figure is written as .png: got {file.name}.")
    return write_png(file, draw_touch, skin, response, indenter)


@enter(DRAWINGS, ("SkinResponse", "force"))
def draw_force(axes: Axes, skin: SkinResponse) -> None:
    axes.plot(skin.times_ms, skin.force_mn, color=BLACK)
    axes.set(xlabel="time [ms]", ylabel="force [mN]")


@enter(DRAW, "touch")
def _draw_pressed(pressed: TouchResult) -> Figure:
    return draw_touch(pressed.skin, pressed.response, pressed.request.touch.indenter)


def draw_touch(skin: SkinResponse, response: ResponseMap, indenter: Indenter | None = None) -> Figure:
    """Draw a touch as `save_figure` saves it."""
    figure = new_figure(9.5, 4.0)
    grid = figure.add_gridspec(2, 2, width_ratios=(1.6, 1.0), height_ratios=(1.0, 4.0))
    draw_section(figure.add_subplot(grid[:, 0]), skin, indenter, response.quantity)
    motion = figure.add_subplot(grid[0, 1])
    draw_depth(motion, skin)
    motion.set(xlabel="", ylabel="depth\n[mm]", ylim=(0.0, 1.15 * float(skin.depth_mm.max())))
    motion.tick_params(labelbottom=False)
    draw_spikes(figure.add_subplot(grid[1, 1], sharex=motion), skin, response)
    if skin.caveats:
        text = " ".join(caveat.text for caveat in skin.caveats)
        figure.supxlabel(fill(f"Not verified: {text}", 130), fontsize=8.0, color=ORANGE)
    return figure


@enter(DRAWINGS, ("SkinResponse", "section"))
def draw_section(
    axes: Axes, skin: SkinResponse, indenter: Indenter | None = None, quantity: str = STORED_ENERGY
) -> None:
    """Draw the middle plane of the pressed finger at the end of the touch."""
    section, (name, values) = skin.section(), skin.at_end(quantity)
    shown = values[section.elements]
    faces = paint_skin(axes, section.corners_mm, shown, edgecolors="face", linewidths=0.3)
    _fill_bone(axes, section)
    for edges, colour, width in (
        (section.skin_mm, BLACK, 1.0),
        (section.bone_mm, BONE, 1.2),
        (section.nail_mm, BONE, 4.0),
    ):
        axes.add_collection(LineCollection(list(edges), colors=colour, linewidths=width, capstyle="round"))
    (x, y), axis_x_mm = np.moveaxis(section.corners_mm, -1, 0), skin.axis_x_mm + skin.pose.x_mm
    axes.set_xlim(max(x.min(), axis_x_mm - REACH_MM), min(x.max(), axis_x_mm + REACH_MM) + MARGIN_MM)
    axes.set_ylim(y.min() - ROOM_BELOW_MM, y.max() + MARGIN_MM)
    axes.set(xlabel="along the finger, x [mm]", ylabel="towards the back, y [mm]", aspect="equal")
    if indenter is not None:
        _draw_indenter(axes, skin, section, indenter)
    axes.grid(visible=False)
    label_skin(axes, faces, f"{name} [kPa]", 0.75)


def paint_skin(
    axes: Axes, outlines: FloatArray, values: Any, norm: Normalize | None = None, **edges: Any
) -> PolyCollection:
    """Colour faces by their values, by default on a logarithmic scale."""
    if norm is None:
        largest = float(np.max(values[values > 0.0], initial=0.0)) or 1.0
        norm = LogNorm(largest / 10.0**DECADES, largest, clip=True)
    shown = np.ma.masked_invalid(values)
    faces = PolyCollection(list(outlines), array=shown, cmap=SKIN, norm=norm, **edges)
    axes.add_collection(faces)
    return faces


def label_skin(axes: Axes, faces: PolyCollection, label: str, shrink: float) -> None:
    bar = axes.figure.colorbar(faces, ax=axes, shrink=shrink, aspect=18, pad=0.02, extend="min")
    bar.set_label(label)
    bar.ax.yaxis.set_major_formatter("{x:g}")


def _fill_bone(axes: Axes, section: Section) -> None:
    """Fill what the edges of the bone enclose: its nodes by their angle about the middle of its end."""
    points = section.bone_mm.reshape(-1, 2)
    if points.size:
        foot = np.array([points[:, 0].min(), 0.5 * (points[:, 1].min() + points[:, 1].max())])
        right, up = (points - foot).T
        around = points[np.argsort(np.arctan2(up, right))]
        axes.add_collection(PolyCollection([around], facecolors=BONE_INSIDE, edgecolors="none", zorder=0))


def _draw_indenter(axes: Axes, skin: SkinResponse, section: Section, indenter: Indenter) -> None:
    """Draw the body where its face meets the deformed skin, unless it has left the middle plane."""
    if skin.pose.z_mm != 0.0:
        return
    cosine, sine = cosine_and_sine(skin.pose.tilt_deg)
    towards = np.array([[cosine, -sine], [sine, cosine]]) @ skin.direction[:2]
    along = np.array([towards[1], -towards[0]])
    middle = skin.mesh.nodes_mm[skin.mesh.midline_nodes]
    axis_x_mm = skin.axis_x_mm + skin.pose.x_mm
    foot = np.array([axis_x_mm, np.interp(axis_x_mm, middle[:, 0], middle[:, 1])])

    def face(beside: FloatArray) -> FloatArray:
        return indenter.front(np.column_stack([beside, np.zeros((beside.size, 2))]))

    surface = section.skin_mm.reshape(-1, 2) - foot
    # The back of the finger lies behind the bone.
    surface = surface[surface @ towards < -foot[1]]
    gap = surface @ towards - face(surface @ along)
    line = np.linspace(-BODY_MM, BODY_MM, 4001)
    height = face(line)
    solid = np.flatnonzero(np.isfinite(height))
    for part in np.split(solid, np.flatnonzero(np.diff(solid) > 1) + 1):  # holes lie between
        top = foot + np.outer(line[part], along) + np.outer(height[part] + gap.min(), towards)
        outline = np.concatenate([top, top[[-1, 0]] - BODY_MM * towards])
        axes.fill(*outline.T, facecolor=BODY, edgecolor=BLACK, linewidth=1.0)


def draw_spikes(axes: Axes, skin: SkinResponse, response: ResponseMap) -> None:
    """Draw the trains of the afferents that fire, the nearest to the indenter on top; a band per type."""
    if response.types:
        draw_raster_by_type(axes, response.parts)
    else:
        plane = response.positions_mm[:, [0, -1]] - [skin.axis_x_mm, 0.0]
        order = np.argsort(np.hypot(*plane.T), kind="stable")
        draw_trains(axes, [response.spikes[afferent] for afferent in order], "nearest")
        axes.grid(visible=False)
    axes.set_xlim(0.0, skin.times_ms[-1])


@enter(DRAWINGS, ("SkinResponse", "profile"))
@enter(DRAWINGS, ("SurfaceProfile", "profile"))
def draw_profile(axes: Axes, shown: SkinResponse | SurfaceProfile) -> None:
    profile = shown if isinstance(shown, SurfaceProfile) else shown.surface_profile()
    axes.plot(profile.distance_mm, profile.deflection_mm, color=BLACK)
    axes.set(xlabel="distance from the object's axis [mm]", ylabel="deflection towards the bone [mm]")


@enter(DRAWINGS, ("SkinResponse", "pad"))
def draw_pad(axes: Axes, skin: SkinResponse, quantity: str = "stored", reach_mm: float = 6.0) -> None:
    """Draw a quantity at the end organs below the pad, at the last time."""
    z = np.linspace(-reach_mm, reach_mm, 61)
    x = skin.axis_x_mm + skin.pose.x_mm + z
    sites = np.stack(np.meshgrid(x, z, indexing="ij"), axis=-1).reshape(-1, 2)
    values = skin.sample(quantity, sites)[-1].reshape(x.size, z.size)
    drawn = axes.pcolormesh(x, z, values.T, cmap="viridis", shading="gouraud")
    axes.figure.colorbar(drawn, ax=axes, label=quantity_label(quantity))
    axes.set(**MAP_AXES)
    axes.grid(visible=False)


@enter(DRAWINGS, ("SkinResponse", "depth"))
def draw_depth(axes: Axes, skin: SkinResponse) -> None:
    """Draw the depth from first touch over time."""
    axes.plot(skin.times_ms, skin.depth_mm, color=BLACK)
    axes.set(xlabel="time [ms]", ylabel="depth [mm]")


@enter(DRAWINGS, ("ReducedSample", "quantity"))
def draw_sample(axes: Axes, sample: ReducedSample) -> None:
    """Draw the first quantity at each receptor, with the error of the reduced touch."""
    name, values = next(iter(sample.fields.items()))
    bars: Any = {"fmt": "o", "color": BLUE, "markersize": 3.0}
    axes.errorbar(np.arange(values.size), values, sample.field_errors[name], **bars)
    axes.set(xlabel="receptor", ylabel=quantity_label(name))


@enter(DRAWINGS, ("Fingertip", "outline"))
def draw_finger(axes: Axes, finger: Fingertip) -> None:
    """Draw the outline of a finger in its middle plane, with skin, bone and nail."""
    # A square root of the way to the tip, where the outline is round.
    x = finger.length_mm * (1.0 - np.linspace(1.0, 0.0, OUTLINE_POINTS) ** 2)
    volar, dorsal, _ = finger.section(x)
    outline = np.concatenate([x, x[::-1]]), np.concatenate([-volar, dorsal[::-1]])
    axes.fill(*outline, facecolor="#f7ece1", edgecolor=BLACK, linewidth=1.0)
    start, tip = finger.spine_end_x_mm, finger.bone_tip_x_mm
    way = np.linspace(0.0, np.pi, OUTLINE_POINTS)
    bone_x = np.concatenate([[0.0], start + (tip - start) * np.sin(way), [0.0]])
    bone_y = finger.spine_y_mm + finger.bone_height_mm * np.concatenate([[1.0], np.cos(way), [-1.0]])
    axes.fill(bone_x, bone_y, facecolor=BONE_INSIDE, edgecolor=BONE, linewidth=1.2)
    nail = np.linspace(finger.nail_x_mm[0], finger.nail_x_mm[1], OUTLINE_POINTS)
    axes.plot(nail, finger.section(nail)[1], color=BONE, linewidth=4.0)
    for depth in finger.layer_depths_mm:
        below = np.where(volar > 2.0 * depth, depth - volar, np.nan)  # layers turn upright at the tip
        axes.plot(x, below, color=GREY, linewidth=0.5)
    axes.plot([finger.contact_mm[0]], [-float(finger.section(finger.contact_mm[0])[0])], "v", color=BLUE)
    axes.set(xlabel="along, x [mm]", ylabel="towards the back, y [mm]", aspect="equal")
    axes.grid(visible=False)


LAYER_COLOURS = ("#2b1a3d", "#d9650a", "#f2b183", "#fbeee2")
"""From the skin inwards; the lightness increases, so that the layers differ in greyscale."""

FIXED_COLOURS = {"bone": "#a9b4bd", "nail": "#0a5c99"}
PALE_SKIN, NAIL_WIDTH = "#f0d9c4", 4.0
ENLARGED_MM = (1.3, 2.0)  # Half width and height of the layers that are enlarged. [mm]


def corners(points: np.ndarray) -> np.ndarray:
    """Return the four corners of each face of a grid of points, (n_faces, 4, ...)."""
    around = (points[:-1, :-1], points[1:, :-1], points[1:, 1:], points[:-1, 1:])
    return np.stack(around, axis=2).reshape(-1, 4, *points.shape[2:])


@enter(DRAW, "figure_1_mesh")
def draw_mesh(section: MeshPicture) -> Figure:
    figure = new_figure(11.0, 7.2)
    grid = figure.add_gridspec(2, 2, height_ratios=(1.0, 1.1))
    _draw_solid(figure.add_subplot(grid[0, 0], projection="3d"), section)
    across, along, near = (figure.add_subplot(grid[place]) for place in ((0, 1), (1, 0), (1, 1)))
    for sign in (1.0, -1.0):
        _draw_plane(across, section.across, section, lines=0.15, sign=sign)
    _draw_plane(along, section.along, section, lines=0.15)
    _draw_plane(near, section.along, section, lines=0.4)
    name_panel(across, "(b) proximal end, x = 0", "z, lateral [mm]", "y, dorsal [mm]")
    name_panel(along, "(c) inner mesh, z = 0", "x, distal [mm]", "y, dorsal [mm]")
    name_panel(near, "(d) four layers below the contact", "x, distal [mm]", "y, dorsal [mm]")
    (x, y), (width, height) = section.contact_mm, ENLARGED_MM
    near.set(xlim=(x - width, x + width), ylim=(y - 0.15, y - 0.15 + height))
    organ = _below_contact(section)[int((section.layer < section.layers.index("dermis")).sum())]
    depth = f"end organ, {number(section.receptor_depth_mm)} mm deep"
    near.plot(*organ, "o", markersize=7.0, color="white", markeredgecolor=BLACK, zorder=7, label=depth)
    near.legend(loc="upper right", fontsize=8.5, frameon=True, edgecolor="none", framealpha=1.0)
    # The subcutis ends at the bone, so that its thickness depends on the place.
    thick = [f" {number(thickness, 4)} mm" for thickness in layer_thicknesses_mm(section)[:-1]]
    labels = [f"{name}{mm}" for name, mm in zip(section.layers, [*thick, ""], strict=True)]
    named = [*zip(labels, LAYER_COLOURS, strict=True), *FIXED_COLOURS.items()]
    patches = [Patch(facecolor=colour, edgecolor=BLACK, linewidth=0.5, label=name) for name, colour in named]
    figure.legend(handles=patches, loc="outside lower center", ncols=len(patches))
    return figure


def _draw_solid(axes: Any, section: MeshPicture) -> None:
    """Draw the skin and the nail in light."""
    skin = np.stack([section.x_mm, section.z_mm, section.y_mm], axis=-1)
    nailed = np.all(corners(section.under_nail), axis=1, keepdims=True)
    colours = np.where(nailed, to_rgb(FIXED_COLOURS["nail"]), to_rgb(PALE_SKIN))
    # The corners of the mirror image go round the other way, so that both halves face outwards.
    faces = [*corners(skin)[:, ::-1], *corners(skin * [1.0, -1.0, 1.0])]
    light: Any = {"shade": True, "lightsource": LightSource(azdeg=225.0, altdeg=45.0)}
    drawn: Any = {"edgecolors": "#00000060", "linewidths": 0.2} | light
    axes.add_collection3d(
        Poly3DCollection(faces, facecolors=np.tile(colours, (2, 1)), **drawn), autolim=False
    )
    low, high = skin.min(axis=(0, 1)), skin.max(axis=(0, 1))
    axes.set(xlim=(low[0], high[0]), ylim=(-high[1], high[1]), zlim=(low[2], high[2]))
    axes.set_box_aspect((high[0] - low[0], 2.0 * high[1], high[2] - low[2]), zoom=1.3)
    axes.view_init(elev=18.0, azim=-62.0)
    axes.set_title("(a) overall mesh", fontsize=10.0)
    axes.set(xlabel="x, distal [mm]", ylabel="z, lateral [mm]", zlabel="y, dorsal [mm]")
    axes.locator_params(nbins=4)


def _draw_plane(axes: Axes, plane: MeshPlane, section: MeshPicture, lines: float, sign: float = 1.0) -> None:
    """Draw the elements of a plane by layers, the bone inside of them and the nail upon them."""
    right, up = sign * plane.right_mm, plane.up_mm
    colours = np.tile(np.array(LAYER_COLOURS)[section.layer], right.shape[0] - 1)
    axes.fill(right[:, -1], up[:, -1], facecolor=FIXED_COLOURS["bone"], edgecolor="none", zorder=0)
    faces, edges = list(corners(np.stack([right, up], axis=-1))), "#00000080"
    drawn = PolyCollection(faces, facecolors=colours.tolist(), edgecolors=edges, linewidths=lines)
    axes.add_collection(drawn)
    skin = np.stack([right[:, 0], up[:, 0]], axis=-1)
    nail = np.stack([skin[:-1], skin[1:]], axis=1)[plane.under_nail[1:] & plane.under_nail[:-1]]
    style: Any = {"colors": FIXED_COLOURS["nail"], "linewidths": NAIL_WIDTH, "capstyle": "round"}
    axes.add_collection(LineCollection(list(nail), **style))
    axes.autoscale_view()
    axes.set_aspect("equal")
    axes.grid(visible=False)


def _below_contact(section: MeshPicture) -> FloatArray:
    """Nodes from the contact to the bone, (n_through + 1, 2). [mm]"""
    x, y = section.contact_mm
    plane = section.along
    column = int(np.hypot(plane.right_mm[:, 0] - x, plane.up_mm[:, 0] - y).argmin())
    return np.stack([plane.right_mm[column], plane.up_mm[column]], axis=-1)


def layer_thicknesses_mm(section: MeshPicture) -> list[float]:
    steps = np.linalg.norm(np.diff(_below_contact(section), axis=0), axis=1)
    return [float(steps[section.layer == layer].sum().round(3)) for layer in range(len(section.layers))]


TRIAL_STYLES = {"Trial 1": SERIES[0], "Trial 2": SERIES[1], "Trial 3": SERIES[3]}

BODIES = {
    "line": f"{protocol.LINE_DIAMETER.value * 1000.0:.0f} µm line",
    "cylinder": f"{protocol.CYLINDER_DIAMETER.value} mm cylinder",
}
"""The two indenters, as they are named on the page."""


@enter(DRAW, "figure_4_skin_deflection")
def draw_skin_deflection(section: SkinDeflectionResult) -> Figure:
    figure = new_figure(11.0, 4.2)
    panels = figure.subplots(1, 2, sharey=True)
    for letter, axes, (key, body) in zip("ab", panels, BODIES.items(), strict=True):
        draw_profiles(axes, section, key)
        axes.set_title(f"({letter}) {body}, {protocol.DEPTH.value} mm deep")
        axes.set_xlabel("distance from the indenter's axis, distal [mm]")
        axes.legend(loc="lower left")
    panels[0].set_ylabel("deflection towards the bone [mm]")
    panels[0].invert_yaxis()  # Deflection is drawn downwards; the panels share this axis.
    return figure


def draw_profiles(axes: Axes, section: SkinDeflectionResult, body: str) -> None:
    """Draw the deflection of each trial under "line" or "cylinder", and what was observed under it."""
    # Results count distances proximal positive; all figures have the distal side on the right.
    trials = zip(TRIAL_STYLES.items(), (section.trial1, section.trial2, section.trial3), strict=True)
    for (name, style), trial in trials:
        profile = trial[body]
        label = f"{name}, R² = {fixed(profile.r2, 2)}" if body == "cylinder" else name
        axes.plot(-profile.distance_mm, profile.deflection_mm, label=label, **style | NO_MARKER)
    if body == "cylinder":
        observed, artefact = section.observed, section.observed.is_artefact
        x, y, kept = -observed.distance_mm, observed.deflection_mm, ~artefact
        open_circle: Any = {"color": BLACK, "markerfacecolor": "none", "markersize": 4.5}
        axes.plot(x[kept], y[kept], "o", label="observed", **open_circle)
        if artefact.any():
            label = "observed, artefact (left out)"
            axes.plot(x[artefact], y[artefact], "x", color=GREY, markersize=6.0, label=label)
    axes.margins(x=0.01)


@enter(DRAW, "figure_9_nail")
def draw_nail(section: NailBorder) -> Figure:
    drawn = new_figure(COLUMN_IN, 5.2)
    grid = drawn.add_gridspec(2, 2)
    above, beside, profile = (drawn.add_subplot(grid[place]) for place in ((0, 0), (0, 1), (1, slice(None))))
    near, across, sides = Normalize(0.0, section.border_kpa or 1.0), section.across, (1.0, -1.0)
    x, y, z = (corners(grid) for grid in (section.x_mm, section.y_mm, section.z_mm))
    halves = np.concatenate([np.stack([x, sign * z], axis=-1) for sign in sides])
    # The skin as seen from far away: nearer faces are drawn later and hide the others.
    order = np.argsort(np.tile(y.mean(axis=1), 2), kind="stable")
    stress = np.tile(section.von_mises_kpa.ravel(), 2)
    paint_skin(above, halves[order], stress[order], near, edgecolors="face", linewidths=0.3)
    for sign in sides:
        edges = list(section.nail_mm[..., [0, 2]] * [1.0, sign])
        above.add_collection(LineCollection(edges, colors=BLACK, linewidths=1.2))
    half = np.stack([across.z_mm, across.y_mm], axis=-1)
    both = np.concatenate([half, half * [-1.0, 1.0]])
    stress = np.tile(across.von_mises_kpa, 2)
    faces = paint_skin(beside, both, stress, near, edgecolors="face", linewidths=0.3)
    _draw_stress(profile, section)
    distal, lateral, dorsal = "x, distal [mm]", "z, lateral [mm]", "y, dorsal [mm]"
    name_panel(above, "(a) from above: the nail", distal, lateral)
    name_panel(beside, f"(b) across, x = {number(across.x_mm)} mm", lateral, dorsal)
    beyond = f"(c) border of the nail: {number(section.ratio)} times the stress of skin 2 to 3 mm away"
    name_panel(profile, beyond, "distance from the nail [mm]", "von Mises stress [kPa]")
    for axes in (above, beside):
        axes.autoscale_view()
        axes.set(aspect="equal", facecolor=PALE)
        axes.grid(visible=False)
    drawn.colorbar(faces, ax=[above, beside], extend="max", label="von Mises stress [kPa]", aspect=15)
    return drawn


def _draw_stress(axes: Axes, section: NailBorder) -> None:
    """Stress over distance from the nail: median and middle 80 % of the sections that cross its border."""
    profile = section.profile
    for stress_kpa, name, colour, style in (
        (profile.surface_kpa, "surface of the skin", ORANGE, "-"),
        (profile.living_epidermis_kpa, "living epidermis", BLUE, "--"),
    ):
        low, median, high = stress_kpa.T
        fill_band(axes, profile.distance_mm, low, high, colour, 0.2)
        axes.plot(profile.distance_mm, median, style, color=colour, label=name)
    axes.axvline(0.0, color=BLACK, linewidth=0.8)
    axes.set_ylim(bottom=0.0)
    place: Any = {"transform": axes.get_xaxis_transform(), "ha": "right", "va": "top"}
    axes.text(-0.1, 0.95, "under\nthe nail", color=BLACK, size=9, **place)
    axes.legend(loc="upper right")
