"""Cross validation: folds part the data, nothing leaks, and synthetic truth comes back."""

import numpy as np
import pytest

from fingerpad.errors import InputError
from fingerpad.fitting import (
    coding_increments,
    cross_validate,
    interleaved_folds,
    maximise,
    weighted_fractional_sum_of_squares,
)

SHIFTS = np.linspace(-3.5, 3.5, 36)
TRUTH = np.array([0.15, 2.0, 1.8])
STARTS = np.array([[0.0, 1.5, 1.5], [0.0, 3.0, 2.2]])


def toy_rates(parameters: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
    """Two bumps over a floor: rates of an imagined afferent in two phases."""
    floor, height, width = parameters
    shape = np.exp(-((SHIFTS / width) ** 2))
    return floor + 3.0 * height * shape, floor + height * shape**2


def toy_score(observed: tuple[np.ndarray, np.ndarray]):
    def score(parameters: np.ndarray, chosen: np.ndarray) -> float:
        dynamic, static = toy_rates(parameters)
        return weighted_fractional_sum_of_squares(
            observed[0][chosen], dynamic[chosen], observed[1][chosen], static[chosen]
        )

    return score


def toy_increments() -> np.ndarray:
    return np.array([coding_increments(start, 0.01, where_zero=[0.01, 0.0, 0.0]) for start in STARTS])


def test_interleaved_folds_part_36_shifts_into_six_equal_sets() -> None:
    folds = interleaved_folds(36)
    assert np.bincount(folds).tolist() == [6] * 6
    for fold in range(6):
        np.testing.assert_array_equal(np.flatnonzero(folds == fold), np.arange(fold, 36, 6))


def test_synthetic_truth_is_recovered_in_every_fold() -> None:
    result = cross_validate(
        toy_score(toy_rates(TRUTH)), STARTS, toy_increments(), interleaved_folds(36), smallest_gain=1e-7
    )
    assert len(result.folds) == 6
    for fold in result.folds:
        np.testing.assert_allclose(fold.parameters, TRUTH, atol=0.05)
        assert fold.fss_test > 0.999
    assert result.fss_train > 0.999
    assert result.fss_test == pytest.approx(np.mean([fold.fss_test for fold in result.folds]))
    assert result.fss_train == pytest.approx(np.mean([fold.fss_train for fold in result.folds]))


def test_each_fold_is_fitted_without_its_own_observations() -> None:
    observed = toy_rates(TRUTH)
    clean = cross_validate(toy_score(observed), STARTS, toy_increments(), interleaved_folds(36))
    spoiled_dynamic = observed[0].copy()
    spoiled_dynamic[2::6] *= 2.0
    spoiled = cross_validate(
        toy_score((spoiled_dynamic, observed[1])), STARTS, toy_increments(), interleaved_folds(36)
    )
    assert spoiled.folds[2].parameters.tobytes() == clean.folds[2].parameters.tobytes()
    assert spoiled.folds[2].fss_train == clean.folds[2].fss_train
    assert spoiled.folds[2].fss_test < clean.folds[2].fss_test - 0.01
    assert spoiled.folds[0].parameters.tobytes() != clean.folds[0].parameters.tobytes()


def test_training_and_testing_sets_part_the_observations() -> None:
    memberships = np.array([0, 0, 1, 2, 1, 2, 2])
    asked: list[tuple[int, ...]] = []

    def score(parameters: np.ndarray, chosen: np.ndarray) -> float:
        asked.append(tuple(chosen.tolist()))
        return -float(parameters[0] ** 2)

    result = cross_validate(score, [[0.0]], [0.1], memberships)
    everything = set(range(7))
    assert [fold.testing.tolist() for fold in result.folds] == [[0, 1], [2, 4], [3, 5, 6]]
    expected = {tuple(fold.testing.tolist()) for fold in result.folds}
    expected |= {tuple(sorted(everything - set(testing))) for testing in expected}
    assert set(asked) == expected


def test_the_better_start_on_the_training_set_is_taken() -> None:
    def two_hills(parameters: np.ndarray, chosen: np.ndarray) -> float:
        x = float(parameters[0])
        return max(0.5 - (x + 2.0) ** 2, 1.0 - (x - 2.0) ** 2)

    result = cross_validate(two_hills, [[-2.5], [2.5]], [0.05], interleaved_folds(4, 2))
    for fold in result.folds:
        assert fold.start == 1
        assert fold.fss_train == max(fit.objective for fit in fold.fits)
        assert fold.history == fold.fits[1].history
        assert fold.fits[0].objective == pytest.approx(0.5, abs=0.01)


def test_a_fold_is_the_same_as_a_fit_to_its_training_set() -> None:
    score, increments = toy_score(toy_rates(TRUTH)), toy_increments()
    fold = cross_validate(score, STARTS, increments, interleaved_folds(36)).folds[3]
    training = np.setdiff1d(np.arange(36), np.arange(3, 36, 6))
    alone = maximise(
        lambda parameters: score(parameters, training), STARTS[fold.start], increments[fold.start]
    )
    assert alone.parameters.tobytes() == fold.parameters.tobytes()


@pytest.mark.parametrize("memberships", [[0, 0, 0], [0, 2, 2], [1, 2, 1], [0.5, 0, 1], [-1, 0, 1]])
def test_memberships_with_a_gap_are_refused(memberships: list[float]) -> None:
    with pytest.raises(InputError, match="memberships must number at least two folds"):
        cross_validate(lambda parameters, chosen: 0.0, [[0.0]], [0.1], memberships)


def test_other_wrong_shapes_are_refused() -> None:
    with pytest.raises(InputError, match="increments must match starts"):
        cross_validate(lambda parameters, chosen: 0.0, [[0.0], [1.0]], [0.1, 0.1, 0.1], [0, 1])
    with pytest.raises(InputError, match="n_observations must be a whole number of at least 6"):
        interleaved_folds(5)
    with pytest.raises(InputError, match="n_folds must be a whole number of at least 2"):
        interleaved_folds(5, 1)
