"""The page of a discrimination task: thresholds, hit rates, efficiencies and their figures."""

from __future__ import annotations

import math
from collections.abc import Sequence
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
from fingerpad.report.formatting import ABSENT, fixed, joined, number, whole_percent
from fingerpad.report.parts import (
    Chapter,
    Page,
    Row,
    Table,
    edition,
    illustrated,
    listed,
    manifest_chapter,
    write_html,
)
from fingerpad.report.responses import MAP_AXES
from fingerpad.report.style import (
    BLACK,
    BLUE,
    GREEN,
    GREY,
    ORANGE,
    PALE,
    PEOPLE,
    new_figure,
    say_nothing_to_draw,
    shared_legend,
)

SEVERAL = {"static": "static rates", "dynamic": "dynamic rates", "latency": "first-spike latencies"}


def task_tables(found: TaskResult) -> list[Table]:
    every = (_thresholds, _hit_rates, _forced_choices, _efficiencies, _population)
    return [table for make in every if (table := make(found)).rows]


def write_task_page(results: DiscriminationFile, folder: Path) -> Path:
    found = results.discrimination
    parts = illustrated(
        found,
        task_tables,
        (1, "curves", "Hit rates and psychometric curves", draw_task_curves, caption_task_curves),
        (2, "statistics", "Statistics of the codes", draw_task_statistics, caption_task_statistics),
        (3, "responses", "Responses of the population", draw_task_responses, caption_task_responses),
    )
    page = Page(
        found.question,
        "A finite-element fingertip, a population of slowly adapting afferents and an observer, "
        f"after Gerling et al. 2014. {edition(results.manifest)}",
        task_summary(found),
        [Chapter("Results", parts), manifest_chapter(results.manifest)],
    )
    return write_html(page, Path(folder) / "discriminate.html")


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
    sentence = (
        f"{CODE_LABELS[main.code]} of {SEVERAL[main.measure]} discriminates {joined(rates)} of trials{of}, "
        f"with noise σ₁ = {number(noise.sigma)}{fitted}."
    )
    choice = main.forced_choice
    answers = [_forced_choice_sentence(found, choice)] if choice and len(others) == 1 else []
    return [sentence, *answers, *(_threshold_sentence(found, side) for side in main.curves)]


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
        f"{_interval(threshold.posterior_interval)} with {number(side.fit.trials)} trials per comparison."
    )


def _with_error(value: float, error: float) -> str:
    return ABSENT if math.isnan(value) else f"{fixed(value, 3)} ± {fixed(error, 3)}"


def _interval(ends: Sequence[float] | None) -> str:
    return ABSENT if ends is None else " … ".join(number(end) for end in ends)


def _thresholds(found: TaskResult) -> Table:
    rows = [
        Row.of(titled(decoding), side.side, *_threshold_cells(side))
        for decoding in found.decodings
        for side in decoding.curves
    ]
    columns = (
        "decoding", "side", f"threshold, {found.axis}", "difference", "95 % credible",
        "95 %, bootstrap", "of the standard", "slope",
    )  # fmt: skip
    note = (
        "Difference: from the standard to the threshold. Intervals: of an experiment with the trials per "
        "comparison of the task. Slope: of the hit rate at the threshold, per unit. Where bootstrap "
        "and slope are missing, the curve rises between two comparisons: add some between them."
    )
    return Table("Thresholds", columns, rows, note)


def _threshold_cells(side: SideCurve) -> tuple[str, ...]:
    if side.fit is None:
        return (side.why_not or "", "", "", "", "", "")
    threshold = side.fit.threshold
    share = threshold.over_standard
    return (
        number(threshold.level),
        number(threshold.difference),
        _interval(threshold.posterior_interval),
        _interval(threshold.bootstrap_interval),
        ABSENT if share is None else whole_percent(share),
        ABSENT if math.isnan(side.fit.slope) else number(side.fit.slope),
    )


