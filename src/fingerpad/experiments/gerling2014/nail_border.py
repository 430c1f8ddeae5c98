"""Figure 9: stress concentration at the border of the nail when a sphere presses the pad.

The paper shows a figure and gives no number. Stress decreases steadily from the pad around the finger to its
back, so both stresses are taken from the same section of the finger: the concentration is the stress of the
skin at the lateral border of the nail over that of the skin 2 to 3 mm away from it. At the end of a fixed
nail, the stress of an elastic body grows without bound as elements shrink; the number therefore depends on
the size of the elements (docs/decisions.md#nail-border).
"""

from __future__ import annotations

from dataclasses import dataclass, replace
from itertools import pairwise

import numpy as np

from fingerpad.core.checked import result_class
from fingerpad.core.errors import InputError
from fingerpad.core.values import FloatArray, Matrix, Number, Stack, Vector
from fingerpad.data import protocol
from fingerpad.experiments.conditions import RECEPTOR_X_MM, Conditions, Touch
from fingerpad.geometry.grading import resolution_grading
from fingerpad.geometry.mesh import Mesh
from fingerpad.skin.sampling import SkinResponse

BESIDE_MM = 1.5  # Skin nearer than this to the nail counts as its border. [mm]
FAR_MM = (2.0, 3.0)  # Skin at these distances is what the border is compared with. [mm]
ELEMENT_MM = {"quick": 0.8, "standard": 0.6, "paper": 0.6}  # Largest on the skin, at its back too. [mm]


@result_class
class StressProfile:
    """Stress over distance from the nail, over the sections that cross its border."""

    distance_mm: Vector  # From the nail, negative under it, (n,). [mm]
    surface_kpa: Matrix
    living_epidermis_kpa: Matrix  # Quantiles 0.1, 0.5 and 0.9; NaN without an element, (n, 3). [kPa]


@result_class
class MiddleSection:
    """Deformed faces of the elements on the plane z = 0, and their stress."""

    x_mm: Matrix
    y_mm: Matrix  # Corners, (n_faces, 4). [mm]
    von_mises_kpa: Vector  # Stress of the element, (n_faces,). [kPa]


@result_class
class CrossSection:
    """Deformed quadrilaterals in the middle of a section's elements, and their stress."""

    x_mm: float  # Where the section lies. [mm]
    y_mm: Matrix
    z_mm: Matrix  # Corners, (n_elements, 4). [mm]
    von_mises_kpa: Vector  # Stress, (n_elements,). [kPa]


@result_class
class NailBorder:
    """Stress of the skin and in two sections at the end of the hold, and its concentration at the nail."""

    x_mm: Matrix
    y_mm: Matrix
    z_mm: Matrix  # Deformed corners of the faces of the skin, (n_along + 1, n_around + 1). [mm]
    von_mises_kpa: Matrix  # Stress of the element below each face, (n_along, n_around). [kPa]
    nail_mm: Stack  # Outline of the nail, (n_edges, 2, 3). [mm]
    ratio: Number
    ratio_range: tuple[Number, Number]  # Stress at the border over that away from it, median and range.
    ratio_living_epidermis: Number
    ratio_energy: Number  # The same median in the living epidermis, for stress and for strain energy density.
    border_kpa: Number
    far_kpa: Number
    border_energy_kpa: Number  # Largest strain energy density at the border. [kPa]
    peak_kpa: Number  # Stress: largest at the border, median away from it, largest anywhere. [kPa]
    text: str
    profile: StressProfile  # Stress over distance from the nail.
    middle: MiddleSection
    across: CrossSection  # The section with the highest ratio.


def nail_touch(conditions: Conditions) -> Touch:
    """Return the standard sphere on a mesh that is fine all over the finger."""
    # Below the sphere no finer than at quick resolution: the nail is a finger's thickness away.
    grading = replace(
        resolution_grading("quick", RECEPTOR_X_MM), largest_mm=ELEMENT_MM[conditions.resolution]
    )
    return conditions.sphere_touch(protocol.STANDARD_CURVATURE.value, grading=grading)


