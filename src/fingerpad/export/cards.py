"""Keyword cards that Abaqus and CalculiX read alike: nodes, elements, sets, hyperelastic laws."""

from __future__ import annotations

from collections.abc import Iterable, Sequence

import numpy as np

from fingerpad.core.checks import FloatArray, IntArray
from fingerpad.core.errors import InputError
from fingerpad.export.job import Job
from fingerpad.mechanics.laws import Hyperfoam, Ogden, Polynomial
from fingerpad.mechanics.materials import Material

PER_LINE, PER_LINE_OF_ELEMENT = 8, 16
"""Values on a data line, after which both programs want a new one."""

NO_TERM = 1e20
"""D of a volumetric term that is absent: at 0 CalculiX puts in a stiffness of its own without a word."""

FIXED, SYMMETRY, GRIPPED, SKIN, INDENTER = "FIXED", "SYMMETRY", "GRIPPED", "SKIN", "INDENTER"
"""Names of sets and surfaces in a deck."""


def digits(value: float) -> str:
    """Write a number in at most 20 characters, all that CalculiX reads, with 12 digits.

    Examples
    --------
    >>> digits(-1 / 3), number(2.0)
    ('-0.333333333333', '2')
    """
    return f"{value:.12g}"


def data(values: Iterable[float | int | str], per_line: int = PER_LINE) -> list[str]:
    """Write the data lines of a card, up to `per_line` values each."""
    texts = [value if isinstance(value, str) else digits(value) for value in values]
    return [", ".join(texts[n : n + per_line]) for n in range(0, len(texts), per_line)]


def comments(lines: Iterable[str]) -> list[str]:
    """Comment lines."""
    return [f"** {line}" for line in lines]


def nodes(points_mm: FloatArray, first: int, name: str) -> list[str]:
    """Cards of nodes that are numbered from `first`."""
    rows = (f"{n}, {digits(x)}, {digits(y)}, {digits(z)}" for n, (x, y, z) in enumerate(points_mm, first))
    return [f"*NODE, NSET={name}", *rows]


def elements(kind: str, name: str, numbers: IntArray, corners: IntArray) -> list[str]:
    """Cards of elements; `corners` holds node numbers. A line that goes on ends in a comma."""
    lines = [f"*ELEMENT, TYPE={kind}, ELSET={name}"]
    for n, row in zip(numbers, corners, strict=True):
        texts = data([str(n), *map(str, row)], PER_LINE_OF_ELEMENT)
        lines += [text + "," for text in texts[:-1]] + texts[-1:]
    return lines


def node_set(name: str, numbers: IntArray) -> list[str]:
    """Card of a set of nodes."""
    return [f"*NSET, NSET={name}", *data(map(str, numbers))]


def surface(name: str, numbers: IntArray, face: int) -> list[str]:
    """Card of a surface made of the same face of several elements."""
    return [f"*SURFACE, NAME={name}, TYPE=ELEMENT", *(f"{n}, S{face}" for n in numbers)]


def supports(job: Job) -> list[str]:
    """Cards that hold the bone and nail, the plane of symmetry, and skin that a line grips."""
    lines = ["*BOUNDARY", f"{FIXED}, 1, 3"]
    if job.mesh.symmetry_nodes.size:
        lines.append(f"{SYMMETRY}, 3, 3")
    if job.gripped_nodes.size:
        lines.append(f"{GRIPPED}, 1, 1")
    return lines


def support_sets(job: Job, fixed: IntArray | None = None, symmetric: IntArray | None = None) -> list[str]:
    """Cards of the sets that `supports` names; those of the mesh unless nodes are given."""
    fixed = job.mesh.fixed_nodes if fixed is None else fixed
    symmetric = job.mesh.symmetry_nodes if symmetric is None else symmetric
    lines = node_set(FIXED, fixed + 1)
    # No node is held twice: Abaqus would call that an overconstraint.
    symmetric = np.setdiff1d(symmetric, fixed)
    if symmetric.size:
        lines += node_set(SYMMETRY, symmetric + 1)
    if job.gripped_nodes.size:
        lines += node_set(GRIPPED, job.gripped_nodes + 1)
    return lines


def body_elements(
    job: Job, layer: int, brick: str, wedge: str, corners: tuple[IntArray, IntArray] | None = None
) -> list[str]:
    """Cards of one layer's elements, a set of the layer's name, numbered as in the mesh from 1.

    `corners` are nodes of bricks and wedges, one row per element of the mesh, if not those of the mesh.
    """
    lines: list[str] = []
    bricks, wedges = corners or (job.mesh.elements, job.wedges)
    for kind, nodes_of, chosen in ((brick, bricks, ~job.is_wedge), (wedge, wedges, job.is_wedge)):
        numbers = np.flatnonzero(chosen & (job.mesh.layer == layer))
        if numbers.size:
            lines += elements(kind, job.layer_names[layer], numbers + 1, nodes_of[numbers] + 1)
    return lines


def law(material: Material, factor: float, moduli: str = "") -> list[str]:
    """Card of a material's strain energy.

    Parameters
    ----------
    material : Material
        Its law must be Polynomial, Ogden or Hyperfoam.
    factor : float
        By which its coefficients of shape (of a foam: all) are multiplied.
    moduli : str
        What follows the keyword, for example ", MODULI=LONG TERM".

    Raises
    ------
    InputError
        If neither program has the law.
    """
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
        f"The law {type(energy).__name__} has no card in Abaqus or CalculiX, whose *ELASTIC is another at "
        "large strain: export a Polynomial, Ogden or Hyperfoam material, or write a user subroutine."
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
    """Whole deck."""
    return "\n".join([*lines, ""])
