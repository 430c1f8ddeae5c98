"""Files of discrimination tasks: reading, errors that name the place in the file, and example tasks."""

from __future__ import annotations

import hashlib
from collections.abc import Sequence
from importlib.resources import files
from pathlib import Path
from typing import Any

from pydantic import BaseModel, ValidationError

from fingerpad.core.errors import InputError
from fingerpad.core.files import read_text
from fingerpad.core.keywords import did_you_mean
from fingerpad.core.plain_yaml import read_yaml
from fingerpad.experiments.discrimination.task import (
    DEFAULT,
    LISTED,
    NAMED,
    SPELLED,
    VARIED,
    DiscriminationTask,
)
from fingerpad.experiments.manifest import sha256

SUFFIX = ".yaml"
_FORMS = (LISTED, VARIED, NAMED, SPELLED)
_LONGEST_VALUE = 60


def example_tasks() -> dict[str, str]:
    """Tasks that come with the package.

    Returns
    -------
    dict of str to str
        Texts of the files, by name.

    Examples
    --------
    >>> print(example_tasks()["sphere_curvature"].splitlines()[0])
    question: Which spheres can be discriminated from one of 287 /m?
    """
    folder = files("fingerpad.experiments.discrimination") / "tasks"
    return {
        entry.name.removesuffix(SUFFIX): entry.read_text(encoding="utf-8")
        for entry in sorted(folder.iterdir(), key=lambda entry: entry.name)
        if entry.name.endswith(SUFFIX)
    }


def title(text: str) -> str:
    """Return the question of an example task in words.

    Examples
    --------
    >>> title(example_tasks()["sphere_curvature"])
    'Which spheres can be discriminated from one of 287 /m?'
    """
    return parse_task(read_yaml(text, "task")).question


def input_hashes(source: str | Path, task: DiscriminationTask) -> dict[str, str]:
    """SHA-256 of the files on which a task rests.

    Parameters
    ----------
    source : str or Path
        As of `read_task`.
    task : DiscriminationTask
        What was read there; it may name a file of fitted parameters.

    Returns
    -------
    dict of str to str
        By name of the file.
    """
    path = Path(source)
    content = path.read_bytes() if path.is_file() else example_tasks()[str(source)].encode()
    hashes = {str(source): hashlib.sha256(content).hexdigest()}
    if isinstance(task.afferent, str) and task.afferent != DEFAULT:
        named = path.parent / task.afferent
        hashes[str(named)] = sha256(named)
    return hashes


def read_task(source: str | Path, **skin: Any) -> DiscriminationTask:
    """Read a task from a file, or one that comes with the package.

    Parameters
    ----------
    source : str or Path
        A YAML file, or a name of `example_tasks`.
    **skin
        Settings of the skin that replace those of the file, such as `resolution`; None leaves them.

    Returns
    -------
    DiscriminationTask

    Raises
    ------
    InputError
        If there is no such file or name, it is no YAML, or a key is unknown, missing or has an unfit
        value; with the place in the file.

    Examples
    --------
    >>> read_task("sphere_curvature", resolution="quick").skin.resolution
    'quick'
    """
    name, path = str(source), Path(source)
    known = example_tasks()
    if name in known and not path.is_file():
        text = known[name]
    elif path.suffix or path.exists():
        text = read_text(path)
    else:
        raise InputError(
            f"{name} must be a YAML file or one of the example tasks, {', '.join(known)}: it is neither."
        )
    content = read_yaml(text, name)
    replaced = {key: value for key, value in skin.items() if value is not None}
    if replaced and isinstance(content, dict) and isinstance(content.get("skin", {}), dict):
        content["skin"] = content.get("skin", {}) | replaced
    return parse_task(content, name)


def parse_task(content: Any, source: str = "task") -> DiscriminationTask:
    """Build a task from plain values.

    Parameters
    ----------
    content : mapping
        As YAML has it.
    source : str, optional
        Where it comes from, for errors.

    Returns
    -------
    DiscriminationTask

    Raises
    ------
    InputError
        For the first error, with its place.

    Examples
    --------
    >>> spheres = {"vary": "curvature_per_m", "values": [287, 340]}
    >>> parse_task({"question": "Which?", "stimuli": spheres, "standard": 287, "noise": 0.1}).code
    ('gradient_sum',)
    >>> parse_task({"question": "Which?", "stimuli": spheres, "standard": 287, "noise": -0.1})
    Traceback (most recent call last):
    fingerpad.core.errors.InputError: task, noise must be a number not below 0, or fitted: got -0.1.
    """
    try:
        return DiscriminationTask.model_validate(content)
    except ValidationError as error:
        raise InputError(f"{source}, {error_sentence(error)}") from error


def error_sentence(error: ValidationError) -> str:
    """Describe the first error that pydantic found: where, what was expected, what came.

    Parameters
    ----------
    error : pydantic.ValidationError
        Of a part of a task.

    Returns
    -------
    str
        One sentence.
    """
    first = error.errors(include_url=False)[0]
    path = [part for part in first["loc"] if part not in _FORMS]
    where, came = _spelled(path), _shown(first.get("input"))
    if first["type"] == "missing":
        return f"{where} must be given: it is missing."
    if first["type"] == "extra_forbidden":
        known = _keys_at(path[:-1])
        return f"{where} is unknown: {did_you_mean(str(path[-1]), known, _spelled(path[:-1]))}"
    return f"{where} {_EXPECTED.get(first['type'], first['msg'])}: got {came}."


_EXPECTED = {
    "model_type": "must be a mapping of keys to values",
    "tuple_type": "must be a list",
    "too_short": "must have at least one entry",
}


def _spelled(path: Sequence[int | str]) -> str:
    """Spell a place in a file, such as stimuli[2].width_mm, entries counted from 1."""
    text = "".join(f"[{part + 1}]" if isinstance(part, int) else f".{part}" for part in path)
    return text.lstrip(".") or "a task"


def _shown(value: Any) -> str:
    text = repr(value)
    return text if len(text) <= _LONGEST_VALUE else f"{text[:_LONGEST_VALUE]}..."


def _keys_at(path: Sequence[int | str]) -> list[str]:
    """Keys that the part of a task at `path` may have."""
    parts: list[type[BaseModel]] = [DiscriminationTask]
    for key in path:
        if isinstance(key, str):
            parts = [found for part in parts for found in _parts_in(part.model_fields[key].annotation)]
    return list(dict.fromkeys(key for part in parts for key in part.model_fields))


def _parts_in(annotation: Any) -> list[type[BaseModel]]:
    """Parts of a task that an annotation names."""
    if isinstance(annotation, type) and issubclass(annotation, BaseModel):
        return [annotation]
    return [found for inner in getattr(annotation, "__args__", ()) for found in _parts_in(inner)]
