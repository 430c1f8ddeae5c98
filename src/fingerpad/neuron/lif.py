"""Membrane current -> spike times: the leaky integrate-and-fire neuron (paper, Eqs. 3-5).

Between two knots the current is linear in time and the potential has a closed form. A crossing of the
threshold is bracketed and refined to round-off (`fingerpad.neuron.exact_spikes`) without a time step.
"""

from __future__ import annotations

import math

import numpy as np

from fingerpad.core.checked import value_class
from fingerpad.core.errors import InputError
from fingerpad.core.signals import CURRENTS, SpikeTrains, Traces
from fingerpad.core.threads import in_blocks
from fingerpad.core.values import Finite, FloatArray, Positive
from fingerpad.neuron.exact_spikes import Constants, exact_trains, initial_potentials


def checked_current(traces: Traces) -> Traces:
    """Return traces of a current, or raise `InputError`."""
    if traces.quantity not in CURRENTS:
        raise InputError(
            f"A membrane needs traces of a current: got {traces.quantity!r}; compute the current with "
            "Transduction.current, or give quantity='current'."
        )
    return traces


@value_class
class LeakyIntegrateAndFire:
    """A leaky integrate-and-fire membrane with a refractory period.

    When the potential reaches the threshold, a spike occurs, the potential is reset to 0 and stays there for
    the refractory period.

    Examples
    --------
    A constant current of 2 µA charges at 2 mV/ms minus the leak and reaches 50 mV every 32 ms.

    >>> neuron = LeakyIntegrateAndFire(68.0, 1e-6, 50.0, 1.0)
    >>> spikes = neuron.spikes(Traces([0.0, 100.0], [[2e-6], [2e-6]], quantity="current"))
    >>> spikes[0].round(3).tolist()
    [31.165, 63.33, 95.495]
    """

    time_constant_ms: Positive  #: Time constant of the leak, tau = R C, Eq. 3. [ms]
    capacitance_mf: Positive  #: Capacitance of the membrane, C. [mF]
    threshold_mv: Positive  #: Potential that elicits a spike, v. [mV]
    refractory_ms: Positive  #: Refractory period after each spike. [ms]
    initial_mv: Finite | None = None
    """Potential at the first time. By default that at rest: the first current is taken to have flowed for
    long, so that the spikes do not depend on how long nothing happened. The paper starts at 0. [mV]"""

    def __post_init__(self) -> None:
        if self.initial_mv is not None and self.initial_mv >= self.threshold_mv:
            wanted = f"must be below the threshold, {self.threshold_mv:g} mV"
            raise InputError("initial_mv", wanted, f"{self.initial_mv:g}", "leave it out to start at rest")

    def spikes(self, current: Traces) -> SpikeTrains:
        """Spike times of one neuron per site, exact for a piecewise linear current [mA]."""
        checked_current(current)

        def trains(neurons: slice) -> SpikeTrains:
            some = current.part(neurons)
            return SpikeTrains(*exact_trains(some.times_ms, some.values, self.constants()))

        return SpikeTrains.joined(in_blocks(trains, current.n_sites))

    def initial_potentials_mv(self, current_ma: FloatArray) -> FloatArray:
        """Potentials (n_sites,) at the first time, under the first currents (n_sites,). [mV]"""
        return initial_potentials(current_ma, self.constants())

    def constants(self) -> Constants:
        """Return the parameters in their order, NaN for an initial potential at rest."""
        initial_mv = math.nan if self.initial_mv is None else self.initial_mv
        return self.time_constant_ms, self.capacitance_mf, self.threshold_mv, self.refractory_ms, initial_mv


def membrane_potential(
    membrane: LeakyIntegrateAndFire, current: Traces, spikes_ms: FloatArray, times_ms: FloatArray
) -> FloatArray:
    """Potential (n_times,) of one membrane whose spike times are known, Eq. 3. [mV]"""
    tau, capacitance = membrane.time_constant_ms, membrane.capacitance_mf
    knots = np.unique(
        np.concatenate([times_ms, current.times_ms, spikes_ms, spikes_ms + membrane.refractory_ms])
    )
    length = np.diff(knots)
    # A repeated time is a jump of the current: the line between two knots is read inside of them.
    quarter, three_quarters = (
        np.interp(knots[:-1] + share * length, current.times_ms, current.values[:, 0])
        for share in (0.25, 0.75)
    )
    slope = 2.0 * (three_quarters - quarter) / length
    steady = tau / capacitance * (quarter - slope * (0.25 * length + tau))
    decay, growth = np.exp(-length / tau), tau / capacitance * slope * length
    last_spike = np.searchsorted(spikes_ms, knots[:-1], side="right") - 1
    since = np.where(last_spike < 0, np.inf, knots[:-1] - np.append(spikes_ms, 0.0)[last_spike])
    held = since < membrane.refractory_ms - 1e-9
    potential = np.zeros(knots.size)
    potential[:1] = membrane.initial_potentials_mv(current.values[0, :1])
    for number, fixed in enumerate(held):
        start = 0.0 if since[number] == 0.0 else potential[number]
        relaxed = steady[number] + (start - steady[number]) * decay[number]
        potential[number + 1] = 0.0 if fixed else relaxed + growth[number]
    return potential[np.searchsorted(knots, times_ms)]
