"""First touch, pressures and stiffness of contact against differences and by hand."""

import numpy as np
import pytest

import fingerpad as fp
from fingerpad.geometry.mesh import block_mesh
from fingerpad.mechanics.contact import Contact, PlacedIndenter, Placement, place
from fingerpad.mechanics.press import Specimen, press

RADIUS = 2.0
SPHERE = fp.Sphere(curvature_per_m=1000.0 / RADIUS)
BODIES = [SPHERE, fp.Cylinder(diameter_mm=3.0), fp.Bar(3.0, 0.3), fp.FlatPunch(3.0, 0.4), fp.Plate()]
NAMES = [type(body).__name__ for body in BODIES]


def tilted():
    """A frame whose columns are orthonormal and right-handed."""
    q, r = np.linalg.qr(np.random.default_rng(0).normal(size=(3, 3)))
    q = q * np.sign(np.diag(r))
    return q * np.linalg.det(q)


def rough_skin(seed=1, n=400):
    """Points of an uneven surface that faces -y."""
    generator = np.random.default_rng(seed)
    points = generator.uniform(-3.0, 3.0, (n, 3))
    points[:, 1] = 0.05 * (points[:, 0] ** 2 + points[:, 2] ** 2) + generator.uniform(0, 0.1, n)
    return points


@pytest.mark.parametrize("body", BODIES, ids=NAMES)
@pytest.mark.parametrize("rotation", [np.eye(3), tilted()], ids=["along y", "tilted"])
def test_first_touch_is_where_the_smallest_gap_is_zero(body, rotation):
    skin = rough_skin() @ rotation.T
    placement = place(body, skin, rotation @ np.array([0.2, -4.0, -0.1]), rotation)
    rounding_mm = 16 * np.spacing(13.0)  # of products with a rotation and of its own, 13 mm away
    assert abs(body.gap(placement.to_local(skin, 0.0))[0].min()) <= rounding_mm
    assert body.gap(placement.to_local(skin, 1e-6))[0].min() < 0.0
    # The axis stays where it was asked for, and the start along it does not matter.
    further = place(body, skin, rotation @ np.array([0.2, 9.0, -0.1]), rotation)
    np.testing.assert_allclose(further.origin_mm, placement.origin_mm, rtol=0, atol=rounding_mm)


def test_first_touch_of_one_node_beside_the_axis_and_of_none():
    placement = place(SPHERE, np.array([[1.2, 0.0, 0.0]]), np.array([0.0, -7.0, 0.0]), np.eye(3))
    expected = [0.0, RADIUS - np.sqrt(RADIUS**2 - 1.2**2), 0.0]
    np.testing.assert_allclose(placement.origin_mm, expected, atol=1e-14)
    for body in (SPHERE, fp.bodies.Line()):
        with pytest.raises(fp.InputError, match=r"never touches.*\.$"):
            place(body, np.array([[5.0, 0.0, 0.0]]), np.zeros(3), np.eye(3))


def tilted_contact(body, seed=2, n=12):
    """Nodes pressed a little into a tilted body, away from its kinks, with multipliers."""
    generator = np.random.default_rng(seed)
    rotation = tilted()
    local = generator.uniform([-1.6, 0, -1.6], [1.6, 0, 1.6], (n, 3))
    local[:, 1] = np.maximum(body.front(local), -0.25) - generator.uniform(0.0, 0.02, n)
    placement = Placement(np.array([0.3, -0.2, 0.1]), rotation)
    depth = 0.4
    positions = local @ rotation.T + placement.origin_mm + depth * placement.axis
    area = generator.uniform(0.05, 0.2, n)
    return Contact(body, placement, np.arange(n), area), positions, depth, generator.uniform(0.0, 5.0, n)


@pytest.mark.parametrize("body", BODIES, ids=NAMES)
def test_force_is_the_slope_of_the_potential_and_stiffness_with_curvature_that_of_the_force(body):
    contact, positions, depth, multipliers = tilted_contact(body)
    state = contact.state(positions, depth, multipliers)
    assert (np.linalg.norm(state.force_mn, axis=1) > 0).sum() >= 3
    step = 1e-6
    slope = np.empty_like(positions)
    for index in np.ndindex(positions.shape):
        offset = np.zeros_like(positions)
        offset[index] = step
        ahead = contact.state(positions + offset, depth, multipliers).potential
        behind = contact.state(positions - offset, depth, multipliers).potential
        slope[index] = (ahead - behind) / (2 * step)
    np.testing.assert_allclose(state.force_mn, -slope, rtol=0, atol=1e-6 * np.abs(slope).max())
    stiffness = state.stiffness + contact.curvature_stiffness(state, positions, depth)
    step = 1e-7
    for axis, offset in enumerate(step * np.eye(3)):
        ahead = contact.state(positions + offset, depth, multipliers).force_mn
        behind = contact.state(positions - offset, depth, multipliers).force_mn
        slope = (ahead - behind) / (2 * step)
        np.testing.assert_allclose(stiffness[:, :, axis], -slope, rtol=0, atol=1e-5 * np.abs(stiffness).max())
    np.testing.assert_allclose(stiffness, stiffness.transpose(0, 2, 1), atol=1e-12 * np.abs(stiffness).max())


