"""Observations that users bring: reading them, scoring them, and the command as a shell meets it."""

import json
import re
import shutil
from dataclasses import replace
from pathlib import Path
from types import SimpleNamespace

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

import fingerpad as fp
from fingerpad import cli
from fingerpad.data import cylinder_deflection, protocol
from fingerpad.experiments import scores
from fingerpad.experiments.conditions import RECEPTOR_X_MM, Conditions
from fingerpad.experiments.examples import examples
from fingerpad.experiments.gerling2014.skin import deflection_r2, deflection_touches
from fingerpad.experiments.requests.stimulus import indenter_named
from fingerpad.experiments.run import run
from fingerpad.experiments.runner import STORE_FOLDER, Runner
from fingerpad.experiments.schemas import read
from fingerpad.experiments.validation import validation
from fingerpad.experiments.validation.observations import COLUMNS, KINDS, WORDS, read_observations
from fingerpad.experiments.validation.validation import predict
from fingerpad.report.results import draw_validation, summary
from fingerpad.skin.indentation import Touch
from fingerpad.skin.store import Store
from refusals import misused

ROOT = Path(__file__).parents[1]
PUBLISHED = sorted((ROOT / "studies" / "observations").glob("*.csv"))
QUICK = Conditions(resolution="quick")
FORCE = "indenter,depth_mm,force_n\n"
RATE = "force_n,curvature_per_m,rate_hz\n"


def written(folder, content, name="mine.csv"):
    path = folder / name
    path.write_bytes(content if isinstance(content, bytes) else content.encode())
    return path


def test_an_indenter_is_its_name_and_its_sizes():
    for text, body in (
        ("plate", fp.Plate()),
        ("punch:6.35", fp.FlatPunch(6.35)),
        ("punch", fp.FlatPunch()),
        (" sphere : 287 ", fp.Sphere(curvature_per_m=287.0)),
        ("bar:3:0.2", fp.Bar(3.0, 0.2)),
        ("grating:1.5:0.75", fp.Grating(1.5, 0.75)),
    ):
        assert indenter_named(text) == body
    for text, said in (
        ("", "indenter must be one of sphere, cylinder"),
        ("plate:3", "indenter must be written plate, sizes from the right may be left out: got 'plate:3'"),
        ("sphere:287:1", "indenter must be written sphere:curvature_per_m"),
        ("punch:", "diameter_mm must be a finite number [mm]: got ''"),
        ("cylinder:-1", "diameter_mm must lie within 0.01 to 400 mm"),
        ("punch:0.4", "fillet_mm must not exceed half of diameter_mm, 0.2 mm"),
    ):
        with pytest.raises(fp.InputError, match=re.escape(said)):
            indenter_named(text)


def test_columns_stand_in_any_order_and_lines_keep_their_numbers(tmp_path):
    path = written(
        tmp_path,
        "\ufeff# four subjects\r\nforce_n, depth_mm ,indenter\r\n\r\n"
        "0.11,1,plate\r\n# and\r\n0.2,1.0, punch:6.350\r\n0.3,1e0,punch:6.35\r\n",
    )
    found = read_observations(path)
    assert (found.kind.name, found.kind.observed) == ("force", "force_n")
    assert [row.line for row in found.rows] == [4, 6, 7]
    assert [row.condition for row in found.rows] == [
        (each, 1.0) for each in ("plate", "punch:6.350", "punch:6.35")
    ]
    assert found.observed.tolist() == [0.11, 0.2, 0.3]
    assert found.conditions[1] == found.conditions[2] != found.conditions[0]


@pytest.mark.parametrize("kind", KINDS.values(), ids=lambda kind: kind.name)
def test_the_header_decides_the_kind_and_every_example_is_read(tmp_path, kind):
    text = examples()[kind.name].text
    assert text.startswith("# Made-up numbers")
    found = read_observations(written(tmp_path, text))
    assert found.kind == kind
    assert len(set(found.conditions)) < len(found.rows) or kind.name == "grating"
    assert set(kind.columns) <= {"indenter", *WORDS, *COLUMNS}


