"""Level 3, Figure 6: what a sheet of afferents answers to one sphere."""

from __future__ import annotations

from typing import Any

import numpy as np
from matplotlib.axes import Axes
from matplotlib.figure import Figure
from matplotlib.patches import Rectangle

from fingerpad.checks import FloatArray
from fingerpad.parameters import protocol
from fingerpad.report.appearance import GREY, PALE, new_figure, numbers, say_nothing_to_draw
from fingerpad.report.words import number

QUANTITIES = {
    "dynamic_rate_hz": ("dynamic ramp", "rate [spikes/s]", "viridis"),
    "static_rate_hz": ("static hold", "rate [spikes/s]", "viridis"),
    "first_spike_latency_ms": ("first spike", "latency [ms]", "viridis_r"),
}


def draw(section: dict[str, Any]) -> Figure:
    """Draw Figure 6: each quantity as a surface on the left and as a map with the receptors on the right.

    Parameters
    ----------
    section : dict
        `results["population"]`.

    Returns
    -------
    Figure
    """
    figure = new_figure(10.0, 11.0)
    grid = figure.add_gridspec(3, 2, width_ratios=(1.1, 1.0))
    x, z = numbers(section["x_mm"]), numbers(section["z_mm"])
    receptors = numbers(section["receptors_mm"]).reshape(-1, 2)
    for row, (key, (phase, label, colours)) in enumerate(QUANTITIES.items()):
        values = numbers(section[key])
        surface = figure.add_subplot(grid[row, 0], projection="3d")
        surface.set_title(f"({'abc'[row]}) {phase}")
        plane = figure.add_subplot(grid[row, 1])
        if np.isnan(values).all():
            say_nothing_to_draw(plane, "no afferent fires a spike")
            surface.set_axis_off()
            continue
        _surface(surface, x, z, values, label, colours)
        _map(plane, x, z, values, label, colours, receptors)
    return figure


def _surface(axes: Any, x: FloatArray, z: FloatArray, values: FloatArray, label: str, colours: str) -> None:
    along, lateral = np.meshgrid(x, z, indexing="ij")
    axes.plot_surface(
        along,
        lateral,
        values,
        cmap=colours,
        vmin=np.nanmin(values),
        vmax=np.nanmax(values),
        rcount=60,
        ccount=60,
        edgecolor="#00000030",
        linewidth=0.3,
    )
    axes.locator_params(nbins=5)
    axes.set_xlabel("along, x [mm]", labelpad=6.0)
    axes.set_ylabel("across, z [mm]", labelpad=6.0)
    axes.set_zlabel(label, labelpad=6.0)
    axes.view_init(elev=28.0, azim=-58.0)
    axes.set_box_aspect((1.25, 1.05, 0.85), zoom=1.0)


def _map(
    axes: Axes,
    x: FloatArray,
    z: FloatArray,
    values: FloatArray,
    label: str,
    colours: str,
    receptors: FloatArray,
) -> None:
    picture = axes.pcolormesh(x, z, np.ma.masked_invalid(values.T), cmap=colours, shading="nearest")
    silent = Rectangle((0, 0), 1, 1, transform=axes.transAxes, facecolor=PALE, hatch="//", edgecolor=GREY)
    silent.set(zorder=0, linewidth=0.0)
    axes.add_patch(silent)
    axes.plot(
        receptors[:, 0],
        receptors[:, 1],
        "o",
        markersize=6.0,
        color="white",
        markeredgecolor="black",
        label=f"{len(receptors)} receptors",
    )
    axes.set_aspect("equal")
    axes.grid(visible=False)
    axes.set_xlabel("along the finger, x [mm]")
    axes.set_ylabel("across, z [mm]")
    axes.figure.colorbar(picture, ax=axes, label=label, shrink=0.85)
    axes.legend(loc="lower right", bbox_to_anchor=(1.0, 1.0), borderaxespad=0.1)


def caption(section: dict[str, Any]) -> str:
    """Say what Figure 6 shows."""
    return (
        f"Response of afferents all over the pad to a sphere of {number(section['curvature_per_m'])} 1/m, "
        f"{protocol.DEPTH.value} mm deep. Left: the quantity as a height. Right: the same from above; "
        "circles are the receptors that the observers of Figures 7 and 8 read, hatched places stay silent. "
        "The paper draws the same three quantities."
    )
