"""What every press owes: the force of the indenter on the bone, its work in the body, no penetration."""

from __future__ import annotations

from functools import lru_cache

import numpy as np

from fingerpad.geometry.bodies import Bar, Cylinder, Edge, FlatPunch, Gap, Line, Plate, Sphere
from fingerpad.geometry.mesh import block_mesh
from fingerpad.geometry.mesh_checks import jacobian_at_gauss
from fingerpad.geometry.motion import RampAndHold
from fingerpad.mechanics.contact import PlacedIndenter, place
from fingerpad.mechanics.materials import Material, Prony
from fingerpad.mechanics.newton import NewtonSettings
from fingerpad.mechanics.press import Specimen, press
from fingerpad.mechanics.press_settings import PressSettings

from .case import Row, at_least, at_most, case, near
from .solid import Solid

THEME = "Balance of forces and energy, penetration"
INDENTERS = {
    "line": Line(),
    "cylinder": Cylinder(3.0),
    "bar": Bar(2.0, 0.3),
    "sphere": Sphere(curvature_per_m=500.0),
    "flat punch": FlatPunch(2.0, 0.3),
    "plate": Plate(),
    "edge": Edge(0.3),
    "bar with a gap": Gap(0.8, 4.0, 0.3, 0.2),
}
LAYERS = tuple(Material.neo_hooke(shear, 0.45) for shear in (40.0, 40.0, 20.0, 8.0))
PRONY = Prony(shares=(0.2, 0.3), times_ms=(30.0, 400.0))
RELAXING = tuple(layer.with_prony(PRONY) for layer in LAYERS)
DEPTH_MM = 0.3


def block(symmetric=True):
    """A layered block, half of it if symmetric."""
    edges = np.array([0.0, 0.4, 0.8, 1.3, 2.0, 3.0])
    both = np.concatenate([-edges[:0:-1], edges])
    through = np.array([0.0, 0.3, 0.6, 1.2, 2.0, 3.0])
    return block_mesh(
        both, through, edges if symmetric else both, layers=[0, 1, 2, 3, 3], symmetric=symmetric
    )


def pressed(mesh, indenter, layers=LAYERS, motion=None, settings=None):
    """Press a block."""
    placement = place(indenter, mesh.nodes_mm[mesh.skin_nodes], np.zeros(3), np.eye(3))
    motion = motion or RampAndHold(DEPTH_MM, 50.0, 300.0)
    return press(
        Specimen(mesh, layers), PlacedIndenter(indenter, placement), motion, settings or PressSettings(4, 3)
    )


@lru_cache(maxsize=len(INDENTERS))
def ordinary(name):
    """Press of a relaxing block with the settings that a touch has."""
    return pressed(block(), INDENTERS[name], RELAXING)


@case(THEME, "Contact force and reaction of the supports", "Newton's third law")
def force_balance() -> list[Row]:
    """A relaxing layered block under every indenter, ramp and hold, default settings: largest difference at
    any time between contact force and reaction of the supports, over the contact force. Every indentation
    checks this as well.
    """
    return [
        at_most(f"{name}: imbalance over force", 1e-4, ordinary(name).force_imbalance) for name in INDENTERS
    ]


@case(THEME, "Reaction from internal forces", "Newton's third law")
def reaction_by_hand() -> list[Row]:
    """Elastic block. The reaction is summed here from the internal forces at its bottom in the last step."""
    rows = []
    for name, indenter in INDENTERS.items():
        mesh = block()
        done = pressed(mesh, indenter, settings=PressSettings(2, 1))
        force = Solid(mesh, LAYERS).evaluate(done.displacement_mm[-1])[1]
        reaction = -2 * force[mesh.fixed_nodes, 1].sum()
        rows.append(near(f"{name}: reaction", done.force_mn[-1], reaction, 1e-4, "mN"))
    return rows


@case(THEME, "Penetration", "Our own bound: below 0.5 % of the depth")
def penetration() -> list[Row]:
    """Indentations of the first case: deepest penetration of any skin node at any time, over the depth."""
    return [
        at_most(f"{name}: penetration over depth", 0.005, ordinary(name).penetration_mm / DEPTH_MM)
        for name in INDENTERS
    ]


@lru_cache(maxsize=8)
def work_and_energy(relaxing, ramp_steps):
    """Work of the indenter by the trapezoidal rule, and energy stored at the end of the ramp. [µJ]"""
    mesh = block()
    tight = NewtonSettings(residual_tolerance=1e-6, penetration_tolerance=2e-4)
    done = pressed(
        mesh,
        INDENTERS["sphere"],
        RELAXING if relaxing else LAYERS,
        settings=PressSettings(ramp_steps, 1, tight),
    )
    ramp = slice(0, ramp_steps + 1)
    stored = 2 * done.sed_kpa[ramp_steps] @ jacobian_at_gauss(mesh).sum(axis=1)
    return np.trapezoid(done.force_mn[ramp], done.depth_mm[ramp]), stored


@case(THEME, "Work and stored energy of an elastic body", "Conservation of energy")
def work_is_stored() -> list[Row]:
    """A sphere indents an elastic block by 0.3 mm. With few steps the trapezoidal rule overestimates the
    work. The error must decrease as steps are halved, with order 1.5 or more (force increases as depth^1.5).
    """
    errors = [work / stored - 1 for work, stored in (work_and_energy(False, n) for n in (3, 6, 12))]
    stored = work_and_energy(False, 12)[1]
    return [
        near("work, 12 steps", stored, work_and_energy(False, 12)[0], 0.005, "µJ"),
        at_least("error with 3 steps over 6 steps", 2.0, errors[0] / errors[1]),
        at_least("error with 6 steps over 12 steps", 2.0, errors[1] / errors[2]),
    ]


@case(THEME, "Work and stored energy of a relaxing body", "Second law: dissipation is not negative")
def relaxing_stores_less() -> list[Row]:
    """The same block with two Prony terms: stored energy over work at the end of a ramp of 50 ms."""
    work, stored = work_and_energy(True, 6)
    return [
        at_most("stored energy over work", 0.98, stored / work),
        at_least("stored energy over work", 0.5, stored / work),
    ]


@case(THEME, "Sum of stored and dissipated energy", "Conservation of energy")
def energy_adds_up() -> list[Row]:
    """The indentations of the first case, which dissipate a third of the work. Work by cubic splines of force
    over depth, energy stored in the tissue, heat (work of the stress less the change of what is stored), and
    energy of the contact springs: largest difference at any time, over the work. Four steps for the ramp
    are few for a sphere: the first step alone causes 0.3 %.
    """
    return [
        at_most(f"{name}: imbalance over work", 0.01, ordinary(name).energy.relative_imbalance)
        for name in INDENTERS
    ]


@case(THEME, "Energy balance with many steps", "Conservation of energy", slow=True)
def energy_balance_many_steps() -> list[Row]:
    """The same with 24 + 12 steps and a smaller penetration tolerance."""
    tight = PressSettings(24, 12, NewtonSettings(residual_tolerance=1e-6, penetration_tolerance=1e-3))
    return [
        at_most(f"{name}: imbalance over work", 0.0005,
                pressed(block(), indenter, RELAXING, settings=tight).energy.relative_imbalance)
        for name, indenter in INDENTERS.items()
    ]  # fmt: skip
