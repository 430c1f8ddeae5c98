"""Sliding with friction: partial slip and its reversal against closed forms, and translation invariance."""

from __future__ import annotations

from functools import lru_cache

import numpy as np

from fingerpad.geometry.bodies import Sphere
from fingerpad.geometry.mesh import block_mesh
from fingerpad.geometry.motion import Trajectory
from fingerpad.mechanics.contact import PlacedIndenter, place
from fingerpad.mechanics.materials import Material
from fingerpad.mechanics.newton import NewtonSettings
from fingerpad.mechanics.press import Deformation, Specimen, press
from fingerpad.mechanics.press_settings import PressSettings

from .case import Row, at_most, case, equal, near
from .half_space import lines, round_mesh

THEME = "Sliding with friction"
SOURCE = "Cattaneo 1938; Mindlin 1949; Johnson 1985, ch. 7.2"
YOUNG_KPA, POISSON, FRICTION = 100.0, 0.48, 0.3
SHEAR_KPA = YOUNG_KPA / (2 * (1 + POISSON))
RADIUS_MM, CONTACT_MM = 50.0, 1.0
FORCE_MN = 4 / 3 * YOUNG_KPA / (1 - POISSON**2) * CONTACT_MM**3 / RADIUS_MM
PEAK_KPA = 1.5 * FORCE_MN / (np.pi * CONTACT_MM**2)
ONSET_MM = 3 * FRICTION * FORCE_MN * (2 - POISSON) / (16 * CONTACT_MM * SHEAR_KPA)
"""Way of the sphere at which all of the contact slides."""
SETTINGS = PressSettings(1, 1, NewtonSettings(residual_tolerance=1e-6, penetration_tolerance=1e-3))

DEPTHS = (0.25, 0.5, 0.75, 1.0)
FORTH, BACK = (0.2, 0.4, 0.6, 0.8), (0.6, 0.4, 0.2, 0.0, -0.2, -0.4, -0.6, -0.8)
WAYS = (*FORTH, *BACK, *(0.0 - way for way in BACK), 1.6)
"""Ways of the sphere, over `ONSET_MM`: forth, a loop, and on until all slides."""


def resisted(way):
    """Friction Q, over its limit mu P, after a first way over `ONSET_MM`: way = 1 - (1 - Q)^(2/3)."""
    return 1 - (1 - way) ** 1.5


def resisted_back(way, turned_at):
    """Friction, over its limit, on the way back: the changes of both are twice those of a first way."""
    return resisted(turned_at) - 2 * resisted((turned_at - way) / 2)


def stuck(way):
    """Radius within which the skin sticks, over that of the contact."""
    return (1 - resisted(way)) ** (1 / 3)


@lru_cache(maxsize=1)
def partial_slip(fine=0.2, sectors=6) -> tuple[Deformation, np.ndarray]:
    """Sphere on half a round block, pressed until the contact radius should be 1 mm and then moved along x.

    Returns the result and the undeformed skin.
    """
    edges = lines(fine, 1.4, 100.0, 1.5)
    mesh = round_mesh(edges, edges, sectors)
    indenter = Sphere(curvature_per_m=1000.0 / RADIUS_MM)
    placement = place(indenter, mesh.nodes_mm[mesh.skin_nodes], np.zeros(3), np.eye(3))
    depths = [0.0, *DEPTHS, *(1.0 for _ in WAYS)]
    motion = Trajectory(
        np.arange(float(len(depths))),
        np.array(depths) * CONTACT_MM**2 / RADIUS_MM,
        x_mm=np.array([0.0, *(0.0 for _ in DEPTHS), *WAYS]) * ONSET_MM,
    )
    materials = (Material.linear_elastic(YOUNG_KPA, POISSON),) * 4
    done = press(
        Specimen(mesh, materials), PlacedIndenter(indenter, placement, friction=FRICTION), motion, SETTINGS
    )
    return done, mesh.nodes_mm[mesh.skin_nodes]


def friction_share(done: Deformation, number: int) -> float:
    """Force aside over mu times the normal force, at the way of that number."""
    aside, normal = done.contact_force_mn[1 + len(DEPTHS) + number, :2]
    return aside / (FRICTION * normal)


