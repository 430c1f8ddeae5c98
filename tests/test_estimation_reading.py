"""Files of stimuli and recordings: their meaning, and errors of invalid ones."""

import csv
import json
import warnings
from datetime import UTC, datetime

import numpy as np
import pytest
from hypothesis import HealthCheck, given, settings
from hypothesis import strategies as st

import fingerpad as fp
from fingerpad.experiments.recording_files import read_recordings
from fingerpad.experiments.requests.stimuli import ListedStimuli, NamedStimulus, ShiftedBar, read_stimuli
from fingerpad.inference.recordings import SpikeRecordings
from tests.mutations import CHANGES, VALUES, changed, places

TWO = ListedStimuli(
    {"edge": NamedStimulus(fp.Bar(), name="edge"), "flat": NamedStimulus(fp.Bar(), x_mm=1.0, name="flat")},
    "two.csv",
)


@pytest.fixture
def written(tmp_path, monkeypatch):
    """Write a file into an empty folder and tell its name."""
    monkeypatch.chdir(tmp_path)

    def write(name, content):
        path = tmp_path / name
        path.write_bytes(content if isinstance(content, bytes) else content.encode())
        return path.relative_to(tmp_path)

    return write


def test_rates_are_means_over_presentations_wherever_their_columns_stand(written):
    path = written(
        "rates.csv",
        '\ufeff# a comment, with a "\n\nfold, static_rate_hz,stimulus\n1,60,edge\n'
        "2,10,flat\n# more\n1,62,edge\n",
    )
    recorded = read_recordings(path, TWO)
    assert isinstance(recorded.recordings, fp.RateRecordings)
    assert recorded.recordings.stimuli == ("edge", "flat")
    assert recorded.recordings.static_rate_hz.tolist() == [61.0, 10.0]
    assert recorded.recordings.dynamic_rate_hz is None
    assert recorded.memberships.tolist() == [0, 1]
    assert recorded.presentations == {"edge": 2, "flat": 1}
    assert recorded.stimuli == TWO.stimuli


def test_shifts_that_are_equal_are_one_stimulus_however_they_are_written(written):
    path = written("rates.csv", "shift_mm,dynamic_rate_hz\n-0,1\n0.0,3\n1e-1,5\n")
    bar = ShiftedBar(fp.Bar(2.0), fp.RampAndHold(0.5))
    recorded = read_recordings(path, bar)
    assert recorded.recordings.stimuli == ("0", "0.1")
    assert recorded.recordings.dynamic_rate_hz.tolist() == [2.0, 5.0]
    assert recorded.stimuli["0.1"] == NamedStimulus(
        fp.Bar(2.0), fp.RampAndHold(0.5), x_mm=-0.1 * bar.conditions.along_skin, name="0.1"
    )


def test_spikes_end_with_the_motion_or_with_their_recording(written):
    rows = "stimulus,spike_times_ms,duration_ms\nedge,1.5 40 1001,\nflat,,900\nedge,3,900\n"
    recorded = read_recordings(written("spikes.csv", rows), TWO)
    assert isinstance(recorded.recordings, SpikeRecordings)
    assert [train.tolist() for train in recorded.recordings.trains] == [[1.5, 40.0], [], [3.0]]
    assert recorded.recordings.duration_ms.tolist() == [1000.0, 900.0, 900.0]
    assert recorded.spikes_after_hold == 1


RATE_ROWS = "stimulus,static_rate_hz,fold\nedge,60,1\n"


