"""Pages of docs/ that the studies write: Markdown tables, and blocks between the marks of a page."""

from __future__ import annotations

from collections.abc import Iterable, Mapping, Sequence
from pathlib import Path

from fingerpad.core.errors import InputError
from fingerpad.core.files import write_atomically
from fingerpad.report.tables import fixed

DOCS = Path(__file__).parents[1] / "docs"
IMAGES = DOCS / "images"


def table(columns: Sequence[str], rows: Iterable[Sequence[str]], rule: str = "---") -> str:
    """Return a table in Markdown; the rule "---:" aligns numbers to the right.

    Examples
    --------
    >>> print(table(("mesh", "nodes"), [("quick", "6730")]))
    | mesh | nodes |
    | --- | --- |
    | quick | 6730 |
    """
    lines = [columns, [rule] * len(columns), *rows]
    return "\n".join("| " + " | ".join(line) + " |" for line in lines)


def joined(*blocks: str) -> str:
    """Return blocks of Markdown with an empty line between them; empty blocks are left out."""
    return "\n\n".join(block for block in blocks if block)


def replaced(text: str, start: str, end: str, content: str) -> str:
    r"""Return a page with new content between two marks.

    Examples
    --------
    >>> replaced("a <b> old <c> d", "<b>", "<c>", "new")
    'a <b>\nnew\n<c> d'
    """
    first, last = text.find(start), text.find(end)
    if first < 0 or last < first:
        raise InputError(f"The page must hold {start} and {end}, in this order: it does not.")
    return f"{text[: first + len(start)]}\n{content}\n{text[last:]}"


def with_blocks(text: str, blocks: Mapping[str, str]) -> str:
    """Return a page whose blocks, between `<!-- begin NAME -->` and `<!-- end NAME -->`, are written anew."""
    for name, content in blocks.items():
        text = replaced(text, f"<!-- begin {name} -->", f"<!-- end {name} -->", content)
    return text


def write_blocks(page: Path, blocks: Mapping[str, str], target: Path | None = None) -> Path:
    """Write a page of docs/, or a copy of it as `target`, with its blocks anew; return the written file."""
    written = target or page
    write_atomically(written, with_blocks(page.read_text(encoding="utf-8"), blocks).encode())
    return written


def share(value: float, decimals: int = 1) -> str:
    """Return a share in percent.

    Examples
    --------
    >>> share(0.034), share(0.00034, 2)
    ('3.4 %', '0.03 %')
    """
    return f"{fixed(100.0 * value, decimals)} %"
