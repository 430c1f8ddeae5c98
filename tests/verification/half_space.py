"""Contact with a half-space: Hertz, Boussinesq and Flamant by whole presses of the product.

Blocks are at least a hundred times as large as the contact, elements grow towards their far sides, and
indentations are so shallow that strains stay below about 2 %.
"""

from __future__ import annotations

from dataclasses import dataclass, replace
from functools import lru_cache

import numpy as np
from scipy.integrate import quad
from scipy.optimize import brentq

from fingerpad.geometry.bodies import Cylinder, FlatPunch, Line, Plate, Sphere
from fingerpad.geometry.indenters import Indenter
from fingerpad.geometry.mesh import Mesh, block_mesh
from fingerpad.geometry.motion import ForceRampAndHold, RampAndHold
from fingerpad.mechanics.configuration import Body, Load
from fingerpad.mechanics.contact import Contact, PlacedIndenter, place
from fingerpad.mechanics.fields import SkinContact, cauchy_stress, skin_contact
from fingerpad.mechanics.linear import LinearSolver, choose_preconditioner, free_degrees_of_freedom
from fingerpad.mechanics.materials import Material
from fingerpad.mechanics.newton import NewtonSettings, find_equilibrium
from fingerpad.mechanics.press import Specimen, press
from fingerpad.mechanics.press_settings import PressSettings
from fingerpad.mechanics.viscoelastic import (
    StepCoefficients,
    StressHistory,
    instantaneous_state,
    stored_energy_density,
)

from .case import Row, case, near
from .solid import Solid

THEME = "Contact with a half-space"
YOUNG_KPA = 100.0
TIGHT = NewtonSettings(residual_tolerance=1e-6, penetration_tolerance=1e-3)


def lines(fine, until, far, ratio):
    """Equal steps `fine` to `until`, then growing by `ratio` to at least `far`."""
    edges = list(np.linspace(0.0, until, round(until / fine) + 1))
    while edges[-1] < far:
        edges.append(edges[-1] + ratio * (edges[-1] - edges[-2]))
    return np.array(edges)


def round_mesh(radii, depths, sectors) -> Mesh:
    """Half of a round block, z >= 0, wedges about its axis and bricks around them."""
    n = len(radii) - 1
    mesh = block_mesh(np.arange(n + 1.0), depths, np.arange(sectors + 1.0), layers=[2] * (len(depths) - 1))
    step, y, z = mesh.nodes_mm.T
    radius, angle = radii[step.astype(int)], np.pi * z / sectors
    side = np.where((z == 0) | (z == sectors), 0.0, radius * np.sin(angle))
    placed = np.stack([radius * np.cos(angle), y, side], axis=1)
    first_sector = np.flatnonzero(z == 0)
    column = np.searchsorted(depths, y)
    axis = first_sector[step[first_sector] == 0]
    axis = axis[np.argsort(y[axis])]
    same = np.where(step == 0, axis[column], np.arange(len(step)))
    used, number = np.unique(same, return_inverse=True)
    nodes = placed[used]
    return replace(
        mesh,
        nodes_mm=nodes,
        full=False,
        elements=number[mesh.elements],
        skin_grid=number[mesh.skin_grid],
        bone_nodes=np.unique(number[mesh.bone_nodes]),
        symmetry_nodes=np.flatnonzero(nodes[:, 2] == 0.0),
        midline_nodes=number[mesh.midline_nodes],
    )


def plane_mesh(sides, depths) -> Mesh:
    """A slice of 1 mm, one brick thick."""
    both = np.concatenate([-sides[:0:-1], sides])
    return block_mesh(both, depths, [0.0, 1.0], layers=[2] * (len(depths) - 1))


