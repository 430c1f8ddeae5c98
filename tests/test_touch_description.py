"""Requests of a touch: what they mean, what is refused, and what their commands write."""

import hashlib
import json
import re
from functools import partial
from pathlib import Path

import fastjsonschema
import numpy as np
import pytest
from hypothesis import HealthCheck, given, settings
from hypothesis import strategies as st

import fingerpad as fp
from fingerpad import cli
from fingerpad.core.plain_yaml import read_yaml
from fingerpad.core.result_files import from_json, to_json
from fingerpad.experiments import schemas
from fingerpad.experiments.conditions import RECEPTOR_X_MM, Conditions
from fingerpad.experiments.examples import examples
from fingerpad.experiments.requests.parts import part_from
from fingerpad.experiments.requests.stimuli import StimulusSet, named_stimuli
from fingerpad.experiments.requests.stimulus import MOTIONS, OBJECTS
from fingerpad.experiments.requests.touch import (
    BASE_MB,
    OUTPUTS,
    OWN_EXPONENT,
    OWN_NODE_MB,
    OWN_NODES,
    TouchFile,
    estimate_press,
)
from fingerpad.export.decks import FORMATS
from fingerpad.export.requests import check_outputs
from fingerpad.geometry import height_maps
from fingerpad.geometry.bodies import Dots
from fingerpad.geometry.embossed import Embossed
from fingerpad.neuron.afferent_types import afferent_types
from fingerpad.skin.indentation import Touch
from tests.mutations import CHANGES, VALUES, changed, places

ROOT = Path(__file__).parents[1]
read = fp.TouchRequest.read
FULL = {
    "title": "A ball",
    "resolution": "quick",
    "finger": {"stratum_corneum_mm": 0.5},
    "tissues": "human",
    "object": {"kind": "sphere", "radius_mm": 4.0},
    "motion": {"kind": "ramp_and_hold", "depth_mm": 0.5, "ramp_ms": 50.0, "hold_ms": 950.0},
    "place": {"x_mm": 0.5, "z_mm": 0.0, "tilt_deg": 3.0, "spin_deg": 10.0},
    "friction": 0.1,
    "times_ms": [20.0, 400.0],
    "afferents": {"density_per_cm2": 80.0, "rows": 2, "noise": 0.1, "seed": 3},
    "outputs": ["csv", "spikes"],
}


@pytest.fixture
def call(run_program):
    return partial(run_program, cli.main, "fingerpad")


def test_a_description_is_the_touch_that_python_makes_and_its_defaults_are_the_papers():
    assert read(FULL).touch == fp.touch_of(
        fp.Fingertip(stratum_corneum_mm=0.5), fp.Sphere(radius_mm=4.0), fp.RampAndHold(0.5), "human", "quick",
        (RECEPTOR_X_MM + 0.5, 0.0), tilt_deg=3.0, friction=0.1, spin_deg=10.0, times_ms=(20.0, 400.0),
    )  # fmt: skip
    touch = read({"object": "sphere"}).touch
    assert (touch.indenter, touch.stimulus, touch.friction) == (fp.Sphere(), fp.RampAndHold(), 0.0)
    assert touch.tilt_deg == Conditions().skin_tilt_deg
    assert read({"object": "line"}).touch.tilt_deg == 0.0


@pytest.mark.parametrize(
    ("content", "body"),
    [
        ("sphere:radius_mm=4", fp.Sphere(curvature_per_m=250.0)),
        ({"kind": "bar", "width_mm": 4, "edge_radius_mm": 0.2}, fp.Bar(4.0, 0.2)),
        ({"kind": "grating", "period_mm": 2, "duty": 0.25}, fp.Grating(0.5, 1.5)),
        ({"kind": "dots", "at_mm": [[0, 0], [2.5, 0]], "height_mm": 0.3},
         Dots([(0, 0), (2.5, 0)], height_mm=0.3)),
        ({"kind": "braille", "text": "ab", "along_finger": False}, fp.braille("ab", along_finger=False)),
        ({"kind": "plate"}, fp.Plate()),
        ({"kind": "embossed_text", "text": "T", "capital_mm": 5, "weight": "normal"},
         fp.embossed_text("T", capital_mm=5.0, weight="normal")),
        ({"kind": "embossed", "outlines_mm": [[[0, 0], [3, 0], [0, 3]]], "height_mm": 0.4},
         Embossed([[(0.0, 0.0), (3.0, 0.0), (0.0, 3.0)]], 0.4)),
    ],
)  # fmt: skip
def test_an_object_is_what_its_class_makes(content, body):
    assert read({"object": content, "motion": {"depth_mm": 0.4}}).touch.indenter == body


