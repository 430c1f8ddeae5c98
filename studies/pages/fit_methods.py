"""Level 2, beyond the paper: starts and units, methods of fitting, and what limits them."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from typing import Any

import numpy as np
from matplotlib.figure import Figure

from fingerpad.data import paper
from fingerpad.report.formatting import ABSENT, fixed, number, plain, whole_percent
from fingerpad.report.parts import Row, Table
from fingerpad.report.style import BLACK, BLUE, ORANGE, new_figure, numbers

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


def draw(section: Mapping[str, Any]) -> Figure:
    """Draw how well each method fits and predicts, fold by fold, and what it takes.

    Parameters
    ----------
    section : mapping
        `results["single_unit"]["methods"]`.

    Returns
    -------
    Figure
    """
    rows = section["methods"]
    figure = new_figure(10.0, 1.8 + 0.62 * len(rows))
    scores, effort = figure.subplots(1, 2, sharey=True, width_ratios=(2.2, 1.0))
    kinds = {
        "fitted to": ("fss_train", "fss_training_mean", "s", ORANGE, ORANGE, -0.14),
        "left out": ("fss_test", "fss_out_of_sample", "o", BLACK, "white", 0.14),
    }
    for label, (folds, mean, marker, edge, face, side) in kinds.items():
        for height, row in enumerate(rows):
            values = numbers(row[folds])
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
                numbers(row[mean]),
                height + side - 0.12,
                height + side + 0.12,
                color=edge,
                linewidth=2.4,
                label=f"positions {label}, mean" if height == 0 else None,
            )
    names = [f"{row['method']}\n({plain(row['free_numbers'])} numbers)" for row in rows]
    scores.set_yticks(range(len(rows)), names)
    scores.set_ylim(len(rows) - 0.5, -0.5)
    scores.set_xlabel("FSS [1]")
    scores.set_title("(a) score")
    effort.barh(range(len(rows)), numbers([row["runs"] for row in rows]), 0.5, color=BLUE)
    effort.locator_params(axis="x", nbins=4)
    effort.set_xlabel("runs of the model, all folds [1]")
    effort.set_title("(b) effort")
    figure.legend(*scores.get_legend_handles_labels(), loc="outside lower center", ncols=2)
    return figure


def caption(section: Mapping[str, Any]) -> str:
    """Say how far the methods lie apart."""
    rows = section["methods"]
    means = [row["fss_out_of_sample"] for row in rows]
    known = [mean for mean in means if mean is not None]
    apart = max(known) - min(known) if known else None
    folds = [fold for row in rows for fold in row["fss_test"] if fold is not None]
    spread = max(folds) - min(folds) if folds else None
    more = (
        ": which positions are left out matters more than how the others are fitted"
        if apart is not None and spread is not None and spread > apart
        else ""
    )
    return (
        "Methods of fitting one afferent on the same folds. (a) Fractional sum of squares (FSS) on the "
        "positions that a fold was fitted to, and on those that it left out. (b) How often each ran the "
        "model in all folds; times are in the benchmarks. The methods' means lie within "
        f"{fixed(apart, 3)} of each other out of sample, the folds within {fixed(spread, 2)}{more}."
    )


def tables(section: Mapping[str, Any]) -> list[Table]:
    """Return the tables of the starts, the methods and the limits, as far as the results have them.

    Parameters
    ----------
    section : mapping
        `results["single_unit"]`.

    Returns
    -------
    list of Table
    """
    made: list[Table] = []
    if section.get("starts"):
        starts = section["starts"]
        made += [_units(starts["units"]), _scales(starts["scales"]), _sessions(starts["sessions"])]
    if section.get("methods"):
        found = section["methods"]
        made += [_methods(found["methods"]), _models(found), _ceilings(found["ceilings"])]
        made.append(_residuals(found["models"]))
    return made


def _units(rows: Sequence[Mapping[str, Any]]) -> Table:
    cells = [
        Row(
            (
                f"{row['quantity']} in {row['unit']}",
                *(
                    text
                    for start in ("start_1", "start_2")
                    for text in (
                        fixed(row[start]["fss"], 2),
                        number(row[start]["largest_dynamic_hz"]),
                        number(row[start]["largest_static_hz"]),
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


def _scales(found: Mapping[str, Any]) -> Table:
    rows = [
        Row((number(scale), *(fixed(fss, 2) for fss in row)))
        for scale, row in zip(found["energy_scale"], found["fss_start_1"], strict=True)
    ]
    columns = (
        "factor on energy density",
        *(f"k_d times {number(ratio)}" for ratio in found["dynamic_ratio"]),
    )
    note = "FSS over all positions, without any fit."
    return Table("The first start, its gains rescaled", columns, rows, note)


def _sessions(rows: Sequence[Mapping[str, Any]]) -> Table:
    keys = ("fss_start", "fss_train", "fss_test")
    cells = [
        Row(
            (
                row["start"],
                number(row["static_scale"]),
                number(row["dynamic_scale"]),
                *(fixed(row[key], 3) for key in keys),
                plain(row["iterations"]),
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


def _methods(rows: Sequence[Mapping[str, Any]]) -> Table:
    keys = ("fss_in_sample", "fss_training_mean", "fss_out_of_sample")
    cells = [
        Row(
            (
                row["method"],
                plain(row["free_numbers"]),
                *(fixed(row[key], 3) for key in keys),
                " ".join(fixed(fold, 2) for fold in row["fss_test"]),
                plain(row["runs"]),
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


def _models(found: Mapping[str, Any]) -> Table:
    keys = ("fss_in_sample_dynamic", "fss_in_sample_static", "fss_in_sample", "fss_out_of_sample")
    cells = [
        Row((row["model"], *(fixed(row[key], 3) for key in keys), number(row["parameters"].get("offset_mm"))))
        for row in found["models"]
    ]
    columns = (
        "model", "FSS dynamic", "FSS static", "FSS, all positions", "FSS, testing", "receptor's offset [mm]",
    )  # fmt: skip
    note = f"All fitted by {found['models_fitted_by']}. The last is an extension of the paper's model."
    return Table("What the model lacks", columns, cells, note)


def _ceilings(found: Mapping[str, Mapping[str, float]]) -> Table:
    keys = ("dynamic", "static", "weighted")
    rows = [
        Row((words, *(fixed(found[family][key], 3) for key in keys))) for family, words in CEILINGS.items()
    ]
    return Table("What could be reached", ("best FSS of", "dynamic", "static", "weighted 1:3"), rows)


def _residuals(rows: Sequence[Mapping[str, Any]]) -> Table:
    cells = [
        Row(
            (
                row["model"],
                ABSENT if row["fss_in_sample"] is None else fixed(1.0 - row["fss_in_sample"], 3),
                *(whole_percent(row["residual_share"][place]) for place in PLACES),
            )
        )
        for row in rows
    ]
    return Table("Where the residual lies", ("model", "1 − FSS", *PLACES.values()), cells)
