"""The study of spike trains: noise, irregularity, and recovery of the afferent from its spikes."""

import math
from dataclasses import replace

import numpy as np
import pytest

from fingerpad.core.random_streams import Presentations
from fingerpad.core.results import to_json
from fingerpad.core.signals import SedTraces
from fingerpad.inference.identifiable import (
    SPIKE_PARAMETER_NAMES,
)
from fingerpad.inference.spike_fit import soft_spikes
from fingerpad.neuron.transduction import drive
from fingerpad.report.style import png
from sections import SED_DRIVEN as AFFERENT
from studies import isi_variability, spike_fit
from studies.interval_statistics import interval_statistics
from studies.isi_variability import SETTLED_MS, SOURCES, held_at_its_rate
from studies.pages import spike_fit as report

SHIFT_MM = np.linspace(-3.5, 3.5, 8)
SEED = 4


def bar():
    """Energy density under a bar: a ramp and a relaxing hold, two bumps over the positions."""
    times = np.concatenate([np.linspace(0.0, 50.0, 9), [60.0, 80.0, 150.0, 400.0, 1000.0]])
    hold = 0.8 + 0.2 * np.exp(-(times - 50.0) / 100.0)
    shape = np.where(times <= 50.0, (times / 50.0) ** 1.5, hold)
    strengths = sum(2.2 * np.exp(-(((SHIFT_MM - centre) / 0.8) ** 2)) for centre in (-1.4, 1.4))
    return SedTraces(times, shape[:, np.newaxis] * strengths, [50.0])


@pytest.fixture(scope="module")
def found():
    return spike_fit.result(bar(), AFFERENT, SHIFT_MM, SEED)


# Irregularity


def test_the_held_afferent_keeps_its_rate_whatever_the_noise(found):
    """Made again, at the factor that was found: as many spikes as without noise."""
    membrane = AFFERENT.membrane
    current_ma = isi_variability.largest_held_current_ma(drive(bar(), pieces=8), AFFERENT)
    charging = -membrane.time_constant_ms * math.log1p(
        -membrane.threshold_mv * membrane.capacitance_mf / (current_ma * membrane.time_constant_ms)
    )
    wanted_hz = 1000.0 / (charging + membrane.refractory_ms)
    assert found.variability.rate_hz == pytest.approx(wanted_hz, rel=0.01)
    for source in SOURCES[:4]:
        held = held_at_its_rate(source, membrane, current_ma, source.amounts[2], SEED)
        trains = source.spikes(membrane, current_ma, held.current_factor, source.amounts[2], SEED)
        statistics = interval_statistics(trains, (SETTLED_MS, isi_variability.DURATION_MS))
        assert held.rate_kept
        assert 1000.0 / np.mean(statistics.mean_ms) == pytest.approx(wanted_hz, rel=0.03)
        assert held.coefficient_of_variation == pytest.approx(
            np.mean(statistics.coefficient_of_variation), rel=0.05
        )


def test_irregularity_rises_with_every_noise_but_that_of_the_gain(found):
    *others, gain = found.variability.sources
    for source in others:
        assert len(source.amount) >= 4
        assert np.all(np.diff(source.coefficient_of_variation) > 0.0)
        assert np.all(np.diff(source.local_variation) > 0.0)
    assert gain.name.startswith("gain")
    assert max(gain.coefficient_of_variation) < 1e-6
    assert gain.at_observed is None


def test_the_amount_at_the_observed_irregularity_lies_between_the_amounts_around_it(found):
    reached = [source for source in found.variability.sources if source.at_observed]
    assert len(reached) >= 3
    for source in reached:
        at = source.at_observed
        assert at.coefficient_of_variation == pytest.approx(0.78, rel=1e-12)
        above = next(n for n, cv in enumerate(source.coefficient_of_variation) if cv >= 0.78)
        assert source.amount[above - 1] < at.amount <= source.amount[above]


# Recovery


def test_the_afferent_is_found_again_in_its_spikes(found):
    recovery = found.recovery
    assert recovery.n_spikes > 700
    assert recovery.n_held >= 4  # five intervals of 95 %: one miss in four experiments
    assert np.all(np.abs(recovery.estimate - recovery.truth) < 3.5 * recovery.standard_error)
    assert recovery.log_likelihood > recovery.log_likelihood_of_truth
    assert recovery.rescaled.distance < recovery.rescaled.limit
    assert np.all(np.diff(recovery.rescaled.quantile) > 0.0)


