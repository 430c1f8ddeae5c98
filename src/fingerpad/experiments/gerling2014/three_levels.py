"""Figures 1, 2 and 6: the mesh, one sphere on all levels, and afferents all over the pad."""

from __future__ import annotations

import numpy as np

from fingerpad.core.checked import result_class
from fingerpad.core.signals import ResponseMap, Traces
from fingerpad.core.units import MM_PER_M
from fingerpad.core.values import (
    FloatArray,
    IntArray,
    Matrix,
    Number,
    TruthMatrix,
    TruthVector,
    Vector,
    WholeVector,
)
from fingerpad.data import fingertip, protocol
from fingerpad.experiments.conditions import RECEPTOR_X_MM
from fingerpad.geometry.mesh import LAYERS, Mesh
from fingerpad.neuron.afferent import Afferent
from fingerpad.neuron.lif import LeakyIntegrateAndFire
from fingerpad.neuron.population import Population
from fingerpad.neuron.spikes import PAPER_WINDOWS_MS, first_spike_latency_ms
from fingerpad.skin.sampling import SkinResponse

OFFSETS_MM = (0.0, 1.0, 2.0)  # Distances of the three afferents from the axis of the sphere, distal. [mm]

UNTIL_MS, POTENTIAL_STEP_MS = 200.0, 0.5
"""Current and potential are given from the onset up to this time, at this spacing and about spikes. [ms]"""


@result_class
class ThreeLevels:
    """Skin, one afferent and three afferents under the standard sphere (Figure 2)."""

    curvature_per_m: float  # Of the sphere. [1/m]
    centre_mm: tuple[float, float]  # x and y of its centre at the end of the hold. [mm]
    ramp_ms: float  # Duration of the ramp. [ms]
    x_mm: Matrix
    y_mm: Matrix
    """Nodes of the plane z = 0 at the end of the hold, through from the skin to the bone, (n_outline + 1,
    n_through + 1). [mm]"""
    pressed: str  # Name of what the afferent follows, as it is known in all elements.
    pressed_kpa: Matrix  # Its values in the elements beside that plane, (n_outline, n_through). [kPa]
    end_ms: float  # End of the hold. [ms]
    offset_mm: Vector  # Positions of the afferents relative to the contact, (3,). [mm]
    spikes_ms: tuple[Vector, ...]  # Spike times of each afferent. [ms]
    dynamic_rate_hz: Vector
    static_rate_hz: Vector  # Their rates, (3,). [spikes/s]
    times_ms: Vector
    until_ms: float  # Times of the next two, and their end, (n_times,). [ms]
    current_ma: Vector
    potential_mv: Vector  # Current and potential of the first afferent, (n_times,). [mA, mV]
    rheobase_ma: float
    threshold_mv: float  # Smallest constant current, and potential, that elicit spikes. [mA, mV]


def three_levels(standard: SkinResponse, afferent: Afferent) -> ThreeLevels:
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


DECIMALS = 4  # Decimals of coordinates in files: 0.1 µm. [mm]


@result_class
class MeshPlane:
    """Nodes of a mesh in one plane, in grid order."""

    right_mm: Matrix
    up_mm: Matrix  # In the plane, through from the skin to the bone, (n_outline, n_through + 1). [mm]
    under_nail: TruthVector  # Whether the node on the skin lies under the nail, (n_outline,).


@result_class
class MeshPicture:
    """The mesh without load (Figure 1)."""

    x_mm: Matrix
    y_mm: Matrix
    z_mm: Matrix  # Nodes of the skin, (n_along + 1, n_around + 1). [mm]
    under_nail: TruthMatrix  # Whether they lie under the nail, (n_along + 1, n_around + 1).
    along: MeshPlane  # Plane z = 0, from the volar side over the tip to the back; right is x, up is y.
    across: MeshPlane  # Proximal end, beside the middle phalanx; right is z, up is y.
    half: bool  # Whether `across` is one half, whose other half is its mirror image.
    contact_mm: tuple[float, float]  # x and y of the skin at the contact. [mm]
    layers: tuple[str, ...]  # From the skin inwards.
    layer: WholeVector  # Index into `layers` of each element through the skin, (n_through,).
    receptor_depth_mm: float  # Of the end organs below the skin. [mm]
    nodes: int
    elements: int  # Of the whole mesh.


def mesh_picture(mesh: Mesh, contact_x_mm: float) -> MeshPicture:
    """Cut a mesh along the finger, and across it at its proximal end."""
    midline = mesh.nodes_mm[mesh.midline_nodes]
    nearest = int(np.abs(midline[:, 0] - contact_x_mm).argmin())
    x, y, _ = midline[nearest].round(DECIMALS).tolist()
    skin = mesh.nodes_mm[mesh.skin_grid].round(DECIMALS)
    return MeshPicture(
        x_mm=skin[..., 0],
        y_mm=skin[..., 1],
        z_mm=skin[..., 2],
        under_nail=np.isin(mesh.skin_grid, mesh.nail_nodes),
        along=_plane(mesh, outline_nodes(mesh), 0),
        across=_plane(mesh, mesh.grid[0], 2),
        half=not mesh.full,
        contact_mm=(x, y),
        layers=LAYERS,
        layer=mesh.layer[: mesh.shape[2]],
        receptor_depth_mm=fingertip.RECEPTOR_DEPTH.value,
        nodes=len(mesh.nodes_mm),
        elements=len(mesh.elements),
    )


