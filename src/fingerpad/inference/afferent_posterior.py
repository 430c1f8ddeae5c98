"""Posterior of an afferent's four identifiable parameters, given recorded rates.

The draws are in coordinates in which the parameters correlate least: the potential at rest over the
threshold, u = beta tau/(C v), and the logarithms of both gains and of tau. The afferent is silent at rest,
u < 1, and ln(1 - u) is sampled instead of u. That coordinate is unbounded, and the posterior has straight
ridges in it: an afferent that fires from an energy density U on determines k_s tau U/(C v) relative to 1 - u.
"""

from __future__ import annotations

from dataclasses import dataclass, replace
from typing import Any

import numpy as np
from numpy.typing import ArrayLike

from fingerpad.core.checked import value_class
from fingerpad.core.errors import InputError
from fingerpad.core.random_streams import generator
from fingerpad.core.values import Finite, FloatArray, Positive
from fingerpad.data import neuron
from fingerpad.inference.fitting.posterior import Chains, LogDensity, sample
from fingerpad.inference.identifiable import IDENTIFIABLE_NAMES, identifiable, six_parameters
from fingerpad.inference.rate_likelihood import RateLikelihood, ResidualDraws

COORDINATE_NAMES = ("resting_share", "log_dynamic_gain", "log_static_gain", "log_time_constant")
"""beta tau/(C v) [1], and the logarithms of k_d/(C v), k_s/(C v) and tau in the units of the parameters."""

START_SPREAD = (0.8, 0.8, 0.4, 0.8)
"""Standard deviation of the walkers' starts about the fit, in the sampled coordinates. It is no smaller than
that of the posteriors seen so far, so that ensembles which still depend on their start disagree."""

SMALLEST_MARGIN = 0.01
"""Smallest 1 - u of a start: walkers of a fit that is closer to the threshold at rest start here. [1]"""

N_PREDICTED = 1000  # Draws from which the bands of the rates are computed.

_START = identifiable(
    [
        neuron.INTERCEPT_START.value,
        neuron.DYNAMIC_GAIN_SCALE.value * neuron.DYNAMIC_GAIN_START_1.value,
        neuron.STATIC_GAIN_SCALE.value * neuron.STATIC_GAIN_START_1.value,
        neuron.TIME_CONSTANT.value,
        neuron.CAPACITANCE.value,
        neuron.THRESHOLD.value,
    ]
)


def to_coordinates(four: ArrayLike) -> FloatArray:
    numbers = np.asarray(four, dtype=np.float64)
    if numbers.shape[-1:] != (4,) or not (numbers[..., 1:] > 0.0).all():
        raise InputError(
            "four",
            f"must hold {', '.join(IDENTIFIABLE_NAMES)}, all but the first greater than 0",
            str(numbers.tolist()),
        )
    tau = numbers[..., 3:]
    return np.concatenate([numbers[..., :1] * tau, np.log(numbers[..., 1:])], axis=-1)


def from_coordinates(points: ArrayLike) -> FloatArray:
    coordinates = np.asarray(points, dtype=np.float64)
    positive_three = np.exp(coordinates[..., 1:])
    return np.concatenate([coordinates[..., :1] / positive_three[..., 2:], positive_three], axis=-1)