def test_pressures_by_hand():
    """Under a plate: lambda = <lambda_k - epsilon A g> along y, potential lambda² / (2 epsilon A)."""
    placement = Placement(np.zeros(3), np.eye(3))
    contact = Contact(fp.Plate(), placement, np.arange(4), np.array([0.1, 0.2, 0.1, 0.1]), 1000.0)
    heights = np.array([0.49, 0.48, 0.51, 0.52])
    positions = np.stack([np.zeros(4), heights, np.zeros(4)], axis=1)
    state = contact.state(positions, 0.5, np.array([0.0, 1.0, 3.0, 1.0]))
    np.testing.assert_allclose(state.gap_mm, [-0.01, -0.02, 0.01, 0.02], atol=1e-15)
    np.testing.assert_allclose(state.force_mn[:, 1], [1.0, 5.0, 2.0, 0.0], atol=1e-12)
    np.testing.assert_array_equal(state.force_mn[:, [0, 2]], 0.0)
    np.testing.assert_allclose(state.stiffness[:, 1, 1], [100.0, 200.0, 100.0, 0.0], rtol=1e-13)
    np.testing.assert_allclose(state.potential, 1 / 200 + 25 / 400 + 4 / 200, rtol=1e-12)
    np.testing.assert_allclose(state.penetration_mm, 0.02, rtol=1e-13)
    np.testing.assert_allclose(state.misfit_mm, 0.02, rtol=1e-13)
    np.testing.assert_allclose(contact.augmented(state), [1.0, 5.0, 2.0, 0.0], atol=1e-12)


def test_pressed_node_that_hovers_is_a_misfit_and_no_penetration():
    """A far node is neither pressed nor inside."""
    contact = Contact(fp.Plate(), Placement(np.zeros(3), np.eye(3)), np.arange(2), np.full(2, 0.1), 1000.0)
    state = contact.state(np.array([[0.0, 0.53, 0.0], [0.0, 0.9, 0.0]]), 0.5, np.array([4.0, 0.0]))
    assert state.penetration_mm == 0.0
    np.testing.assert_allclose(state.misfit_mm, 0.03, rtol=1e-12)


def test_augmentation_keeps_the_force_of_a_node_that_no_longer_penetrates():
    contact, positions, depth, multipliers = tilted_contact(SPHERE)
    state = contact.state(positions, depth, multipliers)
    gap, normal = state.gap_mm, state.force_mn
    pressed = np.linalg.norm(normal, axis=1) > 0
    outward = normal[pressed] / np.linalg.norm(normal[pressed], axis=1)[:, None]
    out = positions.copy()
    out[pressed] -= gap[pressed, None] * outward  # a ball's normal does not change along itself
    after = contact.state(out, depth, contact.augmented(state))
    np.testing.assert_allclose(after.force_mn, state.force_mn, rtol=1e-9, atol=1e-9)


def test_no_contact_no_force():
    contact, positions, depth, _ = tilted_contact(fp.Plate())
    away = contact.state(positions + contact.placement.axis, depth, np.zeros(len(positions)))
    assert not away.force_mn.any()
    assert not away.stiffness.any()
    assert away.potential == 0.0
    assert away.penetration_mm == 0.0
    assert away.misfit_mm == 0.0
    assert not contact.curvature_stiffness(away, positions, depth).any()


def force_of_a_bar(size_mm, wider_mm=0.0):
    """Force of a bar of 2.4 mm, 0.6 mm deep in a block with rows of nodes at both of its edges. [mN]"""
    beside = np.cumsum(size_mm * 1.4 ** np.arange(1, 40))
    beside = 3.0 + beside[beside < 7.0]
    fine = size_mm * np.arange(-round(3.0 / size_mm), round(3.0 / size_mm) + 1)
    depths = np.cumsum(np.concatenate([[0.0], min(size_mm, 0.3) * 1.25 ** np.arange(20)]))
    depths = depths[: np.searchsorted(depths, 4.0) + 1] * (4.0 / depths[np.searchsorted(depths, 4.0)])
    along = np.concatenate([-beside[::-1], fine, beside])
    mesh = block_mesh(along, depths, [0.0, 0.5], [2] * (depths.size - 1), True)
    motion, steps = fp.RampAndHold(depth_mm=0.6, ramp_ms=50, hold_ms=10), fp.PressSettings(6, 1)
    still = Placement(np.zeros(3), np.eye(3))
    tissue = (fp.Material.neo_hooke(30.0, 0.4),) * 4
    return press(
        Specimen(mesh, tissue), PlacedIndenter(fp.Bar(2.4 + wider_mm, 0.05), still), motion, steps
    ).force_mn[-1]


def test_a_row_on_an_edge_does_not_touch_on_a_coarse_mesh_and_this_error_converges():
    """The edge belongs to the contact: with its row the force is nearer to the limit of 60.5 mN."""
    missing = np.array([force_of_a_bar(size) for size in (0.6, 0.3, 0.15)]) / 60.5 - 1.0
    np.testing.assert_allclose(missing, [-0.23, -0.08, -0.02], atol=0.01)
    touching = np.array([force_of_a_bar(size, 0.8 * size) for size in (0.6, 0.3)]) / 60.5 - 1.0
    np.testing.assert_allclose(touching, [0.06, 0.03], atol=0.01)
    assert (np.abs(touching) < np.abs(missing[:2])).all()
