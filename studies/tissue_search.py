"""A search for one finger on all levels: deflection, plate force, firing and percept of each candidate.

Every candidate is pressed by a cylinder, a plate, a bar and spheres. One afferent is fitted to the firing
rates under the bar and to people's hit rates at once, and is silent at rest. `evaluate` goes from a candidate
to its levels; a search over parameters, or an emulator, calls nothing else.
"""

from __future__ import annotations

from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass, replace
from functools import cached_property
from pathlib import Path

import numpy as np

from fingerpad.core.checked import result_class
from fingerpad.core.errors import ConvergenceError
from fingerpad.core.signals import Traces
from fingerpad.core.units import MN_PER_N
from fingerpad.core.values import FloatArray, Matrix, Number, Vector
from fingerpad.data import protocol, psychophysics
from fingerpad.experiments.conditions import POSITIONS_MM, RECEPTOR_X_MM, Conditions, Touch
from fingerpad.experiments.gerling2014 import nerve
from fingerpad.experiments.gerling2014.percept import FITTED_SPHERES, draws_of, fit_to_people
from fingerpad.experiments.gerling2014.skin import PLATE_DEPTHS_MM, deflection_r2
from fingerpad.experiments.runner import Manifest, Runner
from fingerpad.experiments.validation.observations import read_observations
from fingerpad.geometry.bodies import Bar, Cylinder, Plate
from fingerpad.geometry.grading import Grading
from fingerpad.geometry.motion import RampAndHold
from fingerpad.inference.afferent_fit import CHANCE, ToRatesAndHitRates
from fingerpad.inference.fitting.methods import cross_validate, interleaved_folds
from fingerpad.inference.rate_model import AfferentModel, RateProblem
from fingerpad.neuron.afferent import PARAMETER_NAMES
from fingerpad.neuron.population import Population
from fingerpad.psychophysics.encoding import neighbour_pairs
from fingerpad.psychophysics.observer import expected_euclidean_hit_rates, expected_hit_rates, fit_noise_sigma
from fingerpad.skin.sampling import SkinResponse
from studies.tissue_candidates import LEVELS, Candidate, candidates

SPHERES_PER_M = (psychophysics.SPHERE_287.value, *psychophysics.GOODWIN_CURVATURES.value)

SITE_MARGIN_MM = 0.3
"""Fine zone of the one bar beyond its outermost shifted site. [mm]"""

NOISE_SIGMA = psychophysics.NOISE_SIGMA.value
PEOPLE = np.array(psychophysics.GOODWIN_HIT_RATES.value)
PLATE_OBSERVATIONS = Path(__file__).with_name("observations") / "plate_force.csv"

Key = tuple[str, float, float]
"""What is pressed, its size (depth, shift or curvature), and its position along the finger."""


def touches(candidate: Candidate, conditions: Conditions) -> dict[Key, Touch]:
    """All presses of one candidate, with its moduli before the common factor.

    Keys are `("cylinder", diameter, 0)`, `("plate", depth, 0)`, `("bar", shift, 0)` and `("sphere",
    curvature, position)`, in mm and 1/m; `ONE_BAR` for a bar that is read at shifted sites. The tissues of
    the conditions are not used.
    """
    own, cylinder = replace(conditions, tissues=candidate.tissues), Cylinder()
    pressed: dict[Key, Touch] = {
        ("cylinder", cylinder.diameter_mm, 0.0): own.touch(
            cylinder, RECEPTOR_X_MM, own.deflection_grading(cylinder)
        )
    }
    flat = own.touch(Plate(), RECEPTOR_X_MM, own.deflection_grading(Plate()))
    for depth_mm in PLATE_DEPTHS_MM:
        pressed["plate", depth_mm, 0.0] = replace(flat, stimulus=RampAndHold(depth_mm=depth_mm))
    if candidate.finalist:
        bars = zip(protocol.BAR_SHIFTS.value, own.bar_touches(), strict=True)
        pressed |= {("bar", shift, 0.0): touch for shift, touch in bars}
    else:
        pressed[ONE_BAR] = own.touch(Bar(), RECEPTOR_X_MM, wide_bar_grading(own), tilt_deg=own.skin_tilt_deg)
    return pressed | {
        ("sphere", curvature, position): own.sphere_touch(curvature, position)
        for position in POSITIONS_MM
        for curvature in SPHERES_PER_M
    }