@dataclass(frozen=True)
class Pressed:
    """The end of a press of a uniform block; the force is that on the solved half, or on the slice."""

    solid: Solid
    displacement_mm: np.ndarray
    depth_mm: float
    force_mn: float
    sed_kpa: np.ndarray
    stress_kpa: np.ndarray
    contact: SkinContact

    @property
    def pressure_kpa(self):
        """Pressure on skin nodes."""
        return self.contact.pressure_kpa[-1]

    @property
    def area_mm2(self):
        """Area of contact, of the whole body where half of it is solved."""
        return self.contact.area_mm2[-1]

    @property
    def nodal_force_mn(self):
        """Force of the indenter on each skin node along y, from the internal forces."""
        return self.solid.evaluate(self.displacement_mm)[1][self.solid.mesh.skin_nodes, 1]

    @property
    def skin_mm(self):
        """Undeformed skin nodes."""
        return self.solid.mesh.nodes_mm[self.solid.mesh.skin_nodes]

    def sed_below(self, depth_mm):
        """SED on the axis at a depth. [kPa]"""
        return self._below(depth_mm, self.sed_kpa)

    def stress_below(self, depth_mm):
        """Vertical stress on the axis at a depth. [kPa]"""
        return -self._below(depth_mm, -self.stress_kpa[:, 1])

    def _below(self, depth_mm, field):
        """A positive field of the elements that touch the axis, at a depth between their centres."""
        mesh = self.solid.mesh
        corners = mesh.nodes_mm[mesh.elements]
        beside = np.abs(corners[:, :, 0]).min(axis=1) + np.abs(corners[:, :, 2]).min(axis=1)
        under = np.flatnonzero(beside < 1e-9)
        centre = corners[under, :, 1].mean(axis=1)
        levels = np.unique(centre.round(9))
        mean = [field[under[np.isclose(centre, level)]].mean() for level in levels]
        return np.exp(np.interp(np.log(depth_mm), np.log(levels), np.log(mean)))


def pressed(mesh, indenter, depth_mm, poisson, force_mn=None) -> Pressed:
    """Press a uniform block to a depth, or by a force on the whole of it."""
    material = Material.linear_elastic(YOUNG_KPA, poisson)
    placement = place(indenter, mesh.nodes_mm[mesh.skin_nodes], np.zeros(3), np.eye(3))
    motion = RampAndHold(depth_mm, 1.0, 1.0) if force_mn is None else ForceRampAndHold(force_mn, 1.0, 1.0)
    done = press(
        Specimen(mesh, (material,) * 4),
        PlacedIndenter(indenter, placement),
        motion,
        PressSettings(1, 1, TIGHT),
    )
    return Pressed(
        solid=Solid(mesh, (material,) * 4),
        displacement_mm=done.displacement_mm[-1],
        depth_mm=done.depth_mm[-1],
        force_mn=done.force_mn[-1] / 2,
        sed_kpa=done.sed_kpa[-1],
        stress_kpa=done.stress_kpa,
        contact=done.contact,
    )


def pressed_slice(mesh, indenter, depth_mm, poisson) -> Pressed:
    """Press a uniform slice in plane strain, which a press cannot hold: no node moves along z.

    The product's contact, Newton's method and linear solver do the work.
    """
    material = Material.linear_elastic(YOUNG_KPA, poisson)
    solid = Solid(mesh, (material,) * 4)
    skin = mesh.nodes_mm[mesh.skin_nodes]
    placement = place(indenter, skin, np.zeros(3), np.eye(3))
    chosen = indenter.may_touch(placement.to_local(skin, 0.0))
    contact = Contact(indenter, placement, mesh.skin_nodes[chosen], mesh.skin_area_mm2[chosen])
    everywhere = np.arange(len(mesh.nodes_mm))
    gripped = contact.nodes if indenter.grips else everywhere[:0]
    free = free_degrees_of_freedom(everywhere.size, mesh.fixed_nodes, everywhere, gripped)
    approximate, _ = choose_preconditioner(solid.sparsity, free, mesh, poisson)
    solver = LinearSolver(approximate)
    step = StepCoefficients.of(solid.table, 1.0)
    history = StressHistory.unloaded(len(mesh.elements), solid.table.shares.shape[1])
    load = Load(contact, depth_mm, step, history.carried(step, mesh.layer))
    found = find_equilibrium(
        Body(mesh, solid.table, solid.sparsity, free), load, solver, np.zeros_like(mesh.nodes_mm),
        np.zeros(contact.nodes.size), TIGHT,
    )  # fmt: skip
    where = mesh, found.displacement_mm, solid.table
    now = instantaneous_state(*where)
    history = replace(history, instantaneous=now.stress_kpa)
    on_skin, gap = np.zeros((1, len(skin))), np.full((1, len(skin)), np.inf)
    on_skin[0, chosen], gap[0, chosen] = found.contact.pressed_mn, found.contact.gap_mm
    return Pressed(
        solid=solid,
        displacement_mm=found.displacement_mm,
        depth_mm=depth_mm,
        force_mn=found.contact.pressed_mn.sum(),
        sed_kpa=stored_energy_density(*where, history, now),
        stress_kpa=cauchy_stress(mesh, found.displacement_mm, solid.table, history),
        contact=skin_contact(
            mesh,
            found.displacement_mm[None],
            on_skin,
            np.zeros((1, len(skin), 3)),
            np.zeros((1, len(skin))),
            gap,
            material.contact_modulus_kpa,
        ),
    )


