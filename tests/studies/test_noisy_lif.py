"""Noisy membranes against exact ones with the same noise written out, and against closed forms."""

import math

import numpy as np
import pytest
from numpy.testing import assert_allclose, assert_array_equal
from scipy.integrate import quad
from scipy.special import erfcx

from fingerpad.core import threads
from fingerpad.core.errors import InputError
from fingerpad.core.random_streams import Presentations, Purpose, normals
from fingerpad.core.signals import CurrentTraces
from fingerpad.neuron.lif import LeakyIntegrateAndFire
from studies.interval_statistics import interval_statistics
from studies.membrane_noise import (
    CorrelatedCurrentNoise,
    GainNoise,
    MembraneNoise,
    ThresholdNoise,
    WhiteCurrentNoise,
    log_spread,
)
from studies.noisy_lif import noisy_spikes

TAU, CAPACITANCE, THRESHOLD, REFRACTORY = 68.0, 1e-6, 50.0, 1.0
NEURON = LeakyIntegrateAndFire(TAU, CAPACITANCE, THRESHOLD, REFRACTORY, initial_mv=0.0)
SEED = 12


def steady(current_ma, end_ms=1000.0):
    return CurrentTraces([0.0, end_ms], [[current_ma], [current_ma]])


def touched():
    """A ramp, a jump down and a decay, at four strengths; the last falls silent."""
    times = [0.0, 20.0, 60.0, 60.0, 350.0]
    shape = np.array([[0.0], [6e-6], [4e-6], [1.5e-6], [1e-6]])
    return CurrentTraces(times, shape * [0.5, 1.0, 2.0, 0.1])


SILENT_NOISE = {
    "none": MembraneNoise(),
    "white current": MembraneNoise(current=WhiteCurrentNoise(0.0, step_ms=0.37)),
    "correlated current": MembraneNoise(current=CorrelatedCurrentNoise(0.0, 5.0, step_ms=0.37)),
    "threshold": MembraneNoise(threshold=ThresholdNoise(0.0)),
    "gain": MembraneNoise(gain=GainNoise(0.0)),
}


@pytest.mark.parametrize("name", list(SILENT_NOISE))
def test_without_noise_the_spikes_are_the_exact_ones(name):
    expected = NEURON.spikes(touched())
    found = noisy_spikes(NEURON, touched(), SILENT_NOISE[name], SEED)
    assert np.diff(expected.offsets).tolist() == [2, 9, 20, 0]
    assert_array_equal(found.offsets, expected.offsets)
    assert_allclose(found.times_ms, expected.times_ms, rtol=1e-12)


@pytest.mark.parametrize(
    "of_size",
    [
        lambda size: MembraneNoise(current=WhiteCurrentNoise(1e-6 * size)),
        lambda size: MembraneNoise(current=CorrelatedCurrentNoise(1e-6 * size, 5.0)),
        lambda size: MembraneNoise(threshold=ThresholdNoise(size)),
        lambda size: MembraneNoise(gain=GainNoise(size)),
    ],
)
def test_spikes_move_in_proportion_to_little_noise(of_size):
    exact = NEURON.spikes(steady(2e-6)).times_ms
    large, small = (noisy_spikes(NEURON, steady(2e-6), of_size(size), SEED).times_ms for size in (1e-4, 1e-6))
    assert exact.size == large.size == small.size > 20
    assert 1e-3 < np.abs(large - exact).max() < 1.0
    assert_allclose(small - exact, (large - exact) / 100.0, atol=1e-3 * np.abs(large - exact).max())


def written_out(noise, trial, end_ms):
    """Knots and current of 2 µA with the noise of one trial, from the public numbers of its key."""
    steps = round(end_ms / noise.step_ms)
    z = normals(SEED, [trial], [0], Purpose.CURRENT, steps + 1)[0, 0]
    edges = noise.step_ms * np.arange(steps + 1)
    if isinstance(noise, WhiteCurrentNoise):
        return np.repeat(edges, 2)[1:-1], 2e-6 + noise.level_ma(TAU) * np.repeat(z[:-1], 2)
    levels = np.empty(steps + 1)
    levels[0] = z[0]
    rho = math.exp(-noise.step_ms / noise.correlation_ms)
    for k in range(steps):
        levels[k + 1] = rho * levels[k] + math.sqrt(1.0 - rho**2) * z[k + 1]
    return edges, 2e-6 + noise.standard_deviation_ma * levels


