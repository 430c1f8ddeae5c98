"""Files for ParaView, read back by VTK's own reader; tables of a touch, read back as well."""

import csv
import json
import sys
import warnings
import xml.etree.ElementTree as xml
from dataclasses import replace

import numpy as np
import pytest
import pyvista
from vtkmodules.util.numpy_support import vtk_to_numpy
from vtkmodules.vtkCommonCore import vtkVersion
from vtkmodules.vtkFiltersGeneral import vtkCellValidator
from vtkmodules.vtkFiltersVerdict import vtkCellSizeFilter
from vtkmodules.vtkIOXML import vtkXMLUnstructuredGridReader

import fingerpad as fp
from fingerpad.core.errors import StoreError
from fingerpad.export.vtu import HEXAHEDRON, WEDGE, cells_of
from fingerpad.geometry.mesh import Mesh, block_mesh
from fingerpad.geometry.mesh_checks import jacobian_at_gauss
from fingerpad.skin.indentation import Touch
from sections import SMALL_TOUCH as TOUCH

CELLS = (
    "stress_kpa", "strain", "green_lagrange_strain", "principal_stress_kpa", "principal_strain",
    "von_mises_kpa", "pressure_kpa", "compressive_strain", "compressive_stress_kpa",
)  # fmt: skip
WARPED = 16  # vtkCellValidator's flag for faces that are not quite plane


@pytest.fixture(scope="module")
def skin():
    return TOUCH.solve(whole=True)


@pytest.fixture(scope="module")
def files(skin, tmp_path_factory):
    index = skin.save(tmp_path_factory.mktemp("series") / "a & b.pvd")
    return index, *sorted(index.parent.glob("*.vtu"))


def read(path):
    reader = vtkXMLUnstructuredGridReader()
    reader.SetFileName(str(path))
    reader.Update()
    return reader.GetOutput()


def arrays(data):
    return {data.GetArrayName(n): vtk_to_numpy(data.GetArray(n)) for n in range(data.GetNumberOfArrays())}


def test_cells_are_bricks_and_wedges_of_the_right_volume_and_turned_the_right_way(files):
    grid, mesh = read(files[0].with_name("a & b_0000.vtu")), TOUCH.mesh
    assert (grid.GetNumberOfCells(), grid.GetNumberOfPoints()) == (len(mesh.elements), len(mesh.nodes_mm))
    kinds = np.array([grid.GetCellType(n) for n in range(grid.GetNumberOfCells())])
    repeats = np.array([len(set(nodes)) < 8 for nodes in mesh.elements.tolist()])
    assert (kinds == np.where(repeats, WEDGE, HEXAHEDRON)).all()
    assert repeats.any()
    validator = vtkCellValidator()
    validator.SetInputData(grid)
    validator.Update()
    state = vtk_to_numpy(validator.GetOutput().GetCellData().GetArray("ValidityState"))
    assert set(state[~repeats].tolist()) <= {0, WARPED}
    if (vtkVersion.GetVTKMajorVersion(), vtkVersion.GetVTKMinorVersion()) < (9, 7):
        pytest.skip("Before 9.7 VTK turned wedges the other way, and measured warped cells otherwise.")
    assert set(state[repeats].tolist()) == {0}
    sizes = vtkCellSizeFilter()
    sizes.SetInputData(grid)
    sizes.Update()
    volume = vtk_to_numpy(sizes.GetOutput().GetCellData().GetArray("Volume"))
    np.testing.assert_allclose(volume, jacobian_at_gauss(mesh).sum(axis=1), rtol=0.02)  # VTK: tetrahedra


def test_fields_come_back_at_every_time(skin, files):
    mesh, done = TOUCH.mesh, skin.deformation
    felt = done.fields
    index, *steps = files
    sets = xml.parse(index).getroot().findall("./Collection/DataSet")
    assert [float(item.get("timestep")) for item in sets] == done.times_ms.tolist() == [0, 25, 50, 1000]
    assert [index.parent / item.get("file") for item in sets] == steps
    with warnings.catch_warnings():
        warnings.simplefilter("ignore")
        reader = pyvista.get_reader(index)
    assert reader.time_values == done.times_ms.tolist()
    last = read(skin.save(index.with_name("end.vtu")))
    assert arrays(last.GetFieldData())["TimeValue"].tolist() == [1000.0]
    np.testing.assert_array_equal(arrays(last.GetCellData())["stress_kpa"], felt.stress_kpa[-1].astype("f4"))
    index.with_name("end.vtu").unlink()
    for number, path in enumerate(files[1:]):
        grid = read(path)
        cells, points = arrays(grid.GetCellData()), arrays(grid.GetPointData())
        expected = {name: getattr(felt, name)[number] for name in CELLS}
        expected |= {"layer": mesh.layer, "sed_stored_kpa": done.sed_kpa[number]}
        for name in ("instantaneous", "work"):
            expected[f"sed_{name}_kpa"] = getattr(felt, f"{name}_kpa")[number]
        assert set(cells) == set(expected)
        for name, values in expected.items():
            np.testing.assert_array_equal(cells[name], values.astype(cells[name].dtype), err_msg=name)
        np.testing.assert_array_equal(vtk_to_numpy(grid.GetPoints().GetData()), mesh.nodes_mm)
        np.testing.assert_array_equal(points["displacement_mm"], done.displacement_mm[number].astype("f4"))
        pressure = points["contact_pressure_kpa"]
        at_skin = done.contact.pressure_kpa[number].astype("f4")
        np.testing.assert_array_equal(pressure[mesh.skin_nodes], at_skin)
        assert (pressure.max() > 0.0) == (number > 0)
        for name in ("skin", "bone", "nail", "symmetry", "midline"):
            chosen = np.unique(getattr(mesh, f"{name}_nodes"))
            np.testing.assert_array_equal(np.flatnonzero(points[name]), chosen)
        overall = arrays(grid.GetFieldData())
        assert overall["TimeValue"].tolist() == [done.times_ms[number]]
        assert overall["force_mn"] == done.force_mn[number].astype("f4")
        assert overall["contact_area_mm2"] == done.contact.area_mm2[number].astype("f4")
        np.testing.assert_array_equal(overall["reaction_mn"], done.reaction_mn[[number]].astype("f4"))
        assert overall["dissipated_uj"] == done.energy.dissipated_uj[number].astype("f4")
        names = [grid.GetCellData().GetArray("stress_kpa").GetComponentName(k) for k in range(6)]
        assert names == ["XX", "YY", "ZZ", "XY", "YZ", "XZ"]


