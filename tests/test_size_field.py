"""Sizes of elements below a body: radii against closed forms, and meshes by body, place and motion."""

from dataclasses import dataclass, replace

import numpy as np
import pytest

import fingerpad as fp
from fingerpad.geometry.bodies import Dots, ridges
from fingerpad.geometry.grading import resolution_grading
from fingerpad.geometry.indenters import Indenter
from fingerpad.geometry.size_field import (
    SHARES,
    SMALLEST_MM,
    STEP_MM,
    check_sizes,
    details_of,
    face_of,
    grading_below,
)
from refusals import refusals

FINGER = fp.Fingertip()
BALL = fp.Sphere(curvature_per_m=287.0)
PRESS = fp.RampAndHold(depth_mm=0.5)


def below(body, motion=PRESS, resolution="quick", at_mm=(17.37, 0.0), **turned):
    return grading_below(FINGER, body, resolution, at_mm, motion, **turned)


def face(body, spin_deg=0.0):
    return face_of(body, spin_deg, (3.0, 3.0), STEP_MM)


@dataclass(frozen=True)
class Ring(Indenter):
    """A torus that lies on the skin: curved along the rings by r, and by R + r cos(a) around."""

    ring_mm: float = 2.0
    radius_mm: float = 0.6

    def gap(self, points_mm):
        x, y, z = points_mm.T
        around = np.hypot(x, z)
        beside, below = around - self.ring_mm, y + self.radius_mm
        length = np.hypot(beside, below)
        outward = np.stack([x, z]) / np.where(around > 0.0, around, 1.0)
        safe = np.where(length > 0.0, length, 1.0)
        normal = np.column_stack([beside * outward[0] / safe, below / safe, beside * outward[1] / safe])
        return length - self.radius_mm, normal


@dataclass(frozen=True)
class Bumps(Indenter):
    """A plate of waves along and across, nearly a distance where they are low."""

    period_mm: float = 0.3
    height_mm: float = 0.03

    def gap(self, points_mm):
        (x, y, z), number = points_mm.T, 2.0 * np.pi / self.period_mm
        slope = [number * self.height_mm * np.sin(number * each) for each in (x, z)]
        up = np.column_stack([slope[0], np.ones(len(y)), slope[1]])
        length = np.linalg.norm(up, axis=1)
        wave = self.height_mm * (np.cos(number * x) + np.cos(number * z) - 2.0)
        return (y - wave) / length, up / length[:, None]


def test_radii_of_a_face_are_those_of_the_body():
    """On a ball, along and across a cylinder turned by 30 degrees, and on the outer equator of a torus."""
    ball = face(fp.Sphere(radius_mm=2.0))
    at = np.hypot(ball.x_mm[:, None], ball.z_mm) < 1.5
    for radius_mm in (ball.along_mm, ball.across_mm, ball.round_mm):
        np.testing.assert_allclose(radius_mm[at], 2.0, rtol=1e-3)
    rod = face(fp.Cylinder(4.0), 30.0)
    on_top = rod.x_mm.size // 2, rod.z_mm.size // 2
    share = np.array([np.cos(np.pi / 6), np.sin(np.pi / 6)]) ** 2  # Euler: 1 / r = cos² / R
    found = [radius_mm[on_top] for radius_mm in (rod.along_mm, rod.across_mm)]
    np.testing.assert_allclose(found, (2.0 + STEP_MM) / share - STEP_MM, rtol=1e-3)
    assert rod.round_mm[on_top] > 100.0
    ring = face(Ring())
    place = np.abs(ring.x_mm - 2.4).argmin(), on_top[1]
    slope = 0.4 / (0.6 + STEP_MM)  # Gaussian curvature cos(a) / (r (R + r cos(a))), r one step above
    np.testing.assert_allclose(ring.along_mm[place], 0.6, rtol=0.01)
    np.testing.assert_allclose(ring.round_mm[place], np.sqrt(0.65 * 2.4 / slope) - STEP_MM, rtol=0.02)
    inner = np.abs(ring.x_mm - 1.6).argmin(), on_top[1]
    assert ring.round_mm[inner] > 100.0  # a saddle


