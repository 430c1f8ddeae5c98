"""Stored touches are found by everything that determines them, and survive an interruption at any time."""

import os
import pickle
import re
import signal
import subprocess
import sys
from dataclasses import fields, is_dataclass, replace
from pathlib import Path

import numpy as np
import pytest
from vtkmodules.util.numpy_support import vtk_to_numpy
from vtkmodules.vtkIOXML import vtkXMLUnstructuredGridReader

import fingerpad
import fingerpad as fp
from cluster import wait_until
from fingerpad.cli import main
from fingerpad.core.errors import StoreError
from fingerpad.core.units import QUANTITY_UNITS
from fingerpad.mechanics.newton import NewtonSettings
from fingerpad.skin import code_hash
from fingerpad.skin.code_hash import MECHANICAL_SOURCES
from fingerpad.skin.fields import FIELDS, Field, Place, Times
from fingerpad.skin.indentation import Touch
from fingerpad.skin.sampling import SkinResponse
from fingerpad.skin.store import Store, _checksum, solve_missing, touch_key
from refusals import misused

COARSE = fp.Grading(
    17.37, 1.2, 1.2, 0.8, 0.8, largest_mm=6.0, stratum_corneum=1, living_epidermis=1, dermis=1, subcutis=1
)
TINY = Touch(
    finger=fp.Fingertip(),
    indenter=fp.Sphere(curvature_per_m=287.0),
    stimulus=fp.RampAndHold(depth_mm=0.1),
    tissues=fp.named_tissues("trial3"),
    grading=COARSE,
    settings=fp.PressSettings(ramp_steps=1, hold_steps=1),
)
HOPELESS = replace(TINY, settings=fp.PressSettings(1, 1, NewtonSettings(most_iterations=1)))
SIX = [
    replace(TINY, settings=fp.PressSettings(3, 3), stimulus=fp.RampAndHold(depth_mm=depth))
    for depth in (0.10, 0.12, 0.14, 0.16, 0.18, 0.20)
]
DOUBLE = {
    **dict.fromkeys(("times_ms", "force_mn", "depth_mm", "contact_area_mm2"), "t"),
    **dict.fromkeys(("contact_force_mn", "reaction_mn"), "t3"),
    **dict.fromkeys(("external_uj", "stored_uj", "dissipated_uj", "contact_uj"), "t"),
}
SINGLE = {
    "skin_displacement_mm": "ts3",
    **dict.fromkeys(("contact_pressure_kpa", "slip_mm"), "ts"),
    "shear_kpa": "ts3",
    "displacement_mm": "n3",
    "sed_kpa": "te",
    **dict.fromkeys(("von_mises_kpa", "compressive_stress_kpa"), "e"),
    **dict.fromkeys(("instantaneous", "work", "von_mises", "compressive_strain", "compressive_stress"), "tr"),
}
"""Arrays of a stored file: of times, skin nodes, nodes, elements, receptors' elements, components."""


@pytest.fixture(scope="module")
def skin():
    return TINY.solve()


@pytest.fixture
def stored(tmp_path, skin):
    """A store that holds one touch."""
    store = Store(tmp_path / "store")
    store.save(TINY, skin)
    return store


def leaves(value, path=()):
    """Every number, word and flag that makes a nested frozen value another one, with the way to it."""
    if is_dataclass(value):
        for field in filter(lambda field: field.compare, fields(value)):
            yield from leaves(getattr(value, field.name), (*path, field.name))
    elif isinstance(value, tuple):
        for place, item in enumerate(value):
            yield from leaves(item, (*path, place))
    else:
        yield path, value


def changed(value, path, leaf):
    """The same value with one leaf exchanged, checks or no checks."""
    if not path:
        return leaf
    first, rest = path[0], path[1:]
    if isinstance(value, tuple):
        return (*value[:first], changed(value[first], rest, leaf), *value[first + 1 :])
    copy = object.__new__(type(value))
    for field in fields(value):
        object.__setattr__(copy, field.name, getattr(value, field.name))
    object.__setattr__(copy, first, changed(getattr(value, first), rest, leaf))
    return copy


def nearest_other(leaf):
    """A value that differs by as little as its type allows."""
    if leaf is None:  # an option that is not given
        return 0.5
    if isinstance(leaf, bool):
        return not leaf
    if isinstance(leaf, int):
        return leaf + 1
    return float(np.nextafter(leaf, np.inf)) if isinstance(leaf, float) else leaf + "'"


