"""Fit an afferent to recordings of one's own: press what was pressed, fit, judge out of sample, report."""

from __future__ import annotations

import hashlib
import time
from collections.abc import Mapping, Sequence
from dataclasses import dataclass, replace
from datetime import UTC, datetime
from functools import cached_property
from pathlib import Path
from typing import Any

import numpy as np
from numpy.typing import ArrayLike

from fingerpad.afferent import PARAMETER_NAMES
from fingerpad.checks import FloatArray, one_of, whole
from fingerpad.errors import InputError
from fingerpad.estimation.any_motion import WINDOWS_MS, AnyMotion, Windows
from fingerpad.estimation.identifiable import (
    IDENTIFIABLE_NAMES,
    IDENTIFIABLE_UNITS,
    identifiable,
)
from fingerpad.estimation.rate_problem import RateProblem
from fingerpad.estimation.reading import Recorded
from fingerpad.estimation.recordings import PHASES, RateRecordings, SpikeRecordings
from fingerpad.estimation.stimuli import TactileStimulus
from fingerpad.fitting import (
    CrossValidation,
    cross_validate,
    fractional_sum_of_squares,
    interleaved_folds,
)
from fingerpad.fitting.problem import IntArray
from fingerpad.grading import Grading
from fingerpad.indentation import Touch, touch_of
from fingerpad.indenters import FlatPunch, Line, Sphere
from fingerpad.mechanics.fields import QUANTITIES
from fingerpad.parameters import protocol
from fingerpad.reference import bar_firing_rates
from fingerpad.signals import STORED_ENERGY, SedTraces
from fingerpad.store import Store, solve_missing
from fingerpad.studies import single_unit
from fingerpad.studies.conditions import RECEPTOR_X_MM, Conditions
from fingerpad.studies.recording_methods import METHODS, Prepared, check_spikes
from fingerpad.studies.reproduction import STORE_FOLDER, NoProgress, Progress, plain, software

EXAMPLE = "bar.csv"
"""Name of the file of `example`."""


