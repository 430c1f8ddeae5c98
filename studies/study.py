"""A study and the command that runs it: solve missing indentations, compute, write numbers and a page."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass
from pathlib import Path
from typing import Annotated, Any

import typer

from fingerpad.cli.options import Jobs, Resolution, Tissues, to_whole
from fingerpad.cli.running import interruptible, make_writable, processes, progress
from fingerpad.core.files import write_atomically
from fingerpad.core.results import to_json
from fingerpad.experiments.conditions import Conditions
from fingerpad.experiments.runner import Runner
from fingerpad.report.parts import Page
from studies.pages.markdown import write_markdown

Seed = Annotated[int, typer.Option(parser=to_whole, metavar="INTEGER", help="Seed of all random numbers.")]
TISSUES = "trial3"
"""Tissues of the studies: those with which their pages were made."""

Out = Annotated[Path, typer.Option(help="Folder for page, figures, numbers and stored indentations.")]


@dataclass(frozen=True)
class Study:
    """A study: what it computes and how its page looks.

    Parameters
    ----------
    name : str
        Of the command and of the files.
    help : str
        What it does, in one line.
    run : callable
        From a runner and conditions to a result, an instance of a `result_class`.
    page : callable
        From that result to its page.
    resolution : str or None, optional
        Resolution by default; None for a study that has resolutions and random numbers of its own.
    tissues : str, optional
        Tissues by default.
    """

    name: str
    help: str
    run: Callable[[Runner, Conditions], Any]
    page: Callable[[Any], Page]
    resolution: str | None = "quick"
    tissues: str = TISSUES


def run_study(study: Study, runner: Runner, conditions: Conditions) -> tuple[Path, Path]:
    """Run a study, and write its numbers and its page.

    Parameters
    ----------
    study : Study
        Which.
    runner : Runner
        Files are written into its folder.
    conditions : Conditions
        Finger, tissues, accuracy and seed.

    Returns
    -------
    (Path, Path)
        `NAME.md` and `NAME.json`.

    Raises
    ------
    ConvergenceError
        If an indentation cannot be solved; finished ones stay stored.
    StoreError
        If a stored indentation is damaged or the folder cannot be written.
    """
    result = study.run(runner, conditions)
    numbers = runner.folder / f"{study.name}.json"
    write_atomically(numbers, to_json(result) + b"\n")
    return write_markdown(study.page(result), runner.folder / f"{study.name}.md"), numbers


def command_of(study: Study) -> Callable[..., None]:
    """Return the command line of a study: folder, processes and, where it has them, resolution and seed."""

    def command(
        resolution: Resolution = study.resolution or "",
        out: Out = Path(study.name),
        jobs: Jobs = None,
        seed: Seed = 0,
        tissues: Tissues = study.tissues,
    ) -> None:
        execute(study, Conditions(resolution, seed, tissues), out, jobs)

    def without_conditions(out: Out = Path(study.name), jobs: Jobs = None) -> None:
        execute(study, Conditions(tissues=study.tissues), out, jobs)

    chosen = command if study.resolution else without_conditions
    chosen.__doc__ = study.help
    return chosen


def execute(study: Study, conditions: Conditions, out: Path, jobs: int | None) -> None:
    """Run a study from the command line, with bars on a terminal, and print the paths of its files."""
    runner = Runner(out, processes(jobs), progress())
    make_writable(out)
    with interruptible():
        page, numbers = run_study(study, runner, conditions)
    typer.echo(f"Page: {page}\nResults: {numbers}")
