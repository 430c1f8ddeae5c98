"""The outline against closed forms (a paraboloid is a finger too), its readings and finite differences."""

import numpy as np
import pytest

from fingerpad.geometry.fingertip import Fingertip, Profile
from refusals import refusals

LENGTH, DEPTH, HEIGHT, WIDTH = 30.0, 9.0, 6.0, 8.0


def paraboloid_readings(size):
    return tuple((x, size * (1.0 - x / LENGTH) ** 0.5) for x in (0.0, 6.0, 12.0, 18.0, 24.0, 28.0))


@pytest.fixture(scope="module")
def paraboloid():
    """(y / a)² + (z / c)² = 1 - x / L: constant g, so the spline is exact."""
    return Fingertip(
        length_mm=LENGTH,
        volar_readings_mm=paraboloid_readings(DEPTH),
        dorsal_readings_mm=paraboloid_readings(HEIGHT),
        half_width_readings_mm=paraboloid_readings(WIDTH),
        spine_y_mm=-1.0,
        spine_end_x_mm=10.0,
        bone_tip_x_mm=14.0,
        bone_height_mm=1.5,
        bone_width_mm=1.7,
    )


@pytest.fixture(scope="module")
def finger():
    return Fingertip()


def skin_sample(finger):
    """Points all over the skin, from the equations of the sections."""
    x, angle = np.meshgrid(np.linspace(0.5, 31.5, 30), np.linspace(-3.1, 3.1, 41), indexing="ij")
    volar, dorsal, half_width = finger.section(x)
    y = np.where(np.cos(angle) > 0, -volar, -dorsal) * np.cos(angle)
    return np.stack([x, y, half_width * np.sin(angle)], axis=-1)


def test_rays_meet_a_paraboloid_at_the_roots_of_the_quadratic(paraboloid):
    generator = np.random.default_rng(3)
    directions = generator.normal(size=(200, 3))
    directions /= np.linalg.norm(directions, axis=1)[:, None]
    directions[:, 1] = -np.abs(directions[:, 1])  # volar half only, where one quadric holds
    origin = np.array([10.0, -1.0, 0.0])
    inverse = np.array([0.0, DEPTH**-2, WIDTH**-2])
    a = (inverse * directions**2).sum(axis=1)
    b = 2 * (inverse * origin * directions).sum(axis=1) + directions[:, 0] / LENGTH
    c = (inverse * origin**2).sum() + origin[0] / LENGTH - 1.0
    expected = (-b + np.sqrt(b**2 - 4 * a * c)) / (2 * a)
    near = expected < 40.0
    distance = paraboloid.skin_distance_mm(np.broadcast_to(origin, directions.shape), directions)
    assert near.sum() > 150
    np.testing.assert_allclose(distance[near], expected[near], rtol=1e-9)


def test_profiles_pass_within_five_hundredths_of_their_readings(finger):
    for profile in finger.profiles:
        x, value = np.array(profile.readings_mm).T
        assert np.abs(profile.at(x) - value).max() < 0.05
    assert finger.section(finger.length_mm) == (0.0, 0.0, 0.0)  # the tip closes with the normal along x
    np.testing.assert_allclose(finger.skin_normal([finger.length_mm, 0.0, 0.0]), [1.0, 0.0, 0.0], atol=1e-12)


def test_volar_profile_is_smooth_over_the_pad(finger):
    """Rounding of the readings must not show: they were read off a surface of radius 35-125 mm at x 15-22."""
    x = np.linspace(8.0, 26.0, 721)
    curvature = np.gradient(np.gradient(finger.section(x)[0], x), x)[2:-2]
    assert (curvature < 0).all()
    turns = np.count_nonzero(np.diff(np.sign(np.diff(curvature))))
    assert turns <= 4
    radius = -1.0 / curvature[(x[2:-2] > 15) & (x[2:-2] < 22)]
    assert 35.0 < radius.min() < radius.max() < 200.0


