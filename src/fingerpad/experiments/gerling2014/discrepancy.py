"""Why our percept differs from the paper's: how steeply responses rise, and how else a step may be read."""

from __future__ import annotations

from collections.abc import Callable, Mapping, Sequence
from dataclasses import replace
from functools import partial
from typing import Any

import numpy as np
from scipy.optimize import brentq

from fingerpad.core.checks import FloatArray
from fingerpad.core.errors import ConvergenceError
from fingerpad.data import protocol, psychophysics
from fingerpad.experiments.gerling2014 import goodwin
from fingerpad.experiments.gerling2014.percept_sessions import CRITERION_SIGMAS, Measured
from fingerpad.psychophysics.discrimination import END_OF_STIMULUS_MS, Experiment, discriminate_gradient_sum
from fingerpad.psychophysics.encoding import answering_neighbours, gradient_sum, neighbour_pairs
from fingerpad.psychophysics.noise_fit import (
    NoiseFit,
    expected_euclidean_hit_rates,
    expected_hit_rates,
    fit_noise_sigma,
)

PATIENCE_MS = protocol.RAMP.value
"""How long an observer waits who waits for first spikes until the ramp ends. [ms]"""

DRAWS = 1000
"""Common random presentations behind each reading."""

SMALLEST_NOISE, LARGEST_NOISE = 1e-4, 2.0
CURVE_NOISE = tuple(round(0.01 * step, 2) for step in range(1, 31))
"""Noise over which the misfit of every code is told."""

STEEPEST = 20.0
"""Times our rise, beyond which no rise is looked for."""


def expected(measures: Sequence[Measured], noise_sigma: float, standard_normals: FloatArray) -> FloatArray:
    """Return the expected hit rates (n_positions, n_comparisons) of the Gradient Sum."""
    return np.array(
        [expected_hit_rates(one.responses, one.neighbours, noise_sigma, standard_normals) for one in measures]
    )


def fitted_noise(
    measures: Sequence[Measured], curvature_per_m: Sequence[float], standard_normals: FloatArray
) -> NoiseFit:
    """Fit one noise to Goodwin's two points at all positions.

    Parameters
    ----------
    measures : sequence of Measured
        One response measure, position by position.
    curvature_per_m : sequence of float
        The spheres, the standard first. [1/m]
    standard_normals : array (n_draws, n_receptors)
        Draws from Normal(0, 1).

    Returns
    -------
    NoiseFit
        `hit_rates` position by position.

    Raises
    ------
    ConvergenceError
        If no noise meets the points.
    """
    columns = [list(curvature_per_m).index(curvature) - 1 for curvature in goodwin.CURVATURES]
    return fit_noise_sigma(
        lambda sigma: expected(measures, sigma, standard_normals)[:, columns].ravel(),
        np.tile(goodwin.HIT_RATES, len(measures)),
        (SMALLEST_NOISE, LARGEST_NOISE),
    )


def first_spikes(latency_ms: FloatArray, neighbours: np.ndarray) -> Measured:
    """Latencies of the receptors that fire under every sphere; the others take no part.

    Parameters
    ----------
    latency_ms : array (n_spheres, n_receptors)
        First spikes; NaN without one. [ms]
    neighbours : int array (n_pairs, 2)
        From `fingerpad.psychophysics.encoding.neighbour_pairs`.

    Returns
    -------
    Measured

    Raises
    ------
    InputError
        If no receptor ever fires.
    """
    pairs = answering_neighbours(latency_ms, neighbours)
    silent = np.isnan(latency_ms).any(axis=0)
    return Measured(np.where(silent, 0.0, latency_ms), pairs)


