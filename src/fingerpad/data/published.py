"""Published numbers: value, unit, source and status of each, read from the files of `tables`.

In these files a table is a number: `name` says what it is, and `source` where it stands, in words with a
`status` or as one of the `sources` of the file. All else is as it is written.
"""

from __future__ import annotations

import tomllib
from dataclasses import dataclass
from functools import cache
from importlib.resources import files
from typing import Any, Generic, Literal, TypeVar

from fingerpad.core.errors import InputError
from fingerpad.core.values import finite, one_of

Status = Literal["paper", "read", "recalled", "assumed"]
STATUSES: dict[str, str] = {
    "paper": "printed in Gerling et al. 2014",
    "read": "read in later public material of the authors' laboratory or in other published data",
    "recalled": "believed to be the published value, not checked against the publication",
    "assumed": "our stand-in for a value that is lost or was never stated",
}

Value = TypeVar("Value", float, tuple[float, ...])


@dataclass(frozen=True)
class Published(Generic[Value]):
    """A number, or a row of numbers, with unit, source and status.

    Examples
    --------
    >>> Published("time constant", 68, "ms", "Gerling et al. 2014, section 2.2.2", "paper").value
    68.0
    """

    name: str  #: Description; unique within the package.
    value: Value  #: The number or numbers, in `unit`.
    unit: str  #: Unit of the value; "1" for pure numbers.
    source: str  #: Source of the value.
    status: Status  #: Reliability of the value; `STATUSES` defines the four words.

    def __post_init__(self) -> None:
        for field in ("name", "unit", "source"):
            text = getattr(self, field)
            if not isinstance(text, str) or not text.strip():
                raise InputError(f"Published needs a text as {field}: got {text!r}.")
        one_of(f"status of {self.name}", self.status, tuple(STATUSES))
        if self.value == ():
            raise InputError(self.name, "must hold at least one number", "an empty tuple")
        given = self.value if isinstance(self.value, tuple) else (self.value,)
        numbers = tuple(finite(self.name, number) for number in given)
        object.__setattr__(self, "value", numbers if given is self.value else numbers[0])


@dataclass(frozen=True)
class Source:
    """A publication, and the status of the numbers that were taken from it; called, it makes one of them."""

    text: str  #: Where the numbers stand.
    status: Status  #: Their reliability, see `STATUSES`.

    def __call__(self, name: str, value: Value, unit: str) -> Published[Value]:
        return Published(name, value, unit, self.text, self.status)


def packaged_text(name: str) -> str:
    """Text of a file of `tables`."""
    return (files("fingerpad.data") / "tables" / name).read_text(encoding="utf-8")


@cache
def numbers_of(topic: str) -> dict[str, Any]:
    """Return the numbers of a file of `tables` by their names there, and what else it holds."""
    rows = tomllib.loads(packaged_text(f"{topic}.toml"))
    sources = {name: Source(**row) for name, row in rows.pop("sources").items()}

    def number(name: str, value: Any, unit: str, source: str, status: Any = None) -> Published[Any]:
        said = Source(source, status) if status else sources[source]
        return said(name, tuple(value) if isinstance(value, list) else value, unit)

    return {
        name: number(**row) if isinstance(row, dict) and "value" in row else row for name, row in rows.items()
    }
