"""Parts of requests: what a file, a call and a command have in common, and the errors of reading them.

A part is a pydantic model. Objects, fingers and motions have a `kind` and the parameters of what it names:
the same names, types, defaults and explanations as the function or class has in Python. An object of Python
may stand wherever a file has a name or a block.
"""

from __future__ import annotations

import hashlib
import importlib
import inspect
import re
import sys
from collections.abc import Callable, Iterator, Mapping, Sequence
from contextlib import contextmanager
from dataclasses import dataclass, field, is_dataclass, replace
from functools import cache, partial
from pathlib import Path
from pkgutil import resolve_name
from types import MappingProxyType
from typing import Annotated, Any, ClassVar, Literal, TypeVar, get_args

from pydantic import (
    BaseModel,
    ConfigDict,
    Field,
    GetJsonSchemaHandler,
    PrivateAttr,
    SerializerFunctionWrapHandler,
    ValidationError,
    ValidationInfo,
    WrapValidator,
    create_model,
    model_serializer,
    model_validator,
)
from pydantic_core import CoreSchema

from fingerpad.core.checked import UnknownKey, first_of, hints_of, in_words, raised_in
from fingerpad.core.errors import InputError, Place, did_you_mean, shown, spelled
from fingerpad.core.files import path_of, read_text
from fingerpad.core.plain_yaml import line_at, read_yaml
from fingerpad.core.values import Check, JsonSchema, Text, instance, like, one_of, text

_FORM = "form "
LISTED, VARIED, NAMED, SPELLED, OBJECT = (
    f"{_FORM}{form}" for form in ("listed", "varied", "named", "spelled", "object")
)  # Forms that a value may have; pydantic puts them into the places of errors.


def with_message(words: str) -> WrapValidator:
    """Give a value of several types one message for any error: what it must be."""

    def validated(value: Any, handler: Callable[[Any], Any], info: ValidationInfo) -> Any:
        try:
            return handler(value)
        except ValidationError as error:
            raise InputError(info.field_name or "value", f"must be {words}", shown(value)) from error

    return WrapValidator(validated)


Content = Mapping[str, Any]  # Keys and values of a description, as its file holds them.
Block = Annotated[dict[str, Any], with_message("a mapping of keys to values")]
"""Keys and values that are checked once it is known what they belong to."""
BlockOrObject = Annotated[
    Any,
    Check(
        lambda name, value: value,
        {"anyOf": [{"type": "object"}, {"type": "string"}, {"type": "null"}]},
        lambda value: value if isinstance(value, dict | str | None) else repr(value),
    ),
]  # A block, a text, or an object of Python, checked once it is known what it belongs to.
LevelOrName = Annotated[float | str, Field(union_mode="left_to_right"), with_message("a number or a name")]


def as_list(value: Any) -> Any:
    """Return a list of one for a single name."""
    return [value] if isinstance(value, str) else value


class Part(BaseModel):
    """Base of all parts: unknown keys are refused, values are frozen."""

    model_config = ConfigDict(extra="forbid", frozen=True, strict=True)

    @model_validator(mode="before")
    @classmethod
    def _known(cls, content: Any) -> Any:
        """Refuse an unknown key here, where the known ones are: pydantic does not tell them."""
        for key in content if isinstance(content, Mapping) else ():
            if isinstance(key, str) and key not in cls.model_fields:
                raise UnknownKey(key, [*cls.model_fields])
        return content

    @model_serializer(mode="wrap")
    def _as_written(self, dump: SerializerFunctionWrapHandler):  # type: ignore[no-untyped-def]
        """Leave defaults out of files: a default is not always a value that the file may give."""
        return {name: value for name, value in dump(self).items() if name in self.model_fields_set}

    @property
    def given(self) -> Content:
        """The values in the file, without defaults."""
        return self.chosen(*type(self).model_fields)

    @property
    def set_in_order(self) -> Content:
        """The fields that were given, null too, in the order of the class: that of a set differs each run."""
        names = (name for name in type(self).model_fields if name in self.model_fields_set)
        return {name: getattr(self, name) for name in names}

    def chosen(self, *names: str) -> Content:
        """Those of the names that the file gives a value, and not null, with that value."""
        values = {name: getattr(self, name) for name in names if name in self.model_fields_set}
        return {name: value for name, value in values.items() if value is not None}


