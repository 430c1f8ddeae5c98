"""Stimuli of a recording: the shifted bar, or stimuli of your own."""

from __future__ import annotations

from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass, field, replace
from pathlib import Path
from typing import Protocol, runtime_checkable

import numpy as np

from fingerpad.core.checked import checked
from fingerpad.core.errors import InputError, Place, spelled
from fingerpad.core.files import read_text
from fingerpad.core.plain_yaml import read_yaml
from fingerpad.core.tables import TableRow, read_csv
from fingerpad.core.values import number_in
from fingerpad.experiments.conditions import Conditions
from fingerpad.experiments.descriptions.pressing import named_files
from fingerpad.experiments.descriptions.reading import Origin, at, merged, part_from
from fingerpad.experiments.descriptions.stimuli import (
    NamedStimulus,
    StimulusSet,
    named_stimuli,
    pressed_with,
    touches_of,
)
from fingerpad.experiments.descriptions.stimulus import PlaceSettings
from fingerpad.geometry.edged_indenters import SIZES
from fingerpad.geometry.indenters import Bar
from fingerpad.geometry.motion import PLAUSIBLE, Motion, RampAndHold
from fingerpad.skin.indentation import Touch

COLUMNS = (
    "name",
    "object",
    *(f"object.{size}" for size in SIZES),
    *(f"motion.{number}" for number in PLAUSIBLE),
    *(f"place.{name}" for name in PlaceSettings.model_fields),
    "friction",
)
"""Usual columns of a table of stimuli; any other key of a block is one as well, such as `motion.file`."""

BLOCKS = ("object.", "motion.", "place.")  # How other columns begin.


@runtime_checkable
class Stimuli(Protocol):
    """Tells which stimulus the entry of a table of recordings means, and how it is pressed."""

    @property
    def column(self) -> str:
        """Column of the recordings that names the stimulus."""
        ...

    @property
    def conditions(self) -> Conditions:
        """Finger, tissues and accuracy."""
        ...

    @property
    def finger_files(self) -> tuple[Path, ...]:
        """Files that the finger is read from."""
        ...

    def named(self, entry: str) -> NamedStimulus:
        """Stimulus of an entry, the same for equal ones; `InputError` if there is none."""
        ...

    def touches(self, stimuli: Sequence[NamedStimulus], conditions: Conditions) -> dict[str, Touch]:
        """One touch per stimulus, by name; `InputError` with its name or its place if one cannot be."""
        ...


@dataclass(frozen=True)
class ShiftedBar:
    """The paper's stimuli: one bar at several places along the finger."""

    bar: Bar = field(default_factory=Bar)  # Width and fillets.
    motion: Motion = field(default_factory=RampAndHold)  # The same at all shifts.
    column: str = "shift_mm"  # Column of the recordings with the shifts.
    conditions: Conditions = field(default_factory=Conditions)  # Finger, tissues and accuracy.
    finger_files: tuple[Path, ...] = ()  # Those that the finger is read from.

    def named(self, entry: str) -> NamedStimulus:
        """Return the bar at a shift."""
        shift_mm = number_in(self.column, entry, "mm") + 0.0
        name = repr(shift_mm).removesuffix(".0")

        def in_file(place: Place) -> tuple[Place, str]:
            return place, f"Stimulus {name} cannot be used: {spelled(place)}"

        along = along_skin(self.conditions)
        return NamedStimulus(self.bar, self.motion, -shift_mm * along, name=name, in_file=in_file)

    def touches(self, stimuli: Sequence[NamedStimulus], conditions: Conditions) -> dict[str, Touch]:
        """One touch per stimulus, for the paper's bar those of the reproduction."""
        grading = conditions.bar_grading() if conditions.finger.own_mesh is None else None
        return {stimulus.name: pressed_with(stimulus, conditions, grading) for stimulus in stimuli}


@dataclass(frozen=True)
class ListedStimuli:
    """Stimuli of your own, each with a name."""

    stimuli: Mapping[str, NamedStimulus]
    source: str = "stimuli"  # Where they are listed, for errors.
    column: str = "stimulus"  # Column of the recordings with the names.
    conditions: Conditions = field(default_factory=Conditions)  # Finger, tissues and accuracy.
    reach_mm: float | None = None  # As of `StimulusSet`. [mm]
    finger_files: tuple[Path, ...] = ()  # Those that the finger is read from.

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


def along_skin(conditions: Conditions) -> float:
    """Distance along the finger's axis over that along the skin at the receptor."""
    return float(np.cos(np.deg2rad(conditions.skin_tilt_deg)))


@checked
def read_stimuli(path: str | Path, **replacing: str | None) -> ListedStimuli:
    r"""Read a list of stimuli, CSV or YAML.

    Parameters
    ----------
    path : str or Path
        A YAML file with the keys of `StimulusSet`, those of a touch with a list of `stimuli`; or a CSV file
        with one row per stimulus, whose columns are `name` and the same keys, such as `object`,
        `object.width_mm`, `motion.depth_mm`, `place.x_mm`.
    **replacing
        Values that replace those of the file: `resolution`, `tissues` or `finger`; None leaves them.

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
        conditions = described.conditions(beside=origin.beside)
        stimuli = named_stimuli(described, origin.beside)
        if not stimuli:
            raise InputError("stimuli", "must have at least one entry", "none")
    return ListedStimuli(
        {stimulus.name: replace(stimulus, in_file=_located(stimulus, origin)) for stimulus in stimuli},
        str(path),
        conditions=conditions,
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
