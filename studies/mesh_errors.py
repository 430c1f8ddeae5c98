"""What a mesh's error does to what receptors, afferents and observers say."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from typing import Any

import numpy as np
from scipy.optimize import brentq

from fingerpad.core.checks import FloatArray, float_array
from fingerpad.core.errors import InputError
from fingerpad.data import bar_firing_rates, protocol, psychophysics
from fingerpad.experiments.gerling2014.discrepancy import PATIENCE_MS
from fingerpad.inference.fitting.fractional_sum_of_squares import fractional_sum_of_squares
from fingerpad.neuron.afferent import Afferent
from fingerpad.neuron.spikes import firing_rate_hz, first_spike_latency_ms
from fingerpad.psychophysics.noise_fit import expected_hit_rates
from fingerpad.skin.sampling import SkinResponse

DRAWS = 5000
"""Common random presentations behind the hit rates."""

LOWEST_ORDER, HIGHEST_ORDER = 0.3, 6.0
"""A quantity that converges slower or faster is not taken to converge at all on these meshes."""


@dataclass(frozen=True)
class Reading:
    """What receptors say on one mesh; arrays are (n_touches, n_receptors) unless said otherwise.

    Parameters
    ----------
    touches : tuple
        What was pressed: numbers of the bar's shifts, or positions and curvatures of spheres.
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
        """Return the response measures that an observer reads, latencies as far as he waits for them."""
        return {**self.rate_hz, "latency": np.fmin(self.latency_ms, PATIENCE_MS)}


def over_thickness(skin: SkinResponse, sheets: int) -> SkinResponse:
    """Let the lowest sheet of the living epidermis hold the mean of all its sheets.

    A receptor reads the mean over the living epidermis, 0.1 mm thick. With one element through it that is the
    element's own mean; with more, reading the lowest alone would be another depth and not another accuracy.

    Parameters
    ----------
    skin : SkinResponse
        Answer of a mesh with `sheets` elements through the living epidermis.
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
    """Let equal afferents at some places answer the touches of one mesh.

    Parameters
    ----------
    responses : mapping of SkinResponse
        What the skin did, by touch.
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
    trains = [Afferent().spikes(trace) for trace in traces]
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


def differences(values: FloatArray, reference: FloatArray, unit: float = 1.0) -> dict[str, float]:
    """Summarise how far values are from a reference.

    Parameters
    ----------
    values, reference : array
        The same quantities twice. [any unit]
    unit : float
        What the differences are divided by.

    Returns
    -------
    dict
        "max" of the absolute differences, their "rms", and the "mean" with its sign. [unit]

    Raises
    ------
    InputError
        If the two differ in shape.

    Examples
    --------
    >>> differences(np.array([1.0, 5.0]), np.array([1.0, 2.0]), unit=2.0)["max"]
    1.5
    """
    if np.shape(values) != np.shape(reference):
        raise InputError(
            f"values and reference must match: got shapes {np.shape(values)} and {np.shape(reference)}."
        )
    difference = (np.asarray(values) - reference) / unit
    return {
        "max": float(np.abs(difference).max()),
        "rms": float(np.sqrt(np.square(difference).mean())),
        "mean": float(difference.mean()),
    }


def compare(reading: Reading, reference: Reading) -> dict[str, Any]:
    """Errors of one mesh, at the touches that it shares with a finer one.

    Parameters
    ----------
    reading, reference : Reading
        The mesh to judge and the finer one.

    Returns
    -------
    dict
        Number of common touches; `differences` of "sed", by phase, as shares of the reference's largest SED;
        of "rate", by phase [spikes/s]; of "latency" as far as an observer waits [ms]; and of "force" as
        shares of the reference's largest.
    """
    common = [touch for touch in reference.touches if touch in reading.touches]
    ours, finer = reading.only(common), reference.only(common)
    return {
        "touches": len(common),
        "sed": {
            phase: differences(ours.sed_kpa[phase], finer.sed_kpa[phase], float(finer.sed_kpa[phase].max()))
            for phase in finer.sed_kpa
        },
        "rate": {phase: differences(ours.rate_hz[phase], finer.rate_hz[phase]) for phase in finer.rate_hz},
        "latency": differences(ours.measures()["latency"], finer.measures()["latency"]),
        "force": differences(ours.force_mn, finer.force_mn, float(finer.force_mn.max())),
    }


def largest_changes(before: Reading, after: Reading) -> dict[str, float]:
    """Return what a change of the mesh does to the largest SED and to the force, as shares of them.

    Parameters
    ----------
    before, after : Reading
        One touch on two meshes.

    Returns
    -------
    dict
        "sed_ramp", "sed_hold" and "force".
    """
    return {
        **{
            f"sed_{phase}": float(after.sed_kpa[phase].max() / sed.max()) - 1.0
            for phase, sed in before.sed_kpa.items()
        },
        "force": float(after.force_mn[0] / before.force_mn[0]) - 1.0,
    }


def goodness_of_fit(reading: Reading) -> float:
    """Weighted FSS of Eqs. 12-14 of the rates at the shifts that were pressed, parameters as they are."""
    observed = bar_firing_rates()
    shifts = list(reading.touches)
    dynamic, static = (
        fractional_sum_of_squares(rates_hz[shifts], reading.rate_hz[phase][:, 0])
        for phase, rates_hz in (("dynamic", observed.dynamic_rate_hz), ("static", observed.static_rate_hz))
    )
    return protocol.DYNAMIC_WEIGHT.value * dynamic + protocol.STATIC_WEIGHT.value * static


def hit_rates(
    reading: Reading, position_mm: float, curvatures: Sequence[float], neighbours: np.ndarray, seed: int = 0
) -> dict[str, FloatArray]:
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
