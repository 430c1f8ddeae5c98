"""Motion of the indenter: a table of depth or force, place and rotation over time, and ramp and hold."""

from __future__ import annotations

from abc import ABC, abstractmethod
from dataclasses import field, replace
from functools import cached_property
from typing import Annotated, Any

import numpy as np
from numpy.typing import ArrayLike

from fingerpad.core.checked import checked_class, value_class
from fingerpad.core.errors import InputError
from fingerpad.core.phases import Phase, ramp_and_hold_phases
from fingerpad.core.units import unit_of
from fingerpad.core.values import (
    Count,
    Finite,
    FloatArray,
    Many,
    NotNegative,
    Numbers,
    Positive,
    Whole,
    float_array,
    increasing,
    limits,
    positive,
    within,
)
from fingerpad.data import protocol
from fingerpad.geometry.courses import (
    SAME,
    check_speed,
    corners_of,
    divided_ms,
    extent_of,
    onset_of,
    phases_of,
    samples_of_line,
    step_times_of,
)
from fingerpad.geometry.fingertip import Finger

_TIMES_MS = (1e-6, 1e13)  # Of a ramp or hold; a quasi-static ramp of a validation takes 1e12 ms. [ms]

TOLERANCE = 0.005  # Largest error of a motion with fewer samples, over the extent of each of its columns.

PLAUSIBLE = {"depth_mm": (1e-3, 20.0), "force_mn": (1.0, 1e5), "ramp_ms": _TIMES_MS, "hold_ms": _TIMES_MS}
"""Smallest and largest peaks and times of a touch: an afferent answers to 1 mN, and pads are 10 mm thick."""

TURN_LIKE_MM = 10.0  # Rotation that takes as many steps as all of the depth. [degrees]

DepthMm = Annotated[float, limits(*PLAUSIBLE["depth_mm"])]
ForceMn = Annotated[float, limits(*PLAUSIBLE["force_mn"])]
PhaseMs = Annotated[float, limits(*_TIMES_MS)]  # Of a ramp or a hold.


@value_class
class Pose:
    """How far an indenter has moved and turned since first touch, beside its advance."""

    x_mm: Finite = 0.0
    z_mm: Finite = 0.0  #: Way of its tip along the finger, distal positive, and across it. [mm]
    tilt_deg: Finite = 0.0
    spin_deg: Finite = 0.0  #: Rotations about its tip, added to those of the `Touch`. [degrees]


STILL = Pose()
POSE_COLUMNS = tuple(vars(STILL))  # Columns of a motion beside its depth or force.


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


