"""Fit an afferent to recordings under known stimuli by several methods, and score the fit out of sample."""

from __future__ import annotations

from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass
from typing import Annotated

import numpy as np
from numpy.typing import ArrayLike

from fingerpad.core.checked import checked
from fingerpad.core.errors import InputError
from fingerpad.core.signals import Traces
from fingerpad.core.units import units_of
from fingerpad.core.values import Flag, FloatArray, IntArray, Whole, choice
from fingerpad.data import neuron
from fingerpad.experiments.fit import results
from fingerpad.inference.afferent_fit import (
    ReceptorOffset,
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
    fractional_sum_of_squares,
    interleaved_folds,
    jackknife_covariance,
)
from fingerpad.inference.identifiable import IDENTIFIABLE_NAMES, SPIKE_PARAMETER_NAMES, identifiable
from fingerpad.inference.rate_model import AfferentModel, RateProblem, four_number_model
from fingerpad.inference.recordings import PHASES, RateRecordings, SpikeRecordings, check_trains
from fingerpad.neuron.afferent import PARAMETER_NAMES, parameter_units
from fingerpad.neuron.spikes import Windows

Recordings = RateRecordings | SpikeRecordings

METHODS = ("least_squares", "response_surface", "closed_form", "cma_es", "likelihood")
"""Methods that fit recordings; the likelihood is that of spikes."""

OFFSET_METHODS = ("least_squares", "cma_es")  # Methods that an offset can be added to.


@dataclass(frozen=True)
class Prepared:
    """A problem, the method that fits it, and the meaning of its parameters."""

    problem: RateProblem  #: What is fitted, in the parameters of the method.
    method: Method
    six: Callable[[FloatArray], FloatArray]  #: From those parameters to the paper's six.

    def covariance(self, fit: Fit, folds: CrossValidation) -> FloatArray | None:
        """Covariance (4, 4) of the identifiable numbers, from the fits of the folds; None for few folds."""
        return jackknife_covariance([identifiable(self.six(fold.fit.parameters)) for fold in folds.folds])

    def spikes(self, fit: Fit, folds: CrossValidation) -> results.SpikeFitSummary | None:
        """Summary of a fit to spikes; None for a fit to rates."""
        return None


@checked
def prepare(
    method: Annotated[str, choice(METHODS)],
    model: AfferentModel,
    recordings: Recordings,
    rates: RateRecordings,
    seed: Whole,
) -> Prepared:
    """Make the problem of a method."""
    if method == "response_surface":
        return Prepared(RateProblem(model, rates), response_surface(), lambda six: six)
    if method == "likelihood":
        # Only this method loads the module and its kernels.
        from fingerpad.experiments.fit.likelihoods import prepare_spikes

        return prepare_spikes(model, recordings, rates, seed)
    search = four_numbers(model, rates)
    if method == "closed_form":
        return Prepared(search.problem, search.along_slopes(), fitted_six)
    if method == "cma_es":  # from where the slopes in closed form lead
        evolved = Continued(
            search.along_slopes(), lambda begun: search.by_evolution(begun, seed), name="CMA-ES"
        )
        return Prepared(search.problem, evolved, fitted_six)
    return Prepared(search.problem, search.by_differences(), fitted_six)


