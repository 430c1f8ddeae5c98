"""Coulomb friction: the law of one node by hand, then whole presses against closed forms and limits."""

from dataclasses import replace

import numpy as np
import pytest

from fingerpad.core.errors import InputError
from fingerpad.geometry.bodies import Bar, Cylinder, FlatPunch, Line, Plate, Sphere
from fingerpad.geometry.fingertip import Fingertip
from fingerpad.geometry.indenters import Indenter
from fingerpad.geometry.mesh import block_mesh
from fingerpad.geometry.motion import ForceRampAndHold, RampAndHold, Trajectory
from fingerpad.mechanics import moments
from fingerpad.mechanics import press as press_module
from fingerpad.mechanics.contact import Contact, Placement
from fingerpad.mechanics.friction import Anchors, Approach, dragged, friction, slid_mm
from fingerpad.mechanics.linear import free_degrees_of_freedom
from fingerpad.mechanics.materials import Material
from fingerpad.mechanics.newton import NewtonSettings
from fingerpad.mechanics.press_settings import PressSettings
from fingerpad.skin.indentation import touch_of
from fingerpad.skin.store import touch_key
from presses import ELASTIC, RELAXING, block, press_into

FIVE = [Cylinder(3.0), Bar(2.0, 0.3), Sphere(curvature_per_m=500.0), FlatPunch(2.0, 0.3), Plate()]
MOTION = RampAndHold(depth_mm=0.2, ramp_ms=50.0, hold_ms=500.0)
STEPS = PressSettings(3, 2)


def names(body):
    return type(body).__name__


def at_rest(nodes):
    """No contact yet with nodes at their places in the frame of an indenter at the origin."""
    return Anchors.none_held(Approach.at_rest(nodes, nodes, tip_mm=np.zeros(3)))


def some_anchors(n=30, seed=0):
    """Nodes around their anchors: some stick, some slip, one has no limit."""
    generator = np.random.default_rng(seed)
    normal = generator.normal(size=(n, 3))
    normal /= np.linalg.norm(normal, axis=1)[:, None]
    anchor = generator.normal(size=(n, 3))
    limit = np.append(generator.uniform(0.5, 2.0, n - 1), 0.0)
    anchors = replace(at_rest(anchor), normal=normal, limit_mn=limit)
    return anchors, anchor + generator.uniform(-0.01, 0.01, (n, 3)), generator.uniform(100.0, 300.0, n)


def test_force_is_the_slope_of_the_potential_and_stays_within_the_limit():
    anchors, local, stiffness = some_anchors()
    found = friction(anchors, local, stiffness)
    step = 1e-7
    slope = np.empty_like(local)
    for index in np.ndindex(local.shape):
        offset = np.zeros_like(local)
        offset[index] = step
        ahead, behind = (friction(anchors, local + sign * offset, stiffness) for sign in (1, -1))
        slope[index] = (ahead.potential - behind.potential) / (2 * step)
    np.testing.assert_allclose(found.force_mn, -slope, rtol=0, atol=1e-6)
    size = np.linalg.norm(found.force_mn, axis=1)
    assert (size <= anchors.limit_mn * (1 + 1e-14)).all()
    slipped = np.linalg.norm(found.slip_mm, axis=1)
    sticks = stiffness * slipped < anchors.limit_mn
    assert 5 < sticks.sum() < 25
    np.testing.assert_allclose(size[sticks], (stiffness * slipped)[sticks], rtol=1e-12)
    np.testing.assert_allclose(size[~sticks], anchors.limit_mn[~sticks], rtol=1e-12)
    np.testing.assert_allclose((found.force_mn * anchors.normal).sum(axis=1), 0.0, atol=1e-15)


def test_tangent_is_exact_where_the_pull_is_that_of_the_law():
    anchors, local, stiffness = some_anchors()
    anchors = replace(anchors, pull_mn=-friction(anchors, local, stiffness).force_mn)
    tangent = friction(anchors, local, stiffness).stiffness
    step = 1e-7
    for axis, offset in enumerate(step * np.eye(3)):
        ahead, behind = (friction(anchors, local + sign * offset, stiffness).force_mn for sign in (1, -1))
        slope = (ahead - behind) / (2 * step)
        np.testing.assert_allclose(tangent[:, :, axis], -slope, rtol=0, atol=1e-5 * np.abs(tangent).max())


