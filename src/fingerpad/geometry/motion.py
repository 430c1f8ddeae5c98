"""Motion of the indenter: what all motions have, and ramp and hold of its depth or force."""

from __future__ import annotations

from abc import ABC, abstractmethod
from typing import Annotated

import numpy as np
from numpy.typing import ArrayLike

from fingerpad.core.checked import checked_class, value_class
from fingerpad.core.phases import Phase, ramp_and_hold_phases
from fingerpad.core.values import Count, Finite, FloatArray, NotNegative, Positive, Whole, float_array, limits
from fingerpad.data import protocol

_TIMES_MS = (1e-6, 1e13)  # Of a ramp or hold; a quasi-static ramp of a validation takes 1e12 ms. [ms]

PLAUSIBLE = {"depth_mm": (1e-3, 20.0), "force_mn": (1.0, 1e5), "ramp_ms": _TIMES_MS, "hold_ms": _TIMES_MS}
"""Smallest and largest peaks and times of a touch: an afferent answers to 1 mN, and pads are 10 mm thick."""

DepthMm = Annotated[float, limits(*PLAUSIBLE["depth_mm"])]
ForceMn = Annotated[float, limits(*PLAUSIBLE["force_mn"])]
PhaseMs = Annotated[float, limits(*_TIMES_MS)]  # Of a ramp or a hold.


@value_class
class Pose:
    """How far an indenter has moved and turned since first touch, beside its advance."""

    x_mm: Finite = 0.0
    z_mm: Finite = 0.0  # Way of its tip along the finger, distal positive, and across it. [mm]
    tilt_deg: Finite = 0.0
    spin_deg: Finite = 0.0  # Rotations about its tip, added to those of the `Touch`. [degrees]

    @property
    def way(self) -> FloatArray:
        """Ways in mm and rotations over `TURN_LIKE_MM`, numbers of one order, (4,)."""
        return np.array([self.x_mm, self.z_mm, self.tilt_deg / TURN_LIKE_MM, self.spin_deg / TURN_LIKE_MM])


@value_class
class Cycles:
    """A part of a motion that repeats itself.

    Parameters
    ----------
    start_ms, period_ms : float
        Its start and the length of a cycle. [ms]
    count : int
        Number of cycles.

    Examples
    --------
    >>> Cycles(start_ms=100.0, period_ms=10.0, count=50).end_ms
    600.0
    """

    start_ms: NotNegative
    period_ms: Positive
    count: Count

    @property
    def end_ms(self) -> float:
        """End of the last cycle. [ms]"""
        return self.start_ms + self.count * self.period_ms


STILL = Pose()

TURN_LIKE_MM = 10.0  # Rotation that takes as many steps as all of the depth. [degrees]


@checked_class
class Motion(ABC):
    """What an indenter does over time: common part of all motions.

    A motion prescribes the depth of the indenter, or its force. It is linear in time between some times.
    """

    by_force: bool = False  # Whether the force is prescribed instead of the depth.

    cycles: Cycles | None = None
    """The part that repeats itself, if there is one: not all of its cycles need be solved."""

    given_samples: bool = False  # Whether a user gave the samples, so that errors name them.

    @property
    def samples_ms(self) -> tuple[float, ...]:
        """Times between which the motion is linear in time, from 0 to its end. [ms]"""
        return 0.0, *self.corners_ms, self.end_ms

    @property
    def onset_ms(self) -> float:
        """Time of first touch of the undeformed skin, from which phases and latencies count. [ms]"""
        return 0.0

    @property
    def poses(self) -> tuple[Pose, ...]:
        """Poses between which the indenter moves, in order; one if it only goes up and down."""
        return (STILL,)

    def pose_at(self, time_ms: Finite) -> Pose:
        """Pose of the indenter at a time [ms]."""
        return STILL

    def course_at(self, time_ms: Finite) -> FloatArray:
        """Where the motion is at a time [ms]: depth or force over the largest, and `Pose.way`, (5,)."""
        return np.array([float(self.prescribed_at(time_ms)) / self.largest, *self.pose_at(time_ms).way])

    @property
    def stays(self) -> bool:
        """Whether the indenter only goes up and down."""
        return self.poses == (STILL,)

    @property
    @abstractmethod
    def corners_ms(self) -> tuple[float, ...]:
        """Times after the start at which the speed jumps, without the end. [ms]"""

    @property
    @abstractmethod
    def phases(self) -> tuple[Phase, ...]:
        """Named phases, in order; rates are counted in "ramp" and "hold"."""

    @property
    @abstractmethod
    def end_ms(self) -> float:
        """End of the motion. [ms]"""

    @property
    @abstractmethod
    def largest(self) -> float:
        """Largest depth [mm] or force [mN]."""

    @property
    def depths_mm(self) -> tuple[float, ...]:
        """Prescribed depth in each of `poses`, the largest if there is only one. [mm]"""
        return (self.largest,)

    @abstractmethod
    def prescribed_at(self, times_ms: ArrayLike) -> FloatArray:
        """Depth [mm] or force [mN] at `times_ms`, any shape."""

    @abstractmethod
    def step_times_ms(self, ramp_steps: Whole, hold_steps: Whole) -> FloatArray:
        """List the times to solve at, from 0. [ms]"""


