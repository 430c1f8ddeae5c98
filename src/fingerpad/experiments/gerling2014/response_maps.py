"""Level 3, Figure 6: what afferents all over the pad answer to a sphere, in which order and how fast.

A dense sheet of afferents stands for the population of any density: whoever ends at a place answers what the
sheet answers there. For maps it is square, seen from below; where skin is measured it is even by its area.
Beside the paper's three maps stands what it names and leaves open (section 4.2): the order of first spikes,
which is a code of its own (Johansson & Birznieks 2004), and the population rate.
"""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import asdict
from typing import Any

import numpy as np
from numpy.typing import ArrayLike

from fingerpad.core.checks import positive
from fingerpad.core.errors import InputError
from fingerpad.core.layouts import MM2_PER_CM2, hexagonal
from fingerpad.core.regions import Ellipse
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
"""As dense as the sheet: sixteen stand for one of the paper's. [1/cm2]"""

RINGS_MM = (0.0, 1.0, 2.0, 3.0, 4.0)
"""Inner radius of the first ring about the contact, and the outer radius of each. [mm]"""

RATE_EDGES_MS = np.concatenate([np.arange(0.0, 150.0, 1.0), np.arange(150.0, 1000.1, 25.0)])
"""Borders of the bins of the population rate: fine while it changes fast. [ms]"""

SMOOTHING_MS = 2.0
"""Standard deviation of the normal density that smooths the population rate. [ms]"""

ACTIVE_BIN_MS = 10.0
"""Bins in which afferents count as active or not: the interval of one that fires 100 spikes/s. [ms]"""

MEASURES = ("dynamic_rate_hz", "static_rate_hz", "first_spike_latency_ms")


def result(standard: SkinResponse, afferent: Afferent) -> dict[str, Any]:
    """Ask a dense sheet of afferents under the standard sphere (Figure 6).

    Parameters
    ----------
    standard : SkinResponse
        Skin under that sphere.
    afferent : Afferent
        What every one of the sheet is.

    Returns
    -------
    dict
        Three maps over "x_mm" and "z_mm", the 18 receptors among them, "finger" with the same three on the
        deformed finger, and the same of an afferent "at_rest".
    """
    return {
        "curvature_per_m": protocol.STANDARD_CURVATURE.value,
        "at_rest": at_rest(afferent),
        **maps(sheet(afferent).respond(standard)),
        "receptors_mm": Population.grid(afferent=afferent, centre_mm=(RECEPTOR_X_MM, 0.0)).positions_mm,
        "finger": on_the_finger(standard, afferent),
    }


def timing(
    responses: Mapping[tuple[float, float], SkinResponse],
    afferent: Afferent,
    finger: Fingertip | None = None,
) -> dict[str, Any]:
    """Ask afferents all around the contact who fires first and how much at a time, under every sphere.

    Parameters
    ----------
    responses : mapping of (position, curvature) to SkinResponse
        Skin under the spheres, as `sphere_discrimination.touches` names them. [mm], [1/m]
    afferent : Afferent
        What every one of them is.
    finger : Fingertip, optional
        Whose skin. Default: `Fingertip()`.

    Returns
    -------
    dict
        "recruitment" (see `recruitment`) by every sphere over the middle and by the standard at the other
        position; "rates" (see `rates`) under the standard and the most curved.
    """
    finger = finger or Fingertip()
    standard = protocol.STANDARD_CURVATURE.value
    here, shifted = protocol.SPHERE_POSITIONS.value
    population, rest = disc(finger, afferent), at_rest(afferent)
    answers = {
        touch_name(curvature): population.respond(responses[here, curvature])
        for position, curvature in sorted(responses)
        if position == here
    }
    moved = f"{touch_name(standard)}, {shifted - here:g} mm away"
    answers[moved] = population.respond(responses[shifted, standard])
    names = touch_name(standard), touch_name(max(curvature for _, curvature in responses))
    return {
        "recruitment": recruitment(
            answers,
            MM2_PER_CM2 / DISC_DENSITY_PER_CM2,
            resting_latency_ms=rest["first_spike_latency_ms"],
            shown=(*names, moved),
        ),
        "rates": rates(
            {name: answers[name] for name in names},
            finger.skin_point(RECEPTOR_X_MM + here, 0.0),
            density_per_cm2=psychophysics.RECEPTOR_DENSITY.value,
            resting_latency_ms=rest["first_spike_latency_ms"],
        ),
    }


def disc(finger: Fingertip, afferent: Afferent) -> Population:
    """Lay afferents densely and evenly, by area of skin, over a disc about the contact point.

    Examples
    --------
    >>> population = disc(Fingertip(), Afferent())
    >>> round(len(population) / DISC_DENSITY_PER_CM2, 2), round(np.pi * 0.5**2, 2)  # cm2
    (0.79, 0.79)
    """
    layout = hexagonal(Ellipse(REACH_MM, REACH_MM), DISC_DENSITY_PER_CM2)
    return Population.of_layout(layout, UnrolledSkin(finger, RECEPTOR_X_MM).points, afferent)


