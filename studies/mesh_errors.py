"""Effect of mesh errors on strain energy density (SED), firing rates, fit and hit rates."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from typing import Any

import numpy as np
from scipy.optimize import brentq

from fingerpad.core.checks import FloatArray, float_array
from fingerpad.core.errors import InputError
from fingerpad.core.results import Number, Vector, result_class
from fingerpad.data import bar_firing_rates, protocol, psychophysics
from fingerpad.experiments.gerling2014.discrepancy import PATIENCE_MS
from fingerpad.experiments.runner import Runner
from fingerpad.inference.fitting.fractional_sum_of_squares import fractional_sum_of_squares
from fingerpad.neuron.afferent import Afferent
from fingerpad.neuron.spikes import firing_rate_hz, first_spike_latency_ms
from fingerpad.psychophysics.noise_fit import expected_hit_rates
from fingerpad.skin.indentation import Touch
from fingerpad.skin.sampling import SkinResponse
from studies.study import TISSUES

DRAWS = 5000
"""Common random presentations behind the hit rates."""

LOWEST_ORDER, HIGHEST_ORDER = 0.3, 6.0
"""A quantity that converges slower or faster is not taken to converge at all on these meshes."""


HitRates = dict[str, Vector]
"""Hit rate of each comparison, by response measure. [0-1]"""


@result_class
class MeshSize:
    """Size of a mesh.

    Parameters
    ----------
    nodes, elements : int
        How many.
    size_x_mm, size_z_mm : float
        Smallest elements along and across the finger. [mm]
    counts : tuple of int
        Elements through stratum corneum, living epidermis, dermis and subcutis.
    """

    nodes: int
    elements: int
    size_x_mm: float
    size_z_mm: float
    counts: tuple[int, ...]

    @classmethod
    def of(cls, touch: Touch) -> MeshSize:
        """Size of the mesh of a touch."""
        grading = touch.grading
        return cls(
            nodes=len(touch.mesh.nodes_mm),
            elements=len(touch.mesh.elements),
            size_x_mm=grading.core_size_mm or grading.size_x_mm,
            size_z_mm=grading.size_z_mm,
            counts=grading.counts,
        )


@result_class
class Differences:
    """Differences between values and a reference, in the unit of the field that holds them.

    Parameters
    ----------
    max, rms : float
        Largest absolute difference, and root mean square.
    mean : float
        With its sign.
    """

    max: Number
    rms: Number
    mean: Number


@result_class
class MeshErrors:
    """Errors of one mesh at the touches that it shares with a finer one.

    Parameters
    ----------
    touches : int
        How many are shared.
    sed : dict of Differences
        At the end of the "ramp" and of the "hold", over the largest SED on the finer mesh. [1]
    rate_hz : dict of Differences
        "dynamic" and "static" firing rate. [spikes/s]
    latency_ms : Differences
        First spike, at most `PATIENCE_MS`. [ms]
    force : Differences
        At the end of the hold, over the largest force on the finer mesh. [1]
    """

    touches: int
    sed: dict[str, Differences]
    rate_hz: dict[str, Differences]
    latency_ms: Differences
    force: Differences


@result_class
class LargestChanges:
    """Relative change of the largest SED at the end of ramp and hold, and of the force. [1]"""

    sed_ramp: float
    sed_hold: float
    force: float


@result_class
class BarProfile:
    """Response of one receptor on one mesh to each shift of the bar; arrays are (n_shifts,).

    Parameters
    ----------
    shift_mm : array
        Position of the bar, proximal positive. [mm]
    sed_ramp_kpa, sed_hold_kpa : array
        SED at the end of ramp and hold. [kPa]
    dynamic_rate_hz, static_rate_hz : array
        Firing rates. [spikes/s]
    latency_ms : array
        First spike; NaN of a silent afferent. [ms]
    force_mn : array
        At the end of the hold. [mN]
    """

    shift_mm: Vector
    sed_ramp_kpa: Vector
    sed_hold_kpa: Vector
    dynamic_rate_hz: Vector
    static_rate_hz: Vector
    latency_ms: Vector
    force_mn: Vector


@dataclass(frozen=True)
class Reading:
    """Responses of receptors on one mesh; arrays are (n_touches, n_receptors) unless said otherwise.

    Parameters
    ----------
    touches : tuple
        Numbers of the bar's shifts, or positions and curvatures of spheres.
    sed_kpa : dict of arrays
        Strain energy density at the end of the "ramp" and of the "hold". [kPa]
    rate_hz : dict of arrays
        "dynamic" and "static" firing rate. [spikes/s]
    latency_ms : array
        First spike; NaN of a silent afferent. [ms]
    force_mn : array (n_touches,)
        Force at the end of the hold. [mN]
    """

    touches: tuple[Any, ...]
    sed_kpa: dict[str, FloatArray]
    rate_hz: dict[str, FloatArray]
    latency_ms: FloatArray
    force_mn: FloatArray

    def only(self, touches: Sequence[Any]) -> Reading:
        """Return the rows of some touches, in their order."""
        rows = [self.touches.index(touch) for touch in touches]
        return Reading(
            tuple(touches),
            {phase: values[rows] for phase, values in self.sed_kpa.items()},
            {phase: values[rows] for phase, values in self.rate_hz.items()},
            self.latency_ms[rows],
            self.force_mn[rows],
        )

    def measures(self) -> dict[str, FloatArray]:
        """Return the response measures that an observer compares; latencies are at most `PATIENCE_MS`."""
        return {**self.rate_hz, "latency": np.fmin(self.latency_ms, PATIENCE_MS)}

    def profile(self) -> BarProfile:
        """Return the responses of the first receptor to the bar; touches are the numbers of its shifts."""
        return BarProfile(
            shift_mm=np.array([protocol.BAR_SHIFTS.value[shift] for shift in self.touches]),
            sed_ramp_kpa=self.sed_kpa["ramp"][:, 0],
            sed_hold_kpa=self.sed_kpa["hold"][:, 0],
            dynamic_rate_hz=self.rate_hz["dynamic"][:, 0],
            static_rate_hz=self.rate_hz["static"][:, 0],
            latency_ms=self.latency_ms[:, 0],
            force_mn=self.force_mn,
        )


def over_thickness(skin: SkinResponse, sheets: int) -> SkinResponse:
    """Give the lowest sheet of the living epidermis the mean SED of all its sheets.

    A receptor samples the mean over the living epidermis, which is 0.1 mm thick. With one element through it,
    this is the element's own mean. With more, the lowest sheet alone would be another sampling depth.

    Parameters
    ----------
    skin : SkinResponse
        On a mesh with `sheets` elements through the living epidermis.
    sheets : int
        How many those are; they are equally thick.

    Returns
    -------
    SkinResponse
    """
    lowest = skin.mesh.living_epidermis
    sed = skin.sed_kpa.copy()
    # Elements are numbered from skin to bone, the last index running fastest.
    sed[:, lowest] = np.mean([skin.sed_kpa[:, lowest - above] for above in range(sheets)], axis=0)
    return skin.with_fields(sed_kpa=sed)


def read(responses: Mapping[Any, SkinResponse], receptors_mm: FloatArray, sheets: int) -> Reading:
    """Return the responses of equal afferents at given places to the touches of one mesh.

    Parameters
    ----------
    responses : mapping of SkinResponse
        By touch.
    receptors_mm : array (n_receptors, 2)
        x and z. [mm]
    sheets : int
        Elements through the living epidermis of the mesh.

    Returns
    -------
    Reading
    """
    traces = [over_thickness(skin, sheets).sed(receptors_mm) for skin in responses.values()]
    ramp_ends = [int(np.argmin(np.abs(trace.times_ms - trace.kinks_ms[0]))) for trace in traces]
    trains = [Afferent.for_tissues(TISSUES).spikes(trace) for trace in traces]
    windows = {"dynamic": protocol.DYNAMIC_WINDOW.value, "static": protocol.STATIC_WINDOW.value}
    return Reading(
        touches=tuple(responses),
        sed_kpa={
            "ramp": np.array([trace.sed_kpa[end] for trace, end in zip(traces, ramp_ends, strict=True)]),
            "hold": np.array([trace.sed_kpa[-1] for trace in traces]),
        },
        rate_hz={
            name: np.array([firing_rate_hz(train, window) for train in trains])
            for name, window in windows.items()
        },
        latency_ms=np.array([first_spike_latency_ms(train) for train in trains]),
        force_mn=np.array([skin.force_mn[-1] for skin in responses.values()]),
    )


def read_stored(runner: Runner, touches: Mapping[Any, Touch], receptors_mm: FloatArray) -> Reading:
    """Return the responses of equal afferents to stored touches of one mesh.

    Parameters
    ----------
    runner : Runner
        Holds every touch.
    touches : mapping of Touch
        All on meshes with as many elements through the living epidermis.
    receptors_mm : array (n_receptors, 2)
        x and z. [mm]

    Returns
    -------
    Reading
        Its touches are the keys of the mapping.

    Raises
    ------
    StoreError
        If a stored touch is damaged.
    """
    sheets = next(iter(touches.values())).grading.living_epidermis
    return read({key: runner.store.load(touch) for key, touch in touches.items()}, receptors_mm, sheets)


def differences(values: FloatArray, reference: FloatArray, unit: float = 1.0) -> Differences:
    """Summarise the differences between values and a reference.

    Parameters
    ----------
    values, reference : array
        The same quantities twice. [any unit]
    unit : float
        What the differences are divided by.

    Returns
    -------
    Differences
        In multiples of the unit.

    Raises
    ------
    InputError
        If the two differ in shape.

    Examples
    --------
    >>> differences(np.array([1.0, 5.0]), np.array([1.0, 2.0]), unit=2.0).max
    1.5
    """
    if np.shape(values) != np.shape(reference):
        raise InputError(
            f"values and reference must match: got shapes {np.shape(values)} and {np.shape(reference)}."
        )
    difference = (np.asarray(values) - reference) / unit
    return Differences(
        max=np.abs(difference).max(),
        rms=np.sqrt(np.square(difference).mean()),
        mean=difference.mean(),
    )


def compare(reading: Reading, reference: Reading) -> MeshErrors:
    """Return the errors of one mesh at the touches that it shares with a finer one.

    Parameters
    ----------
    reading, reference : Reading
        On the mesh that is judged and on the finer one.

    Returns
    -------
    MeshErrors
    """
    common = [touch for touch in reference.touches if touch in reading.touches]
    ours, finer = reading.only(common), reference.only(common)
    return MeshErrors(
        touches=len(common),
        sed={
            phase: differences(ours.sed_kpa[phase], finer.sed_kpa[phase], float(finer.sed_kpa[phase].max()))
            for phase in finer.sed_kpa
        },
        rate_hz={phase: differences(ours.rate_hz[phase], finer.rate_hz[phase]) for phase in finer.rate_hz},
        latency_ms=differences(ours.measures()["latency"], finer.measures()["latency"]),
        force=differences(ours.force_mn, finer.force_mn, float(finer.force_mn.max())),
    )


def largest_changes(before: Reading, after: Reading) -> LargestChanges:
    """Return the relative change of the largest SED and of the force between two meshes.

    Parameters
    ----------
    before, after : Reading
        One touch on two meshes.

    Returns
    -------
    LargestChanges
    """
    ramp, hold = (
        float(after.sed_kpa[phase].max() / before.sed_kpa[phase].max()) - 1.0 for phase in ("ramp", "hold")
    )
    force = float(after.force_mn[0] / before.force_mn[0]) - 1.0
    return LargestChanges(sed_ramp=ramp, sed_hold=hold, force=force)


def goodness_of_fit(reading: Reading) -> float:
    """Return the weighted FSS (Eqs. 12-14) of the rates at the indented shifts; no parameter is fitted."""
    observed = bar_firing_rates()
    shifts = list(reading.touches)
    dynamic, static = (
        fractional_sum_of_squares(rates_hz[shifts], reading.rate_hz[phase][:, 0])
        for phase, rates_hz in (("dynamic", observed.dynamic_rate_hz), ("static", observed.static_rate_hz))
    )
    return protocol.DYNAMIC_WEIGHT.value * dynamic + protocol.STATIC_WEIGHT.value * static


def hit_rates(
    reading: Reading, position_mm: float, curvatures: Sequence[float], neighbours: np.ndarray, seed: int = 0
) -> HitRates:
    """Hit rates of Gradient Sum at one position, the same random numbers on every mesh.

    Parameters
    ----------
    reading : Reading
        Spheres by (position, curvature).
    position_mm : float
        Which position. [mm]
    curvatures : sequence of float
        The standard first. [1/m]
    neighbours : int array (n_pairs, 2)
        From `fingerpad.psychophysics.encoding.neighbour_pairs`.
    seed : int
        Of the noise.

    Returns
    -------
    dict of arrays (n_comparisons,)
        By response measure, at the paper's sigma_1. [0-1]
    """
    chosen = reading.only([(position_mm, curvature) for curvature in curvatures])
    draws = np.random.default_rng([seed, 0]).standard_normal((DRAWS, chosen.latency_ms.shape[1]))
    return {
        name: expected_hit_rates(values, neighbours, psychophysics.NOISE_SIGMA.value, draws)
        for name, values in chosen.measures().items()
    }


def observed_order(values: Sequence[float], factors: Sequence[float]) -> tuple[float, float] | None:
    """Order p and limit u of a quantity on three similar meshes, u_i = u + c f_i^-p (Richardson 1911).

    Parameters
    ----------
    values, factors : sequence of 3 floats
        The quantity, and by how much elements are smaller, from coarse to fine.

    Returns
    -------
    (float, float) or None
        p and u; None unless the values approach a limit with an order from 0.3 to 6.

    Raises
    ------
    InputError
        If there are not three of each, or the factors do not increase from above 0.

    Examples
    --------
    >>> order, limit = observed_order([2.0, 1.25, 1.0 + 1 / 9], [1.0, 2.0, 3.0])
    >>> round(order, 6), round(limit, 6)
    (2.0, 1.0)
    >>> observed_order([1.0, 2.0, 1.0], [1.0, 2.0, 3.0]) is None
    True
    """
    u, f = float_array("values", values, 1), float_array("factors", factors, 1)
    if u.size != 3 or f.size != 3 or not 0.0 < f[0] < f[1] < f[2]:
        raise InputError(f"observed_order needs three values and three increasing factors: got {u}, {f}.")
    if u[1] == u[2]:
        return None

    def excess(order: float) -> float:
        h = f**-order
        return float((h[0] - h[1]) / (h[1] - h[2]) - (u[0] - u[1]) / (u[1] - u[2]))

    if excess(LOWEST_ORDER) * excess(HIGHEST_ORDER) > 0.0:
        return None
    p = float(brentq(excess, LOWEST_ORDER, HIGHEST_ORDER, xtol=1e-12))
    c = (u[1] - u[2]) / (f[1] ** -p - f[2] ** -p)
    return p, float(u[2] - c * f[2] ** -p)
