"""Noise, decision and hit rate in the discrimination of spheres (paper, section 2.2.3, Figure 3).

Letters in brackets are the steps of Figure 3. Choices where the paper gives no detail:

- Noise multiplies every response by Normal(1, sigma_1), independent for each receptor and presentation.
- The decision point divides the distance from the standard's mean to the comparison's by the fraction
  beta; a hit is a value beyond it, on the comparison's side.
- The comparison's side is the sign of the difference of the means over all repetitions. Measures that
  decrease with curvature (latencies) are treated like those that increase, and the hit rate of two equal
  spheres is one half.

Every random number has a key: seed, trial, receptor and purpose. Trials are numbered within a session, so
sessions of one seed share no random number.

    mu_2, sigma_2 = mean and standard deviation of many noisy values of one stimulus         (e)
    point         = mu_standard + beta (mu_comparison - mu_standard)                        (h)
    hit rate      = P(Normal(mu_comparison, sigma_comparison) lies beyond the point)        (h)
"""

from __future__ import annotations

import math
from collections.abc import Callable, Iterator, Sequence
from operator import attrgetter
from typing import Annotated

import numpy as np
from numpy.typing import ArrayLike
from scipy.special import ndtr

from fingerpad.core.checked import checked, value_class
from fingerpad.core.errors import InputError
from fingerpad.core.random_streams import Purpose, normals, uniforms
from fingerpad.core.signals import HitRates
from fingerpad.core.values import (
    Finite,
    FloatArray,
    IntArray,
    NotNegative,
    NotNegativeWhole,
    Whole,
    choice,
    count_from,
    float_array,
)
from fingerpad.data import protocol, psychophysics
from fingerpad.psychophysics.encoding import NORMS, check_neighbours, distance
from fingerpad.psychophysics.noisy_responses import checked_noise, noisy_gradient_sums, session_trials

END_OF_STIMULUS_MS = protocol.RAMP.value + protocol.HOLD.value
"""A usual value for the latency of a silent receptor. [ms]"""

CRITERION_MOVES = ("point", "fraction", "likelihood")
"""Quantity multiplied by a varied criterion: the decision point, the fraction beta, or a likelihood ratio of
1 between comparison and standard, which then is the criterion in the place of the fraction."""

_NOISES_AT_ONCE = 32  # Noises whose sums are held in memory together.

MOST_REPETITIONS = 1_000_000

_REPETITIONS = int(psychophysics.REPETITIONS.value)

Repetitions = Annotated[int, count_from(2, MOST_REPETITIONS)]
_REPETITIONS_VARIED = int(psychophysics.REPETITIONS_VARIED_CRITERION.value)


@value_class
class Experiment:
    """Numbers of repetitions, and decision criterion."""

    presentations: Repetitions = _REPETITIONS
    """Noisy presentations of each sphere: gradient sums behind one mean and standard deviation (d), or sets
    of responses from which pairs are sampled (c*)."""
    distributions: Repetitions = _REPETITIONS
    """Pairs of mean and standard deviation per sphere, Gradient Sum only (f)."""
    pairs: Repetitions = _REPETITIONS  # Distances per sphere behind one hit rate, Euclidean Distance (f*).
    hit_rates: Repetitions = _REPETITIONS
    """Hit rates per comparison, of which mean and standard deviation are reported (i, h*)."""
    criterion: Finite = psychophysics.DECISION_CRITERION.value
    """Decision point beta, as a fraction of the distance from the standard's mean to the comparison's."""
    criterion_sigma: NotNegative = 0.0
    """Spread of the decision point: for each hit rate it is multiplied by Normal(1, criterion_sigma). Above 0
    this is the paper's derivative of Gradient Sum: one mean and standard deviation per sphere, from
    `presentations_varied` sums; steps (f) and (g) are omitted."""
    presentations_varied: Repetitions = (
        _REPETITIONS_VARIED  # Presentations of each sphere when the criterion varies.
    )
    criterion_moves: Annotated[str, choice(CRITERION_MOVES)] = CRITERION_MOVES[0]
    """Quantity multiplied by the varied criterion: the decision point itself, beta, or a likelihood ratio of
    1 that replaces beta."""

    def __post_init__(self) -> None:
        if math.prod(self.sums_per_sphere) > MOST_REPETITIONS:
            raise InputError(
                f"distributions times presentations must be at most {MOST_REPETITIONS:,}: got "
                f"{self.distributions} by {self.presentations}."
            )

    @property
    def sums_per_sphere(self) -> tuple[int, int]:
        if self.criterion_sigma > 0.0:
            return 1, self.presentations_varied
        return self.distributions, self.presentations


