"""Steps in time and tolerances of a press.

Contact and steps about a small body or a sharp edge are scaled by the smallest elements of its mesh. Skin is
stretched several times there, lies on few nodes and slides round the edge node by node. What each number is
good for is measured in docs/decisions/small-bodies.md.
"""

from __future__ import annotations

from dataclasses import field, replace

import numpy as np

from fingerpad.core.checked import value_class
from fingerpad.core.errors import InputError
from fingerpad.core.values import Count, FloatArray, Numbers, Positive, increasing
from fingerpad.geometry.indenters import Indenter
from fingerpad.geometry.mesh import Mesh
from fingerpad.geometry.motion import Motion
from fingerpad.geometry.size_field import STEP_MM, details_of
from fingerpad.mechanics.assembly import Sparsity
from fingerpad.mechanics.contact import Contact, Middles
from fingerpad.mechanics.newton import NewtonSettings

LONGEST_STEP = 1.0
"""Largest advance of the indenter in one step, over the smallest elements. In longer steps, skin at the rim
of a punch of 1 mm slid off it where shorter ones hold it."""

LONGEST_SLIDE, LONGEST_FREE_SLIDE = 1.0 / 6, 0.5
"""Longest way aside of an edge in one step, over its radius, with and without friction. The force on a node
rises and falls as it passes the edge, and with longer steps the heat of friction there is not found. Without
friction half balls of 0.5 mm take 11 Newton steps for 0.25 mm as for 0.06 mm."""

LEAST_PENETRATION = 0.1  # Penetration that is accepted at any depth, over the smallest elements.

SAGS, SAG_OF_WIDTH = (0.125, 0.5), 1.0 / 60
"""Least and largest sag of a facet that follows the body, over the smallest elements, and the sag over the
half-width. The least is that of a chord as long as the radius. With the least everywhere, nodes and middles
at the edge of a wide body take turns in contact, and each turn loses a little work."""

STIFFNESS_KPA, SOFTER_KPA = 20_000.0, 2_000.0
"""Penalty of contact, times the smallest elements, and that of a body without friction that is pressed by a
force or moves aside. Such a body presses with 300 kPa and more on skin that is stretched. Each augmentation
that corrects a penetration sets points there free, so they may not penetrate by more than a few percent of
these elements. Without friction points pass an edge one after the other, and the stiffer they are the further
each throws the others: half balls at 480 mN took 23 Newton steps, with the stiffer penalty 44. [kPa]"""

STICK_PENALTY = 60_000.0
"""Stiffness per area of skin that sticks. Softer skin yields by a good part of an element under 1 MPa; with a
stiffer one the renewal of friction finds no end. [kPa/mm]"""

MORE_NEWTON_STEPS = 3
"""Newton steps of one search, over those of others: nodes find their place one after the other, and friction
is renewed after each."""


def contact_about(
    contact: Contact, mesh: Mesh, sparsity: Sparsity, finest_mm: float, motion: Motion
) -> Contact:
    """Let contact act between nodes too, and as stiffly as small elements need."""
    middles = Middles.of(mesh, sparsity, contact.nodes, sag_mm(contact.indenter, finest_mm))
    stiff = contact.friction > 0.0 or (motion.stays and not motion.by_force)
    penalty = (STIFFNESS_KPA if stiff else SOFTER_KPA) / finest_mm
    return replace(contact, penalty=penalty, stick_penalty=STICK_PENALTY, middles=middles)


def sag_mm(indenter: Indenter, finest_mm: float) -> float:
    """How deep the middle of a facet may lie within a small body. [mm]"""
    half_mm = details_of(indenter).narrowest_mm / 2
    least, most = SAGS
    return float(np.clip(SAG_OF_WIDTH * half_mm, least * finest_mm, most * finest_mm))


def newton_about(newton: NewtonSettings, finest_mm: float) -> NewtonSettings:
    """Let a search go on through indefinite tangents, for longer, to a penetration that points can reach."""
    return replace(
        newton,
        persistent=True,
        most_iterations=MORE_NEWTON_STEPS * newton.most_iterations,
        least_penetration_mm=LEAST_PENETRATION * finest_mm,
    )


def steps_of_advance(advance_mm: float, finest_mm: float) -> int:
    """Return the number of equal steps of an advance, none of them longer than allowed."""
    return _steps(advance_mm, LONGEST_STEP * finest_mm)


