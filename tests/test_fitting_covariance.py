"""Slopes and covariance of fitted parameters, against closed forms and against repetition."""

import numpy as np
import pytest

from fingerpad.errors import InputError
from fingerpad.fitting.covariance import mean_slopes, sandwich_covariance


def test_slopes_of_a_plane_are_exact_for_any_box():
    rng = np.random.default_rng(1)
    matrix = rng.normal(size=(7, 3))
    for steps in ([1e-3, 1.0, 50.0], [2.0, 2.0, 2.0]):
        found = mean_slopes(lambda p: matrix @ p + 4.0, [1.0, -2.0, 30.0], steps)
        np.testing.assert_allclose(found, matrix, rtol=0, atol=1e-10)


def test_slopes_see_through_small_jumps():
    # Stairs of height and width 0.01 on a slope of 1 in the sum: their slope is 0 almost everywhere, and
    # over a box of side 1 the stairs are wrong by no more than one stair in each value.
    found = mean_slopes(lambda p: np.array([np.floor(p.sum() / 0.01) * 0.01]), [0.3001, 0.4], [0.5, 0.5])
    np.testing.assert_allclose(found, [[1.0, 1.0]], rtol=0, atol=0.02)


def test_the_covariance_is_that_of_repeated_experiments():
    """Straight lines through noise that grows along them, fitted 4000 times."""
    rng = np.random.default_rng(2)
    x = np.linspace(0.0, 1.0, 400)
    design = np.column_stack([np.ones_like(x), 1e6 * x])  # a parameter in small units changes nothing
    deviation = 0.1 + x
    noise = rng.normal(size=(4000, x.size)) * deviation
    fits = noise @ np.linalg.pinv(design).T
    residuals = noise[0] - design @ fits[0]
    covariance = sandwich_covariance(-design, residuals)
    # The estimate from one experiment scatters by about sqrt(2 kurtosis / n) = 0.1 about that of all.
    np.testing.assert_allclose(covariance, np.cov(fits.T), rtol=0.3)


def test_equal_weights_and_noise_give_the_textbook_formula_in_the_mean():
    design = np.ones((5, 1))
    rng = np.random.default_rng(3)
    draws = rng.normal(size=(4_000, 5))
    estimates = [sandwich_covariance(-design, draw - draw.mean())[0, 0] for draw in draws]
    # Variance 1/5; the mean of 4000 estimates, each with a spread of about 0.14, is known to 0.002.
    assert np.mean(estimates) == pytest.approx(0.2, abs=0.009)


@pytest.mark.parametrize(
    "slopes",
    [
        [[1.0, 0.0], [2.0, 0.0], [3.0, 0.0]],
        [[1.0, 2.0], [2.0, 4.0], [3.0, 6.0 + 1e-9]],
        [[1.0, 0.0], [0.0, 1.0]],
    ],
    ids=["no slope", "one direction", "no rest"],
)
def test_what_is_not_determined_has_no_covariance(slopes):
    assert sandwich_covariance(slopes, np.ones(len(slopes))) is None


@pytest.mark.parametrize(
    ("call", "said"),
    [
        (lambda: mean_slopes(lambda p: p, [1.0], [0.0]), "steps must be above 0"),
        (lambda: mean_slopes(lambda p: p, [1.0], [1.0, 1.0]), "one per parameter"),
        (lambda: sandwich_covariance([[1.0], [1.0]], [1.0]), "one row per residual: got 2 for 1"),
    ],
    ids=["no step", "steps", "residuals"],
)
def test_shapes_that_disagree_are_refused(call, said):
    with pytest.raises(InputError, match=said):
        call()