UNFIT = [
    (FORCE, "mine.csv must hold a header and at least one row: it has 1 of them."),
    ("indenter,depth_mm\nplate,1\n", "mine.csv, header: must be that of one kind (indenter,"),
    ("indenter,depth_mm\nplate,1\n", "got indenter,depth_mm; for the kind force, add force_n."),
    ("indenter,depth_mm,position_mm,force_n\nplate,1,0,1\n", "for the kind force, leave out position_mm."),
    ("indenter;depth_mm;force_n\nplate;1;2\n", "Separate entries by commas, not by ';'."),
    (FORCE + "plate,1,1\nplate,-1,1\n", "mine.csv, line 3: depth_mm must not be negative [mm]: got -1.0."),
    (FORCE + "plate,nan,1\n", "mine.csv, line 2: depth_mm must be a finite number [mm]"),
    (FORCE + "plate,1,\n", "mine.csv, line 2: force_n must be given"),
    (FORCE + "punch:x,1,1\n", "mine.csv, line 2: diameter_mm must be a finite number"),
    (RATE + "0.2,30,-1\n", "mine.csv, line 2: rate_hz must not be negative [spikes/s]"),
    (FORCE + "plate,1,1\n" * 1_000_000, "mine.csv must have at most 1 MB: got 10 MB; split it"),
]


@pytest.mark.parametrize(("content", "said"), UNFIT, ids=[said[-40:] for _, said in UNFIT])
def test_unfit_files_are_one_sentence_with_file_and_line(tmp_path, monkeypatch, content, said):
    monkeypatch.chdir(tmp_path)
    written(tmp_path, content)
    with pytest.raises(fp.InputError) as refused:
        read_observations(Path("mine.csv"))
    assert said in str(refused.value)
    assert "\n" not in str(refused.value)


def test_scores_have_their_definitions():
    observed, predicted = np.array([1.0, 2.0, 4.0]), np.array([1.0, 1.0, 3.0])
    # mean 7/3, scatter 42/9; residuals 0, 1, 1; sum o p = 15, sum p p = 11
    assert scores.coefficient_of_determination(observed, predicted) == pytest.approx(1 - 2 / (42 / 9))
    assert scores.gain_through_origin(observed, predicted) == pytest.approx(15 / 11)
    assert scores.correlation(observed, predicted) == pytest.approx(np.corrcoef(observed, predicted)[0, 1])


def test_scores_that_do_not_exist_are_nan():
    r2, gain = scores.coefficient_of_determination, scores.gain_through_origin
    correlation = scores.correlation
    for observed, predicted, undefined in (
        ([], [], [r2, gain, correlation]),
        ([1.0], [2.0], [r2, correlation]),
        ([0.1, 0.1, 0.1], [0.1, 0.2, 0.3], [r2, correlation]),
        ([1.0, 2.0], [0.3, 0.3], [correlation]),
        ([1.0, 2.0], [0.0, 0.0], [correlation, gain]),
    ):
        for score in (r2, gain, correlation):
            assert np.isnan(score(observed, predicted)) == (score in undefined), score


@given(st.lists(st.tuples(st.integers(0, 3), st.floats(-1e3, 1e3)), min_size=1, max_size=12))
def test_ranges_are_those_of_equal_conditions(rows):
    conditions, observed = zip(*rows, strict=True)
    ranges = scores.observed_ranges(conditions, observed)
    inside = ranges.inside(np.array(observed))
    for row, condition in enumerate(conditions):
        same = [value for other, value in rows if other == condition]
        assert (ranges.low[row], ranges.high[row]) == (min(same), max(same))
        assert inside[row] == (True if len(same) > 1 else None)
    assert [conditions[row] for row in ranges.first] == list(dict.fromkeys(conditions))


@pytest.fixture(scope="module")
def folder(tmp_path_factory):
    """A folder that keeps the presses of this file."""
    return tmp_path_factory.mktemp("validation")


def request_of(folder, content, **keys):
    """Request of a validation at quick resolution."""
    return fp.ValidationRequest.read(keys | {"observations": written(folder, content), "resolution": "quick"})


def result_of(folder, content, **keys):
    return run(request_of(folder, content, **keys), Runner(folder))


