"""Level 3, beyond the paper: population rate over time, ring by ring about the contact."""

from __future__ import annotations

from itertools import pairwise

import numpy as np
from matplotlib.axes import Axes
from matplotlib.figure import Figure

from fingerpad.core.checks import FloatArray
from fingerpad.data import protocol
from fingerpad.experiments.gerling2014.response_maps import PopulationRates
from fingerpad.report.formatting import number
from fingerpad.report.recruitment import resting_note
from fingerpad.report.style import BLACK, BLUE, GREEN, GREY, ORANGE, LineStyle, new_figure

LINES: tuple[LineStyle, ...] = (
    {"color": BLACK, "linestyle": "-"},
    {"color": BLUE, "linestyle": "--"},
    {"color": ORANGE, "linestyle": "-."},
    {"color": GREEN, "linestyle": ":"},
    {"color": GREY, "linestyle": "-"},
)
EARLY_MS = 150.0
"""End of the left column, where most happens. [ms]"""


def draw_population_rate(section: PopulationRates) -> Figure:
    """Draw the rate of each ring, the share of it that fires, and the rate of all rings under every touch."""
    figure = new_figure(12.0, 10.0)
    panels = figure.subplots(3, 2, width_ratios=(1.4, 1.0), sharey="row")
    edges, active_edges, first = section.edges_ms, section.active_edges_ms, section.touches[0]
    names = [f"{number(inner)} to {number(outer)} mm" for inner, outer in pairwise(section.radii_mm)]
    for axes in panels[0]:
        _steps(axes, edges, first.rate_hz, names)
    for axes in panels[1]:
        _steps(axes, active_edges, first.active_fraction, names)
    together = np.array([touch.together_per_cm2_hz for touch in section.touches])
    for axes in panels[2]:
        _steps(axes, edges, together / 1000.0, [touch.name for touch in section.touches])
    for (early, late), letter, what in zip(
        panels, "abc", ("rate of a ring", "share that fires", "rate of all rings"), strict=True
    ):
        early.set_title(f"({letter}) {what}" + (f", {first.name}" if letter != "c" else ""))
        early.set_xlim(0.0, EARLY_MS)
        late.set_xlim(EARLY_MS, edges[-1])
        early.axvline(protocol.RAMP.value, color=GREY, linewidth=0.8)
        early.set_ylim(bottom=0.0)
        early.legend(loc="upper right")
    panels[0, 0].set_ylabel("rate per afferent [spikes/s]")
    per_cm2 = section.density_per_cm2 / 1000.0
    beside = panels[0, 1].secondary_yaxis(
        "right", functions=(lambda rate: rate * per_cm2, lambda rate: rate / per_cm2)
    )
    beside.set_ylabel(f"at {number(section.density_per_cm2)} per cm² [1000 spikes/s per cm²]")
    panels[1, 0].set_ylabel(f"afferents that fire within {number(active_edges[1] - active_edges[0])} ms")
    panels[2, 0].set_ylabel("rate of skin [1000 spikes/s per cm²]")
    for axes in panels[2]:
        axes.set_xlabel("time from onset [ms]")
    return figure


def _steps(axes: Axes, edges: FloatArray, rows: FloatArray, names: list[str]) -> None:
    for row, (values, name) in enumerate(zip(rows, names, strict=True)):
        axes.stairs(values, edges, baseline=None, label=name, linewidth=1.6, **LINES[row % len(LINES)])


def caption_population_rate(section: PopulationRates) -> str:
    """Caption of the figure."""
    inner, outer = section.radii_mm[0], section.radii_mm[-1]
    return (
        "Population rate over time: all spikes of the afferents at a distance from the middle of the "
        f"contact, per bin, smoothed by a normal density of {number(section.smoothing_ms)} ms that preserves "
        "their number. Left: ramp and start of the hold; right: rest of the hold. (a) Per afferent, silent "
        f"ones included, and per area of skin at {number(section.density_per_cm2)} afferents per cm². (b) "
        "Share of the afferents that fire at least once in a bin. (c) All afferents from "
        f"{number(inner)} to {number(outer)} mm together, under "
        + " and ".join(touch.name for touch in section.touches)
        + ". The model has no noise here, so neighbours fire almost synchronously, which causes ripples. "
        + resting_note(
            section.resting_latency_ms,
            "All start at onset: peaks shortly before its multiples are not caused by the touch.",
        )
    )
