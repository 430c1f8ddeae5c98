"""`fingerpad validate`: the model scored against observations of your own."""

from __future__ import annotations

from pathlib import Path
from typing import Annotated

import typer

from fingerpad.cli.options import (
    DEFAULT_TISSUES,
    KIND_CHOICES,
    LOADING_CHOICES,
    Jobs,
    Resolution,
    Scheduler,
    Tissues,
    option,
)
from fingerpad.cli.running import (
    command_line,
    engine,
    interruptible,
    make_writable,
    progress,
    tell,
    write_examples,
)
from fingerpad.core.errors import InputError

INCOMPLETE = 3  # Exit status if some rows have no prediction; all others are scored.


def validate_command(
    observations: Annotated[
        Path | None, typer.Argument(help="CSV file (format: docs/validate.md). Not needed with --example.")
    ] = None,
    out: Annotated[Path, option("Folder for page, figure, results and stored indentations.")] = Path(
        "validate"
    ),
    resolution: Resolution = "standard",
    tissues: Tissues = DEFAULT_TISSUES,
    afferent: Annotated[
        Path | None,
        option(
            "fit.json of a fit, or results.json of a reproduction: the afferent whose rates are "
            "predicted. Default: that of the tissues."
        ),
    ] = None,
    loading: Annotated[
        str,
        option(
            f"How a depth of force or deflection is reached, one of {', '.join(LOADING_CHOICES)}: "
            "read at the end of the paper's ramp and hold, or with relaxed tissues."
        ),
    ] = LOADING_CHOICES[0],
    static_window: Annotated[tuple[float, float], option("Window of the rates: start and end. [ms]")] = (
        600.0,
        950.0,
    ),
    jobs: Jobs = None,
    scheduler: Scheduler = None,
    example: Annotated[
        str | None, option(f"Write an example file, one of {', '.join(KIND_CHOICES)}, into --out, and exit.")
    ] = None,
) -> None:
    """Score the model against your own observations of force, deflection or firing rates."""
    from fingerpad.experiments import schemas
    from fingerpad.experiments.afferent_files import fitted_afferent
    from fingerpad.experiments.conditions import Conditions
    from fingerpad.experiments.manifest import sha256
    from fingerpad.experiments.validation.observations import example_file, read_observations
    from fingerpad.experiments.validation.predictions import FingertipModel
    from fingerpad.experiments.validation.validation import ValidationRequest, validate
    from fingerpad.neuron.afferent import Afferent
    from fingerpad.report.validation import validation_summary, write_validation_page

    if example is not None:
        write_examples(out, {f"{example}.csv": example_file(example).encode()})
        typer.echo(f"Try: fingerpad validate {out / example}.csv --resolution quick --out {out / example}")
        return
    if observations is None:
        raise InputError("validate", "needs a file of observations, or --example KIND", remedy="see --help")
    fitted = None if afferent is None else fitted_afferent(afferent, tissues)
    if not isinstance(fitted, Afferent | None):
        raise InputError("--afferent", "must hold an SAI afferent", remedy=f"{afferent} holds another type")
    model = FingertipModel(Conditions(resolution=resolution, tissues=tissues), fitted, loading, static_window)
    request = ValidationRequest(read_observations(observations), model, out, engine(jobs, scheduler))
    make_writable(out)
    inputs = [observations, *([] if afferent is None else [afferent])]
    with interruptible():
        results = validate(
            request, progress(), command=command_line(), inputs={str(path): sha256(path) for path in inputs}
        )
        page = write_validation_page(results, out)
        schemas.write(out / "validate.json", results)
    tell(validation_summary(results), page, out / "validate.json")
    if results.n_predicted < results.n_rows:
        raise typer.Exit(INCOMPLETE)
