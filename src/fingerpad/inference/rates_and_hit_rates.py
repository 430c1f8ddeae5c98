"""One problem of two levels: an afferent is fitted to firing rates and to hit rates of people at once.

    score = FSS - w sum (h - h_people)^2

FSS is that of Eqs. 12-14. The hit rates h are those that a population of such afferents predicts, without
free parameters of its own. FSS is flat along some directions, such as a lower intercept with larger gains.
The hit rates choose among parameters that explain the firing rates equally well
(docs/decisions/paper-and-human.md).
"""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass, replace

import numpy as np
from pydantic import SkipValidation

from fingerpad.core.checked import value_class
from fingerpad.core.errors import InputError
from fingerpad.core.values import FiniteVector, FloatArray, IntArray, Positive
from fingerpad.inference.afferent_methods import bounds_of, by_differences, fitted_six, four_number_problem
from fingerpad.inference.fitting.covariance_adaptation import CovarianceAdaptation
from fingerpad.inference.fitting.methods import Continued, Fit, FitStep, Problem
from fingerpad.inference.rate_model import AfferentModel, RateModel
from fingerpad.inference.rate_problem import RateProblem
from fingerpad.psychophysics.noise_fit import expected_euclidean_hit_rates, expected_hit_rates

WEIGHT = 2.0
"""Weight of the squared differences of hit rates: 0.05 in each of eight costs as much as 0.04 of FSS."""

FIRST_SPREAD, MOST_EVALUATIONS = 0.3, 600
"""CMA-ES: standard deviation of the first generation in units of the scales, and most evaluations."""

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


@dataclass(frozen=True)
class ToRatesAndHitRates:
    """Method that fits recorded rates in the paper's six parameters, and hit rates of people with them.

    Least squares finds the four numbers that explain the rates best. From there CMA-ES maximises the score of
    `RatesAndHitRates`. The scores of the result are FSS of the rates alone.
    """

    hit_rates: SphereHitRates  # Predicts hit rates from the paper's six parameters.
    observed: FloatArray  # Hit rates of people, in the same order, (n,). [0-1]
    seed: int = 0  # Of CMA-ES.
    name: str = "rates and hit rates"

    def fit(self, problem: Problem, chosen: IntArray) -> Fit:
        """Fit the chosen rates, and all hit rates."""
        if not (isinstance(problem, RateProblem) and isinstance(problem.model, AfferentModel)):
            raise InputError("problem", "must have the paper's six parameters", str(", ".join(problem.names)))
        model = problem.model
        rates, bounds = four_number_problem(model, problem.recordings), bounds_of(*model.drives)
        both = RatesAndHitRates(rates, lambda numbers: self.hit_rates(fitted_six(numbers)), self.observed)
        method = Continued(
            by_differences(bounds),
            lambda begun: CovarianceAdaptation(begun, bounds, FIRST_SPREAD, MOST_EVALUATIONS, self.seed),
            first_problem=rates,
        )
        found = method.fit(both, chosen)

        def in_six(step: FitStep) -> FitStep:
            return FitStep(fitted_six(step.parameters), rates.score(step.parameters, chosen))

        history = tuple(in_six(step) for step in found.history)
        fit = replace(found, parameters=history[-1].parameters, score=history[-1].score, history=history)
        return replace(fit, attempts=(fit,))
