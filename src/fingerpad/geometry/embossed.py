"""Raised shapes on a plate: letters, or any closed outlines, with rounded edges."""

from __future__ import annotations

from collections.abc import Sequence
from functools import cached_property
from itertools import pairwise
from typing import Annotated

import numpy as np
from numba import njit

from fingerpad.core.checked import checked, value_class
from fingerpad.core.errors import InputError
from fingerpad.core.values import Finite, Flag, FloatArray, Outlines, PointsMm, Positive, choice, float_array
from fingerpad.geometry.indenters import Indenter, rounded

OPPOSITE = -0.985
"""Two pieces of outline bound a stroke or a gap if their normals are opposite to within 10 degrees, as they
are where it is narrowest. The sides of a corner or a notch are not, however close they come."""

MOST_CORNERS = 4000
"""Most corners of all outlines together: pairs of pieces are compared, and memory grows with their number."""

DRAWN_EM = 1000.0
"""Size at which matplotlib draws letters before they are scaled; it keeps curves within a fraction of 1."""


@value_class
class Embossed(Indenter):
    """Shapes raised from a flat plate, with walls at right angles to it and rounded edges.

    Parameters
    ----------
    outlines_mm : sequence of sequences of (x, z)
        Corners of each closed outline, along and across the finger from the indenter's axis. An outline
        within another is a hole. Outlines must not touch or cross. [mm]
    height_mm : float
        Height of the shapes above the plate. [mm]
    edge_radius_mm : float
        Radius of the edges, at most the height and at most half of the narrowest stroke. [mm]

    Examples
    --------
    >>> square = [(-1.0, -1.0), (1.0, -1.0), (1.0, 1.0), (-1.0, 1.0)]
    >>> button = Embossed([square], height_mm=0.5, edge_radius_mm=0.1)
    >>> button.front(np.array([[0.0, 0.0, 0.0], [1.5, 0.0, 0.0]])).round(6).tolist()
    [0.0, -0.5]
    >>> button.relief_mm
    2.0
    """

    outlines_mm: Outlines
    height_mm: Positive = 0.5
    edge_radius_mm: Positive = 0.1

    def __post_init__(self) -> None:
        outlines = [_closed(f"outlines_mm[{number}]", line) for number, line in enumerate(self.outlines_mm)]
        if not outlines:
            raise InputError("outlines_mm", "must hold at least one outline", "none")
        corners = sum(map(len, outlines))
        if corners > MOST_CORNERS:
            raise InputError(
                "outlines_mm",
                f"must have at most {MOST_CORNERS} corners",
                str(corners),
                "take fewer letters or coarser outlines",
            )
        object.__setattr__(self, "outlines_mm", tuple(tuple(map(tuple, line.tolist())) for line in outlines))
        if _cross(self._pieces):
            raise InputError("Outlines must not touch or cross, each other or themselves: they do.")
        sizes = {"height_mm": self.height_mm, "half of the narrowest stroke": self.stroke_mm / 2}
        for name, most in sizes.items():
            if self.edge_radius_mm > most * (1.0 + 1e-9):
                raise InputError(
                    "edge_radius_mm", f"must not exceed {name}, {most:.3g} mm", f"{self.edge_radius_mm:g} mm"
                )

    @property
    def half_width_mm(self) -> float:
        """Largest distance of the shapes from the axis, along or across; the plate goes on. [mm]"""
        return float(np.abs(self._pieces).max())

    @property
    def relief_mm(self) -> float:
        return float(self._widths_mm.min())

    @property
    def narrowest_mm(self) -> float:
        return self.relief_mm

    @property
    def stroke_mm(self) -> float:
        """Width of the narrowest stroke. [mm]"""
        return float(self._widths_mm[0])

    def gap(self, points_mm: PointsMm) -> tuple[FloatArray, FloatArray]:
        points_mm = np.ascontiguousarray(points_mm, dtype=np.float64)
        beyond, outward = np.empty(len(points_mm)), np.zeros((len(points_mm), 3))
        _beyond_outline(points_mm, self._pieces, self._normals, beyond, outward)
        radius = self.edge_radius_mm
        shape, normal = rounded(beyond + radius, points_mm[:, 1] + radius, outward, radius)
        plate = points_mm[:, 1] + self.height_mm
        return np.minimum(shape, plate), np.where((shape < plate)[:, None], normal, [0.0, 1.0, 0.0])

    @cached_property
    def _pieces(self) -> FloatArray:
        """Straight pieces of all outlines: begin and end, x and z, (n, 2, 2). [mm]"""
        return _pieces(self.outlines_mm)

    @cached_property
    def _normals(self) -> FloatArray:
        """Direction out of the shape at each piece, x and z, (n, 2)."""
        begin, end = self._pieces[:, 0], self._pieces[:, 1]
        along = end - begin
        length = np.linalg.norm(along, axis=1)[:, None]
        normal = np.column_stack([along[:, 1], -along[:, 0]]) / length
        # A point beside the middle of each piece, much nearer to it than any other piece is.
        beside = 0.5 * (begin + end) + 1e-6 * length * normal
        inside = _crossings(beside, self._pieces) % 2 == 1
        return np.where(inside[:, None], -normal, normal)

    @cached_property
    def _widths_mm(self) -> FloatArray:
        """Width of the narrowest stroke, and of the narrowest hole or gap; infinite without one. [mm]"""
        # From the middle of each piece the nearest piece that faces it is sought at a right angle.
        begin, end = self._pieces[:, 0], self._pieces[:, 1]
        middle, along = 0.5 * (begin + end), end - begin
        facing = self._normals @ self._normals.T < OPPOSITE
        widths = np.full(2, np.inf)
        for side, sign in enumerate((-1.0, 1.0)):
            way = sign * self._normals
            # middle + t way = begin + s along
            turn = way[:, None, 0] * along[:, 1] - way[:, None, 1] * along[:, 0]
            apart = begin[None] - middle[:, None]
            with np.errstate(divide="ignore", invalid="ignore"):
                t = (apart[..., 0] * along[:, 1] - apart[..., 1] * along[:, 0]) / turn
                s = (apart[..., 0] * way[:, None, 1] - apart[..., 1] * way[:, None, 0]) / turn
            hit = facing & (np.abs(turn) > 0.0) & (t > 0.0) & (s >= 0.0) & (s <= 1.0)
            widths[side] = np.where(hit, t, np.inf).min()
        return widths


