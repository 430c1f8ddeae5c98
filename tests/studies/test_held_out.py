"""Held-out predictions: checks in closed form, skins given by a formula, and one tiny press."""

from dataclasses import replace
from types import SimpleNamespace

import numpy as np
import pytest

from fingerpad.core.results import from_json, to_json
from fingerpad.core.signals import SedTraces
from fingerpad.data import STATUSES
from fingerpad.data.published import Published
from fingerpad.experiments.conditions import RECEPTOR_X_MM, Conditions
from fingerpad.experiments.runner import Runner
from fingerpad.experiments.validation.predictions import FingertipModel
from fingerpad.geometry.edged_indenters import Grating
from fingerpad.geometry.fingertip import Fingertip
from fingerpad.geometry.grading import Grading
from fingerpad.geometry.indenters import Plate
from fingerpad.geometry.mesh import block_mesh
from fingerpad.geometry.motion import RampAndHold
from fingerpad.mechanics.materials import Material
from fingerpad.mechanics.press_settings import PressSettings
from fingerpad.mechanics.tissues import named_tissues
from fingerpad.neuron.afferent import Afferent
from fingerpad.neuron.population import Population
from fingerpad.skin.indentation import Touch
from sections import SENSITIVE
from studies import held_out, held_out_facts
from studies.held_out import (
    CHOSEN,
    PREDICTED,
    Adaptation,
    Check,
    Deflections,
    Forces,
    GratingRates,
    HeldOut,
    Score,
    SphereRates,
    Volumes,
    adaptation_checks,
    force_checks,
    grating_checks,
    grating_touch,
    period_rates_hz,
    predicted,
    sphere_checks,
    threshold_checks,
    volume_checks,
    volume_decrease,
    windowed_rates_hz,
)
from studies.pages.held_out import held_out_page
from studies.pages.markdown import write_markdown
from studies.sphere_thresholds import Threshold, ThresholdRow

QUICK = Conditions(resolution="quick", tissues="human")
PEOPLE_N = np.array([0.04, 0.16, 0.40, 0.77])
RANGES_N = np.array([[np.nan, np.nan], [0.11, 0.23], [np.nan, np.nan], [0.50, 1.04]])


def check(value, low=np.nan, high=np.nan, role=PREDICTED):
    return Check(
        subject="force", statement="a plate", source="nobody", status="assumed", role=role,
        predicted=value, unit="N", low=low, high=high,
    )  # fmt: skip


def forces(factor=1.0):
    plate = factor * PEOPLE_N
    return Forces(
        indenter=("plate", "punch:6.35"), depth_mm=np.array([0.5, 1.0, 1.5, 2.0]),
        force_n=np.array([plate, 0.5 * plate]), slow_plate_n=plate, people_n=PEOPLE_N,
        people_range_n=RANGES_N,
    )  # fmt: skip


def spheres(rate_hz, profile_hz):
    return SphereRates(
        force_n=np.array([0.392, 0.785]), curvature_per_m=np.array([0.0, 172.0, 694.0]),
        rate_hz=np.array(rate_hz), profile_force_n=0.2, profile_per_m=np.array([172.0, 694.0]),
        position_mm=np.array([0.0, 1.0, 2.0]),
        profile_hz=np.array(profile_hz),
    )  # fmt: skip


RISING = spheres([[10.0, 20.0, 30.0], [15.0, 40.0, 60.0]], [[20.0, 15.0, 5.0], [30.0, 10.0, 0.0]])


def gratings(static_hz, index, forced):
    return GratingRates(
        ridge_mm=np.array([0.5, 1.0, 1.5, 2.5, 3.0, 5.0, 1.0, 3.0]),
        spin_deg=np.array(6 * [0.0] + 2 * [90.0]),
        static_hz=np.array(static_hz), static_index=np.array(index), dynamic_index=np.array(index),
        force_n=np.array([0.1, 0.2]), forced_ridge_mm=np.array([1.0, 3.0]), forced_index=np.array(forced),
    )  # fmt: skip


def verdicts(checks):
    return [each.inside for each in checks]


# Checks


@pytest.mark.parametrize(
    ("value", "low", "high", "inside"),
    [
        (0.2, 0.1, 0.3, True),
        (0.1, 0.1, 0.3, True),
        (0.05, 0.1, 0.3, False),
        (0.4, 0.1, 0.3, False),
        (9.0, 0.1, np.nan, True),
        (-9.0, np.nan, 0.3, True),
        (0.4, np.nan, 0.3, False),
        (0.4, np.nan, np.nan, None),
        (np.nan, 0.1, 0.3, None),
    ],
)
def test_a_check_is_inside_its_bounds_and_undecided_without_bounds_or_prediction(value, low, high, inside):
    assert check(value, low, high).inside is inside


