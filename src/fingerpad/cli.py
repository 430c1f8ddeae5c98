"""The command line: `reproduce`, `fit`, `discriminate`, `drives`, `refine`, `materials` and `export`."""

from __future__ import annotations

import json
import os
import shlex
import sys
import tempfile
from collections.abc import Callable, Iterator
from contextlib import contextmanager
from pathlib import Path
from typing import TYPE_CHECKING, Annotated, Any

import typer

from fingerpad import __version__
from fingerpad.errors import FingerpadError, InputError
from fingerpad.files import write_atomically

if TYPE_CHECKING:
    from rich.console import Console

    from fingerpad.estimation.stimuli import Stimuli

# What a command runs is imported where it runs: help and version need none of it and come at once.

EXPECTED_TIME = {"quick": "a minute and a half", "standard": "about 5 minutes", "paper": "some hours"}
"""On two cores, nothing stored yet."""

RESOLUTIONS = ("quick", "standard", "paper")
INDENTERS = {
    "sphere": "Sphere",
    "cylinder": "Cylinder",
    "bar": "Bar",
    "line": "Line",
    "punch": "FlatPunch",
    "plate": "Plate",
    "edge": "Edge",
    "gap": "Gap",
    "grating": "Grating",
}
MATERIALS = (
    "trial1",
    "trial2",
    "trial3",
    "trial2_wu",
    "trial3_wu",
    "trial3_stiffening",
    "maeno1998",
    "wu2007",
    "gerling2014_fit",
)
FORMATS = ("vtu", "abaqus", "calculix", "febio")
FITTING_METHODS = ("least_squares", "response_surface", "closed_form", "cma_es", "likelihood")
QUANTITIES = ("stored", "instantaneous", "work", "von_mises", "compressive_strain", "compressive_stress")
REFINEMENTS = {"fine": "mesh_refinement", "paper": "paper_size"}
"""What options may be, as the help names them; indenters with their class, finer meshes with
their study and report. The modules behind them decide."""

app = typer.Typer(
    help="From a touch on a finite-element human fingertip to the spikes of SAI afferents to a percept.",
    add_completion=False,
    pretty_exceptions_enable=False,
)

MISUSE: Any = typer.BadParameter.__base__
"""What typer raises for options that it does not know or cannot read; it names only this child of it."""

BAR = "bar"
"""What `--stimulus` calls the bar of the paper; anything else is a file."""

INTERRUPTED = 130
"""Exit status after Ctrl-C, by convention."""


def _show_version(wanted: bool) -> None:
    if wanted:
        typer.echo(f"fingerpad {__version__}")
        raise typer.Exit


def _whole_number(text: str) -> int:
    """Read an option, and repeat what came where it cannot be read."""
    try:
        return int(text)
    except ValueError as error:
        raise typer.BadParameter(f"must be a whole number: got {text!r}.") from error


def _number(text: str) -> float:
    """Read an option, and repeat what came where it cannot be read."""
    try:
        return float(text)
    except ValueError as error:
        raise typer.BadParameter(f"must be a number: got {text!r}.") from error


@app.callback(invoke_without_command=True)
def _options(
    context: typer.Context,
    version: Annotated[
        bool,
        typer.Option("--version", callback=_show_version, is_eager=True, help="Show the version and exit."),
    ] = False,
) -> None:
    if context.invoked_subcommand is None:
        typer.echo(context.get_help())
        raise typer.Exit(2)


