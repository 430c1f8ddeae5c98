"""What the search for tissues compares: tissues, what drives the afferent, and what each was chosen by."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass, replace

from fingerpad.core.checks import one_of, positive
from fingerpad.core.errors import InputError
from fingerpad.core.signals import STORED_ENERGY
from fingerpad.core.units import MS_PER_S
from fingerpad.data import tissues as published
from fingerpad.data.published import Published
from fingerpad.mechanics.materials import Material, Prony, Tissues
from fingerpad.mechanics.tissues import LONG_TERM, NU, named_tissues, skin_prony
from studies.drive_quantities import QUANTITIES
from studies.hyperfoam_fit import polynomial_of_hyperfoam

SOFT_EPIDERMIS_KPA = published.MAENO_EPIDERMIS_YOUNG.value / (2.0 * (1.0 + NU))
STIFF_EPIDERMIS_KPA = published.WU_EPIDERMIS_YOUNG.value / (2.0 * (1.0 + NU))
"""Shear moduli of the two epidermes of the paper's trials. [kPa]"""

HUMAN_KPA = (
    published.HUMAN_STRATUM_CORNEUM_SHEAR.value,
    published.HUMAN_LIVING_EPIDERMIS_SHEAR.value,
    published.HUMAN_DERMIS_SHEAR.value,
    published.HUMAN_SUBCUTIS_SHEAR.value,
)
"""Long-term shear moduli of the set `human`, from the outside in. [kPa]"""

STIFFER_KPA, SOFTER_KPA = (54.0, 12.4, 6.9, 1.9), (32.0, 8.0, 8.0, 1.9)
"""Sets of the same kind with stiffer and with softer outer layers; `human` lies between them. [kPa]"""

LAYER_NAMES = ("stratum corneum", "living epidermis", "dermis", "subcutis")

LEVELS = ("deflection", "force", "firing", "percept")
"""What is observed, from the skin to the judgement."""

CHANGE = 2.0
"""Factor by which a modulus is changed at a time."""

TRIAL3_POISSON = (0.45, 0.42, 0.38, 0.35, 0.30)
"""Poisson's ratios of Trial 3 besides its own 0.48 and that of `paper`, 0.40."""

FORCE_FACTOR = 0.39
"""Common factor that gives `paper` the force of people."""

DERMIS_MM, DEEPER_DERMIS_MM = 0.5, 0.9
"""Depths just below the border of epidermis and dermis, and in the second layer of dermal elements. [mm]"""


@dataclass(frozen=True)
class Reading:
    """A quantity in the skin that drives an afferent.

    Parameters
    ----------
    quantity : str
        One of `studies.drive_quantities.QUANTITIES`.
    exponent : float
        Power to which it is raised in both terms of the current.
    depth_mm : float or None
        Depth of the layer of elements in which it is read; None for the living epidermis just above the
        border to the dermis, as in the paper. Only the stored energy density is kept in other layers. [mm]

    Raises
    ------
    InputError
        If the quantity is unknown or not kept at that depth, or a number is not positive.

    Examples
    --------
    >>> print(Reading(exponent=0.5), "|", Reading("von_mises"), "|", Reading(depth_mm=0.9))
    SED^0.5 | von Mises stress | SED at 0.9 mm
    """

    quantity: str = STORED_ENERGY
    exponent: float = 1.0
    depth_mm: float | None = None

    def __post_init__(self) -> None:
        one_of("quantity", self.quantity, QUANTITIES)
        positive("exponent", self.exponent)
        if self.depth_mm is not None:
            positive("depth_mm", self.depth_mm, "mm")
            if self.quantity != STORED_ENERGY:
                raise InputError(
                    f"depth_mm can only be set for the stored energy density: got {self.quantity}."
                )

    def __str__(self) -> str:
        name = {STORED_ENERGY: "SED", "von_mises": "von Mises stress"}.get(self.quantity, self.quantity)
        power = "" if self.exponent == 1.0 else f"^{self.exponent:g}"
        depth = "" if self.depth_mm is None else f" at {self.depth_mm:g} mm"
        return f"{name.replace('_', ' ')}{power}{depth}"


SED, STRESS = Reading(), Reading("compressive_stress")


