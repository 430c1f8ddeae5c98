"""Any course of the depth or the force of an indenter, of its place and of its rotation."""

from __future__ import annotations

from collections.abc import Callable, Sequence
from dataclasses import field, replace
from itertools import groupby, pairwise

import numpy as np
from numpy.typing import ArrayLike, NDArray

from fingerpad.core.checked import value_class
from fingerpad.core.errors import InputError
from fingerpad.core.phases import HOLD, RAMP, RELEASE, VIBRATION, Phase
from fingerpad.core.units import unit_of
from fingerpad.core.values import Finite, FloatArray, Many, Numbers, Whole, float_array, increasing, within
from fingerpad.data import protocol
from fingerpad.geometry.motion import PLAUSIBLE, STILL, Cycles, Motion, Pose, hold_ends_ms

POSE_COLUMNS = ("x_mm", "z_mm", "tilt_deg", "spin_deg")
"""Columns of a trajectory that say where the indenter stands, beside its depth or force."""

SAME_SPEED = 1e-6
"""Change of speed, over the largest speed of a trajectory, below which it goes on at the same speed."""

CORNER_SHARE = 0.8
"""A sample is a corner if the speed changes there by more than this share of the largest speed."""

MOST_JUMP, EVEN_STEPS = 0.6, 4.0
"""A smaller change is a corner too, unless the acceleration is the same at a neighbour within this share, and
the steps before and after it differ by at most this factor, as along a smooth curve."""

STEPS_ASIDE = 3.0  # Steps per mm aside over those of a ramp: skin passes an edge within a few of them.

ONSET_SHARES = (0.25, 0.5)
"""Where the first of several steps aside is divided, over its length: at 0.025 and 0.05 mm at quick."""

SAME_VALUE = 0.02
"""Change over the largest depth, force or way of a trajectory below which it holds; recordings have noise."""

FEWEST_TURNS = 4
"""Turns from down to up and back, without a lift or a stop between them, from which on a motion vibrates."""


