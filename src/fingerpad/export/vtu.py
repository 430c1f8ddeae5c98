"""Deformation over time as VTU files and a PVD index, which ParaView opens as a time series.

One VTU per time holds the undeformed points with their displacement (shown by ParaView's "Warp By Vector"),
the fields of the cells, and the sets of nodes. The PVD lists the files with their times in ms. Bricks are
VTK_HEXAHEDRON, collapsed ones VTK_WEDGE. The package `vtk`, of the extra `fingerpad[vtk]`, writes the files.
"""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass
from pathlib import Path
from typing import Any
from xml.etree import ElementTree
from xml.sax.saxutils import quoteattr

import numpy as np

from fingerpad.core.checked import checked
from fingerpad.core.errors import InputError
from fingerpad.core.files import path_of, read_text, write_atomically
from fingerpad.core.values import FloatArray
from fingerpad.export.dataset import library
from fingerpad.export.job import wedge_nodes
from fingerpad.geometry.mesh import Mesh
from fingerpad.mechanics.press import Deformation
from fingerpad.skin.fields import FIELDS, Place
from fingerpad.skin.sampling import SkinResponse

HEXAHEDRON, WEDGE = 12, 13  # VTK's numbers of the two cells.

AXES = ("XX", "YY", "ZZ", "XY", "YZ", "XZ")
"""Components of a tensor, in the order of ours and of ParaView's symmetric tensors."""


def write_vtu_series(path: Path, skin: SkinResponse) -> tuple[Path, ...]:
    """Write an indentation for ParaView.

    The exported fields are those of `skin.fields.FIELDS`. Cell data: layer; energy densities stored,
    instantaneous and work; Cauchy stress, logarithmic and Green-Lagrange strain; their principal values; von
    Mises stress, pressure, largest compressive strain and stress. Point data: displacement, contact pressure,
    and the sets skin, bone, nail, symmetry and midline as masks. Field data: time, depth and force of the
    indenter, area of contact, reaction of bone and nail, and energies.
    """
    require_vtk()
    path = path_of("path", path)
    if skin.deformation is None:
        raise InputError(
            "VTU files show all nodes and elements over time, which this response does not hold: solve the "
            "touch with whole=True."
        )
    mesh = skin.mesh
    names = [f"{path.stem}_{number:04d}.vtu" for number in range(skin.times_ms.size)]
    grid = _grid(mesh)
    _add(grid.GetCellData(), {"layer": mesh.layer.astype(np.int32)})
    _add(grid.GetPointData(), _node_sets(mesh))
    overall, points, cells = _exported(skin.deformation, mesh)
    for number, name in enumerate(names):  # an array replaces the one of its name
        _add(grid.GetCellData(), {key: values[number] for key, values in cells.items()})
        _add(grid.GetPointData(), {key: values[number] for key, values in points.items()})
        _add(grid.GetFieldData(), {key: values[[number]] for key, values in overall.items()})
        write_atomically(path.with_name(name), _xml(grid))
    write_atomically(path, _index(names, skin.times_ms))
    return path, *(path.with_name(name) for name in names)


@dataclass(frozen=True)
class VtuSeries:
    """A deformation as VTU files hold it."""

    times_ms: FloatArray  # Times of the files, (n_times,). [ms]
    points_mm: FloatArray  # Undeformed nodes, (n_nodes, 3). [mm]
    points: Mapping[str, np.ndarray]
    cells: Mapping[str, np.ndarray]
    press: Mapping[str, np.ndarray]
    """Values at nodes, in elements, and of the whole press, by ParaView's names, (n_times, ...)."""


@checked
def read_vtu_series(path: str | Path) -> VtuSeries:
    """Read the files that `write_vtu_series` wrote, by their PVD file."""
    require_vtk()
    from vtkmodules.util.numpy_support import vtk_to_numpy
    from vtkmodules.vtkIOXML import vtkXMLUnstructuredGridReader

    path = path_of("path", path)
    try:
        listed = [dict(entry.attrib) for entry in ElementTree.fromstring(read_text(path)).iter("DataSet")]
        files = [(float(entry["timestep"]), path.with_name(Path(entry["file"]).name)) for entry in listed]
    except (ElementTree.ParseError, KeyError, ValueError) as error:
        raise InputError(
            path, "must be an index of VTU files", remedy=f"it cannot be read ({error})"
        ) from error
    found: list[tuple[np.ndarray, list[dict[str, np.ndarray]]]] = []
    for _, name in files:
        reader = vtkXMLUnstructuredGridReader()
        if not reader.CanReadFile(str(name)):
            raise InputError(name, "must be a VTU file", remedy="it is missing or cannot be read")
        reader.SetFileName(str(name))
        reader.Update()
        grid = reader.GetOutput()
        groups = [
            {data.GetArrayName(n): vtk_to_numpy(data.GetArray(n)) for n in range(data.GetNumberOfArrays())}
            for data in (grid.GetPointData(), grid.GetCellData(), grid.GetFieldData())
        ]
        found.append((vtk_to_numpy(grid.GetPoints().GetData()), groups))
    if not found:
        raise InputError(path, "must list a VTU file or more", remedy="it lists none")
    points, cells, press = (
        {name: np.stack([groups[kind][name] for _, groups in found]) for name in found[0][1][kind]}
        for kind in range(3)
    )
    return VtuSeries(np.array([time for time, _ in files]), found[0][0], points, cells, press)


