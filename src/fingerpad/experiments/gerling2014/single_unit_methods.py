"""Level 2, beyond the paper: other methods of fitting on its folds, and what limits each of them.

Every method fits the four numbers that firing can tell, on the same folds and in the same bounds; the paper's
own fits its six. Then the model itself is let loose piece by piece, to see which piece the residual hangs on.
"""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass, replace
from typing import Any

import numpy as np
from scipy.optimize import isotonic_regression
from scipy.stats import qmc

from fingerpad.core.checks import FloatArray
from fingerpad.core.signals import SedTraces
from fingerpad.data import protocol
from fingerpad.experiments.conditions import RECEPTOR_X_MM
from fingerpad.inference.closed_form import ClosedFormModel
from fingerpad.inference.fitting import (
    Continued,
    CrossValidation,
    Fit,
    Method,
    cross_validate,
    fractional_sum_of_squares,
    interleaved_folds,
)
from fingerpad.inference.fitting.covariance_adaptation import CovarianceAdaptation
from fingerpad.inference.fitting.least_squares import LeastSquares
from fingerpad.inference.identifiable import IDENTIFIABLE_NAMES, six_parameters
from fingerpad.inference.rate_problem import AfferentModel, RateModel, RateProblem, Reparametrised
from fingerpad.inference.receptor_offset import OFFSET_NAME, receptor_offset
from fingerpad.inference.recordings import PHASES, RateRecordings
from fingerpad.neuron.transduction import Drive, drive
from fingerpad.skin.sampling import SkinResponse

OFFSETS_MM = (-0.3, -0.2, -0.1, 0.0, 0.1, 0.2, 0.3)
"""Places beside the receptor at which the drive is known. The bar moves in steps of 0.2 mm. [mm]"""

LOWEST = (-0.05, 0.0, 0.0, 3.0)
HIGHEST = (0.05, 0.6, 0.2, 300.0)
SCALES = (0.01, 0.05, 0.02, 20.0)
"""Bounds and scales of a fit: the intercept [1/ms], what the dynamic and the static term reach under the
strongest stimulus [1/ms], and tau [ms]. A drive of 0.2/ms fires at up to 200 spikes/s, three times the
largest static rate."""

OFFSET_SCALE_MM = 0.1
"""A change of the receptor's place that matters. [mm]"""

N_STARTS, N_REFINED = 32, 2
"""Starts that are scored, and those from which least squares goes on."""

FIRST_SPREAD, MOST_EVALUATIONS = 0.5, 600
"""Of CMA-ES: the first generation's standard deviation in units of the scales, and its effort."""


def traces_beside(responses: Sequence[SkinResponse]) -> dict[float, SedTraces]:
    """Strain energy density at each of `OFFSETS_MM` from the receptor, one column per shift of the bar."""
    sites = [[RECEPTOR_X_MM + offset, 0.0] for offset in OFFSETS_MM]
    found = [skin.sed(sites) for skin in responses]
    return {
        offset: SedTraces(
            found[0].times_ms,
            np.column_stack([trace.sed_kpa[:, number] for trace in found]),
            found[0].kinks_ms,
        )
        for number, offset in enumerate(OFFSETS_MM)
    }


def four_numbers(driven: Drive, recordings: RateRecordings) -> RateProblem:
    """Rates to be predicted from the four numbers that firing can tell."""
    return RateProblem(Reparametrised(AfferentModel(driven), IDENTIFIABLE_NAMES, six_parameters), recordings)


def with_offset(traces: Mapping[float, SedTraces], recordings: RateRecordings) -> RateProblem:
    """Build the problem of the four numbers and the place of the receptor."""
    return RateProblem(five_numbers(receptor_offset(tuple(traces), tuple(traces.values()))), recordings)


def five_numbers(model: RateModel) -> Reparametrised:
    """Let the four numbers that firing can tell and the receptor's offset drive a model of all seven.

    Parameters
    ----------
    model : RateModel
        With the paper's six parameters and the offset behind them.

    Returns
    -------
    Reparametrised
    """
    return Reparametrised(
        model,
        (*IDENTIFIABLE_NAMES, OFFSET_NAME),
        lambda numbers: np.append(six_parameters(numbers[:4]), numbers[4]),
    )


