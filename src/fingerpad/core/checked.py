"""Values and functions that keep to their annotations: decorators of what users call.

pydantic reads the annotations, whose types are in `core/values`; each refusal becomes an `InputError`.
"""

from __future__ import annotations

import inspect
from collections.abc import Callable, Iterable, Iterator, Mapping, Sequence
from dataclasses import MISSING, field, fields
from functools import partial, wraps
from inspect import Parameter, Signature
from itertools import takewhile
from pathlib import Path
from types import FunctionType, MappingProxyType, NoneType, UnionType
from typing import (
    TYPE_CHECKING,
    Annotated,
    Any,
    ParamSpec,
    TypeVar,
    Union,
    dataclass_transform,
    get_args,
    get_origin,
    overload,
)

from fingerpad.core.errors import InputError, Place, did_you_mean, named, shown

if TYPE_CHECKING:  # the command line starts without pydantic
    from pydantic import ValidationError

_Given = ParamSpec("_Given")
_Made = TypeVar("_Made")
_Kind = TypeVar("_Kind")

_EXPECTED = {
    "string_type": "must be a text",
    "bool_type": "must be true or false",
    "tuple_type": "must be a list",
    "list_type": "must be a list",
    "callable_type": "must be a function",
    "model_type": "must be a mapping of keys to values",
    "mapping_type": "must be a mapping of keys to values",
    "dict_type": "must be a mapping of keys to values",
    "too_short": "must have at least one entry",
    "invalid_key": "must have texts as keys",
    "is_instance_of": "must be of type {class}",
    "dataclass_type": "must be of type {class_name}",
    "dataclass_exact_type": "must be of type {class_name}",
}
"""What must be, by pydantic's name of an error; any other error keeps pydantic's words."""

_MISSING = ("missing", "missing_argument", "missing_keyword_only_argument")
_UNKNOWN = ("unexpected_keyword_argument", "extra_forbidden", "invalid_key")
_INSTANCES = ("is_instance_of", "dataclass_type", "dataclass_exact_type")
_CALLS = {
    "unexpected_positional_argument": "too many arguments",
    "multiple_argument_values": "multiple values for argument {!r}",
}


def other_name(
    meaning: str | Callable[..., Mapping[str, float]],
    read: Callable[[Any], float] | None = None,
    *,
    default: None = None,
    kw_only: bool = True,
) -> Any:
    """Make an `OtherName` that type checkers know, too; they need `default` and `kw_only` in the call."""
    return OtherName(meaning, read)


@overload
def value_class(kind: type[_Kind]) -> type[_Kind]: ...
@overload
def value_class(*, eq: bool) -> Callable[[type[_Kind]], type[_Kind]]: ...
@dataclass_transform(frozen_default=True, field_specifiers=(field, other_name))
def value_class(kind: Any = None, *, eq: bool = True) -> Any:
    """Make a class a frozen dataclass whose fields hold what their annotations say.

    A field may keep its default, whatever that is. Limits of several fields together are left to
    `__post_init__`. Each `OtherName` of the class is a keyword, too.
    """
    return partial(_frozen, strict=True, eq=eq) if kind is None else _frozen(kind, strict=True, eq=eq)


@dataclass_transform(frozen_default=True, kw_only_default=True, field_specifiers=(field,))
def result_class(kind: type[_Kind]) -> type[_Kind]:
    """Make a class a frozen dataclass with named fields, which `core/result_files` writes and reads."""
    return _frozen(kind, strict=False, kw_only=True)


def _frozen(kind: type[_Kind], strict: bool, **options: bool) -> type[_Kind]:
    from pydantic import ConfigDict
    from pydantic.dataclasses import dataclass

    for name in other_names(kind):  # are no fields
        vars(kind).get("__annotations__", {}).pop(name, None)
    config = ConfigDict(arbitrary_types_allowed=True, strict=strict, extra="forbid")
    made: Any = dataclass(frozen=True, config=config, **options)(kind)  # type: ignore[call-overload]
    return checked_class(made)


