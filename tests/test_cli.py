"""The command line: output, errors and exit status."""

import inspect
import re
import subprocess
import sys
from functools import partial

import pytest
import typer
from fingerpad.experiments.descriptions.stimulus import FingerDescription

import fingerpad as fp
from fingerpad import __version__, cli
from fingerpad.cli import options as choices
from fingerpad.core.errors import StoreError
from fingerpad.data.tissues import DEFAULT_TISSUES
from fingerpad.experiments import gerling2014
from fingerpad.experiments.conditions import Conditions
from fingerpad.export import formats
from fingerpad.geometry.edged_indenters import INDENTERS
from fingerpad.geometry.fingertip import FINGERS
from fingerpad.geometry.grading import RESOLUTIONS
from fingerpad.mechanics.tissues import TISSUES

COMMAND = [sys.executable, "-W", "error", "-m", "fingerpad"]


@pytest.fixture
def call(monkeypatch, run_program):
    """Run the command line in this process, in an empty folder; a reproduction fails the test."""
    monkeypatch.setattr(gerling2014, "reproduce", pytest.fail)
    return partial(run_program, cli.main, "fingerpad")


def test_the_help_names_every_option_with_its_unit(call):
    assert call("--version") == (0, f"fingerpad {__version__}\n", "")
    status, summary, errors = call()
    assert (status, errors) == (2, "")
    for name, command in typer.main.get_command(cli.app).commands.items():
        status, said, errors = call(name, "--help")
        assert (status, errors) == (0, "")
        said = " ".join(said.split())
        units = [unit for each in command.params for unit in re.findall(r"\[\S+\]", each.help or "")]
        assert all(said.count(unit) >= units.count(unit) for unit in units), name
        assert " ".join(command.help.partition("\n\n")[0].split()) in " ".join(summary.split())
    assert {"--resolution", "--out", "--jobs", "--seed"} <= set(call("reproduce", "--help")[1].split())


def test_the_help_names_what_the_modules_know():
    assert choices.RESOLUTION_CHOICES == RESOLUTIONS
    assert tuple(TISSUES) == choices.TISSUES_CHOICES
    assert tuple(formats.FORMATS) == choices.FORMAT_CHOICES
    assert tuple(INDENTERS) == choices.INDENTER_CHOICES
    assert tuple(FINGERS) == choices.FINGER_CHOICES
    assert all(getattr(fp, body.__name__) is body for body in INDENTERS.values())


def test_one_set_of_tissues_is_the_default_everywhere():
    commands = typer.main.get_command(cli.app).commands
    options = [(name, each) for name, command in commands.items() for each in command.params]
    pressed = {name: each.default for name, each in options if each.name == "tissues"}
    assert set(pressed) == {"reproduce", "fit", "validate", "export"}
    assert pressed.pop("reproduce") == "paper"  # the first column; the default tissues are the second
    assert pressed.pop("fit") is None  # those of the file of stimuli, which are the default tissues
    functions = [inspect.signature(function).parameters["tissues"] for function in (fp.indent, fp.touch_of)]
    found = {*pressed.values(), *(each.default for each in functions), Conditions().tissues}
    assert found | {FingerDescription().tissues, choices.DEFAULT_TISSUES} == {DEFAULT_TISSUES}
    assert Conditions().afferent == fp.Afferent() == fp.Population.grid().afferent


