"""Tissues of the emulator: a space-filling set of points in the ratios of moduli, nu and relaxation.

A common factor on all moduli multiplies forces and stresses at a prescribed depth and changes nothing else:
all layers are neo-Hookean, and a bulk modulus follows from its shear modulus. Every point is therefore
pressed with one modulus of the subcutis, and the factor is a parameter without a press.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np
from scipy.stats import qmc

from fingerpad.core.errors import InputError
from fingerpad.core.values import FloatArray, float_array
from fingerpad.mechanics.materials import Prony, Tissues
from fingerpad.mechanics.tissues import skin_prony
from studies.tissue_candidates import STRESS, Candidate, neo_hookean

REFERENCE_KPA = 2.0
"""Shear modulus of the subcutis in all presses. [kPa]"""


@dataclass(frozen=True)
class TissueRange:
    """Range of one parameter of the tissues, in which its prior, or that of its logarithm, is uniform."""

    name: str
    low: float
    high: float
    logarithmic: bool = True

    def at(self, share: FloatArray) -> FloatArray:
        """Values at shares of the range. [0-1]"""
        if self.logarithmic:
            return self.low * (self.high / self.low) ** share
        return self.low + (self.high - self.low) * share

    def share(self, value: FloatArray) -> FloatArray:
        """Share of the range below a value: the inverse of `at`."""
        if self.logarithmic:
            return np.log(value / self.low) / np.log(self.high / self.low)
        return (value - self.low) / (self.high - self.low)


RANGES = (
    TissueRange("stratum corneum / living epidermis", 1.0, 10.0),
    TissueRange("living epidermis / dermis", 0.5, 4.0),
    TissueRange("dermis / subcutis", 1.5, 8.0),
    TissueRange("nu, long-term", 0.30, 0.48, logarithmic=False),
    TissueRange("share that relaxes", 0.0, 0.6, logarithmic=False),
)
"""What a press depends on, all assumed: ratios of shear moduli, Poisson's ratio of all layers, and the sum of
the shares of their Prony series, whose times are those of skin."""


def tissues_at(point: Sequence[float] | FloatArray) -> Tissues:
    """Tissues of a point (5,), values of the parameters of `RANGES`, with the subcutis of `REFERENCE_KPA`.

    Examples
    --------
    >>> tissues = tissues_at([4.0, 2.0, 3.0, 0.4, 0.2])
    >>> [round(layer.shear_modulus_kpa, 6) for layer in tissues.layers]
    [48.0, 12.0, 6.0, 2.0]
    >>> round(tissues.dermis.prony.long_term_share, 6)
    0.8
    """
    values = float_array("point", point, 1)
    if values.size != len(RANGES):
        raise InputError(f"point must have {len(RANGES)} values: got {values.size}.")
    outer, inner, deep, poisson, relaxing = values.tolist()
    dermis = deep * REFERENCE_KPA
    epidermis = inner * dermis
    skin = skin_prony()
    shares = tuple(each * relaxing / sum(skin.shares) for each in skin.shares)
    moduli = (outer * epidermis, epidermis, dermis, REFERENCE_KPA)
    return neo_hookean(moduli, poisson, Prony(shares, skin.times_ms))


def point_of(tissues: Tissues) -> FloatArray:
    """Values of the parameters of `RANGES` of neo-Hookean tissues: the inverse of `tissues_at`.

    Examples
    --------
    >>> point_of(tissues_at([4.0, 2.0, 3.0, 0.4, 0.2])).round(6).tolist()
    [4.0, 2.0, 3.0, 0.4, 0.2]
    """
    moduli = np.array([layer.shear_modulus_kpa for layer in tissues.layers])
    inner = tissues.dermis
    return np.array([*(moduli[:-1] / moduli[1:]), inner.poisson, 1.0 - inner.prony.long_term_share])


def design(n_points: int) -> FloatArray:
    """Return scrambled Sobol points as shares of `RANGES`, (n_points, 5); fewer are the first of the same.

    Examples
    --------
    >>> bool((design(8)[:4] == design(4)).all())
    True
    """
    bits = int(np.ceil(np.log2(n_points)))
    return qmc.Sobol(len(RANGES), scramble=True, rng=0).random_base2(bits)[:n_points]


def values_at(shares: FloatArray) -> FloatArray:
    """Values (..., 5) of the parameters at shares (..., 5) of their ranges."""
    return np.stack([one.at(shares[..., number]) for number, one in enumerate(RANGES)], axis=-1)


def shares_of(values: FloatArray) -> FloatArray:
    """Shares (..., 5) of the ranges at values (..., 5): the inverse of `values_at`."""
    return np.stack([one.share(values[..., number]) for number, one in enumerate(RANGES)], axis=-1)


def design_candidates(n_points: int) -> list[Candidate]:
    """Candidates of the design; both terms of their current follow compressive stress."""
    points = values_at(design(n_points))
    return [Candidate(f"design {number}", tissues_at(values), STRESS) for number, values in enumerate(points)]
