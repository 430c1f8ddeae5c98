import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st
from numpy.testing import assert_allclose, assert_array_equal
from scipy.spatial import cKDTree

from fingerpad import Ellipse, Population, hexagonal, poisson_disc
from fingerpad.core.regions import jittered, rectangular, uniform
from fingerpad.psychophysics.encoding import (
    delaunay_pairs,
    distance,
    gradient_sum,
    neighbour_pairs,
    neighbours_of,
)
from refusals import refusals

GRID = Population.grid()
EIGHT = neighbour_pairs(GRID.positions_mm, GRID.pitch_mm, 8)


def printed_gradient_sum(table, steps):
    """Steps (b) and (c) as printed: element by element over a table of rows and columns."""
    rows, columns = table.shape
    total = 0.0
    for row in range(rows):
        for column in range(columns):
            for down, right in steps:
                if 0 <= row + down < rows and 0 <= column + right < columns:
                    total += abs(table[row, column] - table[row + down, column + right])
    return total


FOUR_STEPS = [(-1, 0), (1, 0), (0, -1), (0, 1)]
EIGHT_STEPS = [*FOUR_STEPS, (-1, -1), (-1, 1), (1, -1), (1, 1)]


@pytest.mark.parametrize(("count", "steps"), [(4, FOUR_STEPS), (8, EIGHT_STEPS)])
@settings(max_examples=20, deadline=None)
@given(st.integers(1, 4), st.integers(1, 5), st.sampled_from([70.0, 100.0]), st.integers(0, 1000))
def test_gradient_sum_is_the_printed_one(count, steps, rows, columns, density, seed):
    population = Population.grid(density, rows, columns)
    values = np.random.default_rng(seed).uniform(0.0, 100.0, (3, rows * columns))
    pairs = neighbour_pairs(population.positions_mm, population.pitch_mm, count)
    expected = [printed_gradient_sum(row.reshape(rows, columns), steps) for row in values]
    assert_allclose(gradient_sum(values, pairs), expected, rtol=1e-12, atol=1e-12)


def test_neighbours_survive_a_small_jitter_and_ignore_the_order_of_receptors():
    rng = np.random.default_rng(5)
    jittered = GRID.positions_mm + rng.uniform(-0.1, 0.1, (18, 2))
    assert_array_equal(neighbour_pairs(jittered, GRID.pitch_mm), EIGHT)
    order = rng.permutation(18)
    values = rng.uniform(size=18)
    shuffled = neighbour_pairs(GRID.positions_mm[order], GRID.pitch_mm)
    assert_allclose(gradient_sum(values[order], shuffled), gradient_sum(values, EIGHT), rtol=1e-13)


def test_distances_are_the_two_norms_and_leading_axes_are_populations():
    first, second = np.random.default_rng(4).uniform(size=(2, 5, 18))
    assert_allclose(distance(first, second), np.linalg.norm(first - second, ord=1, axis=1), rtol=1e-13)
    assert_allclose(distance(first, second, "euclidean"), np.linalg.norm(first - second, axis=1), rtol=1e-13)
    values = np.random.default_rng(2).uniform(size=(2, 3, 18))
    sums = gradient_sum(values, EIGHT)
    assert sums.shape == distance(values, values[:, :1]).shape == (2, 3)
    assert_allclose(sums[1, 2], gradient_sum(values[1, 2], EIGHT), rtol=1e-14)


test_what_cannot_be_used_is_refused = refusals(
    (lambda: neighbour_pairs([[0.0, 0.0]], 1.0, count=5), ("count",)),
    (lambda: neighbour_pairs([[0.0, 0.0, 0.0]], 1.0), "rows of two numbers"),
    (lambda: neighbour_pairs([[0.0, 0.0]], 0.0), ("pitch_mm",)),
    (lambda: gradient_sum(np.ones(17), EIGHT), "neighbours must be within 0 ... 16"),
    (lambda: gradient_sum(np.ones(2), [[0, -1]]), "neighbours must be within"),
    (lambda: gradient_sum(np.ones(2), [[0.0, 1.0]]), "rows of two receptor indices"),
    (lambda: distance(np.ones(2), np.ones(2), "manhattan"), ("norm",)),
    (lambda: delaunay_pairs([[0.0, 0.0], [1.0, 0.0]], 1.0), "not on one line: got 2"),
    (lambda: delaunay_pairs([[0.0, 0.0], [1.0, 0.0], [2.0, 0.0]], 1.0), "not on one line: got 3"),
    (lambda: delaunay_pairs(np.ones((4, 3)), 1.0), "rows of two numbers"),
    (lambda: neighbours_of([[0.0, 0.0]], 1.0, "square"), ("pattern",)),
)  # fmt: skip


DISC = Ellipse(6.0, 6.0, (17.0, 0.0))
"""Region of random and hexagonal layouts; inner receptors lie well inside it."""


def test_inner_receptors_of_a_hexagonal_layout_have_six_neighbours_one_pitch_away():
    layout = hexagonal(DISC, 100.0)
    pairs = neighbours_of(layout.places_mm, layout.pitch_mm, layout.pattern)
    first, second = layout.places_mm[pairs.T]
    assert_allclose(np.linalg.norm(first - second, axis=1), layout.pitch_mm, rtol=1e-12)
    assert delaunay_pairs([[0.0, 0.0], [1.0, 0.2], [0.3, 0.9]], 1.0).tolist() == [[0, 1], [0, 2], [1, 2]]
    square = rectangular(DISC, 100.0)
    pairs_of_square = neighbours_of(square.places_mm, square.pitch_mm, "rectangular")
    assert_array_equal(pairs_of_square, neighbour_pairs(square.places_mm, square.pitch_mm, 8))
    inner = np.linalg.norm(layout.places_mm - DISC.centre_mm, axis=1) < 4.5
    assert (np.bincount(pairs.ravel(), minlength=len(layout))[inner] == 6).all()


@pytest.mark.parametrize(
    "layout",
    [uniform(DISC, 100.0, 1), jittered(DISC, 100.0, 1), poisson_disc(DISC, 100.0, 1)],
    ids=lambda layout: layout.pattern,
)
def test_neighbours_of_random_layouts_share_a_border_of_their_cells(layout):
    """Points strewn densely: where the two nearest receptors are known, those two are neighbours."""
    pairs = neighbours_of(layout.places_mm, layout.pitch_mm, layout.pattern)
    assert_array_equal(pairs, np.unique(np.sort(pairs, axis=1), axis=0))
    known = set(map(tuple, pairs.tolist()))
    probes = uniform(Ellipse(4.0, 4.0, (17.0, 0.0)), 5000.0, 2).places_mm
    nearest = np.sort(cKDTree(layout.places_mm).query(probes, k=2)[1], axis=1)
    assert set(map(tuple, nearest.tolist())) <= known
    first, second = layout.places_mm[pairs.T]
    assert np.linalg.norm(first - second, axis=1).max() <= 3.0 * layout.pitch_mm
    inner = np.linalg.norm(layout.places_mm - DISC.centre_mm, axis=1) < 4.0
    # Euler: inside a triangulation every corner has six neighbours on average.
    assert abs(np.bincount(pairs.ravel(), minlength=len(layout))[inner].mean() - 6.0) < 0.35
