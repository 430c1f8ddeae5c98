"""Conditions that an equilibrium meets before it is returned: supports balance the force of the indenter."""

from dataclasses import replace
from types import SimpleNamespace

import numpy as np
import pytest

import fingerpad as fp
from fingerpad.mechanics import newton
from fingerpad.mechanics.contact import PlacedIndenter, place
from fingerpad.mechanics.linear import LinearSolver, NotPositiveDefiniteError
from fingerpad.mechanics.moments import Press
from fingerpad.mechanics.newton import NewtonSettings, _Search
from fingerpad.mechanics.press import Specimen, press
from presses import RELAXING, block, press_into

BALL = fp.Sphere(curvature_per_m=500.0)
MOTION = fp.RampAndHold(depth_mm=0.2, ramp_ms=50.0, hold_ms=500.0)


def pressed(mesh, indenter, newton_settings, at_mm=(0.0, 0.0, 0.0), ramp_steps=3):
    settings = fp.PressSettings(ramp_steps, 3, newton_settings)
    return press_into(mesh, RELAXING, indenter, MOTION, settings, at_mm)


def test_balance_is_met_where_the_residual_alone_would_pass_as_solved():
    loose = NewtonSettings(residual_tolerance=0.05, balance_tolerance=1.0)
    unbalanced = pressed(block(), BALL, loose)
    assert unbalanced.force_imbalance > 1e-3
    found = pressed(block(), BALL, replace(loose, balance_tolerance=1e-4))
    assert found.force_imbalance <= 1e-4
    assert found.newton_steps > unbalanced.newton_steps
    # The number reported is that of the forces reported.
    np.testing.assert_allclose(found.reaction_mn[1:, 1], found.force_mn[1:], rtol=1e-4)
    with pytest.raises(fp.InputError, match="balance_tolerance must be"):
        NewtonSettings(balance_tolerance=0.0)
    differs = np.abs(unbalanced.reaction_mn[1:, :2] - np.outer(unbalanced.force_mn[1:], [0.0, 1.0]))
    assert unbalanced.force_imbalance >= (differs.max(axis=1) / unbalanced.force_mn[1:]).max() * (1 - 1e-9)


@pytest.mark.parametrize(
    "indenter", [fp.Bar(1.7, 0.1), fp.Gap(0.75, 4.0, 0.3, 0.03)], ids=lambda body: type(body).__name__
)
def test_skin_that_slides_round_an_edge_is_followed(indenter):
    """Edges much sharper than the spacing of the nodes: with their curvature the tangent is not definite."""
    done = pressed(block(), indenter, NewtonSettings())
    assert done.force_imbalance <= 1e-4
    assert 0.0 < done.penetration_mm <= 0.005 * MOTION.depth_mm
    blunt = {"fillet_mm": 0.3} if isinstance(indenter, fp.Bar) else {"lip_mm": 0.3}
    similar = pressed(block(), replace(indenter, **blunt), NewtonSettings())
    np.testing.assert_allclose(done.force_mn[-1], similar.force_mn[-1], rtol=0.25)


def test_a_shifted_tangent_leads_to_the_same_equilibrium(monkeypatch):
    """Every indefinite tangent is shifted, and none is taken without the curvature of the body.

    At which of the last steps the skin snaps round an edge, and round which one, hangs on the last bits; the
    states before and the force at the end do not.
    """
    steps = 16
    usual = pressed(block(), fp.Bar(1.7, 0.1), NewtonSettings(), ramp_steps=steps)
    shifted = []
    found = _Search.found
    monkeypatch.setattr(_Search, "newton_direction", _Search.shifted_direction)
    watched = lambda search, *how: shifted.append(search.was_shifted) or found(search, *how)  # noqa: E731
    monkeypatch.setattr(_Search, "found", watched)
    done = pressed(block(), fp.Bar(1.7, 0.1), NewtonSettings(persistent=True), ramp_steps=steps)
    assert any(shifted)
    stands = done.depth_mm < 0.17
    np.testing.assert_allclose(done.force_mn[stands], usual.force_mn[stands], rtol=1e-4)
    np.testing.assert_allclose(done.force_mn[-1], usual.force_mn[-1], rtol=1e-3)
    lost_uj = done.energy.imbalance_uj
    assert np.abs(lost_uj[stands]).max() <= 5e-4 * done.energy.external_uj.max()
    assert lost_uj[-1] > 0.0  # a snap sets energy free


@pytest.mark.parametrize("ramp_steps", [3, 12])
def test_skin_that_snaps_ends_in_one_state_with_any_number_of_steps(ramp_steps):
    """The edge is sharper than the elements: near the largest depth skin slides round it at once."""
    done = pressed(block(), fp.Bar(1.7, 0.1), NewtonSettings(persistent=True), ramp_steps=ramp_steps)
    np.testing.assert_allclose(done.force_mn[-1], 64.0, rtol=2e-3)
    assert done.energy.relative_imbalance <= 0.015  # what the snap sets free


def test_a_guess_that_folds_is_replaced_by_the_step_before(monkeypatch):
    """A guess may turn an element inside out; the search then starts where the last step ended."""
    usual = pressed(block(), BALL, NewtonSettings())
    monkeypatch.setattr(Press, "continued", lambda job, start, target_ms: 1e9)
    folded = pressed(block(), BALL, NewtonSettings())
    np.testing.assert_allclose(folded.force_mn, usual.force_mn, rtol=1e-3)


