"""Quick and standard against the paper's mesh: 0.1 mm at skin and border over the whole pad.

The same touches are solved on three meshes: six for the deflection of the skin, the bar at its edges, its
centre and beside it, four spheres at both positions. Half of the finger is solved, and once the whole one as
a check. A mesh with twice the elements through the deep layers shows the error that the paper's size has.
"""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass, replace

import numpy as np

from fingerpad.core.checks import FloatArray
from fingerpad.core.results import Number, Vector, result_class
from fingerpad.data import psychophysics
from fingerpad.experiments.conditions import RECEPTOR_X_MM, Conditions
from fingerpad.experiments.gerling2014 import single_unit, skin_deflection, sphere_discrimination
from fingerpad.experiments.runner import Runner
from fingerpad.geometry.fingertip import Fingertip
from fingerpad.geometry.grading import resolution_grading
from fingerpad.geometry.mesh import LAYERS, Mesh, finger_mesh
from fingerpad.neuron.population import Population
from fingerpad.psychophysics.encoding import neighbour_pairs
from fingerpad.skin.code_hash import code_hash
from fingerpad.skin.indentation import Touch
from fingerpad.skin.sampling import SkinResponse
from studies.mesh_errors import (
    BarProfile,
    Differences,
    HitRates,
    LargestChanges,
    MeshErrors,
    MeshSize,
    Reading,
    compare,
    differences,
    goodness_of_fit,
    hit_rates,
    largest_changes,
    read_stored,
)
from studies.mesh_refinement import PEAK_SHIFT, SHIFTS_MM, Sphere
from studies.study import TISSUES

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
        conditions = Conditions(resolution, tissues=TISSUES)
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


@result_class
class Edges:
    """Edges of elements: how many, and their lengths. [mm]"""

    count: int
    median_mm: float
    smallest_mm: float
    largest_mm: float


@result_class
class Preset:
    """Mesh of the preset as it is: both halves of the finger.

    Parameters
    ----------
    nodes, elements : int
        How many.
    elements_with_subcutis_of_wedges : int
        Elements if each brick of the subcutis were cut into two wedges, which adds no node.
    skin_edges, border_edges : Edges
        On the skin and on the epidermal-dermal border, see `pad_edges`.
    """

    nodes: int
    elements: int
    elements_with_subcutis_of_wedges: int
    skin_edges: Edges
    border_edges: Edges


@result_class
class DeflectionErrors:
    """One deflection against that at the paper's size.

    Parameters
    ----------
    profile_mm : Differences
        Of the skin within 10 mm of the indenter. [mm]
    force, peak_force : float
        Relative difference at the end of the hold and of the largest force. [1]
    r2, r2_reference : float
        Against the observations on either mesh; NaN under the line, where there are none. [1]
    """

    profile_mm: Differences
    force: float
    peak_force: float
    r2: Number
    r2_reference: Number


@result_class
class Deflections:
    """Profiles of the skin at the end of the hold, and their errors against the paper's size.

    Parameters
    ----------
    distance_mm : array (n_distances,)
        From the indenter, proximal positive. [mm]
    deflection_mm : dict of dict of arrays (n_distances,)
        By mesh, then by trial and indenter. [mm]
    errors : dict of dict of DeflectionErrors
        By mesh, then by trial and indenter.
    """

    distance_mm: Vector
    deflection_mm: dict[str, dict[str, Vector]]
    errors: dict[str, dict[str, DeflectionErrors]]


@result_class
class BarErrors:
    """Bars: profiles, errors against the paper's size and weighted FSS [1], by mesh."""

    profiles: dict[str, BarProfile]
    errors: dict[str, MeshErrors]
    fss: dict[str, Number]


