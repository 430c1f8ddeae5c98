"""Problems of fitting: rates (paper, Eqs. 12-14), and rates with hit rates of people at once.

    score = FSS - w sum (h - h_people)^2

FSS is that of Eqs. 12-14. The hit rates h are those that a population of such afferents predicts, without
free parameters of its own. FSS is flat along some directions, such as a lower intercept with larger gains.
The hit rates choose among parameters that explain the firing rates equally well
(docs/decisions/paper-and-human.md).
"""

from __future__ import annotations

from collections.abc import Callable, Iterator
from dataclasses import dataclass

import numpy as np
from pydantic import SkipValidation

from fingerpad.core.checked import value_class
from fingerpad.core.errors import InputError
from fingerpad.core.values import FiniteVector, FloatArray, IntArray, NotNegative, Positive
from fingerpad.data import protocol
from fingerpad.inference.fitting.cross_validation import fractional_sum_of_squares
from fingerpad.inference.rate_model import RateModel, Rates, evaluate_rows
from fingerpad.inference.recordings import RateRecordings
from fingerpad.psychophysics.observer import expected_euclidean_hit_rates, expected_hit_rates


@value_class
class RateProblem:
    """Recorded rates and the model that is fitted to them.

    Gerling et al. 2014, Eqs. 12-14. The sums run over the chosen stimuli.
    """

    model: SkipValidation[RateModel]  # Predicts the rates under all stimuli, in the order of the recordings.
    recordings: RateRecordings  # Observed rates. A phase that was not recorded does not enter the score.
    dynamic_weight: NotNegative = protocol.DYNAMIC_WEIGHT.value
    static_weight: NotNegative = protocol.STATIC_WEIGHT.value
    """Weights of the two phases where both were recorded, Eq. 12. [1]"""

    def __post_init__(self) -> None:
        observed = len(self.recordings.stimuli)
        if observed != self.model.n_stimuli:
            raise InputError(
                "recordings",
                "needs one stimulus per column of the model's drive",
                f"{observed} for {self.model.n_stimuli}",
            )

    @property
    def names(self) -> tuple[str, ...]:
        return self.model.names

    @property
    def n_observations(self) -> int:
        """Number of stimuli, whether one or two rates were recorded under each."""
        return self.model.n_stimuli

    def residuals(self, parameters: FloatArray, chosen: IntArray) -> FloatArray:
        """Differences of the recorded phases, scaled so that FSS = 1 - residuals @ residuals.

        r_i = sqrt(w / sum f^2) (f_i - p_i), with the weight w, observed f and predicted p of each phase.
        """
        return np.concatenate(
            [
                np.sqrt(weight / (observed @ observed)) * (observed - predicted)
                for weight, observed, predicted in self._phases(parameters, chosen)
            ]
        )

    def jacobian_of(
        self, slopes: Callable[[FloatArray], Rates]
    ) -> Callable[[FloatArray, IntArray], FloatArray]:
        """Return a function for the Jacobian of the residuals, from derivatives of the rates.

        Its result has the shape (n_residuals, n_parameters).
        """

        def jacobian(parameters: FloatArray, chosen: IntArray) -> FloatArray:
            return np.concatenate(
                [
                    -np.sqrt(weight / (observed @ observed)) * derivatives[chosen]
                    for weight, observed, derivatives in self._recorded(chosen, slopes(parameters))
                ]
            )

        return jacobian

    def score(self, parameters: FloatArray, chosen: IntArray) -> float:
        """FSS of Eqs. 12-14 over the chosen stimuli, weighted where both phases were recorded."""
        return self._score_of(self.model.evaluate(parameters), chosen)

    def score_batch(self, points: FloatArray) -> FloatArray:
        """FSS over all stimuli for rows of parameters, (n_points,), bit-equal to `score`."""
        everything = np.arange(self.n_observations)
        rates = zip(*evaluate_rows(self.model, points), strict=True)
        return np.array([self._score_of(row, everything) for row in rates])

    def _score_of(self, rates: Rates, chosen: IntArray) -> float:
        return sum(
            weight * fractional_sum_of_squares(observed, predicted[chosen])
            for weight, observed, predicted in self._recorded(chosen, rates)
        )

    def score_by_phase(self, parameters: FloatArray, chosen: IntArray) -> dict[str, float]:
        """FSS of each recorded phase, "dynamic" and "static", Eqs. 13 and 14."""
        scores = (
            fractional_sum_of_squares(observed, predicted)
            for _, observed, predicted in self._phases(parameters, chosen)
        )
        return dict(zip(self.recordings.phases, scores, strict=True))

    def _phases(
        self, parameters: FloatArray, chosen: IntArray
    ) -> Iterator[tuple[float, FloatArray, FloatArray]]:
        """Weight, observed and predicted rates of each recorded phase."""
        for weight, observed, predicted in self._recorded(chosen, self.model.evaluate(parameters)):
            yield weight, observed, predicted[chosen]

    def _recorded(self, chosen: IntArray, of_phases: Rates) -> Iterator[tuple[float, FloatArray, FloatArray]]:
        """Weight, observed rates and entry of `of_phases` of each recorded phase."""
        alone = len(self.recordings.phases) == 1
        weights = (self.dynamic_weight, self.static_weight)
        observed = (self.recordings.dynamic_rate_hz, self.recordings.static_rate_hz)
        for weight, rates, given in zip(weights, observed, of_phases, strict=True):
            if rates is not None:
                yield 1.0 if alone else weight, rates[chosen], given


