"""Level 3, Figure 6: responses of afferents all over the pad to a sphere, their order and their time course.

A dense layout of afferents represents populations of any density: an afferent at some place responds as the
sheet does there. For maps the sheet is square, seen from below; where skin is measured it is even by area.
Beside the paper's three maps stand the order of first spikes, a code of its own (Johansson & Birznieks 2004)
that the paper names in section 4.2, and the population rate.
"""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import asdict

import numpy as np
from numpy.typing import ArrayLike

from fingerpad.core.checks import FloatArray, positive
from fingerpad.core.errors import InputError
from fingerpad.core.layouts import MM2_PER_CM2
from fingerpad.core.patterns import hexagonal
from fingerpad.core.regions import Ellipse
from fingerpad.core.results import Matrix, Number, Vector, WholeVector, result_class
from fingerpad.core.signals import STORED_ENERGY, ResponseMap, SedTraces
from fingerpad.data import protocol, psychophysics
from fingerpad.experiments.conditions import RECEPTOR_X_MM
from fingerpad.geometry.fingertip import Fingertip
from fingerpad.neuron.afferent import Afferent
from fingerpad.neuron.population import Population
from fingerpad.neuron.response_maps import (
    NO_GROUP,
    evoked_latency_ms,
    order_change,
    population_rate,
    recruited,
    recruitment_rank,
    rings,
)
from fingerpad.neuron.spikes import first_spike_latency_ms
from fingerpad.skin.sampling import SkinResponse
from fingerpad.skin.unrolled_skin import UnrolledSkin

REACH_MM, STEP_MM = 5.0, 0.25
"""Half the side of the sheet, and its pitch; also the radius of the disc. [mm]"""

DISC_DENSITY_PER_CM2 = 1600.0
"""Density of the sheet, sixteen times that of the paper. [1/cm2]"""

RINGS_MM = (0.0, 1.0, 2.0, 3.0, 4.0)
"""Inner radius of the first ring about the contact, and the outer radius of each. [mm]"""

RATE_EDGES_MS = np.concatenate([np.arange(0.0, 150.0, 1.0), np.arange(150.0, 1000.1, 25.0)])
"""Edges of the bins of the population rate, narrow where it changes fast. [ms]"""

SMOOTHING_MS = 2.0
"""Standard deviation of the normal density that smooths the population rate. [ms]"""

ACTIVE_BIN_MS = 10.0
"""Bins in which afferents count as active or not: the interspike interval at 100 spikes/s. [ms]"""


@result_class
class RestingResponse:
    """Response of an afferent without any touch.

    Parameters
    ----------
    dynamic_rate_hz, static_rate_hz : float
        Rates in the windows of the ramp and the hold. [spikes/s]
    first_spike_latency_ms : float
        NaN without a spike. [ms]
    """

    dynamic_rate_hz: float
    static_rate_hz: float
    first_spike_latency_ms: Number


@result_class
class ResponseSheet:
    """Responses of a sheet of afferents as tables over x (rows) and z (columns).

    Parameters
    ----------
    x_mm, z_mm : array (n_x,), array (n_z,)
        Places of the afferents. [mm]
    dynamic_rate_hz, static_rate_hz : array (n_x, n_z)
        Rates. [spikes/s]
    first_spike_latency_ms : array (n_x, n_z)
        NaN without a spike. [ms]
    """

    x_mm: Vector
    z_mm: Vector
    dynamic_rate_hz: Matrix
    static_rate_hz: Matrix
    first_spike_latency_ms: Matrix


@result_class
class FingerMap:
    """Responses below every face of the skin, on the deformed finger at the end of the hold.

    Parameters
    ----------
    x_mm, y_mm, z_mm : array (n_along + 1, n_around + 1)
        Deformed corners of the faces. [mm]
    dynamic_rate_hz, static_rate_hz : array (n_along, n_around)
        Rates of the afferent below the middle of each face; NaN where they are 0 or less than twice those
        at rest. [spikes/s]
    first_spike_latency_ms : array (n_along, n_around)
        NaN without an evoked spike. [ms]
    half : bool
        Whether the faces are one half of the finger.
    """

    x_mm: Matrix
    y_mm: Matrix
    z_mm: Matrix
    dynamic_rate_hz: Matrix
    static_rate_hz: Matrix
    first_spike_latency_ms: Matrix
    half: bool


