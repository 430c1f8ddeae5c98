"""One touch in one file: finger, tissues, object, motion, place, friction, afferents and outputs.

docs/touch.md explains every key.
"""

from __future__ import annotations

import hashlib
from collections.abc import Iterator, Mapping, Sequence
from contextlib import contextmanager
from dataclasses import dataclass
from functools import cached_property
from pathlib import Path
from typing import Annotated, Any

from pydantic import BeforeValidator, Field, Strict, ValidationError

from fingerpad.core.errors import InputError
from fingerpad.core.files import read_text
from fingerpad.core.plain_yaml import line_at, read_yaml
from fingerpad.data.tissues import DEFAULT_TISSUES
from fingerpad.experiments.conditions import straight_tilt_deg
from fingerpad.experiments.descriptions.parts import DEFAULT, AfferentChoice, PopulationSettings
from fingerpad.experiments.descriptions.population import afferent_of, population_of
from fingerpad.experiments.descriptions.pressing import (
    FingerPart,
    MotionPart,
    ObjectPart,
    finger_of,
    finger_part,
    motion_of,
    object_of,
)
from fingerpad.experiments.descriptions.reading import error_sentence, place_of, spelled
from fingerpad.experiments.descriptions.values import (
    FiniteNumber,
    NotNegative,
    Numbers,
    Pair,
    Part,
    Text,
    as_list,
    choice_of,
)
from fingerpad.geometry.fingertip import Finger
from fingerpad.geometry.grading import RESOLUTIONS
from fingerpad.mechanics.tissues import TISSUES
from fingerpad.neuron.population import Population
from fingerpad.neuron.rate_windows import rate_windows_ms
from fingerpad.neuron.spikes import window_bounds
from fingerpad.skin.indentation import Touch, touch_of

OUTPUTS = (
    "figures",
    "csv",
    "spikes",
    "npz",
    "netcdf",
    "zarr",
    "nwb",
    "vtu",
    "abaqus",
    "calculix",
    "febio",
)
"""What can be written of a touch."""


class PlaceSettings(Part):
    """Where and in which direction the object is pressed.

    Parameters
    ----------
    x_mm, z_mm : float
        Where the object's axis meets the skin, from the middle of the pad: along the finger, distal positive,
        and across. [mm]
    tilt_deg : float
        0 is perpendicular to the long axis of the finger; without it, perpendicular to the skin. [degrees]
    spin_deg : float
        Turn about the direction of pressing. [degrees]
    """

    x_mm: FiniteNumber = 0.0
    z_mm: FiniteNumber = 0.0
    tilt_deg: FiniteNumber | None = None
    spin_deg: FiniteNumber = 0.0


class RateWindowSettings(Part):
    """Windows in which spikes count.

    Parameters
    ----------
    dynamic, static : (float, float)
        Start and end of the windows of the two rates; without them they follow the phases. [ms]
    """

    dynamic: Pair | None = None
    static: Pair | None = None


class AfferentsSettings(PopulationSettings):
    """The afferents that respond.

    Parameters
    ----------
    afferent : AfferentSettings or str
        "default", the one that was fitted with the tissues; a file of results (`fit.json` of `fingerpad fit`,
        `results.json` of `fingerpad reproduce`); or numbers.
    noise : float
        Width of a soft threshold over the threshold: spikes are random, drawn with `seed`. 0 is a sharp
        threshold without randomness.
    windows_ms : RateWindowSettings
        When spikes count.
    """

    afferent: AfferentChoice = DEFAULT
    noise: NotNegative = 0.0
    windows_ms: RateWindowSettings = RateWindowSettings()


class TouchDescription(Part):
    """All that a file of one touch holds.

    Parameters
    ----------
    title : str
        What it is, in words: the title of the page.
    resolution : {"quick", "standard", "paper"}
        How fine mesh and steps are.
    finger : mapping or str
        Whose: a preset such as "child", the sizes of `fingerpad.Fingertip.of`, `kind: outline` with those of
        `fingerpad.Fingertip`, or `kind: mesh` with the parameters of `fingerpad.read_finger`.
    tissues : str
        A set of tissues by name, as of `fingerpad.indent`.
    object : mapping or str
        What is pressed in: `kind` and its sizes, or a text such as "sphere:radius_mm=3.5".
    motion : mapping
        How: `kind` and its numbers; a ramp and hold by default.
    place : PlaceSettings
        Where, and in which direction.
    friction : float
        Coulomb's coefficient between skin and object.
    times_ms : list of float
        Times at which the result is wanted beside those that the motion has. [ms]
    afferents : AfferentsSettings
        Who responds.
    outputs : list of str
        What is written, by the names of `OUTPUTS`.

    Examples
    --------
    >>> touch = TouchDescription.model_validate({"object": {"kind": "sphere", "radius_mm": 4}})
    >>> touch.object.made()
    Sphere(curvature_per_m=250.0)
    """

    title: Text = "One touch"
    resolution: Annotated[str, choice_of(RESOLUTIONS)] = "quick"
    finger: FingerPart = Field(default_factory=lambda: finger_part({}))
    tissues: Annotated[str, choice_of(TISSUES)] = DEFAULT_TISSUES
    object: ObjectPart
    motion: MotionPart = Field(default_factory=lambda: motion_of({}))
    place: PlaceSettings = PlaceSettings()
    friction: NotNegative = 0.0
    times_ms: Numbers = ()
    afferents: AfferentsSettings = AfferentsSettings()
    outputs: Annotated[
        tuple[Annotated[str, choice_of(OUTPUTS)], ...],
        Strict(False),
        Field(min_length=1),
        BeforeValidator(as_list),
    ] = ("figures", "csv", "spikes")