def test_key_changes_with_the_last_bit_of_every_input():
    touch = replace(TINY, receptor_depths_mm=(1.2,))
    paths = dict(leaves(touch))
    named = {path[0] for path in paths}
    assert named == {field.name for field in fields(Touch) if field.compare}
    assert ("settings", "newton", "residual_tolerance") in paths
    keys = [touch_key(changed(touch, path, nearest_other(leaf))) for path, leaf in paths.items()]
    assert len({touch_key(TINY), touch_key(touch), *keys}) == 2 + len(paths)


def test_indenters_of_equal_numbers_have_different_keys():
    relaxing = replace(TINY.tissues.dermis, prony=fp.Prony((0.1,), (9.0,)))
    assert touch_key(replace(TINY, tissues=replace(TINY.tissues, dermis=relaxing))) != touch_key(TINY)
    straight = [kind(3.5) for kind in (fp.bodies.Line, fp.Cylinder, fp.Bar, fp.FlatPunch, fp.Edge)]
    bodies = [*straight, fp.Sphere(radius_mm=3.5), fp.Plate(), fp.Bar(3.5, 0.1)]
    assert len({touch_key(replace(TINY, indenter=body)) for body in bodies}) == len(bodies)


def test_equal_touches_have_one_key_whatever_their_numbers_were_written_as():
    again = Touch(
        finger=fp.Fingertip(),
        indenter=fp.Sphere(curvature_per_m=287),
        stimulus=fp.RampAndHold(depth_mm=np.float64(0.1), ramp_ms=50, hold_ms=950),
        tissues=fp.named_tissues("trial3"),
        grading=replace(COARSE, largest_mm=6),
        settings=fp.PressSettings(1, 1),
        at_mm=[17.37, -0.0],
        tilt_deg=-0.0,
    )
    assert again == TINY
    assert touch_key(again) == touch_key(TINY)


def test_key_is_the_same_in_another_process():
    code = "import pickle, sys; from fingerpad.skin.store import touch_key as key; "
    code += "print(key(pickle.load(sys.stdin.buffer)))"
    done = subprocess.run(
        [sys.executable, "-c", code],
        input=pickle.dumps(TINY),
        capture_output=True,
        check=True,
        env=os.environ | {"PYTHONHASHSEED": "12345"},
    )
    assert done.stdout.decode().strip() == touch_key(TINY)


def test_every_source_that_mechanics_imports_counts():
    """Apart from what cannot alter a number: checks, errors, other names, notices, results, inputs.

    Published values and meshes of files reach an indentation as its own fields, which are in the key already.
    """
    package = Path(fingerpad.__file__).parent
    files = [
        path
        for name in MECHANICAL_SOURCES
        for path in ((package / name).glob("*.py") if (package / name).is_dir() else [package / name])
    ]
    assert len(files) > 30
    imported = {
        module
        for path in files
        for module in re.findall(
            r"^\s*from fingerpad\.([\w.]+) import", path.read_text("utf-8"), re.MULTILINE
        )
    }
    counted = tuple(name.removesuffix(".py").replace("/", ".") for name in MECHANICAL_SOURCES)
    others = {module for module in imported if not module.startswith((*counted, "data"))}
    harmless = "checked compilation displayed errors files logger phases progress tables values"
    assert others <= {"skin.sampling", *(f"core.{name}" for name in harmless.split())}


def test_any_change_of_the_mechanical_sources_presses_again(monkeypatch, tmp_path):
    monkeypatch.setattr(code_hash, "files", lambda _: tmp_path)
    for name in MECHANICAL_SOURCES:
        (tmp_path / name).mkdir(exist_ok=True, parents=True)
    with pytest.raises(StoreError, match=r"installed without its \.py files"):
        code_hash.code_hash.__wrapped__()
    (tmp_path / "mechanics" / "law.py").write_text("POWER = 1.0")
    before = code_hash.code_hash.__wrapped__()
    (tmp_path / "mechanics" / "law.py").write_text("POWER = 1.1")
    assert code_hash.code_hash.__wrapped__() != before


