"""The skin beside the nail: distances, areas, rows, and end organs below them."""

from dataclasses import replace

import numpy as np
import pytest
from numpy.testing import assert_allclose, assert_array_equal
from scipy.spatial import cKDTree

from fingerpad import Fingertip, Population
from fingerpad.core.regions import uniform
from fingerpad.geometry.grading import resolution_grading
from fingerpad.geometry.mesh import finger_mesh
from fingerpad.skin.receptor_sheet import ReceptorSheet
from fingerpad.skin.unrolled_skin import NailEdge
from refusals import refusals

NAIL = NailEdge()
FINGER = NAIL.finger
(PROXIMAL_MM, DISTAL_MM), HALF_WIDTH_MM = FINGER.nail_x_mm, FINGER.nail_half_width_mm


def random_places(count, seed):
    rng = np.random.default_rng(seed)
    distance = rng.uniform(0.1, 3.9, count)
    return np.stack([rng.uniform(-1.0, 1.0, count) * (NAIL.half_length_mm(distance) - 0.1), distance], axis=1)


def edge():
    """Points of the nail's outline, without its proximal end."""
    x, z = np.linspace(PROXIMAL_MM, DISTAL_MM, 400), np.linspace(-HALF_WIDTH_MM, HALF_WIDTH_MM, 400)
    sides = [np.stack([x, np.full(400, side * HALF_WIDTH_MM)], axis=1) for side in (-1.0, 1.0)]
    outline = np.concatenate([*sides, np.stack([np.full(400, DISTAL_MM), z], axis=1)])
    _, dorsal, half_width = FINGER.section(outline[:, 0])
    height = dorsal * np.sqrt(1.0 - (outline[:, 1] / half_width) ** 2)
    return np.stack([outline[:, 0], height, outline[:, 1]], axis=1)


def test_places_are_on_the_skin_beside_the_nail_mirrored_left_and_right():
    points = NAIL.points(random_places(500, 1))
    assert np.abs(FINGER.level(points)).max() < 1e-12
    assert not FINGER.is_under_nail(points).any()
    places = random_places(100, 4)
    assert_array_equal(NAIL.points(places * [-1.0, 1.0]), NAIL.points(places) * [1.0, 1.0, -1.0])


def test_the_edge_itself_is_the_nails_outline_and_distance_is_counted_from_it():
    along = np.linspace(-1.0, 1.0, 41) * NAIL.half_length_mm(0.0)
    points = NAIL.points(np.stack([along, 0.0 * along], axis=1))
    assert cKDTree(edge()).query(points)[0].max() < 0.03
    assert_allclose(points[[0, -1]][:, [0, 2]], [[PROXIMAL_MM, -HALF_WIDTH_MM], [PROXIMAL_MM, HALF_WIDTH_MM]])
    # Straight lines are a little shorter than those of the skin: by d^3/(24 R^2), R being 2 mm or more.
    places = random_places(500, 2)
    straight_mm = cKDTree(edge()).query(NAIL.points(places))[0]
    distance = places[:, 1]
    assert (straight_mm < distance + 0.005).all()
    assert (straight_mm > distance - distance**3 / (24.0 * 2.0**2) - 0.01).all()


def test_areas_of_the_plane_are_areas_of_the_skin():
    places, step = random_places(1000, 3), 1e-3
    along, away = (
        (NAIL.points(places + move) - NAIL.points(places - move)) / (2.0 * step) for move in step * np.eye(2)
    )
    assert_allclose(np.linalg.norm(np.cross(along, away), axis=1), 1.0, rtol=0, atol=0.01)
    assert_allclose(np.linalg.norm(along, axis=1), 1.0, rtol=0, atol=0.01)


@pytest.mark.parametrize("density", [50.0, 100.0, 200.0])
def test_rows_go_around_the_nail_a_pitch_apart(density):
    rows = NAIL.rows(2, density)
    points, pitch = NAIL.points(rows.places_mm), rows.pitch_mm
    assert pitch == pytest.approx(10.0 / np.sqrt(density), rel=1e-14)
    assert_allclose(np.unique(rows.places_mm[:, 1].round(12)), [0.5 * pitch, 1.5 * pitch], rtol=1e-9)
    nearest = cKDTree(points).query(points, k=2)[0][:, 1]
    assert nearest.min() > 0.8 * pitch  # lines of a row and straight lines, and rows that are not in step
    assert nearest.max() < 1.03 * pitch
    area = NAIL.region(2.0 * pitch).area_mm2
    assert len(rows) == pytest.approx(density * area / 100.0, abs=2.0)
    assert (points[:, 2] > 1e-9).sum() == (points[:, 2] < -1e-9).sum()


def test_receptors_beside_the_nail_have_their_density_and_end_organs():
    strip = NAIL.region(3.0)
    layout = uniform(strip, 100.0, seed=6)
    assert len(layout) == round(strip.area_mm2)
    assert not FINGER.is_under_nail(NAIL.points(layout.places_mm)).any()
    population = Population.of_layout(NAIL.rows(2, 100.0), NAIL.points)
    sheet = ReceptorSheet(finger_mesh(FINGER, resolution_grading("quick", 17.37)))
    assert len(np.unique(sheet.below(population.positions_mm).round(6), axis=0)) == len(population) // 2 + 1


test_what_is_not_beside_the_nail_is_refused = refusals(
    (lambda: NailEdge(reach_mm=0.0), ("reach_mm",)),
    (lambda: NailEdge(replace(Fingertip(), nail_half_width_mm=9.0)), "must leave skin beside it"),
    (lambda: NAIL.points([[0.0, 4.5]]), "within 4 mm of the edge of the nail"),
    (lambda: NAIL.points([[0.0, 1.0], [30.0, 1.0]]), "got along = 30, distance = 1 mm"),
    (lambda: NAIL.points([[0.0, 1.0, 2.0]]), "two columns"),
    (lambda: NAIL.region(5.0), ("width_mm",)),
    (lambda: NAIL.rows(0, 100.0), ("count",)),
    (lambda: NAIL.rows(9, 100.0), "last row must not exceed the reach"),
    (lambda: NAIL.rows(1, 0.0), ("density_per_cm2",)),
)  # fmt: skip
