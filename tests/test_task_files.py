"""Files of discrimination tasks: accepted keys, their meaning, and refused files."""

import json
import re
from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest
from hypothesis import HealthCheck, given, settings
from hypothesis import strategies as st

import fingerpad as fp
from fingerpad.core import result_files
from fingerpad.core.plain_yaml import read_yaml
from fingerpad.experiments.conditions import RECEPTOR_X_MM, Conditions
from fingerpad.experiments.examples import tasks
from fingerpad.experiments.fit.request import FitFile
from fingerpad.experiments.gerling2014.reproduction import ReproductionResult
from fingerpad.neuron.afferent import PARAMETER_NAMES
from fingerpad.skin.unrolled_skin import NailEdge, UnrolledSkin
from tests.mutations import CHANGES, VALUES, places
from tests.mutations import changed as mutated
from tools.schemas import file_format, parts_in

ROOT = Path(__file__).parents[1]
read = fp.DiscriminationRequest.read
SPHERES = {
    "question": "Which spheres?",
    "object": {"kind": "sphere"},
    "stimuli": {"vary": "object.curvature_per_m", "values": [287, 296, 365]},
    "standard": 287,
    "noise": 0.1,
}
BARS = {
    "question": "Which bars?",
    "object": {"kind": "bar", "fillet_mm": 0.2},
    "motion": {"force_mn": 150.0},
    "stimuli": [
        {"name": "narrow", "object": {"width_mm": 2.0}},
        {"name": "wide", "object": {"width_mm": 4.0}, "place": {"x_mm": 0.5}},
        {"name": "deep", "object": {"width_mm": 2.0}, "motion": {"depth_mm": 0.8}, "place": {"tilt_deg": 0.0},
         "friction": 0.3},
    ],
    "standard": "wide",
    "noise": 0.1,
}  # fmt: skip


def changed(content, **parts):
    """A question with other parts; None leaves a part out."""
    return {key: part for key, part in (content | parts).items() if part is not None}


def asked(content):
    task = read(content)
    task.check()
    return task


def test_what_varies_makes_one_stimulus_per_value_and_the_standard_comes_first():
    stimuli = read(changed(SPHERES, standard=296)).pressed
    assert [stimulus.name for stimulus in stimuli] == ["296", "287", "365"]
    assert [stimulus.level for stimulus in stimuli] == [296.0, 287.0, 365.0]
    spheres = [fp.Sphere(curvature_per_m=stimulus.level) for stimulus in stimuli]
    assert [stimulus.indenter for stimulus in stimuli] == spheres
    assert {stimulus.motion for stimulus in stimuli} == {fp.RampAndHold()}
    for varied, first, second in (
        ("motion.force_mn", fp.ForceRampAndHold(50.0), fp.ForceRampAndHold(80.0)),
        ("motion.ramp_ms", fp.RampAndHold(ramp_ms=50.0), fp.RampAndHold(ramp_ms=80.0)),
    ):
        task = changed(SPHERES, stimuli={"vary": varied, "values": [50, 80]}, standard=50)
        assert [stimulus.motion for stimulus in read(task).pressed] == [first, second]


def test_listed_stimuli_have_parameters_of_their_own():
    wide, narrow, deep = read(BARS).pressed
    assert (wide.name, wide.level, wide.indenter) == ("wide", None, fp.Bar(4.0, 0.2))
    assert (wide.motion, wide.x_mm) == (fp.ForceRampAndHold(150.0), 0.5)
    assert (narrow.indenter, narrow.x_mm, narrow.tilt_deg) == (fp.Bar(2.0, 0.2), 0.0, None)
    # Its own depth takes the place of the force that the others share.
    assert (deep.motion, deep.tilt_deg, deep.friction) == (fp.RampAndHold(0.8), 0.0, 0.3)


