"""A response written as a table or as a session and read back is the same response."""

import csv
import sys
import warnings
from dataclasses import replace
from datetime import UTC, datetime

import numpy as np
import pytest
from numpy.testing import assert_array_equal

import fingerpad as fp
from fingerpad.core.errors import StoreError
from fingerpad.core.phases import ramp_and_hold_phases
from fingerpad.experiments.recording_files import read_recordings
from fingerpad.experiments.requests.stimuli import read_stimuli
from fingerpad.export.responses import read_response_csv, read_responses_nwb
from sections import SMALL_TOUCH as TOUCH


def random_response(columns):
    generator = np.random.default_rng(3)
    trains = [np.cumsum(generator.exponential(17.0, count)) for count in generator.integers(0, 6, size=40)]
    return fp.ResponseMap(
        positions_mm=generator.normal(size=(40, columns)),
        pitch_mm=1.0,
        spikes=fp.SpikeTrains.from_lists(trains),
        dynamic_rate_hz=generator.exponential(100.0, 40),
        static_rate_hz=generator.exponential(30.0, 40),
        first_spike_latency_ms=[train[0] if train.size else np.nan for train in trains],
        duration_ms=1000.0,
    )


@pytest.mark.parametrize(("columns", "places"), [(2, ["x_mm", "z_mm"]), (3, ["x_mm", "y_mm", "z_mm"])])
def test_every_number_comes_back_to_the_last_bit(tmp_path, columns, places):
    response = random_response(columns)
    with open(response.save(tmp_path / "deeper" / "map.csv"), encoding="utf-8") as file:
        rows = list(csv.DictReader(file))
    assert [int(row["receptor"]) for row in rows] == list(range(40))

    def column(name):
        return [float(row[name] or "nan") for row in rows]

    assert_array_equal(np.transpose([column(name) for name in places]), response.positions_mm)
    for name in ("dynamic_rate_hz", "static_rate_hz", "first_spike_latency_ms"):
        assert_array_equal(column(name), getattr(response, name))
    latency_ms = response.first_spike_latency_ms
    firing = np.sort(latency_ms[~np.isnan(latency_ms)])  # no two are equal
    ranks = [np.nan if np.isnan(each) else 1 + firing.searchsorted(each) for each in latency_ms]
    assert_array_equal(column("recruitment_rank"), ranks)
    for receptor, row in enumerate(rows):
        assert_array_equal([float(time) for time in row["spike_times_ms"].split()], response.spikes[receptor])
    assert np.isnan(column("first_spike_latency_ms")).any()


def mixed_response():
    one = replace(random_response(3), phases=ramp_and_hold_phases(50.0, 1000.0))
    later = fp.SpikeTrains.from_lists([one.spikes[39 - receptor] + 0.25 for receptor in range(40)])
    return fp.ResponseMap.joined({"RA": one, "own": replace(one, spikes=later, pitch_mm=2.5)})


def alike(read, written, within_ms):
    assert list(read.parts) == list(written.parts)
    assert read.types == ("RA",) * 40 + ("own",) * 40
    for name in written.parts:
        assert read[name].pitch_mm == written[name].pitch_mm
        assert_array_equal(read[name].positions_mm, written[name].positions_mm)
        for measure, values in written[name].measures.items():
            assert_array_equal(read[name].measures[measure], values, measure)
        assert_array_equal(read[name].spikes.offsets, written[name].spikes.offsets)
        np.testing.assert_allclose(read[name].spikes.times_ms, written[name].spikes.times_ms, 0, within_ms)


def test_mixed_responses_come_back_with_the_type_of_every_unit(tmp_path):
    written = mixed_response()
    alike(read_response_csv(written.save(tmp_path / "mixed.csv")), written, 0.0)
    touches = {"edge": written, "flat": fp.ResponseMap.joined({"RA": written["RA"], "own": written["own"]})}
    read = read_responses_nwb(fp.write_responses_nwb(tmp_path / "mixed.nwb", touches, pause_ms=250.0))
    assert list(read) == ["edge", "flat"]
    for name, response in read.items():
        alike(response, touches[name], 1e-6)
        assert response["own"].phases == written["own"].phases
        assert response["RA"].duration_ms == pytest.approx(1000.0, rel=1e-12)
    one = read_response_csv(written["RA"].save(tmp_path / "one.csv"))
    assert not one.types
    assert one.pitch_mm == 1.0


def test_a_table_that_is_no_response_is_refused(tmp_path):
    (tmp_path / "other.csv").write_text("receptor,x_mm\n0,1.0\n", encoding="utf-8")
    with pytest.raises(fp.InputError, match="must have the column z_mm"):
        read_response_csv(tmp_path / "other.csv")
    (tmp_path / "other.nwb").write_text("no session", encoding="utf-8")
    with pytest.raises(fp.InputError, match="cannot be read as NWB"):
        read_responses_nwb(tmp_path / "other.nwb")
    with pytest.raises(StoreError, match=r"other\.csv"):
        random_response(2).save(tmp_path / "other.csv" / "map.csv")


def responses_to_two_touches():
    first = random_response(3)
    later = fp.SpikeTrains.from_lists([first.spikes[39 - receptor] + 1.5 for receptor in range(40)])
    return {"edge": first, "flat": replace(first, spikes=later)}


