"""A study and the command that runs it: press what is missing, compute, write numbers and a page."""

from __future__ import annotations

import argparse
from collections.abc import Callable, Mapping
from dataclasses import dataclass
from pathlib import Path
from typing import Any

from fingerpad.cli.commands import Command, option, processes, progress
from fingerpad.core.files import make_writable, write_atomically
from fingerpad.core.result_files import to_json
from fingerpad.experiments.conditions import Conditions
from fingerpad.experiments.runner import Runner
from studies.pages import DOCS, joined, write_blocks


@dataclass(frozen=True)
class Study:
    """A study: what it computes and which page shows it."""

    name: str
    help: str  #: Of the command and of the files; what it does, in one line.
    run: Callable[[Runner, Conditions], Any]
    """From a runner and conditions to a result, an instance of a `result_class`."""
    blocks: Callable[[Any], Mapping[str, str]]
    """From that result to the blocks of the page, Markdown by name."""
    page: str | None  #: Page of docs/ that has these blocks.
    has_conditions: bool = True  #: Whether resolution, seed and tissues can be chosen.


def run_study(study: Study, runner: Runner, conditions: Conditions) -> tuple[Path, Path]:
    """Run a study; write `NAME.md`, its page with new blocks or the blocks, and `NAME.json`, its numbers."""
    result = study.run(runner, conditions)
    numbers = runner.folder / f"{study.name}.json"
    write_atomically(numbers, to_json(result) + b"\n")
    page, blocks = runner.folder / f"{study.name}.md", study.blocks(result)
    if study.page is None:
        write_atomically(page, f"{joined(*blocks.values())}\n".encode())
        return page, numbers
    return write_blocks(DOCS / study.page, blocks, page), numbers


def command_of(study: Study) -> Command:
    """Return the command of a study."""

    def add(parser: argparse.ArgumentParser) -> None:
        option(parser, "--out", "Folder for page, numbers and stored indentations.", Path, Path(study.name))
        option(parser, "--jobs", "Number of processes. Default: one per core.", int)
        if study.has_conditions:
            option(parser, "--resolution", "quick, standard or paper.", str, "quick")
            option(parser, "--seed", "Seed of all random numbers.", int, 0)
            option(parser, "--tissues", "A set of tissues.", str, "human")

    return study.help, add, lambda given: execute(study, given)


def execute(study: Study, given: argparse.Namespace) -> None:
    """Run a study from the command line, with bars on a terminal, and print the paths of its files."""
    asked = (given.resolution, given.seed, given.tissues) if study.has_conditions else ()
    conditions, runner = Conditions(*asked), Runner(given.out, processes(given.jobs), progress())
    make_writable(given.out, "--out")
    page, numbers = run_study(study, runner, conditions)
    print(f"Page: {page}\nResults: {numbers}")
