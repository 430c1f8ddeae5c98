"""The whole paper in one run: indentations, fit, discrimination, comparison with the paper."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import asdict, dataclass
from pathlib import Path
from typing import Any, Literal

from fingerpad.core.engine import Engine, engine_of
from fingerpad.core.progress import Progress
from fingerpad.core.results import result_class
from fingerpad.core.signals import STORED_ENERGY
from fingerpad.data import all_published
from fingerpad.experiments.conditions import RECEPTOR_X_MM, Conditions, Touch
from fingerpad.experiments.gerling2014 import (
    curvature_thresholds,
    mesh_picture,
    nail_border,
    response_maps,
    single_unit,
    single_unit_uncertainty,
    skin_deflection,
    skin_force,
    sphere_discrimination,
    three_levels,
)
from fingerpad.experiments.gerling2014.claim_row import ClaimRow
from fingerpad.experiments.gerling2014.comparison import comparison
from fingerpad.experiments.gerling2014.curvature_thresholds import CurvatureThresholds
from fingerpad.experiments.gerling2014.mesh_picture import MeshPicture
from fingerpad.experiments.gerling2014.nail_border import NailBorder
from fingerpad.experiments.gerling2014.response_maps import PopulationMaps
from fingerpad.experiments.gerling2014.single_unit import SingleUnitResult
from fingerpad.experiments.gerling2014.single_unit_uncertainty import UncertaintyResult
from fingerpad.experiments.gerling2014.skin_deflection import SkinDeflectionResult
from fingerpad.experiments.gerling2014.skin_force import SkinForce
from fingerpad.experiments.gerling2014.sphere_discrimination import SphereDiscrimination
from fingerpad.experiments.gerling2014.summary import Summary, summary
from fingerpad.experiments.gerling2014.three_levels import ThreeLevels
from fingerpad.experiments.manifest import Manifest
from fingerpad.experiments.runner import Runner
from fingerpad.experiments.tissue_sets import TissueLayer, tissue_layers
from fingerpad.inference.fitting.methods import Method
from fingerpad.inference.start_points import response_surface
from fingerpad.neuron.afferent import Afferent
from fingerpad.skin.sampling import SkinResponse

STANDARD_SPHERE = (sphere_discrimination.POSITIONS_MM[0], sphere_discrimination.CURVATURES[0])


@dataclass(frozen=True)
class Reproduction:
    """A run of all parts of the paper.

    Parameters
    ----------
    conditions : Conditions
        Finger, tissues, accuracy and seed.
    folder : Path
        Where finished indentations are stored.
    jobs : int or Engine
        Processes, or the engine that solves the indentations; the numbers do not depend on it.
    extended : bool, optional
        Whether to go beyond the paper: uncertainty of the fit, and curvature thresholds at other standards.
        By default not at "quick" resolution, where this takes half as long again.
    """

    conditions: Conditions
    folder: Path
    jobs: int | Engine = 1
    extended: bool | None = None

    def __post_init__(self) -> None:
        engine_of(self.jobs)

    @property
    def goes_beyond(self) -> bool:
        """Whether this run goes beyond the paper."""
        return self.conditions.resolution != "quick" if self.extended is None else self.extended


@result_class
class PublishedNumber:
    """A published number on which the results rest, as `fingerpad.data.all_published` lists it.

    Parameters
    ----------
    name : str
        What it is.
    value : float or tuple of float
        In `unit`.
    unit : str
        "1" for pure numbers.
    source : str
        Where it was published.
    status : {"paper", "read", "recalled", "assumed"}
        How far it can be trusted; see `fingerpad.data.STATUSES`.
    """

    name: str
    value: float | tuple[float, ...]
    unit: str
    source: str
    status: str


@result_class
class ReproductionResult:
    """Result of a reproduction, the content of `results.json`.

    Parameters
    ----------
    format, format_version : str, int
        Of the file.
    summary : Summary
        A few plain numbers.
    mesh, levels : MeshPicture, ThreeLevels
        The mesh under the standard sphere, and that indentation on all levels.
    skin_deflection, skin_force : SkinDeflectionResult, SkinForce
        Level 1: the paper's three trials, and the tissues of the run.
    single_unit : SingleUnitResult
        Level 2.
    discrimination, population, nail : SphereDiscrimination, PopulationMaps, NailBorder
        Level 3.
    single_unit_uncertainty, curvature_thresholds : UncertaintyResult, CurvatureThresholds, optional
        What goes beyond the paper, None where it was not asked for.
    comparison : tuple of ClaimRow
        The paper's numbers beside ours.
    tissues : tuple of TissueLayer
        Every named set of tissues, those of the run and of the trials among them.
    inputs : tuple of PublishedNumber
        Published numbers on which all of it rests.
    manifest : Manifest
        What ran.
    """

    format: Literal["fingerpad reproduction"] = "fingerpad reproduction"
    format_version: Literal[4] = 4
    summary: Summary
    mesh: MeshPicture
    levels: ThreeLevels
    skin_deflection: SkinDeflectionResult
    skin_force: SkinForce
    single_unit: SingleUnitResult
    discrimination: SphereDiscrimination
    population: PopulationMaps
    nail: NailBorder
    single_unit_uncertainty: UncertaintyResult | None = None
    curvature_thresholds: CurvatureThresholds | None = None
    comparison: tuple[ClaimRow, ...]
    tissues: tuple[TissueLayer, ...]
    inputs: tuple[PublishedNumber, ...]
    manifest: Manifest


def reproduce(run: Reproduction, progress: Progress | None = None) -> ReproductionResult:
    """Run the three validations and compare them with the paper.

    Parameters
    ----------
    run : Reproduction
        What to run and where to keep finished indentations.
    progress : Progress, optional
        Shows each finished part.

    Returns
    -------
    ReproductionResult
        All but the times, dates and memory of `manifest` depend on the conditions only.

    Raises
    ------
    ConvergenceError
        If an indentation cannot be solved; finished ones stay stored.
    StoreError
        If a stored indentation is damaged or the folder cannot be written.
    """
    runner, conditions = Runner(run.folder, run.jobs, progress), run.conditions

    spheres = sphere_discrimination.discrimination_touches(conditions)
    wanted: dict[str, Mapping[Any, Touch]] = {
        # The longest indentations first: short ones fill the end, and hardly a core waits for another.
        "nail": {"nail": nail_border.nail_touch(conditions)},
        "skin deflection": skin_deflection.deflection_touches(conditions),
        "force": skin_force.force_touches(conditions),
        "bar, 36 shifts": dict(enumerate(single_unit.bar_touches(conditions))),
        "spheres": spheres,
    }
    if run.goes_beyond:
        wanted["spheres, other curvatures"] = curvature_thresholds.threshold_touches(conditions)
    responses = runner.responses(wanted)
    deflection, bar_responses = responses["skin deflection"], responses["bar, 36 shifts"]
    sphere_responses, nail_response = responses["spheres"], responses["nail"]["nail"]

    with runner.stage("fit and discrimination", 3) as advance:
        quantity = conditions.quantity
        bar_sed = single_unit.receptor_sed(list(bar_responses.values()), quantity, quantity)
        problem = single_unit.rate_problem(bar_sed)
        method = _method(conditions, sphere_responses)
        best, folds = single_unit.fit(problem, method=method)
        advance()
        afferent = Afferent.from_parameters(
            best.parameters, dynamic_quantity=quantity, static_quantity=quantity
        )
        discrimination = sphere_discrimination.discriminate_spheres(
            sphere_responses, afferent, conditions.seed
        )
        advance()
        unit = single_unit.single_unit_result(problem, best, folds, afferent, method.name)
        standard = sphere_responses[STANDARD_SPHERE]
        population = response_maps.population_maps(standard, afferent)
        levels = three_levels.three_levels(standard, afferent)
        nail = nail_border.nail_border(nail_response)
        advance()
    uncertainty: UncertaintyResult | None = None
    thresholds: CurvatureThresholds | None = None
    if run.goes_beyond:
        with runner.stage("beyond the paper", 2) as advance:
            uncertainty = single_unit_uncertainty.uncertainty_result(
                bar_sed, best.parameters, conditions.seed
            )
            advance()
            centred = {
                curvature: skin for (position, curvature), skin in sphere_responses.items() if position == 0.0
            }
            thresholds = curvature_thresholds.curvature_thresholds(
                centred | responses["spheres, other curvatures"],
                afferent,
                discrimination.noise_sigma,
                conditions.seed,
            )
            advance()
    meshes = {"sphere": spheres[STANDARD_SPHERE].mesh, "bar": bar_responses[0].mesh} | {
        name: deflection["trial3", name].mesh for name in skin_deflection.INDENTERS
    }
    skin = skin_deflection.deflection_result(deflection)
    force = skin_force.skin_force(responses["force"])
    manifest = runner.manifest(conditions, meshes, half_model=not spheres[STANDARD_SPHERE].grading.full)
    return ReproductionResult(
        summary=summary(force, unit, afferent, discrimination, thresholds, manifest),
        mesh=mesh_picture.mesh_picture(standard.mesh, RECEPTOR_X_MM),
        levels=levels,
        skin_deflection=skin,
        skin_force=force,
        single_unit=unit,
        discrimination=discrimination,
        population=population,
        nail=nail,
        single_unit_uncertainty=uncertainty,
        curvature_thresholds=thresholds,
        comparison=tuple(comparison(manifest.materials, skin, force, unit, discrimination, nail, thresholds)),
        tissues=tissue_layers(),
        inputs=tuple(PublishedNumber(**asdict(number)) for number in all_published()),
        manifest=manifest,
    )


def _method(conditions: Conditions, spheres: dict[tuple[float, float], SkinResponse]) -> Method:
    """Return the paper's method for a drive by SED; another drive is fitted to hit rates as well."""
    if conditions.quantity == STORED_ENERGY:
        return response_surface()
    return sphere_discrimination.to_rates_and_hit_rates(spheres, conditions.quantity)
