"""How many threads compiled loops use, and who may use them: docs/decisions/threads.md."""

from __future__ import annotations

import os
import threading
from collections.abc import Callable, Iterator, Sequence
from concurrent.futures import ThreadPoolExecutor
from contextlib import contextmanager
from dataclasses import dataclass, field
from itertools import starmap
from typing import Any

import numba

from fingerpad.checks import whole
from fingerpad.errors import FingerpadError, InputError


@dataclass
class _Pool:
    """What this process knows of Numba's threads."""

    one_at_a_time: threading.RLock = field(default_factory=threading.RLock)
    lost: bool = False

    def forked(self) -> None:
        """Begin anew in a child process: nobody holds the lock, and OpenMP's threads stayed behind."""
        self.one_at_a_time = threading.RLock()
        self.lost = self.lost or _layer() == "omp"


_POOL = _Pool()
if hasattr(os, "register_at_fork"):  # not on Windows, where nothing forks
    os.register_at_fork(after_in_child=_POOL.forked)


def _layer() -> str:
    """Library that runs Numba's threads in this process, or nothing before the first threaded loop."""
    try:
        return str(numba.threading_layer())
    except ValueError:
        return ""


def available_threads() -> int:
    """Threads that compiled loops may use in this process, one per core unless NUMBA_NUM_THREADS is set."""
    return int(numba.config.NUMBA_NUM_THREADS)  # type: ignore[attr-defined]


@contextmanager
def compiled_threads(threads: int | None = None) -> Iterator[int]:
    """Let compiled loops use so many threads for a while; afterwards Numba has its own number again.

    Python threads that come here together go in one after the other.

    Parameters
    ----------
    threads : int, optional
        Number of threads; by default Numba's own, one per core unless the caller has set another.

    Yields
    ------
    int
        The number of threads.

    Raises
    ------
    InputError
        If there are not so many.
    FingerpadError
        In a process that was forked after OpenMP had run loops in its parent.

    Examples
    --------
    >>> with compiled_threads(1) as threads:
    ...     print(threads, numba.get_num_threads())
    1 1
    """
    most = available_threads()
    if threads is not None and whole("threads", threads, at_least=1) > most:
        raise InputError(f"threads must not exceed {most}, what Numba has here: got {threads}.")
    if _POOL.lost:
        raise FingerpadError(
            "This process was forked from one that had used its threads, and OpenMP would end it: start "
            'processes by "spawn" (multiprocessing.get_context), or set NUMBA_THREADING_LAYER=workqueue.'
        )
    with _POOL.one_at_a_time:
        before = numba.get_num_threads()
        numba.set_num_threads(threads or before)
        try:
            yield numba.get_num_threads()
        finally:
            numba.set_num_threads(before)


Work = Callable[[int, int], Any]
"""Compiled work on consecutive numbers, from the first up to but not including the last."""


@contextmanager
def worker_threads() -> Iterator[Callable[[Work, Sequence[tuple[int, int]]], list[Any]]]:
    """Share work out to as many threads as compiled loops may use.

    The work must release Python's lock (nogil=True), and no two chunks of one call may write to the same
    place. A thread that is done with a chunk takes the next one, so none waits for a slower one.

    Yields
    ------
    callable
        Called with the work and its chunks (first, last); returns the answers in the order of the chunks.

    Examples
    --------
    >>> with worker_threads() as each:
    ...     each(lambda first, last: last - first, [(0, 4), (4, 9)])
    [4, 5]
    """
    threads = numba.get_num_threads()
    if threads == 1:
        yield lambda work, chunks: list(starmap(work, chunks))
        return
    with ThreadPoolExecutor(threads) as pool:
        yield lambda work, chunks: list(pool.map(work, *zip(*chunks, strict=True)))
