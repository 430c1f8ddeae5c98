"""Types of values: what a number, a sequence or an array may be, once for Python, files and results.

A type is what stands in an annotation, such as `Positive`: fields of values and results (`core/checked`),
arguments of functions and keys of files are checked by it, in the same words. Its check is a function of a
name and a value, for what no annotation says. The unit in an error is the one with which the name ends.
"""

from __future__ import annotations

import math
import re
import warnings
from collections.abc import Callable, Collection, Sequence
from dataclasses import dataclass
from functools import lru_cache, partial
from pathlib import Path
from typing import Annotated, Any, TypeGuard, TypeVar

import numpy as np
from numpy.typing import ArrayLike, NDArray
from pydantic import Strict
from pydantic_core import core_schema

from fingerpad.core.errors import InputError, closest, shown
from fingerpad.core.files import path_of
from fingerpad.core.units import unit_of

FloatArray = NDArray[np.float64]
IntArray = NDArray[np.int64]
JsonObject = dict[str, Any]  # Object of a JSON file, as `json` reads it.
JsonSchema = JsonObject
_Kind = TypeVar("_Kind")
_Entry = TypeVar("_Entry")

_LARGEST_MM = 1e9  # Largest length, a thousand kilometres: a float may not hold the square of a larger one.
_MOST_BITS = 1023  # Bits of the largest whole number that a float holds.


def finite(name: str, value: Any, unit: str = "") -> float:
    """Return a finite number of any real type as float."""
    number = _real(value)
    if not math.isfinite(number):
        raise InputError(name, f"must be a finite number{_in(name, unit)}", shown(value))
    if abs(number) > _LARGEST_MM and (unit or _unit(name)) == "mm":
        raise InputError(name, f"must lie within {_LARGEST_MM:g} mm", f"{number:g}")
    return number


def _real(value: Any) -> float:
    """Value of any real type as float; NaN if it is none, such as text, a truth value or a date."""
    if isinstance(value, np.generic | np.ndarray):
        if value.ndim or value.dtype.kind not in "iuf" or np.ma.is_masked(value):
            return math.nan
    elif isinstance(value, bool) or not hasattr(value, "__float__"):
        return math.nan
    try:
        return float(value)
    except (TypeError, ValueError, OverflowError):
        return math.nan


def number_in(name: str, text: str, unit: str = "") -> float:
    """Return the finite number that a text writes in plain digits."""
    if not _DIGITS.fullmatch(text):
        raise InputError(name, f"must be a finite number{_in(name, unit)}", shown(text))
    return finite(name, float(text), unit)


def numbers_in(name: str, texts: Sequence[str], unit: str = "") -> FloatArray:
    """Return the finite numbers that texts write, as `number_in` does for one; much faster for many."""
    if all(map(_DIGITS.fullmatch, texts)):
        values = np.array(list(map(float, texts)), dtype=np.float64)
        if np.isfinite(values).all():
            return values
    return np.array([number_in(name, text, unit) for text in texts], dtype=np.float64)


# Python also reads `1_0`, digits of other scripts, `inf` and `nan`.
_DIGITS = re.compile(r"\s*[-+]?([0-9]+\.?[0-9]*|\.[0-9]+)([eE][-+]?[0-9]+)?\s*")


def positive(name: str, value: Any, unit: str = "") -> float:
    """Return a number above zero as float."""
    number = finite(name, value, unit)
    if number <= 0.0:
        raise InputError(name, f"must be greater than 0{_in(name, unit)}", shown(value))
    return number


def not_negative(name: str, value: Any, unit: str = "") -> float:
    """Return a number not below zero as float."""
    number = finite(name, value, unit)
    if number < 0.0:
        raise InputError(name, f"must not be negative{_in(name, unit)}", shown(value))
    return number


