"""Keyed random numbers: the same key gives the same numbers, on any number of threads and in any order.

A key consists of the seed of the run, the presentation, the receptor and the purpose. The generator is
counter-based (Philox 4x64, 10 rounds; Salmon, Moraes, Dror & Shaw 2011): it maps the key and a counter to
four words of 64 bits, so any number of any stream is computed directly, without the ones before it.

    key     = (seed, purpose)
    counter = (block, 0, receptor, trial),    block = 1, 2, ...

NumPy has the same generator with the same counter: its uniform numbers and `uniforms` agree to the last bit.
The kernels of `neuron` and `psychophysics` compute the numbers of a key inside their loops.
Libraries that draw take a generator of NumPy: it is made here from a key, and nowhere else.
"""

from __future__ import annotations

import math
from collections.abc import Sequence
from dataclasses import dataclass
from enum import IntEnum
from typing import Any

import numpy as np
from numba import njit, uint64

from fingerpad.core.errors import InputError
from fingerpad.core.values import FloatArray, IntArray, instance, whole

Numbers = int | Sequence[int] | np.ndarray
"""Trials or receptors: their numbers, or their count, numbered from 0."""

LARGEST_SEED = 2**63 - 1  # Seeds, trials and receptors fit into a signed 64-bit integer, as in NumPy.
MOST_NUMBERS = 100_000_000  # Largest number of random numbers that are drawn at once: 0.8 GB.

Key = int | Sequence[int] | np.random.SeedSequence  # A seed, or a seed and numbers.


def generator(key: Key) -> np.random.Generator:
    """Return the generator of NumPy (Philox) for a key."""
    return np.random.Generator(np.random.Philox(key))


def published_generator(seed: int) -> np.random.Generator:
    """Return the generator (PCG64) that drew what is published: CMA-ES, sweeps and reduced touches."""
    return np.random.default_rng(seed)


def emcee_state(key: Key) -> Any:
    """Return the state that emcee needs of a generator: it takes Mersenne Twisters only."""
    return np.random.RandomState(np.random.MT19937(key)).get_state()


def independent_keys(key: Key, count: int) -> list[np.random.SeedSequence]:
    """Derive keys of independent streams."""
    return (key if isinstance(key, np.random.SeedSequence) else np.random.SeedSequence(key)).spawn(count)


def seed_of(seed: int, number: int) -> int:
    """Return the seed of one of several parts, so that one more part leaves the others where they are."""
    return int(np.random.SeedSequence([seed, number]).generate_state(1)[0])


WORDS = 4  # Numbers of one block.

# Constants of Philox 4x64 as published: two multipliers, and the increments of the key per round.
_MULTIPLIER_0 = np.uint64(0xD2E7470EE14C6C93)
_MULTIPLIER_1 = np.uint64(0xCA5A826395121157)
_ADDED_0 = np.uint64(0x9E3779B97F4A7C15)
_ADDED_1 = np.uint64(0xBB67AE8584CAA73B)
_ROUNDS = 10
_HALF = np.uint64(32)
_LOW_HALF = np.uint64(0xFFFFFFFF)
_BEYOND_DOUBLE = np.uint64(11)
_LAST_BIT = 2.0**-53


@njit(cache=True, nogil=True)
def _high_word(a: np.uint64, b: np.uint64) -> np.uint64:
    """Upper 64 of the 128 bits of a product, from the four products of halves."""
    a0, a1 = a & _LOW_HALF, a >> _HALF
    b0, b1 = b & _LOW_HALF, b >> _HALF
    middle = a1 * b0 + ((a0 * b0) >> _HALF)
    other = a0 * b1 + (middle & _LOW_HALF)
    return a1 * b1 + (middle >> _HALF) + (other >> _HALF)


