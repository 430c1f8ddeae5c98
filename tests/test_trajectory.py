"""Motions back and forth: their samples and corners, release, second touch, vibration, force to 0."""

from dataclasses import replace

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

import fingerpad as fp
from fingerpad.mechanics.newton import NewtonSettings
from presses import ELASTIC, RELAXING, block, press_into
from refusals import refusals

BALL = fp.Sphere(curvature_per_m=500.0)
STEPS = fp.PressSettings(ramp_steps=4, hold_steps=3)
TIGHT = replace(STEPS, newton=NewtonSettings(residual_tolerance=1e-7, penetration_tolerance=1e-4))
RELEASE = fp.Trajectory((0.0, 50.0, 500.0, 550.0, 1500.0), (0.0, 0.4, 0.4, 0.0, 0.0))


def pressed(motion, materials=RELAXING, indenter=BALL, settings=STEPS, friction=0.0):
    return press_into(block(), materials, indenter, motion, settings, friction=friction)


def test_ramp_and_hold_as_a_trajectory_is_solved_at_the_same_times_and_gives_the_same_force():
    for ready, other in (
        (fp.RampAndHold(0.4, 50.0, 500.0), fp.Trajectory((0.0, 50.0, 550.0), (0.0, 0.4, 0.4))),
        (
            fp.ForceRampAndHold(20.0, 50.0, 500.0),
            fp.Trajectory((0.0, 50.0, 550.0), force_mn=(0.0, 20.0, 20.0)),
        ),
    ):
        np.testing.assert_allclose(other.step_times_ms(5, 7), ready.step_times_ms(5, 7), rtol=1e-14)
        assert other.corners_ms == ready.corners_ms
        one, two = pressed(ready), pressed(other)
        np.testing.assert_allclose(two.force_mn, one.force_mn, rtol=1e-6)
        np.testing.assert_allclose(two.depth_mm, one.depth_mm, rtol=1e-6)


@pytest.mark.parametrize("by", ["depth_mm", "force_mn"])
def test_a_touch_after_a_rest_or_an_approach_through_the_air_is_the_same_touch(by):
    largest = {"depth_mm": 0.4, "force_mn": 20.0}[by]
    touch = fp.Trajectory((0.0, 50.0, 350.0), **{by: (0.0, largest, largest)})
    later = [fp.Trajectory((0.0, 500.1, 550.1, 850.1), **{by: (0.0, 0.0, largest, largest)})]
    if by == "depth_mm":
        later += [
            fp.Trajectory((0.0, 150.0, 450.0), (-2.0 * largest, largest, largest)),
            fp.Trajectory((0.0, 20.0, 33.3, 83.3, 383.3), (-9.0, -9.0, 0.0, largest, largest)),
        ]
    once = pressed(touch)
    for motion in later:
        onset = motion.onset_ms
        assert motion.corners_ms == pytest.approx([onset, onset + 50.0])
        assert [phase.name for phase in motion.phases] == ["ramp", "hold"]
        assert motion.phases[0].window_ms == pytest.approx((onset, onset + 50.0))
        again = pressed(motion)
        touched = again.times_ms >= onset
        np.testing.assert_allclose(again.times_ms[touched] - onset, once.times_ms, atol=1e-9)
        np.testing.assert_array_equal(again.sed_kpa[touched], once.sed_kpa)
        assert not again.sed_kpa[~touched].any()


def test_noise_of_a_tare_and_a_lift_between_two_touches_are_not_counted_as_ramp():
    times = np.arange(0.0, 1000.0)
    noise = 0.003 * np.sin(7.0 * times)
    tare = fp.Trajectory(times, np.interp(times, [0.0, 500.0, 550.0], [0.0, 0.0, 1.0]) + noise)
    assert tare.phases[0].window_ms == pytest.approx((500.0, 550.0), abs=2.0)
    twice = fp.Trajectory((0.0, 50.0, 300.0, 350.0, 500.0, 600.0), (0.0, 1.0, 1.0, -1.0, -1.0, 1.0))
    assert [(phase.name, phase.start_ms) for phase in twice.phases] == [
        ("ramp", 0.0), ("hold", 50.0), ("release", 300.0), ("pause", 325.0), ("ramp 2", 550.0)
    ]  # fmt: skip


def test_a_recording_with_few_samples_is_as_exact_from_high_above_the_skin():
    times = np.arange(0.0, 400.0)
    depth = np.interp(times, [0.0, 100.0, 150.0, 399.0], [-20.0, 0.0, 1.0, 1.0]) - 0.03 * (times > 300.0)
    few = fp.Trajectory(times, depth).reduced()
    assert np.abs(few.prescribed_at(times) - depth).max() <= 0.005