def _hit_rates(found: TaskResult) -> Table:
    rows = [
        Row.of(titled(decoding), *map(_with_error, decoding.hit_rate, decoding.hit_rate_sd))
        for decoding in found.decodings
        if decoding.hit_rate is not None and decoding.hit_rate_sd is not None
    ]
    silent = [
        f"{titled(decoding)}: none, the population is {why_silent(decoding)}"
        for decoding in found.decodings
        if decoding.hit_rate is None
    ]
    columns = ("decoding", *found.stimulus[1:])
    return Table("Hit rates, mean ± standard deviation", columns, rows, "; ".join(silent))


def _forced_choices(found: TaskResult) -> Table:
    rows = []
    for decoding in found.decodings:
        if decoding.forced_choice is None:
            continue
        shares, d_primes = decoding.forced_choice.proportions.T, decoding.forced_choice.d_primes.T
        for name, share, d_prime in zip(found.stimulus[1:], shares, d_primes, strict=True):
            within = (" … ".join(fixed(end, 3) for end in share[1:]), _interval(d_prime[1:]))
            cells = (fixed(share[0], 3), within[0], number(d_prime[0]), within[1])
            rows.append(Row.of(titled(decoding), name, *cells))
    columns = ("decoding", "comparison", "proportion correct", "95 %", "d′", "95 %")
    note = (
        "Each trial presents the standard and the comparison once. Intervals: exact, of an experiment with "
        "the trials per comparison of the task. A dash where d′ is infinite."
    )
    return Table("Two-alternative forced choice", columns, rows, note)


def _efficiencies(found: TaskResult) -> Table:
    rows = [
        Row.of(titled(decoding), *map(_with_error, decoding.efficiency, decoding.efficiency_error))
        for decoding in found.decodings
        if decoding.efficiency is not None and decoding.efficiency_error is not None
    ]
    note = (
        "The share of its trials that the ideal observer needs to perform as the code does; a dash where d' "
        "of the ideal observer is not known well enough or infinite."
    )
    return Table("Efficiency ± standard error", ("decoding", *found.stimulus[1:]), rows, note)


def _population(found: TaskResult) -> Table:
    population = found.population
    facts = {
        "layout": population.layout,
        "receptors": number(population.n_receptors),
        "pitch [mm]": number(population.pitch_mm),
        "density [1/cm²]": number(population.density_per_cm2),
        "sensitivity": ABSENT
        if population.sensitivity is None
        else f"{number(population.sensitivity.min())} … {number(population.sensitivity.max())}",
    }
    return listed("The population", facts)


_CHANCE = 0.5
MOST_MAPS = 4  # Stimuli in the figure of responses: the standard, and comparisons from the first to the last.
MARGIN_MM = 0.6  # About the outermost afferents of a map. [mm]
CODE_LABELS = {"gradient_sum": "Gradient Sum", "euclidean": "Euclidean Distance", "ideal": "ideal observer"}
MEASURE_LABELS = {
    "static": ("static rate", "spikes/s"),
    "dynamic": ("dynamic rate", "spikes/s"),
    "latency": ("first-spike latency", "ms"),
}
_STYLES = (
    (BLUE, "o", "-"),
    (ORANGE, "s", (0, (6, 2))),
    (GREEN, "^", (0, (2, 1.5))),
    (GREY, "v", (0, (1, 1.5))),
)


