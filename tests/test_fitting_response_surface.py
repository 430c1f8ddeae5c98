"""Response-surface method: exact on planes, close on paraboloids, an error where it cannot continue."""

import itertools

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from fingerpad.core.errors import ConvergenceError, InputError
from fingerpad.inference.fitting.methods import ResponseSurface, factorial_design, regression_slopes


class Counted:
    """An objective that remembers where it was evaluated."""

    def __init__(self, function):
        self.function = function
        self.points: list[np.ndarray] = []

    def __call__(self, parameters):
        self.points.append(np.array(parameters))
        return float(self.function(parameters))


class Scored:
    """A problem that consists of a score."""

    names, n_observations, residuals = ("x",), 1, None

    def __init__(self, objective):
        self.score = lambda parameters, chosen: objective(parameters)


def maximise(objective, start, increments, **settings):
    return ResponseSurface([start], increments, **settings).fit(Scored(objective), np.arange(1))


def bowl(centre, curvature):
    return lambda parameters: 1.0 - float((curvature * (parameters - centre) ** 2).sum())


def test_design_of_six_parameters_has_65_different_runs():
    design = factorial_design(6)
    assert design.shape == (65, 6)
    corners = {tuple(row) for row in design[:-1]}
    assert corners == set(itertools.product((-1.0, 1.0), repeat=6))
    assert not design[-1].any()


@pytest.mark.parametrize("n_parameters", [1, 2, 3, 6])
def test_slopes_are_those_of_ordinary_least_squares(n_parameters):
    generator = np.random.default_rng(7)
    design = factorial_design(n_parameters)
    values = generator.normal(size=len(design))
    with_constant = np.column_stack([np.ones(len(design)), design])
    reference = np.linalg.lstsq(with_constant, values, rcond=None)[0]
    np.testing.assert_allclose(regression_slopes(design, values), reference[1:], atol=1e-14)


def test_direction_on_a_plane_is_exact_in_coded_units():
    slopes, increments = np.array([3.0, -4.0]), np.array([0.1, 10.0])
    start = np.array([1.0, 5.0])

    def capped_plane(parameters):
        return min(float(slopes @ ((parameters - start) / increments)), 15.0)

    fit = maximise(capped_plane, start, increments)
    moved = (fit.history[1].parameters - start) / increments
    # Steps of 1 and 2 units gain 5 and 10; everything farther is flat.
    np.testing.assert_allclose(moved, 3.0 * slopes / 5.0, rtol=1e-12)
    assert fit.score == pytest.approx(15.0)


def test_first_iteration_runs_65_points_before_it_steps():
    objective = Counted(bowl(np.full(6, 2.0), np.ones(6)))
    start, increments = np.ones(6), np.full(6, 0.01)
    fit = maximise(objective, start, increments)
    np.testing.assert_allclose(objective.points[:65], start + factorial_design(6) * increments)
    np.testing.assert_allclose(objective.points[65], start + 0.01 / np.sqrt(6.0), rtol=1e-12)
    assert fit.n_evaluations == len(objective.points)
    assert fit.n_evaluations >= 65 * len(fit.history)


@settings(deadline=None, max_examples=25)
@given(st.tuples(*[st.floats(-2.0, 2.0)] * 3), st.tuples(*[st.floats(0.5, 2.0)] * 3))
def test_the_top_of_a_bowl_is_found_within_an_increment(centre, curvature):
    increment = 0.01
    hill = bowl(np.array(centre), np.array(curvature))
    fit = maximise(hill, np.zeros(3), np.full(3, increment), smallest_gain=0.0)
    # No unit step gains: the slope is below half a unit times the largest curvature, divided by the smallest.
    assert np.abs(fit.parameters - centre).max() <= 0.5 * increment * 2.0 / 0.5
    assert fit.score <= 1.0


def test_history_never_falls_and_ends_with_the_result():
    centre, curvature = np.array([1.0, -2.0, 0.5]), np.array([1.0, 8.0, 3.0])
    function = bowl(centre, curvature)
    fit = maximise(function, np.zeros(3), np.full(3, 0.01))
    values = [row.score for row in fit.history]
    assert (np.diff(values) > 1e-4).all()
    assert values == [function(row.parameters) for row in fit.history]
    assert fit.history[0].parameters.tolist() == [0.0, 0.0, 0.0]
    assert fit.score == values[-1]
    assert fit.parameters.tolist() == fit.history[-1].parameters.tolist()
    assert fit.n_evaluations > 10 * len(fit.history)
    assert len(fit.history) == len(values) >= 3
    again = maximise(function, np.zeros(3), np.full(3, 0.01))
    assert again.parameters.tobytes() == fit.parameters.tobytes()
    at_the_top = maximise(bowl(np.zeros(2), np.ones(2)), np.zeros(2), np.full(2, 0.1))
    assert at_the_top.parameters.tolist() == [0.0, 0.0]
    assert (len(at_the_top.history), at_the_top.n_evaluations) == (1, 5)


def test_bounds_and_restrictions_are_kept_and_the_free_parameter_still_climbs():
    objective = Counted(bowl(np.array([-5.0, 4.0]), np.ones(2)))
    fit = maximise(objective, [1.0, 1.0], [0.1, 0.1], lower_bounds=[0.5, -np.inf])
    assert np.min(objective.points, axis=0)[0] >= 0.5 - 1e-12
    np.testing.assert_allclose(fit.parameters, [0.6, 4.0], atol=0.1)
    hill = bowl(np.array([3.0, -1.0]), np.ones(2))
    fit = maximise(hill, [0.0, 0.0], [0.01, 0.01], restrict=lambda point: np.minimum(point, [1.5, np.inf]))
    assert max(step.parameters[0] for step in fit.history) <= 1.5
    np.testing.assert_allclose(fit.parameters, [1.5, -1.0], atol=0.02)
    # Jumps smaller than an increment do not stop the climb.
    gentle = bowl(np.array([3.0, -1.0]), np.full(2, 0.1))
    fit = maximise(lambda point: float(np.round(100.0 * gentle(point)) / 100.0), np.zeros(2), np.full(2, 0.2))
    assert fit.score >= 0.98


def test_an_objective_without_maximum_is_reported_with_its_history():
    with pytest.raises(ConvergenceError, match="has not ended after 200 steps"):
        maximise(lambda parameters: float(parameters[0]), [0.0], [1.0])
    with pytest.raises(ConvergenceError, match="after 2 iterations") as caught:
        maximise(bowl(np.ones(2), np.array([1.0, 30.0])), [0.0, 0.0], [0.01, 0.01], most_iterations=2)
    assert len(caught.value.history) == 3
    with pytest.raises(InputError, match=r"score at \[0.9, 0.9\] must be a finite number"):
        maximise(lambda parameters: np.nan, [1.0, 1.0], [0.1, 0.1])
