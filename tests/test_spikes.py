from itertools import pairwise

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st
from numpy.testing import assert_allclose, assert_array_equal

from fingerpad.core.errors import InputError
from fingerpad.core.signals import SpikeTrains
from fingerpad.neuron.spikes import (
    firing_rate_hz,
    first_spike_latency_ms,
    interval_statistics,
    modulation_difference,
    modulation_index,
)


def plain_rate(train, start, end):
    intervals = [later - earlier for earlier, later in pairwise(train) if start < later <= end]
    return 1000.0 * len(intervals) / sum(intervals) if intervals else 0.0


def test_a_regular_train_fires_at_one_over_its_interval():
    trains = SpikeTrains.from_lists([np.arange(0.0, 1000.0, 8.0), np.arange(3.0, 1000.0, 20.0)])
    assert_allclose(firing_rate_hz(trains, (600.0, 950.0)), [125.0, 50.0], rtol=1e-14)


def test_an_interval_belongs_to_the_window_of_its_closing_spike():
    trains = SpikeTrains.from_lists([[10.0, 40.0]])
    assert firing_rate_hz(trains, (30.0, 50.0)) == pytest.approx(1000.0 / 30.0)
    assert firing_rate_hz(trains, (5.0, 30.0)) == 0.0


def test_the_window_excludes_its_start_and_includes_its_end():
    trains = SpikeTrains.from_lists([[10.0, 30.0, 50.0, 55.0]])
    assert firing_rate_hz(trains, (30.0, 50.0)) == 50.0
    assert firing_rate_hz(trains, (50.0, 60.0)) == 200.0


def test_the_first_spike_of_a_train_closes_no_interval_with_the_train_before():
    trains = SpikeTrains.from_lists([[10.0, 20.0], [], [35.0], [5.0, 45.0], []])
    assert_array_equal(firing_rate_hz(trains, (30.0, 50.0)), [0.0, 0.0, 0.0, 25.0, 0.0])


@pytest.mark.parametrize("trains", [[], [[]], [[], [], []]])
def test_silence_has_rate_zero_and_no_latency(trains):
    silent = SpikeTrains.from_lists(trains)
    assert_array_equal(firing_rate_hz(silent, (0.0, 1.0)), np.zeros(len(trains)))
    assert_array_equal(first_spike_latency_ms(silent), np.full(len(trains), np.nan))


@settings(max_examples=50, deadline=None)
@given(
    st.lists(st.lists(st.integers(0, 60), unique=True, max_size=12), max_size=6),
    st.integers(0, 59),
    st.integers(1, 40),
)
def test_rates_match_the_definition_spike_by_spike(trains, start, length):
    lists = [sorted(float(spike) for spike in train) for train in trains]
    rates = firing_rate_hz(SpikeTrains.from_lists(lists), (start, start + length))
    assert_allclose(rates, [plain_rate(train, start, start + length) for train in lists], rtol=1e-13)


def test_latency_is_the_first_spike():
    trains = SpikeTrains.from_lists([[], [7.5, 8.0], [2.0], []])
    assert_array_equal(first_spike_latency_ms(trains), [np.nan, 7.5, 2.0, np.nan])


def test_modulation_index_ranges_from_0_to_1_and_ignores_scale():
    assert_array_equal(modulation_index([50.0, 50.0, 0.0], [50.0, 0.0, 0.0]), [0.0, 1.0, np.nan])
    assert_allclose(modulation_index(212.0, 54.0), modulation_index(21.2, 5.4), rtol=1e-14)
    assert_allclose(modulation_index(212.0, 54.0), 158.0 / 266.0, rtol=1e-14)
    assert modulation_difference(212.0, 54.0) == 158.0


@pytest.mark.parametrize("window", [(50.0, 50.0), (50.0, 30.0), (0.0, np.nan), (0.0,), (0.0, 1.0, 2.0)])
def test_a_window_must_be_a_start_and_a_later_end(window):
    with pytest.raises(InputError, match="window_ms"):
        firing_rate_hz(SpikeTrains.from_lists([[1.0]]), window)


def test_a_train_that_runs_backwards_is_refused_but_trains_may_overlap():
    assert len(SpikeTrains.from_lists([[5.0, 6.0], [], [1.0, 2.0], []])) == 4
    with pytest.raises(InputError, match="increase within each afferent"):
        SpikeTrains.from_lists([[], [1.0, 3.0, 2.0]])


def plain_statistics(train, start, end):
    """Intervals that close in the window, and what the formulas say about them."""
    closing = [k for k in range(1, len(train)) if start < train[k] <= end]
    intervals = [train[k] - train[k - 1] for k in closing]
    n = len(intervals)
    mean = sum(intervals) / n if n else np.nan
    if n < 2:
        return n, mean, np.nan, np.nan
    variance = sum((interval - mean) ** 2 for interval in intervals) / (n - 1)
    contrasts = [((a - b) / (a + b)) ** 2 for a, b in pairwise(intervals)]
    return n, mean, variance**0.5 / mean, 3.0 * sum(contrasts) / (n - 1)


@settings(max_examples=50, deadline=None)
@given(
    st.lists(st.lists(st.integers(0, 60), unique=True, max_size=12), max_size=6),
    st.integers(0, 59),
    st.integers(1, 60),
)
def test_interval_statistics_match_their_formulas_interval_by_interval(trains, start, length):
    lists = [sorted(float(spike) for spike in train) for train in trains]
    found = interval_statistics(SpikeTrains.from_lists(lists), (start, start + length))
    expected = np.array([plain_statistics(train, start, start + length) for train in lists]).reshape(-1, 4)
    assert_array_equal(found.count, expected[:, 0])
    assert_allclose(found.mean_ms, expected[:, 1], rtol=1e-13)
    assert_allclose(found.coefficient_of_variation, expected[:, 2], rtol=1e-12, atol=1e-15)
    assert_allclose(found.local_variation, expected[:, 3], rtol=1e-12)


def test_a_clock_does_not_vary_and_a_poisson_process_varies_by_one():
    clock = SpikeTrains.from_lists([np.arange(0.0, 1000.0, 8.0)])
    even = interval_statistics(clock, (0.0, 1000.0))
    assert_allclose([even.coefficient_of_variation[0], even.local_variation[0]], 0.0, atol=1e-12)
    intervals = np.random.default_rng(3).exponential(10.0, 20_000)
    poisson = interval_statistics(SpikeTrains.from_lists([np.cumsum(intervals)]), (0.0, 1e9))
    # The variance of both estimates is near 1/n.
    assert_allclose(
        [poisson.coefficient_of_variation[0], poisson.local_variation[0]], 1.0, atol=4.0 / 20_000**0.5
    )


def test_local_variation_hardly_sees_a_slow_change_of_rate():
    slowing = SpikeTrains.from_lists([np.cumsum(np.linspace(5.0, 50.0, 200))])
    found = interval_statistics(slowing, (0.0, 1e9))
    assert found.coefficient_of_variation[0] > 0.4
    assert found.local_variation[0] < 0.001
