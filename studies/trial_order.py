"""Order of Trials 1 to 3 in deflection, for every substitute of the lost coefficients.

Over each pair of inner layers a soft epidermis (Trials 1 and 3) is exchanged for a stiff one (Trial 2), and
Maeno's inner layers (Trial 1) for the others (Trial 3), at the same depth and at the same force.
"""

from __future__ import annotations

from collections.abc import Mapping

import numpy as np

from fingerpad.core.checks import positive
from fingerpad.core.errors import InputError
from fingerpad.core.results import result_class
from fingerpad.data import cylinder_deflection
from fingerpad.experiments.conditions import RECEPTOR_X_MM, Conditions, Touch
from fingerpad.geometry.indenters import Cylinder
from fingerpad.mechanics.materials import Tissues
from fingerpad.mechanics.tissues import named_tissues
from fingerpad.skin.sampling import SkinResponse, SurfaceProfile
from studies.tissue_candidates import (
    NU,
    SOFT_EPIDERMIS_KPA,
    STIFF_EPIDERMIS_KPA,
    layered,
    wu_polynomials,
)

NEAR_MM, FAR_MM = 0.5, 5.0
"""Regions of the paper: skin within 0.5 mm of the indenter, and from there to 5 mm. [mm]"""

EPIDERMES_KPA = {"soft": SOFT_EPIDERMIS_KPA, "stiff": STIFF_EPIDERMIS_KPA}
_DISTANCES_MM = np.linspace(-FAR_MM, FAR_MM, 201)


@result_class
class Excess:
    """Mean difference of two deflections up to `NEAR_MM` from the indenter, and on to `FAR_MM`. [mm]"""

    near_mm: float
    far_mm: float


@result_class
class TrialDifference:
    """One trial against another.

    Parameters
    ----------
    same_depth, same_force : Excess
        Deflection of the first minus the second at the same depth and at the same force.
    force_ratio : float
        Force of the first over the second at the end of the ramp. [1]
    """

    same_depth: Excess
    same_force: Excess
    force_ratio: float


@result_class
class TrialOrder:
    """Comparison of the trials.

    Parameters
    ----------
    observed : dict of Excess
        Each set against the observations at 1 mm.
    stiff_epidermis : dict of TrialDifference
        Trial 2 against Trial 3, by inner layers.
    inner_layers : dict of TrialDifference
        Trial 1 against Trial 3, by the inner layers of Trial 3.
    """

    observed: dict[str, Excess]
    stiff_epidermis: dict[str, TrialDifference]
    inner_layers: dict[str, TrialDifference]


def inner_layers() -> dict[str, Tissues]:
    """Substitutes whose dermis and subcutis are compared; Maeno's are those of Trial 1."""
    return {
        "Maeno": named_tissues("trial1"),
        "identified": named_tissues("trial3"),
        "Wu polynomial": layered(SOFT_EPIDERMIS_KPA, *wu_polynomials(NU, NU)),
        "laboratory 2014": named_tissues("gerling2014_fit"),
    }


def touches(conditions: Conditions) -> dict[tuple[str, str], Touch]:
    """One press of the cylinder for each inner layer and epidermis."""
    cylinder = Cylinder()
    grading = conditions.deflection_grading(cylinder)
    return {
        (inner, epidermis): conditions.touch(
            cylinder, RECEPTOR_X_MM, grading, layered(shear, tissues.dermis, tissues.subcutis)
        )
        for inner, tissues in inner_layers().items()
        for epidermis, shear in EPIDERMES_KPA.items()
    }


def ramp_force_mn(skin: SkinResponse) -> float:
    """Force at the end of the ramp. [mN]"""
    return float(np.interp(skin.kinks_ms[0], skin.times_ms, skin.force_mn))