@dataclass(frozen=True)
class Candidate:
    """Tissues and a drive that are tried together.

    Parameters
    ----------
    name : str
        Short, unique within a study.
    tissues : Tissues
        Laws of the four layers.
    reading : Reading
        What the static term of the current follows, and the dynamic term unless `dynamic` is given.
    basis : str
        Where the numbers come from, and their status.
    chosen_by : tuple of str
        Those of `LEVELS` whose observations were used to choose tissues or reading: there the result is in
        sample. On the others it is a prediction.
    dynamic : Reading, optional
        What the dynamic term follows.
    factor : float
        Common factor on all moduli. At a prescribed depth it multiplies forces and stresses, and the gains of
        the afferent compensate for it, so that it needs no press of its own.
    finalist : bool
        Press the bar at all 36 shifts instead of reading one bar at shifted sites, and press further spheres
        for the Weber fractions.

    Raises
    ------
    InputError
        If a level is unknown or the factor is not positive.
    """

    name: str
    tissues: Tissues
    reading: Reading
    basis: str
    chosen_by: tuple[str, ...] = ()
    dynamic: Reading | None = None
    factor: float = 1.0
    finalist: bool = False

    def __post_init__(self) -> None:
        for level in self.chosen_by:
            one_of("each of chosen_by", level, LEVELS)
        positive("factor", self.factor)

    @property
    def drive(self) -> str:
        """What drives the afferent, in words."""
        if self.dynamic is None:
            return str(self.reading)
        return f"{self.reading} (static), {self.dynamic} (dynamic)"


def layered(epidermis_kpa: float, dermis: float | Material, subcutis: float | Material) -> Tissues:
    """Tissues from shear moduli [kPa] or laws of dermis and subcutis, relaxing as in the paper's trials.

    Examples
    --------
    >>> layered(46.0, 25.4, 4.75).subcutis.shear_modulus_kpa
    4.75
    """
    epidermis, inner, fat = (
        layer if isinstance(layer, Material) else Material.neo_hooke(layer, NU, skin_prony())
        for layer in (epidermis_kpa, dermis, subcutis)
    )
    return Tissues(epidermis, epidermis, inner, fat)


def neo_hookean(
    shear_kpa: Sequence[float], poisson: float | Sequence[float] = LONG_TERM, prony: Prony | None = None
) -> Tissues:
    """Four neo-Hookean layers.

    Parameters
    ----------
    shear_kpa : sequence of float
        Long-term shear moduli from the outside in. [kPa]
    poisson : float or sequence of float
        Long-term Poisson's ratio of all layers, or of each.
    prony : Prony, optional
        Relaxation of all layers; that of skin by default.

    Returns
    -------
    Tissues

    Examples
    --------
    >>> round(neo_hookean(HUMAN_KPA, (0.4, 0.4, 0.4, 0.48)).subcutis.poisson, 2)
    0.48
    """
    ratios = [poisson] * len(LAYER_NAMES) if isinstance(poisson, int | float) else poisson
    relaxing = skin_prony() if prony is None else prony
    return Tissues(
        *(Material.neo_hooke(shear, ratio, relaxing) for shear, ratio in zip(shear_kpa, ratios, strict=True))
    )


def mouse_prony() -> Prony:
    """Relaxation of mouse skin: much of it within the 1 s of the hold."""
    times_ms = tuple(MS_PER_S * time_s for time_s in published.MOUSE_PRONY_TIMES.value)
    return Prony(published.MOUSE_PRONY_SHARES.value, times_ms)


def trial1(poisson: float) -> Tissues:
    """Trial 1 with another Poisson's ratio and the same Young's moduli.

    Examples
    --------
    >>> round(trial1(0.40).dermis.shear_modulus_kpa * 2.8)
    80
    """
    soft = published.MAENO_EPIDERMIS_YOUNG.value
    young = (soft, soft, published.MAENO_DERMIS_YOUNG.value, published.MAENO_SUBCUTIS_YOUNG.value)
    return neo_hookean([each / (2.0 * (1.0 + poisson)) for each in young], poisson)


def trial3(poisson: float) -> Tissues:
    """Trial 3 with another Poisson's ratio, Young's modulus of the epidermis and inner moduli kept.

    Examples
    --------
    >>> trial3(0.40) == named_tissues("paper")
    True
    """
    epidermis = published.MAENO_EPIDERMIS_YOUNG.value / (2.0 * (1.0 + poisson))
    inner = (published.SOFT_MIX_DERMIS_SHEAR.value, published.SOFT_MIX_SUBCUTIS_SHEAR.value)
    return neo_hookean((epidermis, epidermis, *inner), poisson)


