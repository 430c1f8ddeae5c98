"""Cross validation: fit five sixths of the observations, score the rest (paper, section 2.2.2)."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from numpy.typing import ArrayLike

from fingerpad.core.checked import checked
from fingerpad.core.errors import InputError
from fingerpad.core.values import FloatArray, IntArray, Several, float_array
from fingerpad.data import protocol
from fingerpad.inference.fitting.methods import Fit, Method, Problem


def fractional_sum_of_squares(observed: ArrayLike, predicted: ArrayLike) -> float:
    """Fractional sum of squares, FSS (Eqs. 13, 14).

    FSS = 1 - sum (observed - predicted)^2 / sum observed^2. It is 1 for a perfect prediction, 0 for predicted
    rates of 0, and has no lower limit. R2 differs: it refers to the mean of the observations instead of 0.
    """
    observed_rate = float_array("observed", observed, 1)
    predicted_rate = float_array("predicted", predicted, 1)
    if observed_rate.shape != predicted_rate.shape:
        raise InputError(
            f"observed and predicted must match: got {observed_rate.size} and {predicted_rate.size} values."
        )
    observed_squares = float(observed_rate @ observed_rate)
    if observed_squares == 0.0:
        raise InputError(
            "observed", "must hold at least one value other than 0", remedy="FSS divides by its squares"
        )
    residual = observed_rate - predicted_rate
    return 1.0 - float(residual @ residual) / observed_squares


@dataclass(frozen=True)
class FoldFit:
    """Result of one fold."""

    fold: int
    fit: Fit
    score_test: float  # Score of its parameters on the observations left out.
    training: IntArray
    testing: IntArray  # Observations used for fitting, and those left out, (n_training,).

    @property
    def score_train(self) -> float:
        return self.fit.score


@dataclass(frozen=True)
class CrossValidation:
    """Results of all folds."""

    folds: tuple[FoldFit, ...]  # In the order of their numbers.

    @property
    def score_train(self) -> float:
        """Mean training score of the folds."""
        return float(np.mean([fold.score_train for fold in self.folds]))

    @property
    def score_test(self) -> float:
        """Mean testing score of the folds, the estimate of performance out of sample."""
        return float(np.mean([fold.score_test for fold in self.folds]))


@checked
def interleaved_folds(n_observations: Several, n_folds: Several | None = None) -> IntArray:
    """Assign observations to folds in turn; by default to six, or one each where there are fewer."""
    folds = min(int(protocol.FOLDS.value), n_observations) if n_folds is None else n_folds
    if folds > n_observations:
        raise InputError("n_folds", f"must be at most the number of stimuli, {n_observations}", str(folds))
    return np.arange(n_observations, dtype=np.int64) % folds


def cross_validate(problem: Problem, method: Method, memberships: ArrayLike) -> CrossValidation:
    """Fit without the observations of each fold, and score the result on them.

    Gerling et al. 2014, section 2.2.2.
    """
    folds = _checked_memberships(memberships, problem.n_observations)

    def fold_fit(fold: int) -> FoldFit:
        training, testing = np.flatnonzero(folds != fold), np.flatnonzero(folds == fold)
        fit = method.fit(problem, training)
        return FoldFit(fold, fit, float(problem.score(fit.parameters, testing)), training, testing)

    return CrossValidation(tuple(fold_fit(fold) for fold in range(int(folds.max()) + 1)))


def _checked_memberships(memberships: ArrayLike, n_observations: int) -> IntArray:
    given = float_array("memberships", memberships, 1)
    if given.size != n_observations:
        raise InputError(
            "memberships", "needs one fold per observation", f"{given.size} for {n_observations}"
        )
    folds = given.astype(np.int64)
    present = np.unique(folds)
    if (folds != given).any() or present.size < 2 or not np.array_equal(present, np.arange(present.size)):
        raise InputError(
            "memberships",
            "must number at least two folds from 0 on without a gap",
            str(np.unique(given).tolist()),
        )
    return folds


def jackknife_covariance(estimates: ArrayLike) -> FloatArray | None:
    """Covariance of fitted parameters from fits that each leave out one of g groups of observations.

    With the estimate theta_j without group j and the mean of all of them,

        V = (g - 1)/g sum over j of (theta_j - mean)(theta_j - mean)'.

    It uses no derivatives: rates jump where a spike enters its window, and a fit may end in any of many local
    maxima. A covariance from derivatives at the best fit neglects both and is too small
    (docs/decisions.md#jackknife).

    R. G. Miller, Biometrika 61 (1974) 1, the delete-a-group jackknife.
    """
    rows = float_array("estimates", estimates, 2)
    groups, parameters = rows.shape
    if groups <= parameters:
        return None
    apart = rows - rows.mean(axis=0)
    return (groups - 1) / groups * apart.T @ apart
