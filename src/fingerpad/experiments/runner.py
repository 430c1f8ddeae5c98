"""One run of an experiment: solve the indentations that are missing, load them, and record what was done."""

from __future__ import annotations

import logging
import time
from collections.abc import Callable, Collection, Iterable, Iterator, Mapping
from contextlib import contextmanager
from dataclasses import replace
from datetime import UTC, datetime
from pathlib import Path
from typing import Any, TypeVar

from fingerpad.core.engine import Engine, engine_of
from fingerpad.core.files import path_of
from fingerpad.core.progress import NoProgress, Progress
from fingerpad.experiments.conditions import Conditions
from fingerpad.experiments.manifest import Manifest, StageSummary, mesh_summary, peak_memory_mb, software
from fingerpad.geometry.mesh import Mesh
from fingerpad.mechanics.kernels import KERNELS
from fingerpad.skin.indentation import Touch
from fingerpad.skin.sampling import SkinResponse
from fingerpad.skin.store import OnFailed, Store, solve_missing

LOGGER = logging.getLogger(__name__)

STORE_FOLDER = "indentations"  # Folder of finished indentations within the folder of a run.

Key = TypeVar("Key")


class Runner:
    """What every experiment does around its own arithmetic."""

    def __init__(self, folder: Path, jobs: int | Engine = 1, progress: Progress | None = None):
        self.folder = path_of("folder", folder)
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

    def load(self, name: str, touches: Mapping[Key, Touch]) -> dict[Key, SkinResponse]:
        """Read the indentations of one part of the experiment, all of which are stored."""
        with self.stage(name, 0):
            responses = {key: self.store.load(touch) for key, touch in touches.items()}
        self.note(responses.values())
        return responses

    def note(self, skins: Collection[SkinResponse]) -> None:
        """Say in the manifest how good the indentations of the last stage are."""
        self._stages[-1] = replace(
            self._stages[-1],
            indentations=len(skins),
            largest_force_imbalance=max((skin.force_imbalance for skin in skins), default=None),
            largest_energy_imbalance=max((skin.energy_imbalance for skin in skins), default=None),
            linear_solvers=tuple(sorted({skin.linear_solver for skin in skins})),
            caveats=tuple(dict.fromkeys(caveat.text for skin in skins for caveat in skin.caveats)),
        )

    def responses(
        self, groups: Mapping[str, Mapping[Any, Touch]], on_failed: OnFailed | None = None
    ) -> dict[str, dict[Any, SkinResponse]]:
        """Solve what is missing of all groups, then read them group by group."""
        solved = self.solve(
            (touch for touches in groups.values() for touch in touches.values()), on_failed=on_failed
        )
        return self.read(groups, solved, complete=on_failed is None)

    def read(
        self, groups: Mapping[str, Mapping[Any, Touch]], solved: Collection[Path] = (), complete: bool = True
    ) -> dict[str, dict[Any, SkinResponse]]:
        """Read the indentations of several groups, and note how many of them this run solved."""
        responses = {}
        for name, wanted in groups.items():
            touches = {key: touch for key, touch in wanted.items() if complete or self.store.holds(touch)}
            responses[name] = self.load(name, touches)
            computed = sum(self.store.path(touch) in solved for touch in touches.values())
            self._stages[-1] = replace(self._stages[-1], computed=computed)
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
        command: str | None = None,
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
            stages=tuple(self._stages),
            meshes={name: mesh_summary(mesh) for name, mesh in (meshes or {}).items()},
            half_model=half_model,
            command=command,
            inputs=dict(inputs or {}),
        )