def test_balance_holds_beside_the_middle_of_a_whole_block():
    """No symmetry helps: the reaction has three components, and they are those of the contact."""
    done = pressed(block(symmetric=False), BALL, NewtonSettings(), at_mm=(0.5, 0.0, 0.3))
    assert done.force_imbalance <= 1e-4
    np.testing.assert_allclose(done.reaction_mn[1:, 1], done.force_mn[1:], rtol=1e-4)
    sideways = np.abs(done.reaction_mn[-1, [0, 2]]) / done.force_mn[-1]
    assert (sideways > 1e-3).all()


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
            relative_residual=abs(rest_mn) / 100.0, potential_uj=potential, whole=True, depth_mm=1.0,
            missing_force_mn=lambda load: 0.0,
        )  # fmt: skip

    monkeypatch.setattr(_Search, "moved", lambda search, start, step, advance_mm: at(start.x_mm + step[0]))
    search = object.__new__(_Search)
    search.persistent, search.shift, search.history = persistent, 0.0, [""] * 20
    search.load = SimpleNamespace(force_mn=None, force_scale_mn=lambda force_mn: 100.0)
    start = at(0.0)
    step = np.array([push_mn / soft])
    if not persistent:
        with pytest.raises(fp.ConvergenceError, match="found no better configuration"):
            search.line_search(start, step, 0.0, [start.potential_uj])
        return
    found = search.line_search(start, step, 0.0, [start.potential_uj])
    assert found.potential_uj < start.potential_uj
    assert found.x_mm > gap_mm  # pressed again: the next tangent knows of the contact


@pytest.mark.parametrize("friction", [0.0, 0.5])
def test_both_searches_find_the_same_depth_for_a_force(friction):
    motion = fp.ForceRampAndHold(force_mn=60.0, ramp_ms=50.0, hold_ms=200.0)
    searches = (fp.PressSettings(4, 3, NewtonSettings(persistent=each)) for each in (False, True))
    bar, limits = fp.Bar(1.7, 0.1), {"deepest_mm": 1.0, "friction": friction}
    plain, persistent = (press_into(block(), RELAXING, bar, motion, each, **limits) for each in searches)
    np.testing.assert_allclose(persistent.force_mn, plain.force_mn, rtol=1e-4)
    np.testing.assert_allclose(persistent.depth_mm, plain.depth_mm, rtol=2e-4)


@pytest.mark.parametrize("persistent", [True, False])
def test_an_indefinite_tangent_does_not_stop_the_search_for_a_depth(persistent, monkeypatch):
    """It may show only when the response to the indenter is solved for."""
    motion = fp.ForceRampAndHold(force_mn=60.0, ramp_ms=50.0, hold_ms=200.0)
    settings = fp.PressSettings(4, 3, NewtonSettings(persistent=persistent))
    usual = press_into(block(), RELAXING, BALL, motion, settings)
    solve, refused, only_here = LinearSolver.solve, [], 1.1 * newton.DEPTH_FORCING

    def refusing(solver, blocks, right, forcing, guess=None):
        if forcing == only_here and len(refused) % 2 == 0:
            refused.append(forcing)
            raise NotPositiveDefiniteError
        if forcing == only_here:
            refused.clear()
        return solve(solver, blocks, right, forcing, guess)

    monkeypatch.setattr(LinearSolver, "solve", refusing)
    monkeypatch.setattr(newton, "DEPTH_FORCING", only_here)
    done = press_into(block(), RELAXING, BALL, motion, settings)
    np.testing.assert_allclose(done.depth_mm, usual.depth_mm, rtol=2e-3)  # penetrations are bound by 5e-3
    assert done.times_ms.tolist() == usual.times_ms.tolist()


def test_each_step_towards_a_force_goes_the_whole_way():
    """With the depth moved by itself it took 43 steps, and 48 with a response solved to 1e-3."""
    motion = fp.ForceRampAndHold(force_mn=60.0, ramp_ms=50.0, hold_ms=200.0)
    limits = {"deepest_mm": 1.0, "finest_mm": 0.1}
    found = press_into(block(), RELAXING, fp.Bar(1.7, 0.1), motion, fp.PressSettings(4, 3), **limits)
    assert found.newton_steps <= 25


def test_a_force_leads_on_from_an_indenter_that_touches_at_depth_0():
    """Middles of facets may lie a few micrometres in it, and no multiple of a depth of 0 leads deeper."""
    motion, settings = fp.ForceRampAndHold(force_mn=20.0, ramp_ms=50.0, hold_ms=200.0), fp.PressSettings(4, 3)
    mesh = block()
    above = place(BALL, mesh.nodes_mm[mesh.skin_nodes], np.zeros(3), np.eye(3))
    inside = replace(above, origin_mm=above.origin_mm + 0.01 * above.axis)
    specimen = Specimen(mesh, RELAXING)
    far, near = (press(specimen, PlacedIndenter(BALL, each), motion, settings) for each in (above, inside))
    np.testing.assert_allclose(near.force_mn, far.force_mn, rtol=1e-4)
    np.testing.assert_allclose(near.depth_mm[1:] + 0.01, far.depth_mm[1:], atol=2e-4)
