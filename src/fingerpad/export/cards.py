"""Keyword cards with the same meaning in Abaqus and CalculiX: nodes, elements, sets, hyperelastic laws."""

from __future__ import annotations

from collections.abc import Iterable, Sequence

from fingerpad.core.errors import InputError
from fingerpad.core.values import FloatArray, IntArray
from fingerpad.export.job import Job
from fingerpad.mechanics.laws import Hyperfoam, Ogden, Polynomial
from fingerpad.mechanics.materials import Material

PER_LINE, PER_LINE_OF_ELEMENT = 8, 16  # Most values on a data line of both programs.

NO_TERM = 1e20
"""D of a volumetric term that is absent: CalculiX silently replaces 0 by a stiffness of its own."""

SKIN, INDENTER = "SKIN", "INDENTER"


def digits(value: float) -> str:
    """Write a number with 12 digits, in at most 20 characters, which is the limit of CalculiX."""
    return f"{value:.12g}"


def data(values: Iterable[float | int | str], per_line: int = PER_LINE) -> list[str]:
    """Write the data lines of a card, up to `per_line` values each."""
    texts = [value if isinstance(value, str) else digits(value) for value in values]
    return [", ".join(texts[n : n + per_line]) for n in range(0, len(texts), per_line)]


def comments(lines: Iterable[str]) -> list[str]:
    return [f"** {line}" for line in lines]


def nodes(points_mm: FloatArray, first: int, name: str) -> list[str]:
    """Cards of nodes that are numbered from `first`."""
    rows = (f"{n}, {digits(x)}, {digits(y)}, {digits(z)}" for n, (x, y, z) in enumerate(points_mm, first))
    return [f"*NODE, NSET={name}", *rows]


def elements(kind: str, name: str, numbers: IntArray, corners: IntArray) -> list[str]:
    """Cards of elements; `corners` holds node numbers. A line that is continued ends in a comma."""
    lines = [f"*ELEMENT, TYPE={kind}, ELSET={name}"]
    for n, row in zip(numbers, corners, strict=True):
        texts = data([str(n), *map(str, row)], PER_LINE_OF_ELEMENT)
        lines += [text + "," for text in texts[:-1]] + texts[-1:]
    return lines


def node_set(name: str, numbers: IntArray) -> list[str]:
    return [f"*NSET, NSET={name}", *data(map(str, numbers))]


def surface(name: str, numbers: IntArray, face: int) -> list[str]:
    """Card of a surface made of the same face of several elements."""
    return [f"*SURFACE, NAME={name}, TYPE=ELEMENT", *(f"{n}, S{face}" for n in numbers)]


def supports(job: Job) -> list[str]:
    """Cards that hold the bone and nail, the plane of symmetry, and skin that a wire grips."""
    return [
        "*BOUNDARY",
        *(f"{support.name}, {support.axes[0]}, {support.axes[1]}" for support in job.supports),
    ]


def support_sets(job: Job) -> list[str]:
    """Cards of the sets that `supports` names."""
    return [line for each in job.supports for line in node_set(each.name, each.nodes + 1)]


def body_elements(job: Job, layer: int, brick: str, wedge: str) -> list[str]:
    """Cards of one layer's elements, a set of the layer's name, numbered as in the mesh from 1."""
    lines = []
    for wedges, numbers in job.parts(layer):
        kind, corners = (wedge, job.wedges) if wedges else (brick, job.mesh.elements)
        lines += elements(kind, job.layer_names[layer], numbers + 1, corners[numbers] + 1)
    return lines


def law(material: Material, factor: float, moduli: str = "") -> list[str]:
    energy = material.law
    if isinstance(energy, Polynomial):
        return _polynomial(energy, factor, moduli)
    if isinstance(energy, Ogden | Hyperfoam):
        terms = [
            value
            for modulus, exponent in zip(energy.moduli_kpa, energy.exponents, strict=True)
            for value in (factor * modulus, exponent)
        ]
        count = len(energy.exponents)
        if isinstance(energy, Hyperfoam):
            return [f"*HYPERFOAM, N={count}{moduli}", *data([*terms, *[energy.poisson] * count])]
        volume = [2.0 / energy.bulk_kpa] + [NO_TERM] * (count - 1)
        return [f"*HYPERELASTIC, OGDEN, N={count}{moduli}", *data([*terms, *volume])]
    raise InputError(
        f"The law {type(energy).__name__} has no card in Abaqus or CalculiX: their *ELASTIC differs at large "
        "strain. Export a Polynomial, Ogden or Hyperfoam material, or write a user subroutine."
    )


def _polynomial(energy: Polynomial, factor: float, moduli: str) -> list[str]:
    shape = [factor * value for value in (energy.c10, energy.c01, energy.c20, energy.c11, energy.c02)]
    first = 1.0 / energy.bulk_linear
    if any(shape[2:]) or energy.bulk_cubic:
        second = 1.0 / energy.bulk_cubic if energy.bulk_cubic else NO_TERM
        return [f"*HYPERELASTIC, POLYNOMIAL, N=2{moduli}", *data([*shape, first, second])]
    if shape[1]:
        return [f"*HYPERELASTIC, MOONEY-RIVLIN{moduli}", *data([*shape[:2], first])]
    return [f"*HYPERELASTIC, NEO HOOKE{moduli}", *data([shape[0], first])]


def text(lines: Sequence[str]) -> str:
    return "\n".join([*lines, ""])
