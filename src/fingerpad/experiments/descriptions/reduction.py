"""A touch to be reduced, in one file: the words of a touch without a motion, and a range of poses."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from pathlib import Path
from typing import Annotated, Any

from pydantic import Field

from fingerpad.core.errors import InputError
from fingerpad.core.files import path_of, read_text
from fingerpad.core.plain_yaml import read_yaml
from fingerpad.core.values import Pair, Positive, Seed, Text
from fingerpad.experiments.descriptions.pressing import finger_of
from fingerpad.experiments.descriptions.reading import Origin, at, part_from
from fingerpad.experiments.descriptions.stimulus import FingerDescription, StimulusDescription
from fingerpad.experiments.descriptions.values import Content, Part
from fingerpad.experiments.runner import Runner
from fingerpad.reduction.building import reduce_touch
from fingerpad.reduction.model import ReducedModel
from fingerpad.reduction.training import ReducedRange, ReducedTraining
from fingerpad.skin.indentation import Touch
from fingerpad.skin.sampling import SkinResponse

NO_WAY = (0.0, 0.0)


class RangeSettings(Part):
    """Poses that the reduced touch serves."""

    depth_mm: Positive
    """Largest depth below first touch at any pose. [mm]"""
    x_mm: Pair = NO_WAY
    """Ways of the object along and across the finger, from its place. [mm]"""
    z_mm: Pair = NO_WAY
    """Ways of the object along and across the finger, from its place. [mm]"""
    tilt_deg: Pair = NO_WAY
    """Tilt, added to that of the place. [degrees]"""
    parameter: Text | None = None
    """A parameter of the object that varies, such as `curvature_per_m` of a sphere."""
    values: Pair | None = None
    """Its range."""


class ReductionDescription(StimulusDescription, FingerDescription):
    """All that a file of `fingerpad reduce` holds."""

    range: RangeSettings
    """The poses."""
    calibration: Annotated[int, Field(ge=0)] = 20
    """Number of random touches from which the error is measured: 0 for none, else 19 or more."""
    seed: Seed = 1
    """Of these touches."""


@dataclass(frozen=True)
class DescribedReduction:
    """A description of a reduced touch, ready to be pressed."""

    description: ReductionDescription
    """The description."""
    training: ReducedTraining
    """Its presses."""


def read_reduction(source: str | Path) -> DescribedReduction:
    """Read the description of a reduced touch from a YAML file."""
    text = read_text(path_of("source", source))
    return described_reduction(read_yaml(text, str(source)), str(source), text)


def described_reduction(content: Content | Any, source: str = "range", text: str = "") -> DescribedReduction:
    """Build the description of a reduced touch from plain values; arguments as of `DescribedTouch`."""
    origin = Origin(source, text)
    with origin.located():
        asked = part_from(ReductionDescription, content)
        with at("motion"):
            if "motion" in asked.model_fields_set:
                raise InputError(
                    "motion", "must be left out", remedy="a reduced touch serves any motion in its range"
                )
        with at("finger"):
            finger = finger_of(asked.finger, origin.beside)
        touch = asked.stimulus(origin.beside).touch(finger, asked.tissues, asked.resolution)
        with at("range"):
            training = ReducedTraining(touch, ReducedRange(**dict(asked.range)), asked.resolution)
            # All poses are described, and so checked, before anything is pressed.
            list(training.poses())
    return DescribedReduction(asked, training)


def run_reduction(described: DescribedReduction, runner: Runner) -> ReducedModel:
    """Press what the store of a runner lacks, and make the reduced touch."""

    def solve(touches: Sequence[Touch], stage: str) -> list[SkinResponse]:
        found = runner.responses({stage: dict(enumerate(touches))})[stage]
        return [found[number] for number in range(len(touches))]

    asked = described.description
    return reduce_touch(described.training, solve, calibration=asked.calibration, seed=asked.seed)
