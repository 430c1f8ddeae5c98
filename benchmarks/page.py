"""README.md of the benchmarks: what stands between markers is written from the reports."""

from __future__ import annotations

import re
from collections.abc import Mapping, Sequence
from pathlib import Path
from typing import Any

from benchmarks.machine import hardware, occasion
from benchmarks.results import Report, cell
from benchmarks.targets import TARGETS

PAGE = Path(__file__).parent / "README.md"
VERDICTS = {True: "yes", False: "**no**"}


def marked(name: str, content: str) -> str:
    """Content between the markers of a section."""
    return f"<!-- begin {name} -->\n{content}\n<!-- end {name} -->"


def rewritten(text: str, reports: Mapping[str, Report]) -> str:
    r"""Write the marked sections of a page anew, each of them from its report.

    Parameters
    ----------
    text : str
        The page.
    reports : mapping
        Reports by name; a section without one says so.

    Returns
    -------
    str
        The page; what stands outside of markers is untouched.

    Raises
    ------
    ValueError
        If a report has no section.

    Examples
    --------
    >>> print(rewritten("Before\n" + marked("growth", "old") + "\nafter", {}))
    Before
    <!-- begin growth -->
    *Not measured yet.*
    <!-- end growth -->
    after
    """
    lost = [name for name in reports if f"<!-- begin {name} -->" not in text]
    if lost:
        raise ValueError(
            f"README.md needs a section with markers for every report: {', '.join(lost)} has none."
        )

    def section(found: re.Match[str]) -> str:
        name = found[1]
        if name == "targets":
            return marked(name, targets_table(reports))
        if name == "machines":
            return marked(name, machines_table(reports))
        return marked(name, report_text(reports[name]) if name in reports else "*Not measured yet.*")

    return re.sub(r"<!-- begin (\w+) -->\n.*?<!-- end \1 -->", section, text, flags=re.DOTALL)


def targets_table(reports: Mapping[str, Report]) -> str:
    """Every target beside what was measured."""
    rows = []
    for target in TARGETS:
        report = reports.get(target.benchmark)
        value = report.measured.get(target.key) if report else None
        measured = "not measured" if value is None else f"{cell(value)} {target.unit}".rstrip()
        verdict = "" if value is None else VERDICTS[target.met_by(value)]
        rows.append([target.job, target.bound, measured, verdict, f"`{target.benchmark}`"])
    return grid(["job, on 2 cores", "target", "measured", "met", "script"], rows)


def machines_table(reports: Mapping[str, Report]) -> str:
    """Every machine, with the scripts that ran on it."""
    scripts: dict[str, list[str]] = {}
    for name, report in reports.items():
        scripts.setdefault(hardware(report.machine), []).append(f"`{name}`")
    return grid(
        ["machine and packages", "scripts"], [[text, ", ".join(names)] for text, names in scripts.items()]
    )


def report_text(report: Report) -> str:
    """Words, tables, code and date of one report."""
    parts = [report.about]
    for table in report.tables:
        parts += [table.caption, grid(table.columns, table.rows)]
    parts += ["\n".join(f"- {note}" for note in report.notes)] if report.notes else []
    command = f'`make benchmarks ARGS="{report.name}"`'
    parts.append(f"*{command}: {occasion(report.machine)}*")
    return "\n\n".join(parts)


def grid(columns: Sequence[str], rows: Sequence[Sequence[Any]]) -> str:
    """Table in Markdown.

    Examples
    --------
    >>> print(grid(["nodes", "s"], [[20123, 1.5]]))
    | nodes | s |
    |---|---|
    | 20,123 | 1.5 |
    """
    lines = ["| " + " | ".join(columns) + " |", "|" + "---|" * len(columns)]
    lines += ["| " + " | ".join(cell(value) for value in row) + " |" for row in rows]
    return "\n".join(lines)