@pytest.mark.parametrize(
    ("content", "said"),
    [
        ("", "mine.csv must hold a header and at least one row: it has 0 of them."),
        (b"stimulus,static_rate_hz\ncaf\xe9,1\n", "mine.csv must be text in UTF-8: byte 28 is not"),
        ('stimulus,static_rate_hz\n"edge,1\n', "mine.csv, line 2: cannot be read as CSV"),
        ("static_rate_hz\n1\n", "mine.csv must have the column stimulus: it has static_rate_hz."),
        ("stimulus\nedge\n", "mine.csv must have dynamic_rate_hz, static_rate_hz or spike_times_ms"),
        ("stimulus,spike_times_ms,static_rate_hz\nedge,1,1\n", "not both: leave static_rate_hz out"),
        ("stimulus,static_rate_hz,duration_ms\nedge,1,1\n", "duration_ms, which belongs to spike_times_ms"),
        ("stimulus,static_rate\nedge,1\n", "mine.csv, line 1: column 'static_rate' is unknown"),
        ("fold,stimulus,fold\n1,edge,1\n", "mine.csv, line 1: column fold is repeated"),
        ("stimulus,static_rate_hz\nedge,1\nflat\n", "mine.csv, line 3: must have 2 entries"),
        ("stimulus,static_rate_hz\nedge,1\n,2\n", "mine.csv, line 3: stimulus must be given"),
        ("stimulus,static_rate_hz\nedge,-3\n", "mine.csv, line 2: static_rate_hz must not be negative"),
        ("stimulus,static_rate_hz\n#\nedge,many\n", "mine.csv, line 3: static_rate_hz must be a finite"),
        ("stimulus,static_rate_hz\nside,3\n", "mine.csv, line 2: stimulus must be one of two.csv, edge"),
        (RATE_ROWS + "flat,60,1.5\n", "mine.csv, line 3: fold must be a whole number from 1: got '1.5'"),
        (RATE_ROWS + "flat,60,\n", "mine.csv, line 3: fold must be given"),
        (RATE_ROWS + "flat,60,3\n", "fold must number at least two folds from 1 without a gap: no row is in"),
        (RATE_ROWS + "flat,1,2\nedge,61,2\n", "mine.csv, line 4: fold must be the same for all"),
        ("stimulus,spike_times_ms\nedge,5 4\n", "line 2: spike_times_ms must increase: 4 ms follows 5 ms"),
        ("stimulus,spike_times_ms\nedge,-1 4\n", "line 2: spike_times_ms must not be negative"),
        ("stimulus,spike_times_ms\nedge,1;4\n", "line 2: spike_times_ms must be a finite number"),
        ("stimulus,spike_times_ms,duration_ms\nedge,1 4,3\n", "line 2: spike_times_ms must end with"),
    ],
    ids=lambda value: str(value)[-40:],
)
def test_recordings_that_cannot_be_are_named_by_line_and_column(written, content, said):
    path = written("mine.csv", content)
    with pytest.raises(fp.InputError) as refused:
        read_recordings(path, TWO)
    assert said in str(refused.value)
    assert str(refused.value)[-1] in ".?"


def test_a_file_that_is_not_there_or_has_no_shift_or_unit_is_named(written, tmp_path):
    with pytest.raises(fp.InputError, match=r"mine.csv, line 2: shift_mm must be a finite number \[mm\]"):
        read_recordings(written("mine.csv", "shift_mm,static_rate_hz\nleft,1\n"), ShiftedBar())
    with pytest.raises(fp.InputError, match="unit belongs to NWB files"):
        read_recordings(written("mine.csv", "stimulus,static_rate_hz\nedge,1\n"), TWO, unit=1)
    with pytest.raises(fp.InputError, match=r"none\.csv must be a file that can be read: No such file"):
        read_recordings(tmp_path / "none.csv", TWO)
    with pytest.raises(fp.InputError, match=r"none\.nwb must be a file that can be read"):
        read_recordings(tmp_path / "none.nwb", TWO)


CSV = """# mine
name,object,object.curvature_per_m,object.diameter_mm,motion.depth_mm,motion.force_mn,motion.hold_ms,\
place.x_mm,place.z_mm,place.tilt_deg,friction,motion.kind,motion.file
ball,sphere,340,,0.5,,,-0.5,1,0,,,
probe,punch,,1.0,,200,500,,,,0.2,,
bar,bar,,,,,,,,,,,
moved,bar,,,,,,,,,,recorded,course.csv
""".replace("\\\n", "")
YAML = """
object: bar
stimuli:
  - {name: ball, object: {kind: sphere, curvature_per_m: 340}, motion: {depth_mm: 0.5},
     place: {x_mm: -0.5, z_mm: 1, tilt_deg: 0}}
  - {name: probe, object: "punch:1.0", motion: {force_mn: 200, hold_ms: 500}, friction: 0.2}
  - name: bar
  - {name: moved, motion: {kind: recorded, file: course.csv}}
"""


