"""Names and units by which files refer to indenters and their sizes."""

from __future__ import annotations

from dataclasses import fields

from fingerpad.core.keywords import other_names
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

_FIELDS = {
    name: [size.name for size in fields(kind)]  # type: ignore[arg-type]
    for name, kind in INDENTERS.items()
}

SIZE_UNITS = (
    dict.fromkeys((size for sizes in _FIELDS.values() for size in sizes), "mm")
    | {"curvature_per_m": "1/m"}
    | {name: other.unit for kind in INDENTERS.values() for name, other in other_names(kind).items()}
)
"""Units of the sizes of indenters, other names of sizes included."""


def sizes_of(indenter: str) -> tuple[str, ...]:
    """Sizes that an indenter has: fields of its class, then other names."""
    return tuple(dict.fromkeys([*_FIELDS[indenter], *other_names(INDENTERS[indenter])]))
