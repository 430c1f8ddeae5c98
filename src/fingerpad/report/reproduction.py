"""The page of a reproduction: a first screen, a chapter per level, comparison with the paper."""

from __future__ import annotations

from collections.abc import Callable, Sequence
from functools import partial
from pathlib import Path
from typing import Any

import numpy as np
from matplotlib.axes import Axes
from matplotlib.figure import Figure
from matplotlib.patches import Circle

from fingerpad.core.units import MM_PER_M
from fingerpad.data import STATUSES, Published, paper, protocol, psychophysics
from fingerpad.experiments.gerling2014.claims import ClaimRow, Group, Statement
from fingerpad.experiments.gerling2014.nerve import ThreeLevels
from fingerpad.experiments.gerling2014.reproduction import ReproductionResult
from fingerpad.experiments.scores import Verdict
from fingerpad.experiments.tissue_sets import TissueLayer
from fingerpad.report import fit, mesh_picture, nerve, percept, skin
from fingerpad.report.page import (
    SETS,
    Chapter,
    Drawing,
    Page,
    both,
    edition,
    figure,
    figures,
    manifest_chapter,
    write_html,
)
from fingerpad.report.style import (
    BLACK,
    BLUE,
    COLUMN_IN,
    GREY,
    NANOAMPERE_PER_MA,
    ORANGE,
    PALE,
    draw_observed_rates,
    new_figure,
)
from fingerpad.report.tables import ABSENT, Column, Row, Table, fixed, joined, listed, number, plain, table

LEVELS = (mesh_picture, skin, nerve, fit, percept)
"""Modules whose figures stand on the page: to load them enters these into the list of figures."""

LINES: dict[str, Any] = {
    "paper": {"color": BLUE, "linestyle": "-"},
    "human": {"color": ORANGE, "linestyle": "--"},
}
"""How the two sets are drawn on the first screen."""

IN_THE_PAPER = "Trial 3"  # The trial that is closest to the observed deflection in the paper.
BEYOND = "Beyond the paper"
CHAPTERS = (
    "The finger", "Three levels", "From rates to a percept", "Level 1: skin", "Level 2: afferent",
    "Level 3: population", "Level 3: discrimination", "The border of the nail", BEYOND,
)  # fmt: skip
"""Order of the chapters with figures; one that a figure names beside these comes last."""


def write_report(result: ReproductionResult, folder: Path) -> Path:
    """Write the page of a reproduction, `report.html`, and its figures as `figures/*.png`."""
    return write_html(reproduction_page(result), Path(folder) / "report.html")


def reproduction_page(result: ReproductionResult) -> Page:
    """Return the page of a reproduction: `paper` in the first column of figures, `human` in the second."""
    found = figures("reproduction", result)
    found["The finger"].append(tissue_table(result.tissues))
    chapters = []
    for title in dict.fromkeys((*CHAPTERS, *found)):
        drawings = [part for part in found[title] if isinstance(part, Drawing)]
        tables = [part for part in found[title] if isinstance(part, Table)]
        if title != BEYOND:
            chapters.append(Chapter(title, drawings, tables))
        elif result.paper.single_unit_uncertainty is None:
            text = "uncertainty of the fit and curvature thresholds (`fingerpad reproduce --extended`)"
            chapters.append(Chapter(title, [f"Not run: {text}."], found[title]))
        else:
            chapters.append(Chapter(title, [], found[title]))
    rows = result.paper.comparison, result.human.comparison
    numbers = [statement_table(result.statements), notes_table(*rows), *comparison_tables(*rows)]
    return Page(
        "From a touch to a percept",
        "A finite-element fingertip, slowly adapting afferents and an observer, after Gerling et al. 2014. "
        f"{edition(result.manifest)}",
        [],
        [
            *chapters,
            Chapter("All numbers", [], numbers),
            Chapter("Published numbers used", [], input_tables(result.inputs)),
            manifest_chapter(result.manifest, folded=True),
        ],
        first_screen(result),
        verdict_table(result.statements),
    )


