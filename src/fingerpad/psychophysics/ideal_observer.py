"""The ideal observer, the upper bound of every code of the same responses, and the efficiency of a code.

    ln R(r) = ln p(r | comparison) - ln p(r | standard)

By the Neyman-Pearson lemma the ratio R is the best statistic of the responses. Every observer is measured by
the proportion correct of two alternatives: the probability that its statistic is greater for the comparison
than for the standard (the area under the ROC curve), and

    d' = sqrt 2 z(proportion),    efficiency = (d'_code / d'_ideal)^2,

the share of trials that the ideal observer would need for the same performance (Barlow 1962). For small
differences both have a limit in closed form, the Fisher information.

The ideal observer knows the distribution of the responses:

    ln p(r) = -1/2 |L^-1 (r - mu)|^2 - sum ln L_ii - n/2 ln 2 pi,    S = L L^T

The paper's noise multiplies each response by Normal(1, sigma_1): a Gaussian with the standard deviation
sigma_1 mu_i, which depends on the stimulus as well; `Noise` may have an offset r_0.
A noise floor s is added to it where codes are compared with the ideal observer:

    r ~ Normal(mu, sigma_1^2 (mu^2 + r_0^2) + s^2)

Without the floor a receptor that responds weakly or not at all has hardly any noise, and one that begins to
respond identifies the stimulus with certainty (docs/decisions.md#ideal-observer).
"""

from __future__ import annotations

import math
from collections.abc import Callable
from dataclasses import dataclass
from functools import cached_property
from typing import Protocol, runtime_checkable

import numpy as np
from numpy.typing import ArrayLike
from scipy.special import ndtri
from scipy.stats import rankdata

from fingerpad.core.checked import checked, value_class
from fingerpad.core.errors import InputError
from fingerpad.core.random_streams import Purpose, normals
from fingerpad.core.values import (
    FiniteMatrix,
    FiniteVector,
    FloatArray,
    IntArray,
    Matrix,
    NotNegative,
    Several,
    Whole,
    float_array,
    positive,
    vector,
)
from fingerpad.psychophysics.encoding import AnyNoise, Noise, noise_of, session_trials

SMALLEST_SPREAD = 1.0  # Noise floor s. [spikes/s or ms]
EFFICIENCY_TRIALS = 4000  # Presentations of either stimulus behind one efficiency.

LEAST_KNOWN = 10.0
"""Ratio of the ideal observer's d' to its standard error from which on an efficiency is reported."""


@runtime_checkable
class ResponseModel(Protocol):
    """Distribution of the responses of a population to one stimulus."""

    @property
    def n_receptors(self) -> int:
        """Number of receptors."""

    def log_likelihood(self, responses: FloatArray) -> FloatArray:
        """Logarithm (...,) of the probability (density) of responses (..., n_receptors)."""

    def draw(self, seed: int, trials: IntArray) -> FloatArray:
        """Sample responses (n_trials, n_receptors) with the random numbers of these trials."""


