"""The full presses that a reduced touch is made from: which poses, and what is read from each.

At every pose the indenter is pressed from first touch to a few depths by a fast ramp, and held. Ramps give
the response at once to many depths; holds show what each branch of the tissues relaxes. One more press goes
deeper and back after a hold.

Between the poses everything is interpolated. Along one axis a function f of s in [0, 1] is replaced by the
polynomial through its values at the points s_j = (1 - cos(pi j / n)) / 2 (Trefethen, Approximation Theory and
Approximation Practice, 2013):

    f(s) = sum_j L_j(s) f(s_j),    L_j(s) = prod_{i != j} (s - s_i) / (s_j - s_i).
"""

from __future__ import annotations

import itertools
import math
from collections.abc import Iterator, Sequence
from dataclasses import dataclass, replace
from functools import cache, cached_property
from typing import Annotated, Any, cast

import numpy as np
from numba import njit
from numpy.typing import ArrayLike
from scipy.optimize import brentq

from fingerpad.core.checked import value_class
from fingerpad.core.errors import InputError
from fingerpad.core.values import Count, Finite, FloatArray, Pair, Positive, choice
from fingerpad.geometry.fingertip import Fingertip
from fingerpad.geometry.grading import RESOLUTIONS, Grading
from fingerpad.geometry.motion import STILL, Pose, Trajectory
from fingerpad.geometry.size_field import grading_below
from fingerpad.mechanics.press_settings import PressSettings
from fingerpad.skin.indentation import LARGEST_TILT_DEG, Touch, settings_of

DEPTH_SHARES = (0.1, 0.25, 0.45, 0.7, 1.0)  # Depths of the presses at one pose, over the largest.

RAMP_MS = 20.0

RAMP_SHARES = 1.0 - (1.0 - np.arange(1, 13) / 12) ** 1.5
"""Samples of a ramp, as shares of it: denser where no other press at the pose adds to them."""

HOLD_MS = (80.0, 280.0, 980.0, 2000.0)  # Times of the samples in the hold, from its start. [ms]

PRESSED_AGAIN_MS = (0.0, 20.0, 1020.0, 1040.0, 1540.0, 1590.0, 1890.0)
PRESSED_AGAIN = (0.0, 0.45, 0.45, 1.0, 1.0, 0.6, 0.6)
"""Motion that shows how what has relaxed counts at other depths: times [ms], depths over the largest."""

MET_MM, MOST_ADVANCES = 1e-9, 1000
"""Gap at which a tilted indenter meets the skin [mm], and steps of the search for it."""

MOVE_MS = 50.0  # Time to move aside, and time to approach, both without contact. [ms]
CLEARANCE_MM = 0.5  # How far above the skin the indenter moves aside. [mm]
SPACING = {"x_mm": 1.5, "z_mm": 1.0, "tilt_deg": 10.0}  # Largest mean distance of the poses along each axis.

MOST_FIXED_POINTS = 30
"""Steps of the search for the skin on the line of pressing; each gains a digit or more."""

FEWEST_POINTS = 3  # Least number of points along an axis that varies.


@cache
def chebyshev_points(count: int) -> FloatArray:
    """Chebyshev's points of [0, 1] with both ends, (count,); the middle for one point."""
    points = np.array([0.5])
    if count > 1:
        points = 0.5 - 0.5 * np.cos(np.pi * np.arange(count) / (count - 1))
    points.setflags(write=False)
    return points


def lagrange(points: FloatArray, values: ArrayLike) -> FloatArray:
    """Lagrange's polynomials of `points` (n,) at `values` (...,), (..., n)."""
    at = np.asarray(values, dtype=float)
    return np.asarray(_lagrange(points, at.ravel()).reshape(*at.shape, points.size))


@njit(cache=True, nogil=True)
def _lagrange(points, at):  # type: ignore[no-untyped-def]
    found = np.ones((at.size, points.size))
    for k in range(at.size):
        for j in range(points.size):
            for i in range(points.size):
                if i != j:
                    found[k, j] *= (at[k] - points[i]) / (points[j] - points[i])
    return found


