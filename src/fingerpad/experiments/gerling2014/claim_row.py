"""One row of the table that holds our numbers beside the paper's."""

from __future__ import annotations

from fingerpad.core.results import result_class
from fingerpad.data.published import Published

CLOSE = 0.2
"""A number of the paper counts as met within this share of it, unless more is better."""

MATERIALS = "materials assumed (Tables 1 and 2 are lost), geometry read"


@result_class
class ClaimRow:
    """A claim of the paper beside this run.

    Parameters
    ----------
    quantity : str
        What is compared.
    paper, ours, difference : str
        As they are printed.
    status : str
        How far the inputs can be trusted.
    met : bool or None
        Whether the claim is met; None where the paper gives no criterion.
    note : str
        How it was judged.

    Examples
    --------
    >>> ClaimRow(quantity="hit rate", paper="0.58", ours="0.60", met=True).met
    True
    """

    quantity: str
    paper: str
    ours: str
    difference: str = ""
    status: str = ""
    met: bool | None = None
    note: str = ""


def measured_row(
    quantity: str,
    published: Published[float],
    ours: float,
    status: str,
    digits: int = 3,
    at_least: bool = False,
    note: str = "",
) -> ClaimRow:
    """Return the row of a number that the paper prints: met from it on, or close to it."""
    difference = ours - published.value
    judged = "" if at_least else f"judged: within {CLOSE:.0%}"
    return ClaimRow(
        quantity=quantity,
        paper=f"{published.value:g}",
        ours=f"{ours:.{digits}f}",
        difference=f"{difference:+.{digits}f}",
        status=status,
        met=bool(difference >= 0.0 if at_least else abs(difference) <= CLOSE * published.value),
        note="; ".join(text for text in (judged, note) if text),
    )
