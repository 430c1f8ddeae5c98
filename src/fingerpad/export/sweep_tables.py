"""Results of a sweep for other programs: rates as a table, spikes as a session of NWB."""

from __future__ import annotations

import io
import json
from collections.abc import Iterator, Mapping
from pathlib import Path
from typing import TYPE_CHECKING, Any

import numpy as np

from fingerpad import __version__
from fingerpad.core.checked import checked
from fingerpad.core.errors import InputError
from fingerpad.core.files import path_of, write_atomically
from fingerpad.core.signals import ResponseMap
from fingerpad.export.dataset import first_line, library
from fingerpad.export.responses import PLACES, require_pynwb, write_responses_nwb
from fingerpad.export.sweep_dataset import (
    DONE,
    check_sweep_data,
    setting_number,
    setting_spikes,
    sweep_settings,
)
from fingerpad.neuron.spikes import rate_windows_ms

if TYPE_CHECKING:
    import pandas
    import xarray

TABLE, TABLE_VERSION = "fingerpad sweep table", 1
"""What the header of a table says: `format` and `format_version`."""

_RATES = (
    "dynamic_rate_hz", "static_rate_hz", "dynamic_count_hz", "static_count_hz", "first_spike_latency_ms",
    "spike_count",
)  # fmt: skip


@checked
def write_sweep_table(data: xarray.Dataset, path: str | Path) -> Path:
    """Write rates, latencies and numbers of spikes as a table, one row per setting and receptor.

    Columns are the fields that vary, the number and the position of the receptor, and the responses, with
    units in their names. Settings without a result have no rows.

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
    path = path_of("path", path)
    check_sweep_data(data)
    table = _table(data)
    about = {
        "format": TABLE,
        "format_version": TABLE_VERSION,
        **{name: data.attrs[name] for name in ("title", "inputs_sha256", "version") if name in data.attrs},
    }
    if path.suffix == ".csv":
        content = f"# {json.dumps(about)}\n{table.to_csv(index=False, lineterminator=chr(10))}".encode()
    else:
        _needs_parquet(path)
        table.attrs.update(about)
        file = io.BytesIO()
        table.to_parquet(file, index=False)
        content = file.getvalue()
    write_atomically(path, content)
    return path


@checked
def read_sweep_table(path: str | Path) -> pandas.DataFrame:
    """Read a table that `write_sweep_table` wrote.

    Returns
    -------
    pandas.DataFrame
        With title, hash of the inputs and version of the program in its `attrs`.
    """
    path, pandas = path_of("path", path), library("pandas")
    try:
        if path.suffix == ".csv":
            with path.open(encoding="utf-8") as file:
                about = json.loads(file.readline().removeprefix("# "))
                # Before 3.1, pandas rounds unless it is asked not to; from then on it need not be asked.
                rounds = tuple(int(part) for part in pandas.__version__.split(".")[:2]) < (3, 1)
                table = pandas.read_csv(file, **({"float_precision": "round_trip"} if rounds else {}))
            table.attrs.update(about)
        else:
            _needs_parquet(path)
            table = pandas.read_parquet(path)
    except (OSError, ValueError, AttributeError) as error:
        raise InputError(
            path, "must be a table of a sweep", remedy=f"it cannot be read ({first_line(error)})"
        ) from error
    if table.attrs.get("format") != TABLE:
        raise InputError(
            path, "must be a table of a sweep that fingerpad wrote", remedy="it has another content"
        )
    if table.attrs.get("format_version") != TABLE_VERSION:
        raise InputError(
            path,
            f"must have format_version {TABLE_VERSION}",
            str(table.attrs.get("format_version")),
            f"read it with the version of fingerpad that wrote it, this is {__version__}",
        )
    return table


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
    return ResponseMap(
        positions_mm=one["receptor_mm"].values[:count],
        pitch_mm=described.population.pitch_mm,
        spikes=setting_spikes(one.isel(receptor=slice(count))),
        dynamic_rate_hz=one["dynamic_rate_hz"].values[:count],
        static_rate_hz=one["static_rate_hz"].values[:count],
        first_spike_latency_ms=one["first_spike_latency_ms"].values[:count],
        duration_ms=float(np.nanmax(one["time_ms"].values)),
        phases=phases,
        windows_ms=rate_windows_ms(phases, *asked.both),
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
    wanted = data[list(_RATES)].drop_vars(["receptor_mm", "time_ms"], errors="ignore").assign(columns)
    frame = wanted.to_dataframe().reset_index()
    order = [name for name in frame.columns if name not in (*columns, *_RATES)] + [*columns, *_RATES]
    # The place of a receptor is NaN behind the last one of a setting, and where a setting failed.
    return frame.loc[frame["x_mm"].notna(), order].reset_index(drop=True)


def check_outputs(table: Path | None, spikes: Path | None) -> None:
    """Raise `InputError` if a table or a session could not be written after a sweep has run."""
    if table is not None and table.suffix != ".csv":
        _needs_parquet(table)
    if spikes is not None:
        if spikes.suffix != ".nwb":
            raise InputError(f"Spikes of a sweep are written as .nwb: got {spikes.name}.")
        require_pynwb()


def _needs_parquet(path: Path) -> None:
    if path.suffix != ".parquet":
        raise InputError(f"A table of a sweep is written as .csv or .parquet: got {path.name}.")
    library("pyarrow", "Parquet needs pyarrow", "tables")
