"""A slowly adapting afferent: strain energy density -> current -> spikes -> rates (paper, Eqs. 1-10)."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import replace
from typing import Annotated, Any, ClassVar, Protocol, runtime_checkable

import numpy as np
from numpy.typing import ArrayLike

from fingerpad.core.checked import value_class
from fingerpad.core.errors import InputError, shown
from fingerpad.core.signals import INTERVAL, STORED_ENERGY, SpikeTrains, Traces
from fingerpad.core.threads import in_blocks
from fingerpad.core.units import SKIN_QUANTITY_UNITS, gain_unit, units_of
from fingerpad.core.values import Count, Finite, FloatArray, NotNegative, Positive, Share, choice, float_array
from fingerpad.data import neuron
from fingerpad.neuron.band_pass import continued_stage, resampled, smoothed_rate
from fingerpad.neuron.lif import LeakyIntegrateAndFire
from fingerpad.neuron.spikes import Window, firing_rate_hz, rate_windows_ms
from fingerpad.neuron.transduction import Drive, Transduction, drive, saturated

PARAMETER_NAMES = (
    "intercept_ma",
    "dynamic_gain",
    "static_gain",
    "time_constant_ms",
    "capacitance_mf",
    "threshold_mv",
)
"""The six fitted numbers in the paper's order: beta, k_d, k_s, tau, C, v."""

SkinQuantity = Annotated[str, choice(SKIN_QUANTITY_UNITS)]
"""What a term of the current may follow, by the names of `SkinResponse.sample`."""

_SITES_PER_BLOCK = 256
"""Sites that a thread takes through the whole chain at once: their traces stay in the cache."""

_SURELY_SILENT = 1.0 - 1e-9  # Share of the rheobase below which round-off cannot elicit a spike.


@runtime_checkable
class Follows(Protocol):
    """Anything that has two terms, each with the quantity of the skin that it follows or holds."""

    @property
    def dynamic_quantity(self) -> str:
        """Quantity of the dynamic term, by the names of `SkinResponse.sample`."""

    @property
    def static_quantity(self) -> str:
        """Quantity of the static term."""


class AnyAfferent(Follows, Protocol):
    """What a population needs of an afferent: the quantities that it follows, and spikes."""

    def spikes(self, traces: Traces) -> SpikeTrains:
        """Simulate the spikes at every site."""


EXTENSIONS: dict[str, Any] = {
    "dynamic_quantity": STORED_ENERGY,
    "static_quantity": STORED_ENERGY,
    "adapting_share": 0.0,
    "adapting_ms": neuron.HUMAN_ADAPTING_TIME.value,
    "saturation_per_ma": 0.0,
    "end_organs": 1,
    "reach_mm": 0.0,
    "noise_offset_hz": 0.0,
}
"""Fields that extend the paper's afferent, with what makes them its own."""


def checked_afferent(afferent: AnyAfferent) -> AnyAfferent:
    """Return an afferent, or raise `InputError` if it is none: a class without parameters, for example."""
    needed = "dynamic_quantity", "static_quantity", "spikes"
    if isinstance(afferent, type) or not all(hasattr(afferent, name) for name in needed):
        wanted = "must be one such as Afferent(), RA(), PC(), SAII() or OwnAfferent(...)"
        raise InputError("afferent", wanted, shown(afferent))
    return afferent


def check_quantities(afferent: Follows, traces: Follows) -> None:
    """Raise `InputError` if traces hold other quantities than an afferent follows."""
    for name in ("dynamic_quantity", "static_quantity"):
        needed, got = getattr(afferent, name), getattr(traces, name, type(traces).__name__)
        if needed != got:
            raise InputError(
                f"The {name.partition('_')[0]} term of this afferent needs {needed!r}: got traces of "
                f"{got!r}; sample the skin with {name}={needed!r}, or use an afferent that follows "
                f"{got!r}, such as Afferent.for_tissues('paper') for {STORED_ENERGY!r}."
            )


def parameter_units(follows: Follows) -> dict[str, str]:
    """Return the units of the six fitted numbers; those of the gains depend on the quantities."""
    return {
        "intercept_ma": "mA",
        "dynamic_gain": gain_unit("dynamic_gain", follows.dynamic_quantity),
        "static_gain": gain_unit("static_gain", follows.static_quantity),
    } | units_of(PARAMETER_NAMES[3:])


def type_of(afferent: object) -> str:
    """Name of the type of an afferent: that of its class where it has none."""
    return str(getattr(afferent, "type", type(afferent).__name__))


