"""Likelihood of observed rates with correlated residuals of unknown size and correlation length.

In each phase an observed rate is the predicted one plus a normal residual of unknown standard deviation
sigma. The error of a model is similar at neighbouring positions: residuals at a distance d have the
correlation exp(-d/l), with an unknown length l; l = 0 means independent residuals. Sigma and l are integrated
out. With

    q_l = r' R_l^-1 r,    R_l = exp(-|x_i - x_j|/l),    sigma^2 ~ scaled inverse chi-square(nu, s^2),

and equal prior probabilities for all lengths of a grid, both integrals have closed forms:

    p(y | theta)  ~  sum_l |R_l|^(-1/2) (nu s^2 + q_l)^(-(n + nu)/2).

See docs/decisions.md#likelihood-of-rates for the evidence that residuals are correlated.

Posterior of an afferent's four identifiable parameters, given recorded rates.

The draws are in coordinates in which the parameters correlate least: the potential at rest over the
threshold, u = beta tau/(C v), and the logarithms of both gains and of tau. The afferent is silent at rest,
u < 1, and ln(1 - u) is sampled instead of u. That coordinate is unbounded, and the posterior has straight
ridges in it: an afferent that fires from an energy density U on determines k_s tau U/(C v) relative to 1 - u.
"""

from __future__ import annotations

from collections.abc import Iterator
from dataclasses import dataclass, field, replace
from typing import Any

import numpy as np
from numpy.typing import ArrayLike
from scipy.special import logsumexp

from fingerpad.core.checked import value_class
from fingerpad.core.errors import InputError
from fingerpad.core.random_streams import generator
from fingerpad.core.values import FiniteVector, FloatArray, Numbers, Positive, Whole
from fingerpad.inference.afferent_fit import start_points
from fingerpad.inference.fitting.posterior import Chains, LogDensity, sample
from fingerpad.inference.identifiable import IDENTIFIABLE_NAMES, identifiable
from fingerpad.inference.rate_model import RateModel, evaluate_rows
from fingerpad.inference.recordings import PHASES, RateRecordings

INDEPENDENT = 0.0  # Length at which residuals are independent. [mm]

LENGTHS_MM = (INDEPENDENT, 0.2, 0.4, 0.6, 0.9, 1.3, 2.0, 3.0)
"""Correlation lengths of the residuals, from a step of the bar to a receptive field. [mm]"""

DEVIATION_HZ = 10.0  # Scale s of the prior of sigma. [spikes/s]
PRIOR_OBSERVATIONS = 1.0  # Degrees of freedom nu of the prior of sigma.


