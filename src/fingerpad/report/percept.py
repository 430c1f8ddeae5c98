"""Figures of percepts: hit rates of spheres, the steps to them, and thresholds of curvature."""

from __future__ import annotations

from collections.abc import Mapping
from itertools import cycle, pairwise
from typing import Any

import numpy as np
from matplotlib.axes import Axes
from matplotlib.figure import Figure
from matplotlib.text import Text

from fingerpad.core.values import FloatArray
from fingerpad.data import psychophysics
from fingerpad.experiments.gerling2014.percept import GoodwinHitRates, ObserverHitRates, SphereDiscrimination
from fingerpad.experiments.gerling2014.reproduction import ReproductionResult
from fingerpad.experiments.gerling2014.thresholds import CurvatureThresholds, PopulationThresholds
from fingerpad.report.page import SETS, both, figure
from fingerpad.report.style import (
    BLACK,
    BLUE,
    CHANCE,
    COLUMN_IN,
    GREEN,
    GREY,
    ORANGE,
    PALE,
    PEOPLE,
    draw_chance,
    new_figure,
    say_nothing_to_draw,
    shared_legend,
)
from fingerpad.report.tables import UNBROKEN, Column, Table, fixed, number, table, with_error

SPHERES: tuple[tuple[Any, str], ...] = (
    ({"color": BLUE, "linestyle": "-", "marker": "o"}, "sphere at 0.0 mm"),
    ({"color": ORANGE, "linestyle": ":", "marker": "s"}, "sphere at 0.2 mm"),
)
CODES = {
    "static": ("Gradient Sum, static", {"color": BLUE, "linestyle": "-"}),
    "dynamic": ("Gradient Sum, dynamic", {"color": ORANGE, "linestyle": "--"}),
    "latency": ("Gradient Sum, latency", {"color": GREEN, "linestyle": "-."}),
    "euclidean": ("Euclidean, static", {"color": BLACK, "linestyle": ":"}),
}
"""Name of each code and how its line is drawn."""

Panel = tuple[str, ObserverHitRates | None]


def observer_panels(section: SphereDiscrimination) -> list[Panel]:
    """Titles and hit rates of Figure 7 in the paper's order."""
    variants, static, best = section.variants, CODES["static"][0], f"σ₁ = {number(section.noise_sigma)}"
    rates = {**section.gradient_sum, "euclidean": section.euclidean["static"]}

    def at(sigma: float) -> Panel:
        return f"{static}\nσ₁ = {sigma:g}", variants[f"sigma_{sigma:g}"]

    return [
        *((f"{label}\n{best}", rates.get(name)) for name, (label, _) in CODES.items()),
        *map(at, psychophysics.NOISE_SIGMA_SHOWN.value),
        (f"{static}\n{best}, 10 matrices", variants["ten_matrices"]),
        at(section.noise_sigma_paper),
    ]


def criterion_panels(section: SphereDiscrimination) -> list[Panel]:
    names = sorted(name for name in section.variants if name.startswith("criterion_"))
    return [(f"β varies by {name.removeprefix('criterion_')}", section.variants[name]) for name in names]


def discrimination_tables(section: SphereDiscrimination) -> list[Table]:
    """Return the hit rates of Figures 7 and 8, and the alternative interpretations of the paper's steps."""
    rates = [
        (title.replace("\n", ", "), place, tuple(map(with_error, means, spreads)))
        for title, each in (*observer_panels(section), *criterion_panels(section))
        if each is not None
        for place, means, spreads in (
            ("0.0", each.hit_rate, each.hit_rate_sd),
            ("0.2", each.hit_rate_shifted, each.hit_rate_shifted_sd),
        )
    ]
    columns = [Column("0", "observer"), Column("1", "sphere at [mm]")] + [
        Column(f"2.{place}", f"{number(curvature)} 1/m")
        for place, curvature in enumerate(section.curvature_per_m[1:])
    ]
    interpretations = (
        Column("reading", "interpretation"),
        Column("receptors", form=lambda counts: " / ".join(map(number, counts))),
        Column(
            "rise",
            "increase of the sum, 287 to 365 1/m",
            lambda rise: " / ".join(fixed(each, 3) for each in rise),
        ),
        Column("largest_shift", "largest change by the shift", 3),
        Column("noise_sigma", "separately fitted noise", 3),
        Column("misfit", "rms distance to observed with it", 3),
        Column("own_largest_shift", "largest change by the shift with it", 3),
    )
    bars = section.reasons.criterion
    multiplied = {
        "the decision point (used)": bars["point"],
        "the fraction beta of the distance between the means": bars["fraction"],
        "a likelihood ratio of mean 1 between comparison and standard": bars["likelihood"],
    }
    spreads = [
        Column(f"1.{place}", f"σ = {number(sigma)}", 4) for place, sigma in enumerate(bars["criterion_sigma"])
    ]
    return [
        table("Hit rates, mean ± standard deviation", rates, columns),
        table(
            "Interpretations of steps that the paper leaves open",
            section.reasons.readings,
            interpretations,
            "Two numbers are for the spheres at 0.0 and at 0.2 mm. The noise is fitted to both positions "
            "together; hit rates are expected values, without sampling error.",
            lambda row: "final" if "(used)" in row.reading else "",
        ),
        table(
            "Error bars by what the varied criterion multiplies",
            multiplied.items(),
            (Column("0", "Normal(1, σ) multiplies"), *spreads),
            "Mean standard deviation of a hit rate over the six spheres at 0.0 mm, static Gradient Sum.",
            lambda row: "final" if "(used)" in row[0] else "",
        ),
    ]


