"""Defects that scripted odd inputs found, each closed where the value enters; named by what is checked."""

import os
import re
import subprocess
import sys
import time
import warnings
from dataclasses import replace
from decimal import Decimal
from fractions import Fraction
from types import SimpleNamespace

import numpy as np
import pytest

import fingerpad as fp
from fingerpad.cli import commands, main
from fingerpad.core.errors import LONGEST_MESSAGE, FingerpadError, InputError, closest
from fingerpad.core.files import read_text
from fingerpad.core.phases import Phase
from fingerpad.core.plain_yaml import DEEPEST, LARGEST_TEXT, read_yaml
from fingerpad.core.regions import Rectangle, poisson_disc, rectangular
from fingerpad.core.signals import Traces
from fingerpad.core.tables import read_csv
from fingerpad.experiments.conditions import Conditions
from fingerpad.experiments.fit.fit import fit_recordings
from fingerpad.experiments.recording_files import read_recordings
from fingerpad.experiments.requests.afferents import fitted_afferent
from fingerpad.experiments.requests.stimuli import ShiftedBar
from fingerpad.experiments.requests.stimulus import TactileStimulus
from fingerpad.experiments.requests.touch import estimate_press
from fingerpad.export.sweep_results import observe_sweep, setting_response, write_sweep_spikes
from fingerpad.inference.rate_model import AfferentModel
from fingerpad.inference.recordings import RateRecordings
from fingerpad.mechanics.materials import Hencky
from fingerpad.neuron.population import sensitivities
from fingerpad.psychophysics.curve_fit import fit_psychometric
from fingerpad.psychophysics.encoding import gradient_sum
from fingerpad.psychophysics.ideal_observer import GaussianResponses
from fingerpad.psychophysics.observer import Experiment, GradientSum, discriminate_by
from fingerpad.report.style import new_figure, png
from fingerpad.skin.sampling import SurfaceProfile
from fingerpad.skin.store import Store, touch_key
from sections import SED_DRIVEN

HUGE = 10**400
PAIRS = np.array([[0, 1], [1, 2]])
TRAINS = fp.SpikeTrains.from_lists([[12.0, 40.0], []])
TIMES_MS, COURSE = [0.0, 50.0, 1000.0], [0.0, 1.0, 1.0]
TRACES = fp.Traces(TIMES_MS, np.outer(COURSE, [3.0, 5.0, 7.0, 9.0]), [50.0])
MANY = fp.Traces(TIMES_MS, np.outer(COURSE, np.full(18, 20.0)), [50.0], quantity="compressive_stress")
TASK = """
question: Which spheres?
object: {kind: sphere}
stimuli: {vary: object.curvature_per_m, values: [287, 296, 365]}
standard: 287
noise: 0.1
resolution: quick
"""


def task(more):
    return fp.DiscriminationRequest.read(read_yaml(TASK + more, "task"))


@pytest.mark.parametrize(
    "body", [fp.FlatPunch(0.1, 0.0), fp.Sphere(radius_mm=0.02), fp.Cylinder(0.02), fp.Bar(0.02, 0.0)]
)
def test_a_body_between_the_nodes_is_refused_before_it_is_pressed(body):
    with pytest.raises(InputError):
        fp.touch_of(fp.Fingertip(), body, fp.RampAndHold(0.5))


@pytest.mark.parametrize(
    "make",
    [
        lambda: fp.Grading(17.37, 5.0, 1.0, 1e-4, 1e-4),
        lambda: poisson_disc(Rectangle(30.0, 30.0), 1e5, 0, 0.8),
        lambda: rectangular(Rectangle(1e9, 1e-6), 100.0),
        lambda: fp.Population.grid(rows=10**6, columns=10**6),
        lambda: Experiment(presentations=10**5, distributions=10**5),
        lambda: task("experiment: {trials: 1000000000000}"),
    ],
)
def test_sizes_without_memory_or_end_are_refused_at_once(make):
    began = time.process_time()
    with pytest.raises(InputError, match=r"at most|may have|more than"):
        make()
    assert time.process_time() - began < 2.0