@checked
def discriminate_gradient_sum(
    responses: ArrayLike,
    neighbours: ArrayLike,
    noise_sigma: Finite,
    seed: Whole,
    experiment: Experiment | None = None,
    silent_value: Finite | None = None,
    session: Whole = 0,
) -> HitRates:
    """Discriminate spheres by their Gradient Sum, steps (a) to (k).

    Parameters
    ----------
    responses : array_like (n_spheres, n_receptors)
        One measure (a rate, a latency) of every receptor; the standard in the first row. [any unit]
    neighbours : int array (n_pairs, 2)
        From `fingerpad.psychophysics.encoding.neighbour_pairs`.
    noise_sigma : float
        Standard deviation sigma_1 of the multiplicative noise.
    seed : int
        Of the whole run; the same seed and session give the same result.
    experiment : Experiment, optional
        Repetitions and criterion; default: the paper's.
    silent_value : float, optional
        Value that replaces NaN, the latency of a silent receptor, before noise: `END_OF_STIMULUS_MS` is
        usual. Without it NaN is refused.
    session : int, optional
        Session of this seed; sessions have different random numbers.

    Returns
    -------
    HitRates
        One mean and standard deviation per comparison, mu_3 and sigma_3.

    Examples
    --------
    Two receptors whose difference is 10 for the standard, 10 and 14 for the comparisons:

    >>> responses = [[50.0, 60.0], [50.0, 60.0], [50.0, 64.0]]
    >>> discriminate_gradient_sum(responses, [[0, 1]], 0.02, seed=1).hit_rate.round(1).tolist()
    [0.5, 0.9]
    """
    observer = noise_sigma, experiment or Experiment()
    return compare_gradient_sum_observers(responses, neighbours, [observer], seed, silent_value, session)[0]


@checked
def compare_gradient_sum_observers(
    responses: ArrayLike,
    neighbours: ArrayLike,
    observers: Sequence[tuple[float, Experiment]],
    seed: NotNegativeWhole,
    silent_value: Finite | None = None,
    session: Whole = 0,
) -> list[HitRates]:
    """Discriminate spheres by their Gradient Sum under several noises and criteria.

    All observers meet the same random numbers, which are drawn once: each has the hit rates that
    `discriminate_gradient_sum` gives it.
    """
    values = checked_responses(responses, silent_value)
    pairs = check_neighbours(neighbours, values.shape[1])
    if not len(pairs):
        raise InputError("neighbours", "must hold at least one pair of receptors", "none")
    found: dict[int, HitRates] = {}
    for (distributions, presentations), sigmas, owners in _alike(observers, attrgetter("sums_per_sphere")):
        trials = session_trials(session, len(values), distributions)
        measures = np.broadcast_to(values, (sigmas.size, *values.shape))
        sums = noisy_gradient_sums(measures, pairs, sigmas, seed, trials, presentations)  # (a)-(f)
        for numbers, of_sigma in zip(owners, sums, strict=True):
            for number in numbers:
                found[number] = hit_rates_of_sums(of_sigma, seed, observers[number][1], session)
    return [found[number] for number in range(len(observers))]


def _alike(
    observers: Sequence[tuple[float, Experiment]], sizes: Callable[[Experiment], tuple[int, ...]]
) -> Iterator[tuple[tuple[int, ...], FloatArray, list[list[int]]]]:
    """Sizes that some observers share, some of their noises, and the numbers of the observers of each."""
    alike: dict[tuple[int, ...], dict[float, list[int]]] = {}
    for number, (noise_sigma, plan) in enumerate(observers):
        alike.setdefault(sizes(plan), {}).setdefault(checked_noise(noise_sigma), []).append(number)
    for shared, by_sigma in alike.items():
        sigmas = list(by_sigma)
        for first in range(0, len(sigmas), _NOISES_AT_ONCE):
            some = sigmas[first : first + _NOISES_AT_ONCE]
            yield shared, np.array(some), [by_sigma[sigma] for sigma in some]


def hit_rates_of_sums(
    sums: FloatArray, seed: int, experiment: Experiment | None = None, session: int = 0
) -> HitRates:
    """Discriminate spheres with given Gradient Sums, steps (e) and (g) to (k)."""
    plan = experiment or Experiment()
    means, spreads = moments(sums)  # (e): (n_spheres, n_distributions)
    varied = plan.criterion_sigma > 0.0
    hit_rates = (_varied_criterion if varied else _picked_pairs)(means.T, spreads.T, seed, plan, session)
    return _mean_and_spread(hit_rates, seed, session)  # (k)


