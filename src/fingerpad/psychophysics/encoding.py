"""Codes of a population of afferents, and its noise (paper, section 2.2.3, Figure 3, (a) to (e*)).

Codes apply to any response measure (a rate, a latency) and along the last axis, so thousands of noisy
populations are evaluated at once. The noise is that of `Noise`; the paper's multiplies, r_0 = 0:

    r' = r + sigma_1 sqrt(r^2 + r_0^2) n,    n ~ Normal(0, 1)        (a)
    S  = sum over receptors and their neighbours of |r'_i - r'_j|    (b), (c)

Each n has the key (seed, trial, receptor, RESPONSE) and a position in that stream, the number of the
presentation. Sums are computed in compiled blocks that do not store all noise or all responses. Threads
divide the trials; the sums are the same on any number of threads.
"""

from __future__ import annotations

import math
from collections.abc import Callable, Sequence
from typing import Annotated, NamedTuple

import numpy as np
from numba import njit
from numpy.typing import ArrayLike
from scipy.spatial import Delaunay, QhullError, cKDTree

from fingerpad.core.checked import checked, value_class
from fingerpad.core.errors import InputError
from fingerpad.core.random_streams import LARGEST_SEED, Purpose, four_normals, normals
from fingerpad.core.regions import PATTERNS
from fingerpad.core.signals import ResponseMap
from fingerpad.core.threads import in_blocks
from fingerpad.core.values import (
    Check,
    Count,
    Finite,
    FloatArray,
    IntArray,
    NotNegative,
    NotNegativeWhole,
    Positive,
    Whole,
    array,
    choice,
    float_array,
    limits,
    within,
)

RESPONSE_MEASURES: dict[str, Callable[[ResponseMap], FloatArray]] = {
    "static": lambda response: response.static_rate_hz,
    "dynamic": lambda response: response.dynamic_rate_hz,
    "latency": lambda response: response.first_spike_latency_ms,
}
"""Measures of a response on which spheres are discriminated, by name. [spikes/s or ms]"""


def noise_offset(measure: str, offset_hz: float) -> float:
    """Return the offset of the noise of a measure: that of rates does not hold for a latency."""
    return 0.0 if measure == "latency" else offset_hz


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
    """Find the pairs of neighbours in a layout of any pattern of `fingerpad.core.regions`."""
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


LARGEST_NOISE = 1000.0
"""Largest standard deviation of noise over the response: with less than this every answer is a guess."""


@value_class
class Noise:
    """Noise of a response r: its standard deviation is sigma_1 sqrt(r^2 + r_0^2).

    Examples
    --------
    >>> Noise(0.1).spread([0.0, 40.0]).tolist(), Noise(0.1, offset=30.0).spread([0.0, 40.0]).tolist()
    ([0.0, 4.0], [3.0, 5.0])
    """

    sigma: Annotated[float, limits(0.0, LARGEST_NOISE)]
    """Standard deviation sigma_1 over the response, where this is much larger than the offset."""
    offset: NotNegative = 0.0
    """Response r_0 below which the noise hardly depends on the response; 0, as in the paper, for noise that
    multiplies. [unit of the response]"""

    def spread(self, responses: ArrayLike) -> FloatArray:
        """Return the standard deviation of the noise of every response. [unit of the response]"""
        return self.sigma * np.hypot(responses, self.offset)


def noise_of(name: str, noise: float | Noise) -> Noise:
    """Return a noise, also from the standard deviation of one that multiplies."""
    return noise if isinstance(noise, Noise) else Noise(within(name, noise, 0.0, LARGEST_NOISE))


AnyNoise = Annotated[float | Noise, Check(noise_of, {"type": "number"})]
"""A noise, or the standard deviation sigma_1 of one that multiplies."""


class Measured(NamedTuple):
    """One measure of a population under several stimuli, and the pairs of its receptors that take part."""

    responses: FloatArray  #: The standard in the first row, (n_stimuli, n_receptors). [any unit]
    neighbours: IntArray  #: Pairs that the Gradient Sum goes over, (n_pairs, 2).
    offset: float = 0.0  #: Of the noise, as of `Noise`. [unit of the responses]

    def noise(self, sigma: float) -> Noise:
        """Return the noise of this measure with a standard deviation sigma_1."""
        return Noise(sigma, self.offset)


def taking_part(responses: ArrayLike, neighbours: ArrayLike, offset: float = 0.0) -> Measured:
    """Leave out the receptors that are silent under one stimulus (docs/decisions/silent-receptors.md).

    A receptor that is silent under one stimulus has no latency to compare with its neighbours'. It is left
    out under every stimulus, so that silence itself does not discriminate two stimuli.
    """
    table = np.asarray(responses, dtype=np.float64)
    pairs = check_neighbours(neighbours, table.shape[-1] if table.ndim else 0)
    silent = np.asarray(np.isnan(table).any(axis=0))
    return Measured(np.where(silent, 0.0, table), pairs[~silent[pairs].any(axis=1)], offset)


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


TRIALS_PER_SESSION = 2**32  # Trials of one session. Sessions of one seed share no random number.

LARGEST_SESSION = LARGEST_SEED // TRIALS_PER_SESSION - 1

