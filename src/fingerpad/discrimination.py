"""Noise, decision, hit rate: how often one sphere is told from another (paper, section 2.2.3, Figure 3).

Letters in brackets are the steps of Figure 3. Readings where the paper is silent:

- Noise multiplies every response by Normal(1, sigma_1), anew for each receptor and presentation.
- The observer decides at the point a fraction beta of the way from the standard's mean to the
  comparison's; a hit is an answer beyond it, on the comparison's side.
- Which side that is, is the observer's lasting knowledge: the sign of the difference of the means over
  all repetitions. Measures that fall with curvature (latencies) are read like those that rise, and equal
  spheres are told apart in half of the trials, not more.
"""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass

import numpy as np
from numpy.typing import ArrayLike
from scipy.optimize import minimize_scalar
from scipy.special import ndtr

from fingerpad.checks import FloatArray, finite, float_array, not_negative, one_of, positive, whole
from fingerpad.encoding import NORMS, check_neighbours, distance, gradient_sum
from fingerpad.errors import ConvergenceError, InputError
from fingerpad.parameters import protocol, psychophysics
from fingerpad.signals import HitRates

END_OF_STIMULUS_MS = protocol.RAMP.value + protocol.HOLD.value
"""A usual stand-in for the latency of a receptor that stays silent. [ms]"""

_REPETITIONS = int(psychophysics.REPETITIONS.value)
_REPETITIONS_VARIED = int(psychophysics.REPETITIONS_VARIED_CRITERION.value)
_NOISE_SCAN = 33


@dataclass(frozen=True)
class Experiment:
    """How often everything is repeated, and where the observer decides.

    Parameters
    ----------
    presentations : int
        Noisy presentations of each sphere: gradient sums behind one mean and standard deviation (d), or
        sets of responses from which pairs are picked (c*).
    distributions : int
        Pairs of mean and standard deviation per sphere, Gradient Sum only (f).
    pairs : int
        Distances per sphere behind one hit rate, Euclidean Distance only (f*).
    hit_rates : int
        Hit rates per comparison, of which mean and standard deviation are reported (i, h*).
    criterion : float
        Decision point beta, as a fraction of the way from the standard's mean to the comparison's.
    criterion_sigma : float
        Spread of the decision point: for each hit rate it is multiplied by Normal(1, criterion_sigma).
        Above 0 this is the paper's derivative of Gradient Sum: one mean and standard deviation per
        sphere, from `presentations_varied` sums; steps (f) and (g) fall away.
    presentations_varied : int
        Presentations of each sphere when the criterion varies.

    Raises
    ------
    InputError
        If a count is below 2, the criterion not finite or its spread negative.

    Examples
    --------
    >>> Experiment().hit_rates, Experiment(criterion_sigma=0.02).presentations_varied
    (100, 5000)
    """

    presentations: int = _REPETITIONS
    distributions: int = _REPETITIONS
    pairs: int = _REPETITIONS
    hit_rates: int = _REPETITIONS
    criterion: float = psychophysics.DECISION_CRITERION.value
    criterion_sigma: float = 0.0
    presentations_varied: int = _REPETITIONS_VARIED

    def __post_init__(self) -> None:
        for name in ("presentations", "distributions", "pairs", "hit_rates", "presentations_varied"):
            whole(name, getattr(self, name), 2)
        finite("criterion", self.criterion)
        not_negative("criterion_sigma", self.criterion_sigma)


@dataclass(frozen=True)
class NoiseFit:
    """Noise that brings predicted hit rates closest to observed ones.

    Parameters
    ----------
    noise_sigma : float
        Standard deviation sigma_1 of the multiplicative noise.
    hit_rates : array (n_targets,)
        Predicted hit rates at that noise. [0-1]
    root_mean_square_error : float
        Of the predicted against the observed hit rates.
    """

    noise_sigma: float
    hit_rates: FloatArray
    root_mean_square_error: float


