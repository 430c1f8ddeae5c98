"""Figure 9: strain energy density in the skin all over the finger, and in the section through its middle."""

from __future__ import annotations

from typing import Any

import numpy as np
from matplotlib import colormaps
from matplotlib.axes import Axes
from matplotlib.collections import PolyCollection
from matplotlib.colors import LogNorm
from matplotlib.figure import Figure

from fingerpad.checks import FloatArray
from fingerpad.report.appearance import GREY, PALE, new_figure, numbers, say_nothing_to_draw
from fingerpad.report.words import number

DECADES = 5.0
LABEL = "strain energy density [kPa]"


def draw(section: dict[str, Any]) -> Figure:
    """Draw Figure 9: the skin from three sides and the section through the middle, all to one scale.

    Parameters
    ----------
    section : dict
        `results["nail"]`.

    Returns
    -------
    Figure
    """
    figure = new_figure(11.0, 6.2)
    panels = figure.subplots(2, 2, height_ratios=(20.0, 15.0), sharex=True, sharey="row")
    x, y, z, sed = (numbers(section[key]) for key in ("x_mm", "y_mm", "z_mm", "sed_kpa"))
    cut = section.get("section")
    scale = _scale(np.concatenate([sed.ravel(), numbers(cut["sed_kpa"]) if cut else []]))
    whole_x, whole_y, whole_z = (_both_halves(x, x), _both_halves(y, y), _both_halves(z, -z))
    faces = _cell_means(_both_halves(sed, sed))
    _seen(panels[0, 0], whole_x, whole_z, -whole_y, faces, scale)
    _seen(panels[0, 1], whole_x, whole_z, whole_y, faces, scale)
    _seen(panels[1, 0], whole_x, whole_y, whole_z, faces, scale)
    titles = ("(a) skin from below: the pad", "(b) skin from above: the nail", "(c) skin from the side")
    for axes, title, upright in zip(
        panels.flat, titles, ("z, lateral", "z, lateral", "y, dorsal"), strict=False
    ):
        axes.set_title(title)
        axes.set_ylabel(f"{upright} [mm]")
    _cut_open(panels[1, 1], cut, scale)
    for axes in panels[1]:
        axes.set_xlabel("x, distal [mm]")
    figure.colorbar(panels[0, 0].collections[0], ax=panels, label=LABEL, extend="min", pad=0.02, aspect=40)
    return figure


def _scale(sed: FloatArray) -> LogNorm:
    """Colours over a fixed number of decades below the peak; what is weaker shares the darkest."""
    known = sed[np.isfinite(sed)]
    peak = known.max() if known.size and known.max() > 0.0 else 1.0
    return LogNorm(vmin=peak / 10.0**DECADES, vmax=peak, clip=True)


def _both_halves(half: FloatArray, mirrored: FloatArray) -> FloatArray:
    """Half a finger and its mirror image as one closed grid, joined along both midlines."""
    return np.concatenate([mirrored[:, ::-1], half, mirrored[:, -1:]], axis=1)


def _corners(grid: FloatArray) -> FloatArray:
    """Values at the four corners of each cell of a grid, (n_cells, 4)."""
    around = (grid[:-1, :-1], grid[1:, :-1], grid[1:, 1:], grid[:-1, 1:])
    return np.stack(around, axis=-1).reshape(-1, 4)


def _cell_means(grid: FloatArray) -> FloatArray:
    return _corners(grid).mean(axis=1)


def _seen(
    axes: Axes, right: FloatArray, up: FloatArray, near: FloatArray, sed: FloatArray, scale: LogNorm
) -> None:
    """Draw the skin as seen from far away: what is nearer to the eye is drawn later and hides the rest."""
    order = np.argsort(_cell_means(near), kind="stable")
    outlines = np.stack([_corners(right), _corners(up)], axis=-1)[order]
    _paint(axes, outlines, sed[order], scale)


def _cut_open(axes: Axes, section: dict[str, Any] | None, scale: LogNorm) -> None:
    if not section:
        say_nothing_to_draw(axes, "no section in these results")
        return
    outlines = np.stack([numbers(section["x_mm"]), numbers(section["y_mm"])], axis=-1)
    _paint(axes, outlines, numbers(section["sed_kpa"]), scale)
    state = "deformed" if section.get("displaced") else "undeformed"
    axes.set_title(f"(d) section through the middle, z = 0, {state}")
    axes.set_ylabel("y, dorsal [mm]")


def _paint(axes: Axes, outlines: FloatArray, sed: FloatArray, scale: LogNorm) -> None:
    # A lighter ground than the darkest colour keeps the outline of the finger visible.
    axes.set_facecolor(PALE)
    polygons = PolyCollection(
        list(outlines),
        array=np.ma.masked_invalid(sed),
        cmap=colormaps["inferno"].with_extremes(bad=GREY),
        norm=scale,
        edgecolors="face",
        linewidths=0.3,
    )
    axes.add_collection(polygons)
    axes.autoscale_view()
    axes.set_aspect("equal")
    axes.grid(visible=False)


def caption(section: dict[str, Any]) -> str:
    """Say what Figure 9 shows and what the paper found."""
    ratio = section.get("ratio")
    return (
        "Strain energy density under the standard sphere: (a-c) in the living epidermis all over the "
        "finger, one half computed and drawn with its mirror image; (d) in all tissues of the middle "
        f"section. The scale is logarithmic over {number(DECADES)} decades; weaker places are black. The "
        "paper shows high stresses at the border of the nail."
        + (f" Ratio at the border of the nail: {number(ratio)}." if ratio is not None else "")
        + (f" {section['text']}" if section.get("text") else "")
    )
