"""Readings of the rates under the bar: which intervals count, and the bar as one ridge of a grating."""

from dataclasses import asdict
from itertools import pairwise

import numpy as np
import pytest
from numpy.testing import assert_allclose

from fingerpad.core.signals import SedTraces, SpikeTrains
from fingerpad.data import bar_firing_rates
from fingerpad.experiments.conditions import Conditions
from fingerpad.experiments.gerling2014 import single_unit
from fingerpad.experiments.runner import Runner
from fingerpad.geometry.indenters import Bar
from fingerpad.inference.rate_model import AfferentModel
from fingerpad.neuron.afferent import Afferent
from fingerpad.neuron.spikes import firing_rate_hz
from fingerpad.neuron.transduction import drive
from studies import bar_readings
from studies.pages.bar_readings import bar_readings_page, draw_bodies

WINDOW_MS = (30.0, 50.0)
TRAINS = ([10.0, 35.0, 40.0, 50.0, 60.0], [45.0], [], [20.0, 48.0], [31.0, 33.0, 37.0])


@pytest.fixture(scope="module")
def driven():
    """Drives of 36 shifts by a stress, strongest where rates were recorded highest."""
    peaks = 0.1 + bar_firing_rates().static_rate_hz / 30.0
    traces = np.outer([0.0, 1.0, 0.9], peaks)
    stress = {"dynamic_quantity": "compressive_stress", "static_quantity": "compressive_stress"}
    return drive(SedTraces([0.0, 50.0, 1000.0], traces, kinks_ms=[50.0], **stress))


def by_hand(train, reading):
    """Rates of one train, interval by interval."""
    start, end = WINDOW_MS
    closing = [(a, b) for a, b in pairwise(train) if start < b <= end]
    if reading == bar_readings.INSIDE:
        closing = [(a, b) for a, b in closing if a > start]
    lengths = [b - a for a, b in closing]
    if not lengths:
        return 0.0
    if reading == bar_readings.RECIPROCAL:
        return 1000.0 * sum(1.0 / length for length in lengths) / len(lengths)
    if reading == bar_readings.LITERAL:  # m - l + 1 terms over m - l
        return 1000.0 * (len(lengths) - 1) / sum(lengths)
    return 1000.0 * len(lengths) / sum(lengths)


@pytest.mark.parametrize("reading", bar_readings.INTERVALS)
def test_rates_by_reading_are_those_counted_by_hand(reading):
    found = bar_readings.counted_rates_hz(SpikeTrains.from_lists(TRAINS), WINDOW_MS, reading)
    assert_allclose(found, [by_hand(train, reading) for train in TRAINS], rtol=1e-12)


def test_the_reading_that_is_used_is_that_of_the_model(driven):
    spikes = SpikeTrains.from_lists(TRAINS)
    used = bar_readings.counted_rates_hz(spikes, WINDOW_MS, bar_readings.USED)
    assert_allclose(used, firing_rate_hz(spikes, WINDOW_MS), rtol=1e-12)
    parameters = Afferent(static_gain=1.2e-6).parameters
    counted = bar_readings.CountedModel(driven, bar_readings.USED)
    expected = AfferentModel.of_drive(driven).evaluate(parameters)
    assert_allclose(counted.evaluate(parameters), expected, rtol=1e-12)
    assert_allclose(np.array(counted.evaluate_batch(parameters[None]))[:, 0], expected, rtol=1e-12)


@pytest.mark.parametrize("groove_mm", bar_readings.GROOVES_MM)
def test_the_ridge_at_the_centre_is_the_bar_and_has_neighbours(groove_mm):
    conditions = Conditions("quick")
    bars = single_unit.bar_touches(conditions)
    gratings = bar_readings.grating_touches(conditions, groove_mm)
    for bar, grating in zip(bars, gratings, strict=True):
        assert asdict(bar) | {"indenter": None} == asdict(grating) | {"indenter": None}
    x = np.linspace(-1.5 - groove_mm / 2, 1.5 + groove_mm / 2, 41)
    points = np.stack([x, np.full_like(x, 0.1), np.zeros_like(x)], axis=1)
    assert_allclose(gratings[0].indenter.gap(points)[0], Bar().gap(points)[0], atol=1e-12)
    next_ridge = np.array([[3.0 + groove_mm, -0.2, 0.0]])
    assert gratings[0].indenter.gap(next_ridge)[0] < 0.0 < Bar().gap(next_ridge)[0]


def test_one_afferent_serves_all_readings_and_each_reading_is_fitted_as_well(driven):
    models = {
        reading: bar_readings.CountedModel(driven, reading)
        for reading in (bar_readings.USED, bar_readings.LITERAL)
    }
    used, literal = bar_readings.compare(models, dict.fromkeys(models, driven))
    assert used.fss_same_afferent == pytest.approx(used.fss_in_sample, rel=1e-12)
    assert (literal.static_rate_hz <= used.static_rate_hz).all()
    assert literal.dynamic_rate_hz.max() < used.dynamic_rate_hz.max()
    assert literal.fss_same_afferent < literal.fss_in_sample


def test_the_page_has_both_tables_and_every_body_in_the_figure(driven, tmp_path):
    models = {body: AfferentModel.of_drive(driven) for body in ("bar alone", "ridge")}
    bodies = bar_readings.compare(models, dict.fromkeys(models, driven))
    observed = bar_firing_rates()
    result = bar_readings.BarReadings(
        quantity="compressive_stress",
        shift_mm=observed.shift_mm,
        observed_dynamic_hz=observed.dynamic_rate_hz,
        observed_static_hz=observed.static_rate_hz,
        intervals=bodies,
        bodies=bodies,
        manifest=Runner(tmp_path).manifest(Conditions("quick")),
    )
    page = bar_readings_page(result)
    found = [table for chapter in page.chapters for table in chapter.tables]
    assert [len(table.rows) for table in found[:2]] == [2, 2]
    labels = [line.get_label() for line in draw_bodies(result).axes[0].get_lines()]
    assert labels == ["observed", "bar alone", "ridge"]
