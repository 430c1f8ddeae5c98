"""Figure of a mixed population under touches: a raster of all spikes, and a map of those that fire."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from itertools import cycle
from typing import Any

import numpy as np
from matplotlib.axes import Axes
from matplotlib.figure import Figure

from fingerpad.core.checks import FloatArray
from fingerpad.core.errors import InputError
from fingerpad.core.keywords import known_keywords
from fingerpad.core.signals import ResponseMap
from fingerpad.report.style import BLACK, BLUE, GREEN, GREY, ORANGE, new_figure

ROW_IN = (9.5, 3.4)
STYLES = ((BLUE, "o"), (ORANGE, "^"), (BLACK, "s"), (GREEN, "D"), (GREY, "v"))
"""Colour and marker of the types, in their order."""

MAP_AXES: Any = {"xlabel": "x, distal [mm]", "ylabel": "z, lateral [mm]", "aspect": "equal"}
"""Axes of a map of the pad: distal is to the right."""

LARGEST_MARK, SILENT_MARK = 60.0, 4.0  # Areas: most active afferent of a type, silent. [points²]
ROW_DRAWN = 0.85  # Length of the mark of a spike, over the height of the row of its afferent.


@known_keywords
def draw_mixed_responses(touches: Mapping[str, Mapping[str, ResponseMap]]) -> Figure:
    """Draw the responses to touches, one per row: all spikes over time, and where the afferents lie.

    A raster has a band per type, in which those that fire are sorted by the distance from the middle. In the
    map the area of a mark grows with the number of spikes over the largest of its type; silent ones are dots.

    Parameters
    ----------
    touches : mapping of str to mapping of str to ResponseMap
        Responses by the name of the touch and by type, such as `MixedResponse.maps`.
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
