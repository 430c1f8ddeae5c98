"""Files of stimuli and recordings: their meaning, and errors of invalid ones."""

import warnings
from datetime import UTC, datetime

import numpy as np
import pytest

from fingerpad.core.errors import InputError
from fingerpad.experiments.recording_files import read_recordings
from fingerpad.experiments.stimuli import ListedStimuli, ShiftedBar, TactileStimulus, read_stimuli
from fingerpad.geometry.indenters import Bar, FlatPunch, Sphere
from fingerpad.geometry.motion import ForceRampAndHold, RampAndHold
from fingerpad.inference.recordings import RateRecordings, SpikeRecordings

TWO = ListedStimuli({"edge": TactileStimulus(Bar()), "flat": TactileStimulus(Bar(), x_mm=1.0)}, "two.csv")


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
    assert isinstance(recorded.recordings, RateRecordings)
    assert recorded.recordings.stimuli == ("edge", "flat")
    assert recorded.recordings.static_rate_hz.tolist() == [61.0, 10.0]
    assert recorded.recordings.dynamic_rate_hz is None
    assert recorded.memberships.tolist() == [0, 1]
    assert recorded.presentations == {"edge": 2, "flat": 1}
    assert recorded.stimuli == TWO.stimuli


def test_shifts_that_are_equal_are_one_stimulus_however_they_are_written(written):
    path = written("rates.csv", "shift_mm,dynamic_rate_hz\n-0,1\n0.0,3\n1e-1,5\n")
    recorded = read_recordings(path, ShiftedBar(Bar(2.0), RampAndHold(0.5)))
    assert recorded.recordings.stimuli == ("0", "0.1")
    assert recorded.recordings.dynamic_rate_hz.tolist() == [2.0, 5.0]
    assert recorded.stimuli["0.1"] == TactileStimulus(Bar(2.0), RampAndHold(0.5), x_mm=-0.1)


def test_spikes_end_with_the_motion_or_with_their_recording(written):
    path = written(
        "spikes.csv", "stimulus,spike_times_ms,duration_ms\nedge,1.5 40 1001,\nflat,,900\nedge,3,900\n"
    )
    recorded = read_recordings(path, TWO)
    assert isinstance(recorded.recordings, SpikeRecordings)
    assert [train.tolist() for train in recorded.recordings.trains] == [[1.5, 40.0], [], [3.0]]
    assert recorded.recordings.duration_ms.tolist() == [1000.0, 900.0, 900.0]
    assert recorded.spikes_after_hold == 1


RATE_ROWS = "stimulus,static_rate_hz,fold\nedge,60,1\n"


@pytest.mark.parametrize(
    ("content", "said"),
    [
        ("", "mine.csv must hold a header and at least one row: it has 0 of them."),
        ("# nothing\n\n", "it has 0 of them."),
        ("stimulus,static_rate_hz\n", "it has 1 of them."),
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
        ("stimulus,static_rate_hz\nedge,1\nflat,\n", "mine.csv, line 3: static_rate_hz must be given"),
        ("stimulus,static_rate_hz\nedge,-3\n", "mine.csv, line 2: static_rate_hz must not be negative"),
        ("stimulus,static_rate_hz\nedge,nan\n", "mine.csv, line 2: static_rate_hz must be a finite number"),
        ("stimulus,static_rate_hz\n#\nedge,many\n", "mine.csv, line 3: static_rate_hz must be a finite"),
        (
            "stimulus,static_rate_hz\nside,3\n",
            "mine.csv, line 2: stimulus must be one of two.csv, edge, flat",
        ),
        (RATE_ROWS + "flat,60,1.5\n", "mine.csv, line 3: fold must be a whole number from 1: got '1.5'"),
        (RATE_ROWS + "flat,60,0\n", "mine.csv, line 3: fold must be a whole number from 1: got '0'"),
        (RATE_ROWS + "flat,60,\n", "mine.csv, line 3: fold must be given"),
        (RATE_ROWS + "flat,60,3\n", "fold must number at least two folds from 1 without a gap: no row is in"),
        (RATE_ROWS + "flat,60,1\n", "no row is in fold 2"),
        (
            RATE_ROWS + "flat,1,2\nedge,61,2\n",
            "mine.csv, line 4: fold must be the same for all presentations of edge, which would be fitted "
            "and judged at once: got 2, and 1 in mine.csv, line 2.",
        ),
        ("stimulus,spike_times_ms\nedge,5 4\n", "line 2: spike_times_ms must increase: 4 ms follows 5 ms"),
        ("stimulus,spike_times_ms\nedge,-1 4\n", "line 2: spike_times_ms must not be negative"),
        ("stimulus,spike_times_ms\nedge,1;4\n", "line 2: spike_times_ms must be a finite number"),
        ("stimulus,spike_times_ms,duration_ms\nedge,1 4,3\n", "line 2: spike_times_ms must end with"),
        ("stimulus,spike_times_ms,duration_ms\nedge,1,0\n", "line 2: duration_ms must be greater than 0"),
    ],
    ids=lambda value: str(value)[-40:],
)
def test_recordings_that_cannot_be_are_named_by_line_and_column(written, content, said):
    path = written("mine.csv", content)
    with pytest.raises(InputError) as refused:
        read_recordings(path, TWO)
    assert said in str(refused.value)
    assert str(refused.value)[-1] in ".?"


