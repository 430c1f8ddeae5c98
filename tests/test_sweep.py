"""Sweeps: what varies, what is pressed, what is written, and what happens when something goes wrong."""

import json
import os
import sys
import warnings
from types import SimpleNamespace

import numpy as np
import pandas
import pytest
import xarray
import zarr

import fingerpad as fp
from fingerpad.cli import main
from fingerpad.core.errors import InputError, StoreError
from fingerpad.core.signals import RECEPTOR_COLUMNS
from fingerpad.experiments.discrimination.analysis import SESSION
from fingerpad.experiments.runner import Runner, software
from fingerpad.experiments.sweep.request import Constraint
from fingerpad.experiments.sweep.settings import observe
from fingerpad.export.sweep import DONE, FAILED, LEFT_OUT, SweepFile
from fingerpad.export.sweep_results import observe_sweep, open_sweep, setting_response, write_sweep_spikes
from fingerpad.psychophysics.encoding import Noise
from fingerpad.psychophysics.observer import ENCODERS, Experiment, discriminate_by
from fingerpad.skin.indentation import Touch

MOTION = {"ramp_ms": 50, "hold_ms": 60}
TOUCH = {"object": "cylinder", "motion": MOTION, "afferents": {"rows": 1, "columns": 2}}
STUDY = {
    "touch": TOUCH,
    "grid": {"motion.depth_mm": [0.3, 0.5, 9.0], "afferents.columns": [2, 3]},
    "where": "motion.depth_mm < 0.4 or afferents.columns == 3",
}
"""Three presses, of which one is impossible, and one setting that is left out."""


@pytest.fixture(scope="module")
def folder(tmp_path_factory):
    """Folder with a finished study, and the indentations that all tests share."""
    found = tmp_path_factory.mktemp("sweep")
    fp.sweep(STUDY, out=found / "study.zarr")
    return found


@pytest.fixture
def run(folder, tmp_path, monkeypatch):
    """Run a sweep whose presses are all stored."""

    def run(sweep, name="study.zarr", **options):
        monkeypatch.setattr(Touch, "solve", pytest.fail)
        return fp.sweep(sweep, out=tmp_path / name, store=folder / "indentations", **options)

    return run


def files(folder):
    return {
        str(path.relative_to(folder)): path.read_bytes()
        for path in sorted(folder.rglob("*"))
        if path.is_file() and path.name != "zarr.json"
    }


def points(**sweep):
    found = fp.SweepRequest.read({"touch": {"object": "sphere"}, **sweep})
    return [found.values(setting) for setting in range(found.size)]


def test_a_sweep_is_written_with_its_keys_in_one_order():
    """A set of keys has another order in every run, and the file that holds them had other bytes."""
    asked = {"where": "motion.depth_mm < 9", "fields": ["sed_kpa"], "title": "Depths"} | STUDY
    assert list(fp.SweepRequest.read(asked).written()) == ["title", "touch", "grid", "where", "fields"]


def test_a_grid_has_all_combinations_and_fields_of_the_skin_come_first():
    sweep = fp.SweepRequest.read(
        {
            "touch": {"object": "sphere"},
            "grid": {
                "afferents.seed": [1, 2],
                "motion.depth_mm": {"start": 0.2, "stop": 0.6, "count": 3},
                "object.curvature_per_m": {"start": 100, "stop": 400, "count": 3, "spacing": "logarithmic"},
            },
        }
    )
    assert [axis.name for axis in sweep.axes] == [
        "motion_depth_mm", "object_curvature_per_m", "afferents_seed",
    ]  # fmt: skip
    assert (sweep.shape, sweep.press_shape, sweep.presses) == ((3, 3, 2), (3, 3), 9)
    assert sweep.values(3) == pytest.approx(
        {"motion.depth_mm": 0.2, "object.curvature_per_m": 200.0, "afferents.seed": 2}
    )
    assert list(sweep.settings_of(4)) == [8, 9]
    assert sweep.content(0)["object"] == {"kind": "sphere", "curvature_per_m": pytest.approx(100.0)}
    assert points(zip={"place.x_mm": [0, 1], "motion.depth_mm": [0.2, 0.4]}) == [
        {"place.x_mm": 0, "motion.depth_mm": 0.2},
        {"place.x_mm": 1, "motion.depth_mm": 0.4},
    ]