def test_force_at_depth_0_is_0_and_grows_with_depth(folder):
    found = result_of(folder, FORCE + "plate,0,0\nplate,0.2,0.01\nplate,0.4,0.5\nplate,0.2,0.03\n")
    nothing, low, high, again = (row.predicted for row in found.predictions)
    assert nothing == 0.0 < low < high
    assert low == again
    ranges = [(row.observed_low, row.observed_high) for row in found.predictions]
    assert ranges == [(0.0, 0.0), (0.01, 0.03), (0.5, 0.5), (0.01, 0.03)]
    assert found.n_judged == 1
    assert found.predictions[1].inside_range == (0.01 <= low <= 0.03)
    assert found.predictions[2].inside_range is None
    assert found.afferent is None
    assert found.loading == "ramp_and_hold"


def test_quasi_static_force_is_that_of_relaxed_tissues(folder):
    """Tissues whose Prony series is left out have the long-term moduli at all times."""
    relaxed = fp.Tissues(*(layer.with_prony(fp.Prony()) for layer in fp.named_tissues("human").layers))
    of_fast, of_elastic, of_slow = (
        result_of(folder, FORCE + "plate,0.4,0.1\n", **keys).predictions[0].predicted
        for keys in ({}, {"tissues": relaxed}, {"loading": "quasi_static"})
    )
    assert of_slow == pytest.approx(of_elastic, rel=1e-5)
    assert of_fast > 1.3 * of_slow


RATES = RATE + "0.1,287,30\n0,287,0\n"


def test_predictions_put_in_as_observations_score_1(folder):
    first = result_of(folder, RATES)
    exact = [repr(row.predicted) for row in first.predictions]
    conditions = [f"{row.force_n!r},{row.curvature_per_m!r}" for row in first.predictions]
    rows = [f"{condition},{rate}" for condition, rate in zip(conditions, exact, strict=True)]
    again = result_of(folder, RATE + "\n".join(2 * rows))
    assert (again.r2, again.r2_after_gain, again.gain) == (1.0, 1.0, 1.0)
    assert again.correlation == pytest.approx(1.0, abs=1e-12)
    assert (again.inside_range, again.share_inside, again.n_judged) == (True, 1.0, 2)
    assert np.isnan(again.r2_mirrored)
    assert again.static_window_ms == protocol.STATIC_WINDOW.value
    assert again.receptor_depth_mm == 0.471
    sphere, rest = (row.predicted for row in first.predictions)
    assert sphere > rest


def test_a_receptor_beside_the_contact_fires_less_and_0_is_the_middle(folder):
    middle = result_of(folder, RATES).predictions[0].predicted
    header = "force_n,curvature_per_m,position_mm,rate_hz\n"
    found = result_of(folder, header + "0.1,287,0,30\n0.1,287,3,1\n0.1,287,-3,2\n0.1,287,40,2\n")
    centre, proximal, distal, beyond = found.predictions
    assert centre.predicted == middle > max(proximal.predicted, distal.predicted)
    assert np.isnan(beyond.predicted)
    # With the axis reversed, 3 and -3 mm change places.
    observed, mirrored = np.array([30.0, 1.0, 2.0]), [middle, distal.predicted, proximal.predicted]
    assert found.r2_mirrored == pytest.approx(scores.coefficient_of_determination(observed, mirrored))


@pytest.fixture
def pressed(monkeypatch):
    """What is pressed and where the receptors are, without pressing."""
    touches, sites = [], []

    def responses(runner, groups, on_failed):
        for group in groups.values():
            touches.extend(group)
        return {name: dict.fromkeys(group, "skin") for name, group in groups.items()}

    class Receptor:
        def __init__(self, positions, pitch, afferent, depth_mm):
            sites.append(positions[0])

        def respond(self, skin, static_window_ms):
            return SimpleNamespace(static_rate_hz=[7.0])

    monkeypatch.setattr(Runner, "responses", responses)
    monkeypatch.setattr(validation, "Population", Receptor)
    return touches, sites


