"""Fingers, objects and motions as files describe them: a `kind`, and the parameters of what it names."""

from __future__ import annotations

from collections.abc import Callable, Mapping, Sequence
from pathlib import Path
from typing import TYPE_CHECKING, Any, TypeAlias

from fingerpad.core.errors import InputError
from fingerpad.core.values import Finite, Text, number_in
from fingerpad.data import protocol
from fingerpad.experiments.descriptions.signatures import one_of_kinds
from fingerpad.experiments.indenter_text import indenter_named
from fingerpad.geometry.edged_indenters import INDENTERS
from fingerpad.geometry.fingertip import Finger, Fingertip
from fingerpad.geometry.indenters import Indenter
from fingerpad.geometry.mesh_files import MESH_FILES, read_finger
from fingerpad.geometry.motion import ForceRampAndHold, Motion, RampAndHold
from fingerpad.geometry.trajectory_files import recorded

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
}
"""How a finger can be given, by kind."""

OBJECTS: dict[str, Callable[..., Indenter] | str] = {
    **INDENTERS,
    "dots": "Dots",
    "braille": "braille",
    "embossed": "Embossed",
    "embossed_text": "embossed_text",
    "ridges": "ridges",
    "surface": "read_surface",
    "height_map": "read_height_map",
}
"""What can be pressed in, by kind; by its public name where only a file with it needs the module."""

MOTIONS: dict[str, Callable[..., Motion] | str] = {
    RAMP_AND_HOLD: ramp_and_hold,
    **{kind: kind for kind in ("sine", "chirp", "repeated", "staircase", "stroke")},
    "recorded": recorded,
    "trajectory": "Trajectory",
}
"""How it can move, by kind."""

_WITHOUT: Mapping[str, Sequence[str]] = {"trajectory": ("phases", "cycles")}
"""Parameters that a file does not have."""

if TYPE_CHECKING:
    FingerPart: TypeAlias = Any
    ObjectPart: TypeAlias = Any
    MotionPart: TypeAlias = Any
else:
    FingerPart = one_of_kinds(FINGERS, default=MEASURED, text=Text)
    ObjectPart = one_of_kinds(OBJECTS, text=Text)
    MotionPart = one_of_kinds(MOTIONS, default=RAMP_AND_HOLD, without=_WITHOUT)


def finger_of(part: Any, beside: Path = Path()) -> Finger:
    """Make the finger of a file: a part, or a text such as `child`, `adult:width_mm=18` or `own.inp`."""
    if not isinstance(part, str):
        made: Finger = part.made(beside)
        return made
    if Path(part).suffix.lower() in MESH_FILES:
        return read_finger(beside / part)
    like, *given = (word.strip() for word in part.split(":"))
    sizes = [tuple(word.strip() for word in size.partition("=")) for size in given]
    for _, equals, _ in sizes:
        if not equals:
            raise InputError("finger", "must be written like:name=mm, as adult:width_mm=18", repr(part))
    return Fingertip.of(like, **{name: number_in(name, value, "mm") for name, _, value in sizes})


def object_of(part: Any, beside: Path = Path()) -> Indenter:
    """Make the object of a file: a part, or a text such as `punch:6.35`."""
    body: Indenter = indenter_named(part) if isinstance(part, str) else part.made(beside)
    return body


def named_files(part: Any, beside: Path = Path()) -> list[Path]:
    """Files that a finger, an object or a motion of a description names, from the folder `beside`."""
    if isinstance(part, str):
        return [beside / part] if Path(part).suffix.lower() in MESH_FILES else []
    return [beside / value for key, value in part.given.items() if key in getattr(part, "files", ())]
