"""The parts of a page: paragraphs, tables and figures in chapters; `page` writes them as HTML."""

from __future__ import annotations

from collections.abc import Callable, Sequence
from dataclasses import dataclass
from functools import partial
from typing import Literal, TypeVar

from matplotlib.figure import Figure

Kind = Literal["", "assumed", "final"]
"""How a row is marked in HTML: an assumed input, or the row that is the result."""

COLUMNS = ("paper", "human")
"""The two sets of tissues of a reproduction, in the order of their columns in tables and figures."""


@dataclass(frozen=True)
class Paragraph:
    """A paragraph.

    Parameters
    ----------
    text : str
        Plain text; links as `[text](address)` and code in backticks, as in Markdown.
    """

    text: str


@dataclass(frozen=True)
class Row:
    """A row of a table.

    Parameters
    ----------
    cells : sequence of str
        Finished texts, the first is the row's heading.
    kind : str, optional
        How the row is marked.
    """

    cells: Sequence[str]
    kind: Kind = ""


@dataclass(frozen=True)
class Table:
    """A table.

    Parameters
    ----------
    title : str
        Its heading.
    columns : sequence of str
        Headings with units; all empty where the table lists names and values.
    rows : sequence of Row
        One cell per column.
    note : str, optional
        A sentence below it.
    """

    title: str
    columns: Sequence[str]
    rows: Sequence[Row]
    note: str = ""


@dataclass(frozen=True)
class Drawing:
    """A figure with its caption.

    Parameters
    ----------
    name : str
        Name of the image file, without its ending.
    title : str
        A few words.
    draw : callable
        Makes the figure.
    caption : str
        What it shows.
    number : int, optional
        Figures up to 9 of a reproduction have the paper's numbers; others go on from 10.
    human : callable, optional
        Makes the same figure of the set `human`, to stand on the right; `draw` is then that of `paper`.
    """

    name: str
    title: str
    draw: Callable[[], Figure]
    caption: str
    number: int | None = None
    human: Callable[[], Figure] | None = None

    @property
    def images(self) -> dict[str, Callable[[], Figure]]:
        """Drawing functions by the names of the image files."""
        if self.human is None:
            return {self.name: self.draw}
        draws = zip(COLUMNS, (self.draw, self.human), strict=True)
        return {f"{self.name}_{column}": draw for column, draw in draws}

    @property
    def label(self) -> str:
        """Number and title.

        Examples
        --------
        >>> Drawing("figure_9_nail", "The nail", Figure, "Stress.", number=9).label
        'Figure 9. The nail'
        """
        return self.title if self.number is None else f"Figure {self.number}. {self.title}"


Part = Paragraph | Table | Drawing
_Section = TypeVar("_Section")


def illustrated(
    section: _Section | None,
    tables: Callable[[_Section], Sequence[Table]] | None,
    *figures: tuple[int, str, str, Callable[[_Section], Figure], Callable[[_Section], str]],
) -> list[Part]:
    """Return the figures of a part of the results, then its tables.

    Parameters
    ----------
    section : Any
        The part; None, for one that was not computed, has neither.
    tables : callable or None
        Makes its tables.
    *figures : tuple
        Number, file name and title of each figure, and the functions that draw and caption it.

    Returns
    -------
    list of Drawing and Table
    """
    if section is None:
        return []
    drawings = [
        Drawing(name, title, partial(draw, section), caption(section), figure)
        for figure, name, title, draw, caption in figures
    ]
    return [*drawings, *(tables(section) if tables else ())]


@dataclass(frozen=True)
class Chapter:
    """A heading and what stands below it.

    Parameters
    ----------
    title : str
        The heading; empty for parts that follow the introduction directly.
    parts : sequence of Paragraph, Table or Drawing
        In order.
    folded : sequence of Paragraph, Table or Drawing, optional
        What stands below them behind a fold.
    """

    title: str
    parts: Sequence[Part]
    folded: Sequence[Part] = ()

    @property
    def anchor(self) -> str:
        """Name for links within the page.

        Examples
        --------
        >>> Chapter("Level 1: skin", ()).anchor
        'level-1-skin'
        """
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
        """Figures of the chapter."""
        return [part for part in (*self.parts, *self.folded) if isinstance(part, Drawing)]

    @property
    def tables(self) -> list[Table]:
        """Tables of the chapter."""
        return [part for part in (*self.parts, *self.folded) if isinstance(part, Table)]


@dataclass(frozen=True)
class Page:
    """A page.

    Parameters
    ----------
    heading, subtitle : str
        Title, and what the page is about.
    paragraphs : sequence of str
        Summary; links and code as in `Paragraph`.
    chapters : sequence of Chapter
        In order.
    opening : sequence of Drawing, optional
        Small figures after the summary, each with one sentence as its caption.
    verdicts : Table, optional
        What stands beside them.
    """

    heading: str
    subtitle: str
    paragraphs: Sequence[str]
    chapters: Sequence[Chapter]
    opening: Sequence[Drawing] = ()
    verdicts: Table | None = None

    @property
    def drawings(self) -> list[Drawing]:
        """Figures of the opening and of all chapters."""
        return [*self.opening, *(drawing for chapter in self.chapters for drawing in chapter.drawings)]
