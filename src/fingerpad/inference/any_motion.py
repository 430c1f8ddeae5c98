"""One afferent under stimuli that may each move in their own time, its rates counted in windows of choice."""

from __future__ import annotations

from collections.abc import Callable, Sequence
from dataclasses import dataclass, replace

import numpy as np

from fingerpad.core.checks import FloatArray
from fingerpad.core.errors import InputError
from fingerpad.core.signals import SedTraces
from fingerpad.data import neuron, protocol
from fingerpad.inference.closed_form import ClosedFormModel
from fingerpad.inference.fitting.problem import IntArray
from fingerpad.inference.identifiable import IDENTIFIABLE_NAMES
from fingerpad.inference.quick_rates import rates_under
from fingerpad.inference.receptor_offset import OFFSET_NAME, ReceptorOffset
from fingerpad.neuron.afferent import PARAMETER_NAMES
from fingerpad.neuron.transduction import Drive, drive

Windows = tuple[tuple[float, ...], tuple[float, ...]]

WINDOWS_MS: Windows = (protocol.DYNAMIC_WINDOW.value, protocol.STATIC_WINDOW.value)
"""Windows of the dynamic and of the static rate, the paper's. [ms]"""


@dataclass(frozen=True)
class AnyMotion:
    """The paper's model under stimuli that do not share their times; a `RateModel`.

    Parameters
    ----------
    drives : tuple of Drive
        One per group of stimuli that move alike.
    stimuli : tuple of int array
        Which stimulus each column of each drive belongs to, every stimulus once.
    windows_ms : ((float, float), (float, float))
        Windows of the dynamic and of the static rate. [ms]
    refractory_ms : float
        Rest after each spike, which is not fitted. [ms]

    Examples
    --------
    >>> from fingerpad.neuron.afferent import Afferent
    >>> short = SedTraces([0.0, 50.0, 1000.0], [[0.0], [2.0], [2.0]], kinks_ms=[50.0])
    >>> longer = SedTraces([0.0, 50.0, 2000.0], [[0.0], [2.0], [2.0]], kinks_ms=[50.0])
    >>> model = AnyMotion.under([short, longer, short])
    >>> [drive.n_sites for drive in model.drives]
    [2, 1]
    >>> model.rates(Afferent().parameters)[1].round().tolist()
    [63.0, 63.0, 63.0]
    """

    drives: tuple[Drive, ...]
    stimuli: tuple[IntArray, ...]
    windows_ms: Windows = WINDOWS_MS
    refractory_ms: float = neuron.REFRACTORY.value

    @classmethod
    def under(
        cls,
        sed: SedTraces | Sequence[SedTraces],
        windows_ms: Windows = WINDOWS_MS,
        refractory_ms: float = neuron.REFRACTORY.value,
    ) -> AnyMotion:
        """Group stimuli by their times, so that those that move alike are answered at once.

        Parameters
        ----------
        sed : SedTraces or sequence of SedTraces
            Strain energy density, one column per stimulus; several traces follow each other.
        windows_ms, refractory_ms
            As of the class.

        Returns
        -------
        AnyMotion

        Raises
        ------
        InputError
            If a stimulus ends before a window does, or they bring several quantities for the dynamic term.
        """
        traces = [sed] if isinstance(sed, SedTraces) else list(sed)
        quantities = sorted({trace.dynamic_quantity for trace in traces})
        if len(quantities) != 1:
            raise InputError(
                f"sed must bring one dynamic_quantity: got {', '.join(quantities) or 'no traces'}."
            )
        end = max(bound for window in windows_ms for bound in window)
        groups: dict[tuple[bytes, bytes], list[tuple[int, SedTraces]]] = {}
        first = 0
        for trace in traces:
            if trace.times_ms[-1] < end:
                raise InputError(
                    f"windows_ms must end with the stimuli: one ends at {end:g} ms, stimulus {first + 1} at "
                    f"{trace.times_ms[-1]:g} ms."
                )
            groups.setdefault((trace.times_ms.tobytes(), trace.kinks_ms.tobytes()), []).append((first, trace))
            first += trace.n_sites
        return cls(
            tuple(drive(_side_by_side([trace for _, trace in group])) for group in groups.values()),
            tuple(
                np.concatenate([start + np.arange(trace.n_sites) for start, trace in group])
                for group in groups.values()
            ),
            windows_ms,
            refractory_ms,
        )

    @property
    def names(self) -> tuple[str, ...]:
        """beta, k_d, k_s, tau, C, v under their full names."""
        return PARAMETER_NAMES

    @property
    def n_stimuli(self) -> int:
        """Number of stimuli."""
        return sum(drive.n_sites for drive in self.drives)

    def rates(self, parameters: FloatArray) -> tuple[FloatArray, FloatArray]:
        """Dynamic and static rates of the afferent with these six parameters. [spikes/s]"""
        dynamic, static = np.empty((2, self.n_stimuli))
        for group, columns in zip(self.drives, self.stimuli, strict=True):
            rates = rates_under(group, self.refractory_ms, self.windows_ms)
            dynamic[columns], static[columns] = rates(parameters)
        return dynamic, static


