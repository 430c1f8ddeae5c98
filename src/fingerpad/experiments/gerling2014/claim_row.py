"""One row of the table that holds our numbers beside the paper's: its group and its verdict."""

from __future__ import annotations

from enum import StrEnum

from fingerpad.core.results import result_class
from fingerpad.data.published import Published

CLOSE = 0.2
"""A number of the paper counts as met within this share of it, unless more is better."""

MATERIALS = "materials assumed (Tables 1 and 2 are lost), geometry read"


class Group(StrEnum):
    """What a row can show."""

    STATEMENT = "statement"
    """A statement of the paper that can fail; nothing was fitted to it."""
    FITTED = "fitted"
    """A number that was fitted, or by which something was chosen in sample."""
    DEFINITION = "definition"
    """A consequence of definitions: it holds for nearly any model."""
    ADDITION = "addition"
    """Our own addition, of which the paper says nothing that could be judged."""


class Verdict(StrEnum):
    """Whether a claim is met."""

    MET = "met"
    MISSED = "missed"
    NOT_DECIDABLE = "not decidable"
    """The outcome depends on a reading that the paper leaves open, or lies within the Monte-Carlo error."""
    NOT_APPLICABLE = "does not apply"
    """The set of tissues has nothing to compare."""


@result_class
class ClaimRow:
    """A claim of the paper beside this run."""

    group: Group
    """What the row can show."""
    section: str = ""
    """Section of the paper; empty for our own additions."""
    quantity: str
    """What is compared."""
    paper: str
    ours: str
    """As they are printed."""
    status: str = ""
    """How far the inputs can be trusted."""
    verdict: Verdict
    """Whether the claim is met."""
    fitted_to: str = ""
    """What was fitted to the observed number, or chosen by it. Rows of the group `FITTED` have it, and no
    others.
    """
    note: str = ""
    """How it was judged."""

    def __post_init__(self) -> None:
        if (self.group is Group.FITTED) != bool(self.fitted_to):
            raise ValueError(
                "fitted_to must say what was fitted in rows of the group fitted, and in no others: "
                f"got {self.fitted_to!r} in the group {self.group}."
            )


def judged(met: bool) -> Verdict:
    """Return the verdict of a criterion that holds or does not."""
    return Verdict.MET if met else Verdict.MISSED


def two_digits(value: float) -> str:
    """Round to the two digits that another machine reproduces."""
    return "–" if value != value else f"{float(f'{value:.2g}'):g}"


def measured_row(
    group: Group,
    section: str,
    quantity: str,
    published: Published[float],
    ours: float,
    status: str,
    at_least: bool = False,
    fitted_to: str = "",
    note: str = "",
) -> ClaimRow:
    """Return the row of a number that the paper prints: met from it on, or close to it."""
    difference = ours - published.value
    criterion = "judged: at least the paper's" if at_least else f"judged: within {CLOSE:.0%}"
    return ClaimRow(
        group=group,
        section=section,
        quantity=quantity,
        paper=f"{published.value:g}",
        ours=two_digits(ours),
        status=status,
        verdict=judged(bool(difference >= 0.0 if at_least else abs(difference) <= CLOSE * published.value)),
        fitted_to=fitted_to,
        note="; ".join(text for text in (criterion, note) if text),
    )
