"""Figures of populations: Figure 6, and those of any population."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from itertools import cycle
from typing import Any

import numpy as np
from matplotlib import colormaps
from matplotlib.axes import Axes
from matplotlib.colorbar import Colorbar
from matplotlib.colors import LogNorm, Normalize
from matplotlib.figure import Figure
from matplotlib.patches import Rectangle

from fingerpad.core.checked import checked
from fingerpad.core.errors import InputError
from fingerpad.core.signals import ResponseMap
from fingerpad.core.values import FloatArray
from fingerpad.data import protocol
from fingerpad.experiments.gerling2014.three_levels import PopulationMaps
from fingerpad.report.formatting import number
from fingerpad.report.style import (
    BLACK,
    BLUE,
    COLUMN_IN,
    GREEN,
    GREY,
    ORANGE,
    PALE,
    new_figure,
    say_nothing_to_draw,
)

ROW_IN = (9.5, 3.4)
STYLES = ((BLUE, "o"), (ORANGE, "^"), (BLACK, "s"), (GREEN, "D"), (GREY, "v"))
"""Colour and marker of the types, in their order."""

MAP_AXES: Any = {"xlabel": "x, distal [mm]", "ylabel": "z, lateral [mm]", "aspect": "equal"}
"""Axes of a map of the pad: distal is to the right."""

LARGEST_MARK, SILENT_MARK = 60.0, 4.0  # Areas: most active afferent of a type, silent. [points²]
ROW_DRAWN = 0.85  # Length of the mark of a spike, over the height of the row of its afferent.


@checked
def draw_mixed_responses(touches: Mapping[str, Mapping[str, ResponseMap]]) -> Figure:
    """Draw the responses to touches, one per row: all spikes over time, and where the afferents lie.

    A raster has a band per type, in which those that fire are sorted by the distance from the middle. In the
    map the area of a mark grows with the number of spikes over the largest of its type; silent ones are dots.

    Parameters
    ----------
    touches : mapping of str to mapping of str to ResponseMap
        Responses by the name of the touch and by type, such as `ResponseMap.parts`.
    """
    if not touches:
        raise InputError("touches", "must hold at least one response", remedy="it is empty")
    width, height = ROW_IN
    figure = new_figure(width, height * len(touches))
    grid = figure.subplots(len(touches), 2, squeeze=False, width_ratios=(1.7, 1.0))
    for (raster, places), (name, maps) in zip(grid, touches.items(), strict=True):
        raster.set_title(name)
        draw_raster_by_type(raster, maps)
        draw_map_by_type(places, maps)
    grid[0, 1].legend(loc="upper left", bbox_to_anchor=(1.0, 1.0))
    return figure


def draw_raster_by_type(axes: Axes, maps: Mapping[str, ResponseMap]) -> None:
    """Draw all spikes over time, in a band per type that the afferents which fire divide among them."""
    labels = []
    for band, ((name, response), (colour, _)) in enumerate(zip(maps.items(), cycle(STYLES), strict=False)):
        counts = response.spike_count
        middle = response.positions_mm.mean(axis=0)
        order = np.argsort(np.linalg.norm(response.positions_mm - middle, axis=1))
        firing = order[counts[order] > 0]
        top_of = np.zeros(order.size)
        top_of[firing] = band + np.arange(firing.size) / max(firing.size, 1)
        tops = np.repeat(top_of, counts)
        axes.vlines(
            response.spikes.times_ms, tops, tops + ROW_DRAWN / max(firing.size, 1), color=colour,
            linewidth=0.6,
        )  # fmt: skip
        axes.axhline(band, color=GREY, linewidth=0.5)
        labels.append(f"{name}\n{firing.size} of {order.size}")
    axes.set(xlabel="time [ms]", ylabel="afferents that fire, nearest on top", ylim=(len(maps), 0.0))
    axes.set_yticks(0.5 + np.arange(len(maps)), labels)
    axes.grid(visible=False)


def draw_map_by_type(axes: Axes, maps: Mapping[str, ResponseMap]) -> None:
    """Draw where the afferents lie, with larger marks for more spikes."""
    for (name, response), (colour, marker) in zip(maps.items(), cycle(STYLES), strict=False):
        counts = response.spike_count
        x, z = response.positions_mm[:, 0], response.positions_mm[:, -1]
        axes.scatter(x[counts == 0], z[counts == 0], SILENT_MARK, color=colour, marker=".", linewidths=0.0)
        fires = counts > 0
        area = SILENT_MARK + LARGEST_MARK * counts[fires] / max(counts.max(initial=1), 1)
        axes.scatter(
            x[fires], z[fires], area, facecolors="none", edgecolors=colour, marker=marker, linewidths=0.9,
            label=name,
        )  # fmt: skip
    axes.set(**MAP_AXES)


def draw_trains(axes: Axes, trains: Sequence[FloatArray]) -> None:
    """Draw spike trains over time, a row each, the first on top."""
    rows = list(range(1, len(trains) + 1))
    axes.eventplot(trains, lineoffsets=rows, linelengths=0.75, linewidths=1.0, colors=BLACK)
    axes.set(xlabel="time [ms]", ylim=(len(trains) + 0.75, 0.25), yticks=[])


PANEL_IN = (3.9, 3.3)
POINTS_PER_PANEL = 180.0  # Side of the picture within a panel. [1/72 inch]
ROOM_MM = 0.5  # Least skin to be seen about the receptors. [mm]


def draw_responses(responses: Mapping[str, ResponseMap]) -> Figure:
    """Draw populations, one per row, coloured by dynamic rate, static rate and first-spike latency.

    They are seen from below, x to the right. Receptors on the dorsal side (y above 0) are squares; hollow
    ones do not respond. A column has one scale.
    """
    if not responses:
        raise InputError("responses", "must hold at least one population", remedy="it is empty")
    width, height = PANEL_IN
    figure = new_figure(3 * width, len(responses) * height)
    grid = figure.subplots(len(responses), 3, squeeze=False)
    for panels, (key, (phase, label, colours, scaling)) in zip(grid.T, QUANTITIES.items(), strict=True):
        scale = _scale([getattr(response, key) for response in responses.values()], scaling)
        for axes, (name, response) in zip(panels, responses.items(), strict=True):
            axes.set_title(f"{name}: {phase}" if axes in grid[:, 0] else phase)
            dots = _dots(axes, response, getattr(response, key), colours, scale)
        bar = figure.colorbar(dots, ax=panels.tolist(), label=label, shrink=0.85, fraction=0.05, aspect=30)
        with_round_ticks(bar, scale)
    return figure


def _scale(columns: list[FloatArray], scaling: type[Normalize]) -> Normalize:
    """One scale for all rows; rates start at 0."""
    values = np.concatenate(columns)
    known = values[np.isfinite(values)]
    high = float(known.max(initial=1.0))
    low = float(known.min(initial=high)) if scaling is LogNorm else 0.0
    return scaling(low if low < high else 0.5 * high, high)


def _dots(axes: Any, response: ResponseMap, values: FloatArray, colours: str, scale: Normalize) -> Any:
    """Draw one mark per receptor; those that do not respond are hollow."""
    positions = response.positions_mm
    plane = positions[:, [0, -1]]
    low, high = plane.min(axis=0) - ROOM_MM, plane.max(axis=0) + ROOM_MM
    spacing_pt = POINTS_PER_PANEL * response.pitch_mm / float((high - low).max())
    size = float(np.clip((0.5 * spacing_pt) ** 2, 4.0, 80.0))
    dorsal = positions[:, 1] > 0.0 if positions.shape[1] == 3 else np.zeros(len(positions), dtype=bool)
    for marker, side in (("o", ~dorsal), ("s", dorsal)):
        silent, answers = plane[side & ~(values > 0.0)], plane[side & (values > 0.0)]
        known = values[side & (values > 0.0)]
        axes.scatter(*silent.T, s=size, marker=marker, facecolors="none", edgecolors=GREY, linewidths=0.6)
        edge = {"edgecolors": GREY, "linewidths": 0.6}
        dots = axes.scatter(*answers.T, s=size, marker=marker, c=known, cmap=colours, norm=scale, **edge)
    axes.set(xlim=(low[0], high[0]), ylim=(low[1], high[1]), **MAP_AXES)
    axes.grid(visible=False)
    return dots


QUANTITIES = {
    "dynamic_rate_hz": ("dynamic ramp", "rate [spikes/s]", "viridis", Normalize),
    "static_rate_hz": ("static hold", "rate [spikes/s]", "viridis", Normalize),
    # Most first spikes come within a few tens of milliseconds, those at the rim after hundreds.
    "first_spike_latency_ms": ("first spike", "latency [ms]", "viridis_r", LogNorm),
}

TICKS_MS = (1.0, 2.0, 5.0, 10.0, 20.0, 50.0, 100.0, 200.0, 500.0, 1000.0)


def draw_population(section: PopulationMaps) -> Figure:
    """Draw Figure 6: each quantity as a surface, and flat with the receptors."""
    figure = new_figure(COLUMN_IN, 8.4)
    grid = figure.add_gridspec(3, 2, width_ratios=(1.15, 1.0))
    x, z, receptors = section.x_mm, section.z_mm, section.receptors_mm
    for row, (key, (phase, label, colours, scaling)) in enumerate(QUANTITIES.items()):
        values = getattr(section, key)
        surface = figure.add_subplot(grid[row, 0], projection="3d")
        surface.set_title(f"({'abc'[row]}) {phase}")
        plane = figure.add_subplot(grid[row, 1])
        if np.isnan(values).all():
            say_nothing_to_draw(plane, "no afferent fires")
            surface.set_axis_off()
            continue
        low, high = float(np.nanmin(values)), float(np.nanmax(values))
        scale = scaling(low, max(high, 1.001 * low, 1e-3), clip=True)  # apart, as logarithms need it
        _surface(surface, x, z, values, label, colours, scale)
        _map(plane, x, z, values, label, colours, scale, receptors)
        # Until it is drawn, Matplotlib 3.11.0 lays a surface out as if it filled the figure.
        surface.draw(figure.canvas.get_renderer())  # type: ignore[attr-defined]
    return figure


def round_ticks(scale: Normalize) -> list[float]:
    return [tick for tick in TICKS_MS if 0.0 <= float(scale(tick, clip=False)) <= 1.0]


def with_round_ticks(bar: Colorbar, scale: Normalize) -> None:
    """Put round numbers beside the colours of a logarithmic scale."""
    if isinstance(scale, LogNorm):
        bar.set_ticks(round_ticks(scale))
        bar.minorticks_off()
        bar.ax.yaxis.set_major_formatter("{x:g}")


def _surface(
    axes: Any, x: FloatArray, z: FloatArray, values: FloatArray, label: str, colours: str, scale: Normalize
) -> None:
    along, lateral = np.meshgrid(x, z, indexing="ij")
    # Surfaces have no logarithmic axis: the heights are logarithms, and the ticks show the values.
    logarithmic = isinstance(scale, LogNorm)
    heights, faces = np.log10(values) if logarithmic else values, colormaps[colours](scale(values))
    grid: Any = {"rcount": 60, "ccount": 60, "edgecolor": "#00000030", "linewidth": 0.3, "shade": False}
    axes.plot_surface(along, lateral, heights, facecolors=faces, **grid)
    axes.locator_params(nbins=3)
    if logarithmic:
        shown = round_ticks(scale)
        axes.set_zticks(np.log10(shown), labels=[f"{tick:g}" for tick in shown])
    axes.set_xlabel("x, distal [mm]", labelpad=4.0)
    axes.set_ylabel("z, lateral [mm]", labelpad=4.0)
    axes.set_zlabel(label, labelpad=4.0)
    axes.view_init(elev=28.0, azim=-58.0)
    axes.set_box_aspect((1.25, 1.05, 0.85), zoom=0.85)


def _map(
    axes: Axes, x: FloatArray, z: FloatArray, values: FloatArray, label: str, colours: str, scale: Normalize,
    receptors: FloatArray,
) -> None:  # fmt: skip
    picture = axes.pcolormesh(
        x, z, np.ma.masked_where(~(values.T > 0.0), values.T), cmap=colours, norm=scale, shading="nearest"
    )
    silent = Rectangle((0, 0), 1, 1, transform=axes.transAxes, facecolor=PALE, hatch="//", edgecolor=GREY)
    silent.set(zorder=0, linewidth=0.0)
    axes.add_patch(silent)
    dots: Any = {"markersize": 4.5, "color": "white", "markeredgecolor": "black"}
    axes.plot(receptors[:, 0], receptors[:, 1], "o", label=f"{len(receptors)} receptors", **dots)
    axes.set(**MAP_AXES)
    axes.grid(visible=False)
    with_round_ticks(axes.figure.colorbar(picture, ax=axes, label=label, shrink=0.85), scale)
    axes.legend(loc="lower right", bbox_to_anchor=(1.0, 1.0), borderaxespad=0.1)


def caption_population(section: PopulationMaps, human: PopulationMaps) -> str:
    resting = "".join(
        f" The afferent of {name} also fires without touch, {number(each.at_rest.static_rate_hz)} spikes/s "
        f"from {number(each.at_rest.first_spike_latency_ms)} ms on."
        for name, each in (("paper", section), ("human", human))
        if np.isfinite(each.at_rest.first_spike_latency_ms)
    )
    return (
        f"Predicted response of afferents all over the pad to a sphere of {number(section.curvature_per_m)} "
        f"1/m, at a depth of {protocol.DEPTH.value} mm. Left: the quantity as a height, as in the paper, but "
        "latencies on a logarithmic scale. Right: the same seen from above; circles are the receptors of "
        "Figures 7 and 8, hatched skin does not respond. All afferents have the parameters of the fitted "
        f"afferent; nothing here was observed.{resting}"
    )
