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

STORE_FOLDER = "indentations"
"""Folder of finished indentations within the folder of a run."""

Key = TypeVar("Key")


class Runner:
    """What every experiment does around its own arithmetic.

    Parameters
    ----------
    folder : Path
        Folder of the run; finished indentations are stored below it.
    jobs : int or Engine
        Processes, or the engine that solves the indentations; the numbers do not depend on it.
    progress : Progress, optional
        Shown each finished part.

    Examples
    --------
    >>> from pathlib import Path
    >>> from tempfile import TemporaryDirectory
    >>> with TemporaryDirectory() as folder:
    ...     runner = Runner(Path(folder))
    ...     with runner.stage("fit", 1) as advance:
    ...         advance()
    ...     manifest = runner.manifest(Conditions(resolution="quick"))
    >>> [stage.name for stage in manifest.stages], manifest.resolution
    (['fit'], 'quick')
    """

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
        self,
        touches: Iterable[Touch],
        stage: str = "indentations",
        on_failed: OnFailed | None = None,
    ) -> Collection[Path]:
        """Solve and store the touches that are not stored yet.

        Parameters
        ----------
        touches : iterable of Touch
            In the order in which they are started: the longest first keeps all processes busy to the end.
        stage : str, optional
            Name under which this is timed and shown.
        on_failed : callable, optional
            As of `solve_missing`: called with a touch that cannot be solved and its error.

        Returns
        -------
        collection of Path
            Files of those that were solved.

        Raises
        ------
        ConvergenceError, InputError
            Without `on_failed`, if one cannot be solved; those finished before stay stored.
        StoreError
            If the folder cannot be written.
        """
        missing = self.store.missing(touches)
        with self.stage(stage, len(missing)) as advance:
            solve_missing(missing, self._engine, lambda seconds: advance(), on_failed)
        return missing.keys()

    def load(self, name: str, touches: Mapping[Key, Touch]) -> dict[Key, SkinResponse]:
        """Read the indentations of one part of the experiment, all of which are stored.

        Parameters
        ----------
        name : str
            Of the part, for the manifest.
        touches : mapping of key to Touch
            What was pressed.

        Returns
        -------
        dict of key to SkinResponse

        Raises
        ------
        StoreError
            If a stored indentation is missing or damaged.
        """
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
        """Solve what is missing of all groups, then read them group by group.

        Parameters
        ----------
        groups : mapping of str to mapping of key to Touch
            Touches of each part of the experiment, by its name.
        on_failed : callable, optional
            As of `solve`; the responses lack the touches that failed.

        Returns
        -------
        dict of str to dict of key to SkinResponse

        Raises
        ------
        ConvergenceError, StoreError
            As `solve` and `load`.
        """
        solved = self.solve(
            (touch for touches in groups.values() for touch in touches.values()), on_failed=on_failed
        )
        return self.read(groups, solved, complete=on_failed is None)

    def read(
        self, groups: Mapping[str, Mapping[Any, Touch]], solved: Collection[Path] = (), complete: bool = True
    ) -> dict[str, dict[Any, SkinResponse]]:
        """Read the indentations of several groups, and note how many of them this run solved.

        Parameters
        ----------
        groups : mapping of str to mapping of key to Touch
            Touches of each part of the experiment, by its name.
        solved : collection of Path, optional
            Files that `solve` returned.
        complete : bool, optional
            Whether all must be stored; otherwise those that are not are left out.
        """
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
        """Record what ran.

        Parameters
        ----------
        conditions : Conditions
            Tissues, accuracy and seed.
        meshes : mapping of str to Mesh, optional
            By what is pressed.
        half_model : bool, optional
            Whether the finger is cut at its plane of symmetry.
        command : str, optional
            The command line.
        inputs : mapping of str to str, optional
            SHA-256 of the input files, by name.
        """
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
