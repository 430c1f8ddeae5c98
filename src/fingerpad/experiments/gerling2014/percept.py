"""Level 3: how often two spheres are discriminated (paper, 2.2.3, 3.3, Figures 6-8).

A session is the whole protocol with its own noise; the paper reports one. Within a session all observers of
one position share the same noise, so that differences between them are not due to chance. The value of a
statistic is the mean over the sessions and its error the standard deviation of that mean. Where it is the
largest of several differences, these are averaged over the sessions first: the largest of noisy numbers grows
with the noise.
"""

from __future__ import annotations

from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass
from functools import partial

import numpy as np
from numpy.typing import ArrayLike
from scipy.optimize import brentq
from scipy.special import ndtr, ndtri

from fingerpad.core.checked import result_class
from fingerpad.core.errors import ConvergenceError
from fingerpad.core.random_streams import Purpose, normals
from fingerpad.core.signals import HitRates
from fingerpad.core.values import FloatArray, IntArray, Number, Vector, WholeVector
from fingerpad.data import protocol, psychophysics
from fingerpad.experiments.conditions import CURVATURES, POSITIONS_MM, RECEPTOR_X_MM
from fingerpad.experiments.scores import Estimate, difference, estimate, extreme, largest
from fingerpad.neuron.afferent import Afferent
from fingerpad.neuron.population import Population
from fingerpad.psychophysics.curve import binomial_interval
from fingerpad.psychophysics.encoding import (
    RESPONSE_MEASURES,
    Measured,
    gradient_sum,
    neighbour_pairs,
    noise_offset,
    taking_part,
)
from fingerpad.psychophysics.observer import (
    CRITERION_MOVES,
    END_OF_STIMULUS_MS,
    NOISE_DRAWS,
    Encoder,
    EuclideanDistance,
    Experiment,
    GradientSum,
    NoiseFit,
    compare_observers,
    discriminate_by,
    expected_euclidean_hit_rates,
    expected_hit_rates,
    fit_noise_sigma,
)
from fingerpad.skin.sampling import SkinResponse

CENTRE_MM = (RECEPTOR_X_MM, 0.0)  # Of the population. [mm]

GOODWIN_CURVATURES = psychophysics.GOODWIN_CURVATURES.value
HIT_RATES = psychophysics.GOODWIN_HIT_RATES.value
TRIALS = int(psychophysics.GOODWIN_TRIALS.value)
COLUMNS = [CURVATURES.index(curvature) - 1 for curvature in GOODWIN_CURVATURES]  # Among the comparisons.
BETWEEN = [column for column in range(len(CURVATURES) - 1) if column not in COLUMNS]
NOISE_BOUNDS = (1e-4, 2.0)  # Bounds of the noise fitted to the observed hit rates.

SESSIONS = 5  # Sessions of a study. The first is drawn; all of them give the Monte-Carlo error.
SWEPT_NOISE = tuple(round(0.015 + 0.01 * step, 3) for step in range(8))  # Over the paper's range of sigma_1.
FEW = 10  # Noise matrices, and hit rates, of the paper's smaller experiments.
MANY = Experiment().hit_rates
AGAIN = 20  # Repetitions of the judgements of one session, which show how stable their mean is.
CRITERION_SIGMAS = psychophysics.DECISION_CRITERION_SIGMA.value
CHANCE = 0.5
_FIRST_SESSION = 1  # Session 0 of a seed belongs to the fit of the noise.
DRAWS = 1000  # Common random presentations behind each interpretation.
CURVE_NOISE = tuple(round(0.01 * step, 2) for step in range(1, 31))  # Noise of the misfits of codes.
PATIENCE_MS = protocol.RAMP.value  # Time that an observer waits for first spikes: until the ramp ends. [ms]
STEEPEST = 20.0  # Largest multiple of the model's rise that is tried.

USED = {
    "static": "static, eight neighbours (used)",
    "dynamic": "dynamic, eight neighbours (used)",
    "latency": "latency of receptors that fire under every sphere (used)",
}
"""The interpretation by which the study decodes each measure."""


@result_class
class TargetDistances:
    """Static hit rates of one position beside people's."""

    at_goodwin: tuple[Estimate, ...]  #: Hit rates at Goodwin's spheres. [0-1]
    largest_from_line: Estimate  #: Largest distance from the line in z between Goodwin's points. [0-1]


