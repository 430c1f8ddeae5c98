"""Level 1: deflection and force of the skin, its stress at the nail, and its mesh (paper, 2.2.1, 3.1, 4.3).

The paper shows the stress at the border of the nail (Figure 9) and gives no number. Stress decreases steadily
from the pad around the finger to its back, so both stresses are taken from the same section of the finger:
the concentration is the stress of the skin at the lateral border of the nail over that of the skin 2 to 3 mm
away from it. At the end of a fixed nail, the stress of an elastic body grows without bound as elements
shrink; the number therefore depends on the size of the elements (docs/decisions.md#nail-border).
"""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import replace
from itertools import pairwise

import numpy as np
from scipy.spatial import cKDTree

from fingerpad.core.checked import result_class
from fingerpad.core.errors import InputError
from fingerpad.core.units import MN_PER_N
from fingerpad.core.values import (
    FloatArray,
    IntArray,
    Matrix,
    Number,
    Stack,
    TruthMatrix,
    TruthVector,
    Vector,
    WholeVector,
)
from fingerpad.data import DeflectionObservations, cylinder_deflection, fingertip, protocol
from fingerpad.experiments.conditions import RECEPTOR_X_MM, Conditions, Touch
from fingerpad.experiments.scores import coefficient_of_determination
from fingerpad.geometry.bodies import Cylinder, FlatPunch, Line, Plate
from fingerpad.geometry.grading import resolution_grading
from fingerpad.geometry.indenters import Indenter
from fingerpad.geometry.mesh import LAYERS, Mesh
from fingerpad.geometry.motion import RampAndHold
from fingerpad.skin.indentation import touch_of
from fingerpad.skin.sampling import SkinResponse, SurfaceProfile

TRIALS = ("trial1", "trial2", "trial3")
INDENTERS: dict[str, Indenter] = {"line": Line(), "cylinder": Cylinder()}
SHOWN_MM = 10.0  # Distance to which the profile is kept; the observations end at 9.25 mm. [mm]
PLATE_DEPTHS_MM = (1.0, 2.0)  # Depths of the flat plate, at which forces of people were observed. [mm]


@result_class
class IndenterDeflection:
    """Deflection of the skin under one indenter."""

    distance_mm: Vector
    deflection_mm: Vector  #: Along the midline; distance from the axis, proximal positive, (n_nodes,). [mm]
    force_mn: Number  #: At the end of the hold. [mN]
    r2: Number = np.nan
    r2_mirrored: Number = np.nan
    """Coefficient of determination, see `deflection_r2`, and the same with proximal and distal exchanged; NaN
    under the line, where nothing was observed."""


TrialDeflection = dict[str, IndenterDeflection]
"""Deflections with the tissues of one trial, under "line" and "cylinder"."""


@result_class
class SkinDeflectionResult:
    """Deflections by the tissues of the paper's trials, and the observed one."""

    trial1: TrialDeflection
    trial2: TrialDeflection
    trial3: TrialDeflection
    observed: DeflectionObservations  #: Under the cylinder.


@result_class
class SkinForce:
    """Deflection and force with the tissues of the run."""

    deflection_r2: Number  #: R² of the deflection under the cylinder, see `deflection_r2`.
    plate_1mm_n: Number
    plate_2mm_n: Number  #: Force of a flat plate at the end of the hold, 1.0 and 2.0 mm deep. [N]
    disc_1mm_n: Number  #: Force of a flat disc of 6.35 mm diameter at the end of the hold, 1.0 mm deep. [N]


def deflection_touches(conditions: Conditions) -> dict[tuple[str, str], Touch]:
    """Six touches: three trials, two indenters."""
    return {
        (trial, name): conditions.touch(
            indenter, conditions.receptor_x_mm, conditions.deflection_grading(indenter), tissues=trial
        )
        for trial in TRIALS
        for name, indenter in INDENTERS.items()
    }


def plate(depth_mm: float) -> str:
    """Name of the touch of the flat plate at one of `PLATE_DEPTHS_MM`."""
    return f"plate {depth_mm:g} mm"


