"""Constitutive laws of the tissues, each with a Prony series.

    Polynomial   W = C10 (I1-3) + C01 (I2-3) + C20 (I1-3)² + C11 (I1-3)(I2-3) + C02 (I2-3)²
                     + (J-1)²/D1 + (J-1)⁴/D2                              (paper, 2.2.1: polynomial N = 2)
    Ogden        W = sum_i 2 mu_i/alpha_i² (lambdabar1^alpha_i + ... - 3) + K/2 (J-1)²
    Hyperfoam    W = sum_i 2 mu_i/alpha_i² (lambda1^alpha_i + ... - 3 + (J^(-alpha_i beta) - 1)/beta)
    Hencky       W = G (ln² lambdabar1 + ln² lambdabar2 + ln² lambdabar3) + K/2 ln² J
    Energy       W = a formula of your own

Invariants and barred stretches are those of the isochoric part of the deformation. Neo-Hooke and
Mooney-Rivlin are the polynomial with coefficients zero. A "linear elastic" layer at finite strain is read as
neo-Hooke with the same shear and bulk modulus (docs/decisions/linear-elastic.md) or, if asked for, as Hencky.
The polynomial has its own compiled kernel; every other law is differentiated from its formula (see `energy`).
"""

from __future__ import annotations

import warnings
from collections.abc import Callable, Sequence
from dataclasses import dataclass, field, fields, replace
from functools import cached_property, lru_cache
from typing import Protocol

import numpy as np
from scipy.optimize import brentq

from fingerpad.checks import FloatArray, finite, float_array, instance, not_negative, one_of, positive
from fingerpad.errors import InputError, MaterialWarning
from fingerpad.mechanics.energy import CARRIED, SECOND, differentiate, translate

POLYNOMIAL, SPLIT, COUPLED = 0.0, 1.0, 2.0
"""Kinds of law: own kernel; a formula whose volume changes cost energy of their own; any other formula."""

N_COEFFICIENTS = 11
"""Columns of `MaterialTable.law` before the operations of a formula."""

STABLE_STRETCHES = (0.5, 2.0)
"""Range in which a material must be stable, or a warning names the stretch."""


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


class Law(Protocol):
    """An isotropic strain energy."""

    @property
    def shear_modulus_kpa(self) -> float:
        """Initial shear modulus. [kPa]"""
        ...

    @property
    def bulk_modulus_kpa(self) -> float:
        """Initial bulk modulus. [kPa]"""
        ...

    @property
    def energy(self) -> Energy:
        """The law as a formula."""
        ...


