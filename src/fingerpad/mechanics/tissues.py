"""Sets of tissues by name: the paper's three trials, and what other publications measured or fitted."""

from __future__ import annotations

from collections.abc import Callable

from fingerpad.core.checks import one_of
from fingerpad.core.units import MS_PER_S
from fingerpad.data import tissues as published
from fingerpad.data.published import Published
from fingerpad.mechanics.materials import Material, Prony, Tissues

NU = published.POISSON_RATIO.value


def skin_prony() -> Prony:
    """Relaxation of skin (Wu 2004), used in every layer as in the paper's trials."""
    times = tuple(MS_PER_S * time_s for time_s in published.SKIN_PRONY_TIMES.value)
    return Prony(published.SKIN_PRONY_SHARES.value, times)


def _linear(young: Published) -> Material:
    return Material.linear_elastic(young.value, NU, skin_prony())


def _shear(shear: Published) -> Material:
    return Material.neo_hooke(shear.value, NU, skin_prony())


def _foam(moduli: Published, exponents: Published) -> Material:
    poisson = published.WU_HYPERFOAM_POISSON.value
    return Material.hyperfoam(moduli.value, exponents.value, poisson, skin_prony())


def trial_1() -> Tissues:
    """All layers linear elastic after Maeno, with a Prony series."""
    epidermis = _linear(published.MAENO_EPIDERMIS_YOUNG)
    dermis, subcutis = _linear(published.MAENO_DERMIS_YOUNG), _linear(published.MAENO_SUBCUTIS_YOUNG)
    return Tissues(epidermis, epidermis, dermis, subcutis)


def trial_2() -> Tissues:
    """Stiff epidermis over the hyperelastic dermis and subcutis."""
    epidermis = _linear(published.WU_EPIDERMIS_YOUNG)
    return Tissues(epidermis, epidermis, *_hyperelastic())


def trial_3() -> Tissues:
    """Trial 1's soft epidermis over Trial 2's hyperelastic dermis and subcutis."""
    epidermis = _linear(published.MAENO_EPIDERMIS_YOUNG)
    return Tissues(epidermis, epidermis, *_hyperelastic())


def trial_2_wu() -> Tissues:
    """Trial 2 with Wu's hyperfoams rewritten as polynomials N = 2."""
    epidermis = _linear(published.WU_EPIDERMIS_YOUNG)
    return Tissues(epidermis, epidermis, *_wu_polynomials())


def trial_3_wu() -> Tissues:
    """Trial 3 with Wu's hyperfoams rewritten as polynomials N = 2: the paper's words taken literally."""
    epidermis = _linear(published.MAENO_EPIDERMIS_YOUNG)
    return Tissues(epidermis, epidermis, *_wu_polynomials())


def trial_3_stiffening() -> Tissues:
    """Trial 3 whose dermis and subcutis stiffen, the initial moduli being the same."""
    epidermis = _linear(published.MAENO_EPIDERMIS_YOUNG)
    dermis, subcutis = (
        Material.polynomial(c10, 0.0, published.STIFFENING_RATIO.value * c10, 0.0, 0.0, NU, skin_prony())
        for c10 in (published.SOFT_MIX_DERMIS_SHEAR.value / 2, published.SOFT_MIX_SUBCUTIS_SHEAR.value / 2)
    )
    return Tissues(epidermis, epidermis, dermis, subcutis)


def maeno_1998() -> Tissues:
    """Linear elastic layers after Maeno, without relaxation."""
    return Tissues(*(layer.with_prony(Prony()) for layer in trial_1().layers))


def wu_2007() -> Tissues:
    """Wu's hyperfoams in dermis and subcutis, nearly a tenth as stiff as Maeno's, under a stiff epidermis."""
    epidermis = _linear(published.WU_EPIDERMIS_YOUNG)
    dermis = _foam(published.WU_SKIN_HYPERFOAM_MU, published.WU_SKIN_HYPERFOAM_ALPHA)
    subcutis = _foam(published.WU_SUBCUTIS_HYPERFOAM_MU, published.WU_SUBCUTIS_HYPERFOAM_ALPHA)
    return Tissues(epidermis, epidermis, dermis, subcutis)


def gerling_2014_fit() -> Tissues:
    """Neo-Hookean fit of this fingertip, published later by the authors' laboratory."""
    epidermis = _shear(published.LABORATORY_EPIDERMIS_SHEAR)
    dermis, subcutis = _shear(published.LABORATORY_DERMIS_SHEAR), _shear(published.LABORATORY_SUBCUTIS_SHEAR)
    return Tissues(epidermis, epidermis, dermis, subcutis)


def _hyperelastic() -> tuple[Material, Material]:
    """Dermis and subcutis of Trials 2 and 3: stand-ins for the lost Table 2."""
    return _shear(published.SOFT_MIX_DERMIS_SHEAR), _shear(published.SOFT_MIX_SUBCUTIS_SHEAR)


def _wu_polynomials() -> tuple[Material, Material]:
    """Dermis and subcutis after Wu, nearly incompressible like the other layers."""
    dermis, subcutis = (
        Material.polynomial(c10, c01, c20, c11, c02, NU, skin_prony())
        for c10, c01, c20, c11, c02 in (
            published.WU_SKIN_POLYNOMIAL.value,
            published.WU_SUBCUTIS_POLYNOMIAL.value,
        )
    )
    return dermis, subcutis


TISSUES: dict[str, Callable[[], Tissues]] = {
    "trial1": trial_1,
    "trial2": trial_2,
    "trial3": trial_3,
    "trial2_wu": trial_2_wu,
    "trial3_wu": trial_3_wu,
    "trial3_stiffening": trial_3_stiffening,
    "maeno1998": maeno_1998,
    "wu2007": wu_2007,
    "gerling2014_fit": gerling_2014_fit,
}


def named_tissues(name: str) -> Tissues:
    """Tissues by name.

    Examples
    --------
    >>> round(named_tissues("trial1").dermis.shear_modulus_kpa, 2)
    27.03
    """
    return TISSUES[one_of("materials", name, tuple(TISSUES))]()
