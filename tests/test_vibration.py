"""Vibration: cycles that are interpolated against all of them solved, and where inertia matters."""

import warnings
from dataclasses import replace
from itertools import pairwise

import numpy as np
import pytest

import fingerpad as fp
from fingerpad.data.tissues import DENSITY
from fingerpad.geometry.mesh import block_mesh
from fingerpad.geometry.motion import Cycles
from fingerpad.geometry.motions import SAMPLES_PER_CYCLE
from fingerpad.mechanics import cycles
from fingerpad.mechanics.contact import PlacedIndenter, place
from fingerpad.mechanics.cycles import PronyCycle
from fingerpad.mechanics.inertia import fastest_hz, resonance_hz
from fingerpad.mechanics.materials import MaterialTable
from fingerpad.mechanics.press import Specimen, press
from fingerpad.mechanics.viscoelastic import StepCoefficients, StressHistory

PRONY = fp.Prony(shares=(0.2, 0.3), times_ms=(30.0, 400.0))
LAYERS = tuple(fp.Material.neo_hooke(shear, 0.45, PRONY) for shear in (40.0, 40.0, 20.0, 8.0))
BALL = fp.Sphere(curvature_per_m=500.0)


def block():
    lines = np.array([0.0, 0.5, 1.0, 1.7, 3.0])
    both, depth = np.concatenate([-lines[:0:-1], lines]), np.array([0.0, 0.4, 1.0, 3.0])
    return block_mesh(both, depth, lines, layers=[0, 1, 3], symmetric=True)


def vibrated(motion, cycle_tolerance=0.01, friction=0.0):
    mesh = block()
    placement = place(BALL, mesh.nodes_mm[mesh.skin_nodes], np.zeros(3), np.eye(3))
    settings = fp.PressSettings(3, 3, cycle_tolerance=cycle_tolerance)
    return press(Specimen(mesh, LAYERS), PlacedIndenter(BALL, placement, friction=friction), motion, settings)


@pytest.fixture
def solved(monkeypatch):
    """Numbers of the cycles that are solved."""
    numbers, solve = [], cycles.CycleJumps.solved

    def counted(jumps, number, *rest):
        numbers.append(number)
        return solve(jumps, number, *rest)

    monkeypatch.setattr(cycles.CycleJumps, "solved", counted)
    return numbers


@pytest.mark.parametrize("amplitude_mm", [0.02, 0.45])
def test_few_solved_cycles_give_what_all_of_them_give(amplitude_mm, solved):
    """Also when contact is lost in every cycle, and while the slow branch still relaxes."""
    motion = fp.sine(0.4, amplitude_mm, 50.0, cycles=24, hold_ms=50.0)
    some, all_of_them = vibrated(motion), vibrated(motion, cycle_tolerance=None)
    assert len(solved) <= 10
    assert solved[-1] == 23
    np.testing.assert_array_equal(some.times_ms, all_of_them.times_ms)
    for name in ("sed_kpa", "force_mn", "displacement_mm", "depth_mm", "reaction_mn"):
        got, expected = getattr(some, name), getattr(all_of_them, name)
        assert np.abs(got - expected).max() <= 0.01 * np.abs(expected).max(), name
    for name in ("external_uj", "stored_uj", "dissipated_uj"):
        got, expected = getattr(some.energy, name), getattr(all_of_them.energy, name)
        assert np.abs(got - expected).max() <= 0.01 * expected.max(), name
    work = all_of_them.fields.work_kpa
    assert np.abs(some.fields.work_kpa - work).max() <= 0.01 * work.max()
    area = all_of_them.contact.area_mm2
    assert np.abs(some.contact.area_mm2 - area).max() <= 0.02 * area.max()
    # The next touch starts from the state that all cycles lead to.
    np.testing.assert_allclose(some.stress_kpa, all_of_them.stress_kpa, atol=0.01 * all_of_them.sed_kpa.max())


