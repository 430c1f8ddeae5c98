"""Rigid bodies with edges: a flat body that ends, a bar with a gap, a grating.

Their frame is that of `fingerpad.geometry.indenters`. All three are composed of corners: all points with
u <= 0 and y <= 0, with a rounded edge. A ridge is the intersection of two corners, and its gap is the larger
of their gaps. This is exact on both sides of its face if the flat between the two fillets is not negative.
"""

from __future__ import annotations

from dataclasses import fields, replace
from typing import TYPE_CHECKING

import numpy as np

from fingerpad.core.checked import OtherName, other_names, value_class
from fingerpad.core.errors import InputError
from fingerpad.core.values import Finite, FloatArray, NotNegative, PointsMm, SizeMm, positive
from fingerpad.data import protocol
from fingerpad.geometry.indenters import (
    BESIDE_EDGE_MM,
    Bar,
    Cylinder,
    FlatPunch,
    Indenter,
    Line,
    Plate,
    Sphere,
    fillet_within,
    round_front,
    rounded,
)


def _corner(
    u_mm: FloatArray, y_mm: FloatArray, radius_mm: float, outward: FloatArray
) -> tuple[FloatArray, FloatArray]:
    """Gap and normal of all points with u <= 0 and y <= 0, from u along the unit vectors `outward` (n, 3)."""
    return rounded(u_mm + radius_mm, y_mm + radius_mm, outward, radius_mm)


def _along_x(signs: FloatArray) -> FloatArray:
    """Vectors (n, 3) along x with the given signs; 0 counts as positive."""
    return np.where(signs < 0.0, -1.0, 1.0)[:, None] * [1.0, 0.0, 0.0]


@value_class
class Edge(Indenter):
    """Flat body over the proximal half of the finger that ends in one rounded edge at x = 0, long in z.

    Parameters
    ----------
    fillet_mm : float
        Radius of the edge; `edge_radius_mm` is another name of it. [mm]

    Examples
    --------
    >>> gap, _ = Edge(fillet_mm=0.3).gap(np.array([[-5.0, 0.2, 0.0], [0.5, -1.0, 2.0]]))
    >>> gap.round(3).tolist()
    [0.2, 0.5]
    """

    symmetry_deg = 180.0
    fillet_mm: NotNegative = protocol.BAR_FILLET.value
    edge_radius_mm = OtherName("fillet_mm")

    if TYPE_CHECKING:

        def __init__(self, fillet_mm: float = ..., *, edge_radius_mm: float = ...) -> None: ...

    @property
    def edge_reach_mm(self) -> float:
        return self.fillet_mm + BESIDE_EDGE_MM

    def edges_mm(self, reach_mm: Finite) -> tuple[tuple[float, float], ...]:
        return ((0.0, self.fillet_mm),)

    def rounded_to(self, radius_mm: Finite) -> Edge:
        return replace(self, fillet_mm=max(self.fillet_mm, radius_mm))

    def front(self, points_mm: PointsMm) -> FloatArray:
        return round_front(points_mm[:, 0] + self.fillet_mm, self.fillet_mm)

    def gap(self, points_mm: PointsMm) -> tuple[FloatArray, FloatArray]:
        x, y = points_mm[:, 0], points_mm[:, 1]
        return _corner(x, y, self.fillet_mm, _along_x(np.ones_like(x)))


