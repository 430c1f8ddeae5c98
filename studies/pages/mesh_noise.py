"""The page of `python -m studies mesh-noise`: the step between the nearest spheres on several meshes."""

from __future__ import annotations

from fingerpad.report.formatting import fixed, number, whole_percent
from fingerpad.report.manifest import edition, manifest_chapter
from fingerpad.report.parts import Chapter, Page, Row, Table
from studies.mesh_noise import MeshNoise, MeshNoiseStudy


def tables(section: MeshNoise) -> list[Table]:
    """Return the step from the standard to the nearest comparison on each mesh."""
    rows = [
        Row((mesh, *(fixed(value, 1) for value in sums), fixed(step, 2), fixed(difference, 3)))
        for mesh, sums, step, difference in zip(
            section.meshes, section.static_sum, section.step, section.difference, strict=True
        )
    ]
    columns = (
        "mesh",
        *(f"static sum at {number(curvature)} 1/m" for curvature in section.curvature_per_m),
        "step",
        "step above the first, share",
    )
    note = (
        "In spikes/s. All meshes have the resolution of the run; only where their lines lie differs. Steps "
        f"shall agree within {number(section.limit)} of the first."
    )
    return [Table("The nearest step on other meshes", columns, rows, note)]


def verdict(section: MeshNoise) -> str:
    """Return whether the steps agree within the limit, in a sentence."""
    return (
        f"The step of the static Gradient Sum differs by {whole_percent(section.largest_difference)} at most "
        f"between {len(section.meshes)} meshes of the same resolution; the limit of "
        f"{whole_percent(section.limit)} is {'met' if section.within_limit else 'exceeded'}."
    )


def mesh_noise_page(result: MeshNoiseStudy) -> Page:
    """Return the page of `python -m studies mesh-noise`."""
    return Page(
        "Mesh error between spheres",
        f"The standard and the nearest comparison on three meshes. {edition(result.manifest)}.",
        [verdict(result.mesh_noise)],
        [Chapter("", tables(result.mesh_noise)), manifest_chapter(result.manifest)],
    )
