"""Options that several commands share, and how numbers are read."""

from __future__ import annotations

from typing import Annotated

import typer

from fingerpad.cli.choices import MATERIAL_CHOICES, RESOLUTION_CHOICES


def to_whole(text: str) -> int:
    """Read an option, and repeat what came where it cannot be read."""
    try:
        return int(text)
    except ValueError as error:
        raise typer.BadParameter(f"must be a whole number: got {text!r}.") from error


def to_number(text: str) -> float:
    """Read an option, and repeat what came where it cannot be read."""
    try:
        return float(text)
    except ValueError as error:
        raise typer.BadParameter(f"must be a number: got {text!r}.") from error


Resolution = Annotated[str, typer.Option(help=f"One of {', '.join(RESOLUTION_CHOICES)}.")]
Materials = Annotated[str, typer.Option(help=f"One of {', '.join(MATERIAL_CHOICES)}.")]
Jobs = Annotated[
    int | None,
    typer.Option(parser=to_whole, metavar="INTEGER", help="Number of processes. Default: one per core."),
]