@pytest.mark.parametrize(
    ("content", "motion"),
    [
        ({"force_mn": 80}, fp.ForceRampAndHold(80.0)),
        ({"kind": "sine", "depth_mm": 0.5, "amplitude_mm": 0.05, "frequency_hz": 20, "cycles": 3},
         fp.sine(0.5, 0.05, 20.0, 3)),
        ({"kind": "chirp", "depth_mm": 0.5, "amplitude_mm": 0.02, "frequencies_hz": [5, 20], "sweep_ms": 400},
         fp.chirp(0.5, 0.02, (5.0, 20.0), 400.0)),
        ({"kind": "repeated", "depth_mm": 0.5, "touches": 2, "ramp_ms": 50, "hold_ms": 99, "pause_ms": 20},
         fp.repeated(0.5, 2, 50.0, 99.0, 20.0)),
        ({"kind": "staircase", "forces_mn": [20, 50]}, fp.staircase(forces_mn=[20.0, 50.0])),
        ({"kind": "stroke", "depth_mm": 0.4, "speed_mm_per_s": 20, "x_mm": 2},
         fp.stroke(0.4, speed_mm_per_s=20.0, x_mm=2.0)),
        ({"kind": "trajectory", "times_ms": [0, 50, 500], "depth_mm": [0, 0.5, 0.5]},
         fp.Trajectory((0.0, 50.0, 500.0), (0.0, 0.5, 0.5))),
    ],
    ids=lambda value: value.get("kind", "") if isinstance(value, dict) else "",
)  # fmt: skip
def test_a_motion_is_what_its_function_makes(content, motion):
    assert read({"object": "sphere", "motion": content}).touch.stimulus == motion


def test_a_recorded_motion_is_named_from_the_folder_of_the_description(tmp_path):
    (tmp_path / "deep").mkdir()
    (tmp_path / "deep" / "press.csv").write_text("time_ms,depth_mm\n0,0\n50,0.6\n500,0.6\n", encoding="utf-8")
    path = tmp_path / "touch.yaml"
    path.write_text("object: plate\nmotion: {kind: recorded, file: deep/press.csv}\n", encoding="utf-8")
    assert read(path).touch.stimulus.depth_mm == (0.0, 0.6, 0.6)


def test_hashes_name_every_file_of_a_description(tmp_path):
    names = ["own.inp", "body.stl", "press.csv", "fit.json"]
    for name in names:
        (tmp_path / name).write_bytes(name.encode())
    path = tmp_path / "touch.yaml"
    path.write_text(
        "finger: {kind: mesh, path: own.inp}\nobject: {kind: surface, path: body.stl, unit: mm}\n"
        "motion: {kind: recorded, file: press.csv}\nafferents: {afferent: fit.json}\n"
    )
    found = read(path).input_hashes()
    assert set(found) == {str(tmp_path / name) for name in ("touch.yaml", *names)}
    assert found[str(tmp_path / "own.inp")] == hashlib.sha256(b"own.inp").hexdigest()
    path.write_text("finger: own.inp\nobject: sphere\n")
    assert set(read(path).input_hashes()) == {str(path), str(tmp_path / "own.inp")}