def at_rest(afferent: Afferent) -> dict[str, float]:
    """Say what an afferent does without any touch: the three measures, NaN for a latency without a spike.

    Examples
    --------
    >>> at_rest(Afferent())
    {'dynamic_rate_hz': 0.0, 'static_rate_hz': 0.0, 'first_spike_latency_ms': nan}
    """
    end_ms = protocol.RAMP.value + protocol.HOLD.value
    nothing = np.zeros((2, 1))
    further = None if afferent.dynamic_quantity == STORED_ENERGY else nothing
    times_ms = np.array([0.0, end_ms])
    sed = SedTraces(times_ms, nothing, dynamic_kpa=further, dynamic_quantity=afferent.dynamic_quantity)
    dynamic_hz, static_hz = afferent.rates(sed)
    first_ms = first_spike_latency_ms(afferent.spikes(sed))
    return dict(zip(MEASURES, (float(found[0]) for found in (dynamic_hz, static_hz, first_ms)), strict=True))


def touch_name(curvature_per_m: float) -> str:
    """Name of a sphere among the touches.

    Examples
    --------
    >>> touch_name(287.0)
    '287 /m'
    """
    return f"{curvature_per_m:g} /m"


def sheet(afferent: Afferent, reach_mm: float = REACH_MM, step_mm: float = STEP_MM) -> Population:
    """Lay afferents side by side over a square about the contact point, ordered by x, then by z.

    Examples
    --------
    >>> len(sheet(Afferent(), reach_mm=1.0, step_mm=0.5).positions_mm)
    25
    """
    offsets = step_mm * np.arange(-round(reach_mm / step_mm), round(reach_mm / step_mm) + 1)
    x, z = RECEPTOR_X_MM + offsets, offsets
    sites = np.stack(np.meshgrid(x, z, indexing="ij"), axis=-1).reshape(-1, 2)
    return Population(positions_mm=sites, pitch_mm=step_mm, afferent=afferent)


def maps(answer: ResponseMap) -> dict[str, Any]:
    """Responses of a sheet as tables over x (rows) and z (columns)."""
    x, z = (np.unique(coordinate) for coordinate in answer.positions_mm.T)
    found = {name: getattr(answer, name).reshape(x.size, z.size) for name in MEASURES}
    return {"x_mm": x, "z_mm": z, **found}


def on_the_finger(skin: SkinResponse, afferent: Afferent) -> dict[str, Any]:
    """Responses below every face of the skin, and where touch moves it by the end of the hold.

    Returns
    -------
    dict
        Deformed corners of the faces, "x_mm", "y_mm" and "z_mm" (n_along + 1, n_around + 1), the three
        measures of the afferent below the middle of each face (n_along, n_around), NaN where it does not
        answer or less than twice as fast as at rest, and whether they are one "half" of the finger.
    """
    rest = at_rest(afferent)
    mesh = skin.mesh
    still, pressed = mesh.nodes_mm[mesh.skin_grid], (mesh.nodes_mm + skin.displacement_mm)[mesh.skin_grid]
    middle = 0.25 * (still[:-1, :-1] + still[1:, :-1] + still[1:, 1:] + still[:-1, 1:])
    answer = Population(middle.reshape(-1, 3), STEP_MM, afferent).respond(skin)
    found: dict[str, Any] = {name: pressed[..., axis] for axis, name in enumerate(("x_mm", "y_mm", "z_mm"))}
    for name in MEASURES:
        values = getattr(answer, name).reshape(middle.shape[:2])
        if name == "first_spike_latency_ms":
            values = evoked_latency_ms(values.ravel(), rest[name]).reshape(values.shape)
        else:
            values = np.where((values > 0.0) & (values >= 2.0 * rest[name]), values, np.nan)
        found[name] = values
    return found | {"half": bool(mesh.symmetry_nodes.size)}


