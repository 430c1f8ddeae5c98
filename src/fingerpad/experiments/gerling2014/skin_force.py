"""Level 1, beyond the paper: force of flat indenters, and deflection with the tissues of the run itself."""

from __future__ import annotations

from collections.abc import Mapping

from fingerpad.core.results import Number, result_class
from fingerpad.core.units import MN_PER_N
from fingerpad.data import protocol
from fingerpad.experiments.conditions import Conditions, Touch
from fingerpad.experiments.gerling2014.skin_deflection import deflection_r2
from fingerpad.geometry.indenters import Cylinder, FlatPunch, Plate
from fingerpad.geometry.motion import RampAndHold
from fingerpad.skin.indentation import touch_of
from fingerpad.skin.sampling import SkinResponse

PLATE_DEPTHS_MM = (1.0, 2.0)
"""Depths of the flat plate, at which forces of people were observed. [mm]"""


@result_class
class SkinForce:
    """Deflection and force with the tissues of the run."""

    deflection_r2: Number
    """R² of the deflection under the cylinder, see `deflection_r2`."""
    plate_1mm_n: Number
    plate_2mm_n: Number
    """Force of a flat plate at the end of the hold, 1.0 and 2.0 mm deep. [N]"""
    disc_1mm_n: Number
    """Force of a flat disc of 6.35 mm diameter at the end of the hold, 1.0 mm deep. [N]"""


def plate(depth_mm: float) -> str:
    """Name of the touch of the flat plate at one of `PLATE_DEPTHS_MM`."""
    return f"plate {depth_mm:g} mm"


def force_touches(conditions: Conditions) -> dict[str, Touch]:
    """Touches of the cylinder, of the plate at both depths and of the disc, by name.

    The flat indenters press straight down at the point of contact, as `fingerpad.indent` does.
    """
    cylinder = Cylinder()
    flat = {plate(depth_mm): (Plate(), RampAndHold(depth_mm=depth_mm)) for depth_mm in PLATE_DEPTHS_MM} | {
        "disc": (FlatPunch(), RampAndHold(depth_mm=protocol.DEPTH.value))
    }
    return {
        "cylinder": conditions.touch(
            cylinder, conditions.receptor_x_mm, conditions.deflection_grading(cylinder)
        )
    } | {
        name: touch_of(conditions.finger, body, motion, conditions.tissues, conditions.resolution)
        for name, (body, motion) in flat.items()
    }


def skin_force(responses: Mapping[str, SkinResponse]) -> SkinForce:
    """Read deflection and forces."""
    force_n = {name: float(skin.force_mn[-1]) / MN_PER_N for name, skin in responses.items()}
    return SkinForce(
        deflection_r2=deflection_r2(responses["cylinder"].surface_profile()),
        plate_1mm_n=force_n[plate(1.0)],
        plate_2mm_n=force_n[plate(2.0)],
        disc_1mm_n=force_n["disc"],
    )
