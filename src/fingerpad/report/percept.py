"""Figures of percepts: hit rates of spheres, thresholds of curvature, and discrimination tasks."""

from __future__ import annotations

from typing import Any

import numpy as np
from matplotlib.axes import Axes
from matplotlib.figure import Figure

from fingerpad.core.signals import HitRates
from fingerpad.core.values import FloatArray, one_of
from fingerpad.data import psychophysics
from fingerpad.experiments.discrimination.analysis import Decoding, SideCurve, TaskResult
from fingerpad.experiments.gerling2014.percept import GoodwinHitRates, ObserverHitRates, SphereDiscrimination
from fingerpad.experiments.gerling2014.thresholds import CurvatureThresholds, PopulationThresholds
from fingerpad.psychophysics.curve_fit import PsychometricFit
from fingerpad.report.page import DRAW, DRAWINGS, ROWS, Rows, enter
from fingerpad.report.style import (
    BLACK,
    BLUE,
    COLUMN_IN,
    GREY,
    MAP_AXES,
    NO_MARKER,
    ORANGE,
    PALE,
    PEOPLE,
    SERIES,
    Style,
    draw_chance,
    fill_band,
    new_figure,
    say_nothing_to_draw,
    shared_legend,
)
from fingerpad.report.tables import ABSENT, fixed, number, percent, span, with_error

CURVE_POINTS = 200


@enter(DRAWINGS, ("HitRates", "hit_rates"))
def draw_comparisons(axes: Axes, rates: HitRates) -> None:
    comparison = np.arange(1, rates.hit_rate.size + 1)
    axes.errorbar(comparison, rates.hit_rate, rates.hit_rate_sd, fmt="o", color=BLUE, capsize=3.0)
    axes.set(xlabel="comparison", ylabel="hit rate [fraction]", ylim=(0.0, 1.05), xticks=comparison)


@enter(DRAWINGS, ("PsychometricFit", "curve"))
def draw_curve(axes: Axes, fit: PsychometricFit) -> None:
    """Draw the observed proportions, the curve through them, and its threshold."""
    levels = fit.counts.levels
    room = 0.1 * float(np.ptp(levels))
    at = np.linspace(levels.min() - room, levels.max() + room, CURVE_POINTS)
    axes.plot(at, fit.predict(at), color=BLUE)
    axes.plot(levels, fit.counts.proportion, "o", color=BLACK)
    axes.axvline(fit.threshold(), color=GREY, linestyle=":")
    axes.set(xlabel=f"level; threshold {fit.threshold_label}", ylabel="proportion correct", ylim=(0.0, 1.05))


SPHERES = ("sphere at 0.0 mm", "sphere at 0.2 mm")
CODES = {
    "static": "Gradient Sum, static",
    "dynamic": "Gradient Sum, dynamic",
    "latency": "Gradient Sum, latency",
    "euclidean": "Euclidean, static",
}

Panel = tuple[str, ObserverHitRates | None]


def observer_panels(section: SphereDiscrimination) -> list[Panel]:
    """Titles and hit rates of Figure 7 in the paper's order."""
    variants, static, best = section.variants, CODES["static"], f"σ₁ = {number(section.noise_sigma)}"
    rates = {**section.gradient_sum, "euclidean": section.euclidean["static"]}

    def at(sigma: float) -> Panel:
        return f"{static}\nσ₁ = {sigma:g}", variants[f"sigma_{sigma:g}"]

    return [
        *((f"{label}\n{best}", rates.get(name)) for name, label in CODES.items()),
        *map(at, psychophysics.NOISE_SIGMA_SHOWN.value),
        (f"{static}\n{best}, 10 matrices", variants["ten_matrices"]),
        at(section.noise_sigma_paper),
    ]


def criterion_panels(section: SphereDiscrimination) -> list[Panel]:
    names = sorted(name for name in section.variants if name.startswith("criterion_"))
    return [(f"β varies by {name.removeprefix('criterion_')}", section.variants[name]) for name in names]


@enter(ROWS, "hit_rates")
def rows_of_hit_rates(section: SphereDiscrimination) -> Rows:
    return [
        (title.replace("\n", ", "), place, *map(with_error, means, spreads))
        for title, each in (*observer_panels(section), *criterion_panels(section))
        if each is not None
        for place, means, spreads in (
            ("0.0", each.hit_rate, each.hit_rate_sd),
            ("0.2", each.hit_rate_shifted, each.hit_rate_shifted_sd),
        )
    ]


@enter(DRAW, "figure_7_discrimination")
def draw_observers(section: SphereDiscrimination) -> Figure:
    return _draw_panels(section, observer_panels(section))


