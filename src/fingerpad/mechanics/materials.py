"""Tissues: a law, how its stress relaxes, and the tables that the compiled kernels read."""

from __future__ import annotations

import warnings
from collections.abc import Callable, Sequence
from dataclasses import dataclass, field, fields, replace
from functools import lru_cache
from typing import Annotated

import numpy as np
from pydantic import SkipValidation
from scipy.optimize import brentq

from fingerpad.core.checked import value_class
from fingerpad.core.errors import InputError, MaterialWarning, shown
from fingerpad.core.values import (
    Finite,
    FloatArray,
    Numbers,
    Positive,
    choice,
    float_array,
    not_negative,
    positive,
)
from fingerpad.mechanics.energy import SECOND
from fingerpad.mechanics.laws import (
    Energy,
    Hencky,
    Hyperfoam,
    Law,
    Ogden,
    Polynomial,
    bulk_modulus,
    check_poisson,
)

POLYNOMIAL, SPLIT, COUPLED = 0.0, 1.0, 2.0
"""Kinds of law: own kernel; a formula whose volume changes cost energy of their own; any other formula."""

N_COEFFICIENTS = 11  # Columns of `MaterialTable.law` before the operations of a formula.


def has_formulas(law: FloatArray) -> bool | None:
    """Whether a `MaterialTable.law` has formulas: True, or None, for which kernels are compiled without them.

    Numba leaves out a branch that depends on whether an argument is None. A press in which all laws are
    polynomials does not compile what evaluates formulas.
    """
    return True if law.shape[1] > N_COEFFICIENTS else None


@value_class
class Prony:
    """Relaxation of the deviatoric stress: g(t) = 1 - sum g_i (1 - exp(-t / tau_i)).

    Parameters
    ----------
    shares : tuple of float
        g_i, relative to the instantaneous modulus; each not negative, their sum below 1.
    times_ms : tuple of float
        tau_i, each above 0. [ms]

    Examples
    --------
    >>> Prony(shares=(0.148, 0.252), times_ms=(2123.0, 9371.0)).long_term_share
    0.6
    """

    shares: Numbers = ()
    times_ms: Numbers = ()

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


