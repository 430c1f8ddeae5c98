"""What the search for tissues compares: tissues, what drives the afferent, and what each was chosen by."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass, replace

from fingerpad.core.signals import STORED_ENERGY
from fingerpad.core.values import one_of, positive
from fingerpad.data import tissues as published
from fingerpad.mechanics.materials import Material, Prony, Tissues
from fingerpad.mechanics.tissues import LONG_TERM, named_tissues, skin_prony

QUANTITIES = (STORED_ENERGY, "von_mises", "compressive_stress")
"""Quantities of the skin that may drive the afferent."""

HUMAN_KPA = (
    published.HUMAN_STRATUM_CORNEUM_SHEAR.value,
    published.HUMAN_LIVING_EPIDERMIS_SHEAR.value,
    published.HUMAN_DERMIS_SHEAR.value,
    published.HUMAN_SUBCUTIS_SHEAR.value,
)
"""Long-term shear moduli of the set `human`, from the outside in. [kPa]"""

STIFFER_KPA, SOFTER_KPA = (54.0, 12.4, 6.9, 1.9), (32.0, 8.0, 8.0, 1.9)
"""Sets of the same kind with stiffer and with softer outer layers; `human` lies between them. [kPa]"""

LEVELS = ("deflection", "force", "firing", "percept")
"""What is observed, from the skin to the judgement."""

FORCE_FACTOR = 0.39
"""Common factor that gives `paper` the force of people."""


@dataclass(frozen=True)
class Reading:
    """A quantity in the skin that drives both terms of the current, and the power to which it is raised.

    Examples
    --------
    >>> print(Reading(exponent=0.5), "|", Reading("von_mises"))
    SED^0.5 | von Mises stress
    """

    quantity: str = STORED_ENERGY
    exponent: float = 1.0

    def __post_init__(self) -> None:
        one_of("quantity", self.quantity, QUANTITIES)
        positive("exponent", self.exponent)

    def __str__(self) -> str:
        name = {STORED_ENERGY: "SED", "von_mises": "von Mises stress"}.get(self.quantity, self.quantity)
        return name.replace("_", " ") + ("" if self.exponent == 1.0 else f"^{self.exponent:g}")


SED, STRESS = Reading(), Reading("compressive_stress")


@dataclass(frozen=True)
class Candidate:
    """Tissues and a drive that are tried together."""

    name: str  #: Short, unique within a study.
    tissues: Tissues  #: Laws of the four layers.
    reading: Reading  #: What drives the afferent.
    chosen_by: tuple[str, ...] = ()
    """Those of `LEVELS` whose observations were used to choose tissues or reading: in sample there. On the
    others the result is a prediction."""
    factor: float = 1.0
    """Common factor on all moduli. At a prescribed depth it multiplies forces and stresses, and the gains of
    the afferent compensate for it, so that it needs no press of its own."""
    finalist: bool = False  #: Press the bar at all 36 shifts instead of reading one bar at shifted sites.

    def __post_init__(self) -> None:
        for level in self.chosen_by:
            one_of("each of chosen_by", level, LEVELS)
        positive("factor", self.factor)


def neo_hookean(
    shear_kpa: Sequence[float], poisson: float = LONG_TERM, prony: Prony | None = None
) -> Tissues:
    """Four neo-Hookean layers from long-term shear moduli [kPa], outside in; they relax as skin by default.

    Examples
    --------
    >>> neo_hookean(HUMAN_KPA) == named_tissues("human")
    True
    """
    relaxing = skin_prony() if prony is None else prony
    return Tissues(*(Material.neo_hooke(shear, poisson, relaxing) for shear in shear_kpa))


HUMAN = Candidate("human", named_tissues("human"), STRESS, LEVELS, finalist=True)
PAPER = Candidate("paper", named_tissues("paper"), SED, ("deflection", "firing"), finalist=True)


def candidates() -> tuple[Candidate, ...]:
    """All that is compared.

    Examples
    --------
    >>> [candidate.name for candidate in candidates()][:3]
    ['human', 'human, SED', 'human, SED^0.5']
    """
    drives = (SED, Reading(exponent=0.5), Reading("von_mises"))
    return (
        HUMAN,
        *(replace(HUMAN, name=f"human, {drive}", reading=drive, finalist=False) for drive in drives),
        Candidate("54/12.4/6.9/1.9", neo_hookean(STIFFER_KPA), STRESS, LEVELS),
        Candidate("32/8/8/1.9", neo_hookean(SOFTER_KPA), STRESS, LEVELS),
        PAPER,
        replace(PAPER, name="paper, compressive stress", reading=STRESS),
        replace(
            PAPER,
            name="paper, force of people",
            factor=FORCE_FACTOR,
            chosen_by=("deflection", "force", "firing"),
        ),
        Candidate("Trial 1", named_tissues("trial1"), SED),
        Candidate("Trial 3", named_tissues("trial3"), SED, ("deflection",)),
        Candidate("Trial 3, Wu", named_tissues("trial3_wu"), SED),
        Candidate("laboratory 2014", named_tissues("gerling2014_fit"), SED, ("deflection",)),
    )