@checked_class
class Motion(ABC):
    """What an indenter does over time: a table of depth or force, place and rotation, and named phases.

    All is linear between the samples.
    """

    by_force: bool = False  #: Whether the force is prescribed instead of the depth.
    cycles: Cycles | None = None  #: The part that repeats itself: not all of its cycles need be solved.

    @property
    @abstractmethod
    def samples_ms(self) -> tuple[float, ...]:
        """Times of the samples, from 0 to the end of the motion. [ms]"""

    @property
    @abstractmethod
    def prescribed(self) -> tuple[float, ...]:
        """Depth [mm] or force [mN] at the samples."""

    @property
    @abstractmethod
    def phases(self) -> tuple[Phase, ...]:
        """Named phases, in order; rates are counted in "ramp" and "hold"."""

    @property
    def ways(self) -> FloatArray:
        """`POSE_COLUMNS` at the samples, (n_samples, 4). [mm, degrees]"""
        return np.zeros((len(self.samples_ms), len(POSE_COLUMNS)))

    @property
    def end_ms(self) -> float:
        """End of the motion. [ms]"""
        return self.samples_ms[-1]

    @property
    def largest(self) -> float:
        """Largest depth [mm] or force [mN]."""
        return max(self.prescribed)

    @cached_property
    def stays(self) -> bool:
        """Whether the indenter only goes up and down."""
        return not self.ways.any()

    @cached_property
    def onset_ms(self) -> float:
        """Time of first touch: where the course last leaves 0 before it exceeds 2 % of the largest. [ms]"""
        return onset_of(np.array(self.samples_ms), np.array(self.prescribed))

    @cached_property
    def corners_ms(self) -> tuple[float, ...]:
        """First touch, and later samples at which the speed jumps, other than along a smooth curve. [ms]"""
        times, course = self._course([self.onset_ms], self.onset_ms)
        corners = np.concatenate([times[:1] > 0.0, corners_of(times, course), [False]])
        return tuple(times[corners].tolist())

    @cached_property
    def looks_ms(self) -> FloatArray:
        """Samples, and times between them where it turns further than `TURN_LIKE_MM` degrees at once. [ms]"""
        turned = np.abs(np.diff(self.ways[:, 2:], axis=0)).max(axis=1)
        return divided_ms(self.samples_ms, turned / TURN_LIKE_MM)

    @cached_property
    def poses(self) -> tuple[Pose, ...]:
        """Poses between which the indenter moves, at `looks_ms`; one if it only goes up and down."""
        return (STILL,) if self.stays else tuple(self.pose_at(time) for time in self.looks_ms.tolist())

    @property
    def depths_mm(self) -> tuple[float, ...]:
        """Prescribed depth in each of `poses`, the largest if there is only one. [mm]"""
        return (self.largest,) if self.stays else tuple(self.prescribed_at(self.looks_ms).tolist())

    def pose_at(self, time_ms: Finite) -> Pose:
        """Pose of the indenter at a time [ms]."""
        if self.stays:
            return STILL
        return Pose(*(float(np.interp(time_ms, self.samples_ms, way)) for way in self.ways.T))

    def prescribed_at(self, times_ms: ArrayLike) -> FloatArray:
        """Depth [mm] or force [mN] at `times_ms`, any shape."""
        return np.interp(float_array("times_ms", times_ms, None), self.samples_ms, self.prescribed)

    def course_at(self, time_ms: Finite) -> FloatArray:
        """Where the motion is at a time [ms], as of `courses`, (5,)."""
        return np.array([self.prescribed_at(time_ms), *vars(self.pose_at(time_ms)).values()]) / self._units

    def step_times_ms(self, ramp_steps: Whole, hold_steps: Whole, sticks: bool = True) -> FloatArray:
        """List the times to solve at: all samples, and times between them where they are far apart. [ms]

        First touch is one of them, and the way straight through the air before it is one step. A part of the
        way takes its share of `ramp_steps`, and a mm aside as many, or three times as many if skin `sticks`.
        A hold longer than the step before it takes `hold_steps`, which grow geometrically, because relaxation
        is fastest at its beginning; a long part in which a recording drifts is a hold.
        """
        times, course = self._course([self.onset_ms])
        first_ms = self.onset_ms if self.stays else 0.0
        return step_times_of(times, course, first_ms, ramp_steps, hold_steps, sticks)

    @property
    def _units(self) -> FloatArray:
        """One of each number of a course, (5,)."""
        return np.array([self.largest, 1.0, 1.0, TURN_LIKE_MM, TURN_LIKE_MM])

    def _course(self, also_ms: ArrayLike = (), first_ms: float = 0.0) -> tuple[FloatArray, FloatArray]:
        """Return samples and further times from `first_ms` on, and the course there, (n,) and (n, 5)."""
        samples = np.array(self.samples_ms)
        further = np.setdiff1d(also_ms, samples)
        further = further[np.abs(further[:, None] - samples).min(axis=1) > SAME * self.end_ms]
        times = np.union1d(samples, further)
        times = times[times >= first_ms]
        course = np.column_stack([self.prescribed, self.ways]) / self._units
        return times, np.column_stack([np.interp(times, samples, column) for column in course.T])


