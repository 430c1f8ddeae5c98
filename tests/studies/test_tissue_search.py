"""Search for tissues: what is pressed and read, a fit that recovers the truth, and one tiny run."""

from dataclasses import replace
from types import SimpleNamespace

import numpy as np
import pytest

from fingerpad.core.result_files import from_json, to_json
from fingerpad.core.signals import Traces
from fingerpad.data import protocol
from fingerpad.experiments.conditions import RECEPTOR_X_MM, Conditions
from fingerpad.experiments.runner import Runner
from fingerpad.inference import afferent_fit
from presses import Coarse
from studies import tissue_search
from studies.pages import DOCS
from studies.tissue_candidates import HUMAN, HUMAN_KPA, LEVELS, STRESS, Reading
from studies.tissue_page import SEARCH_COLUMNS, search_blocks
from studies.tissue_search import (
    ONE_BAR,
    POSITIONS_MM,
    SPHERES_PER_M,
    Deflection,
    Firing,
    Levels,
    Percept,
    Skins,
    TissueSearch,
    bar_traces,
    driven,
    fitted,
    met,
    targets,
    touches,
)


def test_a_candidate_is_pressed_by_cylinder_plate_bar_and_spheres():
    once = replace(HUMAN, finalist=False)
    pressed = touches(once, Conditions("quick"))
    assert [key for key in pressed if key[0] != "sphere"] == [
        ("cylinder", 3.17, 0.0), ("plate", 1.0, 0.0), ("plate", 2.0, 0.0), ONE_BAR,
    ]  # fmt: skip
    assert [pressed["plate", depth, 0.0].stimulus.depth_mm for depth in (1.0, 2.0)] == [1.0, 2.0]
    assert {touch.tilt_deg for key, touch in pressed.items() if key[0] == "plate"} == {0.0}
    spheres = {key[1:] for key in pressed if key[0] == "sphere"}
    assert spheres == {(curvature, at) for curvature in (287.0, 296.0, 365.0) for at in (0.0, 0.2)}
    assert all(touch.tissues == HUMAN.tissues for touch in pressed.values())
    more = touches(HUMAN, Conditions("quick"))
    assert tuple(key[1] for key in more if key[0] == "bar") == protocol.BAR_SHIFTS.value


# What an afferent follows


class Skin:
    """Skin whose energy density is x and whose stress is 2 x, so that a trace says where it was sampled."""

    times_ms, kinks_ms = np.array([0.0, 50.0, 1000.0]), (50.0,)

    def __init__(self, offset=0.0):
        self.offset = offset

    def sample(self, quantity, sites):
        at = np.asarray(sites, dtype=float)[:, 0] + self.offset
        return np.outer([0.0, 1.0, 1.0], {"stored": 1.0, "compressive_stress": 2.0}[quantity] * at)


SITES = np.array([[4.0, 0.0], [9.0, 0.0]])


SED_DRIVEN = replace(HUMAN, reading=Reading())


def test_a_quantity_is_read_and_raised_to_its_exponent():
    rooted = replace(HUMAN, reading=Reading(exponent=0.5))
    assert driven(Skin(), rooted, SITES).values[-1].tolist() == [2.0, 3.0]
    assert driven(Skin(), replace(HUMAN, reading=STRESS), SITES).values[-1].tolist() == [8.0, 18.0]


def test_one_bar_is_read_where_a_shifted_bar_would_have_the_receptor():
    (traces,) = bar_traces({ONE_BAR: Skin()}, SED_DRIVEN, SimpleNamespace(along_skin=0.5))
    assert traces.values[-1] == pytest.approx(RECEPTOR_X_MM + 0.5 * np.array(protocol.BAR_SHIFTS.value))


def test_shifted_bars_are_read_at_the_receptor_in_the_order_of_the_shifts():
    bars = {("bar", shift, 0.0): Skin(offset=shift) for shift in reversed(protocol.BAR_SHIFTS.value)}
    found = [float(traces.values[-1, 0]) for traces in bar_traces(bars, SED_DRIVEN, None)]
    assert found == pytest.approx(RECEPTOR_X_MM + np.array(protocol.BAR_SHIFTS.value))


# Levels

TIMES_MS = np.array([0.0, 10.0, 20.0, 30.0, 40.0, 50.0, 100.0, 300.0, 1000.0])


def ramp_and_hold(peaks_kpa):
    course = np.concatenate([np.linspace(0.0, 1.0, 6) ** 2, [0.98, 0.96, 0.95]])
    return Traces(TIMES_MS, np.outer(course, peaks_kpa), np.array([50.0]))


