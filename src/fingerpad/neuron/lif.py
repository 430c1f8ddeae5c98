"""Membrane current -> spike times: the leaky integrate-and-fire neuron (paper, Eqs. 3-5).

Between two knots the current is linear in time and the potential has a closed form. A crossing of the
threshold is bracketed and refined to round-off (`fingerpad.neuron.exact_spikes`) without a time step.
"""

from __future__ import annotations

from dataclasses import dataclass

from fingerpad.core.checks import positive
from fingerpad.core.signals import CurrentTraces, SpikeTrains
from fingerpad.core.threads import in_blocks
from fingerpad.core.values import converted
from fingerpad.neuron.exact_spikes import exact_trains


@dataclass(frozen=True)
@converted
class LeakyIntegrateAndFire:
    """A leaky integrate-and-fire membrane with a refractory period.

    The potential starts at 0. When it reaches the threshold, a spike occurs, the potential is reset to 0
    and stays there for the refractory period.

    Parameters
    ----------
    time_constant_ms : float
        Time constant of the leak, tau = R C, Eq. 3. [ms]
    capacitance_mf : float
        Capacitance of the membrane, C. [mF]
    threshold_mv : float
        Potential that elicits a spike, v. [mV]
    refractory_ms : float
        Refractory period after each spike. [ms]

    Raises
    ------
    InputError
        If a value is not positive.

    Examples
    --------
    A constant current of 2 µA charges at 2 mV/ms minus the leak and reaches 50 mV every 32 ms.

    >>> neuron = LeakyIntegrateAndFire(68.0, 1e-6, 50.0, 1.0)
    >>> spikes = neuron.spikes(CurrentTraces([0.0, 100.0], [[2e-6], [2e-6]]))
    >>> spikes[0].round(3).tolist()
    [31.165, 63.33, 95.495]
    """

    time_constant_ms: float
    capacitance_mf: float
    threshold_mv: float
    refractory_ms: float

    def __post_init__(self) -> None:
        positive("time_constant_ms", self.time_constant_ms, "ms")
        positive("capacitance_mf", self.capacitance_mf, "mF")
        positive("threshold_mv", self.threshold_mv, "mV")
        positive("refractory_ms", self.refractory_ms, "ms")

    def spikes(self, current: CurrentTraces) -> SpikeTrains:
        """Spike times of one neuron per site, exact for a piecewise linear current.

        Parameters
        ----------
        current : CurrentTraces
            One column per neuron.

        Returns
        -------
        SpikeTrains
            One train per site, up to the last knot.
        """

        def trains(neurons: slice) -> SpikeTrains:
            some = current.part(neurons)
            return SpikeTrains(*exact_trains(some.times_ms, some.current_ma, *self.constants()))

        return SpikeTrains.joined(in_blocks(trains, current.n_sites))

    def constants(self) -> tuple[float, float, float, float]:
        """Return time constant [ms], capacitance [mF], threshold [mV] and refractory period [ms]."""
        return (
            float(self.time_constant_ms),
            float(self.capacitance_mf),
            float(self.threshold_mv),
            float(self.refractory_ms),
        )
