"""Requests of a touch, of afferents that respond to one, and of a reduced touch; what a press will take.

docs/touch.md and docs/reduced.md explain every key.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from functools import cached_property
from pathlib import Path
from typing import Annotated, ClassVar, Literal

import numpy as np
from pydantic import BeforeValidator, Field, Strict

from fingerpad.core.checked import result_class
from fingerpad.core.errors import InputError
from fingerpad.core.signals import ResponseMap
from fingerpad.core.values import Number, Numbers, Pair, Positive, Seed, Text, choice, some_of
from fingerpad.data.tissues import DEFAULT_TISSUES
from fingerpad.experiments.requests.afferents import (
    AFFERENT_OBJECTS,
    Afferents,
    AfferentsSettings,
    check_windows,
    files_of,
    population_of,
    respond_to,
)
from fingerpad.experiments.requests.parts import BlockOrObject, Part, Request, as_list, at
from fingerpad.experiments.requests.stimulus import FINGER_OBJECTS, FingerRequest, StimulusDescription
from fingerpad.experiments.runner import Manifest, Runner
from fingerpad.mechanics.press_settings import MOST_SOLVED
from fingerpad.neuron.population import Population
from fingerpad.neuron.spikes import rate_windows_ms
from fingerpad.reduction.building import KEPT, reduce_touch
from fingerpad.reduction.model import ReducedModel
from fingerpad.reduction.training import ReducedRange, ReducedTraining
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
    python: ClassVar[tuple[str, ...]] = (*FINGER_OBJECTS, "object", "motion", *AFFERENT_OBJECTS)

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
    main: ClassVar[str] = "touch"
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
    times: int  #: Size of the mesh, and number of times.
    end_ms: Number  #: End of the motion. [ms]
    largest_force_mn: Number
    largest_depth_mm: Number
    largest_contact_mm2: Number  #: Over time. [mN], [mm], [mm²]
    afferents: int
    firing: int  #: How many, and how many fire at all.
    dynamic_rate_hz: Number
    static_rate_hz: Number  #: Largest firing rates in the two windows. [spikes/s]


@result_class
class TouchFile:
    """The file `touch.json`."""

    format: Literal["fingerpad touch result"] = "fingerpad touch result"
    format_version: Literal[1] = 1  #: By which a reader knows the file.
    touch: TouchRequest  #: What was described.
    summary: TouchSummary  #: What it did.
    manifest: Manifest  #: What ran.


@dataclass(frozen=True)
class TouchResult:
    """What became of a touch: the responses of skin and afferents."""

    request: TouchRequest  #: What was asked.
    skin: SkinResponse  #: Response of the skin; with all nodes and elements if it was pressed `whole`.
    response: ResponseMap  #: Responses of the afferents.
    manifest: Manifest  #: What ran.

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


NO_WAY = (0.0, 0.0)


class RangeSettings(Part):
    """Poses that the reduced touch serves."""

    depth_mm: Positive  #: Largest depth below first touch at any pose. [mm]
    x_mm: Pair = NO_WAY
    z_mm: Pair = NO_WAY  #: Ways of the object along and across the finger, from its place. [mm]
    tilt_deg: Pair = NO_WAY  #: Tilt, added to that of the place. [degrees]
    parameter: Text | None = None
    """A parameter of the object that varies, such as `curvature_per_m` of a sphere."""
    values: Pair | None = None  #: Its range.


class ReductionRequest(StimulusDescription, FingerRequest):
    """A touch to be reduced, as `fingerpad.reduce` presses it and a file describes it."""

    word: ClassVar[str] = "range"
    python: ClassVar[tuple[str, ...]] = (*FINGER_OBJECTS, "object", *AFFERENT_OBJECTS)

    range: RangeSettings  #: The poses.
    afferents: Afferents = AfferentsSettings()  #: Who will respond: what they follow is kept.
    quantities: Annotated[tuple[str, ...], Strict(False), BeforeValidator(as_list)] = KEPT
    """What is kept beside that, by the names of `SkinResponse.sample`; by default compressive stress,
    strain energy density and von Mises stress."""
    calibration: Annotated[int, Field(ge=0)] = 20
    """Number of random touches from which the error is measured: 0 for none, else 19 or more."""
    seed: Seed = 1  #: Of these touches.

    @cached_property
    def training(self) -> ReducedTraining:
        """Its presses."""
        with self.origin.located():
            with at("motion"):
                if "motion" in self.model_fields_set:
                    raise InputError(
                        "motion", "must be left out", remedy="a reduced touch serves any motion in its range"
                    )
            pressed = self.pressed_finger, self.scaled_tissues, self.resolution, self.grading
            touch = self.stimulus(self.beside).touch(*pressed)
            with at("range"):
                training = ReducedTraining(
                    touch, ReducedRange(**dict(self.range)), self.resolution, self.grading
                )
                # All poses are described, and so checked, before anything is pressed.
                list(training.poses())
        return training

    @cached_property
    def population(self) -> Population:
        """The afferents."""
        with self.origin.located():
            if self.afferents.depth_mm is not None:
                raise InputError(
                    ("afferents", "depth_mm"),
                    "must be left out, because a reduced touch keeps the border of the epidermis alone",
                )
            return population_of(self.afferents, self.tissues, self.beside, self.pressed_finger)

    @property
    def kept(self) -> tuple[str, ...]:
        """What is kept: the quantities, and what the afferents follow."""
        parts = self.population.parts.values() or [self.population]
        return tuple(dict.fromkeys([*self.quantities, *(name for part in parts for name in part.quantities)]))

    def check(self) -> None:
        """Raise `InputError` if a pose is impossible; before anything is solved."""
        self.training, self.population  # noqa: B018

    def run(self, runner: Runner) -> ReducedModel:
        """Press what the store of a runner lacks, and make the reduced touch."""

        def solve(touches: Sequence[Touch], stage: str) -> list[SkinResponse]:
            found = runner.responses({stage: dict(enumerate(touches))})[stage]
            return [found[number] for number in range(len(touches))]

        self.check()
        return reduce_touch(
            self.training, solve, calibration=self.calibration, seed=self.seed, quantities=self.kept
        )


STEP_S = 3.0e-5
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
    steps: int  #: Size of the mesh, and number of steps that are solved at least.
    time_s: float
    memory_mb: float  #: Time on two cores with compiled kernels, and memory of the process. [s], [MB]
    by_force: bool = False  #: Whether the force is given, so that the depth is not known before the press.

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
    times_ms = touch.steps_ms()
    inside = np.count_nonzero((times_ms > cycles.start_ms) & (times_ms <= cycles.end_ms))
    return int(inside * (cycles.count - MOST_SOLVED) / cycles.count)


def estimate_press(touch: Touch) -> PressEstimate:
    """Estimate a press from the sizes of its mesh and its steps; the mesh is built for it."""
    nodes = len(touch.mesh.nodes_mm)
    steps = touch.steps_ms().size - 1 - _interpolated_steps(touch)
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
