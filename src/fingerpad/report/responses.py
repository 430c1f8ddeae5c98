"""Figures of any population: where its afferents lie and what each of them answers to a touch."""

from __future__ import annotations

from collections.abc import Mapping
from typing import Any, Protocol

import numpy as np
from matplotlib.colors import LogNorm, Normalize
from matplotlib.figure import Figure

from fingerpad.checks import FloatArray
from fingerpad.errors import InputError
from fingerpad.report.appearance import GREY, new_figure, numbers
from fingerpad.report.population import QUANTITIES, round_ticks

PANEL_IN = (3.9, 3.3)
ROOM_MM = 0.5
"""Least skin to be seen about the receptors. [mm]"""


class Response(Protocol):
    """What a `ResponseMap` knows, or anything like it."""

    @property
    def positions_mm(self) -> FloatArray:
        """Places of the receptors, (n, 2) or (n, 3). [mm]"""

    @property
    def dynamic_rate_hz(self) -> FloatArray:
        """Rate in the ramp, (n,). [spikes/s]"""

    @property
    def static_rate_hz(self) -> FloatArray:
        """Rate in the hold, (n,). [spikes/s]"""

    @property
    def first_spike_latency_ms(self) -> FloatArray:
        """Time of the first spike, NaN without one, (n,). [ms]"""


def draw(responses: Mapping[str, Response]) -> Figure:
    """Draw populations, one per row, coloured by dynamic rate, static rate and first-spike latency.

    Receptors known by x and z are seen from above, those known by x, y and z from below in perspective; a
    hollow one stays silent. A column has one scale.

    Parameters
    ----------
    responses : mapping of str to ResponseMap
        Answers by the name of the population, of the touch, or both.

    Returns
    -------
    Figure

    Raises
    ------
    InputError
        If there is none.
    """
    if not responses:
        raise InputError("responses must hold at least one population: it is empty.")
    plane = np.concatenate([numbers(response.positions_mm)[:, [0, -1]] for response in responses.values()])
    window = np.stack([plane.min(axis=0) - ROOM_MM, plane.max(axis=0) + ROOM_MM], axis=1)
    width, height = PANEL_IN
    figure = new_figure(3 * width, len(responses) * height)
    grid = figure.add_gridspec(len(responses), 3)
    for column, (key, (phase, label, colours, scaling)) in enumerate(QUANTITIES.items()):
        scale = _scale([numbers(getattr(response, key)) for response in responses.values()], scaling)
        panels = []
        for row, (name, response) in enumerate(responses.items()):
            solid = np.shape(response.positions_mm)[1] == 3
            axes: Any = figure.add_subplot(grid[row, column], projection="3d" if solid else None)
            axes.set_title(f"{name}: {phase}" if column == 0 else phase, pad=24.0 if solid else None)
            values = numbers(getattr(response, key))
            axes.set(xlim=window[0], ylim=window[1])
            dots = _dots(axes, numbers(response.positions_mm), values, colours, scale)
            panels.append(axes)
        bar = figure.colorbar(dots, ax=panels, label=label, shrink=0.85, fraction=0.05, aspect=30)
        if isinstance(scale, LogNorm):
            bar.set_ticks(round_ticks(scale))
            bar.minorticks_off()
            bar.ax.yaxis.set_major_formatter("{x:g}")
    return figure


def _scale(columns: list[FloatArray], scaling: type[Normalize]) -> Normalize:
    """One scale for all rows; rates start at 0."""
    values = np.concatenate(columns)
    known = values[np.isfinite(values)]
    high = float(known.max(initial=1.0))
    low = float(known.min(initial=high)) if scaling is LogNorm else 0.0
    return scaling(low if low < high else 0.5 * high, high)


def _dots(axes: Any, positions: FloatArray, values: FloatArray, colours: str, scale: Normalize) -> Any:
    """Draw one dot per receptor; those that do not answer hollow."""
    answers = values > 0.0
    # The axes of a picture in space are x, z and y: y points up.
    places = positions.T if positions.shape[1] == 2 else positions[:, [0, 2, 1]].T
    size = float(np.clip(6_000.0 / len(values), 6.0, 60.0))
    shown = {"s": size, "linewidths": 0.6} | ({"depthshade": False} if len(places) == 3 else {})
    axes.scatter(*places[:, ~answers], facecolors="none", edgecolors=GREY, **shown)
    dots = axes.scatter(
        *places[:, answers], c=values[answers], cmap=colours, norm=scale, edgecolors=GREY, **shown
    )
    axes.set_xlabel("along, x [mm]")
    axes.set_ylabel("across, z [mm]")
    if len(places) == 3:
        limits = np.array([axes.get_xlim(), axes.get_ylim(), (places[2].min(), places[2].max())])
        axes.set_box_aspect(np.maximum(np.ptp(limits, axis=1), ROOM_MM), zoom=0.85)
        axes.view_init(elev=-60.0, azim=-75.0)
        axes.locator_params(nbins=4)
        axes.set(zlim=limits[2], zticks=())
    else:
        axes.set_aspect("equal")
        axes.grid(visible=False)
    return dots
