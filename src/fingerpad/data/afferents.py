"""Types of afferents in the fingertip, and published observations of them: `tables/afferents.toml`."""

from collections.abc import Mapping
from dataclasses import dataclass
from types import MappingProxyType
from typing import Any

from fingerpad.data.published import Published, numbers_of

_NUMBERS = numbers_of("afferents")
PC_REACH = _NUMBERS["PC_REACH"]


@dataclass(frozen=True)
class AfferentRow:
    """One type of afferents: the chain from the skin to the spikes, its numbers, and how dense it is."""

    chain: str  #: "slow", the paper's Eqs. 1-5; or "rapid", a band pass and a membrane.
    density_per_cm2: float  #: In the fingertip. [1/cm2]
    numbers: Mapping[str, Published[float] | float | str]
    """By the fields of the chain; those that are absent have its defaults."""
    of_tissues: bool = False  #: Whether the defaults are those that were fitted with the tissues.

    @property
    def values(self) -> dict[str, float | str]:
        """The numbers without their sources; powers are whole."""
        plain = {
            name: number.value if isinstance(number, Published) else number
            for name, number in self.numbers.items()
        }
        return {name: int(value) if name in ("rise", "fall") else value for name, value in plain.items()}


def _row(chain: str, density_per_cm2: float, of_tissues: bool = False, **numbers: Any) -> AfferentRow:
    known = {name: _NUMBERS.get(value, value) for name, value in numbers.items()}
    return AfferentRow(chain, density_per_cm2, known, of_tissues)


TYPES: Mapping[str, AfferentRow] = MappingProxyType(
    {name: _row(**row) for name, row in _NUMBERS["types"].items()}
)
"""The types of afferents by their names: one more row of the file is one more type."""


def __getattr__(name: str) -> Any:
    if name not in _NUMBERS:
        raise AttributeError(f"tables/afferents.toml has no {name}.")
    return _NUMBERS[name]
