"""The page of a discrimination task: thresholds, hit rates, efficiencies; and the page of a validation."""

from __future__ import annotations

import math
from pathlib import Path
from typing import Any

import numpy as np
from matplotlib.axes import Axes
from matplotlib.figure import Figure

from fingerpad.core.values import FloatArray
from fingerpad.experiments.discrimination.analysis import (
    Decoding,
    DiscriminationFile,
    ForcedChoice,
    TaskResult,
)
from fingerpad.experiments.discrimination.decoding import SideCurve
from fingerpad.report.page import figure, write_result_page
from fingerpad.report.style import (
    BLACK,
    BLUE,
    GREEN,
    GREY,
    MAP_AXES,
    ORANGE,
    PALE,
    PEOPLE,
    draw_chance,
    fill_band,
    new_figure,
    say_nothing_to_draw,
    shared_legend,
)
from fingerpad.report.tables import (
    ABSENT,
    Column,
    Row,
    Table,
    fixed,
    joined,
    listed,
    number,
    span,
    table,
    whole_percent,
    with_error,
)

MOST_MAPS = 4  # Stimuli in the figure of responses: the standard, and comparisons from the first to the last.
MARGIN_MM = 0.6  # About the outermost afferents of a map. [mm]
CODE_LABELS = {"gradient_sum": "Gradient Sum", "euclidean": "Euclidean Distance", "ideal": "ideal observer"}
MEASURE_LABELS = {
    "static": ("static rate", "static rates", "spikes/s"),
    "dynamic": ("dynamic rate", "dynamic rates", "spikes/s"),
    "latency": ("first-spike latency", "first-spike latencies", "ms"),
}
"""A measure of the response, several of it, and its unit."""

_STYLES = (
    (BLUE, "o", "-"),
    (ORANGE, "s", (0, (6, 2))),
    (GREEN, "^", (0, (2, 1.5))),
    (GREY, "v", (0, (1, 1.5))),
)
"""Colour, marker and dashes of the codes."""


def write_task_page(results: DiscriminationFile, folder: Path) -> Path:
    about = (
        "A finite-element fingertip, a population of slowly adapting afferents and an observer, "
        "after Gerling et al. 2014."
    )
    found = results.discrimination
    said = task_summary(found)
    return write_result_page("discriminate", found, found.question, about, said, results.manifest, folder)


def task_summary(found: TaskResult) -> list[str]:
    """Summarise a task in a few sentences: hit rates of the main decoding, and its thresholds."""
    main, noise = main_decoding(found), found.noise
    assert main.hit_rate is not None
    standard, *others = found.stimulus
    rates = [
        f"{name} from {standard} in {whole_percent(rate)}"
        for name, rate in zip(others, main.hit_rate, strict=True)
    ]
    fitted = f", fitted to {joined(list(noise.fitted_to.stimulus))}" if noise.fitted_to else ""
    of = "" if found.level is None else f" ({found.axis})"
    said = (
        f"{CODE_LABELS[main.code]} of {MEASURE_LABELS[main.measure][1]} discriminates {joined(rates)} of "
        f"trials{of}, with noise σ₁ = {number(noise.sigma)}{fitted}."
    )
    choice = main.forced_choice
    answers = [_forced_choice_sentence(found, choice)] if choice and len(others) == 1 else []
    return [said, *answers, *(_threshold_sentence(found, side) for side in main.curves)]


def _forced_choice_sentence(found: TaskResult, choice: ForcedChoice) -> str:
    standard, comparison = found.stimulus
    rate, low, high = (whole_percent(share) for share in choice.proportions[:, 0])
    d_prime, d_low, d_high = (number(value) for value in choice.d_primes[:, 0])
    return (
        f"In a two-alternative forced choice between {standard} and {comparison} it is correct in {rate} of "
        f"trials ({low} … {high}), d′ = {d_prime} ({d_low} … {d_high}); 95 % intervals of "
        f"{number(choice.trials)} trials."
    )


def _threshold_sentence(found: TaskResult, side: SideCurve) -> str:
    if side.fit is None:
        return f"There is no threshold {side.side} the standard: {side.why_not}"
    threshold = side.fit.threshold
    share = f", {whole_percent(threshold.over_standard)} of it" if threshold.over_standard else ""
    return (
        f"{whole_percent(threshold.proportion)} are reached {number(threshold.difference)} {side.side} the "
        f"standard, at {number(threshold.level)} ({found.axis}){share}; 95 % credible interval "
        f"{span(threshold.posterior_interval)} with {number(side.fit.trials)} trials per comparison."
    )


