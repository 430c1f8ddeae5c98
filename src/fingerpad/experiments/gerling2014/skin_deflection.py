"""Level 1: deflection of the skin under a line load and a cylinder (paper, 2.2.1, 3.1 and Figure 4)."""

from __future__ import annotations

from typing import Any

import numpy as np
from numpy.typing import ArrayLike

from fingerpad.data import cylinder_deflection
from fingerpad.experiments.conditions import RECEPTOR_X_MM, Conditions, Touch
from fingerpad.geometry.indenters import Cylinder, Indenter, Line
from fingerpad.skin.sampling import SkinResponse, SurfaceProfile

TRIALS = ("trial1", "trial2", "trial3")
INDENTERS: dict[str, Indenter] = {"line": Line(), "cylinder": Cylinder()}
SHOWN_MM = 10.0
"""Distance from the indenter up to which the profile is kept; the observations end at 9.25 mm. [mm]"""


def touches(conditions: Conditions) -> dict[tuple[str, str], Touch]:
    """Six touches: three trials, two indenters."""
    return {
        (trial, name): conditions.touch(
            indenter, RECEPTOR_X_MM, conditions.deflection_grading(indenter), materials=trial
        )
        for trial in TRIALS
        for name, indenter in INDENTERS.items()
    }


def coefficient_of_determination(observed: ArrayLike, predicted: ArrayLike) -> float:
    """R² = 1 - sum (observed - predicted)² / sum (observed - mean)².

    Examples
    --------
    >>> coefficient_of_determination([0.0, 1.0, 2.0], [0.0, 1.0, 2.0])
    1.0
    """
    observed, predicted = np.asarray(observed, dtype=float), np.asarray(predicted, dtype=float)
    scatter = ((observed - observed.mean()) ** 2).sum()
    return float(1.0 - ((observed - predicted) ** 2).sum() / scatter)


def deflection_r2(profile: SurfaceProfile, proximal_positive: bool = True) -> float:
    """R² of a profile against the observed deflection under the cylinder, its marked artefact left out.

    The source does not say which end of the finger its positive distances point to. Read as proximal they
    fit better (docs/decisions/deflection-direction.md); `proximal_positive` False reads them as distal.
    """
    observed = cylinder_deflection()
    kept = ~observed.is_artefact
    distance = observed.distance_mm[kept] * (-1.0 if proximal_positive else 1.0)
    return coefficient_of_determination(observed.deflection_mm[kept], profile.at(distance))


def result(responses: dict[tuple[str, str], SkinResponse]) -> dict[str, Any]:
    """Profiles, forces and R², with distances in the direction of the observations."""
    found: dict[str, Any] = {trial: {} for trial in TRIALS}
    for (trial, name), skin in responses.items():
        profile = skin.surface_profile()
        shown = np.flatnonzero(np.abs(profile.distance_mm) <= SHOWN_MM)[::-1]
        found[trial][name] = {
            "distance_mm": -profile.distance_mm[shown],
            "deflection_mm": profile.deflection_mm[shown],
            "force_mn": skin.force_mn[-1],
            "peak_force_mn": skin.force_mn.max(),
            "penetration_mm": skin.penetration_mm,
        }
        if name == "cylinder":
            found[trial][name]["r2"] = deflection_r2(profile)
            found[trial][name]["r2_mirrored"] = deflection_r2(profile, proximal_positive=False)
    observed = cylinder_deflection()
    found["observed"] = {
        "distance_mm": observed.distance_mm,
        "deflection_mm": observed.deflection_mm,
        "is_artefact": observed.is_artefact,
    }
    return found