@pytest.mark.parametrize("resolution", ["quick", "standard"])
def test_bodies_of_the_paper_keep_the_largest_elements(resolution):
    largest_mm = resolution_grading(resolution, 17.37).size_x_mm
    spheres = (fp.Sphere(curvature_per_m=curvature) for curvature in (144.0, 287.0, 694.0))
    for body in (fp.Cylinder(), fp.Plate(), *spheres):
        grading = below(body, fp.RampAndHold(), resolution)
        assert grading.finer_along == grading.finer_across == ()
        assert (grading.size_x_mm, grading.full) == (largest_mm, False)
        assert fp.touch_of(FINGER, body, resolution=resolution).body is body


@pytest.mark.parametrize(
    ("body", "size_mm", "through"),
    [
        (fp.Sphere(radius_mm=0.25), 0.25 / 4, 3), (fp.Sphere(radius_mm=1.1), 1.1 / 4, 2),
        (fp.Sphere(radius_mm=1.3), 0.45, 2), (fp.Cylinder(0.5), 0.25 / 4, 3), (fp.Bar(3.0, 0.3), 0.18, 2),
        (fp.Bar(3.0, 0.05), 0.05, 4), (fp.Edge(0.0), SMALLEST_MM, 4), (fp.FlatPunch(1.0, 0.1), 0.06, 4),
        (fp.FlatPunch(10.0, 0.3), 0.18, 2), (fp.bodies.Line(), 0.025, 4), (fp.Grating(1.5, 1.5), 0.12, 2),
    ],
    ids=lambda value: str(value) if not isinstance(value, float) else "",
)  # fmt: skip
def test_elements_are_a_share_of_the_radius(body, size_mm, through):
    """A quarter of a ball's, 0.6 of an edge's; thin ones take more of them through the stratum corneum."""
    grading = below(body)
    assert grading.finest_x_mm == pytest.approx(size_mm, rel=0.1)
    assert grading.stratum_corneum == through
    assert len(fp.touch_of(FINGER, body, PRESS).mesh.nodes_mm) < 60_000


def test_an_edge_is_as_round_as_the_elements_that_resolve_it():
    touch = fp.touch_of(FINGER, fp.Bar(3.0, 0.0), PRESS)
    assert touch.body.fillet_mm == touch.grading.finest_x_mm == SMALLEST_MM


def test_sizes_follow_place_turn_and_motion():
    still, beside = below(fp.Bar(3.0, 0.3)), below(fp.Bar(3.0, 0.3), at_mm=(17.37, 2.0))
    assert not still.full
    assert still.finer_across == ()
    assert len(still.finer_along) == 2
    assert beside.full
    along = below(fp.Bar(3.0, 0.3), spin_deg=90.0)
    assert not along.full
    assert along.finer_along == ()
    assert along.finest_z_mm == pytest.approx(still.finest_x_mm)
    turned = below(fp.Bar(3.0, 0.3), spin_deg=30.0)
    assert turned.full
    assert max(turned.finest_x_mm, turned.finest_z_mm) <= 0.3
    motion = fp.Trajectory((0.0, 50.0, 100.0), depth_mm=(0.0, 2.0, 2.0), x_mm=(0.0, 0.0, 3.0))
    slides = below(fp.Bar(3.0, 0.3), motion)
    for edge_mm in (-1.5, 1.5):  # an edge passes all places between
        places = np.linspace(17.37 + edge_mm, 17.37 + edge_mm + 3.0, 20)
        assert all(
            any(begin <= place <= end for begin, end, _ in slides.finer_along) for place in places[1:-1]
        )


def test_dots_that_enter_and_leave_have_elements_of_one_size():
    places_mm = 2.0 * np.arange(-5, 6)
    field = Dots([(x, z) for x in places_mm for z in places_mm], 1.0, 0.5)
    slides = below(field, fp.stroke(depth_mm=0.6, speed_mm_per_s=20.0, x_mm=[4.0]))
    sizes_mm = {size for _, _, size in slides.finer_along + slides.finer_across}
    assert max(sizes_mm) < 1.01 * min(sizes_mm)
    assert min(sizes_mm) > 0.5 / 4


def test_what_never_touches_costs_nothing():
    """A spike that lies 2 mm deeper than the press goes, and one beside the finger."""
    spike = fp.Sphere(radius_mm=0.3)
    for at_mm in ((1.0, -2.0, 0.0), (0.0, 0.0, 12.0)):
        both = fp.bodies.Union([BALL, spike], [(0.0, 0.0, 0.0), at_mm])
        grading = below(both)
        assert grading.finer_along == grading.finer_across == ()
    near = fp.bodies.Union([BALL, spike], [(0.0, 0.0, 0.0), (1.0, 0.2, 0.0)])
    assert below(near).finest_x_mm == pytest.approx(0.3 / 4, rel=0.1)


