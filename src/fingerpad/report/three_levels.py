"""Figure 2: one sphere on all levels: pressed skin, one afferent below it, and three afferents."""

from __future__ import annotations

from typing import Any

import numpy as np
from matplotlib.axes import Axes
from matplotlib.collections import PolyCollection
from matplotlib.colors import LogNorm
from matplotlib.figure import Figure
from matplotlib.patches import Circle

from fingerpad.core.units import MM_PER_M
from fingerpad.data import protocol
from fingerpad.experiments.gerling2014.three_levels import ThreeLevels
from fingerpad.report.formatting import fixed, joined, number
from fingerpad.report.mesh_picture import faces_of
from fingerpad.report.style import BLACK, BLUE, GREY, ORANGE, PALE, new_figure
from fingerpad.report.touch import DECADES, SKIN

NANOAMPERE_PER_MA = 1e6
SHOWN_MM = (7.0, 4.5)
"""Half the width of the pressed skin that is shown, and its height above the contact. [mm]"""

QUANTITIES = {
    "stored": "strain energy density\n[kPa]",
    "compressive_stress": "compressive stress\n[kPa]",
    "compressive_strain": "compressive strain",
}
MARKERS = ("o", "s", "^")


def draw_levels(section: ThreeLevels) -> Figure:
    """Draw Figure 2: skin on the left, one afferent in the middle, three afferents on the right."""
    figure = new_figure(13.0, 5.4)
    grid = figure.add_gridspec(6, 3, width_ratios=(1.25, 1.0, 1.0))
    skin, drive = figure.add_subplot(grid[:4, 0]), figure.add_subplot(grid[4:, 0])
    _draw_skin(skin, section)
    _draw_drive(drive, section)
    current = figure.add_subplot(grid[:2, 1])
    potential = figure.add_subplot(grid[2:4, 1], sharex=current)
    train = figure.add_subplot(grid[4:, 1], sharex=current)
    _draw_afferent(current, potential, train, section)
    spikes, rates = figure.add_subplot(grid[:3, 2]), figure.add_subplot(grid[3:, 2])
    _draw_population(spikes, section)
    _draw_rates(rates, section)
    return figure


def _draw_skin(axes: Axes, section: ThreeLevels) -> None:
    """Draw the pressed section coloured by energy, the sphere, and the three afferents' places."""
    sed = section.sed_kpa.ravel()
    largest = float(np.max(sed[sed > 0.0], initial=0.0)) or 1.0
    faces = PolyCollection(
        list(faces_of(section.x_mm, section.y_mm)),
        array=np.ma.masked_invalid(sed),
        cmap=SKIN,
        norm=LogNorm(largest / 10.0**DECADES, largest, clip=True),
        edgecolors="#00000030",
        linewidths=0.2,
    )
    axes.add_collection(faces)
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
    bar = axes.figure.colorbar(faces, ax=axes, shrink=0.9, aspect=18, pad=0.02, extend="min")
    bar.set_label("strain energy density [kPa]")
    bar.ax.yaxis.set_major_formatter("{x:g}")


def _draw_drive(axes: Axes, section: ThreeLevels) -> None:
    for values, colour, style, label in (
        (section.drive_at_ramp_end, ORANGE, "--", "end of the ramp"),
        (section.drive_at_hold_end, BLUE, "-", "end of the hold"),
    ):
        axes.plot(section.distance_mm, values, style, color=colour, label=label)
    for place, marker in zip(section.offset_mm, MARKERS, strict=True):
        value = np.interp(place, section.distance_mm, section.drive_at_hold_end)
        axes.plot(place, value, marker, color="white", markeredgecolor=BLACK, markersize=7.0, zorder=5)
    axes.set(
        xlabel="distance from the axis of the sphere, distal [mm]",
        ylabel=QUANTITIES.get(section.quantity, section.quantity.replace("_", " ")),
    )
    axes.margins(x=0.0)
    axes.set_ylim(0.0, 1.35 * axes.get_ylim()[1])
    axes.legend(loc="upper center", ncols=2)