@checked
def embossed_text(
    text: str,
    capital_mm: Positive = 6.0,
    height_mm: Finite = 0.5,
    edge_radius_mm: Finite = 0.1,
    along_finger: Flag = False,
    weight: Annotated[str, choice(("normal", "bold"))] = "bold",
) -> Embossed:
    """Emboss letters of DejaVu Sans, their middle on the indenter's axis.

    The letters are read by a finger that points up the page; with `along_finger` the line of text runs
    towards the tip of the finger. Curves of the outlines are straight pieces.

    Parameters
    ----------
    text : str
        One line of letters, digits and signs that the font has.
    capital_mm : float
        Height of a capital H in the plane of the plate. [mm]
    height_mm : float
        Height of the letters above the plate. [mm]
    edge_radius_mm : float
        Radius of their edges, at most half of the narrowest stroke. [mm]
    along_finger : bool
        Whether the line of text runs along the finger instead of across it.
    weight : {"normal", "bold"}
        Width of the strokes: 0.13 or 0.26 of `capital_mm` in a capital I.

    Examples
    --------
    >>> letter = embossed_text("I", capital_mm=8.0)
    >>> letter.half_width_mm, round(letter.stroke_mm, 2)
    (4.0, 2.06)
    """
    from matplotlib.font_manager import FontProperties, findfont, get_font
    from matplotlib.path import Path
    from matplotlib.textpath import text_to_path

    if not isinstance(text, str) or not text.strip():
        raise InputError("text", "must have at least one letter", repr(text))
    font = FontProperties(family="DejaVu Sans", weight=weight)
    known = get_font(findfont(font)).get_charmap()
    unknown = sorted(character for character in set(text) if ord(character) not in known)
    if unknown:
        raise InputError("text", "must have characters of DejaVu Sans", repr(unknown[0]))

    def drawn(line: str) -> list[FloatArray]:
        corners, codes = text_to_path.get_text_path(font, line)
        path = Path(np.array(corners) * (DRAWN_EM / text_to_path.FONT_SCALE), codes)
        return [np.asarray(outline, dtype=np.float64) for outline in path.to_polygons()]

    outlines = drawn(text)
    if not outlines:
        raise InputError("text", "must have letters with an outline", repr(text))
    scale = capital_mm / np.ptp(np.concatenate(drawn("H"))[:, 1])
    every = np.concatenate(outlines)
    middle = 0.5 * (every.min(axis=0) + every.max(axis=0))
    placed = [scale * (outline - middle) for outline in outlines]
    # Seen from the skin, z runs to the right where x, to the tip, runs up.
    turned = [line * [1.0, -1.0] if along_finger else line[:, ::-1] for line in placed]
    corners = list(map(_corners, turned))
    if _cross(_pieces(corners)):
        corners = list(map(_corners, joined_outlines([np.array(line) for line in corners])))
    return Embossed(tuple(corners), height_mm, edge_radius_mm)


def _pieces(outlines: Sequence[Sequence[tuple[float, float]] | FloatArray]) -> FloatArray:
    """Straight pieces of closed outlines: begin and end, (n, 2, 2)."""
    lines = [np.array(line) for line in outlines]
    return np.concatenate([np.stack([line, np.roll(line, -1, axis=0)], axis=1) for line in lines])


