"""Analysis of the discrepancy between the percept of the model and the paper's.

How steeply responses rise with curvature, which rise the paper's noise would need, and what other
interpretations of steps that the paper leaves open would give.
"""

from __future__ import annotations

from collections.abc import Callable, Mapping, Sequence
from contextlib import suppress
from dataclasses import replace
from functools import partial

import numpy as np
from scipy.optimize import brentq

from fingerpad.core.checked import result_class
from fingerpad.core.errors import ConvergenceError
from fingerpad.core.values import FloatArray, Matrix, Number, Vector, WholeVector
from fingerpad.data import protocol, psychophysics
from fingerpad.experiments.gerling2014.discrimination_statistics import (
    CRITERION_SIGMAS,
    HIT_RATES,
    Measured,
    fit_noise_to_goodwin,
    goodwin_columns,
    goodwin_misfit,
)
from fingerpad.psychophysics.encoding import gradient_sum, neighbour_pairs, taking_part
from fingerpad.psychophysics.observer import (
    CRITERION_MOVES,
    END_OF_STIMULUS_MS,
    Experiment,
    GradientSum,
    discriminate_by,
    expected_euclidean_hit_rates,
    expected_hit_rates,
)

PATIENCE_MS = protocol.RAMP.value  # Time that an observer waits for first spikes: until the ramp ends. [ms]
DRAWS = 1000  # Common random presentations behind each interpretation.
CURVE_NOISE = tuple(round(0.01 * step, 2) for step in range(1, 31))  # Noise of the misfits of codes.

USED = {
    "static": "static, eight neighbours (used)",
    "dynamic": "dynamic, eight neighbours (used)",
    "latency": "latency of receptors that fire under every sphere (used)",
}
"""The interpretation by which the study decodes each measure."""

STEEPEST = 20.0  # Largest multiple of the model's rise that is tried.


@result_class
class Interpretation:
    """One interpretation of the steps that the paper leaves open, and its hit rates."""

    reading: str
    receptors: WholeVector  # Receptors that take part, (n_positions,).
    rise: Vector  # Rise of the Gradient Sum from the standard to the farthest sphere, (n_positions,).
    hit_rate: Matrix  # With the noise of the study, (n_positions, n_comparisons). [0-1]
    largest_shift: Number  # Largest change of these by the shift. [0-1]
    noise_sigma: Number = np.nan
    misfit: Number = np.nan
    own_largest_shift: Number = np.nan
    """Noise that fits people best, root mean square distance to them and largest change by the shift with it;
    NaN where no noise does. [1], [0-1], [0-1]"""


@result_class
class CriterionErrorBars:
    """Mean error bar by the spread of the criterion, for three interpretations of what varies."""

    criterion_sigma: Vector  # Standard deviation of the criterion, (n_spreads,).
    point: Vector
    fraction: Vector
    likelihood: Vector
    """Error bar if the decision point varies, the fraction beta that places it, or a likelihood ratio of mean
    1 between comparison and standard, (n_spreads,). [0-1]"""


@result_class
class MisfitCurve:
    """Expected root mean square distance to Goodwin's points over the noise."""

    noise_sigma: Vector  # Noise sigma_1, (n_levels,).
    misfit: dict[str, Vector]  # By code, (n_levels,). [0-1]


@result_class
class EuclideanFit:
    """Noise that fits the Euclidean Distance to people, NaN and None if none does."""

    noise_sigma: Number = np.nan
    misfit: Number = np.nan  # Root mean square distance to Goodwin's points. [0-1]
    hit_rate: Matrix | None = None  # With that noise, (n_positions, n_comparisons). [0-1]


@result_class
class DiscrepancyAnalysis:
    """Numbers behind the differences between the model's percept and the paper's."""

    rise: dict[str, Vector]  # Rise of the Gradient Sum to the farthest sphere, by measure, (n_positions,).
    rise_for_paper_noise: dict[str, Vector]  # With which the paper's noise meets people's hit rate, or NaN.
    readings: tuple[Interpretation, ...]  # Interpretations of the steps that the paper leaves open.
    criterion: CriterionErrorBars
    misfit_curve: MisfitCurve
    euclidean: EuclideanFit


def expected_of_measure(
    measures: Sequence[Measured], noise_sigma: float, standard_normals: FloatArray
) -> FloatArray:
    """Return the expected hit rates (n_positions, n_comparisons) of the Gradient Sum."""
    return np.array(
        [expected_hit_rates(one.responses, one.neighbours, noise_sigma, standard_normals) for one in measures]
    )


