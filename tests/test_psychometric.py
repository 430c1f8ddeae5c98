"""Psychometric functions: shapes, likelihoods, recovery of the truth, coverage, and an oracle."""

import math

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st
from scipy import stats
from scipy.optimize import differential_evolution

from fingerpad import ConvergenceError
from fingerpad.psychophysics import FunctionCloud, PsychometricFunction, bootstrap, goodness_of_fit, posterior
from fingerpad.psychophysics.curve import SIGMOIDS, log_probability
from fingerpad.psychophysics.curve_fit import fit_psychometric
from fingerpad.psychophysics.curve_uncertainty import STEEPEST, weighted_quantiles
from refusals import refusals

LEVELS = np.array([2.0, 3.0, 4.0, 5.0, 6.0, 7.0, 8.0])
TRUTH = PsychometricFunction(threshold=5.0, width=4.0, guess=0.5, lapse=0.02)
TRIALS = 60


def test_shapes_are_the_textbook_ones():
    x = np.array([0.5, 1.0, 2.0, 4.0])
    textbook = {
        "normal": stats.norm(2.0, 1.5),
        "logistic": stats.logistic(2.0, 1.5),
        "gumbel": stats.gumbel_l(2.0, 1.5),
        "weibull": stats.weibull_min(1.8, scale=2.0),
    }
    for name, frozen in textbook.items():
        start, threshold, end = frozen.ppf([0.05, 0.5, 0.95])
        width = math.log(end / start) if name == "weibull" else end - start
        ours = PsychometricFunction(threshold, width, guess=0.0, sigmoid=name).predict(x)
        assert ours == pytest.approx(frozen.cdf(x), abs=1e-14), name


@given(
    st.sampled_from(sorted(SIGMOIDS)), st.floats(0.5, 20.0), st.floats(0.1, 5.0),
    st.floats(0.0, 0.5), st.floats(0.0, 0.1), st.floats(0.02, 0.98),
)  # fmt: skip
def test_level_at_undoes_predict_and_slope_is_its_derivative(name, threshold, width, guess, lapse, share):
    function = PsychometricFunction(threshold, width, guess, lapse, name)
    wanted = guess + (1.0 - guess - lapse) * share
    level = function.level_at(wanted)
    if name == "weibull" or level > 0.0:
        assert function.predict([level])[0] == pytest.approx(wanted, abs=1e-9)
    step = 1e-5 * max(abs(level), width)
    if name != "weibull" or level > 2.0 * step:
        rise = np.diff(function.predict([level - step, level + step]))[0] / (2.0 * step)
        assert function.slope(wanted) == pytest.approx(rise, rel=1e-3)


def test_counts_have_the_probabilities_of_the_distributions():
    n, p, rho = 12, 0.7, 0.2
    k = np.arange(n + 1)
    v = (1.0 - rho) / rho
    assert np.exp(log_probability(k, n, p)) == pytest.approx(stats.binom.pmf(k, n, p), abs=1e-13)
    assert np.exp(log_probability(k, n, p, rho)) == pytest.approx(
        stats.betabinom.pmf(k, n, p * v, (1 - p) * v), abs=1e-12
    )
    spread = (np.exp(log_probability(k, n, p, rho)) * (k - n * p) ** 2).sum()
    assert spread == pytest.approx(n * p * (1 - p) * (1.0 + (n - 1) * rho), rel=1e-10)
    assert log_probability([0, 1], [1, 1], [0.0, 0.0]).tolist() == [0.0, -np.inf]


def judged(truth: PsychometricFunction, n_sets: int, seed: int = 3) -> np.ndarray:
    """Counts (n_sets, n_levels) of a judge who follows the truth."""
    draw = np.random.default_rng(seed)
    return draw.binomial(TRIALS, truth.predict(LEVELS), size=(n_sets, LEVELS.size)).astype(float)


