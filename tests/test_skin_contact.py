"""Pressure on the skin and area of contact: known fields, no steps in time, partly covered faces."""

import numpy as np
import pytest

from fingerpad import Material, PressSettings, RampAndHold, Sphere
from fingerpad.geometry.mesh import block_mesh
from fingerpad.mechanics.contact import PlacedIndenter, place
from fingerpad.mechanics.fields import skin_contact
from fingerpad.mechanics.press import Specimen, press

E_STAR_KPA = 100.0


def flat(symmetric):
    """Skin of 2 mm by 2 mm, or the half z >= 0 of 2 mm by 4 mm."""
    return block_mesh([0.0, 1.0, 2.0], [0.0, 1.0], [0.0, 1.0, 2.0], layers=[2], symmetric=symmetric)


def unmoved(mesh, pressed_mn, gap_mm):
    """Contact at one time, in which nothing has moved."""
    still = np.zeros((1, *mesh.nodes_mm.shape))
    return without_friction(mesh, still, np.array([pressed_mn]), np.array([gap_mm]))


def without_friction(mesh, displacement_mm, pressed_mn, gap_mm):
    """Contact of skin on which nothing rubs."""
    no_force, no_slip = np.zeros((*pressed_mn.shape, 3)), np.zeros_like(pressed_mn)
    return skin_contact(mesh, displacement_mm, pressed_mn, no_force, no_slip, gap_mm, E_STAR_KPA)


def test_pressure_and_area_of_a_stretched_skin():
    """Skin stretched by 1.5 along x: present areas are 1.5 times as large, and pressure as much smaller."""
    mesh = flat(symmetric=True)
    stretched = np.zeros((2, *mesh.nodes_mm.shape))
    stretched[1, :, 0] = 0.5 * mesh.nodes_mm[:, 0]
    forces = np.zeros((2, mesh.skin_nodes.size))
    skin = mesh.nodes_mm[mesh.skin_nodes]
    middle = np.flatnonzero((skin == [1.0, 0.0, 1.0]).all(axis=1))[0]
    forces[1, middle] = 6.0
    gap = np.full(forces.shape, np.inf)
    found = without_friction(mesh, stretched, forces, gap)
    assert not found.pressure_kpa[0].any()
    assert not found.shear_kpa.any()
    np.testing.assert_allclose(found.pressure_kpa[1].sum(), 6.0 / 1.5, rtol=1e-12)  # 1 mm² belongs to it
    # No node beside can be touched: triangles with one corner pressed are covered to a quarter, six of the
    # twelve halves of triangles about the node; both halves of the body.
    np.testing.assert_allclose(found.area_mm2, [0.0, 2 * 6 * 0.5 * 0.25], rtol=1e-12)
    np.testing.assert_allclose(found.present_area_mm2, 1.5 * found.area_mm2, rtol=1e-12)


def test_area_is_whole_without_an_edge_nothing_without_pressure_and_half_of_the_way_beside_a_wire():
    mesh = flat(symmetric=False)
    everywhere = np.ones(mesh.skin_nodes.size)
    np.testing.assert_allclose(unmoved(mesh, everywhere, 0.0 * everywhere).area_mm2, 4.0, rtol=1e-12)
    assert unmoved(mesh, 0.0 * everywhere, 0.0 * everywhere).area_mm2 == 0.0
    # A row of nodes under a wire: half of the way to either side, whatever the pressure.
    row = mesh.nodes_mm[mesh.skin_nodes][:, 0] == 1.0
    found = unmoved(mesh, np.where(row, 3.0, 0.0), np.where(row, 0.0, np.inf))
    np.testing.assert_allclose(found.area_mm2, 2.0, rtol=1e-12)


def test_node_comes_into_contact_and_leaves_it_without_a_step():
    """With its pressure near 0 a node adds nothing; with the gaps beside it near 0 all that surrounds it.

    Of each of its faces that is all of one cut, and half of the other, whose second half has no such corner.
    """
    mesh = flat(symmetric=False)
    middle = np.arange(mesh.skin_nodes.size) == 4
    for pressed_mn, gap_mm, expected_mm2 in ((1e-9, 0.1, 0.0), (1.0, 1e-12, 3.0)):
        area = unmoved(mesh, np.where(middle, pressed_mn, 0.0), np.where(middle, 0.0, gap_mm)).area_mm2[0]
        assert area == pytest.approx(expected_mm2, abs=1e-3)


def test_pressure_and_gap_of_hertz_have_the_area_of_hertz():
    """Pressure and gap of a sphere on a half-space, given at nodes: pi a² for any radius a."""
    lines = np.linspace(-1.5, 1.5, 16)
    mesh = block_mesh(lines, [0.0, 1.0], lines, layers=[2])
    distance = np.hypot(*mesh.nodes_mm[mesh.skin_nodes][:, [0, 2]].T)
    sphere_mm = 50.0
    for radius_mm in np.linspace(0.5, 1.2, 36):
        r = distance / radius_mm
        pressure = 2 * E_STAR_KPA * radius_mm / (np.pi * sphere_mm) * np.sqrt(np.maximum(1 - r**2, 0.0))
        out = np.maximum(r, 1.0)
        lifted = ((2 - out**2) * np.arcsin(1 / out) + np.sqrt(out**2 - 1)) / np.pi
        gap = radius_mm**2 / sphere_mm * (0.5 * out**2 - 1 + lifted)
        area = unmoved(mesh, pressure * mesh.skin_area_mm2, gap).area_mm2[0]
        assert area == pytest.approx(np.pi * radius_mm**2, rel=0.03)


def test_area_grows_without_steps_while_a_ball_is_pressed_and_stays_nearly_the_same_in_the_hold():
    """Forty steps on elements of 0.3 mm: no step of the area is zero or many times as long as the others."""
    lines = np.concatenate([np.arange(0.0, 1.6, 0.3), [2.1, 3.0]])
    both, depth = np.concatenate([-lines[:0:-1], lines]), np.array([0.0, 0.3, 0.6, 1.2, 2.0, 3.0])
    mesh = block_mesh(both, depth, lines, layers=[0, 1, 2, 3, 3], symmetric=True)
    tissue = (Material.neo_hooke(20.0, 0.45),) * 4
    ball = Sphere(curvature_per_m=500.0)
    placement = place(ball, mesh.nodes_mm[mesh.skin_nodes], np.zeros(3), np.eye(3))
    done = press(
        Specimen(mesh, tissue),
        PlacedIndenter(ball, placement),
        RampAndHold(0.4, 50.0, 500.0),
        PressSettings(40, 2),
    )
    grown = np.diff(done.contact.area_mm2[5:41])
    assert grown.min() > 0.2 * grown.mean()
    assert grown.max() < 2.0 * grown.mean()
    np.testing.assert_allclose(done.contact.area_mm2[41:], done.contact.area_mm2[40], rtol=1e-3)
    # Nodes that are pressed come in steps.
    nodes = np.diff((done.contact.pressure_kpa[5:41] > 0.0) @ mesh.skin_area_mm2)
    assert (nodes == 0.0).any()
