"""A population read by a code and a measure: hit rates, what is behind them, and a psychometric curve."""

from __future__ import annotations

from collections.abc import Sequence
from typing import Any

import numpy as np

from fingerpad.core.checks import FloatArray
from fingerpad.core.errors import ConvergenceError, InputError
from fingerpad.core.random_streams import IntArray, Purpose, normals
from fingerpad.core.signals import HitRates, ResponseMap
from fingerpad.experiments.discrimination.task import CurveSettings
from fingerpad.psychophysics import bootstrap, fit_psychometric, posterior
from fingerpad.psychophysics.discrimination import (
    Experiment,
    discriminate_euclidean,
    discriminate_gradient_sum,
)
from fingerpad.psychophysics.encoding import RESPONSE_MEASURES, answering_neighbours, distance
from fingerpad.psychophysics.noise_fit import NOISE_DRAWS, NoiseFit, expected_hit_rates, fit_noise_sigma
from fingerpad.psychophysics.noisy_responses import noisy_gradient_sums, noisy_responses, session_trials

SESSION = 1
"""Session of the random numbers: that of the reproduction's spheres at 0.0 mm."""

SHOWN_PRESENTATIONS = 1000
"""Presentations behind the mean and spread of a statistic that a figure shows."""

CURVE_POINTS = 61
CREDIBLE = 0.95


def responses(answers: Sequence[ResponseMap], measure: str, patience_ms: float | None = None) -> FloatArray:
    """Return one measure of every receptor under every stimulus.

    Parameters
    ----------
    answers : sequence of ResponseMap
        Of the population, stimulus by stimulus.
    measure : {"static", "dynamic", "latency"}
        Rates in the hold or the ramp, or first-spike latency.
    patience_ms : float, optional
        How long the observer waits for first spikes: a later one, or none, counts as that. [ms]

    Returns
    -------
    array (n_stimuli, n_receptors)
        NaN where a receptor has no latency. [spikes/s or ms]
    """
    table = np.array([RESPONSE_MEASURES[measure](answer) for answer in answers])
    return table if measure != "latency" or patience_ms is None else np.fmin(table, patience_ms)


def silent_stimuli(table: FloatArray, measure: str, patience_ms: float | None = None) -> IntArray:
    """Find the stimuli under which nobody answers, as far as a measure tells.

    Parameters
    ----------
    table, measure, patience_ms
        Of and as in `responses`.

    Returns
    -------
    int array (n_silent,)
        Rows of the table. For latencies, if nobody fires under every stimulus, those under which fewest do.
    """
    if measure != "latency" or patience_ms is not None:
        return np.flatnonzero((table == (patience_ms if measure == "latency" else 0.0)).all(axis=1))
    missing = np.isnan(table)
    if not missing.any(axis=0).all():
        return np.empty(0, dtype=np.int64)
    return np.flatnonzero(missing.sum(axis=1) == missing.sum(axis=1).max())


def taking_part(table: FloatArray, neighbours: np.ndarray) -> tuple[FloatArray, np.ndarray]:
    """Let receptors that are silent under one stimulus take no part under any, as in the reproduction.

    See docs/decisions/silent-receptors.md.

    Parameters
    ----------
    table : array (n_stimuli, n_receptors)
        From `responses`, NaN for silence.
    neighbours : int array (n_pairs, 2)
        Who is whose neighbour.

    Returns
    -------
    (array (n_stimuli, n_receptors), int array (n_pairs, 2))
        Zeros for those that take no part, and the pairs without them.

    Examples
    --------
    >>> table, pairs = taking_part(np.array([[20.0, 25.0, np.nan], [20.0, 24.0, 90.0]]), [[0, 1], [1, 2]])
    >>> table.tolist(), pairs.tolist()
    ([[20.0, 25.0, 0.0], [20.0, 24.0, 0.0]], [[0, 1]])
    """
    return np.where(np.isnan(table).any(axis=0), 0.0, table), answering_neighbours(table, neighbours)


def hit_rates(
    code: str, table: FloatArray, neighbours: np.ndarray, noise_sigma: float, seed: int, plan: Experiment
) -> HitRates:
    """Hit rates of every comparison by a code.

    Parameters
    ----------
    code : {"gradient_sum", "euclidean"}
        How the population is read.
    table : array (n_stimuli, n_receptors)
        From `responses`, the standard first.
    neighbours : int array (n_pairs, 2)
        Who is whose neighbour, for Gradient Sum.
    noise_sigma : float
        Standard deviation of the multiplicative noise.
    seed : int
        Of the random numbers.
    plan : Experiment
        Repetitions and criterion.

    Returns
    -------
    HitRates
    """
    if code == "euclidean":
        return discriminate_euclidean(table, noise_sigma, seed, plan, session=SESSION)
    return discriminate_gradient_sum(table, neighbours, noise_sigma, seed, plan, session=SESSION)


