"""Several stimuli, in the words of a touch: what all have, and what differs; the shifted bar of the paper."""

from __future__ import annotations

from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass, field, replace
from pathlib import Path
from typing import Annotated, Any

from pydantic import Discriminator, Strict, Tag

from fingerpad.core.checked import checked
from fingerpad.core.errors import InputError, Place, closest, spelled
from fingerpad.core.files import read_text
from fingerpad.core.plain_yaml import read_yaml
from fingerpad.core.tables import TableRow, read_csv
from fingerpad.core.values import Finite, Positive, Text, choice, number_in
from fingerpad.data import protocol
from fingerpad.experiments.conditions import Conditions
from fingerpad.experiments.requests.parts import (
    LISTED,
    VARIED,
    Block,
    BlockOrObject,
    LevelOrName,
    Origin,
    Part,
    at,
    merged,
    moved,
    part_from,
)
from fingerpad.experiments.requests.stimulus import (
    RAMP_AND_HOLD,
    FingerDescription,
    MadeObjects,
    PlaceSettings,
    StimulusDescription,
    TactileStimulus,
    about,
    finger_of,
    named_files,
)
from fingerpad.geometry.bodies import SIZES, Bar, Sphere
from fingerpad.geometry.grading import RESOLUTIONS, Grading, covering
from fingerpad.geometry.motion import PLAUSIBLE, Motion, RampAndHold
from fingerpad.geometry.size_field import grading_below
from fingerpad.skin.indentation import Touch

_NEAR_MM = max(protocol.SPHERE_POSITIONS.value)
"""The mesh of the paper's spheres serves places as far as this from the middle. [mm]"""

_EXCLUSIVE = {"depth_mm": "force_mn", "force_mn": "depth_mm"}


class StimulusBlocks(Part):
    """What a stimulus, or all of them, say of themselves: blocks of a `StimulusDescription`, or parts."""

    object: BlockOrObject = None
    motion: BlockOrObject = None
    place: Block | None = None
    """As in the file of a touch. A stimulus has the keys of its own block, then those that all have."""
    friction: Finite | None = None  #: Coulomb's coefficient.


class ListedStimulus(StimulusBlocks):
    """One stimulus by name."""

    name: Text  #: How it is called.
    level: Finite | None = None  #: Where it stands on the axis of the psychometric curve.


class VariedStimuli(Part):
    """Stimuli that differ in one key."""

    vary: Text
    """Block and key, such as "object.radius_mm", "motion.force_mn" or "place.spin_deg"; or "friction"."""
    values: Annotated[tuple[LevelOrName, ...], Strict(False)]  #: One per stimulus.


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
    ]  #: Which they are.


@dataclass(frozen=True, kw_only=True)
class NamedStimulus(TactileStimulus):
    """One of several stimuli."""

    name: str  #: How it is called.
    level: float | None = None  #: Where it stands on the axis of a psychometric curve.
    files: tuple[Path, ...] = field(default=(), compare=False)  #: Those that its object and motion name.
    in_file: Callable[[Place], tuple[Place, str]] = field(
        default=lambda place: (place, spelled(place)), compare=False, repr=False
    )  #: From a place in its description to that in the file of all, and the words for it.


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

    motion = described.motion
    if isinstance(motion, Mapping) and isinstance(own.motion, Mapping):
        hidden = {_EXCLUSIVE.get(key) for key in own.motion}
        motion = {key: value for key, value in motion.items() if key not in hidden}
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
    if conditions.finger.own_mesh is None and conditions.grading is None:
        grading: Grading | None = _grading(stimuli, conditions, reach_mm, receptor)
    elif reach_mm is not None:
        raise InputError("reach_mm", "must not be given", remedy="the finger has a mesh of its own")
    else:
        grading = conditions.grading
    return {stimulus.name: pressed_with(stimulus, conditions, grading) for stimulus in stimuli}


def pressed_with(stimulus: NamedStimulus, conditions: Conditions, grading: Grading | None) -> Touch:
    """Touch of one stimulus on a given mesh; `InputError` with its place in the file if it cannot be."""
    with moved(stimulus.in_file):
        pressed = conditions.finger, conditions.tissues, conditions.resolution, grading
        return stimulus.touch(*pressed, receptor_depths_mm=conditions.receptor_depths_mm)


