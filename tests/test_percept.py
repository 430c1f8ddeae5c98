"""The percept: observed hit rates, statistics of sessions, other decodings, mesh noise."""

import math

import numpy as np
import pytest
from numpy.testing import assert_allclose
from scipy.special import ndtri

from fingerpad import Population
from fingerpad.core.random_streams import Purpose, normals
from fingerpad.experiments.gerling2014 import percept as goodwin
from fingerpad.experiments.gerling2014.percept import (
    SWEPT_NOISE,
    Observers,
    discrepancy_analysis,
    discrimination_statistics,
    expected_of_measure,
    observe,
    rise_needed,
)
from fingerpad.experiments.scores import Estimate, estimate, extreme
from fingerpad.psychophysics.curve import binomial_interval
from fingerpad.psychophysics.encoding import Measured, Noise, gradient_sum, neighbour_pairs, taking_part
from fingerpad.psychophysics.observer import (
    EuclideanDistance,
    Experiment,
    GradientSum,
    discriminate_by,
    expected_euclidean_hit_rates,
    fit_noise_sigma,
)

CURVATURES = (287.0, 296.0, 305.0, 316.0, 328.0, 340.0, 365.0)
GRID = Population.grid()
PAIRS = neighbour_pairs(GRID.positions_mm, GRID.pitch_mm)
TWO = np.array([[0, 1]])


def bumps(centre_mm=17.37, steepness=1.0):
    """Rates that grow and sharpen with curvature, as under a sphere."""
    x, z = (GRID.positions_mm - [centre_mm, 0.0]).T
    width = 1.8 * (287.0 / np.array(CURVATURES)[:, np.newaxis]) ** steepness
    return 40.0 * np.exp(-(x**2 + z**2) / (2.0 * width**2))


@pytest.mark.parametrize(("hits", "trials"), [(58, 100), (95, 100), (3, 20)])
def test_a_binomial_interval_leaves_half_of_the_doubt_on_either_side_or_ends_at_always_or_never(hits, trials):
    """Clopper & Pearson by their definition, summed term by term."""

    def tail(chance, numbers):
        return sum(math.comb(trials, k) * chance**k * (1.0 - chance) ** (trials - k) for k in numbers)

    low, high = binomial_interval(hits / trials, trials)
    assert tail(float(low), range(hits, trials + 1)) == pytest.approx(0.025, rel=1e-9)
    assert tail(float(high), range(hits + 1)) == pytest.approx(0.025, rel=1e-9)
    low, high = binomial_interval([0.0, 1.0], 10)
    assert (low[0], high[1]) == (0.0, 1.0)
    assert low[1] == pytest.approx(0.025 ** (1 / 10))


def test_what_is_known_of_people_is_a_straight_line_in_z_with_intervals():
    assert_allclose(goodwin.line_in_z(goodwin.GOODWIN_CURVATURES), goodwin.HIT_RATES, rtol=1e-12)
    slopes = np.diff(ndtri(goodwin.line_in_z([290.0, 310.0, 330.0, 350.0])))
    assert_allclose(slopes, slopes[0], rtol=1e-9)
    assert slopes[0] / 20.0 == pytest.approx((ndtri(0.95) - ndtri(0.58)) / 69.0)
    known = goodwin.goodwin_hit_rates()
    assert (known.low < known.hit_rate).all()
    assert (known.hit_rate < known.high).all()
    fits = [
        n for n in range(1, 101) if all(abs(n * rate - round(n * rate)) < 1e-9 for rate in goodwin.HIT_RATES)
    ]
    assert fits[0] == goodwin.TRIALS == 100


@pytest.fixture(scope="module")
def sessions():
    measures = {
        "static": [Measured(bumps(), PAIRS), Measured(bumps(17.57), PAIRS)],
        "dynamic": [Measured(3.0 * bumps(), PAIRS), Measured(2.0 * bumps(17.57), PAIRS)],
    }
    return measures, observe(measures, 0.06, seed=4, sessions=2)


def test_every_observer_of_a_session_is_the_one_who_is_asked_alone(sessions):
    measures, observers = sessions
    assert observers.mean["static"].shape == (2, 2, 6)
    others = {
        "static": {},
        "sigma_0.025": {"noise_sigma": 0.025},
        "ten_matrices": {"experiment": Experiment(presentations=10)},
        "criterion_0.02": {"experiment": Experiment(criterion_sigma=0.02)},
    }
    for repeat, position in np.ndindex(2, 2):
        session = 1 + 2 * repeat + position
        static, dynamic = (measures[name][position].responses for name in ("static", "dynamic"))

        def asked(rates, noise_sigma=0.06, experiment=Experiment(), session=session):  # noqa: B008
            return discriminate_by(GradientSum(PAIRS), rates, noise_sigma, 4, experiment, session=session)

        alone = {name: asked(static, **other) for name, other in others.items()}
        alone["euclidean"] = discriminate_by(EuclideanDistance(), static, 0.06, 4, session=session)
        alone["dynamic"] = asked(dynamic)
        for name, rates in alone.items():
            assert_allclose(observers.mean[name][repeat, position], rates.hit_rate, rtol=1e-12)
            assert_allclose(observers.spread[name][repeat, position], rates.hit_rate_sd, rtol=1e-9)