def test_a_surface_of_several_stimuli_is_read_once(tmp_path, monkeypatch):
    np.savetxt(tmp_path / "map.csv", np.eye(4), delimiter=",")
    made_of = []
    original = height_maps.height_surface
    monkeypatch.setattr(height_maps, "height_surface", lambda *sizes: made_of.append(1) or original(*sizes))
    asked = part_from(
        StimulusSet,
        {
            "object": {"kind": "height_map", "path": "map.csv", "pitch_mm": 0.5},
            "stimuli": {"vary": "place.spin_deg", "values": [0.0, 10.0, 20.0]},
        },
    )
    made = named_stimuli(asked, tmp_path)
    assert len({id(stimulus.indenter) for stimulus in made}) == 1 == len(made_of)


def test_afferents_are_those_of_a_task_with_the_same_words():
    described = read(
        FULL | {"afferents": {"layout": "nail rows", "rows": 2, "afferent": {"static_gain": 1e-6}}}
    )
    assert len(described.population) > 10
    assert described.population.afferent == fp.Afferent(static_gain=1e-6)


def test_the_page_and_the_example_know_every_word_and_the_pages_files_are_possible():
    page = (ROOT / "docs" / "touch.md").read_text(encoding="utf-8")
    assert {"figures", "spikes", "nwb", *FORMATS} == set(OUTPUTS)
    for name in (*OBJECTS, *MOTIONS, *OUTPUTS):
        assert f"`{name}`" in page, name
        assert name in examples()["touch"].text, name
    blocks = re.findall(r"```yaml\n(.*?)```", page, re.S)
    assert blocks
    for block in blocks:
        described = read(read_yaml(block, "page"))
        check_outputs(described)
        assert len(described.population)


def test_a_description_is_frozen_compares_and_survives_json():
    request = read(FULL)
    assert from_json(fp.TouchRequest, to_json(request)) == request == read(request)
    assert json.loads(to_json(request)) == FULL
    assert read(request, {"motion.depth_mm": 0.4}).touch.stimulus == fp.RampAndHold(0.4)
    with pytest.raises(ValueError, match="frozen"):
        request.friction = 0.3


def test_the_schema_accepts_what_is_accepted_and_explains_every_key():
    schema = schemas.request_schema("touch")
    check = fastjsonschema.compile(schema)
    check(FULL)
    check(read_yaml(examples()["touch"].text, "example"))
    for wrong in (
        {"object": {"kind": "sphere", "raduis_mm": 3}},
        {"object": {"kind": "ball"}},
        {},
        {"object": 3},
    ):
        with pytest.raises(fastjsonschema.JsonSchemaValueException):
            check(wrong)
    silent = [
        f"{part}.{key}"
        for part, made in {"": schema, **schema["$defs"]}.items()
        for key, value in made.get("properties", {}).items()
        if not value.get("description")
    ]
    assert silent == []


