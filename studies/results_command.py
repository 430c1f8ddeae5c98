"""`python -m studies results`: the pages that show the numbers of a reproduction."""

from __future__ import annotations

import argparse
from pathlib import Path

from fingerpad.cli.commands import Command, option
from fingerpad.core.files import write_atomically
from fingerpad.core.result_files import from_json, to_json
from fingerpad.report.style import write_png
from studies import chain_picture, results_page, tissue_page
from studies.pages import DOCS, IMAGES, write_blocks

README, NUMBERS, PICTURE = DOCS.parent / "README.md", DOCS / "results.json", IMAGES / "chain.png"


def _add(parser: argparse.ArgumentParser) -> None:
    of_results = "results.json of `fingerpad reproduce --extended`. Default: docs/results.json."
    parser.add_argument("results", nargs="?", type=Path, metavar="RESULTS", help=of_results)
    option(parser, "--no-picture", "Do not press the standard sphere for the README's picture.", bool)


def write_pages(results: Path | None = None, picture: bool = True) -> None:
    """Write results, paper and tissues of docs, and table and picture of the README."""
    shown = (
        from_json(results_page.Excerpt, NUMBERS.read_bytes())
        if results is None
        else results_page.read_excerpt(results)
    )
    pages = {
        README: results_page.with_table(README.read_text(encoding="utf-8"), shown),
        DOCS / "results.md": results_page.results_page(shown),
        DOCS / "paper.md": results_page.paper_page(shown),
    }
    write_atomically(NUMBERS, to_json(shown) + b"\n")
    for path, text in pages.items():
        write_atomically(path, text.encode())
    written = [NUMBERS, *pages, write_blocks(DOCS / "tissues.md", tissue_page.set_blocks())]
    if picture:
        percept = shown.percept["human"]
        skin, response = chain_picture.touched(percept.standard_per_m, shown.resolution)
        write_png(PICTURE, chain_picture.draw, skin, response, percept)
        written.append(PICTURE)
    for path in written:
        print(f"Written: {path.relative_to(DOCS.parent)}")


RESULTS: Command = (
    "Write the pages that show the numbers of a reproduction.",
    _add,
    lambda given: write_pages(given.results, not given.no_picture),
)
