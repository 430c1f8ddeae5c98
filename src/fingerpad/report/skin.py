"""Figures of the skin: one touch, the deflection under a line and a cylinder, stress at the nail."""

from __future__ import annotations

from dataclasses import asdict
from pathlib import Path
from textwrap import fill
from typing import TYPE_CHECKING, Any

import numpy as np
from matplotlib import colormaps
from matplotlib.axes import Axes
from matplotlib.collections import LineCollection, PolyCollection
from matplotlib.colors import LinearSegmentedColormap, LogNorm, Normalize
from matplotlib.figure import Figure

from fingerpad.core.checked import checked
from fingerpad.core.errors import InputError
from fingerpad.core.files import path_of
from fingerpad.core.signals import STORED_ENERGY, ResponseMap
from fingerpad.core.units import cosine_and_sine
from fingerpad.core.values import FloatArray, instance
from fingerpad.data import protocol
from fingerpad.experiments.gerling2014.skin import NailBorder, SkinDeflectionResult
from fingerpad.experiments.requests.touch import TouchFile, TouchResult
from fingerpad.report.mesh_picture import corners
from fingerpad.report.nerve import draw_raster_by_type, draw_trains
from fingerpad.report.page import both, figure, write_result_page
from fingerpad.report.style import (
    BLACK,
    BLUE,
    COLUMN_IN,
    GREEN,
    GREY,
    ORANGE,
    PALE,
    fill_band,
    name_panel,
    new_figure,
    write_png,
)  # fmt: skip
from fingerpad.report.tables import Column, Table, facts_table, fixed, number, table

if TYPE_CHECKING:
    from fingerpad.geometry.indenters import Indenter
    from fingerpad.skin.sampling import SkinResponse
    from fingerpad.skin.section import Section

PAGE = "touch.html"

SKIN = LinearSegmentedColormap.from_list(
    "skin", ["#f7ece1", "#f3c9a5", "#e58a5e", "#b8405e", "#5c1a63", "#1d0b33"]
)
"""From pale skin to dark violet; the lightness falls all the way, so that the order survives greyscale."""

DECADES = 2.5  # Values that are further below the largest share the palest colour.

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
    # Only a call needs these classes.
    from fingerpad.geometry.indenters import Indenter
    from fingerpad.skin.sampling import SkinResponse

    instance("skin", skin, SkinResponse)
    if indenter is not None:
        instance("indenter", indenter, Indenter)
    file = path_of("path", path)
    if file.suffix.lower() != ".png":
        raise InputError(f"A figure is written as .png: got {file.name}.")
    answer = instance("response", response, ResponseMap)
    return write_png(lambda parts: draw_touch(*parts), (skin, answer, indenter), file)


def write_touch_page(pressed: TouchResult, folder: Path) -> Path:
    found = pressed.result
    about = "A finite-element fingertip and a population of afferents."
    said = touch_summary(found)
    return write_result_page("touch", pressed, found.touch.title, about, said, found.manifest, folder)


def touch_summary(result: TouchFile) -> list[str]:
    found = result.summary
    return [
        f"The largest force is {number(found.largest_force_mn)} mN, the largest depth "
        f"{number(found.largest_depth_mm)} mm, the largest contact {number(found.largest_contact_mm2)} mm².",
        f"{found.firing} of {found.afferents} afferents fire, at up to {number(found.dynamic_rate_hz)} "
        f"spikes/s in the dynamic window and {number(found.static_rate_hz)} spikes/s in the static window.",
    ]


def _touch_tables(pressed: TouchResult) -> list[Table]:
    facts = asdict(pressed.summary).items()
    named = {"number of times" if name == "times" else name: value for name, value in facts}
    return [facts_table("In numbers", named)]


CAPTION_TOUCH = (
    "Left: the middle plane of the finger at the end of the touch. Right: depth "
    "over time, and the spikes of the afferents that fire."
)


@figure("touch", "Results", 1, "touch", "The touch", CAPTION_TOUCH, tables=_touch_tables)
def _draw_pressed(pressed: TouchResult) -> Figure:
    return draw_touch(pressed.skin, pressed.response, pressed.request.touch.indenter)


