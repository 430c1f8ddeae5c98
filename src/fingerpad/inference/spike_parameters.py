"""The five parameters of an afferent with a soft threshold, and their canonical form for fits.

With a, b, c = (beta, k_d, k_s)/(C v), tau and the width w of the threshold over the threshold,

    A = a/w,    B = b/w,    C = c/w,    G = 1/w,    ln tau

are parameters in which the logarithm of the hazard is linear, except for tau.
"""

from __future__ import annotations

import math

import numpy as np
from numpy.typing import ArrayLike

from fingerpad.core.checks import FloatArray, float_array, positive
from fingerpad.core.errors import InputError
from fingerpad.inference.identifiable import IDENTIFIABLE_NAMES

SPIKE_PARAMETER_NAMES = (*IDENTIFIABLE_NAMES, "escape_width")
"""The four identifiable parameters, and the width of the threshold over the threshold."""

N_PARAMETERS = len(SPIKE_PARAMETER_NAMES)


def canonical(parameters: FloatArray) -> FloatArray:
    """Return (A, B, C, G, ln tau) of (a, b, c, tau, w)."""
    width = parameters[4]
    return np.array([*(parameters[:3] / width), 1.0 / width, math.log(parameters[3])])


def from_canonical(numbers: FloatArray) -> FloatArray:
    """Return (a, b, c, tau, w) of (A, B, C, G, ln tau): the inverse of `canonical`."""
    sharpness = numbers[3]
    return np.array([*(numbers[:3] / sharpness), math.exp(numbers[4]), 1.0 / sharpness])


def canonical_jacobian(parameters: FloatArray) -> FloatArray:
    a, b, c, tau, width = parameters
    jacobian = np.zeros((N_PARAMETERS, N_PARAMETERS))
    jacobian[[0, 1, 2], [0, 1, 2]] = 1.0 / width
    jacobian[:4, 4] = -np.array([a, b, c, 1.0]) / width**2
    jacobian[4, 3] = 1.0 / tau
    return jacobian


def checked_spike_parameters(parameters: ArrayLike) -> FloatArray:
    """Return five finite parameters with positive tau and width, else raise `InputError`."""
    numbers = float_array("parameters", parameters, 1)
    if numbers.size != N_PARAMETERS:
        raise InputError(
            f"parameters must hold {', '.join(SPIKE_PARAMETER_NAMES)}: got {numbers.size} numbers."
        )
    positive(SPIKE_PARAMETER_NAMES[3], numbers[3], "ms")
    positive(SPIKE_PARAMETER_NAMES[4], numbers[4])
    return numbers
