"""Level 3, beyond the paper: curvature thresholds from standard to standard."""

from __future__ import annotations

from itertools import cycle
from typing import Any

import numpy as np
from matplotlib.axes import Axes
from matplotlib.figure import Figure

from fingerpad.experiments.gerling2014.curvature_thresholds import CurvatureThresholds, PopulationThresholds
from fingerpad.report.formatting import UNBROKEN, fixed, number
from fingerpad.report.parts import Row, Table
from fingerpad.report.style import (
    BLACK,
    BLUE,
    COLUMN_IN,
    GREEN,
    GREY,
    ORANGE,
    PALE,
    PEOPLE,
    new_figure,
    say_nothing_to_draw,
)

PER_CENT = 100.0
CHANCE = 50.0
_TOP = 45.0  # End of the axis of Weber fractions; an interval without an upper bound extends beyond it. [%]

STYLES: tuple[Any, ...] = (
    {"color": BLACK, "linestyle": "-", "marker": "o"},
    {"color": BLUE, "linestyle": "--", "marker": "s"},
    {"color": ORANGE, "linestyle": "-.", "marker": "^"},
    {"color": GREEN, "linestyle": ":", "marker": "v"},
)


def draw_thresholds(section: CurvatureThresholds) -> Figure:
    figure = new_figure(COLUMN_IN, 8.0)
    fractions, curves = figure.subplots(2, 1)
    _fractions(fractions, section)
    _curves(curves, section)
    return figure


def _fractions(axes: Axes, section: CurvatureThresholds) -> None:
    people, paper = section.literature, section.populations[0]
    low, high = PER_CENT * people.weber_fractions
    axes.axhspan(low, high, color=PALE, label=f"observed, as reported: {number(low, 2)}-{number(high, 2)} %")
    for population, style in zip(section.populations, STYLES[1:], strict=False):
        axes.plot(
            [entry.standard_per_m for entry in population.standards],
            [PER_CENT * entry.weber_fraction for entry in population.standards],
            label=f"Gradient Sum, {_layout(population)} receptors",
            markersize=4.0,
            **style,
        )
    at = [entry.standard_per_m for entry in paper.standards]
    fitted = PER_CENT * np.array([entry.fitted_weber_fraction for entry in paper.standards])
    interval = PER_CENT * np.array([entry.fitted_interval for entry in paper.standards]).reshape(-1, 2).T
    axes.errorbar(at, fitted, yerr=np.abs(interval - fitted), color=BLUE, linestyle="none", capsize=3.0)
    best = [PER_CENT * entry.ideal_weber_fraction for entry in paper.standards]
    label = f"ideal observer, {_layout(paper)} receptors"
    axes.plot(at, best, color=GREY, linestyle=(0, (5, 2)), marker=".", label=label)
    observed = PER_CENT * (people.comparison_per_m / people.standard_per_m - 1.0)
    axes.plot(people.standard_per_m, observed, "D", label="observed (Goodwin et al. 1991)", **PEOPLE)
    axes.set(title="(a) difference threshold", ylim=(0.0, _TOP))
    axes.set(xlabel="curvature of the standard [1/m]", ylabel="Weber fraction at 75 % [%]")
    axes.legend(loc="upper right", fontsize=8.0)


def _curves(axes: Axes, section: CurvatureThresholds) -> None:
    standards = section.populations[0].standards
    if not standards:
        say_nothing_to_draw(axes, "no standard has a threshold")
        return
    axes.axhline(CHANCE, color=GREY, linewidth=1.0, linestyle=(0, (6, 3)))
    axes.axhline(PER_CENT * section.proportion, color=GREY, linewidth=0.8)
    for entry, style in zip(standards, cycle(STYLES), strict=False):
        curve, line = entry.curve, style | {"marker": ""}
        axes.plot(PER_CENT * curve.step, PER_CENT * curve.hit_rate, **line)
        axes.plot(PER_CENT * entry.step, PER_CENT * entry.hit_rate, linewidth=0.0, markersize=5.0, **style)
        # The legend shows line and marker together.
        axes.plot([], [], label=f"{number(entry.standard_per_m)} 1/m", markersize=5.0, **style)
    axes.set(title="(b) hit rates of the Gradient Sum and Weibull functions", ylim=(45.0, 102.0))
    axes.set(xlabel="comparison above the standard [%]", ylabel="hit rate [% of trials]")
    axes.legend(title="standard", loc="upper left")


def caption_thresholds(section: CurvatureThresholds) -> str:
    return (
        "(a) Difference in curvature that is discriminated from a standard in 75 % of trials, as a share of "
        "the standard: Gradient Sum of static rates of two populations, each with the noise fitted to the "
        "observed hit rates at 287 1/m; ideal observer of the same rates (dashed); participants (diamonds; "
        "recalled, not read in the original). Bars: 95 % interval of an experiment with "
        f"{number(section.judgements)} judgements of each comparison. (b) Hit rates of that experiment and "
        "fitted psychometric functions, first population. Rates are interpolated between "
        f"{len(section.pressed_per_m)} spheres."
    )


def threshold_tables(section: CurvatureThresholds) -> list[Table]:
    thresholds = [
        Row.of(
            _layout(population),
            fixed(population.noise_sigma, 3),
            number(entry.standard_per_m),
            fixed(entry.jnd_per_m, 1),
            _per_cent(entry.weber_fraction),
            f"{_per_cent(entry.fitted_weber_fraction)} "
            f"({_per_cent(entry.fitted_interval[0])} to {_per_cent(entry.fitted_interval[1])})",
            _per_cent(entry.ideal_weber_fraction),
        )
        for population in section.populations
        for entry in population.standards
    ]
    missed = [entry.why_not for population in section.populations for entry in population.without_threshold]
    columns = (
        "receptors", "noise", "standard [1/m]", "JND [1/m]", "Weber fraction", "of an experiment, 95 %",
        "ideal observer",
    )  # fmt: skip
    return [Table("Curvature thresholds", columns, thresholds, " ".join(missed))]


def _layout(population: PopulationThresholds) -> str:
    return f"{number(population.rows)} by {number(population.columns)}"


def _per_cent(share: float | None) -> str:
    return fixed(None if share is None else PER_CENT * share, 1) + f"{UNBROKEN}%"
