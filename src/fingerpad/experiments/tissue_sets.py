"""Every named set of tissues, layer by layer: law, moduli, Poisson's ratio, relaxation, source and status."""

from __future__ import annotations

from typing import TypeAlias

from fingerpad.core.checked import result_class
from fingerpad.data import tissues as published
from fingerpad.data.published import Published
from fingerpad.geometry.mesh import LAYERS
from fingerpad.mechanics.laws import Hyperfoam, Polynomial
from fingerpad.mechanics.materials import Material
from fingerpad.mechanics.tissues import TISSUES, named_tissues

Numbers: TypeAlias = tuple[Published[float] | Published[tuple[float, ...]], ...]

_SOFT, _STIFF = (published.MAENO_EPIDERMIS_YOUNG,), (published.WU_EPIDERMIS_YOUNG,)
_MAENO = ((published.MAENO_DERMIS_YOUNG,), (published.MAENO_SUBCUTIS_YOUNG,))
_IDENTIFIED = ((published.SOFT_MIX_DERMIS_SHEAR,), (published.SOFT_MIX_SUBCUTIS_SHEAR,))
_POLYNOMIALS = ((published.WU_SKIN_POLYNOMIAL,), (published.WU_SUBCUTIS_POLYNOMIAL,))
_FOAMS = (
    (published.WU_SKIN_HYPERFOAM_MU, published.WU_SKIN_HYPERFOAM_ALPHA),
    (published.WU_SUBCUTIS_HYPERFOAM_MU, published.WU_SUBCUTIS_HYPERFOAM_ALPHA),
)
_STIFFENING = tuple((*numbers, published.STIFFENING_RATIO) for numbers in _IDENTIFIED)
_LABORATORY = (published.LABORATORY_EPIDERMIS_SHEAR,)

ELASTICITY: dict[str, tuple[Numbers, ...]] = {
    "human": (
        (published.HUMAN_STRATUM_CORNEUM,),
        (published.HUMAN_LIVING_EPIDERMIS,),
        (published.HUMAN_DERMIS,),
        (published.HUMAN_SUBCUTIS,),
    ),
    "paper": (_SOFT, _SOFT, *_IDENTIFIED),
    "trial1": (_SOFT, _SOFT, *_MAENO),
    "trial2": (_STIFF, _STIFF, *_IDENTIFIED),
    "trial3": (_SOFT, _SOFT, *_IDENTIFIED),
    "trial2_wu": (_STIFF, _STIFF, *_POLYNOMIALS),
    "trial3_wu": (_SOFT, _SOFT, *_POLYNOMIALS),
    "trial3_stiffening": (_SOFT, _SOFT, *_STIFFENING),
    "maeno1998": (_SOFT, _SOFT, *_MAENO),
    "wu2007": (_STIFF, _STIFF, *_FOAMS),
    "gerling2014_fit": (
        _LABORATORY,
        _LABORATORY,
        (published.LABORATORY_DERMIS_SHEAR,),
        (published.LABORATORY_SUBCUTIS_SHEAR,),
    ),
}  # Published numbers behind the moduli of every layer of every set, from the skin inwards.

_RATIOS = (published.LONG_TERM_POISSON, published.POISSON_RATIO, published.WU_HYPERFOAM_POISSON)


@result_class
class TissueLayer:
    """One layer of a named set of tissues."""

    tissues: str
    layer: str  #: Name of the set, and of the layer.
    law: str  #: Strain energy.
    shear_kpa: float
    shear_at_once_kpa: float  #: Shear modulus for small strains, long-term and instantaneous. [kPa]
    poisson: float
    poisson_at_once: float
    """Poisson's ratio for small strains, long-term and instantaneous: only the deviator relaxes."""
    prony_shares: tuple[float, ...]
    prony_times_s: tuple[float, ...]
    """Shares of the instantaneous modulus that relax, and their times. [1, s]"""
    modulus_status: str
    poisson_status: str
    prony_status: str  #: Status of these numbers, see `fingerpad.data.STATUSES`; empty without relaxation.
    source: str  #: Of the moduli.


def tissue_layers() -> tuple[TissueLayer, ...]:
    """Describe every layer of every named set of tissues."""
    return tuple(
        _layer(tissues, layer, material, numbers)
        for tissues in TISSUES
        for layer, material, numbers in zip(
            LAYERS, named_tissues(tissues).layers, ELASTICITY[tissues], strict=True
        )
    )


def _layer(tissues: str, layer: str, material: Material, numbers: Numbers) -> TissueLayer:
    shear, bulk = material.shear_modulus_kpa, material.bulk_modulus_kpa
    at_once = material.instantaneous_factor * shear
    ratio = next(number for number in _RATIOS if abs(number.value - material.poisson) < 1e-9)
    relaxes = material.prony.shares != ()
    return TissueLayer(
        tissues=tissues,
        layer=layer,
        law=_law(material),
        shear_kpa=shear,
        shear_at_once_kpa=at_once,
        poisson=material.poisson,
        poisson_at_once=(3.0 * bulk - 2.0 * at_once) / (2.0 * (3.0 * bulk + at_once)),
        prony_shares=material.prony.shares,
        prony_times_s=published.SKIN_PRONY_TIMES.value if relaxes else (),
        modulus_status=" and ".join(dict.fromkeys(number.status for number in numbers)),
        poisson_status=ratio.status,
        prony_status=published.SKIN_PRONY_SHARES.status if relaxes else "",
        source="; ".join(dict.fromkeys(number.source for number in numbers)),
    )


def _law(material: Material) -> str:
    law = material.law
    if isinstance(law, Polynomial):
        return "polynomial N = 2" if any((law.c01, law.c20, law.c11, law.c02)) else "neo-Hooke"
    if isinstance(law, Hyperfoam):
        return f"hyperfoam N = {len(law.exponents)}"
    return type(law).__name__