@checked
def fit_recordings(
    traces: Traces | Sequence[Traces],
    recordings: RateRecordings | SpikeRecordings,
    memberships: ArrayLike | None = None,
    *,
    method: str = "least_squares",
    windows_ms: Windows | None = None,
    seed: Whole = 0,
    with_posterior: Flag = False,
    with_profiles: Flag = False,
    with_sensitivity: Flag = False,
    beside: Beside | None = None,
    positions_mm: ArrayLike | None = None,
) -> results.FitResult:
    """Fit an afferent to recordings under stimuli whose traces are known.

    Parameters
    ----------
    traces : Traces or sequence of Traces
        What the afferent follows at the receptor, one column per stimulus, in the order in which `recordings`
        names them first; several traces follow each other.
    recordings : RateRecordings or SpikeRecordings
        Recorded responses; spikes are counted in `windows_ms`, mean over presentations.
    memberships : int array (n_stimuli,), optional
        Fold of each stimulus from 0; by default assigned in turn to six folds, or to one per stimulus where
        there are fewer.
    method : str, optional
        One of `METHODS`.
    windows_ms : ((float, float), (float, float)), optional
        Windows of the dynamic and of the static rate; by default those that follow the phases of `traces`,
        the paper's for the paper's motion. [ms]
    seed : int, optional
        Of methods that draw.
    with_posterior, with_profiles, with_sensitivity : bool, optional
        Whether credible intervals of the four numbers and of the rates, profile likelihoods of the numbers
        and Sobol indices of FSS are computed as well.
    beside : mapping of float to Traces or to a sequence of Traces, optional
        The same quantities at places beside the receptor, by their offset along the finger, distal
        positive [mm], on both sides of 0: with it the receptor's offset is fitted as a seventh parameter,
        by least squares or CMA-ES, and reported with the fit.
    positions_mm : array_like (n_stimuli,), optional
        Where along a line each stimulus was: in posterior and profiles, neighbours may miss alike. [mm]

    Raises
    ------
    ConvergenceError
        If a fit does not end.

    Examples
    --------
    Six stimuli whose energy density rises within 50 ms and stays, and an afferent that we know:

    >>> import fingerpad as fp
    >>> height_kpa = [0.8, 1.2, 1.6, 2.0, 2.5, 3.0]
    >>> traces = fp.Traces([0.0, 50.0, 1000.0], np.outer([0.0, 1.0, 1.0], height_kpa), kinks_ms=[50.0])
    >>> six, energy = [0.0, 1.5e-4, 9e-7, 60.0, 1e-6, 50.0], "stored"
    >>> known = fp.Afferent.from_parameters(six, dynamic_quantity=energy, static_quantity=energy)
    >>> recordings = RateRecordings(("a", "b", "c", "d", "e", "f"), *known.rates(traces))
    >>> fit = fit_recordings(traces, recordings, memberships=[0, 1, 0, 1, 0, 1])
    >>> fit.fss_in_sample > 0.99, fit.fss_out_of_sample > 0.97
    (True, True)
    """
    model = AfferentModel.of_traces(traces, windows_ms)
    counted = model.used_windows_ms
    rates = recordings if isinstance(recordings, RateRecordings) else recordings.rates(counted)
    if beside is not None:
        check_beside(beside)
    folds = interleaved_folds(len(rates.stimuli)) if memberships is None else np.asarray(memberships)
    check_enough(rates, folds, len(IDENTIFIABLE_NAMES) + (beside is not None))
    prepared = prepare(method, model, recordings, rates, seed)
    best, validation = validated(prepared.problem, prepared.method, folds)
    six = prepared.six(best.parameters)
    four = identifiable(six)
    covariance = prepared.covariance(best, validation)
    errors = np.full(len(IDENTIFIABLE_NAMES), np.nan) if covariance is None else np.sqrt(np.diag(covariance))
    posterior = profiles = sensitivity = None
    if with_posterior or with_profiles or with_sensitivity:
        from fingerpad.experiments.fit.likelihoods import fss_sensitivity, profiled, rate_posterior

        problem = RateProblem(four_number_model(model), rates)
        posterior = rate_posterior(model, rates, four, seed, positions_mm) if with_posterior else None
        profiles = profiled(model, rates, four, positions_mm) if with_profiles else None
        sensitivity = fss_sensitivity(problem, four, seed) if with_sensitivity else None
    return results.FitResult(
        method=method,
        source=rates.source,
        n_evaluations=best.n_evaluations,
        seconds=best.seconds,
        parameters=dict(zip(PARAMETER_NAMES, six.tolist(), strict=True)),
        identifiable=dict(zip(IDENTIFIABLE_NAMES, four.tolist(), strict=True)),
        units=parameter_units(model.drives[0]),
        identifiable_units=units_of(IDENTIFIABLE_NAMES),
        identifiable_standard_error=dict(zip(IDENTIFIABLE_NAMES, errors.tolist(), strict=True)),
        identifiable_covariance=covariance,
        fss_in_sample=prepared.problem.score(best.parameters, np.arange(prepared.problem.n_observations)),
        fss_training_mean=validation.score_train,
        fss_out_of_sample=validation.score_test,
        stimulus=tuple(rates.stimuli),
        fold=folds + 1,
        phases=_phases(prepared.problem, rates, best.parameters, validation),
        folds=_folds(prepared, rates, validation),
        spikes=prepared.spikes(best, validation),
        posterior=posterior,
        profiles=profiles,
        sensitivity=sensitivity,
        offset=None if beside is None else fit_offset(beside, rates, folds, method, windows_ms, seed),
    )


def check_enough(rates: RateRecordings, memberships: IntArray, n_free: int = len(IDENTIFIABLE_NAMES)) -> None:
    """Raise `InputError` if a training set cannot be fitted, or a set not be judged."""
    if memberships.shape != (len(rates.stimuli),):
        raise InputError(
            "memberships", "needs one fold per stimulus", f"{memberships.size} for {len(rates.stimuli)}"
        )
    for fold in np.unique(memberships):
        training = rates.chosen(np.flatnonzero(memberships != fold))
        n_rates = len(training.phases) * len(training.stimuli)
        if n_rates < n_free:
            raise InputError(
                "recordings",
                f"must leave at least {n_free} rates, one per free parameter, when a fold is left out",
                remedy=f"without fold {fold + 1} there are {n_rates}, record more",
            )
        for rows in (memberships == fold, memberships != fold):
            part = rates.chosen(np.flatnonzero(rows))
            for phase in part.phases:
                if not np.any(getattr(part, f"{phase}_rate_hz")):
                    raise InputError(
                        f"{phase}_rate_hz must not be 0 for all stimuli of a fold "
                        f"({', '.join(part.stimuli)}), since FSS divides by their squares: assign the "
                        "folds otherwise, by a column fold."
                    )


