"""The parts of a page: paragraphs, tables and figures in chapters; `page` writes them as HTML."""

from __future__ import annotations

import base64
import html
import re
from collections.abc import Callable, Mapping, Sequence
from dataclasses import asdict, dataclass
from functools import partial
from pathlib import Path
from typing import Literal, TypeVar

from jinja2 import Environment, PackageLoader, StrictUndefined
from matplotlib.figure import Figure

from fingerpad.core.files import write_atomically
from fingerpad.experiments.manifest import Manifest
from fingerpad.report.formatting import plain, spelled
from fingerpad.report.style import png

Kind = Literal["", "assumed", "final"]  # An assumed input, or the row that is the result.
COLUMNS = ("paper", "human")  # Sets of tissues of a reproduction, in the order of their columns.


@dataclass(frozen=True)
class Paragraph:
    """A paragraph."""

    text: str  # Plain text; links as `[text](address)` and code in backticks, as in Markdown.


@dataclass(frozen=True)
class Row:
    """A row of a table."""

    cells: Sequence[str]  # Finished texts, the first is the row's heading.
    kind: Kind = ""  # How the row is marked.

    @classmethod
    def of(cls, *cells: str, kind: Kind = "") -> Row:
        return cls(cells, kind)


@dataclass(frozen=True)
class Table:
    """A table."""

    title: str
    columns: Sequence[str]  # Headings with units; all empty where the table lists names and values.
    rows: Sequence[Row]  # One cell per column.
    note: str = ""  # A sentence below it.


@dataclass(frozen=True)
class Drawing:
    """A figure with its caption."""

    name: str  # Name of the image file, without its ending.
    title: str  # A few words.
    draw: Callable[[], Figure]
    caption: str
    number: int | None = None  # Up to 9 in a reproduction the paper's numbers; others from 10.
    human: Callable[[], Figure] | None = None  # The same of `human`; `draw` is then of `paper`.

    @property
    def images(self) -> dict[str, Callable[[], Figure]]:
        if self.human is None:
            return {self.name: self.draw}
        draws = zip(COLUMNS, (self.draw, self.human), strict=True)
        return {f"{self.name}_{column}": draw for column, draw in draws}

    @property
    def label(self) -> str:
        return self.title if self.number is None else f"Figure {self.number}. {self.title}"


def listed(title: str, values: Mapping[str, str], columns: Sequence[str] = ("", ""), note: str = "") -> Table:
    return Table(title, columns, [Row(each) for each in values.items()], note)


Part = Paragraph | Table | Drawing
_Section = TypeVar("_Section")


def illustrated(
    section: _Section | None,
    tables: Callable[[_Section], Sequence[Table]] | None,
    *figures: tuple[int, str, str, Callable[[_Section], Figure], Callable[[_Section], str]],
) -> list[Part]:
    """Return the figures of a part of the results, then its tables."""
    if section is None:
        return []
    drawings = [
        Drawing(name, title, partial(draw, section), caption(section), figure)
        for figure, name, title, draw, caption in figures
    ]
    return [*drawings, *(tables(section) if tables else ())]


@dataclass(frozen=True)
class Chapter:
    """A heading and what stands below it."""

    title: str  # The heading; empty for parts that follow the introduction directly.
    parts: Sequence[Part]
    folded: Sequence[Part] = ()  # What stands below them behind a fold.

    @property
    def anchor(self) -> str:
        """Name for links within the page."""
        kept = "".join(letter if letter.isalnum() else " " for letter in self.title.lower())
        return "-".join(kept.split())

    @property
    def contents(self) -> str:
        """Titles of what is folded, each once."""
        titles = [getattr(part, "title", "") for part in self.folded]
        return "; ".join(
            dict.fromkeys(title.removesuffix(", human").removesuffix(", paper") for title in titles)
        )

    @property
    def drawings(self) -> list[Drawing]:
        return [part for part in (*self.parts, *self.folded) if isinstance(part, Drawing)]

    @property
    def tables(self) -> list[Table]:
        return [part for part in (*self.parts, *self.folded) if isinstance(part, Table)]