@value_class
class AfferentPrior:
    """Weakly informative prior of an afferent's parameters.

    The potential at rest is normal about 0 and stays below the threshold, so that no spike occurs without a
    stimulus; gains and time constant are log-normal about the start point of
    fits, the paper's first one with its gains rescaled. See docs/decisions.md#priors.
    """

    resting_share_sd: Positive = 1.0  # Standard deviation of the potential at rest over the threshold. [1]
    dynamic_gain_per_kpa: Positive = float(_START[1])
    static_gain_per_kpa_ms: Positive = float(_START[2])
    time_constant_ms: Positive = float(_START[3])
    """Medians of k_d/(C v), k_s/(C v) and tau. [1/kPa, 1/(kPa ms), ms]"""
    gain_factor: Finite = 10.0
    time_constant_factor: Finite = 2.0
    """Two thirds of the prior lie between the median divided and multiplied by this factor. [1]"""

    def __post_init__(self) -> None:
        for name in ("gain_factor", "time_constant_factor"):
            if getattr(self, name) <= 1.0:
                raise InputError(name, "must be greater than 1", repr(getattr(self, name)))

    @property
    def centre(self) -> FloatArray:
        medians = (self.dynamic_gain_per_kpa, self.static_gain_per_kpa_ms, self.time_constant_ms)
        return np.array([0.0, *np.log(medians)])

    @property
    def spread(self) -> FloatArray:
        gain, time_constant = np.log(self.gain_factor), np.log(self.time_constant_factor)
        return np.array([self.resting_share_sd, gain, gain, time_constant])

    def log_density(self, coordinates: FloatArray) -> FloatArray:
        """Log density of rows of coordinates, up to a constant; -inf where it is impossible."""
        logarithm = -0.5 * (((coordinates - self.centre) / self.spread) ** 2).sum(axis=-1)
        return np.where(coordinates[..., 0] >= 1.0, -np.inf, logarithm)


@dataclass(frozen=True)
class AfferentPosterior:
    """Posterior draws of the four identifiable parameters and of the rates that they predict."""

    chains: Chains  # Draws in the coordinates, with their measures of convergence.
    four: FloatArray  # The same draws as the four identifiable parameters, (n_draws, 4).
    rates: dict[str, ResidualDraws]
    """By phase, for some of the draws: predicted rates, new recordings, sigma and length."""

    def six(self, capacitance_mf: float, threshold_mv: float) -> FloatArray:
        """Return the draws as six parameters (n_draws, 6) with the given C [mF] and v [mV]."""
        return six_parameters(self.four, capacitance_mf, threshold_mv)


def log_posterior(likelihood: RateLikelihood, prior: AfferentPrior) -> LogDensity:
    if likelihood.model.names != IDENTIFIABLE_NAMES:
        raise InputError(
            "likelihood",
            f"needs a model of {', '.join(IDENTIFIABLE_NAMES)}, as four_number_model makes it",
            f"one of {', '.join(likelihood.model.names)}",
        )

    def log_density(points: FloatArray) -> FloatArray:
        heights = prior.log_density(points)
        possible = np.isfinite(heights)
        heights[possible] += likelihood.log_likelihood(from_coordinates(points[possible]))
        return heights

    return log_density


def afferent_posterior(
    likelihood: RateLikelihood,
    start: ArrayLike,
    *,
    seed: int,
    prior: AfferentPrior | None = None,
    **settings: Any,
) -> AfferentPosterior:
    density, centre = log_posterior(likelihood, prior or AfferentPrior()), to_coordinates(start)
    centre[0] = min(centre[0], 1.0 - SMALLEST_MARGIN)

    def unconstrained_density(points: FloatArray) -> FloatArray:
        return density(_constrained(points)) + points[:, 0]  # the Jacobian's logarithm is ln(1 - u)

    begin = _unconstrained(centre), START_SPREAD, COORDINATE_NAMES
    chains = sample(unconstrained_density, *begin, seed=seed, **settings)
    # Draws become u; R-hat and effective sizes depend on ranks only and stay.
    logs = chains.log_densities - chains.draws[..., 0]
    chains = replace(chains, draws=_constrained(chains.draws), log_densities=logs)
    some = from_coordinates(chains.spread_out(N_PREDICTED))
    return AfferentPosterior(
        chains, from_coordinates(chains.flat), likelihood.residual_draws(some, generator([seed, 1]))
    )


def _unconstrained(coordinates: FloatArray) -> FloatArray:
    """Replace the potential at rest u by ln(1 - u)."""
    return np.concatenate([np.log(1.0 - coordinates[..., :1]), coordinates[..., 1:]], axis=-1)


def _constrained(points: FloatArray) -> FloatArray:
    """Replace ln(1 - u) by u: the inverse of `_unconstrained`."""
    return np.concatenate([1.0 - np.exp(points[..., :1]), points[..., 1:]], axis=-1)
