"""The amount of noise of an observer, checked once for all of them."""

from fingerpad.core.checks import not_negative, positive
from fingerpad.core.errors import InputError

LARGEST_NOISE = 1000.0
"""Largest standard deviation of noise over the response: with less than this every answer is a guess."""


def checked_noise(noise_sigma: float, above_zero: bool = False) -> float:
    """Return the standard deviation of multiplicative noise, over the response, as a float."""
    sigma = (positive if above_zero else not_negative)("noise_sigma", noise_sigma)
    if sigma > LARGEST_NOISE:
        raise InputError(
            f"noise_sigma must be at most {LARGEST_NOISE:g} times the response: got {noise_sigma:g}."
        )
    return sigma