@value_class
class GaussianResponses:
    """Normally distributed responses.

    Examples
    --------
    >>> one = GaussianResponses([0.0], [[1.0]])
    >>> one.log_likelihood(np.array([0.0])).round(4).tolist()
    -0.9189
    """

    mean: FiniteVector  #: mu, (n_receptors,). [any unit]
    covariance: FiniteMatrix  #: S, (n_receptors, n_receptors). [unit squared]

    def __post_init__(self) -> None:
        mean, covariance = self.mean, self.covariance
        if covariance.shape != (mean.size, mean.size):
            wanted = "must have one row and column per receptor"
            raise InputError("covariance", wanted, f"{covariance.shape} for {mean.size}")
        if np.abs(covariance - covariance.T).max(initial=0.0) > 1e-9 * np.abs(covariance).max(initial=0.0):
            raise InputError("covariance", "must be symmetric", remedy="the two halves differ")
        self.factor  # noqa: B018

    @cached_property
    def factor(self) -> FloatArray:
        """L, the lower factor of the covariance, S = L L^T."""
        try:
            return np.asarray(np.linalg.cholesky(self.covariance), dtype=np.float64)
        except np.linalg.LinAlgError as error:
            raise InputError(
                "covariance", "must be positive definite", remedy="a receptor has no noise, or two share it"
            ) from error

    @property
    def n_receptors(self) -> int:
        """Number of receptors."""
        return self.mean.size

    def log_likelihood(self, responses: FloatArray) -> FloatArray:
        """Logarithm (...,) of the probability density of responses (..., n_receptors)."""
        # L^-1 (r - mu) has independent standard normal entries.
        whitened = np.linalg.solve(self.factor, (responses - self.mean)[..., np.newaxis])[..., 0]
        distance = np.square(whitened).sum(axis=-1)
        volume = np.log(np.diagonal(self.factor)).sum() + 0.5 * self.n_receptors * np.log(2.0 * np.pi)
        return -0.5 * distance - volume

    def draw(self, seed: Whole, trials: IntArray) -> FloatArray:
        """Sample responses (n_trials, n_receptors) with the random numbers of these trials."""
        draws = normals(seed, trials, self.n_receptors, Purpose.RESPONSE, 1)[..., 0]
        return self.mean + draws @ self.factor.T


@checked
def multiplied_responses(
    responses: ArrayLike, noise: AnyNoise, smallest_spread: NotNegative = 0.0
) -> GaussianResponses:
    """Return responses under noise, such as the paper's: each multiplied by its own Normal(1, sigma_1).

    Parameters
    ----------
    responses : array_like (n_receptors,)
        Without noise. [any unit]
    noise : float or Noise
        Standard deviation sigma_1 of noise that multiplies, above 0, or another `Noise`.
    smallest_spread : float, optional
        Standard deviation of further noise that does not depend on the response. [unit of `responses`]

    Raises
    ------
    InputError
        If a receptor is silent and no further noise is given: it would discriminate the stimulus with
        certainty from any that makes it fire.

    Examples
    --------
    >>> multiplied_responses([10.0, 20.0], 0.1).covariance.round(6).tolist()
    [[1.0, 0.0], [0.0, 4.0]]
    """
    values = float_array("responses", responses, 1)
    spread = _some_noise(noise).spread(values)
    if smallest_spread == 0.0 and (spread == 0.0).any():
        raise InputError(
            f"{np.count_nonzero(spread == 0.0)} of {values.size} receptors are silent, so multiplicative "
            "noise has no effect on them: leave out receptors that no stimulus excites, or give "
            "smallest_spread."
        )
    return GaussianResponses(values, np.diag(np.square(spread) + smallest_spread**2))


def _some_noise(noise: float | Noise) -> Noise:
    """Return a noise if there is any: without it the ideal observer never fails."""
    found = noise_of("noise", noise)
    positive("noise", found.sigma)
    return found


Statistic = Callable[[FloatArray], FloatArray]
"""From responses (n_trials, n_receptors) to the statistic of an observer (n_trials,)."""


@dataclass(frozen=True)
class Discriminability:
    """Discriminability of two stimuli, in trials of two alternatives."""

    proportion_correct: float  #: Area under the ROC curve. [0-1]
    standard_error: float  #: Of that, from the number of trials.
    d_prime: float  #: sqrt 2 z(proportion); inf if every trial is correct. [standard deviations]
    d_prime_error: float  #: Its standard error.