@dataclass(frozen=True)
class Concentration:
    """Stress at the border of the nail, section by section."""

    station: np.ndarray  # Sections that cross the border and reach the skin far from it, (n_sections,).
    border_kpa: FloatArray
    far_kpa: FloatArray  # Largest stress at the border, mean at `FAR_MM` from it, (n_sections,). [kPa]

    @property
    def ratios(self) -> FloatArray:
        return self.border_kpa / self.far_kpa


def nail_border(skin: SkinResponse) -> NailBorder:
    """Evaluate stress at the end of the hold, and its concentration at the nail."""
    mesh = skin.mesh
    numbers = np.arange(len(mesh.elements)).reshape(mesh.shape)
    surface, deep = numbers[:, :, 0], mesh.living_epidermis
    distance = distance_to_nail(mesh)
    outside = concentration(mesh, skin.von_mises_kpa[surface], distance)
    inside = concentration(mesh, skin.von_mises_kpa[deep], distance)
    energy = concentration(mesh, skin.sed_kpa[-1][deep], distance)
    highest = int(outside.station[outside.ratios.argmax()])
    grid = (mesh.nodes_mm + skin.displacement_mm)[mesh.skin_grid]
    ratio, middle = float(np.median(outside.ratios)), skin.section()
    return NailBorder(
        x_mm=grid[..., 0],
        y_mm=grid[..., 1],
        z_mm=grid[..., 2],
        von_mises_kpa=skin.von_mises_kpa[surface],
        nail_mm=_outline(mesh, grid),
        ratio=ratio,
        ratio_range=(float(outside.ratios.min()), float(outside.ratios.max())),
        ratio_living_epidermis=float(np.median(inside.ratios)),
        ratio_energy=float(np.median(energy.ratios)),
        border_kpa=float(outside.border_kpa.max()),
        far_kpa=float(np.median(outside.far_kpa)),
        border_energy_kpa=float(energy.border_kpa.max()),
        peak_kpa=float(skin.von_mises_kpa.max()),
        text=(
            "At the lateral border of the nail the von Mises stress of the skin reaches "
            f"{outside.border_kpa.max():.2g} kPa. In the median section it is {ratio:.2g} times that of the "
            f"skin {FAR_MM[0]:g} to {FAR_MM[1]:g} mm away ({outside.ratios.min():.2g} to "
            f"{outside.ratios.max():.2g} over {outside.station.size} sections); in the living epidermis, "
            f"where receptors lie, {np.median(inside.ratios):.2g} times, and strain energy density there "
            f"{np.median(energy.ratios):.2g} times."
        ),
        profile=_profile(skin, surface, deep, distance, outside.station),
        middle=MiddleSection(
            x_mm=middle.corners_mm[..., 0],
            y_mm=middle.corners_mm[..., 1],
            von_mises_kpa=skin.von_mises_kpa[middle.elements],
        ),
        across=_across(mesh, skin, numbers[highest]),
    )


def distance_to_nail(mesh: Mesh) -> FloatArray:
    """Distance of each face of the skin from the nail, (n_along, n_around). [mm]

    From its centre to the nearest node of the nail, beside the nail positive; negative under it, and there to
    the nearest node of the skin that is free.
    """
    grid = mesh.nodes_mm[mesh.skin_grid]
    centre = 0.25 * (grid[:-1, :-1] + grid[1:, :-1] + grid[1:, 1:] + grid[:-1, 1:])
    free = np.setdiff1d(mesh.skin_nodes, mesh.nail_nodes)

    def nearest(nodes: np.ndarray) -> FloatArray:
        offsets = (row[:, None] - mesh.nodes_mm[nodes] for row in centre)
        return np.array([np.linalg.norm(row, axis=2).min(axis=1, initial=np.inf) for row in offsets])

    return np.where(_fixed_corners(mesh) == 4, -nearest(free), nearest(mesh.nail_nodes))


