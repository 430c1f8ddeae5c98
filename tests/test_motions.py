"""Ready-made motions, motions from functions and files, wanted times, and motions that cannot be."""

import math
from dataclasses import replace

import numpy as np
import pytest
from hypothesis import example, given
from hypothesis import strategies as st

import fingerpad as fp
from fingerpad.core.phases import Phase
from fingerpad.geometry.motion import check_path
from refusals import refusals

AT_MM = (17.37, 0.0)


def written(folder, text):
    path = folder / "motion.csv"
    path.write_text(text, encoding="utf-8")
    return path


def table(columns, rows):
    return "\n".join([columns, *(",".join(f"{value:.10g}" for value in row) for row in rows)]) + "\n"


def test_a_staircase_holds_each_of_its_levels():
    steps = fp.staircase([0.5, 1.0, 0.2], ramp_ms=50.0, hold_ms=300.0)
    assert steps.times_ms == (0.0, 50.0, 350.0, 400.0, 700.0, 750.0, 1050.0)
    assert steps.depth_mm == (0.0, 0.5, 0.5, 1.0, 1.0, 0.2, 0.2)
    by_force = fp.staircase(forces_mn=[50.0, 20.0])
    assert by_force.force_mn == (0.0, 50.0, 50.0, 20.0, 20.0)
    assert fp.repeated(1.0, 2, 50.0, 200.0, 300.0).depth_mm == (0.0, 1.0, 1.0, 0.0, 0.0, 1.0, 1.0, 0.0, 0.0)


def test_a_stroke_goes_to_and_fro_at_its_speed():
    motion = fp.stroke(force_mn=200.0, speed_mm_per_s=20.0, x_mm=3.0, z_mm=-4.0, strokes=3, hold_ms=100.0)
    assert motion.force_mn == (0.0, 200.0, 200.0, 200.0, 200.0, 200.0)
    assert motion.x_mm == (0.0, 0.0, 0.0, 3.0, 0.0, 3.0)
    assert motion.z_mm == (0.0, 0.0, 0.0, -4.0, 0.0, -4.0)
    np.testing.assert_allclose(np.diff(motion.times_ms)[2:], 250.0)
    assert [phase.name for phase in motion.phases] == ["ramp", "hold", "stroke", "stroke 2", "stroke 3"]
    assert motion.phases[-1].window_ms == (650.0, 900.0)
    at_once = fp.stroke(0.5, speed_mm_per_s=20.0, z_mm=5.0, hold_ms=0.0)
    assert [phase.name for phase in at_once.phases] == ["ramp", "stroke"]


def test_a_stroke_along_corners_keeps_its_speed_and_comes_back_the_same_way():
    """A circle of 24 corners at constant force, there and back, and a triangle."""
    angle = np.linspace(0.0, 2.0 * np.pi, 25)[1:]
    x_mm, z_mm = np.sin(angle), 1.0 - np.cos(angle)
    motion = fp.stroke(force_mn=100.0, speed_mm_per_s=8.0, x_mm=x_mm, z_mm=z_mm, strokes=2, hold_ms=100.0)
    assert set(motion.force_mn[1:]) == {100.0}
    times, way = np.array(motion.times_ms[2:]), np.array([motion.x_mm, motion.z_mm])[:, 2:]
    np.testing.assert_allclose(np.hypot(*np.diff(way)) / np.diff(times), 0.008)
    np.testing.assert_allclose(way[:, 25:], way[:, 23::-1], atol=1e-15)
    assert [phase.name for phase in motion.phases] == ["ramp", "hold", "stroke", "stroke 2"]
    assert motion.phases[2].end_ms == motion.times_ms[2 + 24]
    # A polygon of 24 corners turns by 15 degrees at each: smooth. That of a triangle is not.
    assert motion.corners_ms == (50.0, 150.0, motion.phases[2].end_ms)
    triangle = fp.stroke(0.5, speed_mm_per_s=10.0, x_mm=[3.0, 3.0, 0.0], z_mm=[0.0, 4.0, 0.0])
    assert triangle.corners_ms == triangle.times_ms[1:-1] == (50.0, 1000.0, 1300.0, 1700.0)