@app.command("reproduce")
def reproduce_command(
    resolution: Annotated[str, typer.Option(help=f"One of {', '.join(RESOLUTIONS)}.")] = "standard",
    out: Annotated[
        Path, typer.Option(help="Folder for report, figures, results and stored indentations.")
    ] = Path("reproduction"),
    jobs: Annotated[
        int | None,
        typer.Option(parser=_whole_number, metavar="INTEGER", help="Processes; one per core by default."),
    ] = None,
    seed: Annotated[
        int, typer.Option(parser=_whole_number, metavar="INTEGER", help="Seed of the observer's noise.")
    ] = 0,
    extended: Annotated[
        bool | None,
        typer.Option(
            "--extended/--no-extended",
            help="Go beyond the paper: other fits and drives, spikes, uncertainty; not at quick by default.",
        ),
    ] = None,
) -> None:
    """Press, fire, fit and discriminate as in Gerling et al. 2014, and report beside the paper's numbers."""
    from rich.console import Console

    from fingerpad.report import write_report
    from fingerpad.studies import Reproduction, reproduce
    from fingerpad.studies.conditions import Conditions

    conditions = Conditions(resolution=resolution, seed=seed)
    run = Reproduction(conditions, out, jobs if jobs is not None else _cores(), extended)
    _make_writable(out)
    console = Console(stderr=True)
    if console.is_terminal:
        console.print(
            f"Reproducing at {resolution} resolution with {run.jobs} process(es): "
            f"{EXPECTED_TIME[resolution]} on two cores. "
            "Stop it at any time; it goes on from the last finished indentation."
        )
    with _interruptible():
        results = reproduce(run, _Bars(console))
        write_atomically(out / "results.json", json.dumps(results, indent=1, allow_nan=False).encode())
        report = write_report(results, out)
    missed = [row["quantity"] for row in results["comparison"] if row["met"] is False]
    typer.echo(f"Report: {report}")
    typer.echo(f"Results: {out / 'results.json'}")
    typer.echo(f"Missed: {'; '.join(missed) if missed else 'nothing'}")