@dataclass(frozen=True)
class DescribedTouch:
    """A description of a touch with where it comes from: what it takes to press it.

    Parameters
    ----------
    description : TouchDescription
        The description.
    source : str
        File of the description, with which errors begin: files that it names are searched beside it.
    text : str, optional
        Content of that file, for the lines of errors.
    """

    description: TouchDescription
    source: str = "touch"
    text: str = ""

    @property
    def beside(self) -> Path:
        """Folder from which the description names files."""
        return Path(self.source).parent

    @contextmanager
    def placed(self, *place: str | int) -> Iterator[None]:
        """Put file, line and key in front of an `InputError` from within."""
        try:
            yield
        except InputError as error:
            key = f"{spelled(place)}: " if place else ""
            raise InputError(f"{_located(self.source, self.text, place)}, {key}{error}") from error

    @cached_property
    def finger(self) -> Finger:
        """The finger.

        Raises
        ------
        InputError
            If it is impossible, with its place in the file.
        """
        with self.placed("finger"):
            return finger_of(self.description.finger, self.beside)

    @cached_property
    def touch(self) -> Touch:
        """The touch, described for the solver.

        Raises
        ------
        InputError
            If a part is impossible, with its place in the file.
        """
        asked, finger = self.description, self.finger
        with self.placed("object"):
            indenter = object_of(asked.object, self.beside)
        with self.placed("motion"):
            motion = asked.motion.made(self.beside)
        tilt_deg = asked.place.tilt_deg
        x, z = finger.contact_mm
        with self.placed():
            return touch_of(
                finger,
                indenter,
                motion,
                asked.tissues,
                asked.resolution,
                (x + asked.place.x_mm, z + asked.place.z_mm),
                tilt_deg=straight_tilt_deg(finger, indenter) if tilt_deg is None else tilt_deg,
                friction=asked.friction,
                spin_deg=asked.place.spin_deg,
                times_ms=asked.times_ms,
            )

    @cached_property
    def population(self) -> Population:
        """The afferents.

        Raises
        ------
        InputError
            If they cannot be, or a window of rates has no phase, with its place in the file.
        """
        asked = self.description.afferents
        with self.placed():
            afferent = afferent_of(asked.afferent, self.description.tissues, self.beside)
            laid = population_of(asked, afferent, "afferents", self.finger)
        with self.placed("afferents", "windows_ms"):
            phases = self.touch.stimulus.phases
            for window in rate_windows_ms(phases, asked.windows_ms.dynamic, asked.windows_ms.static):
                window_bounds(window)
        return laid

    def input_hashes(self) -> dict[str, str]:
        """SHA-256 of the description and of the files that it names."""
        asked = self.description
        named = [
            self.beside / value
            for part in (asked.object, asked.motion)
            for key, value in getattr(part, "given", {}).items()
            if key in getattr(part, "files", ())
        ]
        if isinstance(asked.afferents.afferent, str) and asked.afferents.afferent != DEFAULT:
            named.append(self.beside / asked.afferents.afferent)
        contents = {self.source: self.text.encode()} | {str(path): path.read_bytes() for path in named}
        return {name: hashlib.sha256(content).hexdigest() for name, content in contents.items()}


def read_touch_description(source: str | Path) -> DescribedTouch:
    r"""Read the description of a touch from a YAML file.

    Parameters
    ----------
    source : str or Path
        The file; docs/touch.md explains its keys, and `fingerpad init` writes an example.

    Returns
    -------
    DescribedTouch

    Raises
    ------
    InputError
        If it is no YAML, or a key is unknown, missing or has an unfit value; with line and key.

    Examples
    --------
    >>> from tempfile import TemporaryDirectory
    >>> with TemporaryDirectory() as folder:
    ...     path = Path(folder) / "touch.yaml"
    ...     _ = path.write_text("object: sphere\nmotion: {depth_mm: 0.5}", encoding="utf-8")
    ...     read_touch_description(path).touch.stimulus
    RampAndHold(depth_mm=0.5, ramp_ms=50.0, hold_ms=950.0)
    """
    text = read_text(Path(source))
    return described_touch(read_yaml(text, str(source)), str(source), text)


def described_touch(
    content: Mapping[str, Any] | Any, source: str = "touch", text: str = ""
) -> DescribedTouch:
    """Build the description of a touch from plain values; arguments as of `DescribedTouch`."""
    try:
        return DescribedTouch(TouchDescription.model_validate(content), source, text)
    except ValidationError as error:
        located = _located(source, text, place_of(error))
        raise InputError(f"{located}, {error_sentence(error, TouchDescription)}") from error


def _located(source: str, text: str, place: Sequence[str | int]) -> str:
    """File and line, where it is known, of a place."""
    line = line_at(text, place) if text else None
    return source if line is None else f"{source}, line {line}"
