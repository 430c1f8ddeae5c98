"""`fingerpad lab`: a laboratory in the browser."""

from __future__ import annotations

from pathlib import Path
from typing import Annotated

import typer

from fingerpad.cli.options import Jobs, integer_option, option
from fingerpad.cli.running import engine, interruptible, make_writable, progress


def lab_command(
    ranges: Annotated[
        list[Path] | None,
        typer.Argument(
            metavar="[RANGE]...",
            help="YAML files of `fingerpad reduce`, each an object by the name of its file. "
            "Default: a ball, a cylinder and a plate.",
        ),
    ] = None,
    folder: Annotated[Path, option("Where presses and reduced touches are kept for the next time.")] = Path(
        "lab"
    ),
    port: Annotated[int, integer_option("Port of the page. Default: one that is free.")] = 0,
    static: Annotated[
        Path | None, option("Write a page into this folder that needs no server, and serve nothing.")
    ] = None,
    jobs: Jobs = None,
) -> None:
    """Press objects into the finger in the browser, on this computer alone."""
    from fingerpad.lab.laboratory import Laboratory
    from fingerpad.lab.server import require_panel, serve
    from fingerpad.lab.static import write_static

    with interruptible("The next laboratory in the same folder presses nothing again."):
        if static is None:
            require_panel()
        laboratory = Laboratory(folder, ranges or (), engine(jobs, None))
        make_writable(folder, "--folder")
        if static is not None:
            make_writable(static, "--static")
            written = write_static(laboratory, static, progress())
            typer.echo(f"Open: {written} ({written.stat().st_size / 1e6:.1f} MB)")
            return
        serve(laboratory, port, lambda address: typer.echo(f"Open: {address}"))
