"""Response surface method: maximise any function of a few parameters (paper, section 2.2.2).

An iteration evaluates the 2^k corners of a factorial design, one coding increment from the base, and the base
itself; it fits a plane to the values by linear regression and follows the steepest ascent of the plane while
the objective rises. The next iteration starts from the best point. The method stops at the first iteration
without gain.
"""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass

import numpy as np
from numpy.typing import ArrayLike

from fingerpad.core.checks import FloatArray, finite, float_array, not_negative, whole
from fingerpad.core.errors import ConvergenceError, InputError

Objective = Callable[[FloatArray], float]

_MOST_PARAMETERS = 12
_MOST_STEPS = 200


@dataclass(frozen=True)
class Iteration:
    """One iteration of the response surface method.

    Parameters
    ----------
    parameters : array (n_parameters,)
        Parameters at the end of the iteration.
    objective : float
        Value of the objective there.
    slopes : array (n_parameters,)
        Regression coefficients at the base, gain per coding increment; zeros in the row of the start, which
        precedes any regression.
    n_steps : int
        Steps of the ascent with a gain.
    n_runs : int
        Evaluations of the objective at corners, base and steps; 0 in the row of the start.
    """

    parameters: FloatArray
    objective: float
    slopes: FloatArray
    n_steps: int
    n_runs: int


@dataclass(frozen=True)
class ResponseSurfaceFit:
    """Result of the response surface method.

    Parameters
    ----------
    parameters : array (n_parameters,)
        The best parameters.
    objective : float
        Value of the objective there.
    history : tuple of Iteration
        The start, then one row per iteration with a gain; the last row is the result.
    n_runs : int
        Evaluations of the objective, including the last iteration without gain.
    """

    parameters: FloatArray
    objective: float
    history: tuple[Iteration, ...]
    n_runs: int


def factorial_design(n_parameters: int) -> FloatArray:
    """Two-level full factorial design with centre point, in coded units.

    Parameters
    ----------
    n_parameters : int
        k, at most 12.

    Returns
    -------
    array (2**k + 1, k)
        Every combination of -1 and 1, then the centre.

    Examples
    --------
    >>> factorial_design(2).astype(int).tolist()
    [[-1, -1], [-1, 1], [1, -1], [1, 1], [0, 0]]
    >>> len(factorial_design(6))
    65
    """
    whole("n_parameters", n_parameters, at_least=1)
    if n_parameters > _MOST_PARAMETERS:
        raise InputError(
            f"n_parameters must be at most {_MOST_PARAMETERS}: got {n_parameters}, too many corners."
        )
    corners = np.indices((2,) * n_parameters).reshape(n_parameters, -1).T * 2.0 - 1.0
    return np.vstack([corners, np.zeros(n_parameters)])


def regression_slopes(design: FloatArray, values: FloatArray) -> FloatArray:
    """Slopes of the least-squares plane through the runs of a factorial design.

    The columns of the design are orthogonal to each other and to the constant, so each slope is a projection.

    Parameters
    ----------
    design : array (n_runs, n_parameters)
        Coded units, from `factorial_design`.
    values : array (n_runs,)
        Objective of each run.

    Returns
    -------
    array (n_parameters,)
        Change of the objective per coded unit.

    Examples
    --------
    >>> design = factorial_design(2)
    >>> regression_slopes(design, 5.0 + design @ [2.0, -3.0]).tolist()
    [2.0, -3.0]
    """
    return (design.T @ values) / (design**2).sum(axis=0)


def coding_increments(base: ArrayLike, share: float, where_zero: ArrayLike | None = None) -> FloatArray:
    """Increments as a share of the base; a parameter whose base is zero needs an increment of its own.

    Parameters
    ----------
    base : array (n_parameters,)
        Parameters at the start.
    share : float
        Increment over base; the paper's are about 0.01. [1]
    where_zero : array (n_parameters,), optional
        Increments for the parameters whose base is zero; the other entries are not used.

    Returns
    -------
    array (n_parameters,)

    Raises
    ------
    InputError
        If an increment is not positive.

    Examples
    --------
    >>> coding_increments([0.0, 68.0], 0.01, where_zero=[1e-8, 0.0]).tolist()
    [1e-08, 0.68]
    """
    start = float_array("base", base, 1)
    increments = finite("share", share) * np.abs(start)
    if where_zero is not None:
        increments = np.where(start == 0.0, float_array("where_zero", where_zero, 1), increments)
    return _checked_increments(increments, start)