def test_what_comes_back_is_what_went_in_rounded_to_single_precision(stored, skin):
    back = stored.load(TINY)
    assert list(back.fields) == list(skin.fields)
    assert set(skin.fields) == {*DOUBLE, *SINGLE}
    for name, went in skin.fields.items():
        came = back.fields[name]
        assert came.dtype == np.float64
        np.testing.assert_array_equal(came, went.astype(np.float32) if name in SINGLE else went)
    for field in fields(SkinResponse):
        if field.name not in ("mesh", "direction", "fields"):
            assert getattr(back, field.name) == getattr(skin, field.name)
    np.testing.assert_array_equal(back.direction, skin.direction)
    assert back.mesh is TINY.mesh
    assert (skin.sed_kpa != back.sed_kpa).any()  # or rounding would not have been tested
    content = stored.path(TINY).read_bytes()
    stored.save(TINY, back)
    assert stored.path(TINY).read_bytes() == content


def test_arrays_that_are_not_known_are_left_aside_and_a_missing_one_is_named(tmp_path):
    """The direction of pressing stood in files once; the area of contact did not."""
    store, mesh, rng = Store(tmp_path), TINY.mesh, np.random.default_rng(3)
    sizes = {"t": 4, "s": mesh.skin_nodes.size, "n": len(mesh.nodes_mm), "e": len(mesh.elements)}
    sizes |= {"r": mesh.living_epidermis.size, "3": 3}
    content = {
        name: rng.random([sizes[axis] for axis in axes]).astype(np.float32 if name in SINGLE else np.float64)
        for name, axes in {**DOUBLE, **SINGLE}.items()
    }
    solution = np.array([0.1, 0.2, 0.3, 4.0, 5.0])
    known = {"solution": solution, "linear_solver": np.array("multigrid")}
    write_signed(store.path(TINY), content | known | {"direction": np.array([0.0, 1.0, 0.0])})
    back = store.load(TINY)
    assert set(back.fields) == set(content)
    for name, values in content.items():
        np.testing.assert_array_equal(back.fields[name], values)
    assert (back.force_imbalance, back.energy_imbalance, back.penetration_mm) == (0.1, 0.2, 0.3)
    assert (back.newton_steps, back.factorisations, back.linear_solver) == (4, 5, "multigrid")
    assert back.direction.tolist() == [0.0, 1.0, 0.0]
    store.save(TINY, back)
    with np.load(store.path(TINY)) as file:
        assert {name: file[name].dtype for name in content} == {
            name: values.dtype for name, values in content.items()
        }
        np.testing.assert_array_equal(file["solution"], solution)
    del content["contact_area_mm2"]
    write_signed(store.path(TINY), content | known)
    with pytest.raises(StoreError, match=r"contact_area_mm2.*: run again, which sets it aside\."):
        store.load(TINY)


def test_one_declaration_is_stored_loaded_sampled_and_exported(tmp_path, monkeypatch):
    declared = Field(
        "pore_pressure",
        "kPa",
        "pressure of the fluid in the pores",
        Place.WATCHED,
        lambda deformation, _: deformation.fields.pressure_kpa,
        stored=Times.ALL,
        sampled="pore_pressure",
        exported="pore_pressure_kpa",
    )
    monkeypatch.setitem(FIELDS, declared.name, declared)
    monkeypatch.setitem(QUANTITY_UNITS, declared.name, declared.unit)  # traces of the neural half name it too
    store, skin = Store(tmp_path), TINY.solve(whole=True)
    solve_missing(store.missing([TINY]), jobs=1)
    back = store.load(TINY)
    elements = TINY.mesh.living_epidermis.ravel()
    pressure = skin.deformation.fields.pressure_kpa[:, elements].astype(np.float32)
    np.testing.assert_array_equal(back.fields["pore_pressure"], pressure)
    middle = TINY.mesh.nodes_mm[TINY.mesh.elements[elements]].mean(axis=1)
    under = middle[np.hypot(middle[:, 0] - 17.37, middle[:, 2]) < 3.0][:, [0, 2]]
    sampled = back.sample("pore_pressure", under)
    assert sampled.shape == (back.times_ms.size, len(under))
    assert sampled[-1].max() > 0.5 * pressure[-1].max() > 0.0
    assert back.sed(under, dynamic_quantity="pore_pressure").dynamic_quantity == "pore_pressure"
    reader = vtkXMLUnstructuredGridReader()
    reader.SetFileName(str(skin.save(tmp_path / "press.vtu")))
    reader.Update()
    written = vtk_to_numpy(reader.GetOutput().GetCellData().GetArray("pore_pressure_kpa"))
    np.testing.assert_array_equal(written, skin.deformation.fields.pressure_kpa[-1].astype(np.float32))
    np.testing.assert_array_equal(back.to_dataset()["pore_pressure"], pressure)


