"""Messages while functions are compiled: half a minute for the first press, some seconds for other calls."""

from __future__ import annotations

import subprocess
import sys
from collections.abc import Iterator, Sequence
from contextlib import contextmanager, suppress
from threading import Event, Thread
from time import monotonic
from typing import Any

from fingerpad.core.logger import LOGGER
from fingerpad.core.numba_internals import is_compiled

SUBJECT = "fingerpad compiles its kernels"
NOTICE = f"{SUBJECT}, once: about half a minute on one core."

SHORT_NOTICE = "fingerpad compiles what this call needs, once: some seconds."

AHEAD = "fingerpad.experiments.compile_ahead"
"""Module that compiles the last half of the kernels when it is run; started here, it is imported nowhere."""

INTERVAL_S = 5.0  # Time between two messages. [s]

_announced = False
_told = False


def tell_once() -> None:
    """Say once that a call compiles its functions, unless a press has said so."""
    global _told
    if not (_told or _announced):
        _told = True
        LOGGER.warning(SHORT_NOTICE)


@contextmanager
def announce_compilation(kernels: Sequence[Any], on_two_cores: bool = False) -> Iterator[None]:
    """Log that kernels are compiled, and every few seconds how many, while the `with` block runs.

    On two cores another process compiles a part of them, into the cache that both read.

    Nothing is logged if the first kernel is compiled already, and in one process only one block logs. The
    level is WARNING: without configuration Python writes WARNING to standard error and drops INFO.
    `logging.getLogger("fingerpad").setLevel("ERROR")` turns the messages off.
    """
    global _announced
    if _announced or not kernels or is_compiled(kernels[0]):
        yield
        return
    _announced = True
    LOGGER.warning(NOTICE)
    if on_two_cores:
        Thread(target=_compile_ahead, daemon=True).start()
    finished = Event()
    reporter = Thread(target=_report, args=(kernels, finished), daemon=True)
    reporter.start()
    try:
        yield
    finally:
        finished.set()
        reporter.join()


def _compile_ahead() -> None:
    """Let another process compile what comes last, and wait for its end in this thread."""
    nowhere = subprocess.DEVNULL
    # Where no process can be started, all is compiled here.
    with suppress(OSError):
        subprocess.run([sys.executable, "-m", AHEAD], stdin=nowhere, stdout=nowhere, stderr=nowhere)


def _report(kernels: Sequence[Any], finished: Event) -> None:
    started, last = monotonic(), -1
    while not finished.wait(INTERVAL_S):
        done = sum(is_compiled(kernel) for kernel in kernels)
        if done > last:
            seconds = monotonic() - started
            LOGGER.warning("%s: %d of %d done after %.0f s.", SUBJECT, done, len(kernels), seconds)
        last = done
        if done == len(kernels):
            return
