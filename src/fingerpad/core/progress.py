"""Progress of a run: one protocol for every command and every long computation."""

from __future__ import annotations

import time
from collections.abc import Callable, Iterator
from contextlib import AbstractContextManager, contextmanager
from typing import Protocol

from fingerpad.core.errors import InputError


class Progress(Protocol):
    """Reports the progress of a run."""

    def stage(self, name: str, total: int) -> AbstractContextManager[Callable[[], None]]:
        """Open a stage of `total` parts; call the result once per finished part."""
        ...


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
        Shortest time between two lines of a stage. [s]
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
        began = last = time.monotonic()
        done = 0

        def advance() -> None:
            nonlocal last, done
            done, now = done + 1, time.monotonic()
            if now - last >= self._every_s or (done == total and (self._short or last > began)):
                left_s = (now - began) / done * (total - done)
                self._tell(f"{name}: {done} of {total}, {left_s:.0f} s left")
                last = now

        yield advance


def notebook_progress() -> Progress:
    """Progress in a notebook: one line below the cell, which changes twice a second.

    Returns
    -------
    Progress
        For `run_sweep(..., progress=fp.notebook_progress())` and others.

    Raises
    ------
    InputError
        If there is no notebook.
    """
    try:
        from IPython.display import display
    except ImportError as error:
        raise InputError("notebook_progress needs IPython, as in a notebook: it is not installed.") from error
    line = display({"text/plain": ""}, raw=True, display_id=True)
    return Lines(lambda text: line.update({"text/plain": text}, raw=True), every_s=0.5)
