"""Level 2: one afferent under a shifted bar, its fit and its firing (paper, 2.1, 2.2.2, 3.2, 4.4)."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import replace

import numpy as np
from numpy.typing import ArrayLike
from scipy.interpolate import interp1d

from fingerpad.core.checked import result_class
from fingerpad.core.signals import STORED_ENERGY, Traces, traces_below
from fingerpad.core.values import FloatArray, Number, Vector
from fingerpad.data import bar_firing_rates, protocol
from fingerpad.experiments.conditions import RECEPTOR_X_MM, Conditions, Touch
from fingerpad.experiments.gerling2014.skin_deflection import PLATE_DEPTHS_MM, plate
from fingerpad.geometry.indenters import Bar
from fingerpad.inference.afferent_fit import response_surface, start_points
from fingerpad.inference.fitting.cross_validation import (
    CrossValidation,
    FoldFit,
    cross_validate,
    interleaved_folds,
)
from fingerpad.inference.fitting.methods import Fit, FitStep, Method
from fingerpad.inference.problem import RateProblem
from fingerpad.inference.rate_model import AfferentModel
from fingerpad.inference.recordings import RateRecordings
from fingerpad.neuron.afferent import PARAMETER_NAMES, Afferent, parameter_units
from fingerpad.neuron.population import Population
from fingerpad.neuron.spikes import PAPER_WINDOWS_MS, modulation_difference, modulation_index
from fingerpad.skin.sampling import SkinResponse

RECEPTOR = ((RECEPTOR_X_MM, 0.0),)  # Position of the end organ: x and z on the skin. [mm]


def bar_touches(conditions: Conditions) -> list[Touch]:
    """36 touches of the bar, shifted along the finger.

    Its flat face stays parallel to the skin at the receptor (docs/decisions.md#bar-orientation). A positive
    shift moves the bar towards the proximal end (docs/decisions.md#bar-shift).
    """
    tilt = conditions.skin_tilt_deg
    grading = conditions.bar_grading()
    return [
        conditions.touch(
            Bar(), RECEPTOR_X_MM - shift * float(np.cos(np.deg2rad(tilt))), grading, tilt_deg=tilt
        )
        for shift in protocol.BAR_SHIFTS.value
    ]


def traces_at_receptor(
    responses: list[SkinResponse], dynamic_quantity: str = STORED_ENERGY, static_quantity: str = STORED_ENERGY
) -> Traces:
    """Quantities of the two terms at the one receptor, one column per shift of the bar."""
    quantities = (dynamic_quantity, static_quantity)
    return Traces.joined([traces_below(skin, RECEPTOR, *quantities) for skin in responses])


def rate_problem(traces: Traces, initial_mv: float | None = None) -> RateProblem:
    """Observed rates at all shifts, and the paper's model of the afferent driven by traces."""
    return RateProblem(AfferentModel.of_traces(traces, initial_mv=initial_mv), bar_recordings())


def bar_recordings() -> RateRecordings:
    """Return the rates observed under the bar, stimuli named by their shift in mm."""
    observed = bar_firing_rates()
    names = tuple(f"{shift:g}" for shift in observed.shift_mm)
    return RateRecordings(names, observed.dynamic_rate_hz, observed.static_rate_hz, observed.source)


def fit(
    problem: RateProblem,
    memberships: ArrayLike | None = None,
    method: Method | None = None,
    known: FloatArray | None = None,
) -> tuple[Fit, CrossValidation]:
    method, everything = method or response_surface(), np.arange(problem.n_observations)
    folds = interleaved_folds(everything.size) if memberships is None else memberships
    if known is None:
        best = method.fit(problem, everything)
    else:
        score = problem.score(known, everything)
        best = Fit(known, score, n_evaluations=0, seconds=0.0, history=(FitStep(known, score),))
    return best, cross_validate(problem, method, folds)


@result_class
class Modulation:
    """Modulation of the rate at the edge of the bar (Eq. 11)."""

    maximum_hz: Number
    minimum_hz: Number  # Smallest rate with the flat face of the bar over the receptor. [spikes/s]
    difference_hz: Number
    index: Number  # Modulation index; NaN if there are no spikes. [1]


@result_class
class PhaseModulation:
    """Modulation of the rates of one phase."""

    observed: Modulation
    ours: Modulation  # Of the recorded and of the predicted rates.


@result_class
class RateModulation:
    """Modulation of both rates."""

    dynamic: PhaseModulation
    static: PhaseModulation  # During the ramp and during the hold.


@result_class
class SearchStep:
    """One iteration of the response-surface method."""

    iteration: int  # From 0, the start point.
    fss: Number  # Fractional sum of squares of the training set. [1]
    parameters: dict[str, Number]  # Six parameters, by name.


@result_class
class Search:
    """Search of one fold from one start point."""

    start: int  # Number of the start point, from 1.
    fss_train: Number
    fss_test: Number  # Fractional sum of squares of the training and of the testing set. [1]
    runs: int  # Evaluations of the model.
    history: tuple[SearchStep, ...]  # Steps from the start point to the end.


@result_class
class FoldResult:
    """One fold of the cross-validation."""

    fold: int
    start: int  # Number of the fold and of the better start point, from 1.
    testing_shift_mm: Vector  # Shifts left out, (n_testing,). [mm]
    fss_start: Vector  # Fractional sum of squares of the training set at the start points, (n_starts,). [1]
    fss_train: Number
    fss_test: Number  # Of the better search. [1]
    parameters: dict[str, Number]  # Six parameters of the better search, by name.
    climbs: tuple[Search, ...]  # One per start point.


@result_class
class SingleUnitResult:
    """Result of level 2."""

    fss_in_sample: Number
    fss_in_sample_dynamic: Number
    fss_in_sample_static: Number  # Fractional sum of squares over all shifts, weighted and by phase. [1]
    fss_out_of_sample: Number
    fss_training_mean: Number  # Mean over the folds, of the testing and of the training sets. [1]
    method: str
    dynamic_quantity: str
    static_quantity: str  # What the two terms of the current follow, see `SkinResponse.sample`.
    parameters: dict[str, Number]
    units: dict[str, str]  # Six parameters fitted to all shifts, and their units, by name.
    shift_mm: Vector  # Shifts of the bar, proximal positive, (n_shifts,). [mm]
    dynamic_rate_hz: Vector
    static_rate_hz: Vector  # Predicted rates, (n_shifts,). [spikes/s]
    observed_dynamic_rate_hz: Vector
    observed_static_rate_hz: Vector  # Recorded rates, (n_shifts,). [spikes/s]
    start_points: tuple[dict[str, Number], ...]  # Both start points, by name of the parameter.
    folds: tuple[FoldResult, ...]
    modulation: RateModulation
    initial_mv: Number | None = None  # Potential of the membrane at the start; by default at rest. [mV]


def single_unit_result(
    problem: RateProblem, best: Fit, folds: CrossValidation, afferent: Afferent, method: str
) -> SingleUnitResult:
    shift_mm, recordings = bar_firing_rates().shift_mm, problem.recordings
    observed_dynamic, observed_static = recordings.dynamic_rate_hz, recordings.static_rate_hz
    assert observed_dynamic is not None
    assert observed_static is not None
    dynamic, static = problem.model.evaluate(best.parameters)
    by_phase = problem.score_by_phase(best.parameters, np.arange(problem.n_observations))
    return SingleUnitResult(
        fss_in_sample=best.score,
        fss_in_sample_dynamic=by_phase["dynamic"],
        fss_in_sample_static=by_phase["static"],
        fss_out_of_sample=folds.score_test,
        fss_training_mean=folds.score_train,
        method=method,
        dynamic_quantity=afferent.dynamic_quantity,
        static_quantity=afferent.static_quantity,
        initial_mv=afferent.initial_mv,
        parameters=_named(best.parameters),
        units=parameter_units(afferent),
        shift_mm=shift_mm,
        dynamic_rate_hz=dynamic,
        static_rate_hz=static,
        observed_dynamic_rate_hz=observed_dynamic,
        observed_static_rate_hz=observed_static,
        start_points=tuple(_named(start) for start in start_points()),
        folds=tuple(_fold(problem, fold, shift_mm) for fold in folds.folds),
        modulation=RateModulation(
            dynamic=_modulations(shift_mm, observed_dynamic, dynamic),
            static=_modulations(shift_mm, observed_static, static),
        ),
    )


def _fold(problem: RateProblem, fold: FoldFit, shift_mm: FloatArray) -> FoldResult:
    """One fold: shifts left out, the better of its searches, and the steps of each."""
    searches = [
        Search(
            start=number,
            fss_train=search.score,
            fss_test=problem.score(search.parameters, fold.testing),
            runs=search.n_evaluations,
            history=tuple(
                SearchStep(iteration=iteration, fss=step.score, parameters=_named(step.parameters))
                for iteration, step in enumerate(search.history)
            ),
        )
        for number, search in enumerate(fold.fit.attempts, start=1)
    ]
    return FoldResult(
        fold=fold.fold + 1,
        start=fold.fit.start + 1,
        testing_shift_mm=shift_mm[fold.testing],
        fss_start=np.array([search.history[0].score for search in fold.fit.attempts]),
        fss_train=fold.score_train,
        fss_test=fold.score_test,
        parameters=_named(fold.fit.parameters),
        climbs=tuple(searches),
    )


def _named(parameters: FloatArray) -> dict[str, float]:
    return dict(zip(PARAMETER_NAMES, parameters.tolist(), strict=True))


def _modulations(shift_mm: FloatArray, observed_hz: FloatArray, ours_hz: FloatArray) -> PhaseModulation:
    observed, ours = (edge_modulation(shift_mm, rate_hz) for rate_hz in (observed_hz, ours_hz))
    return PhaseModulation(observed=observed, ours=ours)


def edge_modulation(shift_mm: FloatArray, rate_hz: FloatArray) -> Modulation:
    """Compare the largest rate with the smallest under the flat face of the bar."""
    under_flat = np.abs(shift_mm) < protocol.BAR_WIDTH.value / 2 - protocol.BAR_FILLET.value
    largest, smallest = float(rate_hz.max()), float(rate_hz[under_flat].min())
    return Modulation(
        maximum_hz=largest,
        minimum_hz=smallest,
        difference_hz=float(modulation_difference(largest, smallest)),
        index=float(modulation_index(largest, smallest)) if largest > 0.0 else np.nan,
    )


@result_class
class FiringCourse:
    """Course of the firing and of the current under the bar, shift by shift, and rates by depth."""

    peak_ms: Vector  # End of the shortest interval, (n_shifts,); NaN with fewer than two spikes. [ms]
    window_ms: tuple[float, float]  # The paper's window of the dynamic rate. [ms]
    dynamic_share_ramp: Vector  # Share of the dynamic term in the charge in the ramp, (n_shifts,). [1]
    dynamic_share_hold: Vector  # The same in the hold, (n_shifts,). [1]
    sed_r2: Number  # R² of the line from SED in the static window to the observed static rates. [1]
    depth_mm: Vector  # Depths of a flat plate, (n_depths,). [mm]
    static_rate_by_depth_hz: Vector  # At these depths, mean of the population, (n_depths,). [spikes/s]

    @property
    def fires(self) -> np.ndarray:
        """Shifts at which there are at least two spikes, (n_shifts,)."""
        return np.isfinite(self.peak_ms)


def firing_course(
    drive: Traces, sed: Traces, afferent: Afferent, pressed: Mapping[str, SkinResponse]
) -> FiringCourse:
    observed, (dynamic_ms, static_ms) = bar_firing_rates(), PAPER_WINDOWS_MS
    population = Population.grid(afferent=afferent, centre_mm=(RECEPTOR_X_MM, 0.0))
    in_hold = interp1d(sed.times_ms, sed.values, axis=0)(0.5 * (static_ms[0] + static_ms[1]))
    ramp_ms, end_ms = protocol.RAMP.value, float(drive.times_ms[-1])
    return FiringCourse(
        peak_ms=np.array([_peak_ms(train) for train in afferent.spikes(drive)]),
        window_ms=(dynamic_ms[0], dynamic_ms[1]),
        dynamic_share_ramp=_dynamic_share(drive, afferent, 0.0, ramp_ms),
        dynamic_share_hold=_dynamic_share(drive, afferent, ramp_ms, end_ms),
        sed_r2=float(np.corrcoef(in_hold, observed.static_rate_hz)[0, 1] ** 2),
        depth_mm=np.array(PLATE_DEPTHS_MM),
        static_rate_by_depth_hz=np.array(
            [population.respond(pressed[plate(depth)]).static_rate_hz.mean() for depth in PLATE_DEPTHS_MM]
        ),
    )


def _peak_ms(spikes_ms: FloatArray) -> float:
    """End of the shortest interval between spikes, NaN with fewer than two spikes. [ms]"""
    return float(spikes_ms[1 + np.diff(spikes_ms).argmin()]) if spikes_ms.size > 1 else np.nan


def _dynamic_share(drive: Traces, afferent: Afferent, start_ms: float, end_ms: float) -> FloatArray:
    """Share of the dynamic term in the charge of both terms from a start to an end, (n_sites,); 0 without."""
    transduction = afferent.transduction
    static, dynamic = (
        _charge(replace(transduction, intercept_ma=0.0, **{other: 0.0}).current(drive), start_ms, end_ms)
        for other in ("dynamic_gain", "static_gain")
    )
    both = static + dynamic
    return np.divide(dynamic, both, out=np.zeros_like(both), where=both > 0.0)


def _charge(current: Traces, start_ms: float, end_ms: float) -> FloatArray:
    """Integral of a current whose knots include both times, (n_sites,). [mA ms]"""
    first = np.searchsorted(current.times_ms, start_ms, side="right") - 1
    last = np.searchsorted(current.times_ms, end_ms, side="left")
    within = slice(first, last + 1)
    return np.asarray(np.trapezoid(current.values[within], current.times_ms[within], axis=0))
