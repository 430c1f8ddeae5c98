"""Profiles of likelihoods known in closed form; an end that is not reached is reported as open."""

import numpy as np
import pytest

from fingerpad.inference.fitting.profile_likelihood import profile_likelihoods
from refusals import refusals

COVARIANCE = np.array([[1.0, 1.2], [1.2, 4.0]])
CENTRE = np.array([2.0, -3.0])
NAMES = ("a", "b")


def normal(points):
    offsets = points - CENTRE
    return 5.0 - 0.5 * np.einsum("ni,ij,nj->n", offsets, np.linalg.inv(COVARIANCE), offsets)


@pytest.fixture(scope="module")
def found():
    return profile_likelihoods(normal, [2.5, -2.0], [1.0, 2.0], NAMES)


def test_a_normal_likelihood_has_its_marginal_intervals(found):
    for index, profile in enumerate(found):
        np.testing.assert_allclose(profile.points[profile.losses.argmin()], CENTRE, atol=0.1)
        deviation = np.sqrt(COVARIANCE[index, index])
        exact = CENTRE[index] + 1.96 * deviation * np.array([-1.0, 1.0])
        np.testing.assert_allclose(profile.interval, exact, atol=0.08 * deviation)
        # The others take their best values: those on the regression line.
        other = 1 - index
        slope = COVARIANCE[0, 1] / COVARIANCE[index, index]
        line = CENTRE[other] + slope * (profile.values - CENTRE[index])
        np.testing.assert_allclose(profile.points[:, other], line, atol=0.2)
        losses = 0.5 * ((profile.values - CENTRE[index]) / deviation) ** 2
        np.testing.assert_allclose(profile.losses, losses, atol=0.05)
        assert (np.diff(profile.values) > 0.0).all()


def test_the_level_sets_the_width(found):
    narrow = profile_likelihoods(normal, [2.5, -2.0], [1.0, 2.0], NAMES, level=0.68)
    widths = [np.diff(profiles[0].interval)[0] for profiles in (narrow, found)]
    assert widths[0] / widths[1] == pytest.approx(0.9945 / 1.96, rel=0.05)


def test_a_side_that_the_data_do_not_bound_is_open():
    """A likelihood that levels off above: large values of a are all alike."""

    def saturating(points):
        a, b = points.T
        return -8.0 * np.where(a < 0.0, a**2, 0.0) - 0.5 * (b - 1.0) ** 2

    profile = profile_likelihoods(saturating, [0.5, 1.0], [1.0, 1.0], NAMES)[0]
    assert profile.interval[0] == pytest.approx(-0.49, abs=0.08)
    assert profile.interval[1] == np.inf


def test_a_better_fit_met_on_the_way_is_the_measure_of_all():
    """Two lumps; the search begins at the lower one."""

    def lumps(points):
        a, b = points.T
        shape = np.logaddexp(-0.5 * ((a + 2.0) / 0.6) ** 2, 2.0 - 0.5 * ((a - 1.0) / 0.6) ** 2)
        return shape - 0.5 * b**2

    found = profile_likelihoods(lumps, [-2.0, 0.0], [1.0, 1.0], NAMES)
    assert found[0].points[found[0].losses.argmin(), 0] == pytest.approx(1.0, abs=0.1)
    assert all(profile.losses.min() >= 0.0 for profile in found)
    low, high = found[0].interval
    # The lower lump, 2 below, lies just outside of 1.92.
    assert low > -1.0
    assert high == pytest.approx(1.0 + 0.6 * 1.96, abs=0.15)


def test_several_starts_find_what_a_neighbour_does_not():
    """Two ridges along a: the higher one changes at a = 0.5, and no climb leads from one to the other."""

    def ridges(points):
        a, b = points.T
        low = -0.5 * (a + 0.5) ** 2 - 50.0 * (b + 3.0) ** 2
        high = -0.5 * (a - 1.5) ** 2 - 50.0 * (b - 3.0) ** 2
        return np.maximum(low, high)

    starts = [[0.0, -3.0], [1.0, 3.0], [-1.0, -3.1], [2.0, 3.1]]
    found = [profile_likelihoods(ridges, points, [1.0, 0.1], NAMES) for points in (starts[0], starts)]
    one, many = (each[0] for each in found)
    np.testing.assert_allclose(one.interval, [-0.5 - 1.96, -0.5 + 1.96], atol=0.1)
    np.testing.assert_allclose(many.interval, [-0.5 - 1.96, 1.5 + 1.96], atol=0.1)


PROFILED = {"log_likelihood": normal, "starts": CENTRE, "scales": [1.0, 2.0], "names": NAMES}

test_what_cannot_be_profiled_is_refused = refusals(
    ({"log_likelihood": lambda points: np.full(len(points), -np.inf)}, "must be finite at a start"),
    ({"log_likelihood": lambda points: np.full(len(points), np.nan)}, "it is NaN at"),
    call=lambda changes: profile_likelihoods(**(PROFILED | changes)),
)
