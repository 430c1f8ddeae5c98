"""FEBio 4 input file of an indentation: three-field elements, viscoelastic layers, sliding contact.

FEBio's uncoupled materials equal those of fingerpad: energies of the isochoric invariants and, with
`pressure_model` 2, the volumetric energy K/2 (J-1)². Its viscoelastic material convects the relaxing stress
without its deviator being taken again, which changes stored energies of short Prony times by about 1 %.
"""

from __future__ import annotations

from collections.abc import Iterable
from xml.etree import ElementTree as xml

import numpy as np

from fingerpad.core.errors import InputError
from fingerpad.core.values import FloatArray, IntArray
from fingerpad.export.cards import INDENTER, SKIN, digits
from fingerpad.export.job import Job
from fingerpad.mechanics.laws import Ogden, Polynomial
from fingerpad.mechanics.materials import Material

MOST_PRONY_TERMS = 6  # Most Prony terms of FEBio's viscoelastic material.
ABAQUS_VOLUME = 2  # Number of FEBio's volumetric energy K/2 (J-1)².
GAP_SHARE = 0.002  # Penetration at which FEBio stops augmenting its contact, as a share of the depth.

NODE_ON_FACET_KPA_PER_MM, MOST_AUGMENTATIONS, SEARCH_TOLERANCE = 15_000.0, 10, 0.01
"""Penalty, augmentations and tolerance of the projection of the contact without friction."""

RUBBING_KPA_PER_MM = 5_000.0  # Penalty of the contact with friction, which fails with a stiffer one. [kPa/mm]

DISPLACEMENT_TOLERANCE, ENERGY_TOLERANCE = 1e-3, 1e-4
"""FEBio's convergence criteria; its default for energy, 0.01, leaves forces 1 % wrong."""

KINDS = ("hex8", "penta6")  # FEBio's names of bricks and wedges.


def febio_deck(job: Job) -> str:
    root = xml.Element("febio_spec", version="4.0")
    _add(root, "Module", type="solid")
    _control(root, job)
    constants = _add(_add(root, "Globals"), "Constants")
    for name in ("T", "R", "Fc"):
        _add(constants, name, "0")
    _materials(root, job)
    _mesh(root, job)
    _domains(root, job)
    _boundary(root, job)
    _rigid(root, job)
    _contact(root, job)
    _load_curves(root, job)
    _output(root, job)
    xml.indent(root, " ")
    head = ['<?xml version="1.0" encoding="UTF-8"?>', "<!--", "For FEBio 4.", *job.summary, "-->"]
    return "\n".join([*head, xml.tostring(root, encoding="unicode"), ""])


def _add(parent: xml.Element, tag: str, text: str | None = None, **attributes: str) -> xml.Element:
    child = xml.SubElement(parent, tag, attributes)
    child.text = text
    return child


def _add_all(parent: xml.Element, values: dict[str, float | int | str]) -> None:
    for tag, value in values.items():
        _add(parent, tag, value if isinstance(value, str) else digits(value))


def _listed(values: Iterable[float]) -> str:
    return ",".join(digits(value) for value in values)


STEPS_CURVE, DEPTH_CURVE = 1, 2


def _control(root: xml.Element, job: Job) -> None:
    """Take the steps of the indentation: FEBio stops at each point of the curve of `dtmax`, the next step."""
    control = _add(root, "Control")
    steps = np.diff(job.times_ms)
    # -1: any number of steps up to the end, since a step that fails is divided.
    _add_all(control, {"analysis": "STATIC", "time_steps": -1, "final_time": float(job.times_ms[-1])})
    _add_all(control, {"step_size": float(steps[0])})
    _add_all(control, {"plot_level": "PLOT_MUST_POINTS", "output_level": "OUTPUT_MUST_POINTS"})
    stepper = _add(control, "time_stepper", type="default")
    _add_all(stepper, {"max_retries": 10, "opt_iter": 20, "dtmin": float(steps.min() * 1e-4)})
    _add(stepper, "dtmax", "0", lc=str(STEPS_CURVE))
    _add_all(stepper, {"aggressiveness": 1, "cutback": 0.5, "dtforce": 1})
    solver = _add(control, "solver", type="solid")
    _add_all(
        solver,
        {
            # Friction makes the tangent unsymmetric.
            "symmetric_stiffness": "non-symmetric" if job.friction else "symmetric",
            "max_refs": 30,
            "reform_each_time_step": 1,
            "dtol": DISPLACEMENT_TOLERANCE,
            "etol": ENERGY_TOLERANCE,
            "rtol": 0,
        },
    )
    _add_all(_add(solver, "qn_method", type="full Newton"), {})


def _materials(root: xml.Element, job: Job) -> None:
    section = _add(root, "Material")
    for n, (layer, name) in enumerate(job.layer_names.items(), 1):
        _material(section, n, name, job.materials[layer])
    rigid = _add(section, "material", id=str(len(job.layer_names) + 1), name=INDENTER, type="rigid body")
    _add_all(rigid, {"density": 1, "center_of_mass": _listed(job.placement.origin_mm)})