def test_a_rotation_turns_at_its_speed_and_is_looked_at_on_its_way():
    motion = fp.stroke(force_mn=100.0, spin_deg=90.0, tilt_deg=0.0, speed_deg_per_s=45.0, strokes=2)
    assert motion.spin_deg == (0.0, 0.0, 0.0, 90.0, 0.0)
    assert motion.x_mm is motion.z_mm is motion.tilt_deg is None
    assert np.diff(motion.times_ms).tolist() == [50.0, 950.0, 2000.0, 2000.0]
    assert [phase.name for phase in motion.phases] == ["ramp", "hold", "stroke", "stroke 2"]
    turned = [pose.spin_deg for pose in motion.poses]
    np.testing.assert_allclose(turned, [0.0, 0.0, *range(0, 91, 10), *range(80, -1, -10)], atol=1e-12)
    rocked = fp.stroke(0.5, tilt_deg=[10.0, -10.0, 0.0], speed_deg_per_s=20.0, hold_ms=0.0)
    assert rocked.times_ms == (0.0, 50.0, 550.0, 1550.0, 2050.0)
    rolled = fp.stroke(0.5, speed_mm_per_s=10.0, x_mm=[3.0, 0.0], spin_deg=[0.0, 40.0], hold_ms=0.0)
    assert rolled.times_ms == (0.0, 50.0, 350.0, 650.0)
    assert rolled.spin_deg == (0.0, 0.0, 0.0, 40.0)


def test_touches_can_be_repeated_by_force():
    taps = fp.repeated(force_mn=80.0, touches=2, ramp_ms=20.0, hold_ms=100.0, pause_ms=50.0)
    assert taps.force_mn == (0.0, 80.0, 80.0, 0.0, 0.0, 80.0, 80.0, 0.0, 0.0)
    assert [phase.name for phase in taps.phases][3:6] == ["pause", "ramp 2", "hold 2"]


@given(st.floats(1.0, 100.0), st.floats(1.0, 100.0))
@example(95.99999999999999, 33.0)  # Its last cycle ends with the sweep, but for rounding.
def test_a_chirp_has_the_phase_of_its_frequency(first, last):
    motion = fp.chirp(0.8, 0.05, (first, last), sweep_ms=2000.0, ramp_ms=50.0, hold_ms=150.0)
    since_s = (np.array(motion.times_ms[3:]) - 200.0) / 1000.0
    turns = first * since_s + (last - first) / 2.0 * since_s**2 / 2.0
    np.testing.assert_allclose(motion.depth_mm[3:], 0.8 + 0.05 * np.sin(2.0 * np.pi * turns), atol=1e-9)
    np.testing.assert_allclose(np.diff(turns), 0.05, atol=1e-9)
    assert motion.end_ms <= 2200.0
    assert motion.phases[-1].name == "sweep"


@given(st.floats(5.0, 900.0), st.floats(0.001, 0.05))
def test_a_function_is_followed_within_its_tolerance_and_its_corner_is_a_sample(corner_ms, tolerance):
    def depth_mm(time_ms):
        held = math.cos((time_ms - corner_ms) / 200.0) - 1.0 if time_ms > corner_ms else 0.0
        return min(time_ms / corner_ms, 1.0) + 0.2 * held

    motion = fp.sampled(1000.0, depth_mm, tolerance=tolerance)
    times = np.linspace(0.0, 1000.0, 4001)
    error = np.abs(motion.prescribed_at(times) - [depth_mm(time) for time in times])
    assert error.max() <= 1.05 * tolerance
    assert np.abs(np.array(motion.times_ms) - corner_ms).min() <= 1e-3 * corner_ms
    # As many samples as the curvature asks for, up to a factor of three.
    assert len(motion.times_ms) <= 6 + 3 * 1000.0 / math.sqrt(8.0 * tolerance * 200.0**2 / 0.2)


