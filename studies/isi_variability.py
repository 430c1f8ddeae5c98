"""Variability of interspike intervals by source of noise, and the amount that matches observed intervals.

The afferent is held: its current is the one at the end of the bar's hold, under the position that makes it
fire fastest, and stays for 10 s. Noise also changes how fast it fires; the current is therefore rescaled
until it fires as fast as without noise, so that irregular and fast are not confused.
"""

from __future__ import annotations

import math
from collections.abc import Callable
from dataclasses import dataclass

import numpy as np

from fingerpad.core.checks import FloatArray
from fingerpad.core.random_streams import Presentations
from fingerpad.core.results import Number, Vector, result_class
from fingerpad.core.signals import CurrentTraces, SpikeTrains
from fingerpad.core.threads import in_blocks
from fingerpad.core.units import MS_PER_S
from fingerpad.data import neuron
from fingerpad.neuron.afferent import Afferent
from fingerpad.neuron.escape_rate import EscapeRate
from fingerpad.neuron.lif import LeakyIntegrateAndFire
from fingerpad.neuron.transduction import Drive
from studies.interval_statistics import interval_statistics
from studies.membrane_noise import (
    CorrelatedCurrentNoise,
    GainNoise,
    MembraneNoise,
    ThresholdNoise,
    WhiteCurrentNoise,
)
from studies.noisy_lif import noisy_spikes

DURATION_MS = 10_000.0
SETTLED_MS = 500.0
N_TRAINS = 4
STEP_MS = 0.5
"""Step of the noise of the current, short against the correlation and the intervals. [ms]"""

CORRELATION_MS = 10.0
"""Correlation of the coloured noise, and the time over which the white one is averaged to be stated. [ms]"""

AMOUNTS = (0.1, 0.2, 0.4, 0.65, 0.9, 1.3)
WIDTHS = (0.05, 0.1, 0.2, 0.25, 0.3, 0.35)
THRESHOLD_AMOUNTS = (0.1, 0.2, 0.3, 0.4, 0.5)
"""Beyond, some thresholds are out of reach of the current, and an interval never ends."""

GAIN_AMOUNTS = (0.1, 0.3)

CURVES = ("amount", "current_factor", "coefficient_of_variation", "local_variation")
"""What a `NoiseCurve` holds by amount."""

_MOST_TRIALS = 9
_LARGEST_STEP, _LEAST_ELASTICITY, _SLOWEST_HZ = 0.7, 0.05, 0.1
_KEPT = 0.005
"""A rate counts as kept within this share of it."""


@dataclass(frozen=True)
class NoiseSource:
    """One source of noise: what it is, what its amount means, and spikes under so much of it.

    Parameters
    ----------
    name : str
        In words.
    amount_is : str
        What the amount means; all amounts are pure numbers.
    amounts : tuple of float
        To be tried, increasing.
    spikes : callable
        `spikes(membrane, current_ma, factor, amount, seed)`: trains of the membrane held at `factor` times
        the current, with noise of so much relative to the current itself.
    """

    name: str
    amount_is: str
    amounts: tuple[float, ...]
    spikes: Callable[[LeakyIntegrateAndFire, float, float, float, int], SpikeTrains]


def _with(noise: Callable[[float, float], MembraneNoise]) -> Callable[..., SpikeTrains]:
    """Spikes under noise that is made from its amount and the current."""

    def spikes(
        membrane: LeakyIntegrateAndFire, current_ma: float, factor: float, amount: float, seed: int
    ) -> SpikeTrains:
        return noisy_spikes(
            membrane, _held(factor * current_ma), noise(amount, current_ma), seed, _PRESENTATIONS
        )

    return spikes


def _soft(
    membrane: LeakyIntegrateAndFire, current_ma: float, factor: float, amount: float, seed: int
) -> SpikeTrains:
    return EscapeRate(membrane, amount).spikes(_held(factor * current_ma), seed, _PRESENTATIONS)


def _held(current_ma: float) -> CurrentTraces:
    return CurrentTraces(np.array([0.0, DURATION_MS]), np.full((2, 1), current_ma))