def discriminate_gradient_sum(
    responses: ArrayLike,
    neighbours: np.ndarray,
    noise_sigma: float,
    generator: np.random.Generator,
    experiment: Experiment | None = None,
    silent_value: float | None = None,
) -> HitRates:
    """Tell spheres apart by their Gradient Sum, steps (a) to (k).

    Parameters
    ----------
    responses : array_like (n_spheres, n_receptors)
        One measure (a rate, a latency) of every receptor; the standard in the first row. [any unit]
    neighbours : int array (n_pairs, 2)
        From `fingerpad.encoding.neighbour_pairs`.
    noise_sigma : float
        Standard deviation sigma_1 of the multiplicative noise.
    generator : numpy.random.Generator
        Same state, same answer.
    experiment : Experiment, optional
        Repetitions and criterion; default: the paper's.
    silent_value : float, optional
        What a response of NaN, the latency of a silent receptor, stands for, before noise:
        `END_OF_STIMULUS_MS` is usual. Without it NaN is refused.

    Returns
    -------
    HitRates
        One mean and standard deviation per comparison, mu_3 and sigma_3.

    Raises
    ------
    InputError
        If there are fewer than two spheres, neighbours are not receptors, the noise is negative, or a
        response is not finite and no `silent_value` is given.

    Examples
    --------
    Two receptors whose difference is 10 for the standard, 10 and 14 for the comparisons:

    >>> responses = [[50.0, 60.0], [50.0, 60.0], [50.0, 64.0]]
    >>> rates = discriminate_gradient_sum(responses, [[0, 1]], 0.02, np.random.default_rng(1))
    >>> rates.hit_rate.round(1).tolist()
    [0.5, 0.9]
    """
    plan = experiment or Experiment()
    values = _checked_responses(responses, silent_value)
    check_neighbours(neighbours, values.shape[1])
    sigma = not_negative("noise_sigma", noise_sigma)
    if plan.criterion_sigma > 0.0:
        return _mean_and_spread(_varied_criterion(values, neighbours, sigma, generator, plan))
    moments = [
        _moments(gradient_sum(_noisy(values, sigma, plan.presentations, generator), neighbours))  # (a)-(e)
        for _ in range(plan.distributions)  # (f)
    ]
    means = np.array([mean for mean, _ in moments])
    spreads = np.array([spread for _, spread in moments])
    return _mean_and_spread(_signal_detection(means, spreads, generator, plan))  # (k)


def discriminate_euclidean(
    responses: ArrayLike,
    noise_sigma: float,
    generator: np.random.Generator,
    experiment: Experiment | None = None,
    silent_value: float | None = None,
    norm: str = "city-block",
) -> HitRates:
    """Tell spheres apart by their Euclidean Distance from the standard, steps (a) and (b*) to (h*).

    For every hit rate all is repeated: noisy sets (a)-(d*), random pairs of them (e*)-(g*) and the
    decision (h*). Were the sets drawn only once, chance in them would shift the mean hit rate however
    often it is repeated, whereas the paper finds it stable with 100 hit rates. The standard's own
    distances are between two different sets of it.

    Parameters
    ----------
    responses : array_like (n_spheres, n_receptors)
        One measure (a rate, a latency) of every receptor; the standard in the first row. [any unit]
    noise_sigma : float
        Standard deviation sigma_1 of the multiplicative noise.
    generator : numpy.random.Generator
        Same state, same answer.
    experiment : Experiment, optional
        Repetitions and criterion; default: the paper's. Its criterion does not vary here.
    silent_value : float, optional
        What a response of NaN stands for; without it NaN is refused.
    norm : {"city-block", "euclidean"}, optional
        Sum of absolute differences, as printed, or root of the sum of squares, as named.

    Returns
    -------
    HitRates
        One mean and standard deviation per comparison, mu_3 and sigma_3.

    Raises
    ------
    InputError
        If there are fewer than two spheres, the noise is negative, the norm unknown, the criterion is to
        vary, or a response is not finite and no `silent_value` is given.

    Examples
    --------
    >>> responses = [[50.0, 60.0], [50.0, 60.0], [60.0, 80.0]]
    >>> rates = discriminate_euclidean(responses, 0.02, np.random.default_rng(1))
    >>> rates.hit_rate.round(1).tolist()
    [0.5, 1.0]
    """
    plan = experiment or Experiment()
    if plan.criterion_sigma > 0.0:
        raise InputError(
            "criterion_sigma must be 0 for Euclidean Distance: its decision point does not vary."
        )
    one_of("norm", norm, NORMS)
    values = _checked_responses(responses, silent_value)
    sigma = not_negative("noise_sigma", noise_sigma)
    sums = np.array(
        [
            _distances(_noisy(values, sigma, plan.presentations, generator), plan.pairs, generator, norm)
            for _ in range(plan.hit_rates)
        ]
    )  # (a)-(g*): (hit_rates, n_spheres, pairs)
    means = sums.mean(axis=2)
    points = _decision_point(means[:, :1], means[:, 1:], plan.criterion)
    beyond = _side(means) * (sums[:, 1:] - points[:, :, np.newaxis]).transpose(0, 2, 1)
    return _mean_and_spread(np.heaviside(beyond, 0.5).mean(axis=1))  # (h*)


