"""Optional analyses of a fit to recordings: receptor offset, profiles, and sensitivity."""

from dataclasses import replace

import numpy as np
import pytest
from numpy.testing import assert_allclose, assert_array_equal

from fingerpad import InputError, RateRecordings, Traces
from fingerpad.experiments.fit import likelihoods
from fingerpad.experiments.fit.fit import check_offset, fit_offset, fit_recordings
from fingerpad.experiments.fit.likelihoods import profiled
from fingerpad.experiments.fit.results import (
    CredibleInterval,
    ParameterProfile,
    PosteriorConvergence,
    RatePosterior,
)
from fingerpad.inference.afferent_fit import ReceptorOffset
from fingerpad.inference.identifiable import IDENTIFIABLE_NAMES, identifiable
from fingerpad.inference.rate_model import AfferentModel, RateProblem, four_number_model
from fingerpad.report import nerve as report
from fingerpad.report.nerve import ALLOWED_LOSS
from fingerpad.report.style import png
from report_rows import caption_of, table_of

TIMES_MS = np.array([0.0, 10.0, 20.0, 30.0, 40.0, 50.0, 80.0, 200.0, 1000.0])
COURSE = np.minimum(TIMES_MS / 50.0, 1.0) ** 2 * (0.8 + 0.2 * np.exp(-np.maximum(TIMES_MS - 50.0, 0.0) / 200))
SHIFTS_MM = np.linspace(-2.0, 2.0, 9)
FOLDS = np.arange(9) % 3
PLACES_MM = (-0.3, 0.0, 0.3)
KNOWN = np.array([2e-7, 1.2e-4, 9e-7, 60.0, 1e-6, 50.0])
TRUE_OFFSET_MM = 0.12
WINDOWS_MS = ((30.0, 50.0), (600.0, 950.0))


def felt(offset_mm, times_ms=TIMES_MS):
    """Energy density where a receptor lies: two peaks below the edges of a bar, none below its middle."""
    place = SHIFTS_MM - offset_mm
    height_kpa = 0.8 + 2.0 * np.exp(-(((np.abs(place) - 1.2) / 0.6) ** 2))
    return Traces(times_ms, np.outer(COURSE, height_kpa), kinks_ms=[50.0])


BESIDE = {offset: felt(offset) for offset in PLACES_MM}
MODEL = AfferentModel.of_traces(BESIDE[0.0])
# In between, the model is linear: the truth is made the same way, so that it can be found.
TRUTH = ReceptorOffset.of_traces(BESIDE)
NAMES = tuple(f"{shift:g}" for shift in SHIFTS_MM)
ASIDE = RateRecordings(NAMES, *TRUTH.evaluate(np.append(KNOWN, TRUE_OFFSET_MM)))
IN_PLACE = RateRecordings(NAMES, *MODEL.evaluate(KNOWN))


@pytest.fixture(scope="module")
def fitted():
    """The fit to rates of a receptor that lies beside its place."""
    return fit_recordings(BESIDE[0.0], ASIDE, FOLDS, beside=BESIDE, with_sensitivity=True)


def test_stimuli_with_different_motions_can_be_sampled_at_an_offset():
    slow_ms = np.append(TIMES_MS[:-1], 1500.0)
    mixed = [AfferentModel.of_traces([felt(place), felt(place, slow_ms)]) for place in (-0.2, 0.2)]
    dynamic, _ = ReceptorOffset(np.array([-0.2, 0.2]), mixed).evaluate(np.append(KNOWN, 0.2))
    assert_array_equal(dynamic[:9], AfferentModel.of_traces(felt(0.2)).evaluate(KNOWN)[0])
    with pytest.raises(InputError, match="2 offsets and 2 models of 2 kinds"):
        ReceptorOffset(np.array([-0.2, 0.2]), [mixed[0], MODEL])


def test_a_receptor_beside_its_place_is_found(fitted):
    for found in (fitted.offset, fit_offset(BESIDE, ASIDE, np.arange(9) % 2, "cma_es", WINDOWS_MS)):
        assert found.offset_mm == pytest.approx(TRUE_OFFSET_MM, abs=0.02)
        assert found.fss_in_sample > 0.999
        assert found.identifiable["dynamic_gain_per_kpa"] == pytest.approx(identifiable(KNOWN)[1], rel=0.1)


def test_the_fit_in_its_place_stands_beside_it_and_the_receptor_held_there_is_that_fit(fitted):
    found = fitted.offset
    assert found.fss_out_of_sample > fitted.fss_out_of_sample + 0.01
    held = dict(zip(found.held.offset_mm, found.held.fss_in_sample, strict=True))
    assert held[0.0] == pytest.approx(fitted.fss_in_sample, rel=1e-14)
    assert held[0.0] < found.fss_in_sample
    assert held[0.3] > held[-0.3]
    assert len(found.folds_mm) == len(fitted.folds)
    scatter = np.array(found.folds_mm) - np.mean(found.folds_mm)
    assert found.standard_error_mm == pytest.approx(np.sqrt(2.0 / 3.0 * scatter @ scatter))


def test_a_receptor_that_may_move_never_fits_worse():
    found = fit_offset(BESIDE, IN_PLACE, np.arange(9) % 2, "least_squares", WINDOWS_MS)
    assert found.fss_in_sample >= found.held.fss_in_sample[1]
    assert abs(found.offset_mm) < 0.02


