"""Other names of sizes, and keywords that a class or a function does not have."""

import contextlib
import inspect
import math
import pickle
from dataclasses import fields, replace

import numpy as np
import pytest
from pydantic import BaseModel

import fingerpad as fp
from docs.site.reference import public_names
from fingerpad.core.checked import OtherName, other_names, value_class
from fingerpad.core.displayed import Result
from fingerpad.core.units import unit_of
from fingerpad.experiments.requests.stimuli import read_stimuli
from fingerpad.experiments.requests.stimulus import indenter_named
from fingerpad.geometry.bodies import INDENTERS, sizes_of
from fingerpad.reduction.training import ReducedRange
from fingerpad.skin.store import touch_key

SAME = [
    (fp.Sphere(radius_mm=4.0), fp.Sphere(curvature_per_m=250.0), "sphere:radius_mm=4"),
    (fp.Sphere(diameter_mm=8.0), fp.Sphere(curvature_per_m=250.0), "sphere:diameter_mm=8.0"),
    (fp.Cylinder(radius_mm=1.5), fp.Cylinder(3.0), "cylinder: radius_mm = 1.5"),
    (fp.Bar(4.0, edge_radius_mm=0.2), fp.Bar(4.0, 0.2), "bar:4:edge_radius_mm=0.2"),
    (fp.FlatPunch(radius_mm=2.0, edge_radius_mm=0.1), fp.FlatPunch(4.0, 0.1), "punch:4:fillet_mm=.1"),
    (fp.Edge(edge_radius_mm=0.4), fp.Edge(0.4), "edge:edge_radius_mm=0.4"),
    (fp.Gap(1.0, lip_radius_mm=0.1), fp.Gap(1.0, lip_mm=0.1), "gap:1:lip_radius_mm=0.1"),
    (fp.Grating(period_mm=2.0), fp.Grating(1.0, 1.0), "grating:period_mm=2"),
    (fp.Grating(period_mm=2.0, duty=0.25), fp.Grating(0.5, 1.5), "grating:duty=0.25:period_mm=2"),
    (fp.Grating(duty=0.5), fp.Grating(1.5, 1.5), "grating:duty=0.5"),
]  # fmt: skip


@pytest.mark.parametrize(("friendly", "stored", "text"), SAME, ids=[text for _, _, text in SAME])
def test_a_body_is_the_same_by_either_name_in_python_and_in_text(friendly, stored, text):
    assert friendly == stored
    assert repr(friendly) == repr(stored)
    assert hash(friendly) == hash(stored)
    assert vars(friendly) == vars(stored)
    assert indenter_named(text) == stored
    assert pickle.loads(pickle.dumps(friendly)) == stored
    touches = [fp.touch_of(fp.Fingertip(), body) for body in (friendly, stored)]
    assert touch_key(touches[0]) == touch_key(touches[1])


def test_every_other_name_reads_back_what_was_given():
    values = {"duty": 0.3, "period_mm": 3.0, "lip_radius_mm": 0.2, "edge_radius_mm": 0.25}
    for name, kind in INDENTERS.items():
        for other in other_names(kind):
            given = values.get(other, 1.75)
            body = kind(**{other: given})
            assert getattr(body, other) == pytest.approx(given, rel=1e-15), (name, other)
        assert tuple(inspect.signature(kind).parameters) == sizes_of(name)  # editors see every name
    assert replace(fp.Sphere(radius_mm=4.0), curvature_per_m=200.0) == fp.Sphere(radius_mm=5.0)


def test_fields_are_the_papers_and_units_cover_every_name():
    assert [size.name for size in fields(fp.Sphere)] == ["curvature_per_m"]
    assert [size.name for size in fields(fp.Grating)] == ["ridge_mm", "groove_mm", "lip_mm"]
    for size in {size for name in INDENTERS for size in sizes_of(name)}:
        assert (unit_of(size) == "mm") == size.endswith("_mm"), size