@pytest.mark.parametrize("window", [(50, 30), (np.nan, 50), (-100, -50), (50, 50), (30,), (600, 9500), "ab"])
def test_windows_of_rates_lie_in_what_was_recorded(window):
    recorded = RateRecordings(("a", "b", "c", "d"), [10.0, 20, 30, 40], [5.0, 10, 15, 20])
    skin = SimpleNamespace(sed=lambda sites, *quantities: TRACES)
    for ask in (
        lambda: fp.Afferent().rates(TRACES, window, (600, 950)),
        lambda: fp.Population.grid(rows=1, columns=4, afferent=SED_DRIVEN).respond(skin, window),
        lambda: AfferentModel.of_traces(TRACES, (window, (600, 950))),
        lambda: fit_recordings(TRACES, recorded, memberships=[0, 1, 0, 1], windows_ms=(window, (600, 950))),
    ):
        with pytest.raises(InputError, match="window"):
            ask()


@pytest.mark.parametrize(
    ("more", "said"),
    [
        ("code: [gradient_sum, gradient_sum]", "code must name each once"),
        ("measure: [static, static]", "measure must name each once"),
        ("afferents: {offset_mm: [99, 0]}", "afferents.*must lie on the volar skin"),
        ("afferents: {density_per_cm2: 1.0e-6}", "afferents.*must lie on the volar skin"),
    ],
)
def test_an_impossible_task_is_refused_before_anything_is_pressed(monkeypatch, more, said):
    monkeypatch.setattr("fingerpad.experiments.runner.Runner.solve", pytest.fail)
    with pytest.raises(InputError, match=said):
        fp.discriminate(task(more))


def test_seeds_fit_into_63_bits_where_they_enter():
    for make in (
        lambda: Conditions(seed=2**63),
        lambda: sensitivities(3, 0.1, 2**64),
        lambda: task("experiment: {seed: 9223372036854775808}"),
    ):
        with pytest.raises(InputError, match="seed must"):
            make()


@pytest.mark.parametrize(
    ("text", "value"),
    [
        ("2001-13-45", "2001-13-45"), ("2001-02-30", "2001-02-30"), ("0b_", "0b_"), ("0x_", "0x_"),
        ("1_0", "1_0"), ("1:30", "1:30"), ("１", "１"), ("on", "on"), (".inf", ".inf"), ("0x10", "0x10"),
        ("[1, -2.5, 1e-6, true, ~, '3']", [1, -2.5, 1e-6, True, None, "3"]), ("", None), ("1e400", np.inf),
        ("9" * 5000, np.inf),
    ],
)  # fmt: skip
def test_yaml_has_decimal_numbers_words_and_nothing_else(text, value):
    assert read_yaml(text, "f") == value


ALIASES = "a: &a [1]\n" + "\n".join(
    f"{b}: &{b} [{','.join(['*' + a] * 9)}]" for a, b in zip("abcdefghi", "bcdefghij", strict=True)
)


@pytest.mark.parametrize(
    ("text", "said"),
    [
        (f"{ALIASES}\nquestion: *j", "line 1"),
        ("!!int abc", "tag:yaml.org,2002:int"), ("!!float abc", "tag"), ("!!timestamp x", "tag"),
        ("!!bool maybe", "tag"), ("!!python/object:os.system x", "tag"), ("a: {<<: *b}", "alias"),
        ("[" * (DEEPEST + 1), "nested"), ("- " * 30, "nested"), ("[" * 200_000, "nested"),
        ("? [1]\n: 2", "a key must be a word"), ("a: 1\nb: 2\na: 3", "line 3: a is repeated"),
        ("a" * (LARGEST_TEXT + 1), "at most 300,000 characters"), ("\0", "special characters"),
    ],
)  # fmt: skip
def test_yaml_that_runs_code_grows_or_repeats_is_refused_at_once(text, said):
    began = time.process_time()
    with pytest.raises(InputError, match=said) as error:
        read_yaml(text, "f")
    assert time.process_time() - began < 2.0
    assert len(str(error.value)) < 600