def fit_recordings(
    sed: SedTraces | Sequence[SedTraces],
    recordings: RateRecordings | SpikeRecordings,
    memberships: ArrayLike | None = None,
    *,
    method: str = "response_surface",
    windows_ms: Windows = WINDOWS_MS,
    seed: int = 0,
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
    folds = dealt_folds(len(rates.stimuli)) if memberships is None else np.asarray(memberships)
    check_enough(rates, folds)
    prepared = METHODS[one_of("method", method, tuple(METHODS))](
        AnyMotion.under(sed, windows_ms), recordings, rates, seed
    )
    best = prepared.method.fit(prepared.problem, np.arange(len(rates.stimuli)))
    validation = cross_validate(prepared.problem, prepared.method, folds)
    return plain(
        {
            "method": method,
            "source": rates.source,
            "n_evaluations": best.n_evaluations,
            "seconds": best.seconds,
        }
        | _parameters(prepared, best.parameters)
        | _scores(prepared.problem, rates, best.parameters, validation)
        | {"folds": _folds(prepared, rates, validation), "spikes": prepared.spikes(best, validation)}
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


def check_enough(rates: RateRecordings, memberships: IntArray) -> None:
    """Raise `InputError` if a training set cannot be fitted, or a set not be judged.

    Parameters
    ----------
    rates : RateRecordings
        What is to be fitted.
    memberships : int array (n_stimuli,)
        Fold of each stimulus.
    """
    if memberships.shape != (len(rates.stimuli),):
        raise InputError(
            f"memberships needs one fold per stimulus: got {memberships.size} for {len(rates.stimuli)}."
        )
    for fold in np.unique(memberships):
        training = rates.chosen(np.flatnonzero(memberships != fold))
        if training.n_rates < len(IDENTIFIABLE_NAMES):
            raise InputError(
                f"recordings must leave at least {len(IDENTIFIABLE_NAMES)} rates, one per free parameter, "
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


def _parameters(prepared: Prepared, fitted: FloatArray) -> dict[str, Any]:
    """Parameters in both forms, and how well the recordings determine those four that they can."""
    covariance = prepared.covariance(fitted)
    errors = [None] * 4 if covariance is None else np.sqrt(np.diag(covariance)).tolist()
    return _named(prepared.six(fitted)) | {
        "units": dict(zip(PARAMETER_NAMES, single_unit.UNITS, strict=True)),
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
    predicted = dict(zip(PHASES, problem.model.rates(fitted), strict=True))
    left_out = {phase: np.empty(problem.n_observations) for phase in PHASES}
    memberships = np.empty(problem.n_observations, dtype=np.int64)
    for fold in validation.folds:
        memberships[fold.testing] = fold.fold
        for phase, rate in zip(PHASES, problem.model.rates(fold.fit.parameters), strict=True):
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


@dataclass(frozen=True)
class RecordingFit:
    """A fit to recordings with all that it needs.

    Parameters
    ----------
    recorded : Recorded
        From `fingerpad.estimation.reading.read_recordings`.
    conditions : Conditions
        Finger, tissues, accuracy and seed.
    folder : Path
        Where finished indentations are stored.
    method : str
        One of `METHODS`.
    n_folds : int, optional
        How many folds to deal out; not together with folds that the recordings bring.
    windows_ms : ((float, float), (float, float))
        Windows of the dynamic and of the static rate. [ms]
    jobs : int
        Processes to use; the numbers do not depend on it.
    dynamic_quantity : str
        What the dynamic term follows: strain energy density, "stored", as in the paper, or another quantity
        of `SkinResponse.sample` as an extension.

    Raises
    ------
    InputError
        If the recordings cannot be fitted or a stimulus not be pressed; nothing has been pressed then.
    """

    recorded: Recorded
    conditions: Conditions
    folder: Path
    method: str = "response_surface"
    n_folds: int | None = None
    windows_ms: Windows = WINDOWS_MS
    jobs: int = 1
    dynamic_quantity: str = STORED_ENERGY

    def __post_init__(self) -> None:
        one_of("method", self.method, tuple(METHODS))
        one_of("dynamic_quantity", self.dynamic_quantity, tuple(QUANTITIES))
        whole("jobs", self.jobs, at_least=1)
        for start, end in self.windows_ms:
            if not 0.0 <= start < end:
                raise InputError(
                    f"windows must be a start from 0 on and a later end: got {start:g}, {end:g}."
                )
        end = max(end for _, end in self.windows_ms)
        for name, stimulus in self.recorded.stimuli.items():
            if stimulus.motion.end_ms < end:
                raise InputError(
                    f"windows must end with the stimuli, not at {end:g} ms: {name} ends at "
                    f"{stimulus.motion.end_ms:g} ms."
                )
        check_enough(self.rates, self.memberships)
        if self.method == "likelihood":
            motions = {stimulus.motion for stimulus in self.recorded.stimuli.values()}
            check_spikes(self.recorded.recordings, len(motions))
        # Built once here: what cannot be pressed is said before anything is.
        self.touches  # noqa: B018

    @cached_property
    def rates(self) -> RateRecordings:
        """What is fitted."""
        recordings = self.recorded.recordings
        return recordings if isinstance(recordings, RateRecordings) else recordings.rates(self.windows_ms)

    @cached_property
    def memberships(self) -> IntArray:
        """Fold of each stimulus."""
        given = self.recorded.memberships
        if given is not None and self.n_folds is not None:
            raise InputError("folds must come from the column fold or be dealt out, not both: leave one out.")
        return dealt_folds(len(self.rates.stimuli), self.n_folds) if given is None else given

    @cached_property
    def touches(self) -> dict[str, Touch]:
        """One touch per stimulus."""
        return touches(self.recorded.stimuli, self.conditions)


def touches(stimuli: Mapping[str, TactileStimulus], conditions: Conditions) -> dict[str, Touch]:
    """One touch per stimulus; those of the paper's bar are the very touches of the reproduction.

    Parameters
    ----------
    stimuli : mapping of str to TactileStimulus
        By name.
    conditions : Conditions
        Finger, tissues and accuracy.

    Returns
    -------
    dict of str to Touch

    Raises
    ------
    InputError
        If one cannot be pressed, with its name.
    """
    along = float(np.cos(np.deg2rad(conditions.skin_tilt_deg)))

    def touch(stimulus: TactileStimulus) -> Touch:
        wire = isinstance(stimulus.indenter, Line)
        perpendicular = 0.0 if wire else conditions.skin_tilt_deg
        return touch_of(
            conditions.finger,
            stimulus.indenter,
            stimulus.motion,
            conditions.materials,
            conditions.resolution,
            (RECEPTOR_X_MM + stimulus.x_mm * along, stimulus.z_mm),
            None if wire else _grading(stimulus, conditions),
            perpendicular if stimulus.tilt_deg is None else stimulus.tilt_deg,
        )

    found = {}
    for name, stimulus in stimuli.items():
        try:
            found[name] = touch(stimulus)
        except InputError as error:
            raise InputError(f"Stimulus {name} cannot be pressed: {error}") from error
    return found


def _grading(stimulus: TactileStimulus, conditions: Conditions) -> Grading:
    """Mesh that is fine about the receptor, the same for all stimuli of a kind."""
    is_round = isinstance(stimulus.indenter, Sphere | FlatPunch)
    grading = conditions.sphere_grading() if is_round else conditions.bar_grading()
    return replace(grading, full=True) if stimulus.z_mm != 0.0 else grading


def run(fit: RecordingFit, progress: Progress | None = None, **provenance: Any) -> dict[str, Any]:
    """Press all stimuli, fit, and say how it was done.

    Parameters
    ----------
    fit : RecordingFit
        What to fit and how.
    progress : Progress, optional
        Told about each finished press.
    **provenance
        What else the results shall say of their origin, such as the command and hashes of its files.

    Returns
    -------
    dict
        "fit" as `fit_recordings` returns it, with the stimuli's presentations, and "manifest".

    Raises
    ------
    ConvergenceError
        If a press or a fit does not end; finished presses stay stored.
    StoreError
        If a stored press is damaged or the folder cannot be written.
    """
    progress = progress or NoProgress()
    started, clock = datetime.now(UTC), time.perf_counter()
    store = Store(fit.folder / STORE_FOLDER)
    wanted = list(fit.touches.values())
    with progress.stage("indentations", sum(not store.holds(touch) for touch in wanted)) as advance:
        computed = solve_missing(wanted, store, fit.jobs, lambda seconds: advance())
    site = [[RECEPTOR_X_MM, 0.0]]
    sed = [store.load(touch).sed(site, fit.dynamic_quantity) for touch in wanted]
    with progress.stage("fit", 1) as advance:
        found = fit_recordings(sed, fit.rates, fit.memberships, method=fit.method, windows_ms=fit.windows_ms)
        advance()
    recorded = fit.recorded
    return plain(
        {
            "fit": found
            | {
                "presentations": list(recorded.presentations.values()),
                "spikes_after_hold": recorded.spikes_after_hold,
                "shift_mm": _shifts_mm(list(recorded.stimuli.values())),
            },
            "manifest": software()
            | {
                "seed": fit.conditions.seed,
                "resolution": fit.conditions.resolution,
                "materials": fit.conditions.materials,
                "windows_ms": fit.windows_ms,
                "dynamic_quantity": fit.dynamic_quantity,
                "indentations": len(wanted),
                "computed": computed,
                "started": started.isoformat(timespec="seconds"),
                "wall_s": round(time.perf_counter() - clock, 2),
            }
            | provenance,
        }
    )


def _shifts_mm(stimuli: Sequence[TactileStimulus]) -> list[float] | None:
    """Shifts, proximal positive, of stimuli that differ in nothing else; None for others."""
    if len({replace(stimulus, x_mm=0.0) for stimulus in stimuli}) > 1:
        return None
    return [0.0 - stimulus.x_mm for stimulus in stimuli]


def example() -> dict[str, bytes]:
    """Files to try a fit with: the rates under the paper's bar that come with the package.

    Returns
    -------
    dict of str to bytes
        Contents by file name.

    Examples
    --------
    >>> print(example()[EXAMPLE].decode().splitlines()[3])
    -3.5,0,0
    """
    observed = bar_firing_rates()
    rows = np.column_stack([observed.shift_mm, observed.dynamic_rate_hz, observed.static_rate_hz])
    lines = [
        f"# One SAI afferent under a bar 3 mm wide, pressed in by 1 mm. {observed.source}",
        "# shift: of the bar from the centre of the receptive field, proximal positive.",
        "shift_mm,dynamic_rate_hz,static_rate_hz",
        *(",".join(f"{value:g}" for value in row) for row in rows),
    ]
    return {EXAMPLE: ("\n".join(lines) + "\n").encode()}


def sha256(path: Path) -> str:
    """Hash of a file's content, by which it is known again."""
    return hashlib.sha256(path.read_bytes()).hexdigest()