@value_class
class Trajectory(Motion):
    """Move the indenter along any course of depth or of force, back as well as forth, aside and turning.

    All is linear between the samples. Contact may be lost and made again: a depth below 0 lifts the indenter
    off the undeformed skin, and skin that still recovers follows it or stays behind. Depth and force are
    along the direction of pressing at first touch, however the indenter moves and turns later
    (docs/decisions.md#pose-over-time).

    Parameters
    ----------
    times_ms : sequence of float
        Increasing times from 0. [ms]
    depth_mm : sequence of float, optional
        Depth at these times, 0 at first touch of the undeformed skin, from 0 or less. [mm]
    force_mn : sequence of float, optional
        Instead of a depth, force along the direction of pressing on the whole finger, from 0. [mN]
    x_mm, z_mm : sequence of float, optional
        How far the indenter has moved along the finger, distal positive, and across it since first touch,
        from 0; it stays in its place by default. [mm]
    tilt_deg, spin_deg : sequence of float, optional
        How far it has turned about its tip since first touch, from 0, as `tilt_deg` and `spin_deg` of a
        `Touch`, to which they are added; it does not turn by default. [degrees]
    phases : sequence of Phase, optional
        Names of its parts. By default they begin at first touch: "ramp" goes deeper, "hold" stays, "move"
        goes aside or turns, "release" comes back and "pause" stays out of contact, where changes of 2 % do
        not count; from the second on they are numbered, as "ramp 2".
    cycles : Cycles, optional
        The part that repeats itself. If it has many cycles, a press solves some of them and interpolates
        the others (`PressSettings.cycle_tolerance`).

    Raises
    ------
    InputError
        If not exactly one of depth and force is given, lengths differ, times do not increase from 0, a value
        is not finite, a force is negative, a way or rotation does not start at 0, the indenter never presses
        or is faster than 10 m/s, a phase goes beyond the last time, or the cycles do not repeat.

    Examples
    --------
    Press for half a second, release within 50 ms, and let the skin recover:

    >>> release = Trajectory([0.0, 50.0, 500.0, 550.0, 1000.0], depth_mm=[0.0, 1.0, 1.0, 0.0, 0.0])
    >>> release.prescribed_at([25.0, 525.0]).tolist()
    [0.5, 0.5]
    >>> release.corners_ms
    (50.0, 500.0, 550.0)
    >>> [phase.name for phase in release.phases]
    ['ramp', 'hold', 'release', 'pause']
    """

    times_ms: Numbers
    depth_mm: Numbers | None = None
    force_mn: Numbers | None = None
    x_mm: Numbers | None = None
    z_mm: Numbers | None = None
    tilt_deg: Numbers | None = None
    spin_deg: Numbers | None = None
    # Names do not change what is pressed, and a stored press is found by what is compared.
    phases: Many[Phase] = field(default=(), compare=False)
    cycles: Cycles | None = None

    def __post_init__(self) -> None:
        times = increasing("times_ms", self.times_ms)
        if times.size < 2 or times[0] != 0.0:
            raise InputError("times_ms", "must hold at least two times, the first of them 0", str(times))
        if (self.depth_mm is None) == (self.force_mn is None):
            raise InputError("A trajectory needs either depth_mm or force_mn: give one of them.")
        name = "force_mn" if self.by_force else "depth_mm"
        given = {column: getattr(self, column) for column in (name, *POSE_COLUMNS)}
        for column, values in given.items():
            if values is None:
                continue
            if len(values) != times.size:
                raise InputError(column, f"must have one value per time, {times.size}", str(len(values)))
            if column in POSE_COLUMNS and values[0] != 0.0:
                must = "must begin with 0, since it is counted from first touch"
                raise InputError(column, must, f"{values[0]:g}")
            if column.endswith("_mm"):
                check_speed(column, times, values)
        if self.prescribed[0] > 0.0:
            begins = f"it begins with {self.prescribed[0]:g}"
            raise InputError(name, "must begin with 0 or less, without contact", remedy=begins)
        if self.by_force and (lowest := min(self.prescribed)) < 0.0:
            at = f"at {times[self.prescribed.index(lowest)]:g} ms, sample {self.prescribed.index(lowest) + 1}"
            raise InputError("force_mn", "must not be negative", f"{lowest:g} mN {at}")
        # Aside, the skin may lie higher than at first touch.
        if self.by_force or not any(given[column] for column in POSE_COLUMNS):
            if self.largest <= 0.0:
                raise InputError(
                    name, "must be above 0 at some time", remedy="the indenter would never press"
                )
            within(f"the largest {name}", self.largest, *PLAUSIBLE[name])
        object.__setattr__(self, "phases", self.phases or self._phases_of_course())
        for phase in self.phases:
            if phase.end_ms > self.end_ms:
                must = f"must end with the trajectory, at {self.end_ms:g} ms"
                raise InputError("phases", must, remedy=f"{phase.name!r} ends at {phase.end_ms:g} ms")
        if self.cycles is not None:
            self._check_cycles(self.cycles)

    def reduced(self, tolerance: Positive = TOLERANCE) -> Trajectory:
        """Leave out samples that lie close to a line between others: each is a step to solve at.

        Samples are kept where the course deviates most from a line, so that corners stay samples. Choose a
        tolerance above the noise of the recording. Phases that were given stay; others are named again.

        Parameters
        ----------
        tolerance : float, optional
            Largest error over the largest depth or force, and over the extent of each way and rotation. [1]

        Examples
        --------
        >>> times_ms = np.arange(1001.0)
        >>> course_mm = np.clip(times_ms / 50.0, 0.0, 1.0) + 0.001 * np.sin(times_ms)
        >>> Trajectory(times_ms, course_mm).reduced().times_ms
        (0.0, 50.0, 1000.0)
        """
        names = ["force_mn" if self.by_force else "depth_mm"]
        names += [name for name in POSE_COLUMNS if getattr(self, name) is not None]
        times, table = np.array(self.times_ms), np.array([getattr(self, name) for name in names]).T
        keep = samples_of_line(times, table / extent_of(table, names), positive("tolerance", tolerance))
        columns: dict[str, Any] = {name: tuple(np.array(getattr(self, name))[keep]) for name in names}
        phases = self.phases if self.named_phases else ()
        return replace(self, times_ms=tuple(times[keep]), **columns, phases=phases, cycles=None)

    def _check_cycles(self, cycles: Cycles) -> None:
        times, course = self._course()
        near = SAME * cycles.period_ms
        inside = (times > cycles.start_ms + near) & (times < cycles.end_ms + near)
        if inside.any() and inside.sum() % cycles.count == 0 and np.isclose(times, cycles.start_ms).any():
            since = times[inside].reshape(cycles.count, -1)
            since = since - cycles.start_ms - cycles.period_ms * np.arange(cycles.count)[:, None]
            rows = course[inside].reshape(*since.shape, -1)
            if np.ptp(since, axis=0).max() < near and np.ptp(rows, axis=0).max() < SAME:
                return
        raise InputError(
            "cycles",
            f"must repeat the samples of the first of them {cycles.count} times, every "
            f"{cycles.period_ms:g} ms from a sample at {cycles.start_ms:g} ms",
            remedy="they do not",
        )

    @property
    def by_force(self) -> bool:  # type: ignore[override]
        """Whether the force is prescribed instead of the depth."""
        return self.force_mn is not None

    @property
    def samples_ms(self) -> tuple[float, ...]:
        return self.times_ms

    @property
    def prescribed(self) -> tuple[float, ...]:
        """Depth [mm] or force [mN] at the samples."""
        return self.force_mn or self.depth_mm or ()

    @cached_property
    def ways(self) -> FloatArray:
        """`POSE_COLUMNS` at the samples, (n_samples, 4). [mm, degrees]"""
        still = (0.0,) * len(self.times_ms)
        return np.column_stack([getattr(self, name) or still for name in POSE_COLUMNS])

    @property
    def named_phases(self) -> bool:
        """Whether its phases were given, and not named by its course."""
        return self.phases != self._phases_of_course()

    def _phases_of_course(self) -> tuple[Phase, ...]:
        times, values = np.array(self.times_ms), np.array(self.prescribed)
        before = np.flatnonzero(values[1:] * values[:-1] < 0.0)
        share = values[before] / (values[before] - values[before + 1])
        leaves_0_ms = times[before] + share * (times[before + 1] - times[before])
        return phases_of(*self._course([self.onset_ms, *leaves_0_ms], self.onset_ms))

    def __repr__(self) -> str:
        what = "force_mn" if self.by_force else "depth_mm"
        return (
            f"Trajectory({len(self.times_ms)} samples to {self.end_ms:g} ms, {what} at most "
            f"{self.largest:.4g} {unit_of(what)}, {', '.join(phase.name for phase in self.phases)})"
        )


