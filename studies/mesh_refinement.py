"""Differences between meshes and a finer one: strain energy density (SED), firing rates, hit rates.

The same bars and spheres are indented on a family of meshes. Afferent, noise and random numbers are the same
on each, so that differences in rates and hit rates are errors of the mesh.
"""

from __future__ import annotations

import math
from collections.abc import Mapping
from dataclasses import dataclass, replace
from typing import Any

import numpy as np

from fingerpad.core.checks import positive
from fingerpad.core.results import Number, Vector, result_class
from fingerpad.data import protocol, psychophysics
from fingerpad.experiments.conditions import RECEPTOR_X_MM, Conditions
from fingerpad.experiments.gerling2014 import single_unit, sphere_discrimination
from fingerpad.experiments.runner import Runner
from fingerpad.geometry.grading import Grading
from fingerpad.mechanics.press_settings import PressSettings
from fingerpad.neuron.population import Population
from fingerpad.psychophysics.encoding import neighbour_pairs
from fingerpad.skin.code_hash import code_hash
from fingerpad.skin.indentation import Touch
from studies.mesh_errors import (
    BarProfile,
    HitRates,
    LargestChanges,
    MeshErrors,
    MeshSize,
    Reading,
    compare,
    goodness_of_fit,
    hit_rates,
    largest_changes,
    observed_order,
    read_stored,
)
from studies.study import TISSUES

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
        touches = single_unit.bar_touches(Conditions(self.resolution, tissues=TISSUES))
        return {shift: _at_factor(touches[shift], self.factor) for shift in self.shifts}

    def balls(self) -> dict[Sphere, Touch]:
        """Touches of the spheres, by position and curvature."""
        touches = sphere_discrimination.discrimination_touches(Conditions(self.resolution, tissues=TISSUES))
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
    presets = _examples(Conditions("standard", tissues=TISSUES))
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
        for name, touch in _examples(Conditions("quick", tissues=TISSUES)).items()
    }


def _examples(conditions: Conditions) -> dict[str, Touch]:
    """Return the bar at its highest peak and the standard sphere."""
    return {
        "bar": single_unit.bar_touches(conditions)[PEAK_SHIFT],
        "sphere": sphere_discrimination.discrimination_touches(conditions)[CHOSEN_SPHERES[0]],
    }


@result_class
class LevelMeshes:
    """Meshes of a level, see `Level`: their sizes under bar and sphere."""

    name: str
    factor: float
    resolution: str
    bar: MeshSize
    sphere: MeshSize


@result_class
class AgainstFiner:
    """One mesh against a finer one.

    Parameters
    ----------
    mesh, against : str
        Their names.
    errors : MeshErrors
        At the touches that both have.
    fss, fss_against : float, optional
        Weighted FSS of the rates under the bar on either mesh; NaN of spheres. [1]
    """

    mesh: str
    against: str
    errors: MeshErrors
    fss: Number = float("nan")
    fss_against: Number = float("nan")


@result_class
class Convergence:
    """Order of convergence of the largest SED of a touch at the end of the ramp.

    Parameters
    ----------
    touch : str
        Which.
    sed_kpa : array (3,)
        On the three similar meshes, from coarse to fine. [kPa]
    order, limit_kpa : float
        See `studies.mesh_errors.observed_order`; NaN without an order. [1, kPa]
    """

    touch: str
    sed_kpa: Vector
    order: Number
    limit_kpa: Number


@result_class
class RefinedBars:
    """Bars: profiles by mesh, errors against finer meshes, orders of convergence."""

    profiles: dict[str, BarProfile]
    against_finer: tuple[AgainstFiner, ...]
    convergence: tuple[Convergence, ...]


@result_class
class RefinedSpheres:
    """Spheres: errors against finer meshes, orders of convergence, and hit rates by mesh.

    Hit rates are of `comparisons_per_m` [1/m] at 0.0 mm, with the same random numbers.
    """

    against_finer: tuple[AgainstFiner, ...]
    convergence: tuple[Convergence, ...]
    comparisons_per_m: Vector
    hit_rates: dict[str, HitRates]


@result_class
class MeshRefinement:
    """Result of `python -m studies mesh-refinement`.

    Parameters
    ----------
    code_hash : str
        Of the mechanics that solved the touches.
    levels : tuple of LevelMeshes
        From coarse to fine.
    bars : RefinedBars
        One receptor under the shifted bar.
    spheres : RefinedSpheres
        The receptors of the population under spheres.
    one_at_a_time : dict of dict of LargestChanges
        By "bar" or "sphere", and by change of the standard mesh.
    step_counts : (int, int)
        Steps in ramp and in hold that are compared.
    steps : dict of MeshErrors
        Few steps against many, by "bar" or "sphere".
    """

    code_hash: str
    levels: tuple[LevelMeshes, ...]
    bars: RefinedBars
    spheres: RefinedSpheres
    one_at_a_time: dict[str, dict[str, LargestChanges]]
    step_counts: tuple[int, int]
    steps: dict[str, MeshErrors]


