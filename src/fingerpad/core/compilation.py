"""Say that the first press compiles its kernels: for a minute nothing else seems to happen."""

from __future__ import annotations

import logging
from functools import cache
from typing import Any

from fingerpad.core.numba_internals import is_compiled

NOTICE = "fingerpad compiles its kernels, once: about a minute."

LOGGER = logging.getLogger("fingerpad")
"""Where the notice goes: to standard error, unless logging is set up otherwise."""


def announce_compilation(kernel: Any) -> None:
    """Log one line, once per process, if a kernel is about to be compiled.

    Its level is WARNING: without any set-up Python writes that to standard error, and an INFO nowhere.
    `logging.getLogger("fingerpad").setLevel("ERROR")` silences it.

    Parameters
    ----------
    kernel : Numba dispatcher
        The one whose compilation takes longest.
    """
    if not is_compiled(kernel):
        _say_once()


@cache
def _say_once() -> None:
    LOGGER.warning(NOTICE)
