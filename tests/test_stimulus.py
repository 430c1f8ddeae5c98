"""The motion of the indenter and the times at which it is solved."""

import numpy as np
import pytest
from hypothesis import assume, given
from hypothesis import strategies as st

from fingerpad import ForceRampAndHold, InputError, RampAndHold


def test_depth_or_force_rises_linearly_then_stays_at_the_same_times():
    motion = RampAndHold(depth_mm=2.0, ramp_ms=40.0, hold_ms=100.0)
    np.testing.assert_allclose(
        motion.prescribed_at([-5.0, 0.0, 10.0, 40.0, 41.0, 140.0]), [0, 0, 0.5, 2, 2, 2], rtol=1e-15
    )
    assert motion.end_ms == 140.0
    assert motion.prescribed_at(np.zeros((2, 3))).shape == (2, 3)
    motion = ForceRampAndHold(force_mn=80.0, ramp_ms=40.0, hold_ms=100.0)
    np.testing.assert_allclose(
        motion.prescribed_at([-5.0, 0.0, 10.0, 40.0, 140.0]), [0, 0, 20, 80, 80], rtol=1e-15
    )
    assert motion.end_ms == 140.0
    depth = RampAndHold(depth_mm=1.0, ramp_ms=40.0, hold_ms=100.0)
    np.testing.assert_array_equal(motion.step_times_ms(4, 5), depth.step_times_ms(4, 5))


@given(
    ramp_ms=st.floats(1.0, 500.0),
    hold_ms=st.floats(0.5, 5000.0),
    ramp_steps=st.integers(1, 12),
    hold_steps=st.integers(1, 12),
)
def test_times_cover_both_phases_and_increase(ramp_ms, hold_ms, ramp_steps, hold_steps):
    assume(hold_ms == ramp_ms / ramp_steps or abs(hold_ms / ramp_ms * ramp_steps - 1.0) > 1e-6)
    motion = RampAndHold(depth_mm=1.0, ramp_ms=ramp_ms, hold_ms=hold_ms)
    times = motion.step_times_ms(ramp_steps, hold_steps)
    if hold_ms <= ramp_ms / ramp_steps:  # a hold as short as a step of the ramp is one step
        hold_steps = 1
    assert times.size == 1 + ramp_steps + hold_steps
    assert times[0] == 0.0
    assert times[ramp_steps] == ramp_ms
    assert times[-1] == motion.end_ms
    steps = np.diff(times)
    assert (steps > 0).all()
    np.testing.assert_allclose(steps[:ramp_steps], ramp_ms / ramp_steps, rtol=1e-9)


def test_hold_times_grow_geometrically_from_the_ramp_step():
    since_ramp = RampAndHold(depth_mm=1.0, ramp_ms=50.0, hold_ms=950.0).step_times_ms(5, 6)[6:] - 50.0
    np.testing.assert_allclose(since_ramp[0], 10.0, rtol=1e-13)
    np.testing.assert_allclose(since_ramp[1:] / since_ramp[:-1], 95.0 ** (1 / 5), rtol=1e-12)


@pytest.mark.parametrize("name", ["depth_mm", "ramp_ms", "hold_ms"])
def test_impossible_motions_are_refused_in_one_sentence(name):
    for value in (0.0, -1.0, np.nan, np.inf, "1 mm", True):
        with pytest.raises(InputError, match=rf"{name}.*\.$"):
            RampAndHold(**{name: value})
