"""Level 3, Figures 3, 7 and 8: the steps to a hit rate, and hit rates of spheres against the standard."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from itertools import pairwise
from typing import Any

import numpy as np
from matplotlib.axes import Axes
from matplotlib.figure import Figure
from matplotlib.text import Text

from fingerpad.data import psychophysics
from fingerpad.experiments.gerling2014.discrepancy import CriterionErrorBars
from fingerpad.experiments.gerling2014.discrimination_statistics import GoodwinHitRates
from fingerpad.experiments.gerling2014.sphere_discrimination import ObserverHitRates, SphereDiscrimination
from fingerpad.report.formatting import fixed, number, with_error
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
    LineStyle,
    new_figure,
    say_nothing_to_draw,
    shared_legend,
)

CHANCE = 0.5
POSITION_STYLES: tuple[tuple[LineStyle, str], ...] = (
    ({"color": BLUE, "linestyle": "-", "marker": "o"}, "predicted, sphere at 0.0 mm"),
    ({"color": ORANGE, "linestyle": ":", "marker": "s"}, "predicted, sphere at 0.2 mm"),
)
CODES = {
    "static": "Gradient Sum, static",
    "dynamic": "Gradient Sum, dynamic",
    "latency": "Gradient Sum, latency",
    "euclidean": "Euclidean, static",
}
CODE_STYLES: tuple[LineStyle, ...] = (
    {"color": BLUE, "linestyle": "-"},
    {"color": ORANGE, "linestyle": "--"},
    {"color": GREEN, "linestyle": "-."},
    {"color": BLACK, "linestyle": ":"},
)
Panel = tuple[str, ObserverHitRates | None]


def draw_observers(section: SphereDiscrimination) -> Figure:
    """Draw Figure 7: codes, noise levels and repetitions, one panel each."""
    return _draw(section, observer_panels(section))


def draw_criterion(section: SphereDiscrimination) -> Figure:
    """Draw Figure 8: the decision criterion varies from trial to trial."""
    return _draw(section, criterion_panels(section))


def draw_noise(section: SphereDiscrimination) -> Figure:
    """Draw the distance of each code from people over the noise, and the sweep of the paper's range."""
    figure = new_figure(COLUMN_IN, 4.4)
    codes, sweep = figure.subplots(1, 2, sharey=True)
    curve = section.reasons.misfit_curve
    for (name, label), style in zip(CODES.items(), CODE_STYLES, strict=True):
        if name in curve.misfit:
            codes.plot(curve.noise_sigma, curve.misfit[name], label=label, **style)
    codes.set_title("(a) each code, expected")
    swept = section.statistics.sweep
    for misfit, (style, label) in zip(swept.misfit, POSITION_STYLES, strict=True):
        means, errors = ([getattr(one, name) for one in misfit] for name in ("value", "error"))
        label, bars = label.removeprefix("predicted, "), np.nan_to_num(errors)
        sweep.errorbar(swept.noise_sigma, means, bars, markersize=5.0, capsize=3.0, label=label, **style)
    sweep.set_title("(b) static Gradient Sum")
    marked = {"paper's best": section.noise_sigma_paper, "our fit": section.noise_sigma}
    for axes in (codes, sweep):
        for (label, sigma), dashes in zip(marked.items(), ((6, 3), (1, 1)), strict=True):
            axes.axvline(sigma, color=GREY, linewidth=1.4, linestyle=(0, dashes), label=label)
        axes.set(xlabel="noise σ₁ [fraction]")
        axes.set_ylim(bottom=0.0)
    codes.set_ylabel("distance to observed hit rates, rms [fraction]")
    sweep.set_xlim(left=0.0)
    shared_legend(figure, (codes, sweep), columns=2)
    return figure


def caption_noise(section: SphereDiscrimination) -> str:
    return (
        "Root mean square distance of predicted hit rates from those of people (Goodwin et al. 1991) at 296 "
        "and 365 1/m, against the noise. (a) Each code has its own best noise. (b) The range of the paper, "
        f"in {number(section.sessions)} sessions of the whole protocol; bars are Monte-Carlo errors. The "
        "best noise compensates for the slope of a code: the steeper a sum rises with curvature, the more "
        "noise brings its hit rates down to those of people."
    )


