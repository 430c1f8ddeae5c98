"""Elements in chunks that threads may add up at the same time, with the same bits on any number of threads.

Two elements that share a node add to the same numbers. So elements are taken in chunks of consecutive
numbers, near each other in a mesh, and the chunks get colours: no two of one colour share a node. Colour
after colour, threads add up the chunks of a colour, each from its first element to its last. Which elements
add to a node, and in which order, depends on chunks and colours, and these on the mesh alone.
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

MANY_CHUNKS = 128
"""Chunks of a large mesh: enough for every thread, few enough to cut the mesh in few places."""
FEWEST_ELEMENTS = 64
"""Elements of a chunk, at least: a smaller one would not be worth a thread's while."""


@dataclass(frozen=True)
class Chunks:
    """Chunks of consecutive elements, ordered by colour.

    Parameters
    ----------
    first, last : int array (n_chunks,)
        Elements of a chunk, from `first` up to but not including `last`.
    colour_start : int array (n_colours + 1,)
        First chunk of every colour, and the number of chunks.
    """

    first: np.ndarray
    last: np.ndarray
    colour_start: np.ndarray

    @classmethod
    def of(cls, elements: np.ndarray, n_nodes: int) -> Chunks:
        """Chunks of a mesh of `elements` (n_elements, 8), each in the first colour that is free.

        Examples
        --------
        A row of 200 elements takes four chunks of 64 and less, every second one in the first colour:

        >>> row = np.arange(200)[:, None] + np.array([0, 1, 1, 0, 0, 1, 1, 0])
        >>> chunks = Chunks.of(row, n_nodes=201)
        >>> chunks.first.tolist(), chunks.last.tolist(), chunks.colour_start.tolist()
        ([0, 128, 64, 192], [64, 192, 128, 200], [0, 2, 4])
        """
        n = len(elements)
        size = max(FEWEST_ELEMENTS, -(-n // MANY_CHUNKS))
        first = np.arange(0, n, size)
        last = np.minimum(first + size, n)
        touched: list[np.ndarray] = []  # for each colour, whether it touches a node
        colour_of = np.empty(first.size, dtype=np.int64)
        for chunk in range(first.size):
            nodes = elements[first[chunk] : last[chunk]]
            free = (colour for colour, taken in enumerate(touched) if not taken[nodes].any())
            colour_of[chunk] = next(free, len(touched))
            if colour_of[chunk] == len(touched):
                touched.append(np.zeros(n_nodes, dtype=bool))
            touched[colour_of[chunk]][nodes] = True
        order = np.argsort(colour_of, kind="stable")
        colour_start = np.searchsorted(colour_of[order], np.arange(len(touched) + 1))
        return cls(first[order], last[order], colour_start)