@value_class
class Gap(Indenter):
    """Flat bar across the finger with a gap along its middle: two ridges of one rigid body.

    The gap is deeper than skin can bulge. The radius of its lips is at most half of its width, so a gap of
    width 0 gives the plain bar.

    Parameters
    ----------
    gap_mm : float
        Width of the gap between its two walls; 0 for a bar without a gap. [mm]
    width_mm : float
        Full width along x, gap and fillets included. [mm]
    fillet_mm : float
        Radius of the two outer edges; `edge_radius_mm` is another name of it. [mm]
    lip_mm : float
        Radius of the two lips, if the gap is at least twice as wide; `lip_radius_mm` is another name. [mm]

    References
    ----------
    Johnson & Phillips 1981: discrimination of stimuli with and without a gap, of one overall size that is
    much larger than the gap.

    Examples
    --------
    >>> gap, _ = Gap(gap_mm=1.0).gap(np.array([[0.0, -0.5, 0.0], [2.0, -0.1, 0.0]]))
    >>> gap.round(3).tolist()
    [0.5, -0.1]
    """

    symmetry_deg = 90.0
    gap_mm: NotNegative = protocol.GAP_WIDTH.value
    width_mm: SizeMm = protocol.GAPPED_BAR_WIDTH.value
    fillet_mm: NotNegative = protocol.BAR_FILLET.value
    lip_mm: NotNegative = protocol.LIP_RADIUS.value
    edge_radius_mm = OtherName("fillet_mm")
    lip_radius_mm = OtherName("lip_mm", lambda body: min(body.lip_mm, body.gap_mm / 2))

    if TYPE_CHECKING:

        def __init__(
            self,
            gap_mm: float = ...,
            width_mm: float = ...,
            fillet_mm: float = ...,
            lip_mm: float = ...,
            *,
            edge_radius_mm: float = ...,
            lip_radius_mm: float = ...,
        ) -> None: ...

    def __post_init__(self) -> None:
        fillet_within(self.fillet_mm, self.width_mm, "width_mm")
        widest = self.width_mm - 2 * self.fillet_mm - 2 * self.lip_radius_mm
        if self.gap_mm > 0.0 and self.gap_mm >= widest:
            raise InputError(
                "gap_mm",
                f"must leave two flat ridges of the bar, so be below {widest:g} mm",
                f"{self.gap_mm:g} mm",
            )

    @property
    def half_width_mm(self) -> float:
        return self.width_mm / 2

    @property
    def edge_reach_mm(self) -> float:
        return self.gap_mm / 2 + BESIDE_EDGE_MM if self.gap_mm > 0.0 else 0.0

    @property
    def narrowest_mm(self) -> float:
        return self.gap_mm if self.gap_mm > 0.0 else np.inf

    def edges_mm(self, reach_mm: Finite) -> tuple[tuple[float, float], ...]:
        half, lip = self.width_mm / 2, self.gap_mm / 2
        lips = ((-lip, self.lip_radius_mm), (lip, self.lip_radius_mm)) if self.gap_mm > 0.0 else ()
        return ((-half, self.fillet_mm), *lips, (half, self.fillet_mm))

    def front(self, points_mm: PointsMm) -> FloatArray:
        u = np.abs(points_mm[:, 0])
        face = round_front(u - self.width_mm / 2 + self.fillet_mm, self.fillet_mm)
        if self.gap_mm == 0.0:
            return face
        return np.minimum(face, round_front(self.gap_mm / 2 - u + self.lip_radius_mm, self.lip_radius_mm))

    def gap(self, points_mm: PointsMm) -> tuple[FloatArray, FloatArray]:
        if self.gap_mm == 0.0:
            return Bar(self.width_mm, self.fillet_mm).gap(points_mm)
        x, y = points_mm[:, 0], points_mm[:, 1]
        u, outward = np.abs(x), _along_x(x)
        outer, outer_normal = _corner(u - self.width_mm / 2, y, self.fillet_mm, outward)
        inner, inner_normal = _corner(self.gap_mm / 2 - u, y, self.lip_radius_mm, -outward)
        return np.maximum(inner, outer), np.where((inner > outer)[:, None], inner_normal, outer_normal)


def _of_period(period_mm: float = 2 * protocol.RIDGE_WIDTH.value, duty: float = 0.5) -> dict[str, float]:
    """Widths of ridge and groove from the period of a grating and the share of a ridge in it."""
    if positive("duty", duty) >= 1.0:
        raise InputError("duty", "must be below 1, the share of a ridge in the period", repr(duty))
    ridge = positive("period_mm", period_mm, "mm") * duty
    return {"ridge_mm": ridge, "groove_mm": period_mm - ridge}


