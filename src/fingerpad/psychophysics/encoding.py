"""Codes of a population of afferents: Gradient Sum and Euclidean Distance (paper, section 2.2.3).

Both apply to any response measure (a rate, a latency) and along the last axis, so thousands of noisy
populations are evaluated at once.
"""

from __future__ import annotations

import math
from collections.abc import Callable
from typing import Annotated

import numpy as np
from numpy.typing import ArrayLike
from scipy.spatial import Delaunay, QhullError, cKDTree

from fingerpad.core.checked import checked
from fingerpad.core.errors import InputError
from fingerpad.core.layouts import PATTERNS
from fingerpad.core.signals import ResponseMap
from fingerpad.core.values import Finite, FloatArray, Positive, Whole, array, choice, float_array

RESPONSE_MEASURES: dict[str, Callable[[ResponseMap], FloatArray]] = {
    "static": lambda response: response.static_rate_hz,
    "dynamic": lambda response: response.dynamic_rate_hz,
    "latency": lambda response: response.first_spike_latency_ms,
}
"""Measures of a response on which spheres are discriminated, by name. [spikes/s or ms]"""

NORMS = ("city-block", "euclidean")
_BETWEEN_FIRST_AND_SECOND_NEIGHBOUR = {4: 1.5, 6: 0.5 * (1.0 + math.sqrt(3.0)), 8: 1.5}
_METRIC = {4: 1.0, 6: 2.0, 8: np.inf}
_LONGEST_PITCHES = 3.0
_LATTICE_NEIGHBOURS = {"rectangular": 8, "hexagonal": 6}


@checked
def neighbour_pairs(positions_mm: ArrayLike, pitch_mm: Positive, count: Whole = 8) -> np.ndarray:
    """Find the pairs (n_pairs, 2) of neighbours in a lattice, each once, the lower index first.

    Receptors are neighbours when they lie less than 1.5 pitches apart: in x and z each (8 neighbours,
    diagonals included), or in the sum of both (4 neighbours). On a square lattice these are exactly the
    surrounding ones, also with small deviations from the lattice. The 6 neighbours of a
    hexagonal lattice lie less than 1.37 pitches away, half way from the first to the second nearest.

    Parameters
    ----------
    positions_mm : array_like (n_receptors, 2)
        Positions of the receptors, such as `Population.places_mm`. [mm]
    pitch_mm : float
        Distance between neighbours of the layout. [mm]
    count : {8, 4, 6}, optional
        Neighbours of a receptor inside a lattice; at the edges there are fewer.

    Examples
    --------
    >>> square = [[0.0, 0.0], [0.0, 1.0], [1.0, 0.0], [1.0, 1.0]]
    >>> neighbour_pairs(square, 1.0, count=4).tolist()
    [[0, 1], [0, 2], [1, 3], [2, 3]]
    >>> len(neighbour_pairs(square, 1.0, count=8))
    6
    """
    positions = _plane(positions_mm)
    if count not in _METRIC:
        raise InputError("count", "must be 8, 4 or 6 neighbours", repr(count))
    reach = _BETWEEN_FIRST_AND_SECOND_NEIGHBOUR[count] * pitch_mm
    # The tree's reach includes its end.
    found = cKDTree(positions).query_pairs(np.nextafter(reach, 0.0), p=_METRIC[count], output_type="ndarray")
    ordered = np.sort(found.astype(np.int64), axis=1)
    return ordered[np.lexsort((ordered[:, 1], ordered[:, 0]))]


@checked
def delaunay_pairs(positions_mm: ArrayLike, pitch_mm: Positive) -> np.ndarray:
    """Find the pairs of neighbours in a random layout.

    Neighbours are joined by an edge of the Delaunay triangulation: their Voronoi cells are adjacent. Edges
    longer than 3 pitches are left out, because they cross a hole or a concave border of the region.
    """
    positions = _plane(positions_mm)
    longest = _LONGEST_PITCHES * pitch_mm
    try:
        corners = Delaunay(positions).simplices
    except (QhullError, ValueError) as error:
        raise InputError(
            "Neighbours of a random layout need three receptors that are not on one line: "
            f"got {len(positions)}."
        ) from error
    pairs = np.unique(np.sort(corners[:, [[0, 1], [0, 2], [1, 2]]].reshape(-1, 2), axis=1), axis=0)
    lengths = np.linalg.norm(positions[pairs[:, 0]] - positions[pairs[:, 1]], axis=1)
    return pairs[lengths <= longest].astype(np.int64)


