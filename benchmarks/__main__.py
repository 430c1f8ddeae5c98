"""`python -m benchmarks [NAME ...]`: run benchmarks, all by default, and write their sections of README.md.

`python -m benchmarks --page` runs none and writes the page from the reports that are there.
"""

from __future__ import annotations

import importlib
import sys
from collections.abc import Sequence
from dataclasses import replace

from benchmarks import machine
from benchmarks.page import PAGE, rewritten
from benchmarks.results import aligned, read_all, write
from fingerpad.core.files import write_atomically

# Short ones first; `peers` installs other programs, and CalculiX alone runs for a quarter of an hour.
BENCHMARKS = (
    "startup",
    "population",
    "mixed_population",
    "surfaces",
    "reduced",
    "laboratory",
    "sweeps",
    "touches",
    "sphere",
    "fitting",
    "paper_size",
    "growth",
    "reproduction",
    "neurons",
    "peers",
)


def run(names: Sequence[str]) -> int:
    """Run benchmarks one after the other.

    Parameters
    ----------
    names : sequence of str
        Which; none for all, "--page" for the page alone.

    Returns
    -------
    int
        Exit status.
    """
    unknown = [name for name in names if name not in (*BENCHMARKS, "--page")]
    if unknown:
        print(f"benchmarks: {', '.join(unknown)} is none of {', '.join(BENCHMARKS)}.", file=sys.stderr)
        return 2
    chosen = () if "--page" in names else tuple(names) or BENCHMARKS
    for name in chosen:
        before = machine.describe()
        report = replace(importlib.import_module(f"benchmarks.{name}").measure(), machine=before)
        print(f"\n{report.title}")
        for table in report.tables:
            print(aligned(table))
        for note in report.notes:
            print(f"  {note}")
        print(f"wrote {write(report).name}", flush=True)
        write_page()
    if not chosen:
        write_page()
    return 0


def write_page() -> None:
    """Write README.md anew from all reports."""
    write_atomically(PAGE, rewritten(PAGE.read_text(encoding="utf-8"), read_all()).encode())


if __name__ == "__main__":
    sys.exit(run(sys.argv[1:]))
