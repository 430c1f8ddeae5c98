"""Values passed between the stages of the model: frozen, read-only, checked on construction.

Skin -> `Traces` -> `Traces` of a current -> `SpikeTrains` -> `ResponseMap` -> `HitRates`.
`Traces` is the only interface between the mechanical and the neural half of the package.
"""

from __future__ import annotations

import copyreg
from collections.abc import Callable, Iterator, Mapping, Sequence
from dataclasses import field, fields, replace
from inspect import signature
from types import MappingProxyType
from typing import Annotated, Any, Protocol, runtime_checkable

import numpy as np
from numpy.typing import ArrayLike

from fingerpad.core.checked import value_class
from fingerpad.core.displayed import (
    Column,
    Columns,
    Contents,
    Result,
    SpikingResult,
    Variable,
    columns_of,
    udunits,
)
from fingerpad.core.errors import InputError
from fingerpad.core.phases import Phase, from_onset, ramp_and_hold_phases
from fingerpad.core.units import MS_PER_S, QUANTITY_UNITS, unit_of, with_unit
from fingerpad.core.values import (
    Count,
    Finite,
    FiniteMatrix,
    FiniteVector,
    FloatArray,
    Indices,
    Many,
    Numbers,
    Positive,
    TimesMs,
    TruthVector,
    Vector,
    Whole,
    choice,
    finite,
    float_array,
    increasing,
)

MOST_SHOWN = 8  # Numbers of a list that `repr` shows.

INTERVAL, COUNT = "interval", "count"
"""What a firing rate is: one over the mean interval, or spikes over the length of the window."""

STORED_ENERGY = "stored"
"""Name of the quantity that drives both terms of the current in the paper: strain energy density."""

CURRENT, RELATIVE_CURRENT = "current", "relative_current"
"""What charges a membrane: the current, or the current over that which just reaches the threshold."""

CURRENTS = (CURRENT, RELATIVE_CURRENT)  # Quantities that may jump and may be negative.


PLACES = {2: ("x_mm", "z_mm"), 3: ("x_mm", "y_mm", "z_mm")}
"""Columns of a position by the number of its coordinates."""


def _frozen(values: dict[Any, Any]) -> MappingProxyType[Any, Any]:
    """Read-only mapping; the class itself cannot be pickled by its name."""
    return MappingProxyType(values)


# Parts of populations and of responses by type are read-only mappings, which go to other processes.
copyreg.pickle(MappingProxyType, lambda mapping: (_frozen, (dict(mapping),)))


@runtime_checkable
class Skin(Protocol):
    """Any object that returns the strain energy density below points of its surface."""

    def sed(
        self, sites: ArrayLike, dynamic_quantity: str = STORED_ENERGY, static_quantity: str = STORED_ENERGY
    ) -> Traces:
        """Strain energy density over time below `sites` of the skin. [mm]

        Sites are x and z of end organs on the volar side (n_sites, 2), or x, y and z of the skin above them
        on any side (n_sites, 3). Another quantity may take the place of strain energy density in either term
        of the current.
        """
        ...