@dataclass(frozen=True)
class Energy:
    """A law of your own: its energy as a formula in the principal stretches or invariants.

    A formula without a term that mixes J with a change of shape keeps its pressure while it relaxes; of any
    other the whole stress relaxes (docs/decisions/relaxing-foams.md).

    Parameters
    ----------
    formula : str
        Energy per reference volume [kPa] from `lambda1` ... `lambda3`, `lambdabar1` ... `lambdabar3`, `I1`,
        `I2`, `J` (see `mechanics.energy`), numbers, coefficients, + - * / **, log, exp and sqrt.
    coefficients : tuple of (str, float)
        Names and values.

    Raises
    ------
    InputError
        If the formula cannot be read, prefers a direction, is not free of stress at rest, or has an initial
        shear or bulk modulus that is not above zero.

    Examples
    --------
    >>> skin = Energy("b / 2 * (exp(I1 - 3) - 1) + k / 2 * (J - 1)**2", (("b", 12.0), ("k", 600.0)))
    >>> round(skin.shear_modulus_kpa, 9), round(skin.bulk_modulus_kpa, 9)
    (12.0, 600.0)
    """

    formula: str
    coefficients: tuple[tuple[str, float], ...] = ()

    def __post_init__(self) -> None:
        for logs in _PROBES:
            if not np.isfinite(self.derivatives(logs)).all():
                stretches = ", ".join(f"{value:.3g}" for value in np.exp(logs[:3] + logs[3] / 3))
                raise InputError(f"The energy {self.formula!r} is not finite at the stretches {stretches}.")
            values = [self.derivatives([*np.roll(logs[:3], turn), logs[3]])[0] for turn in range(3)]
            values.append(self.derivatives([*logs[[1, 0, 2]], logs[3]])[0])
            if np.ptp(values) > 1e-9 * max(1e-300, np.abs(values).max()):
                raise InputError(
                    f"The energy {self.formula!r} must not prefer a direction: it changes when the principal "
                    "stretches are exchanged."
                )
        positive(f"the initial shear modulus of {self.formula!r}", self.shear_modulus_kpa, "kPa")
        positive(f"the initial bulk modulus of {self.formula!r}", self.bulk_modulus_kpa, "kPa")
        pressure = self.derivatives(np.zeros(4))[4]
        if abs(pressure) > 1e-9 * self.bulk_modulus_kpa:
            raise InputError(
                f"The energy {self.formula!r} must be free of stress at rest: its mean stress there is "
                f"{pressure:.3g} kPa."
            )

    @property
    def energy(self) -> Energy:
        """The law itself."""
        return self

    @cached_property
    def program(self) -> FloatArray:
        """Operations of the formula, (n_operations, 4)."""
        return translate(self.formula, dict(self.coefficients))

    def derivatives(self, logs: Sequence[float] | FloatArray) -> FloatArray:
        """Energy, its 4 first and 10 second derivatives at ln lambdabar_1 ... 3 and ln J, (15,). [kPa]"""
        results = np.empty((len(self.program) + 1, CARRIED))
        differentiate(self.program.ravel(), len(self.program), np.asarray(logs, dtype=np.float64), results)
        return results[len(self.program) - 1]

    @property
    def shear_modulus_kpa(self) -> float:
        """Initial shear modulus. [kPa]"""
        second = self.derivatives(np.zeros(4))
        return 0.5 * float(second[SECOND[0, 0]] - second[SECOND[0, 1]])

    @property
    def bulk_modulus_kpa(self) -> float:
        """Initial bulk modulus. [kPa]"""
        return float(self.derivatives(np.zeros(4))[SECOND[3, 3]])

    @cached_property
    def is_coupled(self) -> bool:
        """Whether shape and volume share a term of the energy."""
        for logs in _PROBES:
            second = self.derivatives(logs)
            mixed = second[SECOND[:3, 3]]
            if np.ptp(mixed) > 1e-9 * np.abs(second).max():
                return True
        return False


_PROBES = np.array([[0.3, -0.1, -0.2, 0.1], [-0.4, 0.25, 0.15, -0.2], [0.05, 0.15, -0.2, 0.3]])
"""Deformations at which a formula is looked at: ln lambdabar_1 ... 3 and ln J."""


@dataclass(frozen=True)
class Polynomial:
    """Polynomial N = 2 in the isochoric invariants; neo-Hooke and Mooney-Rivlin among them.

    Parameters
    ----------
    c10, c01, c20, c11, c02 : float
        Coefficients of the isochoric energy. [kPa]
    bulk_linear, bulk_cubic : float
        1/D1 and 1/D2 of the volumetric energy; half the bulk modulus is 1/D1. [kPa]

    Raises
    ------
    InputError
        If a coefficient is not finite, or the initial shear or bulk modulus is not above zero.

    Examples
    --------
    >>> Polynomial(c10=4.0, c01=1.0, bulk_linear=100.0).shear_modulus_kpa
    10.0
    """

    c10: float
    c01: float = 0.0
    c20: float = 0.0
    c11: float = 0.0
    c02: float = 0.0
    bulk_linear: float = 0.0
    bulk_cubic: float = 0.0

    def __post_init__(self) -> None:
        for name in ("c10", "c01", "c20", "c11", "c02"):
            finite(name, getattr(self, name), "kPa")
        positive("initial shear modulus 2 (c10 + c01)", self.shear_modulus_kpa, "kPa")
        positive("bulk_linear (1/D1)", self.bulk_linear, "kPa")
        not_negative("bulk_cubic (1/D2)", self.bulk_cubic, "kPa")

    @property
    def shear_modulus_kpa(self) -> float:
        """Initial shear modulus. [kPa]"""
        return 2.0 * (self.c10 + self.c01)

    @property
    def bulk_modulus_kpa(self) -> float:
        """Initial bulk modulus. [kPa]"""
        return 2.0 * self.bulk_linear

    @property
    def energy(self) -> Energy:
        """The law as a formula."""
        names = tuple(item.name for item in fields(self))
        return Energy(
            "c10 * (I1 - 3) + c01 * (I2 - 3) + c20 * (I1 - 3)**2 + c11 * (I1 - 3) * (I2 - 3) "
            "+ c02 * (I2 - 3)**2 + bulk_linear * (J - 1)**2 + bulk_cubic * (J - 1)**4",
            tuple((name, float(getattr(self, name))) for name in names),
        )


