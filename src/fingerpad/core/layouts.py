"""A layout of receptors: positions in a plane, and their pitch.

The pitch of a lattice is the distance of nearest neighbours. Random layouts have a nominal pitch of
1/sqrt(density). `core.patterns` fills a region with one.
"""

from __future__ import annotations

import math
from collections.abc import Callable
from dataclasses import dataclass

import numpy as np

from fingerpad.core.checks import FloatArray, float_array, one_of, positive, whole
from fingerpad.core.errors import InputError
from fingerpad.core.values import converted

Place = Callable[[FloatArray], FloatArray]
"""From positions in the plane (n, 2) to points of the skin (n, 3), both in mm."""

PATTERNS = ("rectangular", "hexagonal", "uniform", "jittered", "poisson-disc")
"""Names of the functions of `core.patterns`."""

MM2_PER_CM2 = 100.0


MOST_RECEPTORS = 1_000_000
"""Upper limit, to detect a wrong unit: the whole finger has some thousands."""


@dataclass(frozen=True)
@converted
class Layout:
    """Positions of receptors in a plane.

    Parameters
    ----------
    places_mm : array (n_receptors, 2)
        In the plane of the region. [mm]
    pitch_mm : float
        Distance of neighbours in a lattice; 1/sqrt(density) in a random layout. [mm]
    pattern : str
        One of `PATTERNS`.
    seed : int, optional
        Seed of random positions; None for a lattice.

    Raises
    ------
    InputError
        If there is no position or they are not pairs of finite numbers.
    """

    places_mm: FloatArray
    pitch_mm: float
    pattern: str
    seed: int | None = None

    def __post_init__(self) -> None:
        places = float_array("places_mm", self.places_mm, 2)
        if places.shape[1] != 2 or len(places) == 0:
            raise InputError(f"places_mm must have rows of two numbers: got shape {places.shape}.")
        positive("pitch_mm", self.pitch_mm, "mm")
        one_of("pattern", self.pattern, PATTERNS)
        if self.seed is not None:
            whole("seed", self.seed, at_least=0)
        object.__setattr__(self, "places_mm", places)

    def __len__(self) -> int:
        return len(self.places_mm)


def mean_spacing_mm(density_per_cm2: float) -> float:
    """Side of the square with the area per receptor, 1/sqrt(density). [mm]

    Examples
    --------
    >>> mean_spacing_mm(25.0)
    2.0
    """
    return math.sqrt(MM2_PER_CM2 / density_per_cm2)


def around_zero(count: int) -> FloatArray:
    """Positions of `count` points with unit distance, centred on 0, (count,).

    Examples
    --------
    >>> around_zero(2).tolist(), around_zero(3).tolist()
    ([-0.5, 0.5], [-1.0, 0.0, 1.0])
    """
    return np.arange(count, dtype=np.float64) - 0.5 * (count - 1)
