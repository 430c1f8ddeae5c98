"""Spikes of afferents sample by sample: the state is carried from one sample to the next.

Between two samples what drives the afferents is linear in time, so the rate of Eq. 2 is constant and the
current of Eq. 1 linear, and it jumps at each sample. Spikes are those of `Afferent.spikes` for the same
trace with a kink at each sample.
"""

from __future__ import annotations

import numpy as np
from numpy.typing import ArrayLike

from fingerpad.core.checks import FloatArray, finite, float_array, instance, whole
from fingerpad.core.errors import InputError
from fingerpad.core.keywords import KnownKeywords
from fingerpad.core.signals import SpikeTrains
from fingerpad.neuron.afferent import Afferent
from fingerpad.neuron.exact_spikes import continued_trains


class AfferentStream(metaclass=KnownKeywords):
    """Afferents of one type that respond as the samples come.

    Parameters
    ----------
    afferent : Afferent
        The afferent.
    n_sites : int
        Number of them.

    Raises
    ------
    InputError
        If the afferent is none, or the number is not positive.

    Examples
    --------
    >>> import fingerpad as fp
    >>> stream = fp.AfferentStream(fp.Afferent(), n_sites=1)
    >>> trains = [stream.step(float(time), [0.4 * time]) for time in range(1, 31)]
    >>> sum(len(train[0]) for train in trains) > 1
    True
    """

    def __init__(self, afferent: Afferent, n_sites: int):
        self._afferent = instance("afferent", afferent, Afferent)
        self._gains, membrane = afferent.transduction, afferent.membrane
        count = whole("n_sites", n_sites, at_least=1)
        self._constants = membrane.constants()[:-1]
        self._potentials = membrane.initial_potentials_mv(np.full(count, float(self._gains.intercept_ma)))
        self._time_ms, self._ready = 0.0, np.zeros(count)
        self._static, self._dynamic = np.zeros(count), np.zeros(count)

    def step(self, time_ms: float, static: ArrayLike, dynamic: ArrayLike | None = None) -> SpikeTrains:
        """Go to a later time, and return the spikes since the last one.

        Parameters
        ----------
        time_ms : float
            After that of the last step. [ms]
        static : array (n_sites,)
            What the static term follows, now; 0 at the time 0. [kPa]
        dynamic : array (n_sites,), optional
            What the dynamic term follows, if it is another quantity. [kPa]

        Returns
        -------
        SpikeTrains
            One train per site.

        Raises
        ------
        InputError
            If time does not go on, the number of values is wrong, or one quantity is missing.
        """
        if not finite("time_ms", time_ms, "ms") > self._time_ms:
            raise InputError(f"time_ms must go on: got {time_ms:g} after {self._time_ms:g} ms.")
        same = self._afferent.dynamic_quantity == self._afferent.static_quantity
        if same != (dynamic is None):
            wanted = "one quantity" if same else "a static and a dynamic quantity"
            raise InputError(f"This afferent follows {wanted}: got {1 if dynamic is None else 2}.")
        later = self._values("static", static)
        followed = later if dynamic is None else self._values("dynamic", dynamic)
        gains, step_ms = self._gains, time_ms - self._time_ms
        driven = gains.intercept_ma + gains.dynamic_gain * np.abs(followed - self._dynamic) / step_ms
        current_ma = np.stack([driven + gains.static_gain * value for value in (self._static, later)])
        found = continued_trains(
            np.array([self._time_ms, time_ms]), current_ma, *self._constants, self._potentials, self._ready
        )
        self._time_ms, self._static, self._dynamic = float(time_ms), later, followed
        return SpikeTrains(*found)

    def _values(self, name: str, values: ArrayLike) -> FloatArray:
        found = float_array(name, values, 1)
        if found.size != self._potentials.size:
            raise InputError(
                f"{name} must have one value per site, {self._potentials.size}: got {found.size}."
            )
        if (found < 0.0).any():
            raise InputError(f"{name} must not be negative: the smallest value is {found.min():.3g}.")
        return found
