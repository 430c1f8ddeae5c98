"""CalculiX input file of an indentation: elastic, with the indenter divided into rigid facets.

CalculiX has no analytical rigid surface, no Prony series for hyperelastic materials, and no element with an
independent pressure. On a coarse mesh its C3D8 is several per cent too stiff for skin. C3D8I has incompatible
modes and agrees with the constant-pressure brick of fingerpad on the same nodes. The difference is measured
in tests/verification/test_oracles.py.
"""

from __future__ import annotations

from dataclasses import replace

import numpy as np

from fingerpad.core.errors import InputError
from fingerpad.core.values import FloatArray, IntArray, one_of
from fingerpad.export import cards
from fingerpad.export.cards import INDENTER, SKIN
from fingerpad.export.job import CONTACT_KPA_PER_MM, Job, Phase
from fingerpad.mechanics.laws import Hyperfoam, Law
from fingerpad.mechanics.materials import Material

UPPER_FACE, OUTER_FACE = 2, 1
"""Faces in contact: the side of the skin, and the outer side of the elements of the indenter."""

ELEMENTS = {"C3D8": "C3D6", "C3D8I": "C3D6", "C3D20R": "C3D15"}  # Available bricks, each with its wedge.

MODULI = ("long_term", "instantaneous")
SLOWEST_SHARE = 1.0 / 64
"""Smallest increment that CalculiX may choose, as a share of the increment of the indentation."""

_FACE_EDGES = ((0, 1), (1, 2), (2, 3), (3, 0))
_BRICK_EDGES = (*_FACE_EDGES, *((a + 4, b + 4) for a, b in _FACE_EDGES), *((a, a + 4) for a in range(4)))
_WEDGE_EDGES = ((0, 1), (1, 2), (2, 0), (3, 4), (4, 5), (5, 3), (0, 3), (1, 4), (2, 5))


def calculix_deck(job: Job, elastic_moduli: str | None = None, element: str = "C3D8I") -> str:
    one_of("element", element, tuple(ELEMENTS))
    points, bricks, wedges = job.mesh.nodes_mm, job.mesh.elements, job.wedges
    if element == "C3D20R":
        points, bricks, wedges = _with_middle_nodes(job)
    first = len(points) + 1
    lines = cards.comments(["For CalculiX.", *job.summary])
    if elastic_moduli is not None:
        lines += cards.comments(
            [f"Elastic, with {elastic_moduli} moduli: relaxation and the hold are left out."]
        )
    lines += cards.nodes(points, 1, "BODY")
    for layer, name in job.layer_names.items():
        lines += cards.body_elements(job, layer, element, ELEMENTS[element], (bricks, wedges))
        lines += [f"*MATERIAL, NAME={name}", *_law(job.materials[layer], name, elastic_moduli)]
        lines += [f"*SOLID SECTION, ELSET={name}, MATERIAL={name}"]
    lines += cards.support_sets(job, *_held(job, points, bricks, wedges))
    if job.indenter.grips:
        lines += [f"*SURFACE, NAME={SKIN}, TYPE=NODE", *(str(node + 1) for node in job.touching_nodes)]
    else:
        lines += cards.surface(SKIN, job.touching_elements + 1, UPPER_FACE)
    lines += _rigid_body(job, first)
    # Contact is at nodes, as in fingerpad, but nodes in the middle of edges take uneven shares of the load.
    by_nodes = job.indenter.grips or element != "C3D20R"
    kind = "NODE TO SURFACE" if by_nodes else "SURFACE TO SURFACE"
    lines += ["*SURFACE INTERACTION, NAME=CONTACT", "*SURFACE BEHAVIOR, PRESSURE-OVERCLOSURE=LINEAR"]
    lines += cards.data([CONTACT_KPA_PER_MM])
    if job.friction:  # a sticking node yields by the same stiffness as a pressed one, as in our own contact
        lines += ["*FRICTION", *cards.data([job.friction, CONTACT_KPA_PER_MM])]
    lines += [f"*CONTACT PAIR, INTERACTION=CONTACT, TYPE={kind}", f"{SKIN}, {INDENTER}",
              *cards.supports(job)]  # fmt: skip
    depth = 0.0
    for phase in job.phases:
        if phase.depth_mm != depth:
            lines += _step(job, phase)
        depth = phase.depth_mm
    return cards.text(lines)


def _law(material: Material, name: str, elastic_moduli: str | None) -> list[str]:
    material = replace(material, law=_in_two_terms(material.law))
    if not material.prony.shares:
        return cards.law(material, 1.0)
    if elastic_moduli is None:
        raise InputError(
            f"CalculiX cannot relax the hyperelastic layer {name}: give elastic_moduli "
            '("long_term" or "instantaneous"; in a command --elastic-moduli), or export for Abaqus or FEBio.'
        )
    one_of("elastic_moduli", elastic_moduli, MODULI)
    share = material.prony.long_term_share
    return cards.law(
        material, material.instantaneous_factor * (share if elastic_moduli == "long_term" else 1.0)
    )


