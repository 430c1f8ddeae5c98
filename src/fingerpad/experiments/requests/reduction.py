"""A touch to be reduced: one request in the words of a touch without a motion, with a range of poses."""

from __future__ import annotations

from collections.abc import Sequence
from functools import cached_property
from typing import Annotated, ClassVar

from pydantic import BeforeValidator, Field, Strict

from fingerpad.core.errors import InputError
from fingerpad.core.signals import STORED_ENERGY
from fingerpad.core.values import Pair, Positive, Seed, Text
from fingerpad.data import neuron
from fingerpad.experiments.requests.afferents import Afferents, AfferentsSettings, population_of
from fingerpad.experiments.requests.parts import Part, as_list, at
from fingerpad.experiments.requests.stimulus import FINGER_OBJECTS, FingerRequest, StimulusDescription
from fingerpad.experiments.runner import Runner
from fingerpad.neuron.population import Population
from fingerpad.reduction.building import reduce_touch
from fingerpad.reduction.model import ReducedModel
from fingerpad.reduction.training import ReducedRange, ReducedTraining
from fingerpad.skin.indentation import Touch
from fingerpad.skin.sampling import SkinResponse

KEPT = (neuron.HUMAN_QUANTITY, STORED_ENERGY)  # What every reduced touch keeps.
NO_WAY = (0.0, 0.0)


class RangeSettings(Part):
    """Poses that the reduced touch serves."""

    depth_mm: Positive  # Largest depth below first touch at any pose. [mm]
    x_mm: Pair = NO_WAY
    z_mm: Pair = NO_WAY  # Ways of the object along and across the finger, from its place. [mm]
    tilt_deg: Pair = NO_WAY  # Tilt, added to that of the place. [degrees]
    parameter: Text | None = None
    """A parameter of the object that varies, such as `curvature_per_m` of a sphere."""
    values: Pair | None = None  # Its range.


class ReductionRequest(StimulusDescription, FingerRequest):
    """A touch to be reduced, as `fingerpad.reduce` presses it and a file describes it."""

    word: ClassVar[str] = "range"
    python: ClassVar[tuple[str, ...]] = (
        *FINGER_OBJECTS, "object", "afferents", "afferents.afferent", "afferents.population",
    )  # fmt: skip

    range: RangeSettings  #: The poses.
    afferents: Afferents = AfferentsSettings()  #: Who will respond: what they follow is kept.
    quantities: Annotated[tuple[str, ...], Strict(False), BeforeValidator(as_list)] = KEPT
    """What is kept beside that, by the names of `SkinResponse.sample`; by default compressive stress and
    strain energy density."""
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