def test_a_function_of_place_and_rotation_is_sampled_with_the_depth():
    motion = fp.sampled(
        400.0,
        lambda t: min(t / 100.0, 1.0),
        x_mm=lambda t: max(t - 200.0, 0.0) / 50.0,
        spin_deg=lambda t: 0.0,
    )
    np.testing.assert_allclose(motion.times_ms, (0.0, 100.0, 200.0, 400.0), atol=1e-4)
    np.testing.assert_allclose(motion.x_mm, (0.0, 0.0, 0.0, 4.0), atol=1e-5)
    assert motion.stays is False
    assert [phase.name for phase in motion.phases] == ["ramp", "hold", "move"]


test_motions_that_cannot_be_are_refused = refusals(
    (lambda: fp.sampled(100.0), "either depth_mm or force_mn"),
    (lambda: fp.sampled(100.0, lambda t: float(t > 30.0)), "must not jump: it does at 30 ms"),
    (lambda: fp.sampled(100.0, lambda t: math.nan if t > 50.0 else t),
     "depth_mm at .* ms must be a finite number: got nan"),
    (lambda: fp.sampled(100.0, lambda t: "a"), "depth_mm at 0 ms must be a finite number: got 'a'"),
    (lambda: fp.sampled(100.0, lambda t: t, x_mm=lambda t: None), "x_mm at 0 ms must be .*: got None"),
    (lambda: fp.sampled(100.0, lambda t: 1.0 + t), "depth_mm must begin with 0 or less"),
    (lambda: fp.sampled(0.0, lambda t: t), ("end_ms",)),
    (lambda: fp.staircase([0.5], [50.0]), "either depth_mm or force_mn"),
    (lambda: fp.stroke(0.5, speed_mm_per_s=20.0), "A stroke needs a way: x_mm or z_mm must not be 0"),
    (lambda: fp.stroke(0.5, x_mm=1.0), "either speed_mm_per_s or speed_deg_per_s"),
    (lambda: fp.stroke(0.5, speed_mm_per_s=1.0, speed_deg_per_s=1.0, x_mm=1.0), "give one of them"),
    (lambda: fp.stroke(0.5, speed_mm_per_s=20.0, x_mm=[1.0, 1.0]), "change from corner to corner"),
    (lambda: fp.stroke(0.5, speed_mm_per_s=20.0, x_mm=[1.0, 2.0], z_mm=1.0), "of a stroke must have as many"),
    (lambda: fp.stroke(0.5, speed_mm_per_s=20.0, x_mm=[1.0, math.nan]), "x_mm must hold finite numbers"),
    (lambda: fp.stroke(0.5, speed_mm_per_s=20.0, x_mm="a"), "x_mm must be a finite number .mm.: got 'a'"),
    (lambda: fp.stroke(0.5, speed_deg_per_s=20.0, x_mm=1.0), "tilt_deg or spin_deg must not be 0"),
    (lambda: fp.repeated(0.5, force_mn=50.0), "either depth_mm or force_mn"),
    (lambda: fp.chirp(0.8, 0.05, (5.0, 10.0), 100.0), "must leave time for a cycle"),
    (lambda: fp.Trajectory((0.0, 1.0, 0.5), (0.0, 1.0, 1.0)), "strictly: got 0.5 after 1, number 3"),
    (lambda: fp.Trajectory((0.0, 1.0), (0.0, math.nan)), "only: 1 are not, first number 2"),
    (lambda: fp.Trajectory((0.0, 0.05), (0.0, 1.0)), "faster than 10 m/s: got 20 m/s until 0.05 ms"),
    (lambda: fp.Trajectory((0.0, 1.0), (0.0, 1.0), z_mm=(0.0, 11.0)), "z_mm must not change faster"),
    (lambda: fp.touch_of(fp.Fingertip(), fp.Sphere(), times_ms=(0.0, 5.0)), "times_ms must lie above 0"),
    (lambda: fp.touch_of(fp.Fingertip(), fp.Sphere(), times_ms=(5.0, 5.0)), "must increase strictly"),
    (lambda: fp.touch_of(fp.Fingertip(), fp.Sphere(), times_ms=(math.inf,)),
     "times_ms must hold finite numbers only"),
    (lambda: fp.touch_of(fp.Fingertip(), fp.Sphere(), times_ms=(2000.0,)),
     "times_ms must lie within the motion, which ends at 1000 ms: got 2000 ms"),
)  # fmt: skip


