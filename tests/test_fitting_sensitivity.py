"""Sobol indices of a function whose indices are known."""

import numpy as np
import pytest

from fingerpad.inference.fitting.sensitivity import sobol_indices
from refusals import refusals


def ishigami(points):
    """Ishigami's function with 7 and 0.1: indices in closed form (Ishigami & Homma 1990)."""
    x, y, z = points.T
    return np.sin(x) + 7.0 * np.sin(y) ** 2 + 0.1 * z**4 * np.sin(x)


def closed_form():
    a, b = 7.0, 0.1
    alone = np.array([0.5 * (1.0 + b * np.pi**4 / 5.0) ** 2, a**2 / 8.0, 0.0])
    together = 8.0 * b**2 * np.pi**8 / 225.0
    variance = alone.sum() + together
    return alone / variance, (alone + together * np.array([1.0, 0.0, 1.0])) / variance, variance


def test_indices_of_ishigamis_function_lie_within_their_confidence():
    found = sobol_indices(ishigami, [-np.pi] * 3, [np.pi] * 3, seed=1, n_base=1024)
    first, total, variance = closed_form()
    np.testing.assert_allclose(found.first, first, atol=0.05)
    np.testing.assert_allclose(found.total, total, atol=0.05)
    assert (np.abs(found.first - first) <= 1.5 * found.first_half_width).all()
    assert (np.abs(found.total - total) <= 1.5 * found.total_half_width).all()
    assert found.standard_deviation == pytest.approx(np.sqrt(variance), rel=0.03)
    assert found.mean == pytest.approx(3.5, abs=0.1)
    assert found.evaluations == 5 * 1024


def test_the_seed_fixes_the_numbers_and_nothing_global_is_drawn():
    before = np.random.get_state()[1].copy()  # noqa: NPY002
    first, again, other = (
        sobol_indices(ishigami, [-np.pi] * 3, [np.pi] * 3, seed=seed, n_base=64) for seed in (0, 0, 1)
    )
    np.testing.assert_array_equal(first.total, again.total)
    np.testing.assert_array_equal(first.total_half_width, again.total_half_width)
    assert not np.array_equal(first.total, other.total)
    np.testing.assert_array_equal(before, np.random.get_state()[1])  # noqa: NPY002


def plane(**changes):
    given = {"objective": lambda points: points.sum(axis=1), "seed": 1, "n_base": 64}
    return sobol_indices(**(given | {"lower": [0.0, 0.0], "upper": [1.0, 1.0]} | changes))


test_what_has_no_indices_is_refused = refusals(
    ({"objective": lambda points: np.ones(len(points))}, "it is constant"),
    ({"objective": lambda points: np.full(len(points), np.nan)}, "objective must hold finite numbers"),
    call=lambda changes: plane(**changes),
)


def test_a_parameter_without_effect_has_indices_of_0_with_certainty():
    found = sobol_indices(lambda p: p[:, 0] ** 2, [0.0, 5.0], [1.0, 6.0], seed=3, n_base=64)
    np.testing.assert_array_equal([found.first[1], found.total[1]], 0.0)
    np.testing.assert_array_equal([found.first_half_width[1], found.total_half_width[1]], 0.0)
    assert found.first[0] == pytest.approx(1.0, abs=0.05)
    assert found.first_half_width[0] > 0.0
