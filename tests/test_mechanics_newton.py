"""Conditions that an equilibrium meets before it is returned: supports balance the force of the indenter."""

from dataclasses import replace
from functools import partial
from types import SimpleNamespace

import numpy as np
import pytest

from fingerpad.core.errors import ConvergenceError, InputError
from fingerpad.geometry.edged_indenters import Gap
from fingerpad.geometry.indenters import Bar, Cylinder, FlatPunch, Line, Plate, Sphere
from fingerpad.geometry.mesh import block_mesh
from fingerpad.geometry.motion import ForceRampAndHold, RampAndHold
from fingerpad.mechanics.contact import place
from fingerpad.mechanics.materials import Material, Prony
from fingerpad.mechanics.newton import NewtonSettings, _Search
from fingerpad.mechanics.press import SAME_DIGITS, _Press, press
from fingerpad.mechanics.press_settings import PressSettings

BALL = Sphere(curvature_per_m=500.0)
SIX = [Line(), Cylinder(3.0), Bar(2.0, 0.3), BALL, FlatPunch(2.0, 0.3), Plate()]
PRONY = Prony(shares=(0.2, 0.3), times_ms=(30.0, 400.0))
RELAXING = tuple(Material.neo_hooke(shear, 0.45, PRONY) for shear in (40.0, 40.0, 20.0, 8.0))
MOTION = RampAndHold(depth_mm=0.2, ramp_ms=50.0, hold_ms=500.0)


def block(symmetric=True):
    lines = np.array([0.0, 0.4, 0.8, 1.3, 2.0, 3.0])
    both = np.concatenate([-lines[:0:-1], lines])
    depth = np.array([0.0, 0.3, 0.6, 1.2, 2.0, 3.0])
    return block_mesh(both, depth, lines if symmetric else both, layers=[0, 1, 2, 3, 3], symmetric=symmetric)


def pressed(mesh, indenter, newton_settings, at_mm=(0.0, 0.0, 0.0), ramp_steps=3):
    placement = place(indenter, mesh.nodes_mm[mesh.skin_nodes], np.array(at_mm), np.eye(3))
    return press(mesh, RELAXING, indenter, placement, MOTION, PressSettings(ramp_steps, 3, newton_settings))


@pytest.mark.parametrize("indenter", SIX, ids=lambda body: type(body).__name__)
def test_force_balance_and_penetration_hold_while_the_skin_is_pressed_and_relaxes(indenter):
    """Within 1e-4 of the force and 0.5 % of the depth of the step, for every indenter, at every time."""
    mesh = block()
    done = pressed(mesh, indenter, NewtonSettings())
    assert done.force_imbalance <= 1e-4
    np.testing.assert_allclose(done.reaction_mn[1:, 1], done.force_mn[1:], rtol=1e-4)
    np.testing.assert_allclose(done.reaction_mn[:, 0], 0.0, atol=1e-4 * done.force_mn.max())
    assert not done.reaction_mn[:, 2].any()  # the other half takes the opposite
    # A press reads its motion to 1e-9 mm, so that a later touch has the same bits.
    prescribed = MOTION.prescribed_at(done.times_ms).round(SAME_DIGITS)
    np.testing.assert_allclose(done.depth_mm, prescribed, rtol=1e-14)
    assert (np.diff(done.force_mn[3:]) < 0).all()
    assert 0.0 < done.penetration_mm <= 0.005 * MOTION.depth_mm
    local = mesh.nodes_mm[mesh.skin_nodes] + done.displacement_mm[:, mesh.skin_nodes]
    under = indenter.may_touch(mesh.nodes_mm[mesh.skin_nodes])
    for points, depth_mm in zip(local[1:], done.depth_mm[1:], strict=True):
        gap, _ = indenter.gap(points[under] - np.array([0.0, depth_mm, 0.0]))
        assert gap.min() >= -0.005 * depth_mm


