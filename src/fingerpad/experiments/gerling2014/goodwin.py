"""Hit rates of people with Goodwin's spheres: two points, their uncertainty, and the line through them."""

from __future__ import annotations

from collections.abc import Callable, Sequence

import numpy as np
from numpy.typing import ArrayLike
from scipy.special import ndtr, ndtri

from fingerpad.core.checks import FloatArray
from fingerpad.core.results import Vector, result_class
from fingerpad.data import psychophysics
from fingerpad.psychophysics.functions import binomial_interval
from fingerpad.psychophysics.noise_fit import NoiseFit, fit_noise_sigma

CURVATURES = psychophysics.GOODWIN_CURVATURES.value
HIT_RATES = psychophysics.GOODWIN_HIT_RATES.value
TRIALS = int(psychophysics.GOODWIN_TRIALS.value)

SMALLEST_NOISE, LARGEST_NOISE = 1e-4, 2.0
"""Bounds of the noise fitted to the observed hit rates."""


@result_class
class GoodwinHitRates:
    """Hit rates of people."""

    curvature_per_m: Vector  # Comparison spheres, (2,). [1/m]
    hit_rate: Vector
    trials: int  # Trials behind each fraction (assumed).
    low: Vector
    high: Vector  # Observed fractions and their binomial 95 % intervals, (2,). [0-1]
    line: Vector
    """Hit rates at the spheres of the study on the line that is straight in z, (n_comparisons,). [0-1]"""


def line_in_z(curvature_per_m: ArrayLike) -> FloatArray:
    """Hit rates on the straight line in z that Goodwin's two points define."""
    (near, far), (z_near, z_far) = CURVATURES, ndtri(HIT_RATES)
    slope_m = (z_far - z_near) / (far - near)
    return ndtr(z_near + slope_m * (np.asarray(curvature_per_m, dtype=np.float64) - near))


def goodwin_hit_rates_at(curvature_per_m: ArrayLike) -> GoodwinHitRates:
    """Observed hit rates of people, and the line at the comparison spheres."""
    low, high = binomial_interval(HIT_RATES, TRIALS)
    return GoodwinHitRates(
        curvature_per_m=np.array(CURVATURES),
        hit_rate=np.array(HIT_RATES),
        trials=TRIALS,
        low=low,
        high=high,
        line=line_in_z(curvature_per_m),
    )


def goodwin_columns(curvature_per_m: Sequence[float]) -> list[int]:
    """Find Goodwin's two spheres among the comparisons."""
    return [list(curvature_per_m).index(curvature) - 1 for curvature in CURVATURES]


def goodwin_misfit(hit_rates: FloatArray, axis: int | tuple[int, ...] | None = None) -> FloatArray:
    """Root mean square distance of hit rates to people's."""
    return np.sqrt(np.square(hit_rates - np.array(HIT_RATES)).mean(axis=axis))


def fit_noise_to_goodwin(
    hit_rates: Callable[[float], FloatArray], curvature_per_m: Sequence[float], n_positions: int
) -> NoiseFit:
    """Fit one noise to Goodwin's two points at all positions of the spheres."""
    columns = goodwin_columns(curvature_per_m)
    return fit_noise_sigma(
        lambda sigma: hit_rates(sigma)[:, columns].ravel(),
        np.tile(HIT_RATES, n_positions),
        (SMALLEST_NOISE, LARGEST_NOISE),
    )
