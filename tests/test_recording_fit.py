"""Fit to recordings of a user: recovery of known parameters, then reports, errors and files."""

import hashlib
import json
import re
import shlex
import subprocess
import sys
from dataclasses import replace
from functools import partial
from pathlib import Path
from types import SimpleNamespace

import numpy as np
import pytest

import fingerpad as fp
from fingerpad import cli
from fingerpad.core.compilation import SHORT_NOTICE, SUBJECT
from fingerpad.core.random_streams import Presentations
from fingerpad.data import bar_firing_rates
from fingerpad.experiments import runner
from fingerpad.experiments.conditions import RECEPTOR_X_MM, Conditions
from fingerpad.experiments.examples import examples
from fingerpad.experiments.fit import fit as study
from fingerpad.experiments.fit import likelihoods as recording_posterior
from fingerpad.experiments.fit import request
from fingerpad.experiments.fit.fit import check_spikes
from fingerpad.experiments.fit.likelihoods import rate_posterior
from fingerpad.experiments.fit.results import (
    CredibleInterval,
    ParameterProfile,
    PhasePrediction,
    PosteriorConvergence,
    RatePosterior,
)
from fingerpad.experiments.recording_files import read_recordings
from fingerpad.experiments.requests.afferents import fitted_afferent
from fingerpad.experiments.requests.stimuli import ListedStimuli, NamedStimulus, ShiftedBar
from fingerpad.inference.afferent_fit import OFFSETS_MM
from fingerpad.inference.fitting.methods import interleaved_folds
from fingerpad.inference.identifiable import IDENTIFIABLE_NAMES, identifiable
from fingerpad.inference.rate_model import AfferentModel, closed_form_rates
from fingerpad.inference.recordings import SpikeRecordings
from fingerpad.inference.spike_likelihood import soft_spikes
from fingerpad.neuron.afferent import type_of
from fingerpad.neuron.spikes import PAPER_WINDOWS_MS
from fingerpad.neuron.transduction import drive
from fingerpad.report import nerve as report
from fingerpad.report.results import summary
from refusals import misused, refusals
from report_rows import table_of
from sections import sed_driven

ROOT = Path(__file__).parents[1]
KNOWN = [2e-7, 1.2e-4, 9e-7, 60.0, 1e-6, 50.0]
AFFERENT = sed_driven(KNOWN)
TIMES_MS = np.array([0.0, 10.0, 20.0, 30.0, 40.0, 50.0, 60.0, 80.0, 120.0, 200.0, 400.0, 700.0, 1000.0])


def traces(height_kpa, times_ms=TIMES_MS, **more):
    """Energy density that rises with the square of time in 50 ms and relaxes by a third, one column each."""
    ramp = np.minimum(times_ms / 50.0, 1.0) ** 2
    relaxed = 1.0 - 0.3 * (1.0 - np.exp(-np.maximum(times_ms - 50.0, 0.0) / 300.0))
    return fp.Traces(times_ms, np.outer(ramp * relaxed, height_kpa), kinks_ms=[50.0], **more)


N = 10
HEIGHT_KPA = np.linspace(0.6, 3.0, N)
SED = traces(HEIGHT_KPA)
NAMES = tuple(f"height {number}" for number in range(N))
RATES = fp.RateRecordings(NAMES, *AFFERENT.rates(SED), "simulated")


@pytest.fixture(scope="module")
def recovered():
    """The fit to rates of a known afferent."""
    return study.fit_recordings(SED, RATES, np.arange(N) % 2)


def test_rates_of_a_known_afferent_are_recovered_in_and_out_of_sample(recovered):
    assert recovered.fss_in_sample > 0.9999
    assert recovered.fss_out_of_sample > 0.998
    np.testing.assert_allclose(recovered.phases["static"].fitted_hz, RATES.static_rate_hz, rtol=0, atol=1.0)
    _, dynamic_gain, static_gain, _ = recovered.identifiable.values()
    # The intercept and tau trade off along a valley; the gains do not.
    np.testing.assert_allclose([dynamic_gain, static_gain], identifiable(KNOWN)[1:3], rtol=0.05)


@pytest.mark.parametrize(
    ("method", "fss"), [("response_surface", 0.99), ("closed_form", 0.995), ("cma_es", 0.9999)]
)
def test_every_method_recovers_them(method, fss):
    fitted = study.fit_recordings(SED, RATES, np.arange(N) % 2, method=method)
    assert fitted.method == method
    assert fitted.fss_in_sample > fss
    assert fitted.fss_out_of_sample > 0.98
    np.testing.assert_allclose(fitted.identifiable["dynamic_gain_per_kpa"], 2.4, rtol=0.05)


