"""Noise of the observer: expected hit rates, and the noise that fits observed hit rates."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass

import numpy as np
from numpy.typing import ArrayLike
from scipy.optimize import minimize_scalar
from scipy.special import ndtr

from fingerpad.core.checked import checked
from fingerpad.core.errors import ConvergenceError, InputError
from fingerpad.core.values import Finite, FloatArray, float_array, positive
from fingerpad.data import psychophysics
from fingerpad.psychophysics.discrimination import (
    checked_responses,
    decision_point,
    hit_probability,
    moments,
    side,
)
from fingerpad.psychophysics.encoding import check_neighbours
from fingerpad.psychophysics.noisy_responses import checked_noise, shared_noise_gradient_sums

NOISE_DRAWS = 4000  # Common random presentations in the fit of the noise; its sampling error is one per cent.

_NOISE_SCAN = 33


@dataclass(frozen=True)
class NoiseFit:
    """Noise for which predicted hit rates are closest to observed ones."""

    noise_sigma: float  # Standard deviation sigma_1 of the multiplicative noise.
    hit_rates: FloatArray  # Predicted hit rates at that noise, (n_targets,). [0-1]
    root_mean_square_error: float  # Of the predicted against the observed hit rates.


@checked
def expected_hit_rates(
    responses: ArrayLike,
    neighbours: ArrayLike,
    noise_sigma: Finite,
    standard_normals: ArrayLike,
    criterion: Finite = psychophysics.DECISION_CRITERION.value,
    silent_value: Finite | None = None,
) -> FloatArray:
    """Predict the mean hit rates of `discriminate_gradient_sum` without repeating the experiment.

    The same standard normal samples are used for every sphere and every noise, so the result is a smooth
    function of `noise_sigma`, as `fit_noise_sigma` needs.
    """
    values = checked_responses(responses, silent_value)
    draws = float_array("standard_normals", standard_normals, 2)
    if draws.shape[1] != values.shape[1] or len(draws) < 2:
        raise InputError(
            "standard_normals",
            f"needs two rows or more and {values.shape[1]} columns, one per receptor",
            f"shape {draws.shape}",
        )
    pairs = check_neighbours(neighbours, values.shape[1])
    sums = shared_noise_gradient_sums(values, pairs, checked_noise(noise_sigma), draws)
    means, spreads = moments(sums)
    point = decision_point(means[0], means[1:], criterion)
    return hit_probability(point, means[1:], spreads[1:], side(means[np.newaxis]))


@checked
def expected_euclidean_hit_rates(
    responses: ArrayLike,
    noise_sigma: Finite,
    criterion: Finite = psychophysics.DECISION_CRITERION.value,
    silent_value: Finite | None = None,
) -> FloatArray:
    """Predict the mean hit rates of `discriminate_euclidean`, city-block, in closed form.

    For one receptor the difference of two noisy responses a and b is normal, and its absolute value has

        m = s sqrt(2/pi) exp(-d^2 / 2 s^2) + d (1 - 2 Phi(-d/s)),    v = d^2 + s^2 - m^2,
        d = b - a,    s = sigma_1 sqrt(a^2 + b^2)

    as mean and variance (the folded normal distribution). Receptors are independent, so both add up, and
    so do the third central moments,

        E|b - a|^3 - 3 m (d^2 + s^2) + 2 m^3.

    The sum over a population is close to normal but skewed, by 0.4 with the paper's 18 receptors. The first
    term of Edgeworth's series, g (z^2 - 1) phi(z) / 6 with the skewness g, corrects for it: without it hit
    rates near chance would be 0.02 too high.
    """
    values = checked_responses(responses, silent_value)
    sigma = checked_noise(noise_sigma, above_zero=True)
    d = np.abs(values - values[0])
    s = np.maximum(sigma * np.hypot(values, values[0]), np.finfo(float).tiny)  # both silent: no difference
    x = d / s
    tail, centre = np.sqrt(2.0 / np.pi) * np.exp(-0.5 * np.square(x)), 1.0 - 2.0 * ndtr(-x)
    m, second = s * (tail + x * centre), np.square(d) + np.square(s)
    third = s**3 * ((2.0 + x**2) * tail + (3.0 * x + x**3) * centre) - 3.0 * m * second + 2.0 * m**3
    means, spreads = m.sum(axis=1), np.sqrt((second - np.square(m)).sum(axis=1))
    larger = side(means[np.newaxis])
    point = decision_point(means[0], means[1:], criterion)
    normal = hit_probability(point, means[1:], spreads[1:], larger)
    z = (means[1:] - point) / np.maximum(spreads[1:], np.finfo(float).tiny)
    skewness = third.sum(axis=1)[1:] / np.maximum(spreads[1:] ** 3, np.finfo(float).tiny)
    edgeworth = skewness / 6.0 * (np.square(z) - 1.0) * np.exp(-0.5 * np.square(z)) / np.sqrt(2.0 * np.pi)
    return np.clip(normal + larger * edgeworth, 0.0, 1.0)


def fit_noise_sigma(
    hit_rates_of_sigma: Callable[[float], ArrayLike],
    target_hit_rates: ArrayLike = psychophysics.GOODWIN_HIT_RATES.value,
    bounds: tuple[float, float] = (1e-3, 1.0),
) -> NoiseFit:
    """Fit the noise so that predicted hit rates are closest to observed ones, in least squares.

    The interval between the bounds is scanned on a logarithmic grid and the best cell is refined. This is
    robust at very small and very large noise, where hit rates are constant. It uses no random number.
    """
    targets = float_array("target_hit_rates", target_hit_rates, 1)
    smallest, largest = (positive("bounds", bound) for bound in bounds)
    if smallest >= largest:
        raise InputError("bounds", "must be a smaller and a larger noise", repr(bounds))

    def predict(sigma: float) -> FloatArray:
        rates = float_array("hit rates of hit_rates_of_sigma", hit_rates_of_sigma(sigma), 1)
        if rates.shape != targets.shape:
            raise InputError("hit_rates_of_sigma", f"must give {targets.size} hit rates", str(rates.size))
        return rates

    def misfit(log_sigma: float) -> float:
        return float(np.square(predict(float(np.exp(log_sigma))) - targets).sum())

    grid = np.linspace(np.log(smallest), np.log(largest), _NOISE_SCAN)
    best = int(np.argmin([misfit(log_sigma) for log_sigma in grid]))
    if best in (0, _NOISE_SCAN - 1):
        raise ConvergenceError(
            f"No noise within {smallest:g} ... {largest:g} meets the hit rates {targets.tolist()}: "
            f"the best lies on the bound {np.exp(grid[best]):g}; widen the bounds or check the responses."
        )
    refined = minimize_scalar(
        misfit, bounds=(grid[best - 1], grid[best + 1]), method="bounded", options={"xatol": 1e-9}
    )
    sigma = float(np.exp(refined.x))
    rates = predict(sigma)
    return NoiseFit(sigma, rates, float(np.sqrt(np.mean(np.square(rates - targets)))))
