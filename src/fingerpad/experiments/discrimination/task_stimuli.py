"""The stimuli of a discrimination task, the touches that indent with them, and the afferents."""

from __future__ import annotations

from collections.abc import Collection, Mapping, Sequence
from dataclasses import dataclass, replace
from pathlib import Path
from typing import Any

from pydantic import ValidationError

from fingerpad.core.errors import InputError
from fingerpad.data import protocol
from fingerpad.experiments.conditions import Conditions
from fingerpad.experiments.descriptions.population import afferent_of, population_of
from fingerpad.experiments.descriptions.reading import error_sentence
from fingerpad.experiments.discrimination.task import DiscriminationTask, StimulusSettings, VariedStimuli
from fingerpad.geometry.fingertip import Fingertip
from fingerpad.geometry.grading import Grading, covering
from fingerpad.geometry.indenter_grading import grading_about
from fingerpad.geometry.indenters import Indenter, Sphere
from fingerpad.geometry.motion import ForceRampAndHold, RampAndHold, Stimulus
from fingerpad.geometry.names import INDENTERS, sizes_of
from fingerpad.neuron.population import Population
from fingerpad.skin.indentation import Touch, touch_of

_NEAR_MM = max(protocol.SPHERE_POSITIONS.value)
"""The mesh of the paper's spheres serves places as far as this from the middle. [mm]"""

_MOTION = {"ramp_ms", "hold_ms"}
_EXCLUSIVE = {"depth_mm": "force_mn", "force_mn": "depth_mm"}
_HANDLING = (
    "name",
    "level",
    "indenter",
    "offset_mm",
    "tilt_deg",
    "spin_deg",
    "friction",
    "depth_mm",
    "force_mn",
    *_MOTION,
)


@dataclass(frozen=True)
class TaskStimulus:
    """One stimulus of a task.

    Parameters
    ----------
    name : str
        How it is called.
    level : float or None
        Where it stands on the axis of the psychometric curve.
    indenter : Indenter
        What is pressed in.
    motion : RampAndHold or ForceRampAndHold
        How far or how hard, and how fast.
    offset_mm : (float, float)
        From the middle of the pad, along the finger and across. [mm]
    tilt_deg : float or None
        As of `Touch`; None for perpendicular to the skin. [degrees]
    spin_deg : float
        As of `Touch`. [degrees]
    friction : float
        Coulomb's coefficient.
    """

    name: str
    level: float | None
    indenter: Indenter
    motion: Stimulus
    offset_mm: tuple[float, ...]
    tilt_deg: float | None
    spin_deg: float
    friction: float


def task_stimuli(task: DiscriminationTask) -> tuple[TaskStimulus, ...]:
    """List the stimuli of a task, the standard first.

    Parameters
    ----------
    task : DiscriminationTask
        From `read_task`.

    Returns
    -------
    tuple of TaskStimulus
        The standard, then the comparisons in the order of the file.

    Raises
    ------
    InputError
        If there are fewer than two, two have one name or level, the standard is not among them, or one
        cannot be: no indenter, a size that it does not have, depth and force at once.

    Examples
    --------
    >>> from fingerpad.experiments.discrimination.task_files import read_task
    >>> spheres = task_stimuli(read_task("sphere_curvature"))
    >>> [stimulus.name for stimulus in spheres[:3]], spheres[1].indenter
    (['287', '296', '305'], Sphere(curvature_per_m=296.0))
    """
    found = _varied(task) if isinstance(task.stimuli, VariedStimuli) else _listed(task)
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


def _varied(task: DiscriminationTask) -> list[TaskStimulus]:
    assert isinstance(task.stimuli, VariedStimuli)
    vary, found = task.stimuli.vary, []
    if vary in task.common.given:
        raise InputError(f"common.{vary} must not be given where stimuli.vary it: leave it out there.")
    for number, value in enumerate(task.stimuli.values, start=1):
        place = f"stimuli.values[{number}]"
        try:
            own = StimulusSettings.model_validate({vary: value})
        except ValidationError as error:
            raise InputError(f"{place}: {error_sentence(error, StimulusSettings)}") from error
        found.append(_presented(place, task.common, own, f"{value:g}", value))
    return found


def _listed(task: DiscriminationTask) -> list[TaskStimulus]:
    assert not isinstance(task.stimuli, VariedStimuli)
    for key in ("name", "level"):
        if key in task.common.given:
            raise InputError(f"common.{key} must not be given: each stimulus has its own.")
    found = []
    for number, own in enumerate(task.stimuli, start=1):
        place = f"stimuli[{number}]"
        if own.name is None:
            raise InputError(f"{place}.name must be given: it is missing.")
        found.append(_presented(place, task.common, own, own.name, own.level))
    return found


