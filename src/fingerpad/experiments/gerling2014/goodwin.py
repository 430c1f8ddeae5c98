"""What people did with Goodwin's spheres: two hit rates, how sure they are, and the line through them."""

from __future__ import annotations

from typing import Any

import numpy as np
from numpy.typing import ArrayLike
from scipy.special import ndtr, ndtri

from fingerpad.core.checks import FloatArray
from fingerpad.data import psychophysics
from fingerpad.psychophysics.counts import binomial_interval

CURVATURES = psychophysics.GOODWIN_CURVATURES.value
HIT_RATES = psychophysics.GOODWIN_HIT_RATES.value
TRIALS = int(psychophysics.GOODWIN_TRIALS.value)


def line_in_z(curvature_per_m: ArrayLike) -> FloatArray:
    """Hit rates on the straight line in z that Goodwin's two points define.

    Parameters
    ----------
    curvature_per_m : array_like
        Curvatures of comparison spheres. [1/m]

    Returns
    -------
    array
        Hit rates; z is the standard normal quantile. [0-1]

    Examples
    --------
    >>> line_in_z([287.0, 296.0, 365.0]).round(3).tolist()
    [0.505, 0.58, 0.95]
    """
    (near, far), (z_near, z_far) = CURVATURES, ndtri(HIT_RATES)
    slope_m = (z_far - z_near) / (far - near)
    return ndtr(z_near + slope_m * (np.asarray(curvature_per_m, dtype=np.float64) - near))


def observed(curvature_per_m: ArrayLike) -> dict[str, Any]:
    """Gather what is known of people, and the line at the spheres that are compared.

    Parameters
    ----------
    curvature_per_m : array_like
        Comparison spheres of the study. [1/m]

    Returns
    -------
    dict
        `curvature_per_m`, `hit_rate`, `trials`, `low` and `high` of the two points, and `line`.
    """
    low, high = binomial_interval(HIT_RATES, TRIALS)
    return {
        "curvature_per_m": CURVATURES,
        "hit_rate": HIT_RATES,
        "trials": TRIALS,
        "low": low,
        "high": high,
        "line": line_in_z(curvature_per_m),
    }