ONE_BAR: Key = ("one bar", 0.0, 0.0)
"""The bar that is read at shifted sites."""


def wide_bar_grading(conditions: Conditions) -> Grading:
    """Mesh of the single-unit study, fine over all shifted sites and not only about the receptor."""
    farthest = max(abs(shift) for shift in protocol.BAR_SHIFTS.value)
    return replace(conditions.bar_grading(), half_length_mm=farthest + SITE_MARGIN_MM)


def plate_range_n() -> FloatArray:
    """Smallest and largest observed force of the plate at each depth of `PLATE_DEPTHS_MM`, (2, 2). [N]"""
    rows = read_observations(PLATE_OBSERVATIONS).rows
    by_depth = [
        [row.observed for row in rows if row.condition[1] == depth_mm] for depth_mm in PLATE_DEPTHS_MM
    ]
    return np.array([(min(forces), max(forces)) for forces in by_depth])


def driven(skin: SkinResponse, candidate: Candidate, sites: FloatArray) -> Traces:
    """Quantity that drives the afferents of a candidate at sites (n_sites, 2) [mm], raised to its exponent.

    It stands in the place of SED, one column per site.
    """
    values = skin.sample(candidate.reading.quantity, sites) ** candidate.reading.exponent
    return Traces(skin.times_ms, values, np.array(skin.kinks_ms))


def bar_traces(
    responses: Mapping[Key, SkinResponse], candidate: Candidate, conditions: Conditions
) -> list[Traces]:
    """Traces at the receptor, one column per shift of the bar.

    From one bar, the sites move instead of it: a bar shifted by s towards the proximal end has the receptor
    s distal of its axis, along the skin's tangent.
    """
    if ONE_BAR in responses:
        along = conditions.along_skin
        sites = [(RECEPTOR_X_MM + shift * along, 0.0) for shift in protocol.BAR_SHIFTS.value]
        return [driven(responses[ONE_BAR], candidate, np.array(sites))]
    receptor = np.array(nerve.RECEPTOR)
    return [driven(responses["bar", shift, 0.0], candidate, receptor) for shift in protocol.BAR_SHIFTS.value]


class Receptors:
    """The population that discriminates spheres."""

    @cached_property
    def population(self) -> Population:
        """Receptors about the contact point."""
        return Population.grid(centre_mm=(RECEPTOR_X_MM, 0.0))

    @cached_property
    def neighbours(self) -> np.ndarray:
        """Pairs of the Gradient Sum."""
        return neighbour_pairs(self.population.positions_mm, self.population.pitch_mm)


@dataclass(frozen=True)
class Skins(Receptors):
    """What the afferents of one candidate follow under bars and spheres."""

    bars: list[Traces]  #: At the receptor, one column per shift of the bar in all.
    spheres: Mapping[tuple[float, float], Traces]
    """At the receptors of the population, by curvature and position. [1/m, mm]"""
    seed: int = 0  #: Of the presentations behind expected hit rates.

    @cached_property
    def draws(self) -> FloatArray:
        """Presentations behind expected hit rates, (NOISE_DRAWS, n_receptors)."""
        return draws_of(self.population, self.seed)

    @cached_property
    def model(self) -> AfferentModel:
        """The paper's model under the bar."""
        return AfferentModel.of_traces(self.bars)

    @cached_property
    def problem(self) -> RateProblem:
        """Rates recorded under the bar, and the model."""
        return RateProblem(self.model, nerve.bar_recordings())

    @cached_property
    def method(self) -> ToRatesAndHitRates:
        """Fit to rates and hit rates; the afferent is silent at rest."""
        return fit_to_people([self.spheres[curvature, position] for position, curvature in FITTED_SPHERES])

    def static_hz(self, six: FloatArray, curvatures_per_m: Sequence[float], position_mm: float) -> FloatArray:
        """Return static rates of the population, (n_curvatures, n_receptors). [spikes/s]"""
        model = AfferentModel.of_traces(
            [self.spheres[curvature, position_mm] for curvature in curvatures_per_m]
        )
        return model.evaluate(six)[1].reshape(len(curvatures_per_m), -1)


@result_class
class Deflection:
    """Skin under cylinder and plate."""

    r2: float  #: Of the deflection under the cylinder. [1]
    plate_force_n: Vector
    """Force of the plate at the depths of `PLATE_DEPTHS_MM`, at the end of the hold, (2,). [N]"""