def _grading(
    stimuli: Sequence[NamedStimulus], conditions: Conditions, reach_mm: float | None, receptor: Grading | None
) -> Grading:
    """Mesh that is fine at every contact, the same for all: meshes that differ would be discriminated."""
    zones = list(dict.fromkeys(_zone(stimulus, conditions) for stimulus in stimuli))
    zones += [receptor] if receptor and receptor not in zones else []
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
        raise InputError("reach_mm", "leaves no room for the finest elements", remedy=str(error)) from error


def _zone(stimulus: NamedStimulus, conditions: Conditions) -> Grading:
    """Mesh that is fine wherever one stimulus touches."""
    stays = stimulus.motion.stays and stimulus.z_mm == 0.0
    if isinstance(stimulus.indenter, Sphere) and stays and abs(stimulus.x_mm) <= _NEAR_MM:
        return conditions.sphere_grading()
    with moved(stimulus.in_file), about():
        return grading_below(
            conditions.finger,
            stimulus.indenter,
            conditions.resolution,
            (conditions.receptor_x_mm + stimulus.x_mm, stimulus.z_mm),
            stimulus.motion,
            stimulus.tilt_on(conditions.finger),
            stimulus.spin_deg,
        )


COLUMNS = (
    "name",
    "object",
    *(f"object.{size}" for size in SIZES),
    *(f"motion.{number}" for number in PLAUSIBLE),
    *(f"place.{name}" for name in PlaceSettings.model_fields),
    "friction",
)  # Usual columns of a table of stimuli; any other key of a block is one as well, such as `motion.file`.

BAR = "bar"  # The stimuli that are no file: the paper's bar, shifted along the finger.

BLOCKS = ("object.", "motion.", "place.")  # How other columns begin.


@dataclass(frozen=True)
class ShiftedBar:
    """The paper's stimuli: one bar at several places along the finger."""

    bar: Bar = field(default_factory=Bar)  #: Width and fillets.
    motion: Motion = field(default_factory=RampAndHold)  #: The same at all shifts.
    column: str = "shift_mm"  #: Column of the recordings with the shifts.
    conditions: Conditions = field(default_factory=Conditions)  #: Finger, tissues and accuracy.
    finger_files: tuple[Path, ...] = ()  #: Those that the finger is read from.

    def named(self, entry: str) -> NamedStimulus:
        """Return the bar at a shift."""
        shift_mm = number_in(self.column, entry, "mm") + 0.0
        name = repr(shift_mm).removesuffix(".0")

        def in_file(place: Place) -> tuple[Place, str]:
            return place, f"Stimulus {name} cannot be used: {spelled(place)}"

        x_mm = -shift_mm * self.conditions.along_skin
        return NamedStimulus(self.bar, self.motion, x_mm, name=name, in_file=in_file)

    def touches(self, stimuli: Sequence[NamedStimulus], conditions: Conditions) -> dict[str, Touch]:
        """One touch per stimulus, for the paper's bar those of the reproduction."""
        grading = conditions.bar_grading() if conditions.finger.own_mesh is None else None
        return {stimulus.name: pressed_with(stimulus, conditions, grading) for stimulus in stimuli}


