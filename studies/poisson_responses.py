"""Spike counts of Poisson processes, and their Fisher information, for the ideal observer.

ln p(r) = sum_i (r_i ln lambda_i - lambda_i - ln r_i!)
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from numpy.typing import ArrayLike
from scipy.special import gammaln, xlogy
from scipy.stats import poisson

from fingerpad.core.checks import FloatArray, IntArray, float_array
from fingerpad.core.errors import InputError
from fingerpad.core.random_streams import Purpose, uniforms


@dataclass(frozen=True)
class PoissonResponses:
    """Spike counts of Poisson processes.

    Parameters
    ----------
    mean_counts : array (n_receptors,)
        lambda, not negative: rates times the length of the window.

    Raises
    ------
    InputError
        If a mean is negative.

    Examples
    --------
    >>> one = PoissonResponses([2.0])
    >>> np.exp(one.log_likelihood(np.array([0.0]))).round(4).tolist()
    0.1353
    """

    mean_counts: FloatArray

    def __post_init__(self) -> None:
        means = float_array("mean_counts", self.mean_counts, 1)
        if (means < 0.0).any():
            raise InputError(f"mean_counts must not be negative: the smallest is {means.min():g}.")
        object.__setattr__(self, "mean_counts", means)

    @property
    def n_receptors(self) -> int:
        """Number of receptors."""
        return self.mean_counts.size

    def log_likelihood(self, responses: FloatArray) -> FloatArray:
        """Logarithm (...,) of the probability of counts (..., n_receptors); -inf for impossible ones."""
        each = xlogy(responses, self.mean_counts) - self.mean_counts - gammaln(responses + 1.0)
        return each.sum(axis=-1)

    def draw(self, seed: int, trials: IntArray) -> FloatArray:
        """Sample counts (n_trials, n_receptors) with the random numbers of these trials."""
        shares = uniforms(seed, trials, self.n_receptors, Purpose.SPIKE_COUNT, 1)[..., 0]
        # A share of exactly 0 would be a count of -1.
        return np.maximum(poisson.ppf(shares, self.mean_counts), 0.0)


def poisson_information(mean_counts: ArrayLike, slopes: ArrayLike) -> float:
    """Fisher information of Poisson spike counts: J = sum_i lambda_i'^2 / lambda_i.

    Parameters
    ----------
    mean_counts : array_like (n_receptors,)
        lambda, positive.
    slopes : array_like (n_receptors,)
        lambda', their derivatives by the stimulus x. [1/unit of x]

    Returns
    -------
    float
        J. [1/unit of x squared]

    Raises
    ------
    InputError
        If sizes differ or a mean is not positive.

    Examples
    --------
    >>> poisson_information([4.0], [2.0])
    1.0
    """
    means, rises = float_array("mean_counts", mean_counts, 1), float_array("slopes", slopes, 1)
    if means.size != rises.size or (means <= 0.0).any():
        raise InputError(
            f"mean_counts must be positive, and slopes be as many: got {rises.size} slopes for {means.size} "
            f"means, the smallest {means.min(initial=np.inf):g}."
        )
    return float((np.square(rises) / means).sum())