class _RampAndHold(Motion):
    """A ramp at a constant rate from 0, then a hold: a table of three samples."""

    keywords_of_others = {"depth_mm": "RampAndHold", "force_mn": "ForceRampAndHold"}  # noqa: RUF012

    ramp_ms: float
    hold_ms: float

    @property
    def samples_ms(self) -> tuple[float, ...]:
        return 0.0, self.ramp_ms, self.ramp_ms + self.hold_ms

    @property
    def phases(self) -> tuple[Phase, ...]:
        return ramp_and_hold_phases(self.ramp_ms, self.end_ms)

    def prescribed_at(self, times_ms: ArrayLike) -> FloatArray:
        return self.largest * np.clip(float_array("times_ms", times_ms, None) / self.ramp_ms, 0.0, 1.0)


@value_class
class RampAndHold(_RampAndHold):
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
    def prescribed(self) -> tuple[float, ...]:
        """Depth at first touch, at the end of the ramp and of the hold. [mm]"""
        return 0.0, self.depth_mm, self.depth_mm


@value_class
class ForceRampAndHold(_RampAndHold):
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
    def prescribed(self) -> tuple[float, ...]:
        """Force at first touch, at the end of the ramp and of the hold. [mN]"""
        return 0.0, self.force_mn, self.force_mn


