"""How far quick and standard are from the paper's mesh: 0.1 mm at skin and border over the whole pad.

The same touches are pressed into three meshes: six for the deflection of the skin, the bar at its edges, its
centre and beside it, four spheres at both positions. Half of the finger is solved, once the whole one as a
check; and twice the elements through the deep layers tell what the paper's size itself leaves open.
"""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass, replace
from typing import Any

import numpy as np

from fingerpad.core.checks import FloatArray
from fingerpad.data import psychophysics
from fingerpad.experiments.conditions import RECEPTOR_X_MM, Conditions
from fingerpad.experiments.gerling2014 import single_unit, skin_deflection, sphere_discrimination
from fingerpad.experiments.runner import Runner
from fingerpad.geometry.grading import resolution_grading
from fingerpad.geometry.mesh import LAYERS, Mesh, finger_mesh
from fingerpad.neuron.population import Population
from fingerpad.psychophysics.encoding import neighbour_pairs
from fingerpad.skin.behaviour import code_hash
from fingerpad.skin.indentation import Touch
from fingerpad.skin.sampling import SkinResponse
from studies.mesh_errors import (
    Reading,
    compare,
    differences,
    goodness_of_fit,
    hit_rates,
    largest_changes,
    read,
)
from studies.mesh_refinement import PEAK_SHIFT, SHIFTS_MM, Sphere
from studies.plain_values import plain

MESHES = ("quick", "standard", "paper")
REFERENCE = "paper"

CHOSEN_SHIFTS = tuple(SHIFTS_MM.index(shift) for shift in (-2.5, -1.5, -1.1, -0.1, 1.3, 1.7))
"""Both edges and a flank of each, the centre, and beside the bar."""

CURVATURES = (psychophysics.SPHERE_CURVATURES.value[0], 296.0, 316.0, 365.0)
"""The standard, the two comparisons with a published hit rate, and one between them. [1/m]"""

STANDARD_SPHERE: Sphere = (0.0, CURVATURES[0])
DEEP_ELEMENTS = 8
"""Elements through dermis and through subcutis, twice those of the paper's size."""

DISTANCES_MM = np.linspace(-skin_deflection.SHOWN_MM, skin_deflection.SHOWN_MM, 201)
"""Where profiles are compared: distance from the indenter, proximal positive. [mm]"""

PAD_HALF_AXES_MM = (5.5, 4.5)
"""The oval of skin, along and across, that is to have edges of 0.1 mm. [mm]"""

SUBCUTIS = LAYERS.index("subcutis")

Trial = tuple[str, str]
"""Tissues and indenter of a deflection."""


@dataclass(frozen=True)
class Touches:
    """What is pressed into one mesh.

    Parameters
    ----------
    deflection : dict of Touch
        By trial and indenter.
    bars : dict of Touch
        By the number of the bar's shift.
    spheres : dict of Touch
        By position along the finger [mm] and curvature [1/m].
    """

    deflection: dict[Trial, Touch]
    bars: dict[int, Touch]
    spheres: dict[Sphere, Touch]

    @classmethod
    def of(cls, resolution: str) -> Touches:
        """Touches of a named resolution, half of the finger."""
        conditions = Conditions(resolution)
        bars = single_unit.bar_touches(conditions)
        spheres = sphere_discrimination.discrimination_touches(conditions)
        return cls(
            {trial: half(touch) for trial, touch in skin_deflection.deflection_touches(conditions).items()},
            {shift: half(bars[shift]) for shift in CHOSEN_SHIFTS},
            {
                (position, curvature): half(spheres[position, curvature])
                for position in sphere_discrimination.POSITIONS_MM
                for curvature in CURVATURES
            },
        )

    def all(self) -> list[Touch]:
        """Every touch, bars and spheres first."""
        return [*self.bars.values(), *self.spheres.values(), *self.deflection.values()]


def half(touch: Touch) -> Touch:
    """Return the same touch on half of the finger; the paper's touches mirror each other across z = 0."""
    return replace(touch, grading=replace(touch.grading, full=False))


def whole_touch() -> Touch:
    """Return the standard sphere on both halves of the paper's size."""
    touch = Touches.of(REFERENCE).spheres[STANDARD_SPHERE]
    return replace(touch, grading=replace(touch.grading, full=True))


def deeper_touches() -> dict[str, Touch]:
    """Return bar (highest peak) and standard sphere, with twice the elements through the deep layers."""
    touches = Touches.of(REFERENCE)
    examples = {"bar": touches.bars[PEAK_SHIFT], "sphere": touches.spheres[STANDARD_SPHERE]}
    return {
        name: replace(touch, grading=replace(touch.grading, dermis=DEEP_ELEMENTS, subcutis=DEEP_ELEMENTS))
        for name, touch in examples.items()
    }


