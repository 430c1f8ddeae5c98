"""The results of a sweep as one labelled data set in Zarr format 3, written while it runs.

The dimensions are those of the sweep, then `time`, `receptor` and `spike`, and `node`, `skin_node`, `element`
or `sheet` of fields that were asked for. What a press gives has the dimensions that change the skin; what the
afferents give has all. Rows end in NaN where a setting has fewer times, receptors or spikes than another.

Spikes are ragged: `spike_time_ms` of a setting has the spikes of its first receptor, then those of the
second; `spike_count` says how many each has (a contiguous ragged array of the CF conventions per setting).

`hit_rate` of a sweep with an observer has the dimensions of the sweep, then those of the observer.

`status` says what became of each setting, `reason` why one failed. A setting counts only once its status is
written, which is after all else of it: a sweep that is killed goes on from there.
"""

from __future__ import annotations

import json
import warnings
from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from pathlib import Path
from typing import TYPE_CHECKING, Any

import numpy as np

from fingerpad.core.checked import checked
from fingerpad.core.errors import InputError, StoreError, shown
from fingerpad.core.files import path_of
from fingerpad.core.signals import SpikeTrains
from fingerpad.core.units import unit_of
from fingerpad.experiments.requests.parts import Content
from fingerpad.experiments.sweep.observers import MEASURED, observe
from fingerpad.experiments.sweep.request import OBSERVER, SweepRequest
from fingerpad.experiments.sweep.settle import PLACES_MM, Settled
from fingerpad.export.dataset import (
    RESPONSE_PARTS,
    field_dimensions,
    first_line,
    library,
    response_values,
    udunits,
)
from fingerpad.skin.fields import FIELDS, Place

if TYPE_CHECKING:
    import xarray

FORMAT, FORMAT_VERSION = "fingerpad sweep", 1

PENDING, DONE, FAILED, LEFT_OUT = range(4)

MEANINGS = "pending done failed left_out"

HIT_RATE = "hit_rate"  # Variable of what observers find.

_SETTINGS_IN_CHUNK = 64
_CHUNKS = {"time": 64, "receptor": 512, "spike": 1024}
_PLACES_IN_CHUNK = 4096
_NAMES = {"times_ms": "time_ms"}


@dataclass(frozen=True)
class Variable:
    """One variable of the data set."""

    dims: tuple[str, ...]  # Dimensions after those of the sweep.
    unit: str
    long_name: str
    of_press: bool = False  # Whether it has the dimensions that change the skin alone.
    dtype: str = "f8"


def variables(fields: Sequence[str] = ()) -> dict[str, Variable]:
    """Variables of a sweep that keeps some fields of the skin, by name."""
    found = {}
    for name in dict.fromkeys(("times_ms", "force_mn", "depth_mm", "contact_area_mm2", *fields)):
        field = FIELDS[name]
        dtype = "f8" if field.place is Place.PRESS else "f4"
        found[_NAMES.get(name, name)] = Variable(
            field_dimensions(field), udunits(field.unit), field.long_name, True, dtype
        )
        if field.place in PLACES_MM:
            of = PLACES_MM[field.place][0]
            found[of] = Variable((of.removesuffix("_mm"), "axis"), "mm", "undeformed position", True)
    for name, part in RESPONSE_PARTS.items():
        dtype = "i4" if name == "spike_count" else "f8"
        found[name] = Variable(part.dims, part.unit, part.long_name, False, dtype)
    return found