def test_a_session_is_read_back_as_recordings_of_every_receptor(tmp_path):
    (tmp_path / "two.csv").write_text("name,object\nedge,bar\nflat,bar\n", encoding="utf-8")
    responses = responses_to_two_touches()
    path = fp.write_responses_nwb(tmp_path / "deeper" / "session.nwb", responses, pause_ms=250.0)
    assert [entry.name for entry in path.parent.iterdir()] == ["session.nwb"]
    stimuli = read_stimuli(tmp_path / "two.csv")
    receptor = next(n for n in range(40) if all(answer.spikes[n].size > 1 for answer in responses.values()))
    recorded = read_recordings(path, stimuli, unit=receptor).recordings
    assert recorded.stimuli == ("edge", "flat")
    for train, answer in zip(recorded.trains, responses.values(), strict=True):
        np.testing.assert_allclose(train, answer.spikes[receptor], rtol=0, atol=1e-9)
    np.testing.assert_allclose(recorded.duration_ms, 1000.0, rtol=1e-12)


def without_duration(touches):
    return {name: replace(touch, duration_ms=None) for name, touch in touches.items()}


@pytest.mark.parametrize(
    ("change", "options", "message"),
    [
        (lambda touches: {}, {}, "at least one touch"),
        (lambda touches: {**touches, "other": random_response(2)}, {}, "those of 'other' lie elsewhere"),
        (lambda touches: touches, {"duration_ms": 1.0}, "duration_ms must reach to the last spike and phase"),
        (without_duration, {}, "duration_ms must be given: the response to 'edge' does not know its own"),
        (lambda touches: touches, {"duration_ms": 0.0}, "duration_ms must be greater than 0"),
        (lambda touches: touches, {"pause_ms": -1.0}, "pause_ms must not be negative"),
        (lambda touches: touches, {"started": datetime(2026, 3, 1)}, "started must have a time zone"),
    ],
)
def test_a_session_that_cannot_be_is_refused(tmp_path, monkeypatch, change, options, message):
    with pytest.raises(fp.InputError, match=message):
        fp.write_responses_nwb(tmp_path / "session.nwb", change(responses_to_two_touches()), **options)
    with pytest.raises(fp.InputError, match=r"A session is written as .nwb, .h5, .hdf5: got s.csv\."):
        fp.write_responses_nwb(tmp_path / "s.csv", responses_to_two_touches())
    monkeypatch.setitem(sys.modules, "pynwb", None)
    with pytest.raises(fp.InputError, match=r"pip install 'fingerpad\[nwb\]'"):
        fp.write_responses_nwb(tmp_path / "session.nwb", responses_to_two_touches())
    assert list(tmp_path.iterdir()) == []


def test_a_session_takes_times_from_the_motions(tmp_path):
    """A sine of 300 ms, then a ramp and hold of force of 150 ms: trials and epochs follow the motions."""
    motions = {
        "sine": fp.sine(depth_mm=0.3, amplitude_mm=0.1, frequency_hz=20.0, cycles=2, hold_ms=100.0),
        "force": fp.ForceRampAndHold(force_mn=20.0, ramp_ms=50.0, hold_ms=100.0),
    }
    afferent = fp.Afferent.for_tissues("trial3")
    population = fp.Population.grid(100.0, rows=1, columns=2, afferent=afferent)
    responses = {}
    for name, motion in motions.items():
        skin = replace(TOUCH, stimulus=motion).solve()
        windows = [phase.window_ms for phase in (skin.phases[0], skin.phases[-1])]
        responses[name] = population.respond(skin, *windows)
    started = datetime(2026, 3, 1, 12, tzinfo=UTC)
    path = fp.write_responses_nwb(tmp_path / "session.nwb", responses, pause_ms=500.0, started=started)
    ends = {name: motion.end_ms for name, motion in motions.items()}
    with warnings.catch_warnings():
        warnings.simplefilter("ignore")
        from pynwb import NWBHDF5IO

        with NWBHDF5IO(str(path), mode="r") as file:
            session = file.read()
            starts, stops = (1e3 * session.trials[name][:] for name in ("start_time", "stop_time"))
            epochs_ms = 1e3 * np.transpose([session.epochs[name][:] for name in ("start_time", "stop_time")])
            tags = [list(each) for each in session.epochs["tags"][:]]
            spikes = 1e3 * session.units["spike_times"][0]
            places = np.transpose([session.units[name][:] for name in ("x_mm", "z_mm")])
            began = session.session_start_time
    onsets = dict(zip(motions, starts, strict=True))
    assert_array_equal(places, population.positions_mm)
    assert began == started
    np.testing.assert_allclose(starts, [0.0, ends["sine"] + 500.0])
    np.testing.assert_allclose(stops - starts, list(ends.values()))
    phases = [(name, phase) for name, motion in motions.items() for phase in motion.phases]
    assert tags == [[phase.name, name] for name, phase in phases]
    expected = [[onsets[name] + phase.start_ms, onsets[name] + phase.end_ms] for name, phase in phases]
    np.testing.assert_allclose(epochs_ms, expected)
    both = [onsets[name] + response.spikes[0] for name, response in responses.items()]
    assert all(train.size for train in both)
    np.testing.assert_allclose(spikes, np.concatenate(both))
