"""Figures of a question of one's own: psychometric curves, what codes make of stimuli, responses."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from typing import Any

import numpy as np
from matplotlib.axes import Axes
from matplotlib.collections import PathCollection
from matplotlib.figure import Figure

from fingerpad.core.checks import FloatArray
from fingerpad.report.formatting import number, whole_percent
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

CHANCE = 0.5
MOST_MAPS = 4
"""Stimuli in the figure of responses: the standard, and comparisons from the first to the last."""

MARGIN_MM = 0.6
"""About the outermost afferents of a map. [mm]"""

CODES = {"gradient_sum": "Gradient Sum", "euclidean": "Euclidean Distance", "ideal": "ideal observer"}
MEASURES = {
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


def draw_responses(section: dict[str, Any]) -> Figure:
    """Draw what the population answers to the standard and to comparisons, seen from the volar side.

    Parameters
    ----------
    section : dict
        `results["discrimination"]` of `studies.discriminate.run`.

    Returns
    -------
    Figure
    """
    measure = main_reading(section)["measure"]
    what, unit = MEASURES[measure]
    answers, places = numbers(section["responses"][measure]), numbers(section["population"]["positions_mm"])
    shown = _shown(len(answers))
    low, high = places[:, [-1, 0]].min(axis=0) - MARGIN_MM, places[:, [-1, 0]].max(axis=0) + MARGIN_MM
    across, along = high - low
    height = float(np.clip(8.0 / len(shown) * along / across, 0.5, 4.0))
    figure = new_figure(10.0, 2.0 * height + 1.4)
    grid = figure.subplots(2, len(shown), sharex=True, sharey=True, squeeze=False)
    largest = float(np.nanmax(np.abs(answers[shown] - answers[0])))
    for column, row in enumerate(shown):
        name = section["stimulus"][row]
        picture = _answers(grid[0, column], places, answers[row], answers)
        grid[0, column].set_title(f"{name}, standard" if row == 0 else name)
        if row:
            _differences(grid[1, column], places, answers[row] - answers[0], largest)
    grid[1, 0].set_axis_off()
    grid[1, 0].text(
        0.5,
        0.5,
        f"less the standard:\n▲ more, ▼ less,\nlargest {number(largest)} {unit}",
        ha="center",
        va="center",
        transform=grid[1, 0].transAxes,
    )
    for axes in grid.flat:
        axes.set_aspect("equal")
        axes.set(xlim=(low[0], high[0]), ylim=(low[1], high[1]))
        axes.set_facecolor(PALE)
    grid[0, 0].set_ylabel("along, x [mm]")
    grid[1, 1].set_ylabel("along, x [mm]")
    for axes in (grid[0, 0], *grid[1, 1:]):
        axes.set_xlabel("across, z [mm]")
        axes.tick_params(labelbottom=True)
    figure.colorbar(picture, ax=grid, label=f"{what} [{unit}]", shrink=0.8)
    return figure


def _answers(axes: Axes, places: FloatArray, answers: FloatArray, of_all: FloatArray) -> PathCollection:
    """Draw every afferent where it ends, as light as it answers."""
    return axes.scatter(
        places[:, -1],
        places[:, 0],
        c=answers,
        s=_marker_size(len(places)),
        cmap="viridis",
        vmin=np.nanmin(of_all),
        vmax=np.nanmax(of_all),
        edgecolors=GREY,
        linewidths=0.5,
    )


def _differences(axes: Axes, places: FloatArray, difference: FloatArray, largest: float) -> None:
    """Draw upright triangles where there is more, hanging ones where there is less, by area."""
    size = _marker_size(len(places)) * np.abs(np.nan_to_num(difference)) / (largest or 1.0)
    for sign, marker, colour in ((1.0, "^", ORANGE), (-1.0, "v", BLUE)):
        there = sign * difference > 0.0
        axes.scatter(places[there, -1], places[there, 0], s=size[there], marker=marker, color=colour)


def draw_statistics(section: dict[str, Any]) -> Figure:
    """Draw what each code makes of every stimulus: mean and spread over noisy presentations.

    Parameters
    ----------
    section : dict
        As in `draw_responses`.

    Returns
    -------
    Figure
    """
    readings = [reading for reading in section["readings"] if reading["code"] != "ideal"]
    codes, measures = (
        list(dict.fromkeys(reading[key] for reading in readings)) for key in ("code", "measure")
    )
    figure = new_figure(min(10.0, 4.0 * len(codes) + 1.5), 3.0 * len(measures) + 0.3)
    grid = figure.subplots(len(measures), len(codes), squeeze=False)
    for axes, reading in zip(grid.flat, readings, strict=True):
        axes.set_title(titled(reading))
        if reading["hit_rate"] is None:
            say_nothing_to_draw(axes, why_silent(reading))
            continue
        where, _ = _places(section)
        mean, spread = (numbers(reading["statistic"][key]) for key in ("mean", "sd"))
        axes.axhspan(mean[0] - spread[0], mean[0] + spread[0], color=GREY, alpha=0.25, linewidth=0.0)
        axes.errorbar(where, mean, spread, fmt="o", color=BLUE, markersize=4.5, capsize=3.0, elinewidth=1.2)
        axes.plot(where[0], mean[0], "D", color=BLACK, markersize=6.5, zorder=4)
        axes.set_ylabel(f"{CODES[reading['code']]} [{MEASURES[reading['measure']][1]}]")
        _name_axis(axes, section)
    return figure


def draw_curves(section: dict[str, Any]) -> Figure:
    """Draw hit rates, psychometric curves with their bands, and what people do.

    Parameters
    ----------
    section : dict
        As in `draw_responses`.

    Returns
    -------
    Figure
    """
    measures = list(dict.fromkeys(reading["measure"] for reading in section["readings"]))
    figure = new_figure(min(10.0, 3.6 * len(measures) + 2.0), 4.6)
    grid = figure.subplots(1, len(measures), sharey=True, squeeze=False)
    for axes, measure in zip(grid[0], measures, strict=True):
        of_measure = [reading for reading in section["readings"] if reading["measure"] == measure]
        axes.set_title(MEASURES[measure][0])
        axes.axhline(CHANCE, color=GREY, linewidth=1.0, linestyle=(0, (6, 3)))
        if all(reading["hit_rate"] is None for reading in of_measure):
            say_nothing_to_draw(axes, why_silent(of_measure[0]))
            continue
        for reading, style in zip(of_measure, _STYLES, strict=False):
            _curve(axes, section, reading, style)
        _people(axes, section)
        _name_axis(axes, section)
        axes.set_ylim(0.4, 1.03)
    grid[0, 0].set_ylabel("hit rate [fraction]")
    handles: dict[str, Any] = {}
    for axes in grid[0]:
        for handle, label in zip(*axes.get_legend_handles_labels(), strict=True):
            handles.setdefault(label, handle)
    figure.legend(handles.values(), handles.keys(), loc="outside lower center", ncols=min(4, len(handles)))
    return figure


def _curve(axes: Axes, section: Mapping[str, Any], reading: Mapping[str, Any], style: Any) -> None:
    if reading["hit_rate"] is None:
        return
    colour, marker, line = style
    where, _ = _places(section)
    axes.errorbar(
        where[1:],
        numbers(reading["hit_rate"]),
        np.nan_to_num(numbers(reading["hit_rate_sd"])),
        fmt=marker,
        color=colour,
        markersize=5.0,
        capsize=3.0,
        elinewidth=1.0,
        label=CODES[reading["code"]],
    )
    for side in reading["curves"]:
        if "why_not" in side:
            continue
        curve, threshold = side["curve"], side["threshold"]
        level = numbers(curve["level"])
        axes.fill_between(
            level, numbers(curve["low"]), numbers(curve["high"]), color=colour, alpha=0.15, linewidth=0.0
        )
        axes.plot(level, numbers(curve["proportion"]), color=colour, linestyle=line, linewidth=1.5)
        axes.plot(
            [threshold["level"]] * 2,
            [0.4, threshold["proportion"]],
            color=colour,
            linewidth=0.9,
            linestyle=":",
        )


def _people(axes: Axes, section: Mapping[str, Any]) -> None:
    observed = section["observed"]
    points = [point for point in observed["points"] if point["level"] is not None] if observed else []
    if not points:
        return
    level, rate = (numbers([point[key] for point in points]) for key in ("level", "hit_rate"))
    for point in points:
        if point["interval"]:
            axes.plot([point["level"]] * 2, point["interval"], color=BLACK, linewidth=1.4, zorder=5)
    axes.plot(
        level,
        rate,
        "D",
        color=BLACK,
        markerfacecolor="none",
        markersize=8.0,
        markeredgewidth=1.5,
        zorder=5,
        label=f"people ({observed['source']})",
    )


def caption_responses(section: Mapping[str, Any]) -> str:
    """Say what the response maps show."""
    main, n_stimuli = main_reading(section), len(section["stimulus"])
    left_out = n_stimuli - len(_shown(n_stimuli))
    return (
        f"{MEASURES[main['measure']][0].capitalize()} of {section['population']['n_receptors']} afferents "
        "without noise, the distal end above; below, what a stimulus adds to the standard or takes from it, "
        "by the area of triangles."
        + (f" {left_out} of the comparisons are left out here." if left_out else "")
    )


def caption_statistics(section: Mapping[str, Any]) -> str:
    """Say what the statistics show."""
    return (
        "What the code makes of each stimulus: mean and standard deviation over noisy presentations, noise "
        f"σ₁ = {number(section['noise']['sigma'])}. Diamond and grey band: the standard, "
        "whose distance is that between presentations of its own."
    )


def caption_curves(section: Mapping[str, Any]) -> str:
    """Say what the curves show."""
    curves = [side for reading in section["readings"] for side in reading.get("curves") or []]
    fitted = [side for side in curves if "why_not" not in side]
    said = (
        "How often each comparison is told from the standard; bars are one standard deviation over the "
        "repetitions of the paper's protocol."
    )
    if fitted:
        first = fitted[0]
        said += (
            f" Lines: psychometric functions ({first['sigmoid']}) of the difference from the standard, with "
            f"95 % credible bands for an experiment of {number(first['trials'])} trials per comparison. "
            f"Dotted: the threshold at {whole_percent(first['threshold']['proportion'])}."
        )
    return said


def main_reading(section: Mapping[str, Any]) -> Mapping[str, Any]:
    """Return the first reading that has hit rates."""
    return next(reading for reading in section["readings"] if reading["hit_rate"] is not None)


def titled(reading: Mapping[str, Any]) -> str:
    """Name a reading by its code and measure."""
    return f"{CODES[reading['code']]}, {MEASURES[reading['measure']][0]}"


def why_silent(reading: Mapping[str, Any]) -> str:
    """Say under which stimuli there is nothing to read."""
    return f"silent under {', '.join(reading['silent'][:3])}"


def _shown(n_stimuli: int) -> list[int]:
    """Rows of the stimuli to draw: all, or the first, the last and some between."""
    if n_stimuli <= MOST_MAPS:
        return list(range(n_stimuli))
    return [round(row) for row in np.linspace(0, n_stimuli - 1, MOST_MAPS)]


def _marker_size(count: int) -> float:
    """Area of a marker so that many of them do not cover each other. [points²]"""
    return float(np.clip(2500.0 / count, 4.0, 140.0))


def _places(section: Mapping[str, Any]) -> tuple[FloatArray, Sequence[str] | None]:
    """Where each stimulus stands along an axis, and its name if that place has no meaning."""
    if section["level"] is None:
        return np.arange(len(section["stimulus"]), dtype=np.float64), section["stimulus"]
    return numbers(section["level"]), None


def _name_axis(axes: Axes, section: Mapping[str, Any]) -> None:
    where, names = _places(section)
    if names is None:
        axes.set_xlabel(section["axis"])
    else:
        axes.set_xticks(where, names, rotation=30, ha="right")
        axes.set_xlabel("stimulus")