def test_balance_is_met_where_the_residual_alone_would_pass_as_solved():
    loose = NewtonSettings(residual_tolerance=0.05, balance_tolerance=1.0)
    unbalanced = pressed(block(), BALL, loose)
    assert unbalanced.force_imbalance > 1e-3
    found = pressed(block(), BALL, replace(loose, balance_tolerance=1e-4))
    assert found.force_imbalance <= 1e-4
    assert found.newton_steps > unbalanced.newton_steps
    # The number reported is that of the forces reported.
    np.testing.assert_allclose(found.reaction_mn[1:, 1], found.force_mn[1:], rtol=1e-4)
    differs = np.abs(unbalanced.reaction_mn[1:, :2] - np.outer(unbalanced.force_mn[1:], [0.0, 1.0]))
    assert unbalanced.force_imbalance >= (differs.max(axis=1) / unbalanced.force_mn[1:]).max() * (1 - 1e-9)


@pytest.mark.parametrize(
    "indenter", [Bar(1.7, 0.1), Gap(0.75, 4.0, 0.3, 0.03)], ids=lambda body: type(body).__name__
)
def test_skin_that_slides_round_an_edge_is_followed(indenter):
    """Edges much sharper than the spacing of the nodes: with their curvature the tangent is not definite."""
    done = pressed(block(), indenter, NewtonSettings())
    assert done.force_imbalance <= 1e-4
    assert 0.0 < done.penetration_mm <= 0.005 * MOTION.depth_mm
    blunt = {"fillet_mm": 0.3} if isinstance(indenter, Bar) else {"lip_mm": 0.3}
    similar = pressed(block(), replace(indenter, **blunt), NewtonSettings())
    np.testing.assert_allclose(done.force_mn[-1], similar.force_mn[-1], rtol=0.25)


def test_a_shifted_tangent_leads_to_the_same_equilibrium(monkeypatch):
    """Every indefinite tangent is shifted, and none is taken without the curvature of the body.

    At which of the last steps the skin snaps round an edge, and round which one, hangs on the last bits; the
    states before and the force at the end do not.
    """
    steps = 16
    usual = pressed(block(), Bar(1.7, 0.1), NewtonSettings(), ramp_steps=steps)
    shifted = []
    found = _Search.found
    monkeypatch.setattr("fingerpad.mechanics.newton.MOST_STRAIGHT", 0)
    monkeypatch.setattr(
        _Search, "found", lambda search, *how: shifted.append(search.was_shifted) or found(search, *how)
    )
    done = pressed(block(), Bar(1.7, 0.1), NewtonSettings(persistent=True), ramp_steps=steps)
    assert any(shifted)
    stands = done.depth_mm < 0.17
    np.testing.assert_allclose(done.force_mn[stands], usual.force_mn[stands], rtol=1e-4)
    np.testing.assert_allclose(done.force_mn[-1], usual.force_mn[-1], rtol=1e-3)
    lost_uj = done.energy.imbalance_uj
    assert np.abs(lost_uj[stands]).max() <= 5e-4 * done.energy.external_uj.max()
    assert lost_uj[-1] > 0.0  # a snap sets energy free


@pytest.mark.parametrize("ramp_steps", [3, 4, 5, 6, 8, 12])
def test_skin_that_snaps_ends_in_one_state_with_any_number_of_steps(ramp_steps):
    """The edge is sharper than the elements: near the largest depth skin slides round it at once."""
    done = pressed(block(), Bar(1.7, 0.1), NewtonSettings(persistent=True), ramp_steps=ramp_steps)
    np.testing.assert_allclose(done.force_mn[-1], 64.0, rtol=2e-3)
    assert done.energy.relative_imbalance <= 0.015  # what the snap sets free


def test_a_guess_that_folds_is_replaced_by_the_step_before(monkeypatch):
    """A guess may turn an element inside out; the search then starts where the last step ended."""
    usual = pressed(block(), BALL, NewtonSettings())
    monkeypatch.setattr(_Press, "continued", lambda job, start, target_ms: 1e9)
    folded = pressed(block(), BALL, NewtonSettings())
    np.testing.assert_allclose(folded.force_mn, usual.force_mn, rtol=1e-3)


