"""The page of `python -m studies spike-fit`: variability of intervals, fits to spikes."""

from __future__ import annotations

from collections.abc import Sequence
from functools import partial
from typing import Any

import numpy as np
from matplotlib.axes import Axes
from matplotlib.figure import Figure

from fingerpad.core.checks import FloatArray
from fingerpad.report.formatting import IDENTIFIABLE_SYMBOLS, fixed, number, whole_percent
from fingerpad.report.manifest import edition, manifest_chapter
from fingerpad.report.parts import Chapter, Drawing, Page, Row, Table
from fingerpad.report.style import (
    BLACK,
    BLUE,
    GREEN,
    GREY,
    ORANGE,
    PALE,
    new_figure,
    numbers,
    say_nothing_to_draw,
)
from studies.isi_variability import IsiVariability
from studies.spike_fit import Raster, Recovery, SpikeFits, SpikeFitStudy

NAMES = IDENTIFIABLE_SYMBOLS | {"escape_width": "width δ/v"}
STYLES = ((BLUE, "-"), (GREEN, "--"), (ORANGE, "-."), (BLACK, ":"), (GREY, "-"))
LOWEST_INTENSITY_HZ = 1.0
NOT_FITTED = "the spikes could not be fitted"


def draw(section: SpikeFits) -> Figure:
    """Draw spikes under the bar, their intensity, the test of time rescaling, and irregularity against noise.

    Parameters
    ----------
    section : SpikeFits
        From `studies.spike_fit.result`.

    Returns
    -------
    Figure
    """
    figure = new_figure(10.0, 8.0)
    raster, intensity, rescaled, variability = figure.subplots(2, 2).flat
    _raster(raster, section.raster)
    _intensity(intensity, section.raster)
    _rescaled(rescaled, section.recovery)
    _variability(variability, section.variability)
    return figure


def _raster(axes: Axes, found: Raster | None) -> None:
    axes.set_title("(a) spikes, one presentation each")
    if not found:
        say_nothing_to_draw(axes, NOT_FITTED)
        return
    shift = numbers(found.shift_mm)
    step = float(np.diff(shift).min()) if shift.size > 1 else 1.0
    axes.eventplot(
        [_known(train) for train in found.spikes_ms],
        lineoffsets=shift.tolist(),
        linelengths=0.8 * step,
        linewidths=0.7,
        colors=BLACK,
    )
    axes.axhline(shift[found.shown], color=PALE, linewidth=8.0, zorder=0)
    axes.set_xlabel("time [ms]")
    axes.set_ylabel("position of the bar [mm]")


def _intensity(axes: Axes, found: Raster | None) -> None:
    axes.set_title("(b) intensity")
    if not found:
        say_nothing_to_draw(axes, NOT_FITTED)
        return
    times = numbers(found.times_ms)
    for name, colour, line in (("truth", BLACK, "-"), ("fitted", ORANGE, "--")):
        axes.plot(times, numbers(found.intensity_hz[name]), color=colour, linestyle=line, lw=1.2, label=name)
    spikes = _known(found.spikes_ms[found.shown])
    shown = spikes[spikes <= times[-1]]
    axes.plot(
        shown,
        np.full(shown.size, 0.04),
        "|",
        color=BLUE,
        markersize=9.0,
        label="spikes",
        transform=axes.get_xaxis_transform(),
    )
    axes.set_title(f"(b) intensity, bar at {number(found.shift_mm[found.shown])} mm")
    axes.set_yscale("log")
    axes.set_ylim(bottom=LOWEST_INTENSITY_HZ)
    axes.set_xlabel("time [ms]")
    axes.set_ylabel("intensity given the spikes before [1/s]")
    axes.legend(loc="upper right")


def _rescaled(axes: Axes, found: Recovery | None) -> None:
    axes.set_title("(c) rescaled intervals")
    if not found:
        say_nothing_to_draw(axes, NOT_FITTED)
        return
    test = found.rescaled
    share, limit = numbers(test.share), float(numbers(test.limit))
    axes.fill_between([0.0, 1.0], -limit, limit, color=PALE, label=f"{whole_percent(found.level)} of chance")
    axes.plot(share, numbers(test.quantile) - share, color=BLUE, label="fitted")
    if np.isfinite(limit):
        axes.set_ylim(-2.0 * limit, 2.0 * limit)
    axes.set_xlabel("uniform quantile")
    axes.set_ylabel("quantile of the rescaled intervals, less uniform")
    axes.legend(loc="upper left")


def _variability(axes: Axes, found: IsiVariability) -> None:
    axes.set_title("(d) irregularity")
    if not found.sources:
        say_nothing_to_draw(axes, "the afferent is silent")
        return
    middle, spread = numbers([found.observed, found.observed_spread])
    axes.axhspan(middle - spread, middle + spread, color=PALE, zorder=0, label="observed, mouse")
    for (colour, line), source in zip(STYLES, found.sources, strict=False):
        axes.plot(
            numbers(source.amount),
            numbers(source.coefficient_of_variation),
            color=colour,
            linestyle=line,
            marker="o",
            markersize=3.0,
            label=source.name,
        )
    axes.set_xlabel("amount of noise, relative")
    axes.set_ylabel("coefficient of variation")
    axes.set_ylim(0.0, 1.9)
    axes.legend(loc="upper right", fontsize=7.5)