def draw_touch(skin: SkinResponse, response: ResponseMap, indenter: Indenter | None = None) -> Figure:
    """Draw a touch as `save_figure` saves it."""
    figure = new_figure(9.5, 4.0)
    grid = figure.add_gridspec(2, 2, width_ratios=(1.6, 1.0), height_ratios=(1.0, 4.0))
    draw_section(figure.add_subplot(grid[:, 0]), skin, indenter, response.quantity)
    motion = figure.add_subplot(grid[0, 1])
    draw_motion(motion, skin)
    draw_spikes(figure.add_subplot(grid[1, 1], sharex=motion), skin, response)
    if skin.caveats:
        text = " ".join(caveat.text for caveat in skin.caveats)
        figure.supxlabel(fill(f"Not verified: {text}", 130), fontsize=8.0, color=ORANGE)
    return figure


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
    axes.set(
        xlim=(max(x.min(), axis_x_mm - REACH_MM), min(x.max(), axis_x_mm + REACH_MM) + MARGIN_MM),
        ylim=(y.min() - ROOM_BELOW_MM, y.max() + MARGIN_MM),
        aspect="equal",
        xlabel="along the finger, x [mm]",
        ylabel="towards the back, y [mm]",
    )
    if indenter is not None:
        _draw_indenter(axes, skin, section, indenter)
    axes.grid(visible=False)
    label_skin(axes, faces, f"{name} [kPa]", 0.75)


def paint_skin(axes: Axes, outlines: FloatArray, values: Any, **edges: Any) -> PolyCollection:
    """Colour faces by their values on a logarithmic scale."""
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


def draw_motion(axes: Axes, skin: SkinResponse) -> None:
    axes.plot(skin.times_ms, skin.depth_mm, color=BLUE)
    axes.set(ylabel="depth\n[mm]", ylim=(0.0, 1.15 * float(skin.depth_mm.max())))
    axes.tick_params(labelbottom=False)
    axes.grid(visible=False)


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


TRIAL_STYLES = {"Trial 1": (BLUE, (0, (5, 2))), "Trial 2": (ORANGE, (0, (1, 1.2))), "Trial 3": (GREEN, "-")}
"""Colour and dashes of the paper's trials."""

BODIES = {
    "line": f"{protocol.LINE_DIAMETER.value * 1000.0:.0f} µm line",
    "cylinder": f"{protocol.CYLINDER_DIAMETER.value} mm cylinder",
}
"""The two indenters, as they are named on the page."""


def _trials(section: SkinDeflectionResult) -> dict[str, Any]:
    return dict(zip(TRIAL_STYLES, (section.trial1, section.trial2, section.trial3), strict=True))


CAPTION_SKIN_DEFLECTION = (
    "Deflection of the skin along the midline of the fingertip at the end of the indentation, drawn "
    "downwards, under (a) a line load and (b) a cylinder. Lines: the model with the paper's three "
    "trials, which are the sets of tissues trial1, trial2 and trial3 whatever the tissues of the run "
    "are. Circles: observed under the cylinder on a living human fingertip (Dandekar 1995); the cross "
    "is an artefact of digitising at the end of the curve and is left out of R². No observations under "
    "the line are available. The inner moduli of Trials 2 and 3 were identified from these circles. In "
    "the paper Trial 1 overshoots, Trial 2 undershoots and Trial 3, which combines the two, matches."
)


def skin_deflection_tables(section: SkinDeflectionResult) -> list[Table]:
    rows = [
        (f"{name}, {body}", trial[key])
        for name, trial in _trials(section).items()
        for key, body in BODIES.items()
    ]
    columns = (
        Column("0", "trial"),
        Column("1.r2", "R²", 3),
        Column("1.r2_mirrored", "R², mirrored", 3),
        Column("1.force_mn", "force", 1),
    )
    note = "R², mirrored: with the proximal and the distal side of the observations exchanged."
    return [table("Fit and force", rows, columns, note)]


@figure(
    "reproduction", "Level 1: skin", 4, "figure_4_skin_deflection", "Deflection of the skin",
    CAPTION_SKIN_DEFLECTION, of=("skin_deflection",), tables=skin_deflection_tables,
)  # fmt: skip
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
    for name, trial in _trials(section).items():
        profile, (colour, style) = trial[body], TRIAL_STYLES[name]
        fit = f", R² = {fixed(profile.r2, 2)}" if np.isfinite(profile.r2) else ""
        axes.plot(
            -profile.distance_mm, profile.deflection_mm, color=colour, linestyle=style, label=name + fit
        )
    if body == "cylinder":
        observed, artefact = section.observed, section.observed.is_artefact
        x, y, kept = -observed.distance_mm, observed.deflection_mm, ~artefact
        open_circle: Any = {"color": BLACK, "markerfacecolor": "none", "markersize": 4.5}
        axes.plot(x[kept], y[kept], "o", label="observed", **open_circle)
        if artefact.any():
            label = "observed, artefact (left out)"
            axes.plot(x[artefact], y[artefact], "x", color=GREY, markersize=6.0, label=label)
    axes.margins(x=0.01)