def test_any_object_and_any_motion_may_be_discriminated(tmp_path, monkeypatch):
    monkeypatch.chdir(tmp_path)
    Path("press.csv").write_text("time_ms,depth_mm,x_mm\n0,0,0\n50,0.6,0\n500,0.6,1\n", encoding="utf-8")
    letters = changed(
        SPHERES,
        resolution="quick",
        object={"kind": "braille"},
        motion={"kind": "recorded", "file": "press.csv"},
        friction=0.2,
        stimuli={"vary": "object.text", "values": ["a", "b"]},
        standard="a",
    )
    found = read(letters).touches
    assert {name: touch.indenter for name, touch in found.items()} == {
        name: fp.braille(name) for name in "ab"
    }
    assert {touch.friction for touch in found.values()} == {0.2}
    assert [pose.x_mm for pose in found["a"].stimulus.poses][-1] == 1.0
    assert len({touch.grading for touch in found.values()}) == 1
    stroke = {"kind": "stroke", "depth_mm": 0.4, "speed_mm_per_s": 20, "x_mm": 1}
    bump = {"name": "pressed", "object": {"kind": "sphere", "radius_mm": 3}}
    mixed = [bump, {"name": "slid", "object": "plate", "motion": stroke}]
    pressed = read(changed(SPHERES, resolution="quick", stimuli=mixed, standard="slid")).touches
    assert [touch.stimulus.stays for touch in pressed.values()] == [False, True]


def test_the_papers_spheres_are_the_very_touches_of_a_reproduction():
    ours = read("sphere_curvature", {"resolution": "quick"}).touches
    theirs = {
        f"{curvature:g}": touch
        for (at, curvature), touch in Conditions("quick").sphere_touches().items()
        if at == 0.0
    }
    assert ours == theirs


def test_all_stimuli_meet_one_mesh_that_is_fine_below_each_of_them():
    pressed = read(changed(BARS, resolution="quick")).touches
    (grading,) = {touch.grading for touch in pressed.values()}
    for touch in pressed.values():
        reach = touch.indenter.width_mm / 2 + abs(touch.at_mm[0] - grading.centre_mm)
        assert grading.half_length_mm > reach - 0.5
    assert pressed["wide"].at_mm == (RECEPTOR_X_MM + 0.5, 0.0)
    assert pressed["deep"].tilt_deg == 0.0
    assert pressed["narrow"].tilt_deg == Conditions("quick").skin_tilt_deg
    beside = read(changed(SPHERES, place={"z_mm": 1.0}, resolution="quick")).touches
    assert all(touch.grading.full and touch.at_mm[1] == 1.0 for touch in beside.values())


def test_a_population_without_further_words_is_the_papers():
    population = read(SPHERES).population
    np.testing.assert_array_equal(population.positions_mm, fp.Population.grid().positions_mm)
    assert (population.afferent, population.sensitivity) == (fp.Afferent(), None)
    first, other = (
        read(changed(SPHERES, afferents={"sensitivity_spread": 0.4, "seed": seed})).population
        for seed in (0, 1)
    )
    assert first.sensitivity.shape == other.sensitivity.shape == (18,)
    assert (first.sensitivity != other.sensitivity).all()


@pytest.mark.parametrize("layout", ["rectangular", "hexagonal", "uniform", "jittered", "poisson-disc"])
def test_any_layout_fills_its_region_at_its_density(layout):
    region = {"shape": "rectangle", "length_mm": 8.0, "width_mm": 6.0}
    words = {"layout": layout, "density_per_cm2": 150, "region": region, "offset_mm": [1.0, 0.0], "seed": 3}
    population, again = (read(changed(SPHERES, afferents=words)).population for _ in range(2))
    assert abs(len(population) - 0.48 * 150) <= 8
    x, z = population.positions_mm[:, 0], population.positions_mm[:, -1]
    assert abs(x.mean() - RECEPTOR_X_MM - 1.0) < 1.0
    assert np.ptp(x) <= 8.5
    assert np.ptp(z) <= 6.1
    np.testing.assert_array_equal(again.positions_mm, population.positions_mm)


