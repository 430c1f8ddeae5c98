"""A touch as one labelled data set: read back without a loss, and whatever else a file may be, refused."""

import json
import re
import sys
from dataclasses import replace
from pathlib import Path

import h5py
import numpy as np
import pytest
import xarray

import fingerpad as fp
from fingerpad.core.errors import StoreError
from fingerpad.export import results
from fingerpad.export.touch_file import PARTS, check_touch, spike_trains
from fingerpad.skin.fields import Place, stored_fields
from sections import SMALL_TOUCH as TOUCH

RESPONSE = fp.ResponseMap(
    positions_mm=[[17.0, 0.0], [18.0, 1.0], [19.0, -1.0]],
    pitch_mm=1.0,
    spikes=fp.SpikeTrains.from_lists([[12.5, 40.0, 300.0], [], [41.0]]),
    dynamic_rate_hz=[36.4, 0.0, 0.0],
    static_rate_hz=[3.8, 0.0, 0.0],
    first_spike_latency_ms=[12.5, np.nan, 41.0],
)


@pytest.fixture(scope="module")
def skin():
    return TOUCH.solve(whole=True)


@pytest.fixture(scope="module")
def file(skin, tmp_path_factory):
    return skin.save(tmp_path_factory.mktemp("touch") / "touch.nc", response=RESPONSE, seed=7)


@pytest.fixture(scope="module")
def written(file):
    return fp.read_touch(file)


@pytest.mark.parametrize("file_name", ["touch.nc", "touch.zarr"])
def test_what_is_written_is_read_back(skin, tmp_path, file_name):
    written = skin.to_dataset(RESPONSE, quantities=("stress",))
    path = skin.save(tmp_path / file_name, response=RESPONSE, quantities=("stress",))
    assert path == tmp_path / file_name
    again = fp.read_touch(tmp_path)
    xarray.testing.assert_equal(written, again)
    assert written.sizes == again.sizes
    assert [path.name for path in tmp_path.iterdir()] == [file_name]
    for name, variable in again.variables.items():
        assert variable.attrs["long_name"], name
        assert ("units" in variable.attrs) != (name in PARTS and PARTS[name].unit == ""), name
    skin.save(tmp_path / file_name)  # an older file is replaced as a whole
    assert "spike_count" not in fp.read_touch(tmp_path)
    assert [path.name for path in tmp_path.iterdir()] == [file_name]


def test_every_stored_field_has_its_values_and_unit(skin, written):
    data = written
    for field in stored_fields():
        held = data["time" if field.name == "times_ms" else field.name]
        values = skin.fields[field.name]
        last = held.values[-1] if field.name == "displacement_mm" else held.values
        expected = values if field.place is Place.PRESS else values.astype(np.float32)
        np.testing.assert_array_equal(last, expected)
        assert held.units in (field.unit, {"mm²": "mm2", "µJ": "uJ", "": "1"}.get(field.unit))
        assert held.long_name == field.long_name
    np.testing.assert_allclose(data.displacement_mm, skin.deformation.displacement_mm, atol=1e-6)


def test_attributes_describe_the_touch_and_its_spikes(file, written):
    attributes = written.attrs
    assert json.loads(attributes["indenter"]) == {"class": "Sphere", "curvature_per_m": 287}
    assert json.loads(attributes["motion"])["depth_mm"] == 0.3
    assert json.loads(attributes["tissues"])["dermis"]["law"]["class"] == "Polynomial"
    assert [phase["name"] for phase in json.loads(attributes["phases"])] == ["ramp", "hold"]
    assert (attributes["seed"], attributes["half_finger"]) == (7, 1)
    assert re.fullmatch(r"fingerpad [\d.]+", attributes["source"])
    assert written.spike_count.sample_dimension == "spike"
    assert written.spike_count.values.tolist() == [3, 0, 1]
    trains = [train.tolist() for train in spike_trains(written)]
    assert trains == [train.tolist() for train in RESPONSE.spikes]
    with h5py.File(file) as opened:  # as any program of NetCDF
        assert opened["contact_area_mm2"].attrs["units"] == "mm2"


