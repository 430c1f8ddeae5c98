"""Methods of fitting with one interface, the contract of the problems that they fit, and bounds.

A method has its settings as fields and returns a `Fit`.
"""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass, replace
from typing import Protocol, runtime_checkable

import numpy as np
from numpy.typing import ArrayLike
from scipy.stats import qmc

from fingerpad.core.errors import InputError
from fingerpad.core.values import FloatArray, IntArray, float_array


@dataclass(frozen=True)
class Bounds:
    """Bounds and scales of the parameters of a fit."""

    scales: FloatArray
    """Typical changes of the parameters, the units of the steps of a method, (n_parameters,)."""
    low: FloatArray = -np.inf  # type: ignore[assignment]
    high: FloatArray = np.inf  # type: ignore[assignment]
    """Limits; -inf and inf for none, (n_parameters,)."""

    def __post_init__(self) -> None:
        scales = float_array("scales", self.scales, 1)
        low, high = (np.broadcast_to(side, scales.shape) for side in (self.low, self.high))
        if (scales <= 0.0).any() or not (low < high).all():
            raise InputError(
                "Bounds need scales above 0 and lower limits below the upper ones: "
                f"got scales {scales.tolist()}, limits {low.tolist()} and {high.tolist()}."
            )
        for name, value in (("scales", scales), ("low", low), ("high", high)):
            object.__setattr__(self, name, value)

    def and_one(self, scale: float, low: float, high: float) -> Bounds:
        further = ((self.scales, scale), (self.low, low), (self.high, high))
        return Bounds(*(np.append(side, entry) for side, entry in further))

    def spread(self, number: int) -> FloatArray:
        """Points of a Halton sequence between the bounds, (number, n_parameters); deterministic."""
        return self.low + halton(number, self.scales.size) * (self.high - self.low)

    def rows(self, name: str, points: ArrayLike) -> FloatArray:
        """Return points (n_points, n_parameters), or raise `InputError` if they have other parameters."""
        rows = float_array(name, points, 2)
        if rows.shape[1:] != self.scales.shape:
            raise InputError(name, "must have one entry per scale", f"{rows.shape[1]} for {self.scales.size}")
        return rows


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
    def names(self) -> tuple[str, ...]:
        """Names of the parameters, in their order."""
        ...

    @property
    def n_observations(self) -> int:
        """Number of observed stimuli; `chosen` are their numbers from 0."""
        ...

    def residuals(self, parameters: FloatArray, chosen: IntArray) -> FloatArray:
        """Scaled differences between observations and predictions under the chosen stimuli."""
        ...

    def score(self, parameters: FloatArray, chosen: IntArray) -> float:
        """Goodness of fit over the chosen stimuli, 1 if it is perfect; larger is better."""
        ...


@dataclass(frozen=True)
class FitStep:
    """One step of a fit."""

    parameters: FloatArray
    score: float  # Score of the chosen observations.


@dataclass(frozen=True)
class Fit:
    """Result of a method: parameters, score, effort and history."""

    parameters: FloatArray
    score: float  # Their score over the chosen observations.
    n_evaluations: int  # Evaluations of the model, over all starts.
    seconds: float  # Elapsed time, over all starts. [s]
    history: tuple[FitStep, ...]  # Steps of the best fit; the first is its start, the last the result.
    start: int = 0  # Number of its start, from 0; the first one of equals.
    attempts: tuple[Fit, ...] = ()
    """The fit from each start, in their order; empty for a method with one start."""


@runtime_checkable
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

    first: Method  # Finds the start of the second.
    second: Callable[[FloatArray], Method]  # `second(parameters)`: the method that starts there.
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
