"""Results of a sweep, as its data set holds them: settings, other observers, a table, a session of NWB."""

from __future__ import annotations

import json
from collections.abc import Iterator, Mapping
from pathlib import Path
from typing import TYPE_CHECKING, Any

import numpy as np

from fingerpad.core.checked import checked
from fingerpad.core.errors import InputError, shown
from fingerpad.core.files import path_of, write_atomically
from fingerpad.core.signals import PLACES, RECEPTOR_COLUMNS, ResponseMap
from fingerpad.experiments.requests.parts import Content
from fingerpad.experiments.sweep.request import OBSERVER, SweepRequest
from fingerpad.experiments.sweep.settings import MEASURED, observe
from fingerpad.export.responses import MEASURED as MEASURED_COLUMNS
from fingerpad.export.responses import write_responses_nwb
from fingerpad.export.results import check_format, library, require, table_csv
from fingerpad.export.sweep import DONE, FORMAT, FORMAT_VERSION, HIT_RATE, opened_group
from fingerpad.export.touch_file import spike_trains
from fingerpad.neuron.spikes import rate_windows_ms

if TYPE_CHECKING:
    import xarray

TABLE, TABLE_VERSION = "fingerpad sweep table", 1
"""What the header of a table says: `format` and `format_version`."""


@checked
def open_sweep(path: str | Path) -> xarray.Dataset:
    """Open the data set that `fp.sweep` wrote; numbers are read when they are used.

    Returns
    -------
    xarray.Dataset
        With dimensions named by the fields that vary; `status` is 1 where a setting is done.
        `fp.write_sweep_table(data, path)` writes its rates, `fp.setting_touch(data, **where)` describes one
        setting, and `data.to_dataframe()` or `data.hit_rate.plot()` are those of xarray.
    """
    xarray, _ = library("xarray"), library("zarr")
    check_format(path, opened_group(path_of("path", path)).attrs.asdict(), FORMAT, FORMAT_VERSION)
    data = xarray.open_zarr(path, chunks=None, consolidated=False, decode_times=False)
    return data.set_coords([name for name in ("time_ms", "receptor_mm") if name in data])


def check_sweep_data(data: xarray.Dataset) -> None:
    if not isinstance(data, library("xarray").Dataset) or "sweep" not in data.attrs or "status" not in data:
        raise InputError("data", "must be a data set from open_sweep", shown(data))


@checked
def observe_sweep(data: xarray.Dataset, observer: Content, grid: Content | None = None) -> xarray.DataArray:
    """Hit rates of other observers than those of the sweep; nothing is pressed and no afferent responds.

    Parameters
    ----------
    data : xarray.Dataset
        From `open_sweep`.
    observer : mapping
        As the block `observer` of a sweep (docs/sweeps.md).
    grid : mapping of str to list, optional
        Fields of the observer that vary, such as {"noise": [0.01, 0.02]}: each is a dimension.

    Returns
    -------
    xarray.DataArray
        With the dimensions of the sweep, then those of the observer; NaN for the standard. [0-1]
    """
    check_sweep_data(data)
    content = json.loads(data.attrs["sweep"])
    varied = {f"{OBSERVER}.{field}": values for field, values in (grid or {}).items()}
    own = {
        field: values
        for field, values in content.get("grid", {}).items()
        if field.partition(".")[0] != OBSERVER
    }
    asked = {**content, OBSERVER: dict(observer), "grid": own | varied}
    sweep = SweepRequest.read(asked, name="observe_sweep")
    kept = [name for name in data.dims if name in {axis.name for axis in sweep.axes}]
    responses = {name: data[name].values for name in MEASURED.values() if name in data}
    values = observe(sweep, responses, data["status"].values == DONE, lambda: None)
    coords: dict[str, object] = {name: data[name] for name in kept if name in data.coords}
    coords |= {axis.name: next(iter(axis.values.values())) for axis in sweep.observer_axes}
    dims = [axis.name for axis in (*sweep.axes, *sweep.observer_axes)]
    return library("xarray").DataArray(values, dims=dims, coords=coords, name=HIT_RATE)


def sweep_settings(data: xarray.Dataset) -> SweepRequest:
    check_sweep_data(data)
    return SweepRequest.read(json.loads(data.attrs["sweep"]), name=data.attrs.get("source", "sweep"))


@checked
def setting_touch(data: xarray.Dataset, **where: int) -> Content:
    """Touch of one setting, by its index along each dimension, in the words of a file for `run_touch`."""
    sweep = sweep_settings(data)
    return sweep.content(setting_number(sweep, where))


def setting_number(sweep: SweepRequest, where: Mapping[str, int]) -> int:
    """Return the number of the setting with an index along each dimension, or raise `InputError`."""
    names = [axis.name for axis in sweep.axes]
    if set(where) != set(names):
        raise InputError(f"an index must be given for each of {', '.join(names)}: got {', '.join(where)}.")
    index = [where[name] for name in names]
    for name, given, size in zip(names, index, sweep.shape, strict=True):
        if not 0 <= given < size:
            raise InputError(f"The index along {name} must be within 0 ... {size - 1}: got {given}.")
    return int(np.ravel_multi_index(index, sweep.shape))


