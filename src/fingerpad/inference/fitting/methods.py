"""Methods of fitting with one interface, the contract of their problems, bounds, and cross validation.

A method has its settings as fields and returns a `Fit`. A cross validation fits five sixths of the
observations and scores the rest (paper, section 2.2.2).
"""

from __future__ import annotations

import time
from collections.abc import Callable
from dataclasses import dataclass, replace
from functools import partial
from typing import Protocol, runtime_checkable

import numpy as np
from numpy.typing import ArrayLike
from scipy.optimize import least_squares
from scipy.stats import qmc

from fingerpad.core.checked import checked
from fingerpad.core.errors import ConvergenceError, InputError
from fingerpad.core.random_streams import published_generator
from fingerpad.core.values import FloatArray, IntArray, Several, finite, float_array
from fingerpad.data import protocol


@dataclass(frozen=True)
class Bounds:
    """Bounds and scales of the parameters of a fit."""

    scales: FloatArray
    """Typical changes of the parameters, the units of the steps of a method, (n_parameters,)."""
    low: FloatArray = -np.inf  # type: ignore[assignment]
    high: FloatArray = np.inf  # type: ignore[assignment]
    """Limits; -inf and inf for none, (n_parameters,)."""

    def __post_init__(self) -> None:
        sides = np.broadcast_arrays(self.scales, self.low, self.high)
        for name, side in zip(("scales", "low", "high"), sides, strict=True):
            object.__setattr__(self, name, side)

    def and_one(self, scale: float, low: float, high: float) -> Bounds:
        further = ((self.scales, scale), (self.low, low), (self.high, high))
        return Bounds(*(np.append(side, entry) for side, entry in further))

    def spread(self, number: int) -> FloatArray:
        """Points of a Halton sequence between the bounds, (number, n_parameters); deterministic."""
        return self.low + halton(number, self.scales.size) * (self.high - self.low)


def halton(number: int, dimensions: int) -> FloatArray:
    """Return points of a Halton sequence in the unit cube, (number, dimensions); deterministic."""
    points: FloatArray = qmc.Halton(dimensions, scramble=False).random(number + 1)
    return points[1:]  # the first is a corner


@runtime_checkable
class Problem(Protocol):
    """A model and the observations to which it is fitted.

    `score = 1 - residuals @ residuals` up to round-off, so a method may maximise the score or minimise the
    residuals.
    """

    @property
    def n_observations(self) -> int:
        """Number of observed stimuli; `chosen` are their numbers from 0."""

    def residuals(self, parameters: FloatArray, chosen: IntArray) -> FloatArray:
        """Scaled differences between observations and predictions under the chosen stimuli."""

    def score(self, parameters: FloatArray, chosen: IntArray) -> float:
        """Goodness of fit over the chosen stimuli, 1 if it is perfect; larger is better."""


@dataclass(frozen=True)
class FitStep:
    """One step of a fit."""

    parameters: FloatArray
    score: float  #: Score of the chosen observations.


@dataclass(frozen=True)
class Fit:
    """Result of a method: parameters, score, effort and history."""

    parameters: FloatArray
    score: float  #: Their score over the chosen observations.
    n_evaluations: int  #: Evaluations of the model, over all starts.
    seconds: float  #: Elapsed time, over all starts. [s]
    history: tuple[FitStep, ...]  #: Steps of the best fit; the first is its start, the last the result.
    start: int = 0  #: Number of its start, from 0; the first one of equals.
    attempts: tuple[Fit, ...] = ()
    """The fit from each start, in their order; empty for a method with one start."""


@runtime_checkable
class Method(Protocol):
    """Contract of a method that fits any problem."""

    @property
    def name(self) -> str: ...

    def fit(self, problem: Problem, chosen: IntArray) -> Fit:
        """Fit the chosen observations of a problem."""


def best_of(attempts: tuple[Fit, ...]) -> Fit:
    """Return the fit with the highest score, with the effort of all fits; the first one of equals."""
    start = int(np.argmax([attempt.score for attempt in attempts]))
    effort = sum(attempt.n_evaluations for attempt in attempts), sum(attempt.seconds for attempt in attempts)
    best = attempts[start]
    return Fit(best.parameters, best.score, *effort, best.history, start, attempts)


