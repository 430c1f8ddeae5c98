"""Cross validation: folds part the data, nothing leaks, and synthetic truth comes back."""

from collections.abc import Callable
from dataclasses import dataclass

import numpy as np
import pytest

from fingerpad.inference.fitting.methods import (
    ResponseSurface,
    cross_validate,
    fractional_sum_of_squares,
    interleaved_folds,
)
from refusals import refusals

SHIFTS = np.linspace(-3.5, 3.5, 36)
TRUTH = np.array([0.15, 2.0, 1.8])
STARTS = np.array([[0.0, 1.5, 1.5], [0.0, 3.0, 2.2]])


def toy_rates(parameters):
    """Two bumps over a floor: rates of an imagined afferent in two phases."""
    floor, height, width = parameters
    shape = np.exp(-((SHIFTS / width) ** 2))
    return floor + 3.0 * height * shape, floor + height * shape**2


@dataclass(frozen=True)
class Scored:
    """A problem that consists of a score."""

    score: Callable[[np.ndarray, np.ndarray], float]
    n_observations: int = 36
    names: tuple[str, ...] = ("floor", "height", "width")

    def residuals(self, parameters, chosen):
        raise AssertionError("the response surface method needs no residuals")


def toy_problem(observed):
    def score(parameters, chosen):
        pairs = zip(observed, toy_rates(parameters), strict=True)
        shares = [fractional_sum_of_squares(seen[chosen], told[chosen]) for seen, told in pairs]
        return 0.25 * shares[0] + 0.75 * shares[1]

    return Scored(score)


def toy_method(smallest_gain=1e-4):
    return ResponseSurface(STARTS, np.maximum(0.01 * STARTS, [0.01, 0.0, 0.0]), smallest_gain=smallest_gain)


def test_interleaved_folds_part_36_shifts_into_six_equal_sets():
    folds = interleaved_folds(36)
    assert np.bincount(folds).tolist() == [6] * 6
    for fold in range(6):
        np.testing.assert_array_equal(np.flatnonzero(folds == fold), np.arange(fold, 36, 6))


def test_synthetic_truth_is_recovered_in_every_fold():
    result = cross_validate(toy_problem(toy_rates(TRUTH)), toy_method(1e-7), interleaved_folds(36))
    assert len(result.folds) == 6
    for fold in result.folds:
        np.testing.assert_allclose(fold.fit.parameters, TRUTH, atol=0.05)
        assert fold.score_test > 0.999
    assert result.score_train > 0.999
    assert result.score_test == pytest.approx(np.mean([fold.score_test for fold in result.folds]))
    assert result.score_train == pytest.approx(np.mean([fold.fit.score for fold in result.folds]))


def test_each_fold_is_fitted_without_its_own_observations():
    observed = toy_rates(TRUTH)
    clean = cross_validate(toy_problem(observed), toy_method(), interleaved_folds(36))
    spoiled_dynamic = observed[0].copy()
    spoiled_dynamic[2::6] *= 2.0
    spoiled = cross_validate(toy_problem((spoiled_dynamic, observed[1])), toy_method(), interleaved_folds(36))
    assert spoiled.folds[2].fit.parameters.tobytes() == clean.folds[2].fit.parameters.tobytes()
    assert spoiled.folds[2].fit.score == clean.folds[2].fit.score
    assert spoiled.folds[2].score_test < clean.folds[2].score_test - 0.01
    assert spoiled.folds[0].fit.parameters.tobytes() != clean.folds[0].fit.parameters.tobytes()
    fit, training, method = clean.folds[3].fit, clean.folds[3].training, toy_method()
    alone = ResponseSurface([STARTS[fit.start]], np.asarray(method.increments)[fit.start]).fit(
        toy_problem(observed), training
    )
    assert alone.parameters.tobytes() == fit.parameters.tobytes()
    assert [row.score for row in alone.history] == [row.score for row in fit.history]


def test_the_better_start_on_the_training_set_is_taken():
    def two_hills(parameters, chosen):
        x = float(parameters[0])
        return max(0.5 - (x + 2.0) ** 2, 1.0 - (x - 2.0) ** 2)

    method = ResponseSurface([[-2.5], [2.5]], [0.05])
    result = cross_validate(Scored(two_hills, 4), method, interleaved_folds(4, 2))
    for fold in result.folds:
        low, high = fold.fit.attempts
        assert fold.fit.start == 1
        assert fold.fit.score == high.score > low.score
        assert fold.fit.history == high.history
        assert fold.fit.n_evaluations == low.n_evaluations + high.n_evaluations
        assert low.score == pytest.approx(0.5, abs=0.01)


def none_scored(n_observations, memberships):
    cross_validate(Scored(lambda *_: 0.0, n_observations), ResponseSurface([[0.0]], [0.1]), memberships)


test_wrong_folds_and_shapes_are_refused = refusals(
    (lambda: none_scored(3, [0, 0, 0]), "memberships must number at least two folds"),
    (lambda: none_scored(3, [0, 2, 2]), "memberships must number at least two folds"),
    (lambda: none_scored(3, [0.5, 0, 1]), "memberships must number at least two folds"),
    (lambda: none_scored(3, [-1, 0, 1]), "memberships must number at least two folds"),
    (lambda: none_scored(4, [0, 1, 0]), "memberships needs one fold per observation: got 3 for 4"),
    (lambda: interleaved_folds(5, 6), "n_folds must be at most the number of stimuli"),
    (lambda: interleaved_folds(5, 1), "n_folds must be a whole number of at least 2"),
)  # fmt: skip
