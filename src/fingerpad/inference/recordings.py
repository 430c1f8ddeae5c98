"""Recordings of one afferent: rates per stimulus, or spike trains per presentation."""

from __future__ import annotations

from collections import Counter
from collections.abc import Sequence

import numpy as np
from numpy.typing import ArrayLike

from fingerpad.core.checked import value_class
from fingerpad.core.errors import InputError
from fingerpad.core.signals import INTERVAL, SpikeTrains
from fingerpad.core.values import FiniteArray, FiniteVector, FloatArray, Many, float_array
from fingerpad.neuron.spikes import RATE_OF, Windows

PHASES = ("dynamic", "static")  # The ramp and the hold.

ROUNDING_MS = 1e-6
"""By how much the duration of a recording may fall short: files count seconds from their start. [ms]"""


@value_class
class RateRecordings:
    """Firing rates of one afferent, one row per stimulus.

    Examples
    --------
    >>> recordings = RateRecordings(("flat", "edge"), [54.0, 212.0], [9.0, 61.0])
    >>> recordings.chosen([1]).dynamic_rate_hz.tolist()
    [212.0]
    """

    stimuli: Many[str]  #: Names of the stimuli, without repetition.
    dynamic_rate_hz: FiniteVector | None
    static_rate_hz: FiniteVector | None
    """Rates in the ramp and in the hold; None for a phase that was not recorded, (n_stimuli,). [spikes/s]"""
    source: str = ""  #: Origin of the recordings.

    def __post_init__(self) -> None:
        twice = sorted(name for name, count in Counter(self.stimuli).items() if count > 1)
        if twice:
            raise InputError(
                "stimuli", "must be named once each", remedy=f"{twice[0]!r} is repeated; take its mean"
            )
        if not self.stimuli:
            raise InputError("RateRecordings needs at least one stimulus: got none.")
        if not self.phases:
            raise InputError("RateRecordings needs dynamic_rate_hz, static_rate_hz or both: got neither.")
        for phase in self.phases:
            name = f"{phase}_rate_hz"
            rates = getattr(self, name)
            if rates.size != len(self.stimuli):
                raise InputError(name, "needs one rate per stimulus", f"{rates.size} for {len(self.stimuli)}")
            if (rates < 0.0).any():
                raise InputError(
                    name, "must not be negative", remedy=f"the smallest is {rates.min():g} spikes/s"
                )

    @property
    def phases(self) -> tuple[str, ...]:
        """The recorded ones of "dynamic" and "static"."""
        return tuple(phase for phase in PHASES if getattr(self, f"{phase}_rate_hz") is not None)

    def check_stimuli(self, number: int) -> None:
        """Raise `InputError` unless this is the number of stimuli."""
        if len(self.stimuli) != number:
            wanted = "needs one stimulus per column of the model's drive"
            raise InputError("recordings", wanted, f"{len(self.stimuli)} for {number}")

    def chosen(self, rows: ArrayLike) -> RateRecordings:
        """Select stimuli by their indices."""
        indices = np.asarray(rows, dtype=np.int64)
        rates = {f"{phase}_rate_hz": getattr(self, f"{phase}_rate_hz") for phase in PHASES}
        return RateRecordings(
            tuple(self.stimuli[index] for index in indices),
            **{name: None if rate is None else rate[indices] for name, rate in rates.items()},
            source=self.source,
        )