def test_a_tighter_tolerance_solves_more_cycles_and_errs_less(solved):
    motion = fp.sine(0.4, 0.1, 20.0, cycles=24, hold_ms=50.0)
    truth, errors, counts = vibrated(motion, cycle_tolerance=None), [], []
    for tolerance in (0.03, 0.001):
        solved.clear()
        errors.append(np.abs(vibrated(motion, tolerance).sed_kpa - truth.sed_kpa).max() / truth.sed_kpa.max())
        counts.append(len(solved))
        assert errors[-1] <= tolerance
    assert errors[1] < errors[0]
    assert counts[1] > counts[0]


def test_motion_goes_on_after_the_cycles():
    wave = fp.sine(0.4, 0.1, 50.0, cycles=20, hold_ms=50.0)
    times_ms = (*wave.times_ms, wave.end_ms + 50.0, wave.end_ms + 200.0)
    motion = fp.Trajectory(times_ms, (*wave.prescribed, 0.0, 0.0), cycles=wave.cycles)
    some, all_of_them = vibrated(motion), vibrated(motion, cycle_tolerance=None)
    np.testing.assert_array_equal(some.times_ms, all_of_them.times_ms)
    np.testing.assert_allclose(some.force_mn, all_of_them.force_mn, atol=0.01 * some.force_mn.max())
    assert some.force_mn[-1] == 0.0


@pytest.mark.parametrize(
    ("motion", "friction"),
    [
        (fp.sine(0.4, 0.1, 50.0, cycles=10, hold_ms=50.0), 0.0),
        (fp.sine(0.4, 0.02, 50.0, cycles=11, hold_ms=50.0), 0.3),
    ],
    ids=["ten cycles", "friction"],
)
def test_all_cycles_are_solved_when_they_are_few_or_the_skin_may_creep(motion, friction, solved):
    vibrated(motion, friction=friction)
    assert solved == []


def test_closed_form_of_relaxation_over_cycles_is_that_of_the_steps():
    """Cycles whose stress drifts evenly: the sum over them against the Prony update, step by step."""
    table, layer = MaterialTable.of(LAYERS), np.array([0, 3])
    generator, phases, period = np.random.default_rng(3), 5, 20.0
    cycle, drift = generator.normal(size=(2, phases, 2, 8, 6))
    # The stress of a cycle begins where that of the one before ends, so no drift may be at the border.
    drift[-1] = 0.0
    step, history, ends = StepCoefficients.of(table, period / phases), StressHistory.unloaded(2, 2), []
    for number in range(9):
        for phase in range(phases):
            history = history.advanced(step, layer, cycle[phase] + number * drift[phase])
        ends.append(history.relaxed)
    prony = PronyCycle.of(table, layer, period)
    added = [prony.added(before, after) for before, after in pairwise(ends)]
    got = prony.after(ends[3], 5, added[2], added[2] - added[1])
    np.testing.assert_allclose(got, ends[8], rtol=1e-10, atol=1e-12)


def test_sine_knows_its_cycles_and_false_ones_are_refused():
    motion = fp.sine(0.8, 0.1, 20.0, cycles=4, hold_ms=100.0)
    assert motion.cycles == Cycles(start_ms=150.0, period_ms=50.0, count=4)
    assert motion.cycles.end_ms == motion.end_ms
    assert sum(motion.cycles.start_ms < time for time in motion.times_ms) == 4 * SAMPLES_PER_CYCLE
    for wrong in (Cycles(150.0, 50.0, 5), Cycles(151.0, 50.0, 3), Cycles(100.0, 50.0, 5)):
        with pytest.raises(fp.InputError, match="cycles must repeat the samples of the first"):
            replace(motion, cycles=wrong)
    grown = np.array(motion.depth_mm)
    grown[-5] += 0.01
    with pytest.raises(fp.InputError, match="cycles must repeat the samples of the first"):
        replace(motion, depth_mm=grown)
    with pytest.raises(fp.InputError, match="cycle_tolerance must be below 1"):
        fp.PressSettings(cycle_tolerance=2.0)


def test_column_of_one_layer_has_its_quarter_wave_resonance():
    """f = c / (4 h) with c = sqrt(E / rho), and E at once whichever moduli are given."""
    layer = fp.Material.neo_hooke(10.0, 0.45, fp.Prony((0.5,), (100.0,)))
    shear, bulk = 2 * 10.0, layer.bulk_modulus_kpa
    young = 9 * bulk * shear / (3 * bulk + shear)
    expected = np.sqrt(1e3 * young / DENSITY.value) / (4 * 5e-3)
    assert resonance_hz([layer], [5.0]) == pytest.approx(expected)
    # Two halves are as one.
    assert resonance_hz([layer, layer], [2.0, 3.0]) == pytest.approx(expected)
    assert resonance_hz([replace(layer, moduli="instantaneous")], [5.0]) < 0.8 * expected