def test_balance_holds_beside_the_middle_of_a_whole_block():
    """No symmetry helps: the reaction has three components, and they are those of the contact."""
    done = pressed(block(symmetric=False), BALL, NewtonSettings(), at_mm=(0.5, 0.0, 0.3))
    assert done.force_imbalance <= 1e-4
    np.testing.assert_allclose(done.reaction_mn[1:, 1], done.force_mn[1:], rtol=1e-4)
    sideways = np.abs(done.reaction_mn[-1, [0, 2]]) / done.force_mn[-1]
    assert (sideways > 1e-3).all()


@pytest.mark.parametrize("tolerance", [0.0, -1e-4, np.nan, "tight"])
def test_balance_tolerance_is_a_number_above_zero(tolerance):
    with pytest.raises(InputError, match="balance_tolerance must be"):
        NewtonSettings(balance_tolerance=tolerance)


def test_a_search_about_a_small_body_may_take_more_newton_steps(monkeypatch):
    """Nodes find their place one after the other, and friction is renewed after each."""

    mesh, few = block(), NewtonSettings(most_iterations=5)
    placement = place(BALL, mesh.nodes_mm[mesh.skin_nodes], np.zeros(3), np.eye(3))
    small_body = partial(
        press, mesh, RELAXING, BALL, placement, MOTION, PressSettings(1, 1, few), friction=0.5, finest_mm=0.08
    )
    assert small_body().force_mn[-1] > 0.0
    monkeypatch.setattr("fingerpad.mechanics.press_settings.MORE_NEWTON_STEPS", 1)
    with pytest.raises(ConvergenceError, match="after 5 Newton steps"):
        small_body()


@pytest.mark.parametrize("persistent", [True, False])
def test_node_that_only_just_left_comes_back_by_a_short_step(persistent, monkeypatch):
    """At the edge of a grating each Newton step drove such a node in by 54 nm, and the next one out again."""
    push_mn, soft, hard, gap_mm = 6e-3, 120.0, 5e4, 8e-9

    def at(x_mm):
        deep_mm = max(x_mm - gap_mm, 0.0)
        rest_mn = push_mn - soft * x_mm - hard * deep_mm
        potential = 0.5 * soft * x_mm**2 + 0.5 * hard * deep_mm**2 - push_mn * x_mm
        return SimpleNamespace(
            x_mm=x_mm, residual_mn=np.array([rest_mn]), residual_norm_mn=abs(rest_mn),
            relative_residual=abs(rest_mn) / 100.0, potential_uj=potential, whole=True,
        )  # fmt: skip

    monkeypatch.setattr(_Search, "moved", lambda search, start, step: at(start.x_mm + step[0]))
    search = object.__new__(_Search)
    search.persistent, search.shift, search.history = persistent, 0.0, [""] * 20
    start = at(0.0)
    step = np.array([push_mn / soft])
    if not persistent:
        with pytest.raises(ConvergenceError, match="found no better configuration"):
            search.line_search(start, step, [start.potential_uj])
        return
    found = search.line_search(start, step, [start.potential_uj])
    assert found.potential_uj < start.potential_uj
    assert found.x_mm > gap_mm  # pressed again: the next tangent knows of the contact


