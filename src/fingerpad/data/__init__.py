"""Published parameters and reference observations, each with unit, source and status; no algorithm.

`fingertip`, `fingers`, `tissues`, `neuron`, `protocol` and `psychophysics` are inputs of the model; `paper`
contains the results for comparison.
"""

from fingerpad.data import afferents, fingers, fingertip, neuron, paper, protocol, psychophysics, tissues
from fingerpad.data.afferents import TYPES
from fingerpad.data.observations import (
    BarObservations,
    DeflectionObservations,
    HitRateObservations,
    bar_firing_rates,
    cylinder_deflection,
    goodwin_hit_rates,
)
from fingerpad.data.published import STATUSES, Published

__all__ = [
    "STATUSES",
    "BarObservations",
    "DeflectionObservations",
    "HitRateObservations",
    "Published",
    "afferents",
    "all_published",
    "bar_firing_rates",
    "cylinder_deflection",
    "fingers",
    "fingertip",
    "goodwin_hit_rates",
    "neuron",
    "paper",
    "protocol",
    "psychophysics",
    "tissues",
]

_MODULES = (fingertip, fingers, tissues, protocol, neuron, psychophysics, paper, afferents)


def all_published() -> tuple[Published, ...]:
    """Every published number of the package, module by module, in the order of definition.

    Examples
    --------
    >>> from fingerpad.data import all_published
    >>> {number.status for number in all_published()} == {"paper", "read", "recalled", "assumed"}
    True
    """
    found: list[object] = []
    for value in (value for module in _MODULES for value in vars(module).values()):
        found += value.values() if isinstance(value, dict) else [value]
        if value is TYPES:
            found += [each for row in TYPES.values() for each in (row.density_per_cm2, *row.numbers.values())]
    return tuple({id(each): each for each in found if isinstance(each, Published)}.values())