CLEARANCE_TO_BONE = 0.8  # Share of the way to the bone that an indenter may go.
STEP_MM = 0.25  # Distance between places at which a way along the skin is looked at. [mm]


def check_path(finger: Finger, motion: Motion, at_mm: tuple[float, float]) -> None:
    """Check that every place of a motion is on the finger and out of its bone, before anything is pressed."""
    ways_mm = motion.ways[:, :2]
    lengths_mm = np.linalg.norm(np.diff(ways_mm, axis=0), axis=1)
    for longest_mm in (np.inf, STEP_MM):  # Samples first: far beside any finger are too many places between.
        times = divided_ms(motion.samples_ms, lengths_mm / longest_mm)
        x, z = (np.interp(times, motion.samples_ms, way) for way in (at_mm + ways_mm).T)
        try:
            skin_y_mm = finger.skin_point(x, z)[..., 1]
        except InputError:
            if motion.stays:
                raise
            _name_first_outside(finger, times, x, z)
            raise
    if motion.by_force:
        return
    # Depth is counted from the skin at first touch, and skin elsewhere lies higher or lower.
    deepest_mm = skin_y_mm - skin_y_mm[0] + CLEARANCE_TO_BONE * finger.depth_available_mm(x, z)
    depths_mm = motion.prescribed_at(times)
    worst = int((depths_mm - deepest_mm).argmax())
    if depths_mm[worst] > deepest_mm[worst]:
        raise InputError(
            "depth_mm",
            f"must stay below {deepest_mm[worst]:.2f} mm at x = {x[worst]:g}, z = {z[worst]:g} mm, "
            "because of the bone",
            f"{depths_mm[worst]:g} mm at {times[worst]:.6g} ms",
        )


def _name_first_outside(finger: Finger, times_ms: FloatArray, x_mm: FloatArray, z_mm: FloatArray) -> None:
    for time, x, z in zip(times_ms, x_mm, z_mm, strict=True):
        try:
            finger.skin_point(x, z)
        except InputError as error:
            raise InputError(f"The indenter must not leave the finger at {time:.6g} ms: {error}") from error
