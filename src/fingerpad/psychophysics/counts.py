"""Counts of judgements at each level of a stimulus, and their probability under a psychometric function.

    P(k | n, p)      = C(n, k) p^k (1 - p)^(n - k)                      binomial
    P(k | n, p, rho) = C(n, k) B(k + p v, n - k + (1 - p) v) / B(p v, (1 - p) v),    v = (1 - rho) / rho

The beta-binomial distribution is for correlated judgements. Any two judgements of one level have the
correlation rho, and the variance of their count is larger by the factor 1 + (n - 1) rho.
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from numpy.typing import ArrayLike
from scipy.special import betaln, gammaln, xlog1py, xlogy
from scipy.stats import binomtest

from fingerpad.core.checks import FloatArray, float_array
from fingerpad.core.errors import InputError
from fingerpad.core.values import converted

SMALLEST_OVERDISPERSION = 1e-5
"""Below it the beta-binomial formula loses precision and the binomial one is used."""


LARGEST_LEVEL = 1e9
"""Largest level of a stimulus; the fit loses its digits with far larger numbers."""


@dataclass(frozen=True)
@converted
class JudgementCounts:
    """Numbers of judgements at each level that were correct, or "yes".

    Parameters
    ----------
    levels : array (n_levels,)
        Increasing. [any unit]
    n_correct, n_trials : array (n_levels,)
        Whole numbers.

    Examples
    --------
    >>> JudgementCounts([296.0, 365.0], [58, 95], [100, 100]).proportion.tolist()
    [0.58, 0.95]
    """

    levels: FloatArray
    n_correct: FloatArray
    n_trials: FloatArray

    def __post_init__(self) -> None:
        levels = float_array("levels", self.levels, 1)
        correct = float_array("n_correct", self.n_correct, 1)
        trials = float_array("n_trials", self.n_trials, 1)
        if not levels.size == correct.size == trials.size or levels.size == 0:
            raise InputError(
                "levels, n_correct and n_trials must have one entry per level: "
                f"got {levels.size}, {correct.size} and {trials.size}."
            )
        if np.abs(levels).max() > LARGEST_LEVEL:
            raise InputError(
                f"levels must lie within {LARGEST_LEVEL:g}: got {levels.tolist()}; change the unit."
            )
        if (np.diff(levels) <= 0.0).any():
            raise InputError(f"levels must increase strictly, each level once: got {levels.tolist()}.")
        if (correct != np.floor(correct)).any() or (trials != np.floor(trials)).any():
            raise InputError("n_correct and n_trials must be whole numbers: multiply rates by their trials.")
        if (trials < 1.0).any() or (correct < 0.0).any() or (correct > trials).any():
            raise InputError(
                "n_trials must be at least 1 and n_correct within 0 ... n_trials: "
                f"got {correct.tolist()} of {trials.tolist()}."
            )
        for name, values in (("levels", levels), ("n_correct", correct), ("n_trials", trials)):
            object.__setattr__(self, name, values)

    @property
    def proportion(self) -> FloatArray:
        """n_correct / n_trials."""
        return self.n_correct / self.n_trials


def log_probability(
    n_correct: ArrayLike, n_trials: ArrayLike, proportion: ArrayLike, overdispersion: ArrayLike = 0.0
) -> FloatArray:
    """Logarithm of the probability of a count; all arguments broadcast."""
    k, n = np.asarray(n_correct, dtype=np.float64), np.asarray(n_trials, dtype=np.float64)
    p, rho = np.asarray(proportion, dtype=np.float64), np.asarray(overdispersion, dtype=np.float64)
    ways = gammaln(n + 1.0) - gammaln(k + 1.0) - gammaln(n - k + 1.0)
    if not (rho >= SMALLEST_OVERDISPERSION).any():
        return ways + xlogy(k, p) + xlog1py(n - k, -p)
    v = (1.0 - rho) / np.maximum(rho, SMALLEST_OVERDISPERSION)
    # Both arguments of the beta function must be positive, so 0 and 1 are replaced by close values.
    inside = np.clip(p, _NEARLY_NEVER, 1.0 - _NEARLY_NEVER)
    return ways + betaln(k + inside * v, n - k + (1.0 - inside) * v) - betaln(inside * v, (1.0 - inside) * v)


_NEARLY_NEVER = 1e-12


def binomial_interval(
    proportion: ArrayLike, trials: int, confidence: float = 0.95
) -> tuple[FloatArray, FloatArray]:
    """Exact confidence interval of a probability, given an observed proportion (Clopper & Pearson 1934)."""
    successes = np.rint(np.asarray(proportion, dtype=np.float64) * trials).astype(np.int64)
    intervals = [binomtest(int(count), trials).proportion_ci(confidence) for count in successes.ravel()]
    low, high = np.moveaxis(np.reshape(intervals, (*successes.shape, 2)), -1, 0)
    return low, high
