"""What a user asks for, one function each: a request goes in, a result comes out, and files are written.

A request is a YAML file, a mapping with the same keys, or keywords; `fingerpad touch` and the other commands
take the same keys as options. Keywords replace what the file says; one within a block is written as a block
or, in a mapping `**{"motion.depth_mm": 0.5}`, with its place.
"""

from __future__ import annotations

from collections.abc import Callable
from pathlib import Path
from tempfile import TemporaryDirectory
from typing import Any, Protocol, TypeVar

from fingerpad.core.checked import checked
from fingerpad.core.engine import Engine, engine_of
from fingerpad.core.errors import InputError
from fingerpad.core.files import make_writable
from fingerpad.core.progress import Progress
from fingerpad.core.signals import ResponseMap
from fingerpad.core.values import Flag, Whole
from fingerpad.experiments import schemas
from fingerpad.experiments.discrimination.analysis import DiscriminationFile
from fingerpad.experiments.discrimination.request import DiscriminationRequest
from fingerpad.experiments.fit.request import ChosenNumbersFile, FitFile, FitRequest
from fingerpad.experiments.gerling2014.reproduction import ReproductionResult
from fingerpad.experiments.requests.parts import Request, at
from fingerpad.experiments.requests.touch import ReductionRequest, RespondRequest, TouchRequest, TouchResult
from fingerpad.experiments.run import ReproductionRequest, run
from fingerpad.experiments.runner import Runner
from fingerpad.experiments.scan import ScanRequest, ScanResult
from fingerpad.experiments.validation.validation import ValidationFile, ValidationRequest
from fingerpad.export.decks import DECKS, RESULTS, write_deck
from fingerpad.export.job import job_of
from fingerpad.export.results import require
from fingerpad.reduction.model import ReducedModel, write_reduced
from fingerpad.report.results import write_page

Kind = TypeVar("Kind")
Found = TypeVar("Found", covariant=True)


class Asked(Protocol[Found]):
    """A function that takes a request, or its keywords, and returns a result."""

    def __call__(
        self,
        request: Any = None,
        *,
        out: str | Path | None = None,
        jobs: Whole | Engine = 1,
        progress: Progress | None = None,
        command: str | None = None,
        allow_python: Flag = False,
        **given: Any,
    ) -> Found:
        """Run the request, and write the result into `out`."""


def runs(
    kind: type[Request], check: Callable[[Any], None] | None = None, folder_of: Callable[[Path], Path] = Path
) -> Callable[[Callable[[Kind, Path], None]], Asked[Kind]]:
    """Make a function that writes a result one that takes a request, runs it, and writes if asked to.

    `check` raises if the request is impossible; `folder_of` tells from `out` where presses are stored.
    """

    def runner_of(write: Callable[[Kind, Path], None]) -> Asked[Kind]:
        def ask(
            request: Any = None,
            *,
            out: str | Path | None = None,
            jobs: Whole | Engine = 1,
            progress: Progress | None = None,
            command: str | None = None,
            allow_python: Flag = False,
            **given: Any,
        ) -> Any:
            asked = kind.read(request, given, allow_python)
            engine_of(jobs)
            (check or kind.check)(asked)
            if out is None:
                with TemporaryDirectory() as folder:
                    return run(asked, Runner(Path(folder), jobs, progress, command))
            stored = make_writable(folder_of(Path(out)))
            found: Kind = run(asked, Runner(stored, jobs, progress, command))
            write(found, Path(out))
            return found

        ask.__name__ = ask.__qualname__ = write.__name__
        ask.__doc__, ask.__annotations__["return"] = write.__doc__, write.__annotations__["found"]
        return checked(ask)

    return runner_of


def check_outputs(asked: TouchRequest) -> None:
    """Raise `InputError` if the touch is impossible, or an output lacks a package or cannot express it."""
    asked.check()
    for number, name in enumerate(asked.outputs):
        with asked.origin.located(), at("outputs", number):
            require(name)
            if name in DECKS and not asked.touch.stimulus.stays:
                raise InputError(
                    f"{name} decks move the indenter only along its axis, and this motion moves it aside or "
                    f"turns it: leave {name} out."
                )