def task_tables(found: TaskResult) -> list[Table]:
    """Return thresholds, hit rates, proportions correct, efficiencies and the population."""
    decoded = [each for each in found.decodings if each.hit_rate is not None]
    silent = [
        f"{titled(each)}: none, the population is {why_silent(each)}"
        for each in found.decodings
        if each.hit_rate is None
    ]
    rows = [
        (titled(each), side.side, *_threshold_cells(side)) for each in found.decodings for side in each.curves
    ]
    headings = (
        "decoding", "side", f"threshold, {found.axis}", "difference", "95 % credible", "95 %, bootstrap",
        "of the standard", "slope",
    )  # fmt: skip
    choices = [
        (titled(each), name, *each.forced_choice.proportions[:, row], *each.forced_choice.d_primes[:, row])
        for each in found.decodings
        if each.forced_choice is not None
        for row, name in enumerate(found.stimulus[1:])
    ]
    chosen = (
        Column("0", "decoding"), Column("1", "comparison"), Column("2", "proportion correct", 3),
        Column(lambda row: " … ".join(fixed(end, 3) for end in row[3:5]), "95 %"), Column("5", "d′"),
        Column(lambda row: span(row[6:]), "95 %"),
    )  # fmt: skip
    population, factors = found.population, found.population.sensitivity
    facts = {
        "layout": population.layout,
        "receptors": population.n_receptors,
        "pitch [mm]": population.pitch_mm,
        "density [1/cm²]": population.density_per_cm2,
        "sensitivity": span(None if factors is None else (factors.min(), factors.max())),
    }
    made = [
        Table(
            "Thresholds",
            headings,
            [Row(row) for row in rows],
            "Difference: from the standard to the threshold. Intervals: of an experiment with the trials per "
            "comparison of the task. Slope: of the hit rate at the threshold, per unit. Where bootstrap "
            "and slope are missing, the curve rises between two comparisons: add some between them.",
        ),
        table(
            "Hit rates, mean ± standard deviation",
            decoded,
            _by_comparison(found, "hit_rate", "hit_rate_sd"),
            "; ".join(silent),
        ),
        table(
            "Two-alternative forced choice",
            choices,
            chosen,
            "Each trial presents the standard and the comparison once. Intervals: exact, of an experiment "
            "with the trials per comparison of the task. A dash where d′ is infinite.",
        ),
        table(
            "Efficiency ± standard error",
            [each for each in found.decodings if each.efficiency is not None],
            _by_comparison(found, "efficiency", "efficiency_error"),
            "The share of its trials that the ideal observer needs to perform as the code does; a dash where "
            "d' of the ideal observer is not known well enough or infinite.",
        ),
        listed("The population", facts),
    ]
    return [each for each in made if each.rows]


def _threshold_cells(side: SideCurve) -> tuple[str, ...]:
    if side.fit is None:
        return (side.why_not or "", "", "", "", "", "")
    found = side.fit.threshold
    intervals = span(found.posterior_interval), span(found.bootstrap_interval)
    share = ABSENT if found.over_standard is None else whole_percent(found.over_standard)
    return number(found.level), number(found.difference), *intervals, share, number(side.fit.slope)


def _by_comparison(found: TaskResult, name: str, error: str) -> list[Column]:
    """Columns of a value with its error for each comparison."""
    return [
        Column(titled, "decoding"),
        *(_with_error(name, error, row, stimulus) for row, stimulus in enumerate(found.stimulus[1:])),
    ]


def _with_error(name: str, error: str, row: int, heading: str) -> Column:
    def cell(decoding: Decoding) -> str:
        value = getattr(decoding, name)[row]
        return ABSENT if math.isnan(value) else with_error(value, getattr(decoding, error)[row], 3, " ")

    return Column(cell, heading)


def caption_task_curves(found: TaskResult) -> str:
    fitted = [side.fit for decoding in found.decodings for side in decoding.curves if side.fit]
    said = (
        "Hit rate of each comparison against the standard; bars are one standard deviation over the "
        "repetitions of the paper's protocol."
    )
    if not fitted:
        return said
    return (
        f"{said} Lines: psychometric functions ({fitted[0].sigmoid}) of the difference from the standard, "
        f"with 95 % credible bands for an experiment of {number(fitted[0].trials)} trials per comparison. "
        f"Dotted: the threshold at {whole_percent(fitted[0].threshold.proportion)}."
    )


@figure("discriminate", "Results", 1, "curves", "Hit rates and psychometric curves", caption_task_curves)
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
    for decoding, style in zip(of_measure, _STYLES, strict=False):
        _draw_curve(axes, found, decoding, *style)
    _draw_people(axes, found)
    _name_axis(axes, found)
    axes.set(ylim=(0.4, 1.03), ylabel="hit rate [fraction]")


def _draw_curve(axes: Axes, found: TaskResult, decoding: Decoding, color: str, fmt: str, line: Any) -> None:
    if decoding.hit_rate is None or decoding.hit_rate_sd is None:
        return
    marks: Any = {"fmt": fmt, "color": color, "markersize": 5.0, "capsize": 3.0, "elinewidth": 1.0}
    bars, label = np.nan_to_num(decoding.hit_rate_sd), CODE_LABELS[decoding.code]
    axes.errorbar(_places(found)[1:], decoding.hit_rate, bars, label=label, **marks)
    for fit in (side.fit for side in decoding.curves if side.fit):
        curve, threshold = fit.curve, fit.threshold
        fill_band(axes, curve.level, curve.low, curve.high, color, 0.15)
        axes.plot(curve.level, curve.proportion, color=color, linestyle=line, linewidth=1.5)
        dotted: Any = {"color": color, "linewidth": 0.9, "linestyle": ":"}
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


