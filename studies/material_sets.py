"""One set of tissues for all three levels: deflection, firing and discrimination of each candidate.

Every candidate is indented by the cylinder, by bars and by spheres. An afferent is then fitted twice: to the
firing rates alone, as in the paper, and to firing rates and hit rates at once. The second fit shows whether
any afferent meets both levels with this material.
"""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass, replace

import numpy as np
from numpy.typing import NDArray
from scipy.optimize import differential_evolution

from fingerpad.core.checks import FloatArray, not_negative, whole
from fingerpad.core.errors import ConvergenceError, InputError
from fingerpad.core.results import Number, Vector, result_class
from fingerpad.core.signals import SedTraces
from fingerpad.data import neuron, protocol, psychophysics
from fingerpad.experiments.conditions import RECEPTOR_X_MM, Conditions, Touch
from fingerpad.experiments.gerling2014 import single_unit, sphere_discrimination
from fingerpad.experiments.gerling2014.skin_deflection import deflection_r2
from fingerpad.experiments.runner import Runner
from fingerpad.geometry.grading import Grading
from fingerpad.geometry.indenters import Bar, Cylinder
from fingerpad.mechanics.materials import Tissues
from fingerpad.neuron.afferent import PARAMETER_NAMES, Afferent
from fingerpad.neuron.population import Population
from fingerpad.neuron.transduction import Drive, drive
from fingerpad.psychophysics.encoding import neighbour_pairs
from fingerpad.psychophysics.noise_fit import expected_hit_rates, fit_noise_sigma
from fingerpad.skin.sampling import SkinResponse

SHOWN_DISTANCES_MM = (1.0, 2.0, 3.0, 4.0, 5.0)
"""Distances from the indenter at which the deflection is reported, mean of both sides. [mm]"""

NOISE_SIGMA = psychophysics.NOISE_SIGMA.value
GOODWIN = np.array(psychophysics.GOODWIN_HIT_RATES.value)
SPHERES = (psychophysics.SPHERE_CURVATURES.value[0], *psychophysics.GOODWIN_CURVATURES.value)

NOISE_DRAWS = 400
"""Presentations behind each expected hit rate; a search evaluates thousands of hit rates with them."""

CHANCE = 0.5
"""Hit rate of an observer who guesses. [0-1]"""

SITE_MARGIN_MM = 0.3
"""Fine zone of the one bar beyond its outermost shifted site. [mm]"""

# Shares of the rheobase C v / tau, in which every set of tissues has the same range however stiff it is; the
# last is the time constant, as logarithms to base 10 but for the intercept.
BOUNDS = ((-3.0, 0.99), (-0.5, 1.7), (-1.0, 2.0), (0.7, 2.7))
"""Ranges of intercept, static drive, dynamic drive (all over the rheobase) and time constant [ms]."""


@dataclass(frozen=True)
class MaterialSet:
    """Tissues that are tried.

    Parameters
    ----------
    name : str
        Short, unique within a study.
    tissues : Tissues
        Laws of the four layers.
    basis : str
        Where the numbers come from, and their status.
    """

    name: str
    tissues: Tissues
    basis: str


@dataclass(frozen=True)
class Effort:
    """Indentations of the bar, and length of the search for an afferent.

    Parameters
    ----------
    shifted_bars : bool
        Indent the bar at all 36 shifts; or indent it once and sample the energy density at 36 shifted
        sites, which costs a thirtieth and neglects the curvature of the pad along the finger.
    generations, population : int
        Of the search for the afferent (differential evolution, four numbers).
    percept_weight : float
        Weight of the error in hit rates against FSS in the joint fit.

    Raises
    ------
    InputError
        If a number is out of its range.
    """

    shifted_bars: bool = False
    generations: int = 60
    population: int = 12
    percept_weight: float = 1.0

    def __post_init__(self) -> None:
        whole("generations", self.generations, 1)
        whole("population", self.population, 2)
        not_negative("percept_weight", self.percept_weight)


@result_class
class CylinderDeflection:
    """Deflection of the skin under the cylinder.

    Parameters
    ----------
    r2, r2_mirrored : float
        Against the observations, and against the observations with proximal and distal exchanged. [1]
    distance_mm, deflection_mm : array (n_distances,)
        Distance from the indenter, and the deflection there, mean of both sides. [mm]
    force_mn : float
        At the end of the hold. [mN]
    """

    r2: float
    r2_mirrored: float
    distance_mm: Vector
    deflection_mm: Vector
    force_mn: float


