"""The whole reproduction by its command, from an empty folder, and the files that it writes."""

import json
import math
import os
import re
import shutil
import signal
import struct
import subprocess
import sys
import time
from pathlib import Path
from types import SimpleNamespace

import numpy as np
import pytest

import fingerpad as fp
from fingerpad import __version__, cli
from fingerpad.core.compilation import SHORT_NOTICE, SUBJECT
from fingerpad.core.errors import InputError
from fingerpad.core.result_files import from_json, to_json
from fingerpad.data import all_published
from fingerpad.experiments.gerling2014 import nerve
from fingerpad.experiments.gerling2014.reproduction import ReproductionResult
from fingerpad.experiments.run import ReproductionRequest
from fingerpad.experiments.run import run as run_request
from fingerpad.experiments.runner import STORE_FOLDER, Runner
from fingerpad.report.results import page_of
from fingerpad.skin.store import Store
from studies.results_page import read_excerpt, readme_table

COMMAND = (sys.executable, "-W", "error", "-m", "fingerpad", "reproduce")
MEASURES = ("static", "dynamic", "latency")
HIT_RATES = ("hit_rate", "hit_rate_sd", "hit_rate_shifted", "hit_rate_shifted_sd")
MEASURED = ("started", "wall_s", "peak_memory_mb", "stages", "weber_144", "weber_287")
"""Parts of the manifest and of the summary that differ between runs, or are left out at quick resolution."""

BALANCE = 0.01
"""Bound on the error of the balance of energy at quick resolution, where 0.0012 to 0.0034 are found."""

BEYOND = {"curvature_thresholds", "single_unit_uncertainty"}
"""Sections that go beyond the paper, which a run at quick resolution leaves out unless asked."""

SETS = ("paper", "human")
INDENTATIONS = 6 + 2 * (4 + 36 + 14 + 1)


def run(folder, *options):
    """Reproduce in a subprocess whose warnings are errors."""
    started = time.perf_counter()
    command = [*COMMAND, "--resolution", "quick", "--jobs", "2", "--out", str(folder), *options]
    done = subprocess.run(command, capture_output=True, text=True, check=False, cwd=folder.parent)
    text = (folder / "results.json").read_text(encoding="utf-8") if done.returncode == 0 else "null"
    return SimpleNamespace(
        folder=folder, status=done.returncode, said=done.stdout, errors=done.stderr, text=text,
        results=json.loads(text), wall_s=time.perf_counter() - started,
    )  # fmt: skip


PROGRESS = re.compile(r"[a-z ]+: (\d+ % of number )?\d+ of \d+(, \d+ s left| after \d+ s)")


def told(run):
    """Lines on standard error, without those on compiled kernels."""
    return [line for line in run.errors.splitlines() if not line.startswith((SUBJECT, SHORT_NOTICE))]


@pytest.fixture(scope="session")
def first(tmp_path_factory):
    """The run from nothing: minutes of mechanics, shared by all tests of this module."""
    return run(tmp_path_factory.mktemp("reproduction") / "out")


@pytest.fixture(params=SETS)
def of_set(first, request):
    """Results of one set."""
    return first.results[request.param]


@pytest.fixture(scope="session")
def stamps(first):
    """When each indentation was stored."""
    return {path.name: path.stat().st_mtime_ns for path in (first.folder / STORE_FOLDER).iterdir()}


@pytest.fixture(scope="session")
def second(first, stamps):
    """The same indentations met by other observers, in another process, and what goes beyond the paper."""
    with pytest.MonkeyPatch.context() as patch:
        chains = {"n_walkers": 100, "smallest_effective_size": 100.0, "largest_r_hat": 1.02}
        patch.setattr(nerve, "CHAINS", chains)  # short ones
        request = ReproductionRequest.read(None, {"resolution": "quick", "seed": 7, "extended": True})
        results = run_request(request, Runner(first.folder))
    return json.loads(to_json(results))


# From nothing


def test_a_run_ends_with_status_0_and_whole_files_and_the_numbers_of_the_pages(first, stamps):
    assert first.status == 0
    # The kernels may be compiled only now.
    assert told(first)
    assert all(PROGRESS.fullmatch(line) for line in told(first))
    *verdicts, report, results = first.said.splitlines()
    assert report == f"Report: {first.folder / 'report.html'}"
    assert results == f"Results: {first.folder / 'results.json'}"
    for name, verdict in zip(SETS, verdicts, strict=True):
        assert verdict.startswith(f"{name}: of {len(first.results['statements'])} statements of the paper")
        for each in first.results["statements"]:
            assert (each["statement"] in verdict) == (each[f"verdict_{name}"] == "missed")
    assert sorted(os.listdir(first.folder)) == ["figures", STORE_FOLDER, "report.html", "results.json"]
    assert len(stamps) == INDENTATIONS
    assert all(re.fullmatch(r"[0-9a-f]{32}\.npz", name) for name in stamps)
    shown = read_excerpt(first.folder / "results.json")
    assert sum(shown.indentations.values()) == INDENTATIONS
    assert len(readme_table(shown).splitlines()) == 2 + len(first.results["statements"])
    for percept in shown.percept.values():
        assert percept.codes[0].hit_rate.size == percept.curvature_per_m.size == 6


