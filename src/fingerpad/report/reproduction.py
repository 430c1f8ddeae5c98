"""The page of a reproduction: a first screen, a chapter per level, comparison with the paper."""

from __future__ import annotations

from collections.abc import Callable, Sequence
from dataclasses import replace
from functools import partial
from pathlib import Path
from typing import Any

import numpy as np
from matplotlib.axes import Axes
from matplotlib.figure import Figure

from fingerpad.data import STATUSES, paper, psychophysics
from fingerpad.experiments.gerling2014.reproduction import PublishedNumber, ReproductionResult
from fingerpad.experiments.tissue_sets import TissueLayer
from fingerpad.report import (
    curvature_thresholds,
    discrimination,
    mesh_picture,
    responses,
    single_unit,
    skin_deflection,
    three_levels,
)
from fingerpad.report.comparison import comparison_tables, notes_table, statement_table, verdict_table
from fingerpad.report.formatting import ABSENT, fixed, joined, number, plain
from fingerpad.report.parts import (
    COLUMNS,
    Chapter,
    Drawing,
    Page,
    Paragraph,
    Part,
    Row,
    Table,
    edition,
    manifest_chapter,
    write_html,
)
from fingerpad.report.style import BLUE, ORANGE, LineStyle, draw_observed_rates, new_figure

# Inputs are the record of what was used: nothing of them is rounded or left out.
ALL_DIGITS, ALL_VALUES = 12, 1000

LINES: dict[str, LineStyle] = {
    "paper": {"color": BLUE, "linestyle": "-"},
    "human": {"color": ORANGE, "linestyle": "--"},
}
"""How the two sets are drawn on the first screen."""

IN_THE_PAPER = "Trial 3"  # The trial that is closest to the observed deflection in the paper.


def write_report(result: ReproductionResult, folder: Path) -> Path:
    """Write the page of a reproduction, `report.html`, and its figures as `figures/*.png`."""
    return write_html(reproduction_page(result), Path(folder) / "report.html")


