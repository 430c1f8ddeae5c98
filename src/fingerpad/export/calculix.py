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
from fingerpad.core.values import one_of
from fingerpad.export import cards
from fingerpad.export.cards import INDENTER, SKIN
from fingerpad.export.job import CONTACT_KPA_PER_MM, Job, Phase
from fingerpad.mechanics.laws import Hyperfoam, Law
from fingerpad.mechanics.materials import Material

UPPER_FACE, OUTER_FACE = 2, 1
"""Faces in contact: the side of the skin, and the outer side of the elements of the indenter."""

MODULI = ("long_term", "instantaneous")
SLOWEST_SHARE = 1.0 / 64
"""Smallest increment that CalculiX may choose, as a share of the increment of the indentation."""


def calculix_deck(job: Job, elastic_moduli: str | None = None) -> str:
    lines = cards.comments(["For CalculiX.", *job.summary])
    if elastic_moduli is not None:
        lines += cards.comments(
            [f"Elastic, with {elastic_moduli} moduli: relaxation and the hold are left out."]
        )
    lines += cards.nodes(job.mesh.nodes_mm, 1, "BODY")
    for layer, name in job.layer_names.items():
        lines += cards.body_elements(job, layer, "C3D8I", "C3D6")
        lines += [f"*MATERIAL, NAME={name}", *_law(job.materials[layer], name, elastic_moduli)]
        lines += [f"*SOLID SECTION, ELSET={name}, MATERIAL={name}"]
    lines += cards.support_sets(job)
    if job.indenter.grips:
        lines += [f"*SURFACE, NAME={SKIN}, TYPE=NODE", *(str(node + 1) for node in job.touching_nodes)]
    else:
        lines += cards.surface(SKIN, job.touching_elements + 1, UPPER_FACE)
    lines += _rigid_body(job, len(job.mesh.nodes_mm) + 1)
    # Contact is at nodes, as in fingerpad.
    lines += ["*SURFACE INTERACTION, NAME=CONTACT", "*SURFACE BEHAVIOR, PRESSURE-OVERCLOSURE=LINEAR"]
    lines += cards.data([CONTACT_KPA_PER_MM])
    if job.friction:  # a sticking node yields by the same stiffness as a pressed one, as in our own contact
        lines += ["*FRICTION", *cards.data([job.friction, CONTACT_KPA_PER_MM])]
    lines += ["*CONTACT PAIR, INTERACTION=CONTACT, TYPE=NODE TO SURFACE", f"{SKIN}, {INDENTER}",
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
