"""What requests say of one press: the finger, the object, its motion, its place and friction."""

from __future__ import annotations

from collections.abc import Callable, Iterator, Mapping, Sequence
from contextlib import contextmanager
from dataclasses import field, fields
from functools import cached_property, lru_cache
from pathlib import Path
from typing import Annotated, Any

from pydantic import Field

from fingerpad.core.checked import value_class
from fingerpad.core.errors import InputError, Place
from fingerpad.core.units import unit_of
from fingerpad.core.values import Check, Finite, NotNegative, Positive, choice, instance, number_in, one_of
from fingerpad.data import protocol
from fingerpad.data.tissues import DEFAULT_TISSUES
from fingerpad.experiments.conditions import Conditions, straight_tilt_deg
from fingerpad.experiments.requests.parts import Made, OneOfKinds, Part, Request, as_written, at
from fingerpad.geometry.bodies import INDENTERS
from fingerpad.geometry.fingertip import Finger, Fingertip
from fingerpad.geometry.grading import RESOLUTIONS, Grading
from fingerpad.geometry.indenters import Indenter
from fingerpad.geometry.mesh_files import MESH_FILES, read_finger
from fingerpad.geometry.motion import ForceRampAndHold, Motion, RampAndHold
from fingerpad.geometry.motions import recorded
from fingerpad.mechanics.materials import Tissues
from fingerpad.mechanics.tissues import TISSUES, named_tissues
from fingerpad.skin.indentation import Touch, touch_of

RAMP_AND_HOLD = "ramp_and_hold"
MEASURED = "measured"


def ramp_and_hold(
    depth_mm: Finite | None = None,
    force_mn: Finite | None = None,
    ramp_ms: Finite = protocol.RAMP.value,
    hold_ms: Finite = protocol.HOLD.value,
) -> Motion:
    """Indent at a constant rate to a depth or a force, then hold it.

    Parameters
    ----------
    depth_mm : float, optional
        Depth of the hold; the paper's without depth and force. [mm]
    force_mn : float, optional
        Instead of a depth, the force of the hold on the whole finger. [mN]
    ramp_ms, hold_ms : float, optional
        Durations. [ms]
    """
    if depth_mm is not None and force_mn is not None:
        raise InputError("depth_mm and force_mn exclude each other: leave one out.")
    if force_mn is not None:
        return ForceRampAndHold(force_mn, ramp_ms, hold_ms)
    return RampAndHold(protocol.DEPTH.value if depth_mm is None else depth_mm, ramp_ms, hold_ms)


FINGERS: dict[str, Callable[..., Finger] | str] = {
    MEASURED: Fingertip.of,
    "outline": Fingertip,
    "mesh": "read_finger",
}  # How a finger can be given, by kind.

OBJECTS: dict[str, Callable[..., Indenter] | str] = {
    **INDENTERS,
    "dots": "geometry.bodies.Dots",
    "braille": "braille",
    "embossed": "geometry.embossed.Embossed",
    "embossed_text": "embossed_text",
    "ridges": "geometry.bodies.ridges",
    "surface": "read_surface",
    "height_map": "read_height_map",
}  # What can be pressed in, by kind; by its name below `fingerpad` if only a file with it needs the module.

MOTIONS: dict[str, Callable[..., Motion] | str] = {
    RAMP_AND_HOLD: ramp_and_hold,
    **{kind: kind for kind in ("sine", "chirp", "repeated", "staircase", "stroke")},
    "recorded": recorded,
    "trajectory": "Trajectory",
}  # How it can move, by kind.

_WITHOUT = {"trajectory": ("phases", "cycles")}  # Parameters that a file does not have.

FingerPart = Annotated[Any, OneOfKinds(FINGERS, Finger, MEASURED, named=True)]
ObjectPart = Annotated[Any, OneOfKinds(OBJECTS, Indenter, named=True)]
MotionPart = Annotated[Any, OneOfKinds(MOTIONS, Motion, RAMP_AND_HOLD, without=_WITHOUT)]


def made_of(part: Any, beside: Path = Path()) -> Any:
    """Make what a part describes; an object of Python is itself."""
    return part.made(beside) if isinstance(part, Made) else part


