"""Spikes of afferents of any type sample by sample: the state is carried from one sample to the next.

Between two samples what drives the afferents is linear in time. Spikes are those that the afferent has for
the same trace with a kink at each sample. The filters and the membrane of SAI, SAII, RA and PC carry their
state; an afferent of one's own has none that is known, and is given the whole trace each time.
"""

from __future__ import annotations

import numpy as np
from numpy.typing import ArrayLike

from fingerpad.core.checked import checked_class
from fingerpad.core.errors import InputError
from fingerpad.core.signals import SpikeTrains, Traces
from fingerpad.core.values import Finite, FloatArray, Whole, finite, float_array, whole
from fingerpad.neuron.afferent import Afferent, AnyAfferent, adapted, checked_afferent
from fingerpad.neuron.afferent_types import RapidlyAdapting
from fingerpad.neuron.band_pass import continued_stage, knots_between
from fingerpad.neuron.exact_spikes import continued_trains
from fingerpad.neuron.transduction import PIECES_PER_INTERVAL, SHORTEST_PIECE_MS, current_of, knots_of


@checked_class
class AfferentStream:
    """Afferents of one type that respond as the samples come.

    Parameters
    ----------
    afferent : AnyAfferent
        Of any type, or one's own.
    n_sites : int
        Number of them.

    Examples
    --------
    >>> import fingerpad as fp
    >>> stream = fp.AfferentStream(fp.Afferent(), n_sites=1)
    >>> trains = [stream.step(float(time), [0.4 * time], [0.02 * time]) for time in range(1, 31)]
    >>> sum(len(train[0]) for train in trains) > 1
    True
    """

    def __init__(self, afferent: AnyAfferent, n_sites: Whole):
        self._afferent = checked_afferent(afferent)
        count = whole("n_sites", n_sites, at_least=1)
        self._time_ms, self._ready = 0.0, np.zeros(count)
        self._static, self._dynamic = np.zeros(count), np.zeros(count)
        self._trace = [(self._time_ms, self._static, self._dynamic)]
        if isinstance(afferent, Afferent | RapidlyAdapting):
            rest_ma = afferent.intercept_ma if isinstance(afferent, Afferent) else 0.0
            self._constants = afferent.membrane.constants()
            self._potentials = afferent.membrane.initial_potentials_mv(np.full(count, float(rest_ma)))
        stages = afferent.rise + afferent.fall if isinstance(afferent, RapidlyAdapting) else 1
        self._filtered = np.zeros((stages, count))
        self._lost = np.zeros(count)

    def step(self, time_ms: Finite, static: ArrayLike, dynamic: ArrayLike | None = None) -> SpikeTrains:
        """Go to a later time, and return the spikes since the last one, a train per site.

        Parameters
        ----------
        time_ms : float
            After that of the last step. [ms]
        static : array (n_sites,)
            What the static term follows, now; 0 at the time 0. [kPa, or the unit of the quantity]
        dynamic : array (n_sites,), optional
            What the dynamic term follows, if it is another quantity. [as above]
        """
        if not finite("time_ms", time_ms, "ms") > self._time_ms:
            raise InputError("time_ms", "must go on", f"{time_ms:g} after {self._time_ms:g} ms")
        same = self._afferent.dynamic_quantity == self._afferent.static_quantity
        if same != (dynamic is None):
            wanted = "one quantity" if same else "a static and a dynamic quantity"
            raise InputError(f"This afferent follows {wanted}: got {1 if dynamic is None else 2}.")
        later = self._values("static", static)
        followed = later if dynamic is None else self._values("dynamic", dynamic)
        if isinstance(self._afferent, Afferent | RapidlyAdapting):
            knots_ms, current_ma = self._current(self._afferent, float(time_ms), later, followed)
            state = self._potentials, self._ready
            spikes = SpikeTrains(*continued_trains(knots_ms, current_ma, self._constants, *state))
        else:
            spikes = self._replayed(float(time_ms), later, followed)
        self._time_ms, self._static, self._dynamic = float(time_ms), later, followed
        return spikes

    def _current(
        self, afferent: Afferent | RapidlyAdapting, time_ms: float, static: FloatArray, dynamic: FloatArray
    ) -> tuple[FloatArray, FloatArray]:
        """Knots since the last sample, and the current there, linear between them; filters go on."""

        def between(before: FloatArray, now: FloatArray) -> FloatArray:
            return before + share[:, None] * (now - before)

        tau_ms = (
            afferent.smoothing_ms if isinstance(afferent, Afferent) else afferent.band_pass.time_constant_ms
        )
        filters = tau_ms > 0.0
        ends = np.array([self._time_ms, time_ms])
        knots_ms = ends
        if filters:
            knots_ms = knots_between(self._time_ms, time_ms, tau_ms)
        elif isinstance(afferent, Afferent) and (afferent.adapting_share or afferent.saturation_per_ma):
            knots_ms = knots_of(ends, PIECES_PER_INTERVAL, SHORTEST_PIECE_MS)  # those of `drive`
        share = (knots_ms - self._time_ms) / (time_ms - self._time_ms)
        values = between(self._dynamic, dynamic)
        if isinstance(afferent, RapidlyAdapting):
            for stage, state in enumerate(self._filtered):
                continued_stage(knots_ms, values, tau_ms, stage < afferent.rise, state)
            return knots_ms, afferent.rectified(values)
        rate = (dynamic - self._dynamic) / (time_ms - self._time_ms)
        if filters:
            continued_stage(knots_ms, values, tau_ms, True, self._filtered[0])
            rate = values / tau_ms
        followed = between(self._static, static)
        if afferent.adapting_share:
            followed = adapted(afferent, knots_ms, followed, self._lost)
        return knots_ms, current_of(afferent.transduction, np.abs(rate), followed)

    def _replayed(self, time_ms: float, static: FloatArray, dynamic: FloatArray) -> SpikeTrains:
        """Spikes since the last sample of an afferent that is given the whole trace."""
        self._trace.append((time_ms, static, dynamic))
        times, values, followed = (np.array(part) for part in zip(*self._trace, strict=True))
        quantity, other = self._afferent.static_quantity, self._afferent.dynamic_quantity
        rate_of = None if other == quantity else Traces(times, followed, quantity=other)
        traces = Traces(times, values, times[1:-1], quantity, dynamic=rate_of)
        trains = self._afferent.spikes(traces)
        return SpikeTrains.from_lists([train[train > self._time_ms] for train in trains])

    def _values(self, name: str, values: ArrayLike) -> FloatArray:
        found = float_array(name, values, 1)
        if found.size != self._ready.size:
            raise InputError(name, f"must have one value per site, {self._ready.size}", str(found.size))
        if (found < 0.0).any():
            raise InputError(name, "must not be negative", remedy=f"the smallest value is {found.min():.3g}")
        return found
