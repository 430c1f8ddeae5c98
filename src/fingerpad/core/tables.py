"""Tables in user files: rows with their position in the file, for error messages."""

from __future__ import annotations

import csv
import io
from collections import Counter
from collections.abc import Callable, Iterator, Mapping, Sequence
from contextlib import contextmanager, suppress
from dataclasses import dataclass
from pathlib import Path
from typing import Any

import numpy as np

from fingerpad.core.errors import InputError, did_you_mean
from fingerpad.core.files import read_text
from fingerpad.core.values import FloatArray, finite, number_in, numbers_in

Check = Callable[[str, Any, str], float]


@dataclass(frozen=True)
class TableRow:
    """One row of a table and its position in the file."""

    place: str  #: File and line, for messages.
    entries: Mapping[str, Any]  #: Texts, or typed values, by column; an absent or empty entry was not given.
    line: int = 0  #: Line of the file; 0 where there are no lines.

    def has(self, column: str) -> bool:
        """Whether this row gives a value for `column`."""
        value = self.entries.get(column)
        return value is not None and not (isinstance(value, str) and not value.strip())

    def text(self, column: str) -> str:
        """Entry of `column` as text without spaces around it, else raise `InputError`."""
        if not self.has(column):
            raise InputError(f"{self.place}: {column} must be given, its entry is empty.")
        return str(self.entries[column]).strip()

    def number(self, column: str, unit: str = "", check: Check = finite) -> float:
        """Entry of `column` as a number that passes `check`, else raise `InputError`."""
        self.text(column)
        with self.placed():
            entry = self.entries[column]
            return check(column, number_in(column, entry, unit) if isinstance(entry, str) else entry, unit)

    @contextmanager
    def placed(self) -> Iterator[None]:
        """Prefix an `InputError` raised in the block with the position in the file."""
        try:
            yield
        except InputError as error:
            raise InputError(f"{self.place}: {error}") from error


def column_of(rows: Sequence[TableRow], column: str, unit: str = "", check: Check = finite) -> FloatArray:
    """Entries of a column as numbers that pass `check`, as `TableRow.number`; much faster for many rows."""
    entries: list[Any] = [row.entries.get(column) for row in rows]
    if all(isinstance(entry, str) for entry in entries):
        with suppress(InputError):  # which row it is is told below
            values = numbers_in(column, entries, unit)
            for end in (values.min(), values.max()):
                check(column, end, unit)
            return values
    return np.array([row.number(column, unit, check) for row in rows])


def read_csv(path: Path, known: Sequence[str], prefixes: tuple[str, ...] = ()) -> list[TableRow]:
    r"""Rows of a CSV file: comments begin with #, then a header, then one row per line."""
    texts = io.StringIO(read_text(path), newline="")
    # An empty line in the place of a comment keeps the line numbers.
    reader = csv.reader(("\n" if text.lstrip().startswith("#") else text for text in texts), strict=True)
    try:
        rows = [(reader.line_num, row) for row in reader if any(entry.strip() for entry in row)]
    except csv.Error as error:
        raise InputError(f"{path}, line {reader.line_num}: cannot be read as CSV: {error}.") from error
    if len(rows) < 2:
        raise InputError(
            path, "must hold a header and at least one row", remedy=f"it has {len(rows)} of them"
        )
    (header_line, header), *body = rows
    columns = [column.strip() for column in header]
    repeated = {column for column, count in Counter(columns).items() if count > 1}
    for column in columns:
        if column not in known and not column.startswith(prefixes):
            separator = next((each for each in (";", "\t") if each in column), "")
            hint = f" Separate entries by commas, not by {separator!r}." if separator else ""
            raise InputError(
                f"{path}, line {header_line}: column {column!r} is unknown: "
                f"{did_you_mean(column, known, 'a table')}{hint}"
            )
        if column in repeated:
            raise InputError(f"{path}, line {header_line}: column {column} is repeated, keep one.")
    lines = []
    for number, row in body:
        if len(row) != len(columns):
            raise InputError(
                f"{path}, line {number}: must have {len(columns)} entries, one per column: got {len(row)}."
            )
        lines.append(TableRow(f"{path}, line {number}", dict(zip(columns, row, strict=True)), number))
    return lines
