"""Held-out predictions: checks in closed form, skins given by a formula, and one tiny press."""

from dataclasses import replace
from types import SimpleNamespace

import numpy as np
import pytest

from fingerpad.core.result_files import from_json, to_json
from fingerpad.core.signals import Traces
from fingerpad.experiments.conditions import RECEPTOR_X_MM, Conditions
from fingerpad.experiments.runner import Runner
from fingerpad.geometry.mesh import block_mesh
from fingerpad.neuron.afferent import Afferent
from fingerpad.neuron.population import Population
from sections import SENSITIVE
from studies import held_out
from studies.held_out import (
    CHOSEN,
    PLACES_PER_PERIOD,
    PREDICTED,
    Check,
    HeldOut,
    Score,
    blocks,
    decline,
    force_checks,
    grating_checks,
    half_width_mm,
    period_rates_hz,
    sphere_checks,
    threshold_checks,
    volume_checks,
    volume_decrease,
    weber_fractions_of,
)
from studies.pages import DOCS

QUICK = Conditions(resolution="quick", tissues="human")
PEOPLE_N = np.array([0.04, 0.16, 0.40, 0.77])


def check(value, low=np.nan, high=np.nan, role=PREDICTED):
    return Check(
        subject="force", statement="a plate", source="nobody", status="assumed", role=role,
        predicted=value, unit="N", low=low, high=high,
    )  # fmt: skip


def verdicts(checks):
    return [each.inside for each in checks]


# Checks


@pytest.mark.parametrize(
    ("value", "low", "high", "inside"),
    [
        (0.2, 0.1, 0.3, True),
        (0.05, 0.1, 0.3, False),
        (9.0, 0.1, np.nan, True),
        (0.4, np.nan, 0.3, False),
        (0.4, np.nan, np.nan, None),
        (np.nan, 0.1, 0.3, None),
    ],
)
def test_a_check_is_inside_its_bounds_and_undecided_without_bounds_or_prediction(value, low, high, inside):
    assert check(value, low, high).inside is inside


def test_forces_of_people_themselves_are_inside_and_chosen_at_every_depth():
    found = list(force_checks({"slow": PEOPLE_N}))
    assert verdicts(found) == [True] * 4
    assert [each.role for each in found] == [CHOSEN] * 4
    assert verdicts(force_checks({"slow": 1.5 * PEOPLE_N})) == [False] * 4


RISING = np.array([[10.0, 20.0, 30.0], [15.0, 40.0, 60.0]])
PROFILES = np.array([[20.0, 15.0, 5.0], [30.0, 10.0, 0.0]])
"""Half-widths of 0.75 and 0.375 mm: places are 0.5 mm apart."""


def test_directions_of_spheres_are_the_smallest_of_all_steps():
    found = list(sphere_checks(RISING, PROFILES))
    assert [each.predicted for each in found] == pytest.approx([1.0, 10.0, 5.0, 10.0, 0.375])
    assert verdicts(found) == [True] * 5
    falling = np.array([[10.0, 9.0, 30.0], [10.0, 40.0, 60.0]])
    assert verdicts(sphere_checks(falling, PROFILES[::-1])) == [True] + [False] * 4
    assert np.isnan(half_width_mm(np.arange(3.0), np.array([20.0, 15.0, 11.0])))


