"""Many receptors at once: in blocks, on several threads, with the same bits on any number of them."""

from __future__ import annotations

from collections.abc import Callable
from concurrent.futures import ThreadPoolExecutor
from typing import TypeVar

from fingerpad.core.threads import available_threads

Result = TypeVar("Result")

BLOCK = 1024
"""Receptors of a block: enough to be worth a thread's while, few enough to keep memory small."""


def in_blocks(work: Callable[[slice], Result], count: int, block: int = BLOCK) -> list[Result]:
    """Do something for `count` receptors, block by block.

    Threads, one per core, share the blocks, which do not depend on their number. They help only where `work`
    lets go of the interpreter, as NumPy does and kernels compiled with `nogil`.

    Parameters
    ----------
    work : callable
        Called with the slice of receptors of each block; blocks must not depend on each other.
    count : int
        Number of receptors.
    block : int, optional
        Receptors of a block.

    Returns
    -------
    list
        One result per block, in the order of the receptors.

    Examples
    --------
    >>> in_blocks(lambda receptors: (receptors.start, receptors.stop), 5, block=2)
    [(0, 2), (2, 4), (4, 5)]
    """
    blocks = [slice(first, min(first + block, count)) for first in range(0, count, block)]
    threads = min(available_threads(), len(blocks))
    if threads < 2:
        return [work(receptors) for receptors in blocks]
    with ThreadPoolExecutor(threads) as pool:
        return list(pool.map(work, blocks))
