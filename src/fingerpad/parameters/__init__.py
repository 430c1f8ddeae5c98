"""Published numbers, each with unit, source and status; nothing here computes.

`fingertip`, `tissues`, `neuron`, `protocol` and `psychophysics` are what the chain starts from, `paper` is
what its results are compared with.
"""

from types import ModuleType

from fingerpad.parameters import fingertip, neuron, paper, protocol, psychophysics, tissues
from fingerpad.parameters.published import STATUSES, Published

__all__ = [
    "STATUSES",
    "Published",
    "all_published",
    "fingertip",
    "neuron",
    "paper",
    "protocol",
    "psychophysics",
    "tissues",
]

_MODULES: tuple[ModuleType, ...] = (fingertip, tissues, protocol, neuron, psychophysics, paper)


def all_published() -> tuple[Published, ...]:
    """Every published number of the package, module by module, in the order of definition.

    Returns
    -------
    tuple of Published

    Examples
    --------
    >>> from fingerpad.parameters import all_published
    >>> {number.status for number in all_published()} == {"paper", "read", "recalled", "assumed"}
    True
    """
    return tuple(
        value for module in _MODULES for value in vars(module).values() if isinstance(value, Published)
    )