CAPTION_OBSERVERS = (
    "Fraction of trials in which a sphere is discriminated from the standard of "
    "{curvature_per_m.0} 1/m; bars are one standard deviation over hit rates, within "
    "0 and 1. Blue, solid: predicted for a sphere over the middle of the receptors; orange, dotted: for "
    "one 0.2 mm away. Diamonds: observed in people (Goodwin et al. 1991), with binomial 95 % intervals "
    "of {goodwin.trials} trials, an assumed number. (a-c) Gradient Sum of static rates, "
    "dynamic rates and first-spike latencies, (d) Euclidean Distance of static rates, all with the "
    "noise that was fitted to the diamonds with the code of (a). (e, f) The paper's noise on either "
    "side of its best; (g) 10 noise matrices in place of 100; (h) the paper's best noise. In the "
    "paper the static Gradient Sum fits best and hardly depends on the shift, dynamic rates and "
    "latencies depend on it, more noise lowers the curve, and fewer matrices widen the bars."
)


CAPTION_CRITERION = (
    "Gradient Sum of static rates with a varied criterion: for each hit rate the decision point is "
    "multiplied by a new normal variable with mean 1 and the standard deviation in the title. Marks, "
    "bars and noise as in Figure 7 (a). In the paper the wider distribution increases the error bars and "
    "does not change the means."
)


@figure(
    "reproduction", "Level 3: discrimination", 7, "figure_7_discrimination", "Discrimination of spheres",
    CAPTION_OBSERVERS, of=both("discrimination"),
)  # fmt: skip
def draw_observers(section: SphereDiscrimination) -> Figure:
    return _draw_panels(section, observer_panels(section))


@figure(
    "reproduction", "Level 3: discrimination", 8, "figure_8_varied_criterion",
    "The same with a varied criterion", CAPTION_CRITERION, of=both("discrimination"),
    tables=discrimination_tables,
)  # fmt: skip
def draw_criterion(section: SphereDiscrimination) -> Figure:
    return _draw_panels(section, criterion_panels(section))