@value_class
class Afferent:
    """A slowly adapting type I (SAI) afferent.

    This is the model of the paper, without a low pass; `SAI()` has one and is also right under vibration.
    The defaults are the fit with the default tissues, `human`, to the recordings under the shifted bar and to
    areas of receptive fields (`fingerpad.data.neuron`, names that begin with HUMAN). They hold for the finger
    and the tissues with which they were fitted; `for_tissues` has those of other sets.

    Examples
    --------
    SED rises to 2 kPa in 50 ms and stays: the rate is high in the ramp and low in the hold.

    >>> traces = Traces([0.0, 50.0, 1000.0], [[0.0], [2.0], [2.0]], kinks_ms=[50.0])
    >>> dynamic_hz, static_hz = Afferent.for_tissues("trial3").rates(traces)
    >>> dynamic_hz.round().tolist(), static_hz.round().tolist()
    ([217.0], [63.0])
    """

    rate_measure: ClassVar[str] = INTERVAL  #: What its rates are, as of `ResponseMap`: those of Eqs. 6-10.

    intercept_ma: Finite = neuron.HUMAN_INTERCEPT.value  #: Current without any load, beta. [mA]
    dynamic_gain: Finite = neuron.HUMAN_DYNAMIC_GAIN.value
    """Gain on the rate of change of what the dynamic term follows, k_d. [mA ms/kPa, or per its unit]"""
    static_gain: Finite = neuron.HUMAN_STATIC_GAIN.value
    """Gain on what the static term follows, k_s. [mA/kPa, or per its unit]"""
    time_constant_ms: Finite = neuron.HUMAN_TIME_CONSTANT.value  #: Time constant of the membrane, tau. [ms]
    capacitance_mf: Finite = neuron.CAPACITANCE.value  #: Capacitance of the membrane, C. [mF]
    threshold_mv: Finite = neuron.THRESHOLD.value  #: Potential that elicits a spike, v. [mV]
    refractory_ms: Finite = neuron.REFRACTORY.value  #: Refractory period after each spike. [ms]
    dynamic_quantity: SkinQuantity = neuron.HUMAN_DYNAMIC_QUANTITY
    static_quantity: SkinQuantity = neuron.HUMAN_STATIC_QUANTITY
    """What the two terms follow, by the names of `SkinResponse.sample`: strain energy density (SED),
    "stored", and von Mises stress, unless others are given. The paper's is SED in both; any other is an
    extension of its model. The units of k_d and k_s depend on them."""
    initial_mv: Finite | None = None
    """Potential of the membrane at the start. By default that at rest, beta tau/C, so that spikes do not
    depend on how long nothing happened before a touch. [mV]"""
    smoothing_ms: NotNegative = 0.0
    """Time constant tau_s of a low pass before the dynamic term, which then follows the absolute rate of S
    with tau_s dS/dt + S = Q; 0, as in the paper, for none. It makes an afferent right under vibration: the
    rate of change of a fast one would otherwise make it as sensitive at 400 Hz as at 20 Hz. [ms]"""
    adapting_share: Share = neuron.HUMAN_ADAPTING_SHARE.value
    """Share a of the static term P that is lost while it lasts, as the generator current of Merkel cells
    adapts: k_s (P - a R) with tau_a dR/dt + R = P. The paper's does not adapt. [1]"""
    adapting_ms: Positive = neuron.HUMAN_ADAPTING_TIME.value  #: Time constant of that loss, tau_a. [ms]
    saturation_per_ma: NotNegative = neuron.HUMAN_SATURATION.value
    """Saturation s of the sum G of both terms, I = beta + G / (1 + s abs(G)). Recorded SAI afferents saturate
    (Ge & Khalsa 2002, J Neurophysiol 87:1686). The paper's has none, 0. [1/mA]"""
    end_organs: Count = int(neuron.HUMAN_END_ORGANS.value)
    reach_mm: NotNegative = neuron.HUMAN_REACH.value
    """End organs of each afferent of a population, and the radius of the disc that they fill, as of
    `EndOrgans.about`. The paper's afferent has one. [mm]"""
    noise_offset_hz: NotNegative = neuron.HUMAN_NOISE_OFFSET.value
    """Rate r_0 below which the rates vary between trials by an amount that hardly depends on them, as the
    numbers of spikes in recordings do: `fingerpad.psychophysics.Noise`. The paper's noise multiplies.
    [spikes/s]"""
    type: str = "SAI"  #: Name of its type, of `fingerpad.data.afferents.TYPES` or of one's own.

    def __post_init__(self) -> None:
        # Both stages check their parameters when they are made.
        self.transduction, self.membrane  # noqa: B018
        if self.adapting_share == 1.0:
            raise InputError("adapting_share", "must be below 1, so that something lasts", "1")

    @classmethod
    def for_tissues(cls, tissues: object) -> Afferent:
        """Afferent that was fitted with a set of tissues.

        Parameters
        ----------
        tissues : str or Tissues
            "human", the default afferent; "paper" or "trial3", driven by SED, with one end organ and without
            adaptation. Its membrane starts at 0, as the paper prints, and not at rest.
            For any other name and for tissues of your own, no afferent was fitted; the one of "trial3" is
            returned.

        Examples
        --------
        >>> Afferent.for_tissues("human").static_quantity, Afferent.for_tissues("paper").static_quantity
        ('von_mises', 'stored')
        >>> Afferent.for_tissues("human") == Afferent()
        True
        """
        known = tissues if isinstance(tissues, str) else ""
        if known == "human":
            return cls()
        fitted = neuron.fitted["paper" if known == "paper" else "trial3"]
        return cls.from_parameters(
            [getattr(neuron, name).value for name in fitted], initial_mv=neuron.PAPER_INITIAL.value
        )

    @classmethod
    def from_parameters(cls, parameters: ArrayLike, **others: Any) -> Afferent:
        """Make an afferent from the six fitted numbers.

        Parameters
        ----------
        parameters : array_like (6,)
            beta [mA], k_d [mA ms/kPa], k_s [mA/kPa], tau [ms], C [mF], v [mV]: the order of
            `PARAMETER_NAMES`.
        **others
            Any other field of `Afferent`; what is absent is as in the paper: SED drives both terms, one end
            organ, no adaptation, noise that multiplies.

        Examples
        --------
        >>> Afferent.from_parameters([0.0, 2e-4, 7e-7, 68.0, 1e-6, 50.0], refractory_ms=2.0).threshold_mv
        50.0
        """
        values = float_array("parameters", parameters, 1)
        if values.size != len(PARAMETER_NAMES):
            raise InputError(
                "parameters", f"must hold {', '.join(PARAMETER_NAMES)}", f"{values.size} numbers"
            )
        return cls(**dict(zip(PARAMETER_NAMES, values.tolist(), strict=True)), **(EXTENSIONS | others))

    @property
    def parameters(self) -> FloatArray:
        """The six fitted numbers (6,), in the order of `PARAMETER_NAMES`."""
        return float_array("parameters", [getattr(self, name) for name in PARAMETER_NAMES], 1)

    @property
    def transduction(self) -> Transduction:
        """The first stage, Eqs. 1-2."""
        return Transduction(self.intercept_ma, self.dynamic_gain, self.static_gain, self.saturation_per_ma)

    @property
    def membrane(self) -> LeakyIntegrateAndFire:
        """The second stage, Eqs. 3-5."""
        return LeakyIntegrateAndFire(
            self.time_constant_ms, self.capacitance_mf, self.threshold_mv, self.refractory_ms, self.initial_mv
        )

    @property
    def static_threshold(self) -> float:
        """Constant quantity above which the afferent fires, G / (k_s (1 - a)). [its unit]

        Without saturation the sum of both terms at the threshold is G = C v / tau - beta. It is infinite if
        saturation lets no current reach the threshold.

        Examples
        --------
        >>> round(Afferent().static_threshold, 2), round(Afferent.for_tissues("trial3").static_threshold, 3)
        (0.16, 0.038)
        """
        needed_ma = self.rheobase_ma - self.intercept_ma
        passed = 1.0 - self.saturation_per_ma * abs(needed_ma)
        return needed_ma / (passed * self._lasting_gain) if passed > 0.0 else np.inf

    @property
    def _lasting_gain(self) -> float:
        """Static gain on a quantity that has lasted for long. [mA/kPa, or per its unit]"""
        return self.static_gain * (1.0 - self.adapting_share)

    @property
    def rheobase_ma(self) -> float:
        """Constant current that just reaches the threshold, C v / tau; less never elicits a spike. [mA]"""
        return self.capacitance_mf * self.threshold_mv / self.time_constant_ms

    def with_static_threshold(self, quantity: NotNegative) -> Afferent:
        """Return the same afferent with another intercept, so that it fires above a constant quantity.

        Examples
        --------
        >>> round(Afferent().with_static_threshold(5.0).static_threshold, 9)
        5.0
        """
        passed_ma = float(saturated(np.array(self._lasting_gain * quantity), self.saturation_per_ma))
        return replace(self, intercept_ma=self.rheobase_ma - passed_ma)

    def spikes(self, traces: Traces | Drive) -> SpikeTrains:
        """Simulate the spikes of this afferent, a train per site.

        Parameters
        ----------
        traces : Traces or Drive
            What the two terms follow. Pass `fingerpad.neuron.transduction.drive` of it if many afferents are
            simulated under the same traces, as in a fit.
        """
        check_quantities(self, traces)
        if isinstance(traces, Drive):
            if self.smoothing_ms:
                raise InputError(
                    "traces", "must be Traces, since smoothing_ms smooths those of the skin", "a Drive"
                )
            return SpikeTrains.joined(
                in_blocks(lambda sites: self._fired(traces.part(sites)), traces.n_sites)
            )
        # Most of the skin moves too little for a spike.
        may_fire = self._largest_current_ma(traces) > _SURELY_SILENT * self.rheobase_ma
        return spikes_where(may_fire, traces, self._fired)

    def current(self, traces: Traces | Drive) -> Traces:
        """Compute the current through the membrane at every site, Eq. 1. [mA]"""
        driven = traces if isinstance(traces, Drive) else self._driven(traces)
        return self.transduction.current(adapted_drive(self, driven))

    def _fired(self, traces: Traces | Drive) -> SpikeTrains:
        return self.membrane.spikes(self.current(traces))

    def _driven(self, traces: Traces) -> Drive:
        """Resample what the two terms follow, and the rate of change of the dynamic one."""
        if not self.smoothing_ms:
            return drive(traces)
        times_ms, rate = smoothed_rate(traces.dynamic_term, self.smoothing_ms)
        return replace(resampled(traces, self.smoothing_ms), times_ms=times_ms, rate_per_ms=np.abs(rate))

    def _largest_current_ma(self, traces: Traces) -> FloatArray:
        """Bound of the current at every site, (n_sites,): fastest change and largest value at once."""
        # Between two times a monotone cubic is at most three times as steep as the line (Fritsch & Carlson
        # 1980); a low pass changes at most by the range of its input in one time constant.
        followed = traces.dynamic_term.values
        if self.smoothing_ms:
            fastest = np.ptp(followed, axis=0) / self.smoothing_ms
        else:
            slopes = np.diff(followed, axis=0) / np.diff(traces.times_ms)[:, np.newaxis]
            fastest = 3.0 * np.abs(slopes).max(axis=0)
        static = (self.static_gain * traces.values).max(axis=0)
        # What a negative gain has lost is a current that remains when the static term is gone.
        remains = max(-self.static_gain, 0.0) * self.adapting_share * traces.values.max(axis=0)
        both = max(self.dynamic_gain, 0.0) * fastest + static + remains
        return self.intercept_ma + saturated(both, self.saturation_per_ma)

    def rates(
        self,
        traces: Traces | Drive,
        dynamic_window_ms: Window | None = None,
        static_window_ms: Window | None = None,
    ) -> tuple[FloatArray, FloatArray]:
        """Compute the firing rates at every site in the ramp and in the hold, Eqs. 6-10. [spikes/s]

        They are 0 where no interval closes in the window.

        Parameters
        ----------
        traces : Traces or Drive
            As in `spikes`.
        dynamic_window_ms, static_window_ms : (float, float), optional
            Start and end of the two windows; by default those of `rate_windows_ms`, which follow the phases
            of `traces`: the paper's for the paper's motion. [ms]
        """
        dynamic, static = rate_windows_ms(
            traces.phases, dynamic_window_ms, static_window_ms, traces.times_ms[-1]
        )
        spikes = self.spikes(traces)
        return firing_rate_hz(spikes, dynamic), firing_rate_hz(spikes, static)


