"""Discrimination tasks of a user: hit rates of codes on known skins, refused tasks, and written files."""

import hashlib
import json
import re
from dataclasses import replace
from functools import partial
from pathlib import Path

import numpy as np
import pytest
from scipy.special import ndtri
from scipy.stats import binom

import fingerpad as fp
from fingerpad import InputError, Traces, cli
from fingerpad.core.result_files import to_json
from fingerpad.experiments import runner
from fingerpad.experiments.conditions import RECEPTOR_X_MM
from fingerpad.experiments.discrimination import analysis
from fingerpad.experiments.discrimination.analysis import SESSION, analyse, forced_choice_of, side_curves
from fingerpad.experiments.discrimination.request import CurveSettings
from fingerpad.experiments.examples import tasks
from fingerpad.psychophysics.encoding import gradient_sum, neighbour_pairs, taking_part
from fingerpad.psychophysics.ideal_observer import efficiency, noisy_presentations
from fingerpad.psychophysics.observer import EuclideanDistance, Experiment, GradientSum, discriminate_by
from fingerpad.report import percept as report
from fingerpad.report.results import task_sentences
from refusals import misused

ROOT = Path(__file__).parents[1]
read = fp.DiscriminationRequest.read
QUESTION = {
    "question": "Which bumps?",
    "tissues": "trial3",  # whose afferent follows energy density
    "object": {"kind": "sphere"},
    "stimuli": {"vary": "object.curvature_per_m", "values": [200, 220, 240, 280, 320]},
    "standard": 200,
    "afferents": {"rows": 4, "columns": 4},
    "code": ["gradient_sum", "euclidean"],
    "measure": ["static", "dynamic", "latency"],
    "noise": 0.1,
    "experiment": {"seed": 5, "distributions": 20, "hit_rates": 50},
}


class Bump:
    """A skin that a sphere has pressed: the more it is curved, the higher and narrower its energy density."""

    caveats = ()

    def __init__(self, curvature_per_m, peak_kpa=3.0):
        self.peak_kpa = peak_kpa * curvature_per_m / 200.0
        self.width_mm = 2.0 * np.sqrt(200.0 / curvature_per_m)

    def sed(self, sites, dynamic_quantity="stored", static_quantity="stored"):
        squared = np.square(np.asarray(sites)[:, [0, -1]] - [RECEPTOR_X_MM, 0.0]).sum(axis=1)
        peaks = self.peak_kpa * np.exp(-squared / self.width_mm**2)
        return Traces([0.0, 50.0, 1000.0], np.outer([0.0, 1.0, 0.9], peaks), kinks_ms=[50.0])


class NearOnly(Bump):
    """A skin that holds nothing beyond 2 mm."""

    def sed(self, sites, dynamic_quantity="stored", static_quantity="stored"):
        far = np.linalg.norm(np.asarray(sites)[:, [0, -1]] - [RECEPTOR_X_MM, 0.0], axis=1) >= 2.0
        return super().sed(sites).scaled(np.where(far, 1e-6, 1.0))


def asked(**parts):
    return read(QUESTION | parts)


def bumps(question, **more):
    return {stimulus.name: Bump(stimulus.indenter.curvature_per_m, **more) for stimulus in question.pressed}


@pytest.fixture(scope="module")
def answered():
    question = asked()
    return analyse(question, bumps(question))


def decoding(section, code, measure):
    return next(one for one in section.decodings if (one.code, one.measure) == (code, measure))


