"""One run of an experiment: press what is missing, load it, and record in a manifest what was done."""

from __future__ import annotations

import logging
import platform
import resource
import sys
import time
from collections.abc import Callable, Collection, Iterable, Iterator, Mapping
from contextlib import contextmanager
from dataclasses import replace
from datetime import UTC, datetime
from importlib.metadata import version
from pathlib import Path
from typing import Any

import numpy as np

from fingerpad import __version__
from fingerpad.core.checked import result_class
from fingerpad.core.engine import Engine, engine_of
from fingerpad.core.files import path_of
from fingerpad.core.progress import NoProgress, Progress
from fingerpad.core.values import Number
from fingerpad.experiments.conditions import Conditions
from fingerpad.geometry.mesh import Mesh
from fingerpad.geometry.mesh_checks import jacobian_at_gauss, scaled_jacobian
from fingerpad.mechanics.kernels import KERNELS
from fingerpad.skin.caveats import Caveat, worst
from fingerpad.skin.code_hash import code_hash
from fingerpad.skin.indentation import Touch
from fingerpad.skin.sampling import SkinResponse
from fingerpad.skin.store import OnFailed, Store, solve_missing

LOGGER = logging.getLogger(__name__)

STORE_FOLDER = "indentations"  # Folder of finished indentations within the folder of a run.
PACKAGES = ("numpy", "scipy", "numba", "matplotlib")  # Packages on which the numbers of a run depend.

_BYTES_PER_KIB = 1024


@result_class
class MeshSummary:
    """Size and quality of one mesh."""

    nodes: int
    elements: int  #: How many.
    smallest_gauss_jacobian_mm3: Number  #: Smallest determinant of the Jacobian at a Gauss point. [mm³]
    smallest_scaled_jacobian: Number  #: Smallest scaled Jacobian of an element, 1 for a cube.


@result_class
class StageSummary:
    """One stage of a run."""

    name: str  #: What was done.
    wall_s: float  #: Time on the clock. [s]
    indentations: int | None = None
    computed: int | None = None  #: How many indentations the stage read, and how many this run solved.
    largest_force_imbalance: float | None = None
    largest_energy_imbalance: float | None = None
    """Largest relative imbalance of the forces and of the energies of an indentation."""
    linear_solvers: tuple[str, ...] = ()  #: Which solvers served the Newton steps.
    caveats: tuple[Caveat, ...] = ()  #: Where indentations lie farthest outside of what was verified.


@result_class
class Manifest:
    """What ran, so that a run can be repeated and its meshes judged."""

    version: str
    code_hash: str
    python: str
    platform: str  #: The program, the code behind stored indentations, and the machine's system.
    packages: dict[str, str]  #: Versions of the packages on which the numbers depend.
    resolution: str  #: How fine meshes and steps are.
    materials: str  #: Tissues: their name, or how they are written in Python.
    seed: int  #: Seed of all random numbers.
    started: str  #: Date and time, UTC.
    wall_s: float
    peak_memory_mb: float  #: Time on the clock and largest resident memory of a process. [s], [MB]
    stages: tuple[StageSummary, ...]  #: In the order of the run.
    meshes: dict[str, MeshSummary]  #: By what is pressed.
    half_model: bool | None = None  #: Whether the finger is cut at its plane of symmetry.
    command: str | None = None  #: The command line.
    inputs: dict[str, str]  #: SHA-256 of the input files, by name.

    @property
    def caveats(self) -> tuple[Caveat, ...]:
        """Where the results lie farthest outside of what was verified."""
        return worst(each for stage in self.stages for each in stage.caveats)


def software() -> dict[str, Any]:
    """Fields of a `Manifest` that name the program and the system."""
    return {
        "version": __version__,
        "code_hash": code_hash(),
        "python": platform.python_version(),
        "platform": platform.platform(),
        "packages": {name: version(name) for name in PACKAGES},
    }


def mesh_summary(mesh: Mesh) -> MeshSummary:
    """Count and judge a mesh."""
    return MeshSummary(
        nodes=len(mesh.nodes_mm),
        elements=len(mesh.elements),
        smallest_gauss_jacobian_mm3=float(jacobian_at_gauss(mesh).min()),
        smallest_scaled_jacobian=float(np.nanmin(scaled_jacobian(mesh))),
    )


