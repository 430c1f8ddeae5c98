"""Random odd inputs for every public value type, file reader and command: a result, or one sentence.

`FUZZ` in the environment multiplies the number of examples; `make fuzz` takes an hour.
"""

import contextlib
import io
import os
import struct
import sys
from dataclasses import fields
from decimal import Decimal
from fractions import Fraction
from pathlib import Path

import numpy as np
import pytest
from hypothesis import HealthCheck, given, settings
from hypothesis import strategies as st

import fingerpad as fp
from fingerpad.cli import main
from fingerpad.core.phases import Phase
from fingerpad.core.plain_yaml import read_yaml
from fingerpad.core.regions import Layout, Polygon, Rectangle
from fingerpad.core.signals import HitRates
from fingerpad.experiments.conditions import Conditions
from fingerpad.experiments.examples import examples as example_files
from fingerpad.experiments.recording_files import read_recordings
from fingerpad.experiments.requests.afferents import fitted_afferent
from fingerpad.experiments.requests.stimuli import ShiftedBar, read_stimuli
from fingerpad.experiments.requests.stimulus import TactileStimulus
from fingerpad.experiments.runner import Runner
from fingerpad.experiments.validation.observations import read_observations
from fingerpad.geometry.bodies import Dots
from fingerpad.geometry.embossed import Embossed
from fingerpad.geometry.motion import Cycles
from fingerpad.geometry.surface import Surface
from fingerpad.mechanics.materials import Hencky, Hyperfoam, Ogden, Polynomial
from fingerpad.mechanics.newton import NewtonSettings
from fingerpad.neuron.band_pass import BandPass
from fingerpad.neuron.end_organs import EndOrgans
from fingerpad.neuron.lif import LeakyIntegrateAndFire
from fingerpad.neuron.transduction import Transduction
from fingerpad.psychophysics.curve import JudgementCounts, PsychometricFunction
from fingerpad.psychophysics.ideal_observer import GaussianResponses
from fingerpad.psychophysics.observer import Experiment
from fingerpad.reduction.training import ReducedRange
from fingerpad.skin.sampling import SurfaceProfile

LONGEST = 2600
"""Characters of an error."""

MANY = int(os.environ.get("FUZZ", "1"))


def examples(count):
    return settings(max_examples=count * MANY, deadline=None, suppress_health_check=list(HealthCheck))


# -- value types ---------------------------------------------------------------------------------------------

BALL = fp.Sphere(curvature_per_m=287)
FOAM = fp.Material(Hencky(5.0, 100.0))
VALUES = [
    fp.Sphere(curvature_per_m=287.0), fp.Cylinder(3.0), fp.bodies.Line(0.3), fp.Bar(3.0, 0.3), fp.Edge(0.1),
    fp.FlatPunch(3.0, 0.3), fp.Gap(1.0, 8.0, 0.1, 0.1), fp.Grating(1.0, 1.0, 0.1),
    Dots(((0.0, 0.0), (2.5, 0.0)), 1.4, 0.5),
    Embossed((((-1, -1), (1, -1), (1, 1.0)),), height_mm=0.5, edge_radius_mm=0.1),
    fp.bodies.Union((BALL, fp.Plate()), ((0, 0, 0), (3, 0, 0)), seam_mm=0.0),
    Surface([[-1.0, 0, -1], [1.0, 0, -1], [0.0, 0, 1]], [[0, 2, 1]], 10.0),
    fp.RampAndHold(1.0, 50.0, 950.0), fp.ForceRampAndHold(100.0, 50.0, 950.0),
    fp.Trajectory((0.0, 10.0, 20.0), depth_mm=(0.0, 1.0, 1.0), x_mm=(0.0, 0.0, 0.5)),
    Cycles(0.0, 10.0, 3), Phase("ramp", 0.0, 50.0), fp.Fingertip(),
    fp.Grading(17.0, 2.0, 2.0, 0.5, 0.5, dermis=3, full=True, finer_along=((16.0, 18.0, 0.1),)),
    Polynomial(5.0, bulk_linear=100.0), Ogden((5.0, 1.0), (2.0, -2.0), 100.0),
    Hyperfoam((5.0,), (2.0,), 0.3), Hencky(5.0, 100.0),
    fp.Energy("m * (I1 - 3) + k * (J - 1)**2", (("m", 5.0), ("k", 100.0))),
    fp.Prony((0.3, 0.1), (25.0, 300.0)), FOAM, fp.Tissues(FOAM, FOAM, FOAM, FOAM),
    fp.PressSettings(times_ms=(1.0, 2.0), cycle_tolerance=0.01), NewtonSettings(),
    fp.Afferent(), fp.RA(threshold=1.0), fp.PC(threshold=1.0), fp.SAI(), Transduction(0.0, 1.0, 1.0),
    LeakyIntegrateAndFire(80.0, 1e-6, 30.0, 1.0), BandPass(30.0, 2, 2),
    fp.Population([[17.0, 0.0], [18.0, 0.0]], 1.0, sensitivity=[1.0, 2.0]),
    EndOrgans([[[17.0, 0.0], [18.0, 0.0]]], [0.5, 0.5], "sum"),
    fp.Traces([0.0, 50.0, 100.0], [[0.0], [1.0], [1.0]], [50.0]), fp.SpikeTrains([1.0, 2.0, 1.5], [0, 2, 3]),
    HitRates([0.5, 0.7], [0.1, 0.1], seed=3, session=0),
    Layout([[0.0, 0.0], [1.0, 0.0]], 1.0, pattern="uniform", seed=1), Rectangle(3.0, 6.0, (1.0, 2.0)),
    fp.Ellipse(3.0, 6.0, (1.0, 2.0)), Polygon(((0.0, 0.0), (1.0, 0.0), (1.0, 1.0))),
    Experiment(presentations=10, criterion=0.5), PsychometricFunction(1.0, 0.5, 0.5, 0.0, "weibull"),
    JudgementCounts([1.0, 2.0], [5, 9], [10, 10]), GaussianResponses([1.0, 2.0], [[1.0, 0.1], [0.1, 1.0]]),
    fp.RateRecordings(("a", "b"), [1.0, 2.0], [1.0, 2.0]), SurfaceProfile([0.0, 1.0], [0.1, 0.2]),
    Conditions("quick", 3, "human"), TactileStimulus(BALL, x_mm=1.0, tilt_deg=3.0, friction=0.3),
    ReducedRange(depth_mm=1.0, x_mm=(-1, 1), parameter="curvature_per_m", values=(200, 300)),
]  # fmt: skip


