"""Pages of the studies as Markdown, their parts, and shares as they stand in them."""

from __future__ import annotations

import io
from collections.abc import Sequence
from pathlib import Path

from PIL import Image

from fingerpad.report.formatting import fixed
from fingerpad.report.page import images_of, write_beside
from fingerpad.report.parts import Chapter, Drawing, Page, Paragraph, Part, Row, Table

PERCENT = 100.0


def write_markdown(page: Page, path: Path) -> Path:
    """Write a page as Markdown, its figures into `images/` beside it.

    Parameters
    ----------
    page : Page
        What to write.
    path : Path
        The file; as in `fingerpad.report.page.write_html`.

    Returns
    -------
    Path
        The file.

    Raises
    ------
    StoreError
        If the folder cannot be written.
    """
    images = {name: with_palette(image) for name, image in images_of(page).items()}
    return write_beside(path, markdown(page), images, "images")


def with_palette(image: bytes) -> bytes:
    """Return a PNG with at most 256 colours, a third as large: pages of the repository must stay light."""
    buffer = io.BytesIO()
    colours = Image.open(io.BytesIO(image)).convert("RGB")
    colours.quantize(dither=Image.Dither.NONE).save(buffer, format="png", optimize=True)
    return buffer.getvalue()


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
    blocks = [f"# {page.heading}", page.subtitle]
    for drawing in page.opening:
        blocks += _block(drawing, "")
    blocks += page.paragraphs
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
    return [*title, markdown_table(part.columns, [_cells(row) for row in part.rows]), part.note]


def _cells(row: Row) -> Sequence[str]:
    """Cells of a row, bold in a final one."""
    return [f"**{cell}**" if cell else "" for cell in row.cells] if row.kind == "final" else row.cells


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


def table(columns: Sequence[str], rows: Sequence[Sequence[str]]) -> Table:
    """Return a table without a title, for a paragraph that introduces it.

    Parameters
    ----------
    columns : sequence of str
        Headings.
    rows : sequence of sequences of str
        Finished texts.

    Returns
    -------
    Table
    """
    return Table("", columns, [Row(row) for row in rows])


def parts_of(*content: str | Part) -> list[Part]:
    """Return parts of a page, strings among them as paragraphs."""
    return [Paragraph(part) if isinstance(part, str) else part for part in content]


def section(parts: Sequence[Part]) -> str:
    """Return parts as Markdown without a heading, for a page that is put together elsewhere.

    Examples
    --------
    >>> print(section(parts_of("Nodes:", table(("mesh", "nodes"), [("quick", "6730")]))))
    Nodes:
    <BLANKLINE>
    | mesh | nodes |
    | --- | --- |
    | quick | 6730 |
    <BLANKLINE>
    """
    return "\n\n".join(block for block in markdown_blocks(Chapter("", parts)) if block) + "\n"


def share(value: float, decimals: int = 1) -> str:
    """Return a share in percent.

    Examples
    --------
    >>> share(0.034), share(0.00034, 2)
    ('3.4 %', '0.03 %')
    """
    return f"{fixed(PERCENT * value, decimals)} %"


def signed(value: float, decimals: int = 1) -> str:
    """Return a share in percent with its sign; nothing is neither above nor below nothing.

    Examples
    --------
    >>> signed(0.034), signed(-0.052), signed(-0.0001)
    ('+3.4 %', '−5.2 %', '0.0 %')
    """
    text = share(value, decimals)
    if not any(digit in text for digit in "123456789"):
        return share(0.0, decimals)
    return text if value < 0.0 else f"+{text}"
