"""The page of every result and its summary; the figure of a validation."""

from __future__ import annotations

from pathlib import Path
from typing import Any

import numpy as np
from matplotlib.figure import Figure

from fingerpad.experiments.discrimination.analysis import ForcedChoice, SideCurve, TaskResult
from fingerpad.experiments.validation.observations import KINDS
from fingerpad.experiments.validation.validation import Prediction, ValidationFile
from fingerpad.report import nerve, percept, reproduction, skin
from fingerpad.report.page import DRAW, PAGES, ROWS, Page, Rows, enter, holds, result_page, write_html
from fingerpad.report.percept import CODE_LABELS, MEASURE_LABELS, main_decoding
from fingerpad.report.style import BLACK, BLUE, GREY, ORANGE, new_figure, say_nothing_to_draw
from fingerpad.report.tables import filled, joined, number, percent, plain, span

LEVELS = (skin, nerve, percept, reproduction)  # To load them enters their figures and tables.


def write_page(page: str, found: Any, folder: Path) -> Path:
    """Write the page of a result, such as `fit.html`, and its figures; return its path."""
    return write_html(page_of(page, found), Path(folder) / f"{PAGES[page].get('file', page)}.html")


def page_of(page: str, found: Any) -> Page:
    return result_page(page, found, summary(page, found))


def summary(page: str, found: Any) -> list[str]:
    """Return a few sentences on a result: those of its page, which commands print, too."""
    rows = PAGES[page].get("summary", ())
    said = [filled(row["text"], found) for row in rows if holds(row, found)]
    if page == "discriminate":
        said += task_sentences(found.discrimination)
    if page == "validate":
        reasons = [row.reason for row in found.predictions if row.reason]
        failed = f"{found.n_rows - found.n_predicted} row(s) have no prediction. The first reason: "
        said += [failed + reason for reason in reasons[:1]]
    return said


def task_sentences(found: TaskResult) -> list[str]:
    """Summarise a task: hit rates of the main decoding, and its thresholds."""
    main, noise = main_decoding(found), found.noise
    assert main.hit_rate is not None
    standard, *others = found.stimulus
    rates = [
        f"{name} from {standard} in {percent(rate)}" for name, rate in zip(others, main.hit_rate, strict=True)
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
    rate, low, high = (percent(share) for share in choice.proportions[:, 0])
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
    share = f", {percent(threshold.over_standard)} of it" if threshold.over_standard else ""
    return (
        f"{percent(threshold.proportion)} are reached {number(threshold.difference)} {side.side} the "
        f"standard, at {number(threshold.level)} ({found.axis}){share}; 95 % credible interval "
        f"{span(threshold.posterior_interval)} with {number(side.fit.trials)} trials per comparison."
    )


LONGEST_TABLE = 200  # Conditions that the page lists; validate.json has all rows.
# What was observed, by its unit.
QUANTITIES = {"N": "force", "mm": "deflection", "spikes/s": "firing rate", "mm²": "area", "": "strain"}


@enter(ROWS, "conditions")
def rows_of_conditions(results: ValidationFile) -> Rows:
    """Return every condition with its observations."""
    names = KINDS[results.kind].conditions
    conditions: dict[tuple[object, ...], list[Prediction]] = {}
    for row in results.predictions:
        conditions.setdefault(tuple(getattr(row, name) for name in names), []).append(row)
    rows = []
    for given, same in list(conditions.items())[:LONGEST_TABLE]:
        observed = span(dict.fromkeys((same[0].observed_low, same[0].observed_high)))
        known = len(same), observed, same[0].predicted, same[0].inside_range, same[0].reason or ""
        rows.append((plain(dict(zip(names, given, strict=True))), *map(plain, known)))
    return rows


@enter(DRAW, "validation")
def draw_validation(results: ValidationFile) -> Figure:
    figure = new_figure(6.5, 5.5)
    axes = figure.subplots()
    shown = [row for row in results.predictions if np.isfinite(row.predicted)]
    if not shown:
        say_nothing_to_draw(axes, "no prediction")
        return figure
    quantity = QUANTITIES[results.unit]
    predicted = np.array([row.predicted for row in shown])
    low, high = (np.array([getattr(row, f"observed_{end}") for row in shown]) for end in ("low", "high"))
    outside = np.array([row.inside_range is False for row in shown])
    axes.axline((0.0, 0.0), slope=1.0, color=GREY, linewidth=1.0, label="observed as predicted")
    if np.isfinite(results.gain):
        axes.axline((0.0, 0.0), slope=results.gain, color=GREY, linestyle=":", label="after the gain")
    ranges = {BLUE: (~outside, "range of a condition"), ORANGE: (outside, "range without its prediction")}
    for colour, (rows, label) in ranges.items():
        if (high - low)[rows].any():
            axes.vlines(predicted[rows], low[rows], high[rows], color=colour, label=label)
    observed = [row.observed for row in shown]
    axes.plot(predicted, observed, "o", color=BLACK, markerfacecolor="none", markersize=5, label="observed")
    ends = np.array([*predicted, *low, *high])
    margin = 0.05 * (float(np.ptp(ends)) or 1.0)
    limits = (ends.min() - margin, ends.max() + margin)
    labels = (f"{side} {quantity} [{results.unit}]" for side in ("predicted", "observed"))
    axes.set(xlim=limits, ylim=limits, xlabel=next(labels), ylabel=next(labels))
    figure.legend(*axes.get_legend_handles_labels(), loc="outside lower center", ncols=3)
    return figure
