"""Published parameters and reference observations, each with unit, source and status; no algorithm.

The numbers stand in the files of `tables`; each file is an object here, such as `fingertip.LENGTH`. All are
inputs of the model but those of `paper`, its results for comparison.
"""

from types import SimpleNamespace

from fingerpad.data import afferents, tissues
from fingerpad.data.observations import (
    BarObservations,
    DeflectionObservations,
    bar_firing_rates,
    cylinder_deflection,
)
from fingerpad.data.published import STATUSES, Published, numbers_of

__all__ = [
    "STATUSES",
    "BarObservations",
    "DeflectionObservations",
    "Published",
    "afferents",
    "all_published",
    "bar_firing_rates",
    "cylinder_deflection",
    "fingers",
    "fingertip",
    "neuron",
    "paper",
    "protocol",
    "psychophysics",
    "tissues",
]

TOPICS = ("fingertip", "fingers", "tissues", "protocol", "neuron", "psychophysics", "paper", "afferents")

fingers = SimpleNamespace(**numbers_of("fingers"))
fingertip = SimpleNamespace(**numbers_of("fingertip"))
neuron = SimpleNamespace(**numbers_of("neuron"))
paper = SimpleNamespace(**numbers_of("paper"))
protocol = SimpleNamespace(**numbers_of("protocol"))
psychophysics = SimpleNamespace(**numbers_of("psychophysics"))


def all_published() -> tuple[Published, ...]:
    """Every published number of the package, file by file, in the order of definition.

    Examples
    --------
    >>> from fingerpad.data import all_published
    >>> {number.status for number in all_published()} == {"paper", "read", "recalled", "assumed"}
    True
    """
    found = (value for topic in TOPICS for value in numbers_of(topic).values())
    return tuple(value for value in found if isinstance(value, Published))
