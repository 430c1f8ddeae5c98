"""Checks of arguments, used once where a value enters the package."""

from __future__ import annotations

import math
import re
import warnings
from collections.abc import Collection, Sequence
from typing import Any, TypeGuard, TypeVar

import numpy as np
from numpy.typing import ArrayLike, NDArray

from fingerpad.core.errors import InputError, got, shown

FloatArray = NDArray[np.float64]
IntArray = NDArray[np.int64]
_Kind = TypeVar("_Kind")


def finite(name: str, value: float, unit: str = "") -> float:
    """Return `value` as float if it is one finite number, else raise `InputError`."""
    number = _real(value)
    if not math.isfinite(number):
        raise InputError(name, f"must be a finite number{_in(unit)}", shown(value))
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
    """Return the finite number that a text writes in plain digits, else raise `InputError`."""
    if not _DIGITS.fullmatch(text):
        raise InputError(name, f"must be a finite number{_in(unit)}", shown(text))
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


def positive(name: str, value: float, unit: str = "") -> float:
    """Return `value` as float if it is finite and above zero, else raise `InputError`."""
    number = finite(name, value, unit)
    if number <= 0.0:
        raise InputError(name, f"must be greater than 0{_in(unit)}", shown(value))
    return number


def plausible(name: str, value: float, unit: str, between: tuple[float, float]) -> float:
    """Return `value` as float if it is a size that a laboratory has, else raise `InputError`."""
    number = positive(name, value, unit)
    if not between[0] <= number <= between[1]:
        raise InputError(
            name, f"must lie within {between[0]:g} to {between[1]:g} {unit}", f"{number:g}", "check its unit"
        )
    return number


def not_negative(name: str, value: float, unit: str = "") -> float:
    """Return `value` as float if it is finite and not below zero, else raise `InputError`."""
    number = finite(name, value, unit)
    if number < 0.0:
        raise InputError(name, f"must not be negative{_in(unit)}", shown(value))
    return number


def pair(name: str, value: Any, unit: str = "mm") -> tuple[float, float]:
    """Return x and z as floats if `value` is a pair of finite numbers, else raise `InputError`."""
    try:
        x, z = value
    except (TypeError, ValueError) as error:
        raise InputError(name, f"must be a pair, x and z{_in(unit)}", shown(value)) from error
    return finite(f"{name}[0]", x, unit), finite(f"{name}[1]", z, unit)


def whole(name: str, value: int, at_least: int, at_most: int | None = None) -> int:
    """Return `value` as int if it is a whole number within limits, else raise `InputError`."""
    counts = isinstance(value, int | np.integer) and not isinstance(value, bool | np.timedelta64)
    if not counts or value < at_least:
        raise InputError(name, f"must be a whole number of at least {at_least}", shown(value))
    if at_most is not None and value > at_most:
        raise InputError(name, f"must be at most {at_most:,}", shown(value))
    return int(value)


def one_of(name: str, value: Any, allowed: Collection[str]) -> str:
    """Return `value` if it is one of `allowed`, else raise `InputError` that lists them."""
    if not isinstance(value, str) or value not in allowed:
        raise InputError(name, f"must be one of {', '.join(allowed)}", got(value, allowed))
    return value


def instance(name: str, value: _Kind, kind: type) -> _Kind:
    """Return `value` if it is a `kind`, else raise `InputError`."""
    if not isinstance(value, kind):
        if isinstance(value, type) and issubclass(value, kind):
            raise InputError(
                name, "must be made from its class", f"{value.__name__}, call it: {value.__name__}()"
            )
        raise InputError(name, f"must be of type {kind.__name__}", shown(value))
    return value


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
        raise InputError(
            name,
            "must hold finite numbers only",
            remedy=f"{len(bad)} are not, first{first if array.ndim else ' '}{', '.join(map(str, bad[0]))}",
        )
    array.setflags(write=False)
    return array


def int_array(name: str, values: ArrayLike, ndim: int) -> IntArray:
    """Return `values` as an array of whole numbers if it has `ndim` dimensions, else raise `InputError`."""
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


def increasing(name: str, values: FloatArray) -> FloatArray:
    """Return `values` if each is above the one before, else raise `InputError`."""
    if values.size and not (np.diff(values) > 0).all():
        last = int(np.argmin(np.diff(values) > 0)) + 1
        pair = f"{values[last]:g} after {values[last - 1]:g}"
        raise InputError(name, "must increase strictly", f"{pair}, number {last + 1}")
    return values


def _in(unit: str) -> str:
    return f" [{unit}]" if unit else ""
