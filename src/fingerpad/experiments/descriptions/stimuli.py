"""Several stimuli in one file, in the words of a touch: what all have, and what differs."""

from __future__ import annotations

from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass, field, replace
from pathlib import Path
from typing import Annotated

from pydantic import Discriminator, Strict, Tag

from fingerpad.core.errors import InputError, Place, closest, spelled
from fingerpad.core.values import Finite, Positive, Text, choice
from fingerpad.data import protocol
from fingerpad.experiments.conditions import Conditions
from fingerpad.experiments.descriptions.pressing import RAMP_AND_HOLD
from fingerpad.experiments.descriptions.reading import at, merged, moved, part_from
from fingerpad.experiments.descriptions.stimulus import (
    FingerDescription,
    MadeObjects,
    PlaceSettings,
    StimulusDescription,
    TactileStimulus,
    about,
)
from fingerpad.experiments.descriptions.values import LISTED, VARIED, Block, LevelOrName, Part
from fingerpad.geometry.edged_indenters import SIZES
from fingerpad.geometry.grading import RESOLUTIONS, Grading, covering
from fingerpad.geometry.indenter_grading import grading_along
from fingerpad.geometry.indenters import Sphere
from fingerpad.geometry.motion import PLAUSIBLE
from fingerpad.skin.indentation import Touch

_NEAR_MM = max(protocol.SPHERE_POSITIONS.value)
"""The mesh of the paper's spheres serves places as far as this from the middle. [mm]"""

_EXCLUSIVE = {"depth_mm": "force_mn", "force_mn": "depth_mm"}


class StimulusBlocks(Part):
    """What a stimulus, or all of them, say of themselves: blocks of a `StimulusDescription`, or parts."""

    object: Block | Text | None = None
    """As in the file of a touch. A stimulus has the keys of its own block, then those that all have."""
    motion: Block | None = None
    """As in the file of a touch. A stimulus has the keys of its own block, then those that all have."""
    place: Block | None = None
    """As in the file of a touch. A stimulus has the keys of its own block, then those that all have."""
    friction: Finite | None = None
    """Coulomb's coefficient."""


class ListedStimulus(StimulusBlocks):
    """One stimulus by name."""

    name: Text
    """How it is called."""
    level: Finite | None = None
    """Where it stands on the axis of the psychometric curve."""


class VariedStimuli(Part):
    """Stimuli that differ in one key."""

    vary: Text
    """Block and key, such as "object.radius_mm", "motion.force_mn" or "place.spin_deg"; or "friction"."""
    values: Annotated[tuple[LevelOrName, ...], Strict(False)]
    """One per stimulus."""


class StimulusSet(StimulusBlocks, FingerDescription):
    """Stimuli and the finger that they are pressed into."""

    resolution: Annotated[str, choice(RESOLUTIONS)] = "standard"
    """As of `FingerDescription`; `resolution` is "standard" by default."""
    reach_mm: Positive | None = None
    """How far to either side of the middle, along the finger and across, the mesh is fine at most; without
    it, as far as the objects need. [mm]"""
    stimuli: Annotated[
        Annotated[tuple[ListedStimulus, ...], Strict(False), Tag(LISTED)]
        | Annotated[VariedStimuli, Tag(VARIED)],
        Discriminator(lambda value: LISTED if isinstance(value, list | tuple) else VARIED),
    ]
    """Which they are."""


@dataclass(frozen=True, kw_only=True)
class NamedStimulus(TactileStimulus):
    """One of several stimuli."""

    name: str
    """How it is called."""
    level: float | None = None
    """Where it stands on the axis of a psychometric curve."""
    files: tuple[Path, ...] = field(default=(), compare=False)
    """Those that its object and motion name."""
    in_file: Callable[[Place], tuple[Place, str]] = field(
        default=lambda place: (place, spelled(place)), compare=False, repr=False
    )
    """From a place in its description to that in the file of all, and the words for it."""


def named_stimuli(described: StimulusSet, beside: Path = Path()) -> list[NamedStimulus]:
    """Make the stimuli that a file describes, in its order; an object that several have is made once."""
    made: MadeObjects = []
    found: list[NamedStimulus] = []
    for place, name, level, own in _listed(described):
        if name in [other.name for other in found]:
            raise InputError("stimuli", "must differ", remedy=f"{name!r} is repeated, keep one").at(
                place, "stimuli"
            )
        found.append(_named(described, place, name, level, own, beside, made))
    return found


def _listed(described: StimulusSet) -> list[tuple[Place, str, float | None, StimulusBlocks]]:
    """Place in the file, name, level and own blocks of each stimulus."""
    if not isinstance(described.stimuli, VariedStimuli):
        return [(("stimuli", row), own.name, own.level, own) for row, own in enumerate(described.stimuli)]
    block, dot, key = described.stimuli.vary.partition(".")
    if block not in StimulusBlocks.model_fields or bool(dot) == (block == "friction"):
        known = [f"object.{size}" for size in SIZES] + [f"motion.{number}" for number in PLAUSIBLE]
        near = closest(
            described.stimuli.vary, [*known, *(f"place.{name}" for name in PlaceSettings.model_fields)]
        )
        raise InputError(
            ("stimuli", "vary"),
            f"must be friction, or a key of object, motion or place such as {near or 'object.radius_mm'}",
            repr(described.stimuli.vary),
        )
    common = getattr(described, block)
    if common is not None and (not dot or (isinstance(common, Mapping) and key in common)):
        raise InputError((block, key), "must not be given where stimuli.vary it", remedy="leave it out")
    found: list[tuple[Place, str, float | None, StimulusBlocks]] = []
    for row, value in enumerate(described.stimuli.values):
        place = ("stimuli", "values", row)
        named, level = (value, None) if isinstance(value, str) else (f"{value:g}", value)
        with moved(_varied(place)):
            own = part_from(StimulusBlocks, {block: {key: value} if dot else value})
        found.append((place, named, level, own))
    return found


