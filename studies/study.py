"""A study and the command that runs it: press what is missing, compute, write numbers and a page."""

from __future__ import annotations

from collections.abc import Callable, Mapping
from dataclasses import dataclass
from pathlib import Path
from typing import Annotated, Any

import typer

from fingerpad.cli.options import Jobs, Resolution, Tissues, to_whole
from fingerpad.cli.running import interruptible, make_writable, processes, progress
from fingerpad.core.files import write_atomically
from fingerpad.core.result_files import to_json
from fingerpad.experiments.conditions import Conditions
from fingerpad.experiments.runner import Runner
from studies.pages import DOCS, joined, write_blocks

Seed = Annotated[int, typer.Option(parser=to_whole, metavar="INTEGER", help="Seed of all random numbers.")]
Out = Annotated[Path, typer.Option(help="Folder for page, numbers and stored indentations.")]


@dataclass(frozen=True)
class Study:
    """A study: what it computes and which page shows it.

    Parameters
    ----------
    name, help : str
        Of the command and of the files; what it does, in one line.
    run : callable
        From a runner and conditions to a result, an instance of a `result_class`.
    blocks : callable
        From that result to the blocks of the page, Markdown by name.
    page : str or None
        Page of docs/ that has these blocks.
    has_conditions : bool
        Whether resolution, seed and tissues can be chosen.
    """

    name: str
    help: str
    run: Callable[[Runner, Conditions], Any]
    blocks: Callable[[Any], Mapping[str, str]]
    page: str | None
    has_conditions: bool = True


def run_study(study: Study, runner: Runner, conditions: Conditions) -> tuple[Path, Path]:
    """Run a study, and write `NAME.md`, its page with new blocks or the blocks, and `NAME.json`, its numbers.

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
    page, blocks = runner.folder / f"{study.name}.md", study.blocks(result)
    if study.page is None:
        write_atomically(page, f"{joined(*blocks.values())}\n".encode())
        return page, numbers
    return write_blocks(DOCS / study.page, blocks, page), numbers


def command_of(study: Study) -> Callable[..., None]:
    """Return the command line of a study."""

    def command(
        resolution: Resolution = "quick",
        out: Out = Path(study.name),
        jobs: Jobs = None,
        seed: Seed = 0,
        tissues: Tissues = "human",
    ) -> None:
        execute(study, Conditions(resolution, seed, tissues), out, jobs)

    def without_conditions(out: Out = Path(study.name), jobs: Jobs = None) -> None:
        execute(study, Conditions(), out, jobs)

    chosen = command if study.has_conditions else without_conditions
    chosen.__doc__ = study.help
    return chosen


def execute(study: Study, conditions: Conditions, out: Path, jobs: int | None) -> None:
    """Run a study from the command line, with bars on a terminal, and print the paths of its files."""
    runner = Runner(out, processes(jobs), progress())
    make_writable(out)
    with interruptible():
        page, numbers = run_study(study, runner, conditions)
    typer.echo(f"Page: {page}\nResults: {numbers}")