def steps_of_slide(way_mm: float, indenter: Indenter, finest_mm: float, sticks: bool) -> int:
    """Return the number of equal steps of a way aside, none of them longer than the edges allow.

    Edges that are sharper than any mesh made for them count as round as the sharpest of these. Without
    friction a step may always be as long as the smallest elements.
    """
    radius_mm = max(details_of(indenter).sharpest_mm, STEP_MM)
    freely_mm = max(LONGEST_FREE_SLIDE * radius_mm, LONGEST_STEP * finest_mm)
    return _steps(way_mm, LONGEST_SLIDE * radius_mm if sticks else freely_mm)


def _steps(way_mm: float, longest_mm: float) -> int:
    return max(1, int(np.ceil(way_mm / longest_mm - 1e-9)))


MOST_SOLVED = 10  # Equal cycles up to which all are solved.

PENETRATION_SHARE = 0.1
"""Largest penetration over depth, as a share of the tolerance of SED: SED grows as the square of depth or
faster, and what augmentation leaves open differs from step to step."""

SAME_TIME = 1e-9  # Times closer than this, over the end of the motion, are one.


@value_class
class PressSettings:
    """Steps in time and tolerances of a press.

    Parameters
    ----------
    ramp_steps, hold_steps : int
        Steps in the two phases; with a tolerance of SED, the steps of this division that are tried first.
    newton : NewtonSettings
        Tolerances of each step.
    sed_tolerance : float, optional
        If given, steps are as long as this bound on the error of SED in time allows, between the steps too
        when SED is taken as linear there. It is relative to the largest SED and holds in the living
        epidermis, or everywhere in a mesh without one.
    times_ms : tuple of float
        Times at which the result is wanted, beside those of the steps; each is solved at exactly. [ms]
    cycle_tolerance : float, optional
        Of a motion with more than `MOST_SOLVED` equal cycles, only so many are solved as this bound on the
        error of SED asks for, and the others are interpolated (see `cycles`). It is relative to the largest
        SED, at the same places. None solves all of them, as do friction and `sed_tolerance`.
    """

    ramp_steps: Count = 8
    hold_steps: Count = 8
    newton: NewtonSettings = field(default_factory=NewtonSettings)
    sed_tolerance: Positive | None = None
    times_ms: Numbers = ()
    cycle_tolerance: Positive | None = 0.01

    def __post_init__(self) -> None:
        if increasing("times_ms", self.times_ms).size and self.times_ms[0] <= 0.0:
            raise InputError("times_ms", "must lie above 0, which is solved anyway", f"{self.times_ms[0]:g}")
        for name in ("sed_tolerance", "cycle_tolerance"):
            tolerance = getattr(self, name)
            if tolerance is not None and tolerance >= 1.0:
                raise InputError(name, "must be below 1", repr(tolerance))

    def steps_ms(self, motion: Motion, sticks: bool = True) -> FloatArray:
        """List the times to solve a motion at, from 0, without a tolerance of SED. [ms]"""
        return self._with_wanted(motion, motion.step_times_ms(self.ramp_steps, self.hold_steps, sticks))

    def smooth_ends_ms(self, motion: Motion) -> FloatArray:
        """List the ends of the parts of a motion within which a tolerance of SED chooses the steps. [ms]"""
        return self._with_wanted(motion, np.array([*motion.corners_ms, motion.end_ms]))

    def _with_wanted(self, motion: Motion, times_ms: FloatArray) -> FloatArray:
        wanted = np.array(self.times_ms)
        if wanted.size and wanted[-1] > motion.end_ms:
            raise InputError(
                "times_ms",
                f"must lie within the motion, which ends at {motion.end_ms:g} ms",
                f"{wanted[-1]:g} ms",
            )
        # A step of no length cannot be solved, so that a time which is there but for rounding stays as it is.
        apart = np.abs(wanted[:, None] - times_ms).min(axis=1) > SAME_TIME * motion.end_ms
        return np.union1d(times_ms, wanted[apart])

    def newton_about(self, finest_mm: float) -> NewtonSettings:
        """Tolerances of each step, tight enough for the bound on SED, and those of a small body about one.

        Parameters
        ----------
        finest_mm : float
            Size of the smallest elements about a small body; infinite about others. [mm]
        """
        newton = newton_about(self.newton, finest_mm) if np.isfinite(finest_mm) else self.newton
        if self.sed_tolerance is None:
            return newton
        penetration = min(newton.penetration_tolerance, PENETRATION_SHARE * self.sed_tolerance)
        return replace(newton, penetration_tolerance=penetration)