def within(name: str, value: Any, low: float, high: float) -> float:
    """Return a number within limits as float."""
    number, unit = finite(name, value), _unit(name)
    if not low <= number <= high:
        words = f"must lie within {low:g} to {high:g}{' ' * bool(unit)}{unit}"
        raise InputError(name, words, f"{number:g}", "check its unit" if unit else "")
    return number


def whole(name: str, value: Any, at_least: int | None = None, at_most: int | None = None) -> int:
    """Return a whole number within limits as int."""
    counts = isinstance(value, int | np.integer) and not isinstance(value, bool | np.timedelta64)
    if not counts or (at_least is not None and value < at_least):
        said = "" if at_least is None else f" of at least {at_least}"
        raise InputError(name, f"must be a whole number{said}", shown(value))
    if at_most is not None and value > at_most:
        raise InputError(name, f"must be at most {at_most:,}", shown(value))
    if int(value).bit_length() > _MOST_BITS:  # Python may not even write it
        raise InputError(name, "must not be so large", shown(value))
    return int(value)


def flag(name: str, value: Any) -> bool:
    """Return a truth value as bool."""
    if not isinstance(value, bool | np.bool_):
        raise InputError(name, "must be true or false", shown(value))
    return bool(value)


def text(name: str, value: Any) -> str:
    """Return a text that is not empty."""
    if not isinstance(value, str) or not value:
        raise InputError(name, "must be a text", shown(value))
    return value


def one_of(name: str, value: Any, allowed: Collection[str]) -> str:
    """Return one of several names."""
    if not isinstance(value, str) or value not in allowed:
        near, came = closest(value, allowed), shown(value)
        came = f"{came} (did you mean {near}?)" if near else came
        raise InputError(name, f"must be one of {', '.join(allowed)}", came)
    return value


def instance(name: str, value: _Kind, kind: type) -> _Kind:
    """Return an instance of a class."""
    if not isinstance(value, kind):
        if isinstance(value, type) and issubclass(value, kind):
            call = f"{value.__name__}, call it: {value.__name__}()"
            raise InputError(name, "must be made from its class", call)
        raise InputError(name, f"must be of type {getattr(kind, '__name__', kind)}", shown(value))
    return value


def like(name: str, value: Any, kind: type) -> Any:
    """Return a value that has all members of a protocol."""
    members = [member for member in (vars(kind) | kind.__annotations__) if not member.startswith("_")]
    lacking = [member for member in members if not hasattr(value, member)]
    if lacking:
        raise InputError(name, f"must be like {kind.__name__}, with {', '.join(lacking)}", shown(value))
    return value


def tuple_of(name: str, values: Any, each: Callable[[str, Any], Any], length: int | None = None) -> Any:
    """Return a sequence as a tuple whose entries have passed a check."""
    many = isinstance(values, Sequence) and not isinstance(values, str | bytes | bytearray | memoryview)
    many = many or (isinstance(values, np.ndarray) and values.ndim > 0)
    if not many or length not in (None, len(values)):
        words = {None: "a sequence", 2: "a pair", 3: "a sequence of three"}
        raise InputError(name, f"must be {words[length]}{_in(name)}", shown(values))
    return tuple(each(f"{name}[{number}]", value) for number, value in enumerate(values))


def numbers(name: str, values: Any) -> tuple[float, ...]:
    """Return a sequence of finite numbers as a tuple of floats."""
    array = float_array(name, values, 1)
    for at in (array.argmin(), array.argmax()) if array.size else ():
        finite(f"{name}[{at}]", array[at])
    return tuple(array.tolist())


def pair(name: str, value: Any) -> tuple[float, float]:
    """Return two finite numbers, such as x and z, as floats."""
    x, z = tuple_of(name, value, finite, 2)
    return x, z


