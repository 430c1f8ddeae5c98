"""`fingerpad discriminate`: thresholds in a discrimination task."""

from __future__ import annotations

from pathlib import Path
from typing import Annotated

import typer

from fingerpad.cli.options import RESOLUTION_CHOICES, Jobs, Scheduler, option
from fingerpad.cli.running import command_line, engine, interruptible, make_writable, progress, tell
from fingerpad.core.errors import InputError


def discriminate_command(
    task: Annotated[
        str | None,
        typer.Argument(
            metavar="TASK", help="YAML file (format: docs/discriminate.md), or the name of an example task."
        ),
    ] = None,
    out: Annotated[Path, option("Folder for page, figures, results and stored indentations.")] = Path(
        "discriminate"
    ),
    resolution: Annotated[
        str | None, option(f"One of {', '.join(RESOLUTION_CHOICES)}. Default: that of the task.")
    ] = None,
    jobs: Jobs = None,
    scheduler: Scheduler = None,
    listed: Annotated[bool, option("List the example tasks of the package, and exit.", "--list")] = False,
    example: Annotated[str | None, option("Print the YAML file of an example task, and exit.")] = None,
) -> None:
    """Predict hit rates, psychometric curves and thresholds of a discrimination task."""
    from fingerpad.core.values import one_of
    from fingerpad.experiments import schemas
    from fingerpad.experiments.discrimination.run import DiscriminationRun, discriminate
    from fingerpad.experiments.discrimination.task_stimuli import (
        example_tasks,
        input_hashes,
        read_task,
        task_text,
        title,
    )
    from fingerpad.report.task import task_summary, write_task_page

    known = example_tasks()
    if listed:
        for name, text in known.items():
            typer.echo(f"{name}: {title(text)}")
        return
    if example is not None:
        typer.echo(known[one_of("--example", example, tuple(known))], nl=False)
        return
    if task is None:
        raise InputError(
            "discriminate", f"needs a task, a YAML file or one of {', '.join(known)}", remedy="see --help"
        )
    asked = read_task(task, resolution=resolution)
    run = DiscriminationRun(asked, out, engine(jobs, scheduler), task, task_text(task))
    make_writable(out)
    with interruptible():
        results = discriminate(
            run, progress(), command=command_line(), inputs=input_hashes(task, asked, run.prepared.stimuli)
        )
        page = write_task_page(results, out)
        schemas.write(out / "discriminate.json", results)
    tell(task_summary(results.discrimination), page, out / "discriminate.json")
