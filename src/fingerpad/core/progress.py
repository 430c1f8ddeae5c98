"""Progress of a run: one protocol for every command and every long computation."""

from __future__ import annotations

import threading
import time
from collections.abc import Callable, Iterator
from contextlib import AbstractContextManager, contextmanager
from contextvars import ContextVar
from typing import TYPE_CHECKING, Protocol, runtime_checkable

from fingerpad.core.checked import checked
from fingerpad.core.errors import InputError

if TYPE_CHECKING:
    import rich.progress
    from rich.console import Console

SHORTEST_WAIT_S = 0.5  # Shortest time between two looks at a stage in which no part has ended. [s]


@runtime_checkable
class Progress(Protocol):
    """Reports the progress of a run."""

    def stage(self, name: str, total: int) -> AbstractContextManager[Callable[[], None]]:
        """Open a stage of `total` parts; call the result once per finished part."""
        ...


_tell_share: ContextVar[Callable[[float], None] | None] = ContextVar("tell_share", default=None)


def share_done(share: float) -> None:
    """Tell the open stage of this thread how much of its present part is done.

    A part that is done in another process tells nothing.

    Parameters
    ----------
    share : float
        From 0 to 1.

    Examples
    --------
    >>> with Lines(print, every_s=0.0).stage("presses", 1) as advance:
    ...     share_done(0.5)
    ...     advance()
    presses: 50 % of number 1 of 1, 0 s left
    presses: 1 of 1, 0 s left
    """
    tell = _tell_share.get()
    if tell is not None:
        tell(share)


class _Stage:
    """How far a stage is, told by `show` at each change and every now and then."""

    def __init__(self, total: int, show: Callable[[_Stage], None]):
        self.total, self.done, self.share, self.began = total, 0, 0.0, time.monotonic()
        self.changed = False
        self._show, self._lock = show, threading.Lock()

    @property
    def so_far(self) -> float:
        """Parts that are done, with the share of the present one."""
        return self.done + self.share

    @property
    def elapsed_s(self) -> float:
        """Time since the beginning. [s]"""
        return time.monotonic() - self.began

    def advance(self) -> None:
        """Count a part that is finished."""
        self.done, self.share = self.done + 1, 0.0
        self.show(changed=True)

    def tell_share(self, share: float) -> None:
        """Take over how much of the present part is done."""
        self.share = share
        self.show(changed=True)

    def show(self, changed: bool = False) -> None:
        """Show the stage, one thread at a time; `changed` says whether more is done than before."""
        with self._lock:
            self.changed = changed
            self._show(self)

    @contextmanager
    def open(self, look_every_s: float) -> Iterator[Callable[[], None]]:
        """Take in what a part tells, and show the stage every few seconds even if nothing is told."""
        over, token = threading.Event(), _tell_share.set(self.tell_share)

        def look() -> None:
            while not over.wait(max(look_every_s, SHORTEST_WAIT_S)):
                self.show()

        looker = threading.Thread(target=look, name="progress", daemon=True)
        looker.start()
        try:
            yield self.advance
        finally:
            _tell_share.reset(token)
            over.set()
            looker.join()


class NoProgress:
    """Shows nothing."""

    @contextmanager
    def stage(self, name: str, total: int) -> Iterator[Callable[[], None]]:
        """Open a stage that is not shown."""
        yield lambda: None


class Lines:
    """One line now and then, with the expected time.

    Parameters
    ----------
    tell : callable
        Called with each line.
    every_s : float
        Time between two lines of a stage. [s]
    short : bool
        Whether a stage that is shorter tells its end, as a longer one does.

    Examples
    --------
    >>> with Lines(print).stage("presses", 2) as advance:
    ...     advance()
    ...     advance()
    presses: 2 of 2, 0 s left
    """

    def __init__(self, tell: Callable[[str], object], every_s: float = 10.0, short: bool = True):
        self._tell, self._every_s, self._short = tell, every_s, short

    @contextmanager
    def stage(self, name: str, total: int) -> Iterator[Callable[[], None]]:
        """Tell of one stage."""
        last, lines = time.monotonic(), 0

        def show(stage: _Stage) -> None:
            nonlocal last, lines
            now, ends = time.monotonic(), stage.done == total > 0 and stage.changed
            if now - last >= self._every_s or (ends and (self._short or lines)):
                self._tell(f"{name}: {_line(stage)}")
                last, lines = now, lines + 1

        with _Stage(total, show).open(self._every_s) as advance:
            yield advance


def _line(stage: _Stage) -> str:
    """Say how far a stage is."""
    where = f"{stage.done} of {stage.total}"
    if stage.share > 0.0:
        where = f"{stage.share:.0%} of number {stage.done + 1} of {stage.total}".replace("%", " %")
    if stage.so_far == 0.0:
        return f"{where} after {stage.elapsed_s:.0f} s"
    left_s = stage.elapsed_s / stage.so_far * (stage.total - stage.so_far)
    return f"{where}, {left_s:.0f} s left"


class Bars:
    """One bar per stage on a terminal; nothing elsewhere."""

    def __init__(self, console: Console):
        self._console = console

    @contextmanager
    def stage(self, name: str, total: int) -> Iterator[Callable[[], None]]:
        """Show one stage with its expected time."""
        bars = _bars(name, self._console)
        task = bars.add_task(name, total=total)
        with (
            bars,
            _Stage(total, lambda stage: bars.update(task, completed=stage.so_far)).open(1.0) as advance,
        ):
            yield advance


class NotebookBars:
    """One bar per stage below the cell of a notebook."""

    def __init__(self, display: Callable[..., object], every_s: float = 0.5):
        self._display, self._every_s = display, every_s

    @contextmanager
    def stage(self, name: str, total: int) -> Iterator[Callable[[], None]]:
        """Show one stage with its expected time."""
        bars = _bars(name)
        task, last = bars.add_task(name, total=total), 0.0
        shown: object = None

        def show(stage: _Stage) -> None:
            nonlocal last, shown
            bars.update(task, completed=stage.so_far)
            now = time.monotonic()
            if now - last < self._every_s and stage.done < total:
                return
            last = now
            picture = bars.make_tasks_table(bars.tasks)._repr_mimebundle_((), ())
            if shown is None:
                shown = self._display(picture, raw=True, display_id=True)
            else:
                shown.update(picture, raw=True)  # type: ignore[attr-defined]

        with _Stage(total, show).open(self._every_s) as advance:
            yield advance


def _bars(name: str, console: Console | None = None) -> rich.progress.Progress:
    """Return the bar of one stage, which is shown only if the console is a terminal."""
    from rich.progress import (
        BarColumn,
        MofNCompleteColumn,
        Progress,
        TextColumn,
        TimeElapsedColumn,
        TimeRemainingColumn,
    )

    return Progress(
        TextColumn(f"{name:<24}"), BarColumn(), MofNCompleteColumn(), TimeElapsedColumn(),
        TextColumn("left"), TimeRemainingColumn(),
        console=console, disable=console is None or not console.is_terminal,
    )  # fmt: skip


@checked
def notebook_progress() -> Progress:
    """Progress in a notebook: a bar below the cell, as on a terminal.

    Returns
    -------
    Progress
        For `indent(..., progress=fp.notebook_progress())`, `run_sweep` and others.
    """
    try:
        from IPython.display import display
    except ImportError as error:
        raise InputError(
            "notebook_progress", "needs IPython, as in a notebook", remedy="it is not installed"
        ) from error
    return NotebookBars(display)