def numbers(value):
    """Every number in nested lists and dicts."""
    if isinstance(value, dict):
        value = list(value.values())
    if isinstance(value, list):
        for item in value:
            yield from numbers(item)
    elif isinstance(value, int | float) and not isinstance(value, bool):
        yield value


def test_results_have_every_section_finite_numbers_and_every_input(first):
    files = {"format", "format_version", "tissues", "inputs", "manifest"}
    assert set(first.results) == files | {"summary", "statements", "skin_deflection", *SETS}
    studies = {"tissues", "skin_force", "single_unit", "firing", "discrimination", "mesh", "levels"}
    for name in SETS:
        assert set(first.results[name]) == studies | {"population", "nail", "comparison"} | BEYOND
        assert {key for key, section in first.results[name].items() if section is None} == BEYOND
    assert not re.search(r"\b(NaN|Infinity)\b", first.text)
    assert all(math.isfinite(number) for number in numbers(first.results))
    listed = first.results["inputs"]
    assert [number["name"] for number in listed] == [number.name for number in all_published()]
    assert {number["status"] for number in listed} <= {"paper", "read", "recalled", "assumed"}


@pytest.mark.parametrize("name", SETS)
def test_the_summary_repeats_numbers_of_the_sections(first, name):
    found, unit, whole = first.results["summary"][name], first.results[name]["single_unit"], first.results
    assert found["fss_out_of_sample"] == unit["fss_out_of_sample"]
    assert found["resting_rate_hz"] == whole[name]["population"]["at_rest"]["static_rate_hz"]
    assert found["noise_sigma"] == whole[name]["discrimination"]["noise_sigma"]
    assert found["force_plate_2mm_n"] == whole[name]["skin_force"]["plate_2mm_n"]
    assert len(found["hit_rate_296"]) == len(found["hit_rate_365"]) == 2
    assert found["weber_144"] is None  # not at quick resolution


def test_the_first_column_is_the_papers_own_system(first):
    paper, human = (first.results[name]["single_unit"] for name in SETS)
    assert (paper["method"], human["method"]) == ("response surface", "least squares in four numbers")
    assert (paper["dynamic_quantity"], paper["static_quantity"]) == ("stored", "stored")
    assert [len(fold["climbs"]) for fold in paper["folds"]] == [2] * 6
    met = [each["verdict_paper"] for each in first.results["statements"]].count("met")
    assert len(first.results["statements"]) >= 12
    assert met >= 7


def test_one_set_serves_four_levels(first):
    """Bounds of the quick resolution; docs/results.md has the numbers at standard resolution."""
    found = first.results["summary"]["human"]
    assert found["deflection_r2"] >= 0.97
    assert 0.11 <= found["force_plate_1mm_n"] <= 0.23
    assert 0.50 <= found["force_plate_2mm_n"] <= 1.04
    assert found["fss_out_of_sample"] >= 0.90
    assert found["resting_rate_hz"] == 0.0
    assert 0.015 <= found["noise_sigma"] <= 0.03  # 3 to 6 spikes/s at low rates
    assert found["hit_rate_296"] == pytest.approx([0.58, 0.58], abs=0.03)
    assert found["hit_rate_365"] == pytest.approx([0.95, 0.95], abs=0.03)


def test_skin_deflection_is_complete_and_trial_3_follows_the_observed_skin(first):
    found = first.results["skin_deflection"]
    for trial in ("trial1", "trial2", "trial3"):
        for profile in found[trial].values():
            distance, deflection = profile["distance_mm"], profile["deflection_mm"]
            assert len(distance) == len(deflection) > 20
            assert 0.5 < max(deflection) <= 1.01
            assert abs(distance[int(np.argmax(deflection))]) < 0.6
            assert 50.0 < profile["force_mn"] < 1000.0
        assert found[trial]["cylinder"]["r2"] < 1.0
    assert found["trial3"]["cylinder"]["r2"] >= 0.93


