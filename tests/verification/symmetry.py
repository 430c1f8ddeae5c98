"""Half a body answers as the whole one."""

from __future__ import annotations

from dataclasses import replace

import numpy as np

from fingerpad.geometry.bodies import Cylinder, Sphere
from fingerpad.geometry.fingertip import Fingertip
from fingerpad.geometry.grading import Grading
from fingerpad.geometry.mesh import finger_mesh
from fingerpad.geometry.motion import RampAndHold
from fingerpad.mechanics.contact import PlacedIndenter, place
from fingerpad.mechanics.newton import NewtonSettings
from fingerpad.mechanics.press import Specimen, press
from fingerpad.mechanics.press_settings import PressSettings
from fingerpad.mechanics.tissues import named_tissues

from .balance import RELAXING, block, pressed
from .case import Row, at_most, case, near

THEME = "Mirror symmetry"
TIGHT = NewtonSettings(residual_tolerance=1e-6, penetration_tolerance=1e-3)
BALL = Sphere(curvature_per_m=500.0)


@case(THEME, "Block", "Symmetry about z = 0")
def symmetric_block() -> list[Row]:
    """Sphere on a relaxing layered block, half and whole model, at the end of the hold."""
    half, whole = (
        pressed(block(symmetric), BALL, RELAXING, settings=PressSettings(4, 3, TIGHT))
        for symmetric in (True, False)
    )
    along, around, through = block().shape
    both = whole.sed_kpa[-1].reshape(along, 2 * around, through)
    one = half.sed_kpa[-1].reshape(along, around, through)
    solved = np.abs(both[:, around:] - one).max() / one.max()
    mirrored = np.abs(both[:, around - 1 :: -1] - one).max() / one.max()
    return [
        near("force of the half, doubled", whole.force_mn[-1], half.force_mn[-1], 1e-4, "mN"),
        at_most("difference of SED, solved half, over its largest", 1e-4, solved),
        at_most("difference of SED, mirrored half, over its largest", 1e-4, mirrored),
    ]  # fmt: skip


def finger_answers(indenter):
    """Press a coarse finger, half and whole."""
    coarse = Grading(
        17.37, 1.2, 1.2, 0.6, 0.6, largest_mm=4.0, stratum_corneum=1, dermis=1, subcutis=2, living_epidermis=1
    )
    for full in (False, True):
        mesh = finger_mesh(Fingertip(), replace(coarse, full=full))
        placement = place(indenter, mesh.nodes_mm[mesh.skin_nodes], np.array([17.37, -10.0, 0.0]), np.eye(3))
        done = press(
            Specimen(mesh, named_tissues("trial3").layers),
            PlacedIndenter(indenter, placement),
            RampAndHold(0.5, 50.0, 100.0),
            PressSettings(2, 1, TIGHT),
        )
        yield mesh, done


def finger_rows(indenter):
    """Force, profile and SED of half a finger against the whole one."""
    (half_mesh, half), (whole_mesh, whole) = finger_answers(indenter)
    profiles = [
        done.displacement_mm[-1, mesh.midline_nodes, 1]
        for mesh, done in ((half_mesh, half), (whole_mesh, whole))
    ]
    sheets = [
        done.sed_kpa[-1, mesh.living_epidermis] for mesh, done in ((half_mesh, half), (whole_mesh, whole))
    ]
    around = sheets[0].shape[1]
    largest = sheets[0].max()
    solved = np.abs(sheets[1][:, around:] - sheets[0]).max() / largest
    mirrored = np.abs(sheets[1][:, around - 1 :: -1] - sheets[0]).max() / largest
    return [
        near("force of the half, doubled", whole.force_mn[-1], half.force_mn[-1], 1e-4, "mN"),
        at_most("difference of the midline's deflection, over the depth", 1e-4,
                np.abs(profiles[0] - profiles[1]).max() / 0.5),
        at_most("difference of SED in the living epidermis, over its largest", 1e-3, solved),
        at_most("difference of SED, mirrored half", 1e-3, mirrored),
    ]  # fmt: skip


@case(THEME, "Finger under a sphere", "Symmetry about z = 0")
def symmetric_finger() -> list[Row]:
    """Coarse finger of Trial 3, depth 0.5 mm, at the end of the hold."""
    return finger_rows(BALL)


@case(THEME, "Finger under a cylinder", "Symmetry about z = 0", slow=True)
def symmetric_finger_cylinder() -> list[Row]:
    """The same under the paper's cylinder."""
    return finger_rows(Cylinder())
