"""Fit a psychometric function to counted judgements by maximum likelihood, for many sets of counts at once.

Newton's method with Levenberg's damping, within bounds:

    (A + mu diag A) delta = g,    g = d ln P / d theta,    A = |-dg / d theta|

The absolute value is that of a symmetric matrix: the absolute values of its eigenvalues. Where the likelihood
is convex, as it may be between a lapse rate of 0 and one that explains a single wrong judgement, such a step
still ascends. A parameter is held at a bound if the gradient points outwards, and a step ends at a bound.
Every set of counts has its own damping and convergence, so its result does not depend on the other sets; a
bootstrap of a thousand sets takes tenths of a second.
"""

from __future__ import annotations

from collections.abc import Iterable, Sequence
from dataclasses import dataclass
from typing import Annotated

import numpy as np
from numpy.typing import ArrayLike
from scipy.special import digamma

from fingerpad.core.checked import checked, value_class
from fingerpad.core.displayed import Columns, Result
from fingerpad.core.errors import ConvergenceError, InputError
from fingerpad.core.values import Finite, FloatArray, Number, choice
from fingerpad.psychophysics.curve import (
    NEARLY_NEVER,
    SIGMOIDS,
    SMALLEST_OVERDISPERSION,
    JudgementCounts,
    PsychometricFunction,
    Sigmoid,
    checked_levels,
    log_probability,
)

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
_SETS_AT_ONCE = 200
_START_POINTS = (15, 9, 4, 3, 4)  # Of a coarse grid, along each free parameter.


@dataclass(frozen=True)
class Model:
    """Family of psychometric functions to be fitted.

    Working coordinates are c(m), ln w, gamma, lambda and rho, in the order of `PARAMETERS`.
    """

    sigmoid: Sigmoid
    coordinates: FloatArray  #: c(x) of the levels, (n_levels,).
    n_trials: FloatArray  #: Judgements at each, (n_levels,).
    lower: FloatArray
    upper: FloatArray  #: Bounds in working coordinates; equal where a parameter is given, (5,).

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

    def perfect(self, n_correct: FloatArray, rho: ArrayLike) -> FloatArray:
        """Logarithm of the probability of each count if the proportion is the observed one."""
        return log_probability(n_correct, self.n_trials, n_correct / self.n_trials, rho)

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
    grid = grid_points(centres(model.lower, model.upper, np.where(model.free, _START_POINTS, 1)))
    best = np.empty(len(n_correct), dtype=np.int64)
    for first in range(0, len(n_correct), _SETS_AT_ONCE):
        some = slice(first, first + _SETS_AT_ONCE)
        best[some] = model.log_likelihood(n_correct[some, None, :], grid).argmax(axis=1)
    return grid[best]


def centres(lower: FloatArray, upper: FloatArray, sizes: Iterable[int]) -> list[FloatArray]:
    """Centres of equal cells along each axis; none is on a bound, where derivatives may vanish."""
    return [
        low + (high - low) * (np.arange(size) + 0.5) / size
        for low, high, size in zip(lower, upper, sizes, strict=True)
    ]


def grid_points(axes: list[FloatArray]) -> FloatArray:
    return np.stack(np.meshgrid(*axes, indexing="ij"), axis=-1).reshape(-1, len(axes))


def _gradient(model: Model, n_correct: FloatArray, points: FloatArray) -> FloatArray:
    """Return the derivatives g (n_sets, 5) of the log likelihood, through psi and by rho itself."""
    psi, share, t = model.proportions(points)
    p = np.clip(psi, NEARLY_NEVER, 1.0 - NEARLY_NEVER)
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


LARGEST_LAPSE = 0.1  # Upper bound of a fitted lapse rate.

LARGEST_GUESS = 0.5
LARGEST_OVERDISPERSION = 0.5
_VALID = (1.0, 1.0, 0.0, 0.0, 0.0)  # Values of parameters that are not given, to check the others.
NARROWEST, WIDEST = 0.5, 5.0
"""Bounds of the width: times the smallest distance between levels, and times their span."""


