from dataclasses import replace

import numpy as np
from numpy.testing import assert_allclose, assert_array_equal
from scipy.interpolate import PchipInterpolator

from fingerpad import Traces
from fingerpad.neuron.lif import LeakyIntegrateAndFire
from fingerpad.neuron.transduction import Drive, Transduction, drive
from refusals import refusals

RAMP_MS = 50.0
TIMES_MS = np.concatenate([np.linspace(0.0, RAMP_MS, 9), RAMP_MS + np.geomspace(1.0, 950.0, 12)])


def ramp_and_hold(peaks_kpa=(1.0, 2.0, 3.0)):
    """SED that accelerates in the ramp and relaxes in the hold, at one site per peak."""
    rise = np.clip(TIMES_MS / RAMP_MS, 0.0, 1.0) ** 1.6
    relaxed = 1.0 - 0.15 * (1.0 - np.exp(-np.maximum(TIMES_MS - RAMP_MS, 0.0) / 120.0))
    return Traces(TIMES_MS, np.outer(rise * relaxed, peaks_kpa), kinks_ms=[RAMP_MS])


def test_a_straight_ramp_has_its_slope_and_the_rate_jumps_at_a_kink_and_nowhere_else():
    driven = drive(Traces([0.0, 50.0, 1000.0], [[0.0], [2.0], [2.0]], kinks_ms=[50.0]))
    ramp = (driven.times_ms > 0.0) & (driven.times_ms < 50.0)
    assert driven.rate_per_ms[0] == 0.0
    assert_allclose(driven.rate_per_ms[ramp], 0.04, rtol=1e-12)
    assert_allclose(driven.values[ramp, 0], 0.04 * driven.times_ms[ramp], rtol=1e-12)
    assert_array_equal(driven.rate_per_ms[driven.times_ms > 50.0], 0.0)
    driven = drive(ramp_and_hold())
    repeated = np.flatnonzero(np.diff(driven.times_ms) == 0.0)
    assert_array_equal(driven.times_ms[repeated], [0.0, RAMP_MS])
    before, after = driven.rate_per_ms[repeated[1]], driven.rate_per_ms[repeated[1] + 1]
    assert (before > 5.0 * after).all()
    assert_allclose(driven.values[repeated], driven.values[repeated + 1], rtol=1e-15)
    smooth = Traces(TIMES_MS, ramp_and_hold().values)
    times = drive(smooth).times_ms
    assert_array_equal(times[:-1][np.diff(times) == 0.0], [0.0])
    plain = drive(Traces([0.0, 10.0], [[0.0], [1.0]]))
    marked = drive(Traces([0.0, 10.0], [[0.0], [1.0]], kinks_ms=[0.0, 10.0]))
    assert_array_equal(plain.times_ms, marked.times_ms)
    assert_array_equal(plain.rate_per_ms, marked.rate_per_ms)


def test_the_rate_is_the_limit_of_the_printed_difference():
    sed, step = ramp_and_hold(), 1e-4
    driven = drive(sed)
    within = PchipInterpolator(TIMES_MS[TIMES_MS <= RAMP_MS], sed.values[TIMES_MS <= RAMP_MS])
    at = (driven.times_ms > step) & (driven.times_ms < RAMP_MS)
    printed = np.abs(within(driven.times_ms[at]) - within(driven.times_ms[at] - step)) / step
    assert_allclose(driven.rate_per_ms[at], printed, rtol=1e-3, atol=1e-5)


def test_twice_as_many_pieces_move_no_spike_by_more_than_the_documented_bound():
    sed, gains = ramp_and_hold(np.linspace(0.3, 3.0, 20)), Transduction(0.0, 2e-4, 1e-6)
    neuron = LeakyIntegrateAndFire(68.0, 1e-6, 50.0, 1.0)
    default = neuron.spikes(gains.current(sed))
    finer = neuron.spikes(gains.current(drive(sed, pieces=64, shortest_piece_ms=0.125)))
    assert default.times_ms.size > 300
    assert_array_equal(default.offsets, finer.offsets)
    moved = np.abs(default.times_ms - finer.times_ms)
    assert moved.max() < 0.1
    assert np.median(moved) < 0.005


def test_current_is_the_linear_combination_of_equation_1_of_traces_or_their_drive():
    driven = Drive([0.0, 1.0], [[2.0], [4.0]], [[0.0], [3.0]])
    current = Transduction(0.5, 10.0, 0.25).current(driven)
    assert_array_equal(current.values, [[1.0], [0.5 + 30.0 + 1.0]])
    assert_array_equal(current.times_ms, driven.times_ms)
    sed, gains = ramp_and_hold(), Transduction(1e-7, 2e-4, 1e-6)
    assert_array_equal(gains.current(sed).values, gains.current(drive(sed)).values)


ONE = Traces([0.0, 1.0], [[0.0], [1.0]])


