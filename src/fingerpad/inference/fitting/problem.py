"""Contract between problems and methods of fitting: names, residuals and a score."""

from __future__ import annotations

from typing import Protocol

from fingerpad.core.checks import FloatArray, IntArray


class Problem(Protocol):
    """A model and the observations to which it is fitted.

    Notes
    -----
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