def test_curvature_0_is_a_plate_on_the_mesh_of_all_spheres(pressed, tmp_path):
    touches, sites = pressed
    rows = RATE + "0.2,0,3\n0.2,900,3\n0.8,80,3\n0.2,900,4\n"
    predict(request_of(tmp_path, rows), Runner(tmp_path))
    spheres = [fp.Sphere(curvature_per_m=curvature) for curvature in (900.0, 80.0)]
    assert [touch.indenter for touch in touches] == [fp.Plate(), *spheres]
    assert [touch.stimulus.force_mn for touch in touches] == [200.0, 200.0, 800.0]
    assert len({touch.grading for touch in touches}) == 1
    assert {touch.tilt_deg for touch in touches} == {QUICK.skin_tilt_deg}
    assert np.array(sites) == pytest.approx(np.array([[RECEPTOR_X_MM, 0.0]] * 3))


def test_positions_on_a_grating_repeat_with_its_period(pressed, tmp_path):
    touches, sites = pressed
    header = "force_n,ridge_mm,groove_mm,position_mm,rate_hz\n"
    asked = request_of(tmp_path, header + "0.2,1,2,0.5,3\n0.2,1,2,-2.5,3\n0.2,0.3,2,0,3\n")
    assert predict(asked, Runner(tmp_path)).values.tolist() == [7.0, 7.0, 7.0]
    assert [touch.indenter for touch in touches] == [fp.Grating(1.0, 2.0), fp.Grating(0.3, 2.0, 0.15)]
    along = np.cos(np.deg2rad(QUICK.skin_tilt_deg))
    assert np.array(sites)[:3] == pytest.approx(
        np.array([[RECEPTOR_X_MM - 0.5 * along, 0.0]] * 2 + [[RECEPTOR_X_MM, 0.0]])
    )


def test_what_cannot_be_pressed_has_a_reason_and_the_rest_is_scored(folder, monkeypatch):
    solve = Touch.solve

    def limited(touch, threads=None):
        if isinstance(touch.stimulus, fp.RampAndHold) and touch.stimulus.depth_mm == 0.3:
            raise fp.ConvergenceError("The press stopped.", ("at 3 ms",))
        return solve(touch, threads)

    monkeypatch.setattr(Touch, "solve", limited)
    rows = "plate,0.3,1\nplate,0.2,0.01\nplate,9,3\nplate,0.4,0.04\nplate,0.3,2\n"
    found = result_of(folder, FORCE + rows)
    assert [np.isfinite(row.predicted) for row in found.predictions] == [False, True, False, True, False]
    assert found.predictions[0].reason == found.predictions[4].reason == "The press stopped."
    assert "because of the bone" in found.predictions[2].reason
    assert (found.n_rows, found.n_predicted, found.n_judged, found.inside_range) == (5, 2, 0, None)
    kept = found.predictions[1], found.predictions[3]
    assert found.r2 == pytest.approx(
        scores.coefficient_of_determination([row.observed for row in kept], [row.predicted for row in kept])
    )
    assert "3 row(s) have no prediction. The first reason: The press stopped." in summary("validate", found)
    nothing = result_of(folder, FORCE + "plate,0.3,1\n")
    assert nothing.n_predicted == 0
    assert np.isnan([nothing.r2, nothing.gain, nothing.correlation, nothing.share_inside]).all()
    draw_validation(nothing)


@pytest.mark.parametrize("path", PUBLISHED, ids=lambda path: path.stem)
def test_published_files_name_source_and_status(path):
    text = path.read_text(encoding="utf-8")
    assert re.search(r"^# source: \S.+$", text, re.MULTILINE)
    assert re.search(r"^# status: (paper|read)$", text, re.MULTILINE)
    assert read_observations(path).rows


def test_the_published_deflection_scores_as_in_the_reproduction(folder):
    [path] = [path for path in PUBLISHED if path.stem == "cylinder_deflection"]
    found, table = read_observations(path), cylinder_deflection()
    assert found.observed.tolist() == table.deflection_mm[~table.is_artefact].tolist()
    assert [row.condition[2] for row in found.rows] == table.distance_mm[~table.is_artefact].tolist()
    third = Conditions(resolution="quick", tissues="trial3")
    keys = {"resolution": third.resolution, "tissues": third.tissues}
    scored = run(fp.ValidationRequest.read({"observations": found} | keys), Runner(folder))
    touch = deflection_touches(third)["trial3", "cylinder"]
    profile = Store(folder / STORE_FOLDER).load(touch).surface_profile()
    assert scored.r2 == pytest.approx(deflection_r2(profile), abs=1e-12)
    assert scored.r2_mirrored == pytest.approx(deflection_r2(profile, proximal_positive=False), abs=1e-12)


