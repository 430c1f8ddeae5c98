"""Make a reduced touch: press all poses, fit, and measure the error on touches that were not used.

The error is measured on random touches of the range: each presses at one pose, perhaps moves to another,
holds, and goes to another depth. Of every touch the largest error over time counts, relative to what
`ReducedModel.error_scale` says at that time. The bounds hold for all quantities of a touch together: over
their medians the errors of a touch are alike, and the largest of them is its score. The bound of the score is
the conformal quantile (Vovk, Gammerman & Shafer, Algorithmic Learning in a Random World, 2005): with n
touches, the ceil(0.95 (n + 1))-th smallest.
"""

from __future__ import annotations

import math
from collections.abc import Callable, Iterable, Iterator, Sequence
from dataclasses import replace
from typing import NamedTuple

import numpy as np

from fingerpad.core.checked import checked
from fingerpad.core.errors import InputError
from fingerpad.core.random_streams import published_generator
from fingerpad.core.signals import STORED_ENERGY
from fingerpad.core.values import FloatArray, NotNegativeWhole
from fingerpad.data.neuron import HUMAN_QUANTITY
from fingerpad.geometry.trajectory import Trajectory
from fingerpad.reduction.model import ReducedModel, fitted_model
from fingerpad.reduction.streaming import ReducedTouch
from fingerpad.reduction.training import ReducedTraining
from fingerpad.skin.indentation import Touch
from fingerpad.skin.sampling import SkinResponse

COVERAGE = 0.95  # Part of new touches whose error is to stay within the bound.
FEWEST_CALIBRATED = 19  # Least number of touches from which a bound with this coverage exists.
CHECKED_SITES = 9  # Sites along and across at which errors are measured.

EXPONENTS = tuple(0.05 * n for n in range(17))

STREAM_MS = 5.0  # Longest step of the stream while errors are measured. [ms]

Solve = Callable[[Sequence[Touch], str], list[SkinResponse]]
"""Solves touches of a named stage, in their order."""


@checked
def reduce_touch(
    training: ReducedTraining,
    solve: Solve | None = None,
    quantities: Sequence[str] = (HUMAN_QUANTITY, STORED_ENERGY),
    calibration: NotNegativeWhole = 20,
    seed: NotNegativeWhole = 1,
) -> ReducedModel:
    """Make a reduced touch from full presses.

    Parameters
    ----------
    training : ReducedTraining
        The touch and the range.
    solve : callable, optional
        Solves touches, for example in many processes or from a store; by default one after the other.
    quantities : sequence of str, optional
        Quantities of `SkinResponse.sample` to keep; the first one must stand for the pressure on the skin.
    calibration : int, optional
        Number of random touches from which the error is measured: 0 for none, else 19 or more.
    seed : int, optional
        Of these touches.

    Raises
    ------
    ConvergenceError
        If a press cannot be solved.

    Examples
    --------
    The range of this example is one place, and its error is not measured:

    >>> import fingerpad as fp
    >>> touch = fp.touch_of(fp.Fingertip(), fp.Sphere(curvature_per_m=287))
    >>> model = fp.reduce_touch(fp.ReducedTraining(touch, fp.ReducedRange(depth_mm=0.5)), calibration=0)
    >>> stream = fp.ReducedTouch(model, [(17.37, 0.0)])
    >>> sample = stream.step(50.0, depth_mm=0.5)
    >>> print(f"{sample.force_mn:.0f} mN")
    22 mN
    """
    if not quantities:
        raise InputError("quantities", "must name at least one quantity", "none")
    if calibration and calibration < FEWEST_CALIBRATED:
        raise InputError(
            "calibration",
            f"must be 0 or at least {FEWEST_CALIBRATED} touches, fewer have no bound for "
            f"{COVERAGE:.0%} of touches",
            str(calibration),
        )
    solve = solve or (lambda touches, stage: [touch.solve() for touch in touches])
    poses = list(training.poses())
    shape, again = training.pressed_again()
    *pressed, repressed = solve([*(touch for pose in poses for touch in pose.touches), again], "training")
    each = len(poses[0].touches)
    responses = [pressed[n * each : (n + 1) * each] for n in range(len(poses))]
    base = training.touch_with(poses[0].values[3:])
    model = fitted_model(
        training.range.axes, training.range.depth_mm, base.at_mm, poses, responses, tuple(quantities)
    )
    model = with_exponents(model, repressed, shape)
    if not calibration:
        return model
    random = published_generator(seed)
    held_out = [draw_touch(training, model, random) for _ in range(calibration)]
    solved = solve([touch for _, touch in held_out], "calibration")
    errors = [largest_errors(model, skin, shape) for (shape, _), skin in zip(held_out, solved, strict=True)]
    return replace(model, error=joint_bounds(np.array(errors)))


def joint_bounds(errors: FloatArray) -> FloatArray:
    """Bounds of several errors, (n_errors,), that all of them keep in `COVERAGE` of new touches."""
    medians = np.maximum(np.median(errors, axis=0), np.finfo(float).tiny)
    scores = np.sort((errors / medians).max(axis=1))
    rank = math.ceil(COVERAGE * (len(errors) + 1)) - 1
    return np.asarray(medians * scores[min(rank, len(errors) - 1)])


