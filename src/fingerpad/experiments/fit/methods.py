"""Methods of fitting recordings: each a problem, a method, and the meaning of its parameters; the offset."""

from __future__ import annotations

from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass
from typing import Annotated

import numpy as np

from fingerpad.core.checked import checked
from fingerpad.core.errors import InputError
from fingerpad.core.signals import Traces
from fingerpad.core.values import FloatArray, IntArray, Whole, choice
from fingerpad.data import neuron
from fingerpad.experiments.fit.results import HeldOffset, OffsetFit, SpikeFitSummary
from fingerpad.inference.afferent_methods import (
    ReceptorOffset,
    along_slopes,
    and_offset,
    bounds_of,
    by_differences,
    fitted_four,
    fitted_six,
    five_number_problem,
    four_number_problem,
    response_surface,
    search_from,
)
from fingerpad.inference.closed_form import ClosedFormModel
from fingerpad.inference.fitting.cross_validation import CrossValidation, cross_validate, jackknife_covariance
from fingerpad.inference.fitting.least_squares import LeastSquares
from fingerpad.inference.fitting.methods import Bounds, Continued, Fit, Method
from fingerpad.inference.identifiable import IDENTIFIABLE_NAMES, SPIKE_PARAMETER_NAMES, identifiable
from fingerpad.inference.rate_model import AfferentModel
from fingerpad.inference.rate_problem import RateProblem
from fingerpad.inference.recordings import RateRecordings, SpikeRecordings
from fingerpad.neuron.spikes import Windows

Recordings = RateRecordings | SpikeRecordings
MethodOf = Callable[[AfferentModel, RateProblem, Bounds, int], Method]


@dataclass(frozen=True)
class Prepared:
    """A problem, the method that fits it, and the meaning of its parameters."""

    problem: RateProblem  # What is fitted, in the parameters of the method.
    method: Method
    six: Callable[[FloatArray], FloatArray]  # From those parameters to the paper's six.

    def covariance(self, fit: Fit, folds: CrossValidation) -> FloatArray | None:
        """Covariance (4, 4) of the identifiable numbers, from the fits of the folds; None for few folds."""
        return jackknife_covariance([identifiable(self.six(fold.fit.parameters)) for fold in folds.folds])

    def spikes(self, fit: Fit, folds: CrossValidation) -> SpikeFitSummary | None:
        """Summary of a fit to spikes; None for a fit to rates."""
        return None


def check_spikes(recordings: Recordings, n_motions: int) -> SpikeRecordings:
    """Return the recordings if the likelihood of their spikes is defined, else raise `InputError`."""
    if isinstance(recordings, RateRecordings):
        raise InputError("likelihood", "needs spike times", "rates, choose another method")
    if n_motions > 1:
        raise InputError(
            "likelihood", "needs stimuli that move alike", f"{n_motions} motions, choose another method"
        )
    if recordings.trains.times_ms.size < len(SPIKE_PARAMETER_NAMES):
        raise InputError(
            "likelihood",
            f"needs at least {len(SPIKE_PARAMETER_NAMES)} spikes, one per parameter",
            str(recordings.trains.times_ms.size),
        )
    for presentation, name in enumerate(recordings.stimuli):
        train = recordings.trains[presentation]
        if train.size and train[0] <= 0.0:
            raise InputError(
                "likelihood", "needs spikes after the onset", remedy=f"{name} has one at {train[0]:g} ms"
            )
        closest = np.diff(train).min(initial=np.inf)
        if closest <= neuron.REFRACTORY.value:
            raise InputError(
                "likelihood",
                f"needs spikes more than {neuron.REFRACTORY.value:g} ms apart, the rest after a spike",
                remedy=f"{name} has two that are {closest:.3g} ms apart; sort the unit again, or fit rates",
            )
    return recordings


def _evolution(model: AfferentModel, problem: RateProblem, bounds: Bounds, seed: int) -> Method:
    """CMA-ES from where the slopes in closed form lead."""
    return Continued(
        along_slopes(ClosedFormModel(model), problem, bounds),
        lambda begun: search_from(begun, bounds, seed),
        name="CMA-ES",
    )


FOUR_NUMBER_METHODS: dict[str, MethodOf] = {
    "least_squares": lambda model, problem, bounds, seed: by_differences(bounds),
    "closed_form": lambda model, problem, bounds, seed: along_slopes(ClosedFormModel(model), problem, bounds),
    "cma_es": _evolution,
}
"""Methods that fit four numbers, by name."""

METHODS = ("least_squares", "response_surface", "closed_form", "cma_es", "likelihood")
"""Methods that fit recordings, by the names that the command line gives."""


