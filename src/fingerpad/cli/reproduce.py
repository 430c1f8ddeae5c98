"""`fingerpad reproduce`: the experiments of the paper, compared with its numbers."""

from __future__ import annotations

from pathlib import Path
from typing import Annotated

import typer

from fingerpad.cli.options import Jobs, Resolution, Scheduler, Seed, option
from fingerpad.cli.running import engine, interruptible, make_writable, progress
from fingerpad.core.progress import NoProgress

EXPECTED_TIME = {"quick": "two minutes", "standard": "less than 10 minutes", "paper": "some hours"}
"""Time on two cores if no indentation is stored yet."""


def reproduce_command(
    resolution: Resolution = "standard",
    out: Annotated[
        Path, option("Folder for the report, the figures, the results and the stored indentations.")
    ] = Path("reproduction"),
    jobs: Jobs = None,
    scheduler: Scheduler = None,
    seed: Seed = 0,
    tissues: Annotated[
        str,
        option(
            "Tissues of the first column. paper: Trial 3 with a Poisson's ratio of 0.40, our reading; "
            "trial3: Trial 3 to the letter, 0.48; or any other named set but human."
        ),
    ] = "paper",
    extended: Annotated[
        bool | None,
        typer.Option(
            "--extended/--no-extended",
            help="Also run what goes beyond the paper: uncertainty of the fit, curvature thresholds. "
            "Default: yes, except at quick resolution.",
        ),
    ] = None,
) -> None:
    """Reproduce Gerling et al. (2014): the paper's own system, then the set human, beside the paper."""
    from fingerpad.experiments.gerling2014 import Reproduction, reproduce
    from fingerpad.experiments.schemas import write
    from fingerpad.report.reproduction import count_sentence, write_report

    run = Reproduction(out, resolution, seed, tissues, jobs=engine(jobs, scheduler), extended=extended)
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
    typer.echo(f"Report: {report}")
    typer.echo(f"Results: {out / 'results.json'}")
    for name in ("paper", "human"):
        typer.echo(count_sentence(results.statements, name))
