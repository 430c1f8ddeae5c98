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
from typing import NamedTuple, cast

import numpy as np

from fingerpad.core.checked import checked
from fingerpad.core.errors import InputError
from fingerpad.core.random_streams import published_generator
from fingerpad.core.signals import STORED_ENERGY
from fingerpad.core.values import FloatArray, NotNegativeWhole
from fingerpad.data import neuron
from fingerpad.geometry.fingertip import Fingertip
from fingerpad.geometry.motion import Trajectory
from fingerpad.reduction.model import (
    AT_ONCE,
    GRID_POINTS,
    ON_THE_PAD,
    RELAXED,
    ReducedModel,
    depth_basis,
    filter_step,
    origin_of,
)
from fingerpad.reduction.streaming import ReducedTouch
from fingerpad.reduction.training import ReducedTraining, TrainingPose
from fingerpad.skin.indentation import Touch
from fingerpad.skin.sampling import SkinResponse

BEYOND_CONTACT_MM = 3.0  # How far the local fields extend beyond the contact. [mm]
LOST = 1e-3  # Part of the fields that modes may leave out, relative to the largest singular value.
FINE_PARTS = 20  # Parts of a training step in which the filters are integrated.
COVERAGE = 0.95  # Part of new touches whose error is to stay within the bound.
FEWEST_CALIBRATED = 19  # Least number of touches from which a bound with this coverage exists.
CHECKED_SITES = 9  # Sites along and across at which errors are measured.

EXPONENTS = tuple(0.05 * n for n in range(17))

KEPT = ("compressive_stress", neuron.HUMAN_DYNAMIC_QUANTITY, neuron.HUMAN_STATIC_QUANTITY)
"""What a reduced touch keeps by default: pressure, which RA follows too, and what the default SAI follows."""

STREAM_MS = 5.0  # Longest step of the stream while errors are measured. [ms]

Solve = Callable[[Sequence[Touch], str], list[SkinResponse]]
"""Solves touches of a named stage, in their order."""


@checked
def reduce_touch(
    training: ReducedTraining,
    solve: Solve | None = None,
    quantities: Sequence[str] = KEPT,
    calibration: NotNegativeWhole = 20,
    seed: NotNegativeWhole = 1,
) -> ReducedModel:
    """Make a reduced touch from full presses, which `solve` may find in a store; by default it solves them.

    The first of the `quantities` must stand for the pressure on the skin. The error is measured on as many
    random touches as `calibration` says: 0 for none, else 19 or more.
    """
    if not quantities:
        raise InputError("quantities", "must name at least one quantity", "none")
    if calibration and calibration < FEWEST_CALIBRATED:
        least = f"must be 0 or at least {FEWEST_CALIBRATED} touches"
        why = f"fewer have no bound for {COVERAGE:.0%} of touches"
        raise InputError("calibration", f"{least}, {why}", str(calibration))
    solve = solve or (lambda touches, stage: [touch.solve() for touch in touches])
    poses = list(training.poses())
    shape, again = training.pressed_again()
    *pressed, repressed = solve([*(touch for pose in poses for touch in pose.touches), again], "training")
    each = len(poses[0].touches)
    responses = [pressed[n * each : (n + 1) * each] for n in range(len(poses))]
    model = with_exponents(fitted_model(training, poses, responses, tuple(quantities)), repressed, shape)
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
        wrong = np.array([row.wrong for row in streamed(tried, skin, shape)])
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
    so_far = np.zeros(model.error.size)
    relative = so_far
    for row in streamed(model, skin, shape):
        so_far = np.maximum(so_far, row.reduced)
        relative = np.maximum(relative, row.wrong / model.error_scale(so_far))
    return relative


class _Row(NamedTuple):
    """One time of a comparison: largest errors, and largest values of both, of quantities and of force."""

    wrong: FloatArray
    known: FloatArray
    reduced: FloatArray


def streamed(model: ReducedModel, skin: SkinResponse, shape: Iterable[float]) -> Iterator[_Row]:
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


def fitted_model(
    training: ReducedTraining,
    poses: Sequence[TrainingPose],
    responses: Sequence[Sequence[SkinResponse]],
    quantities: tuple[str, ...],
) -> ReducedModel:
    touch, deepest_mm = poses[0].touches[0], training.range.depth_mm
    finger = cast(Fingertip, touch.finger)
    constants = np.unique([time for law in touch.tissues.layers for time in law.prony.times_ms])
    reach = _reach_mm(responses)
    terms = [
        _terms(skin.times_ms, skin.depth_mm - pose.meets_mm, deepest_mm, constants)
        for pose, each in zip(poses, responses, strict=True)
        for skin in each
    ]
    middles = np.array([_middle_mm(each[-1]) for each in responses])
    # Values are quadratic in the strain where they are energies.
    squared = np.array([quantity == STORED_ENERGY for quantity in quantities])
    totals, fields_of, peaks = [], [], []
    for n, each in enumerate(responses):
        linear, quadratic = (
            np.vstack(rows) for rows in zip(*terms[n * len(each) : (n + 1) * len(each)], strict=True)
        )
        sites = _local_sites(finger, middles[n], reach)
        known = np.vstack(
            [np.hstack([skin.sample(quantity, sites) for quantity in quantities]) for skin in each]
        )
        whole = np.vstack([np.stack([skin.force_mn, skin.contact_area_mm2], axis=1) for skin in each])
        found = np.linalg.lstsq(linear, np.hstack([whole, known]), rcond=1e-8)[0]
        of_squares = np.concatenate([[False, False], np.repeat(squared, len(sites))])
        found[:, of_squares] = np.linalg.lstsq(quadratic, known[:, of_squares[2:]], rcond=1e-8)[0]
        peaks.append(known.reshape(len(known), len(quantities), -1).max(axis=(0, 2)))
        totals.append(found[:, :2])
        fields_of.append(found[:, 2:])
    coefficients, modes = _modes(np.stack(fields_of), len(quantities))
    hardest_mn = max(skin.force_mn.max() for each in responses for skin in each)
    return ReducedModel(
        axes=training.range.axes,
        depth_mm=deepest_mm,
        at_mm=training.touch.at_mm,
        times_ms=constants,
        quantities=quantities,
        first_touch_mm=np.array([pose.first_touch_mm for pose in poses]),
        middle_mm=middles,
        totals=np.stack(totals),
        coefficients=coefficients,
        modes=modes,
        reach_mm=reach,
        largest=np.append(np.max(peaks, axis=0), hardest_mn),
        error=np.full(len(quantities) + 1, np.inf),
        exponents=np.zeros(len(quantities) + 1),
        origin=origin_of(touch),
    )


