import math
import os
import subprocess
import sys

import numpy as np
import pytest
from numpy.testing import assert_allclose, assert_array_equal
from scipy.optimize import brentq
from scipy.special import ndtr
from scipy.stats import norm

from fingerpad import ConvergenceError, InputError, Population
from fingerpad.core.random_streams import Purpose, normals, uniforms
from fingerpad.psychophysics.encoding import (
    LARGEST_SESSION,
    TRIALS_PER_SESSION,
    Noise,
    gradient_sum,
    neighbour_pairs,
    noisy_gradient_sums,
    noisy_responses,
    session_trials,
    shared_noise_gradient_sums,
)
from fingerpad.psychophysics.observer import (
    END_OF_STIMULUS_MS,
    EuclideanDistance,
    Experiment,
    GradientSum,
    discriminate_by,
    expected_hit_rates,
    fit_noise_sigma,
    likelihood_point,
)
from refusals import refusals

GRID = Population.grid()
PAIRS = neighbour_pairs(GRID.positions_mm, GRID.pitch_mm)
SMALL = Experiment(presentations=6, distributions=4, pairs=5, hit_rates=7, presentations_varied=9)
CURVATURES = np.array([287.0, 296.0, 305.0, 316.0, 328.0, 340.0, 365.0])
TWO = [[0, 1]]


def standard_normals(seed, shape):
    return np.random.default_rng(seed).standard_normal(shape)


def bumps(curvatures=CURVATURES):
    """Rates that grow and sharpen with curvature, as under a sphere."""
    x, z = (GRID.positions_mm - [17.37, 0.0]).T
    width = 1.8 * 287.0 / np.asarray(curvatures)[:, np.newaxis]
    return 40.0 * np.exp(-(x**2 + z**2) / (2.0 * width**2))


def one_by_one(sphere, sigma, seed, trial, count):
    """(a): one presentation after the other, each number looked up by its key."""
    varied = []
    for receptor, value in enumerate(sphere):
        numbers = normals(seed, [trial], [receptor], Purpose.RESPONSE, count)[0, 0]
        varied.append([value * (1.0 + sigma * number) for number in numbers])
    return list(zip(*varied, strict=True))


def picked(seed, trial, count, choices):
    """Numbers below `choices`, looked up by their key."""
    return [int(u * choices) for u in uniforms(seed, [trial], [0], Purpose.PICK, count)[0, 0]]


def mean_and_sd(numbers):
    mean = sum(numbers) / len(numbers)
    return mean, math.sqrt(sum((number - mean) ** 2 for number in numbers) / (len(numbers) - 1))


def normal_beyond(point, mean, sd, side):
    return 0.5 * math.erfc(-side * (mean - point) / sd / math.sqrt(2.0))


@pytest.mark.parametrize("session", [0, 3])
def test_gradient_sum_follows_the_printed_steps(session):
    values, sigma, plan, seed = bumps([287.0, 310.0, 260.0]), 0.05, SMALL, 5
    begin = session * TRIALS_PER_SESSION
    fitted = []
    for distribution in range(plan.distributions):  # (f)
        fitted.append([])
        for sphere in range(3):
            trial = begin + sphere * plan.distributions + distribution
            presented = one_by_one(values[sphere], sigma, seed, trial, plan.presentations)  # (d)
            fitted[-1].append(mean_and_sd([float(gradient_sum(one, PAIRS)) for one in presented]))  # (b)
    pooled = [sum(one[sphere][0] for one in fitted) / plan.distributions for sphere in range(3)]
    expected = []
    for comparison in (1, 2):  # (j)
        side = 1.0 if pooled[comparison] > pooled[0] else -1.0
        picks = picked(seed, begin + comparison - 1, 2 * plan.hit_rates, plan.distributions)
        rates = []
        for judgement in range(plan.hit_rates):  # (i)
            standard_mean, _ = fitted[picks[2 * judgement]][0]  # (g)
            mean, sd = fitted[picks[2 * judgement + 1]][comparison]
            rates.append(normal_beyond(0.5 * (standard_mean + mean), mean, sd, side))  # (h)
        expected.append(mean_and_sd(rates))  # (k)
    rates = discriminate_by(GradientSum(PAIRS), values, sigma, seed, plan, session=session)
    assert (rates.seed, rates.session) == (seed, session)
    assert pooled[2] != pooled[0]
    assert_allclose(rates.hit_rate, [mean for mean, _ in expected], rtol=1e-11)
    assert_allclose(rates.hit_rate_sd, [sd for _, sd in expected], rtol=1e-9)