@result_class
class Firing:
    """Rates under the bar."""

    fss: float
    fss_out_of_sample: Number
    """FSS over all shifts, and mean over the six folds on the shifts left out, of the afferent fitted to
    rates and hit rates; NaN where no folds were fitted. [1]"""
    dynamic_hz: tuple[float, float]
    static_hz: tuple[float, float]
    """Smallest rate under the flat face of the bar, and largest rate. [spikes/s]"""


@result_class
class Percept:
    """Discrimination of spheres by the population."""

    noise_sigma: Number
    """Noise at which the Gradient Sum meets people's two hit rates best; NaN if none does. [1]"""
    hit_rates: Matrix  #: Of the Gradient Sum at the paper's noise, (n_positions, 2). [0-1]
    euclidean_rms: Number
    """Difference of the Euclidean Distance from people, root mean square over spheres and positions, at
    `noise_sigma`. [0-1]"""


@result_class
class Levels:
    """All levels of one candidate, and the six parameters of its afferent, by name."""

    deflection: Deflection
    firing: Firing
    percept: Percept
    parameters: dict[str, float]


def evaluate(
    candidate: Candidate, responses: Mapping[Key, SkinResponse], conditions: Conditions, folds: bool = True
) -> Levels:
    """Compute all levels of a candidate from its presses.

    Responses are those of `touches`. With folds the afferent is fitted to the six folds, too: seven fits
    instead of one.
    """
    sites = Population.grid(centre_mm=(RECEPTOR_X_MM, 0.0)).positions_mm
    skins = Skins(
        bar_traces(responses, candidate, conditions),
        {
            (curvature, position): driven(skin, candidate, sites)
            for (body, curvature, position), skin in responses.items()
            if body == "sphere"
        },
        conditions.seed,
    )
    firing, six = fitted(skins, folds)
    return Levels(
        deflection=deflection(responses, candidate.factor),
        firing=firing,
        percept=percept(skins, six),
        parameters=dict(zip(PARAMETER_NAMES, six.tolist(), strict=True)),
    )


def deflection(responses: Mapping[Key, SkinResponse], factor: float = 1.0) -> Deflection:
    """Return R² under the cylinder, and forces of the plate with all moduli multiplied by a common factor."""
    force_n = (
        np.array([responses["plate", depth, 0.0].force_mn[-1] for depth in PLATE_DEPTHS_MM])
        * factor
        / MN_PER_N
    )
    return Deflection(
        r2=deflection_r2(responses["cylinder", Cylinder().diameter_mm, 0.0].surface_profile()),
        plate_force_n=force_n,
    )


def fitted(skins: Skins, folds: bool = True) -> tuple[Firing, FloatArray]:
    """Fit one afferent to rates and hit rates, and return its rates and six parameters."""
    problem, everything = skins.problem, np.arange(skins.problem.n_observations)
    found = skins.method.fit(problem, everything)
    validated = cross_validate(problem, skins.method, interleaved_folds(everything.size)) if folds else None
    dynamic, static = problem.model.evaluate(found.parameters)
    firing = Firing(
        fss=problem.score(found.parameters, everything),
        fss_out_of_sample=np.nan if validated is None else validated.score_test,
        dynamic_hz=flat_and_largest(dynamic),
        static_hz=flat_and_largest(static),
    )
    return firing, found.parameters


def flat_and_largest(rate_hz: FloatArray) -> tuple[float, float]:
    """Return the smallest rate under the flat face of the bar, and the largest rate. [spikes/s]"""
    flat_mm = protocol.BAR_WIDTH.value / 2 - protocol.BAR_FILLET.value
    return float(rate_hz[np.abs(protocol.BAR_SHIFTS.value) < flat_mm].min()), float(rate_hz.max())


def percept(skins: Skins, six: FloatArray) -> Percept:
    """Discriminate spheres with a population of one afferent, given by its six parameters."""
    tables = [skins.static_hz(six, SPHERES_PER_M, position) for position in POSITIONS_MM]

    def gradient(sigma: float) -> FloatArray:
        return _hit_rates(
            tables, lambda table: expected_hit_rates(table, skins.neighbours, sigma, skins.draws)
        )

    def euclidean_rms(sigma: float) -> float:
        missed = _hit_rates(tables, lambda table: expected_euclidean_hit_rates(table, sigma)) - PEOPLE
        return float(np.sqrt(np.mean(np.square(missed))))

    try:
        noise = fit_noise_sigma(lambda sigma: gradient(sigma).mean(axis=0)).noise_sigma
    except ConvergenceError:
        noise = np.nan
    return Percept(
        noise_sigma=noise,
        hit_rates=gradient(NOISE_SIGMA),
        euclidean_rms=euclidean_rms(noise) if np.isfinite(noise) else np.nan,
    )