def recording(noise_mm=0.002, seed=3):
    """Press, slide and release, recorded at 1 kHz with noise."""
    times = np.arange(1201.0)
    true = fp.Trajectory((0, 80, 500, 900, 960, 1200), (0, 1.2, 1.2, 1.2, 0, 0), x_mm=(0, 0, 0, 4, 4, 4))
    random = np.random.default_rng(seed)
    depth = true.prescribed_at(times) + noise_mm * random.normal(size=times.size)
    x = np.interp(times, true.times_ms, true.x_mm) + noise_mm * random.normal(size=times.size)
    return true, fp.Trajectory(times, (0.0, *depth[1:]), x_mm=(0.0, *x[1:]))


@pytest.mark.parametrize("seed", range(2))
def test_a_recording_with_noise_is_reduced_to_its_corners(seed):
    true, recorded = recording(seed=seed)
    few = recorded.reduced(tolerance=0.02)
    assert len(few.times_ms) <= 12
    for corner in true.corners_ms:
        assert np.abs(np.array(few.times_ms) - corner).min() <= 4.0
    error = np.abs(few.prescribed_at(recorded.times_ms) - np.array(recorded.depth_mm))
    assert error.max() <= 0.02 * recorded.largest
    names = [phase.name for phase in few.phases]
    assert names == ["ramp", "hold", "move", "release", "pause"]
    ramp = few.phases[0]
    assert ramp.start_ms == 0.0
    assert abs(ramp.end_ms - 80.0) <= 4.0


def test_the_error_of_a_reduction_is_bounded_at_all_samples_of_all_columns():
    _, recorded = recording(noise_mm=0.05)
    for tolerance in (0.001, 0.05, 0.3):
        few = recorded.reduced(tolerance)
        for name, extent in (("depth_mm", max(recorded.depth_mm)), ("x_mm", max(recorded.x_mm))):
            line = np.interp(recorded.times_ms, few.times_ms, getattr(few, name))
            assert np.abs(line - getattr(recorded, name)).max() <= tolerance * extent * (1 + 1e-12)
    assert recorded.reduced(1e-9).times_ms == recorded.times_ms


def test_given_names_of_phases_stay_when_samples_are_left_out():
    _, recorded = recording()
    named = replace(recorded, phases=(Phase("ramp", 0.0, 80.0), Phase("rest", 80.0, 1200.0)))
    assert named.reduced().phases == named.phases


def test_a_hold_that_drifts_is_solved_in_growing_steps():
    drifting = fp.Trajectory((0.0, 50.0, 1000.0), (0.0, 1.0, 1.004))
    held = fp.Trajectory((0.0, 50.0, 1000.0), (0.0, 1.0, 1.0))
    np.testing.assert_allclose(drifting.step_times_ms(5, 5), held.step_times_ms(5, 5), rtol=1e-2)
    # Samples of a slow vibration are close to each other and stay single steps.
    slow = fp.sine(0.8, 0.02, 1.0, cycles=1)
    assert len(slow.step_times_ms(5, 5)) == 1 + 5 + 5 + 20


def test_a_way_aside_takes_more_steps_where_skin_sticks():
    slide = fp.Trajectory((0.0, 50.0, 150.0), (0.0, 1.0, 1.0), x_mm=(0.0, 0.0, 2.0))
    counts = [len(slide.step_times_ms(5, 5, sticks)) for sticks in (False, True)]
    assert counts == [1 + 5 + 10, 1 + 5 + 2 + 30]
    touches = [fp.touch_of(fp.Fingertip(), fp.Sphere(), slide, friction=friction) for friction in (0.0, 0.5)]
    assert [touch.steps_ms().size for touch in touches] == counts


