"""Quantities that drive the afferent: fits of synthetic truth, scales, and tables of the results."""

import json
from dataclasses import replace
from itertools import pairwise

import numpy as np
import pytest
from numpy.testing import assert_allclose, assert_array_equal
from scipy.integrate import solve_ivp
from scipy.stats import norm

from fingerpad.core.errors import InputError
from fingerpad.core.phases import ramp_and_hold_phases
from fingerpad.core.results import from_json, to_json
from fingerpad.core.signals import SedTraces
from fingerpad.experiments.conditions import RECEPTOR_X_MM, Conditions
from fingerpad.experiments.runner import Runner
from fingerpad.inference.fitting.cross_validation import interleaved_folds
from fingerpad.inference.fitting.methods import Fit
from fingerpad.inference.identifiable import identifiable, six_parameters
from fingerpad.inference.rate_model import AfferentModel
from fingerpad.inference.rate_problem import RateProblem
from fingerpad.inference.recordings import RateRecordings
from fingerpad.inference.start_points import start_points
from fingerpad.neuron.transduction import Drive, drive
from fingerpad.report.style import png
from sections import SED_DRIVEN, sed_driven
from studies import drive_depths, drive_fits, drive_quantities, drive_study, dynamic_response
from studies.drive_fits import BestOf, information, thorough_method
from studies.drive_quantities import ALONE, APART, CANDIDATES, EXTENDED, PAPER, Drivers
from studies.dynamic_response import EXPLANATIONS, ExplainedModel, Patch, low_passed
from studies.pages import drive_quantities as report
from studies.pages import drive_study as drives_report
from studies.pages.markdown import with_palette, write_markdown

TIMES_MS = np.concatenate([np.linspace(0.0, 50.0, 5), [60.0, 100.0, 300.0, 1000.0]])
SHIFT_MM = np.round(np.linspace(-3.45, 3.45, 24), 2)
EDGES_MM = (-1.4, 1.4)


def in_time(exponent):
    """A ramp that accelerates, and a hold that relaxes."""
    rise = np.clip(TIMES_MS / 50.0, 0.0, 1.0) ** exponent
    return rise * (1.0 - 0.1 * (1.0 - np.exp(-np.maximum(TIMES_MS - 50.0, 0.0) / 150.0)))


def energy_at(x_mm):
    """Two narrow peaks under the edges, of different height, next to nothing between them. [kPa]"""
    return 2.0 * np.exp(-(((x_mm - EDGES_MM[0]) / 0.5) ** 2)) + 1.7 * np.exp(
        -(((x_mm - EDGES_MM[1]) / 0.5) ** 2)
    )


def stress_at(x_mm):
    """Wider peaks on a plateau below the flat face. [kPa]"""
    plateau = 12.0 / (1.0 + np.exp(8.0 * (np.abs(x_mm) - 2.0)))
    return plateau + 9.0 * np.sqrt(energy_at(x_mm))


def bar_traces():
    """Every quantity by name, as if the finger were so simple."""
    energy, stress = np.outer(in_time(2.0), energy_at(SHIFT_MM)), np.outer(in_time(1.2), stress_at(SHIFT_MM))
    values = dict.fromkeys(("stored", "instantaneous", "work"), energy)
    values |= dict.fromkeys(("von_mises", "compressive_stress"), stress)
    values["compressive_strain"] = 0.05 * np.sqrt(energy)
    return {name: SedTraces(TIMES_MS, value, [50.0]) for name, value in values.items()}


TRACES = bar_traces()
FOUR_TRUE = np.array([0.03, 0.3, 0.04, 30.0])
"""b [1/ms], k_d [1/kPa], k_s [1/(kPa ms)], tau [ms]: of an afferent whose dynamic term follows stress."""


def true_recordings():
    model = AfferentModel.of_drive(drive_quantities.drive_of(TRACES, EXTENDED))
    rates = model.evaluate(six_parameters(FOUR_TRUE))
    return RateRecordings(tuple(f"{shift:g}" for shift in SHIFT_MM), *rates)