@dataclass(frozen=True)
class Continued:
    """Two methods in sequence: a cheap one for the start of the second."""

    first: Method  #: Finds the start of the second.
    second: Callable[[FloatArray], Method]  #: `second(parameters)`: the method that starts there.
    first_problem: Problem | None = None
    """Problem of the first method, if it is a simpler one with the same observations."""
    name: str = "continued"

    def fit(self, problem: Problem, chosen: IntArray) -> Fit:
        """Fit with the first method, then with the second from its result; the effort is that of both."""
        begun = self.first.fit(problem if self.first_problem is None else self.first_problem, chosen)
        ended = self.second(begun.parameters).fit(problem, chosen)
        return replace(
            ended,
            n_evaluations=begun.n_evaluations + ended.n_evaluations,
            seconds=begun.seconds + ended.seconds,
        )


Jacobian = Callable[[FloatArray, IntArray], FloatArray]


@dataclass(frozen=True)
class LeastSquares:
    """Trust-region least squares from the most promising of several starts.

    The method of `scipy.optimize.least_squares`, "trf" (Branch, Coleman & Li 1999); the result is the best of
    all evaluated points. The method is deterministic.
    """

    starts: ArrayLike  #: Start points; all are scored, (n_starts, n_parameters).
    bounds: Bounds  #: Limits of the parameters, and the scales in which steps are taken.
    n_refined: int = 4  #: Number of starts, the best ones, from which a fit is made.
    difference_steps: tuple[float, ...] = (0.1, 0.03, 0.01)
    """Half widths of the central differences, round by round, in units of the scales."""
    jacobian: Jacobian | None = None
    """`jacobian(parameters, chosen)`: derivatives of the residuals, instead of differences."""
    most_iterations: int = 50  #: Iterations of each round.
    name: str = "least squares"

    def fit(self, problem: Problem, chosen: IntArray) -> Fit:
        """Score all starts, fit from the best of them, and keep the best fit."""
        clock, starts = time.perf_counter(), np.asarray(self.starts, dtype=np.float64)
        scores = np.array([problem.score(start, chosen) for start in starts])
        scored = Fit(starts[0], -np.inf, len(starts), time.perf_counter() - clock, ())
        order = np.argsort(-scores, kind="stable")[: self.n_refined]
        return best_of((*(self._refined(problem, chosen, starts[row]) for row in order), scored))

    def _refined(self, problem: Problem, chosen: IntArray, start: FloatArray) -> Fit:
        clock, scales = time.perf_counter(), self.bounds.scales
        low, high = self.bounds.low / scales, self.bounds.high / scales
        best, n_evaluations = FitStep(np.full(scales.size, np.nan), -np.inf), 0

        def residuals(place: FloatArray) -> FloatArray:
            nonlocal best, n_evaluations
            parameters = place * scales
            found = problem.residuals(parameters, chosen)
            n_evaluations += 1
            score = 1.0 - float(found @ found)
            if score > best.score:
                best = FitStep(parameters, score)
            return found

        def slopes(place: FloatArray, difference: float) -> FloatArray:
            if self.jacobian is not None:
                return self.jacobian(place * scales, chosen) * scales
            before, after = np.maximum(place - difference, low), np.minimum(place + difference, high)
            columns = []
            for number in range(place.size):
                ends = [place.copy(), place.copy()]
                ends[0][number], ends[1][number] = before[number], after[number]
                columns.append((residuals(ends[1]) - residuals(ends[0])) / (after[number] - before[number]))
            return np.column_stack(columns)

        residuals(start / scales)
        steps = [best]
        for difference in self.difference_steps if self.jacobian is None else self.difference_steps[:1]:
            begun = np.clip(best.parameters / scales, low, high)  # round-off at a bound
            derivatives = partial(slopes, difference=difference)
            least_squares(residuals, begun, derivatives, bounds=(low, high), max_nfev=self.most_iterations)
            steps.append(best)
        seconds = time.perf_counter() - clock
        return Fit(best.parameters, best.score, n_evaluations, seconds, tuple(steps))


FIRST_SPREAD = 0.5  # Standard deviation of the first generation of CMA-ES, in units of the scales.


