"""One number with its Monte-Carlo error for each statement of the paper about discrimination.

A session is the whole protocol with its own noise; the paper reports one. Within a session all observers of
one position share the same noise, so that differences between them are not due to chance. The value of a
statistic is the mean over the sessions and its error the standard deviation of that mean. Where it is the
largest of several differences, these are averaged over the sessions first: the largest of noisy numbers grows
with the noise.
"""

from __future__ import annotations

from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass
from itertools import pairwise

import numpy as np
from numpy.typing import ArrayLike
from scipy.special import ndtr, ndtri

from fingerpad.core.checked import checked, result_class
from fingerpad.core.errors import InputError
from fingerpad.core.signals import HitRates
from fingerpad.core.values import Finite, FloatArray, Number, Several, Vector, Whole, WholeVector
from fingerpad.data import psychophysics
from fingerpad.psychophysics.curve import binomial_interval
from fingerpad.psychophysics.encoding import check_neighbours, noisy_gradient_sums, session_trials
from fingerpad.psychophysics.observer import (
    EuclideanDistance,
    Experiment,
    NoiseFit,
    checked_responses,
    discriminate_by,
    fit_noise_sigma,
    hit_rates_of_sums,
)

CHANCE = 0.5


@result_class
class Estimate:
    """A mean over sessions and its standard error."""

    value: Number
    error: Number


@result_class
class NoiseEffect:
    """How the mean hit rate falls with the noise."""

    noise_sigma: Vector  # Noise sigma_1, (n_levels,).
    smallest_fall: Estimate  # From one level to the next. [0-1]


@result_class
class ErrorBarChange:
    """How a variant of the protocol changes the error bars."""

    ratio: Estimate  # Mean error bar over that of the reference. [1]
    change: Estimate  # Largest change of a mean hit rate. [0-1]


@result_class
class MeanStability:
    """Standard deviation of a mean hit rate when the same sums are judged again."""

    hit_rates: WholeVector  # Hit rates behind a mean, (2,).
    few: Estimate
    many: Estimate  # Standard deviation with either number. [0-1]
    ratio: Estimate  # The first over the second. [1]


@result_class
class NoiseSweep:
    """Misfit of the static Gradient Sum over the noise."""

    noise_sigma: Vector  # Noise sigma_1, (n_levels,).
    misfit: tuple[tuple[Estimate, ...], ...]  # Root mean square distance to Goodwin's points. [0-1]


@result_class
class TargetDistances:
    """Static hit rates of one position beside people's."""

    at_goodwin: tuple[Estimate, ...]  # Hit rates at Goodwin's spheres. [0-1]
    from_line: tuple[Estimate, ...]  # Distance from the line in z. [0-1]
    largest_from_line: Estimate  # Largest distance between Goodwin's points. [0-1]


@result_class
class DiscriminationStatistics:
    """Statistics behind the paper's statements; dictionaries go by code."""

    misfit: dict[str, Estimate]
    misfit_above_static: dict[str, Estimate]  # Distance to Goodwin's points (rms). [0-1]
    shift: dict[str, Estimate]
    shift_above_static: dict[str, Estimate]  # Largest change of a hit rate by the shift. [0-1]
    smallest_rise: dict[str, tuple[Estimate, ...]]  # Smallest step from one sphere to the next. [0-1]
    noise_lowers: NoiseEffect
    ten_matrices: ErrorBarChange
    criterion: ErrorBarChange  # 10 noise matrices instead of 100; a criterion that varies more.
    unsteadiness: MeanStability  # Means of 10 and of 100 hit rates.
    sweep: NoiseSweep
    targets: tuple[TargetDistances, ...]


def estimate(by_session: FloatArray) -> Estimate:
    by_session = np.asarray(by_session, dtype=np.float64)
    return Estimate(
        value=float(by_session.mean()), error=float(by_session.std(ddof=1) / np.sqrt(by_session.size))
    )


def extreme(by_session: FloatArray, pick: Callable[[FloatArray], np.intp]) -> Estimate:
    """Estimate the one of several quantities that `pick` chooses by their means over the sessions."""
    return estimate(by_session[:, int(pick(by_session.mean(axis=0)))])