@app.command("fit")
def fit_command(
    recordings: Annotated[
        Path | None, typer.Argument(help="CSV or NWB file, see docs/fit.md; not needed with --example.")
    ] = None,
    stimulus: Annotated[
        str | None,
        typer.Option(help="bar (shifted along the finger), or a CSV or YAML file that lists the stimuli."),
    ] = None,
    stimulus_column: Annotated[
        str | None, typer.Option(help="Column that names the stimulus; shift_mm or stimulus by default.")
    ] = None,
    unit: Annotated[
        int | None,
        typer.Option(parser=_whole_number, metavar="INTEGER", help="Id of the spike unit of an NWB file."),
    ] = None,
    width: Annotated[
        float | None, typer.Option(parser=_number, metavar="NUMBER", help="Width of the bar; 3 mm. [mm]")
    ] = None,
    fillet: Annotated[
        float | None,
        typer.Option(parser=_number, metavar="NUMBER", help="Radius of the bar's edges; 0.3 mm. [mm]"),
    ] = None,
    depth: Annotated[
        float | None, typer.Option(parser=_number, metavar="NUMBER", help="Depth of the bar; 1 mm. [mm]")
    ] = None,
    dynamic_window: Annotated[
        tuple[float, float], typer.Option(help="Start and end of the window of the dynamic rate. [ms]")
    ] = (30.0, 50.0),
    static_window: Annotated[
        tuple[float, float], typer.Option(help="Start and end of the window of the static rate. [ms]")
    ] = (600.0, 950.0),
    dynamic_quantity: Annotated[
        str,
        typer.Option(
            help=f"What the dynamic term follows: {QUANTITIES[0]} as in the paper, or as an extension "
            f"{', '.join(QUANTITIES[1:])}."
        ),
    ] = "stored",
    method: Annotated[str, typer.Option(help=f"One of {', '.join(FITTING_METHODS)}.")] = "least_squares",
    posterior: Annotated[
        bool, typer.Option("--posterior", help="Draw credible intervals of parameters and rates as well.")
    ] = False,
    profiles: Annotated[
        bool, typer.Option("--profiles", help="Profile the likelihood of each number as well.")
    ] = False,
    sensitivity: Annotated[
        bool, typer.Option("--sensitivity", help="Tell by Sobol's indices what the fit is sensitive to.")
    ] = False,
    offset: Annotated[
        bool, typer.Option("--offset", help="Fit the receptor's place along the finger as well.")
    ] = False,
    folds: Annotated[
        int | None,
        typer.Option(
            parser=_whole_number,
            metavar="INTEGER",
            help="Folds dealt out in turn; 6 by default, unless the recordings have a column fold.",
        ),
    ] = None,
    out: Annotated[
        Path, typer.Option(help="Folder for page, figures, results and stored indentations.")
    ] = Path("fit"),
    resolution: Annotated[str, typer.Option(help=f"One of {', '.join(RESOLUTIONS)}.")] = "standard",
    materials: Annotated[str, typer.Option(help=f"One of {', '.join(MATERIALS)}.")] = "trial3",
    jobs: Annotated[
        int | None,
        typer.Option(parser=_whole_number, metavar="INTEGER", help="Processes; one per core by default."),
    ] = None,
    seed: Annotated[
        int, typer.Option(parser=_whole_number, metavar="INTEGER", help="Seed of methods that draw.")
    ] = 0,
    example: Annotated[
        Path | None, typer.Option(help="Write recordings to try it with into this folder, and end.")
    ] = None,
) -> None:
    """Fit an afferent to recordings of your own: rates or spikes under known stimuli."""
    from rich.console import Console

    from fingerpad.estimation.reading import read_recordings
    from fingerpad.report.recording_fit import summary, write_fit_page
    from fingerpad.studies import recording_session
    from fingerpad.studies.conditions import Conditions

    if example is not None:
        _make_writable(example, "--example")
        for file, content in recording_session.example().items():
            write_atomically(example / file, content)
        typer.echo(
            f"Try: fingerpad fit {example / recording_session.EXAMPLE} --stimulus bar --resolution quick"
        )
        return
    if recordings is None or stimulus is None:
        raise InputError(
            "fit needs recordings and --stimulus, or --example FOLDER: see fingerpad fit --help."
        )
    sizes = {"width": width, "fillet": fillet, "depth": depth}
    stimuli = _stimuli(stimulus, stimulus_column, sizes)
    task = recording_session.RecordingFit(
        read_recordings(recordings, stimuli, unit),
        Conditions(resolution=resolution, seed=seed, materials=materials),
        out,
        method,
        folds,
        (dynamic_window, static_window),
        jobs if jobs is not None else _cores(),
        dynamic_quantity,
        with_posterior=posterior,
        with_profiles=profiles,
        with_sensitivity=sensitivity,
        with_offset=offset,
    )
    _make_writable(out)
    inputs = [recordings, *([] if stimulus == BAR else [Path(stimulus)])]
    with _interruptible():
        results = recording_session.run(
            task,
            _Bars(Console(stderr=True)),
            command=shlex.join(["fingerpad", *sys.argv[1:]]),
            inputs=[{"file": str(path), "sha256": recording_session.sha256(path)} for path in inputs],
        )
        write_atomically(out / "fit.json", json.dumps(results, indent=1, allow_nan=False).encode())
        page = write_fit_page(results, out)
    for paragraph in summary(results["fit"]):
        typer.echo(paragraph)
    typer.echo(f"Report: {page}")
    typer.echo(f"Results: {out / 'fit.json'}")


def _stimuli(stimulus: str, column: str | None, given: dict[str, float | None]) -> Stimuli:
    """Make what `--stimulus` names, with the sizes that are given where it is the bar."""
    from dataclasses import replace

    from fingerpad.estimation.stimuli import ShiftedBar, read_stimuli
    from fingerpad.indenters import Bar
    from fingerpad.stimulus import RampAndHold

    sizes = {key: size for key, size in given.items() if size is not None}
    if stimulus != BAR:
        if sizes:
            raise InputError(
                f"--{next(iter(sizes))} is that of the bar, and {stimulus} lists stimuli with their own: "
                "leave it out."
            )
        listed = read_stimuli(Path(stimulus))
        return listed if column is None else replace(listed, column=column)
    motion = RampAndHold(depth_mm=sizes.pop("depth")) if "depth" in sizes else RampAndHold()
    bar = ShiftedBar(Bar(**{f"{key}_mm": size for key, size in sizes.items()}), motion)
    return bar if column is None else replace(bar, column=column)