def test_fields_that_are_not_declared_or_have_another_shape_are_refused(skin):
    with pytest.raises(fp.InputError, match=r"field must be one of times_ms, .*: got 'heat'"):
        skin.with_fields(heat=skin.force_mn)
    with pytest.raises(fp.InputError, match=r"Field force_mn must have the shape \(3,\): got \(2,\)"):
        skin.with_fields(force_mn=skin.force_mn[1:])
    with pytest.raises(fp.InputError, match="Field depth_mm must be finite everywhere"):
        skin.with_fields(depth_mm=np.full(3, np.inf))


def test_only_the_touch_itself_is_held(stored):
    assert stored.holds(TINY)
    assert not stored.holds(SIX[0])
    with pytest.raises(StoreError, match="cannot be read"):
        stored.load(SIX[0])
    assert not Store(stored.folder / "elsewhere").holds(TINY)


def content_of(path):
    with np.load(path) as file:
        return {name: file[name] for name in file.files if name not in ("key", "checksum")}


def write_signed(path, content):
    """Write arrays with the key and the checksum that they should have."""
    checksum = _checksum(path.stem, content)
    with open(path, "wb") as file:
        np.savez(file, **content, key=np.array(path.stem), checksum=np.array(checksum))


def without(name):
    def rewrite(path):
        write_signed(path, {key: array for key, array in content_of(path).items() if key != name})

    return rewrite


def with_array(name, array):
    return lambda path: write_signed(path, content_of(path) | {name: array})


def edited(path):
    """Change a number and leave the checksum as it was."""
    with np.load(path) as file:
        content = {name: file[name] for name in file.files}
    with open(path, "wb") as file:
        np.savez(file, **content | {"force_mn": 2.0 * content["force_mn"]})


def unsigned(path):
    np.savez(path, **content_of(path))


