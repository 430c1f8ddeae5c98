"""Curvature thresholds under other noise, places and forces: closed forms of rates that are powers."""

from dataclasses import replace
from types import SimpleNamespace

import numpy as np
import pytest
from scipy.special import ndtri

from fingerpad.core.random_streams import Purpose, normals
from fingerpad.experiments.conditions import RECEPTOR_X_MM, Conditions
from fingerpad.experiments.gerling2014.curvature_thresholds import (
    Observer,
    interpolated,
    just_noticeable_difference,
)
from fingerpad.geometry.motion import ForceRampAndHold, RampAndHold
from fingerpad.neuron.population import Population
from fingerpad.psychophysics.encoding import gradient_sum, neighbour_pairs
from sections import SENSITIVE, SphereSkin
from studies import sphere_thresholds as study
from studies.sphere_thresholds import (
    NOISES,
    PRESSED_PER_M,
    STANDARDS_PER_M,
    NoisyObserver,
    SphereThresholds,
    Variant,
    constant,
    proportional,
    shared,
    static_rates,
    threshold_row,
    touches,
    variants,
)

POPULATION = Population.grid(centre_mm=(RECEPTOR_X_MM, 0.0), afferent=SENSITIVE)
PAIRS = neighbour_pairs(POPULATION.positions_mm, POPULATION.pitch_mm)
DRAWS = normals(0, 1, len(POPULATION), Purpose.RESPONSE, 4000)[0].T
POWER = 0.7
SIGMA = 0.03


def observer(noise, sigma=SIGMA):
    """Receptors whose rates grow with the same power of the curvature."""
    at = np.geomspace(100.0, 700.0, 200)
    rates = np.outer((at / 287.0) ** POWER, POPULATION.positions_mm[:, 1] ** 2 + 20.0)
    return NoisyObserver(interpolated(at, rates), PAIRS, sigma, DRAWS, noise)


def weber(judge, standard):
    return just_noticeable_difference(judge, standard) / standard


def test_noise_proportional_to_the_rate_is_that_of_the_library():
    ours = observer(proportional)
    theirs = Observer(ours.rates, PAIRS, SIGMA, DRAWS)
    for comparison in (296.0, 365.0):
        assert ours.hit_rate(287.0, comparison) == pytest.approx(theirs.hit_rate(287.0, comparison), rel=1e-9)


def test_noise_proportional_to_the_rate_gives_one_fraction_at_all_standards():
    small, large = (weber(observer(proportional), standard) for standard in (144.0, 287.0))
    assert small == pytest.approx(large, rel=1e-3)


def test_noise_independent_of_the_rate_makes_small_curvatures_harder():
    """The spread is the same, and the slope of the sum is that of a power."""
    judge = observer(constant, 0.003)
    small, large = (weber(judge, standard) for standard in (144.0, 287.0))
    assert small / large == pytest.approx((287.0 / 144.0) ** POWER, rel=0.03)


def test_silent_receptors_stay_silent_under_noise_independent_of_the_rate():
    noisy = constant(np.array([[0.0, 10.0]]), 0.1, np.ones((3, 2)))
    np.testing.assert_allclose(noisy, [[0.0, 20.0]] * 3)


def test_one_factor_for_all_gives_the_threshold_in_closed_form():
    """The comparison is (1 + W)^power of the standard and its spread is sigma times its sum."""
    judge = observer(shared)
    spread = SIGMA * DRAWS[:, 0].std(ddof=1)
    mean = 1.0 + SIGMA * DRAWS[:, 0].mean()
    expected = (1.0 - 2.0 * ndtri(0.75) * spread / mean) ** (-1.0 / POWER) - 1.0
    assert weber(judge, 144.0) == pytest.approx(expected, rel=1e-3)


def test_elasticity_of_a_power_is_its_exponent():
    skins = {curvature: SimpleNamespace(depth_mm=[1.0], force_mn=[50.0]) for curvature in PRESSED_PER_M}
    found = study._threshold(observer(proportional), 200.0, skins)
    assert found.elasticity == pytest.approx(POWER, rel=1e-3)