@result_class
class DiscriminationStatistics:
    """Statistics behind the paper's statements; dictionaries go by code."""

    misfit: dict[str, Estimate]
    misfit_above_static: dict[str, Estimate]  #: Distance to Goodwin's points (rms). [0-1]
    shift: dict[str, Estimate]
    shift_above_static: dict[str, Estimate]  #: Largest change of a hit rate by the shift. [0-1]
    smallest_rise: dict[str, tuple[Estimate, ...]]  #: Smallest step from one sphere to the next. [0-1]
    noise_lowers: dict[str, Estimate]  #: "smallest_fall" of the mean hit rate to the next noise. [0-1]
    ten_matrices: dict[str, Estimate]
    criterion: dict[str, Estimate]
    """Noise matrices are fewer, or the criterion varies more: "ratio" of the mean error bars, and largest
    "change" of a mean hit rate. [1], [0-1]"""
    unsteadiness: dict[str, Estimate]
    """Standard deviation of the mean of "few" and of "many" hit rates when the same sums are judged again,
    and "ratio" of the two. [0-1], [1]"""
    targets: tuple[TargetDistances, ...]


@result_class
class Interpretation:
    """One interpretation of the steps that the paper leaves open, and its hit rates."""

    reading: str
    receptors: WholeVector  #: Receptors that take part, (n_positions,).
    rise: Vector  #: Rise of the Gradient Sum from the standard to the farthest sphere, (n_positions,).
    largest_shift: Number  #: Largest change of a hit rate by the shift, at the noise of the study. [0-1]
    noise_sigma: Number
    misfit: Number
    own_largest_shift: Number
    """Noise that fits people best, root mean square distance to them and largest change by the shift with it;
    NaN where no noise does. [1], [0-1], [0-1]"""


@result_class
class MisfitCurve:
    """Expected root mean square distance to Goodwin's points over the noise."""

    noise_sigma: Vector  #: Noise sigma_1, (n_levels,).
    misfit: dict[str, Vector]  #: By code, (n_levels,). [0-1]


@result_class
class DiscrepancyAnalysis:
    """Numbers behind the differences between the model's percept and the paper's."""

    rise_for_paper_noise: dict[str, Vector]
    """Rise of the Gradient Sum to the farthest sphere with which the paper's noise meets people's hit rate,
    by measure, (n_positions,); NaN where none does."""
    readings: tuple[Interpretation, ...]  #: Interpretations of the steps that the paper leaves open.
    criterion: dict[str, Vector]
    """Mean error bar by the spread of the criterion, "criterion_sigma", for each of `CRITERION_MOVES`: what
    varies with it, (n_spreads,). [0-1]"""
    misfit_curve: MisfitCurve
    euclidean: dict[str, Number]  #: Noise that fits the Euclidean Distance to people, as of `readings`.


@result_class
class GoodwinHitRates:
    """Hit rates of people."""

    curvature_per_m: Vector  #: Comparison spheres, (2,). [1/m]
    hit_rate: Vector
    trials: int  #: Trials behind each fraction (assumed).
    low: Vector
    high: Vector  #: Observed fractions and their binomial 95 % intervals, (2,). [0-1]


@result_class
class ObserverHitRates:
    """Hit rates of one observer in one session, as the paper reports them."""

    hit_rate: Vector
    hit_rate_sd: Vector
    hit_rate_shifted: Vector  #: Means with the spheres at 0.0 and at 0.2 mm, (n_comparisons,). [0-1]
    hit_rate_shifted_sd: Vector  #: Standard deviations, (n_comparisons,). [0-1]


@result_class
class SphereDiscrimination:
    """Hit rates of all observers at the noise that fits Goodwin's two points best."""

    seed: int
    sessions: int  #: Of all noise; repetitions of the protocol.
    curvature_per_m: Vector  #: The spheres, the standard first, (7,). [1/m]
    noise_sigma: float
    noise_sigma_paper: float  #: Fitted noise, and the paper's.
    goodwin: GoodwinHitRates  #: Of people.
    gradient_sum: dict[str, ObserverHitRates]
    euclidean: dict[str, ObserverHitRates]
    variants: dict[str, ObserverHitRates]  #: First session; variants of the static Gradient Sum by name.
    silent: tuple[str, ...]  #: Measures that are left out because the population stays silent.
    statistics: DiscriminationStatistics  #: Behind the paper's statements.
    reasons: DiscrepancyAnalysis  #: Why the numbers differ from the paper's.


