"""Curvature thresholds and efficiencies: on skins with a formula, and interpolation against a press."""

from dataclasses import replace
from types import SimpleNamespace

import numpy as np
import pytest

from fingerpad import ConvergenceError, Grading, Population, PressSettings
from fingerpad.core.random_streams import Purpose, normals
from fingerpad.experiments.conditions import CURVATURES, RECEPTOR_X_MM, Conditions
from fingerpad.experiments.gerling2014 import thresholds as study
from fingerpad.experiments.gerling2014.claims import READERS, RULES
from fingerpad.psychophysics import yes_no
from fingerpad.psychophysics.encoding import gradient_sum, neighbour_pairs
from fingerpad.psychophysics.ideal_observer import SMALLEST_SPREAD
from fingerpad.psychophysics.observer import expected_hit_rates
from fingerpad.psychophysics.sensitivity import InterpolatedObserver
from fingerpad.report import percept as page
from fingerpad.report.style import png
from report_rows import caption_of
from sections import SENSITIVE, SphereSkin

POPULATION = Population.grid(rows=3, columns=4, centre_mm=(RECEPTOR_X_MM, 0.0), afferent=SENSITIVE)
PAIRS = neighbour_pairs(POPULATION.positions_mm, POPULATION.pitch_mm)
DRAWS = normals(0, 1, 12, Purpose.RESPONSE, 2000)[0].T


SKINS = {curvature: SphereSkin.wide(curvature) for curvature in (*CURVATURES, *study.PRESSED_PER_M)}


@pytest.fixture(scope="module")
def found():
    return study.curvature_thresholds(SKINS, SENSITIVE, 0.06, seed=0)


def proportional(power):
    """Rates that go with a power of the curvature, at four receptors, and an observer of them."""
    at = np.geomspace(100.0, 700.0, 200)
    rates = np.outer((at / 287.0) ** power, POPULATION.positions_mm[:, 1] ** 2 + 20.0)
    return InterpolatedObserver(at, rates, PAIRS, 0.03, DRAWS)


def test_rates_that_scale_with_curvature_obey_webers_law():
    observer = proportional(0.7)
    fractions = [study.threshold_at(observer, s).weber_fraction for s in (144.0, 287.0, 400.0)]
    assert fractions == pytest.approx([fractions[0]] * 3, rel=2e-3)
    steeper = study.threshold_at(proportional(1.4), 287.0).weber_fraction
    assert steeper == pytest.approx((1.0 + fractions[1]) ** 0.5 - 1.0, rel=2e-3)


def test_threshold_is_at_a_hit_rate_of_three_quarters_with_the_noise_that_fits_people(found):
    population = found.populations[1]
    entry = population.standards[2]
    assert entry.standard_per_m == 287.0
    layout = Population.grid(rows=6, columns=6, centre_mm=(RECEPTOR_X_MM, 0.0), afferent=SENSITIVE)
    pairs = neighbour_pairs(layout.positions_mm, layout.pitch_mm)
    pressed_per_m = (287.0, 287.0 + entry.jnd_per_m, 296.0, 365.0)
    table = [layout.respond(SphereSkin.wide(curvature)).static_rate_hz for curvature in pressed_per_m]
    draws = normals(0, 1, 36, Purpose.RESPONSE, 4000)[0].T
    # The comparison answers here by itself, not by interpolation.
    at_threshold, near, far = expected_hit_rates(table, pairs, population.noise_sigma, draws)
    assert at_threshold == pytest.approx(0.75, abs=0.01)
    assert near == pytest.approx(0.58, abs=0.05)
    assert far == pytest.approx(0.95, abs=0.05)
    lower, upper = entry.fitted_interval
    assert lower < entry.weber_fraction < upper
    assert found.populations[0].noise_sigma == 0.06
    for each in found.populations:
        assert len(each.standards) == 4
        assert all(one.ideal_weber_fraction < one.weber_fraction for one in each.standards)
    assert png(page.draw_thresholds, found)[:4] == b"\x89PNG"
    assert len(page.rows_of_thresholds(found)) == 8


