"""The whole paper in one run: two sets of tissues, each pressed, fitted, judged beside the paper."""

from __future__ import annotations

from collections.abc import Collection, Mapping
from dataclasses import asdict, field, replace
from functools import partial
from pathlib import Path
from typing import Annotated, Any, Literal

from fingerpad.core.checked import result_class, value_class
from fingerpad.core.engine import Engine, Processes, engine_of
from fingerpad.core.progress import Progress
from fingerpad.core.signals import STORED_ENERGY
from fingerpad.core.values import AnyPath, Flag, Number, Whole, choice
from fingerpad.data import all_published, neuron
from fingerpad.experiments.conditions import RECEPTOR_X_MM, Conditions, Touch
from fingerpad.experiments.gerling2014 import nerve, percept, skin
from fingerpad.experiments.gerling2014.claims import ClaimRow, Statement, judged, paired
from fingerpad.experiments.gerling2014.nerve import (
    FiringCourse,
    PopulationMaps,
    SingleUnitResult,
    ThreeLevels,
    UncertaintyResult,
)
from fingerpad.experiments.gerling2014.percept import SphereDiscrimination
from fingerpad.experiments.gerling2014.skin import MeshPicture, NailBorder, SkinDeflectionResult, SkinForce
from fingerpad.experiments.gerling2014.thresholds import (
    CurvatureThresholds,
    curvature_thresholds,
    threshold_touches,
)
from fingerpad.experiments.manifest import Manifest, StageSummary
from fingerpad.experiments.runner import Runner
from fingerpad.experiments.tissue_sets import TissueLayer, tissue_layers
from fingerpad.geometry.fingertip import Finger, Fingertip
from fingerpad.inference.afferent_fit import response_surface
from fingerpad.inference.fitting.methods import Method
from fingerpad.mechanics.tissues import TISSUES
from fingerpad.neuron.afferent import Afferent
from fingerpad.skin.sampling import SkinResponse

STANDARD_SPHERE = (percept.POSITIONS_MM[0], percept.CURVATURES[0])

PAPER, HUMAN = "paper", "human"  # The paper's own system; the set that serves all three levels.


@value_class
class Reproduction:
    """A run of all parts of the paper with two sets of tissues."""

    folder: AnyPath
    resolution: str = "standard"  # How fine meshes and steps are.
    seed: Whole = 0  # Seed of the observers' noise.
    tissues: Annotated[str, choice(tuple(name for name in TISSUES if name != HUMAN))] = PAPER
    """Tissues of the column `paper`: a name whose afferent follows strain energy density. "paper" is Trial 3
    with a Poisson's ratio of 0.40, which is our reading; "trial3" is Trial 3 to the letter, 0.48."""
    finger: Finger = field(default_factory=Fingertip)
    jobs: Whole | Engine = 1  # Processes or engine that press; the numbers do not depend on it.
    extended: Flag | None = None
    """Whether to go beyond the paper: uncertainty of the fit, and curvature thresholds at other standards. By
    default not at "quick" resolution, where this takes half as long again."""

    def __post_init__(self) -> None:
        engine_of(self.jobs)
        _ = self.conditions  # checks resolution and seed

    @property
    def goes_beyond(self) -> bool:
        return self.resolution != "quick" if self.extended is None else self.extended

    @property
    def conditions(self) -> dict[str, Conditions]:
        return {
            name: Conditions(self.resolution, self.seed, tissues, self.finger)
            for name, tissues in ((PAPER, self.tissues), (HUMAN, HUMAN))
        }


@result_class
class PublishedNumber:
    """A published number on which the results rest, as `fingerpad.data.all_published` lists it."""

    name: str
    value: float | tuple[float, ...]  # In `unit`.
    unit: str  # "1" for pure numbers.
    source: str  # Where it was published.
    status: str  # How far it can be trusted; see `fingerpad.data.STATUSES`.


@result_class
class SetResult:
    """What one set of tissues with its afferent gives on all levels."""

    tissues: str
    mesh: MeshPicture
    levels: ThreeLevels  # The mesh under the standard sphere, and that indentation on all levels.
    skin_force: SkinForce  # Level 1: deflection and force.
    single_unit: SingleUnitResult
    firing: FiringCourse  # Level 2: rates under the bar and their fit; when it fires, what drives it.
    discrimination: SphereDiscrimination
    population: PopulationMaps
    nail: NailBorder
    single_unit_uncertainty: UncertaintyResult | None = None
    curvature_thresholds: CurvatureThresholds | None = None  # Beyond the paper, where asked for.
    comparison: tuple[ClaimRow, ...]  # The paper's numbers beside ours.


