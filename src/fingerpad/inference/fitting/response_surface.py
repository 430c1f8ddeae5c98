"""Response surface method: maximise any function of a few parameters (paper, section 2.2.2).

An iteration evaluates the 2^k corners of a factorial design, one coding increment from the base, and the base
itself; it fits a plane to the values by linear regression and follows the steepest ascent of the plane while
the objective rises. The next iteration starts from the best point. The method stops at the first iteration
without gain.
"""

from __future__ import annotations

import time
from collections.abc import Callable
from dataclasses import dataclass

import numpy as np
from numpy.typing import ArrayLike

from fingerpad.core.checked import checked
from fingerpad.core.errors import ConvergenceError, InputError
from fingerpad.core.values import Count, Finite, FloatArray, IntArray, NotNegative, finite, float_array
from fingerpad.inference.fitting.methods import Fit, FitStep, Problem, best_of

Objective = Callable[[FloatArray], float]
Restriction = Callable[[FloatArray], FloatArray]

_MOST_PARAMETERS = 12
_MOST_STEPS = 200


@checked
def factorial_design(n_parameters: Count) -> FloatArray:
    """Two-level full factorial design with centre point, in coded units."""
    if n_parameters > _MOST_PARAMETERS:
        raise InputError(
            "n_parameters", f"must be at most {_MOST_PARAMETERS}", f"{n_parameters}, too many corners"
        )
    corners = np.indices((2,) * n_parameters).reshape(n_parameters, -1).T * 2.0 - 1.0
    return np.vstack([corners, np.zeros(n_parameters)])


def regression_slopes(design: FloatArray, values: FloatArray) -> FloatArray:
    """Slopes of the least-squares plane through the runs of a factorial design.

    The columns of the design are orthogonal to each other and to the constant, so each slope is a projection.
    """
    return (design.T @ values) / (design**2).sum(axis=0)


@checked
def coding_increments(base: ArrayLike, share: Finite, where_zero: ArrayLike | None = None) -> FloatArray:
    """Increments as a share of the base; a parameter whose base is zero needs an increment of its own."""
    start = float_array("base", base, 1)
    increments = share * np.abs(start)
    if where_zero is not None:
        increments = np.where(start == 0.0, float_array("where_zero", where_zero, 1), increments)
    return _checked_increments(increments, start)


@checked
def maximise(
    objective: Objective,
    start: ArrayLike,
    increments: ArrayLike,
    lower_bounds: ArrayLike | None = None,
    smallest_gain: NotNegative = 1.0e-4,
    most_iterations: Count = 200,
    restrict: Restriction | None = None,
) -> Fit:
    """Maximise `objective` from `start` by the response surface method.

    Gerling et al. 2014, section 2.2.2; Box & Wilson 1951 for the method. Steps along the ascent are one coded
    unit at first, double after each gain and halve after each loss; the ascent ends when a step of one unit
    has no gain.
    """
    base = float_array("start", start, 1)
    units = _checked_increments(increments, base)
    floor = _floor(lower_bounds, base, units)

    def allowed(point: FloatArray) -> FloatArray:
        above = np.maximum(point, floor)
        return above if restrict is None else restrict(above)

    clock, design = time.perf_counter(), factorial_design(base.size)
    history: list[FitStep] = []
    n_evaluations = 0
    for _ in range(most_iterations):
        values = np.array([_value(objective, base + coded * units) for coded in design])
        at_base = float(values[-1])
        if not history:
            history.append(FitStep(base, at_base))
        best, highest, n_trials = _ascend(
            objective, base, at_base, regression_slopes(design, values), units, allowed
        )
        n_evaluations += len(design) + n_trials
        if highest - at_base <= smallest_gain:
            return Fit(base, at_base, n_evaluations, time.perf_counter() - clock, tuple(history))
        base = best
        base.setflags(write=False)
        history.append(FitStep(base, highest))
    raise ConvergenceError(
        f"maximise has not converged after {most_iterations} iterations: give more, "
        f"most_iterations={10 * most_iterations}, or larger increments=.",
        tuple(f"iteration {number}: {step.score:.6g}" for number, step in enumerate(history)),
    )


