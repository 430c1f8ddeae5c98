"""Membrane current -> spike times of a noisy leaky integrate-and-fire neuron.

Three sources of noise, alone or together, each named by what it disturbs:

- the current through the membrane, white or with a memory (Ornstein-Uhlenbeck process),
- the threshold, anew for each interval between spikes,
- the gain of the end organ, anew for each presentation or for each receptor.

Noise of the current is drawn at steps of time whose law is exact, and is a straight line within a step. The
current as a whole is then piecewise linear, and spikes are found to round-off as without noise
(`fingerpad.exact_spikes`). The membrane itself is that of `fingerpad.lif`, to which all of this returns as
noise vanishes. All random numbers have keys: docs/decisions/random-numbers.md.
"""

from __future__ import annotations

import math
from dataclasses import dataclass

import numpy as np
from numba import njit

from fingerpad.blocks import in_blocks
from fingerpad.checks import FloatArray, finite, instance, not_negative, one_of, positive
from fingerpad.errors import InputError
from fingerpad.exact_spikes import first_crossing
from fingerpad.lif import LeakyIntegrateAndFire
from fingerpad.random_streams import Presentations, Purpose, four_normals, normals_of
from fingerpad.signals import CurrentTraces, SpikeTrains

STEP_MS = 0.1
"""Default step of the noise of the current. [ms]"""

TRAINS_PER_BLOCK = 32
"""Trains that one thread makes at a time: each takes about a millisecond."""

_CURRENT, _THRESHOLD = int(Purpose.CURRENT), int(Purpose.THRESHOLD)


@dataclass(frozen=True)
class WhiteCurrentNoise:
    """Noise of the current without memory.

    Over a time T the charge that it brings is normal with variance D² T. It is constant within each step,
    so large that the free potential at the ends of steps has exactly the law that white noise gives it;
    what is left out are excursions within a step.

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

        With e = exp(-h/tau) a step of constant current s z adds R (1 - e) s z to the potential, and white
        noise adds a normal number of variance D²/C² (1 - e²) tau/2. Both agree if

            s² = D²/(2 tau) (1 + e)/(1 - e).

        Parameters
        ----------
        time_constant_ms : float
            Of the membrane, tau. [ms]

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
    """Noise of the current with a memory: an Ornstein-Uhlenbeck process in its steady state.

    Its values at the ends of steps have exactly the law of the process, and a straight line joins them.

    Parameters
    ----------
    standard_deviation_ma : float
        At any one time. [mA]
    correlation_ms : float
        Time in which its correlation falls to 1/e. [ms]
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
    """A new threshold for each interval between spikes: log-normal, so that none is negative.

    Parameters
    ----------
    relative_standard_deviation : float
        Over the mean, which is the threshold of the membrane. [1]
    """

    relative_standard_deviation: float

    def __post_init__(self) -> None:
        not_negative("relative_standard_deviation", self.relative_standard_deviation)