def _draw_panels(section: SphereDiscrimination, panels: list[Panel]) -> Figure:
    rows = max(1, -(-len(panels) // 2))
    drawn = new_figure(COLUMN_IN, 2.2 * rows + 0.9)
    grid = drawn.subplots(rows, 2, sharex=True, sharey=True, squeeze=False)
    for axes in grid.flat[len(panels) :]:
        axes.set_axis_off()
    for axes, letter, (title, rates) in zip(grid.flat, "abcdefghijklmnop", panels, strict=False):
        axes.set_title(f"({letter}) {title}", fontsize=10.0)
        if rates is None:
            say_nothing_to_draw(axes, "not computed")
        else:
            draw_hit_rates(axes, section, rates)
    for axes in grid.flat[: len(panels) : 2]:
        axes.set_ylabel("hit rate [fraction]")
    for axes in grid.flat[: len(panels)][-2:]:
        axes.set_xlabel("comparison curvature [1/m]")
        axes.tick_params(labelbottom=True)
    lowest, _ = grid[0, 0].get_ylim()
    grid[0, 0].set_ylim(max(min(lowest, 0.4), 0.0), 1.0)
    shared_legend(drawn, grid.flat, columns=2)
    return drawn


def draw_hit_rates(axes: Axes, section: SphereDiscrimination, rates: ObserverHitRates) -> None:
    """Draw the hit rates of one observer at both positions, those of people, and chance."""
    draw_chance(axes, "chance")
    pairs = (rates.hit_rate, rates.hit_rate_sd), (rates.hit_rate_shifted, rates.hit_rate_shifted_sd)
    lines: Any = {"markersize": 4.0, "linewidth": 1.5, "elinewidth": 1.0, "capsize": 3.0, "clip_on": False}
    for (means, spreads), (style, label) in zip(pairs, SPHERES, strict=True):
        bars = np.nan_to_num(np.minimum(spreads, [means, 1.0 - means]))  # a hit rate lies within 0 and 1
        label = f"predicted, {label}"
        axes.errorbar(section.curvature_per_m[1:], means, bars, label=label, **style, **lines)
    draw_people(axes, section.goodwin)


def draw_people(axes: Axes, observed: GoodwinHitRates) -> None:
    rate, label = observed.hit_rate, "observed (Goodwin et al. 1991)"
    bars: Any = {"yerr": [rate - observed.low, observed.high - rate], "elinewidth": 1.2, "capsize": 4.0}
    axes.errorbar(observed.curvature_per_m, rate, fmt="D", label=label, **bars, **PEOPLE)


CAPTION_NOISE = (
    "Root mean square distance of predicted hit rates from those of people (Goodwin et al. 1991) at 296 "
    "and 365 1/m, against the noise. (a) Each code has its own best noise. (b) The range of the paper, "
    "in {sessions} sessions of the whole protocol; bars are Monte-Carlo errors. The "
    "best noise compensates for the slope of a code: the steeper a sum rises with curvature, the more "
    "noise brings its hit rates down to those of people."
)


@figure(
    "reproduction", "Beyond the paper", 10, "figure_10_noise", "Amount of noise", CAPTION_NOISE,
    of=both("discrimination"),
)  # fmt: skip
def draw_noise(section: SphereDiscrimination) -> Figure:
    drawn = new_figure(COLUMN_IN, 4.4)
    codes, sweep = drawn.subplots(1, 2, sharey=True)
    curve, swept = section.reasons.misfit_curve, section.statistics.sweep
    for name, (label, style) in CODES.items():
        if name in curve.misfit:
            codes.plot(curve.noise_sigma, curve.misfit[name], label=label, **style)
    for misfit, (style, label) in zip(swept.misfit, SPHERES, strict=True):
        means, errors = ([getattr(one, name) for one in misfit] for name in ("value", "error"))
        bars: Any = {"yerr": np.nan_to_num(errors), "markersize": 5.0, "capsize": 3.0}
        sweep.errorbar(swept.noise_sigma, means, label=label, **bars, **style)
    marked = {"paper's best": section.noise_sigma_paper, "our fit": section.noise_sigma}
    for axes, title in ((codes, "(a) each code, expected"), (sweep, "(b) static Gradient Sum")):
        for (label, sigma), dashes in zip(marked.items(), ((6, 3), (1, 1)), strict=True):
            axes.axvline(sigma, color=GREY, linewidth=1.4, linestyle=(0, dashes), label=label)
        axes.set(title=title, xlabel="noise σ₁ [fraction]")
        axes.set_ylim(bottom=0.0)
    codes.set_ylabel("distance to observed hit rates, rms [fraction]")
    sweep.set_xlim(left=0.0)
    shared_legend(drawn, (codes, sweep), columns=2)
    return drawn


GRADIENT = (
    (3.3, "(b) gradient of\neach receptor: sum of\n|differences| from\nits neighbours"),
    (4.95, "(c) sum over the\n18 receptors:\none gradient sum"),
    (6.6, "(d, e) 100 sums for\neach of 7 spheres:\n700 sums; μ₂ and σ₂\nof each sphere"),
    (8.25, "(f) 100 times:\n100 pairs of μ₂, σ₂\nfor each sphere"),
    (9.9, "(g, h) signal detection\nof a random pair against\none of the standard,\nβ = 0.5: one hit rate"),
    (11.6, "(i, j) 100 hit rates for\neach of 6 spheres\n(k) μ₃ ± σ₃"),
)
EUCLIDEAN = (
    (3.3, "(b*) one set:\n18 noisy values"),
    (4.65, "(c*) 100 sets\nof one sphere"),
    (6.0, "(d*) 700 sets,\n100 for each\nof 7 spheres"),
    (7.7, "(e*) set of a sphere less\nset of the standard: sum\nof 18 |differences|"),
    (9.6, "(f*) 100 sums of one sphere\n(g*) 700 sums, 100 for\neach of 7 spheres"),
    (11.45, "(h*) hit or miss: side\nof the middle between\nthe two means;\n100 hit rates: μ₃ ± σ₃"),
)
"""Boxes of the two codes from left to right, with their places."""


CAPTION_STEPS = (
    "Steps from the responses of 18 receptors to hit rates, with the letters of the paper's section "
    "2.2.3; its figure is not in the copy that we worked from. The standard has "
    "{paper.discrimination.curvature_per_m.0} 1/m. Numbers are of this run: spheres at 0.0 mm, first session."
)


@figure("reproduction", "From rates to a percept", 3, "figure_3_steps", "Steps to a hit rate", CAPTION_STEPS)
def draw_steps(result: ReproductionResult) -> Figure:
    sets = {name: getattr(result, name).discrimination for name in SETS}
    drawn = new_figure(12.4, 4.4)
    drawn.set_layout_engine("none")
    axes = drawn.add_axes((0.0, 0.0, 1.0, 1.0))
    axes.set(xlim=(0.0, 12.4), ylim=(-0.45, 4.0))
    axes.set_axis_off()
    x, y = np.meshgrid(np.linspace(0.4, 1.3, 6), np.linspace(2.45, 2.85, 3))
    axes.scatter(x, y, s=45.0, facecolors=PALE, edgecolors=BLACK, linewidths=1.0)
    axes.text(0.85, 3.2, "18 receptors,\n100 per cm²", ha="center", va="center", fontsize=8.5)
    responses = "static rate,\ndynamic rate or\nfirst-spike latency\nof each receptor,\n7 spheres"
    names = [f"σ₁ = {number(section.noise_sigma)} ({name})" for name, section in sets.items()]
    noisy = "\n".join(["(a) each value times", "Normal(1, σ₁)", *names])
    start = _draw_boxes(axes, ((0.85, responses), (2.4, noisy)), 1.75, BLACK)[-1]
    for name, boxes, height, at, code, colour in (
        ("Gradient Sum", GRADIENT, 3.0, 3.8, "gradient_sum", BLUE),
        ("Euclidean Distance", EUCLIDEAN, 0.5, -0.25, "euclidean", ORANGE),
    ):
        _draw_arrow(axes, start, _draw_boxes(axes, boxes, height, colour)[0])
        place: Any = {"va": "center", "color": colour}
        axes.text(2.7, at, name, fontweight="bold", fontsize=11.0, **place)
        axes.text(5.0, at, _ends(sets, code), fontsize=8.5, **place)
    return drawn


def _ends(sets: Mapping[str, SphereDiscrimination], code: str) -> str:
    """List the hit rates of the ends of the range, a line per set."""
    lines = []
    for name, section in sets.items():
        low, high = (f"{number(curvature)} 1/m" for curvature in section.curvature_per_m[[1, -1]])
        found = (
            f"{measure} {fixed(rates.hit_rate[0], 2)} and {fixed(rates.hit_rate[-1], 2)}"
            for measure, rates in getattr(section, code).items()
        )
        said = "; ".join(found) or "no hit rates: the population is silent"
        lines.append(f"{name}, {low} and {high}: {said}")
    return "\n".join(lines)


def _draw_boxes(axes: Axes, boxes: tuple[tuple[float, str], ...], height: float, colour: str) -> list[Text]:
    """Draw boxes side by side, with an arrow from each to the next."""
    style: Any = {"boxstyle": "round,pad=0.4", "facecolor": PALE, "edgecolor": colour, "linewidth": 1.4}
    text: Any = {"ha": "center", "va": "center", "fontsize": 7.5, "bbox": style}
    drawn = [axes.text(x, height, words, **text) for x, words in boxes]
    for before, after in pairwise(drawn):
        _draw_arrow(axes, before, after)
    return drawn


def _draw_arrow(axes: Axes, start: Text, end: Text) -> None:
    style: Any = {"arrowstyle": "-|>", "color": BLACK, "linewidth": 1.2, "shrinkA": 0.0, "shrinkB": 0.0}
    style |= {"patchA": start.get_bbox_patch(), "patchB": end.get_bbox_patch()}
    axes.annotate("", end.get_position(), start.get_position(), arrowprops=style)


PER_CENT = 100.0
LARGEST_FRACTION = 45.0  # End of the axis; an interval without an upper bound extends beyond it. [%]

STYLES: tuple[Any, ...] = (
    {"color": BLACK, "linestyle": "-", "marker": "o"},
    {"color": BLUE, "linestyle": "--", "marker": "s"},
    {"color": ORANGE, "linestyle": "-.", "marker": "^"},
    {"color": GREEN, "linestyle": ":", "marker": "v"},
)


CAPTION_THRESHOLDS = (
    "(a) Difference in curvature that is discriminated from a standard in 75 % of trials, as a share of "
    "the standard: Gradient Sum of static rates of two populations, each with the noise fitted to the "
    "observed hit rates at 287 1/m; ideal observer of the same rates (dashed); participants (diamonds; "
    "recalled, not read in the original). Bars: 95 % interval of an experiment with "
    "{judgements} judgements of each comparison. (b) Hit rates of that experiment and "
    "fitted psychometric functions, first population. Rates are interpolated between "
    "{pressed_per_m:n} spheres."
)


def threshold_tables(section: CurvatureThresholds) -> list[Table]:
    rows = [(population, entry) for population in section.populations for entry in population.standards]
    columns = (
        Column(lambda row: _layout(row[0]), "receptors"),
        Column("0.noise_sigma", "noise", 3), Column("1.standard_per_m", "standard"),
        Column("1.jnd_per_m", "JND", 1), Column("1.weber_fraction", "Weber fraction", _per_cent),
        Column(
            lambda row: f"{_per_cent(row[1].fitted_weber_fraction)} "
            f"({' to '.join(map(_per_cent, row[1].fitted_interval))})",
            "of an experiment, 95 %",
        ),
        Column("1.ideal_weber_fraction", "ideal observer", _per_cent),
    )  # fmt: skip
    missed = [entry.why_not for population in section.populations for entry in population.without_threshold]
    return [table("Curvature thresholds", rows, columns, " ".join(missed))]


def _layout(population: PopulationThresholds) -> str:
    return f"{number(population.rows)} by {number(population.columns)}"


def _per_cent(share: float | None) -> str:
    return fixed(None if share is None else PER_CENT * share, 1) + f"{UNBROKEN}%"


@figure(
    "reproduction", "Beyond the paper", 12, "figure_12_curvature_thresholds", "Thresholds of curvature",
    CAPTION_THRESHOLDS, of=both("curvature_thresholds"), tables=threshold_tables,
)  # fmt: skip
def draw_thresholds(section: CurvatureThresholds) -> Figure:
    drawn = new_figure(COLUMN_IN, 8.0)
    fractions, curves = drawn.subplots(2, 1)
    _draw_fractions(fractions, section)
    _draw_curves(curves, section)
    return drawn


def _draw_fractions(axes: Axes, section: CurvatureThresholds) -> None:
    first = section.populations[0]
    low, high = (PER_CENT * fraction for fraction in psychophysics.WEBER_FRACTIONS.value)
    axes.axhspan(low, high, color=PALE, label=f"observed, as reported: {number(low, 2)}-{number(high, 2)} %")

    def of(population: PopulationThresholds, name: str) -> FloatArray:
        return PER_CENT * np.array([getattr(entry, name) for entry in population.standards], dtype=np.float64)

    for population, style in zip(section.populations, STYLES[1:], strict=False):
        label, at = (
            f"Gradient Sum, {_layout(population)} receptors",
            of(population, "standard_per_m") / PER_CENT,
        )
        axes.plot(at, of(population, "weber_fraction"), label=label, markersize=4.0, **style)
    at, fitted = of(first, "standard_per_m") / PER_CENT, of(first, "fitted_weber_fraction")
    bars = np.abs(of(first, "fitted_interval").reshape(-1, 2).T - fitted)
    axes.errorbar(at, fitted, bars, color=BLUE, linestyle="none", capsize=3.0)
    best: Any = {"color": GREY, "linestyle": (0, (5, 2)), "marker": "."}
    label = f"ideal observer, {_layout(first)} receptors"
    axes.plot(at, of(first, "ideal_weber_fraction"), label=label, **best)
    standards = np.array(psychophysics.THRESHOLD_STANDARDS.value)
    observed = PER_CENT * (psychophysics.THRESHOLD_COMPARISONS.value / standards - 1.0)
    axes.plot(standards, observed, "D", label="observed (Goodwin et al. 1991)", **PEOPLE)
    axes.set(title="(a) difference threshold", ylim=(0.0, LARGEST_FRACTION))
    axes.set(xlabel="curvature of the standard [1/m]", ylabel="Weber fraction at 75 % [%]")
    axes.legend(loc="upper right", fontsize=8.0)


def _draw_curves(axes: Axes, section: CurvatureThresholds) -> None:
    standards = section.populations[0].standards
    if not standards:
        say_nothing_to_draw(axes, "no standard has a threshold")
        return
    axes.axhline(PER_CENT * CHANCE, color=GREY, linewidth=1.0, linestyle=(0, (6, 3)))
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