@enter(DRAW, "figure_8_varied_criterion")
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
    for (means, spreads), style, label in zip(pairs, SERIES, SPHERES, strict=False):
        bars = np.nan_to_num(np.minimum(spreads, [means, 1.0 - means]))  # a hit rate lies within 0 and 1
        label = f"predicted, {label}"
        axes.errorbar(section.curvature_per_m[1:], means, bars, label=label, **style, **lines)
    draw_people(axes, section.goodwin)


def draw_people(axes: Axes, observed: GoodwinHitRates) -> None:
    rate, label = observed.hit_rate, "observed (Goodwin et al. 1991)"
    bars: Any = {"yerr": [rate - observed.low, observed.high - rate], "elinewidth": 1.2, "capsize": 4.0}
    axes.errorbar(observed.curvature_per_m, rate, fmt="D", label=label, **bars, **PEOPLE)


PER_CENT = 100.0
LARGEST_FRACTION = 45.0  # End of the axis; an interval without an upper bound extends beyond it. [%]


@enter(ROWS, "curvature_thresholds")
def rows_of_thresholds(section: CurvatureThresholds) -> Rows:
    """Return the threshold at each standard, or the reason why there is none."""
    rows: Rows = []
    for population in section.populations:
        first = _layout(population), fixed(population.noise_sigma, 3)
        for each in population.standards:
            within = " to ".join(percent(end, 1) for end in each.fitted_interval)
            experiment = f"{percent(each.fitted_weber_fraction, 1)} ({within})"
            shares = percent(each.weber_fraction, 1), experiment, percent(each.ideal_weber_fraction, 1)
            rows.append((*first, number(each.standard_per_m), fixed(each.jnd_per_m, 1), *shares))
        for none in population.without_threshold:
            rows.append((*first, number(none.standard_per_m), ABSENT, ABSENT, none.why_not, ABSENT))
    return rows


def _layout(population: PopulationThresholds) -> str:
    return f"{number(population.rows)} by {number(population.columns)}"


@enter(DRAW, "figure_12_curvature_thresholds")
def draw_thresholds(section: CurvatureThresholds) -> Figure:
    drawn = new_figure(COLUMN_IN, 4.0)
    axes = drawn.subplots()
    first = section.populations[0]
    low, high = (PER_CENT * fraction for fraction in psychophysics.WEBER_FRACTIONS.value)
    axes.axhspan(low, high, color=PALE, label=f"observed, as reported: {number(low, 2)}-{number(high, 2)} %")

    def of(population: PopulationThresholds, name: str) -> FloatArray:
        return PER_CENT * np.array([getattr(entry, name) for entry in population.standards], dtype=np.float64)

    for population, style in zip(section.populations, SERIES, strict=False):
        at, share = of(population, "standard_per_m") / PER_CENT, of(population, "weber_fraction")
        label = f"Gradient Sum, {_layout(population)} receptors"
        axes.plot(at, share, label=label, markersize=4.0, **style)
    at, fitted = of(first, "standard_per_m") / PER_CENT, of(first, "fitted_weber_fraction")
    bars = np.abs(of(first, "fitted_interval").reshape(-1, 2).T - fitted)
    axes.errorbar(at, fitted, bars, color=BLUE, linestyle="none", capsize=3.0)
    best: Any = {"color": GREY, "linestyle": (0, (5, 2)), "marker": "."}
    label = f"ideal observer, {_layout(first)} receptors"
    axes.plot(at, of(first, "ideal_weber_fraction"), label=label, **best)
    standards = np.array(psychophysics.THRESHOLD_STANDARDS.value)
    observed = PER_CENT * (psychophysics.THRESHOLD_COMPARISONS.value / standards - 1.0)
    axes.plot(standards, observed, "D", label="observed (Goodwin et al. 1991)", **PEOPLE)
    axes.set(xlabel="curvature of the standard [1/m]", ylabel="Weber fraction at 75 % [%]")
    axes.set_ylim(0.0, LARGEST_FRACTION)
    axes.legend(loc="upper right", fontsize=8.0)
    return drawn


MOST_MAPS = 4  # Stimuli in the figure of responses: the standard, and comparisons from the first to the last.
MARGIN_MM = 0.6  # About the outermost afferents of a map. [mm]
CODE_LABELS = {"gradient_sum": "Gradient Sum", "euclidean": "Euclidean Distance", "ideal": "ideal observer"}
MEASURE_LABELS = {
    "static": ("static rate", "static rates", "spikes/s"),
    "dynamic": ("dynamic rate", "dynamic rates", "spikes/s"),
    "latency": ("first-spike latency", "first-spike latencies", "ms"),
}
"""A measure of the response, several of it, and its unit."""