@value_class
class Traces(Result):
    """One quantity at receptor sites over time: of the skin, or the current that it drives.

    Examples
    --------
    >>> Traces([0.0, 50.0, 1000.0], [[0.0], [2.0], [1.8]])
    Traces(3 times to 1000 ms, 1 sites, stored at most 2 kPa)

    A current that drops from 2 to 1 µA after 50 ms:

    >>> Traces([0.0, 50.0, 50.0, 1000.0], [[2e-3], [2e-3], [1e-3], [1e-3]], quantity="current").unit
    'mA'
    """

    times_ms: FiniteVector
    """In order. A current may jump: its time is repeated once, with the values before and after. The times of
    any other quantity are strictly increasing, (n_times,). [ms]"""
    values: FiniteMatrix  #: Not negative, except those of a current, (n_times, n_sites). [`unit`]
    kinks_ms: TimesMs = field(default_factory=lambda: np.empty(0))
    """Those of `times_ms` at which the motion changes abruptly, as from ramp to hold: there the rate of
    change is discontinuous, and interpolation must not smooth it, (n_kinks,). [ms]"""
    quantity: Annotated[str, choice(QUANTITY_UNITS)] = STORED_ENERGY
    """What the values are: one of `SkinResponse.sample`, "current", or "relative_current" (over that of the
    threshold). By default strain energy density (SED), which drives both terms in the paper."""
    dynamic: Traces | None = None
    """Another quantity at the same times and sites, if the dynamic term of an afferent follows another one
    than the static term. Its kinks, phases and onset become those of these traces."""
    phases: Many[Phase] = ()
    """Named parts of the touch; by default one kink after the onset separates "ramp" and "hold"."""
    onset_ms: Finite = None  # type: ignore[assignment]  #: a number after initialisation
    """Time of first touch, from which phases and latencies count; interpolation does not smooth it either. By
    default the last time until which all values are 0. [ms]"""

    def __post_init__(self) -> None:
        times, values, kinks = self.times_ms, self.values, self.kinks_ms
        if values.shape[0] != times.size or times.size < 2:
            raise InputError(
                "Traces needs one row of values per time and at least two times: "
                f"got {values.shape} for {times.size} times."
            )
        if self.quantity in CURRENTS:
            if (np.diff(times) < 0.0).any() or (times[2:] == times[:-2]).any():
                raise InputError(
                    "times_ms", "must not decrease, nor repeat more than once", f"{times[:4]} .."
                )
        else:
            increasing("times_ms", times)
            if values.min(initial=0.0) < 0.0:
                smallest = with_unit(f"{values.min():.3g}", self.quantity, " {}")
                raise InputError("values", "must not be negative", remedy=f"the smallest is {smallest}")
        if not np.isin(kinks, times).all():
            raise InputError("kinks_ms", "must be among times_ms", str(kinks[~np.isin(kinks, times)]))
        if self.dynamic is not None:
            self._check_dynamic(self.dynamic)
        onset = self._first_touch_ms() if self.onset_ms is None else self.onset_ms
        object.__setattr__(self, "onset_ms", onset)
        phases, later = self.phases, kinks[kinks > onset]
        if not phases and later.size == 1 and onset >= 0.0 and later[0] < times[-1]:
            phases = ramp_and_hold_phases(float(later[0]), float(times[-1]), onset)
        object.__setattr__(self, "phases", from_onset(phases, onset))
        if self.dynamic is not None:
            dynamic = replace(self.dynamic, kinks_ms=kinks, phases=self.phases, onset_ms=onset)
            object.__setattr__(self, "dynamic", dynamic)

    def _check_dynamic(self, dynamic: Traces) -> None:
        if dynamic.quantity == self.quantity or dynamic.dynamic is not None:
            other = f"must hold another quantity than {self.quantity!r}, and one only"
            remedy = "leave it out where both terms follow one quantity"
            raise InputError("dynamic", other, repr(dynamic.quantity), remedy)
        if dynamic.values.shape != self.values.shape or (dynamic.times_ms != self.times_ms).any():
            shapes = [f"{each.values.shape} to {each.times_ms[-1]:g} ms" for each in (dynamic, self)]
            came = f"values of shape {' for '.join(shapes)}"
            raise InputError("dynamic", "must have the times and sites of the static term", came)

    def _first_touch_ms(self) -> float:
        """Last time until which all values are 0; the first time if there is none, or nothing is touched."""
        touched = self.values.any(axis=1)
        if self.dynamic is not None:
            touched |= self.dynamic.values.any(axis=1)
        return float(self.times_ms[max(int(touched.argmax()) - 1, 0)])

    @classmethod
    def joined(cls, traces: Sequence[Traces]) -> Traces:
        """Traces of several stimuli with the same times and quantities, one after the other as columns.

        Examples
        --------
        >>> halves = [Traces([0.0, 50.0], [[0.0], [height]]) for height in (1.0, 2.0)]
        >>> Traces.joined(halves).values.tolist()
        [[0.0, 0.0], [1.0, 2.0]]
        """
        if not traces:
            raise InputError("traces", "must have at least one entry", "none")
        dynamic = [trace.dynamic for trace in traces if trace.dynamic is not None]
        return replace(
            traces[0],
            values=np.hstack([trace.values for trace in traces]),
            dynamic=cls.joined(dynamic) if dynamic else None,
        )

    @classmethod
    def at_rest(
        cls, end_ms: Finite, dynamic_quantity: str = STORED_ENERGY, static_quantity: str = STORED_ENERGY
    ) -> Traces:
        """Traces of one site that is not touched: 0 from the start to `end_ms`.

        Examples
        --------
        >>> Traces.at_rest(1000.0).values.tolist()
        [[0.0], [0.0]]
        """
        times, nothing = np.array([0.0, end_ms]), np.zeros((2, 1))
        dynamic = None
        if dynamic_quantity != static_quantity:
            dynamic = cls(times, nothing, quantity=dynamic_quantity)
        return cls(times, nothing, quantity=static_quantity, dynamic=dynamic)

    def __repr__(self) -> str:
        highest = f"{self.quantity} at most {self.values.max(initial=0.0):.3g}"
        return (
            f"Traces({self.times_ms.size} times to {self.times_ms[-1]:g} ms, {self.n_sites} sites, "
            + with_unit(highest, self.quantity, " {}")
            + ")"
        )

    def columns(self) -> Columns:
        """Values, a column per site, by time; a time is repeated where a current jumps."""
        return {"time_ms": self.times_ms} | dict(enumerate(self.values.T))

    def contents(self) -> Contents:
        """Each quantity by time and site; a time is repeated where a current jumps."""
        terms = {
            each.quantity: (("time", "site"), each.values, {"units": udunits(each.unit)})
            for each in (self, self.dynamic_term)
        }
        return {"time": (("time",), self.times_ms, {"units": "ms"}), **terms}, {}

    @property
    def unit(self) -> str:
        """Unit of the values; empty for a strain and for a relative current."""
        return QUANTITY_UNITS[self.quantity]

    @property
    def n_sites(self) -> int:
        """Number of receptor sites."""
        return self.values.shape[1]

    @property
    def dynamic_term(self) -> Traces:
        """What the dynamic term follows: `dynamic`, or these traces where there is none."""
        return self if self.dynamic is None else self.dynamic

    @property
    def dynamic_quantity(self) -> str:
        """Quantity of the dynamic term."""
        return self.dynamic_term.quantity

    @property
    def static_quantity(self) -> str:
        """Quantity of the static term."""
        return self.quantity

    def with_values(self, change: Callable[[FloatArray], FloatArray]) -> Traces:
        """Traces whose values, those of both terms, are changed by a function.

        Examples
        --------
        >>> Traces([0.0, 50.0], [[0.0], [2.0]]).with_values(lambda values: 3.0 * values).values.tolist()
        [[0.0], [6.0]]
        """
        dynamic = None if self.dynamic is None else self.dynamic.with_values(change)
        return replace(self, values=change(self.values), dynamic=dynamic)

    def part(self, sites: slice | TruthVector) -> Traces:
        """Traces of some of the sites: of a slice, or where a mask (n_sites,) is true.

        Examples
        --------
        >>> Traces([0.0, 50.0], [[0.0, 0.0], [2.0, 3.0]]).part(np.array([False, True])).n_sites
        1
        """
        if isinstance(sites, slice) and sites == slice(0, self.n_sites):
            return self
        if not isinstance(sites, slice) and sites.size != self.n_sites:
            raise InputError("sites", f"must have one truth value per site, {self.n_sites}", str(sites.size))
        return self.with_values(lambda values: values[:, sites])

    def repeated(self, start_ms: Finite, count: Count) -> Traces:
        """Traces of the part from one of the times to the end, one after the other, from time 0.

        The part is one period of a motion: what its end has takes the place of what its start has.

        Examples
        --------
        >>> passed = Traces([0.0, 5.0, 10.0, 15.0], [[0.0], [2.0], [3.0], [2.5]])
        >>> twice = passed.repeated(5.0, count=2)
        >>> twice.times_ms.tolist(), twice.values.ravel().tolist()
        ([0.0, 5.0, 10.0, 15.0, 20.0], [2.5, 3.0, 2.5, 3.0, 2.5])
        """
        # A start that is there but for rounding is no time of the part.
        first = int(np.abs(self.times_ms - start_ms).argmin())
        if first == len(self.times_ms) - 1:
            raise InputError("start_ms", f"must be before the end, {self.times_ms[-1]:g} ms", f"{start_ms:g}")
        inside = slice(first + 1, None)
        since_ms = self.times_ms[inside] - self.times_ms[first]
        times_ms = np.append(0.0, np.arange(count)[:, None] * since_ms[-1] + since_ms)

        def again(values: FloatArray) -> FloatArray:
            return np.concatenate([values[-1:], np.tile(values[inside], (count, 1))])

        dynamic = self.dynamic
        if dynamic is not None:
            dynamic = Traces(times_ms, again(dynamic.values), quantity=dynamic.quantity)
        return Traces(times_ms, again(self.values), quantity=self.quantity, dynamic=dynamic)

    def scaled(self, factors: ArrayLike) -> Traces:
        """Traces with each site's values multiplied by a factor of its own, (n_sites,), not negative.

        Examples
        --------
        >>> Traces([0.0, 50.0], [[0.0, 0.0], [2.0, 2.0]]).scaled([1.0, 1.5]).values[-1].tolist()
        [2.0, 3.0]
        """
        each = float_array("factors", factors, 1)
        if each.size != self.n_sites:
            raise InputError("factors", "needs one number per site", f"{each.size} for {self.n_sites}")
        return self.with_values(lambda values: values * each)


