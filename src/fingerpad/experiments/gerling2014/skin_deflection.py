"""Level 1: deflection of the skin under a line load and a cylinder (paper, 2.2.1, 3.1 and Figure 4)."""

from __future__ import annotations

import numpy as np

from fingerpad.core.results import Number, TruthVector, Vector, result_class
from fingerpad.data import cylinder_deflection
from fingerpad.experiments.conditions import Conditions, Touch
from fingerpad.experiments.scores import coefficient_of_determination
from fingerpad.geometry.indenters import Cylinder, Indenter, Line
from fingerpad.skin.sampling import SkinResponse, SurfaceProfile

TRIALS = ("trial1", "trial2", "trial3")
INDENTERS: dict[str, Indenter] = {"line": Line(), "cylinder": Cylinder()}
SHOWN_MM = 10.0
"""Distance from the indenter up to which the profile is kept; the observations end at 9.25 mm. [mm]"""


@result_class
class IndenterDeflection:
    """Deflection of the skin under one indenter.

    Parameters
    ----------
    distance_mm, deflection_mm : array (n_nodes,)
        Profile along the midline: distance from the indenter's axis, proximal positive. [mm]
    force_mn, peak_force_mn : float
        Force at the end of the hold, and the largest force. [mN]
    penetration_mm : float
        Largest overlap of skin and indenter. [mm]
    """

    distance_mm: Vector
    deflection_mm: Vector
    force_mn: Number
    peak_force_mn: Number
    penetration_mm: Number


@result_class
class CylinderDeflection(IndenterDeflection):
    """Deflection of the skin under the cylinder, compared with the observations.

    Parameters
    ----------
    r2 : float
        Coefficient of determination, see `deflection_r2`.
    r2_mirrored : float
        The same with proximal and distal exchanged.
    """

    r2: Number
    r2_mirrored: Number


@result_class
class TrialDeflection:
    """Deflections with the tissues of one trial.

    Parameters
    ----------
    line : IndenterDeflection
        Under the line load.
    cylinder : CylinderDeflection
        Under the cylinder.
    """

    line: IndenterDeflection
    cylinder: CylinderDeflection


@result_class
class ObservedDeflection:
    """Observed deflection under the cylinder.

    Parameters
    ----------
    distance_mm, deflection_mm : array (n_points,)
        [mm]
    is_artefact : bool array (n_points,)
        Points that R² leaves out.
    """

    distance_mm: Vector
    deflection_mm: Vector
    is_artefact: TruthVector


@result_class
class SkinDeflectionResult:
    """Result of level 1.

    Parameters
    ----------
    trial1, trial2, trial3 : TrialDeflection
        By the tissues of the paper's trials.
    observed : ObservedDeflection
        What they are compared with.
    """

    trial1: TrialDeflection
    trial2: TrialDeflection
    trial3: TrialDeflection
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
    """Profiles, forces and R², with distances in the direction of the observations.

    Parameters
    ----------
    responses : dict of (trial, indenter) to SkinResponse
        Of all `deflection_touches`.
    """
    observed = cylinder_deflection()
    trials = {
        trial: TrialDeflection(
            line=_under_indenter(responses[trial, "line"]),
            cylinder=_under_cylinder(responses[trial, "cylinder"]),
        )
        for trial in TRIALS
    }
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


def _under_cylinder(skin: SkinResponse) -> CylinderDeflection:
    profile = skin.surface_profile()
    return CylinderDeflection(
        **vars(_under_indenter(skin)),
        r2=deflection_r2(profile),
        r2_mirrored=deflection_r2(profile, proximal_positive=False),
    )
