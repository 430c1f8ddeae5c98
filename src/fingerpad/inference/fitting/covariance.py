"""How well fitted parameters are determined, from the fits that a cross validation makes anyway."""

from __future__ import annotations

from numpy.typing import ArrayLike

from fingerpad.core.checks import FloatArray, float_array


def jackknife_covariance(estimates: ArrayLike) -> FloatArray | None:
    """Covariance of fitted parameters, from fits that each leave one of g groups of observations out.

    With the estimate theta_j without group j and the mean of all of them,

        V = (g - 1)/g sum over j of (theta_j - mean)(theta_j - mean)'.

    Nothing is differentiated: rates jump where a spike enters its window, and a fit may end in any of many
    lumps. Slopes at the best fit see neither and promise too much (docs/decisions/jackknife.md).

    Parameters
    ----------
    estimates : array_like (g, n_parameters)
        One row per fit.

    Returns
    -------
    array (n_parameters, n_parameters) or None
        None if there are no more groups than parameters: the scatter then has no width in some direction.

    Notes
    -----
    R. G. Miller, Biometrika 61 (1974) 1, the delete-a-group jackknife.

    Examples
    --------
    The mean of 1, 2 and 6, which left out one by one leave means of 4, 3.5 and 1.5. Their mean varies by
    7/3, with 7 the variance of the three numbers.

    >>> float(jackknife_covariance([[4.0], [3.5], [1.5]])[0, 0].round(6))
    2.333333
    """
    rows = float_array("estimates", estimates, 2)
    groups, parameters = rows.shape
    if groups <= parameters:
        return None
    apart = rows - rows.mean(axis=0)
    return (groups - 1) / groups * apart.T @ apart
