"""Share work between threads, with the same bits on any number of them: docs/decisions.md#threads.

Work is a function of consecutive numbers (elements, columns, receptors or trials), cut into chunks. Chunks do
not depend on the number of threads, and results come back in the order of the chunks. Threads help only where
the work releases the interpreter lock, as NumPy does and kernels compiled with `nogil=True` do.
"""

from __future__ import annotations

import os
from collections.abc import Callable, Iterator, Sequence
from concurrent.futures import ThreadPoolExecutor
from contextlib import contextmanager
from contextvars import ContextVar, copy_context
from functools import cache
from itertools import starmap
from typing import Any, TypeVar

import numba

from fingerpad.core.compilation import tell_once
from fingerpad.core.errors import InputError
from fingerpad.core.numba_internals import tell_compilations
from fingerpad.core.values import whole

Result = TypeVar("Result")

Chunk = tuple[int, int]  # Consecutive numbers, from the first up to but not including the last.

BLOCK = 1024
"""Receptors of a block, by default: a thread is worth starting for so many, and they need little memory."""

MANY_CHUNKS = 128  # Most chunks of `even_chunks`: enough for all threads of a computer.
FEWEST_IN_CHUNK = 128
"""Fewest numbers in a chunk of `even_chunks`: handing over a smaller chunk takes as long as its work."""

_THREADS: ContextVar[int | None] = ContextVar("threads", default=None)


@cache
def _pool(threads: int) -> ThreadPoolExecutor:
    """Threads that work beside the calling thread. They block, without using the processor, until called."""
    return ThreadPoolExecutor(threads - 1, thread_name_prefix="fingerpad")


tell_compilations(tell_once)  # here, because all that compiles uses these threads

if hasattr(os, "register_at_fork"):  # not on Windows, which cannot fork
    # A forked child has none of its parent's threads, so it makes its own.
    os.register_at_fork(after_in_child=_pool.cache_clear)


def available_threads() -> int:
    """Threads that this process may use: one per core, or the value of NUMBA_NUM_THREADS."""
    return int(numba.config.NUMBA_NUM_THREADS)  # type: ignore[attr-defined]


def current_threads() -> int:
    """Threads in use now: those of the innermost `compiled_threads`, or all available ones."""
    return _THREADS.get() or available_threads()


@contextmanager
def compiled_threads(threads: int | None = None) -> Iterator[int]:
    """Set the number of threads within a `with` block; afterwards it is what it was.

    Every Python thread has a number of its own, which the threads that help it take over.
    """
    most = available_threads()
    if threads is not None and whole("threads", threads, at_least=1) > most:
        raise InputError("threads", f"must not exceed {most}, one per core", str(threads))
    before = _THREADS.set(threads or _THREADS.get())
    try:
        yield current_threads()
    finally:
        _THREADS.reset(before)


def even_chunks(count: int) -> list[Chunk]:
    """Cut `count` numbers into chunks of one size; only the last may be smaller."""
    return _chunks(count, max(FEWEST_IN_CHUNK, -(-count // MANY_CHUNKS)))


def _chunks(count: int, size: int) -> list[Chunk]:
    return [(first, min(first + size, count)) for first in range(0, count, size)]


def in_chunks(work: Callable[[int, int], Result], chunks: Sequence[Chunk]) -> list[Result]:
    """Run a function on every chunk, on `current_threads` threads, the calling one included.

    A thread that has finished a chunk takes the next one. Calls may be nested.
    """
    threads = current_threads()
    if threads == 1 or len(chunks) == 1:
        return list(starmap(work, chunks))
    results: dict[int, Result] = {}
    numbers = iter(range(len(chunks)))

    def take() -> None:
        for n in numbers:
            results[n] = work(*chunks[n])

    helpers = [_pool(threads).submit(copy_context().run, take) for _ in range(min(threads, len(chunks)) - 1)]
    take()
    for helper in helpers:
        # All chunks are taken by now. A call from within a helper must not wait for one that cannot start,
        # because all threads of the pool may be waiting too.
        if not helper.cancel():
            helper.result()
    return [results[n] for n in range(len(chunks))]


def run_kernel(kernel: Callable[..., Result], count: int, *arguments: Any) -> list[Result]:
    """Run a kernel on the chunks of `count` elements, on threads as in `in_chunks`."""
    return in_chunks(lambda first, last: kernel(*arguments, first, last), even_chunks(count))


def in_blocks(work: Callable[[slice], Result], count: int, block: int = BLOCK) -> list[Result]:
    """Run a function on slices of `count` receptors, trials or rows, on threads as in `in_chunks`."""
    return in_chunks(lambda first, last: work(slice(first, last)), _chunks(count, block))