@enter(ROWS, "thresholds")
def rows_of_task_thresholds(found: TaskResult) -> Rows:
    return [(titled(each), *_threshold_cells(side)) for each in found.decodings for side in each.curves]


def _threshold_cells(side: SideCurve) -> tuple[str, ...]:
    if side.fit is None:
        return (side.side, side.why_not or "", "", "", "", "", "")
    found = side.fit.threshold
    intervals = span(found.posterior_interval), span(found.bootstrap_interval)
    share = percent(found.over_standard)
    return side.side, number(found.level), number(found.difference), *intervals, share, number(side.fit.slope)


@enter(ROWS, "comparisons")
def rows_of_comparisons(found: TaskResult) -> Rows:
    """Return what each decoding makes of each comparison."""
    rows = []
    for each in found.decodings:
        if each.hit_rate is None:
            rows.append((titled(each), why_silent(each), *[ABSENT] * 6))
        else:
            rows += [(titled(each), name, *_cells(each, row)) for row, name in enumerate(found.stimulus[1:])]
    return rows


def _cells(found: Decoding, row: int) -> tuple[str, ...]:
    values = (found.hit_rate, found.hit_rate_sd), (found.efficiency, found.efficiency_error)
    rate, efficiency = (
        ABSENT if value is None or error is None else with_error(value[row], error[row], 3)
        for value, error in values
    )
    if found.forced_choice is None:
        return rate, *[ABSENT] * 4, efficiency
    correct, *ends = found.forced_choice.proportions[:, row]
    d_prime, *d_ends = found.forced_choice.d_primes[:, row]
    within = " … ".join(fixed(end, 3) for end in ends)
    return rate, fixed(correct, 3), within, number(d_prime), span(d_ends), efficiency


@enter(DRAW, "curves")
def draw_task_curves(found: TaskResult) -> Figure:
    measures = list(dict.fromkeys(decoding.measure for decoding in found.decodings))
    drawn = new_figure(min(10.0, 3.6 * len(measures) + 2.0), 4.6)
    grid = drawn.subplots(1, len(measures), sharey=True, squeeze=False)
    for axes, measure in zip(grid[0], measures, strict=True):
        draw_curves_of_measure(axes, found, measure)
    for axes in grid[0, 1:]:
        axes.set_ylabel("")
    shared_legend(drawn, grid[0], columns=4)
    return drawn


def draw_curves_of_measure(axes: Axes, found: TaskResult, measure: str) -> None:
    """Draw what all codes make of one measure: hit rates and psychometric curves, and those of people."""
    of_measure = [decoding for decoding in found.decodings if decoding.measure == measure]
    axes.set_title(MEASURE_LABELS[measure][0])
    draw_chance(axes)
    if all(decoding.hit_rate is None for decoding in of_measure):
        say_nothing_to_draw(axes, why_silent(of_measure[0]))
        return
    for decoding, style in zip(of_measure, SERIES, strict=False):
        _draw_curve(axes, found, decoding, style)
    _draw_people(axes, found)
    _name_axis(axes, found)
    axes.set(ylim=(0.4, 1.03), ylabel="hit rate [fraction]")


def _draw_curve(axes: Axes, found: TaskResult, decoding: Decoding, style: Style) -> None:
    if decoding.hit_rate is None or decoding.hit_rate_sd is None:
        return
    marks: Any = style | {"linestyle": "none", "markersize": 5.0, "capsize": 3.0, "elinewidth": 1.0}
    bars, label = np.nan_to_num(decoding.hit_rate_sd), CODE_LABELS[decoding.code]
    axes.errorbar(_places(found)[1:], decoding.hit_rate, bars, label=label, **marks)
    for fit in (side.fit for side in decoding.curves if side.fit):
        curve, threshold = fit.curve, fit.threshold
        fill_band(axes, curve.level, curve.low, curve.high, style["color"], 0.15)
        axes.plot(curve.level, curve.proportion, linewidth=1.5, **style | NO_MARKER)
        dotted: Any = {"color": style["color"], "linewidth": 0.9, "linestyle": ":"}
        axes.plot([threshold.level] * 2, [0.4, threshold.proportion], **dotted)


def _draw_people(axes: Axes, found: TaskResult) -> None:
    observed = found.observed
    points = {point.level: point for point in observed.points if point.level is not None} if observed else {}
    for level, point in points.items():
        if point.interval:
            axes.plot([level] * 2, point.interval, color=BLACK, linewidth=1.4, zorder=5)
    if observed and points:
        rates = [point.hit_rate for point in points.values()]
        axes.plot(list(points), rates, "D", label=f"observed ({observed.source})", **PEOPLE)


