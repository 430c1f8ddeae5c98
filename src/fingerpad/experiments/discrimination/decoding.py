"""Decoding of a population by a code and a measure: hit rates, their statistic, and psychometric curves."""

from __future__ import annotations

import math
from collections.abc import Sequence

import numpy as np

from fingerpad.core.checked import result_class
from fingerpad.core.errors import ConvergenceError, InputError
from fingerpad.core.signals import ResponseMap
from fingerpad.core.values import FloatArray, IntArray, Number, Vector
from fingerpad.experiments.discrimination.request import CurveSettings
from fingerpad.psychophysics.curve_fit import fit_psychometric
from fingerpad.psychophysics.curve_uncertainty import bootstrap, posterior
from fingerpad.psychophysics.encoding import RESPONSE_MEASURES
from fingerpad.psychophysics.observer import Encoder, Experiment, NoiseFit, fit_noise_sigma

SESSION = 1  # Session of the random numbers: that of the reproduction's spheres at 0.0 mm.
SHOWN_PRESENTATIONS = 1000  # Presentations behind the mean and spread of a statistic that a figure shows.
CURVE_POINTS = 61
CREDIBLE = 0.95


@result_class
class TaskStatistic:
    """Mean and standard deviation of a code's statistic over noisy presentations, (n_stimuli,)."""

    mean: Vector
    sd: Vector


@result_class
class CurveThreshold:
    """Threshold of a psychometric curve."""

    proportion: float  # Hit rate at the threshold. [0-1]
    difference: Number
    level: Number  # From the standard, and on the axis. [unit of what varies]
    over_standard: float | None  # Difference over standard (Weber fraction); absent where that is 0.
    bootstrap_interval: tuple[Number, Number] | None
    posterior_interval: tuple[Number, Number]
    """Confidence and credible interval of the difference; the former is absent where no comparison lies on
    the rise of the curve. [unit of what varies]"""


@result_class
class CurvePoints:
    """A fitted curve at points (n_points,), with its credible band."""

    difference: Vector
    level: Vector
    proportion: Vector
    low: Vector
    high: Vector


@result_class
class CurveFit:
    """A fitted psychometric curve."""

    sigmoid: str
    trials: int  # Judgements per comparison behind the intervals.
    threshold: CurveThreshold  # At the proportion that the task asks for.
    slope: Number  # Of the hit rate at the threshold; NaN where no comparison lies on the rise.
    lapse: float  # What is missing to 1 far above the threshold. [0-1]
    at_bounds: tuple[str, ...]  # Parameters that ended at a bound.
    curve: CurvePoints


@result_class
class SideCurve:
    """Hit rates on one side of the standard, with their curve or the reason why there is none."""

    side: str  # Of the standard.
    difference: Vector
    hit_rate: Vector  # Distance from the standard, and hit rate, (n_comparisons,).
    fit: CurveFit | None = None
    why_not: str | None = None  # Why there is no curve.


def response_table(maps: Sequence[ResponseMap], measure: str, latest_ms: float | None = None) -> FloatArray:
    table = np.array([RESPONSE_MEASURES[measure](answer) for answer in maps])
    return table if measure != "latency" or latest_ms is None else np.fmin(table, latest_ms)


def silent_stimuli(table: FloatArray, measure: str, latest_ms: float | None = None) -> IntArray:
    if measure != "latency" or latest_ms is not None:
        return np.flatnonzero((table == (latest_ms if measure == "latency" else 0.0)).all(axis=1))
    missing = np.isnan(table)
    if not missing.any(axis=0).all():
        return np.empty(0, dtype=np.int64)
    return np.flatnonzero(missing.sum(axis=1) == missing.sum(axis=1).max())


def fit_task_noise(
    encoder: Encoder,
    table: FloatArray,
    comparisons: Sequence[int],
    observed: Sequence[float],
    seed: int,
    plan: Experiment,
) -> NoiseFit:
    chosen, predict = list(comparisons), encoder.predictor(table, seed, plan, SESSION)
    return fit_noise_sigma(lambda sigma: predict(sigma)[chosen], observed)


def task_statistic(encoder: Encoder, table: FloatArray, noise_sigma: float, seed: int) -> TaskStatistic:
    values = encoder.of_noisy(table, noise_sigma, seed, SESSION, SHOWN_PRESENTATIONS)
    return TaskStatistic(mean=values.mean(axis=1), sd=values.std(axis=1, ddof=1))


def side_curves(
    levels: Sequence[float], rates: FloatArray, trials: int, settings: CurveSettings, seed: int
) -> tuple[SideCurve, ...]:
    """Psychometric curves through hit rates, on either side of the standard.

    A curve runs over the distance from the standard, where the hit rate is chance. The intervals are those of
    an experiment with so many trials per comparison that finds these hit rates.
    """
    standard, others = levels[0], np.asarray(levels[1:], dtype=np.float64)
    found = []
    for side, sign in (("above", 1.0), ("below", -1.0)):
        difference = sign * (others - standard)
        order = [int(row) for row in np.argsort(difference) if difference[row] > 0.0]
        if not order:
            continue
        fit, why_not = None, None
        try:
            fit = _curve_fit(standard, sign, difference[order], rates[order], trials, settings, seed)
        except (ConvergenceError, InputError) as error:
            why_not = str(error).splitlines()[0]
        found.append(
            SideCurve(
                side=side, difference=difference[order], hit_rate=rates[order], fit=fit, why_not=why_not
            )
        )
    return tuple(found)


def _curve_fit(
    standard: float,
    sign: float,
    difference: FloatArray,
    rates: FloatArray,
    trials: int,
    settings: CurveSettings,
    seed: int,
) -> CurveFit:
    if difference.size < 2:
        raise InputError("A curve needs two comparisons on a side of the standard or more: got 1.")
    counts = np.round(rates * trials)
    lapse = None if isinstance(settings.lapse, str) else settings.lapse  # free, to be fitted
    fit = fit_psychometric(
        difference, counts, np.full(rates.size, trials), sigmoid=settings.sigmoid, lapse=lapse
    )
    wanted = settings.proportion
    threshold = fit.threshold(wanted)
    of_posterior = posterior(fit)
    at = np.linspace(0.0, 1.05 * difference[-1], CURVE_POINTS + 1)[1:]
    low, high = of_posterior.band(at, CREDIBLE)
    return CurveFit(
        sigmoid=settings.sigmoid,
        trials=trials,
        threshold=CurveThreshold(
            proportion=wanted,
            difference=threshold,
            level=standard + sign * threshold,
            over_standard=threshold / abs(standard) if standard else None,
            bootstrap_interval=(
                None if fit.is_step else bootstrap(fit, seed).threshold_interval(wanted, CREDIBLE)
            ),
            posterior_interval=of_posterior.threshold_interval(wanted, CREDIBLE),
        ),
        slope=math.nan if fit.is_step else fit.slope(wanted),
        lapse=fit.function.lapse,
        at_bounds=fit.at_bounds,
        curve=CurvePoints(
            difference=at, level=standard + sign * at, proportion=fit.predict(at), low=low, high=high
        ),
    )