_PLAIN = (bool, int, float, list, tuple, type(None))  # What a file may have in the place of a block.

File = Annotated[Text, "file"]  # Name of a file, from the folder of the description.


class Made(Part):
    """Part that a function makes from its keys."""

    makes: ClassVar[Callable[..., Any]]
    files: ClassVar[frozenset[str]]  #: Keys that name files.

    def made(self, beside: Path = Path()) -> Any:
        """Return what the function makes."""
        given = {key: value for key, value in self.given.items() if key != "kind"}
        named = {key: beside / value for key, value in given.items() if key in self.files}
        return type(self).makes(**given | named)


def made_by(kind: str, makes: Callable[..., Any], without: Sequence[str] = ()) -> type[Made]:
    """Make the part whose keys are `kind` and the parameters of a function."""
    fields: dict[str, Any] = {"kind": (Literal[kind], kind)}
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
    name = "".join(word.capitalize() for word in kind.split("_"))
    made: type[Made] = create_model(name, __base__=Made, **fields)
    made.makes, made.files = staticmethod(makes), frozenset(files)
    return made


def object_of_python(kind: type) -> Any:
    """Type of an object of Python, which a file names as module:object and results show as it is written."""
    return Annotated[Any, Check(partial(like_or_made, kind=kind), {"type": "string"}, repr)]


def like_or_made(name: str, value: Any, kind: type) -> Any:
    """Return an object that is of a class, or like a protocol."""
    if getattr(kind, "_is_protocol", False):
        return like(name, value, kind)
    return instance(name, value, kind)


@dataclass(frozen=True, eq=False)
class OneOfKinds:
    """Type of a value that is one of several parts, by its key `kind`, or an object of Python.

    The part of a kind is made when it is first needed: a file of spheres does not load braille.
    """

    makers: Mapping[str, Callable[..., Any] | str]  #: As of `made_by`, or its name below `fingerpad`.
    instance: type  #: Class of an object of Python.
    default: str | None = None  #: Kind of a block without one.
    named: bool = False  #: Whether a text may stand in the place of a block.
    without: Mapping[str, Sequence[str]] = field(default_factory=dict)  #: As of `made_by`, by kind.

    @cache  # noqa: B019 - the few of the package live as long as it
    def part(self, kind: str) -> type[Made]:
        makes = self.makers[kind]
        makes = resolve_name(f"fingerpad.{makes}") if isinstance(makes, str) else makes
        return made_by(kind, makes, self.without.get(kind, ()))

    def __call__(self, name: str, value: Any) -> Any:
        if isinstance(value, Part):
            return value
        if isinstance(value, str) and self.named:
            return text(name, value)
        if isinstance(value, (str, *_PLAIN)):
            raise InputError(name, "must be a mapping of keys to values", shown(value))
        if not isinstance(value, Mapping):
            return like_or_made(name, value, self.instance)
        if self.default is None and "kind" not in value:
            raise InputError(("kind",), "must be given", remedy="it is missing")
        kind = one_of("kind", value.get("kind", self.default), self.makers)
        return self.part(kind).model_validate(value)

    def __get_pydantic_core_schema__(self, *_: Any) -> CoreSchema:
        return Check(self, {}, as_written).__get_pydantic_core_schema__()

    def __get_pydantic_json_schema__(self, core: CoreSchema, handler: GetJsonSchemaHandler) -> JsonSchema:
        parts = [handler(self.part(kind).__pydantic_core_schema__) for kind in self.makers]
        texts: list[JsonSchema] = [{"type": "string", "minLength": 1}] * self.named
        return {"anyOf": [*parts, *texts, {"type": "string"}]}


def as_written(value: Any) -> Any:
    """Return the keys of a part; an object of Python as it is shown."""
    if isinstance(value, Part):
        return value.model_dump()
    return value if isinstance(value, str | Mapping) else repr(value)  # a default is not made yet


