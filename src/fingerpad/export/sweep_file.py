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
from collections.abc import Iterator, Mapping
from contextlib import contextmanager
from pathlib import Path
from typing import Any

import numpy as np

from fingerpad.core.displayed import Variable, udunits
from fingerpad.core.errors import InputError, StoreError
from fingerpad.core.files import path_of
from fingerpad.core.units import unit_of
from fingerpad.experiments.sweep.request import SweepRequest
from fingerpad.experiments.sweep.settings import MEASURED, Settled
from fingerpad.export.results import first_line, library
from fingerpad.skin.dataset import field_variable
from fingerpad.skin.fields import FIELDS

FORMAT, FORMAT_VERSION = "fingerpad sweep", 1

PENDING, DONE, FAILED, LEFT_OUT = range(4)

MEANINGS = "pending done failed left_out"

HIT_RATE = "hit_rate"  # Variable of what observers find.

_SETTINGS_IN_CHUNK = 64
_CHUNKS = {"time": 64, "receptor": 512, "spike": 1024}
_PLACES_IN_CHUNK = 4096
_NAMES = {"times_ms": "time_ms"}


class SweepFile:
    """The data set of a sweep, opened for writing."""

    def __init__(self, path: Path, sweep: SweepRequest, attributes: Mapping[str, Any]):
        zarr = library("zarr")
        self.path, self.sweep = path_of("path", path), sweep
        self._dims = tuple(axis.name for axis in sweep.axes)
        self._rows: dict[tuple[str, tuple[int, ...], int], dict[int, np.ndarray]] = {}
        with _written(self.path):
            if self.path.exists() and any(self.path.iterdir()):
                opened = opened_group(self.path)
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
                written = np.array(spelled, dtype=object) if text else np.array(values, dtype=float)
                about = {"long_name": field, "units": "1" if text else udunits(unit_of(field))}
                self._create(name, (axis.name,), written.shape, str if text else "f8", about)[:] = written
        flags = {
            "flag_values": [PENDING, DONE, FAILED, LEFT_OUT],
            "flag_meanings": MEANINGS,
            "long_name": "what became of each setting",
        }
        chunks = self._chunks(self.sweep.shape, ())
        self._create("status", self._dims, self.sweep.shape, "i1", flags, chunks)
        self._create("reason", self._dims, self.sweep.shape, str, {"long_name": "why it failed"}, chunks)

    def _create(
        self,
        name: str,
        dims: tuple[str, ...],
        shape: tuple[int, ...],
        dtype: Any,
        attributes: Mapping[str, Any],
        chunks: Any = "auto",
    ) -> Any:
        """Make an array that is filled with NaN, 0 or an empty text, in the place of one of this name."""
        return self._group.create_array(
            name,
            shape=shape,
            chunks=chunks,
            dtype=dtype,
            fill_value="" if dtype is str else np.nan if np.dtype(dtype).kind == "f" else 0,
            dimension_names=dims,
            attributes=dict(attributes),
            overwrite=True,
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
        sweep = self.sweep
        for name, values in settled.skin.items():
            self._put(_NAMES.get(name, name), settled.press, sweep.press_shape, _of_press(name, values))
        for setting, response in settled.responses.items():
            for name, variable in response.contents()[0].items():
                if name != "type":  # texts; the sweep describes the population
                    self._put(name, setting, sweep.shape, variable)
        outcomes = {**dict.fromkeys(settled.responses, ""), **settled.failures}
        for setting, reason in outcomes.items():
            self._put("reason", setting, sweep.shape, ((), np.array(reason, dtype=object), {}))
            self._put("status", setting, sweep.shape, ((), np.array(FAILED if reason else DONE), {}))

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
        dims = (*self._dims, *(axis.name for axis in self.sweep.observer_axes))
        about = {"long_name": "share of trials in which the standard is told apart", "units": "1"}
        chunks = (*self._chunks(self.sweep.shape, ()), *self.sweep.observer_shape)
        with _written(self.path):
            self._arrays[HIT_RATE] = self._create(HIT_RATE, dims, values.shape, "f8", about, chunks)
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

    def _put(self, name: str, number: int, outer: tuple[int, ...], variable: Variable) -> None:
        """Keep the variable of a setting or a press; the first of a name makes its array."""
        place = tuple(int(index) for index in np.unravel_index(number, outer)) if outer else ()
        dims, values, attributes = variable
        if name not in self._arrays:
            shape, chunks = (*outer, *values.shape), self._chunks(outer, dims, values.shape)
            dims = (*self._dims[: len(outer)], *dims)
            with _written(self.path):
                self._arrays[name] = self._create(name, dims, shape, values.dtype, attributes, chunks)
        array = self._arrays[name]
        for dim, size in zip(array.metadata.dimension_names[len(place) :], values.shape, strict=True):
            self._sizes[dim] = max(size, self._sizes.get(dim, 0))
        if place:
            *before, last = place
            key = (name, tuple(before), last // array.chunks[len(before)])
        else:
            key, last = (name, (), -1), 0
        self._rows.setdefault(key, {})[last] = values

    def _chunks(
        self, outer: tuple[int, ...], dims: tuple[str, ...], shape: tuple[int, ...] = ()
    ) -> tuple[int, ...]:
        """Chunks that do not depend on what is found, so that the files have the same bits in any order."""
        sizes = dict(zip(dims, shape, strict=True))
        own = [_CHUNKS.get(dim, size if size <= 6 else _PLACES_IN_CHUNK) for dim, size in sizes.items()]
        of_places = any(dim not in _CHUNKS and size > 6 for dim, size in sizes.items())
        together = [1 if of_places else min(_SETTINGS_IN_CHUNK, last) for last in outer[-1:]]
        return (*(1 for _ in outer[:-1]), *together, *own)


def _of_press(name: str, values: np.ndarray) -> Variable:
    """Variable of a field, or of the places of fields."""
    if name in FIELDS:
        return field_variable(FIELDS[name], values)
    return (name.removesuffix("_mm"), "axis"), values, {"long_name": "undeformed position", "units": "mm"}


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


def opened_group(path: Path) -> Any:
    """Open a Zarr group for reading and writing."""
    zarr = library("zarr")
    try:
        return zarr.open_group(path, mode="r+", zarr_format=3, use_consolidated=False)
    except Exception as error:  # a folder of unknown content may fail in any way
        raise InputError(
            path, "must be a sweep that fingerpad wrote", remedy=f"it cannot be read ({first_line(error)})"
        ) from error


@contextmanager
def _written(path: Path) -> Iterator[None]:
    """Tell of a disk that is full, or a folder that cannot be written, in one sentence."""
    try:
        yield
    except OSError as error:
        raise StoreError(
            f"{path} cannot be written ({error.strerror or error}): make space or choose another, "
            "and run again; what is finished is kept."
        ) from error


def _padded(values: np.ndarray, shape: tuple[int, ...], fill: Any) -> np.ndarray:
    """Values at the beginning of an array of a shape, and a filling after them."""
    if values.shape == shape:
        return values
    padded = np.full(shape, fill, dtype=values.dtype)
    padded[tuple(slice(0, size) for size in values.shape)] = values
    return padded