def test_tangent_of_any_pull_is_symmetric_and_never_indefinite():
    anchors, local, stiffness = some_anchors()
    generator = np.random.default_rng(1)
    for _ in range(5):
        anchors = replace(anchors, pull_mn=generator.normal(size=local.shape))
        found = friction(anchors, local, stiffness)
        further = local + generator.normal(scale=0.01, size=local.shape)
        for state in (found, friction(anchors, further, stiffness, found)):
            tangent = state.stiffness
            np.testing.assert_allclose(tangent, tangent.transpose(0, 2, 1), atol=1e-12 * tangent.max())
            assert np.linalg.eigvalsh(tangent).min() > -1e-12 * tangent.max()
            assert (np.linalg.norm(state.pull_mn, axis=1) <= anchors.limit_mn * (1 + 1e-12)).all()


def test_node_dragged_to_and_fro_follows_the_loop_of_stick_and_slip():
    """Spring k = 100 mN/mm with a slider at L = 1 mN, in series, driven along x: the closed loop by hand."""
    up, zero = np.array([[0.0, 1.0, 0.0]]), np.zeros((1, 3))
    anchors = replace(at_rest(zero), normal=up, limit_mn=np.array([1.0]))
    stiffness, touching = np.array([100.0]), np.array([True])
    forces, heat_uj = [], 0.0
    for x in (0.005, 0.01, 0.05, 0.045, 0.03, 0.025, -0.2, -0.19, -0.17):
        local = np.array([[x, 0.0, 0.0]])
        forces.append(friction(anchors, local, stiffness).force_mn[0, 0])
        after = dragged(anchors, local, stiffness, touching)
        heat_uj += float(anchors.limit_mn @ slid_mm(anchors, after, up))
        anchors = after
    np.testing.assert_allclose(forces, [-0.5, -1, -1, -0.5, 1, 1, 1, 0, -1], atol=1e-12)
    # Heat is the limit times the way of the slider: from 0 to 0.04, to -0.19 and to -0.18 mm.
    np.testing.assert_allclose(heat_uj, 0.04 + 0.23 + 0.01, rtol=1e-9)
    assert anchors.held.all()
    free = dragged(anchors, local, stiffness, ~touching)
    assert not friction(free, local + 0.1, stiffness).force_mn.any()


def test_node_is_anchored_where_it_met_the_indenter():
    """A ball of 2 mm radius comes down on three nodes: touched at once, touched half way, not reached."""
    ball = Sphere(curvature_per_m=500.0)
    x = np.array([0.0, 0.4, 1.2])
    rise = 2.0 - np.sqrt(4.0 - x**2)  # how far the ball must advance to reach a node at y = 0
    nodes = np.column_stack([x, np.zeros(3), np.zeros(3)])
    contact = Contact(ball, Placement(np.zeros(3), np.eye(3)), np.arange(3), np.ones(3), friction=0.5)
    depth = 0.08
    assert rise[1] < depth < rise[2]
    moved = nodes + np.array([0.0, 0.02, 0.0])
    state = contact.state(moved, depth, np.zeros(3))
    anchors = contact.renewed(contact.free_anchors(nodes), state, depth)
    np.testing.assert_allclose(anchors.anchor_mm[0], nodes[0], atol=1e-15)
    # The gap is not linear in depth, hence 1 % of the way.
    np.testing.assert_allclose(anchors.anchor_mm[1], [0.4, -rise[1], 0.0], atol=0.01 * depth)
    np.testing.assert_allclose(anchors.anchor_mm[2], nodes[2] - [0.0, depth, 0.0], atol=1e-15)
    np.testing.assert_allclose(anchors.limit_mn, 0.5 * state.pressed_mn, rtol=1e-14)


def pressed(mesh, indenter, coefficient, materials=RELAXING, stimulus=MOTION, settings=STEPS):
    return press_into(mesh, materials, indenter, stimulus, settings, friction=coefficient)


