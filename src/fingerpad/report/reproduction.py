"""The page of a reproduction: summary, comparison with the paper, and a chapter per level."""

from __future__ import annotations

from collections.abc import Callable, Sequence
from dataclasses import replace
from functools import partial
from inspect import signature
from pathlib import Path
from typing import Any

import numpy as np
from matplotlib.figure import Figure

from fingerpad.data import STATUSES, paper, psychophysics
from fingerpad.experiments.gerling2014.reproduction import PublishedNumber, ReproductionResult
from fingerpad.experiments.gerling2014.skin_deflection import SkinDeflectionResult
from fingerpad.report.comparison import comparison_tables, notes_table, statement_table, verdict_table
from fingerpad.report.curvature_thresholds import caption_thresholds, draw_thresholds, threshold_tables
from fingerpad.report.discrimination import (
    caption_criterion,
    caption_noise,
    caption_observers,
    caption_steps,
    discrimination_tables,
    draw_criterion,
    draw_noise,
    draw_observers,
    draw_people,
    draw_steps,
)
from fingerpad.report.formatting import fixed, joined, number, plain
from fingerpad.report.manifest import edition, manifest_chapter
from fingerpad.report.mesh_picture import caption_mesh, draw_mesh
from fingerpad.report.nail import caption_nail, draw_nail
from fingerpad.report.page import write_html
from fingerpad.report.parts import COLUMNS, Chapter, Drawing, Page, Paragraph, Part, Row, Table
from fingerpad.report.population import caption_population, draw_population
from fingerpad.report.single_unit import (
    ALONG,
    caption_single_unit,
    caption_uncertainty,
    draw_single_unit,
    draw_uncertainty,
    single_unit_tables,
    uncertainty_tables,
)
from fingerpad.report.skin_deflection import (
    CYLINDER,
    caption_skin_deflection,
    draw_profiles,
    draw_skin_deflection,
    skin_deflection_tables,
)
from fingerpad.report.style import BLUE, ORANGE, draw_observed_rates, new_figure
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


SIZE_IN = (4.6, 3.0)
LINES = ((BLUE, "-"), (ORANGE, "--"))
"""Colour and dashes of the two sets."""

IN_THE_PAPER = "Trial 3"
"""The trial that is closest to the observed deflection in the paper."""


def first_screen(result: ReproductionResult) -> list[Drawing]:
    """Return a picture of each level, both sets in it, with its result as the caption."""
    fits = [f"`{name}` {fixed(getattr(result, name).single_unit.fss_out_of_sample, 2)}" for name in COLUMNS]
    noises = [f"`{name}` {number(getattr(result, name).discrimination.noise_sigma)}" for name in COLUMNS]
    afferent = (
        f"Afferent: FSS out of sample {joined(fits)}; the paper {fixed(paper.FSS_OUT_OF_SAMPLE.value, 2)}."
    )
    percept = (
        f"Percept: noise that fits people's hit rates {joined(noises)}; the paper "
        f"{number(psychophysics.NOISE_SIGMA.value)}."
    )
    return [
        Drawing("level_1_skin", "Skin", partial(_draw_skin, result), _skin(result.skin_deflection)),
        Drawing("level_2_afferent", "Afferent", partial(_draw_afferent, result), afferent),
        Drawing("level_3_percept", "Percept", partial(_draw_percept, result), percept),
    ]


def _draw_skin(result: ReproductionResult) -> Figure:
    """Draw the deflection under the cylinder, downwards."""
    figure = new_figure(*SIZE_IN)
    axes = figure.subplots()
    draw_profiles(axes, result.skin_deflection, CYLINDER)
    axes.set(title="Level 1: skin", xlabel="distance from the axis, distal [mm]", ylabel="deflection [mm]")
    handles, labels = axes.get_legend_handles_labels()
    axes.legend(handles[:4], [label.replace(", R²", "\nR²") for label in labels[:4]], fontsize=7.0)
    axes.invert_yaxis()
    return figure


def _draw_afferent(result: ReproductionResult) -> Figure:
    """Draw the rates of the ramp over the place of the bar."""
    figure = new_figure(*SIZE_IN)
    axes = figure.subplots()
    for name, (colour, dashes) in zip(COLUMNS, LINES, strict=True):
        unit = getattr(result, name).single_unit
        axes.plot(-unit.shift_mm, unit.dynamic_rate_hz, color=colour, linestyle=dashes, label=name)
    draw_observed_rates(axes, -unit.shift_mm, unit.observed_dynamic_rate_hz)
    axes.set(title="Level 2: afferent", xlabel=ALONG, ylabel="rate in the ramp [spikes/s]")
    axes.set_ylim(0.0, 1.25 * axes.get_ylim()[1])
    axes.legend(loc="upper center", ncols=3, fontsize=8.0)
    return figure


def _draw_percept(result: ReproductionResult) -> Figure:
    """Draw the hit rates of the static Gradient Sum over the middle of the receptors."""
    figure = new_figure(*SIZE_IN)
    axes = figure.subplots()
    for name, (colour, dashes) in zip(COLUMNS, LINES, strict=True):
        section = getattr(result, name).discrimination
        rates = section.gradient_sum["static"].hit_rate
        axes.plot(section.curvature_per_m[1:], rates, color=colour, linestyle=dashes, marker="o", label=name)
    draw_people(axes, section.goodwin)
    axes.set(title="Level 3: percept", xlabel="curvature of the sphere [1/m]", ylabel="hit rate [fraction]")
    axes.set_ylim(top=1.02)
    axes.legend(loc="lower right", fontsize=8.0)
    return figure


def _skin(section: SkinDeflectionResult) -> str:
    fits = [trial.cylinder.r2 for trial in (section.trial1, section.trial2, section.trial3)]
    best = f"Trial {1 + int(np.argmax(fits))}"
    said = ", as in the paper." if best == IN_THE_PAPER else f"; in the paper {IN_THE_PAPER} is."
    return f"Skin: {best} is closest to the observed deflection{said}"