@result_class
class SphereErrors:
    """Spheres: energy density, errors against the paper's size and hit rates, by mesh.

    Parameters
    ----------
    position_mm, curvature_per_m : array (n_spheres,)
        What is indented. [mm, 1/m]
    largest_sed_ramp_kpa : dict of arrays (n_spheres,)
        Over the receptors at the end of the ramp. [kPa]
    errors : dict of dict of MeshErrors
        By mesh and position.
    comparisons_per_m : array (n_comparisons,)
        Curvatures that are compared with the standard. [1/m]
    hit_rates : dict of dict of HitRates
        By mesh and position.
    """

    position_mm: Vector
    curvature_per_m: Vector
    largest_sed_ramp_kpa: dict[str, Vector]
    errors: dict[str, dict[str, MeshErrors]]
    comparisons_per_m: Vector
    hit_rates: dict[str, dict[str, HitRates]]


@result_class
class PaperSize:
    """Result of `python -m studies paper-size`.

    Parameters
    ----------
    code_hash : str
        Of the mechanics that solved the touches.
    preset : Preset
        The mesh of the paper's size.
    meshes : dict of dict of MeshSize
        By mesh and kind of touch, half of the finger.
    deflection : Deflections
        Line and cylinder in three trials.
    bars : BarErrors
        One receptor under the shifted bar.
    spheres : SphereErrors
        18 receptors under spheres.
    half_against_whole : MeshErrors
        Half of the finger against both halves, standard sphere.
    twice_as_deep : dict of LargestChanges
        With twice the elements through the deep layers, under "bar" and "sphere".
    """

    code_hash: str
    preset: Preset
    meshes: dict[str, dict[str, MeshSize]]
    deflection: Deflections
    bars: BarErrors
    spheres: SphereErrors
    half_against_whole: MeshErrors
    twice_as_deep: dict[str, LargestChanges]


def run(runner: Runner) -> PaperSize:
    """Solve every indentation that is not stored yet, and compare quick and standard with the paper's size.

    23 indentations at the paper's size or above it. Finished ones are stored one by one; a stopped run
    continues after them.

    Parameters
    ----------
    runner : Runner
        Where indentations are stored.

    Returns
    -------
    PaperSize

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
    sites = population.positions_mm
    bars = {name: read_stored(runner, touches.bars, receptor) for name, touches in pressed.items()}
    spheres = {name: read_stored(runner, touches.spheres, sites) for name, touches in pressed.items()}
    bar, sphere = bars[REFERENCE].only([PEAK_SHIFT]), spheres[REFERENCE].only([STANDARD_SPHERE])
    return PaperSize(
        code_hash=code_hash(),
        preset=preset(),
        meshes={name: _sizes(touches) for name, touches in pressed.items()},
        deflection=deflections(
            {
                name: {trial: runner.store.load(touch) for trial, touch in touches.deflection.items()}
                for name, touches in pressed.items()
            }
        ),
        bars=BarErrors(
            profiles={name: reading.profile() for name, reading in bars.items()},
            errors={
                name: compare(reading, bars[REFERENCE]) for name, reading in bars.items() if name != REFERENCE
            },
            fss={name: goodness_of_fit(reading) for name, reading in bars.items()},
        ),
        spheres=_spheres(spheres, neighbour_pairs(sites, population.pitch_mm)),
        half_against_whole=compare(sphere, read_stored(runner, {STANDARD_SPHERE: whole}, sites)),
        twice_as_deep={
            "bar": largest_changes(bar, read_stored(runner, {0: deeper["bar"]}, receptor)),
            "sphere": largest_changes(sphere, read_stored(runner, {0: deeper["sphere"]}, sites)),
        },
    )


def preset() -> Preset:
    """Count and measure the preset."""
    mesh = finger_mesh(Fingertip(), resolution_grading(REFERENCE, RECEPTOR_X_MM))
    border = int((mesh.layer[: mesh.shape[2]] < LAYERS.index("dermis")).sum())
    return Preset(
        nodes=len(mesh.nodes_mm),
        elements=len(mesh.elements),
        elements_with_subcutis_of_wedges=len(mesh.elements) + int((mesh.layer == SUBCUTIS).sum()),
        skin_edges=pad_edges(mesh, RECEPTOR_X_MM, below=0),
        border_edges=pad_edges(mesh, RECEPTOR_X_MM, below=border),
    )


def pad_edges(mesh: Mesh, centre_mm: float, below: int) -> Edges:
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
    Edges
    """
    skin = mesh.nodes_mm[mesh.skin_grid]
    along, across = PAD_HALF_AXES_MM
    volar = skin[..., 1] < Fingertip().spine_y_mm
    pad = (((skin[..., 0] - centre_mm) / along) ** 2 + (skin[..., 2] / across) ** 2 < 1.0) & volar
    points = mesh.nodes_mm[mesh.skin_grid + below]  # nodes are numbered from skin to bone first
    edges = np.concatenate(
        [
            np.linalg.norm(np.diff(points, axis=0), axis=-1)[pad[:-1] & pad[1:]],
            np.linalg.norm(np.diff(points, axis=1), axis=-1)[pad[:, :-1] & pad[:, 1:]],
        ]
    )
    return Edges(
        count=edges.size,
        median_mm=float(np.median(edges)),
        smallest_mm=float(edges.min()),
        largest_mm=float(edges.max()),
    )


