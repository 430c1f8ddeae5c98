"""Figures of afferents: trains and maps of a population, Figures 5 and 6 with their tables."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from itertools import cycle
from typing import Any

import numpy as np
from matplotlib import colormaps
from matplotlib.axes import Axes
from matplotlib.colors import LogNorm, Normalize
from matplotlib.figure import Figure
from matplotlib.patches import Rectangle

from fingerpad.core.checked import checked
from fingerpad.core.errors import InputError
from fingerpad.core.signals import ResponseMap
from fingerpad.core.values import FloatArray
from fingerpad.data import paper, protocol
from fingerpad.experiments.gerling2014.nerve import PopulationMaps, SingleUnitResult
from fingerpad.report.page import both, figure
from fingerpad.report.style import (
    BLACK,
    BLUE,
    COLUMN_IN,
    GREEN,
    GREY,
    MAP_AXES,
    ORANGE,
    PALE,
    draw_rates,
    new_figure,
    say_nothing_to_draw,
    shared_legend,
)
from fingerpad.report.tables import (
    PARAMETER_SYMBOLS,
    PHASE_LABELS,
    Column,
    Table,
    at,
    fixed,
    number,
    spelled,
    table,
)

STYLES = ((BLUE, "o"), (ORANGE, "^"), (BLACK, "s"), (GREEN, "D"), (GREY, "v"))
"""Colour and marker of the types, in their order."""

LARGEST_MARK, SILENT_MARK = 60.0, 4.0  # Areas: most active afferent of a type, silent. [points²]
ROW_DRAWN = 0.85  # Length of the mark of a spike, over the height of the row of its afferent.


@checked
def draw_mixed_responses(touches: Mapping[str, Mapping[str, ResponseMap]]) -> Figure:
    """Draw the responses to touches by type, one touch per row: all spikes over time, and the places.

    In the map the area of a mark grows with the number of spikes over the largest of its type.
    """
    if not touches:
        raise InputError("touches", "must hold at least one response", remedy="it is empty")
    drawn = new_figure(9.5, 3.4 * len(touches))
    grid = drawn.subplots(len(touches), 2, squeeze=False, width_ratios=(1.7, 1.0))
    for (raster, places), (name, maps) in zip(grid, touches.items(), strict=True):
        raster.set_title(name)
        draw_raster_by_type(raster, maps)
        draw_map_by_type(places, maps)
    grid[0, 1].legend(loc="upper left", bbox_to_anchor=(1.0, 1.0))
    return drawn


def draw_raster_by_type(axes: Axes, maps: Mapping[str, ResponseMap]) -> None:
    """Draw all spikes over time, in a band per type that the afferents which fire divide among them."""
    labels = []
    for band, ((name, response), (colour, _)) in enumerate(zip(maps.items(), cycle(STYLES), strict=False)):
        counts = response.spike_count
        middle = response.positions_mm.mean(axis=0)
        order = np.argsort(np.linalg.norm(response.positions_mm - middle, axis=1))
        firing = order[counts[order] > 0]
        top_of = np.zeros(order.size)
        top_of[firing] = band + np.arange(firing.size) / max(firing.size, 1)
        tops = np.repeat(top_of, counts)
        ends = tops + ROW_DRAWN / max(firing.size, 1)
        axes.vlines(response.spikes.times_ms, tops, ends, color=colour, linewidth=0.6)
        axes.axhline(band, color=GREY, linewidth=0.5)
        labels.append(f"{name}\n{firing.size} of {order.size}")
    axes.set(xlabel="time [ms]", ylabel="afferents that fire, nearest on top", ylim=(len(maps), 0.0))
    axes.set_yticks(0.5 + np.arange(len(maps)), labels)
    axes.grid(visible=False)


def draw_map_by_type(axes: Axes, maps: Mapping[str, ResponseMap]) -> None:
    """Draw where the afferents lie, with larger marks for more spikes."""
    for (name, response), (colour, marker) in zip(maps.items(), cycle(STYLES), strict=False):
        counts, (x, z) = response.spike_count, response.positions_mm[:, [0, -1]].T
        fires = counts > 0
        axes.scatter(x[~fires], z[~fires], SILENT_MARK, color=colour, marker=".", linewidths=0.0)
        area = SILENT_MARK + LARGEST_MARK * counts[fires] / max(counts.max(initial=1), 1)
        hollow: Any = {"facecolors": "none", "edgecolors": colour, "marker": marker, "linewidths": 0.9}
        axes.scatter(x[fires], z[fires], area, label=name, **hollow)
    axes.set(**MAP_AXES)


def draw_trains(axes: Axes, trains: Sequence[FloatArray], on_top: str) -> None:
    """Draw the spikes of the afferents that fire, a row each from the top, or say that none does."""
    firing = [train for train in trains if train.size]
    if not firing:
        say_nothing_to_draw(axes, "no afferent fires a spike")
        return
    rows = list(range(1, len(firing) + 1))
    axes.eventplot(firing, lineoffsets=rows, linelengths=0.75, linewidths=1.0, colors=BLACK)
    axes.set(xlabel="time [ms]", ylim=(len(firing) + 0.75, 0.25), yticks=[])
    axes.set_ylabel(f"{len(firing)} of {len(trains)} afferents fire,\n{on_top} on top")


QUANTITIES = {
    "dynamic_rate_hz": ("dynamic ramp", "rate [spikes/s]", "viridis", Normalize),
    "static_rate_hz": ("static hold", "rate [spikes/s]", "viridis", Normalize),
    # Most first spikes come within a few tens of milliseconds, those at the rim after hundreds.
    "first_spike_latency_ms": ("first spike", "latency [ms]", "viridis_r", LogNorm),
}
"""Quantities of an afferent: when, what with its unit, colours and scale."""

TICKS_MS = (1.0, 2.0, 5.0, 10.0, 20.0, 50.0, 100.0, 200.0, 500.0, 1000.0)


def caption_population(section: PopulationMaps, human: PopulationMaps) -> str:
    resting = "".join(
        f" The afferent of {name} also fires without touch, {number(each.at_rest.static_rate_hz)} spikes/s "
        f"from {number(each.at_rest.first_spike_latency_ms)} ms on."
        for name, each in (("paper", section), ("human", human))
        if np.isfinite(each.at_rest.first_spike_latency_ms)
    )
    return (
        f"Predicted response of afferents all over the pad to a sphere of {number(section.curvature_per_m)} "
        f"1/m, at a depth of {protocol.DEPTH.value} mm. Left: the quantity as a height, as in the paper, but "
        "latencies on a logarithmic scale. Right: the same seen from above; circles are the receptors of "
        "Figures 7 and 8, hatched skin does not respond. All afferents have the parameters of the fitted "
        f"afferent; nothing here was observed.{resting}"
    )


@figure(
    "reproduction", "Level 3: population", 6, "figure_6_population", "Rates and latencies under a sphere",
    caption_population, of=both("population"),
)  # fmt: skip
def draw_population(section: PopulationMaps) -> Figure:
    drawn = new_figure(COLUMN_IN, 8.4)
    grid = drawn.add_gridspec(3, 2, width_ratios=(1.15, 1.0))
    for row, (key, (phase, _, _, scaling)) in enumerate(QUANTITIES.items()):
        values = getattr(section, key)
        surface = drawn.add_subplot(grid[row, 0], projection="3d")
        surface.set_title(f"({'abc'[row]}) {phase}")
        plane = drawn.add_subplot(grid[row, 1])
        if np.isnan(values).all():
            say_nothing_to_draw(plane, "no afferent fires")
            surface.set_axis_off()
            continue
        low, high = float(np.nanmin(values)), float(np.nanmax(values))
        scale = scaling(low, max(high, 1.001 * low, 1e-3), clip=True)  # apart, as logarithms need it
        ticks = [tick for tick in TICKS_MS if 0.0 <= float(scale(tick, clip=False)) <= 1.0]
        _draw_surface(surface, section, key, scale, ticks)
        _draw_plane(plane, section, key, scale, ticks)
        # Until it is drawn, Matplotlib 3.11.0 lays a surface out as if it filled the figure.
        surface.draw(drawn.canvas.get_renderer())  # type: ignore[attr-defined]
    return drawn


def _draw_surface(axes: Any, section: PopulationMaps, key: str, scale: Normalize, ticks: list[float]) -> None:
    values, (_, label, colours, _) = getattr(section, key), QUANTITIES[key]
    along, lateral = np.meshgrid(section.x_mm, section.z_mm, indexing="ij")
    # Surfaces have no logarithmic axis: the heights are logarithms, and the ticks show the values.
    logarithmic = isinstance(scale, LogNorm)
    heights, faces = np.log10(values) if logarithmic else values, colormaps[colours](scale(values))
    grid: Any = {"rcount": 60, "ccount": 60, "edgecolor": "#00000030", "linewidth": 0.3, "shade": False}
    axes.plot_surface(along, lateral, heights, facecolors=faces, **grid)
    axes.locator_params(nbins=3)
    if logarithmic:
        axes.set_zticks(np.log10(ticks), labels=[f"{tick:g}" for tick in ticks])
    axes.set_xlabel(MAP_AXES["xlabel"], labelpad=4.0)
    axes.set_ylabel(MAP_AXES["ylabel"], labelpad=4.0)
    axes.set_zlabel(label, labelpad=4.0)
    axes.view_init(elev=28.0, azim=-58.0)
    axes.set_box_aspect((1.25, 1.05, 0.85), zoom=0.85)


def _draw_plane(axes: Axes, section: PopulationMaps, key: str, scale: Normalize, ticks: list[float]) -> None:
    values, (_, label, colours, _) = getattr(section, key), QUANTITIES[key]
    shown = np.ma.masked_where(~(values.T > 0.0), values.T)
    picture = axes.pcolormesh(section.x_mm, section.z_mm, shown, cmap=colours, norm=scale, shading="nearest")
    silent = Rectangle((0, 0), 1, 1, transform=axes.transAxes, facecolor=PALE, hatch="//", edgecolor=GREY)
    silent.set(zorder=0, linewidth=0.0)
    axes.add_patch(silent)
    dots: Any = {"markersize": 4.5, "color": "white", "markeredgecolor": "black"}
    axes.plot(*section.receptors_mm.T, "o", label=f"{len(section.receptors_mm)} receptors", **dots)
    axes.set(**MAP_AXES)
    axes.grid(visible=False)
    bar = axes.figure.colorbar(picture, ax=axes, label=label, shrink=0.85)
    if isinstance(scale, LogNorm):
        bar.set_ticks(ticks)
        bar.minorticks_off()
        bar.ax.yaxis.set_major_formatter("{x:g}")
    axes.legend(loc="lower right", bbox_to_anchor=(1.0, 1.0), borderaxespad=0.1)


BAR_HALF_WIDTH_MM = protocol.BAR_WIDTH.value / 2.0
STATIC_MARK_MM = 2.9  # Position at which the paper's static difference is drawn, where no rates are. [mm]
ALONG = "place of the bar, distal [mm]"  # Figures have the distal side on the right; results do not.
PAPER_FOLD = 3  # The fold whose steps the paper's Table 4 lists, from its second start point.

SPECIES = (
    "The recordings are from afferents of monkeys (the paper, section 2.2.2: primate), the finger is human "
    "(section 2.1.1). The fit of the afferent takes up what differs between the two, which is not known."
)
"""What the paper combines; see docs/single-unit.md."""


def single_unit_tables(section: SingleUnitResult) -> list[Table]:
    """Return scores, parameters, folds, searches, the steps of one search, and modulation."""
    shown = section.folds[PAPER_FOLD - 1].climbs[-1]
    as_printed = shown.start == len(section.start_points)
    symbols = {name: PARAMETER_SYMBOLS.get(name, spelled(name)) for name in section.parameters}
    starts = section.start_points if as_printed else ()
    printed = paper.FSS_OUT_OF_SAMPLE.value
    note = (
        "The last row, in bold, is final; its FSS on the testing positions is "
        f"{fixed(shown.fss_test, 3)}. results.json holds these steps for each fold and start."
    )
    if as_printed:
        note += (
            f" In the paper FSS rose from {number(paper.FOLD_3_FSS_START.value)} to "
            f"{number(paper.FOLD_3_FSS_FITTED.value)} in {number(paper.FOLD_3_ITERATIONS.value)} iterations, "
            f"and was {number(paper.FOLD_3_FSS_TEST.value)} on its testing positions, which are unknown."
        )
    return [
        table(
            "Fractional sum of squares (FSS)",
            (
                ("out of sample, mean of the folds", printed, section.fss_out_of_sample),
                ("all positions, dynamic and static weighted 1:3", None, section.fss_in_sample),
                ("all positions, dynamic rates", None, section.fss_in_sample_dynamic),
                ("all positions, static rates", None, section.fss_in_sample_static),
            ),
            (Column("0", "over"), Column("1", "paper", 2), Column("2", "this run", 3)),
            SPECIES,
        ),
        table(
            "Parameters of the afferent", section.parameters,
            [
                Column(symbols.get, "parameter"),
                *(Column(start.get, f"start {place}") for place, start in enumerate(starts, start=1)),
                Column(section.parameters.get, "fitted"),
                Column(lambda name: section.units.get(name, ""), "unit"),
            ],
        ),
        table(
            "Folds of the cross-validation (the paper's Table 3)", section.folds,
            (
                Column("fold"), Column("testing_shift_mm", "positions kept for testing", _signed),
                Column("start", "better start"), Column("fss_train", "FSS, training", 3),
                Column("fss_test", "FSS, testing", 3),
            ),
        ),
        table(
            "Searches of every fold", [(fold, search) for fold in section.folds for search in fold.climbs],
            (
                Column(lambda row: f"{row[0].fold}, {row[1].start}", "fold, start"),
                Column("1.history.0.fss", "FSS at the start", 3), Column("1.fss_train", "FSS, training", 3),
                Column("1.fss_test", "FSS, testing", 3),
                Column(lambda row: len(row[1].history) - 1, "iterations"), Column("1.runs", "evaluations"),
            ),
            "In bold: the better start on the training positions, which is the result of the fold.",
            lambda row: "final" if row[1].start == row[0].start else "",
        ),
        table(
            f"Steps of the fit: fold {PAPER_FOLD}, start {shown.start} (the paper's Table 4"
            f"{'' if as_printed else ', from another start'})",
            shown.history,
            [
                Column("iteration"), Column("fss", "FSS, training", 3),
                *(
                    Column(f"parameters.{name}", f"{symbols.get(name, spelled(name))}{_unit(section, name)}")
                    for name in shown.history[0].parameters
                ),
            ],
            note,
            lambda step: "final" if step is shown.history[-1] else "",
        ),
        table(
            "Modulation at the edge of the bar (the paper's Table 5)",
            [
                (f"{phase}, {whose}", at(section.modulation, f"{phase}.{field}"))
                for phase in PHASE_LABELS for whose, field in (("observed", "observed"), ("this run", "ours"))
            ],
            (
                Column("0", "rates"), Column("1.maximum_hz", "maximum"), Column("1.minimum_hz", "minimum"),
                Column("1.difference_hz", "difference"), Column("1.index", "index, Eq. 11"),
            ),
            f"The paper predicts a dynamic minimum of {number(paper.DYNAMIC_RATE_MINIMUM.value)}, maximum of "
            f"{number(paper.DYNAMIC_RATE_MAXIMUM.value)} and difference of "
            f"{number(paper.DYNAMIC_RATE_DIFFERENCE.value)}, and a static difference of "
            f"{number(paper.STATIC_RATE_DIFFERENCE.value)}; it calls the differences modulation indices.",
        ),
    ]  # fmt: skip


def _unit(section: SingleUnitResult, name: str) -> str:
    return f" [{section.units[name]}]" if name in section.units else ""


def _signed(shifts_mm: FloatArray) -> str:
    return ", ".join(f"{shift:+.1f}".replace("-", "−") for shift in shifts_mm)


CAPTION_SINGLE_UNIT = (
    f"Firing rate of one SAI afferent under a bar {protocol.BAR_WIDTH.value} mm wide, pressed in by "
    f"{protocol.DEPTH.value} mm at {{shift_mm:n}} positions relative to the centre of its "
    "receptive field; shaded: positions at which the bar covers the centre. Circles: observed in one "
    "afferent of a monkey (Phillips & Johnson 1981); the finger of the model is human. Blue line: rates "
    "of the model, whose afferent was fitted to these circles; its fractional sum of squares (FSS, "
    "1 is perfect) is in the titles. (a) Lines: lowest rate under the flat face and highest rate, "
    f"{number(paper.DYNAMIC_RATE_MINIMUM.value)} and {number(paper.DYNAMIC_RATE_MAXIMUM.value)} spikes/s "
    f"as the paper's model predicts them (dashed), and {{modulation.dynamic.observed.minimum_hz}} and "
    f"{{modulation.dynamic.observed.maximum_hz}} spikes/s as observed (dotted). (b) Bar: the difference of "
    f"{number(paper.STATIC_RATE_DIFFERENCE.value)} spikes/s between them that the paper's model "
    "predicts, drawn from the lowest rate of the line; it prints no static rates."
)


@figure(
    "reproduction", "Level 2: afferent", 5, "figure_5_single_unit", "Rates under a bar", CAPTION_SINGLE_UNIT,
    of=both("single_unit"), tables=single_unit_tables,
)  # fmt: skip
def draw_single_unit(section: SingleUnitResult) -> Figure:
    drawn = new_figure(COLUMN_IN, 4.0)
    dynamic, static = drawn.subplots(1, 2)
    for axes, letter, phase in ((dynamic, "a", "dynamic"), (static, "b", "static")):
        rate_hz, observed_hz = (getattr(section, f"{of}{phase}_rate_hz") for of in ("", "observed_"))
        fss = fixed(getattr(section, f"fss_in_sample_{phase}"), 2)
        axes.axvspan(-BAR_HALF_WIDTH_MM, BAR_HALF_WIDTH_MM, color="#f3f1ea", zorder=0)
        draw_rates(axes, -section.shift_mm, rate_hz, observed_hz, "model (fitted)")
        axes.set_title(f"({letter}) {PHASE_LABELS[phase]}, FSS = {fss}", fontsize=10.0)
        axes.set_xlabel(ALONG)
    # The rates under the flat face and at the edge that the paper predicts, and the observed ones.
    observed = section.modulation["dynamic"]["observed"]
    printed = (paper.DYNAMIC_RATE_MINIMUM.value, paper.DYNAMIC_RATE_MAXIMUM.value)
    seen = (observed.minimum_hz, observed.maximum_hz)
    low, high = dynamic.get_xlim()
    for levels, place, side, edge, colour, dashes, label in (
        (printed, low, "left", "bottom", ORANGE, (6, 3), "predicted by the paper, lowest and highest"),
        (seen, high, "right", "top", BLACK, (1, 2), "observed, lowest and highest"),
    ):
        for level in levels:
            line: Any = {"color": colour, "linestyle": (0, dashes), "linewidth": 1.2, "zorder": 1}
            dynamic.axhline(level, label=label, **line)
            text: Any = {"ha": side, "va": edge, "color": colour, "fontsize": 9.0}
            dynamic.text(place, level, f" {number(level)} ", **text)
    dynamic.set_xlim(low, high)
    dynamic.set_ylim(top=1.1 * max(*printed, dynamic.get_ylim()[1] / 1.05))
    # The difference that the paper predicts, from our lowest rate: it prints no static rates.
    bar = 0.5 * paper.STATIC_RATE_DIFFERENCE.value
    middle = section.modulation["static"]["ours"].minimum_hz + bar
    label = "difference predicted by the paper"
    static.errorbar(STATIC_MARK_MM, middle, bar, color=ORANGE, capsize=5.0, elinewidth=1.8, label=label)
    text = {"ha": "left", "va": "center", "color": ORANGE, "fontsize": 9.0}
    static.text(STATIC_MARK_MM, middle, f" {number(2.0 * bar)}", **text)
    shared_legend(drawn, drawn.axes, columns=2)
    return drawn
