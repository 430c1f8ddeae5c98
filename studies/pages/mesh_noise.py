"""The step between the nearest spheres on several meshes, as a table."""

from __future__ import annotations

from collections.abc import Mapping
from typing import Any

from fingerpad.report.formatting import fixed, number
from fingerpad.report.parts import Row, Table


def tables(section: Mapping[str, Any]) -> list[Table]:
    """Return the step from the standard to the nearest comparison on each mesh."""
    rows = [
        Row((mesh, *(fixed(value, 1) for value in sums), fixed(step, 2), fixed(difference, 3)))
        for mesh, sums, step, difference in zip(
            section["meshes"], section["static_sum"], section["step"], section["difference"], strict=True
        )
    ]
    columns = (
        "mesh",
        *(f"static sum at {number(curvature)} 1/m" for curvature in section["curvature_per_m"]),
        "step",
        "step above the first, share",
    )
    note = (
        "In spikes/s. All meshes have the resolution of the run; only where their lines lie differs. Steps "
        f"shall agree within {number(section['limit'])} of the first."
    )
    return [Table("The nearest step on other meshes", columns, rows, note)]