def discriminate_euclidean(
    responses: ArrayLike,
    noise_sigma: float,
    seed: int,
    experiment: Experiment | None = None,
    silent_value: float | None = None,
    norm: str = "city-block",
    session: int = 0,
) -> HitRates:
    """Discriminate spheres by their Euclidean Distance from the standard, steps (a) and (b*) to (h*).

    Every hit rate repeats the whole procedure: noisy sets (a)-(d*), random pairs of them (e*)-(g*) and the
    decision (h*). If the sets were sampled once, their sampling error would shift the mean hit rate
    regardless of the repetitions, but the paper finds it stable with 100 hit rates. The standard's own
    distances are between two different sets of it.
    """
    observer = noise_sigma, experiment or Experiment()
    return compare_euclidean_observers(responses, [observer], seed, silent_value, norm, session)[0]


@checked
def compare_euclidean_observers(
    responses: ArrayLike,
    observers: Sequence[tuple[float, Experiment]],
    seed: Whole,
    silent_value: Finite | None = None,
    norm: Annotated[str, choice(NORMS)] = "city-block",
    session: Whole = 0,
) -> list[HitRates]:
    """Discriminate spheres by their Euclidean Distance under several noises and criteria.

    All observers meet the same random numbers, which are drawn once: each has the hit rates that
    `discriminate_euclidean` gives it.
    """
    values = checked_responses(responses, silent_value)
    for _, plan in observers:
        if plan.criterion_sigma > 0.0:
            raise InputError(
                "criterion_sigma",
                "must be 0 for Euclidean Distance",
                remedy="its decision point does not vary",
            )
    found: dict[int, HitRates] = {}
    sizes_of = attrgetter("hit_rates", "presentations", "pairs")
    for (repetitions, n_sets, n_pairs), sigmas, owners in _alike(observers, sizes_of):
        trials = session_trials(session, repetitions, len(values))
        distances = np.stack(
            [_noisy_distances(values, sigmas, seed, trial, n_sets, n_pairs, norm) for trial in trials], axis=1
        )
        for numbers, of_sigma in zip(owners, distances, strict=True):
            for number in numbers:
                hit_rates = _rates_of_distances(of_sigma, observers[number][1])
                found[number] = _mean_and_spread(hit_rates, seed, session)
    return [found[number] for number in range(len(observers))]


@checked
def checked_responses(responses: ArrayLike, silent_value: Finite | None = None) -> FloatArray:
    """Return responses as a table if they are valid for a discrimination, else raise `InputError`."""
    try:
        table = np.array(responses, dtype=np.float64)
    except (TypeError, ValueError) as error:
        raise InputError("responses", "must be numbers", type(responses).__name__) from error
    silent = np.isnan(table)
    if table.size and (silent | (table == 0.0)).all():
        raise InputError(
            "responses",
            "must not all be silent",
            remedy="the population stays silent under every sphere, so there is no hit rate; increase the "
            "depth or use more sensitive afferents",
        )
    if silent.any():
        if silent_value is None:
            raise InputError(
                "responses",
                "must be finite",
                remedy=f"{np.count_nonzero(silent)} are NaN, as of silent receptors; give silent_value to "
                "replace them",
            )
        table[silent] = silent_value
    table = float_array("responses", table, 2)
    if table.shape[0] < 2 or table.shape[1] == 0:
        raise InputError(
            "responses", "needs the standard, at least one comparison and a receptor", str(table.shape)
        )
    return table


def _picked_pairs(
    means: FloatArray, spreads: FloatArray, seed: int, plan: Experiment, session: int
) -> FloatArray:
    """Return hit rates (hit_rates, n_comparisons) of randomly sampled distributions (g)-(j)."""
    n_distributions, n_spheres = means.shape
    comparison = np.arange(1, n_spheres)
    trials = session_trials(session, n_spheres - 1)
    picks = _picks(seed, trials, (plan.hit_rates, 2), n_distributions).transpose(2, 1, 0)
    standard_mean = means[picks[0], 0]
    comparison_mean = means[picks[1], comparison]
    point = decision_point(standard_mean, comparison_mean, plan.criterion)
    return hit_probability(point, comparison_mean, spreads[picks[1], comparison], side(means))


def _varied_criterion(
    means: FloatArray, spreads: FloatArray, seed: int, plan: Experiment, session: int
) -> FloatArray:
    """Return hit rates (hit_rates, n_comparisons) of one distribution per sphere, with a varied criterion."""
    trials = session_trials(session, means.shape[1] - 1)
    draws = normals(seed, trials, 1, Purpose.CRITERION, plan.hit_rates)[:, 0].T
    factors = 1.0 + plan.criterion_sigma * draws
    standard, comparison = means[0, 0], means[0, 1:]
    if plan.criterion_moves == "point":
        point = decision_point(standard, comparison, plan.criterion) * factors
    elif plan.criterion_moves == "fraction":
        point = decision_point(standard, comparison, plan.criterion * factors)
    else:
        variance = 0.5 * (np.square(spreads[0, 0]) + np.square(spreads[0, 1:]))
        point = likelihood_point(standard, comparison, variance, factors)
    return hit_probability(point, comparison, spreads[0, 1:], side(means[:1]))