def test_hit_rates_are_those_of_the_observers_with_the_questions_own_numbers(answered):
    question = asked()
    names = [(one.code, one.measure) for one in answered.decodings]
    assert names == [(code, measure) for measure in QUESTION["measure"] for code in QUESTION["code"]]
    assert (answered.stimulus, answered.axis) == (("200", "220", "240", "280", "320"), "curvature [1/m]")
    static = np.array(answered.responses["static"])
    alone = [question.population.respond(skin).static_rate_hz for skin in bumps(question).values()]
    np.testing.assert_array_equal(static, alone)
    plan = Experiment(distributions=20, hit_rates=50)
    neighbours = neighbour_pairs(question.population.positions_mm, 1.0)
    sums = discriminate_by(GradientSum(neighbours), static, 0.1, 5, plan, session=SESSION)
    distances = discriminate_by(EuclideanDistance(), static, 0.1, 5, plan, session=SESSION)
    for code, expected in (("gradient_sum", sums), ("euclidean", distances)):
        found = decoding(answered, code, "static")
        np.testing.assert_array_equal(found.hit_rate, expected.hit_rate)
        np.testing.assert_array_equal(found.hit_rate_sd, expected.hit_rate_sd)
        assert (np.diff(found.statistic.mean) > 0.0).all()
        assert (found.statistic.sd > 0.0).all()


def test_spikes_after_the_waiting_time_count_as_the_waiting_time():
    def latest_ms(patience_ms):
        question = asked(measure="latency", code="gradient_sum", latest_ms=patience_ms)
        return np.max(analyse(question, bumps(question, peak_kpa=0.3)).responses["latency"])

    assert latest_ms(40) == 40.0
    assert 50.0 < latest_ms(900) < 900.0


def test_who_is_silent_under_one_stimulus_has_no_latency_under_any():
    question = asked(measure="latency")
    skins = bumps(question)
    distance_mm = np.linalg.norm(question.population.positions_mm - [RECEPTOR_X_MM, 0.0], axis=1)
    near = distance_mm < 2.0
    assert 0 < near.sum() < 16
    skins["240"] = NearOnly(240.0)
    found = analyse(question, skins)
    assert np.isnan(found.responses["latency"]).sum() == 16 - near.sum()
    inner = decoding(found, "gradient_sum", "latency").statistic.mean
    all_of_them = decoding(analyse(question, bumps(question)), "gradient_sum", "latency").statistic.mean
    assert (inner < all_of_them).all()  # the outer ones, which fire late, are left out
    colours = report.draw_task_responses(found).axes[0].collections[0]
    standard = found.responses["latency"][0]
    assert colours.get_clim() == (np.nanmin(standard), np.nanmax(standard))


@pytest.mark.parametrize("code", ["gradient_sum", "euclidean"])
def test_fitted_noise_meets_the_hit_rates_of_a_known_observer(code):
    known = asked(noise=0.13, code=code, measure="static", experiment={"seed": 5})
    rates = analyse(known, bumps(known)).decodings[0].hit_rate
    points = [{"at": 220, "hit_rate": float(rates[0])}, {"at": 320, "hit_rate": float(rates[3])}]
    points.append({"at": 999, "hit_rate": 0.9})  # not pressed: drawn, not fitted
    question = asked(noise="fitted", code=code, measure="static", observed={"points": points})
    noise = analyse(question, bumps(question)).noise
    assert noise.sigma == pytest.approx(0.13, rel=0.05)
    assert noise.fitted_to.stimulus == ("220", "320")
    assert (noise.fitted_to.code, noise.fitted_to.measure) == (code, "static")


def test_observed_points_have_a_binomial_interval_where_trials_are_known():
    points = [{"at": "220", "hit_rate": 0.6, "trials": 50}, {"at": 250, "hit_rate": 0.7}]
    question = asked(observed={"points": points}, measure="static", code="gradient_sum")
    observed = analyse(question, bumps(question)).observed
    assert [point.level for point in observed.points] == [220.0, 250.0]
    low, high = observed.points[0].interval
    # Clopper and Pearson: so few, or so many, hits of 50 have a chance of 2.5 % there.
    assert binom.sf(29, 50, low) == pytest.approx(0.025, rel=1e-9)
    assert binom.cdf(30, 50, high) == pytest.approx(0.025, rel=1e-9)
    assert observed.points[1].interval is None


