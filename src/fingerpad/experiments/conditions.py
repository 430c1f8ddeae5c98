"""What the studies have in common: finger, tissues, meshes and steps."""

from __future__ import annotations

from dataclasses import field, replace
from typing import Annotated

import numpy as np

from fingerpad.core.checked import value_class
from fingerpad.core.values import Count, Finite, Numbers, Seed, choice
from fingerpad.data import protocol, psychophysics
from fingerpad.data.tissues import DEFAULT_TISSUES
from fingerpad.geometry.bodies import Bar, Sphere
from fingerpad.geometry.fingertip import Finger, Fingertip
from fingerpad.geometry.grading import RESOLUTIONS, Grading, resolution_grading
from fingerpad.geometry.indenters import Indenter
from fingerpad.geometry.motion import Motion, RampAndHold
from fingerpad.geometry.size_field import grading_below
from fingerpad.mechanics.materials import Tissues
from fingerpad.mechanics.tissues import TISSUES
from fingerpad.neuron.afferent import Afferent
from fingerpad.skin.indentation import CONTACT_POINT_MM, settings_of, touch_of
from fingerpad.skin.indentation import Touch as Touch

CURVATURES = psychophysics.SPHERE_CURVATURES.value
POSITIONS_MM = protocol.SPHERE_POSITIONS.value
"""Spheres of the population study, the standard first, and their places along the finger. [1/m, mm]"""

RECEPTOR_X_MM = CONTACT_POINT_MM[0]  # `Conditions.receptor_x_mm` of the paper's finger. [mm]

BAR_REACH_MM = 2.6
"""Fine zone about the receptor in the bar study: an edge farther away hardly reaches it. [mm]"""

BAR_SIZE_MM = {"quick": (0.2, 0.6), "standard": (0.1, 0.5)}
"""Elements along and across under the bar. The shifts of 0.2 mm are whole elements, so that the mesh under
an edge looks the same from shift to shift. [mm]"""

SPHERE_REACH_MM = 2.8
"""Fine zone about the spheres, along and across: the contact and the population's outermost receptor. [mm]"""


def skin_tilt_deg(finger: Finger) -> float:
    """Tilt at which an indenter presses along the inward normal of the middle of the pad. [degrees]"""
    x, y, _ = np.ravel(finger.skin_normal(finger.skin_point(*finger.contact_mm)))
    return float(np.rad2deg(np.arctan2(x, -y)))


def straight_tilt_deg(finger: Finger, indenter: Indenter) -> float:
    """Tilt of an indenter that presses straight: none of a wire, which grips the skin. [degrees]"""
    return 0.0 if indenter.grips else skin_tilt_deg(finger)


