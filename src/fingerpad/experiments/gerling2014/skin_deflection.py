"""Level 1: deflection of the skin (paper, 2.2.1, 3.1, Figure 4); beyond the paper, force of indenters."""

from __future__ import annotations

from collections.abc import Mapping

import numpy as np

from fingerpad.core.checked import result_class
from fingerpad.core.units import MN_PER_N
from fingerpad.core.values import Number, TruthVector, Vector
from fingerpad.data import cylinder_deflection, protocol
from fingerpad.experiments.conditions import Conditions, Touch
from fingerpad.experiments.scores import coefficient_of_determination
from fingerpad.geometry.indenters import Cylinder, FlatPunch, Indenter, Line, Plate
from fingerpad.geometry.motion import RampAndHold
from fingerpad.skin.indentation import touch_of
from fingerpad.skin.sampling import SkinResponse, SurfaceProfile

TRIALS = ("trial1", "trial2", "trial3")
INDENTERS: dict[str, Indenter] = {"line": Line(), "cylinder": Cylinder()}
SHOWN_MM = 10.0  # Distance to which the profile is kept; the observations end at 9.25 mm. [mm]


@result_class
class IndenterDeflection:
    """Deflection of the skin under one indenter."""

    distance_mm: Vector
    deflection_mm: Vector  # Along the midline; distance from the axis, proximal positive, (n_nodes,). [mm]
    force_mn: Number
    peak_force_mn: Number  # Force at the end of the hold, and the largest force. [mN]
    penetration_mm: Number  # Largest overlap of skin and indenter. [mm]


@result_class
class CylinderDeflection(IndenterDeflection):
    """Deflection of the skin under the cylinder, compared with the observations."""

    r2: Number  # Coefficient of determination, see `deflection_r2`.
    r2_mirrored: Number  # The same with proximal and distal exchanged.


@result_class
class TrialDeflection:
    """Deflections with the tissues of one trial."""

    line: IndenterDeflection
    cylinder: CylinderDeflection


@result_class
class ObservedDeflection:
    """Observed deflection under the cylinder."""

    distance_mm: Vector
    deflection_mm: Vector  # (n_points,).
    is_artefact: TruthVector  # Points that R² leaves out, (n_points,).


@result_class
class SkinDeflectionResult:
    """Result of level 1."""

    trial1: TrialDeflection
    trial2: TrialDeflection
    trial3: TrialDeflection  # By the tissues of the paper's trials.
    observed: ObservedDeflection


def deflection_touches(conditions: Conditions) -> dict[tuple[str, str], Touch]:
    """Six touches: three trials, two indenters."""
    return {
        (trial, name): conditions.touch(
            indenter, conditions.receptor_x_mm, conditions.deflection_grading(indenter), tissues=trial
        )
        for trial in TRIALS
        for name, indenter in INDENTERS.items()
    }


def deflection_r2(profile: SurfaceProfile, proximal_positive: bool = True) -> float:
    """R² of a profile against the observed deflection under the cylinder, its marked artefact left out.

    The source does not state which end of the finger its positive distances point to. Read as proximal they
    fit better (docs/decisions.md#deflection-direction); `proximal_positive` False reads them as distal.
    """
    observed = cylinder_deflection()
    kept = ~observed.is_artefact
    distance = observed.distance_mm[kept] * (-1.0 if proximal_positive else 1.0)
    return coefficient_of_determination(observed.deflection_mm[kept], profile.at(distance))


def deflection_result(responses: dict[tuple[str, str], SkinResponse]) -> SkinDeflectionResult:
    """Profiles, forces and R², with distances in the direction of the observations."""
    observed = cylinder_deflection()
    trials = {}
    for trial in TRIALS:
        skin = responses[trial, "cylinder"]
        profile = skin.surface_profile()
        cylinder = CylinderDeflection(
            **vars(_under_indenter(skin)),
            r2=deflection_r2(profile),
            r2_mirrored=deflection_r2(profile, proximal_positive=False),
        )
        line = _under_indenter(responses[trial, "line"])
        trials[trial] = TrialDeflection(line=line, cylinder=cylinder)
    return SkinDeflectionResult(
        **trials,
        observed=ObservedDeflection(
            distance_mm=observed.distance_mm,
            deflection_mm=observed.deflection_mm,
            is_artefact=observed.is_artefact,
        ),
    )


def _under_indenter(skin: SkinResponse) -> IndenterDeflection:
    profile = skin.surface_profile()
    shown = np.flatnonzero(np.abs(profile.distance_mm) <= SHOWN_MM)[::-1]
    return IndenterDeflection(
        distance_mm=-profile.distance_mm[shown],
        deflection_mm=profile.deflection_mm[shown],
        force_mn=float(skin.force_mn[-1]),
        peak_force_mn=float(skin.force_mn.max()),
        penetration_mm=skin.penetration_mm,
    )


PLATE_DEPTHS_MM = (1.0, 2.0)  # Depths of the flat plate, at which forces of people were observed. [mm]


@result_class
class SkinForce:
    """Deflection and force with the tissues of the run."""

    deflection_r2: Number  # R² of the deflection under the cylinder, see `deflection_r2`.
    plate_1mm_n: Number
    plate_2mm_n: Number  # Force of a flat plate at the end of the hold, 1.0 and 2.0 mm deep. [N]
    disc_1mm_n: Number  # Force of a flat disc of 6.35 mm diameter at the end of the hold, 1.0 mm deep. [N]


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
    force_n = {name: float(skin.force_mn[-1]) / MN_PER_N for name, skin in responses.items()}
    return SkinForce(
        deflection_r2=deflection_r2(responses["cylinder"].surface_profile()),
        plate_1mm_n=force_n[plate(1.0)],
        plate_2mm_n=force_n[plate(2.0)],
        disc_1mm_n=force_n["disc"],
    )