@dataclass(frozen=True)
class ListedStimuli:
    """Stimuli of your own, each with a name."""

    stimuli: Mapping[str, NamedStimulus]
    source: str = "stimuli"  #: Where they are listed, for errors.
    column: str = "stimulus"  #: Column of the recordings with the names.
    conditions: Conditions = field(default_factory=Conditions)  #: Finger, tissues and accuracy.
    reach_mm: float | None = None  #: As of `StimulusSet`. [mm]
    finger_files: tuple[Path, ...] = ()  #: Those that the finger is read from.

    def named(self, entry: str) -> NamedStimulus:
        """Return the stimulus of that name."""
        if entry not in self.stimuli:
            raise InputError(
                f"{self.column} must be one of {self.source}, {', '.join(self.stimuli)}: got {entry!r}."
            )
        return self.stimuli[entry]

    def touches(self, stimuli: Sequence[NamedStimulus], conditions: Conditions) -> dict[str, Touch]:
        """One touch per stimulus; objects of one kind share a mesh, which is fine at the receptor as well."""
        found: dict[str, Touch] = {}
        for kind in dict.fromkeys(type(stimulus.indenter) for stimulus in stimuli):
            same = [stimulus for stimulus in stimuli if type(stimulus.indenter) is kind]
            # A wire needs elements so small that they cannot reach to the receptor as well.
            wire = any(stimulus.indenter.grips for stimulus in same)
            receptor = None if wire else conditions.sphere_grading()
            found |= touches_of(same, conditions, self.reach_mm, receptor)
        return {stimulus.name: found[stimulus.name] for stimulus in stimuli}


Stimuli = ShiftedBar | ListedStimuli
"""Tells which stimulus the entry of a table of recordings means, and how it is pressed."""


@checked
def read_stimuli(path: str | Path, **replacing: Any) -> ListedStimuli:
    r"""Read a list of stimuli, CSV or YAML.

    Parameters
    ----------
    path : str or Path
        A YAML file with the keys of `StimulusSet`, those of a touch with a list of `stimuli`; or a CSV file
        with one row per stimulus, whose columns are `name` and the same keys, such as `object`,
        `object.width_mm`, `motion.depth_mm`, `place.x_mm`.
    **replacing
        Values that replace those of the file, such as `resolution`, `tissues` or `finger`; None leaves them.

    Examples
    --------
    >>> from tempfile import TemporaryDirectory
    >>> with TemporaryDirectory() as folder:
    ...     path = Path(folder) / "stimuli.csv"
    ...     _ = path.write_text("name,object,object.diameter_mm\nprobe,punch,1.0\n", encoding="utf-8")
    ...     read_stimuli(path).stimuli["probe"].indenter
    FlatPunch(diameter_mm=1.0, fillet_mm=0.3)
    """
    path = Path(path)
    given = {key: value for key, value in replacing.items() if value is not None}
    if path.suffix in (".yaml", ".yml"):
        text = read_text(path)
        origin, content = Origin(str(path), text), read_yaml(text, str(path))
    else:
        rows = read_csv(path, COLUMNS, BLOCKS)
        origin = Origin(str(path), rows=tuple(row.line for row in rows))
        content = {"stimuli": [_blocks(row) for row in rows]}
    with origin.located():
        described = part_from(StimulusSet, content | given if isinstance(content, dict) else content)
        with at("finger"):
            finger = finger_of(described.finger, origin.beside)
        stimuli = named_stimuli(described, origin.beside)
        if not stimuli:
            raise InputError("stimuli", "must have at least one entry", "none")
    return ListedStimuli(
        {stimulus.name: replace(stimulus, in_file=_located(stimulus, origin)) for stimulus in stimuli},
        str(path),
        conditions=described.conditions(finger),
        reach_mm=described.reach_mm,
        finger_files=tuple(named_files(described.finger, origin.beside)),
    )


def _blocks(row: TableRow) -> dict[str, object]:
    """Keys of a stimulus that a row of a table gives, as YAML has them."""
    found: dict[str, object] = {}
    blocks: dict[str, dict[str, object]] = {}
    for column, entry in row.entries.items():
        if row.has(column):
            block, dot, key = column.partition(".")
            (blocks.setdefault(block, {}) if dot else found)[key or column] = (
                entry.strip() if column == "name" else read_yaml(entry, f"{row.place}, {column}")
            )
    for block, keys in blocks.items():
        with row.placed(), at(block):
            found[block] = merged(found.get(block), keys)
    return found


def _located(stimulus: NamedStimulus, origin: Origin) -> Callable[[Place], tuple[Place, str]]:
    """Place and words of a key of a stimulus, with file and line."""

    def in_file(path: Place) -> tuple[Place, str]:
        place, words = stimulus.in_file(path)
        return place, ", ".join(origin.line_of(place, words))

    return in_file