def traces_below(
    skin: Skin,
    sites: ArrayLike,
    dynamic_quantity: str,
    static_quantity: str,
    depth_mm: ArrayLike | None = None,
) -> Traces:
    """Traces of two quantities below sites of a skin, by default on the border of epidermis and dermis."""
    if not callable(getattr(skin, "sed", None)):
        raise InputError(
            "skin", "must have a method sed(sites), as a solved indentation has", f"{skin!r:.60}"
        )
    depth = {} if depth_mm is None else {"depth_mm": depth_mm}
    followed = dynamic_quantity, static_quantity
    quantities = followed if depth or followed != (STORED_ENERGY, STORED_ENERGY) else ()
    try:
        signature(skin.sed).bind(sites, *quantities, **depth)
    except TypeError as error:
        must, remedy = "depth_mm, since end organs have a depth", "add it, or leave out the depth"
        if not depth:
            must = "dynamic_quantity and static_quantity, since the afferent follows {!r} and {!r}"
            remedy = f"add them, or use an afferent that follows {STORED_ENERGY!r}, such as "
            remedy += "Afferent.for_tissues('paper')"
        came = f"{type(skin).__name__}.sed{signature(skin.sed)}"
        raise InputError("skin.sed", f"must accept {must.format(*followed)}", came, remedy) from error
    sed: Any = skin.sed
    return sed(sites, *quantities, **depth)


