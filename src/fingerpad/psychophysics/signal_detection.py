"""Two normal distributions and a decision point: probability of a value on the correct side.

    mu_2, sigma_2 = mean and standard deviation of many noisy values of one stimulus         (e)
    point         = mu_standard + beta (mu_comparison - mu_standard)                        (h)
    hit rate      = P(Normal(mu_comparison, sigma_comparison) lies beyond the point)        (h)

Letters are the steps of Figure 3. The comparison's side is determined from all repetitions, not from one
block of trials: see `side`.
"""

from __future__ import annotations

import numpy as np
from scipy.special import ndtr

from fingerpad.core.checks import FloatArray


def moments(answers: FloatArray) -> tuple[FloatArray, FloatArray]:
    """Return mean mu_2 and standard deviation sigma_2 over the last axis, step (e)."""
    return answers.mean(axis=-1), answers.std(axis=-1, ddof=1)


def decision_point(standard: FloatArray, comparison: FloatArray, criterion: float | FloatArray) -> FloatArray:
    """Return the point at the fraction beta of the distance from the standard's mean to the comparison's."""
    return np.asarray(standard + criterion * (comparison - standard))


def likelihood_point(
    standard: FloatArray, comparison: FloatArray, variance: FloatArray, ratio: FloatArray
) -> FloatArray:
    """Return the point at which the comparison is `ratio` times as likely as the standard.

    For two normal distributions of one variance s^2 the logarithm of the likelihood ratio is linear:

        point = (mu_standard + mu_comparison)/2 + s^2 ln(ratio) / (mu_comparison - mu_standard)
    """
    shift = np.asarray(variance * np.log(np.maximum(ratio, np.finfo(float).tiny)))
    distance = np.broadcast_to(comparison - standard, shift.shape)
    away = np.divide(shift, distance, out=np.zeros_like(shift), where=distance != 0.0)
    return decision_point(standard, comparison, 0.5) + away


def side(means: FloatArray) -> FloatArray:
    """Return the side of the standard on which each comparison lies."""
    pooled = means.mean(axis=0)
    return np.where(pooled[1:] < pooled[0], -1.0, 1.0)


def hit_probability(point: FloatArray, mean: FloatArray, spread: FloatArray, side: FloatArray) -> FloatArray:
    """Return the probability that Normal(mean, spread) lies beyond the decision point, step (h)."""
    margin = np.asarray(side * (mean - point))
    scaled = np.divide(margin, spread, out=np.zeros_like(margin), where=spread > 0.0)
    return np.where(spread > 0.0, ndtr(scaled), np.heaviside(margin, 0.5))
