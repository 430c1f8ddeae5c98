"""FSS against its closed forms (Eqs. 13-14)."""

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

from fingerpad.inference.fitting.methods import fractional_sum_of_squares
from refusals import refusals

RATES = np.array([0.0, 20.0, 135.0, 210.0, 72.0, 5.0])


def test_perfect_prediction_scores_one_and_silence_zero():
    assert fractional_sum_of_squares(RATES, RATES) == 1.0
    assert fractional_sum_of_squares(RATES, np.zeros(6)) == 0.0
    of_the_mean = fractional_sum_of_squares(RATES, np.full(RATES.size, RATES.mean()))
    assert of_the_mean == pytest.approx(1.0 - RATES.var() / (RATES**2).mean(), rel=1e-14)


@given(st.floats(-5.0, 5.0))
def test_a_scaled_prediction_loses_the_square_of_its_error(scale):
    expected = 1.0 - (1.0 - scale) ** 2
    assert fractional_sum_of_squares(RATES, scale * RATES) == pytest.approx(expected, abs=1e-12)


test_what_cannot_be_scored_is_refused = refusals(
    (lambda: fractional_sum_of_squares([1.0, 2.0], [1.0, 2.0, 3.0]), "must match: got 2 and 3 values"),
    (lambda: fractional_sum_of_squares([0.0, 0.0], [1.0, 2.0]), "at least one value other than 0"),
    (lambda: fractional_sum_of_squares([1.0, 2.0], [1.0, np.nan]), ("predicted",)),
)
