"""Uncertainty of a fitted psychometric function: parametric bootstrap, posterior, goodness of fit.

Bootstrap and posterior are a weighted sample of functions, from which intervals of a parameter, a threshold
or the curve are computed.

- Bootstrap: counts are sampled from the fitted function repeatedly, and fitted in the same way.
- Posterior: Bayes' rule on a grid over the fitted parameters, with a prior flat in the threshold, the
  logarithm of the width, guess, lapse and overdispersion, within the bounds of the fit; the width may be
  smaller, so that a step between two levels may lie anywhere between them. A coarse grid finds the region of
  the posterior, a fine grid covers it; no random numbers are used.

The goodness of fit compares the deviance

    D = 2 sum_i [ln P(k_i | k_i / n_i) - ln P(k_i | psi(x_i))]

with that of data simulated from the fit: with the trials of an experiment D has no chi-square distribution.
Counts from the fit are fitted again (Wichmann & Hill 2001).
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from numpy.typing import ArrayLike

from fingerpad.core.checked import checked
from fingerpad.core.errors import ConvergenceError, InputError
from fingerpad.core.random_streams import Purpose, uniforms
from fingerpad.core.values import Count, FloatArray, Whole, finite, one_of
from fingerpad.psychophysics.curve import (
    SIGMOIDS,
    Sigmoid,
    checked_levels,
    level_at,
    log_probability,
    proportion,
)
from fingerpad.psychophysics.curve_fit import (
    OVERDISPERSION,
    PARAMETERS,
    THRESHOLD,
    WIDTH,
    Model,
    PsychometricFit,
    centres,
    grid_points,
    maximise_likelihood,
)

COARSE_POINTS = 21
FINE_POINTS = {1: (401,), 2: (81, 81), 3: (81, 35, 13), 4: (31, 27, 13, 13), 5: (21, 19, 9, 9, 9)}
"""Points of the fine grid along each fitted parameter, by the number of parameters."""

NEGLIGIBLE = 1e-5  # Share of its maximum below which a posterior is neglected.

REFINEMENTS = 2

STEEPEST = 0.01  # Smallest width of the prior over that of the fit.


@dataclass(frozen=True)
class FunctionCloud:
    """Weighted sample of psychometric functions."""

    sigmoid: str  #: Shape of all of them.
    values: FloatArray  #: threshold, width, guess, lapse and overdispersion of each, (n_functions, 5).
    weights: FloatArray  #: Weights, with sum 1, (n_functions,).

    @property
    def shape(self) -> Sigmoid:
        """The function S."""
        return SIGMOIDS[self.sigmoid]

    def interval(self, parameter: str, probability: float = 0.95) -> tuple[float, float]:
        """Central interval of a parameter.

        Parameters
        ----------
        parameter : {"threshold", "width", "guess", "lapse", "overdispersion"}
            "threshold" is where F is one half.
        probability : float, optional
            Coverage of the true value. [0-1]
        """
        one_of("parameter", parameter, PARAMETERS)
        return self._central(self.values[:, PARAMETERS.index(parameter)], probability)

    def threshold_interval(
        self, proportion_correct: float | None = None, probability: float = 0.95
    ) -> tuple[float, float]:
        """Central interval of the level at which a proportion of judgements is correct.

        Parameters
        ----------
        proportion_correct : float, optional
            By default the threshold, where F is one half. [0-1]
        probability : float, optional
            Coverage of the true value. [0-1]

        Returns
        -------
        (float, float)
            An end is infinite if too many of the functions do not reach that value.
        """
        return self._central(self.thresholds(proportion_correct), probability)

    def thresholds(self, proportion_correct: float | None = None) -> FloatArray:
        """Level (n_functions,) at which each function has a value; infinite if it does not reach it."""
        if proportion_correct is None:
            return self.values[:, THRESHOLD]
        wanted = _share("proportion_correct", proportion_correct)
        return level_at(self.shape, wanted, self.values.T[:OVERDISPERSION])

    def band(self, levels: ArrayLike, probability: float = 0.95) -> FloatArray:
        """Central interval (2, n_levels) of the curve at each level, level by level. [0-1]"""
        x, parameters = checked_levels(levels, self.sigmoid), self.values.T[:OVERDISPERSION]
        ends = [self._central(proportion(self.shape, level, parameters), probability) for level in x]
        return np.array(ends).reshape(-1, 2).T

    def _central(self, quantity: FloatArray, probability: float) -> tuple[float, float]:
        outside = 0.5 * (1.0 - _share("probability", probability))
        lower, upper = weighted_quantiles(quantity, self.weights, [outside, 1.0 - outside])
        return float(lower), float(upper)


def weighted_quantiles(values: ArrayLike, weights: ArrayLike, shares: ArrayLike) -> FloatArray:
    """Weighted quantiles.

    Each value is at the middle of its own weight; quantiles between values are interpolated.
    """
    # Equal values, as on a grid, are merged with the sum of their weights.
    quantity, which = np.unique(np.asarray(values, dtype=np.float64), return_inverse=True)
    mass = np.bincount(which, np.asarray(weights, dtype=np.float64))
    middles = (np.cumsum(mass) - 0.5 * mass) / mass.sum()
    # Infinite values are not interpolated.
    finite_part = np.isfinite(quantity)
    wanted = np.asarray(shares, dtype=np.float64)
    if finite_part.all():
        return np.interp(wanted, middles, quantity)
    if not finite_part.any():
        return quantity[np.searchsorted(middles, wanted).clip(0, quantity.size - 1)]
    inside = np.interp(wanted, middles[finite_part], quantity[finite_part])
    below, above = middles[finite_part][0], middles[finite_part][-1]
    inside = np.where((wanted < below) & (quantity[0] == -np.inf), -np.inf, inside)
    return np.where((wanted > above) & (quantity[-1] == np.inf), np.inf, inside)


@checked
def bootstrap(fit: PsychometricFit, seed: Whole, n_replicates: Whole = 1000) -> FunctionCloud:
    """Sample counts from a fit and fit them again, `n_replicates` times: functions of equal weight.

    Raises
    ------
    ConvergenceError
        If a replicate cannot be fitted, or the fit is a step: its replicates are steps at the same place.

    Examples
    --------
    >>> from fingerpad.psychophysics.curve_fit import fit_psychometric
    >>> fit = fit_psychometric([296, 305, 316, 340, 365], [57, 64, 72, 88, 97], [100] * 5, lapse=0.0)
    >>> lower, upper = bootstrap(fit, seed=1, n_replicates=200).threshold_interval(0.75)
    >>> bool(lower < fit.threshold(0.75) < upper)
    True
    """
    if fit.is_step:
        levels = fit.counts.levels
        above = int(np.clip(np.searchsorted(levels, fit.threshold()), 1, levels.size - 1))
        raise ConvergenceError(
            "An interval by bootstrap is not determined by these data: the curve rises between the levels "
            f"{levels[above - 1]:g} and {levels[above]:g}; measure more levels there, or take posterior(fit)."
        )
    points, _ = maximise_likelihood(fit.model, drawn_counts(fit, seed, n_replicates))
    return _cloud(fit, points, np.full(len(points), 1.0 / len(points)))


@checked
def drawn_counts(fit: PsychometricFit, seed: Whole, n_replicates: Count) -> FloatArray:
    expected = fit.predict(fit.counts.levels)
    shares = uniforms(seed, n_replicates, expected.size, Purpose.JUDGEMENT, 1)[..., 0]
    counts = np.empty(shares.shape)
    for level, (n, p) in enumerate(zip(fit.counts.n_trials, expected, strict=True)):
        probabilities = np.exp(log_probability(np.arange(n + 1.0), n, p, fit.overdispersion))
        # The last count has the remaining probability, including round-off.
        counts[:, level] = np.searchsorted(np.cumsum(probabilities[:-1]), shares[:, level], side="right")
    return counts


@checked
def posterior(fit: PsychometricFit) -> FunctionCloud:
    """Posterior of the fitted parameters, by Bayes' rule on a grid: functions with weights.

    Examples
    --------
    >>> from fingerpad.psychophysics.curve_fit import fit_psychometric
    >>> fit = fit_psychometric([296, 305, 316, 340, 365], [57, 64, 72, 88, 97], [100] * 5, lapse=0.0)
    >>> [round(end) for end in posterior(fit).threshold_interval(0.75)]
    [315, 328]
    """
    model = fit.model
    n_free = int(model.free.sum())
    if n_free == 0:
        return _cloud(fit, fit.point[np.newaxis], np.ones(1))
    lower, upper = model.lower.copy(), model.upper
    if model.free[WIDTH]:
        lower[WIDTH] += np.log(STEEPEST)
    lower, upper = lower[model.free], upper[model.free]
    sizes = (COARSE_POINTS,) * min(n_free, 3) + (9,) * (n_free - 3)
    # A grid finds the region of the posterior; a narrow posterior needs a second one.
    for step in range(REFINEMENTS):
        axes = centres(lower, upper, sizes)
        if step == 0 and model.free[THRESHOLD]:
            # The posterior of a step lies between two levels, which may be close to each other.
            between = 0.5 * (model.coordinates[1:] + model.coordinates[:-1])
            axes[THRESHOLD] = np.union1d(axes[THRESHOLD], between)
        lower, upper = _where_it_is(axes, _heights(fit, axes), lower, upper)
    axes = centres(lower, upper, FINE_POINTS[n_free])
    weights = np.exp(_heights(fit, axes))
    points = _grid_points(model, axes)
    kept = weights.ravel() > 0.1 * NEGLIGIBLE * weights.max()
    return _cloud(fit, points[kept], weights.ravel()[kept] / weights.ravel()[kept].sum())


def _grid_points(model: Model, axes: list[FloatArray]) -> FloatArray:
    """Working coordinates (n_points, 5) of a grid over the free parameters."""
    mesh = grid_points(axes)
    points = np.tile(model.lower, (len(mesh), 1))
    points[:, model.free] = mesh
    return points


def _heights(fit: PsychometricFit, axes: list[FloatArray]) -> FloatArray:
    """Logarithm of the likelihood over its maximum, at every point of a grid."""
    heights = fit.model.log_likelihood(fit.counts.n_correct, _grid_points(fit.model, axes))
    return (heights - heights.max()).reshape([axis.size for axis in axes])


def _where_it_is(
    axes: list[FloatArray], heights: FloatArray, lower: FloatArray, upper: FloatArray
) -> tuple[FloatArray, FloatArray]:
    """Bounds of the points above `NEGLIGIBLE` along each axis: the next points on each side."""
    ends = []
    for index, axis in enumerate(axes):
        others = tuple(other for other in range(len(axes)) if other != index)
        matters = np.flatnonzero(heights.max(axis=others) > np.log(NEGLIGIBLE))
        around = np.concatenate([[lower[index]], axis, [upper[index]]])
        ends.append((around[matters[0]], around[matters[-1] + 2]))
    return np.array([low for low, _ in ends]), np.array([high for _, high in ends])


def _cloud(fit: PsychometricFit, points: FloatArray, weights: FloatArray) -> FunctionCloud:
    """Working coordinates as parameters."""
    values = points.copy()
    values[:, THRESHOLD] = fit.function.shape.level(points[:, THRESHOLD])
    values[:, WIDTH] = np.exp(points[:, WIDTH])
    return FunctionCloud(fit.function.sigmoid, values, weights)


def _share(name: str, value: float) -> float:
    if not 0.0 < finite(name, value) < 1.0:
        raise InputError(name, "must lie between 0 and 1", repr(value))
    return float(value)


@dataclass(frozen=True)
class GoodnessOfFit:
    """Deviance of a fit, and its p-value from simulated data."""

    deviance: float
    """D of the observed counts; about the number of levels minus the fitted parameters for a good fit."""
    p_value: float
    """Share of the simulated data sets with at least that deviance; a small one rejects the fit. [0-1]"""
    residuals: FloatArray
    """Root of each level's share of D, with the sign of observed minus predicted, (n_levels,)."""
    drawn_deviances: FloatArray  #: Of the simulated data sets, (n_replicates,).
    seed: int  #: Of the random numbers.


