"""Fit an afferent to recordings of one's own: press what was pressed, fit, judge out of sample, report."""

from __future__ import annotations

from collections.abc import Sequence
from typing import Any

import numpy as np
from numpy.typing import ArrayLike

from fingerpad.core.checks import FloatArray, one_of, whole
from fingerpad.core.errors import InputError
from fingerpad.core.signals import SedTraces
from fingerpad.data import protocol
from fingerpad.experiments.fit.methods import METHODS, Prepared, four_number_problem
from fingerpad.experiments.fit.offset import Beside, check_beside, fit_offset
from fingerpad.experiments.fit.posterior import posterior, profiled
from fingerpad.experiments.fit.rate_uncertainty import sensitivity
from fingerpad.experiments.gerling2014.reproduction import plain
from fingerpad.inference.fitting import (
    CrossValidation,
    Fit,
    cross_validate,
    fractional_sum_of_squares,
    interleaved_folds,
)
from fingerpad.inference.fitting.problem import IntArray
from fingerpad.inference.identifiable import (
    IDENTIFIABLE_NAMES,
    IDENTIFIABLE_UNITS,
    identifiable,
)
from fingerpad.inference.rate_model import WINDOWS_MS, AfferentModel, Windows
from fingerpad.inference.rate_problem import RateProblem
from fingerpad.inference.recordings import PHASES, RateRecordings, SpikeRecordings
from fingerpad.neuron.afferent import PARAMETER_NAMES, PARAMETER_UNITS


def fit_recordings(
    sed: SedTraces | Sequence[SedTraces],
    recordings: RateRecordings | SpikeRecordings,
    memberships: ArrayLike | None = None,
    *,
    method: str = "least_squares",
    windows_ms: Windows = WINDOWS_MS,
    seed: int = 0,
    with_posterior: bool = False,
    with_profiles: bool = False,
    with_sensitivity: bool = False,
    beside: Beside | None = None,
    positions_mm: ArrayLike | None = None,
) -> dict[str, Any]:
    """Fit an afferent to what was recorded under stimuli whose strain energy density is known.

    Parameters
    ----------
    sed : SedTraces or sequence of SedTraces
        Strain energy density at the receptor, one column per stimulus, in the order in which `recordings`
        names them first; several traces follow each other.
    recordings : RateRecordings or SpikeRecordings
        What the afferent answered; spikes are counted in `windows_ms`, mean over presentations.
    memberships : int array (n_stimuli,), optional
        Fold of each stimulus from 0; by default six folds are dealt out in turn, or one per stimulus where
        there are fewer.
    method : str, optional
        One of `METHODS`.
    windows_ms : ((float, float), (float, float)), optional
        Windows of the dynamic and of the static rate; the paper's by default. [ms]
    seed : int, optional
        Of methods that draw.
    with_posterior : bool, optional
        Whether credible intervals are drawn as well, of the four numbers and of the rates.
    with_profiles : bool, optional
        Whether the likelihood of each of the four numbers is profiled.
    with_sensitivity : bool, optional
        Whether Sobol's indices tell what FSS is sensitive to.
    beside : mapping of float to SedTraces or to a sequence of SedTraces, optional
        The same energy density at places beside the receptor, by their offset along the finger, distal
        positive [mm], on both sides of 0: with it the receptor's offset is fitted as a seventh parameter,
        by least squares or CMA-ES, and told beside the fit.
    positions_mm : array_like (n_stimuli,), optional
        Where along a line each stimulus was: in posterior and profiles, neighbours may miss alike. [mm]

    Returns
    -------
    dict
        Plain numbers and lists, as in fit.json: parameters in both forms with their covariance, scores,
        folds, and observed and predicted rates.

    Raises
    ------
    InputError
        If there are fewer rates than free parameters in a training set, a fold has rates of 0 only, sizes
        disagree, a stimulus ends before a window, or a likelihood is asked of rates.
    ConvergenceError
        If a fit does not end.

    Examples
    --------
    Four stimuli whose energy density rises within 50 ms and stays, and an afferent that we know:

    >>> import fingerpad as fp
    >>> height_kpa = [0.8, 1.5, 2.2, 3.0]
    >>> sed = fp.SedTraces([0.0, 50.0, 1000.0], np.outer([0.0, 1.0, 1.0], height_kpa), kinks_ms=[50.0])
    >>> known = fp.Afferent.from_parameters([0.0, 1.5e-4, 9e-7, 60.0, 1e-6, 50.0])
    >>> recordings = RateRecordings(("low", "middle", "high", "highest"), *known.rates(sed))
    >>> fit = fit_recordings(sed, recordings, memberships=[0, 1, 0, 1])
    >>> fit["fss_in_sample"] > 0.99, fit["fss_out_of_sample"] > 0.97
    (True, True)
    """
    rates = recordings if isinstance(recordings, RateRecordings) else recordings.rates(windows_ms)
    if beside is not None:
        check_beside(beside)
    folds = dealt_folds(len(rates.stimuli)) if memberships is None else np.asarray(memberships)
    check_enough(rates, folds, len(IDENTIFIABLE_NAMES) + (beside is not None))
    model = AfferentModel.of_traces(sed, windows_ms)
    prepared = METHODS[one_of("method", method, tuple(METHODS))](model, recordings, rates, seed)
    best = prepared.method.fit(prepared.problem, np.arange(len(rates.stimuli)))
    validation = cross_validate(prepared.problem, prepared.method, folds)
    four = identifiable(prepared.six(best.parameters))
    return plain(
        {
            "method": method,
            "source": rates.source,
            "n_evaluations": best.n_evaluations,
            "seconds": best.seconds,
        }
        | _parameters(prepared, best, validation)
        | _scores(prepared.problem, rates, best.parameters, validation)
        | {
            "folds": _folds(prepared, rates, validation),
            "spikes": prepared.spikes(best, validation),
            "posterior": posterior(model, rates, four, seed, positions_mm) if with_posterior else None,
            "profiles": profiled(model, rates, four, positions_mm) if with_profiles else None,
            "sensitivity": (
                sensitivity(four_number_problem(model, rates), four, seed) if with_sensitivity else None
            ),
            "offset": None if beside is None else fit_offset(beside, rates, folds, method, windows_ms, seed),
        }
    )