@value_class
class PsychometricFit(Result):
    """A psychometric function fitted to counts."""

    counts: JudgementCounts
    function: PsychometricFunction  #: The one of maximum likelihood.
    overdispersion: Number  #: Correlation rho of judgements of one level; 0 for independent ones. [0-1]
    log_likelihood: Number  #: Natural logarithm of the probability of the counts.
    model: Model  #: Free parameters and bounds.

    def __repr__(self) -> str:
        return (
            f"PsychometricFit({self.function.sigmoid}, threshold {self.threshold_label}, "
            f"{int(self.counts.n_trials.sum())} judgements of {self.counts.levels.size} levels)"
        )

    def columns(self) -> Columns:
        """Judgements, and the proportion that was observed and fitted, by level."""
        counts = self.counts
        return {
            "level": counts.levels,
            "n_correct": counts.n_correct,
            "n_trials": counts.n_trials,
            "observed": counts.proportion,
            "fitted": self.predict(counts.levels),
        }

    @property
    def free(self) -> tuple[str, ...]:
        """Names of the parameters that were fitted."""
        return tuple(name for name, free in zip(PARAMETERS, self.model.free, strict=True) if free)

    @property
    def point(self) -> FloatArray:
        """Working coordinates (5,) of the fit: c(m), ln w, gamma, lambda, rho."""
        return _working_point(self.function, self.overdispersion)

    @property
    def at_bounds(self) -> tuple[str, ...]:
        """Names of the fitted parameters that lie on a bound.

        A width there means that the data do not determine it. A lapse rate or an overdispersion of 0 is not
        reported.
        """
        on = np.isclose(self.point, self.model.upper, rtol=0.0, atol=1e-9)
        on[:LAPSE] |= np.isclose(self.point, self.model.lower, rtol=0.0, atol=1e-9)[:LAPSE]
        return tuple(name for name, there in zip(PARAMETERS, on & self.model.free, strict=True) if there)

    @property
    def is_step(self) -> bool:
        """Whether the curve is as steep as its bound allows.

        The data then determine no width and no slope, and the threshold only to within two levels.
        """
        return bool(self.model.free[WIDTH] and np.isclose(self.point[WIDTH], self.model.lower[WIDTH]))

    @property
    def threshold_label(self) -> str:
        """The threshold and the proportion there, in words."""
        at = f"{self.threshold():.3g} (at {100.0 * float(self.predict([self.threshold()])[0]):.3g} %)"
        return f"{at}, width not determined by these data" if self.is_step else at

    @property
    def deviance(self) -> float:
        """Twice the difference in log likelihood to a model that fits every proportion exactly."""
        perfect = self.model.perfect(self.counts.n_correct, self.overdispersion)
        return float(2.0 * (perfect.sum() - self.log_likelihood))

    def predict(self, levels: ArrayLike) -> FloatArray:
        """Proportion correct (n_levels,) at any levels; see `PsychometricFunction.predict`."""
        return self.function.predict(levels)

    def threshold(self, proportion_correct: Finite | None = None) -> float:
        """Level at which a proportion of judgements is correct; see `PsychometricFunction.level_at`."""
        return self.function.level_at(proportion_correct)

    def slope(self, proportion_correct: Finite | None = None) -> float:
        """Slope of the proportion there, per unit of the level; see `PsychometricFunction.slope`."""
        return self.function.slope(proportion_correct)


@checked
def fit_psychometric(
    levels: ArrayLike,
    n_correct: ArrayLike,
    n_trials: ArrayLike,
    *,
    sigmoid: Annotated[str, choice(SIGMOIDS)] = "normal",
    guess: Finite | None = 0.5,
    lapse: Finite | None = None,
    threshold: Finite | None = None,
    width: Finite | None = None,
    overdispersion: Finite | None = 0.0,
) -> PsychometricFit:
    """Fit a psychometric function to counted judgements by maximum likelihood.

    Parameters
    ----------
    levels : array_like (n_levels,)
        Levels of the stimulus, increasing. [any unit]
    n_correct, n_trials : array_like (n_levels,)
        Correct, or "yes", judgements, and all judgements.
    sigmoid : {"normal", "logistic", "weibull", "gumbel"}, optional
        Shape.
    guess : float or None, optional
        Rate far below the threshold: 0.5 for two alternatives, 1/m for m of them, 0 for "which is more
        curved"; None to fit it within 0 ... 0.5. [0-1]
    lapse : float or None, optional
        Difference to 1 far above the threshold; None to fit it within 0 ... 0.1. [0-1]
    threshold : float or None, optional
        Level at which F is one half; None to fit it up to half the span of the levels beyond them.
    width : float or None, optional
        Distance of 5 and 95 % of F; None to fit it, between half the closest levels and five spans of all.
    overdispersion : float or None, optional
        Correlation of judgements of one level; 0 for the binomial, None to fit it within 0 ... 0.5. [0-1]

    Raises
    ------
    ConvergenceError
        If the maximum-likelihood threshold lies on its bound, or one proportion explains all counts as well:
        the levels do not determine a threshold.

    Examples
    --------
    >>> told_apart = fit_psychometric([296, 305, 316, 340, 365], [57, 64, 72, 88, 97], [100] * 5, lapse=0.0)
    >>> round(told_apart.threshold(0.75), 1), told_apart.predict([287.0]).round(2).tolist()
    (321.3, [0.55])

    Levels on both sides of a standard, judged "more curved":

    >>> more_curved = fit_psychometric([260, 275, 300, 315], [4, 20, 83, 97], [100] * 4, guess=0.0, lapse=0.0)
    >>> round(more_curved.threshold(0.5)), more_curved.free
    (287, ('threshold', 'width'))
    """
    counts = JudgementCounts(checked_levels(levels, sigmoid), n_correct, n_trials)  # type: ignore[arg-type]
    model = _model(counts, sigmoid, (threshold, width, guess, lapse, overdispersion))
    n_shaping = int(model.free[: WIDTH + 1].sum())
    if counts.levels.size < n_shaping:
        raise InputError(
            "levels",
            f"must be at least {n_shaping}, one for each of threshold and width that is not given",
            str(counts.levels.size),
            "measure more levels, or give one of the two",
        )
    points, heights = maximise_likelihood(model, counts.n_correct[np.newaxis])
    (point,), (height,) = points, heights
    function = PsychometricFunction(
        float(model.sigmoid.level(point[THRESHOLD])),
        float(np.exp(point[WIDTH])),
        float(point[GUESS]),
        float(point[LAPSE]),
        sigmoid,
    )
    fit = PsychometricFit(counts, function, float(point[OVERDISPERSION]), float(height), model)
    _check_threshold(fit, n_shaping)
    return fit


