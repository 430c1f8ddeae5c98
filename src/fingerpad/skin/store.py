"""Stored indentations on disk: found by everything that determines them, computed where missing.

The key of an indentation is a hash of its whole value (finger, indenter, motion, tissues, mesh, tolerances)
and of the behaviour of the mechanical sources (`skin.behaviour`). There is one file per indentation, written
atomically: a run that is killed at any moment continues from the last finished indentation and ends with the
same bits.
"""

from __future__ import annotations

import hashlib
import io
import json
import os
import sys
import threading
import time
from collections.abc import Callable, Iterable, Iterator, Mapping
from concurrent.futures import FIRST_COMPLETED, Future, ProcessPoolExecutor, wait
from concurrent.futures.process import BrokenProcessPool
from contextlib import contextmanager
from dataclasses import Field, fields, is_dataclass
from functools import partial
from multiprocessing import get_context
from pathlib import Path
from typing import Any

import numpy as np

from fingerpad.core.checks import whole
from fingerpad.core.compilation import LOGGER, announce_compilation
from fingerpad.core.errors import ConvergenceError, InputError, StoreError
from fingerpad.core.files import write_atomically
from fingerpad.core.threads import available_threads
from fingerpad.mechanics.kernels import KERNELS
from fingerpad.skin.behaviour import code_hash
from fingerpad.skin.code_tags import array_digest, class_tag
from fingerpad.skin.fields import Place, stored_fields
from fingerpad.skin.indentation import Touch
from fingerpad.skin.sampling import SkinResponse

_SOLUTION = {
    "force_imbalance": float,
    "energy_imbalance": float,
    "penetration_mm": float,
    "newton_steps": int,
    "factorisations": int,
}
"""Content of the stored array "solution", in this order."""

OnFailed = Callable[[Touch, ConvergenceError | InputError], None]
"""Told of an indentation that cannot be solved, and why."""

_ONE_THREAD = dict.fromkeys(("OMP_NUM_THREADS", "OPENBLAS_NUM_THREADS"), "1")
_LOOK_FOR_PARENT_S = 0.1


def touch_key(touch: Touch) -> str:
    """Key under which an indentation is stored, 32 hexadecimal digits.

    Examples
    --------
    >>> import fingerpad as fp
    >>> touch = fp.touch_of(fp.Fingertip(), fp.Line())
    >>> len(touch_key(touch)), touch_key(touch) == touch_key(fp.touch_of(fp.Fingertip(), fp.Bar()))
    (32, False)
    """
    text = json.dumps([code_hash(), _plain(touch)], sort_keys=True)
    return hashlib.sha256(text.encode()).hexdigest()[:32]


def _plain(value: Any, is_float: bool = False) -> Any:
    """Nested lists and exact numbers, the same for equal values and different for different ones."""
    if isinstance(value, np.ndarray) and not value.dtype.hasobject:
        return array_digest(value)
    if is_dataclass(value):
        return [
            class_tag(type(value)),
            {
                field.name: _plain(getattr(value, field.name), _holds_floats(field))
                for field in fields(value)
                if field.compare
            },
        ]
    if isinstance(value, tuple | list):
        return [_plain(item, is_float) for item in value]
    if isinstance(value, float | np.floating) or (is_float and isinstance(value, int | np.integer)):
        return (float(value) + 0.0).hex()  # 0.0 added: -0.0 equals 0.0 but is written with its sign
    if isinstance(value, str | int | bool) or value is None:
        return value
    raise InputError(
        "An indentation can only be stored if its parts are frozen dataclasses, numbers, text or arrays: got "
        f"{type(value).__name__}."
    )


def _holds_floats(field: Field[Any]) -> bool:
    """Whether whole numbers in this field are floats: 287 and 287.0 describe the same sphere."""
    return "float" in str(field.type)


class Store:
    """Folder of stored indentations.

    Parameters
    ----------
    folder : Path
        It is created when it is first needed.
    """

    def __init__(self, folder: Path):
        self.folder = Path(folder)

    def path(self, touch: Touch) -> Path:
        """File of an indentation, whether it exists or not."""
        return self.folder / f"{touch_key(touch)}.npz"

    def holds(self, touch: Touch) -> bool:
        """Whether an indentation is stored."""
        return self.path(touch).exists()

    def missing(self, touches: Iterable[Touch]) -> dict[Path, Touch]:
        """Indentations that are not stored, each once, by the file that each belongs into."""
        wanted = {self.path(touch): touch for touch in touches}
        return {path: touch for path, touch in wanted.items() if not path.exists()}

    def save(self, touch: Touch, response: SkinResponse) -> None:
        """Write an indentation, as a whole or not at all.

        Raises
        ------
        StoreError
            If the folder cannot be written.
        """
        write_atomically(self.path(touch), _packed(response))

    def load(self, touch: Touch) -> SkinResponse:
        """Read an indentation.

        Raises
        ------
        StoreError
            If its file is missing or damaged, or its fields have not the shapes of this touch.
        """
        path = self.path(touch)
        try:
            # Opened here, since np.load leaves the file open where the archive is damaged.
            with open(path, "rb") as opened, np.load(opened, allow_pickle=False) as file:
                fields = {field.name: file[field.name].astype(np.float64) for field in stored_fields()}
                numbers, linear_solver = file["solution"].tolist(), str(file["linear_solver"])
            solution = {
                name: kind(number) for (name, kind), number in zip(_SOLUTION.items(), numbers, strict=True)
            }
            return touch.response(fields, linear_solver=linear_solver, **solution)
        except Exception as error:  # a file of unknown content may fail in any way
            said = " ".join(str(error).split()).rstrip(".")
            raise StoreError(
                f"The stored result {path} cannot be read ({said}): delete it and run again."
            ) from error