@result_class
class FittedAfferent:
    """Rates and hit rates of one afferent.

    Parameters
    ----------
    fss, fss_dynamic, fss_static : float
        FSS over all shifts, weighted and by phase. [1]
    noise_sigma, noise_fit_error : float
        Noise at which the hit rates are closest to Goodwin's, and the root mean square error there; NaN if
        none is found. [1]
    hit_rate : array (2,)
        At the paper's noise. [0-1]
    percept_error : float
        Root mean square error of these hit rates. [0-1]
    parameters : dict of float
        By name, see `fingerpad.neuron.afferent.PARAMETER_NAMES`.
    """

    fss: float
    fss_dynamic: float
    fss_static: float
    noise_sigma: Number
    noise_fit_error: Number
    hit_rate: Vector
    percept_error: float
    parameters: dict[str, float]


@result_class
class DeflectedSet:
    """Deflection of a material set.

    Parameters
    ----------
    name, basis : str
        As in `MaterialSet`.
    shear_kpa : dict of float
        Initial shear modulus by layer. [kPa]
    deflection : CylinderDeflection
        Under the cylinder.
    """

    name: str
    basis: str
    shear_kpa: dict[str, float]
    deflection: CylinderDeflection


@result_class
class EvaluatedSet(DeflectedSet):
    """A material set on all three levels.

    Parameters
    ----------
    name, basis, shear_kpa, deflection
        As in `DeflectedSet`.
    sed_peak_kpa : float
        Largest strain energy density at the receptor under the bar, at the end of the hold. [kPa]
    firing, joint : FittedAfferent
        Fitted to rates alone, and to rates and hit rates.
    """

    sed_peak_kpa: float
    firing: FittedAfferent
    joint: FittedAfferent


@result_class
class UnsolvedSet:
    """A material set whose mechanics could not be solved, with the reason as `unsolved`."""

    name: str
    basis: str
    unsolved: str


def touches(
    candidate: MaterialSet, conditions: Conditions, shifted_bars: bool = False
) -> dict[tuple[str, float], Touch]:
    """All indentations of one candidate.

    Returns
    -------
    dict
        `("cylinder", diameter)`, `("bar", shift)` and `("sphere", curvature)`, the keys in mm, mm and 1/m.
    """
    pressed = {("cylinder", Cylinder().diameter_mm): _cylinder_touch(candidate, conditions)}
    conditions = replace(conditions, materials=candidate.tissues)
    if shifted_bars:
        bars = zip(protocol.BAR_SHIFTS.value, single_unit.bar_touches(conditions), strict=True)
        pressed |= {("bar", shift): touch for shift, touch in bars}
    else:
        pressed["bar", 0.0] = conditions.touch(
            Bar(), RECEPTOR_X_MM, _wide_bar_grading(conditions), tilt_deg=conditions.skin_tilt_deg
        )
    spheres = sphere_discrimination.discrimination_touches(conditions)
    position = sphere_discrimination.POSITIONS_MM[0]
    return pressed | {("sphere", curvature): spheres[position, curvature] for curvature in SPHERES}


def _cylinder_touch(candidate: MaterialSet, conditions: Conditions) -> Touch:
    cylinder = Cylinder()
    grading = conditions.deflection_grading(cylinder)
    return conditions.touch(cylinder, RECEPTOR_X_MM, grading, candidate.tissues)


def _deflected(candidate: MaterialSet, cylinder: SkinResponse) -> DeflectedSet:
    tissues = candidate.tissues
    layers = {"epidermis": tissues.living_epidermis, "dermis": tissues.dermis, "subcutis": tissues.subcutis}
    return DeflectedSet(
        name=candidate.name,
        basis=candidate.basis,
        shear_kpa={name: layer.shear_modulus_kpa for name, layer in layers.items()},
        deflection=deflection(cylinder),
    )


def _wide_bar_grading(conditions: Conditions) -> Grading:
    """Mesh of the single-unit study, fine over all shifted sites and not only about the receptor."""
    farthest = max(abs(shift) for shift in protocol.BAR_SHIFTS.value)
    return replace(conditions.bar_grading(), half_length_mm=farthest + SITE_MARGIN_MM)


def bar_sed(responses: Mapping[tuple[str, float], SkinResponse], tilt_deg: float) -> SedTraces:
    """Strain energy density at the receptor, one column per shift.

    From one bar, the sites move instead of it: a bar shifted by s towards the proximal end has the receptor
    s distal of its axis, along the skin's tangent.
    """
    bars = {shift: skin for (kind, shift), skin in responses.items() if kind == "bar"}
    if len(bars) > 1:
        return single_unit.receptor_sed([bars[shift] for shift in protocol.BAR_SHIFTS.value])
    along = float(np.cos(np.deg2rad(tilt_deg)))
    return bars[0.0].sed([[RECEPTOR_X_MM + shift * along, 0.0] for shift in protocol.BAR_SHIFTS.value])