def reproduction_page(result: ReproductionResult) -> Page:
    """Return the page of a reproduction: `paper` in the first column of figures, `human` in the second."""
    paper, human, deflection = result.paper, result.human, result.skin_deflection
    sets = {name: getattr(result, name).discrimination for name in COLUMNS}

    def drawn(
        n: int, name: str, title: str, part: Any, draw: Callable[..., Figure], caption: Callable[..., str]
    ) -> Drawing:
        """Figure of both sets where `part` names what they have, else of one thing."""
        both = [getattr(each, part) for each in (paper, human)] if isinstance(part, str) else [part]
        first, *second = (partial(draw, each) for each in both)
        return Drawing(f"figure_{n}_{name}", title, first, caption(both[0]), n, *second)

    def tables(part: str, of: Callable[[Any], Sequence[Table]]) -> list[Table]:
        return [
            replace(table, title=f"{table.title}, {name}")
            for name in COLUMNS
            for table in of(getattr(getattr(result, name), part))
        ]

    mesh = drawn(
        1, "mesh", "Mesh of the finger", paper.mesh, mesh_picture.draw_mesh, mesh_picture.caption_mesh
    )
    levels = drawn(
        2, "three_levels", "One sphere on three levels", "levels",
        three_levels.draw_levels, three_levels.caption_levels,
    )  # fmt: skip
    steps = drawn(
        3, "steps", "Steps to a hit rate", sets, discrimination.draw_steps, discrimination.caption_steps
    )
    skin = drawn(
        4, "skin_deflection", "Deflection of the skin", deflection,
        skin_deflection.draw_skin_deflection, skin_deflection.caption_skin_deflection,
    )  # fmt: skip
    rates = drawn(
        5, "single_unit", "Rates under a bar", "single_unit",
        single_unit.draw_single_unit, single_unit.caption_single_unit,
    )  # fmt: skip
    maps = drawn(
        6, "population", "Rates and latencies under a sphere", "population",
        responses.draw_population, partial(responses.caption_population, human=human.population),
    )  # fmt: skip
    observers = drawn(
        7, "discrimination", "Discrimination of spheres", "discrimination",
        discrimination.draw_observers, discrimination.caption_observers,
    )  # fmt: skip
    criterion = drawn(
        8, "varied_criterion", "The same with a varied criterion", "discrimination",
        discrimination.draw_criterion, discrimination.caption_criterion,
    )  # fmt: skip
    border = drawn(
        9, "nail", "Stress at the border of the nail", "nail",
        skin_deflection.draw_nail, skin_deflection.caption_nail,
    )  # fmt: skip
    more: list[Part] = []
    beyond: list[Part] = [
        drawn(
            10, "noise", "Amount of noise", "discrimination",
            discrimination.draw_noise, discrimination.caption_noise,
        )
    ]  # fmt: skip
    if paper.single_unit_uncertainty is None:
        text = "uncertainty of the fit and curvature thresholds (`fingerpad reproduce --extended`)"
        more.append(Paragraph(f"Not run: {text}."))
    else:
        beyond += [
            drawn(
                11, "uncertainty", "Uncertainty of the fit", "single_unit_uncertainty",
                single_unit.draw_uncertainty, single_unit.caption_uncertainty,
            ),
            *tables("single_unit_uncertainty", single_unit.uncertainty_tables),
            drawn(
                12, "curvature_thresholds", "Thresholds of curvature", "curvature_thresholds",
                curvature_thresholds.draw_thresholds, curvature_thresholds.caption_thresholds,
            ),
            *tables("curvature_thresholds", curvature_thresholds.threshold_tables),
        ]  # fmt: skip
    rows = paper.comparison, human.comparison
    numbers = [statement_table(result.statements), notes_table(*rows), *comparison_tables(*rows)]
    single_units = tables("single_unit", single_unit.single_unit_tables)
    return Page(
        "From a touch to a percept",
        "A finite-element fingertip, slowly adapting afferents and an observer, after Gerling et al. 2014. "
        f"{edition(result.manifest)}",
        [],
        [
            Chapter("The finger", [mesh], [tissue_table(result.tissues)]),
            Chapter("Three levels", [levels]),
            Chapter("From rates to a percept", [steps]),
            Chapter("Level 1: skin", [skin], skin_deflection.skin_deflection_tables(deflection)),
            Chapter("Level 2: afferent", [rates], single_units),
            Chapter("Level 3: population", [maps]),
            Chapter(
                "Level 3: discrimination",
                [observers, criterion],
                tables("discrimination", discrimination.discrimination_tables),
            ),
            Chapter("The border of the nail", [border]),
            Chapter("Beyond the paper", more, beyond),
            Chapter("All numbers", [], numbers),
            Chapter("Published numbers used", [], input_tables(result.inputs)),
            Chapter("Provenance", [], manifest_chapter(result.manifest).parts),
        ],
        first_screen(result),
        verdict_table(result.statements),
    )


def input_tables(inputs: Sequence[PublishedNumber]) -> list[Table]:
    meanings = [
        Row.of(
            status,
            meaning,
            plain(sum(entry.status == status for entry in inputs)),
            kind="assumed" if status == "assumed" else "",
        )
        for status, meaning in STATUSES.items()
    ]
    numbers = [
        Row.of(
            entry.name,
            plain(entry.value, digits=ALL_DIGITS, longest=ALL_VALUES),
            "" if entry.unit == "1" else entry.unit,
            entry.status,
            entry.source,
            kind="assumed" if entry.status == "assumed" else "",
        )
        for entry in inputs
    ]
    return [
        Table("Status of a number", ("status", "meaning", "numbers"), meanings),
        Table("Published numbers", ("number", "value", "unit", "status", "source"), numbers),
    ]


def first_screen(result: ReproductionResult) -> list[Drawing]:
    """Return a picture of each level, both sets in it, with its result as the caption."""
    fits = [f"`{name}` {fixed(getattr(result, name).single_unit.fss_out_of_sample, 2)}" for name in COLUMNS]
    noises = [f"`{name}` {number(getattr(result, name).discrimination.noise_sigma)}" for name in COLUMNS]
    deflection = result.skin_deflection
    r2 = [trial.cylinder.r2 for trial in (deflection.trial1, deflection.trial2, deflection.trial3)]
    best = f"Trial {1 + int(np.argmax(r2))}"
    said = ", as in the paper." if best == IN_THE_PAPER else f"; in the paper {IN_THE_PAPER} is."
    captions = {
        "skin": f"Skin: {best} is closest to the observed deflection{said}",
        "afferent": f"Afferent: FSS out of sample {joined(fits)}; the paper "
        f"{fixed(paper.FSS_OUT_OF_SAMPLE.value, 2)}.",
        "percept": f"Percept: noise that fits people's hit rates {joined(noises)}; the paper "
        f"{number(psychophysics.NOISE_SIGMA.value)}.",
    }
    drawn = zip(captions.items(), (_draw_skin, _draw_afferent, _draw_percept), strict=True)
    return [
        Drawing(f"level_{level}_{name}", name.capitalize(), partial(_draw_level, result, draw), caption)
        for level, ((name, caption), draw) in enumerate(drawn, start=1)
    ]