def test_corners_are_kept_beside_slow_parts_and_a_smooth_curve_has_none():
    assert RELEASE.corners_ms == (50.0, 500.0, 550.0)
    # The vibration begins at full speed after a hold: a corner. Its extremes are smooth.
    assert fp.sine(0.8, 0.1, 20.0, cycles=2).corners_ms == (50.0, 1000.0)
    triangle = fp.Trajectory((0.0, 10.0, 20.0, 30.0), (0.0, 1.0, 0.0, 1.0))
    assert triangle.corners_ms == (10.0, 20.0)
    straight = fp.Trajectory((0.0, 10.0, 30.0, 40.0), (0.0, 0.1, 0.3, 0.4))
    assert straight.corners_ms == ()
    # A stroke at a tenth of the speed of the ramp, to and fro; a slow second touch.
    strokes = fp.stroke(0.5, speed_mm_per_s=2.0, x_mm=2.0, strokes=3, ramp_ms=25.0, hold_ms=200.0)
    assert strokes.corners_ms == strokes.times_ms[1:-1]
    slow = fp.Trajectory((0, 10, 200, 210, 500, 700, 1900, 2100), (0, 1, 1, 0, 0, 0.5, 0.5, 0))
    assert slow.corners_ms == slow.times_ms[1:-1]
    moved = fp.Trajectory(
        (0, 60, 300, 597, 602, 659, 899), (0, 0.8, 0.8, 0.8, 0.77, -0.2, -0.2), x_mm=(0, 0, 0, 3, 3, 3, 3)
    )
    assert moved.corners_ms == moved.times_ms[1:-1]


@pytest.mark.parametrize("per_cycle", [12, 20, 100])
def test_a_smooth_curve_has_no_corners_however_it_is_sampled(per_cycle):
    turns = np.arange(3 * per_cycle + 1) / per_cycle
    wave = fp.Trajectory(
        100.0 * turns, 1.0 - np.cos(2.0 * np.pi * turns), z_mm=0.1 * np.sin(2.0 * np.pi * turns)
    )
    assert wave.corners_ms == ()


@given(
    steps=st.lists(st.tuples(st.floats(0.5, 500.0), st.floats(-0.5, 2.0)), min_size=1, max_size=8),
    ramp_steps=st.integers(1, 9),
    hold_steps=st.integers(1, 9),
)
def test_solved_times_increase_and_hold_all_samples(steps, ramp_steps, hold_steps):
    lengths, depths = zip(*steps, strict=True)
    samples = (0.0, *np.cumsum(lengths))
    motion = fp.Trajectory(samples, (0.0, *depths[:-1], 1.0))
    times = motion.step_times_ms(ramp_steps, hold_steps)
    assert (np.diff(times) > 0.0).all()
    assert np.isin(samples, times).all()
    way = np.abs(np.diff(motion.prescribed_at(times[times >= motion.onset_ms])))
    assert way.max() <= motion.largest / ramp_steps * (1 + 1e-5)


test_impossible_trajectories_are_refused_in_one_sentence = refusals(
    (((0.0,), (0.0,)), "at least two times"),
    (((1.0, 2.0), (0.0, 1.0)), "the first of them 0"),
    (((0.0, np.nan), (0.0, 1.0)), "times_ms"),
    (((0.0, 1.0), (0.0, 1.0, 2.0)), "one value per time, 2: got 3"),
    (((0.0, 1.0), (0.5, 1.0)), "depth_mm must begin with 0 or less"),
    (((0.0, 1.0), (0.0, -1.0)), "would never press"),
    (((0.0, 1.0),), "either depth_mm or force_mn"),
    (((0.0, 1.0, 2.0), None, (0.0, -1.0, 1.0)), "force_mn must not be negative: got -1 mN at 1 ms"),
    call=lambda samples: fp.Trajectory(*samples),
)  # fmt: skip


def test_elastic_skin_takes_the_same_path_back():
    """Without relaxation and friction the force depends on the depth only, and all work is returned."""
    motion = fp.Trajectory((0.0, 50.0, 100.0), (0.0, 0.4, 0.0))
    done = pressed(motion, ELASTIC, settings=TIGHT)
    middle = np.flatnonzero(done.times_ms == 50.0)[0]
    down, up = done.force_mn[: middle + 1], done.force_mn[middle:][::-1]
    np.testing.assert_allclose(up, down, rtol=0, atol=1e-4 * down.max())
    # At depth 0 the skin lies on the indenter within the tolerance of the residual.
    assert done.force_mn[-1] <= 1e-5 * down.max()
    np.testing.assert_allclose(done.displacement_mm[-1], 0.0, atol=1e-5)
    assert done.sed_kpa[-1].max() <= 1e-6 * done.sed_kpa.max()


@pytest.mark.parametrize(
    ("indenter", "friction"), [(BALL, 0.0), (fp.Bar(1.7, 0.3), 0.5)], ids=["ball", "bar"]
)
def test_release_ends_without_force_and_with_energy_in_balance(indenter, friction):
    done = pressed(RELEASE, indenter=indenter, friction=friction)
    assert done.force_mn[-1] == 0.0
    assert (done.force_mn >= 0.0).all()
    assert done.energy.relative_imbalance <= 0.015
    assert not done.contact.area_mm2[-1]