RECORDINGS = true_recordings()


def problem(drivers, traces=TRACES):
    driven = drive_quantities.drive_of(traces, drivers)
    start = drive_fits.scaled_starts(driven, drive_quantities.drive_of(TRACES, PAPER))[0]
    return RateProblem(drive_fits.relative_model(AfferentModel.of_drive(driven), start), RECORDINGS), start


@pytest.fixture(scope="module")
def found():
    """Truth, the paper's model and stress alone, fitted to rates without noise."""
    candidates = (PAPER, Drivers("compressive_stress", "compressive_stress"), EXTENDED)
    return drive_quantities.drive_result(TRACES, RECORDINGS, np.random.default_rng(4), candidates)


# What is compared


def test_the_paper_comes_first_and_every_quantity_once():
    assert ALONE[0] == CANDIDATES[0] == PAPER == Drivers("stored", "stored")
    assert len({drivers.static for drivers in ALONE}) == len(ALONE) == 6
    assert EXTENDED in APART
    assert len(set(CANDIDATES)) == len(CANDIDATES) == 9
    assert all(drivers.static == "stored" != drivers.dynamic for drivers in APART)


def test_a_fitted_model_follows_what_its_drive_follows():
    traces = SedTraces(TIMES_MS, TRACES["stored"].sed_kpa, [50.0], TRACES["von_mises"].sed_kpa, "von_mises")
    rates = AfferentModel.of_traces(traces).evaluate(SED_DRIVEN.parameters)
    assert_array_equal(rates, replace(SED_DRIVEN, dynamic_quantity="von_mises").rates(traces))


def test_drives_put_each_quantity_where_its_term_looks():
    alone = drive_quantities.drive_of(TRACES, Drivers("von_mises", "von_mises"))
    apart = drive_quantities.drive_of(TRACES, EXTENDED)
    paper = drive_quantities.drive_of(TRACES, PAPER)
    assert_array_equal(alone.sed_kpa, drive(TRACES["von_mises"]).sed_kpa)
    assert_array_equal(apart.sed_kpa, paper.sed_kpa)
    assert_array_equal(apart.rate_kpa_per_ms, drive(TRACES["compressive_stress"]).rate_kpa_per_ms)
    assert apart.dynamic_quantity == "compressive_stress"
    with pytest.raises(InputError, match=r"static must be one of stored, .*: got 'heat'"):
        Drivers("heat", "stored")
    with pytest.raises(InputError, match="a quantity other than SED"):
        drive_quantities.drive_of(TRACES, Drivers("von_mises", "stored"))


class Skin:
    """Skin that is flat along x and knows where it was asked."""

    times_ms, kinks_ms, onset_ms = TIMES_MS, (50.0,), 0.0
    phases = ramp_and_hold_phases(50.0, TIMES_MS[-1])

    def __init__(self, shift_mm):
        self.shift_mm, self.asked = shift_mm, []

    def sample(self, quantity, sites):
        self.asked.append((quantity, np.asarray(sites)))
        x, z = np.asarray(sites).T
        at = {"stored": energy_at, "compressive_stress": stress_at, "von_mises": stress_at}[quantity]
        return np.outer(in_time(1.0), at(x - RECEPTOR_X_MM - self.shift_mm) * np.exp(-(z**2)))


def test_the_receptor_is_read_under_every_shift():
    skins = [Skin(shift) for shift in (-1.0, 0.3)]
    traces = drive_quantities.quantity_traces(skins, ("stored", "von_mises"))
    assert set(traces) == {"stored", "von_mises"}
    assert_allclose(
        traces["von_mises"].sed_kpa[-1], in_time(1.0)[-1] * stress_at(np.array([1.0, -0.3])), rtol=1e-14
    )
    assert all(site.tolist() == [[RECEPTOR_X_MM, 0.0]] for skin in skins for _, site in skin.asked)


# Starts, numbers and methods