def require_vtk() -> None:
    """Raise `InputError` if VTK is not installed; the parts that are used write files, none of them draws."""
    library("vtkmodules.vtkIOXML", "VTU files need the package vtk", "vtk")


def _exported(deformation: Deformation, mesh: Mesh) -> tuple[dict[str, np.ndarray], ...]:
    """Compute the exported fields of press (n_times,), points and cells (n_times, n, ...), by name."""
    overall: dict[str, np.ndarray] = {}
    points: dict[str, np.ndarray] = {}
    cells: dict[str, np.ndarray] = {}
    for field in (field for field in FIELDS.values() if field.exported):
        values = field.of(deformation, mesh)
        match field.place:
            case Place.PRESS:
                overall[field.exported] = values
            case Place.NODE:
                points[field.exported] = values
            case Place.SKIN_NODE:
                padded = np.zeros((len(values), len(mesh.nodes_mm), *values.shape[2:]))
                padded[:, mesh.skin_nodes] = values
                points[field.exported] = padded
            case Place.ELEMENT | Place.WATCHED:
                cells[field.exported] = values
    return overall, points, cells


def _node_sets(mesh: Mesh) -> dict[str, np.ndarray]:
    """Return the sets of nodes as masks, 1 where a node belongs to it."""
    sets = {
        "skin": mesh.skin_nodes,
        "bone": mesh.bone_nodes,
        "nail": mesh.nail_nodes,
        "symmetry": mesh.symmetry_nodes,
        "midline": mesh.midline_nodes,
    }
    masks = {}
    for name, nodes in sets.items():
        masks[name] = np.zeros(len(mesh.nodes_mm), dtype=np.uint8)
        masks[name][nodes] = 1
    return masks


def cells_of(mesh: Mesh) -> tuple[np.ndarray, np.ndarray, np.ndarray]:
    wedges = wedge_nodes(mesh)
    is_wedge = wedges[:, 0] >= 0
    sizes = np.where(is_wedge, 6, 8)
    nodes = np.where(is_wedge[:, None], np.pad(wedges, ((0, 0), (0, 2))), mesh.elements)
    used = np.arange(8) < sizes[:, None]
    offsets = np.concatenate([[0], np.cumsum(sizes)])
    return offsets, nodes[used], np.where(is_wedge, WEDGE, HEXAHEDRON).astype(np.uint8)


def _grid(mesh: Mesh) -> Any:
    from vtkmodules.util.numpy_support import numpy_to_vtk, numpy_to_vtkIdTypeArray
    from vtkmodules.vtkCommonCore import vtkPoints
    from vtkmodules.vtkCommonDataModel import vtkCellArray, vtkUnstructuredGrid

    offsets, nodes, kinds = cells_of(mesh)
    points, cells, grid = vtkPoints(), vtkCellArray(), vtkUnstructuredGrid()
    points.SetData(numpy_to_vtk(np.ascontiguousarray(mesh.nodes_mm), deep=True))
    cells.SetData(numpy_to_vtkIdTypeArray(offsets, deep=True), numpy_to_vtkIdTypeArray(nodes, deep=True))
    grid.SetPoints(points)
    grid.SetCells(numpy_to_vtk(kinds, deep=True), cells)
    return grid


def _add(data: Any, fields: dict[str, np.ndarray]) -> None:
    """Attach arrays by name; numbers with a fraction go in single precision."""
    from vtkmodules.util.numpy_support import numpy_to_vtk

    for name, values in fields.items():
        fraction = np.issubdtype(values.dtype, np.floating) and name != "TimeValue"
        array = numpy_to_vtk(np.ascontiguousarray(values, dtype=np.float32 if fraction else None), deep=True)
        array.SetName(name)
        if array.GetNumberOfComponents() == len(AXES):
            for component, axis in enumerate(AXES):
                array.SetComponentName(component, axis)
        data.AddArray(array)


def _xml(grid: Any) -> bytes:
    """Content of a VTU file: XML with compressed, base64-encoded numbers."""
    from vtkmodules.vtkIOXML import vtkXMLUnstructuredGridWriter

    writer = vtkXMLUnstructuredGridWriter()
    writer.SetInputData(grid)
    writer.SetDataModeToBinary()
    writer.WriteToOutputStringOn()
    writer.Write()
    return writer.GetOutputString().encode("ascii")


def _index(names: list[str], times_ms: np.ndarray) -> bytes:
    """Content of a PVD file."""
    lines = [
        f'    <DataSet timestep="{time_ms:.17g}" part="0" file={quoteattr(name)}/>'
        for time_ms, name in zip(times_ms, names, strict=True)
    ]
    head = '<?xml version="1.0"?>\n<VTKFile type="Collection" version="0.1">\n  <!-- times in ms -->\n'
    return "\n".join([f"{head}  <Collection>", *lines, "  </Collection>\n</VTKFile>\n"]).encode()