test_what_cannot_be_used_is_refused = refusals(
    (lambda: Traces([0.0, 1.0], [[0.0], [1.0]], kinks_ms=[0.5]), "kinks_ms must be among times_ms"),
    (lambda: Traces([0.0, 1.0], [[0.0], [1.0]], kinks_ms=[1.0, 0.0]), "kinks_ms must increase"),
    (lambda: replace(ONE, dynamic=ONE), "dynamic must hold another quantity"),
    (lambda: replace(ONE, dynamic=Traces([0.0, 1.0], np.ones((2, 2)), quantity="work")), "dynamic must"),
    (lambda: Traces([0.0, 1.0], [[0.0], [-1.0]], quantity="work"), "must not be negative"),
    (lambda: Traces([0.0, 50.0], [[np.inf, 1.0], [-np.inf, 1.0]]),
     "finite numbers only: 2 are not, first in row and column 1, 1"),
    (lambda: Traces([0.0, 0.0, 0.0], np.zeros((3, 1)), quantity="current"), "nor repeat more than once"),
    (lambda: Traces([0.0, 2.0, 1.0], np.zeros((3, 1)), quantity="current"), "must not decrease"),
    (lambda: Drive([0.0, 1.0], np.zeros((2, 1)), np.zeros((2, 2))), "Drive needs one row"),
    (lambda: Transduction(np.nan, 0.0, 0.0), ("intercept_ma",)),
    (lambda: drive(ramp_and_hold(), pieces=0), ("pieces",)),
    (lambda: drive(ramp_and_hold(), shortest_piece_ms=-1.0), ("shortest_piece_ms",)),
)  # fmt: skip


def test_the_fast_evaluation_is_that_of_the_interpolants_themselves():
    """SciPy evaluates value and derivative one after the other; the kernel writes both at once."""
    rng = np.random.default_rng(11)
    times = np.array([0.0, 3.0, 20.0, 50.0, 51.0, 90.0, 400.0])
    sed = Traces(times, rng.uniform(0.0, 4.0, (7, 5)), kinks_ms=[50.0])
    fast = drive(sed)
    for first, last in ((0, 3), (3, 6)):
        plain = PchipInterpolator(times[first : last + 1], sed.values[first : last + 1], axis=0)
        # The first knot of all is repeated, before and after the onset; the kink ends one phase, begins one.
        at = np.flatnonzero((fast.times_ms >= times[first]) & (fast.times_ms <= times[last]))
        at = at[1:-1] if first == 0 else at[1:]
        assert_allclose(fast.values[at], plain(fast.times_ms[at]), rtol=1e-14)
        assert_allclose(fast.rate_per_ms[at], abs(plain(fast.times_ms[at], nu=1)), rtol=1e-13, atol=1e-17)
    assert (fast.times_ms == 50.0).sum() == 2
    assert np.isin(times, fast.times_ms).all()


def test_traces_share_the_memory_of_checked_values_only():
    given = np.array([[0.0, 0.0], [1.0, 2.0]])
    sed = Traces([0.0, 50.0], given)
    given[1] = 9.0
    assert sed.values[1].tolist() == [1.0, 2.0]
    assert np.shares_memory(sed.part(slice(1, 2)).values, sed.values)
    frozen = given[:, :1]
    frozen.setflags(write=False)
    held = Traces([0.0, 50.0], frozen)
    given[1] = 7.0
    assert held.values[1, 0] == 9.0
    huge = np.full((2, 2), 1e308)
    assert_array_equal(Traces([0.0, 50.0], huge).values, huge)


def test_a_part_of_traces_or_of_their_drive_is_that_of_its_sites():
    energy = ramp_and_hold()
    both = Traces(
        TIMES_MS,
        energy.values,
        [RAMP_MS],
        dynamic=Traces(TIMES_MS, energy.values[:, ::-1] ** 2, quantity="von_mises"),
    )
    for sed in (energy, both):
        assert_array_equal(sed.part(slice(1, 3)).values, sed.values[:, 1:])
        assert_array_equal(sed.part(slice(1, 3)).kinks_ms, sed.kinks_ms)
        part, whole = drive(sed).part(slice(0, 2)), drive(sed.part(slice(0, 2)))
        assert_array_equal(part.rate_per_ms, whole.rate_per_ms)
        assert_array_equal(part.rate_per_ms, drive(sed).rate_per_ms[:, :2])
        assert_array_equal(part.values, whole.values)
        assert part.dynamic_quantity == whole.dynamic_quantity == sed.dynamic_quantity
        assert part.n_sites == 2


def test_the_dynamic_term_follows_what_the_traces_bring_and_the_static_term_energy():
    energy, stress = ramp_and_hold(), Traces(TIMES_MS, np.sqrt(ramp_and_hold().values), [RAMP_MS])
    both = Traces(
        TIMES_MS,
        energy.values,
        [RAMP_MS],
        dynamic=Traces(TIMES_MS, stress.values, quantity="compressive_stress"),
    )
    for options in ({}, {"pieces": 4}):
        driven = drive(both, **options)
        assert_array_equal(driven.values, drive(energy, **options).values)
        assert_array_equal(driven.rate_per_ms, drive(stress, **options).rate_per_ms)
        assert driven.dynamic_quantity == "compressive_stress"


def test_both_terms_may_follow_one_other_quantity():
    energy = ramp_and_hold()
    stress = Traces(TIMES_MS, energy.values, [RAMP_MS], quantity="von_mises")
    driven = drive(stress)
    assert_array_equal(driven.rate_per_ms, drive(energy).rate_per_ms)
    for kept in (driven, driven.part(slice(0, 1)), stress.part(slice(0, 1)), stress.scaled(np.ones(3))):
        assert kept.dynamic_quantity == kept.static_quantity == "von_mises"
