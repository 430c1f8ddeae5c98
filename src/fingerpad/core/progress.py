"""Progress of a run: one protocol for every command and every long computation."""

from __future__ import annotations

import threading
import time
from collections.abc import Callable, Iterator
from contextlib import AbstractContextManager, contextmanager
from contextvars import ContextVar
from dataclasses import dataclass
from typing import TYPE_CHECKING, Any, Protocol, runtime_checkable

from fingerpad.core.checked import checked
from fingerpad.core.errors import InputError

if TYPE_CHECKING:
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


@dataclass
class _Stage:
    """How far a stage is."""

    total: int
    began: float  #: Reading of the clock at its beginning. [s]
    done: int = 0
    share: float = 0.0  #: Part of the present one that is done.

    @property
    def so_far(self) -> float:
        """Parts that are done, with the share of the present one."""
        return self.done + self.share


@contextmanager
def _opened(
    total: int, show: Callable[[_Stage, bool], None], look_every_s: float
) -> Iterator[Callable[[], None]]:
    """Open a stage: `show` it, one thread at a time, when more of it is done, and else every few seconds."""
    stage, lock, over = _Stage(total, time.monotonic()), threading.Lock(), threading.Event()

    def advance() -> None:
        with lock:
            stage.done, stage.share = stage.done + 1, 0.0
            show(stage, True)

    def tell_share(share: float) -> None:
        with lock:
            stage.share = share
            show(stage, True)

    def look() -> None:
        while not over.wait(max(look_every_s, SHORTEST_WAIT_S)):
            with lock:
                show(stage, False)

    token = _tell_share.set(tell_share)
    looker = threading.Thread(target=look, name="progress", daemon=True)
    looker.start()
    try:
        yield advance
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

        def show(stage: _Stage, changed: bool) -> None:
            nonlocal last, lines
            now, ends = time.monotonic(), stage.done == total > 0 and changed
            if now - last >= self._every_s or (ends and (self._short or lines)):
                self._tell(f"{name}: {_line(stage)}")
                last, lines = now, lines + 1

        with _opened(total, show, self._every_s) as advance:
            yield advance


def _line(stage: _Stage) -> str:
    """Say how far a stage is."""
    where = f"{stage.done} of {stage.total}"
    if stage.share > 0.0:
        where = f"{stage.share:.0%} of number {stage.done + 1} of {stage.total}".replace("%", " %")
    elapsed_s = time.monotonic() - stage.began
    if stage.so_far == 0.0:
        return f"{where} after {elapsed_s:.0f} s"
    left_s = elapsed_s / stage.so_far * (stage.total - stage.so_far)
    return f"{where}, {left_s:.0f} s left"


class Bars:
    """One bar per stage on a terminal, or below the cell of a notebook, by its `display`; else nothing."""

    def __init__(self, console: Console | None, display: Callable[..., Any] | None = None):
        self._console, self._display = console, display

    @contextmanager
    def stage(self, name: str, total: int) -> Iterator[Callable[[], None]]:
        """Show one stage with its expected time."""
        from rich import progress as rich

        bars = rich.Progress(
            rich.TextColumn(f"{name:<24}"), rich.BarColumn(), rich.MofNCompleteColumn(),
            rich.TimeElapsedColumn(), rich.TextColumn("left"), rich.TimeRemainingColumn(),
            console=self._console, disable=self._console is None or not self._console.is_terminal,
        )  # fmt: skip
        task, last = bars.add_task(name, total=total), 0.0
        shown: Any = None

        def show(stage: _Stage, _: bool) -> None:
            nonlocal last, shown
            bars.update(task, completed=stage.so_far)
            now = time.monotonic()
            if self._display is None or (now - last < SHORTEST_WAIT_S and stage.done < total):
                return
            last = now
            picture = bars.make_tasks_table(bars.tasks)._repr_mimebundle_((), ())
            if shown is None:
                shown = self._display(picture, raw=True, display_id=True)
            else:
                shown.update(picture, raw=True)

        with bars, _opened(total, show, SHORTEST_WAIT_S) as advance:
            yield advance


@checked
def notebook_progress() -> Progress:
    """Progress in a notebook, a bar below the cell: `indent(..., progress=fp.notebook_progress())`."""
    try:
        from IPython.display import display
    except ImportError as error:
        needs = "needs IPython, as in a notebook"
        raise InputError("notebook_progress", needs, remedy="it is not installed") from error
    return Bars(None, display)
