"""Order of first spikes and population rate about the contact under the paper's spheres.

The order of first spikes is a code of its own (Johansson & Birznieks 2004), which the paper names in section
4.2 and does not use. Afferents lie densely on a disc about the contact, evenly by area of skin.
"""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import asdict

import numpy as np
from numpy.typing import ArrayLike

from fingerpad.core.checks import positive
from fingerpad.core.errors import InputError
from fingerpad.core.layouts import MM2_PER_CM2
from fingerpad.core.patterns import hexagonal
from fingerpad.core.regions import Ellipse
from fingerpad.core.results import Matrix, Number, Vector, WholeVector, result_class
from fingerpad.core.signals import ResponseMap
from fingerpad.data import protocol, psychophysics
from fingerpad.experiments.conditions import RECEPTOR_X_MM, Conditions
from fingerpad.experiments.gerling2014.sphere_discrimination import discrimination_touches
from fingerpad.experiments.gerling2014.three_levels import resting_response
from fingerpad.experiments.manifest import Manifest
from fingerpad.experiments.runner import Runner
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
from fingerpad.skin.sampling import SkinResponse
from fingerpad.skin.unrolled_skin import UnrolledSkin
from studies.fitted_bars import fit_bars

REACH_MM = 5.0
"""Radius of the disc. [mm]"""

DISC_DENSITY_PER_CM2 = 1600.0
"""Density of the disc, sixteen times that of the paper. [1/cm2]"""

RINGS_MM = (0.0, 1.0, 2.0, 3.0, 4.0)
"""Inner radius of the first ring about the contact, and the outer radius of each. [mm]"""

RATE_EDGES_MS = np.concatenate([np.arange(0.0, 150.0, 1.0), np.arange(150.0, 1000.1, 25.0)])
"""Edges of the bins of the population rate, narrow where it changes fast. [ms]"""

SMOOTHING_MS = 2.0
"""Standard deviation of the normal density that smooths the population rate. [ms]"""

ACTIVE_BIN_MS = 10.0
"""Bins in which afferents count as active or not: the interspike interval at 100 spikes/s. [ms]"""


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


@result_class
class PopulationTimingStudy:
    """Result of `python -m studies population-timing`.

    Parameters
    ----------
    timing : PopulationTiming
        Of the fitted afferent.
    manifest : Manifest
        What ran.
    """

    timing: PopulationTiming
    manifest: Manifest


def run(runner: Runner, conditions: Conditions) -> PopulationTimingStudy:
    """Fit the afferent to the bars, and put it all around the contact under every sphere.

    Parameters
    ----------
    runner : Runner
        Where indentations are stored.
    conditions : Conditions
        Finger, tissues, resolution and seed.

    Returns
    -------
    PopulationTimingStudy

    Raises
    ------
    ConvergenceError
        If an indentation cannot be solved; finished ones stay stored.
    StoreError
        If a stored indentation is damaged or the folder cannot be written.
    """
    fitted = fit_bars(runner, conditions, {"spheres": discrimination_touches(conditions)})
    with runner.stage("population over time", 1) as advance:
        timing = population_timing(fitted.others["spheres"], fitted.afferent)
        advance()
    return PopulationTimingStudy(timing=timing, manifest=runner.manifest(conditions))


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


def touch_name(curvature_per_m: float) -> str:
    """Name of a sphere among the touches.

    Examples
    --------
    >>> touch_name(287.0)
    '287 /m'
    """
    return f"{curvature_per_m:g} /m"


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