def _with_vibrations(runs: Sequence[Phase], lifted_ms: FloatArray) -> list[Phase]:
    """Join what goes up and down again and again while it touches; a crest lasts less than its neighbours."""
    found: list[Phase] = []
    waiting = list(runs)
    while waiting:
        first, *rest = waiting
        joined, turns, last = [], 0, first
        for number, run in enumerate(rest):
            following = rest[number + 1].length_ms if number + 1 < len(rest) else last.length_ms
            crest = run.name == HOLD and run.length_ms < min(last.length_ms, following)
            lifted = ((lifted_ms > run.start_ms) & (lifted_ms <= run.end_ms)).any()
            if not crest and (run.name not in (RAMP, RELEASE) or lifted):
                break
            joined.append(run)
            turns, last = (turns, last) if crest else (turns + 1, run)
        found.append(first)
        if first.name in (RAMP, RELEASE, HOLD) and turns >= FEWEST_TURNS:
            found.append(Phase(VIBRATION, joined[0].start_ms, joined[-1].end_ms))
            rest = rest[len(joined) :]
        waiting = rest
    return found


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

    given_samples = True

    def __post_init__(self) -> None:
        times = increasing("times_ms", self.times_ms)
        if times.size < 2 or times[0] != 0.0:
            raise InputError("times_ms", "must hold at least two times, the first of them 0", str(times))
        if (self.depth_mm is None) == (self.force_mn is None):
            raise InputError("A trajectory needs either depth_mm or force_mn: give one of them.")
        name = "force_mn" if self.depth_mm is None else "depth_mm"
        for column in (name, *POSE_COLUMNS):
            if getattr(self, column) is None:
                continue
            values = np.array(getattr(self, column))
            if values.size != times.size:
                raise InputError(column, f"must have one value per time, {times.size}", str(values.size))
            if column in POSE_COLUMNS and values[0] != 0.0:
                raise InputError(
                    column, "must begin with 0, since it is counted from first touch", f"{values[0]:g}"
                )
            if column.endswith("_mm"):
                check_speed(column, times, values)
        values = np.array(getattr(self, name))
        if values[0] > 0.0:
            raise InputError(
                name, "must begin with 0 or less, without contact", remedy=f"it begins with {values[0]:g}"
            )
        if name == "force_mn" and values.min() < 0.0:
            first = int(np.argmax(values < 0.0))
            raise InputError(
                "force_mn",
                "must not be negative",
                f"{values[first]:g} mN at {times[first]:g} ms, sample {first + 1}",
            )
        # Aside, the skin may lie higher than at first touch.
        aside = name == "depth_mm" and any(getattr(self, column) for column in POSE_COLUMNS)
        if values.max() <= 0.0 and not aside:
            raise InputError(name, "must be above 0 at some time", remedy="the indenter would never press")
        if values.max() > 0.0 and not aside:
            within(f"the largest {name}", values.max(), *PLAUSIBLE[name])
        object.__setattr__(self, "phases", self.phases or self._phases_of_course())
        for phase in self.phases:
            if phase.end_ms > self.end_ms:
                raise InputError(
                    "phases",
                    f"must end with the trajectory, at {self.end_ms:g} ms",
                    remedy=f"{phase.name!r} ends at {phase.end_ms:g} ms",
                )
        if self.cycles is not None:
            self._check_cycles(self.cycles)

    def _check_cycles(self, cycles: Cycles) -> None:
        times, near = np.array(self.times_ms), SAME_SPEED * cycles.period_ms
        inside = (times > cycles.start_ms + near) & (times < cycles.end_ms + near)
        if inside.any() and inside.sum() % cycles.count == 0 and np.isclose(times, cycles.start_ms).any():
            since = times[inside].reshape(cycles.count, -1)
            since = since - cycles.start_ms - cycles.period_ms * np.arange(cycles.count)[:, None]
            course = self._course[inside].reshape(*since.shape, -1)
            if np.ptp(since, axis=0).max() < near and np.ptp(course, axis=0).max() < SAME_SPEED:
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
        """The samples, `times_ms`. [ms]"""
        return self.times_ms

    @property
    def prescribed(self) -> tuple[float, ...]:
        """Depth [mm] or force [mN] at the samples."""
        values = self.force_mn if self.depth_mm is None else self.depth_mm
        assert values is not None
        return values

    @property
    def largest(self) -> float:
        return max(self.prescribed)

    @property
    def depths_mm(self) -> tuple[float, ...]:
        return (self.largest,) if self.stays else self.prescribed

    @property
    def end_ms(self) -> float:
        return self.times_ms[-1]

    @property
    def poses(self) -> tuple[Pose, ...]:
        """Pose of the indenter at the samples; one if it only goes up and down."""
        columns = [getattr(self, name) for name in POSE_COLUMNS]
        if not any(column is not None and any(column) for column in columns):
            return (STILL,)
        still = (0.0,) * len(self.times_ms)
        return tuple(Pose(*row) for row in zip(*(column or still for column in columns), strict=True))

    @property
    def onset_ms(self) -> float:
        """Time of first touch: where depth or force last leaves 0 before it exceeds 2 % of the largest. [ms]

        Examples
        --------
        >>> Trajectory([0.0, 150.0, 1100.0], depth_mm=[-2.0, 1.0, 1.0]).onset_ms
        100.0
        """
        times, values = self.times_ms, np.array(self.prescribed)
        pressed = int((values > SAME_VALUE * max(self.largest, 0.0)).argmax())
        if pressed == 0:  # it only presses where skin lies higher, aside
            return 0.0
        last = int(np.flatnonzero(values[:pressed] <= 0.0)[-1])
        share = -values[last] / (values[last + 1] - values[last])
        onset = times[last] + share * (times[last + 1] - times[last])
        nearest = min(times[last : last + 2], key=lambda sample: abs(sample - onset))
        return float(nearest if abs(nearest - onset) <= SAME_SPEED * self.end_ms else onset)

    def _with(self, also_ms: ArrayLike) -> tuple[FloatArray, FloatArray]:
        """Return times and `course_at` of all samples and of some further times, (n,) and (n, 5)."""
        given = np.array(self.times_ms)
        further = np.setdiff1d(also_ms, given)
        further = further[np.abs(further[:, None] - given).min(axis=1) > SAME_SPEED * self.end_ms]
        times = np.union1d(given, further)
        return times, np.column_stack([np.interp(times, given, column) for column in self._course.T])

    def pose_at(self, time_ms: Finite) -> Pose:
        columns = (getattr(self, name) for name in POSE_COLUMNS)
        return Pose(
            *(0.0 if each is None else float(np.interp(time_ms, self.times_ms, each)) for each in columns)
        )

    @property
    def _course(self) -> FloatArray:
        ways = np.array([pose.way for pose in self.poses])
        prescribed = np.array(self.prescribed) / self.largest
        return np.column_stack([prescribed, np.broadcast_to(ways, (prescribed.size, 4))])

    @property
    def corners_ms(self) -> tuple[float, ...]:
        """First touch, and later samples at which the speed jumps, other than along a smooth curve. [ms]"""
        onset = self.onset_ms
        times, course = self._with([onset])
        course, times = course[times >= onset], times[times >= onset]
        lengths_ms = np.diff(times)
        speed = np.diff(course, axis=0) / lengths_ms[:, None]
        changes = np.diff(speed, axis=0)
        change = np.linalg.norm(changes, axis=1)
        largest = np.linalg.norm(speed, axis=1).max()
        smooth = self._goes_on(changes / (lengths_ms[1:] + lengths_ms[:-1])[:, None])
        ratio = lengths_ms[1:] / lengths_ms[:-1]
        smooth &= np.maximum(ratio, 1.0 / ratio) <= EVEN_STEPS
        corners = (change > CORNER_SHARE * largest) | ((change > SAME_SPEED * largest) & ~smooth)
        first = times[:1] if onset > 0.0 else times[:0]
        return (*first.tolist(), *times[1:-1][corners].tolist())

    @staticmethod
    def _goes_on(accelerations: FloatArray) -> NDArray[np.bool_]:
        """Whether the acceleration at each sample is much like that at a neighbour, or like their mean."""
        size = np.linalg.norm(accelerations, axis=1)
        alike = np.linalg.norm(np.diff(accelerations, axis=0), axis=1) <= MOST_JUMP * np.maximum(
            size[1:], size[:-1]
        )
        goes_on = np.zeros(size.size, dtype=bool)
        goes_on[1:] |= alike
        goes_on[:-1] |= alike
        mean = (accelerations[2:] + accelerations[:-2]) / 2.0
        goes_on[1:-1] |= np.linalg.norm(accelerations[1:-1] - mean, axis=1) <= MOST_JUMP * size[1:-1]
        return goes_on

    def __repr__(self) -> str:
        what = "force_mn" if self.by_force else "depth_mm"
        return (
            f"Trajectory({len(self.times_ms)} samples to {self.end_ms:g} ms, {what} at most "
            f"{max(self.prescribed):.4g} {unit_of(what)}, {', '.join(phase.name for phase in self.phases)})"
        )

    @property
    def named_phases(self) -> bool:
        """Whether its phases were given, and not named by its course."""
        return self.phases != self._phases_of_course()

    def _phases_of_course(self) -> tuple[Phase, ...]:
        """Name phases from first touch on by what the indenter does, apart from changes of `SAME_VALUE`."""
        times, course = self._with([self.onset_ms, *self._crossings_ms()])
        course, times = course[times >= self.onset_ms], times[times >= self.onset_ms]
        course[:, 0] = np.maximum(course[:, 0], 0.0)  # how high it is lifted does not matter
        course = course / np.maximum(np.ptp(course, axis=0), 1.0)
        bends = np.flatnonzero(samples_of_line(times, course, SAME_VALUE)).tolist()
        runs = []
        for kind, group in groupby(pairwise(bends), lambda part: self._kind(*course[list(part)])):
            same = list(group)
            runs.append(Phase(kind, float(times[same[0][0]]), float(times[same[-1][1]])))
        lifted_ms = times[course[:, 0] <= SAME_VALUE]
        phases: list[Phase] = []
        for run in _with_vibrations(runs, lifted_ms):
            count = 1 + sum(phase.name.split()[0] == run.name for phase in phases)
            phases.append(run if count == 1 else replace(run, name=f"{run.name} {count}"))
        return tuple(phases)

    def _crossings_ms(self) -> FloatArray:
        """Return times between samples at which the depth passes 0. [ms]"""
        times, values = np.array(self.times_ms), np.array(self.prescribed)
        before = np.flatnonzero(values[1:] * values[:-1] < 0.0)
        share = values[before] / (values[before] - values[before + 1])
        return times[before] + share * (times[before + 1] - times[before])

    @staticmethod
    def _kind(start: FloatArray, end: FloatArray) -> str:
        """Say what the indenter does between two states of its `_course`."""
        change = end - start
        if abs(change[0]) > SAME_VALUE:
            return RAMP if change[0] > 0.0 else RELEASE
        if np.abs(change[1:]).max() > SAME_VALUE:
            return "move"
        return HOLD if max(start[0], end[0]) > SAME_VALUE else "pause"

    def prescribed_at(self, times_ms: ArrayLike) -> FloatArray:
        return np.interp(float_array("times_ms", times_ms, None), self.times_ms, self.prescribed)

    def step_times_ms(self, ramp_steps: Whole, hold_steps: Whole) -> FloatArray:
        """List the times to solve at: all samples, and times between them where they are far apart. [ms]

        First touch is one of them, and the way straight through the air before it is one step. A part of the
        way takes its share of `ramp_steps`, and a mm aside three times as many. The first step aside is
        divided, because friction grows over about a tenth of a mm until skin slips. A hold longer than the
        step before it takes `hold_steps`, which grow geometrically, because relaxation is fastest at its
        beginning; a long part in which a recording drifts is a hold.

        Examples
        --------
        >>> Trajectory([0.0, 50.0, 1000.0], depth_mm=[0.0, 1.0, 1.0]).step_times_ms(2, 3).round(1).tolist()
        [0.0, 25.0, 50.0, 75.0, 204.1, 1000.0]
        """
        times, last_ms, onset = [0.0], np.inf, self.onset_ms
        samples_ms, course = self._with([onset])
        moved_by = np.linalg.norm(np.diff(course, axis=0), axis=1)
        aside = np.linalg.norm(np.diff(course[:, 1:3], axis=0), axis=1)
        for start, end, moved, way in zip(
            samples_ms[:-1].tolist(), samples_ms[1:].tolist(), moved_by, aside, strict=True
        ):
            if end <= onset and self.stays:
                times.append(end)
                continue
            length_ms = end - start
            drifts = moved <= SAME_VALUE and length_ms > hold_steps * last_ms
            if moved > SAME_SPEED and not drifts:
                steps = int(np.ceil(ramp_steps * max(moved, STEPS_ASIDE * way) - SAME_SPEED))
                since = np.linspace(0.0, length_ms, steps + 1)[1:]
                if steps > 1 and way > SAME_SPEED:
                    since = np.concatenate([since[0] * np.array(ONSET_SHARES), since])
            elif length_ms > last_ms * (1.0 + SAME_SPEED):
                since = hold_ends_ms(length_ms, last_ms, hold_steps)
            else:
                since = np.array([length_ms])
            last_ms = since[-1] - (since[-2] if since.size > 1 else 0.0)
            times += (start + since[:-1]).tolist()
            times.append(end)
        return np.array(times)


