"""What a user asks for, one function each: a request goes in, a result comes out, and files are written.

A request is a YAML file, a mapping with the same keys, or keywords; `fingerpad touch` and the other commands
take the same keys as options. Keywords replace what the file says; one within a block is written as a block
or, in a mapping `**{"motion.depth_mm": 0.5}`, with its place.
"""

from __future__ import annotations

from collections.abc import Callable, Iterator
from contextlib import contextmanager
from pathlib import Path
from tempfile import TemporaryDirectory
from typing import Any

from fingerpad.core.checked import checked
from fingerpad.core.engine import Engine, engine_of
from fingerpad.core.errors import InputError
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
from fingerpad.experiments.validation.request import ValidationRequest
from fingerpad.experiments.validation.validation import ValidationFile
from fingerpad.export.formats import DECKS, REQUIRED, RESULTS, write_deck
from fingerpad.export.job import job_of
from fingerpad.export.responses import require_pynwb
from fingerpad.reduction.model import ReducedModel, write_reduced
from fingerpad.report.results import write_page
from fingerpad.skin.sampling import SkinResponse

Write = Callable[[TouchResult, Path], object]


@checked
def touch(
    request: Any = None,
    *,
    out: str | Path | None = None,
    jobs: Whole | Engine = 1,
    progress: Progress | None = None,
    command: str | None = None,
    allow_python: Flag = False,
    **given: Any,
) -> TouchResult:
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
        If the mechanics cannot be solved.
    StoreError
        If the folder cannot be written.

    Examples
    --------
    >>> import fingerpad as fp
    >>> found = fp.touch(object=fp.Sphere(radius_mm=4), motion={"depth_mm": 0.3}, afferents="RA")
    >>> found.summary.largest_depth_mm, found.response.rate_measure
    (0.3, 'count')
    """
    asked = TouchRequest.read(request, given, allow_python)
    check_outputs(asked)
    result: TouchResult = _run(asked, out, jobs, progress, command)
    if out is not None:
        for name in asked.outputs:
            WRITERS[name](result, Path(out))
        schemas.write(Path(out) / "touch.json", result.result)
    return result


@checked
def respond(
    request: Any = None,
    *,
    out: str | Path | None = None,
    jobs: Whole | Engine = 1,
    progress: Progress | None = None,
    command: str | None = None,
    allow_python: Flag = False,
    **given: Any,
) -> ResponseMap:
    """Let afferents respond to a touch.

    Parameters
    ----------
    request : str, Path, mapping, RespondRequest, SkinResponse or TouchResult, optional
        A YAML file with the keys of the block `afferents` of a touch and `touch`, or its content; or the
        solved touch.
    out : str or Path, optional
        Folder for `spikes.csv` and the stored indentation; without it nothing is written or stored.
    jobs, progress, command, allow_python
        As of `touch`.
    **given
        Keys of the request: `touch`, and those of the block `afferents`.

    Examples
    --------
    >>> import fingerpad as fp
    >>> skin = fp.indent(fp.Fingertip(), fp.Sphere(radius_mm=4), fp.RampAndHold(depth_mm=0.3))
    >>> fp.respond(skin, afferent="PC", rows=1, columns=2).rate_measure
    'count'
    """
    if isinstance(request, SkinResponse | TouchResult):
        request, given = None, {"touch": request} | given
    asked = RespondRequest.read(request, given, allow_python)
    response: ResponseMap = _run(asked, out, jobs, progress, command)
    if out is not None:
        response.save(Path(out) / "spikes.csv")
    return response


@checked
def fit(
    request: Any = None,
    *,
    out: str | Path | None = None,
    jobs: Whole | Engine = 1,
    progress: Progress | None = None,
    command: str | None = None,
    allow_python: Flag = False,
    **given: Any,
) -> FitFile | ChosenNumbersFile:
    """Fit an afferent to recordings: firing rates or spike times under known stimuli.

    Parameters
    ----------
    request : str, Path, mapping or FitRequest, optional
        A YAML file with the keys of `FitRequest` (docs/fit.md), or its content.
    out : str or Path, optional
        Folder for the page `fit.html`, the numbers in `fit.json` and the stored indentations; without it
        nothing is written or stored.
    jobs, progress, command, allow_python
        As of `touch`.
    **given
        Keys of the request, such as `recordings`, `stimuli` and `method`.

    Returns
    -------
    FitFile or ChosenNumbersFile
        The fit of the four numbers of an SAI, in `fit`; or that of the numbers which `free` names.

    Raises
    ------
    ConvergenceError
        If an indentation or the fit does not converge; finished indentations stay stored.
    """
    asked = FitRequest.read(request, given, allow_python)
    found: FitFile | ChosenNumbersFile = _run(asked, out, jobs, progress, command)
    if out is not None:
        if isinstance(found, FitFile):
            write_page("fit", found, Path(out))
        schemas.write(Path(out) / "fit.json", found)
    return found


@checked
def discriminate(
    request: Any = None,
    *,
    out: str | Path | None = None,
    jobs: Whole | Engine = 1,
    progress: Progress | None = None,
    command: str | None = None,
    allow_python: Flag = False,
    **given: Any,
) -> DiscriminationFile:
    """Predict hit rates, psychometric curves and thresholds of a discrimination task.

    Parameters
    ----------
    request : str, Path, mapping or DiscriminationRequest, optional
        A YAML file (docs/discriminate.md), its content, or the name of an example task.
    out : str or Path, optional
        Folder for the page `discriminate.html`, the numbers in `discriminate.json` and the stored
        indentations; without it nothing is written or stored.
    jobs, progress, command, allow_python
        As of `touch`.
    **given
        Keys of the request.

    Returns
    -------
    DiscriminationFile
        The result, in `discrimination`, with what was asked.

    Raises
    ------
    ConvergenceError
        If an indentation cannot be solved, or no noise gives the observed hit rates.
    """
    asked = DiscriminationRequest.read(request, given, allow_python)
    found: DiscriminationFile = _run(asked, out, jobs, progress, command)
    if out is not None:
        write_page("discriminate", found, Path(out))
        schemas.write(Path(out) / "discriminate.json", found)
    return found


@checked
def validate(
    request: Any = None,
    *,
    out: str | Path | None = None,
    jobs: Whole | Engine = 1,
    progress: Progress | None = None,
    command: str | None = None,
    allow_python: Flag = False,
    **given: Any,
) -> ValidationFile:
    """Score the model against observations of force, deflection or firing rates.

    Parameters
    ----------
    request : str, Path, mapping or ValidationRequest, optional
        A YAML file with the keys of `ValidationRequest` (docs/validate.md), or its content.
    out : str or Path, optional
        Folder for the page `validate.html`, the numbers in `validate.json` and the stored indentations;
        without it nothing is written or stored.
    jobs, progress, command, allow_python
        As of `touch`.
    **given
        Keys of the request, such as `observations`.

    Returns
    -------
    ValidationFile
        Rows whose touch cannot be solved have a reason instead of a prediction.
    """
    asked = ValidationRequest.read(request, given, allow_python)
    found: ValidationFile = _run(asked, out, jobs, progress, command)
    if out is not None:
        write_page("validate", found, Path(out))
        schemas.write(Path(out) / "validate.json", found)
    return found


@checked
def reduce(
    request: Any = None,
    *,
    out: str | Path | None = None,
    jobs: Whole | Engine = 1,
    progress: Progress | None = None,
    command: str | None = None,
    allow_python: Flag = False,
    **given: Any,
) -> ReducedModel:
    """Press a range of poses in full, and make a reduced touch that answers within a millisecond.

    Parameters
    ----------
    request : str, Path, mapping or ReductionRequest, optional
        A YAML file with the keys of `ReductionRequest` (docs/reduced.md), or its content.
    out : str or Path, optional
        File of the reduced touch, .npz; presses are stored beside it. Without it nothing is written.
    jobs, progress, command, allow_python
        As of `touch`.
    **given
        Keys of the request, such as `object` and `range`.

    Raises
    ------
    ConvergenceError
        If a press cannot be solved.
    """
    if out is not None and Path(out).suffix != ".npz":
        raise InputError("out", "must be a file .npz", str(out))
    asked = ReductionRequest.read(request, given, allow_python)
    folder = None if out is None else Path(out).with_suffix("")
    model: ReducedModel = _run(asked, folder, jobs, progress, command)
    if out is not None:
        write_reduced(model, Path(out))
    return model


@checked
def reproduce(
    request: Any = None,
    *,
    out: str | Path | None = None,
    jobs: Whole | Engine = 1,
    progress: Progress | None = None,
    command: str | None = None,
    allow_python: Flag = False,
    **given: Any,
) -> ReproductionResult:
    """Reproduce Gerling et al. (2014): the paper's own system, then the set human, beside the paper.

    Parameters
    ----------
    request : str, Path, mapping or ReproductionRequest, optional
        A YAML file with the keys of `ReproductionRequest`, or its content.
    out : str or Path, optional
        Folder for the page `report.html`, the numbers in `results.json` and the stored indentations; without
        it nothing is written or stored.
    jobs, progress, command, allow_python
        As of `touch`.
    **given
        Keys of the request, such as `resolution`.
    """
    asked = ReproductionRequest.read(request, given, allow_python)
    found: ReproductionResult = _run(asked, out, jobs, progress, command)
    if out is not None:
        write_page("reproduction", found, Path(out))
        schemas.write(Path(out) / "results.json", found)
    return found


def _run(
    asked: Request, out: str | Path | None, jobs: int | Engine, progress: Progress | None, command: str | None
) -> Any:
    """Check and run a request; without a folder, its presses are stored until it ends."""
    engine_of(jobs)
    asked.check()
    with _folder(out) as folder:
        return run(asked, folder, jobs, progress, command)


@contextmanager
def _folder(out: str | Path | None) -> Iterator[Path]:
    if out is not None:
        yield Path(out)
        return
    with TemporaryDirectory() as folder:
        yield Path(folder)


def _result(name: str) -> Write:
    return lambda pressed, folder: pressed.skin.save(folder / RESULTS[name])


def _dataset(name: str) -> Write:
    def write(pressed: TouchResult, folder: Path) -> None:
        seed = pressed.request.afferents.seed
        pressed.skin.save(folder / RESULTS[name], response=pressed.response, seed=seed)

    return write


def _deck(name: str) -> Write:
    def write(pressed: TouchResult, folder: Path) -> None:
        # The depths of a press by force are known only now.
        job = job_of(pressed.request.touch, pressed.skin.times_ms, pressed.skin.depth_mm)
        moduli = pressed.request.elastic_moduli if name == "calculix" else None
        write_deck(folder / name, job, name, moduli)

    return write


WRITERS: dict[str, Write] = {
    "figures": lambda pressed, folder: write_page("touch", pressed, folder),
    "spikes": lambda pressed, folder: pressed.response.save(folder / "spikes.csv"),
    "nwb": lambda pressed, folder: pressed.response.to_nwb(folder / "touch.nwb"),
    **{name: _result(name) for name in RESULTS},
    **{name: _dataset(name) for name in ("netcdf", "zarr")},
    **{name: _deck(name) for name in DECKS},
}
"""What writes each output of a touch."""


def check_outputs(asked: TouchRequest) -> None:
    """Raise `InputError` if the touch is impossible, or an output lacks a package or cannot express it."""
    asked.check()
    for number, name in enumerate(asked.outputs):
        with asked.origin.located(), at("outputs", number):
            if name in REQUIRED:
                REQUIRED[name]()
            if name == "nwb":
                require_pynwb()
            if name in DECKS and not asked.touch.stimulus.stays:
                raise InputError(
                    f"{name} decks move the indenter only along its axis, and this motion moves it aside or "
                    f"turns it: leave {name} out."
                )
