"""Other solvers on the same exported job: CalculiX runs our deck, FElupe the same mesh by its own elements.

Both need what fingerpad itself does not, so `test_oracles.py` runs these cases apart from the others.
"""

from __future__ import annotations

import tempfile
from dataclasses import replace
from functools import lru_cache
from pathlib import Path

import numpy as np

from fingerpad.export import decks
from fingerpad.export.decks import calculix_deck
from fingerpad.export.job import Job, job_of
from fingerpad.geometry.bodies import Bar, Cylinder, Edge, FlatPunch, Gap, Line, Plate, Sphere
from fingerpad.geometry.embossed import Embossed
from fingerpad.geometry.fingertip import Fingertip
from fingerpad.geometry.grading import Grading
from fingerpad.geometry.mesh import block_mesh
from fingerpad.geometry.motion import RampAndHold
from fingerpad.mechanics.contact import PlacedIndenter, place
from fingerpad.mechanics.laws import Polynomial
from fingerpad.mechanics.materials import Material, Tissues
from fingerpad.mechanics.press import Specimen, press
from fingerpad.mechanics.press_settings import PressSettings
from fingerpad.skin.indentation import Touch

from . import calculix
from .case import Row, at_most, case, equal, near
from .oracle_block import LIVING_EPIDERMIS, POISSON, YOUNG_KPA, job, job_and_back, ours, ours_and_back

THEME = "Other solvers"
CALCULIX = "CalculiX 2.20"
FELUPE = "FElupe 11"

SAME_ELEMENT, OTHER_ELEMENT = (0.003, 0.005), (0.01, 0.03)
"""Tolerances of force and of SED, as shares: for the same element, and for another on the same nodes."""
COARSE_MESH = 0.02
"""Tolerance of force, as a share, for another element on a coarse mesh."""


def compared(force_mn: np.ndarray, sed_kpa: np.ndarray, tolerances: tuple[float, float]) -> list[Row]:
    """Rows of a comparison: force at every step, field of SED at the end everywhere and below the sphere."""
    of_force, of_field = tolerances
    mesh, mine = job().mesh, ours()
    steps = job().times_ms.size
    rows = [
        near(f"force at {depth:.1f} mm", force, got, of_force, "mN")
        for depth, force, got in zip(job().depths_mm[1:], force_mn, mine.force_mn[1:steps], strict=True)
    ]
    difference = mine.sed_kpa[steps - 1] - sed_kpa
    below = mesh.layer == LIVING_EPIDERMIS
    return [
        *rows,
        near("largest SED", sed_kpa.max(), mine.sed_kpa[steps - 1].max(), of_field, "kPa"),
        at_most("largest difference of SED over the largest SED", of_field, _share(difference, sed_kpa)),
        at_most(
            "the same in the living epidermis alone", of_field, _share(difference[below], sed_kpa[below])
        ),
    ]


def _share(difference: np.ndarray, field: np.ndarray) -> float:
    return float(np.abs(difference).max() / field.max())


@case(THEME, "FElupe, layered block under a sphere", FELUPE, slow=True)
def felupe_block() -> list[Row]:
    """Neo-Hookean layers with nu = 0.48 and the moduli of Trial 1 under a sphere of 3.5 mm radius, depth 0.8
    mm. FElupe's brick has one pressure like ours, and both have contact at the nodes. Mesh and element are
    therefore the same; only the tolerances of Newton's method and of contact differ.
    """
    from . import felupe_press  # GPL: only tests import it

    force, sed = felupe_press.press(job())
    return compared(2.0 * force, sed, SAME_ELEMENT)


@case(THEME, "CalculiX, layered block under a sphere", CALCULIX, slow=True)
def calculix_block() -> list[Row]:
    """The same job as an exported deck. Nodes, trilinear shape, law and contact at nodes are the same. The
    method against locking differs: incompatible modes (C3D8I) there, one pressure per element here. Plain
    C3D8 would lock and be stiffer by several per cent. CalculiX accumulates energies over its increments by
    the trapezoidal rule; eight increments are used, and each is printed.
    """
    element = job().mesh.layer
    with tempfile.TemporaryDirectory() as folder:
        found = calculix.run(
            calculix_deck(job()), Path(folder), len(element), tuple(job().layer_names.values())
        )
    np.testing.assert_allclose(found.times_ms, job().times_ms[1:])
    return compared(2.0 * found.force_mn @ job().placement.axis, found.sed_kpa[-1], OTHER_ELEMENT)


