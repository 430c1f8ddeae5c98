"""The ideal observer, whom no way of reading the same responses can beat, and how near to it a code comes.

    ln R(r) = ln p(r | comparison) - ln p(r | standard)

By the lemma of Neyman and Pearson the ratio R is the best of all statistics of the responses. Every observer
is measured by the same yardstick, the proportion correct of two alternatives: how often its statistic is
greater for the comparison than for the standard (the area under its curve of hits against false alarms), and

    d' = sqrt 2 z(proportion),    efficiency = (d'_code / d'_ideal)^2,

the share of trials that the ideal observer would need to judge as well (Barlow 1962). For stimuli that differ
little both have a limit in closed form, Fisher's information.
"""

from __future__ import annotations

import math
from collections.abc import Callable
from dataclasses import dataclass

import numpy as np
from numpy.typing import ArrayLike
from scipy.special import ndtri
from scipy.stats import rankdata

from fingerpad.core.checks import FloatArray, float_array, positive, whole
from fingerpad.core.errors import InputError
from fingerpad.psychophysics.noisy_responses import session_trials
from fingerpad.psychophysics.response_models import ResponseModel

Statistic = Callable[[FloatArray], FloatArray]
"""From responses (n_trials, n_receptors) to what an observer makes of them (n_trials,)."""


@dataclass(frozen=True)
class Discriminability:
    """How well two stimuli are told apart, in trials of two alternatives.

    Parameters
    ----------
    proportion_correct : float
        Area under the curve of hits against false alarms. [0-1]
    standard_error : float
        Of that, from the number of trials.
    d_prime : float
        sqrt 2 z(proportion); inf where no trial was failed. [standard deviations]
    d_prime_error : float
        Its standard error.
    """

    proportion_correct: float
    standard_error: float
    d_prime: float
    d_prime_error: float


def discriminability(standard: ArrayLike, comparison: ArrayLike) -> Discriminability:
    """Compare an observer's answers to two stimuli, each with each.

    Parameters
    ----------
    standard, comparison : array_like (n_trials,)
        What a statistic says to either; larger ones speak for the comparison, equal ones count half.

    Returns
    -------
    Discriminability
        The standard error is that of DeLong, DeLong & Clarke-Pearson 1988.

    Raises
    ------
    InputError
        If there are fewer than two answers to a stimulus.

    Examples
    --------
    >>> discriminability([1.0, 2.0, 3.0, 4.0], [2.5, 3.5, 4.5, 5.5]).proportion_correct
    0.8125
    """
    first, second = np.asarray(standard, dtype=np.float64), np.asarray(comparison, dtype=np.float64)
    n, m = first.size, second.size
    if min(n, m) < 2 or np.isnan(first).any() or np.isnan(second).any():
        raise InputError(f"Two numbers or more are needed for each stimulus, none NaN: got {n} and {m}.")
    ranks = rankdata(np.concatenate([first, second]))
    # Share of the other stimulus's answers that each one exceeds.
    above = (ranks[n:] - rankdata(second)) / n
    below = 1.0 - (ranks[:n] - rankdata(first)) / m
    area = float(above.mean())
    error = math.sqrt(above.var(ddof=1) / m + below.var(ddof=1) / n)
    d_prime = math.sqrt(2.0) * float(ndtri(area))
    slope = math.exp(-0.25 * d_prime**2) / math.sqrt(2.0 * math.pi) / math.sqrt(2.0)
    return Discriminability(area, error, d_prime, error / slope if slope > 0.0 else math.inf)


@dataclass(frozen=True)
class Presentation:
    """Responses of a population to two stimuli, trial by trial: what all observers of a comparison share.

    Parameters
    ----------
    standard, comparison : array (n_trials, n_receptors)
        Responses. [any unit]
    log_ratio_standard, log_ratio_comparison : array (n_trials,)
        The ideal observer's ln R of them.
    seed : int
        Of the random numbers.
    """

    standard: FloatArray
    comparison: FloatArray
    log_ratio_standard: FloatArray
    log_ratio_comparison: FloatArray
    seed: int

    def ideal(self) -> Discriminability:
        """How well the ideal observer does."""
        return discriminability(self.log_ratio_standard, self.log_ratio_comparison)

    def ideal_hit_rate(self) -> float:
        """How often the ideal observer knows the comparison for what it is, from one look. [0-1]

        Right by more than chance where ln R > 0; a tie is decided by a coin.
        """
        return float(np.heaviside(self.log_ratio_comparison, 0.5).mean())

    def of(self, statistic: Statistic) -> Discriminability:
        """How well an observer does who looks at a statistic, and knows on which side the comparison lies."""
        first, second = statistic(self.standard), statistic(self.comparison)
        sign = -1.0 if second.mean() < first.mean() else 1.0
        return discriminability(sign * first, sign * second)


