"""Layouts that fill a region of the skin: lattices, or random positions, at a given density.

Every random number has a key, the seed and the number of the receptor: the same seed gives the same
positions, whatever other random numbers are used.
"""

from __future__ import annotations

import math
from collections.abc import Callable, Sequence

import numpy as np
from scipy.spatial import cKDTree

from fingerpad.core.checked import checked
from fingerpad.core.errors import ConvergenceError, InputError
from fingerpad.core.layouts import MM2_PER_CM2, MOST_RECEPTORS, Layout, Place, around_zero, mean_spacing_mm
from fingerpad.core.random_streams import Purpose, normals, uniforms
from fingerpad.core.regions import Region
from fingerpad.core.values import Finite, FloatArray, NotNegative, Whole, positive

SEPARATION = 0.75
"""Least distance in a Poisson-disc layout over 1/sqrt(density). Random placement saturates at 0.83."""

LARGEST_SEPARATION = 0.8
MOST_APART = 100_000  # Upper limit of a Poisson-disc layout, whose receptors are placed one after the other.

_MOST_ATTEMPTS = 1000


@checked
def rectangular(region: Region, density_per_cm2: Finite) -> Layout:
    """Square lattice, the pitch being 1/sqrt(density)."""
    _expected(region, density_per_cm2)
    pitch = mean_spacing_mm(density_per_cm2)
    middle, extent = _middle_and_extent(region)
    counts = [max(1, round(length / pitch)) for length in extent]
    _check_lattice(counts)
    columns = [centre + pitch * around_zero(count) for centre, count in zip(middle, counts, strict=True)]
    return _lattice(region, np.stack(np.meshgrid(*columns, indexing="ij"), axis=-1), pitch, "rectangular")


@checked
def hexagonal(region: Region, density_per_cm2: Finite) -> Layout:
    """Triangular lattice with six neighbours per receptor: pitch^2 = 2/(sqrt(3) density).

    Parameters
    ----------
    region, density_per_cm2
        As in `rectangular`.

    Returns
    -------
    Layout
        With a receptor in the middle of the region's bounds. One of three directions of neighbours is the
        second axis.

    Examples
    --------
    >>> from fingerpad.core.regions import Ellipse
    >>> seven = hexagonal(Ellipse(1.2, 1.2), density_per_cm2=200.0 / math.sqrt(3.0))
    >>> len(seven), round(seven.pitch_mm, 12)
    (7, 1.0)
    """
    _expected(region, density_per_cm2)
    pitch = math.sqrt(2.0 / math.sqrt(3.0)) * mean_spacing_mm(density_per_cm2)
    step = 0.5 * math.sqrt(3.0) * pitch
    middle, (length, width) = _middle_and_extent(region)
    rows, columns = (math.ceil(0.5 * extent / size) + 1 for extent, size in ((length, step), (width, pitch)))
    _check_lattice([2 * rows + 1, 2 * columns + 1])
    row, column = np.meshgrid(np.arange(-rows, rows + 1), np.arange(-columns, columns + 1), indexing="ij")
    across = pitch * (column + 0.5 * (row % 2))
    return _lattice(region, np.stack([step * row, across], axis=-1) + middle, pitch, "hexagonal")


@checked
def uniform(region: Region, density_per_cm2: Finite, seed: Whole) -> Layout:
    """Independent positions with uniform probability."""
    count = _expected(region, density_per_cm2)
    places = _inside(region, count, lambda who, attempt: _anywhere(region, seed, attempt, who))
    return Layout(places, mean_spacing_mm(density_per_cm2), "uniform", seed)


@checked
def jittered(region: Region, density_per_cm2: Finite, seed: Whole, jitter: NotNegative = 0.2) -> Layout:
    """Square lattice with random displacements: each coordinate by Normal(0, jitter times the pitch)."""
    lattice = rectangular(region, density_per_cm2)
    spread = jitter * lattice.pitch_mm
    places = _inside(
        region,
        len(lattice),
        lambda who, attempt: (
            lattice.places_mm[who] + spread * normals(seed, [attempt], who, Purpose.LAYOUT, 2)[0]
        ),
    )
    return Layout(places, lattice.pitch_mm, "jittered", seed)