def test_an_offset_needs_its_method_several_places_and_sites_on_both_sides():
    for beside, said in (({0.0: BESIDE[0.0], 0.3: BESIDE[0.3]}, "got 0, 0.3"), ({}, "got none")):
        with pytest.raises(InputError, match=f"below and above 0 mm: {said}"):
            fit_recordings(BESIDE[0.0], ASIDE, beside=beside)
    with pytest.raises(InputError, match="least_squares or cma_es: got likelihood"):
        check_offset("likelihood", [0.0, 1.0])
    with pytest.raises(InputError, match=r"all are at 1\.5 mm"):
        check_offset("cma_es", [1.5, 1.5])
    check_offset("cma_es", [1.5, 1.4])


def test_profiles_hold_the_known_afferent_and_rise_to_both_sides():
    noise = np.random.default_rng(2).normal(0.0, 1.0, (2, 9))
    noisy = RateRecordings(NAMES, *np.maximum(MODEL.evaluate(KNOWN) + noise, 0.0))
    found = profiled(MODEL, noisy, identifiable(KNOWN))
    assert [profile.name for profile in found] == list(IDENTIFIABLE_NAMES)
    for profile, known in zip(found, identifiable(KNOWN), strict=True):
        low, high = profile.low, profile.high
        middle = profile.values[np.argmin(profile.losses)]
        # Wider by half than 95 % asks for: this is one data set, and all four shall pass.
        assert low is None or 1.5 * low - 0.5 * middle < known
        assert high is None or known < 1.5 * high - 0.5 * middle
        assert min(profile.losses) >= 0.0
        assert max(profile.losses) > ALLOWED_LOSS
    _, dynamic, static, _ = found
    assert dynamic.high < 1.3 * identifiable(KNOWN)[1]
    assert static.high - static.low < 0.5 * identifiable(KNOWN)[2]


def test_scores_of_rows_are_those_of_the_problem_for_one_phase_as_well():
    points = identifiable(KNOWN) * np.array([[1.0], [1.1], [0.8]])
    for recordings in (IN_PLACE, RateRecordings(NAMES, None, IN_PLACE.static_rate_hz)):
        problem = RateProblem(four_number_model(MODEL), recordings)
        expected = [problem.score(point, np.arange(9)) for point in points]
        assert_allclose(problem.score_batch(points), expected, rtol=1e-12)
        assert expected[0] > expected[1]


def test_ranges_are_shares_of_the_fit_and_a_gain_of_nothing_has_one_too(fitted):
    found = fitted.sensitivity
    four = np.array(list(fitted.identifiable.values()))
    assert_allclose(found.lower, np.minimum(0.75 * four, 1.25 * four), rtol=1e-12)
    problem = RateProblem(four_number_model(MODEL), IN_PLACE)
    nothing = likelihoods.fss_sensitivity(problem, [0.0, 0.0, 0.018, 60.0], 1)
    assert_allclose(nothing.lower[:2], [-0.25 / 68.0, 0.0], rtol=1e-12)
    assert (nothing.upper > nothing.lower).all()
    # Without a dynamic gain to speak of, rates hang on the static one.
    assert nothing.total[2] == max(nothing.total)


@pytest.fixture(scope="module")
def section(fitted):
    profile = {"values": [1.0, 2.0, 3.0], "losses": [3.0, 0.0, 2.5], "low": None, "high": 2.8}
    profiles = tuple(ParameterProfile(name=name, **profile) for name in IDENTIFIABLE_NAMES)
    return replace(fitted, profiles=profiles)


def test_figures_words_and_tables_hold_what_was_found(section):
    panels = report.draw_profiles(section).axes
    assert [axes.lines[0].get_ydata().tolist() for axes in panels] == [[3.0, 0.0, 2.5]] * 4
    assert panels[3].get_xlabel() == "τ [ms]"
    (axes,) = report.draw_offset(section).axes
    lines = {line.get_label(): line for line in axes.lines}
    assert lines["held there"].get_ydata().tolist() == section.offset.held.fss_in_sample.tolist()
    assert lines["fitted to all"].get_xdata().tolist() == [section.offset.offset_mm]
    assert lines["fitted without a fold"].get_xdata().tolist() == section.offset.folds_mm.tolist()
    for draw in (report.draw_profiles, report.draw_offset):
        assert png(draw, section).startswith(b"\x89PNG")
    found = section.offset
    assert f"fitted offset is {found.offset_mm:.3g} mm" in caption_of("fit", "offset", section)
    table = table_of("fit", "Offset", section)
    assert table.rows[1].cells[3] == f"{found.fss_in_sample:.3f}"
    assert table.rows[0].cells[6] == f"{section.fss_out_of_sample:.3f}"
    assert all(len(row.cells) == len(table.columns) for row in table.rows)
    assert table_of("fit", "Intervals", section).rows[0].cells[2] == "open … 2.8"
    shares = [
        row.cells[3].split(" ± ")[0] for row in table_of("fit", "Sensitivity", section.sensitivity).rows
    ]
    assert shares == [f"{total:.2f}".replace("-", "−") for total in section.sensitivity.total]


def test_credible_intervals_are_drawn_where_there_are_some(section):
    interval = CredibleInterval(median=2.0, low=1.5, high=2.5)
    drawn = replace(section, posterior=RatePosterior(
        level=0.95, seed=1, covariance=np.eye(4), rates={},
        numbers=dict.fromkeys(IDENTIFIABLE_NAMES, interval),
        convergence=PosteriorConvergence(**dict.fromkeys(PosteriorConvergence.__dataclass_fields__, 1)),
    ))  # fmt: skip
    panels = zip(report.draw_profiles(drawn).axes, report.draw_profiles(section).axes, strict=True)
    assert all(len(more.lines) == len(fewer.lines) + 1 for more, fewer in panels)