@pytest.fixture
def call(run_program):
    """Run `fingerpad validate` in an empty folder."""
    return lambda *arguments: run_program(cli.main, "fingerpad", "validate", *arguments)


def test_the_command_writes_page_figure_and_results(call, folder, tmp_path):
    rows = "plate,0.2,0.01\nplate,0.2,0.03\nplate,0.4,0.05\n"
    result_of(folder, FORCE + rows)
    shutil.copytree(folder / STORE_FOLDER, tmp_path / "validate" / STORE_FOLDER)
    written(tmp_path, FORCE + rows + "plate,9,1\n")
    status, said, _ = call("mine.csv", "--resolution", "quick", "--jobs", "1")
    assert status == 3
    assert "force, 3 of 4 rows predicted: R²" in said
    assert "1 row(s) have no prediction. The first reason: depth_mm must stay below" in said
    results = json.loads((tmp_path / "validate" / "validate.json").read_text())
    assert results == read(tmp_path / "validate" / "validate.json", "fingerpad validation")
    assert {"r2", "correlation", "gain", "inside_range", "predictions"} <= set(results)
    assert (results["format"], results["format_version"]) == ("fingerpad validation", 1)
    assert [row["predicted"] is None for row in results["predictions"]] == [False, False, False, True]
    assert list(results["manifest"]["inputs"]) == ["mine.csv"]
    page = (tmp_path / "validate" / "validate.html").read_text(encoding="utf-8")
    assert "observed" in page
    assert "because of the bone" in page
    assert (tmp_path / "validate" / "figures" / "validation.png").read_bytes().startswith(b"\x89PNG")


def test_an_interrupted_run_keeps_what_is_finished_and_goes_on(call, folder, tmp_path, monkeypatch):
    rows = "plate,0.2,0.01\nplate,0.4,0.05\n"
    expected = result_of(folder, FORCE + rows)
    source, target = Store(folder / STORE_FOLDER), Store(tmp_path / "validate" / STORE_FOLDER)
    pressed = {}

    def press_until_stopped(touch, threads=None):
        if pressed and not is_resumed:
            raise KeyboardInterrupt
        pressed[touch] = True
        return source.load(touch)

    is_resumed = False
    monkeypatch.setattr(Touch, "solve", press_until_stopped)
    written(tmp_path, FORCE + rows)
    options = ("mine.csv", "--resolution", "quick", "--jobs", "1")
    status, said, errors = call(*options)
    assert (status, said) == (130, "")
    assert "The same command continues after the last finished indentation" in errors
    assert [target.holds(touch) for touch in pressed] == [True]
    assert not (tmp_path / "validate" / "validate.json").exists()
    first, is_resumed = set(pressed), True
    pressed.clear()
    assert call(*options)[0] == 0
    assert len(pressed) == 1
    assert not first & pressed.keys()
    results = json.loads((tmp_path / "validate" / "validate.json").read_text())
    assert [row["predicted"] for row in results["predictions"]] == [
        row.predicted for row in expected.predictions
    ]


def test_a_layer_is_compressed_as_its_nodes_come_closer(tmp_path):
    layers = ("stratum_corneum", "living_epidermis", "dermis")
    rows = "".join(f"1,{layer},0.1\n" for layer in layers) + "0,dermis,0\n"
    file = written(tmp_path, "force_n,layer,strain\n" + rows)
    found = [row.predicted for row in fp.validate(observations=file, resolution="quick").predictions]
    tilt_deg = QUICK.skin_tilt_deg
    skin = fp.indent(
        QUICK.finger,
        fp.Plate(),
        fp.ForceRampAndHold(force_mn=1000.0),
        tilt_deg=tilt_deg,
        at_mm=(RECEPTOR_X_MM, 0),
    )
    rest, mesh = skin.mesh.nodes_mm, skin.mesh
    below = np.abs(rest[:, [0, 2]] - (RECEPTOR_X_MM, 0.0)).max(axis=1) < 2.0
    moved = rest + skin.displacement_mm
    depths = (0.0, *QUICK.finger.layer_depths_mm)
    surface = QUICK.finger.skin_point(RECEPTOR_X_MM, 0.0)
    inward = -QUICK.finger.skin_normal(surface).ravel()

    def height(at_mm):
        """Height of the tissue that lay so deep below the middle of the contact, along the normal."""
        wanted = surface.ravel() + at_mm * inward
        near = below & (np.abs((rest - wanted) @ inward) < 0.02)
        return float((moved[near] @ inward)[np.argmin(np.linalg.norm(rest[near] - wanted, axis=1))])

    heights = np.array([height(depth) for depth in depths])
    assert found[:3] == pytest.approx(1.0 - np.diff(heights) / np.diff(depths), rel=0.2)
    assert found[3] == 0.0
    assert mesh.nodes_mm is rest