def weibull(difference, at_75, steepness):
    return 1.0 - 0.5 * 0.5 ** ((np.asarray(difference) / at_75) ** steepness)


def test_a_curve_finds_a_known_threshold_on_either_side_of_the_standard():
    levels = [100.0, 104.0, 108.0, 112.0, 120.0, 97.0, 94.0, 88.0]
    difference = np.abs(np.array(levels[1:]) - 100.0)
    rates = weibull(difference, 8.0, 1.5)
    above, below = side_curves(levels, rates, 2000, CurveSettings(), seed=1)
    assert (above.side, below.side) == ("above", "below")
    np.testing.assert_array_equal(above.difference, [4.0, 8.0, 12.0, 20.0])
    np.testing.assert_array_equal(below.difference, [3.0, 6.0, 12.0])
    for side, sign in ((above, 1.0), (below, -1.0)):
        threshold = side.fit.threshold
        assert threshold.difference == pytest.approx(8.0, abs=0.15)
        assert threshold.level == pytest.approx(100.0 + sign * 8.0, abs=0.15)
        assert threshold.over_standard == pytest.approx(0.08, abs=0.0015)
        for kind in ("bootstrap", "posterior"):
            low, high = getattr(threshold, f"{kind}_interval")
            assert low < threshold.difference < high
        curve = side.fit.curve
        np.testing.assert_allclose(curve.proportion, weibull(curve.difference, 8.0, 1.5), atol=0.01)
        assert (curve.low <= curve.proportion).all()
        assert (curve.high >= curve.proportion).all()


def test_more_trials_narrow_the_interval_as_their_root():
    levels, rates = [0.0, 4.0, 8.0, 12.0, 20.0], weibull([4.0, 8.0, 12.0, 20.0], 8.0, 1.5)
    found = [side_curves(levels, rates, trials, CurveSettings(), seed=1) for trials in (100, 1600)]
    few, many = (sides[0].fit.threshold for sides in found)
    ratio = np.diff(few.posterior_interval) / np.diff(many.posterior_interval)
    assert ratio[0] == pytest.approx(4.0, rel=0.25)
    assert few.over_standard is None  # of nothing
    (one,) = side_curves([1.0, 2.0], np.array([0.8]), 100, CurveSettings(), seed=1)
    assert one.why_not.startswith("A curve needs two comparisons on a side of the standard or more: got 1")
    (low,) = side_curves([0.0, 1.0, 2.0], np.array([0.5, 0.5]), 100, CurveSettings(), seed=1)
    assert "threshold" in low.why_not


def test_stimuli_without_levels_have_hit_rates_and_no_curve():
    named = (("blunt", 200), ("sharp", 300))
    listed = [{"name": name, "object": {"curvature_per_m": per_m}} for name, per_m in named]
    question = asked(stimuli=listed, standard="blunt", measure="static")
    found = analyse(question, bumps(question))
    assert found.level is None
    assert [one.curves for one in found.decodings] == [(), ()]
    for draw in (report.draw_task_curves, report.draw_task_statistics, report.draw_task_responses):
        (*_, last) = draw(found).axes
        assert last.get_figure()