@checked
def prepare(
    method: Annotated[str, choice(METHODS)],
    model: AfferentModel,
    recordings: Recordings,
    rates: RateRecordings,
    seed: Whole,
) -> Prepared:
    if method == "likelihood":
        # Only this method loads the module and its kernels.
        from fingerpad.experiments.fit.spike_method import prepare_spikes

        return prepare_spikes(model, recordings, rates, seed)
    if method == "response_surface":
        return Prepared(RateProblem(model, rates), response_surface(), lambda six: six)
    problem = four_number_problem(model, rates)
    fitting = FOUR_NUMBER_METHODS[method](model, problem, bounds_of(*model.drives), seed)
    return Prepared(problem, fitting, fitted_six)


Beside = Mapping[float, Traces | Sequence[Traces]]
"""Strain energy density by offset from the believed place, distal positive [mm], one column per stimulus."""


def check_offset(method: str, places_mm: Sequence[float]) -> None:
    """Raise `InputError` if a receptor's offset cannot be determined."""
    if method not in OFFSET_METHODS:
        raise InputError("offset", f"needs a method that fits it, {' or '.join(OFFSET_METHODS)}", str(method))
    if len(set(places_mm)) < 2:
        raise InputError(
            "offset",
            "needs stimuli at several places along the finger, as those of the shifted bar are",
            remedy=f"all are at {places_mm[0]:g} mm, leave it out",
        )


def check_beside(beside: Beside) -> FloatArray:
    """Return the places in order (n_places,) [mm], or raise `InputError` if they miss a side."""
    beside_mm = np.array(sorted(beside), dtype=np.float64)
    if not (beside_mm.size and beside_mm[0] < 0.0 < beside_mm[-1]):
        raise InputError(
            "beside",
            "needs energy density on both sides of the receptor, at offsets below and above 0 mm",
            str(", ".join(f"{offset:g}" for offset in beside_mm) or "none"),
        )
    return beside_mm


@checked
def fit_offset(
    beside: Beside,
    rates: RateRecordings,
    memberships: IntArray,
    method: Annotated[str, choice(OFFSET_METHODS)],
    windows_ms: Windows | None,
    seed: Whole = 0,
) -> OffsetFit:
    beside_mm = check_beside(beside)
    roving = ReceptorOffset.of_traces({offset: beside[offset] for offset in beside_mm}, windows_ms)
    problem, everything = five_number_problem(roving, rates), np.arange(roving.n_stimuli)
    searching = _continued(roving, rates, method, seed)
    best = searching.fit(problem, everything)
    crossed = cross_validate(problem, searching, memberships)
    four, offset_mm = fitted_four(best.parameters[:4]).tolist(), float(best.parameters[-1])
    folds_mm = [float(fold.fit.parameters[-1]) for fold in crossed.folds]
    error = jackknife_covariance(np.reshape(folds_mm, (-1, 1)))
    held = [prepare(method, place, rates, rates, seed) for place in roving.models]
    return OffsetFit(
        offset_mm=offset_mm,
        standard_error_mm=np.nan if error is None else np.sqrt(error[0, 0]),
        folds_mm=np.array(folds_mm),
        identifiable=dict(zip(IDENTIFIABLE_NAMES, four, strict=True)),
        fss_in_sample=best.score,
        fss_out_of_sample=crossed.score_test,
        fss_by_phase=problem.score_by_phase(best.parameters, everything),
        n_evaluations=best.n_evaluations,
        seconds=best.seconds,
        held=HeldOffset(
            offset_mm=beside_mm,
            fss_in_sample=np.array([one.method.fit(one.problem, everything).score for one in held]),
        ),
    )


def _continued(roving: ReceptorOffset, rates: RateRecordings, method: str, seed: int) -> Continued:
    """Fit a receptor in its place, then let it move from the best fit, which it can only improve."""
    centre = roving.at(0.0)
    problem, of_four = four_number_problem(centre, rates), bounds_of(*centre.drives)
    low_mm, *inner_mm, high_mm = roving.offsets_mm.tolist()
    bounds = and_offset(of_four, low_mm, high_mm)

    def moving(begun: FloatArray) -> Method:
        if method == "cma_es":
            return search_from(np.append(begun, 0.0), bounds, seed)
        within = np.clip(begun, of_four.low, of_four.high)  # round-off at a bound
        starts = [np.append(within, offset) for offset in sorted({0.0, *inner_mm})]
        return LeastSquares(starts, bounds, n_refined=2)

    in_place = FOUR_NUMBER_METHODS[OFFSET_METHODS[method]](centre, problem, of_four, seed)
    return Continued(in_place, moving, problem)


OFFSET_METHODS = {"least_squares": "least_squares", "cma_es": "closed_form"}
"""Methods that an offset can be added to, each with the method that first fits a receptor in its place."""