@app.command("discriminate")
def discriminate_command(
    question: Annotated[
        str | None,
        typer.Argument(
            metavar="QUESTION",
            help="YAML file, see docs/discriminate.md, or the name of a ready-made question.",
        ),
    ] = None,
    out: Annotated[
        Path, typer.Option(help="Folder for page, figures, results and stored indentations.")
    ] = Path("discriminate"),
    resolution: Annotated[
        str | None, typer.Option(help=f"Instead of the question's: {', '.join(RESOLUTIONS)}.")
    ] = None,
    jobs: Annotated[
        int | None,
        typer.Option(parser=_whole_number, metavar="INTEGER", help="Processes; one per core by default."),
    ] = None,
    ready_made: Annotated[
        bool, typer.Option("--list", help="Name the questions that come with the package, and end.")
    ] = False,
    example: Annotated[
        str | None, typer.Option(help="Print one of them, to make it your own, and end.")
    ] = None,
) -> None:
    """Ask what a person could tell apart: any stimuli, any population, any code."""
    from rich.console import Console

    from fingerpad.checks import one_of
    from fingerpad.report.discriminate import summary, write_discrimination_page
    from fingerpad.studies import discriminate, question_file

    known = question_file.ready_made()
    if ready_made:
        for name, text in known.items():
            typer.echo(f"{name}: {question_file.title(text)}")
        return
    if example is not None:
        typer.echo(known[one_of("--example", example, tuple(known))], nl=False)
        return
    if question is None:
        raise InputError(
            f"discriminate needs a question, a YAML file or one of {', '.join(known)}: see --help."
        )
    asked = question_file.read_question(question, resolution=resolution)
    task = discriminate.Discrimination(asked, out, jobs if jobs is not None else _cores(), question)
    _make_writable(out)
    with _interruptible():
        results = discriminate.run(
            task,
            _Bars(Console(stderr=True)),
            command=shlex.join(["fingerpad", *sys.argv[1:]]),
            inputs=question_file.provenance(question, asked),
        )
        write_atomically(out / "discriminate.json", json.dumps(results, indent=1, allow_nan=False).encode())
        page = write_discrimination_page(results, out)
    for paragraph in summary(results["discrimination"]):
        typer.echo(paragraph)
    typer.echo(f"Report: {page}")
    typer.echo(f"Results: {out / 'discriminate.json'}")


@app.command("drives")
def drives_command(
    resolution: Annotated[str, typer.Option(help=f"One of {', '.join(RESOLUTIONS)}.")] = "standard",
    out: Annotated[
        Path,
        typer.Option(help="Folder for page, figure, numbers and stored indentations, as of a reproduction."),
    ] = Path("reproduction"),
    jobs: Annotated[
        int | None,
        typer.Option(parser=_whole_number, metavar="INTEGER", help="Processes; one per core by default."),
    ] = None,
    seed: Annotated[
        int, typer.Option(parser=_whole_number, metavar="INTEGER", help="Seed of search and bootstrap.")
    ] = 0,
) -> None:
    """Compare what may drive the afferent: quantities in the skin, and explanations of the dynamic rates."""
    from rich.console import Console

    from fingerpad.report.drive_study import write_drive_page
    from fingerpad.studies.conditions import Conditions
    from fingerpad.studies.drive_study import DriveStudy, study_drives

    study = DriveStudy(
        Conditions(resolution=resolution, seed=seed), out, jobs if jobs is not None else _cores()
    )
    _make_writable(out)
    console = Console(stderr=True, quiet=not sys.stderr.isatty())
    with _interruptible():
        results = study_drives(study, lambda part: console.print(f"done: {part}"))
        numbers = out / "drive_quantities.json"
        write_atomically(numbers, json.dumps(results, indent=1, allow_nan=False).encode())
        page = write_drive_page(results, out, f"fingerpad drives --resolution {resolution}")
    typer.echo(f"Page: {page}")
    typer.echo(f"Results: {numbers}")