def outline_nodes(mesh: Mesh) -> IntArray:
    """Nodes on the plane z = 0, (2 n_along + 1, n_through + 1), from the pad over the tip to the back."""
    volar = mesh.shape[1] // 2 if mesh.full else 0
    return np.concatenate([mesh.grid[:, volar], mesh.grid[-2::-1, -1]])


def outline_elements(mesh: Mesh) -> IntArray:
    """Elements beside the plane z = 0, (2 n_along, n_through), in the order of `outline_nodes`."""
    numbers = np.arange(len(mesh.elements)).reshape(mesh.shape)
    volar = mesh.shape[1] // 2 if mesh.full else 0
    return np.concatenate([numbers[:, volar], numbers[::-1, -1]])


def _plane(mesh: Mesh, nodes: IntArray, right: int) -> MeshPlane:
    points: FloatArray = mesh.nodes_mm[nodes].round(DECIMALS)
    return MeshPlane(
        right_mm=points[..., right], up_mm=points[..., 1], under_nail=np.isin(nodes[:, 0], mesh.nail_nodes)
    )


REACH_MM, STEP_MM = 5.0, 0.25  # Half the side of the sheet, and its pitch. [mm]


@result_class
class RestingResponse:
    """Response of an afferent without any touch."""

    dynamic_rate_hz: float
    static_rate_hz: float  # Rates in the windows of the ramp and the hold. [spikes/s]
    first_spike_latency_ms: Number  # NaN without a spike. [ms]


@result_class
class ResponseSheet:
    """Responses of a sheet of afferents as tables over x (rows) and z (columns)."""

    x_mm: Vector
    z_mm: Vector  # Places of the afferents, (n_x,). [mm]
    dynamic_rate_hz: Matrix
    static_rate_hz: Matrix  # Rates, (n_x, n_z). [spikes/s]
    first_spike_latency_ms: Matrix  # NaN without a spike, (n_x, n_z). [ms]


@result_class
class PopulationMaps(ResponseSheet):
    """Responses of a dense sheet of afferents under the standard sphere (Figure 6)."""

    curvature_per_m: float  # Of the sphere. [1/m]
    at_rest: RestingResponse  # Of the same afferent.
    receptors_mm: Matrix  # Places of the paper's receptors, (18, 2). [mm]


def population_maps(standard: SkinResponse, afferent: Afferent) -> PopulationMaps:
    """Simulate a dense sheet of afferents under the standard sphere (Figure 6)."""
    return PopulationMaps(
        curvature_per_m=protocol.STANDARD_CURVATURE.value,
        at_rest=resting_response(afferent),
        **vars(response_sheet(sheet(afferent).respond(standard))),
        receptors_mm=Population.grid(afferent=afferent, centre_mm=(RECEPTOR_X_MM, 0.0)).positions_mm,
    )


def resting_response(afferent: Afferent) -> RestingResponse:
    end_ms = protocol.RAMP.value + protocol.HOLD.value
    sed = Traces.at_rest(end_ms, afferent.dynamic_quantity, afferent.static_quantity)
    dynamic_hz, static_hz = afferent.rates(sed, *PAPER_WINDOWS_MS)
    return RestingResponse(
        dynamic_rate_hz=float(dynamic_hz[0]),
        static_rate_hz=float(static_hz[0]),
        first_spike_latency_ms=float(first_spike_latency_ms(afferent.spikes(sed))[0]),
    )


def sheet(afferent: Afferent, reach_mm: float = REACH_MM, step_mm: float = STEP_MM) -> Population:
    """Place afferents side by side on a square about the contact point, ordered by x, then by z."""
    offsets = step_mm * np.arange(-round(reach_mm / step_mm), round(reach_mm / step_mm) + 1)
    x, z = RECEPTOR_X_MM + offsets, offsets
    sites = np.stack(np.meshgrid(x, z, indexing="ij"), axis=-1).reshape(-1, 2)
    return Population(positions_mm=sites, pitch_mm=step_mm, afferent=afferent)


def response_sheet(response: ResponseMap) -> ResponseSheet:
    x, z = (np.unique(coordinate) for coordinate in response.positions_mm.T)
    shape = (x.size, z.size)
    return ResponseSheet(
        x_mm=x,
        z_mm=z,
        dynamic_rate_hz=response.dynamic_rate_hz.reshape(shape),
        static_rate_hz=response.static_rate_hz.reshape(shape),
        first_spike_latency_ms=response.first_spike_latency_ms.reshape(shape),
    )
