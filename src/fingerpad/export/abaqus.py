"""Abaqus input file of an indentation: hybrid elements, Prony series, an analytical rigid surface."""

from __future__ import annotations

import numpy as np

from fingerpad.export import cards
from fingerpad.export.cards import INDENTER, SKIN, data
from fingerpad.export.job import CONTACT_KPA_PER_MM, Job, Phase
from fingerpad.mechanics.laws import Hyperfoam
from fingerpad.mechanics.materials import Material

CONTACT, REFERENCE = "CONTACT", "REFERENCE"

UPPER_FACE = 2  # Face of a brick's last four or a wedge's last three nodes, which is the side of the skin.


def abaqus_deck(job: Job) -> str:
    """Text of an Abaqus/Standard input file.

    Bricks are C3D8H and wedges C3D6H, with constant pressure as in the elements of fingerpad. Layers of foam,
    in which shape and volume are coupled, have C3D8 and C3D6. The indenter is an exact rigid surface, or
    rigid facets where it has no outline, moved by its reference node. Steps are *VISCO with the increments of
    the indentation, or *STATIC when nothing relaxes.
    """
    reference = len(job.mesh.nodes_mm) + 1
    relaxes = any(job.materials[layer].prony.shares for layer in job.layer_names)
    lines = ["*HEADING", job.summary[2], *cards.comments(["For Abaqus/Standard.", *job.summary])]
    lines += cards.nodes(job.mesh.nodes_mm, 1, "BODY")
    for layer, name in job.layer_names.items():
        material = job.materials[layer]
        hybrid = "" if isinstance(material.law, Hyperfoam) else "H"
        lines += cards.body_elements(job, layer, f"C3D8{hybrid}", f"C3D6{hybrid}")
        lines += [f"*SOLID SECTION, ELSET={name}, MATERIAL={name}", f"*MATERIAL, NAME={name}"]
        lines += _material(material)
    lines += cards.support_sets(job)
    # Not needed by Abaqus: with these sets `read_finger` reads the deck as a finger.
    for name in ("skin", "bone", "nail"):
        numbers = getattr(job.mesh, f"{name}_nodes") + 1
        lines += cards.node_set(name.upper(), numbers) if numbers.size else []
    lines += _skin(job)
    lines += _rigid_surface(job, reference)
    lines += [f"*SURFACE INTERACTION, NAME={CONTACT}", "1.", "*FRICTION", cards.digits(job.friction),
              "*SURFACE BEHAVIOR, PRESSURE-OVERCLOSURE=LINEAR", *data([CONTACT_KPA_PER_MM])]  # fmt: skip
    kind = "NODE TO SURFACE" if job.indenter.grips else "SURFACE TO SURFACE"
    lines += [f"*CONTACT PAIR, INTERACTION={CONTACT}, TYPE={kind}", f"{SKIN}, {INDENTER}"]
    lines += [*cards.supports(job), f"{REFERENCE}, 4, 6"]
    for phase in job.phases:
        lines += _step(job, phase, relaxes)
    return cards.text(lines)


def _material(material: Material) -> list[str]:
    shares, times = material.prony.shares, material.prony.times_ms
    if not shares:
        return cards.law(material, 1.0)
    moduli = "LONG TERM" if material.moduli == "long_term" else "INSTANTANEOUS"
    # In a foam shape and volume relax together: Abaqus then requires the same shares for both.
    bulk = shares if isinstance(material.law, Hyperfoam) else (0.0,) * len(shares)
    rows = [", ".join(map(cards.digits, row)) for row in zip(shares, bulk, times, strict=True)]
    return [*cards.law(material, 1.0, f", MODULI={moduli}"), "*VISCOELASTIC, TIME=PRONY", *rows]


def _skin(job: Job) -> list[str]:
    if not job.indenter.grips:
        return cards.surface(SKIN, job.touching_elements + 1, UPPER_FACE)
    skin, area = job.mesh.skin_nodes, job.mesh.skin_area_mm2
    share = area[np.searchsorted(skin, job.touching_nodes)]
    rows = (f"{node + 1}, {cards.digits(mm2)}" for node, mm2 in zip(job.touching_nodes, share, strict=True))
    return [f"*SURFACE, NAME={SKIN}, TYPE=NODE", *rows]


def _rigid_surface(job: Job, reference: int) -> list[str]:
    """Cards of the indenter: its outline in local axes, or its facets, attached to a node at its tip."""
    origin, outline = job.placement.origin_mm, job.outline
    x, y, z = job.placement.rotation.T
    lines = cards.nodes(origin[None], reference, REFERENCE)
    if outline is None:
        facets = job.rigid
        outer = facets.nodes_mm[: len(facets.nodes_mm) // 2]
        numbers = len(job.mesh.elements) + 1 + np.arange(len(facets.quads))
        return [
            *lines,
            *cards.nodes(outer, reference + 1, "FACETS"),
            *cards.elements("R3D4", INDENTER, numbers, facets.quads + reference + 1),
            f"*SURFACE, TYPE=ELEMENT, NAME={INDENTER}",
            f"{INDENTER}, SPOS",
            f"*RIGID BODY, ELSET={INDENTER}, REF NODE={reference}",
        ]
    if outline.revolved:
        lines += [f"*SURFACE, TYPE=REVOLUTION, NAME={INDENTER}", *data([*origin, *(origin + y)])]
    else:
        # The generator is -z: Abaqus takes local y as the vector product of local x and the generator.
        lines += [f"*SURFACE, TYPE=CYLINDER, NAME={INDENTER}", *data([*origin, *(origin + x)])]
        lines += data(origin - z)
    lines += [", ".join(["START", *map(cards.digits, outline.corners[0])])]
    for corner, centre in zip(outline.corners[1:], outline.centres, strict=True):
        word, values = ("LINE", corner) if centre is None else ("CIRCL", (*corner, *centre))
        lines.append(", ".join([word, *map(cards.digits, values)]))
    return [*lines, f"*RIGID BODY, ANALYTICAL SURFACE={INDENTER}, REF NODE={reference}"]


def _step(job: Job, phase: Phase, relaxes: bool) -> list[str]:
    """Cards of one step: increments of the indentation, ramped motion, and output."""
    length = phase.end_ms - phase.start_ms
    step = cards.digits(length / phase.steps)
    time = f"{step}, {cards.digits(length)}"
    # *VISCO without CETOL keeps its first increment; *STATIC takes ours at most, and smaller ones if needed.
    procedure = ["*VISCO", time] if relaxes else ["*STATIC", f"{time}, {cards.digits(length * 1e-6)}, {step}"]
    moves = (
        f"{REFERENCE}, {axis}, {axis}, {cards.digits(phase.depth_mm * component)}"
        for axis, component in enumerate(job.placement.axis, 1)
    )
    unsymmetric = ", UNSYMM=YES" if job.friction else ""
    return [
        f"*STEP, NLGEOM=YES, AMPLITUDE=RAMP, INC={100 * phase.steps}{unsymmetric}",
        *procedure,
        "*BOUNDARY", *moves,
        "*OUTPUT, FIELD, FREQUENCY=1",
        "*NODE OUTPUT", "U, RF",
        "*ELEMENT OUTPUT", "S, LE, SENER, EVOL",
        "*CONTACT OUTPUT", "CSTRESS, CDISP",
        "*OUTPUT, HISTORY, FREQUENCY=1",
        f"*NODE OUTPUT, NSET={REFERENCE}", "U, RF",
        "*END STEP",
    ]  # fmt: skip
