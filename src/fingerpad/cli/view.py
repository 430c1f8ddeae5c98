"""`fingerpad view`: a touch in three dimensions and through time."""

from __future__ import annotations

from pathlib import Path
from typing import Annotated

import typer

from fingerpad.cli.options import integer_option, number_option, option
from fingerpad.cli.running import interruptible, progress
from fingerpad.core.errors import InputError


def view_command(
    result: Annotated[
        Path,
        typer.Argument(
            metavar="RESULT", help="Touch as .nc or .zarr, or the folder that holds touch.nc or touch.zarr."
        ),
    ],
    out: Annotated[
        Path | None, option("File to write: .png, .gif, or .mp4 with the program ffmpeg. Default: view.png.")
    ] = None,
    field: Annotated[
        str, option("sed, displacement, pressure, shear, slip, or another variable of RESULT.")
    ] = "sed",
    time: Annotated[
        float | None, number_option("Time of a picture. Default: that of the largest depth. [ms]")
    ] = None,
    frames: Annotated[int, integer_option("Number of pictures of a film.")] = 40,
) -> None:
    """Draw finger, object, field and afferents of a touch in three dimensions, as a picture or a film."""
    from fingerpad.export.view import save_view

    path = Path("view.png") if out is None else out
    if path.is_dir():
        raise InputError("--out", "must be a file", remedy=f"{path} is a folder")
    with interruptible("Nothing was written."):
        (written,) = save_view(path, result, field=field, time_ms=time, frames=frames, progress=progress())
    typer.echo(f"Open: {written}")