def test_two_stimuli_give_a_forced_choice_and_no_missing_threshold():
    """Proportion correct is the area under the ROC of the code's statistic; trials give the interval."""
    two = {"vary": "object.curvature_per_m", "values": [200, 220]}
    question = asked(stimuli=two, measure="static", code=["gradient_sum", "ideal"])
    found = analyse(question, bumps(question))
    for decoding in found.decodings:
        assert decoding.curves == ()
        choice = decoding.forced_choice
        proportion, low, high = choice.proportions[:, 0]
        trials = question.experiment.trials
        assert choice.trials == trials
        assert 0.5 < low < proportion < high < 1.0
        # As many correct answers as observed, or more, have a probability of 2.5 % at the lower end.
        correct = round(proportion * trials)
        assert binom.sf(correct - 1, trials, low) == pytest.approx(0.025, abs=1e-6)
        assert binom.cdf(correct, trials, high) == pytest.approx(0.025, abs=1e-6)
        np.testing.assert_allclose(choice.d_primes[:, 0], np.sqrt(2.0) * ndtri([proportion, low, high]))
        assert choice.d_primes[0] == pytest.approx(decoding.d_prime)
    measured = taking_part(found.responses["static"], question.neighbours)
    (presented,) = noisy_presentations(measured.responses, 0.1, question.experiment.seed, session=2)
    sums = [gradient_sum(each, measured.neighbours) for each in (presented.standard, presented.comparison)]
    greater = (sums[1][:, None] > sums[0]).mean()
    proportion = found.decodings[0].forced_choice.proportions[0, 0]
    assert proportion == pytest.approx(max(greater, 1 - greater), abs=1e-9)
    said = task_sentences(found)
    assert re.search(r"correct in \d+ % of trials \(\d+ % … \d+ %\)", said[1])
    assert "threshold" not in " ".join(said)
    assert report.rows_of_task_thresholds(found) == []
    correct = report.rows_of_comparisons(found)[0][3]
    assert correct == f"{found.decodings[0].forced_choice.proportions[0, 0]:.3f}"


def test_a_certain_answer_has_no_finite_d_prime_and_no_noise_no_forced_choice():
    choice = forced_choice_of(np.array([np.inf, 0.0]), trials=100)
    assert choice.proportions[:, 0].tolist() == [1.0, pytest.approx(0.025**0.01), 1.0]
    assert np.isnan(choice.d_primes[[0, 2], 0]).all()
    assert choice.d_primes[1, 0] > 2.0
    assert choice.d_primes[0, 1] == 0.0
    question = asked(noise=0)
    for one in analyse(question, bumps(question)).decodings:
        assert (np.array(one.hit_rate) == 1.0).all()
        assert one.forced_choice is one.efficiency is None
        assert all(side.fit is None for side in one.curves)


def test_curves_show_every_code_people_with_their_intervals_and_thresholds():
    points = [{"at": 220, "hit_rate": 0.6, "trials": 50}, {"at": 300, "hit_rate": 0.9}]
    question = asked(
        code=["gradient_sum", "ideal"], measure="static", observed={"points": points, "source": "two people"}
    )
    found = analyse(question, bumps(question))
    figure = report.draw_task_curves(found)
    labels = [text.get_text() for text in figure.legends[0].get_texts()]
    assert sorted(labels) == ["Gradient Sum", "ideal observer", "observed (two people)"]
    (axes,) = figure.axes
    drawn = {tuple(np.round(line.get_xdata(), 6)) for line in axes.lines}
    assert (220.0, 220.0) in drawn  # the interval of the first point
    assert (300.0, 300.0) not in drawn
    for code in ("gradient_sum", "ideal"):
        level = round(decoding(found, code, "static").curves[0].fit.threshold.level, 6)
        assert (level, level) in drawn
    table = {cells[0]: cells for cells in report.rows_of_task_thresholds(found)}
    threshold = decoding(found, "gradient_sum", "static").curves[0].fit.threshold
    assert table["Gradient Sum, static rate"][3] == f"{threshold.difference:.3g}"


def test_no_code_beats_the_ideal_observer_and_what_it_makes_use_of_is_a_share():
    question = asked(noise=0.2, code=["gradient_sum", "euclidean", "ideal"], measure=["static", "latency"])
    found = analyse(question, bumps(question))
    for measure in ("static", "latency"):
        codes = [decoding(found, code, measure) for code in ("gradient_sum", "euclidean")]
        ideal = decoding(found, "ideal", measure)
        assert (np.diff(ideal.hit_rate) > -0.02).all()
        for code in codes:
            assert (np.array(code.d_prime) < ideal.d_prime).all()
            assert (np.array(code.hit_rate) < ideal.hit_rate + 0.02).all()
            shares = np.square(np.divide(code.d_prime, ideal.d_prime))
            np.testing.assert_allclose(np.array(code.efficiency, dtype=float), shares, rtol=1e-12)
            assert all(0.0 < error < 0.1 for error in code.efficiency_error)


