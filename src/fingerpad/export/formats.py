"""Export of one indentation to another program, by the name of the format."""

from __future__ import annotations

import csv
import io
import json
from collections.abc import Callable
from pathlib import Path
from typing import Any

import numpy as np

from fingerpad.core.checked import checked
from fingerpad.core.errors import InputError
from fingerpad.core.files import path_of, write_atomically
from fingerpad.core.values import one_of
from fingerpad.export.abaqus import abaqus_deck
from fingerpad.export.calculix import calculix_deck
from fingerpad.export.dataset import require_netcdf, write_touch
from fingerpad.export.febio import febio_deck
from fingerpad.export.job import Job, job_of
from fingerpad.export.vtu import require_vtk, write_vtu_series
from fingerpad.skin.fields import FIELDS, Place
from fingerpad.skin.indentation import Touch
from fingerpad.skin.sampling import SkinResponse

MESH_ARRAYS = ("nodes_mm", "elements", "layer", "skin_nodes", "skin_grid")
"""Arrays of the mesh in an NPZ file: without them the values at nodes and elements have no place."""


def write_touch_csv(path: Path, skin: SkinResponse) -> tuple[Path, ...]:
    """Write one row per time: all that has one value for the whole touch.

    Columns are time, depth, force, area of contact, reaction of bone and nail, and energies, each with its
    unit in its name; a vector has one column per axis. Numbers have all their digits.
    """
    columns: dict[str, np.ndarray] = {}
    for name, field in FIELDS.items():
        if field.place is Place.PRESS:
            values = skin.fields[name].reshape(skin.times_ms.size, -1)
            axes = ("",) if field.components == 1 else ("_x", "_y", "_z")
            columns |= {name + axis: column for axis, column in zip(axes, values.T, strict=True)}
    text = io.StringIO()
    table = csv.writer(text, lineterminator="\n")
    table.writerow(columns)
    table.writerows(np.column_stack(list(columns.values())).tolist())
    write_atomically(path_of("path", path), text.getvalue().encode())
    return (path_of("path", path),)


def write_touch_npz(path: Path, skin: SkinResponse) -> tuple[Path, ...]:
    """Write all fields of a touch with the mesh that they belong to.

    `numpy.load` reads the file. It holds every array of `SkinResponse.fields` under its name, the arrays
    `MESH_ARRAYS` of the mesh, `kinks_ms`, and in `units` the unit of every field as JSON.
    """
    buffer, units = io.BytesIO(), {name: FIELDS[name].unit for name in skin.fields}
    content: dict[str, Any] = {name: getattr(skin.mesh, name) for name in MESH_ARRAYS}
    content |= {**skin.fields, "kinks_ms": np.array(skin.kinks_ms), "units": np.array(json.dumps(units))}
    np.savez_compressed(buffer, **content)
    write_atomically(path_of("path", path), buffer.getvalue())
    return (path_of("path", path),)


DECKS: dict[str, tuple[str, Callable[[Job], str]]] = {
    "abaqus": ("touch.inp", abaqus_deck),
    "calculix": ("touch.inp", calculix_deck),
    "febio": ("touch.feb", febio_deck),
}
"""Name of the input file of each solver, and the function that returns its text."""

RESULTS: dict[str, tuple[str, Callable[[Path, SkinResponse], tuple[Path, ...]]]] = {
    "vtu": ("touch.pvd", write_vtu_series),
    "csv": ("touch.csv", write_touch_csv),
    "npz": ("touch.npz", write_touch_npz),
    "netcdf": ("touch.nc", write_touch),
    "zarr": ("touch.zarr", write_touch),
}
"""Name of the file that holds the result of a touch, and the function that writes it."""

REQUIRED = {"vtu": require_vtk, "netcdf": require_netcdf, "zarr": require_netcdf}
"""Formats that hold all nodes and elements over time, and what raises if their library is missing."""

FORMATS = (*RESULTS, *DECKS)


@checked
def export_touch(
    folder: Path, touch: Touch, format_name: str, elastic_moduli: str | None = None
) -> tuple[Path, ...]:
    """Write an indentation for another program.

    Parameters
    ----------
    folder : Path
        Folder for the files; it is created if needed.
    touch : Touch
        The indentation to export; all but the input files of solvers also solve it.
    format_name : str
        One of `FORMATS`.
    elastic_moduli : {"long_term", "instantaneous"}, optional
        For "calculix", which has no relaxation: the moduli of the layers.

    Returns
    -------
    tuple of Path
        The files; open the first one.
    """
    check_format(format_name, elastic_moduli)  # first, since solving takes its time
    if format_name in RESULTS:
        name, write = RESULTS[format_name]
        return write(path_of("folder", folder) / name, touch.solve(whole=format_name in REQUIRED))
    return (write_deck(folder, job_of(touch), format_name, elastic_moduli),)


def check_format(format_name: str, elastic_moduli: str | None = None) -> None:
    """Raise `InputError` if there is no such format, or its library is missing."""
    one_of("format", format_name, FORMATS)
    if elastic_moduli is not None and format_name != "calculix":
        raise InputError(
            f"elastic_moduli is for calculix, which has no relaxation, not for {format_name}: leave it out."
        )
    if format_name in REQUIRED:
        REQUIRED[format_name]()


def write_deck(folder: Path, job: Job, format_name: str, elastic_moduli: str | None = None) -> Path:
    """Write the input file of a solver; arguments as of `export_touch`, with what `job_of` returns."""
    name, deck = DECKS[format_name]
    text = deck(job) if elastic_moduli is None else calculix_deck(job, elastic_moduli)
    write_atomically(path_of("folder", folder) / name, text.encode())
    return path_of("folder", folder) / name