@pytest.mark.parametrize("drivers", [*ALONE, *APART])
def test_every_drive_starts_with_the_same_largest_currents(drivers):
    driven, reference = (drive_quantities.drive_of(TRACES, each) for each in (drivers, PAPER))
    starts, usual = drive_fits.scaled_starts(driven, reference), start_points()
    for start, paper in zip(starts, usual, strict=True):
        assert_allclose(start[1] * driven.rate_kpa_per_ms.max(), paper[1] * reference.rate_kpa_per_ms.max())
        assert_allclose(start[2] * driven.sed_kpa.max(), paper[2] * reference.sed_kpa.max())
        assert_array_equal(start[[0, 3, 4, 5]], paper[[0, 3, 4, 5]])


def test_relative_numbers_are_those_that_spikes_determine():
    start = start_points()[1]
    four = identifiable(start)
    assert_allclose(
        identifiable(drive_fits.six_of_relative(np.zeros(4), start)), four * [0, 1, 1, 1], rtol=1e-12
    )
    relative = np.array([0.4, np.log(3.0), -np.log(2.0), np.log(0.5)])
    assert_allclose(
        identifiable(drive_fits.six_of_relative(relative, start)),
        [0.4 / (0.5 * four[3]), 3.0 * four[1], 0.5 * four[2], 0.5 * four[3]],
        rtol=1e-12,
    )


def test_the_unit_of_a_quantity_changes_nothing():
    """Otherwise a table by quantity would compare starts and not quantities."""
    tenfold = TRACES | {
        "compressive_stress": SedTraces(TIMES_MS, 10.0 * TRACES["compressive_stress"].sed_kpa, [50.0])
    }
    alone = Drivers("compressive_stress", "compressive_stress")
    fits = []
    for traces in (TRACES, tenfold):
        asked, start = problem(alone, traces)
        fits.append((drive_fits.quick_method().fit(asked, np.arange(24)), start))
    (usual, start), (other, scaled) = fits
    assert_allclose(other.score, usual.score, rtol=1e-9)
    assert_allclose(other.parameters, usual.parameters, rtol=1e-6, atol=1e-9)
    assert_allclose(scaled[1:3] / start[1:3], 0.1, rtol=1e-12)


class Noting:
    """A method that fits nothing and writes down what it was shown."""

    name = "noting"

    def __init__(self):
        self.shown = []

    def fit(self, asked, chosen):
        self.shown.append(tuple(chosen))
        relative = np.array([0.5, 0.1 * len(self.shown), 0.0, -0.5])
        return Fit(relative, asked.score(relative, chosen), 3, 0.0, ())


def test_left_out_stimuli_are_predicted_by_the_fold_without_them():
    asked, _ = problem(EXTENDED)
    method, folds = Noting(), interleaved_folds(24)
    judged = drive_fits.judge(asked, method)
    assert method.shown[0] == tuple(range(24))
    for fold in range(6):
        testing = np.flatnonzero(folds == fold)
        assert not set(testing) & set(method.shown[1 + fold])
        relative = np.array([0.5, 0.1 * (2 + fold), 0.0, -0.5])
        expected = np.array(asked.model.evaluate(relative))[:, testing]
        assert_array_equal(judged.left_out_hz[:, testing], expected)
        assert judged.folds[fold]["total"] == asked.score(relative, testing)
    assert judged.out_of_sample["dynamic"] == pytest.approx(np.mean([one["dynamic"] for one in judged.folds]))
    assert_array_equal(judged.predicted_hz, asked.model.evaluate(np.array([0.5, 0.1, 0.0, -0.5])))


def test_the_best_of_several_methods_is_kept_with_the_effort_of_all():
    scores = iter([0.3, 0.7, 0.5])

    class Fixed:
        name = "fixed"

        def fit(self, asked, chosen):
            return Fit(np.zeros(1), next(scores), 10, 0.0, ())

    best = BestOf((Fixed(), Fixed(), Fixed()), "three").fit(None, np.arange(2))
    assert (best.score, best.n_evaluations) == (0.7, 30)
    assert [method.name for method in thorough_method(3, 1).methods] == ["least squares", "CMA-ES"]


# What a difference is worth