def window_bounds(window_ms: Sequence[float]) -> tuple[float, float]:
    """Return start and end of a window, or raise `InputError`."""
    bounds = [finite("window_ms", bound, "ms") for bound in window_ms]
    if len(bounds) != 2 or bounds[1] <= bounds[0]:
        raise InputError("window_ms", "must be a start and a later end", repr(window_ms))
    return bounds[0], bounds[1]


@value_class
class SpikeTrains(SpikingResult):
    """Spike times of several afferents, one after the other in one array.

    Examples
    --------
    >>> trains = SpikeTrains.from_lists([[1.0, 2.5], [], [4.0]])
    >>> [train.tolist() for train in trains]
    [[1.0, 2.5], [], [4.0]]
    """

    times_ms: FiniteVector  #: Afferent by afferent, increasing within each, (n_spikes,). [ms]
    offsets: Indices  #: Afferent `i` has `times_ms[offsets[i]:offsets[i + 1]]`, (n_afferents + 1,).

    def __post_init__(self) -> None:
        times, offsets = self.times_ms, self.offsets
        if offsets.size == 0 or offsets[0] != 0 or offsets[-1] != times.size:
            raise InputError(
                "offsets", f"must run from 0 to the number of spikes, {times.size}", str(offsets)
            )
        if (np.diff(offsets) < 0).any():
            raise InputError("offsets", "must not decrease", str(offsets))
        falls = np.diff(times) <= 0.0
        falls[offsets[(offsets > 0) & (offsets < times.size)] - 1] = False  # from one train to the next
        if falls.any():
            where = f"it does not at {times[1:][falls][:4]}"
            raise InputError("times_ms", "must increase within each afferent", remedy=where)

    def __repr__(self) -> str:
        return f"SpikeTrains({self.times_ms.size} spikes of {len(self)} afferents)"

    @classmethod
    def from_lists(cls, trains: Sequence[ArrayLike]) -> SpikeTrains:
        """Spike trains from one sequence of spike times per afferent. [ms]"""
        arrays = [float_array(f"trains[{number}]", train, 1) for number, train in enumerate(trains)]
        offsets = np.concatenate([[0], np.cumsum([array.size for array in arrays])])
        return cls(np.concatenate(arrays) if arrays else np.empty(0), offsets)

    @classmethod
    def joined(cls, parts: Sequence[SpikeTrains]) -> SpikeTrains:
        """Trains of several groups of afferents, one group after the other.

        Examples
        --------
        >>> halves = SpikeTrains.from_lists([[1.0], []]), SpikeTrains.from_lists([[4.0, 5.0]])
        >>> [train.tolist() for train in SpikeTrains.joined(halves)]
        [[1.0], [], [4.0, 5.0]]
        """
        if len(parts) == 1:
            return parts[0]
        counts = [np.diff(part.offsets) for part in parts]
        offsets = np.concatenate([[0], np.cumsum(np.concatenate(counts))]) if parts else np.zeros(1, int)
        return cls(np.concatenate([part.times_ms for part in parts]) if parts else np.empty(0), offsets)

    def columns(self) -> Columns:
        """Spikes, by afferent."""
        return {"afferent": np.repeat(np.arange(len(self)), self.counts), "time_ms": self.times_ms}

    @property
    def counts(self) -> np.ndarray:
        """Number of spikes of each afferent, (n_afferents,)."""
        return np.diff(self.offsets)

    def counted_hz(self, window_ms: Sequence[float]) -> FloatArray:
        """Spikes of each afferent in a window over its length, (n_afferents,). [spikes/s]

        The window excludes its start and includes its end.

        Examples
        --------
        >>> SpikeTrains.from_lists([[10.0, 35.0, 50.0], [45.0], []]).counted_hz((30.0, 50.0)).tolist()
        [100.0, 50.0, 0.0]
        """
        start, end = window_bounds(window_ms)
        inside = np.cumsum(np.append(0, (self.times_ms > start) & (self.times_ms <= end)))
        return MS_PER_S * np.diff(inside[self.offsets]) / (end - start)

    def __len__(self) -> int:
        return self.offsets.size - 1

    def __iter__(self) -> Iterator[FloatArray]:
        return (self[afferent] for afferent in range(len(self)))

    def __getitem__(self, afferent: int) -> FloatArray:
        if not 0 <= afferent < len(self):
            raise IndexError(f"afferent must be within 0 ... {len(self) - 1}: got {afferent}.")
        return self.times_ms[self.offsets[afferent] : self.offsets[afferent + 1]]


