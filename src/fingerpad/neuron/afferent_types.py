"""Types of afferents: SAI, RA, PC, SAII, each a row of `fingerpad.data.afferents.TYPES`, and one's own.

Whatever names the quantities of the skin that it follows and makes spikes of their traces is an afferent
(`fingerpad.neuron.afferent.AnyAfferent`). RA and PC share one chain:

    quantity Q -> band pass -> rectification -> leaky membrane -> spikes
    i = (max(q, 0) + r max(-q, 0)) / threshold,
    tau du/dt = i (1 + s) / (1 + s i) - u,    spike and reset at u = 1,

with the band-passed quantity q, r the share of retraction, and s the saturation. Both are silent in a hold,
because a band pass transmits no constant. SAII has the chain of SAI (Eqs. 1-5), but follows the stretch of
the skin.
"""

from __future__ import annotations

from collections.abc import Callable, Mapping
from dataclasses import replace
from types import MappingProxyType
from typing import Annotated, Any, ClassVar, cast

import numpy as np

from fingerpad.core.checked import checked, value_class
from fingerpad.core.errors import InputError, shown
from fingerpad.core.signals import (
    COUNT,
    CURRENTS,
    INTERVAL,
    RELATIVE_CURRENT,
    STORED_ENERGY,
    SpikeTrains,
    Traces,
)
from fingerpad.core.values import Finite, FloatArray, NotNegative, Positive, Share, Whole, choice
from fingerpad.data.afferents import TYPES
from fingerpad.data.tissues import DEFAULT_TISSUES
from fingerpad.neuron.afferent import Afferent, AnyAfferent, SkinQuantity, check_quantities, spikes_where
from fingerpad.neuron.band_pass import BandPass
from fingerpad.neuron.lif import LeakyIntegrateAndFire
from fingerpad.neuron.transduction import saturated


@value_class
class RapidlyAdapting:
    """Afferent that follows the band-passed and rectified course of one quantity: the chain of RA and PC."""

    rate_measure: ClassVar[str] = COUNT
    """Many of these afferents fire once or twice in a ramp, without an interval to measure."""

    threshold: Positive
    """Band-passed quantity that, if it stayed, would just bring the membrane to its threshold. [kPa, or the
    unit of the quantity]"""
    corner_hz: Finite  #: Corner frequency of the band pass. [Hz]
    rise: Whole
    fall: Whole  #: Its powers of the frequency below and above the corner.
    retraction: Share  #: Share of the response to a decreasing quantity, 0 to 1. [1]
    membrane_ms: Finite  #: Time constant of the membrane. [ms]
    refractory_ms: Finite  #: Refractory period. [ms]
    quantity: str  #: What is followed, by the names of `SkinResponse.sample`.
    saturation: NotNegative = 0.0
    """Saturation s: i thresholds at the end organ charge the membrane as i (1 + s) / (1 + s i). [1]"""
    type: str = "rapidly adapting"  #: Name of its type.

    def __post_init__(self) -> None:
        # Both stages check their parameters when they are made.
        self.band_pass, self.membrane  # noqa: B018

    @property
    def band_pass(self) -> BandPass:
        """The first stage."""
        return BandPass(self.corner_hz, self.rise, self.fall)

    @property
    def membrane(self) -> LeakyIntegrateAndFire:
        """The last stage; with its capacitance equal to the time constant, its resistance is 1."""
        return LeakyIntegrateAndFire(self.membrane_ms, self.membrane_ms, 1.0, self.refractory_ms)

    @property
    def dynamic_quantity(self) -> str:
        """What is followed; both terms have the same quantity."""
        return self.quantity

    static_quantity = dynamic_quantity

    def current(self, traces: Traces) -> Traces:
        """Band-passed and rectified quantity over the threshold at every site, in place of a current."""
        times_ms, passed = self.band_pass.of(traces)
        return Traces(times_ms, self.rectified(passed), quantity=RELATIVE_CURRENT)

    def rectified(self, passed: FloatArray) -> FloatArray:
        """Rectify what the band pass transmits, over the threshold, and let it saturate. [1]"""
        both = (np.maximum(passed, 0.0) + self.retraction * np.maximum(-passed, 0.0)) / self.threshold
        return (1.0 + self.saturation) * saturated(both, self.saturation)

    def spikes(self, traces: Traces) -> SpikeTrains:
        """Simulate the spikes of this afferent at every site."""
        check_quantities(self, traces)
        # Most of the skin moves too little for a spike; a current below 1 never reaches the threshold.
        may_fire = self.band_pass.largest_share * np.ptp(traces.values, axis=0) > self.threshold
        return spikes_where(may_fire, traces, lambda some: self.membrane.spikes(self.current(some)))


