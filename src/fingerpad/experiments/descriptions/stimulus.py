"""What files say of one press: the finger, and the stimulus with its object, motion, place and friction."""

from __future__ import annotations

from collections.abc import Iterator, Sequence
from contextlib import contextmanager
from dataclasses import field
from pathlib import Path
from typing import Annotated

from pydantic import Field

from fingerpad.core.checked import value_class
from fingerpad.core.errors import InputError, Place
from fingerpad.core.values import Finite, NotNegative, choice
from fingerpad.data.tissues import DEFAULT_TISSUES
from fingerpad.experiments.conditions import Conditions, straight_tilt_deg
from fingerpad.experiments.descriptions.pressing import (
    FingerPart,
    MotionPart,
    ObjectPart,
    finger_of,
    named_files,
    object_of,
)
from fingerpad.experiments.descriptions.reading import at
from fingerpad.experiments.descriptions.values import Part
from fingerpad.geometry.fingertip import Finger
from fingerpad.geometry.grading import RESOLUTIONS, Grading
from fingerpad.geometry.indenters import Indenter
from fingerpad.geometry.motion import Motion, RampAndHold
from fingerpad.mechanics.materials import Tissues
from fingerpad.mechanics.tissues import TISSUES
from fingerpad.skin.indentation import Touch, touch_of

_PLACES: dict[str, Place] = {
    "at_mm": ("place",),
    "position": ("place",),
    "tilt_deg": ("place", "tilt_deg"),
    "spin_deg": ("place", "spin_deg"),
    "times_ms": ("times_ms",),
    "friction": ("friction",),
}
"""Keys of a file that set arguments of the solver; any other argument is one of the motion."""

MadeObjects = list[tuple[object, Indenter]]
"""Parts of files with the objects that were made of them."""


class PlaceSettings(Part):
    """Where and in which direction the object is pressed."""

    x_mm: Finite = 0.0
    """Where the object's axis meets the skin, from the middle of the pad: along the finger, distal positive,
    and across. [mm]"""
    z_mm: Finite = 0.0
    """Where the object's axis meets the skin, from the middle of the pad: along the finger, distal positive,
    and across. [mm]"""
    tilt_deg: Finite | None = None
    """0 is perpendicular to the long axis of the finger; without it, perpendicular to the skin. [degrees]"""
    spin_deg: Finite = 0.0
    """Turn about the direction of pressing. [degrees]"""


class FingerDescription(Part):
    """The finger that is pressed."""

    resolution: Annotated[str, choice(RESOLUTIONS)] = "quick"
    """How fine mesh and steps are."""
    finger: FingerPart = Field(default={}, validate_default=True)
    """Whose: a preset such as "child", the sizes of `fingerpad.Fingertip.of`, `kind: outline` with those of
    `fingerpad.Fingertip`, or `kind: mesh` with the parameters of `fingerpad.read_finger`."""
    tissues: Annotated[str, choice(TISSUES)] = DEFAULT_TISSUES
    """A set of tissues by name, as of `fingerpad.indent`."""

    def conditions(self, seed: int = 0, beside: Path = Path()) -> Conditions:
        """Finger, tissues and accuracy, with a seed; the file of a mesh is named from the folder `beside`."""
        with at("finger"):
            finger = finger_of(self.finger, beside)
        return Conditions(self.resolution, seed, self.tissues, finger)


class StimulusDescription(Part):
    """What is pressed in, and how."""

    object: ObjectPart
    """What is pressed in: `kind` and its sizes, or a text such as "sphere:radius_mm=3.5"."""
    motion: MotionPart = Field(default={}, validate_default=True)
    """How: `kind` and its numbers; a ramp and hold by default."""
    place: PlaceSettings = PlaceSettings()
    """Where, and in which direction."""
    friction: NotNegative = 0.0
    """Coulomb's coefficient between skin and object."""

    def stimulus(self, beside: Path = Path(), made: MadeObjects | None = None) -> TactileStimulus:
        """Make what is described."""
        known = [] if made is None else made
        indenter = next((body for part, body in known if part == self.object), None)
        if indenter is None:
            with at("object"):
                indenter = object_of(self.object, beside)
            known.append((self.object, indenter))
        with at("motion"):
            motion = self.motion.made(beside)
        return TactileStimulus(indenter, motion, **dict(self.place), friction=self.friction)

    def files(self, beside: Path = Path()) -> list[Path]:
        """Files that object and motion name."""
        return [*named_files(self.object, beside), *named_files(self.motion, beside)]


@value_class
class TactileStimulus:
    """An indenter, its motion, its place from the middle of the pad, and friction."""

    indenter: Indenter
    """The rigid body."""
    motion: Motion = field(default_factory=RampAndHold)
    """How it is pressed."""
    x_mm: Finite = 0.0
    """Where its axis meets the skin, from the middle of the pad: along the finger, distal positive, and
    across. [mm]"""
    z_mm: Finite = 0.0
    """Where its axis meets the skin, from the middle of the pad: along the finger, distal positive, and
    across. [mm]"""
    tilt_deg: Finite | None = None
    """As in `fingerpad.Touch`; by default it presses perpendicular to the skin in the middle. [degrees]"""
    spin_deg: Finite = 0.0
    """As in `fingerpad.Touch`: the orientation of a bar, an edge, a gap or a grating. [degrees]"""
    friction: Finite = 0.0
    """Coulomb's coefficient."""

    def tilt_on(self, finger: Finger) -> float:
        """Tilt of the indenter on a finger. [degrees]"""
        return straight_tilt_deg(finger, self.indenter) if self.tilt_deg is None else self.tilt_deg

    def touch(
        self,
        finger: Finger,
        tissues: str | Tissues,
        resolution: str,
        grading: Grading | None = None,
        times_ms: Sequence[float] = (),
    ) -> Touch:
        """Describe the touch for the solver."""
        with about():
            return touch_of(
                finger,
                self.indenter,
                self.motion,
                tissues,
                resolution,
                (finger.contact_mm[0] + self.x_mm, finger.contact_mm[1] + self.z_mm),
                grading=grading,
                tilt_deg=self.tilt_on(finger),
                friction=self.friction,
                spin_deg=self.spin_deg,
                times_ms=times_ms,
            )


@contextmanager
def about() -> Iterator[None]:
    """Name the key of a file that an error of a whole touch is about."""
    try:
        yield
    except InputError as error:
        argument = str(error.path[0]) if error.path else ""
        if argument in _PLACES:
            raise error.at(_PLACES[argument]) from error
        if argument and argument != "grading":
            raise error.at(("motion", *error.path)) from error
        raise InputError(str(error)).at(("object" if argument else "motion",)) from error
