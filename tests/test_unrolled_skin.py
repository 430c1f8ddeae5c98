"""Unrolled skin: areas are preserved, the map can be inverted, and layouts keep their density."""

import numpy as np
from hypothesis import given, settings
from hypothesis import strategies as st
from numpy.testing import assert_allclose
from scipy.spatial import cKDTree
from scipy.stats import poisson

import fingerpad as fp
from fingerpad.core.regions import Rectangle, jittered, uniform
from fingerpad.geometry.mesh import finger_mesh
from fingerpad.skin.receptor_sheet import ReceptorSheet
from fingerpad.skin.unrolled_skin import PAD_FACES_DEG, PAD_X_MM
from refusals import refusals

SKIN = fp.UnrolledSkin()
FINGER = SKIN.finger
PAD = SKIN.pad()
ROUND = tuple((x, 9.0 * (1.0 - x / 31.78) ** 0.5) for x in (0.0, 5.0, 10.0, 15.0, 20.0, 25.0, 30.0))


def random_places(count, seed, ends=(-17.0, 18.5), share=0.98):
    rng = np.random.default_rng(seed)
    along = rng.uniform(*ends, count)
    return np.stack([along, share * rng.uniform(-1.0, 1.0, count) * SKIN.half_girth_mm(along)], axis=1)


def tangents(places, step=1e-4):
    """Derivatives of the point of the skin by both coordinates, by central differences."""
    return [
        (SKIN.points(places + move) - SKIN.points(places - move)) / (2.0 * step) for move in step * np.eye(2)
    ]


def stretches(places):
    """Smallest and largest factor by which the plane's lengths become the skin's, (2, n)."""
    jacobian = np.stack(tangents(places), axis=-1)
    return np.linalg.svd(jacobian, compute_uv=False).T[::-1]


@settings(deadline=None, max_examples=40)
@given(along=st.floats(-17.0, 19.0), share=st.floats(-1.0, 1.0))
def test_there_and_back(along, share):
    place = np.array([[along, share * float(SKIN.half_girth_mm(along))]])
    point = SKIN.points(place)
    assert abs(FINGER.level(point)[0]) < 1e-12
    found = SKIN.places(point)
    assert_allclose(SKIN.points(found), point, rtol=0, atol=1e-7)
    if abs(share) > 0.999:  # both ends of the girth are one point, the seam on the back
        place[0, 1] = np.copysign(place[0, 1], found[0, 1])
    assert_allclose(found, place, rtol=0, atol=1e-7)


def test_areas_of_the_plane_are_areas_of_all_of_the_skin():
    by_along, by_around = tangents(random_places(500, 1))
    assert_allclose(np.linalg.norm(np.cross(by_along, by_around), axis=1), 1.0, rtol=0, atol=1e-5)
    # Against the bilinear faces of a mesh, another way to the same area.
    along = np.linspace(*SKIN.ends_mm, 4001)
    unrolled_mm2 = np.trapezoid(2.0 * SKIN.half_girth_mm(along), along)
    fine = fp.Grading(17.37, 30.0, 30.0, 0.4, 0.4, 0.4, stratum_corneum=1, dermis=1, subcutis=1)
    meshed_mm2 = 2.0 * finger_mesh(FINGER, fine).skin_area_mm2.sum()
    assert_allclose(unrolled_mm2, meshed_mm2, rtol=2e-3)


def test_around_is_an_arc_where_the_finger_is_round():
    names = ("volar_readings_mm", "dorsal_readings_mm", "half_width_readings_mm")
    skin = fp.UnrolledSkin(fp.Fingertip(**dict.fromkeys(names, ROUND), spine_y_mm=-0.5, bone_height_mm=2.0))
    along, angle = np.array([-8.0, 0.0, 5.0, 12.0]), np.array([0.4, 1.2, 2.0, -3.0])
    radius = -skin.points(np.stack([along, 0.0 * along], axis=1))[:, 1]
    points = skin.points(np.stack([along, radius * angle], axis=1))
    arc = radius[:, None] * np.stack([-np.cos(angle), np.sin(angle)], axis=1)
    assert_allclose(points[:, 1:], arc, atol=1e-6)


def test_lengths_are_stretched_by_no_more_than_documented():
    inside = random_places(4000, 2)
    inside = inside[PAD.contains(inside)]
    near = np.abs(inside).max(axis=1) < 3.0
    smallest, largest = stretches(inside)
    assert len(inside) > 500
    assert smallest.min() > 0.88
    assert largest.max() < 1.12
    assert smallest[near].min() > 0.97
    assert largest[near].max() < 1.03


