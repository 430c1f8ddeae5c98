"""The whole paper in one run: press, fire, fit, discriminate, compare."""

from __future__ import annotations

import math
import platform
import resource
import sys
import time
from collections.abc import Callable, Iterator, Mapping
from contextlib import AbstractContextManager, contextmanager
from dataclasses import asdict, dataclass
from datetime import UTC, datetime
from importlib.metadata import version
from pathlib import Path
from typing import Any, Protocol, TypeVar

import numpy as np

from fingerpad import __version__
from fingerpad.core.checks import whole
from fingerpad.data import all_published, protocol
from fingerpad.experiments.conditions import Conditions, Touch
from fingerpad.experiments.gerling2014 import (
    curvature_thresholds,
    drive_quantities,
    mesh_noise,
    nail_border,
    response_maps,
    single_unit,
    single_unit_methods,
    single_unit_starts,
    single_unit_uncertainty,
    skin_deflection,
    sphere_discrimination,
    spike_fit,
)
from fingerpad.experiments.gerling2014.comparison import comparison
from fingerpad.geometry.mesh_quality import jacobian_at_gauss, scaled_jacobian
from fingerpad.neuron.afferent import Afferent
from fingerpad.skin.sampling import SkinResponse
from fingerpad.skin.store import Store, code_hash, solve_missing

STORE_FOLDER = "indentations"
PACKAGES = ("numpy", "scipy", "numba", "matplotlib", "pypardiso")
STANDARD_SPHERE = (sphere_discrimination.POSITIONS_MM[0], sphere_discrimination.CURVATURES[0])
BYTES_PER_KIB = 1024

Key = TypeVar("Key")


class Progress(Protocol):
    """Tells somebody how far a reproduction is."""

    def stage(self, name: str, total: int) -> AbstractContextManager[Callable[[], None]]:
        """Open a stage of `total` parts; call the result once per finished part."""
        ...


class NoProgress:
    """Tells nobody."""

    @contextmanager
    def stage(self, name: str, total: int) -> Iterator[Callable[[], None]]:
        """Open a stage that is not shown."""
        yield lambda: None


@dataclass(frozen=True)
class Reproduction:
    """A run of all studies.

    Parameters
    ----------
    conditions : Conditions
        Finger, tissues, accuracy and seed.
    folder : Path
        Where finished indentations are stored.
    jobs : int
        Processes to use; the numbers do not depend on it.
    extended : bool, optional
        Whether to go beyond the paper: other ways to fit, what else may drive the afferent, spike trains,
        what the rates determine, when a population fires, two spheres on other meshes, and the curvatures
        that are told apart at other standards. Default: unless
        the resolution is "quick", which would take half as long again.
    """

    conditions: Conditions
    folder: Path
    jobs: int = 1
    extended: bool | None = None

    def __post_init__(self) -> None:
        whole("jobs", self.jobs, at_least=1)

    @property
    def goes_beyond(self) -> bool:
        """Whether this run goes beyond the paper."""
        return self.conditions.resolution != "quick" if self.extended is None else self.extended