@pytest.mark.parametrize("method", ["sobol", "latin_hypercube"])
def test_a_sample_fills_its_box_and_depends_on_its_seed_alone(method):
    fields = {"friction": [0, 1], "motion.depth_mm": [0.2, 0.6]}
    box = {"method": method, "count": 13, "seed": 5, "fields": fields}
    found = points(sample=box)
    assert len(found) == 13
    assert points(sample=box) == found != points(sample=box | {"seed": 6})
    friction = np.sort([point["friction"] for point in found])
    depth = np.sort([point["motion.depth_mm"] for point in found])
    assert 0.0 <= friction[0] < friction[-1] <= 1.0
    assert 0.2 <= depth[0] < depth[-1] <= 0.6
    if method == "latin_hypercube":
        assert np.floor(13 * friction).tolist() == list(range(13))


def test_a_constraint_compares_fields():
    content = {"a": {"b": 1.0}, "c": 2}
    for text, met in (
        ("a.b < 2 * c", True),
        ("a.b > c", False),
        ("0 < a.b <= 1.0", True),
        ("a.b == 1 and (c > 3 or c == -2 + 4)", True),
    ):
        assert Constraint(text)(content) is met
    with pytest.raises(InputError, match=r"not_there of 'not_there < 1' must be given in touch or vary"):
        Constraint("not_there < 1")(content)


@pytest.mark.parametrize(
    ("sweep", "said"),
    [
        ({"grid": {"object.raduis_mm": [1]}}, "object.raduis_mm is unknown: did you mean radius_mm?"),
        ({"grid": {"friction": []}}, "must have a list of values, or start, stop and count: got []"),
        ({}, "grid, zip or sample must name a field that varies: none does"),
        ({"grid": {"friction": [0.1]}, "where": "friction >"}, "must be a comparison such as"),
        ({"grid": {"friction": [0.1]}, "where": "__import__('os') > 1"}, "must have fields, numbers"),
        ({"grid": {"friction": [0.1]}, "where": "friction > 2"}, "where leaves no setting"),
        ({"grid": {"friction": ["rough"]}}, "friction must be a finite number: got 'rough'"),
        ({"grid": {"friction": [0.1]}, "zip": {"friction": [1]}}, "friction must vary in one way"),
        ({"grid": {"outputs": ["csv"]}}, "outputs cannot vary"),
        ({"zip": {"place.x_mm": [1, 2], "place.z_mm": [1]}}, "all fields must have as many values"),
        ({"sample": {"count": 4, "fields": {"friction": [1, 0]}}}, "a lower bound and then a higher one"),
        ({"sample": {"count": 4, "fields": {}}}, "fields must name a field or more"),
        ({"grid": {"friction": {"start": 0, "stop": 1}}}, "count must be given: it is missing"),
        ({"grid": {"friction": {"start": 0, "stop": 1, "count": 2, "spacing": "logarithmic"}}}, "above 0"),
        ({"grid": {"seed": [1]}}, "seed is unknown"),
        ({"grid": {"friction.much": [1]}, "touch": {"object": "sphere", "friction": 0.1}},
         "must be a mapping"),
        ({"grids": {}}, "grids is unknown: did you mean grid?"),
        ({"grid": {"friction": [0.1]}, "fields": ["warmth"]}, "must be one of times_ms"),
    ],
)  # fmt: skip
def test_a_bad_sweep_is_refused_in_one_sentence(sweep, said, tmp_path):
    with pytest.raises(InputError) as refusal:
        fp.sweep({"touch": {"object": "sphere"}, **sweep}, out=tmp_path / "study.zarr")
    assert said in str(refusal.value)
    assert str(refusal.value).startswith("sweep, ")
    assert list(tmp_path.iterdir()) == []