@pytest.mark.parametrize("persistent", [True, False])
def test_a_step_that_is_far_too_long_is_solved_again_with_a_larger_shift(persistent, monkeypatch):
    """Skin about to snap had no stiffness along (1, 1), and 1/64 of the step was tried as the shortest."""

    def at(place_mm):
        search.blocks = np.array([[[1.0, 1e-12 - 1.0, 0.0], [1e-12 - 1.0, 1.0, 0.0], [0.0, 0.0, 1.0]]])
        way_mm = place_mm[:2].mean()
        rest_mn = np.array([1.0 - way_mm**3, 1.0 - way_mm**3, 0.0])
        return SimpleNamespace(
            place_mm=place_mm, residual_mn=rest_mn, residual_norm_mn=np.linalg.norm(rest_mn), whole=True,
            relative_residual=1.0, potential_uj=0.5 * way_mm**4 - 2.0 * way_mm, is_curved=True,
        )  # fmt: skip

    search = object.__new__(_Search)
    search.persistent, search.shift, search.was_shifted, search.history = persistent, 0.0, False, []
    search.load = SimpleNamespace(pressed_before=None, anchors=object())
    search.body = SimpleNamespace(sparsity=SimpleNamespace(diagonal=np.array([0])))
    search.solver = SimpleNamespace(solve=lambda blocks, rest_mn, _: np.linalg.solve(blocks[0], rest_mn))
    monkeypatch.setattr(_Search, "moved", lambda search, start, step: at(start.place_mm + step))
    monkeypatch.setattr(_Search, "with_tangent", lambda search, now, *curved: at(now.place_mm))
    monkeypatch.setattr(_Search, "contact_direction", lambda search, now, direction, forcing: direction)
    start = at(np.zeros(3))
    if not persistent:
        with pytest.raises(ConvergenceError, match="found no better configuration"):
            search.better(start, 1e-3, [start.potential_uj])
        return
    found = search.better(start, 1e-3, [start.potential_uj])
    assert found.potential_uj < start.potential_uj
    # A sixty-fourth of the step with a shift of 0.01.
    np.testing.assert_allclose(found.place_mm, [100.0 / 64, 100.0 / 64, 0.0], rtol=1e-6)
    assert search.was_shifted


class PiecewiseQuadratic:
    """Potential about a configuration to second order, with dense matrices: the points press or do not.

    Without the curvature of the indenter it is convex, and Newton's method with a line search minimises it.
    """

    def __init__(self, search, now):
        contact, self.free = search.load.contact, search.body.free
        self.stiffness = contact.stiffness
        self.here_mn = search.lagging.multipliers_mn - contact.stiffness * now.contact.gap_mm
        self.closing = np.stack(
            [self.closing_of(search, now, unit) for unit in np.eye(self.free.size)], axis=1
        )
        pressed = now.contact.pressed_mn > 0.0
        tangent = search.body.sparsity.matrix(search.blocks).toarray()[np.ix_(self.free, self.free)]
        self.tissue = tangent - self.contact_tangent(pressed)
        self.tissue_mn = now.residual_mn - self.closing.T @ now.contact.pressed_mn

    def closing_of(self, search, now, step):
        moved = np.zeros_like(now.displacement_mm)
        moved.ravel()[self.free] = step
        return (search.load.contact.points_mm(moved) * now.contact.normal).sum(axis=1)

    def contact_tangent(self, pressed):
        return (self.closing * np.where(pressed, self.stiffness, 0.0)[:, None]).T @ self.closing

    def pressed_mn(self, step):
        return np.maximum(self.here_mn - self.stiffness * (self.closing @ step), 0.0)

    def value(self, step):
        contact = 0.5 * (self.pressed_mn(step) ** 2 / self.stiffness).sum()
        return 0.5 * step @ self.tissue @ step - self.tissue_mn @ step + contact

    def minimum(self):
        step, start = np.zeros(self.free.size), self.value(np.zeros(self.free.size))
        for _ in range(200):
            slope = self.tissue @ step - self.tissue_mn - self.closing.T @ self.pressed_mn(step)
            newton = np.linalg.solve(self.tissue + self.contact_tangent(self.pressed_mn(step) > 0.0), -slope)
            value = self.value(step)
            # A further fall would be lost in the rounding of the values.
            if -(slope @ newton) <= 1e-9 * (start - value):
                return step
            length = 1.0
            while self.value(step + length * newton) > value + 1e-4 * length * (slope @ newton):
                length /= 2
            step = step + length * newton
        raise AssertionError("No minimum was found.")