def expected_hit_rates(
    responses: ArrayLike,
    neighbours: np.ndarray,
    noise_sigma: float,
    standard_normals: ArrayLike,
    criterion: float = psychophysics.DECISION_CRITERION.value,
    silent_value: float | None = None,
) -> FloatArray:
    """Predict the mean hit rates of `discriminate_gradient_sum` without repeating the experiment.

    The same standard normal draws serve every sphere and every noise, so the result is a smooth function
    of `noise_sigma`, made for `fit_noise_sigma`.

    Parameters
    ----------
    responses, neighbours, noise_sigma, silent_value
        As in `discriminate_gradient_sum`.
    standard_normals : array_like (n_draws, n_receptors)
        Draws from Normal(0, 1), several thousand.
    criterion : float, optional
        Decision point beta.

    Returns
    -------
    array (n_comparisons,)
        Expected hit rates. [0-1]

    Raises
    ------
    InputError
        As `discriminate_gradient_sum`, or if the draws are not one column per receptor.

    Examples
    --------
    >>> draws = np.random.default_rng(1).standard_normal((5000, 2))
    >>> expected_hit_rates([[50.0, 60.0], [50.0, 64.0]], [[0, 1]], 0.02, draws).round(2).tolist()
    [0.89]
    """
    values = _checked_responses(responses, silent_value)
    draws = float_array("standard_normals", standard_normals, 2)
    if draws.shape[1] != values.shape[1] or len(draws) < 2:
        raise InputError(
            f"standard_normals needs two rows or more and {values.shape[1]} columns, one per receptor: "
            f"got shape {draws.shape}."
        )
    noise = 1.0 + not_negative("noise_sigma", noise_sigma) * draws
    means, spreads = _moments(gradient_sum(values[:, np.newaxis] * noise, neighbours))
    point = _decision_point(means[0], means[1:], finite("criterion", criterion))
    return _beyond(point, means[1:], spreads[1:], _side(means[np.newaxis]))


def fit_noise_sigma(
    hit_rates_of_sigma: Callable[[float], ArrayLike],
    target_hit_rates: ArrayLike = psychophysics.GOODWIN_HIT_RATES.value,
    bounds: tuple[float, float] = (1e-3, 1.0),
) -> NoiseFit:
    """Choose the noise so that predicted hit rates come closest to observed ones, in least squares.

    The bounds are scanned on a logarithmic grid and the best cell is refined, so that the flat stretches
    at very small and very large noise do no harm. No random number is drawn here.

    Parameters
    ----------
    hit_rates_of_sigma : callable
        Hit rates (n_targets,) at a given noise sigma_1; smooth, such as `expected_hit_rates`.
    target_hit_rates : array_like (n_targets,), optional
        Observed hit rates; default: Goodwin's for 296 and 365 /m. [0-1]
    bounds : (float, float), optional
        Smallest and largest noise to consider.

    Returns
    -------
    NoiseFit

    Raises
    ------
    InputError
        If the bounds are not positive and in order, or predictions and targets differ in number.
    ConvergenceError
        If the best noise lies on a bound: the targets then cannot be met by noise.

    Examples
    --------
    >>> def predict(sigma):
    ...     return ndtr([0.01 / sigma, 0.09 / sigma])
    >>> fit = fit_noise_sigma(predict, predict(0.055))
    >>> round(fit.noise_sigma, 4)
    0.055
    """
    targets = float_array("target_hit_rates", target_hit_rates, 1)
    smallest, largest = (positive("bounds", bound) for bound in bounds)
    if smallest >= largest:
        raise InputError(f"bounds must be a smaller and a larger noise: got {bounds!r}.")

    def predict(sigma: float) -> FloatArray:
        rates = float_array("hit rates of hit_rates_of_sigma", hit_rates_of_sigma(sigma), 1)
        if rates.shape != targets.shape:
            raise InputError(f"hit_rates_of_sigma must give {targets.size} hit rates: got {rates.size}.")
        return rates

    def misfit(log_sigma: float) -> float:
        return float(np.square(predict(float(np.exp(log_sigma))) - targets).sum())

    grid = np.linspace(np.log(smallest), np.log(largest), _NOISE_SCAN)
    best = int(np.argmin([misfit(log_sigma) for log_sigma in grid]))
    if best in (0, _NOISE_SCAN - 1):
        raise ConvergenceError(
            f"No noise within {smallest:g} ... {largest:g} meets the hit rates {targets.tolist()}: "
            f"the best lies on the bound {np.exp(grid[best]):g}; widen the bounds or look at the responses."
        )
    refined = minimize_scalar(
        misfit, bounds=(grid[best - 1], grid[best + 1]), method="bounded", options={"xatol": 1e-9}
    )
    sigma = float(np.exp(refined.x))
    rates = predict(sigma)
    return NoiseFit(sigma, rates, float(np.sqrt(np.mean(np.square(rates - targets)))))