@pytest.mark.parametrize(
    ("arguments", "named", "came"),
    [
        (["reproduce", "--depth", "1"], "No such option", "--depth"),
        (["reproduce", "--resolution", "qick"], "resolution must be one of quick, standard, paper", "'qick'"),
        (["reproduce", "--tissues", "humann"], "tissues must be one of paper, trial1", "'humann'"),
        (["reproduce", "--jobs", "0"], "jobs must be a whole number of at least 1", "0"),
        (["reproduce", "--jobs", "1.5"], "'--jobs': must be a whole number", "'1.5'"),
        (["reproduce", "--seed", "-1"], "seed must be a whole number of at least 0", "-1"),
        (["reproduce", "--seed", "abc"], "'--seed': must be a whole number", "'abc'"),
        (["reproduce", "--seed"], "--seed", "requires an argument"),
        (["fit", "--example", "--resolution", "quick"], "'--example' requires an argument", "'--resolution'"),
        (["reproduce", "--quick"], "No such option: --quick; write --resolution quick", "quick"),
        (["export", "out", "--materials", "a"], "No such option: --materials; write --tissues", ""),
        (["export"], "Missing argument", "'FOLDER'"),
        (["store"], "store needs a command: list, verify, prune", "list"),
        (["store", "verify", "."], "FOLDER must hold stored indentations: . has none", "."),
        (["export", "out", "--elastic-moduli", "long_term"], "elastic_moduli is for calculix", "vtu"),
        (["export", "out", "--indenter", "cone"], "indenter must be one of sphere, cylinder, bar", "'cone'"),
        (["export", "out", "--indenter", "bar", "--curvature", "2"], "--curvature is that of", "bar"),
        (["export", "out", "--indenter", "sphere:3", "--curvature", "287"], "without a size", "sphere:3"),
        (["export", "out", "--indenter", "punch:wide"], "diameter_mm must be a finite number", "'wide'"),
        (["export", "out", "--curvature", "round"], "'--curvature': must be a number", "'round'"),
        (["export", "out", "--depth", "-1"], "depth_mm must lie within 0.001 to 20 mm", "-1"),
        (["export", "out", "--depth", "1", "--trajectory", "a.csv"], "--depth is that of a hold", "a.csv"),
        (["export", "out", "--tolerance", "0.02"], "--tolerance is that of a --trajectory", "give both"),
        (["export", "out", "--trajectory", "gone.csv"], "gone.csv must be a file", "No such file"),
        (["export", "out", "--touch", "gone.yaml"], "gone.yaml must be a file", "No such file"),
        (["export", "out", "--touch", "a.yaml", "--depth", "1"], "leave the other options", "a.yaml"),
        (["export", "out", "--format", "stl"], "format must be one of vtu", "'stl'"),
        (["reproduce", "twice"], "unexpected extra argument", "twice"),
        (["reproduse"], "No such command", "'reproduse'"),
        (["--resolution", "quick"], "No such option", "--resolution"),
    ],
    ids=lambda value: " ".join(value) if isinstance(value, list) else "",
)
def test_misuse_is_one_sentence_and_status_2_and_nothing_is_written(call, is_refused, arguments, named, came):
    is_refused(call(*arguments), "fingerpad", named, came)


@pytest.mark.parametrize(
    ("words", "package", "extra"),
    [
        (["export", "out"], "vtkmodules.vtkIOXML", "vtk"),
        (["export", "out", "--format", "netcdf"], "xarray", "netcdf"),
        (["lab", "--folder", "out"], "panel.custom", "lab"),
    ],
)
def test_without_its_extra_nothing_is_written(call, is_refused, monkeypatch, words, package, extra):
    monkeypatch.setitem(sys.modules, package, None)
    is_refused(call(*words), "fingerpad", "pip install", f"fingerpad[{extra}]")


def test_a_folder_that_cannot_be_is_named_and_what_is_there_stays(call, tmp_path):
    (tmp_path / "note").write_text("mine")
    for below in ("", "/deeper", "/deeper/still"):
        status, said, errors = call("reproduce", "--out", f"note{below}")
        assert (status, said, errors.count("\n")) == (2, "", 1)
        assert f"--out must be a writable folder: note{below} is not" in errors
    assert [path.name for path in tmp_path.iterdir()] == ["note"]
    assert (tmp_path / "note").read_text() == "mine"


@pytest.mark.parametrize(
    ("failure", "status", "said"),
    [
        (StoreError("x.npz cannot be read: delete it."), 2, "x.npz cannot be read: delete it."),
        (fp.ConvergenceError("No equilibrium at 3 ms.", ("at 3 ms: 40 steps",)), 2,
         "No equilibrium at 3 ms."),
        (KeyboardInterrupt(), 130, "stopped. The same command continues after the last"),
    ],
)  # fmt: skip
def test_a_failed_run_is_reported_without_a_traceback(call, monkeypatch, tmp_path, failure, status, said):
    def fail(*_):
        raise failure

    monkeypatch.setattr(gerling2014, "reproduce", fail)
    found, printed, errors = call("reproduce", "--out", "run")
    assert (found, printed) == (status, "")
    assert errors.splitlines()[-1].startswith(f"fingerpad: {said}")
    assert list((tmp_path / "run").iterdir()) == []


