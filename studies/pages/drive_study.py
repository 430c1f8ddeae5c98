"""The page of `python -m studies drives`: quantities, explanations of the dynamic rates, and depths."""

from __future__ import annotations

from functools import partial
from itertools import pairwise

import numpy as np
from matplotlib.figure import Figure

from fingerpad.report.formatting import ABSENT, fixed
from fingerpad.report.manifest import edition
from fingerpad.report.parts import Chapter, Drawing, Page, Row, Table
from fingerpad.report.style import BLACK, BLUE, GREY, ORANGE, PALE, new_figure, numbers
from studies.drive_depths import DepthStudy, LayerFit
from studies.drive_study import DriveStudy, ExplanationFit
from studies.pages.drive_quantities import (
    caption_drive_quantities,
    draw_drive_quantities,
    drive_tables,
    gain,
)

_OUT_OF_SAMPLE = tuple(f"fss_out_of_sample{phase}" for phase in ("", "_dynamic", "_static"))
_EXPLANATION_COLUMNS = (
    "explanation",
    "free parameters",
    "added parameters",
    "FSS in sample",
    "out of sample",
    "dynamic",
    "static",
    "gain, 95 %",
    "ΔAIC",
    "ΔBIC",
)
_DEPTH_COLUMNS = (
    "tissue",
    "from [mm]",
    "to [mm]",
    "largest SED [kPa]",
    "FSS in sample",
    "out of sample",
    "dynamic",
    "static",
    "gain, 95 %",
)


def draw_explanations(section: DriveStudy) -> Figure:
    """Draw what each explanation predicts, and what it gains over the paper's model.

    Parameters
    ----------
    section : DriveStudy
        From `studies.drive_study.run`.

    Returns
    -------
    Figure
    """
    rows = section.explanations
    height = np.arange(len(rows))
    figure = new_figure(10.0, 1.4 + 0.32 * len(rows))
    scores, gains = figure.subplots(1, 2, sharey=True, width_ratios=(1.0, 1.0))
    for phase, (label, marker, colour) in {
        "": ("both, weighted", "o", BLACK),
        "_dynamic": ("dynamic rates", "s", ORANGE),
    }.items():
        values = numbers([getattr(row.fit, f"fss_out_of_sample{phase}") for row in rows])
        scores.plot(values, height, marker, color=colour, label=label, linestyle="none")
    scores.set_yticks(height, [f"{row.name} ({row.free_numbers})" for row in rows])
    scores.invert_yaxis()
    scores.set_xlabel("FSS out of sample [1]")
    scores.set_title("(a) out-of-sample fit")
    ends = numbers([row.fit.gain_interval for row in rows])
    total = numbers([row.fit.fss_out_of_sample for row in rows])
    gains.axvline(0.0, color=GREY, linewidth=1.0)
    gains.hlines(height, *ends.T, color=BLUE, linewidth=2.0)
    gains.plot(total - total[0], height, "o", color=BLACK)
    gains.locator_params(axis="x", nbins=5)
    gains.set_xlabel("gain in FSS out of sample over the first row [1]")
    gains.set_title("(b) gain, 95 % interval by bootstrap")
    figure.legend(*scores.get_legend_handles_labels(), loc="outside lower center", ncols=2)
    return figure


def caption_explanations(section: DriveStudy) -> str:
    """Describe the comparison, and count the explanations that are as good as the best one."""
    rows = section.explanations
    known = [row for row in rows if np.isfinite(row.aic_difference)]
    best = min(known, key=lambda row: row.aic_difference, default=None)
    near = [row for row in known if best and row.aic_difference - best.aic_difference <= NEAR_AIC]
    said = (
        f" Smallest AIC: {best.name}; {len(near) - 1} more lie within {NEAR_AIC:g} of it and cannot be "
        "discriminated by this recording."
        if best
        else ""
    )
    return (
        "Explanations of the dynamic rates, each with its number of free parameters (in brackets). (a) Mean "
        "FSS of the folds at positions that were not fitted. (b) Its gain over the paper's model, with an "
        f"interval from a bootstrap over blocks of three positions.{said}"
    )


NEAR_AIC = 4.0
"""Differences of AIC below which the worse of two models still has some support (Burnham & Anderson 2004)."""