def test_forces_of_people_themselves_are_inside_and_only_the_depths_of_the_choice_are_chosen():
    found = list(force_checks(forces()))
    assert verdicts(found) == [True] * 8
    assert [each.role for each in found] == [PREDICTED, CHOSEN, PREDICTED, CHOSEN] * 2
    assert verdicts(force_checks(forces(1.5))) == [False, False, False, False] * 2
    # 0.5 mm is judged by the range relative to the mean.
    assert found[0].low == pytest.approx(0.65 * 0.04)
    assert (found[1].low, found[1].high) == (0.11, 0.23)


def test_directions_of_spheres_are_the_smallest_of_all_steps():
    found = list(sphere_checks(RISING))
    assert [each.predicted for each in found] == pytest.approx([1.0, 10.0, 5.0, 10.0, 1.5 - 0.75])
    assert verdicts(found) == [True] * 5
    falling = spheres([[10.0, 9.0, 30.0], [10.0, 40.0, 60.0]], RISING.profile_hz[::-1])
    assert verdicts(sphere_checks(falling)) == [True] + [False] * 4
    missing = spheres([[10.0, 20.0, np.nan], [15.0, 40.0, np.nan]], RISING.profile_hz)
    share, *others = sphere_checks(missing)
    assert (share.predicted, share.inside) == (pytest.approx(2 / 3), False)
    assert verdicts(others) == [True] * 4
    nowhere = spheres(np.full((2, 3), np.nan), RISING.profile_hz)
    assert verdicts(sphere_checks(nowhere))[:3] == [False, None, None]


def test_half_width_is_linear_between_positions_and_none_if_a_profile_stays_above():
    np.testing.assert_allclose(RISING.half_widths_mm(), [1.5, 0.75])
    broad = spheres(RISING.rate_hz, [[20.0, 15.0, 11.0], [30.0, 15.0, 14.0]])
    np.testing.assert_allclose(broad.half_widths_mm(), [np.nan, 1.0])


def test_gratings_are_compared_with_modulation_in_vivo_and_its_directions():
    rates = [[10.0, 20.0]] * 6 + [[20.0, 30.0]] * 2
    index = [0.1, 0.2, 0.65, 0.68, 0.70, 0.75, 0.4, 0.8]
    found = list(grating_checks(gratings(rates, index, [[0.2, 0.7], [0.22, 0.66]])))
    assert verdicts(found) == [True] * 9
    assert [each.predicted for each in found[:4]] == [0.70, 0.65, 0.75, 0.68]  # as ridge, as period
    assert [each.predicted for each in found[4:]] == pytest.approx([10.0, 0.02, 0.04, 0.1, 10.0])
    flat = [[20.0, 20.0], *rates[:0:-1]]
    other = [0.9, 0.9, 0.5, 0.4, 0.5, 0.4, 0.4, 0.4]
    assert verdicts(grating_checks(gratings(flat, other, [[0.2, 0.7], [0.3, 0.7]]))) == [False] * 9


def adapting(name, *rates):
    edges = np.arange(len(rates) + 1.0)
    return Adaptation(name=name, window_s=np.stack([edges[:-1], edges[1:]], axis=1), rate_hz=np.array(rates))


def test_decline_is_from_the_first_to_the_last_window_and_judged_for_the_long_holds():
    assert adapting("short", 50.0, 40.0, 45.0).decline == pytest.approx(0.1)
    assert np.isnan(adapting("silent", 0.0, 0.0).decline)
    found = list(
        adaptation_checks([adapting("short", 9.0, 1.0), adapting("a", 50.0, 31.0), adapting("b", 50.0, 44.0)])
    )
    assert [each.predicted for each in found] == pytest.approx([0.38, 0.12])
    assert verdicts(found) == [True, False]


def test_volume_is_at_most_the_observed_and_larger_for_deeper_and_larger_indenters():
    def volumes(decrease):
        return Volumes(indenter=("plate", "disc"), depth_mm=np.array([1.0, 2.0]), decrease=np.array(decrease))

    assert verdicts(volume_checks(volumes([[0.01, 0.03], [0.005, 0.02]]))) == [True] * 4
    assert verdicts(volume_checks(volumes([[0.01, 0.06], [0.02, 0.05]]))) == [True, False, True, False]


