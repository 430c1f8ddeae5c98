"""Errors of arguments and files: a sentence for people, and a path, a value and a remedy for programs."""

import pickle

import numpy as np
import pytest

import fingerpad as fp

BAD_TOUCH = {
    "object: {kind: sphere, radius_mm: -3}": ("object", "radius_mm"),
    "object: {kind: sphere, raduis_mm: 3}": ("object", "raduis_mm"),
    "object: sphere\nmotion: {depth_mm: 9}": ("motion", "depth_mm"),
    "object: sphere\nplace: {x_mm: 40}": ("place",),
    "object: sphere\nplace: {tilt_deg: 100}": ("place", "tilt_deg"),
    "object: sphere\nresolutoin: quick": ("resolutoin",),
    "object: sphere\nplace: {colour: 1}": ("place", "colour"),
}


@pytest.mark.parametrize(
    ("make", "path", "got"),
    [
        (lambda: fp.Sphere(radius_mm=-1.0), ("radius_mm",), "-1.0"),
        (lambda: fp.Sphere(raduis_mm=4.0), ("raduis_mm",), ""),
        (lambda: fp.touch_of(fp.Fingertip(), fp.Sphere(), at_mm=(np.nan, 0.0)), ("at_mm", 0), "nan"),
        (lambda: fp.RampAndHold(depth_mm="deep"), ("depth_mm",), "'deep'"),
    ],
)
def test_an_error_of_an_argument_has_its_path_and_value(make, path, got):
    with pytest.raises(fp.InputError) as caught:
        make()
    assert (caught.value.path, caught.value.got) == (path, got)
    assert caught.value.expected


@pytest.mark.parametrize(("text", "path"), BAD_TOUCH.items())
def test_an_error_in_a_file_has_the_keys_that_lead_to_it(tmp_path, text, path):
    file = tmp_path / "touch.yaml"
    file.write_text(text)
    with pytest.raises(fp.InputError) as caught:
        fp.TouchRequest.read(file).touch()
    assert caught.value.path == path
    assert str(caught.value).startswith(f"{file}, line ")
    assert not str(caught.value).endswith("..")


def test_an_error_comes_whole_from_another_process():
    error = fp.InputError("depth_mm", "must be below 5", "9", "press less deep").at(("motion", "depth_mm"))
    again = pickle.loads(pickle.dumps(error.from_source("touch.yaml, line 3")))
    assert str(again) == "touch.yaml, line 3, motion.depth_mm must be below 5: got 9; press less deep."
    assert (again.path, again.remedy, again.in_file) == (("motion", "depth_mm"), "press less deep", True)
