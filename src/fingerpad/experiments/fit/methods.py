"""The table of methods of fitting recordings; the receptor's offset."""

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
from fingerpad.inference.afferent_fit import (
    ReceptorOffset,
    Search,
    fitted_four,
    fitted_six,
    four_numbers,
    four_numbers_and_offset,
    response_surface,
    validated,
)
from fingerpad.inference.fitting.methods import (
    Continued,
    CrossValidation,
    Fit,
    LeastSquares,
    Method,
    jackknife_covariance,
)
from fingerpad.inference.identifiable import IDENTIFIABLE_NAMES, SPIKE_PARAMETER_NAMES, identifiable
from fingerpad.inference.rate_model import AfferentModel, RateProblem
from fingerpad.inference.recordings import RateRecordings, SpikeRecordings
from fingerpad.neuron.spikes import Windows

Recordings = RateRecordings | SpikeRecordings


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


@dataclass(frozen=True)
class FitMethod:
    """One row of the table of methods."""

    prepare: Callable[[AfferentModel, Recordings, RateRecordings, int], Prepared]
    """From the model, the recordings, their rates and a seed to the problem and its method."""
    needs_spikes: bool = False
    in_place: str = ""  # Where an offset can be fitted: the method that first fits a receptor in its place,
    moving: Callable[[Search, FloatArray, FloatArray, int], Method] | None = None
    """and the method that lets it move, from the search, the result in place, the offsets and a seed."""


def _of_four(method: Callable[[Search, int], Method]) -> Callable[..., Prepared]:
    """Return what prepares a method that fits the four numbers."""

    def prepare(model: AfferentModel, recordings: Recordings, rates: RateRecordings, seed: int) -> Prepared:
        search = four_numbers(model, rates)
        return Prepared(search.problem, method(search, seed), fitted_six)

    return prepare


def _surface(model: AfferentModel, recordings: Recordings, rates: RateRecordings, seed: int) -> Prepared:
    return Prepared(RateProblem(model, rates), response_surface(), lambda six: six)


def _spikes(model: AfferentModel, recordings: Recordings, rates: RateRecordings, seed: int) -> Prepared:
    # Only this method loads the module and its kernels.
    from fingerpad.experiments.fit.spike_method import prepare_spikes

    return prepare_spikes(model, recordings, rates, seed)


def _evolution(search: Search, seed: int) -> Method:
    """CMA-ES from where the slopes in closed form lead."""
    return Continued(search.along_slopes(), lambda begun: search.by_evolution(begun, seed), name="CMA-ES")


def _from_all_offsets(search: Search, begun: FloatArray, offsets_mm: FloatArray, seed: int) -> Method:
    within = np.clip(begun, search.bounds.low[:4], search.bounds.high[:4])  # round-off at a bound
    starts = [np.append(within, offset) for offset in sorted({0.0, *offsets_mm[1:-1].tolist()})]
    return LeastSquares(starts, search.bounds, n_refined=2)


def _evolution_from_0(search: Search, begun: FloatArray, offsets_mm: FloatArray, seed: int) -> Method:
    return search.by_evolution(np.append(begun, 0.0), seed)


METHODS = {
    "least_squares": FitMethod(
        _of_four(lambda search, seed: search.by_differences()),
        in_place="least_squares",
        moving=_from_all_offsets,
    ),
    "response_surface": FitMethod(_surface),
    "closed_form": FitMethod(_of_four(lambda search, seed: search.along_slopes())),
    "cma_es": FitMethod(_of_four(_evolution), in_place="closed_form", moving=_evolution_from_0),
    "likelihood": FitMethod(_spikes, needs_spikes=True),
}  # Methods that fit recordings, by the names that the command line gives.

OFFSET_METHODS = tuple(name for name, method in METHODS.items() if method.moving)
"""Methods that an offset can be added to."""


@checked
def prepare(
    method: Annotated[str, choice(METHODS)],
    model: AfferentModel,
    recordings: Recordings,
    rates: RateRecordings,
    seed: Whole,
) -> Prepared:
    return METHODS[method].prepare(model, recordings, rates, seed)


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
    """Fit a receptor in its place, then let it move from the best fit, which it can only improve."""
    beside_mm = check_beside(beside)
    roving = ReceptorOffset.of_traces({offset: beside[offset] for offset in beside_mm}, windows_ms)
    search, row = four_numbers_and_offset(roving, rates), METHODS[method]
    problem, moving = search.problem, row.moving
    assert moving is not None
    first = prepare(row.in_place, roving.at(0.0), rates, rates, seed)
    searching = Continued(
        first.method, lambda begun: moving(search, begun, roving.offsets_mm, seed), first.problem
    )
    best, crossed = validated(problem, searching, memberships)
    four, offset_mm = fitted_four(best.parameters[:4]).tolist(), float(best.parameters[-1])
    folds_mm = [float(fold.fit.parameters[-1]) for fold in crossed.folds]
    error = jackknife_covariance(np.reshape(folds_mm, (-1, 1)))
    everything = np.arange(roving.n_stimuli)
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
