"""`fingerpad reproduce`: the experiments of the paper, compared with its numbers."""

from __future__ import annotations

from pathlib import Path
from typing import Annotated

import typer

from fingerpad.cli.choices import DEFAULT_TISSUES
from fingerpad.cli.options import Jobs, Materials, Resolution, Scheduler, Seed
from fingerpad.cli.running import engine, interruptible, make_writable, progress
from fingerpad.core.progress import NoProgress

EXPECTED_TIME = {"quick": "a minute and a half", "standard": "about 6 minutes", "paper": "some hours"}
"""Time on two cores if no indentation is stored yet."""


def reproduce_command(
    resolution: Resolution = "standard",
    out: Annotated[
        Path,
        typer.Option(help="Folder for the report, the figures, the results and the stored indentations."),
    ] = Path("reproduction"),
    jobs: Jobs = None,
    scheduler: Scheduler = None,
    seed: Seed = 0,
    materials: Materials = DEFAULT_TISSUES,
    extended: Annotated[
        bool | None,
        typer.Option(
            "--extended/--no-extended",
            help="Also run what goes beyond the paper: uncertainty of the fit, curvature thresholds. "
            "Default: yes, except at quick resolution.",
        ),
    ] = None,
) -> None:
    """Reproduce Gerling et al. (2014) and compare every result with the paper."""
    from fingerpad.experiments.conditions import Conditions
    from fingerpad.experiments.gerling2014 import Reproduction, reproduce
    from fingerpad.experiments.gerling2014.claim_row import Verdict
    from fingerpad.experiments.schemas import write
    from fingerpad.report.comparison import verdict_sentence
    from fingerpad.report.reproduction import write_report

    conditions = Conditions(resolution=resolution, seed=seed, materials=materials)
    run = Reproduction(conditions, out, engine(jobs, scheduler), extended)
    make_writable(out)
    shown = progress()
    if not isinstance(shown, NoProgress):
        by = f"{run.jobs} process(es)" if scheduler is None else f"the workers of {scheduler}"
        typer.echo(
            f"Reproducing at {resolution} resolution with {by}: "
            f"{EXPECTED_TIME[resolution]} on two cores. "
            "You can stop at any time: the same command continues after the last finished indentation.",
            err=True,
        )
    with interruptible():
        results = reproduce(run, shown)
        report = write_report(results, out)
        write(out / "results.json", results)
    missed = [row.quantity for row in results.comparison if row.verdict is Verdict.MISSED]
    typer.echo(f"Report: {report}")
    typer.echo(f"Results: {out / 'results.json'}")
    typer.echo(verdict_sentence(results.comparison))
    typer.echo(f"Missed: {'; '.join(missed) if missed else 'nothing'}")
