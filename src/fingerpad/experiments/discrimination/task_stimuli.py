"""The stimuli of a discrimination task, the touches that indent with them, and the afferents."""

from __future__ import annotations

from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass, field, replace
from pathlib import Path
from typing import Any

from fingerpad.core.errors import InputError
from fingerpad.core.keywords import closest
from fingerpad.data import protocol
from fingerpad.experiments.conditions import Conditions
from fingerpad.experiments.descriptions.population import afferent_of, population_of
from fingerpad.experiments.descriptions.pressing import RAMP_AND_HOLD, finger_of
from fingerpad.experiments.descriptions.reading import (
    Place,
    PlacedError,
    at,
    merged,
    moved,
    part_from,
    spelled,
)
from fingerpad.experiments.descriptions.stimulus import (
    PlaceSettings,
    StimulusDescription,
    TactileStimulus,
    about,
)
from fingerpad.experiments.discrimination.task import DiscriminationTask, StimulusBlocks, VariedStimuli
from fingerpad.geometry.fingertip import Fingertip
from fingerpad.geometry.grading import Grading, covering
from fingerpad.geometry.indenter_grading import grading_along
from fingerpad.geometry.indenters import Sphere
from fingerpad.geometry.motion import MOTION_UNITS
from fingerpad.geometry.names import SIZE_UNITS
from fingerpad.neuron.population import Population
from fingerpad.skin.indentation import Touch

_NEAR_MM = max(protocol.SPHERE_POSITIONS.value)
"""The mesh of the paper's spheres serves places as far as this from the middle. [mm]"""

_EXCLUSIVE = {"depth_mm": "force_mn", "force_mn": "depth_mm"}


@dataclass(frozen=True, kw_only=True)
class TaskStimulus(TactileStimulus):
    """One stimulus of a task.

    Parameters
    ----------
    name : str
        How it is called.
    level : float or None
        Where it stands on the axis of the psychometric curve.
    files : tuple of Path
        Those that its object and motion name.
    in_file : callable
        From a place in its description to that in the file of the task, and the words for it.
    """

    name: str
    level: float | None
    files: tuple[Path, ...] = field(default=(), compare=False)
    in_file: Callable[[Place], tuple[Place, str]] = field(compare=False, repr=False)


def task_stimuli(task: DiscriminationTask, beside: Path = Path()) -> tuple[TaskStimulus, ...]:
    """List the stimuli of a task, the standard first.

    Parameters
    ----------
    task : DiscriminationTask
        From `read_task`.
    beside : Path, optional
        Folder from which files are named.

    Returns
    -------
    tuple of TaskStimulus
        The standard, then the comparisons in the order of the file.

    Raises
    ------
    InputError
        If there are fewer than two, two have one name or level, the standard is not among them, or one
        cannot be: no object, a size that it does not have, depth and force at once.

    Examples
    --------
    >>> from fingerpad.experiments.discrimination.task_files import read_task
    >>> spheres = task_stimuli(read_task("sphere_curvature"))
    >>> [stimulus.name for stimulus in spheres[:3]], spheres[1].indenter
    (['287', '296', '305'], Sphere(curvature_per_m=296.0))
    """
    found = [_presented(task, *each, beside) for each in _blocks(task)]
    if len(found) < 2:
        raise InputError(f"stimuli must be two or more to be discriminated: got {len(found)}.")
    for number, stimulus in enumerate(found):
        if stimulus.name in [other.name for other in found[:number]]:
            raise InputError(f"stimuli must differ: {stimulus.name!r} is repeated, keep one.")
    with_level = [stimulus.level is not None for stimulus in found]
    if any(with_level) and not all(with_level):
        raise InputError(
            f"level must be given for all stimuli or for none: {found[with_level.index(False)].name!r} "
            "has none."
        )
    row = stimulus_index(found, task.standard, "standard")
    return (found[row], *found[:row], *found[row + 1 :])


def stimulus_index(stimuli: Sequence[TaskStimulus], place: float | str, key: str) -> int:
    """Index of the stimulus that a level or a name means, else raise `InputError` that names the key."""
    for row, stimulus in enumerate(stimuli):
        if place == stimulus.name or (stimulus.level is not None and place == stimulus.level):
            return row
    names = ", ".join(stimulus.name for stimulus in stimuli)
    raise InputError(f"{key} must be one of the stimuli, {names}: got {place!r}.")


def _blocks(task: DiscriminationTask) -> list[tuple[Place, str, float | None, dict[str, Any]]]:
    """Place in the file, name, level and own blocks of each stimulus."""
    if not isinstance(task.stimuli, VariedStimuli):
        return [
            (("stimuli", row), own.name, own.level, own.chosen(*StimulusBlocks.model_fields))
            for row, own in enumerate(task.stimuli)
        ]
    block, dot, key = task.stimuli.vary.partition(".")
    if block not in StimulusBlocks.model_fields or bool(dot) == (block == "friction"):
        known = [f"object.{size}" for size in SIZE_UNITS] + [f"motion.{number}" for number in MOTION_UNITS]
        near = closest(task.stimuli.vary, [*known, *(f"place.{name}" for name in PlaceSettings.model_fields)])
        raise PlacedError(
            "stimuli.vary must be friction, or a key of object, motion or place such as "
            f"{near or 'object.radius_mm'}: got {task.stimuli.vary!r}.",
            ("stimuli", "vary"),
        )
    common = getattr(task, block)
    if common is not None and (not dot or (isinstance(common, Mapping) and key in common)):
        raise PlacedError(
            f"{task.stimuli.vary} must not be given where stimuli.vary it: leave it out.", (block, key)
        )
    return [
        (
            ("stimuli", "values", row),
            value if isinstance(value, str) else f"{value:g}",
            None if isinstance(value, str) else value,
            {block: {key: value} if dot else value},
        )
        for row, value in enumerate(task.stimuli.values)
    ]