def reproduce(run: Reproduction, progress: Progress | None = None) -> dict[str, Any]:
    """Run the three validations and compare them with the paper.

    Parameters
    ----------
    run : Reproduction
        What to run and where to keep finished indentations.
    progress : Progress, optional
        Told about each finished part.

    Returns
    -------
    dict
        Numbers, strings and lists only, as written to results.json. All but the times, dates and memory of
        `manifest` depend on nothing but the conditions.

    Raises
    ------
    ConvergenceError
        If an indentation cannot be solved; finished ones stay stored.
    StoreError
        If a stored indentation is damaged or the folder cannot be written.
    """
    progress = progress or NoProgress()
    started, clock = datetime.now(UTC), time.perf_counter()
    store, conditions = Store(run.folder / STORE_FOLDER), run.conditions
    stages: list[dict[str, Any]] = []

    spheres = sphere_discrimination.touches(conditions)
    wanted: dict[str, Mapping[Any, Touch]] = {
        # The longest indentations first: short ones fill the end, and hardly a core waits for another.
        "nail": {"nail": nail_border.touch(conditions)},
        "skin deflection": skin_deflection.touches(conditions),
        "bar, 36 shifts": dict(enumerate(single_unit.touches(conditions))),
        "spheres": spheres,
    }
    if run.goes_beyond:
        wanted["spheres, other meshes"] = mesh_noise.touches(conditions)
        wanted["spheres, other curvatures"] = curvature_thresholds.touches(conditions)
    missing = {
        name: sum(not store.holds(touch) for touch in touches.values()) for name, touches in wanted.items()
    }
    with _timed("indentations", sum(missing.values()), progress, stages) as advance:
        everything = [touch for touches in wanted.values() for touch in touches.values()]
        solve_missing(everything, store, run.jobs, lambda seconds: advance())
    responses = {name: _loaded(name, touches, store, stages) for name, touches in wanted.items()}
    for stage in stages[1:]:
        stage["computed"] = missing[stage["name"]]
    deflection, bar_responses = responses["skin deflection"], responses["bar, 36 shifts"]
    sphere_responses, nail_response = responses["spheres"], responses["nail"]["nail"]

    with _timed("fit and discrimination", 3, progress, stages) as advance:
        bars = list(bar_responses.values())
        bar_sed = single_unit.receptor_sed(bars)
        problem = single_unit.rate_problem(bar_sed)
        best, folds = single_unit.fit(problem)
        advance()
        afferent = Afferent.from_parameters(best.parameters)
        discrimination = sphere_discrimination.result(sphere_responses, afferent, conditions.seed)
        advance()
        results: dict[str, Any] = {
            "skin_deflection": skin_deflection.result(deflection),
            "single_unit": single_unit.result(problem, best, folds),
            "discrimination": discrimination,
            "population": response_maps.result(sphere_responses[STANDARD_SPHERE], afferent),
            "nail": nail_border.result(nail_response),
        }
        advance()
    if run.goes_beyond:
        with _timed("beyond the paper", 8, progress, stages) as advance:
            traces = drive_quantities.receptor_traces(bars, drive_quantities.SHOWN_QUANTITIES)
            results["single_unit"]["starts"] = single_unit_starts.result(problem, traces["von_mises"])
            advance()
            results["single_unit"]["methods"] = single_unit_methods.result(
                single_unit_methods.traces_beside(bars),
                drive_quantities.traces_of(traces, drive_quantities.EXTENDED),
                problem.recordings,
                (best, folds),
            )
            advance()
            results["mesh_noise"] = mesh_noise.result(
                responses["spheres, other meshes"], sphere_responses, afferent
            )
            advance()
            results["drive_quantities"] = drive_quantities.result(
                traces, problem.recordings, np.random.default_rng(conditions.seed)
            )
            advance()
            shift_mm = np.array(protocol.BAR_SHIFTS.value)
            results["spike_fit"] = spike_fit.result(bar_sed, afferent, shift_mm, conditions.seed)
            advance()
            results["single_unit_uncertainty"] = single_unit_uncertainty.result(
                bar_sed, best.parameters, conditions.seed
            )
            advance()
            centred = {
                curvature: skin for (position, curvature), skin in sphere_responses.items() if position == 0.0
            }
            results["curvature_thresholds"] = curvature_thresholds.result(
                centred | responses["spheres, other curvatures"],
                afferent,
                discrimination["noise_sigma"],
                conditions.seed,
            )
            advance()
            results["population_timing"] = response_maps.timing(sphere_responses, afferent, conditions.finger)
            advance()
    results["comparison"] = comparison(results)
    results["inputs"] = [asdict(number) for number in all_published()]
    results["manifest"] = _manifest(conditions, spheres[STANDARD_SPHERE], deflection, bar_responses) | {
        "started": started.isoformat(timespec="seconds"),
        "wall_s": round(time.perf_counter() - clock, 2),
        "peak_memory_mb": _peak_memory_mb(),
        "stages": stages,
    }
    return plain(results)