_PRESENTATIONS = Presentations.of_one_afferent(n_stimuli=1, n_repeats=N_TRAINS)
SOFT_THRESHOLD = NoiseSource("soft threshold", "width over threshold", WIDTHS, _soft)
SOURCES = (
    NoiseSource(
        "white noise of the current",
        f"standard deviation of its mean over {CORRELATION_MS:g} ms, over the current",
        AMOUNTS,
        _with(
            lambda amount, current: MembraneNoise(
                current=WhiteCurrentNoise(amount * current * CORRELATION_MS**0.5, STEP_MS)
            )
        ),
    ),
    NoiseSource(
        f"noise of the current, correlated over {CORRELATION_MS:g} ms",
        "standard deviation over the current",
        AMOUNTS,
        _with(
            lambda amount, current: MembraneNoise(
                current=CorrelatedCurrentNoise(amount * current, CORRELATION_MS, STEP_MS)
            )
        ),
    ),
    NoiseSource(
        "threshold, new for each interval",
        "standard deviation over the mean",
        THRESHOLD_AMOUNTS,
        _with(lambda amount, _: MembraneNoise(threshold=ThresholdNoise(amount))),
    ),
    SOFT_THRESHOLD,
    NoiseSource(
        "gain, new for each presentation",
        "standard deviation over the mean",
        GAIN_AMOUNTS,
        _with(lambda amount, _: MembraneNoise(gain=GainNoise(amount))),
    ),
)


@dataclass(frozen=True)
class HeldNoise:
    """A held afferent under so much noise, at the rate it has without.

    Parameters
    ----------
    amount : float
        Of the noise. [1]
    current_factor : float
        On the current, to keep the rate. [1]
    rate_kept : bool
        Whether some factor keeps it.
    coefficient_of_variation, local_variation : float
        Of the intervals, mean of the trains weighted with their intervals. [1]
    """

    amount: float
    current_factor: float
    rate_kept: bool
    coefficient_of_variation: float
    local_variation: float


def held_at_its_rate(
    source: NoiseSource, membrane: LeakyIntegrateAndFire, current_ma: float, amount: float, seed: int
) -> HeldNoise:
    """Rescale the current of a held, noisy membrane until it fires as fast as without noise.

    Parameters
    ----------
    source : NoiseSource
        Which noise.
    membrane : LeakyIntegrateAndFire
        What it is without noise.
    current_ma : float
        What holds it. [mA]
    amount : float
        How much noise.
    seed : int
        The same random numbers serve every factor, so that the rate rises with it.

    Returns
    -------
    HeldNoise
    """
    wanted_hz = _rate_hz(membrane.spikes(_held(current_ma)))
    # Secants between the logarithms of factor and rate; at first the two are taken to be proportional.
    log_factor, elasticity, before = 0.0, 1.0, None
    for _ in range(_MOST_TRIALS):
        factor = math.exp(log_factor)
        trains = source.spikes(membrane, current_ma, factor, amount, seed)
        excess = math.log(max(_rate_hz(trains), _SLOWEST_HZ) / wanted_hz)
        if abs(excess) <= _KEPT:
            break
        if before is not None and log_factor != before[0]:
            elasticity = max((excess - before[1]) / (log_factor - before[0]), _LEAST_ELASTICITY)
        before = log_factor, excess
        log_factor -= min(max(excess / elasticity, -_LARGEST_STEP), _LARGEST_STEP)
    found = interval_statistics(trains, (SETTLED_MS, DURATION_MS))
    return HeldNoise(
        amount=amount,
        current_factor=factor,
        rate_kept=abs(excess) <= _KEPT,
        coefficient_of_variation=_weighted(found.coefficient_of_variation, found.count),
        local_variation=_weighted(found.local_variation, found.count),
    )


def largest_held_current_ma(driven: Drive, afferent: Afferent) -> float:
    """Return the largest current at the end of the hold, over all stimuli. [mA]

    Parameters
    ----------
    driven : Drive
        One column per stimulus.
    afferent : Afferent
        Whose current.

    Returns
    -------
    float
    """
    return float(afferent.transduction.current(driven).current_ma[-1].max())


@result_class
class NoiseAtObserved:
    """Amount of noise at which intervals are as irregular as observed; fields as of `NoiseCurve`. [1]"""

    amount: Number
    current_factor: Number
    coefficient_of_variation: Number
    local_variation: Number


