"""Rate of the membrane under a constant drive in closed form, with its slopes: a smooth stand-in for spikes.

In the four numbers that firing can tell (`fingerpad.inference.identifiable`) the membrane is driven by
g = b + k_d U' + k_s U [1/ms], and its threshold is 1. A constant g brings it from 0 to the threshold in
tau ln(x / (x - 1)), with x = tau g, the potential that the drive would hold. With the rest t_r after each
spike the rate is

    f = 1 / (t_r + tau ln(x / (x - 1)))    for x > 1, else 0.

Spikes enter and leave the windows of the paper one by one; f does not, and its slopes point past such jumps.
At x = 1 its own slope is infinite, so x is bent over a width s: x - 1 is replaced by s ln(1 + e^((x - 1)/s)).
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from numpy.typing import ArrayLike

from fingerpad.core.checks import FloatArray, not_negative, positive
from fingerpad.core.units import MS_PER_S
from fingerpad.data import neuron, protocol
from fingerpad.inference.identifiable import IDENTIFIABLE_NAMES
from fingerpad.neuron.transduction import Drive

BEND = 0.05
"""Width over which the rate sets in, in units of the drive that just elicits spikes. [1]"""

SAMPLES = 16
"""Moments in each window at which the drive is taken for constant."""


def constant_drive_rate(
    drive_per_ms: ArrayLike,
    time_constant_ms: float,
    refractory_ms: float = neuron.REFRACTORY.value,
    bend: float = 0.0,
) -> tuple[FloatArray, FloatArray, FloatArray]:
    """Rate under a constant drive, and its slopes along the drive and the time constant.

    Parameters
    ----------
    drive_per_ms : array_like
        g, the current over C v. [1/ms]
    time_constant_ms : float
        tau. [ms]
    refractory_ms : float, optional
        Rest after each spike, t_r. [ms]
    bend : float, optional
        Width s over which the rate sets in; 0 for the exact rate. [1]

    Returns
    -------
    rate_hz : array
        f. [spikes/s]
    per_drive, per_time_constant : array
        df/dg [spikes/s ms] and df/dtau [spikes/s / ms]; 0 where f is 0.

    Raises
    ------
    InputError
        If the time constant is not positive, or rest or width are negative.

    Examples
    --------
    2 µA over 1e-6 mF and 50 mV, as in `fingerpad.neuron.lif`: an interval takes 31.165 ms and the rest 1 ms.

    >>> rate_hz, _, _ = constant_drive_rate([0.04, 0.01], time_constant_ms=68.0)
    >>> rate_hz.round(3).tolist(), round(1000.0 / 32.165, 3)
    ([31.09, 0.0], 31.09)
    """
    tau = positive("time_constant_ms", time_constant_ms, "ms")
    rest = not_negative("refractory_ms", refractory_ms, "ms")
    g = np.asarray(drive_per_ms, dtype=np.float64)
    above, slope = _bent(tau * g - 1.0, not_negative("bend", bend))
    fires = above > 0.0
    above = np.where(fires, above, 1.0)
    x = above + 1.0
    log = np.log1p(1.0 / above)
    rate = 1.0 / (rest + tau * log)
    # dT/dx = -tau / (x (x - 1)), dT/dtau = ln(x / (x - 1)) at given x; x itself moves with g and with tau.
    per_x = rate**2 * tau / (x * above) * slope
    found = rate, per_x * tau, per_x * g - rate**2 * log
    rates = [MS_PER_S * np.where(fires, values, 0.0) for values in found]
    return rates[0], rates[1], rates[2]


def _bent(excess: FloatArray, bend: float) -> tuple[FloatArray, FloatArray]:
    """Return x - 1 bent to stay above 0, and its slope."""
    if bend == 0.0:
        return excess, np.ones_like(excess)
    return bend * np.logaddexp(0.0, excess / bend), np.exp(-np.logaddexp(0.0, -excess / bend))


@dataclass(frozen=True)
class ClosedFormModel:
    """Rates by formula: in each window the mean of the rates that its drive would give if it were constant.

    It knows neither the potential's way from rest nor single spikes. As a model it is rough for the ramp; as
    a source of slopes it is cheap and smooth.

    Parameters
    ----------
    drive : Drive
        Strain energy density and its rate of change, one column per stimulus.
    refractory_ms : float
        Rest after each spike. [ms]
    bend : float
        Width over which the rate sets in. [1]
    windows_ms : pair of (float, float)
        The dynamic and the static window. [ms]

    Examples
    --------
    >>> from fingerpad.core.signals import SedTraces
    >>> from fingerpad.neuron.transduction import drive
    >>> sed = SedTraces([0.0, 50.0, 1000.0], [[0.0], [2.0], [2.0]], kinks_ms=[50.0])
    >>> model = ClosedFormModel(drive(sed))
    >>> dynamic_hz, static_hz = model.rates(np.array([0.01, 4.0, 0.014, 68.0]))
    >>> dynamic_hz.round().tolist(), static_hz.round().tolist()
    ([156.0], [29.0])
    >>> [slopes.shape for slopes in model.slopes(np.array([0.01, 4.0, 0.014, 68.0]))]
    [(1, 4), (1, 4)]
    """

    drive: Drive
    refractory_ms: float = neuron.REFRACTORY.value
    bend: float = BEND
    windows_ms: tuple[tuple[float, ...], tuple[float, ...]] = (
        protocol.DYNAMIC_WINDOW.value,
        protocol.STATIC_WINDOW.value,
    )

    @property
    def names(self) -> tuple[str, ...]:
        """The four numbers that firing can tell."""
        return IDENTIFIABLE_NAMES

    @property
    def n_stimuli(self) -> int:
        """Number of columns of the drive."""
        return self.drive.n_sites

    def rates(self, parameters: FloatArray) -> tuple[FloatArray, FloatArray]:
        """Dynamic and static rates. [spikes/s]"""
        (dynamic, _), (static, _) = (self._window(parameters, window) for window in self.windows_ms)
        return dynamic, static

    def slopes(self, parameters: FloatArray) -> tuple[FloatArray, FloatArray]:
        """Slopes of both rates along the four numbers, (n_stimuli, 4) each."""
        (_, dynamic), (_, static) = (self._window(parameters, window) for window in self.windows_ms)
        return dynamic, static

    def _window(self, parameters: FloatArray, window_ms: tuple[float, ...]) -> tuple[FloatArray, FloatArray]:
        """Mean rate in a window and its slopes."""
        intercept, dynamic_gain, static_gain, tau = parameters
        speed, sed = _samples(self.drive, window_ms)
        g = intercept + dynamic_gain * speed + static_gain * sed
        rate, per_drive, per_tau = constant_drive_rate(g, float(tau), self.refractory_ms, self.bend)
        slopes = (per_drive, per_drive * speed, per_drive * sed, per_tau)
        return rate.mean(axis=0), np.column_stack([slope.mean(axis=0) for slope in slopes])


def _samples(drive: Drive, window_ms: tuple[float, ...]) -> tuple[FloatArray, FloatArray]:
    """U' and U at the middles of equal parts of a window, (SAMPLES, n_stimuli) each."""
    start, end = window_ms
    times = start + (end - start) * (np.arange(SAMPLES) + 0.5) / SAMPLES
    before = np.searchsorted(drive.times_ms, times, "right") - 1
    before = np.clip(before, 0, drive.times_ms.size - 2)
    knots = drive.times_ms[before], drive.times_ms[before + 1]
    share = ((times - knots[0]) / (knots[1] - knots[0]))[:, np.newaxis]
    speed, sed = (
        values[before] + share * (values[before + 1] - values[before])
        for values in (drive.rate_kpa_per_ms, drive.sed_kpa)
    )
    return speed, sed