def _loaded(
    name: str, touches: Mapping[Key, Touch], store: Store, stages: list[dict[str, Any]]
) -> dict[Key, SkinResponse]:
    """Read the indentations of one study, all of which are there."""
    with _timed(name, 0, NoProgress(), stages):
        responses = {key: store.load(touch) for key, touch in touches.items()}
    stages[-1] |= {
        "indentations": len(touches),
        # Whether forces and energies of every press add up, at their worst.
        "largest_force_imbalance": max(skin.force_imbalance for skin in responses.values()),
        "largest_energy_imbalance": max(skin.energy_imbalance for skin in responses.values()),
        "linear_solvers": sorted({skin.linear_solver for skin in responses.values()}),
    }
    return responses


@contextmanager
def _timed(
    name: str, total: int, progress: Progress, stages: list[dict[str, Any]]
) -> Iterator[Callable[[], None]]:
    started = time.perf_counter()
    stages.append({"name": name, "wall_s": 0.0})
    with progress.stage(name, total) as advance:
        yield advance
    stages[-1]["wall_s"] = round(time.perf_counter() - started, 2)


def _manifest(
    conditions: Conditions,
    standard: Touch,
    deflection: Mapping[Any, SkinResponse],
    bars: Mapping[int, SkinResponse],
) -> dict[str, Any]:
    """Say what ran, so that the run can be repeated and its meshes judged."""
    meshes = {"sphere": standard.mesh, "bar": bars[0].mesh}
    meshes |= {name: deflection["trial3", name].mesh for name in skin_deflection.INDENTERS}
    return software() | {
        "seed": conditions.seed,
        "resolution": conditions.resolution,
        "materials": conditions.materials,
        "nodes": len(standard.mesh.nodes_mm),
        "elements": len(standard.mesh.elements),
        "meshes": {
            name: {
                "nodes": len(mesh.nodes_mm),
                "elements": len(mesh.elements),
                "smallest_gauss_jacobian_mm3": float(jacobian_at_gauss(mesh).min()),
                "smallest_scaled_jacobian": float(np.nanmin(scaled_jacobian(mesh))),
            }
            for name, mesh in meshes.items()
        },
        "half_model": not standard.grading.full,
    }


def software() -> dict[str, Any]:
    """Say what program runs, on what."""
    return {
        "version": __version__,
        "code_hash": code_hash(),
        "python": platform.python_version(),
        "platform": platform.platform(),
        "packages": {name: version(name) for name in PACKAGES if _installed(name)},
    }


def _installed(package: str) -> bool:
    try:
        version(package)
    except ModuleNotFoundError:  # importlib.metadata.PackageNotFoundError is one
        return False
    return True


def _peak_memory_mb() -> float:
    """Largest resident memory of this process or of one of its workers. [MB]"""
    unit = 1 if sys.platform == "darwin" else BYTES_PER_KIB
    peak = max(resource.getrusage(who).ru_maxrss for who in (resource.RUSAGE_SELF, resource.RUSAGE_CHILDREN))
    return round(peak * unit / 1e6, 1)


def plain(value: Any) -> Any:
    """Nested dicts and lists of plain numbers, with None for what is not a finite number.

    Examples
    --------
    >>> plain({"rate": np.array([1.0, np.nan]), "n": np.int64(3)})
    {'rate': [1.0, None], 'n': 3}
    """
    if isinstance(value, Mapping):
        return {str(key): plain(item) for key, item in value.items()}
    if isinstance(value, np.ndarray):
        return plain(value.tolist())
    if isinstance(value, list | tuple):
        return [plain(item) for item in value]
    if isinstance(value, np.generic):
        return plain(value.item())
    if isinstance(value, float) and not math.isfinite(value):
        return None
    return value