@njit(cache=True, nogil=True)
def words(
    seed: int, purpose: int, block: int, receptor: int, trial: int
) -> tuple[np.uint64, np.uint64, np.uint64, np.uint64]:
    """Map a key and a counter to four words (Salmon et al. 2011, section 4.3)."""
    k0, k1 = uint64(seed), uint64(purpose)
    c0, c1, c2, c3 = uint64(block), uint64(0), uint64(receptor), uint64(trial)
    for _ in range(_ROUNDS):
        high_0, low_0 = _high_word(_MULTIPLIER_0, c0), _MULTIPLIER_0 * c0
        high_1, low_1 = _high_word(_MULTIPLIER_1, c2), _MULTIPLIER_1 * c2
        c0, c1, c2, c3 = high_1 ^ c1 ^ k0, low_1, high_0 ^ c3 ^ k1, low_0
        k0, k1 = k0 + _ADDED_0, k1 + _ADDED_1
    return c0, c1, c2, c3


@njit(cache=True, nogil=True)
def four_uniforms(
    seed: int, trial: int, receptor: int, purpose: int, block: int
) -> tuple[float, float, float, float]:
    """Return the four uniform numbers of one block, for kernels; the stream's number 0 opens block 1."""
    w0, w1, w2, w3 = words(seed, purpose, block, receptor, trial)
    return (
        (w0 >> _BEYOND_DOUBLE) * _LAST_BIT, (w1 >> _BEYOND_DOUBLE) * _LAST_BIT,
        (w2 >> _BEYOND_DOUBLE) * _LAST_BIT, (w3 >> _BEYOND_DOUBLE) * _LAST_BIT,
    )  # fmt: skip


@njit(cache=True, nogil=True)
def four_normals(
    seed: int, trial: int, receptor: int, purpose: int, block: int
) -> tuple[float, float, float, float]:
    """Return the four standard normal numbers of one block, for kernels, by the formula of Box and Muller.

    From u0 and u1: r = sqrt(-2 ln(1 - u0)) on the circle at the angle 2 pi u1; likewise from u2 and u3.
    """
    u0, u1, u2, u3 = four_uniforms(seed, trial, receptor, purpose, block)
    r0, r1 = math.sqrt(-2.0 * math.log1p(-u0)), math.sqrt(-2.0 * math.log1p(-u2))
    angle_0, angle_1 = 2.0 * math.pi * u1, 2.0 * math.pi * u3
    return (r0 * math.cos(angle_0), r0 * math.sin(angle_0), r1 * math.cos(angle_1), r1 * math.sin(angle_1))


class Purpose(IntEnum):
    """Purpose of random numbers. Streams of different purposes are independent.

    The values are part of every key: a new purpose takes a new value, and no value is changed.
    """

    CURRENT = 1  # Noise of the current through a membrane.
    THRESHOLD = 2  # Threshold of each interspike interval.
    GAIN = 3  # Gain of an end organ in a presentation.
    ESCAPE = 4  # Spikes of a membrane with an escape rate.
    RESPONSE = 5  # Multiplicative noise of a response, such as a rate.
    SENSITIVITY = 6  # Constant sensitivity of an end organ.
    LAYOUT = 7  # Position of an end organ.
    PICK = 8  # Selection of the distributions or sets that an observer compares.
    CRITERION = 9  # Variation of an observer's criterion.
    JUDGEMENT = 10  # Correct or incorrect judgements that follow a psychometric function.
    END_ORGAN = 12  # Position of one of several end organs of an afferent.
    SPIKE_COUNT = 11  # Spike counts of a Poisson process in a window.


