"""Two ways to read a population of afferents: Gradient Sum and Euclidean Distance (paper, section 2.2.3).

Both work on any response measure (a rate, a latency) and along the last axis, so that thousands of noisy
populations are read at once.
"""

from __future__ import annotations

import numpy as np
from numpy.typing import ArrayLike

from fingerpad.checks import FloatArray, float_array, one_of, positive
from fingerpad.errors import InputError

NORMS = ("city-block", "euclidean")
_BETWEEN_FIRST_AND_SECOND_NEIGHBOUR = 1.5


def neighbour_pairs(positions_mm: ArrayLike, pitch_mm: float, count: int = 8) -> np.ndarray:
    """Find who is whose neighbour.

    Receptors are neighbours when they lie less than 1.5 pitches apart: in x and in z each (8 neighbours,
    diagonals included), or in the sum of both (4 neighbours). On a lattice these are exactly the
    surrounding ones, and a layout that strays a little from the lattice keeps them.

    Parameters
    ----------
    positions_mm : array_like (n_receptors, 2)
        Places of the receptors. [mm]
    pitch_mm : float
        Distance between neighbours of the layout. [mm]
    count : {8, 4}, optional
        Neighbours of a receptor inside a lattice; at the edges there are fewer.

    Returns
    -------
    int array (n_pairs, 2)
        Every pair of neighbours once, the lower index first.

    Raises
    ------
    InputError
        If the positions are not pairs, the pitch is not positive or the count is neither 8 nor 4.

    Examples
    --------
    >>> square = [[0.0, 0.0], [0.0, 1.0], [1.0, 0.0], [1.0, 1.0]]
    >>> neighbour_pairs(square, 1.0, count=4).tolist()
    [[0, 1], [0, 2], [1, 3], [2, 3]]
    >>> len(neighbour_pairs(square, 1.0, count=8))
    6
    """
    positions = float_array("positions_mm", positions_mm, 2)
    if positions.shape[1] != 2:
        raise InputError(f"positions_mm must have rows of x and z: got shape {positions.shape}.")
    if count not in (4, 8):
        raise InputError(f"count must be 8 or 4 neighbours: got {count!r}.")
    apart = np.abs(positions[:, np.newaxis] - positions) / positive("pitch_mm", pitch_mm, "mm")
    separation = apart.max(axis=-1) if count == 8 else apart.sum(axis=-1)
    return np.argwhere(np.triu(separation < _BETWEEN_FIRST_AND_SECOND_NEIGHBOUR, k=1))


def gradient_sum(values: ArrayLike, neighbours: np.ndarray) -> FloatArray:
    """Gradient Sum: how much a response differs from place to place, steps (b) and (c) of Figure 3.

    Each element's gradient is the sum of absolute differences to its neighbours (b); the gradients of all
    elements are summed (c). Each pair of neighbours therefore counts twice.

    Parameters
    ----------
    values : array_like (..., n_receptors)
        Response measure of every receptor. [any unit]
    neighbours : int array (n_pairs, 2)
        From `neighbour_pairs`.

    Returns
    -------
    array (...)
        One sum per population. [unit of `values`]

    Raises
    ------
    InputError
        If the pairs name receptors that are not there.

    Examples
    --------
    >>> in_a_row = neighbour_pairs([[0.0, 0.0], [0.0, 1.0], [0.0, 2.0]], 1.0)
    >>> float(gradient_sum([10.0, 30.0, 25.0], in_a_row))
    50.0
    """
    responses = np.asarray(values, dtype=np.float64)
    pairs = check_neighbours(neighbours, responses.shape[-1] if responses.ndim else 0)
    # Receptors first: whole rows are gathered and subtracted, which is several times faster.
    by_receptor = np.ascontiguousarray(np.moveaxis(responses, -1, 0))
    differences = np.abs(by_receptor[pairs[:, 0]] - by_receptor[pairs[:, 1]])
    return 2.0 * differences.sum(axis=0)


def distance(values_a: ArrayLike, values_b: ArrayLike, norm: str = "city-block") -> FloatArray:
    """Euclidean Distance: how much two populations differ, receptor by receptor, step (e*) of Figure 3.

    The paper gives it that name and sums absolute differences, which is the city-block distance.

    Parameters
    ----------
    values_a, values_b : array_like (..., n_receptors)
        Response measure of the same receptors to two touches; leading axes broadcast. [any unit]
    norm : {"city-block", "euclidean"}, optional
        Sum of absolute differences, as printed, or root of the sum of squares, as named.

    Returns
    -------
    array (...)
        One distance per pair of populations. [unit of the values]

    Raises
    ------
    InputError
        If the norm is unknown or the populations differ in size.

    Examples
    --------
    >>> float(distance([10.0, 20.0], [13.0, 24.0])), float(distance([10.0, 20.0], [13.0, 24.0], "euclidean"))
    (7.0, 5.0)
    """
    one_of("norm", norm, NORMS)
    first, second = np.asarray(values_a, dtype=np.float64), np.asarray(values_b, dtype=np.float64)
    if first.ndim == 0 or second.ndim == 0 or first.shape[-1] != second.shape[-1]:
        raise InputError(f"distance needs the same receptors twice: got {first.shape} and {second.shape}.")
    differences = first - second
    if norm == "euclidean":
        return np.sqrt(np.square(differences).sum(axis=-1))
    return np.abs(differences).sum(axis=-1)


def check_neighbours(neighbours: np.ndarray, n_receptors: int) -> np.ndarray:
    """Return `neighbours` as integers if they are pairs of receptors, else raise `InputError`.

    Parameters
    ----------
    neighbours : int array (n_pairs, 2)
        From `neighbour_pairs`.
    n_receptors : int
        Size of the population.

    Returns
    -------
    int array (n_pairs, 2)

    Raises
    ------
    InputError
        If they are not pairs of indices within 0 ... n_receptors - 1.

    Examples
    --------
    >>> check_neighbours([[0, 1]], 2).tolist()
    [[0, 1]]
    """
    pairs = np.asarray(neighbours)
    if pairs.ndim != 2 or pairs.shape[1] != 2 or not np.issubdtype(pairs.dtype, np.integer):
        raise InputError(
            f"neighbours must be rows of two receptor indices: got {pairs.dtype} of shape {pairs.shape}."
        )
    if pairs.size and (pairs.min() < 0 or pairs.max() >= n_receptors):
        raise InputError(
            f"neighbours must be within 0 ... {n_receptors - 1}: got {pairs.min()} ... {pairs.max()}."
        )
    return pairs