HitRatesOfNoise = Callable[[float], FloatArray]
"""From a noise to the expected hit rates, (n_positions, n_comparisons)."""


@dataclass(frozen=True)
class Observers:
    """Hit rates of every observer, session by session."""

    mean: dict[str, FloatArray]
    spread: dict[str, FloatArray]
    """mu_3 and sigma_3, by the name of the observer, (n_sessions, n_positions, n_comparisons). [0-1]"""
    unsteadiness: dict[int, FloatArray]
    """Standard deviation of mu_3 when the judgements of the static Gradient Sum are repeated, by the number
    of hit rates behind it, (n_sessions, n_positions). [0-1]"""


def draws_of(population: Population, seed: int, count: int = NOISE_DRAWS) -> FloatArray:
    """Draw common random presentations of a population for expected hit rates, (count, n_receptors)."""
    return normals(seed, 1, len(population.positions_mm), Purpose.RESPONSE, count)[0].T


def discriminate_spheres(
    responses: Mapping[tuple[float, float], SkinResponse],
    afferent: Afferent,
    seed: int,
    sessions: int = SESSIONS,
) -> SphereDiscrimination:
    """Hit rates of both codes and all measures, at the noise that fits Goodwin's two points best."""
    population = Population.grid(afferent=afferent, centre_mm=CENTRE_MM)
    neighbours = neighbour_pairs(population.positions_mm, population.pitch_mm)
    maps = {key: population.respond(skin) for key, skin in responses.items()}
    tables = {
        name: [
            np.array([read(maps[position, curvature]) for curvature in CURVATURES])
            for position in POSITIONS_MM
        ]
        for name, read in RESPONSE_MEASURES.items()
    }
    encoded = {
        name: [
            taking_part(table, neighbours, noise_offset(name, population.noise_offset_hz)) for table in both
        ]
        for name, both in tables.items()
    }
    # A measure without responses has no hit rate and is left out.
    measures = {
        name: both
        for name, both in encoded.items()
        if name == "static" or all(len(one.neighbours) and one.responses.any() for one in both)
    }
    draws = draws_of(population, seed)
    noise = fit_noise_to_goodwin(partial(expected_of_measure, measures["static"], draws))
    observers = observe(measures, noise.noise_sigma, seed, sessions)
    drawn = {}
    for name in observers.mean:
        (rate, shifted), (spread, spread_shifted) = observers.mean[name][0], observers.spread[name][0]
        drawn[name] = ObserverHitRates(
            hit_rate=rate, hit_rate_sd=spread, hit_rate_shifted=shifted, hit_rate_shifted_sd=spread_shifted
        )
    return SphereDiscrimination(
        seed=seed,
        sessions=sessions,
        curvature_per_m=np.array(CURVATURES),
        noise_sigma=noise.noise_sigma,
        noise_sigma_paper=psychophysics.NOISE_SIGMA.value,
        goodwin=goodwin_hit_rates(),
        gradient_sum={name: drawn[name] for name in measures},
        euclidean={"static": drawn["euclidean"]},
        variants={name: one for name, one in drawn.items() if name not in (*measures, "euclidean")},
        silent=tuple(name for name in RESPONSE_MEASURES if name not in measures),
        statistics=discrimination_statistics(observers, tuple(measures)),
        reasons=discrepancy_analysis(
            measures, tables["latency"], population, noise.noise_sigma, draws[:DRAWS], seed
        ),
    )


# People


def line_in_z(curvature_per_m: ArrayLike) -> FloatArray:
    """Hit rates on the straight line in z that Goodwin's two points define."""
    (near, far), (z_near, z_far) = GOODWIN_CURVATURES, ndtri(HIT_RATES)
    slope_m = (z_far - z_near) / (far - near)
    return ndtr(z_near + slope_m * (np.asarray(curvature_per_m, dtype=np.float64) - near))