@enter(DRAWINGS, ("TaskResult", "curves"))
def draw_task(axes: Axes, task: TaskResult, measure: str | None = None) -> None:
    """Draw hit rates and psychometric curves of all codes."""
    measures = tuple(dict.fromkeys(decoding.measure for decoding in task.decodings))
    draw_curves_of_measure(axes, task, one_of("measure", measure or main_decoding(task).measure, measures))
    axes.legend(fontsize="small")


@enter(DRAW, "statistics")
def draw_task_statistics(found: TaskResult) -> Figure:
    decodings = [decoding for decoding in found.decodings if decoding.code != "ideal"]
    columns, rows = (len({getattr(each, name) for each in decodings}) for name in ("code", "measure"))
    drawn = new_figure(min(10.0, 4.0 * columns + 1.5), 3.0 * rows + 0.3)
    grid = drawn.subplots(rows, columns, squeeze=False)
    for axes, decoding in zip(grid.flat, decodings, strict=True):
        axes.set_title(titled(decoding))
        if decoding.statistic is None:
            say_nothing_to_draw(axes, why_silent(decoding))
            continue
        where, mean, spread = _places(found), decoding.statistic.mean, decoding.statistic.sd
        axes.axhspan(mean[0] - spread[0], mean[0] + spread[0], color=GREY, alpha=0.25, linewidth=0.0)
        axes.errorbar(where, mean, spread, fmt="o", color=BLUE, markersize=4.5, capsize=3.0, elinewidth=1.2)
        axes.plot(where[0], mean[0], "D", color=BLACK, markersize=6.5, zorder=4)
        axes.set_ylabel(f"{CODE_LABELS[decoding.code]} [{MEASURE_LABELS[decoding.measure][2]}]")
        _name_axis(axes, found)
    return drawn


@enter(DRAW, "responses")
def draw_task_responses(found: TaskResult) -> Figure:
    measure = main_decoding(found).measure
    what, _, unit = MEASURE_LABELS[measure]
    responses, places = found.responses[measure], found.population.positions_mm[:, [0, -1]]
    shown = [round(row) for row in np.linspace(0, len(responses) - 1, min(len(responses), MOST_MAPS))]
    # Marks are so small that many of them do not cover each other.
    size = float(np.clip(2500.0 / len(places), 4.0, 140.0))
    low, high = places.min(axis=0) - MARGIN_MM, places.max(axis=0) + MARGIN_MM
    along, across = high - low
    drawn = new_figure(10.0, float(np.clip(8.0 / len(shown) * across / along, 0.5, 4.0)) + 1.0)
    panels = np.ravel(drawn.subplots(1, len(shown), sharex=True, sharey=True))
    dots: Any = {"cmap": "viridis", "s": size, "edgecolors": GREY, "linewidths": 0.5}
    picture = panels[0].scatter(*places.T, c=responses[0], **dots)
    differences = np.nan_to_num(responses - responses[0])
    largest = float(np.abs(differences[shown]).max())
    for axes, row in zip(panels, shown, strict=True):
        area = size * np.abs(differences[row]) / (largest or 1.0)
        for sign, marker, colour in ((1.0, "^", ORANGE), (-1.0, "v", BLUE)):
            there = sign * differences[row] > 0.0
            axes.scatter(*places[there].T, s=area[there], marker=marker, color=colour)
        axes.set(title=found.stimulus[row] if row else f"{found.stimulus[0]}, standard", **MAP_AXES)
        axes.set(xlim=(low[0], high[0]), ylim=(low[1], high[1]), facecolor=PALE)
    for axes in panels[1:]:
        axes.set_ylabel("")
    drawn.colorbar(picture, ax=panels, label=f"{what} [{unit}]", shrink=0.8)
    key = f"others less the standard: ▲ more, ▼ less, largest {number(largest)} {unit}"
    drawn.supxlabel(key, fontsize=9.0)
    return drawn


def main_decoding(found: TaskResult) -> Decoding:
    return next(decoding for decoding in found.decodings if decoding.hit_rate is not None)


def titled(decoding: Decoding) -> str:
    return f"{CODE_LABELS[decoding.code]}, {MEASURE_LABELS[decoding.measure][0]}"


def why_silent(decoding: Decoding) -> str:
    return f"silent under {', '.join(decoding.silent[:3])}"


def _places(found: TaskResult) -> FloatArray:
    """Where each stimulus stands along an axis; side by side if that place has no meaning."""
    return np.arange(len(found.stimulus), dtype=np.float64) if found.level is None else found.level


def _name_axis(axes: Axes, found: TaskResult) -> None:
    if found.level is None:
        axes.set_xticks(_places(found), found.stimulus, rotation=30, ha="right")
    axes.set_xlabel("stimulus" if found.level is None else found.axis)
