"""What is set in the laboratory: one flat, frozen value, which also stands in the address of the page."""

from __future__ import annotations

import difflib
import math
from collections.abc import Mapping
from dataclasses import dataclass, fields
from typing import Any

from fingerpad.core.errors import InputError

AFFERENTS = ("SAI", "RA")  # Types of afferents that follow what a reduced touch keeps.

BOUNDS = {
    "depth_mm": (0.05, 5.0),
    "x_mm": (-20.0, 20.0),
    "z_mm": (-20.0, 20.0),
    "tilt_deg": (-45.0, 45.0),
    "slide_mm": (-20.0, 20.0),
    "ramp_ms": (20.0, 1000.0),
    "hold_ms": (50.0, 2000.0),
    "size": (0.0, 1e6),
    "other_size": (0.0, 1e6),
}
"""Widest bounds of the numbers; those of a reduced touch are mostly narrower."""


@dataclass(frozen=True)
class LabState:
    """What is pressed, how, and by whom it is felt.

    Parameters
    ----------
    object : str
        Name of what is pressed in.
    other : str
        What it is compared with, pressed in the same way; empty for nothing.
    size, other_size : float
        The parameter of both that varies, such as the curvature; 0 for that of the range's middle.
    finger, tissues : str
        By name; empty for those of the range.
    afferent : {"SAI", "RA"}
        Who responds.
    x_mm, z_mm, tilt_deg : float
        Pose of the object, from its place and direction. [mm, degrees]
    depth_mm : float
        Depth below first touch. [mm]
    slide_mm : float
        Way along the finger during the hold. [mm]
    ramp_ms, hold_ms : float
        Duration of the press, which is also that of the lift, and of the hold. [ms]

    Examples
    --------
    >>> state_of({"object": "ball", "depth_mm": "0.7"}).depth_mm
    0.7
    """

    object: str
    other: str = ""
    size: float = 0.0
    other_size: float = 0.0
    finger: str = ""
    tissues: str = ""
    afferent: str = "SAI"
    x_mm: float = 0.0
    z_mm: float = 0.0
    tilt_deg: float = 0.0
    depth_mm: float = 1.0
    slide_mm: float = 0.0
    ramp_ms: float = 100.0
    hold_ms: float = 500.0


def state_of(asked: Mapping[str, Any] | Any) -> LabState:
    """Read a state from plain values, such as those of the address of the page."""
    if not isinstance(asked, Mapping):
        raise InputError(f"The state of the laboratory must be a mapping: got {type(asked).__name__}.")
    known = {each.name: each.type for each in fields(LabState)}
    values: dict[str, Any] = {}
    for name, value in asked.items():
        if name not in known:
            close = difflib.get_close_matches(str(name), known, 1)
            hint = f"did you mean {close[0]}?" if close else f"known are {', '.join(known)}."
            raise InputError(f"{str(name)[:40]!r} is nothing that can be set: {hint}")
        values[name] = str(value) if known[name] == "str" else _number(name, value)
    if not values.get("object"):
        raise InputError("object", "must be given", remedy="the name of what is pressed in")
    if values.get("afferent", AFFERENTS[0]) not in AFFERENTS:
        raise InputError(
            "afferent",
            f"must be {' or '.join(AFFERENTS)}, because a reduced touch keeps what these two follow alone",
            repr(values["afferent"][:40]),
            "fp.AfferentStream takes all types",
        )
    return LabState(**values)


def _number(name: str, value: Any) -> float:
    low, high = BOUNDS[name]
    try:
        number = float(value)
    except (TypeError, ValueError, OverflowError):
        number = math.nan
    if isinstance(value, bool) or not low <= number <= high:
        raise InputError(name, f"must be a number within {low:g} to {high:g}", repr(str(value)[:40]))
    return number
