"""Width of the narrowest ridge, groove or dot of a face, which a mesh must resolve."""

from __future__ import annotations

import numpy as np
from scipy.ndimage import grey_closing, grey_dilation, grey_erosion, grey_opening

from fingerpad.core.checks import FloatArray

REACH_MM = 6.0
"""Ridges, grooves and dots are looked for within this distance of the axis, along and across. [mm]"""

PIXELS = 480
"""Heights of the face along each side of that square, or of the body where it is smaller."""

PIXELS_PER_FEATURE = 4
"""Heights across the narrowest ridge, groove or dot that can be found; wider ones are sought with up to four
times as many."""

WIDTHS_MM = (0.1, 0.15, 0.2, 0.3, 0.4, 0.5, 0.6, 0.8, 1.0, 1.25, 1.5, 1.75, 2.0)
"""Widths of ridges, grooves and dots that are looked for. [mm]"""

RELIEF_MM = 2.0
"""Depth below the highest point within which they are looked for. [mm]"""

RELIEF_SHARE = 0.2
"""A ridge or dot is as high, over its width, or more; a ball's cap of the same width is lower."""


def narrowest_relief(height_mm: FloatArray, spacing_mm: float, beside_mm: float) -> float:
    """Width of the narrowest ridge, groove or dot, 2 mm if all are wider. [mm]

    It is the smallest width of a disc whose opening or closing of the face changes a height by more than
    0.2 of that width, apart from the outermost heights along walls and from slopes above 45 degrees,
    where triangles are ragged.

    Parameters
    ----------
    height_mm : array (nx, nz)
        Heights of the face over a grid of x and z. [mm]
    spacing_mm : float
        Of the grid. [mm]
    beside_mm : float
        Height beside the grid. [mm]
    """
    lowest = max(beside_mm, height_mm.max() - RELIEF_MM)
    height = np.maximum(height_mm, lowest)
    for width in WIDTHS_MM:
        thin = max(1, round(width / spacing_mm) // PIXELS_PER_FEATURE**2)
        radius = round(width / spacing_mm / thin) // 2
        if 2 * radius < PIXELS_PER_FEATURE:
            continue
        disc = np.hypot(*np.indices((2 * radius + 1,) * 2) - radius) <= radius + 0.5
        # The opening of a square is rounder at its corners by 0.41 of the disc's radius.
        around = 2 * int(np.ceil(0.5 * radius)) + 1
        part = np.pad(height[::thin, ::thin], 3 * radius, constant_values=lowest)
        opened = grey_opening(part, footprint=disc, mode="nearest")
        closed = grey_closing(part, footprint=disc, mode="nearest")
        ridges = part - grey_dilation(opened, around, mode="nearest")
        grooves = grey_erosion(closed, around, mode="nearest") - part
        ridges[_is_steep(opened, thin * spacing_mm)] = 0.0
        grooves[_is_steep(closed, thin * spacing_mm)] = 0.0
        # On a slope that ends at the border the disc lies lower by the slope over its width.
        ridges -= 2 * radius * _slope_at_border(part, 3 * radius, 2 * radius)
        if max(ridges.max(), grooves.max()) > RELIEF_SHARE * width:
            return width
    return WIDTHS_MM[-1]


def _is_steep(height: FloatArray, spacing: float) -> np.ndarray:
    """Whether the slope exceeds 45 degrees, (nx, nz)."""
    return np.hypot(*np.gradient(height, spacing)) > 1.0


def _slope_at_border(height: FloatArray, pad: int, zone: int) -> FloatArray:
    """Change of height per cell within a zone along the border inside of a pad, 0 elsewhere, (nx, nz)."""
    slope = np.zeros_like(height)
    for axis in (0, 1):
        before = np.abs(np.diff(height, axis=axis, prepend=np.inf))
        after = np.abs(np.diff(height, axis=axis, append=np.inf))
        slope = np.hypot(slope, np.minimum(before, after))
    slope[pad + zone : -pad - zone, pad + zone : -pad - zone] = 0.0
    return slope