def test_where_the_ideal_observer_never_fails_there_is_no_efficiency():
    table = np.array([[50.0, 60.0], [150.0, 10.0]])
    (shown,) = noisy_presentations(table, 0.01, seed=3)
    found = shown.of(lambda responses: gradient_sum(responses, np.array([[0, 1]])))
    assert np.isnan(efficiency(found, shown.ideal())).all()


def test_a_population_that_stays_silent_has_no_hit_rate_and_no_fitted_noise():
    question = asked()
    with pytest.raises(InputError, match=r"is silent: by static or dynamic or latency none of its 16 "):
        analyse(question, bumps(question, peak_kpa=0.01))
    observed = {"points": [{"at": 320, "hit_rate": 0.9}]}
    question = asked(noise="fitted", measure=["dynamic", "static"], observed=observed)
    with pytest.raises(InputError, match=r"noise cannot be fitted: by the measure dynamic .* 220"):
        analyse(question, bumps(question) | {"220": Bump(200.0, peak_kpa=0.2)})


def test_silence_under_one_stimulus_is_silence_of_that_measure_alone():
    # The bluntest bump is too low for two spikes in the ramp, but not in the hold.
    question = asked(code="gradient_sum", measure=["dynamic", "static"], standard=320)
    skins = bumps(question) | {"200": Bump(200.0, peak_kpa=0.2)}
    found = analyse(question, skins)
    dynamic, static = found.decodings
    assert (dynamic.silent, dynamic.hit_rate) == (("200",), None)
    assert static.silent == ()
    assert len(static.hit_rate) == 4
    assert report.rows_of_comparisons(found)[0][1] == "silent under 200"
    assert report.draw_task_curves(found)
    assert task_sentences(found)[0].startswith("Gradient Sum of static rates discriminates")


@pytest.fixture
def call(monkeypatch, run_program):
    """Run the command in an empty folder; indentations take no time."""
    monkeypatch.setattr(runner, "solve_missing", lambda *_: None)

    def pressed(self, touch):
        skin = Bump(touch.indenter.curvature_per_m)
        skin.mesh = touch.mesh
        skin.force_imbalance = skin.energy_imbalance = 0.0
        skin.linear_solver = "none"
        return skin

    monkeypatch.setattr(runner.Store, "load", pressed)
    return partial(run_program, cli.main, "fingerpad", "discriminate")


# JSON is YAML.
QUICK = {"resolution": "quick"}
MINE = json.dumps(QUESTION | QUICK | {"code": "gradient_sum", "measure": "static"})


def test_an_answer_is_a_page_figures_and_numbers_with_their_origin(call, tmp_path):
    (tmp_path / "mine.yaml").write_text(MINE)
    status, said, errors = call("mine.yaml", "--jobs", "1")
    assert (status, errors) == (0, "")
    results = json.loads((tmp_path / "discriminate" / "discriminate.json").read_text())
    section, manifest = results["discrimination"], results["manifest"]
    lines = said.splitlines()
    assert lines[0].startswith("Gradient Sum of static rates discriminates 220 from 200 in ")
    assert lines[-2:] == ["Report: discriminate/discriminate.html", "Results: discriminate/discriminate.json"]
    pictures = {f"figures/{name}.png" for name in ("curves", "responses", "statistics")}
    folder = tmp_path / "discriminate"
    files = {str(path.relative_to(folder)) for path in folder.rglob("*.*")}
    assert files == {"discriminate.html", "discriminate.json", *pictures}
    assert manifest["command"] == "fingerpad discriminate mine.yaml --jobs 1"
    assert manifest["inputs"] == {"mine.yaml": hashlib.sha256(MINE.encode()).hexdigest()}
    assert (manifest["seed"], manifest["resolution"], manifest["materials"]) == (5, "quick", "trial3")
    assert results["task"]["stimuli"]["values"] == [200.0, 220.0, 240.0, 280.0, 320.0]
    again = read(results["task"])  # what was asked can be asked again
    assert again == read("mine.yaml")
    assert again.touches == read("mine.yaml").touches
    page = (tmp_path / "discriminate" / "discriminate.html").read_text()
    assert "<h1>Which bumps?</h1>" in page
    assert page.count("data:image/png;base64,") == 3
    threshold = section["decodings"][0]["curves"][0]["fit"]["threshold"]
    assert f"<td>{threshold['difference']:.3g}</td>" in page