@checked
def write_sweep_table(data: xarray.Dataset, path: str | Path) -> Path:
    """Write rates, latencies and numbers of spikes as a table, one row per setting and receptor.

    Columns are the fields that vary, the number and the position of the receptor, and the responses, with
    units in their names. Settings without a result have no rows. `pandas.read_csv(path, comment="#")` and
    `pandas.read_parquet` read it; the first line of a CSV file has the title and the hash of the inputs.

    Parameters
    ----------
    data : xarray.Dataset
        From `open_sweep`, or a part of it.
    path : str or Path
        A file that ends in .csv, or in .parquet, which needs the extra `fingerpad[tables]`.

    Raises
    ------
    StoreError
        If the file cannot be written.
    """
    path = Path(path)
    check_sweep_data(data)
    table = _table(data)
    about = {"format": TABLE, "format_version": TABLE_VERSION}
    about |= {name: data.attrs[name] for name in ("title", "inputs_sha256", "version") if name in data.attrs}
    if path.suffix == ".csv":
        content = f"# {json.dumps(about)}\n".encode() + table_csv(dict(table.items()))
    else:
        _needs_parquet(path)
        table.attrs.update(about)
        content = table.to_parquet(index=False)
    write_atomically(path, content)
    return path


@checked
def setting_response(data: xarray.Dataset, **where: int) -> ResponseMap:
    """Responses of the receptors in one setting, as `Population.respond` returned them.

    Parameters
    ----------
    data : xarray.Dataset
        From `open_sweep`.
    **where : int
        Index of the setting along each dimension of the sweep, as in `setting_touch`.
    """
    sweep = sweep_settings(data)
    setting = setting_number(sweep, where)
    one = data.isel(where)
    if int(one["status"]) != DONE:
        raise InputError(f"The setting {where} must be done: {str(one['reason'].values) or 'it is not'}")
    described = sweep.described(setting)
    phases, asked = described.touch.stimulus.phases, described.afferents.windows_ms
    count = len(described.population)
    measured: Any = {name: one[name].values[:count] for name in MEASURED_COLUMNS}
    return ResponseMap(
        positions_mm=one["receptor_mm"].values[:count],
        pitch_mm=described.population.pitch_mm,
        spikes=spike_trains(one.isel(receptor=slice(count))),
        duration_ms=float(np.nanmax(one["time_ms"].values)),
        phases=phases,
        windows_ms=rate_windows_ms(phases, *asked.both),
        **measured,
    ).of_types(described.population.types)


@checked
def write_sweep_spikes(data: xarray.Dataset, path: str | Path, **where: int) -> Path:
    """Write the spikes of a sweep as one session of NWB: a trial per setting, a unit per receptor.

    Receptors must lie at the same places in all settings that are written: choose one setting of each
    dimension that moves them. The extra `fingerpad[nwb]` is required.

    Parameters
    ----------
    data : xarray.Dataset
        From `open_sweep`.
    path : str or Path
        The file, which ends in .nwb.
    **where : int
        Index along a dimension of the sweep, of which only this one is written.

    Returns
    -------
    Path
        The file; `fingerpad fit` reads it like recordings.

    Raises
    ------
    StoreError
        If the file cannot be written.
    """
    check_sweep_data(data)
    responses = {name: setting_response(data, **place) for name, place in _done(data, where)}
    if not responses:
        raise InputError("A setting that is written must be done: none is.")
    return write_responses_nwb(path_of("path", path), responses)


def _done(data: xarray.Dataset, where: Mapping[str, int]) -> Iterator[tuple[str, dict[str, int]]]:
    """Names and places of the settings that are done."""
    sweep = sweep_settings(data)
    names = [axis.name for axis in sweep.axes]
    if unknown := set(where) - set(names):
        raise InputError(f"{', '.join(sorted(unknown))} must be one of {', '.join(names)}.")
    for setting in np.flatnonzero(data["status"].values.ravel() == DONE).tolist():
        index = np.unravel_index(setting, sweep.shape)
        place = {name: int(number) for name, number in zip(names, index, strict=True)}
        if where.items() <= place.items():
            values = sweep.values(setting)
            yield ", ".join(f"{field} {value}" for field, value in values.items()), place


def _table(data: xarray.Dataset) -> Any:
    """Rates of all settings with a result, as a data frame."""
    if not (data["status"].values == DONE).any():
        raise InputError("A setting must be done for a table of rates: none is.")
    positions = data["receptor_mm"]
    columns = {
        name: positions.isel(coordinate=number).variable
        for number, name in enumerate(PLACES[positions.sizes["coordinate"]])
    }
    rates = [name for name in RECEPTOR_COLUMNS if name in data]
    wanted = data[rates].drop_vars(["receptor_mm", "time_ms"], errors="ignore").assign(columns)
    frame = wanted.to_dataframe().reset_index()
    order = [name for name in frame.columns if name not in (*columns, *rates)] + [*columns, *rates]
    # The place of a receptor is NaN behind the last one of a setting, and where a setting failed.
    return frame.loc[frame["x_mm"].notna(), order].reset_index(drop=True)


def check_outputs(table: Path | None, spikes: Path | None) -> None:
    """Raise `InputError` if a table or a session could not be written after a sweep has run."""
    if table is not None and table.suffix != ".csv":
        _needs_parquet(table)
    if spikes is not None:
        if spikes.suffix != ".nwb":
            raise InputError(f"Spikes of a sweep are written as .nwb: got {spikes.name}.")
        require("nwb")


def _needs_parquet(path: Path) -> None:
    if path.suffix != ".parquet":
        raise InputError(f"A table of a sweep is written as .csv or .parquet: got {path.name}.")
    require("parquet")
