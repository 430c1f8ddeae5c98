"""A page written as HTML that holds its figures, or as Markdown beside its figures."""

from __future__ import annotations

import base64
import html
import re
from collections.abc import Sequence
from pathlib import Path

from jinja2 import Environment, PackageLoader, StrictUndefined

from fingerpad.core.files import write_atomically
from fingerpad.report.parts import Chapter, Drawing, Page, Paragraph, Part, Table
from fingerpad.report.style import png


def write_html(page: Page, path: Path) -> Path:
    """Write a page as one HTML file that holds its figures; they are also written beside it in `figures/`.

    Parameters
    ----------
    page : Page
        What to write.
    path : Path
        The file. All figures are drawn before the first file is written, and each file is written whole.

    Returns
    -------
    Path
        The file.

    Raises
    ------
    StoreError
        If the folder cannot be written.

    Examples
    --------
    >>> from tempfile import TemporaryDirectory
    >>> page = Page("Skin", "A sphere", ["It yields."], [Chapter("Depth", [Paragraph("1 mm.")])])
    >>> with TemporaryDirectory() as folder:
    ...     "<p>1 mm.</p>" in write_html(page, Path(folder) / "skin.html").read_text(encoding="utf-8")
    True
    """
    images = _images(page)
    environment = Environment(
        loader=PackageLoader("fingerpad.report", "."),
        autoescape=True,
        undefined=StrictUndefined,
        trim_blocks=True,
        lstrip_blocks=True,
    )
    environment.filters["base64"] = lambda content: base64.b64encode(content).decode("ascii")
    environment.filters["inline"] = _inline
    environment.tests |= {"table": lambda part: isinstance(part, Table)}
    environment.tests |= {"drawing": lambda part: isinstance(part, Drawing)}
    content = environment.get_template("template.html").render(page=page, images=images)
    return _write(path, content, images, "figures")


def write_markdown(page: Page, path: Path) -> Path:
    """Write a page as Markdown, its figures into `images/` beside it.

    Parameters
    ----------
    page : Page
        What to write.
    path : Path
        The file; as in `write_html`.

    Returns
    -------
    Path
        The file.

    Raises
    ------
    StoreError
        If the folder cannot be written.
    """
    return _write(path, markdown(page), _images(page), "images")


def markdown(page: Page) -> str:
    """Return a page as Markdown, with links to figures in `images/`.

    Parameters
    ----------
    page : Page
        Headings of tables stand one level below that of their chapter.

    Returns
    -------
    str

    Examples
    --------
    >>> from fingerpad.report.parts import Row
    >>> meshes = Table("Meshes", ("mesh", "nodes"), [Row(("quick", "6730"))], "Half of the finger.")
    >>> print(markdown(Page("Skin", "A sphere.", [], [Chapter("", [meshes])])))
    # Skin
    <BLANKLINE>
    A sphere.
    <BLANKLINE>
    ## Meshes
    <BLANKLINE>
    | mesh | nodes |
    | --- | --- |
    | quick | 6730 |
    <BLANKLINE>
    Half of the finger.
    <BLANKLINE>
    """
    blocks = [f"# {page.heading}", page.subtitle, *page.paragraphs]
    for chapter in page.chapters:
        blocks += markdown_blocks(chapter)
    return "\n\n".join(block for block in blocks if block) + "\n"


def markdown_blocks(chapter: Chapter) -> list[str]:
    """Return a chapter as blocks of Markdown, between which an empty line belongs."""
    blocks = [f"## {chapter.title}"] if chapter.title else []
    for part in chapter.parts:
        blocks += _block(part, "###" if chapter.title else "##")
    return blocks


def _block(part: Part, heading: str) -> list[str]:
    if isinstance(part, Paragraph):
        return [part.text]
    if isinstance(part, Drawing):
        return [f"![{part.label}](images/{part.name}.png)", part.caption]
    title = [f"{heading} {part.title}"] if part.title else []
    return [*title, markdown_table(part.columns, [row.cells for row in part.rows]), part.note]


def markdown_table(columns: Sequence[str], rows: Sequence[Sequence[str]]) -> str:
    """Return a table in Markdown.

    Parameters
    ----------
    columns : sequence of str
        Headings.
    rows : sequence of sequences of str
        Finished texts.

    Returns
    -------
    str

    Examples
    --------
    >>> print(markdown_table(("mesh", "nodes"), [("quick", "6730")]))
    | mesh | nodes |
    | --- | --- |
    | quick | 6730 |
    """
    lines = [columns, ["---"] * len(columns), *rows]
    return "\n".join("| " + " | ".join(line) + " |" for line in lines)


def _images(page: Page) -> dict[str, bytes]:
    return {drawing.name: png(drawing.draw) for drawing in page.drawings}


def _write(path: Path, content: str, images: dict[str, bytes], folder: str) -> Path:
    path = Path(path)
    for name, image in images.items():
        write_atomically(path.parent / folder / f"{name}.png", image)
    write_atomically(path, content.encode())
    return path


def _inline(text: str) -> str:
    """Return a paragraph as HTML: escaped, with its links and code."""
    linked = re.sub(r"\[([^\]]+)\]\(([^)\s]+)\)", r'<a href="\2">\1</a>', html.escape(text))
    return re.sub(r"`([^`]+)`", r"<code>\1</code>", linked)
