"""Options that several commands share, and how numbers are read."""

from __future__ import annotations

from typing import Annotated, Any

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


def number_option(help_text: str) -> Any:
    """Make an option that takes a number."""
    return typer.Option(parser=to_number, metavar="NUMBER", help=help_text)


def integer_option(help_text: str) -> Any:
    """Make an option that takes a whole number."""
    return typer.Option(parser=to_whole, metavar="INTEGER", help=help_text)


Resolution = Annotated[str, typer.Option(help=f"One of {', '.join(RESOLUTION_CHOICES)}.")]
Materials = Annotated[str, typer.Option(help=f"One of {', '.join(MATERIAL_CHOICES)}.")]
Jobs = Annotated[int | None, integer_option("Number of processes. Default: one per core.")]
Seed = Annotated[int, integer_option("Seed of the random numbers.")]