@pytest.mark.parametrize(("name", "content"), [("mine.csv", CSV), ("mine.yaml", YAML), ("mine.yml", YAML)])
def test_stimuli_are_the_same_from_csv_and_yaml(written, name, content):
    written("course.csv", "time_ms,depth_mm\n0,0\n50,0.4\n900,0.4\n")
    listed = read_stimuli(written(name, content))
    *others, moved = listed.stimuli.values()
    assert others == [
        NamedStimulus(fp.Sphere(curvature_per_m=340.0), fp.RampAndHold(0.5), -0.5, 1.0, 0.0, name="ball"),
        NamedStimulus(
            fp.FlatPunch(1.0), fp.ForceRampAndHold(200.0, hold_ms=500.0), friction=0.2, name="probe"
        ),
        NamedStimulus(fp.Bar(), name="bar"),
    ]
    assert (moved.motion.depth_mm, moved.files[0].name) == ((0.0, 0.4, 0.4), "course.csv")
    assert list(listed.stimuli) == ["ball", "probe", "bar", "moved"]


def test_stimuli_name_finger_tissues_and_resolution_and_options_replace_them(written):
    path = written(
        "mine.yaml",
        "finger: child\ntissues: trial3\nresolution: quick\nreach_mm: 2.0\nmotion: {depth_mm: 0.5}\n"
        "stimuli: {vary: object.text, values: [a, b]}\nobject: {kind: braille}\n",
    )
    listed = read_stimuli(path, tissues="paper", finger=None)
    asked = listed.conditions
    assert (asked.resolution, asked.tissues, asked.finger) == ("quick", "paper", fp.Fingertip.of("child"))
    touches = listed.touches(list(listed.stimuli.values()), asked)
    assert list(touches) == ["a", "b"]
    assert len({touch.grading for touch in touches.values()}) == 1
    assert touches["a"].grading.half_length_mm == 2.0
    assert touches["a"].at_mm == asked.finger.contact_mm


@pytest.mark.parametrize(
    ("name", "content", "said"),
    [
        ("a.csv", "name,object\ntip,wedge\n", "a.csv, line 2, object.indenter must be one of sphere"),
        ("a.csv", "name,object\ntip,\n", "a.csv, line 2, object must be given"),
        ("a.csv", "name,object\ntip,bar\ntip,bar\n", "a.csv, line 3, stimuli must differ: 'tip' is repeated"),
        ("a.csv", "name,object,radius_mm\ntip,bar,1\n", "line 1: column 'radius_mm' is unknown: did you"),
        ("a.csv", "name,object,object.width_mm\ntip,sphere,1\n", "line 2, object.width_mm is unknown"),
        ("a.csv", "name,object,object.width_mm\ntip,bar,0\n", "line 2, object.width_mm must lie within"),
        ("a.csv", "name,object,object.fillet_mm\ntip,bar,9\n", "line 2, object.fillet_mm must not exceed"),
        ("a.csv", "name,object,object.width_mm\ntip,bar:2,1\n", "line 2: object.sizes must stand in"),
        ("a.csv", "name,object,motion.depth_mm\ntip,bar,[\n", "line 2, motion.depth_mm cannot be read as"),
        ("a.csv", "name,object,motion.depth_mm,motion.force_mn\ntip,bar,1,1\n", "exclude each other"),
        ("a.csv", "name,object,motion.kind,motion.file\ntip,bar,recorded,no.csv\n",
         "line 2, motion: no.csv must"),
        ("a.yaml", "", "a.yaml, the file must be a mapping of keys to values: it is empty"),
        ("a.yaml", "- {name: tip}\n", "a.yaml, the file must be a mapping of keys to values: got "),
        ("a.yaml", "stimuli:\n- tip\n", "a.yaml, line 2, stimuli[1] must be a mapping"),
        ("a.yaml", "stimuli: []\n", "a.yaml, line 1, stimuli must have at least one entry"),
        ("a.yaml", "object: bar\nstimuli:\n- {nane: tip}\n", "line 3, stimuli[1].nane is unknown: did you"),
        ("a.yaml", "stimuli: {name: tip, name: bar}\n", "line 1: name is repeated"),
        ("a.yaml", "object: bar\nstimuli:\n- {name: tip, motion: {depth_mm: yes}}\n",
         "line 3, stimuli[1].motion.depth_mm must be a finite"),
        ("a.yaml", "object: bar\nstimuli:\n- {name: tip}\nplace: {x_mm: .nan}\n",
         "line 4, place.x_mm must be a finite"),
        ("a.yaml", b"stimuli: \xff\n", "a.yaml must be text in UTF-8: byte 10 is not"),
    ],
    ids=lambda value: str(value)[-40:],
)  # fmt: skip
def test_stimuli_that_cannot_be_are_named_by_line_and_column(written, name, content, said):
    path = written(name, content)
    with pytest.raises(fp.InputError) as refused:
        read_stimuli(path)
    assert said in str(refused.value)
    assert str(refused.value).count("\n") == 0