WEIGHT = 2.0
"""Weight of the squared differences of hit rates: 0.05 in each of eight costs as much as 0.04 of FSS."""

CHANCE = 0.5  # Hit rate of an observer of a silent population. [0-1]


@value_class
class RatesAndHitRates:
    """Recorded rates and hit rates of people, to which one afferent is fitted.

    The contract of `fingerpad.inference.fitting.methods.Problem`. All hit rates enter whichever rates are
    chosen, so that a cross validation leaves out rates only.
    """

    rates: RateProblem  # Recorded rates and the model that predicts them.
    hit_rates: Callable[[FloatArray], FloatArray]
    """From the parameters of that model to predicted hit rates (n,). [0-1]"""
    observed: FiniteVector  # Hit rates of people, (n,). [0-1]
    weight: Positive = WEIGHT  # Weight w of the squared differences against FSS.

    @property
    def names(self) -> tuple[str, ...]:
        return self.rates.names

    @property
    def n_observations(self) -> int:
        """Number of stimuli under which rates were recorded."""
        return self.rates.n_observations

    def residuals(self, parameters: FloatArray, chosen: IntArray) -> FloatArray:
        """Residuals of the chosen rates, then those of all hit rates times the root of the weight."""
        missed = self.hit_rates(parameters) - self.observed
        return np.concatenate([self.rates.residuals(parameters, chosen), np.sqrt(self.weight) * missed])

    def score(self, parameters: FloatArray, chosen: IntArray) -> float:
        """FSS of the chosen rates less the weighted sum of the squared differences of hit rates."""
        residuals = self.residuals(parameters, chosen)
        return 1.0 - float(residuals @ residuals)


@dataclass(frozen=True)
class SphereHitRates:
    """Hit rates of two codes, predicted from the parameters of every afferent of a population."""

    model: SkipValidation[RateModel]
    """Rates, a column per receptor, sphere and position, receptors fastest and positions slowest."""
    n_positions: int
    n_receptors: int  # Sizes; the number of spheres, the standard first, follows.
    neighbours: np.ndarray  # Pairs of the Gradient Sum, (n_pairs, 2).
    noise_sigma: float
    standard_normals: FloatArray  # Common random presentations of the Gradient Sum, (n_draws, n_receptors).

    def __post_init__(self) -> None:
        if self.model.n_stimuli % (self.n_positions * self.n_receptors):
            raise InputError(
                "model",
                "must have one column per position, sphere and receptor",
                f"{self.model.n_stimuli} for {self.n_positions} positions and {self.n_receptors} receptors",
            )

    def __call__(self, parameters: FloatArray) -> FloatArray:
        """Hit rates (n,): by position Gradient Sum, then Euclidean Distance, one per comparison. [0-1]"""
        static = self.model.evaluate(parameters)[1].reshape(self.n_positions, -1, self.n_receptors)
        return np.concatenate([self._at(table) for table in static])

    def _at(self, static_hz: FloatArray) -> FloatArray:
        if not static_hz.any():
            return np.full(2 * (len(static_hz) - 1), CHANCE)
        gradient = expected_hit_rates(static_hz, self.neighbours, self.noise_sigma, self.standard_normals)
        return np.concatenate([gradient, expected_euclidean_hit_rates(static_hz, self.noise_sigma)])
