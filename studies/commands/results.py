"""`python -m studies results`: the pages that show the numbers of a reproduction."""

from __future__ import annotations

from pathlib import Path
from typing import Annotated

import typer

from fingerpad.core.files import write_atomically
from fingerpad.core.results import from_json, to_json

ROOT = Path(__file__).parents[2]
README, DOCS = ROOT / "README.md", ROOT / "docs"
PAGE, PAPER = DOCS / "results.md", DOCS / "paper.md"
NUMBERS, PICTURE = DOCS / "results.json", DOCS / "images" / "chain.png"
COMMANDS, TISSUES = DOCS / "command-line.md", DOCS / "tissues.md"


def results_command(
    results: Annotated[
        Path | None,
        typer.Argument(help="results.json of `fingerpad reproduce --extended`. Default: docs/results.json."),
    ] = None,
    methods: Annotated[
        Path | None,
        typer.Option(help="methods.json of `python -m studies methods`. Default: keep the rows shown now."),
    ] = None,
    drives: Annotated[
        Path | None,
        typer.Option(help="drives.json of `python -m studies drives`. Default: keep the rows shown now."),
    ] = None,
    readings: Annotated[
        Path | None,
        typer.Option(help="sed-readings.json of `python -m studies sed-readings`. Default: keep the rows."),
    ] = None,
    picture: Annotated[
        bool, typer.Option(help="Also press the standard sphere and draw the README's picture.")
    ] = True,
) -> None:
    """Write results, paper, command-line and tissues of docs, and table and picture of the README."""
    from fingerpad.report.style import write_png
    from studies import chain_picture, command_line_page, results_page, tissue_page

    shown = from_json(results_page.Excerpt, NUMBERS.read_bytes())
    if results is not None:
        shown = results_page.read_excerpt(results, methods, drives, readings, shown)
    readme = results_page.with_table(README.read_text(encoding="utf-8"), shown)
    write_atomically(NUMBERS, to_json(shown) + b"\n")
    write_atomically(PAGE, results_page.results_page(shown).encode())
    write_atomically(PAPER, results_page.paper_page(shown).encode())
    write_atomically(README, readme.encode())
    write_atomically(COMMANDS, command_line_page.command_line_page().encode())
    write_atomically(TISSUES, tissue_page.tissue_page().encode())
    written = [NUMBERS, PAGE, PAPER, README, COMMANDS, TISSUES]
    if picture:
        percept = shown.percept["human"]
        skin, response = chain_picture.touched(percept.standard_per_m, shown.resolution)
        write_png(lambda parts: chain_picture.draw(*parts), (skin, response, percept), PICTURE)
        written.append(PICTURE)
    for path in written:
        typer.echo(f"Written: {path.relative_to(ROOT)}")