def test_a_step_leads_to_the_minimum_over_all_points_that_may_be_pressed(monkeypatch):
    """A plain Newton step takes the points that are pressed now as those that will be."""
    left_open, left_open_by_newton = [], []
    found_for = _Search.contact_direction

    def checked(search, now, direction, forcing):
        if now.is_curved or search.shift > 0.0:
            return found_for(search, now, direction, forcing)
        model = PiecewiseQuadratic(search, now)
        found = found_for(search, now, direction, forcing)
        lowest, zero = model.value(model.minimum()), model.value(np.zeros_like(found))
        left_open.append((model.value(found) - lowest) / (zero - lowest))
        left_open_by_newton.append((model.value(direction) - lowest) / (zero - lowest))
        return found

    monkeypatch.setattr(_Search, "contact_direction", checked)
    mesh, bar = block(), Bar(1.7, 0.1)
    placement = place(bar, mesh.nodes_mm[mesh.skin_nodes], np.zeros(3), np.eye(3))
    done = press(mesh, RELAXING, bar, placement, MOTION, PressSettings(3, 1), finest_mm=0.1)
    assert done.force_mn[-1] > 0.0
    assert len(left_open) > 10
    assert max(left_open) <= 0.05
    assert max(left_open_by_newton) > 1.0  # such a step leads uphill


def test_nodes_follow_the_surface_where_a_straight_step_would_leave_it(monkeypatch):
    """About the edge of a bar a straight step misses the gap that its linear model leaves."""
    missed, missed_by_straight_step = [], []
    found_for = _Search.along_surface

    def checked(search, start, displacement_mm, depth_mm):
        found = found_for(search, start, displacement_mm, depth_mm)
        contact, here = search.load.contact, start.contact
        corrected_mm = displacement_mm.copy()
        corrected_mm.ravel()[search.body.free] += found

        def gap_mm(moved_mm):
            points_mm = contact.points_mm(search.body.mesh.nodes_mm + moved_mm)
            return contact.gap(contact.placement.to_local(points_mm, depth_mm))[0]

        points_mm = contact.points_mm(search.body.mesh.nodes_mm + displacement_mm)
        linear_mm = here.gap_mm + ((points_mm - start.positions_mm) * here.normal).sum(axis=1)
        changed = np.zeros(search.body.mesh.nodes_mm.size, dtype=bool)
        changed[search.body.free] = found != 0.0
        nodes = changed.reshape(-1, 3).any(axis=1)[contact.nodes]
        for gaps_mm, errors in (
            (gap_mm(corrected_mm), missed),
            (gap_mm(displacement_mm), missed_by_straight_step),
        ):
            errors.extend(np.abs(gaps_mm - linear_mm)[: nodes.size][nodes])
        return found

    monkeypatch.setattr(_Search, "along_surface", checked)
    done = pressed(block(), Bar(1.7, 0.1), NewtonSettings(persistent=True))
    assert done.force_mn[-1] > 0.0
    assert max(missed_by_straight_step) > 1e-3
    assert np.linalg.norm(missed) < 0.1 * np.linalg.norm(missed_by_straight_step)


@pytest.mark.parametrize("friction", [0.0, 0.5])
def test_both_searches_find_the_same_depth_for_a_force(friction):
    mesh, bar = block(), Bar(1.7, 0.1)
    motion = ForceRampAndHold(force_mn=60.0, ramp_ms=50.0, hold_ms=200.0)
    placement = place(bar, mesh.nodes_mm[mesh.skin_nodes], np.zeros(3), np.eye(3))
    plain, persistent = (
        press(
            mesh, RELAXING, bar, placement, motion, PressSettings(4, 3, NewtonSettings(persistent=search)),
            deepest_mm=1.0, friction=friction,
        )
        for search in (False, True)
    )  # fmt: skip
    np.testing.assert_allclose(persistent.force_mn, plain.force_mn, rtol=1e-4)
    np.testing.assert_allclose(persistent.depth_mm, plain.depth_mm, rtol=2e-4)