@dataclass(frozen=True)
class GainNoise:
    """How strongly an end organ answers differs: a log-normal factor on the current that touch causes.

    Parameters
    ----------
    relative_standard_deviation : float
        Of the factor, whose mean is 1. [1]
    new_for : {"presentation", "receptor"}, optional
        Whether each presentation has a factor of its own, or each receptor one for all its presentations.
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
            Of the run.
        presentations : Presentations
            Whose random numbers to draw.

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
        draws = normals_of(seed, whose, Purpose.GAIN, 1)[:, 0]
        spread = log_spread(self.relative_standard_deviation)
        factors = np.exp(spread * draws - 0.5 * spread**2)
        return factors if self.new_for == "presentation" else factors[which]


def log_spread(relative_standard_deviation: float) -> float:
    """Return the standard deviation s of the logarithm of a log-normal number: s² = ln(1 + sigma²).

    exp(s z - s²/2) with a standard normal z then has mean 1 and standard deviation sigma.

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
    """All that is noisy about a membrane and its input; what is None is not.

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


def noisy_spikes(
    membrane: LeakyIntegrateAndFire,
    current: CurrentTraces,
    noise: MembraneNoise,
    seed: int,
    presentations: Presentations | None = None,
    intercept_ma: float = 0.0,
) -> SpikeTrains:
    """Spike times of a noisy membrane.

    Parameters
    ----------
    membrane : LeakyIntegrateAndFire
        What it is without noise.
    current : CurrentTraces
        Current without noise, one column per site. [mA]
    noise : MembraneNoise
        What is noisy.
    seed : int
        Of the run; the same seed gives the same spikes on any number of threads.
    presentations : Presentations, optional
        Site, trial and receptor of each train. Default: each site is a receptor, touched once.
    intercept_ma : float, optional
        The part of the current that flows without touch, beta; noise of the gain leaves it alone. [mA]

    Returns
    -------
    SpikeTrains
        One per presentation.

    Raises
    ------
    InputError
        If a presentation names a site that is not there.

    Examples
    --------
    >>> neuron = LeakyIntegrateAndFire(68.0, 1e-6, 50.0, 1.0)
    >>> steady = CurrentTraces([0.0, 100.0], [[2e-6], [2e-6]])
    >>> noise = MembraneNoise(threshold=ThresholdNoise(0.1))
    >>> noisy_spikes(neuron, steady, noise, seed=1)[0].round(1).tolist()
    [29.0, 63.7, 96.7]
    """
    instance("noise", noise, MembraneNoise)
    everyone = presentations or Presentations.of_population(current.n_sites)
    if everyone.sites.max(initial=0) >= current.n_sites:
        raise InputError(
            f"presentations must name sites within 0 ... {current.n_sites - 1}: got {everyone.sites.max()}."
        )
    resting = finite("intercept_ma", intercept_ma, "mA")
    gains = noise.gain.factors(seed, everyone) if noise.gain else np.ones(len(everyone))
    # A train runs through its own row: neighbours in time must be neighbours in memory.
    rows = np.ascontiguousarray(current.current_ma.T)
    numbers = (
        float(membrane.time_constant_ms),
        float(membrane.capacitance_mf),
        float(membrane.threshold_mv),
        float(membrane.refractory_ms),
    )
    disturbed = _current_numbers(noise.current, membrane.time_constant_ms)
    spread = log_spread(noise.threshold.relative_standard_deviation) if noise.threshold else 0.0

    def trains(some: slice) -> SpikeTrains:
        part = everyone.part(some)
        keys = part.sites, part.trials, part.receptors
        return SpikeTrains(
            *_noisy_trains(
                current.times_ms, rows, *keys, gains[some], resting, seed, *numbers, *disturbed, spread
            )
        )

    return SpikeTrains.joined(in_blocks(trains, len(everyone), TRAINS_PER_BLOCK))


def _current_numbers(
    noise: WhiteCurrentNoise | CorrelatedCurrentNoise | None, time_constant_ms: float
) -> tuple[float, float, float]:
    """Step (0: no noise), standard deviation of a level, and correlation of one with the next."""
    if noise is None:
        return 0.0, 0.0, 0.0
    if isinstance(noise, WhiteCurrentNoise):
        return float(noise.step_ms), noise.level_ma(time_constant_ms), 0.0
    return float(noise.step_ms), float(noise.standard_deviation_ma), noise.memory


@njit(cache=True, error_model="numpy", nogil=True)
def _noisy_trains(
    times: FloatArray,
    currents: FloatArray,
    sites: np.ndarray,
    trials: np.ndarray,
    receptors: np.ndarray,
    gains: FloatArray,
    resting: float,
    seed: int,
    tau: float,
    capacitance: float,
    threshold: float,
    refractory: float,
    step: float,
    deviation: float,
    memory: float,
    spread: float,
) -> tuple[FloatArray, np.ndarray]:
    """Spike times of all trains, one after the other, and where each one's begin.

    A stretch reaches from one event to the next: a knot of the current, the end of a step of its noise, or
    a spike. `memory` > 0 joins the levels of noise by straight lines; without memory each lasts for a step.
    """
    resistance = tau / capacitance
    fresh = math.sqrt(1.0 - memory * memory)  # share of a new level that the one before does not explain
    found = np.empty(64 * (sites.size + 1))
    offsets = np.zeros(sites.size + 1, dtype=np.int64)
    count = 0
    for train in range(sites.size):
        current = resting + gains[train] * (currents[sites[train]] - resting)
        trial, receptor = trials[train], receptors[train]
        knot, n_steps, n_intervals = 0, 0, 0
        time = ready = step_start = times[0]
        step_end = times[0] + step if step > 0.0 else math.inf
        four = four_normals(seed, trial, receptor, _CURRENT, 1)
        level = following = deviation * four[0]
        if memory > 0.0:
            following = memory * level + fresh * deviation * four[1]
        limits = four_normals(seed, trial, receptor, _THRESHOLD, 1)
        limit = threshold * math.exp(spread * limits[0] - 0.5 * spread * spread)
        potential = 0.0
        while True:
            while knot < times.size - 1 and times[knot + 1] <= time:
                knot += 1
            if knot == times.size - 1:
                break
            end = min(times[knot + 1], step_end)
            begin = max(time, ready)
            crosses = False
            if begin < end:
                slope = (current[knot + 1] - current[knot]) / (times[knot + 1] - times[knot])
                noise_slope = (following - level) / step if step > 0.0 else 0.0
                at_begin = current[knot] + slope * (begin - times[knot])
                at_begin += level + noise_slope * (begin - step_start)
                at_end = at_begin + (slope + noise_slope) * (end - begin)
                length = (end - begin) / tau
                crosses, x, potential = first_crossing(
                    length, potential, resistance * at_begin, resistance * at_end, limit
                )
                if crosses:
                    if count == found.size:
                        found = np.concatenate((found, np.empty(found.size)))
                    time = found[count] = min(begin + tau * x, end)
                    ready = time + refractory
                    count += 1
                    potential = 0.0
                    n_intervals += 1
                    if n_intervals % 4 == 0:
                        limits = four_normals(seed, trial, receptor, _THRESHOLD, n_intervals // 4 + 1)
                    limit = threshold * math.exp(spread * limits[n_intervals % 4] - 0.5 * spread * spread)
            if not crosses:
                time = end
            if time == step_end:
                n_steps += 1
                step_start, step_end = step_end, times[0] + (n_steps + 1) * step
                newest = n_steps + 1 if memory > 0.0 else n_steps
                if newest % 4 == 0:
                    four = four_normals(seed, trial, receptor, _CURRENT, newest // 4 + 1)
                new = memory * following + fresh * deviation * four[newest % 4]
                level, following = (following, new) if memory > 0.0 else (new, new)
        offsets[train + 1] = count
    return found[:count], offsets