@dataclass(frozen=True)
class CovarianceAdaptation:
    """CMA-ES from one start, with the package `cma`.

    Hansen & Ostermeier 2001.
    """

    start: ArrayLike  #: Mean of the first generation, (n_parameters,).
    bounds: Bounds  #: Limits of the parameters, and the scales that set their units in the search.
    most_evaluations: int = 2000
    """The search ends with the generation that reaches this number, or when it has converged."""
    seed: int = 0  #: Seed of the random numbers; the same seed gives the same bits.
    name: str = "CMA-ES"

    def fit(self, problem: Problem, chosen: IntArray) -> Fit:
        """Search until convergence; the result is the best of all evaluated points."""
        from cma import CMAEvolutionStrategy  # takes a second to load

        clock, scales = time.perf_counter(), self.bounds.scales
        generator = published_generator(self.seed)
        search = CMAEvolutionStrategy(
            np.asarray(self.start) / scales,
            FIRST_SPREAD,
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


Objective = Callable[[FloatArray], float]
Restriction = Callable[[FloatArray], FloatArray]

_MOST_STEPS = 200  # Of one ascent.


def factorial_design(n_parameters: int) -> FloatArray:
    """Two-level full factorial design with centre point, in coded units."""
    corners = np.indices((2,) * n_parameters).reshape(n_parameters, -1).T * 2.0 - 1.0
    return np.vstack([corners, np.zeros(n_parameters)])


def regression_slopes(design: FloatArray, values: FloatArray) -> FloatArray:
    """Slopes of the least-squares plane through the runs of a factorial design.

    The columns of the design are orthogonal to each other and to the constant, so each slope is a projection.
    """
    return (design.T @ values) / (design**2).sum(axis=0)


@dataclass(frozen=True)
class ResponseSurface:
    """The paper's method: response surfaces and steepest ascent from each start; the best result is taken.

    Gerling et al. 2014, section 2.2.2; Box & Wilson 1951 for the method. Steps along the ascent are one coded
    unit at first, double after each gain and halve after each loss; the ascent ends when a step of one unit
    has no gain. The method is deterministic.
    """

    starts: ArrayLike  #: Start points, (n_starts, n_parameters).
    increments: ArrayLike
    """One coded unit of each parameter, for all start points or for each, (n_parameters,)."""
    lower_bounds: ArrayLike = -np.inf  #: Lower limits of all evaluations; -inf for none, (n_parameters,).
    smallest_gain: float = 1.0e-4  #: A gain of at most this much ends a fit.
    most_iterations: int = 200
    name: str = "response surface"
    restrict: Restriction | None = None  #: From a point of an ascent to the nearest one that is allowed.

    def fit(self, problem: Problem, chosen: IntArray) -> Fit:
        """Fit from every start."""

        def score(parameters: FloatArray) -> float:
            return finite(f"score at {parameters.tolist()}", problem.score(parameters, chosen))

        starts = np.asarray(self.starts, dtype=np.float64)
        units, floors = (np.broadcast_to(side, starts.shape) for side in (self.increments, self.lower_bounds))
        rows = zip(starts, units, floors + units, strict=True)
        return best_of(tuple(self._climb(score, *row) for row in rows))

    def _climb(self, score: Objective, start: FloatArray, units: FloatArray, floor: FloatArray) -> Fit:
        """Climb from one start; the corners of no design lie below the floor less one unit."""

        def allowed(point: FloatArray) -> FloatArray:
            above = np.maximum(point, floor)
            return above if self.restrict is None else self.restrict(above)

        clock, design, base = time.perf_counter(), factorial_design(start.size), start
        history: list[FitStep] = []
        n_evaluations = 0
        for _ in range(self.most_iterations):
            values = np.array([score(base + coded * units) for coded in design])
            at_base = float(values[-1])
            if not history:
                history.append(FitStep(base, at_base))
            slopes = regression_slopes(design, values)
            direction = slopes / (float(np.linalg.norm(slopes)) or 1.0) * units
            best, highest, n_trials = _ascend(score, base, at_base, direction, allowed)
            n_evaluations += len(design) + n_trials
            if highest - at_base <= self.smallest_gain:
                return Fit(base, at_base, n_evaluations, time.perf_counter() - clock, tuple(history))
            base = best
            base.setflags(write=False)
            history.append(FitStep(base, highest))
        raise ConvergenceError(
            f"The {self.name} has not converged after {self.most_iterations} iterations: give more, "
            f"most_iterations={10 * self.most_iterations}, or larger increments=.",
            tuple(f"iteration {number}: {step.score:.6g}" for number, step in enumerate(history)),
        )


def _ascend(
    score: Objective, base: FloatArray, at_base: float, direction: FloatArray, allowed: Restriction
) -> tuple[FloatArray, float, int]:
    """Best point on the path of steepest ascent, its score, and the steps that were tried."""
    best, highest, step = base, at_base, 1.0
    if not direction.any():
        return best, highest, 0
    for n_trials in range(1, _MOST_STEPS + 1):
        trial = allowed(best + step * direction)
        value = score(trial)
        if value > highest:
            best, highest = trial, value
            step *= 2.0
        elif step > 1.0:
            step /= 2.0
        else:
            return best, highest, n_trials
    raise ConvergenceError(
        f"The ascent has not ended after {_MOST_STEPS} steps: the objective must have a maximum.",
        (f"last point {best.tolist()}: {highest:.6g}",),
    )


def fractional_sum_of_squares(observed: ArrayLike, predicted: ArrayLike) -> float:
    """Fractional sum of squares, FSS (Eqs. 13, 14).

    FSS = 1 - sum (observed - predicted)^2 / sum observed^2. It is 1 for a perfect prediction, 0 for predicted
    rates of 0, and has no lower limit. R2 differs: it refers to the mean of the observations instead of 0.
    """
    observed_rate = float_array("observed", observed, 1)
    predicted_rate = float_array("predicted", predicted, 1)
    if observed_rate.shape != predicted_rate.shape:
        raise InputError(
            f"observed and predicted must match: got {observed_rate.size} and {predicted_rate.size} values."
        )
    observed_squares = float(observed_rate @ observed_rate)
    if observed_squares == 0.0:
        raise InputError(
            "observed", "must hold at least one value other than 0", remedy="FSS divides by its squares"
        )
    residual = observed_rate - predicted_rate
    return 1.0 - float(residual @ residual) / observed_squares


@dataclass(frozen=True)
class FoldFit:
    """Result of one fold."""

    fold: int
    fit: Fit
    score_test: float  #: Score of its parameters on the observations left out.
    training: IntArray
    testing: IntArray  #: Observations used for fitting, and those left out, (n_training,).


@dataclass(frozen=True)
class CrossValidation:
    """Results of all folds."""

    folds: tuple[FoldFit, ...]  #: In the order of their numbers.

    @property
    def score_train(self) -> float:
        """Mean training score of the folds."""
        return float(np.mean([fold.fit.score for fold in self.folds]))

    @property
    def score_test(self) -> float:
        """Mean testing score of the folds, the estimate of performance out of sample."""
        return float(np.mean([fold.score_test for fold in self.folds]))


@checked
def interleaved_folds(n_observations: Several, n_folds: Several | None = None) -> IntArray:
    """Assign observations to folds in turn; by default to six, or one each where there are fewer."""
    folds = min(int(protocol.FOLDS.value), n_observations) if n_folds is None else n_folds
    if folds > n_observations:
        raise InputError("n_folds", f"must be at most the number of stimuli, {n_observations}", str(folds))
    return np.arange(n_observations, dtype=np.int64) % folds


def cross_validate(problem: Problem, method: Method, memberships: ArrayLike) -> CrossValidation:
    """Fit without the observations of each fold, and score the result on them.

    Gerling et al. 2014, section 2.2.2.
    """
    folds = _checked_memberships(memberships, problem.n_observations)

    def fold_fit(fold: int) -> FoldFit:
        training, testing = np.flatnonzero(folds != fold), np.flatnonzero(folds == fold)
        fit = method.fit(problem, training)
        return FoldFit(fold, fit, float(problem.score(fit.parameters, testing)), training, testing)

    return CrossValidation(tuple(fold_fit(fold) for fold in range(int(folds.max()) + 1)))


def _checked_memberships(memberships: ArrayLike, n_observations: int) -> IntArray:
    given = float_array("memberships", memberships, 1)
    if given.size != n_observations:
        raise InputError(
            "memberships", "needs one fold per observation", f"{given.size} for {n_observations}"
        )
    folds = given.astype(np.int64)
    present = np.unique(folds)
    if (folds != given).any() or present.size < 2 or not np.array_equal(present, np.arange(present.size)):
        wanted = "must number at least two folds from 0 on without a gap"
        raise InputError("memberships", wanted, str(np.unique(given).tolist()))
    return folds


def jackknife_covariance(estimates: ArrayLike) -> FloatArray | None:
    """Covariance of fitted parameters from fits that each leave out one of g groups of observations.

    With the estimate theta_j without group j and the mean of all of them,

        V = (g - 1)/g sum over j of (theta_j - mean)(theta_j - mean)'.

    It uses no derivatives: rates jump where a spike enters its window, and a fit may end in any of many local
    maxima. A covariance from derivatives at the best fit neglects both and is too small
    (docs/decisions.md#jackknife).

    R. G. Miller, Biometrika 61 (1974) 1, the delete-a-group jackknife.
    """
    rows = float_array("estimates", estimates, 2)
    groups, parameters = rows.shape
    if groups <= parameters:
        return None
    apart = rows - rows.mean(axis=0)
    return (groups - 1) / groups * apart.T @ apart
