"""Least squares from several starts, for residuals that jump where a spike enters or leaves a window.

A difference quotient over a tiny step contains either no jump or only a jump. The steps are therefore as
large as typical changes of the parameters and shrink from round to round. Alternatively a smooth model gives
the derivatives. They only set the search direction: every point is judged by its own score.
"""

from __future__ import annotations

import time
from collections.abc import Callable

import numpy as np
from numpy.typing import ArrayLike
from scipy.optimize import least_squares

from fingerpad.core.checked import value_class
from fingerpad.core.errors import InputError
from fingerpad.core.values import Count, FloatArray, IntArray, Numbers, positive
from fingerpad.inference.fitting.methods import Bounds, Fit, FitStep, Problem, best_of

Jacobian = Callable[[FloatArray, IntArray], FloatArray]


@value_class
class LeastSquares:
    """Trust-region least squares from the most promising of several starts.

    The method of `scipy.optimize.least_squares`, "trf" (Branch, Coleman & Li 1999); the result is the best of
    all evaluated points. The method is deterministic.
    """

    starts: ArrayLike  # Start points; all are scored, (n_starts, n_parameters).
    bounds: Bounds  # Limits of the parameters, and the scales in which steps are taken.
    n_refined: Count = 4  # Number of starts, the best ones, from which a fit is made.
    difference_steps: Numbers = (0.1, 0.03, 0.01)
    """Half widths of the central differences, round by round, in units of the scales."""
    jacobian: Jacobian | None = None
    """`jacobian(parameters, chosen)`: derivatives of the residuals, instead of differences."""
    most_iterations: Count = 50  # Iterations of each round.
    name: str = "least squares"

    def __post_init__(self) -> None:
        starts = self.bounds.rows("starts", self.starts)
        outside = np.flatnonzero(((starts < self.bounds.low) | (starts > self.bounds.high)).any(axis=1))
        if outside.size:
            row = int(outside[0])
            raise InputError(
                "starts", "must lie between the bounds", remedy=f"row {row} is {starts[row].tolist()}"
            )
        object.__setattr__(self, "starts", starts)
        for step in self.difference_steps:
            positive("difference_steps", step)

    def fit(self, problem: Problem, chosen: IntArray) -> Fit:
        """Score all starts, fit from the best of them, and keep the best fit."""
        clock, starts = time.perf_counter(), np.asarray(self.starts)
        scores = np.array([problem.score(start, chosen) for start in starts])
        scored = Fit(starts[0], -np.inf, len(starts), time.perf_counter() - clock, ())
        order = np.argsort(-scores, kind="stable")[: self.n_refined]
        return best_of((*(self._refined(problem, chosen, starts[row]) for row in order), scored))

    def _refined(self, problem: Problem, chosen: IntArray, start: FloatArray) -> Fit:
        clock, scales = time.perf_counter(), self.bounds.scales
        low, high = self.bounds.low / scales, self.bounds.high / scales
        visited = _Visited(problem, chosen, scales)
        visited.residuals(start / scales)
        steps = [visited.best]
        for difference in self.difference_steps if self.jacobian is None else self.difference_steps[:1]:
            least_squares(
                visited.residuals,
                np.clip(visited.best.parameters / scales, low, high),  # round-off at a bound
                self._slopes(visited, difference),
                bounds=(low, high),
                max_nfev=self.most_iterations,
            )
            steps.append(visited.best)
        seconds = time.perf_counter() - clock
        return Fit(steps[-1].parameters, steps[-1].score, visited.n_evaluations, seconds, tuple(steps))

    def _slopes(self, visited: _Visited, difference: float) -> Callable[[FloatArray], FloatArray]:
        """Return the derivatives of the residuals as a function of a point, in units of the scales."""
        scales = self.bounds.scales
        if self.jacobian is not None:
            jacobian = self.jacobian
            return lambda place: jacobian(place * scales, visited.chosen) * scales
        low, high = self.bounds.low / scales, self.bounds.high / scales

        def central(place: FloatArray) -> FloatArray:
            before = np.maximum(place - difference, low)
            after = np.minimum(place + difference, high)
            columns = []
            for number in range(place.size):
                ends = [place.copy(), place.copy()]
                ends[0][number], ends[1][number] = before[number], after[number]
                rise = visited.residuals(ends[1]) - visited.residuals(ends[0])
                columns.append(rise / (after[number] - before[number]))
            return np.column_stack(columns)

        return central


class _Visited:
    """Residuals of a problem in scaled parameters, with a count and the best point so far."""

    def __init__(self, problem: Problem, chosen: IntArray, scales: FloatArray):
        self.problem, self.chosen, self.scales = problem, chosen, scales
        self.n_evaluations = 0
        self.best = FitStep(np.full(scales.size, np.nan), -np.inf)

    def residuals(self, place: FloatArray) -> FloatArray:
        parameters = place * self.scales
        residuals = self.problem.residuals(parameters, self.chosen)
        self.n_evaluations += 1
        score = 1.0 - float(residuals @ residuals)
        if score > self.best.score:
            self.best = FitStep(parameters, score)
        return residuals
