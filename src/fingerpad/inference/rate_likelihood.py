"""Likelihood of observed rates with correlated residuals of unknown size and correlation length.

In each phase an observed rate is the predicted one plus a normal residual of unknown standard deviation
sigma. The error of a model is similar at neighbouring positions: residuals at a distance d have the
correlation exp(-d/l), with an unknown length l; l = 0 means independent residuals. Sigma and l are integrated
out. With

    q_l = r' R_l^-1 r,    R_l = exp(-|x_i - x_j|/l),    sigma^2 ~ scaled inverse chi-square(nu, s^2),

and equal prior probabilities for all lengths of a grid, both integrals have closed forms:

    p(y | theta)  ~  sum_l |R_l|^(-1/2) (nu s^2 + q_l)^(-(n + nu)/2).

See docs/decisions.md#likelihood-of-rates for the evidence that residuals are correlated.
"""

from __future__ import annotations

from collections.abc import Iterator
from dataclasses import dataclass, field

import numpy as np
from pydantic import SkipValidation
from scipy.special import logsumexp

from fingerpad.core.checked import value_class
from fingerpad.core.errors import InputError
from fingerpad.core.values import FiniteVector, FloatArray, Numbers, Positive, Whole
from fingerpad.inference.rate_model import RateModel
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
    lengths_mm: Numbers = LENGTHS_MM  # Grid of correlation lengths; 0 for independence. [mm]
    deviation: Positive = DEVIATION_HZ  # Scale s of the prior of sigma. [unit of the residuals]
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
                raise InputError(
                    "positions_mm",
                    f"needs a different position for each of {n} stimuli",
                    f"{places.size} values, {np.unique(places).size} of them different",
                )
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


@value_class
class RateLikelihood:
    """Likelihood of the parameters of a rate model, given the observed rates of one afferent."""

    model: SkipValidation[RateModel]  # Predicts the rates under all stimuli.
    recordings: RateRecordings  # Observed rates, one row per stimulus.
    positions_mm: FloatArray | None = None
    """Position of each stimulus along a line; default: independent residuals, (n_stimuli,). [mm]"""
    lengths_mm: Numbers = LENGTHS_MM  # Grid of correlation lengths; 0 for independence. [mm]
    deviation_hz: Positive = DEVIATION_HZ  # Scale s of the prior of sigma. [spikes/s]
    _residuals: CorrelatedResiduals = field(init=False, repr=False, compare=False)

    def __post_init__(self) -> None:
        n = self.model.n_stimuli
        if len(self.recordings.stimuli) != n:
            raise InputError(
                "recordings",
                "needs one stimulus per column of the model's drive",
                f"{len(self.recordings.stimuli)} for {n}",
            )
        residuals = CorrelatedResiduals(n, self.positions_mm, self.lengths_mm, self.deviation_hz)
        object.__setattr__(self, "_residuals", residuals)
        object.__setattr__(self, "lengths_mm", residuals.lengths_mm)

    @property
    def phases(self) -> tuple[str, ...]:
        """Which of "dynamic" and "static" were recorded."""
        return self.recordings.phases

    def log_likelihood(self, points: FloatArray) -> FloatArray:
        """Log likelihood of parameters up to a constant, with sigma and length integrated out.

        The constant does not depend on the model or the lengths, so differences between them are evidence.
        """
        return sum(
            (self._residuals.log_likelihood(residuals) for _, _, residuals in self._phases(points)),
            start=np.zeros(len(points)),
        )

    def residual_draws(self, points: FloatArray, random: np.random.Generator) -> dict[str, ResidualDraws]:
        """Draw sigma and length of every phase for each row of parameters."""
        drawn = {}
        for phase, predicted, residuals in self._phases(points):
            deviation, length = self._residuals.draw(residuals, random)
            # A new recording has residuals of the same size, independent of those observed.
            new = np.maximum(predicted + deviation[:, None] * random.normal(size=predicted.shape), 0.0)
            drawn[phase] = ResidualDraws(predicted, new, deviation, length)
        return drawn

    def _phases(self, points: FloatArray) -> Iterator[tuple[str, FloatArray, FloatArray]]:
        """Name, predicted rates and residuals (n_points, n_stimuli) of each recorded phase."""
        predicted = dict(zip(PHASES, self.model.evaluate_batch(points), strict=True))
        for phase in self.phases:
            yield phase, predicted[phase], getattr(self.recordings, f"{phase}_rate_hz") - predicted[phase]


@dataclass(frozen=True)
class ResidualDraws:
    """Rates of one phase, predicted and of a new recording."""

    predicted_hz: FloatArray
    new_hz: FloatArray
    """Predicted rates, and rates with a random residual, not below 0, (n_points, n_stimuli). [spikes/s]"""
    deviation_hz: FloatArray  # Standard deviation sigma, (n_points,). [spikes/s]
    length_mm: FloatArray  # Correlation length of the residuals; 0 if they are independent, (n_points,). [mm]


def _whitening(distances_mm: FloatArray, length_mm: float) -> FloatArray:
    """Lower triangle W with W R W' = 1."""
    if length_mm == INDEPENDENT:
        return np.eye(len(distances_mm))
    factor = np.linalg.cholesky(np.exp(-distances_mm / length_mm))
    return np.asarray(np.linalg.inv(factor), dtype=np.float64)