@checked
def poisson_disc(
    region: Region,
    density_per_cm2: Finite,
    seed: Whole,
    separation: NotNegative = SEPARATION,
    place: Place | None = None,
) -> Layout:
    """Random positions with a least distance from each other.

    Positions are sampled one after the other, uniformly in the region. A position too close to an earlier one
    is rejected.

    Parameters
    ----------
    region, density_per_cm2
        As in `rectangular`.
    seed : int
        Of the random numbers.
    separation : float, optional
        Least distance, over 1/sqrt(density).
    place : callable, optional
        Points of the skin (n, 3) at positions in the plane (n, 2), such as `UnrolledSkin.points`. Distances
        are then measured between these points.

    Returns
    -------
    Layout
        Of density times area receptors, rounded.

    Raises
    ------
    ConvergenceError
        If the positions cannot be placed within the allowed number of attempts.

    Examples
    --------
    >>> from fingerpad.core.regions import Rectangle
    >>> random = poisson_disc(Rectangle(8.0, 8.0), density_per_cm2=100.0, seed=7)
    >>> nearest_mm, _ = cKDTree(random.places_mm).query(random.places_mm, k=[2])
    >>> len(random), bool(nearest_mm.min() >= 0.75)
    (64, True)
    """
    count = _expected(region, density_per_cm2)
    if separation > LARGEST_SEPARATION:
        raise InputError(
            "separation",
            f"must not exceed {LARGEST_SEPARATION:g} of 1/sqrt(density), the limit of random placement",
            f"{separation:g}",
        )
    if count > MOST_APART:
        raise InputError(
            f"A layout with a least distance may have {MOST_APART:,} receptors at most: got {count:,}; "
            "divide the region or take uniform(...)."
        )
    pitch = mean_spacing_mm(density_per_cm2)
    least = separation * pitch
    places, points = np.empty((0, 2)), np.empty((0, 2))
    batch = 2 * count + 16
    drawn = 0
    while len(places) < count:
        if drawn > _MOST_ATTEMPTS * count:
            raise ConvergenceError(
                f"Only {len(places)} of {count} receptors could be placed {least:.3g} mm apart after {drawn} "
                "attempts: lower the separation or the density."
            )
        candidates = _anywhere(region, seed, 0, np.arange(drawn, drawn + batch))
        drawn += batch
        candidates = candidates[region.contains(candidates)]
        there = candidates if place is None else place(candidates)
        kept = _apart(points, there, least)
        places = np.vstack([places, candidates[kept]])
        points = there[kept] if not len(points) else np.vstack([points, there[kept]])
    return Layout(places[:count], pitch, "poisson-disc", seed)


def _apart(settled: FloatArray, candidates: FloatArray, least: float) -> np.ndarray:
    """Candidates that have the least distance from placed receptors and from earlier candidates."""
    free = np.ones(len(candidates), dtype=bool)
    if len(settled) and len(candidates):
        distance, _ = cKDTree(settled).query(candidates, distance_upper_bound=least)
        free = ~(distance < least)
    numbers = np.flatnonzero(free)
    if numbers.size == 0:
        return numbers
    neighbours = cKDTree(candidates[numbers]).query_ball_point(candidates[numbers], least * (1.0 - 1e-12))
    kept = np.zeros(numbers.size, dtype=bool)
    for number, near in enumerate(neighbours):
        kept[number] = not kept[near].any()
    return numbers[kept]


def _inside(region: Region, count: int, draw: Callable[[np.ndarray, int], FloatArray]) -> FloatArray:
    """Positions in the region, sampled again while outside; `draw` takes receptor numbers and the attempt."""
    places = np.empty((count, 2))
    missing = np.arange(count)
    for attempt in range(_MOST_ATTEMPTS):
        drawn = draw(missing, attempt)
        hits = region.contains(drawn)
        places[missing[hits]] = drawn[hits]
        missing = missing[~hits]
        if not missing.size:
            return places
    raise ConvergenceError(
        f"{missing.size} of {count} receptors were outside the region {_MOST_ATTEMPTS} times: it fills too "
        "little of its bounds, or the jitter is too large; divide the region or lower the jitter."
    )


def _anywhere(region: Region, seed: int, attempt: int, receptors: np.ndarray) -> FloatArray:
    """Random positions within the bounds of the region, (n, 2)."""
    lower, upper = np.array(region.bounds_mm)
    return lower + (upper - lower) * uniforms(seed, [attempt], receptors, Purpose.LAYOUT, 2)[0]


def _lattice(region: Region, points: FloatArray, pitch: float, pattern: str) -> Layout:
    places = points.reshape(-1, 2)
    inside = places[region.contains(places)]
    if not len(inside):
        raise InputError(
            f"No receptor of a {pattern} lattice with a pitch of {pitch:.3g} mm falls into the region of "
            f"{region.area_mm2:.3g} mm²: raise the density or enlarge the region."
        )
    return Layout(inside, pitch, pattern)


def _check_lattice(counts: Sequence[int]) -> None:
    """Raise an error if the lattice about a thin or hollow region is far larger than the region."""
    if math.prod(counts) > 10 * MOST_RECEPTORS:
        raise InputError(
            f"The bounds of the region hold a lattice of {math.prod(counts):.3g} places, more than "
            f"{10 * MOST_RECEPTORS:,}: divide the region or lower the density."
        )


def _expected(region: Region, density_per_cm2: float) -> int:
    """Return density times area, rounded, if it is at least one and at most the limit."""
    density = positive("density_per_cm2", density_per_cm2, "1/cm²")
    area_mm2 = region.area_mm2
    count = round(density * area_mm2 / MM2_PER_CM2)
    if count < 1:
        raise InputError(
            f"A density of {density:g} /cm² on {area_mm2:.3g} mm² gives no receptor: raise the density or "
            "enlarge the region."
        )
    if count > MOST_RECEPTORS:
        raise InputError(
            f"A layout may have {MOST_RECEPTORS:,} receptors at most: {density:g} /cm² on {area_mm2:.3g} "
            f"mm² gives {count:,}; check that the density is per cm²."
        )
    return count


def _middle_and_extent(region: Region) -> tuple[FloatArray, FloatArray]:
    lower, upper = np.array(region.bounds_mm)
    return 0.5 * (lower + upper), upper - lower