def reduced_modulus(poisson):
    """E* = E / (1 - nu²). [kPa]"""
    return YOUNG_KPA / (1 - poisson**2)


def energy_density(poisson, *principal_stresses):
    """Energy density of Hooke's law. [kPa]"""
    squares = sum(stress**2 for stress in principal_stresses)
    total = sum(principal_stresses)
    return ((1 + poisson) * squares - poisson * total**2) / (2 * YOUNG_KPA)


def below(name, share, peak, poisson):
    """SED on the axis of a sphere or cylinder, `share` contact radii deep, by the peak pressure. [kPa]"""
    if name == "sphere":
        down = -peak / (1 + share**2)
        across = peak * (0.5 / (1 + share**2) - (1 + poisson) * (1 - share * np.arctan(1 / share)))
        return energy_density(poisson, down, across, across)
    root = np.sqrt(1 + share**2)
    down, across = -peak / root, -peak * ((1 + 2 * share**2) / root - 2 * share)
    return energy_density(poisson, down, across, poisson * (down + across))


RADIUS_MM, CONTACT_MM = 50.0, 1.0


@lru_cache(maxsize=2)
def hertz_sphere(poisson, fine=0.125, sectors=8):
    """Sphere of 50 mm pressed until the contact radius should be 1 mm."""
    edges = lines(fine, 1.5, 100.0, 1.4)
    mesh = round_mesh(edges, edges, sectors)
    return pressed(mesh, Sphere(curvature_per_m=1000.0 / RADIUS_MM), CONTACT_MM**2 / RADIUS_MM, poisson)


def sphere_rows(poisson):
    """Force, contact radius, peak pressure, stress and SED below a sphere against Hertz and Huber."""
    done = hertz_sphere(poisson)
    force = 2 / 3 * reduced_modulus(poisson) * np.sqrt(RADIUS_MM) * (CONTACT_MM**2 / RADIUS_MM) ** 1.5
    forces = done.nodal_force_mn
    distance = np.hypot(done.skin_mm[:, 0], done.skin_mm[:, 2])
    radius = np.sqrt(2.5 * (forces * distance**2).sum() / forces.sum())
    peak = 3 * 2 * force / (2 * np.pi * CONTACT_MM**2)
    centre = np.flatnonzero(distance == 0.0)[0]
    rows = [
        near(f"nu = {poisson}: force of half the sphere", force, done.force_mn, 0.03, "mN"),
        near(f"nu = {poisson}: contact radius, from the second moment", CONTACT_MM, radius, 0.03, "mm"),
        near(f"nu = {poisson}: contact area, pi R d", np.pi * CONTACT_MM**2, done.area_mm2, 0.05, "mm²"),
        near(
            f"nu = {poisson}: pressure at the centre",
            peak, done.pressure_kpa[centre], 0.05, "kPa",
        ),
    ]  # fmt: skip
    for depth in (0.5, 1.0, 2.0):
        down = -peak / (1 + depth**2)
        rows.append(
            near(
                f"nu = {poisson}: vertical stress {depth} mm below",
                down,
                done.stress_below(depth),
                0.05,
                "kPa",
            )
        )
        expected = below("sphere", depth, peak, poisson)
        rows.append(
            near(f"nu = {poisson}: SED {depth} mm below", expected, done.sed_below(depth), 0.05, "kPa")
        )
    return rows


@lru_cache(maxsize=1)
def sphere_by_force():
    """The same sphere pressed by the force that Hertz expects for a contact radius of 1 mm, nu = 0.3."""
    edges = lines(0.125, 1.5, 100.0, 1.4)
    force = 4 / 3 * reduced_modulus(0.3) * CONTACT_MM**3 / RADIUS_MM
    return pressed(
        round_mesh(edges, edges, 8), Sphere(curvature_per_m=1000.0 / RADIUS_MM), None, 0.3, force_mn=force
    )


@lru_cache(maxsize=2)
def hertz_cylinder(poisson, fine=0.1):
    """Cylinder of 50 mm radius on a slice in plane strain, contact about 1 mm to either side."""
    edges = lines(fine, 1.5, 200.0, 1.3)
    return pressed_slice(plane_mesh(edges, edges), Cylinder(2 * RADIUS_MM), 0.05, poisson)