def test_one_phase_is_enough_for_a_fit_and_the_other_is_reported_missing():
    fitted = study.fit_recordings(SED, fp.RateRecordings(NAMES, None, RATES.static_rate_hz), np.arange(N) % 2)
    assert fitted.fss_in_sample == fitted.phases["static"].fss_in_sample > 0.99
    assert fitted.phases["dynamic"].observed_hz is None
    assert fitted.phases["dynamic"].fss_in_sample is None


def test_noisy_rates_leave_a_posterior_that_holds_the_known_afferent():
    noise = np.random.default_rng(4).normal(0.0, 1.0, (2, N))
    noisy = fp.RateRecordings(NAMES, *np.maximum(AFFERENT.rates(SED) + noise, 0.0))
    model, known = AfferentModel.of_traces(SED), identifiable(KNOWN)
    few = {"n_ensembles": 2, "n_walkers": 32, "largest_r_hat": 1.1, "smallest_effective_size": 50.0}
    drawn = rate_posterior(model, noisy, known, 1, **few)
    for value, found in zip(known, drawn.numbers.values(), strict=True):
        assert found.low < value < found.high
    gain = drawn.numbers["static_gain_per_kpa_ms"]
    assert 0.0 < gain.high - gain.low < known[2]
    band = drawn.rates["static"]
    width, new = band.high_hz - band.low_hz, band.new_high_hz - band.new_low_hz
    assert (width >= 0.0).all()
    # A new recording has a residual of its own: its band is the wider one, nearly everywhere.
    assert (new > width).mean() > 0.9


def some_posterior(low, high):
    """A posterior of four numbers with the same interval, and of static rates from 1 to 90."""
    measures = dict.fromkeys(PosteriorConvergence.__dataclass_fields__, 1)
    one, rates = CredibleInterval(median=0.5 * (low + high), low=low, high=high), [1.0] * N
    band = dict.fromkeys(("observed_hz", "median_hz", "low_hz", "new_low_hz"), rates)
    band |= {"high_hz": [90.0] * N, "new_high_hz": [99.0] * N, "share_within_new": 1.0}
    band |= {"residual_deviation_hz": one, "residual_length_mm": one, "probability_of_independence": 0.5}
    return RatePosterior(
        level=0.95, seed=5, numbers=dict.fromkeys(IDENTIFIABLE_NAMES, one), covariance=np.eye(4),
        convergence=PosteriorConvergence(**measures), rates={"static": PhasePrediction(**band)},
    )  # fmt: skip


def test_a_posterior_is_part_of_the_fit_and_of_its_page(recovered, monkeypatch):
    asked = []
    drawn = some_posterior(1.0, 2.0)
    monkeypatch.setattr(recording_posterior, "rate_posterior", lambda *given: asked.append(given) or drawn)
    fitted = study.fit_recordings(
        SED, RATES, np.arange(N) % 2, seed=5, with_posterior=True, positions_mm=range(N)
    )
    ((model, rates, four, seed, positions),) = asked
    assert (model.n_stimuli, rates, seed, list(positions)) == (N, RATES, 5, list(range(N)))
    assert four.tolist() == list(fitted.identifiable.values())
    assert fitted.posterior is drawn
    assert recovered.posterior is None
    assert table_of("fit", "The four", fitted).rows[0].cells[3] == "1 … 2"
    with_band, without = (report.draw_fit(fit).axes[1].collections for fit in (fitted, recovered))
    assert len(with_band) == len(without) + 1