def test_the_pad_ends_where_its_skin_turns_aside():
    corners = SKIN.points(np.array(PAD.corners_mm))
    facing_deg = np.rad2deg(np.arccos(-FINGER.skin_normal(corners)[:, 1]))
    assert_allclose(facing_deg, PAD_FACES_DEG, rtol=0, atol=1e-3)
    assert corners[:, 0].min() >= PAD_X_MM[0] - 1e-6
    assert PAD.contains([[0.0, 0.0]]).all()
    assert not PAD.contains(SKIN.places(FINGER.skin_point([17.37], [9.0]))).any()


FLANK = Rectangle(12.0, 6.0, centre_mm=(-2.0, 12.0))
"""Beside the pad, where seen from the volar side the skin is steep: chosen to lie about the ridge."""


def flank_cells(points):
    """Number of a cell of the flank, by x and angle alone, which know nothing of the plane; -1 outside."""
    x, y, z = points.T
    angle = np.arctan2(z / FINGER.section(x)[2], -y / np.where(y < 0.0, *FINGER.section(x)[:2]))
    row, column = np.floor((x - 11.0) / 2.0).astype(int), np.floor((angle - 1.05) / 0.2).astype(int)
    return np.where((row >= 0) & (row < 4) & (column >= 0) & (column < 2), 2 * row + column, -1)


def test_random_receptors_on_the_flank_have_their_density():
    """Per area of the skin, the area being that of small flat triangles between points of the finger."""
    density = 4000.0
    points = SKIN.points(uniform(FLANK, density, seed=5).places_mm)
    counts = np.bincount(flank_cells(points)[flank_cells(points) >= 0], minlength=8)
    areas = []
    for cell in range(8):
        x = 11.0 + 2.0 * (cell // 2) + np.linspace(0.0, 2.0, 41)
        angle = 1.05 + 0.2 * (cell % 2) + np.linspace(0.0, 0.2, 41)
        volar, _, half_width = (size[:, None] for size in FINGER.section(x))
        y, z = -volar * np.cos(angle), half_width * np.sin(angle)
        grid = np.stack(np.broadcast_arrays(x[:, None], y, z), axis=-1)
        one, other = grid[1:, :-1] - grid[:-1, :-1], grid[:-1, 1:] - grid[:-1, :-1]
        areas.append(np.linalg.norm(np.cross(one, other), axis=-1).sum())
    expected = density / 100.0 * np.array(areas)
    assert expected.min() > 60.0
    low, high = poisson.interval(0.999, expected)
    assert ((counts >= low) & (counts <= high)).all()


def test_poisson_discs_keep_their_distance_on_the_skin():
    layout = fp.poisson_disc(PAD, 140.0, seed=1, place=SKIN.points)
    points = SKIN.points(layout.places_mm)
    assert cKDTree(points).query(points, k=2)[0][:, 1].min() >= 0.75 * layout.pitch_mm
    assert len(layout) == round(1.4 * PAD.area_mm2)


def test_receptors_all_over_the_pad_have_end_organs_of_their_own():
    population = fp.Population.of_layout(jittered(PAD, 100.0, seed=2), SKIN.points)
    mesh = finger_mesh(FINGER, fp.Grading(17.37, 8.0, 6.0, 0.8, 0.8))
    uv = ReceptorSheet(mesh).below(population.positions_mm)
    assert len(population) > 250
    assert len(np.unique(uv.round(6), axis=0)) == len(population)


test_what_is_no_place_is_refused = refusals(
    (lambda: fp.UnrolledSkin(origin_x_mm=40.0), ("origin_x_mm",)),
    (lambda: SKIN.points([[25.0, 0.0]]), "must lie on the finger, along within"),
    (lambda: SKIN.points([[0.0, 0.0], [0.0, 27.0]]), "got along = 0, around = 27 mm"),
    (lambda: SKIN.points([[0.0, 0.0, 0.0]]), "two columns"),
    (lambda: SKIN.places([[0.0, 0.0]]), "three columns"),
    (lambda: SKIN.places([[-3.0, 5.0, 0.0]]), "x of points_mm must lie within"),
    (lambda: SKIN.pad(x_mm=(26.0, 8.0)), "x_mm must increase"),
    (lambda: SKIN.pad(x_mm=(8.0, 40.0)), "x_mm must be two ends within"),
    (lambda: SKIN.pad(faces_deg=0.0), ("faces_deg",)),
    (lambda: SKIN.pad(x_mm=(30.0, 31.0), faces_deg=10.0), "is within 10 degrees of the volar direction"),
)  # fmt: skip