def _in_two_terms(law: Law) -> Law:
    """Halve the one term of a foam: CalculiX 2.20 reads a foam of N=1 wrongly, without a message."""
    if not isinstance(law, Hyperfoam) or len(law.exponents) > 1:
        return law
    return replace(law, moduli_kpa=(law.moduli_kpa[0] / 2,) * 2, exponents=law.exponents * 2)


def _with_middle_nodes(job: Job) -> tuple[FloatArray, IntArray, IntArray]:
    """Points, bricks (n, 20) and wedges (n, 15) with a node in the middle of each edge."""
    mesh, is_wedge = job.mesh, job.is_wedge
    brick_ends = mesh.elements[~is_wedge][:, _BRICK_EDGES]
    wedge_ends = job.wedges[is_wedge][:, _WEDGE_EDGES]
    ends = np.sort(np.concatenate([brick_ends.reshape(-1, 2), wedge_ends.reshape(-1, 2)]), axis=1)
    edges, which = np.unique(ends, axis=0, return_inverse=True)
    middle = len(mesh.nodes_mm) + which.ravel()
    bricks = np.full((len(mesh.elements), 20), -1, dtype=np.int64)
    wedges = np.full((len(mesh.elements), 15), -1, dtype=np.int64)
    split = brick_ends.shape[0] * len(_BRICK_EDGES)
    bricks[~is_wedge] = np.hstack([mesh.elements[~is_wedge], middle[:split].reshape(-1, len(_BRICK_EDGES))])
    wedges[is_wedge] = np.hstack([job.wedges[is_wedge], middle[split:].reshape(-1, len(_WEDGE_EDGES))])
    return np.concatenate([mesh.nodes_mm, mesh.nodes_mm[edges].mean(axis=1)]), bricks, wedges


def _held(job: Job, points: FloatArray, bricks: IntArray, wedges: IntArray) -> tuple[IntArray, IntArray]:
    """List fixed and symmetric nodes; in the middle of an edge, those of which both ends are."""
    found = []
    for held in (job.mesh.fixed_nodes, job.mesh.symmetry_nodes):
        inside = np.zeros(len(points), dtype=bool)
        inside[held] = True
        for corners, edges in ((bricks[~job.is_wedge], _BRICK_EDGES), (wedges[job.is_wedge], _WEDGE_EDGES)):
            middle = corners[:, corners.shape[1] - len(edges) :] if corners.shape[1] > 8 else corners[:, :0]
            if middle.size:
                inside[middle] |= inside[corners[:, edges]].all(axis=2)
        found.append(np.flatnonzero(inside))
    return found[0], found[1]


def _rigid_body(job: Job, first: int) -> list[str]:
    """Cards of the indenter: thin elements whose nodes all have one displacement, so no strain."""
    rigid = job.rigid
    number = len(job.mesh.elements) + 1
    quads, triangles = rigid.solids(rigid.quads), rigid.solids(rigid.triangles)
    lines = cards.nodes(rigid.nodes_mm, first, INDENTER)
    numbers = number + np.arange(len(quads) + len(triangles))
    lines += cards.elements("C3D8", INDENTER, numbers[: len(quads)], quads + first)
    if len(triangles):
        lines += cards.elements("C3D6", INDENTER, numbers[len(quads) :], triangles + first)
    lines += ["*MATERIAL, NAME=RIGID", "*ELASTIC", "1000, 0.3"]
    lines += [f"*SOLID SECTION, ELSET={INDENTER}, MATERIAL=RIGID"]
    return lines + cards.surface(INDENTER, numbers, OUTER_FACE)


def _step(job: Job, phase: Phase) -> list[str]:
    """Cards of one step: increments at most as long as those of the indentation, ramped motion, output."""
    length = phase.end_ms - phase.start_ms
    step = length / phase.steps
    moves = (
        f"{INDENTER}, {axis}, {axis}, {cards.digits(phase.depth_mm * component)}"
        for axis, component in enumerate(job.placement.axis, 1)
    )
    lines = [
        f"*STEP, NLGEOM, INC={100 * phase.steps}",
        "*STATIC",
        ", ".join(map(cards.digits, (step, length, SLOWEST_SHARE * step, step))),
        "*BOUNDARY", *moves,
        f"*NODE PRINT, NSET={INDENTER}, TOTALS=ONLY, FREQUENCY=1", "RF",
    ]  # fmt: skip
    for name in job.layer_names.values():
        # CalculiX adds energies from one printed increment to the next: FREQUENCY above 1 makes them wrong.
        lines += [f"*EL PRINT, ELSET={name}, FREQUENCY=1", "ENER"]
    return [*lines, "*NODE FILE, FREQUENCY=1", "U, RF", "*EL FILE, FREQUENCY=1", "S, ENER", "*END STEP"]
