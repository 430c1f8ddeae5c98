"""A touch in three dimensions: what is drawn lies where it is, and what cannot be drawn is refused."""

import os
import shutil
import sys
from dataclasses import replace

import numpy as np
import pytest
from PIL import Image

import fingerpad as fp
from fingerpad.cli import main
from fingerpad.core.progress import Lines
from fingerpad.export import view
from fingerpad.export.view import fields_of
from refusals import refused
from sections import SMALL_TOUCH

TOUCH = replace(SMALL_TOUCH, stimulus=fp.RampAndHold(depth_mm=0.5))
RESPONSE = fp.ResponseMap(
    positions_mm=[[17.0, -1.0], [17.0, 1.0], [19.0, -1.0]],
    pitch_mm=2.0,
    spikes=fp.SpikeTrains.from_lists([[12.5, 40.0, 300.0], [45.0], []]),
    dynamic_rate_hz=[36.4, 0.0, 0.0],
    static_rate_hz=[3.8, 0.0, 0.0],
    first_spike_latency_ms=[12.5, 45.0, np.nan],
)


@pytest.fixture(scope="module")
def data():
    return TOUCH.solve(whole=True).to_dataset(RESPONSE)


@pytest.fixture(scope="module")
def file(tmp_path_factory):
    return TOUCH.solve().save(tmp_path_factory.mktemp("touch") / "touch.nc", response=RESPONSE)


def test_points_are_marked_where_the_scene_shows_them(data):
    """The projection of labels and afferents is that of the renderer, within a pixel."""
    points = np.array([[17.37, -9.0, 0.0], [25.0, 2.0, -4.0], [3.0, -5.0, 3.0]])
    for field in ("sed", "displacement", "pressure", "shear"):
        drawn = view._View(data, view._variable(data, field))
        assert drawn.scene(50.0).shape == (*view.PIXELS[::-1], 3)
        renderer = drawn._plotter.renderer
        for point, spot in zip(points, drawn._spots(points), strict=True):
            renderer.SetWorldPoint(*point, 1.0)
            renderer.WorldToDisplay()
            x, up, _ = renderer.GetDisplayPoint()
            np.testing.assert_allclose(spot, [x, view.PIXELS[1] - up], atol=1.0)


def test_the_scene_follows_time_and_shows_the_field(data):
    drawn = view._View(data, "sed_kpa")
    before, later = drawn.scene(0.0).astype(int), drawn.scene(50.0).astype(int)
    moved = np.abs(later - before).sum(axis=2) > 60
    assert 0.002 < moved.mean() < 0.5
    # Below the ball the field is darker than tissue at rest.
    x, y = drawn._spots(np.array([[17.37, -7.5, 0.0]]))[0].astype(int)
    assert later[y, x].sum() < before[y, x].sum() - 100


def test_afferents_that_fire_are_dark(data):
    drawn = view._View(data, "sed_kpa")
    assert drawn._fires(50.0).tolist() == [True, True, False]
    assert drawn._fires(41.0).tolist() == [True, False, False]
    points, facets = drawn._sites
    np.testing.assert_allclose(points[:, [0, 2]], RESPONSE.positions_mm)
    corners = data.node_mm.values[data.facet_nodes.values[facets]]
    assert (np.abs(corners.mean(axis=1)[:, [0, 2]] - np.abs(RESPONSE.positions_mm)) < 1.2).all()
    assert (points[:, 1] < -8.0).all()


def test_a_whole_finger_and_a_turned_body_are_cut_at_the_middle():
    whole = replace(
        TOUCH, indenter=fp.Bar(3.0, 0.3), grading=replace(TOUCH.grading, full=True), spin_deg=30.0
    )
    data = whole.solve(whole=True).to_dataset()
    drawn = view._View(data, "sed_kpa")
    assert drawn._object(50.0).bounds.z_max <= 1e-9
    assert view._View(data, "contact_pressure_kpa")._object(50.0).bounds.z_max > 3.0
    assert drawn.scene(50.0).min() < 120


def test_pictures_and_films_are_written(data, tmp_path):
    assert fp.save_view(tmp_path / "deep" / "a.png", data, time_ms=30.0) == (tmp_path / "deep" / "a.png",)
    with Image.open(tmp_path / "deep" / "a.png") as picture:
        assert picture.size[0] > 1200
    said: list[str] = []
    told = Lines(said.append, every_s=0.0)
    fp.save_view(tmp_path / "a.gif", data, field="pressure", frames=3, progress=told)
    assert said[-1].startswith("pictures: 3 of 3")
    assert any(line.startswith("pictures: 1 of 3") for line in said)
    with Image.open(tmp_path / "a.gif") as film:
        assert film.n_frames == 3
    assert sorted(path.name for path in tmp_path.iterdir()) == ["a.gif", "deep"]


def test_a_film_for_other_players_needs_ffmpeg(data, tmp_path, monkeypatch):
    monkeypatch.setattr(shutil, "which", lambda name: None)
    with pytest.raises(fp.InputError, match="needs the program ffmpeg"):
        fp.save_view(tmp_path / "a.mp4", data)
    monkeypatch.undo()
    (tmp_path / "bin").mkdir()
    program = tmp_path / "bin" / "ffmpeg"
    program.write_text('#!/bin/sh\nfor last; do :; done\ncat "${6%\\%05d.png}"/*.png > "$last"\n')
    program.chmod(0o755)
    monkeypatch.setenv("PATH", f"{program.parent}{os.pathsep}{os.environ['PATH']}")
    fp.save_view(tmp_path / "a.mp4", data, frames=2)
    assert (tmp_path / "a.mp4").read_bytes().count(b"IEND") == 2
    program.write_text("#!/bin/sh\necho no encoder >&2\nexit 1\n")
    with pytest.raises(fp.InputError, match=r"could not write the film \(no encoder\)"):
        fp.save_view(tmp_path / "b.mp4", data, frames=2)