@value_class
class CorrelatedResiduals:
    """Distribution of residuals along a line, whose deviation and correlation length are integrated out."""

    n_residuals: Whole
    positions_mm: FiniteVector | None = None
    """Their places along a line; default: independent residuals, (n_residuals,). [mm]"""
    lengths_mm: Numbers = LENGTHS_MM  #: Grid of correlation lengths; 0 for independence. [mm]
    deviation: Positive = DEVIATION_HZ  #: Scale s of the prior of sigma. [unit of the residuals]
    _whitening: FloatArray = field(init=False, repr=False, compare=False)
    _log_weights: FloatArray = field(init=False, repr=False, compare=False)

    def __post_init__(self) -> None:
        n = self.n_residuals
        lengths = np.array(self.lengths_mm)
        if not lengths.size or (lengths < 0.0).any():
            raise InputError("lengths_mm", "must hold lengths of at least 0", str(self.lengths_mm))
        if self.positions_mm is None:
            lengths, distances = np.zeros(1), np.zeros((n, n))
        else:
            places = self.positions_mm
            if places.size != n or np.unique(places).size != n:
                got = f"{places.size} values, {np.unique(places).size} of them different"
                raise InputError("positions_mm", f"needs a different position for each of {n} stimuli", got)
            distances = np.abs(places[:, None] - places)
        whitening = np.array([_whitening(distances, length) for length in lengths])
        # log |R|^(-1/2), and equal prior probabilities.
        log_weights = np.log(np.diagonal(whitening, axis1=1, axis2=2)).sum(axis=1) - np.log(lengths.size)
        object.__setattr__(self, "lengths_mm", tuple(lengths.tolist()))
        object.__setattr__(self, "_whitening", whitening)
        object.__setattr__(self, "_log_weights", log_weights)

    def log_likelihood(self, residuals: FloatArray) -> FloatArray:
        """Log likelihood (n_points,) of rows of residuals (n_points, n_residuals), up to a constant."""
        return np.asarray(logsumexp(self._log_shares(self._squares(residuals)), axis=1))

    def draw(self, residuals: FloatArray, random: np.random.Generator) -> tuple[FloatArray, FloatArray]:
        """Draw sigma and length (n_points,) given rows of residuals (n_points, n_residuals)."""
        squares = self._squares(residuals)
        n_points = len(squares)
        logarithms = self._log_shares(squares)
        shares = np.cumsum(np.exp(logarithms - logsumexp(logarithms, axis=1, keepdims=True)), axis=1)
        which = (random.uniform(size=(n_points, 1)) > shares[:, :-1]).sum(axis=1)
        total = PRIOR_OBSERVATIONS * self.deviation**2 + squares[np.arange(n_points), which]
        deviation = np.sqrt(total / random.chisquare(PRIOR_OBSERVATIONS + self.n_residuals, size=n_points))
        return deviation, np.array(self.lengths_mm)[which]

    def _squares(self, residuals: FloatArray) -> FloatArray:
        """Return q (n_points, n_lengths)."""
        white = residuals @ np.swapaxes(self._whitening, 1, 2)  # (n_lengths, n_points, n_residuals)
        return (white**2).sum(axis=2).T

    def _log_shares(self, squares: FloatArray) -> FloatArray:
        """Logarithm of the likelihood for each length, (n_points, n_lengths)."""
        exponent = 0.5 * (PRIOR_OBSERVATIONS + self.n_residuals)
        return self._log_weights - exponent * np.log(PRIOR_OBSERVATIONS * self.deviation**2 + squares)


@dataclass(frozen=True)
class RateLikelihood:
    """Likelihood of the parameters of a rate model, given the observed rates of one afferent."""

    model: RateModel  #: Predicts the rates under all stimuli.
    recordings: RateRecordings  #: Observed rates, one row per stimulus.
    residuals: CorrelatedResiduals  #: Those of either phase, one per stimulus. [spikes/s]

    def __post_init__(self) -> None:
        self.recordings.check_stimuli(self.model.n_stimuli)

    def log_likelihood(self, points: FloatArray) -> FloatArray:
        """Log likelihood of parameters up to a constant, with sigma and length integrated out.

        The constant does not depend on the model or the lengths, so differences between them are evidence.
        """
        return sum(
            (self.residuals.log_likelihood(residuals) for _, _, residuals in self._phases(points)),
            start=np.zeros(len(points)),
        )

    def residual_draws(self, points: FloatArray, random: np.random.Generator) -> dict[str, ResidualDraws]:
        """Draw sigma and length of every phase for each row of parameters."""
        drawn = {}
        for phase, predicted, residuals in self._phases(points):
            deviation, length = self.residuals.draw(residuals, random)
            # A new recording has residuals of the same size, independent of those observed.
            new = np.maximum(predicted + deviation[:, None] * random.normal(size=predicted.shape), 0.0)
            drawn[phase] = ResidualDraws(predicted, new, deviation, length)
        return drawn

    def _phases(self, points: FloatArray) -> Iterator[tuple[str, FloatArray, FloatArray]]:
        """Name, predicted rates and residuals (n_points, n_stimuli) of each recorded phase."""
        predicted = dict(zip(PHASES, evaluate_rows(self.model, points), strict=True))
        for phase in self.recordings.phases:
            yield phase, predicted[phase], getattr(self.recordings, f"{phase}_rate_hz") - predicted[phase]