def test_weber_fractions_are_judged_in_whole_per_cent():
    row = ThresholdRow(
        pressed="1 mm", noise="n", receptors="r", changed=0, noise_sigma=0.05,
        thresholds=tuple(
            Threshold(
                standard_per_m=standard, weber_fraction=fraction, gradient_sum=1.0, elasticity=1.0,
                relative_spread=0.1, depth_mm=1.0, force_n=0.1,
            )
            for standard, fraction in ((144.0, 0.054), (200.0, 0.096), (287.0, 0.144))
        ),
    )  # fmt: skip
    assert verdicts(threshold_checks([row])) == [False, True, True]


def test_every_fact_has_a_source_and_a_status():
    found = [fact for fact in vars(held_out_facts).values() if isinstance(fact, Published)]
    assert len(found) == 11
    assert {fact.status for fact in found} <= set(STATUSES)
    assert "abstract" in held_out_facts.DECLINES.source


# Skins


def test_volume_of_a_body_that_shears_stays_and_that_of_a_stretched_one_follows_the_stretches():
    mesh = block_mesh([0.0, 1.0, 3.0], [0.0, 1.0, 2.0], [0.0, 2.0], layers=[2, 3])
    sheared = SimpleNamespace(mesh=mesh, displacement_mm=0.4 * mesh.nodes_mm[:, [1]] * [1.0, 0.0, 0.0])
    assert volume_decrease(sheared) == pytest.approx(0.0, abs=1e-12)
    stretched = SimpleNamespace(mesh=mesh, displacement_mm=mesh.nodes_mm * [0.1, -0.2, 0.05])
    assert volume_decrease(stretched) == pytest.approx(1.0 - 1.1 * 0.8 * 1.05)


def test_a_pressed_finger_loses_more_volume_if_it_is_more_compressible():
    grading = Grading(
        RECEPTOR_X_MM, 1.2, 1.2, 0.8, 0.8, largest_mm=6.0, stratum_corneum=1, living_epidermis=1, dermis=1,
        subcutis=1,
    )  # fmt: skip

    def decrease(poisson):
        tissues = replace(
            named_tissues("human"),
            **{
                layer: Material.neo_hooke(shear, poisson)
                for layer, shear in (
                    ("stratum_corneum", 50.0), ("living_epidermis", 12.0), ("dermis", 7.0), ("subcutis", 2.0)
                )
            },
        )  # fmt: skip
        return volume_decrease(
            Touch(Fingertip(), Plate(), RampAndHold(0.5), tissues, grading, PressSettings(1, 1)).solve()
        )

    soft, firm = decrease(0.3), decrease(0.495)
    assert 0.0 <= firm < 0.2 * soft
    assert soft < 0.05


class WavySkin:
    """Energy that varies as a cosine along one axis, constant after the ramp."""

    def __init__(self, axis, period_mm, depth=0.5):
        self.axis, self.period_mm, self.depth = axis, period_mm, depth

    def sed(self, sites):
        along = np.asarray(sites)[:, self.axis] - (RECEPTOR_X_MM if self.axis == 0 else 0.0)
        peaks = 2.0 + self.depth * np.cos(2.0 * np.pi * along / self.period_mm)
        return SedTraces([0.0, 50.0, 1000.0], np.outer([0.0, 1.0, 1.0], peaks), kinks_ms=[50.0])


@pytest.mark.parametrize(("axis", "spin"), [(0, 0.0), (1, 90.0)])
def test_receptors_lie_over_one_period_of_a_grating_in_the_direction_of_its_ridges(axis, spin):
    _, static = period_rates_hz(WavySkin(axis, 2.0), SENSITIVE, 1.0, spin, 0.0)
    assert static.argmax() == held_out.PLACES_PER_PERIOD // 2  # the middle of a ridge
    assert static.argmin() == 0  # the middle of a groove
    np.testing.assert_allclose(static[1:], static[:0:-1], rtol=1e-6)
    _, other = period_rates_hz(WavySkin(1 - axis, 2.0), SENSITIVE, 1.0, spin, 0.0)
    assert np.ptp(other) == 0.0


def test_rates_of_windows_are_those_of_the_spikes_in_them():
    population = Population(np.array([(RECEPTOR_X_MM, 0.0)]), 1.0, SENSITIVE)
    skin = WavySkin(0, 2.0)
    late, later = windowed_rates_hz(population, skin, [(400.0, 600.0), (600.0, 950.0)])
    assert late == pytest.approx(later, rel=1e-3)
    assert later == pytest.approx(population.respond(skin).static_rate_hz[0], rel=1e-9)


def test_a_steady_indentation_is_slow_and_its_windows_are_the_first_and_last_second():
    touch, (first, last) = held_out._steady(QUICK, 0.65)
    assert (touch.stimulus.ramp_ms, touch.stimulus.hold_ms) == (1625.0, 12_000.0)
    assert first == (1625.0, 2625.0)
    assert last == (12_625.0, 13_625.0)


