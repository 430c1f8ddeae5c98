"""Goodness of fit of a psychometric function: its deviance compared with data simulated from it.

    D = 2 sum_i [ln P(k_i | k_i / n_i) - ln P(k_i | psi(x_i))]

With many trials D has a chi-square distribution; with the trials of an experiment it has not. Its
distribution is therefore simulated: counts from the fit are fitted again (Wichmann & Hill 2001).
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from fingerpad.core.checks import FloatArray
from fingerpad.psychophysics.counts import log_probability
from fingerpad.psychophysics.maximum_likelihood import OVERDISPERSION, maximise_likelihood
from fingerpad.psychophysics.psychometric import PsychometricFit
from fingerpad.psychophysics.uncertainty import drawn_counts


@dataclass(frozen=True)
class GoodnessOfFit:
    """Deviance of a fit, and its p-value from simulated data.

    Parameters
    ----------
    deviance : float
        D of the observed counts; about the number of levels minus the fitted parameters for a good fit.
    p_value : float
        Share of the simulated data sets with at least that deviance; a small one rejects the function. [0-1]
    residuals : array (n_levels,)
        Root of each level's share of D, with the sign of observed minus predicted.
    drawn_deviances : array (n_replicates,)
        Of the simulated data sets.
    seed : int
        Of the random numbers.
    """

    deviance: float
    p_value: float
    residuals: FloatArray
    drawn_deviances: FloatArray
    seed: int


def goodness_of_fit(fit: PsychometricFit, seed: int, n_replicates: int = 1000) -> GoodnessOfFit:
    """Compare the deviance of a fit with those of data simulated from it.

    Parameters
    ----------
    fit : PsychometricFit
        The fit to test.
    seed : int
        Of the random numbers; keyed by replicate and level.
    n_replicates : int, optional
        Number of simulated data sets.

    Raises
    ------
    ConvergenceError
        If a replicate cannot be fitted.

    Examples
    --------
    >>> from fingerpad.psychophysics.psychometric import fit_psychometric
    >>> good = fit_psychometric([1, 2, 3, 4, 5], [52, 60, 76, 91, 98], [100] * 5, lapse=0.0)
    >>> bad = fit_psychometric([1, 2, 3, 4, 5], [52, 90, 60, 99, 80], [100] * 5, lapse=0.0)
    >>> goodness_of_fit(good, 1, 200).p_value > 0.05 > goodness_of_fit(bad, 1, 200).p_value
    True
    """
    drawn = drawn_counts(fit, seed, n_replicates)
    points, heights = maximise_likelihood(fit.model, drawn)
    rho = points[:, OVERDISPERSION, None] if fit.overdispersion > 0.0 else 0.0
    perfect = log_probability(drawn, fit.counts.n_trials, drawn / fit.counts.n_trials, rho).sum(axis=1)
    deviances = 2.0 * (perfect - heights)
    # The observed set counts as one of the sets, so p is never 0.
    p_value = (1.0 + np.count_nonzero(deviances >= fit.deviance)) / (1.0 + n_replicates)
    return GoodnessOfFit(fit.deviance, float(p_value), _residuals(fit), deviances, seed)


def _residuals(fit: PsychometricFit) -> FloatArray:
    counts = fit.counts
    expected = fit.predict(counts.levels)
    of_perfect = log_probability(counts.n_correct, counts.n_trials, counts.proportion, fit.overdispersion)
    of_fit = log_probability(counts.n_correct, counts.n_trials, expected, fit.overdispersion)
    return np.sign(counts.proportion - expected) * np.sqrt(2.0 * np.maximum(of_perfect - of_fit, 0.0))
