"""How far the meshes are from a finer one: in strain energy density, in firing rates, in hit rates.

The same bars and spheres are pressed into a family of meshes. What the neural half makes of the difference is
the error that a mesh carries into the results: afferent, noise and random numbers stay the same.
"""

from __future__ import annotations

import math
from collections.abc import Mapping
from dataclasses import dataclass, replace
from typing import Any

import numpy as np

from fingerpad.core.checks import positive
from fingerpad.data import protocol, psychophysics
from fingerpad.experiments.conditions import RECEPTOR_X_MM, Conditions
from fingerpad.experiments.gerling2014 import single_unit, sphere_discrimination
from fingerpad.experiments.runner import Runner
from fingerpad.geometry.grading import Grading
from fingerpad.mechanics.press import PressSettings
from fingerpad.neuron.population import Population
from fingerpad.psychophysics.encoding import neighbour_pairs
from fingerpad.skin.behaviour import code_hash
from fingerpad.skin.indentation import Touch
from studies.mesh_errors import (
    Reading,
    compare,
    goodness_of_fit,
    hit_rates,
    largest_changes,
    observed_order,
    read,
)
from studies.plain_values import plain

Sphere = tuple[float, float]
"""Position along the finger [mm] and curvature [1/m]."""

SHIFTS_MM = protocol.BAR_SHIFTS.value
EVERY_SHIFT = tuple(range(len(SHIFTS_MM)))
EVERY_SPHERE: tuple[Sphere, ...] = tuple(
    (position, curvature)
    for position in sphere_discrimination.POSITIONS_MM
    for curvature in sphere_discrimination.CURVATURES
)

CHOSEN_SHIFTS = tuple(
    SHIFTS_MM.index(shift) for shift in (-2.5, -1.9, -1.5, -1.3, -1.1, -0.9, -0.1, 0.9, 1.1, 1.3, 1.5, 1.7)
)
"""Shifts for meshes that take minutes a press: flanks and peak at both edges, centre and far side."""

CHOSEN_CURVATURES = (protocol.STANDARD_CURVATURE.value, *psychophysics.GOODWIN_CURVATURES.value)
CHOSEN_SPHERES: tuple[Sphere, ...] = tuple((0.0, curvature) for curvature in CHOSEN_CURVATURES)
"""The standard and the two comparisons with a published hit rate."""

PEAK_SHIFT = SHIFTS_MM.index(1.3)
"""Where strain energy density is largest."""


@dataclass(frozen=True)
class Level:
    """One mesh and what is pressed into it.

    Parameters
    ----------
    name : str
        What tables call it.
    resolution : {"quick", "standard"}
        Whose meshes and steps it starts from.
    factor : float
        By how much its elements are smaller, see `refined`.
    shifts : tuple of int
        Which of the bar's shifts are pressed.
    spheres : tuple of (float, float)
        Which spheres are pressed: position [mm] and curvature [1/m].
    """

    name: str
    resolution: str
    factor: float = 1.0
    shifts: tuple[int, ...] = EVERY_SHIFT
    spheres: tuple[Sphere, ...] = EVERY_SPHERE

    def bars(self) -> dict[int, Touch]:
        """Touches of the bar, by the number of their shift."""
        touches = single_unit.bar_touches(Conditions(self.resolution))
        return {shift: _at_factor(touches[shift], self.factor) for shift in self.shifts}

    def balls(self) -> dict[Sphere, Touch]:
        """Touches of the spheres, by position and curvature."""
        touches = sphere_discrimination.discrimination_touches(Conditions(self.resolution))
        return {sphere: _at_factor(touches[sphere], self.factor) for sphere in self.spheres}


LEVELS = (
    Level("coarse", "standard", 0.5, CHOSEN_SHIFTS, CHOSEN_SPHERES),
    Level("quick", "quick"),
    Level("standard", "standard"),
    Level("fine", "standard", 1.5, CHOSEN_SHIFTS, CHOSEN_SPHERES),
)
"""From coarse to fine. All but quick are similar to each other, so that they show an order of convergence."""

_EPIDERMIS = {"stratum_corneum": 8, "living_epidermis": 2}
ONE_AT_A_TIME: dict[str, dict[str, dict[str, Any]]] = {
    "bar": {
        "half the size along the finger": {"size_x_mm": 0.05},
        "half the size across the finger": {"size_z_mm": 0.25},
        "twice the elements through the epidermis": _EPIDERMIS,
        "twice the elements through the dermis": {"dermis": 8},
        "twice the elements through the subcutis": {"subcutis": 8},
        "twice the elements through dermis and subcutis": {"dermis": 8, "subcutis": 8},
        "half the growth and the largest size": {"growth": 1.3**0.5, "largest_mm": 1.5},
    },
    "sphere": {
        "two thirds of the size along and across": {"size_x_mm": 0.25 / 1.5, "size_z_mm": 0.25 / 1.5},
        "twice the elements through the epidermis": _EPIDERMIS,
        "twice the elements through dermis and subcutis": {"dermis": 8, "subcutis": 8},
    },
}
"""Changes of the standard meshes, each on its own, under the bar at its highest peak and the first sphere."""

