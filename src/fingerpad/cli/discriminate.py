"""`fingerpad discriminate`: what a person could tell apart."""

from __future__ import annotations

import shlex
import sys
from pathlib import Path
from typing import Annotated

import typer

from fingerpad.cli.choices import RESOLUTIONS
from fingerpad.cli.options import Jobs
from fingerpad.cli.running import Bars, interruptible, make_writable, processes
from fingerpad.core.errors import InputError
from fingerpad.core.files import write_json


def discriminate_command(
    question: Annotated[
        str | None,
        typer.Argument(
            metavar="QUESTION",
            help="YAML file, see docs/discriminate.md, or the name of a ready-made question.",
        ),
    ] = None,
    out: Annotated[
        Path, typer.Option(help="Folder for page, figures, results and stored indentations.")
    ] = Path("discriminate"),
    resolution: Annotated[
        str | None, typer.Option(help=f"Instead of the question's: {', '.join(RESOLUTIONS)}.")
    ] = None,
    jobs: Jobs = None,
    ready_made: Annotated[
        bool, typer.Option("--list", help="Name the questions that come with the package, and end.")
    ] = False,
    example: Annotated[
        str | None, typer.Option(help="Print one of them, to make it your own, and end.")
    ] = None,
) -> None:
    """Ask what a person could tell apart: any stimuli, any population, any code."""
    from rich.console import Console

    from fingerpad.core.checks import one_of
    from fingerpad.experiments.discrimination import discriminate
    from fingerpad.experiments.discrimination import task_files as question_file
    from fingerpad.report.discrimination_task import summary, write_discrimination_page

    known = question_file.ready_made()
    if ready_made:
        for name, text in known.items():
            typer.echo(f"{name}: {question_file.title(text)}")
        return
    if example is not None:
        typer.echo(known[one_of("--example", example, tuple(known))], nl=False)
        return
    if question is None:
        raise InputError(
            f"discriminate needs a question, a YAML file or one of {', '.join(known)}: see --help."
        )
    asked = question_file.read_question(question, resolution=resolution)
    task = discriminate.Discrimination(asked, out, processes(jobs), question)
    make_writable(out)
    with interruptible():
        results = discriminate.run(
            task,
            Bars(Console(stderr=True)),
            command=shlex.join(["fingerpad", *sys.argv[1:]]),
            inputs=question_file.provenance(question, asked),
        )
        write_json(out / "discriminate.json", results)
        page = write_discrimination_page(results, out)
    for paragraph in summary(results["discrimination"]):
        typer.echo(paragraph)
    typer.echo(f"Report: {page}")
    typer.echo(f"Results: {out / 'discriminate.json'}")