def filtered(times_ms: FloatArray, values: FloatArray, constant_ms: float) -> FloatArray:
    """Filter values over time that start from rest."""
    found = np.zeros_like(values)
    for now in range(1, times_ms.size):
        a, b, gamma = filter_step(times_ms[now] - times_ms[now - 1], np.array([constant_ms]))
        found[now] = a * values[now] + b * values[now - 1] + gamma * found[now - 1]
    return found


def _terms(
    times_ms: FloatArray, depth_mm: FloatArray, deepest_mm: float, constants_ms: FloatArray
) -> tuple[FloatArray, FloatArray]:
    """One row per time: the response at once, less what each branch has relaxed; and the same of squares."""
    # The strain behind a square grows with the depth here.
    steps = np.arange(FINE_PARTS * (times_ms.size - 1) + 1) / FINE_PARTS
    fine = np.interp(steps, np.arange(times_ms.size), times_ms)
    depth = np.maximum(np.interp(fine, times_ms, depth_mm), 0.0)[:, None]
    basis = depth_basis(depth[:, 0], deepest_mm, RELAXED)
    linear = [depth_basis(depth_mm, deepest_mm, AT_ONCE)]
    quadratic = linear.copy()
    for constant in constants_ms.tolist():
        relaxed = filtered(fine, np.hstack([basis, depth]), constant)
        share = np.divide(relaxed[:, -1:], depth, out=np.zeros_like(depth), where=depth > 0.0)
        linear.append(-relaxed[::FINE_PARTS, :-1])
        quadratic.append(-(share * (2.0 - share) * basis)[::FINE_PARTS])
    return np.hstack(linear), np.hstack(quadratic)


def _middle_mm(skin: SkinResponse) -> FloatArray:
    """X and z of the middle of the contact in the undeformed skin, weighted by the pressure. [mm]"""
    nodes_mm = skin.mesh.nodes_mm[skin.mesh.skin_nodes]
    weight = skin.contact_pressure_kpa.max(axis=0) * skin.mesh.skin_area_mm2
    x, _, z = (weight @ nodes_mm) / weight.sum()
    return np.array([x, z if skin.touch is not None and skin.touch.grading.full else 0.0])


def _reach_mm(responses: Sequence[Sequence[SkinResponse]]) -> FloatArray:
    """Half-extent of the largest contact and `BEYOND_CONTACT_MM`, along and across. [mm]"""
    extents = []
    for each in responses:
        skin = each[-1]
        touched = skin.mesh.nodes_mm[skin.mesh.skin_nodes][skin.contact_pressure_kpa.max(axis=0) > 0.0]
        extents.append(np.abs(touched[:, [0, 2]] - _middle_mm(skin)).max(axis=0))
    return np.asarray(np.max(extents, axis=0) + BEYOND_CONTACT_MM)


def _local_sites(finger: Fingertip, middle_mm: FloatArray, reach_mm: FloatArray) -> FloatArray:
    """Places of the end organs of a local field, (n_grid², 2), moved onto the pad if they lie beside it."""
    along, across = (np.linspace(-reach, reach, GRID_POINTS) for reach in reach_mm)
    x, z = (grid.ravel() for grid in np.meshgrid(middle_mm[0] + along, middle_mm[1] + across, indexing="ij"))
    x = np.clip(x, 2.0, finger.length_mm - 2.0)
    widest = ON_THE_PAD * finger.section(x)[2]
    return np.column_stack([x, np.clip(z, -widest, widest)])


def _modes(values: FloatArray, n_quantities: int) -> tuple[FloatArray, FloatArray]:
    """Coefficients (n_poses, n_terms, n_modes) and modes of fields (n_poses, n_terms, n_values)."""
    by_quantity = values.reshape(*values.shape[:2], n_quantities, -1)
    scale = np.abs(by_quantity).max(axis=(0, 1, 3), keepdims=True)
    flat = (by_quantity / scale).reshape(values.shape[0] * values.shape[1], -1)
    left, size, right = np.linalg.svd(flat, full_matrices=False)
    kept = int((size > LOST * size[0]).sum())
    modes = right[:kept].reshape(1, kept, n_quantities, -1) * scale
    return (
        (left[:, :kept] * size[:kept]).reshape(*values.shape[:2], kept),
        np.ascontiguousarray(modes.reshape(kept, n_quantities, GRID_POINTS, GRID_POINTS)),
    )
