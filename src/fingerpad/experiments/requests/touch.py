"""A touch: one request with finger, tissues, object, motion, place, friction, afferents and outputs.

docs/touch.md explains every key.
"""

from __future__ import annotations

from dataclasses import dataclass
from functools import cached_property
from pathlib import Path
from typing import Annotated, ClassVar, Literal

import numpy as np

from fingerpad.core.checked import result_class
from fingerpad.core.signals import ResponseMap
from fingerpad.core.values import Number, Numbers, Text, choice, some_of
from fingerpad.data.tissues import DEFAULT_TISSUES
from fingerpad.experiments.requests.afferents import (
    Afferents,
    AfferentsSettings,
    check_windows,
    files_of,
    population_of,
    respond_to,
)
from fingerpad.experiments.requests.parts import BlockOrObject, Request, at
from fingerpad.experiments.requests.stimulus import FINGER_OBJECTS, FingerRequest, StimulusDescription
from fingerpad.experiments.runner import Manifest, Runner
from fingerpad.neuron.population import Population
from fingerpad.neuron.spikes import rate_windows_ms
from fingerpad.skin.indentation import Touch
from fingerpad.skin.sampling import SkinResponse

OUTPUTS = ("figures", "csv", "spikes", "npz", "netcdf", "zarr", "nwb", "vtu", "abaqus", "calculix", "febio")
"""What can be written of a touch."""

MODULI = ("long_term", "instantaneous")

WHOLE = ("netcdf", "zarr", "vtu")  # Outputs that hold all nodes and elements over time.


class TouchRequest(StimulusDescription, FingerRequest):
    """A touch, as `fingerpad.touch` presses it and a file describes it.

    Examples
    --------
    >>> touch = TouchRequest.read({"object": {"kind": "sphere", "radius_mm": 4}})
    >>> touch.touch.indenter
    Sphere(radius_mm=4.0)
    """

    word: ClassVar[str] = "touch"
    python: ClassVar[tuple[str, ...]] = (
        *FINGER_OBJECTS, "object", "motion", "afferents", "afferents.afferent", "afferents.population",
    )  # fmt: skip

    title: Text = "One touch"  #: What it is, in words: the title of the page.
    times_ms: Numbers = ()  #: Times at which the result is wanted beside those that the motion has. [ms]
    afferents: Afferents = AfferentsSettings()  #: Who responds.
    outputs: Annotated[tuple[str, ...], some_of(OUTPUTS)] = ("figures", "csv", "spikes")
    """What is written, by the names of `OUTPUTS`."""
    elastic_moduli: Annotated[str, choice(MODULI)] = MODULI[0]
    """For calculix, which has no relaxation: the moduli of the layers, "long_term" or "instantaneous"."""

    @cached_property
    def touch(self) -> Touch:
        """The touch, described for the solver."""
        with self.origin.located():
            made = self.stimulus(self.beside)
            pressed = self.pressed_finger, self.scaled_tissues, self.resolution
            depths_mm = self.population.kept_depths_mm
            return made.touch(*pressed, self.grading, self.times_ms, receptor_depths_mm=depths_mm)

    @cached_property
    def population(self) -> Population:
        """The afferents."""
        with self.origin.located():
            return population_of(self.afferents, self.tissues, self.beside, self.pressed_finger)

    def check(self) -> None:
        """Raise `InputError` if the touch is impossible."""
        stimulus = self.touch.stimulus
        with self.origin.located(), at("afferents"):
            windows_ms = rate_windows_ms(stimulus.phases, *self.afferents.windows_ms.both)
            check_windows(windows_ms, stimulus.end_ms)

    def pressed_as(self, other: TouchRequest) -> TouchRequest:
        """Take over the finger and the touch of a request that differs in its afferents alone."""
        same = self.changed()
        same.__dict__.update(pressed_finger=other.pressed_finger, touch=other.touch)
        return same

    def respond(self, skin: SkinResponse) -> ResponseMap:
        """Responses of the afferents to a skin."""
        return respond_to(self.afferents, self.population, skin)

    def further_files(self) -> list[Path]:
        """Files of the object, the motion and the afferent."""
        return [*self.files(self.beside), *files_of(self.afferents.afferent, self.beside)]

    def run(self, runner: Runner) -> TouchResult:
        """Press the touch, or load it from where it is stored, and let the afferents respond."""
        self.check()
        if not set(WHOLE).isdisjoint(self.outputs):
            with runner.stage("press", 1) as advance:
                skin = self.touch.solve(whole=True)
                runner.store.save(self.touch, skin)
                advance()
            runner.note([skin])
        else:
            skin = runner.responses({"press": {"touch": self.touch}})["press"]["touch"]
        with runner.stage("afferents", 1) as advance:
            response = self.respond(skin)
            advance()
        manifest = runner.manifest(
            self.conditions(self.pressed_finger, self.afferents.seed),
            {"touch": skin.mesh},
            half_model=not self.touch.grading.full,
            inputs=self.input_hashes(),
        )
        return TouchResult(self, skin, response, manifest)


