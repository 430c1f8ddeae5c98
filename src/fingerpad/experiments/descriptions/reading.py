"""Reading of descriptions: the first error as one sentence with its place."""

from __future__ import annotations

import reprlib
from collections.abc import Sequence
from typing import Any, TypeVar, get_args

from pydantic import BaseModel, ValidationError

from fingerpad.core.errors import InputError
from fingerpad.core.keywords import did_you_mean
from fingerpad.experiments.descriptions.values import Part, kind_of

_Kind = TypeVar("_Kind", bound=Part)

_EXPECTED = {
    "model_type": "must be a mapping of keys to values",
    "tuple_type": "must be a list",
    "too_short": "must have at least one entry",
    "invalid_key": "must have texts as keys",
    "bool_type": "must be true or false",
}
_KEYS = ("extra_forbidden", "invalid_key")
_SHOWN = reprlib.Repr()
_SHOWN.maxstring, _SHOWN.maxother, _SHOWN.maxlevel = 60, 60, 2


def parsed(kind: type[_Kind], content: Any, source: str) -> _Kind:
    """Build a description from plain values.

    Parameters
    ----------
    kind : type
        A part.
    content : mapping
        As YAML has it.
    source : str
        Where it comes from, for errors.

    Raises
    ------
    InputError
        For the first error, with its place.
    """
    try:
        return kind.model_validate(content)
    except ValidationError as error:
        raise InputError(f"{source}, {error_sentence(error, kind)}") from error


def place_of(error: ValidationError) -> list[int | str]:
    """Keys and indices that lead to the first error."""
    return [part for part in first_of(error)["loc"] if kind_of(part) is None]


def first_of(error: ValidationError) -> Any:
    """First error that matters: the kind, then an unknown key, which may be meant for a missing one."""
    found = error.errors(include_url=False)

    def order(each: Any) -> int:
        return 0 if each["loc"][-1:] == ("kind",) else 1 if each["type"] in _KEYS else 2

    return min(found, key=order)


def error_sentence(error: ValidationError, kind: type[Part]) -> str:
    """Describe the first error that pydantic found: where, what was expected, what came.

    Parameters
    ----------
    error : pydantic.ValidationError
        Of a part.
    kind : type
        That part.

    Returns
    -------
    str
        One sentence.
    """
    first, path = first_of(error), place_of(error)
    where = spelled(path)
    if first["type"] == "missing":
        return f"{where} must be given: it is missing."
    if first["type"] == "extra_forbidden":
        known = _keys_at(first["loc"][:-1], kind)
        return f"{where} is unknown: {did_you_mean(str(path[-1]), known, spelled(path[:-1]))}"
    expected = _EXPECTED.get(first["type"], first["msg"])
    return f"{where} {expected}: got {_SHOWN.repr(first.get('input'))}."


def spelled(path: Sequence[int | str]) -> str:
    """Spell a place in a file, such as stimuli[2].width_mm, entries counted from 1."""
    text = "".join(f"[{part + 1}]" if isinstance(part, int) else f".{part}" for part in path)
    return text.lstrip(".") or "the file"


def _keys_at(path: Sequence[int | str], kind: type[Part]) -> list[str]:
    """Keys that the part at `path` may have."""
    parts: list[type[BaseModel]] = [kind]
    for key in path:
        form = kind_of(key)
        if form is not None:
            parts = [
                part
                for part in parts
                if "kind" not in part.model_fields or part.model_fields["kind"].default == form
            ]
        elif isinstance(key, str):
            parts = [
                found
                for part in parts
                if key in part.model_fields
                for found in parts_in(part.model_fields[key].annotation)
            ]
    return list(dict.fromkeys(key for part in parts for key in part.model_fields))


def parts_in(annotation: Any) -> list[type[BaseModel]]:
    """Parts that an annotation names."""
    if isinstance(annotation, type) and issubclass(annotation, BaseModel):
        return [annotation]
    return [found for inner in get_args(annotation) for found in parts_in(inner)]
