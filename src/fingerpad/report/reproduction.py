"""The page of a reproduction: summary, comparison with the paper, and a chapter per level."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import replace
from pathlib import Path

from fingerpad.data import STATUSES
from fingerpad.experiments.gerling2014.reproduction import PublishedNumber, ReproductionResult, SetResult
from fingerpad.report.comparison import comparison_tables, count_sentence, notes_table, statement_table
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
from fingerpad.report.parts import Chapter, Drawing, Page, Part, Row, Table, illustrated
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
    """Write the page of a reproduction, `report.html` with its figures, and the figures as `figures/*.png`.

    Parameters
    ----------
    result : ReproductionResult
        From `fingerpad.experiments.gerling2014.reproduce`.
    folder : Path
        Made if needed; every file in it is written whole or not at all.

    Returns
    -------
    Path
        The page.

    Raises
    ------
    StoreError
        If the folder cannot be written.
    """
    return write_html(reproduction_page(result), Path(folder) / "report.html")


def reproduction_page(result: ReproductionResult) -> Page:
    """Return the page of a reproduction; parts beyond the paper are left out where they were not run."""
    return Page(
        "From a touch to a percept",
        "A finite-element fingertip, slowly adapting afferents and an observer, after Gerling et al. 2014. "
        f"{edition(result.manifest)}",
        reproduction_summary(result),
        [
            Chapter("The paper, statement by statement", [statement_table(result.statements)]),
            Chapter("Tissues", [tissue_table(result.tissues)]),
            Chapter(
                "Level 1: skin",
                illustrated(
                    result.skin_deflection,
                    skin_deflection_tables,
                    (
                        4,
                        "skin_deflection",
                        "Deflection of the skin",
                        draw_skin_deflection,
                        caption_skin_deflection,
                    ),
                ),
            ),
            *_levels("paper", result.paper),
            *_levels("human", result.human),
            Chapter(
                "Further numbers beside the paper",
                [
                    notes_table(result.paper.comparison, result.human.comparison),
                    *comparison_tables(result.paper.comparison, result.human.comparison),
                ],
            ),
            Chapter("Published numbers used", input_tables(result.inputs)),
            manifest_chapter(result.manifest),
        ],
        first_screen(result),
    )


def _levels(name: str, result: SetResult) -> list[Chapter]:
    """Return the chapters of one set in the paper's order of figures, then what goes beyond the paper."""
    chapters: dict[str, Sequence[Part]] = {
        "The finger": illustrated(
            result.mesh,
            None,
            (1, "mesh", "Mesh of the finger and its four layers", draw_mesh, caption_mesh),
        ),
        "Three levels": illustrated(
            result.levels,
            None,
            (2, "three_levels", "One sphere on three levels", draw_levels, caption_levels),
        ),
        "From rates to a percept": illustrated(
            result.discrimination, None, (3, "steps", "Steps to a hit rate", draw_steps, caption_steps)
        ),
        "Level 2: single afferent": illustrated(
            result.single_unit,
            single_unit_tables,
            (5, "single_unit", "Rates under a bar", draw_single_unit, caption_single_unit),
        ),
        "Level 3: population": illustrated(
            result.population,
            None,
            (6, "population", "Rates and latencies under a sphere", draw_population, caption_population),
        ),
        "Level 3: discrimination": illustrated(
            result.discrimination,
            discrimination_tables,
            (7, "discrimination", "Discrimination of spheres", draw_observers, caption_observers),
            (8, "varied_criterion", "The same with a varied criterion", draw_criterion, caption_criterion),
        ),
        "The border of the nail": illustrated(
            result.nail,
            None,
            (9, "nail", "Stress at the border of the nail", draw_nail, caption_nail),
        ),
        "Beyond the paper: noise": illustrated(
            result.discrimination, None, (10, "noise", "Amount of noise", draw_noise, caption_noise)
        ),
        "Beyond the paper: uncertainty of the fit": illustrated(
            result.single_unit_uncertainty,
            uncertainty_tables,
            (11, "uncertainty", "Uncertainty of the fit", draw_uncertainty, caption_uncertainty),
        ),
        "Beyond the paper: curvature thresholds": illustrated(
            result.curvature_thresholds,
            threshold_tables,
            (12, "curvature_thresholds", "Thresholds of curvature", draw_thresholds, caption_thresholds),
        ),
    }
    return [
        Chapter(f"{name}: {title}", [_of_set(part, name) for part in parts])
        for title, parts in chapters.items()
        if parts
    ]


def _of_set(part: Part, name: str) -> Part:
    """Put the number of a figure and the set before the name of its file."""
    if not isinstance(part, Drawing):
        return part
    return replace(part, name=f"figure_{part.number}_{part.name}_{name}", title=f"{part.title}, {name}")


def reproduction_summary(result: ReproductionResult) -> list[str]:
    """Return the paragraphs above the pictures of the levels: what was met and missed."""
    paragraphs = [count_sentence(result.statements, name) for name in ("paper", "human")]
    if result.paper.single_unit_uncertainty is None:
        paragraphs.append(
            "Parts beyond the paper were not run: uncertainty of the fit and curvature thresholds "
            "(`fingerpad reproduce --extended`)."
        )
    return paragraphs


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
