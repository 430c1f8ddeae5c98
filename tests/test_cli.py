"""The command line: output, errors and exit status."""

import inspect
import json
import re
import subprocess
import sys
from functools import partial
from pathlib import Path

import pytest

import fingerpad as fp
from fingerpad import __version__, cli
from fingerpad.cli import commands
from fingerpad.core.errors import StoreError
from fingerpad.data.tissues import DEFAULT_TISSUES
from fingerpad.experiments import run as runs
from fingerpad.experiments.conditions import Conditions
from fingerpad.experiments.requests.stimulus import FingerDescription
from fingerpad.experiments.runner import Runner
from fingerpad.experiments.schemas import request_schema
from fingerpad.geometry.bodies import INDENTERS

BALL = ["touch", "--object", "sphere"]


def of_requests():
    """Names of the commands that run a request."""
    return [name for name, row in commands.TABLE.items() if "out" in row]


@pytest.fixture
def call(monkeypatch, run_program):
    """Run the command line in this process, in an empty folder; a press or a reproduction fails the test."""
    monkeypatch.setattr(runs, "reproduce", pytest.fail)
    monkeypatch.setattr(Runner, "solve", pytest.fail)
    return partial(run_program, cli.main, "fingerpad")


def test_the_help_of_each_command_names_every_option_with_its_unit(call):
    assert call("--version") == (0, f"fingerpad {__version__}\n", "")
    status, summary, errors = call()
    assert (status, errors) == (2, "")
    assert call("--help") == (0, summary, "")
    for name, (what, _, _) in commands.COMMANDS.items():
        assert f"  {name} " in summary
        assert what in summary
        status, said, errors = call(name, "--help")
        assert (status, errors) == (0, "")
        words = " ".join(said.split())
        assert what in words
        assert {"--quiet", "--verbose"} <= set(words.split())
        for key, schema in request_schema(name)["properties"].items() if name in of_requests() else ():
            assert f"--{key} " in words
            assert " ".join(schema["description"].split()) in words, (name, key)
            unit = re.search(r"_(mm|ms|kpa|mn|deg)$", key)
            assert not unit or "[" in schema["description"] or key == "windows_ms", (name, key)


def test_help_is_quick_because_it_loads_no_library_of_numbers():
    for words in ("['--help']", "['touch', '--help']", "['discriminate', '--help']", "['--version']"):
        code = f"import sys, fingerpad.cli\ntry: fingerpad.cli.main({words})\nexcept SystemExit: pass\n"
        code += "print({'numpy', 'scipy', 'pydantic', 'yaml'} & set(sys.modules))"
        done = subprocess.run([sys.executable, "-c", code], capture_output=True, text=True, check=True)
        assert done.stdout.endswith("set()\n"), done.stdout


def test_one_set_of_tissues_is_the_default_everywhere():
    defaults = {
        name: request_schema(name)["properties"]["tissues"].get("default")
        for name in of_requests()
        if "tissues" in request_schema(name)["properties"]
    }
    assert defaults.pop("reproduce") == "paper"  # the first column; the default tissues are the second
    assert set(defaults) == {"touch", "scan", "fit", "discriminate", "validate", "reduce"}
    functions = [inspect.signature(function).parameters["tissues"] for function in (fp.indent, fp.touch_of)]
    found = {*defaults.values(), *(each.default for each in functions), Conditions().tissues}
    assert found | {FingerDescription().tissues} == {DEFAULT_TISSUES}
    assert Conditions().afferent == fp.Afferent() == fp.Population.grid().afferent
    assert all(getattr(fp.bodies, body.__name__) is body for body in INDENTERS.values())


