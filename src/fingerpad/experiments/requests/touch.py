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
from fingerpad.core.signals import ResponseMap, window_bounds
from fingerpad.core.values import Number, Numbers, Text, choice, some_of
from fingerpad.data.tissues import DEFAULT_TISSUES
from fingerpad.experiments import schemas
from fingerpad.experiments.manifest import Manifest
from fingerpad.experiments.requests.afferents import (
    Afferents,
    AfferentsSettings,
    check_noise,
    file_of,
    population_of,
    respond_to,
)
from fingerpad.experiments.requests.parts import BlockOrObject, Request, at
from fingerpad.experiments.requests.stimulus import (
    FINGER_OBJECTS,
    FingerDescription,
    StimulusDescription,
    finger_of,
    named_files,
)
from fingerpad.experiments.runner import Runner
from fingerpad.geometry.fingertip import Finger
from fingerpad.mechanics.press_settings import MOST_SOLVED
from fingerpad.neuron.population import Population
from fingerpad.neuron.spikes import rate_windows_ms
from fingerpad.skin.indentation import Touch
from fingerpad.skin.sampling import SkinResponse

OUTPUTS = ("figures", "csv", "spikes", "npz", "netcdf", "zarr", "nwb", "vtu", "abaqus", "calculix", "febio")
"""What can be written of a touch."""

MODULI = ("long_term", "instantaneous")

WHOLE = ("netcdf", "zarr", "vtu")  # Outputs that hold all nodes and elements over time.


class TouchRequest(Request, StimulusDescription, FingerDescription):
    """A touch, as `fingerpad.touch` presses it and a file describes it.

    Parameters
    ----------
    title : str
        What it is, in words: the title of the page.
    resolution, finger, tissues, stiffness, grading
        As of `FingerDescription`.
    object, motion, place, friction
        As of `StimulusDescription`.
    times_ms : list of float
        Times at which the result is wanted beside those that the motion has. [ms]
    afferents : AfferentsSettings
        Who responds.
    outputs : list of str
        What is written, by the names of `OUTPUTS`.
    elastic_moduli : str
        For calculix, which has no relaxation: the moduli of the layers, "long_term" or "instantaneous".

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

    title: Text = "One touch"
    times_ms: Numbers = ()
    afferents: Afferents = AfferentsSettings()
    outputs: Annotated[tuple[str, ...], some_of(OUTPUTS)] = ("figures", "csv", "spikes")
    elastic_moduli: Annotated[str, choice(MODULI)] = MODULI[0]

    @cached_property
    def pressed_finger(self) -> Finger:
        """The finger."""
        with self.origin.located(), at("finger"):
            return finger_of(self.finger, self.beside)

    @cached_property
    def touch(self) -> Touch:
        """The touch, described for the solver."""
        with self.origin.located():
            made = self.stimulus(self.beside)
            pressed = self.pressed_finger, self.scaled_tissues, self.resolution
            depths_mm = self._laid.kept_depths_mm
            return made.touch(*pressed, self.grading, self.times_ms, receptor_depths_mm=depths_mm)

    @cached_property
    def _laid(self) -> Population:
        with self.origin.located():
            return population_of(self.afferents, self.tissues, self.beside, self.pressed_finger)

    @cached_property
    def population(self) -> Population:
        """The afferents."""
        laid = self._laid
        with self.origin.located():
            check_noise(self.afferents, laid)
        with self.origin.located(), at("afferents", "windows_ms"):
            for window in rate_windows_ms(self.touch.stimulus.phases, *self.afferents.windows_ms.both):
                window_bounds(window)
        return laid

    def check(self) -> None:
        """Raise `InputError` if the touch is impossible."""
        self.touch, self.population  # noqa: B018

    def pressed_as(self, other: TouchRequest) -> TouchRequest:
        """Take over the finger and the touch of a request that differs in its afferents alone."""
        same = self.changed()
        same.__dict__.update(pressed_finger=other.pressed_finger, touch=other.touch)
        return same

    def respond(self, skin: SkinResponse) -> ResponseMap:
        """Responses of the afferents to a skin."""
        return respond_to(self.afferents, self.population, skin)

    def input_hashes(self) -> dict[str, str]:
        """SHA-256 of the request and of the files that it names."""
        named = [*named_files(self.finger, self.beside), *self.files(self.beside)]
        if file := file_of(self.afferents.afferent):
            named.append(self.beside / file)
        return self.origin.hashes(named)

    def run(self, runner: Runner, command: str | None = None) -> TouchResult:
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
            self.conditions(self.afferents.seed, self.beside),
            {"touch": skin.mesh},
            half_model=not self.touch.grading.full,
            command=command,
            inputs=self.input_hashes(),
        )
        return TouchResult(self, skin, response, manifest)


class RespondRequest(Request, AfferentsSettings):
    """Afferents that respond to a touch, as `fingerpad.respond` lets them and a file describes it.

    Parameters
    ----------
    touch : SkinResponse, TouchResult, TouchRequest, mapping, str or Path
        A solved touch; or one that is pressed first, or loaded from where it is stored.
    layout, density_per_cm2, afferent, population, noise, windows_ms and the others
        As of `AfferentsSettings`, the block `afferents` of a touch.
    """

    word: ClassVar[str] = "afferents"
    python: ClassVar[tuple[str, ...]] = ("afferent", "population")

    touch: BlockOrObject

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

    def run(self, runner: Runner, command: str | None = None) -> ResponseMap:
        """Press the touch if it is not solved, and let the afferents respond."""
        skin = self.pressed
        if isinstance(skin, TouchRequest):
            skin = runner.responses({"press": {"touch": skin.touch}})["press"]["touch"]
        finger = None if skin.touch is None else skin.touch.finger
        named = skin.tissues_name or (DEFAULT_TISSUES if skin.touch is None else skin.touch.tissues)
        with self.origin.located():
            population = population_of(self, named, self.beside, finger, place="")
            check_noise(self, population)
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


STEP_S = 1.8e-5
"""Time of a step per node, by depth, straight and without friction, on two cores with compiled kernels: mean
of benchmarks/results/growth.json. [s]"""

BY_FORCE, WITH_FRICTION, ASIDE, ASIDE_WITH_FRICTION = 3.0, 3.1, 3.2, 5.1
"""Factors of that time for a press by force, with friction, and aside; measured on ten presses."""

BASE_MB, NODE_MB, NODE_EXPONENT = 200.0, 0.043, 0.865
"""Memory of a process: with its libraries, and of n nodes, `NODE_MB` n^`NODE_EXPONENT`. [MB]"""

OWN_NODES, OWN_NODE_MB, OWN_EXPONENT = 1200.0, 2.8e-3, 4 / 3
"""A mesh of one's own is solved by elimination: its time grows by the number of nodes over `OWN_NODES`, and
its memory by `OWN_NODE_MB` n^`OWN_EXPONENT`; measured at 3,249, 4,797 and 6,813 nodes. [MB]"""


@dataclass(frozen=True)
class PressEstimate:
    """What a press will take."""

    nodes: int
    elements: int
    steps: int  # Size of the mesh, and number of steps that are solved at least.
    time_s: float
    memory_mb: float  # Time on two cores with compiled kernels, and memory of the process. [s], [MB]
    by_force: bool = False  # Whether the force is given, so that the depth is not known before the press.

    @property
    def lines(self) -> tuple[str, ...]:
        """The estimate in words."""
        depth = " How deep this force presses, and whether into the bone, only the press shows."
        return (
            f"The touch is possible: {self.nodes} nodes, {self.elements} elements, {self.steps} steps.",
            f"A press will take about {self.time_s:.0f} s on two idle cores and {self.memory_mb:.0f} MB."
            f"{depth if self.by_force else ''}",
        )


def _interpolated_steps(touch: Touch) -> int:
    """Count the steps of equal cycles that are interpolated, at most."""
    cycles = touch.stimulus.cycles
    if cycles is None or cycles.count <= MOST_SOLVED:
        return 0
    if touch.friction or touch.settings.cycle_tolerance is None:
        return 0
    times_ms = touch.settings.steps_ms(touch.stimulus)
    inside = np.count_nonzero((times_ms > cycles.start_ms) & (times_ms <= cycles.end_ms))
    return int(inside * (cycles.count - MOST_SOLVED) / cycles.count)


def estimate_press(request: TouchRequest) -> PressEstimate:
    """Estimate a press from the sizes of its mesh and its steps; the mesh is built for it."""
    touch = request.touch
    nodes = len(touch.mesh.nodes_mm)
    steps = touch.settings.steps_ms(touch.stimulus).size - 1 - _interpolated_steps(touch)
    factor = BY_FORCE if touch.stimulus.by_force else 1.0
    if touch.friction:
        factor *= WITH_FRICTION if touch.stimulus.stays else ASIDE_WITH_FRICTION
    elif not touch.stimulus.stays:
        factor *= ASIDE
    own = touch.finger.own_mesh is not None
    if own:
        factor *= max(1.0, nodes / OWN_NODES)
    return PressEstimate(
        nodes=nodes,
        elements=len(touch.mesh.elements),
        steps=steps,
        time_s=STEP_S * nodes * steps * factor,
        memory_mb=(
            BASE_MB + NODE_MB * nodes**NODE_EXPONENT + (OWN_NODE_MB * nodes**OWN_EXPONENT if own else 0.0)
        ),
        by_force=touch.stimulus.by_force,
    )


EXAMPLE = f"""\
# yaml-language-server: $schema={schemas.TOUCH_SCHEMA}
#
# One touch. Try: fingerpad check touch.yaml, then fingerpad touch touch.yaml --out touch
# Keys that are left out have the values below or the paper's. docs/touch.md explains every key.

