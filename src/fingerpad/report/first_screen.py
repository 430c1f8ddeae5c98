"""The first screen of a reproduction: one picture and one sentence per level."""

from __future__ import annotations

from functools import partial

from matplotlib.figure import Figure

from fingerpad.data import paper
from fingerpad.experiments.gerling2014.reproduction import ReproductionResult
from fingerpad.experiments.gerling2014.single_unit import SingleUnitResult
from fingerpad.experiments.gerling2014.skin_deflection import SkinDeflectionResult
from fingerpad.experiments.gerling2014.sphere_discrimination import SphereDiscrimination
from fingerpad.report.discrimination import draw_hit_rates
from fingerpad.report.formatting import fixed, joined, number, whole_percent
from fingerpad.report.parts import Drawing
from fingerpad.report.single_unit import FITTED
from fingerpad.report.skin_deflection import CYLINDER, draw_profiles
from fingerpad.report.style import draw_rates, new_figure

SIZE_IN = (4.6, 3.9)

IN_THE_PAPER = "Trial 3"
"""The trial that is closest to the observed deflection in the paper."""


def first_screen(result: ReproductionResult) -> list[Drawing]:
    """Return a picture of each level, with its result as the caption."""
    skin, afferent, percept = result.skin_deflection, result.paper.single_unit, result.paper.discrimination
    return [
        Drawing("level_1_skin", "Skin", partial(_draw_skin, skin), _skin(skin)),
        Drawing("level_2_afferent", "Afferent", partial(_draw_afferent, afferent), _afferent(afferent)),
        Drawing("level_3_percept", "Percept", partial(_draw_percept, percept), _percept(percept)),
    ]


def _draw_skin(section: SkinDeflectionResult) -> Figure:
    """Draw the deflection under the cylinder, downwards."""
    figure = new_figure(*SIZE_IN)
    axes = figure.subplots()
    draw_profiles(axes, section, CYLINDER)
    axes.set(title="Level 1: skin", xlabel="distance along the finger [mm]", ylabel="deflection [mm]")
    axes.margins(x=0.01)
    handles, labels = axes.get_legend_handles_labels()
    short = [label.replace(", artefact (left out)", ", left out") for label in labels]
    axes.legend(handles, short, loc="lower left", fontsize=8.0)
    axes.invert_yaxis()
    return figure


def _draw_afferent(section: SingleUnitResult) -> Figure:
    """Draw the rates of the ramp over the position of the bar."""
    figure = new_figure(*SIZE_IN)
    axes = figure.subplots()
    draw_rates(axes, section.shift_mm, section.dynamic_rate_hz, section.observed_dynamic_rate_hz, FITTED)
    axes.set(title="Level 2: afferent", xlabel="place of the bar [mm]", ylabel="rate in the ramp [spikes/s]")
    axes.legend(loc="upper left", fontsize=8.0)
    axes.set_ylim(top=1.25 * axes.get_ylim()[1])
    return figure


def _draw_percept(section: SphereDiscrimination) -> Figure:
    """Draw the hit rates of the static Gradient Sum."""
    figure = new_figure(*SIZE_IN)
    axes = figure.subplots()
    draw_hit_rates(axes, section, section.gradient_sum["static"])
    axes.set(title="Level 3: percept", xlabel="curvature of the sphere [1/m]", ylabel="hit rate")
    axes.legend(loc="lower right", fontsize=8.0, frameon=True, edgecolor="none", framealpha=1.0)
    return figure


def _skin(section: SkinDeflectionResult) -> str:
    trials = (section.trial1, section.trial2, section.trial3)
    fits = {f"Trial {number}": trial.cylinder.r2 for number, trial in enumerate(trials, start=1)}
    best = max(fits, key=lambda name: fits[name])
    listed = joined([f"{name} {fixed(fit, 2)}" for name, fit in fits.items()])
    return (
        f"Of the material trials, {best} is closest to the observed deflection under the cylinder "
        f"(R²: {listed})"
        + (", as in the paper." if best == IN_THE_PAPER else f"; in the paper {IN_THE_PAPER} is closest.")
    )


def _afferent(section: SingleUnitResult) -> str:
    return (
        "The fitted afferent reaches a fractional sum of squares (FSS) of "
        f"{fixed(section.fss_out_of_sample, 2)} out of sample, on positions of the bar that were not used "
        f"for fitting (the paper: {fixed(paper.FSS_OUT_OF_SAMPLE.value, 2)}), and "
        f"{fixed(section.fss_in_sample, 2)} on all positions."
    )


def _percept(section: SphereDiscrimination) -> str:
    people, comparison = section.goodwin, section.curvature_per_m[1:].tolist()
    rates = section.gradient_sum["static"].hit_rate
    discriminated = [
        f"{number(curvature)} 1/m in {whole_percent(rates[comparison.index(curvature)])} of trials "
        f"(observed: {whole_percent(observed)})"
        for curvature, observed in zip(people.curvature_per_m.tolist(), people.hit_rate, strict=True)
    ]
    return (
        f"With noise of {number(section.noise_sigma)}, the static Gradient Sum discriminates "
        f"spheres of {joined(discriminated)} from the standard of "
        f"{number(float(section.curvature_per_m[0]))} 1/m; the paper's noise is "
        f"{number(section.noise_sigma_paper)}."
    )