class Levels:
    """Drive of an afferent under bars and spheres with one candidate; evaluates and fits afferents.

    Parameters
    ----------
    sed : SedTraces
        At the receptor, one column per bar shift.
    spheres : sequence of SedTraces
        At the population's receptors, one per sphere of `SPHERES`.
    seed : int
        Of the presentations behind expected hit rates, and of the search.
    """

    def __init__(self, sed: SedTraces, spheres: Sequence[SedTraces], seed: int):
        population = Population.grid(centre_mm=(RECEPTOR_X_MM, 0.0))
        self.problem = single_unit.rate_problem(sed)
        self.spheres: list[Drive] = [drive(traces) for traces in spheres]
        self.neighbours = neighbour_pairs(population.positions_mm, population.pitch_mm)
        draws = (NOISE_DRAWS, len(population.positions_mm))
        self.draws = np.random.default_rng([seed, 0]).standard_normal(draws)
        self.seed = seed
        self.everything = np.arange(sed.n_sites)
        self.sed_peak_kpa = float(sed.sed_kpa[-1].max())
        self.rate_peak_kpa_per_ms = float(drive(sed).rate_kpa_per_ms.max())

    def parameters(self, searched: FloatArray) -> FloatArray:
        """Six parameters of an afferent from the four that are searched, see `BOUNDS`."""
        capacitance, threshold = neuron.CAPACITANCE.value, neuron.THRESHOLD.value
        intercept, log_static, log_dynamic, log_time = searched
        time_constant = 10.0**log_time
        rheobase = capacitance * threshold / time_constant
        return np.array(
            [
                intercept * rheobase,
                10.0**log_dynamic * rheobase / self.rate_peak_kpa_per_ms,
                10.0**log_static * rheobase / self.sed_peak_kpa,
                time_constant,
                capacitance,
                threshold,
            ]
        )

    def fss(self, parameters: FloatArray) -> float:
        """Weighted FSS over all shifts."""
        return self.problem.score(parameters, self.everything)

    def hit_rates(self, parameters: FloatArray, noise_sigma: float) -> FloatArray:
        """Predict the hit rates at 296 and 365 /m of the static Gradient Sum."""
        afferent = Afferent.from_parameters(parameters)
        static = np.array([afferent.rates(traces)[1] for traces in self.spheres])
        if not static.any():  # the search also tries silent afferents, whose observer guesses
            return np.full(len(SPHERES) - 1, CHANCE)
        return expected_hit_rates(static, self.neighbours, noise_sigma, self.draws)

    def percept_error(self, parameters: FloatArray) -> float:
        """Root mean square distance to Goodwin's hit rates at the paper's noise."""
        return float(np.sqrt(np.mean((self.hit_rates(parameters, NOISE_SIGMA) - GOODWIN) ** 2)))

    def search(self, effort: Effort, percept_weight: float) -> FloatArray:
        """Afferent that is best for FSS, less the weighted error in hit rates."""

        def loss(searched: FloatArray) -> float:
            parameters = self.parameters(searched)
            missed = percept_weight * self.percept_error(parameters) if percept_weight else 0.0
            return missed - self.fss(parameters)

        found = differential_evolution(
            loss,
            BOUNDS,
            seed=self.seed,
            popsize=effort.population,
            maxiter=effort.generations,
            tol=1e-4,
            polish=False,
        )
        return self.parameters(found.x)

    def evaluated(self, parameters: FloatArray) -> FittedAfferent:
        """Return FSS and hit rates of one afferent, and the noise that fits Goodwin's hit rates best."""
        by_phase = self.problem.score_by_phase(parameters, self.everything)
        try:
            noise = fit_noise_sigma(lambda sigma: self.hit_rates(parameters, sigma))
            sigma, error = noise.noise_sigma, noise.root_mean_square_error
        except ConvergenceError:  # where the responses to all spheres are equal, no noise fits
            sigma, error = float("nan"), float("nan")
        return FittedAfferent(
            fss=self.fss(parameters),
            fss_dynamic=by_phase["dynamic"],
            fss_static=by_phase["static"],
            noise_sigma=sigma,
            noise_fit_error=error,
            hit_rate=self.hit_rates(parameters, NOISE_SIGMA),
            percept_error=self.percept_error(parameters),
            parameters=dict(zip(PARAMETER_NAMES, parameters, strict=True)),
        )


