"""What is set in the laboratory: one flat, frozen value, which also stands in the address of the page."""

from __future__ import annotations

from collections.abc import Mapping
from typing import Annotated, Any

from fingerpad.core.checked import checked, value_class
from fingerpad.core.values import Text, choice, limits, number_in
from fingerpad.data.afferents import TYPES

OF_RANGE = "range"  # Name of the afferents that the file of a range describes.
AFFERENTS = (*TYPES, OF_RANGE)  # Who may respond.

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


@value_class
class LabState:
    """What is pressed, how, and by whom it is felt."""

    object: Text  # Name of what is pressed in.
    other: str = ""  # What it is compared with, pressed in the same way; empty for nothing.
    size: Annotated[float, limits(*BOUNDS["size"])] = 0.0
    other_size: Annotated[float, limits(*BOUNDS["other_size"])] = 0.0
    """The parameter of both that varies, such as the curvature; 0 for that of the range's middle."""
    finger: str = ""
    tissues: str = ""  # By name; empty for those of the range.
    afferent: Annotated[str, choice(AFFERENTS)] = "SAI"
    x_mm: Annotated[float, limits(*BOUNDS["x_mm"])] = 0.0
    z_mm: Annotated[float, limits(*BOUNDS["z_mm"])] = 0.0
    tilt_deg: Annotated[float, limits(*BOUNDS["tilt_deg"])] = 0.0
    """Pose of the object, from its place and direction. [mm, degrees]"""
    depth_mm: Annotated[float, limits(*BOUNDS["depth_mm"])] = 1.0  # Below first touch. [mm]
    slide_mm: Annotated[float, limits(*BOUNDS["slide_mm"])] = 0.0  # Along the finger in the hold. [mm]
    ramp_ms: Annotated[float, limits(*BOUNDS["ramp_ms"])] = 100.0  # Of the press and of the lift. [ms]
    hold_ms: Annotated[float, limits(*BOUNDS["hold_ms"])] = 500.0


@checked
def state_of(asked: Mapping[str, Any]) -> LabState:
    """Read a state from plain values, such as the texts in the address of the page."""
    given: dict[str, Any] = {
        name: number_in(name, value) if name in BOUNDS and isinstance(value, str) else value
        for name, value in asked.items()
    }
    return LabState(**given)
