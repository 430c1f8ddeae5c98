"""Recovery before real data, by simulation-based calibration: truths take every rank equally often.

Truths come from the prior, recordings from the likelihood's own noise. Ranks of truths among posterior draws
are then uniform (Talts, Betancourt, Simpson, Vehtari & Gelman 2018, arXiv:1804.06788). The truth is one of a
set of places that cover the prior, so that the posterior is exact and needs no sampler.
"""

import numpy as np
import pytest
from scipy.stats import binom, chi2, multivariate_t, norm

from fingerpad import ConvergenceError, RateRecordings, Traces
from fingerpad.inference.fitting.posterior import credible_band
from fingerpad.inference.rate_model import AfferentModel, evaluate_rows, four_number_model
from fingerpad.inference.rate_posterior import (
    LENGTHS_MM,
    WEAK_PRIOR,
    AfferentPrior,
    CorrelatedResiduals,
    RateLikelihood,
    afferent_posterior,
    from_coordinates,
    log_posterior,
    to_coordinates,
)
from refusals import refusals

SHIFTS = np.linspace(0.0, 2.7, 10)
PEAKS = 0.25 + 1.6 * np.exp(-(((SHIFTS - 1.4) / 0.7) ** 2)) + 0.4 * (SHIFTS < 1.0)
TIMES = np.array([0.0, 15.0, 30.0, 40.0, 50.0, 60.0, 100.0, 200.0, 500.0, 1000.0])
COURSE = np.where(TIMES <= 50.0, (TIMES / 50.0) ** 2, 0.75 + 0.25 * np.exp(-(TIMES - 50.0) / 150.0))


def under(peaks):
    """The model under stimuli of these peaks of energy density [kPa]."""
    traces = Traces(TIMES, COURSE[:, None] * peaks, [50.0])
    return four_number_model(AfferentModel.of_traces(traces, pieces=3))


MODEL = under(PEAKS)
DEVIATIONS_HZ = {"dynamic": 8.0, "static": 2.0}
# Truths come from these.
CENTRE = np.array([0.0, np.log(5.0), np.log(0.03), np.log(50.0)])
SPREAD = np.array([0.3, np.log(1.5), np.log(1.5), np.log(1.4)])
PRIOR = AfferentPrior(CENTRE, SPREAD)
COVER = 2.0
EXPECTED_HZ = 10.0
# Recorded rates end at 0, normal residuals do not: on a pedestal under prediction and recording none is cut.
PEDESTAL_HZ = 1e6
N_PLACES, N_DRAWS = 2500, 49
EFFORT = {
    "n_walkers": 40, "n_steps": 32, "most_steps": 512, "largest_r_hat": 1.02,
    "smallest_effective_size": 100.0,
}  # fmt: skip


def simulated(four, random):
    rates = [
        np.maximum(rate + DEVIATIONS_HZ[phase] * random.normal(size=SHIFTS.size), 0.0)
        for phase, rate in zip(DEVIATIONS_HZ, MODEL.evaluate(four), strict=True)
    ]
    return RateRecordings(tuple(f"{shift:g}" for shift in SHIFTS), *rates)


def alike(deviation_hz):
    return CorrelatedResiduals(SHIFTS.size, SHIFTS, deviation=deviation_hz)


@pytest.fixture(scope="module")
def places():
    """Coordinates that cover the prior twice as wide, their rates, and the log density of the cover."""
    wide = CENTRE + COVER * SPREAD * np.random.default_rng(1).normal(size=(N_PLACES, 4))
    wide = wide[wide[:, 0] < 1.0]
    rates = evaluate_rows(MODEL, from_coordinates(wide))
    return wide, rates, norm.logpdf(wide, CENTRE, COVER * SPREAD).sum(axis=1)


def noisy(rates, random, noise):
    """Rates with residuals of the likelihood's own law, and their deviations and lengths."""
    distances = np.abs(SHIFTS[:, None] - SHIFTS)
    deviations = EXPECTED_HZ / np.sqrt(random.chisquare(1.0, size=2))
    lengths = random.choice(LENGTHS_MM, size=2)
    observed = []
    for rate, deviation, length in zip(rates, deviations, lengths, strict=True):
        correlation = np.exp(-distances / length) if length else np.eye(SHIFTS.size)
        residuals = np.linalg.cholesky(correlation) @ random.normal(size=SHIFTS.size)
        observed.append(np.maximum(rate + noise * deviation * residuals, 0.0))
    return RateRecordings(tuple(map(str, SHIFTS)), *observed), [*deviations, *lengths]


