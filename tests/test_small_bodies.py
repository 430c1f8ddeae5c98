"""Presses of small bodies, past which nodes of the usual mesh, or facets between them, would slide."""

from types import SimpleNamespace

import numpy as np
import pytest

import fingerpad as fp
from fingerpad.mechanics.moments import Press


@pytest.mark.parametrize(
    ("body", "tissues", "depth_mm", "force_mn"),
    [
        # The force on a mesh with elements half as long, 0.05 mm at the rim.
        (fp.FlatPunch(1.0, 0.1), "human", 1.0, 36.9),
        # The force at standard resolution. With contact at nodes alone the ball went through it at 1.13 mm.
        (fp.Sphere(curvature_per_m=2000.0), "trial1", 2.0, 220.0),
    ],
    ids=["punch of 1 mm", "ball on stiff skin"],
)
def test_small_bodies_are_pressed_deep_without_friction(body, tissues, depth_mm, force_mn):
    motion, steps = fp.RampAndHold(depth_mm=depth_mm), fp.PressSettings(ramp_steps=5, hold_steps=1)
    skin = fp.touch_of(fp.Fingertip(), body, motion, tissues, settings=steps).solve()
    peak = int(skin.force_mn.argmax())
    assert skin.force_mn[peak] == pytest.approx(force_mn, rel=0.05)
    assert (np.diff(skin.force_mn[: peak + 1]) > 0.0).all()
    assert skin.energy_imbalance <= 0.005


@pytest.mark.parametrize(
    ("body", "tissues", "depth_mm"),
    [
        # Both stopped before, at 1.38 and 0.79 mm.
        (fp.FlatPunch(1.0, 0.1), "trial2", 1.6),
        (fp.Bar(3.0, 0.05), "gerling2014_fit", 1.0),
    ],
    ids=["a rim", "an edge"],
)
def test_nodes_that_slide_round_a_sharp_edge_do_not_stop_a_press(body, tissues, depth_mm):
    """Each node that slides over the edge is a small instability, which the search has to pass."""
    motion, steps = fp.RampAndHold(depth_mm=depth_mm), fp.PressSettings(hold_steps=1)
    skin = fp.touch_of(fp.Fingertip(), body, motion, tissues, settings=steps).solve()
    assert (np.diff(skin.force_mn[:-1]) > 0.0).all()
    assert skin.force_imbalance <= 1e-4


def test_skin_that_slips_past_the_indenter_is_no_result():
    """A step through an unstable state counts only if the indenter still meets resistance."""

    def state(depth_mm, force_mn, was_shifted=False):
        contact = SimpleNamespace(force_mn=np.array([[0.0, force_mn, 0.0]]))
        return SimpleNamespace(depth_mm=depth_mm, contact=contact, was_shifted=was_shifted)

    placement = SimpleNamespace(axis=np.array([0.0, 1.0, 0.0]))
    job = SimpleNamespace(stimulus=SimpleNamespace(stays=True), contact=SimpleNamespace(placement=placement))
    start = SimpleNamespace(found=state(1.0, 20.0))
    with pytest.raises(fp.ConvergenceError, match="slips past the indenter: its force falls from 20 to 5 mN"):
        Press.check_that_it_holds(job, start, state(1.1, 5.0, was_shifted=True))
    with pytest.raises(fp.ConvergenceError, match="its force falls from 20 to 0 mN"):
        Press.check_that_it_holds(job, start, state(1.1, 0.0))
    Press.check_that_it_holds(job, start, state(1.1, 5.0))
    Press.check_that_it_holds(job, start, state(0.9, 5.0, was_shifted=True))
    Press.check_that_it_holds(job, start, state(1.1, 21.0, was_shifted=True))
