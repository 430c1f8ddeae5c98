"""Gaps against distances to densely drawn bodies; normals against slopes of the gap."""

import numpy as np
import pytest
from scipy.optimize import minimize_scalar

from fingerpad import Bar, Cylinder, Edge, FlatPunch, Grating, Plate, Sphere
from fingerpad.geometry.bodies import Line
from refusals import refusals

RADIUS = 1.5
CYLINDER, SPHERE = Cylinder(diameter_mm=2 * RADIUS), Sphere(curvature_per_m=1000.0 / RADIUS)
BAR, PUNCH = Bar(width_mm=3.0, fillet_mm=0.3), FlatPunch(diameter_mm=3.0, fillet_mm=0.4)
BODIES = [CYLINDER, SPHERE, BAR, PUNCH]
ALL = [*BODIES, Line(), Plate()]
NAMES = [type(body).__name__ for body in ALL]


def beside(body, points):
    """Distance from the axis or the middle plane: the coordinate in which each body is one profile."""
    return np.hypot(points[:, 0], points[:, 2]) if body in (SPHERE, PUNCH) else np.abs(points[:, 0])


def half_width(body):
    sizes = ("width_mm", "diameter_mm")
    return next((getattr(body, size) / 2 for size in sizes if hasattr(body, size)), np.inf)


def profile(body, s):
    """Half of the outline: (beside, y) at arc length s from the middle of the face."""
    fillet = RADIUS if body in (CYLINDER, SPHERE) else body.fillet_mm
    half = half_width(body)
    flat, turn = half - fillet, 0.5 * np.pi * fillet
    if s < flat:
        return s, 0.0
    if s < flat + turn:
        angle = (s - flat) / fillet
        return flat + fillet * np.sin(angle), fillet * (np.cos(angle) - 1)
    return half, -fillet - (s - flat - turn)


def brute_force_distance(body, width, height):
    """Smallest distance to the outline: the best of a dense scan, refined."""

    def distance(s):
        at = profile(body, s)
        return np.hypot(at[0] - width, at[1] - height)

    length = 6.0
    scan = np.linspace(0.0, length, 1501)
    best = scan[np.argmin([distance(s) for s in scan])]
    step = scan[1]
    bounds = max(best - step, 0.0), min(best + step, length)
    refined = minimize_scalar(distance, bounds=bounds, method="bounded", options={"xatol": 1e-10})
    return min(refined.fun, distance(best))


def points_about(body, seed=0, n=40):
    """Random points around a body's face."""
    generator = np.random.default_rng(seed)
    return generator.uniform([-2.5, -1.4, -2.5], [2.5, 0.8, 2.5], (n, 3))


@pytest.mark.parametrize("body", BODIES, ids=NAMES[:4])
def test_gap_is_the_distance_to_the_surface(body):
    points = points_about(body)
    gap, _ = body.gap(points)
    width = beside(body, points)
    expected = [brute_force_distance(body, w, y) for w, y in zip(width, points[:, 1], strict=True)]
    np.testing.assert_allclose(np.abs(gap), expected, rtol=0, atol=1e-8)
    within = points[:, 1] < body.front(points)
    np.testing.assert_array_equal(gap < 0, within)
    assert within.any()
    assert (~within).any()


@pytest.mark.parametrize("body", ALL, ids=NAMES)
def test_normal_is_the_slope_of_the_gap_and_of_unit_length(body):
    points, step = points_about(body, seed=1), 1e-6
    _, normal = body.gap(points)
    offsets = step * np.eye(3)
    slope = [(body.gap(points + offset)[0] - body.gap(points - offset)[0]) / (2 * step) for offset in offsets]
    np.testing.assert_allclose(normal, np.transpose(slope), rtol=0, atol=1e-6)
    np.testing.assert_allclose(np.linalg.norm(normal, axis=1), 1.0, rtol=1e-14)


@pytest.mark.parametrize("body", ALL, ids=NAMES)
def test_front_is_where_the_gap_changes_sign(body):
    lateral = np.random.default_rng(2).uniform(-0.98, 0.98, (30, 3))
    lateral *= min(half_width(body), RADIUS) / np.sqrt(2)
    face = lateral.copy()
    face[:, 1] = body.front(lateral)
    assert np.isfinite(face).all()
    up = np.array([0.0, 1e-3, 0.0])
    np.testing.assert_allclose(body.gap(face)[0], 0.0, rtol=0, atol=1e-14)
    assert (body.gap(face + up)[0] > 0).all()
    assert (body.gap(face - up)[0] < 0).all()
    gap, normal = body.gap(np.zeros((1, 3)))  # the tip is the origin and pushes along y
    np.testing.assert_allclose(gap, 0.0, atol=1e-15)
    np.testing.assert_array_equal(normal, [[0.0, 1.0, 0.0]])
    if not isinstance(body, Plate):
        beside_it = np.array([[-1.001, 0.0, 0.0], [1.001, 0.0, 0.0]]) * half_width(body)
        assert (body.front(beside_it) == -np.inf).all()


