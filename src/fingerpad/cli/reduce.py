"""`fingerpad reduce`: a touch that is evaluated in real time."""

from __future__ import annotations

from pathlib import Path
from typing import Annotated

import typer

from fingerpad.cli.options import Jobs, Scheduler, option
from fingerpad.cli.running import engine, interruptible, make_writable, progress
from fingerpad.core.errors import InputError


def reduce_command(
    config: Annotated[
        Path, typer.Argument(metavar="CONFIG", help="YAML file of a range (format: docs/reduced.md).")
    ],
    out: Annotated[Path, option("File of the reduced touch; presses are stored beside it.")] = Path(
        "reduced.npz"
    ),
    jobs: Jobs = None,
    scheduler: Scheduler = None,
) -> None:
    """Press a range of poses in full, and write a reduced touch that answers within a millisecond."""
    from fingerpad.experiments.descriptions.reduction import read_reduction, run_reduction
    from fingerpad.experiments.runner import Runner
    from fingerpad.reduction.model import write_reduced

    if out.suffix != ".npz":
        raise InputError("--out", "must be a file .npz", str(out))
    described = read_reduction(config)
    make_writable(out.parent)
    with interruptible():
        runner = Runner(out.with_suffix(""), engine(jobs, scheduler), progress())
        model = run_reduction(described, runner)
        write_reduced(model, out)
    varied = ", ".join(f"{axis.name} {axis.low:g} to {axis.high:g}" for axis in model.axes if axis.count > 1)
    typer.echo(
        f"{len(model.first_touch_mm)} poses, {varied or 'one place'}, up to {model.depth_mm:g} mm deep: "
        f"{len(model.modes)} modes, {out.stat().st_size / 1e6:.1f} MB."
    )
    if described.description.calibration:
        errors = zip((*model.quantities, "force"), model.error.tolist(), strict=True)
        typer.echo(
            "95 % of new touches stay within "
            + ", ".join(f"{error:.1%} of the largest {name.replace('_', ' ')}" for name, error in errors)
            + "."
        )
    typer.echo(f"Reduced touch: {out}")