@app.command("refine")
def refine_command(
    against: Annotated[
        str,
        typer.Option(help="fine: smaller by 1.5 in every direction; paper: the paper's size of mesh."),
    ] = "fine",
    out: Annotated[
        Path, typer.Option(help="Folder for tables, figure, numbers and stored indentations.")
    ] = Path("refinement"),
    jobs: Annotated[
        int | None,
        typer.Option(parser=_whole_number, metavar="INTEGER", help="Processes; one per core by default."),
    ] = None,
) -> None:
    """Press bars and spheres into finer meshes, and report the error of the meshes of every resolution."""
    from importlib import import_module

    from rich.console import Console

    from fingerpad.checks import one_of, whole

    one_of("against", against, tuple(REFINEMENTS))
    study, report = (
        import_module(f"fingerpad.{part}.{REFINEMENTS[against]}") for part in ("studies", "report")
    )
    processes = whole("jobs", jobs if jobs is not None else _cores(), at_least=1)
    _make_writable(out)
    with _interruptible():
        results = study.run(out, processes, _Bars(Console(stderr=True)))
        for file, content in report.documents(results).items():
            write_atomically(out / file, content)
    typer.echo(f"Report: {out / report.PAGE}")


@app.command("materials")
def materials_command(
    resolution: Annotated[str, typer.Option(help=f"One of {', '.join(RESOLUTIONS)}.")] = "quick",
    out: Annotated[
        Path, typer.Option(help="Folder for page, figure, numbers and stored indentations.")
    ] = Path("materials"),
    jobs: Annotated[
        int | None,
        typer.Option(parser=_whole_number, metavar="INTEGER", help="Processes; one per core by default."),
    ] = None,
    seed: Annotated[
        int, typer.Option(parser=_whole_number, metavar="INTEGER", help="Seed of noise and search.")
    ] = 0,
    name: Annotated[
        list[str] | None, typer.Option(help="A set to compare; may be given several times; all by default.")
    ] = None,
    shifted_bars: Annotated[
        bool, typer.Option("--shifted-bars", help="Press the bar at all 36 shifts, not once.")
    ] = False,
) -> None:
    """Compare sets of tissues on deflection, firing and discrimination."""
    from rich.console import Console

    from fingerpad.report.material_sets import write_material_page
    from fingerpad.studies.conditions import Conditions
    from fingerpad.studies.material_sets import Effort
    from fingerpad.studies.material_study import MaterialStudy, study_materials

    study = MaterialStudy(
        Conditions(resolution=resolution, seed=seed),
        out,
        jobs if jobs is not None else _cores(),
        Effort(shifted_bars=shifted_bars),
        **({"names": tuple(name)} if name else {}),
    )
    _make_writable(out)
    console = Console(stderr=True, quiet=not sys.stderr.isatty())
    chosen = "".join(f' --name "{one}"' for one in name or ())
    command = f"fingerpad materials --resolution {resolution}{' --shifted-bars' * shifted_bars}{chosen}"
    with _interruptible():
        results = study_materials(study, lambda part: console.print(f"done: {part}"))
        numbers = out / "material_sets.json"
        write_atomically(numbers, json.dumps(results, indent=1, allow_nan=False).encode())
        page = write_material_page(results, out, command)
    typer.echo(f"Page: {page}")
    typer.echo(f"Results: {numbers}")


