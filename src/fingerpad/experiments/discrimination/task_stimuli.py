"""The stimuli of a discrimination task, the touches that indent with them, and the afferents."""

from __future__ import annotations

from collections.abc import Sequence
from pathlib import Path

from fingerpad.core.errors import InputError
from fingerpad.core.keywords import known_keywords
from fingerpad.experiments.conditions import Conditions
from fingerpad.experiments.descriptions.population import population_of
from fingerpad.experiments.descriptions.stimuli import NamedStimulus, named_stimuli, touches_of
from fingerpad.experiments.discrimination.task import DiscriminationTask
from fingerpad.geometry.fingertip import Finger
from fingerpad.neuron.mixed_population import MixedPopulation
from fingerpad.neuron.population import Population
from fingerpad.skin.indentation import Touch


@known_keywords
def task_stimuli(task: DiscriminationTask, beside: Path = Path()) -> tuple[NamedStimulus, ...]:
    """List the stimuli of a task, the standard first.

    Parameters
    ----------
    task : DiscriminationTask
        From `read_task`.
    beside : Path, optional
        Folder from which files are named.

    Returns
    -------
    tuple of NamedStimulus
        The standard, then the comparisons in the order of the file.

    Raises
    ------
    InputError
        If there are fewer than two, only some have a level, the standard is not among them, or as of
        `named_stimuli`.

    Examples
    --------
    >>> from fingerpad.experiments.discrimination.task_files import read_task
    >>> spheres = task_stimuli(read_task("sphere_curvature"))
    >>> [stimulus.name for stimulus in spheres[:3]], spheres[1].indenter
    (['287', '296', '305'], Sphere(curvature_per_m=296.0))
    """
    found = named_stimuli(task, beside)
    if len(found) < 2:
        raise InputError(f"stimuli must be two or more to be discriminated: got {len(found)}.")
    with_level = [stimulus.level is not None for stimulus in found]
    if any(with_level) and not all(with_level):
        raise InputError(
            f"level must be given for all stimuli or for none: {found[with_level.index(False)].name!r} "
            "has none."
        )
    row = stimulus_index(found, task.standard, "standard")
    return (found[row], *found[:row], *found[row + 1 :])


def stimulus_index(stimuli: Sequence[NamedStimulus], place: float | str, key: str) -> int:
    """Index of the stimulus that a level or a name means, else raise `InputError` that names the key."""
    for row, stimulus in enumerate(stimuli):
        if place == stimulus.name or (stimulus.level is not None and place == stimulus.level):
            return row
    names = ", ".join(stimulus.name for stimulus in stimuli)
    raise InputError(f"{key} must be one of the stimuli, {names}: got {place!r}.")


@known_keywords
def task_population(
    task: DiscriminationTask, beside: Path = Path(), finger: Finger | None = None
) -> Population | MixedPopulation:
    """Lay out the afferents of a task; files that it names are searched in `beside`."""
    finger = task_conditions(task, beside).finger if finger is None else finger
    return population_of(task.population, task.afferent, task.tissues, beside, finger=finger)


def task_conditions(task: DiscriminationTask, beside: Path = Path()) -> Conditions:
    """Finger, tissues, accuracy and seed of a task; the file of a mesh is named from the folder `beside`."""
    return task.conditions(task.experiment.seed, beside)


def task_touches(task: DiscriminationTask, beside: Path = Path()) -> dict[str, Touch]:
    """One touch per stimulus of a task, see `touches_of`; files are named from the folder `beside`."""
    return touches_of(task_stimuli(task, beside), task_conditions(task, beside), task.reach_mm)