@dataclass(frozen=True)
class Bounds:
    """Between which numbers a fit searches, and how far a step is.

    Parameters
    ----------
    low, high, scales : array (n_parameters,)
        Bounds, and a change that matters.
    """

    low: FloatArray
    high: FloatArray
    scales: FloatArray

    def and_offset(self, low_mm: float = OFFSETS_MM[0], high_mm: float = OFFSETS_MM[-1]) -> Bounds:
        """Return the bounds of the same parameters and the place of the receptor. [mm]"""
        offset = (low_mm, high_mm, OFFSET_SCALE_MM)
        sides = (self.low, self.high, self.scales)
        return Bounds(*(np.append(side, entry) for side, entry in zip(sides, offset, strict=True)))

    def spread(self, number: int) -> FloatArray:
        """Spread points evenly between the bounds, (number, n_parameters), the same ones each time."""
        shares = qmc.Halton(self.low.size, scramble=False).random(number + 1)[1:]  # the first is a corner
        return self.low + shares * (self.high - self.low)


def bounds_of(driven: Drive) -> Bounds:
    """Bounds of the four numbers for a drive: those of `LOWEST`, `HIGHEST` and `SCALES`."""
    strongest = np.array([1.0, driven.rate_kpa_per_ms.max(), driven.sed_kpa.max(), 1.0])
    return Bounds(*(np.array(terms) / strongest for terms in (LOWEST, HIGHEST, SCALES)))


def by_differences(bounds: Bounds) -> LeastSquares:
    """Least squares from starts all over the range."""
    starts = bounds.spread(N_STARTS)
    return LeastSquares(starts, bounds.scales, bounds.low, bounds.high, n_refined=N_REFINED)


def by_formula(problem: RateProblem, driven: Drive) -> LeastSquares:
    """Least squares along the slopes of the rate in closed form.

    Parameters
    ----------
    problem : RateProblem
        From `four_numbers`.
    driven : Drive
        Its drive.
    """
    slopes = problem.jacobian_of(ClosedFormModel(driven))
    return replace(by_differences(bounds_of(driven)), jacobian=slopes, name="slopes in closed form")


def evolution(problem: RateProblem, driven: Drive, offset: bool = False) -> Continued:
    """CMA-ES from where the slopes in closed form lead.

    Parameters
    ----------
    problem : RateProblem
        From `four_numbers`, of a receptor in its place.
    driven : Drive
        Its drive.
    offset : bool
        Whether the place of the receptor is a fifth number, which begins at 0.
    """
    bounds = bounds_of(driven).and_offset() if offset else bounds_of(driven)

    def search(begun: FloatArray) -> CovarianceAdaptation:
        return CovarianceAdaptation(
            np.append(begun, 0.0) if offset else begun,
            bounds.scales,
            bounds.low,
            bounds.high,
            first_spread=FIRST_SPREAD,
            most_evaluations=MOST_EVALUATIONS,
        )

    return Continued(by_formula(problem, driven), search, problem, name="CMA-ES")


def methods(problem: RateProblem, driven: Drive) -> tuple[Method, ...]:
    """Return the methods beside the paper's, all with the same bounds."""
    return by_differences(bounds_of(driven)), by_formula(problem, driven), evolution(problem, driven)


def result(
    traces: Mapping[float, SedTraces],
    extended: SedTraces,
    recordings: RateRecordings,
    surface: tuple[Fit, CrossValidation],
) -> dict[str, Any]:
    """Methods on the same folds, models on the same method, and what any model could reach.

    Parameters
    ----------
    traces : dict of float to SedTraces
        Strain energy density at places beside the receptor, from `traces_beside`.
    extended : SedTraces
        At the receptor, with another quantity for the dynamic term.
    recordings : RateRecordings
        What was observed.
    surface : Fit and CrossValidation
        The paper's method, from `fingerpad.experiments.gerling2014.single_unit.fit`.

    Returns
    -------
    dict
        `methods`, `models` and `ceilings`: FSS in and out of sample, and what belongs to it.
    """
    driven, otherwise = drive(traces[0.0]), drive(extended)
    problem = four_numbers(driven, recordings)
    fits = {method.name: _fitted(problem, method) for method in methods(problem, driven)}
    searched = evolution(problem, driven).name
    offset, other = with_offset(traces, recordings), four_numbers(otherwise, recordings)
    models = {
        "the paper's model": (problem, fits[searched]),
        "receptor beside its place": (offset, _fitted(offset, evolution(problem, driven, offset=True))),
        f"dynamic term follows {extended.dynamic_quantity}": (
            other,
            _fitted(other, evolution(other, otherwise)),
        ),
    }
    return {
        "methods": [_method(name, *fit) for name, fit in {"response surface": surface, **fits}.items()],
        "models": [_model(name, problem, *fit) for name, (problem, fit) in models.items()],
        "models_fitted_by": searched,
        "ceilings": ceilings(traces[0.0], recordings),
    }