def _varied(place: Place) -> Callable[[Place], tuple[Place, str]]:
    """Place of a value that varies, for that of the key that it is."""
    return lambda path: (place, f"{spelled(place)}, {spelled(path)}")


def _named(
    described: StimulusSet,
    listed: Place,
    name: str,
    level: float | None,
    own: StimulusBlocks,
    beside: Path,
    made: MadeObjects,
) -> NamedStimulus:
    """Build one stimulus from the blocks that all have and its own."""

    def in_file(path: Place) -> tuple[Place, str]:
        block = getattr(own, str(path[0]), None) if path else own
        of_all = block is None or (len(path) > 1 and isinstance(block, Mapping) and path[1] not in block)
        if of_all and (listed[1] == "values" or getattr(described, str(path[0]), None) is not None):
            return path, spelled(path)
        if listed[1] == "values":
            return _varied(listed)(path)
        return (*listed, *path), spelled((*listed, *path))

    hidden = {_EXCLUSIVE.get(key) for key in own.motion or ()}
    motion = {key: value for key, value in (described.motion or {}).items() if key not in hidden}
    with moved(in_file), at("object"):
        body = merged(described.object, own.object)
    given = {
        "object": body,
        "motion": merged(motion, own.motion, RAMP_AND_HOLD),
        "place": merged(described.place, own.place),
        "friction": merged(described.friction, own.friction),
    }
    with moved(in_file):
        one = part_from(
            StimulusDescription, {key: block for key, block in given.items() if block is not None}
        )
        return NamedStimulus(
            **vars(one.stimulus(beside, made)),
            name=name,
            level=level,
            files=tuple(one.files(beside)),
            in_file=in_file,
        )


def touches_of(
    stimuli: Sequence[NamedStimulus],
    conditions: Conditions,
    reach_mm: float | None = None,
    receptor: Grading | None = None,
) -> dict[str, Touch]:
    """One touch per stimulus, all on one mesh; those of the paper's spheres are those of a reproduction.

    A finger of a mesh has its own, which is as fine as it is.
    """
    if conditions.finger.own_mesh is None:
        grading = _grading(stimuli, conditions, reach_mm, receptor)
    elif reach_mm is not None:
        raise InputError("reach_mm", "must not be given", remedy="the finger has a mesh of its own")
    else:
        grading = None
    return {stimulus.name: pressed_with(stimulus, conditions, grading) for stimulus in stimuli}


def pressed_with(stimulus: NamedStimulus, conditions: Conditions, grading: Grading | None) -> Touch:
    """Touch of one stimulus on a given mesh; `InputError` with its place in the file if it cannot be."""
    with moved(stimulus.in_file):
        return stimulus.touch(conditions.finger, conditions.tissues, conditions.resolution, grading)


def _grading(
    stimuli: Sequence[NamedStimulus], conditions: Conditions, reach_mm: float | None, receptor: Grading | None
) -> Grading:
    """Mesh that is fine at every contact, the same for all: meshes that differ would be discriminated."""
    zones = list(dict.fromkeys(_zone(stimulus, conditions) for stimulus in stimuli))
    zones += [receptor] if receptor and receptor not in zones else []
    grading = zones[0] if len(zones) == 1 else covering(zones)
    if reach_mm is None:
        return grading
    if reach_mm <= grading.core_half_length_mm:  # what remains is all as fine as the core
        finest = grading.core_size_mm
        grading = replace(grading, size_x_mm=finest, core_half_length_mm=0.0, core_size_mm=0.0)
    try:
        return replace(
            grading,
            half_length_mm=min(reach_mm, grading.half_length_mm),
            half_width_mm=min(reach_mm, grading.half_width_mm),
        )
    except InputError as error:
        raise InputError("reach_mm", "leaves no room for the finest elements", remedy=str(error)) from error


def _zone(stimulus: NamedStimulus, conditions: Conditions) -> Grading:
    """Mesh that is fine wherever one stimulus touches."""
    stays = stimulus.motion.stays and stimulus.z_mm == 0.0
    if isinstance(stimulus.indenter, Sphere) and stays and abs(stimulus.x_mm) <= _NEAR_MM:
        return conditions.sphere_grading()
    with moved(stimulus.in_file), about():
        return grading_along(
            conditions.finger,
            stimulus.indenter,
            conditions.resolution,
            (conditions.receptor_x_mm + stimulus.x_mm, stimulus.z_mm),
            stimulus.motion.poses,
            stimulus.tilt_on(conditions.finger),
            stimulus.spin_deg,
        )
