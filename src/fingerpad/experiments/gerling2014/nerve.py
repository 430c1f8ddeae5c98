"""Level 2: afferents under a shifted bar and under a sphere (paper, 2.1, 2.2.2, 3.2, 4.4, Figures 2, 6)."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import replace
from typing import Any

import numpy as np
from scipy.interpolate import interp1d

from fingerpad.core.checked import result_class
from fingerpad.core.signals import Skin, Traces
from fingerpad.core.units import MM_PER_M
from fingerpad.core.values import FloatArray, Matrix, Number, Vector
from fingerpad.data import bar_firing_rates, protocol
from fingerpad.experiments.conditions import RECEPTOR_X_MM
from fingerpad.experiments.fit.likelihoods import uncertainty
from fingerpad.experiments.fit.results import Search, UncertaintyResult
from fingerpad.experiments.gerling2014.skin import (
    DECIMALS,
    PLATE_DEPTHS_MM,
    outline_elements,
    outline_nodes,
    plate,
)
from fingerpad.inference.afferent_fit import response_surface, start_points, validated
from fingerpad.inference.fitting.methods import (
    CrossValidation,
    Fit,
    FitStep,
    FoldFit,
    Method,
    cross_validate,
    interleaved_folds,
)
from fingerpad.inference.rate_model import AfferentModel, RateProblem
from fingerpad.inference.recordings import PHASES, RateRecordings
from fingerpad.neuron.afferent import PARAMETER_NAMES, Afferent, parameter_units
from fingerpad.neuron.lif import membrane_potential
from fingerpad.neuron.population import Population
from fingerpad.neuron.spikes import PAPER_WINDOWS_MS, first_spike_latency_ms, modulation_index
from fingerpad.skin.sampling import SkinResponse

RECEPTOR = ((RECEPTOR_X_MM, 0.0),)  # Position of the end organ: x and z on the skin. [mm]


@result_class
class Modulation:
    """Modulation of the rate at the edge of the bar (Eq. 11)."""

    maximum_hz: Number
    minimum_hz: Number  #: Smallest rate with the flat face of the bar over the receptor. [spikes/s]
    difference_hz: Number
    index: Number  #: Modulation index; NaN if there are no spikes. [1]


@result_class
class FoldResult:
    """One fold of the cross-validation."""

    fold: int
    start: int  #: Number of the fold and of the better start point, from 1.
    testing_shift_mm: Vector  #: Shifts left out, (n_testing,). [mm]
    fss_train: Number
    fss_test: Number  #: Of the better search. [1]
    climbs: tuple[Search, ...]  #: One per start point.


@result_class
class SingleUnitResult:
    """Fit of one afferent to the rates under the bar."""

    fss_in_sample: Number
    fss_in_sample_dynamic: Number
    fss_in_sample_static: Number  #: Fractional sum of squares over all shifts, weighted and by phase. [1]
    fss_out_of_sample: Number  #: Mean over the testing sets of the folds. [1]
    method: str
    dynamic_quantity: str
    static_quantity: str  #: What the two terms of the current follow, see `SkinResponse.sample`.
    parameters: dict[str, Number]
    units: dict[str, str]  #: Six parameters fitted to all shifts, and their units, by name.
    shift_mm: Vector  #: Shifts of the bar, proximal positive, (n_shifts,). [mm]
    dynamic_rate_hz: Vector
    static_rate_hz: Vector  #: Predicted rates, (n_shifts,). [spikes/s]
    observed_dynamic_rate_hz: Vector
    observed_static_rate_hz: Vector  #: Recorded rates, (n_shifts,). [spikes/s]
    start_points: tuple[dict[str, Number], ...]  #: Both start points, by name of the parameter.
    folds: tuple[FoldResult, ...]
    modulation: dict[str, dict[str, Modulation]]  #: By phase: "observed", and predicted, "ours".
    initial_mv: Number | None = None  #: Potential of the membrane at the start; by default at rest. [mV]


def traces_at_receptor(responses: Sequence[SkinResponse], afferent: Afferent) -> Traces:
    """Quantities that one afferent follows, one column per shift of the bar."""
    receptor = Population(np.array(RECEPTOR), 1.0, afferent)
    return Traces.joined([receptor.followed(skin) for skin in responses])


def sed_at_receptor(responses: Sequence[SkinResponse]) -> Traces:
    """Strain energy density at the one receptor, one column per shift of the bar."""
    return Traces.joined([skin.sed(RECEPTOR) for skin in responses])


def rate_problem(traces: Traces, afferent: Afferent) -> RateProblem:
    """Observed rates at all shifts, and the six parameters of an afferent that is driven by traces."""
    model = AfferentModel.of_traces(traces, initial_mv=afferent.initial_mv, like=afferent)
    return RateProblem(model, bar_recordings())


def bar_recordings() -> RateRecordings:
    """Return the rates observed under the bar, stimuli named by their shift in mm."""
    observed = bar_firing_rates()
    names = tuple(f"{shift:g}" for shift in observed.shift_mm)
    return RateRecordings(names, observed.dynamic_rate_hz, observed.static_rate_hz, observed.source)


def fit(
    problem: RateProblem, method: Method | None = None, known: FloatArray | None = None
) -> tuple[Fit, CrossValidation]:
    """Fit to all shifts, where the parameters are not known already, and cross-validate the method."""
    method, everything = method or response_surface(), np.arange(problem.n_observations)
    if known is None:
        return validated(problem, method)
    score = problem.score(known, everything)
    best = Fit(known, score, n_evaluations=0, seconds=0.0, history=(FitStep(known, score),))
    return best, cross_validate(problem, method, interleaved_folds(everything.size))


def single_unit_result(
    problem: RateProblem, best: Fit, folds: CrossValidation, afferent: Afferent, method: str
) -> SingleUnitResult:
    shift_mm, recordings = bar_firing_rates().shift_mm, problem.recordings
    observed = {phase: getattr(recordings, f"{phase}_rate_hz") for phase in PHASES}
    ours = dict(zip(PHASES, problem.model.evaluate(best.parameters), strict=True))
    by_phase = problem.score_by_phase(best.parameters, np.arange(problem.n_observations))
    return SingleUnitResult(
        fss_in_sample=best.score,
        fss_in_sample_dynamic=by_phase["dynamic"],
        fss_in_sample_static=by_phase["static"],
        fss_out_of_sample=folds.score_test,
        method=method,
        dynamic_quantity=afferent.dynamic_quantity,
        static_quantity=afferent.static_quantity,
        initial_mv=afferent.initial_mv,
        parameters=_six(best.parameters),
        units=parameter_units(afferent),
        shift_mm=shift_mm,
        dynamic_rate_hz=ours["dynamic"],
        static_rate_hz=ours["static"],
        observed_dynamic_rate_hz=observed["dynamic"],
        observed_static_rate_hz=observed["static"],
        start_points=tuple(map(_six, start_points())),
        folds=tuple(_fold(problem, fold, shift_mm) for fold in folds.folds),
        modulation={
            phase: {
                "observed": _modulation(shift_mm, observed[phase]),
                "ours": _modulation(shift_mm, ours[phase]),
            }
            for phase in PHASES
        },
    )


def _fold(problem: RateProblem, fold: FoldFit, shift_mm: FloatArray) -> FoldResult:
    """One fold: shifts left out, the better of its searches, and the steps of each."""
    return FoldResult(
        fold=fold.fold + 1,
        start=fold.fit.start + 1,
        testing_shift_mm=shift_mm[fold.testing],
        fss_train=fold.fit.score,
        fss_test=fold.score_test,
        climbs=Search.of(problem, fold),
    )


def _six(parameters: FloatArray) -> dict[str, float]:
    return dict(zip(PARAMETER_NAMES, parameters.tolist(), strict=True))


def _modulation(shift_mm: FloatArray, rate_hz: FloatArray) -> Modulation:
    """Compare the largest rate with the smallest under the flat face of the bar."""
    under_flat = np.abs(shift_mm) < protocol.BAR_WIDTH.value / 2 - protocol.BAR_FILLET.value
    largest, smallest = float(rate_hz.max()), float(rate_hz[under_flat].min())
    return Modulation(
        maximum_hz=largest,
        minimum_hz=smallest,
        difference_hz=float(largest - smallest),
        index=float(modulation_index(largest, smallest)) if largest > 0.0 else np.nan,
    )


@result_class
class FiringCourse:
    """Course of the firing and of the current under the bar, shift by shift, and rates by depth."""

    peak_ms: Vector  #: End of the shortest interval, (n_shifts,); NaN with fewer than two spikes. [ms]
    window_ms: tuple[float, float]  #: The paper's window of the dynamic rate. [ms]
    dynamic_share_ramp: Vector  #: Share of the dynamic term in the charge in the ramp, (n_shifts,). [1]
    dynamic_share_hold: Vector  #: The same in the hold, (n_shifts,). [1]
    sed_r2: Number  #: R² of the line from SED in the static window to the observed static rates. [1]
    depth_mm: Vector  #: Depths of a flat plate, (n_depths,). [mm]
    static_rate_by_depth_hz: Vector  #: At these depths, mean of the population, (n_depths,). [spikes/s]

    @property
    def fires(self) -> np.ndarray:
        """Shifts at which there are at least two spikes, (n_shifts,)."""
        return np.isfinite(self.peak_ms)


def firing_course(
    drive: Traces, sed: Traces, afferent: Afferent, pressed: Mapping[str, SkinResponse]
) -> FiringCourse:
    dynamic_ms, static_ms = PAPER_WINDOWS_MS
    population = Population.grid(afferent=afferent, centre_mm=RECEPTOR[0])
    in_hold = interp1d(sed.times_ms, sed.values, axis=0)(0.5 * (static_ms[0] + static_ms[1]))
    ramp_ms = protocol.RAMP.value
    plates = [population.respond(pressed[plate(depth)]).static_rate_hz for depth in PLATE_DEPTHS_MM]
    return FiringCourse(
        peak_ms=np.array([peak_ms(train) for train in afferent.spikes(drive)]),
        window_ms=(dynamic_ms[0], dynamic_ms[1]),
        dynamic_share_ramp=dynamic_share(drive, afferent, 0.0, ramp_ms),
        dynamic_share_hold=dynamic_share(drive, afferent, ramp_ms, float(drive.times_ms[-1])),
        sed_r2=float(np.corrcoef(in_hold, bar_firing_rates().static_rate_hz)[0, 1] ** 2),
        depth_mm=np.array(PLATE_DEPTHS_MM),
        static_rate_by_depth_hz=np.array([rate_hz.mean() for rate_hz in plates]),
    )


def peak_ms(spikes_ms: FloatArray) -> float:
    """End of the shortest interval between spikes, NaN with fewer than two spikes. [ms]"""
    return float(spikes_ms[1 + np.diff(spikes_ms).argmin()]) if spikes_ms.size > 1 else np.nan


def dynamic_share(drive: Traces, afferent: Afferent, start_ms: float, end_ms: float) -> FloatArray:
    """Share of the dynamic term in the charge of both terms between two knots, (n_sites,); 0 without."""

    def charge(silenced: str) -> FloatArray:
        # Its knots include both times; where it jumps there are two at one time.
        alone: dict[str, Any] = {"intercept_ma": 0.0, silenced: 0.0}
        term = replace(afferent, **alone).current(drive)
        first = np.searchsorted(term.times_ms, start_ms, side="right") - 1
        within = slice(first, np.searchsorted(term.times_ms, end_ms, side="left") + 1)
        return np.asarray(np.trapezoid(term.values[within], term.times_ms[within], axis=0))

    dynamic, static = charge("static_gain"), charge("dynamic_gain")
    return np.divide(dynamic, static + dynamic, out=np.zeros_like(static), where=static + dynamic > 0.0)


# What the rates determine

PIECES = 8
"""Linear pieces of the drive between two given times. Rates differ by less than 0.01 spikes/s on average from
those with 32, and an evaluation takes two thirds of the time."""

CHAINS = {"smallest_effective_size": 200.0}
"""Of the posterior: the error of the ends of a 95 % interval is a seventh of a standard deviation."""


def bar_uncertainty(traces: Traces, fitted: Afferent, seed: int) -> UncertaintyResult:
    """Find what the rates under the bar determine of the afferent; neighbouring shifts may miss alike."""
    model = AfferentModel.of_traces(traces, initial_mv=fitted.initial_mv, pieces=PIECES, like=fitted)
    shift_mm = bar_firing_rates().shift_mm
    return uncertainty(model, bar_recordings(), fitted.parameters, shift_mm, seed, **CHAINS)


# One sphere on all levels, and afferents all over the pad

OFFSETS_MM = np.array([0.0, 1.0, 2.0])  # Distances of three afferents from the sphere's axis, distal. [mm]
SHEET_PER_CM2, SHEET_ROWS = 1600.0, 41  # A square of afferents every 0.25 mm, to 5 mm from the axis.

SHEET_MEASURES = ("dynamic_rate_hz", "static_rate_hz", "first_spike_latency_ms")

UNTIL_MS, POTENTIAL_STEP_MS = 200.0, 0.5
"""Current and potential are given from the onset up to this time, at this spacing and about spikes. [ms]"""


@result_class
class ThreeLevels:
    """Skin, one afferent and three afferents under the standard sphere (Figure 2)."""

    curvature_per_m: float  #: Of the sphere. [1/m]
    centre_mm: tuple[float, float]  #: x and y of its centre at the end of the hold. [mm]
    ramp_ms: float  #: Duration of the ramp. [ms]
    x_mm: Matrix
    y_mm: Matrix
    """Nodes of the plane z = 0 at the end of the hold, through from the skin to the bone, (n_outline + 1,
    n_through + 1). [mm]"""
    pressed: str  #: Name of what the afferent follows, as it is known in all elements.
    pressed_kpa: Matrix  #: Its values in the elements beside that plane, (n_outline, n_through). [kPa]
    end_ms: float  #: End of the hold. [ms]
    offset_mm: Vector  #: Positions of the afferents relative to the contact, (3,). [mm]
    spikes_ms: tuple[Vector, ...]  #: Spike times of each afferent. [ms]
    dynamic_rate_hz: Vector
    static_rate_hz: Vector  #: Their rates, (3,). [spikes/s]
    times_ms: Vector
    until_ms: float  #: Times of the next two, and their end, (n_times,). [ms]
    current_ma: Vector
    potential_mv: Vector  #: Current and potential of the first afferent, (n_times,). [mA, mV]
    rheobase_ma: float
    threshold_mv: float  #: Smallest constant current, and potential, that elicit spikes. [mA, mV]


def three_levels(standard: SkinResponse, afferent: Afferent) -> ThreeLevels:
    mesh, curvature, membrane = standard.mesh, protocol.STANDARD_CURVATURE.value, afferent.membrane
    moved = (mesh.nodes_mm + standard.displacement_mm)[outline_nodes(mesh)].round(DECIMALS)
    pressed, values = standard.at_end(afferent.static_quantity)
    # The sphere has advanced from the skin to its depth.
    midline, x_mm = mesh.nodes_mm[mesh.midline_nodes], standard.axis_x_mm
    foot = np.array([x_mm, np.interp(x_mm, midline[:, 0], midline[:, 1])])
    centre = foot + (float(standard.depth_mm[-1]) - MM_PER_M / curvature) * standard.direction[:2]
    sites = np.stack([RECEPTOR_X_MM + OFFSETS_MM, 0.0 * OFFSETS_MM], axis=-1)
    sed = Population(sites, 1.0, afferent).followed(standard)
    trains, (dynamic_hz, static_hz) = tuple(afferent.spikes(sed)), afferent.rates(sed)
    early = trains[0][trains[0] < UNTIL_MS]
    # A reset is drawn upright.
    reset = early + 1e-6 * membrane.refractory_ms
    regular = np.arange(0.0, UNTIL_MS + POTENTIAL_STEP_MS, POTENTIAL_STEP_MS)
    times = np.unique(np.concatenate([regular, early, reset, early + membrane.refractory_ms]))
    below = afferent.current(sed.part(slice(0, 1)))
    return ThreeLevels(
        curvature_per_m=curvature,
        centre_mm=(float(centre[0]), float(centre[1])),
        ramp_ms=protocol.RAMP.value,
        x_mm=moved[..., 0],
        y_mm=moved[..., 1],
        pressed=pressed,
        pressed_kpa=values[outline_elements(mesh)],
        end_ms=float(sed.times_ms[-1]),
        offset_mm=OFFSETS_MM,
        spikes_ms=trains,
        dynamic_rate_hz=dynamic_hz,
        static_rate_hz=static_hz,
        times_ms=times,
        until_ms=UNTIL_MS,
        current_ma=np.interp(times, below.times_ms, below.values[:, 0]),
        potential_mv=membrane_potential(membrane, below, trains[0], times),
        rheobase_ma=membrane.capacitance_mf * membrane.threshold_mv / membrane.time_constant_ms,
        threshold_mv=membrane.threshold_mv,
    )


@result_class
class RestingResponse:
    """Response of an afferent without any touch."""

    dynamic_rate_hz: float
    static_rate_hz: float  #: Rates in the windows of the ramp and the hold. [spikes/s]
    first_spike_latency_ms: Number  #: NaN without a spike. [ms]


@result_class
class PopulationMaps:
    """Responses of a dense sheet of afferents under the standard sphere (Figure 6), over x and z."""

    x_mm: Vector
    z_mm: Vector  #: Places of the afferents, (n_x,). [mm]
    dynamic_rate_hz: Matrix
    static_rate_hz: Matrix  #: Rates, (n_x, n_z). [spikes/s]
    first_spike_latency_ms: Matrix  #: NaN without a spike, (n_x, n_z). [ms]
    curvature_per_m: float  #: Of the sphere. [1/m]
    at_rest: RestingResponse  #: Of the same afferent.
    receptors_mm: Matrix  #: Places of the paper's receptors, (18, 2). [mm]


def population_maps(standard: Skin, afferent: Afferent) -> PopulationMaps:
    """Simulate afferents side by side on a square about the contact point, under the standard sphere."""
    sheet = Population.grid(SHEET_PER_CM2, SHEET_ROWS, SHEET_ROWS, RECEPTOR[0], afferent).respond(standard)
    x_mm, z_mm = (np.unique(places) for places in sheet.positions_mm.T)
    tables = {name: getattr(sheet, name).reshape(x_mm.size, z_mm.size) for name in SHEET_MEASURES}
    return PopulationMaps(
        x_mm=x_mm,
        z_mm=z_mm,
        **tables,
        curvature_per_m=protocol.STANDARD_CURVATURE.value,
        at_rest=resting_response(afferent),
        receptors_mm=Population.grid(centre_mm=RECEPTOR[0]).positions_mm,
    )


def resting_response(afferent: Afferent) -> RestingResponse:
    end_ms = protocol.RAMP.value + protocol.HOLD.value
    sed = Traces.at_rest(end_ms, afferent.dynamic_quantity, afferent.static_quantity)
    dynamic_hz, static_hz = afferent.rates(sed, *PAPER_WINDOWS_MS)
    latency_ms = float(first_spike_latency_ms(afferent.spikes(sed))[0])
    return RestingResponse(
        dynamic_rate_hz=float(dynamic_hz[0]),
        static_rate_hz=float(static_hz[0]),
        first_spike_latency_ms=latency_ms,
    )
