"""What a benchmark reports: tables to read, numbers to judge, and the machine; as JSON on disk."""

from __future__ import annotations

import json
from collections.abc import Sequence
from dataclasses import asdict, dataclass, field
from pathlib import Path
from typing import Any

from benchmarks import machine
from benchmarks.targets import TARGETS
from fingerpad.core.files import write_atomically

RESULTS = Path(__file__).parent / "results"


@dataclass(frozen=True)
class Table:
    """Rows under headings.

    Parameters
    ----------
    caption : str
        A sentence above it.
    columns : sequence of str
        Headings, with units.
    rows : sequence of sequences
        Cells: numbers, text, or None for what does not apply.
    """

    caption: str
    columns: Sequence[str]
    rows: Sequence[Sequence[Any]]

    def __post_init__(self) -> None:
        for row in self.rows:
            if len(row) != len(self.columns):
                raise ValueError(f"A row needs {len(self.columns)} cells: got {list(row)}.")


@dataclass(frozen=True)
class Report:
    """What one benchmark found.

    Parameters
    ----------
    name : str
        The script's.
    title, about : str
        Heading, and what was measured and how.
    tables : sequence of Table
        To read.
    measured : dict
        Numbers by the key of their target.
    notes : sequence of str
        What a reader must know to judge the numbers.
    machine : dict
        As of `machine.describe`.
    """

    name: str
    title: str
    about: str
    tables: Sequence[Table]
    measured: dict[str, float] = field(default_factory=dict)
    notes: Sequence[str] = ()
    machine: dict[str, Any] = field(default_factory=machine.describe)

    def __post_init__(self) -> None:
        expected = {target.key for target in TARGETS if target.benchmark == self.name}
        strange = set(self.measured) - expected
        if strange:
            raise ValueError(f"{self.name} has targets {sorted(expected)}: got {sorted(strange)} besides.")


def write(report: Report, folder: Path = RESULTS) -> Path:
    """Write a report, whole or not at all.

    Returns
    -------
    Path
        The JSON file.
    """
    path = folder / f"{report.name}.json"
    write_atomically(path, (json.dumps(asdict(report), indent=1, ensure_ascii=False) + "\n").encode())
    return path


def read_all(folder: Path = RESULTS) -> dict[str, Report]:
    """Read all reports, by name."""
    found = {}
    for path in sorted(folder.glob("*.json")):
        content = json.loads(path.read_text(encoding="utf-8"))
        tables = [Table(**table) for table in content.pop("tables")]
        found[path.stem] = Report(**content, tables=tables)
    return found


def cell(value: Any) -> str:
    """Show a value of a table.

    Examples
    --------
    >>> [cell(value) for value in (None, 281806, 12.3456, 0.001234, "all", True)]
    ['', '281,806', '12.3', '0.00123', 'all', 'yes']
    """
    if value is None:
        return ""
    if isinstance(value, bool):
        return "yes" if value else "no"
    if isinstance(value, int):
        return f"{value:,}"
    if isinstance(value, float):
        return f"{value:,.0f}" if abs(value) >= 100.0 else f"{value:.3g}"
    return str(value)


def aligned(table: Table) -> str:
    """Show a table in a terminal.

    Examples
    --------
    >>> print(aligned(Table("Twice:", ["mesh", "s"], [["coarse", 1.5], ["fine", 120.0]])))
    Twice:
      mesh    s
      coarse  1.5
      fine    120
    """
    cells = [list(table.columns), *([cell(value) for value in row] for row in table.rows)]
    widths = [max(len(row[n]) for row in cells) for n in range(len(table.columns))]
    lines = [
        "  " + "  ".join(text.ljust(width) for text, width in zip(row, widths, strict=True)) for row in cells
    ]
    return "\n".join([table.caption, *(line.rstrip() for line in lines)])