@case(THEME, "FElupe, press and release", FELUPE, slow=True)
def felupe_release() -> list[Row]:
    """The same block and sphere, in by 0.8 mm and out again in two steps each. The layers are elastic: both
    programs must take the same way back, and the loop must enclose no work. (CalculiX does not converge on a
    retreat by steps of this size.)
    """
    from . import felupe_press  # GPL: only tests import it

    mine, depths = ours_and_back().force_mn, job_and_back().depths_mm
    theirs = np.concatenate([[0.0], 2.0 * felupe_press.press(job_and_back())[0]])
    scale = theirs.max() * depths.max()
    works = [np.trapezoid(force, depths) / scale for force in (theirs, mine)]
    tolerance, _ = SAME_ELEMENT
    return [
        near("force at 0.4 mm, in", theirs[1], mine[1], tolerance, "mN"),
        near("force at 0.8 mm", theirs[2], mine[2], tolerance, "mN"),
        near("force at 0.4 mm, out", theirs[3], mine[3], tolerance, "mN"),
        equal("force after release over the largest", theirs[4] / theirs[2], mine[4] / theirs[2], 1e-5),
        equal("work that the loop encloses, over force times depth", *works, 1e-4),
    ]


TILTED = np.array([[0.96, -0.28, 0.0], [0.28, 0.96, 0.0], [0.0, 0.0, 1.0]])
QUARTER = np.array([[0.0, 0.0, -1.0], [0.0, 1.0, 0.0], [1.0, 0.0, 0.0]])
FRAME = [[(-u, -u), (u, -u), (u, u), (-u, u)] for u in (1.8, 0.6)]
PRESSES = {  # indenter, its axes, friction
    "sphere": (Sphere(curvature_per_m=1000.0 / 3.0), np.eye(3), 0.0),
    "cylinder, tilted by 16 degrees": (Cylinder(4.0), TILTED, 0.0),
    "bar": (Bar(3.4, 0.6), np.eye(3), 0.0),
    "flat punch": (FlatPunch(3.0, 0.6), np.eye(3), 0.0),
    "plate": (Plate(), np.eye(3), 0.0),
    "plate, friction 0.3": (Plate(), np.eye(3), 0.3),
    "line": (Line(0.9), np.eye(3), 0.0),
    "bar, turned by a quarter": (Bar(3.4, 0.6), QUARTER, 0.0),
    "edge": (Edge(0.6), np.eye(3), 0.0),
    "raised square with a hole": (Embossed(FRAME, height_mm=0.6, edge_radius_mm=0.4), np.eye(3), 0.0),
}


@case(THEME, "CalculiX, every indenter", CALCULIX, slow=True)
def calculix_indenters() -> list[Row]:
    """Each indenter at a depth of 0.3 mm in a coarse layered block, nu = 0.45: force at the end. It verifies
    outlines, facets, placement and contact of a deck. The mesh is coarse, 0.4 mm under edges of 0.6 mm
    radius, so the two elements against locking differ by more than on the fine block. Friction increases the
    force under the plate by 15 %.
    """
    lines = np.array([0.0, 0.4, 0.8, 1.2, 1.6, 2.0, 2.8, 4.0])
    both = np.concatenate([-lines[:0:-1], lines])
    mesh = block_mesh(both, [0.0, 0.3, 0.6, 1.2, 2.0, 3.0], lines, [0, 1, 2, 3, 3], symmetric=True)
    materials = tuple(Material.linear_elastic(young, 0.45) for young in YOUNG_KPA)
    motion = RampAndHold(depth_mm=0.3, ramp_ms=10.0, hold_ms=1.0)
    times = np.array([0.0, 5.0, 10.0])
    rows = []
    for name, (indenter, axes, friction) in PRESSES.items():
        placement = place(indenter, mesh.nodes_mm[mesh.skin_nodes], np.zeros(3), axes)
        settings = PressSettings(ramp_steps=2, hold_steps=1)
        got = press(
            Specimen(mesh, materials),
            PlacedIndenter(indenter, placement, friction=friction),
            motion,
            settings,
        ).force_mn[2]
        pressed = Job(mesh, materials, indenter, placement, times, motion.prescribed_at(times), friction)
        with tempfile.TemporaryDirectory() as folder:
            found = calculix.run(calculix_deck(pressed), Path(folder), len(mesh.elements), ())
        rows.append(near(name, 2.0 * found.force_mn[-1] @ placement.axis, got, COARSE_MESH, "mN"))
    return rows