def force_touches(conditions: Conditions) -> dict[str, Touch]:
    """Cylinder, plate at both depths and disc; the flat ones press straight down, as `fingerpad.indent`."""
    x_mm, cylinder, disc = conditions.receptor_x_mm, Cylinder(), FlatPunch()
    flat: dict[str, tuple[Indenter, float]] = {plate(depth): (Plate(), depth) for depth in PLATE_DEPTHS_MM}
    flat["disc"] = (disc, protocol.DEPTH.value)
    touches = {"cylinder": conditions.touch(cylinder, x_mm, conditions.deflection_grading(cylinder))}
    for name, (body, depth_mm) in flat.items():
        motion = RampAndHold(depth_mm=depth_mm)
        touches[name] = touch_of(conditions.finger, body, motion, conditions.tissues, conditions.resolution)
    return touches


def deflection_r2(profile: SurfaceProfile, proximal_positive: bool = True) -> float:
    """R² of a profile against the observed deflection under the cylinder, its marked artefact left out.

    The source does not state which end of the finger its positive distances point to. Read as proximal they
    fit better (docs/decisions.md#deflection-direction); `proximal_positive` False reads them as distal.
    """
    observed = cylinder_deflection()
    kept = ~observed.is_artefact
    distance = observed.distance_mm[kept] * (-1.0 if proximal_positive else 1.0)
    return coefficient_of_determination(observed.deflection_mm[kept], profile.at(distance))


def deflection_result(responses: Mapping[tuple[str, str], SkinResponse]) -> SkinDeflectionResult:
    """Profiles, forces and R², with distances in the direction of the observations."""
    trials: dict[str, TrialDeflection] = {}
    for trial in TRIALS:
        line, cylinder = (_under_indenter(responses[trial, name]) for name in INDENTERS)
        profile = responses[trial, "cylinder"].surface_profile()
        r2, mirrored = deflection_r2(profile), deflection_r2(profile, proximal_positive=False)
        trials[trial] = {"line": line, "cylinder": replace(cylinder, r2=r2, r2_mirrored=mirrored)}
    return SkinDeflectionResult(**trials, observed=cylinder_deflection())


def _under_indenter(skin: SkinResponse) -> IndenterDeflection:
    profile = skin.surface_profile()
    shown = np.flatnonzero(np.abs(profile.distance_mm) <= SHOWN_MM)[::-1]
    return IndenterDeflection(
        distance_mm=-profile.distance_mm[shown],
        deflection_mm=profile.deflection_mm[shown],
        force_mn=float(skin.force_mn[-1]),
    )


def skin_force(responses: Mapping[str, SkinResponse]) -> SkinForce:
    force_n = {name: float(skin.force_mn[-1]) / MN_PER_N for name, skin in responses.items()}
    return SkinForce(
        deflection_r2=deflection_r2(responses["cylinder"].surface_profile()),
        plate_1mm_n=force_n[plate(1.0)],
        plate_2mm_n=force_n[plate(2.0)],
        disc_1mm_n=force_n["disc"],
    )


# Stress at the border of the nail

BESIDE_MM = 1.5  # Skin nearer than this to the nail counts as its border. [mm]
FAR_MM = (2.0, 3.0)  # Skin at these distances is what the border is compared with. [mm]
ELEMENT_MM = {"quick": 0.8, "standard": 0.6, "paper": 0.6}  # Largest on the skin, at its back too. [mm]
PROFILE_MM = np.arange(-2.0, 5.01, 0.5)  # Edges of the classes of distance of a profile. [mm]


@result_class
class StressProfile:
    """Stress over distance from the nail, over the sections that cross its border."""

    distance_mm: Vector  #: From the nail, negative under it, (n,). [mm]
    surface_kpa: Matrix
    living_epidermis_kpa: Matrix  #: Quantiles 0.1, 0.5 and 0.9; NaN without an element, (n, 3). [kPa]


@result_class
class CrossSection:
    """Deformed quadrilaterals in the middle of a section's elements, and their stress."""

    x_mm: float  #: Where the section lies. [mm]
    y_mm: Matrix
    z_mm: Matrix  #: Corners, (n_elements, 4). [mm]
    von_mises_kpa: Vector  #: Stress, (n_elements,). [kPa]