def run(runner: Runner) -> dict[str, Any]:
    """Press everything that is not stored yet, and compare quick and standard with the paper's size.

    23 presses at the paper's size or above it; finished ones are stored one by one, so a run that was
    stopped goes on.

    Parameters
    ----------
    runner : Runner
        Where indentations are stored.

    Returns
    -------
    dict
        Plain numbers, strings and lists, as `studies.pages.paper_size` shows them.

    Raises
    ------
    ConvergenceError
        If an indentation cannot be solved.
    """
    pressed = {name: Touches.of(name) for name in MESHES}
    deeper, whole = deeper_touches(), whole_touch()
    groups = {name: touches.all() for name, touches in pressed.items()}
    groups["checks"] = [*deeper.values(), whole]
    for name, touches in groups.items():
        runner.solve(touches, name)

    receptor = np.array([[RECEPTOR_X_MM, 0.0]])
    population = Population.grid(centre_mm=(RECEPTOR_X_MM, 0.0))
    neighbours = neighbour_pairs(population.positions_mm, population.pitch_mm)

    def reading(touches: Mapping[Any, Touch], receptors_mm: FloatArray) -> Reading:
        sheets = next(iter(touches.values())).grading.living_epidermis
        return read({key: runner.store.load(touch) for key, touch in touches.items()}, receptors_mm, sheets)

    deflection = {
        name: {trial: runner.store.load(touch) for trial, touch in touches.deflection.items()}
        for name, touches in pressed.items()
    }
    bars = {name: reading(touches.bars, receptor) for name, touches in pressed.items()}
    spheres = {name: reading(touches.spheres, population.positions_mm) for name, touches in pressed.items()}
    sphere = spheres[REFERENCE].only([STANDARD_SPHERE])
    return plain(
        {
            "code_hash": code_hash(),
            "preset": preset(),
            "meshes": {name: _sizes(touches) for name, touches in pressed.items()},
            "deflection": deflections(deflection),
            "bars": _bars(bars),
            "spheres": _spheres(spheres, neighbours),
            "half_against_whole": compare(sphere, reading({STANDARD_SPHERE: whole}, population.positions_mm)),
            "twice_as_deep": {
                "bar": largest_changes(
                    bars[REFERENCE].only([PEAK_SHIFT]), reading({0: deeper["bar"]}, receptor)
                ),
                "sphere": largest_changes(sphere, reading({0: deeper["sphere"]}, population.positions_mm)),
            },
        }
    )


def preset() -> dict[str, Any]:
    """Count and measure the preset as it is: both halves of the finger.

    Returns
    -------
    dict
        Nodes and elements; elements if each brick of the subcutis were cut into two wedges, which adds no
        node; and edges on the skin and on the epidermal-dermal border, see `pad_edges`.
    """
    conditions = Conditions(REFERENCE)
    mesh = finger_mesh(conditions.finger, resolution_grading(REFERENCE, RECEPTOR_X_MM))
    border = int((mesh.layer[: mesh.shape[2]] < LAYERS.index("dermis")).sum())
    return {
        "nodes": len(mesh.nodes_mm),
        "elements": len(mesh.elements),
        "elements_with_subcutis_of_wedges": len(mesh.elements) + int((mesh.layer == SUBCUTIS).sum()),
        "skin_edges": pad_edges(mesh, RECEPTOR_X_MM, below=0),
        "border_edges": pad_edges(mesh, RECEPTOR_X_MM, below=border),
    }


def pad_edges(mesh: Mesh, centre_mm: float, below: int) -> dict[str, float]:
    """Measure the edges on one sheet of nodes, below an oval of the volar skin.

    Parameters
    ----------
    mesh : Mesh
        Of a finger.
    centre_mm : float
        x of the middle of the oval, see `PAD_HALF_AXES_MM`. [mm]
    below : int
        How many elements lie above the sheet; 0 for the skin.

    Returns
    -------
    dict
        "count", and "median", "smallest" and "largest" length. [mm]
    """
    skin = mesh.nodes_mm[mesh.skin_grid]
    along, across = PAD_HALF_AXES_MM
    volar = skin[..., 1] < Conditions().finger.spine_y_mm
    pad = (((skin[..., 0] - centre_mm) / along) ** 2 + (skin[..., 2] / across) ** 2 < 1.0) & volar
    points = mesh.nodes_mm[mesh.skin_grid + below]  # nodes are numbered from skin to bone first
    edges = np.concatenate(
        [
            np.linalg.norm(np.diff(points, axis=0), axis=-1)[pad[:-1] & pad[1:]],
            np.linalg.norm(np.diff(points, axis=1), axis=-1)[pad[:, :-1] & pad[:, 1:]],
        ]
    )
    return {
        "count": edges.size,
        "median": float(np.median(edges)),
        "smallest": float(edges.min()),
        "largest": float(edges.max()),
    }