def draw_task_responses(found: TaskResult) -> Figure:
    """Draw the responses to the standard and to comparisons, seen from the volar side."""
    measure = main_decoding(found).measure
    what, unit = MEASURE_LABELS[measure]
    responses, places = found.responses[measure], found.population.positions_mm[:, [0, -1]]
    shown, size = _shown(len(responses)), _marker_size(len(places))
    low, high = places.min(axis=0) - MARGIN_MM, places.max(axis=0) + MARGIN_MM
    along, across = high - low
    height = float(np.clip(8.0 / len(shown) * across / along, 0.5, 4.0))
    figure = new_figure(10.0, 2.0 * height + 1.4)
    grid = figure.subplots(2, len(shown), sharex=True, sharey=True, squeeze=False)
    largest = float(np.nanmax(np.abs(responses[shown] - responses[0])))
    colours: Any = {"cmap": "viridis", "vmin": np.nanmin(responses), "vmax": np.nanmax(responses)}
    for (axes, beneath), row in zip(grid.T, shown, strict=True):
        name = found.stimulus[row]
        picture = axes.scatter(
            places[:, 0], places[:, 1], c=responses[row], s=size, edgecolors=GREY, linewidths=0.5, **colours
        )
        axes.set_title(f"{name}, standard" if row == 0 else name)
        if row:
            _differences(beneath, places, responses[row] - responses[0], largest)
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
    figure.colorbar(picture, ax=grid, label=f"{what} [{unit}]", shrink=0.8)
    return figure


def _differences(axes: Axes, places: FloatArray, difference: FloatArray, largest: float) -> None:
    """Draw upright triangles where there is more, hanging ones where there is less, by area."""
    size = _marker_size(len(places)) * np.abs(np.nan_to_num(difference)) / (largest or 1.0)
    for sign, marker, colour in ((1.0, "^", ORANGE), (-1.0, "v", BLUE)):
        there = sign * difference > 0.0
        axes.scatter(places[there, 0], places[there, 1], s=size[there], marker=marker, color=colour)


def draw_task_statistics(found: TaskResult) -> Figure:
    """Draw the statistic of each code for every stimulus: mean and spread over noisy presentations."""
    decodings = [decoding for decoding in found.decodings if decoding.code != "ideal"]
    codes = list(dict.fromkeys(decoding.code for decoding in decodings))
    measures = list(dict.fromkeys(decoding.measure for decoding in decodings))
    figure = new_figure(min(10.0, 4.0 * len(codes) + 1.5), 3.0 * len(measures) + 0.3)
    grid = figure.subplots(len(measures), len(codes), squeeze=False)
    for axes, decoding in zip(grid.flat, decodings, strict=True):
        axes.set_title(titled(decoding))
        if decoding.statistic is None:
            say_nothing_to_draw(axes, why_silent(decoding))
            continue
        where = _places(found)
        mean, spread = decoding.statistic.mean, decoding.statistic.sd
        axes.axhspan(mean[0] - spread[0], mean[0] + spread[0], color=GREY, alpha=0.25, linewidth=0.0)
        axes.errorbar(where, mean, spread, fmt="o", color=BLUE, markersize=4.5, capsize=3.0, elinewidth=1.2)
        axes.plot(where[0], mean[0], "D", color=BLACK, markersize=6.5, zorder=4)
        axes.set_ylabel(f"{CODE_LABELS[decoding.code]} [{MEASURE_LABELS[decoding.measure][1]}]")
        _name_axis(axes, found)
    return figure


def draw_task_curves(found: TaskResult) -> Figure:
    """Draw hit rates, psychometric curves with their bands, and hit rates of people."""
    measures = list(dict.fromkeys(decoding.measure for decoding in found.decodings))
    figure = new_figure(min(10.0, 3.6 * len(measures) + 2.0), 4.6)
    grid = figure.subplots(1, len(measures), sharey=True, squeeze=False)
    for axes, measure in zip(grid[0], measures, strict=True):
        draw_curves_of_measure(axes, found, measure)
    for axes in grid[0, 1:]:
        axes.set_ylabel("")
    shared_legend(figure, grid[0], columns=4)
    return figure


def draw_curves_of_measure(axes: Axes, found: TaskResult, measure: str) -> None:
    """Draw what all codes make of one measure: hit rates and psychometric curves, and those of people."""
    of_measure = [decoding for decoding in found.decodings if decoding.measure == measure]
    axes.set_title(MEASURE_LABELS[measure][0])
    axes.axhline(_CHANCE, color=GREY, linewidth=1.0, linestyle=(0, (6, 3)))
    if all(decoding.hit_rate is None for decoding in of_measure):
        say_nothing_to_draw(axes, why_silent(of_measure[0]))
        return
    for decoding, style in zip(of_measure, _STYLES, strict=False):
        _curve(axes, found, decoding, style)
    _people(axes, found)
    _name_axis(axes, found)
    axes.set(ylim=(0.4, 1.03), ylabel="hit rate [fraction]")


