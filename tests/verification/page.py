"""docs/verification.md from the stored rows of all cases."""

from __future__ import annotations

import csv
from collections.abc import Mapping, Sequence
from pathlib import Path

from .case import ABSOLUTE, AT_LEAST, AT_MOST, RELATIVE, Case, Row

ROOT = Path(__file__).parents[2]
PAGE = ROOT / "docs" / "verification.md"
IMAGES = ROOT / "docs" / "images"
ROWS = ROOT / "docs" / "verification" / "cases.csv"
COLUMNS = ("case", "quantity", "unit", "expected", "got", "tolerance", "judged")

INTRODUCTION = """\
# Verification of the mechanics

Cases with known solutions. A row has the number of comparisons that hold, and the one that is nearest to its
bound. `make verification` runs all cases, stores all numbers in [cases.csv](verification/cases.csv) and
writes this page; the fast ones run in every `make test`. The cases are in `tests/verification`. Closed forms
are written there in NumPy, independently of the package.
"""


def write_rows(cases: Sequence[Case]) -> None:
    """Run cases and keep their rows."""
    with ROWS.open("w", encoding="utf-8", newline="") as file:
        writer = csv.writer(file, lineterminator="\n")
        writer.writerow(COLUMNS)
        for case in cases:
            for row in case.rows:
                numbers = (f"{each:.12g}" for each in (row.expected, row.got, row.tolerance))
                writer.writerow([case.name, row.quantity, row.unit, *numbers, row.judged])


def read_rows() -> dict[str, list[Row]]:
    """Stored rows by the name of their case."""
    rows: dict[str, list[Row]] = {}
    with ROWS.open(encoding="utf-8", newline="") as file:
        for line in csv.DictReader(file):
            expected, got, tolerance = (float(line[name]) for name in ("expected", "got", "tolerance"))
            row = Row(line["quantity"], expected, got, tolerance, line["judged"], line["unit"])
            rows.setdefault(line["case"], []).append(row)
    return rows


def number(value: float) -> str:
    """Four digits where they matter, two where a size says enough.

    >>> number(0.437929411), number(4.2e-14), number(1234.5678)
    ('0.4379', '4.2e-14', '1235')
    """
    return f"{value:.1e}" if 0.0 < abs(value) < 1e-4 else f"{value:.4g}"


def expectation(row: Row) -> str:
    """What is expected, a bound with its sign, and what may differ.

    >>> from .case import at_most, near
    >>> expectation(near("force", 1.0, 1.0, relative=0.03)), expectation(at_most("error", 0.1, 0.0))
    ('1 ± 3 %', '≤ 0.1')
    """
    if row.judged in (AT_MOST, AT_LEAST):
        return ("≤ " if row.judged == AT_MOST else "≥ ") + number(row.expected)
    relative = row.judged == RELATIVE
    return f"{number(row.expected)} ± " + (
        f"{100 * row.tolerance:.2g} %" if relative else number(row.tolerance)
    )


def used(row: Row) -> float:
    """Share of what a row may differ, or of its bound, that is used; 1 is the limit."""
    if row.judged in (AT_MOST, AT_LEAST):
        low, high = (row.got, row.expected) if row.judged == AT_MOST else (row.expected, row.got)
        return low / high if high else 0.0
    allowed = row.tolerance * (1.0 if row.judged == ABSOLUTE else abs(row.expected))
    return abs(row.got - row.expected) / allowed if row.got != row.expected else 0.0


def page_text(cases: Sequence[Case], rows: Mapping[str, Sequence[Row]], pictures: str, closing: str) -> str:
    """Return the whole page.

    Parameters
    ----------
    cases : sequence of Case
        In order.
    rows : mapping
        Rows by the name of their case.
    pictures, closing : str
        Markdown after the table: the pictures, and a section without cases.
    """
    everything = [row for case in cases for row in rows[case.name]]
    held = sum(row.passes for row in everything)
    lines = [
        INTRODUCTION,
        f"**{held} of {len(everything)} numbers hold, in {len(cases)} cases.**",
        "",
        "| case | against | hold | nearest to its bound | expected | got |",
        "|---|---|---|---|---|---|",
    ]
    for case in cases:
        own = rows[case.name]
        nearest = max(own, key=used)
        passed = sum(row.passes for row in own)
        cells = [
            case.title,
            case.source,
            f"{passed}/{len(own)}" + ("" if passed == len(own) else " **fails**"),
            nearest.quantity,
            expectation(nearest),
            f"{number(nearest.got)} {nearest.unit}".rstrip(),
        ]
        lines.append("| " + " | ".join(cells) + " |")
    return "\n".join([*lines, "", pictures, "", closing])
