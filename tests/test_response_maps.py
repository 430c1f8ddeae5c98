"""Recruitment and population rate against loops over all spikes and pairs, and conserved quantities."""

import itertools

import numpy as np
from hypothesis import given, settings
from hypothesis import strategies as st
from numpy.testing import assert_allclose, assert_array_equal

from fingerpad import SpikeTrains
from fingerpad.neuron.response_maps import (
    NO_GROUP,
    evoked_latency_ms,
    order_change,
    population_rate,
    recruited,
    recruitment_rank,
    rings,
)
from refusals import refusals

# Few values, so that ties are common.
latencies = st.lists(st.one_of(st.just(np.nan), st.integers(1, 8).map(float)), min_size=1, max_size=12)
trains = st.lists(
    st.lists(st.integers(0, 60).map(lambda tick: tick / 2), max_size=12, unique=True).map(sorted), max_size=8
).map(SpikeTrains.from_lists)


@given(latencies)
def test_rank_counts_who_was_earlier_and_half_of_who_came_together(latency_ms):
    rank = recruitment_rank(latency_ms)
    for own, place in zip(latency_ms, rank, strict=True):
        earlier = sum(other < own for other in latency_ms)
        together = sum(other == own for other in latency_ms)
        expected = np.nan if np.isnan(own) else earlier + (together + 1) / 2
        assert_array_equal(place, expected)


@given(latencies, st.one_of(st.floats(0.0, 10.0), st.integers(0, 9)))
def test_recruited_counts_who_has_fired(latency_ms, time_ms):
    assert recruited(latency_ms, time_ms) == sum(own <= time_ms for own in latency_ms)
    assert recruited(latency_ms, [np.inf])[0] == sum(not np.isnan(own) for own in latency_ms)


@given(latencies, st.one_of(st.sampled_from([np.nan, np.inf]), st.integers(0, 18).map(float)))
def test_evoked_is_what_comes_in_half_the_time_at_rest_or_less(latency_ms, resting_ms):
    never = np.isnan(resting_ms)
    expected = [own if never or own <= resting_ms / 2 else np.nan for own in latency_ms]
    assert_array_equal(evoked_latency_ms(latency_ms, resting_ms), expected)


@given(st.lists(st.tuples(*[st.one_of(st.just(np.nan), st.integers(1, 6).map(float))] * 2), max_size=10))
def test_order_change_agrees_with_counting_all_pairs(pairs):
    first, second = np.array(pairs).reshape(-1, 2).T
    found = order_change(first, second)
    both = [(a, b) for a, b in pairs if not (np.isnan(a) or np.isnan(b))]
    assert found.both == len(both)
    assert found.either == sum(not (np.isnan(a) and np.isnan(b)) for a, b in pairs)
    swaps = [(a - c) * (b - d) < 0 for (a, b), (c, d) in itertools.combinations(both, 2)]
    assert_allclose(found.swapped, np.mean(swaps) if swaps else np.nan, rtol=1e-12)
    ranks = np.array([recruitment_rank([pair[touch] for pair in both]) for touch in (0, 1)])
    if len(both) > 1 and (np.ptp(ranks, axis=1) > 0).all():
        assert_allclose(found.rank_correlation, np.corrcoef(ranks)[0, 1], rtol=1e-9, atol=1e-12)
    else:
        assert np.isnan(found.rank_correlation)


EDGES_MS = [0.0, 2.0, 5.0, 10.0, 22.0]


@given(trains, st.data())
def test_the_histogram_is_what_a_loop_over_spikes_counts(spikes, data):
    group = data.draw(st.lists(st.integers(NO_GROUP, 2), min_size=len(spikes), max_size=len(spikes)))
    found = population_rate(spikes, EDGES_MS, np.array(group, dtype=int))
    for number in range(found.n_afferents.size):
        members = [spikes[afferent] for afferent in range(len(spikes)) if group[afferent] == number]
        assert found.n_afferents[number] == len(members)
        for bin_number, (start, end) in enumerate(itertools.pairwise(EDGES_MS)):
            counts = [sum(start < time <= end for time in train) for train in members]
            assert found.spikes[number, bin_number] == sum(counts)
            assert found.active[number, bin_number] == sum(count > 0 for count in counts)


@settings(max_examples=50)
@given(trains, st.floats(0.0, 30.0), st.lists(st.floats(0.1, 9.0), min_size=1, max_size=9))
def test_rate_integrates_to_the_number_of_spikes_smoothed_or_not(spikes, smoothing_ms, widths_ms):
    edges_ms = np.concatenate([[0.0], np.cumsum(widths_ms)])
    group = np.arange(len(spikes)) % 2
    found = population_rate(spikes, edges_ms, group, smoothing_ms)
    inside = (spikes.times_ms > 0.0) & (spikes.times_ms <= edges_ms[-1])
    owner = np.repeat(group, np.diff(spikes.offsets))
    for number, size in enumerate(found.n_afferents):
        integral = (found.rate_hz[number] * np.diff(edges_ms)).sum() * size / 1000.0
        assert_allclose(integral, (inside & (owner == number)).sum() if size else np.nan, rtol=1e-9)


