"""Steps in time and tolerances of a press."""

from __future__ import annotations

from dataclasses import dataclass, field, replace

import numpy as np

from fingerpad.core.checks import FloatArray, float_array, increasing, positive, whole
from fingerpad.core.errors import InputError
from fingerpad.core.keywords import KnownKeywords
from fingerpad.core.values import converted
from fingerpad.geometry.motion import Motion
from fingerpad.mechanics.newton import NewtonSettings
from fingerpad.mechanics.small_bodies import newton_about

MOST_SOLVED = 10
"""Equal cycles up to which all are solved."""

PENETRATION_SHARE = 0.1
"""Largest penetration over depth, as a share of the tolerance of SED: SED grows as the square of depth or
faster, and what augmentation leaves open differs from step to step."""

SAME_TIME = 1e-9
"""Times closer than this, over the end of the motion, are one."""


@dataclass(frozen=True)
@converted
class PressSettings(metaclass=KnownKeywords):
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

    ramp_steps: int = 8
    hold_steps: int = 8
    newton: NewtonSettings = field(default_factory=NewtonSettings)
    sed_tolerance: float | None = None
    times_ms: tuple[float, ...] = ()
    cycle_tolerance: float | None = 0.01

    def __post_init__(self) -> None:
        wanted = increasing("times_ms", float_array("times_ms", self.times_ms, 1))
        if wanted.size and wanted[0] <= 0.0:
            raise InputError(f"times_ms must lie above 0, which is solved anyway: got {wanted[0]:g}.")
        object.__setattr__(self, "times_ms", tuple(wanted.tolist()))
        whole("ramp_steps", self.ramp_steps, at_least=1)
        whole("hold_steps", self.hold_steps, at_least=1)
        for name in ("sed_tolerance", "cycle_tolerance"):
            tolerance = getattr(self, name)
            if tolerance is not None and positive(name, tolerance) >= 1.0:
                raise InputError(f"{name} must be below 1: got {tolerance!r}.")

    def steps_ms(self, motion: Motion) -> FloatArray:
        """List the times to solve a motion at, from 0, without a tolerance of SED. [ms]"""
        return self._with_wanted(motion, motion.step_times_ms(self.ramp_steps, self.hold_steps))

    def smooth_ends_ms(self, motion: Motion) -> FloatArray:
        """List the ends of the parts of a motion within which a tolerance of SED chooses the steps. [ms]"""
        return self._with_wanted(motion, np.array([*motion.corners_ms, motion.end_ms]))

    def _with_wanted(self, motion: Motion, times_ms: FloatArray) -> FloatArray:
        wanted = np.array(self.times_ms)
        if wanted.size and wanted[-1] > motion.end_ms:
            raise InputError(
                f"times_ms must lie within the motion, which ends at {motion.end_ms:g} ms: got "
                f"{wanted[-1]:g} ms."
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
