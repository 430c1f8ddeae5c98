"""Level 2: one afferent under a shifted bar, fitted and cross-validated (paper, 2.2.2, 3.2 and Figure 5)."""

from __future__ import annotations

from dataclasses import replace
from typing import Any

import numpy as np
from numpy.typing import ArrayLike

from fingerpad.core.checks import FloatArray
from fingerpad.core.signals import STORED_ENERGY, SedTraces
from fingerpad.data import bar_firing_rates, protocol
from fingerpad.experiments.conditions import RECEPTOR_X_MM, Conditions, Touch
from fingerpad.geometry.indenters import Bar
from fingerpad.inference.fitting import (
    CrossValidation,
    Fit,
    FoldFit,
    cross_validate,
    interleaved_folds,
)
from fingerpad.inference.rate_model import AfferentModel
from fingerpad.inference.rate_problem import RateProblem
from fingerpad.inference.recordings import PHASES, RateRecordings
from fingerpad.inference.start_points import response_surface, start_points
from fingerpad.neuron.afferent import PARAMETER_NAMES, PARAMETER_UNITS
from fingerpad.neuron.spikes import modulation_difference, modulation_index
from fingerpad.skin.sampling import SkinResponse

RECEPTOR = ((RECEPTOR_X_MM, 0.0),)
"""Where the end organ lies: x and z on the skin. [mm]"""


def touches(conditions: Conditions) -> list[Touch]:
    """36 touches of the bar, shifted along the finger.

    Its flat face stays parallel to the skin at the receptor (docs/decisions/bar-orientation.md). A positive
    shift moves the bar towards the proximal end (docs/decisions/bar-shift.md).
    """
    tilt = conditions.skin_tilt_deg
    grading = conditions.bar_grading()
    return [
        conditions.touch(
            Bar(), RECEPTOR_X_MM - shift * float(np.cos(np.deg2rad(tilt))), grading, tilt_deg=tilt
        )
        for shift in protocol.BAR_SHIFTS.value
    ]


def receptor_sed(responses: list[SkinResponse], dynamic_quantity: str = STORED_ENERGY) -> SedTraces:
    """Strain energy density at the one receptor, one column per shift of the bar.

    Parameters
    ----------
    responses : list of SkinResponse
        One per shift.
    dynamic_quantity : str, optional
        What the dynamic term follows; by default the same.
    """
    if dynamic_quantity != STORED_ENERGY:
        return following(
            receptor_sed(responses), receptor_traces(responses, dynamic_quantity), dynamic_quantity
        )
    traces = [skin.sed(RECEPTOR) for skin in responses]
    return SedTraces(traces[0].times_ms, np.hstack([trace.sed_kpa for trace in traces]), traces[0].kinks_ms)


def receptor_traces(responses: list[SkinResponse], quantity: str) -> SedTraces:
    """Another quantity at the receptor in the place of strain energy density, one column per shift.

    Parameters
    ----------
    responses : list of SkinResponse
        One per shift.
    quantity : str
        By the names of `SkinResponse.sample`.
    """
    sampled = np.hstack([skin.sample(quantity, RECEPTOR) for skin in responses])
    return SedTraces(responses[0].times_ms, sampled, np.array(responses[0].kinks_ms))


def following(static: SedTraces, dynamic: SedTraces, quantity: str) -> SedTraces:
    """Traces whose dynamic term follows another quantity.

    Parameters
    ----------
    static : SedTraces
        What the static term follows.
    dynamic : SedTraces
        The other quantity in the place of strain energy density, as from `receptor_traces`.
    quantity : str
        Its name.
    """
    return replace(static, dynamic_kpa=dynamic.sed_kpa, dynamic_quantity=quantity)


def rate_problem(sed: SedTraces) -> RateProblem:
    """Observed rates at all shifts, and the paper's model of the afferent that answers `sed`."""
    return RateProblem(AfferentModel.of_traces(sed), bar_recordings())