def test_a_file_is_refused_with_its_line_and_a_large_sweep_needs_consent(tmp_path):
    (tmp_path / "sweep.yaml").write_text("touch: {object: sphere}\ngrid:\n  motion.depth_mm: []\n")
    with pytest.raises(InputError, match=r"sweep.yaml, line \d, grid.motion.depth_mm: a field that varies"):
        fp.SweepRequest.read(tmp_path / "sweep.yaml").check()
    many = {"touch": TOUCH, "grid": {"motion.depth_mm": {"start": 0.1, "stop": 1, "count": 10_001}}}
    with pytest.raises(InputError, match=r"at most 10000 settings, or --yes be given: it has 10001"):
        fp.sweep(many, out=tmp_path / "study.zarr")


def test_the_data_set_has_the_fields_that_vary_as_dimensions(folder):
    data = open_sweep(folder / "study.zarr")
    assert data.force_mn.dims == ("motion_depth_mm", "time")
    assert data.static_rate_hz.dims == ("motion_depth_mm", "afferents_columns", "receptor")
    assert data.motion_depth_mm.values.tolist() == [0.3, 0.5, 9.0]
    assert (data.motion_depth_mm.units, data.force_mn.units, data.static_rate_hz.units) == ("mm", "mN", "s-1")
    assert data.status.values.tolist() == [[DONE, DONE], [LEFT_OUT, DONE], [LEFT_OUT, FAILED]]
    assert "because of the bone" in data.reason.values[2, 1]
    assert data.reason.values[0].tolist() == ["", ""]
    assert np.isnan(data.force_mn.values[2]).all()
    # Rows of fewer receptors end in nan.
    assert np.isnan(data.dynamic_rate_hz.values[0]).tolist() == [[False, False, True], [False, False, False]]
    assert {"version", "inputs_sha256", "seed", "code_hash", "packages"} <= set(data.attrs)
    with warnings.catch_warnings():  # any reader of zarr opens it
        warnings.simplefilter("error")
        plain = xarray.open_zarr(folder / "study.zarr", decode_timedelta=False)
    np.testing.assert_array_equal(plain.force_mn, data.force_mn)
    assert json.loads((folder / "study.zarr" / "zarr.json").read_text())["zarr_format"] == 3


def test_a_setting_has_the_numbers_and_the_response_of_its_touch(folder):
    data = open_sweep(folder / "study.zarr")
    where = {"motion_depth_mm": 0, "afferents_columns": 1}
    touch = fp.setting_touch(data, **where)
    assert touch["motion"] == {"ramp_ms": 50, "hold_ms": 60, "depth_mm": 0.3}
    pressed = fp.SweepRequest.read(STUDY).described(1).run(Runner(folder))
    one, found = data.isel(where), setting_response(data, **where)
    assert one.force_mn.values.tolist() == pressed.skin.force_mn.tolist()
    assert one.time_ms.values.tolist() == pressed.skin.times_ms.tolist()
    trains = found.spikes
    assert [train.tolist() for train in trains] == [train.tolist() for train in pressed.response.spikes]
    assert sum(map(len, trains)) > 0
    for name in ("positions_mm", "static_rate_hz", "first_spike_latency_ms"):
        np.testing.assert_array_equal(getattr(found, name), getattr(pressed.response, name))
    assert (found.pitch_mm, found.phases) == (pressed.response.pitch_mm, pressed.response.phases)
    assert found.duration_ms == pressed.response.duration_ms
    with pytest.raises(InputError, match="an index must be given for each of motion_depth_mm"):
        fp.setting_touch(data, motion_depth_mm=0)


def test_afferents_alone_press_nothing_and_fields_are_kept_on_request(run, tmp_path):
    only = {
        "touch": TOUCH | {"motion": TOUCH["motion"] | {"depth_mm": 0.3}},
        "grid": {"afferents.density_per_cm2": [50, 80, 110]},
        "fields": ["contact_pressure_kpa", "displacement_mm"],
    }
    done = run(only)
    assert (done.done, done.pressed, done.loaded) == (3, 0, 1)
    data = open_sweep(tmp_path / "study.zarr")
    assert data.force_mn.dims == ("time",)
    assert data.contact_pressure_kpa.dims == ("time", "skin_node")
    assert data.displacement_mm.dims == ("node", "axis")
    assert data.skin_node_mm.shape == (data.sizes["skin_node"], 3)
    assert float(data.contact_pressure_kpa.max()) > 0.0


