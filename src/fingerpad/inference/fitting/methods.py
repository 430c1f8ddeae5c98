"""Methods of fitting with one interface: a method has its settings as fields and returns a `Fit`."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass, replace
from typing import Protocol

import numpy as np

from fingerpad.core.checks import FloatArray, IntArray
from fingerpad.inference.fitting.problem import Problem


@dataclass(frozen=True)
class FitStep:
    """One step of a fit."""

    parameters: FloatArray
    """Parameters at the step, (n_parameters,)."""
    score: float
    """Score of the chosen observations."""


@dataclass(frozen=True)
class Fit:
    """Result of a method: parameters, score, effort and history."""

    parameters: FloatArray
    """The best parameters, (n_parameters,)."""
    score: float
    """Their score over the chosen observations."""
    n_evaluations: int
    """Evaluations of the model, over all starts."""
    seconds: float
    """Elapsed time, over all starts. [s]"""
    history: tuple[FitStep, ...]
    """Steps of the best fit; the first is its start, the last the result."""
    start: int = 0
    """Number of its start, from 0; the first one of equals."""
    attempts: tuple[Fit, ...] = ()
    """The fit from each start, in their order; empty for a method with one start."""


class Method(Protocol):
    """Contract of a method that fits any problem."""

    @property
    def name(self) -> str: ...

    def fit(self, problem: Problem, chosen: IntArray) -> Fit:
        """Fit the chosen observations of a problem."""
        ...


def best_of(attempts: tuple[Fit, ...]) -> Fit:
    """Return the fit with the highest score, with the effort of all fits; the first one of equals."""
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
class Continued:
    """Two methods in sequence: a cheap one for the start of the second."""

    first: Method
    """Finds the start of the second."""
    second: Callable[[FloatArray], Method]
    """`second(parameters)`: the method that starts there."""
    first_problem: Problem | None = None
    """Problem of the first method, if it is a simpler one with the same observations."""
    name: str = "continued"
    """Name in tables."""

    def fit(self, problem: Problem, chosen: IntArray) -> Fit:
        """Fit with the first method, then with the second from its result; the effort is that of both."""
        begun = self.first.fit(problem if self.first_problem is None else self.first_problem, chosen)
        ended = self.second(begun.parameters).fit(problem, chosen)
        return replace(
            ended,
            n_evaluations=begun.n_evaluations + ended.n_evaluations,
            seconds=begun.seconds + ended.seconds,
        )