def one_bit_in_the_middle(path):
    content = bytearray(path.read_bytes())
    content[len(content) // 2] ^= 1
    path.write_bytes(content)


def an_array_of_its_own(path):
    with open(path, "wb") as file:
        np.save(file, np.zeros(3))


def a_folder(path):
    path.unlink()
    path.mkdir()


DAMAGES = {
    "edited": edited,
    "of an older version": unsigned,
    "half": lambda path: path.write_bytes(path.read_bytes()[: path.stat().st_size // 2]),
    "one bit": one_bit_in_the_middle,
    "text": lambda path: path.write_text("not a result\n"),
    "pickle": lambda path: path.write_bytes(pickle.dumps({"sed_kpa": [1.0]})),
    "array": an_array_of_its_own,
    "folder": a_folder,
    "array missing": without("sed_kpa"),
    "linear solver missing": without("linear_solver"),
    "solution of other shape": with_array("solution", np.zeros(2)),
    "times of other shape": with_array("times_ms", np.zeros((3, 1))),
    "one force too few": with_array("force_mn", np.zeros(2)),
    "other mesh": with_array("sed_kpa", np.zeros((3, 7))),
    "not a number": with_array("force_mn", np.array([0.0, np.nan, 1.0])),
    "words": with_array("force_mn", np.array(["a", "b", "c"])),
}


@pytest.mark.parametrize("damage", DAMAGES.values(), ids=DAMAGES)
def test_a_damaged_file_is_named_in_one_sentence(stored, damage):
    path = stored.path(TINY)
    damage(path)
    with pytest.raises(StoreError) as refusal:
        stored.load(TINY)
    said = str(refusal.value)
    assert str(path) in said
    assert said.endswith(": run again, which sets it aside.")
    assert "\n" not in said


@pytest.mark.parametrize("damage", ["edited", "one bit", "half", "text", "folder", "of an older version"])
def test_a_damaged_file_is_set_aside_and_computed_again(stored, caplog, damage):
    path = stored.path(TINY)
    known = stored.load(TINY)
    DAMAGES[damage](path)
    missing = stored.missing([TINY])
    assert list(missing) == [path]
    (line,) = [record.getMessage() for record in caplog.records]
    assert str(path) in line
    assert "computed again" in line
    assert path.with_name(f"{path.name}.damaged").exists()
    solve_missing(missing, 1)
    np.testing.assert_array_equal(stored.load(TINY).force_mn, known.force_mn)
    assert stored.missing([TINY]) == {}


def test_a_file_of_another_touch_is_noticed(stored, skin):
    stored.save(SIX[0], skin)
    stored.path(TINY).write_bytes(stored.path(SIX[0]).read_bytes())
    with pytest.raises(StoreError, match="it is the result of another touch"):
        stored.load(TINY)
    assert set(stored.missing([TINY, SIX[0]])) == {stored.path(TINY)}


def test_the_command_lists_verifies_and_prunes(stored, skin, run_program, caplog):
    stored.save(SIX[0], skin)
    os.utime(stored.path(SIX[0]), (0.0, 0.0))

    def call(*words):
        return run_program(main, "fingerpad", "store", *words)

    status, said, _ = call("list", stored.folder)
    assert status == 0
    assert said.splitlines()[0].startswith(stored.path(SIX[0]).stem)
    assert said.splitlines()[-1].startswith("2 indentations, ")
    assert call("verify", stored.folder)[:2] == (0, "2 indentations, 0 damaged\n")
    edited(stored.path(TINY))
    status, said, _ = call("verify", stored.folder)
    assert status == 1
    assert said == f"{stored.path(TINY)}: its content has another checksum\n2 indentations, 1 damaged\n"
    assert call("prune", stored.folder, "--days", 30)[1].startswith("1 of 2 indentations")
    assert len(stored.files()) == 2  # --yes was not given
    assert call("prune", stored.folder, "--days", 30, "--yes")[0] == 0
    assert [file.path for file in stored.files()] == [stored.path(TINY)]
    assert call("prune", stored.folder, "--size", 0, "--yes")[0] == 0
    assert stored.files() == []
    for words, expected in (
        (("prune", stored.folder), "prune needs --days, --size or both"),
        (("list", stored.folder / "none"), "must hold stored indentations"),
        (("prune", stored.folder, "--days", -1), "must not be negative"),
    ):
        misused(call(*words), expected)


def test_any_byte_changed_is_noticed_or_harmless(stored):
    path, before = stored.path(TINY), stored.load(TINY)
    content, generator = path.read_bytes(), np.random.default_rng(1)
    # Most bytes are data, which a checksum guards; headers and the directory at the end need a closer look.
    places = np.concatenate([generator.integers(0, len(content), 40), generator.integers(-800, 300, 160)])
    noticed = 0
    for place in places:
        changed_bytes = bytearray(content)
        changed_bytes[place] ^= int(generator.integers(1, 256))
        path.write_bytes(changed_bytes)
        try:
            back = stored.load(TINY)
        except StoreError:
            noticed += 1
        else:
            assert all((back.fields[name] == values).all() for name, values in before.fields.items())
    assert noticed > len(places) // 4


def test_a_store_that_cannot_be_written_is_an_error(tmp_path, skin):
    (tmp_path / "file").write_text("in the way")
    store = Store(tmp_path / "file" / "store")
    assert not store.holds(TINY)
    with pytest.raises(StoreError, match="cannot be written") as refusal:
        store.save(TINY, skin)
    assert str(store.path(TINY)) in str(refusal.value)
    with pytest.raises(StoreError, match="cannot be written"):
        solve_missing(store.missing([TINY]), jobs=1)


@pytest.mark.parametrize("failure", [KeyboardInterrupt(), OSError(28, "No space left on device")])
def test_a_save_that_is_cut_short_leaves_nothing(tmp_path, monkeypatch, skin, failure):
    def fail(*_):
        raise failure

    store = Store(tmp_path)
    monkeypatch.setattr(os, "replace", fail)
    with pytest.raises((KeyboardInterrupt, StoreError)):
        store.save(TINY, skin)
    assert not store.holds(TINY)
    assert list(tmp_path.iterdir()) == []


def test_the_rest_of_a_killed_write_does_not_count(stored):
    path = stored.path(TINY)
    unfinished = path.with_name(f".{path.name}.0123456789abcdef.part")
    path.rename(unfinished)
    assert not stored.holds(TINY)
    solve_missing(stored.missing([TINY]), jobs=1)
    assert path.read_bytes() == unfinished.read_bytes()


@pytest.fixture(scope="module")
def uninterrupted(tmp_path_factory):
    """Store in which the six touches were solved in turn, in this process."""
    store = Store(tmp_path_factory.mktemp("uninterrupted"))
    solve_missing(store.missing(SIX), jobs=1)
    assert not store.missing(SIX)
    return store


def contents(store):
    return {path.name: path.read_bytes() for path in store.folder.glob("*.npz")}


def test_each_missing_touch_is_computed_once_and_reported(stored, monkeypatch):
    solved, solve = [], Touch.solve

    def noted(touch, threads):
        solved.append(touch)
        return solve(touch, threads)

    monkeypatch.setattr(Touch, "solve", noted)
    seconds: list[float] = []
    deeper = replace(TINY, stimulus=fp.RampAndHold(depth_mm=0.11))
    missing = stored.missing([deeper, TINY, deeper, TINY])
    assert missing == {stored.path(deeper): deeper}
    solve_missing(missing, 1, seconds.append)
    assert solved == [deeper]
    assert len(seconds) == 1
    assert seconds[0] > 0.0
    assert not stored.missing([deeper, TINY])
    solve_missing({}, 1, seconds.append)
    assert len(seconds) == 1


def test_two_processes_write_the_same_bytes_as_one(tmp_path, uninterrupted):
    store, seconds = Store(tmp_path), []
    environment = dict(os.environ)
    solve_missing(store.missing([*SIX[:3], *SIX[:3]]), 2, seconds.append)
    assert len(seconds) == 3
    assert dict(os.environ) == environment
    expected = contents(uninterrupted)
    assert contents(store) == {store.path(touch).name: expected[store.path(touch).name] for touch in SIX[:3]}


@pytest.mark.parametrize("jobs", [1, 2])
def test_what_does_not_converge_raises_and_is_not_stored(tmp_path, skin, jobs):
    store = Store(tmp_path)
    with pytest.raises(fp.ConvergenceError) as failure:
        solve_missing(store.missing([TINY, HOPELESS]), jobs)
    assert failure.value.history
    assert not store.holds(HOPELESS)
    wait_until(lambda: store.holds(TINY))  # what is under way in another process is finished and kept
    assert os.listdir(tmp_path) == [store.path(TINY).name]
    assert not store.missing([TINY])


@pytest.mark.parametrize("jobs", [1, 2])
def test_what_does_not_converge_is_told_and_the_others_are_stored(tmp_path, jobs):
    store, failed, seconds = Store(tmp_path), {}, []
    solve_missing(store.missing([HOPELESS, TINY]), jobs, seconds.append, failed.__setitem__)
    assert list(failed) == [HOPELESS]
    assert failed[HOPELESS].history
    assert os.listdir(tmp_path) == [store.path(TINY).name]
    assert len(seconds) == 1


SCRIPT = """
import pickle, sys
from pathlib import Path
from fingerpad.skin.store import Store, solve_missing

if __name__ == "__main__":
    touches = pickle.loads(Path(sys.argv[1]).read_bytes())
    solve_missing(Store(Path(sys.argv[2])).missing(touches), jobs=2)
"""


def group_lives(group):
    try:
        os.killpg(group, 0)
    except ProcessLookupError:
        return False
    return True


@pytest.mark.skipif(sys.platform == "win32", reason="kill -9 and process groups are POSIX")
@pytest.mark.parametrize("kill", [os.kill, os.killpg], ids=["parent only", "whole group"])
def test_a_run_killed_at_any_moment_goes_on_and_ends_with_the_same_bits(tmp_path, uninterrupted, kill):
    (tmp_path / "script.py").write_text(SCRIPT)
    (tmp_path / "touches").write_bytes(pickle.dumps(SIX))
    store = Store(tmp_path / "store")
    run = subprocess.Popen(
        [sys.executable, tmp_path / "script.py", tmp_path / "touches", store.folder], start_new_session=True
    )
    try:
        wait_until(lambda: run.poll() is not None or contents(store))
        assert run.poll() is None
        kill(run.pid, signal.SIGKILL)
        assert run.wait() == -signal.SIGKILL
        wait_until(lambda: not group_lives(run.pid), limit_s=10.0)  # workers notice within a second
    finally:
        if group_lives(run.pid):
            os.killpg(run.pid, signal.SIGKILL)
    finished = {path.name: path.stat().st_mtime_ns for path in store.folder.glob("*.npz")}
    assert 0 < len(finished) < len(SIX)
    assert contents(store).items() <= contents(uninterrupted).items()

    missing = store.missing(SIX)
    assert len(missing) == len(SIX) - len(finished)
    solve_missing(missing, jobs=1)
    assert contents(store) == contents(uninterrupted)
    later = {path.name: path.stat().st_mtime_ns for path in store.folder.glob("*.npz")}
    assert finished.items() <= later.items()