_RESPONSE = int(Purpose.RESPONSE)
_TRIALS_AT_ONCE = 64
_PRESENTATIONS_AT_ONCE = 128
"""A multiple of 4, the numbers of a block of the random generator; with 18 receptors they fit into 18 KB."""


@checked
def session_trials(session: NotNegativeWhole, *shape: int) -> IntArray:
    if session > LARGEST_SESSION:
        raise InputError("session", f"must not exceed {LARGEST_SESSION}", str(session))
    return session * TRIALS_PER_SESSION + np.arange(int(np.prod(shape)), dtype=np.int64).reshape(shape)


def noisy_responses(
    responses: FloatArray, noise: Noise, seed: int, trials: IntArray, presentations: int
) -> FloatArray:
    draws = normals(seed, trials, responses.shape[1], Purpose.RESPONSE, presentations)
    return responses[:, np.newaxis] + noise.spread(responses)[:, np.newaxis] * draws.transpose(0, 2, 1)


@checked
def noisy_gradient_sums(
    responses: FloatArray,
    neighbours: ArrayLike,
    noises: Sequence[Noise],
    seed: Whole,
    trials: IntArray,
    presentations: Count,
) -> FloatArray:
    """Gradient sums of noisy presentations, (n_noises, *trials.shape, presentations), of the same numbers."""
    values = np.ascontiguousarray(responses, dtype=np.float64)
    pairs = np.ascontiguousarray(neighbours, dtype=np.int64)
    numbers = np.ascontiguousarray(trials, dtype=np.int64).ravel()
    stimuli = np.repeat(np.arange(trials.shape[0]), trials.shape[1])
    spreads = np.array([noise.spread(values) for noise in noises])
    sums = np.zeros((len(noises), numbers.size, presentations))

    def fill(some: slice) -> None:
        _fill_sums(values, stimuli[some], pairs, spreads, seed, numbers[some], sums[:, some])

    in_blocks(fill, numbers.size, _TRIALS_AT_ONCE)
    return sums.reshape(len(noises), *trials.shape, presentations)


def shared_noise_gradient_sums(
    responses: FloatArray, neighbours: ArrayLike, noise: Noise, standard_normals: FloatArray
) -> FloatArray:
    """Sum the gradients of every stimulus under the same noise."""
    values = np.ascontiguousarray(responses, dtype=np.float64)
    pairs = np.ascontiguousarray(neighbours, dtype=np.int64)
    sums = np.zeros((len(values), len(standard_normals)))
    _fill_shared(values, pairs, noise.spread(values), np.ascontiguousarray(standard_normals.T), sums)
    return sums


@njit(cache=True, nogil=True)
def _fill_sums(responses, stimuli, pairs, spreads, seed, trials, sums):  # type: ignore[no-untyped-def]
    """Add up the sums (n_noises, n_trials, presentations) of some trials, a few presentations at a time."""
    n_receptors, count = responses.shape[1], sums.shape[2]
    draws = np.zeros((n_receptors, _PRESENTATIONS_AT_ONCE))
    noisy = np.empty_like(draws)
    for trial in range(trials.size):
        for first in range(0, count, _PRESENTATIONS_AT_ONCE):
            last = min(first + _PRESENTATIONS_AT_ONCE, count)
            for receptor in range(n_receptors):
                for start in range(first, last, 4):
                    four = four_normals(seed, trials[trial], receptor, _RESPONSE, start // 4 + 1)
                    for k in range(4):  # up to three too many at the end, not used
                        draws[receptor, start - first + k] = four[k]
            stimulus = stimuli[trial]
            for noise in range(spreads.shape[0]):
                _add_noise(responses[stimulus], spreads[noise, stimulus], draws, noisy)
                _add_gradients(noisy, pairs, sums[noise, trial, first:last])


@njit(cache=True, nogil=True)
def _fill_shared(values, pairs, spreads, standard_normals, sums):  # type: ignore[no-untyped-def]
    """Add up the sums (n_stimuli, n_draws) of responses under given noise (n_receptors, n_draws)."""
    n_receptors, count = standard_normals.shape
    draws = np.zeros((n_receptors, _PRESENTATIONS_AT_ONCE))
    noisy = np.empty_like(draws)
    for first in range(0, count, _PRESENTATIONS_AT_ONCE):
        last = min(first + _PRESENTATIONS_AT_ONCE, count)
        draws[:, : last - first] = standard_normals[:, first:last]
        for stimulus in range(values.shape[0]):
            _add_noise(values[stimulus], spreads[stimulus], draws, noisy)
            _add_gradients(noisy, pairs, sums[stimulus, first:last])


@njit(cache=True, nogil=True)
def _add_noise(responses, spreads, draws, noisy):  # type: ignore[no-untyped-def]
    for receptor in range(responses.size):
        for k in range(draws.shape[1]):
            noisy[receptor, k] = responses[receptor] + spreads[receptor] * draws[receptor, k]


@njit(cache=True, nogil=True)
def _add_gradients(noisy, pairs, sums):  # type: ignore[no-untyped-def]
    """Add to every sum the absolute differences of all neighbours, both ways round (b, c)."""
    for pair in range(pairs.shape[0]):
        one, other = noisy[pairs[pair, 0]], noisy[pairs[pair, 1]]
        for k in range(sums.size):
            sums[k] += 2.0 * abs(one[k] - other[k])
