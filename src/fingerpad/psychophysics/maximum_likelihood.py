"""Maximum-likelihood psychometric functions, for many sets of counts at once.

Newton's method with Levenberg's damping, within bounds:

    (A + mu diag A) delta = g,    g = d ln P / d theta,    A = |-dg / d theta|

The absolute value is that of a symmetric matrix: the absolute values of its eigenvalues. Where the likelihood
is convex, as it may be between a lapse rate of 0 and one that explains a single wrong judgement, such a step
still ascends. A parameter is held at a bound if the gradient points outwards, and a step ends at a bound.
Every set of counts has its own damping and convergence, so its result does not depend on the other sets; a
bootstrap of a thousand sets takes tenths of a second.
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from scipy.special import digamma

from fingerpad.core.errors import ConvergenceError
from fingerpad.core.values import FloatArray
from fingerpad.psychophysics.functions import SMALLEST_OVERDISPERSION, Sigmoid, log_probability

PARAMETERS = ("threshold", "width", "guess", "lapse", "overdispersion")
"""Names of the parameters, in the order of their columns."""

THRESHOLD, WIDTH, GUESS, LAPSE, OVERDISPERSION = range(len(PARAMETERS))
MOST_STEPS = 200
LEAST_GAIN = 1e-10  # The iteration ends with a predicted gain in the log likelihood below this.

SMALLEST_DAMPING, LARGEST_DAMPING = 1e-6, 1e12
_SCALES = (1.0, 1.0, 0.1, 0.01, 1.0)
"""Scales of the parameters; times the width for the threshold, times itself for rho."""

_DIFFERENCE = 1e-4
_FLATTEST = 1e-8
_ROUND_OFF = 1e-14
_NEARLY_NEVER = 1e-12
_SETS_AT_ONCE = 200
_START_POINTS = {THRESHOLD: 15, WIDTH: 9, GUESS: 4, LAPSE: 3, OVERDISPERSION: 4}


@dataclass(frozen=True)
class Model:
    """Family of psychometric functions to be fitted.

    Working coordinates are c(m), ln w, gamma, lambda and rho, in the order of `PARAMETERS`.
    """

    sigmoid: Sigmoid
    coordinates: FloatArray  # c(x) of the levels, (n_levels,).
    n_trials: FloatArray  # Judgements at each, (n_levels,).
    lower: FloatArray
    upper: FloatArray  # Bounds in working coordinates; equal where a parameter is given, (5,).

    @property
    def free(self) -> np.ndarray:
        return self.upper > self.lower

    def proportions(self, points: FloatArray) -> tuple[FloatArray, FloatArray, FloatArray]:
        """Psi of points (..., 5) at every level (..., n_levels), with S and its argument."""
        middle, width = points[..., THRESHOLD, None], np.exp(points[..., WIDTH, None])
        t = self.sigmoid.argument(self.coordinates, middle, width)
        share = self.sigmoid.cumulative(t)
        guess, lapse = points[..., GUESS, None], points[..., LAPSE, None]
        return guess + (1.0 - guess - lapse) * share, share, t

    def log_likelihood(self, n_correct: FloatArray, points: FloatArray) -> FloatArray:
        """Logarithm of the likelihood (...,) of counts (..., n_levels) at points (..., 5)."""
        rho = points[..., OVERDISPERSION, None] if self.upper[OVERDISPERSION] > 0.0 else 0.0
        each = log_probability(n_correct, self.n_trials, self.proportions(points)[0], rho)
        return each.sum(axis=-1)


def maximise_likelihood(model: Model, n_correct: FloatArray) -> tuple[FloatArray, FloatArray]:
    """Find the maximum-likelihood function of each set of counts."""
    points = _starts(model, n_correct)
    heights = model.log_likelihood(n_correct, points)
    damping = np.full(len(points), 1e-3)
    running = np.arange(len(points))
    history: list[str] = []
    for step in range(MOST_STEPS):
        gradient = _gradient(model, n_correct[running], points[running])
        now = points[running]
        held = ~model.free | (now <= model.lower) & (gradient < 0.0) | (now >= model.upper) & (gradient > 0.0)
        curvature = _curvature(model, n_correct[running], points[running], held)
        move = _damped_step(model, points[running], gradient, curvature, held, damping[running])
        tried = np.clip(points[running] + move, model.lower, model.upper)
        reached = model.log_likelihood(n_correct[running], tried)
        made = reached - heights[running]
        promised = np.einsum("sp,sp->s", gradient, move)
        promised -= 0.5 * np.einsum("sp,spq,sq->s", move, curvature, move)
        better = made >= 0.0
        improved = running[better]
        points[improved], heights[improved] = tried[better], reached[better]
        # The damping depends on the ratio of actual to predicted gain.
        kept = made / np.maximum(promised, LEAST_GAIN)
        damping[running] *= np.where(kept > 0.75, 0.1, np.where(kept < 0.25, 10.0, 1.0))
        damping = np.maximum(damping, SMALLEST_DAMPING)
        # With very large damping the maximum is reached to round-off.
        finished = (np.abs(promised) < LEAST_GAIN) | (damping[running] > LARGEST_DAMPING)
        running = running[~finished]
        if not running.size:
            return points, heights
        history.append(f"step {step + 1}: {running.size} of {len(points)} sets of counts not converged")
    raise ConvergenceError(
        f"No maximum-likelihood psychometric function after {MOST_STEPS} steps: give lapse or guess a "
        "value, or measure more levels.",
        tuple(history[-10:]),
    )


def _starts(model: Model, n_correct: FloatArray) -> FloatArray:
    """Point of a coarse grid with the largest likelihood, for each set of counts."""
    axes = [
        _inner_points(model.lower[index], model.upper[index], count) for index, count in _START_POINTS.items()
    ]
    grid = np.stack(np.meshgrid(*axes, indexing="ij"), axis=-1).reshape(-1, len(PARAMETERS))
    best = np.empty(len(n_correct), dtype=np.int64)
    for first in range(0, len(n_correct), _SETS_AT_ONCE):
        some = slice(first, first + _SETS_AT_ONCE)
        best[some] = model.log_likelihood(n_correct[some, None, :], grid).argmax(axis=1)
    return grid[best]


def _inner_points(lower: float, upper: float, count: int) -> FloatArray:
    """Points between the bounds, not on them, where derivatives may vanish."""
    if lower == upper:
        return np.array([lower])
    return lower + (upper - lower) * (np.arange(count) + 0.5) / count


def _gradient(model: Model, n_correct: FloatArray, points: FloatArray) -> FloatArray:
    """Return the derivatives g (n_sets, 5) of the log likelihood, through psi and by rho itself."""
    psi, share, t = model.proportions(points)
    p = np.clip(psi, _NEARLY_NEVER, 1.0 - _NEARLY_NEVER)
    guess, lapse, width = points[:, GUESS, None], points[:, LAPSE, None], np.exp(points[:, WIDTH, None])
    rise = (1.0 - guess - lapse) * model.sigmoid.density(t) * model.sigmoid.stretch / width
    by_proportion, by_overdispersion = _scores(n_correct, model.n_trials, p, points[:, OVERDISPERSION, None])
    by_parameter = (
        -rise * by_proportion,
        -rise * (model.coordinates - points[:, THRESHOLD, None]) * by_proportion,
        (1.0 - share) * by_proportion,
        -share * by_proportion,
        by_overdispersion,
    )
    return np.stack([each.sum(axis=1) for each in by_parameter], axis=1)


def _curvature(model: Model, n_correct: FloatArray, points: FloatArray, held: np.ndarray) -> FloatArray:
    """Absolute curvature A (n_sets, 5, 5) among the parameters that are not held, from differences of g."""
    scales = np.tile(_SCALES, (len(points), 1))
    scales[:, THRESHOLD] = np.exp(points[:, WIDTH])
    scales[:, OVERDISPERSION] = np.maximum(points[:, OVERDISPERSION], SMALLEST_OVERDISPERSION)
    fall = np.zeros((*points.shape, len(PARAMETERS)))
    for index in np.flatnonzero(model.free):
        step = np.zeros_like(points)
        step[:, index] = _DIFFERENCE * scales[:, index]
        rise = _gradient(model, n_correct, points + step) - _gradient(model, n_correct, points - step)
        fall[:, index] = -rise / (2.0 * _DIFFERENCE) * scales
    fall[held[:, :, None] | held[:, None, :]] = 0.0
    # In units of the scales, so that the absolute value does not depend on the unit of the levels.
    curvatures, directions = np.linalg.eigh(0.5 * (fall + np.swapaxes(fall, 1, 2)))
    absolute = np.maximum(np.abs(curvatures), _FLATTEST)
    return np.einsum("spc,sc,sqc->spq", directions, absolute, directions) / (
        scales[:, :, None] * scales[:, None, :]
    )


def _scores(k: FloatArray, n: FloatArray, p: FloatArray, rho: FloatArray) -> tuple[FloatArray, FloatArray]:
    """Return the derivatives of the log probability by p and by rho."""
    if not (rho >= SMALLEST_OVERDISPERSION).any():
        return (k - n * p) / (p * (1.0 - p)), np.zeros_like(p)
    v = (1.0 - rho) / rho
    a, b = p * v, (1.0 - p) * v
    correct, wrong = digamma(k + a) - digamma(a), digamma(n - k + b) - digamma(b)
    by_v = p * correct + (1.0 - p) * wrong - (digamma(n + v) - digamma(v))
    return v * (correct - wrong), -by_v / np.square(rho)


def _damped_step(
    model: Model,
    points: FloatArray,
    gradient: FloatArray,
    curvature: FloatArray,
    held: np.ndarray,
    damping: FloatArray,
) -> FloatArray:
    """Solve (A + mu diag A) delta = g; parameters beyond a bound are set to it, the rest is solved again."""
    index = np.arange(len(PARAMETERS))
    damped = curvature.copy()
    damped[:, index, index] = damped[:, index, index] * (1.0 + damping[:, None])
    stopped, move = held.copy(), np.zeros_like(points)
    for _ in PARAMETERS:
        stays = stopped[:, :, None] | stopped[:, None, :]
        matrix = np.where(stays, np.eye(len(PARAMETERS)), damped)
        pull = gradient - np.einsum("spq,sq->sp", damped, np.where(stopped, move, 0.0))
        move = np.linalg.solve(matrix, np.where(stopped, move, pull)[..., None])[..., 0]
        reached = np.clip(points + move, model.lower, model.upper) - points
        passed = (reached != move) & ~stopped & (np.abs(reached - move) > _ROUND_OFF)
        if not passed.any():
            break
        move, stopped = np.where(passed, reached, move), stopped | passed
    return np.clip(points + move, model.lower, model.upper) - points
