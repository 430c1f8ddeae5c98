"""Names and units by which files refer to indenters and their sizes."""

from __future__ import annotations

from fingerpad.geometry.edged_indenters import Edge, Gap, Grating
from fingerpad.geometry.indenters import Bar, Cylinder, FlatPunch, Indenter, Line, Plate, Sphere

INDENTERS: dict[str, type[Indenter]] = {
    "sphere": Sphere,
    "cylinder": Cylinder,
    "bar": Bar,
    "line": Line,
    "punch": FlatPunch,
    "plate": Plate,
    "edge": Edge,
    "gap": Gap,
    "grating": Grating,
}
"""Classes of indenters by name."""

_LENGTHS = ("diameter_mm", "width_mm", "gap_mm", "ridge_mm", "groove_mm", "fillet_mm", "lip_mm")
SIZE_UNITS = {"curvature_per_m": "1/m"} | dict.fromkeys(_LENGTHS, "mm")
"""Units of the sizes of indenters."""
