"""The picture that opens the README: skin, spikes and percept under one sphere."""

from __future__ import annotations

from matplotlib.axes import Axes
from matplotlib.figure import Figure

from fingerpad.core.regions import Ellipse, poisson_disc
from fingerpad.core.signals import ResponseMap
from fingerpad.data import psychophysics
from fingerpad.geometry.bodies import Sphere
from fingerpad.geometry.fingertip import Fingertip
from fingerpad.neuron.population import Population
from fingerpad.report import skin as touch_figure
from fingerpad.report.style import BLACK, BLUE, GREY, new_figure
from fingerpad.report.tables import number
from fingerpad.skin.indentation import CONTACT_POINT_MM, indent
from fingerpad.skin.sampling import SkinResponse
from studies.results_page import Percept

PAD_MM = 4.0
"""Radius of the disc of skin whose afferents are drawn. [mm]"""

SEED = 1
"""Seed of their places."""


def touched(curvature_per_m: float, resolution: str) -> tuple[SkinResponse, ResponseMap]:
    """Press a sphere, and let a population at random places respond."""
    skin = indent(Fingertip(), Sphere(curvature_per_m=curvature_per_m), resolution=resolution)
    disc = Ellipse(PAD_MM, PAD_MM, centre_mm=CONTACT_POINT_MM)
    layout = poisson_disc(disc, psychophysics.RECEPTOR_DENSITY.value, seed=SEED)
    return skin, Population.of_layout(layout).respond(skin)


def draw(skin: SkinResponse, response: ResponseMap, percept: Percept) -> Figure:
    """Draw the finger under the standard sphere, the spikes of a population and hit rates side by side."""
    figure = new_figure(10.6, 3.2)
    grid = figure.add_gridspec(2, 3, width_ratios=(2.0, 1.0, 1.0), height_ratios=(1.0, 4.5))
    section, curve = figure.add_subplot(grid[:, 0]), figure.add_subplot(grid[:, 2])
    motion = figure.add_subplot(grid[0, 1])
    spikes = figure.add_subplot(grid[1, 1], sharex=motion)
    touch_figure.draw_section(section, skin, Sphere(curvature_per_m=percept.standard_per_m))
    touch_figure.draw_depth(motion, skin)
    motion.set(xlabel="", ylabel="depth\n[mm]")
    motion.tick_params(labelbottom=False)
    touch_figure.draw_spikes(spikes, skin, response)
    draw_hit_rates(curve, percept)
    for axes, title in ((section, "Pressed skin"), (motion, "Spikes of afferents"), (curve, "Hit rates")):
        axes.set_title(title, fontweight="bold")
    for text, place in (("bone", (11.0, -2.0)), ("nail", (22.0, 4.9)), ("sphere", (17.4, -11.3))):
        section.text(*place, text, ha="center", va="center", fontsize=9.0)
    return figure


def draw_hit_rates(axes: Axes, percept: Percept) -> None:
    """Draw the hit rates of the first code and of people."""
    axes.plot(
        percept.curvature_per_m,
        percept.codes[0].hit_rate,
        "-o",
        color=BLUE,
        markersize=5.0,
        label="model, static rates",
    )
    axes.errorbar(
        percept.people_curvature_per_m,
        percept.people,
        yerr=[percept.people - percept.people_low, percept.people_high - percept.people],
        fmt="s",
        color=BLACK,
        markerfacecolor="white",
        markersize=7.0,
        capsize=3.0,
        linewidth=1.2,
        zorder=3,
        label="people, 95 % interval",
    )
    axes.axhline(0.5, color=GREY, linewidth=1.2, linestyle=":")
    axes.text(percept.curvature_per_m[-1], 0.495, "chance", color=GREY, ha="right", va="top", fontsize=9.0)
    axes.set(
        xlabel="curvature [1/m]",
        ylabel=f"hit rate (standard: {number(percept.standard_per_m)} /m)",
        ylim=(0.25, 1.02),
    )
    axes.legend(loc="lower right", borderaxespad=0.0)