def test_the_object_lies_where_the_press_had_it(skin, file):
    """No node of the skin penetrates the mapped face by more than the press says; one is at it."""
    data = fp.read_touch(file)
    skin_mm = data.node_mm.values[data.skin_node] + data.skin_displacement_mm.values
    beside = np.array([0.0, 1.0, 2.0])
    mapped = data.object_front_mm.interp(object_x=0.0, object_z=beside).values
    radius = fp.Sphere(curvature_per_m=287).radius_mm
    np.testing.assert_allclose(mapped, np.sqrt(radius**2 - beside**2) - radius, atol=1e-3)
    for step in range(1, data.time.size):
        local = (skin_mm[step] - data.object_tip_mm.values[step]) @ data.object_axes.values[step]
        gap = fp.Sphere(curvature_per_m=287).gap(local)[0]
        assert -1.1 * skin.penetration_mm <= gap.min() <= 1e-5


def test_without_the_deformation_the_last_displacement_is_there(skin, monkeypatch):
    without = replace(skin, deformation=None)
    data = without.to_dataset()
    assert data.displacement_mm.dims == ("node", "axis")
    assert data.displacement_mm.at_time_ms == 1000.0
    with pytest.raises(fp.InputError, match=r"quantity stress needs .* whole=True"):
        without.to_dataset(quantities=("stress",))
    with pytest.raises(fp.InputError, match="quantity must be one of"):
        skin.to_dataset(quantities=("stres",))
    monkeypatch.setitem(sys.modules, "xarray", None)
    with pytest.raises(fp.InputError, match=r"needs xarray: .*fingerpad\[netcdf\]"):
        skin.to_dataset()


@pytest.mark.parametrize("name", ["touch.nc", "touch.zarr"])
def test_a_killed_write_leaves_nothing(skin, tmp_path, name, monkeypatch):
    def fails(*args, **options):
        raise OSError("no space")

    monkeypatch.setattr(results, "write_atomically", fails)
    monkeypatch.setattr(Path, "rename", fails)
    with pytest.raises((OSError, StoreError), match="no space"):
        skin.save(tmp_path / name)
    assert list(tmp_path.iterdir()) == []


def test_no_place_to_write_and_no_known_ending_are_refused(skin, tmp_path):
    (tmp_path / "file").write_text("")
    for name in ("touch.nc", "touch.zarr"):
        with pytest.raises(StoreError, match="cannot be written"):
            skin.save(tmp_path / "file" / name)
    with pytest.raises(fp.InputError, match=r"A SkinResponse is saved as .csv, .*\.zarr, .*: got touch.h5"):
        skin.save(tmp_path / "touch.h5")


def test_a_file_that_was_written_before_a_column_was_added_is_read(skin, tmp_path, written):
    older = written.drop_vars("recruitment_rank")
    older.to_netcdf(tmp_path / "touch.nc", engine="h5netcdf")
    assert set(fp.read_touch(tmp_path).variables) == set(older.variables)


def _changed(change):
    """Return the touch with one change in the data set, as a file would hold it."""
    return lambda path, data: change(data)


def _with_value(name, value):
    def change(data):
        values = data[name].values.copy()
        values.flat[1] = value
        return data.assign({name: (data[name].dims, values, data[name].attrs)})

    return _changed(change)


def _with_attribute(name, key, value):
    return _changed(lambda data: data.assign({name: data[name].assign_attrs({key: value})}))


def _bytes(content):
    def make(path, data):
        (path / "touch.nc").write_bytes(content(Path(data.encoding["source"]).read_bytes()))
        return path / "touch.nc"

    return make


def _renamed(path, data):
    """A file of spikes, which is HDF5 as well."""
    (path / "touch.nwb").write_bytes(Path(data.encoding["source"]).read_bytes())
    return path / "touch.nwb"