NAIL_DECADES, VON_MISES = 4.0, "von Mises stress [kPa]"

CAPTION_NAIL = (
    "Predicted von Mises stress at the end of the hold, on the finger that the standard sphere deforms; "
    "nothing here was observed: (a) in the outermost elements of the skin and (b) in the middle section, "
    f"on a logarithmic scale of {number(NAIL_DECADES)} decades; (c) the back of the finger and (d) the "
    "section with the highest ratio, on a linear scale up to the highest stress at the border of the "
    "nail (its outline in white); (e) median and middle 80 % of all sections that cross that border. "
    "The paper shows high stresses at the border of the nail."
)


@figure(
    "reproduction", "The border of the nail", 9, "figure_9_nail", "Stress at the border of the nail",
    CAPTION_NAIL, of=both("nail"),
)  # fmt: skip
def draw_nail(section: NailBorder) -> Figure:
    figure = new_figure(COLUMN_IN, 7.4)
    grid = figure.add_gridspec(3, 2, height_ratios=(1.0, 1.0, 1.1))
    below, cut, above, beside = (figure.add_subplot(grid[panel // 2, panel % 2]) for panel in range(4))
    profile = figure.add_subplot(grid[2, :])
    middle, across, nail = section.middle, section.across, section.nail_mm
    stress = section.von_mises_kpa.ravel()
    shown = np.concatenate([stress, middle.von_mises_kpa])
    peak = float(shown[np.isfinite(shown)].max(initial=0.0)) or 1.0
    # Values below these decades have the darkest colour.
    wide = LogNorm(vmin=peak / 10.0**NAIL_DECADES, vmax=peak, clip=True)
    near = Normalize(0.0, section.border_kpa or 1.0)
    x, y, z = (corners(grid) for grid in (section.x_mm, section.y_mm, section.z_mm))
    halves = np.concatenate([np.stack([x, sign * z], axis=-1) for sign in (1.0, -1.0)])
    for axes, height, scale in ((below, -y, wide), (above, y, near)):
        # The skin as seen from far away: nearer faces are drawn later and hide the others.
        order = np.argsort(np.tile(height.mean(axis=1), 2), kind="stable")
        _paint(axes, halves[order], np.tile(stress, 2)[order], scale)
    _paint(cut, np.stack([middle.x_mm, middle.y_mm], axis=-1), middle.von_mises_kpa, wide)
    for sign in (1.0, -1.0):
        edges = list(nail[..., [0, 2]] * [1.0, sign])
        above.add_collection(LineCollection(edges, colors="white", linewidths=1.2))
    half = np.stack([across.z_mm, across.y_mm], axis=-1)
    _paint(beside, np.concatenate([half, half * [-1.0, 1.0]]), np.tile(across.von_mises_kpa, 2), near)
    _draw_stress(profile, section)
    beyond = f"(e) border of the nail: {number(section.ratio)} times the stress of skin 2 to 3 mm away"
    distal, lateral, dorsal = "x, distal [mm]", "z, lateral [mm]", "y, dorsal [mm]"
    name_panel(below, "(a) from below: the pad", distal, lateral)
    name_panel(cut, "(b) middle section, z = 0", distal, dorsal)
    name_panel(above, "(c) from above: the nail", distal, lateral)
    name_panel(beside, f"(d) across, x = {number(across.x_mm)} mm", lateral, dorsal)
    name_panel(profile, beyond, "distance from the nail [mm]", VON_MISES)
    near_nail = "the same near the nail [kPa]"
    for row, text, ends in (((below, cut), VON_MISES, "min"), ((above, beside), near_nail, "max")):
        bar = figure.colorbar(row[0].collections[0], ax=row, extend=ends, pad=0.02, aspect=15)
        bar.set_label(text, fontsize=9.0)
    return figure


def _paint(axes: Axes, outlines: FloatArray, stress: FloatArray, scale: Normalize) -> None:
    # A lighter ground than the darkest colour keeps the outline of the finger visible.
    axes.set_facecolor(PALE)
    colours = colormaps["inferno"].with_extremes(bad=GREY)
    drawn: Any = {"cmap": colours, "norm": scale, "edgecolors": "face", "linewidths": 0.3}
    axes.add_collection(PolyCollection(list(outlines), array=np.ma.masked_invalid(stress), **drawn))
    axes.autoscale_view()
    axes.set_aspect("equal")
    axes.grid(visible=False)


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