def _fixed_corners(mesh: Mesh) -> np.ndarray:
    """How many corners of each face of the skin lie under the nail, (n_along, n_around)."""
    under = np.isin(mesh.skin_grid, mesh.nail_nodes).astype(int)
    return under[:-1, :-1] + under[1:, :-1] + under[1:, 1:] + under[:-1, 1:]


def concentration(mesh: Mesh, stress_kpa: FloatArray, distance_mm: FloatArray) -> Concentration:
    """Compare stress at the border of the nail with that of the skin away from it in the same section."""
    corners = _fixed_corners(mesh)
    crosses = ((corners > 0) & (corners < 4)).any(axis=1) & (corners == 4).any(axis=1)
    near = ((corners > 0) & (corners < 4)) | ((distance_mm > 0.0) & (distance_mm <= BESIDE_MM))
    away = (distance_mm >= FAR_MM[0]) & (distance_mm <= FAR_MM[1])
    station = np.flatnonzero(crosses & away.any(axis=1))
    if not station.size:
        raise InputError(
            "The mesh has no nail, or is too coarse about it to separate its border from the skin "
            f"{FAR_MM[0]:g} to {FAR_MM[1]:g} mm away: make largest_mm of its grading smaller."
        )
    border = [stress_kpa[n][near[n]].max() for n in station]
    far = [stress_kpa[n][away[n]].mean() for n in station]
    return Concentration(station, np.array(border), np.array(far))


def _outline(mesh: Mesh, grid: FloatArray) -> FloatArray:
    """Edges between faces that lie under the nail and others, (n_edges, 2, 3). [mm]"""
    covered = np.pad(_fixed_corners(mesh) == 4, 1)
    edges = []
    for n, m in np.argwhere(covered[1:, 1:-1] != covered[:-1, 1:-1]):
        edges.append((grid[n, m], grid[n, m + 1]))
    for n, m in np.argwhere(covered[1:-1, 1:] != covered[1:-1, :-1]):
        if 0 < m < grid.shape[1] - 1:  # the plane of symmetry is no border
            edges.append((grid[n, m], grid[n + 1, m]))
    return np.array(edges)


def _profile(
    skin: SkinResponse, surface: np.ndarray, deep: np.ndarray, distance: FloatArray, stations: np.ndarray
) -> StressProfile:
    """Stress over distance from the nail: quantiles over the sections that cross its border."""
    edges = np.arange(-2.0, 5.01, 0.5)
    chosen = np.zeros(distance.shape, dtype=bool)
    chosen[stations] = True

    def quantiles(stress: FloatArray) -> FloatArray:
        table = np.full((edges.size - 1, 3), np.nan)
        for row, (low, high) in enumerate(pairwise(edges)):
            here = stress[chosen & (distance > low) & (distance <= high)]
            if here.size:
                table[row] = np.quantile(here, (0.1, 0.5, 0.9))
        return table

    return StressProfile(
        distance_mm=0.5 * (edges[1:] + edges[:-1]),
        surface_kpa=quantiles(skin.von_mises_kpa[surface]),
        living_epidermis_kpa=quantiles(skin.von_mises_kpa[deep]),
    )


def _across(mesh: Mesh, skin: SkinResponse, elements: np.ndarray) -> CrossSection:
    """Cut a section's elements half way between their two ends."""
    nodes = mesh.elements[elements.ravel()]
    moved = (mesh.nodes_mm + skin.displacement_mm)[nodes]
    quads = 0.5 * (moved[:, [0, 3, 7, 4]] + moved[:, [1, 2, 6, 5]])
    return CrossSection(
        x_mm=round(float(quads[..., 0].mean()), 1),
        y_mm=quads[..., 1],
        z_mm=quads[..., 2],
        von_mises_kpa=skin.von_mises_kpa[elements.ravel()],
    )