def with_exponents(model: ReducedModel, skin: SkinResponse, shape: Iterable[float] = ()) -> ReducedModel:
    """Choose the exponents with which a touch is met best, by least squares over its times."""
    sums = []
    for exponent in EXPONENTS:
        tried = replace(model, exponents=np.full(model.error.size, exponent))
        wrong = np.array([row.wrong for row in _compared(tried, skin, shape)])
        sums.append((wrong**2).sum(axis=0))
    return replace(model, exponents=np.array(EXPONENTS)[np.argmin(sums, axis=0)])


def draw_touch(
    training: ReducedTraining, model: ReducedModel, random: np.random.Generator
) -> tuple[tuple[float, ...], Touch]:
    """Draw a touch of the range: press, perhaps move aside, hold, go to another depth, hold."""
    axes = training.range.axes
    start, end = ({axis.name: random.uniform(axis.low, axis.high) for axis in axes} for _ in range(2))
    shape = tuple(start[axis.name] for axis in axes[3:])
    ways = ("x_mm", "z_mm", "tilt_deg")
    if random.uniform() < 0.5:
        end = start
    first_mm, second_mm = random.uniform(0.3, 1.0, 2) * training.range.depth_mm
    ramp_ms, move_ms, back_ms = random.uniform(30.0, 300.0, 3)
    hold_ms = random.uniform(100.0, 1000.0)
    meets = [
        float(model.pose_weights([*(pose[way] for way in ways), *shape]) @ model.first_touch_mm)
        for pose in (start, end)
    ]
    above_mm = min(0.0, float(model.first_touch_mm.min())) - 0.5
    times_ms = np.cumsum([0.0, 50.0, 50.0, ramp_ms, move_ms, hold_ms, back_ms, 300.0])
    depths = [
        above_mm, above_mm, meets[0], meets[0] + first_mm, meets[1] + first_mm, meets[1] + first_mm,
        meets[1] + second_mm, meets[1] + second_mm,
    ]  # fmt: skip
    x_mm, z_mm, tilt_deg = (
        (0.0, *[start[way]] * 3, *[end[way]] * 4) if start[way] != 0.0 or end[way] != 0.0 else None
        for way in ways
    )
    motion = Trajectory(
        tuple(times_ms.tolist()), depth_mm=tuple(depths), x_mm=x_mm, z_mm=z_mm, tilt_deg=tilt_deg
    )
    return shape, training.touch_with(shape, motion)


def largest_errors(model: ReducedModel, skin: SkinResponse, shape: Iterable[float] = ()) -> FloatArray:
    """Largest errors over a touch, of the quantities and of the force, over `ReducedModel.error_scale`."""
    return _relative(model, _compared(model, skin, shape))


def _relative(model: ReducedModel, rows: Iterable[_Row]) -> FloatArray:
    so_far = np.zeros(model.error.size)
    relative = so_far
    for row in rows:
        so_far = np.maximum(so_far, row.reduced)
        relative = np.maximum(relative, row.wrong / model.error_scale(so_far))
    return relative


def streamed(
    model: ReducedModel, skin: SkinResponse, shape: Iterable[float] = ()
) -> tuple[FloatArray, FloatArray, bool]:
    rows = list(_compared(model, skin, shape))
    wrong, known = (np.max([getattr(row, name) for row in rows], axis=0) for name in ("wrong", "known"))
    return wrong, known, bool((_relative(model, rows) <= model.error).all())


class _Row(NamedTuple):
    """One time of a comparison: largest errors, and largest values of both, of quantities and of force."""

    wrong: FloatArray
    known: FloatArray
    reduced: FloatArray


def _compared(model: ReducedModel, skin: SkinResponse, shape: Iterable[float]) -> Iterator[_Row]:
    """Stream the motion of a full touch, and compare at each of its times."""
    motion = skin.touch.stimulus  # type: ignore[union-attr]
    sites = _sites(model)
    known = np.stack([skin.sample(quantity, sites) for quantity in model.quantities], axis=1)
    stream = ReducedTouch(model, sites, *shape)
    for number in range(1, skin.times_ms.size):
        begin, end = skin.times_ms[number - 1 : number + 1]
        parts = max(1, math.ceil((end - begin) / STREAM_MS))
        for time in (begin + (end - begin) * np.arange(1, parts + 1) / parts).tolist():
            pose, depth_mm = motion.pose_at(time), float(motion.prescribed_at(time))
            sample = stream.step(time, depth_mm, None, pose.x_mm, pose.z_mm, pose.tilt_deg)
        values, force_mn = np.array([*sample.fields.values()]), skin.force_mn[number]
        yield _Row(
            np.append(np.abs(values - known[number]).max(axis=1), abs(sample.force_mn - force_mn)),
            np.append(known[number].max(axis=1), force_mn),
            np.append(values.max(axis=1), sample.force_mn),
        )


def _sites(model: ReducedModel) -> FloatArray:
    """Places about all contacts of the range, (n, 2). [mm]"""
    low, high = model.middle_mm.min(axis=0), model.middle_mm.max(axis=0)
    spread = 0.5 * model.reach_mm
    x, z = (np.linspace(a, b, CHECKED_SITES) for a, b in zip(low - spread, high + spread, strict=True))
    return np.column_stack([grid.ravel() for grid in np.meshgrid(x, z, indexing="ij")])