CHAINS: Mapping[str, type[Afferent] | type[RapidlyAdapting]] = MappingProxyType(
    {"slow": Afferent, "rapid": RapidlyAdapting}
)
"""From the skin to the spikes, by the names that the rows of `fingerpad.data.afferents.TYPES` give."""


@checked
def afferent_of(
    type_name: Annotated[str, choice(TYPES)], tissues: Any = DEFAULT_TISSUES, **numbers: Any
) -> Afferent | RapidlyAdapting:
    """Return an afferent of a type by its name: a row of `fingerpad.data.afferents.TYPES`.

    `SAI`, `RA`, `PC` and `SAII` are this function with the name of a row.

    Parameters
    ----------
    type_name : str
        "SAI", "RA", "PC", "SAII", or another row.
    tissues : str or Tissues, optional
        Those with which an SAI was fitted, as of `Afferent.for_tissues`.
    **numbers
        Numbers that replace those of the row, by the names of the fields of `Afferent` or `RapidlyAdapting`.

    Examples
    --------
    >>> afferent_of("RA", threshold=0.2).threshold, afferent_of("SAI").smoothing_ms
    (0.2, 17.0)
    """
    row = TYPES[type_name]
    values: dict[str, Any] = {"type": type_name} | row.values | numbers
    if row.of_tissues:
        return replace(Afferent.for_tissues(tissues), **values)
    return CHAINS[row.chain](**values)


@checked
def SAI(**numbers: Any) -> Afferent:
    """Return a slowly adapting type I (SAI) afferent that is also right under vibration.

    It is the fitted `Afferent` with a low pass, `smoothing_ms`. Without it, as in a request that names no
    afferent and in the laboratory, SAI means `Afferent.for_tissues`: right under the ramps to which it was
    fitted. There the rates of this one are 2 to 32 % lower under a ball and a bar, and 0 where the others are
    below 50 spikes/s; those in a hold are equal.

    Examples
    --------
    >>> from fingerpad.neuron.tuning import tuning_curve
    >>> tuning_curve(SAI(), [10.0, 100.0], per_um=(0.001, 0.03)).round(-1).tolist()
    [30.0, 240.0]
    >>> tuning_curve(Afferent(), [10.0, 100.0], per_um=(0.001, 0.03)).round(-1).tolist()
    [20.0, 30.0]
    """
    return cast(Afferent, afferent_of("SAI", **numbers))


@checked
def RA(**numbers: Any) -> RapidlyAdapting:
    """Return a rapidly adapting afferent (RA, FA-I), which ends in Meissner corpuscles.

    It responds to the speed at which the compressive stress at its end organ changes, most to 8 to 64 Hz, and
    is silent in a hold.

    Examples
    --------
    Compressive stress rises by 5 kPa in 50 ms and stays:

    >>> stress = Traces([0.0, 50.0, 1000.0], [[0.0], [5.0], [5.0]], kinks_ms=[50.0],
    ...                 quantity="compressive_stress")
    >>> spikes = RA().spikes(stress)[0]
    >>> bool(spikes.size > 2), bool((spikes < 100.0).all())
    (True, True)
    """
    return cast(RapidlyAdapting, afferent_of("RA", **numbers))


