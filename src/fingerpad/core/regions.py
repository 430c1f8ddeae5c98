"""Regions of a plane, and layouts of receptors that fill them at a given density.

The plane is the skin seen from its volar side (x and z), or the unrolled skin of
`fingerpad.skin.unrolled_skin`, where an area in the plane is the same area of skin.
Every random number of a layout has a key, the seed and the number of the receptor: the same seed gives the
same positions, whatever other random numbers are used.
"""

from __future__ import annotations

import math
from collections.abc import Callable, Sequence
from typing import Annotated, Protocol, runtime_checkable

import numpy as np
from numpy.typing import ArrayLike

from fingerpad.core.checked import checked, value_class
from fingerpad.core.errors import ConvergenceError, InputError
from fingerpad.core.random_streams import Purpose, normals, uniforms
from fingerpad.core.values import (
    Finite,
    FiniteMatrix,
    FloatArray,
    NotNegative,
    NotNegativeWhole,
    Pairs,
    Positive,
    Whole,
    choice,
    float_array,
    positive,
)

Point = tuple[float, float]

Place = Callable[[FloatArray], FloatArray]
"""From positions in the plane (n, 2) to points of the skin (n, 3), both in mm."""

PATTERNS = ("rectangular", "hexagonal", "uniform", "jittered", "poisson-disc")
"""Names of layouts, those of the functions below that make them."""

MM2_PER_CM2 = 100.0
MOST_RECEPTORS = 1_000_000  # Upper limit, to detect a wrong unit: the whole finger has some thousands.


@value_class
class Layout:
    """Positions of receptors in a plane."""

    places_mm: FiniteMatrix  #: In the plane of the region, (n_receptors, 2). [mm]
    pitch_mm: Positive  #: Distance of neighbours in a lattice; 1/sqrt(density) in a random layout. [mm]
    pattern: Annotated[str, choice(PATTERNS)]
    seed: NotNegativeWhole | None = None  #: Seed of random positions; None for a lattice.

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


_ROUND_OFF = 1e-9  # Tolerance for points on the border of a region, over its size, because of round-off.


@runtime_checkable
class Region(Protocol):
    """A part of the plane with an area and a test for points."""

    @property
    def area_mm2(self) -> float: ...

    @property
    def bounds_mm(self) -> tuple[Point, Point]:
        """Corners of the smallest upright rectangle around it, the lower one first. [mm]"""
        ...

    def contains(self, points_mm: ArrayLike) -> np.ndarray:
        """Whether each of the points (n, 2) lies inside or on the border, bool (n,)."""
        ...


@value_class
class Rectangle:
    """Rectangle with sides parallel to the axes.

    Examples
    --------
    >>> patch = Rectangle(length_mm=3.0, width_mm=6.0)
    >>> patch.area_mm2, patch.contains([[1.5, 0.0], [0.0, 3.1]]).tolist()
    (18.0, [True, False])
    """

    length_mm: Positive  #: Along the first axis. [mm]
    width_mm: Positive  #: Along the second axis. [mm]
    centre_mm: Point = (0.0, 0.0)  #: Its middle. [mm]

    @property
    def area_mm2(self) -> float:
        """Area. [mm²]"""
        return self.length_mm * self.width_mm

    @property
    def bounds_mm(self) -> tuple[Point, Point]:
        """The rectangle's own lower and upper corner. [mm]"""
        return _bounds(self.centre_mm, 0.5 * self.length_mm, 0.5 * self.width_mm)

    def contains(self, points_mm: ArrayLike) -> np.ndarray:
        """Whether each of the points (n, 2) lies inside or on the border, bool (n,)."""
        away = np.abs(_points(points_mm) - self.centre_mm) / (0.5 * self.length_mm, 0.5 * self.width_mm)
        return away.max(axis=1) <= 1.0 + _ROUND_OFF


@value_class
class Ellipse:
    """Ellipse with axes parallel to the coordinate axes; a disc if both semi-axes are equal.

    Examples
    --------
    >>> disc = Ellipse(2.0, 2.0)
    >>> round(disc.area_mm2, 3), disc.contains([[2.0, 0.0], [1.5, 1.5]]).tolist()
    (12.566, [True, False])
    """

    semi_length_mm: Positive  #: Semi-axis along the first axis. [mm]
    semi_width_mm: Positive  #: Semi-axis along the second axis. [mm]
    centre_mm: Point = (0.0, 0.0)  #: Its middle. [mm]

    @property
    def area_mm2(self) -> float:
        """Area, pi a b. [mm²]"""
        return math.pi * self.semi_length_mm * self.semi_width_mm

    @property
    def bounds_mm(self) -> tuple[Point, Point]:
        """Lower and upper corner of the rectangle around it. [mm]"""
        return _bounds(self.centre_mm, self.semi_length_mm, self.semi_width_mm)

    def contains(self, points_mm: ArrayLike) -> np.ndarray:
        """Whether each of the points (n, 2) lies inside or on the border, bool (n,)."""
        away = (_points(points_mm) - self.centre_mm) / (self.semi_length_mm, self.semi_width_mm)
        return np.square(away).sum(axis=1) <= 1.0 + _ROUND_OFF


