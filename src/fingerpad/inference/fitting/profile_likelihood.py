"""Profile likelihood: the largest likelihood for each fixed value of one parameter.

One parameter is fixed at steps away from the best fit, and all others are fitted at each step. The confidence
interval ends where twice the loss of log likelihood exceeds the quantile of chi-square with one degree of
freedom. If that does not happen on one side, the data do not bound the parameter there.
"""

from __future__ import annotations

from collections.abc import Callable, Sequence
from dataclasses import dataclass

import numpy as np
from numpy.typing import ArrayLike
from scipy.optimize import minimize
from scipy.stats import chi2

from fingerpad.core.errors import ConvergenceError, InputError
from fingerpad.core.threads import in_blocks
from fingerpad.core.values import FloatArray

LogLikelihood = Callable[[FloatArray], FloatArray]
"""From points (n_points, n_parameters) to their log likelihoods, -inf where impossible."""

PROFILE_STEP = 0.5  # Step of the fixed parameter over its scale. [1]

LIKELIHOOD_TOLERANCE = 0.02
"""Tolerance of the fits of the others, in log likelihood and in parameters over their scales. [1]"""

NEAREST = 20  # Number of starts nearest to a fixed value; a fit starts from the best of them.

MOST_EVALUATIONS = 2000
RESTARTS = 5
MOST_STEPS = 12  # Steps to either side of the best fit.


@dataclass(frozen=True)
class ProfileLikelihood:
    """Profile likelihood of one parameter."""

    name: str
    values: FloatArray  #: Its fixed values, increasing, (n_values,).
    losses: FloatArray  #: Largest log likelihood of all minus the largest for this value, (n_values,). [1]
    points: FloatArray  #: The best parameters for each value, (n_values, n_parameters).
    interval: tuple[float, float]  #: Ends of the confidence interval; infinite where the data set no bound.


def profile_likelihoods(
    log_likelihood: LogLikelihood,
    starts: ArrayLike,
    scales: ArrayLike,
    names: Sequence[str],
    *,
    level: float = 0.95,
) -> tuple[ProfileLikelihood, ...]:
    """Profile the likelihood of every parameter.

    Each profile is computed outwards from the best fit. A fit starts from the result of its neighbour and, if
    several starts are given, also from the best of the nearest ones, since the likelihood has many local
    maxima.
    """
    origins, units = np.atleast_2d(starts), np.asarray(scales, dtype=np.float64)
    search = _Search(log_likelihood, units, origins)
    best, highest = search.best_of(origins)
    if not np.isfinite(highest):
        raise InputError(
            "log_likelihood", "must be finite at a start", remedy=f"it is not at {best.tolist()}"
        )
    for _ in range(RESTARTS):
        point = search.maximise(best)
        gain, best = search.height(point) - search.height(best), point
        if gain <= LIKELIHOOD_TOLERANCE:
            break
    allowed = 0.5 * float(chi2.ppf(level, 1))

    def sweep(indices: slice) -> list[tuple[FloatArray, float]]:
        return search.sweep(best, indices.start, allowed)

    sweeps = in_blocks(sweep, len(names), 1)
    highest = max(height for fits in sweeps for _, height in fits)
    return tuple(_profile(names[index], index, fits, highest, allowed) for index, fits in enumerate(sweeps))


@dataclass(frozen=True)
class _Search:
    """Search for the most likely parameters, with at most one of them fixed."""

    log_likelihood: LogLikelihood
    scales: FloatArray
    starts: FloatArray

    def heights(self, points: FloatArray) -> FloatArray:
        values = np.asarray(self.log_likelihood(points), dtype=np.float64)
        if np.isnan(values).any():
            wrong = points[np.isnan(values)][0].tolist()
            raise InputError("log_likelihood", "must be a number or -inf", remedy=f"it is NaN at {wrong}")
        return values

    def height(self, point: FloatArray) -> float:
        return float(self.heights(point[None])[0])

    def best_of(self, points: FloatArray) -> tuple[FloatArray, float]:
        """Most likely of some points, and its log likelihood."""
        heights = self.heights(points)
        return points[int(heights.argmax())], float(heights.max())

    def maximise(self, start: FloatArray, held: int | None = None) -> FloatArray:
        """Most likely point near the start, by Nelder and Mead's method."""
        free = np.array([index for index in range(start.size) if index != held])

        def moved(offsets: FloatArray) -> FloatArray:
            point = start.copy()
            point[free] += self.scales[free] * offsets
            return point

        found = minimize(
            # Nelder-Mead compares values: a large finite number replaces infinity.
            lambda offsets: min(-self.height(moved(offsets)), 1e300),
            np.zeros(free.size),
            method="Nelder-Mead",
            options={
                "initial_simplex": np.vstack([np.zeros(free.size), PROFILE_STEP * np.eye(free.size)]),
                "xatol": LIKELIHOOD_TOLERANCE,
                "fatol": LIKELIHOOD_TOLERANCE,
                "maxfev": MOST_EVALUATIONS,
            },
        )
        if not found.success:
            raise ConvergenceError(
                f"A fit of the profile has not converged after {MOST_EVALUATIONS} evaluations, near "
                f"{moved(found.x).tolist()}: choose smaller scales.",
                (f"log likelihood {-found.fun:.4f}",),
            )
        return moved(found.x)

    def sweep(self, best: FloatArray, index: int, allowed: float) -> list[tuple[FloatArray, float]]:
        """Fit the others with one parameter fixed at steps to both sides; return points and values."""
        top = self.height(best)
        fits = [(best, top)]
        for side in (-1.0, 1.0):
            line = [(best, top)]
            while len(line) <= MOST_STEPS and not all(top - height > allowed for _, height in line[-2:]):
                value = best[index] + side * PROFILE_STEP * len(line) * self.scales[index]
                line.append(self._fit(line[-1][0], index, value))
            fits += line[1:]
        return fits

    def _fit(self, neighbour: FloatArray, index: int, value: float) -> tuple[FloatArray, float]:
        """Most likely point with one parameter fixed, from the neighbour and from the best near start."""
        nearest = np.argsort(np.abs(self.starts[:, index] - value), kind="stable")[:NEAREST]
        pools = [neighbour[None], self.starts[nearest]] if len(self.starts) > 1 else [neighbour[None]]
        found = []
        for pool in pools:
            held = pool.copy()
            held[:, index] = value
            found.append(self.maximise(self.best_of(held)[0], held=index))
        return self.best_of(np.array(found))


def _profile(
    name: str, index: int, fits: list[tuple[FloatArray, float]], highest: float, allowed: float
) -> ProfileLikelihood:
    points = np.array([point for point, _ in fits])
    order = np.argsort(points[:, index])
    values = points[order, index]
    losses = highest - np.array([height for _, height in fits])[order]
    return ProfileLikelihood(name, values, losses, points[order], _interval(values, losses, allowed))


def _interval(values: FloatArray, losses: FloatArray, allowed: float) -> tuple[float, float]:
    """Outermost crossings of the allowed loss, by linear interpolation."""
    inside = np.flatnonzero(losses <= allowed)
    if not inside.size:  # a better point lies on the profile of another parameter
        return float("-inf"), float("inf")

    def crossing(within: int, beyond: int) -> float:
        share = (allowed - losses[within]) / (losses[beyond] - losses[within])
        return float(values[within] + share * (values[beyond] - values[within]))

    first, last = int(inside[0]), int(inside[-1])
    return (
        crossing(first, first - 1) if first > 0 else float("-inf"),
        crossing(last, last + 1) if last < values.size - 1 else float("inf"),
    )