def test_a_soft_threshold_is_recovered_from_its_spikes_within_their_information():
    true = np.array([0.004, 2.4, 0.03, 40.0, 0.2])
    presentations = Presentations.of_one_afferent(N, 3)
    trains = soft_spikes(drive(SED), true, presentations, seed=3)
    recordings = SpikeRecordings(tuple(NAMES[site] for site in presentations.sites), trains, 1000.0)
    fitted = study.fit_recordings(SED, recordings, np.arange(N) % 2, method="likelihood")
    spikes = fitted.spikes
    found = [*fitted.identifiable.values(), spikes.escape_width]
    errors = [*fitted.identifiable_standard_error.values(), spikes.escape_width_standard_error]
    assert (np.abs(found - true) < 2.6 * np.array(errors)).all()  # 99 % of each
    assert (np.array(errors) < [0.01, 0.2, 0.002, 20.0, 0.02]).all()
    assert spikes.n_spikes == trains.times_ms.size
    # Out of sample it can only be worse, by about one for every parameter of each fold.
    assert 0.0 < spikes.log_likelihood - spikes.log_likelihood_out_of_sample < 20.0
    assert spikes.time_rescaling_p_value > 0.01
    assert fitted.fss_out_of_sample > 0.97
    shown = table_of("fit", "Fit of a soft threshold", fitted).rows[0].cells
    assert shown == ("spikes", f"{spikes.n_spikes}")


def test_regular_trains_advise_what_the_fit_has():
    """One train per stimulus that an afferent without noise fires: no width of the threshold is likeliest."""
    regular = SpikeRecordings(NAMES, AFFERENT.spikes(SED), 1000.0)
    with pytest.raises(
        fp.ConvergenceError, match="more than once, or choose another method, such as least_squares"
    ):
        study.fit_recordings(SED, regular, np.arange(N) % 2, method="likelihood")


