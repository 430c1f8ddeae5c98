"""The paper beside a run: one table of counts, and one table of rows per group."""

from __future__ import annotations

from collections.abc import Sequence
from itertools import takewhile

from fingerpad.experiments.gerling2014.claim_row import ClaimRow, Group, Verdict, count_by_verdict
from fingerpad.experiments.gerling2014.statements import Statement
from fingerpad.report.formatting import joined, plain
from fingerpad.report.parts import Kind, Row, Table

SIGNS = {
    Verdict.MET: "✓",
    Verdict.MISSED: "✗",
    Verdict.NOT_JUDGED: "○",
    Verdict.NOT_DECIDABLE: "?",
    Verdict.NOT_APPLICABLE: "–",
}
"""Sign of each verdict; they differ without colour."""

KINDS: dict[Verdict, Kind] = {
    Verdict.MET: "met",
    Verdict.MISSED: "missed",
    Verdict.NOT_JUDGED: "open",
    Verdict.NOT_DECIDABLE: "open",
    Verdict.NOT_APPLICABLE: "open",
}
"""How a row is marked by its verdict."""

TITLES = {
    Group.STATEMENT: "Statements of the paper that can fail",
    Group.FITTED: "Numbers that were fitted or chosen in sample",
    Group.DEFINITION: "Consequences of definitions",
    Group.ADDITION: "Our own additions",
}
MEANINGS = {
    Group.STATEMENT: "Nothing was fitted to these statements themselves; the notes say what was fitted "
    "before.",
    Group.FITTED: "Something was fitted to these numbers or chosen by them: a number that is met shows that "
    "the model can have it, and is no prediction.",
    Group.DEFINITION: "They follow from how hit rates and error bars are defined, and hold for nearly any "
    "model.",
    Group.ADDITION: "The paper says nothing about these that could be judged. The bounds are ours or those "
    "of other publications.",
}


def verdict_text(row: ClaimRow) -> str:
    """Return sign and verdict of a row, under which reading, and whether the number was fitted."""
    fitted = "(fitted)" if row.group is Group.FITTED else ""
    return " ".join(text for text in (SIGNS[row.verdict], row.verdict.value, row.reading, fitted) if text)


def comparison_tables(rows: Sequence[ClaimRow], brief: bool = False) -> list[Table]:
    """Return the counts by group and verdict, then the rows of each group.

    Parameters
    ----------
    rows : sequence of ClaimRow
        The comparison.
    brief : bool, optional
        Whether to leave out the differences and the status of the inputs.
    """
    by_group = {group: [row for row in rows if row.group is group] for group in Group}
    return [_counts(rows), *(_of_group(group, found, brief) for group, found in by_group.items() if found)]


def count_sentence(statements: Sequence[Statement], name: str) -> str:
    """Count the statements that can fail by their verdict with one set, and list what is missed."""
    verdicts = {each.statement: getattr(each, f"verdict_{name}") for each in statements}
    fitted = {each.statement for each in statements if getattr(each, f"fitted_{name}")}
    found = [verdict for statement, verdict in verdicts.items() if statement not in fitted]
    counted = [
        f"{found.count(verdict)} {verdict.value}"
        for verdict in Verdict
        if verdict in found or verdict in (Verdict.MET, Verdict.MISSED)
    ]
    missed = [statement for statement, verdict in verdicts.items() if verdict is Verdict.MISSED]
    return (
        f"{name}: of {len(statements)} statements of the paper that can fail, {joined(counted)}"
        + (f", {len(fitted)} fitted" if fitted else "")
        + (f". Missed: {'; '.join(missed)}." if missed else ".")
    )


def statement_table(statements: Sequence[Statement]) -> Table:
    """Return every statement that can fail with our value and verdict of both sets."""
    return Table(
        TITLES[Group.STATEMENT],
        ("section", "statement", "the paper", "`paper`", "", "`human`", ""),
        [
            Row(
                (
                    each.section,
                    each.statement,
                    each.published,
                    each.paper,
                    _marked(each.verdict_paper, each.fitted_paper),
                    each.human,
                    _marked(each.verdict_human, each.fitted_human),
                ),
                KINDS[each.verdict_paper],
            )
            for each in statements
        ],
        "`paper` is the paper's own system: Trial 3 with a Poisson's ratio of 0.40, strain energy density in "
        "both terms, response surfaces. `human` serves all three levels.",
    )


def _marked(verdict: Verdict, fitted: str) -> str:
    """Sign and words of a verdict, and whether something was fitted to it."""
    return f"{SIGNS[verdict]} {verdict.value}" + (" (fitted)" if fitted else "")


def verdict_sentence(rows: Sequence[ClaimRow]) -> str:
    """Return the counts of statements that can fail, with what was missed, and those of fitted numbers."""
    missed = [
        f"{row.quantity} ({row.ours}, the paper {row.paper})"
        for row in rows
        if row.group is Group.STATEMENT and row.verdict is Verdict.MISSED
    ]
    text = f"Of the statements of the paper that can fail, {_counted(rows, Group.STATEMENT)}."
    if missed:
        text += f" Missed: {'; '.join(missed)}."
    return text + (
        f" Of the numbers that were fitted or chosen in sample, {_counted(rows, Group.FITTED)}; these are no "
        "predictions."
    )


def _counted(rows: Sequence[ClaimRow], group: Group) -> str:
    counts = count_by_verdict(rows, group)
    always = (Verdict.MET, Verdict.MISSED)
    return joined(
        [f"{count} {verdict.value}" for verdict, count in counts.items() if count or verdict in always]
    )


def _counts(rows: Sequence[ClaimRow]) -> Table:
    return Table(
        "Rows by group and verdict",
        ("group", *(f"{SIGNS[verdict]} {verdict.value}" for verdict in Verdict)),
        [
            Row((TITLES[group], *(plain(count) for count in count_by_verdict(rows, group).values())))
            for group in Group
        ],
    )


def _of_group(group: Group, rows: Sequence[ClaimRow], brief: bool) -> Table:
    """Return the rows of one group; what was fitted has a column where something was.

    The status that all rows share stands once, below the table.
    """
    shared = "; ".join(_leading([row.status.split("; ") for row in rows]))
    own = [row.status.removeprefix(shared).removeprefix("; ") for row in rows]
    show = any(own) and not brief

    def cells(row: ClaimRow, status: str) -> dict[str, str]:
        found = {"quantity": row.quantity, "verdict": verdict_text(row)}
        found |= {"paper": row.paper, "this run": row.ours}
        found |= {} if brief else {"difference": row.difference}
        found |= {"what was fitted": row.fitted_to} if group is Group.FITTED else {}
        found |= {"status of further inputs" if shared else "status of the inputs": status} if show else {}
        return found | {"note": row.note}

    found = [cells(row, status) for row, status in zip(rows, own, strict=True)]
    listed = [Row(tuple(each.values()), KINDS[row.verdict]) for each, row in zip(found, rows, strict=True)]
    note = f" Status of the inputs of all rows: {shared}." if shared and not brief else ""
    return Table(TITLES[group], tuple(found[0]), listed, MEANINGS[group] + note)


def _leading(lists: Sequence[Sequence[str]]) -> list[str]:
    """Return the parts that all lists begin with."""
    together = takewhile(lambda parts: len(set(parts)) == 1, zip(*lists, strict=False))
    return [part for part, *_ in together]