def first_screen(result: ReproductionResult) -> list[Drawing]:
    """Return a picture of each level, both sets in it, with its result as the caption."""
    fits = [f"`{name}` {fixed(getattr(result, name).single_unit.fss_out_of_sample, 2)}" for name in SETS]
    noises = [f"`{name}` {number(getattr(result, name).discrimination.noise_sigma)}" for name in SETS]
    deflection = result.skin_deflection
    r2 = [trial["cylinder"].r2 for trial in (deflection.trial1, deflection.trial2, deflection.trial3)]
    best = f"Trial {1 + int(np.argmax(r2))}"
    said = ", as in the paper." if best == IN_THE_PAPER else f"; in the paper {IN_THE_PAPER} is."
    fss, sigma = fixed(paper.FSS_OUT_OF_SAMPLE.value, 2), number(psychophysics.NOISE_SIGMA.value)
    pictures: tuple[tuple[str, Callable[[Axes, ReproductionResult], None], str], ...] = (
        ("skin", _draw_skin, f"{best} is closest to the observed deflection{said}"),
        ("afferent", _draw_afferent, f"FSS out of sample {joined(fits)}; the paper {fss}."),
        (
            "percept",
            _draw_percept,
            f"noise that fits people's hit rates {joined(noises)}; the paper {sigma}.",
        ),
    )

    def drawn(level: int, name: str, draw: Callable[[Axes, ReproductionResult], None]) -> Figure:
        picture = new_figure(4.6, 3.0)
        axes = picture.subplots()
        draw(axes, result)
        axes.set_title(f"Level {level}: {name}")
        return picture

    return [
        Drawing(
            name.capitalize(),
            {f"level_{level}_{name}": partial(drawn, level, name, draw)},
            f"{name.capitalize()}: {caption}",
        )
        for level, (name, draw, caption) in enumerate(pictures, start=1)
    ]


def _draw_skin(axes: Axes, result: ReproductionResult) -> None:
    """Draw the deflection under the cylinder, downwards."""
    skin.draw_profiles(axes, result.skin_deflection, "cylinder")
    axes.set(xlabel="distance from the axis, distal [mm]", ylabel="deflection [mm]")
    handles, labels = axes.get_legend_handles_labels()
    axes.legend(handles[:4], [label.replace(", R²", "\nR²") for label in labels[:4]], fontsize=7.0)
    axes.invert_yaxis()


def _draw_afferent(axes: Axes, result: ReproductionResult) -> None:
    """Draw the rates of the ramp over the place of the bar."""
    for name, style in LINES.items():
        unit = getattr(result, name).single_unit
        axes.plot(-unit.shift_mm, unit.dynamic_rate_hz, label=name, **style)
    draw_observed_rates(axes, -unit.shift_mm, unit.observed_dynamic_rate_hz)
    axes.set(xlabel=nerve.ALONG, ylabel="rate in the ramp [spikes/s]")
    axes.set_ylim(0.0, 1.25 * axes.get_ylim()[1])
    axes.legend(loc="upper center", ncols=3, fontsize=8.0)


def _draw_percept(axes: Axes, result: ReproductionResult) -> None:
    """Draw the hit rates of the static Gradient Sum over the middle of the receptors."""
    for name, style in LINES.items():
        section = getattr(result, name).discrimination
        rates = section.gradient_sum["static"].hit_rate
        axes.plot(section.curvature_per_m[1:], rates, marker="o", label=name, **style)
    percept.draw_people(axes, section.goodwin)
    axes.set(xlabel="curvature of the sphere [1/m]", ylabel="hit rate [fraction]")
    axes.set_ylim(top=1.02)
    axes.legend(loc="lower right", fontsize=8.0)


SHOWN_MM = (7.0, 4.5)  # Half the width of the skin that is shown, and height above the contact. [mm]


def caption_levels(section: ThreeLevels, *_: object) -> str:
    places = joined([f"{number(offset)} mm" for offset in section.offset_mm])
    return (
        f"One sphere of {number(section.curvature_per_m)} 1/m on the three levels of the model, pressed "
        f"{protocol.DEPTH.value} mm deep in {number(section.ramp_ms)} ms and held. All of it is predicted. "
        "(a) Plane of symmetry of the pressed skin, coloured on a logarithmic scale by what the afferents "
        "follow. (b) Current through the membrane of the afferent below the sphere, its potential and "
        f"its spikes up to {number(section.until_ms)} ms; the rheobase is the smallest constant current that "
        f"elicits spikes. (c) Spikes of three afferents, {places} distal from the axis of the sphere, with "
        "their rates in the ramp and in the hold. Shaded: the sphere moves."
    )