def test_gratings_press_one_millimetre_deep_along_the_normal_with_lips_that_fit():
    touch = grating_touch(QUICK, 0.3, 90.0)
    assert touch.indenter == Grating(0.3, 0.3, 0.15)
    assert (touch.stimulus.depth_mm, touch.spin_deg, touch.tilt_deg) == (1.0, 90.0, QUICK.skin_tilt_deg)


def test_predictions_without_observations_are_those_of_validate(tmp_path, monkeypatch):
    """At depth and force 0 nothing is pressed."""
    monkeypatch.setattr("fingerpad.experiments.runner.solve_missing", lambda missing, *_: None)
    model = FingertipModel(QUICK, Afferent.for_tissues("human"))
    runner = Runner(tmp_path)
    assert predicted("force", [("plate", 0.0), ("sphere:287", 0.0)], model, runner).tolist() == [0.0, 0.0]
    resting = predicted("rate_position", [(0.0, 287.0, 1.0)], model, runner)
    assert resting.tolist() == [0.0]


# The page


GRATED = gratings([[1.0, 2.0]] * 8, [0.1, 0.2, 0.65, 0.68, 0.70, 0.72, 0.3, 0.8], [[0.2, 0.7]] * 2)


@pytest.fixture
def results(tmp_path):
    row = ThresholdRow(
        pressed="0.1 N", noise="proportional to the rate", receptors="3 by 6, 100 per cm²", changed=1,
        noise_sigma=0.08,
        thresholds=tuple(
            Threshold(
                standard_per_m=standard, weber_fraction=0.11, gradient_sum=100.0, elasticity=0.8,
                relative_spread=0.04, depth_mm=1.5, force_n=0.1,
            )
            for standard in (144.0, 200.0, 287.0)
        ),
    )  # fmt: skip
    unfitted = replace(row, pressed="1 mm", changed=0, noise_sigma=np.nan, thresholds=())
    return HeldOut(
        checks=(
            check(0.2, 0.1, 0.3),
            check(0.4, 0.1, 0.3),
            check(0.1, 0.2, 0.3, CHOSEN),
            check(np.nan, 0.0, 1.0),
            *grating_checks(GRATED),
        ),
        scores=(
            Score(
                file="plate_force", role=CHOSEN, loading="quasi_static", n_rows=4, n_judged=2, r2=0.9,
                correlation=0.95, gain=1.1, share_inside=0.5, inside_range=False,
            ),
            Score(
                file="cylinder_deflection", role=CHOSEN, loading="ramp_and_hold", n_rows=44, n_judged=0,
                r2=0.97, correlation=0.98, gain=1.0, share_inside=np.nan, inside_range=None,
            ),
        ),
        forces=forces(),
        deflections=Deflections(
            indenter=("line",), depth_mm=np.array([1.0]), distance_mm=np.array([0.0, 1.0]),
            share=np.array([[1.0, 0.5]]),
        ),
        spheres=RISING,
        gratings=GRATED,
        adaptation=(adapting("short", 9.0, 8.0), adapting("a", 50.0, 31.0), adapting("b", 50.0, 44.0)),
        volumes=Volumes(
            indenter=("plate", "disc"), depth_mm=np.array([1.0, 2.0]),
            decrease=np.array([[0.01, 0.03], [0.0, 0.02]]),
        ),
        thresholds=held_out.SphereThresholds(rows=(unfitted, row), people=np.array([0.10, 0.14])),
        manifest=Runner(tmp_path).manifest(QUICK),
    )  # fmt: skip


def test_page_counts_predictions_only_and_says_inside_or_outside(results, tmp_path):
    page = held_out_page(results)
    # 1 inside, 1 outside and 9 of gratings (8 inside: the mean rates do not differ) are predictions.
    assert page.paragraphs[0] == (
        "9 of 11 predictions lie inside what was published. Predictions outside are of: force, gratings."
    )
    text = write_markdown(page, tmp_path / "held_out.md").read_text()
    assert (tmp_path / "images" / "held_out.png").stat().st_size > 10_000
    assert "| force | a plate | 0.4 N | 0.1–0.3 | **outside** | predicted | nobody (assumed) |" in text
    assert "| force | a plate | – N | 0–1 | – | predicted |" in text
    assert "| `plate_force.csv` | quasi static | chosen in sample | 4 | 0.900 |" in text
    assert "| 0.1 N | proportional to the rate | 3 by 6, 100 per cm² | 1 | 0.080 | 0.110 |" in text
    assert "none fits" in text
    assert "nan" not in text


def test_results_are_read_back_from_their_file(results):
    back = from_json(HeldOut, to_json(results))
    assert to_json(back) == to_json(results)