def test_a_file_is_read_with_its_units_from_its_first_row(tmp_path):
    path = written(
        tmp_path, "# robot\nx_mm,time_s,depth_um,tilt_deg\n7,3.0,-100,1\n7,3.1,900,1\n9.5,3.6,900,6\n"
    )
    motion = fp.read_trajectory(path, phases=[Phase("all", 0.0, 600.0)])
    np.testing.assert_allclose(motion.times_ms, (0.0, 100.0, 600.0))
    np.testing.assert_allclose(motion.depth_mm, (-0.1, 0.9, 0.9))
    assert motion.x_mm == (0.0, 0.0, 2.5)
    assert motion.tilt_deg == (0.0, 0.0, 5.0)
    assert motion.z_mm is None
    assert [phase.name for phase in motion.phases] == ["all"]
    lower = fp.read_trajectory(path, first_touch_mm=0.4)
    np.testing.assert_allclose(lower.depth_mm, (-0.5, 0.5, 0.5))


def test_noise_of_a_force_before_contact_is_no_force(tmp_path):
    path = written(tmp_path, "time_ms,force_n\n0,0.0005\n1,-0.001\n2,0.1\n")
    assert fp.read_trajectory(path).force_mn == (0.0, 0.0, 100.0)
    below = written(tmp_path, "time_ms,force_mn\n0,0\n1,-10\n2,100\n")
    with pytest.raises(fp.InputError, match="force_mn must not be negative: got -10 mN at 1 ms, sample 2"):
        fp.read_trajectory(below)


@pytest.mark.parametrize(
    ("text", "said"),
    [
        ("time_ms,depth_inch\n0,0\n1,1\n", "line 1: column 'depth_inch' is unknown: did you mean depth_um"),
        ("depth_mm,x_mm\n0,0\n1,1\n", "must have the column time_ms or time_s: it has depth_mm, x_mm"),
        ("time_ms,x_mm\n0,0\n1,1\n", "motion.csv: A trajectory needs either depth_mm or force_mn"),
        ("time_ms,depth_mm,depth_um\n0,0,0\n1,1,1000\n", "one column for depth_mm: depth_um is another one"),
        ("# a\ntime_ms,depth_mm\n0,0\n2,\n", "line 4: depth_mm must be given, its entry is empty"),
        ("time_ms,depth_mm\n0,0\n1,nan\n", "line 3: depth_mm must be a finite number \\[mm\\]: got 'nan'"),
        ("time_ms,depth_mm\n0,0\n1,1\n\n1,1\n", "line 5: the time must increase: got 1 ms after 1 ms"),
        ("time_ms,depth_mm\n0,0\n2,1\n1,1\n", "line 4: the time must increase: got 1 ms after 2 ms"),
        ("time_ms,depth_mm\n0,0\n1,20\n2,1\n", "line 3: depth_mm must not change faster than 10 m/s"),

        ("time_ms,depth_mm\n0,0.5\n50,1\n", "motion.csv: depth_mm must begin with 0 or less"),
        ("time_ms,depth_mm\n0,0\n", "line 2: a motion must have at least two rows: got one"),
    ],
)  # fmt: skip
def test_files_that_cannot_be_are_refused_with_row_and_column(tmp_path, text, said):
    with pytest.raises(fp.InputError, match=said) as refusal:
        fp.read_trajectory(written(tmp_path, text))
    assert str(refusal.value)[-1] in ".?"
    assert "\n" not in str(refusal.value)
    assert "motion.csv" in str(refusal.value)


def test_a_gap_in_a_recording_is_refused_and_a_few_lost_samples_are_not(tmp_path):
    times = np.arange(200.0)
    rows = np.column_stack([times, np.clip(times / 50.0, 0.0, 1.0)])
    lost = written(tmp_path, table("time_ms,depth_mm", np.delete(rows, [90, 91, 120], axis=0)))
    assert len(fp.read_trajectory(lost).times_ms) == 197
    gap = written(tmp_path, table("time_ms,depth_mm", np.delete(rows, range(90, 102), axis=0)))
    with pytest.raises(
        fp.InputError, match="line 92: the recording must not have a gap, here of 13 ms with 1 ms"
    ):
        fp.read_trajectory(gap)
    by_hand = written(tmp_path, "time_ms,depth_mm\n0,0\n10,1\n20,1\n2000,1\n")
    assert fp.read_trajectory(by_hand).end_ms == 2000.0