def float_array(name: str, values: ArrayLike, ndim: int | None) -> FloatArray:
    """Return `values` as a read-only float array if it is finite and has `ndim` dimensions; None for any.

    An array of floats that nobody can write to, as every checked value holds, is returned itself. Any other
    is copied.
    """
    array = values if _is_frozen(values) else _numbers(name, values)
    if ndim is not None and array.ndim != ndim:
        raise InputError(name, f"must have {ndim} dimension(s)", f"shape {array.shape}")
    # A sum is finite only if all numbers are, and costs a third of the time.
    with np.errstate(over="ignore", invalid="ignore"):
        total = array.sum()
    if not np.isfinite(total) and not np.isfinite(array).all():
        bad = np.argwhere(~np.isfinite(array)) + 1
        first = " in row and column " if array.ndim == 2 else " number "
        said = f"{len(bad)} are not, first{first if array.ndim else ' '}{', '.join(map(str, bad[0]))}"
        raise InputError(name, "must hold finite numbers only", remedy=said)
    array.setflags(write=False)
    return array


def array(name: str, values: ArrayLike) -> FloatArray:
    """Return an array of any shape, or anything that becomes one, which may hold NaN."""
    return values if isinstance(values, np.ndarray) and values.ndim else _numbers(name, values)


def vector(name: str, values: ArrayLike) -> FloatArray:
    """Return an array (n,) of numbers, of which some may be NaN or infinite."""
    array = (
        values if isinstance(values, np.ndarray) and values.dtype == np.float64 else _numbers(name, values)
    )
    if array.ndim != 1:
        raise InputError(name, "must have 1 dimension(s)", f"shape {array.shape}")
    return array


def int_array(name: str, values: ArrayLike, ndim: int) -> IntArray:
    """Return `values` as an array of whole numbers if it has `ndim` dimensions."""
    if isinstance(values, np.ndarray) and values.dtype.kind in "iu" and values.ndim == ndim:
        return values.astype(np.int64)
    numbers = float_array(name, values, ndim)
    if not (np.abs(numbers) < 2**53).all() or (numbers != np.floor(numbers)).any():
        raise InputError(name, "must hold whole numbers", shown(values))
    return numbers.astype(np.int64)


def _numbers(name: str, values: ArrayLike) -> FloatArray:
    """Copy of `values` as floats; `InputError` if they are no real numbers, or some are masked."""
    given, problem = None, ""
    try:
        with warnings.catch_warnings(action="error"):  # NumPy warns of a masked entry in a list
            given = values if isinstance(values, np.ndarray) else np.asarray(values)
        if np.ma.is_masked(values):
            problem = " with masked entries"
        elif given.dtype.kind == "O":  # numbers of other types; a text among them has become no number
            return np.array([_float(value) for value in given.ravel()], dtype=np.float64).reshape(given.shape)
        elif given is not values and _has_flag(values):  # NumPy makes 1 of True among numbers
            problem = " with truth values"
        elif given.dtype.kind in "iuf" or given.size == 0:
            return np.array(given, dtype=np.float64)
        else:
            problem = f" of {given.dtype}"
    except (TypeError, ValueError, OverflowError, Warning) as error:
        raise InputError(name, "must be an array of numbers", type(values).__name__) from error
    raise InputError(name, "must be an array of numbers", f"{type(values).__name__}{problem}")


def _has_flag(values: Any) -> bool:
    """Whether there is a truth value among nested lists of numbers."""
    if not isinstance(values, list | tuple):
        return False
    kinds = set(map(type, values))
    return bool(kinds & {bool, np.bool_}) or (bool(kinds & {list, tuple}) and any(map(_has_flag, values)))


def _float(value: Any) -> float:
    number = _real(value)
    # None and NaN stand for a missing number, which the caller names with its place.
    if math.isnan(number) and not (value is None or isinstance(value, float | np.floating)):
        raise TypeError(value)
    return number


def _is_frozen(values: ArrayLike) -> TypeGuard[FloatArray]:
    """Whether this is an array of floats to whose memory no array can write."""
    array: object = values
    while isinstance(array, np.ndarray) and not array.flags.writeable:
        array = array.base
    return array is None and isinstance(values, np.ndarray) and values.dtype == np.float64


