"""Constitutive laws: one polynomial strain energy, a volumetric penalty and a Prony series.

    W(I1, I2) = C10 (I1-3) + C01 (I2-3) + C20 (I1-3)² + C11 (I1-3)(I2-3) + C02 (I2-3)²
    U(J)      = (J-1)²/D1 + (J-1)⁴/D2

with the invariants of the isochoric part of the deformation (paper, 2.2.1: polynomial N = 2). Neo-Hooke and
Mooney-Rivlin are the same law with coefficients zero, and a "linear elastic" layer at finite strain is read
as neo-Hooke with the same shear and bulk modulus (docs/decisions/linear-elastic.md).
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass, fields, replace

import numpy as np

from fingerpad.checks import FloatArray, finite, float_array, not_negative, one_of, positive
from fingerpad.errors import InputError


@dataclass(frozen=True)
class Prony:
    """Relaxation of the deviatoric stress: g(t) = 1 - sum g_i (1 - exp(-t / tau_i)).

    Parameters
    ----------
    shares : tuple of float
        g_i, relative to the instantaneous modulus; each not negative, their sum below 1.
    times_ms : tuple of float
        tau_i, each above 0. [ms]

    Raises
    ------
    InputError
        If a share or time is out of range or their numbers differ.

    Examples
    --------
    >>> Prony(shares=(0.148, 0.252), times_ms=(2123.0, 9371.0)).long_term_share
    0.6
    """

    shares: tuple[float, ...] = ()
    times_ms: tuple[float, ...] = ()

    def __post_init__(self) -> None:
        if len(self.shares) != len(self.times_ms):
            raise InputError(
                "Prony needs one time per share: "
                f"got {len(self.shares)} shares and {len(self.times_ms)} times."
            )
        for share, time in zip(self.shares, self.times_ms, strict=True):
            not_negative("each Prony share", share)
            positive("each Prony time", time, "ms")
        if sum(self.shares) >= 1.0:
            raise InputError(f"Prony shares must sum to less than 1: got {sum(self.shares):g}.")

    @property
    def long_term_share(self) -> float:
        """Share of the instantaneous modulus that never relaxes, 1 - sum g_i."""
        return 1.0 - sum(self.shares)


@dataclass(frozen=True)
class Material:
    """A tissue: hyperelastic polynomial N = 2 with a Prony series.

    Parameters
    ----------
    c10, c01, c20, c11, c02 : float
        Coefficients of the isochoric energy. [kPa]
    bulk_linear, bulk_cubic : float
        1/D1 and 1/D2 of the volumetric energy; half the bulk modulus is 1/D1. [kPa]
    prony : Prony
        Relaxation of the deviator.
    moduli : {"long_term", "instantaneous"}
        Which state the coefficients describe. The paper's solver takes them as long-term by default.

    Raises
    ------
    InputError
        If a coefficient is not finite, or the initial shear or bulk modulus is not above zero.

    Examples
    --------
    >>> skin = Material.linear_elastic(young_kpa=80.0, poisson=0.48)
    >>> round(skin.shear_modulus_kpa, 2), round(skin.bulk_modulus_kpa, 1)
    (27.03, 666.7)
    """

    c10: float
    c01: float = 0.0
    c20: float = 0.0
    c11: float = 0.0
    c02: float = 0.0
    bulk_linear: float = 0.0
    bulk_cubic: float = 0.0
    prony: Prony = Prony()
    moduli: str = "long_term"

    def __post_init__(self) -> None:
        for name in ("c10", "c01", "c20", "c11", "c02"):
            finite(name, getattr(self, name), "kPa")
        positive("initial shear modulus 2 (c10 + c01)", self.shear_modulus_kpa, "kPa")
        positive("bulk_linear (1/D1)", self.bulk_linear, "kPa")
        not_negative("bulk_cubic (1/D2)", self.bulk_cubic, "kPa")
        one_of("moduli", self.moduli, ("long_term", "instantaneous"))

    @classmethod
    def neo_hooke(
        cls, shear_kpa: float, poisson: float, prony: Prony = Prony(), moduli: str = "long_term"
    ) -> Material:
        """Neo-Hooke from shear modulus and Poisson's ratio. [kPa]"""
        positive("shear_kpa", shear_kpa, "kPa")
        bulk = _bulk_modulus(shear_kpa, poisson)
        return cls(c10=shear_kpa / 2, bulk_linear=bulk / 2, prony=prony, moduli=moduli)

    @classmethod
    def linear_elastic(
        cls, young_kpa: float, poisson: float, prony: Prony = Prony(), moduli: str = "long_term"
    ) -> Material:
        """Neo-Hooke that agrees with Hooke's law at small strain. [kPa]"""
        positive("young_kpa", young_kpa, "kPa")
        _check_poisson(poisson)
        return cls.neo_hooke(young_kpa / (2 * (1 + poisson)), poisson, prony, moduli)

    @classmethod
    def polynomial(
        cls,
        c10: float,
        c01: float,
        c20: float,
        c11: float,
        c02: float,
        poisson: float,
        prony: Prony = Prony(),
        moduli: str = "long_term",
    ) -> Material:
        """Polynomial N = 2 whose bulk modulus follows from the initial shear modulus. [kPa]"""
        bulk = _bulk_modulus(positive("2 (c10 + c01)", 2 * (c10 + c01), "kPa"), poisson)
        return cls(c10, c01, c20, c11, c02, bulk_linear=bulk / 2, prony=prony, moduli=moduli)

    @property
    def shear_modulus_kpa(self) -> float:
        """Initial shear modulus in the state that the coefficients describe. [kPa]"""
        return 2.0 * (self.c10 + self.c01)

    @property
    def bulk_modulus_kpa(self) -> float:
        """Initial bulk modulus. [kPa]"""
        return 2.0 * self.bulk_linear

    @property
    def instantaneous_factor(self) -> float:
        """Factor from the given coefficients to the instantaneous ones."""
        return 1.0 / self.prony.long_term_share if self.moduli == "long_term" else 1.0

    def with_prony(self, prony: Prony) -> Material:
        """Return the same tissue with another relaxation."""
        return replace(self, prony=prony)


