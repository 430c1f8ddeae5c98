"""Figure 2: one sphere on all levels: pressed skin, one afferent below it, and three afferents."""

from __future__ import annotations

from typing import Any

import numpy as np
from matplotlib.axes import Axes
from matplotlib.figure import Figure
from matplotlib.patches import Circle

from fingerpad.core.units import MM_PER_M
from fingerpad.data import protocol
from fingerpad.experiments.gerling2014.three_levels import ThreeLevels
from fingerpad.report.formatting import fixed, joined, number
from fingerpad.report.mesh_picture import corners
from fingerpad.report.style import BLACK, BLUE, COLUMN_IN, GREY, PALE, new_figure
from fingerpad.report.touch import label_skin, paint_skin

NANOAMPERE_PER_MA = 1e6
SHOWN_MM = (7.0, 4.5)  # Half the width of the skin that is shown, and height above the contact. [mm]


def draw_levels(section: ThreeLevels) -> Figure:
    """Draw Figure 2 for one set: skin above, one afferent in the middle, three afferents below."""
    figure = new_figure(COLUMN_IN, 7.4)
    grid = figure.add_gridspec(5, 1, height_ratios=(3.2, 1.0, 1.0, 0.5, 1.5))
    skin, current, potential, train, spikes = (figure.add_subplot(grid[row]) for row in range(5))
    for axes in (current, potential):
        axes.sharex(train)
    _draw_skin(skin, section)
    _draw_afferent(current, potential, train, section)
    _draw_population(spikes, section)
    return figure


def _draw_skin(axes: Axes, section: ThreeLevels) -> None:
    """Draw the pressed section coloured by what they follow, the sphere, and the three afferents' places."""
    values = section.pressed_kpa.ravel()
    largest = float(np.max(values[values > 0.0], initial=0.0)) or 1.0
    places, shown = corners(np.stack([section.x_mm, section.y_mm], axis=-1)), np.ma.masked_invalid(values)
    faces = paint_skin(axes, places, shown, largest, edgecolors="#00000030", linewidths=0.2)
    radius = MM_PER_M / section.curvature_per_m
    axes.add_patch(Circle(section.centre_mm, radius, facecolor="#c9d1d8", edgecolor=BLACK, linewidth=1.0))
    x, y = section.centre_mm
    width, height = SHOWN_MM
    axes.set(
        title="(a) skin, end of the hold",
        xlim=(x - width, x + width),
        ylim=(y - 1.0, y + radius + height),
        aspect="equal",
        xlabel="x, distal [mm]",
        ylabel="y, dorsal [mm]",
    )
    axes.text(x, y + 0.4, f"sphere, {number(section.curvature_per_m)} 1/m", ha="center", fontsize=9.0)
    axes.grid(visible=False)
    label_skin(axes, faces, f"{section.pressed}\n[kPa]", 0.9)


def _draw_afferent(current: Axes, potential: Axes, train: Axes, section: ThreeLevels) -> None:
    """Draw current, potential and spikes of the afferent below the sphere."""
    level: Any = {"color": GREY, "linestyle": (0, (4, 2)), "linewidth": 1.2}
    current.plot(section.times_ms, NANOAMPERE_PER_MA * section.current_ma, color=BLUE)
    current.axhline(NANOAMPERE_PER_MA * section.rheobase_ma, label="rheobase", **level)
    current.set(title="(b) afferent below the sphere", ylabel="current\n[nA]")
    current.set_ylim(bottom=min(0.0, current.get_ylim()[0]))
    potential.plot(section.times_ms, section.potential_mv, color=BLUE, linewidth=1.2)
    potential.axhline(section.threshold_mv, label="threshold", **level)
    potential.set(ylabel="potential\n[mV]", ylim=(-0.04 * section.threshold_mv, 1.4 * section.threshold_mv))
    train.eventplot([section.spikes_ms[0]], colors=BLACK, linewidths=1.2, linelengths=0.8)
    train.set(xlabel="time [ms]", ylabel="spikes", yticks=[], xlim=(0.0, section.until_ms))
    for axes in (current, potential):
        axes.tick_params(labelbottom=False)
        axes.legend(loc="upper right", borderaxespad=0.0)
    for axes in (current, potential, train):
        axes.axvspan(0.0, section.ramp_ms, color=PALE, zorder=0)
        axes.grid(visible=False)


def _draw_population(axes: Axes, section: ThreeLevels) -> None:
    """Draw the spikes of three afferents, with the rates of the ramp and of the hold beside them."""
    rows = list(range(section.offset_mm.size))[::-1]
    axes.eventplot(list(section.spikes_ms), lineoffsets=rows, linelengths=0.7, linewidths=0.9, colors=BLACK)
    rates = zip(section.offset_mm, section.dynamic_rate_hz, section.static_rate_hz, strict=True)
    labels = [f"{number(offset)} mm\n{fixed(ramp, 0)} and {fixed(hold, 0)}/s" for offset, ramp, hold in rates]
    axes.set(title="(c) three afferents", xlabel="time [ms]", ylabel="distance,\nrates")
    axes.set_yticks(rows, labels=labels, fontsize=8.0)
    axes.set(xlim=(0.0, section.end_ms), ylim=(-0.6, len(rows) - 0.4))
    axes.axvspan(0.0, section.ramp_ms, color=PALE, zorder=0)
    axes.grid(visible=False)


def caption_levels(section: ThreeLevels) -> str:
    places = joined([f"{number(offset)} mm" for offset in section.offset_mm])
    return (
        f"One sphere of {number(section.curvature_per_m)} 1/m on the three levels of the model, pressed "
        f"{protocol.DEPTH.value} mm deep in {number(section.ramp_ms)} ms and held. All of it is predicted. "
        "(a) Plane of symmetry of the pressed skin, coloured on a logarithmic scale by what the afferents "
        "follow. (b) Current through the membrane of the afferent below the sphere, its potential and "
        f"its spikes up to {number(section.until_ms)} ms; the rheobase is the smallest constant current that "
        f"elicits spikes. (c) Spikes of three afferents, {places} distal from the axis of the sphere, with "
        "their rates in the ramp and in the hold. Shaded: the sphere moves."
    )