@figure(
    "reproduction", "Three levels", 2, "figure_2_three_levels", "One sphere on three levels", caption_levels,
    of=both("levels"),
)  # fmt: skip
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
    places = mesh_picture.corners(np.stack([section.x_mm, section.y_mm], axis=-1))
    faces = skin.paint_skin(axes, places, section.pressed_kpa.ravel(), edgecolors="#00000030", linewidths=0.2)
    radius = MM_PER_M / section.curvature_per_m
    axes.add_patch(Circle(section.centre_mm, radius, facecolor=skin.BODY, edgecolor=BLACK, linewidth=1.0))
    x, y = section.centre_mm
    width, height = SHOWN_MM
    axes.set(
        title="(a) skin, end of the hold",
        xlim=(x - width, x + width),
        ylim=(y - 1.0, y + radius + height),
        aspect="equal",
        xlabel="x, distal [mm]",
        ylabel="y, dorsal [mm]",
    )
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


TISSUE_NOTE = (
    "Moduli and Poisson's ratio nu are those for small strains. Only the deviator relaxes: the bulk modulus "
    "is the same at once and in the long term, so that nu is smaller at once. The sets trial1, trial2 and "
    "trial3 stand for the paper's three trials; the numbers of its Tables 1 and 2 are lost."
)


def tissue_table(layers: Sequence[TissueLayer]) -> Table:
    """Return each layer of each named set with its law, moduli, relaxation and status."""

    def relaxation(layer: TissueLayer) -> str:
        terms = zip(layer.prony_shares, layer.prony_times_s, strict=True)
        return ", ".join(f"{number(share)} ({number(time)})" for share, time in terms) or "none"

    def statuses(layer: TissueLayer) -> str:
        each = (layer.modulus_status, layer.poisson_status, layer.prony_status)
        return " / ".join(status or ABSENT for status in each)

    columns = (
        Column("tissues", "set"),
        Column("layer"),
        Column("law"),
        Column("shear_kpa", "shear modulus, long-term"),
        Column(
            lambda row: row.shear_at_once_kpa if row.prony_shares else None, "shear modulus, at once [kPa]"
        ),
        Column("poisson", "nu, long-term", 2),
        Column(lambda row: row.poisson_at_once if row.prony_shares else None, "nu, at once", 2),
        Column(relaxation, "Prony shares (times [s])"),
        Column(statuses, "status: modulus / nu / Prony"),
        Column("source", "source of the modulus"),
    )
    return table(
        "Tissues by set and layer (in place of the paper's Tables 1 and 2)", layers, columns, TISSUE_NOTE
    )


def input_tables(inputs: Sequence[Published]) -> list[Table]:
    statuses: list[str] = [entry.status for entry in inputs]
    meanings = [(status, meaning, statuses.count(status)) for status, meaning in STATUSES.items()]
    columns = (
        Column("name", "number"),
        # Inputs are the record of what was used: nothing of them is rounded or left out.
        Column("value", form=partial(plain, digits=12, longest=1000)),
        Column(lambda entry: "" if entry.unit == "1" else entry.unit, "unit"),
        Column("status"),
        Column("source"),
    )
    return [
        table(
            "Status of a number",
            meanings,
            (Column("0", "status"), Column("1", "meaning"), Column("2", "numbers")),
            mark=lambda row: "assumed" if row[0] == "assumed" else "",
        ),
        table(
            "Published numbers",
            inputs,
            columns,
            mark=lambda entry: "assumed" if entry.status == "assumed" else "",
        ),
    ]


SIGNS = {Verdict.MET: "✓", Verdict.MISSED: "✗", Verdict.NOT_DECIDABLE: "?", Verdict.NOT_APPLICABLE: "–"}
"""Sign of each verdict; they differ without colour."""

GROUPS = {
    Group.STATEMENT: (
        "Statements of the paper that can fail",
        "Nothing was fitted to these statements themselves; the notes say what was fitted before.",
    ),
    Group.FITTED: (
        "Numbers that were fitted or chosen in sample",
        "Something was fitted to these numbers or chosen by them: a number that is met shows that the model "
        "can have it, and is no prediction.",
    ),
    Group.DEFINITION: (
        "Consequences of definitions",
        "They follow from how hit rates and error bars are defined, and hold for nearly any model.",
    ),
    Group.ADDITION: (
        "Our own additions",
        "The paper says nothing about these that could be judged. The bounds are ours or those of other "
        "publications.",
    ),
}
"""Title and meaning of each group of rows."""