def test_a_gain_that_every_shift_shares_is_certain_and_none_is_none():
    observed = np.array([RECORDINGS.dynamic_rate_hz, RECORDINGS.static_rate_hz])
    worse = 0.5 * observed
    low, high = drive_fits.gain_interval(RECORDINGS, observed, worse, np.random.default_rng(0))
    assert low == pytest.approx(0.25)
    assert high == pytest.approx(0.25)
    assert drive_fits.gain_interval(RECORDINGS, worse, worse, np.random.default_rng(0)) == (0.0, 0.0)


def test_a_gain_at_one_shift_is_uncertain_and_depends_on_the_seed_alone():
    observed = np.array([RECORDINGS.dynamic_rate_hz, RECORDINGS.static_rate_hz])
    peak = int(np.argmax(observed[1]))
    one_off = observed.copy()
    one_off[:, peak] = 0.0

    def drawn(seed):
        return drive_fits.gain_interval(RECORDINGS, observed, one_off, np.random.default_rng(seed))

    low, high = drawn(1)
    squares = observed**2
    whole = np.array([0.25, 0.75]) @ (squares[:, peak] / squares.sum(axis=1))
    assert low == 0.0  # in more than one resample of forty the shift is not drawn
    assert low < whole < high
    assert drawn(1) == (low, high) != drawn(2)


def test_information_criteria_are_those_of_normal_residuals_of_unknown_scale():
    rng = np.random.default_rng(5)
    residuals = [rng.normal(0.0, scale, 40) for scale in (1.0, 1.3)]
    squares = 200.0
    criteria = [information(1.0 - r @ r / squares, 40, 3) for r in residuals]
    minus_two_log = [-2.0 * norm.logpdf(r, scale=np.sqrt(r @ r / 40)).sum() for r in residuals]
    assert_allclose(criteria[1]["aic"] - criteria[0]["aic"], minus_two_log[1] - minus_two_log[0], rtol=1e-10)
    assert_allclose(criteria[0]["bic"] - criteria[0]["aic"], 3 * (np.log(40) - 2.0), rtol=1e-10)


# Truth


def test_the_quantity_that_made_the_rates_is_found_and_its_numbers_too(found):
    paper, stress, extended = found.candidates
    assert extended.fit.fss_in_sample > 0.995
    assert extended.fit.fss_out_of_sample > 0.98
    for other in (paper, stress):
        assert other.fit.fss_out_of_sample < extended.fit.fss_out_of_sample - 0.03
    assert extended.fit.gain_interval[0] > 0.0
    assert_allclose(list(extended.parameters.values()), FOUR_TRUE, rtol=0.1)
    assert paper.fit.gain_interval == (0.0, 0.0)


def test_results_hold_what_was_observed_and_predicted(found):
    assert_array_equal(found.observed_dynamic_rate_hz, RECORDINGS.dynamic_rate_hz)
    assert_allclose(found.shift_mm, SHIFT_MM, rtol=1e-5)
    extended = found.candidates[2]
    assert_allclose(extended.static_rate_hz, RECORDINGS.static_rate_hz, atol=2.0)
    for candidate in found.candidates:
        assert candidate.dynamic_rate_hz.size == candidate.left_out_static_rate_hz.size == SHIFT_MM.size
        assert candidate.fit.fss_folds.size == 6
        assert candidate.fit.fss_out_of_sample == pytest.approx(candidate.fit.fss_folds.mean(), rel=1e-12)
    assert found.method == "least squares"


def test_the_papers_method_fits_as_well_if_asked():
    both = drive_quantities.drive_result(
        TRACES, RECORDINGS, np.random.default_rng(0), (EXTENDED,), Noting(), with_response_surface=True
    )
    climbed = both.candidates[0].response_surface
    assert climbed.fss_in_sample > 0.9
    assert climbed.evaluations > 65
    assert both.method == "noting"


# Explanations of the dynamic rates