def wu_polynomials(curve_poisson: float, poisson: float) -> tuple[Material, Material]:
    """Dermis and subcutis as polynomials N = 2 fitted to Wu's hyperfoams.

    Parameters
    ----------
    curve_poisson : float
        Poisson's ratio of the hyperfoam whose stress is fitted: Wu's 0.40, or another.
    poisson : float
        Poisson's ratio of the polynomial.

    Returns
    -------
    dermis, subcutis : Material

    Examples
    --------
    >>> dermis, subcutis = wu_polynomials(0.48, 0.48)
    >>> round(dermis.shear_modulus_kpa, 2), round(subcutis.shear_modulus_kpa, 2)
    (1.03, 0.52)
    """

    def fitted(mu: Published, alpha: Published) -> Material:
        c10, c01, c20, c11, c02 = polynomial_of_hyperfoam(mu.value, alpha.value, curve_poisson)[0].tolist()
        return Material.polynomial(c10, c01, c20, c11, c02, poisson, skin_prony())

    return (
        fitted(published.WU_SKIN_HYPERFOAM_MU, published.WU_SKIN_HYPERFOAM_ALPHA),
        fitted(published.WU_SUBCUTIS_HYPERFOAM_MU, published.WU_SUBCUTIS_HYPERFOAM_ALPHA),
    )


def human_over_polynomials() -> Tissues:
    """`human` whose inner layers stiffen like Wu's polynomials, at the same initial moduli."""

    def stiffening(material: Material, shear_kpa: float) -> Material:
        law, factor = material.law, shear_kpa / material.shear_modulus_kpa
        c10, c01, c20, c11, c02 = (
            factor * getattr(law, name) for name in ("c10", "c01", "c20", "c11", "c02")
        )
        return Material.polynomial(c10, c01, c20, c11, c02, LONG_TERM, skin_prony())

    inner = zip(wu_polynomials(LONG_TERM, LONG_TERM), HUMAN_KPA[2:], strict=True)
    dermis, subcutis = (stiffening(material, shear) for material, shear in inner)
    return replace(named_tissues("human"), dermis=dermis, subcutis=subcutis)


def human_over_foams() -> Tissues:
    """`human` whose inner layers are Wu's hyperfoams, scaled to the same initial moduli."""
    layers = (
        (published.WU_SKIN_HYPERFOAM_MU, published.WU_SKIN_HYPERFOAM_ALPHA),
        (published.WU_SUBCUTIS_HYPERFOAM_MU, published.WU_SUBCUTIS_HYPERFOAM_ALPHA),
    )
    dermis, subcutis = (
        Material.hyperfoam(
            [shear * modulus / sum(mu.value) for modulus in mu.value], alpha.value, LONG_TERM, skin_prony()
        )
        for (mu, alpha), shear in zip(layers, HUMAN_KPA[2:], strict=True)
    )
    return replace(named_tissues("human"), dermis=dermis, subcutis=subcutis)


def human_with(**changed_kpa: float) -> Tissues:
    """`human` with some of its moduli replaced, by the names of `Tissues`. [kPa]

    Examples
    --------
    >>> human_with(stratum_corneum=99.2).stratum_corneum.shear_modulus_kpa
    99.2
    """
    layers = {name: Material.neo_hooke(shear, LONG_TERM, skin_prony()) for name, shear in changed_kpa.items()}
    return replace(named_tissues("human"), **layers)


HUMAN = Candidate(
    "human", named_tissues("human"), STRESS, "assumed, chosen by a scan of moduli", LEVELS, finalist=True
)

OUTER_RATIOS = (1.0, 2.0, 8.0)
"""Stiffness of the stratum corneum over that of the living epidermis; it is 4.1 in `human`."""