def _presented(
    task: DiscriminationTask,
    listed: Place,
    name: str,
    level: float | None,
    own: Mapping[str, Any],
    beside: Path,
) -> TaskStimulus:
    """Build one stimulus from the blocks that all have and its own."""

    def in_file(path: Place) -> tuple[Place, str]:
        block = own.get(str(path[0])) if path else own
        if block is None or (len(path) > 1 and isinstance(block, Mapping) and path[1] not in block):
            return path, spelled(path)  # of what all have
        if listed[1] == "values":
            return listed, f"{spelled(listed)}, {spelled(path)}"
        return (*listed, *path), spelled((*listed, *path))

    hidden = {_EXCLUSIVE.get(key) for key in own.get("motion", ())}
    motion = {key: value for key, value in (task.motion or {}).items() if key not in hidden}
    given = {
        "object": merged(task.object, own.get("object")),
        "motion": merged(motion, own.get("motion"), RAMP_AND_HOLD),
        "place": merged(task.place, own.get("place")),
        "friction": merged(task.friction, own.get("friction")),
    }
    with moved(in_file):
        described = part_from(
            StimulusDescription, {key: block for key, block in given.items() if block is not None}
        )
        return TaskStimulus(
            **vars(described.stimulus(beside)),
            name=name,
            level=level,
            files=tuple(described.files(beside)),
            in_file=in_file,
        )


def task_population(task: DiscriminationTask, beside: Path = Path()) -> Population:
    """Lay out the afferents of a task; a file of results that it names is searched in `beside`."""
    afferent = afferent_of(task.afferent, task.tissues, beside)
    return population_of(task.population, afferent, finger=task_conditions(task).finger)


def task_conditions(task: DiscriminationTask) -> Conditions:
    """Finger, tissues, accuracy and seed of a task."""
    with at("finger"):
        finger = finger_of(task.finger)
        if not isinstance(finger, Fingertip):
            raise InputError("finger must be a preset, measures or an outline in a task: got a mesh.")
        return Conditions(task.resolution, task.experiment.seed, task.tissues, finger)


def task_touches(task: DiscriminationTask, beside: Path = Path()) -> dict[str, Touch]:
    """One touch per stimulus, all on one mesh; those of the paper's spheres are those of a reproduction.

    Parameters
    ----------
    task : DiscriminationTask
        From `read_task`.
    beside : Path, optional
        Folder from which files are named.

    Returns
    -------
    dict of str to Touch
        By name, the standard first.

    Raises
    ------
    InputError
        As `task_stimuli`, or if one cannot be used, with its place.
    """
    stimuli, conditions = task_stimuli(task, beside), task_conditions(task)
    grading = _grading(stimuli, conditions, task.reach_mm)
    found = {}
    for stimulus in stimuli:
        with moved(stimulus.in_file):
            found[stimulus.name] = stimulus.touch(
                conditions.finger, conditions.materials, conditions.resolution, grading
            )
    return found


def _grading(stimuli: Sequence[TaskStimulus], conditions: Conditions, reach_mm: float | None) -> Grading:
    """Mesh that is fine at every contact, the same for all: meshes that differ would be discriminated."""
    zones = list(dict.fromkeys(_zone(stimulus, conditions) for stimulus in stimuli))
    grading = zones[0] if len(zones) == 1 else covering(zones)
    if reach_mm is None:
        return grading
    try:
        return replace(
            grading,
            half_length_mm=min(reach_mm, grading.half_length_mm),
            half_width_mm=min(reach_mm, grading.half_width_mm),
        )
    except InputError as error:
        said = f"reach_mm leaves no room for the finest elements: {error}"
        raise PlacedError(said, ("reach_mm",)) from error


def _zone(stimulus: TaskStimulus, conditions: Conditions) -> Grading:
    """Mesh that is fine wherever one stimulus touches."""
    stays = stimulus.motion.stays and stimulus.z_mm == 0.0
    if isinstance(stimulus.indenter, Sphere) and stays and abs(stimulus.x_mm) <= _NEAR_MM:
        return conditions.sphere_grading()
    with moved(stimulus.in_file), about():
        return grading_along(
            stimulus.indenter,
            conditions.resolution,
            conditions.receptor_x_mm + stimulus.x_mm,
            stimulus.z_mm,
            stimulus.spin_deg,
            stimulus.motion.poses,
            conditions.finger.relative_size,
        )