def test_force_back_to_zero_lets_the_skin_go_and_takes_it_up_again():
    motion = fp.Trajectory(
        (0.0, 50.0, 250.0, 300.0, 400.0, 450.0), force_mn=(0.0, 20.0, 20.0, 0.0, 0.0, 20.0)
    )
    done = pressed(motion)
    np.testing.assert_allclose(done.force_mn, motion.prescribed_at(done.times_ms), rtol=0, atol=1e-3)
    released = np.flatnonzero((done.times_ms >= 300.0) & (done.times_ms <= 400.0))
    assert not done.force_mn[released].any()
    # The indenter follows the skin that recovers, up to its surface.
    assert (np.diff(done.depth_mm[released]) < 0.0).all()
    assert (done.depth_mm[released] > 0.0).all()
    assert done.depth_mm[-1] > done.depth_mm[done.times_ms == 50.0][0]


@pytest.mark.parametrize("tolerance", [None, 0.2], ids=["steps", "tolerance"])
def test_a_response_has_the_wanted_times(tolerance):
    wanted = (20.0, 40.0, 130.0)
    settings = fp.PressSettings(2, 2, sed_tolerance=tolerance, times_ms=wanted)
    done = pressed(fp.RampAndHold(0.2, 50.0, 100.0), settings=settings)
    assert np.isin((*wanted, 50.0, 150.0), done.times_ms).all()
    assert (np.diff(done.force_mn[done.times_ms <= 50.0]) > 0.0).all()


def test_skin_that_lies_higher_aside_is_pressed_above_first_touch():
    """1.5 mm towards the tip of the tilted finger the skin is met 0.12 mm earlier."""

    def aside(depth_mm):
        times_ms, x_mm = (0.0, 50.0, 100.0, 150.0), (0.0, -1.5, -1.5, -1.5)
        motion = fp.Trajectory(times_ms, depth_mm=(-0.7, -0.7, depth_mm, depth_mm), x_mm=x_mm)
        return fp.touch_of(fp.Fingertip(), fp.Sphere(curvature_per_m=287.0), motion)

    assert 1.0 < aside(-0.05).solve().force_mn.max() < 10.0
    with pytest.raises(fp.InputError, match=r"Sphere meets no resistance, .* 0\.49 mm away: press deeper"):
        aside(-0.65).solve()


def test_punch_that_goes_between_two_nodes_is_refused_instead_of_pressing_with_no_force(monkeypatch):
    tiny = fp.FlatPunch(diameter_mm=0.1, fillet_mm=0.02)
    with pytest.raises(fp.InputError, match="would go between the nodes"):
        fp.touch_of(fp.Fingertip(), tiny, fp.RampAndHold(depth_mm=0.3))
    # What its size does not tell is told by the force.
    monkeypatch.setattr("fingerpad.geometry.size_field.FEWEST_BELOW", 1)
    with pytest.raises(fp.ConvergenceError, match=r"The skin slips past the indenter: its force falls from"):
        fp.touch_of(fp.Fingertip(), tiny, fp.RampAndHold(depth_mm=0.3), "trial3").solve()


def test_a_vibration_of_ones_own_is_one_phase_and_taps_stay_apart():
    """0.8 mm, then 0.1 mm at 20 Hz, recorded in steps of 0.1 µm; taps leave the skin or stop between them."""

    def depth(time_ms):
        wave = 0.1 * np.sin(2 * np.pi * 0.02 * (time_ms - 50.0))
        return 0.8 * min(time_ms / 50.0, 1.0) + (wave if time_ms > 50.0 else 0.0)

    times = np.arange(0.0, 500.5, 0.5)
    recorded = fp.Trajectory(times, [round(depth(time), 4) for time in times])
    for motion in (recorded, fp.sampled(500.0, depth)):
        assert [phase.name for phase in motion.phases] == ["ramp", "vibration"]
        assert motion.phases[1].end_ms == 500.0
        assert 50.0 <= motion.phases[1].start_ms < 65.0
    assert repr(recorded) == "Trajectory(1001 samples to 500 ms, depth_mm at most 0.9 mm, ramp, vibration)"
    saw = fp.Trajectory(50.0 * np.arange(9.0), [0.0, 1.0] * 4 + [0.0])
    assert [phase.name for phase in saw.phases][:4] == ["ramp", "release", "ramp 2", "release 2"]
    stairs = fp.Trajectory(50.0 * np.arange(9.0), [0.0, 1.0, 1.0, 0.5, 0.5, 1.0, 1.0, 0.5, 0.5])
    assert [phase.name for phase in stairs.phases][-2:] == ["release 2", "hold 4"]
