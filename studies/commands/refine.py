"""`python -m studies refine`: the error of the meshes."""

from __future__ import annotations

from pathlib import Path
from typing import Annotated

import typer

from fingerpad.cli.options import Jobs
from fingerpad.cli.running import Bars, interruptible, make_writable, processes
from fingerpad.core.files import write_atomically

REFINEMENTS = {"fine": "mesh_refinement", "paper": "paper_size"}
"""Values of `--against`, each with the name of its study and page."""


def refine_command(
    against: Annotated[
        str,
        typer.Option(help="fine: smaller by 1.5 in every direction; paper: the paper's size of mesh."),
    ] = "fine",
    out: Annotated[
        Path, typer.Option(help="Folder for tables, figure, numbers and stored indentations.")
    ] = Path("refinement"),
    jobs: Jobs = None,
) -> None:
    """Press bars and spheres into finer meshes, and report the error of the meshes of every resolution."""
    from importlib import import_module

    from rich.console import Console

    from fingerpad.core.checks import one_of, whole

    one_of("against", against, tuple(REFINEMENTS))
    study, report = (
        import_module(f"{package}.{REFINEMENTS[against]}") for package in ("studies", "studies.pages")
    )
    workers = whole("jobs", processes(jobs), at_least=1)
    make_writable(out)
    with interruptible():
        results = study.run(out, workers, Bars(Console(stderr=True)))
        for file, content in report.documents(results).items():
            write_atomically(out / file, content)
    typer.echo(f"Report: {out / report.PAGE}")
