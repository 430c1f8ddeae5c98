"""Cross validation: fit on five sixths of the observations, judge on the rest (paper, section 2.2.2)."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass

import numpy as np
from numpy.typing import ArrayLike, NDArray

from fingerpad.checks import FloatArray, float_array, whole
from fingerpad.errors import InputError
from fingerpad.fitting.response_surface import Iteration, ResponseSurfaceFit, maximise
from fingerpad.parameters import protocol

IntArray = NDArray[np.int64]
Score = Callable[[FloatArray, IntArray], float]


@dataclass(frozen=True)
class FoldFit:
    """Result of one fold.

    Parameters
    ----------
    fold : int
        Number of the fold, from 0.
    start : int
        Which start point led to the better training score; the first one of equals.
    parameters : array (n_parameters,)
        Fitted on the training set.
    fss_train, fss_test : float
        Score of `parameters` on the observations used for fitting, and on those left out.
    history : tuple of Iteration
        The climb from the chosen start point.
    fits : tuple of ResponseSurfaceFit
        The climbs from all start points, in their order.
    testing : int array (n_testing,)
        Observations that were left out.
    """

    fold: int
    start: int
    parameters: FloatArray
    fss_train: float
    fss_test: float
    history: tuple[Iteration, ...]
    fits: tuple[ResponseSurfaceFit, ...]
    testing: IntArray


@dataclass(frozen=True)
class CrossValidation:
    """Results of all folds.

    Parameters
    ----------
    folds : tuple of FoldFit
        In the order of their numbers.
    """

    folds: tuple[FoldFit, ...]

    @property
    def fss_train(self) -> float:
        """Mean training score of the folds."""
        return float(np.mean([fold.fss_train for fold in self.folds]))

    @property
    def fss_test(self) -> float:
        """Mean testing score of the folds, the estimate of performance out of sample."""
        return float(np.mean([fold.fss_test for fold in self.folds]))


def interleaved_folds(n_observations: int, n_folds: int = int(protocol.FOLDS.value)) -> IntArray:
    """Fold of each observation, dealt out in turn: index modulo the number of folds.

    Parameters
    ----------
    n_observations, n_folds : int
        The first must not be smaller than the second.

    Returns
    -------
    int array (n_observations,)

    Examples
    --------
    >>> interleaved_folds(8, 3).tolist()
    [0, 1, 2, 0, 1, 2, 0, 1]
    """
    whole("n_folds", n_folds, at_least=2)
    whole("n_observations", n_observations, at_least=n_folds)
    return np.arange(n_observations, dtype=np.int64) % n_folds


def cross_validate(
    score: Score,
    starts: ArrayLike,
    increments: ArrayLike,
    memberships: ArrayLike,
    lower_bounds: ArrayLike | None = None,
    smallest_gain: float = 1.0e-4,
    most_iterations: int = 200,
) -> CrossValidation:
    """Fit every fold from every start point; the better training score of a fold is judged on its test set.

    Parameters
    ----------
    score : callable
        `score(parameters, observations)`: goodness of fit over the observations with these indices.
    starts : array (n_starts, n_parameters)
        Start points of every fold.
    increments : array (n_parameters,) or (n_starts, n_parameters)
        One coded unit of each parameter, for all start points or for each.
    memberships : int array (n_observations,)
        Fold of each observation, 0 ... n_folds - 1, none empty; `interleaved_folds` deals them out.
    lower_bounds, smallest_gain, most_iterations
        As in `maximise`.

    Returns
    -------
    CrossValidation

    Raises
    ------
    InputError
        If shapes disagree or a fold is empty.
    ConvergenceError
        If a climb does not end.

    Notes
    -----
    Gerling et al. 2014, section 2.2.2. Nothing is random: the same input gives the same bits.

    Examples
    --------
    >>> observed = np.array([1.0, 2.0, 3.0, 4.0])
    >>> def score(slope, chosen):
    ...     return -float(((observed - slope * [1, 2, 3, 4])[chosen] ** 2).sum())
    >>> result = cross_validate(score, [[0.5], [2.0]], [0.01], interleaved_folds(4, 2))
    >>> [round(float(fold.parameters[0]), 1) for fold in result.folds]
    [1.0, 1.0]
    """
    points = float_array("starts", starts, 2)
    units = np.asarray(increments, dtype=np.float64)
    if units.shape not in (points.shape, points.shape[1:]):
        raise InputError(f"increments must match starts {points.shape} or one row of it: got {units.shape}.")
    units = np.broadcast_to(units, points.shape)
    folds = _checked_memberships(memberships)

    def fold_fit(fold: int) -> FoldFit:
        training, testing = np.flatnonzero(folds != fold), np.flatnonzero(folds == fold)
        fits = tuple(
            maximise(
                lambda parameters: score(parameters, training),
                start,
                increment,
                lower_bounds,
                smallest_gain,
                most_iterations,
            )
            for start, increment in zip(points, units, strict=True)
        )
        best = int(np.argmax([fit.objective for fit in fits]))
        chosen = fits[best]
        return FoldFit(
            fold=fold,
            start=best,
            parameters=chosen.parameters,
            fss_train=chosen.objective,
            fss_test=float(score(chosen.parameters, testing)),
            history=chosen.history,
            fits=fits,
            testing=testing,
        )

    return CrossValidation(tuple(fold_fit(fold) for fold in range(int(folds.max()) + 1)))


def _checked_memberships(memberships: ArrayLike) -> IntArray:
    given = float_array("memberships", memberships, 1)
    folds = given.astype(np.int64)
    present = np.unique(folds)
    if (folds != given).any() or present.size < 2 or not np.array_equal(present, np.arange(present.size)):
        raise InputError(
            "memberships must number at least two folds from 0 on without a gap: "
            f"got {np.unique(given).tolist()}."
        )
    return folds