def test_a_force_reaches_as_far_as_a_soft_pad_lets_it():
    shallow, deep = (below(BALL, fp.ForceRampAndHold(force_mn)) for force_mn in (20.0, 500.0))
    assert shallow.half_length_mm < deep.half_length_mm
    assert deep.half_length_mm >= below(BALL, fp.RampAndHold(depth_mm=2.0)).half_length_mm


def test_wide_bodies_are_meshed_where_they_touch_first():
    """A grating that lies flat on the finger touches it where the pad is highest, not at its axis."""
    x = np.linspace(5.0, 25.0, 401)
    highest_mm = x[FINGER.skin_point(x, 0.0)[:, 1].argmin()]
    field = Dots([(each, 0.0) for each in np.arange(-12.0, 12.1, 2.4)])
    for body, pitch_mm in ((fp.Grating(), 2.0), (field, 2.4), (fp.Plate(), 0.0)):
        grading = below(body, fp.RampAndHold(depth_mm=0.3), at_mm=(25.0, 0.0))
        assert abs(grading.centre_mm - highest_mm) < grading.half_length_mm + 1.5 * pitch_mm
        assert grading.half_length_mm < 5.0


def test_a_body_of_one_s_own_is_meshed_by_its_gap_alone():
    ring = below(Ring(radius_mm=0.3), fp.RampAndHold(depth_mm=0.4))
    like = below(fp.Cylinder(0.6), fp.RampAndHold(depth_mm=0.4))
    assert ring.finest_x_mm == pytest.approx(0.6 * 0.3, rel=0.1)
    assert like.finest_x_mm <= ring.finest_x_mm <= 3 * like.finest_x_mm
    mesh = fp.touch_of(FINGER, Ring(radius_mm=0.3), fp.RampAndHold(depth_mm=0.4)).mesh
    assert len(mesh.nodes_mm) < 40_000


def test_details_of_a_body_are_measured():
    grating = details_of(fp.Grating(1.0, 0.6, 0.1))
    assert grating.sharpest_mm == pytest.approx(0.1, rel=0.02)
    assert grating.parts_mm[0] == pytest.approx(1.0, abs=3 * STEP_MM)
    assert grating.grooves_mm[0] == pytest.approx(0.6, abs=3 * STEP_MM)
    assert grating.grooves_mm[1] == np.inf
    turned = details_of(fp.Grating(1.0, 0.6, 0.1), 90.0)
    assert turned.grooves_mm == (np.inf, grating.grooves_mm[0])
    assert details_of(fp.Sphere(radius_mm=2.0)).sharpest_mm == pytest.approx(2.0, rel=1e-3)
    uneven = details_of(ridges([-1.6, 0.0, 1.0], [1.2, 0.6, 0.6], fillet_mm=0.1))
    assert uneven.parts_mm[0] == pytest.approx(0.6, abs=3 * STEP_MM)


COARSE = replace(resolution_grading("quick", 17.37), size_x_mm=0.8, size_z_mm=0.8)

test_bodies_that_no_mesh_resolves_are_refused = refusals(
    (lambda: check_sizes(COARSE, fp.Gap(1.0), 0.0), r"a groove of the Gap, .* would go between the nodes"),
    (lambda: check_sizes(COARSE, fp.FlatPunch(0.1, 0.01), 0.0), r"a part of the FlatPunch.*got 0.8 mm"),
    (lambda: check_sizes(COARSE, fp.Grating(0.5, 0.5), 90.0), r"of the Grating"),
    (lambda: below(fp.Sphere(radius_mm=0.02), at_mm=(17.0, 3.3)), "would go between the nodes"),
    (lambda: below(fp.FlatPunch(0.1, 0.01)), "would go between the nodes"),
    (lambda: fp.touch_of(FINGER, fp.Gap(1.0), PRESS, grading=COARSE), ("grading",)),
    (lambda: below(Bumps(), fp.RampAndHold(depth_mm=1.0)),
     "too many details for a mesh of quick"),
)  # fmt: skip


def test_a_body_that_a_mesh_resolves_passes():
    check_sizes(COARSE, fp.Bar(), 0.0)
    check_sizes(COARSE, BALL, 0.0)
    assert set(SHARES) == {"quick", "standard", "paper"}