@value_class
class Material:
    """A tissue: a strain energy and how its stress relaxes.

    Parameters
    ----------
    law : Polynomial, Ogden, Hyperfoam, Hencky or Energy
        The strain energy.
    prony : Prony
        Relaxation.
    moduli : {"long_term", "instantaneous"}
        Which state the coefficients of the law describe; the paper's solver takes long-term by default.

    Warns
    -----
    MaterialWarning
        If the law is not stable over stretches from 0.5 to 2; it names the first stretch that is not.

    Examples
    --------
    >>> skin = Material.linear_elastic(young_kpa=80.0, poisson=0.48)
    >>> round(skin.shear_modulus_kpa, 2), round(skin.bulk_modulus_kpa, 1)
    (27.03, 666.7)
    >>> own = Material.from_energy("mu / 2 * (I1 - 3) + k / 2 * (J - 1)**2", mu=27.0, k=600.0)
    >>> round(own.shear_modulus_kpa, 6)
    27.0
    """

    law: SkipValidation[Law]
    prony: Prony = field(default_factory=Prony)
    moduli: Annotated[str, choice(("long_term", "instantaneous"))] = "long_term"

    def __post_init__(self) -> None:
        if not isinstance(self.law, Polynomial | Ogden | Hyperfoam | Hencky | Energy):
            raise InputError("law", "must be Polynomial, Ogden, Hyperfoam, Hencky or Energy", shown(self.law))
        unstable = instability(self.law)
        if unstable:
            warnings.warn(MaterialWarning(f"{self.law} is unstable {unstable}."), stacklevel=3)

    @classmethod
    def neo_hooke(
        cls, shear_kpa: Positive, poisson: Finite, prony: Prony = Prony(), moduli: str = "long_term"
    ) -> Material:
        """Neo-Hooke from shear modulus and Poisson's ratio. [kPa]"""
        bulk = bulk_modulus(shear_kpa, poisson)
        return cls(Polynomial(c10=shear_kpa / 2, bulk_linear=bulk / 2), prony, moduli)

    @classmethod
    def linear_elastic(
        cls,
        young_kpa: Positive,
        poisson: Finite,
        prony: Prony = Prony(),
        moduli: str = "long_term",
        law: Annotated[str, choice(("neo_hooke", "hencky"))] = "neo_hooke",
    ) -> Material:
        """Hooke's law at small strain; at large strain "neo_hooke" or "hencky" with the same moduli. [kPa]"""
        shear = young_kpa / (2 * (1 + check_poisson(poisson)))
        if law == "neo_hooke":
            return cls.neo_hooke(shear, poisson, prony, moduli)
        return cls(Hencky(shear, bulk_modulus(shear, poisson)), prony, moduli)

    @classmethod
    def polynomial(
        cls,
        c10: Finite,
        c01: Finite,
        c20: Finite,
        c11: Finite,
        c02: Finite,
        poisson: Finite,
        prony: Prony = Prony(),
        moduli: str = "long_term",
    ) -> Material:
        """Polynomial N = 2 (Mooney-Rivlin if c20 = c11 = c02 = 0) of a given Poisson's ratio. [kPa]"""
        half = c10 + c01
        bulk = bulk_modulus(positive("2 (c10 + c01)", 2 * half, "kPa"), poisson)
        return cls(Polynomial(c10, c01, c20, c11, c02, bulk_linear=bulk / 2), prony, moduli)

    @classmethod
    def ogden(
        cls,
        moduli_kpa: Sequence[float],
        exponents: Sequence[float],
        poisson: Finite,
        prony: Prony = Prony(),
        moduli: str = "long_term",
    ) -> Material:
        """Ogden N <= 3 whose bulk modulus follows from the initial shear modulus. [kPa]"""
        total = float(float_array("moduli_kpa", moduli_kpa, 1).sum())
        bulk = bulk_modulus(positive("the sum of moduli_kpa", total, "kPa"), poisson)
        return cls(Ogden(tuple(moduli_kpa), tuple(exponents), bulk), prony, moduli)

    @classmethod
    def hyperfoam(
        cls,
        moduli_kpa: Sequence[float],
        exponents: Sequence[float],
        poisson: Finite,
        prony: Prony = Prony(),
        moduli: str = "long_term",
    ) -> Material:
        """Storakers' foam N <= 3. [kPa]"""
        return cls(Hyperfoam(tuple(moduli_kpa), tuple(exponents), poisson), prony, moduli)

    @classmethod
    def from_energy(
        cls, formula: str, prony: Prony = Prony(), moduli: str = "long_term", **coefficients: float
    ) -> Material:
        """Law of your own, see `Energy`. [kPa]"""
        return cls(Energy(formula, tuple(coefficients.items())), prony, moduli)

    @property
    def shear_modulus_kpa(self) -> float:
        """Initial shear modulus in the state that the coefficients describe. [kPa]"""
        return self.law.shear_modulus_kpa

    @property
    def bulk_modulus_kpa(self) -> float:
        """Initial bulk modulus. [kPa]"""
        return self.law.bulk_modulus_kpa

    @property
    def poisson(self) -> float:
        """Initial Poisson's ratio, (3K - 2G) / (2 (3K + G))."""
        shear, bulk = self.shear_modulus_kpa, self.bulk_modulus_kpa
        return (3 * bulk - 2 * shear) / (2 * (3 * bulk + shear))

    @property
    def contact_modulus_kpa(self) -> float:
        """Instantaneous E* = E / (1 - nu²) at small strain, that of a half-space under a rigid body. [kPa]"""
        return 2.0 * self.instantaneous_factor * self.shear_modulus_kpa / (1.0 - self.poisson)

    @property
    def instantaneous_factor(self) -> float:
        """Factor from the given coefficients to the instantaneous ones."""
        return 1.0 / self.prony.long_term_share if self.moduli == "long_term" else 1.0

    def scaled(self, factor: Positive) -> Material:
        """Return the same tissue with all moduli times a factor."""
        return replace(self, law=self.law.scaled(factor))

    def with_prony(self, prony: Prony) -> Material:
        """Return the same tissue with another relaxation."""
        return replace(self, prony=prony)


@value_class
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

    def scaled(self, factor: Finite) -> Tissues:
        """Return the same tissues, stiffer or softer: all moduli times a factor.

        Parameters
        ----------
        factor : float
            Above 0; Poisson's ratios and relaxation are kept.

        Examples
        --------
        >>> tissue = Material.neo_hooke(10.0, 0.4)
        >>> Tissues(tissue, tissue, tissue, tissue).scaled(1.5).dermis.shear_modulus_kpa
        15.0
        """
        return Tissues(*(layer.scaled(factor) for layer in self.layers))


@dataclass(frozen=True)
class MaterialTable:
    """Materials as arrays for the compiled kernels; one row per layer."""

    law: FloatArray
    """Instantaneous c10, c01, c20, c11, c02, then 1/D1, 1/D2 [kPa]; the long-term share; the kind of law, the
    factor from given to instantaneous coefficients and the number of operations; then the operations of a
    formula, (n_layers, 11 + 4 n_operations)."""
    shares: FloatArray
    times_ms: FloatArray  # Prony series, padded with zero shares, (n_layers, n_terms).

    @classmethod
    def of(cls, materials: Sequence[Material]) -> MaterialTable:
        n_terms = max(len(material.prony.shares) for material in materials)
        rows = [_row(material) for material in materials]
        law = np.zeros((len(materials), max(row.size for row in rows)))
        shares, times = np.zeros((len(materials), n_terms)), np.ones((len(materials), n_terms))
        for index, (material, row) in enumerate(zip(materials, rows, strict=True)):
            law[index, : row.size] = row
            terms = len(material.prony.shares)
            shares[index, :terms], times[index, :terms] = material.prony.shares, material.prony.times_ms
        return cls(
            float_array("law", law, 2), float_array("shares", shares, 2), float_array("times_ms", times, 2)
        )


