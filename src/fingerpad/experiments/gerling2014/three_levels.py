"""Figure 2: one sphere on all levels: pressed skin, one afferent below it, and three afferents."""

from __future__ import annotations

import numpy as np

from fingerpad.core.checks import FloatArray
from fingerpad.core.results import Matrix, Vector, result_class
from fingerpad.core.signals import Traces
from fingerpad.core.units import MM_PER_M
from fingerpad.data import protocol
from fingerpad.experiments.conditions import RECEPTOR_X_MM
from fingerpad.experiments.gerling2014.mesh_picture import DECIMALS, outline_elements, outline_nodes
from fingerpad.neuron.afferent import Afferent
from fingerpad.neuron.lif import LeakyIntegrateAndFire
from fingerpad.skin.sampling import SkinResponse

OFFSETS_MM = (0.0, 1.0, 2.0)
"""Distances of the three afferents from the axis of the sphere, distal. [mm]"""

UNTIL_MS, POTENTIAL_STEP_MS = 200.0, 0.5
"""Current and potential are given from the onset up to this time, at this spacing and about spikes. [ms]"""


@result_class
class ThreeLevels:
    """Skin, one afferent and three afferents under the standard sphere (Figure 2)."""

    curvature_per_m: float
    """Of the sphere. [1/m]"""
    centre_mm: tuple[float, float]
    """x and y of its centre at the end of the hold. [mm]"""
    ramp_ms: float
    """Duration of the ramp. [ms]"""
    x_mm: Matrix
    y_mm: Matrix
    """Nodes of the plane z = 0 at the end of the hold, through from the skin to the bone, (n_outline + 1,
    n_through + 1). [mm]
    """
    pressed: str
    """Name of what the afferent follows, as it is known in all elements."""
    pressed_kpa: Matrix
    """Its values in the elements beside that plane, (n_outline, n_through). [kPa]"""
    end_ms: float
    """End of the hold. [ms]"""
    offset_mm: Vector
    """Positions of the afferents relative to the contact, (3,). [mm]"""
    spikes_ms: tuple[Vector, ...]
    """Spike times of each afferent. [ms]"""
    dynamic_rate_hz: Vector
    static_rate_hz: Vector
    """Their rates, (3,). [spikes/s]"""
    times_ms: Vector
    until_ms: float
    """Times of the next two, and their end, (n_times,). [ms]"""
    current_ma: Vector
    potential_mv: Vector
    """Current through the membrane of the first afferent, and its potential, (n_times,). [mA, mV]"""
    rheobase_ma: float
    threshold_mv: float
    """Smallest constant current that elicits spikes, and the potential that elicits one. [mA, mV]"""


def three_levels(standard: SkinResponse, afferent: Afferent) -> ThreeLevels:
    """Read one indentation by the standard sphere on all levels."""
    mesh, curvature = standard.mesh, protocol.STANDARD_CURVATURE.value
    nodes = outline_nodes(mesh)
    moved = (mesh.nodes_mm + standard.displacement_mm)[nodes].round(DECIMALS)
    quantity = afferent.static_quantity
    pressed, values = standard.at_end(quantity)
    ramp_ms = protocol.RAMP.value
    offset = np.array(OFFSETS_MM)
    sed = standard.sed(
        np.stack([RECEPTOR_X_MM + offset, 0.0 * offset], axis=-1), afferent.dynamic_quantity, quantity
    )
    spikes, (dynamic_hz, static_hz) = afferent.spikes(sed), afferent.rates(sed)
    trains = tuple(spikes[number] for number in range(offset.size))
    membrane = afferent.membrane
    early = trains[0][trains[0] < UNTIL_MS]
    # A reset is drawn upright.
    reset = early + 1e-6 * membrane.refractory_ms
    regular = np.arange(0.0, UNTIL_MS + POTENTIAL_STEP_MS, POTENTIAL_STEP_MS)
    times = np.unique(np.concatenate([regular, early, reset, early + membrane.refractory_ms]))
    below = afferent.transduction.current(sed.part(slice(0, 1)))
    return ThreeLevels(
        curvature_per_m=curvature,
        centre_mm=_centre(standard, MM_PER_M / curvature),
        ramp_ms=ramp_ms,
        x_mm=moved[..., 0],
        y_mm=moved[..., 1],
        pressed=pressed,
        pressed_kpa=values[outline_elements(mesh)],
        end_ms=float(sed.times_ms[-1]),
        offset_mm=offset,
        spikes_ms=trains,
        dynamic_rate_hz=dynamic_hz,
        static_rate_hz=static_hz,
        times_ms=times,
        until_ms=UNTIL_MS,
        current_ma=np.interp(times, below.times_ms, below.values[:, 0]),
        potential_mv=membrane_potential(membrane, below, trains[0], times),
        rheobase_ma=membrane.capacitance_mf * membrane.threshold_mv / membrane.time_constant_ms,
        threshold_mv=membrane.threshold_mv,
    )


def membrane_potential(
    membrane: LeakyIntegrateAndFire, current: Traces, spikes_ms: FloatArray, times_ms: FloatArray
) -> FloatArray:
    """Potential of a membrane whose spike times are known, Eq. 3."""
    tau, capacitance = membrane.time_constant_ms, membrane.capacitance_mf
    knots = np.unique(
        np.concatenate([times_ms, current.times_ms, spikes_ms, spikes_ms + membrane.refractory_ms])
    )
    length = np.diff(knots)
    # A repeated time is a jump of the current: the line between two knots is read inside of them.
    quarter, three_quarters = (
        np.interp(knots[:-1] + share * length, current.times_ms, current.values[:, 0])
        for share in (0.25, 0.75)
    )
    slope = 2.0 * (three_quarters - quarter) / length
    steady = tau / capacitance * (quarter - slope * (0.25 * length + tau))
    decay, growth = np.exp(-length / tau), tau / capacitance * slope * length
    last_spike = np.searchsorted(spikes_ms, knots[:-1], side="right") - 1
    since = np.where(last_spike < 0, np.inf, knots[:-1] - np.append(spikes_ms, 0.0)[last_spike])
    held = since < membrane.refractory_ms - 1e-9
    potential = np.zeros(knots.size)
    potential[:1] = membrane.initial_potentials_mv(current.values[0, :1])
    for number, fixed in enumerate(held):
        start = 0.0 if since[number] == 0.0 else potential[number]
        relaxed = steady[number] + (start - steady[number]) * decay[number]
        potential[number + 1] = 0.0 if fixed else relaxed + growth[number]
    return potential[np.searchsorted(knots, times_ms)]


def _centre(skin: SkinResponse, radius_mm: float) -> tuple[float, float]:
    """Centre of a sphere that has advanced from the skin to its depth at the last time, x and y. [mm]"""
    midline = skin.mesh.nodes_mm[skin.mesh.midline_nodes]
    foot = np.array([skin.axis_x_mm, np.interp(skin.axis_x_mm, midline[:, 0], midline[:, 1])])
    x, y = foot + (float(skin.depth_mm[-1]) - radius_mm) * skin.direction[:2]
    return float(x), float(y)
