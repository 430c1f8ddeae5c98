"""Recovery before real data: simulated afferents lie within their intervals as often as they should."""

import numpy as np
import pytest
from scipy.stats import binom, chi2

from fingerpad.errors import ConvergenceError, InputError
from fingerpad.estimation.afferent_posterior import (
    AfferentPrior,
    afferent_posterior,
    four_number_model,
    from_coordinates,
    to_coordinates,
)
from fingerpad.estimation.rate_likelihood import RateLikelihood
from fingerpad.estimation.rate_problem import AfferentModel
from fingerpad.estimation.recordings import RateRecordings
from fingerpad.fitting.posterior import credible_band
from fingerpad.signals import SedTraces
from fingerpad.transduction import drive

SHIFTS = np.linspace(0.0, 2.7, 10)
PEAKS = 0.25 + 1.6 * np.exp(-(((SHIFTS - 1.4) / 0.7) ** 2)) + 0.4 * (SHIFTS < 1.0)
TIMES = np.array([0.0, 15.0, 30.0, 40.0, 50.0, 60.0, 100.0, 200.0, 500.0, 1000.0])
COURSE = np.where(TIMES <= 50.0, (TIMES / 50.0) ** 2, 0.75 + 0.25 * np.exp(-(TIMES - 50.0) / 150.0))
MODEL = four_number_model(AfferentModel(drive(SedTraces(TIMES, COURSE[:, None] * PEAKS, [50.0]), pieces=3)))
DEVIATIONS_HZ = {"dynamic": 8.0, "static": 2.0}
PRIOR = AfferentPrior(
    resting_share_sd=0.3,
    dynamic_gain_per_kpa=5.0,
    static_gain_per_kpa_ms=0.03,
    time_constant_ms=50.0,
    gain_factor=1.5,
    time_constant_factor=1.4,
)
EFFORT = {
    "n_walkers": 40,
    "n_steps": 32,
    "most_steps": 512,
    "largest_r_hat": 1.02,
    "smallest_effective_size": 100.0,
}


def simulated(four: np.ndarray, random: np.random.Generator) -> RateRecordings:
    rates = [
        np.maximum(rate + DEVIATIONS_HZ[phase] * random.normal(size=SHIFTS.size), 0.0)
        for phase, rate in zip(DEVIATIONS_HZ, MODEL.rates(four), strict=True)
    ]
    return RateRecordings(tuple(f"{shift:g}" for shift in SHIFTS), *rates)


def test_truth_lies_within_its_intervals_as_often_as_they_say() -> None:
    """Truths drawn from the prior: of 8 afferents the 80 % intervals hold a binomial number."""
    random = np.random.default_rng(11)
    inside, distances = [], []
    for data_set in range(8):
        truth = PRIOR.centre + PRIOR.spread * random.normal(size=4)
        likelihood = RateLikelihood(MODEL, simulated(from_coordinates(truth), random), deviation_hz=4.0)
        posterior = afferent_posterior(
            likelihood, from_coordinates(truth), seed=data_set, prior=PRIOR, **EFFORT
        )
        low, high = posterior.chains.interval(0.8)
        inside.append((low <= truth) & (truth <= high))
        off = truth - posterior.chains.mean
        distances.append(off @ np.linalg.solve(posterior.chains.covariance, off))
        # The recordings taught something: intervals are narrower than the prior's.
        assert (high - low < 2.0 * 1.2816 * PRIOR.spread).all()
    counts = np.sum(inside, axis=0)
    # Outside of these numbers lies 1 % of the binomial law, for each of the four.
    assert (counts >= binom.ppf(0.005, 8, 0.8)).all()
    assert binom.ppf(0.005, 32, 0.8) <= counts.sum() <= binom.ppf(0.995, 32, 0.8)
    # Nor is the truth farther off than draws are: squared distances in the posterior's own measure.
    assert np.sum(distances) <= chi2.ppf(0.995, 32)


@pytest.fixture(scope="module")
def one_posterior():
    truth = np.array([0.012, 5.0, 0.03, 60.0])
    likelihood = RateLikelihood(MODEL, simulated(truth, np.random.default_rng(5)), SHIFTS, deviation_hz=4.0)
    return likelihood, afferent_posterior(likelihood, truth, seed=3, **EFFORT)


