"""Outlines that overlap, joined to outlines that do not: a letter with its cedilla, letters that touch."""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np

from fingerpad.core.checks import FloatArray

_BESIDE = 1e-6
"""Distance from a piece at which its sides are looked at, over the extent of all."""

_SAME = 1e-9
"""Distance of places that are one, over the extent of all."""


def joined_outlines(outlines: Sequence[FloatArray]) -> list[FloatArray]:
    """Boundary of what closed outlines enclose, where those that turn the other way cut out."""
    whole = np.concatenate([np.stack([line, np.roll(line, -1, axis=0)], axis=1) for line in outlines])
    extent = float(np.ptp(whole, axis=(0, 1)).max())
    parts = _parted(whole, _SAME * extent)
    along = parts[:, 1] - parts[:, 0]
    left = np.column_stack([-along[:, 1], along[:, 0]]) / np.linalg.norm(along, axis=1)[:, None]
    middle = parts.mean(axis=1)
    inside, outside = (_turns(middle + side * _BESIDE * extent * left, whole) != 0 for side in (1.0, -1.0))
    kept = inside != outside
    directed = np.where(inside[kept][:, None, None], parts[kept], parts[kept][:, ::-1])
    return _chained(directed, _SAME * extent)


def _parted(pieces: FloatArray, same: float) -> FloatArray:
    """Pieces, parted where they cross each other, (n, 2, 2)."""
    begin, along = pieces[:, 0], pieces[:, 1] - pieces[:, 0]
    turn = along[:, None, 0] * along[None, :, 1] - along[:, None, 1] * along[None, :, 0]
    apart = begin[None] - begin[:, None]
    with np.errstate(divide="ignore", invalid="ignore"):
        share = (apart[..., 0] * along[None, :, 1] - apart[..., 1] * along[None, :, 0]) / turn
    length = np.linalg.norm(along, axis=1)
    margin = same / length
    crossed = (
        (np.abs(turn) > 1e-12 * np.outer(length, length))
        & (share > margin[:, None])
        & (share < 1.0 - margin[:, None])
    )
    crossed &= ((-margin[None] <= share.T) & (1.0 + margin[None] >= share.T)) | ~np.isfinite(share.T)
    found = []
    for number, (start, way) in enumerate(zip(begin, along, strict=True)):
        shares = np.unique(np.concatenate([[0.0, 1.0], share[number, crossed[number]]]))
        shares = shares[np.concatenate([[True], np.diff(shares) > margin[number]])]
        points = start + shares[:, None] * way
        found.append(np.stack([points[:-1], points[1:]], axis=1))
    return np.concatenate(found)


def _turns(points: FloatArray, pieces: FloatArray) -> np.ndarray:
    """How often outlines go around each point (n, 2), counter-clockwise less clockwise."""
    (x0, y0), (x1, y1) = pieces[:, 0].T, pieces[:, 1].T
    x, y = points[:, :1], points[:, 1:]
    upwards, downwards = (y0 <= y) & (y1 > y), (y1 <= y) & (y0 > y)
    with np.errstate(divide="ignore", invalid="ignore"):
        seen = x < x0 + (y - y0) / (y1 - y0) * (x1 - x0)
    return (upwards & seen).sum(axis=1) - (downwards & seen).sum(axis=1)


def _chained(pieces: FloatArray, same: float) -> list[FloatArray]:
    """Join directed pieces end to begin into closed outlines."""
    keys = np.round(pieces / (4.0 * same)).astype(np.int64)
    following: dict[tuple[int, int], dict[tuple[int, int], FloatArray]] = {}
    for piece, (begin, end) in zip(pieces, keys.tolist(), strict=True):
        following.setdefault(tuple(begin), {})[tuple(end)] = piece[0]
    found = []
    while following:
        first = here = next(iter(following))
        corners = []
        while here in following:
            ends = following[here]
            there, corner = ends.popitem()
            if not ends:
                del following[here]
            corners.append(corner)
            here = there
            if here == first:
                break
        found.append(np.array(corners))
    return found