class SweepFile:
    """The data set of a sweep, opened for writing."""

    def __init__(self, path: Path, sweep: SweepRequest, attributes: Mapping[str, Any]):
        zarr = library("zarr")
        self.path, self.sweep = path_of("path", path), sweep
        self._dims = tuple(axis.name for axis in sweep.axes)
        self._variables = variables(sweep.fields)
        self._rows: dict[tuple[str, tuple[int, ...], int], dict[int, np.ndarray]] = {}
        with _written(self.path):
            if self.path.exists() and any(self.path.iterdir()):
                opened = _opened(self.path)
                check_same(self.path, opened.attrs.asdict(), attributes)
                self._group = opened
            else:
                self._group = zarr.create_group(self.path, zarr_format=3)
                self._begin()
                # The last, so that a folder with them is complete.
                self._group.attrs.update({"format": FORMAT, "format_version": FORMAT_VERSION, **attributes})
            self._arrays = dict(self._group.arrays())
        self._sizes: dict[str, int] = {}
        for array in self._arrays.values():
            for dim, size in zip(array.metadata.dimension_names, array.shape, strict=True):
                self._sizes[dim] = max(size, self._sizes.get(dim, 0))

    def _begin(self) -> None:
        """Write the coordinates, and that nothing is done."""
        for axis in (*self.sweep.axes, *self.sweep.observer_axes):
            for field, values in axis.values.items():
                name = axis.name if len(axis.values) == 1 else field.replace(".", "_")
                text = not all(isinstance(value, int | float) for value in values)
                spelled = [value if isinstance(value, str) else json.dumps(value) for value in values]
                array = self._group.create_array(
                    name,
                    shape=(len(values),),
                    dtype=str if text else "f8",
                    dimension_names=[axis.name],
                    attributes={"long_name": field, "units": "1" if text else udunits(unit_of(field))},
                )
                array[:] = np.array(spelled, dtype=object) if text else np.array(values, dtype=float)
        flags = {"flag_values": [PENDING, DONE, FAILED, LEFT_OUT], "flag_meanings": MEANINGS}
        said = {"status": ("i1", "what became of each setting", flags), "reason": (str, "why it failed", {})}
        for name, (dtype, words, more) in said.items():
            self._group.create_array(
                name,
                shape=self.sweep.shape,
                chunks=self._chunks(self.sweep.shape, ()),
                dtype=dtype,
                fill_value="" if dtype is str else PENDING,
                dimension_names=self._dims,
                attributes={"long_name": words, **more},
            )

    def status(self) -> np.ndarray:
        """Status of every setting, (size,)."""
        return np.asarray(self._arrays["status"][...]).ravel()

    def leave_out(self, settings: np.ndarray) -> None:
        """Note settings that the constraints leave out, a mask (size,)."""
        status = self.status()
        status[settings] = LEFT_OUT
        with _written(self.path):
            self._arrays["status"][...] = status.reshape(self.sweep.shape)

    def add(self, settled: Settled) -> None:
        """Add what became of a press; it is written with `flush`."""
        place = self._place(settled.press, self.sweep.press_shape)
        for name, values in settled.skin.items():
            self._put(_NAMES.get(name, name), place, values)
        for setting, response in settled.responses.items():
            for name, values in response_values(response).items():
                self._put(name, self._place(setting, self.sweep.shape), values)
        outcomes = {**dict.fromkeys(settled.responses, ""), **settled.failures}
        for setting, reason in outcomes.items():
            place = self._place(setting, self.sweep.shape)
            self._put("reason", place, np.array(reason, dtype=object))
            self._put("status", place, np.array(FAILED if reason else DONE))

    def flush(self) -> None:
        """Write what was added: the status last."""
        with _written(self.path):
            for name, array in self._arrays.items():
                dims = array.metadata.dimension_names
                shape = tuple(self._sizes[dim] for dim in dims)
                if shape != array.shape:
                    array.resize(shape)
                    self._arrays[name] = self._group[name]
            for key in sorted(self._rows, key=lambda key: key[0] == "status"):
                self._write(*key, self._rows[key])
        self._rows.clear()

    def finish(self) -> None:
        """Write the rest, and the table of contents by which a reader opens it faster."""
        self.flush()
        with _written(self.path), warnings.catch_warnings():
            warnings.simplefilter("ignore")  # that it is no part of format 3 yet; readers may leave it out
            library("zarr").consolidate_metadata(self.path)

    @property
    def observed(self) -> bool:
        return HIT_RATE in self._arrays

    def responses(self) -> dict[str, np.ndarray]:
        """Return what observers measure of each receptor, (*shape, n_receptors), by name."""
        return {
            name: np.asarray(self._arrays[name][...]) for name in MEASURED.values() if name in self._arrays
        }

    def write_hit_rates(self, values: np.ndarray) -> None:
        """Write the hit rates of all observers, (*shape, *observer_shape)."""
        shape = self.sweep.observer_shape
        with _written(self.path):
            self._arrays[HIT_RATE] = self._group.create_array(
                HIT_RATE,
                shape=values.shape,
                chunks=(*self._chunks(self.sweep.shape, ()), *shape),
                dtype="f8",
                fill_value=np.nan,
                dimension_names=(*self._dims, *(axis.name for axis in self.sweep.observer_axes)),
                attributes={"long_name": "share of trials in which the standard is told apart", "units": "1"},
                overwrite=True,
            )
            self._arrays[HIT_RATE][...] = values

    def _write(self, name: str, before: tuple[int, ...], block: int, rows: dict[int, np.ndarray]) -> None:
        """Write rows of one block along the last dimension of the sweep."""
        array = self._arrays[name]
        n = len(before) + 1
        if block < 0:
            array[...] = _padded(rows[0], array.shape, array.fill_value)
            return
        size = array.chunks[n - 1]
        first, last = block * size, min((block + 1) * size, array.shape[n - 1])
        place = (*before, slice(first, last))
        shape = array.shape[n:]
        values = (
            np.empty((last - first, *shape), dtype=array.dtype)
            if len(rows) == last - first
            else np.array(array[place])
        )
        for row, given in rows.items():
            values[row - first] = _padded(given, shape, array.fill_value)
        array[place] = values

    def _put(self, name: str, place: tuple[int, ...], values: np.ndarray) -> None:
        if name not in self._arrays:
            self._create(name, values.shape)
        array = self._arrays[name]
        dims = array.metadata.dimension_names[len(place) :]
        for dim, size in zip(dims, values.shape, strict=True):
            self._sizes[dim] = max(size, self._sizes.get(dim, 0))
        if place:
            *before, last = place
            key = (name, tuple(before), last // array.chunks[len(before)])
        else:
            key, last = (name, (), -1), 0
        self._rows.setdefault(key, {})[last] = values

    def _create(self, name: str, shape: tuple[int, ...]) -> None:
        known = self._variables[name]
        outer = self.sweep.press_shape if known.of_press else self.sweep.shape
        dims = (*self._dims[: len(outer)], *known.dims)
        with _written(self.path):
            self._arrays[name] = self._group.create_array(
                name,
                shape=(*outer, *shape),
                chunks=self._chunks(outer, known.dims, shape),
                dtype=known.dtype,
                fill_value=0 if known.dtype == "i4" else np.nan,
                dimension_names=dims,
                attributes={"long_name": known.long_name, "units": known.unit},
            )

    def _chunks(
        self, outer: tuple[int, ...], dims: tuple[str, ...], shape: tuple[int, ...] = ()
    ) -> tuple[int, ...]:
        """Chunks that do not depend on what is found, so that the files have the same bits in any order."""
        sizes = dict(zip(dims, shape, strict=True))
        own = [_CHUNKS.get(dim, size if size <= 6 else _PLACES_IN_CHUNK) for dim, size in sizes.items()]
        of_places = any(dim not in _CHUNKS and size > 6 for dim, size in sizes.items())
        together = [1 if of_places else min(_SETTINGS_IN_CHUNK, last) for last in outer[-1:]]
        return (*(1 for _ in outer[:-1]), *together, *own)

    @staticmethod
    def _place(number: int, shape: tuple[int, ...]) -> tuple[int, ...]:
        return tuple(int(index) for index in np.unravel_index(number, shape)) if shape else ()


@checked
def open_sweep(path: str | Path) -> xarray.Dataset:
    """Open the data set that `run_sweep` wrote; numbers are read when they are used.

    Returns
    -------
    xarray.Dataset
        With dimensions named by the fields that vary; `status` is 1 where a setting is done.
    """
    xarray, _ = library("xarray"), library("zarr")
    check_format(path, _opened(path_of("path", path)).attrs.asdict())
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
    sweep = SweepRequest.read(
        {**content, OBSERVER: dict(observer), "grid": own | varied}, name="observe_sweep"
    )
    kept = [name for name in data.dims if name in {axis.name for axis in sweep.axes}]
    responses = {name: data[name].values for name in MEASURED.values() if name in data}
    values = observe(sweep, responses, data["status"].values == DONE, lambda: None)
    coords: dict[str, Any] = {name: data[name] for name in kept if name in data.coords}
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
def setting_spikes(data: xarray.Dataset) -> SpikeTrains:
    """Spike trains of the receptors of one setting.

    Parameters
    ----------
    data : xarray.Dataset
        From `open_sweep`, with one setting chosen, as by `data.isel(motion_depth_mm=0)`.
    """
    check_sweep_data(data)
    counts = data["spike_count"].values
    if counts.ndim != 1:
        raise InputError(
            f"one setting must be chosen, as with isel: got dimensions {data['spike_count'].dims}."
        )
    offsets = np.concatenate([[0], np.cumsum(counts)])
    return SpikeTrains(data["spike_time_ms"].values[: offsets[-1]], offsets)


def check_format(path: str | Path, attributes: Mapping[str, Any]) -> None:
    """Raise `InputError` unless attributes are those of a sweep of this version."""
    if attributes.get("format") != FORMAT:
        raise InputError(path, "must be a sweep that fingerpad wrote", remedy="it has another content")
    if attributes.get("format_version") != FORMAT_VERSION:
        raise InputError(
            path,
            f"must have format_version {FORMAT_VERSION}",
            str(attributes.get("format_version")),
            "read it with the version of fingerpad that wrote it",
        )


def check_same(path: Path, found: Mapping[str, Any], expected: Mapping[str, Any]) -> None:
    """Raise `InputError` unless a data set is of the same sweep and the same program."""
    check_format(path, found)
    if found["inputs_sha256"] != expected["inputs_sha256"]:
        raise InputError(
            path, "must be of the same sweep", remedy="it is of another one; choose another --out"
        )
    if found["code_hash"] != expected["code_hash"]:
        raise InputError(
            path,
            "must be continued with the same program",
            remedy=f"version {found['version']} began it; choose another --out",
        )


def _opened(path: Path) -> Any:
    """Open a Zarr group for reading and writing."""
    zarr = library("zarr")
    try:
        return zarr.open_group(path, mode="r+", zarr_format=3, use_consolidated=False)
    except Exception as error:  # a folder of unknown content may fail in any way
        raise InputError(
            path, "must be a sweep that fingerpad wrote", remedy=f"it cannot be read ({first_line(error)})"
        ) from error


class _written:
    """Tell of a disk that is full, or a folder that cannot be written, in one sentence."""

    def __init__(self, path: Path):
        self._path = path

    def __enter__(self) -> None:
        return None

    def __exit__(self, kind: type | None, error: BaseException | None, _: object) -> None:
        if isinstance(error, OSError):
            raise StoreError(
                f"{self._path} cannot be written ({error.strerror or error}): make space or choose another, "
                "and run again; what is finished is kept."
            ) from error


def _padded(values: np.ndarray, shape: tuple[int, ...], fill: Any) -> np.ndarray:
    """Values at the beginning of an array of a shape, and a filling after them."""
    if values.shape == shape:
        return values
    padded = np.full(shape, fill, dtype=values.dtype)
    padded[tuple(slice(0, size) for size in values.shape)] = values
    return padded
