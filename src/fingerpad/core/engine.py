"""Work that is shared between processes: one protocol, and processes on this computer as its default.

An `Engine` calls a function for each of several items and hands over each outcome when it is there.
`Processes` does so on this computer, `fingerpad.experiments.cluster.Cluster` on others. The function itself
writes what is to be kept, so that nothing finished is lost with a process.
"""

from __future__ import annotations

import os
import signal
import sys
import threading
import time
from collections.abc import Callable, Generator, Iterator, Sequence
from concurrent.futures import FIRST_COMPLETED, Future, ProcessPoolExecutor, wait
from concurrent.futures.process import BrokenProcessPool
from contextlib import contextmanager
from functools import partial
from multiprocessing import get_context
from typing import Any, Protocol, cast, runtime_checkable

from fingerpad.core.checked import value_class
from fingerpad.core.compilation import announce_compilation
from fingerpad.core.errors import StoreError
from fingerpad.core.logger import LOGGER
from fingerpad.core.threads import available_threads
from fingerpad.core.values import Count

Work = Callable[[Any, int | None], Any]
"""Called with an item and the number of threads that it may use; None for all. It must be known by name to
another process, as functions of a module and their `partial` are."""

Outcome = Callable[[], Any]  # Returns what the work returned, or raises what it raised.

Outcomes = Generator[tuple[int, Outcome], None, None]
"""Numbers of finished items with their outcomes; closing it ends the work."""

_ONE_THREAD = dict.fromkeys(("OMP_NUM_THREADS", "OPENBLAS_NUM_THREADS"), "1")
_LOOK_FOR_PARENT_S = 0.1


@runtime_checkable
class Engine(Protocol):
    """Something that does work on items, in any order."""

    @property
    def width(self) -> int:
        """Items that are done at a time."""
        ...

    def map(self, work: Work, items: Sequence[Any]) -> Outcomes:
        """Call `work` once per item; give the number of each item that is finished, and its outcome."""
        ...


@value_class
class Processes:
    """Engine of this computer: one process per job, or this process alone."""

    jobs: Count = 1  #: Number of processes. With one, or for one item, work is done here with all threads.
    kernels: Sequence[Any] = ()  #: Those that the work calls: their compilation is announced.

    @property
    def width(self) -> int:
        """Items that are done at a time."""
        return self.jobs

    def map(self, work: Work, items: Sequence[Any]) -> Outcomes:
        """Do the work; as of `Engine`."""
        if self.jobs > 1 and len(items) > 1:
            yield from self._in_processes(work, items)
        else:
            for number, item in enumerate(items):
                yield number, partial(work, item, None)

    def _in_processes(self, work: Work, items: Sequence[Any]) -> Outcomes:
        processes = min(self.jobs, len(items))
        threads = max(1, available_threads() // processes)
        with announce_compilation(self.kernels), _environment(_ONE_THREAD), _workers(processes) as pool:
            under_way: dict[Future[Any], int] = {}
            numbers = iter(range(len(items)))
            while True:
                # A few wait in line, so that no process is idle, and not all: there may be a million.
                for _, number in zip(range(4 * processes - len(under_way)), numbers, strict=False):
                    with _signals_later():
                        under_way[pool.submit(work, items[number], threads)] = number
                if not under_way:
                    break
                done, _ = wait(under_way, return_when=FIRST_COMPLETED)
                for future in done:
                    yield under_way.pop(future), partial(_result, future)


@contextmanager
def _workers(processes: int) -> Iterator[ProcessPoolExecutor]:
    """Start workers: after an error they finish what they do, after Ctrl-C and SIGTERM they are killed."""
    pool = ProcessPoolExecutor(processes, get_context("spawn"), _begin, (os.getpid(),))
    try:
        yield pool
        pool.shutdown()
    except BaseException as error:
        # A caller that is interrupted closes the generator of outcomes while it handles the interruption.
        if isinstance(error, KeyboardInterrupt) or isinstance(error.__context__, KeyboardInterrupt):
            _kill_workers(pool)
        try:
            pool.shutdown(cancel_futures=True)
        except KeyboardInterrupt:
            _kill_workers(pool)
            raise
        raise


@contextmanager
def _signals_later() -> Iterator[None]:
    """Let Ctrl-C and SIGTERM wait for the end of the block, so that no process is left half started."""
    # A process that starts within it inherits that it receives no Ctrl-C.
    if sys.platform == "win32" or threading.current_thread() is not threading.main_thread():
        yield
        return
    came: list[int] = []
    # A mask is one thread's, and a signal may come to another, whose handler still runs here.
    before = {
        number: signal.signal(number, lambda each, _: came.append(each))
        for number in (signal.SIGINT, signal.SIGTERM)
    }
    mask = signal.pthread_sigmask(signal.SIG_BLOCK, {signal.SIGINT})
    try:
        yield
    finally:
        signal.pthread_sigmask(signal.SIG_SETMASK, mask)
        for number, handler in before.items():
            signal.signal(number, handler)
        for each in came:
            signal.raise_signal(each)


def _result(future: Future[Any]) -> Any:
    """Return what a worker returned, or raise what it raised."""
    try:
        return future.result()
    except BrokenProcessPool as error:
        raise StoreError(
            "A worker process was ended from outside (out of memory?): run again, perhaps with fewer "
            "jobs; finished indentations are kept."
        ) from error


def _kill_workers(pool: ProcessPoolExecutor) -> None:
    """End workers in the middle of their work: what they have finished is written, the rest is not wanted."""
    # Public as `kill_workers` only from Python 3.14 on.
    for process in list((pool._processes or {}).values()):
        process.kill()


def engine_of(jobs: int | Engine, kernels: Sequence[Any] = ()) -> Engine:
    """Return an engine for what a caller gives as `jobs`: a number of processes, or an engine."""
    if hasattr(jobs, "map"):
        return cast(Engine, jobs)
    return Processes(cast(int, jobs), kernels)


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
    # Ctrl-C reaches all processes of a terminal; the parent ends the workers.
    signal.signal(signal.SIGINT, signal.SIG_IGN)
    LOGGER.disabled = True
    if sys.platform != "win32":
        threading.Thread(target=_end_with_parent, args=(parent,), daemon=True).start()


def _end_with_parent(parent: int) -> None:
    """End a worker when its parent was killed, which it would not notice otherwise."""
    while os.getppid() == parent:
        time.sleep(_LOOK_FOR_PARENT_S)
    os._exit(1)