def patch():
    along, across = np.array(dynamic_response.ALONG_MM), np.array(dynamic_response.ACROSS_MM)
    place = along[np.newaxis, :, np.newaxis] - SHIFT_MM[:, np.newaxis, np.newaxis]
    lateral = np.exp(-(across**2))
    values = {
        "stored": np.multiply.outer(in_time(2.0), energy_at(place) * lateral),
        "compressive_stress": np.multiply.outer(in_time(1.2), stress_at(place) * lateral),
        "von_mises": np.multiply.outer(in_time(1.2), stress_at(place) * lateral),
    }
    return Patch(TIMES_MS, np.array([50.0]), along, across, values)


PATCH = patch()
NEUTRAL = {
    "offset_mm": 0.0,
    "width_along_mm": 1e-3,
    "width_across_mm": 1e-3,
    "reach_mm": 0.0,
    "exponent": 1.0,
    "time_constant_ms": 1e-9,
}
"""Numbers at which an explanation explains nothing."""


@pytest.mark.parametrize("explanation", EXPLANATIONS, ids=lambda explanation: explanation.name)
def test_every_explanation_ends_where_it_adds_nothing_in_a_model_without_it(explanation):
    numbers = np.array([NEUTRAL[added.name] for added in explanation.added])
    driven = explanation.driven(PATCH, numbers)
    dynamic = "stored"
    for words, quantity in (("compressive stress", "compressive_stress"), ("von Mises", "von_mises")):
        dynamic = quantity if words in explanation.name else dynamic
    plain_drive = PATCH.drive(PATCH.at("stored"), None if dynamic == "stored" else PATCH.at(dynamic))
    assert_allclose(driven.sed_kpa, plain_drive.sed_kpa, rtol=1e-12)
    # A filter, however fast, takes a moment: it is behind at the knots at which the rate jumps.
    settled = np.append(True, np.diff(driven.times_ms) > 0.0)
    rates = driven.rate_kpa_per_ms[settled], plain_drive.rate_kpa_per_ms[settled]
    assert_allclose(*rates, rtol=1e-6, atol=1e-12)


CHANGING = [explanation for explanation in EXPLANATIONS[1:] if not explanation.by_formula]


@pytest.mark.parametrize("explanation", CHANGING, ids=lambda explanation: explanation.name)
def test_every_explanation_changes_the_drive(explanation):
    numbers = np.array([0.3 if added.signed else added.start for added in explanation.added])
    paper, driven = PATCH.drive(PATCH.at("stored")), explanation.driven(PATCH, numbers)
    assert np.abs(driven.rate_kpa_per_ms - paper.rate_kpa_per_ms).max() > 0.01 * paper.rate_kpa_per_ms.max()


def test_the_extension_is_the_same_in_both_tables():
    by_name = {explanation.name: explanation for explanation in EXPLANATIONS}
    explained = by_name["dynamic term follows compressive stress"].driven(PATCH, np.empty(0))
    compared = drive_quantities.drive_of(
        {name: SedTraces(TIMES_MS, PATCH.at(name), [50.0]) for name in PATCH.values}, EXTENDED
    )
    assert_array_equal(explained.rate_kpa_per_ms, compared.rate_kpa_per_ms)
    assert_array_equal(explained.sed_kpa, compared.sed_kpa)


def test_a_patch_is_read_between_its_sites_and_over_clusters():
    straight = Patch(TIMES_MS, PATCH.kinks_ms, PATCH.along_mm, PATCH.across_mm, {})
    x, z = np.meshgrid(PATCH.along_mm, PATCH.across_mm, indexing="ij")
    straight.values["field"] = np.broadcast_to(3.0 + 2.0 * x + 0.5 * z, (TIMES_MS.size, 4, *x.shape))
    assert_allclose(straight.at("field", 0.537), 3.0 + 2.0 * 0.537, rtol=1e-12)
    assert_allclose(straight.at("field", 99.0), 3.0 + 2.0 * 1.5, rtol=1e-12)
    assert_allclose(straight.mean("field", 0.3), 3.0, rtol=1e-12)  # what is odd along the finger cancels
    assert_allclose(straight.largest("field", 0.4), 3.0 + 2.0 * 0.4, rtol=1e-12)
    # Across the finger both sides count: the mean by brute force over the mirrored sites.
    both = np.concatenate([-PATCH.across_mm[:0:-1], PATCH.across_mm])
    weights = np.exp(-0.5 * (both / 0.6) ** 2)
    expected = 3.0 + 0.5 * (weights * np.abs(both)).sum() / weights.sum()
    assert_allclose(straight.mean("field", 0.3, 0.6), expected, rtol=1e-12)