@pytest.mark.filterwarnings("ignore::fingerpad.core.errors.InertiaWarning")
def test_a_receptive_field_holds_the_places_from_which_a_probe_elicits_a_tenth(tmp_path):
    file = written(tmp_path, "afferent,depth_mm,area_mm2\nRA,0.3,5\nRA,0.1,5\nRA,0,0\n")
    deep, shallow, none = (
        row.predicted for row in fp.validate(observations=file, resolution="quick").predictions
    )
    assert 0.0 == none < shallow < deep
    # The probe itself goes to places beside the receptor.
    motion, radius = fp.RampAndHold(0.3, 15.0, 300.0), np.sqrt(deep / np.pi)
    receptor = fp.Population(np.array([[RECEPTOR_X_MM, 0.0]]), 1.0, fp.RA())
    middle, inside, outside = (
        receptor.respond(
            fp.indent(QUICK.finger, fp.FlatPunch(1.0, 0.2), motion, at_mm=(RECEPTOR_X_MM, away))
        ).spikes.counts[0]
        for away in (0.0, radius - 0.25, radius + 0.25)
    )
    assert inside >= max(1.0, 0.1 * middle) > outside


class Drum(SimpleNamespace):
    """Skin over which dots pass, and that has dents of its own until they have moved by one spacing."""

    def sed(self, sites, dynamic_quantity, static_quantity):
        motion, since_mm = self.motion, np.asarray(self.motion.x_mm)
        lag = np.asarray(sites)[:, 1]
        heights = 1.0 + np.cos(2 * np.pi * (since_mm[:, None] - lag) / self.spacing_mm)
        heights[since_mm < self.spacing_mm] *= 5.0
        times = np.asarray(motion.times_ms)
        both = [
            fp.Traces(times, 9.0 * heights, quantity=each) for each in (dynamic_quantity, static_quantity)
        ]
        return replace(both[1], dynamic=both[0])


def test_dots_are_counted_while_one_spacing_passes_again_and_again(tmp_path):
    file = written(tmp_path, "afferent,spacing_mm,speed_mm_s,force_n,rate_hz\nSAI,3,60,0.6,60\nRA,3,60,0,0\n")
    request = validation.ValidationRequest(observations=file, resolution="quick")
    moving, none = (
        validation.planned(
            KINDS["dots"], dict(zip(KINDS["dots"].conditions, row.condition, strict=True)), request
        )
        for row in request.observed.rows
    )
    assert (none.touch, none.of(None)) == (None, 0.0)
    body, motion = moving.touch.indenter, moving.touch.stimulus
    assert set(np.diff(sorted({x for x, _ in body.at_mm})).round(9)) == {3.0}
    assert motion.x_mm[-1] == 6.0
    assert motion.end_ms == pytest.approx(50.0 + 150.0 + 2 * 50.0)
    # The same afferents in a skin under which dots have passed since ever.
    steps = np.arange(1.0, 481.0)
    forever = SimpleNamespace(times_ms=50.0 / 12 * steps, x_mm=3.0 + 0.25 * steps)
    places = np.column_stack([np.full(4, RECEPTOR_X_MM), 1.5 * (np.arange(4) + 0.5) / 4])
    traces = fp.Population(places, 1.0).followed(Drum(motion=forever, spacing_mm=3.0))
    counts = [((train >= 500.0) & (train < 1500.0)).sum() for train in fp.Afferent().spikes(traces)]
    found = moving.of(Drum(motion=motion, spacing_mm=3.0))
    assert found > 10.0
    assert found == pytest.approx(np.mean(counts), abs=1.0)