@dataclass(frozen=True)
class Ogden:
    """Sum of up to three powers of the isochoric stretches.

    Parameters
    ----------
    moduli_kpa : tuple of float
        mu_i; their sum is the initial shear modulus. [kPa]
    exponents : tuple of float
        alpha_i, none of them 0.
    bulk_kpa : float
        Bulk modulus K. [kPa]

    Raises
    ------
    InputError
        If there are none or more than three terms, or a modulus is not above zero.

    Examples
    --------
    >>> Ogden(moduli_kpa=(8.0, 2.0), exponents=(2.0, 8.0), bulk_kpa=240.0).shear_modulus_kpa
    10.0
    """

    moduli_kpa: tuple[float, ...]
    exponents: tuple[float, ...]
    bulk_kpa: float

    def __post_init__(self) -> None:
        _take_terms(self)
        positive("bulk_kpa", self.bulk_kpa, "kPa")

    @property
    def shear_modulus_kpa(self) -> float:
        """Initial shear modulus. [kPa]"""
        return sum(self.moduli_kpa)

    @property
    def bulk_modulus_kpa(self) -> float:
        """Initial bulk modulus. [kPa]"""
        return self.bulk_kpa

    @property
    def energy(self) -> Energy:
        """The law as a formula."""
        term = (
            "2 * mu{0} / alpha{0}**2"
            " * (lambdabar1**alpha{0} + lambdabar2**alpha{0} + lambdabar3**alpha{0} - 3)"
        )
        terms = (term.format(n) for n in range(1, len(self.exponents) + 1))
        return Energy(
            " + ".join((*terms, "bulk / 2 * (J - 1)**2")),
            (*_named_terms(self.moduli_kpa, self.exponents), ("bulk", float(self.bulk_kpa))),
        )


@dataclass(frozen=True)
class Hyperfoam:
    """Storakers' compressible foam (1986), with one Poisson's ratio for all terms: the form of Wu's tissues.

    Parameters
    ----------
    moduli_kpa : tuple of float
        mu_i; their sum is the initial shear modulus. [kPa]
    exponents : tuple of float
        alpha_i, none of them 0.
    poisson : float
        nu; beta = nu / (1 - 2 nu).

    Raises
    ------
    InputError
        If there are none or more than three terms, the initial shear modulus is not above zero, or nu is out
        of its range.

    Examples
    --------
    >>> foam = Hyperfoam(moduli_kpa=(3.0,), exponents=(8.0,), poisson=0.4)
    >>> round(foam.bulk_modulus_kpa, 9)  # 2 mu (1/3 + beta)
    14.0
    """

    moduli_kpa: tuple[float, ...]
    exponents: tuple[float, ...]
    poisson: float

    def __post_init__(self) -> None:
        _take_terms(self)
        _check_poisson(self.poisson)

    @property
    def shear_modulus_kpa(self) -> float:
        """Initial shear modulus. [kPa]"""
        return sum(self.moduli_kpa)

    @property
    def bulk_modulus_kpa(self) -> float:
        """Initial bulk modulus. [kPa]"""
        return _bulk_modulus(self.shear_modulus_kpa, self.poisson)

    @property
    def energy(self) -> Energy:
        """The law as a formula."""
        term = (
            "2 * mu{0} / alpha{0}**2 * (lambda1**alpha{0} + lambda2**alpha{0} + lambda3**alpha{0} - 3"
            " + (J**(-alpha{0} * beta) - 1) / beta)"
        )
        terms = (term.format(n) for n in range(1, len(self.exponents) + 1))
        beta = self.poisson / (1 - 2 * self.poisson)
        return Energy(
            " + ".join(terms), (*_named_terms(self.moduli_kpa, self.exponents), ("beta", float(beta)))
        )