@value_class
class Conditions:
    """Finger, tissues and accuracy of a reproduction."""

    resolution: Annotated[str, choice(RESOLUTIONS)] = "standard"  #: How fine meshes and steps are.
    seed: Seed = 0  #: Seed of the observer's noise.
    tissues: Annotated[str, choice(TISSUES)] | Tissues = DEFAULT_TISSUES
    """Tissues of all but the paper's three trials: a name, see `mechanics.tissues`, or your own."""
    finger: Finger = field(default_factory=Fingertip)  #: The finger.
    grading: Grading | None = None  #: Mesh instead of those that the resolution grades.
    receptor_depths_mm: Numbers = ()
    """Depths at which presses keep quantities, as of `fingerpad.indent`. [mm]"""

    @property
    def afferent(self) -> Afferent:
        """Afferent that was fitted with the tissues, see `Afferent.for_tissues`."""
        return Afferent.for_tissues(self.tissues)

    @property
    def receptor_x_mm(self) -> float:
        """Where the single receptor lies on the midline, and the middle of the population. [mm]"""
        return self.finger.contact_mm[0]

    @property
    def skin_tilt_deg(self) -> float:
        """As of the function `skin_tilt_deg`."""
        return skin_tilt_deg(self.finger)

    @property
    def along_skin(self) -> float:
        """Distance along the finger's axis over that along the skin at the receptor."""
        return float(np.cos(np.deg2rad(self.skin_tilt_deg)))

    def touch(
        self,
        indenter: Indenter,
        x_mm: Finite,
        grading: Grading,
        tissues: str | Tissues | None = None,
        tilt_deg: Finite = 0.0,
    ) -> Touch:
        """One touch of the paper's protocol, 1.0 mm in 50 ms, held for 950 ms, on the midline at x."""
        return touch_of(
            self.finger,
            indenter,
            tissues=tissues or self.tissues,
            resolution=self.resolution,
            at_mm=(x_mm, 0.0),
            grading=grading,
            tilt_deg=tilt_deg,
        )

    def probe_touch(
        self,
        indenter: Indenter,
        motion: Motion,
        hold_steps: Count | None = None,
        depths_mm: Numbers = (),
        grading: Grading | None = None,
    ) -> Touch:
        """One touch along the normal of the skin at the middle of the pad, above the receptor."""
        settings = settings_of(self.resolution)
        return touch_of(
            self.finger,
            indenter,
            motion,
            self.tissues,
            self.resolution,
            grading=grading or self.grading,
            tilt_deg=self.skin_tilt_deg,
            settings=replace(settings, hold_steps=hold_steps) if hold_steps else settings,
            receptor_depths_mm=depths_mm or self.receptor_depths_mm,
        )

    def sphere_touch(
        self, curvature_per_m: Finite, position_mm: Finite = 0.0, grading: Grading | None = None
    ) -> Touch:
        """One touch of the population study: a sphere along the skin's normal, centred on the receptors."""
        return self.touch(
            Sphere(curvature_per_m=curvature_per_m),
            self.receptor_x_mm + position_mm,
            grading or self.sphere_grading(),
            tilt_deg=self.skin_tilt_deg,
        )

    def bar_touches(self) -> list[Touch]:
        """36 touches of the bar, shifted along the finger.

        Its flat face stays parallel to the skin at the receptor (docs/decisions.md#bar-orientation). A
        positive shift moves the bar towards the proximal end (docs/decisions.md#bar-shift).
        """
        tilt, along, grading = self.skin_tilt_deg, self.along_skin, self.bar_grading()
        return [
            self.touch(Bar(), self.receptor_x_mm - shift * along, grading, tilt_deg=tilt)
            for shift in protocol.BAR_SHIFTS.value
        ]

    def sphere_touches(self) -> dict[tuple[float, float], Touch]:
        """Seven spheres at two positions along the finger; keys are position and curvature.

        They press along the skin's normal, so that a sphere at 0.0 mm is centred on the population.
        """
        return {
            (position, curvature): self.sphere_touch(curvature, position)
            for position in POSITIONS_MM
            for curvature in CURVATURES
        }

    def deflection_grading(self, indenter: Indenter) -> Grading:
        """Mesh of the skin deflection study: fine about the indenter."""
        at_mm = self.receptor_x_mm, 0.0
        return self.grading or grading_below(self.finger, indenter, self.resolution, at_mm, RampAndHold())

    def bar_grading(self) -> Grading:
        """Mesh of the single-unit study: fine about the receptor, the same for all shifts."""
        if self.grading is not None:
            return self.grading
        size = self.finger.relative_size
        grading = resolution_grading(self.resolution, self.receptor_x_mm, BAR_REACH_MM, 0.6, size)
        size_x, size_z = BAR_SIZE_MM.get(self.resolution, (grading.size_x_mm, grading.size_z_mm))
        return replace(grading, size_x_mm=size_x, size_z_mm=size_z)

    def sphere_grading(self) -> Grading:
        """Mesh of the population study: fine about both positions, the same for all spheres."""
        reach_mm, size = SPHERE_REACH_MM, self.finger.relative_size
        return self.grading or resolution_grading(
            self.resolution, self.receptor_x_mm, reach_mm, reach_mm, size
        )