def _corners(outline: FloatArray) -> tuple[tuple[float, float], ...]:
    """Corners of an outline to 1e-9 mm, without a second one at the same place. [mm]"""
    corners = list(map(tuple, (outline.round(9) + 0.0).tolist()))
    kept = [corners[0], *(after for before, after in pairwise(corners) if after != before)]
    return tuple(kept[:-1] if kept[0] == kept[-1] else kept)


def _closed(name: str, outline: Sequence[tuple[float, float]]) -> FloatArray:
    """Corners (n, 2) of one outline that has an area, the first not repeated at the end. [mm]"""
    corners = float_array(name, outline, 2)
    if len(corners) > 1 and corners.shape[1] == 2 and (corners[0] == corners[-1]).all():
        corners = corners[:-1]
    if len(corners) < 3 or corners.shape[1] != 2:
        raise InputError(name, "must have at least three corners x, z", f"shape {np.shape(outline)}")
    ahead = np.roll(corners, -1, axis=0)
    if (corners == ahead).all(axis=1).any():
        raise InputError(name, "must not have one corner twice in a row", remedy="it has")
    return corners


def _crossings(points: FloatArray, pieces: FloatArray) -> np.ndarray:
    """Count the pieces that each point (n, 2) sees along x; it is inside if the number is odd."""
    (x0, z0), (x1, z1) = pieces[:, 0].T, pieces[:, 1].T
    x, z = points[:, :1], points[:, 1:]
    passes = (z0 > z) != (z1 > z)
    with np.errstate(divide="ignore", invalid="ignore"):
        seen = x < x0 + (z - z0) / (z1 - z0) * (x1 - x0)
    return (passes & seen).sum(axis=1)


def _cross(pieces: FloatArray) -> bool:
    """Whether any two pieces that are not neighbours meet, or neighbours fold back."""
    begin, end = pieces[:, 0], pieces[:, 1]

    def side(of: FloatArray) -> FloatArray:
        """Side of each piece (row) on which each point (column) lies, 0 on its line."""
        along, to = (end - begin)[:, None], of[None] - begin[:, None]
        turn = along[..., 0] * to[..., 1] - along[..., 1] * to[..., 0]
        scale = np.linalg.norm(along, axis=2) * np.abs(pieces).max()
        return np.where(np.abs(turn) > 1e-12 * scale, np.sign(turn), 0.0)

    of_begin, of_end = side(begin), side(end)
    apart = of_begin * of_end
    meets = (apart <= 0.0) & (apart.T <= 0.0)
    low, high = pieces.min(axis=1), pieces.max(axis=1)
    meets &= ((low[:, None] <= high[None]) & (low[None] <= high[:, None])).all(axis=2)
    shares = (begin[:, None] == end[None]).all(axis=2)
    neighbours = shares | shares.T | np.eye(len(pieces), dtype=bool)
    # Neighbours share one corner; an outline that comes back to a corner has more than one before it.
    return bool((meets & ~neighbours).any() or (shares.sum(axis=1) != 1).any())


@njit(cache=True, nogil=True)
def _beyond_outline(
    points: FloatArray, pieces: FloatArray, normals: FloatArray, beyond: FloatArray, outward: FloatArray
) -> None:  # pragma: no cover (compiled)
    """Distance in the plane from the outlines, negative inside, and its gradient."""
    for number in range(len(points)):
        x, z = points[number, 0], points[number, 2]
        nearest, piece, inside = np.inf, 0, False
        to_x, to_z = 0.0, 0.0
        for k in range(len(pieces)):
            x0, z0, x1, z1 = pieces[k, 0, 0], pieces[k, 0, 1], pieces[k, 1, 0], pieces[k, 1, 1]
            dx, dz = x1 - x0, z1 - z0
            if (z0 > z) != (z1 > z) and x < x0 + (z - z0) / dz * dx:
                inside = not inside
            share = min(1.0, max(0.0, ((x - x0) * dx + (z - z0) * dz) / (dx * dx + dz * dz)))
            away_x, away_z = x - x0 - share * dx, z - z0 - share * dz
            squared = away_x * away_x + away_z * away_z
            if squared < nearest:
                nearest, piece, to_x, to_z = squared, k, away_x, away_z
        length, sign = np.sqrt(nearest), -1.0 if inside else 1.0
        beyond[number] = sign * length
        if length > 1e-9:
            outward[number, 0], outward[number, 2] = sign * to_x / length, sign * to_z / length
        else:
            outward[number, 0], outward[number, 2] = normals[piece, 0], normals[piece, 1]


_BESIDE = 1e-6  # Distance from a piece at which its sides are looked at, over the extent of all.
_SAME = 1e-9  # Distance of places that are one, over the extent of all.


def joined_outlines(outlines: Sequence[FloatArray]) -> list[FloatArray]:
    """Boundary of what closed outlines enclose, where those that turn the other way cut out."""
    whole = _pieces(outlines)
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
