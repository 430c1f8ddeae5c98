"""Export of one indentation: to the files of results, or to input files of Abaqus, CalculiX and FEBio.

Each deck is a template beside this module, with gaps for what differs between indentations.

Abaqus/Standard: bricks are C3D8H and wedges C3D6H, with constant pressure as in the elements of fingerpad.
The indenter is an exact rigid surface, or rigid facets where it has no outline, moved by its reference node.
Steps are *VISCO with the increments of the indentation, or *STATIC when nothing relaxes.

CalculiX has no analytical rigid surface, no Prony series for hyperelastic materials, and no element with an
independent pressure. On a coarse mesh its C3D8 is several per cent too stiff for skin. C3D8I has incompatible
modes and agrees with the constant-pressure brick of fingerpad on the same nodes. The difference is measured
in tests/verification/test_oracles.py.

FEBio 4: its uncoupled materials equal those of fingerpad: energies of the isochoric invariants and, with
`pressure_model` 2, the volumetric energy K/2 (J-1)². Its viscoelastic material convects the relaxing stress
without its deviator being taken again, which changes stored energies of short Prony times by about 1 %.
"""

from __future__ import annotations

from collections.abc import Callable, Iterable, Iterator
from dataclasses import replace
from functools import cache
from pathlib import Path
from typing import Any

import numpy as np
from jinja2 import Environment, PackageLoader, StrictUndefined

from fingerpad.core.checked import checked
from fingerpad.core.errors import InputError
from fingerpad.core.files import write_atomically
from fingerpad.core.values import FloatArray, IntArray, one_of
from fingerpad.export.job import CONTACT_KPA_PER_MM, Job, job_of
from fingerpad.export.results import NEEDED, require
from fingerpad.mechanics.laws import Hyperfoam, Law, Ogden, Polynomial
from fingerpad.mechanics.materials import Material
from fingerpad.skin.indentation import Touch

PER_LINE, PER_LINE_OF_ELEMENT = 8, 16  # Most values on a data line of Abaqus and CalculiX.

NO_TERM = 1e20
"""D of a volumetric term that is absent: CalculiX silently replaces 0 by a stiffness of its own."""

MODULI = ("long_term", "instantaneous")
MOST_PRONY_TERMS = 6  # Most Prony terms of FEBio's viscoelastic material.
ABAQUS_VOLUME = 2  # Number of FEBio's volumetric energy K/2 (J-1)².

INDENTER = "INDENTER"
KINDS = ("hex8", "penta6")  # FEBio's names of bricks and wedges.


def abaqus_deck(job: Job) -> str:
    origin, (x, y, z) = job.placement.origin_mm, job.placement.rotation.T
    outline, held = job.outline, job.touching_nodes
    areas_mm2 = job.mesh.skin_area_mm2[np.searchsorted(job.mesh.skin_nodes, held)]
    return _rendered(
        "abaqus.inp",
        job=job,
        relaxes=any(job.materials[layer].prony.shares for layer in job.layer_names),
        gripped=list(zip(held, areas_mm2, strict=True)),
        reference=len(job.mesh.nodes_mm) + 1,
        origin=origin,
        outline=outline,
        facets=_facet_numbers(job) if outline is None else [],
        along_x=[*origin, *(origin + x)],
        along_y=[*origin, *(origin + y)],
        z=z,
    )


def calculix_deck(job: Job, elastic_moduli: str | None = None) -> str:
    depths_mm = [0.0, *(phase.depth_mm for phase in job.phases)]
    moving = [phase for phase, before in zip(job.phases, depths_mm, strict=False) if phase.depth_mm != before]
    return _rendered(
        "calculix.inp",
        job=job,
        elastic_moduli=elastic_moduli,
        first=len(job.mesh.nodes_mm) + 1,
        facets=_facet_numbers(job),
        moving=moving,
    )


def febio_deck(job: Job) -> str:
    upper = [
        (job.wedges[n, 3:] if job.is_wedge[n] else job.mesh.elements[n, 4:]) + 1
        for n in job.touching_elements
    ]
    body, steps_ms = len(job.mesh.nodes_mm), np.diff(job.times_ms)
    elastic = [layer for layer in job.layer_names if not job.materials[layer].prony.shares]
    return _rendered(
        "febio.xml",
        job=job,
        steps_ms=steps_ms,
        next_steps_ms=[*steps_ms, steps_ms[-1]],
        materials=[_febio_material(name, job.materials[layer]) for layer, name in job.layer_names.items()],
        body=body,
        parts=list(_parts(job)),
        skin=upper,
        facets=[*(job.rigid.quads + body + 1), *(job.rigid.triangles + body + 1)],
        elastic=np.flatnonzero(np.isin(job.mesh.layer, elastic)) + 1,
    )