def test_sections_are_half_ellipses_and_the_gradient_is_that_of_the_level(finger):
    points = skin_sample(finger)
    np.testing.assert_allclose(finger.level(points), 0.0, atol=1e-12)
    mirror = np.array([1.0, 1.0, -1.0])
    mirrored = finger.skin_normal(points * mirror)
    np.testing.assert_allclose(mirrored, finger.skin_normal(points) * mirror, rtol=0, atol=1e-15)
    points = points[2:-2, 1:-1] * 0.98
    points = points[np.abs(points[..., 1]) > 1e-3]
    for axis, shift in enumerate(1e-5 * np.eye(3)):
        slope = (finger.level(points + shift) - finger.level(points - shift)) / 2e-5
        np.testing.assert_allclose(finger.level_gradient(points)[:, axis], slope, atol=2e-8)


def test_subsurface_points_lie_at_their_depth_below_the_nearest_skin(finger):
    above = finger.skin_point(17.37, 1.0)
    below = finger.subsurface(above, 0.471)
    x, z = np.meshgrid(np.linspace(16.5, 18.5, 401), np.linspace(0.0, 2.0, 401), indexing="ij")
    nearest = np.linalg.norm(finger.skin_point(x, z) - below, axis=-1).min()
    assert nearest == pytest.approx(0.471, abs=1e-4)
    assert finger.level(below) < 0


def test_depth_available_ends_at_the_bone_or_at_the_back(finger):
    volar, dorsal, half_width = finger.section(12.0)
    assert finger.depth_available_mm(12.0, 0.0) == pytest.approx(volar - 2.0 - 2.3)
    z = 0.6 * half_width  # beside the bone, where both half-ellipses have 0.8 of their height
    assert finger.depth_available_mm(12.0, z) == pytest.approx(0.8 * (volar + dorsal))
    volar, dorsal, _ = finger.section(28.0)
    assert finger.depth_available_mm(28.0, 0.0) == pytest.approx(volar + dorsal)


def test_nail_lies_on_the_back_within_its_plate(finger):
    points = [[20.0, 4.0, 0.0], [20.0, -9.4, 0.0], [20.0, 3.0, 6.1], [16.0, 4.6, 0.0], [29.5, 2.7, 0.0]]
    assert finger.is_under_nail(points).tolist() == [True, False, False, False, False]


UNORDERED = ((0.0, 1.0), (2.0, 1.0), (1.0, 1.0), (3.0, 1.0), (4.0, 1.0))
NEGATIVE = ((0.0, 1.0), (1.0, -1.0), (2.0, 1.0), (3.0, 1.0), (4.0, 1.0))


test_fingers_profiles_and_places_that_cannot_be_are_refused = refusals(
    (lambda: Fingertip(dermis_mm=0.0), ("dermis_mm",)),
    (lambda: Fingertip(dermis_mm=3.5), "must fit into the outline"),
    (lambda: Fingertip(spine_y_mm=0.5), ("spine_y_mm",)),
    (lambda: Fingertip(bone_tip_x_mm=19.0), "must increase"),
    (lambda: Fingertip(nail_x_mm=(20.0, 18.0)), ("nail_x_mm",)),
    (lambda: Fingertip(length_mm=25.0, bone_tip_x_mm=24.0), "below the length"),
    (lambda: Profile(((0.0, 1.0), (1.0, 1.0)), 10.0), "at least five"),
    (lambda: Profile(UNORDERED, 10.0), "increase strictly"),
    (lambda: Profile(NEGATIVE, 10.0), "greater than 0"),
    (lambda: Fingertip().skin_point(17.37, 11.0), "must lie on the finger"),
    (lambda: Fingertip().skin_point(-1.0, 0.0), "must lie on the finger"),
    (lambda: Fingertip().skin_distance_mm([[40.0, 0.0, 0.0]], [[1.0, 0.0, 0.0]]), "inside the skin"),
)  # fmt: skip