def test_draws_bands_and_deviations_belong_together(one_posterior) -> None:
    likelihood, posterior = one_posterior
    np.testing.assert_array_equal(posterior.four, from_coordinates(posterior.chains.flat))
    assert (posterior.four[:, 0] * posterior.four[:, 3] < 1.0).all()
    six = posterior.six(6.0e-7, 30.0)
    np.testing.assert_allclose(six[:, 0] / (6.0e-7 * 30.0), posterior.four[:, 0], rtol=1e-12)
    for phase, truth_hz in DEVIATIONS_HZ.items():
        rates = posterior.rates[phase]
        low, high = credible_band(rates.deviation_hz, 0.99)
        assert low < truth_hz < high
        observed = getattr(likelihood.recordings, f"{phase}_rate_hz")
        lower, upper = credible_band(rates.new_hz)
        assert ((lower <= observed) & (observed <= upper)).mean() >= 0.7
        assert (np.diff(credible_band(rates.predicted_hz), axis=0) <= upper - lower + 1e-9).all()


def test_the_seed_fixes_every_draw(one_posterior) -> None:
    likelihood, posterior = one_posterior
    again = afferent_posterior(likelihood, [0.012, 5.0, 0.03, 60.0], seed=3, **EFFORT)
    np.testing.assert_array_equal(again.four, posterior.four)
    np.testing.assert_array_equal(again.rates["static"].new_hz, posterior.rates["static"].new_hz)


def test_an_unconverged_posterior_is_not_returned(one_posterior) -> None:
    with pytest.raises(ConvergenceError, match="have not converged after 8 steps"):
        afferent_posterior(one_posterior[0], [0.012, 5.0, 0.03, 60.0], seed=3, n_steps=8, most_steps=8)


def test_coordinates_go_there_and_back() -> None:
    four = np.array([[0.012, 5.0, 0.03, 60.0], [-0.002, 0.1, 0.4, 20.0]])
    coordinates = to_coordinates(four)
    np.testing.assert_allclose(from_coordinates(coordinates), four, rtol=1e-14)
    np.testing.assert_allclose(coordinates[0], [0.72, np.log(5.0), np.log(0.03), np.log(60.0)], rtol=1e-14)


def test_the_prior_is_centred_on_the_papers_start_and_silent_at_rest() -> None:
    prior = AfferentPrior()
    np.testing.assert_allclose(np.exp(prior.centre[1:]), [4.8, 0.014, 68.0], rtol=1e-12)
    one_off = prior.centre + np.diag(prior.spread) * -1.0
    np.testing.assert_allclose(prior.log_density(one_off), prior.log_density(prior.centre) - 0.5, rtol=1e-12)
    fires_at_rest = prior.centre + np.eye(4)[0]
    assert prior.log_density(fires_at_rest) == -np.inf
    assert AfferentPrior(silent_at_rest=False).log_density(fires_at_rest) == pytest.approx(-0.5)


@pytest.mark.parametrize(
    ("call", "words"),
    [
        (lambda: to_coordinates([0.01, -4.0, 0.014, 68.0]), "all but the first greater than 0"),
        (lambda: to_coordinates([0.01, 4.0, 0.014]), "four must hold"),
        (lambda: AfferentPrior(gain_factor=1.0), "gain_factor must be greater than 1"),
        (lambda: AfferentPrior(time_constant_ms=0.0), "time_constant_ms must be greater than 0"),
        (
            lambda: afferent_posterior(
                RateLikelihood(
                    MODEL.model, simulated(np.array([0.01, 5.0, 0.03, 60.0]), np.random.default_rng(1))
                ),
                [0.01, 5.0, 0.03, 60.0],
                seed=1,
            ),
            "needs a model of intercept_per_ms, .*: got one of intercept_ma",
        ),
    ],
)
def test_what_is_no_afferent_is_refused(call, words: str) -> None:
    with pytest.raises(InputError, match=words):
        call()