@dataclass(frozen=True)
class ResidualDraws:
    """Rates of one phase, predicted and of a new recording."""

    predicted_hz: FloatArray
    new_hz: FloatArray
    """Predicted rates, and rates with a random residual, not below 0, (n_points, n_stimuli). [spikes/s]"""
    deviation_hz: FloatArray  #: Standard deviation sigma, (n_points,). [spikes/s]
    length_mm: FloatArray  #: Correlation length of the residuals; 0 if independent, (n_points,). [mm]


def _whitening(distances_mm: FloatArray, length_mm: float) -> FloatArray:
    """Lower triangle W with W R W' = 1."""
    if length_mm == INDEPENDENT:
        return np.eye(len(distances_mm))
    factor = np.linalg.cholesky(np.exp(-distances_mm / length_mm))
    return np.asarray(np.linalg.inv(factor), dtype=np.float64)


COORDINATE_NAMES = ("resting_share", "log_dynamic_gain", "log_static_gain", "log_time_constant")
"""beta tau/(C v) [1], and the logarithms of k_d/(C v), k_s/(C v) and tau in the units of the parameters."""

START_SPREAD = (0.8, 0.8, 0.4, 0.8)
"""Standard deviation of the walkers' starts about the fit, in the sampled coordinates. It is no smaller than
that of the posteriors seen so far, so that ensembles which still depend on their start disagree."""

SMALLEST_MARGIN = 0.01
"""Smallest 1 - u of a start: walkers of a fit that is closer to the threshold at rest start here. [1]"""

N_PREDICTED = 1000  # Draws from which the bands of the rates are computed.


def to_coordinates(four: ArrayLike) -> FloatArray:
    numbers = np.asarray(four, dtype=np.float64)
    if numbers.shape[-1:] != (4,) or not (numbers[..., 1:] > 0.0).all():
        wanted = f"must hold {', '.join(IDENTIFIABLE_NAMES)}, all but the first greater than 0"
        raise InputError("four", wanted, str(numbers.tolist()))
    tau = numbers[..., 3:]
    return np.concatenate([numbers[..., :1] * tau, np.log(numbers[..., 1:])], axis=-1)


def from_coordinates(points: ArrayLike) -> FloatArray:
    coordinates = np.asarray(points, dtype=np.float64)
    positive_three = np.exp(coordinates[..., 1:])
    return np.concatenate([coordinates[..., :1] / positive_three[..., 2:], positive_three], axis=-1)


@dataclass(frozen=True)
class AfferentPrior:
    """Prior of an afferent's parameters, normal in the coordinates.

    The potential at rest stays below the threshold, so that no spike occurs without a stimulus.
    """

    centre: FloatArray
    spread: FloatArray  #: Mean and standard deviation of each coordinate, (4,).

    def log_density(self, coordinates: FloatArray) -> FloatArray:
        """Log density of rows of coordinates, up to a constant; -inf where it is impossible."""
        logarithm = -0.5 * (((coordinates - self.centre) / self.spread) ** 2).sum(axis=-1)
        return np.where(coordinates[..., 0] >= 1.0, -np.inf, logarithm)


WEAK_PRIOR = AfferentPrior(
    np.array([0.0, *np.log(identifiable(start_points()[0])[1:])]),
    np.array([1.0, np.log(10.0), np.log(10.0), np.log(2.0)]),
)
"""Weakly informative prior about the start point of fits, the paper's first one with its gains rescaled. Two
thirds of it lie within a factor of 10 of the gains and of 2 of tau; docs/decisions.md#priors."""


@dataclass(frozen=True)
class AfferentPosterior:
    """Posterior draws of the four identifiable parameters and of the rates that they predict."""

    chains: Chains  #: Draws in the coordinates, with their measures of convergence.
    four: FloatArray  #: The same draws as the four identifiable parameters, (n_draws, 4).
    rates: dict[str, ResidualDraws]
    """By phase, for some of the draws: predicted rates, new recordings, sigma and length."""


def log_posterior(likelihood: RateLikelihood, prior: AfferentPrior) -> LogDensity:
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
    prior: AfferentPrior = WEAK_PRIOR,
    **settings: Any,
) -> AfferentPosterior:
    density, centre = log_posterior(likelihood, prior), to_coordinates(start)
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
