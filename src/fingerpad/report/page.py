"""Results -> figures and one self-contained page."""

from __future__ import annotations

import base64
from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass
from pathlib import Path
from typing import Any

from jinja2 import Environment, PackageLoader, StrictUndefined, Template
from matplotlib.figure import Figure

from fingerpad.core.errors import InputError
from fingerpad.core.files import write_atomically
from fingerpad.report import (
    curvature_thresholds,
    discrimination,
    drive_quantities,
    nail,
    population,
    population_rate,
    recruitment,
    single_unit,
    single_unit_methods,
    single_unit_uncertainty,
    skin_deflection,
    spike_fit,
    tables,
)
from fingerpad.report.style import png
from fingerpad.report.summary import summary


@dataclass(frozen=True)
class Drawing:
    """One figure of the report: its number, file name, and what draws and explains it.

    Numbers up to 9 are the paper's; figures that the paper does not have go on from 10.
    """

    number: int
    name: str
    title: str
    draw: Callable[[Any], Figure]
    caption: Callable[[Any], str]


@dataclass(frozen=True)
class Chapter:
    """One section of the results on the page: its figures, then its tables."""

    section: str
    title: str
    drawings: tuple[Drawing, ...]
    tables: Callable[[Any], list[tables.Table]]


def _no_tables(_: Any) -> list[tables.Table]:
    return []


METHODS = "single_unit_methods"
"""What a page calls the part of the section single_unit that compares methods; its tables stand there."""

CHAPTERS = (
    Chapter(
        "skin_deflection",
        "Level 1: skin",
        (
            Drawing(
                4,
                "figure_4_skin_deflection",
                "Deflection of the skin",
                skin_deflection.draw,
                skin_deflection.caption,
            ),
        ),
        tables.skin_deflection,
    ),
    Chapter(
        "single_unit",
        "Level 2: single afferent",
        (Drawing(5, "figure_5_single_unit", "Rates under a bar", single_unit.draw, single_unit.caption),),
        lambda section: tables.single_unit(section) + single_unit_methods.tables(section),
    ),
    Chapter(
        METHODS,
        "Level 2: methods of fitting",
        (
            Drawing(
                17,
                "figure_17_methods",
                "Methods of fitting on the same folds",
                single_unit_methods.draw,
                single_unit_methods.caption,
            ),
        ),
        _no_tables,
    ),
    Chapter(
        "single_unit_uncertainty",
        "Level 2: what the rates determine",
        (
            Drawing(
                12,
                "figure_12_uncertainty",
                "What rates under a bar determine",
                single_unit_uncertainty.draw,
                single_unit_uncertainty.caption,
            ),
        ),
        single_unit_uncertainty.tables,
    ),
    Chapter(
        "drive_quantities",
        "Which quantity drives the afferent",
        (
            Drawing(
                10,
                "figure_10_drive_quantities",
                "Rates by quantity",
                drive_quantities.draw,
                drive_quantities.caption,
            ),
        ),
        drive_quantities.table,
    ),
    Chapter(
        "spike_fit",
        "Level 2: spike trains",
        (Drawing(11, "figure_11_spike_fit", "Spikes and their fit", spike_fit.draw, spike_fit.caption),),
        spike_fit.table,
    ),
    Chapter(
        "population",
        "Level 3: population",
        (
            Drawing(
                6,
                "figure_6_population",
                "Rates and latencies under a sphere",
                population.draw,
                population.caption,
            ),
        ),
        _no_tables,
    ),
    Chapter(
        "population_timing",
        "Level 3: when a population fires",
        (
            Drawing(
                13,
                "figure_13_recruitment",
                "Order of first spikes",
                lambda section: recruitment.draw(section["recruitment"]),
                lambda section: recruitment.caption(section["recruitment"]),
            ),
            Drawing(
                14,
                "figure_14_population_rate",
                "Population rate over time",
                lambda section: population_rate.draw(section["rates"]),
                lambda section: population_rate.caption(section["rates"]),
            ),
        ),
        lambda section: recruitment.tables(section["recruitment"]),
    ),
    Chapter(
        "discrimination",
        "Level 3: discrimination",
        (
            Drawing(
                7,
                "figure_7_discrimination",
                "Spheres told from the standard",
                discrimination.draw_observers,
                discrimination.caption_observers,
            ),
            Drawing(
                8,
                "figure_8_varied_criterion",
                "The same with a varied criterion",
                discrimination.draw_criterion,
                discrimination.caption_criterion,
            ),
            Drawing(
                15,
                "figure_15_noise",
                "How much noise",
                discrimination.draw_noise,
                discrimination.caption_noise,
            ),
        ),
        lambda section: tables.hit_rates(section) + tables.readings(section),
    ),
    Chapter("mesh_noise", "Level 3: noise of the mesh", (), tables.mesh_noise),
    Chapter(
        "curvature_thresholds",
        "Level 3: thresholds and efficiency",
        (
            Drawing(
                16,
                "figure_16_curvature_thresholds",
                "Least difference of curvature",
                curvature_thresholds.draw,
                curvature_thresholds.caption,
            ),
        ),
        curvature_thresholds.tables,
    ),
    Chapter(
        "nail",
        "The border of the nail",
        (Drawing(9, "figure_9_nail", "Stress at the border of the nail", nail.draw, nail.caption),),
        _no_tables,
    ),
    Chapter("inputs", "What this rests on", (), tables.inputs),
    Chapter("manifest", "How this was made", (), tables.manifest),
)