def _other_program(path, data):
    xarray.Dataset({"t": ("x", [1.0, 2.0])}).to_netcdf(path / "touch.nc", engine="h5netcdf")
    return path


def _empty_zarr(path, data):
    (path / "touch.zarr").mkdir()
    return path / "touch.zarr"


def _damaged_zarr(path, data):
    data[["time", "depth_mm"]].to_zarr(path / "touch.zarr", consolidated=False)
    (path / "touch.zarr" / "zarr.json").write_text("{")
    return path


MALFORMED = {
    "no such file": (lambda path, data: path / "none.nc", "there is no such file"),
    "a folder without a touch": (lambda path, data: path, r"must hold touch.nc or touch.zarr"),
    "a device": (lambda path, data: Path("/dev/null"), "neither"),
    "empty": (_bytes(lambda content: b""), "cannot be read"),
    "half of the file": (_bytes(lambda content: content[: len(content) // 2]), "cannot be read"),
    "zeros": (_bytes(lambda content: content[:600] + bytes(3000) + content[3600:]), "cannot be read|mu"),
    "another ending": (_renamed, "its name has another ending"),
    "a file of another program": (_other_program, "must be a touch that fingerpad wrote"),
    "an empty store": (_empty_zarr, "cannot be read|another content"),
    "a damaged store": (_damaged_zarr, "cannot be read"),
    "another version": (
        _changed(lambda data: data.assign_attrs(format_version=99)), "format_version 1: got 99"),
    "no time": (_changed(lambda data: data.drop_vars("time")), "variable time: it is missing"),
    "half of the object": (
        _changed(lambda data: data.drop_vars("object_axes")), "variable object_axes: it is missing"),
    "another unit": (_with_attribute("sed_kpa", "units", "MPa"), "the unit 'kPa': got 'MPa'"),
    "NaN": (_with_value("sed_kpa", np.nan), "variable sed_kpa must be finite"),
    "a node that does not exist": (
        _with_value("element_nodes", 10**6), "element_nodes must hold whole numbers"),
    "time that falls": (_changed(lambda data: data.isel(time=[0, 2, 1])), "time must increase from 0"),
    "text for numbers": (
        _changed(lambda data: data.assign(
            depth_mm=("time", np.full(data.time.size, "deep"), data.depth_mm.attrs))), "must hold numbers"),
    "other dimensions": (
        _changed(lambda data: data.assign(sed_kpa=(("node",), np.zeros(data.node.size), data.sed_kpa.attrs))),
        "must have the dimensions"),
    "a field along the wrong dimension": (
        _changed(lambda data: data.assign(slip_mm=data.sed_kpa.assign_attrs(units="mm"))),
        "must have the dimensions"),
    "spikes that are not counted": (
        _with_value("spike_count", 9), "spike_count must add up to the 4 of spike"),
    "no side": (
        _changed(lambda data: data.assign_attrs(half_finger=3)), "half_finger must be 0 or 1: got 3"),
    "an impossible name": (lambda path, data: Path("a\0b"), "must be a file or folder that can be read"),
    "spikes in disorder": (_with_value("spike_time_ms", 400.0), "spike_time_ms must increase"),
}  # fmt: skip


@pytest.mark.parametrize("case", MALFORMED)
@pytest.mark.filterwarnings("ignore")
def test_a_malformed_file_is_refused_in_one_sentence(case, written, tmp_path):
    make, message = MALFORMED[case]
    made = make(tmp_path, written)
    with pytest.raises(fp.InputError, match=message) as refused:
        check_touch(f"{tmp_path}", made) if isinstance(made, xarray.Dataset) else fp.read_touch(made)
    said = str(refused.value)
    assert "\n" not in said
    assert said.endswith(".")
    assert str(tmp_path) in said or "/dev/" in said or repr("a\0b") in said
