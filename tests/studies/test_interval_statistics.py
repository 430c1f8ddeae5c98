"""Statistics of interspike intervals against their formulas and known processes."""

from itertools import pairwise

import numpy as np
from hypothesis import given, settings
from hypothesis import strategies as st
from numpy.testing import assert_allclose, assert_array_equal

from fingerpad.core.signals import SpikeTrains
from studies.interval_statistics import interval_statistics


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


def test_local_variation_hardly_depends_on_a_slow_change_of_rate():
    slowing = SpikeTrains.from_lists([np.cumsum(np.linspace(5.0, 50.0, 200))])
    found = interval_statistics(slowing, (0.0, 1e9))
    assert found.coefficient_of_variation[0] > 0.4
    assert found.local_variation[0] < 0.001
