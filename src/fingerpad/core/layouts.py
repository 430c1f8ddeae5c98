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


MOST_RECEPTORS = 1_000_000  # Upper limit, to detect a wrong unit: the whole finger has some thousands.


@dataclass(frozen=True)
@converted
class Layout:
    """Positions of receptors in a plane."""

    places_mm: FloatArray  # In the plane of the region, (n_receptors, 2). [mm]
    pitch_mm: float  # Distance of neighbours in a lattice; 1/sqrt(density) in a random layout. [mm]
    pattern: str
    seed: int | None = None  # Seed of random positions; None for a lattice.

    def __post_init__(self) -> None:
        places = float_array("places_mm", self.places_mm, 2)
        if places.shape[1] != 2 or len(places) == 0:
            raise InputError("places_mm", "must have rows of two numbers", f"shape {places.shape}")
        positive("pitch_mm", self.pitch_mm, "mm")
        one_of("pattern", self.pattern, PATTERNS)
        if self.seed is not None:
            whole("seed", self.seed, at_least=0)
        object.__setattr__(self, "places_mm", places)

    def __len__(self) -> int:
        return len(self.places_mm)


def mean_spacing_mm(density_per_cm2: float) -> float:
    """Side of the square with the area per receptor, 1/sqrt(density). [mm]"""
    return math.sqrt(MM2_PER_CM2 / density_per_cm2)


def around_zero(count: int) -> FloatArray:
    """Positions of `count` points with unit distance, centred on 0, (count,)."""
    return np.arange(count, dtype=np.float64) - 0.5 * (count - 1)
