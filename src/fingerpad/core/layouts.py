"""A layout of receptors: positions in a plane, and their pitch.

The pitch of a lattice is the distance of nearest neighbours. Random layouts have a nominal pitch of
1/sqrt(density). `core.regions` fills a region with one.
"""

from __future__ import annotations

import math
from collections.abc import Callable
from typing import Annotated

import numpy as np

from fingerpad.core.checked import value_class
from fingerpad.core.errors import InputError
from fingerpad.core.values import FiniteMatrix, FloatArray, NotNegativeWhole, Positive, choice

Place = Callable[[FloatArray], FloatArray]
"""From positions in the plane (n, 2) to points of the skin (n, 3), both in mm."""

PATTERNS = ("rectangular", "hexagonal", "uniform", "jittered", "poisson-disc")
"""Names of the functions of `core.regions` that make them."""

MM2_PER_CM2 = 100.0


MOST_RECEPTORS = 1_000_000  # Upper limit, to detect a wrong unit: the whole finger has some thousands.


@value_class
class Layout:
    """Positions of receptors in a plane."""

    places_mm: FiniteMatrix  # In the plane of the region, (n_receptors, 2). [mm]
    pitch_mm: Positive  # Distance of neighbours in a lattice; 1/sqrt(density) in a random layout. [mm]
    pattern: Annotated[str, choice(PATTERNS)]
    seed: NotNegativeWhole | None = None  # Seed of random positions; None for a lattice.

    def __post_init__(self) -> None:
        if self.places_mm.shape[1] != 2 or len(self.places_mm) == 0:
            raise InputError("places_mm", "must have rows of two numbers", f"shape {self.places_mm.shape}")

    def __len__(self) -> int:
        return len(self.places_mm)


def mean_spacing_mm(density_per_cm2: float) -> float:
    """Side of the square with the area per receptor, 1/sqrt(density). [mm]"""
    return math.sqrt(MM2_PER_CM2 / density_per_cm2)


def around_zero(count: int) -> FloatArray:
    """Positions of `count` points with unit distance, centred on 0, (count,)."""
    return np.arange(count, dtype=np.float64) - 0.5 * (count - 1)