def test_stiffer_tissues_take_more_force(folder):
    soft, stiff = (
        fp.sweep(
            {"touch": TOUCH, "grid": {"motion.depth_mm": [0.3], "stiffness": [factor]}}, out=folder / name
        )
        for factor, name in ((1.0, "soft.zarr"), (2.0, "stiff.zarr"))
    )
    assert (soft.pressed, stiff.pressed) == (0, 1)
    forces = [open_sweep(done.path).force_mn.max().item() for done in (soft, stiff)]
    assert forces[1] == pytest.approx(2.0 * forces[0], rel=1e-3)


@pytest.mark.parametrize("ending", ["csv", "parquet"])
def test_a_table_of_rates_is_read_back_bit_by_bit(folder, tmp_path, ending):
    data = open_sweep(folder / "study.zarr")
    path = fp.write_sweep_table(data, tmp_path / f"rates.{ending}")
    if ending == "csv":
        # Before 3.1, pandas rounds unless it is asked not to; from then on it need not be asked.
        rounds = tuple(int(part) for part in pandas.__version__.split(".")[:2]) < (3, 1)
        table = pandas.read_csv(path, comment="#", **({"float_precision": "round_trip"} if rounds else {}))
        about = json.loads(path.read_text().splitlines()[0].removeprefix("# "))
    else:
        table = pandas.read_parquet(path)
        about = table.attrs
    assert about["inputs_sha256"] == data.attrs["inputs_sha256"]
    places = ["motion_depth_mm", "afferents_columns", "receptor", "x_mm", "z_mm"]
    assert list(table.columns) == [*places, *RECEPTOR_COLUMNS]
    assert len(table) == 2 + 3 + 3
    older = fp.write_sweep_table(data.drop_vars("recruitment_rank"), tmp_path / "older.csv")
    assert older.read_text().splitlines()[1] == ",".join([*places, *list(RECEPTOR_COLUMNS)[:-1]])
    some = table[(table.motion_depth_mm == 0.5) & (table.afferents_columns == 3)]
    one = data.isel(motion_depth_mm=1, afferents_columns=1)
    for name in ("dynamic_rate_hz", "static_rate_hz", "first_spike_latency_ms", "spike_count"):
        np.testing.assert_array_equal(some[name], one[name])
    np.testing.assert_array_equal(some[["x_mm", "z_mm"]], one.receptor_mm)


def test_a_table_that_cannot_be_written_is_refused(folder, tmp_path):
    data, path = open_sweep(folder / "study.zarr"), tmp_path / "rates.csv"
    with pytest.raises(InputError, match=r"is written as \.csv or \.parquet: got rates.xls"):
        fp.write_sweep_table(data, tmp_path / "rates.xls")
    with pytest.raises(InputError, match="A setting must be done for a table of rates"):
        fp.write_sweep_table(data.isel(motion_depth_mm=[2]), path)


