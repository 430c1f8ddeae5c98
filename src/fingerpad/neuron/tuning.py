"""Tuning curve of an afferent: the amplitude of a vibration at which it fires once per cycle.

A small vibration on a hold changes the quantities at an end organ in proportion to its amplitude. Skin hardly
relaxes within a cycle of 1 Hz or more, so that one press with one small step gives this proportion for all
frequencies.
"""

from __future__ import annotations

from dataclasses import replace

import numpy as np
from numpy.typing import ArrayLike

from fingerpad.core.checked import checked
from fingerpad.core.signals import Traces
from fingerpad.core.units import MS_PER_S
from fingerpad.core.values import Finite, FloatArray, NotNegative, Positive, float_array
from fingerpad.neuron.afferent import AnyAfferent, checked_afferent

SAMPLES_PER_CYCLE = 40
CYCLES, COUNTED_CYCLES = 30, 20
"""Cycles of the vibration, and those at its end in which impulses are counted."""

SETTLING_MS = 1000.0  # Hold before the vibration. [ms]

_RANGE_UM = (1e-2, 1e4)
_AMPLITUDES, _ROUNDS = 41, 3


@checked
def vibration(
    frequency_hz: Positive, amplitudes_um: ArrayLike, per_um: Finite, hold: NotNegative, quantity: str
) -> Traces:
    """Traces of one quantity under a vibration on a hold, a column per amplitude; none falls below 0."""
    period_ms = MS_PER_S / frequency_hz
    phase = np.arange(CYCLES * SAMPLES_PER_CYCLE + 1) / SAMPLES_PER_CYCLE
    wave = np.outer(np.sin(2.0 * np.pi * phase), per_um * float_array("amplitudes_um", amplitudes_um, 1))
    times_ms = np.append(0.0, SETTLING_MS + period_ms * phase)
    values = np.maximum(hold + np.vstack([0.0 * wave[:1], wave]), 0.0)
    return Traces(times_ms, values, kinks_ms=np.array([SETTLING_MS]), quantity=quantity)


def impulses_per_cycle(afferent: AnyAfferent, traces: Traces) -> FloatArray:
    """Impulses in the counted cycles of `vibration`, over their number, (n_amplitudes,)."""
    end_ms = float(traces.times_ms[-1])
    from_ms = end_ms - (end_ms - SETTLING_MS) * COUNTED_CYCLES / CYCLES
    spikes = afferent.spikes(traces)
    counts = [np.count_nonzero(spikes[site] > from_ms) for site in range(traces.n_sites)]
    return np.array(counts) / COUNTED_CYCLES


@checked
def tuning_curve(
    afferent: AnyAfferent,
    frequencies_hz: ArrayLike,
    per_um: Positive | tuple[Positive, Positive],
    hold: Finite | tuple[Finite, Finite] = 0.0,
    impulses: Positive = 1.0,
) -> FloatArray:
    """Smallest amplitude at which an afferent fires a given number of impulses per cycle. [µm]

    From the middle to a peak, within 1 %, (n_frequencies,); NaN where 10 mm do not suffice.

    Parameters
    ----------
    afferent : AnyAfferent
        An afferent of any type.
    frequencies_hz : array_like (n_frequencies,)
        Frequencies. [Hz]
    per_um : float or (float, float)
        Change of what it follows per indentation; two numbers where the dynamic and the static term follow
        two quantities. [unit of the quantity per µm]
    hold : float or (float, float), optional
        What it follows in the hold.
    impulses : float, optional
        Impulses per cycle; 1 is entrainment, if they are equally distributed.

    Examples
    --------
    Compressive stress changes by 20 Pa per µm under a punch of 1 mm, about 10 kPa:

    >>> from fingerpad.neuron.afferent_types import RA
    >>> tuning_curve(RA(), [5.0, 40.0, 200.0], per_um=0.02, hold=10.0).round().tolist()
    [14.0, 5.0, 34.0]
    """
    checked_afferent(afferent)
    quantities = afferent.dynamic_quantity, afferent.static_quantity
    slopes, holds = (each if isinstance(each, tuple) else (each, each) for each in (per_um, hold))

    def threshold_um(frequency_hz: float) -> float:
        low, high = _RANGE_UM
        for _ in range(_ROUNDS):
            amplitudes = np.geomspace(low, high, _AMPLITUDES)
            dynamic, static = (
                vibration(frequency_hz, amplitudes, *term)
                for term in zip(slopes, holds, quantities, strict=True)
            )
            traces = static if quantities[0] == quantities[1] else replace(static, dynamic=dynamic)
            enough = impulses_per_cycle(afferent, traces) >= impulses
            if not enough.any():
                return float("nan")
            first = int(np.argmax(enough))
            low, high = amplitudes[max(first - 1, 0)], amplitudes[first]
        return float(high)

    frequencies = float_array("frequencies_hz", frequencies_hz, 1)
    return np.array([threshold_um(frequency) for frequency in frequencies.tolist()])