def test_a_row_has_the_noise_that_fits_people_and_says_what_it_depends_on():
    skins = {curvature: SphereSkin.wide(curvature) for curvature in PRESSED_PER_M}
    for skin in skins.values():
        skin.depth_mm, skin.force_mn = np.array([0.0, 1.0]), np.array([0.0, 50.0])
    row = threshold_row(Variant(), skins, SENSITIVE, seed=0)
    assert [threshold.standard_per_m for threshold in row.thresholds] == list(STANDARDS_PER_M)
    rates = [POPULATION.respond(skins[at]).static_rate_hz for at in sorted(skins)]
    judge = NoisyObserver(
        interpolated(np.array(sorted(skins)), np.array(rates)), PAIRS, row.noise_sigma, DRAWS
    )
    assert abs(judge.hit_rate(287.0, 296.0) - 0.58) < 0.06
    assert abs(judge.hit_rate(287.0, 365.0) - 0.95) < 0.06
    last = row.thresholds[-1]
    assert last.gradient_sum == pytest.approx(float(gradient_sum(rates[PRESSED_PER_M.index(287.0)], PAIRS)))
    assert last.weber_fraction == pytest.approx(
        2.0 * ndtri(0.75) * last.relative_spread / last.elasticity, rel=0.15
    )
    assert (last.depth_mm, last.force_n) == (1.0, 0.05)
    found = SphereThresholds(rows=(row,), people=np.array([0.0, round(last.weber_fraction, 2)]))
    assert found.within(row, 287.0)
    assert not SphereThresholds(rows=(row,), people=np.array([0.9, 1.0])).within(row, 287.0)


def test_a_row_that_no_noise_fits_has_no_thresholds():
    """Equal spheres cannot be discriminated at any noise."""
    skins = {curvature: SphereSkin.wide(287.0) for curvature in PRESSED_PER_M}
    row = threshold_row(Variant(), skins, SENSITIVE, seed=0)
    assert np.isnan(row.noise_sigma)
    assert row.thresholds == ()
    assert np.isnan(row.weber(144.0))
    assert not SphereThresholds(rows=(row,), people=np.array([0.1, 0.14])).within(row, 144.0)


def test_a_varying_place_moves_all_receptors_together():
    skins = [SphereSkin.wide(287.0)]
    still = static_rates(POPULATION, skins)
    moved = static_rates(POPULATION, skins, place_sd_mm=0.3, seed=1)
    assert moved.shape == (1, len(DRAWS), len(POPULATION))
    assert np.ptp(moved[0], axis=0).max() > 5.0
    np.testing.assert_array_equal(moved[0, 0], moved[0, study.PLACES])
    # Small places hardly differ from none.
    np.testing.assert_allclose(
        static_rates(POPULATION, skins, 1e-6)[0, :5], np.tile(still, (5, 1)), rtol=1e-3
    )


def test_rows_change_one_cause_each_before_causes_are_combined():
    rows = variants(0.05)
    assert rows[0] == Variant()
    assert [row.changed for row in rows[:8]] == [0] + 7 * [1]
    assert len(set(rows)) == len(rows)
    by_force = [row for row in rows if isinstance(row.stimulus, ForceRampAndHold)]
    assert {row.stimulus.force_mn for row in by_force} == {50.0, 100.0, 200.0}
    assert by_force[0].changed == 1
    assert {row.noise for row in by_force} < set(NOISES)
    assert [row.pressed for row in (rows[0], by_force[0])] == ["1 mm", "0.05 N"]
    assert rows[3].pressed == "1 mm, place varies by 0.3 mm"


def test_all_spheres_of_a_row_move_alike_on_one_mesh():
    conditions = Conditions(resolution="quick", tissues="human")
    pressed = touches(replace(Variant(), stimulus=RampAndHold(depth_mm=2.3)), conditions)
    assert tuple(pressed) == PRESSED_PER_M
    assert {touch.stimulus.depth_mm for touch in pressed.values()} == {2.3}
    assert len({touch.grading for touch in pressed.values()}) == 1
    assert [touch.indenter.curvature_per_m for touch in pressed.values()] == list(PRESSED_PER_M)
