"""Checks of arguments, used once where a value enters the package."""

from __future__ import annotations

import math
from collections.abc import Collection
from typing import Any, TypeVar

import numpy as np
from numpy.typing import ArrayLike, NDArray

from fingerpad.core.errors import InputError
from fingerpad.core.keywords import got

FloatArray = NDArray[np.float64]
IntArray = NDArray[np.int64]
_Kind = TypeVar("_Kind")


def finite(name: str, value: float, unit: str = "") -> float:
    """Return `value` as float if it is one finite number, else raise `InputError`.

    Examples
    --------
    >>> finite("depth_mm", 1, "mm")
    1.0
    """
    try:
        number = float(value)
    except (TypeError, ValueError):
        number = math.nan
    if isinstance(value, bool) or not math.isfinite(number):
        raise InputError(f"{name} must be a finite number{_in(unit)}: got {value!r}.")
    return number


def positive(name: str, value: float, unit: str = "") -> float:
    """Return `value` as float if it is finite and above zero, else raise `InputError`."""
    number = finite(name, value, unit)
    if number <= 0.0:
        raise InputError(f"{name} must be greater than 0{_in(unit)}: got {value!r}.")
    return number


def not_negative(name: str, value: float, unit: str = "") -> float:
    """Return `value` as float if it is finite and not below zero, else raise `InputError`."""
    number = finite(name, value, unit)
    if number < 0.0:
        raise InputError(f"{name} must not be negative{_in(unit)}: got {value!r}.")
    return number


def whole(name: str, value: int, at_least: int) -> int:
    """Return `value` as int if it is a whole number not below `at_least`, else raise `InputError`."""
    if isinstance(value, bool) or not isinstance(value, int | np.integer) or value < at_least:
        raise InputError(f"{name} must be a whole number of at least {at_least}: got {value!r}.")
    return int(value)


def one_of(name: str, value: Any, allowed: Collection[str]) -> str:
    """Return `value` if it is one of `allowed`, else raise `InputError` that lists them."""
    if value not in allowed:
        raise InputError(f"{name} must be one of {', '.join(allowed)}: {got(value, allowed)}")
    return value


def instance(name: str, value: _Kind, kind: type) -> _Kind:
    """Return `value` if it is a `kind`, else raise `InputError`."""
    if not isinstance(value, kind):
        raise InputError(f"{name} must be of type {kind.__name__}: got {value!r}.")
    return value


def float_array(name: str, values: ArrayLike, ndim: int) -> FloatArray:
    """Return a read-only float copy of `values` if it is finite and has `ndim` dimensions."""
    try:
        array = np.array(values, dtype=np.float64)
    except (TypeError, ValueError) as error:
        raise InputError(f"{name} must be an array of numbers: got {type(values).__name__}.") from error
    if array.ndim != ndim:
        raise InputError(f"{name} must have {ndim} dimension(s): got shape {array.shape}.")
    if not np.isfinite(array).all():
        bad = np.argwhere(~np.isfinite(array)) + 1
        first = " in row and column " if ndim == 2 else " number "
        raise InputError(
            f"{name} must hold finite numbers only: {len(bad)} are not, first"
            f"{first if ndim else ''}{', '.join(map(str, bad[0]))}."
        )
    array.setflags(write=False)
    return array


def increasing(name: str, values: FloatArray) -> FloatArray:
    """Return `values` if each is above the one before, else raise `InputError`."""
    if values.size and not (np.diff(values) > 0).all():
        last = int(np.argmin(np.diff(values) > 0)) + 1
        pair = f"{values[last]:g} after {values[last - 1]:g}"
        raise InputError(f"{name} must increase strictly: got {pair}, number {last + 1}.")
    return values


def _in(unit: str) -> str:
    return f" [{unit}]" if unit else ""