def peak_memory_mb() -> float:
    """Largest resident memory of this process or of one of its workers. [MB]"""
    unit = 1 if sys.platform == "darwin" else _BYTES_PER_KIB
    peak = max(resource.getrusage(who).ru_maxrss for who in (resource.RUSAGE_SELF, resource.RUSAGE_CHILDREN))
    return round(peak * unit / 1e6, 1)


class Runner:
    """What every experiment does around its own arithmetic."""

    def __init__(
        self,
        folder: Path,
        jobs: int | Engine = 1,
        progress: Progress | None = None,
        command: str | None = None,
    ):
        self.folder, self.command = path_of("folder", folder), command
        self._engine = engine_of(jobs, KERNELS)
        self.jobs = jobs if isinstance(jobs, int) else 1
        self.progress = progress or NoProgress()
        self.store = Store(self.folder / STORE_FOLDER)
        self._stages: list[StageSummary] = []
        self._started, self._clock = datetime.now(UTC), time.perf_counter()

    @contextmanager
    def stage(self, name: str, total: int) -> Iterator[Callable[[], None]]:
        """Time one stage of `total` parts, and show how far it is."""
        started = time.perf_counter()
        with self.progress.stage(name, total) as advance:
            yield advance
        wall_s = round(time.perf_counter() - started, 2)
        LOGGER.info("%s took %.2f s", name, wall_s)
        self._stages.append(StageSummary(name=name, wall_s=wall_s))

    def solve(
        self, touches: Iterable[Touch], stage: str = "indentations", on_failed: OnFailed | None = None
    ) -> Collection[Path]:
        """Solve and store the touches that are not stored yet."""
        missing = self.store.missing(touches)
        with self.stage(stage, len(missing)) as advance:
            solve_missing(missing, self._engine, lambda seconds: advance(), on_failed)
        return missing.keys()

    def note(self, skins: Collection[SkinResponse], computed: int | None = None) -> None:
        """Say in the manifest how good the indentations of the last stage are, and how many were solved."""
        self._stages[-1] = replace(
            self._stages[-1],
            indentations=len(skins),
            computed=computed,
            largest_force_imbalance=max((skin.force_imbalance for skin in skins), default=None),
            largest_energy_imbalance=max((skin.energy_imbalance for skin in skins), default=None),
            linear_solvers=tuple(sorted({skin.linear_solver for skin in skins})),
            caveats=worst(each for skin in skins for each in skin.caveats),
        )

    def responses(
        self, groups: Mapping[str, Mapping[Any, Touch]], on_failed: OnFailed | None = None
    ) -> dict[str, dict[Any, SkinResponse]]:
        """Solve what is missing of all groups, then read them group by group."""
        touches = (touch for touches in groups.values() for touch in touches.values())
        solved = self.solve(touches, on_failed=on_failed)
        return self.read(groups, solved, complete=on_failed is None)

    def read(
        self, groups: Mapping[str, Mapping[Any, Touch]], solved: Collection[Path] = (), complete: bool = True
    ) -> dict[str, dict[Any, SkinResponse]]:
        """Read the indentations of several groups, and note how many of them this run solved."""
        responses = {}
        for name, wanted in groups.items():
            touches = {key: touch for key, touch in wanted.items() if complete or self.store.holds(touch)}
            with self.stage(name, 0):
                responses[name] = {key: self.store.load(touch) for key, touch in touches.items()}
            computed = sum(self.store.path(touch) in solved for touch in touches.values())
            self.note(responses[name].values(), computed)
        return responses

    @property
    def stages(self) -> tuple[StageSummary, ...]:
        """Stages so far."""
        return tuple(self._stages)

    def add_stages(self, stages: Iterable[StageSummary]) -> None:
        """Add stages of another process that read from the same folder."""
        self._stages.extend(stages)

    def manifest(
        self,
        conditions: Conditions,
        meshes: Mapping[str, Mesh] | None = None,
        half_model: bool | None = None,
        inputs: Mapping[str, str] | None = None,
    ) -> Manifest:
        """Record what ran."""
        tissues = conditions.tissues
        return Manifest(
            **software(),
            resolution=conditions.resolution,
            materials=tissues if isinstance(tissues, str) else repr(tissues),
            seed=conditions.seed,
            started=self._started.isoformat(timespec="seconds"),
            wall_s=round(time.perf_counter() - self._clock, 2),
            peak_memory_mb=peak_memory_mb(),
            stages=self.stages,
            meshes={name: mesh_summary(mesh) for name, mesh in (meshes or {}).items()},
            half_model=half_model,
            command=self.command,
            inputs=dict(inputs or {}),
        )