@value_class
class ResponseMap(SpikingResult):
    """Response of a population of afferents to one touch.

    A mixed population has one response per type: `{name: response[name] for name in response}`.
    """

    positions_mm: FiniteMatrix
    """x (distal positive) and z (lateral) of each end organ, or x, y and z of the skin above it,
    (n_receptors, 2 or 3). [mm]"""
    pitch_mm: Positive  #: Distance between neighbours of the layout. [mm]
    spikes: SpikeTrains  #: One train per receptor.
    dynamic_rate_hz: Annotated[FiniteVector, Column("firing rate in the ramp")]
    static_rate_hz: Annotated[FiniteVector, Column("firing rate in the hold")]
    """Firing rates in the two windows, as `rate_measure` says, (n_receptors,). [spikes/s]"""
    first_spike_latency_ms: Annotated[Vector, Column("time from first touch to the first spike", holes=True)]
    """NaN without a spike, (n_receptors,). [ms]"""
    duration_ms: Positive | None = None  #: How long the touch lasted, if that is known. [ms]
    phases: Many[Phase] = ()  #: Named parts of the touch.
    windows_ms: tuple[Numbers, Numbers] | None = None  #: Windows of the two rates, if they are known. [ms]
    rate_measure: Annotated[str, choice((INTERVAL, COUNT))] = INTERVAL
    """What the rates are: "interval", one over the mean interval between spikes, Eqs. 6-10, which is 0
    without an interval; or "count", spikes over the length of the window."""
    quantity: str = STORED_ENERGY  #: What the static term of the afferents follows.
    parts: Mapping[str, ResponseMap] = field(default_factory=lambda: MappingProxyType({}))
    """Response of each type of a mixed population, in the order of the receptors; from `joined`."""

    @classmethod
    def joined(cls, parts: Mapping[str, ResponseMap]) -> ResponseMap:
        """Join responses of several types of afferents, by their names, to the same touch."""
        maps = list(parts.values())
        measures: dict[str, Any] = {
            name: np.concatenate([each.measures[name] for each in maps]) for name in maps[0].measures
        }
        return replace(
            maps[0],
            positions_mm=np.concatenate([each.positions_mm for each in maps]),
            pitch_mm=min(each.pitch_mm for each in maps),
            spikes=SpikeTrains.joined([each.spikes for each in maps]),
            parts=MappingProxyType(dict(parts)),
            **measures,
        )

    def of_types(self, types: Sequence[str], pitches_mm: ArrayLike | None = None) -> ResponseMap:
        """Part a response of one map by the type of each receptor, for example as a file tells them.

        Parameters
        ----------
        types : sequence of str
            One per receptor; those of a type follow each other. Empty for a response as it is.
        pitches_mm : array_like (n_receptors,), optional
            Distance between neighbours of the same type; by default that of the map. [mm]
        """
        if not len(types):
            return self
        if len(types) != len(self.spikes):
            raise InputError("types", f"needs one per receptor, {len(self.spikes)}", str(len(types)))
        pitches = np.full(len(types), self.pitch_mm) if pitches_mm is None else np.asarray(pitches_mm)
        parts = {}
        for name in dict.fromkeys(types):
            rows = np.flatnonzero(np.array(types) == name)
            measures: dict[str, Any] = {key: values[rows] for key, values in self.measures.items()}
            parts[name] = replace(
                self,
                positions_mm=self.positions_mm[rows],
                pitch_mm=float(pitches[rows[0]]),
                spikes=SpikeTrains.from_lists([self.spikes[row] for row in rows.tolist()]),
                **measures,
            )
        return self.joined(parts)

    @property
    def types(self) -> tuple[str, ...]:
        """Type of each receptor of a mixed population; empty where all are of one type."""
        return tuple(name for name, part in self.parts.items() for _ in range(len(part.spikes)))

    @property
    def pitches_mm(self) -> FloatArray:
        """Distance between neighbours of the same type, of each receptor, (n_receptors,). [mm]"""
        several = list(self.parts.values()) or [self]
        return np.repeat([each.pitch_mm for each in several], [len(each.spikes) for each in several])

    def __iter__(self) -> Iterator[str]:
        """Names of the types of a mixed population."""
        return iter(self.parts)

    def __getitem__(self, name: str) -> ResponseMap:
        if name not in self.parts:
            known = ", ".join(self.parts) or "a mixed population"
            raise InputError("type", f"must be one of {known}", repr(name))
        return self.parts[name]

    @property
    def measures(self) -> dict[str, FloatArray]:
        """What was measured of each receptor, by name: every array (n_receptors,)."""
        values = {each.name: getattr(self, each.name) for each in fields(self)}
        return {
            name: value for name, value in values.items() if isinstance(value, np.ndarray) and value.ndim == 1
        }

    def __repr__(self) -> str:
        firing = np.count_nonzero(self.spike_count)
        if self.parts:
            counts = {name: each.spike_count for name, each in self.parts.items()}
            parts = (f"{np.count_nonzero(n)} of {n.size} {name} fire {n.sum()}" for name, n in counts.items())
            return f"ResponseMap({', '.join(parts)} spikes)"
        return (
            f"ResponseMap({firing} of {len(self.spikes)} afferents fire {self.spikes.times_ms.size} spikes, "
            f"at most {self.dynamic_rate_hz.max(initial=0.0):.3g} spikes/s in the ramp and "
            f"{self.static_rate_hz.max(initial=0.0):.3g} spikes/s in the hold)"
        )

    def columns(self) -> Columns:
        """Place, type, and each `Column` of this class, by receptor."""
        return {
            "receptor": np.arange(len(self.spikes)),
            **({"type": np.array(self.types, dtype=object)} if self.types else {}),
            **dict(zip(PLACES[self.positions_mm.shape[1]], self.positions_mm.T, strict=True)),
            "pitch_mm": self.pitches_mm,
            **{name: getattr(self, name) for name in RECEPTOR_COLUMNS},
        }

    def contents(self) -> Contents:
        """Receptors, and spikes as a contiguous ragged array of the CF conventions."""
        place = {"long_name": "place of each end organ", "units": "mm"}
        found: dict[str, Variable] = {"receptor_mm": (("receptor", "coordinate"), self.positions_mm, place)}
        if self.types:
            words = {"long_name": "type of each afferent"}
            found["type"] = (("receptor",), np.array(self.types, dtype=object), words)
        for name, column in RECEPTOR_COLUMNS.items():
            values = getattr(self, name)
            words = {"long_name": column.long_name, "units": udunits(unit_of(name))}
            found[name] = (("receptor",), values.astype("i4" if values.dtype.kind == "i" else "f8"), words)
        found["spike_count"][2]["sample_dimension"] = "spike"
        words = {"long_name": "spike times, receptor by receptor", "units": "ms"}
        return {**found, "spike_time_ms": (("spike",), self.spikes.times_ms, words)}, {}

    @property
    def spike_count(self) -> Annotated[np.ndarray, Column("number of spikes of each receptor")]:
        """Spikes of each afferent in the whole touch, (n_receptors,)."""
        return self.spikes.counts

    @property
    def dynamic_count_hz(self) -> Annotated[FloatArray, Column("spikes in the ramp over its window", True)]:
        """Spikes in the dynamic window over its length, (n_receptors,); NaN if it is not known. [spikes/s]"""
        return self._counted_hz(0)

    @property
    def static_count_hz(self) -> Annotated[FloatArray, Column("spikes in the hold over its window", True)]:
        """Spikes in the static window over its length, (n_receptors,); NaN if it is not known. [spikes/s]"""
        return self._counted_hz(1)

    @property
    def recruitment_rank(self) -> Annotated[FloatArray, Column("rank in the order of first spikes", True)]:
        """Rank in the order of first spikes, from 1, (n_receptors,); NaN without a spike."""
        from scipy.stats import rankdata  # loads for a second

        return np.asarray(rankdata(self.first_spike_latency_ms, nan_policy="omit"))

    def _counted_hz(self, number: int) -> FloatArray:
        if self.windows_ms is None:
            return np.full(len(self.spikes), np.nan)
        return self.spikes.counted_hz(self.windows_ms[number])

    def __post_init__(self) -> None:
        for window in self.windows_ms or ():
            window_bounds(window)
        n, columns = self.positions_mm.shape
        if columns not in (2, 3):
            raise InputError(
                "positions_mm", "needs columns x and z, or x, y and z", f"shape {self.positions_mm.shape}"
            )
        for name, size in (
            ("spikes", len(self.spikes)),
            ("dynamic_rate_hz", self.dynamic_rate_hz.size),
            ("static_rate_hz", self.static_rate_hz.size),
            ("first_spike_latency_ms", self.first_spike_latency_ms.size),
        ):
            if size != n:
                raise InputError(f"ResponseMap needs one entry of {name} per receptor: got {size} for {n}.")