title: A ball on the finger pad

resolution: quick          # quick for a first look, standard for results
tissues: human             # a set of tissues; all others: docs/tissues.md
finger: adult              # small, large, child, macaque, aged; or measures:
# finger: {{length_mm: 24, width_mm: 18, height_mm: 15, stratum_corneum_mm: 0.5}}

object:
  kind: sphere             # cylinder, bar, line, punch, plate, edge, gap, grating, dots, braille,
                           # embossed, embossed_text, ridges, surface, height_map
  radius_mm: 4             # [mm]

motion:
  kind: ramp_and_hold      # sine, chirp, repeated, staircase, stroke, recorded, trajectory
  depth_mm: 0.8            # [mm]; or force_mn, in mN
  ramp_ms: 50
  hold_ms: 450

place:                     # from the middle of the finger pad
  x_mm: 0                  # along the finger, towards the tip
  z_mm: 0                  # across it
  spin_deg: 0              # turn about the direction of pressing

friction: 0                # Coulomb's coefficient between skin and object

afferents:
  layout: grid             # rectangular, hexagonal, uniform, jittered, poisson-disc, nail rows
  density_per_cm2: 100
  afferent: default        # the one that was fitted with the tissues, or fit.json of fingerpad fit
  noise: 0                 # width of a soft threshold over the threshold; 0 is without randomness
  seed: 0

outputs: [figures, csv, spikes]   # npz, netcdf, zarr, nwb, vtu, abaqus, calculix, febio
"""
