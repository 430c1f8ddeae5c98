"""Stiffness and relaxation of the tissues: the numbers of `tables/tissues.toml`."""

from typing import Any

from fingerpad.data.published import numbers_of

_NUMBERS = numbers_of("tissues")
DEFAULT_TISSUES = _NUMBERS["DEFAULT_TISSUES"]
DENSITY = _NUMBERS["DENSITY"]


def __getattr__(name: str) -> Any:
    if name not in _NUMBERS:
        raise AttributeError(f"tables/tissues.toml has no {name}.")
    return _NUMBERS[name]