@result_class
class Summary:
    """One number per quantity, at the tissues, the afferent and the noise of the run."""

    deflection_r2: Number  # R² of the deflection under the cylinder at 1.0 mm.
    force_plate_1mm_n: Number
    force_plate_2mm_n: Number
    force_disc_1mm_n: Number  # Force of a flat plate and of a disc of 6.35 mm, end of the hold. [N]
    fss_out_of_sample: Number
    fss_in_sample: Number  # Fractional sum of squares under the bar: mean of folds, and all shifts.
    dynamic_flat_hz: Number
    dynamic_max_hz: Number  # Smallest dynamic rate under the flat face, and the largest. [spikes/s]
    static_difference_hz: Number  # Largest static rate less the smallest under the flat face. [spikes/s]
    resting_rate_hz: Number  # Rate without a touch. [spikes/s]
    noise_sigma: Number  # Noise that fits people's two points best.
    euclidean_rms_same_noise: Number  # Euclidean Distance: rms distance to these points. [0-1]
    hit_rate_296: tuple[Number, Number]
    hit_rate_365: tuple[Number, Number]  # Static Gradient Sum, spheres at 0.0 and 0.2 mm. [0-1]
    weber_144: Number
    weber_287: Number  # Curvature threshold at 75 % over the standard; NaN where there is none.
    wall_s: float = 0.0
    peak_memory_mb: float = 0.0  # Of the whole run, both sets. [s, MB]


@result_class
class Summaries:
    """Numbers of both sets, and time and memory of the whole run."""

    paper: Summary
    human: Summary
    wall_s: float
    peak_memory_mb: float


@result_class
class ReproductionResult:
    """Result of a reproduction, the content of `results.json`."""

    format: Literal["fingerpad reproduction"] = "fingerpad reproduction"
    format_version: Literal[5] = 5
    summary: Summaries  # A few plain numbers of both sets.
    statements: tuple[Statement, ...]  # What can fail, with our value and verdict of both sets.
    skin_deflection: SkinDeflectionResult  # Level 1: the paper's three trials.
    paper: SetResult
    human: SetResult  # The paper's own system, and the set that serves all three levels.
    tissues: tuple[TissueLayer, ...]  # Every named set of tissues, those of run and trials among them.
    inputs: tuple[PublishedNumber, ...]  # Published numbers on which all of it rests.
    manifest: Manifest


def reproduce(run: Reproduction, progress: Progress | None = None) -> ReproductionResult:
    runner, columns = Runner(run.folder, run.jobs, progress), run.conditions
    trials = {"skin deflection": skin.deflection_touches(columns[PAPER])}
    parts = {name: set_touches(conditions, run.goes_beyond) for name, conditions in columns.items()}
    # The longest indentations first: short ones fill the end, and hardly a core waits for another.
    longest_first = [*(each["nail"] for each in parts.values()), trials["skin deflection"]]
    longest_first += [each[part] for part in parts[PAPER] for each in parts.values() if part != "nail"]
    solved = frozenset(runner.solve(touch for touches in longest_first for touch in touches.values()))
    pressed = runner.read(trials, solved)["skin deflection"]
    deflection = skin.deflection_result(pressed)
    found: dict[str, tuple[SetResult, Summary, tuple[StageSummary, ...]]] = {}
    with runner.stage("fits and discrimination", len(columns)) as advance:
        work = partial(_set_in_process, folder=runner.folder, deflection=deflection, solved=solved, run=run)
        names = tuple(columns)
        for number, outcome in Processes(min(len(names), runner.jobs)).map(work, names):
            found[names[number]] = outcome()
            advance()
    runner.add_stages(stage for name in columns for stage in found[name][2])
    sphere, bar = parts[PAPER]["spheres"][STANDARD_SPHERE], parts[PAPER]["bar, 36 shifts"][0]
    meshes = {"sphere": sphere.mesh, "bar": bar.mesh} | {
        name: pressed["trial3", name].mesh for name in skin.INDENTERS
    }
    manifest = runner.manifest(columns[PAPER], meshes, half_model=not sphere.grading.full)
    sets = {name: found[name][0] for name in columns}
    manifest = replace(manifest, materials=" and ".join(each.tissues for each in sets.values()))
    wall_s, peak_mb = manifest.wall_s, manifest.peak_memory_mb
    return ReproductionResult(
        summary=Summaries(
            paper=replace(found[PAPER][1], wall_s=wall_s, peak_memory_mb=peak_mb),
            human=replace(found[HUMAN][1], wall_s=wall_s, peak_memory_mb=peak_mb),
            wall_s=wall_s,
            peak_memory_mb=peak_mb,
        ),
        statements=paired(sets[PAPER].comparison, sets[HUMAN].comparison),
        skin_deflection=deflection,
        paper=sets[PAPER],
        human=sets[HUMAN],
        tissues=tissue_layers(),
        inputs=tuple(PublishedNumber(**asdict(number)) for number in all_published()),
        manifest=manifest,
    )


def set_touches(conditions: Conditions, goes_beyond: bool = False) -> dict[str, dict[Any, Touch]]:
    """Touches of one set of tissues, by the part of the paper that they belong to."""
    touches: dict[str, dict[Any, Touch]] = {
        "nail": {"nail": skin.nail_touch(conditions)},
        "force": dict(skin.force_touches(conditions)),
        "bar, 36 shifts": dict(enumerate(nerve.bar_touches(conditions))),
        "spheres": dict(percept.sphere_touches(conditions)),
    }
    if goes_beyond:
        touches["spheres, other curvatures"] = dict(threshold_touches(conditions))
    return touches