def _known(times: Any) -> FloatArray:
    """Return times as numbers, those that do not exist left out."""
    given = numbers(times)
    return given[np.isfinite(given)]


def caption(section: SpikeFits) -> str:
    """Say what the figure shows.

    Parameters
    ----------
    section : SpikeFits
        From `studies.spike_fit.result`.

    Returns
    -------
    str
    """
    found = section.recovery
    fitted = "They could not be fitted."
    if found:
        held = f"{number(found.n_held)} of {len(found.truth)} intervals of {whole_percent(found.level)}"
        fitted = (
            f"{held} hold the truth; the rescaled intervals stray from uniform by "
            f"{number(found.rescaled.distance)}; chance allows {number(found.rescaled.limit)}."
        )
    shown = f"{number(section.n_positions)} positions, {number(section.n_repeats)} times each"
    return (
        f"Spikes of the fitted afferent with a soft threshold (escape rate) under the bar at {shown}, fitted "
        f"by maximum likelihood from the paper's first start point. {fitted} (c) Intervals measured in the "
        "integral of the fitted intensity: how far they stray from what a true model makes of them. (d) "
        "Coefficient of variation of the intervals of the held afferent against the amount of noise, at the "
        "rate that it has without noise; shaded: observed in mice. The meaning of each amount stands in the "
        "table."
    )


def table(section: SpikeFits) -> list[Table]:
    """Return truth and estimates, fits to other noise, and the noise that makes the observed irregularity.

    Parameters
    ----------
    section : SpikeFits
        From `studies.spike_fit.result`.

    Returns
    -------
    list of Table
    """
    tables = [_recovery(section), _other_noise(section), _sources(section.variability)]
    return [found for found in tables if found.rows]


def _recovery(section: SpikeFits) -> Table:
    found = section.recovery
    columns = ("parameter", "start", "truth", "estimate", "standard error", "from", "to", "unit")
    keys = ("start", "truth", "estimate", "standard_error", "low", "high")
    rows = [
        Row((NAMES.get(name, name), *(number(getattr(found, key)[place], 4) for key in keys), unit))
        for place, (name, unit) in enumerate(zip(section.names, section.units, strict=True))
        if found
    ]
    note = ""
    if found:
        there = fixed(found.log_likelihood, 1), fixed(found.log_likelihood_of_truth, 1)
        note = (
            f"{number(found.n_spikes, 6)} spikes. Log-likelihood {there[0]} at the estimate, {there[1]} "
            f"at the truth; {number(found.n_steps)} steps. From and to: interval that holds the truth in "
            f"{whole_percent(found.level)} of such experiments."
        )
    return Table("The afferent found again in its spikes", columns, rows, note)


def _other_noise(section: SpikeFits) -> Table:
    columns = (
        "spikes made with",
        "amount",
        "spikes",
        *(f"{NAMES[name]}, over truth" for name in section.names[:4]),
        "width",
        "distance (chance)",
        "error of dynamic rate [1/s]",
        "error of static rate [1/s]",
    )
    rows = [
        Row(
            (
                found.name,
                number(found.amount),
                number(found.n_spikes, 5),
                *(
                    fixed(ratio, 2)
                    for ratio in ([None] * 4 if found.over_truth is None else found.over_truth)
                ),
                fixed(_or_absent(found.estimate, 5)[4], 3),
                f"{fixed(found.distance, 3)} ({fixed(found.limit, 3)})",
                fixed(found.dynamic_rate_error_hz, 1),
                fixed(found.static_rate_error_hz, 1),
            )
        )
        for found in section.other_noise
    ]
    note = (
        "The fitted model has a soft threshold; the simulated afferents do not. Distance: of the rescaled "
        "intervals from a uniform distribution. A distance above the value expected by chance shows that the "
        "spikes do not come from the model; time constant and intercept are then unreliable. Errors: root "
        "mean square over the positions."
    )
    return Table("Spikes of other noise", columns, rows, note)


def _or_absent(values: FloatArray | None, count: int) -> Sequence[float | None]:
    """Return the values, or as many that do not exist."""
    return [None] * count if values is None else values.tolist()


def _sources(found: IsiVariability) -> Table:
    columns = ("noise", "amount is", "amount", "current, for the same rate", "local variation")
    rows = [
        Row(
            (
                source.name,
                source.amount_is,
                *(
                    fixed(getattr(source.at_observed, key, None), 2)
                    for key in ("amount", "current_factor", "local_variation")
                ),
            )
        )
        for source in found.sources
    ]
    note = (
        "Amount of each noise that gives intervals the coefficient of variation observed in mice, "
        f"{number(found.observed)}, in an afferent held at {fixed(found.rate_hz, 1)} spikes/s; a dash: "
        "no amount tried does, at the same rate. Current: factor that keeps the rate."
    )
    return Table("Noise that makes the observed irregularity", columns, rows, note)


def spike_fit_page(result: SpikeFitStudy) -> Page:
    """Return the page of `python -m studies spike-fit`."""
    found = result.spike_fit
    drawing = Drawing("spike_fit", "Spikes and their fit", partial(draw, found), caption(found))
    return Page(
        "Spike trains of the fitted afferent",
        f"Fits to simulated spikes whose parameters are known. {edition(result.manifest)}.",
        [],
        [Chapter("", [drawing, *table(found)]), manifest_chapter(result.manifest)],
    )