def goodwin_hit_rates() -> GoodwinHitRates:
    low, high = binomial_interval(HIT_RATES, TRIALS)
    return GoodwinHitRates(
        curvature_per_m=np.array(GOODWIN_CURVATURES),
        hit_rate=np.array(HIT_RATES),
        trials=TRIALS,
        low=low,
        high=high,
    )


def goodwin_misfit(hit_rates: FloatArray, axis: int | tuple[int, ...] | None = None) -> FloatArray:
    """Root mean square distance of hit rates (..., n_comparisons) to Goodwin's two points."""
    return np.sqrt(np.square(hit_rates[..., COLUMNS] - np.array(HIT_RATES)).mean(axis=axis))


def expected_of_measure(measures: Sequence[Measured], draws: FloatArray, noise_sigma: float) -> FloatArray:
    """Return the expected hit rates (n_positions, n_comparisons) of the Gradient Sum."""
    return np.array(
        [expected_hit_rates(one.responses, one.neighbours, one.noise(noise_sigma), draws) for one in measures]
    )


def fit_noise_to_goodwin(hit_rates: HitRatesOfNoise) -> NoiseFit:
    """Fit one noise to Goodwin's two points at both positions of the spheres."""
    targets = np.tile(HIT_RATES, len(POSITIONS_MM))
    return fit_noise_sigma(lambda sigma: hit_rates(sigma)[:, COLUMNS].ravel(), targets, NOISE_BOUNDS)


# Sessions


def observe(
    measures: Mapping[str, Sequence[Measured]], noise_sigma: float, seed: int, sessions: int = SESSIONS
) -> Observers:
    """Simulate the judgements of every observer at every position in several sessions."""
    n_positions, judged = len(measures["static"]), []
    for trial in range(sessions * n_positions):
        here = {name: each[trial % n_positions] for name, each in measures.items()}
        given = here, noise_sigma, seed, _FIRST_SESSION + trial
        judged.append((_judge(*given), _unsteady(*given)))

    def table(values: list[FloatArray] | list[float]) -> FloatArray:
        return np.reshape(values, (sessions, n_positions, -1))

    return Observers(
        {name: table([rates[name].hit_rate for rates, _ in judged]) for name in judged[0][0]},
        {name: table([rates[name].hit_rate_sd for rates, _ in judged]) for name in judged[0][0]},
        {count: table([moved[count] for _, moved in judged])[..., 0] for count in (FEW, MANY)},
    )


def _judge(
    measures: Mapping[str, Measured], noise_sigma: float, seed: int, session: int
) -> dict[str, HitRates]:
    """Hit rates of every observer at one position in one session."""
    static, usual = measures["static"], Experiment()
    noise = static.noise(noise_sigma)
    plans = {"static": (noise, usual)}
    plans |= {f"sigma_{sigma:g}": (static.noise(sigma), usual) for sigma in SWEPT_NOISE}
    plans["ten_matrices"] = noise, Experiment(presentations=FEW)
    for sigma in CRITERION_SIGMAS:
        plans[f"criterion_{sigma:g}"] = noise, Experiment(criterion_sigma=sigma)
    code, asked = GradientSum(static.neighbours), list(plans.values())
    found = compare_observers(code, static.responses, asked, seed, session=session)
    rates = dict(zip(plans, found, strict=True))
    others: dict[str, tuple[Encoder, Measured]] = {
        name: (GradientSum(one.neighbours), one) for name, one in measures.items() if name != "static"
    }
    others["euclidean"] = EuclideanDistance(), static
    for name, (encoder, one) in others.items():
        rates[name] = discriminate_by(encoder, one.responses, one.noise(noise_sigma), seed, session=session)
    return rates


def _unsteady(
    measures: Mapping[str, Measured], noise_sigma: float, seed: int, session: int
) -> dict[int, float]:
    """How much the mean of few and of many hit rates varies (1 sd) between picks of the same sums."""
    static, usual = measures["static"], Experiment()
    code, noises = GradientSum(static.neighbours), [static.noise(noise_sigma)]
    (sums,) = code.values(static.responses, noises, seed, code.sizes(usual), session)
    # Session numbers far beyond those of the study: no other step uses their random numbers.
    again = [session * 1000 + 1_000_000 + repeat for repeat in range(AGAIN)]
    found = {}
    for count in (FEW, MANY):
        plan = Experiment(hit_rates=count)
        means = [code.hit_rates(sums, seed, plan, number).mean(axis=0) for number in again]
        found[count] = float(np.sqrt(np.var(means, axis=0, ddof=1).mean()))
    return found