def run(runner: Runner) -> MeshRefinement:
    """Solve every indentation that is not stored yet, and compare the meshes.

    About an hour on one core. Finished touches are stored one by one; a stopped run continues after them.

    Parameters
    ----------
    runner : Runner
        Where indentations are stored.

    Returns
    -------
    MeshRefinement

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
    receptors = {"bar": np.array([[RECEPTOR_X_MM, 0.0]]), "sphere": population.positions_mm}
    bars = {name: read_stored(runner, touches, receptors["bar"]) for name, (touches, _) in pressed.items()}
    balls = {
        name: read_stored(runner, touches, receptors["sphere"]) for name, (_, touches) in pressed.items()
    }
    standard = {
        "bar": bars["standard"].only([PEAK_SHIFT]),
        "sphere": balls["standard"].only(CHOSEN_SPHERES[:1]),
    }

    def example(name: str, touch: Touch) -> Reading:
        return read_stored(runner, {0: touch}, receptors[name])

    return MeshRefinement(
        code_hash=code_hash(),
        levels=tuple(_meshes(level) for level in LEVELS),
        bars=_bars(bars),
        spheres=_spheres(balls, neighbour_pairs(population.positions_mm, population.pitch_mm)),
        one_at_a_time={
            name: {
                change: largest_changes(standard[name], example(name, touch))
                for change, touch in each.items()
            }
            for name, each in changes.items()
        },
        step_counts=STEPS,
        steps={
            name: compare(*(example(name, counts[count]) for count in STEPS))
            for name, counts in steps.items()
        },
    )


def _meshes(level: Level) -> LevelMeshes:
    return LevelMeshes(
        name=level.name,
        factor=level.factor,
        resolution=level.resolution,
        bar=MeshSize.of(next(iter(level.bars().values()))),
        sphere=MeshSize.of(next(iter(level.balls().values()))),
    )


def _pairs(readings: Mapping[str, Reading]) -> list[tuple[str, str]]:
    """Names of the meshes that are compared: each with the finest, then quick with standard."""
    finest = LEVELS[-1].name
    return [*((name, finest) for name in readings if name != finest), ("quick", "standard")]


def _bars(readings: Mapping[str, Reading]) -> RefinedBars:
    return RefinedBars(
        profiles={name: reading.profile() for name, reading in readings.items()},
        against_finer=tuple(
            AgainstFiner(
                mesh=name,
                against=finer,
                errors=compare(readings[name], readings[finer]),
                fss=goodness_of_fit(readings[name].only(readings[finer].touches)),
                fss_against=goodness_of_fit(readings[finer]),
            )
            for name, finer in _pairs(readings)
        ),
        convergence=_convergence(readings),
    )


def _convergence(readings: Mapping[str, Reading]) -> tuple[Convergence, ...]:
    """Order and limit of each touch's largest SED at the end of the ramp, on the three similar meshes."""
    similar = [level for level in LEVELS if level.resolution == "standard"]
    rows = []
    for touch in readings[similar[-1].name].touches:
        sed = np.array([readings[level.name].only([touch]).sed_kpa["ramp"][0] for level in similar])
        values = sed[:, sed[-1].argmax()]
        found = observed_order(values.tolist(), [level.factor for level in similar])
        order, limit = found or (np.nan, np.nan)
        rows.append(Convergence(touch=_named(touch), sed_kpa=values, order=order, limit_kpa=limit))
    return tuple(rows)


def _named(touch: int | Sphere) -> str:
    """Name of a touch in tables.

    >>> _named(0), _named((0.0, 287.0))
    ('bar, shift -3.5 mm', 'sphere 287 /m at 0 mm')
    """
    if isinstance(touch, int):
        return f"bar, shift {SHIFTS_MM[touch]:g} mm"
    return f"sphere {touch[1]:g} /m at {touch[0]:g} mm"


def _spheres(readings: Mapping[str, Reading], neighbours: np.ndarray) -> RefinedSpheres:
    return RefinedSpheres(
        against_finer=tuple(
            AgainstFiner(mesh=name, against=finer, errors=compare(readings[name], readings[finer]))
            for name, finer in _pairs(readings)
        ),
        convergence=_convergence(readings),
        comparisons_per_m=np.array(CHOSEN_CURVATURES[1:]),
        hit_rates={
            name: hit_rates(reading, 0.0, CHOSEN_CURVATURES, neighbours) for name, reading in readings.items()
        },
    )
