"""Reading of descriptions: the first error as one sentence with its place."""

from __future__ import annotations

import re
import reprlib
from collections.abc import Callable, Iterator, Mapping, Sequence
from contextlib import contextmanager
from dataclasses import dataclass
from pathlib import Path
from typing import Any, TypeVar, get_args

from pydantic import BaseModel, ValidationError

from fingerpad.core.errors import InputError, did_you_mean, got
from fingerpad.core.plain_yaml import line_at
from fingerpad.experiments.descriptions.signatures import LateKind
from fingerpad.experiments.descriptions.values import Part, kind_of

Place = tuple[int | str, ...]
"""Keys and indices that lead to a place in a file."""

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


class PlacedError(InputError):
    """An error at a known place of a file, which the sentence names."""

    def __init__(self, said: str, place: Sequence[int | str]):
        super().__init__(said)
        self.place = tuple(place)


@dataclass(frozen=True)
class Origin:
    r"""Where a description comes from: errors begin with its name and line."""

    name: str
    """Of the file: files that it names are searched beside it."""
    text: str = ""
    """Its content in YAML, for lines; empty where there is none."""
    rows: tuple[int, ...] = ()
    """Lines of the entries of `stimuli` in a table."""

    @property
    def beside(self) -> Path:
        """Folder from which files are named."""
        return Path(self.name).parent

    @contextmanager
    def located(self) -> Iterator[None]:
        """Put the file, and the line where it is known, in front of an `InputError` from within."""
        try:
            yield
        except InputError as error:
            if str(error).startswith(f"{self.name}, "):  # from a part of the same description
                raise
            place = error.place if isinstance(error, PlacedError) else _unspelled(str(error))
            raise InputError(self.sentence(str(error), place)) from error

    def sentence(self, said: str, place: Place) -> str:
        """Begin a sentence about a place with the file and the line."""
        row = place[1] if self.rows and len(place) > 1 and place[0] == "stimuli" else None
        if isinstance(row, int):
            said = said.removeprefix(place_text(place[:2])).lstrip(". ")
            return f"{self.name}, line {self.rows[row]}, {said}"
        line = line_at(self.text, place) if self.text else None
        return f"{self.name}, {said}" if line is None else f"{self.name}, line {line}, {said}"


@contextmanager
def at(*place: int | str) -> Iterator[None]:
    """Put the place in front of an `InputError` from within that has none."""
    try:
        yield
    except PlacedError:
        raise
    except InputError as error:
        raise PlacedError(f"{place_text(place)}: {error}", place) from error


@contextmanager
def moved(move: Callable[[Place], tuple[Place, str]]) -> Iterator[None]:
    """Give a `PlacedError` from within another place, and the words for it."""
    try:
        yield
    except PlacedError as error:
        place, words = move(error.place)
        raise PlacedError(words + str(error).removeprefix(place_text(error.place)), place) from error


def part_from(kind: type[_Kind], content: Any) -> _Kind:
    """Build a description from plain values."""
    try:
        return kind.model_validate(content)
    except ValidationError as error:
        raise PlacedError(error_sentence(error, kind), place_of(error)) from error


def merged(common: Any, own: Any, default_kind: str | None = None) -> Any:
    """Replace keys of a block by those of another one, or all of it where their kinds differ."""
    if own is None:
        return common
    if isinstance(common, str) and isinstance(own, Mapping) and "kind" not in own:
        if ":" in common:
            raise InputError(
                f"sizes must stand in the text or in keys, not in both: got {common!r} and keys."
            )
        common = {"kind": common}
    if not isinstance(common, Mapping) or not isinstance(own, Mapping):
        return own
    kind = common.get("kind", default_kind)
    return {**common, **own} if own.get("kind", kind) == kind else own


def place_of(error: ValidationError) -> list[int | str]:
    """Keys and indices that lead to the first error."""
    return [part for part in first_of(error)["loc"] if kind_of(part) is None]


def first_of(error: ValidationError) -> Any:
    """First error that matters: the kind, an unknown key, a wrong value, a missing key."""
    found = error.errors(include_url=False)

    def order(each: Any) -> int:
        if each["loc"][-1:] == ("kind",):
            return 0
        return 1 if each["type"] in _KEYS else 3 if each["type"] == "missing" else 2

    return min(found, key=order)


def error_sentence(error: ValidationError, kind: type[Part]) -> str:
    """Describe the first error that pydantic found: where, what was expected, what came."""
    first, path = first_of(error), place_of(error)
    where = place_text(path)
    if first["type"] == "missing":
        return f"{where} must be given: it is missing."
    if first["type"] == "extra_forbidden":
        known = _keys_at(first["loc"][:-1], kind)
        return f"{where} is unknown: {did_you_mean(str(path[-1]), known, place_text(path[:-1]))}"
    expected = _EXPECTED.get(first["type"], first["msg"])
    if first.get("input") is None and not path:
        return f"{where} {expected}: it is empty."
    value, allowed = first.get("input"), first.get("ctx", {}).get("allowed", ())
    return f"{where} {expected}: {got(value, allowed, _SHOWN.repr(value))}"


def place_text(path: Sequence[int | str]) -> str:
    """Spell a place in a file, such as stimuli[2].width_mm, entries counted from 1."""
    text = "".join(f"[{part + 1}]" if isinstance(part, int) else f".{part}" for part in path)
    return text.lstrip(".") or "the file"


def _unspelled(said: str) -> Place:
    """Place that a sentence begins with: stimuli[2].width_mm."""
    begin = re.match(r"[\w.\[\]]*", said)
    parts = re.findall(r"\[(\d+)\]|(\w+)", begin[0] if begin else "")
    return tuple(int(number) - 1 if number else key for number, key in parts)


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
    if isinstance(annotation, LateKind):
        return [annotation.part]
    return [found for inner in get_args(annotation) for found in parts_in(inner)]
