"""Convergence of MCMC: split R-hat, autocorrelation and effective sample size.

The walkers of one ensemble are not independent chains, but the ensembles are. R-hat therefore compares halves
of ensembles, and the autocorrelation is that of the mean of an ensemble over the steps, which includes the
correlation between its walkers.
"""

from __future__ import annotations

import numpy as np
from scipy.special import ndtri
from scipy.stats import rankdata

from fingerpad.core.checks import FloatArray
from fingerpad.core.errors import InputError

TAILS = (0.025, 0.975)
"""Quantiles of the effective sample size of the tails: the ends of a 95 % interval."""


def split_r_hat(draws: FloatArray) -> float:
    """Return split R-hat: 1 if the halves of all ensembles have the same distribution, else larger.

    Notes
    -----
    R-hat = sqrt(((n - 1)/n W + B)/W) with W the mean variance within halves of n draws, and B the variance
    of their means, both of rank-normalised draws (Vehtari, Gelman, Simpson, Carpenter & Bürkner 2021).
    """
    values = _checked(draws)
    distances = np.abs(values - np.median(values))
    return max(_r_hat(_normal_scores(values)), _r_hat(_normal_scores(distances)))


def effective_size(draws: FloatArray) -> float:
    """Return the effective sample size of the mean.

    Notes
    -----
    The series of each ensemble is the mean of its walkers. The variance of the mean of such series is
    var (1 + 2 sum rho_t)/(n_ensembles n_steps). The sum of autocorrelations is truncated at the first pair
    that is not positive, and pairs are made monotone (Geyer 1992).
    """
    values = _checked(draws)
    variance = float(values.var())
    if variance == 0.0:
        return float(values.size)
    series = values.mean(axis=2)
    n_ensembles, n_steps = series.shape
    correlations, spread = _autocorrelations(series)
    pairs = correlations[: n_steps // 2 * 2].reshape(-1, 2).sum(axis=1)
    positive = int(np.argmax(pairs <= 0.0)) if (pairs <= 0.0).any() else pairs.size
    # An estimate above that of independent draws, as for antithetic chains, is not reliable.
    time = max(2.0 * float(np.minimum.accumulate(pairs[:positive]).sum()) - 1.0, 1.0 / values.shape[2])
    variance_of_mean = spread * time / (n_ensembles * n_steps)
    return float(min(variance / variance_of_mean, values.size))


def effective_sizes(draws: FloatArray) -> tuple[float, float]:
    """Return the effective sample sizes of the centre and of the tails.

    Notes
    -----
    Vehtari, Gelman, Simpson, Carpenter & Bürkner 2021.
    """
    values = _checked(draws)
    tails = (values <= end for end in np.quantile(values, TAILS))
    return effective_size(_normal_scores(values)), min(effective_size(1.0 * tail) for tail in tails)


def _checked(draws: FloatArray) -> FloatArray:
    values = np.asarray(draws, dtype=np.float64)
    if values.ndim != 3 or values.shape[0] < 2 or values.shape[1] < 4:
        raise InputError(
            "draws must be of at least 2 ensembles and 4 steps, (n_ensembles, n_steps, n_walkers): "
            f"got shape {values.shape}."
        )
    return values


def _normal_scores(values: FloatArray) -> FloatArray:
    ranks = rankdata(values, axis=None).reshape(values.shape)
    return ndtri((ranks - 0.375) / (values.size + 0.25))


def _r_hat(values: FloatArray) -> float:
    half = values.shape[1] // 2
    chains = np.concatenate([values[:, :half], values[:, -half:]]).reshape(2 * values.shape[0], -1)
    n = chains.shape[1]
    within = float(chains.var(axis=1, ddof=1).mean())
    if within == 0.0:
        return 1.0 if float(np.ptp(chains)) == 0.0 else float("inf")
    between = float(chains.mean(axis=1).var(ddof=1))
    return float(np.sqrt(((n - 1) / n * within + between) / within))


def _autocorrelations(series: FloatArray) -> tuple[FloatArray, float]:
    """Autocorrelations of several series of one distribution, (n_steps,), and their variance."""
    # Differences between the means of the series count as correlation at all lags.
    n_series, n_steps = series.shape
    centred = series - series.mean(axis=1, keepdims=True)
    spectrum = np.abs(np.fft.rfft(centred, 2 * n_steps, axis=1)) ** 2
    covariances = np.fft.irfft(spectrum, axis=1)[:, :n_steps].mean(axis=0) / n_steps
    within = covariances[0] * n_steps / (n_steps - 1)
    spread = float(covariances[0] + series.mean(axis=1).var(ddof=1)) if n_series > 1 else float(within)
    correlations = 1.0 - (within - covariances) / spread
    correlations[0] = 1.0
    return correlations, spread
