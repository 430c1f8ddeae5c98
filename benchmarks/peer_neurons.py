"""The afferents that fingerpad and Brian2 fire: one course of current in 100,000 strengths; our side."""

from __future__ import annotations

from pathlib import Path
from time import perf_counter
from typing import Any

import numpy as np

from benchmarks.runge_kutta import runge_kutta_spikes
from fingerpad.core.signals import SpikeTrains, Traces
from fingerpad.neuron.lif import LeakyIntegrateAndFire

TIME_CONSTANT_MS, CAPACITANCE_MF, THRESHOLD_MV, REFRACTORY_MS = 68.0, 1e-6, 50.0, 1.0
"""The paper's membrane."""

KNOTS_MS = (0.0, 50.0, 60.0, 1000.0)
COURSE = (0.0, 1.0, 0.5, 0.4)
"""Ramp, fall at its end and slow relaxation in the hold, as a share of the largest current."""

STRONGEST_MA = 8e-6
"""Largest current of the last afferent, which fires 60 times in 1 s; strengths rise evenly from 0. [mA]"""

STEPS_MS = (1e-2, 1e-3, 1e-4)
"""Steps of Runge-Kutta by which the exact spike times are checked. [ms]"""


def write_currents(path: Path, afferents: int) -> Path:
    """Write membrane, course of current and strengths for both programs, as one NumPy archive."""
    np.savez(
        path,
        membrane=(TIME_CONSTANT_MS, CAPACITANCE_MF, THRESHOLD_MV, REFRACTORY_MS),
        knots_ms=KNOTS_MS,
        course=COURSE,
        strength_ma=np.linspace(0.0, STRONGEST_MA, afferents),
    )
    return path


def read_currents(path: Path, every: int = 1) -> tuple[LeakyIntegrateAndFire, Traces]:
    """Read the membrane and every so manieth current."""
    with np.load(path) as stored:
        current_ma = stored["course"][:, None] * stored["strength_ma"][None, ::every]
        return LeakyIntegrateAndFire(*stored["membrane"].tolist()), Traces(
            stored["knots_ms"], current_ma, quantity="current"
        )


def fire(currents: str, found: str) -> dict[str, Any]:
    """Fire all afferents with fingerpad, exactly, and keep their spikes.

    Returns
    -------
    dict
        Seconds of `LeakyIntegrateAndFire.spikes`, and the number of spikes.
    """
    neuron, current = read_currents(Path(currents))
    neuron.spikes(
        Traces(current.times_ms, current.values[:, :2], quantity="current")
    )  # loads compiled kernels
    started = perf_counter()
    spikes = neuron.spikes(current)
    solve_s = perf_counter() - started
    np.savez(found, times_ms=spikes.times_ms, offsets=spikes.offsets)
    return {"solve_s": solve_s, "spikes": int(spikes.times_ms.size)}


def check(currents: str, every: int) -> dict[str, Any]:
    """Compare exact spike times of some afferents with Runge-Kutta of ever smaller steps.

    Returns
    -------
    dict
        Largest difference of any spike's time at each of `STEPS_MS`; it must shrink with the step. [ms]
    """
    neuron, current = read_currents(Path(currents), every)
    exact = neuron.spikes(current)
    differences = []
    for step_ms in STEPS_MS:
        stepped = runge_kutta_spikes(neuron, current, step_ms)
        differences.append(largest_difference_ms(exact, stepped))
    return {"afferents": current.values.shape[1], "differences_ms": differences}


def largest_difference_ms(one: SpikeTrains, other: SpikeTrains) -> float:
    """Largest difference between spikes of the same number in the same train. [ms]

    Examples
    --------
    >>> a = SpikeTrains([1.0, 5.0, 2.0], [0, 2, 3])
    >>> b = SpikeTrains([1.5, 2.25], [0, 1, 2])
    >>> largest_difference_ms(a, b)
    0.5
    """
    return float(np.abs(paired_differences_ms(one, other)).max(initial=0.0))


def paired_differences_ms(one: SpikeTrains, other: SpikeTrains) -> np.ndarray:
    """Differences of spikes of the same number in the same train, of those that both have. [ms]"""
    common = np.minimum(np.diff(one.offsets), np.diff(other.offsets))
    number = np.arange(common.sum()) - np.repeat(np.cumsum(common) - common, common)
    first, second = (np.repeat(trains.offsets[:-1], common) + number for trains in (one, other))
    return other.times_ms[second] - one.times_ms[first]


def timing(ours: str, theirs: str) -> dict[str, float]:
    """Compare spikes of another program with ours.

    Parameters
    ----------
    ours, theirs : str
        Files with spikes.

    Returns
    -------
    dict
        Root mean square and largest difference of spikes of the same number [ms], and in how many trains the
        number of spikes is the same [%].
    """
    mine, other = _read(ours), _read(theirs)
    differences = paired_differences_ms(mine, other)
    same = np.diff(mine.offsets) == np.diff(other.offsets)
    return {
        "rms_ms": float(np.sqrt((differences**2).mean())),
        "largest_ms": float(np.abs(differences).max()),
        "same_count_percent": 100.0 * float(same.mean()),
    }


def _read(path: str) -> SpikeTrains:
    with np.load(path) as stored:
        return SpikeTrains(stored["times_ms"], stored["offsets"])
