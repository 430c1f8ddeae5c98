"""Scans: where afferents lie on the object, tactile images, and one scan that is pressed."""

import json
from dataclasses import replace

import numpy as np
import pytest

import fingerpad as fp
from fingerpad.core.errors import InputError
from fingerpad.experiments.scan import ScanRequest, ScanResult, TactileImage

PLACES = np.array([[17.0, -1.0], [17.0, 0.0], [18.5, 2.0]])
BALL = {"object": "sphere:radius_mm=3", "place": {"x_mm": -1.0}, "x_mm": 2.0, "force_mn": 60.0}


def answered(trains, lines=1, **more):
    """Return a scan that was not pressed, in which three afferents fire as given in every line."""
    asked = ScanRequest.read(BALL | {"lines": lines, "afferents": fp.Population(PLACES, 1.0)} | more)
    nothing = np.zeros(len(PLACES))
    response = fp.ResponseMap(PLACES, 1.0, fp.SpikeTrains.from_lists(trains), nothing, nothing, nothing)
    return ScanResult(asked, (), (response,) * lines, None)


def test_a_place_on_the_object_is_that_of_the_moved_indenter():
    found = answered([[], [], []], place={"x_mm": -1.0, "spin_deg": 30.0, "tilt_deg": 3.0}, z_mm=1.0)
    touch, skin = found.request.touches[0], fp.Fingertip().skin_point(*PLACES.T)
    for time_ms in (200.0, 230.0, 300.0):
        there = touch.placement.moved(touch.stimulus.pose_at(time_ms)).to_local(skin, 0.0)
        places = found.on_object(PLACES, np.full(3, time_ms), 0)
        np.testing.assert_allclose(places, there[:, [0, 2]], atol=1e-12)


def test_lines_lie_beside_each_other_on_the_object():
    found = answered([[250.0], [], [260.0]], lines=3, line_mm=0.4)
    frame = found.to_frame()
    assert frame.line.tolist() == [0, 0, 1, 1, 2, 2]
    first = frame[frame.afferent == 0]
    np.testing.assert_allclose(np.diff(first.across_mm), -0.4)
    np.testing.assert_allclose(np.diff(first.along_mm), 0.0, atol=1e-12)
    # It has moved by 1 of 2 mm from -1 mm: its axis, which tilts a little, is in the middle of the pad.
    np.testing.assert_allclose(first.along_mm, 17.0 - 17.37, atol=0.05)


def test_an_image_is_spikes_over_the_time_that_afferents_spend_there():
    every_ms = np.arange(0.5, 300.0, 1.0)
    image = answered([every_ms, every_ms, every_ms]).image("SAI")
    np.testing.assert_allclose(image.rate_hz[np.isfinite(image.rate_hz)], 1000.0)
    assert np.isfinite(image.rate_hz).sum() == pytest.approx(3 * 2.0 / image.pixel_mm, abs=4)
    still = answered([every_ms, [], []], x_mm=0.0, z_mm=0.1).image("SAI")  # all within one pixel along
    assert still.rate_hz.shape[0] >= 1
    assert np.isnan(still.half_width_mm)
    silent = answered([[100.0], [], []]).image("SAI")  # before the object moves
    assert np.nanmax(silent.rate_hz) == 0.0
    assert np.isnan(silent.half_width_mm)


def test_the_half_width_of_the_autocorrelation_is_that_of_a_gaussian_image():
    along, across = 0.1 * np.arange(-120, 121), 0.1 * np.arange(-60, 61)
    bump = np.exp(-(along[:, None] ** 2 + across**2) / (2.0 * 0.5**2))
    image = TactileImage(type="SAI", along_mm=along, across_mm=across, rate_hz=bump, pixel_mm=0.1)
    assert image.half_width_mm == pytest.approx(2.0 * 0.5 * np.sqrt(np.log(2.0)), rel=0.02)
    holes = np.where(np.arange(along.size)[:, None] % 7 == 3, np.nan, bump)
    seen = replace(image, rate_hz=holes)
    assert seen.half_width_mm == pytest.approx(image.half_width_mm, rel=0.1)


def test_a_scan_solves_each_step_once_on_elements_as_fine_as_is_asked_for():
    letter = {"kind": "embossed_text", "text": "A"}
    asked = {"object": letter, "place": {"x_mm": -4.0}, "x_mm": 8.0, "force_mn": 300.0}
    (full,) = ScanRequest.read(asked).touches
    (touch,) = ScanRequest.read(asked | {"detail_mm": 0.35}).touches
    assert full.grading.finest_strip_mm < 0.25
    assert touch.grading.finest_strip_mm == 0.35
    assert len(touch.mesh.nodes_mm) < 0.6 * len(full.mesh.nodes_mm)
    assert touch.body.edge_radius_mm == 0.35
    moving_ms = np.diff(touch.steps_ms()[touch.steps_ms() >= 200.0])
    np.testing.assert_allclose(moving_ms, 0.25 / 20.0 * 1e3)


@pytest.mark.parametrize(
    ("more", "path", "said"),
    [
        ({"x_mm": 40.0}, "x_mm", "leave the finger"),
        ({"lines": 200}, "x_mm", "leave the finger"),
        ({"x_mm": 0.0}, "x_mm", "corner to corner"),
        ({"x_mm": [1.0, 1.0]}, "x_mm", "corner to corner"),
        ({"x_mm": [1.0, 2.0], "z_mm": [1.0]}, "x_mm", "as many corners"),
        ({"depth_mm": 1.0}, "depth_mm", "beside force_mn"),
        ({"speed_mm_per_s": 5000.0}, "speed_mm_per_s", "any hand"),
        ({"object": {"kind": "embossed_text", "text": "W", "capital_mm": 40.0}}, "object", "as wide as"),
        ({"afferents": "XY"}, "afferents", "XY"),
        ({"motion": {"depth_mm": 1.0}}, "motion", "unknown"),
    ],
)
def test_an_impossible_scan_is_refused_before_anything_is_pressed(more, path, said):
    with pytest.raises(InputError, match=said) as refused:
        ScanRequest.read(BALL | more).check()
    assert refused.value.path[0] == path


@pytest.mark.slow
def test_a_scan_holds_its_force_and_is_written_and_kept(tmp_path):
    found = fp.scan(BALL, x_mm=1.0, out=tmp_path)
    assert found.summary.force_mn == pytest.approx((60.0, 60.0), rel=2e-3)
    kinds = found.summary.types
    assert list(kinds) == ["SAI", "RA", "PC"]
    assert kinds["SAI"].mean_rate_hz > 5.0
    assert kinds["RA"].mean_rate_hz > 5.0
    written = json.loads((tmp_path / "scan.json").read_text())
    assert written["summary"]["types"]["SAI"]["afferents"] == kinds["SAI"].afferents
    events = (tmp_path / "events.csv").read_text().splitlines()
    assert events[0] == "event,type,line,afferent,time_ms,along_mm,across_mm"
    assert len(events) - 1 == len(found.to_frame())
    assert "Spikes on the object" in (tmp_path / "scan.html").read_text()
    again = fp.scan(BALL, x_mm=1.0, out=tmp_path)
    assert again.manifest.stages[0].indentations is None
    assert {stage.name: stage.computed for stage in again.manifest.stages}["lines"] == 0
    assert again.to_frame().equals(found.to_frame())


@pytest.mark.slow
def test_a_force_that_moves_aside_is_refused_where_it_presses_too_deep():
    with pytest.raises(InputError, match="must not push the indenter deeper") as refused:
        fp.scan(BALL, force_mn=60_000.0)
    assert refused.value.path == ("force_mn",)