def recruitment(
    answers: Mapping[str, ResponseMap],
    area_per_afferent_mm2: float,
    resting_latency_ms: float = np.inf,
    shown: Sequence[str] | None = None,
) -> dict[str, Any]:
    """Order of first spikes under several touches, and how it differs from that under the first.

    Parameters
    ----------
    answers : mapping of str to ResponseMap
        Answers of the same afferents, by the names of the touches; what the others are compared with first.
    area_per_afferent_mm2 : float
        Skin that each of them stands for, one over their density. [mm2]
    resting_latency_ms : float, optional
        When they would first fire without a touch, see `response_maps.evoked_latency_ms`. Default: never.
        [ms]
    shown : sequence of str, optional
        Touches whose latencies are kept afferent by afferent. Default: all.

    Returns
    -------
    dict
        "positions_mm"; "area_per_afferent_mm2"; "resting_latency_ms"; "touches", one row of numbers each; and
        "afferents", each touch with "first_spike_latency_ms" and "recruitment_rank" of every afferent.

    Raises
    ------
    InputError
        If there is no touch, a touch has other afferents than the first, or the area is not positive.
    """
    positive("area_per_afferent_mm2", area_per_afferent_mm2, "mm2")
    positions_mm = _same_afferents(answers).positions_mm
    latencies_ms = {
        name: evoked_latency_ms(answer.first_spike_latency_ms, resting_latency_ms)
        for name, answer in answers.items()
    }
    first_ms = next(iter(latencies_ms.values()))
    rows = []
    for name, latency_ms in latencies_ms.items():
        fires = np.isfinite(latency_ms)
        rows.append(
            {
                "name": name,
                "recruited_mm2": fires.sum() * area_per_afferent_mm2,
                "recruited_in_ramp_mm2": recruited(latency_ms, protocol.RAMP.value) * area_per_afferent_mm2,
                "first_ms": np.min(latency_ms[fires], initial=np.inf),
                "median_ms": np.median(latency_ms[fires]) if fires.any() else np.nan,
                **asdict(order_change(first_ms, latency_ms)),
            }
        )
    return {
        "positions_mm": positions_mm,
        "area_per_afferent_mm2": area_per_afferent_mm2,
        "resting_latency_ms": resting_latency_ms,
        "touches": rows,
        "afferents": [
            {
                "name": name,
                "first_spike_latency_ms": latencies_ms[name],
                "recruitment_rank": recruitment_rank(latencies_ms[name]),
            }
            for name in shown or answers
        ],
    }


def rates(
    answers: Mapping[str, ResponseMap],
    centre_mm: ArrayLike,
    density_per_cm2: float,
    radii_mm: Sequence[float] = RINGS_MM,
    resting_latency_ms: float = np.inf,
) -> dict[str, Any]:
    """Count spikes and active afferents over time, ring by ring about a point.

    Parameters
    ----------
    answers : mapping of str to ResponseMap
        Answers of the same afferents, by the names of the touches.
    centre_mm : array_like
        Middle of the rings, in the coordinates of the positions. [mm]
    density_per_cm2 : float
        Afferents per area of the skin that is meant, which need not be as dense as those that answer. [1/cm2]
    radii_mm : sequence of float, optional
        Inner radius of the first ring, then outer radii. [mm]
    resting_latency_ms : float, optional
        When the afferents would first fire without a touch, for readers of the result. Default: never. [ms]

    Returns
    -------
    dict
        "edges_ms", "active_edges_ms", "smoothing_ms", "density_per_cm2", "resting_latency_ms", "radii_mm",
        "n_afferents" of each ring, and "touches", each with "rate_hz" per afferent (n_rings, n_bins),
        "active_fraction" (n_rings, n_active_bins) and "together_per_cm2_hz", the rate of all rings per area
        (n_bins,).

    Raises
    ------
    InputError
        If there is no touch, a touch has other afferents than the first, or `rings` refuses the radii.
    """
    first = _same_afferents(answers)
    ring = rings(first.positions_mm, centre_mm, radii_mm)
    inside = np.where(ring == NO_GROUP, NO_GROUP, 0)
    active_edges_ms = np.arange(0.0, RATE_EDGES_MS[-1] + ACTIVE_BIN_MS / 2, ACTIVE_BIN_MS)
    touches = []
    for name, answer in answers.items():
        by_ring = population_rate(answer.spikes, RATE_EDGES_MS, ring, SMOOTHING_MS)
        together = population_rate(answer.spikes, RATE_EDGES_MS, inside, SMOOTHING_MS)
        touches.append(
            {
                "name": name,
                "rate_hz": by_ring.rate_hz,
                "active_fraction": population_rate(answer.spikes, active_edges_ms, ring).active_fraction,
                "together_per_cm2_hz": together.rate_per_area(density_per_cm2)[0],
            }
        )
    return {
        "edges_ms": RATE_EDGES_MS,
        "active_edges_ms": active_edges_ms,
        "smoothing_ms": SMOOTHING_MS,
        "density_per_cm2": density_per_cm2,
        "resting_latency_ms": resting_latency_ms,
        "radii_mm": radii_mm,
        "n_afferents": np.bincount(ring[ring != NO_GROUP], minlength=len(radii_mm) - 1),
        "touches": touches,
    }


def _same_afferents(answers: Mapping[str, ResponseMap]) -> ResponseMap:
    """Answer to the first touch, after a check that all touches have its afferents."""
    if not answers:
        raise InputError("answers must hold at least one touch: it is empty.")
    first = next(iter(answers.values()))
    for name, answer in answers.items():
        if not np.array_equal(answer.positions_mm, first.positions_mm):
            raise InputError(
                f"answers must come from the same afferents: those of {name!r} are at other positions than "
                f"those of {next(iter(answers))!r}."
            )
    return first
