"""The observer who discriminates spheres: code, noise and decision (paper, section 2.2.3, Figure 3).

Letters in brackets are the steps of Figure 3. Choices where the paper gives no detail:

- Noise multiplies every response by Normal(1, sigma_1), independent for each receptor and presentation, or
  has another law of `Noise`.
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
from collections.abc import Callable, Sequence
from dataclasses import dataclass
from typing import Annotated, Protocol, runtime_checkable

import numpy as np
from numpy.typing import ArrayLike
from scipy.optimize import minimize_scalar
from scipy.special import ndtr

from fingerpad.core.checked import checked, value_class
from fingerpad.core.errors import ConvergenceError, InputError
from fingerpad.core.random_streams import Purpose, normals, uniforms
from fingerpad.core.signals import HitRates
from fingerpad.core.values import (
    Finite,
    FloatArray,
    IntArray,
    NotNegative,
    NotNegativeWhole,
    Whole,
    array,
    choice,
    count_from,
    float_array,
    one_of,
    positive,
)
from fingerpad.data import protocol, psychophysics
from fingerpad.psychophysics.encoding import (
    NORMS,
    AnyNoise,
    Noise,
    check_neighbours,
    distance,
    gradient_sum,
    noise_of,
    noisy_gradient_sums,
    noisy_responses,
    session_trials,
    shared_noise_gradient_sums,
)
from fingerpad.psychophysics.ideal_observer import EFFICIENCY_TRIALS, ResponseModel, Statistic

END_OF_STIMULUS_MS = protocol.RAMP.value + protocol.HOLD.value
"""A usual value for the latency of a silent receptor. [ms]"""

CRITERION_MOVES = ("point", "fraction", "likelihood")

MOST_REPETITIONS = 1_000_000
NOISE_DRAWS = 4000  # Common random presentations in the fit of the noise; its sampling error is one per cent.

_NOISES_AT_ONCE = 32  # Noises whose sums are held in memory together.
_NOISE_SCAN = 33
_REPETITIONS = int(psychophysics.REPETITIONS.value)
_REPETITIONS_VARIED = int(psychophysics.REPETITIONS_VARIED_CRITERION.value)

Repetitions = Annotated[int, count_from(2, MOST_REPETITIONS)]


@value_class
class Experiment:
    """Numbers of repetitions, and decision criterion."""

    presentations: Repetitions = _REPETITIONS
    """Noisy presentations of each sphere: gradient sums behind one mean and standard deviation (d), or sets
    of responses from which pairs are sampled (c*)."""
    distributions: Repetitions = _REPETITIONS
    """Pairs of mean and standard deviation per sphere, Gradient Sum only (f)."""
    pairs: Repetitions = _REPETITIONS  #: Distances per sphere behind one hit rate, Euclidean Distance (f*).
    hit_rates: Repetitions = _REPETITIONS
    """Hit rates per comparison, of which mean and standard deviation are reported (i, h*)."""
    criterion: Finite = psychophysics.DECISION_CRITERION.value
    """Decision point beta, as a fraction of the distance from the standard's mean to the comparison's."""
    criterion_sigma: NotNegative = 0.0
    """Spread of the decision point: for each hit rate it is multiplied by Normal(1, criterion_sigma). Above 0
    this is the paper's derivative of Gradient Sum: one mean and standard deviation per sphere, from
    `presentations_varied` sums; steps (f) and (g) are omitted."""
    presentations_varied: Repetitions = _REPETITIONS_VARIED
    """Presentations of each sphere when the criterion varies."""
    criterion_moves: Annotated[str, choice(CRITERION_MOVES)] = CRITERION_MOVES[0]
    """Quantity multiplied by the varied criterion: the decision point itself, the fraction beta, or a
    likelihood ratio of 1 between comparison and standard, which replaces beta."""

    def __post_init__(self) -> None:
        if math.prod(self.sums_per_sphere) > MOST_REPETITIONS:
            raise InputError(
                f"distributions times presentations must be at most {MOST_REPETITIONS:,}: got "
                f"{self.distributions} by {self.presentations}."
            )

    @property
    def sums_per_sphere(self) -> tuple[int, int]:
        """Means and standard deviations of each sphere, and gradient sums behind each of them."""
        if self.criterion_sigma > 0.0:
            return 1, self.presentations_varied
        return self.distributions, self.presentations


@runtime_checkable
class Encoder(Protocol):
    """Contract of a code: the statistic that an observer computes of a population."""

    def sizes(self, plan: Experiment) -> tuple[int, ...]:
        """Repetitions that decide which random numbers are drawn."""

    def values(
        self, responses: FloatArray, noises: Sequence[Noise], seed: int, sizes: tuple[int, ...], session: int
    ) -> FloatArray:
        """Statistics of noisy presentations, (n_noises, ...), all from the same random numbers."""

    def hit_rates(self, values: FloatArray, seed: int, plan: Experiment, session: int) -> FloatArray:
        """Hit rates (hit_rates, n_comparisons) of the statistics of one noise."""

    def predictor(
        self, responses: FloatArray, seed: int, plan: Experiment, session: int
    ) -> Callable[[Noise], FloatArray]:
        """From a noise to mean hit rates (n_comparisons,), for fits of the noise."""
        return lambda noise: discriminate_by(self, responses, noise, seed, plan, session=session).hit_rate

    def of_noisy(
        self, responses: FloatArray, noise: Noise, seed: int, session: int, count: int
    ) -> FloatArray:
        """Statistic of so many noisy presentations of each stimulus, (n_stimuli, count)."""

    def statistic(self, standard: ResponseModel, seed: int, session: int) -> Statistic:
        """Statistic of one trial, for `Presentation.of`."""


@dataclass(frozen=True)
class GradientSum(Encoder):
    """Code: the sum of the differences between neighbours; steps (a) to (k)."""

    neighbours: ArrayLike  #: From `neighbour_pairs`, int (n_pairs, 2).

    def sizes(self, plan: Experiment) -> tuple[int, ...]:
        return plan.sums_per_sphere

    def values(
        self, responses: FloatArray, noises: Sequence[Noise], seed: int, sizes: tuple[int, ...], session: int
    ) -> FloatArray:
        pairs = check_neighbours(self.neighbours, responses.shape[1])
        if not len(pairs):
            raise InputError("neighbours", "must hold at least one pair of receptors", "none")
        trials = session_trials(session, len(responses), sizes[0])
        return noisy_gradient_sums(responses, pairs, noises, seed, trials, sizes[1])  # (a)-(f)

    def hit_rates(self, values: FloatArray, seed: int, plan: Experiment, session: int) -> FloatArray:
        means, spreads = values.mean(axis=-1), values.std(axis=-1, ddof=1)  # (e), of all distributions
        decide = _varied_criterion if plan.criterion_sigma > 0.0 else _picked_pairs
        return decide(means.T, spreads.T, seed, plan, session)

    def predictor(
        self, responses: FloatArray, seed: int, plan: Experiment, session: int
    ) -> Callable[[Noise], FloatArray]:
        draws = normals(seed, 1, responses.shape[1], Purpose.RESPONSE, NOISE_DRAWS)[0].T
        return lambda noise: expected_hit_rates(responses, self.neighbours, noise, draws, plan.criterion)

    def of_noisy(
        self, responses: FloatArray, noise: Noise, seed: int, session: int, count: int
    ) -> FloatArray:
        return self.values(responses, [noise], seed, (1, count), session)[0, :, 0]

    def statistic(self, standard: ResponseModel, seed: int, session: int) -> Statistic:
        return lambda responses: gradient_sum(responses, self.neighbours)


@dataclass(frozen=True)
class EuclideanDistance(Encoder):
    """Code: the distance from the standard, receptor by receptor; steps (a) and (b*) to (h*).

    Every hit rate repeats the whole procedure: noisy sets (a)-(d*), random pairs of them (e*)-(g*) and the
    decision (h*). If the sets were sampled once, their sampling error would shift the mean hit rate
    regardless of the repetitions, but the paper finds it stable with 100 hit rates. The standard's own
    distances are between two different sets of it.
    """

    norm: str = NORMS[0]

    def __post_init__(self) -> None:
        one_of("norm", self.norm, NORMS)

    def sizes(self, plan: Experiment) -> tuple[int, ...]:
        if plan.criterion_sigma > 0.0:
            wanted = "must be 0 for Euclidean Distance"
            raise InputError("criterion_sigma", wanted, remedy="its decision point does not vary")
        return plan.hit_rates, plan.presentations, plan.pairs

    def values(
        self, responses: FloatArray, noises: Sequence[Noise], seed: int, sizes: tuple[int, ...], session: int
    ) -> FloatArray:
        repetitions, n_sets, n_pairs = sizes
        trials = session_trials(session, repetitions, len(responses))
        each = [self._distances(responses, noises, seed, trial, n_sets, n_pairs) for trial in trials]
        return np.stack(each, axis=1)

    def _distances(
        self,
        values: FloatArray,
        noises: Sequence[Noise],
        seed: int,
        trials: IntArray,
        n_sets: int,
        n_pairs: int,
    ) -> FloatArray:
        """Distances (n_noises, n_spheres, pairs) of random sets from sets of the standard (a)-(g*)."""
        draws = normals(seed, trials, values.shape[1], Purpose.RESPONSE, n_sets).transpose(0, 2, 1)
        of_standard, of_sphere = _picks(seed, trials, (n_pairs, 2), n_sets).transpose(2, 0, 1)
        # The distance of a set from itself is 0 and has no noise: the standard meets its other sets.
        other = _picks(seed, trials[:1], (n_pairs, 2), n_sets - 1)[0, :, 1]
        of_sphere[0] = other + (other >= of_standard[0])
        first = draws[0, of_standard]
        second = draws[np.arange(len(values))[:, np.newaxis], of_sphere]
        noisy = (
            (values[0] + spread[0] * first, values[:, np.newaxis] + spread[:, np.newaxis] * second)
            for spread in (noise.spread(values) for noise in noises)
        )
        return np.array([distance(*both, self.norm) for both in noisy])

    def hit_rates(self, values: FloatArray, seed: int, plan: Experiment, session: int) -> FloatArray:
        means = values.mean(axis=2)  # of (hit_rates, n_spheres, pairs)
        points = decision_point(means[:, :1], means[:, 1:], plan.criterion)
        beyond = side(means) * (values[:, 1:] - points[:, :, np.newaxis]).transpose(0, 2, 1)
        return np.heaviside(beyond, 0.5).mean(axis=1)  # (h*)

    def of_noisy(
        self, responses: FloatArray, noise: Noise, seed: int, session: int, count: int
    ) -> FloatArray:
        trials = session_trials(session, len(responses))
        sets = noisy_responses(responses, noise, seed, trials, 2 * count)
        # The standard is compared with other presentations of itself.
        return distance(sets[:1, :count], sets[:, count:], self.norm)

    def statistic(self, standard: ResponseModel, seed: int, session: int) -> Statistic:
        # A distance is taken from a presentation of the standard in a trial of its own.
        memory = standard.draw(seed, session_trials(session, 3, EFFICIENCY_TRIALS)[2])
        return lambda responses: distance(responses, memory, self.norm)


ENCODERS: dict[str, Callable[[np.ndarray], Encoder]] = {
    "gradient_sum": GradientSum,
    "euclidean": lambda neighbours: EuclideanDistance(),
}
"""Codes by name, each made from the pairs of neighbours of a population."""


@checked
def discriminate_by(
    encoder: Encoder,
    responses: ArrayLike,
    noise: AnyNoise,
    seed: Whole,
    experiment: Experiment | None = None,
    silent_value: Finite | None = None,
    session: Whole = 0,
) -> HitRates:
    """Discriminate stimuli by a code of the responses of a population.

    Parameters
    ----------
    encoder : Encoder
        The code: `GradientSum(neighbours)` or `EuclideanDistance()`.
    responses : array_like (n_stimuli, n_receptors)
        One measure (a rate, a latency) of every receptor; the standard in the first row. [any unit]
    noise : float or Noise
        Standard deviation sigma_1 of noise that multiplies, or another `Noise`.
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
    >>> discriminate_by(GradientSum([[0, 1]]), responses, 0.02, seed=1).hit_rate.round(1).tolist()
    [0.5, 0.9]
    """
    observer = noise, experiment or Experiment()
    return compare_observers(encoder, responses, [observer], seed, silent_value, session)[0]


@checked
def compare_observers(
    encoder: Encoder,
    responses: ArrayLike,
    observers: Sequence[tuple[AnyNoise, Experiment]],
    seed: NotNegativeWhole,
    silent_value: Finite | None = None,
    session: Whole = 0,
) -> list[HitRates]:
    """Discriminate under several noises and criteria, which meet the same random numbers, drawn once."""
    values = checked_responses(responses, silent_value)
    found: dict[int, HitRates] = {}
    alike: dict[tuple[int, ...], dict[Noise, list[int]]] = {}
    for number, (noise, plan) in enumerate(observers):
        alike.setdefault(encoder.sizes(plan), {}).setdefault(noise_of("noise", noise), []).append(number)
    for sizes, by_noise in alike.items():
        noises = list(by_noise)
        for first in range(0, len(noises), _NOISES_AT_ONCE):
            some = noises[first : first + _NOISES_AT_ONCE]
            drawn = encoder.values(values, some, seed, sizes, session)
            for noise, of_noise in zip(some, drawn, strict=True):
                for number in by_noise[noise]:
                    rates = encoder.hit_rates(of_noise, seed, observers[number][1], session)
                    mean, spread = rates.mean(axis=0), rates.std(axis=0, ddof=1)  # over the repetitions (k)
                    found[number] = HitRates(mean, spread, seed, session)
    return [found[number] for number in range(len(observers))]


@checked
def checked_responses(responses: ArrayLike, silent_value: Finite | None = None) -> FloatArray:
    """Return responses as a table if they are valid for a discrimination, else raise `InputError`."""
    table = np.array(array("responses", responses), dtype=np.float64)
    silent = np.isnan(table)
    if table.size and (silent | (table == 0.0)).all():
        raise InputError(
            "responses",
            "must not all be silent",
            remedy="the population stays silent under every sphere, so there is no hit rate; increase the "
            "depth or use more sensitive afferents",
        )
    if silent.any() and silent_value is None:
        said = f"{silent.sum()} are NaN, as of silent receptors; give silent_value to replace them"
        raise InputError("responses", "must be finite", remedy=said)
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


def _picks(seed: int, trials: IntArray, shape: tuple[int, int], choices: int) -> IntArray:
    """Sample from 0 ... choices - 1, `shape` times in each trial; (n_trials, *shape)."""
    numbers = uniforms(seed, trials, 1, Purpose.PICK, shape[0] * shape[1])
    return (numbers * choices).astype(np.int64).reshape(-1, *shape)


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


@dataclass(frozen=True)
class NoiseFit:
    """Noise for which predicted hit rates are closest to observed ones."""

    noise_sigma: float  #: Standard deviation sigma_1 of the multiplicative noise.
    hit_rates: FloatArray  #: Predicted hit rates at that noise, (n_targets,). [0-1]
    root_mean_square_error: float  #: Of the predicted against the observed hit rates.


@checked
def expected_hit_rates(
    responses: ArrayLike,
    neighbours: ArrayLike,
    noise: AnyNoise,
    standard_normals: FloatArray,
    criterion: Finite = psychophysics.DECISION_CRITERION.value,
) -> FloatArray:
    """Predict the mean hit rates of a `GradientSum` without repeating the experiment.

    The same standard normal samples are used for every sphere and every noise, so the result is a smooth
    function of the noise, as `fit_noise_sigma` needs.
    """
    values = checked_responses(responses)
    pairs = check_neighbours(neighbours, values.shape[1])
    sums = shared_noise_gradient_sums(values, pairs, noise_of("noise", noise), standard_normals)
    means, spreads = sums.mean(axis=-1), sums.std(axis=-1, ddof=1)
    point = decision_point(means[0], means[1:], criterion)
    return hit_probability(point, means[1:], spreads[1:], side(means[np.newaxis]))


@checked
def expected_euclidean_hit_rates(responses: ArrayLike, noise: AnyNoise) -> FloatArray:
    """Predict the mean hit rates of an `EuclideanDistance`, city-block, in closed form.

    For one receptor the difference of two noisy responses a and b is normal, and its absolute value has

        m = s sqrt(2/pi) exp(-d^2 / 2 s^2) + d (1 - 2 Phi(-d/s)),    v = d^2 + s^2 - m^2,
        d = b - a,    s^2 = s_a^2 + s_b^2

    as mean and variance (the folded normal distribution). Receptors are independent, so both add up, and
    so do the third central moments,

        E|b - a|^3 - 3 m (d^2 + s^2) + 2 m^3.

    The sum over a population is close to normal but skewed, by 0.4 with the paper's 18 receptors. The first
    term of Edgeworth's series, g (z^2 - 1) phi(z) / 6 with the skewness g, corrects for it: without it hit
    rates near chance would be 0.02 too high.
    """
    values = checked_responses(responses)
    spread = noise_of("noise", noise).spread(values)
    d = np.abs(values - values[0])
    s = np.maximum(np.hypot(spread, spread[0]), np.finfo(float).tiny)  # both silent: no difference
    x = d / s
    tail, centre = np.sqrt(2.0 / np.pi) * np.exp(-0.5 * np.square(x)), 1.0 - 2.0 * ndtr(-x)
    m, second = s * (tail + x * centre), np.square(d) + np.square(s)
    third = s**3 * ((2.0 + x**2) * tail + (3.0 * x + x**3) * centre) - 3.0 * m * second + 2.0 * m**3
    means, spreads = m.sum(axis=1), np.sqrt((second - np.square(m)).sum(axis=1))
    larger = side(means[np.newaxis])
    point = decision_point(means[0], means[1:], psychophysics.DECISION_CRITERION.value)
    normal = hit_probability(point, means[1:], spreads[1:], larger)
    z = (means[1:] - point) / np.maximum(spreads[1:], np.finfo(float).tiny)
    skewness = third.sum(axis=1)[1:] / np.maximum(spreads[1:] ** 3, np.finfo(float).tiny)
    edgeworth = skewness / 6.0 * (np.square(z) - 1.0) * np.exp(-0.5 * np.square(z)) / np.sqrt(2.0 * np.pi)
    return np.clip(normal + larger * edgeworth, 0.0, 1.0)


@checked
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