class AtPlaces:
    """The rates at each place, computed once; a point is the number of a place."""

    names, n_stimuli = ("place",), SHIFTS.size

    def __init__(self, rates):
        self.rates = rates

    def evaluate(self, parameters):
        return tuple(rate[int(parameters[0])] for rate in self.rates)


def ranks(places, n_recordings, width=1.0, noise=1.0, pedestal_hz=PEDESTAL_HZ):
    """Ranks, 0 to 1, of four coordinates, two deviations, two lengths (n_recordings, 8).

    Truths spread `width` times as far as the prior says, and noise is `noise` times what it says it is.
    """
    wide, rates, log_cover = places
    rates = [rate + pedestal_hz for rate in rates]
    random = np.random.default_rng(2)
    of_truth = np.exp(norm.logpdf(wide, CENTRE, width * SPREAD).sum(axis=1) - log_cover)
    log_prior = PRIOR.log_density(wide) - log_cover
    found = np.empty((n_recordings, 8))
    for row in found:
        truth = random.choice(len(wide), p=of_truth / of_truth.sum())
        recordings, true_values = noisy([rate[truth] for rate in rates], random, noise)
        likelihood = RateLikelihood(AtPlaces(rates), recordings, alike(EXPECTED_HZ))
        heights = log_prior + likelihood.log_likelihood(np.arange(len(wide))[:, None])
        weights = np.exp(heights - heights.max())
        weights /= weights.sum()
        row[:4] = weights @ (wide < wide[truth]) + random.uniform(size=4) * weights[truth]
        some = random.choice(len(wide), size=N_DRAWS, p=weights)
        drawn = likelihood.residual_draws(some[:, None], random).values()
        values = np.array([*(phase.deviation_hz for phase in drawn), *(phase.length_mm for phase in drawn)])
        below, ties = ((sign == np.sign(values.T - true_values)).sum(axis=0) for sign in (-1, 0))
        row[4:] = (below + random.uniform(size=4) * (ties + 1)) / (N_DRAWS + 1)
    return found


def calibrated(found):
    """Whether ranks are uniform, and whether 80 % intervals hold neither too few truths nor too many.

    One in a hundred sets of eight ranks would be refused by chance, on either ground.
    """
    n, chance = len(found), 0.01 / found.shape[1]
    counts = np.array([np.histogram(column, bins=10, range=(0.0, 1.0))[0] for column in found.T])
    statistics = ((counts - n / 10.0) ** 2 / (n / 10.0)).sum(axis=1)
    held = (np.abs(found - 0.5) < 0.4).sum(axis=0)
    fewest, most = binom.ppf([chance / 2.0, 1.0 - chance / 2.0], n, 0.8)
    uniform = (statistics < chi2.ppf(1.0 - chance, 9)).all()
    return bool(uniform), bool(((fewest <= held) & (held <= most)).all())


def test_ranks_of_truths_are_uniform_and_intervals_have_their_nominal_coverage(places):
    assert calibrated(ranks(places, n_recordings=300)) == (True, True)


@pytest.mark.parametrize(("width", "noise"), [(2.0, 1.0), (0.4, 1.0), (1.0, 1.5), (1.0, 1.0 / 1.5)])
def test_calibration_detects_intervals_that_are_too_narrow_or_too_wide(places, width, noise):
    assert calibrated(ranks(places, 150, width, noise)) == (False, False)


def test_rates_that_end_at_zero_make_intervals_somewhat_too_narrow(places) -> None:
    """A known departure, docs/decisions.md#likelihood-of-rates: whoever mends it will see it here."""
    held = (np.abs(ranks(places, 300, pedestal_hz=0.0)[:, :4] - 0.5) < 0.4).mean()
    assert 0.70 < held < 0.78


def test_walkers_draw_what_importance_sampling_finds():
    """Means and spreads agree within four of their errors, of a wide density; walkers start far off."""
    two = RateRecordings(("low", "high"), [60.0, 150.0], [20.0, 50.0])
    likelihood = RateLikelihood(under(np.array([0.6, 1.7])), two, CorrelatedResiduals(2, deviation=4.0))
    start = from_coordinates(PRIOR.centre + 2.0 * PRIOR.spread * [-1.0, 1.0, 1.0, 1.0])
    effort = EFFORT | {"smallest_effective_size": 250.0}
    chains = afferent_posterior(likelihood, start, seed=0, prior=PRIOR, **effort).chains
    found = chains.flat.mean(axis=0)
    shape = 1.5 * np.cov(chains.flat, rowvar=False)
    proposal = multivariate_t(found, shape, df=5, seed=np.random.default_rng(3))
    points = proposal.rvs(2000)
    heights = log_posterior(likelihood, PRIOR)(points) - proposal.logpdf(points)
    weights = np.exp(heights - heights.max())
    weights /= weights.sum()
    mean = weights @ points
    spread = np.sqrt(weights @ (points - mean) ** 2)
    four_errors = 4.0 * np.sqrt(1.0 / chains.effective_sizes + (weights**2).sum())
    np.testing.assert_array_less(np.abs(found - mean) / spread, four_errors)
    np.testing.assert_array_less(np.abs(chains.flat.std(axis=0) / spread - 1.0), four_errors)