def _set_in_process(
    name: str,
    threads: int | None,
    folder: Path,
    deflection: SkinDeflectionResult,
    solved: Collection[Path],
    run: Reproduction,
) -> tuple[SetResult, Summary, tuple[StageSummary, ...]]:
    """Read the stored indentations of one column, and analyse them; also tell what was read."""
    conditions, runner = run.conditions[name], Runner(folder)
    responses = runner.read(set_touches(conditions, run.goes_beyond), solved)
    made, afferent = set_result(conditions, responses, deflection)
    stages = tuple(replace(stage, name=f"{name}: {stage.name}") for stage in runner.stages)
    return made, summary(made, afferent), stages


def set_result(
    conditions: Conditions,
    responses: Mapping[str, Mapping[Any, SkinResponse]],
    deflection: SkinDeflectionResult,
) -> tuple[SetResult, Afferent]:
    """Fit the afferent of one set of tissues, let observers judge its spikes, and compare with the paper."""
    bars, spheres, seed = list(responses["bar, 36 shifts"].values()), responses["spheres"], conditions.seed
    quantity, tissues = conditions.quantity, str(conditions.tissues)
    # The paper's own system is fitted by the paper's method; its membrane starts at 0, as the paper prints.
    initial_mv: float | None = neuron.PAPER_INITIAL.value
    method: Method = response_surface()
    if quantity != STORED_ENERGY:
        initial_mv, method = None, percept.to_rates_and_hit_rates(spheres, quantity)
    traces = nerve.traces_at_receptor(bars, quantity, quantity)
    problem = nerve.rate_problem(traces, initial_mv)
    # The score of `human` has many maxima, between which last digits choose: its fit is that of Afferent().
    best, folds = nerve.fit(problem, method, Afferent().parameters if tissues == HUMAN else None)
    afferent = Afferent.from_parameters(
        best.parameters, dynamic_quantity=quantity, static_quantity=quantity, initial_mv=initial_mv
    )
    standard, nail = spheres[STANDARD_SPHERE], responses["nail"]["nail"]
    unit = nerve.single_unit_result(problem, best, folds, afferent, method.name)
    firing = nerve.firing_course(traces, nerve.traces_at_receptor(bars), afferent, responses["force"])
    made = SetResult(
        tissues=tissues,
        mesh=skin.mesh_picture(standard.mesh, RECEPTOR_X_MM),
        levels=nerve.three_levels(standard, afferent),
        skin_force=skin.skin_force(responses["force"]),
        single_unit=unit,
        firing=firing,
        discrimination=percept.discriminate_spheres(spheres, afferent, seed),
        population=nerve.population_maps(standard, afferent),
        nail=skin.nail_border(nail),
        comparison=(),
    )
    if others := responses.get("spheres, other curvatures"):
        centred = {curvature: each for (position, curvature), each in spheres.items() if position == 0.0}
        noise_sigma = made.discrimination.noise_sigma
        uncertainty = nerve.uncertainty_result(traces, best.parameters, seed, initial_mv=initial_mv)
        thresholds = curvature_thresholds(centred | dict(others), afferent, noise_sigma, seed)
        made = replace(made, single_unit_uncertainty=uncertainty, curvature_thresholds=thresholds)
    return replace(made, comparison=judged(made, deflection)), afferent


def summary(found: SetResult, afferent: Afferent) -> Summary:
    """Collect the numbers of one set; time and memory are known when the run ends."""
    force, unit, discrimination = found.skin_force, found.single_unit, found.discrimination
    dynamic, static = unit.modulation.dynamic.ours, unit.modulation.static.ours
    at_296, at_365 = zip(*(place.at_goodwin for place in discrimination.statistics.targets), strict=True)
    return Summary(
        deflection_r2=force.deflection_r2,
        force_plate_1mm_n=force.plate_1mm_n,
        force_plate_2mm_n=force.plate_2mm_n,
        force_disc_1mm_n=force.disc_1mm_n,
        fss_out_of_sample=unit.fss_out_of_sample,
        fss_in_sample=unit.fss_in_sample,
        dynamic_flat_hz=dynamic.minimum_hz,
        dynamic_max_hz=dynamic.maximum_hz,
        static_difference_hz=static.difference_hz,
        resting_rate_hz=nerve.resting_response(afferent).static_rate_hz,
        noise_sigma=discrimination.noise_sigma,
        euclidean_rms_same_noise=discrimination.statistics.misfit["euclidean"].value,
        hit_rate_296=tuple(rate.value for rate in at_296),
        hit_rate_365=tuple(rate.value for rate in at_365),
        weber_144=weber_fraction(found.curvature_thresholds, 144.0),
        weber_287=weber_fraction(found.curvature_thresholds, 287.0),
    )


def weber_fraction(thresholds: CurvatureThresholds | None, standard_per_m: float) -> float:
    """Weber fraction of the paper's population at one standard, NaN without one."""
    standards = thresholds.populations[0].standards if thresholds else ()
    found = {one.standard_per_m: one.weber_fraction for one in standards}
    return found.get(standard_per_m, float("nan"))
