"""Keywords of classes and functions: other names of a class's sizes, and "did you mean" for a wrong one."""

from __future__ import annotations

import inspect
from abc import ABCMeta
from collections.abc import Callable, Collection, Iterator, Mapping
from functools import wraps
from typing import Any, ParamSpec, TypeVar
from weakref import WeakKeyDictionary

from fingerpad.core.errors import InputError, did_you_mean

_Given = ParamSpec("_Given")
_Made = TypeVar("_Made")

_RECEIVERS = ("cls", "self")  # Parameters that no caller gives.

_OF_PYTHON = (TypeError, AttributeError, LookupError, ValueError)
"""Errors in which an argument of a wrong type ends where nothing checks it."""


def known_keywords(function: Callable[_Given, _Made]) -> Callable[_Given, _Made]:
    """Make a function raise `InputError` for a keyword that it does not have, and for an argument too few.

    Arguments of other types than annotated are named where the call fails by one of Python's own errors.
    """
    signature = inspect.signature(function)
    names = tuple(name for name in signature.parameters if name not in _RECEIVERS)
    takes_any = any(part.kind is part.VAR_KEYWORD for part in signature.parameters.values())
    owner = function.__qualname__.rpartition("<locals>.")[2]

    @wraps(function)
    def checked(*args: _Given.args, **given: _Given.kwargs) -> _Made:
        if not takes_any:
            _refuse_unknown(given, names, owner)
        try:
            return function(*args, **given)
        except InputError:
            raise
        except _OF_PYTHON:
            _refuse_misfit(signature, args, given, owner)
            _refuse_mistyped(function, signature, args, given)
            raise

    return checked


def check_methods(kind: type) -> None:
    """Make the public methods of a class of this package refuse wrong arguments, as `known_keywords` does."""
    if not kind.__module__.startswith("fingerpad."):
        return
    for name, member in list(vars(kind).items()):
        function = getattr(member, "__func__", member)
        if name.startswith("_") or not inspect.isfunction(function) or hasattr(function, "__wrapped__"):
            continue
        if isinstance(member, classmethod):
            setattr(kind, name, classmethod(known_keywords(function)))
        elif not isinstance(member, staticmethod):
            setattr(kind, name, known_keywords(function))


def _refuse_unknown(
    given: Collection[str], known: Collection[str], owner: str, elsewhere: Mapping[str, str] | None = None
) -> None:
    for name in given:
        if name not in known:
            other = (elsewhere or {}).get(name)
            hint = f"take {other}." if other else did_you_mean(name, known, owner)
            raise InputError(name, f"is no argument of {owner}", remedy=hint)


def _refuse_misfit(
    signature: inspect.Signature, args: tuple[Any, ...], given: Mapping[str, Any], owner: str
) -> None:
    """Raise `InputError` if a call gives too few arguments, too many, or one of them twice."""
    parts = {name: part for name, part in signature.parameters.items() if name not in _RECEIVERS}
    try:
        taken = signature.bind_partial(*args, **given).arguments
    except TypeError as error:
        named = (name + "=" * (part.kind is part.KEYWORD_ONLY) for name, part in parts.items())
        raise InputError(f"{owner} takes {', '.join(named) or 'no argument'}: got {error}.") from None
    needed = [
        name
        for name, part in parts.items()
        if part.default is part.empty and part.kind not in (part.VAR_POSITIONAL, part.VAR_KEYWORD)
    ]
    missing = [name for name in needed if name not in taken]
    if missing:
        are = "it is" if len(missing) == 1 else "they are"
        raise InputError(owner, f"needs {', '.join(missing)}", remedy=f"{are} not given") from None


def _refuse_mistyped(
    function: Callable[..., Any],
    signature: inspect.Signature,
    args: tuple[Any, ...],
    given: Mapping[str, Any],
) -> None:
    from fingerpad.core.values import refuse_mistyped  # only here: the command line starts without NumPy

    refuse_mistyped(function, signature.bind(*args, **given).arguments)


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
        if self.read is not None:
            return self.read(instance)
        return getattr(instance, str(self.meaning))


