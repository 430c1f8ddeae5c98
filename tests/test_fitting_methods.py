"""Methods of fitting: each finds a known optimum, respects bounds, counts its runs and is repeatable."""

from dataclasses import dataclass, field, replace

import numpy as np
import pytest

from fingerpad.inference.fitting.methods import (
    Bounds,
    CovarianceAdaptation,
    Fit,
    FitStep,
    LeastSquares,
    best_of,
)

TIMES = np.linspace(0.0, 4.0, 24)
TRUTH = np.array([2.0, 0.8])
START, FREE = np.array([1.0, 2.0]), Bounds([0.5, 0.4])
ALL = np.arange(24)


@dataclass
class Decay:
    """Height and rate of a decay, which a recorder may have rounded: then the residuals jump."""

    rounding: float = 0.0
    names: tuple[str, ...] = ("height", "rate")
    n_observations: int = 24
    asked: list[np.ndarray] = field(default_factory=list)

    def curve(self, parameters):
        values = parameters[0] * np.exp(-parameters[1] * TIMES)
        return np.round(values / self.rounding) * self.rounding if self.rounding else values

    def residuals(self, parameters, chosen):
        self.asked.append(np.array(parameters))
        observed = self.curve(TRUTH)[chosen]
        return (observed - self.curve(parameters)[chosen]) / np.sqrt(observed @ observed)

    def score(self, parameters, chosen):
        residuals = self.residuals(parameters, chosen)
        return 1.0 - float(residuals @ residuals)

    def jacobian(self, parameters, chosen):
        observed = self.curve(TRUTH)[chosen]
        decay = np.exp(-parameters[1] * TIMES)[chosen]
        slopes = np.column_stack([-decay, parameters[0] * TIMES[chosen] * decay])
        return slopes / np.sqrt(observed @ observed)


METHODS = [
    LeastSquares([START], FREE),
    LeastSquares([START], FREE, jacobian=Decay().jacobian),
    CovarianceAdaptation(START, FREE),
]


@pytest.mark.parametrize("method", METHODS, ids=["least squares", "with slopes", "CMA-ES"])
def test_truth_is_found_from_afar(method):
    problem = Decay()
    state = np.random.get_state()[1].copy()  # noqa: NPY002
    fit = method.fit(problem, ALL)
    np.testing.assert_array_equal(np.random.get_state()[1], state)  # noqa: NPY002
    assert method.fit(Decay(), ALL).parameters.tobytes() == fit.parameters.tobytes()
    np.testing.assert_allclose(fit.parameters, TRUTH, rtol=1e-4)
    assert fit.score == pytest.approx(1.0, abs=1e-8)
    assert fit.n_evaluations == len(problem.asked)
    assert fit.seconds > 0.0
    assert fit.history[-1].score == fit.score
    assert [step.score for step in fit.history] == sorted(step.score for step in fit.history)
    chosen = np.arange(5)
    few = method.fit(problem, chosen)
    assert few.score == problem.score(few.parameters, chosen)
    if method is METHODS[1]:  # slopes in other units than the steps' would need four times as many
        assert fit.n_evaluations <= 12


@pytest.mark.parametrize("method", METHODS, ids=["least squares", "with slopes", "CMA-ES"])
def test_bounds_are_kept_and_the_best_place_within_is_found(method):
    problem = Decay()
    bounded = replace(method, bounds=Bounds(FREE.scales, [0.0, 0.0], [1.5, 10.0]))
    fit = bounded.fit(problem, ALL)
    assert fit.parameters[0] == pytest.approx(1.5, rel=1e-3)
    asked = np.array(problem.asked)
    assert (asked >= 0.0).all()
    assert (asked[:, 0] <= 1.5).all()
    tried = [problem.score(np.array([1.5, rate]), ALL) for rate in np.linspace(0.3, 1.0, 141)]
    assert fit.score >= max(tried) - 1e-6


def test_large_differences_pass_jumps_that_stop_small_ones():
    rounded = Decay(rounding=0.1)
    wide = LeastSquares([START], FREE, difference_steps=(0.3, 0.1)).fit(rounded, ALL)
    narrow = LeastSquares([START], FREE, difference_steps=(1e-7,)).fit(rounded, ALL)
    assert wide.score > 0.995
    assert narrow.score < wide.score - 0.05


def test_only_the_most_promising_starts_are_refined_and_the_best_is_kept():
    starts = np.array([[9.0, 4.0], [1.9, 0.7], [9.0, 9.0], [2.5, 1.0]])
    problem = Decay()
    fit = LeastSquares(starts, FREE, n_refined=2).fit(problem, ALL)
    refined = fit.attempts[:-1]
    assert [attempt.history[0].parameters.tolist() for attempt in refined] == [[1.9, 0.7], [2.5, 1.0]]
    assert fit.score == max(attempt.score for attempt in fit.attempts)
    assert fit.n_evaluations == len(problem.asked) == 4 + sum(attempt.n_evaluations for attempt in refined)


def test_a_seed_decides_what_the_search_tries():
    methods = [CovarianceAdaptation(START, FREE, seed=seed, most_evaluations=30) for seed in (0, 1)]
    fits = [method.fit(Decay(), ALL) for method in methods]
    assert fits[0].parameters.tolist() != fits[1].parameters.tolist()
    assert all(fit.n_evaluations < 30 + 8 for fit in fits)
    step = FitStep(START, 0.5)
    equal = [Fit(np.array([value]), 0.5, 7, 0.25, (step,)) for value in (1.0, 2.0)]
    best = best_of(tuple(equal))  # the first of equal ones
    assert (best.start, best.parameters.tolist(), best.n_evaluations, best.seconds) == (0, [1.0], 14, 0.5)