DECKS: dict[str, tuple[str, Callable[[Job], str]]] = {
    "abaqus": ("touch.inp", abaqus_deck),
    "calculix": ("touch.inp", calculix_deck),
    "febio": ("touch.feb", febio_deck),
}
"""Name of the input file of each solver, and the function that returns its text."""


RESULTS: dict[str, str] = {
    "vtu": "touch.pvd",
    "csv": "touch.csv",
    "npz": "touch.npz",
    "netcdf": "touch.nc",
    "zarr": "touch.zarr",
}
"""Name of the file that `SkinResponse.save` writes for each format."""

FORMATS = (*RESULTS, *DECKS)


@checked
def export_touch(
    folder: Path, touch: Touch, format_name: str, elastic_moduli: str | None = None
) -> tuple[Path, ...]:
    """Write an indentation for another program.

    Parameters
    ----------
    folder : Path
        Folder for the files; it is created if needed.
    touch : Touch
        The indentation to export; all but the input files of solvers also solve it.
    format_name : str
        One of `FORMATS`.
    elastic_moduli : {"long_term", "instantaneous"}, optional
        For "calculix", which has no relaxation: the moduli of the layers.

    Returns
    -------
    tuple of Path
        The file to open.
    """
    one_of("format", format_name, FORMATS)
    if elastic_moduli is not None and format_name != "calculix":
        raise InputError(
            f"elastic_moduli is for calculix, which has no relaxation, not for {format_name}: leave it out."
        )
    require(format_name)  # first, since solving takes its time
    if format_name in DECKS:
        return (write_deck(folder, job_of(touch), format_name, elastic_moduli),)
    skin = touch.solve(whole=format_name in NEEDED)
    return (skin.save(folder / RESULTS[format_name]),)


def write_deck(folder: Path, job: Job, format_name: str, elastic_moduli: str | None = None) -> Path:
    """Write the input file of a solver; arguments as of `export_touch`, with what `job_of` returns."""
    name, deck = DECKS[format_name]
    text = deck(job) if elastic_moduli is None else calculix_deck(job, elastic_moduli)
    write_atomically(folder / name, text.encode())
    return folder / name


def _rendered(template: str, **values: Any) -> str:
    return _environment().get_template(template).render(values)


@cache
def _environment() -> Environment:
    made = Environment(
        loader=PackageLoader("fingerpad.export", "."),
        trim_blocks=True,
        keep_trailing_newline=True,
        undefined=StrictUndefined,
    )
    made.filters |= {"digits": digits, "listed": lambda values: ",".join(map(digits, values))}
    functions = (digits, rows, nodes, elements, layer_elements, node_set, surface, law, elastic_law, is_foam)
    made.globals |= {function.__name__: function for function in functions}
    made.globals["CONTACT_KPA_PER_MM"] = CONTACT_KPA_PER_MM
    return made


def digits(value: float | str) -> str:
    """Write a number with 12 digits, in at most 20 characters, which is the limit of CalculiX."""
    return value if isinstance(value, str) else f"{value:.12g}"


def rows(values: Iterable[float | str], per_line: int = PER_LINE, ending: str = "") -> str:
    """Write the data lines of a card, up to `per_line` values each; all but the last have an ending."""
    texts = [digits(value) for value in values]
    return f"{ending}\n".join(", ".join(texts[n : n + per_line]) for n in range(0, len(texts), per_line))


def nodes(points_mm: FloatArray, first: int, name: str) -> str:
    """Card of nodes that are numbered from `first`."""
    lines = (f"{n}, {digits(x)}, {digits(y)}, {digits(z)}" for n, (x, y, z) in enumerate(points_mm, first))
    return "\n".join([f"*NODE, NSET={name}", *lines])


def elements(kind: str, name: str, numbers: IntArray, corners: IntArray) -> str:
    """Card of elements; `corners` holds node numbers."""
    numbered = np.column_stack([numbers, corners])
    lines = (rows(row, PER_LINE_OF_ELEMENT, ",") for row in numbered)
    return "\n".join([f"*ELEMENT, TYPE={kind}, ELSET={name}", *lines])


def layer_elements(job: Job, layer: int, brick: str, wedge: str) -> str:
    """Cards of one layer's elements, a set of the layer's name, numbered as in the mesh from 1."""
    return "\n".join(
        elements(wedge if wedges else brick, job.layer_names[layer], numbers + 1, corners + 1)
        for wedges, numbers, corners in job.parts(layer)
    )


def node_set(name: str, held: IntArray) -> str:
    return f"*NSET, NSET={name}\n{rows(held + 1)}"