def test_single_unit_is_complete_and_reaches_the_papers_fss(of_set):
    found = of_set["single_unit"]
    np.testing.assert_allclose(np.diff(found["shift_mm"]), 0.2, rtol=0, atol=1e-12)
    assert len(found["folds"]) == 6
    mean = np.mean([fold["fss_test"] for fold in found["folds"]])
    assert 0.81 <= found["fss_out_of_sample"] == pytest.approx(mean, rel=1e-12)


def test_what_goes_beyond_the_paper_comes_on_top(second):
    for name in SETS:
        assert None not in second[name].values()
        assert second["summary"][name]["weber_287"] > 0.0
    assert all(math.isfinite(number) for number in numbers(second))


@pytest.mark.parametrize(
    ("words", "goes_beyond"),
    [((), True), (("--no-extended",), False), (("--resolution", "quick"), False),
     (("--resolution", "quick", "--extended"), True)],
)  # fmt: skip
def test_the_command_goes_beyond_the_paper_where_asked_and_by_default_not_when_quick(
    run_program, monkeypatch, words, goes_beyond
):
    asked = []

    def note(columns, extended, runner):
        asked.append(extended)
        raise InputError("That is all.")

    monkeypatch.setattr("fingerpad.experiments.run.reproduce", note)
    run_program(cli.main, "fingerpad", "reproduce", *words)
    assert asked == [goes_beyond]


def test_discrimination_is_complete(of_set):
    found = of_set["discrimination"]
    assert 0.0 < found["noise_sigma"] < 1.0
    assert set(found["gradient_sum"]) == set(MEASURES)
    assert set(found["euclidean"]) == {"static"}
    for table in (*found["gradient_sum"].values(), found["euclidean"]["static"]):
        for name in HIT_RATES:
            assert len(table[name]) == 6
            assert all(0.0 <= value <= 1.0 for value in table[name])
    for position in ("hit_rate", "hit_rate_shifted"):
        assert (np.diff(found["gradient_sum"]["static"][position]) > 0).all()


def test_the_nail_concentrates_stress(of_set):
    nail = of_set["nail"]
    assert nail["border_kpa"] > 0.0
    # Figure 9: stress at the border of the nail stands out from the skin beside it in every section.
    low, high = nail["ratio_range"]
    assert 1.1 < low <= nail["ratio"] <= high


def test_the_manifest_holds_the_command_that_repeats_the_run(first):
    manifest = first.results["manifest"]
    assert (manifest["version"], manifest["seed"], manifest["resolution"]) == (__version__, 0, "quick")
    assert all(mesh["nodes"] > mesh["elements"] > 1000 for mesh in manifest["meshes"].values())
    assert 100.0 < manifest["peak_memory_mb"] < 4000.0
    assert 1.0 < manifest["wall_s"] <= first.wall_s
    stages = manifest["stages"]
    pressed = [stage for stage in stages if stage.get("computed") is not None]
    assert [stage["computed"] for stage in pressed] == [6, *[1, 4, 36, 14] * 2]
    assert stages[0]["wall_s"] > 0.5 * manifest["wall_s"]
    for stage in pressed:
        assert 0.0 < stage["largest_force_imbalance"] <= 1e-4
        assert 0.0 < stage["largest_energy_imbalance"] < BALANCE
        assert all(reason.startswith("geometric multigrid") for reason in stage["linear_solvers"])
    assert all(mesh["smallest_gauss_jacobian_mm3"] > 0 for mesh in manifest["meshes"].values())


# The page


def test_the_page_shows_every_compared_number_and_figure_and_no_machine_path(first):
    page = (first.folder / "report.html").read_text(encoding="utf-8")
    text = re.sub(r"\s+", " ", re.sub(r"<[^>]*>", " ", page))
    for name in SETS:
        for row in first.results[name]["comparison"]:
            assert row["ours"] in text
    assert str(first.folder) not in page
    assert str(Path.home()) + "/" not in page
    results = from_json(ReproductionResult, (first.folder / "results.json").read_bytes())
    drawings = page_of("reproduction", results).drawings
    assert page.count("<img ") == sum(len(drawing.images) for drawing in drawings)
    for path in (first.folder / "figures").iterdir():
        content = path.read_bytes()
        assert content.startswith(b"\x89PNG\r\n\x1a\n")
        assert content.endswith(b"IEND\xaeB`\x82")
        assert min(struct.unpack(">II", content[16:24])) > 400


# Again


def unmeasured(results):
    def kept(values):
        return {name: value for name, value in values.items() if name not in MEASURED}

    summary = {name: kept(results["summary"][name]) for name in SETS}
    return results | {"manifest": kept(results["manifest"]), "summary": summary}


