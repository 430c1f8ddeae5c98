"""The page of a reproduction: summary, comparison with the paper, and a chapter per level."""

from __future__ import annotations

from collections.abc import Callable, Sequence
from dataclasses import replace
from functools import partial
from inspect import signature
from pathlib import Path
from typing import Any

from matplotlib.figure import Figure

from fingerpad.data import STATUSES
from fingerpad.experiments.gerling2014.reproduction import PublishedNumber, ReproductionResult
from fingerpad.report.comparison import comparison_tables, notes_table, statement_table, verdict_table
from fingerpad.report.curvature_thresholds import caption_thresholds, draw_thresholds, threshold_tables
from fingerpad.report.discrimination import (
    caption_criterion,
    caption_noise,
    caption_observers,
    discrimination_tables,
    draw_criterion,
    draw_noise,
    draw_observers,
)
from fingerpad.report.discrimination_steps import caption_steps, draw_steps
from fingerpad.report.first_screen import first_screen
from fingerpad.report.formatting import plain
from fingerpad.report.manifest import edition, manifest_chapter
from fingerpad.report.mesh_picture import caption_mesh, draw_mesh
from fingerpad.report.nail import caption_nail, draw_nail
from fingerpad.report.page import write_html
from fingerpad.report.parts import COLUMNS, Chapter, Drawing, Page, Paragraph, Part, Row, Table
from fingerpad.report.population import caption_population, draw_population
from fingerpad.report.single_unit import caption_single_unit, draw_single_unit, single_unit_tables
from fingerpad.report.single_unit_uncertainty import (
    caption_uncertainty,
    draw_uncertainty,
    uncertainty_tables,
)
from fingerpad.report.skin_deflection import (
    caption_skin_deflection,
    draw_skin_deflection,
    skin_deflection_tables,
)
from fingerpad.report.three_levels import caption_levels, draw_levels
from fingerpad.report.tissues import tissue_table

# Inputs are the record of what was used: nothing of them is rounded or left out.
ALL_DIGITS, ALL_VALUES = 12, 1000


def write_report(result: ReproductionResult, folder: Path) -> Path:
    """Write the page of a reproduction, `report.html`, and its figures as `figures/*.png`."""
    return write_html(reproduction_page(result), Path(folder) / "report.html")