def fitted_noise(
    code: str,
    table: FloatArray,
    neighbours: np.ndarray,
    comparisons: Sequence[int],
    observed: Sequence[float],
    seed: int,
    plan: Experiment,
) -> NoiseFit:
    """Noise that brings a code closest to observed hit rates.

    Parameters
    ----------
    code, table, neighbours, seed, plan
        As in `hit_rates`.
    comparisons : sequence of int
        Which comparisons were observed, from 0.
    observed : sequence of float
        Their hit rates. [0-1]

    Returns
    -------
    NoiseFit

    Raises
    ------
    ConvergenceError
        If no noise meets them.
    """
    chosen = list(comparisons)

    def by_distance(sigma: float) -> FloatArray:
        return hit_rates(code, table, neighbours, sigma, seed, plan).hit_rate[chosen]

    draws = normals(seed, 1, table.shape[1], Purpose.RESPONSE, NOISE_DRAWS)[0].T

    def by_gradient(sigma: float) -> FloatArray:
        return expected_hit_rates(table, neighbours, sigma, draws, plan.criterion)[chosen]

    return fit_noise_sigma(by_distance if code == "euclidean" else by_gradient, observed)


def statistic(
    code: str, table: FloatArray, neighbours: np.ndarray, noise_sigma: float, seed: int
) -> dict[str, FloatArray]:
    """Say what a code makes of every stimulus: its Gradient Sum, or its distance from the standard.

    Parameters
    ----------
    code, table, neighbours, noise_sigma, seed
        As in `hit_rates`.

    Returns
    -------
    dict of str to array (n_stimuli,)
        `mean` and `sd`. [unit of the table]
    """
    n_stimuli = len(table)
    if code == "euclidean":
        sets = noisy_responses(
            table, noise_sigma, seed, session_trials(SESSION, n_stimuli), 2 * SHOWN_PRESENTATIONS
        )
        # The standard meets other presentations of itself.
        values = distance(sets[:1, :SHOWN_PRESENTATIONS], sets[:, SHOWN_PRESENTATIONS:])
    else:
        trials = session_trials(SESSION, n_stimuli, 1)
        sums = noisy_gradient_sums(table, neighbours, noise_sigma, seed, trials, SHOWN_PRESENTATIONS)
        values = sums[:, 0]
    return {"mean": values.mean(axis=1), "sd": values.std(axis=1, ddof=1)}


def curves(
    levels: Sequence[float], rates: FloatArray, trials: int, settings: CurveSettings, seed: int
) -> list[dict[str, Any]]:
    """Psychometric curves through hit rates, on either side of the standard.

    A curve runs over the distance from the standard, at which nobody does better than chance. The intervals
    are those of an experiment with so many trials per comparison that finds these hit rates.

    Parameters
    ----------
    levels : sequence of float
        Of the stimuli, the standard first. [unit of what varies]
    rates : array (n_comparisons,)
        Hit rates. [0-1]
    trials : int
        Per comparison.
    settings : CurveSettings
        Shape of the curve, and where its threshold is read.
    seed : int
        Of the bootstrap.

    Returns
    -------
    list of dict
        One per side that has a comparison: `side`, `difference`, `hit_rate`, and either the curve or, where
        there is none, `why_not`.

    Examples
    --------
    >>> found = curves([10.0, 11.0, 12.0, 14.0], np.array([0.6, 0.75, 0.95]), 200, CurveSettings(), seed=1)
    >>> found[0]["side"], round(found[0]["threshold"]["difference"], 1)
    ('above', 2.0)
    """
    standard, others = levels[0], np.asarray(levels[1:], dtype=np.float64)
    found = []
    for side, sign in (("above", 1.0), ("below", -1.0)):
        difference = sign * (others - standard)
        order = [int(row) for row in np.argsort(difference) if difference[row] > 0.0]
        if order:
            told = {"side": side, "difference": difference[order], "hit_rate": rates[order]}
            try:
                told |= _curve(standard, sign, difference[order], rates[order], trials, settings, seed)
            except (ConvergenceError, InputError) as error:
                told["why_not"] = str(error).splitlines()[0]
            found.append(told)
    return found


def _curve(
    standard: float,
    sign: float,
    difference: FloatArray,
    rates: FloatArray,
    trials: int,
    settings: CurveSettings,
    seed: int,
) -> dict[str, Any]:
    """One curve with its threshold, intervals and band."""
    if difference.size < 2:
        raise InputError("A curve needs two comparisons on a side of the standard or more: got 1.")
    counts = np.round(rates * trials)
    lapse = None if isinstance(settings.lapse, str) else settings.lapse  # free, to be fitted
    fit = fit_psychometric(
        difference, counts, np.full(rates.size, trials), sigmoid=settings.sigmoid, lapse=lapse
    )
    wanted = settings.proportion
    threshold = fit.threshold(wanted)
    clouds = {"bootstrap": bootstrap(fit, seed), "posterior": posterior(fit)}
    at = np.linspace(0.0, 1.05 * difference[-1], CURVE_POINTS + 1)[1:]
    low, high = clouds["posterior"].band(at, CREDIBLE)
    return {
        "sigmoid": settings.sigmoid,
        "trials": trials,
        "threshold": {
            "proportion": wanted,
            "difference": threshold,
            "level": standard + sign * threshold,
            "over_standard": threshold / abs(standard) if standard else None,
            **{
                f"{kind}_interval": cloud.threshold_interval(wanted, CREDIBLE)
                for kind, cloud in clouds.items()
            },
        },
        "slope": fit.slope(wanted),
        "lapse": fit.function.lapse,
        "at_bounds": fit.at_bounds,
        "curve": {
            "difference": at,
            "level": standard + sign * at,
            "proportion": fit.predict(at),
            "low": low,
            "high": high,
        },
    }
