"""The layer that all value types share: a field holds what its annotation says, from the start."""

from __future__ import annotations

import inspect
import os
from collections.abc import Callable, Hashable, Iterable, Mapping, Sequence
from contextlib import suppress
from dataclasses import fields
from functools import cache, lru_cache
from pathlib import Path
from types import NoneType, UnionType
from typing import Any, TypeVar, Union, cast, get_args, get_origin, get_type_hints

import numpy as np
from numpy.typing import ArrayLike

from fingerpad.core.checks import finite, float_array, instance
from fingerpad.core.errors import InputError, shown
from fingerpad.core.units import unit_of

_Kind = TypeVar("_Kind")
_Convert = Callable[[str, Any], Any]

_LARGEST_MM = 1e9  # Largest length, a thousand kilometres. [mm]
_MOST_BITS = 1023  # Bits of the largest whole number that a float holds.


def converted(cls: type[_Kind]) -> type[_Kind]:
    """Make a dataclass hold values of the annotated types: the decorator below `@dataclass(frozen=True)`.

    Before `__post_init__` a number of any real type becomes a float or an int, a sequence a tuple, and a flag
    a bool. Text is no number. A field whose annotation is a class of this package must hold an instance. What
    is left to `__post_init__` are limits, and arrays, whose shapes an annotation does not say. A field may
    keep its default, whatever that is.
    """
    check = getattr(cls, "__post_init__", None)

    def __post_init__(self: Any) -> None:
        for name, default, convert in _conversions(cast(Hashable, type(self))):
            value = getattr(self, name)
            if isinstance(value, int) and value.bit_length() > _MOST_BITS:  # Python may not even write it
                raise InputError(name, "must not be so large", shown(value))
            if convert is not None and value is not default:
                object.__setattr__(self, name, convert(name, value))
        if check is not None:
            check(self)

    cls.__post_init__ = __post_init__  # type: ignore[attr-defined]
    return cls


@cache
def _conversions(cls: Any) -> list[tuple[str, Any, _Convert | None]]:
    """Name, default and conversion of each field."""
    hints: dict[str, Any] = {}
    for home in reversed(cls.__mro__):
        with suppress(NameError):  # a class made in a function may name types that only that function knows
            hints |= get_type_hints(home)
    wanted = ((part, _conversion(hints.get(part.name))) for part in fields(cls) if part.init)
    return [(part.name, part.default, convert) for part, convert in wanted]


def refuse_mistyped(function: Callable[..., Any], given: Mapping[str, Any]) -> None:
    """Raise `InputError` for an argument that is not of the annotated type; called where a call failed."""
    known = getattr(function, "__globals__", {})
    for name, part in inspect.signature(function).parameters.items():
        if name not in given or given[name] is part.default:
            continue
        with suppress(NameError):  # a type that only type checkers import
            hint = eval(part.annotation, known) if isinstance(part.annotation, str) else part.annotation
            _refuse_other_type(name, given[name], hint)


def _refuse_other_type(name: str, value: Any, hint: Any) -> None:
    kind, inner = get_origin(hint) or hint, get_args(hint)
    wanted = ""
    if convert := _conversion(hint):
        convert(name, value)
    elif hint == ArrayLike:
        float_array(name, value, None)
    elif kind in (Union, UnionType) and Path not in inner:
        refused = [each for each in inner if _is_refused(name, value, each)]
        if refused == list(inner):
            _refuse_other_type(name, value, inner[0])
    elif Path in (hint, *inner):
        wanted = "" if isinstance(value, str | os.PathLike) else "a path"
    elif kind is np.ndarray:
        wanted = "" if isinstance(value, np.ndarray) and value.ndim else "an array"
    elif getattr(hint, "_is_protocol", False):
        members = [part for part in (vars(hint) | hint.__annotations__) if not part.startswith("_")]
        lacking = [part for part in members if not hasattr(value, part)]
        wanted = f"a {hint.__name__}, with {', '.join(lacking)}" if lacking else ""
    elif kind is Sequence and not isinstance(value, str):
        for number, entry in enumerate(value if isinstance(value, Iterable) else [value]):
            _refuse_other_type(f"{name}[{number}]", entry, inner[0])
    elif isinstance(kind, type) and not isinstance(value, kind):
        wanted = f"a {kind.__name__.lower()}"
    if wanted:
        raise InputError(name, f"must be {wanted}", shown(value))


def _is_refused(name: str, value: Any, hint: Any) -> bool:
    try:
        _refuse_other_type(name, value, hint)
    except InputError:
        return True
    return False


def _conversion(hint: Any) -> _Convert | None:
    """How a value becomes one of an annotated type; None if it is taken as it is."""
    origin, inner = get_origin(hint), get_args(hint)
    if hint is float:
        return lambda name, value: _within(name, finite(name, value, _unit(name)))
    if origin in (Union, UnionType) and len(inner) == 2 and NoneType in inner:
        given = _conversion(inner[inner[0] is NoneType])
        return given and (lambda name, value: None if value is None else given(name, value))
    if origin is tuple:
        return _tuple_of(*inner)
    if hint in (int, bool, str):
        return {int: _int, bool: _flag, str: _text}[hint]
    ours = isinstance(hint, type) and hint.__module__.startswith("fingerpad.")
    if ours and not getattr(hint, "_is_protocol", False):
        return lambda name, value: instance(name, value, hint)
    return None


def _tuple_of(first: Any, *others: Any) -> _Convert:
    """Conversion of a sequence to a tuple of one type, or with a type for each entry."""
    anyone = others == (Ellipsis,)
    if anyone and first is float:
        return lambda name, values: tuple(_within(name, each) for each in _floats(name, values))
    hints = (first,) if anyone else (first, *others)
    each = [_conversion(hint) or (lambda _, value: value) for hint in hints]
    numbers = "numbers" if set(hints) == {float} else "entries"
    kind = "a sequence" if anyone else f"{ {2: 'two', 3: 'three'}.get(len(each), len(each)) } {numbers}"

    def convert(name: str, values: Any) -> tuple[Any, ...]:
        many = isinstance(values, Sequence) and not isinstance(values, str | bytes | bytearray | memoryview)
        many = many or (isinstance(values, np.ndarray) and values.ndim > 0)
        if not many or not (anyone or len(values) == len(each)):
            raise InputError(name, f"must be {kind}", shown(values))
        converts = each * len(values) if anyone else each
        entries = enumerate(zip(converts, values, strict=True))
        return tuple(convert(f"{name}[{number}]", value) for number, (convert, value) in entries)

    return convert


def _int(name: str, value: Any) -> int:
    if isinstance(value, bool | np.timedelta64) or not isinstance(value, int | np.integer):
        raise InputError(name, "must be a whole number", shown(value))
    return int(value)


def _flag(name: str, value: Any) -> bool:
    if not isinstance(value, bool | np.bool_):
        raise InputError(name, "must be True or False", shown(value))
    return bool(value)


def _text(name: str, value: Any) -> str:
    if not isinstance(value, str):
        raise InputError(name, "must be a text", shown(value))
    return str(value)


def _floats(name: str, values: Any) -> list[float]:
    return float_array(name, values, 1).tolist()


def _within(name: str, value: float) -> float:
    """Value, unless it is a length whose square a float may not hold."""
    if abs(value) > _LARGEST_MM and _unit(name) == "mm":
        raise InputError(name, f"must lie within {_LARGEST_MM:g} mm", f"{value:g}")
    return value


@lru_cache(maxsize=1024)
def _unit(name: str) -> str:
    return unit_of(name.partition("[")[0])
