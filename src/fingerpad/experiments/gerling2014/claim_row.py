"""Rows of the table that holds our numbers beside the paper: group and verdict, both sets side by side."""

from __future__ import annotations

from collections.abc import Sequence
from enum import StrEnum

from fingerpad.core.checked import result_class
from fingerpad.data.published import Published

CLOSE = 0.2  # A number of the paper counts as met within this share of it, unless more is better.
MATERIALS = "materials assumed (Tables 1 and 2 are lost), geometry read"


class Group(StrEnum):
    """What a row can show."""

    STATEMENT = "statement"  # A statement of the paper that can fail; nothing was fitted to it.
    FITTED = "fitted"  # A number that was fitted, or by which something was chosen in sample.
    DEFINITION = "definition"  # A consequence of definitions: it holds for nearly any model.
    ADDITION = "addition"  # Our own addition, of which the paper says nothing that could be judged.


class Verdict(StrEnum):
    """Whether a claim is met."""

    MET = "met"
    MISSED = "missed"
    NOT_DECIDABLE = "not decidable"  # A reading that the paper leaves open, or chance, decides.
    NOT_APPLICABLE = "does not apply"  # The set of tissues has nothing to compare.


@result_class
class ClaimRow:
    """A claim of the paper beside this run."""

    group: Group
    section: str = ""  # Section of the paper; empty for our own additions.
    quantity: str
    paper: str
    ours: str  # As they are printed.
    status: str = ""  # How far the inputs can be trusted.
    verdict: Verdict
    fitted_to: str = ""  # What was fitted to the number or chosen by it; in the group `FITTED` alone.
    note: str = ""

    def __post_init__(self) -> None:
        if (self.group is Group.FITTED) != bool(self.fitted_to):
            raise ValueError(
                "fitted_to must say what was fitted in rows of the group fitted, and in no others: "
                f"got {self.fitted_to!r} in the group {self.group}."
            )


def judged(met: bool) -> Verdict:
    return Verdict.MET if met else Verdict.MISSED


def two_digits(value: float) -> str:
    """Round to the two digits that another machine reproduces."""
    return "–" if value != value else f"{float(f'{value:.2g}'):g}"


def claim(
    section: str,
    quantity: str,
    paper: str,
    ours: str,
    verdict: Verdict | bool,
    note: str = "",
    status: str = MATERIALS,
    group: Group = Group.STATEMENT,
    fitted_to: str = "",
) -> ClaimRow:
    """Return a row; what something was fitted to is in the group of the fitted."""
    return ClaimRow(
        group=Group.FITTED if fitted_to else group,
        section=section,
        quantity=quantity,
        paper=paper,
        ours=ours,
        status=status,
        verdict=verdict if isinstance(verdict, Verdict) else judged(verdict),
        fitted_to=fitted_to,
        note=note,
    )


def measured(
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
    met = bool(difference >= 0.0 if at_least else abs(difference) <= CLOSE * published.value)
    criterion = "judged: at least the paper's" if at_least else f"judged: within {CLOSE:.0%}"
    told = "; ".join(text for text in (criterion, note) if text)
    return claim(
        section, quantity, f"{published.value:g}", two_digits(ours), met, told, status, fitted_to=fitted_to
    )


ABSENT = "–"


@result_class
class Statement:
    """A statement of the paper beside both sets."""

    section: str
    statement: str
    published: str  # Where the paper says it, what it says, and the number that it prints.
    paper: str
    human: str  # Ours, by the set.
    verdict_paper: Verdict
    verdict_human: Verdict
    fitted_paper: str
    fitted_human: str  # What was fitted to it; empty where nothing was.


def paired(paper: Sequence[ClaimRow], human: Sequence[ClaimRow]) -> tuple[Statement, ...]:
    """Join the rows of both sets that can fail with at least one of them, in the order of the sections."""
    rows = [{row.quantity: row for row in rows} for rows in (paper, human)]
    ranked = sorted((*paper, *human), key=lambda row: [int(part) for part in row.section.split(".") if part])
    asked = [row.quantity for row in ranked if row.group is Group.STATEMENT]
    return tuple(_joined(*(found.get(quantity) for found in rows)) for quantity in dict.fromkeys(asked))


def _joined(paper: ClaimRow | None, human: ClaimRow | None) -> Statement:
    known = paper or human
    assert known is not None
    return Statement(
        section=known.section,
        statement=known.quantity,
        published=known.paper,
        paper=paper.ours if paper else ABSENT,
        human=human.ours if human else ABSENT,
        verdict_paper=paper.verdict if paper else Verdict.NOT_APPLICABLE,
        verdict_human=human.verdict if human else Verdict.NOT_APPLICABLE,
        fitted_paper=paper.fitted_to if paper else "",
        fitted_human=human.fitted_to if human else "",
    )
