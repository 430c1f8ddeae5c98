"""Membrane current -> spike times of a leaky integrate-and-fire neuron with a soft threshold.

The potential V follows Eq. 5 from where the membrane starts, and is reset to 0 after a spike. A spike does
not require that V reaches the threshold v: at any time the neuron fires with the hazard (escape rate)

    h(V) = 1/tau_e exp((V - v)/delta),

which is small below the threshold and grows without bound above it (Gerstner & Kistler 2002, section
5.3). In terms of u = V/v and the width delta/v it is free of the unit of potential. In the limit of a small
width the threshold is that of `fingerpad.neuron.lif`.

Between two knots of the current u has a closed form (`fingerpad.neuron.exact_spikes`), and h is integrated by
Gauss-Legendre quadrature on short panels. Spikes follow from time rescaling: the integrals of h from spike to
spike are exponentially distributed with mean 1.
"""

from __future__ import annotations

import math

import numpy as np
from numba import njit

from fingerpad.core.checked import value_class
from fingerpad.core.random_streams import Presentations, Purpose, checked_sites, four_uniforms
from fingerpad.core.signals import SpikeTrains, Traces
from fingerpad.core.threads import in_blocks
from fingerpad.core.values import FloatArray, Positive, Whole
from fingerpad.neuron.exact_spikes import potential_at
from fingerpad.neuron.lif import LeakyIntegrateAndFire, checked_current

ESCAPE_TIME_MS = 1.0  # Mean time to a spike at a potential equal to the threshold, tau_e: a convention. [ms]
_TRAINS_PER_BLOCK = 32  # Trains that one thread simulates at a time.

_ESCAPE = int(Purpose.ESCAPE)
NODES = tuple(0.5 + 0.5 * np.polynomial.legendre.leggauss(5)[0])
WEIGHTS = tuple(0.5 * np.polynomial.legendre.leggauss(5)[1])
"""Of the quadrature over a panel from 0 to 1."""

_LONGEST_PANEL = 0.5  # Largest length of a panel over tau: the potential is too curved over longer ones.
_HIGHEST_STEP = 1.0  # Largest change of the log hazard over one panel: the quadrature error is then 1e-9.

_NEGLIGIBLE = -60.0
"""Log hazard below which a panel is skipped: exp(-60)/tau_e practically never elicits a spike."""

_MOST_PANELS = 1.0e6
_ROUND_OFF = 1.0e-14
_MOST_REFINEMENTS = 100


@value_class
class EscapeRate:
    """A leaky integrate-and-fire neuron with a soft threshold.

    Examples
    --------
    >>> neuron = LeakyIntegrateAndFire(68.0, 1e-6, 50.0, 1.0)
    >>> steady = Traces([0.0, 100.0], [[2e-6], [2e-6]], quantity="current")
    >>> EscapeRate(neuron, width=0.1).spikes(steady, seed=1)[0].round(1).tolist()
    [28.7, 56.3, 83.4]
    >>> EscapeRate(neuron, width=1e-4).spikes(steady, seed=1)[0].round(1).tolist()
    [31.2, 63.4, 95.6]
    """

    membrane: LeakyIntegrateAndFire  #: Parameters of the membrane; at its threshold the hazard is 1/tau_e.
    width: Positive  #: Width of the threshold over the threshold, delta/v. [1]
    escape_ms: Positive = ESCAPE_TIME_MS
    """tau_e. It can be absorbed in the threshold, docs/decisions.md#escape-rate. [ms]"""

    def spikes(self, current: Traces, seed: Whole, presentations: Presentations | None = None) -> SpikeTrains:
        """Simulate spike times by time rescaling, a train per presentation.

        Parameters
        ----------
        current : Traces
            Of a current, one column per site. [mA]
        seed : int
            Seed of the run; the same seed gives the same spikes on any number of threads.
        presentations : Presentations, optional
            Site, trial and receptor of each train. Default: one presentation per site.
        """
        everyone = presentations or Presentations.of_population(current.n_sites)
        checked_sites(everyone.sites, checked_current(current).n_sites)
        threshold_mv = self.membrane.threshold_mv
        drives = np.ascontiguousarray(current.values.T) / (self.membrane.capacitance_mf * threshold_mv)
        initial = self.membrane.initial_potentials_mv(current.values[0]) / threshold_mv
        numbers = self.membrane.time_constant_ms, self.membrane.refractory_ms, self.width, self.escape_ms

        def trains(some: slice) -> SpikeTrains:
            part = everyone.part(some)
            keys = part.sites, part.trials, part.receptors
            return SpikeTrains(*_escape_trains(current.times_ms, drives, initial, *keys, seed, *numbers))

        return SpikeTrains.joined(in_blocks(trains, len(everyone), _TRAINS_PER_BLOCK))