def test_afferents_fill_the_pad_at_the_density_of_its_skin_or_line_the_nail():
    pad = {"layout": "poisson-disc", "density_per_cm2": 70, "region": {"shape": "pad"}}
    population = read(changed(SPHERES, afferents=pad)).population
    assert len(population) == round(0.7 * UnrolledSkin().pad().area_mm2)
    task = read(changed(SPHERES, afferents={"layout": "nail rows", "rows": 2}))
    rows = task.population
    np.testing.assert_array_equal(
        rows.positions_mm, NailEdge().points(NailEdge().rows(2, density_per_cm2=100.0).places_mm)
    )
    assert len(task.neighbours) > 2 * len(rows)


def test_an_afferent_is_ours_or_ones_own_numbers_or_of_a_file_of_results(tmp_path, monkeypatch):
    assert read(SPHERES).population.afferent == fp.Afferent()
    numbers = {"static_gain": 1.1e-6, "dynamic_quantity": "von_mises"}
    own = read(changed(SPHERES, afferents={"afferent": numbers}))
    assert own.population.afferent == fp.Afferent(static_gain=1.1e-6, dynamic_quantity="von_mises")
    six = dict(zip(PARAMETER_NAMES, [2e-7, 1e-4, 9e-7, 60.0, 1e-6, 50.0], strict=True))
    expected = fp.Afferent.from_parameters(list(six.values()))
    # The parts of a file that an afferent needs; the rest is left to the schemas' own tests.
    monkeypatch.setattr(result_files, "check_schema", lambda *_: None)
    monkeypatch.chdir(tmp_path)
    quantities = {"dynamic_quantity": "stored", "static_quantity": "work"}
    for name, kind, results in (
        ("fit.json", FitFile, {"fit": {"parameters": six}, **quantities}),
        ("results.json", ReproductionResult, {"human": {"single_unit": {"parameters": six, **quantities}}}),
    ):
        named, version = file_format(kind)
        Path(name).write_text(json.dumps(results | {"format": named, "format_version": version}))
        found = read(changed(SPHERES, afferents=name)).population.afferent
        assert found == replace(expected, **quantities)
    # A reproduction with the quantities of `human` was fitted with its end organs and adaptation.
    human = fp.Afferent()
    followed = {"dynamic_quantity": human.dynamic_quantity, "static_quantity": human.static_quantity}
    results["human"]["single_unit"] |= followed
    Path("results.json").write_text(json.dumps(results | {"format": named, "format_version": version}))
    assert read(changed(SPHERES, afferents="results.json")).population.afferent == replace(human, **six)


@pytest.mark.parametrize("name", tasks())
def test_ready_made_questions_can_be_asked(name):
    task = read(name, {"resolution": "quick"})
    task.check()
    first = task.pressed[0]
    assert task.standard in (first.level, first.name)
    assert {touch.grading for touch in task.touches.values()} == {task.touches[first.name].grading}


def test_a_folder_named_like_an_example_task_is_not_taken_for_a_file(tmp_path, monkeypatch):
    (tmp_path / "sphere_curvature").mkdir()
    before = read("sphere_curvature").input_hashes()
    monkeypatch.chdir(tmp_path)
    assert read("sphere_curvature").input_hashes() == before


def refused(content):
    with pytest.raises(fp.InputError) as refusal:
        asked(content)
    said = str(refusal.value)
    assert said.endswith((".", "?"))
    assert "\n" not in said
    assert "pydantic" not in said
    return said