def weighted(weights: FloatArray, values: FloatArray) -> FloatArray:
    return np.asarray((weights @ values.reshape(weights.size, -1)).reshape(values.shape[1:]))


@value_class
class Axis:
    """One quantity that varies over the range of a reduced touch."""

    name: str  #: "x_mm", "z_mm", "tilt_deg", or a parameter of the indenter.
    low: Finite
    high: Finite  #: Its range; equal if it does not vary.
    count: Count  #: Number of Chebyshev's points, 1 if it does not vary.

    def __post_init__(self) -> None:
        if self.high < self.low:
            raise InputError(f"{self.name} must range from low to high: got {self.low:g} to {self.high:g}.")
        if (self.count == 1) != (self.low == self.high):
            raise InputError(
                f"{self.name} needs two points or more if it varies, and one if it does not: got "
                f"{self.count} for {self.low:g} to {self.high:g}."
            )

    @cached_property
    def points(self) -> FloatArray:
        """Chebyshev's points as shares of the range."""
        return chebyshev_points(self.count)

    @property
    def values(self) -> FloatArray:
        """Values at Chebyshev's points."""
        return self.low + (self.high - self.low) * self.points

    def weights(self, value: Finite) -> FloatArray:
        """Weights of the points at a value, (count,)."""
        # Sums of positions differ in the last digits.
        slack = 1e-9 * max(1.0, abs(self.low), abs(self.high))
        if not self.low - slack <= value <= self.high + slack:
            raise InputError(
                f"{self.name} must lie within {self.low:g} to {self.high:g}, the range of this reduced "
                f"touch: got {value:g}; solve the touch in full, or reduce it over a wider range."
            )
        if self.count == 1:
            return np.ones(1)
        return lagrange(self.points, (value - self.low) / (self.high - self.low))


@value_class
class ReducedRange:
    """Poses that a reduced touch serves.

    Examples
    --------
    >>> [axis.name for axis in ReducedRange(1.5, x_mm=(-3.0, 3.0)).axes if axis.count > 1]
    ['x_mm']
    """

    depth_mm: Positive  #: Largest depth below first touch at any pose. [mm]
    x_mm: Pair = (0.0, 0.0)
    z_mm: Pair = (0.0, 0.0)
    """Ways of the indenter along and across the finger, from the place of the touch. [mm]"""
    tilt_deg: Pair = (0.0, 0.0)  #: Tilt, added to that of the touch. [degrees]
    parameter: str | None = None
    """A parameter of the indenter that varies, such as "curvature_per_m" of a `Sphere`."""
    values: Pair | None = None  #: Its range.

    def __post_init__(self) -> None:
        for name in SPACING:
            low, high = getattr(self, name)
            if not low <= 0.0 <= high:
                raise InputError(name, "must range over 0, the pose of the touch", f"{low:g} to {high:g}")
        if (self.parameter is None) != (self.values is None):
            raise InputError("A range needs both a parameter of the indenter and its values, or neither.")
        if self.values is not None and self.values[0] > self.values[1]:
            raise InputError("values", "must range from low to high", str(self.values))

    @property
    def axes(self) -> tuple[Axis, ...]:
        """Axes of the range: x, z, tilt and, if there is one, the parameter of the indenter."""
        axes = [
            Axis(
                name, low, high, 1 if low == high else max(FEWEST_POINTS, math.ceil((high - low) / each) + 1)
            )
            for name, each in SPACING.items()
            for low, high in [getattr(self, name)]
        ]
        if self.parameter is not None and self.values is not None:
            low, high = self.values
            axes.append(Axis(self.parameter, low, high, 1 if low == high else FEWEST_POINTS + 1))
        return tuple(axes)

    @property
    def moves(self) -> bool:
        """Whether the indenter moves aside."""
        return self.x_mm != (0.0, 0.0) or self.z_mm != (0.0, 0.0)