def test_the_same_seed_gives_the_same_numbers_and_another_others():
    def answer(seed):
        question = asked(measure="static", experiment={"seed": seed, "distributions": 20})
        return analyse(question, bumps(question))

    first, again, other = answer(5), answer(5), answer(6)
    assert to_json(first) == to_json(again)
    np.testing.assert_array_equal(first.responses["static"], other.responses["static"])
    for ours, theirs in zip(first.decodings, other.decodings, strict=True):
        assert (ours.hit_rate != theirs.hit_rate).any()
        intervals = [one.curves[0].fit.threshold.bootstrap_interval for one in (ours, theirs)]
        assert intervals[0] != intervals[1]


def test_an_example_task_runs_by_name_or_as_a_file_of_ones_own(call, tmp_path, answered, monkeypatch):
    def known(task, skins):
        return replace(answered, question=task.question, axis=", ".join(skins))

    monkeypatch.setattr(analysis, "analyse", known)
    assert call("sphere_curvature", "--resolution", "quick", "--out", "named")[0] == 0
    (tmp_path / "mine.yaml").write_text(tasks()["sphere_curvature"])
    assert call("mine.yaml", "--resolution", "quick", "--out", "own")[0] == 0
    named, own = (json.loads((tmp_path / one / "discriminate.json").read_text()) for one in ("named", "own"))
    assert named["discrimination"] == own["discrimination"]
    assert named["discrimination"]["axis"] == "287, 296, 305, 316, 328, 340, 365"
    assert [*named["manifest"]["inputs"].values()] == [*own["manifest"]["inputs"].values()]
    assert named["manifest"]["resolution"] == "quick"


@pytest.mark.parametrize(
    ("arguments", "said"),
    [
        ([], "discriminate needs a file or options"),
        (["none.yaml"], "none.yaml must be a file that can be read"),
        (["bumps"], "bumps must be a YAML file or one of the example tasks"),
        (["bad.yaml"], "bad.yaml, line 1, standard must be one of the stimuli"),
        (["broken.yaml"], "broken.yaml cannot be read as YAML"),
        (["empty.yaml"], "empty.yaml, the file is empty"),
        (["mine.yaml", "--jobs", "0"], "jobs must be a whole number of at least 1"),
        (["mine.yaml", "--resolution", "high"], "resolution must be one of quick"),
        (["mine.yaml", "--out", "mine.yaml"], "--out must be a writable folder"),
    ],
    ids=lambda value: " ".join(value) if isinstance(value, list) else "",
)
def test_bad_input_is_one_sentence_and_status_2_and_nothing_is_written(call, tmp_path, arguments, said):
    files = {
        "mine.yaml": MINE,
        "bad.yaml": MINE.replace('"standard": 200', '"standard": 201'),
        "broken.yaml": "question: [",
        "empty.yaml": "",
    }
    for name, text in files.items():
        (tmp_path / name).write_text(text)
    misused(call(*arguments), said)
    assert {path.name for path in tmp_path.iterdir()} == set(files)
