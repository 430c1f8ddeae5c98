"""Methods that fit one afferent to firing rates: bounds, scales, starts and parameters.

All but the paper's method (`fingerpad.inference.start_points.response_surface`) fit four numbers, optionally
with the offset of the receptor along the finger, within the same bounds. The four are the identifiable ones
with the potential at rest over the threshold, beta tau/(C v), in the place of beta/(C v): its bound keeps the
afferent silent at rest (docs/decisions.md#silent-at-rest).
"""

from __future__ import annotations

from dataclasses import replace

import numpy as np

from fingerpad.core.checks import FloatArray
from fingerpad.inference.fitting.covariance_adaptation import CovarianceAdaptation
from fingerpad.inference.fitting.least_squares import LeastSquares
from fingerpad.inference.fitting.methods import Bounds
from fingerpad.inference.identifiable import IDENTIFIABLE_NAMES, LARGEST_RESTING_SHARE, six_parameters
from fingerpad.inference.rate_model import RateModel, Rates, Reparametrised, SmoothRateModel
from fingerpad.inference.rate_problem import RateProblem
from fingerpad.inference.receptor_offset import OFFSET_NAME
from fingerpad.inference.recordings import RateRecordings
from fingerpad.neuron.transduction import Drive

OFFSETS_MM = (-0.3, -0.2, -0.1, 0.0, 0.1, 0.2, 0.3)
"""Offsets from the receptor at which the drive is sampled. The paper's bar moves in steps of 0.2 mm. [mm]"""

FITTED_NAMES = ("resting_share", *IDENTIFIABLE_NAMES[1:])
"""The four numbers of a fit: beta tau/(C v) [1], k_d/(C v), k_s/(C v) and tau."""

LOWEST = (-1.5, 0.0, 0.0, 3.0)
HIGHEST = (LARGEST_RESTING_SHARE, 0.6, 0.2, 300.0)
SCALES = (0.3, 0.05, 0.02, 20.0)
"""Bounds and scales of a fit: the potential at rest over the threshold [1], the largest values of the dynamic
and the static term under all stimuli [1/ms], and tau [ms]. A drive of 0.2/ms elicits up to 200 spikes/s,
three times the largest static rate."""

OFFSET_SCALE_MM = 0.1

N_STARTS, N_REFINED = 32, 8
"""Starts that are scored, and starts from which least squares continues: two of them end up to 0.003 of FSS
below the best, since intercept and time constant of a membrane at rest trade off along a valley."""

MOST_EVALUATIONS = 600


def fitted_four(numbers: FloatArray) -> FloatArray:
    return np.array([numbers[0] / numbers[3], *numbers[1:]])


def fitted_six(numbers: FloatArray) -> FloatArray:
    return six_parameters(fitted_four(numbers))


def four_number_problem(model: RateModel, recordings: RateRecordings) -> RateProblem:
    """Make the problem of fitting recorded rates in the four numbers of `FITTED_NAMES`."""
    return RateProblem(Reparametrised(model, FITTED_NAMES, fitted_six), recordings)


def five_number_problem(model: RateModel, recordings: RateRecordings) -> RateProblem:
    """Make the problem of fitting recorded rates in the four numbers of `FITTED_NAMES` and the offset."""

    def seven(numbers: FloatArray) -> FloatArray:
        return np.append(fitted_six(numbers[:4]), numbers[4])

    return RateProblem(Reparametrised(model, (*FITTED_NAMES, OFFSET_NAME), seven), recordings)


def bounds_of(*drives: Drive) -> Bounds:
    """Bounds of the four numbers of a fit: those of `LOWEST`, `HIGHEST` and `SCALES`."""
    rate, value = (
        max(float(getattr(driven, name).max()) for driven in drives) for name in ("rate_per_ms", "values")
    )
    strongest = np.array([1.0, rate, value, 1.0])
    return Bounds(*(np.array(terms) / strongest for terms in (SCALES, LOWEST, HIGHEST)))


def and_offset(bounds: Bounds, low_mm: float = OFFSETS_MM[0], high_mm: float = OFFSETS_MM[-1]) -> Bounds:
    return bounds.and_one(OFFSET_SCALE_MM, low_mm, high_mm)


def by_differences(bounds: Bounds) -> LeastSquares:
    return LeastSquares(bounds.spread(N_STARTS), bounds, n_refined=N_REFINED)


def along_slopes(smooth: SmoothRateModel, problem: RateProblem, bounds: Bounds) -> LeastSquares:
    """Make the method of least squares with the derivatives of a smooth model."""

    def slopes(numbers: FloatArray) -> Rates:
        # By the chain rule: beta/(C v) is the first number over the last, tau.
        share, _, _, tau = numbers
        four_by_numbers = np.diag([1.0 / tau, 1.0, 1.0, 1.0])
        four_by_numbers[0, 3] = -share / tau**2
        dynamic, static = smooth.slopes(fitted_four(numbers))
        return dynamic @ four_by_numbers, static @ four_by_numbers

    jacobian = problem.jacobian_of(slopes)
    return replace(by_differences(bounds), jacobian=jacobian, name="slopes in closed form")


def search_from(begun: FloatArray, bounds: Bounds, seed: int = 0) -> CovarianceAdaptation:
    """Make CMA-ES from the result of a faster method."""
    return CovarianceAdaptation(begun, bounds, most_evaluations=MOST_EVALUATIONS, seed=seed)