def test_smoothing_is_the_integral_over_both_bins():
    """Both integrals by the midpoint rule, each wrong by up to h^2/24 of the second derivative."""
    edges_ms, smoothing_ms, step = np.array([0.0, 1.0, 3.0, 3.5]), 0.8, 0.005
    found = population_rate(SpikeTrains.from_lists([[2.0]]), edges_ms, smoothing_ms=smoothing_ms)
    fine = np.arange(step / 2, 3.5, step)
    source = fine[(fine > 1.0) & (fine < 3.0)]
    density = np.exp(-0.5 * ((fine[:, None] - source) / smoothing_ms) ** 2).sum(axis=1)
    shares = np.array([density[(fine > a) & (fine < b)].sum() for a, b in itertools.pairwise(edges_ms)])
    assert_allclose(found.spikes[0], shares / shares.sum(), rtol=1e-4)


def test_rate_of_a_patch_is_the_rate_per_afferent_times_the_density_and_nobody_has_none():
    """Clocks of 20 ms, 100 of them per cm2: 50 spikes/s each, 5000 spikes/s from a square centimetre."""
    clocks = SpikeTrains.from_lists([np.arange(20.0, 1001.0, 20.0) - phase for phase in range(20)])
    found = population_rate(clocks, [0.0, 500.0, 1000.0])
    assert_allclose(found.rate_hz, [[50.0, 50.0]], rtol=1e-12)
    assert_allclose(found.rate_per_area(100.0), [[5000.0, 5000.0]], rtol=1e-12)
    assert_array_equal(found.active_fraction, [[1.0, 1.0]])
    nobody = population_rate(SpikeTrains.from_lists([]), [0.0, 1.0])
    assert np.isnan(nobody.rate_hz).all()
    assert_array_equal(population_rate(SpikeTrains.from_lists([[], []]), [0.0, 1.0]).rate_hz, [[0.0]])


@given(st.lists(st.tuples(*[st.floats(-4.0, 4.0)] * 3), min_size=1, max_size=9))
def test_rings_part_the_plane_and_space_by_distance(places):
    radii = [0.5, 1.0, 2.5]
    for columns in (2, 3):
        positions = np.array(places)[:, :columns]
        centre = np.array([0.3, -0.2, 0.1])[:columns]
        found = rings(positions, centre, radii)
        for place, ring in zip(positions, found, strict=True):
            away = np.sqrt(sum((place - centre) ** 2))
            inside = [n for n in range(2) if radii[n] <= away < radii[n + 1]]
            # Distances that differ in the last bit may fall to either side of a radius.
            assert [ring] == (inside or [NO_GROUP]) or np.isclose(away, radii, rtol=1e-14).any()


test_what_cannot_be_used_is_refused = refusals(
    (lambda: recruitment_rank([[1.0]]), "latency_ms must have 1 dimension"),
    (lambda: recruitment_rank([np.inf]), "infinite times"),
    (lambda: evoked_latency_ms([1.0], -1.0), ("resting_latency_ms",)),
    (lambda: order_change([1.0], [1.0, 2.0]), "same afferents twice: got 1 and 2"),
    (lambda: population_rate(SpikeTrains.from_lists([[1.0]]), [0.0]), "at least one bin"),
    (lambda: population_rate(SpikeTrains.from_lists([[1.0]]), [1.0, 0.0]), "increase strictly"),
    (lambda: population_rate(SpikeTrains.from_lists([[1.0]]), [0.0, 1.0], [0, 0]), "one whole number"),
    (lambda: population_rate(SpikeTrains.from_lists([[1.0]]), [0.0, 1.0], [-2]), "count from 0"),
    (lambda: population_rate(SpikeTrains.from_lists([[1.0]]), [0.0, 1.0], None, -1.0), "not be negative"),
    (lambda: population_rate(SpikeTrains.from_lists([]), [0.0, 1.0]).rate_per_area(0.0), "greater than 0"),
    (lambda: rings([[0.0, 0.0]], [0.0, 0.0, 0.0], [0.0, 1.0]), "coordinates of the positions"),
    (lambda: rings([[0.0, 0.0]], [0.0, 0.0], [-1.0, 1.0]), "none negative"),
    (lambda: rings([[0.0, 0.0]], [0.0, 0.0], [1.0]), "at least two distances"),
)  # fmt: skip