@result_class
class NoiseCurve:
    """Irregularity of the intervals against the amount of noise from one source.

    Parameters
    ----------
    name, amount_is : str
        Of the `NoiseSource`.
    amount : array (n_amounts,)
        Those at which the rate could be kept. [1]
    current_factor : array (n_amounts,)
        On the current, to keep the rate. [1]
    coefficient_of_variation, local_variation : array (n_amounts,)
        Of the intervals. [1]
    at_observed : NoiseAtObserved or None
        Interpolated; None where no amount is as irregular as observed.
    """

    name: str
    amount_is: str
    amount: Vector
    current_factor: Vector
    coefficient_of_variation: Vector
    local_variation: Vector
    at_observed: NoiseAtObserved | None


@result_class
class IsiVariability:
    """Variability of the interspike intervals of a held afferent.

    Parameters
    ----------
    observed, observed_spread : float
        Coefficient of variation observed in mice: mean and standard deviation. [1]
    rate_hz : float
        Of the held afferent. [spikes/s]
    sources : tuple of NoiseCurve
        Empty for an afferent that is silent.
    """

    observed: float
    observed_spread: float
    rate_hz: float
    sources: tuple[NoiseCurve, ...]


def result(driven: Drive, afferent: Afferent, seed: int) -> IsiVariability:
    """Irregularity against noise, source by source.

    Parameters
    ----------
    driven : Drive
        Strain energy density under each position of the bar.
    afferent : Afferent
        Fitted to the recordings.
    seed : int
        Of the run.

    Returns
    -------
    IsiVariability
    """
    membrane, current_ma = afferent.membrane, largest_held_current_ma(driven, afferent)
    rate_hz = _rate_hz(membrane.spikes(_held(current_ma)))
    return IsiVariability(
        observed=neuron.INTERVAL_VARIATION.value,
        observed_spread=neuron.INTERVAL_VARIATION_SPREAD.value,
        rate_hz=rate_hz,
        sources=_curves(membrane, current_ma, seed) if rate_hz else (),
    )


def _curves(membrane: LeakyIntegrateAndFire, current_ma: float, seed: int) -> tuple[NoiseCurve, ...]:
    """One curve per source; every amount of every source is a run of its own, which threads share."""
    runs = [(source, amount) for source in SOURCES for amount in source.amounts]

    def held(some: slice) -> HeldNoise:
        source, amount = runs[some.start]
        return held_at_its_rate(source, membrane, current_ma, amount, seed)

    tried = iter(in_blocks(held, len(runs), block=1))
    return tuple(_curve(source, [next(tried) for _ in source.amounts]) for source in SOURCES)


def _curve(source: NoiseSource, tried: list[HeldNoise]) -> NoiseCurve:
    kept = [held for held in tried if held.rate_kept]
    curves = {name: np.array([getattr(held, name) for held in kept]) for name in CURVES}
    return NoiseCurve(
        name=source.name,
        amount_is=source.amount_is,
        **curves,
        at_observed=_at(neuron.INTERVAL_VARIATION.value, curves),
    )


def _at(wanted: float, curves: dict[str, FloatArray]) -> NoiseAtObserved | None:
    """Interpolate at the first place where the coefficient of variation passes the wanted one."""
    variation = curves["coefficient_of_variation"]
    for after in range(1, len(variation)):
        low, high = variation[after - 1 : after + 1]
        if low < wanted <= high:
            share = (wanted - low) / (high - low)
            return NoiseAtObserved(
                **{
                    name: values[after - 1] + share * (values[after] - values[after - 1])
                    for name, values in curves.items()
                }
            )
    return None


def _rate_hz(trains: SpikeTrains) -> float:
    """Spikes per time, silence included."""
    settled = np.count_nonzero(trains.times_ms > SETTLED_MS)
    return float(MS_PER_S * settled / (len(trains) * (DURATION_MS - SETTLED_MS)))


def _weighted(values: FloatArray, counts: np.ndarray) -> float:
    known = np.isfinite(values)
    return float(np.average(values[known], weights=counts[known])) if known.any() else float("nan")