@result_class
class PopulationMaps(ResponseSheet):
    """Responses of a dense sheet of afferents under the standard sphere (Figure 6).

    Parameters
    ----------
    curvature_per_m : float
        Of the sphere. [1/m]
    at_rest : RestingResponse
        Of the same afferent.
    receptors_mm : array (18, 2)
        Places of the paper's receptors. [mm]
    finger : FingerMap
        The same three maps on the deformed finger.
    """

    curvature_per_m: float
    at_rest: RestingResponse
    receptors_mm: Matrix
    finger: FingerMap


@result_class
class TouchRecruitment:
    """Recruitment by one touch, and its order compared with that by the first touch.

    Parameters
    ----------
    name : str
        Of the touch.
    recruited_mm2, recruited_in_ramp_mm2 : float
        Skin whose afferents fire, in all and by the end of the ramp. [mm2]
    first_ms, median_ms : float
        Earliest and median first spike; inf and NaN without any. [ms]
    both, either, rank_correlation, swapped
        As in `fingerpad.neuron.response_maps.OrderChange`.
    """

    name: str
    recruited_mm2: float
    recruited_in_ramp_mm2: float
    first_ms: Number
    median_ms: Number
    both: int
    either: int
    rank_correlation: Number
    swapped: Number


@result_class
class AfferentRecruitment:
    """First spikes of every afferent under one touch.

    Parameters
    ----------
    name : str
        Of the touch.
    first_spike_latency_ms : array (n_afferents,)
        NaN without an evoked spike. [ms]
    recruitment_rank : array (n_afferents,)
        Place in the order, NaN likewise.
    """

    name: str
    first_spike_latency_ms: Vector
    recruitment_rank: Vector


@result_class
class Recruitment:
    """Order of first spikes under several touches.

    Parameters
    ----------
    positions_mm : array (n_afferents, 2 or 3)
        Places of the afferents. [mm]
    area_per_afferent_mm2 : float
        Skin per afferent. [mm2]
    resting_latency_ms : float
        First spike without a touch; inf or NaN if there is none. [ms]
    touches : tuple of TouchRecruitment
        Every touch.
    afferents : tuple of AfferentRecruitment
        Every afferent under some of the touches.
    """

    positions_mm: Matrix
    area_per_afferent_mm2: float
    resting_latency_ms: Number
    touches: tuple[TouchRecruitment, ...]
    afferents: tuple[AfferentRecruitment, ...]


@result_class
class TouchRates:
    """Population rate under one touch.

    Parameters
    ----------
    name : str
        Of the touch.
    rate_hz : array (n_rings, n_bins)
        Per afferent. [spikes/s]
    active_fraction : array (n_rings, n_active_bins)
        Afferents that fire in a bin. [0-1]
    together_per_cm2_hz : array (n_bins,)
        Rate of all rings per area of skin. [spikes/s per cm2]
    """

    name: str
    rate_hz: Matrix
    active_fraction: Matrix
    together_per_cm2_hz: Vector


@result_class
class PopulationRates:
    """Spikes and active afferents over time, ring by ring about a point.

    Parameters
    ----------
    edges_ms, active_edges_ms : array (n_bins + 1,), array (n_active_bins + 1,)
        Edges of the bins of the rates and of the active fractions. [ms]
    smoothing_ms : float
        Standard deviation of the normal density that smooths the rates. [ms]
    density_per_cm2 : float
        Afferents per area of skin. [1/cm2]
    resting_latency_ms : float
        First spike without a touch; inf or NaN if there is none. [ms]
    radii_mm : array (n_rings + 1,)
        Inner radius of the first ring, then outer radii. [mm]
    n_afferents : int array (n_rings,)
        Afferents in each ring.
    touches : tuple of TouchRates
        Every touch.
    """

    edges_ms: Vector
    active_edges_ms: Vector
    smoothing_ms: float
    density_per_cm2: float
    resting_latency_ms: Number
    radii_mm: Vector
    n_afferents: WholeVector
    touches: tuple[TouchRates, ...]


@result_class
class PopulationTiming:
    """Order of first spikes and population rate about the contact under every sphere.

    Parameters
    ----------
    recruitment : Recruitment
        By every sphere at 0.0 mm and by the standard at the other position.
    rates : PopulationRates
        Under the standard and the most curved sphere.
    """

    recruitment: Recruitment
    rates: PopulationRates


