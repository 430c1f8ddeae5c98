"""Parts of the studies' pages, and shares as they stand in them."""

from __future__ import annotations

from collections.abc import Sequence

from fingerpad.report.formatting import fixed
from fingerpad.report.page import markdown_blocks
from fingerpad.report.parts import Chapter, Paragraph, Part, Row, Table

PERCENT = 100.0


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