def discrimination_statistics(
    observers: Observers, curvature_per_m: Sequence[float], measures: Sequence[str]
) -> DiscriminationStatistics:
    codes = [*measures, "euclidean"]
    others = [name for name in codes if name != "static"]
    columns = goodwin_columns(curvature_per_m)
    mean = observers.mean
    misfit = {name: goodwin_misfit(mean[name][..., columns], axis=(1, 2)) for name in codes}
    shift = {name: _largest(mean[name][:, 1] - mean[name][:, 0]) for name in codes}
    levels = [mean[f"sigma_{sigma:g}"].mean(axis=(1, 2)) for sigma in SWEPT_NOISE]
    little, much = (f"criterion_{sigma:g}" for sigma in CRITERION_SIGMAS)
    unsteadiness = {count: moved.mean(axis=1) for count, moved in observers.unsteadiness.items()}
    few, many = (unsteadiness[count] for count in sorted(unsteadiness))
    return DiscriminationStatistics(
        misfit={name: estimate(misfit[name]) for name in codes},
        misfit_above_static={name: estimate(misfit[name] - misfit["static"]) for name in others},
        shift=shift,
        shift_above_static={
            name: Estimate(
                value=shift[name].value - shift["static"].value,
                error=float(np.hypot(shift[name].error, shift["static"].error)),
            )
            for name in others
        },
        # Of the curve (n_sessions, n_comparisons); the first step is up from chance.
        smallest_rise={
            name: tuple(
                extreme(np.diff(one, axis=1, prepend=CHANCE), np.argmin) for one in mean[name].swapaxes(0, 1)
            )
            for name in codes
        },
        noise_lowers=NoiseEffect(
            noise_sigma=np.array(SWEPT_NOISE),
            smallest_fall=extreme(np.transpose([a - b for a, b in pairwise(levels)]), np.argmin),
        ),
        ten_matrices=_error_bars(observers, "ten_matrices", "static"),
        criterion=_error_bars(observers, much, little),
        unsteadiness=MeanStability(
            hit_rates=np.array([FEW, max(unsteadiness)]),
            few=estimate(few),
            many=estimate(many),
            ratio=estimate(few / many),
        ),
        sweep=NoiseSweep(
            noise_sigma=np.array(SWEPT_NOISE),
            misfit=tuple(
                tuple(
                    estimate(goodwin_misfit(mean[f"sigma_{sigma:g}"][:, place][:, columns], axis=1))
                    for sigma in SWEPT_NOISE
                )
                for place in range(mean["static"].shape[1])
            ),
        ),
        targets=tuple(_targets(one, columns, curvature_per_m) for one in mean["static"].swapaxes(0, 1)),
    )


def _largest(changes: FloatArray) -> Estimate:
    """Absolute size of the largest of several changes (n_sessions, n_changes)."""
    found = extreme(changes, lambda means: np.abs(means).argmax())
    return Estimate(value=abs(found.value), error=found.error)


def _error_bars(observers: Observers, variant: str, reference: str) -> ErrorBarChange:
    """How many times longer error bars are on average, and the largest change of a mean."""
    wide, usual = (observers.spread[name].mean(axis=(1, 2)) for name in (variant, reference))
    change = observers.mean[variant] - observers.mean[reference]
    return ErrorBarChange(ratio=estimate(wide / usual), change=_largest(change.reshape(len(change), -1)))


def _targets(hit_rates: FloatArray, columns: list[int], curvature_per_m: Sequence[float]) -> TargetDistances:
    """Hit rates (n_sessions, n_comparisons) of one position at Goodwin's points, and away from the line."""
    comparison = np.array(curvature_per_m[1:])
    between = [index for index in range(comparison.size) if index not in columns]
    away = hit_rates - line_in_z(comparison)
    return TargetDistances(
        at_goodwin=tuple(estimate(hit_rates[:, column]) for column in columns),
        from_line=tuple(estimate(column) for column in away.T),
        largest_from_line=_largest(away[:, between]),
    )


SESSIONS = 5  # Sessions of a study. The first is drawn; all of them give the Monte-Carlo error.
SWEPT_NOISE = tuple(round(0.015 + 0.01 * step, 3) for step in range(8))  # Over the paper's range of sigma_1.
FEW = 10  # Noise matrices, and hit rates, of the paper's smaller experiments.
AGAIN = 20  # Repetitions of the judgements of one session, which show how stable their mean is.
CRITERION_SIGMAS = psychophysics.DECISION_CRITERION_SIGMA.value

_PAPER = Experiment()
_FIRST_SESSION = 1  # Session 0 of a seed belongs to the fit of the noise.


@dataclass(frozen=True)
class Measured:
    """One response measure of the population at one position of the spheres."""

    responses: FloatArray  # The standard in the first row, (n_spheres, n_receptors). [any unit]
    neighbours: np.ndarray  # Pairs that the Gradient Sum goes over, (n_pairs, 2).

    def __post_init__(self) -> None:
        responses = checked_responses(self.responses)
        neighbours = check_neighbours(self.neighbours, responses.shape[1])
        if not len(neighbours):
            raise InputError("Measured needs neighbours that respond to every sphere: there are none.")
        object.__setattr__(self, "responses", responses)
        object.__setattr__(self, "neighbours", neighbours)


@dataclass(frozen=True)
class Observers:
    """Hit rates of every observer, session by session."""

    mean: dict[str, FloatArray]
    spread: dict[str, FloatArray]  # mu_3 and sigma_3, by the name of the observer. [0-1]
    unsteadiness: dict[int, FloatArray]
    """Standard deviation of mu_3 when the judgements of the static Gradient Sum are repeated, by the number
    of hit rates behind it. [0-1]"""


