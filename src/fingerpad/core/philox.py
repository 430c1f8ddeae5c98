"""The generator of `fingerpad.core.random_streams`: Philox 4x64 with 10 rounds, for kernels.

A key and a counter are mapped to four words of 64 bits (Salmon, Moraes, Dror & Shaw 2011). The generator has
no state: any block of any stream is computed directly.
"""

from __future__ import annotations

import math

import numpy as np
from numba import njit, uint64

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
        (w0 >> _BEYOND_DOUBLE) * _LAST_BIT,
        (w1 >> _BEYOND_DOUBLE) * _LAST_BIT,
        (w2 >> _BEYOND_DOUBLE) * _LAST_BIT,
        (w3 >> _BEYOND_DOUBLE) * _LAST_BIT,
    )


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