def goodness_of_fit(fit: PsychometricFit, seed: int, n_replicates: int = 1000) -> GoodnessOfFit:
    """Compare the deviance of a fit with those of `n_replicates` data sets simulated from it.

    Raises
    ------
    ConvergenceError
        If a replicate cannot be fitted.

    Examples
    --------
    >>> from fingerpad.psychophysics.curve_fit import fit_psychometric
    >>> good = fit_psychometric([1, 2, 3, 4, 5], [52, 60, 76, 91, 98], [100] * 5, lapse=0.0)
    >>> bad = fit_psychometric([1, 2, 3, 4, 5], [52, 90, 60, 99, 80], [100] * 5, lapse=0.0)
    >>> goodness_of_fit(good, 1, 200).p_value > 0.05 > goodness_of_fit(bad, 1, 200).p_value
    True
    """
    drawn = drawn_counts(fit, seed, n_replicates)
    points, heights = maximise_likelihood(fit.model, drawn)
    rho = points[:, OVERDISPERSION, None] if fit.overdispersion > 0.0 else 0.0
    deviances = 2.0 * (fit.model.perfect(drawn, rho).sum(axis=1) - heights)
    # The observed set counts as one of the sets, so p is never 0.
    p_value = (1.0 + np.count_nonzero(deviances >= fit.deviance)) / (1.0 + n_replicates)
    return GoodnessOfFit(fit.deviance, float(p_value), _residuals(fit), deviances, seed)


def _residuals(fit: PsychometricFit) -> FloatArray:
    counts = fit.counts
    expected = fit.predict(counts.levels)
    of_perfect = fit.model.perfect(counts.n_correct, fit.overdispersion)
    of_fit = log_probability(counts.n_correct, counts.n_trials, expected, fit.overdispersion)
    return np.sign(counts.proportion - expected) * np.sqrt(2.0 * np.maximum(of_perfect - of_fit, 0.0))