@dataclass(frozen=True)
class Hencky:
    """Quadratic in the logarithmic strain: Hooke's law between Kirchhoff stress and logarithmic strain.

    Parameters
    ----------
    shear_kpa, bulk_kpa : float
        G and K. [kPa]

    Examples
    --------
    >>> Hencky(shear_kpa=27.0, bulk_kpa=600.0).energy.is_coupled
    False
    """

    shear_kpa: float
    bulk_kpa: float

    def __post_init__(self) -> None:
        positive("shear_kpa", self.shear_kpa, "kPa")
        positive("bulk_kpa", self.bulk_kpa, "kPa")

    @property
    def shear_modulus_kpa(self) -> float:
        """Initial shear modulus. [kPa]"""
        return self.shear_kpa

    @property
    def bulk_modulus_kpa(self) -> float:
        """Initial bulk modulus. [kPa]"""
        return self.bulk_kpa

    @property
    def energy(self) -> Energy:
        """The law as a formula."""
        return Energy(
            "shear * (log(lambdabar1)**2 + log(lambdabar2)**2 + log(lambdabar3)**2) + bulk / 2 * log(J)**2",
            (("shear", float(self.shear_kpa)), ("bulk", float(self.bulk_kpa))),
        )


def _take_terms(law: Ogden | Hyperfoam) -> None:
    name, moduli, exponents = type(law).__name__, tuple(law.moduli_kpa), tuple(law.exponents)
    if not 1 <= len(moduli) <= 3 or len(moduli) != len(exponents):
        raise InputError(
            f"{name} needs one to three moduli and as many exponents: got {len(moduli)} and {len(exponents)}."
        )
    for modulus, exponent in zip(moduli, exponents, strict=True):
        finite(f"each modulus of {name}", modulus, "kPa")
        if finite(f"each exponent of {name}", exponent) == 0.0:
            raise InputError(f"No exponent of {name} may be 0: leave out that term or take Hencky's law.")
    positive(f"the initial shear modulus of {name}, the sum of its moduli", sum(moduli), "kPa")
    object.__setattr__(law, "moduli_kpa", moduli)
    object.__setattr__(law, "exponents", exponents)


def _named_terms(moduli: Sequence[float], exponents: Sequence[float]) -> tuple[tuple[str, float], ...]:
    pairs = enumerate(zip(moduli, exponents, strict=True), start=1)
    return tuple(
        named
        for n, (modulus, exponent) in pairs
        for named in ((f"mu{n}", float(modulus)), (f"alpha{n}", float(exponent)))
    )