def test_without_the_deformation_the_skin_is_shown_at_any_time(file, tmp_path):
    shown = {"skin_displacement_mm", "displacement", "pressure", "shear", "slip", "sed"}
    shown |= {"von_mises_kpa", "compressive_stress_kpa"}
    assert set(fields_of(fp.read_touch(file))) == shown
    fp.save_view(tmp_path / "skin.png", file.parent, field="pressure", time_ms=30.0)
    fp.save_view(tmp_path / "end.png", file, time_ms=1000.0)
    for options in ({"time_ms": 30.0}, {}, {"field": "von_mises_kpa", "time_ms": 0.0}):
        with pytest.raises(fp.InputError, match="is known at 1000 ms only: choose that time"):
            fp.save_view(tmp_path / "no.png", file, **options)
    with pytest.raises(fp.InputError, match="is known at 1000 ms only"):
        fp.save_view(tmp_path / "no.gif", file)
    assert sorted(path.name for path in tmp_path.iterdir()) == ["end.png", "skin.png"]


def test_a_response_without_afferents_and_object_is_drawn(tmp_path):
    skin = TOUCH.solve()
    (picture,) = fp.save_view(tmp_path / "a.png", skin, field="pressure")
    assert picture.stat().st_size > 10_000
    bare = replace(skin, touch=None).to_dataset()
    assert "object_front_mm" not in bare
    assert fp.save_view(tmp_path / "bare.png", bare, time_ms=1000.0)


def test_what_is_no_data_set_or_has_no_library_is_refused_and_a_changed_description_is_not(
    data, tmp_path, file, monkeypatch
):
    with refused("touch"):
        fp.save_view(tmp_path / "a.png", 5)
    assert view._named("Sphere") == view._named("[1]") == "object"
    assert view._named(data.attrs["indenter"]) == "Sphere"
    monkeypatch.setitem(sys.modules, "pyvista", None)
    with pytest.raises(fp.InputError, match=r"needs pyvista: .*fingerpad\[view\]"):
        fp.save_view(tmp_path / "a.png", file)


def test_the_command_writes_a_picture(file, run_program, tmp_path):
    outcome = run_program(main, "fingerpad", "view", file, "--field", "pressure", "--time", 50)
    assert outcome == (0, "Open: view.png\n", "")
    assert (tmp_path / "view.png").stat().st_size > 10_000


WRONG = {
    "no such file": (("none.nc",), "none.nc", "there is no such file"),
    "an empty folder": (("{folder}",), "touch.nc", "there is neither"),
    "an unknown field": (("{file}", "--field", "heat"), "field", "'heat'"),
    "a field at no place": (("{file}", "--field", "force_mn"), "field", "'force_mn'"),
    "a tensor of the sheet": (("{file}", "--field", "work"), "field", "'work'"),
    "a time before": (("{file}", "--time", "-1"), "time_ms", "-1"),
    "a time after": (("{file}", "--time", "1000.5"), "time_ms", "1000.5"),
    "no time": (("{file}", "--time", "nan"), "time_ms", "nan"),
    "words for a time": (("{file}", "--time", "late"), "--time", "late"),
    "an inner time": (("{file}", "--time", "30"), "displacement_mm", "1000 ms"),
    "an ending": (("{file}", "--out", "a.jpg"), "ending", ".jpg"),
    "no ending": (("{file}", "--out", "a"), "ending", "''"),
    "no name": (("{file}", "--out", ""), "--out", "must not be empty"),
    "a folder to write": (("{file}", "--out", ".."), "--out", "folder"),
    "a film at a time": (("{file}", "--out", "a.gif", "--time", "5"), "time_ms", "a.gif"),
    "one picture for a film": (
        ("{file}", "--out", "a.gif", "--field", "pressure", "--frames", "1"), "frames", "1"),
    "endless pictures": (
        ("{file}", "--out", "a.gif", "--field", "slip", "--frames", "1" + 12 * "0"), "frames", "most 2,000"),
    "an empty name": (("",), "An argument", "must not be empty"),
    "a long name": (("a" * 300,), "file or folder", "name too long"),
    "a device": (("/dev/zero",), "/dev/zero", "neither"),
    "half a picture": (("{file}", "--frames", "2.5"), "--frames", "2.5"),
    "no place to write": (
        ("{file}", "--field", "slip", "--out", "/dev/null/a.png"), "/dev/null/a.png", "cannot be written"),
    "a text file": (("{text}",), "text.nc", "cannot be read"),
    "another option": (("{file}", "--camera", "top"), "--camera", "--camera"),
}  # fmt: skip


@pytest.mark.parametrize("case", WRONG)
def test_a_misused_command_is_refused_in_one_sentence(case, file, run_program, is_refused, tmp_path_factory):
    words, named, came = WRONG[case]
    others = tmp_path_factory.mktemp("others")
    (others / "text.nc").write_text("time,force\n")
    (others / "empty").mkdir()
    places = {"{file}": file, "{folder}": others / "empty", "{text}": others / "text.nc"}
    outcome = run_program(main, "fingerpad", "view", *(places.get(word, word) for word in words))
    is_refused(outcome, "fingerpad", named, came)
