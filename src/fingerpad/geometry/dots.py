"""Patterns of raised dots on a plate, and cells of Braille."""

from __future__ import annotations

import numpy as np

from fingerpad.core.checked import checked, value_class
from fingerpad.core.errors import InputError
from fingerpad.core.values import Flag, FloatArray, Pairs, PointsMm, Positive, SizeMm
from fingerpad.geometry.indenters import Indenter

BRAILLE_DOT_MM, BRAILLE_HEIGHT_MM, BRAILLE_PITCH_MM, BRAILLE_CELL_MM = 1.44, 0.48, 2.34, 6.2
"""Base diameter and height of a dot, distance of dots in a cell, distance of cells: US Library of Congress,
National Library Service specification 800 (2008), section 3.2; status recalled. [mm]"""

_CELLS = (
    "a1 b12 c14 d145 e15 f124 g1245 h125 i24 j245 k13 l123 m134 n1345 o135 p1234 q12345 r1235 s234 t2345 "
    "u136 v1236 w2456 x1346 y13456 z1356"
)
_LETTERS = {cell[0]: cell[1:] for cell in _CELLS.split()}
"""Numbers of the raised dots: 1 to 3 down the left column of a cell, 4 to 6 down the right one."""


@value_class
class Dots(Indenter):
    """Raised dots on a flat plate: caps of balls with their tops in one plane.

    Parameters
    ----------
    at_mm : sequence of (x, z)
        Middle of each dot, along and across the finger from the indenter's axis. [mm]
    diameter_mm : float
        Diameter of a dot at its base. [mm]
    height_mm : float
        Height of a dot above the plate, at most half of its diameter. [mm]

    Examples
    --------
    >>> pair = Dots([(0.0, 0.0), (2.34, 0.0)])
    >>> pair.front(np.array([[2.34, 0.0, 0.0], [1.17, 0.0, 0.0]])).round(3).tolist()
    [0.0, -0.48]
    """

    at_mm: Pairs
    diameter_mm: SizeMm = BRAILLE_DOT_MM
    height_mm: Positive = BRAILLE_HEIGHT_MM

    def __post_init__(self) -> None:
        if not self.at_mm:
            raise InputError("at_mm", "must hold a pair x, z for each dot", "none")
        if self.height_mm > self.diameter_mm / 2:
            raise InputError(
                "height_mm",
                f"must not exceed half of diameter_mm, {self.diameter_mm / 2:g} mm",
                f"{self.height_mm:g} mm",
            )

    @property
    def radius_mm(self) -> float:
        """Radius of the balls. [mm]"""
        return (self.diameter_mm**2 / 4 + self.height_mm**2) / (2 * self.height_mm)

    @property
    def relief_mm(self) -> float:
        """Diameter of a dot, or the narrowest gap between two dots if that is smaller. [mm]"""
        at = np.array(self.at_mm)
        apart = np.linalg.norm(at[:, None] - at, axis=2) - self.diameter_mm
        return min(self.diameter_mm, float(apart[apart > 0.0].min(initial=np.inf)))

    @property
    def narrowest_mm(self) -> float:
        return self.relief_mm

    def gap(self, points_mm: PointsMm) -> tuple[FloatArray, FloatArray]:
        at, radius = np.array(self.at_mm), self.radius_mm
        beside = np.linalg.norm(points_mm[:, None, [0, 2]] - at, axis=2)
        nearest = at[beside.argmin(axis=1)]
        offset = points_mm - np.column_stack([nearest[:, 0], np.full(len(points_mm), -radius), nearest[:, 1]])
        length = np.linalg.norm(offset, axis=1)
        direction = offset / np.where(length > 0.0, length, 1.0)[:, None]
        ball, plate = length - radius, points_mm[:, 1] + self.height_mm
        # Behind the plate the ball goes on, and the plate is nearer.
        return np.minimum(ball, plate), np.where((ball < plate)[:, None], direction, [0.0, 1.0, 0.0])


@checked
def braille(text: str, along_finger: Flag = True) -> Dots:
    """Braille of some lower-case letters, dots 0.48 mm high, its middle on the indenter's axis.

    Parameters
    ----------
    text : str
        Letters a to z and spaces, uncontracted.
    along_finger : bool
        Whether the columns of a cell run along the finger, as it lies on a line of text that runs across;
        otherwise the line of text runs along the finger.

    Examples
    --------
    >>> braille("l").at_mm
    ((2.34, 0.0), (0.0, 0.0), (-2.34, 0.0))
    """
    unknown = sorted(set(text) - set(_LETTERS) - {" "})
    if unknown or not text.strip():
        low = text.lower()
        instead = f"; write {low!r}" if low != text and not set(low) - set(_LETTERS) - {" "} else ""
        raise InputError("text", "must have letters a to z and spaces", f"{text!r}{instead}")
    places = [
        (cell * BRAILLE_CELL_MM + (int(dot) > 3) * BRAILLE_PITCH_MM, (int(dot) - 1) % 3 * BRAILLE_PITCH_MM)
        for cell, letter in enumerate(text)
        for dot in _LETTERS.get(letter, "")
    ]
    line, down = np.array(places).T
    line, down = (each - 0.5 * (each.min() + each.max()) for each in (line, down))
    # Seen from the skin, z runs to the right where x, to the tip, runs up; a mirror image is another letter.
    at = np.column_stack([-down, line] if along_finger else [line, down]).round(9) + 0.0
    return Dots(tuple(map(tuple, at.tolist())))
