"""Every statement of the paper that can fail, with our value and verdict of both sets of tissues."""

from __future__ import annotations

from collections.abc import Sequence

from fingerpad.core.results import result_class
from fingerpad.experiments.gerling2014.claim_row import ClaimRow, Group, Verdict

ABSENT = "–"


@result_class
class Statement:
    """A statement of the paper beside both sets."""

    section: str
    """Where the paper says it."""
    statement: str
    """What it says."""
    published: str
    """As the paper prints it."""
    paper: str
    """Ours with the set `paper`."""
    human: str
    """Ours with the set `human`."""
    verdict_paper: Verdict
    verdict_human: Verdict
    fitted_paper: str
    """What was fitted to it with the set `paper`; empty where nothing was."""
    fitted_human: str
    """The same with the set `human`."""


def paired(paper: Sequence[ClaimRow], human: Sequence[ClaimRow]) -> tuple[Statement, ...]:
    """Join the rows of both sets that can fail with at least one of them, in the order of the sections."""
    rows = [{row.quantity: row for row in rows} for rows in (paper, human)]
    asked = [row.quantity for row in sorted((*paper, *human), key=_place) if row.group is Group.STATEMENT]
    return tuple(_joined(*(found.get(quantity) for found in rows)) for quantity in dict.fromkeys(asked))


def _place(row: ClaimRow) -> list[int]:
    return [int(part) for part in row.section.split(".") if part]


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