def _material(section: xml.Element, n: int, name: str, material: Material) -> None:
    kind, values, bulk = _law(material, name)
    shares, times = material.prony.shares, material.prony.times_ms
    volume: dict[str, float | int | str] = {"k": bulk, "pressure_model": ABAQUS_VOLUME}
    if not shares:
        element = _add(section, "material", id=str(n), name=name, type=kind)
        _add_all(element, {"density": 1, **volume, **values})
        return
    if len(shares) > MOST_PRONY_TERMS:
        raise InputError(
            f"FEBio takes {MOST_PRONY_TERMS} Prony terms: layer {name} has {len(shares)}; fit fewer terms."
        )
    # FEBio's modulus is g0 + sum g_i exp(-t/tau_i) times the elastic one, be that long-term or instantaneous.
    final = 1.0 if material.moduli == "long_term" else material.prony.long_term_share
    factor = final / material.prony.long_term_share
    element = _add(section, "material", id=str(n), name=name, type="uncoupled viscoelastic")
    _add_all(element, {"density": 1, **volume})
    _add_all(element, {f"t{i}": time for i, time in enumerate(times, 1)})
    _add_all(element, {"g0": final, **{f"g{i}": factor * share for i, share in enumerate(shares, 1)}})
    _add_all(_add(element, "elastic", type=kind), {"density": 1, **values})


def _law(material: Material, name: str) -> tuple[str, dict[str, float | int | str], float]:
    """FEBio's name of a law, its coefficients, and the bulk modulus."""
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
        values: dict[str, float | int | str] = {}
        for i, (modulus, exponent) in enumerate(zip(law.moduli_kpa, law.exponents, strict=True), 1):
            values |= {f"c{i}": 2.0 * modulus, f"m{i}": exponent}
        return "Ogden", values, law.bulk_kpa
    what = "a polynomial with D2" if isinstance(law, Polynomial) else type(law).__name__
    raise InputError(
        f"FEBio has no three-field material for {what} (layer {name}): export a polynomial without D2 or an "
        "Ogden material, or use Abaqus for a foam."
    )


def _mesh(root: xml.Element, job: Job) -> None:
    mesh = _add(root, "Mesh")
    body = len(job.mesh.nodes_mm)
    _nodes(mesh, "body", job.mesh.nodes_mm, 1)
    _nodes(mesh, INDENTER, job.rigid.nodes_mm, body + 1)
    for layer, kind, numbers, corners in _parts(job):
        _elements(mesh, f"{job.layer_names[layer]}_{kind}", kind, numbers + 1, corners + 1)
    first = len(job.mesh.elements) + 1
    for kind, faces in zip(KINDS, (job.rigid.quads, job.rigid.triangles), strict=True):
        if len(faces):
            numbers = first + np.arange(len(faces))
            _elements(mesh, f"{INDENTER}_{kind}", kind, numbers, job.rigid.solids(faces) + body + 1)
            first += len(faces)
    for support in job.supports():
        _add(mesh, "NodeSet", ",".join(map(str, support.nodes + 1)), name=support.name)
    upper = [
        (job.wedges[n, 3:] if job.is_wedge[n] else job.mesh.elements[n, 4:]) + 1
        for n in job.touching_elements
    ]
    _surface(mesh, SKIN, upper)
    _surface(mesh, INDENTER, [*(job.rigid.quads + body + 1), *(job.rigid.triangles + body + 1)])
    pair = _add(mesh, "SurfacePair", name="touch")
    _add_all(pair, {"primary": SKIN, "secondary": INDENTER})


def _nodes(mesh: xml.Element, name: str, points_mm: FloatArray, first: int) -> None:
    nodes = _add(mesh, "Nodes", name=name)
    for n, point in enumerate(points_mm, first):
        _add(nodes, "node", _listed(point), id=str(n))


def _parts(job: Job) -> Iterable[tuple[int, str, IntArray, IntArray]]:
    """Layer, kind of element, element numbers and their nodes."""
    for layer in job.layer_names:
        for wedges, numbers in job.parts(layer):
            yield layer, KINDS[wedges], numbers, (job.wedges if wedges else job.mesh.elements)[numbers]


def _elements(mesh: xml.Element, name: str, kind: str, numbers: IntArray, corners: IntArray) -> None:
    elements = _add(mesh, "Elements", type=kind, name=name)
    for n, row in zip(numbers, corners, strict=True):
        _add(elements, "elem", ",".join(map(str, row)), id=str(n))


def _surface(mesh: xml.Element, name: str, faces: Iterable[IntArray]) -> None:
    surface = _add(mesh, "Surface", name=name)
    for n, face in enumerate(faces, 1):
        _add(surface, "quad4" if len(face) == 4 else "tri3", ",".join(map(str, face)), id=str(n))