def _checked_responses(responses: ArrayLike, silent_value: float | None) -> FloatArray:
    try:
        table = np.array(responses, dtype=np.float64)
    except (TypeError, ValueError) as error:
        raise InputError(f"responses must be numbers: got {type(responses).__name__}.") from error
    silent = np.isnan(table)
    if silent.any():
        if silent_value is None:
            raise InputError(
                f"responses must be finite: {np.count_nonzero(silent)} are NaN, as of silent receptors; "
                "give silent_value to say what those stand for."
            )
        table[silent] = finite("silent_value", silent_value)
    table = float_array("responses", table, 2)
    if table.shape[0] < 2 or table.shape[1] == 0:
        raise InputError(
            f"responses needs the standard, at least one comparison and a receptor: got {table.shape}."
        )
    return table


def _noisy(values: FloatArray, sigma: float, count: int, generator: np.random.Generator) -> FloatArray:
    """Draw noisy presentations of every sphere (a), shape (n_spheres, count, n_receptors)."""
    draws = generator.standard_normal((values.shape[0], count, values.shape[1]))
    return values[:, np.newaxis] * (1.0 + sigma * draws)


def _moments(sums: FloatArray) -> tuple[FloatArray, FloatArray]:
    """Return mean mu_2 and standard deviation sigma_2 over the last axis (e)."""
    return sums.mean(axis=-1), sums.std(axis=-1, ddof=1)


def _signal_detection(
    means: FloatArray, spreads: FloatArray, generator: np.random.Generator, plan: Experiment
) -> FloatArray:
    """Return hit rates (hit_rates, n_comparisons) of randomly picked distributions (g)-(j)."""
    n_distributions, n_spheres = means.shape
    comparison = np.arange(1, n_spheres)
    picks = generator.integers(n_distributions, size=(2, plan.hit_rates, n_spheres - 1))
    standard_mean = means[picks[0], 0]
    comparison_mean = means[picks[1], comparison]
    point = _decision_point(standard_mean, comparison_mean, plan.criterion)
    return _beyond(point, comparison_mean, spreads[picks[1], comparison], _side(means))


def _varied_criterion(
    values: FloatArray, neighbours: np.ndarray, sigma: float, generator: np.random.Generator, plan: Experiment
) -> FloatArray:
    """Return hit rates (hit_rates, n_comparisons) of one distribution per sphere, criterion wavering."""
    means, spreads = _moments(
        gradient_sum(_noisy(values, sigma, plan.presentations_varied, generator), neighbours)
    )
    wavering = 1.0 + plan.criterion_sigma * generator.standard_normal((plan.hit_rates, values.shape[0] - 1))
    point = _decision_point(means[0], means[1:], plan.criterion) * wavering
    return _beyond(point, means[1:], spreads[1:], _side(means[np.newaxis]))


def _distances(sets: FloatArray, pairs: int, generator: np.random.Generator, norm: str) -> FloatArray:
    """Return distances (n_spheres, pairs) of random sets from random sets of the standard (e*)-(g*)."""
    n_spheres, n_sets, _ = sets.shape
    of_standard = generator.integers(n_sets, size=(n_spheres, pairs))
    of_sphere = generator.integers(n_sets, size=(n_spheres, pairs))
    # A set at distance 0 from itself would tell nothing about noise: the standard meets its other sets.
    other = generator.integers(n_sets - 1, size=pairs)
    of_sphere[0] = other + (other >= of_standard[0])
    return distance(sets[0, of_standard], sets[np.arange(n_spheres)[:, np.newaxis], of_sphere], norm)


def _decision_point(standard: FloatArray, comparison: FloatArray, criterion: float) -> FloatArray:
    return standard + criterion * (comparison - standard)


def _side(means: FloatArray) -> FloatArray:
    """Return +1 or -1 (n_comparisons,): on which side of the standard each comparison lies on the whole."""
    pooled = means.mean(axis=0)
    return np.where(pooled[1:] < pooled[0], -1.0, 1.0)


def _beyond(point: FloatArray, mean: FloatArray, spread: FloatArray, side: FloatArray) -> FloatArray:
    """Return the probability that Normal(mean, spread) lies beyond the decision point (h)."""
    margin = side * (mean - point)
    scaled = np.divide(margin, spread, out=np.zeros_like(margin), where=spread > 0.0)
    return np.where(spread > 0.0, ndtr(scaled), np.heaviside(margin, 0.5))


def _mean_and_spread(hit_rates: FloatArray) -> HitRates:
    """Return mean mu_3 and standard deviation sigma_3 over the repetitions (k)."""
    return HitRates(hit_rates.mean(axis=0), hit_rates.std(axis=0, ddof=1))