def discrimination_statistics(observers: Observers, measures: Sequence[str]) -> DiscriminationStatistics:
    codes = [*measures, "euclidean"]
    mean, swept = observers.mean, [f"sigma_{sigma:g}" for sigma in SWEPT_NOISE]
    misfit = {name: goodwin_misfit(mean[name], axis=(1, 2)) for name in codes}
    shift = {name: largest(mean[name][:, 1] - mean[name][:, 0]) for name in codes}
    levels = [mean[name].mean(axis=(1, 2)) for name in swept]
    little, much = (f"criterion_{sigma:g}" for sigma in CRITERION_SIGMAS)
    few, many = (observers.unsteadiness[count].mean(axis=1) for count in (FEW, MANY))
    return DiscriminationStatistics(
        misfit={name: estimate(misfit[name]) for name in codes},
        misfit_above_static={name: estimate(misfit[name] - misfit["static"]) for name in codes[1:]},
        shift=shift,
        shift_above_static={name: difference(shift[name], shift["static"]) for name in codes[1:]},
        # Of the curve (n_sessions, n_comparisons); the first step is up from chance.
        smallest_rise={
            name: tuple(
                extreme(np.diff(one, axis=1, prepend=CHANCE), np.argmin) for one in mean[name].swapaxes(0, 1)
            )
            for name in codes
        },
        noise_lowers={"smallest_fall": extreme(-np.diff(levels, axis=0).T, np.argmin)},
        ten_matrices=_error_bars(observers, "ten_matrices", "static"),
        criterion=_error_bars(observers, much, little),
        unsteadiness={"few": estimate(few), "many": estimate(many), "ratio": estimate(few / many)},
        targets=tuple(_targets(one) for one in mean["static"].swapaxes(0, 1)),
    )


def _error_bars(observers: Observers, variant: str, reference: str) -> dict[str, Estimate]:
    """How many times longer error bars are on average, and the largest change of a mean."""
    wide, usual = (observers.spread[name].mean(axis=(1, 2)) for name in (variant, reference))
    change = observers.mean[variant] - observers.mean[reference]
    return {"ratio": estimate(wide / usual), "change": largest(change.reshape(len(change), -1))}


def _targets(hit_rates: FloatArray) -> TargetDistances:
    """Hit rates (n_sessions, n_comparisons) of one position at Goodwin's points, and away from the line."""
    away = hit_rates - line_in_z(CURVATURES[1:])
    return TargetDistances(
        at_goodwin=tuple(estimate(hit_rates[:, column]) for column in COLUMNS),
        largest_from_line=largest(away[:, BETWEEN]),
    )


# Why the numbers differ from the paper's


def discrepancy_analysis(
    measures: Mapping[str, Sequence[Measured]],
    latency_ms: Sequence[FloatArray],
    population: Population,
    noise_sigma: float,
    draws: FloatArray,
    seed: int,
) -> DiscrepancyAnalysis:
    """How steep the responses are, which steepness the paper's noise would need, and other readings."""
    codes: dict[str, HitRatesOfNoise] = {
        name: partial(expected_of_measure, both, draws) for name, both in measures.items()
    }
    codes["euclidean"] = apart = lambda sigma: np.array(
        [expected_euclidean_hit_rates(one.responses, one.noise(sigma)) for one in measures["static"]]
    )
    static, paper_noise = measures["static"][0], psychophysics.NOISE_SIGMA.value
    # The mean error bar for each quantity that the criterion may multiply.
    given = GradientSum(static.neighbours), static.responses, static.noise(noise_sigma), seed
    bars = {
        moves: [
            discriminate_by(*given, Experiment(criterion_sigma=sigma, criterion_moves=moves)).hit_rate_sd
            for sigma in CRITERION_SIGMAS
        ]
        for moves in CRITERION_MOVES
    }
    return DiscrepancyAnalysis(
        rise_for_paper_noise={
            name: np.array([rise_needed(one, paper_noise, draws) for one in both])
            for name, both in measures.items()
        },
        readings=tuple(
            _interpretation(name, both, noise_sigma, draws)
            for name, both in _readings(measures, latency_ms, population).items()
        ),
        criterion={
            "criterion_sigma": np.array(CRITERION_SIGMAS),
            **{moves: np.array([spread.mean() for spread in those]) for moves, those in bars.items()},
        },
        misfit_curve=MisfitCurve(
            noise_sigma=np.array(CURVE_NOISE),
            misfit={
                name: np.array([goodwin_misfit(rates(sigma)) for sigma in CURVE_NOISE])
                for name, rates in codes.items()
            },
        ),
        euclidean=own_noise(apart),
    )


