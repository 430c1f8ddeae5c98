"""Distributions of the responses of a population, which the ideal observer knows.

    ln p(r) = -1/2 |L^-1 (r - mu)|^2 - sum ln L_ii - n/2 ln 2 pi,    S = L L^T

The paper's noise multiplies each response by Normal(1, sigma_1): a Gaussian with the standard deviation
sigma_1 mu_i, which depends on the stimulus as well.
"""

from __future__ import annotations

from dataclasses import dataclass
from functools import cached_property
from typing import Protocol

import numpy as np
from numpy.typing import ArrayLike

from fingerpad.core.checks import FloatArray, IntArray, float_array, not_negative
from fingerpad.core.errors import InputError
from fingerpad.core.random_streams import Purpose, normals
from fingerpad.core.values import converted
from fingerpad.psychophysics.noisy_responses import checked_noise


class ResponseModel(Protocol):
    """Distribution of the responses of a population to one stimulus."""

    @property
    def n_receptors(self) -> int:
        """Number of receptors."""
        ...

    def log_likelihood(self, responses: FloatArray) -> FloatArray:
        """Logarithm (...,) of the probability (density) of responses (..., n_receptors)."""
        ...

    def draw(self, seed: int, trials: IntArray) -> FloatArray:
        """Sample responses (n_trials, n_receptors) with the random numbers of these trials."""
        ...


@dataclass(frozen=True)
@converted
class GaussianResponses:
    """Normally distributed responses.

    Parameters
    ----------
    mean : array (n_receptors,)
        mu. [any unit]
    covariance : array (n_receptors, n_receptors)
        S. [unit squared]

    Examples
    --------
    >>> one = GaussianResponses([0.0], [[1.0]])
    >>> one.log_likelihood(np.array([0.0])).round(4).tolist()
    -0.9189
    """

    mean: FloatArray
    covariance: FloatArray

    def __post_init__(self) -> None:
        mean, covariance = float_array("mean", self.mean, 1), float_array("covariance", self.covariance, 2)
        if covariance.shape != (mean.size, mean.size):
            raise InputError(
                f"covariance must have one row and column per receptor: got {covariance.shape} for "
                f"{mean.size}."
            )
        if np.abs(covariance - covariance.T).max(initial=0.0) > 1e-9 * np.abs(covariance).max(initial=0.0):
            raise InputError("covariance must be symmetric: the two halves differ.")
        object.__setattr__(self, "mean", mean)
        object.__setattr__(self, "covariance", covariance)
        self.factor  # noqa: B018

    @cached_property
    def factor(self) -> FloatArray:
        """L, the lower factor of the covariance, S = L L^T."""
        try:
            return np.asarray(np.linalg.cholesky(self.covariance), dtype=np.float64)
        except np.linalg.LinAlgError as error:
            raise InputError(
                "covariance must be positive definite: a receptor has no noise, or two share it."
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

    def draw(self, seed: int, trials: IntArray) -> FloatArray:
        """Sample responses (n_trials, n_receptors) with the random numbers of these trials."""
        draws = normals(seed, trials, self.n_receptors, Purpose.RESPONSE, 1)[..., 0]
        return self.mean + draws @ self.factor.T


def multiplied_responses(
    responses: ArrayLike, noise_sigma: float, smallest_spread: float = 0.0
) -> GaussianResponses:
    """Return responses under the paper's noise: each multiplied by its own Normal(1, sigma_1).

    Parameters
    ----------
    responses : array_like (n_receptors,)
        Without noise. [any unit]
    noise_sigma : float
        Standard deviation sigma_1.
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
    sigma = checked_noise(noise_sigma, above_zero=True)
    floor = not_negative("smallest_spread", smallest_spread)
    if floor == 0.0 and (values == 0.0).any():
        raise InputError(
            f"{np.count_nonzero(values == 0.0)} of {values.size} receptors are silent, so multiplicative "
            "noise has no effect on them: leave out receptors that no stimulus excites, or give "
            "smallest_spread."
        )
    return GaussianResponses(values, np.diag(np.square(sigma * values) + floor**2))