def draw_depths(section: DriveStudy) -> Figure:
    """Draw the out-of-sample fit of the paper's model with energy density sampled at other depths.

    Parameters
    ----------
    section : DriveStudy
        As in `draw_explanations`.

    Returns
    -------
    Figure
    """
    found = section.depths
    layers = found.layers
    own = layers[found.own_layer]
    figure = new_figure(7.5, 4.2)
    axes = figure.subplots()
    axes.axvspan(own.from_mm, own.to_mm, color=PALE, zorder=0)
    depth = numbers([(layer.from_mm + layer.to_mm) / 2.0 for layer in layers])
    for phase, (label, style, colour) in {
        "": ("both, weighted", "o-", BLACK),
        "_dynamic": ("dynamic rates", "s--", ORANGE),
        "_static": ("static rates", "^:", BLUE),
    }.items():
        axes.plot(
            depth,
            numbers([getattr(layer.fit, f"fss_out_of_sample{phase}") for layer in layers]),
            style,
            color=colour,
            label=label,
        )
    for above, below in pairwise(layers):
        if above.tissue != below.tissue:
            axes.axvline(above.to_mm, color=GREY, linewidth=0.8, linestyle=":")
    axes.set_xscale("log")
    axes.set_xticks([0.05, 0.1, 0.2, 0.5, 1.0, 2.0, 5.0], ["0.05", "0.1", "0.2", "0.5", "1", "2", "5"])
    axes.minorticks_off()
    axes.set_xlabel("depth below the skin [mm]")
    axes.set_ylabel("FSS out of sample [1]")
    figure.legend(*axes.get_legend_handles_labels(), loc="outside lower center", ncols=3)
    return figure


def caption_depths(section: DriveStudy) -> str:
    """Describe the figure, with the depth of the best fit."""
    layers = section.depths.layers
    own = layers[section.depths.own_layer]
    best = max(layers, key=lambda layer: layer.fit.fss_out_of_sample or 0.0)
    return (
        "The paper's model with energy density sampled in each layer of elements below the receptor. Shaded: "
        "the living epidermis, where the paper places the end organs. Dotted lines: borders of tissues. "
        f"There FSS out of sample is {fixed(own.fit.fss_out_of_sample, 3)}; it is largest, "
        f"{fixed(best.fit.fss_out_of_sample, 3)}, between {fixed(best.from_mm, 2)} and "
        f"{fixed(best.to_mm, 2)} mm, in the {best.tissue}."
    )


def tables(section: DriveStudy) -> list[Table]:
    """Return the tables of quantities, explanations and depths."""
    rows = [_explanation_row(row) for row in section.explanations]
    note = "ΔAIC, ΔBIC: difference from the first row; smaller is better. Gain: as above."
    explanations = Table("Explanations of the dynamic rates", _EXPLANATION_COLUMNS, rows, note)
    return [*drive_tables(section.quantities), explanations, depth_table(section.depths)]


def depth_table(section: DepthStudy) -> Table:
    """Return the fits by sampling depth."""
    note = (
        "Stored energy density in both terms, four free parameters, least squares. Other quantities are "
        "stored in the living epidermis only. Gain: over the living epidermis."
    )
    return Table("Sampling depth", _DEPTH_COLUMNS, [_depth_row(layer) for layer in section.layers], note)


def _explanation_row(row: ExplanationFit) -> Row:
    added = ", ".join(f"{_spelled(name)} {fixed(value, 2)}" for name, value in row.added.items())
    return Row(
        (
            row.name,
            str(row.free_numbers),
            added or ABSENT,
            fixed(row.fit.fss_in_sample, 3),
            *(fixed(getattr(row.fit, key), 3) for key in _OUT_OF_SAMPLE),
            gain(row.fit.gain_interval),
            fixed(row.aic_difference, 1),
            fixed(row.bic_difference, 1),
        )
    )


def _depth_row(layer: LayerFit) -> Row:
    return Row(
        (
            layer.tissue,
            fixed(layer.from_mm, 2),
            fixed(layer.to_mm, 2),
            fixed(layer.largest_sed_kpa, 2),
            fixed(layer.fit.fss_in_sample, 3),
            *(fixed(getattr(layer.fit, key), 3) for key in _OUT_OF_SAMPLE),
            gain(layer.fit.gain_interval),
        )
    )


def _spelled(name: str) -> str:
    """Return a number's name with its unit behind it."""
    for ending, unit in (("_mm", " [mm]"), ("_ms", " [ms]")):
        if name.endswith(ending):
            return name.removesuffix(ending).replace("_", " ") + unit
    return name.replace("_", " ")


def drives_page(result: DriveStudy) -> Page:
    """Return the page of `python -m studies drives`: quantities by both methods, explanations and depths."""
    manifest, quantities = result.manifest, result.quantities
    drawings = [
        Drawing(
            "drive_quantities",
            "Rates by quantity",
            partial(draw_drive_quantities, quantities),
            caption_drive_quantities(quantities),
        ),
        Drawing(
            "drive_explanations",
            "Explanations of the dynamic rates",
            partial(draw_explanations, result),
            caption_explanations(result),
        ),
        Drawing("drive_depths", "Sampling depth", partial(draw_depths, result), caption_depths(result)),
    ]
    return Page(
        "Which quantity drives the afferent",
        f"Written by `python -m studies drives` on {manifest.started[:10]}: {edition(manifest)}, mechanical "
        f"code {manifest.code_hash}. Conclusions are on "
        "[quantity that drives the dynamic term](decisions.md#dynamic-term-quantity) and "
        "[one afferent, fitted](single-unit.md).",
        [],
        [Chapter("", [*drawings, *tables(result)])],
    )
