"""Parts whose keys are the parameters of a function or a class: objects and motions.

A part has the same names, defaults and explanations in a file as its function has in Python. The values of
its keys are checked by type here, and by the function itself.
"""

from __future__ import annotations

import inspect
import re
from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass
from functools import cached_property
from importlib import import_module
from pathlib import Path
from types import MappingProxyType
from typing import Annotated, Any, ClassVar, Literal, Union, get_args, get_origin, get_type_hints

from pydantic import Discriminator, Field, GetJsonSchemaHandler, Tag, create_model
from pydantic_core import CoreSchema, core_schema

from fingerpad.core.keywords import other_names
from fingerpad.core.results import JsonSchema
from fingerpad.core.units import unit_of
from fingerpad.experiments.descriptions.values import (
    NAMED,
    UNKNOWN,
    FiniteNumber,
    Numbers,
    Outlines,
    Pairs,
    Part,
    Text,
    Truth,
    Whole,
    choice_of,
    form_of,
)

UNKNOWN_MODEL = "Unknown_"
"""Beginning of the name of a part that only serves the error of an unknown kind."""

File = Annotated[Text, "file"]
"""Name of a file, from the folder of the description."""

_VALUES: dict[Any, Any] = {float: FiniteNumber, int: Whole, bool: Truth, str: Text, Path: File}
_LISTS: dict[Any, Any] = {float: Numbers, tuple[float, float]: Pairs}


class Made(Part):
    """Part that a function makes from its keys."""

    makes: ClassVar[Callable[..., Any]]
    files: ClassVar[frozenset[str]]
    """Keys that name files."""

    def made(self, beside: Path = Path()) -> Any:
        """Return what the function makes."""
        given = {key: value for key, value in self.given.items() if key != "kind"}
        named = {key: beside / value for key, value in given.items() if key in self.files}
        return type(self).makes(**given | named)


def made_by(kind: str, makes: Callable[..., Any], without: Sequence[str] = ()) -> type[Made]:
    """Make the part whose keys are `kind` and the parameters of a function."""
    hints = get_type_hints(getattr(makes, "__init__") if isinstance(makes, type) else makes)  # noqa: B009
    told = _of_other_names(makes) | described(makes.__doc__ or "")
    fields: dict[str, Any] = {}
    if kind:
        fields["kind"] = (Annotated[Literal[kind], Field(description=_first_sentence(makes))], kind)
    files = set()
    for name, parameter in inspect.signature(makes).parameters.items():
        if name in without:
            continue
        value = _value_of(hints.get(name, float | None))
        if value is File:
            files.add(name)
        required = parameter.default is parameter.empty
        kept: Any = Annotated[value, Field(description=told.get(name))]
        fields[name] = (kept, ...) if required else (kept | None, None)
    name = "".join(word.capitalize() for word in (kind or getattr(makes, "__name__", "part")).split("_"))
    made: type[Made] = create_model(name, __base__=Made, **fields)
    made.makes, made.files = staticmethod(makes), frozenset(files)
    return made


def _of_other_names(makes: Callable[..., Any]) -> dict[str, str]:
    """Explanation of each parameter that is another name of a field."""
    others = other_names(makes) if isinstance(makes, type) else {}
    return {name: f"Another name of {other.meaning}. [{unit_of(name)}]" for name, other in others.items()}


def _value_of(hint: Any) -> Any:
    """Type of the value in a file, for the type of a parameter."""
    options = [option for option in get_args(hint) if option is not type(None)]
    if any(get_origin(option) is Mapping for option in (hint, *options)):
        return dict[str, Text]
    if get_origin(hint) in (tuple, Sequence, list) or get_origin(hint) is Sequence:
        inner = options[0]
        return Outlines if get_origin(inner) and get_origin(get_args(inner)[0]) else _LISTS[inner]
    if options:  # a union: a file names what may be a path
        return File if Path in options else _value_of(options[0])
    return _VALUES[hint]


def described(docstring: str) -> dict[str, str]:
    """Explanation of each parameter in a docstring of NumPy's style."""
    section = re.search(r"\n *Parameters\n *-+\n(.*?)(\n\n|\Z)", inspect.cleandoc(docstring) + "\n\n", re.S)
    found: dict[str, str] = {}
    for entry in re.split(r"\n(?=\S)", section[1] if section else ""):
        names, _, text = entry.partition("\n")
        for name in names.partition(" :")[0].split(","):
            found[name.strip()] = " ".join(text.split())
    return found


def _first_sentence(makes: Callable[..., Any]) -> str:
    return (makes.__doc__ or "").strip().partition("\n")[0]


@dataclass(frozen=True)
class LateKind:
    """Part of one kind, made when it is first needed: a file of spheres does not load braille."""

    kind: str
    """Value of the key `kind`."""
    makes: Callable[..., Any] | str
    """As of `made_by`, or its public name."""
    without: Sequence[str] = ()
    """As of `made_by`."""

    @cached_property
    def part(self) -> type[Made]:
        makes = getattr(import_module("fingerpad"), self.makes) if isinstance(self.makes, str) else self.makes
        return made_by(self.kind, makes, self.without)

    def __get_pydantic_core_schema__(self, *_: Any) -> CoreSchema:
        return core_schema.no_info_plain_validator_function(
            lambda value: self.part.model_validate(value),
            serialization=core_schema.plain_serializer_function_ser_schema(lambda made: made.model_dump()),
        )

    def __get_pydantic_json_schema__(self, core: CoreSchema, handler: GetJsonSchemaHandler) -> JsonSchema:
        return handler(self.part.__pydantic_core_schema__)


def one_of_kinds(
    makers: Mapping[str, Callable[..., Any] | str],
    default: str | None = None,
    text: Any = None,
    without: Mapping[str, Sequence[str]] = MappingProxyType({}),
) -> Any:
    """Type of a value that is one of several parts, by its key `kind`."""

    def tag(value: Any) -> str:
        if isinstance(value, Part):
            return form_of(str(getattr(value, "kind", default)))
        if isinstance(value, Mapping):
            kind = value.get("kind", default)
            return form_of(kind) if isinstance(kind, str) and kind in makers else UNKNOWN
        return NAMED if isinstance(value, str) and text is not None else UNKNOWN

    # Named after its kinds: two models of one name would get longer names in a schema.
    unknown = create_model(
        f"{UNKNOWN_MODEL}{'_'.join(makers)}",
        __base__=Part,
        kind=(Annotated[str, choice_of(tuple(makers))], ...),
    )
    tagged: list[Any] = [
        Annotated[Any, LateKind(kind, makes, without.get(kind, ())), Tag(form_of(kind))]
        for kind, makes in makers.items()
    ]
    if text is not None:
        tagged.append(Annotated[text, Tag(NAMED)])
    tagged.append(Annotated[unknown, Tag(UNKNOWN)])
    return Annotated[Union[tuple(tagged)], Discriminator(tag)]  # noqa: UP007