BALL = "object: {kind: sphere, radius_mm: 4}\n"
WRONG = [
    ("# nothing\n",
     "touch.yaml, the file is empty: write what is pressed, as the example of `fingerpad init`."),
    ("- object: sphere\n", "must be a mapping of keys to values"),
    ("object:\n\tkind: sphere\n",
     "cannot be read as YAML (found character '\\t' that cannot start any token, line 2)"),
    ("object: sphere\nobject: plate\n", "line 2: object is repeated, keep one"),
    ("1: 2\n", "must have texts as keys"),
    ("motion: {depth_mm: 1}\n", "object must be given: it is missing"),
    (BALL + "frictoin: 0.1\n", "line 2, frictoin is unknown: did you mean friction?"),
    (BALL + "colour: red\n", "line 2, colour is unknown: the file has resolution, finger, tissues"),
    ("object:\n", "line 1, object must be a mapping of keys to values: got None"),
    ("object: wedge\n", "line 1, object.indenter must be one of sphere"),
    ("object: 'sphere:raduis_mm=3'\n", "line 1, object.raduis_mm is no argument of Sphere: did"),
    ("object: {kind: shpere}\n", "got 'shpere' (did you mean sphere?)."),
    ("object: {radius_mm: 3}\n", "object.kind must be given: it is missing"),
    ("object:\n  kind: sphere\n  raduis_mm: 3\n",
     "line 3, object.raduis_mm is unknown: did you mean radius_mm?"),
    ("object: {kind: plate, width_mm: 3}\n", "object.width_mm is unknown: object has kind"),
    ("object: {kind: sphere, radius_mm: wide}\n", "radius_mm must be a finite number [mm]: got 'wide'"),
    ("object: {kind: sphere, radius_mm: .nan}\n", "radius_mm must be a finite number [mm]: got '.nan'"),
    ("object: {kind: sphere, radius_mm: true}\n", "radius_mm must be a finite number [mm]: got True"),
    ("object: {kind: sphere, radius_mm: -3}\n",
     "line 1, object.radius_mm must be greater than 0 [mm]: got -3"),
    ("object: {kind: sphere, radius_mm: 4, curvature_per_m: 250}\n",
     "radius_mm and curvature_per_m exclude each other"),
    ("object: {kind: sphere, radius_mm: 0.01}\n", "line 1, object: grading must have elements"),
    ("object: {kind: bar, width_mm: 1, edge_radius_mm: 2}\n",
     "edge_radius_mm must not exceed half of width_mm"),
    ("object: {kind: grating, period_mm: 2, duty: 1.5}\n", "duty must be below 1"),
    ("object: {kind: grating, groove_mm: 1, duty: 0.5}\n", "duty and groove_mm exclude each other"),
    ("object: {kind: dots, at_mm: [[0, 0, 0]]}\n", "object.at_mm[1] must be a pair [mm]"),
    ("object: {kind: braille, text: A}\n",
     "line 1, object.text must have letters a to z and spaces: got 'A'; write 'a'."),
    ("object: {kind: braille, text: 7}\n", "object.text must be a text: got 7"),
    ("object: {kind: braille, text: a, along_finger: maybe}\n",
     "object.along_finger must be true or false: got 'maybe'"),
    (BALL + "motion: {kind: sien}\n", "got 'sien' (did you mean sine?)."),
    (BALL + "motion: {depth_mm: 1, force_mn: 100}\n",
     "line 2, motion: depth_mm and force_mn exclude each other"),
    (BALL + "motion: {depth_mm: 1, ramp_ms: 0}\n", "motion.ramp_ms must lie within 1e-06 to 1e+13 ms"),
    (BALL + "motion: {depth_mm: 9}\n", "touch.yaml, line 2, motion.depth_mm must stay below"),
    (BALL + "motion: {kind: sine, depth_mm: 0.5}\n", "line 2, motion.sine needs frequency_hz, cycles"),
    (BALL + "motion: {kind: sine, depth_mm: 0.5, amplitude_mm: 0.1, frequency_hz: 20, cycles: 2.5}\n",
     "motion.cycles must be a whole number of at least 1: got 2.5"),
    (BALL + "motion: {kind: chirp, depth_mm: 0.5, amplitude_mm: 0.1, frequencies_hz: [5], sweep_ms: 100}\n",
     "line 2, motion.frequencies_hz must be a pair"),
    (BALL + "motion: {kind: staircase}\n", "line 2, motion"),
    (BALL + "motion: {kind: staircase, depths_mm: [0.5], forces_mn: [5]}\n", "line 2, motion"),
    # A way of hundreds of kilometres is refused at once.
    (BALL + "motion: {kind: stroke, depth_mm: 0.5, speed_mm_per_s: 20, x_mm: 999999999}\n",
     "line 2, motion: The indenter must not leave the finger"),
    (BALL + "motion: {kind: trajectory, times_ms: [0, 20, 10], depth_mm: [0, 1, 1]}\n",
     "times_ms must increase strictly"),
    (BALL + "motion: {kind: trajectory, times_ms: [0, 20], depth_mm: [0, 1, 1]}\n", "one value per time"),
    (BALL + "motion: {kind: trajectory, times_ms: [0, 20], depth_mm: [0, .nan]}\n",
     "depth_mm must be an array of numbers"),
    (BALL + "motion: {kind: recorded, file: none.csv}\n", "line 2, motion"),
    (BALL + "motion: {kind: recorded, file: touch.yaml}\n", "line 2, motion"),
    (BALL + "place: {x_mm: 40}\n", "touch.yaml, line 2, place must lie on the finger"),
    (BALL + "place: {tilt_deg: 80}\n", "line 2, place.tilt_deg must lie within -45 to 45 degrees: got 80"),
    ("object: line\nplace: {spin_deg: 30}\n", "spin_deg must be 0 for Line"),
    (BALL + "friction: -0.1\n", "line 2, friction must not be negative: got -0.1"),
    ("object: line\nfriction: 0.3\n", "friction"),
    (BALL + "tissues: humn\n", "line 2, tissues must be one of human, paper"),
    (BALL + "resolution: fine\n", "line 2, resolution must be one of quick, standard, paper: got 'fine'"),
    (BALL + "title: ''\n", "title must be a text: got ''"),
    (BALL + "finger: {dermis_mm: 9}\n", "line 2, finger: Bone and skin layers"),
    (BALL + "finger: baby\n", "touch.yaml, line 2, finger.like must be one of adult, "),
    (BALL + "finger: adult:width_mm=18:width_mm=19\n", "finger must have width_mm once"),
    (BALL + "finger: adult:18\n", "must be written like:name=mm, as adult:width_mm=18"),
    (BALL + "finger: nope.msh\n", "touch.yaml, line 2, finger: nope.msh must be a file that can be read: "),
    (BALL + "times_ms: [4000]\n", "line 2, times_ms must lie within the motion"),
    (BALL + "times_ms: 20\n", "times_ms must have 1 dimension"),
    (BALL + "afferents: {layout: hexagonal}\n", "afferents.region must be given for the layout hexagonal"),
    (BALL + "afferents: {jitter: 0.1}\n", "afferents.jitter must not be given"),
    (BALL + "afferents: {rows: 0}\n", "afferents.rows must be a whole number of at least 1: got 0"),
    (BALL + "afferents: {afferent: fit.json}\n", "afferent: "),
    (BALL + "afferents: {afferent: RB}\n", "RB"),
    (BALL + "afferents: {windows_ms: {static: [900, 600]}}\n", "afferents.windows_ms.static must"),
    (BALL + "outputs: []\n", "outputs must have at least one entry"),
    (BALL + "outputs: [csv, figure]\n", "line 2, outputs[2] must be one of figures, csv"),
    (BALL + "motion: {kind: stroke, depth_mm: 0.4, speed_mm_per_s: 20, x_mm: 2}\noutputs: febio\n",
     "line 3, outputs[1]: febio decks move the indenter only along its axis"),
]  # fmt: skip


