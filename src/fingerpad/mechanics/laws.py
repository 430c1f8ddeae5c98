"""Strain energies of the tissues.

    Polynomial   W = C10 (I1-3) + C01 (I2-3) + C20 (I1-3)² + C11 (I1-3)(I2-3) + C02 (I2-3)²
                     + (J-1)²/D1 + (J-1)⁴/D2                              (paper, 2.2.1: polynomial N = 2)
    Ogden        W = sum_i 2 mu_i/alpha_i² (lambdabar1^alpha_i + ... - 3) + K/2 (J-1)²
    Hyperfoam    W = sum_i 2 mu_i/alpha_i² (lambda1^alpha_i + ... - 3 + (J^(-alpha_i beta) - 1)/beta)
    Hencky       W = G (ln² lambdabar1 + ln² lambdabar2 + ln² lambdabar3) + K/2 ln² J
    Energy       W = a formula of your own

Invariants and barred stretches are those of the isochoric part of the deformation. Neo-Hooke and
Mooney-Rivlin are the polynomial with coefficients zero. A "linear elastic" layer at finite strain is read as
neo-Hooke with the same shear and bulk modulus (docs/decisions.md#linear-elastic) or, if asked for, as Hencky.
The polynomial has its own compiled kernel; every other law is differentiated from its formula (see `energy`).
"""

from __future__ import annotations

from collections import Counter
from collections.abc import Sequence
from dataclasses import fields, replace
from functools import cached_property
from typing import Protocol, Self, runtime_checkable

import numpy as np

from fingerpad.core.checked import checked, value_class
from fingerpad.core.errors import InputError, shown
from fingerpad.core.values import Finite, FloatArray, NotNegative, Numbers, Positive, positive
from fingerpad.mechanics.energy import CARRIED, SECOND, differentiate, translate


@runtime_checkable
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

    def scaled(self, factor: float) -> Law: ...