@value_class
class Polygon:
    """Region inside a closed line of straight edges that does not cross itself.

    Examples
    --------
    >>> triangle = Polygon(((0.0, 0.0), (4.0, 0.0), (0.0, 2.0)))
    >>> triangle.area_mm2, triangle.contains([[1.0, 0.5], [3.0, 1.5]]).tolist()
    (4.0, [True, False])
    """

    corners_mm: Pairs  #: Three or more, in either direction; the last is joined to the first. [mm]

    def __post_init__(self) -> None:
        corners = np.array(self.corners_mm)
        if len(corners) < 3:
            raise InputError("corners_mm", "needs three pairs or more", str(len(corners)))
        extent = float(np.prod(np.ptp(corners, axis=0)))
        if self.area_mm2 <= _ROUND_OFF * extent:
            raise InputError("corners_mm", "must enclose an area", "corners on one line")
        crossing = _first_crossing(corners)
        if crossing:
            raise InputError(
                f"Edges of a polygon must not cross: those from corners {crossing[0]} and {crossing[1]} do; "
                "list the corners in order around it."
            )

    @property
    def area_mm2(self) -> float:
        """Area, from the cross products of adjacent corners. [mm²]"""
        corners = np.array(self.corners_mm) - self.corners_mm[0]
        return 0.5 * abs(float(_cross(corners, np.roll(corners, -1, axis=0)).sum()))

    @property
    def bounds_mm(self) -> tuple[Point, Point]:
        """Lower and upper corner of the rectangle around it. [mm]"""
        x, z = zip(*self.corners_mm, strict=True)
        return (min(x), min(z)), (max(x), max(z))

    def contains(self, points_mm: ArrayLike) -> np.ndarray:
        """Whether each of the points (n, 2) lies inside, bool (n,).

        A half-line from an inner point crosses an odd number of edges.
        """
        points = _points(points_mm)
        inside = np.zeros(len(points), dtype=bool)
        corners = np.array(self.corners_mm)
        for start, end in zip(corners, np.roll(corners, -1, axis=0), strict=True):
            spans = (start[1] > points[:, 1]) != (end[1] > points[:, 1])
            if spans.any():
                share = (points[spans, 1] - start[1]) / (end[1] - start[1])
                inside[spans] ^= points[spans, 0] < start[0] + share * (end[0] - start[0])
        return inside


def _first_crossing(corners: FloatArray) -> tuple[int, int] | None:
    """Numbers of the first two edges, not adjacent, that cross or touch."""
    count, ends = len(corners), np.roll(corners, -1, axis=0)
    for first in range(count):
        others = np.arange(first + 2, count - (first == 0))
        if not others.size:
            continue
        a, b, c, d = corners[first], ends[first], corners[others], ends[others]
        apart = _cross(b - a, c - a) * _cross(b - a, d - a) > 0.0
        apart |= _cross(d - c, a - c) * _cross(d - c, b - c) > 0.0
        # Edges on one line meet if their extents overlap.
        apart |= (np.maximum(c, d) < np.minimum(a, b)).any(axis=1)
        apart |= (np.minimum(c, d) > np.maximum(a, b)).any(axis=1)
        if not apart.all():
            return first, int(others[np.argmin(apart)])
    return None


def _cross(a: FloatArray, b: FloatArray) -> FloatArray:
    """Cross products of vectors of the plane, (..., 2) -> (...)."""
    return a[..., 0] * b[..., 1] - a[..., 1] * b[..., 0]


def _bounds(centre: Point, half_length: float, half_width: float) -> tuple[Point, Point]:
    x, z = centre
    return (x - half_length, z - half_width), (x + half_length, z + half_width)


def rows_of(name: str, values: ArrayLike, needs: str, columns: int) -> FloatArray:
    """Return an array of some columns, (n, columns), in words those that it `needs`."""
    rows = float_array(name, values, 2)
    if rows.shape[1] != columns:
        raise InputError(name, f"needs {needs}", f"shape {rows.shape}")
    return rows


def _points(points_mm: ArrayLike) -> FloatArray:
    return rows_of("points_mm", points_mm, "two columns", 2)


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

    A receptor lies in the middle of the region's bounds. One of three directions of neighbours is the second
    axis.

    Examples
    --------
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

    def moved(who: np.ndarray, attempt: int) -> FloatArray:
        away = jitter * lattice.pitch_mm * normals(seed, [attempt], who, Purpose.LAYOUT, 2)[0]
        return lattice.places_mm[who] + away

    return Layout(_inside(region, len(lattice), moved), lattice.pitch_mm, "jittered", seed)


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
    region, density_per_cm2, seed
        As in `uniform`.
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
    >>> random = poisson_disc(Rectangle(8.0, 8.0), density_per_cm2=100.0, seed=7)
    >>> from scipy.spatial import cKDTree
    >>> nearest_mm, _ = cKDTree(random.places_mm).query(random.places_mm, k=[2])
    >>> len(random), bool(nearest_mm.min() >= 0.75)
    (64, True)
    """
    count = _expected(region, density_per_cm2)
    if separation > LARGEST_SEPARATION:
        limit = f"{LARGEST_SEPARATION:g} of 1/sqrt(density), the limit of random placement"
        raise InputError("separation", f"must not exceed {limit}", f"{separation:g}")
    if count > MOST_APART:
        raise InputError(
            f"A layout with a least distance may have {MOST_APART:,} receptors at most: got {count:,}; "
            "divide the region or take uniform(...)."
        )
    pitch = mean_spacing_mm(density_per_cm2)
    least, batch, drawn = separation * pitch, 2 * count + 16, 0
    places, points = np.empty((0, 2)), np.empty((0, 2))
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
    from scipy.spatial import cKDTree  # loads for a while, and most layouts do without

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