def test_the_mean_of_ten_hit_rates_is_unsteadier_by_the_root_of_ten(sessions):
    few, many = (sessions[1].unsteadiness[count] for count in (10, 100))
    assert_allclose(few / many, math.sqrt(10.0), rtol=0.25)


def made_up(seed=3, n_sessions=400, spread=0.05):
    """Observers whose hit rates are known but for noise."""
    draw = np.random.default_rng(seed).standard_normal
    rising = np.array([0.58, 0.65, 0.73, 0.80, 0.87, 0.95])
    known = {
        "static": np.array([rising, np.add(rising, [0.01, 0.01, 0.01, 0.01, 0.01, 0.03])]),
        "dynamic": np.array([rising + 0.1, rising - [0.1, 0.0, 0.0, 0.0, 0.0, 0.0]]),
        "euclidean": np.array([rising, rising]),
        "ten_matrices": np.array([rising, rising]),
        "criterion_0.01": np.array([rising, rising]),
        "criterion_0.02": np.array([rising, rising - 0.004]),
    }
    known |= {f"sigma_{sigma:g}": np.array([rising, rising]) - sigma for sigma in SWEPT_NOISE}
    noisy = {name: rates + spread * draw((n_sessions, 2, 6)) for name, rates in known.items()}
    widths = dict.fromkeys(known, 0.02) | {"ten_matrices": 0.06, "criterion_0.02": 0.03}
    spreads = {name: np.full((n_sessions, 2, 6), width) for name, width in widths.items()}
    unsteadiness = {10: np.full((n_sessions, 2), 0.006), 100: np.full((n_sessions, 2), 0.002)}
    return Observers(noisy, spreads, unsteadiness)


def test_an_estimate_is_a_mean_with_its_error_and_an_extreme_is_sought_in_the_means():
    values = np.array([1.0, 2.0, 4.0, 5.0])
    found = estimate(values)
    assert (found.value, found.error) == (3.0, pytest.approx(np.std(values, ddof=1) / 2.0))
    # Ten changes of 0 but one: in any session the largest is noise, over many it is the one.
    changes = np.random.default_rng(1).standard_normal((400, 10)) + np.eye(10)[3] * 0.5
    assert extreme(changes, np.argmax).value == pytest.approx(0.5, abs=0.15)
    assert changes.max(axis=1).mean() > 1.4


def test_statistics_are_those_of_known_hit_rates():
    found = discrimination_statistics(made_up(spread=1e-9), ("static", "dynamic"))

    def value(found: Estimate):
        return pytest.approx(found.value, abs=1e-6)

    assert value(found.misfit["static"]) == math.sqrt((0.01**2 + 0.03**2) / 4)
    assert value(found.misfit["dynamic"]) == math.sqrt((3 * 0.1**2) / 4)
    assert value(found.misfit_above_static["euclidean"]) == -found.misfit["static"].value
    assert value(found.shift["static"]) == 0.03
    assert value(found.shift["dynamic"]) == 0.2
    assert value(found.shift_above_static["dynamic"]) == 0.17
    assert value(found.smallest_rise["static"][0]) == 0.07
    assert value(found.smallest_rise["dynamic"][1]) == -0.02  # from chance to the first comparison
    assert value(found.noise_lowers["smallest_fall"]) == 0.01
    assert value(found.ten_matrices["ratio"]) == 3.0
    assert value(found.criterion["ratio"]) == 1.5
    assert value(found.criterion["change"]) == 0.004
    assert value(found.unsteadiness["ratio"]) == 3.0
    assert value(found.targets[1].at_goodwin[0]) == 0.59
    line = goodwin.line_in_z(CURVATURES[1:])
    away = np.array([0.65, 0.73, 0.80, 0.87]) - line[1:5]
    assert value(found.targets[0].largest_from_line) == np.abs(away).max()
    # Goodwin's own points, the last of which is farther from the line here, do not count.
    assert value(found.targets[1].largest_from_line) == np.abs(away + 0.01).max()


