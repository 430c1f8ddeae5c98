"""The problem of fitting a rate model to recorded firing rates: residuals and FSS (paper, Eqs. 12-14)."""

from __future__ import annotations

from collections.abc import Callable, Iterator

import numpy as np
from pydantic import SkipValidation

from fingerpad.core.checked import value_class
from fingerpad.core.errors import InputError
from fingerpad.core.values import FloatArray, IntArray, NotNegative
from fingerpad.data import protocol
from fingerpad.inference.fitting.cross_validation import fractional_sum_of_squares
from fingerpad.inference.rate_model import RateModel, Rates
from fingerpad.inference.recordings import RateRecordings


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
        rates = zip(*self.model.evaluate_batch(points), strict=True)
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
