"""Stored indentations on disk: found by everything that determines them, computed where missing.

The key of an indentation is a hash of its whole value (finger, indenter, motion, tissues, mesh, tolerances)
and of the bytes of the mechanical sources (`skin.code_hash`). A class of a user's own counts by its
attribute `store_key`, a text that the user changes with the code; without one, each run presses it again.
There is one file per indentation, written atomically: a run that is killed at any moment continues from the
last finished indentation and ends with the same bits. Each file holds its key and a checksum of its
content. A file that was damaged, edited, renamed or written by something else is set aside and computed
again. Files hold arrays only, no code.
"""

from __future__ import annotations

import hashlib
import io
import json
import logging
import math
import time
from collections.abc import Callable, Iterable, Mapping, Sequence
from contextlib import closing
from dataclasses import dataclass, fields, is_dataclass
from functools import cache
from pathlib import Path
from typing import Any
from uuid import uuid4

import numpy as np

from fingerpad.core.checked import checked, checked_class
from fingerpad.core.engine import Engine, engine_of
from fingerpad.core.errors import ConvergenceError, InputError, StoreError
from fingerpad.core.files import check_file, path_of, write_atomically
from fingerpad.core.logger import LOGGER
from fingerpad.core.values import Whole, instance
from fingerpad.mechanics.kernels import KERNELS
from fingerpad.skin.code_hash import PACKAGE, code_hash
from fingerpad.skin.fields import Place, stored_fields
from fingerpad.skin.indentation import Touch
from fingerpad.skin.sampling import SkinResponse

PRESSES = logging.getLogger(__name__)  # Tells of each press that is stored.

_SOLUTION = {
    "force_imbalance": float,
    "energy_imbalance": float,
    "penetration_mm": float,
    "newton_steps": int,
    "factorisations": int,
}
"""Content of the stored array "solution", in this order."""

SUFFIX, ASIDE = ".npz", ".damaged"  # Ends of the names of stored files, and of those that were set aside.
KEY, CHECKSUM = "key", "checksum"  # Names of the arrays by which a stored file knows itself.

OnFailed = Callable[[Touch, ConvergenceError | InputError], None]
"""Told of an indentation that cannot be solved, and why."""


def touch_key(touch: Touch) -> str:
    """Key under which an indentation is stored, 32 hexadecimal digits."""
    text = json.dumps([code_hash(), _plain(touch, _class_key)], sort_keys=True)
    return hashlib.sha256(text.encode()).hexdigest()[:32]


def value_digest(value: Any) -> str:
    """Sixteen hexadecimal digits, the same for equal values: a finger, tissues, a body."""
    plain = _plain(value, lambda kind: kind.__qualname__)
    return hashlib.sha256(json.dumps(plain, sort_keys=True).encode()).hexdigest()[:16]


@cache
def _class_key(kind: type) -> str:
    """Identify a class: one of a user's own without a `store_key` differs between any two processes."""
    if kind.__module__.partition(".")[0] == PACKAGE:
        return kind.__qualname__
    if key := getattr(kind, "store_key", None):
        return f"own {instance('store_key', key, str)}"
    LOGGER.warning(
        "Each run computes the presses of %s again: give the class store_key = 'a name and version'.",
        kind.__name__,
    )
    return f"own {uuid4().hex}"


def _plain(value: Any, name_of: Callable[[type], str], is_float: bool = False) -> Any:
    """Nested lists and exact numbers, the same for equal values and different for different ones."""
    if isinstance(value, np.ndarray) and not value.dtype.hasobject:
        content = np.ascontiguousarray(value + 0.0 if value.dtype.kind == "f" else value)  # -0.0 equals 0.0
        return [value.dtype.str, list(value.shape), hashlib.sha256(content.tobytes()).hexdigest()]
    if is_dataclass(value):
        parts = {
            # Whole numbers in fields of floats are floats: 287 and 287.0 describe the same sphere.
            field.name: _plain(getattr(value, field.name), name_of, "float" in str(field.type))
            for field in fields(value)
            if field.compare
        }
        return [name_of(type(value)), parts]
    if isinstance(value, tuple | list):
        return [_plain(item, name_of, is_float) for item in value]
    if isinstance(value, float | np.floating) or (is_float and isinstance(value, int | np.integer)):
        return (float(value) + 0.0).hex()  # 0.0 added: -0.0 equals 0.0 but is written with its sign
    if isinstance(value, str | int | bool) or value is None:
        return value
    raise InputError(
        "An indentation can only be stored if its parts are frozen dataclasses, numbers, text or arrays: got "
        f"{type(value).__name__}."
    )


