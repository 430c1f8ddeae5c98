"""Options that several commands share, and how numbers are read."""

from __future__ import annotations

from typing import Annotated

import typer

from fingerpad.cli.choices import MATERIALS, RESOLUTIONS


def whole_number(text: str) -> int:
    """Read an option, and repeat what came where it cannot be read."""
    try:
        return int(text)
    except ValueError as error:
        raise typer.BadParameter(f"must be a whole number: got {text!r}.") from error


def number(text: str) -> float:
    """Read an option, and repeat what came where it cannot be read."""
    try:
        return float(text)
    except ValueError as error:
        raise typer.BadParameter(f"must be a number: got {text!r}.") from error


Resolution = Annotated[str, typer.Option(help=f"One of {', '.join(RESOLUTIONS)}.")]
Materials = Annotated[str, typer.Option(help=f"One of {', '.join(MATERIALS)}.")]
Jobs = Annotated[
    int | None,
    typer.Option(parser=whole_number, metavar="INTEGER", help="Number of processes. Default: one per core."),
]