def population_maps(standard: SkinResponse, afferent: Afferent) -> PopulationMaps:
    """Simulate a dense sheet of afferents under the standard sphere (Figure 6).

    Parameters
    ----------
    standard : SkinResponse
        Skin under that sphere.
    afferent : Afferent
        Model of every afferent of the sheet.

    Returns
    -------
    PopulationMaps
    """
    sheet_maps = response_sheet(sheet(afferent).respond(standard))
    return PopulationMaps(
        curvature_per_m=protocol.STANDARD_CURVATURE.value,
        at_rest=resting_response(afferent),
        x_mm=sheet_maps.x_mm,
        z_mm=sheet_maps.z_mm,
        dynamic_rate_hz=sheet_maps.dynamic_rate_hz,
        static_rate_hz=sheet_maps.static_rate_hz,
        first_spike_latency_ms=sheet_maps.first_spike_latency_ms,
        receptors_mm=Population.grid(afferent=afferent, centre_mm=(RECEPTOR_X_MM, 0.0)).positions_mm,
        finger=finger_map(standard, afferent),
    )


def population_timing(
    responses: Mapping[tuple[float, float], SkinResponse],
    afferent: Afferent,
    finger: Fingertip | None = None,
) -> PopulationTiming:
    """Simulate afferents all around the contact under every sphere: order of first spikes, and rates.

    Parameters
    ----------
    responses : mapping of (position, curvature) to SkinResponse
        Skin under the spheres of `sphere_discrimination.discrimination_touches`. [mm], [1/m]
    afferent : Afferent
        Model of every afferent.
    finger : Fingertip, optional
        Finger with that skin. Default: `Fingertip()`.

    Returns
    -------
    PopulationTiming
    """
    finger = finger or Fingertip()
    standard = protocol.STANDARD_CURVATURE.value
    here, shifted = protocol.SPHERE_POSITIONS.value
    population, resting_ms = disc(finger, afferent), resting_response(afferent).first_spike_latency_ms
    maps = {
        touch_name(curvature): population.respond(responses[here, curvature])
        for position, curvature in sorted(responses)
        if position == here
    }
    moved = f"{touch_name(standard)}, {shifted - here:g} mm away"
    maps[moved] = population.respond(responses[shifted, standard])
    names = touch_name(standard), touch_name(max(curvature for _, curvature in responses))
    return PopulationTiming(
        recruitment=recruitment(
            maps,
            MM2_PER_CM2 / DISC_DENSITY_PER_CM2,
            resting_latency_ms=resting_ms,
            shown=(*names, moved),
        ),
        rates=population_rates(
            {name: maps[name] for name in names},
            finger.skin_point(RECEPTOR_X_MM + here, 0.0),
            density_per_cm2=psychophysics.RECEPTOR_DENSITY.value,
            resting_latency_ms=resting_ms,
        ),
    )


def disc(finger: Fingertip, afferent: Afferent) -> Population:
    """Place afferents densely and evenly, by area of skin, on a disc about the contact point.

    Examples
    --------
    >>> population = disc(Fingertip(), Afferent())
    >>> round(len(population) / DISC_DENSITY_PER_CM2, 2), round(np.pi * 0.5**2, 2)  # cm2
    (0.79, 0.79)
    """
    layout = hexagonal(Ellipse(REACH_MM, REACH_MM), DISC_DENSITY_PER_CM2)
    return Population.of_layout(layout, UnrolledSkin(finger, RECEPTOR_X_MM).points, afferent)


def resting_response(afferent: Afferent) -> RestingResponse:
    """Simulate an afferent without any touch.

    Examples
    --------
    >>> resting_response(Afferent())
    RestingResponse(dynamic_rate_hz=0.0, static_rate_hz=0.0, first_spike_latency_ms=nan)
    """
    end_ms = protocol.RAMP.value + protocol.HOLD.value
    nothing = np.zeros((2, 1))
    further = None if afferent.dynamic_quantity == STORED_ENERGY else nothing
    times_ms = np.array([0.0, end_ms])
    sed = SedTraces(times_ms, nothing, dynamic_kpa=further, dynamic_quantity=afferent.dynamic_quantity)
    dynamic_hz, static_hz = afferent.rates(sed)
    return RestingResponse(
        dynamic_rate_hz=float(dynamic_hz[0]),
        static_rate_hz=float(static_hz[0]),
        first_spike_latency_ms=float(first_spike_latency_ms(afferent.spikes(sed))[0]),
    )