@checked_class
class Store:
    """Folder of stored indentations.

    Parameters
    ----------
    folder : Path
        It is created when it is first needed.
    """

    def __init__(self, folder: Path):
        self.folder = path_of("folder", folder)

    def path(self, touch: Touch) -> Path:
        """File of an indentation, whether it exists or not."""
        return self.folder / f"{touch_key(touch)}{SUFFIX}"

    def holds(self, touch: Touch) -> bool:
        """Whether an indentation is stored."""
        return self.path(touch).exists()

    def missing(self, touches: Iterable[Touch]) -> dict[Path, Touch]:
        """Indentations that are not stored, each once, by the file that each belongs into.

        A file that is not what it was when it was written is set aside, with a warning in the log.
        """
        wanted = {self.path(touch): touch for touch in touches}
        return {path: touch for path, touch in wanted.items() if not _is_whole(path)}

    def save(self, touch: Touch, response: SkinResponse) -> None:
        """Write an indentation, as a whole or not at all; `StoreError` if the folder cannot be written."""
        path = self.path(touch)
        write_atomically(path, _packed(response, path.stem))

    def load(self, touch: Touch) -> SkinResponse:
        """Read an indentation; `StoreError` if its file is missing or not what it was when it was written."""
        path = self.path(touch)
        try:
            content = _unpacked(path)
            numbers, linear_solver = content.pop("solution").tolist(), str(content.pop("linear_solver"))
            fields = {field.name: content[field.name].astype(np.float64) for field in stored_fields()}
            solution = {
                name: kind(number) for (name, kind), number in zip(_SOLUTION.items(), numbers, strict=True)
            }
            return touch.response(fields, linear_solver=linear_solver, **solution)
        except Exception as error:  # a file of unknown content may fail in any way
            raise StoreError(
                f"The stored result {path} cannot be read ({_said(error)}): run again, which sets it aside."
            ) from error

    def files(self) -> list[StoredFile]:
        """Describe the files of the store, the oldest first; `StoreError` if the folder cannot be read."""
        try:
            found = [(path, path.stat()) for path in sorted(self.folder.glob(f"*{SUFFIX}"))]
        except OSError as error:
            raise StoreError(f"{self.folder} cannot be read: {error.strerror or error}.") from error
        files = [StoredFile(path, state.st_size, state.st_mtime) for path, state in found]
        return sorted(files, key=lambda file: file.written_s)


@dataclass(frozen=True)
class StoredFile:
    """A file of a store."""

    path: Path  #: The file; its name is the key of the indentation.
    size: int
    written_s: float  #: When it was written, in seconds since 1970.

    @property
    def fault(self) -> str | None:
        """What is wrong with the file; None if it is what it was when it was written."""
        return _fault(self.path)


def pruned(files: Sequence[StoredFile], before_s: float | None, most_bytes: int | None) -> list[StoredFile]:
    """Choose files to delete: those written before a time, then the oldest until the rest is small enough."""
    old = [file for file in files if before_s is not None and file.written_s < before_s]
    left = [file for file in files if file not in old]
    total = sum(file.size for file in left)
    for file in left:
        if most_bytes is None or total <= most_bytes:
            break
        old.append(file)
        total -= file.size
    return old


def _is_whole(path: Path) -> bool:
    """Whether a file is there and what it was when it was written; otherwise it is set aside."""
    if not path.exists():
        return False
    fault = _fault(path)
    if fault is None:
        return True
    aside = path.with_name(f"{path.name}{ASIDE}")
    try:
        path.replace(aside)
    except FileNotFoundError:  # another process has set it aside
        return False
    except OSError as error:
        raise StoreError(
            f"The stored result {path} is damaged and cannot be set aside ({error.strerror or error}): "
            "delete it and run again."
        ) from error
    LOGGER.warning(
        "%s is no stored result (%s): it is kept as %s and computed again.", path, fault, aside.name
    )
    return False