@case(THEME, "CalculiX, a bar with a gap", CALCULIX, slow=True)
def calculix_gap() -> list[Row]:
    """Two ridges at a depth of 0.3 mm in the layered block, mesh lines 0.2 mm apart along it: force at the
    end. Four edges bend the skin where other bodies have two. On the coarse block of those the two elements
    differ by 2.3 % under such a bar; here they agree.
    """
    half = np.concatenate([np.arange(0.0, 3.1, 0.2), [3.4, 4.0]])
    along, across = np.concatenate([-half[:0:-1], half]), np.array([0.0, 2.0, 4.0])
    depth = [0.0, 0.15, 0.3, 0.45, 0.6, 0.9, 1.2, 1.6, 2.0, 3.0]
    mesh = block_mesh(along, depth, across, [0, 0, 1, 1, 2, 2, 3, 3, 3], symmetric=True)
    materials = tuple(Material.linear_elastic(young, 0.45) for young in YOUNG_KPA)
    indenter, motion = Gap(1.2, 5.0, 0.6, 0.6), RampAndHold(depth_mm=0.3, ramp_ms=10.0, hold_ms=1.0)
    placement = place(indenter, mesh.nodes_mm[mesh.skin_nodes], np.zeros(3), np.eye(3))
    settings = PressSettings(ramp_steps=2, hold_steps=1)
    got = press(Specimen(mesh, materials), PlacedIndenter(indenter, placement), motion, settings).force_mn[2]
    times = np.array([0.0, 5.0, 10.0])
    pressed = Job(mesh, materials, indenter, placement, times, motion.prescribed_at(times))
    with tempfile.TemporaryDirectory() as folder:
        found = calculix.run(calculix_deck(pressed), Path(folder), len(mesh.elements), ())
    return [near("bar with a gap", 2.0 * found.force_mn[-1] @ placement.axis, got, OTHER_ELEMENT[0], "mN")]


@case(THEME, "CalculiX, the tip of a finger", CALCULIX, slow=True)
def calculix_finger() -> list[Row]:
    """A coarse finger with the moduli of Trial 1 and a sphere at a depth of 0.4 mm on the slope of its tip:
    force at the end. There are wedges (C3D6) among the bricks in contact. Tilted by -20 degrees, the sphere
    touches the skin with its side, not with its pole.
    """
    finger = Fingertip()
    grading = Grading(
        centre_mm=27.0, half_length_mm=3.0, half_width_mm=2.5, size_x_mm=0.8, size_z_mm=0.8, growth=1.3,
        stratum_corneum=1, living_epidermis=1, dermis=2, subcutis=3, largest_mm=3.0,
    )  # fmt: skip
    tissues = Tissues(*(Material.linear_elastic(young, POISSON) for young in YOUNG_KPA))
    motion = RampAndHold(depth_mm=0.4, ramp_ms=10.0, hold_ms=1.0)
    rows = []
    for tilt_deg in (0.0, -20.0):
        touch = Touch(
            finger, Sphere(curvature_per_m=200.0), motion, tissues, grading,
            PressSettings(ramp_steps=2, hold_steps=1), at_mm=(26.5, 0.0), tilt_deg=tilt_deg,
        )  # fmt: skip
        exported = job_of(touch, times_ms=[0.0, 5.0, 10.0])
        with tempfile.TemporaryDirectory() as folder:
            found = calculix.run(calculix_deck(exported), Path(folder), len(exported.mesh.elements), ())
        force = 2.0 * found.force_mn[-1] @ touch.placement.axis
        rows.append(
            near(f"tilted by {tilt_deg:g} degrees", force, touch.solve().force_mn[2], COARSE_MESH, "mN")
        )
    return rows