@pytest.mark.parametrize("noise", [0.03, 0.058, 0.12, Noise(0.04, offset=30.0)], ids=str)
def test_few_receptors_give_a_skewed_distance_that_the_closed_form_knows(noise):
    """Twelve receptors, as respond to a sphere: without the skewness rates near chance are 0.02 too high."""
    values = np.linspace(10.0, 55.0, 12) * np.array([[1.0], [1.03], [1.06], [1.2]])
    sampled = discriminate_by(EuclideanDistance(), values, noise, 3, Experiment(hit_rates=4000)).hit_rate
    assert_allclose(sampled, expected_euclidean_hit_rates(values, noise), atol=0.005)


def test_receptors_that_are_silent_once_take_no_part_in_latencies():
    latency_ms = 60.0 - bumps()
    latency_ms[3, [0, 5]] = np.nan
    measured = taking_part(latency_ms, PAIRS)
    assert not np.isin(measured.neighbours, [0, 5]).any()
    assert len(measured.neighbours) == len(PAIRS) - 6  # two corners of the grid, three neighbours each
    without = np.delete(np.arange(18), [0, 5])
    fewer = neighbour_pairs(GRID.positions_mm[without], GRID.pitch_mm)
    assert_allclose(
        gradient_sum(measured.responses, measured.neighbours), gradient_sum(latency_ms[:, without], fewer)
    )
    assert not len(taking_part(np.full((7, 18), np.nan), PAIRS).neighbours)


def test_one_noise_for_two_positions_is_that_of_equal_ones():
    draws = normals(0, 1, 18, Purpose.RESPONSE, 2000)[0].T
    here = Measured(bumps(steepness=0.6), PAIRS)
    both = goodwin.fit_noise_to_goodwin(lambda sigma: expected_of_measure([here, here], draws, sigma))
    alone = fit_noise_sigma(lambda sigma: expected_of_measure([here], draws, sigma)[0, [0, 5]])
    assert both.noise_sigma == pytest.approx(alone.noise_sigma, rel=1e-6)


def test_the_rise_that_a_noise_needs_has_its_closed_form():
    """Sum of two receptors: Normal(2 (b - a), 2 sigma hypot(a, b)); z = (rise of b) / (2 sigma hypot)."""
    sigma, z = 0.02, ndtri(0.95)
    measured = Measured(np.array([[50.0, 80.0], [50.0, 81.0]]), TWO)
    draws = np.random.default_rng(1).standard_normal((200_000, 2))
    rise = rise_needed(measured, sigma, draws)
    farther = 80.0 + 30.0 * rise
    assert (farther - 80.0) / (2.0 * sigma * math.hypot(50.0, farther)) == pytest.approx(z, rel=0.01)
    # So little noise that the usual rise is too much, and one that no such rise overcomes.
    assert rise_needed(measured, 0.002, draws) < rise
    assert math.isnan(rise_needed(measured, 0.9, draws))


def test_the_analysis_names_every_interpretation_and_the_noise_that_fits_it():
    static = [Measured(bumps(17.37, 0.6), PAIRS), Measured(bumps(17.57, 0.6), PAIRS)]
    latency_ms = [60.0 - one.responses for one in static]
    latency_ms[0][:, 0] = np.nan
    measures = {
        "static": static,
        "dynamic": static,
        "latency": [taking_part(latency, PAIRS) for latency in latency_ms],
    }
    draws = normals(0, 1, 18, Purpose.RESPONSE, 1000)[0].T
    found = discrepancy_analysis(measures, latency_ms, GRID, 0.06, draws, seed=1)
    named = {one.reading: one for one in found.readings}
    assert len(named) == 7
    assert named["latency of receptors that fire under every sphere (used)"].receptors.tolist() == [17, 18]
    used = named["static, eight neighbours (used)"]
    assert named["dynamic, eight neighbours (used)"].noise_sigma == used.noise_sigma
    at_own = expected_of_measure(static, draws, used.noise_sigma)[:, [0, 5]]
    assert used.misfit == pytest.approx(np.sqrt(np.square(at_own - goodwin.HIT_RATES).mean()))
    sums = gradient_sum(static[0].responses, PAIRS)
    assert used.rise[0] == pytest.approx(sums[-1] / sums[0] - 1.0)
    curve = found.misfit_curve
    lowest = curve.noise_sigma[int(np.argmin(curve.misfit["static"]))]
    assert lowest == pytest.approx(used.noise_sigma, abs=0.01)
    # A wavering fraction moves the point by a share of the small way between means, not of the point.
    point, fraction = (found.criterion[name] for name in ("point", "fraction"))
    assert (fraction < 0.2 * point).all()
