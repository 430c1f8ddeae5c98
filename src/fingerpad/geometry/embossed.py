"""Raised shapes on a plate: letters, or any closed outlines, with rounded edges."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import replace
from functools import cached_property
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

BESIDE_MM = 1e-6  # Beside the middle of a piece is its inside or outside. [mm]

SAME = 1e-9  # Share of a piece, or cosine, that is round-off.

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
    >>> button.stroke_mm
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
        if self._crosses():
            raise InputError("Outlines must not touch or cross, each other or themselves: they do.")
        sizes = {"height_mm": self.height_mm, "half of the narrowest stroke": self.stroke_mm / 2}
        for name, most in sizes.items():
            if self.edge_radius_mm > most * (1.0 + 1e-9):
                raise InputError(
                    "edge_radius_mm", f"must not exceed {name}, {most:.3g} mm", f"{self.edge_radius_mm:g} mm"
                )

    @cached_property
    def stroke_mm(self) -> float:
        """Width of the narrowest stroke. [mm]"""
        # From the middle of each piece the nearest piece that faces it is sought at a right angle.
        facing = self._normals @ self._normals.T < OPPOSITE
        t, s = self._shares(self._pieces.mean(axis=1), -self._normals)
        return float(t[facing & (t > 0.0) & (s >= 0.0) & (s <= 1.0)].min(initial=np.inf))

    def gap(self, points_mm: PointsMm) -> tuple[FloatArray, FloatArray]:
        points_mm = np.ascontiguousarray(points_mm, dtype=np.float64)
        beyond, outward = _beyond_outline(points_mm, self._pieces, self._normals)
        radius = self.edge_radius_mm
        shape, normal = rounded(beyond + radius, points_mm[:, 1] + radius, outward, radius)
        plate = points_mm[:, 1] + self.height_mm
        return np.minimum(shape, plate), np.where((shape < plate)[:, None], normal, [0.0, 1.0, 0.0])

    def rounded_to(self, radius_mm: Finite) -> Embossed:
        most_mm = min(radius_mm, self.height_mm, self.stroke_mm / 2)
        return replace(self, edge_radius_mm=max(self.edge_radius_mm, most_mm))

    @cached_property
    def _pieces(self) -> FloatArray:
        """Pieces of all outlines: begin and end, x and z, (n, 2, 2). [mm]"""
        lines = map(np.array, self.outlines_mm)
        return np.concatenate([np.stack([line, np.roll(line, -1, axis=0)], axis=1) for line in lines])

    @cached_property
    def _normals(self) -> FloatArray:
        """Direction out of the shape at each piece, x and z, (n, 2)."""
        along = self._pieces[:, 1] - self._pieces[:, 0]
        right = np.column_stack([along[:, 1], -along[:, 0]]) / np.linalg.norm(along, axis=1)[:, None]
        beside = np.insert(self._pieces.mean(axis=1) + BESIDE_MM * right, 1, 0.0, axis=1)
        return np.sign(_beyond_outline(beside, self._pieces, right)[0])[:, None] * right

    def _crosses(self) -> bool:
        """Whether two pieces meet other than at the corner between them."""
        begin, along = self._pieces[:, 0], self._pieces[:, 1] - self._pieces[:, 0]
        ends = np.cumsum([len(line) for line in self.outlines_mm])
        here, ahead = np.arange(len(begin)), np.arange(len(begin)) + 1
        ahead[ends - 1] = np.append(0, ends[:-1])
        shares = self._shares(begin, along)
        meets = np.all(np.abs(shares - 0.5) <= 0.5 + SAME, axis=0)
        meets[here, here] = meets[here, ahead] = meets[ahead, here] = False
        way = along / np.linalg.norm(along, axis=1)[:, None]
        folds = (way * way[ahead]).sum(axis=1) < SAME - 1.0
        return bool(meets.any() or folds.any())

    def _shares(self, begin: FloatArray, way: FloatArray) -> FloatArray:
        """Shares of ways and of pieces at which their lines cross, infinite if parallel, (2, n, n_pieces)."""
        # begin + t way = piece + s along
        piece, along = self._pieces[:, 0], self._pieces[:, 1] - self._pieces[:, 0]
        turn = way[:, None, 0] * along[:, 1] - way[:, None, 1] * along[:, 0]
        apart = piece - begin[:, None]
        t = apart[..., 0] * along[:, 1] - apart[..., 1] * along[:, 0]
        s = apart[..., 0] * way[:, None, 1] - apart[..., 1] * way[:, None, 0]
        return np.divide([t, s], turn, out=np.full((2, *turn.shape), np.inf), where=turn != 0.0)


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
    >>> round(letter.stroke_mm, 2)
    2.06
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
    corners = joined_outlines(turned)
    return Embossed(tuple(tuple(map(tuple, line.tolist())) for line in corners), height_mm, edge_radius_mm)


def joined_outlines(outlines: Sequence[FloatArray]) -> list[FloatArray]:
    """Boundary of what closed outlines wind about, to 1e-9 mm; holes turn the other way."""
    from manifold3d import CrossSection, FillRule

    # Corners lie on a grid of 7e-9 of its unit, and those within 1e-6 of a line are left out.
    area = CrossSection([1e3 * line for line in outlines], FillRule.NonZero).simplify(1e-6)
    return [(1e-3 * line).round(9) + 0.0 for line in area.to_polygons()]


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


@njit(cache=True, nogil=True)
def _beyond_outline(
    points: FloatArray, pieces: FloatArray, normals: FloatArray
) -> tuple[FloatArray, FloatArray]:  # pragma: no cover (compiled)
    """Distance in the plane from the outlines, negative inside, and its gradient."""
    beyond, outward = np.empty(len(points)), np.zeros((len(points), 3))
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
    return beyond, outward