def test_the_patch_is_sampled_about_the_receptor():
    skins = [Skin(shift) for shift in SHIFT_MM[:3]]
    sampled = dynamic_response.sampled_patch(skins)
    place = sampled.along_mm[:, np.newaxis] - SHIFT_MM[1]
    expected = in_time(1.0)[-1] * stress_at(place) * np.exp(-(sampled.across_mm**2))
    assert_allclose(sampled.values["compressive_stress"][-1, 1], expected, rtol=1e-12)
    assert sampled.values["stored"].shape == (TIMES_MS.size, 3, 31, 7)


def test_the_filter_follows_its_differential_equation():
    driven, tau = drive(TRACES["stored"]), 17.0
    site = int(np.argmax(energy_at(SHIFT_MM)))
    ramp = (driven.times_ms <= 50.0).nonzero()[0][1:-1]  # between the jumps at onset and kink
    times, rate = driven.times_ms[ramp], driven.rate_kpa_per_ms[ramp, site]
    solved = [0.0]
    # One solution per interval: the drive has a kink at each of its times.
    for interval in pairwise(times):
        part = solve_ivp(
            lambda t, y: (np.interp(t, times, rate) - y) / tau, interval, solved[-1:], rtol=1e-10, atol=1e-14
        )
        solved.append(part.y[0, -1])
    assert_allclose(low_passed(driven, tau).rate_kpa_per_ms[ramp, site], solved, rtol=1e-9, atol=1e-13)


def test_added_numbers_keep_their_sign_and_their_limits():
    width, offset = (
        dynamic_response.Added("width_mm", 0.2, 1.5),
        dynamic_response.Added("x_mm", 0.0, 1.0, True),
    )
    assert (width.value(0.0), width.value(9.0), offset.value(-0.3), offset.value(-7.0)) == (
        0.2,
        1.5,
        -0.3,
        -1.0,
    )
    assert 0.0 < width.value(-20.0) < 1e-8


def test_rates_by_formula_are_those_of_a_steady_current():
    (explanation,) = (explanation for explanation in EXPLANATIONS if explanation.by_formula)
    model = ExplainedModel.from_start(explanation, PATCH)
    relative = np.array([0.4, 0.3, 0.2, -0.5])
    _, static_hz = model.evaluate(relative)
    b, dynamic_gain, static_gain, tau = identifiable(drive_fits.six_of_relative(relative, model.start))
    driven = PATCH.drive(PATCH.at("stored"))
    energy, rate = (
        np.interp(775.0, driven.times_ms, values[:, 7]) for values in (driven.sed_kpa, driven.rate_kpa_per_ms)
    )
    steady = tau * (b + dynamic_gain * rate + static_gain * energy)
    assert steady > 1.0
    interval_ms = 1.0 + tau * np.log(steady / (steady - 1.0))
    assert_allclose(static_hz[7], 1000.0 / interval_ms, rtol=1e-3)


def test_an_explained_model_begins_at_the_scaled_start():
    (explanation,) = (one for one in EXPLANATIONS if one.name == "offset of the receptor")
    model = ExplainedModel.from_start(explanation, PATCH)
    assert model.names[4:] == ("offset_mm",)
    assert model.n_stimuli == 24
    assert_array_equal(model.numbers(np.array([0.0, 0.0, 0.0, 0.0, 0.25])), [0.25])
    at_start = sed_driven(drive_fits.six_of_relative(np.zeros(4), start_points()[0]))
    assert_array_equal(model.evaluate(np.zeros(5)), at_start.rates(PATCH.drive(PATCH.at("stored"))))


