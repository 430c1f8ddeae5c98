"""Keyed random numbers: the same key gives the same numbers, on any number of threads and in any order.

A key consists of the seed of the run, the presentation, the receptor and the purpose. The generator is
counter-based (Philox 4x64, 10 rounds; Salmon, Moraes, Dror & Shaw 2011): it maps the key and a counter to
four words of 64 bits, so any number of any stream is computed directly, without the ones before it.

    key     = (seed, purpose)
    counter = (block, 0, receptor, trial),    block = 1, 2, ...

NumPy has the same generator with the same counter: its uniform numbers and `uniforms` agree to the last bit.
The kernels of `neuron` and `psychophysics` compute the numbers of a key inside their loops (`core.philox`).
Libraries that draw take a generator of NumPy: it is made here from a key, and nowhere else.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from enum import IntEnum
from typing import Any

import numpy as np
from numba import njit

from fingerpad.core.errors import InputError
from fingerpad.core.philox import WORDS, four_normals, four_uniforms
from fingerpad.core.values import FloatArray, IntArray, instance, whole

Numbers = int | Sequence[int] | np.ndarray
"""Trials or receptors: their numbers, or their count, numbered from 0."""

LARGEST_SEED = 2**63 - 1

MOST_NUMBERS = 100_000_000  # Largest number of random numbers that are drawn at once: 0.8 GB.

"""Seeds, trials and receptors fit into a signed 64-bit integer, as in NumPy."""


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

    sites: IntArray  # Column of the current or drive, (n_trains,).
    trials: IntArray  # Number of the presentation; trains of one receptor need different ones, (n_trains,).
    receptors: IntArray  # Number of the end organ, (n_trains,).

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
    def of_population(cls, n_receptors: int, n_trials: int = 1) -> Presentations:
        """Present one touch `n_trials` times to as many receptors as there are sites, trial by trial."""
        receptors, trials = numbered("n_receptors", n_receptors), numbered("n_trials", n_trials)
        sites = np.tile(receptors, trials.size)
        return cls(sites, np.repeat(trials, receptors.size), sites)

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
    """Draw uniform numbers of many streams at once."""
    return _of_each_pair(seed, trials, receptors, purpose, count, normal=False)


def normals(seed: int, trials: Numbers, receptors: Numbers, purpose: Purpose, count: int) -> FloatArray:
    """Draw standard normal numbers of many streams at once.

    Notes
    -----
    Box & Muller 1958. NumPy computes normal numbers of the same generator by another method.
    """
    return _of_each_pair(seed, trials, receptors, purpose, count, normal=True)


def _of_each_pair(
    seed: int, trials: Numbers, receptors: Numbers, purpose: Purpose, count: int, normal: bool
) -> FloatArray:
    """Numbers of every trial with every receptor, (n_trials, n_receptors, count)."""
    pairs = np.meshgrid(numbered("trials", trials), numbered("receptors", receptors), indexing="ij")
    numbers = draw_each(seed, pairs[0].ravel(), pairs[1].ravel(), purpose, count, normal)
    return numbers.reshape(*pairs[0].shape, count)


def draw_each(
    seed: int, trials: IntArray, receptors: IntArray, purpose: Purpose, count: int, normal: bool
) -> FloatArray:
    """Draw uniform or normal numbers of the stream of each trial and receptor (n,), (n, count)."""
    numbers = np.empty((trials.size, whole("count", count, 0, MOST_NUMBERS // max(trials.size, 1))))
    _fill(
        _number("seed", seed), trials, receptors, int(instance("purpose", purpose, Purpose)), normal, numbers
    )
    return numbers


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
    return np.array([_number(name, number) for number in which], dtype=np.int64)


def _number(name: str, value: int) -> int:
    number = whole(name, value, 0)
    if number > LARGEST_SEED:
        raise InputError(name, f"must not exceed {LARGEST_SEED}", str(number))
    return number
