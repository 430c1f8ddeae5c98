"""What a rigid body is, found from its gap alone: symmetry, face, and whether the gap keeps its contract."""

from __future__ import annotations

from collections.abc import Callable

import numpy as np

from fingerpad.core.errors import InputError
from fingerpad.core.units import cosine_and_sine
from fingerpad.core.values import FloatArray

Gap = Callable[[FloatArray], tuple[FloatArray, FloatArray]]

ABOVE_MM, BELOW_MM = 10.0, -20.0
"""Heights y between which a face is searched; the face of a body touches y = 0. [mm]"""

REACH_MM, SPACING_MM = 8.0, 0.1
"""Half-extent and spacing of the points at which a gap is compared with its mirror image. [mm]"""

LEVELS_MM = (0.0, -0.3)
"""Heights y of these points: at the highest point of the face and a little below. [mm]"""

SYMMETRIC_MM = 1e-3
"""Largest difference between gaps of mirror images, about what skin in contact penetrates. [mm]"""

FAR_SHARE = 0.05
"""By how much of the smaller one they may differ beyond that: far from a body its gap need not be exact."""

UNIT_TOLERANCE, SLOPE_TOLERANCE = 1e-6, 0.02
"""Largest error of the length of a normal, and of its components against differences of the gap."""

_CLOSE_MM, _STEP_MM, _MOST_STEPS = 1e-9, 1e-4, 200


def mirrored(gap: Gap, spin_deg: float) -> bool:
    """Whether a body, turned by `spin_deg` about y, is its own mirror image across z = 0, from its gap."""
    cosine, sine = cosine_and_sine(spin_deg)
    axes = np.array([[cosine, 0.0, -sine], [0.0, 1.0, 0.0], [sine, 0.0, cosine]])
    line = np.arange(-REACH_MM, REACH_MM + SPACING_MM / 2, SPACING_MM)
    beside = line[line > SPACING_MM / 2]
    points = np.stack(np.meshgrid(line, LEVELS_MM, beside, indexing="ij"), axis=-1).reshape(-1, 3)
    here, there = (gap(seen @ axes)[0] for seen in (points, points * [1.0, 1.0, -1.0]))
    near_mm = np.minimum(np.abs(here), np.abs(there))
    return bool((np.abs(here - there) <= SYMMETRIC_MM + FAR_SHARE * near_mm).all())


def traced_front(
    gap: Gap,
    points_mm: FloatArray,
    above_mm: FloatArray | float = ABOVE_MM,
    below_mm: float = BELOW_MM,
    most_steps: int = _MOST_STEPS,
) -> FloatArray:
    """Y of a face above the x and z of points (n, 3), -inf beside the body, where its gap is 0. [mm]

    From above each height is lowered by its gap, which is the distance to the body or less. Where a gap is
    more than the distance, the last step is halved until the face is found. `above_mm` are heights above the
    face from which it is sought, -inf beside it, and `below_mm` is the lowest. A ray along a wall, which
    takes more than `most_steps`, does not meet it.
    """
    at = np.array(points_mm, dtype=np.float64)
    at[:, 1] = above_mm
    outside_mm, todo = at[:, 1].copy(), np.flatnonzero(at[:, 1] > below_mm)
    for _ in range(most_steps if todo.size else 0):
        distance = gap(at[todo])[0]
        outside_mm[todo] = np.where(distance >= 0.0, at[todo, 1], outside_mm[todo])
        todo, distance = todo[distance > _CLOSE_MM], distance[distance > _CLOSE_MM]
        at[todo, 1] -= distance
        todo = todo[at[todo, 1] > below_mm]
        if not todo.size:
            break
    distance = np.full(len(at), np.inf)
    known = at[:, 1] > below_mm
    distance[known] = gap(at[known])[0]
    at[distance > SYMMETRIC_MM, 1] = -np.inf  # along a wall, which a ray never meets
    inside = np.flatnonzero(distance < -_CLOSE_MM)
    low, high = at[inside, 1], outside_mm[inside]
    while inside.size and (high - low).max() > _CLOSE_MM:
        at[inside, 1] = 0.5 * (low + high)
        below = gap(at[inside])[0] < 0.0
        low, high = np.where(below, at[inside, 1], low), np.where(below, high, at[inside, 1])
    return np.where(at[:, 1] > below_mm, at[:, 1], -np.inf)


def check_gap(gap: Gap, name: str) -> None:
    """Check that a gap has the shapes of its contract, and unit normals that are its gradient on the face."""
    line = np.linspace(-2.1, 2.2, 9)
    points = np.stack(np.meshgrid(line, [0.05], line, indexing="ij"), axis=-1).reshape(-1, 3)
    face_mm = traced_front(lambda at: _shaped(gap, at, name), points)
    found = np.isfinite(face_mm)
    if not found.any():
        return
    at = points[found]
    at[:, 1] = face_mm[found]
    _, normal = _shaped(gap, at, name)
    lengths = np.linalg.norm(normal, axis=1)
    length = lengths[np.abs(lengths - 1.0).argmax()]
    if abs(length - 1.0) > UNIT_TOLERANCE:
        raise InputError(f"gap of {name} must return normals of length 1: got length {length:g}.")
    ahead, behind = (
        np.stack([gap(at + step * axis)[0] for axis in np.eye(3)], axis=1) for step in (_STEP_MM, -_STEP_MM)
    )
    here = gap(at)[0][:, None]
    # At an edge the gap has one slope on either side, and the normal is one of them.
    smooth = np.abs(ahead + behind - 2.0 * here).max(axis=1) < SLOPE_TOLERANCE * _STEP_MM
    error = np.where(smooth, np.abs((ahead - behind) / (2.0 * _STEP_MM) - normal).max(axis=1), 0.0)
    if error.max() > SLOPE_TOLERANCE:
        worst = int(error.argmax())
        place = ", ".join(f"{value:.3g}" for value in at[worst])
        raise InputError(
            f"gap of {name} must return its own gradient as the normal: at ({place}) mm they differ by "
            f"{error[worst]:.2g}."
        )


def _shaped(gap: Gap, points: FloatArray, name: str) -> tuple[FloatArray, FloatArray]:
    """Return gap and normal, or raise `InputError` if their shapes or numbers are not as promised."""
    try:
        distance, normal = gap(points)
        shapes = np.shape(distance), np.shape(normal)
    except (TypeError, ValueError) as error:
        raise InputError(
            f"gap of {name} must return two arrays, gap (n,) and normal (n, 3), for points (n, 3): {error}."
        ) from error
    n = len(points)
    if shapes != ((n,), (n, 3)):
        raise InputError(
            f"gap of {name} must return gap ({n},) and normal ({n}, 3) for {n} points: got shapes "
            f"{shapes[0]} and {shapes[1]}."
        )
    if not (np.isfinite(distance).all() and np.isfinite(normal).all()):
        raise InputError(f"gap of {name} must return finite numbers: got NaN or infinity.")
    return distance, normal
