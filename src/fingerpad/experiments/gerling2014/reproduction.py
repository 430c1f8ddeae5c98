"""The whole paper in one run: two sets of tissues, each pressed, fitted, judged beside the paper."""

from __future__ import annotations

from collections.abc import Collection, Mapping
from dataclasses import replace
from functools import partial
from pathlib import Path
from typing import Any, Literal

from fingerpad.core.checked import result_class
from fingerpad.core.engine import Processes
from fingerpad.data import Published, all_published
from fingerpad.experiments.conditions import CURVATURES, POSITIONS_MM, RECEPTOR_X_MM, Conditions, Touch
from fingerpad.experiments.fit.results import UncertaintyResult
from fingerpad.experiments.gerling2014 import nerve, percept, skin
from fingerpad.experiments.gerling2014.claims import ClaimRow, Statement, Summary, judged, paired, summary
from fingerpad.experiments.gerling2014.thresholds import (
    CurvatureThresholds,
    curvature_thresholds,
    threshold_touches,
)
from fingerpad.experiments.runner import Manifest, Runner, StageSummary
from fingerpad.experiments.tissue_sets import TissueLayer, tissue_layers
from fingerpad.inference.afferent_fit import FourOfSix, response_surface
from fingerpad.inference.fitting.methods import Method
from fingerpad.neuron.afferent import PARAMETER_NAMES
from fingerpad.skin.sampling import SkinResponse

STANDARD_SPHERE = (POSITIONS_MM[0], CURVATURES[0])

PAPER = "paper"  # The paper's own system.
HUMAN = "human"  # The set that serves all three levels.


@result_class
class SetResult:
    """What one set of tissues with its afferent gives on all levels."""

    tissues: str
    mesh: skin.MeshPicture
    levels: nerve.ThreeLevels  #: The mesh under the standard sphere, and that indentation on all levels.
    skin_force: skin.SkinForce  #: Level 1: deflection and force.
    single_unit: nerve.SingleUnitResult
    firing: nerve.FiringCourse  #: Level 2: rates under the bar and their fit; when it fires, what drives it.
    discrimination: percept.SphereDiscrimination
    population: nerve.PopulationMaps
    nail: skin.NailBorder
    single_unit_uncertainty: UncertaintyResult | None = None
    curvature_thresholds: CurvatureThresholds | None = None  #: Beyond the paper, where asked for.
    comparison: tuple[ClaimRow, ...]  #: The paper's numbers beside ours.


@result_class
class ReproductionResult:
    """Result of a reproduction, the content of `results.json`."""

    format: Literal["fingerpad reproduction"] = "fingerpad reproduction"
    format_version: Literal[6] = 6
    summary: dict[str, Summary]  #: A few plain numbers of both sets, "paper" and "human".
    statements: tuple[Statement, ...]  #: What can fail, with our value and verdict of both sets.
    skin_deflection: skin.SkinDeflectionResult  #: Level 1: the paper's three trials.
    paper: SetResult
    human: SetResult  #: The paper's own system, and the set that serves all three levels.
    tissues: tuple[TissueLayer, ...]  #: Every named set of tissues, those of run and trials among them.
    inputs: tuple[Published, ...]  #: Published numbers on which all of it rests.
    manifest: Manifest


def reproduce(columns: Mapping[str, Conditions], extended: bool, runner: Runner) -> ReproductionResult:
    """Press, fit and judge the sets of both columns; `extended` adds what goes beyond the paper."""
    trials = {"skin deflection": skin.deflection_touches(columns[PAPER])}
    parts = {name: set_touches(conditions, extended) for name, conditions in columns.items()}
    # The longest indentations first: short ones fill the end, and hardly a core waits for another.
    longest_first = [*(each["nail"] for each in parts.values()), trials["skin deflection"]]
    longest_first += [each[part] for part in parts[PAPER] for each in parts.values() if part != "nail"]
    solved = frozenset(runner.solve(touch for touches in longest_first for touch in touches.values()))
    pressed = runner.read(trials, solved)["skin deflection"]
    deflection = skin.deflection_result(pressed)
    found: dict[str, tuple[SetResult, tuple[StageSummary, ...]]] = {}
    with runner.stage("fits and discrimination", len(columns)) as advance:
        work = partial(_set_in_process, folder=runner.folder, solved=solved, deflection=deflection)
        items = [(name, columns[name], parts[name]) for name in columns]
        for number, outcome in Processes(min(len(items), runner.jobs)).map(work, items):
            found[items[number][0]] = outcome()
            advance()
    runner.add_stages(stage for name in columns for stage in found[name][1])
    sphere, bar = parts[PAPER]["spheres"][STANDARD_SPHERE], parts[PAPER]["bar, 36 shifts"][0]
    meshes = {"sphere": sphere.mesh, "bar": bar.mesh} | {
        name: pressed["trial3", name].mesh for name in skin.INDENTERS
    }
    sets = {name: found[name][0] for name in columns}
    manifest = runner.manifest(columns[PAPER], meshes, half_model=not sphere.grading.full)
    manifest = replace(manifest, command=None)  # It names folders, and results are compared between machines.
    return ReproductionResult(
        summary={name: summary(each) for name, each in sets.items()},
        statements=paired(sets[PAPER].comparison, sets[HUMAN].comparison),
        skin_deflection=deflection,
        paper=sets[PAPER],
        human=sets[HUMAN],
        tissues=tissue_layers(),
        inputs=all_published(),
        manifest=replace(manifest, materials=" and ".join(each.tissues for each in sets.values())),
    )