def evaluate(
    candidate: MaterialSet,
    responses: Mapping[tuple[str, float], SkinResponse],
    conditions: Conditions,
    effort: Effort,
) -> EvaluatedSet:
    """Evaluate one candidate on the three levels."""
    cylinder = next(skin for (kind, _), skin in responses.items() if kind == "cylinder")
    sites = Population.grid(centre_mm=(RECEPTOR_X_MM, 0.0)).positions_mm
    levels = Levels(
        bar_sed(responses, conditions.skin_tilt_deg),
        [responses["sphere", curvature].sed(sites) for curvature in SPHERES],
        conditions.seed,
    )
    deflected = _deflected(candidate, cylinder)
    return EvaluatedSet(
        name=deflected.name,
        basis=deflected.basis,
        shear_kpa=deflected.shear_kpa,
        deflection=deflected.deflection,
        sed_peak_kpa=levels.sed_peak_kpa,
        firing=levels.evaluated(levels.search(effort, 0.0)),
        joint=levels.evaluated(levels.search(effort, effort.percept_weight)),
    )


def deflection(cylinder: SkinResponse) -> CylinderDeflection:
    """Return R² under the cylinder, deflection at a few distances and force."""
    profile = cylinder.surface_profile()
    distance = np.array(SHOWN_DISTANCES_MM)
    return CylinderDeflection(
        r2=deflection_r2(profile),
        r2_mirrored=deflection_r2(profile, proximal_positive=False),
        distance_mm=distance,
        deflection_mm=(profile.at(distance) + profile.at(-distance)) / 2.0,
        force_mn=cylinder.force_mn[-1],
    )


def compare(
    candidates: Sequence[MaterialSet],
    runner: Runner,
    conditions: Conditions,
    effort: Effort | None = None,
) -> list[EvaluatedSet | UnsolvedSet]:
    """Evaluate candidates one after the other; a stopped run continues after the last stored indentation.

    Parameters
    ----------
    candidates : sequence of MaterialSet
        To evaluate; names must differ.
    runner : Runner
        Where indentations are stored.
    conditions : Conditions
        Finger, resolution and seed; its materials are not used.
    effort : Effort, optional
        Indentations of the bar, and length of the search.

    Returns
    -------
    list of EvaluatedSet or UnsolvedSet
        One per candidate.

    Raises
    ------
    InputError
        If two candidates have one name.
    StoreError
        If a stored indentation is damaged.
    """
    names = [candidate.name for candidate in candidates]
    if len(set(names)) != len(names):
        raise InputError(f"candidates must have different names: got {', '.join(names)}.")
    effort = effort or Effort()
    rows: list[EvaluatedSet | UnsolvedSet] = []
    for candidate in candidates:
        wanted = touches(candidate, conditions, effort.shifted_bars)
        try:
            runner.solve(list(wanted.values()), candidate.name)
            responses = {key: runner.store.load(touch) for key, touch in wanted.items()}
            rows.append(evaluate(candidate, responses, conditions, effort))
        except ConvergenceError as error:
            rows.append(UnsolvedSet(name=candidate.name, basis=candidate.basis, unsolved=str(error)))
    return rows


def deflections(
    candidates: Sequence[MaterialSet], runner: Runner, conditions: Conditions
) -> list[DeflectedSet]:
    """Evaluate candidates with the cylinder alone; arguments as in `compare`.

    Raises
    ------
    ConvergenceError
        If an indentation cannot be solved.
    StoreError
        If a stored indentation is damaged.
    """
    pressed = {candidate.name: _cylinder_touch(candidate, conditions) for candidate in candidates}
    runner.solve(list(pressed.values()), "deflection alone")
    return [_deflected(one, runner.store.load(pressed[one.name])) for one in candidates]


def pareto_front(merits: FloatArray) -> NDArray[np.bool_]:
    """Return which candidates no other beats on all levels.

    A candidate is beaten by another that is at least as good on each level and better on one.

    Parameters
    ----------
    merits : array (n_candidates, n_levels)
        Larger is better.

    Returns
    -------
    boolean array (n_candidates,)

    Examples
    --------
    >>> pareto_front(np.array([[0.9, 0.8], [0.8, 0.9], [0.8, 0.8]])).tolist()
    [True, True, False]
    """
    beaten = [((merits >= merit).all(axis=1) & (merits > merit).any(axis=1)).any() for merit in merits]
    return ~np.array(beaten, dtype=bool)
