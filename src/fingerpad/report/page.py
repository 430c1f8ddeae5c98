"""Pages: paragraphs, tables and figures in chapters; the list of all figures; one template."""

from __future__ import annotations

import base64
import html
import re
from collections.abc import Callable, Mapping, Sequence
from dataclasses import asdict, dataclass, replace
from functools import partial
from operator import attrgetter
from pathlib import Path
from typing import Any

from jinja2 import Environment, PackageLoader, StrictUndefined
from matplotlib.figure import Figure

from fingerpad.core.files import write_atomically
from fingerpad.experiments.manifest import Manifest
from fingerpad.report.style import png
from fingerpad.report.tables import Column, Table, at, facts_table, filled, table

SETS = ("paper", "human")  # Sets of tissues of a reproduction, in the order of their columns.


@dataclass(frozen=True)
class Drawing:
    """A figure with its caption."""

    title: str  # A few words.
    images: Mapping[str, Callable[[], Figure]]  # What draws it by the name of the file; two are two sets.
    caption: str
    number: int | None = None  # Up to 9 in a reproduction the paper's numbers; others from 10.

    @property
    def label(self) -> str:
        return self.title if self.number is None else f"Figure {self.number}. {self.title}"


Part = str | Table | Drawing  # Text is a paragraph, with code in backticks.


@dataclass(frozen=True)
class Chapter:
    """A heading and what stands below it."""

    title: str  # The heading; empty for parts that follow the introduction directly.
    parts: Sequence[Part]
    folded: Sequence[Table | Drawing] = ()  # What stands below them behind a fold.

    @property
    def anchor(self) -> str:
        """Name for links within the page."""
        return "-".join("".join(sign if sign.isalnum() else " " for sign in self.title.lower()).split())

    @property
    def contents(self) -> str:
        """Titles of what is folded, each once."""
        return "; ".join(dict.fromkeys(re.sub(", (paper|human)$", "", part.title) for part in self.folded))


@dataclass(frozen=True)
class Page:
    """A page."""

    heading: str
    subtitle: str  # Title, and what the page is about.
    paragraphs: Sequence[str]
    chapters: Sequence[Chapter]
    opening: Sequence[Drawing] = ()  # Small figures after the summary, each with one sentence as its caption.
    verdicts: Table | None = None  # What stands beside them.

    @property
    def drawings(self) -> list[Drawing]:
        parts = (part for chapter in self.chapters for part in (*chapter.parts, *chapter.folded))
        return [*self.opening, *(part for part in parts if isinstance(part, Drawing))]


FIGURES: list[figure] = []
"""Every figure of every page."""


@dataclass
class figure:
    """Enter the function below into the list of figures: where it stands, its caption and its tables."""

    page: str
    chapter: str
    number: int
    name: str  # Of the image file, without its ending.
    title: str
    caption: str | Callable[..., str]  # Text with `{paths}` of numbers, see `filled`; or what makes it.
    of: tuple[str, ...] = ()  # Sections as paths in the result: none is the result itself, two are two sets.
    needs: str = ""  # Field of the result without which the figure is left out.
    tables: Callable[[Any], Sequence[Table]] = lambda section: ()  # Numbers below it.

    def __call__(self, draw: Callable[[Any], Figure]) -> Callable[[Any], Figure]:
        self.draw = draw
        FIGURES.append(self)
        return draw

    def parts(self, result: Any) -> list[Table | Drawing]:
        """Return the figure and its tables; nothing if the result has no such section."""
        sections = [at(result, path) for path in self.of] or [result]
        if any(each is None for each in sections) or (self.needs and not getattr(result, self.needs)):
            return []
        two = len(sections) > 1
        names = [f"{self.name}_{name}" for name in SETS] if two else [self.name]
        images = {name: partial(self.draw, each) for name, each in zip(names, sections, strict=True)}
        told = filled(self.caption, sections[0]) if isinstance(self.caption, str) else self.caption(*sections)
        tables = [
            replace(each, title=f"{each.title}, {name}") if two else each
            for name, section in zip(SETS, sections, strict=False)
            for each in self.tables(section)
        ]
        return [Drawing(self.title, images, told, self.number), *tables]


def both(path: str) -> tuple[str, ...]:
    """Return the paths of a section of both sets of a reproduction."""
    return tuple(f"{name}.{path}" for name in SETS)


def figures(page: str, result: Any) -> dict[str, list[Table | Drawing]]:
    """Return the figures of a page by chapter in the order of their numbers, each with its tables."""
    found: dict[str, list[Table | Drawing]] = {}
    for row in sorted((row for row in FIGURES if row.page == page), key=attrgetter("number")):
        found.setdefault(row.chapter, []).extend(row.parts(result))
    return {chapter: parts for chapter, parts in found.items() if parts}


def write_result_page(
    page: str, result: Any, heading: str, about: str, summary: Sequence[str], manifest: Manifest, folder: Path
) -> Path:
    """Write the page of a result: its figures, the tables below them, and how it was made."""
    chapters = [
        Chapter(title, sorted(parts, key=lambda part: isinstance(part, Table)))
        for title, parts in figures(page, result).items()
    ]
    made = Page(heading, f"{about} {edition(manifest)}", summary, [*chapters, manifest_chapter(manifest)])
    return write_html(made, Path(folder) / f"{page}.html")


def manifest_chapter(manifest: Manifest, folded: bool = False) -> Chapter:
    """Return the chapter: facts about the run, its stages, and versions of packages."""
    facts = asdict(manifest)
    stages, packages = facts.pop("stages"), facts.pop("packages")
    tables = [facts_table("The run", facts)]
    if stages:
        names = [name for name in stages[0] if any(stage[name] for stage in stages)]
        tables.append(table("Stages", manifest.stages, [Column(name) for name in names]))
    tables.append(facts_table("Packages", packages))
    return Chapter("Provenance", (), tables) if folded else Chapter("Provenance", tables)


def edition(manifest: Manifest) -> str:
    """Return the version, resolution and seed of a run, and its caveats: what was not verified."""
    made = f"fingerpad {manifest.version}, {manifest.resolution} resolution, seed {manifest.seed}"
    return made if not manifest.caveats else f"{made}. Not verified: {' '.join(manifest.caveats)}"


VERDICTS = {"✓": "met", "✗": "missed", "?": "open"}  # How a cell is marked by the sign that it begins with.


def write_html(page: Page, path: Path) -> Path:
    """Write a page as one HTML file that holds its figures; they are also written beside it in `figures/`."""
    path = Path(path)
    images = {name: png(draw) for drawing in page.drawings for name, draw in drawing.images.items()}
    environment = Environment(
        loader=PackageLoader("fingerpad.report", "."), autoescape=True, undefined=StrictUndefined,
        trim_blocks=True, lstrip_blocks=True,
    )  # fmt: skip
    environment.filters |= {
        "base64": lambda content: base64.b64encode(content).decode("ascii"),
        "text": _text,
        "verdict": lambda cell: VERDICTS.get(cell.partition(" ")[0], ""),
    }
    environment.tests |= {"table": lambda part: isinstance(part, Table)}
    content = environment.get_template("template.html").render(page=page, images=images, sets=SETS)
    for name, image in images.items():
        write_atomically(path.parent / "figures" / f"{name}.png", image)
    write_atomically(path, content.encode())
    return path


def _text(text: str) -> str:
    """Return a text as HTML: escaped, with its code."""
    return re.sub(r"`([^`]+)`", r"<code>\1</code>", html.escape(text))