@pytest.mark.parametrize(
    ("arguments", "named", "came"),
    [
        ([*BALL, "--depth_mm", "1"], "No such option: --depth_mm", ""),
        ([*BALL, "--frictoin", "1"], "No such option: --frictoin; write --friction", ""),
        ([*BALL, "--materials=a"], "No such option: --materials; write --tissues", ""),
        (["fit", "--stimulus", "3"], "No such option: --stimulus; write --stimuli.", ""),
        (["fit", "--stimulus_colum", "3"], "No such option: --stimulus_colum; write --stimulus-column.", ""),
        ([*BALL, "--resolution", "qick"], "resolution must be one of quick, standard, paper", "'qick'"),
        ([*BALL, "--tissues", "humann"], "tissues must be one of human, paper, trial1", "'humann'"),
        ([*BALL, "--jobs", "0"], "jobs must be a whole number of at least 1", "0"),
        ([*BALL, "--jobs", "1.5"], "--jobs: must be a whole number", "'1.5'"),
        ([*BALL, "--jobs", "2", "--scheduler", "tcp://none:1"], "leave one out", "--scheduler tcp://none:1"),
        ([*BALL, "--friction"], "--friction: expected one argument", ""),
        ([*BALL, "--friction", "--jobs", "1"], "--friction: expected one argument", ""),
        ([*BALL, "--friction", "rough"], "friction must be", "'rough'"),
        ([*BALL, "--motion.depth_mm"], "--motion.depth_mm: expected one argument", ""),
        ([*BALL, "--motion.depth_mm", "-1"], "motion.depth_mm must lie within 0.001 to 20 mm", "-1"),
        ([*BALL, "--motion.dept_mm", "1"], "motion.dept_mm is unknown: did you mean depth_mm?", ""),
        ([*BALL, "--friction.depth_mm", "1"], "friction", "depth_mm"),
        ([*BALL, "--object.kind.deep", "1"], "--object: kind must be one of sphere", "deep"),
        ([*BALL, "--object.curvature_per_m", "round"], "curvature_per_m must be a finite number", "'round'"),
        ([*BALL, "--outputs", "csv,stl"], "outputs[2] must be one of figures, csv", "'stl'"),
        ([*BALL, "--outputs", "febio", "--motion", "{kind: stroke, depth_mm: 1, speed_mm_per_s: 9, x_mm: 2}"],
         "febio decks move the indenter only along its axis", "febio"),
        ([*BALL, "--quiet", "--verbose"], "exclude each other", "--verbose"),
        (["touch", "--object", "wedge"], "must be one of sphere, cylinder, bar", "'wedge'"),
        (["touch", "--object", "punch:wide"], "diameter_mm must be a finite number", "'wide'"),
        (["touch"], "touch needs a file or options", "--help"),
        (["touch", "gone.yaml"], "gone.yaml must be a file", "No such file"),
        (["touch", "a.yaml", "b.yaml"], "unexpected extra argument", "b.yaml"),
        (["fit", "rates.csv", "--out", ""], "--out must not be empty", ""),
        (["fit", ""], "must not be empty", ""),
        (["reproduce", "--seed", "-1"], "seed must be a whole number of at least 0", "-1"),
        (["reproduce", "--seed", "abc"], "seed must be a whole number", "'abc'"),
        (["store"], "required: ACTION, FOLDER", ""),
        (["store", "verify", "."], "FOLDER must hold stored indentations: . has none", "."),
        (["init", "tuch"], "WHAT must be one of touch", "'tuch'"),
        (["reproduse"], "No such command: 'reproduse'; did you mean reproduce", ""),
        (["--resolution", "quick"], "No such option: --resolution", ""),
    ],
    ids=lambda value: " ".join(value) if isinstance(value, list) else "",
)  # fmt: skip
def test_misuse_is_one_sentence_and_status_2_and_nothing_is_written(call, tmp_path, arguments, named, came):
    status, said, errors = call(*arguments)
    assert (status, said) == (2, "")
    assert re.fullmatch(r"fingerpad: [^\n]*[^.][.?]\n", errors), errors
    assert named in errors
    assert came in errors
    assert list(tmp_path.iterdir()) == []