def _domains(root: xml.Element, job: Job) -> None:
    section = _add(root, "MeshDomains")
    for layer, kind, _, _ in _parts(job):
        name = job.layer_names[layer]
        _add(section, "SolidDomain", name=f"{name}_{kind}", mat=name, type="three-field-solid")
    for kind, faces in zip(KINDS, (job.rigid.quads, job.rigid.triangles), strict=True):
        if len(faces):
            _add(section, "SolidDomain", name=f"{INDENTER}_{kind}", mat=INDENTER, type="rigid-solid")


def _boundary(root: xml.Element, job: Job) -> None:
    section = _add(root, "Boundary")
    for support in job.supports():
        condition = _add(section, "bc", name=support.name, node_set=support.name, type="zero displacement")
        first, last = support.axes
        _add_all(condition, {f"{axis}_dof": int(first <= n <= last) for n, axis in enumerate("xyz", 1)})


def _rigid(root: xml.Element, job: Job) -> None:
    """Move the indenter along its axis by the curve of depths, without rotation."""
    section = _add(root, "Rigid")
    turning = _add(section, "rigid_bc", name="no rotation", type="rigid_fixed")
    moving = {"x": 0, "y": 0, "z": 0, "u": 1, "v": 1, "w": 1}
    _add_all(turning, {"rb": INDENTER, **{f"R{axis}_dof": held for axis, held in moving.items()}})
    for axis, share in zip("xyz", job.placement.axis, strict=True):
        condition = _add(section, "rigid_bc", name=f"motion along {axis}", type="rigid_displacement")
        _add_all(condition, {"rb": INDENTER, "dof": axis})
        _add(condition, "value", digits(float(share) + 0.0), lc=str(DEPTH_CURVE))
        _add(condition, "relative", "0")


def _contact(root: xml.Element, job: Job) -> None:
    """Write the contact: of nodes as here, or of Gauss points, which is the one that rubs reliably."""
    # A contact that closes at Gauss points instead of nodes presses a ball deeper by (2/3) (hx² + hz²) / (8
    # R) for elements of hx by hz.
    kind = "sliding-elastic" if job.friction else "sliding-node-on-facet"
    contact = _add(_add(root, "Contact"), "contact", name="touch", surface_pair="touch", type=kind)
    deepest_mm = float(job.depths_mm.max())
    penalty = RUBBING_KPA_PER_MM if job.friction else NODE_ON_FACET_KPA_PER_MM
    _add_all(contact, {"laugon": "AUGLAG", "tolerance": 0, "gaptol": GAP_SHARE * deepest_mm})
    _add_all(contact, {"penalty": penalty, "auto_penalty": 0, "two_pass": 0})
    if job.friction:
        _add_all(contact, {"search_radius": 2.0 * deepest_mm, "symmetric_stiffness": 0, "tension": 0})
        _add_all(contact, {"fric_coeff": job.friction})
    else:
        _add_all(contact, {"search_tol": SEARCH_TOLERANCE, "maxaug": MOST_AUGMENTATIONS})


def _load_curves(root: xml.Element, job: Job) -> None:
    section = _add(root, "LoadData")
    steps = np.append(np.diff(job.times_ms), 0.0)
    steps[-1] = steps[-2]
    for n, values in ((STEPS_CURVE, steps), (DEPTH_CURVE, job.depths_mm)):
        controller = _add(section, "load_controller", id=str(n), type="loadcurve")
        _add_all(controller, {"interpolate": "LINEAR", "extend": "CONSTANT"})
        points = _add(controller, "points")
        for time, value in zip(job.times_ms, values, strict=True):
            _add(points, "pt", _listed((time, value)))


def _output(root: xml.Element, job: Job) -> None:
    """Ask for what every material can answer: FEBio stops when a relaxing one is asked for its energy."""
    # The energy density of a layer that does not relax is devsed + K/2 (J-1)², with the mean J of the
    # element.
    section = _add(root, "Output")
    plot = _add(section, "plotfile", type="febio")
    for name in ("displacement", "stress", "contact pressure", "reaction forces"):
        _add(plot, "var", type=name)
    log = _add(section, "logfile")
    _add(log, "rigid_body_data", data="x;y;z;Fx;Fy;Fz", file="indenter.txt")
    _add(log, "node_data", data="ux;uy;uz", file="displacement.txt")
    _add(log, "element_data", data="J;sx;sy;sz;sxy;syz;sxz", file="stress.txt")
    elastic = [
        number
        for layer, _, numbers, _ in _parts(job)
        if not job.materials[layer].prony.shares
        for number in numbers
    ]
    if elastic:
        listed = ",".join(str(number + 1) for number in sorted(elastic))
        _add(log, "element_data", listed, data="devsed", file="devsed.txt")