@dataclass(frozen=True)
class TrainingPose:
    """One pose, and the presses there."""

    values: tuple[float, ...]  #: Its place on each axis of the range.
    first_touch_mm: float
    """Depth at which the indenter meets undeformed skin, from the first touch of the touch. [mm]"""
    meets_mm: float  #: The same from the first touch at this place, before the indenter tilts. [mm]
    touches: tuple[Touch, ...]  #: One per depth.


@value_class
class ReducedTraining:
    """All presses behind a reduced touch."""

    touch: Touch
    """What is reduced: its finger, indenter, tissues, place, direction and friction, not its motion."""
    range: ReducedRange  #: The poses.
    resolution: Annotated[str, choice(RESOLUTIONS)] = "quick"
    grading: Grading | None = None  #: Mesh instead of that which the resolution grades over the range.

    def __post_init__(self) -> None:
        touch = self.touch
        if not isinstance(touch.finger, Fingertip):
            came = f"a {type(touch.finger).__name__}"
            raise InputError("finger", "must be a Fingertip to be reduced", came)
        if touch.friction > 0.0 and self.range.moves:
            why = "because what slides with friction depends on its way, which a reduced touch does not know"
            must = f"must be 0 for a range of x_mm or z_mm, {why}"
            raise InputError("friction", must, f"{touch.friction:g}")
        steepest = max(abs(touch.tilt_deg + tilt) for tilt in self.range.tilt_deg)
        if steepest > LARGEST_TILT_DEG:
            must = f"must keep the indenter within {LARGEST_TILT_DEG:g} degrees"
            raise InputError("tilt_deg", must, f"{steepest:g}")
        parameter = self.range.parameter
        if parameter is not None and parameter not in vars(touch.indenter):
            known = ", ".join(vars(touch.indenter))
            must = f"must be one of {known}, those of {type(touch.indenter).__name__}"
            raise InputError("parameter", must, repr(parameter))

    def poses(self) -> Iterator[TrainingPose]:
        """List all poses, the last axis the first to change; `InputError` if one cannot be pressed."""
        bases: dict[tuple[float, ...], Touch] = {}
        for values in itertools.product(*(axis.values.tolist() for axis in self.range.axes)):
            base = bases.setdefault(values[3:], self.touch_with(values[3:]))
            moved, lies_mm = _moved(base, *values[:2])
            pose = Pose(tilt_deg=values[2])
            meets_mm = first_touch_mm(moved, pose)
            touches = tuple(
                replace(moved, stimulus=_pressed(pose, meets_mm, share * self.range.depth_mm))
                for share in DEPTH_SHARES
            )
            yield TrainingPose(values, lies_mm + meets_mm, meets_mm, touches)

    def pressed_again(self) -> tuple[tuple[float, ...], Touch]:
        """Shape and touch in the middle of the range that goes deeper and back after it has relaxed."""
        shape = tuple(0.5 * (axis.low + axis.high) for axis in self.range.axes[3:])
        depths_mm = tuple(share * self.range.depth_mm for share in PRESSED_AGAIN)
        return shape, self.touch_with(shape, Trajectory(PRESSED_AGAIN_MS, depth_mm=depths_mm))

    def touch_with(self, shape: Sequence[float] = (), stimulus: Trajectory | None = None) -> Touch:
        """Touch on the mesh that serves all poses, with the value of the indenter's parameter that varies.

        A motion of one's own is solved with the steps of the resolution; by default it is the first press.
        """
        base, range_ = self.touch, self.range
        body = base.indenter
        if range_.parameter is not None:
            body = replace(cast(Any, body), **{range_.parameter: shape[0]})
        corners = itertools.product(*(getattr(range_, name) for name in SPACING))
        ways = list(zip(*[(0.0,) * len(SPACING), *corners], strict=True))
        times_ms = tuple(1000.0 * number for number in range(len(ways[0])))
        depths_mm = (0.0, *[range_.depth_mm] * (len(times_ms) - 1))
        round_trip = Trajectory(times_ms, depth_mm=depths_mm, x_mm=ways[0], z_mm=ways[1], tilt_deg=ways[2])
        grading = self.grading or grading_below(
            base.finger, body, self.resolution, base.at_mm, round_trip, base.tilt_deg, base.spin_deg
        )
        steps = settings_of(self.resolution)
        if stimulus is None:
            stimulus = _pressed(Pose(), 0.0, DEPTH_SHARES[0] * range_.depth_mm)
            steps = PressSettings(1, 1, steps.newton)
        return replace(base, indenter=body, grading=grading, stimulus=stimulus, settings=steps)