def _phases(
    problem: RateProblem, rates: RateRecordings, fitted: FloatArray, validation: CrossValidation
) -> dict[str, results.PhaseRates]:
    """Every rate as observed, fitted, and predicted without its fold; FSS in sample."""
    predicted = dict(zip(PHASES, problem.model.evaluate(fitted), strict=True))
    left_out = {phase: np.empty(problem.n_observations) for phase in PHASES}
    for fold in validation.folds:
        for phase, rate in zip(PHASES, problem.model.evaluate(fold.fit.parameters), strict=True):
            left_out[phase][fold.testing] = rate[fold.testing]
    observed = {phase: getattr(rates, f"{phase}_rate_hz") for phase in PHASES}
    return {
        phase: results.PhaseRates(
            fss_in_sample=None if seen is None else fractional_sum_of_squares(seen, predicted[phase]),
            observed_hz=seen,
            fitted_hz=predicted[phase],
            out_of_sample_hz=left_out[phase],
        )
        for phase, seen in observed.items()
    }


def _folds(
    prepared: Prepared, rates: RateRecordings, validation: CrossValidation
) -> tuple[results.FittedFold, ...]:
    six = [prepared.six(fold.fit.parameters) for fold in validation.folds]
    return tuple(
        results.FittedFold(
            fold=fold.fold + 1,
            stimuli=tuple(rates.stimuli[row] for row in fold.testing),
            fss_train=fold.fit.score,
            fss_test=fold.score_test,
            n_evaluations=fold.fit.n_evaluations,
            seconds=fold.fit.seconds,
            parameters=dict(zip(PARAMETER_NAMES, each.tolist(), strict=True)),
            identifiable=dict(zip(IDENTIFIABLE_NAMES, identifiable(each).tolist(), strict=True)),
        )
        for fold, each in zip(validation.folds, six, strict=True)
    )


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
    given = recordings.trains, 0.0, recordings.duration_ms, neuron.REFRACTORY.value, recordings.stimuli
    check_trains(*given)
    return recordings


Beside = Mapping[float, Traces | Sequence[Traces]]
"""Strain energy density by offset from the believed place, distal positive [mm], one column per stimulus."""


def check_offset(method: str, places_mm: Sequence[float]) -> None:
    """Raise `InputError` if a receptor's offset cannot be determined."""
    if method not in OFFSET_METHODS:
        raise InputError("offset", f"needs a method that fits it, {' or '.join(OFFSET_METHODS)}", str(method))
    if len(set(places_mm)) < 2:
        words = "needs stimuli at several places along the finger, as those of the shifted bar are"
        raise InputError("offset", words, remedy=f"all are at {places_mm[0]:g} mm, leave it out")


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
) -> results.OffsetFit:
    """Fit a receptor in its place, then let it move from the best fit, which it can only improve."""
    beside_mm = check_beside(beside)
    roving = ReceptorOffset.of_traces({offset: beside[offset] for offset in beside_mm}, windows_ms)
    search = four_numbers_and_offset(roving, rates)
    in_place = {"least_squares": "least_squares", "cma_es": "closed_form"}[method]
    first = prepare(in_place, roving.at(0.0), rates, rates, seed)

    def moving(begun: FloatArray) -> Method:
        if method == "cma_es":
            return search.by_evolution(np.append(begun, 0.0), seed)
        within = np.clip(begun, search.bounds.low[:4], search.bounds.high[:4])  # round-off at a bound
        offsets_mm = sorted({0.0, *roving.offsets_mm[1:-1].tolist()})
        starts = [np.append(within, offset) for offset in offsets_mm]
        return LeastSquares(starts, search.bounds, n_refined=2)

    best, crossed = validated(search.problem, Continued(first.method, moving, first.problem), memberships)
    four, offset_mm = fitted_four(best.parameters[:4]).tolist(), float(best.parameters[-1])
    folds_mm = [float(fold.fit.parameters[-1]) for fold in crossed.folds]
    error = jackknife_covariance(np.reshape(folds_mm, (-1, 1)))
    everything = np.arange(roving.n_stimuli)
    held = [prepare(method, place, rates, rates, seed) for place in roving.models]
    return results.OffsetFit(
        offset_mm=offset_mm,
        standard_error_mm=np.nan if error is None else np.sqrt(error[0, 0]),
        folds_mm=np.array(folds_mm),
        identifiable=dict(zip(IDENTIFIABLE_NAMES, four, strict=True)),
        fss_in_sample=best.score,
        fss_out_of_sample=crossed.score_test,
        fss_by_phase=search.problem.score_by_phase(best.parameters, everything),
        n_evaluations=best.n_evaluations,
        seconds=best.seconds,
        held=results.HeldOffset(
            offset_mm=beside_mm,
            fss_in_sample=np.array([one.method.fit(one.problem, everything).score for one in held]),
        ),
    )