class _OneRamp(Motion):
    """A ramp at a constant rate from 0, then a hold."""

    keywords_of_others = {"depth_mm": "RampAndHold", "force_mn": "ForceRampAndHold"}  # noqa: RUF012

    ramp_ms: float
    hold_ms: float

    @property
    def end_ms(self) -> float:
        return self.ramp_ms + self.hold_ms

    @property
    def corners_ms(self) -> tuple[float, ...]:
        return (self.ramp_ms,)

    @property
    def phases(self) -> tuple[Phase, ...]:
        return ramp_and_hold_phases(self.ramp_ms, self.end_ms)

    def prescribed_at(self, times_ms: ArrayLike) -> FloatArray:
        return self.largest * np.clip(float_array("times_ms", times_ms, None) / self.ramp_ms, 0.0, 1.0)

    def step_times_ms(self, ramp_steps: int, hold_steps: int) -> FloatArray:
        """List the times to solve at: 0, equal ramp steps, hold steps that grow geometrically. [ms]"""
        # The first hold step is as long as a ramp step, or shorter for a short hold, because relaxation is
        # fastest right after the ramp.
        ramp = np.linspace(0.0, self.ramp_ms, ramp_steps + 1)
        return np.concatenate(
            [ramp, self.ramp_ms + hold_ends_ms(self.hold_ms, self.ramp_ms / ramp_steps, hold_steps)]
        )


@value_class
class RampAndHold(_OneRamp):
    """Indent at constant speed to a depth, then hold it.

    Parameters
    ----------
    depth_mm : float
        Depth of the hold, from first touch of the undeformed skin along the direction of pressing. [mm]
    ramp_ms : float
        Duration of the ramp. [ms]
    hold_ms : float
        Duration of the hold. [ms]

    Examples
    --------
    >>> motion = RampAndHold(depth_mm=1.0, ramp_ms=50.0, hold_ms=950.0)
    >>> motion.prescribed_at([0.0, 25.0, 50.0, 400.0]).tolist()
    [0.0, 0.5, 1.0, 1.0]
    """

    depth_mm: DepthMm = protocol.DEPTH.value
    ramp_ms: PhaseMs = protocol.RAMP.value
    hold_ms: PhaseMs = protocol.HOLD.value

    @property
    def largest(self) -> float:
        return self.depth_mm


@value_class
class ForceRampAndHold(_OneRamp):
    """Press with a force that grows at a constant rate, then hold it: the skin creeps.

    Parameters
    ----------
    force_mn : float
        Force of the hold along the direction of pressing, on the whole finger. [mN]
    ramp_ms : float
        Duration of the ramp. [ms]
    hold_ms : float
        Duration of the hold. [ms]

    Examples
    --------
    >>> motion = ForceRampAndHold(force_mn=100.0, ramp_ms=50.0, hold_ms=950.0)
    >>> motion.prescribed_at([0.0, 25.0, 400.0]).tolist()
    [0.0, 50.0, 100.0]
    """

    force_mn: ForceMn
    ramp_ms: PhaseMs = protocol.RAMP.value
    hold_ms: PhaseMs = protocol.HOLD.value

    by_force = True

    @property
    def largest(self) -> float:
        return self.force_mn


def hold_ends_ms(length_ms: float, first_ms: float, steps: int) -> FloatArray:
    """Return ends of the steps of a hold since its start, growing from `first_ms` or less. [ms]"""
    ends = np.geomspace(min(first_ms, length_ms / steps), length_ms, steps)
    ends[-1] = length_ms
    return ends


Stimulus = Motion  # What a touch asks for: a motion by depth or by force.
