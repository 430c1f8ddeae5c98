"""Types of recordings: contents and refused values."""

import numpy as np
import pytest

from fingerpad import InputError, RateRecordings, SpikeTrains
from fingerpad.inference.recordings import SpikeRecordings
from fingerpad.neuron.spikes import PAPER_WINDOWS_MS
from refusals import refusals


def test_chosen_rows_keep_names_rates_and_a_phase_that_was_not_recorded():
    recordings = RateRecordings(("a", "b", "c"), None, [1.0, 2.0, 3.0], "bench").chosen([2, 0])
    assert recordings.stimuli == ("c", "a")
    assert recordings.static_rate_hz.tolist() == [3.0, 1.0]
    assert recordings.dynamic_rate_hz is None
    assert (recordings.phases, recordings.source) == (("static",), "bench")


def spikes(trains, duration_ms):
    return SpikeRecordings(("a", "b"), SpikeTrains.from_lists(trains), duration_ms)


test_recordings_that_cannot_be_are_refused = refusals(
    (lambda: RateRecordings(("a", "a"), [1.0, 2.0], None), "'a' is repeated"),
    (lambda: RateRecordings(("a", "b"), [1.0], None), "dynamic_rate_hz needs one rate per stimulus"),
    (lambda: RateRecordings(("a",), None, [-2.0]), ("static_rate_hz",)),
    (lambda: RateRecordings(("a",), [np.nan], None), "dynamic_rate_hz must hold finite numbers only"),
    (lambda: RateRecordings(("a", "b"), None, None), "got neither"),
    (lambda: spikes([[1.0]], 1000.0), "one train per presentation: got 1 for 2"),
    (lambda: spikes([[1.0], [-1.0, 2.0]], 1000.0), "'b' has one at -1 ms"),
    (lambda: spikes([[1.0], [2.0, 1001.0]], 1000.0), "'b' has one at 1001 ms"),
    (lambda: spikes([[1.0], [2.0]], [1000.0, 0.0]), "duration_ms must be above 0"),
    (lambda: spikes([[1.0], [2.0]], [1.0, 1.0, 1.0]), "one for all or for each of 2"),
)  # fmt: skip


def test_rates_of_spikes_are_means_over_presentations_in_the_order_of_their_first():
    # Intervals that close in (30, 50]: 10 ms, then 20 ms, then none; in (600, 950]: 50 ms in the last alone.
    trains = SpikeTrains.from_lists([[25.0, 35.0], [700.0, 750.0], [15.0, 35.0]])
    rates = SpikeRecordings(("b", "a", "b"), trains, [1000.0, 1200.0, 1000.0]).rates(PAPER_WINDOWS_MS)
    assert rates.stimuli == ("b", "a")
    assert rates.dynamic_rate_hz.tolist() == [(100.0 + 50.0) / 2, 0.0]
    assert rates.static_rate_hz.tolist() == [0.0, 20.0]


def test_a_window_beyond_the_recording_has_no_rate():
    recordings = SpikeRecordings(("a",), SpikeTrains.from_lists([[1.0]]), 900.0)
    with pytest.raises(InputError, match="one ends at 950 ms"):
        recordings.rates(PAPER_WINDOWS_MS)
    assert recordings.rates(((30.0, 50.0), (600.0, 900.0))).static_rate_hz.tolist() == [0.0]
    # A trial from 1.35 to 1.7 s lasts 349.9999999999999 ms.
    rounded = SpikeRecordings(("a",), SpikeTrains.from_lists([[160.0, 200.0]]), (1.7 - 1.35) * 1e3)
    assert rounded.duration_ms[0] < 350.0
    assert rounded.rates(((30.0, 50.0), (150.0, 350.0))).static_rate_hz[0] > 0.0