@dataclass(frozen=True)
class Page:
    """A page."""

    heading: str
    subtitle: str  # Title, and what the page is about.
    paragraphs: Sequence[str]  # Summary; links and code as in `Paragraph`.
    chapters: Sequence[Chapter]
    opening: Sequence[Drawing] = ()  # Small figures after the summary, each with one sentence as its caption.
    verdicts: Table | None = None  # What stands beside them.

    @property
    def drawings(self) -> list[Drawing]:
        return [*self.opening, *(drawing for chapter in self.chapters for drawing in chapter.drawings)]


def manifest_chapter(manifest: Manifest) -> Chapter:
    """Return the chapter: facts about the run, its stages, and versions of packages."""
    facts = asdict(manifest)
    stages, packages = facts.pop("stages"), facts.pop("packages")
    tables = [facts_table("The run", facts)]
    if stages:
        names = [name for name in stages[0] if any(stage[name] for stage in stages)]
        rows = [Row([plain(stage[name]) for name in names]) for stage in stages]
        tables.append(Table("Stages", [spelled(name) for name in names], rows))
    return Chapter("Provenance", [*tables, facts_table("Packages", packages)])


def edition(manifest: Manifest) -> str:
    """Return the version, resolution and seed of a run, and its caveats: what was not verified."""
    made = f"fingerpad {manifest.version}, {manifest.resolution} resolution, seed {manifest.seed}"
    return made if not manifest.caveats else f"{made}. Not verified: {' '.join(manifest.caveats)}"


def facts_table(title: str, facts: Mapping[str, object]) -> Table:
    """Return names and values as a table; what is None or empty is left out."""
    given = {name: value for name, value in facts.items() if value is not None and value not in ({}, ())}
    return Table(title, ("", ""), [Row.of(spelled(name), plain(value)) for name, value in given.items()])


VERDICTS = {"✓": "met", "✗": "missed", "?": "open"}  # How a cell is marked by the sign that it begins with.


def write_html(page: Page, path: Path) -> Path:
    """Write a page as one HTML file that holds its figures; they are also written beside it in `figures/`."""
    images = images_of(page)
    environment = Environment(
        loader=PackageLoader("fingerpad.report", "."),
        autoescape=True,
        undefined=StrictUndefined,
        trim_blocks=True,
        lstrip_blocks=True,
    )
    environment.filters["base64"] = lambda content: base64.b64encode(content).decode("ascii")
    environment.filters |= {"inline": _inline, "code": _code}
    environment.filters["verdict"] = lambda cell: VERDICTS.get(cell.partition(" ")[0], "")
    environment.tests |= {"table": lambda part: isinstance(part, Table)}
    environment.tests |= {"drawing": lambda part: isinstance(part, Drawing)}
    content = environment.get_template("template.html").render(page=page, images=images, columns=COLUMNS)
    return write_beside(path, content, images, "figures")


def images_of(page: Page) -> dict[str, bytes]:
    return {name: png(draw) for drawing in page.drawings for name, draw in drawing.images.items()}


def write_beside(path: Path, content: str, images: Mapping[str, bytes], folder: str) -> Path:
    """Write a page, and before it its images into a folder beside it; each file whole or not at all."""
    path = Path(path)
    for name, image in images.items():
        write_atomically(path.parent / folder / f"{name}.png", image)
    write_atomically(path, content.encode())
    return path


def _inline(text: str) -> str:
    """Return a paragraph as HTML: escaped, with its links and code."""
    return re.sub(r"\[([^\]]+)\]\(([^)\s]+)\)", r'<a href="\2">\1</a>', _code(text))


def _code(text: str) -> str:
    """Return a text as HTML: escaped, with its code."""
    return re.sub(r"`([^`]+)`", r"<code>\1</code>", html.escape(text))
