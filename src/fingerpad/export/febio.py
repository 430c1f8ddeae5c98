"""FEBio 4 input file of an indentation: three-field elements, viscoelastic layers, sliding contact.

FEBio's uncoupled materials equal those of fingerpad: energies of the isochoric invariants and, with
`pressure_model` 2, the volumetric energy K/2 (J-1)². Its viscoelastic material convects the relaxing stress
without its deviator being taken again, which changes stored energies of short Prony times by about 1 %.
`febio.xml` is the file with gaps for what differs between indentations.
"""

from __future__ import annotations

from collections.abc import Iterable, Iterator
from dataclasses import dataclass, field
from typing import Any

import numpy as np
from jinja2 import Environment, PackageLoader, StrictUndefined

from fingerpad.core.errors import InputError
from fingerpad.export.cards import INDENTER, digits
from fingerpad.export.job import Job
from fingerpad.mechanics.laws import Ogden, Polynomial
from fingerpad.mechanics.materials import Material

MOST_PRONY_TERMS = 6  # Most Prony terms of FEBio's viscoelastic material.
ABAQUS_VOLUME = 2  # Number of FEBio's volumetric energy K/2 (J-1)².

KINDS = ("hex8", "penta6")  # FEBio's names of bricks and wedges.

Values = dict[str, float | str]


@dataclass(frozen=True)
class _Material:
    """Element `material` of the file; a viscoelastic one has an elastic one within."""

    name: str
    kind: str
    values: Values
    elastic: str = ""
    coefficients: Values = field(default_factory=dict)


@dataclass(frozen=True)
class _Part:
    """Elements of one layer, or of the indenter, that have one shape: their numbers and nodes, from 1."""

    name: str
    kind: str
    elements: list[tuple[int, np.ndarray]]


def febio_deck(job: Job) -> str:
    environment = Environment(
        loader=PackageLoader("fingerpad.export", "."),
        trim_blocks=True,
        keep_trailing_newline=True,
        undefined=StrictUndefined,
    )
    environment.filters |= {"digits": _digits, "listed": _listed}
    upper = [
        (job.wedges[n, 3:] if job.is_wedge[n] else job.mesh.elements[n, 4:]) + 1
        for n in job.touching_elements
    ]
    body, steps_ms = len(job.mesh.nodes_mm), np.diff(job.times_ms)
    elastic = [layer for layer in job.layer_names if not job.materials[layer].prony.shares]
    return environment.get_template("febio.xml").render(
        job=job,
        steps_ms=steps_ms,
        next_steps_ms=[*steps_ms, steps_ms[-1]],
        materials=[_material(name, job.materials[layer]) for layer, name in job.layer_names.items()],
        body=body,
        parts=list(_parts(job)),
        skin=upper,
        facets=[*(job.rigid.quads + body + 1), *(job.rigid.triangles + body + 1)],
        elastic=np.flatnonzero(np.isin(job.mesh.layer, elastic)) + 1,
    )


def _digits(value: Any) -> str:
    return value if isinstance(value, str) else digits(value)


def _listed(values: Iterable[Any]) -> str:
    return ",".join(str(value) if isinstance(value, np.integer) else digits(value) for value in values)


def _parts(job: Job) -> Iterator[_Part]:
    for layer, name in job.layer_names.items():
        for wedges, numbers in job.parts(layer):
            corners = (job.wedges if wedges else job.mesh.elements)[numbers] + 1
            yield _Part(name, KINDS[wedges], list(zip((numbers + 1).tolist(), corners, strict=True)))
    number = len(job.mesh.elements)
    for kind, faces in zip(KINDS, (job.rigid.quads, job.rigid.triangles), strict=True):
        if len(faces):
            corners = job.rigid.solids(faces) + len(job.mesh.nodes_mm) + 1
            yield _Part(INDENTER, kind, list(enumerate(corners, number + 1)))
            number += len(faces)


def _material(name: str, material: Material) -> _Material:
    kind, coefficients, bulk_kpa = _law(name, material)
    shares, times = material.prony.shares, material.prony.times_ms
    volume: Values = {"density": 1, "k": bulk_kpa, "pressure_model": ABAQUS_VOLUME}
    if not shares:
        return _Material(name, kind, volume | coefficients)
    if len(shares) > MOST_PRONY_TERMS:
        raise InputError(
            f"FEBio takes {MOST_PRONY_TERMS} Prony terms: layer {name} has {len(shares)}; fit fewer terms."
        )
    # FEBio's modulus is g0 + sum g_i exp(-t/tau_i) times the elastic one, be that long-term or instantaneous.
    final = 1.0 if material.moduli == "long_term" else material.prony.long_term_share
    factor = final / material.prony.long_term_share
    relaxing: Values = {f"t{i}": time for i, time in enumerate(times, 1)}
    relaxing |= {"g0": final, **{f"g{i}": factor * share for i, share in enumerate(shares, 1)}}
    elastic: Values = {"density": 1, **coefficients}
    return _Material(name, "uncoupled viscoelastic", volume | relaxing, kind, elastic)


def _law(name: str, material: Material) -> tuple[str, Values, float]:
    """FEBio's name of a law, its coefficients, and the bulk modulus. [kPa]"""
    law = material.law
    if isinstance(law, Polynomial) and not law.bulk_cubic:
        if not (law.c20 or law.c11 or law.c02):
            return "Mooney-Rivlin", {"c1": law.c10, "c2": law.c01}, law.bulk_modulus_kpa
        terms = (
            (law.c10, "(I1-3)"), (law.c01, "(I2-3)"), (law.c20, "(I1-3)^2"),
            (law.c11, "(I1-3)*(I2-3)"), (law.c02, "(I2-3)^2"),
        )  # fmt: skip
        energy = "+".join(f"({digits(value)})*{powers}" for value, powers in terms if value)
        return "uncoupled hyperelastic", {"W": energy}, law.bulk_modulus_kpa
    if isinstance(law, Ogden):
        values: Values = {}
        for i, (modulus, exponent) in enumerate(zip(law.moduli_kpa, law.exponents, strict=True), 1):
            values |= {f"c{i}": 2.0 * modulus, f"m{i}": exponent}
        return "Ogden", values, law.bulk_kpa
    what = "a polynomial with D2" if isinstance(law, Polynomial) else type(law).__name__
    raise InputError(
        f"FEBio has no three-field material for {what} (layer {name}): export a polynomial without D2 or an "
        "Ogden material, or use Abaqus for a foam."
    )