def surface(name: str, numbers: IntArray, face: int) -> str:
    """Card of a surface made of the same face of several elements."""
    return "\n".join([f"*SURFACE, NAME={name}, TYPE=ELEMENT", *(f"{n}, S{face}" for n in numbers)])


def is_foam(material: Material) -> bool:
    return isinstance(material.law, Hyperfoam)


def _facet_numbers(job: Job) -> IntArray:
    """Numbers of the elements of the indenter, behind those of the body, from 1."""
    return len(job.mesh.elements) + 1 + np.arange(len(job.rigid.quads) + len(job.rigid.triangles))


def law(material: Material, factor: float, moduli: str = "") -> str:
    """Card of a hyperelastic law with the same meaning in Abaqus and CalculiX, its shape times a factor."""
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
            return f"*HYPERFOAM, N={count}{moduli}\n{rows([*terms, *[energy.poisson] * count])}"
        volume = [2.0 / energy.bulk_kpa] + [NO_TERM] * (count - 1)
        return f"*HYPERELASTIC, OGDEN, N={count}{moduli}\n{rows([*terms, *volume])}"
    raise InputError(
        f"The law {type(energy).__name__} has no card in Abaqus or CalculiX: their *ELASTIC differs at large "
        "strain. Export a Polynomial, Ogden or Hyperfoam material, or write a user subroutine."
    )


def _polynomial(energy: Polynomial, factor: float, moduli: str) -> str:
    shape = [factor * value for value in (energy.c10, energy.c01, energy.c20, energy.c11, energy.c02)]
    first = 1.0 / energy.bulk_linear
    if any(shape[2:]) or energy.bulk_cubic:
        second = 1.0 / energy.bulk_cubic if energy.bulk_cubic else NO_TERM
        return f"*HYPERELASTIC, POLYNOMIAL, N=2{moduli}\n{rows([*shape, first, second])}"
    if shape[1]:
        return f"*HYPERELASTIC, MOONEY-RIVLIN{moduli}\n{rows([*shape[:2], first])}"
    return f"*HYPERELASTIC, NEO HOOKE{moduli}\n{rows([shape[0], first])}"


def elastic_law(material: Material, name: str, elastic_moduli: str | None) -> str:
    """Card of the law of a layer in CalculiX, which has no relaxation for it."""
    material = replace(material, law=_in_two_terms(material.law))
    if not material.prony.shares:
        return law(material, 1.0)
    if elastic_moduli is None:
        raise InputError(
            f"CalculiX cannot relax the hyperelastic layer {name}: give elastic_moduli "
            '("long_term" or "instantaneous"; in a command --elastic-moduli), or export for Abaqus or FEBio.'
        )
    one_of("elastic_moduli", elastic_moduli, MODULI)
    share = material.prony.long_term_share
    return law(material, material.instantaneous_factor * (share if elastic_moduli == "long_term" else 1.0))


def _in_two_terms(law: Law) -> Law:
    """Halve the one term of a foam: CalculiX 2.20 reads a foam of N=1 wrongly, without a message."""
    if not isinstance(law, Hyperfoam) or len(law.exponents) > 1:
        return law
    return replace(law, moduli_kpa=(law.moduli_kpa[0] / 2,) * 2, exponents=law.exponents * 2)


Values = dict[str, float | str]


def _parts(job: Job) -> Iterator[tuple[str, str, list[Any]]]:
    """Elements of one shape of a layer, or of the indenter: name, kind, and numbers with nodes, from 1."""
    for layer, name in job.layer_names.items():
        for wedges, numbers, corners in job.parts(layer):
            yield name, KINDS[wedges], list(zip(numbers + 1, corners + 1, strict=True))
    number = len(job.mesh.elements) + 1
    for kind, faces in zip(KINDS, (job.rigid.quads, job.rigid.triangles), strict=True):
        if len(faces):
            yield (
                INDENTER,
                kind,
                list(enumerate(job.rigid.solids(faces) + len(job.mesh.nodes_mm) + 1, number)),
            )
            number += len(faces)


def _febio_material(name: str, material: Material) -> tuple[str, str, Values, str, Values]:
    """Name, type and values of a material; of a viscoelastic one the law within and its coefficients."""
    kind, coefficients, bulk_kpa = _febio_law(name, material)
    shares, times = material.prony.shares, material.prony.times_ms
    volume: Values = {"density": 1, "k": bulk_kpa, "pressure_model": ABAQUS_VOLUME}
    if not shares:
        return name, kind, volume | coefficients, "", {}
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
    return name, "uncoupled viscoelastic", volume | relaxing, kind, elastic


def _febio_law(name: str, material: Material) -> tuple[str, Values, float]:
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