@value_class
class Energy:
    """A law of your own: its energy as a formula in the principal stretches or invariants.

    A formula without a term that mixes J with a change of shape keeps its pressure while it relaxes; of any
    other the whole stress relaxes (docs/decisions.md#relaxing-foams).

    Parameters
    ----------
    formula : str
        Energy per reference volume [kPa] from `lambda1` ... `lambda3`, `lambdabar1` ... `lambdabar3`, `I1`,
        `I2`, `J` (see `mechanics.energy`), numbers, coefficients, ``+ - * / **``, log, exp and sqrt.
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
        for name, count in Counter(name for name, _ in self.coefficients).items():
            if count > 1:
                raise InputError(
                    "coefficients", "must name each once", remedy=f"{name} is given {count} times"
                )
        for logs in _PROBES:
            if not np.isfinite(self.derivatives(logs)).all():
                stretches = ", ".join(f"{value:.3g}" for value in np.exp(logs[:3] + logs[3] / 3))
                raise InputError(f"The energy {self._said} is not finite at the stretches {stretches}.")
            values = [self.derivatives([*np.roll(logs[:3], turn), logs[3]])[0] for turn in range(3)]
            values.append(self.derivatives([*logs[[1, 0, 2]], logs[3]])[0])
            if np.ptp(values) > 1e-9 * max(1e-300, np.abs(values).max()):
                raise InputError(
                    f"The energy {self._said} must not prefer a direction: it changes when the principal "
                    "stretches are exchanged."
                )
        positive(f"the initial shear modulus of {self._said}", self.shear_modulus_kpa, "kPa")
        positive(f"the initial bulk modulus of {self._said}", self.bulk_modulus_kpa, "kPa")
        pressure = self.derivatives(np.zeros(4))[4]
        if abs(pressure) > 1e-9 * self.bulk_modulus_kpa:
            raise InputError(
                f"The energy {self._said} must be free of stress at rest: its mean stress there is "
                f"{pressure:.3g} kPa."
            )

    @property
    def _said(self) -> str:
        return shown(self.formula)

    @property
    def energy(self) -> Energy:
        """The law itself."""
        return self

    def scaled(self, factor: Finite) -> Energy:
        """Return the same law with its energy times a factor."""
        return Energy(f"{factor!r} * ({self.formula})", self.coefficients)

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


@value_class
class _OfModuli:
    """Common part of laws whose energy is proportional to their coefficients in kPa."""

    def scaled(self, factor: Finite) -> Self:
        """Return the same law with its energy times a factor."""
        moduli = {
            item.name: getattr(self, item.name)
            for item in fields(self)
            if item.name not in ("exponents", "poisson")
        }
        return replace(
            self,
            **{
                name: tuple(factor * each for each in value) if isinstance(value, tuple) else factor * value
                for name, value in moduli.items()
            },
        )


@value_class
class Polynomial(_OfModuli):
    """Polynomial N = 2 in the isochoric invariants; neo-Hooke and Mooney-Rivlin among them.

    Parameters
    ----------
    c10, c01, c20, c11, c02 : float
        Coefficients of the isochoric energy. [kPa]
    bulk_linear, bulk_cubic : float
        1/D1 and 1/D2 of the volumetric energy; half the bulk modulus is 1/D1. [kPa]

    Examples
    --------
    >>> Polynomial(c10=4.0, c01=1.0, bulk_linear=100.0).shear_modulus_kpa
    10.0
    """

    c10: Finite
    c01: Finite = 0.0
    c20: Finite = 0.0
    c11: Finite = 0.0
    c02: Finite = 0.0
    bulk_linear: Finite = 0.0
    bulk_cubic: NotNegative = 0.0

    def __post_init__(self) -> None:
        positive("initial shear modulus 2 (c10 + c01)", self.shear_modulus_kpa, "kPa")
        positive("bulk_linear (1/D1)", self.bulk_linear, "kPa")

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


@value_class
class _Powers(_OfModuli):
    """Common part of laws that are a sum of up to three powers of stretches."""

    moduli_kpa: Numbers
    exponents: Numbers

    def __post_init__(self) -> None:
        name, moduli, exponents = type(self).__name__, self.moduli_kpa, self.exponents
        if not 1 <= len(moduli) <= 3 or len(moduli) != len(exponents):
            raise InputError(
                name, "needs one to three moduli and as many exponents", f"{len(moduli)} and {len(exponents)}"
            )
        if 0.0 in exponents:
            raise InputError(f"No exponent of {name} may be 0: leave out that term or take Hencky's law.")
        positive(f"the initial shear modulus of {name}, the sum of its moduli", sum(moduli), "kPa")

    @property
    def shear_modulus_kpa(self) -> float:
        """Initial shear modulus. [kPa]"""
        return sum(self.moduli_kpa)

    def _sum_of(self, term: str, *others: str, **coefficients: float) -> Energy:
        """Write the sum of `2 mu_i / alpha_i**2 * (term)` and of other terms."""
        terms = [f"2 * mu{{0}} / alpha{{0}}**2 * ({term})".format(n + 1) for n in range(len(self.exponents))]
        named = [
            (f"{name}{n}", float(value))
            for n, pair in enumerate(zip(self.moduli_kpa, self.exponents, strict=True), start=1)
            for name, value in zip(("mu", "alpha"), pair, strict=True)
        ]
        return Energy(" + ".join((*terms, *others)), (*named, *coefficients.items()))


@value_class
class Ogden(_Powers):
    """Sum of up to three powers of the isochoric stretches.

    Parameters
    ----------
    moduli_kpa : tuple of float
        mu_i; their sum is the initial shear modulus. [kPa]
    exponents : tuple of float
        alpha_i, none of them 0.
    bulk_kpa : float
        Bulk modulus K. [kPa]

    Examples
    --------
    >>> Ogden(moduli_kpa=(8.0, 2.0), exponents=(2.0, 8.0), bulk_kpa=240.0).shear_modulus_kpa
    10.0
    """

    bulk_kpa: Positive

    def __post_init__(self) -> None:
        super().__post_init__()

    @property
    def bulk_modulus_kpa(self) -> float:
        """Initial bulk modulus. [kPa]"""
        return self.bulk_kpa

    @property
    def energy(self) -> Energy:
        """The law as a formula."""
        term = "lambdabar1**alpha{0} + lambdabar2**alpha{0} + lambdabar3**alpha{0} - 3"
        return self._sum_of(term, "bulk / 2 * (J - 1)**2", bulk=float(self.bulk_kpa))


@value_class
class Hyperfoam(_Powers):
    """Storakers' compressible foam (1986), with one Poisson's ratio for all terms: the form of Wu's tissues.

    Parameters
    ----------
    moduli_kpa : tuple of float
        mu_i; their sum is the initial shear modulus. [kPa]
    exponents : tuple of float
        alpha_i, none of them 0.
    poisson : float
        nu; beta = nu / (1 - 2 nu).

    Examples
    --------
    >>> foam = Hyperfoam(moduli_kpa=(3.0,), exponents=(8.0,), poisson=0.4)
    >>> round(foam.bulk_modulus_kpa, 9)  # 2 mu (1/3 + beta)
    14.0
    """

    poisson: Finite

    def __post_init__(self) -> None:
        super().__post_init__()
        check_poisson(self.poisson)

    @property
    def bulk_modulus_kpa(self) -> float:
        """Initial bulk modulus. [kPa]"""
        return bulk_modulus(self.shear_modulus_kpa, self.poisson)

    @property
    def energy(self) -> Energy:
        """The law as a formula."""
        shape = "lambda1**alpha{0} + lambda2**alpha{0} + lambda3**alpha{0} - 3"
        return self._sum_of(
            f"{shape} + (J**(-alpha{{0}} * beta) - 1) / beta", beta=self.poisson / (1 - 2 * self.poisson)
        )


@value_class
class Hencky(_OfModuli):
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

    shear_kpa: Positive
    bulk_kpa: Positive

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


@checked
def check_poisson(poisson: Finite) -> float:
    """Return Poisson's ratio as float if it lies between 0 and 0.5, else raise `InputError`."""
    if not 0.0 < poisson < 0.5:
        raise InputError(
            "poisson",
            "must lie between 0 and 0.5, both excluded",
            repr(poisson),
            "take 0.4999 for a tissue that hardly changes its volume",
        )
    return poisson


def bulk_modulus(shear_kpa: float, poisson: float) -> float:
    """Bulk modulus K = 2 G (1 + nu) / (3 (1 - 2 nu)). [kPa]"""
    poisson = check_poisson(poisson)
    return 2 * shear_kpa * (1 + poisson) / (3 * (1 - 2 * poisson))