def test_every_stimulus_is_predicted_without_its_fold(recovered):
    assert recovered.stimulus == NAMES
    assert recovered.fold.tolist() == [1, 2] * (N // 2)
    assert [fold.stimuli for fold in recovered.folds] == [NAMES[::2], NAMES[1::2]]
    for fold in recovered.folds:
        rows = np.flatnonzero(np.array(recovered.fold) == fold.fold)
        predicted = sed_driven(list(fold.parameters.values())).rates(SED)
        for phase, rates in zip(("dynamic", "static"), predicted, strict=True):
            found = np.array(recovered.phases[phase].out_of_sample_hz)
            np.testing.assert_array_equal(found[rows], rates[rows])
    scores = [fold.fss_test for fold in recovered.folds]
    assert recovered.fss_out_of_sample == pytest.approx(np.mean(scores), rel=1e-12)
    six, four = list(recovered.parameters.values()), list(recovered.identifiable.values())
    np.testing.assert_allclose(identifiable(six), four, rtol=1e-12)
    assert recovered.identifiable_covariance is None  # two folds
    assert np.isnan(list(recovered.identifiable_standard_error.values())).all()


def test_standard_errors_are_the_scatter_of_the_folds(call, tmp_path):
    (tmp_path / "mine.csv").write_text(ROWS)
    assert call("mine.csv", "--stimuli", "bar", "--folds", "5")[0] == 0
    fit = json.loads((tmp_path / "fit" / "fit.json").read_text())["fit"]
    fours = np.array([list(fold["identifiable"].values()) for fold in fit["folds"]])
    expected = 4 / 5 * sum(np.outer(apart, apart) for apart in fours - fours.mean(axis=0))
    np.testing.assert_allclose(fit["identifiable_covariance"], expected, rtol=1e-9, atol=1e-300)
    errors = list(fit["identifiable_standard_error"].values())
    np.testing.assert_allclose(errors, np.sqrt(np.diag(expected)), rtol=1e-9)


def test_six_folds_are_dealt_out_by_default_and_one_per_stimulus_where_there_are_fewer():
    assert interleaved_folds(14).tolist() == [0, 1, 2, 3, 4, 5, 0, 1, 2, 3, 4, 5, 0, 1]
    assert interleaved_folds(4).tolist() == [0, 1, 2, 3]


def test_stimuli_that_move_in_their_own_time_are_answered_each_in_theirs():
    """Rates of six parameters, and rates and slopes in closed form, in the order of the stimuli."""
    slow_ms = np.concatenate([TIMES_MS[:-1], [1000.0, 1500.0]])
    mixed = [traces([1.0, 2.0]), traces([1.5], slow_ms), traces([2.5])]
    windows = ((20.0, 50.0), (500.0, 900.0))
    model = AfferentModel.of_traces(mixed, windows)
    assert (model.n_stimuli, [drive.n_sites for drive in model.drives]) == (4, [3, 1])
    alone = np.concatenate([AFFERENT.rates(one, *windows) for one in mixed], axis=1)
    np.testing.assert_array_equal(model.evaluate(np.array(KNOWN)), alone)
    ours, theirs = (AfferentModel.of_traces(each) for each in (mixed, traces([1.0, 2.0, 2.5])))
    both = (closed_form_rates(each, identifiable(KNOWN)) for each in (ours, theirs))
    for found in zip(*both, strict=True):
        for mine, other in zip(*found, strict=True):
            np.testing.assert_allclose(mine[[0, 1, 3]], other, rtol=1e-12)


def test_another_quantity_for_the_dynamic_term_reaches_the_afferent():
    doubled = AfferentModel.of_traces(
        [replace(SED, dynamic=replace(SED, values=2.0 * SED.values, quantity="work"))]
    )
    halved = [KNOWN[0], KNOWN[1] / 2.0, *KNOWN[2:]]
    for rates, expected in zip(doubled.evaluate(np.array(halved)), AFFERENT.rates(SED), strict=True):
        np.testing.assert_allclose(rates, expected, rtol=1e-9)
    with pytest.raises(fp.InputError, match="got stored and stored, work and stored"):
        AfferentModel.of_traces([SED, replace(SED, dynamic=replace(SED, quantity="work"))])


test_what_cannot_be_fitted_or_pressed_is_refused = refusals(
    (lambda: study.check_enough(RATES, np.array([0, 1])),
     "memberships needs one fold per stimulus: got 2 for"),
    (lambda: study.check_enough(RATES.chosen([0, 1, 2]), np.array([0, 0, 1])),
     "without fold 1 there are 2, record more"),
    (lambda: study.check_enough(fp.RateRecordings(NAMES[:8], None, range(8)), np.repeat([0, 1], [5, 3])),
     "without fold 1 there are 3"),
    (lambda: study.check_enough(fp.RateRecordings(NAMES[:4], [0, 1, 0, 1], [1] * 4), np.arange(4) % 2),
     r"\(height 0, height 2\)"),
    (lambda: check_spikes(RATES, 1), "likelihood needs spike times: got rates"),
    (lambda: check_spikes(train(1, 5, 9, 14, 20), 2), "got 2 motions"),
    (lambda: check_spikes(train(1, 5, 9, 14), 1), "at least 5 spikes"),
    (lambda: check_spikes(train(0, 5, 9, 14, 20), 1), "a has one at 0 ms"),
    (lambda: check_spikes(train(1, 5, 5.5, 9, 14), 1), "a has two at 5 and 5.5 ms"),
    (lambda: AfferentModel.of_traces([SED, traces([1.0], TIMES_MS[:-1])], PAPER_WINDOWS_MS),
     "one ends at 950 ms, stimulus 11 at 700 ms"),
    (lambda: touches(ShiftedBar(motion=fp.RampAndHold(9.0)).named("1")),
     "^Stimulus 1 cannot be used: motion.depth_mm must stay"),
    (lambda: touches(ShiftedBar().named("-80")),
     "^Stimulus -80 cannot be used: place must lie on the finger"),
    (lambda: touches(NamedStimulus(fp.bodies.Line(), tilt_deg=5.0, name="deep")), ("place", "tilt_deg")),
)  # fmt: skip


def train(*times_ms):
    return SpikeRecordings(("a",), fp.SpikeTrains.from_lists([times_ms]), 50.0)


def touches(*stimuli):
    return ListedStimuli({}).touches(stimuli, Conditions("quick"))


def test_the_stimuli_of_the_bar_are_the_touches_of_the_reproduction(tmp_path):
    path = tmp_path / "bar.csv"
    path.write_text(examples()["recordings"].text)
    bar, conditions = ShiftedBar(), Conditions("quick")
    recorded = read_recordings(path, bar)
    touches = bar.touches(list(recorded.stimuli.values()), conditions)
    assert list(touches.values()) == conditions.bar_touches()
    observed = bar_firing_rates()
    np.testing.assert_array_equal(recorded.recordings.dynamic_rate_hz, observed.dynamic_rate_hz)
    np.testing.assert_array_equal(recorded.recordings.static_rate_hz, observed.static_rate_hz)
    assert [float(name) for name in recorded.stimuli] == observed.shift_mm.tolist()


def test_stimuli_are_indented_at_their_position_with_their_motion():
    sphere = fp.Sphere(curvature_per_m=340.0)
    stimuli = [
        NamedStimulus(sphere, fp.RampAndHold(0.4), x_mm=1.0, z_mm=0.5, tilt_deg=3.0, name="beside"),
        NamedStimulus(fp.bodies.Line(), fp.ForceRampAndHold(50.0), name="wire"),
        NamedStimulus(fp.Gap(gap_mm=0.5), x_mm=0.2, friction=0.3, name="gap"),
        NamedStimulus(fp.Bar(), spin_deg=30.0, name="turned"),
    ]
    beside, wire, gap, turned = touches(*stimuli).values()
    assert beside.at_mm == (RECEPTOR_X_MM + 1.0, 0.5)
    assert (beside.tilt_deg, beside.grading.full, beside.stimulus.depth_mm) == (3.0, True, 0.4)
    assert (wire.tilt_deg, wire.grading.full, wire.stimulus.force_mn) == (0.0, False, 50.0)
    assert (gap.indenter.gap_mm, gap.grading.full, gap.spin_deg, gap.friction) == (0.5, False, 0.0, 0.3)
    assert gap.grading.finest_x_mm <= 0.5 / 4
    assert (turned.spin_deg, turned.grading.full) == (30.0, True)


class Pressed:
    """Stands for the skin under a touch: two humps of energy density where the edges of the bar are."""

    force_imbalance = energy_imbalance = 0.0
    linear_solver, caveats = "none", ()

    def __init__(self, touch):
        self.shift_mm, self.depth_mm = touch.at_mm[0] - RECEPTOR_X_MM, touch.stimulus.depth_mm
        self.mesh = touch.mesh

    def height(self, offset_mm):
        return 3.0 * np.exp(-((np.abs(self.shift_mm - offset_mm) - 1.5) ** 2)) * self.depth_mm

    def sed(self, sites, dynamic_quantity, static_quantity, depth_mm=None):
        offsets = np.array(sites)[:, 0] - RECEPTOR_X_MM
        assert [offset for offset, (_, across) in zip(offsets, sites, strict=True) if across == 0.0].count(
            0.0
        )
        return replace(traces(self.height(offsets)), quantity=static_quantity)


@pytest.fixture
def call(monkeypatch, run_program):
    """Run the command in an empty folder; indentations take no time."""
    monkeypatch.setattr(runner, "solve_missing", lambda *_: None)
    monkeypatch.setattr(runner.Store, "load", lambda self, touch: Pressed(touch))
    return partial(run_program, cli.main, "fingerpad", "fit")


SHIFTS_MM = (-2.0, -1.4, -0.4, 0.2, 1.0, 1.6)
ROWS = "shift_mm,dynamic_rate_hz,static_rate_hz\n" + "".join(
    f"{shift},{150 - 9 * row},{40 - 5 * row}\n" for row, shift in enumerate(SHIFTS_MM)
)


def test_a_fit_writes_page_figures_numbers_and_their_origin(call, tmp_path):
    (tmp_path / "mine.csv").write_text(ROWS)
    arguments = ("mine.csv", "--stimuli", "bar", "--folds", "2", "--resolution", "quick", "--seed", "3")
    status, said, errors = call(*arguments)
    assert (status, errors) == (0, "")
    results = json.loads((tmp_path / "fit" / "fit.json").read_text())
    fit, manifest = results["fit"], results["manifest"]
    assert said.splitlines()[0].startswith(
        f"Fitted to 6 stimuli by least squares: FSS {fit['fss_in_sample']:.3f}"
    )
    assert said.splitlines()[-2:] == ["Report: fit/fit.html", "Results: fit/fit.json"]
    found = {str(path.relative_to(tmp_path / "fit")) for path in (tmp_path / "fit").rglob("*.*")}
    assert found == {"fit.html", "fit.json", "figures/fit.png"}
    assert fit["shift_mm"] == list(SHIFTS_MM)
    assert fit["presentations"] == [1] * 6
    assert manifest["command"] == shlex.join(["fingerpad", "fit", *arguments])
    assert manifest["inputs"] == {"mine.csv": hashlib.sha256(Path("mine.csv").read_bytes()).hexdigest()}
    assert (manifest["seed"], manifest["resolution"], manifest["materials"]) == (3, "quick", "human")
    assert (results["dynamic_quantity"], results["static_quantity"]) == ("stored", "von_mises")
    assert results["windows_ms"] == [[30.0, 50.0], [600.0, 950.0]]
    page = (tmp_path / "fit" / "fit.html").read_text()
    assert "<h1>An afferent fitted to recordings</h1>" in page
    assert "its dynamic term follows strain energy density, its static term von Mises stress" in page
    assert page.count("data:image/png;base64,") == 1
    assert f"<td>{fit['fss_out_of_sample']:.3f}</td>" in page.replace("−", "-")


def test_spikes_seed_and_what_else_is_asked_for_reach_the_fit(call, tmp_path, monkeypatch):
    asked = []

    def note(sed, recordings, memberships, **settings):
        asked.append((recordings, settings))
        return study.fit_recordings(sed, recordings, memberships)

    monkeypatch.setattr(request, "fit_recordings", note)
    spikes = "1 5 9 20 33 41 48 700"
    (tmp_path / "mine.csv").write_text(
        "shift_mm,spike_times_ms\n" + "".join(f"{shift},{spikes}\n" for shift in SHIFTS_MM)
    )
    asked_for = ("--posterior", "--profiles", "--sensitivity")
    options = ("--method", "likelihood", *asked_for, "--seed", "7", "--folds", "2")
    assert call("mine.csv", "--stimuli", "bar", *options)[0] == 0
    ((recordings, settings),) = asked
    assert isinstance(recordings, SpikeRecordings)
    assert recordings.trains.times_ms.size == 8 * len(SHIFTS_MM)
    assert (settings["method"], settings["seed"], settings["beside"]) == ("likelihood", 7, None)
    assert all(settings[f"with_{option.removeprefix('--')}"] is True for option in asked_for)
    assert settings["positions_mm"] == list(SHIFTS_MM)


def test_what_is_asked_for_beside_the_fit_is_on_its_page(call, tmp_path, monkeypatch):
    (tmp_path / "mine.csv").write_text(ROWS)
    profile = {"values": [1.0, 2.0, 3.0], "losses": [3.0, 0.0, 3.0], "low": 1.2, "high": None}
    four = [profile | {"name": name} for name in IDENTIFIABLE_NAMES]
    typed = tuple(ParameterProfile(**each) for each in four)
    monkeypatch.setattr(recording_posterior, "profiled", lambda *given: typed)
    options = ("--profiles", "--sensitivity", "--offset", "--folds", "2")
    status, _, errors = call("mine.csv", "--stimuli", "bar", *options)
    assert (status, errors) == (0, "")
    fit = json.loads((tmp_path / "fit" / "fit.json").read_text())["fit"]
    assert fit["profiles"] == four
    assert len(fit["sensitivity"]["total"]) == 4
    assert fit["offset"]["held"]["offset_mm"] == list(OFFSETS_MM)
    figures = {path.stem for path in (tmp_path / "fit" / "figures").iterdir()}
    assert figures == {"fit", "profiles", "offset"}
    page = (tmp_path / "fit" / "fit.html").read_text()
    for words in ("<td>1.2 … open</td>", "Sensitivity of FSS (Sobol)", "Offset of the receptor"):
        assert words in page


def test_chosen_numbers_of_another_type_are_fitted_and_read_by_a_touch(call, tmp_path):
    (tmp_path / "mine.csv").write_text(
        "shift_mm,dynamic_rate_hz\n" + "".join(f"{shift},{100 + 20 * shift}\n" for shift in SHIFTS_MM)
    )
    status, said, errors = call("mine.csv", "--stimuli", "bar", "--afferent", "RA", "--free", "threshold")
    assert (status, errors) == (0, "")
    assert said.startswith("RA fitted to 6 stimuli: threshold ")
    results = json.loads((tmp_path / "fit" / "fit.json").read_text())
    afferent = fitted_afferent(tmp_path / "fit" / "fit.json")
    assert type_of(afferent) == "RA"
    assert results["fitted"] == {"threshold": afferent.threshold}
    assert results["windows_ms"][0] == [0.0, 50.0]  # RA are counted in all of the ramp


def test_listed_stimuli_folds_of_the_file_and_options_reach_the_fit(call, tmp_path):
    (tmp_path / "list.csv").write_text(
        "name,object,object.width_mm,motion.depth_mm,place.x_mm,motion.hold_ms\n"
        + "".join(f"bar {row},bar,3,{1.0 - 0.1 * row},1.5,{900 + row}\n" for row in range(5))
    )
    (tmp_path / "mine.csv").write_text(
        "what,static_rate_hz,fold\n"
        + "".join(f"bar {row},{60 - 9 * row},{row + 1}\n" for row in (0, 2, 1, 3, 4))
    )
    call_with = ("mine.csv", "--stimuli", "list.csv", "--stimulus-column", "what", "--out", "there")
    status, _, errors = call(*call_with, "--windows_ms.static", "500,900", "--tissues", "trial1")
    assert (status, errors) == (0, "")
    results = json.loads((tmp_path / "there" / "fit.json").read_text())
    fit, manifest = results["fit"], results["manifest"]
    assert (fit["stimulus"], fit["fold"]) == ([f"bar {row}" for row in (0, 2, 1, 3, 4)], [1, 3, 2, 4, 5])
    assert fit["shift_mm"] is None
    assert sorted(manifest["inputs"]) == ["list.csv", "mine.csv"]
    assert (results["windows_ms"][1], manifest["materials"]) == ([500.0, 900.0], "trial1")


BAR = ["mine.csv", "--stimuli", "bar"]
LIST = ["mine.csv", "--stimuli", "list.csv"]


def static_rates(column, rows):
    return f"{column},static_rate_hz\n" + "".join(f"{row},9\n" for row in rows)


@pytest.mark.parametrize(
    ("arguments", "content", "said"),
    [
        ([*BAR, "--afferent", "RA"], ROWS, "free must name at least one number of RA"),
        ([*BAR, "--free", "x"], ROWS, "free must be one of"),
        ([], ROWS, "fit needs a file, recordings or options: see --help"),
        (["none.csv", "--stimuli", "bar"], ROWS, "none.csv must be a file that can be read"),
        (["mine.csv", "--stimuli", "none.csv"], ROWS, "none.csv must be a file that can be read"),
        (BAR, ROWS + "2,1,nan\n", "mine.csv, line 8: static_rate_hz must be a"),
        (BAR, static_rates("shift_mm", (0, 1)), "at least 4 rates"),
        (BAR, ROWS + "90,1,3\n", "Stimulus 90 cannot be used: place must lie"),
        ([*BAR, "--motion.depth_mm", "9"], ROWS, "Stimulus -2 cannot be used: --motion.depth_mm"),
        ([*BAR, "--object", "bar:0"], ROWS, "width_mm must lie within"),
        ([*BAR, "--folds", "7"], ROWS, "n_folds must be at most the number of stimuli"),
        ([*BAR, "--unit", "1"], ROWS, "unit belongs to NWB files"),
        ([*BAR, "--method", "guess"], ROWS, "method must be one of least_squares"),
        ([*BAR, "--method", "likelihood"], ROWS, "likelihood needs spike times"),
        ([*BAR, "--offset", "--method", "closed_form"], ROWS,
         "offset needs a method that fits it, least_squares or cma_es: got closed_form"),
        ([*LIST, "--offset"], static_rates("stimulus", ("edge", "wide")),
         "offset needs stimuli at several places along the finger"),
        ([*BAR, "--offset", "--folds", "2"], static_rates("shift_mm", range(8)),
         "recordings must leave at least 5 rates"),
        ([*BAR, "--finger", "chid"], ROWS, "--finger: like must be one of adult"),
        ([*LIST, "--finger", "a.inp"], ROWS, "finger: a.inp must be a file"),
        ([*BAR, "--dynamic-quantity", "heat"], ROWS, "--dynamic-quantity must be one"),
        ([*BAR, "--windows_ms.static", "600,1100"], ROWS, "not at 1100 ms"),
        ([*BAR, "--windows_ms.static", "600,500"], ROWS, "a later end: got 600, 500"),
        ([*LIST, "--object", "bar:2"], ROWS, "object is that of the bar, and list.csv lists stimuli"),
        (LIST, ROWS, "mine.csv, line 1: column 'shift_mm' is unknown"),
        (LIST, static_rates("stimulus", ("edge", "side")),
         "mine.csv, line 3: stimulus must be one of list.csv, edge"),
        ([*BAR, "--folds", "2"],
         "shift_mm,static_rate_hz,fold\n" + "".join(f"{row},9,{row + 1}\n" for row in range(6)),
         "from the column fold or from folds, not both"),
        (BAR, "shift_mm,spike_times_ms,duration_ms\n0,1 2,900\n1,3,900\n2,5,900\n",
         "windows_ms must end within the recordings of 900 ms"),
    ],
    ids=lambda value: " ".join(value) if isinstance(value, list) else "",
)  # fmt: skip
def test_bad_input_is_one_sentence_and_status_2_and_nothing_is_written(
    call, tmp_path, arguments, content, said
):
    (tmp_path / "mine.csv").write_text(content)
    (tmp_path / "list.csv").write_text("name,object\nedge,bar\nwide,bar\n")
    misused(call(*arguments), said)
    assert sorted(path.name for path in tmp_path.iterdir()) == ["list.csv", "mine.csv"]


def test_the_example_prints_its_command_and_writes_recordings(run_program, tmp_path):
    status, said, errors = run_program(cli.main, "fingerpad", "init", "recordings", "--out", "try")
    assert (status, said, errors) == (0, "Try: fingerpad fit try/bar.csv\n", "")
    assert read_recordings(tmp_path / "try/bar.csv", ShiftedBar()).recordings.dynamic_rate_hz.size == 36


def test_figures_show_what_was_recorded_and_nothing_else(recovered):
    both = report.draw_fit(recovered)
    assert [axes.get_title().split(",")[0] for axes in both.axes] == ["dynamic ramp", "static hold"]
    (observed,) = (line for line in both.axes[1].lines if line.get_label() == "observed")
    np.testing.assert_allclose(observed.get_ydata(), RATES.static_rate_hz, rtol=1e-12)
    unrecorded = replace(recovered.phases["dynamic"], observed_hz=None, fss_in_sample=None)
    alone = report.draw_fit(replace(recovered, phases=recovered.phases | {"dynamic": unrecorded}))
    assert [axes.get_title().split(",")[0] for axes in alone.axes] == ["static hold"]
    shifted = report.draw_fit(replace(recovered, shift_mm=np.arange(N, 0, -1)))
    line = next(line for line in shifted.axes[0].lines if line.get_label() == "fitted to all")
    assert list(line.get_xdata()) == list(range(-N, 0))
    np.testing.assert_array_equal(line.get_ydata(), recovered.phases["dynamic"].fitted_hz)
    assert "need five folds or more" in summary("fit", SimpleNamespace(fit=recovered))[1]
    assert [row.cells[2] for row in table_of("fit", "The four", recovered).rows] == ["–"] * 4
    observed = [cells[3] for cells in report.rows_of_rates(recovered)]
    assert observed == [f"{rate:.1f}" for rate in RATES.dynamic_rate_hz]


def test_a_fit_from_nothing_recovers_a_known_afferent(call, monkeypatch, tmp_path):
    """Presses included, in a process whose warnings are errors; then the same stimuli with other rates."""
    listed, known = ["-1.5", "1.3", "1.5"], fp.Afferent()
    (tmp_path / "mine.csv").write_text(ROWS.splitlines()[0] + "".join(f"\n{name},100,30" for name in listed))
    options = ("mine.csv", "--stimuli", "bar", "--resolution", "quick", "--jobs", "1")
    shell = subprocess.run(
        [sys.executable, "-W", "error", "-m", "fingerpad", "fit", *options],
        cwd=tmp_path, capture_output=True, text=True, check=False,
    )  # fmt: skip
    # The kernels may be compiled only now.
    said = [
        line
        for line in shell.stderr.splitlines()
        if not line.startswith((SUBJECT, SHORT_NOTICE)) and not re.search(r"\d+ s( left)?$", line)
    ]
    assert (shell.returncode, said) == (0, [])
    folder = tmp_path / "fit"
    assert json.loads((folder / "fit.json").read_text())["manifest"]["stages"][1]["computed"] == 3

    monkeypatch.undo()
    monkeypatch.chdir(tmp_path)
    stimuli = [ShiftedBar().named(name) for name in listed]
    store = runner.Store(folder / runner.STORE_FOLDER)
    pressed = ShiftedBar().touches(stimuli, Conditions("quick"))
    followed = (known.dynamic_quantity, known.static_quantity)
    stress = [store.load(touch).sed([[RECEPTOR_X_MM, 0.0]], *followed) for touch in pressed.values()]
    rates = zip(listed, *AfferentModel.of_traces(stress).evaluate(known.parameters), strict=True)
    (tmp_path / "mine.csv").write_text(
        ROWS.splitlines()[0] + "".join(f"\n{name},{dynamic},{static}" for name, dynamic, static in rates)
    )
    assert call(*options)[0] == 0
    second = json.loads((folder / "fit.json").read_text())
    assert second["manifest"]["stages"][1]["computed"] == 0
    assert second["fit"]["fss_in_sample"] > 0.99
    assert second["fit"]["fss_out_of_sample"] > 0.98