def _sizes(touches: Touches) -> dict[str, Any]:
    """Nodes and elements of each kind of touch."""
    (_, line), (_, cylinder) = list(touches.deflection.items())[:2]
    examples = {
        "line": line,
        "cylinder": cylinder,
        "bar": next(iter(touches.bars.values())),
        "sphere": next(iter(touches.spheres.values())),
    }
    return {
        name: {
            "nodes": len(touch.mesh.nodes_mm),
            "elements": len(touch.mesh.elements),
            "size_x_mm": touch.grading.core_size_mm or touch.grading.size_x_mm,
            "size_z_mm": touch.grading.size_z_mm,
            "counts": touch.grading.counts,
        }
        for name, touch in examples.items()
    }


def deflections(responses: Mapping[str, Mapping[Trial, SkinResponse]]) -> dict[str, Any]:
    """Profiles of the skin on every mesh, and their errors against the paper's size.

    Parameters
    ----------
    responses : mapping
        By mesh, then by trial and indenter.

    Returns
    -------
    dict
        "distance_mm"; "deflection_mm" at the end of the hold, by mesh and touch; and "errors": `differences`
        of the profile [mm], of the force as a share of the paper's size's, and R² against the observations
        under the cylinder on both meshes.
    """
    reference = responses[REFERENCE]
    return {
        "distance_mm": DISTANCES_MM,
        "deflection_mm": {
            name: {_named(trial): _profile(skin) for trial, skin in of_mesh.items()}
            for name, of_mesh in responses.items()
        },
        "errors": {
            name: {
                _named(trial): {
                    "profile": differences(_profile(skin), _profile(reference[trial])),
                    "force": float(skin.force_mn[-1] / reference[trial].force_mn[-1]) - 1.0,
                    "peak_force": float(skin.force_mn.max() / reference[trial].force_mn.max()) - 1.0,
                    "r2": _r2(trial, skin),
                    "r2_reference": _r2(trial, reference[trial]),
                }
                for trial, skin in of_mesh.items()
            }
            for name, of_mesh in responses.items()
            if name != REFERENCE
        },
    }


def _profile(skin: SkinResponse) -> FloatArray:
    return skin.surface_profile().at(-DISTANCES_MM)  # a profile counts distal as positive


def _r2(trial: Trial, skin: SkinResponse) -> float | None:
    return skin_deflection.deflection_r2(skin.surface_profile()) if trial[1] == "cylinder" else None


def _named(trial: Trial) -> str:
    """Name of a deflection in tables.

    >>> _named(("trial1", "line"))
    'trial 1, line'
    """
    return f"{trial[0].replace('trial', 'trial ')}, {trial[1]}"


def _bars(readings: Mapping[str, Reading]) -> dict[str, Any]:
    """Return what the receptor says at each shift, and how far that is from the paper's size."""
    reference = readings[REFERENCE]
    return {
        "shift_mm": [SHIFTS_MM[shift] for shift in CHOSEN_SHIFTS],
        "profiles": {
            name: {
                "sed_ramp_kpa": reading.sed_kpa["ramp"][:, 0],
                "sed_hold_kpa": reading.sed_kpa["hold"][:, 0],
                "dynamic_rate_hz": reading.rate_hz["dynamic"][:, 0],
                "static_rate_hz": reading.rate_hz["static"][:, 0],
                "latency_ms": reading.latency_ms[:, 0],
                "force_mn": reading.force_mn,
            }
            for name, reading in readings.items()
        },
        "errors": {
            name: compare(reading, reference) for name, reading in readings.items() if name != REFERENCE
        },
        "fss": {name: goodness_of_fit(reading) for name, reading in readings.items()},
    }


def _spheres(readings: Mapping[str, Reading], neighbours: np.ndarray) -> dict[str, Any]:
    """Return what 18 receptors say under each sphere, and what an observer makes of it."""
    reference = readings[REFERENCE]
    return {
        "position_mm": [position for position, _ in reference.touches],
        "curvature_per_m": [curvature for _, curvature in reference.touches],
        "largest_sed_ramp_kpa": {
            name: reading.sed_kpa["ramp"].max(axis=1) for name, reading in readings.items()
        },
        "errors": {
            name: {
                f"{position:g}": compare(reading, reference.only(_at(position)))
                for position in sphere_discrimination.POSITIONS_MM
            }
            for name, reading in readings.items()
            if name != REFERENCE
        },
        "comparisons_per_m": CURVATURES[1:],
        "hit_rates": {
            name: {
                f"{position:g}": hit_rates(reading, position, CURVATURES, neighbours)
                for position in sphere_discrimination.POSITIONS_MM
            }
            for name, reading in readings.items()
        },
    }


def _at(position_mm: float) -> list[Sphere]:
    return [(position_mm, curvature) for curvature in CURVATURES]
