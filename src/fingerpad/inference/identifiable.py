"""The four identifiable parameters of an afferent with six, and the five of one with a soft threshold.

A spike occurs when the potential reaches the threshold, u = v. Divided by v, Eqs. 1 and 5 read

    d(u/v)/dt = -(u/v)/tau + beta/(C v) + k_d/(C v) U' + k_s/(C v) U,

and neither C nor v appears alone. beta, k_d, k_s, C and v are therefore determined only up to a common scale:
if C or v and the three gains are multiplied by the same number, no spike changes. Recordings determine the
three gains over C v, and tau (docs/decisions.md#four-identifiable-parameters).

A soft threshold has a width as a fifth parameter. With a, b, c = (beta, k_d, k_s)/(C v), tau and the width w
of the threshold over the threshold,

    A = a/w,    B = b/w,    C = c/w,    G = 1/w,    ln tau

are parameters in which the logarithm of the hazard is linear, except for tau.
"""

from __future__ import annotations

import math

import numpy as np
from numpy.typing import ArrayLike

from fingerpad.core.checked import checked
from fingerpad.core.errors import InputError
from fingerpad.core.values import FloatArray, Positive, float_array, positive
from fingerpad.data import neuron
from fingerpad.neuron.afferent import PARAMETER_NAMES

IDENTIFIABLE_NAMES = (
    "intercept_per_ms",
    "dynamic_gain_per_kpa",
    "static_gain_per_kpa_ms",
    "time_constant_ms",
)
"""The four parameters in the paper's order: beta/(C v), k_d/(C v), k_s/(C v), tau."""

LARGEST_RESTING_SHARE = 0.95
"""Largest potential at rest over the threshold in fits, beta tau/(C v): docs/decisions.md#silent-at-rest."""


def identifiable(parameters: ArrayLike) -> FloatArray:
    six = _rows("parameters", parameters, PARAMETER_NAMES)
    scale = six[..., 4:5] * six[..., 5:6]
    if (six[..., 4:] <= 0.0).any():
        raise InputError(
            "capacitance_mf and threshold_mv of parameters must be greater than 0: they are not."
        )
    return np.concatenate([six[..., :3] / scale, six[..., 3:4]], axis=-1)


@checked
def six_parameters(
    four: ArrayLike,
    capacitance_mf: Positive = neuron.CAPACITANCE.value,
    threshold_mv: Positive = neuron.THRESHOLD.value,
) -> FloatArray:
    """Return the six parameters with given C and v that are equivalent to four identifiable ones."""
    numbers = _rows("four", four, IDENTIFIABLE_NAMES)
    kept = np.broadcast_to([capacitance_mf, threshold_mv], (*numbers.shape[:-1], 2))
    return np.concatenate(
        [numbers[..., :3] * (capacitance_mf * threshold_mv), numbers[..., 3:], kept], axis=-1
    )


def silent_at_rest(parameters: ArrayLike) -> FloatArray:
    """Lower the intercept of afferents that would spike, or almost spike, without a stimulus.

    Without a stimulus the potential tends to beta tau/C. SAI afferents are silent at rest, so every fit keeps
    beta tau/(C v) at most at `LARGEST_RESTING_SHARE`.
    """
    six = _rows("parameters", parameters, PARAMETER_NAMES)
    rheobase = six[..., 4:5] * six[..., 5:6] / six[..., 3:4]
    return np.concatenate([np.minimum(six[..., :1], LARGEST_RESTING_SHARE * rheobase), six[..., 1:]], axis=-1)


def _rows(name: str, values: ArrayLike, names: tuple[str, ...]) -> FloatArray:
    """Check that the last axis holds the named numbers."""
    array = float_array(name, values, None)
    if array.shape[-1:] != (len(names),):
        raise InputError(name, f"must hold {', '.join(names)} along its last axis", f"shape {array.shape}")
    return array


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
            "parameters", f"must hold {', '.join(SPIKE_PARAMETER_NAMES)}", f"{numbers.size} numbers"
        )
    positive(SPIKE_PARAMETER_NAMES[3], numbers[3], "ms")
    positive(SPIKE_PARAMETER_NAMES[4], numbers[4])
    return numbers
