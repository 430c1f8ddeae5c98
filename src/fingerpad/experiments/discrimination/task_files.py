"""Questions on file: read, with every error one sentence that says where; and those that come ready-made."""

from __future__ import annotations

import difflib
import hashlib
from collections.abc import Sequence
from importlib.resources import files
from pathlib import Path
from typing import Any

from pydantic import BaseModel, ValidationError

from fingerpad.core.errors import InputError
from fingerpad.core.plain_yaml import read_yaml
from fingerpad.experiments.discrimination.task import DEFAULT, LISTED, NAMED, SPELLED, VARIED, Question
from fingerpad.inference.tables import read_text

SUFFIX = ".yaml"
_FORMS = (LISTED, VARIED, NAMED, SPELLED)
_LONGEST_VALUE = 60


def ready_made() -> dict[str, str]:
    """Questions that come with the package.

    Returns
    -------
    dict of str to str
        Texts of the files, by name.

    Examples
    --------
    >>> print(ready_made()["sphere_curvature"].splitlines()[0])
    question: Which spheres can be told from one of 287 /m?
    """
    folder = files("fingerpad.experiments.discrimination") / "tasks"
    return {
        entry.name.removesuffix(SUFFIX): entry.read_text(encoding="utf-8")
        for entry in sorted(folder.iterdir(), key=lambda entry: entry.name)
        if entry.name.endswith(SUFFIX)
    }


def title(text: str) -> str:
    """Return the question of a ready-made file in words.

    Examples
    --------
    >>> title(ready_made()["sphere_curvature"])
    'Which spheres can be told from one of 287 /m?'
    """
    return parsed(read_yaml(text, "question")).question


def provenance(source: str | Path, question: Question) -> list[dict[str, str]]:
    """Files that an answer rests on, and their hashes, by which they are known again.

    Parameters
    ----------
    source : str or Path
        As of `read_question`.
    question : Question
        What was read there; it may name a file of fitted parameters.

    Returns
    -------
    list of dict
        `file` and `sha256`.
    """
    path = Path(source)
    content = path.read_bytes() if path.exists() else ready_made()[str(source)].encode()
    found = [{"file": str(source), "sha256": hashlib.sha256(content).hexdigest()}]
    if isinstance(question.afferent, str) and question.afferent != DEFAULT:
        named = path.parent / question.afferent
        found.append({"file": str(named), "sha256": hashlib.sha256(named.read_bytes()).hexdigest()})
    return found


def read_question(source: str | Path, **skin: Any) -> Question:
    """Read a question from a file, or one that comes with the package.

    Parameters
    ----------
    source : str or Path
        A YAML file, or a name of `ready_made`.
    **skin
        Settings of the skin that replace those of the file, such as `resolution`; None leaves them.

    Returns
    -------
    Question

    Raises
    ------
    InputError
        If there is no such file or name, it is no YAML, or a key is unknown, missing or has a value that
        cannot be; with the place in the file.

    Examples
    --------
    >>> read_question("sphere_curvature", resolution="quick").skin.resolution
    'quick'
    """
    name, path = str(source), Path(source)
    known = ready_made()
    if name in known and not path.exists():
        text = known[name]
    elif path.suffix or path.exists():
        text = read_text(path)
    else:
        raise InputError(
            f"{name} must be a YAML file or one of the ready-made questions, {', '.join(known)}: it is "
            "neither."
        )
    content = read_yaml(text, name)
    replaced = {key: value for key, value in skin.items() if value is not None}
    if replaced and isinstance(content, dict) and isinstance(content.get("skin", {}), dict):
        content["skin"] = content.get("skin", {}) | replaced
    return parsed(content, name)


def parsed(content: Any, source: str = "question") -> Question:
    """Build a question from plain values.

    Parameters
    ----------
    content : mapping
        As YAML has it.
    source : str, optional
        Where it comes from, for errors.

    Returns
    -------
    Question

    Raises
    ------
    InputError
        For the first thing that is wrong, with its place.

    Examples
    --------
    >>> spheres = {"vary": "curvature_per_m", "values": [287, 340]}
    >>> parsed({"question": "Which?", "stimuli": spheres, "standard": 287, "noise": 0.1}).code
    ('gradient_sum',)
    >>> parsed({"question": "Which?", "stimuli": spheres, "standard": 287, "noise": -0.1})
    Traceback (most recent call last):
    fingerpad.core.errors.InputError: question, noise must be a number not below 0, or fitted: got -0.1.
    """
    try:
        return Question.model_validate(content)
    except ValidationError as error:
        raise InputError(f"{source}, {sentence(error)}") from error


def sentence(error: ValidationError) -> str:
    """Say the first thing that pydantic found wrong: where, what was expected, what came.

    Parameters
    ----------
    error : pydantic.ValidationError
        Of a part of a question.

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
        near = difflib.get_close_matches(str(path[-1]), known, n=1)
        hint = f"did you mean {near[0]}?" if near else f"{_spelled(path[:-1])} has {', '.join(known)}."
        return f"{where} is unknown: {hint}"
    return f"{where} {_EXPECTED.get(first['type'], first['msg'])}: got {came}."


_EXPECTED = {
    "model_type": "must be a mapping of keys to values",
    "tuple_type": "must be a list",
    "too_short": "must have at least one entry",
}


def _spelled(path: Sequence[int | str]) -> str:
    """Place in a file as a person would write it: stimuli[2].width_mm, entries counted from 1."""
    text = "".join(f"[{part + 1}]" if isinstance(part, int) else f".{part}" for part in path)
    return text.lstrip(".") or "a question"


def _shown(value: Any) -> str:
    text = repr(value)
    return text if len(text) <= _LONGEST_VALUE else f"{text[:_LONGEST_VALUE]}..."


def _keys_at(path: Sequence[int | str]) -> list[str]:
    """Keys that the part of a question at `path` may have."""
    parts: list[type[BaseModel]] = [Question]
    for key in path:
        if isinstance(key, str):
            parts = [found for part in parts for found in _parts_in(part.model_fields[key].annotation)]
    return list(dict.fromkeys(key for part in parts for key in part.model_fields))


def _parts_in(annotation: Any) -> list[type[BaseModel]]:
    """Parts of a question that an annotation names."""
    if isinstance(annotation, type) and issubclass(annotation, BaseModel):
        return [annotation]
    return [found for inner in getattr(annotation, "__args__", ()) for found in _parts_in(inner)]