def _write_output(found: TouchResult, name: str, folder: Path) -> None:
    skin, asked = found.skin, found.request
    if name == "figures":
        write_page("touch", found, folder)
    elif name == "spikes":
        found.response.save(folder / "spikes.csv")
    elif name == "nwb":
        found.response.to_nwb(folder / "touch.nwb")
    elif name in DECKS:
        # The depths of a press by force are known only now.
        job = job_of(asked.touch, skin.times_ms, skin.depth_mm)
        write_deck(folder / name, job, name, asked.elastic_moduli if name == "calculix" else None)
    else:
        of_response = {"response": found.response, "seed": asked.afferents.seed}
        skin.save(folder / RESULTS[name], **(of_response if name in ("netcdf", "zarr") else {}))


@runs(TouchRequest, check_outputs)
def touch(found: TouchResult, folder: Path) -> None:
    """Press an object into a finger, and let afferents respond.

    Parameters
    ----------
    request : str, Path, mapping or TouchRequest, optional
        A YAML file (docs/touch.md), or its content; by default keywords alone.
    out : str or Path, optional
        Folder for the outputs that the request names, a page `touch.html`, the numbers in `touch.json` and
        the stored indentation: the same touch is not pressed twice. Without it nothing is written.
    jobs : int or Engine, optional
        Processes, or an engine such as `Cluster`.
    progress : Progress, optional
        Shown each finished part.
    command : str, optional
        The command line, for the manifest.
    allow_python : bool, optional
        Whether the file may name objects of Python as module:object, from a module beside it.
    **given
        Keys of the request: names and blocks as in a file, or objects of Python.

    Returns
    -------
    TouchResult
        The responses of skin and afferents: `skin`, `response`, `summary`.

    Raises
    ------
    ConvergenceError
        If the mechanics cannot be solved; finished indentations stay stored.
    StoreError
        If the folder cannot be written.

    Examples
    --------
    >>> import fingerpad as fp
    >>> found = fp.touch(object=fp.Sphere(radius_mm=4), motion={"depth_mm": 0.3}, afferents="RA")
    >>> found.summary.largest_depth_mm, found.response.rate_measure
    (0.3, 'count')
    """
    for name in found.request.outputs:
        _write_output(found, name, folder)
    schemas.write(folder / "touch.json", found.result)


@runs(RespondRequest)
def respond(found: ResponseMap, folder: Path) -> None:
    """Let afferents respond to a touch.

    Parameters
    ----------
    request : str, Path, mapping, RespondRequest, SkinResponse or TouchResult, optional
        A YAML file with the keys of the block `afferents` of a touch and `touch`, or its content; or the
        solved touch.
    out : str or Path, optional
        Folder for `spikes.csv` and the stored indentation; without it nothing is written or stored.
    jobs, progress, command, allow_python, given
        As of `touch`.

    Examples
    --------
    >>> import fingerpad as fp
    >>> skin = fp.indent(fp.Fingertip(), fp.Sphere(radius_mm=4), fp.RampAndHold(depth_mm=0.3))
    >>> fp.respond(skin, afferent="PC", rows=1, columns=2).rate_measure
    'count'
    """
    found.save(folder / "spikes.csv")


@runs(ScanRequest)
def scan(found: ScanResult, folder: Path) -> None:
    """Move an object over the finger at a constant force, in one line or many, and let afferents respond.

    Parameters
    ----------
    request : str, Path, mapping or ScanRequest, optional
        A YAML file with the keys of `ScanRequest` (docs/scan.md), or its content.
    out : str or Path, optional
        Folder for the page `scan.html`, the spikes by their place on the object in `events.csv`, the numbers
        in `scan.json` and the stored lines; without it nothing is written or stored.
    jobs, progress, command, allow_python, given
        As of `touch`.

    Returns
    -------
    ScanResult
        Skin and responses of each line; `image("SAI")` is the tactile image of a type.

    Examples
    --------
    >>> import fingerpad as fp
    >>> found = fp.scan(object="sphere:radius_mm=3", x_mm=0.5, force_mn=60, afferents="RA")
    >>> found.image("RA").pixel_mm, list(found.summary.types)
    (0.25, ['RA'])
    """
    write_page("scan", found, folder)
    found.save(folder / "events.csv")
    schemas.write(folder / "scan.json", found.result)


