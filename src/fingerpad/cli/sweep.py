"""`fingerpad sweep`: a touch of which some fields vary, over thousands of settings."""

from __future__ import annotations

from pathlib import Path
from typing import Annotated

import typer

from fingerpad.cli.options import Jobs, Scheduler, option
from fingerpad.cli.running import command_line, engine, interruptible, make_writable, progress

MOST_FAILED = 99  # Largest exit status for settings that failed: larger ones have other meanings.


def sweep_command(
    sweep: Annotated[
        Path, typer.Argument(metavar="SWEEP", help="YAML file of a sweep (format: docs/sweeps.md).")
    ],
    out: Annotated[Path, option("The data set, a folder that ends in .zarr.")] = Path("sweep.zarr"),
    jobs: Jobs = None,
    scheduler: Scheduler = None,
    store: Annotated[
        Path | None, option("Folder of stored indentations. Default: indentations, beside the data set.")
    ] = None,
    table: Annotated[Path | None, option("Also write rates as a table, a .csv or .parquet file.")] = None,
    spikes: Annotated[
        Path | None, option("Also write the spikes of all settings as a session, a .nwb file.")
    ] = None,
    retry_failed: Annotated[bool, option("Try settings again that failed before.", "--retry-failed")] = False,
    yes: Annotated[bool, option("Run a sweep of any size.", "--yes")] = False,
    dry: Annotated[bool, option("Print how long it will take, and press nothing.", "--dry-run")] = False,
) -> None:
    """Press a touch in all settings of a sweep, and write one labelled data set.

    The exit status is 0 if all settings are done, else 10 and one for each setting that failed, at most 99.
    """
    from fingerpad.core.engine import engine_of
    from fingerpad.experiments.sweep.description import read_sweep
    from fingerpad.experiments.sweep.estimate import estimate_sweep
    from fingerpad.export.sweep import check_sweep, run_sweep
    from fingerpad.export.sweep_results import (
        check_outputs,
        open_sweep,
        write_sweep_spikes,
        write_sweep_table,
    )

    described = read_sweep(sweep)
    check_sweep(described, out, yes)
    check_outputs(table, spikes)
    by = engine(jobs, scheduler)
    for line in estimate_sweep(described, engine_of(by).width).lines:
        typer.echo(line, err=not dry)
    if dry:
        return
    make_writable(out.parent)
    with interruptible():
        done = run_sweep(
            described, out, by, retry_failed=retry_failed, any_size=yes, store=store, progress=progress(),
            command=command_line(),
        )  # fmt: skip
    for line in done.lines:
        typer.echo(line)
    if done.done and table is not None:
        typer.echo(f"Table: {write_sweep_table(open_sweep(out), table)}")
    if done.done and spikes is not None:
        typer.echo(f"Spikes: {write_sweep_spikes(open_sweep(out), spikes)}")
    if done.failed:
        raise typer.Exit(min(10 + done.failed, MOST_FAILED))
