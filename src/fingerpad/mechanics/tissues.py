"""Sets of tissues by name: the paper's three trials, and what other publications measured or fitted."""

from __future__ import annotations

from collections.abc import Callable

from fingerpad.core.checked import checked
from fingerpad.core.units import MS_PER_S
from fingerpad.core.values import one_of
from fingerpad.data import tissues as published
from fingerpad.data.published import Published
from fingerpad.mechanics.materials import Material, Prony, Tissues

NU = published.POISSON_RATIO.value
LONG_TERM = published.LONG_TERM_POISSON.value


def skin_prony() -> Prony:
    """Relaxation of skin (Wu 2004), used in every layer as in the paper's trials."""
    times = tuple(MS_PER_S * time_s for time_s in published.SKIN_PRONY_TIMES.value)
    return Prony(published.SKIN_PRONY_SHARES.value, times)


def _linear(young: Published, poisson: float = NU) -> Material:
    return Material.linear_elastic(young.value, poisson, skin_prony())


def _shear(shear: Published, poisson: float = NU) -> Material:
    return Material.neo_hooke(shear.value, poisson, skin_prony())


def _foam(moduli: Published, exponents: Published) -> Material:
    poisson = published.WU_HYPERFOAM_POISSON.value
    return Material.hyperfoam(moduli.value, exponents.value, poisson, skin_prony())


def _layers(epidermis_young: Published, inner: tuple[Material, Material]) -> Tissues:
    """Linear elastic epidermis over dermis and subcutis."""
    epidermis = _linear(epidermis_young)
    return Tissues(epidermis, epidermis, *inner)


SOFT, STIFF = published.MAENO_EPIDERMIS_YOUNG, published.WU_EPIDERMIS_YOUNG
"""Young's moduli of the epidermis."""


def _maeno() -> tuple[Material, Material]:
    return _linear(published.MAENO_DERMIS_YOUNG), _linear(published.MAENO_SUBCUTIS_YOUNG)


def _hyperelastic() -> tuple[Material, Material]:
    """Dermis and subcutis of Trials 2 and 3: stand-ins for the lost Table 2."""
    return _shear(published.SOFT_MIX_DERMIS_SHEAR), _shear(published.SOFT_MIX_SUBCUTIS_SHEAR)


def _stiffening() -> tuple[Material, Material]:
    """Return the same with a second coefficient, the initial moduli being the same."""
    dermis, subcutis = (
        Material.polynomial(c10, 0.0, published.STIFFENING_RATIO.value * c10, 0.0, 0.0, NU, skin_prony())
        for c10 in (published.SOFT_MIX_DERMIS_SHEAR.value / 2, published.SOFT_MIX_SUBCUTIS_SHEAR.value / 2)
    )
    return dermis, subcutis


def _polynomial(coefficients: Published, poisson: float = NU) -> Material:
    c10, c01, c20, c11, c02 = coefficients.value
    return Material.polynomial(c10, c01, c20, c11, c02, poisson, skin_prony())


def _wu_polynomials() -> tuple[Material, Material]:
    """Dermis and subcutis after Wu, nearly incompressible like the other layers."""
    return _polynomial(published.WU_SKIN_POLYNOMIAL), _polynomial(published.WU_SUBCUTIS_POLYNOMIAL)


def _paper() -> Tissues:
    """Trial 3 with another Poisson's ratio and nothing else changed."""
    epidermis = _linear(SOFT, LONG_TERM)
    inner = (published.SOFT_MIX_DERMIS_SHEAR, published.SOFT_MIX_SUBCUTIS_SHEAR)
    return Tissues(epidermis, epidermis, *(_shear(shear, LONG_TERM) for shear in inner))


def _human() -> Tissues:
    """Layers whose energy has a term in (I1 - 3)², by which they stiffen where they are strained."""
    layers = (
        published.HUMAN_STRATUM_CORNEUM,
        published.HUMAN_LIVING_EPIDERMIS,
        published.HUMAN_DERMIS,
        published.HUMAN_SUBCUTIS,
    )
    return Tissues(*(_polynomial(layer, LONG_TERM) for layer in layers))


def _laboratory() -> Tissues:
    epidermis = _shear(published.LABORATORY_EPIDERMIS_SHEAR)
    inner = (_shear(published.LABORATORY_DERMIS_SHEAR), _shear(published.LABORATORY_SUBCUTIS_SHEAR))
    return Tissues(epidermis, epidermis, *inner)


TISSUES: dict[str, Callable[[], Tissues]] = {
    # One set for deflection, force, firing and percept, with an afferent of its own.
    "human": _human,
    # Closest to the paper's printed numbers; strain energy density drives both terms.
    "paper": _paper,
    # All layers linear elastic after Maeno, with a Prony series.
    "trial1": lambda: _layers(SOFT, _maeno()),
    # Stiff epidermis over the hyperelastic dermis and subcutis.
    "trial2": lambda: _layers(STIFF, _hyperelastic()),
    # Trial 1's soft epidermis over Trial 2's hyperelastic dermis and subcutis.
    "trial3": lambda: _layers(SOFT, _hyperelastic()),
    # Wu's hyperfoams rewritten as polynomials N = 2: the paper's words taken literally.
    "trial2_wu": lambda: _layers(STIFF, _wu_polynomials()),
    "trial3_wu": lambda: _layers(SOFT, _wu_polynomials()),
    # Trial 3 whose dermis and subcutis stiffen.
    "trial3_stiffening": lambda: _layers(SOFT, _stiffening()),
    # Linear elastic layers after Maeno, without relaxation.
    "maeno1998": lambda: Tissues(*(layer.with_prony(Prony()) for layer in _layers(SOFT, _maeno()).layers)),
    # Wu's hyperfoams in dermis and subcutis, nearly a tenth as stiff as Maeno's, under a stiff epidermis.
    "wu2007": lambda: _layers(
        STIFF,
        (
            _foam(published.WU_SKIN_HYPERFOAM_MU, published.WU_SKIN_HYPERFOAM_ALPHA),
            _foam(published.WU_SUBCUTIS_HYPERFOAM_MU, published.WU_SUBCUTIS_HYPERFOAM_ALPHA),
        ),
    ),
    # Neo-Hookean fit of this fingertip, published later by the authors' laboratory.
    "gerling2014_fit": _laboratory,
}


@checked
def named_tissues(name: str) -> Tissues:
    """Tissues by name.

    Examples
    --------
    >>> round(named_tissues("trial1").dermis.shear_modulus_kpa, 2)
    27.03
    """
    return TISSUES[one_of("tissues", name, tuple(TISSUES))]()


def name_of_tissues(tissues: Tissues) -> str:
    """Name of a set of tissues that ships; empty for any other."""
    return next((name for name, made in TISSUES.items() if made() == tissues), "")
