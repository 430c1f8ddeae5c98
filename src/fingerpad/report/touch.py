"""One touch in one picture: what afferents follow in the pressed finger, and the spikes of a population."""

from __future__ import annotations

from pathlib import Path
from textwrap import fill
from typing import TYPE_CHECKING, Any

import numpy as np
from matplotlib.axes import Axes
from matplotlib.collections import LineCollection, PolyCollection
from matplotlib.colors import LinearSegmentedColormap, LogNorm
from matplotlib.figure import Figure

from fingerpad.core.checked import checked
from fingerpad.core.errors import InputError
from fingerpad.core.files import path_of
from fingerpad.core.signals import STORED_ENERGY, ResponseMap
from fingerpad.core.units import cosine_and_sine
from fingerpad.core.values import FloatArray, instance
from fingerpad.report.responses import draw_raster_by_type, draw_trains
from fingerpad.report.style import BLACK, BLUE, ORANGE, new_figure, say_nothing_to_draw, write_png

if TYPE_CHECKING:
    from fingerpad.geometry.indenters import Indenter
    from fingerpad.skin.sampling import SkinResponse
    from fingerpad.skin.section import Section
from collections.abc import Callable
from dataclasses import asdict

from fingerpad.experiments.requests.touch import TouchFile
from fingerpad.report.formatting import number
from fingerpad.report.parts import Chapter, Drawing, Page, edition, facts_table, manifest_chapter, write_html

PAGE = "touch.html"


def write_touch_page(result: TouchFile, draw: Callable[[], Figure], folder: Path) -> Path:
    caption = (
        "Left: the middle plane of the finger at the end of the touch. Right: depth "
        "over time, and the spikes of the afferents that fire."
    )
    numbers = asdict(result.summary).items()
    facts = {"number of times" if name == "times" else name: value for name, value in numbers}
    page = Page(
        result.touch.title,
        f"A finite-element fingertip and a population of afferents. {edition(result.manifest)}",
        touch_summary(result),
        [
            Chapter(
                "Results", [Drawing("touch", "The touch", draw, caption, 1), facts_table("In numbers", facts)]
            ),
            manifest_chapter(result.manifest),
        ],
    )
    return write_html(page, Path(folder) / PAGE)


def touch_summary(result: TouchFile) -> list[str]:
    found = result.summary
    return [
        f"The largest force is {number(found.largest_force_mn)} mN, the largest depth "
        f"{number(found.largest_depth_mm)} mm, the largest contact {number(found.largest_contact_mm2)} mm².",
        f"{found.firing} of {found.afferents} afferents fire, at up to {number(found.dynamic_rate_hz)} "
        f"spikes/s in the dynamic window and {number(found.static_rate_hz)} spikes/s in the static window.",
    ]


SKIN = LinearSegmentedColormap.from_list(
    "skin", ["#f7ece1", "#f3c9a5", "#e58a5e", "#b8405e", "#5c1a63", "#1d0b33"]
)
"""From pale skin to dark violet; the lightness falls all the way, so that the order survives greyscale."""

DECADES = 2.5  # Values that are further below the largest share the palest colour.

REACH_MM, ROOM_BELOW_MM, MARGIN_MM = 16.0, 2.0, 0.5
"""Skin to either side of the indenter's axis, room below and beside the finger that is shown. [mm]"""

BODY_MM = 40.0  # Farther than this from its face no body is drawn. [mm]

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
    return write_png(lambda parts: draw(*parts), (skin, answer, indenter), file)


def draw(skin: SkinResponse, response: ResponseMap, indenter: Indenter | None = None) -> Figure:
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
    largest = float(shown.max()) or 1.0
    faces = paint_skin(axes, section.corners_mm, shown, largest, edgecolors="face", linewidths=0.3)
    _fill_bone(axes, section)
    for edges, colour, width in (
        (section.skin_mm, BLACK, 1.0),
        (section.bone_mm, BONE, 1.2),
        (section.nail_mm, BONE, 4.0),
    ):
        axes.add_collection(LineCollection(list(edges), colors=colour, linewidths=width, capstyle="round"))
    x, axis_x_mm = section.corners_mm[..., 0], skin.axis_x_mm + skin.pose.x_mm
    low, high = section.corners_mm[..., 1].min(), section.corners_mm[..., 1].max()
    axes.set(
        xlim=(max(x.min(), axis_x_mm - REACH_MM), min(x.max(), axis_x_mm + REACH_MM) + MARGIN_MM),
        ylim=(low - ROOM_BELOW_MM, high + MARGIN_MM),
        aspect="equal",
        xlabel="along the finger, x [mm]",
        ylabel="towards the back, y [mm]",
    )
    if indenter is not None:
        _draw_indenter(axes, skin, section, indenter)
    axes.grid(visible=False)
    label_skin(axes, faces, f"{name} [kPa]", 0.75)


def paint_skin(axes: Axes, corners: FloatArray, values: Any, largest: float, **edges: Any) -> PolyCollection:
    """Colour faces by their values on a logarithmic scale."""
    norm = LogNorm(largest / 10.0**DECADES, largest, clip=True)
    faces = PolyCollection(list(corners), array=values, cmap=SKIN, norm=norm, **edges)
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
        axes.fill(*outline.T, facecolor="#c9d1d8", edgecolor=BLACK, linewidth=1.0)


def draw_motion(axes: Axes, skin: SkinResponse) -> None:
    axes.plot(skin.times_ms, skin.depth_mm, color=BLUE)
    axes.set(ylabel="depth\n[mm]", ylim=(0.0, 1.15 * float(skin.depth_mm.max())))
    axes.tick_params(labelbottom=False)
    axes.grid(visible=False)


def draw_spikes(axes: Axes, skin: SkinResponse, response: ResponseMap) -> None:
    """Draw the spike trains of the afferents that fire, the nearest to the indenter's axis on top.

    Afferents of a mixed population have a band per type.
    """
    if response.types:
        draw_raster_by_type(axes, response.parts)
        axes.set_xlim(0.0, skin.times_ms[-1])
        return
    plane = response.positions_mm[:, [0, -1]] - [skin.axis_x_mm, 0.0]
    trains = [response.spikes[afferent] for afferent in np.argsort(np.hypot(*plane.T), kind="stable")]
    firing = [train for train in trains if train.size]
    if not firing:
        say_nothing_to_draw(axes, "no afferent fires a spike")
        return
    draw_trains(axes, firing)
    label = f"{len(firing)} of {len(trains)} afferents fire,\nnearest on top"
    axes.set(ylabel=label, xlim=(0.0, skin.times_ms[-1]))
    axes.grid(visible=False)