@case(THEME, "Partial slip of a sphere", SOURCE)
def cattaneo_mindlin() -> list[Row]:
    """R = 50 mm, contact radius 1 mm, nu = 0.48, mu = 0.3, elements of 0.2 mm. The sphere is pressed and then
    moved along the surface by shares of d0 = 3 mu P (2 - nu) / (16 a G), from which on all of the contact
    slides. Skin sticks within c = a (1 - Q / (mu P))^(1/3). Shear at a distance of r is
    mu p0 (sqrt(1 - r²/a²) - c/a sqrt(1 - r²/c²)), without the second term where skin slips; it is
    averaged over the nodes at r and may be wrong by 7 % of mu p0, since an element is a fifth of the radius.
    """
    done, skin = partial_slip()
    pressed = len(DEPTHS)
    rows = [near("normal force", FORCE_MN, done.force_mn[pressed], 0.03, "mN")]
    rows += [
        near(f"Q / (mu P) at {way:g} d0", resisted(way), friction_share(done, number), 0.02)
        for number, way in enumerate(FORTH)
    ]
    distance = np.hypot(skin[:, 0], skin[:, 2])
    for number in (1, 3):
        inner, shear = stuck(FORTH[number]), done.contact.shear_kpa[1 + pressed + number, :, 0]
        for at in (0.0, 0.4, 0.8):
            expected = np.sqrt(1 - at**2) - inner * np.sqrt(max(1 - (at / inner) ** 2, 0.0))
            got = shear[np.isclose(distance, at)].mean()
            rows.append(
                equal(
                    f"shear {at:g} mm from the centre at {FORTH[number]:g} d0",
                    FRICTION * PEAK_KPA * expected,
                    got,
                    0.07 * FRICTION * PEAK_KPA,
                    "kPa",
                )
            )
    return [*rows, near("Q / (mu P) at 1.6 d0", 1.0, friction_share(done, len(WAYS) - 1), 2e-3)]


@case(THEME, "Reversal of sliding", "Mindlin & Deresiewicz 1953; Johnson 1985, ch. 7.4")
def reversal() -> list[Row]:
    """The same sphere goes on from 0.8 d0 to -0.8 d0 and back, in eight steps each: force, energy lost in the
    closed loop (integral of Q over the way), and balance of energy over the whole path.
    """
    done, _ = partial_slip()
    turn = FORTH[-1]
    rows = [
        equal(f"Q / (mu P) on the way {name}, at {way:g} d0", sign * resisted_back(sign * way, turn),
             friction_share(done, len(FORTH) + number), 0.025)
        for sign, name, first, ways in ((1.0, "back", 0, BACK), (-1.0, "forth again", len(BACK), WAYS[12:20]))
        for number, way in enumerate(ways, first)
    ]  # fmt: skip
    ways = np.linspace(-turn, turn, 2001)
    force = FRICTION * done.force_mn[len(DEPTHS)] * ONSET_MM
    lost = -2 * force * np.trapezoid([resisted_back(way, turn) for way in ways], ways)
    first = len(DEPTHS) + len(FORTH)
    heat = done.energy.dissipated_uj
    return [
        *rows,
        near("energy lost in the loop", 1e3 * lost, 1e3 * (heat[first + 16] - heat[first]), 0.08, "nJ"),
        at_most("imbalance of energy, over the work of the sphere", 5e-3, done.energy.relative_imbalance),
    ]


@case(THEME, "Sphere that slides without friction", "Translation invariance of an even block", slow=True)
def frictionless_slide() -> list[Row]:
    """R = 2 mm, 0.3 mm deep, on a block of 12 mm in elements of 0.4 mm; the sphere slides by 2.4 mm, six
    elements, from one side of the middle of the block to the other. Above other places of an element the
    force is another one, since the radius of the contact is two elements.
    """
    across = np.arange(-2.0, 2.01, 0.4)
    mesh = block_mesh(np.arange(-6.0, 6.01, 0.4), [0.0, 0.3, 0.6, 1.2, 2.0], across, layers=[0, 1, 2, 3])
    indenter = Sphere(curvature_per_m=500.0)
    placement = place(indenter, mesh.nodes_mm[mesh.skin_nodes], np.array([-1.2, 0.0, 0.0]), np.eye(3))
    motion = Trajectory((0.0, 50.0, 100.0), (0.0, 0.3, 0.3), x_mm=(0.0, 0.0, 2.4))
    materials = (Material.neo_hooke(20.0, 0.45),) * 4
    done = press(
        Specimen(mesh, materials),
        PlacedIndenter(indenter, placement),
        motion,
        PressSettings(10, 1, SETTINGS.newton),
    )
    slides = done.times_ms >= 50.0
    force, aside = done.force_mn[slides], done.contact_force_mn[slides, 0]
    return [
        near("force after 2.4 mm", force[0], force[-1], 1e-3, "mN"),
        at_most("change of the force on the way, over the force", 0.05, np.ptp(force) / force[0]),
        at_most("change of the force aside, there and back", 1e-3, abs(aside[0] + aside[-1]) / force[0]),
        at_most("imbalance of energy", 5e-3, done.energy.relative_imbalance),
    ]