def finger_of(part: Any, beside: Path = Path()) -> Finger:
    """Make the finger of a file: a part, or a text such as `child`, `adult:width_mm=18` or `own.inp`."""
    if not isinstance(part, str):
        finger: Finger = made_of(part, beside)
        return finger
    if Path(part).suffix.lower() in MESH_FILES:
        return read_finger(beside / part)
    like, sizes = sizes_in("finger", part, "like:name=mm, as adult:width_mm=18")
    return Fingertip.of(like, **sizes)


def sizes_in(what: str, text: str, written: str, names: Sequence[str] = ()) -> tuple[str, dict[str, float]]:
    """Return the name and the sizes of a text name:size:size=value; those without a name go by `names`."""
    name, *given = (part.strip() for part in text.split(":"))
    found: dict[str, str] = {}
    for place, part in enumerate(given):
        size, equals, value = (word.strip() for word in part.rpartition("="))
        if not equals and place >= len(names):
            raise InputError(what, f"must be written {written}", repr(text))
        size = size if equals else names[place]
        if size in found:
            raise InputError(what, f"must have {size} once", repr(text))
        found[size] = value
    return name, {size: number_in(size, value, unit_of(size)) for size, value in found.items()}


def object_of(part: Any, beside: Path = Path()) -> Indenter:
    """Make the object of a file: a part, or a text such as `punch:6.35`."""
    body: Indenter = indenter_named(part) if isinstance(part, str) else made_of(part, beside)
    return body


def named_files(part: Any, beside: Path = Path()) -> list[Path]:
    """Files that a finger, an object or a motion of a description names, from the folder `beside`."""
    if isinstance(part, str):
        return [beside / part] if Path(part).suffix.lower() in MESH_FILES else []
    given = part.given if isinstance(part, Made) else {}
    return [beside / value for key, value in given.items() if key in part.files]


@lru_cache(maxsize=1024)
def indenter_named(text: str) -> Indenter:
    """Make an indenter from its name and sizes, `name:size:size`."""
    name = text.partition(":")[0].strip()
    body = INDENTERS[one_of("indenter", name, tuple(INDENTERS))]
    names = [size.name for size in fields(body)]  # type: ignore[arg-type]
    written = f"{':'.join([name, *names])}, sizes from the right may be left out"
    return body(**sizes_in("indenter", text, written, names)[1])


_PLACES: dict[str, Place] = {
    "at_mm": ("place",),
    "position": ("place",),
    "tilt_deg": ("place", "tilt_deg"),
    "spin_deg": ("place", "spin_deg"),
    "times_ms": ("times_ms",),
    "friction": ("friction",),
}  # Keys of a file that set arguments of the solver; any other argument is one of the motion.

MadeObjects = list[tuple[object, Indenter]]  # Parts of files with the objects that were made of them.


class PlaceSettings(Part):
    """Where and in which direction the object is pressed."""

    x_mm: Finite = 0.0
    z_mm: Finite = 0.0
    """Where the object's axis meets the skin, from the middle of the pad: along the finger, distal positive,
    and across. [mm]"""
    tilt_deg: Finite | None = None
    """0 is perpendicular to the long axis of the finger; without it, perpendicular to the skin. [degrees]"""
    spin_deg: Finite = 0.0  #: Turn about the direction of pressing. [degrees]


def tissues_of(name: str, value: Any) -> str | Tissues:
    """Return a name of a set of tissues, or tissues of one's own."""
    return value if isinstance(value, Tissues) else one_of(name, value, tuple(TISSUES))


def grading_of(name: str, value: Any) -> Grading | None:
    """Return a mesh from its fields by name, or as it is."""
    if not isinstance(value, Mapping):
        return value if value is None else instance(name, value, Grading)
    with at(name):
        return Grading(**value)


def dict_of(grading: Grading | None) -> Any:
    """Fields of a mesh by name."""
    return None if grading is None else {each.name: getattr(grading, each.name) for each in fields(grading)}


TissuesPart = Annotated[
    Any, Check(tissues_of, {"anyOf": [{"enum": list(TISSUES)}, {"type": "string"}]}, as_written)
]  # Tissues by name, or of one's own.


FINGER_OBJECTS = ("finger", "tissues", "grading")
"""Keys of a `FingerDescription` that may name an object."""