@pytest.mark.parametrize(
    ("make", "said"),
    [
        (lambda: fp.Sphere(raduis_mm=4.0), "raduis_mm is no argument of Sphere: did you mean radius_mm?"),
        (lambda: fp.Sphere(radius=4.0), "radius is no argument of Sphere: did you mean radius_mm?"),
        (lambda: fp.Plate(width_mm=3.0), "width_mm is no argument of Plate: Plate has no keyword."),
        (lambda: fp.Sphere(colour=1), "colour is no argument of Sphere: Sphere has "),
        (lambda: fp.Sphere(curvature_per_m=250.0, radius_mm=4.0), "radius_mm and curvature_per_m exclude"),
        (lambda: fp.Sphere(radius_mm=4.0, diameter_mm=8.0), "diameter_mm and radius_mm exclude each other"),
        (lambda: fp.Bar(fillet_mm=0.2, edge_radius_mm=0.2), "edge_radius_mm and fillet_mm exclude each"),
        (lambda: fp.Grating(groove_mm=1.0, duty=0.5), "duty and groove_mm exclude each other"),
        (lambda: fp.Sphere(radius_mm=-1.0), "radius_mm must be greater than 0 [mm]: got -1.0."),
        (lambda: fp.Bar(edge_radius_mm=2.0), "edge_radius_mm must not exceed half of width_mm, 1.5 mm"),
        (lambda: fp.Gap(edge_radius_mm=-0.1), "edge_radius_mm must not be negative [mm]: got -0.1."),
        (lambda: fp.Grating(period_mm=2.0, duty=1.0), "duty must be below 1"),
        (lambda: fp.indent(fp.Fingertip(), fp.Sphere(), resolutoin="quick"), "did you mean resolution?"),
        (lambda: fp.indent(fp.Fingertip(), fp.Sphere(), materials=""), "of indent: did you mean tissues?"),
        (lambda: fp.Population.grid(dens=3), "dens is no argument of Population.grid: did you mean dens"),
        (lambda: fp.Trajectory([0, 1], depths_mm=[0, 1]), "did you mean depth_mm?"),
        (lambda: indenter_named("sphere:raduis_mm=4"), "raduis_mm is no argument of Sphere: did you"),
        (lambda: indenter_named("bar:3:width_mm=4"), "indenter must have width_mm once"),
        (lambda: indenter_named("sphere:=4"), "is no argument of Sphere:"),
        (lambda: fp.sine(0.8, 0.1), "sine needs frequency_hz, cycles: they are not given."),
        (lambda: ReducedRange(), "ReducedRange needs depth_mm: it is not given."),
        (lambda: fp.save_figure("a.png", None), "skin must be of type SkinResponse: got None."),
        (lambda: fp.read_height_map("x.png"), "read_height_map needs pitch_mm: it is not given."),
        (lambda: fp.Fingertip("child"), "got 'child', write Fingertip.of('child')."),
        (lambda: fp.RampAndHold(force_mn=60), "argument of RampAndHold: take ForceRampAndHold."),
        (lambda: fp.indent(fp.Fingertip, fp.Sphere()), "finger must be made from its class: got Fingertip, "),
        (lambda: fp.indent(fp.Fingertip(), fp.Sphere), "got Sphere, call it: Sphere()."),
        (lambda: fp.Fingertip.of("child", like="adult"), "got multiple values for argument 'like'"),
        (lambda: fp.Sphere(3.5), "Sphere takes curvature_per_m=, radius_mm=, diameter_mm=: got too many"),
        (lambda: fp.Sphere(curvature_per_m=3.5), "has a radius of 286 mm, outside 0.005 to 200 mm"),
        (lambda: indenter_named("sphere:3.5"), "has a radius of 286 mm, outside 0.005 to 200 mm"),
        (lambda: fp.Cylinder(1e-6), "diameter_mm must lie within 0.01 to 400 mm: got 1e-06; check its unit."),
        (lambda: fp.RampAndHold(0.0005), "depth_mm must lie within 0.001 to 20 mm: got 0.0005; check its"),
        (lambda: fp.ForceRampAndHold(0.5), "force_mn must lie within 1 to 100000 mN"),
        (lambda: fp.Trajectory([0, 50], [0, 5e-4]), "the largest depth_mm must lie within 0.001 to 20 mm"),
        (lambda: fp.notebook_progress(1), "notebook_progress takes no argument: got too many"),
    ],
)  # fmt: skip
def test_what_a_class_or_function_does_not_have_is_refused_in_one_sentence(make, said):
    with pytest.raises(fp.InputError) as refused:
        make()
    assert said in str(refused.value)
    assert str(refused.value)[-1] in ".?"
    assert "\n" not in str(refused.value)


COARSE = fp.Grading(17.37, 3.0, 3.0, 0.8, 0.8, 6.0, 1.3, 1, 1, 1, 1, full=True)


def test_a_touch_and_its_press_take_the_same_arguments():
    described, pressed = (inspect.signature(each).parameters for each in (fp.touch_of, fp.indent))
    assert described == pressed
    turned = {"tilt_deg": 5.0, "spin_deg": 10.0, "friction": 0.2, "whole": True, "times_ms": [30.0]}
    motion = fp.RampAndHold(depth_mm=0.1, ramp_ms=50, hold_ms=50)
    turned |= {"settings": fp.PressSettings(1, 1), "grading": COARSE}
    skin = fp.indent(fp.Fingertip(), fp.Sphere(), motion, **turned)
    assert skin.touch == fp.touch_of(fp.Fingertip(), fp.Sphere(), motion, **turned)
    assert skin.deformation is not None