def _check_poisson(poisson: float) -> None:
    if not 0.0 < finite("poisson", poisson) < 0.5:
        raise InputError(f"poisson must lie between 0 and 0.5, both excluded: got {poisson!r}.")


def _bulk_modulus(shear_kpa: float, poisson: float) -> float:
    """Bulk modulus K = 2 G (1 + nu) / (3 (1 - 2 nu)). [kPa]"""
    _check_poisson(poisson)
    return 2 * shear_kpa * (1 + poisson) / (3 * (1 - 2 * poisson))


@dataclass(frozen=True)
class Tissues:
    """The four layers of the fingertip from the outside in.

    Parameters
    ----------
    stratum_corneum, living_epidermis, dermis, subcutis : Material
        One material per layer.
    """

    stratum_corneum: Material
    living_epidermis: Material
    dermis: Material
    subcutis: Material

    @property
    def layers(self) -> tuple[Material, ...]:
        """Materials in the order of `mesh.LAYERS`."""
        return tuple(getattr(self, field.name) for field in fields(self))


@dataclass(frozen=True)
class MaterialTable:
    """Materials as arrays for the compiled kernels; one row per layer.

    Parameters
    ----------
    law : array (n_layers, 8)
        Instantaneous c10, c01, c20, c11, c02; then 1/D1, 1/D2; then the long-term share. [kPa]
    shares, times_ms : array (n_layers, n_terms)
        Prony series, padded with zero shares.
    """

    law: FloatArray
    shares: FloatArray
    times_ms: FloatArray

    @classmethod
    def of(cls, materials: Sequence[Material]) -> MaterialTable:
        """Table of a sequence of materials."""
        n_terms = max(len(material.prony.shares) for material in materials)
        law = np.zeros((len(materials), 8))
        shares, times = np.zeros((len(materials), n_terms)), np.ones((len(materials), n_terms))
        for row, material in enumerate(materials):
            coefficients = [material.c10, material.c01, material.c20, material.c11, material.c02]
            law[row, :5] = material.instantaneous_factor * np.array(coefficients)
            law[row, 5:] = material.bulk_linear, material.bulk_cubic, material.prony.long_term_share
            terms = len(material.prony.shares)
            shares[row, :terms], times[row, :terms] = material.prony.shares, material.prony.times_ms
        return cls(
            float_array("law", law, 2), float_array("shares", shares, 2), float_array("times_ms", times, 2)
        )
