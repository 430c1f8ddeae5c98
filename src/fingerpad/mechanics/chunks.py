"""Elements in chunks that threads may add up at the same time, with the same bits on any number of threads.

Two elements that share a node add to the same numbers. So elements are taken in chunks of consecutive
numbers, near each other in a mesh, and the chunks get colours: no two of one colour share a node. Colour
after colour, threads add up the chunks of a colour, each from its first element to its last. Which elements
add to a node, and in which order, depends on chunks and colours, and these on the mesh alone.
"""

from __future__ import annotations

import numpy as np

Chunk = tuple[int, int]
"""Consecutive numbers, from the first up to but not including the last."""

MANY_CHUNKS = 128
"""Chunks of a large mesh: enough for every thread, few enough to cut the mesh in few places."""
FEWEST_ELEMENTS = 128
"""Elements of a chunk, at least: a smaller one would not be worth a thread's while."""


def even_chunks(count: int) -> list[Chunk]:
    """Cut `count` numbers in chunks of one size; only the last may be smaller.

    Examples
    --------
    >>> even_chunks(300)
    [(0, 128), (128, 256), (256, 300)]
    """
    size = max(FEWEST_ELEMENTS, -(-count // MANY_CHUNKS))
    return [(first, min(first + size, count)) for first in range(0, count, size)]


def coloured_chunks(elements: np.ndarray, n_nodes: int) -> list[list[Chunk]]:
    """Chunks of a mesh by colour, each in the first colour that is free.

    Parameters
    ----------
    elements : int array (n_elements, 8)
        Nodes of each element.
    n_nodes : int
        Number of nodes of the mesh.

    Returns
    -------
    list of list of (int, int)
        For each colour its chunks, of which no two share a node.

    Examples
    --------
    A row of 400 elements takes every second chunk in the first colour:

    >>> row = np.arange(400)[:, None] + np.array([0, 1, 1, 0, 0, 1, 1, 0])
    >>> coloured_chunks(row, n_nodes=401)
    [[(0, 128), (256, 384)], [(128, 256), (384, 400)]]
    """
    colours: list[list[Chunk]] = []
    touched: list[np.ndarray] = []  # for each colour, whether it touches a node
    for first, last in even_chunks(len(elements)):
        nodes = elements[first:last]
        free = (colour for colour, taken in enumerate(touched) if not taken[nodes].any())
        colour = next(free, len(colours))
        if colour == len(colours):
            colours.append([])
            touched.append(np.zeros(n_nodes, dtype=bool))
        colours[colour].append((first, last))
        touched[colour][nodes] = True
    return colours
