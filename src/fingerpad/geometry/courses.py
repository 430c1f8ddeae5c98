"""What a motion does: its phases, its corners and the times to solve it at.

A course is a table over increasing times, linear between them: depth or force over the largest, ways aside in
mm and rotations over 10 degrees, which are numbers of one order, (n, 5).
"""

from __future__ import annotations

from collections.abc import Callable, Sequence
from dataclasses import replace
from itertools import groupby, pairwise

import numpy as np
from numpy.typing import ArrayLike, NDArray

from fingerpad.core.errors import InputError
from fingerpad.core.phases import HOLD, RAMP, RELEASE, VIBRATION, Phase
from fingerpad.core.values import FloatArray
from fingerpad.data import protocol

SAME = 1e-6  # Change over the largest of its kind that is round-off: of a speed, a time or a place.

SAME_VALUE = 0.02  # Change over the largest depth, force or way below which it holds: recordings have noise.


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


def divided_ms(samples_ms: Sequence[float], lengths: FloatArray) -> FloatArray:
    """Divide each step between samples, which has a length, into equal parts not longer than 1. [ms]"""
    counts = np.maximum(np.ceil(lengths), 1.0).astype(int)
    parts = [step + np.arange(count) / count for step, count in enumerate(counts.tolist())]
    return np.interp(np.concatenate([*parts, [counts.size]]), np.arange(counts.size + 1), samples_ms)


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


def onset_of(times: FloatArray, prescribed: FloatArray) -> float:
    """Time at which depth or force last leaves 0 before it exceeds `SAME_VALUE` of the largest. [ms]"""
    pressed = int((prescribed > SAME_VALUE * max(prescribed.max(), 0.0)).argmax())
    if pressed == 0:  # it only presses where skin lies higher, aside
        return 0.0
    last = int(np.flatnonzero(prescribed[:pressed] <= 0.0)[-1])
    share = -prescribed[last] / (prescribed[last + 1] - prescribed[last])
    onset = times[last] + share * (times[last + 1] - times[last])
    nearest = min(times[last : last + 2], key=lambda sample: abs(sample - onset))
    return float(nearest if abs(nearest - onset) <= SAME * times[-1] else onset)


def phases_of(times: FloatArray, course: FloatArray) -> tuple[Phase, ...]:
    """Name what a course does from first touch on, apart from changes of `SAME_VALUE`."""
    course = np.column_stack([np.maximum(course[:, 0], 0.0), course[:, 1:]])  # how high it is does not matter
    course = course / np.maximum(np.ptp(course, axis=0), 1.0)
    bends = np.flatnonzero(samples_of_line(times, course, SAME_VALUE)).tolist()
    runs = []
    for kind, group in groupby(pairwise(bends), lambda part: _kind(*course[list(part)])):
        same = list(group)
        runs.append(Phase(kind, float(times[same[0][0]]), float(times[same[-1][1]])))
    phases: list[Phase] = []
    for run in _with_vibrations(runs, times[course[:, 0] <= SAME_VALUE]):
        count = 1 + sum(phase.name.split()[0] == run.name for phase in phases)
        phases.append(run if count == 1 else replace(run, name=f"{run.name} {count}"))
    return tuple(phases)


def _kind(start: FloatArray, end: FloatArray) -> str:
    """Say what the indenter does between two states of its course."""
    change = end - start
    if abs(change[0]) > SAME_VALUE:
        return RAMP if change[0] > 0.0 else RELEASE
    if np.abs(change[1:]).max() > SAME_VALUE:
        return "move"
    return HOLD if max(start[0], end[0]) > SAME_VALUE else "pause"


FEWEST_TURNS = 4  # Turns from down to up and back, with no lift or stop between them, of a vibration.


def _with_vibrations(runs: Sequence[Phase], lifted_ms: FloatArray) -> list[Phase]:
    """Join what goes up and down again and again while it touches; a crest lasts less than its neighbours."""

    def swings(number: int) -> bool:
        run, around = runs[number], [*runs[max(number - 1, 0) : number], *runs[number + 1 : number + 2]]
        if run.name == HOLD:
            return all(run.length_ms < other.length_ms for other in around)
        lifted = ((lifted_ms > run.start_ms) & (lifted_ms <= run.end_ms)).any()
        return run.name in (RAMP, RELEASE) and not lifted

    found: list[Phase] = []
    for swing, numbers in groupby(range(len(runs)), swings):
        part = [runs[number] for number in numbers]
        first = 0 if found and found[-1].name in (RAMP, RELEASE, HOLD) else 1  # the way to it is no vibration
        if swing and sum(run.name != HOLD for run in part[first:]) >= FEWEST_TURNS:
            part[first:] = [Phase(VIBRATION, part[first].start_ms, part[-1].end_ms)]
        found += part
    return found


