"""Indenters rotated about their direction of indentation: invariants, differences, and refused ones."""

from dataclasses import dataclass, replace

import numpy as np
import pytest

from fingerpad.core.errors import InputError
from fingerpad.core.units import cosine_and_sine
from fingerpad.geometry.bodies import Bar, Cylinder, Edge, FlatPunch, Gap, Grating, Line, Plate, Sphere
from fingerpad.geometry.fingertip import Fingertip
from fingerpad.geometry.grading import Grading, covering
from fingerpad.geometry.indenters import Indenter
from fingerpad.geometry.motion import ForceRampAndHold, RampAndHold
from fingerpad.geometry.size_field import grading_below
from fingerpad.mechanics.press_settings import PressSettings
from fingerpad.mechanics.tissues import named_tissues
from fingerpad.skin.indentation import Touch, touch_of
from fingerpad.skin.store import touch_key
from refusals import refusals

ALL = [Cylinder(), Bar(), Sphere(), FlatPunch(), Plate(), Line(), Edge(), Gap(), Grating()]
HALF = Grading(17.37, 1.6, 1.6, 0.8, 0.8, largest_mm=5.0, stratum_corneum=1, dermis=1, subcutis=2)
FULL = replace(HALF, full=True)


def touch(indenter, spin_deg=0.0, grading=HALF, **changes):
    given = {"stimulus": RampAndHold(depth_mm=0.4), "settings": PressSettings(2, 1)} | changes
    return Touch(
        finger=Fingertip(), indenter=indenter, tissues=named_tissues("trial3"), grading=grading,
        spin_deg=spin_deg, **given,
    )  # fmt: skip


@dataclass(frozen=True)
class BarAlong(Indenter):
    """The bar along the finger, written with its axes exchanged."""

    bar: Bar

    def gap(self, points_mm):
        gap, normal = self.bar.gap(points_mm[:, ::-1])
        return gap, normal[:, ::-1]

    def front(self, points_mm):
        return self.bar.front(points_mm[:, ::-1])


@pytest.mark.parametrize("indenter", ALL, ids=lambda body: type(body).__name__)
@pytest.mark.parametrize("spin_deg", [0.0, 30.0, 90.0, -90.0, 135.0, 180.0])
def test_a_body_reports_its_mirror_symmetry(indenter, spin_deg):
    """Gaps at points and their mirror images, in the frame of the finger."""
    points = np.random.default_rng(6).uniform([-5.0, -1.0, -5.0], [5.0, 0.5, 5.0], (200, 3))
    cosine, sine = cosine_and_sine(spin_deg)
    axes = np.array([[cosine, 0.0, -sine], [0.0, 1.0, 0.0], [sine, 0.0, cosine]])
    gap, mirrored = (indenter.gap(seen @ axes)[0] for seen in (points, points * [1.0, 1.0, -1.0]))
    is_mirror_image = np.allclose(gap, mirrored, rtol=0, atol=1e-12)
    # A wire's gap is that of a plate; what it may touch is not, and it is never turned.
    assert indenter.mirrors(spin_deg) == is_mirror_image or isinstance(indenter, Line)


def test_a_bar_turned_by_a_quarter_lies_along_the_finger():
    turned, along = touch(Bar(), 90.0).solve(), touch(BarAlong(Bar())).solve()
    np.testing.assert_allclose(turned.force_mn, along.force_mn, rtol=1e-9)
    np.testing.assert_allclose(turned.displacement_mm, along.displacement_mm, rtol=0, atol=1e-10)
    across = touch(Bar()).solve()
    assert abs(across.force_mn[-1] / turned.force_mn[-1] - 1.0) > 0.02