@result_class
class NailBorder:
    """Stress of the skin and in one section at the end of the hold, and its concentration at the nail."""

    x_mm: Matrix
    y_mm: Matrix
    z_mm: Matrix  #: Deformed corners of the faces of the skin, (n_along + 1, n_around + 1). [mm]
    von_mises_kpa: Matrix  #: Stress of the element below each face, (n_along, n_around). [kPa]
    nail_mm: Stack  #: Outline of the nail, (n_edges, 2, 3). [mm]
    ratio: Number
    ratio_range: tuple[Number, Number]  #: Stress at the border over that away from it, median and range.
    ratio_energy: Number  #: The same median for strain energy density in the living epidermis.
    border_kpa: Number  #: Largest stress at the border. [kPa]
    profile: StressProfile  #: Stress over distance from the nail.
    across: CrossSection  #: The section with the highest ratio.


def nail_touch(conditions: Conditions) -> Touch:
    """Return the standard sphere on a mesh that is fine all over the finger."""
    # Below the sphere no finer than at quick resolution: the nail is a finger's thickness away.
    grading = resolution_grading("quick", RECEPTOR_X_MM)
    grading = replace(grading, largest_mm=ELEMENT_MM[conditions.resolution])
    return conditions.sphere_touch(protocol.STANDARD_CURVATURE.value, grading=grading)


def nail_border(skin: SkinResponse) -> NailBorder:
    """Evaluate stress at the end of the hold, and its concentration at the nail."""
    mesh, stress_kpa = skin.mesh, skin.von_mises_kpa
    numbers = np.arange(len(mesh.elements)).reshape(mesh.shape)
    surface, deep = numbers[:, :, 0], mesh.living_epidermis
    distance, corners = _distance_to_nail(mesh), _fixed_corners(mesh)
    part = (corners > 0) & (corners < 4)
    near = part | ((distance > 0.0) & (distance <= BESIDE_MM))
    away = (distance >= FAR_MM[0]) & (distance <= FAR_MM[1])
    crosses = part.any(axis=1) & (corners == 4).any(axis=1)
    sections = np.flatnonzero(crosses & away.any(axis=1))  # They also reach the skin far from the nail.
    if not sections.size:
        raise InputError(
            "The mesh has no nail, or is too coarse about it to separate its border from the skin "
            f"{FAR_MM[0]:g} to {FAR_MM[1]:g} mm away: make largest_mm of its grading smaller."
        )

    def compared(values: FloatArray) -> tuple[FloatArray, FloatArray]:
        """Largest value at the border, and this over the mean value away from it, (n_sections,)."""
        border = np.array([values[n][near[n]].max() for n in sections])
        return border, border / np.array([values[n][away[n]].mean() for n in sections])

    (border, ratios), (_, energies) = compared(stress_kpa[surface]), compared(skin.sed_kpa[-1][deep])
    grid = (mesh.nodes_mm + skin.displacement_mm)[mesh.skin_grid]
    crossing = np.isin(np.arange(len(distance)), sections)[:, None]
    classes = [crossing & (distance > start) & (distance <= end) for start, end in pairwise(PROFILE_MM)]
    surface_kpa, living_epidermis_kpa = (
        np.array([_quantiles(stress_kpa[elements][some]) for some in classes]) for elements in (surface, deep)
    )
    return NailBorder(
        x_mm=grid[..., 0],
        y_mm=grid[..., 1],
        z_mm=grid[..., 2],
        von_mises_kpa=stress_kpa[surface],
        nail_mm=_outline(mesh, grid),
        ratio=float(np.median(ratios)),
        ratio_range=(float(ratios.min()), float(ratios.max())),
        ratio_energy=float(np.median(energies)),
        border_kpa=float(border.max()),
        profile=StressProfile(
            distance_mm=0.5 * (PROFILE_MM[1:] + PROFILE_MM[:-1]),
            surface_kpa=surface_kpa,
            living_epidermis_kpa=living_epidermis_kpa,
        ),
        across=_across(skin, numbers[sections[ratios.argmax()]].ravel()),
    )


def _distance_to_nail(mesh: Mesh) -> FloatArray:
    """Distance from each face of the skin; under the nail, negative and to the nearest free node. [mm]"""
    grid = mesh.nodes_mm[mesh.skin_grid]
    centre = 0.25 * (grid[:-1, :-1] + grid[1:, :-1] + grid[1:, 1:] + grid[:-1, 1:])
    free = np.setdiff1d(mesh.skin_nodes, mesh.nail_nodes)
    to_free, to_nail = (cKDTree(mesh.nodes_mm[n]).query(centre)[0] for n in (free, mesh.nail_nodes))
    return np.where(_fixed_corners(mesh) == 4, -to_free, to_nail)