def test_a_mapping_of_many_keys_is_read_in_linear_time():
    took = []
    for count in (2_000, 16_000):
        text = "\n".join(f"k{number}: 1" for number in range(count))
        began = time.process_time()
        assert len(read_yaml(text, "f")) == count
        took.append(time.process_time() - began)
    assert took[1] < 24 * max(took[0], 0.02)  # 64 times if each key were compared with each


def test_a_large_fold_and_a_table_of_semicolons_are_named_at_once(tmp_path):
    for fold in ("1000000000", "1e18", "1e300"):
        (tmp_path / "r.csv").write_text(f"shift_mm,static_rate_hz,fold\n0,1,1\n1,2,{fold}\n")
        with pytest.raises(InputError, match="no row is in fold 2"):
            read_recordings(tmp_path / "r.csv", ShiftedBar())
    (tmp_path / "r.csv").write_text("a;b;c\n1;2;3\n")
    with pytest.raises(InputError, match="Separate entries by commas"):
        read_csv(tmp_path / "r.csv", ("a", "b", "c"))


def test_recordings_of_many_shifts_are_read_in_linear_time(tmp_path):
    rows = "".join(f"{number / 1e5!r},1\n" for number in range(4_000))
    (tmp_path / "r.csv").write_text("shift_mm,static_rate_hz\n" + rows * 2)
    began = time.process_time()
    recorded = read_recordings(tmp_path / "r.csv", ShiftedBar())
    assert len(recorded.recordings.stimuli) == 4_000
    assert set(recorded.presentations.values()) == {2}
    assert time.process_time() - began < 6.0
    names = [ShiftedBar().named(text).name for text in ("0.123456789", "0.123456788", "1.50", "-2", "1e-5")]
    assert names == ["0.123456789", "0.123456788", "1.5", "-2", "1e-05"]


def test_names_with_dollars_are_drawn_as_they_are():
    def draw(text):
        figure = new_figure(2.0, 2.0)
        axes = figure.add_subplot()
        axes.set(xlabel=text, title=text, xscale="log", xlim=(1, 100))
        axes.set_yticks([0, 1], [text, text])
        axes.plot([1, 2], label=text)
        axes.legend()
        return figure

    assert png(draw, r"$\nope{ $").startswith(b"\x89PNG")


NO_NUMBERS = [
    HUGE, -HUGE, "3", b"3", True, np.bool_(True), None, ["3.0"], 1j, np.complex128(1.0),
    np.datetime64("2001-01-01"), np.timedelta64(3, "ms"), np.ma.masked, np.array("3"), np.array([[[3.0]]]),
    np.nan,
    np.inf, Decimal("NaN"), "１",
]  # fmt: skip


@pytest.mark.parametrize(
    "make",
    [
        fp.Sphere,
        lambda odd: fp.RampAndHold(depth_mm=odd),
        lambda odd: fp.Material.neo_hooke(odd, 0.4),
        lambda odd: Rectangle(odd, 6.0),
        lambda odd: Hencky(odd, 100.0),
        lambda odd: TactileStimulus(fp.Sphere(curvature_per_m=287), friction=odd),
        lambda odd: fp.Trajectory((0.0, 1.0), odd),
        lambda odd: fp.Traces([0.0, 1.0], odd),
        lambda odd: Experiment(criterion=odd),
    ],
)
def test_what_is_no_finite_real_number_is_refused_where_it_enters(make):
    for odd in NO_NUMBERS:
        with pytest.raises(InputError) as error:
            make(odd)
        assert len(str(error.value)) < 300


@pytest.mark.parametrize(
    "half",
    [np.float32(0.5), np.float16(0.5), np.longdouble(0.5), Decimal("0.5"), Fraction(1, 2), np.array(0.5)],
)
def test_numbers_of_any_real_type_become_the_same_float(half):
    for made, plain in (
        (fp.Bar(2, half), fp.Bar(2.0, 0.5)),
        (fp.Material.neo_hooke(half, 0.25), fp.Material.neo_hooke(0.5, 0.25)),
        (fp.RampAndHold(half), fp.RampAndHold(0.5)),
        (Rectangle(half, 1, (half, 0)), Rectangle(0.5, 1.0, (0.5, 0.0))),
    ):
        assert made == plain
        assert repr(made) == repr(plain)