def profile_at_force(skin: SkinResponse, force_mn: float) -> SurfaceProfile:
    """Surface profile when the force passes a value on the ramp, linear in force between computed steps.

    Parameters
    ----------
    skin : SkinResponse
        A press whose force grows along the ramp.
    force_mn : float
        Above 0 and at most the force at the end of the ramp. [mN]

    Returns
    -------
    SurfaceProfile

    Raises
    ------
    InputError
        If the ramp does not reach the force.
    """
    steps = np.flatnonzero(skin.times_ms <= skin.kinks_ms[0] * (1.0 + 1e-9))
    largest = skin.force_mn[steps].max()
    if positive("force_mn", force_mn, "mN") > largest * (1.0 + 1e-9):
        raise InputError(f"force_mn must be at most {largest:.4g} mN, where the ramp ends: got {force_mn:g}.")
    profiles = [skin.surface_profile(int(step)) for step in steps]
    position = np.interp(force_mn, skin.force_mn[steps], np.arange(steps.size))
    below = min(int(position), steps.size - 2)
    share = position - below
    deflection = (1.0 - share) * profiles[below].deflection_mm + share * profiles[below + 1].deflection_mm
    return SurfaceProfile(profiles[below].distance_mm, deflection)


def excess(more: SurfaceProfile, less: SurfaceProfile) -> Excess:
    """Return the mean difference of two profiles near the indenter and farther away. [mm]"""
    difference = more.at(_DISTANCES_MM) - less.at(_DISTANCES_MM)
    near = np.abs(_DISTANCES_MM) <= NEAR_MM
    return Excess(near_mm=difference[near].mean(), far_mm=difference[~near].mean())


def excess_over_observed(profile: SurfaceProfile) -> Excess:
    """Return the mean difference of a profile from the one observed under the cylinder. [mm]"""
    observed = cylinder_deflection()
    # Positive distances of the observations point to the proximal end, those of a profile to the distal one.
    order = np.argsort(-observed.distance_mm)
    return excess(profile, SurfaceProfile(-observed.distance_mm[order], observed.deflection_mm[order]))


def result(responses: Mapping[tuple[str, str], SkinResponse]) -> TrialOrder:
    """Compare the trials, by inner layers and epidermis.

    Parameters
    ----------
    responses : mapping of SkinResponse
        From `touches`.

    Returns
    -------
    TrialOrder
    """

    def compared(more: tuple[str, str], less: tuple[str, str]) -> TrialDifference:
        first, second = responses[more], responses[less]
        force = min(ramp_force_mn(first), ramp_force_mn(second))
        return TrialDifference(
            same_depth=excess(first.surface_profile(), second.surface_profile()),
            same_force=excess(profile_at_force(first, force), profile_at_force(second, force)),
            force_ratio=ramp_force_mn(first) / ramp_force_mn(second),
        )

    inner = list(inner_layers())
    return TrialOrder(
        observed={
            f"{name}, {epidermis} epidermis": excess_over_observed(skin.surface_profile())
            for (name, epidermis), skin in responses.items()
        },
        stiff_epidermis={name: compared((name, "stiff"), (name, "soft")) for name in inner},
        inner_layers={name: compared(("Maeno", "soft"), (name, "soft")) for name in inner[1:]},
    )


def order_holds(found: TrialOrder, inner: str, at: str, direction: float = 1.0) -> bool:
    """Return whether Trial 1 exceeds Trial 3 and Trial 3 exceeds Trial 2 in both regions, as in the paper.

    Parameters
    ----------
    found : TrialOrder
        From `result`.
    inner : str
        Inner layers of Trials 2 and 3.
    at : {"same_depth", "same_force"}
        How the trials are compared.
    direction : float
        1 if "overshoot" means more deflection, -1 if it means less: above, on an axis that points down.

    Returns
    -------
    bool
    """
    above = getattr(found.inner_layers[inner], at)
    below = getattr(found.stiff_epidermis[inner], at)
    return all(
        direction * more > 0.0 and direction * less < 0.0
        for more, less in ((above.near_mm, below.near_mm), (above.far_mm, below.far_mm))
    )