@dataclass(frozen=True)
class Presentations:
    """Site, trial and receptor of each spike train; trial and receptor are part of its random key."""

    sites: IntArray  #: Column of the current or drive, (n_trains,).
    trials: IntArray  #: Number of the presentation; trains of one receptor need different ones, (n_trains,).
    receptors: IntArray  #: Number of the end organ, (n_trains,).

    def __post_init__(self) -> None:
        for name in ("sites", "trials", "receptors"):
            numbers = numbered(name, np.asarray(getattr(self, name)))
            numbers.setflags(write=False)
            object.__setattr__(self, name, numbers)
        sizes = self.sites.size, self.trials.size, self.receptors.size
        if len(set(sizes)) > 1:
            raise InputError(f"Presentations needs one site, trial and receptor per train: got {sizes}.")
        if len(np.unique(np.stack([self.trials, self.receptors]), axis=1).T) < len(self):
            raise InputError(
                "Presentations needs a different trial for each train of a receptor, otherwise their random "
                f"numbers are equal: got trials {self.trials[:8].tolist()} of receptors "
                f"{self.receptors[:8].tolist()}."
            )

    @classmethod
    def of_population(cls, n_receptors: int) -> Presentations:
        """Present one touch once to as many receptors as there are sites."""
        sites = numbered("n_receptors", n_receptors)
        return cls(sites, np.zeros_like(sites), sites)

    @classmethod
    def of_one_afferent(cls, n_stimuli: int, n_repeats: int = 1) -> Presentations:
        """Present one stimulus per site to one afferent, all of them `n_repeats` times in turn."""
        stimuli, repeats = numbered("n_stimuli", n_stimuli), numbered("n_repeats", n_repeats)
        sites = np.tile(stimuli, repeats.size)
        return cls(sites, np.arange(sites.size), np.zeros_like(sites))

    def __len__(self) -> int:
        return self.sites.size

    def part(self, trains: slice) -> Presentations:
        """Return the presentations of some of the trains."""
        return Presentations(self.sites[trains], self.trials[trains], self.receptors[trains])


def checked_sites(sites: IntArray, n_sites: int) -> IntArray:
    """Return the sites of spike trains if a current has these columns, else raise `InputError`."""
    if sites.size and (sites.min() < 0 or sites.max() >= n_sites):
        raise InputError("sites", f"must be within 0 ... {n_sites - 1}", f"{sites.min()} ... {sites.max()}")
    return sites


def uniforms(seed: int, trials: Numbers, receptors: Numbers, purpose: Purpose, count: int) -> FloatArray:
    """Draw uniform numbers of every trial with every receptor, (n_trials, n_receptors, count)."""
    return _drawn(seed, trials, receptors, purpose, count, normal=False)


def normals(seed: int, trials: Numbers, receptors: Numbers, purpose: Purpose, count: int) -> FloatArray:
    """Draw standard normal numbers, like `uniforms`; NumPy computes those of the same generator otherwise."""
    return _drawn(seed, trials, receptors, purpose, count, normal=True)


def _drawn(
    seed: int, trials: Numbers, receptors: Numbers, purpose: Purpose, count: int, normal: bool
) -> FloatArray:
    pairs = np.meshgrid(numbered("trials", trials), numbered("receptors", receptors), indexing="ij")
    shape = *pairs[0].shape, whole("count", count, 0, MOST_NUMBERS // max(pairs[0].size, 1))
    numbers = np.empty((pairs[0].size, shape[-1]))
    who, chosen = [each.ravel() for each in pairs], int(instance("purpose", purpose, Purpose))
    _fill(whole("seed", seed, 0, LARGEST_SEED), who[0], who[1], chosen, normal, numbers)
    return numbers.reshape(shape)


@njit(cache=True, nogil=True)
def _fill(seed, trials, receptors, purpose, normal, numbers):  # type: ignore[no-untyped-def]
    """Write the first numbers of every stream."""
    count = numbers.shape[1]
    for n in range(trials.size):
        for first in range(0, count, WORDS):
            block = first // WORDS + 1
            if normal:
                four = four_normals(seed, trials[n], receptors[n], purpose, block)
            else:
                four = four_uniforms(seed, trials[n], receptors[n], purpose, block)
            for k in range(min(WORDS, count - first)):
                numbers[n, first + k] = four[k]


def numbered(name: str, which: Numbers) -> IntArray:
    """Return the numbers of trials or receptors: the given ones, or the first `which` from 0."""
    if isinstance(which, int | np.integer):
        return np.arange(whole(name, which, 1, MOST_NUMBERS), dtype=np.int64)
    if isinstance(which, np.ndarray) and np.issubdtype(which.dtype, np.integer) and which.min(initial=0) >= 0:
        return which.astype(np.int64)
    return np.array([whole(name, number, 0, LARGEST_SEED) for number in which], dtype=np.int64)
