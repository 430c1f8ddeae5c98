"""An afferent fitted to firing rates and to hit rates at once."""

import numpy as np
import pytest

from fingerpad import InputError, RateRecordings, Traces
from fingerpad.inference.afferent_fit import RatesAndHitRates, SphereHitRates, ToRatesAndHitRates
from fingerpad.inference.fitting.methods import cross_validate
from fingerpad.inference.identifiable import LARGEST_RESTING_SHARE, identifiable
from fingerpad.inference.rate_model import AfferentModel, RateProblem, four_number_model
from fingerpad.psychophysics.encoding import neighbour_pairs
from fingerpad.psychophysics.observer import expected_euclidean_hit_rates, expected_hit_rates

SIX = np.array([2e-7, 1.2e-4, 9e-7, 60.0, 1e-6, 50.0])
TIMES_MS = np.array([0.0, 10.0, 20.0, 30.0, 40.0, 50.0, 60.0, 80.0, 120.0, 200.0, 400.0, 700.0, 1000.0])
RAMP = np.minimum(TIMES_MS / 50.0, 1.0) ** 2
SITES = np.stack(np.meshgrid([-1.0, 0.0, 1.0], [-1.0, 0.0, 1.0], indexing="ij"), axis=-1).reshape(-1, 2)
NEIGHBOURS = neighbour_pairs(SITES, 1.0)
DRAWS = np.random.default_rng(3).standard_normal((400, 9))
NOISE = 0.05


def traces(heights_kpa) -> Traces:
    return Traces(TIMES_MS, np.outer(RAMP, heights_kpa), kinks_ms=[50.0])


BARS = AfferentModel.of_traces(traces(np.linspace(0.6, 3.0, 8)))
RATES = RateProblem(BARS, RateRecordings(tuple("abcdefgh"), *BARS.evaluate(SIX), "simulated"))


def sphere(sharpness: float, aside_mm: float) -> Traces:
    distance = np.hypot(SITES[:, 0] - aside_mm, SITES[:, 1])
    return traces(3.0 * np.exp(-sharpness * distance))


SPHERES = SphereHitRates(
    AfferentModel.of_traces([sphere(s, aside) for aside in (0.0, 0.3) for s in (0.30, 0.32, 0.40)]),
    n_positions=2,
    n_receptors=9,
    neighbours=NEIGHBOURS,
    noise_sigma=NOISE,
    standard_normals=DRAWS,
)


def test_hit_rates_are_those_of_both_codes_position_by_position():
    found, static = SPHERES(SIX), SPHERES.model.evaluate(SIX)[1].reshape(2, 3, 9)
    expected = []
    for table in static:
        expected.append(expected_hit_rates(table, NEIGHBOURS, NOISE, DRAWS))
        expected.append(expected_euclidean_hit_rates(table, NOISE))
    np.testing.assert_array_equal(found, np.concatenate(expected))
    assert found.shape == (8,)
    silent = SPHERES(SIX * [0.0, 0.0, 0.0, 1.0, 1.0, 1.0])
    np.testing.assert_array_equal(silent, np.full(8, 0.5))


def test_the_score_is_fss_less_the_weighted_squares():
    observed, chosen = np.full(8, 0.7), np.array([0, 3, 4])
    problem = RatesAndHitRates(RATES, SPHERES, observed, weight=0.25)
    other = SIX * [1.0, 1.1, 0.9, 1.0, 1.0, 1.0]
    squares = float(((SPHERES(other) - observed) ** 2).sum())
    assert problem.score(other, chosen) == pytest.approx(RATES.score(other, chosen) - 0.25 * squares)
    assert problem.n_observations == 8


def test_hit_rates_choose_among_afferents_that_explain_the_rates_alike():
    observed = SPHERES(SIX)
    method = ToRatesAndHitRates(SPHERES, observed)
    found = method.fit(RATES, np.arange(8))
    assert found.score == pytest.approx(RATES.score(found.parameters, np.arange(8)))
    assert found.score > 0.995
    np.testing.assert_allclose(SPHERES(found.parameters), observed, atol=0.05)
    start = found.history[0].parameters  # explains the rates alone
    both = RatesAndHitRates(RATES, SPHERES, observed)
    everything = np.arange(8)
    assert both.score(found.parameters, everything) >= both.score(start, everything)
    assert method.fit(RATES, everything).parameters.tolist() == found.parameters.tolist()


def test_the_afferent_is_silent_at_rest_and_folds_leave_out_rates_only():
    method = ToRatesAndHitRates(SPHERES, SPHERES(SIX))
    validation = cross_validate(RATES, method, np.arange(8) % 2)
    for fold in validation.folds:
        intercept, *_, tau = identifiable(fold.fit.parameters)
        assert intercept * tau <= LARGEST_RESTING_SHARE + 1e-12
        assert fold.score_test == RATES.score(fold.fit.parameters, fold.testing)
        assert len(fold.fit.attempts) == 1


def test_what_cannot_be_fitted_is_refused():
    four = RateProblem(four_number_model(BARS), RATES.recordings)
    with pytest.raises(InputError, match="six parameters: got RateProblem"):
        ToRatesAndHitRates(SPHERES, np.full(8, 0.5)).fit(four, np.arange(8))