def grated(index, mean=20.0):
    """Rates over gratings with given modulation indices, across the finger and along it."""
    keys = [*((ridge, 0.0) for ridge in held_out.RIDGES_MM), *((ridge, 90.0) for ridge in held_out.TURNED_MM)]
    means = mean + 10.0 * np.array([key[1] > 0.0 for key in keys])
    return {
        key: middle * np.array([1.0, 1.0 + each, 1.0 - each, 1.0]).repeat(PLACES_PER_PERIOD // 4)
        for key, each, middle in zip(keys, index, means, strict=True)
    }


def test_gratings_are_compared_with_modulation_in_vivo_and_its_directions():
    index = [0.1, 0.2, 0.65, 0.68, 0.70, 0.75, 0.4, 0.8]
    found = list(grating_checks(grated(index), np.array([0.70, 0.66])))
    assert verdicts(found) == [True] * 7
    assert [each.predicted for each in found] == pytest.approx([0.70, 0.75, 4.0, 0.02, 0.04, 0.1, 10.0])


def test_volume_is_at_most_the_observed_and_weber_fractions_are_judged_in_whole_per_cent():
    assert verdicts(volume_checks(np.array([[0.01, 0.06], [0.02, 0.05]]))) == [True, False, True, False]
    assert verdicts(threshold_checks([0.054, 0.096, 0.144])) == [False, True, True]


def test_noise_proportional_to_a_power_of_the_curvature_gives_one_fraction_at_all_standards():
    grid = Population.grid(afferent=Afferent(noise_offset_hz=0.0))
    pattern = 1.0 + np.random.default_rng(1).uniform(size=len(grid))
    rates = np.array(held_out.PRESSED_PER_M)[:, None] ** 0.8 * pattern
    found = weber_fractions_of(grid, rates, 0)
    assert found == pytest.approx([found[-1]] * 3, rel=0.01)
    assert 0.08 < found[-1] < 0.12


# Skins


def test_volume_of_a_body_that_shears_stays_and_that_of_a_stretched_one_follows_the_stretches():
    mesh = block_mesh([0.0, 1.0, 3.0], [0.0, 1.0, 2.0], [0.0, 2.0], layers=[2, 3])
    sheared = SimpleNamespace(mesh=mesh, displacement_mm=0.4 * mesh.nodes_mm[:, [1]] * [1.0, 0.0, 0.0])
    assert volume_decrease(sheared) == pytest.approx(0.0, abs=1e-12)
    stretched = SimpleNamespace(mesh=mesh, displacement_mm=mesh.nodes_mm * [0.1, -0.2, 0.05])
    assert volume_decrease(stretched) == pytest.approx(1.0 - 1.1 * 0.8 * 1.05)


class WavySkin:
    """Energy that varies as a cosine along one axis, constant after the ramp."""

    def __init__(self, axis, period_mm, depth=0.5):
        self.axis, self.period_mm, self.depth = axis, period_mm, depth

    def sed(self, sites):
        along = np.asarray(sites)[:, self.axis] - (RECEPTOR_X_MM if self.axis == 0 else 0.0)
        peaks = 2.0 + self.depth * np.cos(2.0 * np.pi * along / self.period_mm)
        return Traces([0.0, 50.0, 1000.0], np.outer([0.0, 1.0, 1.0], peaks), kinks_ms=[50.0])


@pytest.mark.parametrize(("axis", "spin"), [(0, 0.0), (1, 90.0)])
def test_receptors_lie_over_one_period_of_a_grating_in_the_direction_of_its_ridges(axis, spin):
    static = period_rates_hz(WavySkin(axis, 2.0), SENSITIVE, 1.0, spin, 0.0)
    assert static.argmax() == held_out.PLACES_PER_PERIOD // 2  # the middle of a ridge
    assert static.argmin() == 0  # the middle of a groove
    np.testing.assert_allclose(static[1:], static[:0:-1], rtol=1e-6)
    other = period_rates_hz(WavySkin(1 - axis, 2.0), SENSITIVE, 1.0, spin, 0.0)
    assert np.ptp(other) == 0.0


def test_a_rate_that_stays_does_not_decline():
    population = Population(np.array([(RECEPTOR_X_MM, 0.0)]), 1.0, SENSITIVE)
    found = decline(population, WavySkin(0, 2.0), [(400.0, 600.0), (600.0, 950.0)])
    assert found == pytest.approx(0.0, abs=1e-3)


# The page


def test_blocks_count_predictions_only_and_have_the_form_of_the_page(tmp_path):
    score = Score(
        file="plate_force", role=CHOSEN, loading="quasi_static", n_rows=4, r2=0.9, correlation=0.95, gain=1.1,
        inside_range=False,
    )  # fmt: skip
    results = HeldOut(
        checks=(
            check(0.2, 0.1, 0.3), check(0.4, 0.1, 0.3), check(0.1, 0.2, 0.3, CHOSEN), check(np.nan, 0.0, 1.0),
        ),
        scores=(score, replace(score, file="cylinder_deflection", inside_range=None)),
        manifest=Runner(tmp_path).manifest(QUICK),
    )  # fmt: skip
    found = blocks(results)
    assert found["checks"].startswith(
        "1 of 2 predictions lie inside what was published. Outside are some of: force."
    )
    assert "| force | a plate | 0.4 N | 0.1–0.3 | **outside** |" in found["checks"]
    assert "| force | a plate | 0.1 N | 0.2–0.3 | **outside** (chosen) |" in found["checks"]
    assert "| force | a plate | – N | 0–1 | – |" in found["checks"]
    assert (
        "| `plate_force.csv` | quasi static | chosen in sample | 4 | 0.90 | 0.95 | 1.10 | false |"
        in (found["scores"])
    )
    page = (DOCS / "held-out.md").read_text(encoding="utf-8")
    for block in found.values():
        head = next(line for line in block.splitlines() if line.startswith("|"))
        assert head in page
    assert to_json(from_json(HeldOut, to_json(results))) == to_json(results)
