"""How well fitted parameters are determined: slopes of the residuals, and the covariance that follows."""

from __future__ import annotations

from collections.abc import Callable

import numpy as np
from numpy.typing import ArrayLike

from fingerpad.checks import FloatArray, float_array
from fingerpad.errors import InputError
from fingerpad.fitting.response_surface import factorial_design

MOST_UNEVEN = 1.0e6
"""Scaled slopes of a larger condition number leave a direction of the parameters undetermined."""


def mean_slopes(
    values: Callable[[FloatArray], FloatArray], parameters: ArrayLike, steps: ArrayLike
) -> FloatArray:
    """Slopes of several values over a box about the parameters, by regression on a factorial design.

    A firing rate jumps where a spike enters its window, so that a difference of two near points may be any
    number. The mean over all corners of a box that is wider than the jumps are apart is not.

    Parameters
    ----------
    values : callable
        `values(parameters)` returns an array (n_values,).
    parameters, steps : array_like (n_parameters,)
        The middle of the box and half of its sides.

    Returns
    -------
    array (n_values, n_parameters)
        Change of each value per unit of each parameter.

    Raises
    ------
    InputError
        If a step is not positive or there is not one per parameter.

    Examples
    --------
    >>> mean_slopes(lambda p: np.array([2.0 * p[0] - p[1], p[0] * p[1]]), [1.0, 3.0], [0.5, 0.5]).tolist()
    [[2.0, -1.0], [3.0, 1.0]]
    """
    centre, sides = float_array("parameters", parameters, 1), float_array("steps", steps, 1)
    if sides.shape != centre.shape or (sides <= 0.0).any():
        raise InputError(f"steps must be above 0, one per parameter: got {sides.tolist()}.")
    corners = factorial_design(centre.size)[:-1]
    found = np.array([values(centre + corner * sides) for corner in corners])
    return (found.T @ corners) / len(corners) / sides


def sandwich_covariance(slopes: ArrayLike, residuals: ArrayLike) -> FloatArray | None:
    """Covariance of least-squares parameters that does not take all residuals for equally large.

    With the slopes J of the residuals r at the optimum, n residuals and p parameters,

        V = n / (n - p) (J'J)^-1 J' diag(r^2) J (J'J)^-1.

    Parameters
    ----------
    slopes : array_like (n, p)
        J, see `mean_slopes`.
    residuals : array_like (n,)
        r.

    Returns
    -------
    array (p, p) or None
        None if the observations leave a direction of the parameters undetermined, or are no more than they.

    Raises
    ------
    InputError
        If shapes disagree.

    Notes
    -----
    H. White, Econometrica 48 (1980) 817: consistent whatever the variances are, which matters where the
    rates of two phases with weights of their own are fitted at once. The factor n / (n - p) makes it
    unbiased where they are equal and all observations weigh the same.

    Examples
    --------
    The mean of three numbers, whose residuals have a sum of squares of 2: 3/2 of 2 / 3^2.

    >>> float(sandwich_covariance([[-1.0], [-1.0], [-1.0]], [-1.0, 0.0, 1.0])[0, 0].round(6))
    0.333333
    """
    j, r = float_array("slopes", slopes, 2), float_array("residuals", residuals, 1)
    n, p = j.shape
    if r.size != n:
        raise InputError(f"slopes needs one row per residual: got {n} for {r.size}.")
    # Parameters have their own units: the directions are compared with each column brought to length 1.
    lengths = np.linalg.norm(j, axis=0)
    if n <= p or (lengths == 0.0).any() or np.linalg.cond(j / lengths) > MOST_UNEVEN:
        return None
    pseudoinverse = np.linalg.pinv(j / lengths) / lengths[:, None]
    return n / (n - p) * (pseudoinverse * r**2) @ pseudoinverse.T