def touch_name(curvature_per_m: float) -> str:
    """Name of a sphere among the touches.

    Examples
    --------
    >>> touch_name(287.0)
    '287 /m'
    """
    return f"{curvature_per_m:g} /m"


def sheet(afferent: Afferent, reach_mm: float = REACH_MM, step_mm: float = STEP_MM) -> Population:
    """Place afferents side by side on a square about the contact point, ordered by x, then by z.

    Examples
    --------
    >>> len(sheet(Afferent(), reach_mm=1.0, step_mm=0.5).positions_mm)
    25
    """
    offsets = step_mm * np.arange(-round(reach_mm / step_mm), round(reach_mm / step_mm) + 1)
    x, z = RECEPTOR_X_MM + offsets, offsets
    sites = np.stack(np.meshgrid(x, z, indexing="ij"), axis=-1).reshape(-1, 2)
    return Population(positions_mm=sites, pitch_mm=step_mm, afferent=afferent)


def response_sheet(response: ResponseMap) -> ResponseSheet:
    """Arrange the responses of a `sheet` as tables.

    Parameters
    ----------
    response : ResponseMap
        Of its afferents.

    Returns
    -------
    ResponseSheet
    """
    x, z = (np.unique(coordinate) for coordinate in response.positions_mm.T)
    shape = (x.size, z.size)
    return ResponseSheet(
        x_mm=x,
        z_mm=z,
        dynamic_rate_hz=response.dynamic_rate_hz.reshape(shape),
        static_rate_hz=response.static_rate_hz.reshape(shape),
        first_spike_latency_ms=response.first_spike_latency_ms.reshape(shape),
    )


def finger_map(skin: SkinResponse, afferent: Afferent) -> FingerMap:
    """Simulate an afferent below every face of the skin.

    Parameters
    ----------
    skin : SkinResponse
        To one touch.
    afferent : Afferent
        Model of every afferent.

    Returns
    -------
    FingerMap
    """
    rest, mesh = resting_response(afferent), skin.mesh
    still, pressed = mesh.nodes_mm[mesh.skin_grid], (mesh.nodes_mm + skin.displacement_mm)[mesh.skin_grid]
    middle = 0.25 * (still[:-1, :-1] + still[1:, :-1] + still[1:, 1:] + still[:-1, 1:])
    response = Population(middle.reshape(-1, 3), STEP_MM, afferent).respond(skin)

    def evoked(rate_hz: FloatArray, resting_hz: float) -> FloatArray:
        kept = np.where((rate_hz > 0.0) & (rate_hz >= 2.0 * resting_hz), rate_hz, np.nan)
        return kept.reshape(middle.shape[:2])

    latency_ms = evoked_latency_ms(response.first_spike_latency_ms, rest.first_spike_latency_ms)
    return FingerMap(
        x_mm=pressed[..., 0],
        y_mm=pressed[..., 1],
        z_mm=pressed[..., 2],
        dynamic_rate_hz=evoked(response.dynamic_rate_hz, rest.dynamic_rate_hz),
        static_rate_hz=evoked(response.static_rate_hz, rest.static_rate_hz),
        first_spike_latency_ms=latency_ms.reshape(middle.shape[:2]),
        half=bool(mesh.symmetry_nodes.size),
    )


