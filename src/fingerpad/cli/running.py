"""What every command needs while it runs: processes, progress bars, Ctrl-C."""

from __future__ import annotations

import logging
import os
import shlex
import signal
import sys
import threading
from collections.abc import Iterator
from contextlib import contextmanager
from functools import partial
from typing import TYPE_CHECKING

from fingerpad.core.errors import InputError
from fingerpad.core.logger import LOGGER
from fingerpad.core.progress import Bars, Lines, NoProgress, Progress

if TYPE_CHECKING:
    from fingerpad.core.engine import Engine

INTERRUPTED, TERMINATED = 130, 143  # Exit statuses after Ctrl-C and after SIGTERM, by convention.


class Terminated(KeyboardInterrupt):
    """SIGTERM came."""


@contextmanager
def signals_raise() -> Iterator[None]:
    """Let the first Ctrl-C and the first SIGTERM raise, and let a second one end the process at once.

    Modules in C turn what is raised while they are imported into an `ImportError`.
    """
    if threading.current_thread() is not threading.main_thread():
        yield
        return

    came: list[type[KeyboardInterrupt]] = []

    def raise_once(number: int, frame: object) -> None:
        for each in before:
            signal.signal(each, signal.SIG_DFL)
        came.append(Terminated if number == signal.SIGTERM else KeyboardInterrupt)
        raise came[0]

    before = {number: signal.getsignal(number) for number in (signal.SIGINT, signal.SIGTERM)}
    for number in before:
        signal.signal(number, raise_once)
    try:
        yield
    except Exception as error:
        if came:
            raise came[0] from error
        raise
    finally:
        for number, handler in before.items():
            signal.signal(number, handler)


def forget_interrupt() -> None:
    """Let this process end with its own status after a `KeyboardInterrupt`.

    CPython ends `python -m` by SIGINT instead if the exception passed through `exec` of a text, as while
    dataclasses are made, until another text is executed (`run_eval_code_obj` of its source).
    """
    exec("")


def processes(jobs: int | None) -> int:
    """Return what `--jobs` says, or one process per core that this process may use."""
    from fingerpad.core.values import whole  # loads NumPy, which help and version do without

    cores = len(os.sched_getaffinity(0)) if hasattr(os, "sched_getaffinity") else os.cpu_count() or 1
    return cores if jobs is None else whole("jobs", jobs, at_least=1)


def engine(jobs: int | None, scheduler: str | None) -> int | Engine:
    """Return the workers of `--scheduler` once it answers, or the number of processes here."""
    if scheduler is None:
        return processes(jobs)
    if jobs is not None:
        raise InputError(
            f"--jobs is the number of processes here, and --scheduler {scheduler} has workers: leave one out."
        )
    from fingerpad.experiments.cluster import Cluster

    cluster = Cluster(scheduler)
    cluster.check()
    return cluster


def command_line() -> str:
    return shlex.join(["fingerpad", *sys.argv[1:]])


def progress() -> Progress:
    """Bars on a terminal, else a line every ten seconds; nothing after `--quiet`. On standard error."""
    from rich.console import Console

    if not LOGGER.isEnabledFor(logging.WARNING):
        return NoProgress()
    console = Console(stderr=True)
    return Bars(console) if console.is_terminal else Lines(partial(print, file=sys.stderr), short=False)