@pytest.mark.parametrize(("guess", "overdispersion"), [(0.5, 0.0), (None, 0.0), (0.5, None)])
def test_no_function_is_more_likely_than_the_fitted_one(guess, overdispersion):
    for number, counts in enumerate(judged(TRUTH, 2, seed=11)):
        fit = fit_psychometric(LEVELS, counts, [TRIALS] * 7, guess=guess, overdispersion=overdispersion)
        model, free = fit.model, fit.model.free

        def missing(values, model=model, free=free, counts=counts):
            point = model.lower.copy()
            point[free] = values
            return -float(model.log_likelihood(counts, point))

        bounds = list(zip(model.lower[free], model.upper[free], strict=True))
        found = differential_evolution(missing, bounds, rng=number, maxiter=80, tol=1e-8)
        assert fit.log_likelihood >= -found.fun - 1e-6


def test_fit_meets_expected_counts_exactly_with_any_shape():
    for name in SIGMOIDS:
        truth = PsychometricFunction(5.0, 0.8 if name == "weibull" else 4.0, 0.5, 0.03, name)
        n = 10**9
        fit = fit_psychometric(LEVELS, np.round(n * truth.predict(LEVELS)), [n] * 7, sigmoid=name)
        assert fit.function.threshold == pytest.approx(5.0, abs=1e-3), name
        assert fit.function.width == pytest.approx(truth.width, rel=1e-3), name
        assert fit.function.lapse == pytest.approx(0.03, abs=1e-4), name
        assert fit.deviance < 1e-3


def test_units_of_the_levels_do_not_matter():
    counts = judged(TRUTH, 1)[0]
    fit = fit_psychometric(LEVELS, counts, [TRIALS] * 7)
    other = fit_psychometric(1000.0 * LEVELS + 300.0, counts, [TRIALS] * 7)
    assert other.log_likelihood == pytest.approx(fit.log_likelihood, abs=1e-8)
    assert other.threshold(0.75) == pytest.approx(1000.0 * fit.threshold(0.75) + 300.0, rel=1e-5)


def test_given_parameters_stay_as_given():
    fit = fit_psychometric([296.0, 365.0], [58, 95], [100, 100], threshold=287.0, guess=0.0, lapse=0.0)
    assert fit.free == ("width",)
    assert fit.function.threshold == 287.0
    # z of 95 % over 78 /m and of 58 % over 9 /m are nearly one line: both points are met.
    assert fit.predict([296.0, 365.0]) == pytest.approx([0.58, 0.95], abs=0.02)
    assert fit.threshold(0.75) == pytest.approx(319.0, abs=1.5)


@pytest.fixture(scope="module")
def fits():
    """100 fits of simulated data with one truth, lapses looked for."""
    return [fit_psychometric(LEVELS, counts, [TRIALS] * 7) for counts in judged(TRUTH, 100, seed=78)]


def test_fits_recover_the_truth_on_average(fits):
    thresholds = np.array([fit.threshold(0.75) for fit in fits])
    error = thresholds.std(ddof=1) / math.sqrt(len(fits))
    assert thresholds.mean() == pytest.approx(TRUTH.level_at(0.75), abs=4.0 * error + 0.02)
    assert error < 0.03


def held(cloud: FunctionCloud) -> tuple[bool, bool, bool]:
    """Whether the intervals of threshold, width and curve hold the truth."""
    lower, upper = cloud.threshold_interval(0.75)
    narrow, wide = cloud.interval("width")
    below, above = cloud.band([5.0])[:, 0]
    return (
        lower <= TRUTH.level_at(0.75) <= upper,
        narrow <= TRUTH.width <= wide,
        below <= float(TRUTH.predict([5.0])[0]) <= above,
    )


def test_posterior_intervals_have_their_nominal_coverage(fits):
    covered = np.mean([held(posterior(fit)) for fit in fits], axis=0)
    assert ((covered >= 0.90) & (covered <= 0.98)).all(), covered


