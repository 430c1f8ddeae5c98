"""A message before the first indentation compiles its kernels, which takes about a minute."""

from __future__ import annotations

import logging
from functools import cache
from typing import Any

from fingerpad.core.numba_internals import is_compiled

NOTICE = "fingerpad compiles its kernels, once: about a minute."

LOGGER = logging.getLogger("fingerpad")
"""Logger of the message: standard error, unless logging is configured otherwise."""


def announce_compilation(kernel: Any) -> None:
    """Log one line, once per process, if a kernel is about to be compiled.

    Its level is WARNING: without configuration Python writes WARNING to standard error and drops INFO.
    `logging.getLogger("fingerpad").setLevel("ERROR")` turns it off.

    Parameters
    ----------
    kernel : Numba dispatcher
        The kernel with the longest compilation.
    """
    if not is_compiled(kernel):
        _say_once()


@cache
def _say_once() -> None:
    LOGGER.warning(NOTICE)