def _noisy_distances(
    values: FloatArray, sigmas: FloatArray, seed: int, trials: IntArray, n_sets: int, n_pairs: int, norm: str
) -> FloatArray:
    """Return distances (n_sigmas, n_spheres, pairs) of random sets from sets of the standard (a)-(g*)."""
    draws = normals(seed, trials, values.shape[1], Purpose.RESPONSE, n_sets).transpose(0, 2, 1)
    of_standard, of_sphere = _picks(seed, trials, (n_pairs, 2), n_sets).transpose(2, 0, 1)
    # The distance of a set from itself is 0 and has no noise: the standard is compared with its other sets.
    other = _picks(seed, trials[:1], (n_pairs, 2), n_sets - 1)[0, :, 1]
    of_sphere[0] = other + (other >= of_standard[0])
    first = draws[0, of_standard]
    second = draws[np.arange(len(values))[:, np.newaxis], of_sphere]
    return np.array(
        [
            distance(values[0] * (1.0 + sigma * first), values[:, np.newaxis] * (1.0 + sigma * second), norm)
            for sigma in sigmas
        ]
    )


def _rates_of_distances(distances: FloatArray, plan: Experiment) -> FloatArray:
    """Return hit rates (hit_rates, n_comparisons) of distances (hit_rates, n_spheres, pairs) (h*)."""
    means = distances.mean(axis=2)
    points = decision_point(means[:, :1], means[:, 1:], plan.criterion)
    beyond = side(means) * (distances[:, 1:] - points[:, :, np.newaxis]).transpose(0, 2, 1)
    return np.heaviside(beyond, 0.5).mean(axis=1)


def _picks(seed: int, trials: IntArray, shape: tuple[int, int], choices: int) -> IntArray:
    """Sample from 0 ... choices - 1, `shape` times in each trial; (n_trials, *shape)."""
    numbers = uniforms(seed, trials, 1, Purpose.PICK, shape[0] * shape[1])
    return (numbers * choices).astype(np.int64).reshape(-1, *shape)


def _mean_and_spread(hit_rates: FloatArray, seed: int, session: int) -> HitRates:
    """Return mean mu_3 and standard deviation sigma_3 over the repetitions (k)."""
    return HitRates(hit_rates.mean(axis=0), hit_rates.std(axis=0, ddof=1), seed, session)


def moments(answers: FloatArray) -> tuple[FloatArray, FloatArray]:
    """Return mean mu_2 and standard deviation sigma_2 over the last axis, step (e)."""
    return answers.mean(axis=-1), answers.std(axis=-1, ddof=1)


def decision_point(standard: FloatArray, comparison: FloatArray, criterion: float | FloatArray) -> FloatArray:
    """Return the point at the fraction beta of the distance from the standard's mean to the comparison's."""
    return np.asarray(standard + criterion * (comparison - standard))


def likelihood_point(
    standard: FloatArray, comparison: FloatArray, variance: FloatArray, ratio: FloatArray
) -> FloatArray:
    """Return the point at which the comparison is `ratio` times as likely as the standard.

    For two normal distributions of one variance s^2 the logarithm of the likelihood ratio is linear:

        point = (mu_standard + mu_comparison)/2 + s^2 ln(ratio) / (mu_comparison - mu_standard)
    """
    shift = np.asarray(variance * np.log(np.maximum(ratio, np.finfo(float).tiny)))
    distance = np.broadcast_to(comparison - standard, shift.shape)
    away = np.divide(shift, distance, out=np.zeros_like(shift), where=distance != 0.0)
    return decision_point(standard, comparison, 0.5) + away


def side(means: FloatArray) -> FloatArray:
    """Return the side of the standard on which each comparison lies."""
    pooled = means.mean(axis=0)
    return np.where(pooled[1:] < pooled[0], -1.0, 1.0)


def hit_probability(point: FloatArray, mean: FloatArray, spread: FloatArray, side: FloatArray) -> FloatArray:
    """Return the probability that Normal(mean, spread) lies beyond the decision point, step (h)."""
    margin = np.asarray(side * (mean - point))
    scaled = np.divide(margin, spread, out=np.zeros_like(margin), where=spread > 0.0)
    return np.where(spread > 0.0, ndtr(scaled), np.heaviside(margin, 0.5))