@pytest.mark.parametrize(("text", "said"), WRONG, ids=[f"{n}" for n in range(len(WRONG))])
def test_a_malformed_description_is_refused_in_one_sentence_and_nothing_is_written(call, text, said):
    Path("touch.yaml").write_text(text, encoding="utf-8")
    for command in (["check", "touch.yaml"], ["touch", "touch.yaml", "--out", "out"]):
        status, printed, error = call(*command)
        assert (status, printed) == (2, "")
        assert said in error
        assert error.startswith("fingerpad: touch.yaml")
        assert error.count("touch.yaml") <= 1 + text.count("touch.yaml")  # the file is named once
        assert error.count("\n") == 1
        assert len(error) < 600
        assert [path.name for path in Path().iterdir()] == ["touch.yaml"]


def test_files_that_are_no_text_are_refused(call):
    Path("touch.yaml").write_bytes(bytes(range(256)))
    status, _, error = call("check", "touch.yaml")
    assert (status, error.count("\n")) == (2, 1)
    assert "touch.yaml must be text in UTF-8" in error
    assert call("check", "none.yaml")[0] == 2
    Path("folder").mkdir()
    assert "folder must be a file that can be read" in call("touch", "folder")[2]
    Path("zero.yaml").write_bytes(b"object: \x00sphere\n")
    assert "cannot be read as YAML" in call("check", "zero.yaml")[2]


