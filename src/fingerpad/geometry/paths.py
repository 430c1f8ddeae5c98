"""Whether an indenter stays on the finger and out of its bone, wherever its motion takes it."""

from __future__ import annotations

import numpy as np

from fingerpad.core.errors import InputError
from fingerpad.core.values import FloatArray
from fingerpad.geometry.fingertip import Finger
from fingerpad.geometry.motion import Motion

CLEARANCE_TO_BONE = 0.8  # Share of the way to the bone that an indenter may go.
STEP_MM = 0.25  # Distance between places at which a way along the skin is looked at. [mm]
FAR_MM = 1000.0  # Way beyond which the samples are looked at first. [mm]


def check_path(finger: Finger, motion: Motion, at_mm: tuple[float, float]) -> None:
    """Check every place of a motion before anything is pressed."""
    samples_ms = np.array(motion.samples_ms)
    if motion.stays:
        # Depths between samples lie between theirs.
        times, places = samples_ms, np.broadcast_to(at_mm, (samples_ms.size, 2))
    else:
        ways = np.array([[pose.x_mm, pose.z_mm] for pose in motion.poses])
        if np.abs(ways).max() > FAR_MM:  # beside any finger, and too far for the places between
            _skin_y_mm(finger, motion, samples_ms, *(at_mm + ways).T)
        parts = np.maximum(np.ceil(np.linalg.norm(np.diff(ways, axis=0), axis=1) / STEP_MM), 1).astype(int)
        numbers = np.repeat(np.arange(parts.size), parts)
        share = (np.arange(numbers.size) - np.repeat(np.cumsum(parts) - parts, parts)) / parts[numbers]
        positions = np.append(numbers + share, parts.size)
        times = np.interp(positions, np.arange(samples_ms.size), samples_ms)
        places = at_mm + np.column_stack([np.interp(times, samples_ms, way) for way in ways.T])
    x, z = places.T
    skin_y_mm = _skin_y_mm(finger, motion, times, x, z)
    if motion.by_force:
        return
    # Depth is counted from the skin at first touch, and skin elsewhere lies higher or lower.
    lies_mm = skin_y_mm - skin_y_mm[0]
    deepest_mm = lies_mm + CLEARANCE_TO_BONE * finger.depth_available_mm(x, z)
    depths_mm = motion.prescribed_at(times)
    worst = int((depths_mm - deepest_mm).argmax())
    if depths_mm[worst] > deepest_mm[worst]:
        raise InputError(
            "depth_mm",
            f"must stay below {deepest_mm[worst]:.2f} mm at x = {x[worst]:g}, z = {z[worst]:g} mm, "
            "because of the bone",
            f"{depths_mm[worst]:g} mm{_sample(motion, times[worst])}",
        )


def _skin_y_mm(
    finger: Finger, motion: Motion, times_ms: FloatArray, x_mm: FloatArray, z_mm: FloatArray
) -> FloatArray:
    """Return y of the skin at every place, or raise `InputError` that names the first outside. [mm]"""
    try:
        return finger.skin_point(x_mm, z_mm)[..., 1]
    except InputError:
        for time, x, z in zip(times_ms, x_mm, z_mm, strict=True):
            try:
                finger.skin_point(x, z)
            except InputError as error:
                if motion.stays:
                    raise
                where = _sample(motion, float(time))
                raise InputError(f"The indenter must not leave the finger{where}: {error}") from error
        raise


def _sample(motion: Motion, time_ms: float) -> str:
    """Name the sample at a time, or the next one; nothing if no samples were given."""
    number = int(np.searchsorted(motion.samples_ms, time_ms * (1.0 - 1e-12))) + 1
    return f" at {time_ms:.6g} ms, sample {number}" if motion.given_samples else ""