def dealt_folds(n_stimuli: int, n_folds: int | None = None) -> IntArray:
    """Fold of each stimulus, dealt out in turn: six, or one per stimulus where there are fewer.

    Examples
    --------
    >>> dealt_folds(8).tolist(), dealt_folds(3).tolist(), dealt_folds(3, 2).tolist()
    ([0, 1, 2, 3, 4, 5, 0, 1], [0, 1, 2], [0, 1, 0])
    """
    whole("stimuli", n_stimuli, at_least=2)
    if n_folds is None:
        n_folds = min(int(protocol.FOLDS.value), n_stimuli)
    return interleaved_folds(n_stimuli, n_folds)


def check_enough(rates: RateRecordings, memberships: IntArray, n_free: int = len(IDENTIFIABLE_NAMES)) -> None:
    """Raise `InputError` if a training set cannot be fitted, or a set not be judged.

    Parameters
    ----------
    rates : RateRecordings
        What is to be fitted.
    memberships : int array (n_stimuli,)
        Fold of each stimulus.
    n_free : int, optional
        Free numbers.
    """
    if memberships.shape != (len(rates.stimuli),):
        raise InputError(
            f"memberships needs one fold per stimulus: got {memberships.size} for {len(rates.stimuli)}."
        )
    for fold in np.unique(memberships):
        training = rates.chosen(np.flatnonzero(memberships != fold))
        if training.n_rates < n_free:
            raise InputError(
                f"recordings must leave at least {n_free} rates, one per free parameter, "
                f"when a fold is left out: without fold {fold + 1} there are {training.n_rates}, record more."
            )
        for rows in (memberships == fold, memberships != fold):
            part = rates.chosen(np.flatnonzero(rows))
            for phase in part.phases:
                if not np.any(getattr(part, f"{phase}_rate_hz")):
                    raise InputError(
                        f"{phase}_rate_hz must not be 0 for all stimuli of a fold "
                        f"({', '.join(part.stimuli)}), since FSS divides by their squares: deal the folds "
                        "otherwise, by a column fold."
                    )


def _parameters(prepared: Prepared, best: Fit, validation: CrossValidation) -> dict[str, Any]:
    """Parameters in both forms, and how well the recordings determine those four that they can."""
    covariance = prepared.covariance(best, validation)
    errors = [None] * 4 if covariance is None else np.sqrt(np.diag(covariance)).tolist()
    return _named(prepared.six(best.parameters)) | {
        "units": dict(zip(PARAMETER_NAMES, PARAMETER_UNITS, strict=True)),
        "identifiable_units": dict(zip(IDENTIFIABLE_NAMES, IDENTIFIABLE_UNITS, strict=True)),
        "identifiable_standard_error": dict(zip(IDENTIFIABLE_NAMES, errors, strict=True)),
        "identifiable_covariance": covariance,
    }


def _named(six: FloatArray) -> dict[str, dict[str, float]]:
    """Six parameters, and the four that firing can tell, under their names."""
    return {
        "parameters": dict(zip(PARAMETER_NAMES, six.tolist(), strict=True)),
        "identifiable": dict(zip(IDENTIFIABLE_NAMES, identifiable(six).tolist(), strict=True)),
    }


def _scores(
    problem: RateProblem, rates: RateRecordings, fitted: FloatArray, validation: CrossValidation
) -> dict[str, Any]:
    """FSS in and out of sample, and every rate as observed, predicted, and predicted without its fold."""
    predicted = dict(zip(PHASES, problem.model.evaluate(fitted), strict=True))
    left_out = {phase: np.empty(problem.n_observations) for phase in PHASES}
    memberships = np.empty(problem.n_observations, dtype=np.int64)
    for fold in validation.folds:
        memberships[fold.testing] = fold.fold
        for phase, rate in zip(PHASES, problem.model.evaluate(fold.fit.parameters), strict=True):
            left_out[phase][fold.testing] = rate[fold.testing]
    found: dict[str, Any] = {
        "fss_in_sample": problem.score(fitted, np.arange(problem.n_observations)),
        "fss_training_mean": validation.score_train,
        "fss_out_of_sample": validation.score_test,
        "stimulus": rates.stimuli,
        "fold": memberships + 1,
    }
    for phase in PHASES:
        observed = getattr(rates, f"{phase}_rate_hz")
        found |= {
            f"fss_in_sample_{phase}": (
                None if observed is None else fractional_sum_of_squares(observed, predicted[phase])
            ),
            f"observed_{phase}_rate_hz": observed,
            f"{phase}_rate_hz": predicted[phase],
            f"out_of_sample_{phase}_rate_hz": left_out[phase],
        }
    return found


def _folds(prepared: Prepared, rates: RateRecordings, validation: CrossValidation) -> list[dict[str, Any]]:
    return [
        {
            "fold": fold.fold + 1,
            "stimuli": [rates.stimuli[row] for row in fold.testing],
            "fss_train": fold.score_train,
            "fss_test": fold.score_test,
            "n_evaluations": fold.fit.n_evaluations,
            "seconds": fold.fit.seconds,
        }
        | _named(prepared.six(fold.fit.parameters))
        for fold in validation.folds
    ]