def test_the_last_drive_is_kept_and_no_other_taken_for_it():
    (explanation,) = (one for one in EXPLANATIONS if one.name == "offset of the receptor")
    asked = []

    def driven(patch, numbers):
        asked.append(numbers.tolist())
        return explanation.driven(patch, numbers)

    model = ExplainedModel.from_start(replace(explanation, driven=driven), PATCH)
    asked.clear()
    places = ([0.1, 0.0, 0.0, 0.0, 0.25], [0.3, 0.2, 0.0, 0.0, 0.25], [0.3, 0.2, 0.0, 0.0, -0.25])
    found = [model.evaluate(np.array(place)) for place in places]
    assert asked == [[0.25], [-0.25]]
    for place, rates in zip(places, found, strict=True):
        assert_array_equal(rates, ExplainedModel.from_start(explanation, PATCH).evaluate(np.array(place)))


def test_explanations_are_scored_alike_and_listed_with_added_parameters(monkeypatch):
    def short(seed, n_added):
        return replace(drive_fits.quick_method(n_added), n_refined=1, difference_steps=(0.1,))

    monkeypatch.setattr(drive_study, "thorough_method", short)
    by_name = {explanation.name: explanation for explanation in EXPLANATIONS}
    names = ("the paper's model", "offset of the receptor", "dynamic term follows compressive stress")
    chosen = tuple(by_name[name] for name in names)
    told = []
    rows = drive_study.explained(PATCH, RECORDINGS, 0, np.random.default_rng(0), told.append, chosen)
    assert told == [row.name for row in rows] == [explanation.name for explanation in chosen]
    paper, offset, extended = rows
    assert [row.free_numbers for row in rows] == [4, 5, 4]
    assert set(offset.added) == {"offset_mm"}
    assert paper.aic_difference == paper.bic_difference == 0.0
    assert extended.aic_difference < -20.0
    assert extended.fit.fss_out_of_sample_dynamic > paper.fit.fss_out_of_sample_dynamic + 0.1
    assert offset.bic - offset.aic == pytest.approx(5 * (np.log(48) - 2.0))


# The report


@pytest.fixture(scope="module")
def section(found):
    return json.loads(to_json(found))


def test_the_figure_has_a_column_per_candidate_and_draws_what_was_found(found, section):
    figure = report.draw_drive_quantities(found)
    panels = figure.axes
    assert len(panels) == 2 * 3
    for column, candidate in enumerate(section["candidates"]):
        for row, phase in enumerate(("dynamic", "static")):
            drawn = {line.get_label(): line for line in panels[3 * row + column].get_lines()}
            assert drawn["fitted to all positions"].get_ydata().tolist() == candidate[f"{phase}_rate_hz"]
            assert drawn["observed"].get_ydata().tolist() == section[f"observed_{phase}_rate_hz"]
            left_out = drawn["not fitted to this position"].get_ydata().tolist()
            assert left_out == candidate[f"left_out_{phase}_rate_hz"]
    assert "[spikes/s]" in panels[0].get_ylabel()
    assert "[mm]" in panels[-1].get_xlabel()


def test_words_name_the_best_and_tables_hold_its_scores(found):
    best = found.candidates[2].fit
    words = report.caption_drive_quantities(found)
    assert (
        f"strain energy density, dynamic term compressive stress, FSS {best.fss_out_of_sample:.3f}" in words
    )
    (table,) = report.drive_tables(found)
    assert table.title == "By quantity, least squares"
    assert [row.cells[0] for row in table.rows][:2] == ["strain energy density", "compressive stress"]
    assert f"{best.fss_out_of_sample_dynamic:.3f}" in table.rows[2].cells
    assert table.rows[0].cells[-1] == "–"
    assert all(len(row.cells) == len(table.columns) for row in table.rows)


