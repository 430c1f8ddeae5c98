"""Calibration of a posterior: where true parameters lie among the draws, in many synthetic experiments.

If parameters come from the prior and data from the likelihood, the share of draws below the truth is uniform,
and an interval contains the truth as often as its level says (Talts et al. 2018). Truths that were computed
without the emulator test its error, too.
"""

from __future__ import annotations

from collections.abc import Callable, Iterable
from typing import TypeVar

import numpy as np
from scipy.stats import binomtest

from fingerpad.core.checks import FloatArray
from fingerpad.core.errors import InputError
from fingerpad.core.results import Matrix, result_class

LEVELS = (0.5, 0.95)
"""Intervals whose coverage is told. [0-1]"""

SIGNIFICANT = 0.01
"""Probability below which a coverage counts as wrong, shared by all parameters."""

Truth = TypeVar("Truth")


@result_class
class Calibration:
    """Shares of draws below the truth.

    Parameters
    ----------
    names : tuple of str
        Of the parameters.
    shares_below : array (n_replicates, n_parameters)
        Share of the draws below the true value. [0-1]
    """

    names: tuple[str, ...]
    shares_below: Matrix

    def inside(self, level: float) -> FloatArray:
        """Share of the replicates whose central interval contains the truth, by parameter. [0-1]

        Examples
        --------
        >>> found = Calibration(names=("a",), shares_below=[[0.1], [0.5], [0.99], [0.3]])
        >>> found.inside(0.5).tolist(), found.inside(0.95).tolist()
        ([0.5], [0.75])
        """
        return np.asarray((np.abs(self.shares_below - 0.5) <= 0.5 * level).mean(axis=0))

    def wrong(self) -> tuple[str, ...]:
        """Parameters whose coverage is not that of the level, by a binomial test with Bonferroni's bound.

        Examples
        --------
        >>> ends = np.tile([[0.001], [0.999]], (10, 1))
        >>> Calibration(names=("too narrow",), shares_below=ends).wrong()
        ('too narrow',)
        """
        n = len(self.shares_below)
        limit = SIGNIFICANT / (len(self.names) * len(LEVELS))
        smallest = [
            min(
                binomtest(round(inside * n), n, level).pvalue
                for inside, level in zip(both, LEVELS, strict=True)
            )
            for both in np.transpose([self.inside(level) for level in LEVELS])
        ]
        return tuple(name for name, p in zip(self.names, smallest, strict=True) if p < limit)


def calibrate(
    names: tuple[str, ...],
    replicates: Iterable[Truth],
    draws_of: Callable[[Truth], tuple[FloatArray, FloatArray]],
) -> Calibration:
    """Repeat an experiment with known parameters.

    Parameters
    ----------
    names : tuple of str
        Of the parameters.
    replicates : iterable
        What each experiment needs.
    draws_of : callable
        From one of them to its true parameters (n_parameters,) and posterior draws (n_draws, n_parameters).

    Returns
    -------
    Calibration

    Raises
    ------
    InputError
        If there is no replicate, or truth and draws are not one number per name.

    Examples
    --------
    >>> random = np.random.default_rng(1)
    >>> def once(truth):
    ...     return np.array([truth]), random.normal(truth + random.normal(), 1.0, (400, 1))
    >>> calibrate(("mean",), np.zeros(100), once).wrong()
    ()
    """
    shares = []
    for replicate in replicates:
        truth, draws = draws_of(replicate)
        if truth.shape != (len(names),) or draws.shape[1:] != truth.shape:
            raise InputError(
                f"draws_of must return {len(names)} true parameters and draws of them: "
                f"got {truth.shape} and {draws.shape}."
            )
        shares.append((draws < truth).mean(axis=0))
    if not shares:
        raise InputError("replicates must hold at least one experiment: got none.")
    return Calibration(names=names, shares_below=np.array(shares))