def fields_of(value):
    """What a value was made of."""
    return {field.name: getattr(value, field.name) for field in fields(value) if field.init}


numbers = st.one_of(
    st.floats(),
    st.integers(),
    st.sampled_from([10**400, -(10**5000), 2**63, 2**64, 0, -0.0, 5e-324, 1e308, 1e-300, 1_000_000_000]),
)
oddities = st.one_of(
    numbers,
    st.text(max_size=5),
    st.sampled_from(
        [
            None, True, np.True_, "1", b"1", "x" * 100_000, 1j, np.complex128(1j), Decimal("0.5"),
            Decimal("NaN"),
            Fraction(1, 3), np.float32(0.5), np.float16(0.5), np.int8(3), np.longdouble(0.5),
            np.uint64(2**63),
            np.datetime64("2001-01-01"), np.timedelta64(3, "ms"), np.ma.masked, np.array(0.5),
            np.array("0.5"),
            np.ma.array([1.0, 2.0], mask=[0, 1]), [], (), {}, set(), object(), float, range(3), iter(()),
            np.array(["2001-01-01", "2001-01-02"], dtype="datetime64[D]"), np.empty((0, 2)), np.ones((2, 2,
            2)),
            fp.Sphere(), fp.Tissues, [[1.0], [1.0, 2.0]], np.array([object()]), memoryview(b"12"),
        ]
    ),
    st.lists(numbers, max_size=4),
    st.lists(st.lists(numbers, min_size=2, max_size=2), max_size=4),
)  # fmt: skip