@runs(FitRequest)
def fit(found: FitFile | ChosenNumbersFile, folder: Path) -> None:
    """Fit an afferent to recordings: firing rates or spike times under known stimuli.

    Parameters
    ----------
    request : str, Path, mapping or FitRequest, optional
        A YAML file with the keys of `FitRequest` (docs/fit.md), its content, or the recordings.
    out : str or Path, optional
        Folder for the page `fit.html`, the numbers in `fit.json` and the stored indentations; without it
        nothing is written or stored.
    jobs, progress, command, allow_python, given
        As of `touch`.

    Returns
    -------
    FitFile or ChosenNumbersFile
        The fit of the four numbers of an SAI, in `fit`; or that of the numbers which `free` names.
    """
    if isinstance(found, FitFile):
        write_page("fit", found, folder)
    schemas.write(folder / "fit.json", found)


@runs(DiscriminationRequest)
def discriminate(found: DiscriminationFile, folder: Path) -> None:
    """Predict hit rates, psychometric curves and thresholds of a discrimination task.

    Parameters
    ----------
    request : str, Path, mapping or DiscriminationRequest, optional
        A YAML file (docs/discriminate.md), its content, or the name of an example task.
    out : str or Path, optional
        Folder for the page `discriminate.html`, the numbers in `discriminate.json` and the stored
        indentations; without it nothing is written or stored.
    jobs, progress, command, allow_python, given
        As of `touch`.

    Returns
    -------
    DiscriminationFile
        The result, in `discrimination`, with what was asked.
    """
    write_page("discriminate", found, folder)
    schemas.write(folder / "discriminate.json", found)


@runs(ValidationRequest)
def validate(found: ValidationFile, folder: Path) -> None:
    """Score the model against observations of force, deflection or firing rates.

    Parameters
    ----------
    request : str, Path, mapping or ValidationRequest, optional
        A YAML file with the keys of `ValidationRequest` (docs/validate.md), its content, or the observations.
    out : str or Path, optional
        Folder for the page `validate.html`, the numbers in `validate.json` and the stored indentations;
        without it nothing is written or stored.
    jobs, progress, command, allow_python, given
        As of `touch`.

    Returns
    -------
    ValidationFile
        Rows whose touch cannot be solved have a reason instead of a prediction.
    """
    write_page("validate", found, folder)
    schemas.write(folder / "validate.json", found)


def _beside(file: Path) -> Path:
    if file.suffix != ".npz":
        raise InputError("out", "must be a file .npz", str(file))
    return file.with_suffix("")


@runs(ReductionRequest, folder_of=_beside)
def reduce(found: ReducedModel, file: Path) -> None:
    """Press a range of poses in full, and make a reduced touch that answers within a millisecond.

    Parameters
    ----------
    request : str, Path, mapping or ReductionRequest, optional
        A YAML file with the keys of `ReductionRequest` (docs/reduced.md), or its content.
    out : str or Path, optional
        File of the reduced touch, .npz; presses are stored beside it. Without it nothing is written.
    jobs, progress, command, allow_python, given
        As of `touch`.
    """
    write_reduced(found, file)


@runs(ReproductionRequest)
def reproduce(found: ReproductionResult, folder: Path) -> None:
    """Reproduce Gerling et al. (2014): the paper's own system, then the set human, beside the paper.

    Parameters
    ----------
    request : str, Path, mapping or ReproductionRequest, optional
        A YAML file with the keys of `ReproductionRequest`, or its content.
    out : str or Path, optional
        Folder for the page `report.html`, the numbers in `results.json` and the stored indentations; without
        it nothing is written or stored.
    jobs, progress, command, allow_python, given
        As of `touch`.
    """
    write_page("reproduction", found, folder)
    schemas.write(folder / "results.json", found)