def test_an_integer_a_numpy_number_and_a_float_have_one_key():
    keys = set()
    for curvature, half, zero in (
        (287.0, 0.5, 0.0),
        (287, np.float32(0.5), 0),
        (np.float32(287), 0.5, np.int8(0)),
    ):
        ball, motion = fp.Sphere(curvature_per_m=curvature), fp.RampAndHold(half)
        keys.add(touch_key(fp.touch_of(fp.Fingertip(), ball, motion, tilt_deg=zero)))
    assert len(keys) == 1
    with pytest.raises(InputError, match="friction must be a finite number"):
        fp.touch_of(fp.Fingertip(), fp.Sphere(curvature_per_m=287), friction="0.3")


def test_sequences_become_tuples_so_that_values_hash():
    readings = np.array(fp.Fingertip().volar_readings_mm)
    finger = fp.Fingertip(nail_x_mm=[16.5, 29.25], volar_readings_mm=readings)
    assert finger == fp.Fingertip()
    assert hash(finger) == hash(fp.Fingertip())
    assert fp.touch_of(finger, fp.Sphere(curvature_per_m=287)).mesh.nodes_mm.shape[1] == 3


@pytest.mark.parametrize(
    "make",
    [
        lambda: fp.Tissues(1, 2, 3, 4),
        lambda: fp.PressSettings(newton=None),
        lambda: fp.Population.grid(afferent="x"),
        lambda: TactileStimulus(None),
        lambda: fp.Afferent(dynamic_quantity="x"),
        lambda: fp.bodies.Union([fp.Sphere()], at_mm=None),
        lambda: gradient_sum([1.0, np.nan, 2.0], PAIRS),
        lambda: discriminate_by(GradientSum(PAIRS), [[1, 2, 3], [3, 4, 2]], 0.1, 1, silent_value=np.nan),
        lambda: discriminate_by(GradientSum(np.empty((0, 2), int)), [[1, 2, 3], [3, 4, 2]], 0.1, 1),
        lambda: replace(fp.Population.grid().respond_to(MANY), windows_ms=((50.0, 30.0), (600.0, 950.0))),
        lambda: SurfaceProfile([2, 1], [np.nan]),
        lambda: RateRecordings("ab", [1.0, 2.0], None),
        lambda: fp.Grading(17.0, 1.0, 1.0, 0.5, 0.5, full="yes"),
        lambda: Phase(3, 0.0, 1.0),
        lambda: fp.SpikeTrains([1.0, 2.0], [0, 0.5, 2]),
        lambda: fp.Traces([0, 1], np.ma.array([[1.0], [2.0]], mask=[[0], [1]])),
        lambda: fp.Traces(np.array(["2001-01-01", "2001-01-02"], dtype="datetime64[D]"), [[1.0], [2.0]]),
        lambda: Traces([0.0, 1.0], [[1j], [2.0]], quantity="current"),
        lambda: fp.Traces([0.0, HUGE], [[1.0], [2.0]]),
        lambda: GaussianResponses([1.0, 2.0], [[1.0, 99.0], [0.1, 1.0]]),
        lambda: fp.Trajectory([0.0, 1.0], [0.0, 1.0]).reduced(0.0),
        lambda: fp.sampled(100.0, depth_mm=(1, 2)),
        lambda: fp.chirp(0.8, 0.05, (5.0, "6"), sweep_ms=1000.0),
        lambda: fp.braille(3),
        lambda: fp.braille([["a"]]),
        lambda: fp.named_tissues(np.array([1.0, 2.0])),
    ],
)
def test_a_value_of_another_kind_is_refused_where_it_enters(make):
    with pytest.raises(InputError):
        make()


def test_devices_pipes_folders_large_files_and_null_characters_are_no_files(tmp_path, monkeypatch):
    os.mkfifo(tmp_path / "pipe")
    for path in ("/dev/zero", tmp_path / "pipe", tmp_path, "a\0b", tmp_path / "none"):
        with pytest.raises(InputError, match=r"must be a file that can be read|null character"):
            read_text(path)
    monkeypatch.setattr("fingerpad.core.files.LARGEST_TEXT_MB", 1e-6)
    (tmp_path / "a.csv").write_text("long enough")
    with pytest.raises(InputError, match="at most 1e-06 MB"):
        read_text(tmp_path / "a.csv")


