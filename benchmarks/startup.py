"""Times of the imports of fingerpad and of the commands that compute nothing."""

from __future__ import annotations

import sys
from pathlib import Path
from tempfile import TemporaryDirectory

from benchmarks.measuring import ROOT, Spread, run
from benchmarks.results import Report, Table

REPEATS = 7

IMPORTS = (
    "import fingerpad",
    "from fingerpad import Afferent, Population",
    "from fingerpad import Fingertip, Population, RampAndHold, Sphere, indent",
    "from fingerpad import *",
)
COMMANDS = ("--version", "--help", "reproduce --help")

TIMED = "import json, time; start = time.perf_counter(); {}; print(json.dumps(time.perf_counter() - start))"


def import_s(statement: str, folder: Path | None = None) -> float:
    """Measure an import in a new interpreter, without the start of the interpreter. [s]

    Parameters
    ----------
    statement : str
        The import.
    folder : Path, optional
        An empty folder for the bytecode, which is compiled again. Default: existing bytecode is used.

    Returns
    -------
    float

    Examples
    --------
    >>> 0.0 < import_s("import fingerpad") < 10.0
    True
    """
    elsewhere = {} if folder is None else {"PYTHONPYCACHEPREFIX": str(folder)}
    done = run(
        [sys.executable, "-c", TIMED.format(statement)],
        threads=1,
        environment={"PYTHONPATH": str(ROOT / "src"), **elsewhere},
    )
    return float(done.printed)


def import_without_bytecode_s(statement: str) -> float:
    """Measure the first import after an installation without bytecode. [s]"""
    with TemporaryDirectory() as folder:
        return import_s(statement, Path(folder))


def command_s(options: str) -> float:
    """Measure `fingerpad OPTIONS` from its start to its end. [s]"""
    command = [sys.executable, "-m", "fingerpad", *options.split()]
    return run(command, threads=1, environment={"PYTHONPATH": str(ROOT / "src")}).wall_s


def measure() -> Report:
    """Repeat every import and command in new interpreters, and report the times."""
    imports = {statement: [import_s(statement) for _ in range(REPEATS)] for statement in IMPORTS}
    first = {statement: import_without_bytecode_s(statement) for statement in IMPORTS}
    commands = {options: [command_s(options) for _ in range(REPEATS)] for options in COMMANDS}
    return Report(
        name="startup",
        title="Imports and commands",
        about=f"Each in a new interpreter, {REPEATS} times: median (smallest to largest).",
        tables=[
            Table(
                "Imports, without the start of the interpreter, with and without bytecode:",
                ["statement", "s", "without bytecode, s"],
                [
                    [f"`{statement}`", str(Spread.of(times)), first[statement]]
                    for statement, times in imports.items()
                ],
            ),
            Table(
                "Commands, including the start of the interpreter:",
                ["command", "s"],
                [[f"`fingerpad {options}`", str(Spread.of(times))] for options, times in commands.items()],
            ),
        ],
        measured={"import_s": Spread.of(imports[IMPORTS[0]]).median},
        notes=[
            "The package loads its names at their first use; the other imports show the time of those.",
            "Files are in the file cache; reading them from a disk takes additional time.",
        ],
    )