@checked
def observe(
    measures: Mapping[str, Sequence[Measured]], noise_sigma: Finite, seed: Whole, sessions: Several = SESSIONS
) -> Observers:
    """Simulate the judgements of every observer at every position in several sessions."""
    n_positions = len(measures["static"])
    judged = [
        _judge(
            {name: each[position] for name, each in measures.items()},
            noise_sigma,
            seed,
            _FIRST_SESSION + session * n_positions + position,
        )
        for session in range(sessions)
        for position in range(n_positions)
    ]
    shape = (sessions, n_positions, -1)
    return Observers(
        {name: np.reshape([rates[name].hit_rate for rates, _ in judged], shape) for name in judged[0][0]},
        {name: np.reshape([rates[name].hit_rate_sd for rates, _ in judged], shape) for name in judged[0][0]},
        {count: np.reshape([moved[count] for _, moved in judged], shape[:2]) for count in judged[0][1]},
    )


def _judge(
    measures: Mapping[str, Measured], noise_sigma: float, seed: int, session: int
) -> tuple[dict[str, HitRates], dict[int, float]]:
    """Hit rates of every observer at one position in one session, and how unstable their means are."""
    static, pairs = measures["static"].responses, measures["static"].neighbours

    def sums(
        responses: FloatArray, pairs: np.ndarray, sigma: FloatArray | float, plan: Experiment
    ) -> FloatArray:
        distributions, presentations = plan.sums_per_sphere
        trials = session_trials(session, responses.shape[-2], distributions)
        return noisy_gradient_sums(responses, pairs, sigma, seed, trials, presentations)

    rates = {
        name: hit_rates_of_sums(
            sums(one.responses, one.neighbours, noise_sigma, _PAPER), seed, session=session
        )
        for name, one in measures.items()
        if name != "static"
    }
    named = {"static": noise_sigma} | {f"sigma_{sigma:g}": sigma for sigma in SWEPT_NOISE}
    by_level = sums(np.array([static] * len(named)), pairs, np.array(list(named.values())), _PAPER)
    by_name = dict(zip(named, by_level, strict=True))
    rates |= {name: hit_rates_of_sums(one, seed, session=session) for name, one in by_name.items()}
    # The first of many presentations, or hit rates, are those of a smaller experiment.
    rates["ten_matrices"] = hit_rates_of_sums(by_name["static"][:, :, :FEW], seed, session=session)
    rates["ten_hit_rates"] = hit_rates_of_sums(by_name["static"], seed, Experiment(hit_rates=FEW), session)
    plans = [Experiment(criterion_sigma=sigma) for sigma in CRITERION_SIGMAS]
    many = sums(static, pairs, noise_sigma, plans[0])
    for plan in plans:
        rates[f"criterion_{plan.criterion_sigma:g}"] = hit_rates_of_sums(many, seed, plan, session)
    rates["euclidean"] = discriminate_by(EuclideanDistance(), static, noise_sigma, seed, session=session)
    unsteady = {
        count: _unsteadiness(by_name["static"], count, seed, session) for count in (FEW, _PAPER.hit_rates)
    }
    return rates, unsteady


def _unsteadiness(sums: FloatArray, hit_rates: int, seed: int, session: int) -> float:
    """Return how much the mean of so many hit rates varies (1 sd) between picks of the same sums."""
    plan = Experiment(hit_rates=hit_rates)
    means = [
        # Session numbers far beyond those of the study: no other step uses their random numbers.
        hit_rates_of_sums(sums, seed, plan, session * 1000 + 1_000_000 + again).hit_rate
        for again in range(AGAIN)
    ]
    return float(np.sqrt(np.var(means, axis=0, ddof=1).mean()))


CURVATURES = psychophysics.GOODWIN_CURVATURES.value
HIT_RATES = psychophysics.GOODWIN_HIT_RATES.value
TRIALS = int(psychophysics.GOODWIN_TRIALS.value)

SMALLEST_NOISE, LARGEST_NOISE = 1e-4, 2.0  # Bounds of the noise fitted to the observed hit rates.


@result_class
class GoodwinHitRates:
    """Hit rates of people."""

    curvature_per_m: Vector  # Comparison spheres, (2,). [1/m]
    hit_rate: Vector
    trials: int  # Trials behind each fraction (assumed).
    low: Vector
    high: Vector  # Observed fractions and their binomial 95 % intervals, (2,). [0-1]
    line: Vector  # Hit rates at the spheres of the study, on the line in z, (n_comparisons,). [0-1]


def line_in_z(curvature_per_m: ArrayLike) -> FloatArray:
    """Hit rates on the straight line in z that Goodwin's two points define."""
    (near, far), (z_near, z_far) = CURVATURES, ndtri(HIT_RATES)
    slope_m = (z_far - z_near) / (far - near)
    return ndtr(z_near + slope_m * (np.asarray(curvature_per_m, dtype=np.float64) - near))


def goodwin_hit_rates_at(curvature_per_m: ArrayLike) -> GoodwinHitRates:
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
    return [list(curvature_per_m).index(curvature) - 1 for curvature in CURVATURES]


def goodwin_misfit(hit_rates: FloatArray, axis: int | tuple[int, ...] | None = None) -> FloatArray:
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
