"""What every command needs while it runs: a writable folder, processes, progress bars, Ctrl-C."""

from __future__ import annotations

import os
import tempfile
from collections.abc import Callable, Iterator
from contextlib import contextmanager
from pathlib import Path
from typing import TYPE_CHECKING

import typer

from fingerpad.core.errors import InputError

if TYPE_CHECKING:
    from rich.console import Console

INTERRUPTED = 130
"""Exit status after Ctrl-C, by convention."""


@contextmanager
def interruptible() -> Iterator[None]:
    """After Ctrl-C, exit with a sentence on how to continue."""
    try:
        yield
    except KeyboardInterrupt as error:
        typer.echo(
            "fingerpad: stopped. The same command continues after the last finished indentation.", err=True
        )
        raise typer.Exit(INTERRUPTED) from error


def cores() -> int:
    """Count the cores that this process may use."""
    return len(os.sched_getaffinity(0)) if hasattr(os, "sched_getaffinity") else os.cpu_count() or 1


def processes(jobs: int | None) -> int:
    """Return what `--jobs` says, or one process per core."""
    return cores() if jobs is None else jobs


def make_writable(folder: Path, name: str = "--out") -> None:
    """Create `folder` if needed, and check that a file can be written into it."""
    try:
        folder.mkdir(parents=True, exist_ok=True)
        with tempfile.TemporaryFile(dir=folder):
            pass
    except OSError as error:
        raise InputError(f"{name} must be a writable folder: {folder} is not ({error.strerror}).") from error


class Bars:
    """One progress bar per stage on a terminal; nothing elsewhere."""

    def __init__(self, console: Console):
        self._console = console

    @contextmanager
    def stage(self, name: str, total: int) -> Iterator[Callable[[], None]]:
        """Show one stage with its expected time."""
        from rich.progress import (
            BarColumn,
            MofNCompleteColumn,
            Progress,
            TextColumn,
            TimeElapsedColumn,
            TimeRemainingColumn,
        )

        bars = Progress(
            TextColumn(f"{name:<24}"), BarColumn(), MofNCompleteColumn(), TimeElapsedColumn(),
            TextColumn("left"), TimeRemainingColumn(),
            console=self._console, disable=not self._console.is_terminal,
        )  # fmt: skip
        with bars:
            task = bars.add_task(name, total=total)
            yield lambda: bars.advance(task)