@dataclass(frozen=True)
class ResponseSurface:
    """The paper's method: response surfaces and steepest ascent from each start; the best result is taken.

    Gerling et al. 2014, section 2.2.2; see `maximise`. The method is deterministic.
    """

    starts: ArrayLike  # Start points, (n_starts, n_parameters).
    increments: ArrayLike
    """One coded unit of each parameter, for all start points or for each, (n_parameters,)."""
    lower_bounds: ArrayLike | None = None  # Lower limits of all evaluations; -inf for none, (n_parameters,).
    smallest_gain: float = 1.0e-4  # A gain of at most this much ends a fit.
    most_iterations: int = 200  # Largest number of iterations.
    name: str = "response surface"
    restrict: Restriction | None = None  # As of `maximise`.

    def __post_init__(self) -> None:
        starts = float_array("starts", self.starts, 2)
        units = np.array(self.increments, dtype=np.float64)
        if units.shape not in (starts.shape, starts.shape[1:]):
            raise InputError(
                "increments", f"must match starts {starts.shape} or one row of it", str(units.shape)
            )
        object.__setattr__(self, "starts", starts)
        object.__setattr__(self, "increments", np.broadcast_to(units, starts.shape))

    def fit(self, problem: Problem, chosen: IntArray) -> Fit:
        """Fit from every start."""

        def score(parameters: FloatArray) -> float:
            return problem.score(parameters, chosen)

        limits = (self.lower_bounds, self.smallest_gain, self.most_iterations, self.restrict)
        pairs = zip(np.asarray(self.starts), np.asarray(self.increments), strict=True)
        return best_of(tuple(maximise(score, start, units, *limits) for start, units in pairs))


def _ascend(
    objective: Objective,
    base: FloatArray,
    value_at_base: float,
    slopes: FloatArray,
    units: FloatArray,
    allowed: Restriction,
) -> tuple[FloatArray, float, int]:
    """Best point on the path of steepest ascent, its value, and the steps that were tried."""
    best, best_value = base, value_at_base
    steepness = float(np.linalg.norm(slopes))
    if steepness == 0.0:
        return best, best_value, 0
    direction = slopes / steepness * units
    step = 1.0
    for n_trials in range(1, _MOST_STEPS + 1):
        trial = allowed(best + step * direction)
        value = _value(objective, trial)
        if value > best_value:
            best, best_value = trial, value
            step *= 2.0
        elif step > 1.0:
            step /= 2.0
        else:
            return best, best_value, n_trials
    raise ConvergenceError(
        f"The ascent has not ended after {_MOST_STEPS} steps: the objective must have a maximum.",
        (f"last point {best.tolist()}: {best_value:.6g}",),
    )


def _value(objective: Objective, parameters: FloatArray) -> float:
    return finite(f"objective at {parameters.tolist()}", objective(parameters))


def _checked_increments(increments: ArrayLike, base: FloatArray) -> FloatArray:
    units = float_array("increments", increments, 1)
    if units.shape != base.shape:
        raise InputError("increments", "needs one entry per parameter", f"{units.size} for {base.size}")
    if (units <= 0.0).any():
        raise InputError("increments", "must be greater than 0", str(units.tolist()))
    return units


def _floor(lower_bounds: ArrayLike | None, base: FloatArray, units: FloatArray) -> FloatArray:
    """Lowest base whose corners all lie within the bounds."""
    if lower_bounds is None:
        return np.full(base.size, -np.inf)
    bounds = np.array(lower_bounds, dtype=np.float64)
    if bounds.shape != base.shape or np.isnan(bounds).any():
        raise InputError("lower_bounds", "needs one number or -inf per parameter", repr(lower_bounds))
    floor = bounds + units
    if (base < floor).any():
        raise InputError(
            "start",
            "must lie at least one increment above lower_bounds",
            f"{base.tolist()} for {bounds.tolist()}",
        )
    return floor