def test_the_truth_is_the_afferent_with_its_gains_rescaled(found):
    true = found.recovery.truth
    scale = AFFERENT.capacitance_mf * AFFERENT.threshold_mv
    factors = true[:3] * scale / AFFERENT.parameters[:3]
    np.testing.assert_allclose(factors, factors[0], rtol=1e-12)
    assert 0.3 < factors[0] < 1.0  # a soft threshold fires early
    assert (true[3], true[4]) == (AFFERENT.time_constant_ms, spike_fit.WIDTH)


def test_spikes_of_other_noise_are_distinguished_from_those_of_a_soft_threshold(found):
    assert len(found.other_noise) == 3
    for row in found.other_noise:
        assert row.distance > row.limit
        assert 0.5 < row.over_truth[1] < 1.5
        assert row.static_rate_error_hz < 10.0


def test_the_raster_shows_the_first_presentation_of_each_position(found):
    raster = found.raster
    driven, true = drive(bar(), pieces=8), found.recovery.truth
    once = soft_spikes(driven, true, Presentations.of_one_afferent(SHIFT_MM.size), SEED)
    for number, train in enumerate(raster.spikes_ms):
        np.testing.assert_array_equal(train, once[number])
    counts = [len(train) for train in raster.spikes_ms]
    assert len(counts) == SHIFT_MM.size
    assert raster.shown == int(np.argmax(counts))
    np.testing.assert_array_equal(raster.shift_mm, SHIFT_MM)
    for intensity in raster.intensity_hz.values():
        assert intensity.shape == raster.times_ms.shape
        assert (intensity >= 0.0).all()


def test_the_same_seed_gives_the_same_numbers(found):
    again = spike_fit.result(bar(), AFFERENT, SHIFT_MM, SEED)
    assert to_json(again) == to_json(found)


# An afferent that never fires, and spikes that cannot be fitted


def test_a_silent_afferent_makes_an_empty_section_that_can_be_drawn():
    silent = replace(AFFERENT, intercept_ma=-1e-3)
    section = spike_fit.result(bar(), silent, SHIFT_MM, SEED)
    assert (section.recovery, section.raster, section.other_noise) == (None, None, ())
    assert section.variability.sources == ()
    assert png(report.draw, section).startswith(b"\x89PNG")
    assert report.table(section) == []
    assert "could not be fitted" in report.caption(section)


# The report


def test_spikes_that_cannot_be_fitted_have_a_row_without_an_estimate(found):
    unfitted = spike_fit.OtherNoise(name="white noise of the current", amount=0.3, n_spikes=3)
    section = replace(found, other_noise=(*found.other_noise, unfitted))
    _, others, _ = report.table(section)
    assert {len(row.cells) for row in others.rows} == {len(others.columns)}
    assert others.rows[-1].cells[3:8] == ("–",) * 5


def test_the_figure_and_the_tables_show_the_results(found):
    section = found
    assert png(report.draw, section).startswith(b"\x89PNG")
    recovery, others, sources = report.table(section)
    assert len(recovery.rows) == len(SPIKE_PARAMETER_NAMES)
    assert recovery.rows[3].cells[0] == "τ"
    assert recovery.rows[3].cells[2] == "71.8"
    assert [row.cells[0] for row in others.rows] == [row.name for row in section.other_noise]
    assert [row.cells[0] for row in sources.rows] == [source.name for source in SOURCES]
    assert sources.rows[-1].cells[2:] == ("–", "–", "–")
    assert f"{section.recovery.n_held} of 5 intervals of 95 % hold the truth" in report.caption(section)


def test_panels_show_the_numbers_of_the_section(found):
    section = found
    raster, intensity, rescaled, variability = report.draw(section).axes
    drawn = sum(len(collection.get_segments()) for collection in raster.collections)
    assert drawn == sum(len(train) for train in section.raster.spikes_ms)
    np.testing.assert_array_equal(intensity.lines[1].get_ydata(), section.raster.intensity_hz["fitted"])
    test = section.recovery.rescaled
    np.testing.assert_allclose(rescaled.lines[0].get_ydata(), np.array(test.quantile) - np.array(test.share))
    for line, source in zip(variability.lines, section.variability.sources, strict=True):
        np.testing.assert_array_equal(line.get_ydata(), source.coefficient_of_variation)