@pytest.mark.parametrize("moves", ["point", "fraction", "likelihood"])
def test_the_varied_criterion_follows_the_printed_steps(moves):
    values, sigma, seed = bumps([287.0, 310.0, 340.0]), 0.05, 6
    plan = Experiment(presentations_varied=9, hit_rates=7, criterion_sigma=0.02, criterion_moves=moves)
    sums = [
        [float(gradient_sum(one, PAIRS)) for one in one_by_one(values[sphere], sigma, seed, sphere, 9)]
        for sphere in range(3)
    ]
    (standard_mean, standard_sd), *others = [mean_and_sd(of_sphere) for of_sphere in sums]
    hits = [[], []]
    for comparison, (mean, sd) in enumerate(others):
        for number in normals(seed, [comparison], [0], Purpose.CRITERION, plan.hit_rates)[0, 0]:
            shift = 1.0 + 0.02 * number
            if moves == "point":
                point = 0.5 * (standard_mean + mean) * shift
            elif moves == "fraction":
                point = standard_mean + 0.5 * shift * (mean - standard_mean)
            else:
                common = math.sqrt(0.5 * (standard_sd**2 + sd**2))

                def excess(x, mean=mean, common=common, shift=shift):
                    ratio = norm.logpdf(x, mean, common) - norm.logpdf(x, standard_mean, common)
                    return ratio - math.log(shift)

                point = brentq(excess, standard_mean - 9.0 * common, mean + 9.0 * common, xtol=1e-12)
            hits[comparison].append(normal_beyond(point, mean, sd, math.copysign(1.0, mean - standard_mean)))
    rates = discriminate_by(GradientSum(PAIRS), values, sigma, seed, plan)
    assert_allclose(rates.hit_rate, [mean_and_sd(rate)[0] for rate in hits], rtol=1e-11)
    assert_allclose(rates.hit_rate_sd, [mean_and_sd(rate)[1] for rate in hits], rtol=1e-9)


# Few sets and many pairs: were a set of the standard to meet itself, a quarter of its distances would be 0.
@pytest.mark.parametrize("plan", [SMALL, Experiment(presentations=4, pairs=60, hit_rates=8, criterion=0.4)])
@pytest.mark.parametrize("norm", ["city-block", "euclidean"])
def test_euclidean_distance_follows_the_printed_steps(norm, plan):
    values, sigma, seed = bumps([287.0, 292.0, 330.0]), 0.05, 8
    repetitions = []
    for repetition in range(plan.hit_rates):
        trials = [3 * repetition + sphere for sphere in range(3)]
        sets = [
            one_by_one(values[sphere], sigma, seed, trials[sphere], plan.presentations) for sphere in range(3)
        ]  # (a)-(d*)
        picks = [picked(seed, trial, 2 * plan.pairs, plan.presentations) for trial in trials]
        other = picked(seed, trials[0], 2 * plan.pairs, plan.presentations - 1)
        sums = [[], [], []]
        for pair in range(plan.pairs):  # (f*)
            for sphere in range(3):  # (g*)
                first, second = picks[sphere][2 * pair : 2 * pair + 2]
                if sphere == 0:
                    others = [index for index in range(plan.presentations) if index != first]
                    second = others[other[2 * pair + 1]]
                apart = [a - b for a, b in zip(sets[0][first], sets[sphere][second], strict=True)]
                power = 1 if norm == "city-block" else 2
                sums[sphere].append(sum(abs(difference) ** power for difference in apart) ** (1 / power))
        repetitions.append(sums)
    pooled = [np.mean([sums[sphere] for sums in repetitions]) for sphere in range(3)]
    hits = [[], []]
    for sums in repetitions:
        for comparison in (1, 2):
            point = (1 - plan.criterion) * np.mean(sums[0]) + plan.criterion * np.mean(sums[comparison])
            above = pooled[comparison] > pooled[0]
            judged = [(one > point) == above for one in sums[comparison]]  # (h*)
            hits[comparison - 1].append(sum(judged) / plan.pairs)
    rates = discriminate_by(EuclideanDistance(norm), values, sigma, seed, plan)
    assert_allclose(rates.hit_rate, [mean_and_sd(rate)[0] for rate in hits], rtol=1e-12)
    assert_allclose(rates.hit_rate_sd, [mean_and_sd(rate)[1] for rate in hits], rtol=1e-9, atol=1e-15)


