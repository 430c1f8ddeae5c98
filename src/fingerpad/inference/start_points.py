"""The paper's start points, and its method of fitting from them (paper, 2.2.2)."""

from __future__ import annotations

import numpy as np

from fingerpad.core.checks import FloatArray
from fingerpad.data import neuron
from fingerpad.inference.fitting.response_surface import ResponseSurface, coding_increments
from fingerpad.inference.identifiable import identifiable, silent_at_rest

INCREMENT = 0.01
"""Coding increment over the start value; the paper's are "typically two orders of magnitude smaller"."""

LOWEST_SHARE = 0.05  # Lower bound of time constant, capacitance and threshold over their start.
START_WIDTH = 0.5  # Width of the threshold over the threshold at the start of fits to spikes. [1]


def printed_starts() -> FloatArray:
    """Both start points of the paper as printed, (2, 6), with energy density in kPa."""
    shared = (neuron.TIME_CONSTANT.value, neuron.CAPACITANCE.value, neuron.THRESHOLD.value)
    return np.array(
        [
            [neuron.INTERCEPT_START.value, dynamic.value, static.value, *shared]
            for dynamic, static in (
                (neuron.DYNAMIC_GAIN_START_1, neuron.STATIC_GAIN_START_1),
                (neuron.DYNAMIC_GAIN_START_2, neuron.STATIC_GAIN_START_2),
            )
        ]
    )


def start_points() -> FloatArray:
    """Both start points of the paper, (2, 6), with rescaled gains.

    One factor of k_d and one of k_s hold for both, see docs/decisions.md#dynamic-gain-rescaled.
    """
    scales = [1.0, neuron.DYNAMIC_GAIN_SCALE.value, neuron.STATIC_GAIN_SCALE.value, 1.0, 1.0, 1.0]
    return printed_starts() * scales


def spike_start() -> FloatArray:
    """Start of every fit to spikes: the paper's first start point with a soft threshold."""
    return np.array([*identifiable(start_points()[0]), START_WIDTH])


def increments(starts: FloatArray) -> FloatArray:
    """Coding increments of both start points (2, 6); that of the intercept is a share of the rheobase."""
    time_constant, capacitance, threshold = starts[0, 3:]
    rheobase = capacitance * threshold / time_constant
    where_zero = np.full(6, INCREMENT * rheobase)
    return np.array([coding_increments(start, INCREMENT, where_zero) for start in starts])


def response_surface(starts: FloatArray | None = None) -> ResponseSurface:
    """Return the paper's method, silent at rest, with gains and parameters of the membrane bounded below."""
    starts = start_points() if starts is None else starts
    bounds = np.array([-np.inf, 0.0, 0.0, *(LOWEST_SHARE * starts[0, 3:])])
    return ResponseSurface(starts, increments(starts), bounds, restrict=silent_at_rest)
