"""Figures of any population: where its afferents lie and how each of them responds to a touch."""

from __future__ import annotations

from collections.abc import Mapping
from typing import Any

import numpy as np
from matplotlib.colors import LogNorm, Normalize
from matplotlib.figure import Figure

from fingerpad.core.checks import FloatArray
from fingerpad.core.errors import InputError
from fingerpad.core.signals import ResponseMap
from fingerpad.report.mixed_responses import MAP_AXES
from fingerpad.report.population import QUANTITIES, with_round_ticks
from fingerpad.report.style import GREY, new_figure

PANEL_IN = (3.9, 3.3)
POINTS_PER_PANEL = 180.0  # Side of the picture within a panel. [1/72 inch]
ROOM_MM = 0.5  # Least skin to be seen about the receptors. [mm]


def draw_responses(responses: Mapping[str, ResponseMap]) -> Figure:
    """Draw populations, one per row, coloured by dynamic rate, static rate and first-spike latency.

    They are seen from below, x to the right. Receptors on the dorsal side (y above 0) are squares; hollow
    ones do not respond. A column has one scale.
    """
    if not responses:
        raise InputError("responses must hold at least one population: it is empty.")
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
