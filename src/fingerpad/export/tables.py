"""One touch as a CSV table over time, and as one NPZ file with all that is known of it."""

from __future__ import annotations

import csv
import io
import json
from pathlib import Path
from typing import Any

import numpy as np

from fingerpad.core.files import path_of, write_atomically
from fingerpad.skin.fields import FIELDS, Place
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
