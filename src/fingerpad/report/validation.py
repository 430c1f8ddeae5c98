"""The page of a validation: observed against predicted values, scores, and every condition."""

from __future__ import annotations

from pathlib import Path

import numpy as np
from matplotlib.figure import Figure

from fingerpad.experiments.validation.observations import COLUMNS, KINDS
from fingerpad.experiments.validation.validation import Prediction, ValidationFile
from fingerpad.report.page import figure, write_result_page
from fingerpad.report.style import BLACK, BLUE, GREY, ORANGE, new_figure, say_nothing_to_draw
from fingerpad.report.tables import Column, Table, facts_table, fixed, listed, number, span, table

LONGEST_TABLE = 200  # Conditions that the page lists; validate.json has all rows.
QUANTITIES = {"N": "force", "mm": "deflection", "spikes/s": "firing rate"}  # What was observed, by its unit.


def write_validation_page(results: ValidationFile, folder: Path) -> Path:
    about = (
        f"Observations of the kind {results.kind}, predicted by a finite-element fingertip with the tissues "
        f"{results.tissues}."
    )
    title = f"Observed and predicted {QUANTITIES[results.unit]}"
    said = validation_summary(results)
    return write_result_page("validate", results, title, about, said, results.manifest, folder)


def validation_summary(results: ValidationFile) -> list[str]:
    said = [
        f"{results.kind}, {results.n_predicted} of {results.n_rows} rows predicted: R² "
        f"{fixed(results.r2, 3)}, {fixed(results.r2_after_gain, 3)} after a gain of {number(results.gain)}, "
        f"correlation {fixed(results.correlation, 3)}."
    ]
    if results.n_judged:
        count = round(results.share_inside * results.n_judged)
        said.append(f"Inside the observed range: {count} of {results.n_judged} conditions.")
    else:
        said.append("No condition has two observations, so no range can judge.")
    reasons = dict.fromkeys(row.reason for row in results.predictions if row.reason)
    if reasons:
        failed = results.n_rows - results.n_predicted
        said.append(f"{failed} row(s) have no prediction. The first reason: {next(iter(reasons))}")
    return said


def _tables(results: ValidationFile) -> list[Table]:
    """Return scores, every condition with its observations, and assumptions."""
    scores = {
        "R² of the predictions": results.r2,
        "R² after the gain": results.r2_after_gain,
        "R² with the other direction along the finger": results.r2_mirrored,
        "correlation": results.correlation,
        "gain": results.gain,
        "share of conditions inside their observed range": results.share_inside,
    }
    names = KINDS[results.kind].conditions
    conditions: dict[tuple[object, ...], list[Prediction]] = {}
    for row in results.predictions:
        conditions.setdefault(tuple(getattr(row, name) for name in names), []).append(row)
    columns = (
        *(Column(f"0.{name}", None if name in COLUMNS else name) for name in names),
        Column(len, "observations"),
        Column(lambda same: span(dict.fromkeys((same[0].observed_low, same[0].observed_high))), "observed"),
        Column("0.predicted", "predicted"),
        Column("0.inside_range", "inside"),
        Column(lambda same: same[0].reason or "", "why not predicted"),
    )
    shown = list(conditions.values())[:LONGEST_TABLE]
    left = len(conditions) - len(shown)
    note = f"{left} more are in validate.json." if left else ""
    assumed = ("loading", "ramp_ms", "hold_ms", "static_window_ms", "receptor_depth_mm", "afferent")
    return [
        listed("Scores", {name: value for name, value in scores.items() if np.isfinite(value)}),
        table(f"Conditions [{results.unit}]", shown, columns, note),
        facts_table("Assumptions", {name: getattr(results, name) for name in assumed}),
    ]


def caption_validation(results: ValidationFile) -> str:
    left_out = results.n_rows - results.n_predicted
    return (
        "Each observation over the prediction for its condition. Lines join the lowest and the highest "
        "observation of a condition. R² is computed about the solid line."
        + (f" {left_out} row(s) without a prediction are not drawn." if left_out else "")
    )


@figure(
    "validate", "Scores", 1, "validation", "Observed and predicted values", caption_validation, tables=_tables
)
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