@dataclass(frozen=True)
class AnyMotionBeside:
    """The same stimuli felt by a receptor that may lie beside its place, along the finger; a `RateModel`.

    Parameters
    ----------
    offsets_mm : array (n_offsets,)
        Places at which the drive is known, distal positive, increasing. [mm]
    places : sequence of AnyMotion
        What a receptor in each place feels.

    Raises
    ------
    InputError
        If there are not two places at least, or they disagree in stimuli and times.

    Examples
    --------
    >>> near, far = (SedTraces([0.0, 50.0, 1000.0], [[0.0], [peak], [peak]]) for peak in (2.0, 1.0))
    >>> beside = AnyMotionBeside([-0.1, 0.1], [AnyMotion.under(near), AnyMotion.under(far)])
    >>> beside.at(0.0).drives[0].sed_kpa[-1].tolist()
    [1.5]
    """

    offsets_mm: FloatArray
    places: Sequence[AnyMotion]

    def __post_init__(self) -> None:
        kinds = {tuple(columns.tobytes() for columns in place.stimuli) for place in self.places}
        if len(kinds) != 1:
            raise InputError(
                f"AnyMotionBeside needs the same stimuli at every place: got {len(kinds)} kinds of places."
            )
        object.__setattr__(self, "offsets_mm", self._groups[0].offsets_mm)

    @property
    def _groups(self) -> list[ReceptorOffset]:
        """One model per group of stimuli that move alike; making it checks its drives."""
        return [
            ReceptorOffset(self.offsets_mm, drives)
            for drives in zip(*(place.drives for place in self.places), strict=True)
        ]

    @property
    def names(self) -> tuple[str, ...]:
        """The six parameters of an afferent, then the offset."""
        return (*PARAMETER_NAMES, OFFSET_NAME)

    @property
    def n_stimuli(self) -> int:
        """Number of stimuli."""
        return self.places[0].n_stimuli

    def at(self, offset_mm: float) -> AnyMotion:
        """Return what a receptor feels that lies there, linear between two places.

        Raises
        ------
        InputError
            If the offset lies outside of the places at which the drive is known.
        """
        return replace(self.places[0], drives=tuple(group.drive_at(offset_mm) for group in self._groups))

    def rates(self, parameters: FloatArray) -> tuple[FloatArray, FloatArray]:
        """Dynamic and static rates of the afferent with these seven parameters. [spikes/s]"""
        return self.at(parameters[-1]).rates(parameters[:-1])


@dataclass(frozen=True)
class AnyMotionInClosedForm:
    """The same stimuli in the closed form of constant drive, a source of slopes; a `SmoothRateModel`.

    Parameters
    ----------
    stimuli : AnyMotion
        Drives, windows and rest.
    """

    stimuli: AnyMotion

    @property
    def names(self) -> tuple[str, ...]:
        """The four numbers that firing can tell."""
        return IDENTIFIABLE_NAMES

    @property
    def n_stimuli(self) -> int:
        """Number of stimuli."""
        return self.stimuli.n_stimuli

    def rates(self, parameters: FloatArray) -> tuple[FloatArray, FloatArray]:
        """Dynamic and static rates. [spikes/s]"""
        return self._collected(lambda group: group.rates(parameters))

    def slopes(self, parameters: FloatArray) -> tuple[FloatArray, FloatArray]:
        """Slopes of both rates along the four numbers, (n_stimuli, 4) each."""
        return self._collected(lambda group: group.slopes(parameters))

    def _collected(
        self, told: Callable[[ClosedFormModel], tuple[FloatArray, FloatArray]]
    ) -> tuple[FloatArray, FloatArray]:
        """Put what each group tells in the order of the stimuli."""
        order = np.argsort(np.concatenate(self.stimuli.stimuli))
        answers = [
            told(ClosedFormModel(group, self.stimuli.refractory_ms, windows_ms=self.stimuli.windows_ms))
            for group in self.stimuli.drives
        ]
        dynamic, static = (np.concatenate(phase)[order] for phase in zip(*answers, strict=True))
        return dynamic, static


def _side_by_side(traces: Sequence[SedTraces]) -> SedTraces:
    """Join traces with the same times into one."""
    dynamic = [trace.dynamic_kpa for trace in traces if trace.dynamic_kpa is not None]
    return replace(
        traces[0],
        sed_kpa=np.hstack([trace.sed_kpa for trace in traces]),
        dynamic_kpa=np.hstack(dynamic) if dynamic else None,
    )