class RespondRequest(Request, AfferentsSettings):
    """Afferents that respond to a touch, as `fingerpad.respond` lets them and a file describes it."""

    word: ClassVar[str] = "afferents"
    python: ClassVar[tuple[str, ...]] = ("afferent", "population")

    touch: BlockOrObject  #: A solved touch; or one that is pressed first, or loaded from where it is stored.

    def check(self) -> None:
        """Raise `InputError` if the touch or the afferents are impossible; before anything is solved."""
        if isinstance(self.pressed, TouchRequest):
            self.pressed.check()

    @cached_property
    def pressed(self) -> TouchRequest | SkinResponse:
        """The touch, solved or not."""
        with self.origin.located(), at("touch"):
            if isinstance(self.touch, TouchResult):
                return self.touch.skin
            if isinstance(self.touch, SkinResponse | TouchRequest):
                return self.touch
            source = self.beside / self.touch if isinstance(self.touch, str | Path) else self.touch
            return TouchRequest.read(source, allow_python=self._allow_python)

    def run(self, runner: Runner) -> ResponseMap:
        """Press the touch if it is not solved, and let the afferents respond."""
        skin = self.pressed
        if isinstance(skin, TouchRequest):
            skin = runner.responses({"press": {"touch": skin.touch}})["press"]["touch"]
        finger = None if skin.touch is None else skin.touch.finger
        named = skin.tissues_name or (DEFAULT_TISSUES if skin.touch is None else skin.touch.tissues)
        with self.origin.located():
            population = population_of(self, named, self.beside, finger, place=())
        return respond_to(self, population, skin)


@result_class
class TouchSummary:
    """What a touch did, in a few numbers."""

    nodes: int
    times: int  # Size of the mesh, and number of times.
    end_ms: Number  # End of the motion. [ms]
    largest_force_mn: Number
    largest_depth_mm: Number
    largest_contact_mm2: Number  # Over time. [mN], [mm], [mm²]
    afferents: int
    firing: int  # How many, and how many fire at all.
    dynamic_rate_hz: Number
    static_rate_hz: Number  # Largest firing rates in the two windows. [spikes/s]


@result_class
class TouchFile:
    """The file `touch.json`."""

    format: Literal["fingerpad touch result"] = "fingerpad touch result"
    format_version: Literal[1] = 1  # By which a reader knows the file.
    touch: TouchRequest  # What was described.
    summary: TouchSummary  # What it did.
    manifest: Manifest  # What ran.


@dataclass(frozen=True)
class TouchResult:
    """What became of a touch: the responses of skin and afferents."""

    request: TouchRequest  # What was asked.
    skin: SkinResponse  # Response of the skin; with all nodes and elements if it was pressed `whole`.
    response: ResponseMap  # Responses of the afferents.
    manifest: Manifest  # What ran.

    @property
    def summary(self) -> TouchSummary:
        """The touch in a few numbers."""
        skin, response = self.skin, self.response
        return TouchSummary(
            nodes=len(skin.mesh.nodes_mm),
            times=skin.times_ms.size,
            end_ms=float(skin.times_ms[-1]),
            largest_force_mn=float(skin.force_mn.max()),
            largest_depth_mm=float(skin.depth_mm.max()),
            largest_contact_mm2=float(skin.fields["contact_area_mm2"].max()),
            afferents=len(response.positions_mm),
            firing=int(np.count_nonzero(np.isfinite(response.first_spike_latency_ms))),
            dynamic_rate_hz=float(response.dynamic_rate_hz.max()),
            static_rate_hz=float(response.static_rate_hz.max()),
        )

    @property
    def result(self) -> TouchFile:
        """Content of `touch.json`."""
        return TouchFile(touch=self.request, summary=self.summary, manifest=self.manifest)
