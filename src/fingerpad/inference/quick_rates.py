"""Rates of one afferent for one set of parameters after another, as a fit asks for them.

Little more than the membrane's compiled walk through its current; the bits are those of `Afferent.rates`.
"""

from __future__ import annotations

from collections.abc import Callable

import numpy as np
from numba import njit

from fingerpad.core.checks import FloatArray
from fingerpad.core.units import MS_PER_S
from fingerpad.data import neuron, protocol
from fingerpad.neuron.afferent import PARAMETER_NAMES, Afferent
from fingerpad.neuron.exact_spikes import exact_trains
from fingerpad.neuron.transduction import Drive

Rates = Callable[[FloatArray], tuple[FloatArray, FloatArray]]
"""From six parameters to dynamic and static rates, (n_stimuli,) each. [spikes/s]"""


def rates_under(
    driven: Drive,
    refractory_ms: float = neuron.REFRACTORY.value,
    windows_ms: tuple[tuple[float, ...], tuple[float, ...]] = (
        protocol.DYNAMIC_WINDOW.value,
        protocol.STATIC_WINDOW.value,
    ),
) -> Rates:
    """Return what gives the rates under a drive; its memory is made once, so that a thread needs its own.

    Parameters
    ----------
    driven : Drive
        One column per stimulus.
    refractory_ms : float, optional
        Rest after each spike. [ms]
    windows_ms : ((float, float), (float, float)), optional
        Windows of the dynamic and of the static rate. [ms]

    Returns
    -------
    callable
        From the six parameters of an afferent to its dynamic and static rates. It raises `InputError` for
        what is no set of parameters.

    Examples
    --------
    >>> from fingerpad.core.signals import SedTraces
    >>> from fingerpad.neuron.transduction import drive
    >>> rates = rates_under(drive(SedTraces([0.0, 50.0, 1000.0], [[0.0], [2.0], [2.0]], kinks_ms=[50.0])))
    >>> [rate.round().tolist() for rate in rates(Afferent().parameters)]
    [[217.0], [63.0]]
    """
    current, static_part = np.empty_like(driven.sed_kpa), np.empty_like(driven.sed_kpa)

    def rates(parameters: FloatArray) -> tuple[FloatArray, FloatArray]:
        six = np.asarray(parameters, dtype=np.float64)
        if not (six.shape == (len(PARAMETER_NAMES),) and np.isfinite(six).all() and (six[3:] > 0.0).all()):
            Afferent.from_parameters(six, refractory_ms)  # says what is wrong
        intercept, dynamic_gain, static_gain, tau, capacitance, threshold = six.tolist()
        # I = beta + k_d U' + k_s U, in the order of Transduction.current.
        np.multiply(driven.rate_kpa_per_ms, dynamic_gain, out=current)
        current.__iadd__(intercept)
        current.__iadd__(np.multiply(driven.sed_kpa, static_gain, out=static_part))
        times, offsets = exact_trains(
            driven.times_ms, current, tau, capacitance, threshold, float(refractory_ms)
        )
        dynamic, static = (_firing_rate_hz(times, offsets, start, end) for start, end in windows_ms)
        return dynamic, static

    return rates


@njit(cache=True, error_model="numpy", nogil=True)
def _firing_rate_hz(times: FloatArray, offsets: np.ndarray, start: float, end: float) -> FloatArray:
    """One over the mean of the intervals that close in the window: `neuron.spikes.firing_rate_hz`."""
    rates = np.zeros(offsets.size - 1)
    for train in range(rates.size):
        count = 0
        total = 0.0
        for spike in range(offsets[train] + 1, offsets[train + 1]):
            if start < times[spike] <= end:
                count += 1
                total += times[spike] - times[spike - 1]
        if count > 0:
            rates[train] = MS_PER_S * (count / total)
    return rates