def test_a_pipe_in_the_place_of_an_archive_does_not_hang(tmp_path):
    pipe = tmp_path / "model.npz"
    os.mkfifo(pipe)
    with pytest.raises(InputError, match="it is a device or a pipe"):
        fp.read_reduced(pipe)
    np.save(tmp_path / "text.npy", np.array([["a", "b"]]))
    with pytest.raises(InputError, match="must hold real numbers"):
        fp.read_height_map(tmp_path / "text.npy", 0.5)
    for ending in (".npy", ".png"):
        os.mkfifo(pipe.with_suffix(ending))
        with pytest.raises(InputError):
            fp.read_height_map(pipe.with_suffix(ending), 0.1)
    store = Store(tmp_path / "indentations")
    touch = fp.touch_of(fp.Fingertip(), fp.Sphere(curvature_per_m=287))
    store.path(touch).parent.mkdir()
    os.mkfifo(store.path(touch))
    assert store.missing([touch])


def test_an_error_of_the_system_is_one_sentence(run_program, monkeypatch):
    def without_rights(*_):
        raise PermissionError(13, "Permission denied", "indentations")

    monkeypatch.setitem(commands.COMMANDS, "init", (*commands.COMMANDS["init"][:2], without_rights))
    said = "fingerpad: indentations cannot be used (Permission denied).\n"
    assert run_program(main, "fingerpad", "init") == (2, "", said)


@pytest.mark.skipif(sys.platform != "linux", reason="it needs /dev/full")
def test_a_full_output_is_one_sentence():
    with open("/dev/full", "w") as full:
        command = [sys.executable, "-m", "fingerpad", "init", "--list"]
        done = subprocess.run(command, stdout=full, stderr=subprocess.PIPE, text=True)
    assert done.returncode == 2
    assert done.stderr == "fingerpad: The output cannot be used (No space left on device).\n"


@pytest.mark.parametrize(
    "text",
    [
        "[" * 200_000, '{"format": "fingerpad fit", "format_version": 3, "manifest": [1], "fit": {}}',
        '{"manifest": [1], "fit": {"parameters": 3}}', "[1]", "3", '"text"', "",
    ],
)  # fmt: skip
def test_a_file_that_holds_no_afferent_is_named(tmp_path, text):
    (tmp_path / "fit.json").write_text(text)
    with pytest.raises(InputError, match=r"fit\.json"):
        fitted_afferent(tmp_path / "fit.json")


def test_a_number_of_folds_is_named_as_its_key(run_program):
    with open("r.csv", "w") as file:
        file.write("shift_mm,static_rate_hz\n" + "".join(f"{shift},{10 * shift}\n" for shift in range(8)))
    status, _, errors = run_program(main, "fingerpad", "fit", "r.csv", "--stimuli", "bar", "--folds", "99")
    assert status == 2
    assert "folds must be at most the number of stimuli, 8" in errors


def test_no_message_has_a_value_at_full_length(tmp_path):
    long = "x" * 100_000
    for make in (
        lambda: fp.Sphere(curvature_per_m=long),
        lambda: fp.Energy(long),
        lambda: fp.Grading(17.0, 1.0, 1.0, 0.5, 0.5, dermis=long),
        lambda: Conditions(resolution=long),
        lambda: fp.DiscriminationRequest.read({"question": long, "nonsense": long}),
        lambda: fp.TouchRequest.read(tmp_path / long[:200]),
        lambda: ShiftedBar().named(long),
    ):
        with pytest.raises(FingerpadError) as error:
            make()
        assert len(str(error.value)) <= 0.8 * LONGEST_MESSAGE