def reasons(
    measures: Mapping[str, Sequence[Measured]],
    latency_ms: Sequence[FloatArray],
    positions_mm: FloatArray,
    pitch_mm: float,
    curvature_per_m: Sequence[float],
    noise_sigma: float,
    standard_normals: FloatArray,
    seed: int,
) -> dict[str, Any]:
    """Put numbers behind the disagreements.

    Parameters
    ----------
    measures : dict of sequences of Measured
        As the study reads them, by measure and position.
    latency_ms : sequence of arrays (n_spheres, n_receptors)
        First spikes at every position, NaN without one. [ms]
    positions_mm, pitch_mm
        Of the population. [mm]
    curvature_per_m : sequence of float
        The spheres, the standard first. [1/m]
    noise_sigma : float
        Noise of the study.
    standard_normals : array (n_draws, n_receptors)
        Draws from Normal(0, 1).
    seed : int
        Of the run.

    Returns
    -------
    dict
        `rise` of the Gradient Sum from the standard to the farthest comparison, by measure and position, and
        the rise with which the paper's noise would give Goodwin's hit rate, `rise_for_paper_noise`, as
        shares; `readings` of steps that the paper leaves open; `criterion`, error bars of both readings of a
        varied criterion; `misfit_curve`, root mean square distance to Goodwin's points over the noise, by
        code; `euclidean`, the noise that this strategy would choose.
    """
    draws = standard_normals[:DRAWS]
    columns = [list(curvature_per_m).index(curvature) - 1 for curvature in goodwin.CURVATURES]
    codes = {name: partial(expected, both, standard_normals=draws) for name, both in measures.items()}
    codes["euclidean"] = partial(_expected_euclidean, measures["static"])
    return {
        "rise": {
            name: [_rise(one.responses, one.neighbours) for one in both] for name, both in measures.items()
        },
        "rise_for_paper_noise": {
            name: [rise_needed(one, psychophysics.NOISE_SIGMA.value, draws) for one in both]
            for name, both in measures.items()
        },
        "readings": [
            {"reading": name, **_judged(both, curvature_per_m, noise_sigma, draws)}
            for name, both in _readings(measures, latency_ms, positions_mm, pitch_mm).items()
        ],
        "criterion": _criterion(measures["static"][0], noise_sigma, seed),
        "misfit_curve": {
            "noise_sigma": CURVE_NOISE,
            "misfit": {
                name: [_misfit(rates(noise_sigma=sigma)[:, columns]) for sigma in CURVE_NOISE]
                for name, rates in codes.items()
            },
        },
        "euclidean": _own_euclidean(codes["euclidean"], columns),
    }


def _expected_euclidean(static: Sequence[Measured], noise_sigma: float) -> FloatArray:
    return np.array([expected_euclidean_hit_rates(one.responses, noise_sigma) for one in static])


def _misfit(hit_rates: FloatArray) -> float:
    return float(np.sqrt(np.square(hit_rates - goodwin.HIT_RATES).mean()))


def _own_euclidean(rates: Callable[..., FloatArray], columns: list[int]) -> dict[str, Any]:
    """Noise that the Euclidean Distance would choose, and what it reaches with it."""
    try:
        own = fit_noise_sigma(
            lambda sigma: rates(noise_sigma=sigma)[:, columns].ravel(),
            np.tile(goodwin.HIT_RATES, len(rates(noise_sigma=LARGEST_NOISE))),
            (SMALLEST_NOISE, LARGEST_NOISE),
        )
    except ConvergenceError:
        return {"noise_sigma": None, "misfit": None, "hit_rate": None}
    return {
        "noise_sigma": own.noise_sigma,
        "misfit": own.root_mean_square_error,
        "hit_rate": rates(noise_sigma=own.noise_sigma),
    }


def rise_needed(measured: Measured, noise_sigma: float, standard_normals: FloatArray) -> float | None:
    """Rise of the Gradient Sum that gives the farthest sphere Goodwin's hit rate at some noise.

    The pattern is kept: responses go the way from the standard's to the farthest comparison's, less or more
    far than they do.

    Parameters
    ----------
    measured : Measured
        One response measure at one position.
    noise_sigma : float
        Standard deviation of the noise.
    standard_normals : array (n_draws, n_receptors)
        Draws from Normal(0, 1).

    Returns
    -------
    float or None
        As a share of the standard's sum; None if no rise does it.
    """
    standard, farthest = measured.responses[[0, -1]]

    def pair(way: float) -> FloatArray:
        return np.array([standard, standard + way * (farthest - standard)])

    def missed(way: float) -> float:
        rates = expected_hit_rates(pair(way), measured.neighbours, noise_sigma, standard_normals)
        return float(rates[0]) - goodwin.HIT_RATES[-1]

    if np.array_equal(standard, farthest) or missed(STEEPEST) < 0.0:
        return None
    return _rise(pair(brentq(missed, 0.0, STEEPEST, xtol=1e-6)), measured.neighbours)


