"""Rigid indenters as signed gaps: distance of a point of the skin from the body, and the normal there.

Every indenter has its own frame: its face touches y = 0, y is the direction of pressing (into the skin), x
runs along the finger and z across it, unless the indentation turns the body. The body fills y < 0 below its
face. `gap` is positive outside the body and negative inside; the normal points out of the body and is the
direction of the contact force without friction. Bodies are in `fingerpad.geometry.bodies`, and what makes
one of others in `fingerpad.geometry.composed`.
"""

from __future__ import annotations

from abc import ABC, abstractmethod
from dataclasses import fields, is_dataclass
from typing import ClassVar

import numpy as np

from fingerpad.core.checked import checked_class
from fingerpad.core.errors import InputError
from fingerpad.core.values import Finite, FloatArray, PointsMm
from fingerpad.geometry.probing import mirrored, traced_front

Gapped = tuple[FloatArray, FloatArray]  # Gap (n,) and outward unit normal (n, 3).
ALONG, UP, ACROSS = np.eye(3)


@checked_class
class Indenter(ABC):
    """A rigid body with a signed gap; derive from it to define a body of your own.

    Only `gap` has to be written. Make the class a frozen dataclass, so that its sizes are fields: they are
    compared and part of the key of a stored press. Fields may be arrays; write
    `@dataclass(frozen=True, eq=False)` then, and bodies are compared by their content. Give the class
    `store_key = "wedge 1"`, and another text whenever its code changes: without one, every run computes its
    presses again.

    Whether half a finger is enough is found from `gap`. A class that declares `symmetry_deg` is trusted.

    Examples
    --------
    A wedge with an angle of 90 degrees, its ridge along z, rounded with a radius of 0.5 mm:

    >>> from dataclasses import dataclass
    >>> @dataclass(frozen=True)
    ... class Wedge(Indenter):
    ...     radius_mm: float = 0.5
    ...
    ...     def gap(self, points_mm):
    ...         beside, below = points_mm[:, 0], points_mm[:, 1] + self.radius_mm
    ...         angle = np.clip(np.arctan2(beside, below), -np.pi / 4, np.pi / 4)
    ...         normal = np.column_stack([np.sin(angle), np.cos(angle), np.zeros(len(angle))])
    ...         length = beside * normal[:, 0] + below * normal[:, 1]
    ...         return length - self.radius_mm, normal
    >>> wedge = Wedge()
    >>> wedge.front(np.array([[0.0, 0.0, 0.0], [1.0, 0.0, 2.0]])).round(3).tolist()
    [0.0, -0.793]
    >>> wedge.mirrors(0.0), wedge.mirrors(30.0)
    (True, False)
    """

    symmetry_deg: ClassVar[float | None] = 180.0
    """Turn about y after which the body is again symmetric across z = 0; None if it always is. [degrees]"""

    def __eq__(self, other: object) -> bool:
        """Whether both are of one class with equal fields, arrays too."""
        return type(self) is type(other) and _content(self) == _content(other)

    def __hash__(self) -> int:
        return hash((type(self), _content(self)))

    @abstractmethod
    def gap(self, points_mm: PointsMm) -> tuple[FloatArray, FloatArray]:
        """Signed gap (n,) and outward unit normal (n, 3) at points (n, 3) of the indenter's frame. [mm]

        The gap is positive outside the body and negative inside. Near the face it is the distance; the
        normal is its gradient. Far away it may be less than the distance, with the same sign.
        """

    def closed_gap(self, points_mm: PointsMm) -> tuple[FloatArray, FloatArray]:
        """Gap and normal without straight sides below the widest section; those of `gap` by default."""
        return self.gap(points_mm)

    def front(self, points_mm: PointsMm) -> FloatArray:
        """Y of the body's face towards the skin above the x and z of points (n, 3), -inf beside it. [mm]

        By default it is found from `gap`.
        """
        return traced_front(self.gap, points_mm)

    def may_touch(self, undeformed_mm: PointsMm) -> np.ndarray:
        """Whether each undeformed point (n, 3) can come into contact; bool (n,)."""
        return np.ones(len(undeformed_mm), dtype=bool)

    @property
    def grips(self) -> bool:
        """Whether skin in contact cannot slide along the finger; False for most bodies."""
        return False

    def mirrors(self, spin_deg: Finite) -> bool:
        """Whether the body, turned by `spin_deg` about y, is its own mirror image across z = 0.

        Half a finger can be solved only then. It follows from `symmetry_deg` where the class that defines
        `gap`, or one derived from it, declares that; from `gap` itself otherwise.
        """
        kinds = type(self).__mro__
        definer = next(number for number, kind in enumerate(kinds) if "gap" in vars(kind))
        if any("symmetry_deg" in vars(kind) for kind in kinds[: definer + 1]):
            return self.symmetry_deg is None or spin_deg % self.symmetry_deg == 0.0
        return mirrored(self.gap, spin_deg)

    def rounded_to(self, radius_mm: Finite) -> Indenter:
        """Return the body with edges or a rim of at least this radius [mm], where it has any."""
        return self