@pytest.mark.filterwarnings("ignore::fingerpad.core.errors.InertiaWarning")
@settings(max_examples=150, deadline=None, suppress_health_check=[HealthCheck.too_slow])
@given(st.sampled_from([place for place in places(FULL) if place]), VALUES, CHANGES)  # fmt: skip
def test_any_change_of_a_description_is_possible_or_refused_in_one_sentence(place, value, change):
    try:
        check_outputs(read(changed(FULL, place, value, change)))
    except fp.InputError as error:
        said = str(error)
    else:
        said = "touch, possible."
    assert said.startswith("touch, ")
    assert "\n" not in said
    assert said[-1] in ".?"


def test_the_example_runs_as_it_is_and_is_never_overwritten(call):
    assert call("init", "mine/touch.yaml") == (0, "Try: fingerpad check mine/touch.yaml\n", "")
    first = Path("mine/touch.yaml").read_text(encoding="utf-8")
    assert first.startswith(f"# yaml-language-server: $schema={schemas.TOUCH_SCHEMA}\n")
    assert json.loads(
        Path("mine", schemas.TOUCH_SCHEMA).read_text(encoding="utf-8")
    ) == schemas.request_schema("touch")
    status, printed, error = call("init", "mine/touch.yaml")
    assert (status, printed) == (2, "")
    assert "mine/touch.yaml exists and is not overwritten" in error
    status, printed, error = call("check", "mine/touch.yaml")
    assert (status, error) == (0, "")
    assert re.search(r"\d+ nodes, \d+ elements, 10 steps", printed)
    assert re.search(r"about \d+ s on two idle cores and \d+ MB", printed)
    assert sorted(path.name for path in Path("mine").iterdir()) == [schemas.TOUCH_SCHEMA, "touch.yaml"]
    assert "only the press shows" not in printed
    Path("forced.yaml").write_text('{"object": "sphere", "motion": {"force_mn": 50}}', encoding="utf-8")
    status, printed, error = call("check", "forced.yaml")
    assert (status, error) == (0, "")
    assert "How deep this force presses, and whether into the bone, only the press shows." in printed


def test_a_touch_is_pressed_once_and_its_outputs_are_what_python_computes(call, monkeypatch):
    content = FULL | {"friction": 0.0, "times_ms": [], "finger": {}, "outputs": list(OUTPUTS)}
    content["motion"] = {"depth_mm": 0.3, "hold_ms": 200}
    Path("touch.yaml").write_text(json.dumps(content), encoding="utf-8")
    status, printed, error = call("touch", "touch.yaml", "--out", "out")
    assert (status, error) == (0, "")
    shown = Path("out/touch.html").read_text(encoding="utf-8")
    assert all(words in shown for words in ("largest contact [mm²]", "number of times", "jacobian [mm³]"))
    assert "afferents fire" in printed
    written = {str(path.relative_to("out")) for path in Path("out").rglob("*") if path.is_file()}
    assert {
        "touch.html", "figures/touch.png", "touch.json", "touch.csv", "touch.npz", "spikes.csv", "touch.nwb",
        "touch.pvd", "abaqus/touch.inp", "touch.nc", "touch.zarr/zarr.json",
        "calculix/touch.inp", "febio/touch.feb",
    } <= written  # fmt: skip
    result = from_json(TouchFile, Path("out/touch.json").read_bytes())
    request = read("touch.yaml")
    assert result.touch == request
    skin = request.touch.solve()
    np.testing.assert_allclose(result.summary.largest_force_mn, skin.force_mn.max(), rtol=1e-12)
    assert result.manifest.inputs.keys() == {"touch.yaml"}
    # The indentation is stored: the same touch with other afferents is not pressed again.
    monkeypatch.setattr(Touch, "solve", pytest.fail)
    again = fp.touch(content | {"afferents": {"density_per_cm2": 200}, "outputs": ["spikes"]}, out="out")
    assert again.summary.largest_force_mn == result.summary.largest_force_mn
    assert len(Path("out/spikes.csv").read_text(encoding="utf-8").splitlines()) == 19
    # Noise makes spikes random, and a seed repeats them.
    noisy = read(content)
    first, second = noisy.respond(again.skin), noisy.respond(again.skin)
    other = read(content | {"afferents": {"noise": 0.1, "seed": 4}}).respond(again.skin)
    assert first.spikes.times_ms.tolist() == second.spikes.times_ms.tolist()
    assert first.spikes.times_ms.tolist() != other.spikes.times_ms.tolist()


