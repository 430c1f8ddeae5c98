"""Tables for pages in Markdown, and shares as they stand in them."""

from __future__ import annotations

from collections.abc import Sequence

from fingerpad.report.formatting import fixed

PERCENT = 100.0


def table(columns: Sequence[str], rows: Sequence[Sequence[str]]) -> str:
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
    >>> print(table(("mesh", "nodes"), [("quick", "6730")]))
    | mesh | nodes |
    | --- | --- |
    | quick | 6730 |
    """
    lines = [columns, ["---"] * len(columns), *rows]
    return "\n".join("| " + " | ".join(line) + " |" for line in lines)


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