def _moved(base: Touch, x_mm: float, z_mm: float) -> tuple[Touch, float]:
    """Touch whose indenter stands aside, and by how much deeper it meets the skin there. [mm]"""
    # It presses along the same line as one that has moved there, so its axis goes through another point of
    # the skin if it is tilted.
    if x_mm == 0.0 and z_mm == 0.0:
        return base, 0.0
    axis, start_mm = base.placement.axis, base.placement.origin_mm + np.array([x_mm, 0.0, z_mm])
    x, z, way_mm = start_mm[0], start_mm[2], 0.0
    for _ in range(MOST_FIXED_POINTS):
        x, z = start_mm[[0, 2]] + way_mm * axis[[0, 2]]
        way_mm = float((base.finger.skin_point(x, z)[1] - start_mm[1]) / axis[1])
    moved = replace(base, at_mm=(float(x), float(z)))
    return moved, float((moved.placement.origin_mm - start_mm) @ axis)


def _pressed(pose: Pose, meets_mm: float, depth_mm: float) -> Trajectory:
    """Motion that tilts above the skin, then presses from first touch and holds."""
    ramp_ms = RAMP_MS * np.append(0.0, RAMP_SHARES)
    hold_ms = RAMP_MS + np.array(HOLD_MS)
    times_ms = np.concatenate([[0.0, MOVE_MS], 2 * MOVE_MS + ramp_ms, 2 * MOVE_MS + hold_ms])
    pressed_mm = meets_mm + depth_mm * np.minimum(np.append(ramp_ms, hold_ms) / RAMP_MS, 1.0)
    above_mm = min(meets_mm, 0.0) - CLEARANCE_MM
    depths_mm = np.concatenate([[above_mm, above_mm], pressed_mm])
    tilts_deg = np.where(times_ms > 0.0, pose.tilt_deg, 0.0)
    return Trajectory(
        tuple(times_ms.tolist()),
        depth_mm=tuple(depths_mm.tolist()),
        tilt_deg=None if pose == STILL else tuple(tilts_deg.tolist()),
    )


def first_touch_mm(touch: Touch, pose: Pose) -> float:
    """Depth at which the indenter in a pose meets the undeformed skin, along its pressing. [mm]

    From afar it advances by its gap, which is the distance to the skin or less: so it meets the skin with its
    face, however thin the body is behind that.
    """
    if pose == STILL:
        return 0.0
    placement, skin_mm = touch.placement.moved(pose), touch.mesh.nodes_mm[touch.mesh.skin_nodes]

    def gap_mm(depth_mm: float) -> float:
        return float(touch.body.gap(placement.to_local(skin_mm, depth_mm))[0].min())

    far_mm = float(np.linalg.norm(skin_mm - placement.origin_mm, axis=1).max())
    depth_mm = before_mm = -2.0 * far_mm
    for _ in range(MOST_ADVANCES):
        distance_mm = gap_mm(depth_mm)
        if abs(distance_mm) <= MET_MM:
            return depth_mm
        if distance_mm < 0.0 and depth_mm > before_mm:  # the gap was more than the distance
            return float(brentq(gap_mm, before_mm, depth_mm, xtol=MET_MM))
        if distance_mm < 0.0 or depth_mm > far_mm:
            break
        before_mm, depth_mm = depth_mm, depth_mm + distance_mm
    why = f"at {pose.tilt_deg:g} degrees it never touches a node of the skin; take a smaller range"
    raise InputError("tilt_deg", f"must keep {type(touch.indenter).__name__} on the skin", remedy=why)