LIST = {
    "finger": {"like": "adult", "width_mm": 15.0},
    "tissues": "human",
    "resolution": "quick",
    "reach_mm": 3.0,
    "object": {"kind": "bar", "width_mm": 3.0},
    "motion": {"depth_mm": 0.5},
    "place": {"x_mm": 0.5},
    "friction": 0.2,
    "stimuli": [
        {"name": "edge", "place": {"x_mm": 1.5, "spin_deg": 20.0}},
        {"name": "ball", "object": {"kind": "sphere", "radius_mm": 3.0}, "friction": 0.0},
        {"name": "slid", "motion": {"kind": "stroke", "depth_mm": 0.3, "speed_mm_per_s": 20.0, "x_mm": 1.0}},
    ],
}
TABLE = [
    ["name", "object", "object.width_mm", "motion.depth_mm", "motion.force_mn", "place.x_mm", "friction"],
    ["edge", "bar", "3", "0.5", "", "1.5", ""],
    ["ball", "sphere", "", "", "80", "", "0.3"],
    ["letter", "{kind: braille, text: l}", "", "0.4", "", "", ""],
]


ODD = st.sampled_from(["[", "{a: 1}", "bar:3", "~", "''"])
ENTRIES = st.one_of(st.text(max_size=8), st.floats().map(str), ODD)


def possible(path):
    """What is said of a file of stimuli, and of their touches."""
    try:
        listed = read_stimuli(path)
        listed.touches(list(listed.stimuli.values()), listed.conditions)
    except fp.InputError as error:
        said = str(error)
    else:
        said = f"{path}, possible."
    assert "\n" not in said
    assert said[-1] in ".?"
    return said


@pytest.mark.filterwarnings("ignore::fingerpad.core.errors.InertiaWarning")
@settings(max_examples=50, deadline=None, suppress_health_check=list(HealthCheck))
@given(st.sampled_from([place for place in places(LIST) if place]), VALUES, CHANGES)
def test_any_change_of_listed_stimuli_is_possible_or_refused_in_one_sentence(
    tmp_path_factory, place, value, change
):
    path = tmp_path_factory.getbasetemp() / "list.yaml"
    path.write_text(json.dumps(changed(LIST, place, value, change)), encoding="utf-8")
    assert possible(path).startswith((str(path), "reach_mm"))


@pytest.mark.filterwarnings("ignore::fingerpad.core.errors.InertiaWarning")
@settings(max_examples=40, deadline=None, suppress_health_check=list(HealthCheck))
@given(st.integers(0, 3), st.integers(0, 6), ENTRIES)
def test_any_change_of_a_table_of_stimuli_is_possible_or_refused_in_one_sentence(
    tmp_path_factory, row, column, entry
):
    path = tmp_path_factory.getbasetemp() / "list.csv"
    rows = [list(line) for line in TABLE]
    rows[row][column] = entry
    with path.open("w", newline="", encoding="utf-8", errors="surrogatepass") as file:
        csv.writer(file).writerows(rows)
    assert possible(path).startswith(str(path))


@pytest.fixture(scope="module")
def nwb(tmp_path_factory):
    """Write an NWB file with these trials and units."""
    folder = tmp_path_factory.mktemp("nwb")

    def write(name, trials, units, columns=("stimulus",), options=None, invalid=()):
        with warnings.catch_warnings():
            warnings.simplefilter("ignore")  # what the library says of itself
            from pynwb import NWBHDF5IO, NWBFile

            file = NWBFile("a test", name, datetime(2026, 1, 1, tzinfo=UTC))
            for column in columns:
                file.add_trial_column(column, f"the {column}")
            for start, stop, *values in trials:
                file.add_trial(start_time=start, stop_time=stop, **dict(zip(columns, values, strict=True)))
            for number, spikes in units.items():
                file.add_unit(id=number, spike_times=spikes, **(options or {}).get(number, {}))
            for start, stop in invalid:
                file.add_invalid_time_interval(start_time=start, stop_time=stop)
            path = folder / f"{name}.nwb"
            with NWBHDF5IO(str(path), mode="w") as opened:
                opened.write(file)
        return path

    return write