def explained(section, tmp_path):
    """A study with two explanations that the page shows, and a depth."""
    fit = section["candidates"][0]["fit"]
    candidates = [candidate | {"response_surface": candidate["fit"]} for candidate in section["candidates"]]
    paper = drive_study.ExplanationFit(
        name="the paper's model",
        free_numbers=4,
        added={},
        fit=drive_fits.DriveFit(**fit),
        aic=1.0,
        bic=2.0,
        aic_difference=0.0,
        bic_difference=0.0,
    )
    power = replace(
        paper,
        name="power law of the dynamic term",
        free_numbers=5,
        added={"exponent": 0.39},
        fit=drive_fits.DriveFit(**fit | {"gain_interval": (0.01, 0.2)}),
        aic_difference=-50.9,
        bic_difference=-48.6,
    )
    layer = drive_depths.LayerFit(tissue="dermis", from_mm=0.5, to_mm=1.0, largest_sed_kpa=2.0, fit=paper.fit)
    quantities = json.dumps(section | {"candidates": candidates}).encode()
    return drive_study.DriveStudy(
        quantities=from_json(drive_quantities.DriveResult, quantities),
        explanations=(paper, power),
        depths=drive_depths.DepthStudy(method="least squares", own_layer=0, layers=(layer,)),
        manifest=Runner(tmp_path).manifest(Conditions("quick", seed=3)),
    )


def test_the_page_shows_every_explanation_and_both_methods(section, tmp_path):
    result = explained(section, tmp_path)
    page = drives_report.drives_page(result)
    text = write_markdown(page, tmp_path / "drives.md").read_text(encoding="utf-8")
    assert f"`python -m studies drives` on {result.manifest.started[:10]}" in text
    assert "quick resolution, seed 3" in text
    assert "## By quantity, response surface" in text
    assert "| power law of the dynamic term | 5 | exponent 0.39 |" in text
    assert "| +0.010 … +0.200 | −50.9 | −48.6 |" in text
    assert "| dermis | 0.50 | 1.00 | 2.00 |" in text
    assert len(page.drawings) == 3
    for drawing in page.drawings:
        assert f"](images/{drawing.name}.png)" in text
        assert (tmp_path / "images" / f"{drawing.name}.png").read_bytes() == with_palette(png(drawing.draw))


def test_explanations_are_drawn_by_what_they_predict_and_gain(section, tmp_path):
    result = explained(section, tmp_path)
    scores, gains = drives_report.draw_explanations(result).axes
    drawn = {line.get_label(): line.get_xdata().tolist() for line in scores.get_lines()}
    rows = result.explanations
    assert drawn["both, weighted"] == [row.fit.fss_out_of_sample for row in rows]
    assert drawn["dynamic rates"] == [row.fit.fss_out_of_sample_dynamic for row in rows]
    assert [label.get_text() for label in scores.get_yticklabels()][1] == "power law of the dynamic term (5)"
    (intervals,) = gains.collections
    assert [path[:, 0].tolist() for path in intervals.get_segments()] == [[0.0, 0.0], [0.01, 0.2]]
    said = drives_report.caption_explanations(result)
    assert "Smallest AIC: power law of the dynamic term; 0 more" in said


def test_numbers_that_a_run_does_not_have_are_dashes(section):
    def emptied(value):
        if isinstance(value, dict):
            return {key: item if key == "shift_mm" else emptied(item) for key, item in value.items()}
        if isinstance(value, list):
            return [emptied(item) for item in value]
        return None if isinstance(value, float) else value

    empty = from_json(drive_quantities.DriveResult, json.dumps(emptied(section)).encode())
    assert png(report.draw_drive_quantities, empty)
    (table,) = report.drive_tables(empty)
    assert set(table.rows[1].cells[1:]) == {"–", "– … –"}
    assert "FSS –" in report.caption_drive_quantities(empty)


def test_a_drive_that_is_filtered_keeps_the_rest():
    driven = Drive([0.0, 10.0], [[0.0], [1.0]], [[0.1], [0.1]], "work")
    filtered = low_passed(driven, 5.0)
    assert_array_equal(filtered.sed_kpa, driven.sed_kpa)
    assert filtered.dynamic_quantity == "work"