def maximise(
    objective: Objective,
    start: ArrayLike,
    increments: ArrayLike,
    lower_bounds: ArrayLike | None = None,
    smallest_gain: float = 1.0e-4,
    most_iterations: int = 200,
) -> ResponseSurfaceFit:
    """Maximise `objective` from `start` by the response surface method.

    Parameters
    ----------
    objective : callable
        Value of one vector of parameters; larger is better.
    start : array (n_parameters,)
        Start point.
    increments : array (n_parameters,)
        One coded unit of each parameter: small compared with the parameter, but large enough to average over
        the jumps that single spikes cause in the objective. They are constant during the fit.
    lower_bounds : array (n_parameters,), optional
        Lower limits of all evaluations; the base stays one increment above them. Use -inf for none.
    smallest_gain : float
        An iteration with a gain of at most this much is rejected and ends the fit.
    most_iterations : int
        Largest number of iterations.

    Returns
    -------
    ResponseSurfaceFit

    Raises
    ------
    InputError
        If shapes disagree, the start lies within an increment of a bound, or the objective is not finite.
    ConvergenceError
        If the objective still rises after `most_iterations`, or an ascent does not end.

    Notes
    -----
    Gerling et al. 2014, section 2.2.2; Box & Wilson 1951 for the method. Steps along the ascent are one coded
    unit at first, double after each gain and halve after each loss; the ascent ends when a step of one unit
    has no gain.

    Examples
    --------
    >>> fit = maximise(lambda p: -((p[0] - 3.0) ** 2) - (p[1] + 1.0) ** 2, [0.0, 0.0], [0.01, 0.01])
    >>> abs(fit.parameters - [3.0, -1.0]).max() < 0.01
    np.True_
    """
    base = float_array("start", start, 1)
    units = _checked_increments(increments, base)
    floor = _floor(lower_bounds, base, units)
    not_negative("smallest_gain", smallest_gain)
    whole("most_iterations", most_iterations, at_least=1)
    design = factorial_design(base.size)
    history: list[Iteration] = []
    n_runs = 0
    for _ in range(most_iterations):
        iteration, value_at_base = _iterate(objective, design, base, units, floor)
        n_runs += iteration.n_runs
        if not history:
            history.append(
                Iteration(base, value_at_base, _read_only(np.zeros(base.size)), n_steps=0, n_runs=0)
            )
        if iteration.objective - value_at_base <= smallest_gain:
            return ResponseSurfaceFit(base, value_at_base, tuple(history), n_runs)
        history.append(iteration)
        base = iteration.parameters
    raise ConvergenceError(
        f"maximise has not converged after {most_iterations} iterations: allow more or larger increments.",
        tuple(f"iteration {number}: {row.objective:.6g}" for number, row in enumerate(history)),
    )


def _iterate(
    objective: Objective, design: FloatArray, base: FloatArray, units: FloatArray, floor: FloatArray
) -> tuple[Iteration, float]:
    """One iteration: factorial runs, regression and steepest ascent; also return the value at the base."""
    values = np.array([_value(objective, base + coded * units) for coded in design])
    slopes = regression_slopes(design, values)
    best, best_value, n_gains, n_trials = _ascend(objective, base, values[-1], slopes, units, floor)
    iteration = Iteration(_read_only(best), best_value, _read_only(slopes), n_gains, len(design) + n_trials)
    return iteration, float(values[-1])


def _ascend(
    objective: Objective,
    base: FloatArray,
    value_at_base: float,
    slopes: FloatArray,
    units: FloatArray,
    floor: FloatArray,
) -> tuple[FloatArray, float, int, int]:
    """Best point on the path of steepest ascent, its value, the steps with a gain and all steps."""
    best, best_value = base, float(value_at_base)
    steepness = float(np.linalg.norm(slopes))
    if steepness == 0.0:
        return best, best_value, 0, 0
    direction = slopes / steepness * units
    step, n_gains = 1.0, 0
    for n_trials in range(1, _MOST_STEPS + 1):
        trial = np.maximum(best + step * direction, floor)
        value = _value(objective, trial)
        if value > best_value:
            best, best_value, n_gains = trial, value, n_gains + 1
            step *= 2.0
        elif step > 1.0:
            step /= 2.0
        else:
            return best, best_value, n_gains, n_trials
    raise ConvergenceError(
        f"The ascent has not ended after {_MOST_STEPS} steps: the objective must have a maximum.",
        (f"last point {best.tolist()}: {best_value:.6g}",),
    )


def _value(objective: Objective, parameters: FloatArray) -> float:
    return finite(f"objective at {parameters.tolist()}", objective(parameters))


def _checked_increments(increments: ArrayLike, base: FloatArray) -> FloatArray:
    units = float_array("increments", increments, 1)
    if units.shape != base.shape:
        raise InputError(f"increments needs one entry per parameter: got {units.size} for {base.size}.")
    if (units <= 0.0).any():
        raise InputError(f"increments must be greater than 0: got {units.tolist()}.")
    return units


def _floor(lower_bounds: ArrayLike | None, base: FloatArray, units: FloatArray) -> FloatArray:
    """Lowest base whose corners all lie within the bounds."""
    if lower_bounds is None:
        return np.full(base.size, -np.inf)
    bounds = np.array(lower_bounds, dtype=np.float64)
    if bounds.shape != base.shape or np.isnan(bounds).any():
        raise InputError(f"lower_bounds needs one number or -inf per parameter: got {lower_bounds!r}.")
    floor = bounds + units
    if (base < floor).any():
        raise InputError(
            "start must lie at least one increment above lower_bounds: "
            f"got {base.tolist()} for {bounds.tolist()}."
        )
    return floor


def _read_only(array: FloatArray) -> FloatArray:
    array.setflags(write=False)
    return array
