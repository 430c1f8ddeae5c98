"""Say that the first press compiles its kernels: for a minute nothing else seems to happen."""

from __future__ import annotations

import logging
from functools import cache
from typing import Any

NOTICE = "fingerpad compiles its kernels, once: about a minute."

LOGGER = logging.getLogger("fingerpad")
"""Where the notice goes: to standard error, unless logging is set up otherwise."""


def is_compiled(kernel: Any) -> bool:
    """Whether a cached Numba kernel need not be compiled.

    Parameters
    ----------
    kernel : Numba dispatcher
        A function decorated with `njit(cache=True)`.

    Returns
    -------
    bool
        True if it was compiled in this process, or lies on disk as this Python and this Numba make it from
        the source as it is now; also where nothing is compiled at all, as under NUMBA_DISABLE_JIT.
    """
    if getattr(kernel, "signatures", ()):
        return True
    try:
        # Numba's own reading of its index, which comes out empty if another version or source made it.
        return bool(kernel._cache._cache_file._load_index())
    except AttributeError:
        return True


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