def test_bootstrap_intervals_have_their_nominal_coverage():
    sets = judged(TRUTH, 200, seed=78)
    fits = [fit_psychometric(LEVELS, counts, [TRIALS] * 7, lapse=0.02) for counts in sets]
    # A step has no bootstrap.
    clouds = [bootstrap(fit, seed, 120) for seed, fit in enumerate(fits) if not fit.is_step]
    covered = np.mean([held(cloud) for cloud in clouds], axis=0)
    assert ((covered >= 0.90) & (covered <= 0.98)).all(), covered


def test_posterior_on_a_grid_is_that_of_brute_force():
    fit = fit_psychometric(LEVELS[2:5], [12, 15, 19], [20] * 3, lapse=0.0)
    model = fit.model
    m = np.linspace(model.lower[0], model.upper[0], 1501)
    w = np.linspace(model.lower[1] + math.log(STEEPEST), model.upper[1], 1501)
    points = np.zeros((m.size, w.size, 5)) + model.lower
    points[..., 0], points[..., 1] = m[:, None], w
    mass = np.exp(model.log_likelihood(fit.counts.n_correct, points) - fit.log_likelihood)
    for name, axis, marginal in (("threshold", m, mass.sum(axis=1)), ("width", np.exp(w), mass.sum(axis=0))):
        expected = weighted_quantiles(axis, marginal, [0.025, 0.975])
        assert posterior(fit).interval(name) == pytest.approx(tuple(expected), rel=0.01), name


def test_bootstrap_is_keyed_by_its_seed(fits):
    first, again, other = (bootstrap(fits[0], seed, 50) for seed in (1, 1, 2))
    assert (first.values == again.values).all()
    assert (first.values != other.values).any()
    # Replicates do not depend on how many there are.
    assert (bootstrap(fits[0], 1, 20).values == first.values[:20]).all()


def test_intervals_reach_infinity_where_a_proportion_may_never_be_reached(fits):
    lower, upper = posterior(fits[0]).threshold_interval(0.97)
    assert math.isfinite(lower)
    assert upper == math.inf


def test_overdispersion_is_found_and_widens_intervals():
    draw = np.random.default_rng(8)
    v = (1.0 - 0.15) / 0.15
    p = np.tile(TRUTH.predict(LEVELS), (40, 1))
    counts = draw.binomial(TRIALS, draw.beta(p * v, (1.0 - p) * v))
    found = [fit_psychometric(LEVELS, one, [TRIALS] * 7, lapse=0.02, overdispersion=None) for one in counts]
    # With seven levels and two parameters fitted, likelihood takes a part of the spread for fit.
    assert 0.07 < np.median([fit.overdispersion for fit in found]) < 0.17
    binomial = fit_psychometric(LEVELS, counts[0], [TRIALS] * 7, lapse=0.02)
    widths = [np.ptp(posterior(fit).threshold_interval(0.75)) for fit in (binomial, found[0])]
    assert widths[1] > 1.5 * widths[0]


def test_deviance_of_true_data_is_uniform_and_of_a_wrong_shape_is_not():
    p_values = [
        goodness_of_fit(fit_psychometric(LEVELS, counts, [TRIALS] * 7, lapse=0.02), seed, 100).p_value
        for seed, counts in enumerate(judged(TRUTH, 50, seed=21))
    ]
    assert stats.kstest(p_values, "uniform").pvalue > 0.01
    rate = np.array([0.5, 0.5, 0.95, 0.55, 0.6, 0.95, 0.95])
    wrong = fit_psychometric(LEVELS, np.round(TRIALS * rate), [TRIALS] * 7)
    assert goodness_of_fit(wrong, 1, 300).p_value < 0.01
    judged_wrong = goodness_of_fit(wrong, 1, 20)
    assert np.square(judged_wrong.residuals).sum() == pytest.approx(wrong.deviance, rel=1e-9)
    assert judged_wrong.residuals[2] > 3.0