@checked
def discriminability(standard: ArrayLike, comparison: ArrayLike) -> Discriminability:
    """Compare the values of an observer's statistic for two stimuli, all pairs.

    Parameters
    ----------
    standard, comparison : array_like (n_trials,)
        Values of the statistic; larger ones favour the comparison, ties count half.

    Returns
    -------
    Discriminability
        The standard error is that of DeLong, DeLong & Clarke-Pearson 1988.

    Examples
    --------
    >>> discriminability([1.0, 2.0, 3.0, 4.0], [2.5, 3.5, 4.5, 5.5]).proportion_correct
    0.8125
    """
    first, second = vector("standard", standard), vector("comparison", comparison)
    n, m = first.size, second.size
    if min(n, m) < 2 or np.isnan(first).any() or np.isnan(second).any():
        raise InputError(f"Two numbers or more are needed for each stimulus, none NaN: got {n} and {m}.")
    ranks = rankdata(np.concatenate([first, second]))
    # Share of the other stimulus's values that each value exceeds.
    above = (ranks[n:] - rankdata(second)) / n
    below = 1.0 - (ranks[:n] - rankdata(first)) / m
    area = float(above.mean())
    error = math.sqrt(above.var(ddof=1) / m + below.var(ddof=1) / n)
    d_prime = math.sqrt(2.0) * float(ndtri(area))
    slope = math.exp(-0.25 * d_prime**2) / math.sqrt(2.0 * math.pi) / math.sqrt(2.0)
    return Discriminability(area, error, d_prime, error / slope if slope > 0.0 else math.inf)


@dataclass(frozen=True)
class Presentation:
    """Responses of a population to two stimuli, trial by trial, shared by all observers of a comparison."""

    standard: FloatArray
    comparison: FloatArray
    """Responses, (n_trials, n_receptors). [any unit]"""
    log_ratio_standard: FloatArray
    log_ratio_comparison: FloatArray
    """ln R of these responses, (n_trials,)."""
    seed: int  #: Of the random numbers.

    def ideal(self) -> Discriminability:
        """Discriminability by the ideal observer."""
        return discriminability(self.log_ratio_standard, self.log_ratio_comparison)

    def ideal_hit_rate(self) -> float:
        """Probability that the ideal observer identifies a single presentation of the comparison. [0-1]

        It identifies the comparison where ln R > 0; ties count half.
        """
        return float(np.heaviside(self.log_ratio_comparison, 0.5).mean())

    def of(self, statistic: Statistic) -> Discriminability:
        """Discriminability by an observer who uses a statistic and knows its sign."""
        first, second = statistic(self.standard), statistic(self.comparison)
        sign = -1.0 if second.mean() < first.mean() else 1.0
        return discriminability(sign * first, sign * second)


@checked
def present(
    standard: ResponseModel,
    comparison: ResponseModel,
    seed: Whole,
    n_trials: Several = 4000,
    session: Whole = 0,
) -> Presentation:
    """Simulate responses to two stimuli, with the log likelihood ratio of the ideal observer.

    Parameters
    ----------
    standard, comparison : ResponseModel
        Distributions of the responses: `GaussianResponses` or another model.
    seed : int
        Of the random numbers, keyed by trial and receptor.
    n_trials : int, optional
        Presentations of each stimulus.
    session : int, optional
        Sessions of one seed share no random number.

    Examples
    --------
    >>> from fingerpad.psychophysics.ideal_observer import multiplied_responses
    >>> one, other = (multiplied_responses([50.0, rate], 0.1) for rate in (60.0, 70.0))
    >>> shown = present(one, other, seed=1)
    >>> shown.ideal().d_prime > shown.of(lambda responses: responses.sum(axis=1)).d_prime
    True
    """
    if standard.n_receptors != comparison.n_receptors:
        got = f"{standard.n_receptors} and {comparison.n_receptors}"
        raise InputError(f"standard and comparison must have the same receptors: got {got}.")
    trials = session_trials(session, 2, n_trials)
    first, second = standard.draw(seed, trials[0]), comparison.draw(seed, trials[1])
    # One likelihood may be -inf, but not both: the responses come from one of the models.
    ratios = [comparison.log_likelihood(each) - standard.log_likelihood(each) for each in (first, second)]
    return Presentation(first, second, ratios[0], ratios[1], seed)