@value_class
class Grating(Indenter):
    """Grating larger than the finger: flat ridges across it with grooves between them, one ridge at x = 0.

    Parameters
    ----------
    ridge_mm : float
        Width of a ridge, lips included. [mm]
    groove_mm : float
        Width of a groove between its walls; grooves are deeper than skin can bulge. [mm]
    lip_mm : float
        Radius of the lips, at most half of a ridge; `edge_radius_mm` is another name of it. [mm]
    period_mm, duty : float, keywords
        Instead: from one ridge to the next, and the share of the ridge in it, by default a half. [mm, 1]

    Examples
    --------
    >>> Grating(period_mm=2.0, duty=0.25, edge_radius_mm=0.1)
    Grating(ridge_mm=0.5, groove_mm=1.5, lip_mm=0.1)
    >>> gap, _ = Grating(ridge_mm=1.0, groove_mm=1.0).gap(np.array([[2.0, 0.3, 0.0], [1.0, -0.5, 0.0]]))
    >>> gap.round(3).tolist()
    [0.3, 0.5]
    """

    symmetry_deg = 90.0
    ridge_mm: SizeMm = protocol.RIDGE_WIDTH.value
    groove_mm: SizeMm = protocol.RIDGE_WIDTH.value
    lip_mm: NotNegative = protocol.LIP_RADIUS.value
    edge_radius_mm = OtherName("lip_mm")
    period_mm = OtherName(_of_period, lambda body: body.ridge_mm + body.groove_mm)
    duty = OtherName(_of_period, lambda body: body.ridge_mm / body.period_mm)

    if TYPE_CHECKING:

        def __init__(
            self,
            ridge_mm: float = ...,
            groove_mm: float = ...,
            lip_mm: float = ...,
            *,
            edge_radius_mm: float = ...,
            period_mm: float = ...,
            duty: float = ...,
        ) -> None: ...

    def __post_init__(self) -> None:
        if self.lip_mm > self.ridge_mm / 2:
            raise InputError(
                "lip_mm", f"must not exceed half of ridge_mm, {self.ridge_mm / 2:g} mm", f"{self.lip_mm:g} mm"
            )

    @property
    def edge_reach_mm(self) -> float:
        return np.inf

    @property
    def narrowest_mm(self) -> float:
        return min(self.ridge_mm, self.groove_mm)

    def edges_mm(self, reach_mm: Finite) -> tuple[tuple[float, float], ...]:
        last = int(reach_mm / self.period_mm) + 1
        return tuple(
            (ridge * self.period_mm + side * self.ridge_mm / 2, self.lip_mm)
            for ridge in range(-last, last + 1)
            for side in (-1, 1)
        )

    def rounded_to(self, radius_mm: Finite) -> Grating:
        return replace(self, lip_mm=max(self.lip_mm, min(radius_mm, self.ridge_mm / 2)))

    def front(self, points_mm: PointsMm) -> FloatArray:
        return self._ridge.front(self._beside_ridge(points_mm))

    def gap(self, points_mm: PointsMm) -> tuple[FloatArray, FloatArray]:
        return self._ridge.gap(self._beside_ridge(points_mm))

    @property
    def _ridge(self) -> Bar:
        return Bar(self.ridge_mm, self.lip_mm)

    def _beside_ridge(self, points_mm: FloatArray) -> FloatArray:
        beside = points_mm.copy()
        beside[:, 0] -= self.period_mm * np.round(points_mm[:, 0] / self.period_mm)
        return beside


INDENTERS: dict[str, type[Indenter]] = {
    "sphere": Sphere,
    "cylinder": Cylinder,
    "bar": Bar,
    "line": Line,
    "punch": FlatPunch,
    "plate": Plate,
    "edge": Edge,
    "gap": Gap,
    "grating": Grating,
}

_FIELDS = {
    name: [size.name for size in fields(kind)]  # type: ignore[arg-type]
    for name, kind in INDENTERS.items()
}


def sizes_of(indenter: str) -> tuple[str, ...]:
    """Sizes that an indenter has: fields of its class, then other names."""
    return tuple(dict.fromkeys([*_FIELDS[indenter], *other_names(INDENTERS[indenter])]))


SIZES = tuple(dict.fromkeys(size for name in INDENTERS for size in sizes_of(name)))
"""Sizes of all indenters, other names of sizes included."""