def _presented(
    place: str, common: StimulusSettings, own: StimulusSettings, name: str, level: float | None
) -> TaskStimulus:
    """Build one stimulus from the common values and its own."""
    given = _merged(place, common, own)
    kind = given.get("indenter")
    if kind is None:
        raise InputError(
            f"{place}.indenter must be given, there or in common, one of {', '.join(INDENTERS)}: it is "
            "missing."
        )
    sizes = sizes_of(kind)
    for key in given:
        if key not in (*sizes, *_HANDLING):
            raise InputError(
                f"{place}.{key} must not be given: a {kind} has {', '.join(sizes) or 'no size'}."
            )
    motion = ForceRampAndHold if "force_mn" in given else RampAndHold
    try:
        return TaskStimulus(
            name=name,
            level=level,
            indenter=INDENTERS[kind](**_chosen(given, sizes)),
            motion=motion(**_chosen(given, _MOTION | _EXCLUSIVE.keys())),
            offset_mm=given.get("offset_mm", (0.0, 0.0)),
            tilt_deg=given.get("tilt_deg"),
            spin_deg=given.get("spin_deg", 0.0),
            friction=given.get("friction", 0.0),
        )
    except InputError as error:
        raise InputError(f"{place}: {error}") from error


def _merged(place: str, common: StimulusSettings, own: StimulusSettings) -> dict[str, Any]:
    """Replace common values by those of a stimulus; its own depth also replaces a common force."""
    for where, settings in ((place, own.given), ("common", common.given)):
        if settings.keys() >= _EXCLUSIVE.keys():
            raise InputError(f"{where}: depth_mm and force_mn exclude each other: leave one out.")
    hidden = {_EXCLUSIVE.get(key) for key in own.given}
    return {key: value for key, value in common.given.items() if key not in hidden} | own.given


def _chosen(given: Mapping[str, Any], keys: Collection[str]) -> dict[str, Any]:
    return {key: value for key, value in given.items() if key in keys}


def conditions_of(task: DiscriminationTask) -> Conditions:
    """Finger, tissues and accuracy of a task."""
    skin = task.skin
    return Conditions(skin.resolution, task.experiment.seed, skin.materials, Fingertip.of(skin.finger))


def task_population(task: DiscriminationTask, beside: Path = Path()) -> Population:
    """Lay out the afferents of a task; a file of results that it names is searched in `beside`."""
    afferent = afferent_of(task.afferent, task.skin.materials, beside)
    return population_of(task.population, afferent, finger=Fingertip.of(task.skin.finger))


def task_touches(task: DiscriminationTask) -> dict[str, Touch]:
    """One touch per stimulus, all on one mesh; those of the paper's spheres are those of a reproduction.

    Parameters
    ----------
    task : DiscriminationTask
        From `read_task`.

    Returns
    -------
    dict of str to Touch
        By name, the standard first.

    Raises
    ------
    InputError
        As `task_stimuli`, or if one cannot be used, with its name.
    """
    stimuli = task_stimuli(task)
    conditions = conditions_of(task)
    grading = _grading(stimuli, conditions, task.skin.reach_mm)
    found = {}
    for stimulus in stimuli:
        along, across = stimulus.offset_mm
        try:
            found[stimulus.name] = touch_of(
                conditions.finger,
                stimulus.indenter,
                stimulus.motion,
                conditions.materials,
                conditions.resolution,
                (conditions.receptor_x_mm + along, across),
                grading,
                conditions.tilt_deg(stimulus.indenter) if stimulus.tilt_deg is None else stimulus.tilt_deg,
                friction=stimulus.friction,
                spin_deg=stimulus.spin_deg,
            )
        except InputError as error:
            raise InputError(f"stimulus {stimulus.name!r} cannot be used: {error}") from error
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
        raise InputError(f"skin.reach_mm leaves no room for the finest elements: {error}") from error


def _zone(stimulus: TaskStimulus, conditions: Conditions) -> Grading:
    """Mesh that is fine where one stimulus touches."""
    along, across = stimulus.offset_mm
    if isinstance(stimulus.indenter, Sphere) and abs(along) <= _NEAR_MM and across == 0.0:
        return conditions.sphere_grading()
    x_mm, size = conditions.receptor_x_mm + along, conditions.finger.relative_size
    return grading_about(
        stimulus.indenter, conditions.resolution, x_mm, across, stimulus.spin_deg, finger_size=size
    )