@pytest.mark.parametrize(
    ("formula", "coefficients"),
    [
        ("-" * 20_000 + "I1", ()), ("-" * 3_000 + "I1", ()), ("+".join(["I1"] * 20_000), ()),
        ("+".join(["I1"] * 1_300), ()), ("(" * 1_000 + "I1" + ")" * 1_000, ()), ("I1\0", ()),
        ("I1**10**10", ()),
        ("1if", ()), (f"{HUGE} * I1", ()), ("I1", 3), ("I1", ("a",)), ("I1", (("a", "b", "c"),)),
        ("m * (I1 - 3) + k * (J - 1)**2", (("k", 1.0), ("k", 2.0), ("m", 3.0))), ("__import__('os')", ()),
    ],
)  # fmt: skip
def test_a_formula_that_is_none_is_refused(formula, coefficients):
    with pytest.raises(InputError) as error:
        fp.Energy(formula, coefficients)
    assert len(str(error.value)) < 600


def test_times_and_levels_beyond_use_are_refused():
    with pytest.raises(InputError, match="ramp_ms must lie within"):
        fp.RampAndHold(0.2, 1e300, 1e300)
    with pytest.raises(InputError, match="levels must lie within"):
        fit_psychometric([1e300, 2e300], [5, 9], [10, 10])
    with pytest.raises(InputError, match="spread must be at most"):
        sensitivities(3, 1e3, 1)
    for text in ("1_0", "１", "0x1", "1:30", "nan", "inf", "1e400"):
        with pytest.raises(InputError, match="must be a finite number"):
            ShiftedBar().named(text)


@pytest.mark.parametrize(
    "words", [("discriminate", "x", "--out", ""), ("check", ""), ("fit", "--method", "")]
)
def test_an_empty_word_is_no_folder(run_program, is_refused, words):
    is_refused(run_program(main, "fingerpad", *words), "fingerpad", "must not be empty", "")


# Values of another kind than a function takes


@pytest.mark.parametrize(
    "read",
    [
        fp.read_trajectory, fp.read_touch, fp.open_sweep,
        fp.read_surface, fp.read_finger, lambda path: fp.read_height_map(path, 0.1),
        lambda path: fp.write_sweep_table(None, path),
    ],
    ids=lambda read: getattr(read, "__name__", ""),
)  # fmt: skip
def test_what_is_no_path_is_refused(read):
    for path in (None, 3, 2.5, True, b"touch.csv", [], {}, np.float32(1)):
        with pytest.raises(InputError, match=r"must be a path, as a text or a Path: got"):
            read(path)


@pytest.mark.parametrize(
    "use",
    [
        fp.setting_touch, setting_response,
        lambda data: observe_sweep(data, {"along": "motion.depth_mm"}),
        lambda data: fp.write_sweep_table(data, "rates.csv"),
        lambda data: write_sweep_spikes(data, "spikes.nwb"),
    ],
    ids=lambda use: getattr(use, "__name__", ""),
)  # fmt: skip
def test_what_is_no_data_set_of_a_sweep_is_refused(use):
    for data in (None, 3, [], {}, "study.zarr", np.zeros(2)):
        with pytest.raises(InputError, match="must be a data set from open_sweep: got"):
            use(data)


# What a first user met


def test_an_estimate_counts_the_cycles_that_are_solved():
    motion = {"kind": "sine", "depth_mm": 0.3, "amplitude_mm": 0.02, "frequency_hz": 20, "cycles": 100}
    many = estimate_press(fp.TouchRequest.read({"object": "sphere", "motion": motion}).touch)
    ten = estimate_press(fp.TouchRequest.read({"object": "sphere", "motion": motion | {"cycles": 10}}).touch)
    assert many.steps == ten.steps
    assert closest("depth", ["time_ms", "depth_mm", "depth_um"]) == "depth_mm"


def test_a_command_shows_a_warning_as_one_sentence_without_its_place(run_program, tmp_path):
    motion = "{kind: sine, depth_mm: 0.3, amplitude_mm: 0.02, frequency_hz: 300, cycles: 2}"
    (tmp_path / "touch.yaml").write_text(f"object: sphere\nmotion: {motion}\n")
    with warnings.catch_warnings():
        warnings.simplefilter("default")
        status, _, errors = run_program(main, "fingerpad", "check", "touch.yaml")
    assert status == 0
    assert re.fullmatch(r"fingerpad: The fastest part [^\n]*without mass\.\n", errors)
