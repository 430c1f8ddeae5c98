"""The page of `python -m studies methods`: start points and units, methods of fitting, and their limits."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from functools import partial

import numpy as np
from matplotlib.figure import Figure

from fingerpad.data import paper
from fingerpad.report.formatting import fixed, number, plain, whole_percent
from fingerpad.report.manifest import edition, manifest_chapter
from fingerpad.report.parts import Chapter, Drawing, Page, Row, Table
from fingerpad.report.style import BLACK, BLUE, ORANGE, new_figure, numbers
from studies.fit_methods import Ceiling, FitMethods, MethodRow, MethodsStudy, ModelRow
from studies.fit_starts import FitStarts, ScaledStarts, Session, UnitOfDrive

PLACES = {
    "dynamic_flat": "ramp, flat face over the receptor",
    "dynamic_elsewhere": "ramp, elsewhere",
    "static_flat": "hold, flat face over the receptor",
    "static_elsewhere": "hold, elsewhere",
}
CEILINGS = {
    "symmetric": "any prediction that is the same on both sides",
    "rising": "any rate that rises with strain energy density",
}


def draw(section: FitMethods) -> Figure:
    """Draw how well each method fits and predicts, fold by fold, and what it takes.

    Parameters
    ----------
    section : FitMethods
        From `studies.fit_methods.result`.

    Returns
    -------
    Figure
    """
    rows = section.methods
    figure = new_figure(10.0, 1.8 + 0.62 * len(rows))
    scores, effort = figure.subplots(1, 2, sharey=True, width_ratios=(2.2, 1.0))
    kinds = {
        "fitted to": ("fss_train", "fss_training_mean", "s", ORANGE, ORANGE, -0.14),
        "left out": ("fss_test", "fss_out_of_sample", "o", BLACK, "white", 0.14),
    }
    for label, (folds, mean, marker, edge, face, side) in kinds.items():
        for height, row in enumerate(rows):
            values = numbers(getattr(row, folds))
            scores.plot(
                values,
                np.full(values.size, height + side),
                marker,
                color=edge,
                markerfacecolor=face,
                markersize=5.5,
                linestyle="none",
                label=f"positions {label}, one mark per fold" if height == 0 else None,
            )
            scores.vlines(
                numbers(getattr(row, mean)),
                height + side - 0.12,
                height + side + 0.12,
                color=edge,
                linewidth=2.4,
                label=f"positions {label}, mean" if height == 0 else None,
            )
    names = [f"{row.method}\n({plain(row.free_numbers)} numbers)" for row in rows]
    scores.set_yticks(range(len(rows)), names)
    scores.set_ylim(len(rows) - 0.5, -0.5)
    scores.set_xlabel("FSS [1]")
    scores.set_title("(a) score")
    effort.barh(range(len(rows)), numbers([row.runs for row in rows]), 0.5, color=BLUE)
    effort.locator_params(axis="x", nbins=4)
    effort.set_xlabel("runs of the model, all folds [1]")
    effort.set_title("(b) effort")
    figure.legend(*scores.get_legend_handles_labels(), loc="outside lower center", ncols=2)
    return figure


def caption(section: FitMethods) -> str:
    """Say how far the methods lie apart."""
    rows = section.methods
    means = [row.fss_out_of_sample for row in rows]
    folds = [fold for row in rows for fold in row.fss_test]
    apart, spread = max(means) - min(means), max(folds) - min(folds)
    more = (
        ": which positions are left out matters more than how the others are fitted" if spread > apart else ""
    )
    return (
        "Methods of fitting one afferent on the same folds. (a) Fractional sum of squares (FSS) on the "
        "positions that a fold was fitted to, and on those that it left out. (b) How often each ran the "
        "model in all folds; times are in the benchmarks. The methods' means lie within "
        f"{fixed(apart, 3)} of each other out of sample, the folds within {fixed(spread, 2)}{more}."
    )


def start_tables(starts: FitStarts) -> list[Table]:
    """Return the printed gains in each unit, the first start rescaled, and the paper's session."""
    return [_units(starts.units), _scales(starts.scales), _sessions(starts.sessions)]


def method_tables(found: FitMethods) -> list[Table]:
    """Return methods, models and what limits them."""
    return [_methods(found.methods), _models(found), _ceilings(found.ceilings), _residuals(found.models)]


def methods_page(result: MethodsStudy) -> Page:
    """Return the page of `python -m studies methods`."""
    drawing = Drawing("methods", "Methods of fitting", partial(draw, result.methods), caption(result.methods))
    return Page(
        "Methods of fitting one afferent",
        f"Start points, methods and models on the rates under the bar. {edition(result.manifest)}.",
        [],
        [
            Chapter("Start points", start_tables(result.starts)),
            Chapter("Methods and models", [drawing, *method_tables(result.methods)]),
            manifest_chapter(result.manifest),
        ],
    )