def set_touches(conditions: Conditions, extended: bool = False) -> dict[str, dict[Any, Touch]]:
    """Touches of one set of tissues, by the part of the paper that they belong to."""
    touches: dict[str, dict[Any, Touch]] = {
        "nail": {"nail": skin.nail_touch(conditions)},
        "force": dict(skin.force_touches(conditions)),
        "bar, 36 shifts": dict(enumerate(conditions.bar_touches())),
        "spheres": dict(conditions.sphere_touches()),
    }
    if extended:
        touches["spheres, other curvatures"] = dict(threshold_touches(conditions))
    return touches


def _set_in_process(
    item: tuple[str, Conditions, dict[str, dict[Any, Touch]]],
    threads: int | None,
    folder: Path,
    solved: Collection[Path],
    deflection: skin.SkinDeflectionResult,
) -> tuple[SetResult, tuple[StageSummary, ...]]:
    """Read the stored indentations of one column, and analyse them; also tell what was read."""
    (name, conditions, touches), runner = item, Runner(folder)
    made = set_result(conditions, runner.read(touches, solved), deflection)
    return made, tuple(replace(stage, name=f"{name}: {stage.name}") for stage in runner.stages)


def set_result(
    conditions: Conditions,
    responses: Mapping[str, Mapping[Any, SkinResponse]],
    deflection: skin.SkinDeflectionResult,
) -> SetResult:
    """Fit the afferent of one set of tissues, let observers judge its spikes, and compare with the paper."""
    bars, spheres, seed = list(responses["bar, 36 shifts"].values()), responses["spheres"], conditions.seed
    tissues, afferent = str(conditions.tissues), conditions.afferent
    # The paper's own system is fitted by the paper's method. The afferent of `human` was fitted to areas of
    # receptive fields too (studies/sai_search.py) and is taken as it is.
    is_known = tissues == HUMAN
    method: Method = FourOfSix() if is_known else response_surface()
    traces = nerve.traces_at_receptor(bars, afferent)
    problem = nerve.rate_problem(traces, afferent)
    best, folds = nerve.fit(problem, method, afferent.parameters if is_known else None)
    fitted: dict[str, Any] = dict(zip(PARAMETER_NAMES, best.parameters.tolist(), strict=True))
    afferent = replace(afferent, **fitted)
    standard = spheres[STANDARD_SPHERE]
    made = SetResult(
        tissues=tissues,
        mesh=skin.mesh_picture(standard.mesh, RECEPTOR_X_MM),
        levels=nerve.three_levels(standard, afferent),
        skin_force=skin.skin_force(responses["force"]),
        single_unit=nerve.single_unit_result(problem, best, folds, afferent, method.name),
        firing=nerve.firing_course(traces, nerve.sed_at_receptor(bars), afferent, responses["force"]),
        discrimination=percept.discriminate_spheres(spheres, afferent, seed),
        population=nerve.population_maps(standard, afferent),
        nail=skin.nail_border(responses["nail"]["nail"]),
        comparison=(),
    )
    if others := responses.get("spheres, other curvatures"):
        centred = {curvature: each for (position, curvature), each in spheres.items() if position == 0.0}
        noise_sigma = made.discrimination.noise_sigma
        made = replace(
            made,
            single_unit_uncertainty=nerve.bar_uncertainty(traces, afferent, seed),
            curvature_thresholds=curvature_thresholds(centred | dict(others), afferent, noise_sigma, seed),
        )
    return replace(made, comparison=judged(made, deflection))