def reproduction_page(result: ReproductionResult) -> Page:
    """Return the page of a reproduction: `paper` in the first column of figures, `human` in the second."""
    paper, human = result.paper, result.human

    def pair(
        number: int,
        name: str,
        title: str,
        part: str,
        draw: Callable[..., Figure],
        caption: Callable[..., str],
    ) -> Drawing:
        first, second = getattr(paper, part), getattr(human, part)
        text = caption(first, second) if len(signature(caption).parameters) > 1 else caption(first)
        name = f"figure_{number}_{name}"
        return Drawing(name, title, partial(draw, first), text, number, partial(draw, second))

    def tables(part: str, of: Callable[[Any], Sequence[Table]]) -> list[Table]:
        return [
            replace(table, title=f"{table.title}, {name}")
            for name in COLUMNS
            for table in of(getattr(getattr(result, name), part))
        ]

    def single(
        number: int, name: str, title: str, draw: Callable[..., Figure], part: Any, text: str
    ) -> Drawing:
        return Drawing(f"figure_{number}_{name}", title, partial(draw, part), text, number)

    deflection, mesh = result.skin_deflection, paper.mesh
    sets = {name: getattr(result, name).discrimination for name in COLUMNS}
    more: list[Part] = []
    beyond: list[Part] = [pair(10, "noise", "Amount of noise", "discrimination", draw_noise, caption_noise)]
    if paper.single_unit_uncertainty is None:
        text = "uncertainty of the fit and curvature thresholds (`fingerpad reproduce --extended`)"
        more.append(Paragraph(f"Not run: {text}."))
    else:
        beyond += [
            pair(
                11,
                "uncertainty",
                "Uncertainty of the fit",
                "single_unit_uncertainty",
                draw_uncertainty,
                caption_uncertainty,
            ),
            *tables("single_unit_uncertainty", uncertainty_tables),
            pair(
                12,
                "curvature_thresholds",
                "Thresholds of curvature",
                "curvature_thresholds",
                draw_thresholds,
                caption_thresholds,
            ),
            *tables("curvature_thresholds", threshold_tables),
        ]
    chapters = [
        Chapter(
            "The finger",
            [single(1, "mesh", "Mesh of the finger", draw_mesh, mesh, caption_mesh(mesh))],
            [tissue_table(result.tissues)],
        ),
        Chapter(
            "Three levels",
            [pair(2, "three_levels", "One sphere on three levels", "levels", draw_levels, caption_levels)],
        ),
        Chapter(
            "From rates to a percept",
            [single(3, "steps", "Steps to a hit rate", draw_steps, sets, caption_steps(sets))],
        ),
        Chapter(
            "Level 1: skin",
            [
                single(
                    4,
                    "skin_deflection",
                    "Deflection of the skin",
                    draw_skin_deflection,
                    deflection,
                    caption_skin_deflection(deflection),
                )
            ],
            skin_deflection_tables(deflection),
        ),
        Chapter(
            "Level 2: afferent",
            [
                pair(
                    5,
                    "single_unit",
                    "Rates under a bar",
                    "single_unit",
                    draw_single_unit,
                    caption_single_unit,
                )
            ],
            tables("single_unit", single_unit_tables),
        ),
        Chapter(
            "Level 3: population",
            [
                pair(
                    6,
                    "population",
                    "Rates and latencies under a sphere",
                    "population",
                    draw_population,
                    caption_population,
                )
            ],
        ),
        Chapter(
            "Level 3: discrimination",
            [
                pair(
                    7,
                    "discrimination",
                    "Discrimination of spheres",
                    "discrimination",
                    draw_observers,
                    caption_observers,
                ),
                pair(
                    8,
                    "varied_criterion",
                    "The same with a varied criterion",
                    "discrimination",
                    draw_criterion,
                    caption_criterion,
                ),
            ],
            tables("discrimination", discrimination_tables),
        ),
        Chapter(
            "The border of the nail",
            [pair(9, "nail", "Stress at the border of the nail", "nail", draw_nail, caption_nail)],
        ),
        Chapter("Beyond the paper", more, beyond),
        Chapter(
            "All numbers",
            [],
            [
                statement_table(result.statements),
                notes_table(paper.comparison, human.comparison),
                *comparison_tables(paper.comparison, human.comparison),
            ],
        ),
        Chapter("Published numbers used", [], input_tables(result.inputs)),
        Chapter("Provenance", [], manifest_chapter(result.manifest).parts),
    ]
    return Page(
        "From a touch to a percept",
        "A finite-element fingertip, slowly adapting afferents and an observer, after Gerling et al. 2014. "
        f"{edition(result.manifest)}",
        [],
        chapters,
        first_screen(result),
        verdict_table(result.statements),
    )


def input_tables(inputs: Sequence[PublishedNumber]) -> list[Table]:
    """Return the meaning of each status, and every published number with its own."""
    meanings = [
        Row(
            (status, meaning, plain(sum(entry.status == status for entry in inputs))),
            "assumed" if status == "assumed" else "",
        )
        for status, meaning in STATUSES.items()
    ]
    listed = [
        Row(
            (
                entry.name,
                plain(entry.value, digits=ALL_DIGITS, longest=ALL_VALUES),
                "" if entry.unit == "1" else entry.unit,
                entry.status,
                entry.source,
            ),
            "assumed" if entry.status == "assumed" else "",
        )
        for entry in inputs
    ]
    return [
        Table("Status of a number", ("status", "meaning", "numbers"), meanings),
        Table("Published numbers", ("number", "value", "unit", "status", "source"), listed),
    ]