@value_class
class SpikeRecordings:
    """Spike trains of one afferent, one per presentation of a stimulus.

    Examples
    --------
    >>> trains = SpikeTrains.from_lists([[10.0, 40.0, 45.0], [12.0, 38.0, 42.0], [100.0]])
    >>> recordings = SpikeRecordings(("edge", "edge", "flat"), trains, 1000.0)
    >>> rates = recordings.rates(((30.0, 50.0), (600.0, 950.0)))
    >>> rates.stimuli, rates.dynamic_rate_hz.round(1).tolist()
    (('edge', 'flat'), [61.9, 0.0])
    """

    stimuli: Many[str]  #: Stimulus of each presentation, repeated if it was presented several times.
    trains: SpikeTrains  #: One train per presentation, times from the onset of the indentation. [ms]
    duration_ms: FiniteArray
    """Duration of each recording, or of all of them, from the onset, (n_presentations,). [ms]"""
    source: str = ""  #: Origin of the recordings.

    def __post_init__(self) -> None:
        if len(self.trains) != len(self.stimuli):
            raise InputError(
                "trains", "needs one train per presentation", f"{len(self.trains)} for {len(self.stimuli)}"
            )
        duration = np.atleast_1d(self.duration_ms)
        if duration.ndim > 1 or duration.size not in (1, len(self.stimuli)) or (duration <= 0.0).any():
            wanted = f"must be above 0, one for all or for each of {len(self.stimuli)} presentations"
            raise InputError("duration_ms", wanted, repr(self.duration_ms))
        duration = float_array("duration_ms", np.broadcast_to(duration, len(self.stimuli)), 1)
        object.__setattr__(self, "duration_ms", duration)
        for name, train, end in zip(self.stimuli, self.trains, duration, strict=True):
            if train.size and (train[0] < 0.0 or train[-1] > end):
                outside = train[0] if train[0] < 0.0 else train[-1]
                wanted = f"must lie between 0 and duration_ms, {end:g} ms"
                raise InputError("spikes", wanted, remedy=f"{name!r} has one at {outside:g} ms")

    def rates(self, windows_ms: Windows, measure: str = INTERVAL) -> RateRecordings:
        """Compute the rates of each stimulus in the ramp and in the hold, Eqs. 6-10, mean over presentations.

        Parameters
        ----------
        windows_ms : ((float, float), (float, float))
            Dynamic and static window, such as `rate_windows_ms` of the phases of the motion. [ms]
        measure : {"interval", "count"}
            What a rate is: one over the mean interval, or spikes over the length of the window.
        """
        end = max(window[-1] for window in windows_ms)
        if self.duration_ms.size and end > self.duration_ms.min() + ROUNDING_MS:
            wanted = f"must end within the recordings of {self.duration_ms.min():g} ms"
            raise InputError("windows_ms", wanted, remedy=f"one ends at {end:g} ms")
        names = tuple(dict.fromkeys(self.stimuli))
        owner = np.array([names.index(name) for name in self.stimuli], dtype=np.int64)
        n_presentations = np.bincount(owner, minlength=len(names))
        dynamic, static = (
            np.bincount(owner, RATE_OF[measure](self.trains, window), len(names)) / n_presentations
            for window in windows_ms
        )
        return RateRecordings(names, dynamic, static, self.source)


def check_trains(
    trains: SpikeTrains,
    start_ms: float,
    ends_ms: FloatArray,
    refractory_ms: float,
    names: Sequence[str] | None = None,
) -> None:
    """Raise `InputError` for a spike outside of its recording, or within the refractory period of another."""
    for number, end in enumerate(ends_ms):
        train, name = trains[number], f"train {number}" if names is None else names[number]
        if train.size and not start_ms < train[0] <= train[-1] <= end:
            outside = train[0] if train[0] <= start_ms else train[-1]
            wanted = f"must lie after {start_ms:g} and until {end:g} ms, where the recording ends"
            raise InputError("spikes", wanted, remedy=f"{name} has one at {outside:g} ms")
        close = np.flatnonzero(np.diff(train) <= refractory_ms)
        if close.size:
            raise InputError(
                "spikes",
                f"must be more than {refractory_ms:g} ms apart, the refractory period",
                remedy=f"{name} has two at {train[close[0]]:g} and {train[close[0] + 1]:g} ms; sort the unit "
                "again, fit rates, or give a shorter refractory_ms",
            )
