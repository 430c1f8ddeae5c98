"""Progress of a run: one protocol for every command and every long computation."""

from __future__ import annotations

from collections.abc import Callable, Iterator
from contextlib import AbstractContextManager, contextmanager
from typing import Protocol


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