def _content(body: Indenter) -> tuple[object, ...]:
    values: list[object] = [getattr(body, part.name) for part in fields(body)] if is_dataclass(body) else []
    return tuple(
        (value.shape, value.dtype.str, (value + 0).tobytes()) if isinstance(value, np.ndarray) else value
        for value in values
    )


def ball(offsets: FloatArray, radius: float) -> Gapped:
    """Gap and normal of all within a radius of a point or line, from offsets (n, 3) to it."""
    length = np.linalg.norm(offsets, axis=1)
    unit = offsets / np.where(length, length, 1.0)[:, None]
    return length - radius, np.where(length[:, None] > 0.0, unit, UP)  # at the centre the way of pressing


def from_axis(points: FloatArray) -> Gapped:
    """Distance from the axis of pressing, and the direction away from it: along the finger on the axis."""
    radial, outward = ball(points * (ALONG + ACROSS), 0.0)
    return radial, np.where(radial[:, None] > 0.0, outward, ALONG)


def corner(first: Gapped, second: Gapped) -> Gapped:
    """Gap and normal of what two bodies have in common that meet at right angles: exact if theirs are."""
    (a, of_a), (b, of_b) = first, second
    beyond = np.maximum([a, b], 0.0)
    outside = np.hypot(*beyond)
    share = beyond / np.where(outside, outside, 1.0)
    share = np.where(outside > 0.0, share, [a >= b, a < b])
    return np.where(outside > 0.0, outside, np.maximum(a, b)), (share[..., None] * [of_a, of_b]).sum(axis=0)


def rounded(inside: FloatArray, depth: FloatArray, outward: FloatArray, fillet: float) -> Gapped:
    """Gap of a body with a flat top and rounded edges, from coordinates relative to its un-rounded core.

    The body is all points within `fillet` of the core {inside <= 0, depth <= 0}: `inside` runs outwards
    along the unit vector `outward` (n, 3), `depth` along y.
    """
    gap, normal = corner((depth, np.broadcast_to(UP, outward.shape)), (inside, outward))
    return gap - fillet, normal


def nearer(first: Gapped, second: Gapped) -> Gapped:
    """Gap and normal of whichever of two bodies is nearer."""
    is_first = first[0] <= second[0]
    return np.where(is_first, first[0], second[0]), np.where(is_first[:, None], first[1], second[1])


def deeper(first: Gapped, second: Gapped) -> Gapped:
    """Give gap and normal of what two bodies have in common: exact inside, outside the distance or less."""
    return turned_out(nearer(turned_out(first), turned_out(second)))


def turned_out(body: Gapped) -> Gapped:
    """Gap and normal of all that is outside of a body."""
    return -body[0], -body[1]


def round_front(beside: FloatArray, radius: float) -> FloatArray:
    """Height y of a rounded edge or ball beside its centre line: 0 on it, -inf beyond `radius`."""
    height = np.sqrt(np.maximum(radius**2 - np.maximum(beside, 0.0) ** 2, 0.0)) - radius
    return np.where(beside <= radius, height, -np.inf)


def check_most(body: Indenter, size: str, whole: str, share: float = 0.5) -> None:
    """Raise an error if a size of a body is larger than a half, or all, of another one. [mm]"""
    most, given = getattr(body, whole) * share, getattr(body, size)
    if given > most:
        of_whole = f"{'half of ' * (share < 1.0)}{whole}"
        raise InputError(size, f"must not exceed {of_whole}, {most:g} mm", f"{given:g} mm")