@pytest.mark.parametrize("presentations", [1, 6, 128, 131])
@pytest.mark.parametrize("noise", [Noise(0.07), Noise(0.03, offset=130.0)], ids=["multiplies", "offset"])
def test_sums_in_compiled_blocks_are_those_of_the_plain_formula(presentations, noise):
    """More presentations than a block holds, numbers that do not fill the generator's blocks of four."""
    values, trials = bumps([287.0, 365.0]), session_trials(2, 2, 3)
    (sums,) = noisy_gradient_sums(values, PAIRS, [noise], 4, trials, presentations)
    assert sums.shape == (2, 3, presentations)
    for repeat in range(3):
        plain = gradient_sum(noisy_responses(values, noise, 4, trials[:, repeat], presentations), PAIRS)
        assert_allclose(sums[:, repeat], plain, rtol=1e-13)


def test_several_noises_meet_the_same_numbers_as_each_alone():
    noises, trials = [Noise(0.03), Noise(0.08), Noise(0.03, offset=40.0)], session_trials(0, 7, 2)
    together = noisy_gradient_sums(bumps(), PAIRS, noises, 4, trials, 5)
    for one, noise in zip(together, noises, strict=True):
        assert_array_equal(one, noisy_gradient_sums(bumps(), PAIRS, [noise], 4, trials, 5)[0])
    draws = standard_normals(3, (300, 18))  # the same for every sphere
    sums = shared_noise_gradient_sums(bumps(), PAIRS, Noise(0.05), draws)
    assert_allclose(sums, gradient_sum(bumps()[:, np.newaxis] * (1.0 + 0.05 * draws), PAIRS), rtol=1e-13)


def test_the_number_of_threads_changes_no_bit():
    """Threads share the trials; the same numbers come from a process that has only one."""
    program = (
        "import numpy as np\n"
        "from fingerpad.psychophysics.encoding import Noise, noisy_gradient_sums, session_trials\n"
        "values = np.arange(1.0, 15.0).reshape(2, 7)\n"
        "pairs = np.stack([np.arange(6), np.arange(1, 7)], axis=1)\n"
        "sums = noisy_gradient_sums(values, pairs, [Noise(0.1)], 3, session_trials(0, 2, 100), 10)\n"
        "print(sums.tobytes().hex()[:4000], hash(sums.tobytes()))"
    )
    said = []
    for threads in ("1", "2"):
        variables = os.environ | {"NUMBA_NUM_THREADS": threads, "PYTHONHASHSEED": "0"}
        said.append(subprocess.check_output([sys.executable, "-c", program], env=variables, text=True))
    assert said[0] == said[1] != ""


def test_noise_with_an_offset_hardly_depends_on_small_responses():
    rates = np.array([[0.0, 30.0, 40.0, 3000.0]])
    noisy = noisy_responses(rates, Noise(0.05, offset=40.0), 1, session_trials(0, 1), 20000)[0]
    assert_allclose(noisy.mean(axis=0) - rates[0], 0.0, atol=2.0)
    assert_allclose(noisy.std(axis=0), [2.0, 2.5, 0.05 * math.sqrt(2.0) * 40.0, 150.0], rtol=0.02)


