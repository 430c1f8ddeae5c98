"""Results as tables of pandas, as labelled data sets of xarray, and as files by the ending of their names.

The extra `fingerpad[netcdf]` brings pandas and xarray; CSV, JSON, NPZ and pictures need nothing.
"""

from __future__ import annotations

import csv
import inspect
import io
import json
import shutil
from collections.abc import Callable, Mapping
from importlib import import_module
from pathlib import Path
from secrets import token_hex
from tempfile import TemporaryDirectory
from typing import TYPE_CHECKING, Any

import numpy as np

from fingerpad.core.displayed import Contents, Result
from fingerpad.core.errors import InputError, StoreError
from fingerpad.core.files import path_of, write_atomically
from fingerpad.core.result_files import to_json

if TYPE_CHECKING:
    import pandas
    import xarray

DRAWN_IN = (6.4, 4.0)  # Size of the picture of a result. [in]


def library(name: str, needed: str = "", extra: str = "netcdf") -> Any:
    """Import a library of an extra, or raise an `InputError` that says how to install it."""
    try:
        return import_module(name)
    except ImportError as error:
        raise InputError(
            f"{needed or f'A labelled data set needs {name}'}: install the extra, pip install "
            f"'fingerpad[{extra}]'."
        ) from error


NEEDED: dict[str, tuple[tuple[str, ...], ...]] = {
    "vtu": (("vtkmodules.vtkIOXML", "VTU files need the package vtk", "vtk"),),
    "nwb": (("pynwb", "NWB files need pynwb", "nwb"),),
    "parquet": (("pyarrow", "Parquet needs pyarrow", "tables"),),
    "netcdf": (("xarray",), ("h5netcdf",), ("zarr",)),
    "zarr": (("xarray",), ("h5netcdf",), ("zarr",)),
}
"""Libraries that write a format: arguments of `library`."""


def require(format_name: str) -> None:
    """Raise `InputError` if a library that writes a format is not installed."""
    for needed in NEEDED.get(format_name, ()):
        library(*needed)


def first_line(error: Exception) -> str:
    return (str(error).strip().splitlines() or [type(error).__name__])[0].strip().rstrip(".")[:200]


def check_format(path: str | Path, found: Mapping[str, Any], written: str, version: int) -> None:
    """Raise `InputError` unless attributes are those of a format of fingerpad, in the version of today."""
    if found.get("format") != written:
        what = written.removeprefix("fingerpad ")
        raise InputError(path, f"must be a {what} that fingerpad wrote", remedy="it has another content")
    if (came := found.get("format_version")) != version:
        remedy = "read it with the version of fingerpad that wrote it"
        raise InputError(path, f"must have format_version {version}", str(came), remedy)


def frame(result: Result) -> pandas.DataFrame:
    """Return a result as a table; see `Result.to_frame`."""
    columns = result.columns()
    made: pandas.DataFrame = library("pandas", "A table needs pandas").DataFrame(columns)
    return made.set_index(next(iter(columns)))


def dataset(contents: Contents) -> xarray.Dataset:
    """Make a data set; a variable that is named as its dimension is a coordinate."""
    variables, attributes = contents
    made: xarray.Dataset = library("xarray").Dataset(variables, attrs=attributes)
    return made


def save(result: Result, path: str | Path, **options: Any) -> Path:
    """Write a result by the ending of the name; see `Result.save`."""
    path = path_of("path", path)
    known = {ending: write for ending, (write, needed) in WRITERS.items() if hasattr(result, needed)}
    if path.suffix not in known:
        raise InputError(f"A {type(result).__name__} is saved as {', '.join(known)}: got {path.name}.")
    write = known[path.suffix]
    taken = inspect.signature(write).parameters
    if options and not any(each.kind is inspect.Parameter.VAR_KEYWORD for each in taken.values()):
        raise InputError(f"A file {path.suffix} has no options: got {', '.join(options)}.")
    write(result, path, **options)
    return path


def table_csv(columns: dict[Any, Any]) -> bytes:
    """Write a table with all digits of its numbers, and nothing where there is none."""
    text = io.StringIO()
    writer = csv.writer(text, lineterminator="\n")
    writer.writerow(columns)
    rows = zip(*(np.asarray(values).tolist() for values in columns.values()), strict=True)
    writer.writerows([["" if value != value else value for value in row] for row in rows])
    return text.getvalue().encode()


