"""Methods of fitting with one interface: a method has its settings as fields and returns a `Fit`."""

from __future__ import annotations

import time
from collections.abc import Callable
from dataclasses import dataclass, replace
from typing import Protocol

import numpy as np
from numpy.typing import ArrayLike

from fingerpad.core.checks import FloatArray, IntArray, float_array
from fingerpad.core.errors import InputError
from fingerpad.inference.fitting.problem import Problem
from fingerpad.inference.fitting.response_surface import maximise


@dataclass(frozen=True)
class FitStep:
    """One step of a fit.

    Parameters
    ----------
    parameters : array (n_parameters,)
        Parameters at the step.
    score : float
        Score of the chosen observations.
    """

    parameters: FloatArray
    score: float


@dataclass(frozen=True)
class Fit:
    """Result of a method: parameters, score, effort and history.

    Parameters
    ----------
    parameters : array (n_parameters,)
        The best parameters.
    score : float
        Their score over the chosen observations.
    n_evaluations : int
        Evaluations of the model, over all starts.
    seconds : float
        Elapsed time, over all starts. [s]
    history : tuple of FitStep
        Steps of the best fit; the first is its start, the last the result.
    start : int
        Number of its start, from 0; the first one of equals.
    attempts : tuple of Fit
        The fit from each start, in their order; empty for a method with one start.
    """

    parameters: FloatArray
    score: float
    n_evaluations: int
    seconds: float
    history: tuple[FitStep, ...]
    start: int = 0
    attempts: tuple[Fit, ...] = ()


class Method(Protocol):
    """Contract of a method that fits any problem."""

    @property
    def name(self) -> str:
        """Name in tables."""
        ...

    def fit(self, problem: Problem, chosen: IntArray) -> Fit:
        """Fit the chosen observations of a problem."""
        ...


def best_of(attempts: tuple[Fit, ...]) -> Fit:
    """Return the fit with the highest score, with the effort of all fits; the first one of equals.

    Parameters
    ----------
    attempts : tuple of Fit
        One per start.

    Returns
    -------
    Fit

    Examples
    --------
    >>> low, high = (Fit(np.zeros(1), score, 10, 0.5, ()) for score in (0.7, 0.8))
    >>> best = best_of((low, high))
    >>> best.score, best.start, best.n_evaluations
    (0.8, 1, 20)
    """
    start = int(np.argmax([attempt.score for attempt in attempts]))
    return Fit(
        parameters=attempts[start].parameters,
        score=attempts[start].score,
        n_evaluations=sum(attempt.n_evaluations for attempt in attempts),
        seconds=sum(attempt.seconds for attempt in attempts),
        history=attempts[start].history,
        start=start,
        attempts=attempts,
    )


@dataclass(frozen=True)
class ResponseSurface:
    """The paper's method: response surfaces and steepest ascent from each start; the best result is taken.

    Parameters
    ----------
    starts : array_like (n_starts, n_parameters)
        Start points.
    increments : array_like (n_parameters,) or (n_starts, n_parameters)
        One coded unit of each parameter, for all start points or for each.
    lower_bounds : array_like (n_parameters,), optional
        Lower limits of all evaluations; -inf for none.
    smallest_gain : float
        A gain of at most this much ends a fit.
    most_iterations : int
        Largest number of iterations.

    Raises
    ------
    InputError
        If shapes disagree.

    Notes
    -----
    Gerling et al. 2014, section 2.2.2; see
    `fingerpad.inference.fitting.response_surface.maximise`. The method is deterministic.
    """

    starts: ArrayLike
    increments: ArrayLike
    lower_bounds: ArrayLike | None = None
    smallest_gain: float = 1.0e-4
    most_iterations: int = 200
    name: str = "response surface"

    def __post_init__(self) -> None:
        starts = float_array("starts", self.starts, 2)
        units = np.array(self.increments, dtype=np.float64)
        if units.shape not in (starts.shape, starts.shape[1:]):
            raise InputError(
                f"increments must match starts {starts.shape} or one row of it: got {units.shape}."
            )
        object.__setattr__(self, "starts", starts)
        object.__setattr__(self, "increments", np.broadcast_to(units, starts.shape))

    def fit(self, problem: Problem, chosen: IntArray) -> Fit:
        """Fit from every start."""

        def fit_from(start: FloatArray, units: FloatArray) -> Fit:
            clock = time.perf_counter()
            found = maximise(
                lambda parameters: problem.score(parameters, chosen),
                start,
                units,
                self.lower_bounds,
                self.smallest_gain,
                self.most_iterations,
            )
            steps = tuple(FitStep(row.parameters, row.objective) for row in found.history)
            return Fit(found.parameters, found.objective, found.n_runs, time.perf_counter() - clock, steps)

        starts, increments = np.asarray(self.starts), np.asarray(self.increments)
        return best_of(tuple(fit_from(start, units) for start, units in zip(starts, increments, strict=True)))


@dataclass(frozen=True)
class Continued:
    """Two methods in sequence: a cheap one for the start of the second.

    Parameters
    ----------
    first : Method
        Finds the start of the second.
    second : callable
        `second(parameters)`: the method that starts there.
    first_problem : Problem, optional
        Problem of the first method, if it is a simpler one with the same observations.
    name : str
        Name in tables.

    Examples
    --------
    >>> class Hill:
    ...     names, n_observations = ("x",), 1
    ...     def residuals(self, parameters, chosen):
    ...         return parameters - 3.0
    ...     def score(self, parameters, chosen):
    ...         return 1.0 - float((parameters[0] - 3.0) ** 2)
    >>> wide = ResponseSurface([[0.0]], [0.5])
    >>> narrow = lambda parameters: ResponseSurface([parameters], [0.01])
    >>> Continued(wide, narrow, name="both").fit(Hill(), np.arange(1)).parameters.round(2).tolist()
    [3.0]
    """

    first: Method
    second: Callable[[FloatArray], Method]
    first_problem: Problem | None = None
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