@pytest.fixture(scope="module")
def one_posterior():
    truth = np.array([0.012, 5.0, 0.03, 60.0])
    likelihood = RateLikelihood(MODEL, simulated(truth, np.random.default_rng(5)), alike(4.0))
    return likelihood, afferent_posterior(likelihood, truth, seed=3, **EFFORT)


def test_draws_bands_and_deviations_belong_together(one_posterior):
    likelihood, posterior = one_posterior
    np.testing.assert_array_equal(posterior.four, from_coordinates(posterior.chains.flat))
    heights = log_posterior(likelihood, WEAK_PRIOR)(posterior.chains.flat[::500])
    np.testing.assert_allclose(posterior.chains.log_densities.ravel()[::500], heights, rtol=1e-9)
    assert (posterior.four[:, 0] * posterior.four[:, 3] < 1.0).all()
    # The recordings taught something: intervals are narrower than the prior's.
    width = np.diff(credible_band(posterior.chains.flat, 0.8), axis=0)[0]
    assert (width < 2.0 * norm.ppf(0.9) * WEAK_PRIOR.spread).all()
    for phase, truth_hz in DEVIATIONS_HZ.items():
        rates = posterior.rates[phase]
        low, high = credible_band(rates.deviation_hz, 0.99)
        assert low < truth_hz < high
        observed = getattr(likelihood.recordings, f"{phase}_rate_hz")
        lower, upper = credible_band(rates.new_hz)
        assert ((lower <= observed) & (observed <= upper)).mean() >= 0.7
        assert (np.diff(credible_band(rates.predicted_hz), axis=0) <= upper - lower + 1e-9).all()


def test_the_seed_fixes_every_draw_and_an_unconverged_posterior_is_not_returned(one_posterior):
    likelihood, _ = one_posterior
    effort = {"n_steps": 16, "largest_r_hat": 3.0, "smallest_effective_size": 10.0}
    once, again = (
        afferent_posterior(likelihood, [0.012, 5.0, 0.03, 60.0], seed=3, **effort) for _ in range(2)
    )
    np.testing.assert_array_equal(again.four, once.four)
    np.testing.assert_array_equal(again.rates["static"].new_hz, once.rates["static"].new_hz)
    with pytest.raises(ConvergenceError, match="have not converged after 8 steps"):
        afferent_posterior(likelihood, [0.012, 5.0, 0.03, 60.0], seed=3, n_steps=8, most_steps=8)


def test_the_prior_is_centred_on_the_papers_start_and_silent_at_rest():
    prior = WEAK_PRIOR
    np.testing.assert_allclose(np.exp(prior.centre[1:]), [4.8, 0.042, 68.0], rtol=1e-12)
    one_off = prior.centre + np.diag(prior.spread) * -1.0
    np.testing.assert_allclose(prior.log_density(one_off), prior.log_density(prior.centre) - 0.5, rtol=1e-12)
    assert prior.log_density(prior.centre + np.eye(4)[0]) == -np.inf
    assert prior.log_density(prior.centre + 0.999 * np.eye(4)[0]) == pytest.approx(-0.5, abs=1e-3)
    four = np.array([[0.012, 5.0, 0.03, 60.0], [-0.002, 0.1, 0.4, 20.0]])
    coordinates = to_coordinates(four)
    np.testing.assert_allclose(from_coordinates(coordinates), four, rtol=1e-14)
    np.testing.assert_allclose(coordinates[0], [0.72, np.log(5.0), np.log(0.03), np.log(60.0)], rtol=1e-14)


test_what_is_no_afferent_is_refused = refusals(
    (lambda: to_coordinates([0.01, -4.0, 0.014, 68.0]), "all but the first greater than 0"),
    (lambda: to_coordinates([0.01, 4.0, 0.014]), "four must hold"),
)  # fmt: skip