def checked(function: Callable[_Given, _Made]) -> Callable[_Given, _Made]:
    """Make a function check and convert its arguments as they are annotated, before it begins."""
    call: Callable[..., _Made] | None = None

    @wraps(function)
    def checking(*args: _Given.args, **given: _Given.kwargs) -> _Made:
        nonlocal call
        if call is None:
            call = _validated(function)
        try:
            return call(*args, **given)
        except _refusal() as error:
            owner = function.__qualname__.rpartition("<locals>.")[2]
            raise _in_one_sentence(error, owner, inspect.signature(function).parameters.values()) from None

    return checking


def checked_class(kind: type[_Kind]) -> type[_Kind]:
    """Make a class and its public methods check their arguments, as `checked` does for a function."""
    for name, member in list(vars(kind).items()):
        function = getattr(member, "__func__", member)
        if not isinstance(function, FunctionType) or hasattr(function, "__wrapped__"):
            continue
        if name == "__init__":
            setattr(kind, name, _init_of(kind, function))
        elif not name.startswith("_") and not isinstance(member, staticmethod):
            made = checked(function)
            setattr(kind, name, classmethod(made) if isinstance(member, classmethod) else made)
    return kind


def _init_of(kind: Any, init: FunctionType) -> Callable[..., None]:
    """`__init__` of a class, which also takes its other names."""
    call: Callable[..., None] = init
    if "__pydantic_fields__" in vars(kind):
        parts = _parts_of(kind)
        kind.__signature__ = Signature(parts)
        init.__annotations__ = {part.name: part.annotation for part in parts}
    else:
        parts, call = list(inspect.signature(init).parameters.values()), _validated(init)
    others = other_names(kind)

    @wraps(init)
    def __init__(self: Any, *args: Any, **given: Any) -> None:
        spelled = {name: others[name] for name in given if name in others}
        try:
            call(self, *args, **(_by_fields(spelled, given, parts[: len(args)]) if spelled else given))
        except _refusal() as error:
            said = _in_one_sentence(error, kind.__name__, parts, getattr(kind, "keywords_of_others", {}))
            raise _as_given(spelled, said) from None

    return __init__


def _parts_of(kind: Any) -> list[Parameter]:
    """Parameters of a value: its fields, then its other names; what editors show."""
    parts = [
        Parameter(
            part.name,
            Parameter.KEYWORD_ONLY if part.kw_only else Parameter.POSITIONAL_OR_KEYWORD,
            default=Parameter.empty if part.default is part.default_factory is MISSING else part.default,
            annotation=part.type,
        )
        for part in fields(kind)
        if part.init
    ]
    parts += [
        Parameter(name, Parameter.KEYWORD_ONLY, default=None)
        for name in other_names(kind)
        if name not in {part.name for part in parts}
    ]
    return sorted(parts, key=lambda part: part.kind)


def _refusal() -> type[ValidationError]:
    from pydantic import ValidationError

    return ValidationError


def _validated(function: Callable[..., _Made]) -> Callable[..., _Made]:
    """Put pydantic's check of its arguments before a function."""
    from pydantic import ConfigDict, validate_call

    closed, defaults = function.__closure__, function.__defaults__
    same = FunctionType(function.__code__, function.__globals__, function.__name__, defaults, closed)
    same.__kwdefaults__, same.__qualname__ = function.__kwdefaults__, function.__qualname__
    same.__dict__.update({name: value for name, value in vars(function).items() if name == "__signature__"})
    hints = hints_of(function)
    same.__annotations__ = {name: _path_or(hints[name]) for name in hints if name != "return"}
    return validate_call(config=ConfigDict(arbitrary_types_allowed=True, strict=True))(same)


