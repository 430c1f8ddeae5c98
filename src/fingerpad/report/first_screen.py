"""The pictures of the first screen of a reproduction: one per level, with one sentence each."""

from __future__ import annotations

from functools import partial

import numpy as np
from matplotlib.figure import Figure

from fingerpad.data import paper, psychophysics
from fingerpad.experiments.gerling2014.reproduction import ReproductionResult
from fingerpad.experiments.gerling2014.skin_deflection import SkinDeflectionResult
from fingerpad.report.discrimination import draw_people
from fingerpad.report.formatting import fixed, joined, number
from fingerpad.report.parts import COLUMNS, Drawing
from fingerpad.report.single_unit import ALONG
from fingerpad.report.skin_deflection import CYLINDER, draw_profiles
from fingerpad.report.style import BLUE, ORANGE, draw_observed_rates, new_figure

SIZE_IN = (4.6, 3.0)
LINES = ((BLUE, "-"), (ORANGE, "--"))
"""Colour and dashes of the two sets."""

IN_THE_PAPER = "Trial 3"
"""The trial that is closest to the observed deflection in the paper."""


def first_screen(result: ReproductionResult) -> list[Drawing]:
    """Return a picture of each level, both sets in it, with its result as the caption."""
    fits = [f"`{name}` {fixed(getattr(result, name).single_unit.fss_out_of_sample, 2)}" for name in COLUMNS]
    noises = [f"`{name}` {number(getattr(result, name).discrimination.noise_sigma)}" for name in COLUMNS]
    afferent = (
        f"Afferent: FSS out of sample {joined(fits)}; the paper {fixed(paper.FSS_OUT_OF_SAMPLE.value, 2)}."
    )
    percept = (
        f"Percept: noise that fits people's hit rates {joined(noises)}; the paper "
        f"{number(psychophysics.NOISE_SIGMA.value)}."
    )
    return [
        Drawing("level_1_skin", "Skin", partial(_draw_skin, result), _skin(result.skin_deflection)),
        Drawing("level_2_afferent", "Afferent", partial(_draw_afferent, result), afferent),
        Drawing("level_3_percept", "Percept", partial(_draw_percept, result), percept),
    ]


def _draw_skin(result: ReproductionResult) -> Figure:
    """Draw the deflection under the cylinder, downwards."""
    figure = new_figure(*SIZE_IN)
    axes = figure.subplots()
    draw_profiles(axes, result.skin_deflection, CYLINDER)
    axes.set(title="Level 1: skin", xlabel="distance from the axis, distal [mm]", ylabel="deflection [mm]")
    handles, labels = axes.get_legend_handles_labels()
    axes.legend(handles[:4], [label.replace(", R²", "\nR²") for label in labels[:4]], fontsize=7.0)
    axes.invert_yaxis()
    return figure


def _draw_afferent(result: ReproductionResult) -> Figure:
    """Draw the rates of the ramp over the place of the bar."""
    figure = new_figure(*SIZE_IN)
    axes = figure.subplots()
    for name, (colour, dashes) in zip(COLUMNS, LINES, strict=True):
        unit = getattr(result, name).single_unit
        axes.plot(-unit.shift_mm, unit.dynamic_rate_hz, color=colour, linestyle=dashes, label=name)
    draw_observed_rates(axes, -unit.shift_mm, unit.observed_dynamic_rate_hz)
    axes.set(title="Level 2: afferent", xlabel=ALONG, ylabel="rate in the ramp [spikes/s]")
    axes.set_ylim(0.0, 1.25 * axes.get_ylim()[1])
    axes.legend(loc="upper center", ncols=3, fontsize=8.0)
    return figure


def _draw_percept(result: ReproductionResult) -> Figure:
    """Draw the hit rates of the static Gradient Sum over the middle of the receptors."""
    figure = new_figure(*SIZE_IN)
    axes = figure.subplots()
    for name, (colour, dashes) in zip(COLUMNS, LINES, strict=True):
        section = getattr(result, name).discrimination
        rates = section.gradient_sum["static"].hit_rate
        axes.plot(section.curvature_per_m[1:], rates, color=colour, linestyle=dashes, marker="o", label=name)
    draw_people(axes, section.goodwin)
    axes.set(title="Level 3: percept", xlabel="curvature of the sphere [1/m]", ylabel="hit rate [fraction]")
    axes.set_ylim(top=1.02)
    axes.legend(loc="lower right", fontsize=8.0)
    return figure


def _skin(section: SkinDeflectionResult) -> str:
    fits = [trial.cylinder.r2 for trial in (section.trial1, section.trial2, section.trial3)]
    best = f"Trial {1 + int(np.argmax(fits))}"
    said = ", as in the paper." if best == IN_THE_PAPER else f"; in the paper {IN_THE_PAPER} is."
    return f"Skin: {best} is closest to the observed deflection{said}"
