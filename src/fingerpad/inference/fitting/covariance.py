"""Covariance of fitted parameters from the fits of a cross validation."""

from __future__ import annotations

from numpy.typing import ArrayLike

from fingerpad.core.checks import FloatArray, float_array


def jackknife_covariance(estimates: ArrayLike) -> FloatArray | None:
    """Covariance of fitted parameters from fits that each leave out one of g groups of observations.

    With the estimate theta_j without group j and the mean of all of them,

        V = (g - 1)/g sum over j of (theta_j - mean)(theta_j - mean)'.

    It uses no derivatives: rates jump where a spike enters its window, and a fit may end in any of many local
    maxima. A covariance from derivatives at the best fit neglects both and is too small
    (docs/decisions.md#jackknife).

    Parameters
    ----------
    estimates : array_like (g, n_parameters)
        One row per fit.

    Returns
    -------
    array (n_parameters, n_parameters) or None
        None if there are no more groups than parameters: the covariance would be singular.

    Notes
    -----
    R. G. Miller, Biometrika 61 (1974) 1, the delete-a-group jackknife.

    Examples
    --------
    Without one of the numbers 1, 2 and 6 the mean is 4, 3.5 or 1.5. The variance of the mean of all three
    is 7/3, where 7 is their variance.

    >>> float(jackknife_covariance([[4.0], [3.5], [1.5]])[0, 0].round(6))
    2.333333
    """
    rows = float_array("estimates", estimates, 2)
    groups, parameters = rows.shape
    if groups <= parameters:
        return None
    apart = rows - rows.mean(axis=0)
    return (groups - 1) / groups * apart.T @ apart