def adapted_drive(afferent: Afferent, driven: Drive) -> Drive:
    """Return a drive without what the static term loses from its start on."""
    if not afferent.adapting_share:
        return driven
    values = adapted(afferent, driven.times_ms, driven.values, driven.values[0].copy())
    return replace(driven, values=values)


def adapted(afferent: Afferent, times_ms: FloatArray, values: FloatArray, state: FloatArray) -> FloatArray:
    """Take what is lost from the static term; the state (n_sites,) of the loss is carried on."""
    lost = values.copy()
    continued_stage(times_ms, lost, afferent.adapting_ms, False, state)
    return values - afferent.adapting_share * lost


def spikes_where(
    may_fire: np.ndarray, traces: Traces, spikes: Callable[[Traces], SpikeTrains]
) -> SpikeTrains:
    """Spikes of the sites that may fire, block by block on all threads; the others are silent."""
    if not may_fire.any():
        return SpikeTrains.from_lists([[]] * traces.n_sites)
    some = traces.part(may_fire)
    blocks = in_blocks(lambda sites: spikes(some.part(sites)), some.n_sites, _SITES_PER_BLOCK)
    fired, counts = SpikeTrains.joined(blocks), np.zeros(traces.n_sites, dtype=np.int64)
    counts[may_fire] = fired.counts
    return SpikeTrains(fired.times_ms, np.append(0, np.cumsum(counts)))