def _hit_rates(tables: Sequence[FloatArray], code: Callable[[FloatArray], FloatArray]) -> FloatArray:
    """Hit rates of a code for static rates at each position; an observer of silent receptors guesses."""
    return np.array([code(table) if table.any() else np.full(len(table) - 1, CHANCE) for table in tables])


@result_class
class Targets:
    """When a level counts as met."""

    r2: float
    fss: float  #: Least R² under the cylinder, and least FSS out of sample. [1]
    plate_force_n: Matrix
    """Smallest and largest force of people at each depth of `PLATE_DEPTHS_MM`, (2, 2). [N]"""
    noise_sigma: tuple[float, float]  #: Range of the fitted noise. [1]
    euclidean_rms: float  #: Largest error of the Euclidean Distance at that noise. [0-1]


def targets() -> Targets:
    """Return what is asked of every level; forces are those of people."""
    return Targets(
        r2=0.97, fss=0.90, plate_force_n=plate_range_n(), noise_sigma=(0.049, 0.061), euclidean_rms=0.05
    )


def met(levels: Levels, wanted: Targets) -> tuple[str, ...]:
    """Return those of `LEVELS` that meet their targets; without folds FSS in sample decides."""
    found, firing, percept = levels.deflection, levels.firing, levels.percept
    low, high = wanted.plate_force_n.T
    fss = firing.fss_out_of_sample if np.isfinite(firing.fss_out_of_sample) else firing.fss
    quiet, loud = wanted.noise_sigma
    reached = (
        found.r2 >= wanted.r2,
        bool(((low <= found.plate_force_n) & (found.plate_force_n <= high)).all()),
        fss >= wanted.fss,
        quiet <= percept.noise_sigma <= loud and percept.euclidean_rms <= wanted.euclidean_rms,
    )
    return tuple(level for level, reaches in zip(LEVELS, reached, strict=True) if reaches)


@result_class
class Row:
    """One candidate and its levels."""

    name: str
    drive: str  #: Of the candidate, and what drives the afferent.
    shear_kpa: Vector
    """Initial long-term shear moduli, with the common factor, from the outside in, (4,). [kPa]"""
    chosen_by: tuple[str, ...]
    """Levels whose observations were used to choose the candidate: in sample there."""
    shifted_bars: bool  #: Whether the bar was pressed at all shifts.
    levels: Levels | None  #: None if a press could not be solved.
    unsolved: str = ""  #: Why not.


@result_class
class TissueSearch:
    """Result of `python -m studies tissue-search`: rows of the candidates, targets, and what ran."""

    rows: tuple[Row, ...]
    targets: Targets
    manifest: Manifest


def search_one(candidate: Candidate, runner: Runner, conditions: Conditions, folds: bool = True) -> Row:
    """Press what is missing of one candidate, and compute its levels.

    Candidates with the same tissues share their presses. The tissues of the conditions are not used.
    """
    levels, unsolved, wanted = None, "", touches(candidate, conditions)
    try:
        runner.solve(wanted.values(), candidate.name)
        responses = {key: runner.store.load(touch) for key, touch in wanted.items()}
        levels = evaluate(candidate, responses, conditions, folds)
    except ConvergenceError as error:
        unsolved = str(error).splitlines()[0]
    return Row(
        name=candidate.name,
        drive=str(candidate.reading),
        shear_kpa=candidate.factor * np.array([each.shear_modulus_kpa for each in candidate.tissues.layers]),
        chosen_by=candidate.chosen_by,
        shifted_bars=candidate.finalist,
        levels=levels,
        unsolved=unsolved,
    )


def run(runner: Runner, conditions: Conditions) -> TissueSearch:
    """Compare all candidates; a stopped run continues after the last stored press."""
    return TissueSearch(
        rows=tuple(search_one(candidate, runner, conditions) for candidate in candidates()),
        targets=targets(),
        manifest=runner.manifest(conditions),
    )