def observer_panels(section: SphereDiscrimination) -> list[Panel]:
    """Titles and hit rates of Figure 7 in the paper's order."""
    sums, variants, static = section.gradient_sum, section.variants, CODES["static"]
    best = f"σ₁ = {number(section.noise_sigma)}"

    def at(sigma: float) -> Panel:
        return f"{static}\nσ₁ = {sigma:g}", variants[f"sigma_{sigma:g}"]

    rates = {**sums, "euclidean": section.euclidean["static"]}
    return [
        *((f"{label}\n{best}", rates.get(name)) for name, label in CODES.items()),
        *map(at, psychophysics.NOISE_SIGMA_SHOWN.value),
        (f"{static}\n{best}, 10 matrices", variants["ten_matrices"]),
        at(section.noise_sigma_paper),
    ]


def criterion_panels(section: SphereDiscrimination) -> list[Panel]:
    names = sorted(name for name in section.variants if name.startswith("criterion_"))
    return [(f"β varies by {name.removeprefix('criterion_')}", section.variants[name]) for name in names]


def _draw(section: SphereDiscrimination, panels: list[Panel]) -> Figure:
    rows = max(1, -(-len(panels) // 2))
    figure = new_figure(COLUMN_IN, 2.2 * rows + 0.9)
    grid = figure.subplots(rows, 2, sharex=True, sharey=True, squeeze=False)
    for index, axes in enumerate(grid.flat):
        if index >= len(panels):
            axes.set_axis_off()
            continue
        title, rates = panels[index]
        axes.set_title(f"({'abcdefghijklmnop'[index]}) {title}", fontsize=10.0)
        if rates is None:
            say_nothing_to_draw(axes, "not computed")
        else:
            draw_hit_rates(axes, section, rates)
        if index % 2 == 0:
            axes.set_ylabel("hit rate [fraction]")
        if index >= len(panels) - 2:
            axes.set_xlabel("comparison curvature [1/m]")
            axes.tick_params(labelbottom=True)
    lowest, _ = grid[0, 0].get_ylim()
    grid[0, 0].set_ylim(max(min(lowest, 0.4), 0.0), 1.0)
    shared_legend(figure, grid.flat, columns=2)
    return figure


def draw_hit_rates(axes: Axes, section: SphereDiscrimination, rates: ObserverHitRates) -> None:
    """Draw the hit rates of one observer at both positions, those of people, and chance."""
    axes.axhline(CHANCE, color=GREY, linewidth=1.0, linestyle=(0, (6, 3)), label="chance")
    both = (rates.hit_rate, rates.hit_rate_sd), (rates.hit_rate_shifted, rates.hit_rate_shifted_sd)
    lines: Any = {"markersize": 4.0, "linewidth": 1.5, "elinewidth": 1.0, "capsize": 3.0, "clip_on": False}
    for (means, spreads), (style, label) in zip(both, POSITION_STYLES, strict=True):
        bars = np.nan_to_num(np.minimum(spreads, [means, 1.0 - means]))  # a hit rate lies within 0 and 1
        axes.errorbar(section.curvature_per_m[1:], means, bars, label=label, **style, **lines)
    draw_people(axes, section.goodwin)


def draw_people(axes: Axes, observed: GoodwinHitRates) -> None:
    rate, label = observed.hit_rate, "observed (Goodwin et al. 1991)"
    bars = [rate - observed.low, observed.high - rate]
    axes.errorbar(
        observed.curvature_per_m, rate, bars, fmt="D", elinewidth=1.2, capsize=4.0, label=label, **PEOPLE
    )


def caption_observers(section: SphereDiscrimination) -> str:
    return (
        "Fraction of trials in which a sphere is discriminated from the standard of "
        f"{number(section.curvature_per_m[0])} 1/m; bars are one standard deviation over hit rates, within "
        "0 and 1. Blue, solid: predicted for a sphere over the middle of the receptors; orange, dotted: for "
        "one 0.2 mm away. Diamonds: observed in people (Goodwin et al. 1991), with binomial 95 % intervals "
        f"of {number(section.goodwin.trials)} trials, an assumed number. (a-c) Gradient Sum of static rates, "
        "dynamic rates and first-spike latencies, (d) Euclidean Distance of static rates, all with the "
        "noise that was fitted to the diamonds with the code of (a). (e, f) The paper's noise on either "
        "side of its best; (g) 10 noise matrices in place of 100; (h) the paper's best noise. In the "
        "paper the static Gradient Sum fits best and hardly depends on the shift, dynamic rates and "
        "latencies depend on it, more noise lowers the curve, and fewer matrices widen the bars."
    )


def caption_criterion(_: SphereDiscrimination) -> str:
    return (
        "Gradient Sum of static rates with a varied criterion: for each hit rate the decision point is "
        "multiplied by a new normal variable with mean 1 and the standard deviation in the title. Marks, "
        "bars and noise as in Figure 7 (a). In the paper the wider distribution increases the error bars and "
        "does not change the means."
    )


def discrimination_tables(section: SphereDiscrimination) -> list[Table]:
    """Return the hit rates of Figures 7 and 8, and the alternative interpretations of the paper's steps."""
    rows = [
        Row.of(title.replace("\n", ", "), place, *map(with_error, means, spreads))
        for title, rates in (*observer_panels(section), *criterion_panels(section))
        if rates is not None
        for place, means, spreads in (
            ("0.0", rates.hit_rate, rates.hit_rate_sd),
            ("0.2", rates.hit_rate_shifted, rates.hit_rate_shifted_sd),
        )
    ]
    spheres = (f"{number(curvature)} 1/m" for curvature in section.curvature_per_m[1:])
    columns = ("observer", "sphere at [mm]", *spheres)
    hit_rates = Table("Hit rates, mean ± standard deviation", columns, rows)
    return [hit_rates, _interpretations(section), criterion_table(section.reasons.criterion)]


def criterion_table(bars: CriterionErrorBars) -> Table:
    """Return the mean error bar for each interpretation of what a varied criterion multiplies."""
    rows = {
        "the decision point (used)": bars.point,
        "the fraction beta of the distance between the means": bars.fraction,
        "a likelihood ratio of mean 1 between comparison and standard": bars.likelihood,
    }
    return Table(
        "Error bars by what the varied criterion multiplies",
        ("Normal(1, σ) multiplies", *(f"σ = {number(sigma)}" for sigma in bars.criterion_sigma)),
        [
            Row.of(name, *(fixed(bar, 4) for bar in found), kind="final" if "(used)" in name else "")
            for name, found in rows.items()
        ],
        "Mean standard deviation of a hit rate over the six spheres at 0.0 mm, static Gradient Sum.",
    )


def _interpretations(section: SphereDiscrimination) -> Table:
    rows = [
        Row.of(
            one.reading,
            " / ".join(number(count) for count in one.receptors),
            " / ".join(fixed(rise, 3) for rise in one.rise),
            *(fixed(value, 3) for value in (one.largest_shift, one.noise_sigma, one.misfit)),
            fixed(one.own_largest_shift, 3),
            kind="final" if "(used)" in one.reading else "",
        )
        for one in section.reasons.readings
    ]
    columns = (
        "interpretation",
        "receptors",
        "increase of the sum, 287 to 365 1/m",
        "largest change by the shift",
        "separately fitted noise",
        "rms distance to observed with it",
        "largest change by the shift with it",
    )
    note = (
        "Two numbers are for the spheres at 0.0 and at 0.2 mm. The noise is fitted to both positions "
        "together; hit rates are expected values, without sampling error."
    )
    return Table("Interpretations of steps that the paper leaves open", columns, rows, note)


ROWS = {"gradient": 3.0, "start": 1.75, "euclidean": 0.5}  # Heights of the boxes, by code.

GRADIENT = (
    "(b) gradient of\neach receptor: sum of\n|differences| from\nits neighbours",
    "(c) sum over the\n18 receptors:\none gradient sum",
    "(d, e) 100 sums for\neach of 7 spheres:\n700 sums; μ₂ and σ₂\nof each sphere",
    "(f) 100 times:\n100 pairs of μ₂, σ₂\nfor each sphere",
    "(g, h) signal detection\nof a random pair against\none of the standard,\nβ = 0.5: one hit rate",
    "(i, j) 100 hit rates for\neach of 6 spheres\n(k) μ₃ ± σ₃",
)
EUCLIDEAN = (
    "(b*) one set:\n18 noisy values",
    "(c*) 100 sets\nof one sphere",
    "(d*) 700 sets,\n100 for each\nof 7 spheres",
    "(e*) set of a sphere less\nset of the standard: sum\nof 18 |differences|",
    "(f*) 100 sums of one sphere\n(g*) 700 sums, 100 for\neach of 7 spheres",
    "(h*) hit or miss: side\nof the middle between\nthe two means;\n100 hit rates: μ₃ ± σ₃",
)


def draw_steps(sets: Mapping[str, SphereDiscrimination]) -> Figure:
    """Draw Figure 3: what each code does, from left to right, and the hit rates of each set of tissues."""
    figure = new_figure(12.4, 4.4)
    figure.set_layout_engine("none")
    axes = figure.add_axes((0.0, 0.0, 1.0, 1.0))
    axes.set(xlim=(0.0, 12.4), ylim=(-0.45, 4.0))
    axes.set_axis_off()
    names = [f"σ₁ = {number(section.noise_sigma)} ({name})" for name, section in sets.items()]
    x, y = np.meshgrid(np.linspace(0.4, 1.3, 6), np.linspace(2.45, 2.85, 3))
    axes.scatter(x, y, s=45.0, facecolors=PALE, edgecolors=BLACK, linewidths=1.0)
    axes.text(0.85, 3.2, "18 receptors,\n100 per cm²", ha="center", va="center", fontsize=8.5)
    start = [
        "static rate,\ndynamic rate or\nfirst-spike latency\nof each receptor,\n7 spheres",
        "\n".join(["(a) each value times", "Normal(1, σ₁)", *names]),
    ]
    noisy = _row(axes, start, (0.85, 2.4), "start", BLACK)[-1]
    for row, texts, places, colour in (
        ("gradient", GRADIENT, (3.3, 4.95, 6.6, 8.25, 9.9, 11.6), BLUE),
        ("euclidean", EUCLIDEAN, (3.3, 4.65, 6.0, 7.7, 9.6, 11.45), ORANGE),
    ):
        first = _row(axes, texts, places, row, colour)[0]
        _arrow(axes, noisy, first)
    for name, height, code, colour in (
        ("Gradient Sum", 3.8, "gradient_sum", BLUE),
        ("Euclidean Distance", -0.25, "euclidean", ORANGE),
    ):
        place: Any = {"va": "center", "color": colour}
        axes.text(2.7, height, name, fontweight="bold", fontsize=11.0, **place)
        axes.text(5.0, height, _found(sets, code), fontsize=8.5, **place)
    return figure


def _found(sets: Mapping[str, SphereDiscrimination], code: str) -> str:
    """List the hit rates of the ends of the range, a line per set."""
    lines = []
    for name, section in sets.items():
        low, high = (f"{number(curvature)} 1/m" for curvature in section.curvature_per_m[[1, -1]])
        found = [
            f"{measure} {' and '.join(fixed(rates.hit_rate[end], 2) for end in (0, -1))}"
            for measure, rates in getattr(section, code).items()
        ]
        lines.append(
            f"{name}, {low} and {high}: {'; '.join(found) or 'no hit rates: the population is silent'}"
        )
    return "\n".join(lines)


def _row(axes: Axes, texts: Sequence[str], places: Any, row: str, colour: str) -> list[Text]:
    """Draw boxes side by side, with an arrow from each to the next."""
    box = {"boxstyle": "round,pad=0.4", "facecolor": PALE, "edgecolor": colour, "linewidth": 1.4}
    boxes = [
        axes.text(x, ROWS[row], text, ha="center", va="center", fontsize=7.5, bbox=box)
        for x, text in zip(places, texts, strict=True)
    ]
    for before, after in pairwise(boxes):
        _arrow(axes, before, after)
    return boxes


def _arrow(axes: Axes, start: Text, end: Text) -> None:
    axes.annotate(
        "", end.get_position(), start.get_position(),
        arrowprops={
            "arrowstyle": "-|>", "color": BLACK, "linewidth": 1.2, "shrinkA": 0.0, "shrinkB": 0.0,
            "patchA": start.get_bbox_patch(), "patchB": end.get_bbox_patch(),
        },
    )  # fmt: skip


def caption_steps(sets: Mapping[str, SphereDiscrimination]) -> str:
    standard = next(iter(sets.values())).curvature_per_m[0]
    return (
        "Steps from the responses of 18 receptors to hit rates, with the letters of the paper's section "
        "2.2.3; its figure is not in the copy that we worked from. The standard has "
        f"{number(standard)} 1/m. Numbers are of this run: spheres at 0.0 mm, first session."
    )
