"""How many threads share the work of compiled loops, and how it is shared: docs/decisions/threads.md."""

from __future__ import annotations

import os
from collections.abc import Callable, Iterator, Sequence
from concurrent.futures import ThreadPoolExecutor
from contextlib import contextmanager
from contextvars import ContextVar
from functools import cache
from itertools import starmap
from typing import Any

import numba

from fingerpad.core.checks import whole
from fingerpad.core.errors import InputError

_THREADS: ContextVar[int | None] = ContextVar("threads", default=None)


@cache
def _helpers(threads: int) -> ThreadPoolExecutor:
    """Threads that help the one that asks; they wait, without turning, until they are asked again."""
    return ThreadPoolExecutor(threads - 1, thread_name_prefix="fingerpad")


if hasattr(os, "register_at_fork"):  # not on Windows, where nothing forks
    # The threads of a parent stay behind: a child gets its own.
    os.register_at_fork(after_in_child=_helpers.cache_clear)


def available_threads() -> int:
    """Threads that compiled loops may use in this process, one per core unless NUMBA_NUM_THREADS is set."""
    return int(numba.config.NUMBA_NUM_THREADS)  # type: ignore[attr-defined]


def current_threads() -> int:
    """Threads that compiled loops use now."""
    return _THREADS.get() or available_threads()


@contextmanager
def compiled_threads(threads: int | None = None) -> Iterator[int]:
    """Let compiled loops use so many threads for a while; afterwards the number is what it was.

    Every Python thread has a number of its own.

    Parameters
    ----------
    threads : int, optional
        Number of threads; by default as many as before.

    Yields
    ------
    int
        The number of threads.

    Raises
    ------
    InputError
        If there are not so many.

    Examples
    --------
    >>> with compiled_threads(1) as threads:
    ...     print(threads, current_threads())
    1 1
    """
    most = available_threads()
    if threads is not None and whole("threads", threads, at_least=1) > most:
        raise InputError(f"threads must not exceed {most}, one per core: got {threads}.")
    before = _THREADS.set(threads or _THREADS.get())
    try:
        yield current_threads()
    finally:
        _THREADS.reset(before)


Work = Callable[[int, int], Any]
"""Compiled work on consecutive numbers, from the first up to but not including the last."""


@contextmanager
def worker_threads() -> Iterator[Callable[[Work, Sequence[tuple[int, int]]], list[Any]]]:
    """Share work out to as many threads as compiled loops may use, the caller's among them.

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
    threads = current_threads()

    def each(work: Work, chunks: Sequence[tuple[int, int]]) -> list[Any]:
        if threads == 1 or len(chunks) == 1:
            return list(starmap(work, chunks))
        answers: list[Any] = [None] * len(chunks)
        numbers = iter(range(len(chunks)))

        def take() -> None:
            for n in numbers:
                answers[n] = work(*chunks[n])

        others = [_helpers(threads).submit(take) for _ in range(min(threads, len(chunks)) - 1)]
        take()
        for other in others:
            other.result()
        return answers

    yield each