def test_opposite_spins_are_mirror_images():
    """The mesh of a full finger is its own mirror image, so each node has a partner across the midline."""
    left, right = (touch(Bar(1.6, 0.2), spin, FULL).solve() for spin in (25.0, -25.0))
    nodes = left.mesh.nodes_mm
    order = np.argsort(np.lexsort(np.round(nodes, 9).T))
    partner = np.lexsort(np.round(nodes * [1.0, 1.0, -1.0], 9).T)[order]
    np.testing.assert_allclose(nodes[partner], nodes * [1.0, 1.0, -1.0], rtol=0, atol=1e-9)
    np.testing.assert_allclose(left.force_mn, right.force_mn, rtol=1e-5)
    moved = right.displacement_mm[partner] * [1.0, 1.0, -1.0]
    np.testing.assert_allclose(left.displacement_mm, moved, rtol=0, atol=1e-4 * 0.4)
    assert np.abs(left.displacement_mm - right.displacement_mm).max() > 0.05 * 0.4


def test_a_positive_spin_turns_the_body_from_distal_towards_positive_z():
    """An edge covers the proximal half; turned by a quarter it covers negative z."""
    pressing = touch(Edge(), 90.0, FULL)
    lateral = np.array([[17.37, 0.0, -2.0], [17.37, 0.0, 2.0]])
    points = lateral + pressing.placement.origin_mm * [0.0, 1.0, 0.0] - [0.0, 1.0, 0.0]
    gap, _ = Edge().gap(pressing.placement.to_local(points, 0.0))
    assert gap[0] < 0.0 < gap[1]


def test_force_control_turns_as_depth_does_and_spin_is_part_of_the_key():
    assert touch(Bar(), 90.0) != touch(Bar())
    assert touch_key(touch(Bar(), 90.0)) != touch_key(touch(Bar()))
    assert touch_key(touch(Bar(), 90)) == touch_key(touch(Bar(), 90.0))
    skin = touch(Bar(), 90.0, stimulus=ForceRampAndHold(80.0)).solve()
    np.testing.assert_allclose(skin.force_mn, [0.0, 40.0, 80.0, 80.0], rtol=1e-5)
    assert skin.force_imbalance <= 1e-4


test_what_cannot_be_turned_is_refused_in_one_sentence = refusals(
    (lambda: touch(Bar(), 20.0), "spin_deg = 20 degrees leaves Bar without symmetry.*full=True"),
    (lambda: touch(Edge(), 90.0), "spin_deg = 90 degrees leaves Edge without symmetry"),
    (lambda: touch(Bar(), np.nan), "spin_deg must be a finite number"),
    (lambda: touch(Bar(), "across"), "spin_deg must be a"),
    (lambda: touch(Line(), 90.0), "spin_deg must be 0 for Line: got 90 degrees"),
    (lambda: touch_of(Fingertip(), Bar(), spin_deg=np.inf), "spin_deg must be a finite number"),
)  # fmt: skip


def test_one_mesh_serves_several_indenters():
    """As fine as each of them wherever that one is fine."""
    finger, motion = Fingertip(), RampAndHold()
    parts = [
        grading_below(finger, Gap(0.5), "standard", (17.37, 0.0), motion),
        grading_below(finger, Gap(2.0), "quick", (17.0, 0.0), motion),
        grading_below(finger, Bar(), "quick", (18.0, 0.0), motion, spin_deg=20.0),
    ]
    joint = covering(parts)
    assert joint.full
    assert joint.stratum_corneum == 4
    for part in parts:
        assert joint.centre_mm - joint.half_length_mm <= part.centre_mm - part.half_length_mm + 1e-12
        assert joint.centre_mm + joint.half_length_mm >= part.centre_mm + part.half_length_mm - 1e-12
        assert joint.half_width_mm >= part.half_width_mm
        assert joint.size_x_mm <= part.size_x_mm
        assert joint.size_z_mm <= part.size_z_mm
        assert set(part.finer_along) <= set(joint.finer_along)
    assert covering([HALF]) == HALF
    with pytest.raises(InputError, match="at least one grading: got none"):
        covering([])