class KnownKeywords(ABCMeta):
    """Metaclass of classes that refuse wrong arguments with a hint, and take each `OtherName`."""

    keywords_of_others: Mapping[str, str] = {}
    """Classes that have a keyword which this one may be given, by the keyword."""

    def __init__(cls, *args: Any) -> None:
        super().__init__(*args)
        check_methods(cls)

    def __call__(cls, *args: Any, **given: Any) -> Any:
        """Make an instance from fields and other names."""
        if not given:
            return cls._of_fields(*args)
        fields, others = _fields(cls), other_names(cls)
        if not any(part.kind is part.VAR_KEYWORD for part in fields):
            names = [part.name for part in fields]
            known = [*names, *(name for name in others if name not in names)]
            _refuse_unknown(given, known, cls.__name__, cls.keywords_of_others)
        spelled = {name: others[name] for name in given if name in others}
        if not spelled:
            return cls._of_fields(*args, **given)
        made = {name: value for name, value in given.items() if name not in spelled}
        taken = {part.name: part.name for part in fields[: len(args)]} | dict.fromkeys(made, "")
        for names, values in _meanings(spelled, given):
            for name in values:
                if name in taken:
                    beside = taken[name] or name
                    raise InputError(f"{' and '.join(names)} and {beside} exclude each other: give one.")
                taken[name] = names[0]
            made |= values
        try:
            return cls._of_fields(*args, **made)
        except InputError as error:
            raise _in_words_of(spelled, error) from error

    def _of_fields(cls, *args: Any, **given: Any) -> Any:
        """Make an instance from its fields alone."""
        try:
            return super().__call__(*args, **given)
        except InputError:
            raise
        except _OF_PYTHON:
            _refuse_misfit(cls.__signature__, args, given, cls.__name__)
            _refuse_mistyped(cls.__init__, inspect.Signature(_fields(cls)), args, given)  # type: ignore[misc]
            raise

    @property
    def __signature__(cls) -> inspect.Signature:
        """Fields, then the other names as keywords: what editors show."""
        fields = _fields(cls)
        names = {part.name for part in fields}
        keyword = inspect.Parameter.KEYWORD_ONLY
        others = [
            inspect.Parameter(name, keyword, default=None) for name in other_names(cls) if name not in names
        ]
        rest = [part for part in fields if part.kind is part.VAR_KEYWORD]
        return inspect.Signature([*(part for part in fields if part not in rest), *others, *rest])


_FIELDS: WeakKeyDictionary[type, tuple[inspect.Parameter, ...]] = WeakKeyDictionary()


def _fields(kind: type) -> tuple[inspect.Parameter, ...]:
    """Parameters of the constructor of a class."""
    if kind not in _FIELDS:
        _FIELDS[kind] = tuple(inspect.signature(kind.__init__).parameters.values())[1:]  # type: ignore[misc]
    return _FIELDS[kind]


def other_names(kind: type) -> dict[str, OtherName]:
    """Return the other names of a class, inherited ones included."""
    found = {name: part for home in reversed(kind.__mro__) for name, part in vars(home).items()}
    return {name: part for name, part in found.items() if isinstance(part, OtherName)}


def _meanings(
    spelled: Mapping[str, OtherName], given: Mapping[str, Any]
) -> Iterator[tuple[list[str], Mapping[str, Any]]]:
    """Other names that were given, those of one function together, and the fields that they mean."""
    for name, other in spelled.items():
        if isinstance(other.meaning, str):
            yield [name], {other.meaning: given[name]}
    functions = [other.meaning for other in spelled.values() if not isinstance(other.meaning, str)]
    for meaning in dict.fromkeys(functions):
        names = [name for name, other in spelled.items() if other.meaning is meaning]
        yield names, meaning(**{name: given[name] for name in names})


def _in_words_of(spelled: Mapping[str, OtherName], error: InputError) -> InputError:
    """Name what was given in the place of the field that it is."""
    for name, other in spelled.items():
        if error.path[:1] == (other.meaning,):
            return InputError(name, error.expected, error.got, error.remedy)
    return error