def discrepancy_analysis(
    measures: Mapping[str, Sequence[Measured]],
    latency_ms: Sequence[FloatArray],
    positions_mm: FloatArray,
    pitch_mm: float,
    curvature_per_m: Sequence[float],
    noise_sigma: float,
    standard_normals: FloatArray,
    seed: int,
) -> DiscrepancyAnalysis:
    draws = standard_normals[:DRAWS]
    columns = goodwin_columns(curvature_per_m)
    codes: dict[str, Callable[..., FloatArray]] = {
        name: partial(expected_of_measure, both, standard_normals=draws) for name, both in measures.items()
    }
    codes["euclidean"] = lambda noise_sigma: np.array(
        [expected_euclidean_hit_rates(one.responses, noise_sigma) for one in measures["static"]]
    )
    misfit = {
        name: np.array([goodwin_misfit(rates(noise_sigma=sigma)[:, columns]) for sigma in CURVE_NOISE])
        for name, rates in codes.items()
    }
    apart, euclidean = codes["euclidean"], EuclideanFit()
    with suppress(ConvergenceError):
        own = fit_noise_to_goodwin(apart, curvature_per_m, len(measures["static"]))
        sigma, misses = own.noise_sigma, own.root_mean_square_error
        euclidean = EuclideanFit(noise_sigma=sigma, misfit=misses, hit_rate=apart(noise_sigma=sigma))
    interpretations = _interpretations(measures, latency_ms, positions_mm, pitch_mm)
    return DiscrepancyAnalysis(
        rise={name: _rises(both) for name, both in measures.items()},
        rise_for_paper_noise={
            name: np.array([rise_needed(one, psychophysics.NOISE_SIGMA.value, draws) for one in both])
            for name, both in measures.items()
        },
        readings=tuple(
            _judged(name, both, curvature_per_m, noise_sigma, draws) for name, both in interpretations.items()
        ),
        criterion=_criterion(measures["static"][0], noise_sigma, seed),
        misfit_curve=MisfitCurve(noise_sigma=np.array(CURVE_NOISE), misfit=misfit),
        euclidean=euclidean,
    )


def rise_needed(measured: Measured, noise_sigma: float, standard_normals: FloatArray) -> float:
    """Rise of the Gradient Sum that gives the farthest sphere Goodwin's hit rate at some noise.

    The pattern is kept: the change of responses from the standard to the farthest comparison is scaled.
    """
    standard, farthest = measured.responses[[0, -1]]

    def pair(way: float) -> FloatArray:
        return np.array([standard, standard + way * (farthest - standard)])

    def missed(way: float) -> float:
        rates = expected_hit_rates(pair(way), measured.neighbours, noise_sigma, standard_normals)
        return float(rates[0]) - HIT_RATES[-1]

    if np.array_equal(standard, farthest) or missed(STEEPEST) < 0.0:
        return float("nan")
    return _rise(pair(brentq(missed, 0.0, STEEPEST, xtol=1e-6)), measured.neighbours)


def _rise(responses: FloatArray, neighbours: np.ndarray) -> float:
    """Share by which the Gradient Sum of the last sphere is above that of the first."""
    sums = gradient_sum(responses, neighbours)
    return float(sums[-1] / sums[0] - 1.0) if sums[0] else float("nan")


def _rises(measures: Sequence[Measured]) -> FloatArray:
    return np.array([_rise(one.responses, one.neighbours) for one in measures])


def _interpretations(
    measures: Mapping[str, Sequence[Measured]],
    latency_ms: Sequence[FloatArray],
    positions_mm: FloatArray,
    pitch_mm: float,
) -> dict[str, list[Measured]]:
    """Measures as the study decodes them, and alternatives; one without any pair of receptors is left out."""
    eight, four = (neighbour_pairs(positions_mm, pitch_mm, count) for count in (8, 4))
    early = [np.where(latency <= PATIENCE_MS, latency, np.nan) for latency in latency_ms]
    found = {
        USED["static"]: list(measures["static"]),
        "static, four neighbours": [replace(one, neighbours=four) for one in measures["static"]],
        USED["dynamic"]: list(measures.get("dynamic", [])),
        USED["latency"]: list(measures.get("latency", [])),
        "latency of receptors that fire within the ramp under every sphere": [
            Measured(*taking_part(latency, eight)) for latency in early if np.isfinite(latency).any()
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
    name: str,
    both: Sequence[Measured],
    curvature_per_m: Sequence[float],
    noise_sigma: float,
    draws: FloatArray,
) -> Interpretation:
    """Hit rates of an interpretation at the study's noise and at its own, which may not exist."""
    rates = partial(expected_of_measure, both, standard_normals=draws)
    at_study = rates(noise_sigma)
    found = Interpretation(
        reading=name,
        receptors=np.array([len(np.unique(one.neighbours)) for one in both]),
        rise=_rises(both),
        hit_rate=at_study,
        largest_shift=float(np.abs(at_study[1] - at_study[0]).max()),
    )
    try:
        own = fit_noise_to_goodwin(rates, curvature_per_m, len(both))
    except ConvergenceError:
        return found
    at_own = rates(own.noise_sigma)
    return replace(
        found,
        noise_sigma=own.noise_sigma,
        misfit=own.root_mean_square_error,
        own_largest_shift=float(np.abs(at_own[1] - at_own[0]).max()),
    )


def _criterion(static: Measured, noise_sigma: float, seed: int) -> CriterionErrorBars:
    """Mean error bar for each quantity that the criterion may multiply."""
    bars = {}
    for moves in CRITERION_MOVES:
        plans = [Experiment(criterion_sigma=sigma, criterion_moves=moves) for sigma in CRITERION_SIGMAS]
        given = GradientSum(static.neighbours), static.responses, noise_sigma, seed
        bars[moves] = np.array([discriminate_by(*given, plan).hit_rate_sd.mean() for plan in plans])
    return CriterionErrorBars(criterion_sigma=np.array(CRITERION_SIGMAS), **bars)