def changed(value, odd, place):
    """Value with an odd one in its place, or somewhere within it."""
    if isinstance(value, tuple | list) and value and place % 3:
        items = list(value)
        items[place % len(items)] = changed(items[place % len(items)], odd, place // 3)
        return tuple(items) if isinstance(value, tuple) else items
    return odd


@examples(500)
@given(st.sampled_from(VALUES), st.integers(0, 999), oddities, st.integers(0, 80))
@pytest.mark.filterwarnings("ignore::fingerpad.core.errors.MaterialWarning")
def test_a_value_type_takes_a_value_or_refuses_it_in_one_sentence(value, which, odd, place):
    kind, of_value = type(value), fields_of(value)
    kind(**of_value)
    name = list(of_value)[which % len(of_value)]
    given_values = of_value | {name: changed(of_value[name], odd, place)}
    try:
        made = kind(**given_values)
    except fp.FingerpadError as error:
        said = str(error)
        assert "\n" not in said.rstrip("\n") or "x" in str(odd)
        assert len(said) < LONGEST
        return
    held = getattr(made, name)
    before = of_value[name]
    if isinstance(before, float):
        assert held is None or (type(held) is float and np.isfinite(held))
    if isinstance(before, tuple) and held is not None:
        assert isinstance(held, tuple)
        hash(held)
    if isinstance(before, bool | int):
        assert held is None or type(held) in (bool, int)
    if isinstance(held, np.ndarray):
        assert not isinstance(held, np.ma.MaskedArray)
        assert held.dtype.kind in "if"
        assert not held.flags.writeable
    repr(made)


# -- files ---------------------------------------------------------------------------------------------------

STL = b"\0" * 80 + struct.pack("<I", 1) + struct.pack("<12fH", 0, 0, 1, 0, 0, 0, 2, 0, 0, 0, 2, 0, 0)
OBJ = b"v 0 0 0\nv 2 0 0\nv 0 2 0\nf 1 2 3\n"
PLY = (
    b"ply\nformat ascii 1.0\nelement vertex 3\nproperty float x\nproperty float y\nproperty float z\n"
    b"element face 1\nproperty list uchar int vertex_indices\nend_header\n0 0 0\n2 0 0\n0 2 0\n3 0 1 2\n"
)
FIT = (
    b'{"format": "fingerpad fit", "format_version": 3, "fit": {"parameters": {"intercept_ma": 0.0}},'
    b'"dynamic_quantity": "stored", "static_quantity": "stored"}'
)
MESH = (
    b'$MeshFormat\n4.1 0 8\n$EndMeshFormat\n$PhysicalNames\n1\n3 1 "dermis"\n$EndPhysicalNames\n'
    b"$Nodes\n1 4 1 4\n3 1 0 4\n1\n2\n3\n4\n0 0 0\n1 0 0\n0 1 0\n0 0 1\n$EndNodes\n"
    b"$Elements\n1 1 1 1\n3 1 4 1\n1 1 2 3 4\n$EndElements\n"
)
INP = b"*NODE\n1, 0., 0., 0.\n2, 1., 0., 0.\n*ELEMENT, TYPE=C3D8, ELSET=dermis\n1, 1, 2, 1, 2, 1, 2, 1, 2\n"


def _array(values):
    stored = io.BytesIO()
    np.save(stored, values)
    return stored.getvalue()


def _picture():
    from PIL import Image

    stored = io.BytesIO()
    Image.fromarray(np.arange(16, dtype=np.uint8).reshape(4, 4)).save(stored, format="png")
    return stored.getvalue()


FILES = {
    "task.yaml": (example_files()["sphere_curvature"].text.encode(), fp.DiscriminationRequest.read),
    "touch.yaml": (example_files()["touch"].text.encode(), fp.TouchRequest.read),
    "sweep.yaml": (
        b"touch:\n  object: {kind: sphere}\ngrid:\n  object.radius_mm: [2, 3]\n",
        fp.SweepRequest.read,
    ),
    "reduction.yaml": (b"object: {kind: sphere}\nrange: {depth_mm: 1}\n", fp.ReductionRequest.read),
    "any.yaml": (b"a: [1, 2.5, {b: 'c'}]\n", lambda path: read_yaml(path.read_text(errors="ignore"), "any")),
    "stimuli.csv": (b"name,object,object.diameter_mm\nprobe,punch,1.0\nwide,punch,4\n", read_stimuli),
    "stimuli.yaml": (b"stimuli:\n- {name: a, object: {kind: sphere, radius_mm: 3}}\n", read_stimuli),
    "rates.csv": (
        b"shift_mm,static_rate_hz,dynamic_rate_hz,fold\n-1.5,60,20,1\n0,10,5,2\n",
        lambda path: read_recordings(path, ShiftedBar()),
    ),
    "spikes.csv": (
        b"shift_mm,spike_times_ms,duration_ms\n-1.5,1 2 30,900\n0,,800\n",
        lambda path: read_recordings(path, ShiftedBar()),
    ),
    "force.csv": (b"indenter,depth_mm,force_n\nplate,1,0.2\npunch:6.35,1,0.1\n", read_observations),
    "motion.csv": (b"time_ms,depth_mm,x_mm\n0,0,0\n50,1,0\n60,1,0.2\n", fp.read_trajectory),
    "fit.json": (FIT, fitted_afferent),
    "body.stl": (STL, fp.read_surface),
    "body.obj": (OBJ, fp.read_surface),
    "body.ply": (PLY, fp.read_surface),
    "map.npy": (_array(np.arange(12.0).reshape(3, 4)), lambda path: fp.read_height_map(path, 0.5)),
    "map.csv": (b"0,1,2\n1,2,3\n2,3,4\n", lambda path: fp.read_height_map(path, 0.5)),
    "map.png": (_picture(), lambda path: fp.read_height_map(path, 0.5)),
    "finger.msh": (MESH, lambda path: fp.read_finger(path)),
    "finger.inp": (INP, lambda path: fp.read_finger(path)),
    "model.npz": (b"PK\3\4" + b"0" * 60, fp.read_reduced),
}

TOKENS = [
    b"", b"\n", b"\0", b"\xff\xfe", b"nan", b"inf", b"-1", b"1e400", b"9" * 5000, b"1_0", b"1:30",
    b"2001-13-45", b"!!int x", b"&a [*a]", b"*a", b"<<: *a", b"{", b"[" * 50, b"- " * 50, b"'", b'"', b",",
    b";", b"\t", b": ", b"#", b"~", b"0x_", "１".encode(), "\u202e".encode(), b"$\\nope{ $", b"..", b"/",
    b"%s", b"a" * 3000,
]  # fmt: skip


@st.composite
def damaged(draw, content):
    """Content with some bytes replaced, inserted, repeated or cut away."""
    for _ in range(draw(st.integers(1, 3))):
        begin = draw(st.integers(0, len(content)))
        end = begin + draw(st.sampled_from([0, 0, 1, 1, 2, 8, 10**6]))
        put = draw(st.one_of(st.sampled_from(TOKENS), st.binary(max_size=4), st.just(content[begin:end] * 2)))
        content = content[:begin] + put + content[end:]
    return content


@examples(400)
@given(st.sampled_from(list(FILES)), st.data())
@pytest.mark.filterwarnings("ignore::fingerpad.core.errors.InertiaWarning")
def test_a_damaged_file_is_read_or_refused_in_one_sentence(tmp_path_factory, name, data):
    whole, read = FILES[name]
    path = tmp_path_factory.getbasetemp() / name
    path.write_bytes(data.draw(damaged(whole)))
    try:
        read(path)
    except fp.FingerpadError as error:
        said = str(error)
        assert len(said) < LONGEST


# -- the command line ----------------------------------------------------------------------------------------

COMMANDS = [
    "touch", "respond", "init", "check", "sweep", "reproduce", "fit", "discriminate", "validate", "view",
    "reduce", "store",
]  # fmt: skip
OPTIONS = [
    "--out", "--resolution", "--tissues", "--jobs", "--seed", "--stimuli", "--object", "--motion",
    "--motion.depth_mm", "--object.kind", "--afferents.rows=2", "--times_ms", "--outputs", "--folds",
    "--method", "--unit", "--windows_ms.static", "--finger", "--list", "--noise", "--touch", "--extended",
    "--allow-python", "--quiet", "--help", "--version", "--scheduler", "--posterior", "list", "verify",
    "prune",
]  # fmt: skip
WORDS = [
    "", "-1", "0", "1", "nan", "inf", "1e400", "9" * 400, "quick", "human", "bar", "x", "none.yaml",
    "touch.yaml", "task.yaml", "rates.csv", "/dev/zero", "/dev/null", ".", "..", "a\0b", "$\\nope{ $", "--",
    "-", "１", "\ud800", "sphere_curvature", "gap_detection", "paper", "adult:width_mm=18", "child", "30",
    "50", "a" * 3000, "vtu", "csv",
]  # fmt: skip


@examples(150)
@given(st.sampled_from(COMMANDS), st.lists(st.sampled_from(OPTIONS + 2 * WORDS), max_size=6))
def test_a_command_line_ends_with_a_status_and_at_most_one_sentence(tmp_path_factory, command, words):
    folder = tmp_path_factory.mktemp("cli", numbered=True)
    for name in ("touch.yaml", "task.yaml", "rates.csv"):
        (folder / name).write_bytes(FILES[name][0])
    said, errors = io.StringIO(), io.StringIO()

    def refuse(*args, **kwargs):
        raise fp.FingerpadError("This would press.")

    with pytest.MonkeyPatch.context() as patched:
        patched.chdir(folder)
        patched.setattr(sys, "argv", ["fingerpad", command, *words])
        patched.setattr(Runner, "solve", refuse)
        with (
            contextlib.redirect_stdout(said),
            contextlib.redirect_stderr(errors),
            pytest.raises(SystemExit) as ended,
        ):
            main()
    status = ended.value.code or 0
    assert status in (0, 2)
    assert "Traceback" not in errors.getvalue()
    said_last = errors.getvalue().splitlines()[-1:]
    assert status == 0 or not said_last or said_last[0].startswith("fingerpad: ")
    assert len(errors.getvalue()) < 4000
    for path in Path(folder).rglob("*.json"):
        assert path.stat().st_size
