"""The page of `python -m studies bar-readings`: rates and FSS by reading."""

from __future__ import annotations

from collections.abc import Sequence

from matplotlib.figure import Figure

from fingerpad.report.formatting import PHASE_LABELS, fixed
from fingerpad.report.manifest import edition
from fingerpad.report.parts import Chapter, Drawing, Page, Row, Table
from fingerpad.report.style import BLACK, BLUE, GREEN, GREY, ORANGE, new_figure
from studies.bar_readings import BarReadings, ReadingRates
from studies.pages.drive_quantities import QUANTITIES

STYLES = ((BLACK, "-"), (BLUE, "--"), (ORANGE, "-."), (GREEN, ":"))
"""Colour and dashes by reading, which differ without colour."""


def bar_readings_page(result: BarReadings) -> Page:
    """Return the page of `python -m studies bar-readings`."""
    manifest = result.manifest
    return Page(
        "Intervals in windows, and bar or grating",
        f"Written by `python -m studies bar-readings --tissues {manifest.materials}` on "
        f"{manifest.started[:10]}: {edition(manifest)}, mechanical code {manifest.code_hash}. Rates of one "
        f"afferent at 36 shifts of the bar, driven by {QUANTITIES[result.quantity]}, by reading of what the "
        "paper leaves open. Conclusions are on [intervals in windows](decisions.md#intervals-in-windows) and "
        "[bar or ridge of a grating](decisions.md#bar-or-grating).",
        [],
        [Chapter("", [*tables(result), _drawing(result)])],
    )


def _drawing(result: BarReadings) -> Drawing:
    return Drawing(
        "bar_or_grating",
        "Rates under the bar and under ridges of gratings",
        lambda: draw_bodies(result),
        "Rates of the afferent that is fitted to the bar alone (lines), and recorded rates (circles), "
        "against the position of the bar or ridge; proximal positions are positive.",
    )


def tables(result: BarReadings) -> list[Table]:
    """Return one table for the intervals and one for the body."""
    return [
        _table("Intervals that count (Eqs. 6-10)", "reading", result.intervals),
        _table("Bar alone or one ridge of a grating", "body", result.bodies),
    ]


def _table(title: str, what: str, readings: Sequence[ReadingRates]) -> Table:
    rows = [
        Row(
            (
                one.reading,
                *(fixed(rate, 0) for rate in (one.dynamic.minimum_hz, one.dynamic.maximum_hz)),
                fixed(one.static.difference_hz, 0),
                *(fixed(fss, 3) for fss in (one.fss_same_afferent, one.fss_in_sample, one.fss_out_of_sample)),
            )
        )
        for one in readings
    ]
    columns = (
        what,
        "dynamic rate, smallest under the flat face",
        "dynamic rate, largest",
        "static difference",
        "FSS, same afferent",
        "FSS in sample, fitted anew",
        "FSS out of sample, fitted anew",
    )
    note = (
        "Rates in spikes/s, of the afferent that least squares fits to the first row. Out of sample: mean of "
        "six folds. Every fit is silent at rest."
    )
    return Table(title, columns, rows, note)


def draw_bodies(result: BarReadings) -> Figure:
    """Draw both rates against the position, one line per body."""
    figure = new_figure(9.4, 3.9)
    for axes, phase, label in zip(
        figure.subplots(1, 2), ("dynamic", "static"), PHASE_LABELS.values(), strict=True
    ):
        observed = getattr(result, f"observed_{phase}_hz")
        axes.plot(
            result.shift_mm,
            observed,
            "o",
            color=GREY,
            markerfacecolor="white",
            markersize=4.5,
            label="observed",
        )
        for body, (colour, dashes) in zip(result.bodies, STYLES, strict=False):
            rates = getattr(body, f"{phase}_rate_hz")
            axes.plot(result.shift_mm, rates, color=colour, linestyle=dashes, label=body.reading)
        axes.set_xlabel("position of the bar or ridge [mm]")
        axes.set_ylabel(f"{label}: firing rate [spikes/s]")
        axes.set_ylim(bottom=0.0)
    figure.legend(*axes.get_legend_handles_labels(), loc="outside lower center", ncols=3)
    return figure