def _fitted(problem: RateProblem, method: Method) -> tuple[Fit, CrossValidation]:
    """Fit all shifts, and each fold."""
    everything = np.arange(problem.n_observations)
    folds = interleaved_folds(problem.n_observations)
    return method.fit(problem, everything), cross_validate(problem, method, folds)


def _method(name: str, best: Fit, crossed: CrossValidation) -> dict[str, Any]:
    return {
        "method": name,
        "free_numbers": best.parameters.size,
        "fss_in_sample": best.score,
        "fss_training_mean": crossed.score_train,
        "fss_out_of_sample": crossed.score_test,
        "fss_train": [fold.score_train for fold in crossed.folds],
        "fss_test": [fold.score_test for fold in crossed.folds],
        "runs": sum(fold.fit.n_evaluations for fold in crossed.folds),
    }


def _model(name: str, problem: RateProblem, best: Fit, crossed: CrossValidation) -> dict[str, Any]:
    by_phase = problem.score_by_phase(best.parameters, np.arange(problem.n_observations))
    return {
        "model": name,
        "fss_in_sample": best.score,
        **{f"fss_in_sample_{phase}": by_phase[phase] for phase in PHASES},
        "fss_out_of_sample": crossed.score_test,
        "fss_test": [fold.score_test for fold in crossed.folds],
        "residual_share": residual_shares(problem, best.parameters),
        "parameters": dict(zip(problem.names, best.parameters.tolist(), strict=True)),
    }


def residual_shares(problem: RateProblem, parameters: FloatArray) -> dict[str, float]:
    """Where 1 - FSS lies: in which phase, and whether the flat face of the bar was over the receptor.

    Returns
    -------
    dict
        `dynamic_flat`, `dynamic_elsewhere`, `static_flat`, `static_elsewhere`; they add up to 1.
    """
    shift_mm = np.array(protocol.BAR_SHIFTS.value)
    flat = np.abs(shift_mm) < protocol.BAR_WIDTH.value / 2 - protocol.BAR_FILLET.value
    squares = problem.residuals(parameters, np.arange(problem.n_observations)).reshape(2, -1) ** 2
    return {
        f"{phase}_{place}": float(squares[row, where].sum() / squares.sum())
        for row, phase in enumerate(PHASES)
        for place, where in (("flat", flat), ("elsewhere", ~flat))
    }


def ceilings(traces: SedTraces, recordings: RateRecordings) -> dict[str, dict[str, float]]:
    """Best FSS in sample that whole families of models could reach.

    Returns
    -------
    dict
        `symmetric`: any prediction that is the same on both sides; `rising`: any rate that rises with strain
        energy density, in each phase with that of its own window. Each has `dynamic`, `static` and
        `weighted`.
    """
    felt = {
        phase: np.array([np.interp(np.mean(window), traces.times_ms, site) for site in traces.sed_kpa.T])
        for phase, window in zip(
            PHASES, (protocol.DYNAMIC_WINDOW.value, protocol.STATIC_WINDOW.value), strict=True
        )
    }
    found: dict[str, dict[str, float]] = {"symmetric": {}, "rising": {}}
    for phase in PHASES:
        observed = getattr(recordings, f"{phase}_rate_hz")
        order = np.argsort(felt[phase])
        risen = np.empty_like(observed)
        risen[order] = isotonic_regression(observed[order]).x
        mirrored = (observed + observed[::-1]) / 2.0
        found["symmetric"][phase] = fractional_sum_of_squares(observed, mirrored)
        found["rising"][phase] = fractional_sum_of_squares(observed, risen)
    weights = protocol.DYNAMIC_WEIGHT.value, protocol.STATIC_WEIGHT.value
    for family in found.values():
        family["weighted"] = sum(w * family[phase] for w, phase in zip(weights, PHASES, strict=True))
    return found