@pytest.mark.parametrize(
    ("words", "package", "extra"),
    [
        ([*BALL, "--outputs", "vtu"], "vtkmodules.vtkIOXML", "vtk"),
        ([*BALL, "--outputs", "netcdf"], "xarray", "netcdf"),
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

    monkeypatch.setattr(runs, "reproduce", fail)
    found, printed, errors = call("reproduce", "--out", "run")
    assert (found, printed) == (status, "")
    assert errors.splitlines()[-1].startswith(f"fingerpad: {said}")
    assert list((tmp_path / "run").iterdir()) == []


@pytest.fixture
def asked(call, monkeypatch):
    """Run a command up to its function: the request, and how it is run."""
    found = []

    def note(request, **how):
        found.append((request, how))
        raise fp.FingerpadError("Enough.")

    def run(*words):
        for name in of_requests():
            monkeypatch.setattr(fp, name, note, raising=False)
        status, said, errors = call(*words)
        assert (status, said, errors) == (2, "", "fingerpad: Enough.\n")
        return found.pop()

    return run


def test_options_reach_the_run(asked, tmp_path):
    given, how = asked("reproduce", "--resolution", "paper", "--out", "a/b", "--jobs", "3", "--seed", "7")
    assert (given.resolution, given.seed, how["jobs"]) == ("paper", 7, 3)
    assert how["out"].resolve() == tmp_path / "a" / "b"
    given, how = asked("--quiet", "reproduce")
    assert given == fp.ReproductionRequest.read({})
    assert how["jobs"] >= 1
    assert how["out"].resolve() == tmp_path / "reproduction"


def test_options_replace_keys_of_the_file_and_go_into_blocks(asked):
    Path("touch.yaml").write_text("object: plate\nmotion: {depth_mm: 0.4, hold_ms: 200}\ntissues: trial1\n")
    given, _ = asked(
        "touch", "touch.yaml", "--motion.depth_mm", "0.5", "--tissues=human", "--times-ms", "30,50",
        "--afferents.rows", "2", "--outputs", "csv,spikes", "--elastic_moduli", "instantaneous",
    )  # fmt: skip
    motion = {"depth_mm": 0.5, "hold_ms": 200}
    assert given == fp.TouchRequest.read(
        {
            "object": "plate", "motion": motion, "tissues": "human", "times_ms": [30, 50],
            "afferents": {"rows": 2}, "outputs": ["csv", "spikes"], "elastic_moduli": "instantaneous",
        }
    )  # fmt: skip
    Path("bars.csv").write_text("shift_mm,static_rate_hz\n" + "".join(f"{n},{9 * n}\n" for n in range(8)))
    given, _ = asked(
        "fit", "bars.csv", "--object", "bar", "--object.width_mm", "2", "--motion.depth_mm", "0.6",
        "--windows_ms.static", "600,950", "--no-posterior", "--folds", "4",
    )  # fmt: skip
    assert (given.recordings, given.folds, given.posterior) == ("bars.csv", 4, False)
    assert given.windows_ms.static == (600.0, 950.0)
    stimulus = given.presented.named("1")
    assert (stimulus.indenter, stimulus.motion.depth_mm) == (fp.Bar(width_mm=2.0), 0.6)


@pytest.mark.parametrize(
    ("hold_ms", "options", "said"),
    [
        ("200", ["--friction", "rough"], "--friction must be a finite number: got 'rough'."),
        ("200", ["--motion.depth_mm", "-1"], "--motion.depth_mm must lie within 0.001 to 20 mm: got -1"),
        ("200", ["--motion.dept_mm", "1"], "--motion.dept_mm is unknown: did you mean depth_mm?"),
        ("200", ["--times-ms", "20,soon"], "--times-ms must be an array of numbers"),
        ("200", ["--object.depth_mm", "1"], "--object.depth_mm is unknown: object has kind."),
        ("200", ["--object", "sphear"], "--object: indenter must be one of sphere, cylinder"),
        (
            "200",
            ["--object", "sphere", "--object.radius_mm", "0"],
            "--object.radius_mm must be greater than 0",
        ),
        ("long", ["--tissues", "human"], "touch.yaml, line 3, motion.hold_ms must"),
    ],
)
def test_an_error_names_the_option_that_replaces_a_key(call, hold_ms, options, said):
    motion = f"motion: {{depth_mm: 0.4, hold_ms: {hold_ms}}}\n"
    Path("touch.yaml").write_text(f"object: plate\nfriction: 0.1\n{motion}")
    status, _, errors = call("touch", "touch.yaml", *options)
    assert status == 2
    assert errors.startswith(f"fingerpad: {said}")


def test_a_keyword_that_replaces_a_key_is_not_blamed_on_the_file(tmp_path):
    (tmp_path / "touch.yaml").write_text("object: plate\nfriction: 0.1\n")
    with pytest.raises(fp.InputError, match=r"^friction must be a finite number"):
        fp.TouchRequest.read(tmp_path / "touch.yaml", {"friction": "rough"})


def test_a_file_names_objects_of_python_only_where_this_is_allowed(call, asked):
    Path("own_parts_of_cli.py").write_text("import fingerpad as fp\nball = fp.Sphere(radius_mm=4)\n")
    Path("own.yaml").write_text("object: own_parts_of_cli:ball\n")
    given, _ = asked("touch", "own.yaml", "--allow-python")
    assert given.touch.indenter == fp.Sphere(radius_mm=4)


def test_without_leave_no_python_is_run(call, tmp_path):
    Path("own_parts_unread.py").write_text("raise SystemExit('run')\n")
    Path("own.yaml").write_text("object: own_parts_unread:ball\n")
    for command in ("check", "touch"):
        status, said, errors = call(command, "own.yaml")
        assert (status, said) == (2, "")
        assert "own.yaml, line 1, object names an object of own_parts_unread.py" in errors
        assert "--allow-python" in errors
    assert {path.name for path in tmp_path.iterdir()} == {"own.yaml", "own_parts_unread.py"}


def test_every_example_can_be_written_and_is_possible(call):
    status, said, _ = call("init", "--list")
    assert status == 0
    names = [line.partition(":")[0] for line in said.splitlines()]
    assert {"touch", "recordings", "force", "sphere_curvature"} <= set(names)
    for name in names:
        status, said, errors = call("init", name, "--out", name)
        assert (status, errors) == (0, ""), name
        _, command, path = said.removeprefix("Try: ").split()
        assert Path(path).is_file()
        if command == "check":
            assert call(command, path)[::2] == (0, ""), name
        else:
            runs.REQUESTS[command].read(
                {{"fit": "recordings", "validate": "observations"}[command]: path}
            ).check()


def test_the_exit_status_says_what_is_incomplete(call, monkeypatch):
    found = type("Found", (), {"n_rows": 3, "n_predicted": 2, "lines": ("so",), "failed": 4, "done": False})()
    monkeypatch.setattr(commands, "_run_request", lambda *_, **__: found)
    monkeypatch.setattr("fingerpad.report.results.summary", lambda *_: ("so",))
    assert call("validate", "force.csv")[0] == commands.INCOMPLETE == 3
    content = {"touch": {"object": "sphere"}, "grid": {"motion.depth_mm": [0.2, 0.3]}}
    Path("sweep.yaml").write_text(json.dumps(content))
    assert call("sweep", "sweep.yaml")[0] == 14
    found.failed = 500
    assert call("sweep", "sweep.yaml")[0] == 99


def test_a_subprocess_has_the_same_output_and_no_warning(tmp_path):
    command = [sys.executable, "-W", "error", "-m", "fingerpad", "reproduce", "--jobs", "abc"]
    done = subprocess.run(command, cwd=tmp_path, capture_output=True, text=True, check=False)
    expected = "fingerpad: Argument --jobs: must be a whole number: got 'abc'.\n"
    assert (done.returncode, done.stdout, done.stderr) == (2, "", expected)
    assert list(tmp_path.iterdir()) == []