@pytest.mark.parametrize("name", fp.__all__)
def test_what_a_user_calls_answers_wrong_arguments_in_one_sentence(name):
    found = getattr(fp, name)
    if isinstance(found, type):
        checked = inspect.isabstract(found) or hasattr(found.__init__, "__wrapped__")
        made_by_fingerpad = issubclass(found, Result | Exception | BaseModel)
        assert checked or made_by_fingerpad
    elif not inspect.ismodule(found):
        assert inspect.unwrap(found) is not found


ODD = (None, "x", -1, 0, math.nan, True, [], {}, object(), [1, 2, 3], np.zeros((2, 2)), b"x", 3.5)

PUBLIC = {
    name: found
    for names in public_names().values()
    for name, found in names.items()
    if not isinstance(found, type)
    or (hasattr(found.__init__, "__wrapped__") and not issubclass(found, Result | Exception))
}
"""Functions and classes of the reference, without results, which users do not make."""

MADE = (
    fp.Fingertip(), fp.Bar(), fp.Sphere(), fp.sine(0.8, 0.1, 20.0, cycles=3), fp.Afferent(), fp.PC(),
    fp.Population.grid(rows=1, columns=2), fp.SpikeTrains.from_lists([[12.0, 40.0], []]),
    fp.Traces([0.0, 50.0, 1000.0], [[0.0], [2.0], [1.8]]),
)  # fmt: skip


def methods_of(made):
    """Public methods of a value that take an argument."""
    found = {name: getattr(made, name) for name in dir(type(made)) if not name.startswith("_")}
    methods = filter(inspect.ismethod, found.values())
    return [method for method in methods if inspect.signature(method).parameters]


@pytest.mark.parametrize("name", sorted(PUBLIC.keys() - {"Indenter", "reproduce"}))  # its defaults run hours
def test_odd_arguments_of_a_public_name_end_in_one_sentence(name, monkeypatch, tmp_path):
    monkeypatch.chdir(tmp_path)
    ends_in_one_sentence(PUBLIC[name])


@pytest.mark.parametrize("made", MADE, ids=lambda made: type(made).__name__)
def test_odd_arguments_of_a_method_end_in_one_sentence(made):
    for method in methods_of(made):
        if method.__name__ not in ("step_times_ms", "bone_distance_mm"):  # of the solver
            ends_in_one_sentence(method)


def ends_in_one_sentence(function):
    """Call it with each odd value in the place of all arguments that it needs, or of its first one."""
    parts = inspect.signature(function).parameters.values()
    taken = [part for part in parts if part.kind is part.POSITIONAL_OR_KEYWORD]
    count = max(sum(part.default is part.empty for part in taken), min(1, len(taken)))
    for odd in ODD:
        with contextlib.suppress(fp.FingerpadError, ImportError):  # a package of an extra may be missing
            function(*[odd] * count)


def test_a_body_of_ones_own_has_the_hint_and_its_own_other_names():
    @value_class
    class Cone(fp.Indenter):
        opening_deg: float = 90.0
        slope_deg = OtherName(lambda slope_deg: {"opening_deg": 180.0 - 2 * slope_deg})

        def gap(self, points_mm):
            return fp.Plate().gap(points_mm)

    assert Cone(slope_deg=45.0) == Cone(90.0)
    with pytest.raises(fp.InputError, match="openning_deg is no argument of Cone: did you mean opening_deg"):
        Cone(openning_deg=80.0)


EITHER_NAME = {
    "csv": "name,object,object.radius_mm,object.period_mm,object.duty\n"
    "ball,sphere,4,,\nrows,grating,,2,0.25\n",
    "yaml": "stimuli:\n- {name: ball, object: {kind: sphere, radius_mm: 4}}\n"
    "- {name: rows, object: {kind: grating, period_mm: 2, duty: 0.25}}\n",
}


@pytest.mark.parametrize("suffix", ["csv", "yaml"])
def test_files_of_stimuli_take_either_name(tmp_path, suffix):
    path = tmp_path / f"stimuli.{suffix}"
    path.write_text(EITHER_NAME[suffix], encoding="utf-8")
    stimuli = read_stimuli(path).stimuli
    assert stimuli["ball"].indenter == fp.Sphere(curvature_per_m=250.0)
    assert stimuli["rows"].indenter == fp.Grating(0.5, 1.5)