def test_spikes_of_a_sweep_are_a_session_of_nwb(folder, tmp_path):
    pynwb = pytest.importorskip("pynwb")
    data = open_sweep(folder / "study.zarr")
    path = write_sweep_spikes(data, tmp_path / "spikes.nwb", afferents_columns=1)
    responses = [setting_response(data, motion_depth_mm=n, afferents_columns=1) for n in range(2)]
    with pynwb.NWBHDF5IO(str(path), "r") as file:
        session = file.read()
        names = session.trials["stimulus"][:].tolist()
        # Without these two nwbinspector finds a critical defect and a violation of best practice.
        assert (session.subject.species, session.units.resolution) == ("Homo sapiens", 1e-9)
        onsets_ms = 1000.0 * session.trials["start_time"][:]
        trains = [1000.0 * session.units["spike_times"][receptor] for receptor in range(3)]
    assert names == [f"motion.depth_mm {depth}, afferents.columns 3" for depth in (0.3, 0.5)]
    for receptor, train in enumerate(trains):
        own = [
            onset + response.spikes[receptor] for onset, response in zip(onsets_ms, responses, strict=True)
        ]
        np.testing.assert_allclose(train, np.concatenate(own), rtol=1e-12)
    with pytest.raises(InputError, match="must come from the same receptors"):
        write_sweep_spikes(data, tmp_path / "all.nwb")
    with pytest.raises(InputError, match="depth must be one of motion_depth_mm, afferents_columns"):
        write_sweep_spikes(data, tmp_path / "all.nwb", depth=1)
    with pytest.raises(InputError, match=r"must be done: .*because of the bone"):
        setting_response(data, motion_depth_mm=2, afferents_columns=1)
    with pytest.raises(InputError, match=r"must be within 0 \.\.\. 2: got 3"):
        fp.setting_touch(data, motion_depth_mm=3, afferents_columns=1)


def test_a_second_run_does_nothing_and_failures_are_tried_again_on_request(run):
    first, again, retried = run(STUDY), run(STUDY), run(STUDY, retry_failed=True)
    assert (first.done, first.failed, first.left_out, first.loaded) == (3, 1, 2, 2)
    assert (again.done, again.failed, again.loaded) == (3, 1, 0)
    assert (retried.done, retried.failed) == (3, 1)


@pytest.mark.parametrize(
    ("failing", "failure"),
    [("status", KeyboardInterrupt()), ("spike_time_ms", OSError(28, "No space left on device"))],
)
def test_a_write_that_is_cut_short_goes_on_with_the_same_bits(
    run, folder, tmp_path, monkeypatch, failing, failure
):
    write = SweepFile._write

    def cut(file, name, *where):
        if name == failing:
            raise failure
        write(file, name, *where)

    with monkeypatch.context() as broken:
        broken.setattr(SweepFile, "_write", cut)
        with pytest.raises((KeyboardInterrupt, StoreError)) as ended:
            run(STUDY)
    if isinstance(failure, OSError):
        assert "cannot be written (No space left on device): make space" in str(ended.value)
    assert not (open_sweep(tmp_path / "study.zarr").status == DONE).any()
    assert run(STUDY).done == 3
    assert files(tmp_path / "study.zarr") == files(folder / "study.zarr")


def test_another_sweep_or_program_is_refused(run, tmp_path, monkeypatch):
    run(STUDY)
    other = STUDY | {"where": "motion.depth_mm < 0.4"}
    with pytest.raises(InputError, match=r"must be of the same sweep: it is of another one; choose"):
        run(other)
    with monkeypatch.context() as newer:
        newer.setattr("fingerpad.export.sweep.software", lambda: software() | {"code_hash": "0123"})
        with pytest.raises(InputError, match=r"must be continued with the same program: version .* began it"):
            run(STUDY)
    group = zarr.open_group(tmp_path / "study.zarr", mode="r+")
    group.attrs["format_version"] = 2
    with pytest.raises(InputError, match="must have format_version 1: got 2"):
        open_sweep(tmp_path / "study.zarr")
    group.attrs["format"] = "other"
    with pytest.raises(InputError, match="must be a sweep that fingerpad wrote"):
        open_sweep(tmp_path / "study.zarr")


@pytest.mark.parametrize("there", [None, "note.txt"])
def test_what_is_no_sweep_is_refused(tmp_path, there):
    path = tmp_path / "study.zarr"
    if there:
        path.mkdir()
        (path / there).write_text("mine")
    with pytest.raises(InputError, match="must be a sweep that fingerpad wrote: it cannot be read"):
        open_sweep(path)
    with pytest.raises(InputError, match=r"written as \.zarr"):
        fp.sweep(STUDY, out=tmp_path / "study.nc")
    if there:
        with pytest.raises(InputError, match="must be a sweep that fingerpad wrote: it cannot be read"):
            fp.sweep(STUDY, out=path)


