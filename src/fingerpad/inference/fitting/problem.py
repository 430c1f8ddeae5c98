"""What a method of fitting needs to know of a problem: names, residuals and a score."""

from __future__ import annotations

from typing import Protocol

from fingerpad.core.checks import FloatArray, IntArray


class Problem(Protocol):
    """A model to be fitted to observations; whoever fits it needs to know no more.

    Notes
    -----
    `score = 1 - residuals @ residuals` up to round-off: a method may lift the one or press down the other.
    Both depend on nothing but their arguments.
    """

    @property
    def names(self) -> tuple[str, ...]:
        """Names of the parameters, in their order."""
        ...

    @property
    def n_observations(self) -> int:
        """Number of stimuli that were observed; `chosen` counts them from 0."""
        ...

    def residuals(self, parameters: FloatArray, chosen: IntArray) -> FloatArray:
        """Scaled differences between what was observed under the chosen stimuli and what is predicted."""
        ...

    def score(self, parameters: FloatArray, chosen: IntArray) -> float:
        """Goodness of fit over the chosen stimuli, 1 if it is perfect; larger is better."""
        ...
