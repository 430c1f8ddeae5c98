"""Goodness of fit between observed and predicted firing rates (paper, Eqs. 13-14)."""

from __future__ import annotations

from numpy.typing import ArrayLike

from fingerpad.core.checks import float_array
from fingerpad.core.errors import InputError


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
