"""Compiled kernels of `fingerpad.inference.spike_likelihood`.

The trains are divided once into intervals between knots of the drive and spikes. The likelihood of a set of
parameters is computed in one pass over the intervals.
"""

from __future__ import annotations

import math

import numpy as np
from numba import njit

from fingerpad.core.checks import FloatArray
from fingerpad.neuron.escape_rate import panels

_NODES = tuple(0.5 + 0.5 * np.polynomial.legendre.leggauss(5)[0])
_WEIGHTS = tuple(0.5 * np.polynomial.legendre.leggauss(5)[1])


@njit(cache=True, error_model="numpy", nogil=True)
def cut(
    times: FloatArray,
    rates: FloatArray,
    seds: FloatArray,
    sites: np.ndarray,
    ends: FloatArray,
    spikes: FloatArray,
    offsets: np.ndarray,
    refractory: float,
) -> tuple[FloatArray, np.ndarray, np.ndarray]:
    """Divide trains into intervals without knots or spikes inside, without refractory periods."""
    most = sites.size * (times.size + 1) + 2 * spikes.size
    values = np.empty((most, 5))
    flags = np.zeros((most, 2), dtype=np.bool_)
    firsts = np.zeros(sites.size + 1, dtype=np.int64)
    count = 0
    for train in range(sites.size):
        site, spike, time = sites[train], offsets[train], times[0]
        values[count] = 0.0, rates[0, site], rates[0, site], seds[0, site], seds[0, site]
        flags[count, 0] = True
        fresh = False
        count += 1
        for knot in range(times.size - 1):
            first, last = times[knot], min(times[knot + 1], ends[train])
            while time < last:
                fires = spike < offsets[train + 1] and spikes[spike] <= last
                until = spikes[spike] if fires else last
                if time < until:
                    values[count, 0] = until - time
                    for end in range(2):
                        share = ((until if end else time) - first) / (times[knot + 1] - first)
                        values[count, 1 + end] = rates[knot, site] + share * (
                            rates[knot + 1, site] - rates[knot, site]
                        )
                        values[count, 3 + end] = seds[knot, site] + share * (
                            seds[knot + 1, site] - seds[knot, site]
                        )
                    flags[count, 0], flags[count, 1] = fresh, fires
                    fresh = False
                    count += 1
                time = until
                if fires:
                    time = until + refractory
                    spike += 1
                    fresh = True
        firsts[train + 1] = count
    return values[:count].copy(), flags[:count].copy(), firsts


@njit(cache=True, error_model="numpy", nogil=True)
def accumulate(
    intervals: FloatArray,
    flags: np.ndarray,
    numbers: FloatArray,
    escape: float,
    gradient: FloatArray,
    information: FloatArray,
) -> float:
    """Return log L without the constant ln tau_e of each spike; add to its gradient and information.

    z is the derivative of the potential with respect to ln tau. In x = s/tau it follows dz/dx = u - z, so
    that from z0, and u = p + q x + r e^-x,

        z = z0 e^-x + p g + q (x - g) + r x e^-x,    g = 1 - e^-x.
    """
    a, b, c, sharpness = numbers[0], numbers[1], numbers[2], numbers[3]
    tau = math.exp(numbers[4])
    value = 0.0
    x1 = x2 = x3 = z = 0.0
    slopes = np.empty(5)
    slopes[3] = -1.0
    for n in range(intervals.shape[0]):
        if flags[n, 0]:
            x1 = x2 = x3 = z = 0.0
        length = intervals[n, 0] / tau
        if length == 0.0:  # at rest, as `initial_potentials` of the exact spikes
            rest = a * tau + b * tau * intervals[n, 1] + c * tau * intervals[n, 3]
            if rest < sharpness:
                x1, x2, x3, z = tau, tau * intervals[n, 1], tau * intervals[n, 3], rest
            continue
        w2, w3 = tau * intervals[n, 1], tau * intervals[n, 3]
        drift2 = (tau * intervals[n, 2] - w2) / length
        drift3 = (tau * intervals[n, 4] - w3) / length
        u = a * x1 + b * x2 + c * x3
        q = b * drift2 + c * drift3
        p = a * tau + b * w2 + c * w3 - q
        r = u - p
        n_panels = panels(length, u, p + q, q, 1.0)
        scale = length / n_panels * tau / escape
        for panel in range(n_panels):
            for node in range(5):
                x = length * (panel + _NODES[node]) / n_panels
                gone = -math.expm1(-x)
                lag = x - gone
                slopes[0] = x1 + (tau - x1) * gone
                slopes[1] = x2 + (w2 - x2) * gone + drift2 * lag
                slopes[2] = x3 + (w3 - x3) * gone + drift3 * lag
                slopes[4] = z + (p - z) * gone + q * lag + r * x * (1.0 - gone)
                log_hazard = a * slopes[0] + b * slopes[1] + c * slopes[2] - sharpness
                expected = scale * _WEIGHTS[node] * math.exp(log_hazard)
                value -= expected
                for i in range(5):
                    weighted = expected * slopes[i]
                    gradient[i] -= weighted
                    for j in range(i, 5):
                        information[i, j] += weighted * slopes[j]
            if value == -math.inf:  # impossible parameters, for which further panels are costly
                return value
        gone = -math.expm1(-length)
        lag = length - gone
        z = z + (p - z) * gone + q * lag + r * length * (1.0 - gone)
        x1 = x1 + (tau - x1) * gone
        x2 = x2 + (w2 - x2) * gone + drift2 * lag
        x3 = x3 + (w3 - x3) * gone + drift3 * lag
        if flags[n, 1]:
            value += a * x1 + b * x2 + c * x3 - sharpness
            slopes[0], slopes[1], slopes[2], slopes[4] = x1, x2, x3, z
            gradient += slopes
    return value


@njit(cache=True, error_model="numpy", nogil=True)
def operational_times(
    intervals: FloatArray, flags: np.ndarray, numbers: FloatArray, escape: float
) -> FloatArray:
    """Integral of the hazard up to the end of each interval with a spike."""
    found = np.empty(flags[:, 1].sum())
    gradient, information = np.zeros(5), np.zeros((5, 5))
    count, first = 0, 0
    for n in range(intervals.shape[0]):
        if flags[n, 1]:
            accumulate(intervals[first : n + 1], flags[first : n + 1], numbers, escape, gradient, information)
            first = n + 1
            count += 1
            # d log L/dG is the integral minus one for each spike.
            found[count - 1] = gradient[3] + count
    return found
