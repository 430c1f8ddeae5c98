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
    """Return mean mu_2 and standard deviation sigma_2 over the last axis, step (e).

    Parameters
    ----------
    answers : array (..., n)
        Noisy values of one stimulus.

    Returns
    -------
    (array (...), array (...))
        The standard deviation is that of a sample, with n - 1 in the denominator.

    Examples
    --------
    >>> mean, spread = moments(np.array([[1.0, 3.0]]))
    >>> mean.tolist(), spread.round(4).tolist()
    ([2.0], [1.4142])
    """
    return answers.mean(axis=-1), answers.std(axis=-1, ddof=1)


def decision_point(standard: FloatArray, comparison: FloatArray, criterion: float | FloatArray) -> FloatArray:
    """Return the point at the fraction beta of the distance from the standard's mean to the comparison's.

    Examples
    --------
    >>> float(decision_point(10.0, 14.0, 0.5))
    12.0
    """
    return np.asarray(standard + criterion * (comparison - standard))


def likelihood_point(
    standard: FloatArray, comparison: FloatArray, variance: FloatArray, ratio: FloatArray
) -> FloatArray:
    """Return the point at which the comparison is `ratio` times as likely as the standard.

    For two normal distributions of one variance s^2 the logarithm of the likelihood ratio is linear:

        point = (mu_standard + mu_comparison)/2 + s^2 ln(ratio) / (mu_comparison - mu_standard)

    Parameters
    ----------
    standard, comparison, variance, ratio : arrays that broadcast
        Both means, the variance of both, and the likelihood ratio.

    Returns
    -------
    array
        The midpoint where the means are equal.

    Examples
    --------
    >>> float(likelihood_point(10.0, 14.0, 4.0, 1.0)), float(likelihood_point(10.0, 14.0, 4.0, np.e))
    (12.0, 13.0)
    """
    shift = np.asarray(variance * np.log(np.maximum(ratio, np.finfo(float).tiny)))
    distance = np.broadcast_to(comparison - standard, shift.shape)
    away = np.divide(shift, distance, out=np.zeros_like(shift), where=distance != 0.0)
    return decision_point(standard, comparison, 0.5) + away


def side(means: FloatArray) -> FloatArray:
    """Return the side of the standard on which each comparison lies.

    Parameters
    ----------
    means : array (n_repetitions, n_stimuli)
        Mean values, the standard in the first column.

    Returns
    -------
    array (n_stimuli - 1,)
        +1 for a larger mean over all repetitions, else -1, as for latencies.

    Examples
    --------
    >>> side(np.array([[10.0, 12.0, 9.0], [10.0, 9.5, 9.0]])).tolist()
    [1.0, -1.0]
    """
    pooled = means.mean(axis=0)
    return np.where(pooled[1:] < pooled[0], -1.0, 1.0)


def hit_probability(point: FloatArray, mean: FloatArray, spread: FloatArray, side: FloatArray) -> FloatArray:
    """Return the probability that Normal(mean, spread) lies beyond the decision point, step (h).

    Parameters
    ----------
    point, mean, spread, side : arrays that broadcast
        Decision point, the comparison's mean and standard deviation, and the side that counts.

    Returns
    -------
    array
        A distribution without spread lies beyond the point, on it (one half) or before it. [0-1]

    Examples
    --------
    >>> hit_probability(np.array([12.0, 12.0]), np.array([14.0, 14.0]), np.array([2.0, 0.0]), 1.0).round(3)
    array([0.841, 1.   ])
    """
    margin = np.asarray(side * (mean - point))
    scaled = np.divide(margin, spread, out=np.zeros_like(margin), where=spread > 0.0)
    return np.where(spread > 0.0, ndtr(scaled), np.heaviside(margin, 0.5))
