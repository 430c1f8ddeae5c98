"""Contact between the nodes of the skin: against differences, by hand, and where nodes alone would fail."""

import numpy as np
import pytest

from fingerpad import ConvergenceError, Material, PressSettings, RampAndHold, Sphere
from fingerpad.geometry.mesh import block_mesh
from fingerpad.mechanics.assembly import Sparsity
from fingerpad.mechanics.contact import Contact, Middles, PlacedIndenter, Placement, place
from fingerpad.mechanics.press import Specimen, press
from fingerpad.mechanics.press_settings import sag_mm

SPACING_MM = 0.5
BALL = Sphere(curvature_per_m=1000.0 / 0.4)


def block(symmetric=False):
    lines = SPACING_MM * np.arange(-3, 4)
    across = SPACING_MM * np.arange(4) if symmetric else lines
    return block_mesh(lines, np.array([0.0, 0.3, 0.8, 1.6]), across, layers=[0, 0, 0], symmetric=symmetric)


def contact_of(mesh, sag_mm=0.0, at_mm=(0.0, 0.0, 0.0)):
    """A ball over the skin of a block whose nodes and middles may all touch."""
    nodes = mesh.skin_nodes
    middles = Middles.of(mesh, Sparsity.of(mesh.elements, len(mesh.nodes_mm)), nodes, sag_mm)
    placement = Placement(np.array(at_mm), np.eye(3))
    return Contact(BALL, placement, nodes, mesh.skin_area_mm2, middles=middles)


def rough(mesh, seed=1):
    """Nodes of a block moved at random, so that no facet is flat."""
    return mesh.nodes_mm + np.random.default_rng(seed).uniform(-0.05, 0.05, mesh.nodes_mm.shape)


@pytest.mark.parametrize("symmetric", [False, True], ids=["whole", "half"])
def test_each_facet_and_each_edge_has_one_middle(symmetric):
    mesh = block(symmetric)
    middles = contact_of(mesh).middles
    along, across = 6, 3 if symmetric else 6
    facets, edges = along * across, along * (across + 1) + across * (along + 1)
    assert len(middles.corners) == facets + edges
    places = mesh.nodes_mm[middles.corners].mean(axis=1)
    assert len(np.unique(places.round(9), axis=0)) == facets + edges
    np.testing.assert_allclose(middles.area_mm2[:facets], SPACING_MM**2, rtol=1e-12)
    # Each facet gives half of its area to each of its edges; those of the border have one facet.
    np.testing.assert_allclose(middles.area_mm2[facets:].sum(), 2 * facets * SPACING_MM**2, rtol=1e-12)


def test_middles_lie_between_chosen_nodes_only_and_a_triangle_has_three_edges():
    mesh = block()
    under = mesh.skin_nodes[np.linalg.norm(mesh.nodes_mm[mesh.skin_nodes], axis=1) < 0.8]
    middles = Middles.of(mesh, Sparsity.of(mesh.elements, len(mesh.nodes_mm)), under, 0.0)
    assert under.size == 9
    assert len(middles.corners) == 4 + 12
    assert np.isin(middles.corners, under).all()
    faces = mesh.skin_faces.copy()
    faces[:, 3] = faces[:, 2]
    mesh.__dict__["skin_faces"] = faces[:1]
    assert len(contact_of(mesh).middles.corners) == 1 + 3


def test_forces_on_nodes_are_the_slope_of_the_potential_and_the_tangent_that_of_the_forces():
    mesh = block()
    contact, depth_mm = contact_of(mesh, sag_mm=0.02, at_mm=(0.23, 0.0, 0.21)), 0.3
    nodes_mm, sparsity = rough(mesh), Sparsity.of(mesh.elements, len(mesh.nodes_mm))
    multipliers = np.random.default_rng(2).uniform(0.0, 3.0, contact.stiffness.size)

    def state(nodes_mm):
        return contact.state(contact.points_mm(nodes_mm), depth_mm, multipliers)

    def forces(nodes_mm):
        force = np.zeros_like(nodes_mm)
        contact.add_to_nodes(force, state(nodes_mm).force_mn)
        return force

    here = state(nodes_mm)
    assert (here.pressed_mn[mesh.skin_nodes.size :] > 0.0).sum() >= 3
    stiffness = here.stiffness + contact.curvature_stiffness(here, contact.points_mm(nodes_mm), depth_mm)
    blocks = np.zeros((sparsity.column.size, 3, 3))
    contact.add_to_tangent(blocks, sparsity.diagonal, stiffness)
    tangent = sparsity.matrix(blocks).toarray()
    step = 1e-6
    for node in mesh.skin_nodes[::3]:
        for axis in range(3):
            ahead, behind = nodes_mm.copy(), nodes_mm.copy()
            ahead[node, axis] += step
            behind[node, axis] -= step
            slope = (state(ahead).potential - state(behind).potential) / (2 * step)
            np.testing.assert_allclose(forces(nodes_mm)[node, axis], -slope, rtol=1e-6, atol=1e-4)
            change = (forces(ahead) - forces(behind)).ravel() / (2 * step)
            column = tangent[:, 3 * node + axis]
            np.testing.assert_allclose(column, -change, rtol=0, atol=1e-4 * np.abs(tangent).max())


@pytest.mark.parametrize("friction", [0.0, 0.5])
def test_facets_do_not_cut_through_a_small_ball(friction):
    """Its tip is above the middle of an edge, from which skin without friction slides away."""
    lines, size_mm = 0.2 * np.arange(-6, 7), 0.2
    mesh = block_mesh(lines, [0.0, 0.2, 0.5, 1.0, 2.0], lines[6:], layers=[0, 0, 0, 0], symmetric=True)
    tissue, tip_mm = (Material.neo_hooke(20.0, 0.45),), np.array([0.5 * size_mm, 0.0, 0.0])
    placement = place(BALL, mesh.nodes_mm[mesh.skin_nodes], tip_mm, np.eye(3))
    motion, steps = RampAndHold(0.7, ramp_ms=50.0, hold_ms=50.0), PressSettings(ramp_steps=7, hold_steps=1)

    def pressed(finest_mm):
        return press(
            Specimen(mesh, tissue),
            PlacedIndenter(BALL, placement, friction=friction, finest_mm=finest_mm),
            motion,
            steps,
        )

    def sunk_mm(done):
        skin_mm = (mesh.nodes_mm + done.displacement_mm[-1])[contact_of(mesh).middles.corners].mean(axis=1)
        return -BALL.gap(placement.to_local(skin_mm, done.depth_mm[-1]))[0].min()

    allowed_mm = sag_mm(BALL, size_mm)
    if friction > 0.0:
        assert sunk_mm(pressed(np.inf)) > 1.5 * allowed_mm
    else:
        with pytest.raises(ConvergenceError, match="The press stopped at"):
            pressed(np.inf)
    done = pressed(size_mm)
    assert sunk_mm(done) < allowed_mm + 0.005
    assert (np.diff(done.force_mn[:-1]) > 0.0).all()
    assert done.energy.relative_imbalance < 0.005
    # The pressures at nodes hold the forces of the middles too.
    area_mm2 = mesh.skin_area_of(mesh.nodes_mm + done.displacement_mm[-1])
    assert 2.0 * (done.contact.pressure_kpa[-1] * area_mm2).sum() > done.force_mn[-1]
