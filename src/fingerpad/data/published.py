"""One published number: value, unit, source and status."""

from __future__ import annotations

from dataclasses import dataclass
from typing import Generic, Literal, TypeVar

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

    Parameters
    ----------
    name : str
        Description; unique within the package.
    value : float or tuple of float
        The number(s), in `unit`.
    unit : str
        Unit of `value`; "1" for pure numbers.
    source : str
        Source of the value.
    status : {"paper", "read", "recalled", "assumed"}
        Reliability of the value; the four words are defined in `STATUSES`.

    Examples
    --------
    >>> Published("time constant", 68, "ms", "Gerling et al. 2014, section 2.2.2", "paper").value
    68.0
    """

    name: str
    value: Value
    unit: str
    source: str
    status: Status

    def __post_init__(self) -> None:
        for field in ("name", "unit", "source"):
            text = getattr(self, field)
            if not isinstance(text, str) or not text.strip():
                raise InputError(f"Published needs a text as {field}: got {text!r}.")
        one_of(f"status of {self.name}", self.status, tuple(STATUSES))
        object.__setattr__(self, "value", _numbers(self.name, self.value))


@dataclass(frozen=True)
class Source:
    """A publication, and the status of the numbers that were taken from it; called, it makes one of them."""

    text: str  # Where the numbers stand.
    status: Status  # Their reliability, see `STATUSES`.

    def __call__(self, name: str, value: Value, unit: str) -> Published[Value]:
        return Published(name, value, unit, self.text, self.status)


def _numbers(name: str, value: float | tuple[float, ...]) -> float | tuple[float, ...]:
    if not isinstance(value, tuple):
        return finite(name, value)
    if not value:
        raise InputError(name, "must hold at least one number", "an empty tuple")
    return tuple(finite(name, number) for number in value)