def test_a_shift_must_be_a_number(written):
    path = written("mine.csv", "shift_mm,static_rate_hz\nleft,1\n")
    with pytest.raises(InputError, match=r"mine.csv, line 2: shift_mm must be a finite number \[mm\]"):
        read_recordings(path, ShiftedBar())


def test_a_file_that_is_not_there_is_named(tmp_path):
    with pytest.raises(InputError, match=r"none\.csv must be a file that can be read: No such file"):
        read_recordings(tmp_path / "none.csv", TWO)
    with pytest.raises(InputError, match=r"none\.nwb must be a file that can be read"):
        read_recordings(tmp_path / "none.nwb", TWO)


CSV = """stimulus,indenter,curvature_per_m,diameter_mm,depth_mm,force_mn,hold_ms,x_mm,z_mm,tilt_deg
ball,sphere,340,,0.5,,,-0.5,1,0
probe,punch,,1,,200,500,,,
bar,bar,,,,,,,,
"""
YAML = """
- {stimulus: ball, indenter: sphere, curvature_per_m: 340, depth_mm: 0.5, x_mm: -0.5, z_mm: 1, tilt_deg: 0}
- {stimulus: probe, indenter: punch, diameter_mm: 1.0, force_mn: 200, hold_ms: 500}
- stimulus: bar
  indenter: bar
"""


@pytest.mark.parametrize(("name", "content"), [("mine.csv", CSV), ("mine.yaml", YAML), ("mine.yml", YAML)])
def test_stimuli_are_the_same_from_csv_and_yaml(written, name, content):
    listed = read_stimuli(written(name, content))
    assert listed.stimuli == {
        "ball": TactileStimulus(Sphere(340.0), RampAndHold(depth_mm=0.5), -0.5, 1.0, 0.0),
        "probe": TactileStimulus(FlatPunch(1.0), ForceRampAndHold(200.0, hold_ms=500.0)),
        "bar": TactileStimulus(Bar()),
    }
    assert list(listed.stimuli) == ["ball", "probe", "bar"]


@pytest.mark.parametrize(
    ("name", "content", "said"),
    [
        ("a.csv", "stimulus,indenter\ntip,cone\n", "a.csv, line 2: indenter must be one of sphere, cylinder"),
        ("a.csv", "stimulus,indenter\ntip,\n", "a.csv, line 2: indenter must be given"),
        ("a.csv", "stimulus\ntip\n", "a.csv, line 2: indenter must be given"),
        ("a.csv", "stimulus,indenter\ntip,bar\ntip,bar\n", "a.csv, line 3: stimulus 'tip' is repeated"),
        ("a.csv", "stimulus,indenter,radius\ntip,bar,1\n", "a.csv, line 1: column 'radius' is unknown"),
        ("a.csv", "stimulus,indenter,width_mm\ntip,sphere,1\n", "line 2: a sphere has no width_mm"),
        ("a.csv", "stimulus,indenter,width_mm\ntip,bar,0\n", "line 2: width_mm must be greater than 0 [mm]"),
        ("a.csv", "stimulus,indenter,width_mm,fillet_mm\ntip,bar,1,1\n", "line 2: fillet_mm must not exceed"),
        ("a.csv", "stimulus,indenter\ntip,plate:3\n", "line 2: indenter must be written plate, sizes from"),
        ("a.csv", "stimulus,indenter,width_mm\ntip,bar:2,1\n", "line 2: sizes must stand in indenter or in"),
        ("a.csv", "stimulus,indenter,depth_mm\ntip,bar,deep\n", "line 2: depth_mm must be a finite number"),
        ("a.csv", "stimulus,indenter,depth_mm,force_mn\ntip,bar,1,1\n", "exclude each other"),
        ("a.yaml", "", "a.yaml must be a list of stimuli, each a mapping: got NoneType."),
        ("a.yaml", "stimulus: tip\n", "a.yaml must be a list of stimuli, each a mapping: got dict."),
        ("a.yaml", "- tip\n", "a.yaml, entry 1: must be a mapping"),
        ("a.yaml", "- {stimulus: tip, indentor: bar}\n", "a.yaml, entry 1: 'indentor' is unknown"),
        ("a.yaml", "- {stimulus: tip, indenter: bar, indenter: sphere}\n", "line 1: indenter is repeated"),
        ("a.yaml", "- {stimulus: tip\n", "a.yaml cannot be read as YAML"),
        ("a.yaml", "- {stimulus: tip, indenter: bar, depth_mm: yes}\n", "entry 1: depth_mm must be a finite"),
        ("a.yaml", "- {stimulus: tip, indenter: bar, x_mm: .nan}\n", "entry 1: x_mm must be a finite"),
        ("a.yaml", b"- {stimulus: \xff}\n", "a.yaml must be text in UTF-8: byte 14 is not"),
    ],
    ids=lambda value: str(value)[-40:],
)
def test_stimuli_that_cannot_be_are_named_by_line_and_column(written, name, content, said):
    path = written(name, content)
    with pytest.raises(InputError) as refused:
        read_stimuli(path)
    assert said in str(refused.value)
    assert str(refused.value).count("\n") == 0