CAPTION_STATISTICS = (
    "Statistic of the code for each stimulus: mean and standard deviation over noisy presentations, "
    "noise σ₁ = {noise.sigma}. Diamond and grey band: the standard, "
    "whose distance is that between presentations of its own."
)


@figure("discriminate", "Results", 2, "statistics", "Statistics of the codes", CAPTION_STATISTICS)
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


def caption_task_responses(found: TaskResult) -> str:
    main, n_stimuli = main_decoding(found), len(found.stimulus)
    left_out = n_stimuli - len(_shown(n_stimuli))
    return (
        f"{MEASURE_LABELS[main.measure][0].capitalize()} of {found.population.n_receptors} afferents "
        "without noise, the distal end on the right; below, the difference from the standard, "
        "by the area of triangles."
        + (f" {left_out} of the comparisons are left out here." if left_out else "")
    )


@figure(
    "discriminate", "Results", 3, "responses", "Responses of the population", caption_task_responses,
    tables=task_tables,
)  # fmt: skip
def draw_task_responses(found: TaskResult) -> Figure:
    measure = main_decoding(found).measure
    what, _, unit = MEASURE_LABELS[measure]
    responses, places = found.responses[measure], found.population.positions_mm[:, [0, -1]]
    # Marks are so small that many of them do not cover each other.
    shown, size = _shown(len(responses)), float(np.clip(2500.0 / len(places), 4.0, 140.0))
    low, high = places.min(axis=0) - MARGIN_MM, places.max(axis=0) + MARGIN_MM
    along, across = high - low
    height = float(np.clip(8.0 / len(shown) * across / along, 0.5, 4.0))
    drawn = new_figure(10.0, 2.0 * height + 1.4)
    grid = drawn.subplots(2, len(shown), sharex=True, sharey=True, squeeze=False)
    largest = float(np.nanmax(np.abs(responses[shown] - responses[0])))
    dots: Any = {"cmap": "viridis", "vmin": np.nanmin(responses), "vmax": np.nanmax(responses)}
    dots |= {"s": size, "edgecolors": GREY, "linewidths": 0.5}
    for (axes, beneath), row in zip(grid.T, shown, strict=True):
        picture = axes.scatter(*places.T, c=responses[row], **dots)
        axes.set_title(found.stimulus[row] if row else f"{found.stimulus[0]}, standard")
        difference = responses[row] - responses[0]
        area = size * np.abs(np.nan_to_num(difference)) / (largest or 1.0)
        for sign, marker, colour in ((1.0, "^", ORANGE), (-1.0, "v", BLUE)) if row else ():
            there = sign * difference > 0.0
            beneath.scatter(*places[there].T, s=area[there], marker=marker, color=colour)
    grid[1, 0].set_axis_off()
    text = f"less the standard:\n▲ more, ▼ less,\nlargest {number(largest)} {unit}"
    grid[1, 0].text(0.5, 0.5, text, ha="center", va="center", transform=grid[1, 0].transAxes)
    for axes in grid.flat:
        axes.set(xlim=(low[0], high[0]), ylim=(low[1], high[1]), aspect="equal", facecolor=PALE)
    for axes in (grid[0, 0], grid[1, 1]):
        axes.set_ylabel(MAP_AXES["ylabel"])
        axes.tick_params(labelleft=True)
    for axes in (grid[0, 0], *grid[1, 1:]):
        axes.set_xlabel(MAP_AXES["xlabel"])
        axes.tick_params(labelbottom=True)
    drawn.colorbar(picture, ax=grid, label=f"{what} [{unit}]", shrink=0.8)
    return drawn


def main_decoding(found: TaskResult) -> Decoding:
    return next(decoding for decoding in found.decodings if decoding.hit_rate is not None)


def titled(decoding: Decoding) -> str:
    return f"{CODE_LABELS[decoding.code]}, {MEASURE_LABELS[decoding.measure][0]}"


def why_silent(decoding: Decoding) -> str:
    return f"silent under {', '.join(decoding.silent[:3])}"


def _shown(n_stimuli: int) -> list[int]:
    """Rows of the stimuli to draw: all, or the first, the last and some between."""
    return [round(row) for row in np.linspace(0, n_stimuli - 1, min(n_stimuli, MOST_MAPS))]


def _places(found: TaskResult) -> FloatArray:
    """Where each stimulus stands along an axis; side by side if that place has no meaning."""
    return np.arange(len(found.stimulus), dtype=np.float64) if found.level is None else found.level


def _name_axis(axes: Axes, found: TaskResult) -> None:
    if found.level is None:
        axes.set_xticks(_places(found), found.stimulus, rotation=30, ha="right")
    axes.set_xlabel("stimulus" if found.level is None else found.axis)
