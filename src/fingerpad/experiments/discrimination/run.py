"""Run of a discrimination task: solve the indentations, compute responses, analyse, record."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass, fields, is_dataclass
from functools import cached_property
from pathlib import Path
from typing import Literal

from fingerpad.core.checked import result_class
from fingerpad.core.engine import Engine, engine_of
from fingerpad.core.progress import Progress
from fingerpad.core.values import AnyPath
from fingerpad.experiments.conditions import Conditions
from fingerpad.experiments.descriptions.reading import Origin, at
from fingerpad.experiments.descriptions.stimuli import touches_of
from fingerpad.experiments.discrimination.analysis import PreparedTask, TaskResult, analyse
from fingerpad.experiments.discrimination.task import DiscriminationTask
from fingerpad.experiments.discrimination.task_stimuli import task_conditions, task_population, task_stimuli
from fingerpad.experiments.manifest import Manifest
from fingerpad.experiments.runner import Runner
from fingerpad.neuron.population import Population
from fingerpad.skin.indentation import Touch


@result_class
class DiscriminationFile:
    """The file `discriminate.json`."""

    format: Literal["fingerpad discrimination"] = "fingerpad discrimination"
    format_version: Literal[2] = 2
    discrimination: TaskResult
    task: DiscriminationTask  # What was asked, defaults included.
    afferent: dict[str, float | str]  # By name; in a mixed population with the type, "RA.threshold".
    manifest: Manifest


@dataclass(frozen=True)
class DiscriminationRun:
    """A task with all that it takes to run it."""

    task: DiscriminationTask  # From `task_stimuli.read_task`.
    folder: AnyPath
    jobs: int | Engine = 1  # Processes or engine that press; the numbers do not depend on it.
    source: str = "task"  # File of the task: beside it files are searched; errors begin with it.
    text: str = ""  # Its content, for the lines of errors.
    population: Population | None = None  # In the place of those of the task.

    def __post_init__(self) -> None:
        engine_of(self.jobs)
        with Origin(self.source, self.text).located():
            # Built here, so that an error comes before anything is solved.
            self.prepared, self.touches  # noqa: B018

    @cached_property
    def prepared(self) -> PreparedTask:
        beside = Path(self.source).parent
        population = self.population or task_population(self.task, beside, self.conditions.finger)
        return PreparedTask(self.task, task_stimuli(self.task, beside), population)

    @cached_property
    def conditions(self) -> Conditions:
        return task_conditions(self.task, Path(self.source).parent)

    @cached_property
    def touches(self) -> dict[str, Touch]:
        return touches_of(self.prepared.stimuli, self.conditions, self.task.reach_mm)


def discriminate(
    run: DiscriminationRun,
    progress: Progress | None = None,
    command: str | None = None,
    inputs: Mapping[str, str] | None = None,
) -> DiscriminationFile:
    """Indent with all stimuli, compute the responses of the population, and decode them."""
    task, runner = run.task, Runner(run.folder, run.jobs, progress)
    with Origin(run.source, run.text).located(), at("population"):
        # The mesh is needed to tell, so this is left to the run; still it comes before anything is solved.
        next(iter(run.touches.values())).check_sites(run.prepared.population.sites_mm)
        run.prepared.neighbours  # noqa: B018
    skins = runner.responses({"stimuli": run.touches})["stimuli"]
    with runner.stage("discrimination", 1) as advance:
        found = analyse(run.prepared, skins)
        advance()
    meshes = {"stimuli": next(iter(skins.values())).mesh}
    return DiscriminationFile(
        discrimination=found,
        task=task,
        afferent=_parameters(run.prepared.population),
        manifest=runner.manifest(run.conditions, meshes, command=command, inputs=inputs),
    )


def _parameters(population: Population) -> dict[str, float | str]:
    """Parameters of the afferents by name; a function by its own."""
    parts = population.parts.items() or [("", population)]
    found: dict[str, float | str] = {}
    for kind, part in parts:
        names: list[str] = (
            [each.name for each in fields(part.afferent)] if is_dataclass(part.afferent) else []
        )
        for name in names:
            value = getattr(part.afferent, name)
            if value is not None:
                plain = (
                    value
                    if isinstance(value, float | int | str)
                    else getattr(value, "__qualname__", repr(value))
                )
                found[f"{kind}.{name}" if kind else name] = plain
    return found
