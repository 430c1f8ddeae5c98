"""From Wu's hyperfoam tissues to polynomials N = 2: uniaxial closed forms, and coefficients between them.

The paper cites Wu for the polynomials of its Trials 2 and 3, and their coefficients are lost. What Wu
published are hyperfoams. This is the way from one law to the other that a user of the paper's solver would
take: load a bar along one axis, and fit the nominal stress.
"""

from __future__ import annotations

import numpy as np
from numpy.typing import ArrayLike
from scipy.optimize import nnls

from fingerpad.core.checks import FloatArray, float_array, whole
from fingerpad.core.errors import InputError
from fingerpad.core.results import Vector, result_class
from fingerpad.data import tissues as published

POINTS = 60
"""Stretches between the most compressed and the unloaded state at which the stress is fitted."""


def hyperfoam_stress_kpa(
    stretch: ArrayLike, mu_kpa: ArrayLike, alpha: ArrayLike, poisson: float
) -> FloatArray:
    """Nominal stress of a hyperfoam bar that is loaded along one axis and free to the sides.

        W = sum 2 mu_i / alpha_i² [l1^alpha_i + l2^alpha_i + l3^alpha_i - 3 + (J^(-alpha_i b) - 1) / b]
        b = nu / (1 - 2 nu)

    Sides free of stress have the stretch l^-nu, so that J = l^(1 - 2 nu) and

        P = 2 / l sum mu_i / alpha_i [l^alpha_i - J^(-alpha_i b)].

    Parameters
    ----------
    stretch : array_like (n,)
        Stretch l along the axis, above 0.
    mu_kpa, alpha : array_like (n_terms,)
        Moduli and exponents. [kPa, 1]
    poisson : float
        The same nu in every term, at least 0 and below 0.5.

    Returns
    -------
    array (n,)
        P, negative in compression. [kPa]

    Raises
    ------
    InputError
        If a stretch is not above zero, the terms do not pair up, or nu is out of range.

    Examples
    --------
    One term with alpha = 2 and nu = 0 is P = mu (l - 1/l).

    >>> hyperfoam_stress_kpa([0.5], [1.0], [2.0], 0.0).tolist()
    [-1.5]
    """
    length = _stretches(stretch)
    moduli, exponents = float_array("mu_kpa", mu_kpa, 1), float_array("alpha", alpha, 1)
    if moduli.size != exponents.size:
        raise InputError(
            f"mu_kpa and alpha must have one entry per term: got {moduli.size} and {exponents.size}."
        )
    if not 0.0 <= poisson < 0.5:
        raise InputError(f"poisson must be at least 0 and below 0.5: got {poisson!r}.")
    volume = length ** (1.0 - 2.0 * poisson)
    bulk_exponent = poisson / (1.0 - 2.0 * poisson)
    terms = (
        moduli / exponents * (length[:, None] ** exponents - volume[:, None] ** (-exponents * bulk_exponent))
    )
    return 2.0 / length * terms.sum(axis=1)


def polynomial_stress_terms(stretch: ArrayLike) -> FloatArray:
    """Nominal stress per unit of C10, C01, C20, C11, C02 of an incompressible bar loaded along one axis.

        P = 2 (l - l^-2) (W1 + W2 / l),   I1 = l² + 2 / l,   I2 = 2 l + l^-2
        W1 = C10 + 2 C20 (I1-3) + C11 (I2-3),   W2 = C01 + C11 (I1-3) + 2 C02 (I2-3)

    Parameters
    ----------
    stretch : array_like (n,)
        Stretch l, above 0.

    Returns
    -------
    array (n, 5)

    Raises
    ------
    InputError
        If a stretch is not above zero.

    Examples
    --------
    >>> polynomial_stress_terms([2.0]).tolist()
    [[3.5, 1.75, 14.0, 7.875, 4.375]]
    """
    length = _stretches(stretch)
    first, second = length**2 + 2.0 / length - 3.0, 2.0 * length + length**-2 - 3.0
    pull = 2.0 * (length - length**-2)
    columns = (
        np.ones_like(length),
        1.0 / length,
        2.0 * first,
        second + first / length,
        2.0 * second / length,
    )
    return pull[:, None] * np.column_stack(columns)