def test_a_second_run_takes_everything_from_the_store_and_another_seed_changes_what_observers_draw(
    first, second, stamps
):
    found = {path.name: path.stat().st_mtime_ns for path in (first.folder / STORE_FOLDER).iterdir()}
    assert {name: found[name] for name in stamps} == stamps
    stages = {stage["name"]: stage.get("computed") for stage in second["manifest"]["stages"]}
    assert {name: n for name, n in stages.items() if n} == dict.fromkeys(
        (f"{name}: spheres, other curvatures" for name in SETS), 8
    )
    ours, theirs = unmeasured(first.results), unmeasured(second)
    assert theirs["manifest"] == ours["manifest"] | {"seed": 7}
    for section in set(ours) - {*SETS, "manifest", "summary", "statements"}:
        assert json.dumps(theirs[section]) == json.dumps(ours[section])
    for name in SETS:
        for section in set(ours[name]) - BEYOND - {"comparison", "discrimination"}:
            assert json.dumps(theirs[name][section]) == json.dumps(ours[name][section])
    drawn, drawn_theirs = ours["human"]["discrimination"], theirs["human"]["discrimination"]
    for name in ("curvature_per_m", "goodwin", "noise_sigma_paper"):
        assert drawn_theirs[name] == drawn[name]
    for measure in MEASURES:
        rates, rates_theirs = drawn["gradient_sum"][measure], drawn_theirs["gradient_sum"][measure]
        assert rates_theirs["hit_rate"] != rates["hit_rate"]
        np.testing.assert_allclose(rates_theirs["hit_rate"], rates["hit_rate"], rtol=0, atol=0.1)


# The paper's question as a question of one's own


PAPERS_QUESTION = """
question: Which spheres can be discriminated from one of 287 /m?
resolution: quick
tissues: human
object: {kind: sphere}
motion: {depth_mm: 1.0, ramp_ms: 50, hold_ms: 950}
stimuli: {vary: object.curvature_per_m, values: [287, 296, 305, 316, 328, 340, 365]}
standard: 287
afferents: {afferent: results.json}
measure: [static, dynamic, latency]
noise: {noise}
"""


def test_the_papers_question_asked_as_ones_own_has_the_papers_hit_rates_also_if_killed(first, tmp_path):
    """Every press is stored already, until three are lost; warnings are errors."""
    shutil.copytree(first.folder / STORE_FOLDER, tmp_path / STORE_FOLDER)
    shutil.copy(first.folder / "results.json", tmp_path)
    theirs = first.results["human"]["discrimination"]
    question = tmp_path / "question.yaml"
    question.write_text(PAPERS_QUESTION.replace("{noise}", repr(theirs["noise_sigma"])))
    command = (*COMMAND[:-1], "discriminate", "question.yaml", "--out", ".", "--jobs", "1")
    done = subprocess.run(command, capture_output=True, text=True, check=False, cwd=tmp_path)
    assert done.returncode == 0, done.stderr
    assert done.stdout.startswith("Gradient Sum of static rates discriminates 296 from 287 in ")
    results = json.loads((tmp_path / "discriminate.json").read_text())
    (stimuli,) = (stage for stage in results["manifest"]["stages"] if stage["name"] == "stimuli")
    assert (stimuli["computed"], stimuli["indentations"]) == (0, 7)
    decodings = results["discrimination"]["decodings"]
    assert {decoding["measure"] for decoding in decodings} == set(MEASURES)
    for decoding in decodings:
        rates = theirs["gradient_sum"][decoding["measure"]]
        assert [decoding[name] for name in HIT_RATES[:2]] == [rates[name] for name in HIT_RATES[:2]]

    touches = fp.DiscriminationRequest.read(question).touches.values()
    spheres = [Store(tmp_path / STORE_FOLDER).path(touch) for touch in touches]
    stored = {path: path.read_bytes() for path in spheres}
    for path in spheres[:3]:
        path.unlink()
    run = subprocess.Popen(
        [*command[:-1], "2"],
        stdout=subprocess.PIPE,
        stderr=subprocess.PIPE,
        cwd=tmp_path,
        start_new_session=True,
    )
    while run.poll() is None and not any(path.exists() for path in spheres[:3]):
        time.sleep(0.02)
    assert run.poll() is None
    os.killpg(run.pid, signal.SIGKILL)
    run.communicate()
    assert sum(path.exists() for path in spheres[:3]) < 3
    (tmp_path / "discriminate.json").unlink()
    assert subprocess.run(command, capture_output=True, check=False, cwd=tmp_path).returncode == 0
    assert {path: path.read_bytes() for path in spheres} == stored
    assert (
        json.loads((tmp_path / "discriminate.json").read_text())["discrimination"]
        == results["discrimination"]
    )