def test_options_reach_the_run(call, monkeypatch, tmp_path):
    runs = []

    def note(run, progress):
        runs.append(run)
        raise fp.FingerpadError("Enough.")

    monkeypatch.setattr(gerling2014, "reproduce", note)
    call("reproduce", "--resolution", "paper", "--out", "a/b", "--jobs", "3", "--seed", "7")
    call("reproduce")
    given, default = runs
    assert (given.resolution, given.seed, given.jobs) == ("paper", 7, 3)
    assert given.folder.resolve() == tmp_path / "a" / "b"
    assert (default.resolution, default.seed, default.tissues) == ("standard", 0, "paper")
    assert default.jobs >= 1
    assert default.folder.resolve() == tmp_path / "reproduction"


def test_options_reach_the_export(call, monkeypatch, tmp_path):
    exported = []

    def note(folder, touch, format_name, elastic_moduli):
        exported.append((touch, folder, format_name, elastic_moduli))
        return (folder / "touch.pvd",)

    monkeypatch.setattr(formats, "export_touch", note)
    given = ("--curvature", "340", "--depth", "0.5", "--tissues", "trial1", "--resolution", "standard")
    assert call("export", "a/b", *given) == (0, "Open: a/b/touch.pvd\n", "")
    assert call("export", "c", "--indenter", "plate", "--format", "vtu")[0] == 0
    assert call("export", "d", "--format", "calculix", "--elastic-moduli", "long_term")[0] == 0
    (tmp_path / "press.csv").write_text("time_ms,depth_mm\n0,0\n50,0.5\n100,0\n", encoding="utf-8")
    assert call("export", "e", "--trajectory", "press.csv")[0] == 0
    (tmp_path / "bent.csv").write_text("time_ms,depth_mm\n0,0\n25,0.26\n50,0.5\n", encoding="utf-8")
    assert call("export", "e", "--trajectory", "bent.csv")[0] == 0
    assert call("export", "e", "--trajectory", "bent.csv", "--tolerance", "0.05")[0] == 0
    (tmp_path / "touch.yaml").write_text("object: plate\nplace: {tilt_deg: 0}\n", encoding="utf-8")
    assert call("export", "f", "--touch", "touch.yaml")[0] == 0
    (touch, folder, format_name, _), (default, _, _, relaxing), (*_, elastic), *rest = exported
    (played, *_), (bent, *_), (straight, *_), (same, *_) = rest
    assert (len(bent.stimulus.times_ms), len(straight.stimulus.times_ms)) == (3, 2)
    assert same == default
    assert played.stimulus == fp.Trajectory((0.0, 50.0, 100.0), (0.0, 0.5, 0.0))
    assert (relaxing, elastic) == (None, "long_term")
    ball, motion = fp.Sphere(curvature_per_m=340), fp.RampAndHold(depth_mm=0.5)
    assert touch == fp.touch_of(fp.Fingertip(), ball, motion, "trial1", "standard")
    assert (folder.resolve(), format_name) == (tmp_path / "a" / "b", "vtu")
    assert default == fp.touch_of(fp.Fingertip(), fp.Plate(), fp.RampAndHold(depth_mm=1.0), "human", "quick")


def test_a_subprocess_has_the_same_output_and_no_warning(tmp_path):
    done = subprocess.run(
        [*COMMAND, "reproduce", "--seed", "abc"], cwd=tmp_path, capture_output=True, text=True, check=False
    )
    expected = "fingerpad: Invalid value for '--seed': must be a whole number: got 'abc'.\n"
    assert (done.returncode, done.stdout, done.stderr) == (2, "", expected)
    assert list(tmp_path.iterdir()) == []