def test_a_motion_is_as_fast_as_its_fastest_part():
    assert fastest_hz(fp.sine(0.8, 0.1, 30.0, cycles=3)) == pytest.approx(30.0, rel=0.02)
    assert fastest_hz(fp.sine(0.8, 0.001, 300.0, cycles=3)) == pytest.approx(300.0, rel=0.02)
    assert fastest_hz(fp.RampAndHold(1.0, 10.0, 100.0)) == pytest.approx(1e3 / (np.pi * 10.0))
    # The slow beginning of a ramp does not hide its fast end, and noise on a hold does not count.
    late = fp.Trajectory((0.0, 1000.0, 1001.0), (0.0, 0.1, 1.0))
    assert fastest_hz(late) == pytest.approx(1e3 * 0.9 / np.pi)
    noisy = fp.Trajectory((0.0, 50.0, 51.0, 52.0, 53.0), (0.0, 1.0, 1.0005, 1.0, 1.0005))
    assert fastest_hz(noisy) < 10.0


def test_a_vibration_by_force_has_its_forces_and_its_skipped_cycles_those_of_all():
    motion = fp.sine(
        force_mn=20.0, amplitude_mn=5.0, frequency_hz=20.0, cycles=14, ramp_ms=50.0, hold_ms=100.0
    )
    assert motion.by_force
    assert [phase.name for phase in motion.phases] == ["ramp", "hold", "vibration"]
    assert motion.prescribed_at([25.0, 150.0, 162.5, 187.5]) == pytest.approx([10.0, 20.0, 25.0, 15.0])
    swept = fp.chirp(force_mn=20.0, amplitude_mn=5.0, frequencies_hz=(5.0, 50.0), sweep_ms=400.0)
    assert swept.by_force
    assert swept.largest == pytest.approx(25.0, rel=1e-3)
    for wrong in ({"depth_mm": 1.0}, {"amplitude_mn": 5.0}, {"amplitude_mm": 0.1, "force_mn": 20.0}):
        with pytest.raises(
            fp.InputError, match="either depth_mm and amplitude_mm or force_mn and amplitude_mn"
        ):
            fp.sine(**wrong, frequency_hz=20.0, cycles=2)
    with pytest.raises(fp.InputError, match="amplitude_mn must be at most force_mn"):
        fp.sine(force_mn=5.0, amplitude_mn=6.0, frequency_hz=20.0, cycles=2)
    some, every = vibrated(motion), vibrated(motion, cycle_tolerance=None)
    np.testing.assert_allclose(some.force_mn[1:], motion.prescribed_at(some.times_ms[1:]), rtol=1e-3)
    np.testing.assert_allclose(some.depth_mm, every.depth_mm, atol=0.01 * every.depth_mm.max())


def test_touch_warns_of_inertia_before_anything_is_pressed():
    finger = fp.Fingertip()
    with warnings.catch_warnings():
        warnings.simplefilter("error")
        fp.touch_of(finger, fp.Plate(), fp.RampAndHold())
        fp.touch_of(finger, fp.Plate(), fp.sine(0.8, 0.1, 30.0, cycles=2))
        # Little is accelerated beside what the hold compresses, and air has no mass.
        fp.touch_of(finger, fp.Plate(), fp.sine(0.8, 0.01, 200.0, cycles=2))
        fp.touch_of(finger, fp.Plate(), fp.Trajectory((0.0, 2.0, 52.0, 100.0), (-9.0, 0.0, 0.8, 0.8)))
    for motion in (fp.sine(0.8, 0.1, 200.0, cycles=2), fp.RampAndHold(ramp_ms=2.0)):
        with pytest.warns(fp.InertiaWarning, match=r"as a vibration of .* Hz, at which the inertia") as said:
            fp.touch_of(finger, fp.Plate(), motion)
        assert said[0].filename == __file__