def increasing(name: str, values: ArrayLike) -> FloatArray:
    """Return an array (n,) of finite numbers, each above the one before."""
    array = float_array(name, values, 1)
    if array.size and not (np.diff(array) > 0).all():
        last = int(np.argmin(np.diff(array) > 0)) + 1
        pair = f"{array[last]:g} after {array[last - 1]:g}"
        raise InputError(name, "must increase strictly", f"{pair}, number {last + 1}")
    return array


def points(name: str, values: ArrayLike) -> FloatArray:
    """Return points as an array (n, 3), which is not copied."""
    array = values if isinstance(values, np.ndarray) else float_array(name, values, 2)
    if array.ndim != 2 or array.shape[1] != 3 or array.dtype.kind != "f":
        raise InputError(name, "must have rows of x, y and z", f"shape {array.shape}")
    return array


def _in(name: str, unit: str = "") -> str:
    unit = unit or _unit(name)
    return f" [{unit}]" if unit else ""


@lru_cache(maxsize=1024)
def _unit(name: str) -> str:
    return unit_of(name.partition("[")[0])


@dataclass(frozen=True, eq=False)
class Check:
    """Check of a type for pydantic: what a value becomes, and the JSON schema of it."""

    check: Callable[[str, Any], Any]
    schema: JsonSchema
    to_json: Callable[[Any], Any] | None = None

    def __get_pydantic_core_schema__(self, *_: Any) -> core_schema.CoreSchema:
        serialization = self.to_json and core_schema.plain_serializer_function_ser_schema(self.to_json)
        return core_schema.with_info_plain_validator_function(
            lambda value, info: self.check(info.field_name or "", value), serialization=serialization
        )

    def __get_pydantic_json_schema__(self, *_: Any) -> JsonSchema:
        return dict(self.schema)


def choice(allowed: Collection[str]) -> Check:
    """Check that a text is one of several names."""
    return Check(partial(one_of, allowed=allowed), {"type": "string", "enum": list(allowed)})


def some_of(allowed: Collection[str]) -> Check:
    """Check of one name or several, each one of those that are allowed, as a tuple."""

    def check(name: str, value: Any) -> tuple[str, ...]:
        names: tuple[str, ...] = tuple_of(name, [value] if isinstance(value, str) else value, one.check)
        if not names:
            raise InputError(name, "must have at least one entry", "none")
        return names

    one = choice(allowed)
    return Check(check, {"type": "array", "items": one.schema, "minItems": 1})


def entries(each: Check, length: int | None = None) -> Check:
    """Check of a sequence whose entries all have one type."""
    sizes = {} if length is None else {"minItems": length, "maxItems": length}
    return Check(
        partial(tuple_of, each=each.check, length=length), {"type": "array", "items": each.schema} | sizes
    )


def limits(low: float, high: float) -> Check:
    """Check of a number within limits."""
    return Check(partial(within, low=low, high=high), {"type": "number", "minimum": low, "maximum": high})


def count_from(at_least: int, at_most: int | None = None) -> Check:
    """Check of a whole number within limits."""
    limits = {"type": "integer", "minimum": at_least} | ({} if at_most is None else {"maximum": at_most})
    return Check(partial(whole, at_least=at_least, at_most=at_most), limits)


_NUMBER = Check(finite, {"type": "number"})
_PAIR = Check(pair, {"type": "array", "items": {"type": "number"}, "minItems": 2, "maxItems": 2})
_MOST = 10_000_000