def _rise(responses: FloatArray, neighbours: np.ndarray) -> float:
    """Share by which the Gradient Sum of the last sphere is above that of the first."""
    sums = gradient_sum(responses, neighbours)
    return float(sums[-1] / sums[0] - 1.0) if sums[0] else float("nan")


def _readings(
    measures: Mapping[str, Sequence[Measured]],
    latency_ms: Sequence[FloatArray],
    positions_mm: FloatArray,
    pitch_mm: float,
) -> dict[str, list[Measured]]:
    """Measures as the study reads them, and as one might; a reading that leaves nothing falls away."""
    eight, four = (neighbour_pairs(positions_mm, pitch_mm, count) for count in (8, 4))
    early = [np.where(latency <= PATIENCE_MS, latency, np.nan) for latency in latency_ms]
    found = {
        "static, eight neighbours (used)": list(measures["static"]),
        "static, four neighbours": [replace(one, neighbours=four) for one in measures["static"]],
        "dynamic, eight neighbours (used)": list(measures.get("dynamic", [])),
        "latency of receptors that fire under every sphere (used)": list(measures.get("latency", [])),
        "latency of receptors that fire within the ramp under every sphere": [
            first_spikes(latency, eight) for latency in early if np.isfinite(latency).any()
        ],
        "latency, waiting until the ramp ends": [
            Measured(np.fmin(latency, PATIENCE_MS), eight) for latency in latency_ms
        ],
        "latency, a silent receptor counting as the end of the stimulus": [
            Measured(np.where(np.isnan(latency), END_OF_STIMULUS_MS, latency), eight)
            for latency in latency_ms
        ],
    }
    return {
        name: both
        for name, both in found.items()
        if len(both) == len(latency_ms) and all(len(one.neighbours) for one in both)
    }


def _judged(
    both: Sequence[Measured], curvature_per_m: Sequence[float], noise_sigma: float, draws: FloatArray
) -> dict[str, Any]:
    """Hit rates of a reading at the study's noise and at its own, which may not exist."""
    at_study = expected(both, noise_sigma, draws)
    judged = {
        "receptors": [len(np.unique(one.neighbours)) for one in both],
        "rise": [_rise(one.responses, one.neighbours) for one in both],
        "hit_rate": at_study,
        "largest_shift": float(np.abs(at_study[1] - at_study[0]).max()),
    }
    try:
        own = fitted_noise(both, curvature_per_m, draws)
    except ConvergenceError:
        return judged | {"noise_sigma": None, "misfit": None, "own_largest_shift": None}
    at_own = expected(both, own.noise_sigma, draws)
    return judged | {
        "noise_sigma": own.noise_sigma,
        "misfit": own.root_mean_square_error,
        "own_largest_shift": float(np.abs(at_own[1] - at_own[0]).max()),
    }


def _criterion(static: Measured, noise_sigma: float, seed: int) -> dict[str, Any]:
    """Mean error bar when the decision point varies, and when the fraction that places it does."""
    return {
        moves: [
            float(
                discriminate_gradient_sum(
                    static.responses,
                    static.neighbours,
                    noise_sigma,
                    seed,
                    Experiment(criterion_sigma=sigma, criterion_moves=moves),
                ).hit_rate_sd.mean()
            )
            for sigma in CRITERION_SIGMAS
        ]
        for moves in ("point", "fraction")
    } | {"criterion_sigma": CRITERION_SIGMAS}