RECEPTOR_COLUMNS = columns_of(ResponseMap)
"""What a response says of each receptor beside its place, type and spikes, by the name of the attribute."""


@value_class
class HitRates(Result):
    """Hit rate of each comparison with the standard."""

    hit_rate: FiniteVector  #: Mean fraction of correct judgements, mu_3, (n_comparisons,). [0-1]
    hit_rate_sd: FiniteVector  #: Its standard deviation over repetitions, sigma_3, (n_comparisons,). [0-1]
    seed: Whole | None = None
    session: Whole = 0  #: Key of the random numbers of the noise and the observer, with the seed.

    def __post_init__(self) -> None:
        mean, spread = self.hit_rate, self.hit_rate_sd
        if mean.shape != spread.shape:
            raise InputError(f"hit_rate and hit_rate_sd must match: got {mean.shape} and {spread.shape}.")
        if ((mean < 0) | (mean > 1)).any() or (spread < 0).any():
            raise InputError("hit_rate", "must lie within 0 ... 1 and hit_rate_sd must not be negative")

    def columns(self) -> Columns:
        """Hit rate and its standard deviation, by comparison."""
        comparison = np.arange(1, self.hit_rate.size + 1)
        return {"comparison": comparison, "hit_rate": self.hit_rate, "hit_rate_sd": self.hit_rate_sd}

    def __repr__(self) -> str:
        rates = ", ".join(f"{rate:.2f}" for rate in self.hit_rate[:MOST_SHOWN])
        more = f" and {self.hit_rate.size - MOST_SHOWN} more" if self.hit_rate.size > MOST_SHOWN else ""
        return f"HitRates({rates}{more} of 1, seed {self.seed})"