# What description files have in common with touches is tried in test_touch_description.py.
REFUSALS = """
standard: null => standard must be given: it is missing.
population: {rows: 2} => population is written as afferents since version 2 of tasks: move it there.
windows_ms: {static: [600, 950]} => windows_ms is written as windows_ms within afferents
noise: 1e300 => noise must be a number from 0 to 1000, or fitted: got 1e+300.
noise: much => noise must be a number from 0 to 1000, or fitted: got 'much'.
{noise: 0, code: [gradient_sum, ideal]} => noise must be greater than 0 where code has ideal: got 0.
{noise: fitted, code: [ideal, euclidean], observed: {points: [{at: 296, hit_rate: 0.6}]}} =>
    code must not begin with ideal where noise is fitted
noise: fitted => noise can only be fitted to observed hit rates of the comparisons, 296, 365
{noise: fitted, observed: {points: [{at: 305, hit_rate: 0.7}]}} =>
    noise can only be fitted to observed hit rates
nois: 0.1 => nois is unknown: did you mean noise?
stimuli: [] => stimuli must be two or more
stimuli: {vary: object.curvature_per_m, values: [287]} => stimuli must be two or more
stimuli: {vary: object.curvature_per_m, values: [287, 287]} => '287' is repeated
stimuli: {vary: object.curvature_per_m, values: [287, x]} =>
    stimuli.values[2], object.curvature_per_m must be a finite number [1/m]: got 'x'.
stimuli: {vary: object.curvature_per_m, values: [287, 0]} =>
    stimuli.values[2], object.curvature_per_m must be greater than 0
stimuli: {vary: object.curvature_per_m, values: 287} => stimuli.values must be a list: got 287.
stimuli: {vary: colour, values: [1, 2]} =>
    stimuli.vary must be friction, or a key of object, motion or place such as object.radius_mm: got 'colour'.
stimuli: {vary: curvature_per_m, values: [1, 2]} =>
    stimuli.vary must be friction, or a key of object, motion or place such as object.curvature_per_m: got
stimuli: {vary: object.width_mm, values: [1, 2]} =>
    stimuli.values[1], object.width_mm is unknown: object has kind, curvature_per_m
{stimuli: {vary: motion.depth_mm, values: [1, 15]}, standard: 1} =>
    stimuli.values[2], motion.depth_mm must stay below
stimuli: [{object: {curvature_per_m: 300}}] => stimuli[1].name must be given
stimuli: [{name: a}, {name: a}] => 'a' is repeated
{stimuli: [{name: a, level: 1}, {name: b}], standard: a} =>
    level must be given for all stimuli or for none: 'b' has none.
stimuli: [{name: a, width_mm: 3}, {name: b}] =>
    stimuli[1].width_mm is unknown: stimuli[1] has object, motion, place,
stimuli: [{name: a, friction: -1}, {name: b}] => stimuli[1].friction must not be negative: got -1
standard: 300 => standard must be one of the stimuli, 287, 296, 365: got 300.0.
standard: [287] => standard must be a number or a name: got [287].
object: null => object.kind must be given: it is missing.
object: {kind: sphere, curvature_per_m: 3} => object.curvature_per_m must not be given where stimuli.vary it
motion: {kind: recorded, file: none.csv} => motion: none.csv must be a file that can be read
motion: {kind: stroke, depth_mm: 0.5, speed_mm_per_s: 20, x_mm: 40} =>
    motion: The indenter must not leave the finger
place: {x_mm: 90} => place must lie on the finger
finger: giant => finger.like must
reach_mm: 0 => reach_mm must be greater than 0 [mm]: got 0.
skin: {materials: human} => skin is unknown
afferents: {density_per_cm2: 0} => afferents.density_per_cm2 must be greater than 0 [1/cm²]: got 0.
afferents: {layout: hexagonal, rows: 3, region: {shape: rectangle, length_mm: 3, width_mm: 6}} =>
    afferents.rows must not be given: it belongs to the layout grid
afferents: {region: {shape: rectangle, length_mm: 3, width_mm: 6}} =>
    afferents.region must not be given: it belongs to the layout rectangular or hexagonal
afferents: {layout: uniform, region: {shape: rectangle, length_mm: 0, width_mm: 6.0}} =>
    afferents.region.length_mm must be greater than 0 [mm]: got 0.
afferents: {layout: uniform, region: {shape: rectangle, length_mm: 1}} =>
    afferents.region.width_mm must be given for a rectangle
afferents: {layout: uniform, region: {shape: rectangle, length_mm: 3, width_mm: 6, corners_mm: []}} =>
    afferents.region.corners_mm must not be given: a rectangle has length_mm, width_mm.
afferents: {layout: uniform, region: {shape: polygon, corners_mm: [[0, 0], [1, 1], [2, 2]]}} =>
    afferents.region.corners_mm must enclose an area
afferents: {layout: uniform, density_per_cm2: 0.1, region: {shape: rectangle, length_mm: 3, width_mm: 6}}
    =>
    afferents: A density of
afferents: {layout: uniform, density_per_cm2: 1.0e+9, region: {shape: rectangle, length_mm: 3, width_mm: 6}}
    =>
    afferents: A layout may have
afferents: {seed: -1} => afferents.seed must be a whole number of at least 0: got -1.
afferents: {sensitivity_spread: -1} => afferents.sensitivity_spread must not be negative: got -1.
afferents: {afferent: {time_constant_ms: 0}} =>
    afferents.afferent.time_constant_ms must be greater than 0 [ms]: got 0.
afferents: none.json => afferents.afferent: none.json must be a file that can be read
code: guess => code[1] must be one of gradient_sum, euclidean
measure: pressure => measure[1] must be one of static, dynamic, latency: got 'pressure'.
afferents: {windows_ms: {static: [600, 1200]}} =>
    afferents.windows_ms.static must end with the stimuli, not at 1200 ms: '287' ends at 1000 ms.
experiment: {hit_rates: 1} => experiment.hit_rates must be a whole number of at least 2: got 1.
experiment: {criterion: 2} => experiment.criterion must lie within 0 to 1: got 2.
experiment: {trials: 0} => experiment.trials must be a whole number of at least 1: got 0.
{experiment: {criterion_sigma: 0.1}, code: euclidean} =>
    experiment.criterion_sigma must be 0 where code has euclidean
curve: {sigmoid: step} => curve.sigmoid must be one of normal
curve: {lapse: 0.6} => curve.lapse must be a number within 0 ... 0.5, or free: got 0.6.
curve: {proportion: 0.5} => curve.proportion must be a number between 0.5 and 1: got 0.5.
observed: {} => observed.points must be given
observed: {points: [{at: 296, hit_rate: 58}]} =>
    observed.points[1].hit_rate must lie within 0 to 1: got 58.
observed: {points: [{at: flat, hit_rate: 0.5}]} => observed.points[1].at must be one of the stimuli
"""
LINES = REFUSALS.strip().replace("\n    ", " ").splitlines()