def rise_needed(measured: Measured, noise_sigma: float, draws: FloatArray) -> float:
    """Rise of the Gradient Sum that gives the farthest sphere Goodwin's hit rate at some noise.

    The pattern is kept: the change of responses from the standard to the farthest comparison is scaled.
    """
    standard, farthest = measured.responses[[0, -1]]

    def pair(way: float) -> FloatArray:
        return np.array([standard, standard + way * (farthest - standard)])

    def missed(way: float) -> float:
        hit_rates = expected_hit_rates(pair(way), measured.neighbours, measured.noise(noise_sigma), draws)
        return float(hit_rates[0]) - HIT_RATES[-1]

    if np.array_equal(standard, farthest) or missed(STEEPEST) < 0.0:
        return float("nan")
    return _rise(pair(brentq(missed, 0.0, STEEPEST, xtol=1e-6)), measured.neighbours)


def _rise(responses: FloatArray, neighbours: IntArray) -> float:
    """Share by which the Gradient Sum of the last sphere is above that of the first."""
    sums = gradient_sum(responses, neighbours)
    return float(sums[-1] / sums[0] - 1.0) if sums[0] else float("nan")


def _readings(
    measures: Mapping[str, Sequence[Measured]], latency_ms: Sequence[FloatArray], population: Population
) -> dict[str, list[Measured]]:
    """Measures as the study decodes them, and alternatives; one without any pair of receptors is left out."""
    eight, four = (neighbour_pairs(population.positions_mm, population.pitch_mm, count) for count in (8, 4))
    early = [np.where(latency <= PATIENCE_MS, latency, np.nan) for latency in latency_ms]
    found = {
        USED["static"]: list(measures["static"]),
        "static, four neighbours": [one._replace(neighbours=four) for one in measures["static"]],
        USED["dynamic"]: list(measures.get("dynamic", [])),
        USED["latency"]: list(measures.get("latency", [])),
        "latency of receptors that fire within the ramp under every sphere": [
            taking_part(latency, eight) for latency in early
        ],
        "latency, waiting until the ramp ends": [
            Measured(np.fmin(latency, PATIENCE_MS), eight) for latency in latency_ms
        ],
        "latency, a silent receptor counting as the end of the stimulus": [
            Measured(np.where(np.isnan(latency), END_OF_STIMULUS_MS, latency), eight)
            for latency in latency_ms
        ],
    }
    return {name: both for name, both in found.items() if both and all(len(one.neighbours) for one in both)}


def _interpretation(
    name: str, both: Sequence[Measured], noise_sigma: float, draws: FloatArray
) -> Interpretation:
    """Judge an interpretation at the study's noise and at its own, which may not exist."""
    rates = partial(expected_of_measure, both, draws)
    here, aside = rates(noise_sigma)
    return Interpretation(
        reading=name,
        receptors=np.array([len(np.unique(one.neighbours)) for one in both]),
        rise=np.array([_rise(one.responses, one.neighbours) for one in both]),
        largest_shift=float(np.abs(aside - here).max()),
        **own_noise(rates),
    )


def own_noise(hit_rates: HitRatesOfNoise) -> dict[str, float]:
    """Noise that fits people best, as `Interpretation` has it; NaN where no noise does."""
    try:
        own = fit_noise_to_goodwin(hit_rates)
    except ConvergenceError:
        return dict.fromkeys(("noise_sigma", "misfit", "own_largest_shift"), np.nan)
    here, aside = hit_rates(own.noise_sigma)
    return {
        "noise_sigma": own.noise_sigma,
        "misfit": own.root_mean_square_error,
        "own_largest_shift": float(np.abs(aside - here).max()),
    }
