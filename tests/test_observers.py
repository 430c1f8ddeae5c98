"""d', tasks and the ideal observer, against closed forms and slow simulations."""

import math

import numpy as np
import pytest
from scipy import stats
from scipy.special import ndtr, ndtri

from fingerpad.core.errors import InputError
from fingerpad.psychophysics import (
    TASKS,
    GaussianResponses,
    d_prime_of_proportion,
    discriminability,
    efficiency,
    forced_choice,
    gaussian_information,
    multiplied_responses,
    present,
    same_different_by_difference,
    same_different_by_looks,
    sensitivity,
    yes_no,
)
from fingerpad.psychophysics.encoding import Noise
from fingerpad.psychophysics.ideal_observer import SMALLEST_SPREAD, noisy_presentations
from fingerpad.psychophysics.observer import GradientSum
from fingerpad.psychophysics.sensitivity import best_difference

LOOKS = 400_000
D_PRIMES = (0.5, 1.0, 2.0, 3.0)


def proportion_is(simulated: np.ndarray, expected: float) -> bool:
    """Whether a proportion of simulated trials is within five standard errors."""
    return abs(simulated.mean() - expected) < 5.0 * math.sqrt(expected * (1.0 - expected) / simulated.size)


@pytest.mark.parametrize("d", D_PRIMES)
def test_yes_no_and_forced_choice_are_those_of_simulated_looks(d):
    draw = np.random.default_rng(4)
    signal = d + draw.standard_normal(LOOKS)
    assert proportion_is(signal > 0.5 * d, yes_no(d))
    for m in (2, 3, 8):
        others = draw.standard_normal((m - 1, LOOKS // 4)).max(axis=0)
        assert proportion_is(signal[: LOOKS // 4] > others, forced_choice(d, m)), m


@pytest.mark.parametrize("d", D_PRIMES)
def test_same_different_is_that_of_simulated_looks_and_its_criterion_the_best(d):
    draw = np.random.default_rng(5)
    first, second = draw.integers(2, size=(2, LOOKS)) * d
    different = first != second
    first, second = first + draw.standard_normal(LOOKS), second + draw.standard_normal(LOOKS)
    by_difference = (np.abs(first - second) > best_difference(d)) == different
    by_looks = ((first > 0.5 * d) != (second > 0.5 * d)) == different
    assert proportion_is(by_difference, same_different_by_difference(d))
    assert proportion_is(by_looks, same_different_by_looks(d))
    assert same_different_by_looks(d) > same_different_by_difference(d)
    k = best_difference(d)
    assert same_different_by_difference(d) > same_different_by_difference(d, 1.01 * k)
    assert same_different_by_difference(d) > same_different_by_difference(d, 0.99 * k)


@pytest.mark.parametrize("name", TASKS)
def test_d_prime_of_proportion_undoes_the_task(name):
    for d in (0.3, 1.0, 3.0):
        assert d_prime_of_proportion(TASKS[name](d), TASKS[name]) == pytest.approx(d, abs=1e-7)
    assert d_prime_of_proportion(0.5, TASKS[name]) == 0.0
    with pytest.raises(InputError, match="proportion_correct"):
        d_prime_of_proportion(0.4, TASKS[name])
    with pytest.raises(InputError, match="proportion_correct"):
        d_prime_of_proportion(1.0, TASKS[name])


def test_sensitivity_finds_the_truth_of_equal_and_unequal_spread():
    n, d, s, c = 10**7, 1.3, 0.8, 0.4
    hits, false_alarms = n * ndtr(1.3 / 2 - c), n * ndtr(-1.3 / 2 - c)
    found = sensitivity(round(hits), n, round(false_alarms), n, correction="none")
    assert found.d_prime == pytest.approx(d, abs=1e-5)
    assert found.criterion == pytest.approx(c, abs=1e-5)
    # Signal of spread 1 at 1.5, no signal of spread s at 0; the observer decides at 0.9.
    unequal = sensitivity(
        round(n * ndtr(1.5 - 0.9)), n, round(n * ndtr(-0.9 / s)), n, correction="none", spread_ratio=s
    )
    assert unequal.d_prime == pytest.approx(1.5 / math.sqrt(0.5 * (1.0 + s**2)), abs=1e-5)


def test_corrections_keep_d_prime_finite_and_are_as_stated():
    log_linear = sensitivity(10, 10, 0, 10)
    assert (log_linear.hit_rate, log_linear.false_alarm_rate) == (10.5 / 11.0, 0.5 / 11.0)
    half = sensitivity(10, 10, 0, 10, correction="half")
    assert half.d_prime == pytest.approx(2.0 * float(ndtri(0.95)))
    with pytest.raises(InputError, match="infinite"):
        sensitivity(10, 10, 3, 10, correction="none")
    with pytest.raises(InputError, match="not exceed"):
        sensitivity(11, 10, 3, 10)


def test_discriminability_is_the_share_of_all_pairs_with_its_error():
    draw = np.random.default_rng(7)
    standard, comparison = draw.integers(0, 6, 60), draw.integers(1, 8, 50)
    found = discriminability(standard, comparison)
    pairs = comparison[:, None] - standard
    assert found.proportion_correct == pytest.approx(((pairs > 0) + 0.5 * (pairs == 0)).mean(), abs=1e-12)
    areas = [
        discriminability(draw.normal(0.0, 1.0, 100), draw.normal(1.0, 1.0, 150)).proportion_correct
        for _ in range(600)
    ]
    one = discriminability(draw.normal(0.0, 1.0, 100), draw.normal(1.0, 1.0, 150))
    assert np.mean(areas) == pytest.approx(forced_choice(1.0), abs=0.006)
    assert one.standard_error == pytest.approx(np.std(areas), rel=0.2)


def test_gaussian_responses_have_their_likelihood_and_their_moments():
    mean, covariance = np.array([3.0, 5.0]), np.array([[2.0, 0.5], [0.5, 1.0]])
    at = np.array([[2.0, 5.5], [4.0, 4.0]])
    expected = stats.multivariate_normal(mean, covariance).logpdf(at)
    assert GaussianResponses(mean, covariance).log_likelihood(at) == pytest.approx(expected)
    with pytest.raises(InputError, match="positive definite"):
        GaussianResponses([1.0, 1.0], [[1.0, 1.0], [1.0, 1.0]])
    trials = np.arange(40_000)
    gaussian = GaussianResponses(mean, covariance).draw(3, trials)
    assert gaussian.mean(axis=0) == pytest.approx(mean, abs=0.03)
    assert np.cov(gaussian.T) == pytest.approx(covariance, abs=0.04)


def test_ideal_observer_of_equal_covariance_has_the_closed_form():
    covariance = np.array([[2.0, 0.6], [0.6, 1.0]])
    standard = GaussianResponses([0.0, 0.0], covariance)
    comparison = GaussianResponses([1.0, 0.5], covariance)
    shown = present(standard, comparison, seed=2, n_trials=40_000)
    d = math.sqrt(np.array([1.0, 0.5]) @ np.linalg.solve(covariance, [1.0, 0.5]))
    ideal = shown.ideal()
    assert abs(ideal.d_prime - d) < 4.0 * ideal.d_prime_error
    assert ideal.d_prime_error < 0.02
    assert shown.ideal_hit_rate() == pytest.approx(yes_no(d), abs=0.01)
    assert (present(standard, comparison, 2, 100).standard == shown.standard[:100]).all()
    assert (present(standard, comparison, 2, 100, session=1).standard != shown.standard[:100]).any()


def test_ideal_observer_detects_a_change_of_spread_alone():
    standard, comparison = GaussianResponses([0.0], [[1.0]]), GaussianResponses([0.0], [[4.0]])
    shown = present(standard, comparison, seed=3, n_trials=20_000)
    # |r| is the likelihood ratio here: of two looks the one of greater spread is the farther out,
    # P(|2 x| > |y|) = 1 - (2 / pi) arctan(1 / 2).
    expected = 1.0 - 2.0 / math.pi * math.atan(0.5)
    ideal = shown.ideal()
    assert abs(ideal.proportion_correct - expected) < 4.0 * ideal.standard_error
    assert shown.of(lambda responses: responses[:, 0]).proportion_correct < 0.51


@pytest.mark.parametrize(
    ("noise", "floor"), [(0.05, 0.0), (0.15, 0.0), (0.15, 4.0), (Noise(0.1, offset=40.0), 0.0)]
)
def test_ideal_observers_of_small_differences_reach_fishers_information(noise, floor):
    rates, slopes = np.array([20.0, 35.0, 50.0, 60.0]), np.array([0.01, 0.03, -0.02, 0.05])
    j = gaussian_information(rates, slopes, noise, floor)
    step = 1.0 / math.sqrt(j)  # where d' is 1 by Fisher's information
    models = [multiplied_responses(rates + side * step * slopes, noise, floor) for side in (-0.5, 0.5)]
    ideal = present(models[0], models[1], seed=5, n_trials=40_000).ideal()
    assert ideal.d_prime == pytest.approx(1.0, abs=4.0 * ideal.d_prime_error)


def test_efficiency_of_looking_at_one_of_four_equal_receptors_is_a_quarter():
    standard, comparison = (GaussianResponses([mean] * 4, np.eye(4)) for mean in (0.0, 0.5))
    shown = present(standard, comparison, seed=8, n_trials=40_000)
    share, error = efficiency(shown.of(lambda responses: responses[:, 0]), shown.ideal())
    assert share == pytest.approx(0.25, abs=4.0 * error)
    assert error < 0.02
    assert np.isnan(efficiency(shown.ideal(), discriminability([1.0, 2.0], [3.0, 4.0]))).all()


def test_no_efficiency_is_reported_where_the_ideal_observer_guesses_or_a_floor_bounds_it():
    table = np.array([[30.0, 20.0, 0.0], [30.0, 20.0, 0.0], [33.0, 21.0, 1.0]])
    pairs = np.array([[0, 1], [1, 2]])
    standard = multiplied_responses(table[0], 0.1, SMALLEST_SPREAD)
    by_gradient = GradientSum(pairs).statistic(standard, 4, 0)
    same, other = noisy_presentations(table, 0.1, seed=4)
    assert np.isnan(efficiency(same.of(by_gradient), same.ideal())).all()
    assert 0.0 < efficiency(other.of(by_gradient), other.ideal())[0] < 1.0
    # The third receptor begins to fire: its information is that of one spike/s over the floor.
    slopes = (table[2] - table[0], 0.1, SMALLEST_SPREAD)
    expected = math.sqrt(gaussian_information(0.5 * (table[2] + table[0]), *slopes))
    ideal = other.ideal()
    assert ideal.d_prime == pytest.approx(expected, abs=4.0 * ideal.d_prime_error)


def test_bad_models_are_refused():
    with pytest.raises(InputError, match="1 of them zero"):
        gaussian_information([0.0, 1.0], [0.1, 0.1], 0.5)
    with pytest.raises(InputError, match="1 of 2 receptors are silent"):
        multiplied_responses([0.0, 10.0], 0.1)
    assert multiplied_responses([0.0, 10.0], 0.1, smallest_spread=1.0).covariance[0, 0] == 1.0
    assert multiplied_responses([0.0, 10.0], Noise(0.1, offset=10.0)).covariance[0, 0] == 1.0
    with pytest.raises(InputError, match="same receptors"):
        present(GaussianResponses([1.0], np.eye(1)), GaussianResponses([1.0, 2.0], np.eye(2)), seed=1)
    with pytest.raises(InputError, match="one row and column"):
        GaussianResponses([1.0], np.eye(2))