@app.command("export")
def export_command(
    folder: Annotated[Path, typer.Argument(help="Where to write; made if need be.")],
    indenter: Annotated[str, typer.Option(help=f"One of {', '.join(INDENTERS)}.")] = "sphere",
    curvature: Annotated[
        float | None,
        typer.Option(parser=_number, metavar="NUMBER", help="Curvature of the sphere; 287 by default. [1/m]"),
    ] = None,
    depth: Annotated[
        float, typer.Option(parser=_number, metavar="NUMBER", help="Depth of the hold. [mm]")
    ] = 1.0,
    materials: Annotated[str, typer.Option(help=f"One of {', '.join(MATERIALS)}.")] = "trial3",
    resolution: Annotated[str, typer.Option(help=f"One of {', '.join(RESOLUTIONS)}.")] = "quick",
    format_name: Annotated[str, typer.Option("--format", help=f"One of {', '.join(FORMATS)}.")] = "vtu",
    elastic_moduli: Annotated[
        str | None,
        typer.Option(help="For calculix, which cannot relax tissue: long_term or instantaneous."),
    ] = None,
) -> None:
    """Press one indenter into the finger and write the touch for another program, ParaView by default."""
    import fingerpad
    from fingerpad.checks import one_of
    from fingerpad.export.formats import export_touch
    from fingerpad.fingertip import Fingertip
    from fingerpad.indentation import touch_of
    from fingerpad.stimulus import RampAndHold

    one_of("indenter", indenter, tuple(INDENTERS))
    one_of("format", format_name, FORMATS)
    if curvature is not None and indenter != "sphere":
        raise InputError(f"--curvature is that of a sphere, and a {indenter} has none: leave it out.")
    shape = {} if curvature is None else {"curvature_per_m": curvature}
    body = getattr(fingerpad, INDENTERS[indenter])(**shape)
    touch = touch_of(Fingertip(), body, RampAndHold(depth_mm=depth), materials, resolution)
    _make_writable(folder, "FOLDER")
    try:
        files = export_touch(touch, folder, format_name, elastic_moduli)
    except KeyboardInterrupt as error:
        typer.echo("fingerpad: stopped; what was written is whole, the rest is not there.", err=True)
        raise typer.Exit(INTERRUPTED) from error
    typer.echo(f"Open: {files[0]}")


@contextmanager
def _interruptible() -> Iterator[None]:
    try:
        yield
    except KeyboardInterrupt as error:
        typer.echo(
            "fingerpad: stopped; the same command goes on from the last finished indentation.", err=True
        )
        raise typer.Exit(INTERRUPTED) from error


def _cores() -> int:
    return len(os.sched_getaffinity(0)) if hasattr(os, "sched_getaffinity") else os.cpu_count() or 1


def _make_writable(folder: Path, name: str = "--out") -> None:
    """Make `folder` if need be, and see whether a file can be written into it."""
    try:
        folder.mkdir(parents=True, exist_ok=True)
        with tempfile.TemporaryFile(dir=folder):
            pass
    except OSError as error:
        raise InputError(
            f"{name} must be a folder that can be written: {folder} cannot ({error.strerror})."
        ) from error


class _Bars:
    """A bar per stage on a terminal, silence elsewhere."""

    def __init__(self, console: Console):
        self._console = console

    @contextmanager
    def stage(self, name: str, total: int) -> Iterator[Callable[[], None]]:
        """Show one stage with its expected time."""
        from rich.progress import (
            BarColumn,
            MofNCompleteColumn,
            Progress,
            TextColumn,
            TimeElapsedColumn,
            TimeRemainingColumn,
        )

        bars = Progress(
            TextColumn(f"{name:<24}"), BarColumn(), MofNCompleteColumn(), TimeElapsedColumn(),
            TextColumn("left"), TimeRemainingColumn(),
            console=self._console, disable=not self._console.is_terminal,
        )  # fmt: skip
        with bars:
            task = bars.add_task(name, total=total)
            yield lambda: bars.advance(task)


def main() -> None:
    """Run the command line; a failure is one sentence on standard error and exit status 2."""
    try:
        sys.exit(app(standalone_mode=False))
    except FingerpadError as error:
        print(f"fingerpad: {error}", file=sys.stderr)
        sys.exit(2)
    except MISUSE as error:
        print(f"fingerpad: {error.format_message().rstrip('.')}.", file=sys.stderr)
        sys.exit(2)