def _check_threshold(fit: PsychometricFit, n_shaping: int) -> None:
    """Raise `ConvergenceError` if the threshold is on its bound, or one proportion explains all as well."""
    counts = fit.counts
    where = (
        f"the levels {counts.levels[0]:g} ... {counts.levels[-1]:g} with proportions "
        f"{counts.proportion[0]:.2f} ... {counts.proportion[-1]:.2f}"
    )
    if "threshold" in fit.at_bounds:
        raise ConvergenceError(
            f"The maximum-likelihood threshold, {fit.function.threshold:g}, lies on its bound, outside of "
            f"{where}: choose levels about the threshold."
        )
    overall = counts.n_correct.sum() / counts.n_trials.sum()
    same = log_probability(counts.n_correct, counts.n_trials, overall, fit.overdispersion).sum()
    # Akaike's criterion: every further parameter must gain 1. One proportion is a parameter as well.
    if n_shaping and fit.log_likelihood - same <= n_shaping - 1.0:
        raise ConvergenceError(
            f"One proportion, {overall:.3f}, explains {where} as well as a psychometric function: they "
            "do not determine a threshold; choose levels about it, or more trials."
        )


def _working_point(function: PsychometricFunction, overdispersion: float) -> FloatArray:
    """Working coordinates (5,) of a function: c(m), ln w, gamma, lambda, rho."""
    middle = function.shape.coordinate(function.threshold)
    return np.array([float(middle), np.log(function.width), function.guess, function.lapse, overdispersion])


def _model(counts: JudgementCounts, sigmoid: str, given: Sequence[float | None]) -> Model:
    """Bounds of the free parameters; for given ones, in the order of `PARAMETERS`, both are the value."""
    known = [value is not None for value in given]
    m, w, gamma, lapse, rho = (
        fallback if value is None else value for value, fallback in zip(given, _VALID, strict=True)
    )
    if not 0.0 <= rho < 1.0:
        raise InputError("overdispersion", "must lie within 0 ... 1 and below 1", f"{rho:g}")
    point = _working_point(PsychometricFunction(m, w, gamma, lapse, sigmoid), rho)
    coordinates = SIGMOIDS[sigmoid].coordinate(counts.levels)
    span = float(np.ptp(coordinates)) or abs(float(coordinates[0])) or 1.0
    gap = float(np.diff(coordinates).min(initial=span))
    bounds = np.array(
        [
            (coordinates[0] - 0.5 * span, coordinates[-1] + 0.5 * span),
            (np.log(NARROWEST * gap), np.log(WIDEST * span)),
            (0.0, LARGEST_GUESS),
            (0.0, LARGEST_LAPSE),
            (SMALLEST_OVERDISPERSION, LARGEST_OVERDISPERSION),
        ]
    )
    bounds[known] = point[known, np.newaxis]
    return Model(SIGMOIDS[sigmoid], coordinates, counts.n_trials, bounds[:, 0], bounds[:, 1])