def _units(rows: Sequence[UnitOfDrive]) -> Table:
    cells = [
        Row(
            (
                f"{row.quantity} in {row.unit}",
                *(
                    text
                    for start in (row.start_1, row.start_2)
                    for text in (
                        fixed(start.fss, 2),
                        number(start.largest_dynamic_hz),
                        number(start.largest_static_hz),
                    )
                ),
            )
        )
        for row in rows
    ]
    words = ("FSS", "largest dynamic", "largest static")
    columns = ("drive", *(f"start {start}: {what}" for start in (1, 2) for what in words))
    note = "Rates in spikes/s; the observed reach 210 in the ramp and 61 in the hold. Silence has FSS 0."
    return Table("The printed gains, read in several units", columns, cells, note)


def _scales(found: ScaledStarts) -> Table:
    rows = [
        Row((number(scale), *(fixed(fss, 2) for fss in row)))
        for scale, row in zip(found.energy_scale, found.fss_start_1, strict=True)
    ]
    columns = (
        "factor on energy density",
        *(f"k_d times {number(ratio)}" for ratio in found.dynamic_ratio),
    )
    note = "FSS over all positions, without any fit."
    return Table("The first start, its gains rescaled", columns, rows, note)


def _sessions(rows: Sequence[Session]) -> Table:
    keys = ("fss_start", "fss_train", "fss_test")
    cells = [
        Row(
            (
                row.start,
                number(row.static_scale),
                number(row.dynamic_scale),
                *(fixed(getattr(row, key), 3) for key in keys),
                plain(row.iterations),
            )
        )
        for row in rows
    ]
    printed = (
        paper.FOLD_3_FSS_START,
        paper.FOLD_3_FSS_FITTED,
        paper.FOLD_3_FSS_TEST,
        paper.FOLD_3_ITERATIONS,
    )
    cells.append(Row(("the paper", "", "", *(number(value.value) for value in printed)), "final"))
    columns = (
        "start", "k_s times", "k_d times", "FSS at the start", "FSS, training", "FSS, testing", "iterations",
    )  # fmt: skip
    return Table("The paper's session: fold 3, start 2", columns, cells)


def _methods(rows: Sequence[MethodRow]) -> Table:
    keys = ("fss_in_sample", "fss_training_mean", "fss_out_of_sample")
    cells = [
        Row(
            (
                row.method,
                plain(row.free_numbers),
                *(fixed(getattr(row, key), 3) for key in keys),
                " ".join(fixed(fold, 2) for fold in row.fss_test),
                plain(row.runs),
            )
        )
        for row in rows
    ]
    columns = (
        "method", "free numbers", "FSS, all positions", "FSS, training", "FSS, testing", "testing, by fold",
        "runs",
    )  # fmt: skip
    note = "Runs of the model in all six folds. The times are in the benchmarks."
    return Table("Methods of fitting on the same folds", columns, cells, note)


def _models(found: FitMethods) -> Table:
    keys = ("fss_in_sample_dynamic", "fss_in_sample_static", "fss_in_sample", "fss_out_of_sample")
    cells = [
        Row(
            (
                row.model,
                *(fixed(getattr(row, key), 3) for key in keys),
                number(row.parameters.get("offset_mm")),
            )
        )
        for row in found.models
    ]
    columns = (
        "model", "FSS dynamic", "FSS static", "FSS, all positions", "FSS, testing", "receptor's offset [mm]",
    )  # fmt: skip
    note = f"All fitted by {found.models_fitted_by}. The last is an extension of the paper's model."
    return Table("What the model lacks", columns, cells, note)


def _ceilings(found: Mapping[str, Ceiling]) -> Table:
    keys = ("dynamic", "static", "weighted")
    rows = [
        Row((words, *(fixed(getattr(found[family], key), 3) for key in keys)))
        for family, words in CEILINGS.items()
    ]
    return Table("What could be reached", ("best FSS of", "dynamic", "static", "weighted 1:3"), rows)


def _residuals(rows: Sequence[ModelRow]) -> Table:
    cells = [
        Row(
            (
                row.model,
                fixed(1.0 - row.fss_in_sample, 3),
                *(whole_percent(row.residual_share[place]) for place in PLACES),
            )
        )
        for row in rows
    ]
    return Table("Where the residual lies", ("model", "1 − FSS", *PLACES.values()), cells)