@pytest.mark.parametrize("noise", [WhiteCurrentNoise(2e-6, 0.25), CorrelatedCurrentNoise(1e-6, 8.0, 0.25)])
def test_current_noise_is_the_exact_membrane_under_the_noisy_current(noise):
    found = noisy_spikes(
        NEURON, steady(2e-6), MembraneNoise(current=noise), SEED, Presentations.of_one_afferent(1, 3)
    )
    for trial in range(3):
        times, current = written_out(noise, trial, 1000.0)
        expected = NEURON.spikes(CurrentTraces(times, current[:, np.newaxis]))[0]
        assert expected.size > 20
        assert_allclose(found[trial], expected, rtol=1e-10)


@pytest.mark.parametrize("step_ms", [0.01, 1.0, 30.0])
def test_white_noise_gives_the_free_potential_its_variance_at_any_step(step_ms):
    """Stationary variance of C du = -u/R dt + D dW is D² tau/(2 C²)."""
    noise = WhiteCurrentNoise(3e-6, step_ms)
    e = math.exp(-step_ms / TAU)
    added = (TAU / CAPACITANCE * (1.0 - e) * noise.level_ma(TAU)) ** 2
    assert_allclose(added / (1.0 - e**2), 0.5 * TAU * (3e-6 / CAPACITANCE) ** 2, rtol=1e-12)


def mean_interval_by_siegert(current_ma, intensity, threshold_mv):
    """First passage from 0 to the threshold of the potential under white noise, plus the rest."""
    mean, spread = current_ma * TAU / CAPACITANCE, intensity / CAPACITANCE * math.sqrt(TAU)
    low, high = -mean / spread, (threshold_mv - mean) / spread
    return REFRACTORY + TAU * math.sqrt(math.pi) * quad(lambda x: erfcx(-x), low, high)[0]


@pytest.mark.parametrize("current_ma", [0.7e-6, 1.5e-6])
def test_white_noise_fires_at_the_rate_of_siegert(current_ma):
    """Crossings are seen at the ends of steps, as if the threshold were 0.5826 D sqrt(h)/C higher.

    (Chernoff 1965; the number is -zeta(1/2)/sqrt(2 pi).)
    """
    intensity, step_ms, end_ms = 2e-6, 0.3, 20_000.0
    noise = MembraneNoise(current=WhiteCurrentNoise(intensity, step_ms))
    trains = noisy_spikes(
        NEURON, steady(current_ma, end_ms), noise, SEED, Presentations.of_one_afferent(1, 60)
    )
    found = interval_statistics(trains, (0.0, end_ms))
    mean_ms = float(np.sum(found.mean_ms * found.count) / found.count.sum())
    error_ms = float(np.mean(found.coefficient_of_variation)) * mean_ms / math.sqrt(found.count.sum())
    seen_late = 0.5826 * intensity / CAPACITANCE * math.sqrt(step_ms)
    expected = mean_interval_by_siegert(current_ma, intensity, THRESHOLD + seen_late)
    assert abs(mean_ms - expected) < 3.0 * error_ms
    # Precise enough to see that the excursions within steps are missing.
    assert mean_ms - mean_interval_by_siegert(current_ma, intensity, THRESHOLD) > 5.0 * error_ms


def test_threshold_noise_makes_intervals_of_the_closed_form():
    current_ma, spread = 2e-6, log_spread(0.2)
    train = noisy_spikes(NEURON, steady(current_ma), MembraneNoise(threshold=ThresholdNoise(0.2)), SEED)[0]
    z = normals(SEED, 1, 1, Purpose.THRESHOLD, train.size)[0, 0]
    thresholds = THRESHOLD * np.exp(spread * z - 0.5 * spread**2)
    charging = -TAU * np.log1p(-thresholds * CAPACITANCE / (current_ma * TAU))
    assert train.size > 25
    assert_allclose(train, np.cumsum(charging) + REFRACTORY * np.arange(train.size), rtol=1e-11)


def test_a_log_normal_factor_has_mean_1_and_the_deviation_asked_for():
    factors = GainNoise(0.3).factors(SEED, Presentations.of_one_afferent(1, 20_000))
    assert abs(factors.mean() - 1.0) < 3.5 * 0.3 / math.sqrt(factors.size)
    assert abs(factors.std() - 0.3) < 0.01