_Kind = TypeVar("_Kind", bound=Part)
_Request = TypeVar("_Request", bound="Request")


@dataclass(frozen=True)
class Origin:
    r"""Where a description comes from: errors begin with its name and line."""

    name: str  #: Of the file: files that it names are searched beside it.
    text: str = ""  #: Its content in YAML, for lines; empty where there is none.
    rows: tuple[int, ...] = ()  #: Lines of the entries of `stimuli` in a table.
    replaced: tuple[Place, ...] = ()  #: Places of values that a keyword or an option gives, and not the file.

    @property
    def beside(self) -> Path:
        """Folder from which files are named."""
        return Path(self.name).parent

    def hashes(self, files: Sequence[Path]) -> dict[str, str]:
        """SHA-256 of the file, if the request is from one, and of the files that it names, by name."""
        contents = {self.name: self.text.encode()} if self.text else {}
        contents |= {str(path): path.read_bytes() for path in files}
        return {name: hashlib.sha256(content).hexdigest() for name, content in contents.items()}

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
        if self.text and any(place[: len(each)] == each for each in self.replaced):
            return "", words
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
        raise input_error(error) from error


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
    if is_dataclass(common) and isinstance(own, Mapping) and "kind" not in own:
        return replace(common, **own)  # type: ignore[type-var]
    if not isinstance(common, Mapping) or not isinstance(own, Mapping):
        return own
    kind = common.get("kind", default_kind)
    return {**common, **own} if own.get("kind", kind) == kind else own


def input_error(error: ValidationError) -> InputError:
    """Make the first error that pydantic found one of the package."""
    first = first_of(error.errors(include_url=False))
    path = tuple(part for part in first["loc"] if not str(part).startswith(_FORM))
    if first["type"] == "missing":
        found = InputError(path, "must be given", remedy="it is missing")
    elif isinstance(unknown := raised_in(first), UnknownKey):
        remedy = did_you_mean(unknown.key, unknown.known, spelled(path))
        found = InputError((*path, unknown.key), "is unknown", remedy=remedy)
    elif first["input"] is None and not path:
        found = InputError(path, "must be a mapping of keys to values", remedy="it is empty")
    else:
        found = in_words(first, path, spelled(path))
    return found.at(found.path)


OBJECT_NAME = re.compile(r"[A-Za-z_]\w*:[A-Za-z_]\w*")
"""How a file names an object of Python: a module beside it, and a name in this module."""


