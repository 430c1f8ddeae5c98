"""Deformation over time as VTU files and a PVD index, which ParaView and `pyvista.get_reader` open.

One VTU per time holds the undeformed points with their displacement (shown by ParaView's "Warp By Vector"),
the fields of the cells, and the sets of nodes. The PVD lists the files with their times in ms. Bricks are
VTK_HEXAHEDRON, collapsed ones VTK_WEDGE. The package `vtk`, of the extra `fingerpad[vtk]`, writes the files.
"""

from __future__ import annotations

from pathlib import Path
from typing import Any
from xml.sax.saxutils import quoteattr

import numpy as np

from fingerpad.core.errors import InputError
from fingerpad.core.files import path_of, write_atomically
from fingerpad.export.job import wedge_nodes
from fingerpad.export.results import require
from fingerpad.geometry.mesh import Mesh
from fingerpad.mechanics.press import Deformation
from fingerpad.skin.fields import FIELDS, Place
from fingerpad.skin.sampling import SkinResponse

HEXAHEDRON, WEDGE = 12, 13  # VTK's numbers of the two cells.

AXES = ("XX", "YY", "ZZ", "XY", "YZ", "XZ")
"""Components of a tensor, in the order of ours and of ParaView's symmetric tensors."""

NODE_SETS = ("skin", "bone", "nail", "symmetry", "midline")  # Written as masks, 1 where a node belongs to it.


def write_vtu(path: Path, skin: SkinResponse) -> None:
    """Write an indentation for ParaView: the state at the end (.vtu), or the times that .pvd lists.

    The fields are those of `skin.fields.FIELDS` that are exported: of cells, of points, and of the whole
    press as field data.
    """
    require("vtu")
    path = path_of("path", path)
    if skin.deformation is None:
        raise InputError(
            "VTU files show all nodes and elements over time, which this response does not hold: solve the "
            "touch with whole=True."
        )
    mesh, times_ms = skin.mesh, skin.times_ms
    grid = _grid(mesh)
    _add(grid.GetCellData(), {"layer": mesh.layer.astype(np.int32)})
    nodes = np.arange(len(mesh.nodes_mm))
    sets = {name: np.isin(nodes, getattr(mesh, f"{name}_nodes")).astype(np.uint8) for name in NODE_SETS}
    _add(grid.GetPointData(), sets)
    overall, points, cells = _exported(skin.deformation, mesh)
    series = path.suffix == ".pvd"
    numbers = range(times_ms.size) if series else (times_ms.size - 1,)
    names = [f"{path.stem}_{number:04d}.vtu" if series else path.name for number in numbers]
    for number, name in zip(numbers, names, strict=True):  # an array replaces the one of its name
        _add(grid.GetCellData(), {key: values[number] for key, values in cells.items()})
        _add(grid.GetPointData(), {key: values[number] for key, values in points.items()})
        _add(grid.GetFieldData(), {key: values[[number]] for key, values in overall.items()})
        write_atomically(path.with_name(name), _xml(grid))
    if series:
        write_atomically(path, _index(names, times_ms))


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
