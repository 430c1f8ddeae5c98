"""One touch in one file: finger, tissues, object, motion, place, friction, afferents and outputs.

docs/touch.md explains every key.
"""

from __future__ import annotations

import hashlib
from dataclasses import dataclass
from functools import cached_property
from pathlib import Path
from typing import Annotated, Any

from fingerpad.core.checked import checked
from fingerpad.core.errors import InputError
from fingerpad.core.files import path_of, read_text
from fingerpad.core.plain_yaml import read_yaml
from fingerpad.core.signals import window_bounds
from fingerpad.core.values import NotNegative, Numbers, Pair, Positive, Text, some_of
from fingerpad.experiments.descriptions.parts import DEFAULT, AfferentChoice, PopulationSettings, file_of
from fingerpad.experiments.descriptions.population import population_of
from fingerpad.experiments.descriptions.pressing import finger_of, named_files
from fingerpad.experiments.descriptions.reading import Origin, at, part_from
from fingerpad.experiments.descriptions.stimulus import FingerDescription, StimulusDescription
from fingerpad.experiments.descriptions.values import Content, Part
from fingerpad.geometry.fingertip import Finger
from fingerpad.mechanics.tissues import named_tissues
from fingerpad.neuron.afferent import Afferent
from fingerpad.neuron.population import Population
from fingerpad.neuron.spikes import rate_windows_ms
from fingerpad.skin.indentation import Touch

OUTPUTS = ("figures", "csv", "spikes", "npz", "netcdf", "zarr", "nwb", "vtu", "abaqus", "calculix", "febio")
"""What can be written of a touch."""


class RateWindowSettings(Part):
    """Windows in which spikes count."""

    dynamic: Pair | None = None
    """Start and end of the windows of the two rates; without them they follow the phases. [ms]"""
    static: Pair | None = None
    """Start and end of the windows of the two rates; without them they follow the phases. [ms]"""


class AfferentsSettings(PopulationSettings):
    """The afferents that respond."""

    afferent: AfferentChoice = DEFAULT
    """"default", the one that was fitted with the tissues; a type by its name, SAI, RA, PC or SAII; a file of
    results (`fit.json` of `fingerpad fit`, `results.json` of `fingerpad reproduce`); or numbers."""
    noise: NotNegative = 0.0
    """Width of a soft threshold over the threshold: spikes are random, drawn with `seed`. 0 is a sharp
    threshold without randomness."""
    windows_ms: RateWindowSettings = RateWindowSettings()
    """When spikes count."""


class TouchDescription(StimulusDescription, FingerDescription):
    """All that a file of one touch holds.

    Parameters
    ----------
    title : str
        What it is, in words: the title of the page.
    resolution, finger, tissues
        As of `FingerDescription`.
    object, motion, place, friction
        As of `StimulusDescription`.
    stiffness : float
        Factor of the moduli of all tissues.
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
    Sphere(radius_mm=4.0)
    """

    title: Text = "One touch"
    stiffness: Positive = 1.0
    times_ms: Numbers = ()
    afferents: AfferentsSettings = AfferentsSettings()
    outputs: Annotated[tuple[str, ...], some_of(OUTPUTS)] = ("figures", "csv", "spikes")


@dataclass(frozen=True)
class DescribedTouch:
    """A description of a touch with where it comes from: what it takes to press it."""

    description: TouchDescription
    """The description."""
    source: str = "touch"
    """File of the description, with which errors begin: files that it names are searched beside it."""
    text: str = ""
    """Content of that file, for the lines of errors."""

    @property
    def origin(self) -> Origin:
        """Where it comes from, for errors."""
        return Origin(self.source, self.text)

    @cached_property
    def finger(self) -> Finger:
        with self.origin.located(), at("finger"):
            return finger_of(self.description.finger, self.origin.beside)

    @cached_property
    def touch(self) -> Touch:
        """The touch, described for the solver."""
        asked = self.description
        with self.origin.located():
            made = asked.stimulus(self.origin.beside)
            named = asked.tissues
            tissues = named if asked.stiffness == 1.0 else named_tissues(named).scaled(asked.stiffness)
            return made.touch(self.finger, tissues, asked.resolution, times_ms=asked.times_ms)

    @cached_property
    def population(self) -> Population:
        """The afferents."""
        asked = self.description.afferents
        with self.origin.located():
            tissues, beside = self.description.tissues, self.origin.beside
            laid = population_of(asked, asked.afferent, tissues, beside, "afferents", self.finger)
            if asked.noise > 0.0 and type(getattr(laid, "afferent", None)) is not Afferent:
                raise InputError(
                    "afferents.noise",
                    "must be 0 for other types and mixed populations, because a soft threshold is that of "
                    "the default afferent alone",
                    f"{asked.noise:g}",
                )
        with self.origin.located(), at("afferents", "windows_ms"):
            phases = self.touch.stimulus.phases
            for window in rate_windows_ms(phases, asked.windows_ms.dynamic, asked.windows_ms.static):
                window_bounds(window)
        return laid

    def pressed_as(self, other: DescribedTouch) -> DescribedTouch:
        """Take over the finger and the touch of a description that differs in its afferents alone."""
        same = DescribedTouch(self.description, self.source, self.text)
        same.__dict__.update(finger=other.finger, touch=other.touch)  # what cached_property would compute
        return same

    def input_hashes(self) -> dict[str, str]:
        """SHA-256 of the description and of the files that it names."""
        asked = self.description
        beside = self.origin.beside
        named = [*named_files(asked.finger, beside), *asked.files(beside)]
        if file := file_of(asked.afferents.afferent):
            named.append(beside / file)
        contents = {self.source: self.text.encode()} | {str(path): path.read_bytes() for path in named}
        return {name: hashlib.sha256(content).hexdigest() for name, content in contents.items()}


@checked
def read_touch_description(source: str | Path) -> DescribedTouch:
    r"""Read the description of a touch from a YAML file.

    Parameters
    ----------
    source : str or Path
        The file; docs/touch.md explains its keys, and `fingerpad init` writes an example.

    Examples
    --------
    >>> from tempfile import TemporaryDirectory
    >>> with TemporaryDirectory() as folder:
    ...     path = Path(folder) / "touch.yaml"
    ...     _ = path.write_text("object: sphere\nmotion: {depth_mm: 0.5}", encoding="utf-8")
    ...     read_touch_description(path).touch.stimulus
    RampAndHold(depth_mm=0.5, ramp_ms=50.0, hold_ms=950.0)
    """
    text = read_text(path_of("source", source))
    return described_touch(read_yaml(text, str(source)), str(source), text)


def described_touch(content: Content | Any, source: str = "touch", text: str = "") -> DescribedTouch:
    """Build the description of a touch from plain values; arguments as of `DescribedTouch`."""
    with Origin(source, text).located():
        if content is None:
            raise InputError("the file is empty: write what is pressed, as the example of `fingerpad init`.")
        return DescribedTouch(part_from(TouchDescription, content), source, text)