@pytest.fixture
def contacts(monkeypatch):
    """Contact of every step of the presses that follow."""
    found = []

    def spied(*arguments):
        equilibrium = find(*arguments)
        found.append(equilibrium.contact)
        return equilibrium

    find = moments.find_equilibrium
    monkeypatch.setattr(moments, "find_equilibrium", spied)
    return found


@pytest.mark.parametrize("indenter", FIVE, ids=names)
def test_friction_stays_within_its_cone_in_every_step_and_the_supports_take_it(indenter, contacts):
    coefficient = 0.1
    done = pressed(block(), indenter, coefficient)
    assert len(contacts) == 5
    for contact in contacts:
        rubbing = np.linalg.norm(contact.friction_mn, axis=1)
        assert (rubbing <= coefficient * contact.pressed_mn * (1 + 1e-9)).all()
        assert rubbing.max() > 0.3 * coefficient * contact.pressed_mn[rubbing.argmax()]
    assert done.force_imbalance <= 1e-4
    assert done.penetration_mm <= 0.005 * MOTION.depth_mm
    # Skin spreads below the indenter, and friction holds it back.
    assert (done.force_mn[1:] > 0.999 * pressed(block(), indenter, 0.0).force_mn[1:]).all()


def test_no_friction_is_the_frictionless_press_to_the_last_bit(contacts):
    without = press_into(block(), RELAXING, FIVE[0], MOTION, STEPS)
    with_zero = pressed(block(), FIVE[0], 0.0)
    np.testing.assert_array_equal(with_zero.displacement_mm, without.displacement_mm)
    np.testing.assert_array_equal(with_zero.force_mn, without.force_mn)
    assert all(contact.friction is None and not contact.friction_mn.any() for contact in contacts)


def test_rough_plate_is_a_glued_plate(monkeypatch):
    """Much friction against skin whose nodes cannot move along x and z at all."""
    tight = replace(STEPS, newton=NewtonSettings(1e-6, 5e-4))
    rough = pressed(block(), Plate(), 1e3, settings=tight)

    def glued(n_nodes, fixed, symmetry, gripped):
        free = free_degrees_of_freedom(n_nodes, fixed, symmetry, gripped)
        held = 3 * np.setdiff1d(block().skin_nodes, fixed)
        return np.setdiff1d(free, np.concatenate([held, held + 2]))

    monkeypatch.setattr(press_module, "free_degrees_of_freedom", glued)
    fast = pressed(block(), Plate(), 0.0, settings=tight)
    np.testing.assert_allclose(rough.force_mn[1:], fast.force_mn[1:], rtol=5e-3)
    scale = fast.sed_kpa[-1].max()
    np.testing.assert_allclose(rough.sed_kpa[-1], fast.sed_kpa[-1], rtol=0, atol=0.01 * scale)


def punch_force(poisson, coefficient):
    """Force of a sharp punch of radius 1 mm at 1 µm, on a block 8 radii deep; its rim between two nodes."""
    size = 1.0 / 4.5
    side = [size * n for n in range(6)]
    while side[-1] < 8.0:
        size *= 1.5
        side.append(side[-1] + size)
    side = np.array(side)
    both = np.concatenate([-side[:0:-1], side])
    mesh = block_mesh(both, side, side, layers=[2] * (side.size - 1), symmetric=True)
    materials = (Material.linear_elastic(100.0, poisson),) * 4
    settings = PressSettings(1, 1, NewtonSettings(penetration_tolerance=1e-3))
    done = pressed(mesh, FlatPunch(2.0, 0.0), coefficient, materials, RampAndHold(1e-3, 1.0, 1.0), settings)
    return done.force_mn[-1]


@pytest.mark.parametrize("poisson", [0.05, 0.49])
def test_punch_that_sticks_needs_more_force_as_known(poisson):
    """Complete adhesion over none: (1 - nu) ln(3 - 4 nu) / (1 - 2 nu) (Mossakovskii 1954, Spence 1968)."""
    known = (1 - poisson) * np.log(3 - 4 * poisson) / (1 - 2 * poisson)
    measured = punch_force(poisson, 1e3) / punch_force(poisson, 0.0)
    np.testing.assert_allclose(measured, known, rtol=2.5e-3)


