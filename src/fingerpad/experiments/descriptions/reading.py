"""Reading of descriptions: the first error as one sentence with its place."""

from __future__ import annotations

from collections.abc import Callable, Iterator, Mapping, Sequence
from contextlib import contextmanager
from dataclasses import dataclass
from pathlib import Path
from typing import Any, TypeVar, get_args

from pydantic import BaseModel, ValidationError

from fingerpad.core.checked import first_of, in_words
from fingerpad.core.errors import InputError, Place, did_you_mean, spelled
from fingerpad.core.plain_yaml import line_at
from fingerpad.experiments.descriptions.signatures import LateKind
from fingerpad.experiments.descriptions.values import Part, kind_of

_Kind = TypeVar("_Kind", bound=Part)


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
            if error.source:  # from a part of the same description
                raise
            source, words = self.line_of(error.path, error.where)
            raise error.at(error.path, words).from_source(source) from error

    def line_of(self, place: Place, words: str) -> tuple[str, str]:
        """Return the file with the line of a place, and the words for the place in that line."""
        row = place[1] if self.rows and len(place) > 1 and place[0] == "stimuli" else None
        if isinstance(row, int):
            return f"{self.name}, line {self.rows[row]}", words.removeprefix(spelled(place[:2])).lstrip(".")
        line = line_at(self.text, place) if self.text else None
        return self.name if line is None else f"{self.name}, line {line}", words


@contextmanager
def at(*place: int | str) -> Iterator[None]:
    """Put the place in front of the path of an `InputError` from within that has none in a file."""
    try:
        yield
    except InputError as error:
        if error.in_file:
            raise
        named = error if error.path else InputError(str(error))
        raise named.at((*place, *error.path)) from error


@contextmanager
def moved(move: Callable[[Place], tuple[Place, str]]) -> Iterator[None]:
    """Give an `InputError` at a place of a file another place, and the words for it."""
    try:
        yield
    except InputError as error:
        if not error.in_file:
            raise
        raise error.at(*move(error.path)) from error


def part_from(kind: type[_Kind], content: Any) -> _Kind:
    """Build a description from plain values."""
    try:
        return kind.model_validate(content)
    except ValidationError as error:
        raise input_error(error, kind) from error


def merged(common: Any, own: Any, default_kind: str | None = None) -> Any:
    """Replace keys of a block by those of another one, or all of it where their kinds differ."""
    if own is None:
        return common
    if isinstance(common, str) and isinstance(own, Mapping) and "kind" not in own:
        if ":" in common:
            raise InputError(
                "sizes", "must stand in the text or in keys, not in both", f"{common!r} and keys"
            )
        common = {"kind": common}
    if not isinstance(common, Mapping) or not isinstance(own, Mapping):
        return own
    kind = common.get("kind", default_kind)
    return {**common, **own} if own.get("kind", kind) == kind else own


def input_error(error: ValidationError, kind: type[Part]) -> InputError:
    """Make the first error that pydantic found one of the package."""
    first = first_of(error.errors(include_url=False))
    path = tuple(part for part in first["loc"] if kind_of(part) is None)
    if first["type"] == "missing":
        found = InputError(path, "must be given", remedy="it is missing")
    elif first["type"] == "extra_forbidden":
        known = _keys_at(first["loc"][:-1], kind)
        found = InputError(path, "is unknown", remedy=did_you_mean(str(path[-1]), known, spelled(path[:-1])))
    elif first["input"] is None and not path:
        found = InputError(path, "must be a mapping of keys to values", remedy="it is empty")
    else:
        found = in_words(first, path, spelled(path))
    return found.at(found.path)


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
