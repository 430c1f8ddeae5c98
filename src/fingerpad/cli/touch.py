"""`fingerpad init`, `check` and `touch`: one touch, described in a file."""

from __future__ import annotations

from pathlib import Path
from typing import Annotated

import typer

from fingerpad.cli.options import option
from fingerpad.cli.running import command_line, interruptible, make_writable, progress

Description = Annotated[
    Path, typer.Argument(metavar="TOUCH", help="YAML file of a touch (format: docs/touch.md).")
]


def init_command(
    file: Annotated[Path, typer.Argument(help="Name of the file; it must not exist.")] = Path("touch.yaml"),
) -> None:
    """Write a commented example of a touch, and the schema from which editors complete its keys."""
    from fingerpad.experiments.descriptions.example import write_example

    make_writable(file.parent, "FILE")
    typer.echo(f"Try: fingerpad check {write_example(file)}")


def check_command(touch: Description) -> None:
    """Check a touch without pressing: nodes, steps, and the time and memory that a press will take."""
    from fingerpad.experiments.descriptions.estimate import estimate_press
    from fingerpad.experiments.descriptions.touch import read_touch_description
    from fingerpad.export.touch_outputs import check_described

    described = read_touch_description(touch)
    check_described(described)
    for line in estimate_press(described).lines:
        typer.echo(line)


def touch_command(
    touch: Description,
    out: Annotated[Path, option("Folder for the outputs, the results and the stored indentation.")] = Path(
        "touch"
    ),
) -> None:
    """Press a touch that a file describes, and write figures, tables and files for other programs."""
    from fingerpad.experiments.descriptions.touch import read_touch_description
    from fingerpad.export.touch_outputs import RESULT, check_described, run_touch
    from fingerpad.report.skin import PAGE, touch_summary

    described = read_touch_description(touch)
    check_described(described)
    make_writable(out)
    with interruptible("Nothing of this touch was kept: the same command presses it again."):
        pressed = run_touch(described, out, progress(), command_line())
    for paragraph in touch_summary(pressed.result):
        typer.echo(paragraph)
    for caveat in pressed.skin.caveats:
        typer.echo(f"Not verified: {caveat.text}")
    if (out / PAGE).exists():
        typer.echo(f"Report: {out / PAGE}")
    typer.echo(f"Results: {out / RESULT}")