def test_ideal_threshold_is_fishers(found):
    """The ideal observer of two spheres that far apart judges three quarters of single looks correctly."""
    observer = proportional(0.7)
    entry = study.threshold_at(observer, 287.0)
    step = entry.ideal_weber_fraction
    rates = [observer.responses(287.0 * (1.0 + side * step)) for side in (-0.5, 0.5)]
    middle = observer.responses(287.0)
    variance = np.square(0.03 * middle) + SMALLEST_SPREAD**2
    difference = rates[1] - rates[0]
    squares = np.square(difference) / variance + 2.0 * np.square(0.03**2 * middle * difference / variance)
    assert yes_no(float(np.sqrt(squares.sum()))) == pytest.approx(0.75, abs=1e-3)


def test_a_threshold_out_of_range_is_reported_and_affects_only_its_row(found):
    noisy = replace(proportional(0.1), noise=0.5)
    assert np.isnan(noisy.difference(287.0, 0.75))
    with pytest.raises(ConvergenceError, match="No sphere up to 700 /m is discriminated from 287 /m in 75%"):
        study.threshold_at(noisy, 287.0)
    loud = study.curvature_thresholds(SKINS, SENSITIVE, 3.0, seed=0)
    reached, missed = (getattr(loud.populations[0], name) for name in ("standards", "without_threshold"))
    assert [entry.standard_per_m for entry in reached] == [144.0, 200.0]
    assert [entry.standard_per_m for entry in missed] == [287.0, 400.0]
    _, told, *values = READERS["weber fractions, paper"](SimpleNamespace(curvature_thresholds=loud))
    assert "No sphere" in told
    assert not RULES["per cent within"]((0.1, 0.14), "", told, *values)
    assert png(page.draw_thresholds, loud)[:4] == b"\x89PNG"
    assert any("No sphere" in cells[5] for cells in page.rows_of_thresholds(loud))


def test_receptors_that_are_silent_under_a_standard_do_not_change_its_threshold():
    at = np.geomspace(100.0, 700.0, 200)
    rates = np.outer((at / 287.0) ** 0.7, POPULATION.positions_mm[:, 1] ** 2 + 20.0)
    with_silent = np.hstack([rates, np.zeros((200, 1))])
    draws = np.hstack([DRAWS, DRAWS[:, :1]])
    observer = InterpolatedObserver(at, with_silent, PAIRS, 0.03, draws)
    found, expected = (study.threshold_at(one, 287.0) for one in (observer, proportional(0.7)))
    assert found.ideal_weber_fraction == pytest.approx(expected.ideal_weber_fraction, rel=1e-9)
    assert found.jnd_per_m == pytest.approx(expected.jnd_per_m, rel=1e-9)


def test_noise_that_cannot_be_fitted_is_reported_in_place_of_thresholds():
    same = study.curvature_thresholds(dict.fromkeys(SKINS, SphereSkin.wide(287.0)), SENSITIVE, 0.06, seed=0)
    paper, square = same.populations
    assert len(paper.without_threshold) == 4
    assert np.isnan(square.noise_sigma)
    assert "No noise within" in square.without_threshold[0].why_not
    assert png(page.draw_thresholds, same)[:4] == b"\x89PNG"
    assert f"{same.judgements} judgements of each" in caption_of(
        "reproduction", "figure_12_curvature_thresholds", same
    )


class Coarse(Conditions):
    """A mesh of few elements; on coarser ones the spheres' contact grows from node to node."""

    def sphere_grading(self):
        return Grading(RECEPTOR_X_MM, 4.0, 1.5, 0.7, 0.5, stratum_corneum=1, dermis=1, subcutis=2)


def test_interpolation_agrees_with_a_press():
    """A sphere foretold from others 10 % flatter and more curved, as far as those of the study are apart.

    A tenth of the threshold, 25 /m, is allowed for on this mesh; 0.2 /m is what elements of 0.1 mm leave.
    """
    curvatures = np.array([250.0, 287.0, 316.0, 345.0, 380.0])
    touches = study.threshold_touches(Coarse("quick"), curvatures.tolist()).values()
    skins = [replace(touch, settings=PressSettings(4, 3)).solve(1) for touch in touches]
    table = np.array([POPULATION.respond(skin).static_rate_hz for skin in skins])
    sums, others = gradient_sum(table, PAIRS), np.arange(curvatures.size) != 2
    observer = InterpolatedObserver(curvatures[others], table[others], PAIRS, 0.0, DRAWS)
    missed = gradient_sum(observer.responses(316.0), PAIRS) - sums[2]
    assert abs(missed / np.gradient(sums, curvatures)[2]) < 2.5
