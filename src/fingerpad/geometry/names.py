"""Names by which files refer to indenters and their sizes."""

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


def sizes_of(indenter: str) -> tuple[str, ...]:
    """Sizes that an indenter has: fields of its class, then other names."""
    return tuple(dict.fromkeys([*_FIELDS[indenter], *other_names(INDENTERS[indenter])]))


SIZES = tuple(dict.fromkeys(size for name in INDENTERS for size in sizes_of(name)))
"""Sizes of all indenters, other names of sizes included."""
