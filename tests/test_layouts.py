"""Layouts: pitches and densities in closed form, distances, and statistics of random ones."""

import math

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st
from numpy.testing import assert_allclose, assert_array_equal
from scipy.stats import chisquare, kstest

from fingerpad import Ellipse, Population, hexagonal, poisson_disc
from fingerpad.core.regions import (
    MOST_RECEPTORS,
    PATTERNS,
    Layout,
    Polygon,
    Rectangle,
    jittered,
    rectangular,
    uniform,
)
from refusals import refusals

PAD = Ellipse(6.0, 5.0, (17.0, 0.5))
MAKERS = {
    "rectangular": rectangular,
    "hexagonal": hexagonal,
    "uniform": lambda region, density: uniform(region, density, seed=3),
    "jittered": lambda region, density: jittered(region, density, seed=3),
    "poisson-disc": lambda region, density: poisson_disc(region, density, seed=3),
}


@settings(deadline=None, max_examples=25)
@given(
    pattern=st.sampled_from(PATTERNS),
    density=st.floats(20.0, 400.0),
    semi_axes=st.tuples(st.floats(3.0, 8.0), st.floats(3.0, 8.0)),
    centre=st.tuples(st.floats(-20.0, 20.0), st.floats(-20.0, 20.0)),
)
def test_every_layout_has_its_density_and_stays_in_its_region(pattern, density, semi_axes, centre):
    region = Ellipse(*semi_axes, centre)
    layout = MAKERS[pattern](region, density)
    assert region.contains(layout.places_mm).all()
    expected = density * region.area_mm2 / 100.0
    if pattern in ("uniform", "poisson-disc"):
        assert len(layout) == round(expected)
    else:  # cells along the rim may count or not: a band half a pitch wide
        rim = 2.0 * math.pi * max(semi_axes) / layout.pitch_mm
        assert abs(len(layout) - expected) <= 0.5 * rim


def test_a_rectangle_of_whole_pitches_holds_the_papers_grid():
    centre = (17.37, 0.0)
    layout = rectangular(Rectangle(3.0, 6.0, centre), 100.0)
    paper = Population.grid()
    assert_allclose(layout.places_mm, paper.positions_mm, rtol=0, atol=1e-12)
    assert layout.pitch_mm == paper.pitch_mm
    assert_array_equal(Population.of_layout(layout).positions_mm, layout.places_mm)
    assert tuple(MAKERS) == PATTERNS
    assert [make(PAD, 70.0).pattern for make in MAKERS.values()] == list(PATTERNS)


def test_uniform_places_are_as_likely_anywhere():
    layout = uniform(Ellipse(5.0, 5.0), 6000.0, seed=11)
    x, z = layout.places_mm.T
    # Rings of equal area by sectors of equal angle: 48 cells of the same size.
    ring = np.minimum((4 * (x**2 + z**2) / 25.0).astype(int), 3)
    sector = np.minimum(((np.arctan2(z, x) + np.pi) / (2.0 * np.pi) * 12).astype(int), 11)
    counts = np.bincount(12 * ring + sector, minlength=48)
    assert chisquare(counts).pvalue > 0.01
    assert np.abs(np.corrcoef(x[:-1], x[1:])[0, 1]) < 4.0 / math.sqrt(len(layout))


def test_jitter_has_its_spread_and_none_leaves_the_lattice():
    square = rectangular(PAD, 1000.0)
    assert_array_equal(jittered(PAD, 1000.0, seed=5, jitter=0.0).places_mm, square.places_mm)
    strayed = (jittered(PAD, 1000.0, seed=5, jitter=0.3).places_mm - square.places_mm) / square.pitch_mm
    inner = PAD.contains(square.places_mm + np.sign(square.places_mm - PAD.centre_mm))
    numbers = strayed[inner].ravel() / 0.3
    assert kstest(numbers, "norm").pvalue > 0.01
    assert abs(numbers.std() - 1.0) < 4.0 / math.sqrt(2.0 * numbers.size)


def test_poisson_discs_are_those_of_one_dart_after_the_other():
    """Slow reference: each candidate against all that were kept before it."""
    batches = []

    def recorded(places):
        batches.append(places)
        return places

    layout = poisson_disc(PAD, 100.0, seed=9, place=recorded, separation=0.6)
    kept: list[np.ndarray] = []
    for dart in np.concatenate(batches):
        if all(np.linalg.norm(dart - other) >= 0.6 * layout.pitch_mm for other in kept):
            kept.append(dart)
    assert_array_equal(layout.places_mm, kept[: len(layout)])


@pytest.mark.parametrize(
    "make", [lambda seed: uniform(PAD, 70.0, seed), lambda seed: jittered(PAD, 70.0, seed),
             lambda seed: poisson_disc(PAD, 70.0, seed)],
)  # fmt: skip
def test_the_seed_decides(make):
    first, same, other = make(4), make(4), make(5)
    assert first.seed == 4
    assert_array_equal(first.places_mm, same.places_mm)
    assert not np.isin(first.places_mm[:, 0], other.places_mm[:, 0]).any()
    few, many = uniform(Rectangle(10.0, 10.0), 50.0, 1), uniform(Rectangle(10.0, 10.0), 90.0, 1)
    assert_array_equal(many.places_mm[: len(few)], few.places_mm)  # the others keep their places


THIN_CORNER = Polygon(((0, 0), (100, 0), (100, 0.02), (0.02, 0.02), (0.02, 100), (0, 100)))


test_what_cannot_be_laid_out_is_refused = refusals(
    (lambda: rectangular(PAD, 0.0), "density_per_cm2 must be greater than 0"),
    (lambda: hexagonal(PAD, math.inf), "density_per_cm2 must be a finite number"),
    (lambda: uniform(Rectangle(0.1, 0.1), 10.0, 1), "gives no receptor"),
    (lambda: poisson_disc(PAD, 1e7, 1), f"A layout may have {MOST_RECEPTORS:,} receptors"),
    (lambda: rectangular(THIN_CORNER, 100.0), "No receptor of a rectangular lattice"),
    (lambda: uniform(PAD, 70.0, -1), ("seed",)),
    (lambda: jittered(PAD, 70.0, 1, jitter=-0.1), ("jitter",)),
    (lambda: poisson_disc(PAD, 70.0, 1, separation=0.9), ("separation",)),
    (lambda: Layout(np.empty((0, 2)), 1.0, "uniform"), "rows of two numbers"),
    (lambda: Layout([[0.0, 1.0]], 0.0, "uniform"), ("pitch_mm",)),
)  # fmt: skip