def test_a_notebook_shows_one_bar_that_changes(run, monkeypatch):
    shown = []
    line = SimpleNamespace(update=lambda content, raw: shown.append(content))
    module = SimpleNamespace(display=lambda content, **_: shown.append(content) or line)
    monkeypatch.setitem(sys.modules, "IPython", SimpleNamespace(display=module))
    monkeypatch.setitem(sys.modules, "IPython.display", module)
    run(STUDY, progress=fp.notebook_progress())
    assert "presses" in shown[-1]["text/html"]
    assert "3/3" in shown[-1]["text/html"]
    assert "3/3" in shown[-1]["text/plain"]
    monkeypatch.setitem(sys.modules, "IPython.display", None)
    with pytest.raises(InputError, match="needs IPython, as in a notebook"):
        fp.notebook_progress()


def test_the_command_estimates_runs_and_tells_how_many_failed(run_program, folder, tmp_path):
    (tmp_path / "sweep.yaml").write_text(json.dumps(STUDY))
    words = ("fingerpad", "sweep", "sweep.yaml", "--store", folder / "indentations", "--jobs", 1)
    status, said, errors = run_program(main, "fingerpad", "check", "sweep.yaml")
    assert (status, errors) == (0, "")
    assert said.startswith("4 settings, 3 presses.\nIf none is stored: about ")
    assert os.listdir(tmp_path) == ["sweep.yaml"]
    outputs = ("--table", "rates.csv", "--spikes", "spikes.txt")
    status, said, errors = run_program(main, *words, "--out", "study.zarr", *outputs)
    assert (status, os.listdir(tmp_path)) == (2, ["sweep.yaml"])
    assert "Spikes of a sweep are written as .nwb: got spikes.txt" in errors
    status, said, errors = run_program(main, *words, "--out", "study.zarr", *outputs[:2])
    assert said.endswith("Table: rates.csv\n")
    assert status == 11
    assert said.startswith("3 of 4 settings done, 1 failed; 0 pressed and 2 loaded in ")
    assert (
        open_sweep(tmp_path / "study.zarr").attrs["command"].startswith("fingerpad sweep sweep.yaml --store")
    )


def test_a_scheduler_that_cannot_be_reached_is_refused(run_program, is_refused, tmp_path, monkeypatch):
    pytest.importorskip("distributed")
    monkeypatch.setattr("fingerpad.experiments.cluster._CONNECT_S", 0.3)
    (tmp_path.parent / "study.yaml").write_text(json.dumps(STUDY))
    outcome = run_program(main, "fingerpad", "sweep", "../study.yaml", "--scheduler", "tcp://127.0.0.1:1")
    is_refused(outcome, "fingerpad", "--scheduler", "tcp://127.0.0.1:1")


STIMULI = {
    "touch": TOUCH,
    "grid": {"motion.depth_mm": [0.3, 0.5, 0.7], "afferents.columns": [2, 3]},
    "observer": {"along": "motion.depth_mm", "standard": 0.5, "noise": 0.1},
}


def asked(**observer):
    """Sweep with other keys of its observer, those with a list varying."""
    varied = {f"observer.{key}": value for key, value in observer.items() if isinstance(value, list)}
    given = {key: value for key, value in observer.items() if not isinstance(value, list)}
    return {**STIMULI, "observer": STIMULI["observer"] | given, "grid": STIMULI["grid"] | varied}


@pytest.fixture(scope="module")
def responses():
    """Made-up responses of 2 and of 3 receptors under three stimuli."""
    rates = np.random.default_rng(3).uniform(20.0, 60.0, (3, 2, 3))
    rates[:, 0, 2] = np.nan
    return {"static_rate_hz": rates, "dynamic_rate_hz": 1.5 * rates, "first_spike_latency_ms": rates}


def observed(responses, done=None, **observer):
    sweep = fp.SweepRequest.read(asked(**observer))
    done = np.ones(sweep.shape, dtype=bool) if done is None else done
    return observe(sweep, responses, done, lambda: None)