def test_the_estimate_of_a_mesh_of_ones_own_counts_its_nodes_and_its_elimination(tmp_path):
    coarse = fp.Grading(17.37, 2.0, 2.0, 0.8, 0.8, 3.0, stratum_corneum=1, dermis=2, subcutis=2)
    touch = fp.touch_of(fp.Fingertip(), fp.Sphere(), fp.RampAndHold(0.5), grading=coarse)
    path = fp.export_touch(tmp_path, touch, "abaqus")[0]
    own = estimate_press(read({"object": "sphere", "finger": str(path)}).touch)
    ours = estimate_press(read({"object": "sphere"}).touch)
    assert own.nodes == len(touch.mesh.nodes_mm) > OWN_NODES
    assert own.time_s / own.nodes == pytest.approx(ours.time_s / ours.nodes * own.nodes / OWN_NODES)
    assert own.memory_mb > BASE_MB + OWN_NODE_MB * own.nodes**OWN_EXPONENT


def test_the_estimate_grows_with_mesh_steps_force_and_friction():
    ball = {"object": "sphere"}
    base = estimate_press(read(ball).touch)
    thrice = {"kind": "repeated", "depth_mm": 1, "touches": 3, "ramp_ms": 50, "hold_ms": 99, "pause_ms": 9}
    changes = (
        {"resolution": "standard"}, {"motion": {"force_mn": 100}}, {"friction": 0.3}, {"motion": thrice},
    )  # fmt: skip
    more = [estimate_press(read(ball | change).touch) for change in changes]
    assert all(other.time_s > 1.5 * base.time_s for other in more)
    assert more[0].memory_mb > base.memory_mb


def test_afferent_types_by_name_and_mixed_in_files():
    """One type by its name, several by their densities, and the same names in a task."""
    one = read({"object": "sphere", "afferents": {"afferent": "RA"}}).population
    assert one.afferent == fp.RA()
    densities = {"SAI": 70, "RA": 140, "PC": 21, "SAII": 9}
    asked = {"layout": "poisson-disc", "region": {"shape": "pad"}, "densities_per_cm2": densities}
    mixed = read({"object": "sphere", "afferents": asked}).population
    assert {name: part.afferent for name, part in mixed.parts.items()} == afferent_types()
    counts = np.array([len(part) for part in mixed.parts.values()])
    assert counts / counts[0] == pytest.approx([1.0, 2.0, 0.3, 9.0 / 70.0], rel=0.1)
    spheres = {"vary": "object.curvature_per_m", "values": [287, 340]}
    task = fp.DiscriminationRequest.read(
        {"object": "sphere", "stimuli": spheres, "standard": 287, "noise": 0.1, "afferents": asked}
    )
    laid = task.population
    np.testing.assert_array_equal(laid.positions_mm, mixed.positions_mm)
    of_type = np.array(laid.types)
    pairs = task.neighbours
    assert (of_type[pairs[:, 0]] == of_type[pairs[:, 1]]).all()
    assert set(of_type[pairs[:, 0]]) == set(densities)
    for wrong, said in (
        ({"afferent": "RA", "densities_per_cm2": densities, "layout": "grid"}, "got both; leave one out"),
        ({"afferent": "PC", "noise": 0.1}, "noise must be 0 for other types"),
        ({"densities_per_cm2": {"RB": 1.0}}, "a density above 0 of each type, SAI, RA, PC, SAII"),
    ):
        with pytest.raises(fp.InputError, match=said):
            check_outputs(read({"object": "sphere", "afferents": wrong}))