@pytest.fixture(scope="module")
def nwb(tmp_path_factory):
    """Write an NWB file with these trials and units."""
    folder = tmp_path_factory.mktemp("nwb")

    def write(name, trials, units, columns=("stimulus",)):
        with warnings.catch_warnings():
            warnings.simplefilter("ignore")  # what the library says of itself
            from pynwb import NWBHDF5IO, NWBFile

            file = NWBFile("a test", name, datetime(2026, 1, 1, tzinfo=UTC))
            for column in columns:
                file.add_trial_column(column, f"the {column}")
            for start, stop, *values in trials:
                file.add_trial(start_time=start, stop_time=stop, **dict(zip(columns, values, strict=True)))
            for number, spikes in units.items():
                file.add_unit(id=number, spike_times=spikes)
            path = folder / f"{name}.nwb"
            with NWBHDF5IO(str(path), mode="w") as opened:
                opened.write(file)
        return path

    return write


def test_nwb_units_become_trains_that_count_from_the_onset_of_their_trial(nwb):
    path = nwb(
        "good",
        [(10.0, 11.5, "flat", 2), (20.0, 20.9, "edge", 1)],
        {3: [1.0, 10.04, 10.25, 11.4, 20.5, 21.0], 4: [10.1]},
        ("stimulus", "fold"),
    )
    recorded = read_recordings(path, TWO, unit=3)
    trains = recorded.recordings.trains
    np.testing.assert_allclose(trains[0], [40.0, 250.0], rtol=0, atol=1e-9)
    np.testing.assert_allclose(trains[1], [500.0], rtol=0, atol=1e-9)
    assert recorded.recordings.stimuli == ("flat", "edge")
    np.testing.assert_allclose(recorded.recordings.duration_ms, [1000.0, 900.0], rtol=0, atol=1e-9)
    assert recorded.memberships.tolist() == [1, 0]
    assert recorded.spikes_after_hold == 1


def test_nwb_files_that_cannot_be_are_named(nwb, tmp_path):
    trials, two = [(0.0, 1.0, "edge")], {3: [0.1], 4: [0.2]}
    cases = [
        (nwb("several", trials, two), None, "has the units 3, 4: choose one by --unit"),
        (nwb("other", trials, two), 7, "unit must be one of 3, 4: got 7"),
        (nwb("silent", trials, {}), None, "must have a table of units with spike_times"),
        (nwb("untried", [], two, ()), None, "must have a table of trials"),
        (nwb("column", trials, two, ("object",)), 3, "trials must have the column stimulus: got start_time"),
        (
            nwb("unknown", [(0.0, 1.0, "side")], two),
            3,
            "trial 0: stimulus must be one of two.csv, edge, flat",
        ),
        (nwb("unsorted", trials, {3: [0.3, 0.2]}), 3, "spike_times of unit 3 must be finite and increase"),
        (nwb("endless", [(0.0, np.nan, "edge")], two), 3, "trial 0: duration_ms must be a finite number"),
    ]
    damaged = tmp_path / "damaged.nwb"
    damaged.write_bytes(b"not HDF5 at all")
    cases.append((damaged, None, "damaged.nwb cannot be read as NWB"))
    for path, unit, said in cases:
        with pytest.raises(InputError) as refused:
            read_recordings(path, TWO, unit)
        assert said in str(refused.value)
        assert str(refused.value).startswith(str(path))


def test_a_unit_belongs_to_nwb(written):
    path = written("mine.csv", "stimulus,static_rate_hz\nedge,1\n")
    with pytest.raises(InputError, match="unit belongs to NWB files"):
        read_recordings(path, TWO, unit=1)
