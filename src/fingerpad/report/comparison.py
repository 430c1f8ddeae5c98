"""The paper beside a run: its statements that can fail, then one table per group of further rows."""

from __future__ import annotations

from collections.abc import Sequence

from fingerpad.experiments.gerling2014.claim_row import ABSENT, ClaimRow, Group, Statement, Verdict
from fingerpad.report.formatting import joined
from fingerpad.report.parts import COLUMNS, Row, Table, listed

SIGNS = {Verdict.MET: "✓", Verdict.MISSED: "✗", Verdict.NOT_DECIDABLE: "?", Verdict.NOT_APPLICABLE: "–"}
"""Sign of each verdict; they differ without colour."""

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


SETS = (
    "`paper` is the paper's own system: Trial 3 with a Poisson's ratio of 0.40, strain energy density in "
    "both terms, response surfaces. `human` serves all three levels."
)


def side_by_side(paper: Sequence[ClaimRow], human: Sequence[ClaimRow]) -> list[tuple[ClaimRow, Row]]:
    """Return the rows that are no statement, each with its cells for both sets."""
    by_name = [{row.quantity: row for row in rows} for rows in (paper, human)]
    stated = {row.quantity for row in (*paper, *human) if row.group is Group.STATEMENT}
    names = dict.fromkeys(row.quantity for row in (*paper, *human) if row.quantity not in stated)
    made = []
    for both in ([found.get(name) for found in by_name] for name in names):
        known = [row for row in both if row is not None]
        cells = [known[0].quantity, known[0].paper]
        for row in both:
            cells += [ABSENT, ""] if row is None else [row.ours, _marked(row.verdict, row.fitted_to)]
        told = dict.fromkeys("; ".join(text for text in (row.fitted_to, row.note) if text) for row in known)
        # A number that one set was fitted to is shown as fitted.
        first = min(known, key=lambda row: row.group is not Group.FITTED)
        made.append((first, Row.of(*cells, " | ".join(told))))
    return made


def comparison_tables(paper: Sequence[ClaimRow], human: Sequence[ClaimRow]) -> list[Table]:
    """Return one table per group of rows that are no statement, both sets side by side."""
    rows = side_by_side(paper, human)
    found = {group: [row for first, row in rows if first.group is group] for group in TITLES}
    columns = ("quantity", "the paper", "`paper`", "", "`human`", "", "what was fitted, and how it is judged")
    return [Table(TITLES[group], columns, each, MEANINGS[group]) for group, each in found.items() if each]


def notes_table(paper: Sequence[ClaimRow], human: Sequence[ClaimRow]) -> Table:
    """Return how each statement that can fail was judged, and what was fitted before, set by set."""
    rows: dict[str, list[str]] = {}
    for name, found in (("`paper`", paper), ("`human`", human)):
        for row in found:
            if row.group is Group.STATEMENT:
                rows.setdefault(row.quantity, []).append(f"{name}: {row.note}")
    notes = {quantity: "; ".join(found) for quantity, found in rows.items()}
    columns, meaning = ("statement", "note"), MEANINGS[Group.STATEMENT]
    return listed("How the statements are judged", notes, columns, meaning)


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
    missed = [
        f"{statement} (fitted)" if statement in fitted else statement
        for statement, verdict in verdicts.items()
        if verdict is Verdict.MISSED
    ]
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
        [Row.of(each.section, *statement_cells(each)) for each in statements],
        SETS,
    )


def verdict_table(statements: Sequence[Statement]) -> Table:
    """Return the verdict of every statement that can fail with both sets, and how many are met."""
    rows = []
    for each in statements:
        paper, human = statement_cells(each)[3::2]
        rows.append(Row.of(f"{each.section} {each.statement}", paper, human))
    met = (sum(getattr(each, f"verdict_{name}") is Verdict.MET for each in statements) for name in COLUMNS)
    rows.append(Row.of("met", *(f"{count} of {len(statements)}" for count in met), kind="final"))
    return Table("", ("section and statement of the paper", *(f"`{name}`" for name in COLUMNS)), rows, SETS)


def statement_cells(each: Statement) -> tuple[str, ...]:
    """Return what the paper says, and our value and verdict of both sets."""
    paper, human = (
        (getattr(each, name), _marked(getattr(each, f"verdict_{name}"), getattr(each, f"fitted_{name}")))
        for name in ("paper", "human")
    )
    return each.statement, each.published, *paper, *human


def _marked(verdict: Verdict, fitted: str) -> str:
    """Sign and words of a verdict, and whether something was fitted to it."""
    return f"{SIGNS[verdict]} {verdict.value}" + (" (fitted)" if fitted else "")
