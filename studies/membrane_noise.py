"""Models of the noise of a membrane and its input: current, threshold and gain of the end organ.

`studies.noisy_lif` simulates a membrane with them.
"""

from __future__ import annotations

import math
from dataclasses import dataclass

import numpy as np

from fingerpad.core.checks import FloatArray, not_negative, one_of, positive
from fingerpad.core.errors import InputError
from fingerpad.core.random_streams import Presentations, Purpose, draw_each

STEP_MS = 0.1
"""Default step of the noise of the current. [ms]"""


@dataclass(frozen=True)
class WhiteCurrentNoise:
    """White noise of the current.

    The charge over a time T is normal with variance D² T. The noise is constant within each step, with a
    variance for which the free potential at the ends of the steps has exactly the distribution under white
    noise. Excursions of the potential within a step are neglected.

    Parameters
    ----------
    intensity_ma_sqrt_ms : float
        Square root of its spectral density, D. [mA √ms]
    step_ms : float, optional
        Step in time. [ms]

    Raises
    ------
    InputError
        If the intensity is negative or the step is not positive.
    """

    intensity_ma_sqrt_ms: float
    step_ms: float = STEP_MS

    def __post_init__(self) -> None:
        not_negative("intensity_ma_sqrt_ms", self.intensity_ma_sqrt_ms, "mA √ms")
        positive("step_ms", self.step_ms, "ms")

    def level_ma(self, time_constant_ms: float) -> float:
        """Return the standard deviation of the current of one step. [mA]

        With e = exp(-h/tau), a step of constant current s z adds R (1 - e) s z to the potential, and white
        noise adds a normal variable of variance D²/C² (1 - e²) tau/2. They are equal if

            s² = D²/(2 tau) (1 + e)/(1 - e).

        Parameters
        ----------
        time_constant_ms : float
            Time constant tau of the membrane. [ms]

        Returns
        -------
        float
            s; for short steps D/sqrt(h). [mA]

        Examples
        --------
        >>> round(WhiteCurrentNoise(2.0, step_ms=0.01).level_ma(100.0), 6)
        20.0
        """
        ratio = 1.0 / math.tanh(0.5 * self.step_ms / time_constant_ms)  # (1 + e)/(1 - e)
        return self.intensity_ma_sqrt_ms * math.sqrt(0.5 * ratio / time_constant_ms)


@dataclass(frozen=True)
class CorrelatedCurrentNoise:
    """Correlated noise of the current: a stationary Ornstein-Uhlenbeck process.

    Its values at the ends of the steps have exactly the distribution of the process; in between it is linear.

    Parameters
    ----------
    standard_deviation_ma : float
        Standard deviation. [mA]
    correlation_ms : float
        Time in which the autocorrelation decays to 1/e. [ms]
    step_ms : float, optional
        Step in time, no longer than the correlation. [ms]

    Raises
    ------
    InputError
        If a number is out of range.
    """

    standard_deviation_ma: float
    correlation_ms: float
    step_ms: float = STEP_MS

    def __post_init__(self) -> None:
        not_negative("standard_deviation_ma", self.standard_deviation_ma, "mA")
        positive("correlation_ms", self.correlation_ms, "ms")
        positive("step_ms", self.step_ms, "ms")
        if self.step_ms > self.correlation_ms:
            raise InputError(
                f"step_ms must not exceed correlation_ms, {self.correlation_ms}: got {self.step_ms}; take a "
                "shorter step, or WhiteCurrentNoise."
            )

    @property
    def memory(self) -> float:
        """Correlation from one step to the next."""
        return math.exp(-self.step_ms / self.correlation_ms)


@dataclass(frozen=True)
class ThresholdNoise:
    """Noise of the threshold: log-normal, drawn anew for each interval between spikes.

    Parameters
    ----------
    relative_standard_deviation : float
        Standard deviation over the mean, which is the threshold of the membrane. [1]
    """

    relative_standard_deviation: float

    def __post_init__(self) -> None:
        not_negative("relative_standard_deviation", self.relative_standard_deviation)


@dataclass(frozen=True)
class GainNoise:
    """Noise of the gain: a log-normal factor of the stimulus-driven current.

    Parameters
    ----------
    relative_standard_deviation : float
        Standard deviation of the factor, whose mean is 1. [1]
    new_for : {"presentation", "receptor"}, optional
        Whether a factor is drawn for each presentation, or for each receptor and all its presentations.
    """

    relative_standard_deviation: float
    new_for: str = "presentation"

    def __post_init__(self) -> None:
        not_negative("relative_standard_deviation", self.relative_standard_deviation)
        one_of("new_for", self.new_for, ("presentation", "receptor"))

    def factors(self, seed: int, presentations: Presentations) -> FloatArray:
        """Factor of each train.

        Parameters
        ----------
        seed : int
            Seed of the run.
        presentations : Presentations
            Presentations of the trains.

        Returns
        -------
        array (n_trains,)

        Examples
        --------
        >>> twice = Presentations([0, 0], trials=[0, 1], receptors=[4, 4])
        >>> GainNoise(0.2, new_for="receptor").factors(1, twice).round(3).tolist()
        [1.286, 1.286]
        """
        whose = presentations
        if self.new_for == "receptor":
            receptors, which = np.unique(presentations.receptors, return_inverse=True)
            whose = Presentations(receptors, np.zeros_like(receptors), receptors)
        draws = draw_each(seed, whose.trials, whose.receptors, Purpose.GAIN, 1, normal=True)[:, 0]
        spread = log_spread(self.relative_standard_deviation)
        factors = np.exp(spread * draws - 0.5 * spread**2)
        return factors if self.new_for == "presentation" else factors[which]


def log_spread(relative_standard_deviation: float) -> float:
    """Return the standard deviation s of the logarithm of a log-normal variable: s² = ln(1 + sigma²).

    exp(s z - s²/2) with a standard normal z has mean 1 and standard deviation sigma.

    Parameters
    ----------
    relative_standard_deviation : float
        sigma. [1]

    Returns
    -------
    float

    Examples
    --------
    >>> round(log_spread(0.1), 4)
    0.0998
    """
    return math.sqrt(math.log1p(relative_standard_deviation**2))


@dataclass(frozen=True)
class MembraneNoise:
    """Sources of noise of a membrane and its input; None for a source that is absent.

    Parameters
    ----------
    current : WhiteCurrentNoise or CorrelatedCurrentNoise, optional
        Noise of the current.
    threshold : ThresholdNoise, optional
        Noise of the threshold.
    gain : GainNoise, optional
        Noise of the gain.

    Examples
    --------
    >>> MembraneNoise(threshold=ThresholdNoise(0.2)).gain is None
    True
    """

    current: WhiteCurrentNoise | CorrelatedCurrentNoise | None = None
    threshold: ThresholdNoise | None = None
    gain: GainNoise | None = None
