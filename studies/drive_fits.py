"""A thorough fit and information criteria for the comparison of drives."""

from __future__ import annotations

from dataclasses import dataclass, replace

import numpy as np

from fingerpad.core.checks import IntArray
from fingerpad.experiments.gerling2014.drive_fits import RELATIVE_NAMES, quick_method
from fingerpad.inference.fitting.covariance_adaptation import CovarianceAdaptation
from fingerpad.inference.fitting.methods import Fit, Method, best_of
from fingerpad.inference.fitting.problem import Problem


@dataclass(frozen=True)
class BestOf:
    """Several methods on the same observations, the best score kept: no quantity depends on one's luck.

    Parameters
    ----------
    methods : tuple of Method
        All are tried.
    name : str
        What tables call them together.
    """

    methods: tuple[Method, ...]
    name: str

    def fit(self, problem: Problem, chosen: IntArray) -> Fit:
        """Fit by every method."""
        return best_of(tuple(method.fit(problem, chosen) for method in self.methods))


def thorough_method(seed: int, n_added: int = 0) -> Method:
    """Return the better of least squares from four points and an evolution strategy.

    Parameters
    ----------
    seed : int
        Of the evolution strategy.
    n_added : int, optional
        Numbers of a model besides the four relative ones.

    Returns
    -------
    Method
    """
    quick = quick_method(n_added)
    start = np.zeros(len(RELATIVE_NAMES) + n_added)
    return BestOf(
        (
            replace(quick, n_refined=4),
            CovarianceAdaptation(start, np.ones(start.size), most_evaluations=800, seed=seed),
        ),
        "least squares and CMA-ES, the better",
    )


def information(fss: float, n_rates: int, n_parameters: int) -> dict[str, float]:
    """Akaike's and the Bayesian information criterion of a least-squares fit; smaller is better.

    With normal residuals whose variances stand in the ratio that the weights of FSS imply, and one unknown
    scale, -2 ln L = n ln(1 - FSS) + constant, so that

        AIC = n ln(1 - FSS) + 2 k,    BIC = n ln(1 - FSS) + k ln n.

    Parameters
    ----------
    fss : float
        In sample.
    n_rates : int
        Observed rates, n.
    n_parameters : int
        Free numbers that firing can tell, k.

    Returns
    -------
    dict
        "aic" and "bic", to be compared among fits to the same rates.

    Examples
    --------
    >>> one, two = information(0.9, 72, 4), information(0.9, 72, 5)
    >>> two["aic"] - one["aic"], round(two["bic"] - one["bic"], 2)
    (2.0, 4.28)
    """
    misfit = n_rates * float(np.log1p(-fss))
    return {"aic": misfit + 2.0 * n_parameters, "bic": misfit + n_parameters * float(np.log(n_rates))}
