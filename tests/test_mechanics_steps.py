"""Steps in time against curves known in closed form, and steps that fail."""

from dataclasses import dataclass

import numpy as np
import pytest

from fingerpad.core.errors import ConvergenceError
from fingerpad.mechanics.steps import LENGTHEN_AFTER, Phase, adaptive_steps, steps_at

RAMP_MS, END_MS = 50.0, 1000.0
PHASES = (Phase(RAMP_MS, first_ms=6.0, loading=True), Phase(END_MS, first_ms=6.0, loading=False))
ALL = np.arange(2)


@dataclass(frozen=True)
class Known:
    time_ms: float
    sed_kpa: np.ndarray


def energy(times_ms):
    """Like SED under a sphere: growth as depth^2.5 and faster, then relaxation by two thirds; (2, n)."""
    ramp, hold = np.minimum(times_ms, RAMP_MS) / RAMP_MS, np.maximum(times_ms - RAMP_MS, 0.0)
    relaxed = 0.3 + 0.3 * np.exp(-hold / 15.0) + 0.4 * np.exp(-hold / 300.0)
    return np.array([3.0 * ramp**2.5 * relaxed, 2.0 * np.maximum(ramp - 0.4, 0.0) ** 2 * relaxed])


def known(time_ms):
    return Known(time_ms, energy(np.array(time_ms)))


def exact_step(moment, target_ms):
    return known(target_ms)


def stop(moment, attempts, cause):
    return ConvergenceError(f"stopped at {moment.time_ms:g} ms", attempts)


def adapted(tolerance, step=exact_step):
    return [known(0.0), *adaptive_steps(known(0.0), PHASES, tolerance, ALL, step, stop)]


@pytest.mark.parametrize("tolerance", [0.05, 0.01, 0.002])
def test_energy_is_linear_between_the_steps_within_the_tolerance(tolerance):
    path = adapted(tolerance)
    times = np.array([moment.time_ms for moment in path])
    fine = np.linspace(0.0, END_MS, 200_001)
    for element, truth in enumerate(energy(fine)):
        found = np.interp(fine, times, [moment.sed_kpa[element] for moment in path])
        assert np.abs(found - truth).max() <= tolerance * 3.0
    assert RAMP_MS in times
    assert times[-1] == END_MS
    assert (np.diff(times) > 0.0).all()


def test_steps_are_about_as_few_as_the_tolerance_allows():
    """The error goes as the square of the step: four times the tolerance, half the steps."""
    counts = [len(adapted(tolerance)) for tolerance in (0.016, 0.004, 0.001)]
    assert 1.5 < counts[1] / counts[0] < 2.2
    assert 1.7 < counts[2] / counts[1] < 2.2
    # The best possible: sqrt(curvature) integrated over time, over sqrt(8 tolerance), element by element.
    times = np.linspace(0.0, END_MS, 200_001)
    best = 0.0
    for chosen in (times < RAMP_MS - 0.1, times > RAMP_MS + 0.1):
        slope = np.gradient(energy(times[chosen]), times[chosen], axis=1)
        curvature = np.gradient(slope, times[chosen], axis=1)
        best += np.trapezoid(np.sqrt(np.abs(curvature).max(axis=0) / (8 * 0.001 * 3.0)), times[chosen])
    assert best < counts[2] < 3 * best


def failing_beyond(longest_ms, between=(0.0, END_MS)):
    def step(moment, target_ms):
        inside = between[0] <= moment.time_ms < between[1]
        if inside and target_ms - moment.time_ms > longest_ms:
            raise ConvergenceError("too long.", ("iteration 3: residual 1e+1",))
        return known(target_ms)

    return step


def test_adaptive_steps_are_cut_where_they_fail_or_end_in_an_error_with_every_attempt():
    path = adapted(0.05, failing_beyond(0.7, between=(10.0, 25.0)))
    times = np.array([moment.time_ms for moment in path])
    steps = np.diff(times)[(times[:-1] >= 10.0) & (times[:-1] < 25.0)]
    assert steps.size > 15
    assert steps.max() <= 0.7
    assert times[-1] == END_MS
    with pytest.raises(ConvergenceError, match="stopped at 0 ms") as failure:
        adapted(0.05, failing_beyond(0.0))
    assert failure.value.history[0] == "step from 0 to 6 ms: too long. Last: iteration 3: residual 1e+1."
    assert len(failure.value.history) >= 8


def test_energy_that_jumps_never_meets_a_tolerance():
    def jumping(moment, target_ms):
        return Known(target_ms, np.array([target_ms + (10.0 if target_ms > 20.0 else 0.0), 0.0]))

    with pytest.raises(ConvergenceError, match="stopped at ") as failure:
        adapted(0.01, jumping)
    assert "error of SED" in failure.value.history[-1]


def test_given_times_are_reached_exactly_and_cuts_outlast_them():
    """Steps of 10 ms where only 3 converge: cut to 2.5 once, not at every time, and doubled after some."""
    targets = []
    failing = failing_beyond(3.0, between=(0.0, 40.0))

    def recorded(moment, target_ms):
        targets.append((moment.time_ms, target_ms))
        return failing(moment, target_ms)

    times = np.arange(10.0, 101.0, 10.0)
    path = list(steps_at(known(0.0), times, recorded, stop))
    assert [moment.time_ms for moment in path] == times.tolist()
    assert targets[:3] == [(0.0, 10.0), (0.0, 5.0), (0.0, 2.5)]
    tried_whole = [start for start, end in targets if end - start == 10.0]
    assert tried_whole == [0.0, 50.0, 60.0, 70.0, 80.0, 90.0]
    lengths = [end - start for start, end in targets if start < 40.0 and end - start <= 2.5]
    assert lengths == [2.5] * 16
    assert sum(end - start == 5.0 for start, end in targets if start < 40.0) == 1 + 16 // LENGTHEN_AFTER - 1


def test_given_times_out_of_reach_are_an_error_that_keeps_the_attempts():
    with pytest.raises(ConvergenceError, match="stopped at 10 ms") as failure:
        list(steps_at(known(0.0), [10.0, 20.0], failing_beyond(0.1, between=(10.0, 20.0)), stop))
    ends = [line.split(":")[0].removeprefix("step from 10 to ") for line in failure.value.history]
    assert ends == ["20 ms", "15 ms", "12.5 ms", "11.25 ms", "10.62 ms", "10.31 ms"]