def hints_of(makes: Callable[..., Any]) -> dict[str, Any]:
    """Return the evaluated annotation of each parameter of a value or a function."""
    from fingerpad.core.values import AnyArray, Finite

    if isinstance(makes, type):
        given: Any = makes.__pydantic_fields__  # type: ignore[attr-defined]
        found = {name: part.rebuild_annotation() for name, part in given.items()}
        return dict.fromkeys(other_names(makes), Finite) | found
    function = inspect.unwrap(makes)
    unchecked = {"FloatArray": AnyArray, "ArrayLike": Any, "Sequence": _SequenceOf}
    unchecked |= {"Iterable": _Unchecked, "Iterator": _Unchecked}
    known, hints = function.__globals__, function.__annotations__
    return {name: _hint(text, known, unchecked) for name, text in hints.items()}


def _hint(text: Any, known: dict[str, object], unchecked: Mapping[str, object]) -> Any:
    """Annotation as pydantic can check it; `Any` for what the function itself converts or consumes."""
    from fingerpad.core.values import Check, like

    try:
        hint = eval(text, known, unchecked) if isinstance(text, str) else text
    except NameError:  # a type that only type checkers import
        return Any
    if getattr(hint, "_is_protocol", False):
        return Annotated[Any, Check(partial(like, kind=hint), {})]
    return hint


class _Unchecked:
    """Stands for a generic type that pydantic would consume."""

    def __class_getitem__(cls, _: Any) -> Any:
        return Any


class _SequenceOf:
    """Stands for `Sequence`: one of numbers may be an array."""

    def __class_getitem__(cls, entry: Any) -> Any:
        from fingerpad.core.values import Numbers

        return Numbers if entry is float else Sequence[entry]


def _path_or(hint: Any) -> Any:
    """Annotation of a path, which may be given as a text; any other as it is."""
    from fingerpad.core.values import AnyPath

    kinds = get_args(hint) if get_origin(hint) in (Union, UnionType) else (hint,)
    if Path not in kinds or not all(kind in (str, Path, NoneType) for kind in kinds):
        return hint
    return AnyPath | None if NoneType in kinds else AnyPath


def _in_one_sentence(
    error: ValidationError,
    owner: str,
    parts: Iterable[Parameter],
    elsewhere: Mapping[str, str] = MappingProxyType({}),
) -> Exception:
    """Say what pydantic refused first as an `InputError`."""
    if error.title.rpartition("<locals>.")[2].removesuffix(".__init__") != owner:  # something called within
        return error
    entries, known = error.errors(include_url=False), [*parts]
    first = first_of(entries)
    path = _path_of(first["loc"], [part.name for part in known])
    known = [part for part in known if part.name not in ("self", "cls")]
    if len(path) != 1:
        return in_words(first, path, named(path))
    name = str(path[0])
    if first["type"] in _MISSING:
        absent = [str(each["loc"][0]) for each in entries if each["type"] in _MISSING]
        are = "it is" if len(absent) == 1 else "they are"
        return InputError(owner, f"needs {', '.join(absent)}", remedy=f"{are} not given")
    if first["type"] in _UNKNOWN:
        hint = did_you_mean(name, [part.name for part in known], owner)
        hint = f"take {elsewhere[name]}." if name in elsewhere else hint
        return InputError(name, f"is no argument of {owner}", remedy=hint)
    if first["type"] in _CALLS:
        takes = ", ".join(part.name + "=" * (part.kind is part.KEYWORD_ONLY) for part in known)
        return InputError(
            f"{owner} takes {takes or 'no argument'}: got {_CALLS[first['type']].format(name)}."
        )
    return in_words(first, path, named(path))


class UnknownKey(ValueError):
    """A key that a part does not have, and those that it has."""

    def __init__(self, key: str, known: Sequence[str]):
        super().__init__("is unknown")  # without the key: pydantic cannot encode any text
        self.key, self.known = key, known


def raised_in(entry: Any) -> Exception | None:
    """Return what a check raised, if that is why pydantic refused a value."""
    found: Exception | None = entry.get("ctx", {}).get("error")
    return found


