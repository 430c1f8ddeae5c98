"""Likelihood of rates against numerical integration."""

import numpy as np
import pytest
from scipy.integrate import quad
from scipy.special import gammaln, logsumexp

from fingerpad import RateRecordings
from fingerpad.inference.rate_posterior import CorrelatedResiduals, RateLikelihood
from refusals import refusals

PLACES = np.array([-1.0, -0.4, 0.0, 0.6, 1.5])
STIMULI = ("a", "b", "c", "d", "e")
OBSERVED = {
    "dynamic": np.array([90.0, 140.0, 120.0, 60.0, 10.0]),
    "static": np.array([5.0, 30.0, 20.0, 8.0, 0.0]),
}

INDEPENDENT = CorrelatedResiduals(5, deviation=7.0)


class Scaled:
    """Predicts a multiple of fixed shapes."""

    names = ("height",)
    n_stimuli = 5

    def evaluate(self, parameters):
        shapes = [[100.0, 130.0, 110.0, 70.0, 0.0], [8.0, 25.0, 22.0, 6.0, 1.0]]
        return tuple(parameters[0] * np.array(shapes))


def recordings(*phases):
    return RateRecordings(STIMULI, *(OBSERVED[phase] if phase in phases else None for phase in OBSERVED))


def integrated(residuals, length_mm, deviation_hz):
    """Log of the integral over sigma of prior times normal density, by quadrature."""
    n = residuals.size
    distances = np.abs(PLACES[:, None] - PLACES)
    correlation = np.exp(-distances / length_mm) if length_mm else np.eye(n)
    quadratic = residuals @ np.linalg.solve(correlation, residuals)

    def integrand(log_variance):
        variance = np.exp(log_variance)
        # Scaled inverse chi-square with one degree of freedom, in the logarithm of the variance.
        prior = 0.5 * np.log(deviation_hz**2 / (2.0 * variance)) - deviation_hz**2 / (2.0 * variance)
        normal = -0.5 * (n * np.log(2.0 * np.pi * variance) + quadratic / variance)
        return np.exp(prior - gammaln(0.5) + normal - 0.5 * np.linalg.slogdet(correlation)[1] + 20.0)

    return float(np.log(quad(integrand, -5.0, 25.0, epsabs=0.0, epsrel=1e-10, limit=400)[0]) - 20.0)


@pytest.mark.parametrize("phases", [("dynamic",), ("static",), ("dynamic", "static")])
def test_differences_of_log_likelihood_are_those_of_the_integral(phases):
    lengths = (0.0, 0.5, 1.2)
    likelihood = RateLikelihood(Scaled(), recordings(*phases), CorrelatedResiduals(5, PLACES, lengths, 7.0))
    heights = np.array([[0.5], [0.95], [1.3]])
    expected, independent = [], []
    for height in heights:
        predicted = dict(zip(OBSERVED, Scaled().evaluate(height), strict=True))
        by_length = np.array(
            [
                [integrated(OBSERVED[phase] - predicted[phase], each, 7.0) for each in lengths]
                for phase in phases
            ]
        )
        expected.append(logsumexp(by_length, axis=1).sum())
        independent.append(by_length[:, 0].sum())
    found = likelihood.log_likelihood(heights)
    np.testing.assert_allclose(np.diff(found), np.diff(expected), rtol=1e-7)
    # The constant is the same without correlation: the difference is evidence.
    alone = RateLikelihood(Scaled(), recordings(*phases), INDEPENDENT).log_likelihood(heights)
    shared = len(phases) * np.log(len(lengths))
    np.testing.assert_allclose(found - alone, np.array(expected) - shared - independent, rtol=1e-6)


def test_residual_draws_have_the_conditional_law():
    """Without correlation sigma^2 is a scaled inverse chi-square; its mean is known."""
    likelihood = RateLikelihood(Scaled(), recordings("dynamic", "static"), INDEPENDENT)
    points = np.full((20000, 1), 0.95)
    draws = likelihood.residual_draws(points, np.random.default_rng(1))
    for phase, predicted in zip(("dynamic", "static"), Scaled().evaluate(points[0]), strict=True):
        squares = ((OBSERVED[phase] - predicted) ** 2).sum()
        assert draws[phase].length_mm.max() == 0.0
        np.testing.assert_array_equal(draws[phase].predicted_hz[0], predicted)
        # Mean of the inverse, which has all moments: chi-square over its scale.
        assert (draws[phase].deviation_hz ** -2.0).mean() == pytest.approx(6.0 / (49.0 + squares), rel=0.03)
        spread = (draws[phase].new_hz[:, 1] - predicted[1]) / draws[phase].deviation_hz
        assert spread[draws[phase].new_hz[:, 1] > 0.0].std() == pytest.approx(1.0, rel=0.1)
        assert draws[phase].new_hz.min() >= 0.0


def test_lengths_are_drawn_by_their_shares_of_the_likelihood():
    lengths = (0.0, 0.8)
    likelihood = RateLikelihood(Scaled(), recordings("dynamic"), CorrelatedResiduals(5, PLACES, lengths, 7.0))
    draws = likelihood.residual_draws(np.full((20000, 1), 1.3), np.random.default_rng(2))["dynamic"]
    residuals = OBSERVED["dynamic"] - Scaled().evaluate(np.array([1.3]))[0]
    logarithms = np.array([integrated(residuals, length, 7.0) for length in lengths])
    share = np.exp(logarithms[1] - logsumexp(logarithms))
    assert 0.1 < share < 0.9
    assert (draws.length_mm == 0.8).mean() == pytest.approx(share, abs=4.0 * np.sqrt(0.25 / 20000))


test_what_does_not_fit_together_is_refused = refusals(
    (lambda: CorrelatedResiduals(5, PLACES[:4]), "a different position for each of 5 stimuli: got 4 values"),
    (lambda: CorrelatedResiduals(5, np.zeros(5)), "got 5 values, 1 of them different"),
    (lambda: CorrelatedResiduals(5, lengths_mm=(-1.0,)), "lengths of at least 0"),
    (lambda: CorrelatedResiduals(5, deviation=0.0), ("deviation",)),
    (lambda: RateLikelihood(Scaled(), RateRecordings(("a",), [1.0], None), CorrelatedResiduals(1)),
     "got 1 for 5"),
)  # fmt: skip