class Wedge(Indenter):
    """A face inclined against the direction of pressing."""

    slope = 0.6  # rise over run
    normal = np.array([slope, 1.0, 0.0]) / np.hypot(slope, 1.0)

    def front(self, points_mm):
        return -self.slope * points_mm[:, 0]

    def gap(self, points_mm):
        return points_mm @ self.normal, np.tile(self.normal, (len(points_mm), 1))


def test_skin_sticks_to_an_inclined_face_or_slides_along_it(contacts):
    """Pressed straight down it goes straight down while it sticks; it slides with |f_t| = mu f_n."""
    mesh = block_mesh([-0.5, 0.5], [0.0, 1.0, 2.0], [0.0, 0.5], layers=[0, 0], symmetric=True)
    needed = None
    for coefficient in (1.5, 0.3, 0.1):
        done = pressed(mesh, Wedge(), coefficient, ELASTIC, RampAndHold(0.1, 1.0, 1.0))
        touching = contacts[-1].pressed_mn > 0
        normal = contacts[-1].pressed_mn[touching]
        ratio = np.linalg.norm(contacts[-1].friction_mn[touching], axis=1) / normal
        sideways = np.abs(done.displacement_mm[-1, mesh.skin_nodes[touching], 0])
        if needed is None:
            needed = ratio
            assert (needed > 0.15).all()
            assert (needed < 0.29).all()
        if coefficient > needed.max():
            np.testing.assert_allclose(ratio, needed, rtol=1e-3)
            assert (sideways < 1e-3).all()
        else:
            np.testing.assert_allclose(ratio, coefficient, rtol=1e-6)
            assert (sideways > 5e-3).all()


def test_work_of_a_bar_that_slides_over_skin_is_rubbed_away():
    """Nodes pass its edges of 0.2 mm in steps of 0.03 mm; with chords for arcs 0.5 % would be missing."""
    lines = np.concatenate([[-4.0, -3.0, -2.2], np.arange(-1.5, 2.5, 0.15), [3.2, 4.0, 5.0]])
    depth = np.array([0.0, 0.15, 0.3, 0.6, 1.2, 2.0])
    mesh = block_mesh(lines, depth, [0.0, 0.5], layers=[0, 1, 2, 3, 3], symmetric=True)
    slide = Trajectory((0.0, 50.0, 100.0), depth_mm=(0.0, 0.3, 0.3), x_mm=(0.0, 0.0, 1.0))
    energy = pressed(mesh, Bar(2.0, 0.2), 0.5, ELASTIC, slide, PressSettings(6, 1)).energy
    assert energy.dissipated_uj[-1] > 0.5 * energy.external_uj[-1]
    assert energy.relative_imbalance < 1.5e-3


def test_half_a_block_rubs_as_the_whole():
    half, whole = (pressed(block(symmetric), FIVE[0], 0.3) for symmetric in (True, False))
    np.testing.assert_allclose(half.force_mn, whole.force_mn, rtol=2e-4)


def test_force_that_a_depth_needs_gives_that_depth_back_with_friction():
    tight = PressSettings(2, 1, NewtonSettings(1e-6, 2e-4))
    by_depth = pressed(block(), FIVE[2], 0.3, ELASTIC, settings=tight)
    motion = ForceRampAndHold(by_depth.force_mn[-1], 50.0, 500.0)
    by_force = pressed(block(), FIVE[2], 0.3, ELASTIC, motion, tight)
    # The ways there differ: half the force is not half the depth, and friction remembers.
    np.testing.assert_allclose(by_force.depth_mm[-1], 0.2, rtol=5e-3)


def test_impossible_friction_is_refused_and_another_friction_is_another_touch():
    for coefficient in (-0.1, np.nan, np.inf, "rough", True):
        with pytest.raises(InputError, match=r"friction must .*\.$"):
            touch_of(Fingertip(), Sphere(), friction=coefficient)
    for call in (lambda: touch_of(Fingertip(), Line(), friction=0.3), lambda: pressed(block(), Line(), 0.3)):
        with pytest.raises(InputError, match="friction must be 0 for Line"):
            call()
    smooth, rough = (touch_of(Fingertip(), Sphere(), friction=coefficient) for coefficient in (0.0, 0.3))
    assert touch_key(smooth) != touch_key(rough)