def _fixed_corners(mesh: Mesh) -> np.ndarray:
    """How many corners of each face of the skin lie under the nail, (n_along, n_around)."""
    under = np.isin(mesh.skin_grid, mesh.nail_nodes).astype(int)
    return under[:-1, :-1] + under[1:, :-1] + under[1:, 1:] + under[:-1, 1:]


def _quantiles(stress_kpa: FloatArray) -> FloatArray:
    return np.quantile(stress_kpa, (0.1, 0.5, 0.9)) if stress_kpa.size else np.full(3, np.nan)


def _outline(mesh: Mesh, grid: FloatArray) -> FloatArray:
    """Edges between faces that lie under the nail and others, (n_edges, 2, 3). [mm]"""
    covered = np.pad(_fixed_corners(mesh) == 4, 1)
    along = np.argwhere(covered[1:, 1:-1] != covered[:-1, 1:-1])
    around = np.argwhere(covered[1:-1, 1:] != covered[1:-1, :-1])
    edges = [(grid[n, m], grid[n, m + 1]) for n, m in along]
    # The plane of symmetry is no border.
    edges += [(grid[n, m], grid[n + 1, m]) for n, m in around if 0 < m < grid.shape[1] - 1]
    return np.array(edges)


def _across(skin: SkinResponse, elements: IntArray) -> CrossSection:
    """Cut a section's elements half way between their two ends."""
    moved = (skin.mesh.nodes_mm + skin.displacement_mm)[skin.mesh.elements[elements]]
    quads = 0.5 * (moved[:, [0, 3, 7, 4]] + moved[:, [1, 2, 6, 5]])
    x_mm, stress_kpa = round(float(quads[..., 0].mean()), 1), skin.von_mises_kpa[elements]
    return CrossSection(x_mm=x_mm, y_mm=quads[..., 1], z_mm=quads[..., 2], von_mises_kpa=stress_kpa)


# The mesh without load

DECIMALS = 4  # Decimals of coordinates in files: 0.1 µm. [mm]


@result_class
class MeshPlane:
    """Nodes of a mesh in one plane, in grid order."""

    right_mm: Matrix
    up_mm: Matrix  #: In the plane, through from the skin to the bone, (n_outline, n_through + 1). [mm]
    under_nail: TruthVector  #: Whether the node on the skin lies under the nail, (n_outline,).


@result_class
class MeshPicture:
    """The mesh without load (Figure 1)."""

    x_mm: Matrix
    y_mm: Matrix
    z_mm: Matrix  #: Nodes of the skin, (n_along + 1, n_around + 1). [mm]
    under_nail: TruthMatrix  #: Whether they lie under the nail, (n_along + 1, n_around + 1).
    along: MeshPlane  #: Plane z = 0, from the volar side over the tip to the back; right is x, up is y.
    across: MeshPlane  #: Proximal end, beside the middle phalanx, half of a half mesh; right is z, up is y.
    contact_mm: tuple[float, float]  #: x and y of the skin at the contact. [mm]
    layers: tuple[str, ...]  #: From the skin inwards.
    layer: WholeVector  #: Index into `layers` of each element through the skin, (n_through,).
    receptor_depth_mm: float  #: Of the end organs below the skin. [mm]
    nodes: int
    elements: int  #: Of the whole mesh.


def mesh_picture(mesh: Mesh, contact_x_mm: float) -> MeshPicture:
    """Cut a mesh along the finger, and across it at its proximal end."""
    midline = mesh.nodes_mm[mesh.midline_nodes]
    x, y, _ = midline[np.abs(midline[:, 0] - contact_x_mm).argmin()].round(DECIMALS).tolist()
    skin = mesh.nodes_mm[mesh.skin_grid].round(DECIMALS)
    return MeshPicture(
        x_mm=skin[..., 0],
        y_mm=skin[..., 1],
        z_mm=skin[..., 2],
        under_nail=np.isin(mesh.skin_grid, mesh.nail_nodes),
        along=_plane(mesh, outline_nodes(mesh), 0),
        across=_plane(mesh, mesh.grid[0], 2),
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
    points = mesh.nodes_mm[nodes].round(DECIMALS)
    under_nail = np.isin(nodes[:, 0], mesh.nail_nodes)
    return MeshPlane(right_mm=points[..., right], up_mm=points[..., 1], under_nail=under_nail)