def _fault(path: Path) -> str | None:
    try:
        _unpacked(path)
    except Exception as error:  # a file of unknown content may fail in any way
        return _said(error)
    return None


def _said(error: Exception) -> str:
    if isinstance(error, OSError) and error.strerror:
        return error.strerror
    said = " ".join(str(error).split()).rstrip(".")
    return "it is no archive of arrays" if "pickle" in said or not said else said


def _unpacked(path: Path) -> dict[str, np.ndarray]:
    """Content of a stored file; any error if it is not what it was when it was written."""
    # Opened here, since np.load leaves the file open where the archive is damaged.
    with open(check_file(path, math.inf), "rb") as opened, np.load(opened, allow_pickle=False) as file:
        content = {name: file[name] for name in file.files}
    checksum, key = str(content.pop(CHECKSUM, "")), str(content.pop(KEY, ""))
    if not checksum:
        raise ValueError("it has no checksum")
    if key != path.stem:
        raise ValueError("it is the result of another touch")
    if checksum != _checksum(key, content):
        raise ValueError("its content has another checksum")
    return content


def _checksum(key: str, content: Mapping[str, np.ndarray]) -> str:
    digest = hashlib.sha256(key.encode())
    for name in sorted(content):
        values = np.asarray(content[name])
        digest.update(repr((name, values.dtype.str, values.shape)).encode())
        digest.update(np.ascontiguousarray(values).tobytes())
    return digest.hexdigest()


def _packed(response: SkinResponse, key: str) -> bytes:
    content: dict[str, np.ndarray] = {
        field.name: response.fields[field.name].astype(
            np.float64 if field.place is Place.PRESS else np.float32
        )
        for field in stored_fields()
    }
    content["solution"] = np.array([getattr(response, name) for name in _SOLUTION], dtype=np.float64)
    content["linear_solver"] = np.array(response.linear_solver)
    named = {KEY: np.array(key), CHECKSUM: np.array(_checksum(key, content))}
    buffer = io.BytesIO()
    np.savez(buffer, **content, **named)  # type: ignore[arg-type]
    return buffer.getvalue()


def _compute(item: tuple[Path, Touch], threads: int | None = None) -> float:
    """Solve one indentation and store it at the path; return the seconds it took."""
    # The path is given because a worker would hash the sources as they are at that time.
    path, touch = item
    started = time.perf_counter()
    if not path.exists():  # another worker may have stored it since
        write_atomically(path, _packed(touch.solve(threads), path.stem))
    return time.perf_counter() - started


@checked
def solve_missing(
    missing: Mapping[Path, Touch],
    jobs: Whole | Engine,
    on_finished: Callable[[float], None] | None = None,
    on_failed: OnFailed | None = None,
) -> None:
    """Compute indentations and store them.

    Parameters
    ----------
    missing : mapping of Path to Touch
        From `Store.missing`.
    jobs : int or Engine
        Number of processes, or what else shall do the work; the results do not depend on it.
    on_finished : callable, optional
        Called with the seconds that each indentation took.
    on_failed : callable, optional
        Called with an indentation that cannot be solved and with its error; the others are computed then.

    Raises
    ------
    ConvergenceError, InputError
        Without `on_failed`, if one cannot be solved; those finished before remain in the store.
    """
    # Another process may have another working folder.
    items = [(path.absolute(), touch) for path, touch in missing.items()]
    with closing(engine_of(jobs, KERNELS).map(_compute, items)) as outcomes:
        for number, outcome in outcomes:
            try:
                seconds = outcome()
            except (ConvergenceError, InputError) as error:
                if on_failed is None:
                    raise
                on_failed(items[number][1], error)
            else:
                PRESSES.info("stored %s after %.1f s", items[number][0].name, seconds)
                if on_finished:
                    on_finished(seconds)
