"""Stimuli of a recording: the shifted bar, or stimuli of your own."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass, field
from pathlib import Path
from typing import Any, Protocol

from fingerpad.core.checks import finite
from fingerpad.core.errors import InputError
from fingerpad.core.files import read_text
from fingerpad.core.keywords import did_you_mean
from fingerpad.core.plain_yaml import read_yaml
from fingerpad.core.tables import TableRow, read_csv
from fingerpad.experiments.indenter_text import indenter_named
from fingerpad.geometry.indenters import Bar, Indenter
from fingerpad.geometry.motion import MOTION_UNITS, ForceRampAndHold, RampAndHold, Stimulus
from fingerpad.geometry.names import INDENTERS, SIZE_UNITS, sizes_of

PLACE = {"x_mm": "mm", "z_mm": "mm", "tilt_deg": "degrees", "spin_deg": "degrees"}
COLUMNS = ("stimulus", "indenter", *SIZE_UNITS, *MOTION_UNITS, *PLACE)
"""Columns of a file of stimuli; only the first two are needed."""


@dataclass(frozen=True)
class TactileStimulus:
    """An indenter, its motion and its place relative to the receptive field.

    Parameters
    ----------
    indenter : Indenter
        The rigid body.
    motion : RampAndHold or ForceRampAndHold
        How it is pressed.
    x_mm, z_mm : float
        Where its axis meets the skin, from the centre of the receptive field: along the finger on the
        tangent of the skin, distal positive, and across. [mm]
    tilt_deg : float, optional
        As in `fingerpad.Touch`; by default it presses perpendicular to the skin at the receptor. [degrees]
    spin_deg : float
        As in `fingerpad.Touch`: the orientation of a bar, an edge, a gap or a grating. [degrees]
    """

    indenter: Indenter
    motion: Stimulus = field(default_factory=RampAndHold)
    x_mm: float = 0.0
    z_mm: float = 0.0
    tilt_deg: float | None = None
    spin_deg: float = 0.0

    def __post_init__(self) -> None:
        finite("x_mm", self.x_mm, "mm")
        finite("z_mm", self.z_mm, "mm")
        finite("spin_deg", self.spin_deg, "degrees")
        if self.tilt_deg is not None:
            finite("tilt_deg", self.tilt_deg, "degrees")


class Stimuli(Protocol):
    """Tells which stimulus the entry of a table of recordings means."""

    @property
    def column(self) -> str:
        """Column of the recordings that names the stimulus."""
        ...

    def named(self, entry: str) -> tuple[str, TactileStimulus]:
        """Name of the stimulus, the same for equal ones, and the stimulus; `InputError` if there is none."""
        ...


@dataclass(frozen=True)
class ShiftedBar:
    """The paper's stimuli: one bar at several places along the finger.

    Parameters
    ----------
    bar : Bar
        Width and fillets.
    motion : RampAndHold or ForceRampAndHold
        The same at all shifts.

    Examples
    --------
    A positive shift lies on the proximal side (docs/decisions/bar-shift.md).

    >>> name, stimulus = ShiftedBar().named("1.50")
    >>> name, stimulus.x_mm
    ('1.5', -1.5)
    """

    bar: Bar = field(default_factory=Bar)
    motion: Stimulus = field(default_factory=RampAndHold)
    column: str = "shift_mm"

    def named(self, entry: str) -> tuple[str, TactileStimulus]:
        """Shift as text and the bar at that shift."""
        shift_mm = finite(self.column, entry, "mm") + 0.0  # type: ignore[arg-type]
        return f"{shift_mm:g}", TactileStimulus(self.bar, self.motion, x_mm=-shift_mm)


@dataclass(frozen=True)
class ListedStimuli:
    """Stimuli of your own, each with a name.

    Parameters
    ----------
    stimuli : mapping of str to TactileStimulus
        By name.
    source : str
        Where they are listed, for errors.
    """

    stimuli: Mapping[str, TactileStimulus]
    source: str = "stimuli"
    column: str = "stimulus"

    def named(self, entry: str) -> tuple[str, TactileStimulus]:
        """Return the name and the stimulus."""
        if entry not in self.stimuli:
            raise InputError(
                f"{self.column} must be one of {self.source}, {', '.join(self.stimuli)}: got {entry!r}."
            )
        return entry, self.stimuli[entry]


def read_stimuli(path: Path) -> ListedStimuli:
    r"""Read a list of stimuli, CSV or YAML.

    Parameters
    ----------
    path : Path
        A CSV file with columns among `COLUMNS`, or a YAML file (.yaml, .yml) that lists mappings with the
        same names. A size, motion or place that is not given is the paper's.

    Returns
    -------
    ListedStimuli

    Raises
    ------
    InputError
        If the file cannot be read, an indenter is unknown, a name is repeated, or a value cannot be; with
        the line and the column.

    Examples
    --------
    >>> from tempfile import TemporaryDirectory
    >>> with TemporaryDirectory() as folder:
    ...     path = Path(folder) / "stimuli.csv"
    ...     _ = path.write_text("stimulus,indenter,diameter_mm\nprobe,punch,1.0\n", encoding="utf-8")
    ...     read_stimuli(path).stimuli["probe"].indenter
    FlatPunch(diameter_mm=1.0, fillet_mm=0.3)
    """
    lines = _yaml_lines(path) if path.suffix in (".yaml", ".yml") else read_csv(path, COLUMNS)
    stimuli: dict[str, TactileStimulus] = {}
    for line in lines:
        name = line.text("stimulus")
        if name in stimuli:
            raise InputError(f"{line.place}: stimulus {name!r} is repeated, give each its own name.")
        stimuli[name] = _stimulus(line)
    return ListedStimuli(stimuli, str(path))


def _stimulus(line: TableRow) -> TactileStimulus:
    """Build the stimulus that a line describes."""
    kind, *inline = (part.strip() for part in line.text("indenter").split(":"))
    with line.placed():
        indenter = indenter_named(line.text("indenter"))
    sizes = {size: SIZE_UNITS[size] for size in sizes_of(kind)}
    line.refuse_others(("stimulus", "indenter", *sizes, *MOTION_UNITS, *PLACE), kind)
    given = _given(line, sizes)
    if inline and given:
        raise InputError(
            f"{line.place}: sizes must stand in indenter or in columns, not in both: leave "
            f"{next(iter(given))} empty."
        )
    if line.has("depth_mm") and line.has("force_mn"):
        raise InputError(f"{line.place}: depth_mm and force_mn exclude each other: leave one empty.")
    motion = ForceRampAndHold if line.has("force_mn") else RampAndHold
    with line.placed():
        return TactileStimulus(
            INDENTERS[kind](**given) if given else indenter,
            motion(**_given(line, MOTION_UNITS)),
            **_given(line, PLACE),
        )


def _given(line: TableRow, columns: Mapping[str, str]) -> dict[str, Any]:
    """Numbers of those columns that are not empty."""
    return {column: line.number(column, unit) for column, unit in columns.items() if line.has(column)}


def _yaml_lines(path: Path) -> list[TableRow]:
    """Entries of a YAML list as lines of a table."""
    content = read_yaml(read_text(path), str(path))
    if not isinstance(content, list) or not content:
        raise InputError(f"{path} must be a list of stimuli, each a mapping: got {type(content).__name__}.")
    lines = []
    for number, entry in enumerate(content, start=1):
        place = f"{path}, entry {number}"
        if not isinstance(entry, Mapping):
            raise InputError(f"{place}: must be a mapping such as {{stimulus: edge, indenter: bar}}.")
        for key in entry:
            if key not in COLUMNS:
                raise InputError(
                    f"{place}: {key!r} is unknown: {did_you_mean(str(key), COLUMNS, 'a stimulus')}"
                )
        lines.append(TableRow(place, entry))
    return lines