def polynomial_of_hyperfoam(
    mu_kpa: ArrayLike, alpha: ArrayLike, poisson: float, compression: float = 0.5
) -> tuple[FloatArray, float]:
    """Fit a polynomial N = 2 to a hyperfoam in uniaxial compression.

    Least squares over evenly spaced stretches, with coefficients that must not be negative: a polynomial of
    such coefficients is stable at any stretch, while the free fit alternates in sign and is not.

    Parameters
    ----------
    mu_kpa, alpha, poisson
        As in `hyperfoam_stress_kpa`.
    compression : float, optional
        Largest shortening that is fitted, between 0 and 1.

    Returns
    -------
    coefficients : array (5,)
        C10, C01, C20, C11, C02. [kPa]
    misfit : float
        Root mean square of the stress error over the largest stress.

    Raises
    ------
    InputError
        If the compression is out of range, or as `hyperfoam_stress_kpa`.

    Examples
    --------
    >>> from fingerpad.data import tissues
    >>> mu, alpha = tissues.WU_SKIN_HYPERFOAM_MU.value, tissues.WU_SKIN_HYPERFOAM_ALPHA.value
    >>> coefficients, misfit = polynomial_of_hyperfoam(mu, alpha, 0.48)
    >>> coefficients.round(3).tolist(), misfit < 0.001
    ([0.516, 0.0, 0.0, 0.08, 0.056], True)
    """
    if not 0.0 < compression < 1.0:
        raise InputError(f"compression must lie between 0 and 1: got {compression!r}.")
    stretch = np.linspace(1.0 - compression, 1.0, whole("POINTS", POINTS, 2), endpoint=False)
    stress = hyperfoam_stress_kpa(stretch, mu_kpa, alpha, poisson)
    terms = polynomial_stress_terms(stretch)
    coefficients, residual = nnls(-terms, -stress)
    misfit = residual / np.sqrt(stretch.size) / np.abs(stress).max()
    return float_array("coefficients", coefficients, 1), float(misfit)


def _stretches(stretch: ArrayLike) -> FloatArray:
    length = float_array("stretch", stretch, 1)
    if not (length > 0.0).all():
        raise InputError(f"stretch must be above 0 everywhere: got {length.min():g}.")
    return length


COMPRESSIONS = (0.3, 0.5)
"""Shortenings up to which Wu's stress is fitted for the table; the second is used."""


@result_class
class PolynomialOfFoam:
    """A polynomial fitted to one of Wu's hyperfoams.

    Parameters
    ----------
    layer : str
        Of the skin.
    poisson, compression : float
        Poisson ratio, and the shortening up to which the stress is fitted. [1]
    coefficients_kpa : array (5,)
        C10, C01, C20, C11, C02. [kPa]
    misfit : float
        Root mean square of the stress error over the largest stress. [1]
    """

    layer: str
    poisson: float
    compression: float
    coefficients_kpa: Vector
    misfit: float


def polynomials() -> tuple[PolynomialOfFoam, ...]:
    """Coefficients of the polynomials that stand for Wu's hyperfoams, and how well they do. [kPa]

    Examples
    --------
    >>> [(found.layer, found.poisson, found.compression) for found in polynomials()][0]
    ('dermis', 0.4, 0.3)
    """
    layers = {
        "dermis": (published.WU_SKIN_HYPERFOAM_MU.value, published.WU_SKIN_HYPERFOAM_ALPHA.value),
        "subcutis": (published.WU_SUBCUTIS_HYPERFOAM_MU.value, published.WU_SUBCUTIS_HYPERFOAM_ALPHA.value),
    }
    rows = []
    for layer, (mu, alpha) in layers.items():
        for poisson in (published.WU_HYPERFOAM_POISSON.value, published.POISSON_RATIO.value):
            for compression in COMPRESSIONS:
                coefficients, misfit = polynomial_of_hyperfoam(mu, alpha, poisson, compression)
                rows.append(
                    PolynomialOfFoam(
                        layer=layer,
                        poisson=poisson,
                        compression=compression,
                        coefficients_kpa=coefficients,
                        misfit=misfit,
                    )
                )
    return tuple(rows)