@pytest.mark.parametrize("code", ["gradient_sum", "euclidean"])
def test_hit_rates_are_those_of_each_observer_alone(responses, code):
    rates = responses["dynamic_rate_hz"]
    found = observed(
        responses, code=code, measure="dynamic", noise=[0.05, 0.2], **{"experiment.criterion": [0.4, 0.6]}
    )
    assert found.shape == (3, 2, 2, 2)
    for receptors, noise, criterion in np.ndindex(2, 2, 2):
        count = 2 + receptors
        table, pairs = rates[[1, 0, 2], receptors, :count], np.array([[0, 1], [1, 2]][: count - 1])
        observer = Experiment(criterion=[0.4, 0.6][criterion])
        law = Noise([0.05, 0.2][noise], fp.Afferent().noise_offset_hz)
        expected = discriminate_by(ENCODERS[code](pairs), table, law, 0, observer, session=SESSION)
        got = found[:, receptors, noise, criterion]
        assert got[[0, 2]].tolist() == expected.hit_rate.tolist()
        assert np.isnan(got[1])


def test_the_standard_varies_too_and_what_is_silent_or_missing_has_no_hit_rate(responses):
    found = observed(responses, standard=[0.3, 0.7])
    assert np.isnan(found).sum(axis=0).tolist() == [[1, 1], [1, 1]]
    assert np.isnan(found[0, :, 0]).all()
    assert np.isnan(found[2, :, 1]).all()
    done = np.ones((3, 2), dtype=bool)
    done[0, 1] = False
    silent = {name: values.copy() for name, values in responses.items()}
    silent["static_rate_hz"][2, 0, :2] = 0.0
    assert np.isnan(observed(responses, done)[:, 1]).all()
    assert not np.isnan(observed(responses, done)[[0, 2], 0]).any()
    assert np.isnan(observed(silent)[:, 0]).all()


def test_observers_of_a_run_are_in_the_data_set_and_others_are_asked_later(run, tmp_path):
    sweep = {
        "touch": {**TOUCH, "afferents": {"rows": 1, "columns": 3}},
        "observer": {"along": "motion.depth_mm", "standard": 0.3, "measure": "dynamic"},
        "grid": {"motion.depth_mm": [0.3, 0.5], "observer.noise": [0.1, 0.2]},
    }
    run(sweep)
    data = open_sweep(tmp_path / "study.zarr")
    assert data.hit_rate.dims == ("motion_depth_mm", "observer_noise")
    assert 0.5 < data.hit_rate.values[1, 1] <= data.hit_rate.values[1, 0]
    again = observe_sweep(data, sweep["observer"], {"noise": [0.2, 0.3]})
    assert again.sel(motion_depth_mm=0.5).values[0] == data.hit_rate.values[1, 1]
    assert run(sweep).loaded == 0


@pytest.mark.parametrize(
    ("sweep", "said"),
    [
        (asked(along="afferents.columns"), "along must be a field that varies and changes the skin"),
        (asked(standard=0.4), "standard must be one of the values of motion.depth_mm"),
        (asked(noise=-1.0), "noise must not be negative: got -1"),
        (asked(noise=[0.1, "much"]), "noise must be a finite number: got 'much'"),
        (asked(code="ideal"), "code must be one of gradient_sum, euclidean"),
        (asked(nose=0.1), "nose is unknown: did you mean noise"),
        (asked(along=["motion.depth_mm"]), "observer.along cannot vary"),
        ({"touch": TOUCH, "grid": {"motion.depth_mm": [0.3, 0.5], "observer.noise": [0.1]}},
         "observer must be given where its fields vary"),
        (STIMULI | {"zip": {"observer.noise": [0.1, 0.2], "stiffness": [1.0, 2.0]}},
         "observer.noise, stiffness must not vary together"),
    ],
)  # fmt: skip
def test_a_bad_observer_is_refused_before_anything_is_pressed(sweep, said, tmp_path):
    with pytest.raises(InputError, match=said):
        fp.sweep(sweep, out=tmp_path / "study.zarr")
    assert not list(tmp_path.iterdir())