STEPS = (8, 32)
"""Steps in ramp and in hold that are compared, on the quick mesh."""


def refined(grading: Grading, factor: float) -> Grading:
    """Mesh with the same zones and elements smaller by one factor in every direction.

    Sizes are divided by the factor, numbers of elements through each layer multiplied and rounded up. Sizes
    grow by growth^(1/factor) from one element to the next, hence as fast with distance as before.

    Parameters
    ----------
    grading : Grading
        Where the mesh is fine.
    factor : float
        Above 1 for smaller elements.

    Returns
    -------
    Grading

    Raises
    ------
    InputError
        If the factor is not a number above 0.

    Examples
    --------
    >>> finer = refined(Grading(17.0, 2.0, 1.0, 0.2, 0.4), 2.0)
    >>> finer.size_x_mm, finer.size_z_mm, finer.counts
    (0.1, 0.2, (8, 2, 8, 8))
    """
    positive("factor", factor)
    layers = ("stratum_corneum", "living_epidermis", "dermis", "subcutis")
    return replace(
        grading,
        size_x_mm=grading.size_x_mm / factor,
        size_z_mm=grading.size_z_mm / factor,
        core_size_mm=grading.core_size_mm / factor,
        largest_mm=grading.largest_mm / factor,
        # A coarser mesh would outgrow what a grading allows to neighbours.
        growth=min(grading.growth ** (1.0 / factor), 1.3),
        **{name: math.ceil(factor * getattr(grading, name) - 1e-9) for name in layers},
    )


def _at_factor(touch: Touch, factor: float) -> Touch:
    return touch if factor == 1.0 else replace(touch, grading=refined(touch.grading, factor))


def single_changes() -> dict[str, dict[str, Touch]]:
    """Return bar and sphere on standard meshes that differ from the preset in one thing."""
    presets = _examples(Conditions("standard"))
    return {
        name: {
            change: replace(touch, grading=replace(touch.grading, **values))
            for change, values in ONE_AT_A_TIME[name].items()
        }
        for name, touch in presets.items()
    }


def step_changes() -> dict[str, dict[int, Touch]]:
    """Return bar and sphere on quick meshes, by number of steps."""
    return {
        name: {count: replace(touch, settings=PressSettings(count, count)) for count in STEPS}
        for name, touch in _examples(Conditions("quick")).items()
    }


def _examples(conditions: Conditions) -> dict[str, Touch]:
    """Return the bar at its highest peak and the standard sphere."""
    return {
        "bar": single_unit.bar_touches(conditions)[PEAK_SHIFT],
        "sphere": sphere_discrimination.discrimination_touches(conditions)[CHOSEN_SPHERES[0]],
    }


def run(runner: Runner) -> dict[str, Any]:
    """Press everything that is not stored yet, and compare the meshes.

    About an hour on one core. Finished touches are stored one by one, so a run that was stopped goes on.

    Parameters
    ----------
    runner : Runner
        Where indentations are stored.

    Returns
    -------
    dict
        Plain numbers, strings and lists, as `studies.pages.mesh_refinement` shows them.

    Raises
    ------
    ConvergenceError
        If an indentation cannot be solved.
    """
    pressed = {level.name: (level.bars(), level.balls()) for level in LEVELS}
    changes, steps = single_changes(), step_changes()
    groups: dict[str, list[Touch]] = {
        name: [*bars.values(), *balls.values()] for name, (bars, balls) in pressed.items()
    }
    groups["one at a time"] = [touch for each in changes.values() for touch in each.values()]
    groups["steps"] = [touch for counts in steps.values() for touch in counts.values()]
    for name, touches in groups.items():
        runner.solve(touches, name)

    population = Population.grid(centre_mm=(RECEPTOR_X_MM, 0.0))
    receptor = np.array([[RECEPTOR_X_MM, 0.0]])

    def reading(touches: Mapping[Any, Touch], receptors_mm: np.ndarray) -> Reading:
        sheets = next(iter(touches.values())).grading.living_epidermis
        return read({key: runner.store.load(touch) for key, touch in touches.items()}, receptors_mm, sheets)

    bars = {name: reading(touches, receptor) for name, (touches, _) in pressed.items()}
    balls = {name: reading(touches, population.positions_mm) for name, (_, touches) in pressed.items()}
    receptors = {"bar": receptor, "sphere": population.positions_mm}
    standard = {
        "bar": bars["standard"].only([PEAK_SHIFT]),
        "sphere": balls["standard"].only(CHOSEN_SPHERES[:1]),
    }
    neighbours = neighbour_pairs(population.positions_mm, population.pitch_mm)
    return plain(
        {
            "code_hash": code_hash(),
            "levels": [_described(level) for level in LEVELS],
            "bars": _bars(bars),
            "spheres": _balls(balls, neighbours),
            "one_at_a_time": {
                name: {
                    change: largest_changes(standard[name], reading({0: touch}, receptors[name]))
                    for change, touch in each.items()
                }
                for name, each in changes.items()
            },
            "steps": {
                name: _steps({count: reading({0: touch}, receptors[name]) for count, touch in counts.items()})
                for name, counts in steps.items()
            },
        }
    )