class FingerDescription(Part):
    """The finger that is pressed."""

    resolution: Annotated[str, choice(RESOLUTIONS)] = "quick"  #: How fine mesh and steps are.
    finger: FingerPart = Field(default={}, validate_default=True)
    """Whose: a preset such as "child", the sizes of `fingerpad.Fingertip.of`, `kind: outline` with those of
    `fingerpad.Fingertip`, or `kind: mesh` with the parameters of `fingerpad.read_finger`."""
    tissues: TissuesPart = DEFAULT_TISSUES
    """A set of tissues by name, as of `fingerpad.indent`; in Python also tissues of one's own."""
    stiffness: Positive = 1.0  #: Factor of the moduli of all tissues.
    grading: Annotated[Any, Check(grading_of, {"type": "object"}, dict_of)] = None
    """Mesh instead of that which `resolution` grades about the objects: the fields of `fingerpad.Grading`."""

    def conditions(self, finger: Finger, seed: int = 0, depths_mm: tuple[float, ...] = ()) -> Conditions:
        """Finger, tissues and accuracy, with a seed and depths at which presses keep quantities."""
        return Conditions(self.resolution, seed, self.scaled_tissues, finger, self.grading, depths_mm)

    @property
    def scaled_tissues(self) -> str | Tissues:
        """The tissues, with their stiffness."""
        if self.stiffness == 1.0:
            return self.tissues
        named = named_tissues(self.tissues) if isinstance(self.tissues, str) else self.tissues
        return named.scaled(self.stiffness)


class FingerRequest(Request, FingerDescription):
    """Base of requests that press into a finger."""

    @cached_property
    def pressed_finger(self) -> Finger:
        """The finger."""
        with self.origin.located(), at("finger"):
            return finger_of(self.finger, self.beside)

    def input_hashes(self) -> dict[str, str]:
        """SHA-256 of the request and of the files that it names."""
        return self.origin.hashes([*named_files(self.finger, self.beside), *self.further_files()])

    def further_files(self) -> list[Path]:
        """Files that it names beside that of the finger."""
        return []


class PlacedObject(Part):
    """What is pressed in, where and in which direction."""

    object: ObjectPart  #: What is pressed in: `kind` and its sizes, or a text such as "sphere:radius_mm=3.5".
    place: PlaceSettings = PlaceSettings()  #: Where, and in which direction.
    friction: NotNegative = 0.0  #: Coulomb's coefficient between skin and object.

    def body(self, beside: Path = Path()) -> Indenter:
        """Make the object."""
        with at("object"):
            return object_of(self.object, beside)

    def files(self, beside: Path = Path()) -> list[Path]:
        """Files that the object names."""
        return named_files(self.object, beside)


class StimulusDescription(PlacedObject):
    """What is pressed in, and how."""

    motion: MotionPart = Field(default={}, validate_default=True)
    """How: `kind` and its numbers; a ramp and hold by default."""

    def stimulus(self, beside: Path = Path(), made: MadeObjects | None = None) -> TactileStimulus:
        """Make what is described."""
        known = [] if made is None else made
        indenter = next((body for part, body in known if part == self.object), None)
        if indenter is None:
            indenter = self.body(beside)
            known.append((self.object, indenter))
        with at("motion"):
            motion = made_of(self.motion, beside)
        return TactileStimulus(indenter, motion, **dict(self.place), friction=self.friction)

    def files(self, beside: Path = Path()) -> list[Path]:
        """Files that object and motion name."""
        return [*super().files(beside), *named_files(self.motion, beside)]


@value_class
class TactileStimulus:
    """An indenter, its motion, its place from the middle of the pad, and friction."""

    indenter: Indenter  #: The rigid body.
    motion: Motion = field(default_factory=RampAndHold)  #: How it is pressed.
    x_mm: Finite = 0.0
    z_mm: Finite = 0.0
    """Where its axis meets the skin, from the middle of the pad: along the finger, distal positive, and
    across. [mm]"""
    tilt_deg: Finite | None = None
    """As in `fingerpad.Touch`; by default it presses perpendicular to the skin in the middle. [degrees]"""
    spin_deg: Finite = 0.0
    """As in `fingerpad.Touch`: the orientation of a bar, an edge, a gap or a grating. [degrees]"""
    friction: Finite = 0.0  #: Coulomb's coefficient.

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
        receptor_depths_mm: Sequence[float] = (),
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
                receptor_depths_mm=receptor_depths_mm,
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
