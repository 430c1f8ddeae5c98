"""Run of a discrimination task: solve the indentations, compute responses, analyse, record."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import asdict, dataclass
from functools import cached_property
from pathlib import Path
from typing import Literal

from fingerpad.core.checks import whole
from fingerpad.core.progress import Progress
from fingerpad.core.results import result_class
from fingerpad.experiments.descriptions.reading import Source
from fingerpad.experiments.discrimination.analysis import PreparedTask, TaskResult, analyse
from fingerpad.experiments.discrimination.task import DiscriminationTask
from fingerpad.experiments.discrimination.task_stimuli import (
    task_conditions,
    task_population,
    task_stimuli,
    task_touches,
)
from fingerpad.experiments.manifest import Manifest
from fingerpad.experiments.runner import Runner
from fingerpad.neuron.afferent import as_sai
from fingerpad.skin.indentation import Touch


@result_class
class DiscriminationFile:
    """The file `discriminate.json`.

    Parameters
    ----------
    format, format_version
        By which a reader knows the file.
    discrimination : TaskResult
        What was found.
    task : DiscriminationTask
        What was asked, defaults included.
    afferent : dict of str to float or str
        Parameters of the afferent.
    manifest : Manifest
        What ran.
    """

    format: Literal["fingerpad discrimination"] = "fingerpad discrimination"
    format_version: Literal[2] = 2
    discrimination: TaskResult
    task: DiscriminationTask
    afferent: dict[str, float | str]
    manifest: Manifest


@dataclass(frozen=True)
class DiscriminationRun:
    """A task with all that it takes to run it.

    Parameters
    ----------
    task : DiscriminationTask
        From `task_files.read_task`.
    folder : Path
        Where finished indentations are stored.
    jobs : int
        Processes to use; the numbers do not depend on it.
    source : str
        File of the task: files that it names are searched beside it, and errors begin with it.
    text : str
        Its content, for the lines of errors.

    Raises
    ------
    InputError
        If a part of the task is impossible; this is checked before anything is solved.
    """

    task: DiscriminationTask
    folder: Path
    jobs: int = 1
    source: str = "task"
    text: str = ""

    def __post_init__(self) -> None:
        whole("jobs", self.jobs, at_least=1)
        with Source(self.source, self.text).located():
            # Built here, so that an error comes before anything is solved.
            self.prepared, self.touches  # noqa: B018

    @cached_property
    def prepared(self) -> PreparedTask:
        """The task with its stimuli and its population."""
        beside = Path(self.source).parent
        return PreparedTask(self.task, task_stimuli(self.task, beside), task_population(self.task, beside))

    @cached_property
    def touches(self) -> dict[str, Touch]:
        """One touch per stimulus, the standard first."""
        return task_touches(self.task, Path(self.source).parent)


def discriminate(
    run: DiscriminationRun,
    progress: Progress | None = None,
    command: str | None = None,
    inputs: Mapping[str, str] | None = None,
) -> DiscriminationFile:
    """Indent with all stimuli, compute the responses of the population, and decode them.

    Parameters
    ----------
    run : DiscriminationRun
        The task, and where finished indentations are stored.
    progress : Progress, optional
        Shown each finished indentation.
    command : str, optional
        The command line, for the manifest.
    inputs : mapping of str to str, optional
        SHA-256 of the files of the task, by name.

    Returns
    -------
    DiscriminationFile

    Raises
    ------
    InputError
        If the population is silent.
    ConvergenceError
        If an indentation cannot be solved or no noise gives the observed hit rates; finished indentations
        stay stored.
    StoreError
        If a stored indentation is damaged or the folder cannot be written.
    """
    task, runner = run.task, Runner(run.folder, run.jobs, progress)
    skins = runner.responses({"stimuli": run.touches})["stimuli"]
    with runner.stage("discrimination", 1) as advance:
        found = analyse(run.prepared, skins)
        advance()
    meshes = {"stimuli": next(iter(skins.values())).mesh}
    return DiscriminationFile(
        discrimination=found,
        task=task,
        afferent=asdict(as_sai(run.prepared.population.afferent)),
        manifest=runner.manifest(task_conditions(task), meshes, command=command, inputs=inputs),
    )