@checked
def efficiency(code: Discriminability, ideal: Discriminability) -> tuple[float, float]:
    """Return (d'_code / d'_ideal)^2 and its standard error.

    Parameters
    ----------
    code, ideal : Discriminability
        Of a code and of the ideal observer, for the same stimuli.

    Returns
    -------
    (float, float)
        The error assumes independence; with the same trials it is an upper bound. Both are NaN where the
        ideal observer is always correct, or its d' is below `LEAST_KNOWN` standard errors.

    Examples
    --------
    Of two afferents one changes its rate. The Gradient Sum also contains the noise of the other:

    >>> (shown,) = noisy_presentations([[50.0, 50.0], [50.0, 53.0]], 0.1, seed=1)
    >>> code = shown.of(lambda responses: np.abs(responses[:, 1] - responses[:, 0]))
    >>> efficiency(code, shown.ideal())[0] < 0.6
    True
    """
    # Equal stimuli have a d' of 0 without any error.
    if not max(0.0, LEAST_KNOWN * ideal.d_prime_error) <= ideal.d_prime < math.inf or ideal.d_prime == 0.0:
        return math.nan, math.nan
    share = (code.d_prime / ideal.d_prime) ** 2
    relative = math.hypot(
        code.d_prime_error / code.d_prime if code.d_prime else 0.0, ideal.d_prime_error / ideal.d_prime
    )
    return share, 2.0 * share * relative


@checked
def gaussian_information(
    responses: ArrayLike, slopes: ArrayLike, noise: AnyNoise, smallest_spread: NotNegative = 0.0
) -> float:
    """Fisher information J with noise, the limit of the ideal observer. [1/unit of x squared]

        V_i = sigma_1^2 (mu_i^2 + r_0^2) + s^2
        J = sum_i mu_i'^2 / V_i + 2 (sigma_1^2 mu_i mu_i' / V_i)^2,    d' -> dx sqrt J,  dx > 0

    The second term is the information in the variance, which depends on the mean. Without a noise floor s,
    J = sum_i (mu_i' / mu_i)^2 (1 / sigma_1^2 + 2).

    Parameters
    ----------
    responses : array_like (n_receptors,)
        mu, not zero unless there is a noise floor. [any unit]
    slopes : array_like (n_receptors,)
        mu', their derivatives by the stimulus x. [that unit per unit of x]
    noise : float or Noise
        Standard deviation sigma_1 of noise that multiplies, above 0, or another `Noise`.
    smallest_spread : float, optional
        Noise floor s. [unit of `responses`]

    Examples
    --------
    >>> round(gaussian_information([10.0], [1.0], 0.1), 6)
    1.02
    >>> gaussian_information([0.0], [1.0], 0.1, smallest_spread=2.0)
    0.25
    """
    values, rises = float_array("responses", responses, 1), float_array("slopes", slopes, 1)
    found = _some_noise(noise)
    spread = found.spread(values)
    zeros = np.count_nonzero(spread == 0.0) if smallest_spread == 0.0 else 0
    if values.size != rises.size or zeros:
        raise InputError(
            "responses",
            "must not be zero, and slopes be as many",
            f"{rises.size} slopes for {values.size} responses, {zeros} of them zero",
            "leave those out or give smallest_spread",
        )
    variance = np.square(spread) + smallest_spread**2
    of_variance = 2.0 * np.square(found.sigma**2 * values * rises / variance)
    return float((np.square(rises) / variance + of_variance).sum())


@checked
def noisy_presentations(
    table: Matrix, noise: AnyNoise, seed: Whole, session: Whole = 0
) -> list[Presentation]:
    """Draw responses to the standard and to each comparison.

    Parameters
    ----------
    table : array (n_stimuli, n_receptors)
        One measure of every receptor without noise, the standard first. [spikes/s or ms]
    noise : float or Noise
        Standard deviation sigma_1 of noise that multiplies, above 0, or another `Noise`.
    seed, session : int
        Of the random numbers.
    """
    standard, *comparisons = (multiplied_responses(row, noise, SMALLEST_SPREAD) for row in table)
    return [present(standard, comparison, seed, EFFICIENCY_TRIALS, session) for comparison in comparisons]