@dataclass(frozen=True)
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

    Raises
    ------
    InputError
        If a part is of the wrong kind.

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

    law: Law
    prony: Prony = field(default_factory=Prony)
    moduli: str = "long_term"

    def __post_init__(self) -> None:
        if not isinstance(self.law, Polynomial | Ogden | Hyperfoam | Hencky | Energy):
            raise InputError(f"law must be Polynomial, Ogden, Hyperfoam, Hencky or Energy: got {self.law!r}.")
        instance("prony", self.prony, Prony)
        one_of("moduli", self.moduli, ("long_term", "instantaneous"))
        unstable = instability(self.law)
        if unstable:
            warnings.warn(MaterialWarning(f"{self.law} is unstable {unstable}."), stacklevel=3)

    @classmethod
    def neo_hooke(
        cls, shear_kpa: float, poisson: float, prony: Prony = Prony(), moduli: str = "long_term"
    ) -> Material:
        """Neo-Hooke from shear modulus and Poisson's ratio. [kPa]"""
        positive("shear_kpa", shear_kpa, "kPa")
        bulk = _bulk_modulus(shear_kpa, poisson)
        return cls(Polynomial(c10=shear_kpa / 2, bulk_linear=bulk / 2), prony, moduli)

    @classmethod
    def linear_elastic(
        cls,
        young_kpa: float,
        poisson: float,
        prony: Prony = Prony(),
        moduli: str = "long_term",
        law: str = "neo_hooke",
    ) -> Material:
        """Hooke's law at small strain; at large strain "neo_hooke" or "hencky" with the same moduli. [kPa]"""
        positive("young_kpa", young_kpa, "kPa")
        _check_poisson(poisson)
        shear = young_kpa / (2 * (1 + poisson))
        if one_of("law", law, ("neo_hooke", "hencky")) == "neo_hooke":
            return cls.neo_hooke(shear, poisson, prony, moduli)
        return cls(Hencky(shear, _bulk_modulus(shear, poisson)), prony, moduli)

    @classmethod
    def mooney_rivlin(
        cls, c10: float, c01: float, poisson: float, prony: Prony = Prony(), moduli: str = "long_term"
    ) -> Material:
        """Mooney-Rivlin whose bulk modulus follows from the initial shear modulus. [kPa]"""
        return cls.polynomial(c10, c01, 0.0, 0.0, 0.0, poisson, prony, moduli)

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
        return cls(Polynomial(c10, c01, c20, c11, c02, bulk_linear=bulk / 2), prony, moduli)

    @classmethod
    def ogden(
        cls,
        moduli_kpa: Sequence[float],
        exponents: Sequence[float],
        poisson: float,
        prony: Prony = Prony(),
        moduli: str = "long_term",
    ) -> Material:
        """Ogden N <= 3 whose bulk modulus follows from the initial shear modulus. [kPa]"""
        bulk = _bulk_modulus(positive("the sum of moduli_kpa", sum(moduli_kpa), "kPa"), poisson)
        return cls(Ogden(tuple(moduli_kpa), tuple(exponents), bulk), prony, moduli)

    @classmethod
    def hyperfoam(
        cls,
        moduli_kpa: Sequence[float],
        exponents: Sequence[float],
        poisson: float,
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
    def instantaneous_factor(self) -> float:
        """Factor from the given coefficients to the instantaneous ones."""
        return 1.0 / self.prony.long_term_share if self.moduli == "long_term" else 1.0

    def with_prony(self, prony: Prony) -> Material:
        """Return the same tissue with another relaxation."""
        return replace(self, prony=prony)


def _check_poisson(poisson: float) -> None:
    if not 0.0 < finite("poisson", poisson) < 0.5:
        raise InputError(
            f"poisson must lie between 0 and 0.5, both excluded: got {poisson!r}; "
            "take 0.4999 for a tissue that hardly changes its volume."
        )


def _bulk_modulus(shear_kpa: float, poisson: float) -> float:
    """Bulk modulus K = 2 G (1 + nu) / (3 (1 - 2 nu)). [kPa]"""
    _check_poisson(poisson)
    return 2 * shear_kpa * (1 + poisson) / (3 * (1 - 2 * poisson))


@lru_cache(maxsize=256)
def instability(law: Law) -> str:
    """Where a law first loses stability between stretches of 0.5 and 2, in words; empty if nowhere.

    Stable means that the Kirchhoff stress rises with the logarithmic strain in every direction (Drucker):
    the Hessian of the energy with respect to the logarithms of the stretches is positive definite, for a law
    with its own volumetric energy at constant volume. Uniaxial, equibiaxial and planar stretch are examined,
    from 1 outwards; for a law that couples shape and volume with stress-free sides, and change of volume.

    Parameters
    ----------
    law : Polynomial, Ogden, Hyperfoam, Hencky or Energy
        The strain energy.

    Examples
    --------
    >>> instability(Polynomial(c10=5.0, c20=-1.0, bulk_linear=200.0))
    'in uniaxial compression from stretch 0.57 on'
    """
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
    """Hessian of the energy in the three logarithmic strains (3, 3), where free sides carry no stress. [kPa]

    The first `pulled` sides have stretch exp(log), the last `free` ones find theirs, any other stays at 1.
    """

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
    law : array (n_layers, 11 + 4 n_operations)
        Instantaneous c10, c01, c20, c11, c02, then 1/D1, 1/D2 [kPa]; the long-term share; the kind of law,
        the factor from given to instantaneous coefficients and the number of operations; then the operations
        of a formula.
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
    """One row of `MaterialTable.law`."""
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
