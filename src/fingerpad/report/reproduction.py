"""Figures and tables of a reproduction: both sets on one figure, three levels, comparison with the paper."""

from __future__ import annotations

from collections.abc import Sequence
from functools import partial
from typing import Any

import numpy as np
from matplotlib.axes import Axes
from matplotlib.figure import Figure
from matplotlib.patches import Circle

from fingerpad.core.units import MM_PER_M
from fingerpad.experiments.gerling2014.claims import ClaimRow, Group, Statement
from fingerpad.experiments.gerling2014.nerve import ThreeLevels
from fingerpad.experiments.gerling2014.reproduction import ReproductionResult
from fingerpad.experiments.scores import Verdict
from fingerpad.report import nerve, percept, skin
from fingerpad.report.page import DRAW, ROWS, SETS, Rows, enter
from fingerpad.report.style import (
    BLACK,
    BLUE,
    COLUMN_IN,
    GREY,
    NANOAMPERE_PER_MA,
    NO_MARKER,
    PALE,
    SERIES,
    draw_observed_rates,
    new_figure,
)
from fingerpad.report.tables import ABSENT, fixed, joined, number


def _first_screen(title: str) -> tuple[Figure, Axes]:
    drawn = new_figure(4.6, 3.0)
    axes = drawn.subplots()
    axes.set_title(title)
    return drawn, axes


@enter(DRAW, "level_1_skin")
def draw_skin(result: ReproductionResult) -> Figure:
    """Draw the deflection under the cylinder, downwards."""
    drawn, axes = _first_screen("Level 1: skin")
    skin.draw_profiles(axes, result.skin_deflection, "cylinder")
    axes.set(xlabel="distance from the axis, distal [mm]", ylabel="deflection [mm]")
    axes.legend(loc="lower left", fontsize=6.5)
    axes.invert_yaxis()
    return drawn


@enter(DRAW, "level_2_afferent")
def draw_afferent(result: ReproductionResult) -> Figure:
    """Draw the rates of the ramp over the place of the bar."""
    drawn, axes = _first_screen("Level 2: afferent")
    for name, style in zip(SETS, SERIES, strict=False):
        unit = getattr(result, name).single_unit
        axes.plot(-unit.shift_mm, unit.dynamic_rate_hz, label=name, **style | NO_MARKER)
    draw_observed_rates(axes, -unit.shift_mm, unit.observed_dynamic_rate_hz)
    axes.set(xlabel=nerve.ALONG, ylabel="rate in the ramp [spikes/s]")
    axes.set_ylim(0.0, 1.25 * axes.get_ylim()[1])
    axes.legend(loc="upper center", ncols=3, fontsize=8.0)
    return drawn


@enter(DRAW, "level_3_percept")
def draw_percept(result: ReproductionResult) -> Figure:
    """Draw the hit rates of the static Gradient Sum over the middle of the receptors."""
    drawn, axes = _first_screen("Level 3: percept")
    for name, style in zip(SETS, SERIES, strict=False):
        section = getattr(result, name).discrimination
        rates = section.gradient_sum["static"].hit_rate
        axes.plot(section.curvature_per_m[1:], rates, label=name, **style)
    percept.draw_people(axes, section.goodwin)
    axes.set(xlabel="curvature of the sphere [1/m]", ylabel="hit rate [fraction]")
    axes.set_ylim(top=1.02)
    axes.legend(loc="lower right", fontsize=8.0)
    return drawn


SHOWN_MM = (7.0, 4.5)  # Half the width of the skin that is shown, and height above the contact. [mm]


@enter(DRAW, "figure_2_three_levels")
def draw_levels(section: ThreeLevels) -> Figure:
    drawn = new_figure(COLUMN_IN, 7.4)
    grid = drawn.add_gridspec(5, 1, height_ratios=(3.2, 1.0, 1.0, 0.5, 1.5))
    pressed, current, potential, train, spikes = (drawn.add_subplot(grid[row]) for row in range(5))
    for axes in (current, potential):
        axes.sharex(train)
    _draw_pressed(pressed, section)
    _draw_one(current, potential, train, section)
    _draw_three(spikes, section)
    return drawn


def _draw_pressed(axes: Axes, section: ThreeLevels) -> None:
    """Draw the pressed section coloured by what they follow, the sphere, and the three afferents' places."""
    places = skin.corners(np.stack([section.x_mm, section.y_mm], axis=-1))
    faces = skin.paint_skin(axes, places, section.pressed_kpa.ravel(), edgecolors="#00000030", linewidths=0.2)
    radius = MM_PER_M / section.curvature_per_m
    axes.add_patch(Circle(section.centre_mm, radius, facecolor=skin.BODY, edgecolor=BLACK, linewidth=1.0))
    x, y = section.centre_mm
    width, height = SHOWN_MM
    axes.set(xlim=(x - width, x + width), ylim=(y - 1.0, y + radius + height), aspect="equal")
    axes.set(title="(a) skin, end of the hold", xlabel="x, distal [mm]", ylabel="y, dorsal [mm]")
    axes.text(x, y + 0.4, f"sphere, {number(section.curvature_per_m)} 1/m", ha="center", fontsize=9.0)
    axes.grid(visible=False)
    skin.label_skin(axes, faces, f"{section.pressed}\n[kPa]", 0.9)