@checked
def PC(**numbers: Any) -> RapidlyAdapting:
    """Return a Pacinian afferent (PC, FA-II).

    It responds to vibration of the skin above 64 Hz, most at 200 to 400 Hz, and is silent in a hold. It
    follows how far the skin within 3 mm has moved, because its corpuscle lies deep. Its threshold is in mm.

    Examples
    --------
    The tissue vibrates by 5 µm about 0.5 mm, at 250 Hz and at 10 Hz:

    >>> times_ms = np.arange(0.0, 400.0, 0.2)
    >>> def moved(frequency_hz):
    ...     course = 0.5 + 0.005 * np.sin(2e-3 * np.pi * frequency_hz * times_ms)
    ...     return Traces(times_ms, course[:, None], quantity="deep_displacement")
    >>> PC().spikes(moved(250.0))[0].size > 80, PC().spikes(moved(10.0))[0].size
    (True, 0)
    """
    return cast(RapidlyAdapting, afferent_of("PC", **numbers))


@checked
def SAII(**numbers: Any) -> Afferent:
    """Return a slowly adapting type II (SAII) afferent, which follows the stretch of the skin.

    Its chain is that of `SAI`, with the largest tensile strain within the skin in both terms; its gains refer
    to strain.

    Examples
    --------
    The skin is stretched by 5 % in 50 ms and stays:

    >>> stretch = Traces([0.0, 50.0, 1000.0], [[0.0], [0.05], [0.05]], kinks_ms=[50.0],
    ...                  quantity="skin_stretch")
    >>> dynamic_hz, static_hz = SAII().rates(stretch)
    >>> bool(dynamic_hz[0] > static_hz[0] > 5.0)
    True
    """
    return cast(Afferent, afferent_of("SAII", **numbers))


def afferent_types(tissues: object = DEFAULT_TISSUES) -> dict[str, AnyAfferent]:
    """Return an afferent of each type by its name, SAI as it was fitted with a set of tissues."""
    return {name: afferent_of(name, tissues) for name in TYPES}


@value_class
class OwnAfferent:
    """An afferent of one's own: a function of the traces of the skin that returns current or spikes.

    Examples
    --------
    One spike when strain energy density first exceeds 1 kPa:

    >>> def first(traces):
    ...     return SpikeTrains.from_lists([
    ...         traces.times_ms[course > 1.0][:1] for course in traces.values.T
    ...     ])
    >>> traces = Traces([0.0, 25.0, 50.0], [[0.0, 0.0], [0.5, 1.5], [0.9, 3.0]])
    >>> [train.tolist() for train in OwnAfferent(first).spikes(traces)]
    [[], [25.0]]
    """

    respond: Callable[[Traces], Traces | SpikeTrains]
    """From `Traces` of the skin, a column per site, to `Traces` of a current or to `SpikeTrains`."""
    membrane: LeakyIntegrateAndFire | None = None
    """Membrane that a current charges; needed if `respond` returns a current."""
    dynamic_quantity: SkinQuantity = STORED_ENERGY
    static_quantity: SkinQuantity = STORED_ENERGY
    """What the traces hold, by the names of `SkinResponse.sample`; SED, unless another one is given."""
    rate_measure: Annotated[str, choice((INTERVAL, COUNT))] = INTERVAL
    """What its rates are, as of `ResponseMap`: "interval", or "count"."""
    type: str = "own"  #: Name of the type.

    MUST_RETURN: ClassVar[str] = "respond must return Traces of a current, or SpikeTrains, an entry per site"

    def __post_init__(self) -> None:
        if not callable(self.respond):
            raise InputError("respond", "must be a function of Traces", shown(self.respond))

    def spikes(self, traces: Traces) -> SpikeTrains:
        """Spikes at every site."""
        check_quantities(self, traces)
        given = self.respond(traces)
        if isinstance(given, Traces) and given.quantity in CURRENTS:
            if self.membrane is None:
                raise InputError(
                    "OwnAfferent needs a membrane because respond returns a current: got none; give "
                    "membrane=LeakyIntegrateAndFire(...), or let respond return SpikeTrains."
                )
            given = self.membrane.spikes(given)
        if not isinstance(given, SpikeTrains) or len(given) != traces.n_sites:
            got = f"{len(given)} trains" if isinstance(given, SpikeTrains) else shown(given)
            raise InputError(f"{self.MUST_RETURN}, {traces.n_sites} in all: got {got}.")
        return given
