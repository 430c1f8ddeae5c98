"""`python -m studies drives`: what may drive the afferent."""

from __future__ import annotations

import sys
from pathlib import Path
from typing import Annotated

import typer

from fingerpad.cli.options import Jobs, Resolution, to_whole
from fingerpad.cli.running import interruptible, make_writable, processes
from fingerpad.core.files import write_json


def drives_command(
    resolution: Resolution = "standard",
    out: Annotated[
        Path,
        typer.Option(help="Folder for page, figure, numbers and stored indentations, as of a reproduction."),
    ] = Path("reproduction"),
    jobs: Jobs = None,
    seed: Annotated[
        int, typer.Option(parser=to_whole, metavar="INTEGER", help="Seed of search and bootstrap.")
    ] = 0,
) -> None:
    """Compare what may drive the afferent: quantities in the skin, and explanations of the dynamic rates."""
    from rich.console import Console

    from fingerpad.experiments.conditions import Conditions
    from studies.drive_study import DriveStudy, study_drives
    from studies.pages.drive_study import write_drive_page

    study = DriveStudy(Conditions(resolution=resolution, seed=seed), out, processes(jobs))
    make_writable(out)
    console = Console(stderr=True, quiet=not sys.stderr.isatty())
    with interruptible():
        results = study_drives(study, lambda part: console.print(f"done: {part}"))
        numbers = out / "drive_quantities.json"
        write_json(numbers, results)
        page = write_drive_page(results, out, f"python -m studies drives --resolution {resolution}")
    typer.echo(f"Page: {page}")
    typer.echo(f"Results: {numbers}")