@pytest.mark.parametrize(("parts", "said"), [line.split(" => ") for line in LINES])
def test_invalid_values_are_refused_in_one_sentence_with_their_position(parts, said):
    assert said in refused(changed(SPHERES, **read_yaml(parts, "part")))


@pytest.mark.parametrize(
    "content",
    [
        "[1]",
        "{}",
        '{"fit": {"parameters": {"tau": 3}}}',
        '{"format": "fingerpad fit", "format_version": 1, "fit": {"parameters": {"tau": 3}}}',
        '{"format": "fingerpad fit", "format_version": 99, "fit": {}}',
        "no json",
    ],
)
def test_a_file_without_fitted_parameters_is_refused(tmp_path, monkeypatch, content):
    monkeypatch.chdir(tmp_path)
    Path("fit.json").write_text(content)
    with pytest.raises(fp.InputError, match=r"^task, afferents\.afferent.*fit\.json"):
        read(changed(SPHERES, afferents="fit.json")).check()


def test_null_is_as_good_as_nothing():
    empty = {"layout": "nail rows", "jitter": None, "rows": None}
    with_null = changed(SPHERES, afferents=empty, motion={"force_mn": None, "depth_mm": 1.0})
    assert len(asked(with_null).population) == len(NailEdge().rows(1, 100.0))