def _draw_level(result: ReproductionResult, draw: Callable[[Axes, ReproductionResult], None]) -> Figure:
    figure = new_figure(4.6, 3.0)
    draw(figure.subplots(), result)
    return figure


def _draw_skin(axes: Axes, result: ReproductionResult) -> None:
    """Draw the deflection under the cylinder, downwards."""
    skin_deflection.draw_profiles(axes, result.skin_deflection, skin_deflection.CYLINDER)
    axes.set(title="Level 1: skin", xlabel="distance from the axis, distal [mm]", ylabel="deflection [mm]")
    handles, labels = axes.get_legend_handles_labels()
    axes.legend(handles[:4], [label.replace(", R²", "\nR²") for label in labels[:4]], fontsize=7.0)
    axes.invert_yaxis()


def _draw_afferent(axes: Axes, result: ReproductionResult) -> None:
    """Draw the rates of the ramp over the place of the bar."""
    for name, style in LINES.items():
        unit = getattr(result, name).single_unit
        axes.plot(-unit.shift_mm, unit.dynamic_rate_hz, label=name, **style)
    draw_observed_rates(axes, -unit.shift_mm, unit.observed_dynamic_rate_hz)
    axes.set(title="Level 2: afferent", xlabel=single_unit.ALONG, ylabel="rate in the ramp [spikes/s]")
    axes.set_ylim(0.0, 1.25 * axes.get_ylim()[1])
    axes.legend(loc="upper center", ncols=3, fontsize=8.0)


def _draw_percept(axes: Axes, result: ReproductionResult) -> None:
    """Draw the hit rates of the static Gradient Sum over the middle of the receptors."""
    for name, style in LINES.items():
        section = getattr(result, name).discrimination
        rates = section.gradient_sum["static"].hit_rate
        axes.plot(section.curvature_per_m[1:], rates, marker="o", label=name, **style)
    discrimination.draw_people(axes, section.goodwin)
    axes.set(title="Level 3: percept", xlabel="curvature of the sphere [1/m]", ylabel="hit rate [fraction]")
    axes.set_ylim(top=1.02)
    axes.legend(loc="lower right", fontsize=8.0)


TISSUE_NOTE = (
    "Moduli and Poisson's ratio nu are those for small strains. Only the deviator relaxes: the bulk modulus "
    "is the same at once and in the long term, so that nu is smaller at once. The sets trial1, trial2 and "
    "trial3 stand for the paper's three trials; the numbers of its Tables 1 and 2 are lost."
)


def tissue_table(layers: Sequence[TissueLayer]) -> Table:
    """Return each layer of each named set with its law, moduli, relaxation and status."""
    rows = []
    for layer in layers:
        terms = zip(layer.prony_shares, layer.prony_times_s, strict=True)
        statuses = (layer.modulus_status, layer.poisson_status, layer.prony_status)
        rows.append(
            Row.of(
                layer.tissues,
                layer.layer,
                layer.law,
                number(layer.shear_kpa),
                number(layer.shear_at_once_kpa) if layer.prony_shares else ABSENT,
                fixed(layer.poisson, 2),
                fixed(layer.poisson_at_once, 2) if layer.prony_shares else ABSENT,
                ", ".join(f"{number(share)} ({number(time)})" for share, time in terms) or "none",
                " / ".join(status or ABSENT for status in statuses),
                layer.source,
            )
        )
    columns = (
        "set", "layer", "law", "shear modulus, long-term [kPa]", "shear modulus, at once [kPa]",
        "nu, long-term", "nu, at once", "Prony shares (times [s])", "status: modulus / nu / Prony",
        "source of the modulus",
    )  # fmt: skip
    title = "Tissues by set and layer (in place of the paper's Tables 1 and 2)"
    return Table(title, columns, rows, TISSUE_NOTE)