def _packed(response: SkinResponse) -> bytes:
    """Content of a stored file."""
    content: dict[str, Any] = {
        field.name: response.fields[field.name].astype(
            np.float64 if field.place is Place.PRESS else np.float32
        )
        for field in stored_fields()
    }
    solution = np.array([getattr(response, name) for name in _SOLUTION], dtype=np.float64)
    buffer = io.BytesIO()
    np.savez(buffer, **content, solution=solution, linear_solver=np.array(response.linear_solver))
    return buffer.getvalue()


def _compute(touch: Touch, path: Path, threads: int | None = None) -> float:
    """Solve one indentation and store it at `path`; return the seconds it took.

    The path is an argument because a worker would hash the sources as they are at that time.
    """
    started = time.perf_counter()
    write_atomically(path, _packed(touch.solve(threads)))
    return time.perf_counter() - started


def solve_missing(
    missing: Mapping[Path, Touch],
    jobs: int,
    on_finished: Callable[[float], None] | None = None,
    on_failed: OnFailed | None = None,
) -> None:
    """Compute indentations and store them.

    Parameters
    ----------
    missing : mapping of Path to Touch
        From `Store.missing`.
    jobs : int
        Number of processes; the results do not depend on it.
    on_finished : callable, optional
        Called with the seconds that each indentation took.
    on_failed : callable, optional
        Called with an indentation that cannot be solved and with its error; the others are computed then.

    Raises
    ------
    ConvergenceError, InputError
        Without `on_failed`, if one cannot be solved; those finished before remain in the store.
    """
    whole("jobs", jobs, at_least=1)
    in_processes = jobs > 1 and len(missing) > 1
    for seconds in _in_processes(missing, jobs, on_failed) if in_processes else _in_turn(missing, on_failed):
        if on_finished and seconds is not None:
            on_finished(seconds)


def _seconds(compute: Callable[[], float], touch: Touch, on_failed: OnFailed | None) -> float | None:
    """Seconds that an indentation took; None if it failed, which `on_failed` then knows."""
    try:
        return compute()
    except (ConvergenceError, InputError) as error:
        if on_failed is None:
            raise
        on_failed(touch, error)
        return None


def _in_turn(touches: Mapping[Path, Touch], on_failed: OnFailed | None) -> Iterator[float | None]:
    for path, touch in touches.items():
        yield _seconds(partial(_compute, touch, path), touch, on_failed)


def _in_processes(
    touches: Mapping[Path, Touch], jobs: int, on_failed: OnFailed | None
) -> Iterator[float | None]:
    processes = min(jobs, len(touches))
    threads = max(1, available_threads() // processes)
    with (
        announce_compilation(KERNELS),
        _environment(_ONE_THREAD),
        ProcessPoolExecutor(processes, get_context("spawn"), _begin, (os.getpid(),)) as pool,
    ):
        pressed: dict[Future[float], Touch] = {
            pool.submit(_compute, touch, path, threads): touch for path, touch in touches.items()
        }
        waiting = set(pressed)
        try:
            while waiting:
                done, waiting = wait(waiting, return_when=FIRST_COMPLETED)
                for future in done:
                    yield _seconds(future.result, pressed[future], on_failed)
        except BrokenProcessPool as error:
            raise StoreError(
                "A worker process was ended from outside (out of memory?): run again, perhaps with fewer "
                "jobs; finished indentations are kept."
            ) from error
        finally:
            pool.shutdown(wait=False, cancel_futures=True)


@contextmanager
def _environment(variables: dict[str, str]) -> Iterator[None]:
    """Set environment variables of new processes: one thread each for the libraries."""
    before = {name: os.environ.get(name) for name in variables}
    os.environ.update(variables)
    try:
        yield
    finally:
        for name, value in before.items():
            if value is None:
                del os.environ[name]
            else:
                os.environ[name] = value


def _begin(parent: int) -> None:
    """Set up a worker, which logs nothing: its parent logs the compilation."""
    LOGGER.disabled = True
    _end_with_parent(parent)


def _end_with_parent(parent: int) -> None:
    """End a worker when its parent was killed, which it would not notice otherwise."""

    def watch() -> None:
        while os.getppid() == parent:
            time.sleep(_LOOK_FOR_PARENT_S)
        os._exit(1)

    if sys.platform != "win32":
        threading.Thread(target=watch, daemon=True).start()
