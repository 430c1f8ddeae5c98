"""Run of a sweep: what is not done yet is pressed by an engine, and written as it comes.

The results are one labelled data set in Zarr format 3.

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

import hashlib
import json
import time
import warnings
from collections.abc import Iterator, Mapping, Sequence
from contextlib import closing, contextmanager
from dataclasses import dataclass
from datetime import UTC, datetime
from itertools import groupby
from pathlib import Path
from typing import Any

import numpy as np

from fingerpad.core.checked import checked
from fingerpad.core.displayed import Variable, udunits
from fingerpad.core.engine import Engine, engine_of
from fingerpad.core.errors import InputError, StoreError
from fingerpad.core.files import path_of
from fingerpad.core.progress import NoProgress, Progress
from fingerpad.core.units import unit_of
from fingerpad.core.values import Flag, Whole
from fingerpad.experiments.runner import STORE_FOLDER, software
from fingerpad.experiments.sweep.request import SweepRequest
from fingerpad.experiments.sweep.settings import MEASURED, Case, Settled, observe, settle, unsettled
from fingerpad.export.results import check_format, first_line, library
from fingerpad.mechanics.kernels import KERNELS
from fingerpad.skin.dataset import field_variable
from fingerpad.skin.fields import FIELDS

FORMAT, FORMAT_VERSION = "fingerpad sweep", 1

PENDING, DONE, FAILED, LEFT_OUT = range(4)

HIT_RATE = "hit_rate"  # Variable of what observers find.

_SETTINGS_IN_CHUNK = 64
_CHUNKS = {"time": 64, "receptor": 512, "spike": 1024}
_PLACES_IN_CHUNK = 4096
_NAMES = {"times_ms": "time_ms"}

MOST_SETTINGS = 10_000  # Larger sweeps need the consent of who runs them.

_WRITE_EVERY_S, _WRITE_EVERY = 5.0, 256
"""How often what is done is written: after so much time, or so many settings."""


@dataclass(frozen=True)
class SweepOutcome:
    """What a run of a sweep did."""

    path: Path  #: The data set.
    settings: int
    done: int
    failed: int
    left_out: int
    """Number of settings: all, those with a result, those that failed, those that `where` leaves out."""
    pressed: int
    loaded: int  #: Presses that this run solved, and those that it read from the store.
    press_s: float
    wall_s: float  #: Time of all presses, summed over processes, and on the clock. [s]

    @property
    def lines(self) -> tuple[str, ...]:
        return (
            f"{self.done} of {self.settings - self.left_out} settings done, {self.failed} failed; "
            f"{self.pressed} pressed and {self.loaded} loaded in {self.wall_s:.1f} s."
            + (" The variable `reason` says why; --retry-failed tries again." if self.failed else ""),
            f"Results: {self.path}",
        )


def check_sweep(sweep: SweepRequest, out: Path, any_size: bool = False) -> None:
    """Raise `InputError` if a sweep is impossible, larger than `MOST_SETTINGS`, or has no place."""
    if out.suffix != ".zarr":
        raise InputError(f"A sweep is written as .zarr: got {out.name}.")
    for shape, of in ((sweep.shape, "settings"), (sweep.observer_shape, "settings of its observer")):
        if (size := int(np.prod(shape))) > MOST_SETTINGS and not any_size:
            raise InputError(
                f"{sweep.origin.name} must have at most {MOST_SETTINGS} {of}, or --yes be given: it has "
                f"{size}, {' x '.join(map(str, shape))}."
            )
    sweep.check()


@checked
def sweep(
    request: Any = None,
    *,
    out: str | Path,
    jobs: Whole | Engine = 1,
    progress: Progress | None = None,
    command: str | None = None,
    allow_python: Flag = False,
    retry_failed: Flag = False,
    any_size: Flag = False,
    store: str | Path | None = None,
    **given: Any,
) -> SweepOutcome:
    """Press all settings of a sweep, let the afferents respond, and write one labelled data set.

    What is done already is not done again: the same call goes on after an interruption. A setting that cannot
    be pressed has its reason in the data set, and the others are pressed.

    Parameters
    ----------
    request : str, Path, mapping or SweepRequest, optional
        A YAML file (docs/sweeps.md), or its content.
    out : str or Path
        The data set, a folder that ends in .zarr.
    jobs : int or Engine
        Number of processes, or a `Cluster`; the numbers do not depend on it.
    progress, command, allow_python
        As of `touch`.
    retry_failed : bool
        Whether settings that failed are tried again.
    any_size : bool
        Whether there may be more than `MOST_SETTINGS` settings.
    store : str or Path, optional
        Folder of stored indentations; by default `indentations` beside `out`.
    **given
        Keys of the request, such as `touch` and `grid`.

    Raises
    ------
    InputError
        If the sweep is impossible or too large, or `out` holds something else; nothing is pressed then.
    StoreError
        If something cannot be written; what is finished is kept.

    Examples
    --------
    >>> from tempfile import TemporaryDirectory
    >>> touch = {"object": "sphere", "motion": {"hold_ms": 100}}
    >>> with TemporaryDirectory() as folder:
    ...     outcome = sweep(touch=touch, grid={"motion.depth_mm": [0.2]}, out=Path(folder) / "study.zarr")
    >>> outcome.done, outcome.pressed
    (1, 1)
    """
    asked: SweepRequest = SweepRequest.read(request, given, allow_python)
    out, began = Path(out), time.perf_counter()
    check_sweep(asked, out, any_size)
    folder = out.parent / STORE_FOLDER if store is None else Path(store)
    engine = engine_of(jobs, KERNELS)
    file = SweepFile(out, asked, _attributes(asked, command or ""))
    file.leave_out()
    status = file.status()
    todo = (status == PENDING) | ((status == FAILED) & retry_failed)
    cases = unsettled(asked, ~todo, folder)
    pressed, loaded, press_s = _settle(engine, cases, file, progress or NoProgress())
    if asked.observers and (cases or not file.observed):
        _observe(file, progress or NoProgress())
    done, failed, left_out = (int((file.status() == kind).sum()) for kind in (DONE, FAILED, LEFT_OUT))
    wall_s = time.perf_counter() - began
    return SweepOutcome(out, asked.size, done, failed, left_out, pressed, loaded, press_s, wall_s)


def _settle(
    engine: Engine, cases: Sequence[Case], file: SweepFile, progress: Progress
) -> tuple[int, int, float]:
    """Do the cases; count those pressed and loaded, and sum the time of the presses."""
    pressed, loaded, press_s = 0, 0, 0.0
    waiting, written = 0, time.monotonic()
    try:
        with progress.stage("presses", len(cases)) as advance, closing(engine.map(settle, cases)) as outcomes:
            for _, outcome in outcomes:
                settled = outcome()
                file.add(settled)
                pressed += settled.pressed
                loaded += not settled.pressed and bool(settled.skin)
                press_s += settled.seconds
                waiting += len(settled.responses) + len(settled.failures)
                if waiting >= _WRITE_EVERY or time.monotonic() - written > _WRITE_EVERY_S:
                    file.flush()
                    waiting, written = 0, time.monotonic()
                advance()
    finally:
        file.finish()
    return pressed, loaded, press_s


def _observe(file: SweepFile, progress: Progress) -> None:
    sweep = file.sweep
    along, _ = sweep.stimuli_axis(sweep.observers[0])
    with progress.stage("observers", sweep.size // sweep.shape[along]) as advance:
        if responses := file.responses():
            done = file.status().reshape(sweep.shape) == DONE
            file.write_hit_rates(observe(sweep, responses, done, advance))
    file.finish()


def _attributes(sweep: SweepRequest, command: str) -> Mapping[str, object]:
    """Provenance of a data set."""
    found = software()
    return {
        "title": sweep.title,
        "sweep": json.dumps(sweep.written()),
        "source": sweep.origin.name,
        "inputs_sha256": hashlib.sha256(sweep.hashed.encode()).hexdigest(),
        **{name: found[name] for name in ("version", "code_hash", "packages", "platform")},
        "seed": sweep.described(0).afferents.seed,
        **({} if sweep.sample is None else {"sample_seed": sweep.sample.seed}),
        "started": datetime.now(UTC).isoformat(timespec="seconds"),
        "command": command,
    }


class SweepFile:
    """The data set of a sweep, opened for writing."""

    def __init__(self, path: Path, sweep: SweepRequest, attributes: Mapping[str, Any]):
        zarr = library("zarr")
        self.path, self.sweep = path_of("path", path), sweep
        self._dims = tuple(axis.name for axis in sweep.axes)
        self._rows: dict[str, dict[tuple[int, ...], np.ndarray]] = {}  # By name, and by place.
        with _written(self.path):
            if self.path.exists() and any(self.path.iterdir()):
                self._group = opened_group(self.path)
                check_same(self.path, self._group.attrs.asdict(), attributes)
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
            "flag_meanings": "pending done failed left_out",
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

    def leave_out(self) -> None:
        """Note the settings that do not meet the constraints, once."""
        sweep, status = self.sweep, self.status()
        if not sweep.where or (status == LEFT_OUT).any():
            return
        allowed = np.array([sweep.allowed(setting) for setting in range(sweep.size)], dtype=bool)
        if not allowed.all():
            status[~allowed] = LEFT_OUT
            with _written(self.path):
                self._arrays["status"][...] = status.reshape(sweep.shape)

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
            for name in sorted(self._rows, key=lambda name: name == "status"):
                self._write(name, self._rows[name])
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

    def _write(self, name: str, rows: Mapping[tuple[int, ...], np.ndarray]) -> None:
        """Write rows at their places; those along the last dimension of the sweep together."""
        array = self._arrays[name]
        for before, together in groupby(sorted(rows), key=lambda place: place[:-1]):
            places = list(together)
            shape = array.shape[len(places[0]) :]
            values = np.stack([_padded(rows[place], shape, array.fill_value) for place in places])
            if places[0]:
                array.oindex[(*before, [place[-1] for place in places])] = values
            else:  # the same for all settings
                array[...] = values[0]

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
        self._rows.setdefault(name, {})[place] = values

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


def check_same(path: Path, found: Mapping[str, Any], expected: Mapping[str, Any]) -> None:
    """Raise `InputError` unless a data set is of the same sweep and the same program."""
    check_format(path, found, FORMAT, FORMAT_VERSION)
    if found["inputs_sha256"] != expected["inputs_sha256"]:
        remedy = "it is of another one; choose another --out"
        raise InputError(path, "must be of the same sweep", remedy=remedy)
    if found["code_hash"] != expected["code_hash"]:
        remedy = f"version {found['version']} began it; choose another --out"
        raise InputError(path, "must be continued with the same program", remedy=remedy)


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
    padded = np.full(shape, fill, dtype=values.dtype)
    padded[tuple(map(slice, values.shape))] = values
    return padded