@pytest.mark.parametrize(
    "block",
    re.findall(
        r"^```yaml\n(.*?)^```", (ROOT / "docs" / "discriminate.md").read_text(encoding="utf-8"), re.M | re.S
    ),
)
def test_what_the_guide_shows_can_be_asked(block):
    part = read_yaml(block, "the guide")
    assert asked(part if "standard" in part else changed(SPHERES, **part))


def test_the_guide_and_the_page_of_populations_name_every_key():
    def keys(part):
        for name, field in part.model_fields.items():
            yield name
            if name == "finger":  # whose words the guide to fingers has
                continue
            for inner in parts_in(field.annotation):
                yield from keys(inner)

    pages = ("discriminate.md", "populations.md")
    guide = "".join((ROOT / "docs" / page).read_text(encoding="utf-8") for page in pages)
    assert [key for key in dict.fromkeys(keys(fp.DiscriminationRequest)) if f"`{key}`" not in guide] == []


def test_a_task_on_a_child_presses_and_samples_the_child_s_pad():
    task = read(SPHERES, {"finger": "child", "resolution": "quick"})
    child = fp.Fingertip.of("child")
    touches = task.touches
    assert {touch.finger for touch in touches.values()} == {child}
    assert {touch.at_mm for touch in touches.values()} == {child.contact_mm}
    assert next(iter(touches.values())).grading.size_x_mm < 0.45
    middle = task.population.positions_mm.mean(axis=0)
    assert middle == pytest.approx(child.contact_mm, abs=1e-9)


LETTERS = {
    "question": "Which letters can be discriminated?",
    "resolution": "quick",
    "finger": {"like": "child"},
    "tissues": "human",
    "motion": {"kind": "stroke", "depth_mm": 0.3, "speed_mm_per_s": 20.0, "x_mm": 2.0},
    "place": {"x_mm": 0.5},
    "friction": 0.3,
    "stimuli": [
        {"name": "a", "level": 1.0, "object": {"kind": "braille", "text": "a"}},
        {"name": "edge", "level": 2.0, "object": "edge", "place": {"spin_deg": 10.0}},
        {"name": "ball", "level": 3.0, "object": {"kind": "sphere", "radius_mm": 3.0}, "friction": 0.0},
    ],
    "standard": "a",
    "afferents": {
        "layout": "hexagonal",
        "density_per_cm2": 70.0,
        "region": {"shape": "pad"},
        "windows_ms": {"dynamic": [0.0, 50.0]},
    },
    "code": ["euclidean"],
    "measure": ["static", "dynamic"],
    "noise": 0.1,
    "experiment": {"seed": 3, "trials": 50},
    "curve": {"sigmoid": "logistic", "lapse": 0.02},
    "observed": {"source": "people", "points": [{"at": 2.0, "hit_rate": 0.8, "trials": 20}]},
}


@pytest.mark.filterwarnings("ignore::fingerpad.core.errors.InertiaWarning")
@settings(max_examples=120, deadline=None, suppress_health_check=[HealthCheck.too_slow])
@given(
    st.sampled_from([(task, place) for task in (SPHERES, LETTERS) for place in places(task) if place]),
    VALUES,
    CHANGES,
)
def test_any_change_of_a_task_is_possible_or_refused_in_one_sentence(where, value, change):
    task, place = where
    said = "mine.yaml, possible."
    try:
        read(mutated(task, place, value, change), name="mine.yaml").check()
    except fp.InputError as error:
        said = str(error)
    assert said.startswith("mine.yaml, ")
    assert "\n" not in said
    assert said[-1] in ".?"