def candidates() -> tuple[Candidate, ...]:
    """All that is compared.

    Examples
    --------
    >>> [candidate.name for candidate in candidates()][:4]
    ['human', 'human, SED', 'human, SED^0.5', 'human, von Mises stress']
    """
    drives = (
        SED,
        Reading(exponent=0.5),
        Reading("von_mises"),
        Reading("compressive_strain"),
        Reading(depth_mm=DERMIS_MM),
        Reading(depth_mm=DEEPER_DERMIS_MM),
    )
    tissues_of_human = (
        *(replace(HUMAN, name=f"human, {drive}", reading=drive, finalist=False) for drive in drives),
        replace(HUMAN, name="human, SED and stress", reading=SED, dynamic=STRESS, finalist=False),
    )
    stiffer, softer = (
        Candidate(name, neo_hookean(moduli), STRESS, "assumed, chosen by a scan of moduli", LEVELS)
        for name, moduli in (("54/12.4/6.9/1.9", STIFFER_KPA), ("32/8/8/1.9", SOFTER_KPA))
    )
    paper = Candidate(
        "paper",
        named_tissues("paper"),
        SED,
        "Trial 3 with nu 0.40 (recalled)",
        ("deflection", "firing"),
        finalist=True,
    )
    stratum_corneum = (
        Candidate(
            f"stratum corneum {ratio:g}x",
            human_with(stratum_corneum=ratio * HUMAN_KPA[1]),
            STRESS,
            f"`human` with a stratum corneum {ratio:g} times as stiff as the living epidermis, assumed",
        )
        for ratio in OUTER_RATIOS
    )
    return (
        HUMAN,
        *tissues_of_human,
        stiffer,
        softer,
        replace(softer, name="32/8/8/1.9, SED^0.5", reading=Reading(exponent=0.5)),
        *stratum_corneum,
        Candidate(
            "stiff living epidermis",
            human_with(living_epidermis=HUMAN_KPA[0]),
            STRESS,
            "`human` with a living epidermis as stiff as its stratum corneum, assumed",
        ),
        Candidate(
            "polynomials inside",
            human_over_polynomials(),
            STRESS,
            "`human` over Wu's curves as polynomials, assumed",
        ),
        Candidate(
            "hyperfoams inside", human_over_foams(), STRESS, "`human` over Wu's scaled hyperfoams, assumed"
        ),
        Candidate(
            "relaxation of mouse skin",
            neo_hookean(HUMAN_KPA, prony=mouse_prony()),
            STRESS,
            "`human` with another Prony series (read, another species)",
        ),
        paper,
        replace(paper, name="paper, compressive stress", reading=STRESS),
        replace(
            paper,
            name="paper, force of people",
            factor=FORCE_FACTOR,
            chosen_by=("deflection", "force", "firing"),
            basis="`paper` with all moduli times a common factor",
        ),
        Candidate("Trial 1", named_tissues("trial1"), SED, "Maeno, recalled"),
        Candidate("Trial 1, nu 0.40", trial1(0.40), SED, "Maeno, recalled", ("firing",)),
        Candidate("Trial 3", named_tissues("trial3"), SED, "assumed, from the profile", ("deflection",)),
        *(
            Candidate(
                f"Trial 3, nu {poisson:.2f}",
                trial3(poisson),
                SED,
                "as Trial 3, another Poisson's ratio",
                ("deflection", "firing"),
            )
            for poisson in TRIAL3_POISSON
        ),
        Candidate("Trial 3, Wu", named_tissues("trial3_wu"), SED, "polynomials after Wu, recalled"),
        Candidate(
            "Trial 3, Wu, compressive stress",
            named_tissues("trial3_wu"),
            STRESS,
            "polynomials after Wu, recalled",
        ),
        Candidate("laboratory 2014", named_tissues("gerling2014_fit"), SED, "read", ("deflection",)),
    )


def variations() -> tuple[Candidate, ...]:
    """Return changes of one parameter of `human` at a time, named by it; the bar is pressed once."""
    changed_moduli = {
        f"{layer}, modulus x {CHANGE:g}": human_with(**{layer.replace(" ", "_"): CHANGE * shear})
        for layer, shear in zip(LAYER_NAMES, HUMAN_KPA, strict=True)
    }
    ratios: dict[str, float | Sequence[float]] = {
        "nu 0.48 in all layers": 0.48,
        "nu 0.45 in all layers": 0.45,
        "nu 0.35 in all layers": 0.35,
        "nu 0.48 in stratum corneum and epidermis": (0.48, 0.48, LONG_TERM, LONG_TERM),
        "nu 0.48 in dermis and subcutis": (LONG_TERM, LONG_TERM, 0.48, 0.48),
    }
    tissues = {
        **changed_moduli,
        **{name: neo_hookean(HUMAN_KPA, poisson) for name, poisson in ratios.items()},
        "no relaxation": neo_hookean(HUMAN_KPA, prony=Prony()),
        "relaxation of mouse skin": neo_hookean(HUMAN_KPA, prony=mouse_prony()),
        "dermis and subcutis: polynomials": human_over_polynomials(),
        "dermis and subcutis: hyperfoams": human_over_foams(),
    }
    drives = (
        replace(STRESS, exponent=0.5),
        replace(STRESS, exponent=2.0),
        SED,
        Reading(exponent=0.5),
        Reading("von_mises"),
        Reading(depth_mm=DEEPER_DERMIS_MM),
    )
    base = replace(HUMAN, chosen_by=(), finalist=False)
    return (
        replace(base, name=f"all moduli x {CHANGE:g}", factor=CHANGE),
        *(replace(base, name=name, tissues=changed) for name, changed in tissues.items()),
        *(replace(base, name=f"drive: {drive}", reading=drive) for drive in drives),
    )
