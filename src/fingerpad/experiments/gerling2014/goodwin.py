"""What people did with Goodwin's spheres: two hit rates, how sure they are, and the line through them."""

from __future__ import annotations

from typing import Any

import numpy as np
from numpy.typing import ArrayLike
from scipy.special import ndtr, ndtri
from scipy.stats import beta

from fingerpad.core.checks import FloatArray
from fingerpad.data import psychophysics

CURVATURES = psychophysics.GOODWIN_CURVATURES.value
HIT_RATES = psychophysics.GOODWIN_HIT_RATES.value
TRIALS = int(psychophysics.GOODWIN_TRIALS.value)
CONFIDENCE = 0.95


def binomial_interval(
    hit_rate: ArrayLike, trials: int = TRIALS, confidence: float = CONFIDENCE
) -> tuple[FloatArray, FloatArray]:
    """Bound the chance of success behind an observed fraction (Clopper & Pearson 1934).

    Parameters
    ----------
    hit_rate : array_like
        Observed fractions. [0-1]
    trials : int, optional
        Trials behind each of them.
    confidence : float, optional
        How often such an interval holds the truth, at least.

    Returns
    -------
    (array, array)
        Lower and upper bound. [0-1]

    Examples
    --------
    None of three fails: the lower bound is where three successes have a chance of 2.5 %.

    >>> low, high = binomial_interval(1.0, trials=3)
    >>> round(float(low) ** 3, 6), float(high)
    (0.025, 1.0)
    """
    hits = np.asarray(hit_rate, dtype=np.float64) * trials
    misses, tail = trials - hits, 0.5 * (1.0 - confidence)
    # Quantiles of the beta distribution; at no hit or no miss the bound is 0 or 1 itself.
    low = np.where(hits > 0.0, beta.ppf(tail, np.maximum(hits, 1e-9), misses + 1.0), 0.0)
    high = np.where(misses > 0.0, beta.ppf(1.0 - tail, hits + 1.0, np.maximum(misses, 1e-9)), 1.0)
    return low, high


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
    low, high = binomial_interval(HIT_RATES)
    return {
        "curvature_per_m": CURVATURES,
        "hit_rate": HIT_RATES,
        "trials": TRIALS,
        "low": low,
        "high": high,
        "line": line_in_z(curvature_per_m),
    }