def _draw_one(current: Axes, potential: Axes, train: Axes, section: ThreeLevels) -> None:
    """Draw current, potential and spikes of the afferent below the sphere."""
    level: Any = {"color": GREY, "linestyle": (0, (4, 2)), "linewidth": 1.2}
    current.plot(section.times_ms, NANOAMPERE_PER_MA * section.current_ma, color=BLUE)
    current.axhline(NANOAMPERE_PER_MA * section.rheobase_ma, label="rheobase", **level)
    current.set(title="(b) afferent below the sphere", ylabel="current\n[nA]")
    current.set_ylim(bottom=min(0.0, current.get_ylim()[0]))
    potential.plot(section.times_ms, section.potential_mv, color=BLUE, linewidth=1.2)
    potential.axhline(section.threshold_mv, label="threshold", **level)
    potential.set(ylabel="potential\n[mV]", ylim=(-0.04 * section.threshold_mv, 1.4 * section.threshold_mv))
    train.eventplot([section.spikes_ms[0]], colors=BLACK, linewidths=1.2, linelengths=0.8)
    train.set(xlabel="time [ms]", ylabel="spikes", yticks=[], xlim=(0.0, section.until_ms))
    for axes in (current, potential):
        axes.tick_params(labelbottom=False)
        axes.legend(loc="upper right", borderaxespad=0.0)
    for axes in (current, potential, train):
        axes.axvspan(0.0, section.ramp_ms, color=PALE, zorder=0)
        axes.grid(visible=False)


def _draw_three(axes: Axes, section: ThreeLevels) -> None:
    """Draw the spikes of three afferents, with the rates of the ramp and of the hold beside them."""
    rows = list(range(section.offset_mm.size))[::-1]
    axes.eventplot(list(section.spikes_ms), lineoffsets=rows, linelengths=0.7, linewidths=0.9, colors=BLACK)
    rates = zip(section.offset_mm, section.dynamic_rate_hz, section.static_rate_hz, strict=True)
    labels = [f"{number(offset)} mm\n{fixed(ramp, 0)} and {fixed(hold, 0)}/s" for offset, ramp, hold in rates]
    axes.set(title="(c) three afferents", xlabel="time [ms]", ylabel="distance,\nrates")
    axes.set_yticks(rows, labels=labels, fontsize=8.0)
    axes.set(xlim=(0.0, section.end_ms), ylim=(-0.6, len(rows) - 0.4))
    axes.axvspan(0.0, section.ramp_ms, color=PALE, zorder=0)
    axes.grid(visible=False)


# The signs differ without colour.
SIGNS = {Verdict.MET: "✓", Verdict.MISSED: "✗", Verdict.NOT_DECIDABLE: "?", Verdict.NOT_APPLICABLE: "–"}


def side_by_side(
    paper: Sequence[ClaimRow], human: Sequence[ClaimRow]
) -> list[tuple[ClaimRow, tuple[str, ...]]]:
    """Return the cells of each quantity for both sets, with the row that says its section and group."""
    by_name = [{row.quantity: row for row in rows} for rows in (paper, human)]
    made = []
    for name in dict.fromkeys(row.quantity for row in (*paper, *human)):
        pair = [found.get(name) for found in by_name]
        known = [row for row in pair if row is not None]
        cells = [name, known[0].paper]
        for row in pair:
            cells += [ABSENT, ""] if row is None else [row.ours, _marked(row.verdict, row.fitted_to)]
        told = dict.fromkeys("; ".join(text for text in (row.fitted_to, row.note) if text) for row in known)
        # A statement, or else a number that was fitted, is one even if it is so with one set only.
        first = min(known, key=lambda row: list(Group).index(row.group))
        made.append((first, (*cells, " | ".join(told))))
    return made


def rows_of_claims(group: Group, result: ReproductionResult) -> Rows:
    """Return the rows of a group, both sets side by side."""
    rows = side_by_side(result.paper.comparison, result.human.comparison)
    return [(first.section, *cells) for first, cells in rows if first.group is group]


ROWS |= {f"claims, {group}": partial(rows_of_claims, group) for group in Group}


def count_sentence(statements: Sequence[Statement], name: str) -> str:
    """Count the statements that can fail by their verdict with one set, and list what is missed."""
    verdicts = {each.statement: getattr(each, f"verdict_{name}") for each in statements}
    fitted = {each.statement for each in statements if getattr(each, f"fitted_{name}")}
    found = [verdict for statement, verdict in verdicts.items() if statement not in fitted]
    counted = [
        f"{found.count(verdict)} {verdict.value}"
        for verdict in Verdict
        if verdict in found or verdict in (Verdict.MET, Verdict.MISSED)
    ]
    missed = [
        f"{statement} (fitted)" if statement in fitted else statement
        for statement, verdict in verdicts.items()
        if verdict is Verdict.MISSED
    ]
    return (
        f"{name}: of {len(statements)} statements of the paper that can fail, {joined(counted)}"
        + (f", {len(fitted)} fitted" if fitted else "")
        + (f". Missed: {'; '.join(missed)}." if missed else ".")
    )


@enter(ROWS, "verdicts")
def rows_of_verdicts(result: ReproductionResult) -> Rows:
    """Return the verdict of every statement that can fail with both sets, and how many are met."""
    asked = result.statements
    met = (sum(getattr(each, f"verdict_{name}") is Verdict.MET for each in asked) for name in SETS)
    return [
        *((f"{each.section} {each.statement}", *statement_cells(each)[3::2]) for each in asked),
        ("met", *(f"{count} of {len(asked)}" for count in met)),
    ]


def statement_cells(each: Statement) -> tuple[str, ...]:
    """Return what the paper says, and our value and verdict of both sets."""
    cells = [each.statement, each.published]
    for name in SETS:
        verdict, fitted = getattr(each, f"verdict_{name}"), getattr(each, f"fitted_{name}")
        cells += [getattr(each, name), _marked(verdict, fitted)]
    return tuple(cells)


def _marked(verdict: Verdict, fitted: str) -> str:
    return f"{SIGNS[verdict]} {verdict.value}" + (" (fitted)" if fitted else "")
