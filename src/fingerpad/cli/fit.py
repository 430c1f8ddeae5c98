"""`fingerpad fit`: an afferent fitted to recordings."""

from __future__ import annotations

from pathlib import Path
from typing import TYPE_CHECKING, Annotated

import typer

from fingerpad.cli.options import (
    DEFAULT_TISSUES,
    FINGER_CHOICES,
    METHOD_CHOICES,
    QUANTITY_CHOICES,
    RESOLUTION_CHOICES,
    TISSUES_CHOICES,
    Jobs,
    Scheduler,
    Seed,
    integer_option,
    number_option,
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

if TYPE_CHECKING:
    from fingerpad.experiments.stimuli import Stimuli

STANDARD, BAR = "standard", "bar"  # Default resolution; the stimulus that is no file, the paper's bar.


def fit_command(
    recordings: Annotated[
        Path | None, typer.Argument(help="CSV or NWB file (format: docs/fit.md). Not needed with --example.")
    ] = None,
    stimulus: Annotated[
        str | None, option("bar (shifted along the finger), or a CSV or YAML file with the stimuli.")
    ] = None,
    stimulus_column: Annotated[
        str | None, option("Column with the name of the stimulus. Default: shift_mm or stimulus.")
    ] = None,
    unit: Annotated[int | None, integer_option("Id of the spike unit of an NWB file.")] = None,
    width: Annotated[float | None, number_option("Width of the bar. Default: 3. [mm]")] = None,
    fillet: Annotated[
        float | None, number_option("Radius of the edges of the bar. Default: 0.3. [mm]")
    ] = None,
    depth: Annotated[float | None, number_option("Depth of the hold. Default: 1. [mm]")] = None,
    dynamic_window: Annotated[
        tuple[float, float] | None,
        option(
            "Window of the dynamic rate: start and end. Default: the last 40 % of the ramp (30 50 in "
            "the paper). [ms]"
        ),
    ] = None,
    static_window: Annotated[
        tuple[float, float] | None,
        option(
            "Window of the static rate: start and end. Default: 550 to 900 ms from the start of the "
            "hold, or 58 to 95 % of a shorter one (600 950 in the paper). [ms]"
        ),
    ] = None,
    dynamic_quantity: Annotated[
        str | None,
        option(
            f"Quantity whose rate drives the dynamic term: {QUANTITY_CHOICES[0]} (the paper's SED), or, "
            f"as an extension, {', '.join(QUANTITY_CHOICES[1:])}. Default: compressive_stress with the "
            "tissues human, stored with all others."
        ),
    ] = None,
    static_quantity: Annotated[
        str | None, option("Quantity that drives the static term; choices and default as above.")
    ] = None,
    method: Annotated[str, option(f"One of {', '.join(METHOD_CHOICES)}.")] = "least_squares",
    posterior: Annotated[
        bool, option("Also sample the posterior: credible intervals of parameters and rates.", "--posterior")
    ] = False,
    profiles: Annotated[
        bool, option("Also compute the profile likelihood of each parameter.", "--profiles")
    ] = False,
    sensitivity: Annotated[bool, option("Also compute Sobol indices of the score.", "--sensitivity")] = False,
    offset: Annotated[
        bool, option("Also fit the position of the receptor along the finger.", "--offset")
    ] = False,
    afferent: Annotated[
        str | None, option("Type of the afferent for --free: SAI, RA, PC or SAII. Default: SAI.")
    ] = None,
    free: Annotated[
        str,
        option(
            "Fit these numbers of the type alone, separated by commas, as in --afferent RA "
            "--free threshold. Default: the four that spikes of an SAI determine."
        ),
    ] = "",
    folds: Annotated[
        int | None,
        integer_option("Number of interleaved folds. Default: 6, or the column fold of the recordings."),
    ] = None,
    out: Annotated[
        Path, option("Folder for the report, the figures, the results and the stored indentations.")
    ] = Path("fit"),
    resolution: Annotated[
        str | None, option(f"One of {', '.join(RESOLUTION_CHOICES)}. Default: that of the stimuli, standard.")
    ] = None,
    tissues: Annotated[
        str | None,
        option(f"One of {', '.join(TISSUES_CHOICES)}. Default: tissues of the stimuli, {DEFAULT_TISSUES}."),
    ] = None,
    finger: Annotated[
        str | None,
        option(
            f"One of {', '.join(FINGER_CHOICES)}, with measures as in adult:width_mm=18. Default: "
            "that of the stimuli, adult."
        ),
    ] = None,
    jobs: Jobs = None,
    scheduler: Scheduler = None,
    seed: Seed = 0,
    example: Annotated[Path | None, option("Write example recordings into this folder, and exit.")] = None,
) -> None:
    """Fit an afferent to your own recordings: firing rates or spike times under known stimuli."""
    from fingerpad.core.values import one_of
    from fingerpad.experiments import schemas
    from fingerpad.experiments.descriptions.pressing import finger_of, named_files
    from fingerpad.experiments.descriptions.reading import at
    from fingerpad.experiments.fit.session import (
        EXAMPLE,
        FitRequest,
        example_recordings,
        fit_chosen_numbers,
        run_fit,
    )
    from fingerpad.experiments.manifest import sha256
    from fingerpad.experiments.recording_files import read_recordings
    from fingerpad.experiments.runner import Runner
    from fingerpad.report.fit import fit_summary, write_fit_page

    if example is not None:
        write_examples(example, example_recordings(), "--example")
        options = f"--stimulus bar --resolution quick --out {example / 'fit'}"
        typer.echo(f"Try: fingerpad fit {example / EXAMPLE} {options}")
        return
    if recordings is None:
        raise InputError(
            "fit", "needs recordings and --stimulus, or --example FOLDER", remedy="see fingerpad fit --help"
        )
    if stimulus is None:
        raise InputError(
            f"--stimulus is missing: write --stimulus {BAR}, or name the file of the stimuli of {recordings}."
        )
    sizes = {"width": width, "fillet": fillet, "depth": depth}
    one_of("resolution", resolution or STANDARD, RESOLUTION_CHOICES)
    one_of("tissues", tissues or DEFAULT_TISSUES, TISSUES_CHOICES)
    if finger is not None:
        with at("--finger"):
            finger_of(finger)
        finger = next((str(path.absolute()) for path in named_files(finger)), finger)
    pressed_into = {"resolution": resolution, "tissues": tissues, "finger": finger}
    stimuli = _stimuli(stimulus, stimulus_column, sizes, pressed_into)
    request = FitRequest(
        read_recordings(recordings, stimuli, unit),
        stimuli,
        out,
        method,
        folds,
        (dynamic_window, static_window),
        engine(jobs, scheduler),
        seed,
        dynamic_quantity,
        static_quantity,
        with_posterior=posterior,
        with_profiles=profiles,
        with_sensitivity=sensitivity,
        with_offset=offset,
        afferent_type=afferent,
        free=tuple(name.strip() for name in free.split(",") if name.strip()),
    )
    make_writable(out)
    named = [file for each in request.recorded.stimuli.values() for file in each.files]
    inputs = [recordings, *([] if stimulus == BAR else [Path(stimulus)]), *stimuli.finger_files, *named]
    command = command_line()
    hashes = {str(path): sha256(path) for path in inputs}
    with interruptible():
        if request.free:
            chosen = fit_chosen_numbers(request, Runner(out, request.jobs, progress()), command, hashes)
            schemas.write(out / "fit.json", chosen)
            typer.echo("\n".join([*chosen.summary(), f"Results: {out / 'fit.json'}"]))
            return
        results = run_fit(request, progress(), command, hashes)
        page = write_fit_page(results, out)
        schemas.write(out / "fit.json", results)
    tell(fit_summary(results.fit), page, out / "fit.json")


def _stimuli(
    stimulus: str, column: str | None, given: dict[str, float | None], pressed_into: dict[str, str | None]
) -> Stimuli:
    """Make the stimuli that `--stimulus` names, with the given sizes where it is the bar."""
    from dataclasses import replace

    from fingerpad.experiments.descriptions.pressing import named_files
    from fingerpad.experiments.descriptions.reading import part_from
    from fingerpad.experiments.descriptions.stimulus import FingerDescription
    from fingerpad.experiments.stimuli import ShiftedBar, read_stimuli
    from fingerpad.geometry.indenters import Bar
    from fingerpad.geometry.motion import RampAndHold

    sizes = {key: size for key, size in given.items() if size is not None}
    if stimulus != BAR:
        if sizes:
            raise InputError(
                f"--{next(iter(sizes))} is that of the bar, and {stimulus} lists stimuli with their own: "
                "leave it out."
            )
        listed = read_stimuli(Path(stimulus), **pressed_into)
        return listed if column is None else replace(listed, column=column)
    motion = RampAndHold(depth_mm=sizes.pop("depth")) if "depth" in sizes else RampAndHold()
    described = part_from(
        FingerDescription,
        {"resolution": STANDARD} | {key: value for key, value in pressed_into.items() if value},
    )
    bar = ShiftedBar(
        Bar(**{f"{key}_mm": size for key, size in sizes.items()}),
        motion,
        conditions=described.conditions(),
        finger_files=tuple(named_files(described.finger)),
    )
    return bar if column is None else replace(bar, column=column)