@checked
def neighbours_of(
    places_mm: ArrayLike, pitch_mm: Finite, pattern: Annotated[str, choice(PATTERNS)]
) -> np.ndarray:
    """Find the pairs of neighbours in a layout of any pattern of `fingerpad.core.layouts`."""
    if pattern in _LATTICE_NEIGHBOURS:
        return neighbour_pairs(places_mm, pitch_mm, _LATTICE_NEIGHBOURS[pattern])
    return delaunay_pairs(places_mm, pitch_mm)


def _plane(positions_mm: ArrayLike) -> FloatArray:
    positions = float_array("positions_mm", positions_mm, 2)
    if positions.shape[1] != 2:
        raise InputError(
            "positions_mm", "must have rows of two numbers, such as x and z", f"shape {positions.shape}"
        )
    return positions


def taking_part(responses: ArrayLike, neighbours: ArrayLike) -> tuple[FloatArray, np.ndarray]:
    """Leave out the receptors that are silent under one stimulus (docs/decisions/silent-receptors.md).

    A receptor that is silent under one stimulus has no latency to compare with its neighbours'. It is left
    out under every stimulus, so that silence itself does not discriminate two stimuli.
    """
    table = np.asarray(responses, dtype=np.float64)
    pairs = check_neighbours(neighbours, table.shape[-1] if table.ndim else 0)
    silent = np.asarray(np.isnan(table).any(axis=0))
    return np.where(silent, 0.0, table), pairs[~silent[pairs].any(axis=1)]


@checked
def gradient_sum(values: ArrayLike, neighbours: ArrayLike) -> FloatArray:
    """Gradient Sum: sum of the differences between neighbours, steps (b) and (c) of Figure 3.

    Each element's gradient is the sum of absolute differences to its neighbours (b); the gradients of all
    elements are summed (c). Each pair of neighbours therefore counts twice.

    Parameters
    ----------
    values : array_like (..., n_receptors)
        Response measure of every receptor. [any unit]
    neighbours : int array (n_pairs, 2)
        From `neighbour_pairs`.

    Examples
    --------
    >>> in_a_row = neighbour_pairs([[0.0, 0.0], [0.0, 1.0], [0.0, 2.0]], 1.0)
    >>> float(gradient_sum([10.0, 30.0, 25.0], in_a_row))
    50.0
    """
    responses = array("values", values)
    pairs = check_neighbours(neighbours, responses.shape[-1] if responses.ndim else 0)
    # Receptors first: whole rows are gathered and subtracted, which is several times faster.
    by_receptor = np.ascontiguousarray(np.moveaxis(responses, -1, 0))
    differences = np.abs(by_receptor[pairs[:, 0]] - by_receptor[pairs[:, 1]])
    sums = 2.0 * differences.sum(axis=0)
    if not np.isfinite(sums).all():
        float_array("values", responses, None)  # says which is not finite
    return sums


@checked
def distance(
    values_a: ArrayLike, values_b: ArrayLike, norm: Annotated[str, choice(NORMS)] = "city-block"
) -> FloatArray:
    """Euclidean Distance: difference between two populations, receptor by receptor, step (e*) of Figure 3.

    The paper uses this name for a sum of absolute differences, which is the city-block distance.
    """
    first, second = np.asarray(values_a, dtype=np.float64), np.asarray(values_b, dtype=np.float64)
    if first.ndim == 0 or second.ndim == 0 or first.shape[-1] != second.shape[-1]:
        raise InputError("distance", "needs the same receptors twice", f"{first.shape} and {second.shape}")
    differences = first - second
    if norm == "euclidean":
        return np.sqrt(np.square(differences).sum(axis=-1))
    return np.abs(differences).sum(axis=-1)


def check_neighbours(neighbours: ArrayLike, n_receptors: int) -> np.ndarray:
    """Return `neighbours` as integers if they are pairs of receptors, else raise `InputError`."""
    pairs = np.asarray(neighbours)
    if pairs.ndim != 2 or pairs.shape[1] != 2 or not np.issubdtype(pairs.dtype, np.integer):
        raise InputError(
            "neighbours", "must be rows of two receptor indices", f"{pairs.dtype} of shape {pairs.shape}"
        )
    if pairs.size and (pairs.min() < 0 or pairs.max() >= n_receptors):
        raise InputError(
            "neighbours", f"must be within 0 ... {n_receptors - 1}", f"{pairs.min()} ... {pairs.max()}"
        )
    if (pairs[:, 0] == pairs[:, 1]).any():
        raise InputError("neighbours", "must be pairs of two receptors", "a receptor with itself")
    return pairs