CORNER_SHARE, MOST_JUMP, EVEN_STEPS = 0.8, 0.6, 4.0
"""A sample is a corner if the speed changes there by more than the first share of the largest speed. After a
smaller change the curve is smooth if the acceleration is the same at a neighbour within the second share, and
the steps before and after differ by at most the third factor. The motions of tests/test_trajectory.py have
their corners for 0.6 to 0.95, 0.5 to 0.9 and 1.5 to 5."""


def corners_of(times: FloatArray, course: FloatArray) -> NDArray[np.bool_]:
    """Whether the speed jumps at each sample but the first and last, other than along a smooth curve."""
    lengths_ms = np.diff(times)
    speed = np.diff(course, axis=0) / lengths_ms[:, None]
    changes = np.diff(speed, axis=0)
    change, largest = np.linalg.norm(changes, axis=1), np.linalg.norm(speed, axis=1).max()
    # The acceleration is much like that at a neighbour, or like the mean of both.
    accelerations = changes / (lengths_ms[1:] + lengths_ms[:-1])[:, None]
    size, apart = (np.linalg.norm(each, axis=1) for each in (accelerations, np.diff(accelerations, axis=0)))
    alike = apart <= MOST_JUMP * np.maximum(size[1:], size[:-1])
    smooth = np.zeros(size.size, dtype=bool)
    smooth[1:] |= alike
    smooth[:-1] |= alike
    from_mean = accelerations[1:-1] - (accelerations[2:] + accelerations[:-2]) / 2.0
    smooth[1:-1] |= np.linalg.norm(from_mean, axis=1) <= MOST_JUMP * size[1:-1]
    ratio = lengths_ms[1:] / lengths_ms[:-1]
    smooth &= np.maximum(ratio, 1.0 / ratio) <= EVEN_STEPS
    return (change > CORNER_SHARE * largest) | ((change > SAME * largest) & ~smooth)


STEPS_ASIDE = 3.0
"""Steps per mm aside over those of a ramp, with friction: skin passes an edge within a few of them. Without,
what is found does not depend on the way, and the steps of a ramp are enough."""

ONSET_SHARES = (0.25, 0.5)
"""Where the first of several steps aside is divided, over its length: at 0.025 and 0.05 mm at quick. Friction
grows over about a tenth of a mm until skin slips."""


def step_times_of(
    times: FloatArray, course: FloatArray, first_ms: float, ramp_steps: int, hold_steps: int, sticks: bool
) -> FloatArray:
    """List the times to solve a course at; what ends until `first_ms` is one step a sample. [ms]"""
    steps_aside = STEPS_ASIDE if sticks else 1.0
    found, last_ms = [0.0], np.inf
    moved_by = np.linalg.norm(np.diff(course, axis=0), axis=1)
    aside = np.linalg.norm(np.diff(course[:, 1:3], axis=0), axis=1)
    for (start, end), moved, way in zip(pairwise(times.tolist()), moved_by, aside, strict=True):
        if end <= first_ms:
            found.append(end)
            continue
        length_ms = end - start
        drifts = moved <= SAME_VALUE and length_ms > hold_steps * last_ms
        if moved > SAME and not drifts:
            steps = int(np.ceil(ramp_steps * max(moved, steps_aside * way) - SAME))
            since, last_ms = np.linspace(0.0, length_ms, steps + 1)[1:], length_ms / steps
            if sticks and steps > 1 and way > SAME:
                since = np.concatenate([since[0] * np.array(ONSET_SHARES), since])
        elif length_ms > last_ms * (1.0 + SAME):
            # The first step is as long as the one before, or shorter: relaxation is fastest at its beginning.
            since = np.geomspace(min(last_ms, length_ms / hold_steps), length_ms, hold_steps)
            last_ms = np.diff(since, prepend=0.0)[-1]
        else:
            since, last_ms = np.array([length_ms]), length_ms
        found += (start + since[:-1]).tolist()
        found.append(end)
    return np.array(found)


def extent_of(table: FloatArray, names: Sequence[str]) -> FloatArray:
    """Largest absolute value of each column, 1 for one that is 0 throughout; of a depth the deepest."""
    largest = np.abs(table).max(axis=0)
    deepest = table.max(axis=0)
    largest = np.where((np.array(names) == "depth_mm") & (deepest > 0.0), deepest, largest)
    return np.where(largest > 0.0, largest, 1.0)