def _draw_afferent(current: Axes, potential: Axes, train: Axes, section: ThreeLevels) -> None:
    """Draw current, potential and spikes of the afferent below the sphere."""
    level: Any = {"color": GREY, "linestyle": (0, (4, 2)), "linewidth": 1.2}
    current.plot(section.times_ms, NANOAMPERE_PER_MA * section.current_ma, color=BLUE)
    current.axhline(NANOAMPERE_PER_MA * section.rheobase_ma, label="rheobase", **level)
    current.set(title="(b) afferent below the sphere", ylabel="current [nA]")
    current.set_ylim(bottom=min(0.0, current.get_ylim()[0]))
    potential.plot(section.times_ms, section.potential_mv, color=BLUE, linewidth=1.2)
    potential.axhline(section.threshold_mv, label="threshold", **level)
    potential.set(ylabel="potential [mV]", ylim=(-0.04 * section.threshold_mv, 1.4 * section.threshold_mv))
    train.eventplot([section.spikes_ms[0]], colors=BLACK, linewidths=1.2, linelengths=0.8)
    train.set(xlabel="time [ms]", ylabel="spikes", yticks=[], xlim=(0.0, section.until_ms))
    for axes in (current, potential):
        axes.legend(loc="upper right", borderaxespad=0.0)
    for axes in (current, potential, train):
        axes.axvspan(0.0, section.ramp_ms, color=PALE, zorder=0)
        axes.grid(visible=False)
    for axes in (current, potential):
        axes.tick_params(labelbottom=False)


def _draw_population(axes: Axes, section: ThreeLevels) -> None:
    rows = list(range(section.offset_mm.size))[::-1]
    axes.eventplot(list(section.spikes_ms), lineoffsets=rows, linelengths=0.7, linewidths=0.9, colors=BLACK)
    labels = [f"{number(offset)} mm" for offset in section.offset_mm]
    axes.set(title="(c) three afferents", xlabel="time [ms]", ylabel="distance from the axis")
    axes.set_yticks(rows, labels=labels)
    axes.set(xlim=(0.0, section.end_ms), ylim=(-0.6, len(rows) - 0.4))
    axes.axvspan(0.0, section.ramp_ms, color=PALE, zorder=0)
    axes.grid(visible=False)


def _draw_rates(axes: Axes, section: ThreeLevels) -> None:
    for rates, colour, shift, hatch, label in (
        (section.dynamic_rate_hz, ORANGE, -0.2, "//", "dynamic ramp"),
        (section.static_rate_hz, BLUE, 0.2, "", "static hold"),
    ):
        places = np.arange(rates.size) + shift
        axes.bar(places, rates, 0.38, color=colour, hatch=hatch, edgecolor="white", label=label)
        for place, rate in zip(places, rates, strict=True):
            axes.text(place, rate, fixed(rate, 0), ha="center", va="bottom", fontsize=9.0)
    axes.set_xticks(
        range(section.offset_mm.size), labels=[f"{number(offset)} mm" for offset in section.offset_mm]
    )
    axes.set(xlabel="distance from the axis", ylabel="firing rate [spikes/s]")
    axes.margins(y=0.15)
    axes.grid(visible=False, axis="x")
    axes.legend(loc="upper right")


def caption_levels(section: ThreeLevels) -> str:
    """Describe Figure 2."""
    drive = QUANTITIES.get(section.quantity, section.quantity.replace("_", " ")).partition("\n")[0]
    places = joined([f"{number(offset)} mm" for offset in section.offset_mm])
    start, end = protocol.DYNAMIC_WINDOW.value
    hold = protocol.STATIC_WINDOW.value
    return (
        f"One sphere of {number(section.curvature_per_m)} 1/m on the three levels of the model, pressed "
        f"{protocol.DEPTH.value} mm deep in {number(section.ramp_ms)} ms and held; all of it is predicted, "
        "with the fitted afferent of this run. (a) Plane of symmetry of the pressed skin, coloured by stored "
        "strain energy density on a logarithmic scale, and below it the quantity that drives the afferents, "
        f"{drive}, in the living epidermis along the midline; markers: the afferents of (c). (b) Current "
        "through the membrane of the afferent below the sphere, membrane potential and spikes up to "
        f"{number(section.until_ms)} ms; the rheobase is the smallest constant current that elicits "
        f"spikes. (c) Spikes of three afferents, {places} from the axis of the sphere along the finger, and "
        f"their rates from {number(start)} to {number(end)} ms (ramp) and from {number(hold[0])} to "
        f"{number(hold[1])} ms (hold). Shaded: the sphere moves."
    )
