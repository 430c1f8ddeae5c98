"""Discrimination tasks: their files and examples, their stimuli, touches and afferents."""

from __future__ import annotations

import hashlib
from collections.abc import Sequence
from importlib.resources import files
from pathlib import Path
from typing import Any

from fingerpad.core.checked import checked
from fingerpad.core.errors import InputError, closest
from fingerpad.core.files import path_of, read_text
from fingerpad.core.plain_yaml import read_yaml
from fingerpad.experiments.conditions import Conditions
from fingerpad.experiments.descriptions.parts import file_of
from fingerpad.experiments.descriptions.population import population_of
from fingerpad.experiments.descriptions.pressing import named_files
from fingerpad.experiments.descriptions.reading import Origin, part_from
from fingerpad.experiments.descriptions.stimuli import NamedStimulus, named_stimuli, touches_of
from fingerpad.experiments.discrimination.task import DiscriminationTask
from fingerpad.experiments.manifest import sha256
from fingerpad.geometry.fingertip import Finger
from fingerpad.neuron.population import Population
from fingerpad.skin.indentation import Touch


@checked
def task_stimuli(task: DiscriminationTask, beside: Path = Path()) -> tuple[NamedStimulus, ...]:
    """List the stimuli of a task, the standard first.

    Parameters
    ----------
    task : DiscriminationTask
        From `read_task`.
    beside : Path, optional
        Folder from which files are named.

    Returns
    -------
    tuple of NamedStimulus
        The standard, then the comparisons in the order of the file.

    Examples
    --------
    >>> spheres = task_stimuli(read_task("sphere_curvature"))
    >>> [stimulus.name for stimulus in spheres[:3]], spheres[1].indenter
    (['287', '296', '305'], Sphere(curvature_per_m=296.0))
    """
    found = named_stimuli(task, beside)
    if len(found) < 2:
        raise InputError("stimuli", "must be two or more to be discriminated", str(len(found)))
    with_level = [stimulus.level is not None for stimulus in found]
    if any(with_level) and not all(with_level):
        raise InputError(
            "level",
            "must be given for all stimuli or for none",
            remedy=f"{found[with_level.index(False)].name!r} has none",
        )
    row = stimulus_index(found, task.standard, "standard")
    return (found[row], *found[:row], *found[row + 1 :])


def stimulus_index(stimuli: Sequence[NamedStimulus], place: float | str, key: str) -> int:
    """Index of the stimulus that a level or a name means, else raise `InputError` that names the key."""
    for row, stimulus in enumerate(stimuli):
        if place == stimulus.name or (stimulus.level is not None and place == stimulus.level):
            return row
    names = ", ".join(stimulus.name for stimulus in stimuli)
    raise InputError(key, f"must be one of the stimuli, {names}", repr(place))


@checked
def task_population(
    task: DiscriminationTask, beside: Path = Path(), finger: Finger | None = None
) -> Population:
    """Lay out the afferents of a task; files that it names are searched in `beside`."""
    finger = task_conditions(task, beside).finger if finger is None else finger
    return population_of(task.population, task.afferent, task.tissues, beside, finger=finger)


def task_conditions(task: DiscriminationTask, beside: Path = Path()) -> Conditions:
    """Finger, tissues, accuracy and seed of a task; the file of a mesh is named from the folder `beside`."""
    return task.conditions(task.experiment.seed, beside)


def task_touches(task: DiscriminationTask, beside: Path = Path()) -> dict[str, Touch]:
    """One touch per stimulus of a task, see `touches_of`; files are named from the folder `beside`."""
    return touches_of(task_stimuli(task, beside), task_conditions(task, beside), task.reach_mm)


SUFFIX = ".yaml"


def example_tasks() -> dict[str, str]:
    folder = files("fingerpad.experiments.discrimination") / "tasks"
    return {
        entry.name.removesuffix(SUFFIX): entry.read_text(encoding="utf-8")
        for entry in sorted(folder.iterdir(), key=lambda entry: entry.name)
        if entry.name.endswith(SUFFIX)
    }


def title(text: str) -> str:
    return parse_task(read_yaml(text, "task")).question


def input_hashes(
    source: str | Path, task: DiscriminationTask, stimuli: Sequence[NamedStimulus]
) -> dict[str, str]:
    hashes = {str(source): hashlib.sha256(task_text(source).encode()).hexdigest()}
    beside = path_of("source", source).parent
    named = [*named_files(task.finger, beside), *(path for stimulus in stimuli for path in stimulus.files)]
    if file := file_of(task.afferent):
        named.append(beside / file)
    return hashes | {str(path): sha256(path) for path in named}


@checked
def read_task(source: str | Path, **replacing: Any) -> DiscriminationTask:
    """Read a task from a file, or one that comes with the package.

    Parameters
    ----------
    source : str or Path
        A YAML file, or a name of `example_tasks`.
    **replacing
        Values that replace those of the file, such as `resolution`; None leaves them.

    Examples
    --------
    >>> read_task("sphere_curvature", resolution="quick").resolution
    'quick'
    """
    text = task_text(source)
    content = read_yaml(text, str(source))
    replaced = {key: value for key, value in replacing.items() if value is not None}
    if replaced and isinstance(content, dict):
        content |= replaced
    return parse_task(content, str(source), text)


def task_text(source: str | Path) -> str:
    """Text of a task, from a file or from the package; arguments as of `read_task`."""
    name, path, known = str(source), path_of("source", source), example_tasks()
    if name in known and not path.is_file():
        return known[name]
    if path.suffix or path.exists():
        return read_text(path)
    near = closest(name, known)
    raise InputError(
        f"{name} must be a YAML file or one of the example tasks, {', '.join(known)}: it is neither"
        + (f", did you mean {near}?" if near else ".")
    )


@checked
def parse_task(content: Any, source: str = "task", text: str = "") -> DiscriminationTask:
    """Build a task from plain values.

    Parameters
    ----------
    content : mapping
        As YAML has it.
    source : str, optional
        Where it comes from, for errors.
    text : str, optional
        Content of the file, for the lines of errors.

    Examples
    --------
    >>> spheres = {"vary": "object.curvature_per_m", "values": [287, 340]}
    >>> parse_task({"question": "Which?", "stimuli": spheres, "standard": 287, "noise": 0.1}).code
    ('gradient_sum',)
    >>> parse_task({"question": "Which?", "stimuli": spheres, "standard": 287, "noise": -0.1})
    Traceback (most recent call last):
    fingerpad.core.errors.InputError: task, noise must be a number from 0 to 1000, or fitted: got -0.1.
    """
    with Origin(source, text).located():
        return part_from(DiscriminationTask, content)
