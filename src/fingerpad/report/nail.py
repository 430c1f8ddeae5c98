"""Figure 9: stress of the skin all over the finger, and its concentration at the border of the nail."""

from __future__ import annotations

import numpy as np
from matplotlib import colormaps
from matplotlib.axes import Axes
from matplotlib.collections import LineCollection, PolyCollection
from matplotlib.colors import LogNorm, Normalize
from matplotlib.figure import Figure

from fingerpad.core.checks import FloatArray
from fingerpad.experiments.gerling2014.nail_border import NailBorder, StressProfile
from fingerpad.report.formatting import number
from fingerpad.report.style import BLACK, BLUE, GREY, ORANGE, PALE, new_figure

DECADES = 4.0
LABEL = "von Mises stress [kPa]"
NEAR_NAIL = "von Mises stress about the nail [kPa]"


def draw_nail(section: NailBorder) -> Figure:
    """Draw Figure 9: the pressed finger on a logarithmic scale, the border of the nail on a linear one."""
    figure = new_figure(13.0, 7.0)
    panels = figure.subplots(2, 3)
    middle, across, nail = section.middle, section.across, section.nail_mm
    stress = section.von_mises_kpa.ravel()
    wide = _logarithmic(np.concatenate([stress, middle.von_mises_kpa]))
    near = Normalize(0.0, section.border_kpa or 1.0)
    outlines = {"x": _corners(section.x_mm), "y": _corners(section.y_mm), "z": _corners(section.z_mm)}
    both = [{**outlines, "z": sign * outlines["z"]} for sign in (1.0, -1.0)]

    _seen(panels[0, 0], both, ("x", "z"), -outlines["y"], stress, wide)
    _seen(panels[0, 1], both[:1], ("x", "y"), outlines["z"], stress, wide)
    _paint(panels[0, 2], np.stack([middle.x_mm, middle.y_mm], axis=-1), middle.von_mises_kpa, wide)
    _seen(panels[1, 0], both, ("x", "z"), outlines["y"], stress, near)
    for sign in (1.0, -1.0):
        _border(panels[1, 0], nail[..., [0, 2]] * [1.0, sign])
    _border(panels[0, 1], nail[..., [0, 1]])
    cut = np.stack([across.z_mm, across.y_mm], axis=-1)
    _paint(panels[1, 1], np.concatenate([cut, cut * [-1.0, 1.0]]), np.tile(across.von_mises_kpa, 2), near)
    _profiles(panels[1, 2], section.profile)

    titles = (
        ("(a) skin from below: the pad", "x, distal [mm]", "z, lateral [mm]"),
        ("(b) skin from the side", "x, distal [mm]", "y, dorsal [mm]"),
        ("(c) middle section, z = 0", "x, distal [mm]", "y, dorsal [mm]"),
        ("(d) skin from above: the nail", "x, distal [mm]", "z, lateral [mm]"),
        (f"(e) section across, x = {number(across.x_mm)} mm", "z, lateral [mm]", "y, dorsal [mm]"),
        ("(f) across the border of the nail", "distance from the nail [mm]", LABEL),
    )
    for axes, (title, right, up) in zip(panels.flat, titles, strict=True):
        axes.set_title(title)
        axes.set_xlabel(right)
        axes.set_ylabel(up)
    figure.colorbar(
        panels[0, 0].collections[0], ax=panels[0, :], label=LABEL, extend="min", pad=0.02, aspect=25
    )
    figure.colorbar(
        panels[1, 0].collections[0], ax=panels[1, :2], label=NEAR_NAIL, extend="max", pad=0.02, aspect=25
    )
    return figure


def _logarithmic(stress: FloatArray) -> LogNorm:
    """Colours over a fixed number of decades below the peak; smaller values have the darkest colour."""
    known = stress[np.isfinite(stress)]
    peak = known.max() if known.size and known.max() > 0.0 else 1.0
    return LogNorm(vmin=peak / 10.0**DECADES, vmax=peak, clip=True)


def _corners(grid: FloatArray) -> FloatArray:
    """Values at the four corners of each face of a grid, (n_faces, 4)."""
    around = (grid[:-1, :-1], grid[1:, :-1], grid[1:, 1:], grid[:-1, 1:])
    return np.stack(around, axis=-1).reshape(-1, 4)


def _seen(
    axes: Axes,
    halves: list[dict[str, FloatArray]],
    plane: tuple[str, str],
    near: FloatArray,
    stress: FloatArray,
    scale: Normalize,
) -> None:
    """Draw the skin as seen from far away: nearer faces are drawn later and hide the others."""
    outlines = np.concatenate([np.stack([half[plane[0]], half[plane[1]]], axis=-1) for half in halves])
    order = np.argsort(np.tile(near.mean(axis=1), len(halves)), kind="stable")
    _paint(axes, outlines[order], np.tile(stress, len(halves))[order], scale)


def _paint(axes: Axes, outlines: FloatArray, stress: FloatArray, scale: Normalize) -> None:
    # A lighter ground than the darkest colour keeps the outline of the finger visible.
    axes.set_facecolor(PALE)
    polygons = PolyCollection(
        list(outlines),
        array=np.ma.masked_invalid(stress),
        cmap=colormaps["inferno"].with_extremes(bad=GREY),
        norm=scale,
        edgecolors="face",
        linewidths=0.3,
    )
    axes.add_collection(polygons)
    axes.autoscale_view()
    axes.set_aspect("equal")
    axes.grid(visible=False)


def _border(axes: Axes, edges: FloatArray) -> None:
    """Draw the outline of the nail."""
    axes.add_collection(LineCollection(list(edges), colors="white", linewidths=1.2))


def _profiles(axes: Axes, profile: StressProfile) -> None:
    """Stress over distance from the nail: median and middle 80 % of the sections that cross its border."""
    for stress_kpa, name, colour, style in (
        (profile.surface_kpa, "surface of the skin", ORANGE, "-"),
        (profile.living_epidermis_kpa, "living epidermis", BLUE, "--"),
    ):
        low, median, high = stress_kpa.T
        axes.fill_between(profile.distance_mm, low, high, color=colour, alpha=0.2, linewidth=0.0)
        axes.plot(profile.distance_mm, median, style, color=colour, label=name)
    axes.axvline(0.0, color=BLACK, linewidth=0.8)
    axes.set_ylim(bottom=0.0)
    axes.text(
        -0.1,
        0.95,
        "under\nthe nail",
        transform=axes.get_xaxis_transform(),
        color=BLACK,
        ha="right",
        va="top",
        size=9,
    )
    axes.legend(loc="upper right")


def caption_nail(section: NailBorder) -> str:
    """Caption of Figure 9."""
    return (
        "Predicted von Mises stress at the end of the hold, on the finger that the standard sphere deforms; "
        "nothing here was observed: (a, b) "
        "in the outermost elements of the skin and (c) in the middle section, on a logarithmic scale of "
        f"{number(DECADES)} decades; (d) the back of the finger and (e) the section with the highest ratio, "
        "on a linear scale up to the highest stress at the border of the nail (its outline in white); (f) "
        "median and middle 80 % of all sections that cross that border. One half is computed; the other is "
        "its mirror image. The paper shows high stresses at the border of the nail. "
        f"{section.text}"
    )