def cylinder_rows(poisson):
    """Contact width, peak pressure, stress and SED below a cylinder, all from the force that was found."""
    done = hertz_cylinder(poisson)
    forces, x = done.nodal_force_mn, done.skin_mm[:, 0]
    half_width = np.sqrt(4 * done.force_mn * RADIUS_MM / (np.pi * reduced_modulus(poisson)))
    peak = 2 * done.force_mn / (np.pi * half_width)
    found = 2 * np.sqrt((forces * x**2).sum() / forces.sum())
    centre = np.flatnonzero(x == 0.0)
    pressure = done.pressure_kpa[centre].mean()
    rows = [
        near(f"nu = {poisson}: half-width, from the second moment", half_width, found, 0.02, "mm"),
        near(f"nu = {poisson}: half-width, from the area", half_width, done.area_mm2 / 2, 0.05, "mm"),
        near(f"nu = {poisson}: pressure at the centre", peak, pressure, 0.03, "kPa"),
    ]
    for share in (0.5, 1.0, 2.0):
        down = -peak / np.sqrt(1 + share**2)
        got = done.stress_below(share * half_width)
        rows.append(
            near(f"nu = {poisson}: vertical stress {share} half-widths below", down, got, 0.02, "kPa")
        )
        expected = below("cylinder", share, peak, poisson)
        got = done.sed_below(share * half_width)
        rows.append(near(f"nu = {poisson}: SED {share} half-widths below", expected, got, 0.02, "kPa"))
    return rows


class SharpPunch(Indenter):
    """A flat round punch of radius 1 mm without a fillet: the skin below it goes straight down."""

    def gap(self, points_mm):
        return Plate().gap(points_mm)

    def front(self, points_mm):
        return np.where(np.hypot(points_mm[:, 0], points_mm[:, 2]) <= 1 + 1e-9, 0.0, -np.inf)

    @property
    def half_width_mm(self):
        return 1.0

    def may_touch(self, undeformed_mm):
        return np.hypot(undeformed_mm[:, 0], undeformed_mm[:, 2]) <= 1 + 1e-9


def punch_mesh(rim, even, sectors):
    """Elements of size `rim` to `even` on both sides of the rim of a punch of 1 mm, then growing."""
    inwards = lines(rim, even, 0.8, 1.4)
    inwards = inwards[inwards < 0.9]
    outwards = lines(rim, 3 * rim, 1000.0, 1.4)
    radii = np.concatenate([[0.0], 1 - inwards[::-1], 1 + outwards[1:]])
    return round_mesh(radii, outwards, sectors)


@lru_cache(maxsize=4)
def punch(fillet=0.0, rim=0.02, even=0.06, sectors=10):
    """Flat punch of radius 1 mm, 2 µm deep, nu = 0.3."""
    indenter = FlatPunch(2.0, fillet) if fillet else SharpPunch()
    return pressed(punch_mesh(rim, even, sectors), indenter, 0.002, 0.3)


def punch_rows():
    """Force, pressure and the skin beside a flat punch."""
    poisson, depth_mm = 0.3, 0.002
    done = punch()
    force = reduced_modulus(poisson) * depth_mm  # of half the punch
    distance = np.hypot(done.skin_mm[:, 0], done.skin_mm[:, 2])
    centre = np.flatnonzero(distance == 0.0)[0]
    mean = 2 * force / np.pi
    rows = [
        near("force of half the punch, E* a d", force, done.force_mn, 0.03, "mN"),
        near("pressure at the centre, F / (2 pi a²)", mean / 2,
             done.pressure_kpa[centre], 0.05, "kPa"),
    ]  # fmt: skip
    down = done.displacement_mm[done.solid.mesh.skin_nodes, 1]
    midline = np.flatnonzero(done.skin_mm[:, 2] == 0.0)
    midline = midline[np.argsort(done.skin_mm[midline, 0])]
    for far in (1.5, 2.0, 4.0):
        expected = 2 * depth_mm / np.pi * np.arcsin(1 / far)
        got = np.interp(far, done.skin_mm[midline, 0], down[midline])
        rows.append(near(f"skin {far} radii from the axis", 1e3 * expected, 1e3 * got, 0.03, "µm"))
    return rows


@lru_cache(maxsize=1)
def line_load():
    """The product's line of 50 µm on a slice in plane strain, 5 µm deep."""
    sides = lines(0.025, 0.3, 400.0, 1.2)
    return pressed_slice(plane_mesh(sides, lines(0.05, 2.0, 400.0, 1.2)), Line(), 0.005, 0.3)


SPHERE_SOURCE = "Hertz, Huber; Johnson 1985, ch. 3-4"


@case(THEME, "Sphere", SPHERE_SOURCE)
def sphere() -> list[Row]:
    """R = 50 mm, contact radius 1 mm, elements of 0.125 mm, wedges about the axis."""
    return sphere_rows(0.3)