def test_element_that_is_neither_brick_nor_wedge_is_named():
    block = block_mesh([0.0, 1.0, 2.0], [0.0, 1.0], [0.0, 1.0], layers=[0])
    elements = block.elements.copy()
    elements[1, 4] = elements[1, 0]
    parts = {name: getattr(block, name) for name in Mesh.__dataclass_fields__}
    with pytest.raises(fp.InputError, match="element 1 has the nodes"):
        cells_of(Mesh(**(parts | {"elements": elements})))


def test_what_cannot_be_written_is_refused_and_nothing_is_pressed(skin, tmp_path, monkeypatch):
    with pytest.raises(fp.InputError, match=r"does not hold: solve the touch with whole=True\."):
        replace(skin, deformation=None).save(tmp_path / "other.pvd")
    monkeypatch.setattr(Touch, "solve", lambda touch, **_: pytest.fail("the touch was solved for nothing"))
    monkeypatch.setitem(sys.modules, "vtkmodules.vtkIOXML", None)
    monkeypatch.setitem(sys.modules, "xarray", None)
    with pytest.raises(fp.InputError, match=r"pip install 'fingerpad\[vtk\]'"):
        skin.save(tmp_path / "a.pvd")
    for format_name, said in (("vtu", "need the package vtk"), ("netcdf", r"'fingerpad\[netcdf\]'")):
        with pytest.raises(fp.InputError, match=said):
            fp.export_touch(tmp_path, TOUCH, format_name)
    assert list(tmp_path.iterdir()) == []
    for format_name, file_name in (("abaqus", "touch.inp"), ("febio", "touch.feb")):  # without a press
        (written,) = fp.export_touch(tmp_path, TOUCH, format_name)
        assert written == tmp_path / file_name
        assert written.stat().st_size > 10_000
    monkeypatch.undo()
    with pytest.raises(StoreError, match=r"touch\.inp"):
        skin.save(tmp_path / "touch.inp" / "a.pvd")


def test_a_touch_is_exported_by_the_name_of_a_format(skin, files, tmp_path, monkeypatch):
    monkeypatch.setattr(Touch, "solve", lambda touch, **_: skin)
    written = fp.export_touch(tmp_path, TOUCH, "vtu")
    assert written == (tmp_path / "touch.pvd",)
    assert [path.read_bytes() for path in sorted(tmp_path.glob("*.vtu"))] == [
        path.read_bytes() for path in files[1:]
    ]
    for format_name, file_name in (("netcdf", "touch.nc"), ("zarr", "touch.zarr")):
        folder = tmp_path / format_name
        assert fp.export_touch(folder, TOUCH, format_name) == (folder / file_name,)
        moved_mm = fp.read_touch(folder).displacement_mm
        np.testing.assert_array_equal(moved_mm, skin.deformation.displacement_mm.astype(np.float32))
    with pytest.raises(fp.InputError, match="format must be one of vtu"):
        fp.export_touch(tmp_path, TOUCH, "stl")


def test_table_of_a_touch_has_one_row_per_time_and_loses_no_digit(skin, tmp_path):
    (written,) = fp.export_touch(tmp_path, TOUCH, "csv")
    with written.open(encoding="utf-8", newline="") as file:
        rows = list(csv.DictReader(file))
    for name in ("times_ms", "force_mn", "depth_mm", "contact_area_mm2", "external_uj", "dissipated_uj"):
        assert [float(row[name]) for row in rows] == skin.fields[name].tolist()
    for axis, name in enumerate("xyz"):
        assert [float(row[f"reaction_mn_{name}"]) for row in rows] == skin.reaction_mn[:, axis].tolist()


def test_one_file_holds_force_depth_contact_surface_and_energy_density_with_their_mesh(skin, tmp_path):
    (written,) = fp.export_touch(tmp_path, TOUCH, "npz")
    with np.load(written) as file:
        units = json.loads(str(file["units"]))
        assert (units["contact_pressure_kpa"], units["skin_displacement_mm"]) == ("kPa", "mm")
        for name, values in skin.fields.items():
            held = file["time" if name == "times_ms" else name]
            np.testing.assert_array_equal(held, values.astype(held.dtype))
        # Pressure over the skin as it is then adds up to the force, all of it below the ball.
        placed = file["node_mm"][file["skin_node"]] + file["skin_displacement_mm"][-1]
        touched = file["contact_pressure_kpa"][-1] > 0.0
        assert np.hypot(placed[touched, 0] - 17.37, placed[touched, 2]).max() < 2.5
        np.testing.assert_array_equal(file["element_nodes"], TOUCH.mesh.elements)
        assert json.loads(str(file["attributes"]))["friction"] == TOUCH.friction
