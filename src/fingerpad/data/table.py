"""Tables of observations in the package: comment lines first, then columns of numbers."""

from __future__ import annotations

import csv
from dataclasses import dataclass
from importlib.resources import files

from fingerpad.core.checks import FloatArray, float_array, number_in, one_of
from fingerpad.core.errors import InputError
from fingerpad.data.published import STATUSES


@dataclass(frozen=True)
class Table:
    """Columns of numbers with content, source and status."""

    columns: dict[str, FloatArray]  # Values by column name; the name carries the unit, (n_rows,).
    content: str
    source: str
    status: str  # Observed quantity, publication, and status of the numbers.


def packaged_table(name: str) -> Table:
    """Table `name` of the data that come with the package."""
    return parsed_table(
        name, (files("fingerpad.data") / "tables" / f"{name}.csv").read_text(encoding="utf-8")
    )


def parsed_table(name: str, text: str) -> Table:
    r"""Table from the text of a file with lines `# source: ...`, `# status: ...`, a header and numbers."""
    lines = [line for line in text.splitlines() if line.strip()]
    story = dict(_labelled(line) for line in lines if line.startswith("#"))
    for label in ("content", "source", "status"):
        if not story.get(label):
            raise InputError(name, f"needs a line '# {label}", remedy=f"...': it has {sorted(story)}")
    one_of(f"status of {name}", story["status"], tuple(STATUSES))
    records = list(csv.reader(line for line in lines if not line.startswith("#")))
    if len(records) < 2:
        raise InputError(name, "needs a header and at least one row of numbers", f"{len(records)} line(s)")
    header, *rows = records
    for row in rows:
        if len(row) != len(header):
            raise InputError(name, f"needs {len(header)} entries per row", str(row))
    columns = {
        column: float_array(column, [number_in(f"{column} of {name}", value) for value in values], 1)
        for column, values in zip(header, zip(*rows, strict=True), strict=True)
    }
    return Table(columns, story["content"], story["source"], story["status"])


def _labelled(line: str) -> tuple[str, str]:
    label, _, said = line.removeprefix("#").partition(":")
    return label.strip(), said.strip()