def _described(level: Level) -> dict[str, Any]:
    """Sizes of the meshes of a level."""
    described: dict[str, Any] = {"name": level.name, "factor": level.factor, "resolution": level.resolution}
    for name, touch in (
        ("bar", next(iter(level.bars().values()))),
        ("sphere", next(iter(level.balls().values()))),
    ):
        described[name] = {
            "nodes": len(touch.mesh.nodes_mm),
            "size_x_mm": touch.grading.size_x_mm,
            "size_z_mm": touch.grading.size_z_mm,
            "counts": touch.grading.counts,
        }
    return described


def _bars(readings: Mapping[str, Reading]) -> dict[str, Any]:
    """Profiles over the shifts, errors against the finest mesh, orders."""
    finest = readings[LEVELS[-1].name]
    return {
        "profiles": {
            name: {
                "shift_mm": [SHIFTS_MM[shift] for shift in reading.touches],
                "sed_ramp_kpa": reading.sed_kpa["ramp"][:, 0],
                "sed_hold_kpa": reading.sed_kpa["hold"][:, 0],
                "dynamic_rate_hz": reading.rate_hz["dynamic"][:, 0],
                "static_rate_hz": reading.rate_hz["static"][:, 0],
                "force_mn": reading.force_mn,
            }
            for name, reading in readings.items()
        },
        "errors": {
            name: compare(reading, finest)
            | {"fss": goodness_of_fit(reading.only(finest.touches)), "fss_finest": goodness_of_fit(finest)}
            for name, reading in readings.items()
            if reading is not finest
        },
        "quick_to_standard": compare(readings["quick"], readings["standard"])
        | {"fss": goodness_of_fit(readings["quick"]), "fss_finest": goodness_of_fit(readings["standard"])},
        "orders": _orders(readings),
    }


def _orders(readings: Mapping[str, Reading]) -> list[dict[str, Any]]:
    """Order and limit of each touch's largest SED at the end of the ramp, on the three similar meshes."""
    similar = [level for level in LEVELS if level.resolution == "standard"]
    rows = []
    for touch in readings[similar[-1].name].touches:
        sed = np.array([readings[level.name].only([touch]).sed_kpa["ramp"][0] for level in similar])
        values = sed[:, sed[-1].argmax()]
        found = observed_order(values.tolist(), [level.factor for level in similar])
        order, limit = found if found else (None, None)
        rows.append({"touch": _named(touch), "sed_kpa": values, "order": order, "limit_kpa": limit})
    return rows


def _named(touch: int | Sphere) -> str:
    """Name of a touch in tables.

    >>> _named(0), _named((0.0, 287.0))
    ('bar, shift -3.5 mm', 'sphere 287 /m at 0 mm')
    """
    if isinstance(touch, int):
        return f"bar, shift {SHIFTS_MM[touch]:g} mm"
    return f"sphere {touch[1]:g} /m at {touch[0]:g} mm"


def _balls(readings: Mapping[str, Reading], neighbours: np.ndarray) -> dict[str, Any]:
    """Errors at all receptors against the finest mesh, and hit rates with the same random numbers."""
    finest = readings[LEVELS[-1].name]
    curvatures = sphere_discrimination.CURVATURES
    return {
        "errors": {
            name: compare(reading, finest) for name, reading in readings.items() if reading is not finest
        },
        "quick_to_standard": compare(readings["quick"], readings["standard"]),
        "orders": _orders(readings),
        "comparisons_per_m": CHOSEN_CURVATURES[1:],
        "hit_rates": {
            name: hit_rates(reading, 0.0, CHOSEN_CURVATURES, neighbours) for name, reading in readings.items()
        },
        "all_comparisons_per_m": curvatures[1:],
        "all_hit_rates": {
            name: {
                f"{position:g}": hit_rates(readings[name], position, curvatures, neighbours)
                for position in sphere_discrimination.POSITIONS_MM
            }
            for name in ("quick", "standard")
        },
    }


def _steps(readings: Mapping[int, Reading]) -> dict[str, Any]:
    """Errors of few steps against many."""
    few, many = (readings[count] for count in STEPS)
    return compare(few, many) | {"steps": STEPS}