def _curve(axes: Axes, found: TaskResult, decoding: Decoding, style: Any) -> None:
    if decoding.hit_rate is None or decoding.hit_rate_sd is None:
        return
    colour, marker, line = style
    where = _places(found)
    marks: Any = {"fmt": marker, "color": colour, "markersize": 5.0, "capsize": 3.0, "elinewidth": 1.0}
    bars = np.nan_to_num(decoding.hit_rate_sd)
    axes.errorbar(where[1:], decoding.hit_rate, bars, label=CODE_LABELS[decoding.code], **marks)
    for side in decoding.curves:
        if side.fit is None:
            continue
        curve, threshold = side.fit.curve, side.fit.threshold
        axes.fill_between(curve.level, curve.low, curve.high, color=colour, alpha=0.15, linewidth=0.0)
        axes.plot(curve.level, curve.proportion, color=colour, linestyle=line, linewidth=1.5)
        axes.plot(
            [threshold.level] * 2, [0.4, threshold.proportion], color=colour, linewidth=0.9, linestyle=":"
        )


def _people(axes: Axes, found: TaskResult) -> None:
    observed = found.observed
    points = {point.level: point for point in observed.points if point.level is not None} if observed else {}
    for level, point in points.items():
        if point.interval:
            axes.plot([level] * 2, point.interval, color=BLACK, linewidth=1.4, zorder=5)
    if observed and points:
        rates = [point.hit_rate for point in points.values()]
        axes.plot(list(points), rates, "D", label=f"observed ({observed.source})", **PEOPLE)


def caption_task_responses(found: TaskResult) -> str:
    main, n_stimuli = main_decoding(found), len(found.stimulus)
    left_out = n_stimuli - len(_shown(n_stimuli))
    return (
        f"{MEASURE_LABELS[main.measure][0].capitalize()} of {found.population.n_receptors} afferents "
        "without noise, the distal end on the right; below, the difference from the standard, "
        "by the area of triangles."
        + (f" {left_out} of the comparisons are left out here." if left_out else "")
    )


def caption_task_statistics(found: TaskResult) -> str:
    return (
        "Statistic of the code for each stimulus: mean and standard deviation over noisy presentations, "
        f"noise σ₁ = {number(found.noise.sigma)}. Diamond and grey band: the standard, "
        "whose distance is that between presentations of its own."
    )


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


def main_decoding(found: TaskResult) -> Decoding:
    return next(decoding for decoding in found.decodings if decoding.hit_rate is not None)


def titled(decoding: Decoding) -> str:
    return f"{CODE_LABELS[decoding.code]}, {MEASURE_LABELS[decoding.measure][0]}"


def why_silent(decoding: Decoding) -> str:
    return f"silent under {', '.join(decoding.silent[:3])}"


def _shown(n_stimuli: int) -> list[int]:
    """Rows of the stimuli to draw: all, or the first, the last and some between."""
    if n_stimuli <= MOST_MAPS:
        return list(range(n_stimuli))
    return [round(row) for row in np.linspace(0, n_stimuli - 1, MOST_MAPS)]


def _marker_size(count: int) -> float:
    """Area of a marker so that many of them do not cover each other. [points²]"""
    return float(np.clip(2500.0 / count, 4.0, 140.0))


def _places(found: TaskResult) -> FloatArray:
    """Where each stimulus stands along an axis; side by side if that place has no meaning."""
    return np.arange(len(found.stimulus), dtype=np.float64) if found.level is None else found.level


def _name_axis(axes: Axes, found: TaskResult) -> None:
    if found.level is None:
        axes.set_xticks(_places(found), found.stimulus, rotation=30, ha="right")
    axes.set_xlabel("stimulus" if found.level is None else found.axis)