SET_NOTE = (
    "`paper` is the paper's own system: Trial 3 with a Poisson's ratio of 0.40, strain energy density in "
    "both terms, response surfaces. `human` serves all three levels."
)


def side_by_side(paper: Sequence[ClaimRow], human: Sequence[ClaimRow]) -> list[tuple[ClaimRow, Row]]:
    """Return the rows that are no statement, each with its cells for both sets."""
    by_name = [{row.quantity: row for row in rows} for rows in (paper, human)]
    stated = {row.quantity for row in (*paper, *human) if row.group is Group.STATEMENT}
    names = dict.fromkeys(row.quantity for row in (*paper, *human) if row.quantity not in stated)
    made = []
    for pair in ([found.get(name) for found in by_name] for name in names):
        known = [row for row in pair if row is not None]
        cells = [known[0].quantity, known[0].paper]
        for row in pair:
            cells += [ABSENT, ""] if row is None else [row.ours, _marked(row.verdict, row.fitted_to)]
        told = dict.fromkeys("; ".join(text for text in (row.fitted_to, row.note) if text) for row in known)
        # A number that one set was fitted to is shown as fitted.
        first = min(known, key=lambda row: row.group is not Group.FITTED)
        made.append((first, Row((*cells, " | ".join(told)))))
    return made


def comparison_tables(paper: Sequence[ClaimRow], human: Sequence[ClaimRow]) -> list[Table]:
    """Return one table per group of rows that are no statement, both sets side by side."""
    rows = side_by_side(paper, human)
    found = {group: [row for first, row in rows if first.group is group] for group in GROUPS}
    columns = ("quantity", "the paper", "`paper`", "", "`human`", "", "what was fitted, and how it is judged")
    return [Table(GROUPS[group][0], columns, each, GROUPS[group][1]) for group, each in found.items() if each]


def notes_table(paper: Sequence[ClaimRow], human: Sequence[ClaimRow]) -> Table:
    """Return how each statement that can fail was judged, and what was fitted before, set by set."""
    notes: dict[str, str] = {}
    for name, found in (("`paper`", paper), ("`human`", human)):
        for row in found:
            if row.group is Group.STATEMENT:
                before = notes.get(row.quantity)
                notes[row.quantity] = f"{before}; {name}: {row.note}" if before else f"{name}: {row.note}"
    meaning = GROUPS[Group.STATEMENT][1]
    return listed("How the statements are judged", notes, ("statement", "note"), meaning)


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


def statement_table(statements: Sequence[Statement]) -> Table:
    """Return every statement that can fail with our value and verdict of both sets."""
    columns = ("section", "statement", "the paper", "`paper`", "", "`human`", "")
    rows = [Row((each.section, *statement_cells(each))) for each in statements]
    return Table(GROUPS[Group.STATEMENT][0], columns, rows, SET_NOTE)


def verdict_table(statements: Sequence[Statement]) -> Table:
    """Return the verdict of every statement that can fail with both sets, and how many are met."""
    rows = [Row((f"{each.section} {each.statement}", *statement_cells(each)[3::2])) for each in statements]
    met = (sum(getattr(each, f"verdict_{name}") is Verdict.MET for each in statements) for name in SETS)
    rows.append(Row(("met", *(f"{count} of {len(statements)}" for count in met)), "final"))
    columns = ("section and statement of the paper", *(f"`{name}`" for name in SETS))
    return Table("", columns, rows, SET_NOTE)


def statement_cells(each: Statement) -> tuple[str, ...]:
    """Return what the paper says, and our value and verdict of both sets."""
    ours = [
        (getattr(each, name), _marked(getattr(each, f"verdict_{name}"), getattr(each, f"fitted_{name}")))
        for name in SETS
    ]
    return each.statement, each.published, *ours[0], *ours[1]


def _marked(verdict: Verdict, fitted: str) -> str:
    """Sign and words of a verdict, and whether something was fitted to it."""
    return f"{SIGNS[verdict]} {verdict.value}" + (" (fitted)" if fitted else "")