def present(
    standard: ResponseModel, comparison: ResponseModel, seed: int, n_trials: int = 4000, session: int = 0
) -> Presentation:
    """Draw responses to two stimuli, and what the ideal observer makes of them.

    Parameters
    ----------
    standard, comparison : ResponseModel
        How responses to either are distributed: `GaussianResponses`, `PoissonResponses`, or one's own.
    seed : int
        Of the random numbers, keyed by trial and receptor.
    n_trials : int, optional
        Presentations of each stimulus.
    session : int, optional
        Sessions of one seed have no number in common.

    Returns
    -------
    Presentation

    Raises
    ------
    InputError
        If the stimuli have not the same receptors, or fewer than two trials are wanted.

    Examples
    --------
    >>> from fingerpad.psychophysics.response_models import multiplied_responses
    >>> one, other = (multiplied_responses([50.0, rate], 0.1) for rate in (60.0, 70.0))
    >>> shown = present(one, other, seed=1)
    >>> shown.ideal().d_prime > shown.of(lambda responses: responses.sum(axis=1)).d_prime
    True
    """
    if standard.n_receptors != comparison.n_receptors:
        raise InputError(
            "standard and comparison must have the same receptors: "
            f"got {standard.n_receptors} and {comparison.n_receptors}."
        )
    trials = session_trials(session, 2, whole("n_trials", n_trials, 2))
    first, second = standard.draw(seed, trials[0]), comparison.draw(seed, trials[1])
    ratios = [_log_ratio(standard, comparison, responses) for responses in (first, second)]
    return Presentation(first, second, ratios[0], ratios[1], seed)


def _log_ratio(standard: ResponseModel, comparison: ResponseModel, responses: FloatArray) -> FloatArray:
    # Either may be impossible, -inf, but not both: one of them drew the responses.
    return comparison.log_likelihood(responses) - standard.log_likelihood(responses)


def efficiency(code: Discriminability, ideal: Discriminability) -> tuple[float, float]:
    """Return (d'_code / d'_ideal)^2 and its standard error.

    Parameters
    ----------
    code, ideal : Discriminability
        Of a code and of the ideal observer, for the same stimuli.

    Returns
    -------
    (float, float)
        The error takes the two as independent, which is more than it is where they saw the same trials.

    Raises
    ------
    InputError
        If the ideal observer guesses or never fails: stimuli must differ, and not too much.

    Examples
    --------
    >>> half, ideal = Discriminability(0.69, 0.0, 0.7, 0.0), Discriminability(0.76, 0.0, 1.0, 0.0)
    >>> round(efficiency(half, ideal)[0], 2)
    0.49
    """
    if not 0.0 < ideal.d_prime < math.inf:
        raise InputError(
            f"The ideal observer is right in {ideal.proportion_correct:.4f} of the trials, which tells no "
            "efficiency: choose stimuli that differ, and not too much."
        )
    share = (code.d_prime / ideal.d_prime) ** 2
    relative = math.hypot(
        code.d_prime_error / code.d_prime if code.d_prime else 0.0, ideal.d_prime_error / ideal.d_prime
    )
    return share, 2.0 * share * relative


def gaussian_information(responses: ArrayLike, slopes: ArrayLike, noise_sigma: float) -> float:
    """Fisher's information of responses under the paper's noise: the ideal observer's limit.

        J = sum_i (mu_i' / mu_i)^2 (1 / sigma_1^2 + 2),    d' -> |dx| sqrt J

    The 2 is what the spread tells, which follows the mean.

    Parameters
    ----------
    responses : array_like (n_receptors,)
        mu, not zero. [any unit]
    slopes : array_like (n_receptors,)
        mu', their derivatives by the stimulus x. [that unit per unit of x]
    noise_sigma : float
        Standard deviation sigma_1 of the multiplicative noise.

    Returns
    -------
    float
        J. [1/unit of x squared]

    Raises
    ------
    InputError
        If sizes differ, a response is zero or the noise is not positive.

    Examples
    --------
    >>> round(gaussian_information([10.0], [1.0], 0.1), 6)
    1.02
    """
    values, rises = float_array("responses", responses, 1), float_array("slopes", slopes, 1)
    if values.size != rises.size or (values == 0.0).any():
        raise InputError(
            f"responses must not be zero, and slopes be as many: got {rises.size} slopes for {values.size} "
            f"responses, {np.count_nonzero(values == 0.0)} of them zero."
        )
    return float(np.square(rises / values).sum() * (positive("noise_sigma", noise_sigma) ** -2 + 2.0))


def poisson_information(mean_counts: ArrayLike, slopes: ArrayLike) -> float:
    """Fisher's information of Poisson spike counts: J = sum_i lambda_i'^2 / lambda_i.

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
