"""Regions: their areas in closed form, and their points against chance."""

import math

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from fingerpad import Ellipse
from fingerpad.core.regions import Polygon, Rectangle
from refusals import refusals

L_SHAPE = Polygon(((0.0, 0.0), (4.0, 0.0), (4.0, 1.0), (1.0, 1.0), (1.0, 3.0), (0.0, 3.0)))
REGIONS = [
    Rectangle(3.0, 5.0, (17.0, -1.0)),
    Ellipse(3.0, 1.0, (2.0, 2.0)),
    L_SHAPE,
    Polygon(L_SHAPE.corners_mm[::-1]),
]


@pytest.mark.parametrize("region", REGIONS)
def test_a_region_holds_the_share_of_its_bounds_that_is_its_area_and_nothing_outside(region):
    lower, upper = np.array(region.bounds_mm)
    points = lower + (upper - lower) * np.random.default_rng(0).random((20_000, 2))
    share = region.area_mm2 / np.prod(upper - lower)
    spread = math.sqrt(share * (1.0 - share) / len(points))
    assert abs(region.contains(points).mean() - share) <= 4.0 * spread
    beyond = np.array([[0.01, 0.0], [0.0, 0.01]])
    assert not region.contains(np.concatenate([lower - beyond, upper + beyond])).any()


def test_areas_in_closed_form():
    assert Rectangle(3.0, 5.0).area_mm2 == 15.0
    assert Ellipse(3.0, 1.0).area_mm2 == pytest.approx(3.0 * math.pi, rel=1e-15)
    assert L_SHAPE.area_mm2 == 6.0


@settings(deadline=None, max_examples=60)
@given(
    radii=st.lists(st.floats(0.5, 3.0), min_size=3, max_size=12),
    turn=st.floats(-3.0, 3.0),
    shift=st.tuples(st.floats(-20.0, 20.0), st.floats(-20.0, 20.0)),
)
def test_a_star_holds_what_its_triangles_hold(radii, turn, shift):
    """Cut into triangles about its middle: area and points of each, by barycentric coordinates."""
    angles = turn + 2.0 * math.pi * np.arange(len(radii)) / len(radii)
    corners = np.array(radii)[:, None] * np.stack([np.cos(angles), np.sin(angles)], axis=1)
    star = Polygon(tuple(map(tuple, corners + shift)))
    points = np.random.default_rng(1).uniform(-3.0, 3.0, (200, 2))
    area, held = 0.0, np.zeros(len(points), dtype=bool)
    for a, b in zip(corners, np.roll(corners, -1, axis=0), strict=True):
        area += 0.5 * (a[0] * b[1] - a[1] * b[0])
        share = np.linalg.solve(np.column_stack([a, b]), points.T)
        held |= (share >= 0.0).all(axis=0) & (share.sum(axis=0) <= 1.0)
    assert star.area_mm2 == pytest.approx(area, rel=1e-9)
    assert (star.contains(points + shift) != held).sum() <= 1  # a point on an edge may fall either way


test_what_is_no_region_is_refused = refusals(
    (lambda: Rectangle(0.0, 1.0), ("length_mm",)),
    (lambda: Rectangle(1.0, 1.0, (0.0, 0.0, 0.0)), ("centre_mm",)),
    (lambda: Ellipse(1.0, -1.0), ("semi_width_mm",)),
    (lambda: Polygon(((0.0, 0.0), (1.0, 0.0))), "three pairs or more"),
    (lambda: Polygon(((0.0, 0.0), (1.0, 1.0), (2.0, 2.0))), "must enclose an area"),
    (lambda: Polygon(((0.0, 0.0), (2.0, 2.0), (2.0, 0.0), (0.0, 1.0))), "corners 0 and 2 do"),
    (lambda: Polygon(((0.0, 0.0), (np.nan, 1.0), (2.0, 2.0))), ("corners_mm", 1, 0)),
    (lambda: L_SHAPE.contains([[0.0, 0.0, 0.0]]), "two columns"),
)  # fmt: skip