def test_traces_are_repeated_from_a_time_that_is_there_but_for_rounding():
    times = [0.0, 0.1 + 0.2, 1.0]
    passed = fp.Traces(times, [[0.0], [2.0], [3.0]])
    assert passed.repeated(0.3, count=2).times_ms == pytest.approx([0.0, 0.7, 1.4])
    with pytest.raises(fp.InputError, match="start_ms must be before the end, 1 ms"):
        passed.repeated(1.0, count=2)


def test_adaptation_is_the_interval_at_a_time_of_the_hold(tmp_path):
    file = written(tmp_path, "depth_mm,time_ms,rate_hz\n0.8,100,60\n0.8,900,45\n0,5,0\n")
    early, late, none = (
        row.predicted for row in fp.validate(observations=file, resolution="quick").predictions
    )
    skin = fp.indent(
        QUICK.finger, fp.FlatPunch(2.0), fp.RampAndHold(0.8, hold_ms=1900.0), tilt_deg=QUICK.skin_tilt_deg
    )
    train = fp.Population(np.array([[RECEPTOR_X_MM, 0.0]]), 1.0).respond(skin).spikes[0]
    for rate_hz, time_ms in ((early, 150.0), (late, 950.0)):
        after = train[train > time_ms][0] - train[train < time_ms][-1]
        assert rate_hz == pytest.approx(1000.0 / after, rel=0.02)
    assert (early > late > 0.0, none) == (True, 0.0)


@pytest.mark.parametrize("kind", KINDS)
def test_an_example_can_be_tried_as_it_says(run_program, tmp_path, kind):
    status, said, errors = run_program(cli.main, "fingerpad", "init", kind, "--out", "try")
    assert (status, errors) == (0, "")
    assert said == f"Try: fingerpad validate try/{kind}.csv\n"
    assert read_observations(tmp_path / "try" / f"{kind}.csv").kind.name == kind


@pytest.mark.parametrize(
    ("arguments", "said"),
    [
        ([], "validate needs a file, observations or options: see --help"),
        (["none.csv"], "none.csv must be a file that can be read"),
        (["."], ". must be a file that can be read"),
        (["mine.csv", "--loading", "slow"], "loading must be one of ramp_and_hold, quasi_static: got 'slow'"),
        (["mine.csv", "--tissues", "wood"], "tissues must be one of"),
        (["mine.csv", "--resolution", "high"], "resolution must be one of"),
        (["mine.csv", "--jobs", "0"], "jobs must be a whole number of at least 1"),
        (["mine.csv", "--afferent", "fit.json"], "afferent: fit.json must be a file that can be read"),
        (["mine.csv", "--static-window-ms", "600,500"], "--static-window-ms must be a start"),
        (["mine.csv"], "mine.csv, line 2: depth_mm must not be negative"),
    ],
    ids=" ".join,
)
def test_misuse_is_one_sentence_and_status_2_and_nothing_is_written(call, tmp_path, arguments, said):
    content = "plate,1,1\n" if len(arguments) > 1 else "plate,-1,1\n"
    written(tmp_path, FORCE + content)
    misused(call(*arguments), said)
    assert [path.name for path in tmp_path.iterdir()] == ["mine.csv"]


@pytest.mark.parametrize(
    "tissues",
    ["human", "paper", "trial3", "wu2007", fp.named_tissues("human")],
    ids=lambda each: str(each)[:6],
)
def test_the_afferent_is_that_of_the_tissues_unless_one_is_given(tissues):
    own = fp.Afferent(static_gain=1e-6)
    for chosen, expected in (("default", fp.Afferent.for_tissues(tissues)), (own, own)):
        asked = {"observations": "any.csv", "tissues": tissues, "afferent": chosen}
        assert fp.ValidationRequest.read(asked).responding == expected


def test_the_page_of_the_format_names_every_kind_and_the_window_is_the_paper_s():
    assert fp.ValidationRequest.model_fields["static_window_ms"].default == protocol.STATIC_WINDOW.value
    page = (ROOT / "docs" / "validate.md").read_text(encoding="utf-8")
    for kind in KINDS.values():
        assert f"| `{kind.name}` | `{','.join(kind.columns)}` |" in page