def _row(material: Material) -> FloatArray:
    row = np.zeros(N_COEFFICIENTS)
    row[7], row[9] = material.prony.long_term_share, material.instantaneous_factor
    law = material.law
    if isinstance(law, Polynomial):
        row[:5] = material.instantaneous_factor * np.array([law.c10, law.c01, law.c20, law.c11, law.c02])
        row[5:7], row[8] = (law.bulk_linear, law.bulk_cubic), POLYNOMIAL
        return row
    program = law.energy.program
    row[8], row[10] = COUPLED if law.energy.is_coupled else SPLIT, len(program)
    return np.concatenate([row, program.ravel()])


STABLE_STRETCHES = (0.5, 2.0)  # Range in which a material must be stable, or a warning names the stretch.


@lru_cache(maxsize=256)
def instability(law: Law) -> str:
    """Where a law first loses stability between stretches of 0.5 and 2, in words; empty if nowhere.

    Stable means that the Kirchhoff stress rises with the logarithmic strain in every direction (Drucker):
    the Hessian of the energy with respect to the logarithms of the stretches is positive definite, for a law
    with its own volumetric energy at constant volume. Uniaxial, equibiaxial and planar stretch are examined,
    from 1 outwards; for a law that couples shape and volume with stress-free sides, and change of volume.
    """
    if isinstance(law, Polynomial) and law.c10 > 0.0 <= law.c20 and not (law.c01 or law.c11 or law.c02):
        # I1 - 3 is a sum of exponentials of the logarithmic strains and not below 0: it and its square are
        # convex.
        return ""
    energy = law.energy
    for far in STABLE_STRETCHES:
        for mode, path in (_COUPLED_PATHS if energy.is_coupled else _ISOCHORIC_PATHS).items():
            for log in np.log(np.linspace(1.0, far, 51)[1:]):
                if not np.linalg.eigvalsh(path(energy, log))[0] > 0.0:
                    side = "tension" if far > 1.0 else "compression"
                    return f"in {mode} {side} from stretch {np.exp(log):.3g} on"
    return ""


def _isochoric_stiffness(energy: Energy, logs: tuple[float, float, float]) -> FloatArray:
    """Hessian of the energy on the two directions that keep the volume, (2, 2). [kPa]"""
    hessian = energy.derivatives([*logs, 0.0])[SECOND]
    return _CONSTANT_VOLUME @ hessian[:3, :3] @ _CONSTANT_VOLUME.T


def _free_stiffness(energy: Energy, log: float, pulled: int, free: int) -> FloatArray:
    """Hessian of the energy in the logarithmic strains (3, 3); free sides carry no stress. [kPa]"""
    # The first `pulled` sides have stretch exp(log), the last `free` ones find theirs, any other stays at 1.

    def state(side: float) -> FloatArray:
        strain = np.array([log] * pulled + [0.0] * (3 - pulled - free) + [side] * free)
        return energy.derivatives([*(strain - strain.mean()), strain.sum()])

    def stress(side: float) -> float:
        first = state(side)
        return float(first[3] - first[1:4].mean() + first[4])

    if free and stress(-_WIDEST_LOG) * stress(_WIDEST_LOG) > 0.0:
        return -np.eye(3)  # the free sides find no rest at all
    derivatives = state(brentq(stress, -_WIDEST_LOG, _WIDEST_LOG) if free else 0.0)
    return _TO_SHAPE_AND_VOLUME.T @ derivatives[SECOND] @ _TO_SHAPE_AND_VOLUME


_WIDEST_LOG = 3.0
_CONSTANT_VOLUME = np.array([[1.0, -1.0, 0.0], [1.0, 1.0, -2.0]]) / np.sqrt([[2.0], [6.0]])
_TO_SHAPE_AND_VOLUME = np.vstack([np.eye(3) - 1 / 3, np.ones(3)])  # of ln lambda_a
_Path = Callable[[Energy, float], FloatArray]
_ISOCHORIC_PATHS: dict[str, _Path] = {
    "uniaxial": lambda energy, log: _isochoric_stiffness(energy, (log, -log / 2, -log / 2)),
    "equibiaxial": lambda energy, log: _isochoric_stiffness(energy, (log, log, -2 * log)),
    "planar": lambda energy, log: _isochoric_stiffness(energy, (log, 0.0, -log)),
}
_COUPLED_PATHS: dict[str, _Path] = {
    "uniaxial": lambda energy, log: _free_stiffness(energy, log, pulled=1, free=2),
    "equibiaxial": lambda energy, log: _free_stiffness(energy, log, pulled=2, free=1),
    "planar": lambda energy, log: _free_stiffness(energy, log, pulled=1, free=1),
    "volumetric": lambda energy, log: _free_stiffness(energy, log / 3, pulled=3, free=0),
}
