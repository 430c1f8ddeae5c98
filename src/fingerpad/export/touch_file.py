"""Reading of the data set of a touch, NetCDF or Zarr, and its check against what is declared."""

from __future__ import annotations

from pathlib import Path
from typing import TYPE_CHECKING

import numpy as np

from fingerpad.core.checked import checked
from fingerpad.core.displayed import udunits
from fingerpad.core.errors import InputError
from fingerpad.core.files import path_of
from fingerpad.core.signals import RECEPTOR_COLUMNS, SpikeTrains
from fingerpad.core.units import unit_of
from fingerpad.export.results import check_format, first_line, library
from fingerpad.skin.dataset import FORMAT, FORMAT_VERSION, MESH_PARTS, OBJECT_PARTS, Part, dimensions_of
from fingerpad.skin.fields import FIELDS, stored_fields

if TYPE_CHECKING:
    import xarray

FILE_NAMES = ("touch.nc", "touch.zarr")  # Names under which a folder of results holds a touch.

SUFFIXES = (".nc", ".zarr")

RESPONSE_PARTS = {
    "receptor_mm": Part("mm", ("receptor", "coordinate"), ""),
    "spike_time_ms": Part("ms", ("spike",), ""),
    **{
        name: Part(udunits(unit_of(name)), ("receptor",), column.long_name, holes=column.holes)
        for name, column in RECEPTOR_COLUMNS.items()
    },
}
PARTS = {**MESH_PARTS, **OBJECT_PARTS, **RESPONSE_PARTS}  # Variables beside the fields of the press, by name.

_NEEDED = (tuple(MESH_PARTS), tuple(OBJECT_PARTS), ("receptor_mm", "spike_count", "spike_time_ms"))
"""Variables that are there together; a file that was written before a column was added lacks only that."""


@checked
def read_touch(path: str | Path) -> xarray.Dataset:
    """Read the data set of a touch into memory, and check it.

    Parameters
    ----------
    path : str or Path
        What `SkinResponse.save` wrote as .nc or .zarr, or a folder that holds `touch.nc` or `touch.zarr`.

    Raises
    ------
    InputError
        If it cannot be read, or is not what `SkinResponse.save` writes: another format or version, a variable
        that is missing or has another unit, other dimensions, numbers that are not finite, or numbers of
        nodes and elements that do not exist.

    Examples
    --------
    >>> from tempfile import TemporaryDirectory
    >>> import fingerpad as fp
    >>> skin = fp.indent(fp.Fingertip(), fp.Sphere(curvature_per_m=287), fp.RampAndHold(depth_mm=0.3))
    >>> with TemporaryDirectory() as folder:
    ...     path = skin.save(Path(folder) / "touch.nc")
    ...     read_touch(folder).depth_mm.values[-1].item()
    0.3
    """
    found = _touch_file(path_of("path", path))
    written = f"must be a touch that fingerpad wrote, as {' or '.join(SUFFIXES)}"
    if found.suffix not in SUFFIXES:
        raise InputError(found, written, remedy="its name has another ending")
    xarray = library("xarray")
    engine = "zarr" if found.is_dir() else "h5netcdf"
    library(engine)
    options = {"consolidated": False} if engine == "zarr" else {}
    try:
        with xarray.open_dataset(found, engine=engine, decode_times=False, **options) as opened:
            data = opened.load()
    except Exception as error:  # a file of unknown content may fail in any way
        raise InputError(found, written, remedy=f"it cannot be read ({first_line(error)})") from error
    check_touch(str(found), data)
    return data


def _touch_file(path: Path) -> Path:
    """Return the file of a touch: `path` itself, or the one in this folder."""
    try:
        path.stat()
        held = [path / name for name in FILE_NAMES if (path / name).exists()]
    except FileNotFoundError as error:
        raise InputError(
            path, "must be a touch that fingerpad wrote", remedy="there is no such file"
        ) from error
    except (OSError, ValueError) as error:  # no right to look, or no possible name
        said = getattr(error, "strerror", None) or error
        raise InputError(f"{str(path)[:200]!r} must be a file or folder that can be read: {said}.") from error
    if path.is_dir() and path.suffix != ".zarr":
        if not held:
            raise InputError(path, f"must hold {' or '.join(FILE_NAMES)}", remedy="there is neither")
        return held[0]
    if not (path.is_dir() or path.is_file()):
        raise InputError(path, "must be a file or a folder", remedy="it is neither")
    return path


def spike_trains(data: xarray.Dataset) -> SpikeTrains:
    """Spike trains of the receptors of a data set."""
    offsets = np.concatenate([[0], np.cumsum(data["spike_count"].values)])
    return SpikeTrains(data["spike_time_ms"].values[: offsets[-1]], offsets)


def check_touch(path: str, data: xarray.Dataset) -> None:
    """Raise `InputError` unless a data set is that of a touch; `path` says where it came from."""
    check_format(path, data.attrs, FORMAT, FORMAT_VERSION)
    if (half := data.attrs.get("half_finger")) not in (0, 1):
        raise InputError(f"{path}, attribute half_finger must be 0 or 1: got {half}.")
    groups = [_NEEDED[0], *(names for names in _NEEDED[1:] if set(names) & set(data.variables))]
    fields = (field.name for field in stored_fields() if field.name != "times_ms")
    for name in ("time", *fields, *(name for names in groups for name in names)):
        if name not in data.variables:
            raise InputError(path, f"must hold the variable {name}", remedy="it is missing")
    for key, values in data.variables.items():
        _check_variable(f"{path}, variable {key}", str(key), values, data)
    times = data["time"].values
    if times.size < 2 or times[0] != 0.0 or not (np.diff(times) > 0.0).all():
        raise InputError(f"{path}, variable time must increase from 0: it does not.")
    if "spike_count" in data:
        count, n_spikes = data["spike_count"].values, data.sizes["spike"]
        if count.min(initial=0) < 0 or count.sum() != n_spikes:
            raise InputError(
                f"{path}, variable spike_count must add up to the {n_spikes} of spike: it does not."
            )
        try:
            spike_trains(data)
        except InputError as error:
            raise InputError(
                f"{path}, variable spike_time_ms must increase per receptor: it does not."
            ) from error


def _check_variable(where: str, name: str, values: xarray.Variable, data: xarray.Dataset) -> None:
    """Check unit, dimensions and values of one variable."""
    field, part = FIELDS.get("times_ms" if name == "time" else name), PARTS.get(name)
    if field is not None:
        unit, allowed = udunits(field.unit), dimensions_of(field)
    elif part is not None:
        unit, allowed = part.unit, {part.dims}
    else:
        return  # a variable that somebody added
    if values.dims not in allowed:
        raise InputError(where, f"must have the dimensions {sorted(allowed)[0]}", str(values.dims))
    if (given := values.attrs.get("units", "")) != unit:
        raise InputError(where, f"must have the unit {unit!r}", repr(given))
    numbers, holes = values.values, part is not None and part.holes
    if numbers.dtype.kind not in "fiu":
        raise InputError(where, "must hold numbers", str(numbers.dtype))
    if not (np.isfinite(numbers) | (np.isnan(numbers) & holes)).all():
        raise InputError(where, "must be finite everywhere", remedy="some values are not")
    if part is not None and part.points_into and numbers.size:
        count = data.sizes[part.points_into]
        if numbers.dtype.kind == "f" or numbers.min() < 0 or numbers.max() >= count:
            raise InputError(where, f"must hold whole numbers from 0 to {count - 1}", remedy="some are not")