def synthetic_skins(scale=1.0):
    shift, receptor = np.array(protocol.BAR_SHIFTS.value), np.arange(18.0)
    bar = ramp_and_hold(scale * (0.2 + 1.8 * np.exp(-((np.abs(shift) - 1.4) ** 2))))
    near = np.exp(-(((receptor % 6) - 2.5) ** 2 + (receptor // 6 - 1) ** 2) / 4)
    peaks = dict(zip(SPHERES_PER_M, (2.0, 2.05, 2.4), strict=True))
    spheres = {
        (curve, at): ramp_and_hold(scale * peak * near)
        for curve, peak in peaks.items()
        for at in POSITIONS_MM
    }
    return Skins([bar], spheres)


TRUTH = np.array([2e-7, 1.2e-4, 1.4e-6, 50.0, 1e-6, 50.0])


@pytest.fixture
def short_fits(monkeypatch):
    monkeypatch.setattr(afferent_fit, "MOST_EVALUATIONS", 24)


def test_the_fit_finds_an_afferent_that_responds_like_the_true_one(short_fits):
    skins = synthetic_skins()
    dynamic, static = skins.model.evaluate(TRUTH)
    recordings = replace(skins.problem.recordings, dynamic_rate_hz=dynamic, static_rate_hz=static)
    skins.__dict__["problem"] = replace(skins.problem, recordings=recordings)
    firing, six = fitted(skins, folds=False)
    assert np.isnan(firing.fss_out_of_sample)
    assert firing.fss == skins.problem.score(six, np.arange(36)) > 0.9
    assert six[0] * six[3] / (six[4] * six[5]) <= 0.95 + 1e-12


# Verdicts


def levels(r2=0.975, force=(0.2, 0.7), fss=0.93, outside=0.92, noise=0.056, euclidean=0.04):
    """Levels of one candidate; only these numbers decide."""
    hit_rates = [[0.58, 0.95], [0.6, 0.95]]
    return Levels(
        deflection=Deflection(r2=r2, plate_force_n=force),
        firing=Firing(fss=fss, fss_out_of_sample=outside, dynamic_hz=(53.0, 181.0), static_hz=(6.0, 54.0)),
        percept=Percept(noise_sigma=noise, hit_rates=hit_rates, euclidean_rms=euclidean),
        parameters={},
    )


@pytest.mark.parametrize(
    ("changed", "missed"),
    [
        ({}, ()),
        ({"r2": 0.969}, ("deflection",)),
        ({"force": (0.24, 0.7)}, ("force",)),
        ({"force": (0.2, 0.49)}, ("force",)),
        ({"outside": 0.899}, ("firing",)),
        ({"outside": np.nan, "fss": 0.899}, ("firing",)),
        ({"noise": 0.062}, ("percept",)),
        ({"noise": np.nan}, ("percept",)),
        ({"euclidean": 0.051}, ("percept",)),
    ],
)
def test_a_level_is_met_or_missed_by_itself(changed, missed):
    assert met(levels(**changed), targets()) == tuple(level for level in LEVELS if level not in missed)


# One tiny run


def few(patch):
    """Leave two candidates with the same presses, and shorten the fits."""
    human = replace(HUMAN, finalist=False)
    doubled = replace(human, name="doubled", factor=2.0)
    patch.setattr(tissue_search, "candidates", lambda: (human, doubled))
    patch.setattr(afferent_fit, "MOST_EVALUATIONS", 8)


@pytest.fixture(scope="module")
def tiny(shared_folder):
    def run():
        return tissue_search.run(Runner(shared_folder), Coarse("quick"))

    with pytest.MonkeyPatch.context() as patch:
        few(patch)
        return SimpleNamespace(run=run, results=run())


def test_each_candidate_has_all_levels_and_a_common_factor_changes_forces_only(tiny):
    human, doubled = tiny.results.rows
    assert np.isfinite([human.levels.firing.fss, human.levels.firing.fss_out_of_sample]).all()
    shallow, deep = human.levels.deflection.plate_force_n
    assert 0.0 < shallow < deep
    assert human.shear_kpa == pytest.approx(HUMAN_KPA)
    assert doubled.shear_kpa == pytest.approx(2.0 * human.shear_kpa)
    assert doubled.levels.deflection.plate_force_n == pytest.approx([2.0 * shallow, 2.0 * deep])
    assert to_json(doubled.levels.percept) == to_json(human.levels.percept)


def test_a_second_run_solves_nothing_and_has_the_same_results(tiny, monkeypatch):
    monkeypatch.setattr("fingerpad.skin.store._compute", pytest.fail)
    few(monkeypatch)
    again = replace(tiny.run(), manifest=tiny.results.manifest)
    assert to_json(from_json(TissueSearch, to_json(again))) == to_json(again) == to_json(tiny.results)


def test_the_block_shows_every_candidate_and_has_the_form_of_the_page(tiny):
    good = replace(tiny.results.rows[0], levels=levels())
    unsolved = replace(good, name="odd", levels=None, unsolved="It folded.")
    (block,) = search_blocks(replace(tiny.results, rows=(good, unsolved))).values()
    assert "| human | 0.975 | 0.20, 0.70 | 0.920 | 0.056 | d f r p |" in block
    assert "| odd | – | – | – | – | – |" in block
    assert "odd could not be solved: It folded." in block
    assert f"| {' | '.join(SEARCH_COLUMNS)} |" in (DOCS / "tissues.md").read_text(encoding="utf-8")
