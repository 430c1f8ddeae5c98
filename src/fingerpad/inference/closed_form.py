"""Rate of the membrane under a constant drive in closed form, with derivatives: a smooth approximation.

In the four identifiable parameters (`fingerpad.inference.identifiable`) the membrane is driven by g = b + k_d
U' + k_s U [1/ms], and its threshold is 1. Under a constant g the potential rises from 0 to the threshold in
tau ln(x / (x - 1)), with the steady potential x = tau g. With the refractory period t_r the rate is

    f = 1 / (t_r + tau ln(x / (x - 1)))    for x > 1, else 0.

Rates counted from spikes jump when a spike enters or leaves a window; f is smooth. At x = 1 its derivative is
infinite, so x - 1 is replaced by s ln(1 + e^((x - 1)/s)) with a width s.
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from numpy.typing import ArrayLike

from fingerpad.core.checked import checked
from fingerpad.core.units import MS_PER_S
from fingerpad.core.values import FloatArray, NotNegative, Positive
from fingerpad.data import neuron
from fingerpad.inference.identifiable import IDENTIFIABLE_NAMES
from fingerpad.inference.rate_model import AfferentModel, Rates, evaluate_rows
from fingerpad.neuron.transduction import Drive

BEND = 0.05  # Width s over which the rate sets in, relative to the threshold. [1]
SAMPLES = 16  # Times in each window at which the rate under a constant drive is computed.


@checked
def constant_drive_rate(
    drive_per_ms: ArrayLike,
    time_constant_ms: Positive,
    refractory_ms: NotNegative = neuron.REFRACTORY.value,
    bend: NotNegative = 0.0,
) -> tuple[FloatArray, FloatArray, FloatArray]:
    """Rate under a constant drive, and its derivatives along the drive and the time constant."""
    tau = time_constant_ms
    g = np.asarray(drive_per_ms, dtype=np.float64)
    above, slope = _bent(tau * g - 1.0, bend)
    fires = above > 0.0
    above = np.where(fires, above, 1.0)
    x = above + 1.0
    log = np.log1p(1.0 / above)
    rate = 1.0 / (refractory_ms + tau * log)
    # dT/dx = -tau / (x (x - 1)), dT/dtau = ln(x / (x - 1)) at given x; x itself moves with g and with tau.
    per_x = rate**2 * tau / (x * above) * slope
    found = rate, per_x * tau, per_x * g - rate**2 * log
    rates = [MS_PER_S * np.where(fires, values, 0.0) for values in found]
    return rates[0], rates[1], rates[2]


def _bent(excess: FloatArray, bend: float) -> tuple[FloatArray, FloatArray]:
    """Return the smoothed x - 1, which is above 0, and its derivative."""
    if bend == 0.0:
        return excess, np.ones_like(excess)
    return bend * np.logaddexp(0.0, excess / bend), np.exp(-np.logaddexp(0.0, -excess / bend))


@dataclass(frozen=True)
class ClosedFormModel:
    """Closed-form rates: the mean over each window of the rate under a constant drive; a `SmoothRateModel`.

    The model neglects the charging from rest and single spikes. It is inaccurate in the ramp, but smooth, and
    its derivatives are cheap.
    """

    stimuli: AfferentModel  # Drives, windows and refractory period.
    bend: float = BEND  # Width over which the rate sets in. [1]

    @property
    def names(self) -> tuple[str, ...]:
        return IDENTIFIABLE_NAMES

    @property
    def n_stimuli(self) -> int:
        return self.stimuli.n_stimuli

    def evaluate(self, parameters: FloatArray) -> Rates:
        dynamic, static = (self._window(parameters, window)[0] for window in self.stimuli.used_windows_ms)
        return dynamic, static

    def evaluate_batch(self, points: FloatArray) -> Rates:
        """Rates (n_points, n_stimuli) for rows of the four parameters, bit-equal to `evaluate`. [spikes/s]"""
        return evaluate_rows(self, points)

    def slopes(self, parameters: FloatArray) -> Rates:
        """Return the derivatives of both rates along the four parameters, (n_stimuli, 4) each."""
        dynamic, static = (self._window(parameters, window)[1] for window in self.stimuli.used_windows_ms)
        return dynamic, static

    def _window(self, parameters: FloatArray, window_ms: tuple[float, ...]) -> tuple[FloatArray, FloatArray]:
        """Mean rate (n_stimuli,) in a window, and its derivatives (n_stimuli, 4)."""
        intercept, dynamic_gain, static_gain, tau = parameters
        mean, slopes = np.empty(self.n_stimuli), np.empty((self.n_stimuli, 4))
        for drive, columns in zip(self.stimuli.drives, self.stimuli.stimuli, strict=True):
            speed, value = _samples(drive, window_ms)
            g = intercept + dynamic_gain * speed + static_gain * value
            rate, per_drive, per_tau = constant_drive_rate(
                g, float(tau), self.stimuli.refractory_ms, self.bend
            )
            mean[columns] = rate.mean(axis=0)
            for number, slope in enumerate((per_drive, per_drive * speed, per_drive * value, per_tau)):
                slopes[columns, number] = slope.mean(axis=0)
        return mean, slopes


def _samples(drive: Drive, window_ms: tuple[float, ...]) -> tuple[FloatArray, FloatArray]:
    """U' and U at the centres of equal parts of a window, (SAMPLES, n_stimuli) each."""
    start, end = window_ms
    times = start + (end - start) * (np.arange(SAMPLES) + 0.5) / SAMPLES
    before = np.searchsorted(drive.times_ms, times, "right") - 1
    before = np.clip(before, 0, drive.times_ms.size - 2)
    knots = drive.times_ms[before], drive.times_ms[before + 1]
    share = ((times - knots[0]) / (knots[1] - knots[0]))[:, np.newaxis]
    speed, value = (
        values[before] + share * (values[before + 1] - values[before])
        for values in (drive.rate_per_ms, drive.values)
    )
    return speed, value