def write_report(results: Mapping[str, Any], folder: Path) -> Path:
    """Draw finished results: `figures/*.png` and `report.html`, which holds the figures itself.

    Parameters
    ----------
    results : mapping
        JSON-able sections: skin_deflection, single_unit, drive_quantities, spike_fit, population,
        population_timing, discrimination, nail, comparison, inputs and manifest. A section that is absent is
        said to be so; one of another name is listed as it stands. None stands for what does not exist, such
        as the latency of a silent afferent.
    folder : Path
        Made if needed; every file in it is written whole or not at all.

    Returns
    -------
    Path
        The page.

    Raises
    ------
    InputError
        If `results` is no mapping, or a section lacks a part.
    StoreError
        If the folder cannot be written.

    Examples
    --------
    >>> from tempfile import TemporaryDirectory
    >>> with TemporaryDirectory() as folder:
    ...     page = write_report({"manifest": {"seed": 1, "wall_s": 4.2}}, Path(folder))
    ...     page.name, "<td>4.2</td>" in page.read_text(encoding="utf-8")
    ('report.html', True)
    """
    if not isinstance(results, Mapping):
        raise InputError(f"results must map names of sections to sections: got {type(results).__name__}.")
    rows = results.get("comparison")
    others = {key: value for key, value in results.items() if key not in _KNOWN}
    return write_page(
        sections(results),
        CHAPTERS,
        Path(folder) / "report.html",
        heading="From a touch to a percept",
        subtitle="A finite-element fingertip, slowly adapting afferents and an observer, after Gerling et "
        "al. 2014.",
        paragraphs=summary(results),
        comparison=tables.comparison(rows) if rows else None,
        others=[tables.generic(tables.spelled(key), others[key]) for key in others],
    )


def sections(results: Mapping[str, Any]) -> dict[str, Any]:
    """Return the results by chapter: a part that has a chapter of its own beside its section.

    Examples
    --------
    >>> sections({"single_unit": {"methods": {"methods": []}}})["single_unit_methods"]
    {'methods': []}
    """
    return {**results, METHODS: (results.get("single_unit") or {}).get("methods")}


def write_page(
    results: Mapping[str, Any],
    chapters: Sequence[Chapter],
    path: Path,
    *,
    heading: str,
    subtitle: str,
    paragraphs: Sequence[str],
    comparison: tables.Table | None = None,
    others: Sequence[tables.Table] = (),
) -> Path:
    """Draw the chapters of a page: the page at `path`, its figures also beside it in `figures/`.

    Parameters
    ----------
    results : mapping
        JSON-able sections, and "manifest".
    chapters : sequence of Chapter
        What the page has, in order.
    path : Path
        Where it shall be; every file is written whole or not at all.
    heading, subtitle : str
        Its title, and what it is about.
    paragraphs : sequence of str
        What it says first.
    comparison : Table, optional
        A table before the chapters.
    others : sequence of Table
        Tables after them.

    Returns
    -------
    Path
        The page.
    """
    drawn = [_drawn(chapter, results.get(chapter.section)) for chapter in chapters]
    page = _template().render(
        heading=heading,
        subtitle=subtitle,
        edition=_edition(results.get("manifest") or {}),
        summary=paragraphs,
        comparison=comparison,
        chapters=drawn,
        others=others,
    )
    for chapter in drawn:
        for figure in chapter["figures"]:
            write_atomically(path.parent / "figures" / f"{figure['drawing'].name}.png", figure["png"])
    write_atomically(path, page.encode())
    return path


_KNOWN = {"format", "format_version", "comparison", *(chapter.section for chapter in CHAPTERS)}


def _drawn(chapter: Chapter, section: Any) -> dict[str, Any]:
    """Chapter with its figures and tables; empty if the results do not have it."""
    try:
        figures = [
            {"drawing": drawing, "png": png(drawing.draw, section), "caption": drawing.caption(section)}
            for drawing in (chapter.drawings if section else ())
        ]
        return {
            "chapter": chapter,
            "figures": figures,
            "tables": chapter.tables(section) if section else [],
            "absent": not section,
        }
    except KeyError as error:
        raise InputError(f"results[{chapter.section!r}] must hold {error.args[0]!r}: it does not.") from error


def _template() -> Template:
    environment = Environment(
        loader=PackageLoader("fingerpad.report", "."),
        autoescape=True,
        undefined=StrictUndefined,
        trim_blocks=True,
        lstrip_blocks=True,
    )
    environment.filters["base64"] = lambda content: base64.b64encode(content).decode("ascii")
    return environment.get_template("template.html")


def _edition(manifest: Mapping[str, Any]) -> str:
    """Which program made the page and how, as far as the manifest says."""
    words = {"version": "fingerpad {}", "resolution": "{} resolution", "seed": "seed {}"}
    return ", ".join(
        form.format(manifest[key]) for key, form in words.items() if manifest.get(key) is not None
    )