class Request(Part):
    """Base of requests: a part that is the whole of a file, a call or a command."""

    _origin: Origin = PrivateAttr(default=Origin("request"))
    _allow_python: bool = PrivateAttr(default=False)

    word: ClassVar[str] = "request"  #: What an error calls a request that is from no file.
    python: ClassVar[tuple[str, ...]] = ()  #: Keys at which a file may name an object of Python.
    main: ClassVar[str] = ""  #: Key that a source means which is no description, as a table of recordings.

    def __eq__(self, other: object) -> bool:
        """Compare values alone: where a request comes from does not matter."""
        fields = type(self).model_fields
        return type(self) is type(other) and all(getattr(self, key) == getattr(other, key) for key in fields)

    @property
    def origin(self) -> Origin:
        """Where it comes from, for errors; files that it names are searched beside."""
        return self._origin

    @property
    def beside(self) -> Path:
        """Folder from which files are named."""
        return self._origin.beside

    def check(self) -> None:
        """Raise `InputError` if the request is impossible; before anything is solved."""

    def changed(self: _Request, **values: Any) -> _Request:
        """Return the same request with other values of some fields."""
        made = self.model_copy(update=values)
        for name in set(made.__dict__) - set(type(self).model_fields):
            del made.__dict__[name]  # what a cached property of the former request holds
        return made

    @classmethod
    def read(
        cls: type[_Request],
        source: Any = None,
        given: Mapping[str, Any] = MappingProxyType({}),
        allow_python: bool = False,
        text: str | None = None,
        name: str = "",
    ) -> _Request:
        """Make a request from a file, a mapping or a request, with keys that replace some of it.

        Parameters
        ----------
        source : str, Path, mapping or Request, optional
            A YAML file, its content, or a request; by default there is nothing but what is given.
        given : mapping
            Values by key; a key within a block is written "motion.depth_mm".
        allow_python : bool, optional
            Whether a file may name objects of Python as module:object, from a module beside it.
        text : str, optional
            Content of the file, if it is known.
        name : str, optional
            What errors call a mapping.
        """
        given = {key: value for key, value in given.items() if value is not None}
        described = (cls, Mapping, *_PLAIN)
        is_file = isinstance(source, str | Path) and Path(source).suffix in (".yaml", ".yml")
        if cls.main and not is_file and text is None and not isinstance(source, described):
            source, given = None, {cls.main: source} | given
        if isinstance(source, cls) and not given:
            return source
        origin = Origin(name or cls.word)
        if isinstance(source, cls):
            content: Any = source.set_in_order
            origin = source.origin
        elif isinstance(source, str | Path):
            text = read_text(path_of("source", source)) if text is None else text
            content, origin = read_yaml(text, str(source)), Origin(str(source), text)
        else:
            content = {} if source is None else source
        origin = replace(origin, replaced=tuple(tuple(key.split(".")) for key in given))
        with origin.located():
            if content is None:
                raise InputError(
                    "the file is empty: write what is pressed, as the example of `fingerpad init`."
                )
            if isinstance(content, Mapping):
                content = cls.named_objects(content, origin.beside, allow_python)
                for key, value in given.items():
                    content = with_value(content, key.split("."), value)
            made = part_from(cls, content)
        made._origin, made._allow_python = origin, allow_python
        return made

    @classmethod
    def named_objects(cls, content: Mapping[str, Any], beside: Path, allow_python: bool) -> Content:
        """Return the content of a file with the objects of Python that it names."""
        found = dict(content)
        for key in cls.python:
            first, *rest = key.split(".")
            value = found.get(first)
            if rest and isinstance(value, Mapping) and isinstance(value.get(rest[0]), str):
                named = _object_named(value[rest[0]], (first, *rest), beside, allow_python)
                found[first] = {**value, rest[0]: named}
            elif not rest and isinstance(value, str):
                found[first] = _object_named(value, (first,), beside, allow_python)
        return found


def _object_named(text: str, place: Place, beside: Path, allow_python: bool) -> Any:
    """Return the object that a text names as module:object; any other text as it is."""
    module, _, name = text.partition(":")
    file = (beside / f"{module}.py").resolve()
    if not OBJECT_NAME.fullmatch(text) or not file.is_file():
        return text
    if not allow_python:
        raise InputError(
            place, f"names an object of {file.name}, which runs with your rights", repr(text),
            "allow it by --allow-python or allow_python=True, or leave it out",
        )  # fmt: skip
    if str(file.parent) not in sys.path:  # processes that press find the module there, too
        sys.path.append(str(file.parent))
    importlib.invalidate_caches()
    try:
        known = importlib.import_module(module)
    except Exception as error:
        raise InputError(place, f"{file.name} cannot be run ({error!r})") from error
    if Path(getattr(known, "__file__", None) or "").resolve() != file:
        raise InputError(place, f"must be of a module that has a name of its own: {module} is another one")
    if not hasattr(known, name):
        raise InputError(place, f"must be an object of {file.name}", repr(name))
    return getattr(known, name)


def with_value(content: Mapping[str, Any], keys: Sequence[str], value: Any) -> Content:
    """Return the content with another value at a place; a text such as `sphere` is a block of that kind."""
    first, *rest = keys
    if not rest:
        return {**content, first: value}
    inner = content.get(first, {})
    if isinstance(inner, str) and ":" not in inner:
        inner = {"kind": inner}
    if is_dataclass(inner) and not isinstance(inner, type):
        return {**content, first: replace(inner, **with_value({}, rest, value))}
    if isinstance(inner, Part):
        inner = inner.given
    if not isinstance(inner, Mapping):
        raise InputError(
            first, f"must be a mapping of keys to values, so that {rest[0]} can be given", repr(inner)
        )
    return {**content, first: with_value(inner, rest, value)}