def test_thresholds_agree_with_psignifit():
    psignifit = pytest.importorskip("psignifit")
    for counts in judged(TRUTH, 2, seed=31):
        data = np.stack([LEVELS, counts, np.full(7, TRIALS)], axis=1)
        oracle = psignifit.psignifit(data, sigmoid="norm", experiment_type="2AFC")
        expected = float(oracle.threshold(0.75, return_ci=False))
        fit = fit_psychometric(LEVELS, counts, [TRIALS] * 7)
        lower, upper = posterior(fit).threshold_interval(0.75)
        # Its priors on lapse rate and width are others: a tenth of the interval.
        assert abs(fit.threshold(0.75) - expected) < 0.1 * (upper - lower)


GOOD = ([1.0, 2.0, 3.0], [5, 7, 9], [10] * 3)


test_bad_input_is_refused = refusals(
    (lambda: fit_psychometric([1, 2], [3, 4], [5]), "one entry per level"),
    (lambda: fit_psychometric([2, 1], [3, 4], [5, 5]), "increase strictly"),
    (lambda: fit_psychometric([1, 2], [3.5, 4], [5, 5]), "whole numbers"),
    (lambda: fit_psychometric([1, 2], [3, 6], [5, 5]), "within 0 ... n_trials"),
    (lambda: fit_psychometric([1], [3], [5]), "at least 2"),
    (lambda: fit_psychometric(*GOOD, sigmoid="cauchy"), ("sigmoid",)),
    (lambda: fit_psychometric(*GOOD, guess=0.6, lapse=0.5), "sum to less than 1"),
    (lambda: fit_psychometric(*GOOD, overdispersion=1.0), ("overdispersion",)),
    (lambda: fit_psychometric(*GOOD, width=0.0), ("width",)),
    (lambda: fit_psychometric([-1.0, 2.0, 3.0], *GOOD[1:], sigmoid="weibull"), "greater than 0"),
    (lambda: fit_psychometric(*GOOD).threshold(0.4), "between guess and 1 - lapse"),
    (lambda: posterior(fit_psychometric(*GOOD)).interval("slope"), ("parameter",)),
)  # fmt: skip


def test_levels_that_do_not_contain_the_threshold_are_an_error():
    for correct, trials, said in (
        ([500, 505, 520, 560], 1000, r"outside of the levels 1 \.\.\. 4"),
        ([50, 50, 51, 50], 100, "One proportion"),
    ):
        with pytest.raises(ConvergenceError, match=said):
            fit_psychometric([1, 2, 3, 4], correct, [trials] * 4, lapse=0.0)


def test_a_step_is_fitted_and_its_width_is_reported_on_the_bound():
    step = fit_psychometric([1, 2, 3, 4], [50, 50, 100, 100], [100] * 4, lapse=0.0)
    assert step.at_bounds == ("width",)
    assert 2.0 < step.threshold() < 3.0
    with pytest.raises(ConvergenceError, match=r"not determined by these data: .* 2 and 3; measure"):
        bootstrap(step, seed=1)


@pytest.mark.parametrize("levels", [LEVELS, [1.0, 2.0, 4.0, 8.0, 16.0, 32.0, 64.0]])
def test_a_step_may_lie_anywhere_between_its_two_levels(levels):
    """All thresholds between the two levels explain the counts alike."""
    step = fit_psychometric(levels, [0, 0, 0, 20, 20, 20, 20], [20] * 7, guess=0.0, lapse=0.0)
    assert step.is_step
    lower, upper = posterior(step).threshold_interval()
    share = (np.array([lower, upper]) - levels[2]) / (levels[3] - levels[2])
    assert share == pytest.approx([0.025, 0.975], abs=0.03)


def test_the_threshold_is_one_level_everywhere():
    fit = fit_psychometric([260, 275, 300, 315], [4, 20, 83, 97], [100] * 4, guess=0.0, lapse=0.0)
    threshold = fit.function.threshold
    assert fit.threshold() == fit.threshold(0.5) == threshold == pytest.approx(287.0, abs=1.0)
    assert f"threshold {threshold:.3g} (at 50 %)" in repr(fit)
    assert f"threshold {threshold:.3g} (at 50 %)" in fit.plot().get_xlabel()
    cloud = posterior(fit)
    assert cloud.threshold_interval() == cloud.interval("threshold")
