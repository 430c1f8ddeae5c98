"""Files of discrimination tasks: reading, errors that name the place in the file, and example tasks."""

from __future__ import annotations

import hashlib
from collections.abc import Sequence
from importlib.resources import files
from pathlib import Path
from typing import Any

from fingerpad.core.errors import InputError, closest
from fingerpad.core.files import path_of, read_text
from fingerpad.core.keywords import known_keywords
from fingerpad.core.plain_yaml import read_yaml
from fingerpad.experiments.descriptions.parts import file_of
from fingerpad.experiments.descriptions.pressing import named_files
from fingerpad.experiments.descriptions.reading import Origin, part_from
from fingerpad.experiments.descriptions.stimuli import NamedStimulus
from fingerpad.experiments.discrimination.task import DiscriminationTask
from fingerpad.experiments.manifest import sha256

SUFFIX = ".yaml"


def example_tasks() -> dict[str, str]:
    """Tasks that come with the package."""
    folder = files("fingerpad.experiments.discrimination") / "tasks"
    return {
        entry.name.removesuffix(SUFFIX): entry.read_text(encoding="utf-8")
        for entry in sorted(folder.iterdir(), key=lambda entry: entry.name)
        if entry.name.endswith(SUFFIX)
    }


def title(text: str) -> str:
    """Return the question of an example task in words."""
    return parse_task(read_yaml(text, "task")).question


def input_hashes(
    source: str | Path, task: DiscriminationTask, stimuli: Sequence[NamedStimulus]
) -> dict[str, str]:
    """SHA-256 of the files on which a task rests."""
    hashes = {str(source): hashlib.sha256(task_text(source).encode()).hexdigest()}
    beside = path_of("source", source).parent
    named = [*named_files(task.finger, beside), *(path for stimulus in stimuli for path in stimulus.files)]
    if file := file_of(task.afferent):
        named.append(beside / file)
    return hashes | {str(path): sha256(path) for path in named}


@known_keywords
def read_task(source: str | Path, **replacing: Any) -> DiscriminationTask:
    """Read a task from a file, or one that comes with the package.

    Parameters
    ----------
    source : str or Path
        A YAML file, or a name of `example_tasks`.
    **replacing
        Values that replace those of the file, such as `resolution`; None leaves them.

    Raises
    ------
    InputError
        If there is no such file or name, it is no YAML, or a key is unknown, missing or has an unfit
        value; with the place in the file.

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


@known_keywords
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

    Raises
    ------
    InputError
        For the first error, with its place.

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