def test_sessions_of_one_seed_share_no_noise():
    first, second = (
        noisy_responses(bumps()[:1], Noise(0.05), 1, session_trials(session, 1), 1000)[0] / bumps()[0] - 1.0
        for session in (0, 1)
    )
    correlation = np.corrcoef(first.ravel(), second.ravel())[0, 1]
    assert abs(correlation) < 4.0 / np.sqrt(first.size)
    with pytest.raises(InputError, match="session must not exceed"):
        session_trials(LARGEST_SESSION + 1, 1)


def test_gradient_sum_of_two_receptors_is_normal_and_its_hit_rate_the_closed_form():
    """Sum = 2 |a n1 - b n2| with a well below b: Normal(2 (b - a), 2 sigma sqrt(a² + b²))."""
    values, sigma = np.array([[50.0, 80.0], [50.0, 82.0], [50.0, 86.0]]), 0.03
    separation = values[1:, 1] - values[0, 1]
    spread = sigma * np.hypot(values[1:, 0], values[1:, 1])
    closed = ndtr(separation / (2.0 * spread))
    draws = standard_normals(1, (200_000, 2))
    assert_allclose(expected_hit_rates(values, TWO, sigma, draws), closed, atol=2e-3)
    plan = Experiment(presentations=1000, distributions=300, hit_rates=3000)
    sampled = discriminate_by(GradientSum(TWO), values, sigma, 2, plan)
    assert_allclose(sampled.hit_rate, closed, atol=4e-3)
    # Error propagation through z = (mu_c - mu_s) / (2 sigma_c): two means and one standard deviation vary.
    z = separation / (2.0 * spread)
    standard = sigma * np.hypot(*values[0])
    of_z = np.sqrt((1.0 + (standard / spread) ** 2) / 4.0 + z**2 / 2.0) / math.sqrt(plan.presentations)
    density = np.exp(-0.5 * z**2) / math.sqrt(2.0 * math.pi)
    assert_allclose(sampled.hit_rate_sd, density * of_z, rtol=0.1)


@pytest.mark.parametrize(("standard", "other", "criterion"), [
    (80.0, 84.0, 0.2), (80.0, 84.0, 0.5), (80.0, 84.0, 0.8), (84.0, 80.0, 0.5),
])  # fmt: skip
def test_the_criterion_moves_the_decision_point_of_rising_and_falling_measures(standard, other, criterion):
    values, sigma = np.array([[50.0, standard], [50.0, other]]), 0.03
    margin = (1.0 - criterion) * 4.0 / (sigma * np.hypot(50.0, other))
    draws = standard_normals(1, (200_000, 2))
    assert_allclose(expected_hit_rates(values, TWO, sigma, draws, criterion), ndtr(margin), atol=2e-3)
    plan = Experiment(presentations=1000, criterion=criterion)
    sampled = discriminate_by(GradientSum(TWO), values, sigma, 2, plan)
    assert_allclose(sampled.hit_rate, ndtr(margin), atol=0.01)


def test_a_likelihood_ratio_of_one_halves_the_distance_and_equal_means_have_no_other_point():
    ratio = np.array([1.0, 2.0, 0.0])
    found = likelihood_point(10.0, 14.0, 4.0, ratio)
    assert found[:2].tolist() == [12.0, 12.0 + math.log(2.0)]
    assert found[2] < -600.0
    assert likelihood_point(14.0, 10.0, 4.0, ratio)[1] == 12.0 - math.log(2.0)
    assert likelihood_point(10.0, 10.0, 4.0, ratio).tolist() == [10.0] * 3


def test_without_noise_hit_rates_are_1_or_at_chance_for_equal_stimuli():
    values = bumps([287.0, 287.0, 288.0])
    whole = [[50.0, 60.0], [50.0, 60.0], [50.0, 61.0]]  # of which the standard deviation is exactly 0
    for rates in (
        discriminate_by(GradientSum(PAIRS), values, 0.0, 0, SMALL),
        discriminate_by(EuclideanDistance(), values, 0.0, 0, SMALL),
        discriminate_by(GradientSum(TWO), whole, 0.0, 0, SMALL),
    ):
        assert_array_equal(rates.hit_rate, [0.5, 1.0])
        assert_array_equal(rates.hit_rate_sd, [0.0, 0.0])
    assert_array_equal(expected_hit_rates(whole, TWO, 0.0, np.zeros((4, 2))), [0.5, 1.0])