def recruitment(
    maps: Mapping[str, ResponseMap],
    area_per_afferent_mm2: float,
    resting_latency_ms: float = np.inf,
    shown: Sequence[str] | None = None,
) -> Recruitment:
    """Order of first spikes under several touches, and how it differs from that under the first.

    Parameters
    ----------
    maps : mapping of str to ResponseMap
        Responses of the same afferents by the names of the touches; the others are compared with the first.
    area_per_afferent_mm2 : float
        Skin per afferent, one over their density. [mm2]
    resting_latency_ms : float, optional
        First spike without a touch, see `fingerpad.neuron.response_maps.evoked_latency_ms`. Default: none.
        [ms]
    shown : sequence of str, optional
        Touches whose latencies are kept afferent by afferent. Default: all.

    Returns
    -------
    Recruitment

    Raises
    ------
    InputError
        If there is no touch, a touch has other afferents than the first, or the area is not positive.
    """
    area_mm2 = positive("area_per_afferent_mm2", area_per_afferent_mm2, "mm2")
    positions_mm = _same_afferents(maps).positions_mm
    latencies_ms = {
        name: evoked_latency_ms(response.first_spike_latency_ms, resting_latency_ms)
        for name, response in maps.items()
    }
    first_ms = next(iter(latencies_ms.values()))
    touches = []
    for name, latency_ms in latencies_ms.items():
        fires = np.isfinite(latency_ms)
        touches.append(
            TouchRecruitment(
                name=name,
                recruited_mm2=fires.sum() * area_mm2,
                recruited_in_ramp_mm2=float(recruited(latency_ms, protocol.RAMP.value) * area_mm2),
                first_ms=np.min(latency_ms[fires], initial=np.inf),
                median_ms=np.median(latency_ms[fires]) if fires.any() else np.nan,
                **asdict(order_change(first_ms, latency_ms)),
            )
        )
    return Recruitment(
        positions_mm=positions_mm,
        area_per_afferent_mm2=area_mm2,
        resting_latency_ms=resting_latency_ms,
        touches=tuple(touches),
        afferents=tuple(
            AfferentRecruitment(
                name=name,
                first_spike_latency_ms=latencies_ms[name],
                recruitment_rank=recruitment_rank(latencies_ms[name]),
            )
            for name in shown or maps
        ),
    )


def population_rates(
    maps: Mapping[str, ResponseMap],
    centre_mm: ArrayLike,
    density_per_cm2: float,
    radii_mm: Sequence[float] = RINGS_MM,
    resting_latency_ms: float = np.inf,
) -> PopulationRates:
    """Count spikes and active afferents over time, ring by ring about a point.

    Parameters
    ----------
    maps : mapping of str to ResponseMap
        Responses of the same afferents by the names of the touches.
    centre_mm : array_like
        Middle of the rings, in the coordinates of the positions. [mm]
    density_per_cm2 : float
        Afferents per area of the skin of interest, which may differ from the simulated density. [1/cm2]
    radii_mm : sequence of float, optional
        Inner radius of the first ring, then outer radii. [mm]
    resting_latency_ms : float, optional
        First spike of the afferents without a touch, kept for the report. Default: none. [ms]

    Returns
    -------
    PopulationRates

    Raises
    ------
    InputError
        If there is no touch, a touch has other afferents than the first, or `rings` refuses the radii.
    """
    first = _same_afferents(maps)
    ring = rings(first.positions_mm, centre_mm, radii_mm)
    inside = np.where(ring == NO_GROUP, NO_GROUP, 0)
    active_edges_ms = np.arange(0.0, RATE_EDGES_MS[-1] + ACTIVE_BIN_MS / 2, ACTIVE_BIN_MS)
    touches = []
    for name, response in maps.items():
        by_ring = population_rate(response.spikes, RATE_EDGES_MS, ring, SMOOTHING_MS)
        together = population_rate(response.spikes, RATE_EDGES_MS, inside, SMOOTHING_MS)
        touches.append(
            TouchRates(
                name=name,
                rate_hz=by_ring.rate_hz,
                active_fraction=population_rate(response.spikes, active_edges_ms, ring).active_fraction,
                together_per_cm2_hz=together.rate_per_area(density_per_cm2)[0],
            )
        )
    return PopulationRates(
        edges_ms=RATE_EDGES_MS,
        active_edges_ms=active_edges_ms,
        smoothing_ms=SMOOTHING_MS,
        density_per_cm2=density_per_cm2,
        resting_latency_ms=resting_latency_ms,
        radii_mm=np.array(radii_mm),
        n_afferents=np.bincount(ring[ring != NO_GROUP], minlength=len(radii_mm) - 1),
        touches=tuple(touches),
    )


def _same_afferents(maps: Mapping[str, ResponseMap]) -> ResponseMap:
    """Return the responses to the first touch, after a check that all touches have the same afferents."""
    if not maps:
        raise InputError("maps must hold at least one touch: it is empty.")
    first = next(iter(maps.values()))
    for name, response in maps.items():
        if not np.array_equal(response.positions_mm, first.positions_mm):
            raise InputError(
                f"maps must come from the same afferents: those of {name!r} are at other positions than "
                f"those of {next(iter(maps))!r}."
            )
    return first
