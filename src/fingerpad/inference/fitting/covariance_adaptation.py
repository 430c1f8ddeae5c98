"""Evolution strategy with covariance matrix adaptation (CMA-ES): it needs no derivatives."""

from __future__ import annotations

import time

import numpy as np
from numpy.typing import ArrayLike

from fingerpad.core.checked import value_class
from fingerpad.core.random_streams import published_generator
from fingerpad.core.values import Count, IntArray, NotNegativeWhole, Positive
from fingerpad.inference.fitting.methods import Bounds, Fit, FitStep, Problem


@value_class
class CovarianceAdaptation:
    """CMA-ES from one start, with the package `cma`.

    Hansen & Ostermeier 2001.
    """

    start: ArrayLike  # Mean of the first generation, (n_parameters,).
    bounds: Bounds  # Limits of the parameters, and the scales that set their units in the search.
    first_spread: Positive = 0.5  # Standard deviation of the first generation, in units of the scales.
    most_evaluations: Count = 2000
    """The search ends with the generation that reaches this number, or when it has converged."""
    seed: NotNegativeWhole = 0  # Seed of the random numbers; the same seed gives the same bits.
    name: str = "CMA-ES"

    def __post_init__(self) -> None:
        object.__setattr__(self, "start", self.bounds.rows("start", np.atleast_2d(self.start))[0])

    def fit(self, problem: Problem, chosen: IntArray) -> Fit:
        """Search until convergence; the result is the best of all evaluated points."""
        from cma import CMAEvolutionStrategy  # takes a second to load

        clock, scales = time.perf_counter(), self.bounds.scales
        generator = published_generator(self.seed)
        search = CMAEvolutionStrategy(
            np.asarray(self.start) / scales,
            self.first_spread,
            {
                "bounds": [list(side / scales) for side in (self.bounds.low, self.bounds.high)],
                "maxfevals": self.most_evaluations,
                # By default cma draws from NumPy's global state.
                "seed": np.nan,
                "randn": lambda *shape: generator.standard_normal(shape),
                "verbose": -9,
            },
        )
        best = FitStep(np.asarray(self.start), problem.score(np.asarray(self.start), chosen))
        steps = [best]
        while not search.stop():
            places = search.ask()
            scores = [problem.score(place * scales, chosen) for place in places]
            search.tell(places, [-score for score in scores])
            top = int(np.argmax(scores))
            if scores[top] > best.score:
                best = FitStep(places[top] * scales, float(scores[top]))
                steps.append(best)
        seconds = time.perf_counter() - clock
        return Fit(best.parameters, best.score, search.countevals + 1, seconds, tuple(steps))