@njit(cache=True, error_model="numpy", nogil=True)
def panels(length: float, start: float, steady: float, drift: float, width: float) -> int:
    """Return the number of panels of an interval for a quadrature error of at most 1e-9 with five nodes.

    The slope of u is monotone, so its largest magnitude is at one of the ends.
    """
    rise = steady - start
    steepest = max(abs(rise), abs(drift + (rise - drift) * math.exp(-length)))
    per_length = max(steepest / (width * _HIGHEST_STEP), 1.0 / _LONGEST_PANEL)
    return max(1, math.ceil(min(per_length * length, _MOST_PANELS)))


@njit(cache=True, error_model="numpy", nogil=True)
def _integral(begin: float, end: float, start: float, steady: float, drift: float, width: float) -> float:
    """Integral of exp((u - 1)/width) over one panel, in x."""
    total = 0.0
    for node, weight in zip(NODES, WEIGHTS):  # noqa: B905 (Numba knows no strict)
        u = potential_at(begin + node * (end - begin), start, steady, drift)
        total += weight * math.exp((u - 1.0) / width)
    return (end - begin) * total


@njit(cache=True, error_model="numpy", nogil=True)
def _where_reached(
    wanted: float, begin: float, end: float, start: float, steady: float, drift: float, width: float
) -> float:
    """Time at which the integral from `begin` reaches `wanted`, before `end`; bracketed Newton iteration."""
    low, high = begin, end
    guess = begin + (end - begin) * wanted / _integral(begin, end, start, steady, drift, width)
    for _ in range(_MOST_REFINEMENTS):
        if not low < guess < high:
            guess = 0.5 * (low + high)
        missing = wanted - _integral(begin, guess, start, steady, drift, width)
        if missing > 0.0:
            low = guess
        else:
            high = guess
        step = missing / math.exp((potential_at(guess, start, steady, drift) - 1.0) / width)
        guess += step
        if abs(step) <= _ROUND_OFF * end or high - low <= _ROUND_OFF * end:
            break
    return min(max(guess, low), high)


@njit(cache=True, error_model="numpy", nogil=True)
def _escape_trains(
    times: FloatArray,
    drives: FloatArray,
    initial: FloatArray,
    sites: np.ndarray,
    trials: np.ndarray,
    receptors: np.ndarray,
    seed: int,
    tau: float,
    refractory: float,
    width: float,
    escape: float,
) -> tuple[FloatArray, np.ndarray]:
    """Spike times of all trains, train after train, and the index of the first spike of each."""
    found = np.empty(64 * (sites.size + 1))
    offsets = np.zeros(sites.size + 1, dtype=np.int64)
    count = 0
    for train in range(sites.size):
        drive = drives[sites[train]]
        n_spikes = 0
        draws = four_uniforms(seed, trials[train], receptors[train], _ESCAPE, 1)
        wanted = -math.log1p(-draws[0]) * escape / tau  # in units of the integral over x
        u, ready = initial[sites[train]], times[0]
        for knot in range(times.size - 1):
            first, last = times[knot], times[knot + 1]
            begin = max(first, ready)
            while begin < last:
                drift = tau * (drive[knot + 1] - drive[knot]) / ((last - first) / tau)
                steady = tau * drive[knot] + drift * ((begin - first) / tau)
                length = (last - begin) / tau
                n_panels = panels(length, u, steady, drift, width)
                x = -1.0
                for panel in range(n_panels):
                    left, right = length * panel / n_panels, length * (panel + 1) / n_panels
                    highest = max(potential_at(left, u, steady, drift), potential_at(right, u, steady, drift))
                    if highest - 1.0 < (_NEGLIGIBLE - _HIGHEST_STEP) * width:
                        continue
                    part = _integral(left, right, u, steady, drift, width)
                    if part >= wanted:
                        x = _where_reached(wanted, left, right, u, steady, drift, width)
                        break
                    wanted -= part
                if x < 0.0:
                    u = potential_at(length, u, steady, drift)
                    break
                if count == found.size:
                    found = np.concatenate((found, np.empty(found.size)))
                found[count] = min(begin + tau * x, last)
                ready = found[count] + refractory
                begin = ready
                count += 1
                n_spikes += 1
                if n_spikes % 4 == 0:
                    block = n_spikes // 4 + 1
                    draws = four_uniforms(seed, trials[train], receptors[train], _ESCAPE, block)
                wanted = -math.log1p(-draws[n_spikes % 4]) * escape / tau
                u = 0.0
        offsets[train + 1] = count
    return found[:count], offsets