def test_the_noise_behind_synthetic_hit_rates_is_recovered():
    truth = 0.073
    plan = Experiment(presentations=2000, distributions=100, hit_rates=4000)
    observed = discriminate_by(GradientSum(PAIRS), bumps()[[0, 1, 6]], truth, 13, plan).hit_rate
    draws = standard_normals(14, (10_000, 18))
    fit = fit_noise_sigma(lambda sigma: expected_hit_rates(bumps()[[0, 1, 6]], PAIRS, sigma, draws), observed)
    assert fit.noise_sigma == pytest.approx(truth, rel=0.03)
    assert_allclose(fit.hit_rates, observed, atol=0.01)
    assert fit.root_mean_square_error < 0.01
    met = ndtr(np.array([0.01, 0.09]) / 0.0411)
    exact = fit_noise_sigma(lambda sigma: ndtr(np.array([0.01, 0.09]) / sigma), met)
    assert exact.noise_sigma == pytest.approx(0.0411, rel=1e-6)
    with pytest.raises(ConvergenceError, match="No noise within"):
        fit_noise_sigma(lambda sigma: ndtr(np.array([1.0, 2.0]) / sigma), [0.3, 0.2])


def test_silent_receptors_need_a_rule():
    latencies = np.where(bumps() > 8.0, 60.0 - bumps(), np.nan)
    with pytest.raises(InputError, match="silent_value"):
        discriminate_by(GradientSum(PAIRS), latencies, 0.05, 0, SMALL)
    filled = discriminate_by(GradientSum(PAIRS), np.nan_to_num(latencies, nan=1000.0), 0.05, 0, SMALL)
    found = discriminate_by(GradientSum(PAIRS), latencies, 0.05, 0, SMALL, silent_value=END_OF_STIMULUS_MS)
    assert_array_equal(found.hit_rate, filled.hit_rate)
    assert np.isnan(latencies).any()


VARIED = Experiment(criterion_sigma=0.1)

test_what_cannot_be_used_is_refused = refusals(
    (lambda: Experiment(presentations=1), ("presentations",)),
    (lambda: Experiment(criterion=math.nan), ("criterion",)),
    (lambda: Experiment(criterion_sigma=-0.1), "criterion_sigma must not be negative"),
    (lambda: Experiment(criterion_moves="beta"), ("criterion_moves",)),
    (lambda: discriminate_by(GradientSum(PAIRS), 0.0 * bumps(), 0.1, 0), "stays silent"),
    (lambda: discriminate_by(EuclideanDistance(), bumps() * np.nan, 0.1, 0, None, 1.0), "stays silent"),
    (lambda: discriminate_by(GradientSum(PAIRS), bumps(), 0.1, 0, session=-1), ("session",)),
    (lambda: discriminate_by(GradientSum(PAIRS), bumps()[:1], 0.1, 0), "at least one comparison"),
    (lambda: discriminate_by(GradientSum(PAIRS), bumps(), -0.1, 0), ("noise",)),
    (lambda: discriminate_by(GradientSum(PAIRS + 1), bumps(), 0.1, 0), ("neighbours",)),
    (lambda: discriminate_by(GradientSum(PAIRS), [["a"]], 0.1, 0), "responses must be an array of numbers"),
    (lambda: discriminate_by(EuclideanDistance("maximum"), bumps(), 0.1, 0), ("norm",)),
    (lambda: discriminate_by(EuclideanDistance(), bumps(), 0.1, 0, VARIED), "criterion_sigma"),
    (lambda: fit_noise_sigma(lambda sigma: [0.5]), "must give 2 hit rates: got 1"),
    (lambda: fit_noise_sigma(lambda sigma: [0.5, 0.5], bounds=(0.2, 0.1)), ("bounds",)),
)  # fmt: skip