def _sizes(touches: Touches) -> dict[str, MeshSize]:
    """Sizes of the meshes, by kind of touch."""
    (_, line), (_, cylinder) = list(touches.deflection.items())[:2]
    examples = {
        "line": line,
        "cylinder": cylinder,
        "bar": next(iter(touches.bars.values())),
        "sphere": next(iter(touches.spheres.values())),
    }
    return {name: MeshSize.of(touch) for name, touch in examples.items()}


def deflections(responses: Mapping[str, Mapping[Trial, SkinResponse]]) -> Deflections:
    """Return profiles of the skin on every mesh, and their errors against the paper's size.

    Parameters
    ----------
    responses : mapping
        By mesh, then by trial and indenter.

    Returns
    -------
    Deflections
    """
    reference = responses[REFERENCE]
    return Deflections(
        distance_mm=DISTANCES_MM,
        deflection_mm={
            name: {_named(trial): _profile(skin) for trial, skin in of_mesh.items()}
            for name, of_mesh in responses.items()
        },
        errors={
            name: {
                _named(trial): _deflection_errors(trial, skin, reference[trial])
                for trial, skin in of_mesh.items()
            }
            for name, of_mesh in responses.items()
            if name != REFERENCE
        },
    )


def _deflection_errors(trial: Trial, skin: SkinResponse, reference: SkinResponse) -> DeflectionErrors:
    return DeflectionErrors(
        profile_mm=differences(_profile(skin), _profile(reference)),
        force=float(skin.force_mn[-1] / reference.force_mn[-1]) - 1.0,
        peak_force=float(skin.force_mn.max() / reference.force_mn.max()) - 1.0,
        r2=_r2(trial, skin),
        r2_reference=_r2(trial, reference),
    )


def _profile(skin: SkinResponse) -> FloatArray:
    return skin.surface_profile().at(-DISTANCES_MM)  # a profile counts distal as positive


def _r2(trial: Trial, skin: SkinResponse) -> float:
    return skin_deflection.deflection_r2(skin.surface_profile()) if trial[1] == "cylinder" else float("nan")


def _named(trial: Trial) -> str:
    """Name of a deflection in tables.

    >>> _named(("trial1", "line"))
    'trial 1, line'
    """
    return f"{trial[0].replace('trial', 'trial ')}, {trial[1]}"


def _spheres(readings: Mapping[str, Reading], neighbours: np.ndarray) -> SphereErrors:
    reference = readings[REFERENCE]
    positions = sphere_discrimination.POSITIONS_MM
    return SphereErrors(
        position_mm=np.array([position for position, _ in reference.touches]),
        curvature_per_m=np.array([curvature for _, curvature in reference.touches]),
        largest_sed_ramp_kpa={
            name: reading.sed_kpa["ramp"].max(axis=1) for name, reading in readings.items()
        },
        errors={
            name: {
                f"{position:g}": compare(
                    reading, reference.only([(position, curvature) for curvature in CURVATURES])
                )
                for position in positions
            }
            for name, reading in readings.items()
            if name != REFERENCE
        },
        comparisons_per_m=np.array(CURVATURES[1:]),
        hit_rates={
            name: {
                f"{position:g}": hit_rates(reading, position, CURVATURES, neighbours)
                for position in positions
            }
            for name, reading in readings.items()
        },
    )
