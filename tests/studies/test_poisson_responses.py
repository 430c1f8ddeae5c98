"""Poisson spike counts against SciPy's distribution, Fisher's information and the ideal observer."""

import math

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st
from scipy import stats

from fingerpad.core.errors import InputError
from fingerpad.psychophysics.ideal_observer import present
from studies.poisson_responses import PoissonResponses, poisson_information
from tests.test_observers import assert_no_code_beats_the_ideal_observer, rates_hz


def test_log_likelihood_is_that_of_the_distribution():
    mean = np.array([3.0, 5.0])
    counts = np.array([[0.0, 7.0], [3.0, 0.0]])
    poisson = stats.poisson(mean).logpmf(counts).sum(axis=1)
    assert PoissonResponses(mean).log_likelihood(counts) == pytest.approx(poisson)


def test_drawn_counts_have_the_moments_of_their_model():
    trials = np.arange(40_000)
    counts = PoissonResponses([0.2, 9.0]).draw(4, trials)
    # Four standard errors: 0.009 of 0.2, 0.06 of 9.
    assert counts.mean(axis=0) == pytest.approx([0.2, 9.0], rel=0.045)
    assert counts.var(axis=0) == pytest.approx([0.2, 9.0], rel=0.055)
    # A trial has its own numbers, whoever else is drawn.
    assert (PoissonResponses([0.2, 9.0]).draw(4, trials[7:9]) == counts[7:9]).all()


def test_ideal_observer_of_a_small_difference_reaches_fishers_information():
    counts, slopes = np.array([60.0, 105.0, 150.0, 180.0]), np.array([0.01, 0.03, -0.02, 0.05])
    step = 1.0 / math.sqrt(poisson_information(counts, slopes))
    models = [PoissonResponses(counts + side * step * slopes) for side in (-0.5, 0.5)]
    ideal = present(models[0], models[1], seed=6, n_trials=40_000).ideal()
    assert ideal.d_prime == pytest.approx(1.0, abs=4.0 * ideal.d_prime_error)


@given(rates_hz, rates_hz, st.floats(0.03, 0.3), st.integers(0, 99))
@settings(max_examples=12, deadline=None)
def test_no_code_of_counts_beats_the_ideal_observer(standard, change, strength, seed):
    first = np.array(standard)
    second = np.maximum(first + 0.2 * (np.array(change) - 40.0) * strength, 1.0)
    assert_no_code_beats_the_ideal_observer((PoissonResponses(first), PoissonResponses(second)), first, seed)


def test_counts_that_are_impossible_are_refused():
    with pytest.raises(InputError, match="same receptors"):
        present(PoissonResponses([1.0]), PoissonResponses([1.0, 2.0]), seed=1)
    with pytest.raises(InputError, match="not be negative"):
        PoissonResponses([-1.0])