@case(THEME, "Sphere on nearly incompressible tissue", SPHERE_SOURCE, slow=True)
def sphere_nearly_incompressible() -> list[Row]:
    """The same at nu = 0.48, as in the finger."""
    return sphere_rows(0.48)


@case(THEME, "Sphere at the limit of incompressibility", SPHERE_SOURCE, slow=True)
def sphere_at_the_limit() -> list[Row]:
    """The same at nu = 0.4999, the largest value that is supported, with the direct factor."""
    return sphere_rows(0.4999)


@case(THEME, "Sphere with prescribed force", SPHERE_SOURCE)
def sphere_force_control() -> list[Row]:
    """The first sphere, with prescribed force 4/3 E* a³ / R instead of prescribed depth."""
    done, force = sphere_by_force(), 2 / 3 * reduced_modulus(0.3) * CONTACT_MM**3 / RADIUS_MM
    return [
        near("force of half the sphere", force, done.force_mn, 1e-4, "mN"),
        near("depth, (3 F / (4 E* √R))^(2/3)", CONTACT_MM**2 / RADIUS_MM, done.depth_mm, 0.02, "mm"),
    ]


@case(THEME, "Cylinder", "Hertz, McEwen; Johnson 1985, ch. 4")
def cylinder() -> list[Row]:
    """R = 50 mm, plane strain. In two dimensions the depth depends on the size of the block, so everything is
    compared at the computed force: a² = 4 F R / (pi E*).
    """
    return cylinder_rows(0.3)


@case(THEME, "Cylinder on nearly incompressible tissue", "Hertz, McEwen; Johnson 1985, ch. 4", slow=True)
def cylinder_nearly_incompressible() -> list[Row]:
    """The same at nu = 0.48."""
    return cylinder_rows(0.48)


@case(THEME, "Flat punch", "Boussinesq 1885; Sneddon 1965: F = 2 a E* d")
def flat_punch() -> list[Row]:
    """Radius 1 mm, sharp edge, frictionless; elements of 0.02 mm at the rim, where pressure is singular."""
    return punch_rows()


def rounded_punch_force(fillet, depth_mm):
    """Force of half a flat punch of radius 1 mm with a rounded rim, after Sneddon. [mN]

    g(x) = x int_0^x f'(r) / sqrt(x² - r²) dr for the profile f; d = g(a); F = 2 E* int_0^a (d - g) dx.
    """
    flat = 1.0 - fillet

    def transform(x):
        # r = flat + (x - flat) (1 - s²) takes the singularity at r = x away.
        if x <= flat:
            return 0.0

        def integrand(s):
            rise = (x - flat) * (1 - s**2)
            slope = rise / np.sqrt(fillet**2 - rise**2)
            return slope * 2 * np.sqrt(x - flat) / np.sqrt(2 * flat + (x - flat) * (2 - s**2))

        return x * quad(integrand, 0.0, 1.0)[0]

    contact = brentq(lambda x: transform(x) - depth_mm, flat, 1.0 - 1e-9)
    missing = quad(transform, flat, contact)[0]
    return reduced_modulus(0.3) * (contact * depth_mm - missing), contact


@case(THEME, "Flat punch with a rounded rim", "Sneddon 1965, by quadrature")
def rounded_punch() -> list[Row]:
    """A fillet of 0.1 mm, depth 2 µm: contact ends on the fillet. Elements of 0.02 mm there."""
    force, radius = rounded_punch_force(0.1, 0.002)
    done = punch(fillet=0.1, even=0.12)
    return [
        near("force of half the punch", force, done.force_mn, 0.02, "mN"),
        near("contact area", np.pi * radius**2, done.area_mm2, 0.02, "mm²"),
    ]


@case(THEME, "Line load", "Flamant 1892; Johnson 1985, ch. 2")
def line() -> list[Row]:
    """The line indents a slice in plane strain. Below it the only stress in the plane is the vertical one, 2
    P / (pi y), which gives SED; P is the computed force. The strip of 50 µm under the line does not slide;
    the effect of this decreases as strip width over depth.
    """
    done = line_load()
    rows = []
    for depth in (1.0, 2.0, 4.0):
        down = -2 * done.force_mn / (np.pi * depth)
        expected = energy_density(0.3, down, 0.0, 0.3 * down)
        rows.append(near(f"SED {depth} mm below", 1e3 * expected, 1e3 * done.sed_below(depth), 0.03, "Pa"))
    return rows