def test_the_fastest_ramp_force_and_vibration_are_allowed():
    """The limit of instantaneous moduli needs the first two, a stimulator the third."""
    assert fp.RampAndHold(1.0, ramp_ms=0.001).ramp_ms == 0.001
    assert fp.Trajectory((0.0, 0.001, 1.0), force_mn=(0.0, 50.0, 50.0)).by_force
    assert fp.sine(1.5, 1.0, 400.0, cycles=1).largest == pytest.approx(2.5)


@pytest.mark.parametrize(
    ("motion", "said"),
    [
        (fp.Trajectory((0, 50, 500), (0, 0.5, 0.5), x_mm=(0, 0, 20)),
         r"must not leave the finger at \d+(\.\d+)? ms: position must lie on the finger"),
        (fp.Trajectory((0, 50, 500), force_mn=(0, 50, 50), z_mm=(0, 0, -12)),
         "The indenter must not leave the finger at .* ms: position"),
        (fp.Trajectory((0, 50, 100, 500), (0, 0.5, 4.6, 0.5)),
         r"below 4\.44 mm at x = 17\.37, z = 0 mm, because of the bone: got 4\.6 mm at 100 ms\."),
        (fp.RampAndHold(4.6), r"because of the bone: got 4\.6 mm at 50 ms\."),
    ],
    ids=["off the tip", "off the side", "bone", "ramp"],
)  # fmt: skip
def test_paths_that_leave_the_pad_or_reach_the_bone_are_refused_before_anything_is_pressed(motion, said):
    with pytest.raises(fp.InputError, match=said):
        check_path(fp.Fingertip(), motion, AT_MM)
    with pytest.raises(fp.InputError, match=said):
        fp.touch_of(fp.Fingertip(), fp.Sphere(), motion)


def test_the_skin_falls_away_along_a_path_and_rises_again():
    """Depth is counted at first touch: where the skin lies higher, the bone is nearer."""
    finger = fp.Fingertip()
    lies = finger.skin_point([12.0, 25.0], 0.0)[:, 1]
    proximal, distal = 12.0, 25.0
    # Towards the tip the volar skin is higher, so that the indenter reaches less deep.
    deep = 3.0 + float(lies[1] - lies[0])
    tip = fp.Trajectory((0, 50, 100, 900), (0, 3.0, 3.0, 9.0), x_mm=(0, 0, 0, distal - proximal))
    with pytest.raises(fp.InputError, match=r"because of the bone: got .* mm at .* ms"):
        check_path(finger, tip, (proximal, 0.0))
    check_path(finger, fp.Trajectory((0, 50, 900), (0, 3.0, deep), x_mm=(0, 0, 13.0)), (proximal, 0.0))
    # Between two samples that are both shallow enough, a bone can still be in the way.
    back = fp.Trajectory((0, 100, 500), (0, 1.0, 1.0), z_mm=(0, 0, 6.0))
    check_path(finger, back, (17.37, -3.0))


def test_wanted_times_are_solved_at_exactly_and_others_stay():
    motion, plain = fp.RampAndHold(0.3), fp.PressSettings(5, 5)
    wanted = (12.5, 30.0, 333.3, 950.0)
    times = replace(plain, times_ms=wanted).steps_ms(motion)
    assert set(times) == {*motion.step_times_ms(5, 5), *wanted}
    assert np.array_equal(plain.steps_ms(motion), motion.step_times_ms(5, 5))
    nearly = replace(plain, times_ms=(30.0 + 1e-12,))
    assert np.array_equal(nearly.steps_ms(motion), motion.step_times_ms(5, 5))
    ends_ms = replace(plain, times_ms=wanted).smooth_ends_ms(motion).tolist()
    assert ends_ms == [12.5, 30.0, 50.0, 333.3, 950.0, 1000.0]
