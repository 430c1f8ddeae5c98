"""Pages: the rows of `pages.toml` become chapters of text, tables and figures, written by one template."""

from __future__ import annotations

import base64
import html
import re
import tomllib
from collections.abc import Callable, Mapping, Sequence
from dataclasses import asdict, dataclass, replace
from functools import partial
from importlib.resources import files
from pathlib import Path
from typing import Any, TypeVar

from jinja2 import Environment, PackageLoader, StrictUndefined
from matplotlib.figure import Figure

from fingerpad.core.files import write_atomically
from fingerpad.experiments.runner import Manifest
from fingerpad.report.style import png
from fingerpad.report.tables import Row, Table, at, facts_table, filled, filled_table, plain, spelled

SETS = ("paper", "human")  # Sets of tissues of a reproduction, in the order of their columns.


@dataclass(frozen=True)
class Drawing:
    """A figure with its caption."""

    title: str  #: A few words.
    images: Mapping[str, Callable[[], Figure]]  #: What draws it by the name of the file; two are two sets.
    caption: str
    number: int | None = None  #: Up to 9 in a reproduction the paper's numbers; others from 10.

    @property
    def label(self) -> str:
        return self.title if self.number is None else f"Figure {self.number}. {self.title}"


Made = TypeVar("Made")
Rows = list[tuple[str, ...]]  # Cells of the rows of a table.
Part = str | Table | Drawing  # Text is a paragraph, with code in backticks.


@dataclass(frozen=True)
class Chapter:
    """A heading and what stands below it."""

    title: str  #: The heading; empty for parts that follow the introduction directly.
    parts: Sequence[Part]
    folded: Sequence[Table | Drawing] = ()  #: What stands below them behind a fold.

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
    subtitle: str  #: Title, and what the page is about.
    paragraphs: Sequence[str]
    chapters: Sequence[Chapter]
    opening: Sequence[Part] = ()  #: Small figures after the summary, each with one sentence as its caption.
    verdicts: Sequence[Part] = ()  #: What stands beside them.

    @property
    def drawings(self) -> list[Drawing]:
        parts = (part for chapter in self.chapters for part in (*chapter.parts, *chapter.folded))
        return [part for part in (*self.opening, *parts) if isinstance(part, Drawing)]


PAGES = tomllib.loads((files(__package__) / "pages.toml").read_text(encoding="utf-8"))
"""What stands on each page; `pages.toml` says how to read it."""

DRAW: dict[str, Callable[[Any], Figure]] = {}
ROWS: dict[str, Callable[[Any], Rows]] = {}
"""What draws the figures, and what makes rows of the tables, that the pages name."""

DRAWINGS: dict[tuple[str, str], Callable[..., None]] = {}
"""What `plot` of results draws, by the name of the result's class and of the drawing; the default first."""


def enter(names: dict[Any, Any], name: Any) -> Callable[[Made], Made]:
    """Enter the function below by its name."""

    def entered(made: Made) -> Made:
        names[name] = made
        return made

    return entered


def holds(row: Mapping[str, Any], result: Any) -> bool:
    """Whether a row of a page is to be shown: a result has what it needs, and not what it stands in for."""
    needed = "needs" not in row or at(result, row["needs"]) is not None
    return needed and ("without" not in row or at(result, row["without"]) is None)


def parts_of(row: Mapping[str, Any], result: Any) -> list[Part]:
    """Return what a row of a page shows of a result; nothing if the result has no such section."""
    two = "both" in row
    paths = [f"{name}.{row['both']}" for name in SETS] if two else [row.get("of", "")]
    sections = [at(result, path) for path in paths]
    if not holds(row, result) or any(each is None for each in sections):
        return []
    if "text" in row:
        return [row["text"]]
    if "figure" in row:
        names = [f"{row['figure']}_{name}" for name in SETS] if two else [row["figure"]]
        draw = DRAW[row["figure"]]
        images = {name: partial(draw, each) for name, each in zip(names, sections, strict=True)}
        return [Drawing(row["title"], images, filled(row["caption"], sections[0]), row.get("number"))]
    made = [ROWS[row["made"]](each) if "made" in row else () for each in sections]
    tables = [filled_table(row, each, rows) for each, rows in zip(sections, made, strict=True)]
    if two:
        named = zip(SETS, tables, strict=True)
        tables = [replace(each, title=f"{each.title}, {name}") for name, each in named]
    return [each for each in tables if each.rows]


def page_parts(page: str, result: Any) -> dict[str, list[Part]]:
    """Return the paragraphs, figures and tables of a page by chapter."""
    found: dict[str, list[Part]] = {}
    for row in PAGES[page]["parts"]:
        found.setdefault(row["chapter"], []).extend(parts_of(row, result))
    return found


def result_page(page: str, result: Any, paragraphs: Sequence[str]) -> Page:
    """Return the page of a result: its figures and tables by chapter, and how it was made."""
    spec = PAGES[page]
    found = page_parts(page, at(result, spec["of"])) | {"Provenance": [*manifest_tables(result.manifest)]}
    closed, chapters = spec.get("folded"), []
    for title, parts in found.items():
        pictured = any(isinstance(part, Drawing) for part in parts)
        folded = [
            part
            for part in parts
            if closed and not isinstance(part, str)
            and (title in closed or (pictured and isinstance(part, Table)))
        ]  # fmt: skip
        if parts:
            chapters.append(Chapter(title, [part for part in parts if part not in folded], folded))
    opening = [part for row in spec.get("opening", ()) for part in parts_of(row, result)]
    verdicts = parts_of(spec["verdicts"], result) if "verdicts" in spec else ()
    about = f"{filled(spec['about'], result)} {edition(result.manifest)}"
    return Page(filled(spec["heading"], result), about, paragraphs, chapters, opening, verdicts)


def manifest_tables(manifest: Manifest) -> list[Table]:
    """Return facts about the run, its stages, and versions of packages."""
    facts = asdict(manifest)
    stages, packages = facts.pop("stages"), facts.pop("packages")
    for stage in stages:
        stage["caveats"] = [caveat["text"] for caveat in stage["caveats"]]
    made = [facts_table("The run", facts), facts_table("Packages", packages)]
    if stages:
        names = [name for name in stages[0] if any(stage[name] for stage in stages)]
        rows = [Row([plain(stage[name]) for name in names]) for stage in stages]
        made.insert(1, Table("Stages", [spelled(name) for name in names], rows))
    return made


def edition(manifest: Manifest) -> str:
    """Return the version, resolution and seed of a run, and its caveats: what was not verified."""
    made = f"fingerpad {manifest.version}, {manifest.resolution} resolution, seed {manifest.seed}"
    caveats = " ".join(each.text for each in manifest.caveats)
    return f"{made}. Not verified: {caveats}" if caveats else made


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