def check_speed(
    name: str, times_ms: ArrayLike, values_mm: ArrayLike, place: Callable[[int], str] = lambda _: ""
) -> None:
    """Raise `InputError` if values [mm] change between two times [ms] as fast as no indenter moves.

    `place` says where the later of the two stands, from its number, and begins the message.
    """
    with np.errstate(over="ignore"):
        speed = np.abs(np.diff(values_mm)) / np.diff(times_ms)
    fastest = int(speed.argmax())
    if speed[fastest] > protocol.FASTEST.value:  # 1 mm/ms is 1 m/s
        raise InputError(
            f"{place(fastest + 1)}{name} must not change faster than {protocol.FASTEST.value:g} m/s: got "
            f"{speed[fastest]:.4g} m/s until {np.asarray(times_ms)[fastest + 1]:g} ms; check the units."
        )


def samples_of_line(times: FloatArray, table: FloatArray, tolerance: float) -> NDArray[np.bool_]:
    """Find the samples between which lines miss none of the others by more than a tolerance.

    A part is divided at the sample that its line misses most (Ramer-Douglas-Peucker).
    """
    keep = np.zeros(times.size, dtype=bool)
    keep[[0, -1]] = True
    waiting = [(0, times.size - 1)]
    while waiting:
        first, last = waiting.pop()
        share = ((times[first : last + 1] - times[first]) / (times[last] - times[first]))[:, None]
        line = table[first] + share * (table[last] - table[first])
        missed = np.abs(table[first : last + 1] - line).max(axis=1)
        worst = first + int(missed.argmax())
        if missed.max() > tolerance:
            keep[worst] = True
            waiting += [(first, worst), (worst, last)]
    return keep