def first_of(entries: Sequence[Any]) -> Any:
    """First error of pydantic that matters: the kind, an unknown key, a wrong value, a missing key."""

    def order(each: Any) -> int:
        if each["loc"][-1:] == ("kind",):
            return 0
        if each["type"] in _UNKNOWN or isinstance(raised_in(each), UnknownKey):
            return 1
        return 3 if each["type"] in _MISSING else 2

    return min(entries, key=order)


def in_words(entry: Any, path: Place, words: str) -> InputError:
    """One error of pydantic about the value at a path, which `words` spell."""
    raised, value = raised_in(entry), entry["input"]
    if isinstance(raised, InputError):
        if not raised.path or not path:
            return raised
        within = raised.path[1:] if raised.path[0] == path[-1] else raised.path
        said = InputError(path, raised.expected, raised.got, raised.remedy)
        beyond = f"{'.' * isinstance(within[0], str)}{named(within)}" if within else ""
        return said.at((*path, *within), words + beyond, in_file=False)
    expected = _EXPECTED.get(entry["type"], entry["msg"]).format(**entry.get("ctx", {}))
    kind = entry["type"] in _INSTANCES and isinstance(value, type) and expected.rpartition(" ")[2]
    if kind and kind in (each.__name__ for each in value.__mro__):
        expected, came = "must be made from its class", f"{value.__name__}, call it: {value.__name__}()"
    else:
        came = shown(value)
    return InputError(path, expected, came).at(path, words, in_file=False)


def _path_of(loc: tuple[int | str, ...], names: Sequence[str]) -> Place:
    """Argument and indices that lead to a value, without the forms of a union."""
    if not loc:
        return ()
    first = names[loc[0]] if isinstance(loc[0], int) and loc[0] < len(names) else loc[0]
    return first, *takewhile(lambda part: isinstance(part, int), loc[1:])


class OtherName:
    """A size under another name than its field: a class takes it as a keyword, an instance has it."""

    def __init__(
        self, meaning: str | Callable[..., Mapping[str, float]], read: Callable[[Any], float] | None = None
    ):
        self.meaning, self.read = meaning, read

    def __get__(self, instance: Any, owner: type | None = None) -> Any:
        """Value of an instance; this object from the class."""
        if instance is None:
            return self
        return getattr(instance, str(self.meaning)) if self.read is None else self.read(instance)


def other_names(kind: type) -> dict[str, OtherName]:
    """Return the other names of a class, inherited ones included."""
    found = {name: part for home in reversed(kind.__mro__) for name, part in vars(home).items()}
    return {name: part for name, part in found.items() if isinstance(part, OtherName)}


def _by_fields(
    spelled: Mapping[str, OtherName], given: Mapping[str, Any], before: Sequence[Parameter]
) -> Mapping[str, Any]:
    """Arguments by their fields, where some were given under other names."""
    made = {name: value for name, value in given.items() if name not in spelled}
    taken = {part.name: part.name for part in before} | {name: name for name in made}
    for names, values in _meanings(spelled, given):
        for name in values:
            if name in taken:
                raise InputError(f"{' and '.join(names)} and {taken[name]} exclude each other: give one.")
            taken[name] = names[0]
        made |= values
    return made


def _meanings(
    spelled: Mapping[str, OtherName], given: Mapping[str, Any]
) -> Iterator[tuple[list[str], Mapping[str, Any]]]:
    """Other names that were given, those of one function together, and the fields that they mean."""
    for name, other in spelled.items():
        if isinstance(other.meaning, str):
            yield [name], {other.meaning: given[name]}
    for meaning in dict.fromkeys(other.meaning for other in spelled.values()):
        names = [name for name, other in spelled.items() if other.meaning is meaning]
        if not isinstance(meaning, str):
            yield names, meaning(**{name: given[name] for name in names})


def _as_given(spelled: Mapping[str, OtherName], error: Exception) -> Exception:
    """Name what was given in the place of the field that it is."""
    for name, other in spelled.items():
        if isinstance(error, InputError) and error.path[:1] == (other.meaning,):
            return InputError(name, error.expected, error.got, error.remedy)
    return error