LAWS = {
    "neo-Hooke": Material.neo_hooke(20.0, 0.45),
    "Mooney-Rivlin": Material.polynomial(6.0, 4.0, 0.0, 0.0, 0.0, 0.45),
    "polynomial": Material(Polynomial(6.0, 4.0, 2.0, 1.0, 0.5, bulk_linear=90.0)),
    "polynomial with D2": Material(Polynomial(6.0, 4.0, 2.0, 1.0, 0.5, bulk_linear=90.0, bulk_cubic=40.0)),
    "Ogden N=1": Material.ogden((8.0,), (3.0,), 0.45),
    "Ogden N=2": Material.ogden((8.0, 2.0), (2.0, 6.0), 0.45),
    "Ogden N=3": Material.ogden((8.0, 2.0, 1.0), (2.0, 6.0, -2.0), 0.45),
    "foam N=1": Material.hyperfoam((4.0,), (4.0,), 0.3),
    "foam N=3": Material.hyperfoam((4.0, 2.0, 1.0), (4.0, 6.0, 2.0), 0.4),
}
GRADIENT = np.array([[1.3, 0.2, 0.0], [0.0, 0.9, 0.1], [0.0, 0.0, 0.95]])
CORNERS = np.array(
    [[0, 0, 0], [1, 0, 0], [1, 1, 0], [0, 1, 0], [0, 0, 1], [1, 0, 1], [1, 1, 1], [0, 1, 1]], dtype=float
)
INCREMENTS = 100


@case(THEME, "CalculiX, one element of every law", CALCULIX, slow=True)
def calculix_laws() -> list[Row]:
    """A cube per law deformed by the same gradient, J = 1.11, in 100 increments: energy density at the end.
    Decks work around two properties of CalculiX. It replaces a D of 0 by a stiffness of its own in a
    polynomial or Ogden law without a message, so decks write 1e20. It reads a foam of one term wrongly, so
    decks write it as two halves.
    """
    energies = cube_energies()
    strain = np.log(np.linalg.svd(GRADIENT, compute_uv=False))
    logs = [*(strain - strain.mean()), strain.sum()]
    return [
        near(name, energy, material.law.energy.derivatives(logs)[0], 1e-4, "kPa")
        for (name, material), energy in zip(LAWS.items(), energies, strict=True)
    ]


def law_card(material: Material) -> list[str]:
    """Card of a law as it stands in an exported deck."""
    deck = calculix_deck(replace(job(), materials=(material,) * len(job().materials))).splitlines()
    start = deck.index("*MATERIAL, NAME=dermis") + 1
    return deck[start : deck.index("*SOLID SECTION, ELSET=dermis, MATERIAL=dermis")]


@lru_cache(maxsize=1)
def cube_energies() -> np.ndarray:
    """Energies by CalculiX of one cube per law under `GRADIENT`; a free cube beside them stays at rest."""
    lines, moves = [], ["*BOUNDARY"]
    displacement = CORNERS @ (GRADIENT - np.eye(3)).T
    names = [f"LAW{n}" for n in range(len(LAWS))]
    for n, (name, material) in enumerate(zip([*names, "FREE"], [*LAWS.values(), None], strict=True)):
        first = 1 + 8 * n
        lines.append(decks.nodes(CORNERS + np.array([3.0 * n, 0.0, 0.0]), first, f"N{name}"))
        lines.append(decks.elements("C3D8", name, np.array([n + 1]), first + np.arange(8)[None]))
        law = law_card(material) if material else ["*ELASTIC", "1, 0.3"]
        lines += [f"*MATERIAL, NAME={name}", *law, f"*SOLID SECTION, ELSET={name}, MATERIAL={name}"]
        if material:
            moves += [
                f"{first + node}, {axis + 1}, {axis + 1}, {decks.digits(value)}"
                for (node, axis), value in np.ndenumerate(displacement)
            ]
    lines += [
        f"*NSET, NSET={decks.INDENTER}",
        f"{first}",
        "*BOUNDARY",
        f"{first}, 1, 3",
        f"{first + 1}, 1, 3",
    ]
    lines += [f"{first + 2}, 1, 3", f"{first + 3}, 1, 3"]
    lines += [f"*STEP, NLGEOM, INC={2 * INCREMENTS}", "*STATIC, DIRECT", f"{1 / INCREMENTS}, 1.", *moves]
    lines += [f"*NODE PRINT, NSET={decks.INDENTER}, TOTALS=ONLY", "RF"]
    for name in names:
        lines += [f"*EL PRINT, ELSET={name}", "ENER"]
    with tempfile.TemporaryDirectory() as folder:
        found = calculix.run("\n".join([*lines, "*END STEP", ""]), Path(folder), len(names), tuple(names))
    return found.sed_kpa[-1]