def _csv(result: Any, path: Path) -> None:
    """Write the table; a response has its spike times as one entry, separated by spaces."""
    columns = result.columns()
    if hasattr(result, "positions_mm"):
        columns["spike_times_ms"] = [" ".join(map(repr, train.tolist())) for train in result.spikes]
    write_atomically(path, table_csv(columns))


def _parquet(result: Result, path: Path) -> None:
    require("parquet")
    made = frame(result)
    made.columns = made.columns.astype(str)
    write_atomically(path, made.to_parquet())


def _json(result: Result, path: Path, **options: Any) -> None:
    """Write all fields, or the data set as `xarray.Dataset.from_dict` reads it; null for NaN."""
    if result.whole_as_json:
        write_atomically(path, to_json(result) + b"\n")
        return
    variables, attributes = result.contents(**options)
    sizes: dict[str, int] = {}
    plain: dict[str, dict[str, object]] = {}
    for name, (dims, values, about) in variables.items():
        sizes |= dict(zip(dims, values.shape, strict=True))
        held = values.astype(object)
        held[values != values] = None
        plain[name] = {"dims": dims, "attrs": about, "data": held.tolist()}
    content = {"coords": {}, "attrs": attributes, "dims": sizes, "data_vars": plain}
    write_atomically(path, (json.dumps(content, default=np.ndarray.tolist) + "\n").encode())


def _npz(result: Result, path: Path, **options: Any) -> None:
    """Write every variable of the data set by its name, and in `units` the unit of each as JSON."""
    variables, attributes = result.contents(**options)
    arrays: Any = {
        name: values.astype(str) if values.dtype == object else values
        for name, (_, values, _) in variables.items()
    }
    units = {name: about["units"] for name, (_, _, about) in variables.items() if "units" in about}
    content = io.BytesIO()
    np.savez_compressed(content, **arrays, units=json.dumps(units), attributes=json.dumps(attributes))
    write_atomically(path, content.getvalue())


def _netcdf(result: Result, path: Path, **options: Any) -> None:
    library("h5netcdf")
    data = dataset(result.contents(**options))
    packed = {
        name: {"zlib": True, "complevel": 4}
        for name, values in data.variables.items()
        if values.ndim and values.dtype != object
    }
    with TemporaryDirectory() as folder:
        unfinished = Path(folder) / "data.nc"
        data.to_netcdf(unfinished, engine="h5netcdf", encoding=packed)
        write_atomically(path, unfinished.read_bytes())


def _zarr(result: Result, path: Path, **options: Any) -> None:
    """Write a Zarr store beside its place and rename it: what was there is replaced at once."""
    library("zarr")
    data = dataset(result.contents(**options))
    unfinished, replaced = (path.with_name(f".{path.name}.{token_hex(8)}.{what}") for what in ("part", "old"))
    try:
        path.parent.mkdir(parents=True, exist_ok=True)
        data.to_zarr(unfinished, mode="w", consolidated=False)
        if path.exists():
            path.rename(replaced)
        unfinished.rename(path)
    except OSError as error:
        raise StoreError(
            f"{path} cannot be written ({error.strerror or error}): free it or choose another."
        ) from error
    finally:
        if replaced.exists() and not path.exists():
            replaced.rename(path)
        for leftover in (unfinished, replaced):
            shutil.rmtree(leftover, ignore_errors=True)


def _nwb(result: Any, path: Path, **options: Any) -> None:
    result.to_nwb(path, **options)


def _vtu(result: Any, path: Path) -> None:
    from fingerpad.export.vtu import write_vtu

    write_vtu(path, result)


def _picture(result: Result, path: Path, **options: Any) -> None:
    import matplotlib

    from fingerpad.report.style import STYLE, new_figure

    content = io.BytesIO()
    with matplotlib.rc_context(STYLE):
        figure = new_figure(*DRAWN_IN)
        result.plot(figure.add_subplot(), **options)
        figure.savefig(content, format=path.suffix[1:])
    write_atomically(path, content.getvalue())


WRITERS: dict[str, tuple[Callable[..., None], str]] = {
    ".csv": (_csv, "columns"),
    ".parquet": (_parquet, "columns"),
    ".json": (_json, "columns"),
    ".npz": (_npz, "columns"),
    ".nc": (_netcdf, "columns"),
    ".zarr": (_zarr, "columns"),
    ".nwb": (_nwb, "to_nwb"),
    ".vtu": (_vtu, "deformation"),
    ".pvd": (_vtu, "deformation"),
    ".png": (_picture, "columns"),
    ".pdf": (_picture, "columns"),
    ".svg": (_picture, "columns"),
}
"""What writes a result by the ending of the file, and an attribute of the results that it writes."""
