"""Multiplicative noise with keys, and Gradient Sums of noisy populations (Figure 3, (a) to (d)).

    r' = r n,    n ~ Normal(1, sigma_1)                 (a)
    S  = sum over receptors and their neighbours of |r'_i - r'_j|    (b), (c)

Each n has the key (seed, trial, receptor, RESPONSE) and a position in that stream, the number of the
presentation. Sums are computed in compiled blocks that do not store all noise or all responses. Threads
divide the trials; the sums are the same on any number of threads.
"""

from __future__ import annotations

import numpy as np
from numba import njit
from numpy.typing import ArrayLike

from fingerpad.core.checked import checked
from fingerpad.core.errors import InputError
from fingerpad.core.random_streams import LARGEST_SEED, Purpose, four_normals, normals
from fingerpad.core.threads import in_blocks
from fingerpad.core.values import (
    Count,
    Finite,
    FloatArray,
    IntArray,
    NotNegativeWhole,
    Whole,
    not_negative,
    positive,
)

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
    responses: FloatArray, noise_sigma: float, seed: int, trials: IntArray, presentations: int
) -> FloatArray:
    draws = normals(seed, trials, responses.shape[1], Purpose.RESPONSE, presentations)
    return responses[:, np.newaxis] * (1.0 + noise_sigma * draws.transpose(0, 2, 1))


@checked
def noisy_gradient_sums(
    responses: FloatArray,
    neighbours: ArrayLike,
    noise_sigma: Finite | FloatArray,
    seed: Whole,
    trials: IntArray,
    presentations: Count,
) -> FloatArray:
    """Sum the gradients of noisy presentations of every stimulus, steps (a) to (d).

    What `fingerpad.psychophysics.encoding.gradient_sum` makes of `noisy_responses`, without keeping either.
    Several measures of the same presentations, or several strengths of the noise, meet the same random
    numbers, which are drawn once.
    """
    values = np.asarray(responses, dtype=np.float64)
    measures = np.ascontiguousarray(values.reshape(-1, *values.shape[-2:]))
    sigmas = np.ascontiguousarray(np.broadcast_to(noise_sigma, values.shape[:-2]).ravel(), dtype=np.float64)
    pairs = np.ascontiguousarray(neighbours, dtype=np.int64)
    numbers = np.ascontiguousarray(trials, dtype=np.int64).ravel()
    stimuli = np.repeat(np.arange(trials.shape[0]), trials.shape[1])
    sums = np.zeros((len(measures), numbers.size, presentations))

    def fill(some: slice) -> None:
        _fill_sums(measures, stimuli[some], pairs, sigmas, seed, numbers[some], sums[:, some])

    in_blocks(fill, numbers.size, _TRIALS_AT_ONCE)
    return sums.reshape(*values.shape[:-2], *trials.shape, presentations)


def shared_noise_gradient_sums(
    responses: FloatArray, neighbours: ArrayLike, noise_sigma: float, standard_normals: FloatArray
) -> FloatArray:
    """Sum the gradients of every stimulus under the same noise."""
    values = np.ascontiguousarray(responses, dtype=np.float64)
    pairs = np.ascontiguousarray(neighbours, dtype=np.int64)
    sums = np.zeros((len(values), len(standard_normals)))
    _fill_shared(values, pairs, noise_sigma, np.ascontiguousarray(standard_normals.T), sums)
    return sums


@njit(cache=True, nogil=True)
def _fill_sums(measures, stimuli, pairs, sigmas, seed, trials, sums):  # type: ignore[no-untyped-def]
    """Add up the sums (n_measures, n_trials, presentations) of some trials, a few presentations at a time."""
    n_receptors, count = measures.shape[2], sums.shape[2]
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
            for measure in range(measures.shape[0]):
                _multiply(measures[measure, stimuli[trial]], sigmas[measure], draws, noisy)
                _add_gradients(noisy, pairs, sums[measure, trial, first:last])


@njit(cache=True, nogil=True)
def _fill_shared(values, pairs, sigma, standard_normals, sums):  # type: ignore[no-untyped-def]
    """Add up the sums (n_stimuli, n_draws) of responses under given noise (n_receptors, n_draws)."""
    n_receptors, count = standard_normals.shape
    draws = np.zeros((n_receptors, _PRESENTATIONS_AT_ONCE))
    noisy = np.empty_like(draws)
    for first in range(0, count, _PRESENTATIONS_AT_ONCE):
        last = min(first + _PRESENTATIONS_AT_ONCE, count)
        draws[:, : last - first] = standard_normals[:, first:last]
        for stimulus in range(values.shape[0]):
            _multiply(values[stimulus], sigma, draws, noisy)
            _add_gradients(noisy, pairs, sums[stimulus, first:last])


@njit(cache=True, nogil=True)
def _multiply(responses, sigma, draws, noisy):  # type: ignore[no-untyped-def]
    for receptor in range(responses.size):
        for k in range(draws.shape[1]):
            noisy[receptor, k] = responses[receptor] * (1.0 + sigma * draws[receptor, k])


@njit(cache=True, nogil=True)
def _add_gradients(noisy, pairs, sums):  # type: ignore[no-untyped-def]
    """Add to every sum the absolute differences of all neighbours, both ways round (b, c)."""
    for pair in range(pairs.shape[0]):
        one, other = noisy[pairs[pair, 0]], noisy[pairs[pair, 1]]
        for k in range(sums.size):
            sums[k] += 2.0 * abs(one[k] - other[k])


LARGEST_NOISE = 1000.0
"""Largest standard deviation of noise over the response: with less than this every answer is a guess."""


def checked_noise(noise_sigma: float, above_zero: bool = False) -> float:
    """Return the standard deviation of multiplicative noise, over the response, as a float."""
    sigma = (positive if above_zero else not_negative)("noise_sigma", noise_sigma)
    if sigma > LARGEST_NOISE:
        raise InputError(
            "noise_sigma", f"must be at most {LARGEST_NOISE:g} times the response", f"{noise_sigma:g}"
        )
    return sigma
