"""Outputs of a described touch: figures, tables, and files for other programs."""

from __future__ import annotations

from collections.abc import Callable
from functools import partial
from pathlib import Path

from fingerpad.core.checked import checked
from fingerpad.core.errors import InputError
from fingerpad.core.progress import Progress
from fingerpad.experiments import schemas
from fingerpad.experiments.descriptions.pressed import PressedTouch, press_described
from fingerpad.experiments.descriptions.reading import at
from fingerpad.experiments.descriptions.touch import (
    DescribedTouch,
    TouchDescription,
    described_touch,
    read_touch_description,
)
from fingerpad.experiments.descriptions.values import Content
from fingerpad.export.formats import DECKS, REQUIRED, RESULTS, write_deck
from fingerpad.export.job import job_of
from fingerpad.export.responses import require_pynwb
from fingerpad.report.touch import draw, write_touch_page

Write = Callable[[PressedTouch, Path], object]

RESULT = "touch.json"


def _page(pressed: PressedTouch, folder: Path) -> None:
    picture = partial(draw, pressed.skin, pressed.response, pressed.described.touch.indenter)
    write_touch_page(pressed.result, picture, folder)


def _result(name: str) -> Write:
    return lambda pressed, folder: pressed.skin.save(folder / RESULTS[name])


def _dataset(name: str) -> Write:
    def write(pressed: PressedTouch, folder: Path) -> None:
        seed = pressed.described.description.afferents.seed
        pressed.skin.save(folder / RESULTS[name], response=pressed.response, seed=seed)

    return write


def _deck(name: str) -> Write:
    moduli = "long_term" if name == "calculix" else None

    def write(pressed: PressedTouch, folder: Path) -> None:
        # The depths of a press by force are known only now.
        job = job_of(pressed.described.touch, pressed.skin.times_ms, pressed.skin.depth_mm)
        write_deck(folder / name, job, name, moduli)

    return write


WRITERS: dict[str, Write] = {
    "figures": _page,
    "spikes": lambda pressed, folder: pressed.response.save(folder / "spikes.csv"),
    "nwb": lambda pressed, folder: pressed.response.to_nwb(folder / "touch.nwb"),
    **{name: _result(name) for name in RESULTS},
    **{name: _dataset(name) for name in ("netcdf", "zarr")},
    **{name: _deck(name) for name in DECKS},
}


def check_described(described: DescribedTouch) -> None:
    """Raise `InputError` if the touch is impossible, or an output lacks a package or cannot express it."""
    described.touch, described.population  # noqa: B018
    for number, name in enumerate(described.description.outputs):
        with described.origin.located(), at("outputs", number):
            if name in REQUIRED:
                REQUIRED[name]()
            if name == "nwb":
                require_pynwb()
            if name in DECKS and not described.touch.stimulus.stays:
                raise InputError(
                    f"{name} decks move the indenter only along its axis, and this motion moves it aside or "
                    f"turns it: leave {name} out."
                )


@checked
def run_touch(
    touch: str | Path | Content | TouchDescription | DescribedTouch,
    out: str | Path,
    progress: Progress | None = None,
    command: str | None = None,
) -> PressedTouch:
    """Press a described touch and write its outputs.

    Parameters
    ----------
    touch : str, Path, mapping, TouchDescription or DescribedTouch
        A YAML file (docs/touch.md), or the same in Python.
    out : str or Path
        Folder for the outputs, a page `touch.html` with the figures, the numbers in `touch.json`, and the
        stored indentation: the same touch is not pressed twice.
    progress : Progress, optional
        Shown each finished part.
    command : str, optional
        The command line, for the manifest.

    Raises
    ------
    InputError
        If the description or an output is impossible; nothing is pressed or written then.
    ConvergenceError
        If the mechanics cannot be solved.
    StoreError
        If the folder cannot be written.

    Examples
    --------
    >>> from tempfile import TemporaryDirectory
    >>> ball = {"object": {"kind": "sphere", "radius_mm": 4}, "motion": {"depth_mm": 0.3}, "outputs": ["csv"]}
    >>> with TemporaryDirectory() as folder:
    ...     pressed = run_touch(ball, folder)
    ...     sorted(path.name for path in Path(folder).iterdir())
    ['indentations', 'touch.csv', 'touch.json']
    >>> pressed.summary.largest_depth_mm
    0.3
    """
    described = as_described(touch)
    check_described(described)
    folder, outputs = Path(out), described.description.outputs
    pressed = press_described(
        described, folder, progress, command, whole=not REQUIRED.keys().isdisjoint(outputs)
    )
    for name in outputs:
        WRITERS[name](pressed, folder)
    schemas.write(folder / RESULT, pressed.result)
    return pressed


def as_described(touch: str | Path | Content | TouchDescription | DescribedTouch) -> DescribedTouch:
    if isinstance(touch, DescribedTouch):
        return touch
    if isinstance(touch, TouchDescription):
        return DescribedTouch(touch)
    return read_touch_description(touch) if isinstance(touch, str | Path) else described_touch(touch)
