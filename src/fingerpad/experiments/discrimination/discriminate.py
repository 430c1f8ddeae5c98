"""A question of one's own from file to answer: check, press, let the population answer, read it, say how."""

from __future__ import annotations

import time
from dataclasses import asdict, dataclass
from datetime import UTC, datetime
from functools import cached_property
from pathlib import Path
from typing import Any

from fingerpad.core.checks import whole
from fingerpad.core.errors import InputError
from fingerpad.core.progress import NoProgress, Progress
from fingerpad.experiments.discrimination.judgements import Asked, result
from fingerpad.experiments.discrimination.task import Question
from fingerpad.experiments.discrimination.task_population import population_of
from fingerpad.experiments.discrimination.task_stimuli import presented, touches
from fingerpad.experiments.gerling2014.reproduction import plain
from fingerpad.experiments.manifest import software
from fingerpad.experiments.runner import STORE_FOLDER
from fingerpad.skin.indentation import Touch
from fingerpad.skin.store import Store, solve_missing


@dataclass(frozen=True)
class Discrimination:
    """A question with all that it takes to answer it.

    Parameters
    ----------
    question : Question
        From `studies.question_file.read_question`.
    folder : Path
        Where finished indentations are stored.
    jobs : int
        Processes to use; the numbers do not depend on it.
    source : str
        Where the question was read: files that it names are sought beside it, and errors begin with it.

    Raises
    ------
    InputError
        If something of the question cannot be; nothing has been pressed then.
    """

    question: Question
    folder: Path
    jobs: int = 1
    source: str = "question"

    def __post_init__(self) -> None:
        whole("jobs", self.jobs, at_least=1)
        try:
            # Built once here: what cannot be is said before anything is pressed.
            self.asked, self.touches  # noqa: B018
        except InputError as error:
            raise InputError(f"{self.source}, {error}") from error

    @cached_property
    def asked(self) -> Asked:
        """The question with its stimuli and its population."""
        beside = Path(self.source).parent
        return Asked(self.question, presented(self.question), population_of(self.question, beside))

    @cached_property
    def touches(self) -> dict[str, Touch]:
        """One touch per stimulus, the standard first."""
        return touches(self.question)


def run(task: Discrimination, progress: Progress | None = None, **provenance: Any) -> dict[str, Any]:
    """Press all stimuli, let the population answer, and say what can be told apart.

    Parameters
    ----------
    task : Discrimination
        The question, and where finished presses are stored.
    progress : Progress, optional
        Told about each finished press.
    **provenance
        What else the results shall say of their origin, such as the command and hashes of its files.

    Returns
    -------
    dict
        "discrimination" as `result` returns it, and "manifest" with the question as it was read.

    Raises
    ------
    InputError
        If the population stays silent.
    ConvergenceError
        If a press cannot be solved or no noise meets the observed hit rates; finished presses stay stored.
    StoreError
        If a stored press is damaged or the folder cannot be written.
    """
    progress = progress or NoProgress()
    started, clock = datetime.now(UTC), time.perf_counter()
    store, wanted = Store(task.folder / STORE_FOLDER), list(task.touches.values())
    with progress.stage("indentations", sum(not store.holds(touch) for touch in wanted)) as advance:
        computed = solve_missing(wanted, store, task.jobs, lambda seconds: advance())
    with progress.stage("discrimination", 1) as advance:
        skins = {name: store.load(touch) for name, touch in task.touches.items()}
        found = result(task.asked, skins)
        advance()
    return plain(
        {
            "discrimination": found,
            "manifest": software()
            | {
                "seed": task.question.experiment.seed,
                "resolution": task.question.skin.resolution,
                "materials": task.question.skin.materials,
                "afferent": asdict(task.asked.population.afferent),
                "nodes": len(next(iter(skins.values())).mesh.nodes_mm),
                "indentations": len(wanted),
                "computed": computed,
                "question": task.question.model_dump(mode="json", exclude_unset=True),
                "started": started.isoformat(timespec="seconds"),
                "wall_s": round(time.perf_counter() - clock, 2),
            }
            | provenance,
        }
    )
