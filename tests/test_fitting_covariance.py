"""Covariance from fits that leave groups out, against closed forms and against repetition."""

import numpy as np

from fingerpad.inference.fitting.methods import jackknife_covariance


def left_out(design, observed, n_groups):
    """Least-squares fits without each of the interleaved groups."""
    groups = np.arange(len(design)) % n_groups
    return [
        np.linalg.lstsq(design[groups != group], observed[groups != group], rcond=None)[0]
        for group in range(n_groups)
    ]


def test_the_covariance_is_that_of_repeated_experiments():
    """Straight lines through noise that grows along them: mean of many jackknives, scatter of many fits."""
    random = np.random.default_rng(2)
    x = np.linspace(0.0, 1.0, 60)
    design = np.column_stack([np.ones_like(x), 1e6 * x])  # a parameter in small units changes nothing
    noise = random.normal(size=(400, x.size)) * (0.1 + x)
    fits = np.array([np.linalg.lstsq(design, one, rcond=None)[0] for one in noise])
    mean = np.mean([jackknife_covariance(left_out(design, one, 6)) for one in noise], axis=0)
    # Known to sqrt(2/400) = 0.07 from the fits; six groups of ten add a bias of about 1/10.
    np.testing.assert_allclose(mean, np.cov(fits.T), rtol=0.3)


def test_no_more_fits_than_parameters_leave_a_direction_without_width():
    estimates = np.random.default_rng(3).normal(size=(5, 4))
    assert np.linalg.matrix_rank(jackknife_covariance(estimates)) == 4
    assert jackknife_covariance(estimates[:4]) is None