def bar_recordings() -> RateRecordings:
    """Return the rates observed under the bar, stimuli named by their shift in mm."""
    observed = bar_firing_rates()
    names = tuple(f"{shift:g}" for shift in observed.shift_mm)
    return RateRecordings(names, observed.dynamic_rate_hz, observed.static_rate_hz, observed.source)


def fit(problem: RateProblem, memberships: ArrayLike | None = None) -> tuple[Fit, CrossValidation]:
    """Best fit to all shifts from both start points, and the six folds.

    Parameters
    ----------
    problem : RateProblem
        From `rate_problem`.
    memberships : int array (n_shifts,), optional
        Fold of each shift, as `fingerpad.inference.fitting.folds_of` makes them from a table like the
        paper's Table 3;
        default: dealt out in turn.
    """
    method, everything = response_surface(), np.arange(problem.n_observations)
    folds = interleaved_folds(everything.size) if memberships is None else memberships
    return method.fit(problem, everything), cross_validate(problem, method, folds)


def result(problem: RateProblem, best: Fit, folds: CrossValidation) -> dict[str, Any]:
    """Rates, fits and modulation, ready for the report."""
    shift_mm = bar_firing_rates().shift_mm
    observed = {phase: getattr(problem.recordings, f"{phase}_rate_hz") for phase in PHASES}
    predicted = dict(zip(PHASES, problem.model.evaluate(best.parameters), strict=True))
    by_phase = problem.score_by_phase(best.parameters, np.arange(problem.n_observations))
    return {
        "fss_in_sample": best.score,
        **{f"fss_in_sample_{phase}": by_phase[phase] for phase in PHASES},
        "fss_out_of_sample": folds.score_test,
        "fss_training_mean": folds.score_train,
        "parameters": _named(best.parameters),
        "units": dict(zip(PARAMETER_NAMES, PARAMETER_UNITS, strict=True)),
        "shift_mm": shift_mm,
        **{f"{phase}_rate_hz": predicted[phase] for phase in PHASES},
        **{f"observed_{phase}_rate_hz": observed[phase] for phase in PHASES},
        "start_points": [_named(start) for start in start_points()],
        "folds": [_fold(problem, fold, shift_mm) for fold in folds.folds],
        "modulation": {
            phase: {
                "observed": _modulation(shift_mm, observed[phase]),
                "ours": _modulation(shift_mm, predicted[phase]),
            }
            for phase in PHASES
        },
    }


def _fold(problem: RateProblem, fold: FoldFit, shift_mm: FloatArray) -> dict[str, Any]:
    """One fold: which shifts were left out, the better of its climbs, and the steps of each."""
    return {
        "fold": fold.fold + 1,
        "start": fold.fit.start + 1,
        "testing_shift_mm": shift_mm[fold.testing],
        "fss_start": [climb.history[0].score for climb in fold.fit.attempts],
        "fss_train": fold.score_train,
        "fss_test": fold.score_test,
        "parameters": _named(fold.fit.parameters),
        "climbs": [
            {
                "start": number + 1,
                "fss_train": climb.score,
                "fss_test": problem.score(climb.parameters, fold.testing),
                "runs": climb.n_evaluations,
                "history": [
                    {"iteration": iteration, "fss": step.score, "parameters": _named(step.parameters)}
                    for iteration, step in enumerate(climb.history)
                ],
            }
            for number, climb in enumerate(fold.fit.attempts)
        ],
    }


def _named(parameters: FloatArray) -> dict[str, float]:
    return {name: float(value) for name, value in zip(PARAMETER_NAMES, parameters, strict=True)}


def _modulation(shift_mm: FloatArray, rate_hz: FloatArray) -> dict[str, float | None]:
    """Largest rate against the smallest with the bar's flat face over the receptor (Eq. 11)."""
    under_flat = np.abs(shift_mm) < protocol.BAR_WIDTH.value / 2 - protocol.BAR_FILLET.value
    largest, smallest = float(rate_hz.max()), float(rate_hz[under_flat].min())
    return {
        "maximum_hz": largest,
        "minimum_hz": smallest,
        "difference_hz": float(modulation_difference(largest, smallest)),
        "index": float(modulation_index(largest, smallest)) if largest > 0.0 else None,
    }
