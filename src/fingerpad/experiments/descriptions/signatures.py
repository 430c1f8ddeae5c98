"""Parts whose keys are the parameters of a function or the fields of a value: objects, fingers and motions.

A part has the same names, types, defaults and explanations in a file as its function has in Python.
"""

from __future__ import annotations

import inspect
from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass
from functools import cached_property
from importlib import import_module
from pathlib import Path
from types import MappingProxyType
from typing import Annotated, Any, ClassVar, Literal, Union, get_args

from pydantic import Discriminator, GetJsonSchemaHandler, Tag, create_model
from pydantic_core import CoreSchema, core_schema

from fingerpad.core.checked import hints_of
from fingerpad.core.values import JsonSchema, Text, choice
from fingerpad.experiments.descriptions.values import NAMED, UNKNOWN, Part, form_of

UNKNOWN_MODEL = "Unknown_"
"""Beginning of the name of a part that only serves the error of an unknown kind."""

File = Annotated[Text, "file"]
"""Name of a file, from the folder of the description."""


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
    fields: dict[str, Any] = {"kind": (Literal[kind], kind)} if kind else {}
    files, hints = set(), hints_of(makes)
    for name, parameter in inspect.signature(makes).parameters.items():
        if name in without:
            continue
        hint = hints[name]
        if hint is Path or Path in get_args(hint):  # a file names what may be a path
            files.add(name)
            hint = File
        needed = parameter.default is parameter.empty
        fields[name] = (hint, ...) if needed else (hint | None, None)
    name = "".join(word.capitalize() for word in (kind or getattr(makes, "__name__", "part")).split("_"))
    made: type[Made] = create_model(name, __base__=Made, **fields)
    made.makes, made.files = staticmethod(makes), frozenset(files)
    return made


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
        f"{UNKNOWN_MODEL}{'_'.join(makers)}", __base__=Part, kind=(Annotated[str, choice(makers)], ...)
    )
    tagged: list[Any] = [
        Annotated[Any, LateKind(kind, makes, without.get(kind, ())), Tag(form_of(kind))]
        for kind, makes in makers.items()
    ]
    if text is not None:
        tagged.append(Annotated[text, Tag(NAMED)])
    tagged.append(Annotated[unknown, Tag(UNKNOWN)])
    return Annotated[Union[tuple(tagged)], Discriminator(tag)]  # noqa: UP007