def test_gain_noise_multiplies_the_current_of_touch_and_not_the_intercept():
    presentations = Presentations([0, 1, 2, 0], [0, 1, 2, 3], [5, 5, 6, 6])
    intercept = 0.3e-6
    touch = touched()
    for new_for in ("presentation", "receptor"):
        noise = GainNoise(0.4, new_for)
        factors = noise.factors(SEED, presentations)
        found = noisy_spikes(NEURON, touch, MembraneNoise(gain=noise), SEED, presentations, intercept)
        by_hand = intercept + factors * (touch.current_ma[:, presentations.sites] - intercept)
        expected = NEURON.spikes(CurrentTraces(touch.times_ms, by_hand))
        assert_allclose(found.times_ms, expected.times_ms, rtol=1e-11)
        same = factors[0] == factors[1], factors[2] == factors[3], factors[0] == factors[2]
        assert same == ((True, True, False) if new_for == "receptor" else (False, False, False))


EVERYTHING = MembraneNoise(CorrelatedCurrentNoise(0.5e-6, 4.0), ThresholdNoise(0.1), GainNoise(0.1))


def test_the_same_seed_gives_the_same_spikes_on_any_number_of_threads(monkeypatch):
    presentations = Presentations.of_population(4, n_trials=25)
    trains = {}
    for number in (1, 3):
        monkeypatch.setattr(threads, "available_threads", lambda number=number: number)
        trains[number] = noisy_spikes(NEURON, touched(), EVERYTHING, SEED, presentations)
    assert_array_equal(trains[1].times_ms, trains[3].times_ms)
    alone = noisy_spikes(NEURON, touched(), EVERYTHING, SEED, Presentations([2], [17], [2]))
    assert_array_equal(alone[0], trains[1][17 * 4 + 2])
    other = noisy_spikes(NEURON, touched(), EVERYTHING, SEED + 1, presentations)
    assert not np.array_equal(other.times_ms, trains[1].times_ms)


def test_each_source_draws_its_own_numbers():
    """The gain of a train is the same whether its threshold is noisy or not."""
    presentations = Presentations.of_one_afferent(1, 2)
    gain = GainNoise(0.2)
    factors = gain.factors(SEED, presentations)
    both = MembraneNoise(threshold=ThresholdNoise(0.2), gain=gain)
    found = noisy_spikes(NEURON, steady(3e-6), both, SEED, presentations)
    for trial, factor in enumerate(factors):
        one = Presentations([0], [trial], [0])
        by_hand = noisy_spikes(
            NEURON, steady(3e-6 * factor), MembraneNoise(threshold=ThresholdNoise(0.2)), SEED, one
        )
        assert_allclose(found[trial], by_hand[0], rtol=1e-11)


@pytest.mark.parametrize(
    ("make", "said"),
    [
        (lambda: WhiteCurrentNoise(-1.0), "intensity_ma_sqrt_ms"),
        (lambda: WhiteCurrentNoise(1.0, 0.0), "step_ms"),
        (lambda: CorrelatedCurrentNoise(-1.0, 1.0), "standard_deviation_ma"),
        (lambda: CorrelatedCurrentNoise(1.0, 0.0), "correlation_ms"),
        (lambda: CorrelatedCurrentNoise(1.0, 1.0, 2.0), "step_ms must not exceed correlation_ms"),
        (lambda: ThresholdNoise(-0.1), "relative_standard_deviation"),
        (lambda: GainNoise(math.nan), "relative_standard_deviation"),
        (lambda: GainNoise(0.1, "trial"), "new_for must be one of presentation, receptor"),
        (lambda: noisy_spikes(NEURON, steady(1.0), 0.1, SEED), "noise must be of type MembraneNoise"),
        (
            lambda: noisy_spikes(NEURON, steady(1.0), MembraneNoise(), SEED, Presentations([1], [0], [0])),
            "sites must be within 0 ... 0: got 1",
        ),
        (lambda: Presentations([0, 0], [0, 0], [3, 3]), "different trial for each train of a receptor"),
        (lambda: Presentations([0, 0], [0], [3]), "one site, trial and receptor per train"),
        (lambda: Presentations([-1], [0], [3]), "sites must be a whole number"),
    ],
)
def test_noise_that_makes_no_sense_is_refused(make, said):
    with pytest.raises(InputError, match=said):
        make()
