"""What is asked of a validation: observations of your own, and the model whose predictions are scored."""

from __future__ import annotations

from functools import cached_property
from pathlib import Path
from typing import Annotated, ClassVar

from pydantic import Field

from fingerpad.core.errors import InputError
from fingerpad.core.values import Pair, Positive, Text, choice
from fingerpad.data import protocol
from fingerpad.experiments.conditions import Conditions
from fingerpad.experiments.requests.afferents import DEFAULT, AfferentChoice, chosen_afferent, files_of
from fingerpad.experiments.requests.parts import at, object_of_python
from fingerpad.experiments.requests.stimulus import (
    FINGER_OBJECTS,
    FingerRequest,
    ObjectPart,
    named_files,
    object_of,
)
from fingerpad.experiments.validation.observations import Observations, read_observations
from fingerpad.geometry.grading import RESOLUTIONS
from fingerpad.geometry.motion import RampAndHold
from fingerpad.neuron.afferent import AnyAfferent

RAMP_AND_HOLD, QUASI_STATIC = "ramp_and_hold", "quasi_static"
LOADINGS = (RAMP_AND_HOLD, QUASI_STATIC)  # Read at the end of the paper's hold, or with relaxed tissues.


class ValidationRequest(FingerRequest):
    """A validation, as `fingerpad.validate` runs it and a file or a command describes it."""

    word: ClassVar[str] = "validation"
    main: ClassVar[str] = "observations"
    python: ClassVar[tuple[str, ...]] = (*FINGER_OBJECTS, "afferent")

    observations: Text | Path | object_of_python(Observations)  # type: ignore[valid-type]
    """A CSV file (docs/validate.md), or what `read_observations` returns."""
    objects: dict[str, ObjectPart] = Field(default={})
    """Objects by the names that the column `indenter` has for them, beside `sphere:287` and the like."""
    afferent: AfferentChoice = DEFAULT
    """Whose rates are predicted: "default", that of the tissues; a type; a file of results; or numbers."""
    depth_mm: Positive | None = None
    """Depth of the receptor below the skin; by default the border of epidermis and dermis. [mm]"""
    loading: Annotated[str, choice(LOADINGS)] = RAMP_AND_HOLD
    """How a depth of force or deflection is reached: read at the end of the paper's ramp and hold, or with
    relaxed tissues."""
    static_window_ms: Pair = (protocol.STATIC_WINDOW.value[0], protocol.STATIC_WINDOW.value[1])
    """Window of the rates, within the paper's ramp and hold. [ms]"""
    resolution: Annotated[str, choice(RESOLUTIONS)] = "standard"
    """As of `FingerDescription`; "standard" by default."""

    @cached_property
    def observed(self) -> Observations:
        """The observations."""
        with self.origin.located():
            if isinstance(self.observations, Observations):
                return self.observations
            own = {}
            for name, part in self.objects.items():
                with at("objects", name):
                    own[name] = object_of(part, self.beside)
            return read_observations(self.beside / self.observations, own)

    @cached_property
    def settings(self) -> Conditions:
        """Finger, tissues and accuracy."""
        with self.origin.located():
            depths_mm = () if self.depth_mm is None else (self.depth_mm,)
            return self.conditions(self.pressed_finger, depths_mm=depths_mm)

    @cached_property
    def responding(self) -> AnyAfferent:
        """The afferent that responds."""
        with self.origin.located(), at("afferent"):
            return chosen_afferent(self.afferent, self.tissues, self.beside)

    def check(self) -> None:
        """Raise `InputError` if the validation is impossible; before anything is solved."""
        self.observed, self.settings, self.responding  # noqa: B018
        (start, end), end_ms = self.static_window_ms, RampAndHold().end_ms
        if not 0.0 <= start < end <= end_ms:
            with self.origin.located():
                raise InputError(
                    "static_window_ms",
                    f"must be a start from 0 on and a later end, at most {end_ms:g} ms, where the hold ends",
                    f"{start:g}, {end:g}",
                )

    def further_files(self) -> list[Path]:
        """Files of the observations, the objects and the afferent."""
        own = [self.beside / self.observations] if isinstance(self.observations, str | Path) else []
        of_objects = [file for part in self.objects.values() for file in named_files(part, self.beside)]
        return [*own, *of_objects, *files_of(self.afferent, self.beside)]