Finite = Annotated[float, _NUMBER]
Positive = Annotated[float, Check(positive, {"type": "number", "exclusiveMinimum": 0})]
NotNegative = Annotated[float, Check(not_negative, {"type": "number", "minimum": 0})]
Share = Annotated[float, limits(0.0, 1.0)]
Whole = Annotated[int, Check(whole, {"type": "integer"})]
NotNegativeWhole = Annotated[int, count_from(0)]
Seed = Annotated[int, count_from(0, 2**63 - 1)]
Count = Annotated[int, count_from(1, _MOST)]
Several = Annotated[int, count_from(2, _MOST)]
Flag = Annotated[bool, Check(flag, {"type": "boolean"})]
Text = Annotated[str, Check(text, {"type": "string", "minLength": 1})]
AnyPath = Annotated[Path, Check(path_of, {"type": "string"})]
Pair = Annotated[tuple[float, float], _PAIR]
Numbers = Annotated[tuple[float, ...], Check(numbers, {"type": "array", "items": {"type": "number"}})]
Pairs = Annotated[tuple[tuple[float, float], ...], entries(_PAIR)]
Many = Annotated[tuple[_Entry, ...], Strict(False)]  # From any sequence, such as a list.
Outlines = Annotated[tuple[tuple[tuple[float, float], ...], ...], entries(entries(_PAIR))]

SizeMm = Annotated[float, limits(0.01, 400.0)]  # Width or diameter of a body that presses a fingertip.
PointsMm = Annotated[FloatArray, Check(points, {"type": "array"})]
TimesMs = Annotated[FloatArray, Check(increasing, {"type": "array", "items": {"type": "number"}})]
AnyArray = Annotated[FloatArray, Check(array, {})]
FiniteArray = Annotated[FloatArray, Check(partial(float_array, ndim=None), {"type": "array"})]
FiniteVector = Annotated[FloatArray, Check(partial(float_array, ndim=1), {"type": "array"})]
Indices = Annotated[IntArray, Check(partial(int_array, ndim=1), {"type": "array"})]
FiniteMatrix = Annotated[FloatArray, Check(partial(float_array, ndim=2), {"type": "array"})]


def _array(dtype: type, ndim: int, item: str) -> Check:
    """Check of a read-only array of a result, where NaN is null in a file."""

    def check(name: str, value: Any) -> NDArray[Any]:
        try:
            array: NDArray[Any] = np.array(value, dtype=dtype)
        except (TypeError, ValueError) as error:
            raise InputError(name, f"must hold numbers of type {np.dtype(dtype)}", shown(value)) from error
        if array.ndim != ndim:
            if array.size or array.ndim > ndim:
                raise InputError(name, f"must have {ndim} dimension(s)", f"shape {array.shape}")
            array = array.reshape((0,) * ndim)
        array.setflags(write=False)
        return array

    schema: JsonSchema = {"type": [item, "null"] if item == "number" else item}
    for _ in range(ndim):
        schema = {"type": "array", "items": schema}
    return Check(check, schema, _listed)


def _listed(array: NDArray[Any]) -> Any:
    """Nested lists of an array, with None for what is not finite."""
    if array.dtype.kind == "f" and not np.isfinite(array).all():
        values = array.astype(object)
        values[~np.isfinite(array)] = None
        return values.tolist()
    return array.tolist()


def _number(name: str, value: Any) -> float:
    """Return a number of a result as float; None is NaN."""
    number = math.nan if value is None else _real(value)
    if math.isnan(number) and not (value is None or value != value):
        raise InputError(name, "must be a number", shown(value))
    return number


Number = Annotated[
    float, Check(_number, {"type": ["number", "null"]}, lambda value: value if math.isfinite(value) else None)
]
"""A number of a result that may be NaN, which is null in a file."""
Vector = Annotated[FloatArray, _array(np.float64, 1, "number")]  # Float array (n,).
Matrix = Annotated[FloatArray, _array(np.float64, 2, "number")]  # Float array (n, m).
Stack = Annotated[FloatArray, _array(np.float64, 3, "number")]  # Float array (n, m, k).
WholeVector = Annotated[NDArray[np.int64], _array(np.int64, 1, "integer")]  # Integer array (n,).
TruthVector = Annotated[NDArray[np.bool_], _array(np.bool_, 1, "boolean")]  # Boolean array (n,).
TruthMatrix = Annotated[NDArray[np.bool_], _array(np.bool_, 2, "boolean")]  # Boolean array (n, m).