@pytest.mark.parametrize("body", [CYLINDER, SPHERE], ids=NAMES[:2])
def test_a_ball_goes_on_as_a_rod_behind_its_widest_section(body):
    """The gap has no jump there and its slope is the normal, so that a contact force has a potential."""
    points = np.random.default_rng(4).uniform([-2.5, -6.0, -2.5], [2.5, -RADIUS, 2.5], (30, 3))
    gap, normal = body.gap(points)
    np.testing.assert_allclose(gap, beside(body, points) - RADIUS, atol=1e-14)
    assert not normal[:, 1].any()
    step = 1e-6
    for axis, offset in enumerate(step * np.eye(3)):
        slope = (body.gap(points + offset)[0] - body.gap(points - offset)[0]) / (2 * step)
        np.testing.assert_allclose(normal[:, axis], slope, rtol=0, atol=1e-6)
    widest = points * [1.0, 0.0, 1.0] - [0.0, RADIUS, 0.0]
    up = np.array([0.0, 1e-9, 0.0])
    for ahead, behind in zip(body.gap(widest + up), body.gap(widest - up), strict=True):
        np.testing.assert_allclose(ahead, behind, rtol=0, atol=1e-6)


@pytest.mark.parametrize(
    ("body", "name"),
    [(FlatPunch(3.0, 0.1), "fillet_mm"), (Bar(3.0, 0.1), "fillet_mm"), (Edge(0.1), "fillet_mm"),
     (Grating(1.0, 1.0, 0.1), "lip_mm")],
    ids=lambda value: type(value).__name__ if not isinstance(value, str) else "",
)  # fmt: skip
def test_edges_are_rounded_to_a_radius_but_never_sharpened(body, name):
    assert getattr(body.rounded_to(0.25), name) == 0.25
    assert body.rounded_to(0.05) == body
    assert SPHERE.rounded_to(0.25) is SPHERE


def test_bodies_across_the_finger_do_not_end_in_z_and_round_ones_have_no_preferred_direction():
    points = points_about(CYLINDER, seed=5)
    turned = points[:, [2, 1, 0]]
    for body in (CYLINDER, BAR, Line(), Plate()):
        np.testing.assert_array_equal(body.gap(points)[0], body.gap(points + np.array([0.0, 0.0, 50.0]))[0])
    for body in (SPHERE, PUNCH):
        np.testing.assert_allclose(body.gap(points)[0], body.gap(turned)[0], rtol=0, atol=1e-15)
    points = points[points[:, 1] > -RADIUS]
    round_bar = Bar(width_mm=2 * RADIUS, fillet_mm=RADIUS)
    np.testing.assert_allclose(round_bar.gap(points)[0], CYLINDER.gap(points)[0], rtol=0, atol=1e-14)
    # A line presses only the nodes below it.
    points = np.array([[0.0, 0.4, 3.0], [0.02, 0.0, 0.0], [0.03, 0.0, 0.0], [-0.5, -2.0, 0.0]])
    assert Line(diameter_mm=0.05).may_touch(points).tolist() == [True, True, False, False]
    assert all(body.may_touch(points).all() for body in [*BODIES, Plate()])
    assert [type(body).__name__ for body in ALL if body.grips] == ["Line"]


test_impossible_bodies_are_refused_in_one_sentence = refusals(
    (lambda: Cylinder(0.0), "diameter_mm"),
    (lambda: Line(-0.05), "diameter_mm"),
    (lambda: Sphere(curvature_per_m=np.nan), ("curvature_per_m",)),
    (lambda: Bar(width_mm=np.inf), ("width_mm",)),
    (lambda: Bar(width_mm=1.0, fillet_mm=0.6), "half of width_mm, 0.5 mm: got 0.6 mm"),
    (lambda: FlatPunch(diameter_mm=1.0, fillet_mm=-0.1), "fillet_mm"),
    (lambda: FlatPunch(diameter_mm="wide"), "diameter_mm"),
)  # fmt: skip
