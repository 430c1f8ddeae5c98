from itertools import pairwise

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st
from numpy.testing import assert_allclose, assert_array_equal

from fingerpad import InputError, SpikeTrains
from fingerpad.neuron.spikes import firing_rate_hz, first_spike_latency_ms, modulation_index
from refusals import refused


def plain_rate(train, start, end):
    intervals = [later - earlier for earlier, later in pairwise(train) if start < later <= end]
    return 1000.0 * len(intervals) / sum(intervals) if intervals else 0.0


def test_silence_has_rate_zero_and_no_latency_which_is_that_of_the_first_spike():
    for trains in ([], [[]], [[], [], []]):
        silent = SpikeTrains.from_lists(trains)
        assert_array_equal(firing_rate_hz(silent, (0.0, 1.0)), np.zeros(len(trains)))
        assert_array_equal(first_spike_latency_ms(silent), np.full(len(trains), np.nan))
    trains = SpikeTrains.from_lists([[], [7.5, 8.0], [2.0], []])
    assert_array_equal(first_spike_latency_ms(trains), [np.nan, 7.5, 2.0, np.nan])


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


def test_modulation_index_ranges_from_0_to_1_and_ignores_scale():
    assert_array_equal(modulation_index([50.0, 50.0, 0.0], [50.0, 0.0, 0.0]), [0.0, 1.0, np.nan])
    assert_allclose(modulation_index(212.0, 54.0), modulation_index(21.2, 5.4), rtol=1e-14)
    assert_allclose(modulation_index(212.0, 54.0), 158.0 / 266.0, rtol=1e-14)


def test_bad_windows_and_trains_are_refused():
    for window in ((50.0, 50.0), (50.0, 30.0), (0.0, np.nan), (0.0,), (0.0, 1.0, 2.0)):
        with refused("window_ms"):
            firing_rate_hz(SpikeTrains.from_lists([[1.0]]), window)
    assert len(SpikeTrains.from_lists([[5.0, 6.0], [], [1.0, 2.0], []])) == 4  # trains may overlap
    with pytest.raises(InputError, match="increase within each afferent"):
        SpikeTrains.from_lists([[], [1.0, 3.0, 2.0]])
    with refused("offsets"):
        SpikeTrains([1.0, 2.0], [0, 0.5, 2])