def test_nwb_units_become_trains_that_count_from_the_onset_of_their_trial(nwb):
    trials = [(10.0, 11.5, "flat", 2), (20.0, 20.9, "edge", 1)]
    units = {3: [1.0, 10.04, 10.25, 11.4, 20.5, 21.0], 4: [10.1]}
    path = nwb("good", trials, units, ("stimulus", "fold"))
    recorded = read_recordings(path, TWO, unit=3)
    trains = recorded.recordings.trains
    np.testing.assert_allclose(trains[0], [40.0, 250.0], rtol=0, atol=1e-9)
    np.testing.assert_allclose(trains[1], [500.0], rtol=0, atol=1e-9)
    assert recorded.recordings.stimuli == ("flat", "edge")
    np.testing.assert_allclose(recorded.recordings.duration_ms, [1000.0, 900.0], rtol=0, atol=1e-9)
    assert recorded.memberships.tolist() == [1, 0]
    assert recorded.spikes_after_hold == 1


def test_trials_without_observation_are_left_out_and_not_silent(nwb, caplog):
    """One before, one that observation ends in, one after; one in a time that is not valid."""
    trials = [(start, start + 0.9, "edge") for start in (1.0, 10.0, 20.0, 30.0, 40.0)]
    seen = {"obs_intervals": [[25.0, 60.0], [9.0, 15.0], [15.0, 20.4]]}
    path = nwb("seen", trials, {3: [10.1, 20.2, 30.3]}, options={3: seen}, invalid=[(30.5, 30.6)])
    recorded = read_recordings(path, TWO)
    assert [train.round(6).tolist() for train in recorded.recordings.trains] == [[100.0], [200.0], []]
    np.testing.assert_allclose(recorded.recordings.duration_ms, [900.0, 400.0, 900.0], rtol=0, atol=1e-6)
    assert "2 of 5 trials are left out" in caplog.text


@pytest.mark.parametrize("first", [0.0, 10.0])
def test_spikes_that_count_from_their_trial_are_refused_unless_observation_says_they_do_not(nwb, first):
    trials = [(first + 10.0 * number, first + 10.0 * number + 0.9, "edge") for number in range(3)]
    spikes = {3: [0.04, 0.25, 0.5]}
    with pytest.raises(fp.InputError, match="as if they counted from that of their trial; add start_time"):
        read_recordings(nwb(f"relative-{first:g}", trials, spikes), TWO)
    seen = {3: {"obs_intervals": [[0.0, 60.0]]}}
    trains = read_recordings(nwb(f"seen-{first:g}", trials, spikes, options=seen), TWO).recordings.trains
    assert [len(train) for train in trains] == [0 if first else 3, 0, 0]


def test_nwb_files_that_cannot_be_are_named(nwb, tmp_path):
    trials, two, late = [(0.0, 1.0, "edge")], {3: [0.1], 4: [0.2]}, {3: {"obs_intervals": [[5.0, 6.0]]}}
    cases = [
        (nwb("several", trials, two), None, "has the units 3, 4: choose one by --unit"),
        (nwb("other", trials, two), 7, "unit must be one of 3, 4: got 7"),
        (nwb("silent", trials, {}), None, "must have a table of units with spike_times"),
        (nwb("untried", [], two, ()), None, "must have a table of trials"),
        (nwb("column", trials, two, ("object",)), 3, "trials must have the column stimulus: got start_time"),
        (nwb("unknown", [(0.0, 1.0, "side")], two), 3, "trial 0: stimulus must be one of two.csv"),
        (nwb("unsorted", trials, {3: [0.3, 0.2]}), 3, "spike_times of unit 3 must be finite and increase"),
        (nwb("unseen", trials, {3: [0.1]}, options=late), 3, "while the unit is observed: none does"),
        (nwb("endless", [(0.0, np.nan, "edge")], two), 3, "trial 0: duration_ms must be a finite number"),
    ]
    damaged = tmp_path / "damaged.nwb"
    damaged.write_bytes(b"not HDF5 at all")
    cases.append((damaged, None, "damaged.nwb cannot be read as NWB"))
    for path, unit, said in cases:
        with pytest.raises(fp.InputError) as refused:
            read_recordings(path, TWO, unit)
        assert said in str(refused.value)
        assert str(refused.value).startswith(str(path))
